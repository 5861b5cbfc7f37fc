//! The battery every law of [`samples`](super::samples) runs through.

use serde_json::{Value, json};

use super::samples::{every_law, merged, term};
use super::*;
use crate::tensor::{Tensor, dot, scale};

const FIBRE: [f64; 3] = [0.6, 0.0, 0.8];
/// Directions of as many families as any law has; the second at right angles.
const FIBRES: [[f64; 3]; 2] = [FIBRE, [0.0, 1.0, 0.0]];

/// Displacement gradients with det F > 0: shear, stretch, compression, general.
const GRADIENTS: [[[f64; 3]; 3]; 4] = [
    [[0.0, 0.4, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
    [[0.3, 0.0, 0.0], [0.0, -0.1, 0.0], [0.0, 0.0, -0.15]],
    [[-0.3, 0.0, 0.05], [0.1, 0.1, 0.0], [0.0, -0.2, 0.1]],
    [[0.15, -0.2, 0.1], [0.25, 0.05, -0.1], [-0.1, 0.3, -0.2]],
];

fn total_energy(law: &AnyLaw, h: &Tensor<f64>) -> f64 {
    let Split { isochoric, volumetric } =
        law.energy(&Deformation::from_displacement_gradient(h), &FIBRES[..law.families()]);
    isochoric + volumetric
}

fn total_stress(law: &AnyLaw, h: &Tensor<f64>) -> Symmetric<f64> {
    let Split { isochoric, volumetric } =
        law.stress(&Deformation::from_displacement_gradient(h), &FIBRES[..law.families()]);
    isochoric + volumetric
}

#[test]
fn the_whole_stress_is_the_sum_of_its_parts() {
    for law in every_law() {
        for h in GRADIENTS.map(Tensor) {
            let deformation = Deformation::from_displacement_gradient(&h);
            let fibres = &FIBRES[..law.families()];
            let whole = with_law!(law, law => law.whole_stress(&deformation, fibres));
            let size = whole.0.iter().fold(1.0_f64, |a, b| a.max(b.abs()));
            let difference = whole - total_stress(&law, &h);
            assert!(difference.0.iter().all(|d| d.abs() < 1e-14 * size), "{law:?}: {difference:?}");
        }
    }
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
            let size = piola.0.as_flattened().iter().fold(1.0_f64, |a, b| a.max(b.abs()));
            for i in 0..3 {
                for j in 0..3 {
                    let shifted = |by: f64| {
                        let mut moved = h;
                        moved.0[i][j] += by;
                        total_energy(&law, &moved)
                    };
                    // Fourth-order difference: truncation and round-off both near 1e-11 of the largest
                    // stress.
                    let slope = (8.0 * (shifted(step) - shifted(-step))
                        - (shifted(2.0 * step) - shifted(-2.0 * step)))
                        / (12.0 * step);
                    let error = (slope - piola.0[i][j]).abs();
                    assert!(error < 2e-9 * size, "{law:?}: P{i}{j} off by {error:e}");
                }
            }
        }
    }
}

/// The derivative of P along any δF is F D:δE + δF S.
#[test]
fn the_tangent_is_the_derivative_of_the_stress() {
    let step = 1e-5;
    for law in every_law() {
        for h in GRADIENTS.map(Tensor) {
            let tangent =
                law.tangent(&h, &FIBRES[..law.families()], |stress| stress.isochoric + stress.volumetric);
            let size = tangent.iter().flatten().fold(1.0_f64, |a, b| a.max(b.abs()));
            let f = Deformation::from_displacement_gradient(&h).gradient;
            let along = Tensor([[0.3, -0.5, 0.2], [0.1, 0.4, -0.6], [-0.2, 0.7, 0.5]]);
            let moved = |by: f64| total_stress(&law, &h.plus_scaled(&along, by));
            let (ahead, behind) = (moved(step), moved(-step));
            // δE = sym Fᵀ δF, with engineering shears.
            let product = [0, 1, 2].map(|i| f.transpose().apply(along.transpose().0[i]));
            let strain = [
                product[0][0],
                product[1][1],
                product[2][2],
                product[0][1] + product[1][0],
                product[1][2] + product[2][1],
                product[0][2] + product[2][0],
            ];
            for (p, row) in tangent.iter().enumerate() {
                let expected: f64 = row.iter().zip(strain).map(|(d, e)| d * e).sum();
                let found = (ahead.0[p] - behind.0[p]) / (2.0 * step);
                assert!((found - expected).abs() < 1e-8 * size, "{law:?}: {found} for {expected}");
            }
        }
    }
}

#[test]
fn pressures_of_the_volume_are_the_derivatives_of_its_energy() {
    let step = 1e-5;
    for law in every_law().into_iter().filter(AnyLaw::has_volumetric_energy) {
        for change in [-0.3, 0.0, 0.2] {
            let [pressure, stiffness] = law.volume_pressures(change);
            let slope = |f: &dyn Fn(f64) -> f64| (f(change + step) - f(change - step)) / (2.0 * step);
            assert!((slope(&|x| law.volume_energy(x)) - pressure).abs() < 1e-8, "{law:?}");
            assert!((slope(&|x| law.volume_pressures(x)[0]) - stiffness).abs() < 1e-8, "{law:?}");
        }
    }
}

#[test]
fn rotation_changes_neither_energy_nor_stress() {
    for law in every_law() {
        for h in GRADIENTS.map(Tensor) {
            let turned = rotated(&h);
            let stress = total_stress(&law, &h);
            let size = stress.0.iter().fold(1.0_f64, |a, b| a.max(b.abs()));
            assert!((total_energy(&law, &h) - total_energy(&law, &turned)).abs() < 1e-14 * size, "{law:?}");
            let difference = stress - total_stress(&law, &turned);
            assert!(difference.0.iter().all(|d| d.abs() < 1e-13 * size), "{law:?}: {difference:?}");
        }
        assert!(total_energy(&law, &rotated(&Tensor::ZERO)).abs() < 1e-15, "{law:?}");
    }
}

#[test]
fn rest_is_free_of_stress_and_energy() {
    for law in every_law() {
        assert_eq!(total_energy(&law, &Tensor::ZERO), 0.0, "{law:?}");
        assert_eq!(total_stress(&law, &Tensor::ZERO), Symmetric::ZERO, "{law:?}");
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
        // The second family, e_y itself, does not feel it either.
        let across = [[0.0, -0.8, 0.0], [0.0; 3], [0.0, 0.6, 0.0]];
        let xy = slope(&law, across, 3) / -0.8;
        if law.name() == "fung-orthotropic" {
            assert!(xy <= shear + 1e-7, "{law:?}: shear modulus {xy}");
        } else {
            assert!((xy - shear).abs() < 1e-7, "{law:?}: shear modulus {xy}");
        }
        let dilation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mean: f64 = (0..3).map(|k| slope(&law, dilation, k)).sum::<f64>() / 3.0;
        assert!((mean - 3.0 * bulk).abs() < 1e-6 * bulk, "{law:?}: bulk modulus {}", mean / 3.0);
    }
}

#[test]
fn volumetric_stress_is_a_pressure_that_knows_only_the_volume() {
    for law in every_law() {
        let off = GRADIENTS.map(Tensor).map(|h| {
            let deformation = Deformation::from_displacement_gradient(&h);
            let stretch = deformation.volume_ratio.cbrt() - 1.0;
            let dilated = Tensor([[stretch, 0.0, 0.0], [0.0, stretch, 0.0], [0.0, 0.0, stretch]]);
            // J U′(J) from S = J U′ C⁻¹ in the pure dilation with the same J.
            let pressure = law
                .stress(&Deformation::from_displacement_gradient(&dilated), &FIBRES[..law.families()])
                .volumetric
                .0[0]
                * (1.0 + stretch).powi(2);
            let difference = law.stress(&deformation, &FIBRES[..law.families()]).volumetric
                - deformation.inverse_cauchy_green * pressure;
            difference.0.iter().fold(0.0_f64, |a, b| a.max(b.abs()))
        });
        let largest = off.into_iter().fold(0.0_f64, f64::max);
        assert_eq!(largest < 1e-13, law.has_volumetric_energy(), "{law:?}: off by {largest:e}");
    }
}

/// ρc² at rest of a wave along `n` that moves along `m`: m·(dP n)/ds for H = s m⊗n. The result is the larger
/// value of s → +0 and s → −0. Only fibres that carry tension alone have different values.
fn wave_stiffness(law: &AnyLaw, n: [f64; 3], m: [f64; 3]) -> f64 {
    let force = |s: f64| {
        let mut h = Tensor::ZERO;
        h.add_outer(scale(m, s), n);
        let gradient = Deformation::from_displacement_gradient(&h).gradient;
        dot(m, gradient.times_symmetric(&total_stress(law, &h)).apply(n)) / s
    };
    // One-sided and of second order: truncation near s² = 1e-10, round-off near 1e-16/s = 1e-11.
    let one_sided = |s: f64| 2.0 * force(s) - force(2.0 * s);
    one_sided(1e-5).max(one_sided(-1e-5))
}

/// Unit vectors all over the sphere (a spiral of Fibonacci), among them the fibre.
fn directions(count: u32) -> impl Iterator<Item = [f64; 3]> {
    (0..count).map(move |k| {
        let z = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(count);
        let (angle, r) = (2.399_963_229_728_653 * f64::from(k), (1.0 - z * z).sqrt());
        if k == 0 { FIBRE } else { [r * angle.cos(), r * angle.sin(), z] }
    })
}

#[test]
fn no_wave_at_rest_is_faster_than_the_longitudinal_modulus_says_and_none_stands_still() {
    for law in every_law() {
        let bound = law.longitudinal_modulus();
        let (mut fastest, mut slowest) = (0.0_f64, f64::INFINITY);
        for n in directions(40) {
            for m in directions(40) {
                let stiffness = wave_stiffness(&law, n, m);
                fastest = fastest.max(stiffness);
                slowest = slowest.min(stiffness);
            }
        }
        assert!(slowest > 0.0, "{law:?}: ρc² = {slowest}");
        assert!(fastest <= bound * (1.0 + 1e-6), "{law:?}: ρc² = {fastest}, bound {bound}");
        // Tight: exact without fibres and with one family, else as far as the sum of maxima is from the
        // maximum of sums.
        let exact = law.is_isotropic() || law.name() == "transversely-isotropic";
        let least = if exact { 1.0 - 1e-6 } else { 0.8 };
        assert!(fastest >= bound * least, "{law:?}: ρc² = {fastest}, bound {bound}");
    }
}

/// Parameters that leave the solid unstable at rest, or that say nothing: the key at fault.
#[test]
fn parameters_that_cannot_be_are_refused_by_name() {
    let moduli = |extra: Value| merged(json!({ "shear-modulus": 0.7, "bulk-modulus": 5.0 }), extra);
    let fung = |extra: Value| {
        let good = json!({
            "modulus": 1.0, "normal": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "shear": [1, 1, 1], "bulk-modulus": 5.0
        });
        merged(good, extra)
    };
    let seven: Vec<Value> = (0..7).map(|_| term(0.1, 2.0)).collect();
    let cases = [
        ("neo-hookean", json!({ "bulk-modulus": 5.0 }), "bulk-modulus"),
        ("st-venant-kirchhoff", json!({ "shear-modulus": -1.0, "bulk-modulus": 5.0 }), "shear-modulus"),
        ("mooney-rivlin", json!({ "c10": 0.1, "c01": -0.1, "bulk-modulus": 5.0 }), "c10"),
        ("mooney-rivlin", json!({ "c10": 0.1, "c01": 0.1 }), "type"),
        (
            "mooney-rivlin",
            json!({ "c10": 0.1, "c01": 0.1, "bulk-modulus": 5.0, "poisson-ratio": 0.4 }),
            "poisson-ratio",
        ),
        ("polynomial", json!({ "c10": -0.2, "c01": 0.1, "bulk-modulus": 5.0 }), "c10"),
        ("yeoh", json!({ "c1": 0.0, "bulk-modulus": 5.0 }), "c1"),
        (
            "arruda-boyce",
            json!({ "shear-modulus": 1.0, "locking-stretch": 1.0, "bulk-modulus": 5.0 }),
            "locking-stretch",
        ),
        ("gent", moduli(json!({ "limit": 0.0 })), "limit"),
        ("demiray", moduli(json!({ "exponent": -1.0 })), "exponent"),
        ("veronda-westmann", json!({ "c1": 1.0, "c2": 0.0, "bulk-modulus": 5.0 }), "c2"),
        ("ogden", json!({ "terms": [], "bulk-modulus": 5.0 }), "terms"),
        ("ogden", json!({ "terms": seven, "bulk-modulus": 5.0 }), "terms"),
        ("ogden", json!({ "terms": [term(1.0, 0.0)], "bulk-modulus": 5.0 }), "terms"),
        ("ogden", json!({ "terms": [term(-1.0, 2.0)], "bulk-modulus": 5.0 }), "terms"),
        ("transversely-isotropic", moduli(json!({ "fibre-modulus": -1.0 })), "fibre-modulus"),
        ("orthotropic", moduli(json!({ "e5": -1.0 })), "e5"),
        (
            "holzapfel-gasser-ogden",
            moduli(json!({ "fibre-modulus": 1.0, "fibre-exponent": 1.0, "dispersion": 0.4 })),
            "dispersion",
        ),
        (
            "holzapfel-gasser-ogden",
            moduli(json!({ "fibre-modulus": 1.0, "fibre-exponent": 1.0, "families": 3 })),
            "families",
        ),
        (
            "holzapfel-gasser-ogden",
            moduli(json!({ "fibre-modulus": 1.0, "fibre-exponent": 0.0 })),
            "fibre-exponent",
        ),
        ("fung-orthotropic", fung(json!({ "normal": [[1, 2, 0], [2, 1, 0], [0, 0, 1]] })), "normal"),
        ("fung-orthotropic", fung(json!({ "normal": [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]] })), "normal"),
        ("fung-orthotropic", fung(json!({ "shear": [1, 0, 1] })), "shear"),
        ("fung-orthotropic", fung(json!({ "axes": [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]] })), "axes"),
    ];
    for (name, parameters, key) in cases {
        let error = AnyLaw::from_json(name, parameters.clone()).expect_err(name);
        assert_eq!(error.key, key, "{name} {parameters}: {error}");
        assert!(!error.help.is_empty());
    }
}

#[test]
fn single_precision_follows_double() {
    for law in every_law() {
        for h in GRADIENTS.map(Tensor) {
            let fine = total_stress(&law, &h);
            let coarse =
                Deformation::<f32>::from_displacement_gradient(&Tensor(h.0.map(|row| row.map(|x| x as f32))));
            let fibres = FIBRES.map(|a| a.map(|x| x as f32));
            let Split { isochoric, volumetric } = law.stress(&coarse, &fibres[..law.families()]);
            let scale = fine.0.iter().fold(0.7_f64, |a, b| a.max(b.abs()));
            for (a, b) in fine.0.iter().zip((isochoric + volumetric).0) {
                assert!((a - f64::from(b)).abs() < 2e-5 * scale, "{law:?}");
            }
        }
    }
}

/// A page of the folder `docs`.
fn page(name: &str) -> String {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn the_page_of_laws_has_an_entry_for_every_law_and_names_its_parameters() {
    let page = page("guide/materials.md");
    let (shared, entries) = page.split_once("\n## neo-hookean\n").unwrap();
    let entries = format!("\n## neo-hookean\n{entries}");
    for name in AnyLaw::NAMES {
        let (_, entry) = entries.split_once(&format!("\n## {name}\n")).expect(name);
        let entry = entry.split("\n## ").next().unwrap();
        let schema = AnyLaw::schema(name).unwrap();
        for key in schema.get("properties").unwrap().as_object().unwrap().keys() {
            let quoted = format!("`{key}`");
            let known = entry.contains(&quoted) || shared.contains(&quoted);
            assert!(known, "docs/guide/materials.md does not name {quoted} of `{name}`");
        }
    }
}

#[test]
fn the_worked_example_of_the_docs_is_the_law_as_it_is() {
    let page = page("develop/add-a-law.md");
    for (name, text) in
        [("demiray.rs", include_str!("demiray.rs")), ("demiray.wgsl", include_str!("demiray.wgsl"))]
    {
        assert!(page.contains(text), "copy {name} into docs/develop/add-a-law.md");
    }
    for (line, file) in [
        (r#"("demiray", with_moduli(json!({ "exponent": 2.0 }))),"#, include_str!("samples.rs")),
        (r#""demiray" => Demiray,"#, include_str!("mod.rs")),
    ] {
        assert!(page.contains(line) && file.contains(line), "{line}");
    }
}
