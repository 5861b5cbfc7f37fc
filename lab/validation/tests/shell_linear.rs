//! Plates and shells by linear theory: Timoshenko's plates, Cook's membrane, and the obstacle course of
//! MacNeal and Harder (1985) and Belytschko et al. (1985). Each number is the displacement over the reference
//! of the literature; the expected ones are those that a prototype of the same formulas found
//! (`data/shell/`).

use pliant_geometry::Mesh;
use pliant_mechanics::load::{LoadKind, Spread};
use pliant_meshing::{DEFAULT_CELL_LIMIT, Distortion, Pattern, Sheet};
use pliant_reproduce::CaseError;
use pliant_reproduce::cases::obstacle_course::{self as course, CantileverCells};
use pliant_reproduce::cases::plate::{self, RIGIDITY, SIDE};
use pliant_shells::element::{Bending, Formulation, Membrane};
use pliant_validation::claim;
use pliant_validation::shells::{CLAMPED, FLAT, renumbered};

/// Prints a ratio and the expected ratio, and asserts that they agree within a tolerance.
fn expect(what: &str, ratio: f64, expected: f64, tolerance: f64) {
    println!("{what}: {ratio:.4}, expected {expected:.3}");
    claim(what, (ratio - expected).abs(), tolerance);
}

/// Centre deflection of the thesis's clamped plate under uniform load over Timoshenko's 0.00126532 q L⁴/D.
fn clamped_plate(mesh: Mesh, formulation: Formulation) -> f64 {
    plate::clamped(mesh, formulation).unwrap()
}

fn plate_mesh(cells: usize, pattern: Pattern, distortion: Option<Distortion>) -> Mesh {
    Sheet::Plate { size: [SIDE; 2] }.mesh([cells; 2], pattern, distortion, DEFAULT_CELL_LIMIT).unwrap()
}

#[test]
fn timoshenko_clamped_plate() {
    let rows = [
        (Pattern::Diagonal, [1.030, 1.008, 1.002]),
        (Pattern::UnionJack, [1.026, 1.007, 1.002]),
        (Pattern::Crossed, [1.013, 1.004, 1.001]),
    ];
    for (pattern, expected) in rows {
        for (cells, expected) in [8, 16, 32].into_iter().zip(expected) {
            let ratio = clamped_plate(plate_mesh(cells, pattern, None), Formulation::default());
            expect(&format!("clamped plate, {pattern:?}, N = {cells}"), ratio, expected, 0.002);
        }
    }
}

/// Tests a plate whose inner nodes are moved at random by up to 0.3 of a cell. With the centre node in its
/// place, the result is within 1 % of the regular mesh (1.030, 1.008, 1.002). The prototype moved the centre
/// node too and took its deflection: 1.017, 1.007, 1.002. This is lower, as the plate is lowest at another
/// place. It depends on the random numbers: here 1.016 to 1.036 at N = 8.
#[test]
fn clamped_plate_of_distorted_cells() {
    for (cells, regular) in [(8, 1.030), (16, 1.008), (32, 1.002)] {
        for seed in 1..=12 {
            let moved = plate_mesh(cells, Pattern::Diagonal, Some(Distortion { amount: 0.3, seed }));
            let mut mesh = moved.clone();
            let middle = (cells / 2) * (cells + 1) + cells / 2;
            mesh.points[middle] = [0.5 * SIDE, 0.5 * SIDE, 0.0].into();
            let ratio = clamped_plate(mesh, Formulation::default());
            expect(&format!("clamped plate, distorted, N = {cells}, seed {seed}"), ratio, regular, 0.01);
            let ratio = clamped_plate(moved, Formulation::default());
            match cells {
                16 => expect("with its centre node moved too", ratio, 1.007, 0.005),
                32 => expect("with its centre node moved too", ratio, 1.002, 0.005),
                _ => println!("with its centre node moved too: {ratio:.4}"),
            }
        }
    }
}

/// The numbering of nodes and the first corners of triangles change only round-off.
#[test]
fn numbering_changes_no_deflection() {
    let mesh = plate_mesh(16, Pattern::Diagonal, Some(Distortion { amount: 0.2, seed: 3 }));
    let deflection = clamped_plate(mesh.clone(), Formulation::default());
    for seed in 1..=5 {
        let other = clamped_plate(renumbered(&mesh, seed).0, Formulation::default());
        claim("clamped plate, renumbered", (other / deflection - 1.0).abs(), 1e-10);
    }
    let comas = Formulation { bending: Bending::Comas2010, ..Formulation::default() };
    let deflection = clamped_plate(mesh.clone(), comas);
    let other = clamped_plate(renumbered(&mesh, 1).0, comas);
    println!("the element of Comas: {deflection:.3}, renumbered {other:.3}");
    assert!((other / deflection - 1.0).abs() > 1e-3, "{deflection} {other}");
}

/// Compares uniform pressure on the curved surface (Jᵀ) with a third to each corner, on clamped and simply
/// supported plates (0.00406235 q L⁴/D). They are equally good on clamped plates, and have errors of opposite
/// sign on supported plates.
#[test]
fn timoshenko_plates_under_pressure() {
    let rows = [
        (CLAMPED, 0.00126532, Spread::Lumped, [1.030, 1.008]),
        (CLAMPED, 0.00126532, Spread::Curved, [1.030, 1.008]),
        ([true, true, true, false, false, true], 0.00406235, Spread::Lumped, [0.990, 0.998]),
        ([true, true, true, false, false, true], 0.00406235, Spread::Curved, [1.013, 1.003]),
    ];
    for (held, reference, spread, expected) in rows {
        for (cells, expected) in [8, 16].into_iter().zip(expected) {
            let mesh = plate_mesh(cells, Pattern::Diagonal, None);
            let plate = plate::held(mesh, Formulation::default(), held).unwrap();
            let facets = (0..plate.model.facets.len() as u32).collect();
            let plate = plate.load(LoadKind::ShellPressure { facets, pressure: 1.0, spread });
            let centre = plate.node(0.5 * SIDE, 0.5 * SIDE, 0.0);
            let ratio = plate.linear(centre).unwrap()[2] * RIGIDITY / (reference * SIDE.powi(4));
            expect(&format!("plate under pressure, {spread:?}, N = {cells}"), ratio, expected, 0.002);
        }
    }
}

/// The thesis's element converges to a plate 22 % too soft on a structured mesh with diagonals one way.
#[test]
fn the_element_of_comas_converges_to_a_wrong_plate() {
    let comas = Formulation { bending: Bending::Comas2010, ..Formulation::default() };
    for (cells, expected) in [(8, 1.207), (16, 1.224), (32, 1.233)] {
        let ratio = clamped_plate(plate_mesh(cells, Pattern::Diagonal, None), comas);
        expect(&format!("clamped plate, Comas 2010, N = {cells}"), ratio, expected, 0.002);
    }
}

#[test]
fn scordelis_lo_roof() {
    for (cells, expected) in [(4, 1.117), (8, 1.021), (16, 0.999), (32, 0.995)] {
        expect(
            &format!("Scordelis-Lo, N = {cells}"),
            course::scordelis_lo(cells, FLAT).unwrap(),
            expected,
            0.005,
        );
    }
}

#[test]
fn pinched_cylinder_with_diaphragms() {
    for (cells, expected) in [(4, 0.724), (8, 0.973), (16, 1.023), (32, 1.012)] {
        expect(
            &format!("pinched cylinder, N = {cells}"),
            course::pinched_cylinder(cells, FLAT).unwrap(),
            expected,
            0.01,
        );
    }
}

#[test]
fn pinched_hemisphere() {
    for (cells, expected) in [(4, 0.680), (8, 0.961), (16, 0.992), (32, 0.994)] {
        let ratio = course::hemisphere(cells, FLAT).unwrap();
        expect(&format!("hemisphere, N = {cells}"), ratio, expected, 0.005);
    }
    let membrane = Membrane::Opt { adaptation: f64::INFINITY };
    let felippa = course::hemisphere(8, Formulation { membrane, ..Formulation::default() }).unwrap();
    expect("hemisphere with Felippa's drilling, N = 8: it locks", felippa, 0.504, 0.005);
}

/// Cook's tapered membrane.
#[test]
fn cook_membrane() {
    for (cells, expected) in [(4, 0.923), (8, 0.951), (16, 0.979), (32, 0.992)] {
        let ratio = course::cook(cells, FLAT).unwrap();
        expect(&format!("Cook, N = {cells}"), ratio, expected, 0.005);
    }
}

/// MacNeal and Harder's slender beam of 6 × 1 cells, square, trapezoidal and parallelogram, in the plane and
/// out of the plane.
#[test]
fn straight_cantilever() {
    let rows = [
        (CantileverCells::Rectangles, [1.0517, 0.9771]),
        (CantileverCells::Trapezoids, [0.4898, 0.9787]),
        (CantileverCells::Parallelograms, [0.5331, 0.9725]),
    ];
    for (cells, expected) in rows {
        let ratios = course::cantilever(cells, FLAT).unwrap();
        for (ratio, expected) in ratios.into_iter().zip(expected) {
            expect(&format!("cantilever of {cells:?}"), ratio, expected, 0.01 * expected);
        }
    }
}

/// MacNeal and Harder's twisted beam, thick and thin, in the plane and out of the plane.
#[test]
fn twisted_beam() {
    let rows = [
        (false, [[0.994, 1.000], [0.995, 0.998], [0.995, 0.998]]),
        (true, [[0.9946, 0.996], [0.9981, 0.998], [0.9987, 0.999]]),
    ];
    for (thin, expected) in rows {
        for (across, expected) in [2, 4, 8].into_iter().zip(expected) {
            let ratios = course::twisted_beam(thin, across, FLAT).unwrap();
            for (ratio, expected) in ratios.into_iter().zip(expected) {
                expect(
                    &format!("twisted beam, thin: {thin}, N = {across}"),
                    ratio,
                    expected,
                    0.01 * expected,
                );
            }
        }
    }
}

/// The obstacle course with the curved membrane, which is the flat one on plates. The prototype gives 1.016
/// and 0.998 for Scordelis-Lo at N = 8 and 16. For the hemisphere at 4, 8 and 16 it gives 0.870, 0.961 and
/// 0.987, on another mesh. There the flat membrane differs by 0.005, too.
#[test]
fn the_obstacle_course_with_curved_membranes() {
    type Problem = fn(usize, Formulation) -> Result<f64, CaseError>;
    type Rows = &'static [(usize, f64, f64)];
    let problems: [(&str, Problem, Rows); 4] = [
        ("Scordelis-Lo", course::scordelis_lo, &[(8, 1.016, 0.005), (16, 0.998, 0.005), (32, 0.995, 0.005)]),
        ("hemisphere", course::hemisphere, &[(4, 0.870, 0.02), (8, 0.961, 0.01), (16, 0.987, 0.005)]),
        // The literature: the wall is stiffer on most meshes, softer with these diagonals.
        ("pinched cylinder", course::pinched_cylinder, &[(8, 1.0, 0.07), (16, 1.0, 0.04), (32, 1.0, 0.02)]),
        ("Cook", course::cook, &[(8, 0.951, 0.005), (16, 0.979, 0.005)]),
    ];
    for (name, problem, rows) in problems {
        for &(cells, expected, tolerance) in rows {
            let found = problem(cells, Formulation::default()).unwrap();
            expect(&format!("{name}, curved, N = {cells}"), found, expected, tolerance);
        }
    }
    for thin in [false, true] {
        for ratio in course::twisted_beam(thin, 4, Formulation::default()).unwrap() {
            expect(&format!("twisted beam, curved, thin: {thin}"), ratio, 1.0, 0.015);
        }
    }
}
