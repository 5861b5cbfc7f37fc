//! Nodes that go with others: forces, stiffness, rigid motions.

use std::sync::Arc;

use pliant_linear::{LinearSolver, dot};
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
use pliant_mechanics::mapping::Weights;
use pliant_mechanics::model::{Cells, Constraint, Material, Solid};
use pliant_shells::element::Elasticity;
use pliant_shells::element::Wall;
use pliant_testing::Random;

use super::*;
use crate::CarriedTurn;
use crate::system::System;
use crate::{BackwardEuler, DynamicSettings, Shell, Spring, StaticSettings, Statics};

/// A bar of 4 × 1 × 1 cubes of 1 cm with a rigid end, to which two free nodes are tied with a spring each.
fn model() -> Assembly {
    let points = (0..5).flat_map(|x| {
        [(0, 0), (1, 0), (0, 1), (1, 1)]
            .map(|(y, z)| Vector3::new(f64::from(x), f64::from(y), f64::from(z)) * 0.01)
    });
    let mut model = Assembly::new("bar", points);
    let hexes = (0..4).map(|x| [0, 4, 5, 1, 2, 6, 7, 3].map(|node| 4 * x + node)).collect();
    let law = AnyLaw::NeoHookean(NeoHookean { shear: 2e3, volumetric: Volumetric::quadratic(1e4) });
    let cells = Cells::hex8(hexes, &model.rest, 0.2, 2e3);
    model.add_solid("bar", Solid::new(0, Material::elastic(law, 1000.0), cells)).unwrap();
    model.add_body("beads", [Vector3::new(0.025, 0.005, 0.005), Vector3::new(0.035, 0.002, 0.007)]);
    let rows: [&[(u32, f64)]; 2] = [&[(8, 0.3), (13, 0.2), (15, 0.5)], &[(12, 0.5), (16, 0.2), (19, 0.3)]];
    model.model_mut().tie("thread", vec![20, 21], Weights::from_rows(rows)).unwrap();
    for node in [20, 21, 17] {
        let anchor = model.place(node as usize) + Vector3::new(0.0, 0.01, 0.005);
        model.springs.push(Spring { node, anchor, stiffness: 30.0 });
    }
    let nodes = (12..20).collect();
    model.model_mut().constraints.push(Constraint {
        name: "end".into(),
        nodes,
        components: [true; 6],
        motion: Motion::Rigid,
    });
    model
}

/// The bar with a strip of shell. Two edges of the strip lie in the bar and turn with it, the second one in a
/// hex at the rigid end.
fn with_strip() -> Assembly {
    let mut model = model();
    let across = [0.002, 0.008];
    let strip = [0.015, 0.025, 0.045].map(|x| across.map(|y| Vector3::new(x, y, 0.005)));
    model.add_body("strip", strip.into_iter().flatten());
    let cells = [22, 24].into_iter().flat_map(|a| [[a, a + 2, a + 3], [a, a + 3, a + 1]]).collect();
    let material = Wall { elastic: Elasticity { young: 1e5, poisson: 0.3 }, density: 1000.0 };
    model.add_shell(&Shell::new("strip", cells, 1e-3, material)).unwrap();
    let corner = |node: u32| model.place(node as usize) / 0.01;
    let nodes = |hex: u32| 4 * hex..4 * hex + 8;
    let tied: Vec<(u32, u32)> = vec![(22, 1), (23, 1), (24, 2), (25, 2)];
    let weight = |at: u32, node: u32| {
        let off = model.place(at as usize) / 0.01 - corner(node);
        (node, off.iter().map(|x| 1.0 - x.abs()).product::<f64>())
    };
    let rows: Vec<Vec<_>> =
        tied.iter().map(|&(at, hex)| nodes(hex).map(|node| weight(at, node)).collect()).collect();
    let middle = |hex: u32| Vector3::new(f64::from(hex) + 0.5, 0.5, 0.5);
    let gradient = |node: u32, hex: u32| (node, (corner(node) - middle(hex)) * (2.0 / (4.0 * 0.01)));
    let turns = tied.iter().map(|&(node, hex)| CarriedTurn {
        node,
        gradient: nodes(hex).map(|corner| gradient(corner, hex)).collect(),
    });
    let turns: Vec<_> = turns.collect();
    model.turns = turns;
    let mapping = Weights::from_rows(rows.iter().map(Vec::as_slice));
    model.model_mut().tie("glue", tied.iter().map(|&(node, _)| node).collect(), mapping).unwrap();
    model
}

#[test]
fn the_stiffness_of_rigid_parts_is_the_change_of_their_forces() {
    stiffness_is_the_change_of_forces(model(), 3 * 12 + 6);
}

#[test]
fn the_stiffness_of_turns_that_follow_a_solid_is_the_change_of_their_forces() {
    stiffness_is_the_change_of_forces(with_strip(), 3 * 12 + 6 + 2 * 6);
}

/// The stiffness along any direction is what the forces change by, far from equilibrium; and these are the
/// change of the energy.
fn stiffness_is_the_change_of_forces(model: Assembly, unknowns: usize) {
    let model = Arc::new(model);
    let mut system = System::new(Arc::clone(&model), LinearSolver::Direct).unwrap();
    let mut random = Random::new(3);
    let mut state = AssemblyState::at_rest(&model);
    let still = vec![0.0; 6 * model.rest.len()];
    system.evaluate(&state, 0.0, Some(&still)).unwrap();
    let count = system.stiffness.equations.count();
    assert_eq!(count, unknowns);
    let mut direction = |size: f64| -> Vec<f64> {
        let turning = |e: usize| system.stiffness.equations.component[e] % 6 >= 3;
        (0..count).map(|e| size * if turning(e) { 100.0 } else { 1.0 } * random.vector()[0]).collect()
    };
    let (first, way) = (direction(3e-3), direction(1e-3));
    let spread = |system: &System, values: &[f64]| {
        let mut components = vec![0.0; 6 * model.rest.len()];
        system.spread(values, &mut components);
        components
    };
    system.advance(&mut state, &spread(&system, &first), 1.0);
    let forces = |system: &mut System, part: f64| {
        let mut moved = state.clone();
        system.evaluate(&state, 0.0, None).unwrap();
        let increment = spread(system, &way);
        system.advance(&mut moved, &increment, part);
        system.evaluate(&moved, 0.0, None).unwrap();
        let mut free = vec![0.0; count];
        system.gather(&system.forces.internal, &mut free);
        (dot(&free, &way), system.forces.energy)
    };
    let h = 1e-4;
    let [(ahead, above), (behind, below)] = [h, -h].map(|part| forces(&mut system, part));
    let (here, _) = forces(&mut system, 0.0);
    assert!(((above - below) / (2.0 * h) - here).abs() < 1e-6 * here.abs(), "force");
    system.evaluate(&state, 0.0, Some(&still)).unwrap();
    let mut product = vec![0.0; count];
    system.stiffness.matrix.multiply_values(&system.stiffness.matrix.value, &way, &mut product);
    let (found, wanted) = (dot(&product, &way), (ahead - behind) / (2.0 * h));
    println!("{found} {wanted}");
    assert!((found - wanted).abs() < 1e-6 * wanted.abs(), "{found} {wanted}");
}

/// A bar whose free end is turned by 2.5 rad follows as one body without stress; a free one keeps its shape
/// and its velocity.
#[test]
fn a_rigid_motion_costs_nothing() {
    [model(), with_strip()].into_iter().for_each(moves_rigidly);
}

fn moves_rigidly(mut model: Assembly) {
    model.springs.clear();
    let curve = Curve { shape: Shape::Ramp, from: 0.0, to: 1.0 };
    let rest = (0..4).map(|node| model.rest[node]);
    let motion = Motion::rotation([0.3, -0.2, 0.9], [0.0; 3], 2.5, curve, rest);
    model.model_mut().constrain("hand", vec![0, 1, 2, 3], motion);
    let mut state = AssemblyState::at_rest(&model);
    let settings = StaticSettings { tolerance: 1e-12, ..StaticSettings::default() };
    let mut solver = Statics::new(model.clone(), settings).unwrap();
    for step in 1..=10 {
        solver.solve(&mut state, f64::from(step) / 10.0).unwrap();
    }
    let turn = pliant_shells::rotation::exponential(&(Vector3::new(0.3, -0.2, 0.9).normalize() * 2.5));
    // The beads follow with an offset that does not turn.
    let count = model.rest.len();
    let nodes = (0..20).chain(22..count);
    let off = nodes.map(|node| (state.position[node] - turn * model.place(node)).norm()).fold(0.0, f64::max);
    let mut forces = crate::Forces::new(model.clone());
    forces.evaluate(&state).unwrap();
    println!("static: {off:.1e} m, {:.1e} J", forces.strain_energy());
    assert!(off < 1e-12 && forces.strain_energy() < 1e-12, "{off:e} {:e}", forces.strain_energy());

    // Free in space it keeps its shape and its momentum.
    model.model_mut().constraints.pop();
    let velocity = Vector3::new(0.2, -0.1, 0.3);
    let mut state = AssemblyState::at_rest(&model);
    state.velocity.fill(velocity);
    let mut solver =
        BackwardEuler::new(model.clone(), DynamicSettings { tolerance: 1e-12, ..DynamicSettings::new(0.01) })
            .unwrap();
    (0..50).for_each(|_| drop(solver.advance(&mut state).unwrap()));
    let off = (0..count).map(|node| (state.position[node] - model.place(node) - 0.5 * velocity).norm());
    let slower = (0..count).map(|node| (state.velocity[node] - velocity).norm());
    let (off, slower) = (off.fold(0.0, f64::max), slower.fold(0.0, f64::max));
    println!("implicit: {off:.1e} m, {slower:.1e} m/s");
    assert!(off < 1e-12 && slower < 1e-12, "{off:e} {slower:e}");
}

/// Three nodes on a line keep their distances. A turn about the line moves no node, but does not make the
/// stiffness singular.
#[test]
fn nodes_on_a_line_are_bound() {
    let mut model = model();
    model.model_mut().constraints[0].nodes = vec![4, 8, 12];
    model.model_mut().fix("base", vec![0, 1, 2, 3]);
    let mut state = AssemblyState::at_rest(&model);
    let mut solver = Statics::new(model.clone(), StaticSettings::default()).unwrap();
    let step = solver.solve(&mut state, 1.0).unwrap();
    let length = |a: usize, b: usize| (state.position[a] - state.position[b]).norm();
    assert!((length(4, 12) - 0.02).abs() < 1e-15 && (length(4, 8) - 0.01).abs() < 1e-15);
    assert!((state.position[8] - model.place(8)).norm() > 1e-4, "{:?}", step.residuals);
}
