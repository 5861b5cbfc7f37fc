//! The outputs of a run with their schedules. Outputs of whole meshes take longer than steps and work on a
//! thread of their own. That thread gets snapshots in their order, a few at a time. It computes the forces of
//! each again in its own simulation, with the same bits.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::thread::{Scope, ScopedJoinHandle};

use pliant_explicit::Wanted;
use pliant_format::registry::OutputTable;
use pliant_scene::World;
use pliant_sim::{Failure, FailureKind, Schedule, Simulation, SimulationState};

use super::{Output, OutputError, Written, csv, frames, output_failure, vtu};

/// Snapshots that wait for their outputs; a run that is faster waits, too.
const WAITING: usize = 2;

/// The outputs of a run, in the order of the scene.
pub(crate) struct Outputs<'scope> {
    world: &'scope World,
    schedules: Vec<Schedule>,
    /// Outputs that work within the run, by their place in the scene.
    near: Vec<Own>,
    far: Option<Far<'scope>>,
}

/// An output by its place in the scene.
type Own = (usize, Box<dyn Output>);

/// Outputs on a thread of their own.
struct Far<'scope> {
    places: Vec<usize>,
    tasks: SyncSender<Task>,
    thread: ScopedJoinHandle<'scope, Result<(), Failure>>,
}

enum Task {
    /// Shows a state to the outputs of these places.
    See(Box<SimulationState>, Vec<usize>),
    /// Answers with what the outputs have written so far.
    Written(Sender<Vec<(usize, Written)>>),
    /// Removes what an interrupted run had written beyond the end.
    Finish,
}

impl<'scope> Outputs<'scope> {
    /// Opens the outputs of a world and their files, and adds all paths to `files`. The outputs of a resumed
    /// run continue `written`. With a spare thread, some outputs work on it.
    pub fn new(
        world: &'scope World,
        folder: &Path,
        files: &mut Vec<PathBuf>,
        written: Option<&[(Schedule, Written)]>,
        spare: Option<&'scope Scope<'scope, '_>>,
    ) -> Result<Self, OutputError> {
        let (mut schedules, mut near, mut far) = (Vec::new(), Vec::new(), Vec::new());
        for (place, (name, table)) in world.scene.outputs.iter().enumerate() {
            let before = written.and_then(|written| written.get(place));
            let every = match table {
                OutputTable::Vtu(table) => {
                    let mut series = vtu::Series::new(world, table, folder, name)?;
                    if let Some((_, Written::Frames(times))) = before {
                        series.take_up(times);
                    }
                    files.push(series.index().to_owned());
                    let placed: Own = (place, Box::new(series));
                    if spare.is_some() { &mut far } else { &mut near }.push(placed);
                    table.every
                }
                OutputTable::Csv(table) => {
                    let mut rows = csv::Rows::new(world, table, folder, name);
                    match before {
                        Some((_, Written::Rows { bytes, crc })) => rows.take_up(*bytes, *crc)?,
                        _ => rows.start()?,
                    }
                    files.push(rows.path().to_owned());
                    near.push((place, Box::new(rows)));
                    table.every
                }
            };
            schedules.push(before.map_or(Schedule::new(every), |(schedule, _)| *schedule));
        }
        let far = spare.filter(|_| !far.is_empty()).map(|scope| Far::new(world, far, scope));
        Ok(Self { world, schedules, near, far })
    }

    /// The schedules, in the order of the scene.
    pub fn schedules(&self) -> &[Schedule] {
        &self.schedules
    }

    /// True if any output awaits an instant.
    pub(crate) fn are_due(&self, time: f64, step: f64, last: bool) -> bool {
        self.schedules.iter().any(|schedule| schedule.awaits(time, step, last))
    }

    /// True if an output within the run awaits an instant.
    pub fn reads(&self, time: f64, step: f64, last: bool) -> bool {
        self.near.iter().any(|(place, _)| self.schedules[*place].awaits(time, step, last))
    }

    /// Shows an instant to all that await it.
    pub fn see(&mut self, simulation: &Simulation, last: bool) -> Result<(), Failure> {
        let (time, step) = (simulation.time(), simulation.step_length());
        let due = |schedule: &mut Schedule| schedule.is_due(time, step, last);
        let due: Vec<bool> = self.schedules.iter_mut().map(due).collect();
        self.show(simulation, &due)?;
        if !last {
            return Ok(());
        }
        self.remove_later().map_err(|error| output_failure(&error, Some(time)))?;
        self.end()
    }

    /// Shows a state that was found in a step that failed to those that have not seen its time. That failure
    /// is reported, none of theirs.
    pub(crate) fn see_found(&mut self, simulation: &Simulation, seen: f64) {
        let (time, step) = (simulation.time(), simulation.step_length());
        let due = |schedule: &mut Schedule| {
            (time > seen || !schedule.has_seen(time)) && schedule.is_due(time, step, true)
        };
        let due: Vec<bool> = self.schedules.iter_mut().map(due).collect();
        let _ = self.show(simulation, &due);
    }

    fn show(&mut self, simulation: &Simulation, due: &[bool]) -> Result<(), Failure> {
        let (world, mut shown) = (self.world, None);
        for (_, output) in self.near.iter_mut().filter(|(place, _)| due[*place]) {
            let seen = output.see(shown.get_or_insert_with(|| frames(world, simulation)));
            seen.map_err(|error| output_failure(&error, Some(simulation.time())))?;
        }
        let Some(far) = &self.far else { return Ok(()) };
        let places: Vec<usize> = far.places.iter().copied().filter(|&place| due[place]).collect();
        if places.is_empty() {
            return Ok(());
        }
        match far.tasks.send(Task::See(Box::new(simulation.snapshot()), places)) {
            Ok(()) => Ok(()),
            Err(_) => self.end(),
        }
    }

    /// Removes rows and frames after those that a resumed run continues.
    pub(crate) fn remove_later(&mut self) -> Result<(), OutputError> {
        self.near.iter_mut().try_for_each(|(_, output)| output.finish())?;
        if let Some(far) = &self.far {
            // The error of a failed thread is reported when the thread is joined.
            let _ = far.tasks.send(Task::Finish);
        }
        Ok(())
    }

    /// Returns what the outputs have written so far, for a checkpoint.
    pub fn written(&mut self) -> Result<Vec<(Schedule, Written)>, Failure> {
        let mut collected: Vec<(usize, Written)> =
            self.near.iter().map(|(place, output)| (*place, output.written())).collect();
        if let Some(far) = &self.far {
            let (sender, receiver) = channel();
            let asked = far.tasks.send(Task::Written(sender));
            match asked.ok().and_then(|()| receiver.recv().ok()) {
                Some(written) => collected.extend(written),
                None => self.end()?,
            }
        }
        collected.sort_by_key(|(place, _)| *place);
        Ok(self.schedules.iter().copied().zip(collected.into_iter().map(|(_, written)| written)).collect())
    }

    /// Waits for all that is under way on the other thread.
    pub fn end(&mut self) -> Result<(), Failure> {
        let Some(Far { tasks, thread, .. }) = self.far.take() else { return Ok(()) };
        drop(tasks);
        // A panic of the thread continues here.
        thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    }
}

impl<'scope> Far<'scope> {
    fn new(world: &'scope World, outputs: Vec<Own>, scope: &'scope Scope<'scope, '_>) -> Self {
        let (tasks, received) = sync_channel(WAITING);
        let places = outputs.iter().map(|(place, _)| *place).collect();
        Self { places, tasks, thread: scope.spawn(move || work(world, outputs, &received)) }
    }
}

/// Executes tasks until the sender is gone.
fn work(world: &World, mut outputs: Vec<Own>, tasks: &Receiver<Task>) -> Result<(), Failure> {
    // Parallel loops stay on this thread, which is all of a pool of its own.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
    let _pool = pool.map_err(|error| Failure::new(FailureKind::Output, error.to_string(), None))?;
    let mut simulation: Option<Simulation> = None;
    for task in tasks {
        match task {
            Task::See(state, places) => {
                let now = match &mut simulation {
                    Some(simulation) => {
                        simulation.restore(*state)?;
                        simulation
                    }
                    None => simulation.insert(Simulation::resumed(Arc::new(world.simulated()), *state)?),
                };
                now.evaluate(Wanted::Everything)?;
                let (shown, time) = (frames(world, now), now.time());
                for (_, output) in outputs.iter_mut().filter(|(place, _)| places.contains(place)) {
                    output.see(&shown).map_err(|error| output_failure(&error, Some(time)))?;
                }
            }
            Task::Written(answer) => {
                let written = outputs.iter().map(|(place, output)| (*place, output.written())).collect();
                // Who has asked may have gone.
                let _ = answer.send(written);
            }
            Task::Finish => {
                for (_, output) in &mut outputs {
                    output.finish().map_err(|error| output_failure(&error, None))?;
                }
            }
        }
    }
    Ok(())
}
