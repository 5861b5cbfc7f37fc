//! `pliant haptics`: a tool of a scene in the hand of a haptic device, or driven by a recorded trace. The
//! scene steps in real time. After each period its contact becomes a local model. The model holds the tangent
//! planes of the tool at the nearest points of the surfaces that it can touch. It also holds the mean force
//! of the period at its mean place, and the compliance estimated from the last periods.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use nalgebra::{Isometry3, Vector3};
use pliant_format::Scene;
use pliant_haptics::coupling::Coupling;
use pliant_haptics::error::HapticsError;
use pliant_haptics::estimate::Estimate;
use pliant_haptics::guard::Guard;
use pliant_haptics::hand::Hand;
use pliant_haptics::link::Link;
use pliant_haptics::model::{LocalModel, MOST_PLANES, Plane};
use pliant_haptics::renderer::Settings;
use pliant_haptics::replay::Replay;
use pliant_haptics::statistics::Spread;
use pliant_haptics::thread::{Haptics as Thread, Report};
use pliant_haptics::trace::Trace;
use pliant_scene::World;
use pliant_sim::contact::touch::{With, lattice};
use pliant_sim::{Frame, Simulation, SimulationState, StopFlag};

use crate::SUCCESS;
use crate::arguments::Haptics;
use crate::prepare::prepare;
use crate::report::{Failure, say};
use crate::signals;

/// Bounds of the tissue's stiffness at a tool [N/m].
const STIFFNESS: [f64; 2] = [50.0, 5000.0];
/// Distance [m] from the tool up to which points of a surface become planes: farther than a hand goes in some
/// periods.
const REACH: f64 = 0.02;
/// Time [s] in which the tool goes to the first pose of a trace, before this begins.
const APPROACH: f64 = 0.5;
/// Speeds [m/s], [rad/s] at which the tool follows the hand at most: a thrust must not carry it through
/// tissue within a step.
const FASTEST: [f64; 2] = [0.5, 20.0];
/// The longest lag [s] behind real time that is caught up with.
const CATCHES_UP: f64 = 0.1;
/// Simulated time [s] between states that are kept, and how many are.
const KEPT: (f64, usize) = (0.05, 6);
/// Failures in a row, back at the start of the session, that end it.
const MOST_FAILURES: usize = 100;
/// Corners and points of a face that become planes.
const FACE_PARTS: usize = 3;

/// The points of all surfaces that a tool can touch.
struct Around<'a> {
    tool: &'a str,
    /// Weights of the corners of a face.
    samples: Vec<[f64; 3]>,
}

/// A period of the simulation.
struct Period {
    /// Mean place of the tool [m].
    place: Vector3<f64>,
    /// Mean force on it [N].
    force: Vector3<f64>,
    friction: f64,
    planes: Vec<Plane>,
}

pub fn haptics(arguments: &Haptics) -> Result<u8, Failure> {
    let trace = arguments.replay.as_deref().map(Trace::of_file).transpose().map_err(refused)?;
    let settings = settings(arguments);
    let world = prepare(&arguments.scene, &arguments.overrides)?;
    let tool = tool(&world.scene, arguments.tool.as_deref())?;
    let threads = world.scene.run.threads as usize;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|error| Failure::plain(error, "try fewer `threads`"))?;
    pool.install(|| run(arguments, &world, &tool, trace, settings))
}

fn refused(error: HapticsError) -> Failure {
    Failure::plain(error, "`pliant haptics --help` has examples")
}

fn settings(arguments: &Haptics) -> Settings {
    let coupling = Coupling { stiffness: arguments.stiffness, damping: arguments.damping };
    let guard = (!arguments.no_guard).then(Guard::default);
    let (force_limit, most_change) = (arguments.force_limit, Some(arguments.most_change));
    Settings { coupling, guard, force_limit, most_change, ..Settings::default() }
}

/// Returns the tool in the hand: the named tool, or the only one.
fn tool(scene: &Scene, asked: Option<&str>) -> Result<String, Failure> {
    let names: Vec<&str> = scene.tools.iter().map(|(name, _)| name.as_str()).collect();
    let listed = || names.join(", ");
    match (asked, &names[..]) {
        (Some(asked), names) if names.contains(&asked) => Ok(asked.to_owned()),
        (None, [only]) => Ok((*only).to_owned()),
        (_, []) => Err(Failure::plain("the scene has no tool", "add a `[tool.NAME]` and a contact with it")),
        (Some(asked), _) => {
            Err(Failure::plain(format!("there is no tool `{asked}`"), format!("the tools are {}", listed())))
        }
        (None, _) => Err(Failure::plain(
            "the scene has several tools",
            format!("choose one of {} with `--tool`", listed()),
        )),
    }
}

fn run(
    arguments: &Haptics,
    world: &World,
    tool: &str,
    trace: Option<Trace>,
    settings: Settings,
) -> Result<u8, Failure> {
    let mut simulation = world.simulation().map_err(failed)?;
    if simulation.frame().map_err(failed)?.tool(tool).is_none() {
        return Err(Failure::plain(
            format!("nothing touches `{tool}`"),
            "add a contact with it, solved by `explicit` on the CPU",
        ));
    }
    let thread = start(arguments, settings, trace, &mut simulation, tool)?;
    let pace = Pace::new(&simulation, arguments.rate);
    let stop = signals::stop();
    let mut session = Session {
        around: Around { tool, samples: face_samples() },
        thread,
        pace,
        estimate: Estimate::new(settings.coupling.stiffness, STIFFNESS),
        snapshots: Snapshots::new(&mut simulation).map_err(failed)?,
        pressed: None,
        simulation,
    };
    let ended = session.run(stop)?;
    session.finish(settings)?;
    match ended {
        Some(failure) => {
            eprintln!("error: {failure}");
            Ok(1)
        }
        None => Ok(SUCCESS),
    }
}

fn failed(failure: pliant_sim::Failure) -> Failure {
    Failure::plain(failure.message, "")
}

/// Starts the haptic thread with a device, or with a trace after the tool has reached the trace's first pose.
fn start(
    arguments: &Haptics,
    settings: Settings,
    trace: Option<Trace>,
    simulation: &mut Simulation,
    tool: &str,
) -> Result<Thread, Failure> {
    let thread = match trace {
        Some(trace) => {
            let [first, _] = trace.times();
            let arrival = simulation.drive(tool, trace.at(first), APPROACH).map_err(failed)?;
            simulation.run(arrival, |_| ()).map_err(failed)?;
            let hand = arguments.hand.then(Hand::default);
            Thread::start(settings, Replay::new(trace, Duration::from_millis(1), hand))
        }
        None => {
            let link = Link::open(arguments.listen, arguments.remote).map_err(refused)?;
            eprintln!("listening at {}; Ctrl-C ends it", link.address());
            Thread::start(settings, link)
        }
    };
    thread.map_err(refused)
}

/// A tool in a hand.
struct Session<'a> {
    simulation: Simulation,
    around: Around<'a>,
    thread: Thread,
    pace: Pace,
    estimate: Estimate,
    snapshots: Snapshots,
    /// The model of the largest force so far.
    pressed: Option<LocalModel>,
}

impl Session<'_> {
    /// Steps until the device or the user ends it; the failure that does, where it can't go back to a state
    /// before.
    fn run(&mut self, stop: &StopFlag) -> Result<Option<pliant_sim::Failure>, Failure> {
        while !self.thread.is_over() && !stop.is_asked() {
            let state = self.thread.state();
            let goal = (state.ticks > 0).then_some(&state.proxy);
            match step(&mut self.simulation, &self.around, goal, self.pace.until()) {
                Ok(period) => self.publish(&period)?,
                Err(failure) => {
                    if !self.snapshots.go_back(&mut self.simulation) {
                        return Ok(Some(failure));
                    }
                    self.pace.go_back(&self.simulation);
                    eprintln!(
                        "note: the simulation went back to t = {:.3} s: {}",
                        self.simulation.time(),
                        failure.message
                    );
                }
            }
        }
        Ok(None)
    }

    /// Publishes the contact of a period, and waits until this ends.
    fn publish(&mut self, period: &Period) -> Result<(), Failure> {
        self.estimate.add(period.place, period.force);
        let model = local_model(period, &self.estimate, self.pace.done()).map_err(refused)?;
        let deeper = |before: &LocalModel| model.force().norm() > before.force().norm();
        if self.pressed.as_ref().is_none_or(deeper) {
            self.pressed = Some(model.clone());
        }
        self.thread.publish(model);
        self.snapshots.keep(&mut self.simulation).map_err(failed)?;
        self.pace.wait();
        Ok(())
    }

    /// Ends the thread and prints a report.
    fn finish(self, settings: Settings) -> Result<(), Failure> {
        let Self { mut simulation, around, mut thread, pace, estimate, snapshots, pressed } = self;
        let device: [f64; 3] = thread.state().force.into();
        let report = thread.finish().map_err(refused)?;
        say(words(&report, &pace, &estimate))?;
        if snapshots.failures > 0 {
            say(format_args!("went back        {} times", snapshots.failures))?;
        }
        if let Some(now) = simulation.frame().ok().and_then(|frame| frame.tool(around.tool)) {
            let (device, simulation) = (vector(device), vector(now.force));
            say(format_args!("last force       device {device}, simulation {simulation} N"))?;
        }
        if let Some(model) = pressed.filter(|model| model.force().norm() > 0.0) {
            say(stiffest(&model, settings).map_err(refused)?)?;
        }
        Ok(())
    }
}

/// Points of a face, by the weights of its corners; the corners, too.
fn face_samples() -> Vec<[f64; 3]> {
    let mut samples = lattice(FACE_PARTS);
    samples.extend([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    samples
}

/// The simulation until a time [s], with the tool on its way to a goal.
fn step(
    simulation: &mut Simulation,
    around: &Around,
    goal: Option<&Isometry3<f64>>,
    until: f64,
) -> Result<Period, pliant_sim::Failure> {
    if let Some(goal) = goal {
        let time = (until - simulation.time()).max(0.0);
        let goal = simulation.tool(around.tool).map_or(*goal, |now| on_the_way(&now.pose, goal, time));
        simulation.drive(around.tool, goal, time)?;
    }
    let (mut place, mut force, mut count) = (Vector3::zeros(), Vector3::zeros(), 0.0);
    // The first instant is the last one of the period before.
    let begin = simulation.time() + 0.5 * simulation.step_length();
    simulation.run(until, |frame| {
        if let Some(now) = frame.tool(around.tool).filter(|_| frame.time() > begin) {
            place += now.pose.translation.vector;
            force += Vector3::from(now.force);
            count += 1.0;
        }
    })?;
    let frame = simulation.frame()?;
    let Some(now) = frame.tool(around.tool) else {
        return Err(pliant_sim::Failure::input(&"the tool has left the simulation"));
    };
    let (place, force) = match count > 0.0 {
        true => (place / count, force / count),
        false => (now.pose.translation.vector, Vector3::from(now.force)),
    };
    let back = place - now.pose.translation.vector;
    let (planes, friction) = around.planes(&frame, &back);
    Ok(Period { place, force, friction, planes })
}

/// Pose that a tool reaches on its way to a goal in a time [s].
fn on_the_way(now: &Isometry3<f64>, goal: &Isometry3<f64>, time: f64) -> Isometry3<f64> {
    let way = (goal.translation.vector - now.translation.vector).norm();
    let turn = now.rotation.angle_to(&goal.rotation);
    let part = (FASTEST[0] * time / way).min(FASTEST[1] * time / turn);
    if part >= 1.0 { *goal } else { now.try_lerp_slerp(goal, part, 1e-9).unwrap_or(*now) }
}

/// States to go back to.
struct Snapshots {
    start: SimulationState,
    /// Times [s] and states, the newest last.
    states: VecDeque<(f64, SimulationState)>,
    /// Failures so far, and successive failures that went back to the start.
    failures: usize,
    in_a_row: usize,
}

impl Snapshots {
    fn new(simulation: &mut Simulation) -> Result<Self, pliant_sim::Failure> {
        Ok(Self { start: simulation.state()?, states: VecDeque::new(), failures: 0, in_a_row: 0 })
    }

    /// Keeps the state where one is due.
    fn keep(&mut self, simulation: &mut Simulation) -> Result<(), pliant_sim::Failure> {
        let (every, most) = KEPT;
        if self.states.back().is_some_and(|(time, _)| simulation.time() < time + every) {
            return Ok(());
        }
        if self.states.len() == most {
            self.states.pop_front();
        }
        self.states.push_back((simulation.time(), simulation.state()?));
        self.in_a_row = 0;
        Ok(())
    }

    /// Goes back to the newest state, which is not gone back to again, or else to the start; whether it
    /// could.
    fn go_back(&mut self, simulation: &mut Simulation) -> bool {
        let newest = self.states.pop_back().map(|(_, state)| state);
        self.in_a_row += usize::from(newest.is_none());
        self.failures += 1;
        self.in_a_row <= MOST_FAILURES
            && simulation.restore(newest.unwrap_or_else(|| self.start.clone())).is_ok()
    }
}

impl Around<'_> {
    /// The nearest tangent planes of the tool, for a place that is `back` [m] from where it is, and the
    /// largest friction.
    fn planes(&self, frame: &Frame, back: &Vector3<f64>) -> (Vec<Plane>, f64) {
        let mut planes = Vec::new();
        let mut most = 0.0_f64;
        for (part, now) in frame.parts() {
            let Some(contacts) = part.method.contacts() else { continue };
            for contact in &contacts.contacts {
                let With::Rigid(index) = contact.with else { continue };
                let rigid = &contacts.rigids[index];
                if rigid.tool() != self.tool {
                    continue;
                }
                let friction = contact.touch.friction;
                most = most.max(friction);
                let stance = now.stance(index, rigid);
                let place = |node: u32| {
                    let node = node as usize;
                    Vector3::from(part.model.rest[node]) + Vector3::from(now.displacement(node))
                };
                for face in &contact.surface.faces {
                    let corners = face.map(place);
                    let size = (corners[1] - corners[0]).norm().max((corners[2] - corners[0]).norm());
                    if rigid.near(&stance, &corners[0]).distance > REACH + size {
                        continue;
                    }
                    for weights in &self.samples {
                        let point: Vector3<f64> = corners.iter().zip(weights).map(|(x, &w)| x * w).sum();
                        let near = rigid.near(&stance, &point);
                        let gap = near.distance - contact.touch.offset;
                        if gap < REACH {
                            // The tool goes away from the point against the direction in which its distance
                            // grows.
                            let normal = -near.normal;
                            planes.push(Plane { normal, gap: gap + normal.dot(back), friction });
                        }
                    }
                }
            }
        }
        planes.sort_by(|a, b| a.gap.total_cmp(&b.gap));
        planes.truncate(MOST_PLANES);
        (planes, most)
    }
}

/// The contact of a period, for the time [s] that it took.
fn local_model(period: &Period, estimate: &Estimate, time: f64) -> Result<LocalModel, HapticsError> {
    let nearest = period.planes.first().map_or(Vector3::z(), |plane| plane.normal);
    let normal = period.force.try_normalize(1e-9).unwrap_or(nearest);
    let compliance = estimate.compliance(&normal);
    LocalModel::touching(period.place, period.force, compliance, period.friction, &period.planes, time)
}

/// Keeps the simulation to the clock.
struct Pace {
    /// Simulated time [s] of a period.
    period: f64,
    begun: Instant,
    last: Instant,
    due: f64,
    from: f64,
    /// Time [s] that is not caught up with.
    lost: f64,
    periods: Spread,
}

impl Pace {
    fn new(simulation: &Simulation, rate: f64) -> Self {
        let now = Instant::now();
        let period = (1.0 / rate).max(simulation.step_length());
        Self {
            period,
            begun: now,
            last: now,
            due: 0.0,
            from: simulation.time(),
            lost: 0.0,
            periods: Spread::default(),
        }
    }

    /// The simulated time [s] at the end of this period.
    fn until(&self) -> f64 {
        self.from + self.due + self.period
    }

    /// Counts on from where the simulation has gone back to.
    fn go_back(&mut self, simulation: &Simulation) {
        self.from = simulation.time() - self.due;
    }

    /// The time [s] from the last model to the one that is done now.
    fn done(&mut self) -> f64 {
        let now = Instant::now();
        let time = (now - self.last).as_secs_f64();
        self.last = now;
        self.periods.add(time);
        time.clamp(1e-3, 1.0)
    }

    /// Waits for the end of the period.
    fn wait(&mut self) {
        self.due += self.period;
        let left = self.due - self.begun.elapsed().as_secs_f64();
        if left > 0.0 {
            std::thread::sleep(Duration::from_secs_f64(left));
        }
        // A larger delay is lost: steps that catch up move the tool faster than it may go.
        let lost = -left - CATCHES_UP;
        if lost > 0.0 {
            self.due += lost;
            self.from -= lost;
            self.lost += lost;
        }
    }
}

fn vector([x, y, z]: [f64; 3]) -> String {
    format!("({x:.3}, {y:.3}, {z:.3})")
}

fn words(report: &Report, pace: &Pace, estimate: &Estimate) -> String {
    let (simulated, wall) = (pace.due - pace.lost, (pace.last - pace.begun).as_secs_f64());
    format!(
        "{report}\nsimulation       {simulated:.2} s in {wall:.2} s, {:.2} × real time; a model each {}\ntissue           {:.0} N/m at the tool",
        simulated / wall.max(1e-9),
        pace.periods,
        estimate.stiffness()
    )
}

/// Finds the stiffest coupling on the model that was pressed most: the limit of the theory, and the limit of
/// a simulated device.
fn stiffest(model: &LocalModel, settings: Settings) -> Result<String, HapticsError> {
    let hand = Hand::default();
    // The time ahead damps as K times that, so it counts as a delay does.
    let limit = Coupling::limit(hand.friction, settings.coupling.damping, settings.period, settings.ahead);
    let free = Settings { guard: None, soft_start: 0.0, most_change: None, ..settings };
    let found = hand.stiffest(model, free, 0.01)?;
    let here = if found > 0.9e6 { "1e6 N/m or more".into() } else { format!("{found:.0} N/m") };
    Ok(format!(
        "stiffest coupling {here} where the tissue was pressed most, without guard; {limit:.0} N/m is passive on any object (device friction {} N s/m)",
        hand.friction
    ))
}
