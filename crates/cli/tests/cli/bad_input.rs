//! Bad input through the real binary: the exit code, the user's own line, a remedy, nothing written, and one
//! JSON object. The tests of `pliant-run` reject the other bad scenes.

use std::fs;
use std::path::Path;

use pliant_testing::scenes::assert_input_error;

use crate::support::{BLOCK, FROM_FILE, Said, Workshop, changed, series};

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

/// Asserts exit code 2, these words on standard error, and one JSON object that says so.
#[track_caller]
fn assert_invalid(output: &Said, says: &[&str]) {
    assert_eq!(output.code, 2, "{}\n{}", output.err, output.out);
    assert_input_error([&output.err, &output.words()], &output.json(), says);
}

const MESH_LINE: &str = r#"mesh = { file = "organ.vtk" }"#;

#[test]
fn every_mistake_is_underlined_on_standard_error() {
    let scene = changed(BLOCK, "density = 1000", "densty = 1000");
    let workshop = Workshop::new(&changed(&scene, "until = 0.02", "until = -1"));
    let says = [
        "2 mistakes in case/scene.toml",
        "unknown key `densty` in `body.block`",
        "did you mean `density`?",
        "`scene.until` must be greater than 0, found -1",
    ];
    assert_refused(&workshop, &["densty = 1000"], &says);
    assert_refused(&workshop, &["until = -1"], &says);
    // Doubtful values give a warning, and do not stop the run.
    let output = Workshop::block("density = 1000", "density = 1e-6").pliant(&["check", "case"]);
    assert_eq!(output.code, 0, "{}", output.err);
    assert!(output.words().contains("is that so?") && output.underlines("density = 1e-6"), "{}", output.err);
}

#[test]
fn a_missing_scene_or_mesh_is_told_with_its_path() {
    let workshop = Workshop::new(FROM_FILE);
    assert_refused(&workshop, &[MESH_LINE], &["cannot open `case/organ.vtk`", "relative to the scene file"]);
    assert_invalid(
        &workshop.pliant(&["run", "nowhere", "--json"]),
        &["`nowhere` cannot be read", "pliant new"],
    );
    fs::create_dir(workshop.path("empty")).unwrap();
    assert_invalid(&workshop.pliant(&["run", "empty", "--json"]), &["`empty/scene.toml` cannot be read"]);
    workshop.write("binary.toml", [0xff, 0xfe, 0x00]);
    assert_invalid(&workshop.pliant(&["run", "binary.toml", "--json"]), &["not a text file"]);
    assert_invalid(&workshop.pliant(&["info", "none.msh", "--json"]), &["cannot open `none.msh`"]);
}

#[test]
fn numbers_out_of_range_on_the_command_line_are_refused() {
    let workshop = Workshop::new(BLOCK);
    for (option, value, says) in [
        ("--until", "0", "`scene.until` must be greater than 0, found 0 (given on the command line)"),
        ("--until", "-1", "found -1 (given on the command line)"),
        ("--until", "nan", "nan is not a finite number (given on the command line)"),
        ("--step", "0", "`run.step` must be greater than 0, found 0 (given on the command line)"),
        ("--step", "1", "the step 1.000 s is above the critical time step"),
        ("--threads", "-1", "at least 0"),
        ("--threads", "99999", "at most 1024, found 99999"),
        ("--until", "soon", "invalid value 'soon' for '--until <S>'"),
        ("--precision", "half", "invalid value 'half'"),
    ] {
        assert_invalid(&workshop.run(&[option, value]), &[says]);
    }
    assert!(!workshop.path("out").exists());
    let info = workshop.pliant(&["info", "x.msh", "--scale", "-1", "--json"]);
    assert_invalid(&info, &["`--scale` must be greater than 0, found -1", "0.001 for millimetres"]);
}

#[test]
fn an_output_folder_that_cannot_be_written_is_refused() {
    let workshop = Workshop::new(BLOCK);
    let remedy = "choose another with `--out DIR`";
    assert_invalid(&workshop.run(&["--out", "case/scene.toml/x"]), &["cannot be written", remedy]);
    assert_invalid(
        &workshop.run(&["--out", "case/scene.toml"]),
        &["it is a file, not a folder", "--out DIR"],
    );
    if cfg!(target_os = "linux") {
        assert_invalid(&workshop.run(&["--out", "/proc/x"]), &["`/proc/x` cannot be written", remedy]);
    }
    assert_eq!(workshop.read("case/scene.toml"), BLOCK);
}

#[test]
fn a_filled_folder_needs_force_and_keeps_what_is_not_ours() {
    let workshop = Workshop::new(BLOCK);
    for foreign in ["out/case/notes.txt", "out/case/fields/mine.vtu", "out/case/fields/000000.txt"] {
        workshop.write(foreign, "mine");
    }
    workshop.write("out/case/fields/000099.vtu", "of an earlier run");
    workshop.write("out/case/fields/000099.vtu.tmp", "of a killed run");
    let output = workshop.run(&[]);
    assert_invalid(&output, &["`out/case` cannot be written: it is not empty", "add `--force`"]);
    assert!(workshop.path("out/case/fields/000099.vtu").exists());
    workshop.run(&["--force"]).done();
    for foreign in ["out/case/notes.txt", "out/case/fields/mine.vtu", "out/case/fields/000000.txt"] {
        assert_eq!(workshop.read(foreign), "mine");
    }
    assert!(!workshop.path("out/case/fields/000099.vtu").exists());
    assert!(!workshop.path("out/case/fields/000099.vtu.tmp").exists());
    assert!(workshop.series("out/case/fields.pvd").len() > 2);
}

/// Asserts that a run ended with exit code 1 because a file could not be written.
#[track_caller]
fn assert_disk_full(output: &Said, file: &str, reason: &str) {
    assert_eq!(output.code, 1, "{}", output.err);
    let json = output.json();
    assert_eq!(json["status"], "failed");
    assert_eq!(json["error"]["kind"], "output");
    let message = json["error"]["message"].as_str().unwrap();
    for piece in [file, reason, "free space"] {
        assert!(message.contains(piece) && output.err.contains(piece), "no `{piece}` in {message}");
    }
}

/// Lists files under a folder that a killed or failed write would leave.
fn halves(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let names = entries.flat_map(|path| match path.is_dir() {
        true => halves(&path),
        false => vec![path.display().to_string()],
    });
    names.filter(|name| name.ends_with(".tmp")).collect()
}

/// Runs the scene with a limit on the file size, in blocks of 512 or 1024 bytes. Writing fails as on a full
/// disk.
#[cfg(unix)]
fn run_limited(workshop: &Workshop, blocks: u32, trap: &str) -> Said {
    let limited = format!("{trap} ulimit -f {blocks}; exec \"$0\" run case --force --json");
    let output = std::process::Command::new("sh")
        .args(["-c", &limited, env!("CARGO_BIN_EXE_pliant")])
        .current_dir(workshop.path(""))
        .output()
        .unwrap();
    output.into()
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_at_the_history_ends_the_run_clearly() {
    let workshop = Workshop::new(BLOCK);
    // Where the system would end the process with SIGXFSZ, and where that is ignored.
    for trap in ["", "trap '' XFSZ;"] {
        assert_disk_full(&run_limited(&workshop, 0, trap), "out/case/history.csv", "File too large");
    }
    assert_eq!(halves(&workshop.path("out")), Vec::<String>::new());
}

#[test]
fn a_frame_that_cannot_be_written_leaves_the_frames_before() {
    let workshop = Workshop::new(BLOCK);
    fs::create_dir_all(workshop.path("out/case/fields/000002.vtu")).unwrap();
    assert_disk_full(&workshop.run(&["--force"]), "out/case/fields/000002.vtu", "not a regular file");
    assert_eq!(workshop.series("out/case/fields.pvd").len(), 2);
    assert_eq!(halves(&workshop.path("out")), Vec::<String>::new());
    assert!(workshop.read("out/case/summary.md").contains("**Failed** (output)"));
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_in_the_middle_of_the_history_leaves_whole_rows() {
    let scene = changed(BLOCK, "type = \"csv\"\nevery = 0.004", "type = \"csv\"\nevery = 1e-5");
    let scene = scene.replace("until = 0.02", "until = 0.2").replace("every = 0.004", "every = 0.02");
    let workshop = Workshop::new(&scene);
    assert_disk_full(&run_limited(&workshop, 8, ""), "out/case/history.csv", "File too large");
    let (_, rows) = workshop.table("out/case/history.csv");
    assert!(rows.len() > 5, "{}", rows.len());
    assert!(!series(&workshop.path("out/case/fields.pvd")).is_empty());
    assert_eq!(halves(&workshop.path("out")), Vec::<String>::new());
}

#[test]
fn check_and_info_refuse_like_run() {
    let workshop = Workshop::block("density = 1000", "density = 0");
    let output = workshop.pliant(&["check", "case"]);
    assert_eq!(output.code, 2);
    assert!(output.underlines("density = 0") && output.out.is_empty(), "{}", output.err);
    workshop.write("broken.off", "OFF\n3 1 0\n0 0 0\n");
    let output = workshop.pliant(&["info", "broken.off"]);
    assert_eq!(output.code, 2);
    assert!(output.err.contains("truncated"), "{}", output.err);
}

#[test]
fn new_does_not_overwrite() {
    let workshop = Workshop::new(BLOCK);
    let output = workshop.pliant(&["new", "case"]);
    assert_eq!(output.code, 2);
    assert!(output.err.contains("`case/scene.toml` exists already"), "{}", output.err);
    assert_eq!(workshop.read("case/scene.toml"), BLOCK);
    let output = workshop.pliant(&["new", "case/scene.toml/below"]);
    assert_eq!(output.code, 2);
    assert!(output.err.contains("cannot be written"), "{}", output.err);
}

/// 5,000 terms, each wrong: 152 MB were printed.
#[test]
fn a_flood_of_mistakes_is_shown_in_a_few_kilobytes() {
    let terms = format!("prony = [{}]", "1, ".repeat(5000));
    let scene = changed(BLOCK, r#"prony = [{ part = "isochoric", weight = 0.3, time = 0.5 }]"#, &terms);
    let output = Workshop::new(&scene).run(&[]);
    assert_invalid(&output, &["prony"]);
    assert!(output.err.len() + output.out.len() < 100_000, "{} bytes", output.err.len() + output.out.len());
}

/// Names and titles of a scene from somewhere else neither reach the terminal as codes nor a page as HTML.
#[test]
fn codes_for_terminals_and_html_are_shown_not_obeyed() {
    const TITLE: &str = r#"[scene]
title = "\u001b]0;mine\u0007<script>alert(1)</script>""#;
    let codes = |text: &str| text.contains(['\u{1b}', '\u{7}', '\u{9b}']);
    let workshop = Workshop::new(&changed(BLOCK, "[scene]", TITLE));
    let output = workshop.run(&[]);
    assert!(output.code == 0 && !codes(&output.err) && !codes(&output.out), "{}", output.err);
    let page = workshop.read("out/case/summary.md");
    assert!(!codes(&page) && !page.contains("<script") && page.contains("&lt;script>"), "{page}");
    for bad in ["\"\\u001b[2J\" = 1", "# \u{9b}2J\nuntill = 1", "\u{202e} = 1"] {
        let output = Workshop::new(&changed(BLOCK, "[scene]", &format!("[scene]\n{bad}"))).run(&[]);
        assert!(output.code == 2 && !codes(&output.err) && !codes(&output.out), "{}", output.err);
        assert!(!output.err.contains('\u{202e}'), "{}", output.err);
    }
}

#[test]
fn a_run_of_more_than_a_day_asks_for_consent() {
    let workshop = Workshop::block("until = 0.02", "until = 1e9");
    let output = workshop.run(&[]);
    assert_invalid(&output, &["the run takes ", " steps of ", "days on this machine", "add `--long`"]);
    assert!(output.underlines("until = 1e9"), "{}", output.err);
    assert!(!workshop.path("out").exists());
    // Whoever wants it gets it.
    let mut child = workshop
        .command(&["run", "case", "--long"])
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let patience = std::time::Instant::now();
    while !workshop.path("out/case/fields.pvd").exists() {
        assert!(patience.elapsed().as_secs() < 60, "no frame came");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn commands_of_the_laboratory_are_answered_with_the_ones_to_type() {
    let workshop = Workshop::new("");
    let said = workshop.pliant(&["reproduce", "--only", "fig-6.3", "--help"]);
    assert_eq!(said.code, 2);
    let typed = "`cargo run --release -p pliant-lab -- reproduce --only fig-6.3 --help`";
    assert!(said.words().contains(typed), "{}", said.err);
    let said = workshop.pliant(&["bench", "--json"]);
    assert_eq!((said.code, said.json()["status"].as_str()), (2, Some("invalid")), "{}", said.out);
    assert!(!workshop.pliant(&["--help"]).out.contains("reproduce"));
}

/// A program with an address space that is too small, as a container has.
#[test]
#[cfg(target_os = "linux")]
fn models_and_solvers_without_room_are_an_error() {
    let wall = "[scene]\nuntil = 1e-3\n[run]\nsolver = 'static'\n[law.tissue]\ntype = 'st-venant-kirchhoff'\nyoung-modulus = 3e3\n\
                poisson-ratio = 0.3\n[body.wall]\nmodel = 'shell'\nmesh = { plate = { size = [0.1, 0.1], cells = [400, 400] } }\n\
                law = 'tissue'\ndensity = 1000\nthickness = 1e-3\n[constraint.base]\ntype = 'fix'\nbody = 'wall'\n\
                nodes = { set = 'x-min' }\n";
    let block = "[scene]\nuntil = 1e-3\n[run]\nsolver = 'implicit'\nstep = 1e-3\nlinear = 'conjugate-gradients'\n[law.tissue]\n\
                 type = 'neo-hookean'\nyoung-modulus = 3e3\npoisson-ratio = 0.45\n[body.block]\n\
                 mesh = { block = { size = [0.1, 0.1, 0.1], cells = [40, 40, 40] } }\nlaw = 'tissue'\ndensity = 1000\n\
                 [constraint.base]\ntype = 'fix'\nbody = 'block'\nnodes = { set = 'x-min' }\n";
    for (scene, code, kind, says) in [
        (wall, 2, "input", "there is no room for the model of `wall`: 2.9 GB of memory are needed"),
        (block, 1, "memory", "there is no room for the solver: 1.2 GB of memory are needed"),
    ] {
        let workshop = Workshop::new(scene);
        let program = env!("CARGO_BIN_EXE_pliant");
        let script = format!("ulimit -v 1200000; exec {program} run case --threads 1 --json");
        let said: Said = workshop.program("sh", &["-c", &script]).output().expect("a shell starts").into();
        assert_eq!(said.code, code, "{}", said.err);
        assert_eq!(said.json()["error"]["kind"], kind, "{}", said.out);
        assert!(said.words().contains(says) && said.words().contains("use a coarser mesh"), "{}", said.err);
    }
}
