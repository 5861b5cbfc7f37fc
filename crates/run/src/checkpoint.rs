//! Checkpoints: one file with everything that a run needs to continue as if it had never stopped.
//!
//! The file holds [`MAGIC`], the [`FORMAT`] (u32) and the length of the body (u64). Then come the body in
//! postcard's encoding and the CRC-32 of all bytes before it (u32). Numbers are little-endian. The body
//! begins with [`Origin`] (identity of the run) and [`Progressed`] (progress of the run and its outputs). The
//! states of the participants follow, with the further data of a restart, and then the rollback points. Each
//! rollback point holds a [`Progressed`] and the states. A file appears under its name only once it is whole.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use pliant_format::tables::{LoadSteps, SolverName};
use pliant_geometry::io::read_limited;
use pliant_geometry::words::{counted, number};
use pliant_mechanics::fingerprint;
use pliant_scene::{PlannedParticipant, World};
use pliant_sim::{Precision, Schedule, SimulationState};
use serde::{Deserialize, Serialize};

use crate::output::{OutputError, OutputFolder, replace};
use crate::progressed::Progressed;
use crate::rollback::Point;

/// The first bytes of every checkpoint.
const MAGIC: [u8; 8] = *b"\x89PLIANT\n";
/// Version of the format. Any change of the content of a body needs the next number.
pub(crate) const FORMAT: u32 = 20;
/// Bytes before the body: magic, format, length.
const HEAD: usize = 20;
/// Bytes after it.
const CRC: usize = 4;
/// Checkpoints kept of a run.
const KEPT: usize = 2;

/// Identity of a run: the run that resumes it has to match.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Origin {
    /// Duration [s] of the scene, from which the step comes.
    until: f64,
    participants: Vec<OwnOrigin>,
    /// The outputs and the ties between participants, with their fingerprints.
    tables: Vec<(String, u64)>,
}

/// Identity of a participant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct OwnOrigin {
    name: String,
    precision: Precision,
    solver: SolverName,
    /// Step [s].
    step: f64,
    /// The parts of the model, with their fingerprints.
    parts: Vec<(String, u64)>,
}

/// Reasons why a run cannot be resumed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ResumeError {
    /// The file can't be read.
    #[error("the checkpoint `{}` cannot be read: {reason}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Message of the system.
        reason: String,
    },
    /// A folder without checkpoints.
    #[error("there is no checkpoint in `{}`", path.display())]
    NoneIn {
        /// The folder.
        path: PathBuf,
    },
    /// Some other file.
    #[error("`{}` is not a checkpoint", path.display())]
    NotACheckpoint {
        /// The file.
        path: PathBuf,
    },
    /// Its end is missing.
    #[error("the checkpoint `{}` is truncated: {found} of {expected} bytes", path.display())]
    Truncated {
        /// The file.
        path: PathBuf,
        /// Bytes it has.
        found: u64,
        /// Bytes it should have.
        expected: u64,
    },
    /// Its checksum is wrong.
    #[error("the checkpoint `{}` is damaged: its checksum does not match its content", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
    },
    /// The checkpoint has a format that this version does not read.
    #[error("the checkpoint `{}` has format {format}; this version of pliant reads format {}", path.display(), FORMAT)]
    OtherFormat {
        /// The file.
        path: PathBuf,
        /// Its format.
        format: u32,
    },
    /// The checkpoint is of a run in another number type.
    #[error("the checkpoint is of a run in {checkpoint} precision, the scene asks for {scene}")]
    OtherPrecision {
        /// `single` or `double`.
        checkpoint: &'static str,
        /// `single` or `double`.
        scene: &'static str,
    },
    /// The checkpoint is of a run with another solver.
    #[error("the checkpoint is of a run with the solver `{checkpoint}`, the scene asks for `{scene}`")]
    OtherSolver {
        /// Its word in a scene file.
        checkpoint: &'static str,
        /// Its word in a scene file.
        scene: &'static str,
    },
    /// The checkpoint is of a run with another step.
    #[error(
        "the checkpoint is of a run with steps of {checkpoint:e} s, this scene takes steps of {scene:e} s"
    )]
    OtherStep {
        /// Step [s].
        checkpoint: f64,
        /// Step [s].
        scene: f64,
    },
    /// The checkpoint is of another scene.
    #[error("the checkpoint is of another scene: {}", differing(parts))]
    OtherScene {
        /// The parts that differ, in words; empty if only their order does.
        parts: Vec<String>,
        /// Duration [s] of the run that was interrupted, where the scene's is another now.
        until: Option<f64>,
    },
    /// There is nothing left to do.
    #[error(
        "the run has finished: the checkpoint is at t = {} s, and the scene ends at {} s; nothing is left to run",
        number(*time),
        number(*until)
    )]
    AtTheEnd {
        /// Time of the checkpoint [s].
        time: f64,
        /// End of the scene [s].
        until: f64,
    },
    /// The scene ends before the checkpoint.
    #[error("the checkpoint is at t = {} s, after the end of the scene at {} s", number(*time), number(*until))]
    BeyondTheEnd {
        /// Time of the checkpoint [s].
        time: f64,
        /// End of the scene [s].
        until: f64,
    },
    /// The folder can't be written to, or another run holds it.
    #[error("{0}")]
    Folder(#[from] OutputError),
    /// The folder does not hold the outputs that the checkpoint continues.
    #[error("`{}` does not hold what the checkpoint continues: {reason}", path.display())]
    OtherOutputs {
        /// The folder, or the file in it.
        path: PathBuf,
        /// The difference.
        reason: String,
    },
}

impl ResumeError {
    /// Returns what the user can try.
    pub fn remedy(&self) -> String {
        match self {
            Self::Unreadable { .. } => "check the path and the permissions".into(),
            Self::NoneIn { .. } => {
                "add `checkpoint = { every = 1.0 }` to `[run]`: the run then writes checkpoints".into()
            }
            Self::NotACheckpoint { .. } => {
                "give a file checkpoint-….pliant of an earlier run, or the folder it is in".into()
            }
            Self::Truncated { .. } | Self::Damaged { .. } => {
                "use the checkpoint before it, which the run keeps too, or run the scene from the start"
                    .into()
            }
            Self::OtherFormat { .. } => {
                "resume with the version of pliant that wrote it, or run the scene from the start".into()
            }
            Self::OtherPrecision { checkpoint, .. } => format!("add `--precision {checkpoint}`"),
            Self::OtherSolver { checkpoint, .. } => {
                format!("set `solver = \"{checkpoint}\"` in `[run]`, or run from the start")
            }
            Self::OtherStep { checkpoint, .. } => format!(
                "leave `step` (or `load-steps`) as it was, or give `--step {checkpoint:e}`; another step needs a run \
                 from the start"
            ),
            Self::OtherScene { until, .. } => {
                let curve = until.map_or(String::new(), |until| {
                    format!(
                        "; a curve without `to` ends with the scene: give such curves `to = {until}`, the former end"
                    )
                });
                format!(
                    "resume with the scene as it was; a mesh, material, constraint, load or output that changed needs a run \
                     from the start{curve}"
                )
            }
            Self::AtTheEnd { .. } => {
                "nothing was changed; to continue, extend the scene with `--until`".into()
            }
            Self::BeyondTheEnd { .. } => {
                "extend the scene with `--until`, or resume from an earlier checkpoint".into()
            }
            Self::Folder(error) => error.remedy.into(),
            Self::OtherOutputs { .. } => {
                "name the folder of the interrupted run with `--out DIR`, or run the scene from the start"
                    .into()
            }
        }
    }
}

fn differing(parts: &[String]) -> String {
    const NAMED: usize = 3;
    match parts {
        [] => "the order of its tables differs".into(),
        [one] => format!("{one} differs"),
        several => {
            let rest = several.len().saturating_sub(NAMED);
            let more = if rest > 0 { format!(" and {}", counted(rest, "more part")) } else { String::new() };
            format!("{}{more} differ", several[..several.len().min(NAMED)].join(", "))
        }
    }
}

impl OwnOrigin {
    fn of(PlannedParticipant { name, scene, built, plan }: &PlannedParticipant) -> Self {
        let mut parts = built.model.fingerprints();
        parts.extend(built.implicit.iter().flat_map(|part| part.fingerprints()));
        parts.push(("`run.tolerance`".into(), fingerprint(&scene.run.tolerance)));
        parts.push(("`run.on-unstable`".into(), fingerprint(&scene.run.on_unstable.unwrap_or_default())));
        parts.push(("`run.mass-scaling`".into(), fingerprint(&scene.run.mass_scaling)));
        if let LoadSteps::Times(times) = &scene.run.load_steps {
            parts.push(("`run.load-steps`".into(), fingerprint(times)));
        }
        if let Some(contacts) = &built.contacts {
            parts.push(("contacts with obstacles and tools".into(), fingerprint(contacts)));
        }
        parts.push(("`run.iterations`".into(), fingerprint(&scene.run.iterations)));
        parts.push(("`run.linear`".into(), fingerprint(&scene.run.linear)));
        // Shells are kept in double precision, whatever their steps are taken in.
        let precision = if built.implicit.is_some() { Precision::Double } else { plan.target.precision };
        let (solver, step) = (scene.run.solver, plan.steps.step);
        Self { name: name.clone(), precision, solver, step, parts }
    }
}

impl Origin {
    fn of(world: &World) -> Self {
        let outputs = world.scene.outputs.iter();
        let outputs = outputs.map(|(name, table)| (format!("output `{name}`"), fingerprint(table)));
        let ties = world.ties.iter().map(|tie| (format!("tie `{}`", tie.name), fingerprint(tie)));
        Self {
            until: world.scene.scene.until,
            participants: world.participants.iter().map(OwnOrigin::of).collect(),
            tables: outputs.chain(ties).collect(),
        }
    }

    /// Returns the compared parts with their fingerprints.
    fn parts(&self) -> Vec<(String, u64)> {
        let of_participants = self.participants.iter().flat_map(|participant| &participant.parts);
        let names: Vec<&String> = self.participants.iter().map(|participant| &participant.name).collect();
        let mut parts: Vec<_> = of_participants.chain(&self.tables).cloned().collect();
        parts.push(("the list of participants".into(), fingerprint(&names)));
        parts
    }

    /// Refuses another scene, precision, solver or step. A longer `until` is no other scene.
    fn check(&self, world: &World) -> Result<(), ResumeError> {
        let now = Self::of(world);
        let pairs = now.participants.iter().zip(&self.participants);
        for (current, before) in pairs.filter(|(current, before)| current.name == before.name) {
            if current.precision != before.precision {
                let [checkpoint, scene] = [before.precision, current.precision].map(Precision::word);
                return Err(ResumeError::OtherPrecision { checkpoint, scene });
            }
            if current.solver != before.solver {
                let [checkpoint, scene] = [before.solver, current.solver].map(SolverName::word);
                return Err(ResumeError::OtherSolver { checkpoint, scene });
            }
        }
        let (current, before) = (now.parts(), self.parts());
        if current != before {
            let differ = |a: &[(String, u64)], b: &[(String, u64)]| -> Vec<String> {
                a.iter().filter(|part| !b.contains(part)).map(|part| part.0.clone()).collect()
            };
            let mut parts = differ(&current, &before);
            parts.extend(differ(&before, &current));
            let mut seen = std::collections::HashSet::new();
            parts.retain(|part| seen.insert(part.clone()));
            let until = (now.until != self.until).then_some(self.until);
            return Err(ResumeError::OtherScene { parts, until });
        }
        for (part, before) in world.lasting(self.until).participants.iter().zip(&self.participants) {
            if part.plan.steps.step != before.step && part.plan.steps.ends.is_none() {
                return Err(ResumeError::OtherStep { checkpoint: before.step, scene: part.plan.steps.step });
            }
        }
        Ok(())
    }
}

/// A checkpoint that was read and is whole.
#[derive(Clone, Debug)]
pub struct Checkpoint {
    path: PathBuf,
    origin: Origin,
    pub(crate) progressed: Progressed,
    /// The participants, each encoded.
    participants: Vec<Vec<u8>>,
    points: Vec<EncodedPoint>,
}

/// A rollback point: how far the run was, and its participants, each encoded.
type EncodedPoint = (Progressed, Vec<Vec<u8>>);

impl Checkpoint {
    /// Reads a checkpoint; a folder means the last one in it.
    ///
    /// # Errors
    /// If the folder has no checkpoint, or the file is no checkpoint, has another format or is damaged.
    pub fn read(path: &Path) -> Result<Self, ResumeError> {
        let unreadable = |path: &Path, error: std::io::Error| ResumeError::Unreadable {
            path: path.to_owned(),
            reason: error.to_string(),
        };
        let mut file = path.to_owned();
        if path.is_dir() {
            let checkpoints = checkpoints_in(path).map_err(|error| unreadable(path, error))?;
            file = checkpoints
                .into_iter()
                .last()
                .ok_or_else(|| ResumeError::NoneIn { path: path.to_owned() })?
                .1;
        }
        let bytes = read_limited(&file, u64::MAX).map_err(|error| unreadable(&file, error))?;
        Self::from_bytes(&file, &bytes)
    }

    /// Decodes a checkpoint from the bytes of a file; errors name `path`.
    ///
    /// # Errors
    /// If the bytes are no checkpoint, have another format or are damaged.
    pub fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Self, ResumeError> {
        let path = path.to_owned();
        let found = bytes.len() as u64;
        let start = bytes.len().min(MAGIC.len());
        if bytes[..start] != MAGIC[..start] || bytes.is_empty() {
            return Err(ResumeError::NotACheckpoint { path });
        }
        let Some(head) = bytes.first_chunk::<HEAD>() else {
            return Err(ResumeError::Truncated { path, found, expected: (HEAD + CRC) as u64 });
        };
        let format = u32::from_le_bytes(*head[8..].first_chunk().unwrap_or(&[0; 4]));
        if format != FORMAT {
            return Err(ResumeError::OtherFormat { path, format });
        }
        let body = u64::from_le_bytes(*head[12..].first_chunk().unwrap_or(&[0; 8]));
        let expected = body.saturating_add((HEAD + CRC) as u64);
        if found < expected {
            return Err(ResumeError::Truncated { path, found, expected });
        }
        let (content, crc) = bytes.split_at(bytes.len() - CRC);
        if found > expected || crc32fast::hash(content).to_le_bytes() != crc {
            return Err(ResumeError::Damaged { path });
        }
        match postcard::from_bytes(&content[HEAD..]) {
            Ok((origin, progressed, participants, points)) => {
                Ok(Self { path, origin, progressed, participants, points })
            }
            Err(_) => Err(ResumeError::Damaged { path }),
        }
    }

    /// The bytes of a file with this body: magic, format and length before it, the CRC-32 after it.
    pub fn framed(body: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEAD + body.len() + CRC);
        bytes.extend(MAGIC);
        bytes.extend(FORMAT.to_le_bytes());
        bytes.extend((body.len() as u64).to_le_bytes());
        bytes.extend(body);
        bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
        bytes
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the time [s] at which the run continues.
    pub fn time(&self) -> f64 {
        self.progressed.time
    }

    /// The time [s] between common instants.
    fn step(&self) -> f64 {
        self.origin.participants.iter().map(|participant| participant.step).fold(0.0, f64::max)
    }

    /// True if a run that ends at a time [s] has no step left: only its last instant may still have to be
    /// written.
    pub(crate) fn is_at_the_end(&self, until: f64) -> bool {
        self.time() + 0.5 * self.step() >= until
    }

    /// Returns the world that continues from here, with the steps of the checkpoint. Only `until` may differ
    /// from the interrupted run.
    ///
    /// # Errors
    /// If this is not the world of the checkpoint, or it ends before.
    pub fn continues(&self, world: &World) -> Result<World, ResumeError> {
        self.origin.check(world)?;
        let (time, until, step) = (self.time(), world.scene.scene.until, self.step());
        // The last instant is the one nearest to the end; round-off is no reason to refuse it.
        if time > until + 0.51 * step {
            return Err(ResumeError::BeyondTheEnd { time, until });
        }
        let simulated = world.simulated();
        if self.state(world, &simulated).is_none() || self.points(world, &simulated).is_none() {
            return Err(ResumeError::Damaged { path: self.path.clone() });
        }
        let mut world = world.clone();
        let common = (until / step - 1e-9).ceil().max(1.0) as u64;
        for (part, origin) in world.participants.iter_mut().zip(&self.origin.participants) {
            if part.plan.steps.ends.is_none() {
                let ratio = (step / origin.step).round().max(1.0) as u64;
                (part.plan.steps.step, part.plan.steps.number) = (origin.step, common * ratio);
            }
        }
        Ok(world)
    }

    /// The state of a world, which is given with and without its tables; `None` where it has other sizes.
    pub(crate) fn state(&self, world: &World, simulated: &pliant_sim::Setup) -> Option<SimulationState> {
        self.state_at(&self.progressed, &self.participants, world, simulated)
    }

    /// The rollback points of a world; `None` where one has other sizes.
    pub(crate) fn points(&self, world: &World, simulated: &pliant_sim::Setup) -> Option<Vec<Point>> {
        let point = |(progressed, participants): &EncodedPoint| {
            let state = self.state_at(progressed, participants, world, simulated)?;
            Some(Point { progressed: progressed.clone(), state })
        };
        self.points.iter().map(point).collect()
    }

    fn state_at(
        &self,
        progressed: &Progressed,
        participants: &[Vec<u8>],
        world: &World,
        simulated: &pliant_sim::Setup,
    ) -> Option<SimulationState> {
        let parts = &world.participants;
        let constraints: usize = parts.iter().map(|part| part.built.model.constraints.len()).sum();
        let history = &progressed.history;
        let listed = parts.iter().flat_map(|part| &part.built.model.constraints);
        let filled = listed.filter(|constraint| constraint.motion.encloses()).count();
        let whole = history.reactions.iter().all(|row| row.len() == constraints)
            && history.enclosed.len() == filled * history.times.len()
            && progressed.watched.len() == parts.len()
            && progressed.outputs.len() == world.scene.outputs.len()
            && self.origin.participants.len() == parts.len();
        if !whole {
            return None;
        }
        SimulationState::decode(simulated, participants).filter(|state| state.time() == progressed.time)
    }
}

/// Writes the checkpoints of a run.
pub(crate) struct Checkpoints<'a> {
    folder: &'a OutputFolder,
    origin: Origin,
    schedule: Schedule,
}

impl<'a> Checkpoints<'a> {
    /// For a run that requests checkpoints and starts at `time` [s]. A run that continues another keeps the
    /// duration from which the first run took its step.
    pub fn new(
        world: &World,
        folder: &'a OutputFolder,
        time: f64,
        before: Option<&Checkpoint>,
    ) -> Option<Self> {
        let schedule = Self::schedule(world, time)?;
        let mut origin = Origin::of(world);
        origin.until = before.map_or(origin.until, |before| before.origin.until);
        Some(Self { folder, origin, schedule })
    }

    /// Goes back to an earlier time [s] of the run.
    pub fn go_back(&mut self, world: &World, time: f64) {
        self.schedule = Self::schedule(world, time).unwrap_or(self.schedule);
    }

    fn schedule(world: &World, time: f64) -> Option<Schedule> {
        let every = world.scene.run.checkpoint?.every;
        Some(Schedule::after(every, time, world.step_from(time)))
    }

    /// True if a checkpoint has to be written at an instant.
    pub fn is_due(&mut self, time: f64, step: f64, last: bool) -> bool {
        self.schedule.is_due(time, step, last)
    }

    /// Number of steps that a run may take from a time without missing a checkpoint.
    pub fn stride(&self, time: f64, step: f64) -> u64 {
        self.schedule.stride(time, step)
    }

    /// Removes checkpoints later than a number of steps.
    pub(crate) fn remove_after(&self, steps: u64) -> Result<(), OutputError> {
        let folder = self.folder.path();
        let checkpoints = checkpoints_in(folder).map_err(|error| OutputError::new(folder, error))?;
        checkpoints
            .iter()
            .filter(|(taken, _)| *taken > steps)
            .try_for_each(|(_, later)| fs::remove_file(later).map_err(|error| OutputError::new(later, error)))
    }

    /// Writes a checkpoint, and removes earlier checkpoints except the last two.
    pub fn write(
        &self,
        progressed: &Progressed,
        state: &SimulationState,
        points: &[Point],
    ) -> Result<PathBuf, OutputError> {
        let path = self.folder.path().join(name(progressed.steps));
        let failed = |reason: &dyn std::fmt::Display| OutputError::new(&path, reason);
        let bytes = encode(&self.origin, progressed, state, points).map_err(|error| failed(&error))?;
        replace(&path, |file| file.write_all(&bytes).and_then(|()| file.sync_all()))
            .map_err(|error| failed(&error))?;
        let mut earlier = checkpoints_in(self.folder.path()).map_err(|error| failed(&error))?;
        earlier.retain(|(steps, _)| *steps <= progressed.steps);
        for (_, old) in &earlier[..earlier.len().saturating_sub(KEPT)] {
            fs::remove_file(old).map_err(|error| OutputError::new(old, error))?;
        }
        Ok(path)
    }
}

fn encode(
    origin: &Origin,
    progressed: &Progressed,
    state: &SimulationState,
    points: &[Point],
) -> postcard::Result<Vec<u8>> {
    let point = |Point { progressed, state }: &Point| Ok((progressed.clone(), state.encode()?));
    let points: Vec<EncodedPoint> = points.iter().map(point).collect::<postcard::Result<_>>()?;
    Ok(Checkpoint::framed(&postcard::to_stdvec(&(origin, progressed, state.encode()?, points))?))
}

const PREFIX: &str = "checkpoint-";
const SUFFIX: &str = ".pliant";

/// The file of a checkpoint after some steps; names sort as the steps do.
fn name(steps: u64) -> String {
    format!("{PREFIX}{steps:010}{SUFFIX}")
}

/// The steps in the name of a checkpoint; none for other names.
pub(crate) fn steps_of(name: &str) -> Option<u64> {
    let digits = name.strip_prefix(PREFIX)?.strip_suffix(SUFFIX)?;
    digits.bytes().all(|byte| byte.is_ascii_digit()).then(|| digits.parse().ok())?
}

/// The checkpoints in a folder with their steps, in order.
fn checkpoints_in(folder: &Path) -> std::io::Result<Vec<(u64, PathBuf)>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let steps = path.file_name().and_then(|name| steps_of(name.to_str()?));
        found.extend(steps.map(|steps| (steps, path)));
    }
    found.sort();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::{History, Watched};
    use crate::testing::{CUBE, read, scene};

    const CHECKPOINTED: &str = "[run]\nprecision = 'single'\ncheckpoint = { every = 0.05 }\n";

    fn small() -> Vec<u8> {
        let world = World::new(&scene(CHECKPOINTED)).unwrap();
        let progressed = Progressed {
            time: 0.05,
            steps: 7,
            wall_seconds: 1.0,
            watched: vec![Watched::default()],
            history: History::default(),
            sampling: Schedule::new(0.1),
            outputs: Vec::new(),
        };
        let state = world.simulation().unwrap().state().unwrap();
        let point = Point {
            progressed: Progressed { time: 0.0, steps: 0, ..progressed.clone() },
            state: state.clone(),
        };
        encode(&Origin::of(&world), &progressed, &state, &[point]).unwrap()
    }

    #[test]
    fn every_truncation_and_every_flipped_bit_is_refused() {
        let whole = small();
        let path = Path::new("x.pliant");
        let read = Checkpoint::from_bytes(path, &whole).unwrap();
        assert_eq!(read.time(), 0.05);
        for length in 0..whole.len() {
            let error = Checkpoint::from_bytes(path, &whole[..length]).unwrap_err();
            let truncated = matches!(error, ResumeError::Truncated { .. });
            assert!(truncated || (length == 0 && matches!(error, ResumeError::NotACheckpoint { .. })));
        }
        for place in 0..whole.len() {
            for bit in 0..8 {
                let mut flipped = whole.clone();
                flipped[place] ^= 1 << bit;
                let error = Checkpoint::from_bytes(path, &flipped).unwrap_err();
                let fits = match place {
                    0..8 => matches!(error, ResumeError::NotACheckpoint { .. }),
                    8..12 => matches!(error, ResumeError::OtherFormat { .. }),
                    12..20 => matches!(error, ResumeError::Truncated { .. } | ResumeError::Damaged { .. }),
                    _ => matches!(error, ResumeError::Damaged { .. }),
                };
                assert!(fits, "byte {place}: {error}");
            }
        }
        let longer = [whole.as_slice(), b"x"].concat();
        assert!(matches!(Checkpoint::from_bytes(path, &longer), Err(ResumeError::Damaged { .. })));
    }

    /// A body whose checksum was made to fit must not bring the program down either.
    #[test]
    fn a_body_of_nonsense_with_a_right_checksum_is_refused() {
        let whole = small();
        let world = World::new(&scene(CHECKPOINTED)).unwrap();
        for place in HEAD..whole.len() - CRC {
            let mut body = whole[HEAD..whole.len() - CRC].to_vec();
            body[place - HEAD] = body[place - HEAD].wrapping_add(0x7f);
            let forged = Checkpoint::framed(&body);
            if let Ok(read) = Checkpoint::from_bytes(Path::new("x.pliant"), &forged) {
                let _ = read.state(&world, &world.simulated());
                let _ = read.points(&world, &world.simulated());
            }
        }
    }

    /// The layout of [`SimulationState`] and [`Progressed`] decides which checkpoints can be read. Whoever
    /// changes it gives [`FORMAT`] the next number, and this test the new bytes.
    #[test]
    fn the_layout_of_format_20_is_as_it_was() {
        let bytes = |run: &str| {
            let world = World::new(&scene(run)).unwrap();
            world.simulation().unwrap().encode().unwrap()[0].len()
        };
        let shell = CUBE.replace(
            "{ block = { size = [0.2, 0.1, 0.1], cells = [2, 2, 2] }, as = \"hexes\" }",
            "{ plate = { size = [0.2, 0.1], cells = [2, 2] } }",
        );
        let shell = shell
            .replace("density", "model = 'shell'\nthickness = 0.001\ndensity")
            .replace("'z-min'", "'x-min'")
            .replace("\"z-min\"", "\"x-min\"");
        let shell = World::new(&read(&format!("{shell}[run]\nsolver = 'implicit'\n"))).unwrap();
        let shell = shell.simulation().unwrap().encode().unwrap()[0].len();
        let explicit = bytes("[run]\nprecision = 'single'\n");
        let quasi_static = bytes("[run]\nprecision = 'single'\nsolver = 'quasi-static'\n");
        assert_eq!((FORMAT, explicit, quasi_static, shell), (20, 1137, 1504, 1100));
    }
}
