//! Runs all examples.

use std::process::Command;

fn runs(program: &str, arguments: &[&str]) {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    let output = Command::new(program).args(arguments).current_dir(root).output().unwrap();
    println!("{}", String::from_utf8_lossy(&output.stdout));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn a_scene_is_run() {
    runs(env!("CARGO_BIN_EXE_run-scene"), &["scenes/block-and-balloon"]);
}

#[test]
fn a_body_is_made_of_arrays() {
    runs(env!("CARGO_BIN_EXE_body-from-arrays"), &[]);
}

#[test]
fn a_step_loop_reads_displacements_and_reactions() {
    runs(env!("CARGO_BIN_EXE_step-loop"), &[]);
}

#[test]
fn shells_are_solved() {
    runs(env!("CARGO_BIN_EXE_shells"), &[]);
}

#[test]
fn a_law_of_ones_own_is_computed() {
    runs(env!("CARGO_BIN_EXE_own-law"), &[]);
}
