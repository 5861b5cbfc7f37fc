//! The distance that bodies keep in explicit contact, and the count of intersections.

use std::fs;
use std::path::Path;

use pliant_geometry::{CellKind, Mesh, io};
use pliant_testing::pieces::erleben;
use pliant_testing::scenes::{last_row, run, world};

use super::contact::{pressed, stacked};

/// Without `thickness` bodies keep 0.5 % of their mean edge, and things nothing; `thickness = 0` is no
/// distance. A note has it.
#[test]
fn bodies_keep_a_distance_if_none_is_given() {
    let itself = "[contact.itself]\nbetween = ['lid', 'lid']\n";
    let usual = stacked("", itself).replace("thickness = 0\n", "");
    let offsets = |text: &str| {
        let built = &world(text).unwrap();
        let contacts = built.only().unwrap().built.contacts.clone().unwrap();
        let one =
            |name: &str| contacts.contacts.iter().find(|contact| contact.name == name).unwrap().touch.offset;
        ["below", "above", "itself"].map(one)
    };
    let [floor, between, itself] = offsets(&usual);
    assert_eq!(floor, 0.0);
    assert!((2e-5..8e-5).contains(&between) && (2e-5..8e-5).contains(&itself), "{between} {itself}");
    let known = world(&usual).unwrap();
    for name in ["above", "itself"] {
        let note = format!("contact `{name}`: surfaces keep ");
        let note = known.notes().find(|text| text.starts_with(&note)).unwrap();
        assert!(note.contains("0.5 % of their mean edge, because `thickness` is not given"), "{note}");
    }
    assert!(!known.notes().any(|note| note.contains("contact `below`")));
    assert_eq!(offsets(&usual.replace("friction = 0.3\n", "friction = 0.3\nthickness = 0\n"))[1], 0.0);
    let [row, touching] = [&usual, &stacked("", "")].map(|text| last_row(text));
    let lies = |row: &std::collections::BTreeMap<String, f64>| row["probe.top.displacement.z"];
    println!("the lid lies {} m higher", lies(&row) - lies(&touching));
    assert!((lies(&row) - lies(&touching) - between).abs() < 1e-5, "{} {}", lies(&row), lies(&touching));
    assert!((row["contact.above.z"] / touching["contact.above.z"] - 1.0).abs() < 0.01);
}

/// A lid that begins 0.5 mm above a block and is to keep 1 mm keeps 0.5 mm: it is neither refused nor thrown
/// off.
#[test]
fn what_is_nearer_at_the_start_keeps_its_distance() {
    let text = stacked("", "").replace("thickness = 0\n", "thickness = 0.001\n");
    let note = world(&text).unwrap();
    let note =
        note.notes().find(|note| note.contains("nearer at the start than 0.001000 m")).unwrap().clone();
    assert!(note.contains("contact `above`: ") && note.contains("keep the distance of the start"), "{note}");
    let [row, touching] = [&text, &stacked("", "")].map(|text| last_row(text));
    let [higher, other] = [&row, &touching].map(|row| row["probe.top.displacement.z"]);
    println!("{note}; the lid lies {} m higher", higher - other);
    assert!((higher - other - 5e-4).abs() < 2e-5, "{higher} {other}");
    let first = text
        .replace("until = 1.0", "until = 0.002")
        .replace("gravity = [1, 0, -9.81]", "gravity = [0, 0, 0]");
    let row = last_row(&first);
    assert!(row["probe.top.displacement.z"].abs() < 1e-12 && row["energy.kinetic"] < 1e-20, "{row:?}");
}

/// Writes the pieces of a scene: the held pieces as one body `b0`, the others as `b1`. Returns the held nodes
/// of `b0`.
fn write_crack(folder: &Path) -> Vec<u32> {
    let scene = erleben().into_iter().find(|scene| scene.name == "wedge in a crack").unwrap();
    let mut held = Vec::new();
    let mut meshes = [Mesh::default(), Mesh::default()];
    for piece in &scene.pieces {
        let mesh = &mut meshes[usize::from(piece.velocity.is_some())];
        let made = piece.tets(mesh.points.len() as u32);
        mesh.points.extend(made.points.iter().map(|&x| pliant_geometry::Vector3::from(x)));
        mesh.block_mut(CellKind::Tet).nodes.extend(made.tets.iter().flatten());
        held.extend(if piece.velocity.is_none() { made.far } else { Vec::new() });
    }
    for (name, mesh) in ["b0", "b1"].into_iter().zip(&meshes) {
        io::write(&folder.join(format!("{name}.vtu")), mesh).unwrap();
    }
    held
}

/// A wedge that falls into a crack (Erleben 2018) intersects its sides without a contact distance, and does
/// not with the usual one. Intersections deeper than 1e-4 of the mean edge are counted, and end no run.
#[test]
fn intersections_are_counted() {
    let place = tempfile::tempdir().unwrap();
    let held = write_crack(place.path());
    let file = |name: &str| place.path().join(name).display().to_string();
    let text = |more: &str| {
        format!(
            "[scene]\nuntil = 0.4\ngravity = [0, 0, -9.81]\n[run]\nthreads = 1\n\
             [law.soft]\ntype = 'neo-hookean'\nyoung-modulus = 2e4\npoisson-ratio = 0.4\n\
             [body.b0]\nmesh = {{ file = '{}' }}\nelement = 'tet4'\nlaw = 'soft'\ndensity = 1000\ndamping = 2\n\
             [constraint.b0]\ntype = 'fix'\nbody = 'b0'\nnodes = {{ ids = {held:?} }}\n\
             [body.b1]\nmesh = {{ file = '{}' }}\nelement = 'tet4'\nlaw = 'soft'\ndensity = 1000\ndamping = 2\n\
             velocity = [0, 0, -0.3]\n\
             [contact.crack]\nbetween = ['b0', 'b1']\nfriction = 0.3\n{more}\n\
             [output.fields]\ntype = 'vtu'\nevery = 0.005\ndata = ['displacement']\n",
            file("b0.vtu"),
            file("b1.vtu")
        )
    };
    let found = |more: &str| {
        let out = place.path().join("out");
        let summary = run(&text(more), &out);
        fs::remove_dir_all(&out).unwrap();
        assert_eq!(summary.status, "done");
        summary
    };
    let usual = found("check-intersections = true");
    let counted = usual.intersections.unwrap();
    println!("{counted:?}");
    assert!(counted.deepest < 1e-4, "{counted:?}");
    let summary = found("check-intersections = true\nthickness = 0");
    let counted = summary.intersections.unwrap();
    println!("{counted:?}");
    assert_eq!(counted.searched, 81);
    assert!(counted.count > 0 && counted.states > 0 && counted.deepest > 0.0, "{counted:?}");
    assert_eq!(counted.contact, "crack");
    let warning = summary.warnings.iter().find(|text| text.contains("of edges with triangles in")).unwrap();
    assert!(warning.starts_with("contact `crack`: ") && warning.contains("larger `thickness`"), "{warning}");
    assert!(found("").intersections.is_none());
    // Without an output the last state is searched.
    let silent = text("check-intersections = true\nthickness = 0");
    let silent = silent.split("[output.fields]").next().unwrap();
    let counted = run(silent, &place.path().join("silent")).intersections.unwrap();
    assert_eq!(counted.searched, 1, "{counted:?}");
}

#[test]
fn keys_of_the_check_that_do_not_fit_are_refused_with_their_line() {
    let with = |to: &str| pressed("", "").replace("friction = 0.2\n", &format!("friction = 0.2\n{to}\n"));
    for (text, pieces) in [
        (
            with("check-intersections = true"),
            ["`check-intersections` is for bodies that touch each other", "leave it out"],
        ),
        (with("check-intersections = 1"), ["`contact.above.check-intersections`", ""]),
        (with("check-intersection = true"), ["check-intersection", "check-intersections"]),
        (with("thickness = -1e-3"), ["`contact.above.thickness` must be at least 0", ""]),
        (with("thickness = 'thin'"), ["`contact.above.thickness`", ""]),
    ] {
        crate::assert_refused(&text, &pieces);
    }
}

#[test]
fn damping_by_stiffness_that_cannot_be_is_refused_with_its_line() {
    let damped = |value: &str| {
        stacked("", "").replacen("damping = 60\n", &format!("damping = 60\nstiffness-damping = {value}\n"), 1)
    };
    let relaxed = |text: &str| text.replace("[run]\n", "[run]\nsolver = 'quasi-static'\n");
    for (text, pieces) in [
        (damped("-1e-4"), ["`body.block.stiffness-damping` must be at least 0", ""]),
        (damped("'little'"), ["`body.block.stiffness-damping`", ""]),
        (
            damped("1e-4").replace("stiffness-damping", "stiffnes-damping"),
            ["stiffnes-damping", "stiffness-damping"],
        ),
        (damped("1e-4"), ["`lid` and `block` have different `stiffness-damping`", "share one value"]),
        (
            relaxed(&stacked("", "").replace("damping = 60\n", "damping = 60\nstiffness-damping = 1e-4\n")),
            [
                "damping by stiffness needs the solver `explicit` or `implicit`, not `quasi-static`",
                "leave it out",
            ],
        ),
    ] {
        crate::assert_refused(&text, &pieces);
    }
}
