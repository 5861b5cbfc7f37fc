//! Scenes of closed surfaces from files: bodies that fill them, and shells that cover them.

use pliant_geometry::{CellKind, Mesh, io};
use pliant_meshing::sphere;
use pliant_testing::scenes::Workshop;

use crate::support::close;

/// Radius of the balls [mm].
const RADIUS: f64 = 15.0;

/// A ball in millimetres with edges of about 2 mm.
fn ball() -> Mesh {
    let mut mesh = sphere(RADIUS, 4, 100_000).expect("a sphere");
    // The result is a different surface.
    mesh.point_data.clear();
    mesh
}

fn nodes(mesh: &mut Mesh) -> &mut Vec<u32> {
    &mut mesh.block_mut(CellKind::Triangle).nodes
}

fn inverted(mut mesh: Mesh) -> Mesh {
    nodes(&mut mesh).chunks_exact_mut(3).for_each(|nodes| nodes.swap(0, 1));
    mesh
}

fn with_surface(mesh: &Mesh) -> Workshop {
    let workshop = Workshop::new("");
    io::write(&workshop.path("case/ball.stl"), mesh).unwrap();
    workshop
}

#[test]
fn a_scene_fills_or_covers_the_surface_of_a_file() {
    let scene = |mesh: &str, more: &str, solver: &str| {
        format!(
            "[scene]\nuntil = 0.002\n[run]\nsolver = \"{solver}\"\n[law.tissue]\ntype = \"neo-hookean\"\n\
             young-modulus = 3000\npoisson-ratio = 0.45\n[body.organ]\nmesh = {{ file = \"ball.stl\", scale = 0.001, {mesh} }}\n\
             law = \"tissue\"\ndensity = 1000\n{more}[constraint.base]\ntype = \"fix\"\nbody = \"organ\"\n\
             nodes = {{ box = [[-1, -1, -1], [1, 1, -0.008]] }}\n"
        )
    };
    let exact = 4.0 / 3.0 * std::f64::consts::PI * 0.015_f64.powi(3) * 1000.0;
    let mut turned = inverted(ball());
    nodes(&mut turned).extend([0, 0, 1]);
    for cells in ["tets", "hexes", "immersed-hexes"] {
        let workshop = with_surface(&turned);
        let mesh = format!("edge = 0.004, as = \"{cells}\", clean = {{ keep-largest = true }}");
        workshop.write("case/scene.toml", scene(&mesh, "", "explicit"));
        let ran = workshop.run(&[]);
        let json = ran.done();
        assert!(close(&json["mass"], exact, if cells == "hexes" { 0.08 } else { 0.02 }), "{json}");
        assert!(ran.words().contains("ball.stl: mended: "), "{}", ran.err);
        let again = workshop.run(&[]);
        assert!(again.words().contains("mesh of ball.stl: from the cache"), "{}", again.err);
    }
    let workshop = with_surface(&turned);
    let wall = "model = \"shell\"\nthickness = 1e-3\n";
    workshop.write("case/scene.toml", scene("shells = 80, as = \"shells\"", wall, "implicit"));
    let output = workshop.check(&[]);
    assert!(
        output.status() == "checked" && output.out.contains("its interior, 80 shells"),
        "{}{}",
        output.out,
        output.err
    );
    let ran = workshop.run(&[]);
    ran.done();
    assert!(ran.words().contains("`organ` is curved by the normals of its mesh"), "{}", ran.err);
    for (mesh, says) in [
        ("edge = 0.004", "a mesh file has its own cells"),
        ("as = \"tets\"", "tets of an image or a surface need `edge`"),
        ("as = \"tets\", edge = 0.004, fix = \"merge\"", "`fix` repairs the cells of a mesh file"),
        ("as = \"tets\", edge = 0.004, label = 3", "`label` is for images"),
        ("as = \"tets\", edge = 0.1e-3", "cells"),
    ] {
        workshop.write("case/scene.toml", scene(mesh, "", "explicit"));
        let output = workshop.check(&[]);
        assert!(output.status() == "invalid" && output.words().contains(says), "{mesh}: {}", output.err);
    }
    let mut open = ball();
    nodes(&mut open).drain(..1200);
    io::write(&workshop.path("case/ball.stl"), &open).unwrap();
    workshop.write("case/scene.toml", scene("as = \"tets\", edge = 0.002", "", "explicit"));
    let output = workshop.check(&[]);
    assert!(output.status() == "invalid" && output.words().contains("hole"), "{}", output.err);
}
