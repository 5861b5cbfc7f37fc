//! The run loop: step, look, write, until the end or a failure.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use pliant_explicit::stability::Stability;
use pliant_gpu::Wanted;
use pliant_mechanics::Energies;
use serde::{Deserialize, Serialize};

use crate::advice::remedy;
use crate::assemble::Built;
use crate::checkpoint::{Checkpoint, Checkpoints, Progressed};
use crate::format::SolverName;
use crate::output::{
    CONVERGENCE, FailureSummary, Frame, INTERRUPTED, OutputError, OutputFolder, PICTURE, PLOT, SUMMARY,
    Schedule, Scheduled, ShellStrains, Snapshot, Summary, markdown, observers, plot, steps_to, summarise,
};
use crate::participant::{Instant, Participant, participant};
use crate::plan::Plan;
use crate::scene::Scene;
use crate::solver::{Effort, Equilibria, LoadStepProgress};
use crate::view::Draw;

/// How far a run is.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Simulated time [s].
    pub time: f64,
    /// Duration of the scene [s].
    pub until: f64,
    /// Wall time so far.
    pub wall: Duration,
    /// Where a quasi-static run is within a load step.
    pub load_step: Option<LoadStepProgress>,
}

/// What a run can be given beside its scene.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options<'a> {
    /// Where to go on, in a folder that was [reopened](OutputFolder::reopen) for it and with the plan by which it
    /// [continues](Checkpoint::continues); at the start of the scene if not given.
    pub resume: Option<&'a Checkpoint>,
    /// Ends the run after the current step once it is true, with a checkpoint if the scene asks for some.
    pub stop: Option<&'a AtomicBool>,
    /// Draws the last instant, as the scene's `[view]` shows it, into `picture.png`.
    pub picture: Option<&'a dyn Draw>,
}

/// Samples of a run for plot and summary.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct History {
    pub times: Vec<f64>,
    pub energies: Vec<Energies>,
    /// Size of each constraint's reaction [N].
    pub reactions: Vec<Vec<f64>>,
}

/// What a run came to.
#[derive(Clone, Debug)]
pub(crate) struct Outcome {
    pub failure: Option<FailureSummary>,
    pub steps: u64,
    pub time: f64,
    pub wall_seconds: f64,
    pub energies: Energies,
    pub worst_balance: f64,
    pub balance_floor: f64,
    /// The largest hourglass energy over the internal one, and its time [s].
    pub worst_hourglass: (f64, f64),
    /// What was seen of the largest stable step; `None` of a run without inertia.
    pub stability: Option<Stability>,
    /// How good its equilibria are, if it found some by dynamic relaxation.
    pub equilibria: Option<Equilibria>,
    /// What its equations took, if it solved some.
    pub effort: Option<Effort>,
    /// Residuals of its last iterations, as a table.
    pub convergence: Option<String>,
    /// Why it ended before the time of the scene was over, without a failure.
    pub ended: Option<String>,
    /// How far shells were strained.
    pub strains: ShellStrains,
    pub reactions: Vec<[f64; 3]>,
    pub history: History,
    pub files: Vec<PathBuf>,
    /// The picture of the last instant.
    pub picture: Option<PathBuf>,
    pub threads: usize,
    /// The checkpoint it went on from, and its time [s].
    pub resumed: Option<(PathBuf, f64)>,
}

impl Outcome {
    /// Of a run whose solver could not be made.
    fn not_begun(failure: FailureSummary, built: &Built) -> Self {
        Self {
            failure: Some(failure),
            steps: 0,
            time: 0.0,
            wall_seconds: 0.0,
            energies: Energies::default(),
            worst_balance: 0.0,
            balance_floor: 0.0,
            worst_hourglass: (0.0, 0.0),
            stability: None,
            equilibria: None,
            effort: None,
            convergence: None,
            ended: None,
            strains: ShellStrains::default(),
            reactions: vec![[0.0; 3]; built.model.constraints.len()],
            history: History::default(),
            files: Vec::new(),
            picture: None,
            threads: rayon::current_num_threads(),
            resumed: None,
        }
    }
}

/// Samples in the history.
const SAMPLES: f64 = 1000.0;
/// Those of a run on a graphics processor, which has to stop for each.
const SAMPLES_ON_DEVICE: f64 = 250.0;

/// Wall time between two reports of progress.
const REPORT: Duration = Duration::from_millis(100);

/// Runs a scene and writes its outputs, `plot.svg` and `summary.md`. A failure of the run, or of writing while it runs,
/// is in the summary; whatever was written before stays.
///
/// # Errors
/// If the outputs can't be opened.
pub fn run(
    scene: &Scene,
    built: &Built,
    plan: &Plan,
    folder: &OutputFolder,
    report: &mut (dyn FnMut(Progress) + Send),
) -> Result<Summary, OutputError> {
    run_with(scene, built, plan, folder, Options::default(), report)
}

/// As [`run`], from a checkpoint or with a way to stop it.
///
/// # Errors
/// If the outputs can't be opened.
pub fn run_with(
    scene: &Scene,
    built: &Built,
    plan: &Plan,
    folder: &OutputFolder,
    options: Options<'_>,
    report: &mut (dyn FnMut(Progress) + Send),
) -> Result<Summary, OutputError> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(scene.run.threads as usize)
        .build()
        .map_err(|error| OutputError::new(folder.path(), error))?;
    let mut outcome = pool.install(|| go(scene, built, plan, folder, options, report))?;
    if let Err(error) = write_pages(scene, built, plan, folder, &mut outcome) {
        let time = Some(outcome.time);
        outcome.failure.get_or_insert_with(|| FailureSummary::output(&error, time));
    }
    Ok(summarise(scene, built, plan, &outcome))
}

/// Writes the plot and the page that shows it.
fn write_pages(
    scene: &Scene,
    built: &Built,
    plan: &Plan,
    folder: &OutputFolder,
    outcome: &mut Outcome,
) -> Result<(), OutputError> {
    let page = folder.path().join(SUMMARY);
    if let Some(table) = &outcome.convergence {
        outcome.files.push(folder.write(CONVERGENCE, table)?);
        if let Some(failure) = outcome.failure.as_mut().filter(|failure| failure.kind == "not-converged") {
            failure.message.push_str(&format!("; the residuals of all iterations are in `{CONVERGENCE}`"));
        }
    }
    let svg = plot(built, &outcome.history)
        .map_err(|reason| OutputError::new(&folder.path().join(PLOT), reason))?;
    outcome.files.push(folder.write(PLOT, &svg)?);
    outcome.files.push(page);
    let text = markdown(scene, built, plan, outcome, &summarise(scene, built, plan, outcome));
    let written = folder.write(SUMMARY, &text);
    if written.is_err() {
        outcome.files.pop();
    }
    written.map(|_| ())
}

fn go(
    scene: &Scene,
    built: &Built,
    plan: &Plan,
    folder: &OutputFolder,
    options: Options<'_>,
    report: &mut (dyn FnMut(Progress) + Send),
) -> Result<Outcome, OutputError> {
    let kept = match options.resume {
        Some(checkpoint) => {
            let other = || OutputError::new(folder.path(), "the checkpoint is of another model");
            Some(checkpoint.kept(built).ok_or_else(other)?)
        }
        None => None,
    };
    let participant = match participant(scene, built, plan, kept) {
        Ok(participant) => participant,
        Err(failure) => return Ok(Outcome::not_begun(failure, built)),
    };
    let mut course = Course::new(scene, built, plan, folder, options, participant)?;
    let before = options.resume.map_or(0.0, |checkpoint| checkpoint.progressed.wall_seconds);
    let started = std::time::Instant::now();
    let wall_seconds = || before + started.elapsed().as_secs_f64();
    let wall = || Duration::try_from_secs_f64(wall_seconds()).unwrap_or_default();
    let mut reported = started;
    let failure = loop {
        match course.see() {
            Ok(last) => {
                if reported.elapsed() >= REPORT || last {
                    reported = std::time::Instant::now();
                    report(Progress {
                        time: course.participant.time(),
                        until: scene.scene.until,
                        wall: wall(),
                        load_step: None,
                    });
                }
                if last {
                    break course.finish().err();
                }
            }
            Err(failure) => break Some(failure),
        }
        let stop = options.stop.is_some_and(|stop| stop.load(Ordering::Relaxed));
        let mut watch = |step: LoadStepProgress| {
            if reported.elapsed() >= REPORT {
                reported = std::time::Instant::now();
                let [from, to] = step.iteration.span;
                let time = from + step.iteration.fraction * (to - from);
                report(Progress { time, until: scene.scene.until, wall: wall(), load_step: Some(step) });
            }
        };
        if let Err(failure) = course.step(wall_seconds(), stop, &mut watch) {
            if failure.kind != INTERRUPTED {
                course.show_what_was_found();
            }
            break Some(failure);
        }
    };
    let failure =
        failure.map(|failure| match remedy(&failure, scene, built, plan, &course.participant.stability()) {
            Some(remedy) => failure.advised(&remedy),
            None => failure,
        });
    let picture = options.picture.filter(|_| failure.is_none());
    let (drawn, failure) = match picture.map(|picture| course.draw(picture, folder)).transpose() {
        Ok(drawn) => (drawn, failure),
        Err(error) => (None, Some(FailureSummary::output(&error, Some(course.participant.time())))),
    };
    let participant = course.participant;
    Ok(Outcome {
        failure,
        steps: participant.steps(),
        time: participant.time(),
        wall_seconds: wall_seconds(),
        energies: participant.energies(),
        worst_balance: course.worst_balance,
        balance_floor: participant.balance_floor(),
        worst_hourglass: course.worst_hourglass,
        stability: plan
            .limits
            .as_ref()
            .filter(|_| scene.run.solver == SolverName::Explicit)
            .map(|_| participant.stability()),
        equilibria: participant.equilibria(),
        effort: participant.effort(),
        convergence: participant.convergence(),
        ended: participant.ended().map(ToOwned::to_owned),
        strains: course.strains,
        reactions: (0..built.model.constraints.len()).map(|index| participant.reaction(index)).collect(),
        history: course.history,
        files: course.files.into_iter().chain(course.kept).chain(drawn.clone()).collect(),
        picture: drawn,
        threads: rayon::current_num_threads(),
        resumed: options.resume.map(|checkpoint| (checkpoint.path().to_owned(), checkpoint.time())),
    })
}

/// Hourglass energy over internal energy; 0 while both together are below the floor [J] from which on energies mean
/// something.
fn hourglass_share(energies: &Energies, floor: f64) -> f64 {
    let Energies { internal, hourglass, .. } = *energies;
    if hourglass > 0.0 && internal + hourglass > floor {
        hourglass / internal.max(f64::MIN_POSITIVE)
    } else {
        0.0
    }
}

/// A run under way.
struct Course<'a> {
    scene: &'a Scene,
    built: &'a Built,
    plan: &'a Plan,
    participant: Box<dyn Participant>,
    watching: Vec<Scheduled>,
    history: History,
    sampling: Schedule,
    worst_balance: f64,
    /// The largest hourglass energy over the internal one, and its time [s].
    worst_hourglass: (f64, f64),
    strains: ShellStrains,
    checkpoints: Option<Checkpoints<'a>>,
    /// Whether the last instant becomes a picture.
    pictured: bool,
    /// Files written, without checkpoints.
    files: Vec<PathBuf>,
    /// The last checkpoint written.
    kept: Option<PathBuf>,
}

impl<'a> Course<'a> {
    /// At the start, or where a checkpoint was.
    fn new(
        scene: &'a Scene,
        built: &'a Built,
        plan: &'a Plan,
        folder: &'a OutputFolder,
        options: Options<'_>,
        participant: Box<dyn Participant>,
    ) -> Result<Self, OutputError> {
        let mut files = Vec::new();
        let before = options.resume.map(|checkpoint| &checkpoint.progressed);
        let samples = if plan.target.device.is_some() { SAMPLES_ON_DEVICE } else { SAMPLES };
        let written = before.map(|before| before.outputs.as_slice());
        if before.is_some() {
            folder.go_on(scene)?;
        }
        let watching = observers(scene, built, folder.path(), &mut files, written)?;
        Ok(Self {
            scene,
            built,
            plan,
            watching,
            history: before.map_or_else(History::default, |before| before.history.clone()),
            sampling: before.map_or(Schedule::new(scene.scene.until / samples), |before| before.sampling),
            worst_balance: before.map_or(0.0, |before| before.worst_balance),
            worst_hourglass: before.map_or((0.0, 0.0), |before| before.worst_hourglass),
            strains: before.map_or_else(ShellStrains::default, |before| before.strains.clone()),
            checkpoints: Checkpoints::new(scene, built, plan, folder, participant.time()),
            participant,
            pictured: options.picture.is_some(),
            files,
            kept: None,
        })
    }

    /// Evaluates the current instant and shows it to all who look; whether it is the last.
    fn see(&mut self) -> Result<bool, FailureSummary> {
        let (time, last) = (self.participant.time(), self.is_last());
        let step = self.plan.step_from(time);
        let looked_at = self.watching.iter().any(|(schedule, _)| schedule.awaits(time, step, last));
        let wanted = if looked_at || (last && self.pictured) { Wanted::Everything } else { Wanted::Energies };
        self.participant.evaluate(wanted)?;
        let energies = self.participant.energies();
        if self.participant.largest_energy() > self.participant.balance_floor() {
            self.worst_balance = self.worst_balance.max(energies.balance);
        }
        let share = hourglass_share(&energies, self.participant.balance_floor());
        if share > self.worst_hourglass.0 {
            self.worst_hourglass = (share, self.participant.time());
        }
        if self.sampling.is_due(time, step, last) {
            self.history.sample(self.built, self.participant.instant());
            self.strains.look(self.built, self.participant.shells());
        }
        let frame = Frame { built: self.built, now: self.participant.instant() };
        look(&mut self.watching, &frame, step, last)
            .map_err(|error| FailureSummary::output(&error, Some(self.participant.time())))?;
        Ok(last)
    }

    fn is_last(&self) -> bool {
        let over = self.participant.time() + 0.5 * self.plan.step_from(self.participant.time())
            >= self.scene.scene.until;
        over || self.participant.ended().is_some()
    }

    /// After a step that failed: shows what was found until then to those who have not looked at it.
    fn show_what_was_found(&mut self) {
        let seen = self.participant.time();
        if !self.participant.keeps_what_it_found() || self.participant.evaluate(Wanted::Everything).is_err() {
            return;
        }
        let (time, step) = (self.participant.time(), self.plan.step);
        self.strains.look(self.built, self.participant.shells());
        if time > seen {
            self.history.sample(self.built, self.participant.instant());
        }
        let frame = Frame { built: self.built, now: self.participant.instant() };
        for (schedule, observer) in &mut self.watching {
            if (time > seen || !schedule.has_seen(time)) && schedule.is_due(time, step, true) {
                // The failure of the step is reported.
                let _ = observer.see(&frame);
            }
        }
    }

    /// The steps to the next instant at which there is something to do.
    fn stride(&self) -> u64 {
        let time = self.participant.time();
        let step = self.plan.step_from(time);
        (self.watching.iter().map(|(schedule, _)| schedule))
            .chain([&self.sampling])
            .map(|schedule| schedule.stride(time, step))
            .chain(self.checkpoints.as_ref().map(|checkpoints| checkpoints.stride(time, step)))
            .chain([steps_to(self.scene.scene.until, time, step), self.participant.stride()])
            .fold(u64::MAX, u64::min)
    }

    /// Goes to the next instant, with a checkpoint there if one is due or the run is to `stop`.
    fn step(
        &mut self,
        wall_seconds: f64,
        stop: bool,
        watch: &mut dyn FnMut(LoadStepProgress),
    ) -> Result<(), FailureSummary> {
        let steps = self.stride();
        self.participant.advance(steps, watch)?;
        let last = self.is_last();
        let due = (self.checkpoints.as_mut()).is_some_and(|all| {
            all.is_due(self.participant.time(), self.plan.step_from(self.participant.time()), last || stop)
        });
        if due && let Some(checkpoints) = &self.checkpoints {
            self.participant.bring_back()?;
            let progressed = Progressed {
                time: self.participant.time(),
                steps: self.participant.steps(),
                wall_seconds,
                worst_balance: self.worst_balance,
                worst_hourglass: self.worst_hourglass,
                strains: self.strains.clone(),
                history: self.history.clone(),
                sampling: self.sampling,
                outputs: self.watching.iter().map(|(schedule, o)| (*schedule, o.written())).collect(),
            };
            let written = checkpoints.write(&progressed, self.participant.as_ref());
            self.kept =
                Some(written.map_err(|error| FailureSummary::output(&error, Some(self.participant.time())))?);
        }
        // What is left of the last instant is quickly done.
        if stop && !last {
            return Err(FailureSummary::interrupted(
                self.participant.time(),
                due.then_some(self.kept.as_deref()).flatten(),
            ));
        }
        Ok(())
    }

    /// Draws the instant last seen.
    fn draw(&self, picture: &dyn Draw, folder: &OutputFolder) -> Result<PathBuf, OutputError> {
        let shown = self.scene.shown(self.scene.scene.until);
        let mut snapshot =
            Snapshot::new(self.built, shown.on.as_deref(), &shown.data, shown.at, shown.curved);
        snapshot.fill(&Frame { built: self.built, now: self.participant.instant() });
        let drawn = picture.draw(snapshot.mesh(), self.participant.time());
        let png = drawn.map_err(|reason| OutputError::new(&folder.path().join(PICTURE), reason))?;
        folder.write(PICTURE, &png)
    }

    /// Ends the outputs where this run ends.
    fn finish(&mut self) -> Result<(), FailureSummary> {
        (self.watching.iter_mut())
            .try_for_each(|(_, observer)| observer.finish())
            .map_err(|error| FailureSummary::output(&error, Some(self.participant.time())))
    }
}

fn look(watching: &mut [Scheduled], frame: &Frame<'_>, step: f64, last: bool) -> Result<(), OutputError> {
    for (schedule, observer) in watching {
        if schedule.is_due(frame.time(), step, last) {
            observer.see(frame)?;
        }
    }
    Ok(())
}

impl History {
    fn sample(&mut self, built: &Built, now: &dyn Instant) {
        self.times.push(now.time());
        self.energies.push(now.energies());
        let size = |constraint| now.reaction(constraint).iter().map(|f| f * f).sum::<f64>().sqrt();
        self.reactions.push((0..built.model.constraints.len()).map(size).collect());
    }
}
