//! A scene on a thread of its own: it is played there in real time, and handed over frame by frame. Neither side ever waits for the
//! other: orders go through a channel, the newest frame lies in one of three places of which each side holds one.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use pliant_explicit::Wanted;
use pliant_format::tables::ViewTable;
use pliant_geometry::words::number;
use pliant_geometry::{Region, Vector3};
use pliant_mechanics::Energies;
use pliant_picture::{
    Mark, PointForce, Subject, contact_forces, critical_cell, deformed_points, drawn_value, nodal_values,
    visible,
};
use pliant_run::{Column, Live};
use pliant_scene::World;
use pliant_sim::gpu::{DevicePoints, PointValue};
use pliant_sim::{Failure, State, StopFlag};

use crate::device::{Seen, point_value};
use crate::followed::{Followed, FollowedPoint};
use crate::hand::{Hand, Hold, Point, Which};
use crate::marks::marks;
use crate::parameters::Number;
use crate::recording::{Break, Done, Move, Recording, Surface};
use crate::samples::{HAND, SECOND_HAND, Sample};
use crate::sound::{Sound, SoundStates};

/// Wall time between frames.
pub(crate) const FRAME: Duration = Duration::from_micros(16_667);
/// Simulated time [s] from sample to sample; longer steps have one each.
const SAMPLED: f64 = 0.005;
/// Wall time from one writing of a recording to the next.
const WRITTEN: Duration = Duration::from_secs(1);
/// Wall time that the solver may fall behind before it gives up catching up.
const BEHIND: f64 = 0.1;

/// What the window asks of the solver.
#[derive(Clone, Debug)]
pub enum Order {
    /// Goes on, or stands still.
    Play(bool),
    /// Goes so many steps on.
    Step(u64),
    /// Starts anew at rest.
    Reset,
    /// Goes back to the newest kept state of no more than so many steps, and lets go.
    Back(u64),
    /// Simulated seconds a second.
    Speed(f64),
    /// Changes what the first hand or a pin holds.
    Hand(Hand),
    /// Changes what the second hand or a pin holds.
    Second(Hand),
    /// Goes on as another world from the next step on, from where the run stands: that of numbers which are others than in the file.
    Change(Box<World>, Vec<Number>),
    /// Finds where bodies are held, moved and loaded in each frame, or not any more.
    Marks(bool),
    /// Follows a point.
    Probe(Point),
    /// Follows no point any more but those that the scene names.
    ForgetProbes,
    /// Keeps what is done to the run from now on.
    Record,
    /// The same, written into a file each second.
    RecordTo(PathBuf),
    /// Halves the steps.
    Halve,
    /// Shows another field, or another surface.
    Show(Box<ViewTable>),
    /// Brings every frame to ordinary memory where the state lies on a device, as a section needs it; or only some.
    Memory(bool),
    /// Ends.
    Quit,
}

/// An instant as the window shows it.
#[derive(Clone, Debug, Default)]
pub struct Frame {
    /// How many frames came before.
    pub number: u64,
    /// What is drawn: points and triangles at rest. Another one where another surface is shown.
    pub subject: Arc<Subject>,
    /// Where obstacles, tools and driven nodes come [m], see [`Live::ways`].
    pub ways: Arc<Vec<Vector3>>,
    /// Simulated time [s].
    pub time: f64,
    /// Steps done.
    pub steps: u64,
    /// Whether it goes on.
    pub playing: bool,
    /// Points on the device where the state lies, at this instant, to be drawn from there; `None` of a state in ordinary memory.
    pub on_device: Option<DevicePoints>,
    /// How many inspections there were. Points, values, energies, and what is held are of the last one: of this instant unless
    /// the state lies on a device, where inspections are rare ([`INSPECTION`](crate::INSPECTION)).
    pub inspections: u64,
    /// What was read back from the device so far.
    pub read_backs: u64,
    /// Positions [m].
    pub points: Vec<Vector3>,
    /// Values of the field that is shown; empty for none.
    pub values: Vec<f64>,
    /// The cell with the smallest step, where that is asked for.
    pub critical: Option<u32>,
    /// Energies [J].
    pub energies: Energies,
    /// The least gap [m] in contacts with barriers; `None` where nothing is near.
    pub least_gap: Option<f64>,
    /// Steps that were taken though they had not converged.
    pub unconverged: u64,
    /// What is held: the point [m] and the force on the body [N] of each hand that holds something, then of each pin.
    pub held: Vec<[[f64; 3]; 2]>,
    /// Where each hand is among what is held; `None` of one that holds nothing.
    pub hands: [Option<usize>; 2],
    /// Forces of contacts on the nodes, where they are asked for.
    pub contacts: Vec<PointForce>,
    /// Where bodies are held, moved and loaded, where that is asked for.
    pub marks: Vec<Mark>,
    /// Points that the user follows, in the order in which they were picked.
    pub followed: Vec<FollowedPoint>,
    /// The tool that each hand holds.
    pub tools: [Option<String>; 2],
    /// Whether each triangle of the subject can be taken hold of: those of bodies and tools, not those of obstacles.
    pub movable: Arc<[bool]>,
    /// A triangle of each tool.
    pub tool_triangles: Arc<[u32]>,
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
    /// How often a pull broke the run, which then went back to a state before it.
    pub breaks: u64,
    /// The numbers that are others than in the file.
    pub numbers: Vec<Number>,
    /// How often changed numbers broke the run at once; it then went on with those before.
    pub refusals: u64,
    /// Why it cannot go on: what happened, where, and what to try.
    pub failure: Option<String>,
    /// What else to tell.
    pub note: Option<String>,
}

impl Frame {
    /// What each pin holds: the point [m] and the force on the body [N].
    pub fn pins(&self) -> &[[[f64; 3]; 2]] {
        let hands = self.hands.iter().flatten().count();
        self.held.get(hands..).unwrap_or_default()
    }

    /// What a hand holds: the point [m] and the force on the body [N].
    pub fn hand(&self, which: Which) -> Option<[[f64; 3]; 2]> {
        self.held.get(self.hands[which as usize]?).copied()
    }
}

/// A scene that is played on another thread.
#[derive(Debug)]
pub struct Session {
    orders: Sender<(Instant, Order)>,
    samples: Receiver<Sample>,
    frames: triple_buffer::Output<Frame>,
    /// Ends a step that takes long.
    stop: StopFlag,
    thread: Option<JoinHandle<Recording>>,
}

/// Begins to play a world, from where a run of another one stands if it can be; whether it goes on from there.
///
/// # Errors
/// If a stepper can't be made.
pub(crate) fn enter(world: &World, from: Option<(World, Option<State>)>) -> Result<(Live, bool), String> {
    let told = |failure: Failure| failure.message;
    let world = Arc::new(world.clone());
    if let Some((before, Some(snapshot))) = from
        && let Some(live) = Live::go_on(&world, snapshot, &before).map_err(told)?
    {
        return Ok((live, true));
    }
    Ok((Live::new(&world).map_err(told)?, false))
}

impl Session {
    /// Starts to play a scene, snapshot still. `wake` is called after each frame.
    pub fn start(world: World, wake: impl Fn() + Send + 'static) -> std::io::Result<Self> {
        let (input, frames) = triple_buffer::TripleBuffer::new(&Frame::default()).split();
        let (orders, inbox) = channel();
        let (sampled, samples) = channel();
        let threads = world.scene.run.threads as usize;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(std::io::Error::other)?;
        let stop = StopFlag::default();
        let asked = stop.clone();
        let run = move || pool.install(move || play(world, &inbox, input, sampled, &wake, asked));
        let thread = std::thread::Builder::new().name("solver".into()).spawn(run)?;
        Ok(Self { orders, samples, frames, stop, thread: Some(thread) })
    }

    /// Gives an order; it is forgotten where the solver has ended.
    pub fn order(&self, order: Order) {
        let _ = self.orders.send((Instant::now(), order));
    }

    /// The newest frame; whether it is a new one.
    pub fn look(&mut self) -> (bool, &Frame) {
        (self.frames.update(), self.frames.output_buffer())
    }

    /// The samples since the last call, in the order in which they were taken.
    pub fn samples(&self) -> impl Iterator<Item = Sample> + '_ {
        self.samples.try_iter()
    }

    /// Whether the solver's thread has ended.
    pub fn has_ended(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }
}

impl Session {
    /// Ends it; what was done since it was told to record or was last reset. `None` after a panic, which was told there.
    pub fn end(&mut self) -> Option<Recording> {
        self.order(Order::Quit);
        self.stop.ask();
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

/// What of a run lasts when it goes on as another world.
struct Playback {
    hold: Hold,
    /// Ends a step that takes long.
    stop: StopFlag,
    /// What is shown, and the view that the scene opened with.
    view: ViewTable,
    usual: Surface,
    /// The field that is shown, with its component.
    field: Option<String>,
    steps: u64,
    breaks: u64,
    failure: Option<String>,
    note: Option<String>,
    pace: Pace,
    playing: bool,
    /// Steps that were asked for one by one.
    owed: u64,
    /// What was asked for that no step has felt yet: when, after how many steps it acts, and its number in the recording.
    waiting: Vec<(Instant, u64, usize)>,
    input_lag: Option<f64>,
    /// Since the last frame.
    batch: (u64, Duration),
    step_seconds: f64,
    frames: u64,
    shown: Instant,
    /// Wall time that the last frame took to prepare.
    prepared: Duration,
    recording: Option<Recording>,
    /// The bodies that are recorded.
    of: u64,
    /// Where the recording is written, and when and after how many moves and steps it was last.
    file: Option<(PathBuf, Instant, (usize, u64))>,
    /// When the first move was recorded.
    started: Option<Instant>,
    /// The world to go on as, and its numbers that are others than in the file.
    change: Option<(Box<World>, Vec<Number>)>,
    numbers: Vec<Number>,
    refusals: u64,
    /// Why changed numbers are refused.
    refused: Option<String>,
    followed: Vec<Followed>,
    columns: Arc<[Column]>,
    samples: Sender<Sample>,
    /// Steps done at the last sample.
    sampled: Option<u64>,
    seen: Seen,
    /// Whether marks are found.
    marked: bool,
    /// Whether every frame comes to ordinary memory.
    in_memory: bool,
}

/// Why a world is left.
enum Left {
    Quit,
    /// To start anew.
    Reset,
    /// For another world.
    Change,
    /// For the world before, since the changed numbers break the run.
    Refusal(String),
}

/// A run before its numbers were changed.
struct Former {
    world: World,
    numbers: Vec<Number>,
    state: Option<State>,
    steps: u64,
    hold: Hold,
    /// Moves and breaks that were recorded.
    recorded: [usize; 2],
}

/// The solver's thread while it plays a world.
struct Player<'s> {
    world: &'s World,
    subject: Arc<Subject>,
    ways: Arc<Vec<Vector3>>,
    /// Whether each triangle of the subject can be taken hold of.
    movable: Arc<[bool]>,
    /// A triangle of each tool.
    tool_triangles: Arc<[u32]>,
    /// Regions whose cells are not shown.
    hidden: Vec<Region>,
    live: Live,
    /// Whether the state lies on a device.
    on_device: bool,
    sound: SoundStates,
    /// Whether it goes on from a world with other numbers.
    is_changed: bool,
    playback: Playback,
}

fn play(
    mut world: World,
    inbox: &Receiver<(Instant, Order)>,
    mut frames: triple_buffer::Input<Frame>,
    samples: Sender<Sample>,
    wake: &(impl Fn() + Send),
    stop: StopFlag,
) -> Recording {
    let mut playback = Playback::new(&world, samples, stop);
    let (mut from, mut subject) = (None, None);
    let mut former: Option<Former> = None;
    loop {
        let (left, evaluated) = match enter(&world, from.take()) {
            Err(message) if former.is_some() => (Left::Refusal(message), false),
            Err(message) => {
                frames.input_buffer_mut().failure = Some(message);
                frames.publish();
                wake();
                return Recording::default();
            }
            Ok((live, goes_on)) => {
                let mut player = Player::enter(&world, (live, goes_on), subject, playback, former.is_some());
                player.show(&mut frames);
                wake();
                let left = player.go(inbox, &mut frames, wake);
                if matches!(left, Left::Change) {
                    former = player.former();
                }
                let evaluated = player.live.simulation.is_evaluated();
                (subject, playback) = player.end();
                (left, evaluated)
            }
        };
        match left {
            Left::Quit => {
                let recording = playback.recording.unwrap_or_default();
                return Recording { steps: playback.steps, ..recording };
            }
            Left::Reset => {
                former = None;
                playback.start_anew();
            }
            Left::Refusal(message) => {
                if let Some(former) = former.take() {
                    let state = playback.refuse(&former, &message);
                    from = Some((former.world.clone(), state));
                    world = former.world;
                }
            }
            Left::Change => {
                if former.is_none() {
                    playback.start_anew();
                }
                let state = former.as_ref().and_then(|former| former.state.clone());
                from = playback.change.take().map(|(mut next, numbers)| {
                    next.share(world.device());
                    playback.record(evaluated, Instant::now(), Done::Numbers(numbers.clone()));
                    playback.numbers = numbers;
                    (std::mem::replace(&mut world, *next), state)
                });
            }
        }
    }
}

impl Playback {
    fn new(world: &World, samples: Sender<Sample>, stop: StopFlag) -> Self {
        Self {
            hold: Hold::default(),
            stop,
            view: world.scene.view.clone(),
            usual: Surface::of(&world.scene.view),
            field: None,
            steps: 0,
            breaks: 0,
            failure: None,
            note: None,
            pace: Pace::new(0.0),
            playing: false,
            owed: 0,
            waiting: Vec::new(),
            input_lag: None,
            batch: (0, Duration::ZERO),
            step_seconds: 0.0,
            frames: 0,
            shown: Instant::now(),
            prepared: Duration::ZERO,
            recording: None,
            of: world.simulated().fingerprint_of_bodies(),
            file: None,
            started: None,
            change: None,
            numbers: Vec::new(),
            refusals: 0,
            refused: None,
            followed: Vec::new(),
            columns: Arc::default(),
            samples,
            sampled: None,
            seen: Seen::default(),
            marked: false,
            in_memory: false,
        }
    }

    fn start_anew(&mut self) {
        self.hold = Hold::default();
        (self.steps, self.owed, self.started) = (0, 0, None);
        (self.failure, self.note) = (None, None);
        self.waiting.clear();
        self.sampled = None;
        if self.recording.is_some() {
            self.begin_recording();
        }
        if !self.numbers.is_empty() {
            self.record(false, Instant::now(), Done::Numbers(self.numbers.clone()));
        }
        self.pace.anchor(0.0);
    }

    /// Goes back to a run before its numbers were changed; the state from which it goes on.
    fn refuse(&mut self, former: &Former, reason: &str) -> Option<State> {
        (self.steps, self.owed, self.hold) = (former.steps, 0, former.hold.clone());
        self.numbers.clone_from(&former.numbers);
        (self.failure, self.refused, self.change) = (None, None, None);
        self.waiting.clear();
        self.sampled = None;
        if let Some(recording) = &mut self.recording {
            let [moves, breaks] = former.recorded;
            recording.moves.truncate(moves);
            recording.breaks.truncate(breaks);
        }
        self.refusals += 1;
        self.note =
            Some(format!("the changed numbers break the run, so they go back to those before: {reason}"));
        former.state.clone()
    }

    /// Writes the recording into its file once a second, if something has happened.
    fn write_recording(&mut self) {
        let (Some((path, written, known)), Some(recording)) = (&mut self.file, &self.recording) else {
            return;
        };
        let now = (recording.moves.len(), self.steps);
        if *known == now || written.elapsed() < WRITTEN {
            return;
        }
        (*written, *known) = (Instant::now(), now);
        if let Err(error) = (Recording { steps: self.steps, ..recording.clone() }).write(path) {
            self.note = Some(format!("`{}` cannot be written: {error}", path.display()));
        }
    }

    /// Records from now on, a surface that is another one than the scene's first.
    fn begin_recording(&mut self) {
        self.recording = Some(Recording { of: self.of, ..Recording::default() });
        let surface = Surface::of(&self.view);
        if surface != self.usual {
            self.record(false, Instant::now(), Done::Surface(surface));
        }
    }

    /// Wall time between frames: long enough that three quarters of it are left for steps.
    fn interval(&self) -> Duration {
        FRAME.max(4 * self.prepared)
    }

    fn is_going(&self) -> bool {
        self.playing && self.failure.is_none()
    }

    /// Keeps what was done at an instant, whose forces were found or not.
    fn record(&mut self, evaluated: bool, sent: Instant, done: Done) {
        let Some(recording) = &mut self.recording else { return };
        let started = *self.started.get_or_insert(sent);
        let seconds = sent.saturating_duration_since(started).as_secs_f64();
        recording.moves.push(Move { steps: self.steps, evaluated, seconds, lag: None, done });
    }

    /// After a step: what was asked for before has been felt.
    fn feel(&mut self) {
        for &(sent, _, number) in self.waiting.iter().filter(|(_, from, _)| self.steps > *from) {
            let lag = sent.elapsed().as_secs_f64();
            self.input_lag = Some(lag);
            if let Some(then) = self.recording.as_mut().and_then(|recording| recording.moves.get_mut(number))
            {
                then.lag = Some(lag);
            }
        }
        let steps = self.steps;
        self.waiting.retain(|(_, from, _)| steps <= *from);
    }
}

impl<'s> Player<'s> {
    /// Begins to play a world, or goes on as it from where a run of the world before stands.
    fn enter(
        world: &'s World,
        (mut live, goes_on): (Live, bool),
        subject: Option<Arc<Subject>>,
        mut playback: Playback,
        is_changed: bool,
    ) -> Self {
        live.simulation.stop_on(&playback.stop);
        if !goes_on && playback.steps > 0 {
            playback.start_anew();
            playback.note = Some("the mesh or the solver is another one: it starts anew".into());
        }
        playback.hold.hold_on(&mut live);
        let on_device = world.device().is_some();
        let known = subject.filter(|_| goes_on);
        let is_known = known.is_some();
        let mut player = Self {
            world,
            subject: known.unwrap_or_default(),
            ways: Arc::default(),
            movable: Arc::default(),
            tool_triangles: Arc::default(),
            hidden: Vec::new(),
            live,
            on_device,
            sound: SoundStates::default(),
            is_changed,
            playback,
        };
        player.keep_sound();
        player.show_as_viewed();
        if is_known {
            player.find_movable();
        } else if let Err(message) = player.renew_subject() {
            player.fail(message);
        }
        player.name_columns();
        player
    }

    /// The run as it is before its numbers change; `None` of one that has failed.
    fn former(&mut self) -> Option<Former> {
        let playback = &self.playback;
        let recorded = |recording: &Recording| [recording.moves.len(), recording.breaks.len()];
        let former = playback.failure.is_none().then(|| Former {
            world: self.world.clone(),
            numbers: playback.numbers.clone(),
            state: None,
            steps: playback.steps,
            hold: playback.hold.clone(),
            recorded: playback.recording.as_ref().map_or([0; 2], recorded),
        })?;
        let state = (former.steps > 0).then(|| self.live.simulation.state().ok()).flatten();
        Some(Former { state, ..former })
    }

    /// The run cannot go on: changed numbers that break it at once are refused.
    fn fail(&mut self, message: String) {
        let playback = &mut self.playback;
        if self.is_changed && self.sound.has_just_begun(playback.steps, self.world.step()) {
            playback.refused.get_or_insert(message);
        } else {
            playback.failure.get_or_insert(message);
        }
    }

    /// What lasts.
    fn end(self) -> (Option<Arc<Subject>>, Playback) {
        (Some(self.subject), self.playback)
    }

    /// Follows orders and goes on, until the world is left.
    fn go(
        &mut self,
        inbox: &Receiver<(Instant, Order)>,
        frames: &mut triple_buffer::Input<Frame>,
        wake: &(impl Fn() + Send),
    ) -> Left {
        let mut changed = false;
        loop {
            if let Some(message) = self.playback.refused.take() {
                return Left::Refusal(message);
            }
            if self.playback.change.is_some() {
                return Left::Change;
            }
            self.playback.write_recording();
            // Orders come first, before each step; while it stands still nothing but orders happens.
            if self.playback.owed == 0 {
                let mut next = match self.patience(changed) {
                    Duration::ZERO => inbox.try_recv().ok(),
                    patience => match inbox.recv_timeout(patience) {
                        Ok(order) => Some(order),
                        Err(RecvTimeoutError::Timeout) => None,
                        Err(RecvTimeoutError::Disconnected) => return Left::Quit,
                    },
                };
                while let Some((sent, order)) = next {
                    changed = true;
                    if let Some(left) = self.obey(sent, order) {
                        return left;
                    }
                    // Steps that were asked for come before later orders.
                    next = if self.playback.owed > 0 { None } else { inbox.try_recv().ok() };
                }
            }
            if self.playback.change.is_some() {
                return Left::Change;
            }
            if self.playback.owed > 0
                || (self.playback.is_going() && self.live.simulation.time() < self.playback.pace.goal())
            {
                self.step();
                changed = true;
            }
            let still = !self.playback.is_going() && self.playback.owed == 0;
            if changed && (still || self.playback.shown.elapsed() >= self.playback.interval()) {
                self.show(frames);
                wake();
                changed = false;
            }
        }
    }

    /// How long it may wait for orders: until the simulation is due to go on, or the frame of what has changed is.
    fn patience(&self, changed: bool) -> Duration {
        let playback = &self.playback;
        let long = Duration::from_millis(50);
        if !playback.is_going() {
            return long;
        }
        let due = if changed { playback.interval().saturating_sub(playback.shown.elapsed()) } else { long };
        let ahead = (self.live.simulation.time() - playback.pace.goal()) / playback.pace.speed.max(1e-9);
        Duration::try_from_secs_f64(ahead.max(0.0)).unwrap_or(due).min(due)
    }

    fn obey(&mut self, sent: Instant, order: Order) -> Option<Left> {
        let playback = &mut self.playback;
        match order {
            Order::Play(playing) => {
                playback.playing = playing;
                playback.pace.anchor(self.live.simulation.time());
            }
            Order::Step(steps) => (playback.playing, playback.owed) = (false, steps),
            Order::Reset => return Some(Left::Reset),
            Order::Back(steps) => self.go_back_before(steps),
            Order::Speed(speed) => {
                playback.pace.speed = speed.clamp(1e-6, 1e6);
                playback.pace.anchor(self.live.simulation.time());
            }
            Order::Hand(hand) => self.hold(sent, Which::First, &hand),
            Order::Second(hand) => self.hold(sent, Which::Second, &hand),
            Order::Change(world, numbers) => playback.change = Some((world, numbers)),
            Order::Marks(marked) => (playback.marked, playback.seen.at) = (marked, None),
            Order::Probe(point) => self.follow(&point),
            Order::ForgetProbes => {
                playback.followed.clear();
                self.name_columns();
            }
            Order::Record => playback.begin_recording(),
            Order::RecordTo(path) => {
                playback.begin_recording();
                playback.file = Some((path, Instant::now(), (0, 0)));
            }
            Order::Halve => self.halve(),
            Order::Show(view) => self.show_another(*view, sent),
            Order::Memory(every) => playback.in_memory = every,
            Order::Quit => return Some(Left::Quit),
        }
        None
    }

    fn hold(&mut self, sent: Instant, which: Which, hand: &Hand) {
        // Where it takes hold has to be known.
        if self.on_device && matches!(hand, Hand::Take(..) | Hand::Pin(_)) {
            self.inspect();
        }
        if !matches!(hand, Hand::Pull(_)) {
            self.playback.seen.at = None;
        }
        if !matches!(hand, Hand::Release) {
            self.sound.touch(self.playback.steps);
        }
        let evaluated = self.live.simulation.is_evaluated();
        let held = self.playback.hold.take(which, hand, &self.subject, &mut self.live);
        let playback = &mut self.playback;
        if !held {
            playback.note = Some("this solver knows no hand: it does not pull".into());
        } else if matches!(hand, Hand::Take(..) | Hand::Pin(_)) {
            playback.note = None;
        }
        let number = playback.recording.as_ref().map_or(0, |recording| recording.moves.len());
        playback.record(evaluated, sent, Done::by(which, *hand));
        if held && playback.is_going() {
            playback.waiting.push((sent, playback.steps + u64::from(evaluated), number));
        }
    }

    fn follow(&mut self, point: &Point) {
        let on = self.playback.view.on.as_deref();
        let followed = Followed::new(point, &self.subject, &self.live, self.world, on, &self.hidden);
        self.playback.followed.extend(followed);
        self.name_columns();
    }

    fn name_columns(&mut self) {
        let axes =
            |name: String, unit| ["x", "y", "z"].map(|axis| Column { name: format!("{name}.{axis}"), unit });
        let mut columns = [axes(HAND.into(), "N"), axes(SECOND_HAND.into(), "N")].concat();
        columns.extend_from_slice(self.live.columns());
        for number in 1..=self.playback.followed.len() {
            columns.extend(axes(format!("point.{number}.displacement"), "m"));
        }
        self.playback.columns = columns.into();
        (self.playback.seen.at, self.playback.sampled) = (None, None);
    }

    fn show_another(&mut self, view: ViewTable, sent: Instant) {
        let (before, now) = (Surface::of(&self.playback.view), Surface::of(&view));
        self.playback.view = view;
        self.show_as_viewed();
        if before != now {
            self.playback.record(self.live.simulation.is_evaluated(), sent, Done::Surface(now));
            if let Err(message) = self.renew_subject() {
                self.fail(message);
            }
        }
    }

    fn show_as_viewed(&mut self) {
        let (scene, playback) = (&self.world.scene, &mut self.playback);
        self.hidden = self.world.hidden(&playback.view);
        self.live.show(&scene.shown_as(&playback.view, 1.0));
        let part = playback.view.component.map(|part| format!(":{}", part.word())).unwrap_or_default();
        playback.field = scene.field_of(&playback.view).map(|field| format!("{}{part}", field.name()));
        playback.seen.at = None;
    }

    fn renew_subject(&mut self) -> Result<(), String> {
        let mesh = self.live.mesh().map_err(|failure| failure.message)?;
        self.subject = Arc::new(Subject::new(&visible(mesh, &self.hidden)));
        self.playback.followed.iter_mut().for_each(Followed::forget_shown);
        self.find_movable();
        Ok(())
    }

    /// Finds what can be taken hold of, and what will move by itself.
    fn find_movable(&mut self) {
        self.ways = Arc::new(self.live.ways());
        let corners: Vec<u32> = self.subject.triangles().map(|corners| corners[0]).collect();
        self.movable = corners.iter().map(|&corner| self.live.is_movable(corner)).collect();
        // Jaws are two things and one tool.
        let mut known = BTreeSet::new();
        let mut is_new = |triangle: &u32| {
            let thing = self.live.thing_of(corners[*triangle as usize]);
            thing.is_some_and(|thing| known.insert(thing.tool().to_owned()))
        };
        let movable = self.subject.things().into_iter().filter(|&thing| self.movable[thing as usize]);
        self.tool_triangles = movable.filter(|triangle| is_new(triangle)).collect();
    }

    fn step(&mut self) {
        let (started, playback) = (Instant::now(), &mut self.playback);
        playback.owed = playback.owed.saturating_sub(1);
        if playback.failure.is_some() {
            playback.owed = 0;
            return;
        }
        let left = (playback.pace.goal() - self.live.simulation.time()) / self.world.step();
        let simulation = &mut self.live.simulation;
        let advanced = match simulation.on_device().filter(|_| playback.is_going()) {
            Some(mut device) => device.advance_without_read_back(left.ceil().max(1.0) as u64, FRAME / 2),
            None => simulation.step(1),
        };
        match advanced {
            Ok(steps) => {
                playback.steps += steps;
                playback.batch = (playback.batch.0 + steps, playback.batch.1 + started.elapsed());
                playback.feel();
                self.keep_sound();
                self.playback.hold.follow(&mut self.live);
                if !self.on_device && self.is_sample_due() {
                    self.sample();
                }
            }
            // Nobody looks any more.
            Err(failure) if failure.is_interrupted() => {}
            Err(failure) => self.go_back(failure),
        }
        let playback = &mut self.playback;
        if playback.pace.goal() - self.live.simulation.time() > BEHIND * playback.pace.speed {
            playback.pace.anchor = (Instant::now(), self.live.simulation.time());
        }
    }

    /// Keeps the state where one is due.
    fn keep_sound(&mut self) {
        let (playback, simulation) = (&self.playback, &mut self.live.simulation);
        if !self.sound.is_due(playback.steps, self.world.step()) {
            return;
        }
        // A device that fails tells so in the next step.
        let Ok(state) = simulation.state() else { return };
        let moves = playback.recording.as_ref().map_or(0, |recording| recording.moves.len());
        let sound = Sound { state, steps: playback.steps, hold: playback.hold.clone(), moves };
        let nodes = self.world.participants.iter().map(|part| part.built.model.node_count()).sum();
        self.sound.keep(sound, nodes);
    }

    /// After a step that failed: goes back to a state before it and halves the steps there, where no hand has done anything and shorter steps
    /// may avoid the failure; else hands let go there, or the run stays where it is.
    fn go_back(&mut self, failure: Failure) {
        let broken = self.live.simulation.time();
        let world = Arc::clone(self.live.simulation.world());
        let untouched = world.shorter_steps_may_avoid(&failure).then(|| self.sound.untouched()).flatten();
        let halved = untouched.and_then(|sound| sound.state.halve_steps(&world).then(|| sound.clone()));
        let message = failure.message;
        if let Some(time) = halved.and_then(|sound| self.restore(sound)) {
            self.playback.record(false, Instant::now(), Done::Halve);
            self.playback.note =
                Some(format!("the run went back to t = {} s and halved its steps: {message}", number(time)));
            return;
        }
        let Some(time) = self.sound.take().and_then(|sound| self.restore(sound)) else {
            return self.fail(message);
        };
        let playback = &mut self.playback;
        if let Some(recording) = &mut playback.recording {
            recording.breaks.push(Break { times: [broken, time], message: message.clone() });
        }
        playback.breaks += 1;
        playback.note =
            Some(format!("the hand let go, and the run went back to t = {} s: {message}", number(time)));
    }

    /// Halves the steps, as the run did that is replayed.
    fn halve(&mut self) {
        // A device that fails tells so in the next step.
        if self.live.halve_steps().is_ok() {
            self.playback.hold.hold_on(&mut self.live);
            self.playback.record(false, Instant::now(), Done::Halve);
        }
    }

    /// As a user wants it: to a state that is still kept.
    fn go_back_before(&mut self, steps: u64) {
        let sound = self.sound.before(steps, self.world.step());
        if let Some(time) = sound.and_then(|sound| self.restore(sound)) {
            let playback = &mut self.playback;
            let oldest =
                if playback.steps > steps { ", the oldest state that is kept: R starts anew" } else { "" };
            playback.failure = None;
            playback.note = Some(format!("the run went back to t = {} s{oldest}", number(time)));
        }
    }

    /// Restores a state, releases the hands and continues the recording. Returns the time [s] of the state; `None` if the stepper rejects it.
    fn restore(&mut self, Sound { state, steps, hold, moves }: Sound) -> Option<f64> {
        self.live.restore(state).ok()?;
        let playback = &mut self.playback;
        (playback.hold, playback.steps, playback.owed) = (hold, steps, 0);
        playback.waiting.clear();
        let time = self.live.simulation.time();
        if let Some(recording) = &mut playback.recording {
            recording.moves.truncate(moves);
        }
        for which in Which::BOTH {
            if playback.hold.holds(which) {
                playback.hold.take(which, &Hand::Release, &self.subject, &mut self.live);
                playback.record(false, Instant::now(), Done::by(which, Hand::Release));
            }
        }
        playback.pace.anchor(time);
        (playback.seen.at, playback.sampled) = (None, None);
        Some(time)
    }

    /// Whether the instant is one of those that are sampled: they lie as far apart however a run is played.
    fn is_sample_due(&self) -> bool {
        let every = (SAMPLED / self.world.step()).round().max(1.0) as u64;
        self.playback.steps.is_multiple_of(every)
    }

    /// Samples the instant, once.
    fn sample(&mut self) {
        if self.playback.sampled == Some(self.playback.steps) {
            return;
        }
        if let Err(failure) = self.live.simulation.evaluate(Wanted::Everything) {
            return self.go_back(failure);
        }
        let playback = &mut self.playback;
        let held: Vec<_> = playback.hold.shown(&self.live).collect();
        let mut values = Vec::with_capacity(playback.columns.len());
        for hand in playback.hold.hands() {
            values.extend(hand.and_then(|at| held.get(at)).map_or([0.0; 3], |[_, force]| *force));
        }
        self.live.sample(&mut values);
        for followed in &playback.followed {
            values.extend((followed.now(&self.live, &[]).place - followed.rest()).iter());
        }
        playback.sampled = Some(playback.steps);
        let time = self.live.simulation.time();
        // Nobody may read them any more.
        let _ = playback.samples.send(Sample { time, columns: Arc::clone(&playback.columns), values });
    }

    /// Looks at the instant in ordinary memory.
    fn inspect(&mut self) {
        let mut broken = None;
        let playback = &mut self.playback;
        let seen = &mut playback.seen;
        match self.live.mesh() {
            Ok(mesh) => {
                seen.points = deformed_points(mesh);
                seen.values =
                    playback.field.as_deref().and_then(|f| nodal_values(mesh, f)).unwrap_or_default();
                let contacts = playback.view.contacts.then(|| contact_forces(mesh, &seen.points));
                seen.contacts = contacts.flatten().unwrap_or_default();
                let critical = || critical_cell(&visible(mesh, &self.hidden));
                seen.critical = playback.view.critical.then(critical).flatten().map(|(cell, _)| cell);
                seen.energies = self.live.simulation.energies();
                let gaps = self.live.simulation.instants().filter_map(|now| now.least_gap());
                seen.least_gap = gaps.reduce(f64::min);
                let efforts = self.live.simulation.instants().filter_map(|now| now.effort());
                seen.unconverged = efforts.map(|effort| effort.unconverged).sum();
            }
            // The last good picture stays.
            Err(failure) => broken = Some(failure),
        }
        if let Some(failure) = broken {
            self.go_back(failure);
        }
        let playback = &mut self.playback;
        let seen = &mut playback.seen;
        seen.held.clear();
        seen.held.extend(playback.hold.shown(&self.live));
        seen.hands = playback.hold.hands();
        seen.followed.clear();
        seen.followed.extend(playback.followed.iter().map(|own| own.now(&self.live, &seen.values)));
        seen.marks = if playback.marked { marks(self.world, &self.live) } else { Vec::new() };
        seen.number += 1;
        seen.at = Some(Instant::now());
    }

    /// Brings the points that are drawn from the device to the instant; `inspected` where their values are new.
    fn place(&mut self, inspected: bool) -> Option<DevicePoints> {
        let playback = &mut self.playback;
        let value = point_value(playback.field.as_deref());
        let given = (inspected && value == PointValue::Given)
            .then(|| playback.seen.values.iter().map(|&value| drawn_value(value)).collect::<Vec<_>>());
        match self.live.place(value, given.as_deref())? {
            Ok(points) => Some(points),
            Err(failure) => {
                playback.failure.get_or_insert(failure.message);
                None
            }
        }
    }

    /// Hands the instant over.
    fn show(&mut self, frames: &mut triple_buffer::Input<Frame>) {
        let started = Instant::now();
        self.playback.shown = started;
        let playback = &self.playback;
        // Obstacles and tools are moved in ordinary memory.
        let is_there =
            self.on_device && self.world.participants.iter().all(|part| part.built.contacts.is_none());
        let inspects = !is_there || playback.in_memory || !playback.is_going() || playback.seen.is_old();
        if inspects {
            self.inspect();
            let stands_still = !self.playback.is_going() && self.playback.owed == 0;
            if self.on_device || stands_still || self.is_sample_due() {
                self.sample();
            }
        }
        let on_device = if is_there { self.place(inspects) } else { None };
        let playback = &mut self.playback;
        let frame = frames.input_buffer_mut();
        if frame.inspections != playback.seen.number {
            frame.inspections = playback.seen.number;
            frame.points.clone_from(&playback.seen.points);
            frame.values.clone_from(&playback.seen.values);
            frame.energies = playback.seen.energies;
            (frame.least_gap, frame.unconverged) = (playback.seen.least_gap, playback.seen.unconverged);
            frame.held.clone_from(&playback.seen.held);
            frame.hands = playback.seen.hands;
            frame.contacts.clone_from(&playback.seen.contacts);
            frame.marks.clone_from(&playback.seen.marks);
            frame.followed.clone_from(&playback.seen.followed);
        }
        let device = self.world.device();
        frame.read_backs = device.map_or(0, |device| device.read_backs());
        frame.on_device = on_device;
        let (steps, wall) = std::mem::take(&mut playback.batch);
        if steps > 0 {
            playback.step_seconds = wall.as_secs_f64() / steps as f64;
        }
        frame.number = playback.frames;
        frame.subject = self.subject.clone();
        frame.ways = Arc::clone(&self.ways);
        frame.movable = Arc::clone(&self.movable);
        frame.tool_triangles = Arc::clone(&self.tool_triangles);
        frame.tools = playback.hold.tools().map(|tool| tool.map(str::to_owned));
        frame.critical = playback.seen.critical;
        frame.time = self.live.simulation.time();
        frame.steps = playback.steps;
        frame.playing = playback.is_going();
        frame.steps_a_frame = steps;
        frame.step_seconds = playback.step_seconds;
        frame.real_time_factor = if frame.playing { playback.pace.factor(frame.time) } else { 0.0 };
        let step = if playback.steps > 0 { frame.time / playback.steps as f64 } else { self.world.step() };
        frame.possible_factor = if playback.step_seconds > 0.0 { step / playback.step_seconds } else { 0.0 };
        frame.input_lag = playback.input_lag;
        frame.breaks = playback.breaks;
        frame.numbers.clone_from(&playback.numbers);
        frame.refusals = playback.refusals;
        frame.failure.clone_from(&playback.failure);
        frame.note.clone_from(&playback.note);
        playback.prepared = started.elapsed();
        frame.prepare_seconds = playback.prepared.as_secs_f64();
        playback.frames += 1;
        frames.publish();
    }
}
