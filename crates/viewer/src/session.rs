//! A scene on a thread of its own: it is played there in real time, and handed over frame by frame. Neither side ever waits for the
//! other: orders go through a channel, the newest frame lies in one of three places of which each side holds one.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use pliant_geometry::Vector3;
use pliant_mechanics::Energies;
use pliant_picture::{Subject, nodal_values};
use pliant_scene::format::{At, FieldName};
use pliant_scene::{Built, Live, Plan, Scene, live};

use crate::hand::{Hand, Hold, Recording};

/// Wall time between frames.
const FRAME: Duration = Duration::from_micros(16_667);
/// Wall time that the solver may fall behind before it gives up catching up.
const BEHIND: f64 = 0.1;

/// What the window asks of the solver.
#[derive(Clone, Debug, PartialEq)]
pub enum Order {
    /// Goes on, or stands still.
    Play(bool),
    /// Goes so many steps on.
    Step(u64),
    /// Starts anew at rest.
    Reset,
    /// Simulated seconds a second.
    Speed(f64),
    /// Changes what a hand or a pin holds.
    Hand(Hand),
    /// Shows another field; `None` for the colour of tissue.
    Show(Option<FieldName>, Option<&'static str>),
    /// Ends.
    Quit,
}

/// An instant as the window shows it.
#[derive(Clone, Debug, Default)]
pub struct Frame {
    /// How many frames came before.
    pub number: u64,
    /// Simulated time [s].
    pub time: f64,
    /// Steps done.
    pub steps: u64,
    /// Whether it goes on.
    pub playing: bool,
    /// Positions [m].
    pub points: Vec<Vector3>,
    /// Values of the field that is shown; empty for none.
    pub values: Vec<f64>,
    /// Energies [J].
    pub energies: Energies,
    /// What is held: the point [m] and the force on the body [N] of each grip, hand first.
    pub held: Vec<[[f64; 3]; 2]>,
    /// Steps since the frame before.
    pub steps_a_frame: u64,
    /// Mean wall time of a step [s].
    pub step_seconds: f64,
    /// Wall time to prepare this frame [s]: forces, fields and their values at the points.
    pub prepare_seconds: f64,
    /// Simulated over wall time, lately.
    pub real_time_factor: f64,
    /// The same if the solver did nothing but steps.
    pub possible_factor: f64,
    /// From a hand's move to the first step in which it acted [s], of the last one.
    pub input_lag: Option<f64>,
    /// Why it cannot go on.
    pub failure: Option<String>,
}

/// A scene that is played on another thread.
#[derive(Debug)]
pub struct Session {
    orders: Sender<(Instant, Order)>,
    frames: triple_buffer::Output<Frame>,
    thread: Option<JoinHandle<Recording>>,
}

/// A scene ready to be played.
#[derive(Clone, Debug)]
pub struct Stage {
    /// The scene.
    pub scene: Scene,
    /// Its model.
    pub built: Built,
    /// Its step.
    pub plan: Plan,
}

impl Session {
    /// Starts to play a scene, standing still. `wake` is called after each frame.
    pub fn start(stage: Stage, wake: impl Fn() + Send + 'static) -> std::io::Result<Self> {
        let (input, frames) = triple_buffer::TripleBuffer::new(&Frame::default()).split();
        let (orders, inbox) = channel();
        let threads = stage.scene.run.threads as usize;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(std::io::Error::other)?;
        let run = move || pool.install(move || play(&stage, &inbox, input, &wake));
        let thread = std::thread::Builder::new().name("solver".into()).spawn(run)?;
        Ok(Self { orders, frames, thread: Some(thread) })
    }

    /// Gives an order; it is forgotten where the solver has ended.
    pub fn order(&self, order: Order) {
        let _ = self.orders.send((Instant::now(), order));
    }

    /// The newest frame; whether it is a new one.
    pub fn look(&mut self) -> (bool, &Frame) {
        (self.frames.update(), self.frames.output_buffer())
    }

    /// Whether the solver's thread has ended.
    pub fn has_ended(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }
}

impl Session {
    /// Ends it; what was held since it started or was last reset. `None` after a panic, which was told there.
    pub fn end(&mut self) -> Option<Recording> {
        self.order(Order::Quit);
        self.thread.take()?.join().ok()
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.end();
    }
}

/// How fast it goes: simulated time follows wall time from an anchor on.
struct Pace {
    speed: f64,
    anchor: (Instant, f64),
    /// Wall and simulated time at the last frames, for the factor.
    lately: Vec<(Instant, f64)>,
}

impl Pace {
    fn new(time: f64) -> Self {
        Self { speed: 1.0, anchor: (Instant::now(), time), lately: Vec::with_capacity(64) }
    }

    fn anchor(&mut self, time: f64) {
        self.anchor = (Instant::now(), time);
        self.lately.clear();
    }

    /// The simulated time [s] that it should be now.
    fn goal(&self) -> f64 {
        self.anchor.1 + self.speed * self.anchor.0.elapsed().as_secs_f64()
    }

    /// Simulated over wall time of the last half second.
    fn factor(&mut self, time: f64) -> f64 {
        let now = Instant::now();
        self.lately.retain(|(then, _)| now.duration_since(*then) < Duration::from_millis(500));
        self.lately.push((now, time));
        let (first, from) = self.lately[0];
        let wall = now.duration_since(first).as_secs_f64();
        if wall > 0.0 { (time - from) / wall } else { 0.0 }
    }
}

/// Everything of the solver's thread.
struct Player<'s> {
    stage: &'s Stage,
    subject: Subject,
    live: Box<dyn Live + 's>,
    hold: Hold,
    field: Option<String>,
    steps: u64,
    failure: Option<String>,
    pace: Pace,
    playing: bool,
    /// When the hand moved that no step has felt yet.
    moved: Option<Instant>,
    input_lag: Option<f64>,
    /// Since the last frame.
    batch: (u64, Duration),
    step_seconds: f64,
    frames: u64,
    recording: Recording,
    /// Points and values of the last instant that could be shown.
    good: (Vec<Vector3>, Vec<f64>),
}

fn play(
    stage: &Stage,
    inbox: &Receiver<(Instant, Order)>,
    mut frames: triple_buffer::Input<Frame>,
    wake: &(impl Fn() + Send),
) -> Recording {
    let mut player = match Player::new(stage) {
        Ok(player) => player,
        Err(message) => {
            frames.input_buffer_mut().failure = Some(message);
            frames.publish();
            wake();
            return Recording::default();
        }
    };
    let shown = Instant::now();
    player.show(&mut frames);
    wake();
    player.until_quit(inbox, &mut frames, wake, shown);
    Recording { steps: player.steps, ..player.recording }
}

impl Player<'_> {
    fn until_quit(
        &mut self,
        inbox: &Receiver<(Instant, Order)>,
        frames: &mut triple_buffer::Input<Frame>,
        wake: &(impl Fn() + Send),
        mut shown: Instant,
    ) {
        loop {
            // Orders come first; while it stands still nothing but orders happens.
            let due = FRAME.saturating_sub(shown.elapsed());
            let patience = if self.is_going() { self.patience(due) } else { Duration::from_millis(50) };
            let mut changed = false;
            let mut next = match patience {
                Duration::ZERO => inbox.try_recv().ok(),
                _ => match inbox.recv_timeout(patience) {
                    Ok(order) => Some(order),
                    Err(RecvTimeoutError::Timeout) => None,
                    Err(RecvTimeoutError::Disconnected) => return,
                },
            };
            while let Some((sent, order)) = next {
                if order == Order::Quit {
                    return;
                }
                self.obey(sent, order);
                changed = true;
                next = inbox.try_recv().ok();
            }
            if self.is_going() {
                self.go_on(FRAME.saturating_sub(shown.elapsed()));
                changed = true;
            }
            if changed && (shown.elapsed() >= FRAME || !self.is_going()) {
                shown = Instant::now();
                self.show(frames);
                wake();
            }
        }
    }
}

impl<'s> Player<'s> {
    fn new(stage: &'s Stage) -> Result<Self, String> {
        let mut live = live(&stage.scene, &stage.built, &stage.plan).map_err(|failure| failure.message)?;
        let subject = Subject::new(live.mesh().map_err(|failure| failure.message)?);
        let field = stage.scene.shown_field().map(|field| {
            let part = stage.scene.view.component.map(|part| format!(":{}", part.word())).unwrap_or_default();
            format!("{}{part}", field.name())
        });
        Ok(Self {
            stage,
            subject,
            live,
            hold: Hold::default(),
            field,
            steps: 0,
            failure: None,
            pace: Pace::new(0.0),
            playing: false,
            moved: None,
            input_lag: None,
            batch: (0, Duration::ZERO),
            step_seconds: 0.0,
            frames: 0,
            recording: Recording::default(),
            good: Default::default(),
        })
    }

    fn is_going(&self) -> bool {
        self.playing && self.failure.is_none()
    }

    /// How long it may wait for orders: until the simulation is due to go on, or the next frame is.
    fn patience(&self, frame_due: Duration) -> Duration {
        let ahead = (self.live.time() - self.pace.goal()) / self.pace.speed.max(1e-9);
        Duration::try_from_secs_f64(ahead.max(0.0)).unwrap_or(frame_due).min(frame_due)
    }

    fn obey(&mut self, sent: Instant, order: Order) {
        match order {
            Order::Play(playing) => {
                self.playing = playing;
                self.pace.anchor(self.live.time());
            }
            Order::Step(steps) => {
                self.playing = false;
                for _ in 0..steps {
                    self.step();
                }
            }
            Order::Reset => self.reset(),
            Order::Speed(speed) => {
                self.pace.speed = speed.clamp(1e-6, 1e6);
                self.pace.anchor(self.live.time());
            }
            Order::Hand(hand) => {
                let (model, step) = (&self.stage.built.model, self.stage.plan.step);
                self.hold.take(&hand, model, step, &self.subject, self.live.as_mut());
                let from = self.steps + self.live.delay();
                self.recording.moves.push((from, self.hold.grips().to_vec(), self.hold.by_hand()));
                self.moved.get_or_insert(sent);
            }
            Order::Show(field, component) => self.show_field(field, component),
            Order::Quit => {}
        }
    }

    fn reset(&mut self) {
        match live(&self.stage.scene, &self.stage.built, &self.stage.plan) {
            Ok(live) => {
                self.live = live;
                self.hold = Hold::default();
                self.recording = Recording::default();
                (self.steps, self.failure, self.moved) = (0, None, None);
                self.pace.anchor(0.0);
                let field = self.field.clone();
                self.show_named(field.as_deref());
            }
            Err(failure) => self.failure = Some(failure.message),
        }
    }

    fn show_field(&mut self, field: Option<FieldName>, component: Option<&'static str>) {
        let part = component.map(|part| format!(":{part}")).unwrap_or_default();
        let name = field.map(|field| format!("{}{part}", field.name()));
        self.show_named(name.as_deref());
    }

    fn show_named(&mut self, name: Option<&str>) {
        let field = name.and_then(|name| FieldName::of_name(name.split(':').next().unwrap_or(name)));
        let mut shown = self.stage.scene.shown(1.0);
        shown.data = vec![FieldName::Displacement];
        shown.data.extend(field.filter(|field| *field != FieldName::Displacement));
        if shown.curved.is_none() {
            shown.at = At::Points;
        }
        self.live.show(&shown);
        self.field = name.map(str::to_owned);
    }

    fn step(&mut self) -> u64 {
        if self.failure.is_some() {
            return 0;
        }
        match self.live.advance(1) {
            Ok(steps) => {
                self.steps += steps;
                if let Some(moved) = self.moved.take() {
                    self.input_lag = Some(moved.elapsed().as_secs_f64());
                }
                steps
            }
            Err(failure) => {
                self.failure = Some(failure.message);
                0
            }
        }
    }

    /// Steps until the simulation is where it should be, or the next frame is due.
    fn go_on(&mut self, most: Duration) {
        let started = Instant::now();
        let mut done = 0;
        while self.failure.is_none() && self.live.time() < self.pace.goal() {
            done += self.step();
            if started.elapsed() >= most {
                break;
            }
        }
        self.batch = (self.batch.0 + done, self.batch.1 + started.elapsed());
        if self.pace.goal() - self.live.time() > BEHIND * self.pace.speed {
            self.pace.anchor = (Instant::now(), self.live.time());
        }
    }

    /// Hands the instant over.
    fn show(&mut self, frames: &mut triple_buffer::Input<Frame>) {
        let started = Instant::now();
        let frame = frames.input_buffer_mut();
        match self.live.mesh() {
            Ok(mesh) => {
                frame.points.clone_from(&mesh.points);
                if let Some(moved) = mesh.point_data.get("displacement") {
                    for (point, by) in frame.points.iter_mut().zip(moved.values.chunks_exact(3)) {
                        *point += Vector3::new(by[0], by[1], by[2]);
                    }
                }
                frame.values = self.field.as_deref().and_then(|f| nodal_values(mesh, f)).unwrap_or_default();
                frame.energies = self.live.energies();
                self.good.0.clone_from(&frame.points);
                self.good.1.clone_from(&frame.values);
            }
            // The last good picture stays.
            Err(failure) => {
                self.failure.get_or_insert(failure.message);
                frame.points.clone_from(&self.good.0);
                frame.values.clone_from(&self.good.1);
            }
        }
        let (steps, wall) = std::mem::take(&mut self.batch);
        if steps > 0 {
            self.step_seconds = wall.as_secs_f64() / steps as f64;
        }
        frame.number = self.frames;
        frame.time = self.live.time();
        frame.steps = self.steps;
        frame.playing = self.playing && self.failure.is_none();
        frame.held.clear();
        frame.held.extend(self.hold.grips().iter().map(|grip| self.live.pulled(grip)));
        frame.steps_a_frame = steps;
        frame.step_seconds = self.step_seconds;
        frame.real_time_factor = if frame.playing { self.pace.factor(frame.time) } else { 0.0 };
        let step = if self.steps > 0 { frame.time / self.steps as f64 } else { self.stage.plan.step };
        frame.possible_factor = if self.step_seconds > 0.0 { step / self.step_seconds } else { 0.0 };
        frame.input_lag = self.input_lag;
        frame.failure.clone_from(&self.failure);
        frame.prepare_seconds = started.elapsed().as_secs_f64();
        self.frames += 1;
        frames.publish();
    }
}
