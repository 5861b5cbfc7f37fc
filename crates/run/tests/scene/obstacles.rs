//! Obstacles and tools from mesh files and images: balls in bowls, a brain in its skull, the cache, and
//! refusals.

use std::path::Path;

use pliant_geometry::{CellKind, Mesh, Vector3, io};
use pliant_meshing::{DEFAULT_CELL_LIMIT, sphere};
use pliant_scene::{MeshCache, World};
use pliant_testing::Random;
use pliant_testing::scenes::{last_row, resumes, scene, world};

/// A soft ball of radius 20 mm that falls into a bowl, which is the inside of a ball of radius 50 mm.
fn bowl(shape: &str, more: &str) -> String {
    format!(
        "[scene]\nuntil = 1\ngravity = [0, 0, -9.81]\n[run]\n\
         [law.tissue]\ntype = 'neo-hookean'\nyoung-modulus = 2e4\npoisson-ratio = 0.4\n\
         [body.ball]\nmesh = {{ ellipsoid = {{ radii = [0.02, 0.02, 0.02] }}, edge = 0.01 }}\n\
         law = 'tissue'\ndensity = 1000\ndamping = 20\n\
         [obstacle.bowl]\nshape = {shape}\nat = [0.015, 0, 0.024]\ninside = true\n\
         [contact.falls]\nbetween = ['ball', 'bowl']\nfriction = 0\n\
         [output.history]\ntype = 'csv'\nevery = 1\nprobes.middle = {{ on = 'ball', at = [0, 0, 0] }}\n{more}"
    )
}

/// The surface of a ball of this radius [m] in a file.
fn ball_file(folder: &Path, name: &str, radius: f64) -> String {
    let path = folder.join(name);
    io::write(&path, &sphere(radius, 5, DEFAULT_CELL_LIMIT).unwrap()).unwrap();
    path.display().to_string()
}

/// Displacement of the ball at the end, sideways and downward [m], and the force on the bowl [N].
fn rest(text: &str) -> [f64; 3] {
    let row = last_row(text);
    ["probe.middle.displacement.x", "probe.middle.displacement.z", "contact.falls.z"].map(|key| row[key])
}

/// Facets of the bowl lie up to 60 µm within it, and its grid is right to about 1 µm. The ball rests as high
/// and as far sideways.
#[test]
fn a_ball_in_a_bowl_of_triangles_rests_as_in_a_round_one() {
    let folder = tempfile::tempdir().unwrap();
    let round = bowl("{ sphere = { radius = 0.05 } }", "");
    let exact = rest(&round);
    let weight = 9.81 * world(&round).unwrap().participants[0].built.model.mass.iter().sum::<f64>();
    assert!((-exact[2] / weight - 1.0).abs() < 0.01, "{exact:?}, {weight} N");
    let whole = ball_file(folder.path(), "bowl.stl", 0.05);
    let smaller = ball_file(folder.path(), "smaller.obj", 0.045);
    let larger = ball_file(folder.path(), "larger.ply", 0.06);
    for (file, grow) in [(&whole, 0.0), (&smaller, 0.005), (&larger, -0.01)] {
        let found = rest(&bowl(&format!("{{ mesh = {{ file = '{file}', grow = {grow} }} }}"), ""));
        println!("{file}, grown by {grow} m: {found:?}, in a round one {exact:?}");
        assert!((0..2).all(|k| (found[k] - exact[k]).abs() < 1e-4), "{found:?}, {exact:?}");
        assert!((found[2] / exact[2] - 1.0).abs() < 0.01, "{found:?}, {exact:?}");
    }
}

/// A bowl in millimetres, turned and shifted in its frame, is put in place by the scene and gives the same
/// result.
#[test]
fn a_shape_from_a_file_stands_where_the_scene_puts_it() {
    let folder = tempfile::tempdir().unwrap();
    let mut shifted = sphere(50.0, 5, DEFAULT_CELL_LIMIT).unwrap();
    shifted.points.iter_mut().for_each(|point| point.x += 30.0);
    let path = folder.path().join("shifted.stl");
    io::write(&path, &shifted).unwrap();
    let text = bowl(&format!("{{ mesh = {{ file = '{}', scale = 0.001 }} }}", path.display()), "");
    // The middle of the ball comes to (0, 0.03, 0) in a frame turned by a right angle about z.
    let text = text
        .replace("at = [0.015, 0, 0.024]", "at = [0.015, -0.03, 0.024]\nturn = [0, 0, 1.5707963267948966]");
    let (found, exact) = (rest(&text), rest(&bowl("{ sphere = { radius = 0.05 } }", "")));
    assert!((0..2).all(|k| (found[k] - exact[k]).abs() < 1e-4), "{found:?}, {exact:?}");
}

/// Voxels of 2 mm that are inside a ball of 50 mm, as an image in NRRD.
fn image_file(folder: &Path) -> String {
    const SIDE: usize = 61;
    let mut bytes = format!(
        "NRRD0004\ntype: uint8\ndimension: 3\nspace: right-anterior-superior\nsizes: {SIDE} {SIDE} {SIDE}\n\
         space directions: (2,0,0) (0,2,0) (0,0,2)\nspace origin: (-60,-60,-60)\nencoding: raw\n\n"
    )
    .into_bytes();
    let along = |at: usize| 2.0 * at as f64 - 60.0;
    for at in 0..SIDE * SIDE * SIDE {
        let [x, y, z] = [at % SIDE, at / SIDE % SIDE, at / SIDE / SIDE].map(along);
        bytes.push(if x.hypot(y).hypot(z) < 50.0 { 7 } else { 0 });
    }
    let path = folder.join("bowl.nrrd");
    std::fs::write(&path, bytes).unwrap();
    path.display().to_string()
}

/// A ball of voxels of 2 mm has the surface of a ball: to half a voxel at worst, to a tenth on average.
#[test]
fn a_bowl_may_come_from_an_image() {
    let folder = tempfile::tempdir().unwrap();
    let file = image_file(folder.path());
    for cut in ["label = 7", "threshold = 3.5", "label = 7, grow = 0.003"] {
        let world = world(&bowl(&format!("{{ image = {{ file = '{file}', {cut} }} }}"), "")).unwrap();
        let shape = &world.participants[0].built.contacts.as_ref().unwrap().rigids[0].shape;
        let radius = if cut.contains("grow") { 0.053 } else { 0.05 };
        let mut random = Random::new(11);
        let off = (0..1000).map(|_| {
            let way = Vector3::from(random.vector()).normalize();
            shape.near(&(radius * way)).distance
        });
        let off: Vec<f64> = off.collect();
        let most = off.iter().fold(0.0_f64, |most, off| most.max(off.abs()));
        let mean = off.iter().sum::<f64>() / 1000.0;
        println!("{cut}: off by {most:.1e} m at most, {mean:.1e} m as a mean");
        assert!(most < 0.001 && mean.abs() < 0.0002, "{cut}: {most}, {mean}");
    }
}

/// The second world reads distances from the cache, another `grow` makes others, and results are the same
/// bits.
#[test]
fn distances_are_made_once() {
    let folder = tempfile::tempdir().unwrap();
    let cache = MeshCache::in_folder(folder.path().join("cache"));
    let file = ball_file(folder.path(), "bowl.stl", 0.045);
    let built = |grow: f64| {
        let text = bowl(&format!("{{ mesh = {{ file = '{file}', grow = {grow} }} }}"), "");
        let world = World::assemble(&scene(&text).unwrap(), &cache, &|_| ()).unwrap();
        let built = &world.participants[0].built;
        let note = built.notes.iter().find(|note| note.contains("distances to the surface")).unwrap();
        (note.clone(), format!("{:?}", built.contacts.as_ref().unwrap().rigids))
    };
    let (first, made) = built(0.005);
    let (second, kept) = built(0.005);
    assert!(first.contains("made and stored in the cache") && first.contains("MiB"), "{first}");
    assert!(second.contains("from the cache"), "{second}");
    assert_eq!(made, kept);
    let (third, other) = built(0.006);
    assert!(third.contains("made and stored"), "{third}");
    assert_ne!(made, other);
}

#[test]
fn a_run_in_a_mesh_goes_on_in_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let file = ball_file(folder.path(), "bowl.stl", 0.05);
    let text = bowl(&format!("{{ mesh = {{ file = '{file}' }} }}"), "");
    let text = text.replace("[run]\n", "[run]\nstep = 2e-4\ncheckpoint = { every = 0.2 }\n");
    resumes(&text);
}

/// The surface that is drawn is the grown one, to a part of the grid.
#[test]
fn a_grown_shape_is_drawn_where_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let file = ball_file(folder.path(), "bowl.stl", 0.05);
    let world = world(&bowl(&format!("{{ mesh = {{ file = '{file}', grow = 0.004 }} }}"), "")).unwrap();
    let shape = &world.participants[0].built.contacts.as_ref().unwrap().rigids[0].shape;
    let (points, triangles) = shape.surface(1.0);
    assert!(triangles.len() > 1000 && triangles.len() <= 20_000, "{}", triangles.len());
    for point in &points {
        assert!((point.norm() - 0.054).abs() < 2e-4, "{point}");
    }
    assert!((shape.reach() - 0.054).abs() < 1e-3 && (shape.thinnest() - 0.054).abs() < 2e-3, "{shape:?}");
}

#[test]
fn shapes_that_cannot_be_are_refused_with_their_line() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, mesh: &Mesh| {
        let path = folder.path().join(name);
        io::write(&path, mesh).unwrap();
        path.display().to_string()
    };
    let ball = sphere(0.05, 3, DEFAULT_CELL_LIMIT).unwrap();
    let mut open = ball.clone();
    open.block_mut(CellKind::Triangle).nodes.drain(..3);
    let mut points = ball.clone();
    points.points.iter_mut().for_each(|point| *point *= 0.0);
    let mut lines = Mesh { points: ball.points.clone(), ..Mesh::default() };
    lines.block_mut(CellKind::Line).nodes.extend([0, 1]);
    let text = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    let nan = text("nan.obj", "v 0 0 0\nv 1 0 nan\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n");
    let corners = "v 0 0 0\nv 0.1 0 0\nv 0.1 0.1 0\nv 0 0.1 0\n";
    let flat = text("flat.obj", &format!("{corners}f 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n"));
    let mut large = ball.clone();
    large.points.iter_mut().for_each(|point| *point *= 1000.0);
    let image = image_file(folder.path());
    let whole = file("ball.stl", &ball);
    let mesh = |file: &str, more: &str| format!("{{ mesh = {{ file = '{file}'{more} }} }}");
    for (shape, pieces) in [
        (mesh("none.stl", ""), ["none.stl", "file names are relative to the scene file"]),
        (
            mesh(&file("open.stl", &open), ""),
            ["the surface is open: 1 hole with 3 border edges", "close the surface"],
        ),
        (mesh(&flat, ""), ["encloses nothing", "give a surface around a volume"]),
        (mesh(&file("points.vtu", &points), ""), ["no surface", "triangles, quads, tets or hexes"]),
        (mesh(&file("lines.vtu", &lines), ""), ["no surface", "triangles, quads, tets or hexes"]),
        (mesh(&nan, ""), ["point 2 is not finite (1, 0, NaN)", "repair the mesh"]),
        (mesh(&file("large.stl", &large), ""), ["larger than any organ", "`scale = 0.001`"]),
        (
            mesh(&whole, ", resolution = 0"),
            ["`obstacle.bowl.shape.mesh.resolution` must be greater than 0", ""],
        ),
        (
            mesh(&whole, ", resolution = 1e-5"),
            ["MiB, more than 256 MiB", "or leave it out: Pliant then chooses a grid"],
        ),
        (mesh(&whole, ", grow = -0.06"), ["encloses nothing", "inward by more than its thickness"]),
        (mesh(&whole, ", grown = 1"), ["`grown`", "`grow`"]),
        (format!("{{ image = {{ file = '{image}', label = 3 }} }}"), ["3", "7"]),
        ("{ image = { file = 'none.nii', label = 1 } }".into(), ["none.nii", "relative to the scene file"]),
    ] {
        let text = bowl(&shape, "");
        let message = world(&text).err().unwrap_or_else(|| panic!("accepted: {shape}"));
        assert!(pieces.iter().all(|piece| message.contains(piece)), "{shape}: {message}");
    }
}

/// A shape a thousand times larger than the bodies is no mistake, but it is asked about; so is the user's
/// line.
#[test]
fn a_shape_much_larger_than_the_bodies_is_doubted() {
    let folder = tempfile::tempdir().unwrap();
    let file = ball_file(folder.path(), "bowl.stl", 50.0);
    let text = bowl(&format!("{{ mesh = {{ file = '{file}', scale = 1 }} }}"), "");
    let world = world(&text).unwrap();
    let doubts = &world.participants[0].built.warnings;
    let doubt = doubts.iter().find(|doubt| doubt.message.contains("`bowl`")).unwrap();
    assert!(doubt.message.contains("times the size of the bodies"), "{}", doubt.message);
    assert!(doubt.help.iter().any(|help| help.contains("0.001")), "{:?}", doubt.help);
}

/// A warning names each thing that no contact names.
#[test]
fn things_that_nothing_touches_are_warned_of() {
    let needle = "[tool.needle]\nshape = { sphere = { radius = 0.01 } }\nat = [0, 0, 1]\n";
    let warnings = |text: &str| world(text).unwrap().warnings().map(ToString::to_string).collect::<Vec<_>>();
    let text = bowl("{ sphere = { radius = 0.05 } }", needle);
    let found = warnings(&text);
    assert!(found.len() == 1 && found[0].contains("tool `needle` is in no contact"), "{found:?}");
    let text = text.replace("['ball', 'bowl']", "['ball', 'needle']");
    let found = warnings(&text);
    assert!(found.len() == 1 && found[0].contains("obstacle `bowl` is in no contact"), "{found:?}");
    assert_eq!(warnings(&text.replace("'needle']", "'all']")), Vec::<String>::new());
}
