//! A scene played in real time on its own thread, and handed over frame by frame. Neither side waits for the
//! other. Orders go through a channel. The newest frame lies in one of three places, of which each side holds
//! one.

mod playback;
mod player;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use pliant_format::tables::ViewTable;
use pliant_geometry::Vector3;
use pliant_mechanics::Energies;
use pliant_picture::{Mark, PointForce, Subject};
use pliant_run::Live;
use pliant_scene::World;
use pliant_sim::gpu::DevicePoints;
use pliant_sim::{Failure, SimulationState, StopFlag};

use self::player::play;
use crate::followed::FollowedPoint;
use crate::hand::{Hand, Point, Which};
use crate::parameters::Number;
use crate::recording::Recording;
use crate::samples::Sample;

/// Wall time between frames.
pub(crate) const FRAME: Duration = Duration::from_micros(16_667);
/// Simulated time [s] from sample to sample; longer steps have one each.
const SAMPLED: f64 = 0.005;
/// Wall time from one writing of a recording to the next.
const WRITTEN: Duration = Duration::from_secs(1);
/// Wall time that the solver may fall behind before it gives up catching up.
const BEHIND: f64 = 0.1;

/// Orders of the window to the solver.
#[derive(Clone, Debug)]
pub enum Order {
    /// Plays or pauses.
    Play(bool),
    /// Plays a number of steps.
    Step(u64),
    /// Starts anew at rest.
    Reset,
    /// Goes back to the newest kept state with no more steps than this, and lets the hands go.
    Back(u64),
    /// Simulated seconds a second.
    Speed(f64),
    /// Changes the grip of the first hand, or a pin.
    Hand(Hand),
    /// Changes the grip of the second hand, or a pin.
    Second(Hand),
    /// Continues from the current state with another world, from the next step on. The numbers are those that
    /// differ from the file.
    Change(Box<World>, Vec<Number>),
    /// Turns the marks of constraints and loads in each frame on or off.
    Marks(bool),
    /// Follows a point.
    Probe(Point),
    /// Follows only the points that the scene names.
    ForgetProbes,
    /// Records the user's actions from this moment.
    Record,
    /// Records the user's actions into a file, written each second.
    RecordTo(PathBuf),
    /// Halves the steps.
    Halve,
    /// Shows another field, or another surface.
    Show(Box<ViewTable>),
    /// Brings every frame to ordinary memory where the state lies on a device, as a section needs it; or only
    /// some.
    Memory(bool),
    /// Ends.
    Quit,
}

/// An instant as the window shows it.
#[derive(Clone, Debug, Default)]
pub struct Frame {
    /// Number of earlier frames.
    pub number: u64,
    /// Drawn mesh: points and triangles at rest. Another surface has another subject.
    pub subject: Arc<Subject>,
    /// Paths of obstacles, tools and driven nodes [m], see [`Live::ways`].
    pub ways: Arc<Vec<Vector3>>,
    /// Simulated time [s].
    pub time: f64,
    /// Steps done.
    pub steps: u64,
    /// True if the run is playing.
    pub playing: bool,
    /// Points on the device where the state lies, at this instant, to be drawn from there; `None` of a state
    /// in ordinary memory.
    pub on_device: Option<DevicePoints>,
    /// Number of inspections so far. Points, values, energies and grips come from the last one. That is this
    /// instant, except on a device, where inspections are rare (`INSPECTION`).
    pub inspections: u64,
    /// Number of read-backs from the device so far.
    pub read_backs: u64,
    /// Positions [m].
    pub points: Vec<Vector3>,
    /// Values of the field that is shown; empty for none.
    pub values: Vec<f64>,
    /// Cell with the smallest stable step, if the view asks for it.
    pub critical: Option<u32>,
    /// Energies [J].
    pub energies: Energies,
    /// The least gap [m] in contacts with barriers; `None` where nothing is near.
    pub least_gap: Option<f64>,
    /// Steps that were taken though they had not converged.
    pub unconverged: u64,
    /// Point [m] and force on the body [N] of each hand that holds something, then of each pin.
    pub held: Vec<[[f64; 3]; 2]>,
    /// Index of each hand in [`Self::held`]; `None` for a hand that holds nothing.
    pub hands: [Option<usize>; 2],
    /// Forces of contacts on the nodes, if the view asks for them.
    pub contacts: Vec<PointForce>,
    /// Marks of constraints and loads, if the view asks for them.
    pub marks: Vec<Mark>,
    /// Points that the user follows, in the order in which they were picked.
    pub followed: Vec<FollowedPoint>,
    /// The tool that each hand holds.
    pub tools: [Option<String>; 2],
    /// True for each triangle of the subject that a hand can take: triangles of bodies and tools, but not of
    /// obstacles.
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
    /// Real-time factor if the solver did nothing but steps.
    pub possible_factor: f64,
    /// From a hand's move to the first step in which it acted [s], of the last one.
    pub input_lag: Option<f64>,
    /// Number of times that a pull broke the run, which then went back to an earlier state.
    pub breaks: u64,
    /// Numbers that differ from the file.
    pub numbers: Vec<Number>,
    /// Number of times that changed numbers broke the run at once. The run then continued with the earlier
    /// numbers.
    pub refusals: u64,
    /// Reason why the run can't continue: what happened, where, and what to try.
    pub failure: Option<String>,
    /// Further message for the user.
    pub note: Option<String>,
}

impl Frame {
    /// Returns the point [m] and the force on the body [N] of each pin.
    pub fn pins(&self) -> &[[[f64; 3]; 2]] {
        let hands = self.hands.iter().flatten().count();
        self.held.get(hands..).unwrap_or_default()
    }

    /// Returns the point [m] and the force on the body [N] of a hand.
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

/// Starts to play a world, if possible from the current state of another one. Returns true if it continues
/// from there.
///
/// # Errors
/// If a stepper can't be made.
pub(crate) fn enter(
    world: &World,
    from: Option<(World, Option<SimulationState>)>,
) -> Result<(Live, bool), String> {
    let message = |failure: Failure| failure.message;
    let world = Arc::new(world.clone());
    if let Some((before, Some(snapshot))) = from
        && let Some(live) = Live::go_on(&world, snapshot, &before).map_err(message)?
    {
        return Ok((live, true));
    }
    Ok((Live::new(&world).map_err(message)?, false))
}

impl Session {
    /// Starts the solver's thread for a scene, paused at first. `wake` is called after each frame.
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

    /// Sends an order. It is ignored if the solver has ended.
    pub fn order(&self, order: Order) {
        let _ = self.orders.send((Instant::now(), order));
    }

    /// Returns true if the newest frame is a new one, and the frame.
    pub fn look(&mut self) -> (bool, &Frame) {
        (self.frames.update(), self.frames.output_buffer())
    }

    /// Returns the samples since the last call, in the order in which they were taken.
    pub fn samples(&self) -> impl Iterator<Item = Sample> + '_ {
        self.samples.try_iter()
    }

    /// True if the solver's thread has ended.
    pub fn has_ended(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }
}

impl Session {
    /// Ends the session. Returns the actions since recording began or the last reset. `None` after a panic,
    /// whose message has been printed.
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
