//! Tests of the ends of fits and of second fits, on synthetic surfaces.

use super::*;
use crate::{DEFAULT_CELL_LIMIT, Ellipsoid, ImplicitField, sphere};

/// Two balls that share a lens whose faces meet at 52°, within ± 17 mm.
struct Lens;

impl ImplicitField for Lens {
    fn value(&self, x: &Vector3) -> f64 {
        let ball = |z: f64| 0.03 - (x - Vector3::new(0.0, 0.0, z)).norm();
        ball(0.027).min(ball(-0.027))
    }

    fn bounds(&self) -> (Vector3, Vector3) {
        (Vector3::repeat(-0.017), Vector3::repeat(0.017))
    }
}

/// A sheet 2 mm thick folded into five leaves with 1 mm between them, 16 mm deep and 14 mm high.
struct Folds;

impl ImplicitField for Folds {
    fn value(&self, x: &Vector3) -> f64 {
        let half = 0.008;
        let box_of = |x: &Vector3, half: [f64; 3]| {
            let off = x.abs() - Vector3::from(half);
            -(off.sup(&Vector3::zeros()).norm() + off.max().min(0.0))
        };
        let mut inside = box_of(x, [half, 0.004, 0.007]);
        for k in 0..4 {
            // Gaps open to the left and to the right in turn.
            let side = if k % 2 == 0 { 0.003 } else { -0.003 };
            let gap = x - Vector3::new(side, 0.0, -0.0045 + 0.003 * f64::from(k));
            inside = inside.min(-box_of(&gap, [half, 0.02, 0.0005]));
        }
        inside
    }

    fn bounds(&self) -> (Vector3, Vector3) {
        (Vector3::new(-0.01, -0.006, -0.009), Vector3::new(0.01, 0.006, 0.009))
    }
}

fn surface(field: &dyn ImplicitField, edge: f64) -> TriangleMesh {
    TriangleMesh::of_field(field, edge, DEFAULT_CELL_LIMIT).unwrap()
}

/// Returns the shells that a limited amount of work finds, and the rounds that were reported. Collapses are
/// checked for crossings from `uncrossed` triangles down.
fn found(mesh: &TriangleMesh, goal: ShellGoal, most: usize, uncrossed: usize) -> (FittedShells, usize) {
    let rounds = std::cell::Cell::new(0);
    let on_progress = |progress: FitProgress| {
        assert!((0.0..=1.0).contains(&progress.part), "{progress:?}");
        rounds.set(rounds.get() + 1);
    };
    (FittedShells::within(mesh, goal, Effort::new(most), uncrossed, &on_progress), rounds.get())
}

/// A ball with a cavity, whose wall of 0.05 is thinner than the error of few flat triangles. Decimated
/// without a check for crossings, they cross, so the fit is repeated with that check.
#[test]
fn shells_whose_triangles_cross_are_fitted_again_from_some_that_never_did() {
    let mut ball = sphere(1.0, 3, DEFAULT_CELL_LIMIT).unwrap();
    let cavity = sphere(0.95, 3, DEFAULT_CELL_LIMIT).unwrap();
    let first = ball.points.len() as u32;
    ball.points.extend(&cavity.points);
    for block in &cavity.blocks {
        // Looks the other way.
        let turned = block.nodes.chunks_exact(3).flat_map(|t| [t[0], t[2], t[1]]).map(|node| first + node);
        ball.block_mut(block.kind).nodes.extend(turned);
    }
    let (mesh, _) = TriangleMesh::from_mesh(&ball).unwrap();
    let goal = ShellGoal::Shells(120);
    let target = Target::new(&mesh);
    let crossing = |uncrossed: usize| {
        let start = Starts::new(&mesh, goal, &target, uncrossed).first;
        let (points, triangles) = start.compact();
        crate::surface::crossings::crossings(&points, &triangles).0.len()
    };
    assert!(crossing(60) > 0);
    assert_eq!(crossing(usize::MAX), 0);
    let (fitted, _) = found(&mesh, goal, 1_000_000, 60);
    println!("{}", fitted.report);
    assert_eq!(fitted.report.crossings, Flaw::default());
    assert!(fitted.report.reached);
}

/// Leaves 2 mm thick with 1 mm between them, by shells of about 3 mm.
#[test]
fn shells_of_a_deeply_folded_sheet_do_not_cross() {
    let mesh = surface(&Folds, 0.0009);
    let (fitted, _) = found(&mesh, ShellGoal::Shells(200), 1_000_000, 2000);
    println!("{} triangles\n{}", mesh.len(), fitted.report);
    assert_eq!(fitted.report.crossings, Flaw::default());
    assert!(fitted.report.reached && fitted.report.shells + 1 >= 200);
    let flat = fitted.mesh.blocks[0].data.get("flat").map_or(0.0, |flat| flat.values.iter().sum());
    assert_eq!(fitted.report.flattened.count as f64, flat);
}

/// At a rim of 52° no normal is within 60° of both faces; all nodes without one are there.
#[test]
fn nodes_of_a_sharp_rim_have_no_normal() {
    let (fitted, _) = found(&surface(&Lens, 0.0015), ShellGoal::Shells(150), 1_000_000, UNCROSSED);
    println!("{}", fitted.report);
    let normals = &fitted.mesh.point_data["normal"];
    let without = |node: &usize| normals.item(*node).iter().all(|&x| x == 0.0);
    let nodes: Vec<usize> = (0..fitted.mesh.points.len()).filter(without).collect();
    assert!(!nodes.is_empty() && nodes.len() == fitted.report.creases.count, "{}", fitted.report);
    // √(30² − 27²) mm.
    let rim = 900e-6_f64 - 729e-6;
    for node in nodes {
        let x = fitted.mesh.points[node];
        assert!((x.xy().norm() - rim.sqrt()).abs() < 0.0015 && x.z.abs() < 0.0015, "{x}");
    }
    assert!(fitted.report.warnings().iter().any(|warning| warning.contains("without a normal")));
    assert_eq!(fitted.report.crossings, Flaw::default());
}

/// A thousandth of a percent is out of reach with a small amount of work. The fit stops, and reports how
/// close it is, and where.
#[test]
fn a_fit_that_cannot_reach_its_goal_ends_with_the_best_so_far() {
    let mesh = surface(&Ellipsoid::sphere(Vector3::zeros(), 0.02), 0.003);
    let goal = ShellGoal::Error(1e-5);
    let (few, short) = found(&mesh, goal, 50_000, UNCROSSED);
    let (more, long) = found(&mesh, goal, 500_000, UNCROSSED);
    for report in [&few.report, &more.report] {
        println!("{report}");
        let off = report.distances.largest() / report.diagonal;
        assert!(report.stopped && !report.reached && off > 1e-5);
        let [x, y, z] = report.farthest.map(|x| 1e3 * x);
        let beginning = format!("not reached: 0.001 % requested, at best {:.3} % reached (", 100.0 * off);
        assert!(report.warnings()[0].starts_with(&beginning), "{report}");
        assert!(
            report.warnings()[0]
                .contains(&format!("({x:.1}, {y:.1}, {z:.1}) mm. The fit ended at its limit of work"))
        );
    }
    assert!(short < long && more.report.distances.largest() < few.report.distances.largest());
}

/// The work does not grow with the triangles of the target: four times as many need as many rounds and
/// searches.
#[test]
fn the_work_of_a_fit_does_not_grow_with_the_triangles_of_the_target() {
    let spent = |levels: u32| {
        let (mesh, _) = TriangleMesh::from_mesh(&sphere(1.0, levels, DEFAULT_CELL_LIMIT).unwrap()).unwrap();
        let target = Target::new(&mesh);
        let goal = ShellGoal::Error(0.001);
        let first = Starts::new(&mesh, goal, &target, UNCROSSED).first;
        let fit = Fit::new(&target, &first, goal, Effort::new(usize::MAX / 2), true);
        let (found, effort) = fit.run(&|_| {});
        assert!(found.fitted.report.reached);
        effort.part() * (usize::MAX / 2) as f64
    };
    let [coarse, fine] = [4, 5].map(spent);
    println!("{coarse:.0} and {fine:.0} searches");
    assert!(fine < 1.5 * coarse, "{coarse} {fine}");
}
