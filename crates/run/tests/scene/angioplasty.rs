//! `scenes/angioplasty`: a folded balloon widens a stenosis and is emptied again.

use std::path::Path;

use nalgebra::Vector3;
use pliant_format::Scene;
use pliant_format::source::Source;
use pliant_scene::World;

/// Pressure [Pa] in the balloon.
fn pressure(time: f64) -> f64 {
    let part = if time < 1.0 { time } else { (1.0 - (time - 1.2) / 0.6).clamp(0.0, 1.0) };
    1.2e5 * part
}

/// The lumen grows as long as the balloon is filled, and comes back when it is emptied. Softer deposits give
/// way more. The deposit and the balloon's tension balance the balloon's pressure. No edge goes through a
/// triangle: the scene ends a run where one does.
#[test]
#[ignore = "five minutes"]
fn a_folded_balloon_widens_a_stenosis_and_leaves_it() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/angioplasty");
    let text = std::fs::read_to_string(folder.join("scene.toml")).unwrap();
    let mut widest = Vec::new();
    for young in ["5e4", "1e5", "2e5", "5e5"] {
        let text = text.replace("young-modulus = 2e5 ", &format!("young-modulus = {young} "));
        let source = Source::parse("scene.toml", text).unwrap();
        let scene = Scene::from_source(source, folder.clone()).unwrap_or_else(|e| panic!("{}", e.plain()));
        let world = World::new(&scene).unwrap_or_else(|e| panic!("{}", e.plain()));
        let places = |body: usize| world.participants[0].built.bodies[body].mesh.points.clone();
        let (vessel, balloon) = (places(0), places(1));
        let radius = |p: &Vector3<f64>| p.x.hypot(p.y);
        let mut throat: Vec<usize> =
            (0..vessel.len()).filter(|&n| vessel[n].z == 0.0 && radius(&vessel[n]) < 0.751e-3).collect();
        throat.sort_by(|&a, &b| vessel[a].y.total_cmp(&vessel[b].y));
        let mut edge: Vec<usize> = (0..balloon.len()).filter(|&n| balloon[n].x == 0.0).collect();
        edge.sort_by(|&a, &b| balloon[a].z.total_cmp(&balloon[b].z));
        let (mut areas, mut worst) = (Vec::new(), 0.0_f64);
        let mut simulation = world.simulation().unwrap();
        let run = simulation.run(2.0, |frame| {
            let moved = |body: &str, rest: &[Vector3<f64>], nodes: &[usize]| -> Vec<Vector3<f64>> {
                let displacements = frame.displacements(body).unwrap();
                nodes.iter().map(|&n| rest[n] + Vector3::from(displacements[n])).collect()
            };
            let ring = moved("deposit", &vessel, &throat);
            let half = |pair: &[Vector3<f64>]| pair[0].x * pair[1].y - pair[0].y * pair[1].x;
            let area = 4.0 * 0.5 * ring.windows(2).map(half).sum::<f64>();
            // All that the pressure does along x it does to the plane x = 0.
            let line = moved("balloon", &balloon, &edge);
            let shadow: f64 =
                line.windows(2).map(|pair| 0.5 * (pair[0].y + pair[1].y) * (pair[1].z - pair[0].z)).sum();
            let pushed = pressure(frame.time()) * shadow;
            let held = frame.contact_force("lumen").unwrap()[0] - frame.reaction("balloon-x").unwrap()[0];
            if pushed > 0.05 {
                worst = worst.max((held / pushed - 1.0).abs());
            }
            areas.push((frame.time(), area));
        });
        run.unwrap_or_else(|failure| panic!("{}", failure.message));
        let most = areas.iter().map(|sample| sample.1).fold(0.0, f64::max);
        let last = areas[areas.len() - 1].1 / areas[0].1;
        println!(
            "{young} Pa: lumen {:.3} to {:.3} mm², {last:.6} of it after; forces off balance by {:.2} %",
            1e6 * areas[0].1,
            1e6 * most,
            100.0 * worst
        );
        let filled: Vec<f64> = areas.iter().filter(|sample| sample.0 < 1.0).map(|sample| sample.1).collect();
        assert!(filled.windows(2).all(|pair| pair[1] > pair[0] * (1.0 - 1e-9)));
        assert!((last - 1.0).abs() < 1e-3 && worst < 0.03, "{last} {worst}");
        widest.push(most);
    }
    assert!(widest.windows(2).all(|pair| pair[1] < pair[0]), "{widest:?}");
}
