//! Errors of the engine as the exceptions of `pliant.errors`, with their places.

use miette::{GraphicalReportHandler, GraphicalTheme};
use pliant_format::diagnostic::{SceneErrors, Severity};
use pliant_format::source::Source;
use pliant_run::{OutputError, ResumeError};
use pliant_sim::{Failure, FailureKind};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Reason why a call fails.
#[derive(Debug)]
pub enum Trouble {
    /// Mistakes in a scene.
    Scene(Box<SceneErrors>),
    /// A simulation that has failed.
    Failure(Box<Failure>),
    /// A file that can't be written.
    Output(OutputError),
    /// A checkpoint that a run can't resume from.
    Resume(Box<ResumeError>),
    /// A mesh or an image that can't be used: its file, and why.
    Mesh(Option<String>, String),
    /// No picture: why, and what to do.
    Device(String),
    /// A call while another one computes, or after a fork.
    Busy(String),
    /// A call after `close`.
    Closed,
    /// A panic: its text and place.
    Internal(String),
    /// A value that can't be.
    Value(String),
}

impl From<SceneErrors> for Trouble {
    fn from(errors: SceneErrors) -> Self {
        Self::Scene(Box::new(errors))
    }
}

impl From<Failure> for Trouble {
    fn from(failure: Failure) -> Self {
        match failure.kind {
            FailureKind::Device => Self::Device(failure.message),
            FailureKind::Input => Self::Value(failure.message),
            _ => Self::Failure(Box::new(failure)),
        }
    }
}

impl From<OutputError> for Trouble {
    fn from(error: OutputError) -> Self {
        Self::Output(error)
    }
}

impl From<ResumeError> for Trouble {
    fn from(error: ResumeError) -> Self {
        Self::Resume(Box::new(error))
    }
}

impl From<Trouble> for PyErr {
    fn from(trouble: Trouble) -> Self {
        Python::attach(|py| trouble.raised(py).unwrap_or_else(|error| error))
    }
}

impl Trouble {
    fn raised(self, py: Python<'_>) -> PyResult<PyErr> {
        let fields = PyDict::new(py);
        let (class, message) = match self {
            Self::Scene(errors) => {
                fields.set_item("diagnostics", diagnostics(py, &errors)?)?;
                ("SceneError", underlined(&errors))
            }
            Self::Failure(failure) => {
                fields.set_item("kind", failure.kind.word())?;
                fields.set_item("body", failure.body.as_deref())?;
                fields.set_item("element", failure.element)?;
                fields.set_item("node", failure.node)?;
                fields.set_item("time", failure.time)?;
                let step = failure.load_step.as_deref();
                let class = match failure.kind {
                    FailureKind::NotConverged | FailureKind::Singular => {
                        fields.set_item("load_step", step.map(|step| step.number))?;
                        fields.set_item("residual", step.and_then(|step| step.residual))?;
                        "ConvergenceError"
                    }
                    FailureKind::Blocked => {
                        let blocked = failure.blocked.as_deref();
                        fields.set_item("driver", blocked.map(|blockage| blockage.driver.clone()))?;
                        fields.set_item("force", blocked.map(|blockage| blockage.force))?;
                        "BlockedError"
                    }
                    FailureKind::NotFinite
                    | FailureKind::Inverted
                    | FailureKind::Unbalanced
                    | FailureKind::Unstable => "UnstableError",
                    _ => "SimulationError",
                };
                (class, failure.message)
            }
            Self::Output(error) => {
                fields.set_item("path", error.path.display().to_string())?;
                ("OutputError", format!("{error}; {}", error.remedy))
            }
            Self::Resume(error) => ("ResumeError", format!("{error}; {}", error.remedy())),
            Self::Mesh(path, message) => {
                fields.set_item("path", path)?;
                ("MeshError", message)
            }
            Self::Device(message) => ("DeviceError", message),
            Self::Busy(message) => ("BusyError", message),
            Self::Closed => ("ClosedError", "the simulation is closed; make a new one".to_owned()),
            Self::Internal(message) => ("InternalError", message),
            Self::Value(message) => return Ok(pyo3::exceptions::PyValueError::new_err(message)),
        };
        let class = py.import("pliant.errors")?.getattr(class)?;
        Ok(PyErr::from_value(class.call((message,), Some(&fields))?))
    }
}

/// The mistakes of a scene with its lines underlined, without colours.
fn underlined(errors: &SceneErrors) -> String {
    let mut text = String::new();
    let handler = GraphicalReportHandler::new_themed(GraphicalTheme::unicode_nocolor());
    match handler.render_report(&mut text, errors) {
        Ok(()) => text.trim_end().to_owned(),
        Err(_) => errors.plain().to_string(),
    }
}

/// Findings as `Diagnostic`s.
pub fn diagnostics<'py>(py: Python<'py>, errors: &SceneErrors) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let class = py.import("pliant.errors")?.getattr("Diagnostic")?;
    let source = Source::parse(errors.name(), errors.text());
    let one = |found: &pliant_format::diagnostic::Diagnostic| {
        let place = errors.line_and_column(found);
        let severity = match found.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        let set = found.option.as_deref().and_then(|option| option.strip_prefix("--set "));
        let key = match (set, &found.span) {
            (Some(set), _) => set.split('=').next().map(|key| key.trim().to_owned()),
            (None, span) => {
                source.as_ref().ok().zip(span.as_ref()).and_then(|(source, span)| source.key_at(span.start))
            }
        };
        class.call1((
            severity,
            &found.message,
            errors.name(),
            place.map(|(line, _)| line),
            place.map(|(_, column)| column),
            key,
            &found.label,
            &found.help,
        ))
    };
    errors.diagnostics().iter().map(one).collect()
}

/// The error of an engine without its Python half: the package is not whole.
pub fn broken(error: impl std::fmt::Display) -> PyErr {
    PyRuntimeError::new_err(error.to_string())
}
