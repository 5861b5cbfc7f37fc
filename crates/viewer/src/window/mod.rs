//! The window itself: drawing and input. The simulation lies behind [`Session`].

mod bodies;
mod device;
mod filming;
mod finished;
mod followed;
mod hands;
mod keep;
mod led;
mod opening;
mod paint;
mod panels;
mod parameters;
mod picture;
mod plots;
mod portrait;
#[cfg(test)]
mod rehearsal;
mod told;
mod undo;
mod viewport;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use eframe::egui::{self, Key};
use eframe::egui_wgpu::WgpuConfiguration;
use pliant_format::Scene;
use pliant_format::tables::{FieldName, ViewTable};
use pliant_geometry::{RegionNames, Vector3};
use pliant_mechanics::StopFlag;
use pliant_picture::Look;
use pliant_scene::World;
use pliant_sim::gpu::Device;

use self::filming::Filming;
pub use self::finished::{FinishedRun, open_finished};
use self::keep::Taking;
use self::opening::{Browser, remember};
use self::paint::SAMPLES;
use self::parameters::Numbers;
use self::portrait::Portrait;
use self::told::Told;
use self::undo::Act;
use self::viewport::Viewport;
use crate::hand::Which;
use crate::samples::Samples;
use crate::session::{Frame, Order, Session};

/// Reads a scene, or returns an error message.
pub type Read = Arc<dyn Fn(&Path) -> Result<World, String> + Send + Sync>;

/// Settings of a new window.
pub struct Opening {
    /// The scene.
    pub world: World,
    /// Returns the camera and the style that a scene wants.
    pub look: fn(&Scene) -> Look,
    /// The file of the scene, watched for changes.
    pub file: PathBuf,
    /// Reads a scene, at the start of another one or after a change.
    pub read: Read,
    /// File for the recording of the hands, written each second and when the window closes.
    pub record: Option<PathBuf>,
    /// Closes the window once it is set.
    pub stop: StopFlag,
    /// Takes a picture of the window after this simulated time [s], and closes.
    pub portrait: Option<(f64, PathBuf)>,
    /// Width and height at its start, in pixels of a screen at 100 %.
    pub size: [u32; 2],
    /// Instant at which the user asked for the window.
    pub began: Instant,
}

/// A window that could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum WindowError {
    /// Neither a screen nor a GPU, or no thread.
    #[error("no window can be opened: {0}")]
    Window(String),
    /// A picture of the window that could not be taken.
    #[error("the window: {0}")]
    Portrait(String),
    /// A finished run that cannot be shown.
    #[error("{message}")]
    Run {
        /// Error in plain words.
        message: String,
        /// Advice for the user.
        remedy: &'static str,
    },
}

impl WindowError {
    /// Returns advice for the user.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Window(_) => {
                "a window needs a screen (X11 or Wayland, with libxkbcommon-x11) and Vulkan, Metal or Direct3D 12 (Debian, \
                 Ubuntu: `apt-get install mesa-vulkan-drivers libvulkan1 libxkbcommon-x11-0`); `pliant render` needs no screen"
            }
            Self::Portrait(_) => "",
            Self::Run { remedy, .. } => remedy,
        }
    }
}

/// Opens the window, and comes back once it is closed.
///
/// # Errors
/// If it can't be opened, or its picture cannot be taken.
pub fn open(opening: Opening) -> Result<Option<String>, WindowError> {
    let (setup, size) = (device::setup(&opening.world), opening.size);
    run_window(setup, size, |context, outcome| App::new(context, opening, outcome))
}

/// Result of a portrait: its description, or an error.
type Outcome = Arc<Mutex<Option<Result<String, String>>>>;

/// Opens a window on a device and runs the app from `make` in it, until the window is closed.
fn run_window<A: eframe::App + 'static>(
    wgpu_options: WgpuConfiguration,
    size: [u32; 2],
    make: impl FnOnce(&eframe::CreationContext<'_>, Outcome) -> Result<A, String>,
) -> Result<Option<String>, WindowError> {
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("Pliant")
            .with_inner_size(size.map(|side| side as f32))
            .with_drag_and_drop(true),
        depth_buffer: 32,
        multisampling: SAMPLES as u16,
        renderer: eframe::Renderer::Wgpu,
        wgpu_options,
        ..Default::default()
    };
    let outcome = Outcome::default();
    let shared = outcome.clone();
    let create = Box::new(move |context: &eframe::CreationContext<'_>| {
        make(context, shared).map(|app| Box::new(app) as Box<dyn eframe::App>).map_err(Into::into)
    });
    eframe::run_native("Pliant", options, create).map_err(|error| WindowError::Window(error.to_string()))?;
    let outcome = outcome.lock().unwrap_or_else(PoisonError::into_inner).take();
    outcome.transpose().map_err(WindowError::Portrait)
}

struct App {
    world: World,
    session: Session,
    frame: Frame,
    port: Viewport,
    /// View of the scene.
    view: ViewTable,
    /// The labels and bodies that this has.
    names: RegionNames,
    /// True if every frame is copied to ordinary memory.
    in_memory: bool,
    /// Device of the window, if it belongs to a solver.
    device: Option<Device>,
    stiffness: f64,
    speed: f64,
    /// Place of each hand [m], while it holds something.
    hands: [Option<Vector3>; 2],
    /// The hand that the mouse leads.
    mouse: Which,
    /// From where the mouse is to where its hand is [m]; zero of a hand that it has taken.
    beside: Vector3,
    /// The largest force of these pulls [N].
    strongest: f64,
    orbiting: bool,
    help: bool,
    side_shown: bool,
    plots_shown: bool,
    /// Graphics adapter of the window.
    adapter: String,
    /// Actions that undo can take back, the newest last.
    acts: Vec<Act>,
    /// Requested picture.
    taking: Taking,
    numbers: Numbers,
    samples: Samples,
    /// Names of the curves that are plotted.
    plotted: BTreeSet<String>,
    /// True if plots show only the last seconds.
    lately: bool,
    /// Points that the user follows.
    probes: usize,
    file: PathBuf,
    look_of: fn(&Scene) -> Look,
    stop: StopFlag,
    changed: Option<SystemTime>,
    looked: Instant,
    read: Read,
    /// A scene that is being read.
    reading: Option<Receiver<(PathBuf, Result<World, String>)>>,
    filming: Filming,
    /// The tool that keys lead, in the order of tools, and the hand that holds it.
    led: Option<(usize, Which)>,
    /// List of the files that can be opened.
    browser: Browser,
    message: Option<Told>,
    /// Warnings of the scene, with the numbers that are played.
    warnings: Vec<String>,
    /// Messages that the user has closed.
    closed: BTreeSet<String>,
    frame_seconds: f64,
    painted: Instant,
    began: Instant,
    /// Wall time [s] from then to the first picture of the scene.
    first_picture: Option<f64>,
    portrait: Option<Portrait>,
    context: egui::Context,
    record: Option<PathBuf>,
    outcome: Outcome,
}

impl App {
    fn new(
        context: &eframe::CreationContext<'_>,
        opening: Opening,
        outcome: Outcome,
    ) -> Result<Self, String> {
        let state = context.wgpu_render_state.as_ref().ok_or("wgpu did not start")?;
        context.egui_ctx.set_visuals(egui::Visuals::light());
        let Opening { world, look, file, read, record, stop, portrait, size: _, began } = opening;
        let port = Viewport::new(context, &look(&world.scene))?;
        let session = begin(&world, &context.egui_ctx)?;
        let device = device::shared(state, &world);
        let mut app = Self {
            session,
            frame: Frame::default(),
            port,
            numbers: Numbers::of(&world.scene),
            view: world.scene.view.clone(),
            names: RegionNames::default(),
            warnings: warnings(&world),
            world,
            in_memory: false,
            device,
            stiffness: 200.0,
            speed: 1.0,
            hands: [None; 2],
            mouse: Which::First,
            beside: Vector3::zeros(),
            strongest: 0.0,
            orbiting: false,
            help: false,
            side_shown: true,
            plots_shown: true,
            acts: Vec::new(),
            taking: Taking::default(),
            adapter: state.adapter.get_info().name,
            samples: Samples::default(),
            plotted: plots::usual(),
            lately: false,
            probes: 0,
            changed: modified(&file),
            file,
            look_of: look,
            stop,
            looked: Instant::now(),
            read,
            reading: None,
            filming: Filming::default(),
            led: None,
            browser: Browser::default(),
            message: None,
            closed: BTreeSet::new(),
            frame_seconds: 0.0,
            painted: Instant::now(),
            began,
            first_picture: None,
            portrait: portrait.map(Portrait::new),
            context: context.egui_ctx.clone(),
            record,
            outcome,
        };
        app.begin_recording();
        app.show();
        app.show_marks(app.view.marks);
        remember(&app.file);
        app.order(Order::Play(true));
        Ok(app)
    }

    /// Returns the field that colours show.
    fn field(&self) -> Option<FieldName> {
        self.world.scene.field_of(&self.view)
    }

    /// The scene's title, or the name of its file.
    fn title(&self) -> String {
        let title = &self.world.scene.scene.title;
        if title.is_empty() { self.file.display().to_string() } else { title.clone() }
    }

    /// Takes the newest instant.
    fn look(&mut self) {
        self.session.samples().for_each(|sample| self.samples.take(sample));
        let (new, frame) = self.session.look();
        if !new {
            return;
        }
        let first = self.port.subject.points.is_empty();
        let renewed = !Arc::ptr_eq(&self.port.subject, &frame.subject);
        if renewed {
            self.port.renew(&frame.subject);
        }
        // After a failure at the first instant there is nothing but the message.
        let inspected = renewed || frame.inspections != self.frame.inspections;
        if inspected && frame.points.len() == self.port.subject.points.len() {
            self.port.set(&frame.points, &frame.values);
        }
        let refused = (frame.refusals > self.frame.refusals).then(|| frame.note.clone()).flatten();
        self.frame = frame.clone();
        if let Some(reason) = refused {
            self.numbers.refuse(&self.frame.numbers);
            self.message = Some(Told::failure(reason));
        }
        if !Arc::ptr_eq(&self.port.reach, &self.frame.ways) {
            self.port.learn(Arc::clone(&self.frame.ways));
        }
        self.port.fit_range(self.field().map_or("", FieldName::unit));
        let hands = Which::BOTH.into_iter().filter_map(|which| self.frame.hand(which));
        let strongest = hands.map(|[_, force]| Vector3::from(force).norm()).fold(0.0, f64::max);
        self.strongest = self.strongest.max(strongest);
        if first {
            self.port.camera = self.port.at_start();
        }
    }

    /// Shows the current view. With a section, the body stands in for a surface that it carries.
    fn show(&mut self) {
        let view = if self.port.cut.on { self.world.scene.in_section(&self.view) } else { self.view.clone() };
        self.names = self.world.region_names(view.on.as_deref());
        self.port.patient = self.world.scene.is_of_patient();
        self.look_at_regions();
        self.order(Order::Show(Box::new(view)));
    }

    fn begin_recording(&self) {
        if let Some(path) = &self.record {
            self.order(Order::RecordTo(path.clone()));
        }
    }

    fn order(&self, order: Order) {
        self.session.order(order);
    }

    /// Reads the scene anew after a change of its file, or another one that was dropped.
    fn watch(&mut self, context: &egui::Context) {
        let dropped =
            context.input(|input| input.raw.dropped_files.first().map(|file| file.path().to_owned()));
        if let Some(path) = dropped {
            self.begin_reading(path, context);
        } else if self.looked.elapsed() > Duration::from_millis(500) && self.reading.is_none() {
            self.looked = Instant::now();
            let now = modified(&self.file);
            if now.is_some() && now != self.changed {
                self.changed = now;
                self.begin_reading(self.file.clone(), context);
            }
        }
        let Some(Ok((path, read))) = self.reading.as_ref().map(|reading| reading.try_recv()) else { return };
        self.reading = None;
        let replaced = read.and_then(|world| self.replace(path, world));
        self.message = Some(replaced.map_or_else(Told::failure, |()| Told::done(REPLACED)));
    }

    fn begin_reading(&mut self, path: PathBuf, context: &egui::Context) {
        let (send, receive) = channel();
        let (read, context) = (self.read.clone(), context.clone());
        let work = move || {
            let result = read(&path);
            // The window may be closed by now.
            let _ = send.send((path, result));
            context.request_repaint();
        };
        self.message = Some(Told::hint("reading the scene …"));
        match std::thread::Builder::new().name("reader".into()).spawn(work) {
            Ok(_) => self.reading = Some(receive),
            Err(error) => self.message = Some(Told::failure(error.to_string())),
        }
    }

    fn replace(&mut self, path: PathBuf, mut world: World) -> Result<(), String> {
        world.share(self.device.as_ref());
        let before = std::mem::replace(&mut self.session, begin(&world, &self.context)?);
        // A long step ends in its own time.
        std::thread::spawn(move || drop(before));
        // A view that the file leaves as it was is the user's.
        if path != self.file || world.scene.view != self.world.scene.view {
            self.view = world.scene.view.clone();
            self.port.take_look(&(self.look_of)(&world.scene));
        }
        if path != self.file {
            self.port.subject = Arc::default();
        }
        self.numbers = Numbers::of(&world.scene);
        self.warnings = warnings(&world);
        self.closed.clear();
        self.acts.clear();
        self.forget_probes();
        self.world = world;
        self.changed = modified(&path);
        remember(&path);
        self.file = path;
        self.samples.clear();
        self.let_go();
        self.begin_recording();
        self.frame.inspections = 0;
        self.session.order(Order::Memory(self.in_memory));
        self.session.order(Order::Marks(self.view.marks));
        self.show();
        self.session.order(Order::Speed(self.speed));
        self.session.order(Order::Play(self.frame.playing));
        Ok(())
    }

    fn keys(&mut self, context: &egui::Context) {
        if context.egui_wants_keyboard_input() {
            return;
        }
        let pressed = |key| context.input(|input| input.key_pressed(key));
        if pressed(Key::Space) {
            self.order(Order::Play(!self.frame.playing));
        }
        if pressed(Key::Period) {
            self.order(Order::Step(1));
        }
        if pressed(Key::R) {
            self.reset();
        }
        if pressed(Key::Comma) {
            self.step_back();
        }
        if pressed(Key::Z) && context.input(|input| input.modifiers.command) {
            self.undo();
        }
        if self.port.keys(context) {
            self.show();
        }
        if pressed(Key::O) && context.input(|input| input.modifiers.command) {
            self.browser.turn(&self.file);
        }
        if pressed(Key::M) {
            self.show_marks(!self.view.marks);
        }
        if pressed(Key::V) {
            self.film();
        }
        if pressed(Key::K) {
            self.take_next_tool();
        }
        if pressed(Key::B) {
            self.change_hands();
        }
        self.lead_tool(context);
        if pressed(Key::Escape) {
            self.browser.shown = false;
        }
        if pressed(Key::H) {
            self.help = !self.help;
        }
    }

    fn reset(&mut self) {
        self.let_go();
        self.samples.clear();
        self.closed.clear();
        self.acts.clear();
        self.order(Order::Reset);
    }
}

/// Width of a window below which the side panel is left out.
const NARROW: f32 = 520.0;

/// Least height that is left for the plots and the picture. With less, the plots are left out.
const LOW: f32 = 380.0;

/// The message after a scene was read again.
const REPLACED: &str = "the scene was read anew";

impl eframe::App for App {
    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        let context = ui.ctx().clone();
        let painted = std::mem::replace(&mut self.painted, Instant::now());
        self.frame_seconds = 0.8 * self.frame_seconds + 0.2 * painted.elapsed().as_secs_f64();
        self.watch(&context);
        self.look();
        self.port.bring(frame);
        self.choose_memory();
        if self.stop.is_asked() {
            context.send_viewport_cmd(egui::ViewportCommand::Close);
        }
        self.take_picture(&context);
        self.go_on_filming();
        self.keys(&context);
        egui::Panel::top("top").show(ui, |ui| self.top(ui));
        if self.side_shown && ui.available_width() > NARROW {
            egui::Panel::right("side").default_size(220.0).show(ui, |ui| self.side(ui));
        }
        self.tell(ui);
        // In a low window the picture comes first.
        if self.plots_shown && ui.available_height() > LOW {
            egui::Panel::bottom("plots").show(ui, |ui| self.plots(ui));
        }
        egui::CentralPanel::default().frame(egui::Frame::NONE).show(ui, |ui| self.scene(ui));
        self.browse(&context);
        if !self.frame.points.is_empty() {
            self.first_picture.get_or_insert_with(|| self.began.elapsed().as_secs_f64());
        }
        self.pose();
        context.request_repaint_after(Duration::from_millis(250));
    }

    fn on_exit(&mut self) {
        let (Some(path), Some(recording)) = (&self.record, self.session.end()) else { return };
        if let Err(reason) = recording.write(path) {
            use std::io::Write as _;
            // Nobody reads it where standard error can't be written.
            let _ = writeln!(std::io::stderr(), "error: `{}` cannot be written: {reason}", path.display());
        }
    }
}

/// Starts to play a scene.
fn begin(world: &World, context: &egui::Context) -> Result<Session, String> {
    let context = context.clone();
    Session::start(world.clone(), move || context.request_repaint()).map_err(|error| error.to_string())
}

/// Returns the warnings of a world.
fn warnings(world: &World) -> Vec<String> {
    world.warnings().map(|warning| warning.message.clone()).collect()
}

fn modified(path: &Path) -> Option<SystemTime> {
    std::fs::metadata(path).ok()?.modified().ok()
}
