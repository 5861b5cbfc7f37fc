//! Clock and state of a played session.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

use pliant_format::tables::ViewTable;
use pliant_run::Column;
use pliant_scene::World;
use pliant_sim::{State, StopFlag};

use super::{FRAME, WRITTEN};
use crate::device::Seen;
use crate::followed::Followed;
use crate::hand::Hold;
use crate::parameters::Number;
use crate::recording::{Done, Move, Recording, Surface};
use crate::samples::Sample;

/// Speed of the run: simulated time follows wall time from an anchor on.
pub(super) struct Pace {
    pub(super) speed: f64,
    pub(super) anchor: (Instant, f64),
    /// Wall and simulated time at the last frames, for the factor.
    pub(super) lately: Vec<(Instant, f64)>,
}

impl Pace {
    pub(super) fn new(time: f64) -> Self {
        Self { speed: 1.0, anchor: (Instant::now(), time), lately: Vec::with_capacity(64) }
    }

    pub(super) fn anchor(&mut self, time: f64) {
        self.anchor = (Instant::now(), time);
        self.lately.clear();
    }

    /// The simulated time [s] that it should be now.
    pub(super) fn goal(&self) -> f64 {
        self.anchor.1 + self.speed * self.anchor.0.elapsed().as_secs_f64()
    }

    /// Simulated over wall time of the last half second.
    pub(super) fn factor(&mut self, time: f64) -> f64 {
        let now = Instant::now();
        self.lately.retain(|(then, _)| now.duration_since(*then) < Duration::from_millis(500));
        self.lately.push((now, time));
        let (first, from) = self.lately[0];
        let wall = now.duration_since(first).as_secs_f64();
        if wall > 0.0 { (time - from) / wall } else { 0.0 }
    }
}

/// State of a run that lasts when it continues as another world.
pub(super) struct Playback {
    pub(super) hold: Hold,
    /// Ends a step that takes long.
    pub(super) stop: StopFlag,
    /// Current view, and the surface of the scene's view.
    pub(super) view: ViewTable,
    pub(super) usual: Surface,
    /// The field that is shown, with its component.
    pub(super) field: Option<String>,
    pub(super) steps: u64,
    pub(super) breaks: u64,
    pub(super) failure: Option<String>,
    pub(super) note: Option<String>,
    pub(super) pace: Pace,
    pub(super) playing: bool,
    /// Single steps that were requested but not done yet.
    pub(super) owed: u64,
    /// Actions that no step has felt yet: wall time, number of steps after which the action acts, and index
    /// in the recording.
    pub(super) waiting: Vec<(Instant, u64, usize)>,
    pub(super) input_lag: Option<f64>,
    /// Since the last frame.
    pub(super) batch: (u64, Duration),
    pub(super) step_seconds: f64,
    pub(super) frames: u64,
    pub(super) shown: Instant,
    /// Wall time that the last frame took to prepare.
    pub(super) prepared: Duration,
    pub(super) recording: Option<Recording>,
    /// The bodies that are recorded.
    pub(super) of: u64,
    /// File of the recording, with the wall time and the number of moves and steps when it was last written.
    pub(super) file: Option<(PathBuf, Instant, (usize, u64))>,
    /// Wall time of the first recorded move.
    pub(super) started: Option<Instant>,
    /// World to continue as, with its numbers that differ from the file.
    pub(super) change: Option<(Box<World>, Vec<Number>)>,
    pub(super) numbers: Vec<Number>,
    pub(super) refusals: u64,
    /// Reason why changed numbers are refused.
    pub(super) refused: Option<String>,
    pub(super) followed: Vec<Followed>,
    pub(super) columns: Arc<[Column]>,
    pub(super) samples: Sender<Sample>,
    /// Steps done at the last sample.
    pub(super) sampled: Option<u64>,
    pub(super) seen: Seen,
    /// True if marks of constraints and loads are needed.
    pub(super) marked: bool,
    /// True if every frame is copied to ordinary memory.
    pub(super) in_memory: bool,
}

/// A run before its numbers were changed.
pub(super) struct Former {
    pub(super) world: World,
    pub(super) numbers: Vec<Number>,
    pub(super) state: Option<State>,
    pub(super) steps: u64,
    pub(super) hold: Hold,
    /// Moves and breaks that were recorded.
    pub(super) recorded: [usize; 2],
}

impl Playback {
    pub(super) fn new(world: &World, samples: Sender<Sample>, stop: StopFlag) -> Self {
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

    pub(super) fn start_anew(&mut self) {
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

    /// Returns to a run before its numbers were changed. Gives the state to continue from.
    pub(super) fn refuse(&mut self, former: &Former, reason: &str) -> Option<State> {
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
    pub(super) fn write_recording(&mut self) {
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
    pub(super) fn begin_recording(&mut self) {
        self.recording = Some(Recording { of: self.of, ..Recording::default() });
        let surface = Surface::of(&self.view);
        if surface != self.usual {
            self.record(false, Instant::now(), Done::Surface(surface));
        }
    }

    /// Wall time between frames: long enough that three quarters of it are left for steps.
    pub(super) fn interval(&self) -> Duration {
        FRAME.max(4 * self.prepared)
    }

    pub(super) fn is_going(&self) -> bool {
        self.playing && self.failure.is_none()
    }

    /// Records an action. `evaluated` is true if the forces of that instant were computed before.
    pub(super) fn record(&mut self, evaluated: bool, sent: Instant, done: Done) {
        let Some(recording) = &mut self.recording else { return };
        let started = *self.started.get_or_insert(sent);
        let seconds = sent.saturating_duration_since(started).as_secs_f64();
        recording.moves.push(Move { steps: self.steps, evaluated, seconds, lag: None, done });
    }

    /// Sets the lags after a step, which has felt the earlier actions.
    pub(super) fn feel(&mut self) {
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
