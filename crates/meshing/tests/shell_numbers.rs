//! Few curved shells for known shapes and organs: how close they are, both ways.
//! Organs are read through `PLIANT_DATA`; without it those tests print a notice and pass.

use std::f64::consts::TAU;
use std::path::PathBuf;
use std::time::Instant;

use pliant_geometry::io;
use pliant_meshing::{
    DEFAULT_CELL_LIMIT, Fewer, FittedShells, Organ, Pattern, Phantom, Sheet, ShellGoal, ShellReport,
    TriangleMesh, sphere,
};

fn cylinder(counts: [usize; 2]) -> TriangleMesh {
    let sheet = Sheet::Cylinder { radius: 1.0, length: 2.0, from: 0.0, span: TAU };
    TriangleMesh::from_mesh(&sheet.mesh(counts, Pattern::default(), None, DEFAULT_CELL_LIMIT).unwrap())
        .unwrap()
        .0
}

fn ball(levels: u32) -> TriangleMesh {
    TriangleMesh::from_mesh(&sphere(1.0, levels, DEFAULT_CELL_LIMIT).unwrap()).unwrap().0
}

/// Largest distances there and back in percent of the diagonal.
fn percent(report: &ShellReport) -> [f64; 2] {
    [report.distances.largest_forward, report.distances.largest_backward].map(|x| 100.0 * x / report.diagonal)
}

/// The target's own facets are within h²/8R = 2e-4 of the cylinder (157 round), 0.005 % of the diagonal. 12 shells: 0.25 %; 48: 0.02 %.
#[test]
fn an_open_cylinder_by_12_and_48_shells() {
    let fine = cylinder([320, 80]);
    for (counts, allowed) in [([6, 1], 0.25), ([12, 2], 0.02)] {
        let fitted = FittedShells::on(&fine, &cylinder(counts));
        println!("cylinder {}: {:?} %\n{}", fitted.report.shells, percent(&fitted.report), fitted.report);
        assert!(percent(&fitted.report).iter().all(|&off| off <= allowed), "{}", fitted.report);
    }
}

/// The target's facets of 0.02 are within 5e-5 of the sphere, 0.0015 % of the diagonal.
#[test]
fn a_sphere_by_80_shells() {
    let fitted = FittedShells::on(&ball(6), &ball(1));
    let [there, back] = percent(&fitted.report);
    println!("sphere {}: {there} {back} %\n{}", fitted.report.shells, fitted.report);
    assert!(there <= 0.05 && back <= 0.1, "{}", fitted.report);
}

fn organ(path: &str) -> Option<TriangleMesh> {
    let Some(data) = std::env::var_os("PLIANT_DATA") else {
        println!("skipped: PLIANT_DATA names no folder of organs");
        return None;
    };
    let file = io::read(&PathBuf::from(data).join(path)).unwrap();
    let (mesh, repairs) = TriangleMesh::from_mesh(&file.mesh).unwrap();
    println!("{path}: {} triangles, mended: {repairs}", mesh.len());
    Some(mesh)
}

fn told(name: &str, target: &TriangleMesh, goal: ShellGoal) -> ShellReport {
    let start = Instant::now();
    let fitted = FittedShells::new(target, goal, &|_| {}).unwrap();
    println!("{name} {goal:?}: {:.1} s\n{}", start.elapsed().as_secs_f64(), fitted.report);
    fitted.report
}

fn require(report: &ShellReport, shells: usize, percent_off: f64) {
    assert!(report.shells <= shells && report.shape[0] >= 0.6, "{report}");
    assert!(percent(report).iter().all(|&off| off <= percent_off), "{report}");
}

/// The liver phantom on a grid of 2.5 mm.
#[test]
#[ignore = "minutes; not yet reached"]
fn the_phantom_liver() {
    let liver = Phantom::new(Organ::Liver, 1.0).unwrap();
    let fine = TriangleMesh::of_field(&liver, 0.0025, DEFAULT_CELL_LIMIT).unwrap();
    let reports = [(0.006, 400, 0.6), (0.0035, 700, 0.35)]
        .map(|(error, most, off)| (told("phantom liver", &fine, ShellGoal::Error(error)), most, off));
    for (report, most, off) in reports {
        require(&report, most, off);
    }
}

#[test]
#[ignore = "minutes; missed: 708 shells for 0.63 %, 858 for 0.53 %"]
fn the_liver_of_sofa() {
    let Some(fine) = organ("liver-sofa/liver-smooth.obj") else { return };
    let reports = [(0.006, 400, 0.6), (0.0035, 700, 0.35)]
        .map(|(error, most, off)| (told("liver-smooth", &fine, ShellGoal::Error(error)), most, off));
    for (report, most, off) in reports {
        require(&report, most, off);
    }
}

/// The thesis used 772 shells.
#[test]
#[ignore = "a minute"]
fn the_aneurysm_by_772_shells() {
    let Some(fine) = organ("aneurysm-sofa/aneurysm3D_1.off") else { return };
    require(&told("aneurysm", &fine, ShellGoal::Shells(772)), 772, 0.5);
}

#[test]
#[ignore = "a minute; missed: 1.9 % by 1168 shells"]
fn the_capsule_of_a_liver_by_1200_shells() {
    let Some(mut fine) = organ("organs-openhelp/Liver.stl") else { return };
    fine.decimate(Fewer::Triangles(8000)).unwrap();
    require(&told("capsule", &fine, ShellGoal::Shells(1200)), 1200, 0.2);
}
