//! The laws that tests run, here, in `pliant-explicit` and in `pliant-gpu`. A new law is one line in
//! [`every_law`].

use serde_json::{Value, json};

use super::{AnyLaw, Deformation, Law, Orthotropic, OwnLaw, SmallStrainModuli, Split};
use crate::tensor::{Symmetric, Vector};

/// The law of a name with its parameters.
///
/// # Panics
/// If they do not fit.
pub fn law(name: &str, parameters: Value) -> AnyLaw {
    AnyLaw::from_json(name, parameters).unwrap_or_else(|error| panic!("`{name}`: {error}"))
}

/// Returns every law; laws with a choice of volumetric energies come once with each energy.
///
/// # Panics
/// If a law of the registry is missing here.
pub fn every_law() -> Vec<AnyLaw> {
    let with_moduli = |extra: Value| merged(json!({ "shear-modulus": 0.7, "bulk-modulus": 5.0 }), extra);
    let with_bulk = |extra: Value| merged(json!({ "bulk-modulus": 5.0 }), extra);
    let parameters = [
        ("neo-hookean", with_moduli(json!({}))),
        ("coupled-neo-hookean", with_moduli(json!({}))),
        ("logarithmic-neo-hookean", with_moduli(json!({}))),
        ("st-venant-kirchhoff", with_moduli(json!({}))),
        ("corotational", with_moduli(json!({}))),
        ("mooney-rivlin", with_bulk(json!({ "c10": 0.3, "c01": 0.15 }))),
        ("polynomial", with_bulk(json!({ "c10": 0.3, "c01": 0.1, "c20": 0.05, "c11": 0.03, "c02": 0.02 }))),
        ("yeoh", with_bulk(json!({ "c1": 0.3, "c2": 0.1, "c3": 0.05 }))),
        ("arruda-boyce", with_bulk(json!({ "shear-modulus": 0.7, "locking-stretch": 1.8 }))),
        ("gent", with_moduli(json!({ "limit": 4.0 }))),
        ("demiray", with_moduli(json!({ "exponent": 2.0 }))),
        ("veronda-westmann", with_bulk(json!({ "c1": 0.25, "c2": 1.5 }))),
        ("ogden", with_bulk(json!({ "terms": [term(0.5, 2.5), term(0.2, -3.0)] }))),
        ("transversely-isotropic", with_moduli(json!({ "fibre-modulus": 1.1 }))),
        ("orthotropic", with_moduli(json!({ "e4": 1.1, "e5": 0.3, "e6": 0.6, "e7": 0.2 }))),
        (
            "holzapfel-gasser-ogden",
            with_moduli(json!({
                "fibre-modulus": 0.9, "fibre-exponent": 0.8, "dispersion": 0.12, "families": 2
            })),
        ),
        (
            "fung-orthotropic",
            with_bulk(json!({
                "modulus": 0.4, "normal": [[1.2, 0.3, 0.25], [0.3, 0.9, 0.2], [0.25, 0.2, 0.7]],
                "shear": [0.8, 0.6, 0.5], "axes": [[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]]
            })),
        ),
    ];
    for name in AnyLaw::NAMES {
        assert!(parameters.iter().any(|(known, _)| known == name), "`{name}` is missing from the samples");
    }
    let with_every_volume = |(name, parameters): &(&str, Value)| -> Vec<AnyLaw> {
        let choice =
            AnyLaw::schema(name).is_some_and(|schema| schema.pointer("/properties/volumetric").is_some());
        let energies: &[&str] =
            if choice { &["quadratic", "quad-log", "ln-squared", "j-ln-j"] } else { &["quadratic"] };
        let with = |energy: &&str| merged(parameters.clone(), json!({ "volumetric": energy }));
        energies.iter().map(|energy| law(name, with(energy))).collect()
    };
    parameters.iter().flat_map(with_every_volume).chain([own()]).collect()
}

/// A law that a program gives: one of the registry, with two families of fibres, under a name of its own.
///
/// # Panics
/// Never: its parameters are fixed.
pub fn own() -> AnyLaw {
    #[derive(Debug)]
    struct Given(Orthotropic);

    impl OwnLaw for Given {
        fn name(&self) -> &'static str {
            "own"
        }
        fn energy(&self, deformation: &Deformation<f64>, fibres: &[Vector<f64>]) -> Split<f64> {
            self.0.energy(deformation, fibres)
        }
        fn stress(&self, deformation: &Deformation<f64>, fibres: &[Vector<f64>]) -> Split<Symmetric<f64>> {
            self.0.stress(deformation, fibres)
        }
        fn small_strain(&self) -> SmallStrainModuli {
            self.0.small_strain()
        }
        fn families(&self) -> usize {
            Law::families(&self.0)
        }
        fn has_volumetric_energy(&self) -> bool {
            true
        }
        fn longitudinal_modulus(&self) -> f64 {
            self.0.longitudinal_modulus()
        }
    }

    let parameters = json!({
        "shear-modulus": 0.7, "bulk-modulus": 5.0, "e4": 1.1, "e5": 0.3, "e6": 0.6, "e7": 0.2
    });
    let AnyLaw::Orthotropic(law) = law("orthotropic", parameters) else { unreachable!("it has this name") };
    AnyLaw::own(Given(law))
}

/// Two tables in one.
///
/// # Panics
/// If one of them is no table.
pub fn merged(mut parameters: Value, extra: Value) -> Value {
    let (Value::Object(entries), Value::Object(extra)) = (&mut parameters, extra) else {
        panic!("not a table")
    };
    entries.extend(extra);
    parameters
}

/// A term of Ogden's law: its shear modulus [Pa] and exponent.
pub fn term(modulus: f64, exponent: f64) -> Value {
    json!({ "shear-modulus": modulus, "exponent": exponent })
}
