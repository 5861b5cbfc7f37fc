//! Bodies from shapes and mesh files: their volumes, labels, fibres, selections and formats.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use pliant_geometry::{CellKind, Vector3, io};
use pliant_meshing::{Ellipsoid, TriangleMesh};
use pliant_testing::scenes::{BLOCK, CORNERS, FROM_FILE, ROOT, TETS, Workshop, changed, fibres, labels, vtk};

use crate::support::assert_close;

#[test]
fn laws_go_by_label_in_the_built_in_brain() {
    let law = |name: &str, young: f64| {
        format!("[law.{name}]\ntype = \"neo-hookean\"\nyoung-modulus = {young}\npoisson-ratio = 0.45\n")
    };
    let scene = format!(
        "[scene]\nuntil = 0.002\ngravity = [0, 0, -9.81]\n{}{}{}\
         [body.brain]\nmesh = {{ organ = \"brain\", edge = 0.02 }}\ndensity = 1040\n\
         law = {{ 1 = \"tissue\", 2 = \"ventricle\", 3 = \"tumour\" }}\n\
         [constraint.stem]\ntype = \"fix\"\nbody = \"brain\"\nnodes = {{ label-boundary = [1, 3] }}\n\
         [output.fields]\ntype = \"vtu\"\nevery = 1\n",
        law("tissue", 3000.0),
        law("ventricle", 500.0),
        law("tumour", 9000.0),
    );
    let workshop = Workshop::new(&scene);
    workshop.run(&[]).done();
    let check = workshop.check(&[]).out;
    assert_eq!(check.matches("tet4 with law neo-hookean").count(), 3, "{check}");
    assert!(check.contains("shear modulus 172.4 Pa") && check.contains("shear modulus 3103 Pa"), "{check}");
    let mesh = workshop.series("out/case/fields.pvd").pop().unwrap().1.mesh;
    let labels: BTreeSet<i64> =
        mesh.block(CellKind::Tet).unwrap().data["label"].values.iter().map(|&label| label as i64).collect();
    assert_eq!(labels, BTreeSet::from([1, 2, 3]));
}

#[test]
fn laws_go_by_label_over_tets_and_hexes_of_one_body() {
    let hex = CORNERS.map(|[x, y, z]| [x + 0.3, y, z]);
    let points: Vec<[f64; 3]> = CORNERS.into_iter().chain(hex).collect();
    let hex: &[u32] = &[8, 9, 11, 10, 12, 13, 15, 14];
    let cells: Vec<&[u32]> = TETS.into_iter().chain([hex]).collect();
    let scene =
        changed(FROM_FILE, "law = \"tissue\"", "law = { 1 = \"tissue\", 2 = \"tissue\", 3 = \"tissue\" }");
    let workshop = Workshop::new(&scene);
    workshop.write("case/organ.vtk", vtk(&points, &cells, &labels(&[1, 1, 1, 2, 2, 2, 3])));
    let output = workshop.run(&[]);
    assert_eq!(output.done()["elements"], 7);
    assert!(output.err.contains("`organ` is made of 2 separate parts"), "{}", output.err);
}

#[test]
fn each_cell_can_have_its_own_fibre() {
    // All nodes are prescribed, so that every cell is stretched by 1.1 along z.
    let scene = r#"[scene]
until = 0.1
[law.tissue]
type = "transversely-isotropic"
young-modulus = 10e3
poisson-ratio = 0.3
fibre-modulus = 5e3
[body.organ]
mesh = { file = "organ.vtk" }
law = "tissue"
density = 1000
fibre = { cell-data = "fibre" }
[constraint.low]
type = "fix"
body = "organ"
nodes = { plane = { point = [0, 0, 0], normal = [0, 0, 1] } }
[constraint.high]
type = "move"
body = "organ"
nodes = { plane = { point = [0, 0, 0.1], normal = [0, 0, 1] } }
by = [0, 0, 0.01]
[output.fields]
type = "vtu"
every = 1
data = ["fibre-stretch", "J"]
"#;
    let workshop = Workshop::new(scene);
    let directions = ["1 0 0", "0 0 2", "0 -3 0", "0 0 -1", "1 0 1", "0 1 0"];
    workshop.write("case/organ.vtk", vtk(&CORNERS, &TETS, &fibres(&directions)));
    workshop.run(&[]).done();
    let mesh = workshop.series("out/case/fields.pvd").pop().unwrap().1.mesh;
    let tets = mesh.block(CellKind::Tet).unwrap();
    let slanted = (0.5 * (1.0 + 1.1_f64 * 1.1)).sqrt();
    for (cell, expected) in [1.0, 1.1, 1.0, 1.1, slanted, 1.0].into_iter().enumerate() {
        // Written in double precision by a run in double precision.
        assert_close(tets.data["fibre-stretch"].item(cell)[0], expected, 1e-9, "stretch");
        assert_close(tets.data["J"].item(cell)[0], 1.1, 1e-9, "J");
    }
}

#[test]
fn every_selection_finds_its_nodes_in_a_scene() {
    let mesh = vtk(&CORNERS, &TETS, &labels(&[1, 1, 1, 2, 2, 2]));
    let block = Workshop::new(BLOCK);
    let organ = Workshop::new(FROM_FILE);
    organ.write("case/organ.vtk", mesh);
    let of_organ = FROM_FILE.lines().find(|line| line.starts_with("nodes")).unwrap();
    let cases = [
        ("\"all\"", 27),
        ("\"boundary\"", 26),
        ("{ box = [[0, 0, 0], [0.05, 0.1, 0]] }", 6),
        ("{ sphere = { centre = [0.05, 0.05, 0.05], radius = 0.05 } }", 7),
        ("{ half-space = { point = [0.05, 0, 0], normal = [1, 0, 0] } }", 18),
        ("{ plane = { point = [0, 0, 0.05], normal = [0, 0, 3] } }", 9),
        ("{ plane = { point = [0, 0, 0.02], normal = [0, 0, 1], tolerance = 0.03 } }", 18),
        ("{ normal = { direction = [0, 0, -1], within = 1 } }", 9),
        ("{ nearest = { point = [0, 0, 0] } }", 1),
        ("{ nearest = { point = [0, 0, 0], count = 4 } }", 4),
        ("{ set = \"z-min\" }", 9),
        ("{ ids = [0, 5, 17] }", 3),
        ("{ union = [{ set = \"z-min\" }, { ids = [0, 26] }] }", 10),
        ("{ intersection = [{ set = \"z-min\" }, { set = \"x-min\" }] }", 3),
        ("{ difference = [\"all\", \"boundary\"] }", 1),
    ];
    let count = |workshop: &Workshop, base: &str, from: &str, to: &str| {
        workshop.write("case/scene.toml", changed(base, from, &format!("nodes = {to}")));
        let output = workshop.check(&[]);
        assert_eq!(output.status(), "checked", "{to}: {}", output.err);
        let line = output.out.lines().find(|line| line.starts_with("constraint `base`")).unwrap().to_owned();
        line.split_whitespace().rev().nth(1).unwrap().parse::<usize>().unwrap()
    };
    // The other constraint would contradict most cases.
    let hand = BLOCK.find("[constraint.hand]").unwrap();
    let free = format!("{}{}", &BLOCK[..hand], &BLOCK[BLOCK.find("[load.push]").unwrap()..]);
    for (selection, expected) in cases {
        assert_eq!(count(&block, &free, "nodes = { set = \"z-min\" }", selection), expected, "{selection}");
    }
    for (selection, expected) in [("{ label = 1 }", 6), ("{ label-boundary = [1, 2] }", 4)] {
        assert_eq!(count(&organ, FROM_FILE, of_organ, selection), expected, "{selection}");
    }
}

#[test]
fn built_in_shapes_fill_their_volume_with_tets_and_hexes() {
    // The volume [m³] and how far a coarse mesh may be off: voxels and flat facets miss part of a curved
    // surface.
    let pi = std::f64::consts::PI;
    for (shape, volume, of_tets, of_hexes) in [
        ("block = { size = [0.1, 0.06, 0.04] }, edge = 0.02", 2.4e-4, 1e-12, 1e-12),
        ("block = { size = [0.1, 0.06, 0.04], cells = [3, 2, 1] }", 2.4e-4, 1e-12, 1e-12),
        ("ellipsoid = { radii = [0.05, 0.04, 0.03] }, edge = 0.01", 4.0 / 3.0 * pi * 6e-5, 0.05, 0.1),
        (
            "tube = { inner-radius = 0.02, outer-radius = 0.03, length = 0.05 }, edge = 0.01",
            pi * 5e-4 * 0.05,
            0.06,
            0.06,
        ),
        ("organ = \"liver\", edge = 0.015", 7.7e-4, 0.1, 0.1),
        ("organ = \"liver\", edge = 0.02, scale = 1.25", 1.5e-3, 0.1, 0.1),
        ("organ = \"brain\", edge = 0.015", 1.3e-3, 0.1, 0.1),
    ] {
        for (cells, element, tolerance) in [("tets", "tet4", of_tets), ("hexes", "hex8", of_hexes)] {
            let scene = format!(
                "[scene]\nuntil = 1e-4\n[law.tissue]\ntype = \"neo-hookean\"\nyoung-modulus = 3e3\npoisson-ratio = 0.4\n\
                 [body.shape]\nmesh = {{ {shape}, as = \"{cells}\" }}\nelement = \"{element}\"\nlaw = \"tissue\"\ndensity = 1000\n"
            );
            let done = Workshop::new(&scene).run(&[]).done();
            let found = done["bodies"][0]["volume"].as_f64().unwrap();
            assert_close(found, volume, tolerance * volume, &format!("{shape} as {cells}"));
        }
    }
}

/// Writes a mesh file once more, with another ending.
fn convert(workshop: &Workshop, file: &str, ending: &str) {
    let path = workshop.path(file);
    io::write(&path.with_extension(ending), &io::read(&path).unwrap().mesh).unwrap();
}

#[test]
fn mesh_files_of_every_volume_format_become_bodies() {
    let data = Path::new(ROOT).join("crates/geometry/tests/data");
    let files = ["gmsh1.msh", "gmsh22.msh", "gmsh22-binary.msh", "gmsh41.msh", "gmsh41-binary.msh"];
    for file in files {
        let workshop = Workshop::new(&FROM_FILE.replace("organ.vtk", "organ.msh"));
        fs::copy(data.join(file), workshop.path("case/organ.msh")).unwrap();
        let done = workshop.run(&["scene.until=1e-4"]).done();
        assert_eq!(done["elements"], 48, "{file}");
    }
    // Converted, a mesh is the same body in every format.
    let workshop = Workshop::new(FROM_FILE);
    workshop.write("case/organ.vtk", vtk(&CORNERS, &TETS, &labels(&[1, 1, 1, 2, 2, 2])));
    let reaction = workshop.run(&[]).done()["reactions"]["base"].clone();
    for ending in ["msh", "vtu"] {
        convert(&workshop, "case/organ.vtk", ending);
        workshop.write("case/scene.toml", FROM_FILE.replace("organ.vtk", &format!("organ.{ending}")));
        assert_eq!(workshop.run(&[]).done()["reactions"]["base"], reaction, "{ending}");
    }
}

#[test]
fn mesh_files_of_every_surface_format_become_surfaces() {
    let workshop = Workshop::new(BLOCK);
    let quads = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    let corners: String = CORNERS.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
    workshop.write("case/skin.obj", corners + quads);
    for ending in ["stl", "ply"] {
        convert(&workshop, "case/skin.obj", ending);
    }
    let off = "OFF\n4 2 0\n0 0 0.1\n0.1 0 0.1\n0.1 0.1 0.1\n0 0.1 0.1\n3 0 1 2\n3 0 2 3\n";
    workshop.write("case/skin.off", off);
    for ending in ["obj", "stl", "ply", "off"] {
        let mesh = format!("mesh = {{ file = \"skin.{ending}\" }}");
        let scene = changed(BLOCK, "mesh = { block = { size = [0.1, 0.1, 0.1] }, edge = 0.04 }", &mesh);
        let scene = changed(&scene, "direction = [1, 0, 0]", "direction = [0, 0, 1]");
        workshop.write("case/scene.toml", scene);
        workshop.run(&["scene.until=0.002"]).done();
    }
}

#[test]
fn scale_and_at_bring_a_mesh_to_metres_and_in_place() {
    let millimetres = CORNERS.map(|point| point.map(|x| 1000.0 * x));
    let scene = changed(FROM_FILE, "\"organ.vtk\"", "\"organ.vtk\", scale = 0.001, at = [0.5, 0, 0]");
    let workshop = Workshop::new(&scene);
    workshop.write("case/organ.vtk", vtk(&millimetres, &TETS, ""));
    let output = workshop.run(&[]);
    assert_close(output.done()["mass"].as_f64().unwrap(), 1.0, 1e-12, "mass [kg]");
    assert_eq!(output.err, "", "nothing to doubt");
    let mesh = workshop.series("out/case/fields.pvd").remove(0).1.mesh;
    let (low, high) = mesh.bounds().unwrap();
    assert_close(low.x, 0.5, 1e-12, "left end [m]");
    assert_close(high.x, 0.6, 1e-12, "right end [m]");
}

/// Energy [J] of a hollow ball of 30 mm with a wall of 3 mm under a pressure inside, in tets of an edge [m].
fn inflated(workshop: &Workshop, edge: f64) -> f64 {
    let held = |name: &str, at: [f64; 3], components: &str| {
        format!(
            "[constraint.{name}]\ntype = 'fix'\nbody = 'ball'\nnodes = {{ nearest = {{ point = {at:?} }} }}\ncomponents = {components}\n"
        )
    };
    let scene = format!(
        "[scene]\nuntil = 1\n[run]\nsolver = 'static'\nload-steps = 1\n\
         [law.wall]\ntype = 'neo-hookean'\nyoung-modulus = 1e6\npoisson-ratio = 0.3\n\
         [body.ball]\nmesh = {{ file = 'ball.stl', edge = {edge}, as = 'tets' }}\nlaw = 'wall'\ndensity = 1000\nelement = 'tet4'\n\
         {}{}{}\
         [load.inside]\ntype = 'pressure'\non = 'ball'\nfaces = {{ sphere = {{ centre = [0, 0, 0], radius = 0.0285 }} }}\npressure = 100\n\
         [output.history]\ntype = 'csv'\nevery = 1\nenergy = true\n",
        held("a", [0.03, 0.0, 0.0], "['x', 'y', 'z']"),
        held("b", [-0.03, 0.0, 0.0], "['y', 'z']"),
        held("c", [0.0, 0.03, 0.0], "['z']"),
    );
    workshop.write("case/scene.toml", scene);
    workshop.run_into(&format!("out/{edge}"), &[]).done();
    let (names, rows) = workshop.table(&format!("out/{edge}/history.csv"));
    let column = names.iter().position(|name| name == "energy.internal").expect("a column");
    rows.last().expect("a row")[column]
}

/// A wall that is little thicker than its cells is neither torn nor softer than in cells that resolve it.
#[test]
fn a_thin_wall_is_as_stiff_in_cells_as_large_as_it_is_thick() {
    let ball = |radius: f64| {
        let field = Ellipsoid::sphere(Vector3::zeros(), radius);
        TriangleMesh::of_field(&field, 0.001, usize::MAX).expect("a ball").to_mesh()
    };
    let (mut wall, inner) = (ball(0.03), ball(0.027));
    let first = wall.points.len() as u32;
    wall.points.extend(inner.points);
    let triangles = inner.blocks[0].nodes.chunks(3).flat_map(|t| [t[0], t[2], t[1]].map(|node| node + first));
    wall.block_mut(CellKind::Triangle).nodes.extend(triangles);
    let workshop = Workshop::new("");
    let file = tempfile::tempdir().expect("a folder");
    io::write(&file.path().join("ball.stl"), &wall).expect("a file");
    workshop.write("case/ball.stl", fs::read(file.path().join("ball.stl")).expect("a file"));
    let [coarse, fine] = [0.0025, 0.002].map(|edge| inflated(&workshop, edge));
    println!("{coarse} J in tets of 2.5 mm, {fine} J in tets of 2 mm");
    assert!((fine / coarse - 1.0).abs() < 0.02, "{coarse} {fine}");
}
