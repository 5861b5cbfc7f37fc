//! Organs by few curved shells, and the distances both ways: the meshing specification's S3 and the thesis's
//! Figs 9.1 to 9.3. Organs from files are read through `PLIANT_DATA`; without it those tests print a notice
//! and pass.

use std::path::PathBuf;
use std::time::Instant;

use pliant_geometry::io;
use pliant_imaging::{Cleaning, Smoothing};
use pliant_meshing::{Anatomy, DEFAULT_CELL_LIMIT, Fewer, FittedShells, ShellGoal, TriangleMesh};
use pliant_testing::organs;

fn organ(path: &str) -> Option<TriangleMesh> {
    let Some(data) = std::env::var_os("PLIANT_DATA") else {
        println!("skipped: PLIANT_DATA is not set");
        return None;
    };
    let file = io::read(&PathBuf::from(data).join(path)).unwrap();
    Some(TriangleMesh::from_mesh(&file.mesh).unwrap().0)
}

/// Asserts limits of the largest distances both ways, in percent of the diagonal, and of the number of
/// shells.
fn require(name: &str, target: &TriangleMesh, goal: ShellGoal, percent: f64, shells: usize) {
    let start = Instant::now();
    let report = FittedShells::new(target, goal, &|_| {}).unwrap().report;
    println!(
        "{name} ({} triangles), {goal:?}: {:.1} s\n{report}",
        target.len(),
        start.elapsed().as_secs_f64()
    );
    assert!(report.reached && report.shells <= shells, "{report}");
    assert!(100.0 * report.distances.largest() <= percent * report.diagonal, "{report}");
}

fn two_errors(name: &str, target: &TriangleMesh) {
    require(name, target, ShellGoal::Error(0.006), 0.6, 400);
    require(name, target, ShellGoal::Error(0.0035), 0.35, 640);
}

/// The label image of the analytic organ, its surface as `pliant mesh IMAGE --as shells` makes it.
#[test]
#[ignore = "slow: half a minute"]
fn the_phantom_liver_of_its_image() {
    let cleaning = Cleaning { keep_largest: true, ..Cleaning::default() };
    let (anatomy, _) =
        Anatomy::from_image(&organs::liver(), &[1], &cleaning, &Smoothing::default(), &|_| {}).unwrap();
    let surface = TriangleMesh::of_field(anatomy.field(), 0.205 / 128.0, DEFAULT_CELL_LIMIT).unwrap();
    two_errors("phantom liver", &surface);
}

/// The liver of SOFA's demonstrations.
#[test]
#[ignore = "slow: ten seconds"]
fn the_liver_of_sofa() {
    let Some(surface) = organ("liver-sofa/liver-smooth.obj") else { return };
    two_errors("liver-smooth", &surface);
}

/// The thesis used 772 shells.
#[test]
#[ignore = "slow: ten seconds"]
fn the_aneurysm_by_772_shells() {
    let Some(surface) = organ("aneurysm-sofa/aneurysm3D_1.off") else { return };
    require("aneurysm", &surface, ShellGoal::Shells(772), 0.5, 772);
}

/// Glisson's capsule of a whole liver.
#[test]
#[ignore = "slow: half a minute"]
fn the_capsule_of_a_liver_by_1200_shells() {
    let Some(mut surface) = organ("organs-openhelp/Liver.stl") else { return };
    surface.decimate(Fewer::Triangles(8000)).unwrap();
    require("capsule", &surface, ShellGoal::Shells(1200), 0.2, 1200);
}
