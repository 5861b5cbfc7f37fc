//! Sweeps, through the real binary: words, exit codes, folders.

use std::fs;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::support::{BLOCK, Said, Workshop};

fn sweep(workshop: &Workshop, arguments: &[&str]) -> Said {
    workshop.pliant(&[&["sweep", "case"], arguments].concat())
}

#[test]
fn a_sweep_tells_what_it_came_to() {
    let workshop = Workshop::new(BLOCK);
    let set = ["--set", "law.tissue.young-modulus=5e3..20e3/3", "--set", "scene.until=0.008"];
    let output = sweep(&workshop, &set);
    assert_eq!(output.code, 0, "{}", output.err);
    for piece in ["3 runs, 0 failed\nwrote out/case-sweep/sweep.csv", "wrote out/case-sweep/sweep.svg"] {
        assert!(output.out.contains(piece), "no `{piece}` in {}", output.out);
    }
    assert!(!workshop.path("out/case-sweep/run-0002/fields.pvd").exists());
    let more = ["--threads", "3", "--out", "out/again", "--keep-fields"];
    let again = sweep(&workshop, &[&set[..], &more].concat());
    assert_eq!(again.code, 0, "{}", again.err);
    assert!(workshop.series("out/again/run-0002/fields.pvd").len() > 1);
}

#[test]
fn a_run_that_fails_stops_no_other() {
    let workshop = Workshop::new(BLOCK);
    let set = ["--set", "constraint.hand.by.2=0.001,-0.2,0.002", "--set", "scene.until=0.1"];
    let output = sweep(&workshop, &set);
    assert_eq!(output.code, 1, "{}", output.err);
    assert!(output.out.contains("3 runs, 1 failed"), "{}", output.out);
    for piece in ["1 of 3 runs failed", "run-0001 (constraint.hand.by.2=-0.2 scene.until=0.1)", "is inverted"]
    {
        assert!(output.words().contains(piece), "no `{piece}` in {}", output.err);
    }
    let rows = workshop.cells("out/case-sweep/sweep.csv");
    let status = rows[0].iter().position(|name| name == "status").unwrap();
    let states: Vec<&str> = rows[1..].iter().map(|row| row[status].as_str()).collect();
    assert_eq!(states, ["done", "failed", "done"]);
    assert!(rows[2][status + 1].contains("is inverted"));
    assert!(
        rows[2].iter().zip(&rows[0]).all(|(cell, name)| !name.starts_with("reaction") || cell.is_empty())
    );
}

#[test]
fn all_combinations_are_checked_before_the_first_is_run() {
    let workshop = Workshop::new(BLOCK);
    let set = ["--set", "law.tissue.young-modulus=1e3,2e3", "--set", "law.tissue.poisson-ratio=0.3,0.7"];
    let output = sweep(&workshop, &set);
    assert_eq!(output.code, 2, "{}", output.err);
    assert!(output.underlines("--set law.tissue.poisson-ratio=0.7"), "{}", output.err);
    assert!(output.words().contains("2 of 4 combinations are invalid; nothing was run"), "{}", output.err);
    assert_eq!(output.err.matches("found 0.7").count(), 1, "told once: {}", output.err);
    assert!(!workshop.path("out").exists());
    for (set, says) in [
        ("law.tissue.young-modulus=1e3,,2e3", "a value of `law.tissue.young-modulus` is missing"),
        ("law.tissue.young-modulus=1e3..2e3", "is not a range: the number of values is missing"),
        ("law.tisue.young-modulus=1e3,2e3", "did you mean `tissue`?"),
        ("law.tissue.young-modulus", "is not an assignment"),
    ] {
        let output = sweep(&workshop, &["--set", set]);
        assert_eq!(output.code, 2);
        assert!(output.words().contains(says), "no `{says}` in {}", output.err);
        assert!(output.err.contains(&format!("--set {}", set.split(',').next().unwrap())), "{}", output.err);
    }
    assert_eq!(sweep(&workshop, &[]).code, 2, "something is to be swept");
}

#[test]
fn a_dry_run_lists_the_product_and_writes_nothing() {
    let workshop = Workshop::new(BLOCK);
    let output = sweep(
        &workshop,
        &["--set", "body.block.element=tet4,tet4-anp", "--set", "scene.until=1..2/2", "--dry-run"],
    );
    assert_eq!((output.code, output.err.as_str()), (0, ""));
    let lines: Vec<&str> = output.out.lines().collect();
    assert_eq!(
        lines,
        [
            "run-0000  body.block.element=tet4 scene.until=1",
            "run-0001  body.block.element=tet4 scene.until=2",
            "run-0002  body.block.element=tet4-anp scene.until=1",
            "run-0003  body.block.element=tet4-anp scene.until=2",
        ]
    );
    assert!(!workshop.path("out").exists());
}

#[test]
fn a_filled_folder_needs_force_and_loses_the_runs_of_an_earlier_sweep() {
    let workshop = Workshop::new(BLOCK);
    let three = ["--set", "scene.until=0.001,0.002,0.003"];
    assert_eq!(sweep(&workshop, &three).code, 0);
    workshop.write("out/case-sweep/run-0001/notes.txt", "mine");
    let two = ["--set", "scene.until=0.001", "--set", "scene.gravity=[0,0,0]"];
    let output = sweep(&workshop, &two);
    assert_eq!(output.code, 2);
    assert!(output.err.contains("it is not empty") && output.err.contains("--force"), "{}", output.err);
    assert_eq!(sweep(&workshop, &[&two[..], &["--force"]].concat()).code, 0);
    assert!(!workshop.path("out/case-sweep/run-0002").exists());
    let left: Vec<_> = fs::read_dir(workshop.path("out/case-sweep/run-0001"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    assert_eq!(left, ["notes.txt"]);
    assert_eq!(workshop.cells("out/case-sweep/sweep.csv").len(), 2);
}

#[test]
#[cfg(unix)]
fn ctrl_c_ends_a_sweep_with_what_it_has() {
    let workshop = Workshop::new(BLOCK);
    let child = workshop
        .command(&["sweep", "case", "--threads", "1", "--set", "scene.until=0.001,100,0.002"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let patience = Instant::now();
    while !workshop.path("out/case-sweep/run-0001/history.csv").exists() {
        assert!(patience.elapsed() < Duration::from_secs(60), "the second run did not begin");
        std::thread::sleep(Duration::from_millis(1));
    }
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(killed.unwrap().success());
    let output = Said::from(child.wait_with_output().unwrap());
    assert_eq!(output.code, 130, "{}", output.err);
    assert!(output.words().contains("the table contains the finished runs"), "{}", output.err);
    let rows = workshop.cells("out/case-sweep/sweep.csv");
    let states: Vec<&str> = rows[1..].iter().map(|row| row[2].as_str()).collect();
    assert_eq!(states, ["done", "interrupted"]);
}
