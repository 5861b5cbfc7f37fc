//! The environment of a run, through the real binary: signals, locked folders, links in them, standard
//! streams that can't be written, stale files. Also paths that are not files.

use std::fs::{self, File};
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::support::{BLOCK, Said, Workshop, changed};

/// A run of many seconds that writes often.
fn long() -> Workshop {
    Workshop::new(&changed(BLOCK, "until = 0.02", "until = 50"))
}

/// Starts a run into `out/case` and waits for its second frame.
fn started(workshop: &Workshop, command: &mut Command) -> Child {
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let patience = Instant::now();
    while !workshop.path("out/case/fields/000001.vtu").exists() {
        assert!(patience.elapsed() < Duration::from_secs(60), "no frames came");
        std::thread::sleep(Duration::from_millis(2));
    }
    child
}

fn send(signal: &str, child: &Child) {
    let sent = Command::new("kill").args([signal, &child.id().to_string()]).status();
    assert!(sent.unwrap().success());
}

#[test]
fn sigterm_and_sighup_end_a_run_as_ctrl_c_does() {
    for (signal, code) in [("-TERM", 143), ("-HUP", 129), ("-INT", 130)] {
        // Longer than any machine needs to send a signal.
        let scene = changed(BLOCK, "until = 0.02", "until = 5000");
        let workshop =
            Workshop::new(&changed(&scene, "threads = 1", "threads = 1\ncheckpoint = { every = 1 }"));
        // A parent that ignores SIGHUP, such as `nohup`, passes that on to the tests.
        let mut command = match cfg!(target_os = "linux") {
            true => {
                let mut command = Command::new("env");
                command.args(["--default-signal=HUP", env!("CARGO_BIN_EXE_pliant")]);
                command.current_dir(workshop.path("")).args(["run", "case", "--json"]);
                command
            }
            false => workshop.command(&["run", "case", "--json"]),
        };
        let child = started(&workshop, &mut command);
        send(signal, &child);
        let output = Said::from(child.wait_with_output().unwrap());
        assert_eq!((output.code, &output.json()["status"]), (code, &"interrupted".into()), "{}", output.err);
        assert!(output.words().contains("continue with `--resume out/case/checkpoint-"), "{}", output.err);
        assert!(workshop.read("out/case/summary.md").contains("**Interrupted**"));
        assert!(workshop.path("out/case/plot.svg").exists());
        assert!(!workshop.path("out/case/.pliant-lock").exists());
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_run_under_nohup_outlives_the_terminal() {
    let workshop = Workshop::new(&changed(BLOCK, "until = 0.02", "until = 0.5"));
    let mut command = Command::new("nohup");
    command.arg(env!("CARGO_BIN_EXE_pliant")).args(["run", "case", "--json"]).current_dir(workshop.path(""));
    let child = started(&workshop, &mut command);
    send("-HUP", &child);
    Said::from(child.wait_with_output().unwrap()).done();
}

#[test]
fn a_second_run_in_the_same_folder_is_refused() {
    let workshop = long();
    let child = started(&workshop, &mut workshop.command(&["run", "case"]));
    let says = format!("`out/case` cannot be written: another run (process {}) is writing to it", child.id());
    for arguments in [&["--force"][..], &[]] {
        let output = workshop.run(arguments);
        assert_eq!(output.code, 2, "{}", output.err);
        assert!(output.words().contains(&says) && output.words().contains("`--out DIR`"), "{}", output.err);
    }
    send("-KILL", &child);
    child.wait_with_output().unwrap();
    // A killed run leaves its file, but no lock.
    assert!(workshop.path("out/case/.pliant-lock").exists());
    workshop.run(&["--force", "--until", "0.001"]).done();
    assert!(!workshop.path("out/case/.pliant-lock").exists());
}

#[test]
fn a_run_is_not_resumed_while_it_runs() {
    let scene = changed(BLOCK, "until = 0.02", "until = 50");
    let workshop =
        Workshop::new(&changed(&scene, "threads = 1", "threads = 1\ncheckpoint = { every = 0.01 }"));
    let child = started(&workshop, &mut workshop.command(&["run", "case"]));
    let patience = Instant::now();
    let there = |folder: &Path| {
        fs::read_dir(folder)
            .unwrap()
            .any(|entry| entry.unwrap().path().extension() == Some("pliant".as_ref()))
    };
    while !there(&workshop.path("out/case")) {
        assert!(patience.elapsed() < Duration::from_secs(60), "no checkpoint came");
        std::thread::sleep(Duration::from_millis(2));
    }
    // The run may replace a checkpoint while it is read: then another one can be read.
    let mut output = workshop.run(&["--resume", "out/case"]);
    for _ in 0..20 {
        if output.err.contains("cannot be read") {
            output = workshop.run(&["--resume", "out/case"]);
        }
    }
    send("-KILL", &child);
    child.wait_with_output().unwrap();
    assert_eq!(output.code, 2, "{}", output.err);
    assert!(output.words().contains("another run (process "), "{}", output.err);
}

/// A file that a link may lead to.
const ELSEWHERE: &str = "elsewhere/precious.txt";

#[test]
fn links_in_an_output_folder_are_not_followed() {
    for (link, is_folder) in [
        ("history.csv", false),
        ("fields.pvd", false),
        ("summary.md", false),
        ("plot.svg", false),
        ("summary.md.tmp", false),
        (".pliant-lock", false),
        ("fields", true),
        ("fields/000000.vtu.tmp", false),
    ] {
        let workshop = Workshop::new(BLOCK);
        workshop.write(ELSEWHERE, "precious");
        workshop.write("elsewhere/000099.vtu", "precious, too");
        let path = workshop.path("out/case").join(link);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        let goal = if is_folder { workshop.path("elsewhere") } else { workshop.path(ELSEWHERE) };
        symlink(&goal, &path).unwrap();
        let output = workshop.run(&["--force"]);
        assert_ne!(output.code, 0, "{link}");
        let says = format!("is a link to `{}`", goal.display());
        assert!(output.words().contains(link) && output.words().contains(&says), "{link}: {}", output.err);
        assert!(path.is_symlink(), "{link} was removed");
        assert_eq!(workshop.read(ELSEWHERE), "precious", "{link}");
        assert_eq!(workshop.read("elsewhere/000099.vtu"), "precious, too", "{link}");
        assert_eq!(fs::read_dir(workshop.path("elsewhere")).unwrap().count(), 2, "{link}");
    }
}

#[test]
fn a_resumed_run_and_a_sweep_follow_no_links_either() {
    let scene = changed(BLOCK, "threads = 1", "threads = 1\ncheckpoint = { every = 0.01 }");
    let workshop = Workshop::new(&scene);
    workshop.run(&[]).done();
    let history = workshop.path("out/case/history.csv");
    workshop.write(ELSEWHERE, workshop.read("out/case/history.csv"));
    fs::remove_file(&history).unwrap();
    symlink(workshop.path(ELSEWHERE), &history).unwrap();
    let output = workshop.run(&["--resume", "out/case"]);
    assert_eq!(output.code, 2, "{}", output.err);
    assert!(output.words().contains("out/case/history.csv` is a link to"), "{}", output.err);

    workshop.write("elsewhere/summary.md", "precious");
    fs::create_dir_all(workshop.path("out/sweep")).unwrap();
    symlink(workshop.path("elsewhere"), workshop.path("out/sweep/run-0000")).unwrap();
    let sweep = ["sweep", "case", "--set", "body.block.damping=5,6", "--out", "out/sweep", "--force"];
    let output = workshop.pliant(&sweep);
    assert_eq!(output.code, 2, "{}", output.err);
    assert!(output.words().contains("out/sweep/run-0000` is a link to"), "{}", output.err);
    assert_eq!(workshop.read("elsewhere/summary.md"), "precious");
}

/// A scene that runs, with a warning.
fn doubtful() -> Workshop {
    Workshop::block("curve = \"smooth-step\"", "from = 1\nto = 2")
}

#[test]
#[cfg(target_os = "linux")]
fn standard_error_that_cannot_be_written_stops_no_run() {
    let full = || Stdio::from(File::options().write(true).open("/dev/full").unwrap());
    let workshop = doubtful();
    let output = workshop.command(&["run", "case", "--json"]).stderr(full()).output().unwrap();
    Said::from(output).done();
    // A pipe that nobody reads.
    let closed = || {
        let mut child = Command::new("true").stdin(Stdio::piped()).spawn().unwrap();
        let pipe = child.stdin.take().unwrap();
        child.wait().unwrap();
        Stdio::from(pipe)
    };
    let output = workshop.command(&["run", "case", "--json", "--force"]).stderr(closed()).output().unwrap();
    Said::from(output).done();
    let shell = "exec \"$0\" run case --json --force 2>&-";
    let mut command = Command::new("sh");
    command.args(["-c", shell, env!("CARGO_BIN_EXE_pliant")]).current_dir(workshop.path(""));
    Said::from(command.output().unwrap()).done();
    // Only the exit code reports the error.
    workshop.write("case/scene.toml", "until = ");
    let output = workshop.command(&["check", "case"]).stderr(full()).output().unwrap();
    assert_eq!(Said::from(output).code, 2);
}

#[test]
#[cfg(target_os = "linux")]
fn standard_output_that_cannot_be_written_is_reported() {
    let full = || Stdio::from(File::options().write(true).open("/dev/full").unwrap());
    let workshop = Workshop::new(BLOCK);
    for arguments in [&["schema"][..], &["run", "case"], &["run", "case", "--json", "--force"]] {
        let output = workshop.command(arguments).stdout(full()).output().unwrap();
        let said = Said::from(output);
        assert_eq!(said.code, 1, "{arguments:?}: {}", said.err);
        assert!(said.err.contains("error: standard output cannot be written"), "{}", said.err);
    }
    assert!(workshop.read("out/case/summary.md").contains("Done: "));
}

#[test]
fn what_killed_runs_left_unfinished_is_removed() {
    let scene = changed(BLOCK, "threads = 1", "threads = 1\ncheckpoint = { every = 0.01 }");
    let left = [
        "out/case/checkpoint-0000000001.pliant.tmp",
        "out/case/checkpoint-0000000002.pliant.tmp",
        "out/case/summary.md.tmp",
        "out/case/plot.svg.tmp",
        "out/case/fields.pvd.tmp",
        "out/case/fields/000077.vtu.tmp",
    ];
    for resumed in [false, true] {
        let workshop = Workshop::new(&scene);
        workshop.run(&[]).done();
        left.iter().for_each(|file| workshop.write(file, "half"));
        workshop.write("out/case/notes.tmp", "mine");
        fs::remove_file(workshop.path("out/case/summary.md")).unwrap();
        let again = if resumed { &["--resume", "out/case"][..] } else { &["--force"] };
        workshop.run(again).done();
        for file in left {
            assert!(!workshop.path(file).exists(), "{file} is still there, resumed: {resumed}");
        }
        assert_eq!(workshop.read("out/case/notes.tmp"), "mine");
    }
}

/// Runs the binary, which must not wait for ever.
fn within_seconds(workshop: &Workshop, arguments: &[&str]) -> Said {
    let mut command = workshop.command(arguments);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let patience = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if patience.elapsed() > Duration::from_secs(30) {
            child.kill().unwrap();
            panic!("{arguments:?} still waits");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.wait_with_output().unwrap().into()
}

#[test]
fn pipes_and_devices_are_no_files() {
    let moved =
        crate::support::FROM_FILE.replace("type = \"fix\"", "type = \"move\"\nby = { csv = \"pipe.csv\" }");
    let workshop = Workshop::new(&moved);
    workshop
        .write("case/organ.vtk", crate::support::vtk(&crate::support::CORNERS, &crate::support::TETS, ""));
    for pipe in ["pipe.toml", "model.xml", "case/pipe.csv", "checkpoint-0000000001.pliant"] {
        assert!(Command::new("mkfifo").arg(workshop.path(pipe)).status().unwrap().success());
    }
    for arguments in [
        &["check", "pipe.toml"][..],
        &["check", "model.xml"],
        &["import", "model.xml", "-o", "x"],
        &["check", "case"],
        &["check", "/dev/zero"],
        &["run", "case", "--resume", "checkpoint-0000000001.pliant"],
    ] {
        let output = within_seconds(&workshop, arguments);
        assert_eq!(output.code, 2, "{arguments:?}: {}", output.err);
        assert!(
            output.words().contains("it is not a regular file but a pipe"),
            "{arguments:?}: {}",
            output.err
        );
    }
}

/// A scene whose mesh, and whose table of motions, may lie elsewhere.
fn naming(mesh: &str, table: &str) -> String {
    let scene = crate::support::FROM_FILE.replace("organ.vtk", mesh);
    let move_by = format!("type = \"move\"\nby = {{ csv = \"{table}\" }}");
    scene.replace("type = \"fix\"", &move_by)
}

#[test]
fn a_sandbox_keeps_a_scene_in_its_folder() {
    let workshop = Workshop::new("");
    let mesh = crate::support::vtk(&crate::support::CORNERS, &crate::support::TETS, "");
    let table: String = (0..8).map(|node| format!("{node},0,0,0\n")).collect();
    for folder in ["case", "case/deep", "elsewhere"] {
        workshop.write(&format!("{folder}/organ.vtk"), &mesh);
        workshop.write(&format!("{folder}/table.csv"), &table);
    }
    symlink(workshop.path("elsewhere/organ.vtk"), workshop.path("case/link.vtk")).unwrap();
    symlink(workshop.path("elsewhere"), workshop.path("case/linked")).unwrap();
    symlink("organ.vtk", workshop.path("case/own.vtk")).unwrap();
    let absolute = workshop.path("elsewhere/organ.vtk").display().to_string();
    for (mesh, table, allowed) in [
        ("organ.vtk", "table.csv", true),
        ("deep/organ.vtk", "deep/../table.csv", true),
        ("own.vtk", "table.csv", true),
        ("../elsewhere/organ.vtk", "table.csv", false),
        (&absolute, "table.csv", false),
        ("link.vtk", "table.csv", false),
        ("linked/organ.vtk", "table.csv", false),
        ("organ.vtk", "../elsewhere/table.csv", false),
        ("organ.vtk", "linked/table.csv", false),
    ] {
        workshop.write("case/scene.toml", naming(mesh, table));
        assert_eq!(workshop.pliant(&["check", "case"]).code, 0, "{mesh}, {table}");
        let output = workshop.pliant(&["check", "case", "--sandbox"]);
        assert_eq!(output.code, if allowed { 0 } else { 2 }, "{mesh}, {table}: {}", output.err);
        let says = output.words().contains("it is outside the scene's folder");
        assert_eq!(says, !allowed, "{mesh}, {table}: {}", output.err);
        // A run reads the same files, and leaves nothing where it may not.
        let output =
            workshop.pliant(&["run", "case", "--sandbox", "--until", "1e-4", "--out", "out", "--force"]);
        assert_eq!(output.code, if allowed { 0 } else { 2 }, "{mesh}, {table}: {}", output.err);
        let says = output.words().contains("it is outside the scene's folder");
        assert_eq!(says, !allowed, "{mesh}, {table}: {}", output.err);
        assert_eq!(workshop.path("out").exists(), allowed, "{mesh}, {table}");
        if allowed {
            std::fs::remove_dir_all(workshop.path("out")).unwrap();
        }
    }
    // The scene file itself.
    workshop.write("elsewhere/other.toml", naming("organ.vtk", "table.csv"));
    symlink(workshop.path("elsewhere/other.toml"), workshop.path("case/other.toml")).unwrap();
    let output = workshop.pliant(&["check", "case/other.toml", "--sandbox"]);
    assert!(output.code == 2 && output.words().contains("outside the scene's folder"), "{}", output.err);
}

#[test]
fn a_sandbox_keeps_images_and_models_in_their_folder() {
    let scene = changed(
        crate::support::FROM_FILE,
        "mesh = { file = \"organ.vtk\" }",
        "mesh = { image = \"scan.nhdr\", label = 1, edge = 0.05 }",
    );
    let workshop = Workshop::new(&scene);
    let header = |data: &str| {
        format!(
            "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 12 12 12\nspace: left-posterior-superior\n\
             space directions: (10,0,0) (0,10,0) (0,0,10)\nspace origin: (0,0,0)\nencoding: raw\ndata file: {data}\n"
        )
    };
    let inside = |i: usize| (2..10).contains(&i);
    let voxels: Vec<u8> =
        (0..1728).map(|i| u8::from([i % 12, i / 12 % 12, i / 144].into_iter().all(inside))).collect();
    workshop.write("case/scan.raw", &voxels);
    workshop.write("elsewhere/scan.raw", &voxels);
    for (data, allowed) in [("scan.raw", true), ("../elsewhere/scan.raw", false)] {
        workshop.write("case/scan.nhdr", header(data));
        let output = workshop.pliant(&["check", "case"]);
        assert_eq!(output.code, 0, "{}", output.err);
        let output = workshop.pliant(&["check", "case", "--sandbox", "--no-cache"]);
        assert_eq!(output.code, if allowed { 0 } else { 2 }, "{data}: {}", output.err);
        assert_eq!(output.words().contains("it is outside the folder"), !allowed, "{data}: {}", output.err);
    }
    let model = "<Model><SystemParams><TimeStep>0.001</TimeStep><TotalTime>0.1</TotalTime><DampingCoeff>5</DampingCoeff>\
                 <Density>1000</Density></SystemParams><VTKMesh Type=\"T4\">../elsewhere/organ.vtk</VTKMesh></Model>";
    workshop.write("model/model.xml", model);
    workshop.write(
        "elsewhere/organ.vtk",
        crate::support::vtk(&crate::support::CORNERS, &crate::support::TETS, ""),
    );
    let words = |more: &[&str]| workshop.pliant(&[&["check", "model/model.xml"], more].concat()).words();
    assert!(!words(&[]).contains("outside the scene's folder"), "{}", words(&[]));
    assert!(words(&["--sandbox"]).contains("outside the scene's folder"), "{}", words(&["--sandbox"]));
}

/// A name in a mesh file cannot clear the screen.
#[test]
fn names_from_files_reach_the_terminal_without_codes() {
    let workshop = Workshop::new(BLOCK);
    workshop.write(
        "named.msh",
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"\u{1b}[2Jliver\"\n$EndPhysicalNames\n$Nodes\n4\n1 0 0 0\n\
         2 0.1 0 0\n3 0 0.1 0\n4 0 0 0.1\n$EndNodes\n$Elements\n1\n1 4 2 1 1 1 2 3 4\n$EndElements\n",
    );
    let output = workshop.pliant(&["info", "named.msh"]);
    assert!(output.code == 0 && output.out.contains("?[2Jliver"), "{}{}", output.out, output.err);
    assert!(!output.out.contains('\u{1b}') && !output.err.contains('\u{1b}'));
}
