//! Table 8.1: the thesis's clamped plate under uniform load. L = 10 m, h = 0.1 m, E = 1.092 MPa, ν = 0.3, so
//! D = 100 N m; by linear theory its centre sinks by 0.126532 q.

use pliant_geometry::Mesh;
use pliant_mechanics::load::LoadKind;
use pliant_meshing::{Pattern, Sheet};
use pliant_shells::element::{Bending, Formulation, Membrane};
use pliant_sim::{Frame, Part, Simulation, World};

use crate::case::{Case, CaseError, Correction, Findings, Row};
use crate::plot::{Curve, Key, Pen, Plot};
use crate::shells::{CLAMPED, Specimen, sheet, symmetry};

/// Length of an edge [m].
pub const SIDE: f64 = 10.0;
/// Young's modulus [Pa] and Poisson's ratio.
pub const ELASTIC: [f64; 2] = [1_092_000.0, 0.3];
/// Thickness [m].
pub const THICKNESS: f64 = 0.1;
/// E h³/(12 (1 − ν²)) [N m].
pub const RIGIDITY: f64 = 100.0;

/// Centre deflection by linear theory [m] at 1 Pa.
const LINEAR: f64 = 0.126532;
/// Table 8.1, [m] at 1 to 5 Pa.
const PRINTED: [f64; 5] = [0.1218, 0.2475, 0.3747, 0.5050, 0.6374];
/// Centre deflections [m] at 1 to 5 Pa by large-deflection theory, from the prototype of the formulas on a
/// quarter of 16 × 16 cells.
pub const LARGE: [f64; 5] = [0.0890, 0.1310, 0.1588, 0.1801, 0.1977];

/// Table 8.1.
pub(crate) const CASE: Case = Case {
    id: "table-8.1",
    title: "Table 8.1: a clamped plate under uniform load",
    shows: "The deflection in the middle of a square plate, clamped on all sides, under 1 to 5 Pa. The thesis prints 0.1218 to \
            0.6374 m, an error of 0.93 % against z = 0.126 q. This formula is linear theory, and deflections of 1.3 to 6.4 \
            thicknesses are far outside it: a plate whose edges do not move in its plane carries such loads mostly as a membrane. \
            It sinks by 0.089 to 0.198 m. At q = 0.01 Pa, where linear theory holds, the two agree.",
    corrections: &[
        Correction {
            printed: "section 8.4: z = 0.126 q at q = 1 to 5 N/m²",
            correct: "Linear theory up to about q = 0.05; beyond it the membrane counts.",
            why: "w/h is 1.3 to 6.4. A comment in the author's published scene says that Table 8.1 contains bending only.",
        },
        Correction {
            printed: "section 8.4: error 0.93 %",
            correct: "−3.3, −1.8, −0.9, +0.2 and +1.2 % at q = 1 to 5.",
            why: "0.93 % is the error of the mean of the five, in which errors of opposite signs cancel. The agreement itself comes from two \
                  cancelling errors: an element 21 % too soft on that mesh, and a load 21 % too small. Equal shares on all 81 \
                  nodes put 32/81 of the load on clamped nodes instead of 15/64.",
        },
        Correction {
            printed: "(8.2): E/(12 (1 − ν²)) for membrane and bending",
            correct: "E/(1 − ν²) times t for the membrane and times t³/12 for bending.",
            why: "The 12 comes from ∫z² dz and belongs to bending only.",
        },
    ],
    seconds: 5.0,
    compute,
};

/// The whole plate, with `cells` a side.
///
/// # Errors
/// If it cannot be meshed.
pub fn mesh(cells: usize, pattern: Pattern) -> Result<Mesh, CaseError> {
    sheet(Sheet::Plate { size: [SIDE; 2] }, [cells; 2], pattern)
}

/// The whole plate with the same components fixed on all edges.
///
/// # Errors
/// If the mesh is not a valid shell.
pub fn held(mesh: Mesh, formulation: Formulation, components: [bool; 6]) -> Result<Specimen, CaseError> {
    let plate = Specimen::new(mesh, ELASTIC, THICKNESS, formulation)?;
    Ok(["x-min", "x-max", "y-min", "y-max"]
        .into_iter()
        .fold(plate, |plate, edge| plate.prescribe_edge(edge, components)))
}

/// Centre deflection of the clamped plate under uniform load by linear theory, over Timoshenko's 0.00126532 q
/// L⁴/D.
///
/// # Errors
/// If the stiffness is singular.
pub fn clamped(mesh: Mesh, formulation: Formulation) -> Result<f64, CaseError> {
    let plate = held(mesh, formulation, CLAMPED)?.cover([0.0, 0.0, 1.0]);
    let centre = plate.node(0.5 * SIDE, 0.5 * SIDE, 0.0);
    Ok(plate.linear(centre)?[2] * RIGIDITY / (0.00126532 * SIDE.powi(4)))
}

/// Computes the deflections [m] in the middle under loads [Pa] one after the other, up to 5 Pa. They are
/// equilibria with large rotations of a quarter of 16 × 16 cells, whose edges do not move in their plane.
///
/// # Errors
/// If an equilibrium is not found.
pub fn deflections(loads: &[f64]) -> Result<Vec<f64>, CaseError> {
    let quarter = sheet(Sheet::Plate { size: [0.5 * SIDE; 2] }, [16; 2], Pattern::UnionJack)?;
    let plate = Specimen::new(quarter, ELASTIC, THICKNESS, Formulation::default())?
        .prescribe_edge("x-min", CLAMPED)
        .prescribe_edge("y-min", CLAMPED)
        .prescribe_edge("x-max", symmetry(0))
        .prescribe_edge("y-max", symmetry(1))
        .cover([0.0, 0.0, 5.0]);
    let centre = plate.node(0.5 * SIDE, 0.5 * SIDE, 0.0) as usize;
    let ends: Vec<f64> = loads.iter().map(|load| load / 5.0).collect();
    let until = ends.last().copied().unwrap_or(0.0);
    let mut part = Part::equilibria("plate", plate.model, until, loads.len() as u64);
    part.steps.ends = Some(ends);
    let mut found = Vec::new();
    let at_centre = |frame: &Frame<'_>| frame.parts().map(|(_, now)| now.displacement(centre)[2]).next();
    Simulation::new(World::new(vec![part]))?.run(until, |frame| found.extend(at_centre(frame)))?;
    // The first instant is at rest.
    Ok(found.split_off(1))
}

/// Computes the deflection at 1 Pa [m] of the thesis's bending element, without membrane, on 9 × 9 nodes. All
/// nodes, clamped ones too, share the whole load equally.
fn as_in_the_thesis() -> Result<f64, CaseError> {
    let bending = Formulation { membrane: Membrane::None, bending: Bending::Comas2010 };
    let mesh = mesh(8, Pattern::Diagonal)?;
    let nodes: Vec<u32> = (0..mesh.points.len() as u32).collect();
    let share = SIDE * SIDE / nodes.len() as f64;
    let plate = held(mesh, bending, CLAMPED)?
        .prescribe(nodes.clone(), [true, true, false, false, false, true])
        .load(LoadKind::force(nodes, [0.0, 0.0, share]));
    let centre = plate.node(0.5 * SIDE, 0.5 * SIDE, 0.0);
    Ok(plate.linear(centre)?[2])
}

fn compute() -> Result<Findings, CaseError> {
    let mut findings = Findings::default();
    let small = deflections(&[0.01])?[0];
    let quantity = "q = 0.01 Pa: deflection over 0.126532 q";
    findings.rows.push(Row::judged(
        quantity,
        "",
        [1.0, 0.01],
        small / (0.01 * LINEAR),
        "linear theory (Timoshenko)",
    ));
    let thesis = as_in_the_thesis()?;
    let large = deflections(&[1.0, 2.0, 3.0, 4.0, 5.0])?;
    let loads = [1.0, 2.0, 3.0, 4.0, 5.0];
    for ((load, found), (expected, printed)) in
        loads.into_iter().zip(&large).zip(LARGE.into_iter().zip(PRINTED))
    {
        let source = "prototype of the formulas, large rotations; tolerance 1 %";
        let quantity = format!("q = {load} Pa: deflection");
        findings.rows.push(Row::judged(quantity, "m", [expected, 0.01 * expected], *found, source));
        let quantity = format!(
            "q = {load} Pa: the thesis's element in bending only, 9 × 9 nodes, equal shares of the load"
        );
        let row = Row::shown(quantity, "m", thesis * load, "Table 8.1, as printed");
        findings.rows.push(Row { reference: Some(printed), ..row });
    }
    let fine: Vec<f64> = (1..=20).map(|i| 0.25 * f64::from(i)).collect();
    let curve: Vec<(f64, f64)> = fine.iter().copied().zip(deflections(&fine)?).collect();
    let whole: Vec<(f64, f64)> = [(0.0, 0.0)].into_iter().chain(curve).collect();
    let curves = [
        Curve::new("linear theory, 0.1265 q", 5, Pen::Dashes, vec![(0.0, 0.0), (5.0, 5.0 * LINEAR)]),
        Curve::new("Table 8.1, as printed", 1, Pen::Markers, loads.into_iter().zip(PRINTED).collect()),
        Curve::new("large deflections", 0, Pen::Line, whole),
    ];
    let plot = Plot {
        title: "Clamped plate",
        axes: ["q [Pa]", "deflection in the middle [m]"],
        logarithmic: false,
        key: Key::UpperLeft,
        curves: &curves,
    };
    findings.figures.push(plot.figure("The plate is 0.1 m thick.")?);
    Ok(findings)
}
