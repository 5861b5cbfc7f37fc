//! Shells: refusals and their words, outputs of a failed run, and outputs of a run that went well.

mod layers;
mod membranes;

use std::collections::BTreeMap;
use std::fs;

use pliant_geometry::Mesh;
use pliant_run::SweepOptions;
use pliant_testing::scenes::{Told, Workshop, changed};

/// A cantilever of 16 triangles.
const WALL: &str = r#"[scene]
until = 1.0

[run]
solver = "static"
load-steps = 2
threads = 1

[law.wall]
type = "st-venant-kirchhoff"
young-modulus = 1e6
poisson-ratio = 0.3

[body.wall]
model = "shell"
mesh = { plate = { size = [0.2, 0.1], cells = [4, 2] } }
law = "wall"
density = 1000
thickness = 0.002

[constraint.base]
type = "fix"
body = "wall"
nodes = { set = "x-min" }

[load.push]
type = "pressure"
on = "wall"
faces = "all"
pressure = 1

[output.fields]
type = "vtu"
every = 0.5

[output.history]
type = "csv"
every = 0.5
probes.end = { on = "wall", at = [0.2, 0.05, 0] }
"#;

const PLATE: &str = "mesh = { plate = { size = [0.2, 0.1], cells = [4, 2] } }";
const THICK: &str = "thickness = 0.002";
const STEPS: &str = "load-steps = 2";

fn wall(changes: &[(&str, &str)]) -> Workshop {
    Workshop::new(&changes.iter().fold(WALL.to_owned(), |scene, (good, other)| changed(&scene, good, other)))
}

#[track_caller]
fn says(output: &Told, pieces: &[&str]) {
    for piece in pieces {
        assert!(output.words().contains(piece), "no `{piece}` in:\n{}", output.err);
    }
}

/// The scene with changes is refused in these words, and nothing is written.
#[track_caller]
fn refused(changes: &[(&str, &str)], pieces: &[&str]) {
    let workshop = wall(changes);
    let output = workshop.run(&[]);
    assert_eq!(output.status(), "invalid", "{}", output.err);
    says(&output, pieces);
    assert_eq!(output.json()["error"]["kind"], "input");
    assert!(!workshop.path("out").exists(), "something was written");
}

#[test]
fn values_out_of_their_range_are_refused() {
    for value in ["0", "-0.002"] {
        let line = format!("thickness = {value}");
        refused(
            &[(THICK, &line)],
            &["`body.wall.thickness` must be greater than 0", &format!("found {value}")],
        );
    }
    refused(&[("thickness = 0.002\n", "")], &["`wall` is a shell and needs a `thickness`", "in metres"]);
    for value in ["0", "-1"] {
        let line = format!("young-modulus = {value}");
        refused(&[("young-modulus = 1e6", &line)], &["`law.wall.young-modulus` must be greater than 0"]);
        let line = format!("density = {value}");
        refused(&[("density = 1000", &line)], &["`body.wall.density` must be greater than 0"]);
    }
    refused(
        &[(THICK, "thickness = 0.002\ncrease = 200")],
        &["`body.wall.crease` must be at least 0 and at most 180"],
    );
    for solver in ["explicit", "implicit"] {
        let solver = format!("\"{solver}\"");
        refused(&[("\"static\"", &solver)], &["`load-steps` is for `solver = \"quasi-static\"`"]);
    }
}

/// A legacy OFF file.
fn off(points: &[[f64; 3]], cells: &[&[u32]]) -> String {
    let joined = |numbers: Vec<String>| numbers.join(" ") + "\n";
    let points_text = points.iter().map(|p| joined(p.iter().map(f64::to_string).collect()));
    let cells_text = cells
        .iter()
        .map(|cell| format!("{} ", cell.len()) + &joined(cell.iter().map(u32::to_string).collect()));
    format!("OFF\n{} {} 0\n", points.len(), cells.len()) + &points_text.chain(cells_text).collect::<String>()
}

/// The messages of a scene with a shell from a file.
fn from_file(points: &[[f64; 3]], cells: &[&[u32]], changes: &[(&str, &str)]) -> Told {
    let edits = [
        (PLATE, "mesh = { file = \"wall.off\" }"),
        ("{ set = \"x-min\" }", "{ nearest = { point = [0, 0, 0], count = 3 } }"),
        ("at = [0.2, 0.05, 0]", "at = [0.1, 0.1, 0]"),
    ];
    let workshop = wall(&[&edits, changes].concat());
    workshop.write("case/wall.off", off(points, cells));
    workshop.run(&[])
}

#[test]
fn meshes_that_are_no_shells_are_refused_or_repaired() {
    const SQUARE: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.1, 0.1, 0.0], [0.0, 0.1, 0.0]];
    let with = |more: [f64; 3]| [&SQUARE[..], &[more]].concat();
    from_file(&SQUARE, &[&[0, 1, 2], &[0, 2, 3]], &[]).done();
    let output = from_file(&SQUARE, &[&[0, 1, 2, 3]], &[]);
    output.done();
    says(&output, &["`wall`: 1 quad cut into triangles"]);
    let output = from_file(&SQUARE, &[&[0, 1, 2], &[0, 3, 2]], &[]);
    output.done();
    says(&output, &["`wall`: 1 triangle turned over, so that all face one side"]);

    let output = from_file(&with([0.05, 0.05, 0.0]), &[&[0, 1, 2], &[0, 2, 3], &[0, 4, 2]], &[]);
    assert_eq!(output.status(), "invalid");
    says(&output, &["`wall` has triangles without area at rest: triangle 2", "remesh there"]);

    let fin: [&[u32]; 3] = [&[0, 1, 2], &[0, 2, 3], &[0, 2, 4]];
    let output = from_file(&with([0.05, 0.05, 0.1]), &fin, &[]);
    assert_eq!(output.status(), "invalid");
    says(&output, &["3 triangles of `wall` meet in the edge of nodes 0 and 2", "set `branches = true`"]);
    from_file(&with([0.05, 0.05, 0.1]), &fin, &[(THICK, "thickness = 0.002\nbranches = true")]).done();

    let strip = [[0.1, 0.0], [-0.05, 0.087], [-0.05, -0.087]];
    let points: Vec<[f64; 3]> = strip.iter().flat_map(|&[x, y]| [[x, y, -0.02], [x, y, 0.02]]).collect();
    let moebius: [&[u32]; 6] = [&[0, 2, 1], &[1, 2, 3], &[2, 4, 3], &[3, 4, 5], &[4, 1, 5], &[5, 1, 0]];
    let output = from_file(&points, &moebius, &[]);
    assert_eq!(output.status(), "invalid");
    says(&output, &["shell `wall` has only one side", "nodes 3 and 4; cut it there"]);
}

#[test]
fn what_a_static_run_cannot_hold_is_named_with_its_free_motions() {
    let constraint = &WALL[WALL.find("[constraint").unwrap()..WALL.find("[load").unwrap()];
    refused(
        &[(constraint, "")],
        &["`wall` is free in 6 rigid motions of 6", "type = \"spring\"", "`solver = \"implicit\"`"],
    );
    let pinned = "{ nearest = { point = [0, 0, 0] } }\ncomponents = [\"x\", \"y\", \"z\"]";
    refused(&[("{ set = \"x-min\" }", pinned)], &["`wall` is free in 3 rigid motions of 6"]);
    // The same scene has inertia with another solver.
    wall(&[(constraint, ""), ("\"static\"", "\"implicit\""), (STEPS, "step = 0.1")]).run(&[]).done();
}

#[test]
fn an_open_balloon_is_refused_with_its_borders() {
    let control = "load-steps = 2\ncontrol = { load = \"push\", volume = 0.001 }";
    refused(&[(STEPS, control)], &["a balloon must be closed", "1 open border: 12 nodes (0, 1, 2, 3, 4, …)"]);
    let tube = "mesh = { cylinder = { radius = 0.05, length = 0.2, cells = [8, 4] } }";
    refused(
        &[(STEPS, control), (PLATE, tube), ("x-min", "z-min")],
        &["2 open borders: 8 nodes (0,", "close the surface, or apply the pressure to the whole surface"],
    );
}

#[test]
fn doubtful_shells_are_warned_about() {
    let output = wall(&[(THICK, "thickness = 0.06")]).run(&[]);
    output.done();
    says(
        &output,
        &[
            "16 triangles of 16 of `wall` are thicker than their smallest altitude",
            "model the wall with tets",
        ],
    );
    let distorted = PLATE.replace("[4, 2]", "[32, 32], distortion = 0.3, seed = 3");
    let output = wall(&[(PLATE, &distorted)]).check(&[]);
    assert_eq!(output.status(), "checked", "{}", output.err);
    says(
        &output,
        &["of `wall` folded back onto all neighbours, like inverted triangles", "smooth or remesh"],
    );
    let output = wall(&[(THICK, "thickness = 0.002\nelement = \"comas-2010\"")]).check(&[]);
    assert_eq!(output.status(), "checked", "{}", output.err);
    says(&output, &["`wall` has the element of Comas (2010)", "6 to 26 % too soft", "take `dkt-curved`"]);
}

#[test]
fn singular_stiffness_names_the_node_and_what_to_try() {
    let workshop = wall(&[(THICK, "thickness = 0.002\nelement = \"plate\"")]);
    let output = workshop.run(&[]);
    assert_eq!(output.status(), "failed", "{}", output.err);
    let json = output.json();
    assert_eq!((&json["error"]["kind"], &json["error"]["body"]), (&"singular".into(), &"wall".into()));
    let node = json["error"]["node"].as_u64().expect("a node");
    says(
        &output,
        &[
            &format!("in `wall`: the stiffness is singular: node {node} can move in x without resistance"),
            "hold it, or give its elements stiffness in that direction",
        ],
    );
}

/// The moment at the clamp of a cantilever with a force F at its end is M = F L. The field of its nodes and
/// the moment about a point both show it, and force and moment balance.
#[test]
fn a_clamp_resists_the_moment_of_a_force_at_the_end() {
    let force = 1e-6;
    let workshop = wall(&[
        ("type = \"pressure\"", "type = \"force\""),
        ("faces = \"all\"\npressure = 1", &format!("nodes = {{ set = \"x-max\" }}\ntotal = [0, 0, {force}]")),
        ("type = \"vtu\"\n", "type = \"vtu\"\ndata = [\"reaction\", \"reaction-moment\"]\n"),
        ("probes.end", "moments-about = [0, 0.05, 0]\nprobes.end"),
    ]);
    workshop.run(&[]).done();
    let (header, rows) = workshop.table("out/case/history.csv");
    let last = |name: &str| rows.last().unwrap()[header.iter().position(|column| column == name).unwrap()];
    let (_, frame) = workshop.series("out/case/fields.pvd").pop().unwrap();
    let sum = |field: &str, c: usize| -> f64 {
        let data = &frame.mesh.point_data[field];
        (0..15).map(|node| data.item(node)[c]).sum()
    };
    // Of the clamp, at x = 0; other nodes have none. A force along z there has no moment about y.
    let moment = force * 0.2;
    for (what, found, expected) in [
        ("force", last("reaction.base.z"), -force),
        ("sum of nodal forces", sum("reaction", 2), -force),
        ("moment about the clamp", last("moment.base.y"), moment),
        ("sum of nodal moments", sum("reaction-moment", 1), moment),
    ] {
        // Deflected by 40 µm; linear to 1e-6.
        assert!((found / expected - 1.0).abs() < 1e-5, "{what}: {found} for {expected}");
    }
    for (node, x) in frame.mesh.points.iter().enumerate() {
        let clamped = x.x < 1e-9;
        let turned = frame.mesh.point_data["reaction-moment"].item(node)[1] != 0.0;
        assert_eq!(clamped, turned, "node {node}");
    }
}

/// Twice the area over the border of 0.2 × 0.1 m is 67 mm: 10 mm are 0.15 of it and 9 % too stiff in torsion,
/// 2 mm are not spoken of.
#[test]
fn a_stout_strip_is_noted() {
    let output = |thickness: &str| {
        let output =
            wall(&[(THICK, &format!("thickness = {thickness}")), ("pressure = 1", "pressure = 1e-3")])
                .run(&[]);
        output.done();
        output
    };
    says(
        &output("0.01"),
        &[
            "`wall` is 0.15 times as thick as wide",
            "transverse shear is neglected",
            "about 9 % too stiff in torsion",
        ],
    );
    for thin in ["0.002", "0.0033"] {
        let output = output(thin);
        assert!(!output.words().contains("as thick as wide"), "{}", output.err);
    }
}

/// A path by arc length ends where the load reaches its full size, or at its `stop`. A `stop` without a load
/// factor lets the path pass the full load.
#[test]
fn a_path_by_arc_length_ends() {
    let path = |stop: &str| {
        let workshop = wall(&[
            (STEPS, &format!("load-steps = 40\ncontrol = {{ load = \"push\", arc-length = 0.02{stop} }}")),
            ("every = 0.5\nprobes", "every = 0.01\nprobes"),
        ]);
        let json = workshop.run(&[]).done();
        let (header, rows) = workshop.table("out/case/history.csv");
        let column = |name: &str| header.iter().position(|column| column == name).unwrap();
        let (factor, z) = (column("load-factor"), column("probe.end.displacement.z"));
        let curve: Vec<[f64; 2]> = rows.iter().map(|row| [row[factor], row[z]]).collect();
        (json, curve)
    };
    let (json, curve) = path("");
    assert!(json["steps"].as_u64().unwrap() < 40, "{json}");
    assert!(json["ended"].as_str().unwrap().contains("limit of ±1.0"), "{json}");
    let [before, last] = [2, 1].map(|back| curve[curve.len() - back][0]);
    assert!(before < 1.0 && last >= 1.0, "{curve:?}");
    let (json, curve) = path(", stop = { load-factor = 0.2 }");
    assert!(curve.last().unwrap()[0] >= 0.2 && curve.last().unwrap()[0] < 1.0, "{json}");
    let node = "{ body = \"wall\", at = [0.2, 0.05, 0], component = \"z\", by = 0.05 }";
    let (json, curve) = path(&format!(", stop = {{ displacement = {node} }}"));
    assert!(json["ended"].as_str().unwrap().contains("has moved by"), "{json}");
    let [before, last] = [2, 1].map(|back| curve[curve.len() - back][1]);
    assert!(before < 0.05 && last >= 0.05, "{curve:?}");
    let (json, _) = path(", stop = { limit-points = 1 }");
    assert_eq!((&json["steps"], &json["ended"]), (&40.into(), &serde_json::Value::Null), "{json}");
    let run = |line: &str| format!("load-steps = 2\n{line}");
    refused(
        &[(STEPS, &run("control = { load = \"push\", arc-length = 0.1, stop = {} }"))],
        &["`stop` needs one of `load-factor`, `displacement` and `limit-points`"],
    );
    let volume = "control = { load = \"push\", volume = 1, stop = { limit-points = 1 } }";
    refused(&[(STEPS, &run(volume))], &["`stop` is for `arc-length`"]);
}

/// A vibration that the usual steps damp away is still there with steps of second order. Other solvers refuse
/// the integrator.
#[test]
fn an_integrator_of_second_order_keeps_vibrations() {
    let swing = |integrator: &str| {
        let workshop = wall(&[
            ("\"static\"", &format!("\"implicit\"\nstep = 0.05\n{integrator}")),
            ("load-steps = 2\n", ""),
            ("until = 1.0", "until = 8.0"),
            ("pressure = 1", "pressure = 1e-3\ncurve = \"hold\""),
            ("csv\"\nevery = 0.5", "csv\"\nevery = 0.05"),
        ]);
        workshop.run(&[]).done();
        let (_, rows) = workshop.table("out/case/history.csv");
        let late = rows.iter().filter(|row| row[0] > 4.0).map(|row| *row.last().unwrap());
        let (low, high) = late.fold((f64::MAX, f64::MIN), |(low, high), z| (low.min(z), high.max(z)));
        (high - low) / (high + low)
    };
    let [first, second] = ["", "integrator = \"bdf2\""].map(swing);
    // Its period is 3.7 s: backward Euler damps it by 4 % of critical.
    assert!(first < 0.8 && second > 0.95, "{first} {second}");
    refused(
        &[(STEPS, "load-steps = 2\nintegrator = \"bdf2\"")],
        &["`integrator` is for `solver = \"implicit\"`", "has no effect here"],
    );
}

/// A load that is small until the middle of the run, and crushing at its end.
const CRUSHING: &str = "pressure = 1e6\ncurve = { table = [[0, 0], [0.5, 1e-6], [1, 1]] }";

#[test]
fn a_run_without_equilibrium_keeps_what_it_found() {
    let workshop = wall(&[("pressure = 1", CRUSHING)]);
    let output = workshop.run(&[]);
    assert_eq!(output.status(), "failed", "{}", output.err);
    says(&output, &["after t = 0.5000 s", "in `wall`", "what was written before stays readable"]);
    let kept = |workshop: &Workshop| {
        let (_, rows) = workshop.table("out/case/history.csv");
        assert_eq!(rows.iter().map(|row| row[0]).collect::<Vec<_>>(), [0.0, 0.5]);
        let times: Vec<f64> = workshop.series("out/case/fields.pvd").iter().map(|frame| frame.0).collect();
        assert_eq!(times, [0.0, 0.5]);
        assert!(workshop.read("out/case/summary.md").contains("after t = 0.5000 s"));
    };
    kept(&workshop);

    // Halving as often as allowed does not help if there is no time to iterate.
    let strong = CRUSHING.replace("1e6", "1e3").replace("1e-6", "1e-9");
    let workshop = wall(&[("pressure = 1", &strong), (STEPS, "load-steps = 2\niterations = 2")]);
    let output = workshop.run(&[]);
    assert_eq!(output.status(), "failed", "{}", output.err);
    let json = output.json();
    assert_eq!(
        (&json["error"]["kind"], &json["error"]["time"]),
        (&"not-converged".into(), &0.5.into()),
        "{json}"
    );
    says(
        &output,
        &[
            "no equilibrium at t =",
            "the residuals of all iterations are in `convergence.csv`",
            "try smaller load steps",
        ],
    );
    let table = workshop.read("out/case/convergence.csv");
    let rows: Vec<Vec<&str>> = table.lines().skip(1).map(|line| line.split(',').collect()).collect();
    // Of the first step, which was found; and nine attempts at the second, of three evaluations each.
    assert_eq!(rows.iter().filter(|row| row[0] == "2" && row[6] == "0").count(), 27, "{table}");
    assert!(rows.iter().any(|row| row[0] == "1" && row[6] == "1"), "{table}");
    // Iterations of all attempts count, those that found nothing, too.
    let iterations = rows.iter().filter(|row| row[3] != "0").count();
    assert_eq!(json["solver"]["newton_iterations"], iterations, "{json}");
    let step = &json["error"]["load_step"];
    assert_eq!((&step["number"], &step["of"], &step["iterations"]), (&2.into(), &2.into(), &2.into()));
    assert!(step["residual"].as_f64().unwrap() > 1e-8, "{step}");
    kept(&workshop);

    let stalled = "load-steps = 2\nlinear = { by = \"conjugate-gradients\", iterations = 2, preconditioner = \"block-jacobi\" }";
    let output = wall(&[(STEPS, stalled)]).run(&[]);
    assert_eq!(output.status(), "failed");
    says(
        &output,
        &["conjugate gradients stopped at a residual of", "after 2 iterations", "use the direct solver"],
    );
}

#[test]
fn wrong_combinations_of_models_solvers_and_keys_are_refused() {
    let explicit = ("\"static\"", "\"explicit\"");
    let run = |line: &str| format!("load-steps = 2\n{line}");
    let body = |line: &str| format!("thickness = 0.002\n{line}");
    refused(
        &[("\"static\"", "\"quasi-static\"")],
        &["`quasi-static` is not for bodies of model `shell`", "\"static\""],
    );
    refused(
        &[("model = \"shell\"\n", ""), (PLATE, "mesh = { block = { size = [0.1, 0.1, 0.1] }, edge = 0.05 }")],
        &["`thickness` is for a shell or a membrane, and `wall` is of model `solid`"],
    );
    refused(
        &[explicit, (STEPS, "step = 1e-2")],
        &["is above the critical time step", "`solver = \"implicit\"` for long steps"],
    );
    for (changes, pieces) in [
        (run("device = \"gpu\""), ["the solver `static` runs on the CPU only", "`solver = \"implicit\"`"]),
        (
            run("precision = \"single\""),
            ["on the CPU, shells use double precision only", "leave `precision` out"],
        ),
        (
            run("mass-scaling = { target-step = 1e-3 }"),
            [
                "`mass-scaling` is not available for shells",
                "leave it out: the solver `static` has no critical time step",
            ],
        ),
        (
            run("on-unstable = \"stop\""),
            ["the critical time step of shells is not monitored", "leave it out"],
        ),
        (run("control = { load = \"pull\", arc-length = 0.1 }"), ["there is no load `pull`", "`push`"]),
        (
            run("control = { load = \"push\", arc-length = 0.1, volume = 1.0 }"),
            ["exactly one of `displacement`, `arc-length` and `volume`", "leave the others out"],
        ),
    ] {
        refused(&[(STEPS, &changes)], &pieces);
    }
    for (line, pieces) in [
        ("element = \"tet4\"", ["`wall` is a shell, and this element is for solids", "`dkt-opt`"]),
        ("hourglass = 0.1", ["`hourglass` is for `model = \"solid\"`", "has no effect here"]),
        (
            "fibre = [1, 0, 0]",
            ["`fibre` is for solids, membranes and shells with `layers`", "has no effect here"],
        ),
        ("velocity = [1, 0, 0]", ["a static run has no inertia", "has no effect"]),
        (
            "stiffness-damping = 1e-3",
            ["damping by stiffness needs the solver `implicit`, not `static`", "leave it out"],
        ),
    ] {
        refused(&[(THICK, &body(line))], &pieces);
    }
    let damped = body("stiffness-damping = 1e-3");
    refused(
        &[explicit, (THICK, &damped)],
        &["damping by stiffness needs the solver `implicit` for shells, not `explicit`"],
    );
    for key in ["iterations = 3", "linear = \"direct\"", "control = { load = \"push\", arc-length = 0.1 }"] {
        let name = key.split(' ').next().unwrap();
        refused(&[explicit, (STEPS, key)], &[&format!("`{name}` is for `solver ="), "has no effect here"]);
    }
    let relaxing = "poisson-ratio = 0.3\nprony = [{ part = \"isochoric\", weight = 0.3, time = 0.5 }]";
    refused(&[("poisson-ratio = 0.3", relaxing)], &["law `wall` relaxes, and `wall` is of model `shell`"]);
    refused(
        &[("every = 0.5", "every = 0.5\ndata = [\"cauchy-stress\"]")],
        &["bodies of model `shell` have no `cauchy-stress`"],
    );
    let output = wall(&[(STEPS, &run("device = \"auto\""))]).run(&[]);
    assert_eq!(output.done()["device"], "cpu");
    says(&output, &["runs on the CPU only"]);
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let block_jacobi = "step = 0.05\nlinear = { by = \"conjugate-gradients\", tolerance = 1e-6, preconditioner = \"block-jacobi\" }";
    for (solver, line) in [
        ("static", STEPS),
        ("implicit", "step = 0.05"),
        ("implicit", block_jacobi),
        ("implicit", "step = 0.05\nlinear = \"conjugate-gradients\""),
        ("explicit", "step = \"auto\""),
    ] {
        let workshop = wall(&[
            ("\"static\"", &format!("\"{solver}\"")),
            (STEPS, line),
            ("cells = [4, 2]", "cells = [16, 8]"),
        ]);
        for threads in ["1", "2"] {
            let output = workshop.run_into(&format!("out/{threads}"), &[&format!("run.threads={threads}")]);
            output.done();
        }
        for file in ["history.csv", "fields/000000.vtu", "fields/000002.vtu"] {
            let [one, two] =
                ["1", "2"].map(|threads| fs::read(workshop.path(&format!("out/{threads}/{file}"))).unwrap());
            assert!(one == two, "{solver}, {line}: {file} differs");
        }
    }
}

#[test]
fn json_tells_a_run_of_shells() {
    let done = wall(&[("pressure = 1", "pressure = 1e-3")]).run(&[]).done();
    assert_eq!((done["nodes"].as_u64(), done["elements"].as_u64()), (Some(15), Some(16)));
    assert!((done["mass"].as_f64().unwrap() - 0.04).abs() < 1e-15, "{done}");
    assert_eq!((&done["device"], &done["precision"]), (&"cpu".into(), &"double".into()));
    assert_eq!(done["steps"], 2);
    assert!(done["solver"]["newton_iterations"].as_u64().unwrap() >= 2, "{done}");
    assert_eq!(done["solver"]["linear_iterations"], 0, "{done}");
    for key in ["element_bound", "critical_step", "limiting_element", "stability"] {
        assert!(done[key].is_null(), "{key}: {done}");
    }
    // A pressure of 1 mPa on 0.02 m², which hardly turns.
    assert!((done["reactions"]["base"][2].as_f64().unwrap() + 2e-5).abs() < 1e-9, "{done}");
}

/// Twice the thickness, an eighth of the deflection.
#[test]
fn a_sweep_over_the_thickness_finds_the_cubes() {
    let workshop = wall(&[("pressure = 1", "pressure = 1e-3")]);
    let summary =
        workshop.sweep("out/sweep", &["body.wall.thickness=0.001,0.002,0.004"], SweepOptions::default());
    assert!(summary.failures.is_empty(), "{summary:?}");
    let text = workshop.read("out/sweep/sweep.csv");
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    let column = rows[0].iter().position(|name| name.ends_with("probe.end.displacement.z")).unwrap();
    let deflection = |row: usize| rows[row][column].parse::<f64>().unwrap();
    for row in [2, 3] {
        assert!((deflection(row - 1) / deflection(row) - 8.0).abs() < 0.01, "{text}");
    }
}

/// Each of the 15 nodes has a spring of 10 N/m and a fifteenth of the force.
#[test]
fn a_plate_on_springs_yields_by_their_stiffness() {
    let workshop = wall(&[
        ("type = \"fix\"", "type = \"spring\"\nstiffness = 10"),
        ("nodes = { set = \"x-min\" }", "nodes = \"all\""),
        ("type = \"pressure\"", "type = \"force\""),
        ("faces = \"all\"\npressure = 1", "nodes = \"all\"\ntotal = [0.01, 0, 0.02]"),
    ]);
    workshop.run(&[]).done();
    let (_, rows) = workshop.table("out/case/history.csv");
    let last = rows.last().unwrap();
    for (found, force) in last[last.len() - 3..].iter().zip([0.01, 0.0, 0.02]) {
        assert!((found - force / 150.0).abs() < 1e-9, "{last:?}");
    }
}

/// A load set upon a plate at once makes it swing to twice the deflection that it has at rest.
#[test]
fn an_explicit_plate_swings_about_its_equilibrium() {
    let soft = ("pressure = 1", "pressure = 1e-3\ncurve = \"hold\"");
    // A cantilever of this bending stiffness swings once in 3.7 s.
    let long = ("until = 1.0", "until = 4.0");
    let still = wall(&[soft, long]);
    still.run(&[]).done();
    let (_, rows) = still.table("out/case/history.csv");
    let rest = *rows.last().unwrap().last().unwrap();
    let swinging = wall(&[
        soft,
        long,
        ("\"static\"", "\"explicit\""),
        ("load-steps = 2\n", ""),
        ("csv\"\nevery = 0.5", "csv\"\nevery = 0.01"),
    ]);
    let done = swinging.run(&[]).done();
    assert!(done["steps"].as_u64().unwrap() > 1000, "{done}");
    let (_, rows) = swinging.table("out/case/history.csv");
    let deflections = rows.iter().map(|row| row.last().unwrap() / rest);
    let (low, high) = deflections.fold((0.0_f64, 0.0_f64), |(low, high), z| (low.min(z), high.max(z)));
    assert!(high > 1.9 && high < 2.2 && low > -0.2, "{low} to {high} of the deflection at rest");
}

/// A visual mesh on a plate that is turned by half a radian and shifted follows it exactly.
#[test]
fn a_carried_surface_follows_a_rigid_motion_exactly() {
    let (angle, shift) = (0.5_f64, [0.01, 0.02, 0.03]);
    let turned = |[x, y, z]: [f64; 3]| {
        let (s, c) = angle.sin_cos();
        [c * x - s * y - x + shift[0], s * x + c * y - y + shift[1], z - z + shift[2]]
    };
    let mut motion = String::new();
    for node in 0..15 {
        let [x, y, z] = turned([0.05 * f64::from(node % 5), 0.05 * f64::from(node / 5), 0.0]);
        motion += &format!("{node},{x:e},{y:e},{z:e}\n");
    }
    let workshop = wall(&[
        ("\"static\"", "\"implicit\""),
        (STEPS, "step = 0.1"),
        ("type = \"fix\"", "type = \"move\""),
        ("nodes = { set = \"x-min\" }", "nodes = \"all\"\nby = { csv = \"turn.csv\" }\nturn = [0, 0, 0.5]"),
        ("[load.push]", "[surface.skin]\non = \"wall\"\nmesh = { file = \"skin.off\" }\n\n[load.push]"),
        ("probes.end = { on = \"wall\"", "probes.skin = { on = \"skin\""),
        ("type = \"vtu\"", "type = \"vtu\"\non = \"skin\"\ndata = [\"displacement\"]"),
    ]);
    workshop.write("case/turn.csv", motion);
    workshop.write(
        "case/skin.off",
        off(&[[0.03, 0.01, 0.004], [0.17, 0.02, 0.001], [0.11, 0.09, -0.003]], &[&[0, 1, 2]]),
    );
    workshop.run(&[]).done();
    let (_, last) = workshop.series("out/case/fields.pvd").pop().unwrap();
    let moved = &last.mesh.point_data["displacement"];
    for (point, at) in last.mesh.points.iter().enumerate() {
        let expected = turned([at.x, at.y, at.z]);
        for c in 0..3 {
            assert!(
                (moved.item(point)[c] - expected[c]).abs() < 1e-9,
                "{point}: {:?} {expected:?}",
                moved.item(point)
            );
        }
    }
}

/// Number of triangles at each edge of a mesh of triangles; points at the same place (moved by
/// `displacement`) count as one.
fn sides(mesh: &Mesh) -> BTreeMap<[[i64; 3]; 2], u32> {
    let moved = &mesh.point_data["displacement"];
    let place = |node: u32| {
        let (at, by) = (mesh.points[node as usize], moved.item(node as usize));
        [0, 1, 2].map(|c| ((at[c] + by[c]) * 1e9).round() as i64)
    };
    let mut count = BTreeMap::new();
    for triangle in mesh.blocks.iter().flat_map(|block| block.cells()) {
        for corner in 0..3 {
            let mut ends = [place(triangle[corner]), place(triangle[(corner + 1) % 3])];
            ends.sort();
            *count.entry(ends).or_insert(0) += 1;
        }
    }
    count
}

#[test]
fn the_curved_surface_of_a_balloon_is_watertight_in_every_frame() {
    let workshop = wall(&[
        (PLATE, "mesh = { sphere = { radius = 0.1, levels = 1 } }"),
        ("{ set = \"x-min\" }", "{ nearest = { point = [0, 0, -0.1], count = 3 } }"),
        ("pressure = 1", "pressure = 1000\nspread = \"curved\""),
        ("every = 0.5", "every = 0.5\ncurved = 3"),
        ("at = [0.2, 0.05, 0]", "at = [0, 0, 0.1]"),
    ]);
    workshop.run(&[]).done();
    let frames = workshop.series("out/case/fields.pvd");
    assert_eq!(frames.len(), 3);
    for (time, frame) in frames {
        let sides = sides(&frame.mesh);
        assert_eq!(sides.len(), 80 * 9 * 3 / 2, "t = {time}");
        assert!(sides.values().all(|&count| count == 2), "t = {time}: the surface is open");
        assert_eq!(frame.mesh.point_data["normal"].components, 3);
    }
}
