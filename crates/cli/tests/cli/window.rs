//! The window on a screen that nobody sees (Xvfb): it opens, draws, pulls, and closes. Without Xvfb or
//! anything that draws the tests are skipped with a notice; with `PLIANT_REQUIRE_GPU=1` they fail.

use std::io::{BufRead, BufReader, IoSlice};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use pliant_testing::found_or_skipped;
use pliant_testing::scenes::world;
use pliant_viewer::{Break, Done, Hand, Move, Recording};

use x11rb::connection::{Connection as _, RequestConnection as _};
use x11rb::protocol::xproto::{
    BUTTON_PRESS_EVENT, BUTTON_RELEASE_EVENT, ClientMessageEvent, ConnectionExt as _, EventMask, InputFocus,
    KEY_PRESS_EVENT, KEY_RELEASE_EVENT, MOTION_NOTIFY_EVENT, Setup,
};
use x11rb::rust_connection::RustConnection;

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
/// In such a window, while it plays: the button that copies the view, and a place on the ball.
const COPY_VIEW: [i16; 2] = [93, 35];
const MIDDLE: [i16; 2] = [270, 240];

fn view(workshop: &Workshop, screen: &Screen, more: &[&str]) -> Said {
    let mut command = workshop.command(&[&["view", "case"], more].concat());
    command.env("DISPLAY", &screen.display).env_remove("WAYLAND_DISPLAY");
    command.output().expect("the binary starts").into()
}

/// A ball that is fixed at one end and damped, so that it comes to rest when pulled.
const BALL: &str = include_str!("../../../viewer/tests/support/ball.toml");

/// The mouse and the keys of a screen, by its extension XTEST.
struct Input {
    connection: RustConnection,
    root: u32,
    window: u32,
    /// First byte of the extension's requests.
    opcode: u8,
}

impl Input {
    /// Opens the input of a screen whose one window is shown by now.
    fn new(screen: &Screen) -> Self {
        let (connection, number) = x11rb::connect(Some(&screen.display)).unwrap();
        let root = connection.setup().roots[number].root;
        let opcode = connection.extension_information("XTEST").unwrap().expect("Xvfb has it").major_opcode;
        let size = |window: &u32| {
            let size = connection.get_geometry(*window).unwrap().reply().unwrap();
            u32::from(size.width) * u32::from(size.height)
        };
        let windows = connection.query_tree(root).unwrap().reply().unwrap().children;
        let window = windows.into_iter().max_by_key(size).unwrap();
        // Nobody else gives it the keys where no window manager runs.
        connection.set_input_focus(InputFocus::PARENT, window, x11rb::CURRENT_TIME).unwrap().check().unwrap();
        Self { connection, root, window, opcode }
    }

    /// An atom by its name.
    fn atom(&self, name: &str) -> u32 {
        self.connection.intern_atom(false, name.as_bytes()).unwrap().reply().unwrap().atom
    }

    /// An event of a device: its kind, the key or button, and the place of the mouse. The request is
    /// `FakeInput` of XTEST.
    fn give(&self, kind: u8, detail: u8, [x, y]: [i16; 2]) {
        let mut request = [0; 36];
        request[..6].copy_from_slice(&[self.opcode, 2, 0, 0, kind, detail]);
        request[2..4].copy_from_slice(&9_u16.to_ne_bytes());
        request[12..16].copy_from_slice(&self.root.to_ne_bytes());
        request[24..26].copy_from_slice(&x.to_ne_bytes());
        request[26..28].copy_from_slice(&y.to_ne_bytes());
        self.connection.send_request_without_reply(&[IoSlice::new(&request)], Vec::new()).unwrap();
        self.connection.flush().unwrap();
    }

    fn go(&self, place: [i16; 2]) {
        self.give(MOTION_NOTIFY_EVENT, 0, place);
    }

    /// Rests at a place until a frame has found what lies under the mouse: a press before that would miss it.
    fn rest(&self, place: [i16; 2]) {
        self.go(place);
        std::thread::sleep(Duration::from_millis(500));
    }

    /// The left button goes down, or up.
    fn button(&self, pressed: bool) {
        self.give(if pressed { BUTTON_PRESS_EVENT } else { BUTTON_RELEASE_EVENT }, 1, [0; 2]);
    }

    /// A key with this letter goes down, and up.
    fn key(&self, letter: char) {
        let Setup { min_keycode: first, max_keycode: last, .. } = *self.connection.setup();
        let map = self.connection.get_keyboard_mapping(first, last - first + 1).unwrap().reply().unwrap();
        let mut keys = (first..=last).zip(map.keysyms.chunks(map.keysyms_per_keycode.into()));
        let (key, _) = keys.find(|(_, symbols)| symbols.contains(&letter.into())).expect("the key is there");
        self.give(KEY_PRESS_EVENT, key, [0; 2]);
        self.give(KEY_RELEASE_EVENT, key, [0; 2]);
    }

    /// Asks the window to close, as its frame does.
    fn close(&self) {
        let what = [self.atom("WM_DELETE_WINDOW"), 0, 0, 0, 0];
        let event = ClientMessageEvent::new(32, self.window, self.atom("WM_PROTOCOLS"), what);
        self.connection.send_event(false, self.window, EventMask::NO_EVENT, event).unwrap().check().unwrap();
    }
}

/// Waits for something that happens in a window on a machine that does much else.
#[track_caller]
fn until(what: &str, window: &mut Child, mut happens: impl FnMut() -> bool) {
    let began = Instant::now();
    while !happens() {
        assert!(window.try_wait().unwrap().is_none(), "it closed by itself before: {what}");
        assert!(began.elapsed() < Duration::from_secs(180), "waited in vain: {what}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// With a real mouse and real keys a button copies the view to the clipboard of the screen. V takes a film,
/// and the hand pulls until the window closes. The body's constraints hold against the hand, and a replay
/// comes to the same bits. The other functions are tested without a screen
/// (`crates/viewer/src/window/rehearsal`).
#[test]
fn mouse_and_keys_of_a_screen_lead_the_window() {
    if !has_gpu() {
        return;
    }
    let Some(screen) = Screen::start() else { return };
    let workshop = Workshop::new(BALL);
    let mut command = workshop.command(&[&["view", "case", "--record", "drag"], SMALL].concat());
    command.env("DISPLAY", &screen.display).env_remove("WAYLAND_DISPLAY");
    let mut window = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the binary starts");
    let read = || Recording::from_bytes(&std::fs::read(workshop.path("drag")).ok()?).ok();
    until("it plays", &mut window, || read().is_some_and(|recording| recording.steps > 0));
    let input = Input::new(&screen);

    let clipboard = input.atom("CLIPBOARD");
    let owner = || input.connection.get_selection_owner(clipboard).unwrap().reply().unwrap().owner;
    until("a button copies the view", &mut window, || {
        input.rest(COPY_VIEW);
        input.button(true);
        input.button(false);
        std::thread::sleep(Duration::from_millis(500));
        owner() != x11rb::NONE
    });

    until("V begins a film, and V ends it", &mut window, || {
        input.key('v');
        std::thread::sleep(Duration::from_secs(1));
        workshop.path("case/scene-film.png").exists()
    });

    let [x, y] = MIDDLE;
    input.rest(MIDDLE);
    input.button(true);
    // Slow enough for a body that is simulated slowly.
    for part in 1..=20 {
        std::thread::sleep(Duration::from_millis(75));
        input.go([x, y - 2 * part]);
    }
    // It comes to rest within a second.
    let steps = (1.0 / world(BALL).unwrap().step()) as u64;
    until("the hand pulls and holds", &mut window, || {
        let Some(Recording { moves, steps: now, .. }) = read() else { return false };
        // Each frame pulls again, to where the mouse is.
        let Some(Move { done: last @ Done::Hand(Hand::Pull(_)), .. }) = moves.last() else { return false };
        moves.iter().rev().take_while(|then| then.done == *last).any(|then| now > then.steps + steps)
    });
    input.close();
    assert_eq!(window.wait().unwrap().code(), Some(0));

    // The hand still pulled when it closed: the base holds with the same force, and a replay comes to the
    // same bits.
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

/// A recording that cannot be written is refused before the window opens. After a signal the recording is
/// whole; if the window is killed, only the last second is missing.
#[test]
fn recordings_outlive_signals() {
    let workshop = Workshop::new(BALL);
    for (path, why) in [("nowhere/drag", "No such file"), ("case", "it is a folder")] {
        let output = workshop.pliant(&["view", "case", "--record", path]);
        assert_eq!(output.code, 2, "{}", output.err);
        assert!(
            output.err.contains(path) && output.err.contains("cannot be written") && output.err.contains(why),
            "{}",
            output.err
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

#[test]
fn the_window_is_on_the_device_of_a_scene_that_runs_on_one() {
    if !has_gpu() {
        return;
    }
    let Some(screen) = Screen::start() else { return };
    let workshop = Workshop::new(&changed(BALL, "threads = 1", "threads = 1\ndevice = 'gpu'"));
    let output =
        view(&workshop, &screen, &[SMALL, &["--screenshot", "window.png", "--after", "0.1"]].concat());
    assert_eq!(output.code, 0, "{}", output.err);
    assert!(output.out.starts_with("A ball at t = "), "{}", output.out);
    let picture = std::fs::read(workshop.path("window.png")).unwrap();
    assert!(picture.starts_with(b"\x89PNG") && picture.len() > 20_000, "{} bytes", picture.len());
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
    let output: Said = window.wait_with_output().unwrap().into();
    assert_eq!(output.code, 0, "{}", output.err);
    assert!(output.out.starts_with("A ball at t = "), "{}", output.out);
    assert!(std::fs::read(workshop.path("window.png")).unwrap().starts_with(b"\x89PNG"));

    // Simulated time restarts with the reloaded scene.
    let window = start("8");
    std::thread::sleep(Duration::from_secs(5));
    workshop.write("case/scene.toml", changed(BALL, "A ball", "Another ball"));
    let output: Said = window.wait_with_output().unwrap().into();
    assert_eq!(output.code, 0, "{}", output.err);
    assert!(output.out.starts_with("Another ball at t = "), "{}", output.out);
    assert!(output.out.contains("the scene was read anew"), "{}", output.out);

    let output = view(&workshop, &screen, &["--screenshot", "nowhere/window.png", "--after", "0"]);
    assert_eq!(output.code, 2, "{}", output.err);
    assert!(output.err.contains("nowhere/window.png"), "{}", output.err);
}

#[test]
fn a_finished_run_is_looked_at_over_its_timeline() {
    if !has_gpu() {
        return;
    }
    let Some(screen) = Screen::start() else { return };
    let fields = "[output.fields]\ntype = 'vtu'\nevery = 0.05\ndata = ['displacement', 'von-mises']\n";
    let workshop = Workshop::new(&format!("{BALL}{fields}"));
    let output = workshop.pliant(&["run", "case", "--until", "0.2", "--out", "out"]);
    assert_eq!(output.code, 0, "{}", output.err);
    let open = |what: &str, more: &[&str]| -> Said {
        let mut command = workshop.command(&[&["view", what], more].concat());
        command.env("DISPLAY", &screen.display).env_remove("WAYLAND_DISPLAY");
        command.output().expect("the binary starts").into()
    };
    let mut pictures = Vec::new();
    for (what, after) in [("out", "0"), ("out/fields.pvd", "0.16")] {
        let output = open(what, &["--screenshot", "run.png", "--after", after]);
        assert_eq!(output.code, 0, "{}", output.err);
        assert!(output.out.starts_with("out at t = 0."), "{}", output.out);
        pictures.push(std::fs::read(workshop.path("run.png")).unwrap());
    }
    assert!(pictures.iter().all(|picture| picture.starts_with(b"\x89PNG")) && pictures[0] != pictures[1]);
    let output = open("out", &["--record", "drag"]);
    assert_eq!(output.code, 2, "{}", output.err);
    assert!(output.err.contains("`out` is a finished run, and `--record` is for scenes"), "{}", output.err);
    let output = open("out/none.pvd", &[]);
    assert_eq!(output.code, 2, "{}", output.err);
    assert!(output.err.contains("has no series `none`; it has `fields`"), "{}", output.err);
}

#[test]
fn without_a_screen_it_says_what_it_needs() {
    let workshop = Workshop::new(BLOCK);
    let mut command = workshop.command(&["view", "case"]);
    let output: Said = command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").output().unwrap().into();
    assert_eq!(output.code, 2, "{}", output.err);
    assert!(
        output.err.contains("no window can be opened") && output.err.contains("pliant render"),
        "{}",
        output.err
    );
    workshop.write("drag", "no recording");
    let output = workshop.pliant(&["view", "case", "--replay", "drag"]);
    assert_eq!(output.code, 2);
    assert!(output.err.contains("is not a recording"), "{}", output.err);
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
    let output = workshop.pliant(&["view", "case", "--replay", "drag"]);
    assert_eq!(output.code, 1);
    assert!(output.err.contains("the recording is of another scene"), "{}", output.err);
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
    let output = workshop.pliant(&["view", "case", "--replay", "drag"]);
    assert_eq!(output.code, 1);
    let expected = "error: at t = 0.5000 s a pull broke the run, which then went back to t = 0.2500 s: element 3 of `block` is inverted";
    assert!(output.err.contains(expected), "{}", output.err);
    assert_eq!(output.json()["breaks"][0]["times"][1], 0.25);
}
