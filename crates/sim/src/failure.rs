//! Failures of a simulation.

use std::any::Any;
use std::fmt;

use pliant_explicit::{RelaxationError, StepError};
use serde::{Serialize, Serializer};

use pliant_geometry::words::number;

/// Kind of a failure: words of `--json` and of exceptions in Python.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FailureKind {
    /// A displacement is not finite.
    NotFinite,
    /// An element is inverted.
    Inverted,
    /// Energies do not balance.
    Unbalanced,
    /// The largest stable step fell below the step.
    Unstable,
    /// The stiffness is singular.
    Singular,
    /// No equilibrium was found.
    NotConverged,
    /// A tool or a constraint is blocked.
    Blocked,
    /// Surfaces go through each other.
    Intersecting,
    /// Hourglass modes hold much of the energy.
    Hourglass,
    /// The system has no room.
    Memory,
    /// The GPU failed.
    Device,
    /// An output could not be written.
    Output,
    /// The input cannot be simulated.
    Input,
    /// Someone stopped the run.
    Interrupted,
}

impl FailureKind {
    /// Its word.
    pub fn word(self) -> &'static str {
        match self {
            Self::NotFinite => "not-finite",
            Self::Inverted => "inverted",
            Self::Unbalanced => "unbalanced",
            Self::Unstable => "unstable",
            Self::Singular => "singular",
            Self::NotConverged => "not-converged",
            Self::Blocked => "blocked",
            Self::Intersecting => "intersecting",
            Self::Hourglass => "hourglass",
            Self::Memory => "memory",
            Self::Device => "device",
            Self::Output => "output",
            Self::Input => "input",
            Self::Interrupted => "interrupted",
        }
    }

    /// True if shorter steps may help: these failures end explicit steps that are too long.
    pub(crate) fn is_of_long_steps(self) -> bool {
        matches!(self, Self::NotFinite | Self::Inverted | Self::Unbalanced | Self::Unstable)
    }
}

impl Serialize for FailureKind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.word())
    }
}

impl fmt::Display for FailureKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

/// A failure, with its place and time.
#[derive(Clone, Debug, Serialize)]
pub struct Failure {
    /// Its kind.
    pub kind: FailureKind,
    /// The body, where it is about one.
    pub body: Option<Box<str>>,
    /// The element, counted from 0.
    pub element: Option<u32>,
    /// The node, counted from 0.
    pub node: Option<u32>,
    /// Time [s].
    pub time: Option<f64>,
    /// The load step, or the step whose equations were not solved.
    pub load_step: Option<Box<FailedLoadStep>>,
    /// The blocked tool or constraint, where the kind is `blocked`.
    pub blocked: Option<Box<BlockedDriver>>,
    /// Message: the cause and a remedy.
    pub message: String,
    /// The remedy at the end of the message; empty where the message says it otherwise.
    #[serde(skip)]
    pub remedy: &'static str,
}

/// A load step that came to no equilibrium, or an implicit step whose equations were not solved.
#[derive(Clone, Debug, Serialize)]
pub struct FailedLoadStep {
    /// Its number, counted from 1.
    pub number: u64,
    /// Number of load steps.
    pub of: u64,
    /// Iterations spent on the last try.
    pub iterations: usize,
    /// The relative residual that was reached; none if an element or a displacement was lost on the way.
    pub residual: Option<f64>,
}

/// A tool or a constraint that stands where something is in its way.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BlockedDriver {
    /// Its name.
    pub driver: String,
    /// The force [N] with which it pushes there.
    pub force: f64,
    /// The part of its way in the step that it could go, from 0 to 1.
    pub part: f64,
    /// The least gap [m].
    pub gap: f64,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Failure {}

impl Failure {
    /// A failure of a kind, at a time [s] of the simulation.
    pub fn new(kind: FailureKind, message: String, time: Option<f64>) -> Self {
        Self {
            kind,
            body: None,
            element: None,
            node: None,
            time,
            load_step: None,
            blocked: None,
            message,
            remedy: "",
        }
    }

    /// An input that can't be simulated.
    pub fn input(error: &dyn fmt::Display) -> Self {
        Self::new(FailureKind::Input, error.to_string(), None)
    }

    /// A step that was stopped before its end, at the time [s] of its start.
    pub(crate) fn stopped(time: f64) -> Self {
        let message = format!("stopped within the step after t = {} s, which was not taken", number(time));
        Self::new(FailureKind::Interrupted, message, Some(time))
    }

    /// True if the user interrupted the run.
    pub fn is_interrupted(&self) -> bool {
        self.kind == FailureKind::Interrupted
    }

    /// Returns the failure with another remedy.
    #[must_use]
    pub fn advised(mut self, remedy: &str) -> Self {
        if let Some(cause) = self.message.strip_suffix(self.remedy).filter(|_| !self.remedy.is_empty()) {
            self.message = format!("{cause}{remedy}");
            self.remedy = "";
        }
        self
    }

    /// Makes the failure of a load step without equilibrium, counted from 1 (0: the loads at the start), out
    /// of `of`.
    pub(crate) fn load_step(error: &RelaxationError, number: u64, of: u64) -> Self {
        let which = match number {
            0 => "the loads at t = 0".to_owned(),
            _ => format!("load step {number} of {of}"),
        };
        let message = format!("{which}: {error}; {}", error.remedy());
        let (kind, body, element, node, time, iterations, residual) = match error {
            RelaxationError::Stopped { time } => {
                return Self::new(FailureKind::Interrupted, message, Some(*time));
            }
            RelaxationError::NotFinite { body, node, iterations, time, .. } => {
                (FailureKind::NotFinite, body, None, *node, *time, *iterations, None)
            }
            RelaxationError::Inverted { body, element, node, iterations, time, .. } => {
                (FailureKind::Inverted, body, Some(*element), *node, *time, *iterations, None)
            }
            RelaxationError::NotConverged { body, node, residual, iterations, time, .. } => {
                (FailureKind::NotConverged, body, None, *node, *time, *iterations, Some(*residual))
            }
        };
        Self {
            body: Some(body.as_str().into()),
            element,
            node: Some(node),
            load_step: Some(Box::new(FailedLoadStep { number, of, iterations, residual })),
            ..Self::new(kind, message, Some(time))
        }
    }
}

impl From<&StepError> for Failure {
    fn from(error: &StepError) -> Self {
        let message = format!("{error}; {}", error.remedy());
        let (kind, body, element, node, time) = match error {
            StepError::NotFinite { body, node, time } => (FailureKind::NotFinite, body, None, *node, *time),
            StepError::Inverted { body, element, node, time, .. } => {
                (FailureKind::Inverted, body, Some(*element), *node, *time)
            }
            StepError::BelowLimit { body, element, node, time, .. } => {
                (FailureKind::Unstable, body, Some(*element), *node, *time)
            }
            StepError::Unbalanced { body, node, time, .. } => {
                (FailureKind::Unbalanced, body, None, *node, *time)
            }
        };
        Self {
            body: Some(body.as_str().into()),
            element,
            node: Some(node),
            remedy: error.remedy(),
            ..Self::new(kind, message, Some(time))
        }
    }
}

/// Returns the message of a panic.
pub fn panicked(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no message")
}

#[cfg(test)]
mod tests {
    /// Each kind has a row in the page of errors, with what to do.
    #[test]
    fn the_page_of_errors_has_every_kind() {
        let page = include_str!("../../../docs/reference/errors.md");
        let words = include_str!("failure.rs").lines().filter_map(|line| {
            line.trim().strip_prefix("Self::")?.split_once(" => \"")?.1.strip_suffix("\",")
        });
        let words: Vec<&str> = words.collect();
        assert!(words.len() >= 14, "{words:?}");
        for word in words {
            assert!(page.contains(&format!("\n| `{word}` | ")), "docs/reference/errors.md lacks `{word}`");
        }
    }
}
