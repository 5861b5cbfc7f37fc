//! The battery every law runs through. A new law is one line in [`every_law`].

use super::*;
use crate::tensor::Tensor;

fn law(name: &str, parameters: serde_json::Value) -> AnyLaw {
    AnyLaw::from_json(name, parameters).unwrap()
}

fn every_law() -> Vec<AnyLaw> {
    let moduli = |extra: &str| {
        serde_json::from_str(&format!(r#"{{"shear-modulus": 0.7, "bulk-modulus": 5.0{extra}}}"#)).unwrap()
    };
    let laws = vec![
        law("neo-hookean", moduli("")),
        law("coupled-neo-hookean", moduli("")),
        law("transversely-isotropic", moduli(r#", "fibre-modulus": 1.1"#)),
    ];
    for name in AnyLaw::NAMES {
        assert!(laws.iter().any(|law| law.name() == *name), "`{name}` is missing from the battery");
    }
    laws
}

const FIBRE: [f64; 3] = [0.6, 0.0, 0.8];

/// Displacement gradients with det F > 0: shear, stretch, compression, general.
const GRADIENTS: [[[f64; 3]; 3]; 4] = [
    [[0.0, 0.4, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
    [[0.3, 0.0, 0.0], [0.0, -0.1, 0.0], [0.0, 0.0, -0.15]],
    [[-0.3, 0.0, 0.05], [0.1, 0.1, 0.0], [0.0, -0.2, 0.1]],
    [[0.15, -0.2, 0.1], [0.25, 0.05, -0.1], [-0.1, 0.3, -0.2]],
];

fn total_energy(law: &AnyLaw, h: &Tensor<f64>) -> f64 {
    let Split { isochoric, volumetric } = law.energy(&Deformation::from_displacement_gradient(h), FIBRE);
    isochoric + volumetric
}

fn total_stress(law: &AnyLaw, h: &Tensor<f64>) -> Symmetric<f64> {
    let Split { isochoric, volumetric } = law.stress(&Deformation::from_displacement_gradient(h), FIBRE);
    isochoric + volumetric
}

/// A rotation by Rodrigues' formula, minus the identity applied to F: returns R F − I.
fn rotated(h: &Tensor<f64>) -> Tensor<f64> {
    let (axis, angle) = ([1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0], 0.9_f64);
    let skew = Tensor([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]]);
    let mut rotation = Tensor::<f64>::IDENTITY;
    for i in 0..3 {
        for j in 0..3 {
            let squared: f64 = (0..3).map(|k| skew.0[i][k] * skew.0[k][j]).sum();
            rotation.0[i][j] += angle.sin() * skew.0[i][j] + (1.0 - angle.cos()) * squared;
        }
    }
    let f = Deformation::from_displacement_gradient(h).gradient;
    let mut product = Tensor::ZERO;
    for i in 0..3 {
        for j in 0..3 {
            product.0[i][j] =
                (0..3).map(|k| rotation.0[i][k] * f.0[k][j]).sum::<f64>() - f64::from(u8::from(i == j));
        }
    }
    product
}

#[test]
fn stress_is_the_derivative_of_energy() {
    let step = 1e-5;
    for law in every_law() {
        for h in GRADIENTS.map(Tensor) {
            let piola =
                Deformation::from_displacement_gradient(&h).gradient.times_symmetric(&total_stress(&law, &h));
            for i in 0..3 {
                for j in 0..3 {
                    let shifted = |by: f64| {
                        let mut moved = h;
                        moved.0[i][j] += by;
                        total_energy(&law, &moved)
                    };
                    // Fourth-order difference: truncation and round-off both near 1e-11.
                    let slope = (8.0 * (shifted(step) - shifted(-step))
                        - (shifted(2.0 * step) - shifted(-2.0 * step)))
                        / (12.0 * step);
                    let error = (slope - piola.0[i][j]).abs();
                    assert!(error < 2e-9, "{}: P{i}{j} off by {error:e}", law.name());
                }
            }
        }
    }
}

#[test]
fn rotation_changes_neither_energy_nor_stress() {
    for law in every_law() {
        for h in GRADIENTS.map(Tensor) {
            let turned = rotated(&h);
            assert!((total_energy(&law, &h) - total_energy(&law, &turned)).abs() < 1e-14);
            let difference = total_stress(&law, &h) - total_stress(&law, &turned);
            assert!(difference.0.iter().all(|d| d.abs() < 1e-13), "{}: {difference:?}", law.name());
        }
        assert!(total_energy(&law, &rotated(&Tensor::ZERO)).abs() < 1e-15);
    }
}

#[test]
fn rest_is_free_of_stress_and_energy() {
    for law in every_law() {
        assert_eq!(total_energy(&law, &Tensor::ZERO), 0.0, "{}", law.name());
        assert_eq!(total_stress(&law, &Tensor::ZERO), Symmetric::ZERO, "{}", law.name());
    }
}

#[test]
fn small_strains_feel_the_stated_moduli() {
    let step = 1e-6;
    let slope = |law: &AnyLaw, direction: [[f64; 3]; 3], component: usize| {
        let scaled = |s: f64| Tensor(direction.map(|row| row.map(|x| x * s)));
        (total_stress(law, &scaled(step)).0[component] - total_stress(law, &scaled(-step)).0[component])
            / (2.0 * step)
    };
    for law in every_law() {
        let SmallStrainModuli { shear, bulk } = law.small_strain();
        // Shear in the plane that the fibre (0.6, 0, 0.8) does not feel to first order: e_y with its normal.
        let across = [[0.0, -0.8, 0.0], [0.0; 3], [0.0, 0.6, 0.0]];
        let xy = slope(&law, across, 3) / -0.8;
        assert!((xy - shear).abs() < 1e-7, "{}: shear modulus {xy}", law.name());
        let dilation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mean: f64 = (0..3).map(|k| slope(&law, dilation, k)).sum::<f64>() / 3.0;
        assert!((mean - 3.0 * bulk).abs() < 1e-6 * bulk, "{}: bulk modulus {}", law.name(), mean / 3.0);
        assert!(law.longitudinal_modulus() >= bulk + 4.0 / 3.0 * shear - 1e-12);
    }
}

#[test]
fn single_precision_follows_double() {
    for law in every_law() {
        for h in GRADIENTS.map(Tensor) {
            let fine = total_stress(&law, &h);
            let coarse =
                Deformation::<f32>::from_displacement_gradient(&Tensor(h.0.map(|row| row.map(|x| x as f32))));
            let Split { isochoric, volumetric } =
                with_law!(&law, law => law.stress(&coarse, FIBRE.map(|x| x as f32)));
            let scale = fine.0.iter().fold(0.7_f64, |a, b| a.max(b.abs()));
            for (a, b) in fine.0.iter().zip((isochoric + volumetric).0) {
                assert!((a - f64::from(b)).abs() < 2e-5 * scale, "{}", law.name());
            }
        }
    }
}
