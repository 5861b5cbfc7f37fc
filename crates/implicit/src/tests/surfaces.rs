//! Strains and pressures of whole surfaces.

use nalgebra::Vector3;
use pliant_shells::EdgeRule;
use pliant_shells::rotation::{exponential, skew};
use pliant_testing::Random;

use super::{ball, model, strip};
use crate::{AssemblyState, CurvedSurface};

/// A plate is stretched by 20 % and thinned to match. It is bent to a radius of 1 m at a thickness of 0.1 m,
/// and turned by a radian. The strain in the middle is 20 %, exactly. Bent alone, the plate has the strain κ
/// t/2.
#[test]
fn stretch_and_bending_are_told_apart() {
    let model = model(strip(), 0.1);
    let turn = exponential(&Vector3::new(1.0, -2.0, 0.5).normalize());
    let mut state = AssemblyState::at_rest(&model);
    for (x, r) in state.position.iter_mut().zip(&mut state.rotation) {
        *x = turn * Vector3::new(1.2 * x.x, 0.9 * x.y, 0.0);
        *r = turn;
    }
    for strain in state.shell_strains(&model) {
        assert!((strain.membrane - 0.2).abs() < 1e-12 && (strain.surface - 0.2).abs() < 1e-12);
    }
    let curvature = 1e-4;
    let mut state = AssemblyState::at_rest(&model);
    for ((x, r), rest) in state.position.iter_mut().zip(&mut state.rotation).zip(model.places()) {
        x.z = 0.5 * curvature * rest.x * rest.x;
        *r = exponential(&Vector3::new(0.0, -curvature * rest.x, 0.0));
    }
    for strain in state.shell_strains(&model) {
        // Sagging stretches the middle by (κ x)²/2, up to 3e-7.
        let bending = strain.surface / (0.5 * 0.1 * curvature);
        assert!((bending - 1.0).abs() < 0.1, "{bending}");
    }
}

/// A closed surface, shaken, has no resultant force and no moment. The change of the forces is symmetric,
/// except for −S(m)/2 of the moments, which the moments of the elements balance: 1e-12.
#[test]
fn a_closed_surface_has_no_resultant_and_a_symmetric_change() {
    let mut random = Random::new(3);
    let model = model(ball(1), 0.01);
    let surface = CurvedSurface::new(&model, EdgeRule::Arc);
    let mut state = AssemblyState::at_rest(&model);
    let shake: Vec<f64> = (0..6 * model.rest.len()).map(|_| 0.1 * random.number()).collect();
    state.advance(&shake, 1.0);
    let size = shake.len();
    let mut forces = nalgebra::DVector::<f64>::zeros(size);
    let mut change = nalgebra::DMatrix::<f64>::zeros(size, size);
    for (number, facet) in model.facets.iter().enumerate() {
        let patch = surface.patch(&model, &state, number as u32);
        let (pushed, moved) = (patch.pressure_forces(), patch.pressure_change());
        let place = |i: usize| 6 * facet.nodes[i / 6] as usize + i % 6;
        for i in 0..18 {
            forces[place(i)] += pushed[i];
            (0..18).for_each(|j| change[(place(i), place(j))] += moved[(i, j)]);
        }
    }
    let part =
        |node: usize, first: usize| -> Vector3<f64> { forces.fixed_rows::<3>(6 * node + first).into() };
    let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
    for node in 0..model.rest.len() {
        force += part(node, 0);
        moment += state.position[node].cross(&part(node, 0)) + part(node, 3);
        let mut block = change.fixed_view_mut::<3, 3>(6 * node + 3, 6 * node + 3);
        block += 0.5 * skew(&part(node, 3));
    }
    assert!(force.norm() < 1e-12 && moment.norm() < 1e-12, "{force} {moment}");
    let off = (&change - change.transpose()).amax() / change.amax();
    assert!(off < 1e-13, "{off:e}");
}
