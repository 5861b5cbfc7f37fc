//! Materials of NiftySim as laws of a scene.

use super::error::{Fault, ImportProblem};
use super::geometry::positive;
use super::xml::{XmlElement, attribute, child, count, fault, needed, numbers};

/// An elastic law with NiftySim's parameters.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Elastic {
    /// μ, κ [Pa].
    NeoHookean([f64; 2]),
    /// μ [Pa], locking stretch, κ [Pa].
    ArrudaBoyce([f64; 3]),
    /// C10, C01, C20, C02, C11, κ [Pa].
    Polynomial([f64; 6]),
    /// μ, κ, η as published [Pa], and the fibre.
    TransverselyIsotropic([f64; 3], [f64; 3]),
    /// E [Pa], ν.
    Linear([f64; 2]),
}

/// A material: an elastic law, and its relaxing parts.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Material {
    /// The type in NiftySim.
    pub name: &'static str,
    pub elastic: Elastic,
    /// Weight and time [s] of each term on the change of shape.
    pub isochoric: Vec<[f64; 2]>,
    /// Weight and time [s] of each term on the change of volume.
    pub volumetric: Vec<[f64; 2]>,
}

const TYPES: [&str; 7] = ["NH", "AB", "PY", "TI", "NHV", "TIV", "LE"];
const PARAMETERS: &str = "<ElasticParams NumParams=\"2\">mu kappa</ElasticParams>";

impl Material {
    /// Reads `<Material>`, and its density [kg/m³] if it has its own.
    pub fn read(of: XmlElement<'_>) -> Result<(Self, Option<f64>), Fault> {
        let found = attribute(of, "Type", "Type=\"NH\", \"AB\", \"PY\", \"TI\", \"NHV\", \"TIV\" or \"LE\"")?;
        let Some(name) = TYPES.into_iter().find(|name| *name == found) else {
            let (what, known) = ("type of material", "NH, AB, PY, TI, NHV, TIV, LE");
            return Err(fault(of, ImportProblem::Unknown { what, found: found.into(), known }));
        };
        let elastic = Elastic::read(name, needed(of, "ElasticParams", PARAMETERS)?)?;
        let (isochoric, volumetric) = match name {
            "NHV" | "TIV" => prony(of)?,
            _ => Default::default(),
        };
        let density = child(of, "Density").map(|density| positive(density, "the density")).transpose()?;
        Ok((Self { name, elastic, isochoric, volumetric }, density))
    }

    pub fn relaxes(&self) -> bool {
        !self.isochoric.is_empty() || !self.volumetric.is_empty()
    }

    /// The table of the law without its header.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = self.elastic.lines();
        lines[0] += &format!("  # {}", self.name);
        if self.relaxes() {
            let term = |part, [weight, time]: [f64; 2]| {
                format!("    {{ part = \"{part}\", weight = {weight:?}, time = {time:?} }},")
            };
            lines.push("prony = [".into());
            lines.extend(self.isochoric.iter().map(|&pair| term("isochoric", pair)));
            lines.extend(self.volumetric.iter().map(|&pair| term("volumetric", pair)));
            lines.push("]".into());
            lines.push("prony-update = \"backward-euler\"".into());
        }
        lines
    }
}

impl Elastic {
    fn read(name: &str, of: XmlElement<'_>) -> Result<Self, Fault> {
        let found = numbers(of)?;
        if let Some(word) = of.attribute("NumParams") {
            let wanted = count(of, word.trim())?;
            if wanted != found.len() {
                let wanted = format!("{wanted} (`NumParams`)");
                let problem = ImportProblem::Count { what: "parameters", found: found.len(), wanted };
                return Err(fault(of, problem));
            }
        }
        let (elastic, meaning) = match name {
            "NH" | "NHV" => (found.try_into().map(Self::NeoHookean), "2: mu kappa"),
            "AB" => (found.try_into().map(Self::ArrudaBoyce), "3: mu lambda_m kappa"),
            "PY" => (found.try_into().map(Self::Polynomial), "6: C10 C01 C20 C02 C11 kappa"),
            "LE" => (found.try_into().map(Self::Linear), "2: E nu"),
            _ => {
                let both = |[mu, kappa, eta, x, y, z]: [f64; 6]| {
                    Self::TransverselyIsotropic([mu, kappa, eta], [x, y, z])
                };
                (found.try_into().map(both), "6: mu kappa eta a1 a2 a3")
            }
        };
        let count = |found: Vec<f64>| ImportProblem::Count {
            what: "parameters",
            found: found.len(),
            wanted: format!("{meaning} ({name})"),
        };
        let elastic = elastic.map_err(|found| fault(of, count(found)))?;
        elastic.check().map(|()| elastic.clone()).map_err(|problem| fault(of, problem))
    }

    fn check(&self) -> Result<(), ImportProblem> {
        let positive = |what, value: f64| (value > 0.0, what, value, "greater than 0");
        let checks = match *self {
            Self::NeoHookean([mu, kappa]) => vec![positive("mu", mu), positive("kappa", kappa)],
            Self::ArrudaBoyce([mu, locking, kappa]) => {
                vec![positive("mu", mu), positive("lambda_m", locking), positive("kappa", kappa)]
            }
            Self::Polynomial([c10, c01, .., kappa]) => {
                vec![positive("C10 + C01", c10 + c01), positive("kappa", kappa)]
            }
            Self::TransverselyIsotropic([mu, kappa, eta], fibre) => {
                let length = fibre.iter().map(|x| x * x).sum::<f64>().sqrt();
                let eta = (eta >= 0.0, "eta", eta, "at least 0");
                let length = positive("the length of the fibre (a1, a2, a3)", length);
                vec![positive("mu", mu), positive("kappa", kappa), eta, length]
            }
            Self::Linear([young, poisson]) => {
                let range = "greater than -1 and less than 0.5";
                vec![positive("E", young), (poisson > -1.0 && poisson < 0.5, "nu", poisson, range)]
            }
        };
        match checks.into_iter().find(|(fine, ..)| !fine) {
            Some((_, what, value, range)) => Err(ImportProblem::OutOfRange { what, value, range }),
            None => Ok(()),
        }
    }

    /// The shear modulus at rest [Pa], by which a scene scales its hourglass stiffness.
    fn shear_at_rest(&self) -> f64 {
        match *self {
            // 2 dΨ/dĪ₁ at Ī₁ = 3 of Ψ = μ Σ Cᵢ λₘ^(2−2i) (Ī₁ⁱ − 3ⁱ).
            Self::ArrudaBoyce([mu, locking, _]) => {
                let c = [0.5, 1.0 / 20.0, 11.0 / 1050.0, 19.0 / 7000.0, 519.0 / 673_750.0];
                let ratio = 3.0 / (locking * locking);
                let terms = (0..).zip(c).map(|(i, c)| f64::from(i + 1) * c * ratio.powi(i));
                2.0 * mu * terms.sum::<f64>()
            }
            _ => self.niftysim_moduli()[0],
        }
    }

    /// μ and κ [Pa] by which NiftySim scales its hourglass stiffness. For Arruda and Boyce's law μ is the
    /// coefficient.
    fn niftysim_moduli(&self) -> [f64; 2] {
        match *self {
            Self::NeoHookean([mu, kappa]) | Self::ArrudaBoyce([mu, _, kappa]) => [mu, kappa],
            Self::TransverselyIsotropic([mu, kappa, _], _) => [mu, kappa],
            Self::Polynomial([c10, c01, .., kappa]) => [2.0 * (c10 + c01), kappa],
            Self::Linear([young, poisson]) => {
                [young / (2.0 * (1.0 + poisson)), young / (3.0 * (1.0 - 2.0 * poisson))]
            }
        }
    }

    /// The multiple of the shear modulus at rest that is `coefficient` (λ + 2μ).
    pub fn hourglass(&self, coefficient: f64) -> f64 {
        let [mu, kappa] = self.niftysim_moduli();
        coefficient * (kappa + 4.0 / 3.0 * mu) / self.shear_at_rest()
    }

    fn lines(&self) -> Vec<String> {
        let table = |name: &str, keys: &[(&str, f64)]| {
            let mut lines = vec![format!("type = \"{name}\"")];
            lines.extend(keys.iter().map(|(key, value)| format!("{key} = {value:?}")));
            lines
        };
        match *self {
            Self::NeoHookean([mu, kappa]) => {
                table("neo-hookean", &[("shear-modulus", mu), ("bulk-modulus", kappa)])
            }
            Self::ArrudaBoyce([mu, locking, kappa]) => {
                let keys = [("shear-modulus", mu), ("locking-stretch", locking), ("bulk-modulus", kappa)];
                let mut lines = table("arruda-boyce", &keys);
                lines.push("volumetric = \"quad-log\"".into());
                lines
            }
            Self::Polynomial([c10, c01, c20, c02, c11, kappa]) => {
                let keys = [("c10", c10), ("c01", c01), ("c20", c20), ("c11", c11), ("c02", c02)];
                let mut lines = table("polynomial", &keys);
                lines.push(format!("bulk-modulus = {kappa:?}"));
                lines
            }
            Self::TransverselyIsotropic([mu, kappa, eta], fibre) => {
                let keys = [("shear-modulus", mu), ("bulk-modulus", kappa), ("fibre-modulus", eta)];
                let mut lines = table("transversely-isotropic", &keys);
                lines.push("convention = \"taylor\"".into());
                lines.push(format!("fibre = {fibre:?}"));
                lines
            }
            Self::Linear([young, poisson]) => {
                table("st-venant-kirchhoff", &[("young-modulus", young), ("poisson-ratio", poisson)])
            }
        }
    }
}

/// Terms (weight, time) of one part of the stress.
type Terms = Vec<[f64; 2]>;

/// Terms on the change of shape and on the change of volume.
fn prony(of: XmlElement<'_>) -> Result<(Terms, Terms), Fault> {
    let example = "<ViscoParams NumIsoTerms=\"1\" NumVolTerms=\"0\">a tau</ViscoParams>";
    let of = needed(of, "ViscoParams", example)?;
    let isochoric = count(of, attribute(of, "NumIsoTerms", "NumIsoTerms=\"1\"")?)?;
    let volumetric = count(of, attribute(of, "NumVolTerms", "NumVolTerms=\"0\"")?)?;
    let found = numbers(of)?;
    let wanted = isochoric.checked_add(volumetric).and_then(|terms| terms.checked_mul(2));
    if wanted != Some(found.len()) {
        let wanted = format!("2 × ({isochoric} + {volumetric})");
        return Err(fault(of, ImportProblem::Count { what: "numbers a, tau", found: found.len(), wanted }));
    }
    let pairs: Vec<[f64; 2]> = found.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect();
    let (first, second) = pairs.split_at(isochoric);
    for terms in [first, second] {
        let ranges = [("a weight of a relaxation", 0), ("a relaxation time", 1)];
        for (what, at) in ranges {
            // A weight of 0 relaxes nothing: NiftySim's examples have such terms to switch relaxation off.
            let fine = |pair: &&[f64; 2]| if at == 0 { pair[0] >= 0.0 } else { pair[1] > 0.0 };
            if let Some(pair) = terms.iter().find(|pair| !fine(pair)) {
                let range = if at == 0 { "at least 0" } else { "greater than 0" };
                return Err(fault(of, ImportProblem::OutOfRange { what, value: pair[at], range }));
            }
        }
        let value: f64 = terms.iter().map(|pair| pair[0]).sum();
        if value >= 1.0 {
            let (what, range) = ("the sum of the weights of one part of the stress", "less than 1");
            return Err(fault(of, ImportProblem::OutOfRange { what, value, range }));
        }
    }
    let acting = |terms: &[[f64; 2]]| terms.iter().filter(|pair| pair[0] > 0.0).copied().collect();
    Ok((acting(first), acting(second)))
}
