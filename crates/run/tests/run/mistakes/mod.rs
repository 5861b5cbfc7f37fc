//! Every bad scene that the project promises to reject: the user's own line, the wrong number and a remedy,
//! and nothing written.

mod meshes;

use pliant_testing::scenes::{
    BLOCK, CORNERS, FROM_FILE, TETS, Told, Workshop, assert_input_error, changed, fibres, labels, vtk,
};

/// Asserts that a scene is rejected with these words and with one of these lines underlined, and that the
/// folder does not change.
#[track_caller]
fn assert_refused(workshop: &Workshop, lines: &[&str], says: &[&str]) {
    let output = workshop.run(&[]);
    assert_invalid(&output, says);
    assert!(
        lines.iter().any(|line| output.underlines(line)),
        "none of {lines:?} is underlined:\n{}",
        output.err
    );
    assert!(!workshop.path("out").exists(), "something was written");
}

/// Asserts that a scene was rejected in these words, and that the object of the run says so.
#[track_caller]
fn assert_invalid(output: &Told, says: &[&str]) {
    assert_eq!(output.status(), "invalid", "{}", output.err);
    assert_input_error([&output.err, &output.words()], &output.json(), says);
}

/// [`BLOCK`] with one error is rejected, and the changed lines are shown.
#[track_caller]
fn spoilt(good: &str, bad: &str, says: &[&str]) {
    let scene = changed(BLOCK, good, bad);
    // From the beginning of the first spoilt line to the end of the last one.
    let at = BLOCK.find(good).unwrap();
    let start = scene[..at].rfind('\n').map_or(0, |before| before + 1);
    let end = at + bad.len();
    let end = end + scene[end..].find('\n').unwrap_or(0);
    let lines: Vec<&str> = scene[start..end].lines().collect();
    assert_refused(&Workshop::new(&scene), &lines, says);
}

/// A scene from a mesh file.
fn with_mesh(mesh: impl AsRef<[u8]>, scene: &str) -> Workshop {
    let workshop = Workshop::new(scene);
    workshop.write("case/organ.vtk", mesh);
    workshop
}

const MESH_LINE: &str = r#"mesh = { file = "organ.vtk" }"#;

/// A body from this file is rejected.
#[track_caller]
fn bad_mesh(mesh: impl AsRef<[u8]>, says: &[&str]) {
    assert_refused(&with_mesh(mesh, FROM_FILE), &[MESH_LINE], says);
}

/// A body from this file runs with a repair, which is reported.
#[track_caller]
fn repaired(mesh: &str, fix: &str, note: &str) {
    let scene = changed(FROM_FILE, MESH_LINE, &format!("mesh = {{ file = \"organ.vtk\", fix = \"{fix}\" }}"));
    let output = with_mesh(mesh, &scene).run(&[]);
    output.done();
    assert!(output.err.contains(note), "{}", output.err);
}

#[test]
fn the_good_scenes_run() {
    Workshop::new(BLOCK).run(&[]).done();
    with_mesh(vtk(&CORNERS, &TETS, ""), FROM_FILE).run(&[]).done();
}

#[test]
fn unknown_keys_in_every_kind_of_table_get_the_nearest_name() {
    for (good, bad, table, meant) in [
        ("until =", "untill =", "scene", "until"),
        ("precision =", "precison =", "run", "precision"),
        ("fibre-modulus", "fiber-modulus", "law.tissue", "fibre-modulus"),
        ("weight", "wieght", "law.tissue.prony[0]", "weight"),
        ("density", "densty", "body.block", "density"),
        ("edge = 0.05", "egde = 0.05", "body.block.mesh", "edge"),
        (
            "size = [0.1, 0.1, 0.1] }, edge = 0.05",
            "sizes = [0.1, 0.1, 0.1] }, edge = 0.05",
            "body.block.mesh.block",
            "size",
        ),
        ("on = \"block\"\nmesh", "onn = \"block\"\nmesh", "surface.skin", "on"),
        ("body = \"block\"", "bdy = \"block\"", "constraint.base", "body"),
        ("set = \"z-min\"", "sett = \"z-min\"", "constraint.base.nodes", "set"),
        ("curve = ", "crve = ", "constraint.hand", "curve"),
        ("total", "totl", "load.push", "total"),
        ("within", "witin", "load.wind.faces.normal", "within"),
        ("pressure = 20", "presure = 20", "load.squeeze", "pressure"),
        ("acceleration", "accelaration", "load.tilt", "acceleration"),
        ("data = ", "dta = ", "output.fields", "data"),
        ("probes.middle", "prbes.middle", "output.history", "probes"),
        ("at = [0.05", "att = [0.05", "output.history.probes.middle", "at"),
    ] {
        let key = bad.split([' ', '.']).next().unwrap();
        let key = if key == "set" { "sett" } else { key };
        spoilt(
            good,
            bad,
            &[&format!("unknown key `{key}` in `{table}`"), &format!("did you mean `{meant}`?")],
        );
    }
    spoilt("threads = 1", "allow-hourglas = 0.3", &["did you mean `allow-hourglass`?"]);
    spoilt("[output.fields]", "[ouput.fields]", &["unknown table `ouput`", "did you mean `output`?"]);
    spoilt(
        "pressure = 20",
        "pressure = 20\ndepth = 1",
        &["unknown key `depth` in `load.squeeze`", "known keys:"],
    );
}

#[test]
fn unknown_types_and_words_get_the_nearest_name() {
    for (good, bad, says) in [
        ("\"transversely-isotropic\"", "\"transverse\"", "did you mean `transversely-isotropic`?"),
        ("type = \"fix\"", "type = \"fixed\"", "did you mean `fix`?"),
        ("type = \"gravity\"", "type = \"gravty\"", "did you mean `gravity`?"),
        ("type = \"vtu\"", "type = \"vtk\"", "did you mean `vtu`?"),
        ("\"double\"", "\"duble\"", "did you mean \"double\"?"),
        ("\"smooth-step\"", "\"smoothstep\"", "did you mean \"smooth-step\"?"),
        ("\"isochoric\"", "\"isochor\"", "did you mean \"isochoric\"?"),
        ("\"displacement\"", "\"displacment\"", "did you mean \"displacement\"?"),
        ("edge = 0.05", "edge = 0.05, as = \"hexas\"", "did you mean \"hexes\"?"),
        ("{ set = \"z-min\" }", "\"al\"", "did you mean \"all\"?"),
    ] {
        let word = bad.rsplit('"').nth(1).unwrap();
        spoilt(good, bad, &[word, says]);
    }
    let output = Workshop::block("type = \"fix\"\n", "").run(&[]);
    assert_invalid(&output, &["`constraint.base` has no `type`", "`fix`, `move`"]);
    assert!(output.underlines("[constraint.base]"), "{}", output.err);
}

#[test]
fn wrong_types_tell_what_was_expected_and_what_was_found() {
    spoilt(
        "density = 1000",
        "density = \"heavy\"",
        &["expected a number [kg/m³] or a table of numbers, found the text \"heavy\""],
    );
    spoilt("density = 1000", "density = \"1000\"", &["remove the quotes: 1000"]);
    spoilt("[0, 0, -9.81]", "-9.81", &["expected 3 numbers [m/s²], found -9.81"]);
    spoilt("[0, 0, -9.81]", "[0, -9.81]", &["expected 3 numbers [m/s²], found 2"]);
    spoilt("threads = 1", "threads = 1.5", &["expected a whole number, found 1.5"]);
    spoilt("threads = 1", "allow-hourglass = \"30 %\"", &["expected a number"]);
    spoilt("law = \"tissue\"", "law = tissue", &["`tissue` is not a value", "write \"tissue\""]);
    spoilt("[body.block]", "[body.block", &["not valid TOML", "expected `]`"]);
    spoilt("[body.block]\n", "[body]\nblock = 3\n[body.other]\n", &["`body.block` must be a table"]);
}

#[test]
fn missing_keys_and_tables_are_named() {
    for (line, header, says) in [
        ("law = \"tissue\"\n", "[body.block]", "missing key `law` in `body.block`"),
        ("density = 1000\n", "[body.block]", "missing key `density` in `body.block`"),
        ("until = 0.02\n", "[scene]", "missing key `until` in `scene`"),
        (
            "by = [0, 0, 0.001]\n",
            "[constraint.hand]",
            "exactly one of `by`, `velocity` and `rotate`, found neither",
        ),
        ("total = [0.1, 0, 0]\n", "[load.push]", "exactly one of `each` and `total`, found neither"),
        (
            "young-modulus = 10e3\n",
            "poisson-ratio = 0.45",
            "`poisson-ratio` is given without `young-modulus`",
        ),
    ] {
        assert_refused(&Workshop::block(line, ""), &[header], &[says]);
    }
    let output = Workshop::new("").run(&[]);
    assert_invalid(&output, &["the scene has no table `[scene]`", "until = 1.0", "the scene has no body"]);
}

#[test]
fn things_given_twice_or_together_are_refused() {
    spoilt("density = 1000", "density = 1000\ndensity = 900", &["`density` is given twice"]);
    spoilt("[constraint.hand]", "[constraint.base]", &["`base` is given twice"]);
    spoilt(
        "[surface.skin]",
        "[surface.block]",
        &["`block` is the name of a body and of a surface", "rename one"],
    );
    spoilt("block = {", "organ = \"liver\", block = {", &["exactly one source, found 2", "`ellipsoid`"]);
    spoilt("edge = 0.05", "edge = 0.05, scale = 2", &["`scale` does not go with `block`"]);
    let forces = Workshop::block("total =", "each = [1, 0, 0]\ntotal =");
    assert_refused(&forces, &["[load.push]"], &["exactly one of `each` and `total`, found both"]);
}

#[test]
fn numbers_out_of_range_are_refused() {
    for (good, bad, says) in [
        ("density = 1000", "density = 0", "`body.block.density` must be greater than 0, found 0"),
        ("density = 1000", "density = -5", "must be greater than 0, found -5"),
        (
            "young-modulus = 10e3",
            "young-modulus = 0",
            "`law.tissue.young-modulus` must be greater than 0, found 0",
        ),
        ("young-modulus = 10e3", "young-modulus = -3", "must be greater than 0, found -3"),
        ("step = \"auto\"", "step = 0", "`run.step` must be greater than 0, found 0"),
        ("step = \"auto\"", "step = -1e-4", "must be greater than 0, found -0.0001"),
        ("until = 0.02", "until = 0", "`scene.until` must be greater than 0, found 0"),
        ("until = 0.02", "until = -1", "must be greater than 0, found -1"),
        ("poisson-ratio = 0.45", "poisson-ratio = 0.5", "keeps the volume exactly (`poisson-ratio` 0.5)"),
        ("poisson-ratio = 0.45", "poisson-ratio = 0.7", "at most 0.5, found 0.7"),
        ("poisson-ratio = 0.45", "poisson-ratio = -1", "greater than -1 and at most 0.5, found -1"),
        ("damping = 5", "damping = -5", "must be at least 0, found -5"),
        ("threads = 1", "threads = -1", "must be at least 0"),
        ("threads = 1", "allow-hourglass = -0.1", "must be at least 0"),
        ("threads = 1", "threads = 100000", "at most 1024, found 100000"),
        ("every = 0.004", "every = 0", "must be greater than 0, found 0"),
        ("edge = 0.05", "edge = 0", "must be greater than 0, found 0"),
        ("edge = 0.05", "edge = 1e-6", "cells exceed the limit"),
        ("size = [0.1, 0.1, 0.1] }, edge = 0.05", "size = [0.1, 0, 0.1] }, edge = 0.05", "size along y is 0"),
        ("curve = \"smooth-step\"", "to = 0", "`to` (0 s) must be later than `from` (0 s)"),
        (
            "curve = \"smooth-step\"",
            "curve = { table = [[1, 0], [0, 1]] }",
            "the times of the table do not increase",
        ),
        (
            "curve = \"smooth-step\"",
            "curve = { wave = -1 }",
            "the period of the wave must be greater than 0, found -1",
        ),
        ("curve = \"smooth-step\"", "curve = { wave = 1 }\nto = 2", "a wave takes no `to`"),
    ] {
        spoilt(good, bad, &[says]);
    }
}

#[test]
fn prony_weights_must_leave_something_to_hold_the_tissue() {
    let two = |a: f64, b: f64| {
        format!(
            "prony = [{{ part = \"isochoric\", weight = {a}, time = 1 }}, {{ part = \"isochoric\", weight = {b}, time = 0.5 }}]"
        )
    };
    let good = BLOCK.lines().find(|line| line.starts_with("prony")).unwrap();
    spoilt(good, &two(0.8, 0.3), &["weights sum to 1.1", "less than 1"]);
    spoilt(good, &two(0.5, 0.5), &["weights sum to 1", "less than 1"]);
    spoilt("weight = 0.3", "weight = 1", &["must be greater than 0 and less than 1, found 1"]);
    spoilt("weight = 0.3", "weight = -0.3", &["found -0.3"]);
    spoilt("time = 0.5", "time = 0", &["must be greater than 0, found 0"]);
}

#[test]
fn a_fibre_needs_a_direction() {
    spoilt(
        "fibre = [0, 1, 0]",
        "fibre = [0, 0, 0]",
        &["the fibre direction is zero", "for example [0, 1, 0]"],
    );
    let output = Workshop::block("fibre = [0, 1, 0]\n", "").run(&[]);
    assert_invalid(&output, &["`block` has a law with fibres, but no fibre direction", "cell-data"]);
    assert!(output.underlines("law = \"tissue\""), "{}", output.err);
}

/// [`FROM_FILE`] with a fibre for each cell.
fn fibre_scene() -> String {
    let law = "type = \"transversely-isotropic\"\nfibre-modulus = 5e3\nfibre = { cell-data = \"fibre\" }";
    changed(FROM_FILE, "type = \"neo-hookean\"", law)
}

#[test]
fn a_zero_or_not_finite_fibre_of_a_cell_is_told_by_its_number() {
    let line = "fibre = { cell-data = \"fibre\" }";
    for bad in ["0 0 0", "nan 0 1", "inf 0 0"] {
        let mesh = vtk(&CORNERS, &TETS, &fibres(&["0 1 0", "1 0 0", bad, "1 1 0", "0 0 1", bad]));
        let says = "whose data is zero or not finite: tet 2, tet 5 (counted from 0)";
        assert_refused(&with_mesh(mesh, &fibre_scene()), &[line], &[says]);
    }
    let mesh = vtk(&CORNERS, &TETS, &fibres(&["0 1 0"; 6]).replace("fibre", "fiber"));
    assert_refused(
        &with_mesh(mesh, &fibre_scene()),
        &[line],
        &["no cell data `fibre`", "did you mean `fiber`?"],
    );
    let mesh = vtk(&CORNERS, &TETS, &labels(&[1; 6]).replace("label", "fibre"));
    assert_refused(
        &with_mesh(mesh, &fibre_scene()),
        &[line],
        &["`fibre` has 1 component, but a direction has 3"],
    );
}

#[test]
fn an_averaged_pressure_needs_an_energy_of_the_volume() {
    let scene = changed(FROM_FILE, "density", "element = \"tet4-anp\"\ndensity");
    let scene = changed(&scene, "\"neo-hookean\"", "\"st-venant-kirchhoff\"");
    let says = ["`st-venant-kirchhoff` has no energy of the volume alone", "take `tet4` or `hex8`"];
    assert_refused(&with_mesh(vtk(&CORNERS, &TETS, ""), &scene), &["element = \"tet4-anp\""], &says);
    let plain = changed(&scene, "tet4-anp", "tet4");
    with_mesh(vtk(&CORNERS, &TETS, ""), &plain).run(&[]).done();
}

#[test]
fn a_body_that_nothing_holds_is_allowed_and_told() {
    let constraint = FROM_FILE.find("[constraint").unwrap();
    let free = &FROM_FILE[..constraint];
    let mesh = vtk(&CORNERS, &TETS, "");
    let falling = with_mesh(&mesh, free);
    falling.run(&[]).done();
    let check = falling.check(&[]);
    assert!(check.out.contains("`organ` is held by no constraint: gravity makes it fall"), "{}", check.out);
    let pushed = free.replace("gravity", "#")
        + "[load.push]\ntype = \"force\"\non = \"organ\"\nnodes = \"all\"\ntotal = [0, 0, 1]\n";
    let pushed = with_mesh(&mesh, &pushed);
    let check = pushed.check(&[]);
    assert!(check.out.contains("held by no constraint: its loads push it away"), "{}", check.out);
    pushed.run(&[]).done();
}

#[test]
fn nan_and_infinity_are_refused_wherever_a_number_can_be() {
    for (good, bad) in [
        ("density = 1000", "density = nan"),
        ("until = 0.02", "until = inf"),
        ("step = \"auto\"", "step = nan"),
        ("[0, 0, -9.81]", "[0, 0, -inf]"),
        ("young-modulus = 10e3", "young-modulus = inf"),
        ("fibre = [0, 1, 0]", "fibre = [0, nan, 0]"),
        ("time = 0.5", "time = inf"),
        ("size = [0.1, 0.1", "size = [0.1, nan"),
        ("edge = 0.05", "edge = nan"),
        ("edge = 0.05", "edge = 0.05, at = [0, 0, nan]"),
        ("damping = 5", "damping = inf"),
        ("by = [0, 0, 0.001]", "by = [0, 0, nan]"),
        ("point = [0.1, 0.05", "point = [0.1, nan"),
        ("within = 10", "within = nan"),
        ("total = [0.1, 0, 0]", "total = [inf, 0, 0]"),
        ("traction = [0, 10, 0]", "traction = [0, nan, 0]"),
        ("pressure = 20", "pressure = nan"),
        ("every = 0.004", "every = inf"),
        ("at = [0.05", "at = [nan"),
    ] {
        spoilt(good, bad, &["is not a finite number"]);
    }
    spoilt(
        "curve = \"smooth-step\"",
        "curve = { table = [[0, 0], [1, nan]] }",
        &["nan is not a finite number"],
    );
    spoilt("density = 1000", "density = 1e999", &["larger than 64-bit floating point holds"]);
}

#[test]
fn nan_and_infinity_in_a_mesh_file_are_refused() {
    for bad in ["nan", "inf"] {
        let mesh = vtk(&CORNERS, &TETS, "").replacen("0.1 0 0", &format!("0.1 {bad} 0"), 1);
        bad_mesh(mesh, &["point 1 is not finite", "repair the mesh"]);
    }
}

#[test]
fn contradictory_constraints_show_both_tables() {
    let workshop = Workshop::block("{ set = \"z-max\" }", "{ set = \"z-min\" }");
    let says = [
        "`base` and `hand` both prescribe z of node 0 of `block`, and differently",
        "difference",
        "`components`",
    ];
    assert_refused(&workshop, &["[constraint.hand]"], &says);
    assert!(workshop.run(&[]).underlines("[constraint.base]"));
    // In different components they do not contradict each other.
    let scene = changed(BLOCK, "{ set = \"z-max\" }", "{ set = \"z-min\" }\ncomponents = [\"x\"]");
    let scene =
        changed(&scene, "{ set = \"z-min\" }\n", "{ set = \"z-min\" }\ncomponents = [\"y\", \"z\"]\n");
    Workshop::new(&scene).run(&[]).done();
}

#[test]
fn unknown_names_get_the_nearest_one() {
    for (good, bad, says) in [
        ("body = \"block\"", "body = \"blok\"", ["there is no body `blok`", "did you mean `block`?"]),
        ("law = \"tissue\"", "law = \"tisue\"", ["there is no law `tisue`", "did you mean `tissue`?"]),
        ("on = \"block\"\nmesh", "on = \"blck\"\nmesh", ["there is no body `blck`", "did you mean `block`?"]),
        ("on = \"skin\"", "on = \"skinn\"", ["there is no body or surface `skinn`", "did you mean `skin`?"]),
        (
            "on = \"skin\"",
            "on = \"liver\"",
            ["there is no body or surface `liver`", "of the scene: `block`, `skin`"],
        ),
        (
            "data = [\"displ",
            "on = \"skn\"\ndata = [\"displ",
            ["there is no body or surface `skn`", "did you mean `skin`?"],
        ),
        (
            "{ on = \"block\"",
            "{ on = \"bock\"",
            ["there is no body or surface `bock`", "did you mean `block`?"],
        ),
        (
            "probes.middle",
            "reactions = [\"bse\"]\nprobes.middle",
            ["there is no constraint `bse`", "did you mean `base`?"],
        ),
        ("acceleration", "on = \"blo\"\nacceleration", ["there is no body `blo`", "did you mean `block`?"]),
        ("set = \"z-min\"", "set = \"zmin\"", ["no set is named `zmin`", "did you mean `z-min`?"]),
    ] {
        spoilt(good, bad, &says);
    }
    let carried = "on = \"skin\"\ndata = [\"reaction\", ";
    spoilt("data = [\"displacement\", ", carried, &["surfaces have no `reaction`", "write it on the body"]);
    spoilt(
        "{ on = \"block\"",
        "{ on = \"skin\", data = [\"von-mises\"]",
        &["`von-mises` is a field of cells, and a surface has only points", "probe the body"],
    );
}

#[test]
fn empty_selections_say_what_is_near() {
    for (bad, says) in [
        ("{ box = [[1, 1, 1], [2, 2, 2]] }", ["selects no nodes", "is 1.55885 m away"]),
        ("{ sphere = { centre = [0, 0, -1], radius = 0.5 } }", ["selects no nodes", "is 0.5 m away"]),
        ("{ plane = { point = [0, 0, 0.07], normal = [0, 0, 1] } }", ["selects no nodes", "is 0.02 m away"]),
        ("{ half-space = { point = [0, 0, 9], normal = [0, 0, 1] } }", ["selects no nodes", "m away"]),
        (
            "{ difference = [{ set = \"z-min\" }, \"all\"] }",
            ["selects no nodes", "selects 9, `all` selects 27"],
        ),
        ("{ ids = [] }", ["selects no nodes", "the list is empty"]),
        ("{ ids = [0, 999] }", ["there is no node 999", "27 nodes"]),
        ("{ label = 1 }", ["no cell has label 1", "no cell data named `label`"]),
        ("{ box = [[1, 0, 0], [0, 1, 1]] }", ["box is empty along x", "swap the two"]),
        ("{ normal = { direction = [0, 0, 0], within = 9 } }", ["is zero", "for example [0, 0, 1]"]),
    ] {
        spoilt("{ set = \"z-min\" }", bad, &says);
    }
    let one = "{ nearest = { point = [0, 0, 0] } }";
    spoilt(
        "faces = { set = \"x-min\" }",
        &format!("faces = {one}"),
        &["no boundary faces", "no boundary face lies completely within"],
    );
}

#[test]
fn names_that_cannot_be_files_or_columns_are_refused() {
    spoilt("[output.fields]", "[output.\"../x\"]", &["`../x` cannot be the name", "letters, digits"]);
    spoilt("[output.fields]", "[output.\"\"]", &["`` cannot be the name"]);
    spoilt("[output.fields]", "[output.\"a/b\"]", &["`a/b` cannot be the name"]);
    spoilt("[constraint.hand]", "[constraint.\"a,b\"]", &["`a,b` cannot be the name of `[constraint.NAME]`"]);
    spoilt("probes.middle", "probes.\"a,b\"", &["`a,b` cannot be the name of a probe"]);
}

#[test]
fn a_probe_or_a_surface_far_from_its_body_is_doubted() {
    for (good, far) in [
        ("at = [0.05, 0.05, 0.05]", "at = [50, 50, 50]"),
        (
            "mesh = { block = { size = [0.1, 0.1, 0.1] }, edge = 0.04",
            "mesh = { block = { size = [0.1, 0.1, 0.1] }, edge = 0.04, at = [1, 0, 0]",
        ),
    ] {
        let output = Workshop::block(good, far).check(&[]);
        assert_eq!(output.status(), "checked", "{}", output.err);
        assert!(
            output.words().contains("m outside `block`, which measures 0.1732 m across"),
            "{}",
            output.err
        );
    }
}

#[test]
fn a_motion_after_the_end_is_doubted() {
    let output = Workshop::block("curve = \"smooth-step\"", "from = 1\nto = 2").run(&[]);
    output.done();
    assert!(
        output.words().contains("`constraint.hand` begins at 1 s, but the scene ends at 0.02 s"),
        "{}",
        output.err
    );
}

#[test]
fn a_step_above_the_critical_step_is_refused_and_one_below_it_runs() {
    let object = Workshop::new(BLOCK).run(&[]).done();
    let number = |key: &str| object[key].as_f64().unwrap();
    let (bound, limit) = (number("element_bound"), number("critical_step"));
    assert!(number("step") <= 0.9 * limit && bound < limit, "{object}");
    let says = [
        "above the critical time step",
        "is set by element 0 (tet4) of `block`",
        "take `step = \"auto\"`",
        "m",
    ];
    spoilt("step = \"auto\"", &format!("step = {:e}", 1.01 * limit), &says);
    let output = Workshop::block("step = \"auto\"", &format!("step = {:e}", 0.95 * limit)).run(&[]);
    output.done();
    assert!(output.err.contains("is close to the critical time step"), "{}", output.err);
}

#[test]
fn what_only_dynamics_has_is_refused_elsewhere_and_checked_there() {
    for (line, key) in
        [("on-unstable = \"stop\"", "on-unstable"), ("mass-scaling = { target-step = 1e-3 }", "mass-scaling")]
    {
        let bad = format!("solver = \"quasi-static\"\n{line}");
        let says = format!("`{key}` is for `solver = \"explicit\"`");
        let workshop = Workshop::block("step = \"auto\"", &bad);
        assert_refused(&workshop, &[line], &[&says, "remove it"]);
    }
    let step = "step = \"auto\"";
    for (bad, says) in [
        (
            "mass-scaling = { target-step = 0 }",
            "`run.mass-scaling.target-step` must be greater than 0, found 0",
        ),
        ("mass-scaling = { target-step = -1e-4 }", "must be greater than 0, found -0.0001"),
        ("mass-scaling = { target-step = nan }", "nan is not a finite number"),
        (
            "mass-scaling = { share = 0 }",
            "`run.mass-scaling.share` must be greater than 0 and at most 1, found 0",
        ),
        ("mass-scaling = { share = -0.01 }", "must be greater than 0 and at most 1, found -0.01"),
        ("mass-scaling = { share = nan }", "nan is not a finite number"),
        ("mass-scaling = { share = 1.5 }", "must be greater than 0 and at most 1, found 1.5"),
        ("mass-scaling = { target-step = 1e-3, share = 0.01 }", "give exactly one of `target-step`, `share`"),
        ("mass-scaling = { }", "give exactly one of `target-step`, `share`"),
        ("mass-scaling = 1e-4", "mass-scaling"),
        ("mass-scaling = { target-stp = 1e-4 }", "did you mean `target-step`?"),
        ("on-unstable = \"substeps\"", "did you mean \"substep\"?"),
        ("on-unstable = 2", "on-unstable"),
    ] {
        spoilt(step, bad, &[says]);
    }
}

/// [`FROM_FILE`] with nodes moved node by node.
fn moved_scene(by: &str) -> String {
    changed(FROM_FILE, "type = \"fix\"", &format!("type = \"move\"\nby = {by}"))
}

#[test]
fn a_motion_from_point_data_needs_an_array_of_finite_vectors() {
    let line = "by = { point-data = \"shift\" }";
    let scene = moved_scene("{ point-data = \"shift\" }");
    let of = |data: &str| with_mesh(vtk(&CORNERS, &TETS, &format!("POINT_DATA 8\n{data}\n")), &scene);
    let numbers = |n: usize| "0 ".repeat(n);
    assert_refused(
        &with_mesh(vtk(&CORNERS, &TETS, ""), &scene),
        &[line],
        &["the mesh of `organ` has no point data `shift`", "the mesh has no point data"],
    );
    assert_refused(
        &of(&format!("VECTORS shifts double\n{}", numbers(24))),
        &[line],
        &["no point data `shift`", "did you mean `shifts`?"],
    );
    assert_refused(
        &of(&format!("SCALARS shift double 1\nLOOKUP_TABLE default\n{}", numbers(8))),
        &[line],
        &["point data `shift` has 1 component, but a vector has 3", "name an array of vectors"],
    );
    assert_refused(
        &of(&format!("VECTORS shift double\n0 0 0 0 nan 0 {}", numbers(18))),
        &[line],
        &["point data `shift` is [0.0, NaN, 0.0] at node 1 (counted from 0)", "or select fewer nodes"],
    );
    // A built-in shape carries none.
    let output = Workshop::block("by = [0, 0, 0.001]", line).run(&[]);
    assert_invalid(&output, &["the mesh of `block` has no point data `shift`"]);
}

#[test]
fn a_table_of_motions_is_refused_with_its_line() {
    let line = "by = { csv = \"motion.csv\" }";
    let mesh = vtk(&CORNERS, &TETS, "");
    let refused = |table: Option<&str>, says: &[&str]| {
        let workshop = with_mesh(&mesh, &moved_scene("{ csv = \"motion.csv\" }"));
        if let Some(table) = table {
            workshop.write("case/motion.csv", table);
        }
        assert_refused(&workshop, &[line], says);
    };
    refused(None, &["motion.csv` cannot be read", "relative to the scene file"]);
    refused(
        Some("node,x,y,z\n0,0,0\n"),
        &["motion.csv:2: a row has 4 columns, but this one has 3", "each row is `node,x,y,z`"],
    );
    refused(Some("0,0,inf,0\n"), &["motion.csv:1: `inf` is not a finite number"]);
    refused(Some("8,0,0,0\n"), &["motion.csv:1: there is no node 8: the mesh has 8 nodes", "subtract 1"]);
    refused(
        Some("0,0,0,0\n1,0,0,0\n"),
        &["no row for node 2 (counted from 0) and for 1 node more", "add a row"],
    );
    let both = moved_scene("{ csv = \"motion.csv\", point-data = \"shift\" }");
    let says = ["`csv`, `point-data` cannot be given together"];
    assert_refused(
        &with_mesh(&mesh, &both),
        &["by = { csv = \"motion.csv\", point-data = \"shift\" }"],
        &says,
    );
    let says = ["`cvs`", "did you mean `csv`?"];
    assert_refused(
        &with_mesh(&mesh, &moved_scene("{ cvs = \"m.csv\" }")),
        &["by = { cvs = \"m.csv\" }"],
        &says,
    );
}

#[test]
fn a_velocity_at_the_start_needs_inertia() {
    let line = "velocity = [0, 0, 1]";
    let scene = changed(BLOCK, "damping = 5", line).replace("step = \"auto\"", "solver = \"quasi-static\"");
    assert_refused(
        &Workshop::new(&scene),
        &[line],
        &["`block` has a velocity, but a quasi-static run has no inertia", "solver = \"explicit\""],
    );
    spoilt("damping = 5", "velocity = [0, 1]", &["expected 3 numbers [m/s], found 2"]);
}

#[test]
fn a_rule_for_fibres_that_fails_is_shown_where_it_is_written() {
    for (rule, says) in [
        ("{ along = [0, 0, 0] }", "the fibre direction is zero"),
        ("{ toward = [0, 0] }", "expected 3 numbers"),
        ("{ around = { point = [0, 0, 0] } }", "missing key `axis`"),
        (
            "{ tangential = { surface = { set = \"z-max\" }, closest-to = [0, 0, 1] } }",
            "where `closest-to` is perpendicular to the surface: tet",
        ),
        (
            "{ tangential = { surface = { set = \"skin\" }, closest-to = [0, 0, 1] } }",
            "no set is named `skin`",
        ),
        ("{ laplace = { from = { set = \"x-min\" }, to = \"all\" } }", "is in `from` and in `to`"),
        ("{ laplce = 1 }", "unknown key `laplce`"),
    ] {
        spoilt("fibre = [0, 1, 0]", &format!("fibre = {rule}"), &[says]);
    }
}

#[test]
fn values_beyond_all_sense_are_refused_and_unusual_ones_doubted() {
    for (good, bad, says) in [
        (
            "young-modulus = 10e3",
            "young-modulus = 1e-300",
            "is 1e-300 Pa, outside the possible range of 1e-20 to 1e20 Pa",
        ),
        (
            "density = 1000",
            "density = 1e300",
            "is 1e300 kg/m³, outside the possible range of 1e-15 to 1e15 kg/m³",
        ),
        ("until = 0.02", "until = 1e30", "`scene.until` is 1e30 s, outside the possible range"),
    ] {
        assert_refused(&Workshop::block(good, bad), &[bad], &[says, "values are in SI units"]);
    }
    for (good, odd, says) in [
        ("young-modulus = 10e3", "young-modulus = 1e-3", "1e-2 to 1e13 Pa: check the value"),
        ("density = 1000", "density = 1e-6", "but usual values are 1e-1 to 1e5 kg/m³: check the value"),
        ("density = 1000", "density = 1e-6", "1 g/cm³ is 1000 kg/m³"),
        ("pressure = 20", "pressure = -1e15", "but usual values are less than 1e13 Pa"),
        ("total = [0.1, 0, 0]", "total = [1e40, 0, 0]", "is 1e40 N, but usual values are less than 1e9 N"),
    ] {
        let output = Workshop::block(good, odd).check(&[]);
        assert_eq!(output.status(), "checked", "{}", output.err);
        assert!(output.words().contains(says) && output.underlines(odd), "{}", output.err);
    }
    // Loads may be as small, and boxes as large, as they like.
    let boxed = "nodes = { box = [[-1e9, -1e9, 0.09], [1e9, 1e9, 1e9]] }";
    for (good, usual) in [("pressure = 20", "pressure = 1e-15"), ("nodes = { set = \"z-max\" }", boxed)] {
        let output = Workshop::block(good, usual).check(&[]);
        assert_eq!((output.status(), output.err.as_str()), ("checked", ""));
    }
}

#[test]
fn a_nearest_node_far_from_its_point_is_doubted() {
    let line = "nodes = { nearest = { point = [1000, 0.05, 0.05] } }";
    let output = Workshop::block("nodes = { nearest = { point = [0.1, 0.05, 0.05] } }", line).check(&[]);
    assert_eq!(output.status(), "checked", "{}", output.err);
    let says = "nearest to [1000.0, 0.05, 0.05] is 999.9 m away, and `block` measures 0.1732 m across";
    assert!(output.words().contains(says) && output.underlines(line), "{}", output.err);
}

/// The output of a failed run.
fn failure_of(changes: &[&str]) -> String {
    let output = Workshop::new(BLOCK).run(changes);
    assert_eq!(output.status(), "failed", "{}", output.err);
    output.json()["error"]["message"].as_str().unwrap().to_owned()
}

#[test]
fn advice_fits_what_the_run_does_already() {
    let damped = failure_of(&["body.block.damping=1e5", "body.block.velocity=[0,0,1]"]);
    for piece in ["the damping of `block`, 1.000e5 1/s, is too strong", "take `damping` below 1600"] {
        assert!(damped.contains(piece), "{damped}");
    }
    assert!(!damped.contains("more damping"), "{damped}");
    let squeezed = "constraint.hand.by=[0,0,-0.0999]";
    let cut = failure_of(&[squeezed]);
    assert!(
        cut.contains("inverted") && cut.contains("the run cuts its steps, went back 3 times and halved them"),
        "{cut}"
    );
    assert!(!cut.contains("substep") && !cut.contains("smaller `step`"), "{cut}");
    let report = failure_of(&[squeezed, "run.on-unstable=report"]);
    assert!(report.contains("`on-unstable = \"substep\"`"), "{report}");
    let stopped = failure_of(&["constraint.hand.by=[0,0,-0.09]", "run.on-unstable=stop"]);
    assert!(stopped.contains("let the run cut its steps (`on-unstable = \"substep\"`)"), "{stopped}");
}
