//! Large rotations of shells: the benchmarks of Sze, Liu and Lo (2004), FEAD 40:1551, and the thesis's
//! clamped plate far beyond small deflections. Each load step of the benchmarks is compared with the printed
//! table (`data/shell/large_rotation.json`).

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use pliant_geometry::Mesh;
use pliant_implicit::{Control, State, StaticSettings, Statics, Step};
use pliant_linear::LinearSolver;
use pliant_mechanics::load::LoadKind;
use pliant_meshing::{DEFAULT_CELL_LIMIT, Pattern, Sheet};
use pliant_reproduce::cases::plate::{LARGE, deflections};
use pliant_shells::element::{Formulation, Membrane};
use pliant_validation::shells::{CLAMPED, FLAT, Specimen, symmetry};
use pliant_validation::{claim, numbers, reference};

fn mesh(sheet: Sheet, counts: [usize; 2], pattern: Pattern) -> Mesh {
    sheet.mesh(counts, pattern, None, DEFAULT_CELL_LIMIT).unwrap()
}

fn table(name: &str) -> Vec<Vec<f64>> {
    reference("shell/large_rotation.json")[name]["rows"].as_array().unwrap().iter().map(numbers).collect()
}

/// Loads in the steps of a table. Returns the two observed values at the end, and their largest deviations
/// from the table's columns over the columns' largest values.
fn follow(
    what: &str,
    specimen: &Specimen,
    rows: &[Vec<f64>],
    linear: LinearSolver,
    look: impl Fn(&State) -> [f64; 2],
) -> ([f64; 2], [f64; 2]) {
    let mut solver =
        Statics::new(specimen.model.clone(), StaticSettings { linear, ..StaticSettings::default() }).unwrap();
    let mut state = State::at_rest(&specimen.model);
    let mut off = [0.0_f64; 2];
    let largest = [1, 2].map(|c| rows.iter().map(|row| row[c].abs()).fold(0.0, f64::max));
    for row in rows {
        let Step { residuals, parts, .. } = solver.solve(&mut state, row[0]).unwrap();
        let found = look(&state);
        for c in 0..2 {
            off[c] = off[c].max((found[c] - row[c + 1]).abs() / largest[c]);
        }
        println!(
            "{what} at {:.3}: {:.3} ({:.3}), {:.3} ({:.3}); {parts} parts, {} iterations",
            row[0],
            found[0],
            row[1],
            found[1],
            row[2],
            residuals.len() - 1
        );
    }
    (look(&state), off)
}

/// 16 × 1 cells. The prototype ends at 3.290 and 6.704.
#[test]
fn cantilever_under_end_shear() {
    let sheet = Sheet::Plate { size: [10.0, 1.0] };
    let beam =
        Specimen::new(mesh(sheet, [16, 1], Pattern::Diagonal), [1.2e6, 0.0], 0.1, Formulation::default())
            .unwrap()
            .prescribe_edge("x-min", CLAMPED)
            .pull_edge("x-max", [0.0, 0.0, 4.0]);
    let tip = beam.edge("x-max");
    let (last, off) =
        follow("end shear", &beam, &table("cantilever_end_shear"), LinearSolver::Direct, |state| {
            let mean =
                |c| tip.iter().map(|&n| state.displacement(&beam.model, n as usize)[c]).sum::<f64>() / 2.0;
            [-mean(0), mean(2)]
        });
    claim("end shear, U", (last[0] - 3.290).abs(), 0.01);
    claim("end shear, W", (last[1] - 6.704).abs(), 0.01);
    claim("end shear, all steps", off[0].max(off[1]), 0.005);
}

/// Rolled up to a circle by a moment at its end; exact.
#[test]
fn cantilever_rolled_up() {
    let sheet = Sheet::Plate { size: [12.0, 1.0] };
    let beam =
        Specimen::new(mesh(sheet, [16, 1], Pattern::Diagonal), [1.2e6, 0.0], 0.1, Formulation::default())
            .unwrap()
            .prescribe_edge("x-min", CLAMPED);
    let tip = beam.edge("x-max");
    let moment = [0.0, -50.0 * PI / 3.0 / 2.0, 0.0];
    let beam = beam.load(LoadKind::moment(tip.clone(), moment));
    let (last, off) =
        follow("roll-up", &beam, &table("cantilever_end_moment"), LinearSolver::Unsymmetric, |state| {
            let mean =
                |c| tip.iter().map(|&n| state.displacement(&beam.model, n as usize)[c]).sum::<f64>() / 2.0;
            [-mean(0), mean(2)]
        });
    claim("the circle closes", (last[0] - 12.0).abs().max(last[1].abs()), 1e-3);
    // 16 chords instead of arcs: 0.5 % of the largest displacement.
    claim("roll-up, all steps", off[0].max(off[1]), 0.005);
}

fn annulus(counts: [usize; 2]) -> ([f64; 2], [f64; 2]) {
    let sheet = Sheet::Annulus { inner: 6.0, outer: 10.0, span: TAU };
    let ring =
        Specimen::new(mesh(sheet, counts, Pattern::Diagonal), [21e6, 0.0], 0.03, Formulation::default())
            .unwrap()
            .prescribe_edge("end", CLAMPED)
            .pull_edge("start", [0.0, 0.0, 3.2]);
    let lifted = ring.edge("start");
    let (a, b) = (lifted[0] as usize, lifted[lifted.len() - 1] as usize);
    follow("slit annulus", &ring, &table("slit_annular_plate"), LinearSolver::Direct, |state| {
        [a, b].map(|node| state.displacement(&ring.model, node).z)
    })
}

/// 6 × 30 cells; the prototype's 13.840 and 17.478.
#[test]
fn slit_annulus_lifted_at_its_slit() {
    let (last, off) = annulus([6, 30]);
    claim("slit annulus, W_A", (last[0] / 13.840 - 1.0).abs(), 0.01);
    claim("slit annulus, W_B", (last[1] / 17.478 - 1.0).abs(), 0.01);
    claim("slit annulus, all steps", off[0].max(off[1]), 0.01);
}

/// 10 × 80 cells; the prototype's 13.860 and 17.498.
#[test]
#[ignore = "seconds"]
fn slit_annulus_on_a_fine_mesh() {
    let (last, off) = annulus([10, 80]);
    claim("slit annulus, W_A", (last[0] / 13.860 - 1.0).abs(), 0.005);
    claim("slit annulus, W_B", (last[1] / 17.498 - 1.0).abs(), 0.005);
    claim("slit annulus, all steps", off[0].max(off[1]), 0.005);
}

fn hemisphere(cells: usize, membrane: Membrane) -> ([f64; 2], [f64; 2]) {
    let sheet = Sheet::Hemisphere { radius: 10.0, hole: PI / 10.0, span: FRAC_PI_2 };
    let formulation = Formulation { membrane, ..Formulation::default() };
    let shell = Specimen::new(mesh(sheet, [cells; 2], Pattern::Diagonal), [6.825e7, 0.3], 0.04, formulation)
        .unwrap()
        .prescribe_edge("start", symmetry(1))
        .prescribe_edge("end", symmetry(0));
    let (a, b) = (shell.node(0.0, 10.0, 0.0), shell.node(10.0, 0.0, 0.0));
    let shell = shell
        .prescribe(vec![a], [false, false, true, false, false, false])
        .pull(a, [0.0, 200.0, 0.0])
        .pull(b, [-200.0, 0.0, 0.0]);
    follow("hemisphere", &shell, &table("hemisphere_18deg_hole"), LinearSolver::Direct, |state| {
        [state.displacement(&shell.model, a as usize).y, -state.displacement(&shell.model, b as usize).x]
    })
}

/// 8 × 8 cells; the prototype's 4.02 and 8.00 (reference 4.067 and 8.178).
#[test]
fn pinched_hemisphere_in_large_rotation() {
    let (last, _) = hemisphere(8, FLAT.membrane);
    claim("hemisphere, V_A", (last[0] - 4.018).abs(), 0.03);
    claim("hemisphere, U_B", (last[1] - 7.999).abs(), 0.03);
}

/// Curved membranes, whose strain is linear about rest: 4.067 and 8.178 to 5 % with 8 × 8 cells, where flat
/// ones come to 2.2 %.
#[test]
fn curved_hemisphere_in_large_rotation() {
    let (_, off) = hemisphere(8, Membrane::default());
    claim("curved hemisphere, all steps", off[0].max(off[1]), 0.05);
}

/// Tests the curved hemisphere with 16 × 16 cells.
#[test]
#[ignore = "seconds"]
fn curved_hemisphere_on_a_fine_mesh() {
    let (_, off) = hemisphere(16, Membrane::default());
    claim("curved hemisphere, fine, all steps", off[0].max(off[1]), 0.02);
}

/// 16 × 16 cells; the prototype's 4.058 and 8.107, with Felippa's drilling 3.849 and 7.389.
#[test]
#[ignore = "seconds"]
fn pinched_hemisphere_on_a_fine_mesh() {
    let (last, off) = hemisphere(16, FLAT.membrane);
    claim("hemisphere, V_A", (last[0] / 4.058 - 1.0).abs(), 0.005);
    claim("hemisphere, U_B", (last[1] / 8.107 - 1.0).abs(), 0.005);
    claim("hemisphere, all steps", off[0].max(off[1]), 0.01);
    let (last, _) = hemisphere(16, Membrane::Opt { adaptation: f64::INFINITY });
    claim("hemisphere with Felippa's drilling, V_A", (last[0] / 3.849 - 1.0).abs(), 0.01);
}

/// Load over its largest at the deflections of the table, by displacement control.
fn hinged_roof(cells: usize) -> Vec<[f64; 3]> {
    let sheet = Sheet::Cylinder { radius: 2540.0, length: 254.0, from: 0.0, span: 0.1 };
    let roof = Specimen::new(
        mesh(sheet, [cells; 2], Pattern::Diagonal),
        [3102.75, 0.3],
        12.7,
        Formulation::default(),
    )
    .unwrap()
    .prescribe_edge("z-min", symmetry(2))
    .prescribe_edge("start", symmetry(1))
    .prescribe_edge("end", [true, true, true, false, false, false]);
    let centre = roof.node(2540.0, 0.0, 0.0);
    let mut roof = roof.pull(centre, [-3000.0 / 4.0, 0.0, 0.0]);
    roof.model.model_mut().loads[0].controlled = true;
    let mut solver = Statics::new(roof.model.clone(), StaticSettings::default()).unwrap();
    let mut state = State::at_rest(&roof.model);
    state.time = 1.0;
    let mut curve = Vec::new();
    for row in table("hinged_roof_h12.7") {
        let by = -row[1] - state.displacement(&roof.model, centre as usize).x;
        let step = solver
            .control(&mut state, Control::Displacement { node: centre, component: 0, by }, 1.0)
            .unwrap();
        println!(
            "hinged roof at w = {:.3}: {:.4} ({:.4}); {} iterations, {} negative pivots",
            row[1],
            state.load_factor,
            row[0],
            step.residuals.len() - 1,
            step.negative_pivots
        );
        curve.push([row[1], state.load_factor, row[0]]);
    }
    curve
}

/// The first limit point, 0.7421 at 11.293, and the second, 0.1729 at 19.852. The prototype's 8 × 8 mesh:
/// 0.737 and 0.1737.
#[test]
fn hinged_roof_snaps_through() {
    let curve = hinged_roof(8);
    let at = |w: f64| curve.iter().find(|row| row[0] == w).unwrap()[1];
    claim("hinged roof, first limit load", (at(11.293) - 0.737).abs(), 0.01);
    claim("hinged roof, second limit load", (at(19.852) - 0.1737).abs(), 0.01);
    for (w, expected) in [(3.087, 0.352), (9.339, 0.7248), (17.657, 0.2250), (28.663, 0.980)] {
        claim(&format!("hinged roof at w = {w}"), (at(w) - expected).abs(), 0.01);
    }
}

/// At q = 0.01 linear theory holds: 0.126532 q. At q = 1 to 5 it would give deflections of 1.3 to 6.3
/// thicknesses, where the membrane carries most of the load; Table 8.1 of the thesis prints 0.1218 to 0.6374
/// there, which is linear theory.
#[test]
fn the_plate_of_the_thesis_is_no_linear_case() {
    let small = deflections(&[0.01]).unwrap()[0];
    claim("q = 0.01: w/(0.126532 q)", (small / (0.126532 * 0.01) - 1.0).abs(), 0.01);
    let large = deflections(&[1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
    for (w, expected) in large.iter().zip(LARGE) {
        println!("w = {w:.4}, expected {expected}");
        claim("thesis's plate", (w / expected - 1.0).abs(), 0.01);
    }
}
