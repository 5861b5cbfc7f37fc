//! Solid blocks on planes: Coulomb's friction on an incline and in all directions.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use pliant_contact::barrier::BarrierSettings;
use pliant_contact::shape::Shape;
use pliant_implicit::AssemblySolver;
use pliant_implicit::{Assembly, AssemblyState, BackwardEuler, DynamicSettings};
use pliant_mechanics::curve::{Curve, Shape as CurveShape};
use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
use pliant_mechanics::load::{Load, LoadKind};
use pliant_mechanics::model::{Cells, Material, Solid};

use super::{at_rigid, fixed, mean, surface, touch};

const YOUNG: f64 = 1e5;
/// Gap [m] of the barrier.
const GAP: f64 = 1e-4;
/// Speed [m/s] up to which friction lets it creep.
const CREEP: f64 = 1e-4;

/// A block of 2 × 2 × 2 cubes of 10 mm with a Young's modulus [Pa], its underside at z = 0, 1,000 kg/m³.
pub fn block(young: f64) -> (Assembly, Vec<[u32; 3]>) {
    let number = |i: u32, j: u32, k: u32| i + 3 * (j + 3 * k);
    let points =
        (0..27_u32).map(|k| Vector3::new(f64::from(k % 3), f64::from(k / 3 % 3), f64::from(k / 9)) * 0.01);
    let mut model = Assembly::new("block", points);
    let corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
    let cell = |c: u32| {
        let [i, j, k] = [c % 2, c / 2 % 2, c / 4];
        corners.map(|[x, y, z]| number(i + x, j + y, k + z))
    };
    let shear = young / 2.0;
    let law = AnyLaw::NeoHookean(NeoHookean { shear, volumetric: Volumetric::quadratic(2.0 * shear / 3.0) });
    let cells = Cells::full_hex8((0..8).map(cell).collect(), &model.rest);
    model.add_solid("block", Solid::new(0, Material::elastic(law, 1000.0), cells)).unwrap();
    let under = (0..4_u32).flat_map(|c| {
        let [a, b, d, e] = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[x, y]| number(c % 2 + x, c / 2 + y, 0));
        [[a, d, b], [a, e, d]]
    });
    (model, under.collect())
}

/// An acceleration that sets in at a time [s].
pub fn weigh(model: &mut Assembly, acceleration: [f64; 3], from: f64) {
    let curve = Curve { shape: CurveShape::Ramp, from: from - 1e-9, to: from };
    let kind = LoadKind::Gravity { body: 0, acceleration };
    model.model_mut().loads.push(Load::new("weight", kind, curve));
}

fn settings(step: f64) -> DynamicSettings {
    DynamicSettings { iterations: 100, ..DynamicSettings::new(step) }
}

/// Acceleration [m/s²] of a block on an incline, and its way [m] over 0.9 s. The block settles for 0.2 s on a
/// plane, which then becomes an incline. Another 0.1 s pass until shear waves in the block have died down.
fn slid(friction: f64, step: f64) -> [f64; 2] {
    let (mut model, under) = block(YOUNG);
    weigh(&mut model, [0.0, 0.0, -9.81 * 0.8_f64.sqrt()], 0.0);
    weigh(&mut model, [9.81 * 0.2_f64.sqrt(), 0.0, 0.0], 0.2 + 0.5 * step);
    let floor = fixed("floor", Shape::HalfSpace, [0.0, 0.0, -0.8 * GAP], [0.0; 3]);
    let contacts = at_rigid(&surface(under), vec![floor], friction, 0.0);
    touch(
        &mut model,
        contacts,
        BarrierSettings { distance: GAP, stiffness: 0.1 * YOUNG, creep_speed: CREEP },
    );
    let mut solver = BackwardEuler::new(model.clone(), settings(step)).unwrap();
    let mut state = AssemblyState::at_rest(&model);
    let (mut iterations, mut start) = (0, [Vector3::zeros(); 2]);
    while state.time < 1.2 - 1e-9 {
        iterations += solver.advance(&mut state).unwrap().residuals.len();
        if state.time < 0.3 + 0.5 * step {
            start = [&state.position, &state.velocity].map(|of| mean(&model, of));
        }
    }
    let now = solver.contact().unwrap().now();
    let [place, velocity] = start;
    let way = mean(&model, &state.position) - place;
    // Backward Euler: Σ h v of the steps.
    let acceleration = 2.0 * (way.x - 0.9 * velocity.x) / (0.9 * (0.9 + step));
    println!(
        "mu {friction}: accelerates by {acceleration:.6} m/s2, goes by {:.4} mm, {} iterations, force {:.4} {:.4} N, gap {:.1} um",
        1e3 * way.x,
        iterations,
        now.totals[0][0],
        now.totals[0][2],
        1e6 * now.gap.unwrap()
    );
    [acceleration, way.x]
}

/// A4: on a slope of ½ a block with μ = 0.51 creeps by less than its creep speed allows. With less friction
/// it slides at g (sin − μ cos). At the limit, μ = 0.5, nothing takes away the speed of 6 mm/s that it has
/// from its first shear wave.
#[test]
fn a_block_on_an_incline_sticks_or_slides_by_coulombs_law() {
    let step = 2e-3;
    for friction in [0.0, 0.3, 0.49] {
        let exact = 9.81 * (0.2_f64.sqrt() - friction * 0.8_f64.sqrt());
        let [acceleration, _] = slid(friction, step);
        assert!((acceleration / exact - 1.0).abs() < 0.02, "{friction}: {acceleration} {exact}");
    }
    let [_, crept] = slid(0.51, step);
    assert!(crept < 0.9 * CREEP, "{crept}");
    let [acceleration, _] = slid(0.5, step);
    assert!(acceleration.abs() < 1e-4, "{acceleration}");
}

/// A5: a block dragged over a floor at 10 mm/s in any direction is held back by μ times its weight, along the
/// way.
#[test]
fn friction_is_mu_times_the_normal_force_in_every_direction() {
    for number in 0..4 {
        let angle = TAU * (f64::from(number) + 0.3) / 8.0;
        let along = Vector3::new(angle.cos(), angle.sin(), 0.0);
        let (mut model, under) = block(YOUNG);
        weigh(&mut model, [0.0, 0.0, -9.81], 0.0);
        let floor = fixed("floor", Shape::HalfSpace, [0.0, 0.0, -0.8 * GAP], [0.0; 3]);
        let contacts = at_rigid(&surface(under), vec![floor], 0.3, 0.0);
        touch(
            &mut model,
            contacts,
            BarrierSettings { distance: GAP, stiffness: 0.1 * YOUNG, creep_speed: CREEP },
        );
        let step = 0.01;
        let mut solver = BackwardEuler::new(model.clone(), settings(step)).unwrap();
        let mut state = AssemblyState::at_rest(&model);
        state.velocity.iter_mut().for_each(|v| *v = 0.01 * along);
        // A spring at each node of the top that goes along.
        let weight = 9.81 * model.mass.iter().sum::<f64>();
        for count in 1..=60 {
            let way = along * (0.01 * step * f64::from(count));
            let springs: Vec<_> = (18..27)
                .map(|node| pliant_implicit::Spring {
                    node,
                    anchor: model.place(node as usize)
                        + Vector3::new(
                            way.x,
                            way.y,
                            state.position[node as usize].z - model.place(node as usize).z,
                        ),
                    stiffness: 50.0,
                })
                .collect();
            solver.grip(&springs);
            solver.advance(&mut state).unwrap();
        }
        let [x, y, z] = solver.contact().unwrap().now().totals[0];
        let force = Vector3::new(x, y, 0.0);
        let off = force.cross(&along).norm().atan2(force.dot(&along)).to_degrees();
        println!(
            "{:.0} deg: friction {:.5} N of mu N = {:.5}, weight {weight:.5}, off by {off:.3} deg",
            angle.to_degrees(),
            force.norm(),
            -0.3 * z
        );
        assert!((force.norm() / (0.3 * -z) - 1.0).abs() < 0.01 && off < 1.0);
        assert!((-z / weight - 1.0).abs() < 0.01);
    }
}
