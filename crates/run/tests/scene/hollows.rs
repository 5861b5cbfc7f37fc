//! Bodies in things that are hollow and have corners: what touches two sides at once is pushed by both.

use std::path::Path;

use pliant_geometry::{CellKind, Mesh, Vector3, io};
use pliant_testing::scenes::last_row;

/// A block of 60 mm on the floor of a hollow thing; gravity draws it into the wall at its side.
fn block(shape: &str, until: f64) -> String {
    format!(
        "[scene]\nuntil = {until}\ngravity = [6, 0, -9.81]\n[run]\nsolver = 'implicit'\nstep = 5e-3\n\
         [law.tissue]\ntype = 'neo-hookean'\nyoung-modulus = 2e4\npoisson-ratio = 0.4\n\
         [body.block]\nmesh = {{ block = {{ size = [0.06, 0.06, 0.06] }}, edge = 0.03, at = [0.03, 0.03, 0.002] }}\n\
         law = 'tissue'\ndensity = 1000\n\
         [obstacle.hollow]\nshape = {shape}\nat = [0.06, 0.06, 0.1]\ninside = true\n\
         [contact.rests]\nbetween = ['block', 'hollow']\nfriction = 0.1\nbarrier-distance = 1e-3\n\
         [output.history]\ntype = 'csv'\nevery = {until}\n"
    )
}

/// The surface of a box with edges of this length [m] around the origin, as a file.
fn box_file(folder: &Path, edge: f64) -> String {
    let corner = |k: usize| Vector3::from_fn(|c, _| (f64::from((k >> c & 1) as u8) - 0.5) * edge);
    let mut mesh = Mesh { points: (0..8).map(corner).collect(), ..Mesh::default() };
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    mesh.block_mut(CellKind::Triangle).nodes =
        sides.iter().flat_map(|&[a, b, c, d]| [a, b, c, a, c, d]).collect();
    let path = folder.join(format!("box-{edge}.stl"));
    io::write(&path, &mesh).unwrap();
    path.display().to_string()
}

/// Its weight and what draws it aside [N].
const PULL: [f64; 2] = [0.06 * 0.06 * 0.06 * 1000.0 * 6.0, 0.06 * 0.06 * 0.06 * 1000.0 * 9.81];

/// If the lower edge lies on floor and wall, both push: together they hold the block against both components
/// of gravity.
#[test]
fn a_block_slides_into_the_corner_of_a_hollow() {
    let folder = tempfile::tempdir().unwrap();
    let file = box_file(folder.path(), 0.2);
    let shapes = [
        "{ box = { size = [0.2, 0.2, 0.2] } }".to_owned(),
        "{ cylinder = { radius = 0.1, length = 0.2 } }".to_owned(),
        format!("{{ mesh = {{ file = '{file}' }} }}"),
        format!("{{ mesh = {{ file = '{}', grow = 0.01 }} }}", box_file(folder.path(), 0.18)),
    ];
    for shape in shapes {
        let text = block(&shape, 2.0);
        let row = last_row(&text);
        let force = ["contact.rests.x", "contact.rests.z"].map(|key| row[key]);
        println!("{shape}: {force:?} N of {PULL:?} N");
        assert!(
            (force[0] / PULL[0] - 1.0).abs() < 0.03 && (-force[1] / PULL[1] - 1.0).abs() < 0.03,
            "{shape}: {force:?}"
        );
    }
}
