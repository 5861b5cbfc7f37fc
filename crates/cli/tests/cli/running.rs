//! Outputs and messages of a run, through the real binary: files, names and numbers as promised.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use crate::support::{BLOCK, CORNERS, FROM_FILE, TETS, Told, Workshop, changed, fibres, labels, series, vtk};
use pliant_geometry::{CellKind, Mesh};
use serde_json::Value;

/// The repository.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

#[track_caller]
fn assert_close(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{what}: found {found}, expected {expected} ± {tolerance}"
    );
}

fn keys(object: &Value) -> Vec<&str> {
    object.as_object().expect("an object").keys().map(String::as_str).collect()
}

/// The keys of `--json`, in their order.
const KEYS: [&str; 27] = [
    "status",
    "error",
    "bodies",
    "nodes",
    "elements",
    "mass",
    "step",
    "element_bound",
    "critical_step",
    "limiting_element",
    "participants",
    "ties",
    "solver",
    "equilibria",
    "ended",
    "shell_strains",
    "device",
    "precision",
    "steps",
    "wall_seconds",
    "real_time_factor",
    "stability",
    "added_mass",
    "energy_balance",
    "reactions",
    "warnings",
    "files",
];

#[test]
fn json_has_exactly_the_promised_keys() {
    let workshop = Workshop::new(BLOCK);
    // The four automatic steps hardly resolve a gravity that sets in at once.
    let done = workshop.run(&["--step", "1e-3"]).done();
    assert_eq!(keys(&done), KEYS);
    assert!(done["error"].is_null());
    assert_eq!((done["nodes"].as_u64(), done["elements"].as_u64()), (Some(27), Some(48)));
    assert_close(done["mass"].as_f64().unwrap(), 1.0, 1e-12, "mass [kg]");
    assert_eq!(done["bodies"][0]["name"], "block");
    assert_eq!(keys(&done["reactions"]), ["base", "hand"]);
    assert_eq!(done["reactions"]["base"].as_array().unwrap().len(), 3);
    assert_eq!(done["limiting_element"]["body"], "block");
    assert!(done["energy_balance"].as_f64().unwrap() < 0.01);
    let files: Vec<&str> = done["files"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    let expected_files = ["fields.pvd", "history.csv", "plot.svg", "summary.md"];
    assert_eq!(files, expected_files.map(|file| format!("out/case/{file}")));
    assert!(files.iter().all(|file| workshop.path(file).is_file()));

    let refused = Workshop::block("density = 1000", "density = 0").run(&[]).json();
    assert_eq!(keys(&refused), KEYS);
    let error = ["kind", "body", "element", "node", "time", "load_step", "message"];
    assert_eq!(keys(&refused["error"]), error);
}

#[test]
fn csv_columns_are_named_as_promised() {
    let fields = "probes.middle = { on = \"block\", at = [0.05, 0.05, 0.05], data = [\"displacement\", \"cauchy-stress\", \"J\"] }\n\
                  probes.outside = { on = \"skin\", at = [0.1, 0.1, 0.1], data = [\"velocity\"] }";
    let good = BLOCK.lines().find(|line| line.starts_with("probes")).unwrap();
    let workshop = Workshop::block(good, fields);
    workshop.run(&[]).done();
    let (header, rows) = workshop.table("out/case/history.csv");
    let mut expected = vec!["time".to_owned()];
    for constraint in ["base", "hand"] {
        expected.extend(["x", "y", "z"].map(|axis| format!("reaction.{constraint}.{axis}")));
    }
    for energy in ["kinetic", "internal", "damping", "external", "hourglass", "balance"] {
        expected.push(format!("energy.{energy}"));
    }
    expected.extend(["x", "y", "z"].map(|axis| format!("probe.middle.displacement.{axis}")));
    for entry in ["xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"] {
        expected.push(format!("probe.middle.cauchy-stress.{entry}"));
    }
    expected.push("probe.middle.J".to_owned());
    expected.extend(["x", "y", "z"].map(|axis| format!("probe.outside.velocity.{axis}")));
    assert_eq!(header, expected);
    assert_eq!(rows[0][0], 0.0);
    assert_close(rows.last().unwrap()[0], 0.02, 1e-12, "last instant");
    assert!(rows.windows(2).all(|pair| pair[0][0] < pair[1][0]), "times increase");

    let some = Workshop::block(good, "reactions = [\"hand\"]\nenergy = false");
    some.run(&[]).done();
    let (header, _) = some.table("out/case/history.csv");
    assert_eq!(header, ["time", "reaction.hand.x", "reaction.hand.y", "reaction.hand.z"]);
}

/// Numbers per item of every available field.
const FIELDS: [(&str, usize); 10] = [
    ("displacement", 3),
    ("velocity", 3),
    ("cauchy-stress", 9),
    ("pk2-stress", 9),
    ("von-mises", 1),
    ("green-strain", 9),
    ("fibre-stretch", 1),
    ("pressure", 1),
    ("J", 1),
    ("energy-density", 1),
];

#[test]
fn vtu_arrays_are_named_as_promised_and_tensors_have_nine_components() {
    let all = FIELDS.map(|(name, _)| format!("\"{name}\"")).join(", ");
    let data = format!("data = [{all}]");
    let workshop = Workshop::block("data = [\"displacement\", \"von-mises\"]", &data);
    workshop.run(&[]).done();
    let frames = workshop.series("out/case/fields.pvd");
    assert_eq!(frames[0].0, 0.0, "frame 0");
    assert!((5..=7).contains(&frames.len()), "{}", frames.len());
    let mesh = &frames.last().unwrap().1.mesh;
    let tets = mesh.block(CellKind::Tet).unwrap();
    for (name, components) in FIELDS {
        let array = mesh.point_data.get(name).or_else(|| tets.data.get(name)).expect(name);
        assert_eq!(array.components, components, "{name}");
        assert!(array.values.iter().all(|value| value.is_finite()), "{name}");
    }
    // Symmetric, row-major.
    let stress = tets.data["cauchy-stress"].item(7);
    assert_eq!((stress[1], stress[2], stress[5]), (stress[3], stress[6], stress[7]));
    let trace = (stress[0] + stress[4] + stress[8]) / 3.0;
    assert_close(tets.data["pressure"].item(7)[0], -trace, 1e-6 * trace.abs(), "pressure");
    // Points stay at rest, the displacement warps them.
    assert_eq!(frames[0].1.mesh.points, mesh.points);

    let on_points =
        Workshop::block("data = [\"displacement\", \"von-mises\"]", &format!("at = \"points\"\n{data}"));
    on_points.run(&[]).done();
    let frames = on_points.series("out/case/fields.pvd");
    let mesh = &frames.last().unwrap().1.mesh;
    assert!(FIELDS.iter().all(|(name, _)| mesh.point_data.contains_key(*name)));
}

#[test]
fn options_take_the_place_of_what_the_scene_says() {
    let workshop = Workshop::new(BLOCK);
    let done = workshop.run(&["--until", "0.004", "--step", "0.001", "--out", "elsewhere/deep"]).done();
    assert_eq!(done["steps"], 4);
    assert_close(done["step"].as_f64().unwrap(), 0.001, 1e-15, "step [s]");
    assert!(workshop.path("elsewhere/deep/summary.md").exists() && !workshop.path("out").exists());

    let history = |arguments: &[&str]| {
        workshop.run(&[&["--force"], arguments].concat()).done();
        (workshop.read("out/case/history.csv"), workshop.read("out/case/summary.md"))
    };
    let (one, page) = history(&["--threads", "1"]);
    assert!(page.contains("| threads | 1 |") && page.contains("| precision | double |"), "{page}");
    let (three, page) = history(&["--threads", "3"]);
    assert!(page.contains("| threads | 3 |"), "{page}");
    assert_eq!(one, three, "the number of threads changed a bit");
    let (single, page) = history(&["--precision", "single"]);
    assert!(page.contains("| precision | single |"), "{page}");
    assert_ne!(one, single);
}

#[test]
fn a_folder_means_its_scene_and_names_the_outputs() {
    let workshop = Workshop::new(BLOCK);
    workshop.write("case/other.toml", BLOCK);
    for (scene, out) in [("case", "out/case"), ("case/other.toml", "out/other")] {
        let told = workshop.pliant(&["run", scene, "--json", "--until", "0.002"]);
        told.done();
        assert!(workshop.path(out).join("summary.md").exists(), "{out}");
    }
    let told = workshop.pliant(&["run", "case/scene.toml", "--until", "0.002"]);
    assert_eq!(told.code, 2, "the folder of the scene holds a run already: {}", told.out);
    let mut inside = workshop.command(&["run", ".", "--until", "0.002"]);
    let told = Told::from(inside.current_dir(workshop.path("case")).output().unwrap());
    assert_eq!(told.code, 0, "{}", told.err);
    assert!(workshop.path("case/out/case/summary.md").exists());
}

#[test]
fn a_run_tells_its_result_in_words() {
    let workshop = Workshop::new(BLOCK);
    let told = workshop.pliant(&["run", "case"]);
    assert_eq!(told.code, 0);
    for piece in [
        "27 nodes, 48 elements; step ",
        "real time; energies balance to",
        "reaction of `hand`: (",
        "wrote out/case/summary.md",
    ] {
        assert!(told.out.contains(piece), "no `{piece}` in {}", told.out);
    }
    let page = workshop.read("out/case/summary.md");
    for piece in [
        "| block |",
        "element bound",
        "critical time step (assembled model)",
        "Balance:",
        "| base |",
        "wall time",
        "real-time factor",
        "plot.svg",
    ] {
        assert!(page.contains(piece), "no `{piece}` in {page}");
    }
    let plot = workshop.read("out/case/plot.svg");
    assert!(
        plot.starts_with("<svg") && plot.contains("Reaction [N]") && plot.contains("external work"),
        "{plot}"
    );
}

#[test]
fn a_failed_run_says_where_and_leaves_what_it_wrote() {
    let scene =
        changed(BLOCK, "by = [0, 0, 0.001]", "by = [0, 0, -0.2]").replace("until = 0.02", "until = 0.1");
    let workshop = Workshop::new(&scene);
    let told = workshop.run(&[]);
    assert_eq!(told.code, 1);
    let json = told.json();
    assert_eq!((&json["status"], &json["error"]["kind"]), (&"failed".into(), &"inverted".into()));
    assert_eq!(json["error"]["body"], "block");
    let element = json["error"]["element"].as_u64().unwrap();
    assert!(element < 48 && json["error"]["node"].as_u64().unwrap() < 27, "{json}");
    let time = json["error"]["time"].as_f64().unwrap();
    assert!(time > 0.0 && time < 0.1, "{json}");
    let message = json["error"]["message"].as_str().unwrap();
    for piece in [&format!("element {element} of `block` is inverted"), "det F", "t = ", "finer mesh"] {
        assert!(message.contains(piece) && told.err.contains(piece), "no `{piece}` in {message}");
    }
    let frames = workshop.series("out/case/fields.pvd");
    assert!(frames.len() > 1 && frames.iter().all(|(written, _)| *written < time));
    let (_, rows) = workshop.table("out/case/history.csv");
    assert!(rows.last().unwrap()[0] <= time);
    let page = workshop.read("out/case/summary.md");
    assert!(page.contains("**Failed** (inverted)") && page.contains(message), "{page}");
}

#[test]
fn a_state_that_is_no_longer_finite_ends_the_run() {
    let told = Workshop::block("acceleration = [1, 0, 0]", "acceleration = [1e308, 0, 0]").run(&[]);
    assert_eq!(told.code, 1, "{}", told.err);
    let error = &told.json()["error"];
    assert_eq!(error["kind"], "not-finite");
    assert_eq!(error["body"], "block");
    assert!(error["node"].is_u64() && error["time"].is_f64() && error["element"].is_null(), "{error}");
}

#[test]
fn every_law_runs_by_its_name() {
    let elastic = "young-modulus = 10e3\npoisson-ratio = 0.45\n";
    let laws = [
        ("coupled-neo-hookean", elastic, ""),
        ("logarithmic-neo-hookean", elastic, ""),
        ("st-venant-kirchhoff", elastic, ""),
        ("corotational", elastic, ""),
        ("mooney-rivlin", "", "c10 = 1e3\nc01 = 700\npoisson-ratio = 0.45"),
        ("polynomial", "", "c10 = 1e3\nc01 = 700\nc20 = 100\npoisson-ratio = 0.45"),
        ("yeoh", "", "c1 = 1.7e3\nc2 = 100\nc3 = 50\npoisson-ratio = 0.45"),
        ("arruda-boyce", "shear-modulus = 3e3\nbulk-modulus = 30e3\n", "locking-stretch = 3"),
        ("gent", elastic, "limit = 2"),
        ("demiray", elastic, "exponent = 2"),
        ("veronda-westmann", "", "c1 = 300\nc2 = 3\npoisson-ratio = 0.45"),
        ("ogden", "", "terms = [{ shear-modulus = 3.4e3, exponent = 2 }]\npoisson-ratio = 0.45"),
        ("orthotropic", elastic, "e4 = 5e3\ne6 = 2e3\nsecond-fibre = [1, 0, 0]"),
        (
            "holzapfel-gasser-ogden",
            elastic,
            "fibre-modulus = 2e3\nfibre-exponent = 1\nfamilies = 2\nsecond-fibre = [1, 0, 0]",
        ),
        (
            "fung-orthotropic",
            "bulk-modulus = 30e3\n",
            "modulus = 3e3\nnormal = [[1, 0.2, 0.2], [0.2, 1, 0.2], [0.2, 0.2, 1]]\nshear = [1, 1, 1]",
        ),
    ];
    for (name, matrix, own) in laws {
        let mut scene = changed(BLOCK, "\"transversely-isotropic\"", &format!("\"{name}\""));
        scene = scene.replace(elastic, matrix).replace("fibre-modulus = 5e3", own);
        let workshop = Workshop::new(&scene);
        let told = workshop.run(&[]);
        assert_eq!(told.code, 0, "{name}: {}", told.err);
    }
}

#[test]
fn a_law_beyond_its_locking_strain_ends_the_run_with_an_error() {
    let scene = changed(BLOCK, "\"transversely-isotropic\"", "\"gent\"")
        .replace("fibre-modulus = 5e3", "limit = 0.05")
        .replace("by = [0, 0, 0.001]", "by = [0, 0, 0.1]");
    let told = Workshop::new(&scene).run(&[]);
    assert_eq!(told.code, 1, "{}", told.err);
    assert_eq!(told.json()["status"], "failed");
    assert!(told.err.contains("of `block`") && told.err.contains("t = "), "{}", told.err);
}

/// A block of soft tissue that gravity, set in at once, stretches by 38 %.
const SOFT: &str = r#"[scene]
until = 0.4
gravity = [9.81, 0, 0]

[run]
step = "auto"
on-unstable = "substep"

[law.tissue]
type = "neo-hookean"
young-modulus = 3000
poisson-ratio = 0.45

[body.block]
mesh = { block = { size = [0.1, 0.05, 0.05], cells = [8, 4, 4] }, as = "hexes" }
law = "tissue"
density = 1000

[constraint.wall]
type = "fix"
body = "block"
nodes = { set = "x-min" }

[output.history]
type = "csv"
every = 0.05
probes.tip = { on = "block", at = [0.1, 0.025, 0.025] }
"#;

#[test]
fn steps_are_cut_where_the_stable_one_falls_below_them_and_it_is_told() {
    let workshop = Workshop::new(SOFT);
    let done = workshop.run(&[]).done();
    let seen = &done["stability"];
    assert_eq!((&seen["on_unstable"], &seen["most_substeps"]), (&"substep".into(), &2.into()), "{seen}");
    assert!(seen["cuts"].as_u64() > Some(0) && seen["extra_steps"].as_u64() > Some(0), "{seen}");
    assert!(seen["limit_over_step"].as_f64().unwrap() < 1.0 && seen["first_cut"].is_f64(), "{seen}");
    assert!(!done["warnings"].to_string().contains("stable step"), "{done}");
    let page = workshop.read("out/case/summary.md");
    assert!(
        page.contains("During the run: smallest stable step seen: ") && page.contains("steps were cut"),
        "{page}"
    );
    let told = workshop.pliant(&["run", "case", "--force"]);
    assert!(told.out.contains("into at most 2 parts"), "{}", told.out);
    // `substep` is the default, and gives the result of a small step.
    let tip = |workshop: &Workshop| workshop.table("out/case/history.csv").1;
    let fine = Workshop::new(&changed(SOFT, "on-unstable = \"substep\"\n", ""));
    fine.run(&["--step", "3e-4"]).done();
    for (row, fine) in tip(&workshop).iter().zip(tip(&fine)) {
        let (tip, time) = (row.len() - 3, row[0]);
        // Rows are of the nearest instants, up to half a step of 3 ms apart at 0.5 m/s.
        assert_close(row[tip], fine[tip], 1e-3, &format!("the tip at {time} s"));
    }
    let default = Workshop::new(&changed(SOFT, "on-unstable = \"substep\"\n", "")).run(&[]).done();
    assert_eq!(default["stability"], *seen);
}

#[test]
fn below_the_stable_step_a_run_can_stop_or_only_report() {
    let told = Workshop::new(&changed(SOFT, "\"substep\"", "\"stop\"")).run(&[]);
    assert_eq!(told.code, 1);
    let error = &told.json()["error"];
    assert_eq!((&error["kind"], &error["body"]), (&"unstable".into(), &"block".into()));
    assert!(error["element"].is_u64() && error["node"].is_u64() && error["time"].is_f64(), "{error}");
    for piece in ["the largest stable step has fallen to", "smaller `step`", "on-unstable"] {
        assert!(told.err.contains(piece), "no `{piece}` in {}", told.err);
    }
    let told = Workshop::new(&changed(SOFT, "\"substep\"", "\"report\"")).run(&["--until", "0.11"]);
    let seen = &told.json()["stability"];
    assert!(seen["steps_below"].as_u64() > Some(0) && seen["extra_steps"] == 0, "{seen}");
    assert!(
        told.err.contains("warning: smallest stable step seen") && told.err.contains("below the step"),
        "{}",
        told.err
    );
}

#[test]
fn mass_scaling_enlarges_the_step_tells_the_added_mass_and_leaves_forces_at_rest() {
    let scene = SOFT
        .replace("until = 0.4", "until = 3.0")
        .replace("[9.81, 0, 0]", "[0, 0, -1.0]")
        .replace("density = 1000", "density = 1000\ndamping = 10");
    let plain = Workshop::new(&scene).run(&[]).done();
    let bound = plain["element_bound"].as_f64().unwrap();
    assert!(plain["added_mass"].is_null());
    let scaled = |factor: f64| {
        let line = format!("step = \"auto\"\nmass-scaling = {{ target-step = {:e} }}", factor * bound);
        Workshop::new(&changed(&scene, "step = \"auto\"", &line))
    };
    let workshop = scaled(1.02);
    let told = workshop.run(&[]);
    let done = told.done();
    let added = &done["added_mass"];
    // All elements are alike: each becomes heavier by 1.02² − 1.
    assert_close(added["percent"].as_f64().unwrap(), 4.04, 1e-9, "added mass in percent");
    assert_eq!(added["elements"], 128);
    assert_close(
        done["mass"].as_f64().unwrap(),
        plain["mass"].as_f64().unwrap(),
        0.0,
        "mass of the material",
    );
    assert_close(
        done["critical_step"].as_f64().unwrap() / plain["critical_step"].as_f64().unwrap(),
        1.02,
        1e-4,
        "limit",
    );
    for axis in 0..3 {
        let force = |run: &Value| run["reactions"]["wall"][axis].as_f64().unwrap();
        // 0.25 N hang there; e^(−10 · 3/2) of the vibration is left.
        assert_close(force(&done), force(&plain), 1e-6, "reaction at rest [N]");
    }
    assert!(
        told.err.contains("note: mass scaling to") && told.err.contains("4.04 % of the mass"),
        "{}",
        told.err
    );
    assert!(workshop.read("out/case/summary.md").contains("| mass added by scaling |"));
    let check = workshop.pliant(&["check", "case"]);
    assert!(
        check.out.contains("mass scaling  adds") && check.out.contains("4.04 %, to 128 elements"),
        "{}",
        check.out
    );
    let much = scaled(1.1).run(&["--until", "0.01"]);
    much.done();
    assert!(
        much.words().contains("21.00 % of the mass is added") && much.words().contains("more than 5 %"),
        "{}",
        much.err
    );
    let none = scaled(0.5).run(&["--until", "0.01"]).done();
    assert_eq!(none["added_mass"]["elements"], 0);
}

#[test]
fn hourglass_energy_above_5_percent_is_warned_about() {
    // Hexes one deep, pulled at one corner.
    let pulled = "[load.pull]\ntype = \"force\"\non = \"block\"\n\
                  nodes = { nearest = { point = [0.1, 0, 0] } }\ntotal = [0, 0.2, 0]\n\n[output.history]";
    let coarse = changed(SOFT, "cells = [8, 4, 4]", "cells = [2, 1, 1]");
    let coarse = changed(&changed(&coarse, "[output.history]", pulled), "gravity = [9.81, 0, 0]", "");
    let workshop = Workshop::new(&coarse);
    let told = workshop.run(&[]);
    let done = told.done();
    let warning = done["warnings"][0].as_str().unwrap();
    for piece in [
        "hourglass control holds",
        "% of the internal energy",
        "`block`",
        "finer mesh",
        "hex8-full",
        "`hourglass`",
    ] {
        assert!(warning.contains(piece), "no `{piece}` in {warning}");
    }
    assert!(told.err.contains(&format!("warning: {warning}")), "{}", told.err);
    assert!(workshop.read("out/case/summary.md").contains(&format!("**Warning:** {warning}")));
    let full = changed(&coarse, "density = 1000", "density = 1000\nelement = \"hex8-full\"");
    assert_eq!(Workshop::new(&full).run(&[]).done()["warnings"], serde_json::json!([]));
}

#[test]
fn a_killed_run_leaves_a_series_that_can_be_read() {
    let workshop = Workshop::block("until = 0.02", "until = 100");
    let mut child =
        workshop.command(&["run", "case"]).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let index = workshop.path("out/case/fields.pvd");
    let patience = Instant::now();
    while fs::read_to_string(&index).map_or(0, |text| text.matches("<DataSet").count()) < 5 {
        assert!(patience.elapsed() < Duration::from_secs(30), "no frames came");
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let frames = series(&index);
    assert!(frames.len() >= 5 && frames[0].0 == 0.0);
    assert!(!workshop.path("out/case/summary.md").exists());
    let (_, rows) = workshop.table("out/case/history.csv");
    assert!(!rows.is_empty());
    // The next run in the same folder leaves nothing of it.
    workshop.run(&["--force", "--until", "0.004"]).done();
    assert_eq!(workshop.series("out/case/fields.pvd").len(), 2);
    assert_eq!(fs::read_dir(workshop.path("out/case/fields")).unwrap().count(), 2);
}

/// A heavily damped block, fixed below, that is at rest when the scene ends.
fn resting(load: &str) -> String {
    format!(
        r#"[scene]
until = 1.5
[run]
threads = 1
[law.tissue]
type = "neo-hookean"
young-modulus = 10e3
poisson-ratio = 0.3
[body.block]
mesh = {{ block = {{ size = [0.1, 0.1, 0.1] }}, edge = 0.05, as = "hexes" }}
law = "tissue"
density = 1000
damping = 60
[surface.skin]
on = "block"
mesh = {{ block = {{ size = [0.1, 0.1, 0.1] }}, edge = 0.04 }}
[constraint.base]
type = "fix"
body = "block"
nodes = {{ set = "z-min" }}
[output.skin]
type = "vtu"
on = "skin"
every = 0.5
data = ["displacement", "velocity"]
{load}"#
    )
}

#[test]
fn at_rest_the_reaction_equals_the_load_for_every_kind_of_load() {
    let force = |on: &str, what: &str| {
        format!(
            "[load.one]\ntype = \"force\"\non = \"{on}\"\nnodes = {{ set = \"z-max\" }}\n{what}\nto = 0.1\n"
        )
    };
    let faces = |kind: &str, on: &str, what: &str| {
        let up = "{ normal = { direction = [0, 0, 1], within = 5 } }";
        format!("[load.one]\ntype = \"{kind}\"\non = \"{on}\"\nfaces = {up}\n{what}\nto = 0.1\n")
    };
    let top = "{ plane = { point = [0, 0, 0.1], normal = [0, 0, 1] } }";
    let on_skin = |text: String| text.replace("{ set = \"z-max\" }", top);
    let cases = [
        ("force, total", force("block", "total = [0.2, 0, -0.3]"), [0.2, 0.0, -0.3]),
        ("force, each of nine", force("block", "each = [0, 0.01, 0]"), [0.0, 0.09, 0.0]),
        ("force on the skin", on_skin(force("skin", "total = [0.2, 0, -0.3]")), [0.2, 0.0, -0.3]),
        ("traction", faces("traction", "block", "traction = [10, 0, -20]"), [0.1, 0.0, -0.2]),
        ("traction on the skin", faces("traction", "skin", "traction = [10, 0, -20]"), [0.1, 0.0, -0.2]),
        ("pressure", faces("pressure", "block", "pressure = 20"), [0.0, 0.0, -0.2]),
        ("pressure on the skin", faces("pressure", "skin", "pressure = 20"), [0.0, 0.0, -0.2]),
        (
            "gravity",
            "[load.one]\ntype = \"gravity\"\nacceleration = [0, 1, -2]\nto = 0.1\n".into(),
            [0.0, 1.0, -2.0],
        ),
    ];
    for (what, load, expected) in cases {
        let done = Workshop::new(&resting(&load)).run(&[]).done();
        let reaction = &done["reactions"]["base"];
        for (axis, expected) in expected.into_iter().enumerate() {
            // Damped to 1e-5; the loaded faces shrink by less than 1 %, which matters to a pressure alone.
            let tolerance = if what.starts_with("pressure") { 3e-3 } else { 1e-4 };
            assert_close(
                reaction[axis].as_f64().unwrap(),
                -expected,
                tolerance,
                &format!("{what}, axis {axis}"),
            );
        }
    }
}

#[test]
fn a_carried_surface_is_written_and_follows_its_body() {
    let load =
        "[load.one]\ntype = \"force\"\non = \"block\"\nnodes = { set = \"z-max\" }\ntotal = [0, 0, 1]\n";
    let workshop = Workshop::new(&(resting(load) + "[output.body]\ntype = \"vtu\"\nevery = 0.5\n"));
    workshop.run(&[]).done();
    let skin = workshop.series("out/case/skin.pvd").pop().unwrap().1.mesh;
    let body = workshop.series("out/case/body.pvd").pop().unwrap().1.mesh;
    assert!(skin.block(CellKind::Triangle).is_some() && skin.point_data.contains_key("velocity"));
    let lift = |mesh: &Mesh| {
        let corner =
            mesh.points.iter().position(|p| (p - pliant_geometry::Vector3::repeat(0.1)).norm() < 1e-9);
        mesh.point_data["displacement"].item(corner.expect("the corner is a point of both"))[2]
    };
    assert!(lift(&skin) > 1e-4);
    assert_close(lift(&skin), lift(&body), 1e-9, "lift of the corner [m]");
}

#[test]
fn several_bodies_run_side_by_side() {
    let other = r#"[law.stiff]
type = "coupled-neo-hookean"
shear-modulus = 20e3
bulk-modulus = 50e3
[body.other]
mesh = { block = { size = [0.05, 0.05, 0.05] }, edge = 0.025, as = "hexes", at = [1, 0, 0] }
law = "stiff"
element = "hex8"
hourglass = 0.1
density = 2000
[constraint.far]
type = "fix"
body = "other"
nodes = { set = "z-min" }
"#;
    let workshop =
        Workshop::new(&format!("{BLOCK}{other}[output.alone]\ntype = \"vtu\"\non = \"other\"\nevery = 1\n"));
    let done = workshop.run(&[]).done();
    let names: Vec<&str> =
        done["bodies"].as_array().unwrap().iter().filter_map(|b| b["name"].as_str()).collect();
    assert_eq!(names, ["block", "other"]);
    assert_close(done["mass"].as_f64().unwrap(), 1.25, 1e-12, "mass [kg]");
    assert_eq!(done["elements"], 48 + 8);
    let both = workshop.series("out/case/fields.pvd").pop().unwrap().1.mesh;
    assert_eq!(both.block(CellKind::Tet).unwrap().data["body"].values, [0.0; 48]);
    assert_eq!(both.block(CellKind::Hex).unwrap().data["body"].values, [1.0; 8]);
    let alone = workshop.series("out/case/alone.pvd").pop().unwrap().1.mesh;
    assert_eq!(alone.points.len(), 27);
}

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
    let check = workshop.pliant(&["check", "case"]).out;
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
    let told = workshop.run(&[]);
    assert_eq!(told.done()["elements"], 7);
    assert!(told.err.contains("`organ` is made of 2 separate parts"), "{}", told.err);
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
        let told = workshop.pliant(&["check", "case"]);
        assert_eq!(told.code, 0, "{to}: {}", told.err);
        let line = told.out.lines().find(|line| line.starts_with("constraint `base`")).unwrap().to_owned();
        line.split_whitespace().rev().nth(1).unwrap().parse::<usize>().unwrap()
    };
    // The other constraint would contradict most of them.
    let hand = BLOCK.find("[constraint.hand]").unwrap();
    let free = format!("{}{}", &BLOCK[..hand], &BLOCK[BLOCK.find("[load.push]").unwrap()..]);
    for (selection, expected) in cases {
        assert_eq!(count(&block, &free, "nodes = { set = \"z-min\" }", selection), expected, "{selection}");
    }
    for (selection, expected) in [("{ label = 1 }", 6), ("{ label-boundary = [1, 2] }", 4)] {
        assert_eq!(count(&organ, FROM_FILE, of_organ, selection), expected, "{selection}");
    }
}

/// The displacement along z of the top of [`BLOCK`] over time, with this motion.
fn motion(motion: &str) -> Vec<(f64, f64)> {
    let scene = changed(BLOCK, "by = [0, 0, 0.001]\ncurve = \"smooth-step\"", motion);
    let probe = "probes.top = { on = \"block\", at = [0.05, 0.05, 0.1] }";
    let workshop = Workshop::new(&(scene + probe + "\n"));
    workshop.run(&["--step", "1e-3"]).done();
    let (header, rows) = workshop.table("out/case/history.csv");
    let column = header.iter().position(|name| name == "probe.top.displacement.z").unwrap();
    rows.iter().map(|row| (row[0], row[column])).collect()
}

#[test]
fn every_curve_leads_the_motion() {
    let smooth = |s: f64| s * s * (3.0 - 2.0 * s);
    let polynomial = |s: f64| s * s * s * (10.0 + s * (6.0 * s - 15.0));
    let part = |t: f64, from: f64, to: f64| ((t - from) / (to - from)).clamp(0.0, 1.0);
    type Expected<'a> = Box<dyn Fn(f64) -> f64 + 'a>;
    let cases: [(&str, Expected<'_>); 10] = [
        ("by = [0, 0, 1e-3]", Box::new(|t| 1e-3 * smooth(t / 0.02))),
        ("by = [0, 0, 1e-3]\ncurve = \"ramp\"\nto = 0.01", Box::new(|t| 1e-3 * part(t, 0.0, 0.01))),
        (
            "by = [0, 0, 1e-3]\ncurve = \"smooth-step\"\nfrom = 0.004\nto = 0.012",
            Box::new(|t| 1e-3 * smooth(part(t, 0.004, 0.012))),
        ),
        ("by = [0, 0, 1e-3]\ncurve = \"polynomial-10-15-6\"", Box::new(|t| 1e-3 * polynomial(t / 0.02))),
        (
            "by = [0, 0, 1e-3]\ncurve = { table = [[0, 0], [0.01, 1], [0.02, 0.5]] }",
            Box::new(|t| 1e-3 * (100.0 * t).min(1.5 - 50.0 * t)),
        ),
        (
            "by = [0, 0, 1e-5]\ncurve = \"hold\"\nfrom = 0.01",
            Box::new(|t| 1e-5 * f64::from(u8::from(t > 0.0099))),
        ),
        // From the start: the run begins with the nodes already there.
        ("by = [0, 0, 1e-5]\ncurve = \"hold\"", Box::new(|_| 1e-5)),
        ("velocity = [0, 0, 0.05]\ncurve = \"hold\"", Box::new(|t| 0.05 * t)),
        ("velocity = [0, 0, 0.05]\ncurve = \"ramp\"", Box::new(|t| 0.05 * t * t / 0.04)),
        (
            "velocity = [0, 0, 0.05]\ncurve = { table = [[0, 0], [0.01, 1], [0.02, 1]] }",
            Box::new(|t| if t < 0.01 { 2.5 * t * t } else { 0.05 * (t - 0.005) }),
        ),
    ];
    for (given, expected) in cases {
        let rows = motion(given);
        assert_eq!(rows.len(), 6, "{given}");
        for (time, z) in rows {
            assert_close(z, expected(time), 1e-12, &format!("{given} at {time} s"));
        }
    }
}

#[test]
fn a_load_follows_its_curve() {
    let load = "[load.one]\ntype = \"force\"\non = \"block\"\nnodes = { set = \"z-max\" }\ntotal = [0, 0, 1]\n\
                curve = { table = [[0, 0], [0.2, 1], [0.7, 1], [0.71, -0.5]] }\n\
                [output.history]\ntype = \"csv\"\nevery = 0.05\n";
    let workshop = Workshop::new(&resting(load));
    workshop.run(&[]).done();
    let (header, rows) = workshop.table("out/case/history.csv");
    let column = header.iter().position(|name| name == "reaction.base.z").unwrap();
    let at = |time: f64| {
        rows.iter().min_by(|a, b| (a[0] - time).abs().total_cmp(&(b[0] - time).abs())).unwrap()[column]
    };
    assert_close(at(0.7), -1.0, 1e-3, "reaction while the load is held [N]");
    assert_close(at(1.5), 0.5, 1e-3, "reaction to the load turned round [N]");
}

/// A block of nearly incompressible tissue whose end is moved sideways, of an element, by a solver.
fn bent(element: &str, run: &str) -> String {
    let cells = if element.starts_with("tet") { "tets" } else { "hexes" };
    format!(
        r#"
[scene]
until = 1.0
[run]
{run}
[law.tissue]
type = "neo-hookean"
young-modulus = 10e3
poisson-ratio = 0.45
[body.block]
mesh = {{ block = {{ size = [0.1, 0.05, 0.05] }}, edge = 0.025, as = "{cells}" }}
element = "{element}"
law = "tissue"
density = 1000
damping = 60
[constraint.wall]
type = "fix"
body = "block"
nodes = {{ set = "x-min" }}
[constraint.hand]
type = "move"
body = "block"
nodes = {{ set = "x-max" }}
by = [0, 0, 0.01]
to = 0.4
[output.fields]
type = "vtu"
every = 1.0
data = ["displacement", "von-mises", "pressure"]
"#
    )
}

fn hand(text: &str) -> f64 {
    Workshop::new(text).run(&[]).done()["reactions"]["hand"][2].as_f64().unwrap()
}

#[test]
fn every_element_reaches_the_same_rest_by_dynamics_and_without() {
    let mut forces = Vec::new();
    for element in ["tet4", "tet4-anp", "tet4-ianp", "tet4-ianp-niftysim", "hex8", "hex8-full"] {
        let [dynamic, still] =
            ["", "solver = \"quasi-static\"\nload-steps = 2"].map(|run| hand(&bent(element, run)));
        // The explicit run still moves a little after 0.6 s of hold.
        assert_close(dynamic, still, 2e-3 * still, element);
        forces.push(still);
    }
    // Averaging the pressure loosens tets.
    assert!(forces[1] < 0.98 * forces[0], "{forces:?}");
}

#[test]
fn a_quasi_static_body_that_nothing_holds_is_refused_while_it_runs() {
    let free = bent("hex8", "solver = \"quasi-static\"\ntolerance = 1e-9")
        .replace("[constraint.wall]", "[constraint.unused]")
        .replace("until = 1.0", "until = 1.0\ngravity = [0, 0, -9.81]")
        .replace("nodes = { set = \"x-min\" }", "nodes = { set = \"x-min\" }\ncomponents = [\"y\"]")
        .replace("by = [0, 0, 0.01]", "by = [0, 0, 0.01]\ncomponents = [\"y\"]");
    let told = Workshop::new(&free).run(&[]);
    assert_eq!(told.code, 1, "{}", told.err);
    let error = &told.json()["error"];
    assert_eq!(error["kind"], "not-converged");
    assert_eq!(keys(&error["load_step"]), ["number", "of", "iterations", "residual"]);
    assert_eq!(
        (error["load_step"]["number"].as_u64(), error["load_step"]["of"].as_u64()),
        (Some(0), Some(10))
    );
    assert!(error["load_step"]["residual"].as_f64().unwrap() > 1e-9 && error["node"].is_number(), "{error}");
    // Gravity acts from the start: its equilibrium comes before the first load step.
    for piece in ["the loads at t = 0: no equilibrium", "largest at node", "iterations", "nothing holds"] {
        assert!(told.err.contains(piece), "{}", told.err);
    }
}

#[test]
fn load_steps_that_are_not_as_asked_or_not_equal_are_told() {
    let run = |lines: &str| {
        let workshop = Workshop::new(&bent("hex8", &format!("solver = \"quasi-static\"\n{lines}")));
        let told = workshop.run(&[]);
        (told.err.clone(), workshop.read("out/case/summary.md"), told.done())
    };
    let (said, page, json) = run("step = 0.3");
    let note = "a step of 0.3000 s does not divide the 1.000 s of the scene: it takes 4 steps of 0.2500 s";
    assert!(said.contains(note) && page.contains(note), "{said}\n{page}");
    assert_eq!((&json["step"], &json["steps"]), (&0.25.into(), &4.into()));
    let (said, page, unequal) = run("load-steps = { times = [0.1, 0.4] }");
    let note = "the load steps end at t = 0.1000, 0.4000, 1.000 s";
    assert!(said.contains(note) && page.contains(note), "{said}\n{page}");
    assert_eq!(unequal["steps"], 3);
    assert_close(
        unequal["reactions"]["hand"][2].as_f64().unwrap(),
        json["reactions"]["hand"][2].as_f64().unwrap(),
        1e-6,
        "the same equilibrium at the end",
    );
    let equilibria = &unequal["equilibria"];
    assert_eq!(keys(equilibria), ["found", "external_error", "displacement_error"]);
    assert!(equilibria["displacement_error"].as_f64().unwrap() < 1e-3, "{equilibria}");
    for (lines, pieces) in [
        ("load-steps = { times = [0.4, 0.1] }", ["increase", "out of order"]),
        ("step = 0.5\nload-steps = { times = [0.4] }", ["in two ways", "leave one of them out"]),
    ] {
        let scene = bent("hex8", &format!("solver = \"quasi-static\"\n{lines}"));
        let told = Workshop::new(&scene).run(&[]);
        assert!(told.code != 0 && pieces.iter().all(|piece| told.err.contains(piece)), "{}", told.err);
    }
}

#[test]
fn the_scene_in_the_readme_runs() {
    let readme = fs::read_to_string(Path::new(ROOT).join("README.md")).unwrap();
    let text = readme.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    Workshop::new(text).run(&["--until", "0.05"]).done();
}

#[test]
fn built_in_shapes_fill_their_volume_with_tets_and_hexes() {
    // The volume [m³] and how far a coarse mesh may be off: voxels and flat facets miss part of a curved surface.
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

#[test]
fn mesh_files_of_every_volume_format_become_bodies() {
    let data = Path::new(ROOT).join("crates/geometry/tests/data");
    let files = ["gmsh1.msh", "gmsh22.msh", "gmsh22-binary.msh", "gmsh41.msh", "gmsh41-binary.msh"];
    for file in files {
        let workshop = Workshop::new(&FROM_FILE.replace("organ.vtk", "organ.msh"));
        fs::copy(data.join(file), workshop.path("case/organ.msh")).unwrap();
        let done = workshop.run(&["--until", "1e-4"]).done();
        assert_eq!(done["elements"], 48, "{file}");
    }
    // Converted, a mesh is the same body in every format.
    let workshop = Workshop::new(FROM_FILE);
    workshop.write("case/organ.vtk", vtk(&CORNERS, &TETS, &labels(&[1, 1, 1, 2, 2, 2])));
    let reaction = workshop.run(&[]).done()["reactions"]["base"].clone();
    for ending in ["msh", "vtu"] {
        let told = workshop.pliant(&["info", "case/organ.vtk", "--convert", &format!("case/organ.{ending}")]);
        assert_eq!(told.code, 0, "{}", told.err);
        workshop.write("case/scene.toml", FROM_FILE.replace("organ.vtk", &format!("organ.{ending}")));
        assert_eq!(workshop.run(&["--force"]).done()["reactions"]["base"], reaction, "{ending}");
    }
}

#[test]
fn info_asks_whether_a_large_mesh_is_in_millimetres() {
    let workshop = Workshop::new("");
    workshop.write("organ.vtk", vtk(&CORNERS.map(|p| p.map(|x| 1000.0 * x)), &TETS, ""));
    let hint = "`--scale 0.001` brings millimetres to metres";
    assert!(workshop.pliant(&["info", "organ.vtk"]).out.contains(hint));
    assert!(!workshop.pliant(&["info", "organ.vtk", "--scale", "0.001"]).out.contains(hint));
}

#[test]
fn mesh_files_of_every_surface_format_become_surfaces() {
    let workshop = Workshop::new(BLOCK);
    let quads = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    let corners: String = CORNERS.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
    workshop.write("case/skin.obj", corners + quads);
    for ending in ["stl", "ply"] {
        let told = workshop.pliant(&["info", "case/skin.obj", "--convert", &format!("case/skin.{ending}")]);
        assert_eq!(told.code, 0, "{}", told.err);
    }
    let off = "OFF\n4 2 0\n0 0 0.1\n0.1 0 0.1\n0.1 0.1 0.1\n0 0.1 0.1\n3 0 1 2\n3 0 2 3\n";
    workshop.write("case/skin.off", off);
    for ending in ["obj", "stl", "ply", "off"] {
        let mesh = format!("mesh = {{ file = \"skin.{ending}\" }}");
        let scene = changed(BLOCK, "mesh = { block = { size = [0.1, 0.1, 0.1] }, edge = 0.04 }", &mesh);
        let scene = changed(&scene, "direction = [1, 0, 0]", "direction = [0, 0, 1]");
        workshop.write("case/scene.toml", scene);
        workshop.run(&["--force", "--until", "0.002"]).done();
    }
}

#[test]
fn scale_and_at_bring_a_mesh_to_metres_and_in_place() {
    let millimetres = CORNERS.map(|point| point.map(|x| 1000.0 * x));
    let scene = changed(FROM_FILE, "\"organ.vtk\"", "\"organ.vtk\", scale = 0.001, at = [0.5, 0, 0]");
    let workshop = Workshop::new(&scene);
    workshop.write("case/organ.vtk", vtk(&millimetres, &TETS, ""));
    let told = workshop.run(&[]);
    assert_close(told.done()["mass"].as_f64().unwrap(), 1.0, 1e-12, "mass [kg]");
    assert_eq!(told.err, "", "nothing to doubt");
    let mesh = workshop.series("out/case/fields.pvd").remove(0).1.mesh;
    let (low, high) = mesh.bounds().unwrap();
    assert_close(low.x, 0.5, 1e-12, "left end [m]");
    assert_close(high.x, 0.6, 1e-12, "right end [m]");
}

#[test]
fn a_new_scene_runs_as_it_is() {
    let workshop = Workshop::new(BLOCK);
    for name in ["my-organ", "deep/er \"organ\""] {
        let told = workshop.pliant(&["new", name]);
        assert_eq!(told.code, 0, "{}", told.err);
        assert!(told.out.contains("try: pliant run"), "{}", told.out);
        let told = workshop.pliant(&["run", name, "--json", "--until", "0.01"]);
        told.done();
    }
    let check = workshop.pliant(&["check", "my-organ"]);
    assert!(check.out.starts_with("my-organ\n"), "{}", check.out);
    assert_eq!((check.code, check.err.as_str()), (0, ""), "a starter scene leaves no doubts");
}

#[test]
fn check_prints_the_model_and_writes_nothing() {
    let workshop = Workshop::new(BLOCK);
    let told = workshop.pliant(&["check", "case"]);
    assert_eq!((told.code, told.err.as_str()), (0, ""));
    for piece in [
        "body `block`",
        "27 nodes, 48 elements",
        "mass 1.000 kg",
        "transversely-isotropic",
        "1 relaxing term\n",
        "quality",
        "0.9–1.0",
        "surface `skin` on `block`",
        "constraint `base`: fixes xyz of 9 nodes",
        "constraint `hand`: moves xyz of 9 nodes",
        "load `push`: (0.1000, 0, 0) N in all on 1 node",
        "load `wind`: (0, 0.1000, 0) N in all on",
        "load `squeeze`: 20.00 Pa on 8 faces",
        "load `tilt`: (1.000, 0, 0) m/s² on `block`",
        "output `fields`: fields.pvd, a frame every 0.004000 s",
        "element bound",
        "set by element 0 (tet4) of `block`",
        "critical time step",
        "assembled",
        "expected cost",
        "real-time factor",
    ] {
        assert!(told.out.contains(piece), "no `{piece}` in {}", told.out);
    }
    let left: Vec<_> =
        fs::read_dir(workshop.path("")).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["case"]);
    assert_eq!(fs::read_dir(workshop.path("case")).unwrap().count(), 1);
}

#[test]
fn info_tells_what_a_mesh_holds_and_what_is_wrong() {
    let workshop = Workshop::new(BLOCK);
    workshop.write("good.vtk", vtk(&CORNERS, &TETS, &labels(&[1; 6])));
    let told = workshop.pliant(&["info", "good.vtk", "--scale", "0.5"]);
    assert_eq!(told.code, 0, "{}", told.err);
    for piece in [
        "legacy VTK 3.0 ASCII",
        "from (0, 0, 0) to (0.05000",
        "tet cells        6",
        "1.250000e-4 m³",
        "cell data `label`",
        "no faults found",
    ] {
        assert!(told.out.contains(piece), "no `{piece}` in {}", told.out);
    }
    let mut tets = TETS;
    tets[2] = &[0, 6, 2, 7];
    workshop.write("bad.vtk", vtk(&CORNERS, &tets, ""));
    let told = workshop.pliant(&["info", "bad.vtk"]);
    assert_eq!(told.code, 0);
    assert!(told.out.contains("inverted cells: 1 (tet 2)"), "{}", told.out);
    let object = workshop.pliant(&["info", "bad.vtk", "--json"]).json();
    assert_eq!((&object["usable"], &object["cells"]["tet"]), (&false.into(), &6.into()), "{object}");
    let open = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n";
    workshop.write("open.off", open);
    assert!(workshop.pliant(&["info", "open.off"]).out.contains("open edges: 4"));
}

#[test]
fn every_subcommand_helps_with_an_example() {
    let workshop = Workshop::new(BLOCK);
    for subcommand in [&[][..], &["run"], &["check"], &["sweep"], &["new"], &["schema"], &["info"]] {
        let told = workshop.pliant(&[subcommand, &["--help"]].concat());
        assert_eq!(told.code, 0);
        let example =
            told.out.split_once("Example").unwrap_or_else(|| panic!("{subcommand:?}: {}", told.out)).1;
        assert!(example.contains(&format!("pliant {}", subcommand.first().unwrap_or(&"run"))), "{example}");
    }
    assert_eq!(workshop.pliant(&[]).code, 2);
}

/// The schema of `pliant schema`.
fn schema() -> Value {
    let told = Workshop::new(BLOCK).pliant(&["schema"]);
    assert_eq!(told.code, 0);
    told.json()
}

/// The target of a schema reference, and its alternatives.
fn alternatives<'s>(schema: &'s Value, root: &'s Value) -> Vec<&'s Value> {
    let target = schema["$ref"].as_str().and_then(|path| root.pointer(path.strip_prefix('#')?));
    let parts = ["anyOf", "oneOf"].into_iter().filter_map(|key| schema[key].as_array()).flatten();
    let deeper = target.into_iter().chain(parts).flat_map(|part| alternatives(part, root));
    std::iter::once(schema).chain(deeper).collect()
}

/// Asserts that a schema has every key of a value, recursively.
fn assert_known(value: &toml::Value, schemas: &[&Value], root: &Value, path: &str) {
    let all: Vec<&Value> = schemas.iter().flat_map(|schema| alternatives(schema, root)).collect();
    match value {
        toml::Value::Table(table) => {
            for (key, child) in table {
                let of = |schema: &&'_ Value| {
                    let own = schema["properties"].get(key);
                    let found =
                        own.or_else(|| schema.get("additionalProperties").filter(|other| other.is_object()));
                    found.cloned()
                };
                let known: Vec<Value> = all.iter().filter_map(of).collect();
                assert!(!known.is_empty(), "the schema has no `{path}.{key}`");
                assert_known(child, &known.iter().collect::<Vec<_>>(), root, &format!("{path}.{key}"));
            }
        }
        toml::Value::Array(items) => {
            let of_items: Vec<&Value> = all.iter().filter_map(|schema| schema.get("items")).collect();
            items.iter().for_each(|item| assert_known(item, &of_items, root, path));
        }
        _ => {}
    }
}

#[test]
fn the_schema_knows_every_key_of_the_shipped_scenes() {
    let schema = schema();
    assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
    let shipped = fs::read_dir(Path::new(ROOT).join("scenes")).unwrap();
    let mut scenes: Vec<String> = shipped
        .map(|folder| fs::read_to_string(folder.unwrap().path().join("scene.toml")).expect("a scene"))
        .collect();
    scenes.extend([BLOCK.to_owned(), pliant_scene::starter("a scene"), FROM_FILE.to_owned()]);
    for text in scenes {
        let scene: toml::Table = toml::from_str(&text).unwrap();
        assert_known(&toml::Value::Table(scene), &[&schema], &schema, "");
    }
    for (table, section) in
        [("constraint", "fix"), ("load", "pressure"), ("output", "csv"), ("law", "neo-hookean")]
    {
        let kinds = schema["properties"][table]["additionalProperties"]["oneOf"].as_array().unwrap();
        assert!(kinds.iter().any(|kind| kind["properties"]["type"]["const"] == section), "{table} {section}");
    }
}

#[test]
fn the_reference_page_lists_every_kind_of_table() {
    let page = Workshop::new(BLOCK).pliant(&["schema", "--markdown"]).out;
    for piece in
        ["## `[scene]`", "### `type = \"transversely-isotropic\"`", "| `edge` |", "| `weight` |", "kg/m³"]
    {
        assert!(page.contains(piece), "no `{piece}`");
    }
}

#[test]
fn the_shipped_scenes_pass_the_check() {
    let workshop = Workshop::new(BLOCK);
    for folder in fs::read_dir(Path::new(ROOT).join("scenes")).unwrap() {
        let scene = folder.unwrap().path();
        let told = workshop.pliant(&["check", scene.to_str().unwrap()]);
        assert_eq!((told.code, told.err.as_str()), (0, ""), "{}", scene.display());
    }
    let liver = Path::new(ROOT).join("scenes/liver");
    let told = workshop.pliant(&["run", liver.to_str().unwrap(), "--json", "--until", "0.01"]);
    assert!(told.done()["elements"].as_u64().unwrap() >= 2400);
    assert!(workshop.path("out/liver/summary.md").exists());
}

#[test]
fn a_reader_that_leaves_early_is_no_mistake() {
    let workshop = Workshop::new(BLOCK);
    let mut child =
        workshop.command(&["schema"]).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let told = Told::from(child.wait_with_output().unwrap());
    assert_eq!((told.code, told.err.as_str()), (0, ""));
}

/// A real organ, read from the folder in PLIANT_DATA (the mesh is not ours to ship).
#[test]
fn the_liver_of_sofa_is_pulled_by_one_lobe() {
    let Some(data) = std::env::var_os("PLIANT_DATA") else {
        println!("skipped: set PLIANT_DATA to the folder that holds liver-sofa/liver2.msh");
        return;
    };
    let workshop = Workshop::new(include_str!("support/liver2.toml"));
    let mesh = Path::new(&data).join("liver-sofa/liver2.msh");
    fs::copy(&mesh, workshop.path("case/liver2.msh"))
        .unwrap_or_else(|error| panic!("{}: {error}", mesh.display()));
    let done = workshop.run(&["--until", "0.4"]).done();
    assert_eq!(done["elements"], 1493);
    assert!(done["energy_balance"].as_f64().unwrap() < 0.01, "{done}");
    let frames = workshop.series("out/case/fields.pvd");
    assert_eq!(frames[0].1.mesh.points.len(), 507);
}

/// [`FROM_FILE`] with the upper nodes of the cube moved as `by` says.
fn moved_node_by_node(by: &str) -> String {
    let nodes = "nodes = { nearest = { point = [0, 0, 0], count = 4 } }";
    let base = "nodes = { box = [[0, 0, 0], [0.1, 0.1, 0]] }";
    let lid = format!(
        "{base}\n[constraint.lid]\ntype = \"move\"\nbody = \"organ\"\nnodes = {{ box = [[0, 0, 0.1], [0.1, 0.1, 0.1]] }}\n\
         by = {by}\ncurve = {{ table = [[0, 0], [0.005, 1], [0.01, 0.5]] }}\n"
    );
    changed(FROM_FILE, nodes, &lid)
}

#[test]
fn every_node_goes_its_own_way_from_point_data_or_a_table_with_every_solver() {
    let by = |node: usize| [0.001 * node as f64, -0.002, 0.0005 * node as f64];
    let vectors: Vec<String> = (0..8).map(|node| by(node).map(|x| x.to_string()).join(" ")).collect();
    let data = format!("POINT_DATA 8\nVECTORS shift double\n{}\n", vectors.join("\n"));
    let table: Vec<String> = (4..8)
        .rev()
        .map(|node| format!("{node},{}\n", by(node).map(|x| (1000.0 * x).to_string()).join(",")))
        .collect();
    for solver in ["explicit", "quasi-static"] {
        for motion in ["{ point-data = \"shift\" }", "{ csv = \"motion.csv\", scale = 0.001 }"] {
            let run = format!("[run]\nsolver = \"{solver}\"");
            let workshop = Workshop::new(&changed(&moved_node_by_node(motion), "[run]", &run));
            workshop.write("case/organ.vtk", vtk(&CORNERS, &TETS, &data));
            workshop.write("case/motion.csv", format!("node,x,y,z\n{}", table.concat()));
            workshop.run(&[]).done();
            let frames = workshop.series("out/case/fields.pvd");
            for (frame, factor) in [(1, 1.0), (2, 0.5)] {
                let (time, file) = &frames[frame];
                let u = &file.mesh.point_data["displacement"];
                for node in 4..8 {
                    for c in 0..3 {
                        let expected = factor * by(node)[c];
                        // The explicit run samples the time nearest to 5 ms.
                        let slack = if frame == 1 && solver == "explicit" { 1e-3 } else { 1e-12 };
                        assert_close(u.item(node)[c], expected, slack, &format!("node {node} at {time} s"));
                    }
                }
            }
        }
    }
}

/// A node keeps its number of the file after a repair has moved it up.
#[test]
fn a_table_of_motions_names_nodes_as_the_mesh_file_does() {
    let mut points = vec![[9.0; 3]];
    points.extend(CORNERS);
    let tets: Vec<Vec<u32>> = TETS.iter().map(|tet| tet.iter().map(|node| node + 1).collect()).collect();
    let tets: Vec<&[u32]> = tets.iter().map(Vec::as_slice).collect();
    let scene = changed(
        &moved_node_by_node("{ csv = \"motion.csv\" }"),
        "\"organ.vtk\"",
        "\"organ.vtk\", scale = 1, fix = \"drop-unused\"",
    );
    let workshop = Workshop::new(&scene);
    workshop.write("case/organ.vtk", vtk(&points, &tets, ""));
    workshop.write("case/motion.csv", "5,0,0,0.001\n6,0,0,0.002\n7,0,0,0.003\n8,0,0,0.004\n");
    workshop.run(&[]).done();
    let frames = workshop.series("out/case/fields.pvd");
    let u = &frames.last().unwrap().1.mesh.point_data["displacement"];
    for node in 4..8 {
        assert_close(u.item(node)[2], 0.0005 * (node - 3) as f64, 1e-12, &format!("node {node}"));
    }
}

#[test]
fn the_brain_below_an_opening_shifts_as_the_reference_says() {
    let workshop = Workshop::new("");
    let scene = Path::new(ROOT).join("scenes/brain-shift");
    let told = workshop.pliant(&["run", scene.to_str().unwrap(), "--json", "--out", "shift"]);
    told.done();
    let (header, rows) = workshop.table("shift/targets.csv");
    let last = rows.last().unwrap();
    // CalculiX with quadratic tets of 9 mm; its mesh is accurate to 0.1 mm, this mesh adds 0.15 mm.
    for (probe, reference) in [
        ("middle", [-1.09e-03, -1.03e-03, -5.75e-04]),
        ("below-the-opening", [-2.98e-03, -5.53e-04, -2.36e-03]),
    ] {
        for (axis, u) in ["x", "y", "z"].iter().zip(reference) {
            let column =
                header.iter().position(|name| *name == format!("probe.{probe}.displacement.{axis}")).unwrap();
            assert!((last[column] - u).abs() < 0.25e-3, "{probe} {axis}: {} {u}", last[column]);
        }
    }
}

/// Without damping and loads: u = v t, and the kinetic energy ½ m v² from the first row on.
#[test]
fn a_block_that_starts_with_a_velocity_flies_on_with_its_energy() {
    for precision in ["double", "single"] {
        let scene = format!(
            r#"[scene]
until = 0.05
[run]
precision = "{precision}"
step = 2e-3
[law.tissue]
type = "neo-hookean"
young-modulus = 3e3
poisson-ratio = 0.4
[body.block]
mesh = {{ block = {{ size = [0.1, 0.1, 0.1] }}, edge = 0.05 }}
law = "tissue"
density = 1000
velocity = [1, -2, 0.5]
[output.history]
type = "csv"
every = 0.01
probes.middle = {{ on = "block", at = [0.05, 0.05, 0.05], data = ["displacement", "velocity"] }}
"#
        );
        let workshop = Workshop::new(&scene);
        let told = workshop.run(&[]);
        told.done();
        assert!(told.err.contains("held by no constraint: it flies on as it started"), "{}", told.err);
        let (header, rows) = workshop.table("out/case/history.csv");
        let column = |name: &str| header.iter().position(|own| own == name).unwrap();
        let slack = if precision == "double" { 1e-12 } else { 1e-5 };
        assert!(rows.len() >= 6);
        for row in &rows {
            for (axis, v) in ["x", "y", "z"].iter().zip([1.0, -2.0, 0.5]) {
                let at = |what: &str| row[column(&format!("probe.middle.{what}.{axis}"))];
                assert_close(at("velocity"), v, slack, "velocity");
                assert_close(at("displacement"), v * row[0], slack, "displacement");
            }
            assert_close(row[column("energy.kinetic")], 0.5 * 5.25, 10.0 * slack, "kinetic energy");
            assert_close(row[column("energy.balance")], 0.0, 10.0 * slack, "balance");
        }
    }
}

/// Under gravity and damping α: v' = g − α v, so the first steps are accurate to second order.
#[test]
fn damping_slows_what_started_with_a_velocity() {
    let scene = changed(BLOCK, "damping = 5", "damping = 5\nvelocity = [2, 0, 0]");
    let free = &scene[..scene.find("[constraint.base]").unwrap()];
    let output = "[output.history]\ntype = \"csv\"\nevery = 0.001\nprobes.middle = { on = \"block\", at = [0.05, 0.05, \
                  0.05], data = [\"velocity\"] }\n";
    let workshop = Workshop::new(&format!("{free}{output}"));
    workshop.run(&[]).done();
    let (header, rows) = workshop.table("out/case/history.csv");
    let column =
        |axis: &str| header.iter().position(|own| *own == format!("probe.middle.velocity.{axis}")).unwrap();
    for row in &rows {
        let decay = (-5.0 * row[0]).exp();
        // (α Δt)²/12 of a step of a millisecond.
        assert_close(row[column("x")], 2.0 * decay, 1e-5, "across");
        assert_close(row[column("z")], -9.81 / 5.0 * (1.0 - decay), 1e-5, "down");
    }
}

#[test]
fn fibres_by_rule_are_written_for_paraview() {
    let rules = [
        ("{ toward = [0.05, 0.05, 1] }", [0.0, 0.0, 1.0]),
        ("{ along = [0, 3, 0] }", [0.0, 1.0, 0.0]),
        ("{ around = { point = [-9, 0.05, 0.05], axis = [0, 0, 1] } }", [0.0, 1.0, 0.0]),
        ("{ tangential = { surface = { set = \"z-max\" }, closest-to = [1, 0, 1] } }", [1.0, 0.0, 0.0]),
        ("{ laplace = { from = { set = \"x-min\" }, to = { set = \"x-max\" } } }", [1.0, 0.0, 0.0]),
    ];
    for (rule, expected) in rules {
        let scene = changed(BLOCK, "fibre = [0, 1, 0]", &format!("fibre = {rule}"))
            .replace("\"von-mises\"", "\"fibre\", \"fibre-stretch\"");
        let workshop = Workshop::new(&scene);
        workshop.run(&["--until", "0.001"]).done();
        let mesh = workshop.series("out/case/fields.pvd").pop().unwrap().1.mesh;
        let block = mesh.block(CellKind::Tet).unwrap();
        for cell in 0..block.len() {
            let fibre = block.data["fibre"].item(cell);
            // The rules about a point turn by the size of the block over the distance to the point.
            assert!((0..3).all(|c| (fibre[c] - expected[c]).abs() < 0.1), "{rule}: {fibre:?}");
        }
    }
}

#[test]
fn density_and_hourglass_go_by_label() {
    let brain = r#"[scene]
until = 1e-3
[law.tissue]
type = "neo-hookean"
young-modulus = 3e3
poisson-ratio = 0.4
[body.brain]
mesh = { organ = "brain", edge = 0.015, as = "hexes" }
law = "tissue"
density = 1000
"#;
    let mass = |density: &str| {
        let scene = changed(brain, "density = 1000", density);
        Workshop::new(&scene).run(&[]).done()["mass"].as_f64().unwrap()
    };
    let by_label = "hourglass = { 1 = 0.1, 2 = 0, 3 = 0.3 }\ndensity = { 1 = A, 2 = B, 3 = C }";
    let of = |a: &str, b: &str, c: &str| mass(&by_label.replace('A', a).replace('B', b).replace('C', c));
    let whole = mass("density = 1000");
    let parts = [of("1000", "1", "1"), of("1", "1000", "1"), of("1", "1", "1000")];
    // Each part weighs its thousand, the rest a thousandth of it.
    assert_close(of("1000", "1000", "1000"), whole, 1e-9, "mass");
    assert_close(parts.iter().sum::<f64>(), whole * 1.002, 1e-9, "mass");
    assert!(parts.iter().all(|part| *part > 0.003), "{parts:?}");
}

#[test]
fn a_niftysim_model_runs_as_it_is_or_as_the_scene_it_becomes() {
    let model = r#"<Model>
        <Nodes DOF="3" NumNodes="4">0 0 0  0.1 0 0  0 0.1 0  0 0 0.1</Nodes>
        <Elements NumEls="1" Type="T4">0 1 2 3</Elements>
        <ElementSet Size="all"><Material Type="AB">
            <ElasticParams NumParams="3">1000 3 10000</ElasticParams></Material></ElementSet>
        <Constraint Type="Fix" DOF="all" NumNodes="3"><Nodes>0 1 2</Nodes></Constraint>
        <Constraint Type="Disp" DOF="2" NumNodes="1" LoadShape="RAMP">
            <Nodes>3</Nodes><Magnitudes Type="UNIFORM">0.01</Magnitudes></Constraint>
        <SystemParams><TimeStep>0.001</TimeStep><TotalTime>0.1</TotalTime><DampingCoeff>1</DampingCoeff>
            <Density>1000</Density></SystemParams></Model>"#;
    let workshop = Workshop::new("");
    workshop.write("model.xml", model);
    let told = workshop.pliant(&["run", "model.xml", "--json"]);
    let direct = told.done();
    assert!(told.err.contains("note: "), "{}", told.err);
    assert!(workshop.path("out/model/fields.pvd").is_file());
    workshop.pliant(&["import", "model.xml", "-o", "translated.toml"]).words();
    let scene = workshop.pliant(&["run", "translated.toml", "--json"]).done();
    assert_eq!(direct["reactions"], scene["reactions"]);
    let again = workshop.pliant(&["import", "model.xml", "-o", "translated.toml"]);
    assert!(again.code == 2 && again.err.contains("exists already"), "{}", again.err);
    let more = "<KinematicContact/><ShellElements Type=\"SURFACE\"/><ShellElementSet Size=\"all\"><Material Type=\"LinearShell\">\
                1 0.4 1 0.4<Density>1</Density><Thickness>1</Thickness></Material></ShellElementSet></Model>";
    workshop.write("partial.xml", model.replace("</Model>", more));
    for arguments in
        [&["run", "partial.xml"][..], &["import", "partial.xml", "-o", "partial"], &["check", "partial.xml"]]
    {
        let told = workshop.pliant(arguments);
        assert_eq!(told.code, 2, "{arguments:?}: {}", told.err);
        for part in ["partial.xml", "LinearShell bends", "contact (KinematicContact", "--allow-partial"] {
            assert!(told.err.contains(part), "{arguments:?}: no `{part}` in {}", told.err);
        }
        assert!(!workshop.path("out/partial").exists() && !workshop.path("partial").exists());
    }
    let told = workshop.pliant(&["run", "partial.xml", "--allow-partial", "--json"]);
    assert!(told.err.contains("left out"), "{}", told.err);
    assert_eq!(told.done()["reactions"], direct["reactions"]);
    workshop.pliant(&["import", "partial.xml", "-o", "partial", "--allow-partial"]).words();
    assert!(workshop.path("partial/scene.toml").is_file());
    // A plate that turns away from the tip, which moves off it, and a rigid surface that follows a table of poses.
    let contact = "<ContactPlate><a>-1 -1 -1</a><b>1 -1 -1</b><c>-1 1 -1</c><Disp>0 0 -0.1</Disp>\
                   <SlvNodes NumNodes=\"3\">0 1 2</SlvNodes></ContactPlate>\
                   <ContactSurface><Nodes NumNodes=\"3\">-1 -1 -0.5  1 -1 -0.5  0 1 -0.5</Nodes><Elements NumEls=\"1\" Type=\"T3\">0 1 2\
                   </Elements><Motion Type=\"Rotation\">0.1 0.1 0  0 0 -0.5</Motion></ContactSurface>\
                   <ShellElements Type=\"SURFACE\"/><ShellElementSet Size=\"all\"><Material Type=\"NeoHookean\">100\
                   <Density>1000</Density><Thickness>1e-3</Thickness></Material></ShellElementSet></Model>";
    workshop.write("touching.xml", model.replace("</Model>", contact));
    let direct = workshop.pliant(&["run", "touching.xml", "--json"]).done();
    workshop.pliant(&["import", "touching.xml", "-o", "carried"]).words();
    assert!(workshop.path("carried/touching-surface-0.csv").is_file());
    let scene = workshop.pliant(&["run", "carried", "--json"]).done();
    assert_eq!(direct["reactions"], scene["reactions"]);
    workshop.write("broken.xml", &model[..200]);
    let told = workshop.pliant(&["run", "broken.xml"]);
    assert!(told.code == 2 && told.err.contains("broken.xml"), "{}", told.err);
}

/// A cube of hexes between glued plates, the upper one moved as told.
fn squeezed(element: &str, run: &str, motion: &str) -> String {
    format!(
        "[scene]\nuntil = 0.5\n[run]\nprecision = \"double\"\n{run}\n[law.tissue]\ntype = \"neo-hookean\"\n\
         young-modulus = 3e3\npoisson-ratio = 0.45\n[body.cube]\n\
         mesh = {{ block = {{ size = [0.1, 0.1, 0.1], cells = [3, 3, 3] }}, as = \"hexes\" }}\n\
         element = \"{element}\"\nlaw = \"tissue\"\ndensity = 1000\ndamping = 60\n\
         [constraint.base]\ntype = \"fix\"\nbody = \"cube\"\nnodes = {{ set = \"z-min\" }}\n\
         [constraint.top]\ntype = \"move\"\nbody = \"cube\"\nnodes = {{ set = \"z-max\" }}\n{motion}\n\
         [output.table]\ntype = \"csv\"\nevery = 0.05\n"
    )
}

#[test]
fn a_flattened_cube_ends_with_the_corner_that_turns_inside_out() {
    for by in ["-0.095", "-0.099"] {
        let told = Workshop::new(&squeezed("hex8-full", "", &format!("by = [0, 0, {by}]"))).run(&[]);
        assert_eq!(told.code, 1, "{by}: {}", told.err);
        let error = &told.json()["error"];
        assert_eq!(error["kind"], "inverted", "{by}: {error}");
        for piece in ["at its corner at node", "(det F = ", "slower or smaller motion"] {
            assert!(told.err.contains(piece), "{by}: no `{piece}` in {}", told.err);
        }
        assert!(error["element"].is_number() && error["node"].is_number() && error["time"].is_number());
    }
    // One point a cell: hourglass control holds the corners apart for longer.
    for by in ["-0.095", "-0.099"] {
        let told = Workshop::new(&squeezed("hex8", "", &format!("by = [0, 0, {by}]"))).run(&[]);
        assert_eq!((told.code, &told.json()["error"]["kind"]), (1, &"inverted".into()), "{by}: {}", told.err);
        assert!(told.err.contains("at its corner at node"), "{by}: {}", told.err);
    }
    let run = "solver = \"quasi-static\"\nload-steps = 2";
    for element in ["hex8", "hex8-full"] {
        let scene = squeezed(element, run, "by = [0, 0, -0.099]\ncurve = \"hold\"");
        let told = Workshop::new(&scene).run(&[]);
        assert_eq!(told.code, 1, "{element}: {}", told.err);
        let advice = told.err.contains("inverted") && told.err.contains("let it grow over time");
        assert!(advice && !told.err.contains("more load steps"), "{element}: {}", told.err);
    }
}

/// If every node is fixed, the model has no critical time step, and the output says so.
#[test]
fn a_body_whose_nodes_are_all_prescribed_has_no_limit_and_a_page_without_inf() {
    let scene = squeezed("hex8", "", "by = [0, 0, 0.001]")
        .replace("nodes = { set = \"z-max\" }", "nodes = \"all\"\ncomponents = [\"x\", \"y\", \"z\"]")
        .replace("[constraint.base]\ntype = \"fix\"\nbody = \"cube\"\nnodes = { set = \"z-min\" }\n", "");
    let workshop = Workshop::new(&scene);
    workshop.run(&[]).done();
    let page = fs::read_to_string(workshop.path("out/case/summary.md")).unwrap();
    assert!(page.contains("none: every node is held or moved as prescribed"), "{page}");
    assert!(page.contains("any step is stable, as no node is free to move"), "{page}");
    let checked = workshop.pliant(&["check", "case"]).words();
    for text in [page, checked] {
        let words: Vec<&str> = text.split(|c: char| !c.is_alphanumeric()).collect();
        assert!(!words.iter().any(|word| ["inf", "NaN", "nan"].contains(word)), "{text}");
    }
}

/// A beam held at one end by a couple that its moved end makes: the moments balance, and the nodal reactions sum up to the reaction.
#[test]
fn moments_of_reactions_balance_and_a_rotation_twists() {
    let rotate = "rotate = { axis = [0, 0, 2], centre = [0.05, 0.05, 0], angle = 0.3 }";
    let run = "solver = \"quasi-static\"\nload-steps = 2\ntolerance = 1e-8";
    let scene = squeezed("hex8", run, rotate)
        + "moments-about = [0.05, 0.05, 0.02]\n\
           probes.corner = { on = \"cube\", at = [0.1, 0.1, 0.1], data = [\"displacement\", \"reaction\", \
           \"deformation-gradient\", \"green-strain\", \"cauchy-stress\"] }\n\
           [output.fields]\ntype = \"vtu\"\nevery = 0.5\ndata = [\"reaction\", \"deformation-gradient\"]\n";
    let workshop = Workshop::new(&scene);
    workshop.run(&[]).done();
    let table = fs::read_to_string(workshop.path("out/case/table.csv")).unwrap();
    let last = table.lines().last().unwrap();
    let row: std::collections::BTreeMap<&str, f64> = (table.lines().next().unwrap().split(','))
        .zip(last.split(',').map(|number| number.parse().unwrap()))
        .collect();
    let vector = |name: &str| ["x", "y", "z"].map(|axis| row[format!("{name}.{axis}").as_str()]);
    let (base, top) = (vector("moment.base"), vector("moment.top"));
    // A twist about the axis of a square: a couple.
    assert!(top[2] > 1e-3, "{top:?}");
    for c in 0..3 {
        assert!((base[c] + top[c]).abs() < 1e-5 * top[2], "{base:?} against {top:?}");
        let [below, above] = ["reaction.base", "reaction.top"].map(|name| vector(name)[c]);
        assert!((below + above).abs() < 1e-5 * top[2] / 0.1, "{row:?}");
        // Along the axis a twist pulls at the plates, across it nothing does.
        assert!(c == 2 || above.abs() < 1e-5 * top[2] / 0.1, "{row:?}");
    }
    // The corner rotates by 0.3 rad.
    let arm = [0.05, 0.05];
    let [x, y, z] = vector("probe.corner.displacement");
    let (sin, cos) = 0.3_f64.sin_cos();
    let expected = [cos * arm[0] - sin * arm[1] - arm[0], sin * arm[0] + cos * arm[1] - arm[1]];
    assert!(
        (x - expected[0]).abs() < 1e-12 && (y - expected[1]).abs() < 1e-12 && z.abs() < 1e-15,
        "{x} {y} {z}"
    );
    assert!(vector("probe.corner.reaction").iter().any(|force| force.abs() > 1e-3));
    // E = (FᵀF − I)/2 of the same cell.
    let entry = |field: &str, i: usize, j: usize| {
        row[format!("probe.corner.{field}.{}{}", ["x", "y", "z"][i], ["x", "y", "z"][j]).as_str()]
    };
    for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
        let square: f64 =
            (0..3).map(|k| entry("deformation-gradient", k, i) * entry("deformation-gradient", k, j)).sum();
        let strain = 0.5 * (square - f64::from(u8::from(i == j)));
        assert!((strain - entry("green-strain", i, j)).abs() < 1e-12, "E_{i}{j}");
        assert_eq!(entry("cauchy-stress", i, j), entry("cauchy-stress", j, i));
    }
}
