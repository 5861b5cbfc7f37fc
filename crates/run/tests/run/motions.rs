//! Motions that a scene prescribes, and velocities at its start.

use pliant_testing::scenes::{BLOCK, CORNERS, FROM_FILE, TETS, Workshop, changed, vtk};

use crate::support::assert_close;

/// The displacement along z of the top of [`BLOCK`] over time, with this motion.
fn motion(motion: &str) -> Vec<(f64, f64)> {
    let scene = changed(BLOCK, "by = [0, 0, 0.001]\ncurve = \"smooth-step\"", motion);
    let probe = "probes.top = { on = \"block\", at = [0.05, 0.05, 0.1] }";
    let workshop = Workshop::new(&(scene + probe + "\n"));
    workshop.run(&["run.step=1e-3"]).done();
    let (header, rows) = workshop.table("out/case/history.csv");
    let column = header.iter().position(|name| name == "probe.top.displacement.z").unwrap();
    rows.iter().map(|row| (row[0], row[column])).collect()
}

#[test]
fn every_curve_leads_the_motion() {
    let smooth = |s: f64| s * s * (3.0 - 2.0 * s);
    let polynomial = |s: f64| s * s * s * (10.0 + s * (6.0 * s - 15.0));
    let part = |t: f64, from: f64, to: f64| ((t - from) / (to - from)).clamp(0.0, 1.0);
    type Expected<'a> = Box<dyn Fn(f64) -> f64 + 'a>;
    let cases: [(&str, Expected<'_>); 10] = [
        ("by = [0, 0, 1e-3]", Box::new(|t| 1e-3 * smooth(t / 0.02))),
        ("by = [0, 0, 1e-3]\ncurve = \"ramp\"\nto = 0.01", Box::new(|t| 1e-3 * part(t, 0.0, 0.01))),
        (
            "by = [0, 0, 1e-3]\ncurve = \"smooth-step\"\nfrom = 0.004\nto = 0.012",
            Box::new(|t| 1e-3 * smooth(part(t, 0.004, 0.012))),
        ),
        ("by = [0, 0, 1e-3]\ncurve = \"polynomial-10-15-6\"", Box::new(|t| 1e-3 * polynomial(t / 0.02))),
        (
            "by = [0, 0, 1e-3]\ncurve = { table = [[0, 0], [0.01, 1], [0.02, 0.5]] }",
            Box::new(|t| 1e-3 * (100.0 * t).min(1.5 - 50.0 * t)),
        ),
        (
            "by = [0, 0, 1e-5]\ncurve = \"hold\"\nfrom = 0.01",
            Box::new(|t| 1e-5 * f64::from(u8::from(t > 0.0099))),
        ),
        // From the start: the run begins with the nodes already there.
        ("by = [0, 0, 1e-5]\ncurve = \"hold\"", Box::new(|_| 1e-5)),
        ("velocity = [0, 0, 0.05]\ncurve = \"hold\"", Box::new(|t| 0.05 * t)),
        ("velocity = [0, 0, 0.05]\ncurve = \"ramp\"", Box::new(|t| 0.05 * t * t / 0.04)),
        (
            "velocity = [0, 0, 0.05]\ncurve = { table = [[0, 0], [0.01, 1], [0.02, 1]] }",
            Box::new(|t| if t < 0.01 { 2.5 * t * t } else { 0.05 * (t - 0.005) }),
        ),
    ];
    for (given, expected) in cases {
        let rows = motion(given);
        assert_eq!(rows.len(), 6, "{given}");
        for (time, z) in rows {
            assert_close(z, expected(time), 1e-12, &format!("{given} at {time} s"));
        }
    }
}

/// [`FROM_FILE`] with the upper nodes of the cube moved as `by` says.
fn moved_node_by_node(by: &str) -> String {
    let nodes = "nodes = { nearest = { point = [0, 0, 0], count = 4 } }";
    let base = "nodes = { box = [[0, 0, 0], [0.1, 0.1, 0]] }";
    let lid = format!(
        "{base}\n[constraint.lid]\ntype = \"move\"\nbody = \"organ\"\nnodes = {{ box = [[0, 0, 0.1], [0.1, 0.1, 0.1]] }}\n\
         by = {by}\ncurve = {{ table = [[0, 0], [0.005, 1], [0.01, 0.5]] }}\n"
    );
    changed(FROM_FILE, nodes, &lid)
}

#[test]
fn every_node_goes_its_own_way_from_point_data_or_a_table_with_every_solver() {
    let by = |node: usize| [0.001 * node as f64, -0.002, 0.0005 * node as f64];
    let vectors: Vec<String> = (0..8).map(|node| by(node).map(|x| x.to_string()).join(" ")).collect();
    let data = format!("POINT_DATA 8\nVECTORS shift double\n{}\n", vectors.join("\n"));
    let table: Vec<String> = (4..8)
        .rev()
        .map(|node| format!("{node},{}\n", by(node).map(|x| (1000.0 * x).to_string()).join(",")))
        .collect();
    for solver in ["explicit", "quasi-static"] {
        for motion in ["{ point-data = \"shift\" }", "{ csv = \"motion.csv\", scale = 0.001 }"] {
            let run = format!("[run]\nsolver = \"{solver}\"");
            let workshop = Workshop::new(&changed(&moved_node_by_node(motion), "[run]", &run));
            workshop.write("case/organ.vtk", vtk(&CORNERS, &TETS, &data));
            workshop.write("case/motion.csv", format!("node,x,y,z\n{}", table.concat()));
            workshop.run(&[]).done();
            let frames = workshop.series("out/case/fields.pvd");
            for (frame, factor) in [(1, 1.0), (2, 0.5)] {
                let (time, file) = &frames[frame];
                let u = &file.mesh.point_data["displacement"];
                for node in 4..8 {
                    for c in 0..3 {
                        let expected = factor * by(node)[c];
                        // The explicit run samples the time nearest to 5 ms.
                        let slack = if frame == 1 && solver == "explicit" { 1e-3 } else { 1e-12 };
                        assert_close(u.item(node)[c], expected, slack, &format!("node {node} at {time} s"));
                    }
                }
            }
        }
    }
}

/// A node keeps its number of the file after a repair has moved it up.
#[test]
fn a_table_of_motions_names_nodes_as_the_mesh_file_does() {
    let mut points = vec![[9.0; 3]];
    points.extend(CORNERS);
    let tets: Vec<Vec<u32>> = TETS.iter().map(|tet| tet.iter().map(|node| node + 1).collect()).collect();
    let tets: Vec<&[u32]> = tets.iter().map(Vec::as_slice).collect();
    let scene = changed(
        &moved_node_by_node("{ csv = \"motion.csv\" }"),
        "\"organ.vtk\"",
        "\"organ.vtk\", scale = 1, fix = \"drop-unused\"",
    );
    let workshop = Workshop::new(&scene);
    workshop.write("case/organ.vtk", vtk(&points, &tets, ""));
    workshop.write("case/motion.csv", "5,0,0,0.001\n6,0,0,0.002\n7,0,0,0.003\n8,0,0,0.004\n");
    workshop.run(&[]).done();
    let frames = workshop.series("out/case/fields.pvd");
    let u = &frames.last().unwrap().1.mesh.point_data["displacement"];
    for node in 4..8 {
        assert_close(u.item(node)[2], 0.0005 * (node - 3) as f64, 1e-12, &format!("node {node}"));
    }
}

/// Without damping and loads: u = v t, and the kinetic energy ½ m v² from the first row on.
#[test]
fn a_block_that_starts_with_a_velocity_flies_on_with_its_energy() {
    for precision in ["double", "single"] {
        let scene = format!(
            r#"[scene]
until = 0.05
[run]
precision = "{precision}"
step = 2e-3
[law.tissue]
type = "neo-hookean"
young-modulus = 3e3
poisson-ratio = 0.4
[body.block]
mesh = {{ block = {{ size = [0.1, 0.1, 0.1] }}, edge = 0.05 }}
law = "tissue"
density = 1000
velocity = [1, -2, 0.5]
[output.history]
type = "csv"
every = 0.01
probes.middle = {{ on = "block", at = [0.05, 0.05, 0.05], data = ["displacement", "velocity"] }}
"#
        );
        let workshop = Workshop::new(&scene);
        let output = workshop.run(&[]);
        output.done();
        assert!(
            output.err.contains("held by no constraint: it keeps its initial velocity"),
            "{}",
            output.err
        );
        let (header, rows) = workshop.table("out/case/history.csv");
        let column = |name: &str| header.iter().position(|known| known == name).unwrap();
        let slack = if precision == "double" { 1e-12 } else { 1e-5 };
        assert!(rows.len() >= 6);
        for row in &rows {
            for (axis, v) in ["x", "y", "z"].iter().zip([1.0, -2.0, 0.5]) {
                let at = |what: &str| row[column(&format!("probe.middle.{what}.{axis}"))];
                assert_close(at("velocity"), v, slack, "velocity");
                assert_close(at("displacement"), v * row[0], slack, "displacement");
            }
            assert_close(row[column("energy.kinetic")], 0.5 * 5.25, 10.0 * slack, "kinetic energy");
            assert_close(row[column("energy.balance")], 0.0, 10.0 * slack, "balance");
        }
    }
}

/// Under gravity and damping α: v' = g − α v, so the first steps are accurate to second order.
#[test]
fn damping_slows_what_started_with_a_velocity() {
    let scene = changed(BLOCK, "damping = 5", "damping = 5\nvelocity = [2, 0, 0]");
    let free = &scene[..scene.find("[constraint.base]").unwrap()];
    let output = "[output.history]\ntype = \"csv\"\nevery = 0.001\nprobes.middle = { on = \"block\", at = [0.05, 0.05, \
                  0.05], data = [\"velocity\"] }\n";
    let workshop = Workshop::new(&format!("{free}{output}"));
    workshop.run(&[]).done();
    let (header, rows) = workshop.table("out/case/history.csv");
    let column = |axis: &str| {
        header.iter().position(|known| *known == format!("probe.middle.velocity.{axis}")).unwrap()
    };
    for row in &rows {
        let decay = (-5.0 * row[0]).exp();
        // (α Δt)²/12 of a step of a millisecond.
        assert_close(row[column("x")], 2.0 * decay, 1e-5, "across");
        assert_close(row[column("z")], -9.81 / 5.0 * (1.0 - decay), 1e-5, "down");
    }
}
