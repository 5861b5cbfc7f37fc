//! Few curved shells for known shapes: how many, and how close they are, both ways. Organs from files are in
//! `validation`.

use std::f64::consts::TAU;
use std::time::Instant;

use pliant_geometry::{Mesh, Vector3};
use pliant_meshing::{
    DEFAULT_CELL_LIMIT, Ellipsoid, FittedShells, Organ, Pattern, Phantom, Sheet, ShellGoal, ShellReport,
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

fn fit(name: &str, target: &TriangleMesh, goal: ShellGoal) -> FittedShells {
    let start = Instant::now();
    let fitted = FittedShells::new(target, goal, &|_| {}).unwrap();
    println!("{name} {goal:?}: {:.1} s\n{}", start.elapsed().as_secs_f64(), fitted.report);
    fitted
}

/// Distance of a point from the rims of the cylinder, which are chains of 320 chords.
fn off_the_rim(x: &Vector3) -> f64 {
    let half = TAU / 640.0;
    let within = x.y.atan2(x.x).rem_euclid(2.0 * half) - half;
    (x.xy().norm() - half.cos() / within.cos()).abs().max(x.z.abs().min((x.z - 2.0).abs()))
}

fn rim(mesh: &Mesh) -> Vec<Vector3> {
    mesh.points.iter().filter(|x| x.z < 1e-3 || x.z > 2.0 - 1e-3).copied().collect()
}

/// The target's own facets are within h²/8R = 5e-5 of the cylinder (320 round), 0.0014 % of the diagonal. 12
/// shells: 0.25 %; 48: 0.02 %. Nodes of the rims stay on the rims of the target.
#[test]
fn an_open_cylinder_by_12_and_48_shells() {
    let fine = cylinder([320, 80]);
    for (counts, allowed) in [([6, 1], 0.25), ([12, 2], 0.02)] {
        let fitted = FittedShells::on(&fine, &cylinder(counts));
        println!("cylinder {}: {:?} %\n{}", fitted.report.shells, percent(&fitted.report), fitted.report);
        assert!(percent(&fitted.report).iter().all(|&off| off <= allowed), "{}", fitted.report);
        let rim = rim(&fitted.mesh);
        assert_eq!(rim.len(), 2 * counts[0]);
        assert!(rim.iter().all(|x| off_the_rim(x) < 1e-9));
    }
}

/// Halved, moved and fitted, nodes of the rims stay there too.
#[test]
fn nodes_of_a_rim_stay_on_it() {
    let fitted = fit("cylinder", &cylinder([320, 80]), ShellGoal::Error(0.002));
    assert!(fitted.report.reached, "{}", fitted.report);
    let rim = rim(&fitted.mesh);
    assert!(rim.len() >= 12 && rim.iter().all(|x| off_the_rim(x) < 1e-9));
}

/// The target's facets of 0.02 are within 5e-5 of the sphere, 0.0015 % of the diagonal.
#[test]
fn a_sphere_by_80_shells() {
    let fitted = FittedShells::on(&ball(6), &ball(1));
    let [there, back] = percent(&fitted.report);
    println!("sphere {}: {there} {back} %\n{}", fitted.report.shells, fitted.report);
    assert!(there <= 0.05 && back <= 0.1, "{}", fitted.report);
}

/// The phantom liver on a grid of 4 mm: 400 shells for 0.6 %, 700 for 0.35 % of the diagonal, as of its image
/// in `validation`.
#[test]
fn the_phantom_liver() {
    let liver = Phantom::new(Organ::Liver, 1.0).unwrap();
    let fine = TriangleMesh::of_field(&liver, 0.004, DEFAULT_CELL_LIMIT).unwrap();
    for (error, most) in [(0.006, 400), (0.0035, 700)] {
        let report = fit("phantom liver", &fine, ShellGoal::Error(error)).report;
        assert!(report.reached && percent(&report).iter().all(|&off| off <= 100.0 * error), "{report}");
        assert!(report.shells <= most && report.shape[0] >= 0.6, "{report}");
    }
}

/// The number of threads changes no bit.
#[test]
fn shells_are_the_same_on_any_number_of_threads() {
    let body = Ellipsoid { centre: Vector3::zeros(), radii: Vector3::new(0.03, 0.02, 0.01) };
    let fine = TriangleMesh::of_field(&body, 0.002, DEFAULT_CELL_LIMIT).unwrap();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| FittedShells::new(&fine, ShellGoal::Error(0.002), &|_| {}).unwrap().mesh)
    };
    assert_eq!(on(1), on(3));
}
