//! The window on a screen that nobody sees (Xvfb): it opens, draws, pulls, and closes. Without Xvfb or anything that draws the
//! tests are skipped with a notice; with `PLIANT_REQUIRE_GPU=1` they fail.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use pliant_testing::found_or_skipped;
use pliant_testing::scenes::world;
use pliant_viewer::{Break, Recording};

use x11rb::protocol::xproto::ConnectionExt as _;

use crate::support::{BLOCK, Said, Workshop, changed, has_gpu};

/// A screen, closed on drop.
struct Screen {
    server: Child,
    display: String,
    /// One window at a time: two that are drawn by the CPU leave the hand too few frames.
    _alone: MutexGuard<'static, ()>,
}

static ALONE: Mutex<()> = Mutex::new(());

impl Screen {
    fn start() -> Option<Self> {
        // A test that failed holds it no more.
        let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
        let mut command = Command::new("Xvfb");
        command.args(["-displayfd", "1", "-screen", "0", "1280x800x24", "-nolisten", "tcp"]);
        let started = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn();
        let mut server = found_or_skipped(started.map_err(|_| "there is no Xvfb"))?;
        let mut number = String::new();
        BufReader::new(server.stdout.take()?).read_line(&mut number).ok()?;
        Some(Self { server, display: format!(":{}", number.trim()), _alone })
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        // It may have gone by itself.
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// A window whose pixels take a software adapter little time.
const SMALL: &[&str] = &["--size", "800x600"];

fn view(workshop: &Workshop, screen: &Screen, more: &[&str]) -> Said {
    let mut command = workshop.command(&[&["view", "case"], more].concat());
    command.env("DISPLAY", &screen.display).env_remove("WAYLAND_DISPLAY");
    command.output().expect("the binary starts").into()
}

/// A ball that is fixed at one end and damped, so that it comes to rest when pulled.
const BALL: &str = include_str!("../../../viewer/tests/support/ball.toml");

#[test]
fn the_window_draws_picks_pins_and_pulls_and_what_holds_the_body_holds_against_the_hand() {
    if !has_gpu() {
        return;
    }
    let Some(screen) = Screen::start() else { return };
    let workshop = Workshop::new(BALL);
    let told = view(
        &workshop,
        &screen,
        &[SMALL, &["--rehearse", "--record", "drag", "--screenshot", "window.png"]].concat(),
    );
    assert_eq!(told.code, 0, "{}", told.err);
    assert!(told.out.contains("10 frames drawn, 100 pixels picked"), "{}", told.out);
    let picture = std::fs::read(workshop.path("window.png")).unwrap();
    assert!(picture.starts_with(b"\x89PNG") && picture.len() > 20_000, "{} bytes", picture.len());

    // The hand still pulled when it closed: the base holds with the same force, and a replay comes to the same bits.
    let replay = || workshop.pliant(&["view", "case", "--replay", "drag"]);
    let (once, twice) = (replay(), replay());
    assert_eq!(once.code, 0, "{}", once.err);
    let (once, twice) = (once.json(), twice.json());
    assert_eq!(once, twice);
    let vector = |value: &serde_json::Value| -> Vec<f64> {
        value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
    };
    let (hand, base) = (vector(&once["held"][1]), vector(&once["reactions"][0]));
    let size = hand.iter().map(|f| f * f).sum::<f64>().sqrt();
    assert!(size > 0.01, "{once}");
    for (hand, base) in hand.iter().zip(base) {
        assert!((hand + base).abs() < 1e-3 * size, "{once}");
    }
}

/// Copies go to the clipboard of the screen, and not only to the window.
#[test]
fn a_view_is_copied_to_the_clipboard() {
    if !has_gpu() {
        return;
    }
    let Some(screen) = Screen::start() else { return };
    let workshop = Workshop::new(BALL);
    let (connection, _) = x11rb::connect(Some(&screen.display)).unwrap();
    let clipboard = connection.intern_atom(false, b"CLIPBOARD").unwrap().reply().unwrap().atom;
    let owner = || connection.get_selection_owner(clipboard).unwrap().reply().unwrap().owner;
    let mut command = workshop.command(&[&["view", "case", "--rehearse"][..], SMALL].concat());
    command.env("DISPLAY", &screen.display).env_remove("WAYLAND_DISPLAY");
    let mut window = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the binary starts");
    while owner() == x11rb::NONE {
        assert!(window.try_wait().unwrap().is_none(), "it copied nothing");
        std::thread::sleep(Duration::from_millis(20));
    }
    window.kill().unwrap();
    window.wait().unwrap();
}

/// A recording that cannot be written is refused before the window opens; one is whole after a signal, and has all but the last second
/// where the window is killed.
#[test]
fn recordings_outlive_signals() {
    let workshop = Workshop::new(BALL);
    for (path, why) in [("nowhere/drag", "No such file"), ("case", "it is a folder")] {
        let told = workshop.pliant(&["view", "case", "--record", path]);
        assert_eq!(told.code, 2, "{}", told.err);
        assert!(
            told.err.contains(path) && told.err.contains("cannot be written") && told.err.contains(why),
            "{}",
            told.err
        );
    }
    if !has_gpu() {
        return;
    }
    let Some(screen) = Screen::start() else { return };
    for signal in ["-TERM", "-KILL"] {
        let mut command = workshop.command(&["view", "case", "--record", "drag"]);
        command.env("DISPLAY", &screen.display).env_remove("WAYLAND_DISPLAY");
        let mut window =
            command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the binary starts");
        let read = || Recording::from_bytes(&std::fs::read(workshop.path("drag")).ok()?).ok();
        while read().is_none() {
            assert!(window.try_wait().unwrap().is_none(), "it closed by itself");
            std::thread::sleep(Duration::from_millis(20));
        }
        let before = read().unwrap();
        let pid = window.id().to_string();
        assert!(Command::new("kill").args([signal, &pid]).status().unwrap().success());
        let ended = window.wait().unwrap();
        let after = read().unwrap();
        assert!(before.steps > 0 && after.steps >= before.steps);
        if signal == "-TERM" {
            assert_eq!(ended.code(), Some(143));
        }
        std::fs::remove_file(workshop.path("drag")).unwrap();
    }
}

/// Keys take the grasper, move it, turn it, and close its jaws.
#[test]
fn tools_are_led_by_keys() {
    if !has_gpu() {
        return;
    }
    let Some(screen) = Screen::start() else { return };
    let workshop = Workshop::new(include_str!("../../../viewer/tests/support/grasped.toml"));
    let told = view(&workshop, &screen, &["--rehearse"]);
    assert_eq!(told.code, 0, "{}", told.err);
    assert!(told.out.contains("tools led by keys"), "{}", told.out);
}

#[test]
fn the_window_is_on_the_device_of_a_scene_that_runs_on_one() {
    if !has_gpu() {
        return;
    }
    let Some(screen) = Screen::start() else { return };
    let workshop = Workshop::new(&changed(BALL, "threads = 1", "threads = 1\ndevice = 'gpu'"));
    let told = view(
        &workshop,
        &screen,
        &[SMALL, &["--rehearse", "--record", "drag", "--screenshot", "window.png"]].concat(),
    );
    assert_eq!(told.code, 0, "{}", told.err);
    assert!(told.out.contains("10 frames drawn, 100 pixels picked"), "{}", told.out);
    let replay = workshop.pliant(&["view", "case", "--replay", "drag"]);
    assert_eq!(replay.code, 0, "{}", replay.err);
    assert!(replay.json()["largest_force"].as_f64().unwrap() > 0.01, "{}", replay.out);
}

#[test]
fn the_window_takes_a_picture_of_itself_and_reads_a_scene_that_changed_while_it_is_open() {
    if !has_gpu() {
        return;
    }
    let Some(screen) = Screen::start() else { return };
    let workshop = Workshop::new(BALL);
    let start = |after: &str| {
        let mut command = workshop.command(&["view", "case", "--screenshot", "window.png", "--after", after]);
        command.env("DISPLAY", &screen.display).env_remove("WAYLAND_DISPLAY");
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the binary starts")
    };
    let window = start("0.1");
    let told: Said = window.wait_with_output().unwrap().into();
    assert_eq!(told.code, 0, "{}", told.err);
    assert!(told.out.starts_with("A ball at t = "), "{}", told.out);
    assert!(std::fs::read(workshop.path("window.png")).unwrap().starts_with(b"\x89PNG"));

    // Simulated time restarts with the reloaded scene.
    let window = start("8");
    std::thread::sleep(Duration::from_secs(5));
    workshop.write("case/scene.toml", changed(BALL, "A ball", "Another ball"));
    let told: Said = window.wait_with_output().unwrap().into();
    assert_eq!(told.code, 0, "{}", told.err);
    assert!(told.out.starts_with("Another ball at t = "), "{}", told.out);
    assert!(told.out.contains("the scene was read anew"), "{}", told.out);

    let told = view(&workshop, &screen, &["--screenshot", "nowhere/window.png", "--after", "0"]);
    assert_eq!(told.code, 2, "{}", told.err);
    assert!(told.err.contains("nowhere/window.png"), "{}", told.err);
}

#[test]
fn a_finished_run_is_looked_at_over_its_timeline() {
    if !has_gpu() {
        return;
    }
    let Some(screen) = Screen::start() else { return };
    let fields = "[output.fields]\ntype = 'vtu'\nevery = 0.05\ndata = ['displacement', 'von-mises']\n";
    let workshop = Workshop::new(&format!("{BALL}{fields}"));
    let told = workshop.pliant(&["run", "case", "--until", "0.2", "--out", "out"]);
    assert_eq!(told.code, 0, "{}", told.err);
    let open = |what: &str, more: &[&str]| -> Said {
        let mut command = workshop.command(&[&["view", what], more].concat());
        command.env("DISPLAY", &screen.display).env_remove("WAYLAND_DISPLAY");
        command.output().expect("the binary starts").into()
    };
    let mut pictures = Vec::new();
    for (what, after) in [("out", "0"), ("out/fields.pvd", "0.16")] {
        let told = open(what, &["--screenshot", "run.png", "--after", after]);
        assert_eq!(told.code, 0, "{}", told.err);
        assert!(told.out.starts_with("out at t = 0."), "{}", told.out);
        pictures.push(std::fs::read(workshop.path("run.png")).unwrap());
    }
    assert!(pictures.iter().all(|picture| picture.starts_with(b"\x89PNG")) && pictures[0] != pictures[1]);
    let told = open("out", &["--record", "drag"]);
    assert_eq!(told.code, 2, "{}", told.err);
    assert!(told.err.contains("`out` is a finished run, and `--record` is for scenes"), "{}", told.err);
    let told = open("out/none.pvd", &[]);
    assert_eq!(told.code, 2, "{}", told.err);
    assert!(told.err.contains("has no series `none`; it has `fields`"), "{}", told.err);
}

#[test]
fn without_a_screen_it_says_what_it_needs() {
    let workshop = Workshop::new(BLOCK);
    let mut command = workshop.command(&[&["view", "case", "--rehearse"][..], SMALL].concat());
    let told: Said = command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").output().unwrap().into();
    assert_eq!(told.code, 2, "{}", told.err);
    assert!(
        told.err.contains("no window can be opened") && told.err.contains("pliant render"),
        "{}",
        told.err
    );
    workshop.write("drag", "no recording");
    let told = workshop.pliant(&["view", "case", "--replay", "drag"]);
    assert_eq!(told.code, 2);
    assert!(told.err.contains("is not a recording"), "{}", told.err);
}

/// The bodies of a scene, as its recordings name them.
fn of(scene: &str) -> u64 {
    world(scene).unwrap().simulated().fingerprint_of_bodies()
}

/// A recording refers to bodies by name and to triangles by number: of another scene it is refused.
#[test]
fn a_recording_of_another_scene_is_refused() {
    let workshop =
        Workshop::new(&BLOCK.replace("[body.block]", "[body.brick]").replace("\"block\"", "\"brick\""));
    let recording = Recording { steps: 3, of: of(BLOCK), ..Recording::default() };
    std::fs::write(workshop.path("drag"), recording.to_bytes().unwrap()).unwrap();
    let told = workshop.pliant(&["view", "case", "--replay", "drag"]);
    assert_eq!(told.code, 1);
    assert!(told.err.contains("the recording is of another scene"), "{}", told.err);
}

/// Ctrl-C ends a replay, which may be as long as its file says.
#[test]
#[cfg(unix)]
fn a_replay_is_stopped() {
    let workshop = Workshop::new(BLOCK);
    let recording = Recording { steps: 1 << 40, of: of(BLOCK), ..Recording::default() };
    std::fs::write(workshop.path("drag"), recording.to_bytes().unwrap()).unwrap();
    let mut replay = workshop.command(&["view", "case", "--replay", "drag"]);
    let mut replay = replay.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    std::thread::sleep(Duration::from_secs(1));
    let asked = Command::new("kill").args(["-INT", &replay.id().to_string()]).status().unwrap();
    assert!(asked.success());
    assert_eq!(replay.wait().unwrap().code(), Some(130));
}

/// A replay reports the pulls that broke the run when it was recorded.
#[test]
fn a_replay_tells_breaks() {
    let workshop = Workshop::new(BLOCK);
    let broken = Break { times: [0.5, 0.25], message: "element 3 of `block` is inverted".into() };
    let recording = Recording { steps: 3, breaks: vec![broken], of: of(BLOCK), ..Recording::default() };
    std::fs::write(workshop.path("drag"), recording.to_bytes().unwrap()).unwrap();
    let told = workshop.pliant(&["view", "case", "--replay", "drag"]);
    assert_eq!(told.code, 1);
    let expected = "error: at t = 0.5000 s a pull broke the run, which then went back to t = 0.2500 s: element 3 of `block` is inverted";
    assert!(told.err.contains(expected), "{}", told.err);
    assert_eq!(told.json()["breaks"][0]["times"][1], 0.25);
}
