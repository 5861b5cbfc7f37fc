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
    runs(env!("CARGO_BIN_EXE_1-run-scene"), &["scenes/block-and-balloon"]);
}

#[test]
fn a_step_loop_reads_displacements_and_reactions() {
    runs(env!("CARGO_BIN_EXE_2-step-loop"), &[]);
}

#[test]
fn a_body_is_made_of_arrays() {
    runs(env!("CARGO_BIN_EXE_3-body-from-arrays"), &[]);
}

#[test]
fn shells_are_solved() {
    runs(env!("CARGO_BIN_EXE_4-shells"), &[]);
}

#[test]
fn a_law_of_ones_own_is_computed() {
    runs(env!("CARGO_BIN_EXE_5-own-law"), &[]);
}

#[test]
fn a_haptic_device_feels_a_wall() {
    runs(env!("CARGO_BIN_EXE_7-haptic-client"), &[]);
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
    runs("python3", &["examples/7_haptic_client.py", &address, "0,0,0", "0.3"]);
    let report = haptics.finish().unwrap();
    assert!(report.counts.used > 0 && report.counts.malformed == 0, "{report}");
}
