//! Killed, interrupted and resumed runs, through the real binary: the same files as an uninterrupted run,
//! exit codes and words.

use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use crate::support::{BLOCK, Said, Workshop, changed, resumable};

/// Waits until a run has written its second checkpoint, kills it, and waits for its end.
fn kill_at_second_checkpoint(mut child: Child, workshop: &Workshop, folder: &str) {
    let patience = Instant::now();
    while !workshop.path(folder).is_dir() || workshop.checkpoints(folder).len() < 2 {
        assert!(patience.elapsed() < Duration::from_secs(60), "no checkpoints came");
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn a_killed_run_goes_on_to_the_files_of_one_that_was_not() {
    let long = resumable("tet4", "threads = 1", true).replace("until = 0.1", "until = 3.0");
    let workshop = Workshop::new(&long);
    let child = workshop
        .command(&["run", "case", "--out", "out/parts"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    kill_at_second_checkpoint(child, &workshop, "out/parts");
    // A row that was only half on disk.
    let half = workshop.read("out/parts/history.csv") + "1.5e0,2.2";
    workshop.write("out/parts/history.csv", half);
    workshop.run(&["--resume", "out/parts"]).done();
    workshop.run(&["--out", "out/whole"]).done();
    workshop.assert_same_files("out/whole", "out/parts", "killed");
}

#[test]
fn a_run_that_cannot_be_resumed_is_refused_and_one_that_can_goes_on_longer() {
    let workshop = Workshop::new(&resumable("hex8", "step = 5e-4", true));
    workshop.run(&[]).done();
    let refused = |output: &Said, pieces: &[&str]| {
        assert_eq!(output.code, 2, "{}", output.err);
        assert_eq!(output.json()["status"], "invalid");
        assert!(pieces.iter().all(|piece| output.words().contains(piece)), "{}", output.err);
    };
    let output = workshop.run(&["--resume", "out/case"]);
    refused(&output, &["the checkpoint is at t = 0.1000 s, and the scene ends at 0.1000 s", "`--until`"]);
    refused(&workshop.run(&["--resume", "case"]), &["there is no checkpoint in `case`", "every = 1.0"]);
    let output = workshop.run(&["--resume", "out/case", "--out", "elsewhere"]);
    refused(
        &output,
        &["does not hold what the checkpoint continues", "there is no such folder", "`--out DIR`"],
    );
    assert_eq!(workshop.run(&["--force", "--resume", "out/case"]).code, 2, "one or the other");
    workshop.run(&["--resume", "out/case", "--until", "0.11"]).done();
    let (_, rows) = workshop.table("out/case/history.csv");
    assert!((rows.last().unwrap()[0] - 0.11).abs() < 1e-12);
}

#[test]
#[cfg(unix)]
fn ctrl_c_leaves_a_checkpoint_and_says_how_to_go_on() {
    let long = resumable("tet4", "threads = 1", true).replace("until = 0.1", "until = 3.0");
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
        (workshop, Said::from(child.wait_with_output().unwrap()))
    };
    let (workshop, output) = interrupt(&long, "out/parts");
    assert_eq!((output.code, &output.json()["status"]), (130, &"interrupted".into()), "{}", output.err);
    assert!(output.words().contains("continue with `--resume out/parts/checkpoint-"), "{}", output.err);
    assert!(workshop.read("out/parts/summary.md").contains("**Interrupted**"));
    workshop.run(&["--resume", "out/parts"]).done();
    workshop.run(&["--out", "out/whole"]).done();
    workshop.assert_same_files("out/whole", "out/parts", "interrupted");

    let (workshop, output) = interrupt(&changed(BLOCK, "until = 0.02", "until = 50"), "out/case");
    assert_eq!(output.code, 130, "{}", output.err);
    assert!(output.words().contains("with `checkpoint = { every = 1.0 }` in `[run]`"), "{}", output.err);
    assert!(workshop.checkpoints("out/case").is_empty());
}
