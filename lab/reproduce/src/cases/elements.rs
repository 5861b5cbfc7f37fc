//! Accuracy of elements for nearly incompressible tissue, ν = 0.49: the cantilever under its own weight and
//! the glued cube at 20 %.
//!
//! Cantilever 0.08 × 0.03 × 0.03 m, half of it modelled, E = 20 kPa, ρ = 1000: tip (0.08, 0, 0.03) sinks by
//! 34.85 ± 0.15 mm. Cube of 0.1 m, an eighth of it modelled, E = 3 kPa: F = 9.15 ± 0.15 N, bulge 7.57 ± 0.08
//! mm.

use pliant_geometry::Mesh;
use pliant_mechanics::law::AnyLaw;
use pliant_mechanics::model::Averaging;
use pliant_meshing::{Block, DEFAULT_CELL_LIMIT, Resolution, VolumeCell};
use serde_json::json;

use super::cube;
use crate::case::{Case, CaseError, Findings, Row};
use crate::plot::bars;
use crate::{Hexes, Specimen, Tets, elastic, law, mesh, relax, smooth_step};

/// u_z [mm] of the cantilever's tip in the limit of fine meshes, and its uncertainty.
pub const TIP: [f64; 2] = [-34.85, 0.15];
/// F [N] of the cube in the limit of fine meshes, and its uncertainty.
pub const FORCE: [f64; 2] = [9.15, 0.15];

/// An element of the study: its name and the elements of tets and hexes. With `hexes` the mesh is of hexes.
#[derive(Clone, Copy, Debug)]
pub struct Element {
    /// Its name in a scene.
    pub name: &'static str,
    tets: Tets,
    /// Hexes of the cantilever and of the cube.
    hexes: Option<[Hexes; 2]>,
}

const fn tet(name: &'static str, tets: Tets) -> Element {
    Element { name, tets, hexes: None }
}

/// The elements of the study.
pub const ELEMENTS: [Element; 5] = [
    tet("tet4", Tets::Plain),
    tet("tet4-anp", Tets::Averaged(Averaging::Nodal)),
    tet("tet4-ianp", Tets::Averaged(Averaging::Variational)),
    Element {
        name: "hex8",
        tets: Tets::Plain,
        hexes: Some([Hexes::UniformStrain(0.2), Hexes::UniformStrain(0.05)]),
    },
    Element { name: "hex8-full", tets: Tets::Plain, hexes: Some([Hexes::Full; 2]) },
];

/// Results of the prototype of the formulas on the same meshes, in the order of [`ELEMENTS`]: tip [mm] and F
/// [N] as printed.
const PROTOTYPE: [[f64; 2]; 5] =
    [[-26.6, 10.19], [-32.5, 9.57], [-33.0, 9.47], [-34.83, 9.10], [-34.5, 9.25]];

/// The element study.
pub(crate) const CASE: Case = Case {
    id: "elements",
    title: "Elements for nearly incompressible tissue",
    shows: "The thesis has only plain tetrahedra and one-point hexahedra. At ν = 0.49 plain tetrahedra lock: a \
            cantilever sinks a quarter too little, and the force of a compressed cube is a tenth too large. Averaged \
            nodal pressure (`tet4-anp`, `tet4-ianp`) removes most of this error. Hexahedra with hourglass control \
            scaled with μ (`hex8`) or with mean dilatation (`hex8-full`) come within one per cent.",
    corrections: &[
        crate::case::Correction {
            printed: "(6.2): 8 Bᵀ S J, one point, gradients at the centroid",
            correct: "J belongs to the element at rest (it is not det F), and the gradient is the mean over the element.",
            why: "With the centroid's gradient distorted hexahedra fail the patch test (0.66 % of the largest force); \
                  with the mean they pass to round-off.",
        },
        crate::case::Correction {
            printed: "(5.33), (6.9): Δt = L/c with the shortest edge L",
            correct: "2/ωₘₐₓ, bounded element by element through Σ|B|².",
            why: "The shortest edge is not a bound: it is too large by 2.4 for a regular tetrahedron, by 40 for a sliver. A \
                  tetrahedral block with that step fails after 11 steps.",
        },
    ],
    seconds: 20.0,
    compute,
};

fn nearly_incompressible(young: f64) -> AnyLaw {
    law("neo-hookean", json!({ "young-modulus": young, "poisson-ratio": 0.49 }))
}

fn hexes(size: [f64; 3], counts: [usize; 3]) -> Mesh {
    let mesh = Block::new(size).mesh(Resolution::Counts(counts), VolumeCell::Hex, DEFAULT_CELL_LIMIT);
    mesh.unwrap_or_else(|error| panic!("{error}"))
}

/// u_z of the cantilever's tip [mm] and the number of nodes.
///
/// # Errors
/// If no equilibrium is found.
pub fn tip(element: &Element) -> Result<(f64, usize), CaseError> {
    let mesh = match element.hexes {
        Some(_) => hexes([0.08, 0.015, 0.03], [16, 3, 6]),
        None => mesh(include_bytes!("../../../validation/data/cantilever_half_tet4.msh")),
    };
    let (material, hexes) =
        (elastic(nearly_incompressible(20e3)), element.hexes.map_or(Hexes::Full, |h| h[0]));
    let beam = Specimen::of_elements(mesh, element.tets, hexes, &material, [0.0; 3])
        .fix("x-min", [true; 3])
        .fix("y-min", [false, true, false])
        .falling([0.0, 0.0, -9.81]);
    let rest = relax(&beam.model)?;
    Ok((1e3 * rest.displacement[beam.node_at([0.08, 0.0, 0.03])][2], beam.model.node_count()))
}

/// Force on the cube's platen [N] and the number of nodes.
///
/// # Errors
/// If no equilibrium is found.
pub fn force(element: &Element) -> Result<(f64, usize), CaseError> {
    let mesh = match element.hexes {
        Some(_) => hexes([0.05; 3], [10; 3]),
        None => mesh(include_bytes!("../../../validation/data/cube_eighth_tet4.msh")),
    };
    let (material, hexes) =
        (elastic(nearly_incompressible(3e3)), element.hexes.map_or(Hexes::Full, |h| h[1]));
    let eighth = cube::held_as_an_eighth(
        Specimen::of_elements(mesh, element.tets, hexes, &material, [0.0; 3]),
        0.2,
        smooth_step(1.0),
    );
    let rest = relax(&eighth.model)?;
    Ok((4.0 * rest.reaction(cube::PLATEN)[0], eighth.model.node_count()))
}

/// Deviation in percent.
pub fn percent_off(value: f64, truth: f64) -> f64 {
    100.0 * (value / truth - 1.0)
}

fn compute() -> Result<Findings, CaseError> {
    let mut findings = Findings::default();
    let (mut tips, mut forces) = (Vec::new(), Vec::new());
    let source = "prototype of the formulas on the same mesh, as printed";
    for (element, printed) in ELEMENTS.iter().zip(PROTOTYPE) {
        let name = element.name;
        let ((tip, tip_nodes), (force, force_nodes)) = (tip(element)?, force(element)?);
        // One unit of the last printed digit.
        let unit = if name == "hex8" { 0.01 } else { 0.1 };
        let quantity = format!("cantilever, {name}, {tip_nodes} nodes: tip");
        findings.rows.push(Row::judged(quantity, "mm", [printed[0], unit], tip, source));
        let quantity = format!("cube at 20 %, {name}, {force_nodes} nodes: force");
        findings.rows.push(Row::judged(quantity, "N", [printed[1], 0.01], force, source));
        tips.push((name, percent_off(tip, TIP[0])));
        forces.push((name, percent_off(force, FORCE[0])));
        if name == "hex8" {
            let source = "limit of quadratic hexahedra, CalculiX";
            findings.rows.push(Row::judged("cantilever, hex8: tip, converged", "mm", TIP, tip, source));
            findings.rows.push(Row::judged(
                "cube at 20 %, hex8: force, converged",
                "N",
                FORCE,
                force,
                source,
            ));
        }
    }
    let caption = "Deviation from the limit of fine meshes.";
    findings.figures.push(bars("Cantilever: tip", "error against −34.85 mm [%]", &tips, caption)?);
    findings.figures.push(bars("Cube at 20 %: force", "error against 9.15 N [%]", &forces, caption)?);
    Ok(findings)
}
