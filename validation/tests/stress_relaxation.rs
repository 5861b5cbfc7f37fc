//! Stress relaxation of the liver-like cube: 30 % in 0.5 s, linear, then held to 5 s. Half of the isochoric stress
//! relaxes with τ = 0.58 s. Reference: quasi-static, quadratic hexahedra, without inertia; so the shape of the decay
//! compares, F(t)/F(5 s), once the waves of the ramp have gone.

use pliant_mechanics::Observable;
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::law::AnyLaw;
use pliant_mechanics::model::Material;
use pliant_mechanics::prony::PronyUpdate;
use pliant_meshing::VolumeCell;
use pliant_validation::{Specimen, claim, largest, law, liver, liver_relaxation, numbers, reference, run};
use serde_json::json;

/// Cells along the edge of the eighth.
const CELLS: usize = 6;

/// The force [N] on the platen at given times [s], by linear interpolation between the steps.
fn force_at(times: &[f64], law: AnyLaw) -> Vec<f64> {
    let material = Material { law, prony: liver_relaxation(PronyUpdate::Exact), density: 1000.0 };
    let ramp = Curve { shape: Shape::Ramp, from: 0.0, to: 0.5 };
    let eighth = Specimen::block([0.05; 3], [CELLS; 3], VolumeCell::Hex, &material, [0.0, 1.0, 0.0])
        .shift("x-min", 0.3 * 0.05, ramp)
        .fix("x-min", [false, true, true])
        .fix("x-max", [true, false, false])
        .fix("y-min", [false, true, false])
        .fix("z-min", [false, false, true])
        .damped(100.0);
    let platen = eighth.constraint("move x-min");
    let (mut forces, mut before) = (Vec::new(), (0.0, 0.0));
    run::<f64>(&eighth.model, 0.5 * eighth.element_bound(), 5.0, |stepper, state| {
        let now = (state.time, 4.0 * stepper.reaction(platen)[0]);
        while let Some(&time) = times.get(forces.len()).filter(|&&time| time <= now.0) {
            let part = (time - before.0) / (now.0 - before.0);
            forces.push(before.1 + part * (now.1 - before.1));
        }
        before = now;
    })
    .unwrap();
    forces
}

fn relaxes_as_the_reference(model: &str, law: AnyLaw) {
    let data = reference("relaxation.json");
    let [times, expected] = ["t", "F"].map(|key| numbers(&data["models"][model][key]));
    let found = force_at(&times, law);
    assert_eq!(found.len(), times.len());
    let [found_last, expected_last] = [&found, &expected].map(|f| f[f.len() - 1]);
    let ratios = || {
        times
            .iter()
            .zip(found.iter().zip(&expected))
            .map(|(t, (f, e))| (*t, f / found_last, e / expected_last))
    };
    for (time, f, e) in ratios().filter(|(time, ..)| *time >= 0.5) {
        println!("{model}: t = {time:.2} s: F/F(5 s) = {f:.5}, reference {e:.5}");
    }
    println!("{model}: F(5 s) = {found_last:.3} N, reference {expected_last:.3} N (another mesh)");
    let off = ratios().filter(|(time, ..)| *time >= 0.7 - 1e-9).map(|(_, f, e)| (f / e - 1.0).abs());
    // 1 %: the reference's ratios differ by less than 0.5 % between its meshes; the rest for the waves of the ramp.
    claim(&format!("{model}: F(t)/F(5 s) from 0.7 s on"), largest(off), 0.01);
    // 10 %: at 30 % the reference's own forces stand 4 to 8 % above the limit of fine meshes.
    claim(&format!("{model}: F(5 s)"), (found_last / expected_last - 1.0).abs(), 0.10);
}

#[test]
fn isotropic_liver_relaxes_as_the_reference() {
    let matrix = json!({ "shear-modulus": 6568.0, "bulk-modulus": 6568.0 * 29.0 / 3.0 });
    relaxes_as_the_reference("iso", law("neo-hookean", matrix));
}

#[test]
fn liver_with_fibres_across_relaxes_as_the_reference() {
    relaxes_as_the_reference("tiy", liver());
}
