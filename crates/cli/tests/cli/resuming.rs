//! Interrupted and resumed runs, through the real binary: the same bits and files as an uninterrupted run, and clear
//! messages for checkpoints that do not fit.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use crate::support::{BLOCK, Told, Workshop, changed};

/// A bent block with an output of every kind and a checkpoint every 0.02 s, of an element, with or without history.
fn bent(element: &str, run: &str, relaxing: bool) -> String {
    let cells = if element.starts_with("tet") { "tets" } else { "hexes" };
    let prony = "prony = [{ part = \"isochoric\", weight = 0.3, time = 0.05 }, \
                 { part = \"volumetric\", weight = 0.2, time = 0.02 }]";
    format!(
        r#"[scene]
until = 0.1
gravity = [0, 0, -9.81]
[run]
checkpoint = {{ every = 0.02 }}
{run}
[law.tissue]
type = "neo-hookean"
young-modulus = 10e3
poisson-ratio = 0.45
{}
[body.block]
mesh = {{ block = {{ size = [0.1, 0.05, 0.05] }}, edge = 0.025, as = "{cells}" }}
element = "{element}"
law = "tissue"
density = 1000
damping = 10
[constraint.wall]
type = "fix"
body = "block"
nodes = {{ set = "x-min" }}
[constraint.hand]
type = "move"
body = "block"
nodes = {{ set = "x-max" }}
by = [0, 0, 0.005]
to = 0.08
[output.fields]
type = "vtu"
every = 0.013
data = ["displacement", "von-mises", "pressure"]
[output.history]
type = "csv"
every = 0.003
probes.middle = {{ on = "block", at = [0.05, 0.025, 0.025], data = ["displacement", "velocity", "pressure"] }}
"#,
        if relaxing { prony } else { "" }
    )
}

/// The names of the checkpoints in a folder, in order.
fn checkpoints(folder: &Path) -> Vec<PathBuf> {
    let names = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut all: Vec<PathBuf> =
        names.filter(|path| path.extension().is_some_and(|ending| ending == "pliant")).collect();
    all.sort();
    all
}

/// All files under a folder except checkpoints and the page with the wall time, with their
/// contents.
fn files(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut all = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(next) = open.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            let kept = path.file_name().is_some_and(|name| name == "summary.md")
                || path.extension().is_some_and(|ending| ending == "pliant");
            if path.is_dir() {
                open.push(path);
            } else if !kept {
                all.push((path.strip_prefix(folder).unwrap().to_owned(), fs::read(&path).unwrap()));
            }
        }
    }
    all.sort();
    all
}

#[track_caller]
fn assert_same_files(workshop: &Workshop, one: &str, other: &str, what: &str) {
    let [one, other] = [one, other].map(|folder| files(&workshop.path(folder)));
    let names = |files: &[(PathBuf, Vec<u8>)]| files.iter().map(|file| file.0.clone()).collect::<Vec<_>>();
    assert_eq!(names(&one), names(&other), "{what}");
    for (one, other) in one.iter().zip(&other) {
        assert!(one.1 == other.1, "{what}: {} differs", one.0.display());
    }
}

/// Waits until a run has written its second checkpoint, kills it, and waits for its end.
fn kill_at_second_checkpoint(mut child: Child, folder: &Path) {
    let patience = Instant::now();
    while !folder.is_dir() || checkpoints(folder).len() < 2 {
        assert!(patience.elapsed() < Duration::from_secs(60), "no checkpoints came");
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
}

/// Runs a scene completely into `out/whole`, and in two parts into `out/parts`. Files and final state are the same,
/// bit for bit.
#[track_caller]
fn assert_resumes(scene: &str, threads: [&str; 3], what: &str) {
    let workshop = Workshop::new(scene);
    workshop.run(&["--out", "out/whole", "--threads", threads[0]]).done();
    workshop.run(&["--out", "out/parts", "--threads", threads[1]]).done();
    let written = checkpoints(&workshop.path("out/parts"));
    assert_eq!(written.len(), 2, "{what}: the last two are kept");
    // Back to the one before the last: rows and frames after it are written once more.
    let [before, last] = [0, 1].map(|index| fs::read(&written[index]).unwrap());
    fs::remove_file(&written[1]).unwrap();
    let history = workshop.read("out/parts/history.csv");
    workshop.write("out/parts/history.csv", &history[..history.len() - 150]);
    let told = workshop.run(&["--resume", "out/parts", "--threads", threads[2]]);
    // Solvers with equations write their residuals, too.
    let residuals = ["\"implicit\"", "\"static\""].iter().any(|solver| scene.contains(solver));
    assert_eq!(told.done()["files"].as_array().unwrap().len(), 5 + usize::from(residuals), "{what}");
    assert_same_files(&workshop, "out/whole", "out/parts", what);
    assert!(workshop.read("out/parts/summary.md").contains("Resumed at t = 0.0"), "{what}");
    let again = checkpoints(&workshop.path("out/parts"));
    assert_eq!(again, written, "{what}");
    assert!(fs::read(&again[0]).unwrap() == before);
    // Everything except the wall times in them has the same bits: the state, the samples, the schedules.
    let differ = fs::read(&again[1]).unwrap().iter().zip(&last).filter(|(a, b)| a != b).count();
    // Solvers with equations tell the times of their three phases, too.
    let times = if scene.contains("model = ") { 4 } else { 1 };
    assert!(differ <= 8 * times + 4, "{what}: {differ} bytes differ, not only wall times and checksum");
}

#[test]
fn a_resumed_run_ends_in_the_same_bits_for_every_element_and_history() {
    for (index, element) in
        ["tet4", "tet4-anp", "tet4-ianp", "tet4-ianp-niftysim", "hex8", "hex8-full"].into_iter().enumerate()
    {
        for (relaxing, precision) in [(false, "single"), (true, "double"), (true, "single")] {
            let run = format!("precision = \"{precision}\"");
            let threads = [["1", "1", "2"], ["3", "2", "1"]][index % 2];
            let what = format!("{element}, {precision}, relaxing: {relaxing}");
            assert_resumes(&bent(element, &run, relaxing), threads, &what);
        }
    }
}

#[test]
fn a_resumed_rotation_ends_in_the_same_bits() {
    let rotate = "rotate = { axis = [1, 0, 0], centre = [0, 0.025, 0.025], angle = 0.2 }";
    let scene = bent("hex8", "precision = \"double\"", false).replace("by = [0, 0, 0.005]", rotate);
    assert_resumes(&scene, ["1", "2", "1"], "rotation");
}

#[test]
fn a_resumed_run_ends_in_the_same_bits_for_every_law_with_history() {
    let isotropic = "young-modulus = 10e3\npoisson-ratio = 0.45\n";
    let fibre = format!("{isotropic}fibre = [1, 0, 0]\n");
    let laws = [
        ("neo-hookean", format!("{isotropic}prony-update = \"backward-euler\"\n")),
        ("coupled-neo-hookean", isotropic.into()),
        ("logarithmic-neo-hookean", isotropic.into()),
        ("st-venant-kirchhoff", isotropic.into()),
        ("corotational", isotropic.into()),
        ("mooney-rivlin", "c10 = 1e3\nc01 = 7e2\npoisson-ratio = 0.45\n".into()),
        ("polynomial", "c10 = 1e3\nc01 = 7e2\nc20 = 300\npoisson-ratio = 0.45\n".into()),
        ("yeoh", "c1 = 1.7e3\nc2 = 500\npoisson-ratio = 0.45\n".into()),
        ("arruda-boyce", "shear-modulus = 3e3\nlocking-stretch = 1.5\npoisson-ratio = 0.45\n".into()),
        ("gent", format!("{isotropic}limit = 2\n")),
        ("demiray", format!("{isotropic}exponent = 2\n")),
        ("veronda-westmann", "c1 = 1e3\nc2 = 3\npoisson-ratio = 0.45\n".into()),
        ("ogden", "terms = [{ shear-modulus = 3e3, exponent = 4 }]\npoisson-ratio = 0.45\n".into()),
        ("transversely-isotropic", format!("{fibre}fibre-modulus = 5e3\n")),
        ("orthotropic", format!("{fibre}e4 = 2e3\ne5 = 1e3\nsecond-fibre = [0, 1, 0]\n")),
        ("holzapfel-gasser-ogden", format!("{fibre}fibre-modulus = 2e3\nfibre-exponent = 2\n")),
        (
            "fung-orthotropic",
            "modulus = 3e3\nnormal = [[1, 0.2, 0.2], [0.2, 1, 0.2], [0.2, 0.2, 1]]\nshear = [0.4, 0.4, 0.4]\n\
             bulk-modulus = 30e3\n"
                .into(),
        ),
    ];
    let schema = Workshop::new(BLOCK).pliant(&["schema"]).json();
    let known = schema["properties"]["law"]["additionalProperties"]["oneOf"].as_array().unwrap().len();
    assert_eq!(laws.len(), known, "a law is missing here");
    for (index, (name, parameters)) in laws.into_iter().enumerate() {
        let law = format!("type = \"{name}\"\n{parameters}");
        let element = ["tet4", "hex8", "tet4-anp", "hex8-full"][index % 4];
        // Averaging the pressure needs a law that splits it off.
        let element = match name {
            "coupled-neo-hookean" | "logarithmic-neo-hookean" | "st-venant-kirchhoff" | "corotational" => {
                "hex8"
            }
            _ => element,
        };
        let scene = changed(&bent(element, "", true), &format!("type = \"neo-hookean\"\n{isotropic}"), &law);
        assert_resumes(&scene, ["1", "2", "1"], &format!("{element} of {name}"));
    }
}

#[test]
fn a_resumed_quasi_static_run_ends_in_the_same_bits() {
    for (element, precision) in [("tet4-anp", "double"), ("hex8", "single"), ("hex8-full", "double")] {
        let run = format!("solver = \"quasi-static\"\nload-steps = 10\nprecision = \"{precision}\"");
        assert_resumes(&bent(element, &run, true), ["2", "1", "3"], &format!("quasi-static {element}"));
    }
    let times = "solver = \"quasi-static\"\nload-steps = { times = [0.01, 0.02, 0.03, 0.045, 0.05, 0.07] }";
    assert_resumes(&bent("tet4-anp", times, true), ["2", "1", "3"], "unequal load steps");
}

/// A pressed shell beside a swinging block, with a checkpoint every 0.02 s.
fn shells(run: &str) -> String {
    format!(
        r#"[scene]
until = 0.1
gravity = [0, 0, -9.81]
[run]
checkpoint = {{ every = 0.02 }}
{run}
[law.tissue]
type = "st-venant-kirchhoff"
young-modulus = 1e8
poisson-ratio = 0.3
[body.wall]
model = "shell"
mesh = {{ plate = {{ size = [0.2, 0.1], cells = [6, 3], pattern = "crossed" }} }}
law = "tissue"
density = 1000
thickness = 0.004
[body.block]
mesh = {{ block = {{ size = [0.1, 0.02, 0.02], cells = [4, 1, 1] }}, at = [0, 0.2, 0] }}
law = "tissue"
density = 1000
[constraint.clamp]
type = "fix"
body = "wall"
nodes = {{ set = "x-min" }}
[constraint.root]
type = "fix"
body = "block"
nodes = {{ set = "x-min" }}
[load.blow]
type = "pressure"
on = "wall"
faces = "all"
pressure = 50
[output.fields]
type = "vtu"
every = 0.013
data = ["displacement", "von-mises"]
[output.history]
type = "csv"
every = 0.003
probes.end = {{ on = "wall", at = [0.2, 0.05, 0], data = ["displacement", "velocity", "von-mises"] }}
"#
    )
}

#[test]
fn a_resumed_run_of_shells_ends_in_the_same_bits() {
    let jacobi =
        r#"linear = { by = "conjugate-gradients", tolerance = 1e-6, preconditioner = "block-jacobi" }"#;
    for (index, run) in [
        "solver = \"implicit\"\nstep = 2e-3",
        &format!("solver = \"implicit\"\nstep = 2e-3\n{jacobi}"),
        "solver = \"static\"\nload-steps = 50",
        "solver = \"explicit\"",
        "solver = \"implicit\"\nintegrator = \"bdf2\"\nstep = 2e-3",
    ]
    .into_iter()
    .enumerate()
    {
        assert_resumes(&shells(run), [["1", "1", "2"], ["2", "2", "1"]][index % 2], run);
    }
}

#[test]
fn a_killed_run_goes_on_to_the_files_of_one_that_was_not() {
    let long = bent("tet4", "threads = 1", true).replace("until = 0.1", "until = 3.0");
    let workshop = Workshop::new(&long);
    let child = workshop
        .command(&["run", "case", "--out", "out/parts"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    kill_at_second_checkpoint(child, &workshop.path("out/parts"));
    // A row that was only half on disk.
    let half = workshop.read("out/parts/history.csv") + "1.5e0,2.2";
    workshop.write("out/parts/history.csv", half);
    workshop.run(&["--resume", "out/parts"]).done();
    workshop.run(&["--out", "out/whole"]).done();
    assert_same_files(&workshop, "out/whole", "out/parts", "killed");
}

/// Takes away all that a run writes after its last checkpoint.
fn undo_the_end(workshop: &Workshop, folder: &str) {
    for page in ["summary.md", "plot.svg"] {
        fs::remove_file(workshop.path(&format!("{folder}/{page}"))).unwrap();
    }
    let without_last = |name: &str, is_it: fn(&&str) -> bool| {
        let text = workshop.read(name);
        let last = text.lines().rfind(is_it).unwrap();
        workshop.write(name, text.replace(&format!("{last}\n"), ""));
        last.to_owned()
    };
    without_last(&format!("{folder}/history.csv"), |_| true);
    let frame = without_last(&format!("{folder}/fields.pvd"), |line| line.contains("<DataSet"));
    let file = frame.split_once("file=\"").unwrap().1.split_once('"').unwrap().0;
    fs::remove_file(workshop.path(&format!("{folder}/{file}"))).unwrap();
}

#[test]
fn a_run_killed_after_its_last_checkpoint_gets_its_end() {
    for scene in [
        bent("tet4", "", true),
        bent("hex8-full", "precision = \"single\"\nstep = 3e-4", false),
        bent("hex8", "solver = \"quasi-static\"\nload-steps = 5", true),
        shells("solver = \"implicit\"\nstep = 0.01"),
    ] {
        let workshop = Workshop::new(&scene);
        workshop.run(&["--out", "out/whole"]).done();
        workshop.run(&["--out", "out/parts"]).done();
        undo_the_end(&workshop, "out/parts");
        workshop.run(&["--resume", "out/parts"]).done();
        assert_same_files(&workshop, "out/whole", "out/parts", &scene);
        assert!(workshop.read("out/parts/summary.md").contains("Resumed at t = 0.1"));
        // Each part of the end alone.
        for page in ["summary.md", "plot.svg"] {
            fs::remove_file(workshop.path("out/parts").join(page)).unwrap();
            workshop.run(&["--resume", "out/parts"]).done();
            assert_same_files(&workshop, "out/whole", "out/parts", page);
        }
        // Then there is nothing left, and nothing changes.
        let summary = workshop.read("out/parts/summary.md");
        refused(&workshop.run(&["--resume", "out/parts"]), &["the run has finished", "nothing was changed"]);
        assert_same_files(&workshop, "out/whole", "out/parts", "finished");
        assert_eq!(workshop.read("out/parts/summary.md"), summary);
    }
}

#[test]
fn a_longer_until_goes_on_from_the_end() {
    let workshop = Workshop::new(&bent("hex8", "step = 5e-4", true));
    workshop.run(&["--out", "out/parts"]).done();
    let told = workshop.run(&["--resume", "out/parts"]);
    refused(&told, &["the checkpoint is at t = 0.1000 s, and the scene ends at 0.1000 s", "`--until`"]);
    let told = workshop.run(&["--resume", "out/parts", "--until", "0.05"]);
    refused(&told, &["the checkpoint is at t = 0.1000 s, after the end of the scene at 0.0500", "`--until`"]);
    workshop.run(&["--resume", "out/parts", "--until", "0.2"]).done();
    workshop.run(&["--out", "out/whole", "--until", "0.2"]).done();
    // The final time of the first part has its own row and frame.
    let (_, parts) = workshop.table("out/parts/history.csv");
    let (_, whole) = workshop.table("out/whole/history.csv");
    assert_eq!(parts.last(), whole.last());
    assert!(whole.iter().all(|row| parts.contains(row)), "rows are lost");
    // An automatic step stays as it was, though 0.1 s and 0.17 s divide differently.
    let automatic = Workshop::new(&bent("hex8", "", true));
    let first = automatic.run(&[]).done()["step"].clone();
    let second = automatic.run(&["--resume", "out/case", "--until", "0.17"]).done();
    assert_eq!(second["step"], first);
    let (_, rows) = automatic.table("out/case/history.csv");
    assert!((rows.last().unwrap()[0] - 0.17).abs() < first.as_f64().unwrap());
    assert!(rows.windows(2).all(|pair| pair[0][0] < pair[1][0]), "times increase");
}

#[test]
fn a_shorter_until_drops_what_lies_beyond() {
    let workshop = Workshop::new(&bent("hex8", "step = 5e-4", false));
    workshop.run(&["--out", "out/parts"]).done();
    fs::remove_file(&checkpoints(&workshop.path("out/parts"))[1]).unwrap();
    workshop.run(&["--resume", "out/parts", "--until", "0.09"]).done();
    workshop.run(&["--out", "out/whole", "--until", "0.09"]).done();
    // The plot has samples at the pace of the first run.
    fs::remove_file(workshop.path("out/parts/plot.svg")).unwrap();
    fs::remove_file(workshop.path("out/whole/plot.svg")).unwrap();
    assert_same_files(&workshop, "out/whole", "out/parts", "shorter");
}

#[test]
fn a_failing_resumed_run_loses_nothing() {
    let workshop = Workshop::new(&bent("hex8", "", true));
    workshop.run(&["--out", "out/parts"]).done();
    fs::remove_file(&checkpoints(&workshop.path("out/parts"))[1]).unwrap();
    let before = files(&workshop.path("out/parts"));
    // A frame that cannot be written ends the run at the first one after the checkpoint.
    let next = workshop.path("out/parts/fields/000007.vtu.tmp");
    fs::create_dir(&next).unwrap();
    let told = workshop.run(&["--resume", "out/parts"]);
    assert_eq!((told.code, &told.json()["error"]["kind"]), (1, &"output".into()), "{}", told.err);
    fs::remove_dir(&next).unwrap();
    let after = files(&workshop.path("out/parts"));
    for (before, after) in before.iter().zip(&after).filter(|(file, _)| !file.0.ends_with("plot.svg")) {
        assert!(before == after, "{} was lost", before.0.display());
    }
    assert_eq!(before.len(), after.len());
}

/// Asserts that a run was rejected with exit code 2 and these words.
#[track_caller]
fn refused(told: &Told, pieces: &[&str]) {
    assert_eq!(told.code, 2, "{}", told.err);
    assert_eq!(told.json()["status"], "invalid");
    for piece in pieces {
        assert!(told.words().contains(piece), "no `{piece}` in {}", told.err);
    }
}

#[test]
fn a_checkpoint_that_does_not_fit_is_refused_with_a_reason() {
    let scene = bent("hex8", "", true);
    let workshop = Workshop::new(&scene);
    workshop.run(&[]).done();
    let all = checkpoints(&workshop.path("out/case"));
    let before = files(&workshop.path("out/case"));
    fs::remove_file(&all[1]).unwrap();
    for (good, other, pieces) in [
        ("edge = 0.025", "edge = 0.02", ["mesh of body `block`", "differ"]),
        ("young-modulus = 10e3", "young-modulus = 11e3", ["material of body `block`", "differs"]),
        ("time = 0.05", "time = 0.06", ["material of body `block`", "differs"]),
        ("damping = 10", "damping = 11", ["material of body `block`", "differs"]),
        ("element = \"hex8\"", "element = \"hex8-full\"", ["mesh of body `block`", "differ"]),
        ("-9.81", "-9.8", ["load `", "differs"]),
        ("by = [0, 0, 0.005]", "by = [0, 0, 0.006]", ["constraint `hand` differs", "run from the start"]),
        ("to = 0.08", "to = 0.09", ["constraint `hand` differs", "run from the start"]),
        ("every = 0.003", "every = 0.004", ["output `history` differs", "run from the start"]),
        ("[output.fields]", "[output.frames]", ["output `frames`, output `fields` differ", "from the start"]),
        (
            "element =",
            "hourglass = 0.1\nelement =",
            ["material of body `block` differs", "run from the start"],
        ),
        ("[run]", "[run]\nstep = 1e-4", ["the checkpoint is of a run with steps of", "or give `--step "]),
        ("[run]", "[run]\nprecision = \"single\"", ["a run in double precision", "add `--precision double`"]),
        (
            "[run]",
            "[run]\nsolver = \"quasi-static\"",
            ["with the solver `explicit`, the scene asks for `quasi-static`", "set `solver = \"explicit\"`"],
        ),
    ] {
        workshop.write("case/scene.toml", changed(&scene, good, other));
        refused(&workshop.run(&["--resume", "out/case"]), &pieces);
    }
    // A course that ends with the scene is another one in a longer scene.
    workshop.write("case/scene.toml", changed(&scene, "to = 0.08\n", ""));
    workshop.run(&["--out", "out/open"]).done();
    let told = workshop.run(&["--resume", "out/open", "--until", "0.2"]);
    refused(&told, &["constraint `hand` differs", "write `to = 0.1`"]);
    workshop.write("case/scene.toml", &scene);

    // Problems of the file.
    let bytes = fs::read(&all[0]).unwrap();
    let file = |content: &[u8]| {
        workshop.write("x.pliant", content);
        workshop.run(&["--resume", "x.pliant", "--out", "out/case"])
    };
    let counted = format!("{} of {} bytes", bytes.len() - 1, bytes.len());
    refused(&file(&bytes[..bytes.len() - 1]), &["is truncated", &counted, "take the one before it"]);
    refused(&file(b"VTK"), &["`x.pliant` is not a checkpoint", "checkpoint-….pliant"]);
    refused(&file(b""), &["`x.pliant` is not a checkpoint"]);
    let mut flipped = bytes.clone();
    flipped[bytes.len() / 2] ^= 1;
    refused(&file(&flipped), &["is damaged: its checksum does not fit", "take the one before it"]);
    let mut newer = bytes.clone();
    newer[8] = 99;
    refused(&file(&newer), &["has format 99; this version of pliant reads format 10"]);
    refused(&workshop.run(&["--resume", "none.pliant"]), &["`none.pliant` cannot be read"]);
    refused(&workshop.run(&["--resume", "case"]), &["there is no checkpoint in `case`", "every = 1.0"]);

    // Problems of the folder.
    let outputs = "does not hold what the checkpoint continues";
    let told = workshop.run(&["--resume", "out/case", "--out", "elsewhere"]);
    refused(&told, &[outputs, "there is no such folder", "`--out DIR`"]);
    assert!(!workshop.path("elsewhere").exists());
    let history = workshop.read("out/case/history.csv");
    workshop.write("out/case/history.csv", &history[..history.len() / 2]);
    refused(&workshop.run(&["--resume", "out/case"]), &[outputs, "history.csv", "at the checkpoint"]);
    workshop.write("out/case/history.csv", history.replacen("e-", "e+", 1));
    refused(&workshop.run(&["--resume", "out/case"]), &[outputs, "not those of the interrupted run"]);
    workshop.write("out/case/history.csv", &history);
    let frame = workshop.path("out/case/fields/000001.vtu");
    let content = fs::read(&frame).unwrap();
    fs::remove_file(&frame).unwrap();
    refused(&workshop.run(&["--resume", "out/case"]), &[outputs, "`fields/000001.vtu` is missing"]);
    fs::write(&frame, content).unwrap();
    // The existing files did not change.
    assert!(files(&workshop.path("out/case")) == before);
    workshop.run(&["--resume", "out/case"]).done();
    assert!(files(&workshop.path("out/case")) == before);
}

#[test]
fn force_leaves_no_checkpoint_of_an_earlier_run() {
    let workshop = Workshop::new(&bent("hex8", "", false));
    workshop.run(&[]).done();
    workshop.write("out/case/checkpoint-0000000001.pliant.tmp", "half");
    workshop.write("out/case/checkpoint-mine.pliant", "mine");
    workshop.write("case/scene.toml", bent("hex8", "", false).replace("checkpoint =", "# checkpoint ="));
    workshop.run(&["--force"]).done();
    assert_eq!(checkpoints(&workshop.path("out/case")), [workshop.path("out/case/checkpoint-mine.pliant")]);
    assert!(!workshop.path("out/case/checkpoint-0000000001.pliant.tmp").exists());
    assert_eq!(workshop.run(&["--force", "--resume", "out/case"]).code, 2, "one or the other");
}

#[test]
#[cfg(unix)]
fn ctrl_c_leaves_a_checkpoint_and_says_how_to_go_on() {
    let long = bent("tet4", "threads = 1", true).replace("until = 0.1", "until = 3.0");
    let interrupt = |scene: &str, out: &str| {
        let workshop = Workshop::new(scene);
        let child = workshop
            .command(&["run", "case", "--json", "--out", out])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let patience = Instant::now();
        while !workshop.path(out).join("fields/000001.vtu").exists() {
            assert!(patience.elapsed() < Duration::from_secs(60), "no frames came");
            std::thread::sleep(Duration::from_millis(1));
        }
        let killed = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
        assert!(killed.unwrap().success());
        (workshop, Told::from(child.wait_with_output().unwrap()))
    };
    let (workshop, told) = interrupt(&long, "out/parts");
    assert_eq!((told.code, &told.json()["status"]), (130, &"interrupted".into()), "{}", told.err);
    assert!(told.words().contains("go on with `--resume out/parts/checkpoint-"), "{}", told.err);
    assert!(workshop.read("out/parts/summary.md").contains("**Interrupted**"));
    workshop.run(&["--resume", "out/parts"]).done();
    workshop.run(&["--out", "out/whole"]).done();
    assert_same_files(&workshop, "out/whole", "out/parts", "interrupted");

    let (workshop, told) = interrupt(&changed(BLOCK, "until = 0.02", "until = 50"), "out/case");
    assert_eq!(told.code, 130, "{}", told.err);
    assert!(told.words().contains("with `checkpoint = { every = 1.0 }` in `[run]`"), "{}", told.err);
    assert!(checkpoints(&workshop.path("out/case")).is_empty());
}
