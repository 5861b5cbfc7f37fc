//! One run: its outputs, samples, checkpoints and reports of progress.

use std::fmt;
use std::path::PathBuf;
use std::thread::Scope;
use std::time::{Duration, Instant};

use pliant_explicit::Wanted;
use pliant_geometry::Mesh;
use pliant_scene::{PlannedParticipant, World};
use pliant_sim::contact::barrier::IntersectionCheck;
use pliant_sim::{Failure, FailureKind, LoadStepProgress, Observer, Schedule, Simulation, StopFlag};

use crate::advice::remedy;
use crate::checkpoint::{Checkpoint, Checkpoints};
use crate::output::{
    CONVERGENCE, CoupledSurfaceSummary, FieldMesh, History, Outcome, OutputError, OutputFolder, Outputs,
    PICTURE, PLOT, PartOutcome, SUMMARY, Summary, TieSummary, Watched, frames, hourglass_failure,
    interrupted, markdown, output_failure, plot, summarise,
};
use crate::progressed::Progressed;
use crate::rollback::{Point, RollbackPoints};

/// Draws an instant of a run.
pub trait Draw: fmt::Debug + Sync {
    /// Draws a PNG file of a mesh at rest with the fields of an instant, at a time [s]. If given, `marks` is
    /// a mesh whose constraints and loads are marked.
    ///
    /// # Errors
    /// The reason why there is no picture.
    fn draw(&self, mesh: &Mesh, marks: Option<&Mesh>, time: f64) -> Result<Vec<u8>, String>;
}

/// Progress of a run.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Simulated time [s].
    pub time: f64,
    /// Duration of the scene [s].
    pub until: f64,
    /// Wall time so far.
    pub wall: Duration,
    /// Progress within a load step of a quasi-static run.
    pub load_step: Option<LoadStepProgress>,
}

/// Options of a run besides its scene.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options<'a> {
    /// Checkpoint to continue from; without it the run begins at the start of the scene. The folder was
    /// [reopened](OutputFolder::reopen) for it, and its plan [continues](Checkpoint::continues) it.
    pub resume: Option<&'a Checkpoint>,
    /// Ends the run on request, with a checkpoint if the scene asks for some. The run ends after the current
    /// step, or at the state before it if the step takes long.
    pub stop: Option<&'a StopFlag>,
    /// Draws the last instant, as the scene's `[view]` shows it, into `picture.png`.
    pub picture: Option<&'a dyn Draw>,
}

/// Samples in the history.
const SAMPLES: f64 = 1000.0;
/// Samples of a run on a GPU, which has to stop for each.
const SAMPLES_ON_DEVICE: f64 = 250.0;

/// Samples from one look at the fields of all cells of solids to the next: a look costs as much as a few
/// steps.
const SAMPLES_A_LOOK: usize = 50;

/// Wall time between two reports of progress.
const REPORT: Duration = Duration::from_millis(100);

/// Runs a world and writes its outputs, `plot.svg` and `summary.md`. A failure of the run, or of writing
/// while it runs, is in the summary; earlier output stays.
///
/// # Errors
/// If the outputs can't be opened.
pub fn run(
    world: &World,
    folder: &OutputFolder,
    report: &mut (dyn FnMut(Progress) + Send),
) -> Result<Summary, OutputError> {
    run_with(world, folder, Options::default(), report)
}

/// Runs like [`run`], from a checkpoint or with a way to stop it.
///
/// # Errors
/// If the outputs can't be opened.
pub fn run_with(
    world: &World,
    folder: &OutputFolder,
    options: Options<'_>,
    report: &mut (dyn FnMut(Progress) + Send),
) -> Result<Summary, OutputError> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(world.scene.run.threads as usize)
        .build()
        .map_err(|error| OutputError::new(folder.path(), error))?;
    let mut outcome = pool.install(|| go(world, folder, options, report))?;
    if let Err(error) = write_pages(world, folder, &mut outcome) {
        let time = Some(outcome.time);
        outcome.failure.get_or_insert_with(|| output_failure(&error, time));
    }
    Ok(summarise(world, &outcome))
}

/// Writes the plot and the page that shows it.
fn write_pages(world: &World, folder: &OutputFolder, outcome: &mut Outcome) -> Result<(), OutputError> {
    let page = folder.path().join(SUMMARY);
    for (part, result) in world.participants.iter().zip(&outcome.parts) {
        let Some(table) = &result.convergence else { continue };
        let file = part.prefix().map_or(CONVERGENCE.to_owned(), |name| format!("convergence-{name}.csv"));
        outcome.files.push(folder.write(&file, table)?);
        if let Some(failure) = outcome
            .failure
            .as_mut()
            .filter(|failure| matches!(failure.kind, FailureKind::NotConverged | FailureKind::Blocked))
        {
            failure.message.push_str(&format!("; the residuals of all iterations are in `{file}`"));
        }
    }
    let svg = plot(world, &outcome.history)
        .map_err(|reason| OutputError::new(&folder.path().join(PLOT), reason))?;
    outcome.files.push(folder.write(PLOT, &svg)?);
    outcome.files.push(page);
    let text = markdown(world, outcome, &summarise(world, outcome));
    let written = folder.write(SUMMARY, &text);
    if written.is_err() {
        outcome.files.pop();
    }
    written.map(|_| ())
}

fn go(
    world: &World,
    folder: &OutputFolder,
    options: Options<'_>,
    report: &mut (dyn FnMut(Progress) + Send),
) -> Result<Outcome, OutputError> {
    let begun = match options.resume {
        Some(checkpoint) => {
            let other = || OutputError::new(folder.path(), "the checkpoint is of another model");
            let simulated = world.simulated();
            let state = checkpoint.state(world, &simulated).ok_or_else(other)?;
            Simulation::resumed(simulated, state)
        }
        None => world.simulation(),
    };
    let mut simulation = match begun {
        Ok(simulation) => simulation,
        Err(failure) => return Ok(Outcome::not_begun(failure, world)),
    };
    if let Some(stop) = options.stop {
        simulation.stop_on(stop);
    }
    std::thread::scope(|scope| {
        // States on a GPU are read back only where an output is due.
        let spare = rayon::current_num_threads() > 1 && !is_on_device(world);
        let run = Run::new(world, folder, options, &simulation, report, spare.then_some(scope))?;
        Ok(run.take_all(simulation, folder, options))
    })
}

/// The search for intersections of a participant that asks for one.
fn check_of(part: &PlannedParticipant) -> Option<IntersectionCheck> {
    let contacts = part.built.contacts.as_deref().filter(|_| part.built.check_intersections)?;
    Some(IntersectionCheck::new(contacts, &part.built.model.rest))
}

/// True if states lie on a GPU.
fn is_on_device(world: &World) -> bool {
    world.participants.iter().any(|part| part.plan.target.is_gpu())
}

/// Observations, outputs and kept states of a run.
struct Run<'a, 'env> {
    world: &'a World,
    outputs: Outputs<'a>,
    history: History,
    sampling: Schedule,
    /// The worst of each participant.
    watched: Vec<Watched>,
    /// The search for intersections of each, where one is asked for.
    checks: Vec<Option<IntersectionCheck>>,
    checkpoints: Option<Checkpoints<'a>>,
    /// States to go back to after a step that failed.
    rollback: Option<RollbackPoints>,
    folder: &'a OutputFolder,
    /// Scope for outputs on a thread of their own.
    spare: Option<&'a Scope<'a, 'env>>,
    /// Ends the run once it is asked.
    stop: Option<&'a StopFlag>,
    report: &'a mut (dyn FnMut(Progress) + Send),
    /// Time of the last report of progress.
    reported: Instant,
    started: Instant,
    /// Wall time [s] of the run that this one resumes.
    seconds_before: f64,
    /// Files written, without checkpoints.
    files: Vec<PathBuf>,
    /// The last checkpoint written.
    kept: Option<PathBuf>,
}

impl<'a, 'env> Run<'a, 'env> {
    /// At the start, or where a checkpoint was.
    fn new(
        world: &'a World,
        folder: &'a OutputFolder,
        options: Options<'a>,
        simulation: &Simulation,
        report: &'a mut (dyn FnMut(Progress) + Send),
        spare: Option<&'a Scope<'a, 'env>>,
    ) -> Result<Self, OutputError> {
        let mut files = Vec::new();
        let before = options.resume.map(|checkpoint| &checkpoint.progressed);
        let samples = if is_on_device(world) { SAMPLES_ON_DEVICE } else { SAMPLES };
        let sampling = Schedule::new(world.scene.scene.until / samples);
        let written = before.map(|before| before.outputs.as_slice());
        if before.is_some() {
            folder.go_on(&world.scene)?;
        }
        let outputs = Outputs::new(world, folder.path(), &mut files, written, spare)?;
        let points = options.resume.and_then(|checkpoint| checkpoint.points(world, simulation.setup()));
        let points = points.unwrap_or_default();
        let fresh = || vec![Watched::default(); world.participants.len()];
        let started = Instant::now();
        Ok(Self {
            world,
            outputs,
            history: before.map_or_else(History::default, |before| before.history.clone()),
            sampling: before.map_or(sampling, |before| before.sampling),
            watched: before.map_or_else(fresh, |before| before.watched.clone()),
            checks: world.participants.iter().map(check_of).collect(),
            checkpoints: Checkpoints::new(world, folder, simulation.time(), options.resume),
            rollback: RollbackPoints::new(simulation.setup(), points),
            folder,
            spare,
            stop: options.stop,
            report,
            reported: started,
            started,
            seconds_before: before.map_or(0.0, |before| before.wall_seconds),
            files,
            kept: None,
        })
    }

    /// Takes all steps, and returns the outcome.
    fn take_all(
        mut self,
        mut simulation: Simulation,
        folder: &OutputFolder,
        options: Options<'_>,
    ) -> Outcome {
        let failure = self.go(&mut simulation).err();
        // A failure of the run takes precedence over a failure of its outputs.
        let failure = failure.or(self.outputs.end().err());
        let failure = failure.map(|failure| self.advised(failure, &simulation));
        let picture = options.picture.filter(|_| failure.is_none());
        let (drawn, failure) =
            match picture.map(|picture| self.draw(&simulation, picture, folder)).transpose() {
                Ok(drawn) => (drawn, failure),
                Err(error) => (None, Some(output_failure(&error, Some(simulation.time())))),
            };
        let wall_seconds = self.wall_seconds();
        let Self { world, watched, history, files, kept, .. } = self;
        let parts = world.participants.iter().zip(simulation.instants()).zip(watched);
        let mut outcome = Outcome {
            failure,
            steps: simulation.steps(),
            time: simulation.time(),
            wall_seconds,
            energies: simulation.energies(),
            parts: parts.map(|((part, now), watched)| PartOutcome::new(part, now, watched)).collect(),
            ties: simulation.ties().map(|tie| TieSummary::new(world, tie)).collect(),
            guests: simulation.coupled_surfaces().map(|now| CoupledSurfaceSummary::new(world, now)).collect(),
            ended: simulation.ended().map(ToOwned::to_owned),
            history,
            files: files.into_iter().chain(kept).chain(drawn.clone()).collect(),
            picture: drawn,
            threads: rayon::current_num_threads(),
            resumed: options.resume.map(|checkpoint| (checkpoint.path().to_owned(), checkpoint.time())),
        };
        if outcome.failure.is_none() {
            outcome.failure = hourglass_failure(world, &outcome);
        }
        outcome
    }

    /// Takes all steps. After one that fails it goes back, if shorter steps may avoid the failure, and halves
    /// them.
    fn go(&mut self, simulation: &mut Simulation) -> Result<(), Failure> {
        if self.rollback.as_ref().is_some_and(|points| points.points().is_empty()) {
            self.keep_point(simulation)?;
        }
        loop {
            let Err(failure) = simulation.observe(self.world.scene.scene.until, self) else { return Ok(()) };
            let points = self.rollback.as_mut();
            match points.and_then(|points| points.take(simulation.setup(), &failure)) {
                Some(point) => self.go_back(simulation, point)?,
                None => return Err(failure),
            }
        }
    }

    /// Goes back to a point. Rows, frames and checkpoints since then are removed.
    fn go_back(&mut self, simulation: &mut Simulation, point: Point) -> Result<(), Failure> {
        let Point { progressed, state } = point;
        let Progressed { time, steps, watched, history, sampling, outputs, .. } = progressed;
        self.outputs.end()?;
        simulation.restore(state)?;
        (self.watched, self.history, self.sampling) = (watched, history, sampling);
        let failed = |error| output_failure(&error, Some(time));
        let mut known = Vec::new();
        let (world, path) = (self.world, self.folder.path());
        self.outputs = Outputs::new(world, path, &mut known, Some(&outputs), self.spare).map_err(failed)?;
        self.outputs.remove_later().map_err(failed)?;
        if let Some(checkpoints) = &mut self.checkpoints {
            checkpoints.go_back(world, time);
            checkpoints.remove_after(steps).map_err(failed)?;
            self.write_checkpoint(simulation)?;
        }
        Ok(())
    }

    /// Returns the progress of the run.
    fn progressed(&mut self, simulation: &Simulation) -> Result<Progressed, Failure> {
        Ok(Progressed {
            time: simulation.time(),
            steps: simulation.steps(),
            wall_seconds: self.wall_seconds(),
            watched: self.watched.clone(),
            history: self.history.clone(),
            sampling: self.sampling,
            outputs: self.outputs.written()?,
        })
    }

    fn keep_point(&mut self, simulation: &mut Simulation) -> Result<(), Failure> {
        // A rollback does not turn back the wall time.
        let progressed = Progressed { wall_seconds: 0.0, ..self.progressed(simulation)? };
        let point = Point { progressed, state: simulation.state()? };
        if let Some(points) = &mut self.rollback {
            points.keep(point);
        }
        Ok(())
    }

    fn write_checkpoint(&mut self, simulation: &mut Simulation) -> Result<(), Failure> {
        let (state, progressed) = (simulation.state()?, self.progressed(simulation)?);
        let Some(checkpoints) = &self.checkpoints else { return Ok(()) };
        let points = self.rollback.as_ref().map_or(&[][..], RollbackPoints::points);
        let written = checkpoints.write(&progressed, &state, points);
        self.kept = Some(written.map_err(|error| output_failure(&error, Some(progressed.time)))?);
        Ok(())
    }

    fn wall_seconds(&self) -> f64 {
        self.seconds_before + self.started.elapsed().as_secs_f64()
    }

    /// Reports progress, unless a report is recent.
    fn tell(&mut self, time: f64, load_step: Option<LoadStepProgress>, last: bool) {
        if last || self.reported.elapsed() >= REPORT {
            self.reported = Instant::now();
            let wall = Duration::try_from_secs_f64(self.wall_seconds()).unwrap_or_default();
            (self.report)(Progress { time, until: self.world.scene.scene.until, wall, load_step });
        }
    }

    fn look_at_strains(&mut self, simulation: &Simulation, solids: bool) {
        let parts = self.world.participants.iter().zip(simulation.instants());
        for (watched, (part, now)) in self.watched.iter_mut().zip(parts) {
            watched.strains.look(&part.built, now.shells());
            if solids {
                watched.solids.look(&part.built.model, now);
            }
        }
    }

    /// A failure with a remedy that knows the run.
    fn advised(&self, failure: Failure, simulation: &Simulation) -> Failure {
        let mut parts = self.world.participants.iter().zip(simulation.instants());
        let failed = parts.find(|(part, _)| failure.body.as_ref().is_none_or(|body| part.scene.has(body)));
        match failed.and_then(|(part, now)| remedy(&failure, part, now)) {
            Some(remedy) => failure.advised(&remedy),
            None => failure,
        }
    }

    /// Draws the instant last seen.
    fn draw(
        &self,
        simulation: &Simulation,
        picture: &dyn Draw,
        folder: &OutputFolder,
    ) -> Result<PathBuf, OutputError> {
        let world = self.world;
        let mut shown = FieldMesh::new(world, &world.scene.shown(world.scene.scene.until));
        let frames = frames(world, simulation);
        shown.fill(&frames);
        let marks = world.scene.shown_marks(1.0).map(|table| {
            let mut marks = FieldMesh::new(world, &table);
            marks.fill(&frames);
            marks
        });
        let drawn = picture.draw(shown.mesh(), marks.as_ref().map(FieldMesh::mesh), simulation.time());
        let png = drawn.map_err(|reason| OutputError::new(&folder.path().join(PICTURE), reason))?;
        folder.write(PICTURE, &png)
    }
}

impl Observer for Run<'_, '_> {
    /// The steps to the next instant at which there is something to do.
    fn stride(&self, simulation: &Simulation) -> u64 {
        let (time, step) = (simulation.time(), simulation.step_length());
        (self.outputs.schedules().iter())
            .chain([&self.sampling])
            .map(|schedule| schedule.stride(time, step))
            .chain(self.checkpoints.as_ref().map(|checkpoints| checkpoints.stride(time, step)))
            .chain(self.rollback.as_ref().map(|points| points.stride(simulation)))
            .fold(u64::MAX, u64::min)
    }

    fn wanted(&self, simulation: &Simulation, last: bool) -> Wanted {
        let (time, step) = (simulation.time(), simulation.step_length());
        let is_read = self.outputs.reads(time, step, last);
        if is_read || last { Wanted::Everything } else { Wanted::Energies }
    }

    /// Shows an instant to all outputs that await it.
    fn see(&mut self, simulation: &Simulation, last: bool) -> Result<(), Failure> {
        let (time, step) = (simulation.time(), simulation.step_length());
        let parts = self.world.participants.iter().zip(simulation.instants());
        self.watched.iter_mut().zip(parts).for_each(|(watched, (part, now))| watched.see(part, now));
        if self.sampling.is_due(time, step, last) {
            self.history.sample(&frames(self.world, simulation));
            // A GPU brings states back at the end.
            let looks = self.history.times.len() % SAMPLES_A_LOOK == 1 && !is_on_device(self.world);
            self.look_at_strains(simulation, looks || last);
        }
        if last || self.outputs.are_due(time, step, last) {
            let parts = self.world.participants.iter().zip(simulation.instants());
            for ((watched, check), (part, now)) in self.watched.iter_mut().zip(&self.checks).zip(parts) {
                check.iter().for_each(|check| watched.intersections.look(check, part, now));
            }
        }
        self.outputs.see(simulation, last)?;
        self.tell(time, None, last);
        Ok(())
    }

    /// Keeps a rollback point where one is due, and writes a checkpoint where one is or the run is to stop.
    fn stepped(&mut self, simulation: &mut Simulation, last: bool) -> Result<(), Failure> {
        let (time, step) = (simulation.time(), simulation.step_length());
        let stop = self.stop.is_some_and(StopFlag::is_asked);
        if self.rollback.as_ref().is_some_and(|points| points.is_due(simulation)) {
            self.keep_point(simulation)?;
        }
        let due =
            self.checkpoints.as_mut().is_some_and(|checkpoints| checkpoints.is_due(time, step, last || stop));
        if due {
            self.write_checkpoint(simulation)?;
        }
        // The rest of the last instant is quickly done.
        if stop && !last {
            let kept = due.then_some(self.kept.as_deref()).flatten();
            return Err(interrupted(time, kept));
        }
        Ok(())
    }

    /// Shows the results until the failure to outputs that have not seen them.
    fn step_failed(&mut self, simulation: &mut Simulation) {
        let seen = simulation.time();
        if !simulation.keeps_what_it_found() {
            return;
        }
        let time = simulation.time();
        self.look_at_strains(simulation, true);
        let now = frames(self.world, simulation);
        if time > seen {
            self.history.sample(&now);
        }
        self.outputs.see_found(simulation, seen);
    }

    fn watch(&mut self, progress: LoadStepProgress) {
        let [from, to] = progress.iteration.span;
        let time = from + progress.iteration.fraction * (to - from);
        self.tell(time, Some(progress), false);
    }
}
