//! Energies and stresses of the laws at eight deformations, compared with complex-step derivatives of the
//! energies. Each reference material has one test, with the parameters of the file's `definition`.

use pliant_mechanics::law::AnyLaw;
use pliant_validation::{claim, deformation, largest, law, numbers, reference};
use serde_json::{Value, json};

/// Shear modulus of the materials with a neo-Hookean part [Pa]; the other materials come within a factor of
/// two.
const SHEAR: f64 = 0.7;
/// First fibre family.
const FIBRE: [f64; 3] = [0.6, 0.0, 0.8];
/// The reference's own accuracy, far above round-off.
const TOLERANCE: f64 = 1e-9;

#[test]
fn st_venant_kirchhoff_energy_and_stress_at_eight_deformations() {
    check("svk", &law("st-venant-kirchhoff", with_lame_1_3()));
}

#[test]
fn coupled_neo_hookean_of_thesis_5_9_energy_and_stress_at_eight_deformations() {
    check("nh_thesis", &law("coupled-neo-hookean", with_lame_1_3()));
}

#[test]
fn logarithmic_neo_hookean_energy_and_stress_at_eight_deformations() {
    check("nh_log2", &law("logarithmic-neo-hookean", with_lame_1_3()));
}

#[test]
fn neo_hookean_energy_and_stress_at_eight_deformations() {
    check("nh_iso", &law("neo-hookean", matrix(json!({}))));
}

#[test]
fn neo_hookean_with_other_volumetric_energies_at_eight_deformations() {
    for (model, energy) in [("nh_quadlog", "quad-log"), ("nh_ln2", "ln-squared"), ("nh_liu", "j-ln-j")] {
        check(model, &law("neo-hookean", matrix(json!({ "volumetric": energy }))));
    }
}

#[test]
fn mooney_rivlin_energy_and_stress_at_eight_deformations() {
    check("mooney", &law("mooney-rivlin", json!({ "c10": 0.3, "c01": 0.15, "bulk-modulus": 5.0 })));
}

#[test]
fn yeoh_energy_and_stress_at_eight_deformations() {
    check("yeoh", &law("yeoh", json!({ "c1": 0.3, "c2": 0.1, "c3": 0.05, "bulk-modulus": 5.0 })));
}

#[test]
fn polynomial_energy_and_stress_at_eight_deformations() {
    let c = json!({ "c10": 0.3, "c01": 0.1, "c20": 0.05, "c11": 0.03, "c02": 0.02, "bulk-modulus": 5.0 });
    check("poly2", &law("polynomial", c));
}

#[test]
fn arruda_boyce_energy_and_stress_at_eight_deformations() {
    let chains = json!({
        "shear-modulus": 0.7, "locking-stretch": 1.8, "bulk-modulus": 5.0, "volumetric": "quad-log"
    });
    check("arruda", &law("arruda-boyce", chains));
}

#[test]
fn gent_energy_and_stress_at_eight_deformations() {
    check("gent", &law("gent", matrix(json!({ "limit": 4.0 }))));
}

#[test]
fn demiray_energy_and_stress_at_eight_deformations() {
    let parameters = json!({ "shear-modulus": 0.5, "exponent": 2.0, "bulk-modulus": 5.0 });
    check("demiray", &law("demiray", parameters));
}

#[test]
fn veronda_westmann_energy_and_stress_at_eight_deformations() {
    check("veronda", &law("veronda-westmann", json!({ "c1": 0.25, "c2": 1.5, "bulk-modulus": 5.0 })));
}

#[test]
fn transversely_isotropic_law_of_thesis_6_4_energy_and_stress_at_eight_deformations() {
    check("ti", &law("transversely-isotropic", matrix(json!({ "fibre-modulus": 1.1 }))));
}

#[test]
fn orthotropic_energy_and_stress_at_eight_deformations() {
    let families = json!({ "e4": 1.1, "e5": 0.3, "e6": 0.6, "e7": 0.2 });
    check("ortho", &law("orthotropic", matrix(families)));
}

#[test]
fn holzapfel_gasser_ogden_energy_and_stress_at_eight_deformations() {
    let fibres = json!({
        "fibre-modulus": 0.9, "fibre-exponent": 0.8, "dispersion": 0.12, "families": 2
    });
    check("hgo", &law("holzapfel-gasser-ogden", matrix(fibres)));
}

#[test]
fn fung_orthotropic_energy_and_stress_at_eight_deformations() {
    let form = json!({
        "modulus": 0.4, "normal": [[1.2, 0.3, 0.25], [0.3, 0.9, 0.2], [0.25, 0.2, 0.7]], "shear": [0.8, 0.6, 0.5],
        "bulk-modulus": 5.0
    });
    check("fung_orth", &law("fung-orthotropic", form));
}

/// Its reference is a finite difference, good to 4e-11; the agreed tolerance is 1e-8.
#[test]
fn ogden_energy_and_stress_at_eight_deformations() {
    let terms =
        json!([{ "shear-modulus": 0.5, "exponent": 2.5 }, { "shear-modulus": 0.2, "exponent": -3.0 }]);
    check_within("ogden", &law("ogden", json!({ "terms": terms, "bulk-modulus": 5.0 })), 1e-8);
}

#[test]
fn every_reference_material_is_named_by_a_test_of_this_file() {
    let data = reference("material_points.json");
    let this_file = include_str!("material_points.rs");
    for model in data["models"].as_object().unwrap().keys() {
        assert!(this_file.contains(&format!("(\"{model}\"")), "`{model}` has no test");
    }
}

/// μ = 0.7, κ = 5, and further parameters of the law.
fn matrix(extra: Value) -> Value {
    let mut parameters = json!({ "shear-modulus": SHEAR, "bulk-modulus": 5.0 });
    parameters.as_object_mut().unwrap().extend(extra.as_object().unwrap().clone());
    parameters
}

/// μ = 0.7, λ = 1.3.
fn with_lame_1_3() -> Value {
    json!({ "shear-modulus": SHEAR, "bulk-modulus": 1.3 + 2.0 / 3.0 * SHEAR })
}

fn check(model: &str, law: &AnyLaw) {
    check_within(model, law, TOLERANCE);
}

/// |ΔS| over max(|S|, μ) and |ΔW| over max(|W|, μ).
fn check_within(model: &str, law: &AnyLaw, tolerance: f64) {
    let data = reference("material_points.json");
    let gradients = data["F"].as_array().unwrap();
    let values = data["models"][model]["values"].as_array().unwrap();
    assert_eq!((gradients.len(), values.len()), (8, 8));
    // The second family of the reference's two laws that have one.
    let fibres = [FIBRE, if model == "hgo" { [0.8, 0.6, 0.0] } else { [0.0, 1.0, 0.0] }];
    let states: Vec<_> = gradients.iter().map(|gradient| deformation(tensor(gradient))).collect();
    let stress = states.iter().zip(values).map(|(state, value)| {
        let found = law.stress(state, &fibres[..law.families()]);
        let expected = numbers(&value["S"]);
        let off = (found.isochoric + found.volumetric)
            .0
            .iter()
            .zip(&expected)
            .map(|(a, b)| a - b)
            .collect::<Vec<_>>();
        norm(&off) / norm(&expected).max(SHEAR)
    });
    claim(&format!("{model}: stress"), largest(stress), tolerance);
    let energy = states.iter().zip(values).map(|(state, value)| {
        let found = law.energy(state, &fibres[..law.families()]);
        let expected = value["W"].as_f64().unwrap();
        (found.isochoric + found.volumetric - expected).abs() / expected.abs().max(SHEAR)
    });
    claim(&format!("{model}: energy"), largest(energy), tolerance);
}

/// Norm of the six components of a symmetric tensor.
fn norm(s: &[f64]) -> f64 {
    s.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn tensor(rows: &Value) -> [[f64; 3]; 3] {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| rows[i][j].as_f64().unwrap()))
}
