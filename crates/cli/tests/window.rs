//! The window on a screen that nobody sees (Xvfb): it opens, draws, pulls, and closes. Without Xvfb or anything that draws the
//! tests are skipped with a notice; with `PLIANT_REQUIRE_GPU=1` they fail.
#![cfg(all(feature = "viewer", target_os = "linux"))]

mod support;

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

use support::{BLOCK, Told, Workshop, changed, has_graphics_processor};

/// A screen; it goes when this does.
struct Screen {
    server: Child,
    display: String,
}

impl Screen {
    fn start() -> Option<Self> {
        let mut command = Command::new("Xvfb");
        command.args(["-displayfd", "1", "-screen", "0", "1280x800x24", "-nolisten", "tcp"]);
        let started = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn();
        let Ok(mut server) = started else {
            assert!(std::env::var("PLIANT_REQUIRE_GPU").as_deref() != Ok("1"), "there is no Xvfb");
            eprintln!("skipped: there is no Xvfb");
            return None;
        };
        let mut number = String::new();
        BufReader::new(server.stdout.take()?).read_line(&mut number).ok()?;
        Some(Self { server, display: format!(":{}", number.trim()) })
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        // It may have gone by itself.
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

fn view(workshop: &Workshop, screen: &Screen, more: &[&str]) -> Told {
    let mut command = workshop.command(&[&["view", "case"], more].concat());
    command.env("DISPLAY", &screen.display).env_remove("WAYLAND_DISPLAY");
    command.output().expect("the binary starts").into()
}

#[test]
fn the_window_opens_draws_pulls_and_what_it_did_is_repeated_bit_by_bit() {
    if !has_graphics_processor() {
        return;
    }
    let Some(screen) = Screen::start() else { return };
    let workshop = Workshop::new(&changed(BLOCK, "until = 0.02", "until = 20"));
    let told = view(&workshop, &screen, &["--test-frames", "10", "--record", "drag"]);
    assert_eq!(told.code, 0, "{}", told.err);
    assert!(told.out.contains("10 frames drawn") && told.out.contains("the hand pulls with"), "{}", told.out);
    assert!(told.out.contains("input lag"), "{}", told.out);
    let repeat = || workshop.pliant(&["view", "case", "--replay", "drag"]);
    let (once, twice) = (repeat(), repeat());
    assert_eq!(once.code, 0, "{}", once.err);
    assert_eq!(once.json(), twice.json());
    assert!(once.json()["largest_force"].as_f64().unwrap() > 0.0, "{}", once.out);
}

#[test]
fn without_a_screen_it_says_what_it_needs() {
    let workshop = Workshop::new(BLOCK);
    let mut command = workshop.command(&["view", "case", "--test-frames", "1"]);
    let told: Told = command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").output().unwrap().into();
    assert_eq!(told.code, 2, "{}", told.err);
    assert!(
        told.err.contains("no window can be opened") && told.err.contains("pliant render"),
        "{}",
        told.err
    );
    workshop.write("drag", "no recording");
    let told = workshop.pliant(&["view", "case", "--replay", "drag"]);
    assert_eq!(told.code, 2);
    assert!(told.err.contains("is no recording"), "{}", told.err);
}
