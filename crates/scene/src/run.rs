//! The run loop: step, look, write, until the end or a failure.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use pliant_mechanics::stability::Stability;
use pliant_mechanics::{Energies, Observable, Real, State};

use crate::build::Built;
use crate::format::{Precision, SolverName};
use crate::output::{
    FailureSummary, Frame, OutputError, OutputFolder, PLOT, SUMMARY, Schedule, Scheduled, Summary, markdown,
    observers, plot, summarise,
};
use crate::plan::Plan;
use crate::scene::Scene;
use crate::solver::solver;

/// How far a run is.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Simulated time [s].
    pub time: f64,
    /// Duration of the scene [s].
    pub until: f64,
    /// Wall time so far.
    pub wall: Duration,
}

/// Samples of a run for plot and summary.
#[derive(Clone, Debug, Default)]
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
    pub reactions: Vec<[f64; 3]>,
    pub history: History,
    pub files: Vec<PathBuf>,
    pub threads: usize,
    pub precision: &'static str,
}

/// Samples in the history.
const SAMPLES: f64 = 1000.0;

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
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(scene.run.threads as usize)
        .build()
        .map_err(|error| OutputError::new(folder.path(), error))?;
    let mut outcome = pool.install(|| match scene.run.precision {
        Precision::Single => advance::<f32>(scene, built, plan, folder, report),
        Precision::Double => advance::<f64>(scene, built, plan, folder, report),
    })?;
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

fn advance<R: Real>(
    scene: &Scene,
    built: &Built,
    plan: &Plan,
    folder: &OutputFolder,
    report: &mut (dyn FnMut(Progress) + Send),
) -> Result<Outcome, OutputError> {
    let mut files = Vec::new();
    let mut watching = observers::<R>(scene, built, folder.path(), &mut files)?;
    let mut state = State::<R>::at_rest(&built.model);
    // Contradicting constraints were refused when the model was built.
    let mut solver =
        solver::<R>(&scene.run, built, plan).map_err(|error| OutputError::new(folder.path(), error))?;
    let mut history = History::default();
    let mut sampling = Schedule::new(scene.scene.until / SAMPLES);
    let mut worst_balance = 0.0_f64;
    let mut worst_hourglass = (0.0, 0.0);
    let mut failure = None;
    let started = Instant::now();
    let mut reported = started;
    loop {
        if let Err(error) = solver.evaluate(&mut state) {
            failure = Some(error);
            break;
        }
        if state.work.largest > solver.balance_floor() {
            worst_balance = worst_balance.max(solver.observable().energies().balance);
        }
        let share = hourglass_share(solver.observable().energies(), solver.balance_floor());
        if share > worst_hourglass.0 {
            worst_hourglass = (share, state.time);
        }
        let last = state.time + 0.5 * plan.step >= scene.scene.until;
        if sampling.is_due(state.time, plan.step, last) {
            history.sample(built, solver.observable(), &state);
        }
        let frame = Frame { built, state: &state, stepper: solver.observable() };
        if let Err(error) = look(&mut watching, &frame, plan.step, last) {
            failure = Some(FailureSummary::output(&error, Some(state.time)));
            break;
        }
        if reported.elapsed() >= REPORT || last {
            reported = Instant::now();
            report(Progress { time: state.time, until: scene.scene.until, wall: started.elapsed() });
        }
        if last {
            break;
        }
        if let Err(error) = solver.advance(&mut state) {
            failure = Some(error);
            break;
        }
    }
    Ok(Outcome {
        failure,
        steps: state.steps,
        time: state.time,
        wall_seconds: started.elapsed().as_secs_f64(),
        energies: *solver.observable().energies(),
        worst_balance,
        balance_floor: solver.balance_floor(),
        worst_hourglass,
        stability: (scene.run.solver == SolverName::Explicit).then_some(state.stability),
        reactions: (0..built.model.constraints.len())
            .map(|index| solver.observable().reaction(index))
            .collect(),
        history,
        files,
        threads: rayon::current_num_threads(),
        precision: R::PRECISION,
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

fn look<R: Real>(
    watching: &mut [Scheduled<R>],
    frame: &Frame<'_, R>,
    step: f64,
    last: bool,
) -> Result<(), OutputError> {
    for (schedule, observer) in watching {
        if schedule.is_due(frame.time(), step, last) {
            observer.see(frame)?;
        }
    }
    Ok(())
}

impl History {
    fn sample<R: Real>(&mut self, built: &Built, stepper: &dyn Observable<R>, state: &State<R>) {
        self.times.push(state.time);
        self.energies.push(*stepper.energies());
        let size = |constraint| stepper.reaction(constraint).iter().map(|f| f * f).sum::<f64>().sqrt();
        self.reactions.push((0..built.model.constraints.len()).map(size).collect());
    }
}
