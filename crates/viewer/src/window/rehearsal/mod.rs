//! Tests of the window without a screen. They send mouse and key actions as events of egui, and look at the
//! effect. The window's own code runs, and the solver on its thread. By egui's clock a frame takes a sixtieth
//! of a second, however long it really takes. Pictures are drawn only if a test looks at them. Without a GPU
//! the tests are skipped with a notice. With `PLIANT_REQUIRE_GPU=1` they fail.

mod following;
mod looking;
mod pulling;
mod screen;
mod seen;
mod tools;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::sleep;
use std::time::{Duration, Instant};

use eframe::egui::{Event, Key, Modifiers, PointerButton, Pos2, Rect, vec2};
use eframe::{App as _, CreationContext, egui};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use pliant_picture::Look;
use pliant_sim::gpu::Device;
use pliant_testing::{found_or_skipped, scenes};
use tempfile::TempDir;

use self::screen::Screen;
use super::{App, Opening, Outcome};
use crate::recording::Recording;

/// A ball that is fixed at one end and damped, so that it comes to rest when pulled.
const BALL: &str = include_str!("../../../tests/support/ball.toml");
/// Width and height of the window.
const SIZE: [u32; 2] = [800, 600];
/// Wall time from frame to frame while something has to come, and in which it does on a machine that does
/// much else.
const FRAME: Duration = Duration::from_millis(16);
const PATIENCE: Duration = Duration::from_secs(180);
/// The buttons of the mouse.
const LEFT: PointerButton = PointerButton::Primary;
const RIGHT: PointerButton = PointerButton::Secondary;

/// The ball on a GPU.
fn on_device() -> String {
    BALL.replace("threads = 1", "threads = 1\ndevice = 'gpu'")
}

/// A window, its mouse and its keys.
struct Rehearsal {
    harness: Harness<'static, Option<App>>,
    screen: Screen,
    /// True if frames are drawn.
    painted: bool,
    /// Keys such as Ctrl that are held down.
    held: Modifiers,
    /// Folder that the window writes to.
    folder: TempDir,
}

impl Rehearsal {
    /// The window of a scene that plays, if there is anything that draws.
    fn open(scene: &str) -> Option<Self> {
        let device = found_or_skipped(Device::open(None))?;
        let world = scenes::world(scene).unwrap();
        // As the window: on the device of the scene, if it has one.
        let screen = Screen::new(world.device().unwrap_or(&device), SIZE);
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("other.toml"), "").unwrap();
        let mut opening = Some(Opening {
            world,
            look: |_| Look::default(),
            // There is no such file: it is neither watched nor remembered.
            file: folder.path().join("ball.toml"),
            read: Arc::new(|path: &Path| Err(format!("{} is not read here", path.display()))),
            record: Some(folder.path().join("drag")),
            stop: Default::default(),
            portrait: None,
            size: SIZE,
            began: Instant::now(),
        });
        let state = screen.state.clone();
        let mut frame = eframe::Frame::_new_kittest();
        frame.wgpu_render_state = Some(state.clone());
        let ui = move |ui: &mut egui::Ui, app: &mut Option<App>| {
            let app = app.get_or_insert_with(|| {
                let mut context = CreationContext::_new_kittest(ui.ctx().clone());
                context.wgpu_render_state = Some(state.clone());
                App::new(&context, opening.take().unwrap(), Outcome::default()).unwrap()
            });
            app.ui(ui, &mut frame);
        };
        let harness = Harness::builder()
            .with_size(SIZE.map(|side| side as f32))
            .with_step_dt(1.0 / 60.0)
            // Lists have no names of their own, and eframe is built without readers of the screen.
            .with_accessibility_check(false)
            .renderer(screen.textures())
            .build_ui_state(ui, None);
        let mut window = Self { harness, screen, painted: false, held: Modifiers::NONE, folder };
        window.wait("it plays", |app| app.frame.playing && !app.frame.points.is_empty());
        window.settle();
        Some(window)
    }

    /// Opens a scene that is paused at rest at the start.
    fn paused(scene: &str) -> Option<Self> {
        let mut window = Self::open(scene)?;
        window.key("Space pauses", Key::Space, |app| !app.frame.playing);
        window.key("R starts anew", Key::R, |app| app.frame.steps == 0);
        window.settle();
        Some(window)
    }

    /// Opens a paused scene; frames are drawn from then on.
    fn painted(scene: &str) -> Option<Self> {
        let mut window = Self::paused(scene)?;
        window.painted = true;
        // Earlier changes were not drawn.
        let port = &mut window.app_mut().port;
        let (points, values) = (port.points.clone(), port.values.clone());
        port.set(&points, &values);
        Some(window)
    }

    fn app(&self) -> &App {
        self.harness.state().as_ref().unwrap()
    }

    fn app_mut(&mut self) -> &mut App {
        self.harness.state_mut().as_mut().unwrap()
    }

    /// The path of a file beside the scene.
    fn beside(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// A frame of the window with these events.
    fn frame(&mut self, events: impl IntoIterator<Item = Event>) {
        self.harness.input_mut().events.extend(events);
        self.harness.step();
        if self.painted {
            self.screen.paint(&self.harness.ctx, self.harness.output());
        }
    }

    /// Draws frames until a check holds.
    #[track_caller]
    fn wait(&mut self, what: &str, mut check: impl FnMut(&App) -> bool) {
        let began = Instant::now();
        while !check(self.app()) {
            assert!(began.elapsed() < PATIENCE, "waited in vain: {what}");
            sleep(FRAME);
            self.frame([]);
        }
    }

    /// Waits for the plots, above which the picture lies.
    #[track_caller]
    fn settle(&mut self) {
        let (mut rect, mut same) = (Rect::ZERO, 0);
        self.wait("the picture has its place", |app| {
            let is_same =
                !app.samples.is_empty() && std::mem::replace(&mut rect, app.port.rect) == app.port.rect;
            same = if is_same { same + 1 } else { 0 };
            same >= 3
        });
    }

    /// Sends the events of a frame, and waits for their effect.
    #[track_caller]
    fn give(&mut self, what: &str, events: impl IntoIterator<Item = Event>, check: impl FnMut(&App) -> bool) {
        self.frame(events);
        self.wait(what, check);
    }

    /// Presses and releases a key, and waits for the effect.
    #[track_caller]
    fn key(&mut self, what: &str, key: Key, check: impl FnMut(&App) -> bool) {
        let events = [true, false].map(|pressed| self.press(key, pressed));
        self.give(what, events, check);
    }

    /// Returns the event of a key that goes down or up.
    fn press(&self, key: Key, pressed: bool) -> Event {
        Event::Key { key, physical_key: None, pressed, repeat: false, modifiers: self.held }
    }

    /// Keys such as Ctrl are held down from now on, or none.
    fn hold(&mut self, modifiers: Modifiers) {
        self.held = modifiers;
        self.frame([Event::ModifiersChanged(modifiers)]);
    }

    /// Returns the event of a mouse button that goes down or up.
    fn button(&self, pos: Pos2, button: PointerButton, pressed: bool) -> Event {
        Event::PointerButton { pos, button, pressed, modifiers: self.held }
    }

    /// Moves the mouse to a place, and presses its left button.
    fn take(&mut self, place: Pos2) {
        let pressed = self.button(place, LEFT, true);
        self.frame([Event::PointerMoved(place), pressed]);
    }

    /// Releases the left button at the current place of the mouse, and waits for the effect.
    #[track_caller]
    fn release(&mut self, what: &str, check: impl FnMut(&App) -> bool) {
        let place = self.harness.ctx.pointer_latest_pos().unwrap_or_default();
        let released = self.button(place, LEFT, false);
        self.give(what, [released], check);
    }

    /// Clicks on a place, and waits for the effect.
    #[track_caller]
    fn click(&mut self, what: &str, place: Pos2, check: impl FnMut(&App) -> bool) {
        self.take(place);
        self.release(what, check);
    }

    /// Takes hold of a place with the mouse, drags it to the right, and waits for the effect.
    #[track_caller]
    fn drag(&mut self, what: &str, place: Pos2, check: impl FnMut(&App) -> bool) {
        self.take(place);
        self.give(what, [Event::PointerMoved(place + vec2(14.0, 0.0))], check);
    }

    /// A click on a button of the window, found by its text.
    #[track_caller]
    fn click_on(&mut self, text: &str) {
        let place = self.harness.get_by_label(text).rect().center();
        self.take(place);
        self.release(text, |_| true);
    }

    /// Closes the window, and returns its recording.
    fn close(self) -> Recording {
        let Self { harness, folder, .. } = self;
        let mut app = harness.into_state().unwrap();
        app.on_exit();
        Recording::from_bytes(&std::fs::read(folder.path().join("drag")).unwrap()).unwrap()
    }
}
