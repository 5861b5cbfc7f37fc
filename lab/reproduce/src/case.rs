//! One result of the literature: its content, corrections to the source, and the result here.

use pliant_explicit::StepError;
use pliant_format::diagnostic::SceneErrors;
use pliant_gpu::{GpuError, StepFailure};
use pliant_implicit::{ModelError, SolveError};
use pliant_mechanics::model::Contradiction;
use pliant_meshing::MeshingError;
use pliant_sim::Failure;
use serde::Serialize;

/// A result of the literature.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Its name on the command line: `fig-6.3`.
    pub id: &'static str,
    /// A short title.
    pub title: &'static str,
    /// A summary of the source.
    pub shows: &'static str,
    /// Errors in the printed source.
    pub corrections: &'static [Correction],
    /// Approximate time on two cores [s].
    pub seconds: f64,
    /// Function that computes it.
    pub(crate) compute: fn() -> Result<Findings, CaseError>,
}

/// A correction of an error in the printed source.
#[derive(Clone, Copy, Debug)]
pub struct Correction {
    /// The location and the printed text.
    pub printed: &'static str,
    /// The correct text.
    pub correct: &'static str,
    /// The reason.
    pub why: &'static str,
}

/// The results of a case.
#[derive(Clone, Debug, Default)]
pub struct Findings {
    /// Numbers.
    pub rows: Vec<Row>,
    /// Plots and pictures.
    pub figures: Vec<Figure>,
}

/// A plot or a picture.
#[derive(Clone, Debug)]
pub struct Figure {
    /// An SVG element; `None` for a picture without a renderer.
    pub svg: Option<String>,
    /// The caption.
    pub caption: String,
}

/// A number and its reference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Its case.
    pub id: &'static str,
    /// The quantity.
    pub quantity: String,
    /// Its unit; empty for a plain number.
    pub unit: &'static str,
    /// The reference; 0 for a deviation; `None` if unknown.
    pub reference: Option<f64>,
    /// The computed value; `None` if the case failed.
    pub computed: Option<f64>,
    /// The tolerance, in the unit of the row.
    pub tolerance: Option<f64>,
    /// True if it is within the tolerance; `None` without one.
    pub pass: Option<bool>,
    /// The source of the reference.
    pub source: &'static str,
    /// True if the number depends on the machine.
    #[serde(skip)]
    pub machine: bool,
}

impl Row {
    /// A number that must come within `tolerance` of `reference`.
    pub(crate) fn judged(
        quantity: impl Into<String>,
        unit: &'static str,
        [reference, tolerance]: [f64; 2],
        computed: f64,
        source: &'static str,
    ) -> Self {
        let pass = (computed - reference).abs() <= tolerance;
        Self {
            tolerance: Some(tolerance),
            pass: Some(pass),
            reference: Some(reference),
            ..Self::shown(quantity, unit, computed, source)
        }
    }

    /// A relative deviation that may be up to `limit`.
    pub(crate) fn deviation(
        quantity: impl Into<String>,
        limit: f64,
        computed: f64,
        source: &'static str,
    ) -> Self {
        Self::judged(quantity, "", [0.0, limit], computed, source)
    }

    /// A number that is not judged.
    pub(crate) fn shown(
        quantity: impl Into<String>,
        unit: &'static str,
        computed: f64,
        source: &'static str,
    ) -> Self {
        Self {
            id: "",
            quantity: quantity.into(),
            unit,
            reference: None,
            computed: Some(computed),
            tolerance: None,
            pass: None,
            source,
            machine: false,
        }
    }

    /// A measurement of this machine, with a measurement of another machine for comparison; not judged.
    pub(crate) fn timed(
        quantity: impl Into<String>,
        unit: &'static str,
        reference: Option<f64>,
        computed: f64,
        source: &'static str,
    ) -> Self {
        Self { reference, machine: true, ..Self::shown(quantity, unit, computed, source) }
    }
}

/// The error of a case.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    /// A simulation can't be made, or a step failed.
    #[error(transparent)]
    Simulated(#[from] Failure),
    /// A bare step under the clock failed.
    #[error(transparent)]
    Step(#[from] StepError),
    /// A limit was asked of a model whose constraints contradict each other.
    #[error(transparent)]
    Contradiction(#[from] Contradiction),
    /// A body could not be meshed.
    #[error(transparent)]
    Mesh(#[from] MeshingError),
    /// A mesh is not a valid shell.
    #[error(transparent)]
    Shell(#[from] ModelError),
    /// No equilibrium of a shell, or a step of it failed.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// A scene is wrong.
    #[error("{}", .0.plain())]
    Scene(#[from] SceneErrors),
    /// A model did not come to rest.
    #[error("not at rest after {until} s: creeps by {creep:.1e} of its displacement in 0.1 s")]
    Moving {
        /// Time [s].
        until: f64,
        /// Movement in a tenth of a second at the present speed, over the largest displacement.
        creep: f64,
    },
    /// A device failed.
    #[error(transparent)]
    Device(#[from] GpuError),
    /// A step on a device failed.
    #[error(transparent)]
    OnDevice(#[from] StepFailure),
    /// A scene could not be run.
    #[error("{0}")]
    Run(String),
    /// A figure could not be drawn.
    #[error("a figure could not be drawn: {0}")]
    Drawing(String),
}

impl Case {
    /// Computes the case. If it fails, its only row reports the error.
    pub fn run(&self) -> Findings {
        let mut findings = (self.compute)().unwrap_or_else(|error| Findings {
            rows: vec![Row {
                computed: None,
                pass: Some(false),
                ..Row::shown(format!("the case failed: {error}"), "", 0.0, "")
            }],
            figures: Vec::new(),
        });
        for row in &mut findings.rows {
            row.id = self.id;
        }
        findings
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_passes_within_its_tolerance_and_never_when_it_is_not_a_number() {
        let pass = |computed| Row::judged("force", "N", [8.75, 0.1], computed, "").pass;
        assert_eq!([8.84, 8.66, 8.86, f64::NAN].map(pass), [true, true, false, false].map(Some));
        assert_eq!(Row::shown("force", "N", 1.0, "").pass, None);
    }

    #[test]
    fn a_failed_case_is_a_failed_row() {
        let compute = || Err(CaseError::Drawing("no ink".into()));
        let case = Case { id: "x", title: "", shows: "", corrections: &[], seconds: 0.0, compute };
        let findings = case.run();
        assert_eq!((findings.rows.len(), findings.rows[0].pass), (1, Some(false)));
        assert!(findings.rows[0].quantity.contains("no ink"));
    }
}
