//! Thin rings: pressed between two plates, and dropped.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use pliant_contact::barrier::BarrierSettings;
use pliant_contact::pairs::Surface;
use pliant_contact::pose::{Pose, Trajectory};
use pliant_contact::shape::Shape;
use pliant_implicit::AssemblySolver;
use pliant_implicit::{
    Assembly, AssemblyState, BackwardEuler, DynamicSettings, Integrator, Shell, StaticSettings, Statics,
};
use pliant_mechanics::curve::{Curve, Shape as CurveShape};
use pliant_mechanics::load::{Load, LoadKind};
use pliant_mechanics::model::{Constraint, Motion};
use pliant_shells::element::Elasticity;
use pliant_shells::element::Wall;

use super::{at_rigid, fixed, mean, rigid, surface, touch};

const RADIUS: f64 = 0.02;
const YOUNG: f64 = 1e6;
const POISSON: f64 = 0.3;

/// A ring about the axis y with a number of edges round and one across; its width is the length of an edge.
fn ring(edges: u32, thickness: f64) -> (Assembly, Surface, f64) {
    let width = TAU * RADIUS / f64::from(edges);
    let node = |k: u32, side: u32| 2 * (k % edges) + side;
    let points = (0..2 * edges).map(|n| {
        // A node at the top, one at the bottom, and one at either side.
        let angle = TAU * f64::from(n / 2) / f64::from(edges);
        Vector3::new(RADIUS * angle.sin(), width * f64::from(n % 2), RADIUS * angle.cos())
    });
    let cells: Vec<[u32; 3]> = (0..edges)
        .flat_map(|k| {
            let [a, b, c, d] = [node(k, 0), node(k + 1, 0), node(k + 1, 1), node(k, 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    let skin = surface(cells.clone());
    let material = Wall { elastic: Elasticity { young: YOUNG, poisson: POISSON }, density: 1000.0 };
    let mut model = Assembly::new("ring", points);
    model.add_shell(&Shell::new("ring", cells, thickness, material)).unwrap();
    (model, skin, width)
}

fn prescribe(model: &mut Assembly, name: &str, nodes: Vec<u32>, components: [bool; 6]) {
    let constraint = Constraint { name: name.into(), nodes, components, motion: Motion::Fixed };
    model.model_mut().constraints.push(constraint);
}

/// Force [E I/R² times the width] and approach [R] of the mid-surface between two plates that come nearer in
/// load steps.
fn pressed(edges: u32, thickness: f64, approach: f64, steps: u32) -> Vec<[f64; 2]> {
    let (mut model, skin, width) = ring(edges, thickness);
    // Plane strain; the nodes at the sides stay at their height.
    prescribe(&mut model, "plane", (0..2 * edges).collect(), [false, true, false, true, false, true]);
    let quarter = edges / 4;
    let sides: Vec<u32> = [quarter, 3 * quarter].iter().flat_map(|k| [2 * k, 2 * k + 1]).collect();
    prescribe(&mut model, "sides", sides, [false, false, true, false, true, false]);
    prescribe(&mut model, "middle", vec![0, 1, edges, edges + 1], [true, false, false, false, true, false]);
    let barrier = 0.01 * RADIUS;
    let reach = RADIUS + 0.5 * thickness + barrier;
    let ramp = Curve { shape: CurveShape::Ramp, from: 0.0, to: 1.0 };
    let way = 0.5 * approach * RADIUS;
    let plate = |name: &str, up: f64| {
        // A half-space below its plane, turned over for the upper one.
        let turn = if up > 0.0 { Vector3::x() * std::f64::consts::PI } else { Vector3::zeros() };
        let start = Pose::new(Vector3::z() * (up * reach), turn);
        rigid(name, Shape::HalfSpace, Trajectory::by(start, [0.0, 0.0, -up * way], ramp.clone()))
    };
    let contacts = at_rigid(&skin, vec![plate("upper", 1.0), plate("lower", -1.0)], 0.0, 0.5 * thickness);
    touch(
        &mut model,
        contacts,
        BarrierSettings { distance: barrier, stiffness: 0.1 * YOUNG, creep_speed: 1e-3 },
    );
    let settings = StaticSettings { iterations: 200, ..StaticSettings::default() };
    let mut solver = Statics::new(model.clone(), settings).unwrap();
    let mut state = AssemblyState::at_rest(&model);
    let stiffness = YOUNG * thickness.powi(3) / (12.0 * (1.0 - POISSON * POISSON)) * width;
    let mut rows = Vec::new();
    let mut iterations = 0;
    for step in 1..=steps {
        let done = solver.solve(&mut state, f64::from(step) / f64::from(steps)).unwrap();
        iterations += done.residuals.len();
        let now = solver.contact().unwrap().now();
        let [upper, lower] = [0, 1].map(|plate| now.totals[plate][2]);
        assert!((upper + lower).abs() < 1e-6 * upper.abs(), "{upper} {lower}");
        // At the top, or where a flat part has its ends.
        let heights = state.position.iter().map(|x| x.z);
        let height = heights.clone().fold(0.0, f64::max) - heights.fold(0.0, f64::min);
        rows.push([upper / (stiffness / RADIUS.powi(2)), 2.0 - height / RADIUS]);
    }
    println!("{edges} edges: {iterations} iterations in {steps} load steps");
    rows
}

/// The force at an approach, of the elastica reference.
fn reference(approach: f64) -> f64 {
    let text = include_str!("../../../../lab/validation/data/coupling/elastica_contact.json");
    let document: serde_json::Value = serde_json::from_str(text).unwrap();
    let number = |row: &serde_json::Value, key: &str| row[key].as_f64().unwrap();
    let rows = document["ring"]["rows"].as_array().unwrap();
    let after = rows.iter().position(|row| number(row, "delta") >= approach).unwrap();
    // Cubic through four rows.
    let first = after.saturating_sub(2).min(rows.len() - 4);
    let nearest: Vec<[f64; 2]> =
        rows[first..first + 4].iter().map(|row| [number(row, "delta"), number(row, "F")]).collect();
    let weight = |i: usize| -> f64 {
        (0..4)
            .filter(|&j| j != i)
            .map(|j| (approach - nearest[j][0]) / (nearest[i][0] - nearest[j][0]))
            .product()
    };
    (0..4).map(|i| nearest[i][1] * weight(i)).sum()
}

/// A ring of t/R = 1/100 between two plates, up to where it has a flat part. Its force at an approach of its
/// middle surface is compared with the elastica.
#[test]
fn a_ring_between_plates_is_an_elastica() {
    for (edges, tolerance) in [(48, 0.03), (96, 0.01), (192, 0.01)] {
        let mut worst = 0.0_f64;
        for [force, approach] in pressed(edges, 0.01 * RADIUS, 0.9, 15) {
            if approach < 0.02 {
                continue;
            }
            let exact = reference(approach);
            println!(
                "  delta {approach:.4}: F {force:.4}, elastica {exact:.4}, {:+.2} %",
                100.0 * (force / exact - 1.0)
            );
            worst = worst.max((force / exact - 1.0).abs());
        }
        println!("{edges} edges: worst {:.2} %", 100.0 * worst);
        assert!(worst < tolerance, "{edges}: {worst}");
    }
}

/// Rebound of a ring that was dropped. Energies are divided by the energy of its fall.
struct Rebound {
    /// The largest growth of energy in a step, and its change from the start until the ring has left the
    /// floor.
    grown: f64,
    drift: f64,
    /// Steps in contact.
    touched: u32,
    /// The mean speed [m/s] with which it leaves.
    speed: f64,
}

/// A ring of 1 mm dropped at 0.5 m/s, in steps of a length [s].
fn dropped(integrator: Integrator, step: f64) -> Rebound {
    let (mut model, skin, _) = ring(64, 1e-3);
    let barrier = 2e-4;
    let curve = Curve { shape: CurveShape::Hold, from: 0.0, to: 1.0 };
    let kind = LoadKind::Gravity { body: 0, acceleration: [0.0, 0.0, -9.81] };
    model.model_mut().loads.push(Load::new("weight", kind, curve));
    let floor = fixed("floor", Shape::HalfSpace, [0.0, 0.0, -RADIUS - 3e-3], [0.0; 3]);
    touch(
        &mut model,
        at_rigid(&skin, vec![floor], 0.0, 5e-4),
        BarrierSettings { distance: barrier, stiffness: 0.1 * YOUNG, creep_speed: 1e-3 },
    );
    let settings =
        DynamicSettings { integrator, iterations: 200, tolerance: 1e-9, ..DynamicSettings::new(step) };
    let mut solver = BackwardEuler::new(model.clone(), settings).unwrap();
    let mut state = AssemblyState::at_rest(&model);
    state.velocity.iter_mut().for_each(|v| v.z = -0.5);
    let energy = |state: &AssemblyState, barrier: f64| {
        let moving: f64 = (0..model.rest.len())
            .map(|n| {
                0.5 * model.mass[n] * state.velocity[n].norm_squared()
                    + 0.5 * model.rotary_inertia[n] * state.spin[n].norm_squared()
            })
            .sum();
        let height: f64 = (0..model.rest.len()).map(|n| 9.81 * model.mass[n] * state.position[n].z).sum();
        let shell = state.shell_energy(&model).unwrap();
        moving + height + shell.membrane + shell.bending + shell.drilling + barrier
    };
    let start = 0.5 * model.mass.iter().sum::<f64>() * 0.25;
    let first = energy(&state, 0.0);
    let mut last = first;
    let (mut iterations, mut steps) = (0, 0);
    let mut rebound = Rebound { grown: 0.0, drift: 0.0, touched: 0, speed: 0.0 };
    // Until it is a millimetre above the floor on its way up: it trembles, and leaves the floor for some
    // steps before.
    let flies_up = |state: &AssemblyState| {
        let lowest = state.position.iter().map(|x| x.z).fold(f64::INFINITY, f64::min);
        lowest + RADIUS + 3e-3 > 1e-3 && mean(&model, &state.velocity).z > 0.0
    };
    while state.time < 0.2 && !flies_up(&state) {
        iterations += solver.advance(&mut state).unwrap().residuals.len();
        steps += 1;
        let now = solver.contact().unwrap().now();
        let next = energy(&state, now.energy);
        rebound.grown = rebound.grown.max((next - last) / start);
        last = next;
        rebound.touched += u32::from(now.gap.is_some());
        if now.gap.is_some() {
            rebound.drift = (next - first) / start;
        }
        rebound.speed = rebound.speed.max(mean(&model, &state.velocity).z);
    }
    let Rebound { grown, drift, touched, speed } = &rebound;
    println!(
        "{integrator:?}: energy grows by {grown:.1e} in a step at most, {:+.1} % in all; in contact for {touched} steps; flies back at {speed:.3} \
         m/s; {iterations} iterations in {steps} steps",
        100.0 * drift
    );
    rebound
}

/// A6: energy of the body and the barrier never grows by backward Euler, and the ring flies back more slowly
/// than it came. Differences of two steps lose less energy and fly back faster, in longer and in shorter
/// steps. Their loss goes into vibrations that steps do not resolve (21 and 16 % of the energy of the fall).
#[test]
fn a_dropped_ring_gains_no_energy_and_rebounds_higher_by_differences_of_two_steps() {
    for step in [1e-3, 2.5e-4] {
        let [first, second] =
            [Integrator::BackwardEuler, Integrator::Bdf2].map(|integrator| dropped(integrator, step));
        assert!(first.grown < 1e-6 && first.touched > 5 && first.speed > 0.0 && first.speed < 0.5);
        assert!(second.grown < 0.01 && second.drift < 0.0, "{} {}", second.grown, second.drift);
        assert!(second.drift > 0.5 * first.drift, "{} {}", second.drift, first.drift);
        assert!(second.speed > first.speed && second.speed < 0.5, "{} {}", second.speed, first.speed);
    }
}

/// The lost energy goes into vibrations that steps do not resolve. It falls with the step, in the end below
/// the 10 % of A6.
#[test]
#[ignore = "half a minute"]
fn what_a_rebound_loses_falls_with_the_step() {
    let drifts = [1e-3, 1e-4, 1e-5].map(|step| dropped(Integrator::Bdf2, step).drift);
    assert!(drifts.is_sorted() && drifts[2] > -0.1, "{drifts:?}");
}
