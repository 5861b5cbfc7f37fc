//! Tets and hexes of closed surfaces, and what `pliant info` measures on surfaces, through the real binary.

use pliant_geometry::io::{self, Format};
use pliant_geometry::{CellKind, Mesh, Vector3};
use pliant_meshing::{Pattern, Sheet, sphere};
use serde_json::Value;

use crate::support::{BLOCK, Said, Workshop};

/// Radius of the balls [mm].
const RADIUS: f64 = 15.0;

/// A ball in millimetres with edges of about 2 mm, moved along x.
fn ball(radius: f64, x: f64) -> Mesh {
    let mut mesh = sphere(radius, 4, 100_000).expect("a sphere");
    mesh.points.iter_mut().for_each(|point| point.x += x);
    // The result is a different surface.
    mesh.point_data.clear();
    mesh
}

fn nodes(mesh: &mut Mesh) -> &mut Vec<u32> {
    &mut mesh.block_mut(CellKind::Triangle).nodes
}

/// Two meshes as one.
fn both(mut first: Mesh, mut second: Mesh) -> Mesh {
    let offset = first.points.len() as u32;
    let more: Vec<u32> = nodes(&mut second).iter().map(|n| n + offset).collect();
    nodes(&mut first).extend(more);
    first.points.extend(second.points);
    first
}

fn inverted(mut mesh: Mesh) -> Mesh {
    nodes(&mut mesh).chunks_exact_mut(3).for_each(|nodes| nodes.swap(0, 1));
    mesh
}

/// Points and triangles as text: OFF and the arrays of VTP.
fn text(mesh: &Mesh, format: Format) -> String {
    let block = mesh.block(CellKind::Triangle).expect("triangles");
    let points: Vec<String> = mesh.points.iter().map(|x| format!("{} {} {}", x.x, x.y, x.z)).collect();
    let faces = block.cells().map(|n| format!("{} {} {}", n[0], n[1], n[2]));
    if format == Format::Off {
        let faces: Vec<String> = faces.map(|face| format!("3 {face}")).collect();
        return format!(
            "OFF\n{} {} 0\n{}\n{}\n",
            points.len(),
            faces.len(),
            points.join("\n"),
            faces.join("\n")
        );
    }
    let offsets: Vec<String> = (1..=block.len()).map(|n| (3 * n).to_string()).collect();
    format!(
        "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"{}\" NumberOfPolys=\"{}\"><Points><DataArray \
         type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">{}</DataArray></Points><Polys><DataArray type=\"Int64\" \
         Name=\"connectivity\" format=\"ascii\">{}</DataArray><DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">{}\
         </DataArray></Polys></Piece></PolyData></VTKFile>",
        points.len(),
        block.len(),
        points.join(" "),
        faces.collect::<Vec<_>>().join(" "),
        offsets.join(" ")
    )
}

fn with(name: &str, mesh: &Mesh) -> Workshop {
    let workshop = Workshop::new(BLOCK);
    put(&workshop, name, mesh);
    workshop
}

fn put(workshop: &Workshop, name: &str, mesh: &Mesh) {
    let path = workshop.path(name);
    match Format::of_path(&path) {
        Some(format @ (Format::Off | Format::Vtp)) => workshop.write(name, text(mesh, format)),
        _ => io::write(&path, mesh).expect("the mesh is written"),
    }
}

/// Runs `pliant mesh NAME --scale 0.001 --edge 5mm -o out.vtu --json …`; options in `more` replace the usual
/// ones.
fn mesh(workshop: &Workshop, name: &str, more: &[&str]) -> Said {
    let usual = [["--scale", "0.001"], ["--edge", "5mm"]];
    let missing = usual.iter().filter(|option| !more.contains(&option[0])).flatten().copied();
    let arguments: Vec<&str> = ["mesh", name, "-o", "out.vtu", "--json"].into_iter().chain(missing).collect();
    workshop.pliant(&[&arguments[..], more].concat())
}

fn done(output: &Said) -> Value {
    assert_eq!(output.code, 0, "{}{}", output.err, output.out);
    output.json()
}

fn close(value: &Value, expected: f64, within: f64) -> bool {
    value.as_f64().is_some_and(|value| (value - expected).abs() <= within * expected.abs())
}

fn ball_volume(radius: f64) -> f64 {
    4.0 / 3.0 * std::f64::consts::PI * (radius * 1e-3).powi(3)
}

#[test]
fn every_format_becomes_tets_of_the_volume_within() {
    let made: Vec<Value> = ["obj", "off", "stl", "ply", "vtp", "vtu"]
        .iter()
        .map(|ending| {
            let name = format!("ball.{ending}");
            let workshop = with(&name, &ball(RADIUS, 0.0));
            let json = done(&mesh(&workshop, &name, &["--label", "7"]));
            let read = io::read(&workshop.path("out.vtu")).expect("a mesh").mesh;
            assert!(read.blocks[0].data["label"].values.iter().all(|label| *label == 7.0));
            assert!(read.points.iter().all(|x| x.norm() < 1.02e-3 * RADIUS));
            json
        })
        .collect();
    for json in &made {
        let material = &json["materials"][0];
        assert!(close(&material["volume"], ball_volume(RADIUS), 0.02), "{material}");
        assert!(material["volume_error"].as_f64().unwrap().abs() < 5e-3, "{material}");
        assert!(json["acoustic_part"].as_f64().unwrap() > 0.7, "{json}");
        assert!(json["distances"]["largest_from_body"].as_f64().unwrap() < 1e-3, "{json}");
        assert_eq!((&json["mended"]["shells"], &json["components"]), (&1.into(), &1.into()));
        // Single precision in STL moves points by a nanometre.
        assert_eq!(json["cells"], made[0]["cells"]);
    }
}

#[test]
fn hexes_of_a_surface_and_of_the_boundary_of_cells() {
    let workshop = with("ball.ply", &ball(RADIUS, 0.0));
    let json = done(&mesh(&workshop, "ball.ply", &["--as", "hexes", "--edge", "2mm"]));
    // Cubes whose middle is inside: of 1767 in the mean, as points of a lattice in a ball.
    assert!(close(&json["materials"][0]["volume"], ball_volume(RADIUS), 0.06), "{json}");
    // The result is a mesh file as well, now in metres.
    let again = ["mesh", "out.vtu", "--edge", "4mm", "-o", "again.vtu", "--json"];
    let again = done(&workshop.pliant(&again));
    assert!(close(&again["materials"][0]["volume"], ball_volume(RADIUS), 0.06), "{again}");
}

#[test]
fn what_was_mended_is_told() {
    let mut holed = ball(RADIUS, 0.0);
    nodes(&mut holed).truncate(3 * 5119);
    let mut doubled = ball(RADIUS, 0.0);
    nodes(&mut doubled).extend([0, 1, 1]);
    let again = nodes(&mut doubled)[..3].to_vec();
    nodes(&mut doubled).extend(again);
    let hollow = both(ball(RADIUS, 0.0), inverted(ball(RADIUS / 2.0, 0.0)));
    let cases: [(Mesh, &[&str], &[&str]); 7] = [
        (ball(RADIUS, 0.0), &[], &["mended nothing"]),
        (inverted(ball(RADIUS, 0.0)), &[], &["5120 faces turned"]),
        (holed, &[], &["1 hole of up to", "mm closed"]),
        (doubled, &[], &["2 faces without area or duplicate dropped"]),
        (
            both(ball(RADIUS, 0.0), ball(RADIUS, 11.0)),
            &[],
            &["pairs of triangles intersect, the first at (", "overlapping parts were joined"],
        ),
        (hollow.clone(), &[], &["surface 2 pieces, of which 1 cavity"]),
        (hollow, &["--fill-holes"], &["1 cavity filled"]),
    ];
    for (surface, more, says) in cases {
        let workshop = with("surface.ply", &surface);
        let output = workshop.pliant(
            &[&["mesh", "surface.ply", "--scale", "0.001", "--edge", "5mm", "-o", "out.vtu"], more].concat(),
        );
        assert_eq!(output.code, 0, "{}", output.err);
        let page = output.out.split_whitespace().collect::<Vec<_>>().join(" ");
        says.iter().for_each(|piece| assert!(page.contains(piece), "no `{piece}` in:\n{}", output.out));
    }
    // Triangles of an STL file share no points.
    let workshop = with("ball.stl", &ball(RADIUS, 0.0));
    assert_eq!(done(&mesh(&workshop, "ball.stl", &[]))["mended"]["closed_holes"], 0);
    // A piece too many.
    let workshop = with("two.ply", &both(ball(RADIUS, 0.0), ball(RADIUS / 2.0, 40.0)));
    let json = done(&mesh(&workshop, "two.ply", &["--keep-largest"]));
    assert_eq!((&json["mended"]["dropped_pieces"], &json["components"]), (&1.into(), &1.into()));
}

#[test]
fn what_cannot_be_filled_is_refused_with_a_remedy() {
    let mut open = ball(RADIUS, 0.0);
    let points = open.points.clone();
    let upper = |n: &[u32]| n.iter().all(|&n| points[n as usize].z > -2.0);
    let kept: Vec<u32> = nodes(&mut open).chunks(3).filter(|n| upper(n)).flatten().copied().collect();
    *nodes(&mut open) = kept;
    let workshop = with("open.ply", &open);
    put(&workshop, "ball.ply", &ball(RADIUS, 0.0));
    let plate =
        Sheet::Plate { size: [1.0, 1.0] }.mesh([2, 2], Pattern::Diagonal, None, 100).expect("a plate");
    put(&workshop, "plate.ply", &plate);
    workshop.write("lines.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n");
    workshop.write("cut.stl", [0_u8; 90]);
    let cases: [(&str, &[&str], &[&str]); 17] = [
        ("missing.stl", &[], &["cannot open `missing.stl`"]),
        ("cut.stl", &[], &["cut.stl"]),
        ("lines.obj", &[], &["there is no surface"]),
        (
            "open.ply",
            &[],
            &[
                "the surface is open: 1 hole",
                "holes of up to 5.00 mm are closed",
                "closes holes as wide as this one",
            ],
        ),
        ("plate.ply", &["--close-gaps", "2mm"], &["encloses nothing"]),
        ("ball.ply", &["--label", "1", "--label", "2"], &["`--label` more than once is for images"]),
        ("ball.ply", &["--threshold", "1"], &["`--threshold` is for images"]),
        ("ball.ply", &["--series", "1.2"], &["`--series` is for images"]),
        (
            "ball.ply",
            &["--as", "surface", "--keep-largest"],
            &["`--keep-largest` are for images, and for tets and hexes"],
        ),
        (
            "ball.ply",
            &["--as", "surface", "--label", "3"],
            &["`--label` is for images, and for tets and hexes"],
        ),
        ("ball.ply", &["--as", "surface", "--young", "3e3"], &["are for tets and hexes"]),
        ("ball.ply", &["--as", "surface", "--edge", "0.01mm"], &["exceed the limit", "--force"]),
        ("ball.ply", &["--edge", "0.05mm"], &["exceed the limit", "--force"]),
        ("ball.ply", &["--edge", "90mm"], &["no cell of edge 0.09 m fits"]),
        ("ball.ply", &["--edge", "-1"], &["edge is -1", "positive"]),
        ("ball.ply", &["--scale", "0"], &["`--scale` is 0"]),
        ("ball.ply", &["--close-gaps", "-1mm"], &["gaps to close is -0.001"]),
    ];
    for (name, more, says) in cases {
        let output = mesh(&workshop, name, more);
        assert_eq!(output.code, 2, "{name} {more:?}: {}{}", output.err, output.out);
        assert_eq!(output.json()["error"]["kind"], "input");
        for piece in says {
            assert!(output.words().contains(piece), "{name} {more:?}: no `{piece}` in: {}", output.err);
        }
        assert!(!workshop.path("out.vtu").exists());
    }
    // The wide hole is closed on request.
    let closed = done(&mesh(&workshop, "open.ply", &["--close-gaps", "45mm"]));
    assert_eq!(closed["mended"]["closed_holes"], 1);
    // The rest ends between z = -2 mm and 0: 0.6 of the ball is above the one, half above the other.
    let volume = closed["materials"][0]["volume"].as_f64().unwrap() / ball_volume(RADIUS);
    assert!((0.5..0.6).contains(&volume), "{volume}");
}

#[test]
fn lengths_take_units_and_a_tissue_its_step() {
    let workshop = with("ball.ply", &ball(RADIUS, 0.0));
    let edges = ["6mm", "0.006", "0.6cm", "6000um", "0.006 m"];
    let bytes: Vec<Vec<u8>> = edges
        .iter()
        .map(|edge| {
            let arguments =
                ["mesh", "ball.ply", "--scale", "0.001", "--edge", edge, "--as", "hexes", "-o", "out.vtu"];
            assert_eq!(workshop.pliant(&arguments).code, 0);
            std::fs::read(workshop.path("out.vtu")).expect("a mesh")
        })
        .collect();
    assert!(bytes.iter().all(|one| *one == bytes[0]));
    let output = mesh(&workshop, "ball.ply", &["--edge", "6km"]);
    assert!(output.code == 2 && output.err.contains("as 8mm"), "{}", output.err);

    let bounds = |more: &[&str]| done(&mesh(&workshop, "ball.ply", more))["element_bound"].clone();
    let usual = bounds(&[]);
    let brain = usual["brain-like"].as_f64().unwrap();
    assert_eq!(bounds(&["--law", "liver-like"]), serde_json::json!({ "liver-like": usual["liver-like"] }));
    assert!(close(&bounds(&["--young", "3000"])["E = 3000 Pa, ν = 0.45"], brain, 1e-12));
    // Δt = l √(ρ / M).
    assert!(close(
        &bounds(&["--young", "3000", "--density", "4000"])["E = 3000 Pa, ν = 0.45"],
        2.0 * brain,
        1e-9
    ));
    let softer = bounds(&["--young", "3000", "--poisson", "0.3"]);
    let modulus = |nu: f64| (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu));
    let expected = brain * (modulus(0.45_f64) / modulus(0.3)).sqrt();
    assert!(close(&softer["E = 3000 Pa, ν = 0.3"], expected, 0.05), "{softer} {expected}");
    for wrong in [
        ["--young", "-1"],
        ["--young", "nan"],
        ["--density", "0"],
        ["--law", "bone-like"],
        ["--poisson", "0.3"],
    ] {
        assert_eq!(mesh(&workshop, "ball.ply", &wrong).code, 2, "{wrong:?}");
    }
    assert_eq!(mesh(&workshop, "ball.ply", &["--young", "1e3", "--poisson", "0.5"]).code, 2);
}

/// The old mesh stays if the new one cannot be written completely.
#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_leaves_the_old_mesh() {
    let workshop = with("ball.ply", &ball(RADIUS, 0.0));
    done(&mesh(&workshop, "ball.ply", &[]));
    let before = std::fs::read(workshop.path("out.vtu")).expect("a mesh");
    let limited =
        "trap '' XFSZ; ulimit -f 8; exec \"$0\" mesh ball.ply --scale 0.001 --edge 3mm -o out.vtu --json";
    let output: Said = std::process::Command::new("sh")
        .args(["-c", limited, env!("CARGO_BIN_EXE_pliant")])
        .current_dir(workshop.path(""))
        .output()
        .expect("a shell")
        .into();
    assert_eq!(output.code, 1, "{}", output.err);
    assert_eq!(output.json()["error"]["kind"], "output");
    assert!(output.words().contains("free space"), "{}", output.err);
    assert_eq!(std::fs::read(workshop.path("out.vtu")).expect("a mesh"), before);
    let beside: Vec<_> = std::fs::read_dir(workshop.path("")).expect("a folder").collect();
    assert_eq!(beside.len(), 3, "{beside:?}");
    // A folder that is not there, and one that is a file.
    for out in ["missing/out.vtu", "ball.ply/out.vtu"] {
        let output =
            workshop.pliant(&["mesh", "ball.ply", "--scale", "0.001", "--edge", "5mm", "-o", out, "--json"]);
        assert_eq!((output.code, &output.json()["error"]["kind"]), (1, &"output".into()), "{}", output.err);
        assert!(output.err.contains(out), "{}", output.err);
    }
}

/// Balls of 15 and 16.5 mm, the second one in metres: 1.5 mm apart up to the sagitta of their facets.
#[test]
fn info_measures_a_mesh_against_another() {
    let workshop = with("ball.ply", &ball(RADIUS, 0.0));
    let mut other = ball(1.1 * RADIUS, 0.0);
    other.points.iter_mut().for_each(|x| *x *= 1e-3);
    put(&workshop, "other.stl", &other);
    let arguments =
        ["info", "ball.ply", "--scale", "0.001", "--against", "other.stl", "--against-scale", "1"];
    let json = done(&workshop.pliant(&[&arguments[..], &["--json"]].concat()));
    let against = &json["against"];
    for way in ["largest_forward", "rms_forward", "largest_backward", "rms_backward"] {
        assert!(close(&against["distances"][way], 1.5e-3, 0.04), "{way}: {against}");
    }
    assert!(close(&against["diagonal"], 33e-3 * 3_f64.sqrt(), 0.01), "{against}");
    let place = |name: &str| {
        let place = against[name].as_array().expect("a place").iter().map(|x| x.as_f64().unwrap());
        Vector3::from_iterator(place).norm()
    };
    assert!(
        (place("farthest_forward") - 15e-3).abs() < 1e-4
            && (place("farthest_backward") - 16.5e-3).abs() < 1e-4
    );
    let page = workshop.pliant(&arguments);
    for piece in [
        "against other.stl:",
        "there 1.",
        "back  1.",
        "mm rms",
        "% of the diagonal), at (",
        "Hausdorff distance 1.",
    ] {
        assert!(page.out.contains(piece), "no `{piece}` in:\n{}", page.out);
    }
    // The scale of the mesh is the default for the other one.
    let same = ["info", "ball.ply", "--scale", "0.001", "--against", "ball.ply", "--json"];
    assert!(done(&workshop.pliant(&same))["against"]["hausdorff"].as_f64().unwrap() < 1e-15);
    for (other, scale, says) in [
        ("no.stl", "1", "cannot open"),
        ("other.stl", "0", "--against-scale"),
        ("other.stl", "nan", "--against-scale"),
    ] {
        let output = workshop.pliant(&["info", "ball.ply", "--against", other, "--against-scale", scale]);
        assert!(output.code == 2 && output.words().contains(says), "{}", output.err);
    }
}

#[test]
fn info_tells_curvature_and_thickness() {
    let workshop = with("ball.ply", &ball(RADIUS, 0.0));
    let info = |arguments: &[&str]| workshop.pliant(&[&["info"], arguments].concat());
    let json = done(&info(&["ball.ply", "--scale", "0.001", "--json"]));
    let curvature = &json["curvature"];
    assert!(close(&curvature["mean"]["median"], 1e3 / RADIUS, 1e-3), "{curvature}");
    assert!(close(&curvature["gaussian"]["median"], 1e6 / RADIUS.powi(2), 1e-3), "{curvature}");
    assert!(close(&json["thickness"]["thickness"]["median"], 2e-3 * RADIUS, 0.01), "{json}");
    // Of tets the boundary.
    done(&mesh(&workshop, "ball.ply", &[]));
    let tets = done(&info(&["out.vtu", "--json"]));
    assert!(close(&tets["curvature"]["mean"]["median"], 1e3 / RADIUS, 0.2), "{tets}");
    assert!(close(&tets["thickness"]["thickness"]["median"], 2e-3 * RADIUS, 0.05), "{tets}");

    // Shells with their own thickness: an open plate, twice as thick on the right.
    let mut plate =
        Sheet::Plate { size: [0.2, 0.1] }.mesh([8, 4], Pattern::Diagonal, None, 1000).expect("a plate");
    let thick: Vec<f64> = plate.blocks[0]
        .cells()
        .map(|n| if n.iter().map(|&n| plate.points[n as usize].x).sum::<f64>() < 0.3 { 1e-3 } else { 2e-3 })
        .collect();
    plate.blocks[0].data.insert("thickness".into(), pliant_geometry::DataArray::scalar(thick));
    put(&workshop, "plate.vtu", &plate);
    let json = done(&info(&["plate.vtu", "--json"]));
    assert_eq!((&json["thickness"], &json["against"]), (&Value::Null, &Value::Null));
    assert!(
        close(&json["shell_thickness"]["least"], 1e-3, 1e-9)
            && close(&json["shell_thickness"]["mean"], 1.5e-3, 1e-9)
    );
    let page = info(&["plate.vtu"]).out;
    assert!(page.contains("thickness of the shells:") && page.contains("curvature of the surface"), "{page}");
    // A body of 15 µm is one in other units.
    let page = info(&["ball.ply", "--scale", "1e-6"]).out;
    assert!(page.contains("smaller than any organ"), "{page}");
}
