//! The thesis's cube [0, 0.1 m]³ between glued platens, compressed along x: figure 6.5 and the converged
//! answer at 20 %.

use pliant_mechanics::curve::Curve;
use pliant_mechanics::law::AnyLaw;
use pliant_mechanics::tensor::Vector;
use pliant_meshing::VolumeCell;

use super::FIBRE_FACTOR;
use crate::case::{Case, CaseError, Correction, Findings, Row};
use crate::picture::{Body, View, figure};
use crate::{Specimen, elastic, liver, liver_matrix, relax, settle, smooth_step, soft_tissue};

/// The constraint that moves the platen of an eighth.
pub(crate) const PLATEN: &str = "move x-min";

/// Elements along the edge of the cube of figure 6.5.
const CELLS: usize = 20;

/// Figure 6.5.
pub(crate) const DEFORMED: Case = Case {
    id: "fig-6.5",
    title: "Fig. 6.5: a compressed cube without fibres, with fibres across and along a diagonal",
    shows: "A cube is compressed by 30 % along x between platens glued to it. Without fibres it bulges equally to all \
            sides. Fibres along y resist there, and it bulges along z instead. Fibres along the diagonal y = z resist \
            along that diagonal, and it bulges along the other.",
    corrections: &[
        FIBRE_FACTOR,
        Correction {
            printed: "section 6.4: μ and κ of the liver are not printed",
            correct: "μ = 6568 Pa (half of η = 13136 Pa), ν = 0.45: our choice.",
            why: "η, α and τ are those of the thesis's own SOFA code, read as the energy's η. Under prescribed displacements the \
                  deformed shape depends on η/μ and ν only.",
        },
        Correction {
            printed: "section 6.4.3: brain-like μ = 1006.71 Pa with ν = 0.45",
            correct: "μ = 1034.48 Pa for E = 3000 Pa and ν = 0.45.",
            why: "1006.71 = 3000/(2 · 1.49) belongs to ν = 0.49. The cube at 20 % below has E = 3000 Pa, ν = 0.45.",
        },
    ],
    seconds: 10.0,
    compute,
};

/// Constrains an eighth [0, 0.05 m]³ of the cube. Its glued platen at x = 0 moves inwards by a part of its
/// edge. Its symmetry planes are x = 0.05, y = 0 and z = 0.
pub(crate) fn held_as_an_eighth(specimen: Specimen, part: f64, curve: Curve) -> Specimen {
    specimen
        .shift("x-min", part * 0.05, curve)
        .fix("x-min", [false, true, true])
        .fix("x-max", [true, false, false])
        .fix("y-min", [false, true, false])
        .fix("z-min", [false, false, true])
}

/// Force F [N] and bulge [mm] of the cube of soft tissue at 20 %, from hexahedra with `n` cells along the
/// full edge.
///
/// # Errors
/// If it does not come to rest.
pub fn compressed_by_a_fifth(n: usize) -> Result<[f64; 2], CaseError> {
    let block = Specimen::block([0.05; 3], [n / 2; 3], VolumeCell::Hex, &elastic(soft_tissue()), [0.0; 3]);
    let eighth = held_as_an_eighth(block, 0.2, smooth_step(0.5)).damped(60.0);
    let rest = settle(&eighth.model, 0.5 * eighth.element_bound(), 2.0)?;
    let force = 4.0 * rest.reaction(PLATEN)[0];
    let bulge = 1e3 * rest.displacement[eighth.node_at([0.05, 0.05, 0.0])][1];
    Ok([force, bulge])
}

/// The whole cube at 30 %: its displacements [m].
fn compressed(law: AnyLaw, fibre: Vector<f64>) -> Result<(Specimen, Vec<Vector<f64>>), CaseError> {
    let cube = Specimen::block([0.1; 3], [CELLS; 3], VolumeCell::Hex, &elastic(law), fibre)
        .carry("x-max", [-0.03, 0.0, 0.0], smooth_step(1.0))
        .fix("x-min", [true; 3]);
    let displacement = relax(&cube.model)?.displacement;
    Ok((cube, displacement))
}

fn compute() -> Result<Findings, CaseError> {
    let mut findings = Findings::default();
    let diagonal = 0.5_f64.sqrt();
    let (cube, isotropic) = compressed(liver_matrix(), [0.0; 3])?;
    let (_, across) = compressed(liver(), [0.0, 1.0, 0.0])?;
    let (_, oblique) = compressed(liver(), [0.0, diagonal, diagonal])?;

    let at = |u: &[Vector<f64>], point: Vector<f64>| u[cube.node_at(point)].map(|u| 1e3 * u);
    let (y_face, z_face) = ([0.05, 0.1, 0.05], [0.05, 0.05, 0.1]);
    let source = "quadratic and uniform-strain hexahedra of two codes; not convergent at 30 %";
    let bulge = at(&isotropic, y_face)[1];
    findings.rows.push(Row::judged("no fibres: bulge", "mm", [10.8, 0.3], bulge, source));
    let source = "quadratic hexahedra n = 6, felupe; tolerance 3 %";
    let [y, z] = [at(&across, y_face)[1], at(&across, z_face)[2]];
    findings.rows.push(Row::judged("fibres along y: bulge along y", "mm", [3.29, 0.0987], y, source));
    findings.rows.push(Row::judged("fibres along y: bulge along z", "mm", [17.40, 0.522], z, source));
    // Edges along x, halfway: outward along and across the fibres.
    let edge = |u: &[Vector<f64>], [y, z]: [f64; 2]| {
        let [_, u_y, u_z] = at(u, [0.05, 0.05 + 0.05 * y, 0.05 + 0.05 * z]);
        diagonal * (u_y * y + u_z * z)
    };
    let along = edge(&oblique, [1.0, 1.0]);
    findings.rows.push(Row::shown("fibres along y = z: edge moves along the fibres", "mm", along, ""));
    let across_them = edge(&oblique, [-1.0, 1.0]);
    findings.rows.push(Row::shown("fibres along y = z: edge moves across the fibres", "mm", across_them, ""));

    let [force, bulge] = compressed_by_a_fifth(30)?;
    let source = "limit of the meshes of several elements and codes";
    findings.rows.push(Row::judged("soft tissue at 20 %: force", "N", [8.75, 0.10], force, source));
    findings.rows.push(Row::judged("soft tissue at 20 %: bulge", "mm", [6.62, 0.05], bulge, source));

    let lateral = |u: &[Vector<f64>]| u.iter().map(|u| (u[1] * u[1] + u[2] * u[2]).sqrt()).collect();
    let bodies = [
        ("(a) at rest", None),
        ("(b) no fibres", Some(isotropic)),
        ("(c) fibres along y", Some(across)),
        ("(d) fibres along y = z", Some(oblique)),
    ]
    .map(|(label, displacement)| Body {
        value: displacement.as_deref().map(lateral),
        displacement: displacement.unwrap_or_else(|| vec![[0.0; 3]; cube.mesh.points.len()]),
        ..Body::still(label, &cube.mesh)
    });
    let view = View {
        from: [0.55, 0.45, 1.0],
        up: [0.0, 1.0, 0.0],
        quantity: "lateral displacement [mm]",
        factor: 1e3,
        columns: 2,
    };
    let caption = format!(
        "{CELLS}³ hexahedra; x to the right, y upwards; the platen at the right moved to the left. Grey: the shape at rest."
    );
    findings.figures.push(figure(&bodies, &view, caption)?);
    Ok(findings)
}
