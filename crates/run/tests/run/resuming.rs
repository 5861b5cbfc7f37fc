//! Interrupted and resumed runs: the same bits and files as an uninterrupted run, and clear messages for
//! checkpoints that do not fit.

use std::fs;

use pliant_format::registry::scene_schema;
use pliant_testing::scenes::{Told, Workshop, changed, resumable};

/// The setting of a number of threads.
fn on_threads(count: &str) -> String {
    format!("run.threads={count}")
}

/// Runs a scene completely into `out/whole`, and in two parts into `out/parts`. Files and final state are the
/// same, bit for bit.
#[track_caller]
fn assert_resumes(scene: &str, threads: [&str; 3], what: &str) {
    let workshop = Workshop::new(scene);
    workshop.run_into("out/whole", &[&on_threads(threads[0])]).done();
    workshop.run_into("out/parts", &[&on_threads(threads[1])]).done();
    let written = workshop.checkpoints("out/parts");
    assert_eq!(written.len(), 2, "{what}: the last two are kept");
    // Back to the one before the last: rows and frames after it are written once more.
    let [before, last] = [0, 1].map(|index| fs::read(&written[index]).unwrap());
    fs::remove_file(&written[1]).unwrap();
    let history = workshop.read("out/parts/history.csv");
    workshop.write("out/parts/history.csv", &history[..history.len() - 150]);
    let output = workshop.resume("out/parts", &[&on_threads(threads[2])]);
    // Solvers with equations write their residuals, too.
    let residuals = ["\"implicit\"", "\"static\""].iter().any(|solver| scene.contains(solver));
    assert_eq!(output.done()["files"].as_array().unwrap().len(), 5 + usize::from(residuals), "{what}");
    workshop.assert_same_files("out/whole", "out/parts", what);
    assert!(workshop.read("out/parts/summary.md").contains("Resumed at t = 0.0"), "{what}");
    let again = workshop.checkpoints("out/parts");
    assert_eq!(again, written, "{what}");
    assert!(fs::read(&again[0]).unwrap() == before);
    // Everything except the wall times in them has the same bits: the state, the samples, the schedules.
    let differ = fs::read(&again[1]).unwrap().iter().zip(&last).filter(|(a, b)| a != b).count();
    // Solvers with equations report the times of their three phases, too.
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
            assert_resumes(&resumable(element, &run, relaxing), threads, &what);
        }
    }
}

#[test]
fn a_resumed_rotation_ends_in_the_same_bits() {
    let rotate = "rotate = { axis = [1, 0, 0], centre = [0, 0.025, 0.025], angle = 0.2 }";
    let scene = resumable("hex8", "precision = \"double\"", false).replace("by = [0, 0, 0.005]", rotate);
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
    let schema = scene_schema();
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
        let scene =
            changed(&resumable(element, "", true), &format!("type = \"neo-hookean\"\n{isotropic}"), &law);
        assert_resumes(&scene, ["1", "2", "1"], &format!("{element} of {name}"));
    }
}

#[test]
fn a_resumed_run_with_mass_scaling_ends_in_the_same_bits_and_refuses_another_one() {
    let scene = resumable("tet4", "step = 5e-4\nmass-scaling = { share = 0.02 }", true);
    assert_resumes(&scene, ["1", "2", "1"], "mass scaling");
    let workshop = Workshop::new(&scene);
    workshop.run(&[]).done();
    let output = workshop.resume("out/case", &["run.mass-scaling.share=0.03", "scene.until=0.2"]);
    refused(&output, &["`run.mass-scaling` differs"]);
}

#[test]
fn a_resumed_quasi_static_run_ends_in_the_same_bits() {
    for (element, precision) in [("tet4-anp", "double"), ("hex8", "single"), ("hex8-full", "double")] {
        let run = format!("solver = \"quasi-static\"\nload-steps = 10\nprecision = \"{precision}\"");
        assert_resumes(&resumable(element, &run, true), ["2", "1", "3"], &format!("quasi-static {element}"));
    }
    let times = "solver = \"quasi-static\"\nload-steps = { times = [0.01, 0.02, 0.03, 0.045, 0.05, 0.07] }";
    assert_resumes(&resumable("tet4-anp", times, true), ["2", "1", "3"], "unequal load steps");
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
        resumable("tet4", "", true),
        resumable("hex8-full", "precision = \"single\"\nstep = 3e-4", false),
        resumable("hex8", "solver = \"quasi-static\"\nload-steps = 5", true),
        shells("solver = \"implicit\"\nstep = 0.01"),
    ] {
        let workshop = Workshop::new(&scene);
        workshop.run_into("out/whole", &[]).done();
        workshop.run_into("out/parts", &[]).done();
        undo_the_end(&workshop, "out/parts");
        workshop.resume("out/parts", &[]).done();
        workshop.assert_same_files("out/whole", "out/parts", &scene);
        assert!(workshop.read("out/parts/summary.md").contains("Resumed at t = 0.1"));
        // Each part of the end alone.
        for page in ["summary.md", "plot.svg"] {
            fs::remove_file(workshop.path("out/parts").join(page)).unwrap();
            workshop.resume("out/parts", &[]).done();
            workshop.assert_same_files("out/whole", "out/parts", page);
        }
        // Then there is nothing left, and nothing changes.
        let summary = workshop.read("out/parts/summary.md");
        refused(&workshop.resume("out/parts", &[]), &["the run has finished", "nothing was changed"]);
        workshop.assert_same_files("out/whole", "out/parts", "finished");
        assert_eq!(workshop.read("out/parts/summary.md"), summary);
    }
}

#[test]
fn a_longer_until_goes_on_from_the_end() {
    let workshop = Workshop::new(&resumable("hex8", "step = 5e-4", true));
    workshop.run_into("out/parts", &[]).done();
    let output = workshop.resume("out/parts", &[]);
    refused(&output, &["the checkpoint is at t = 0.1000 s, and the scene ends at 0.1000 s", "`--until`"]);
    let output = workshop.resume("out/parts", &["scene.until=0.05"]);
    refused(
        &output,
        &["the checkpoint is at t = 0.1000 s, after the end of the scene at 0.0500", "`--until`"],
    );
    workshop.resume("out/parts", &["scene.until=0.2"]).done();
    workshop.run_into("out/whole", &["scene.until=0.2"]).done();
    // The final time of the first part has its own row and frame.
    let (_, parts) = workshop.table("out/parts/history.csv");
    let (_, whole) = workshop.table("out/whole/history.csv");
    assert_eq!(parts.last(), whole.last());
    assert!(whole.iter().all(|row| parts.contains(row)), "rows are lost");
    // An automatic step stays as it was, though 0.1 s and 0.17 s divide differently.
    let automatic = Workshop::new(&resumable("hex8", "", true));
    let first = automatic.run(&[]).done()["step"].clone();
    let second = automatic.resume("out/case", &["scene.until=0.17"]).done();
    assert_eq!(second["step"], first);
    let (_, rows) = automatic.table("out/case/history.csv");
    assert!((rows.last().unwrap()[0] - 0.17).abs() < first.as_f64().unwrap());
    assert!(rows.windows(2).all(|pair| pair[0][0] < pair[1][0]), "times increase");
    // So it does in a run that is extended again.
    let third = automatic.resume("out/case", &["scene.until=0.23"]).done();
    assert_eq!(third["step"], first);
    assert!(automatic.resume("out/case", &["scene.until=0.23"]).err.contains("the scene ends at 0.23"));
}

#[test]
fn a_shorter_until_drops_what_lies_beyond() {
    let workshop = Workshop::new(&resumable("hex8", "step = 5e-4", false));
    workshop.run_into("out/parts", &[]).done();
    fs::remove_file(&workshop.checkpoints("out/parts")[1]).unwrap();
    workshop.resume("out/parts", &["scene.until=0.09"]).done();
    workshop.run_into("out/whole", &["scene.until=0.09"]).done();
    // The plot has samples at the pace of the first run.
    fs::remove_file(workshop.path("out/parts/plot.svg")).unwrap();
    fs::remove_file(workshop.path("out/whole/plot.svg")).unwrap();
    workshop.assert_same_files("out/whole", "out/parts", "shorter");
}

#[test]
fn a_failing_resumed_run_loses_nothing() {
    let workshop = Workshop::new(&resumable("hex8", "", true));
    workshop.run_into("out/parts", &[]).done();
    fs::remove_file(&workshop.checkpoints("out/parts")[1]).unwrap();
    let before = workshop.files("out/parts");
    // A frame that cannot be written ends the run at the first one after the checkpoint.
    let next = workshop.path("out/parts/fields/000007.vtu.tmp");
    fs::create_dir(&next).unwrap();
    let output = workshop.resume("out/parts", &[]);
    assert_eq!(
        (output.status(), &output.json()["error"]["kind"]),
        ("failed", &"output".into()),
        "{}",
        output.err
    );
    fs::remove_dir(&next).unwrap();
    let after = workshop.files("out/parts");
    for (before, after) in before.iter().zip(&after).filter(|(file, _)| !file.0.ends_with("plot.svg")) {
        assert!(before == after, "{} was lost", before.0.display());
    }
    assert_eq!(before.len(), after.len());
}

/// A torn list of a series ends within an entry, or has lost its end to an unfinished entry. The next frame
/// makes the list whole. A list that ends before the frames of the checkpoint, or is broken elsewhere, is
/// refused.
#[test]
fn a_list_of_frames_that_is_torn_is_made_whole() {
    let workshop = Workshop::new(&resumable("hex8", "", true));
    workshop.run_into("out/whole", &[]).done();
    let list = workshop.read("out/whole/fields.pvd");
    let entries: Vec<usize> = list.match_indices("    <DataSet").map(|(at, _)| at).collect();
    let (last, tail) = (entries[8], list.find("  </Collection>").unwrap());
    // Six frames belong to the last checkpoint but one, and three are beyond.
    let stopped_run = |folder: &str, list: &str| {
        workshop.run_into(folder, &[]).done();
        workshop.write(&format!("{folder}/fields.pvd"), list);
        workshop.checkpoints(folder)[0].to_str().unwrap().to_owned()
    };
    let times = |name: &str| -> Vec<f64> { workshop.series(name).iter().map(|frame| frame.0).collect() };
    let wanted = times("out/whole/fields.pvd");
    let half_written = format!("{}{}", &list[..last + 10], &list[tail + 10..]);
    let torn = [
        (9, &list[..tail]),
        (9, &list[..tail + 5]),
        (8, &list[..last + 40]),
        (8, &half_written),
        (7, &list[..entries[6] + 40]),
    ];
    for (number, (frames, torn)) in torn.into_iter().enumerate() {
        let folder = format!("out/{number}");
        let checkpoint = stopped_run(&folder, torn);
        // The second frame cannot be written: the first one has made the list whole, and kept the later
        // frames.
        let blocked = workshop.path(&format!("{folder}/fields/000007.vtu.tmp"));
        fs::create_dir(&blocked).unwrap();
        assert_eq!(workshop.resume(&checkpoint, &[]).status(), "failed");
        fs::remove_dir(&blocked).unwrap();
        assert_eq!(times(&format!("{folder}/fields.pvd")), wanted[..frames], "{torn}");
        workshop.resume(&checkpoint, &[]).done();
        workshop.assert_same_files("out/whole", &folder, torn);
    }
    let checkpoint = stopped_run("out/refused", &list[..entries[5] + 40]);
    let output = workshop.resume(&checkpoint, &[]);
    refused(&output, &["it does not list the frames of the interrupted run"]);
    workshop.write("out/refused/fields.pvd", list.replacen("timestep=\"0.0", "timestep=0.0", 1));
    refused(&workshop.resume(&checkpoint, &[]), &["not XML"]);
}

/// A run that has written everything but the end of the list gets it, too.
#[test]
fn a_list_that_is_torn_at_the_end_of_a_run_is_made_whole() {
    let scene = changed(&resumable("hex8", "", true), "every = 0.013", "every = 0.02");
    let workshop = Workshop::new(&scene);
    workshop.run_into("out/whole", &[]).done();
    workshop.run_into("out/parts", &[]).done();
    let list = workshop.read("out/parts/fields.pvd");
    workshop.write("out/parts/fields.pvd", &list[..list.len() - 12]);
    workshop.resume("out/parts", &[]).done();
    workshop.assert_same_files("out/whole", "out/parts", "torn at the end");
    refused(&workshop.resume("out/parts", &[]), &["the run has finished"]);
}

/// Asserts that a run was rejected in these words.
#[track_caller]
fn refused(output: &Told, pieces: &[&str]) {
    assert_eq!(output.status(), "invalid", "{}", output.err);
    for piece in pieces {
        assert!(output.words().contains(piece), "no `{piece}` in {}", output.err);
    }
}

/// A run in `out/case` that has come to the first of its two checkpoints.
fn interrupted(scene: &str) -> Workshop {
    let workshop = Workshop::new(scene);
    workshop.run(&[]).done();
    fs::remove_file(&workshop.checkpoints("out/case")[1]).unwrap();
    workshop
}

#[test]
fn a_checkpoint_of_another_scene_is_refused_with_what_differs() {
    let scene = resumable("hex8", "", true);
    let workshop = interrupted(&scene);
    let before = workshop.files("out/case");
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
        refused(&workshop.resume("out/case", &[]), &pieces);
    }
    // A curve that ends with the scene is another one in a longer scene.
    workshop.write("case/scene.toml", changed(&scene, "to = 0.08\n", ""));
    workshop.run_into("out/open", &[]).done();
    let output = workshop.resume("out/open", &["scene.until=0.2"]);
    refused(&output, &["constraint `hand` differs", "`to = 0.1`, the former end"]);
    // Damping by stiffness, which also shortens automatic steps.
    workshop.write("case/scene.toml", changed(&scene, "[run]", "[run]\nstep = 1e-4"));
    workshop.run_into("out/stepped", &[]).done();
    let output = workshop.resume("out/stepped", &["body.block.stiffness-damping=1e-5"]);
    refused(&output, &["damping by stiffness of solids differs", "run from the start"]);
    assert!(workshop.files("out/case") == before);
}

#[test]
fn a_file_that_is_no_checkpoint_is_refused_with_a_reason() {
    let workshop = interrupted(&resumable("hex8", "", true));
    let before = workshop.files("out/case");
    let bytes = fs::read(&workshop.checkpoints("out/case")[0]).unwrap();
    let file = |content: &[u8]| {
        workshop.write("x.pliant", content);
        workshop.resume_in("x.pliant", "out/case")
    };
    let counted = format!("{} of {} bytes", bytes.len() - 1, bytes.len());
    refused(&file(&bytes[..bytes.len() - 1]), &["is truncated", &counted, "use the checkpoint before it"]);
    refused(&file(b"VTK"), &["`x.pliant` is not a checkpoint", "checkpoint-….pliant"]);
    refused(&file(b""), &["`x.pliant` is not a checkpoint"]);
    let mut flipped = bytes.clone();
    flipped[bytes.len() / 2] ^= 1;
    refused(&file(&flipped), &["is damaged: its checksum does not match", "use the checkpoint before it"]);
    let mut newer = bytes.clone();
    newer[8] = 99;
    refused(&file(&newer), &["has format 99; this version of pliant reads format 20"]);
    refused(&workshop.resume("none.pliant", &[]), &["`none.pliant` cannot be read"]);
    refused(&workshop.resume("case", &[]), &["there is no checkpoint in `case`", "every = 1.0"]);
    assert!(workshop.files("out/case") == before);
}

#[test]
fn a_folder_that_does_not_hold_what_a_checkpoint_continues_is_refused() {
    let workshop = interrupted(&resumable("hex8", "", true));
    let before = workshop.files("out/case");
    let outputs = "does not hold what the checkpoint continues";
    let output = workshop.resume_in("out/case", "elsewhere");
    refused(&output, &[outputs, "there is no such folder", "`--out DIR`"]);
    assert!(!workshop.path("elsewhere").exists());
    let history = workshop.read("out/case/history.csv");
    workshop.write("out/case/history.csv", &history[..history.len() / 2]);
    refused(&workshop.resume("out/case", &[]), &[outputs, "history.csv", "at the checkpoint"]);
    workshop.write("out/case/history.csv", history.replacen("e-", "e+", 1));
    refused(&workshop.resume("out/case", &[]), &[outputs, "differ from the rows of the interrupted run"]);
    workshop.write("out/case/history.csv", &history);
    let frame = workshop.path("out/case/fields/000001.vtu");
    let content = fs::read(&frame).unwrap();
    fs::remove_file(&frame).unwrap();
    refused(&workshop.resume("out/case", &[]), &[outputs, "`fields/000001.vtu` is missing"]);
    fs::write(&frame, content).unwrap();
    // The existing files did not change.
    assert!(workshop.files("out/case") == before);
    workshop.resume("out/case", &[]).done();
    assert!(workshop.files("out/case") == before);
}

#[test]
fn force_leaves_no_checkpoint_of_an_earlier_run() {
    let workshop = Workshop::new(&resumable("hex8", "", false));
    workshop.run(&[]).done();
    workshop.write("out/case/checkpoint-0000000001.pliant.tmp", "half");
    workshop.write("out/case/checkpoint-mine.pliant", "mine");
    workshop.write("case/scene.toml", resumable("hex8", "", false).replace("checkpoint =", "# checkpoint ="));
    workshop.run(&[]).done();
    assert_eq!(workshop.checkpoints("out/case"), [workshop.path("out/case/checkpoint-mine.pliant")]);
    assert!(!workshop.path("out/case/checkpoint-0000000001.pliant.tmp").exists());
}
