//! Bad input of scenes in contact by a barrier, through the real binary. Each has an answer, by the rows of
//! the table of the contact specification (9.4). No run ends in a panic or writes a number that is not
//! finite.

use crate::support::{CORNERS, Said, TETS, Workshop, changed, vtk};

/// A cube of 0.1 m a tenth of a millimetre above a floor.
const SOLID: &str = r#"[scene]
until = 0.1

[run]
solver = "implicit"
step = 0.05

[law.tissue]
type = "neo-hookean"
young-modulus = 5e3
poisson-ratio = 0.4

[body.organ]
mesh = { file = "organ.vtk" }
law = "tissue"
density = 1000

[obstacle.floor]
shape = "half-space"
at = [0, 0, -1e-4]

[contact.below]
between = ["organ", "floor"]
check-intersections = true
"#;

/// A square of 0.1 m, 10 mm above it.
const SQUARE: [[f64; 3]; 4] = [[0.0, 0.0, 0.01], [0.1, 0.0, 0.01], [0.1, 0.1, 0.01], [0.0, 0.1, 0.01]];

/// A motion of the lower side of the cube.
const DOWN: &str = "[constraint.lower]\ntype = \"move\"\nbody = \"organ\"\n\
    nodes = { half-space = { point = [0, 0, 0.01], normal = [0, 0, -1] } }\nby = [0, 0, -0.01]\nto = 0.1\n";

fn shell() -> String {
    changed(SOLID, "[body.organ]\n", "[body.organ]\nmodel = \"shell\"\nthickness = 1e-4\n")
}

fn run(scene: &str, mesh: &str) -> (Said, Workshop) {
    let workshop = Workshop::new(scene);
    workshop.write("case/organ.vtk", mesh);
    (workshop.run(&[]), workshop)
}

/// Asserts exit code 2 and these words, and that nothing was written.
#[track_caller]
fn refused(scene: &str, mesh: &str, says: &[&str]) {
    let (output, workshop) = run(scene, mesh);
    assert_eq!(output.code, 2, "{}\n{}", output.err, output.out);
    let words = output.words();
    says.iter().for_each(|piece| assert!(words.contains(piece), "no `{piece}` in:\n{words}"));
    assert_eq!(output.json()["error"]["kind"], "input");
    assert!(!workshop.path("out").exists(), "something was written");
}

/// Asserts exit code 0 and these words.
#[track_caller]
fn accepted(scene: &str, mesh: &str, says: &[&str]) {
    let (output, _) = run(scene, mesh);
    assert_eq!(output.code, 0, "{}\n{}", output.err, output.out);
    let words = output.words();
    says.iter().for_each(|piece| assert!(words.contains(piece), "no `{piece}` in:\n{words}"));
}

fn cube() -> String {
    vtk(&CORNERS, &TETS, "")
}

fn square() -> String {
    vtk(&SQUARE, &[&[0, 1, 2], &[0, 2, 3]], "")
}

#[test]
fn good_input_is_run() {
    accepted(SOLID, &cube(), &[]);
    accepted(&shell(), &square(), &[]);
}

/// Rows 1, 7, 9 and 10: inverted, flat and repeated elements, nodes without elements or at one place, edges
/// of three triangles, slivers.
#[test]
fn meshes_that_cannot_touch_are_refused_with_their_elements() {
    let mut inverted = TETS;
    inverted[0] = &[0, 3, 1, 7];
    refused(SOLID, &vtk(&CORNERS, &inverted, ""), &["inverted elements at rest: tet 0", "fix = \"reorder\""]);
    let flat: &[u32] = &[0, 1, 2, 3];
    let cells: Vec<&[u32]> = TETS.into_iter().chain([flat]).collect();
    refused(SOLID, &vtk(&CORNERS, &cells, ""), &["elements without volume at rest: tet 6", "remesh"]);
    let points: Vec<[f64; 3]> = CORNERS.into_iter().chain([[0.2, 0.0, 0.0]]).collect();
    refused(SOLID, &vtk(&points, &TETS, ""), &["nodes that no element uses: 8", "fix = \"drop-unused\""]);
    let points: Vec<[f64; 3]> = CORNERS.into_iter().chain([CORNERS[7]]).collect();
    let mut doubled = TETS;
    doubled[5] = &[0, 5, 1, 8];
    refused(SOLID, &vtk(&points, &doubled, ""), &["nodes at the same place: 7 and 8", "fix = \"merge\""]);
    let twice: [&[u32]; 3] = [&[0, 1, 2], &[0, 2, 3], &[0, 2, 3]];
    refused(&shell(), &vtk(&SQUARE, &twice, ""), &["elements that repeat another: triangle 2"]);
    let with = |more: [f64; 3]| [&SQUARE[..], &[more]].concat();
    let fin: [&[u32]; 3] = [&[0, 1, 2], &[0, 2, 3], &[0, 2, 4]];
    refused(
        &shell(),
        &vtk(&with([0.05, 0.05, 0.1]), &fin, ""),
        &["3 triangles of `organ` meet in the edge of nodes 0 and 2"],
    );
    accepted(
        &changed(&shell(), "thickness = 1e-4\n", "thickness = 1e-4\nbranches = true\n"),
        &vtk(&with([0.05, 0.05, 0.1]), &fin, ""),
        &[],
    );
    // Two triangles, one of which is 0.14 m long and so high.
    let sliver = |height: f64| {
        vtk(
            &[SQUARE[0], SQUARE[1], SQUARE[2], [0.05 - height, 0.05 + height, 0.01]],
            &[&[0, 1, 2], &[0, 2, 3]],
            "",
        )
    };
    refused(&shell(), &sliver(1e-16), &["triangles without area at rest: triangle 1"]);
    refused(
        &shell(),
        &sliver(1e-9),
        &["triangles more than 10⁶ times as long as high: triangle 1", "remesh there"],
    );
    accepted(
        &shell(),
        &sliver(1e-6),
        &["triangles up to 1.000e5 times as long as high: triangle 1", "lose digits"],
    );
}

/// Rows 3 and 6: numbers that are not finite, and numbers out of their ranges.
#[test]
fn numbers_that_cannot_be_are_refused_with_their_ranges() {
    let points: Vec<[f64; 3]> =
        [[f64::NAN, 0.0, 0.0]].into_iter().chain(CORNERS.into_iter().skip(1)).collect();
    refused(SOLID, &vtk(&points, &TETS, ""), &["point 0 is not finite (NaN, 0, 0)"]);
    for (good, bad, says) in [
        (
            "young-modulus = 5e3",
            "young-modulus = nan",
            "`law.tissue.young-modulus`: nan is not a finite number",
        ),
        ("at = [0, 0, -1e-4]", "at = [0, 0, -inf]", "`obstacle.floor.at[2]`: -inf is not a finite number"),
        ("young-modulus = 5e3", "young-modulus = 0", "must be greater than 0, found 0"),
        ("poisson-ratio = 0.4", "poisson-ratio = 0.5", "take a `poisson-ratio` of 0.49 or less"),
        ("poisson-ratio = 0.4", "poisson-ratio = -1", "must be greater than -1 and at most 0.5, found -1"),
        ("density = 1000", "density = 0", "`body.organ.density` must be greater than 0, found 0"),
        ("check-intersections = true", "thickness = -1", "`contact.below.thickness` must be at least 0"),
        ("check-intersections = true", "barrier-distance = 0", "must be greater than 0, found 0"),
        ("check-intersections = true", "friction = -0.1", "`contact.below.friction` must be at least 0"),
    ] {
        refused(&changed(SOLID, good, bad), &cube(), &[says]);
    }
    for thickness in ["0", "-1"] {
        let text = changed(&shell(), "thickness = 1e-4", &format!("thickness = {thickness}"));
        refused(&text, &square(), &["`body.organ.thickness` must be greater than 0"]);
    }
    // A shell that touches by its middle.
    accepted(&changed(&shell(), "check-intersections = true", "thickness = 0"), &square(), &[]);
    let tool = "[tool.probe]\nshape = { sphere = { radius = 0.01 } }\nat = [0, 0, 1]\nposes = \"p.csv\"\n\n[contact.below]";
    for (row, says) in [
        ("0,0,0,nan,1,0,0,0", "p.csv:1: a row has 8 finite numbers"),
        ("0,0,0,0,2,0,0,0", "the quaternion has length 2"),
    ] {
        let workshop = Workshop::new(&changed(SOLID, "[contact.below]", tool));
        workshop.write("case/organ.vtk", cube());
        workshop.write("case/p.csv", row);
        let output = workshop.run(&[]);
        assert!(output.code == 2 && output.words().contains(says), "{}", output.err);
    }
}

/// Rows 4, 5, 8 and 11: bodies in things, parts of one surface too near at rest to touch, parts that nothing
/// holds, open balloons.
#[test]
fn states_that_cannot_begin_are_refused_with_their_places() {
    refused(
        &changed(SOLID, "-1e-4", "1e-4"),
        &cube(),
        &[
            "contact `below` has no gap at the start in 4 places: node 0 of `organ` at (0, 0, 0) m: a gap of -1.000e-4 m",
            "move one of them",
        ],
    );
    let itself = changed(&shell(), "\"floor\"]", "\"organ\"]")
        .replace("check-intersections = true", "barrier-distance = 1e-3");
    let leaf = |gap: f64| {
        let above = SQUARE.map(|[x, y, z]| [x, y, z + gap]);
        vtk(&[SQUARE, above].concat(), &[&[0, 1, 2], &[0, 2, 3], &[4, 5, 6], &[4, 6, 7]], "")
    };
    accepted(
        &itself,
        &leaf(5e-8),
        &["never touch, because they are in one place at rest", "2 separate parts"],
    );
    accepted(&itself, &leaf(5e-4), &["2 separate parts"]);
    refused(
        &changed(SOLID, "\"implicit\"\nstep = 0.05", "\"static\""),
        &cube(),
        &["`organ` is free in 6 rigid motions of 6", "including the one with node 0"],
    );
    let air = "[constraint.air]\ntype = \"volume\"\nbody = \"organ\"\nby = 1e-5\n";
    refused(
        &(shell() + air),
        &square(),
        &["the faces of `air` leave an opening at", "choose faces that close"],
    );
}

/// Rows 2, 12, 14 and 15: a run that cannot continue ends with exit code 1 and the reason. Its earlier output
/// has no edge in a triangle, and only finite numbers.
#[test]
fn what_cannot_go_on_ends_with_its_last_state() {
    let output = "[output.organ]\ntype = \"vtu\"\nevery = 0.05\n";
    let fixed = "[constraint.upper]\ntype = \"fix\"\nbody = \"organ\"\n\
                 nodes = { half-space = { point = [0, 0, 0.09], normal = [0, 0, 1] } }\n";
    let squeezed = DOWN
        .replace("0.01], normal = [0, 0, -1]", "0.09], normal = [0, 0, 1]")
        .replace("by = [0, 0, -0.01]", "by = [0, 0, -0.2]");
    let few = changed(SOLID, "step = 0.05", "step = 0.05\niterations = 2");
    for (row, scene, says) in [
        (
            "a driver in an obstacle",
            format!("{SOLID}{DOWN}{fixed}{output}"),
            "`lower` is blocked, pushing with",
        ),
        ("elements that would be inverted", format!("{SOLID}{squeezed}{output}"), "no equilibrium at t ="),
        (
            "too few iterations",
            format!("{few}{}{output}", squeezed.replace("-0.2", "-0.03")),
            "after 3 iterations: residual",
        ),
    ] {
        let (said, workshop) = run(&scene, &cube());
        let words = said.words();
        assert!(said.code == 1 && words.contains(says), "{row}: {}\n{words}", said.code);
        let error = &said.json()["error"];
        let is_blocked = says.contains("blocked");
        assert_eq!(error["kind"], if is_blocked { "blocked" } else { "not-converged" }, "{row}");
        if is_blocked {
            let blocked = &error["blocked"];
            assert!(blocked["driver"] == "lower" && blocked["force"].as_f64().unwrap() > 0.0, "{blocked}");
        }
        let frames = workshop.series("out/case/organ.pvd");
        assert!(!frames.is_empty(), "{row}");
        for (_, frame) in frames {
            let values = frame.mesh.point_data["displacement"].values.iter();
            assert!(values.into_iter().all(|value| value.is_finite()), "{row}");
        }
    }
}
