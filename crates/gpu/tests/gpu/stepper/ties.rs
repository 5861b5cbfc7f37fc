//! Bodies tied to others whose meshes do not match.

use std::time::Duration;

use pliant_contact::pose::{Pose, Trajectory};
use pliant_contact::shape::Shape;
use pliant_explicit::Wanted;
use pliant_explicit::mass_scaling::{self, Goal};
use pliant_explicit::stability::{Monitor, OnUnstable};
use pliant_explicit::{CentralDifference, Observable, State, StepError, critical_step};
use pliant_gpu::{Design, GpuError, GpuStepper, StepFailure};
use pliant_mechanics::element::Cord;
use pliant_mechanics::grip::Grip;
use pliant_mechanics::load::LoadKind;
use pliant_mechanics::mapping::Weights;
use pliant_mechanics::model::{Averaging, Cells, Constraint, Material, Model, Motion, Solid};
use pliant_mechanics::prony::{Prony, PronyPart, PronyTerm, PronyUpdate};
use pliant_mechanics::tensor::{Vector, cross, dot, sub};
use serde_json::json;

use super::against::{
    PLAIN, compare, compare_from, designs, distance, double, load, numbers, step_of, stepper,
};
use super::contact::{self, rigid, with};
use super::cube::{
    CELLS, EDGE, elastic, free_cube, held_cube, law, layer, moved_cube, neo_hookean, smooth, tets_of,
};
use super::failures::{failure_of, failure_on};
use crate::support;

/// Returns the designs that have ties, on this device.
fn with_ties(device: &pliant_gpu::Device) -> Vec<Design> {
    designs(device).filter(|&design| design != Design::Blocks).collect()
}

/// A point in a tetrahedron of the first solid, or the one nearest to it: nodes and weights.
fn carried(model: &Model, point: Vector<f64>) -> Vec<(u32, f64)> {
    let cells = &model.solids[0].cells;
    let tets: Vec<[u32; 4]> = match cells.nodes_per_cell() {
        8 => (0..cells.len()).flat_map(|cell| tets_of(&[cells.nodes(cell).try_into().unwrap()])).collect(),
        _ => (0..cells.len()).map(|cell| cells.nodes(cell).try_into().unwrap()).collect(),
    };
    let weights = |tet: &[u32; 4]| {
        let [a, b, c, d] = tet.map(|node| model.rest[node as usize]);
        let volume = |a, b, c, d| dot(sub(b, a), cross(sub(c, a), sub(d, a)));
        let whole = volume(a, b, c, d);
        let (p, of) = (point, |part: f64| part / whole);
        [of(volume(p, b, c, d)), of(volume(a, p, c, d)), of(volume(a, b, p, d)), of(volume(a, b, c, p))]
    };
    let least = |weights: [f64; 4]| weights.into_iter().fold(f64::INFINITY, f64::min);
    let tet = tets.iter().max_by(|a, b| least(weights(a)).total_cmp(&least(weights(b)))).unwrap();
    tet.iter().copied().zip(weights(tet)).filter(|(_, weight)| weight.abs() > 1e-9).collect()
}

/// Ties some nodes to the first solid.
fn tie(model: &mut Model, name: &str, nodes: Vec<u32>) {
    let rows: Vec<_> = nodes.iter().map(|&node| carried(model, model.rest[node as usize])).collect();
    let rows = Weights::from_rows(rows.iter().map(Vec::as_slice));
    model.tie(name, nodes, rows).unwrap();
}

fn lattice(counts: [u32; 3], point: impl Fn([u32; 3]) -> Vector<f64>) -> (Vec<Vector<f64>>, Vec<[u32; 8]>) {
    let triples = |[x, y, z]: [u32; 3]| {
        (0..z).flat_map(move |k| (0..y).flat_map(move |j| (0..x).map(move |i| [i, j, k])))
    };
    let [x, y, _] = counts;
    let number = move |[i, j, k]: [u32; 3]| (k * (y + 1) + j) * (x + 1) + i;
    let hex = |[i, j, k]: [u32; 3]| {
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
            .map(|[a, b, c]: [u32; 3]| number([i + a, j + b, k + c]))
    };
    (triples(counts.map(|count| count + 1)).map(point).collect(), triples(counts).map(hex).collect())
}

fn constraint(name: &str, nodes: Vec<u32>, motion: Motion) -> Constraint {
    Constraint { name: name.into(), nodes, components: [true; 6], motion }
}

/// A cube held at its base, and a block on another mesh that is tied to its top and pulled at its own.
fn tied_blocks(lower: &str, upper: &str, material: Material) -> Model {
    let mut model = held_cube(lower, elastic(neo_hookean()));
    model.bodies[0].damping = 2.0;
    let counts = [3, 5, 2];
    let (rest, hexes) = lattice(counts, |at| {
        let part = [0, 1, 2].map(|c| f64::from(at[c]) / f64::from(counts[c]));
        [EDGE * part[0], EDGE * part[1], EDGE * (1.0 + 0.4 * part[2])]
    });
    let body = model.add_body("upper", &rest);
    let first = model.bodies[body].nodes.start;
    let hexes: Vec<_> = hexes.iter().map(|hex| hex.map(|node| first + node)).collect();
    let shear = material.law.small_strain().shear;
    let cells = match upper {
        "hex8" => Cells::hex8(hexes, &model.rest, 0.1, shear),
        "hex8-full" => Cells::full_hex8(hexes, &model.rest),
        "tet4-anp" => Cells::averaged_tet4(tets_of(&hexes), &model.rest, Averaging::Nodal),
        _ => Cells::tet4(tets_of(&hexes), &model.rest),
    };
    model.add_solid(Solid::new(body, material, cells));
    let of_layer = (counts[0] + 1) * (counts[1] + 1);
    tie(&mut model, "glue", (first..first + of_layer).collect());
    let top = (first + 2 * of_layer..first + 3 * of_layer).collect();
    let pull = Motion::Displacement([0.05 * EDGE, -0.03 * EDGE, 0.2 * EDGE], smooth(0.2));
    model.constraints.push(constraint("pull", top, pull));
    model
}

fn stiff(young: f64) -> Material {
    elastic(law("neo-hookean", json!({ "young-modulus": young, "poisson-ratio": 0.3 })))
}

/// A wall on the top of a cube, with triangles of its own.
fn walled(mut model: Model) -> Model {
    let (rest, hexes) = lattice([7, 5, 1], |[i, j, k]| {
        // Beyond the edges, and off the top.
        [EDGE * (f64::from(i) / 6.9 - 0.01), EDGE * f64::from(j) / 5.0, EDGE * (0.98 + 0.03 * f64::from(k))]
    });
    let half = rest.len() / 2;
    let body = model.add_body("wall", &rest[half..]);
    let first = model.bodies[body].nodes.start;
    let corner = |node: u32| first + node - half as u32;
    let halves = |hex: &[u32; 8]| [[hex[4], hex[5], hex[6]], [hex[4], hex[6], hex[7]]];
    let triangles: Vec<_> = hexes.iter().flat_map(halves).map(|face| face.map(corner)).collect();
    let thickness = vec![2e-4; triangles.len()];
    let cells = Cells::membrane(triangles, &model.rest, &thickness);
    model.add_solid(Solid::new(body, stiff(2e5), cells));
    let nodes = (first..first + half as u32).collect();
    tie(&mut model, "coat", nodes);
    model
}

/// Bars that cross a cube, tied by all of their nodes.
fn barred(mut model: Model) -> Model {
    let point = |bar: u32, k: u32| {
        let (along, across) = (f64::from(k) / 9.0, f64::from(bar) / 4.0);
        [EDGE * (0.05 + 0.9 * along), EDGE * (0.1 + 0.2 * across), EDGE * (0.1 + 0.75 * across * along)]
    };
    let rest: Vec<_> = (0..4).flat_map(|bar| (0..10).map(move |k| point(bar, k))).collect();
    let body = model.add_body("bars", &rest);
    let first = model.bodies[body].nodes.start;
    let lines = (0..4).flat_map(|bar| (0..9).map(move |k| [first + 10 * bar + k, first + 10 * bar + k + 1]));
    let cells = Cells::bar(lines.collect(), &model.rest, 1e-6, Cord { slack: 0.99, tension_only: false });
    model.add_solid(Solid::new(body, stiff(1e6), cells));
    tie(&mut model, "ingrown", (first..first + 40).collect());
    model
}

#[test]
fn tied_blocks_of_other_meshes_are_pulled() {
    let Some(device) = support::device() else { return };
    let supported = with_ties(&device);
    for (lower, upper, designs) in [
        ("tet4", "hex8", &supported[..]),
        ("hex8", "tet4", PLAIN),
        ("tet4-anp", "tet4-anp", PLAIN),
        ("hex8-full", "tet4", PLAIN),
    ] {
        let model = tied_blocks(lower, upper, elastic(neo_hookean()));
        compare(&device, &format!("{upper} on {lower}"), &model, designs);
    }
}

#[test]
fn a_membrane_and_embedded_bars_follow_a_solid() {
    let Some(device) = support::device() else { return };
    for (element, designs) in [("tet4", &with_ties(&device)[..]), ("hex8", PLAIN)] {
        let cube = moved_cube(element, elastic(neo_hookean()));
        compare(&device, &format!("a wall on {element}"), &walled(held_loaded(element)), designs);
        compare(&device, &format!("bars in {element}"), &barred(cube), designs);
    }
    let mut model = walled(barred(moved_cube("tet4", elastic(neo_hookean()))));
    model.initial_velocity = model.rest.iter().map(|x| [0.5 * x[2], 0.0, -0.8 * x[2]]).collect();
    let follows = model.followers();
    model
        .initial_velocity
        .iter_mut()
        .zip(follows)
        .filter(|(_, is_follower)| *is_follower)
        .for_each(|(v, _)| *v = [0.0; 3]);
    model.bodies[0].damping = 1.0;
    mass_scaling::scale_mass(&mut model, Goal::Share(0.2)).unwrap();
    compare_from(
        &device,
        "a wall and bars, with mass scaling and initial velocities",
        (&model, &vec![[0.0; 3]; model.node_count()]),
        0.5 * step_of(&model),
        PLAIN,
    );
}

/// A held cube that is pulled at its top by forces.
fn held_loaded(element: &str) -> Model {
    let mut model = held_cube(element, elastic(neo_hookean()));
    let forces = layer(CELLS).into_iter().map(|node| (node, [2e-2, 0.0, 5e-2])).collect();
    model.loads.push(load("pull", LoadKind::Forces(forces), None));
    model
}

/// Loads and grips on followers act on the followed nodes.
#[test]
fn loads_and_grips_on_followers() {
    let Some(device) = support::device() else { return };
    let mut model = walled(held_loaded("tet4"));
    let wall = model.bodies.len() - 1;
    let nodes = model.bodies[wall].nodes.clone();
    let cells = &model.solids[1].cells;
    let faces = (0..cells.len()).map(|cell| {
        let [a, b, c]: [u32; 3] = cells.nodes(cell).try_into().unwrap();
        [a, b, c, pliant_mechanics::load::NO_NODE]
    });
    let faces = faces.collect();
    model.loads.extend([
        load("press", LoadKind::Pressure { faces, pressure: 300.0 }, None),
        load("drag", LoadKind::Forces(vec![(nodes.start + 3, [0.1, 0.2, -0.1])]), None),
        load("weight", LoadKind::Gravity { body: wall, acceleration: [0.0, 0.0, -9.81] }, None),
        load("fall", LoadKind::Gravity { body: 0, acceleration: [0.0, 3.0, 0.0] }, None),
    ]);
    compare(&device, "loads on followers", &model, &with_ties(&device));
    let step = step_of(&model);
    let middle = nodes.start + (nodes.end - nodes.start) / 2;
    let mut grip = Grip { nodes: vec![(middle, 0.5), (middle + 1, 0.5)], ..Grip::default() };
    grip.stiffness = 20.0;
    grip.place = [0, 1, 2].map(|c| {
        0.5 * (model.rest[middle as usize][c] + model.rest[middle as usize + 1][c]) + [2e-3, 1e-3, 5e-3][c]
    });
    let mut reference = State::<f64>::at_rest(&model);
    let mut processor = CentralDifference::new(model.clone(), step).unwrap();
    processor.grip(&[grip.clone()]);
    for _ in 0..200 {
        processor.evaluate(&mut reference).unwrap();
        processor.advance(&mut reference);
    }
    for design in with_ties(&device) {
        let mut state = State::<f32>::at_rest(&model);
        let mut stepper = stepper(&device, &model, step, design);
        stepper.grip(&[grip.clone()]).unwrap();
        stepper.advance(&mut state, 200).unwrap();
        stepper.evaluate(&mut state, Wanted::Everything).unwrap();
        let off = distance(&reference.displacement, &double(&state.displacement));
        println!("grips, {design}: {off:.1e}");
        assert!(off <= 1e-5, "{design}: {off:.1e}");
    }
}

/// The contact finds the forces of bars at the nodes that touch.
#[test]
fn a_cube_with_bars_falls_onto_a_slope() {
    let Some(device) = support::device() else { return };
    let cube = free_cube("tet4", elastic(neo_hookean()));
    let velocity = vec![[0.0, 0.0, -0.1]; cube.node_count()];
    let mut model = Model { initial_velocity: velocity, ..barred(cube) };
    model.bodies[0].damping = 5.0;
    let acceleration = [1.0, 0.5, -9.81];
    for body in 0..2 {
        model.loads.push(load("gravity", LoadKind::Gravity { body, acceleration }, None));
    }
    let floor = rigid("floor", Shape::HalfSpace, Trajectory::fixed(Pose::translation(0.0, 0.0, -1e-3)));
    let contacts = with(&model, vec![floor], 0.3);
    contact::compare(&device, "bars on a slope", &model, &contacts, &[Design::Gather, Design::Fast]);
}

fn relaxing() -> Model {
    let mut material = elastic(neo_hookean());
    let terms =
        [PronyPart::Isochoric, PronyPart::Volumetric].map(|part| PronyTerm { part, weight: 0.3, time: 0.1 });
    material.prony = Prony::new(&terms, PronyUpdate::Exact).unwrap();
    barred(tied_blocks("tet4", "hex8", material))
}

/// Steps give the same bits however they are divided, without a read-back, and from a state that was brought
/// back in between.
#[test]
fn steps_of_tied_bodies_give_the_same_bits_divided_and_resumed() {
    let Some(device) = support::device() else { return };
    let model = relaxing();
    let step = step_of(&model);
    for design in with_ties(&device).into_iter().filter(|&design| design != Design::FloatAtomics) {
        let mut whole = State::<f32>::at_rest(&model);
        let mut undivided = stepper(&device, &model, step, design);
        undivided.advance(&mut whole, 210).unwrap();
        undivided.evaluate(&mut whole, Wanted::Everything).unwrap();
        let mut divided = State::<f32>::at_rest(&model);
        let mut first = stepper(&device, &model, step, design);
        for steps in [1, 2, 87] {
            first.evaluate(&mut divided, Wanted::Energies).unwrap();
            first.advance(&mut divided, steps).unwrap();
        }
        first.bring_back(&mut divided).unwrap();
        let mut second = stepper(&device, &model, step, design);
        let mut resumed = divided.clone();
        second.evaluate(&mut resumed, Wanted::Energies).unwrap();
        let before = device.read_backs();
        let mut left = 120;
        while left > 0 {
            left -= second.advance_without_read_back(&mut resumed, left, Duration::from_secs(100)).unwrap();
        }
        assert_eq!(device.read_backs(), before, "{design}: something came back");
        first.advance(&mut divided, 120).unwrap();
        for (what, stepper, state) in [("divided", &mut first, divided), ("resumed", &mut second, resumed)] {
            let mut state = state;
            stepper.evaluate(&mut state, Wanted::Everything).unwrap();
            assert!(state.displacement == whole.displacement, "{design}, {what}");
            assert!(state.increment == whole.increment && state.history == whole.history, "{design}, {what}");
            let (a, b) = (undivided.energies(), stepper.energies());
            for (a, b) in numbers(a).into_iter().zip(numbers(b)) {
                assert!((a - b).abs() < 1e-5 * undivided.energies().external, "{design}, {what}: {a} {b}");
            }
        }
    }
}

/// Returns the distance of followers from the places of their ties, over the size of all displacements.
fn out_of_place(model: &Model, state: &State<f32>) -> f64 {
    let mut placed = state.displacement.clone();
    model.follow(&mut placed);
    distance(&double(&placed), &double(&state.displacement))
}

#[test]
fn followers_stay_in_place_in_a_monitored_run_and_in_one_that_fails() {
    let Some(device) = support::device() else { return };
    let model = relaxing();
    let limit = critical_step::assembled(&model).unwrap().step;
    let mut state = State::<f32>::at_rest(&model);
    let monitor = Monitor::new(&model, limit, OnUnstable::Substep);
    let mut watched = stepper(&device, &model, 0.9 * limit, Design::Gather).watched(monitor);
    watched.advance(&mut state, 300).unwrap_or_else(|error| panic!("{error}"));
    watched.evaluate(&mut state, Wanted::Everything).unwrap();
    let off = out_of_place(&model, &state);
    assert!(off < 1e-7, "followers are off their places by {off:.1e}");
    let mut crushed = tied_blocks("tet4", "tet4", elastic(neo_hookean()));
    crushed.constraints[1].motion = Motion::Displacement([0.0, 0.0, -1.2 * EDGE], smooth(0.3));
    let step = 0.5 * step_of(&crushed);
    let expected = failure_of(&crushed, step);
    let (error, state) = failure_on(&device, &crushed, step, Design::Gather);
    let (
        StepError::Inverted { element: a, time, .. },
        StepFailure::Step(StepError::Inverted { element: b, .. }),
    ) = (&expected, &error)
    else {
        panic!("{expected:?}, {error:?}")
    };
    assert_eq!((a, *time), (b, state.time), "{error}");
    let off = out_of_place(&crushed, &state);
    assert!(off < 1e-7, "followers are off their places by {off:.1e}");
}

#[test]
fn a_design_without_ties_is_named() {
    let Some(device) = support::device() else { return };
    let model = relaxing();
    let refused = GpuStepper::new(&device, model, 1e-3, Some(Design::Blocks)).err().unwrap();
    assert_eq!(refused, GpuError::NoTies { design: "blocks".into() });
    assert!(refused.to_string().contains("`blocks` does not support ties") && refused.is_about_the_model());
    assert!(refused.remedy().contains("gather"));
}
