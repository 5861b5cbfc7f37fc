//! Energies and stresses of the laws at eight deformations, against complex-step derivatives of the energies.

use pliant_mechanics::law::AnyLaw;
use pliant_validation::{claim, deformation, largest, law, numbers, reference};
use serde_json::{Value, json};

/// Shear modulus of all reference materials [Pa].
const SHEAR: f64 = 0.7;

#[test]
fn split_neo_hookean_energy_and_stress_at_eight_deformations() {
    check("nh_iso", &law("neo-hookean", json!({ "shear-modulus": SHEAR, "bulk-modulus": 5.0 })), [0.0; 3]);
}

#[test]
fn coupled_neo_hookean_of_thesis_5_9_energy_and_stress_at_eight_deformations() {
    let bulk = 1.3 + 2.0 / 3.0 * SHEAR;
    let coupled = law("coupled-neo-hookean", json!({ "shear-modulus": SHEAR, "bulk-modulus": bulk }));
    check("nh_thesis", &coupled, [0.0; 3]);
}

#[test]
fn transversely_isotropic_law_of_thesis_6_4_energy_and_stress_at_eight_deformations() {
    let parameters = json!({ "shear-modulus": SHEAR, "bulk-modulus": 5.0, "fibre-modulus": 1.1 });
    check("ti", &law("transversely-isotropic", parameters), [0.6, 0.0, 0.8]);
}

/// |ΔS| over max(|S|, μ) and |ΔW| over max(|W|, μ), at most 1e-9: the reference's own accuracy, far above round-off.
fn check(model: &str, law: &AnyLaw, fibre: [f64; 3]) {
    let data = reference("material_points.json");
    let gradients = data["F"].as_array().unwrap();
    let values = data["models"][model]["values"].as_array().unwrap();
    assert_eq!((gradients.len(), values.len()), (8, 8));
    let states: Vec<_> = gradients.iter().map(|gradient| deformation(tensor(gradient))).collect();
    let stress = states.iter().zip(values).map(|(state, value)| {
        let found = law.stress(state, fibre);
        let expected = numbers(&value["S"]);
        let off = (found.isochoric + found.volumetric)
            .0
            .iter()
            .zip(&expected)
            .map(|(a, b)| a - b)
            .collect::<Vec<_>>();
        norm(&off) / norm(&expected).max(SHEAR)
    });
    claim(&format!("{model}: stress"), largest(stress), 1e-9);
    let energy = states.iter().zip(values).map(|(state, value)| {
        let found = law.energy(state, fibre);
        let expected = value["W"].as_f64().unwrap();
        (found.isochoric + found.volumetric - expected).abs() / expected.abs().max(SHEAR)
    });
    claim(&format!("{model}: energy"), largest(energy), 1e-9);
}

/// Of the six components of a symmetric tensor.
fn norm(s: &[f64]) -> f64 {
    s.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn tensor(rows: &Value) -> [[f64; 3]; 3] {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| rows[i][j].as_f64().unwrap()))
}
