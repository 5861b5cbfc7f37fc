//! Loads and prescribed motions do what they say.

use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::load::{LoadKind, face_areas};
use pliant_mechanics::model::{Constraint, Motion};
use pliant_mechanics::tensor::{Vector, add, cross, dot, scale};
use pliant_meshing::VolumeCell;
use pliant_validation::{Random, Specimen, claim, elastic, largest, run, settle, smooth_step, soft_tissue};

const ELEMENTS: [VolumeCell; 2] = [VolumeCell::Tet, VolumeCell::Hex];

/// Edge of the blocks [m].
const EDGE: f64 = 0.1;

fn block(cells: VolumeCell) -> Specimen {
    Specimen::block([EDGE; 3], [4, 3, 5], cells, &elastic(soft_tissue()), [0.0; 3])
}

fn length(v: Vector<f64>) -> f64 {
    dot(v, v).sqrt()
}

#[test]
fn hanging_block_at_rest_pulls_with_its_weight() {
    for cells in ELEMENTS {
        // A tenth of the weight on Earth: soft tissue hangs without tearing at its glued edge.
        let hanging = block(cells).fix("z-max", [true; 3]).falling([0.0, 0.0, -0.981]).damped(30.0);
        let rest = settle(&hanging.model, 0.9 * hanging.element_bound(), 3.0);
        let weight = 1000.0 * EDGE.powi(3) * 0.981;
        let off = add(rest.reaction("fix z-max"), [0.0, 0.0, -weight]);
        claim(&format!("{cells:?}: reaction off the weight"), length(off) / weight, 1e-6);
    }
}

#[test]
fn pressure_on_a_closed_surface_has_no_resultant_in_any_shape() {
    for cells in ELEMENTS {
        let block = block(cells);
        let mut random = Random::new(7);
        let place: Vec<_> =
            block.model.rest.iter().map(|&x| add(x, scale(random.vector(), 0.2 * EDGE))).collect();
        let (mut force, mut torque, mut sum) = ([0.0; 3], [0.0; 3], 0.0);
        for face in block.surface() {
            for (node, area) in face_areas(&face, |node| place[node as usize]) {
                force = add(force, area);
                torque = add(torque, cross(place[node as usize], area));
                sum += length(area);
            }
        }
        // Round-off: some hundred faces.
        claim(&format!("{cells:?}: resultant over Σ|f|"), length(force) / sum, 1e-14);
        claim(&format!("{cells:?}: torque over Σ|f| L"), length(torque) / (sum * EDGE), 1e-14);
    }
}

#[test]
fn pressure_all_round_shrinks_the_volume_to_1_minus_p_over_kappa() {
    // U′(J) = κ (J − 1) = −p, exactly, when the shape does not change.
    let (pressure, bulk) = (2000.0, 10_000.0);
    let stretch = f64::cbrt(1.0 - pressure / bulk);
    for cells in ELEMENTS {
        let block = block(cells).on_rollers().damped(30.0);
        let faces = block.surface();
        let block = block.loaded(LoadKind::Pressure { faces, pressure }, smooth_step(0.5));
        let rest = settle(&block.model, 0.5 * block.element_bound(), 3.0);
        let off = rest.displacement.iter().zip(&block.model.rest).map(|(u, x)| {
            largest((0..3).map(|c| (u[c] - (stretch - 1.0) * x[c]).abs())) / ((1.0 - stretch) * EDGE)
        });
        claim(&format!("{cells:?}: displacements"), largest(off), 1e-6);
        let reaction = rest.reaction("fix x-min")[0];
        let area = (stretch * EDGE).powi(2);
        // The floor pushes back nothing: the pressure on the floor side itself balances the other side's.
        claim(
            &format!("{cells:?}: reaction of the floor over p A"),
            reaction.abs() / (pressure * area),
            1e-6,
        );
    }
}

#[test]
fn free_body_under_pressure_all_round_stays_where_it_is() {
    for cells in ELEMENTS {
        let block = block(cells);
        let faces = block.surface();
        let block = block.loaded(LoadKind::Pressure { faces, pressure: 500.0 }, smooth_step(0.1));
        let (_, state) = run::<f64>(&block.model, 0.5 * block.element_bound(), 0.3, |_, _| ()).unwrap();
        let mass: f64 = block.model.mass.iter().sum();
        let moments = block.model.mass.iter().zip(&state.displacement).map(|(&m, &u)| scale(u, m / mass));
        let centre = moments.fold([0.0; 3], add);
        let largest = largest(state.displacement.iter().map(|&u| length(u)));
        claim(
            &format!("{cells:?}: centre of mass over the largest displacement"),
            length(centre) / largest,
            1e-12,
        );
    }
}

#[test]
fn moved_nodes_follow_their_curve_and_a_velocity_adds_up_to_its_integral() {
    let table = Shape::Table(vec![(0.0, 0.0), (0.02, 0.7), (0.05, -0.2), (0.09, 1.0)]);
    for shape in [Shape::Ramp, Shape::SmoothStep, Shape::Polynomial, table] {
        let curve = Curve { shape, from: 0.01, to: 0.08 };
        let mut block = block(VolumeCell::Hex);
        let nodes = block.face("x-max");
        let probe = nodes[0] as usize;
        let constraint =
            |components, motion| Constraint { name: "move".into(), nodes: nodes.clone(), components, motion };
        block.model.constraints = vec![
            constraint(
                [true, false, false, false, false, false],
                Motion::Displacement([0.01, 0.0, 0.0], curve.clone()),
            ),
            constraint(
                [false, true, false, false, false, false],
                Motion::Velocity([0.0, 0.2, 0.0], curve.clone()),
            ),
        ];
        let mut worst = 0.0;
        run::<f64>(&block.model, 0.5 * block.element_bound(), 0.1, |_, state| {
            let [x, y, _] = state.displacement[probe];
            let off = [x - 0.01 * curve.value(state.time), y - 0.2 * curve.integral(state.time)];
            worst = largest(off.into_iter().map(f64::abs).chain([worst]));
        })
        .unwrap();
        claim(&format!("{:?}: off the curve [m]", curve.shape), worst, 1e-17);
    }
}

/// Turns both ends of a block about an axis outside the block. Every node of the ends stays on its circle. In
/// equilibrium the block has turned as a whole, without stress.
#[test]
fn rotated_nodes_stay_on_their_circles_and_turn_a_body_without_stress() {
    let (axis, centre, angle) = (nalgebra::Vector3::new(1.0, -2.0, 0.5), [0.02, 0.15, -0.03], 2.5);
    for cells in ELEMENTS {
        let mut block = block(cells);
        let nodes: Vec<u32> = [block.face("x-min"), block.face("x-max")].concat();
        let curve = Curve { shape: Shape::SmoothStep, from: 0.0, to: 2.0 };
        let rest = block.model.rest.clone();
        let places = nodes.iter().map(|&node| rest[node as usize]);
        let motion = Motion::rotation(axis.into(), centre, angle, curve.clone(), places);
        let constraint =
            Constraint { name: "turn".into(), nodes: nodes.clone(), components: [true; 6], motion };
        block.model.constraints = vec![constraint];
        let turned = |node: usize, part: f64| {
            let turn = nalgebra::Rotation3::new(axis.normalize() * (angle * part));
            let arm = nalgebra::Vector3::from(rest[node]) - nalgebra::Vector3::from(centre);
            Vector::<f64>::from(turn * arm - arm)
        };
        let off =
            |u: Vector<f64>, node: usize, part: f64| length(add(u, scale(turned(node, part), -1.0))) / EDGE;
        let mut worst = 0.0;
        run::<f64>(&block.model, 0.5 * block.element_bound(), 0.5, |_, state| {
            let part = curve.value(state.time);
            let deviations =
                nodes.iter().map(|&node| off(state.displacement[node as usize], node as usize, part));
            worst = largest(deviations.chain([worst]));
        })
        .unwrap();
        claim(&format!("{cells:?}: off the circles over an edge"), worst, 1e-14);
        let block = block.damped(30.0);
        let rested = settle(&block.model, 0.5 * block.element_bound(), 5.0);
        let deviations = (0..rest.len()).map(|node| off(rested.displacement[node], node, 1.0));
        claim(&format!("{cells:?}: off the rotation of the whole"), largest(deviations), 1e-6);
        // Against the force of 1 % strain on a face: some 30 Pa × 0.01 m².
        claim(&format!("{cells:?}: reaction [N]"), length(rested.reaction("turn")), 1e-5);
    }
}
