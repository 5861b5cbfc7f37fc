//! Faces of solids joined by mortar rows: patch tests in either order, planes of symmetry through the joint,
//! curved joints, and refusals.

use std::collections::BTreeMap;
use std::path::Path;

use pliant_geometry::{CellKind, Mesh, Vector3, io};
use pliant_meshing::{Block, Resolution, VolumeCell};
use pliant_testing::Random;
use pliant_testing::scenes::{last_row_in, resumes, run, world};

/// Edge of the blocks [m].
const SIZE: f64 = 0.02;

/// A cube with a number of cells along each edge above a height [m]. Its points are moved by up to a fifth of
/// a cell along the sides that they are on.
fn cube(cells: usize, kind: VolumeCell, height: f64, seed: u64) -> Mesh {
    let mut mesh = Block::new([SIZE; 3]).mesh(Resolution::Counts([cells; 3]), kind, usize::MAX).unwrap();
    let mut random = Random::new(seed);
    for point in &mut mesh.points {
        for c in 0..3 {
            let by = 0.2 * SIZE / cells as f64 * random.number();
            if point[c] > 1e-9 && point[c] < SIZE - 1e-9 {
                point[c] += by;
            }
        }
        point.z += height;
    }
    mesh
}

/// The nodes on a plane across an axis.
fn plane(axis: usize, at: f64) -> String {
    let (mut point, mut normal) = ([0.0; 3], [0.0; 3]);
    (point[axis], normal[axis]) = (at, 1.0);
    format!("{{ plane = {{ point = {point:?}, normal = {normal:?} }} }}")
}

/// Two blocks on top of each other, each with its cells and element.
fn blocks_of(place: &Path, solver: &str, blocks: [(usize, &str); 2], more: &str) -> String {
    let mut text = format!("[scene]\nuntil = 1\n[run]\n{solver}\n");
    for (name, (cells, element), height) in [("a", blocks[0], 0.0), ("b", blocks[1], SIZE)] {
        let kind = if element.starts_with("tet") { VolumeCell::Tet } else { VolumeCell::Hex };
        let file = place.join(format!("{name}.vtu"));
        io::write(&file, &cube(cells, kind, height, cells as u64)).unwrap();
        text += &format!(
            "[law.{name}]\ntype = 'neo-hookean'\nyoung-modulus = 1e4\npoisson-ratio = 0.3\n\
             [body.{name}]\nmesh = {{ file = '{}' }}\nelement = '{element}'\nlaw = '{name}'\ndensity = 1000\n{more}\n",
            file.display()
        );
    }
    text
}

/// The planes x = 0 and y = 0 of a body as planes of symmetry.
fn symmetric(body: &str) -> String {
    let side = |(axis, component): (usize, &str)| {
        format!(
            "[constraint.{body}{component}]\ntype = 'fix'\nbody = '{body}'\nnodes = {}\ncomponents = ['{component}']\n",
            plane(axis, 0.0)
        )
    };
    [(0, "x"), (1, "y")].map(side).concat()
}

/// These blocks squeezed by 2 %, the first named following the second, with planes of symmetry through the
/// joint; the other sides are free.
fn stacked(place: &Path, solver: &str, blocks: [(usize, &str); 2], order: [&str; 2], more: &str) -> String {
    let [a, b] = ["a", "b"].map(symmetric);
    blocks_of(place, solver, blocks, more)
        + &format!(
            "{a}{b}[tie.t]\nbetween = {order:?}\n\
             [constraint.base]\ntype = 'fix'\nbody = 'a'\nnodes = {}\ncomponents = ['z']\n\
             [constraint.top]\ntype = 'move'\nbody = 'b'\nnodes = {}\ncomponents = ['z']\nby = [0, 0, -0.0008]\nto = 1\n\
             [output.all]\ntype = 'vtu'\nevery = 1\ndata = ['displacement', 'cauchy-stress']\n\
             [output.history]\ntype = 'csv'\nevery = 1\n",
            plane(2, 0.0),
            plane(2, 2.0 * SIZE)
        )
}

/// Places, displacements [m] and the normal stress along z [Pa] at the end of a run, and the last row of its
/// table.
struct Ended {
    moved: Vec<[[f64; 3]; 2]>,
    stress: Vec<f64>,
    row: BTreeMap<String, f64>,
}

fn ended(text: &str) -> Ended {
    let out = tempfile::tempdir().unwrap();
    run(text, out.path());
    let files = std::fs::read_dir(out.path().join("all")).unwrap().map(|entry| entry.unwrap().path());
    let frame = io::read(&files.max().unwrap()).unwrap().mesh;
    let item = |at: usize| frame.point_data["displacement"].item(at).try_into().unwrap();
    let moved = frame.points.iter().enumerate().map(|(at, &x)| [x.into(), item(at)]).collect();
    let stress = frame.volume_blocks().filter_map(|block| block.data.get("cauchy-stress"));
    let along = |array: &pliant_geometry::DataArray| {
        let z = if array.components == 6 { 2 } else { 8 };
        (0..array.len()).map(|cell| array.item(cell)[z]).collect::<Vec<_>>()
    };
    Ended { moved, stress: stress.flat_map(along).collect(), row: last_row_in(out.path()) }
}

/// Returns the largest difference of displacements from a uniform strain over the largest displacement, and
/// the largest difference of stresses from their mean.
fn uneven(ended: &Ended) -> [f64; 2] {
    let far = ended
        .moved
        .iter()
        .find(|[x, _]| x[0] > SIZE - 1e-9 && x[1] > SIZE - 1e-9 && x[2] > 2.0 * SIZE - 1e-9);
    let [x, u] = far.unwrap();
    let strain = [0, 1, 2].map(|c| u[c] / x[c]);
    assert!((strain[2] + 0.02).abs() < 1e-12 && strain[0] > 0.004, "{strain:?}");
    let off = ended.moved.iter().flat_map(|[x, u]| [0, 1, 2].map(|c| (u[c] - strain[c] * x[c]).abs()));
    let mean = ended.stress.iter().sum::<f64>() / ended.stress.len() as f64;
    let apart = ended.stress.iter().map(|s| (s / mean - 1.0).abs());
    [off.fold(0.0, f64::max) / 0.0008, apart.fold(0.0, f64::max)]
}

const PAIRS: [[(usize, &str); 2]; 5] = [
    [(3, "hex8-full"), (5, "hex8-full")],
    [(4, "tet4"), (3, "hex8-full")],
    [(2, "hex8"), (5, "tet4")],
    [(3, "tet4-anp"), (4, "tet4-anp")],
    [(1, "hex8-full"), (4, "tet4-anp")],
];

/// The patch test: crooked hexes and tets, in either order.
#[test]
fn a_constant_stress_passes_in_either_order() {
    let place = tempfile::tempdir().unwrap();
    let solver = "solver = 'static'\nload-steps = 1\ntolerance = 1e-13";
    for blocks in PAIRS {
        for order in [["a", "b"], ["b", "a"]] {
            let found = ended(&stacked(place.path(), solver, blocks, order, ""));
            let [moved, stress] = uneven(&found);
            println!("{blocks:?} {order:?}: displacements {moved:.1e}, stress {stress:.1e}");
            assert!(moved < 1e-10 && stress < 1e-10, "{blocks:?} {order:?}: {moved:e} {stress:e}");
            let sum = found.row["reaction.base.z"] + found.row["reaction.top.z"];
            assert!(sum.abs() < 1e-10 * found.row["reaction.top.z"].abs(), "{sum:e}");
        }
    }
}

/// Dynamic relaxation and rest after damped motions pass the patch test, too.
#[test]
fn every_solver_passes_it() {
    let place = tempfile::tempdir().unwrap();
    for (solver, until, limit) in [
        ("solver = 'quasi-static'\nload-steps = 1\ntolerance = 1e-12", 1, 1e-9),
        ("solver = 'explicit'", 3, 1e-8),
        ("solver = 'implicit'\nstep = 0.05\ntolerance = 1e-12", 3, 1e-8),
    ] {
        for (blocks, order) in [(PAIRS[0], ["a", "b"]), (PAIRS[1], ["a", "b"]), (PAIRS[3], ["b", "a"])] {
            let damping = if until == 1 { "" } else { "damping = 60" };
            let text = stacked(place.path(), solver, blocks, order, damping)
                .replace("until = 1", &format!("until = {until}"))
                .replace("every = 1", &format!("every = {until}"));
            let [moved, stress] = uneven(&ended(&text));
            println!("{solver} {blocks:?} {order:?}: displacements {moved:.1e}, stress {stress:.1e}");
            assert!(moved < limit && stress < limit, "{solver} {blocks:?}: {moved:e} {stress:e}");
        }
    }
}

/// Ties of points on the same blocks fail the patch test: the order with the coarser block first is flagged.
#[test]
fn points_do_not_pass_it_and_say_so() {
    let place = tempfile::tempdir().unwrap();
    let solver = "solver = 'static'\nload-steps = 1\ntolerance = 1e-13";
    for order in [["a", "b"], ["b", "a"]] {
        let text = stacked(place.path(), solver, PAIRS[0], order, "")
            .replace("[tie.t]", "[tie.t]\nmethod = 'points'");
        let [_, stress] = uneven(&ended(&text));
        assert!(stress > 0.02, "{order:?}: {stress}");
        let warned: Vec<String> = world(&text).unwrap().warnings().map(ToString::to_string).collect();
        let coarse_first = order == ["a", "b"];
        let says = warned
            .iter()
            .any(|message| message.contains("`a` is coarser than `b`") && message.contains("stay free"));
        assert_eq!(says, coarse_first, "{warned:?}");
    }
}

#[cfg(feature = "gpu")]
#[test]
fn joined_faces_move_on_a_device_as_on_the_processor() {
    if !crate::has_gpu() {
        return;
    }
    let place = tempfile::tempdir().unwrap();
    for blocks in [PAIRS[0], PAIRS[1]] {
        let turned = |run: &str| {
            let turn = "rotate = { axis = [1, 2, 0], angle = 0.2, centre = [0.01, 0.01, 0.04] }\nto = 1";
            blocks_of(place.path(), run, blocks, "")
                + &format!(
                    "[tie.t]\nbetween = ['a', 'b']\n\
                     [constraint.base]\ntype = 'fix'\nbody = 'a'\nnodes = {}\n\
                     [constraint.top]\ntype = 'move'\nbody = 'b'\nnodes = {}\n{turn}\n",
                    plane(2, 0.0),
                    plane(2, 2.0 * SIZE)
                )
        };
        // Planes of symmetry through the joint hold tied nodes.
        let squeezed = |run: &str| stacked(place.path(), run, blocks, ["a", "b"], "");
        for text in [&turned as &dyn Fn(&str) -> String, &squeezed] {
            let runs = ["precision = 'double'", "device = 'gpu'", "device = 'gpu'\ndesign = 'float-atomics'"];
            let [cpu, gpu, atomics] = runs.map(|run| world(&text(run)).unwrap());
            super::ties::agrees_on_a_device([&cpu, &gpu], 1.0, "top");
            super::ties::agrees_on_a_device([&cpu, &atomics], 1.0, "top");
        }
        // A load on tied nodes that are held there is part of the reaction, and not given on to the nodes
        // that they follow.
        let press =
            format!("[load.press]\ntype = 'pressure'\non = 'a'\nfaces = {}\npressure = 100\n", plane(0, 0.0));
        let [cpu, gpu] =
            ["precision = 'double'", "device = 'gpu'"].map(|run| world(&(squeezed(run) + &press)).unwrap());
        for constraint in ["ax", "top"] {
            super::ties::agrees_on_a_device([&cpu, &gpu], 1.0, constraint);
        }
    }
}

/// A constraint that holds nodes of the following body alone would tear the joint there: it is refused.
#[test]
fn constraints_of_the_following_body_alone_are_refused() {
    let place = tempfile::tempdir().unwrap();
    let text = stacked(place.path(), "solver = 'static'", PAIRS[0], ["a", "b"], "");
    let message = world(&text.replace(&symmetric("b"), "")).err().unwrap();
    for piece in ["`ax` and `t` both prescribe x", "constrain `b`"] {
        assert!(message.contains(piece), "no {piece} in {message}");
    }
    assert!(world(&text.replace(&symmetric("a"), "")).is_ok());
}

#[test]
fn a_resumed_run_of_joined_faces_ends_in_the_same_bits() {
    let place = tempfile::tempdir().unwrap();
    for solver in ["step = 5e-4", "solver = 'static'\nstep = 0.1", "solver = 'implicit'\nstep = 0.1"] {
        let solver = format!("{solver}\ncheckpoint = {{ every = 0.4 }}");
        resumes(&stacked(place.path(), &solver, PAIRS[1], ["a", "b"], ""));
    }
}

#[test]
fn methods_that_do_not_fit_are_refused_by_name() {
    let place = tempfile::tempdir().unwrap();
    let text = stacked(place.path(), "solver = 'static'", PAIRS[0], ["a", "b"], "");
    let with = |more: &str| text.replace("[tie.t]", &format!("[tie.t]\n{more}"));
    let line = format!("nodes = {{ nearest = {{ point = [0.01, 0.01, {SIZE}], count = 1 }} }}");
    let coat = super::ties::coated("solver = 'static'", "cells = [7, 5]", "");
    let cases = [
        (with("method = 'mortars'"), ["method", "did you mean \"mortar\"?"]),
        (with("method = 3"), ["expected \"mortar\" or \"points\"", "found 3"]),
        (with("methods = 'mortar'"), ["methods", "did you mean `method`?"]),
        (
            with(&format!("method = 'mortar'\n{line}")),
            ["no face of `a` with a tied node", "select whole faces"],
        ),
        (
            coat.replace("[tie.glue]", "[tie.glue]\nmethod = 'mortar'"),
            ["`coat` is a membrane", "take `method = \"points\"`"],
        ),
    ];
    for (text, pieces) in cases {
        crate::assert_refused(&text, &pieces);
    }
    // A selection of a line of nodes is tied as points.
    let notes = world(&with(&line)).unwrap().participants[0].built.notes.clone();
    assert!(notes.iter().any(|note| note.contains("1 node of `a` follows `b`")), "{notes:?}");
    let notes = world(&text).unwrap().participants[0].built.notes.clone();
    assert!(notes.iter().any(|note| note.contains("(mortar)")), "{notes:?}");
}

/// A quarter of a ring of one cell along z, between radii [m], with a number of cells round it and across it.
/// The inner points are moved along it.
fn ring(radii: [f64; 2], [round, across]: [u32; 2], seed: u64) -> Mesh {
    let mut random = Random::new(seed);
    let mut mesh = Mesh::default();
    for k in 0..2 {
        for j in 0..=across {
            for i in 0..=round {
                let inside = i > 0 && i < round;
                let moved = if inside { 0.2 * random.number() } else { 0.0 };
                let angle = std::f64::consts::FRAC_PI_2 * (f64::from(i) + moved) / f64::from(round);
                let radius = radii[0] + (radii[1] - radii[0]) * f64::from(j) / f64::from(across);
                // Sides of the quarter are exactly on the planes.
                let [x, y] =
                    [angle.cos(), angle.sin()].map(|x| if x.abs() < 1e-12 { 0.0 } else { radius * x });
                mesh.points.push(Vector3::new(x, y, 0.002 * f64::from(k)));
            }
        }
    }
    let node = |i, j, k| i + (round + 1) * (j + (across + 1) * k);
    let inside = (0..2).flat_map(|k| (0..=round).map(move |i| node(i, 0, k)));
    mesh.point_sets.insert("inside".into(), inside.collect());
    for (j, i) in (0..across).flat_map(|j| (0..round).map(move |i| (j, i))) {
        let side = |k| [node(i, j, k), node(i, j + 1, k), node(i + 1, j + 1, k), node(i + 1, j, k)];
        mesh.block_mut(CellKind::Hex).nodes.extend(side(0).into_iter().chain(side(1)));
    }
    mesh
}

/// Two rings that are joined at a cylinder, under a small pressure from inside, in plane strain. Against
/// Lamé's solution displacements converge with the square of the edges. Reactions balance the pressure to
/// round-off.
#[test]
fn a_curved_joint_converges_with_the_square_of_the_edges_and_keeps_the_force() {
    const RADII: [f64; 3] = [0.01, 0.015, 0.02];
    let (young, nu, pressure) = (1e4, 0.3, 0.01);
    let lame = |r: f64| {
        let [a, _, b] = RADII;
        let (shear, k) = (young / (2.0 * (1.0 + nu)), pressure * a * a / (b * b - a * a));
        k / (2.0 * shear) * ((1.0 - 2.0 * nu) * r + b * b / r)
    };
    let place = tempfile::tempdir().unwrap();
    for order in [["inner", "outer"], ["outer", "inner"]] {
        let mut errors = Vec::new();
        for n in [4, 8, 16, 32] {
            let mut text =
                "[scene]\nuntil = 1\n[run]\nsolver = 'static'\nload-steps = 1\ntolerance = 1e-12\n"
                    .to_owned();
            text +=
                &format!("[law.l]\ntype = 'neo-hookean'\nyoung-modulus = {young}\npoisson-ratio = {nu}\n");
            for (name, radii, cells) in [
                ("inner", [RADII[0], RADII[1]], [n, n / 2]),
                ("outer", [RADII[1], RADII[2]], [n + n / 2 + 1, n / 2]),
            ] {
                let file = place.path().join(format!("{name}.vtu"));
                io::write(&file, &ring(radii, cells, 5)).unwrap();
                text += &format!(
                    "[body.{name}]\nmesh = {{ file = '{}' }}\nelement = 'hex8-full'\nlaw = 'l'\ndensity = 1000\n",
                    file.display()
                );
                text += &symmetric(name);
                text += &format!(
                    "[constraint.{name}z]\ntype = 'fix'\nbody = '{name}'\nnodes = 'all'\ncomponents = ['z']\n"
                );
            }
            text += &format!(
                "[tie.t]\nbetween = {order:?}\n\
                 [load.p]\ntype = 'pressure'\non = 'inner'\nfaces = {{ set = 'inside' }}\npressure = {pressure}\nto = 1\n\
                 [output.all]\ntype = 'vtu'\nevery = 1\ndata = ['displacement', 'cauchy-stress']\n[output.history]\ntype = 'csv'\nevery = 1\n"
            );
            let notes = world(&text).unwrap().participants[0].built.notes.clone();
            assert!(notes.iter().any(|note| note.contains("(mortar)")), "{notes:?}");
            let Ended { moved, row, .. } = ended(&text);
            let off = moved.iter().map(|[x, u]| {
                let r = x[0].hypot(x[1]);
                (0..2).map(|c| (u[c] - lame(r) * x[c] / r).powi(2)).sum::<f64>()
            });
            errors.push((off.sum::<f64>() / moved.len() as f64).sqrt() / lame(RADII[0]));
            // The resultant of the pressure along an axis is that on the other end of the quarter, whose two
            // nodes differ in place.
            for (c, component) in ["x", "y"].iter().enumerate() {
                let held = row[&format!("reaction.inner{component}.{component}")]
                    + row[&format!("reaction.outer{component}.{component}")];
                let is_end = |x: &[f64; 3]| x[c] == 0.0 && (x[1 - c] - RADII[0]).abs() < 1e-12;
                let ends = moved.iter().filter(|[x, _]| is_end(x)).map(|[x, u]| x[1 - c] + u[1 - c]);
                let wanted = -pressure * 0.001 * ends.sum::<f64>();
                assert!((held / wanted - 1.0).abs() < 1e-10, "{order:?} {n}: {held:e} for {wanted:e}");
            }
        }
        // Meshes are crooked at random, so that the order of one step of refinement scatters.
        let rate = (errors[0] / errors[3]).log2() / 3.0;
        println!("{order:?}: errors {errors:?}, order {rate:.2}");
        assert!(errors[3] < 2e-3 && rate > 1.8, "{errors:?} {rate}");
    }
}
