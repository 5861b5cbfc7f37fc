//! Replays of recorded runs. A replay repeats the actions before the same steps, so it gives the same bits.
//! In real time it moves the mouse as fast as the user did, so that the lag can be measured.

use std::time::{Duration, Instant};

use pliant_format::tables::ViewTable;
use pliant_geometry::Vector3;
use pliant_picture::{Subject, visible};
use pliant_run::Live;
use pliant_scene::World;
use pliant_sim::{SimulationState, StopFlag};
use serde::Serialize;

use crate::hand::{Hand, Hold, Which};
use crate::parameters::{Number, with_numbers};
use crate::recording::{Break, Done, Move, Recording, Surface};
use crate::session::{FRAME, Order, Session};

/// Result of a replay.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Replayed {
    /// Simulated time [s].
    pub time: f64,
    /// A fingerprint of the state.
    pub fingerprint: u64,
    /// The largest force of a hand [N].
    pub largest_force: f64,
    /// The point that a hand holds in the end, the first one where both do [m] and the force on it [N].
    pub held: Option<[[f64; 3]; 2]>,
    /// Force [N] of each constraint in the end.
    pub reactions: Vec<[f64; 3]>,
    /// Pulls that broke the run when it was recorded.
    pub breaks: Vec<Break>,
}

/// Times from a movement of the mouse to the end of the first step that felt it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Lags {
    /// Moves that a step has felt.
    pub moves: usize,
    /// Wall time from a move to the end of the first step in which it acted, of the middle one [s].
    pub median: f64,
    /// The longest [s].
    pub worst: f64,
    /// The middle one in frames of 1/60 s.
    pub median_frames: f64,
    /// The longest in frames.
    pub worst_frames: f64,
}

impl Lags {
    /// Returns the lags of a recording.
    pub fn of(recording: &Recording) -> Self {
        let mut lags: Vec<f64> = recording.moves.iter().filter_map(|then| then.lag).collect();
        lags.sort_by(f64::total_cmp);
        let median = lags.get(lags.len() / 2).copied().unwrap_or_default();
        let worst = lags.last().copied().unwrap_or_default();
        let frames = |lag: f64| lag / FRAME.as_secs_f64();
        Self { moves: lags.len(), median, worst, median_frames: frames(median), worst_frames: frames(worst) }
    }
}

fn stopped() -> String {
    "stopped before the end of the recording".into()
}

/// Repeats a recording in real time, with each action at the wall time of the original. Returns a recording
/// of the replayed actions and their lags.
///
/// # Errors
/// If a world can't be made, the run fails, or a flag is asked for.
pub fn replay_in_real_time(
    world: &World,
    recording: &Recording,
    stop: &StopFlag,
) -> Result<Recording, String> {
    recording.check(world)?;
    let mut orders = Vec::new();
    for then in &recording.moves {
        let order = match &then.done {
            Done::Hand(hand) => Order::Hand(*hand),
            Done::Second(hand) => Order::Second(*hand),
            Done::Numbers(numbers) => {
                Order::Change(Box::new(with_numbers(&world.scene, numbers)?), numbers.clone())
            }
            Done::Surface(surface) => Order::Show(Box::new(surface.put_into(&world.scene.view))),
            Done::Halve => Order::Halve,
        };
        orders.push((Duration::try_from_secs_f64(then.seconds).unwrap_or_default(), order));
    }
    let mut session = Session::start(world.clone(), || ()).map_err(|error| error.to_string())?;
    session.order(Order::Record);
    session.order(Order::Play(true));
    let started = Instant::now();
    for (due, order) in orders {
        loop {
            if stop.is_asked() {
                return Err(stopped());
            }
            let left = due.saturating_sub(started.elapsed());
            if left.is_zero() {
                break;
            }
            std::thread::sleep(left.min(FRAME));
        }
        session.order(order);
    }
    // Until the last one is felt.
    std::thread::sleep(10 * FRAME);
    if let Some(failure) = &session.look().1.failure {
        return Err(failure.clone());
    }
    session.end().ok_or_else(|| "the solver's thread has ended".into())
}

/// Repeats a recording before the same steps.
///
/// # Errors
/// If the run can't continue.
pub fn replay(world: &World, recording: &Recording) -> Result<Replayed, String> {
    replay_until(world, recording, &StopFlag::default())
}

/// Runs like [`replay`], until a flag is set.
///
/// # Errors
/// If the run can't continue, or was stopped.
pub fn replay_until(world: &World, recording: &Recording, stop: &StopFlag) -> Result<Replayed, String> {
    recording.check(world)?;
    let mut replay =
        Replay { moves: &recording.moves, of: recording.steps, stop: stop.clone(), ..Replay::default() };
    let (mut now, mut before) = (world.clone(), None);
    loop {
        match replay.play(&now, before.take())? {
            Ended::Whole(replayed) => return Ok(Replayed { breaks: recording.breaks.clone(), ..replayed }),
            Ended::Change(snapshot, numbers) => {
                let next = with_numbers(&world.scene, numbers)?;
                before = Some((std::mem::replace(&mut now, next), snapshot.map(|snapshot| *snapshot)));
            }
        }
    }
}

/// State of a replay.
#[derive(Default)]
struct Replay<'r> {
    /// Actions that are still to come.
    moves: &'r [Move],
    steps: u64,
    /// Steps in all.
    of: u64,
    subject: Option<Subject>,
    /// The surface that is shown, if it is another one than the scene's.
    surface: Option<&'r Surface>,
    hold: Hold,
    largest_force: f64,
    /// Ends it.
    stop: StopFlag,
}

/// Returns the drawn mesh of a view.
fn subject_of(world: &World, view: &ViewTable, live: &mut Live) -> Result<Subject, String> {
    let mesh = live.mesh().map_err(|failure| failure.message)?;
    Ok(Subject::new(&visible(mesh, &world.hidden(view))))
}

enum Ended<'r> {
    /// Numbers are others from here on.
    Change(Option<Box<SimulationState>>, &'r [Number]),
    Whole(Replayed),
}

impl<'r> Replay<'r> {
    /// Continues to the next change of numbers, or to the end.
    fn play(
        &mut self,
        world: &World,
        from: Option<(World, Option<SimulationState>)>,
    ) -> Result<Ended<'r>, String> {
        let (mut live, _) = crate::session::enter(world, from)?;
        live.simulation.stop_on(&self.stop);
        if let Some(surface) = self.surface {
            live.show(&world.scene.shown_as(&surface.put_into(&world.scene.view), 1.0));
        }
        let subject = match self.subject.take() {
            Some(subject) => subject,
            None => subject_of(world, &world.scene.view, &mut live)?,
        };
        let subject = self.subject.insert(subject);
        self.hold.grip_again(&mut live);
        loop {
            while let Some((then, rest)) =
                self.moves.split_first().filter(|(then, _)| then.steps <= self.steps)
            {
                self.moves = rest;
                let mut by = |which, hand: &Hand| -> Result<(), String> {
                    if then.evaluated {
                        live.mesh().map_err(|failure| failure.message)?;
                    }
                    self.hold.take(which, hand, subject, &mut live);
                    Ok(())
                };
                match &then.done {
                    Done::Hand(hand) => by(Which::First, hand)?,
                    Done::Second(hand) => by(Which::Second, hand)?,
                    Done::Surface(surface) => {
                        self.surface = Some(surface);
                        let view = surface.put_into(&world.scene.view);
                        live.show(&world.scene.shown_as(&view, 1.0));
                        *subject = subject_of(world, &view, &mut live)?;
                    }
                    Done::Halve => {
                        live.halve_steps().map_err(|failure| failure.message)?;
                        self.hold.grip_again(&mut live);
                    }
                    Done::Numbers(numbers) if self.steps == 0 => return Ok(Ended::Change(None, numbers)),
                    Done::Numbers(numbers) => {
                        if then.evaluated {
                            live.mesh().map_err(|failure| failure.message)?;
                        }
                        let snapshot = live.simulation.state().map_err(|failure| failure.message)?;
                        return Ok(Ended::Change(Some(Box::new(snapshot)), numbers));
                    }
                }
            }
            if self.stop.is_asked() {
                return Err(stopped());
            }
            if self.steps >= self.of {
                return self.end(&mut live).map(Ended::Whole);
            }
            let next = self.moves.first().map_or(self.of, |then| then.steps.min(self.of));
            let steps = if self.hold.follows() { 1 } else { next - self.steps };
            self.steps += live.simulation.step(steps).map_err(|failure| failure.message)?;
            self.hold.follow(&mut live);
            let hands = self.hold.hands().into_iter().flatten().count();
            for [_, force] in self.hold.shown(&live).take(hands) {
                self.largest_force = self.largest_force.max(Vector3::from(force).norm());
            }
        }
    }

    fn end(&self, live: &mut Live) -> Result<Replayed, String> {
        let (time, fingerprint) = (live.simulation.time(), live.simulation.fingerprint());
        // Reactions belong to the instant at which forces are found.
        live.mesh().map_err(|failure| failure.message)?;
        Ok(Replayed {
            time,
            fingerprint,
            largest_force: self.largest_force,
            held: self.hold.shown(live).next().filter(|_| self.hold.hands() != [None; 2]),
            reactions: live.reactions(),
            breaks: Vec::new(),
        })
    }
}
