//! Figure 6.10: von Mises stress in a stretched liver, transversely isotropic, without relaxation and with it
//! some seconds after the stretch. The organ is from `scenes/liver`, since the thesis's mesh was never
//! published.
//!
//! The source has no numbers. Instead, another solver computes an elastic equilibrium with the moduli (1 − α)
//! μ and (1 − α) η and the same κ. After relaxation, the tissue must equal it.

use pliant_format::Scene;
use pliant_format::source::Source;
use pliant_mechanics::law::AnyLaw;
use pliant_mechanics::model::Cells;
use pliant_mechanics::prony::Prony;
use pliant_scene::Built;
use pliant_sim::{Precision, Simulation};
use serde_json::json;

use super::FIBRE_FACTOR;
use crate::case::{Case, CaseError, Findings, Row};
use crate::picture::{Body, View, figure};
use crate::{largest, law, relaxed, run};

/// Figure 6.10.
pub(crate) const CASE: Case = Case {
    id: "fig-6.10",
    title: "Fig. 6.10: stress in a stretched liver, elastic and relaxed",
    shows: "The von Mises stress in a liver pulled by one lobe, with fibres along one axis: without viscoelasticity \
            (TI), and with it some seconds after the pull (TI + visco), after most of the relaxation. The stress is \
            then about half.",
    corrections: &[super::RELAXATION_SIGN, FIBRE_FACTOR],
    seconds: 5.0,
    compute,
};

/// The scene's law with a fraction of its shear and fibre moduli.
fn tissue(part: f64) -> AnyLaw {
    let parameters =
        json!({ "shear-modulus": 3e3 * part, "bulk-modulus": 29e3, "fibre-modulus": 6e3 * part });
    law("transversely-isotropic", parameters)
}

/// The results of a stretched liver.
struct Stretched {
    displacement: Vec<[f64; 3]>,
    /// Von Mises stress [Pa], one per cell.
    stress: Vec<f64>,
    /// Size of the force on the pulled lobe [N].
    force: f64,
}

impl Stretched {
    fn new(simulation: &mut Simulation) -> Result<Self, CaseError> {
        let frame = simulation.frame()?;
        let none = || CaseError::Run("there is no liver".into());
        let (part, now) = frame.parts().next().ok_or_else(none)?;
        let cells = now.cells().ok_or_else(none)?;
        let force = frame.reaction("pull").ok_or_else(none)?;
        Ok(Self {
            displacement: (0..part.model.node_count()).map(|node| now.displacement(node)).collect(),
            stress: cells.numbers(0, false, 1, &|fields, to| to[0] = fields.von_mises()),
            force: force.iter().map(|f| f * f).sum::<f64>().sqrt(),
        })
    }

    /// The elastic equilibrium with a part of the moduli left.
    fn elastic(built: &Built, part: f64, until: f64) -> Result<Self, CaseError> {
        let mut model = pliant_mechanics::Model::clone(&built.model);
        model.solids[0].material.prony = Prony::default();
        model.solids[0].material.law = tissue(part);
        Self::new(&mut relaxed(&model, until, None)?)
    }
}

/// Means of values of the cells around each node, by volume.
fn at_nodes(cells: &Cells, nodes: usize, values: &[f64]) -> Vec<f64> {
    let mut sums = vec![[0.0; 2]; nodes];
    for (cell, value) in values.iter().enumerate() {
        let volume = cells.volume(cell);
        for &node in cells.nodes(cell) {
            sums[node as usize][0] += volume * value;
            sums[node as usize][1] += volume;
        }
    }
    sums.into_iter().map(|[sum, volume]| if volume > 0.0 { sum / volume } else { 0.0 }).collect()
}

/// The scene of the liver that is pulled.
pub(super) fn scene() -> Result<Scene, CaseError> {
    let text = include_str!("../../../../scenes/liver/scene.toml");
    Ok(Scene::from_source(Source::parse("scenes/liver/scene.toml", text)?, ".".into())?)
}

fn compute() -> Result<Findings, CaseError> {
    let scene = scene()?;
    let built = pliant_scene::build(&scene)?;
    let plan = pliant_scene::plan(&scene, &built)?;
    let until = scene.scene.until;

    let elastic = Stretched::elastic(&built, 1.0, until)?;
    let long_after = Stretched::elastic(&built, 0.5, until)?;
    let mut run = run(&built.model, Precision::Single, plan.steps.step, until, |_| ())?;
    let relaxed = Stretched::new(&mut run)?;

    let mut findings = Findings::default();
    let cells = &built.model.solids[0].cells;
    let mean = |stress: &[f64]| {
        let volume = |cell: usize| cells.volume(cell);
        let total: f64 = (0..cells.len()).map(volume).sum();
        stress.iter().enumerate().map(|(cell, s)| volume(cell) * s).sum::<f64>() / total
    };
    // 1 %: three seconds after the pull e^(−3/0.58) = 0.6 % of the relaxing stress is left.
    let source = "elastic equilibrium with half of μ and η, by dynamic relaxation";
    let most = |stretched: &Stretched| largest(stretched.stress.iter().copied());
    let numbers = |stretched: &Stretched| [most(stretched), mean(&stretched.stress), stretched.force];
    let [before, after, limit] = [&elastic, &relaxed, &long_after].map(numbers);
    for (which, (name, unit)) in
        [("largest von Mises stress", "Pa"), ("mean von Mises stress", "Pa"), ("force on the lobe", "N")]
            .into_iter()
            .enumerate()
    {
        let [before, after, limit] = [before, after, limit].map(|numbers| numbers[which]);
        findings.rows.push(Row::shown(format!("TI: {name}"), unit, before, ""));
        findings.rows.push(Row::shown(format!("TI + visco at 5 s: {name}"), unit, after, ""));
        findings.rows.push(Row::shown(format!("{name}, TI + visco over TI"), "", after / before, ""));
        let quantity = format!("TI + visco at 5 s: {name}, deviation from the relaxed limit");
        findings.rows.push(Row::deviation(quantity, 0.01, (after / limit - 1.0).abs(), source));
    }

    let nodes = built.model.node_count();
    let mesh = &built.bodies[0].mesh;
    let bodies = [("(a) at rest", None), ("(b) TI", Some(elastic)), ("(c) TI + visco at 5 s", Some(relaxed))]
        .map(|(label, stretched)| Body {
            value: stretched.as_ref().map(|stretched| at_nodes(cells, nodes, &stretched.stress)),
            displacement: stretched.map_or_else(|| vec![[0.0; 3]; nodes], |stretched| stretched.displacement),
            ..Body::still(label, mesh)
        });
    let view = View {
        from: [0.15, -1.0, 0.35],
        up: [0.0, 0.0, 1.0],
        quantity: "von Mises stress [kPa]",
        factor: 1e-3,
        columns: 2,
    };
    let caption = format!(
        "Pliant's own liver, {} tetrahedra, pulled by its left lobe. Grey: the shape at rest. Stresses of the elements, \
         averaged at the nodes.",
        cells.len()
    );
    findings.figures.push(figure(&bodies, &view, caption)?);
    Ok(findings)
}

#[cfg(test)]
mod tests {
    use pliant_mechanics::prony::PronyUpdate;

    use super::*;
    use crate::liver_relaxation;

    #[test]
    fn the_tissue_is_that_of_the_scene_and_half_of_it_relaxes() {
        let material = pliant_scene::build(&scene().unwrap()).unwrap().model.solids[0].material.clone();
        assert_eq!(material.law, tissue(1.0));
        assert_eq!(material.prony, liver_relaxation(PronyUpdate::Exact));
    }
}
