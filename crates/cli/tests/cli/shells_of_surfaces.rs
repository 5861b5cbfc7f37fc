//! `pliant mesh --as shells`, then `pliant run` with a pressure on what it wrote: closed surfaces with a
//! flap, a thin gap and a sharp rim. Organs from files are read through `PLIANT_DATA`; without it that test
//! prints a notice and passes.

use pliant_geometry::{CellKind, Mesh, Vector3, io};
use pliant_meshing::{DEFAULT_CELL_LIMIT, ImplicitField, TriangleMesh};

use crate::support::{Said, Workshop};

const SCENE: &str = r#"[scene]
until = 0.02

[run]
solver = "implicit"
step = 0.01

[law.wall]
type = "st-venant-kirchhoff"
young-modulus = 1e6
poisson-ratio = 0.3

[body.wall]
model = "shell"
mesh = { file = "../shells.vtu" }
law = "wall"
density = 1000
thickness = 0.0003

[load.push]
type = "pressure"
on = "wall"
faces = "all"
pressure = 20

[output.history]
type = "csv"
every = 0.01
"#;

/// A body of a signed distance, positive inside, within ± 25 mm.
struct Body(fn(&Vector3) -> f64);

impl ImplicitField for Body {
    fn value(&self, point: &Vector3) -> f64 {
        (self.0)(point)
    }

    fn bounds(&self) -> (Vector3, Vector3) {
        (Vector3::repeat(-0.025), Vector3::repeat(0.025))
    }
}

fn ball(x: &Vector3, centre: [f64; 3], radius: f64) -> f64 {
    radius - (x - Vector3::from(centre)).norm()
}

fn slab(x: &Vector3, centre: [f64; 3], half: [f64; 3]) -> f64 {
    let off = (x - Vector3::from(centre)).abs() - Vector3::from(half);
    -(off.sup(&Vector3::zeros()).norm() + off.max().min(0.0))
}

/// A ball of 10 mm with a flap 2 mm thick.
fn flap(x: &Vector3) -> f64 {
    ball(x, [-0.008, 0.0, 0.0], 0.010).max(slab(x, [0.008, 0.0, 0.0], [0.012, 0.007, 0.001]))
}

/// Two leaves 3 mm thick, folded upon each other with 1.5 mm between them.
fn fold(x: &Vector3) -> f64 {
    slab(x, [0.0; 3], [0.015, 0.008, 0.00375]).min(-slab(x, [0.005, 0.0, 0.0], [0.015, 0.02, 0.00075]))
}

/// Intersection of two balls: a lens whose faces meet at 52°.
fn lens(x: &Vector3) -> f64 {
    ball(x, [0.0, 0.0, 0.027], 0.03).min(ball(x, [0.0, 0.0, -0.027], 0.03))
}

/// Largest angle between a normal of a node and one of its triangles [degrees], and nodes without a normal.
fn normals(mesh: &Mesh) -> (f64, usize) {
    let normal = |node: u32| {
        let item = mesh.point_data["normal"].item(node as usize);
        Vector3::new(item[0], item[1], item[2])
    };
    let mut largest = 0.0_f64;
    for nodes in mesh.block(CellKind::Triangle).unwrap().cells() {
        let [a, b, c] = [0, 1, 2].map(|k| mesh.points[nodes[k] as usize]);
        let across = (b - a).cross(&(c - a));
        let given = nodes.iter().map(|&n| normal(n)).filter(|n| *n != Vector3::zeros());
        largest = given.map(|n| n.angle(&across).to_degrees()).fold(largest, f64::max);
    }
    let nodes = 0..mesh.points.len() as u32;
    (largest, nodes.filter(|&n| normal(n) == Vector3::zeros()).count())
}

/// Makes shells of a body and runs them under pressure; the report of the fit, and what the run says.
fn pressed(body: Body, goal: [&str; 2]) -> (serde_json::Value, Mesh, Said) {
    let surface = TriangleMesh::of_field(&body, 0.001, DEFAULT_CELL_LIMIT).unwrap();
    let workshop = Workshop::new(SCENE);
    io::write(&workshop.path("body.ply"), &surface.to_mesh()).unwrap();
    pressed_file(&workshop, "body.ply", &goal)
}

fn pressed_file(workshop: &Workshop, file: &str, more: &[&str]) -> (serde_json::Value, Mesh, Said) {
    let words = ["mesh", file, "--as", "shells", "-o", "shells.vtu", "--json"];
    let output = workshop.pliant(&[&words, more].concat());
    let done = output.done();
    let report = done["report"].clone();
    let warned =
        |words| done["warnings"].as_array().unwrap().iter().any(|w| w.as_str().unwrap().contains(words));
    assert_eq!(warned("without a normal"), report["creases"]["count"] != 0, "{done}");
    assert_eq!(warned(" flat, at "), report["flattened"]["count"] != 0, "{done}");
    assert_eq!(warned("through other shells"), report["crossings"]["count"] != 0, "{done}");
    assert_eq!(warned("not reached"), report["reached"] == false, "{done}");
    println!("{report}");
    let mesh = io::read(&workshop.path("shells.vtu")).unwrap().mesh;
    let run = workshop.run(&[]);
    run.done();
    (report, mesh, run)
}

/// Nodes of a report that have no normal: of folds and of sharp edges.
fn without_normal(report: &serde_json::Value) -> u64 {
    report["creases"]["count"].as_u64().unwrap() + report["sharp"].as_u64().unwrap()
}

/// Rounded folds take a normal at every node, within 60° of all triangles, and shells that do not cross.
#[test]
fn shells_with_a_flap_or_a_thin_gap_run_under_pressure() {
    for (name, body, goal) in
        [("flap", Body(flap), ["--error", "1%"]), ("fold", Body(fold), ["--shells", "120"])]
    {
        let (report, mesh, run) = pressed(body, goal);
        let (angle, without) = normals(&mesh);
        println!("{name}: {angle:.1}° at most, {without} nodes without");
        assert!(angle <= 60.0, "{name}: {angle}");
        assert_eq!(without_normal(&report), without as u64);
        assert_eq!(report["crossings"]["count"], 0, "{name}");
        assert!(run.words().contains("is curved by the normals of its mesh"), "{}", run.err);
    }
}

/// At a rim of 52° no normal stands on both sides. The nodes of the rim are creases, which the report and the
/// run count.
#[test]
fn the_nodes_of_a_sharp_rim_are_creases() {
    let (report, mesh, run) = pressed(Body(lens), ["--error", "1%"]);
    let (angle, without) = normals(&mesh);
    println!("lens: {angle:.1}° at most, {without} nodes without");
    assert!(angle <= 60.0, "{angle}");
    assert_eq!(without_normal(&report), without as u64);
    assert!(without == 0 || run.words().contains("without a normal, which may be creases"), "{}", run.err);
}

/// Every closed organ at hand, with the factor that makes its lengths metres.
const ORGANS: [(&str, &str); 14] = [
    ("aneurysm-sofa/aneurysm3D_1.off", "0.001"),
    ("liver-sofa/liver-smooth.obj", "0.01"),
    ("organs-openhelp/Duodenum.stl", "0.001"),
    ("organs-openhelp/Kidney_left.stl", "0.001"),
    ("organs-openhelp/Liver.stl", "0.001"),
    ("organs-openhelp/Pancreas.stl", "0.001"),
    ("organs-openhelp/Rectum_Lumen.stl", "0.001"),
    ("organs-openhelp/Spleen.stl", "0.001"),
    ("organs-openhelp/Trachea.stl", "0.001"),
    ("organs-openhelp/Abdominal_wall.stl", "0.001"),
    ("organs-sofa-env/glt_gallbladder_visual.stl", "0.001"),
    ("organs-sofa-env/glt_gallbladder_collision.stl", "0.001"),
    ("liver-sofa/liver2.obj", "0.1"),
    ("aorta-vmtk/aorta-surface.vtp", "0.001"),
];

/// Few shells, so that thin folds are as hard as they can be. In the gate: three organs.
#[test]
#[ignore = "a minute: three organs"]
fn shells_of_three_organs_run_under_pressure() {
    press(&ORGANS[11..]);
}

#[test]
#[ignore = "minutes: eleven organs"]
fn shells_of_all_other_organs_run_under_pressure() {
    press(&ORGANS[..11]);
}

/// Fitted shells do not cross, their normals are within 60° of their triangles, and a run under pressure
/// accepts them.
fn press(organs: &[(&str, &str)]) {
    let Some(data) = std::env::var_os("PLIANT_DATA") else {
        println!("skipped: PLIANT_DATA is not set");
        return;
    };
    for (organ, scale) in organs {
        let workshop = Workshop::new(SCENE);
        let file = std::path::Path::new(&data).join(organ);
        let file = file.to_str().unwrap();
        let (report, mesh, _) = pressed_file(&workshop, file, &["--shells", "150", "--scale", scale]);
        let (angle, without) = normals(&mesh);
        println!("{organ}: {angle:.1}° at most, {without} nodes without a normal");
        assert!(angle <= 60.0, "{organ}: {angle}");
        assert_eq!(report["crossings"]["count"], 0, "{organ}");
    }
}
