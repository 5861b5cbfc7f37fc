//! The thread that plays.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::time::{Duration, Instant};

use pliant_explicit::Wanted;
use pliant_format::tables::ViewTable;
use pliant_geometry::words::number;
use pliant_geometry::{Region, Vector3};
use pliant_picture::{
    Subject, contact_forces, critical_cell, deformed_points, drawn_value, nodal_values, visible,
};
use pliant_run::{Column, Live};
use pliant_scene::World;
use pliant_sim::gpu::{DevicePoints, PointValue};
use pliant_sim::{Failure, StopFlag};

use super::playback::{Former, Playback};
use super::{BEHIND, FRAME, Frame, Order, SAMPLED, enter};
use crate::device::point_value;
use crate::followed::Followed;
use crate::hand::{Hand, Point, Which};
use crate::marks::marks;
use crate::recording::{Break, Done, Recording, Surface};
use crate::samples::{HAND, SECOND_HAND, Sample};
use crate::sound::{Sound, SoundStates};

/// Reason to leave a world.
pub(super) enum Left {
    Quit,
    /// To start anew.
    Reset,
    /// For another world.
    Change,
    /// For the world before, since the changed numbers break the run.
    Refusal(String),
}

/// The solver's thread while it plays a world.
pub(super) struct Player<'s> {
    pub(super) world: &'s World,
    pub(super) subject: Arc<Subject>,
    pub(super) ways: Arc<Vec<Vector3>>,
    /// True for each triangle of the subject that a hand can take.
    pub(super) movable: Arc<[bool]>,
    /// A triangle of each tool.
    pub(super) tool_triangles: Arc<[u32]>,
    /// Regions whose cells are not shown.
    pub(super) hidden: Vec<Region>,
    pub(super) live: Live,
    /// True if the state lies on a device.
    pub(super) on_device: bool,
    pub(super) sound: SoundStates,
    /// True if the run continues from a world with other numbers.
    pub(super) is_changed: bool,
    pub(super) playback: Playback,
}

pub(super) fn play(
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

impl<'s> Player<'s> {
    /// Starts to play a world, or continues as this world from the state of the world before.
    pub(super) fn enter(
        world: &'s World,
        (mut live, goes_on): (Live, bool),
        subject: Option<Arc<Subject>>,
        mut playback: Playback,
        is_changed: bool,
    ) -> Self {
        live.simulation.stop_on(&playback.stop);
        if !goes_on && playback.steps > 0 {
            playback.start_anew();
            playback.note = Some("the mesh or the solver has changed: the run starts anew".into());
        }
        playback.hold.grip_again(&mut live);
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

    /// Returns the run before its numbers change; `None` if it has failed.
    pub(super) fn former(&mut self) -> Option<Former> {
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

    /// Records that the run can't continue. Changed numbers that break the run at once are refused.
    pub(super) fn fail(&mut self, message: String) {
        let playback = &mut self.playback;
        if self.is_changed && self.sound.has_just_begun(playback.steps, self.world.step()) {
            playback.refused.get_or_insert(message);
        } else {
            playback.failure.get_or_insert(message);
        }
    }

    /// Returns the parts that outlast this world.
    pub(super) fn end(self) -> (Option<Arc<Subject>>, Playback) {
        (Some(self.subject), self.playback)
    }

    /// Follows orders and plays, until the world is left.
    pub(super) fn go(
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
                    // Requested steps come before later orders.
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

    /// Time that the player may wait for orders: until the next step or a changed frame is due.
    pub(super) fn patience(&self, changed: bool) -> Duration {
        let playback = &self.playback;
        let long = Duration::from_millis(50);
        if !playback.is_going() {
            return long;
        }
        let due = if changed { playback.interval().saturating_sub(playback.shown.elapsed()) } else { long };
        let ahead = (self.live.simulation.time() - playback.pace.goal()) / playback.pace.speed.max(1e-9);
        Duration::try_from_secs_f64(ahead.max(0.0)).unwrap_or(due).min(due)
    }

    pub(super) fn obey(&mut self, sent: Instant, order: Order) -> Option<Left> {
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
            Order::Hand(hand) => self.grip(sent, Which::First, &hand),
            Order::Second(hand) => self.grip(sent, Which::Second, &hand),
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

    pub(super) fn grip(&mut self, sent: Instant, which: Which, hand: &Hand) {
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
            playback.note = Some("this solver does not support pulling by hand".into());
        } else if matches!(hand, Hand::Take(..) | Hand::Pin(_)) {
            playback.note = None;
        }
        let number = playback.recording.as_ref().map_or(0, |recording| recording.moves.len());
        playback.record(evaluated, sent, Done::by(which, *hand));
        if held && playback.is_going() {
            playback.waiting.push((sent, playback.steps + u64::from(evaluated), number));
        }
    }

    pub(super) fn follow(&mut self, point: &Point) {
        let on = self.playback.view.on.as_deref();
        let followed = Followed::new(point, &self.subject, &self.live, self.world, on, &self.hidden);
        self.playback.followed.extend(followed);
        self.name_columns();
    }

    pub(super) fn name_columns(&mut self) {
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

    pub(super) fn show_another(&mut self, view: ViewTable, sent: Instant) {
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

    pub(super) fn show_as_viewed(&mut self) {
        let (scene, playback) = (&self.world.scene, &mut self.playback);
        self.hidden = self.world.hidden(&playback.view);
        self.live.show(&scene.shown_as(&playback.view, 1.0));
        let part = playback.view.component.map(|part| format!(":{}", part.word())).unwrap_or_default();
        playback.field = scene.field_of(&playback.view).map(|field| format!("{}{part}", field.name()));
        playback.seen.at = None;
    }

    pub(super) fn renew_subject(&mut self) -> Result<(), String> {
        let mesh = self.live.mesh().map_err(|failure| failure.message)?;
        self.subject = Arc::new(Subject::new(&visible(mesh, &self.hidden)));
        self.playback.followed.iter_mut().for_each(Followed::forget_shown);
        self.find_movable();
        Ok(())
    }

    /// Finds the triangles that hands can take, the triangles of tools, and the paths of moving things.
    pub(super) fn find_movable(&mut self) {
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

    pub(super) fn step(&mut self) {
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

    /// Keeps the state if one is due.
    pub(super) fn keep_sound(&mut self) {
        let (playback, simulation) = (&self.playback, &mut self.live.simulation);
        if !self.sound.is_due(playback.steps, self.world.step()) {
            return;
        }
        // A device that fails reports it in the next step.
        let Ok(state) = simulation.state() else { return };
        let moves = playback.recording.as_ref().map_or(0, |recording| recording.moves.len());
        let sound = Sound { state, steps: playback.steps, hold: playback.hold.clone(), moves };
        let nodes = self.world.participants.iter().map(|part| part.built.model.node_count()).sum();
        self.sound.keep(sound, nodes);
    }

    /// Goes back to an earlier state after a failed step. If no hand has acted and shorter steps may avoid
    /// the failure, the steps are halved there. Otherwise the hands let go there, or the run stops.
    pub(super) fn go_back(&mut self, failure: Failure) {
        let broken = self.live.simulation.time();
        let world = Arc::clone(self.live.simulation.setup());
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
    pub(super) fn halve(&mut self) {
        // A device that fails reports it in the next step.
        if self.live.halve_steps().is_ok() {
            self.playback.hold.grip_again(&mut self.live);
            self.playback.record(false, Instant::now(), Done::Halve);
        }
    }

    /// Goes back to a kept state when the user asks for it.
    pub(super) fn go_back_before(&mut self, steps: u64) {
        let sound = self.sound.before(steps, self.world.step());
        if let Some(time) = sound.and_then(|sound| self.restore(sound)) {
            let playback = &mut self.playback;
            let oldest = if playback.steps > steps { ", the oldest kept state: R starts anew" } else { "" };
            playback.failure = None;
            playback.note = Some(format!("the run went back to t = {} s{oldest}", number(time)));
        }
    }

    /// Restores a state, releases the hands and continues the recording. Returns the time [s] of the state;
    /// `None` if the stepper rejects it.
    pub(super) fn restore(&mut self, Sound { state, steps, hold, moves }: Sound) -> Option<f64> {
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

    /// True if a sample is due. The distance of samples does not depend on how a run is played.
    pub(super) fn is_sample_due(&self) -> bool {
        let every = (SAMPLED / self.world.step()).round().max(1.0) as u64;
        self.playback.steps.is_multiple_of(every)
    }

    /// Samples the instant, once.
    pub(super) fn sample(&mut self) {
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
    pub(super) fn inspect(&mut self) {
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
        seen.followed.extend(playback.followed.iter().map(|point| point.now(&self.live, &seen.values)));
        seen.marks = if playback.marked { marks(self.world, &self.live) } else { Vec::new() };
        seen.number += 1;
        seen.at = Some(Instant::now());
    }

    /// Brings the points that are drawn from the device to the instant; `inspected` where their values are
    /// new.
    pub(super) fn place(&mut self, inspected: bool) -> Option<DevicePoints> {
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
    pub(super) fn show(&mut self, frames: &mut triple_buffer::Input<Frame>) {
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
