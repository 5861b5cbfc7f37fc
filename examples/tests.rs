//! Runs all examples.

use std::process::Command;

use pliant_haptics::link::Link;
use pliant_haptics::renderer::Settings;
use pliant_haptics::thread::Haptics;

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

#[test]
fn a_haptic_device_feels_a_wall() {
    runs(env!("CARGO_BIN_EXE_haptic-client"), &[]);
}

/// The client in Python speaks the same protocol.
#[test]
fn a_haptic_device_in_python_gets_forces() {
    let link = Link::open("127.0.0.1:0".parse().unwrap(), false).unwrap();
    let address = link.address().to_string();
    let haptics = Haptics::start(Settings::default(), link).unwrap();
    if Command::new("python3").arg("--version").output().is_err() {
        return println!("skipped: there is no python3");
    }
    runs("python3", &["examples/haptic_client.py", &address, "0,0,0", "0.3"]);
    let report = haptics.finish().unwrap();
    assert!(report.counts.used > 0 && report.counts.malformed == 0, "{report}");
}
