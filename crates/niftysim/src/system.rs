//! Settings of a whole NiftySim model.

use super::error::{Fault, ImportProblem};
use super::geometry::positive;
use super::xml::{XmlElement, child, fault, needed, number};

/// `<SystemParams>`.
#[derive(Clone, Copy, Debug)]
pub(super) struct System {
    /// Time step [s].
    pub step: f64,
    /// Total time [s], on which load shapes are stretched.
    pub total: f64,
    /// Damping [1/s].
    pub damping: f64,
    /// Density of materials without one [kg/m³].
    pub density: Option<f64>,
    /// Hourglass stiffness as a multiple of λ + 2μ.
    pub hourglass: Option<f64>,
}

/// Most steps accepted; no model takes as many.
const MOST_STEPS: f64 = 1e12;
/// Syntax of the settings, for messages.
pub(super) const SYSTEM: &str = "<SystemParams> with <TimeStep>, <TotalTime> and <DampingCoeff>";

impl System {
    /// Reads the settings of a model.
    pub fn read(root: XmlElement<'_>) -> Result<Self, Fault> {
        let of = needed(root, "SystemParams", SYSTEM)?;
        let at_least_0 = |element, what| {
            let value = number(element)?;
            let problem = ImportProblem::OutOfRange { what, value, range: "at least 0" };
            if value >= 0.0 { Ok(value) } else { Err(fault(element, problem)) }
        };
        let step = needed(of, "TimeStep", "<TimeStep>1e-4</TimeStep> (seconds)")?;
        let until = needed(of, "TotalTime", "<TotalTime>1</TotalTime> (seconds)")?;
        let damping = needed(of, "DampingCoeff", "<DampingCoeff>0.5</DampingCoeff>")?;
        let steps = positive(until, "the total time")? / positive(step, "the time step")?;
        if steps > MOST_STEPS {
            let (what, range) = ("the total time over the time step", "at most 1e12");
            return Err(fault(of, ImportProblem::OutOfRange { what, value: steps, range }));
        }
        Ok(Self {
            step: number(step)?,
            total: number(until)?,
            damping: at_least_0(damping, "the damping")?,
            density: child(of, "Density").map(|of| positive(of, "the density")).transpose()?,
            hourglass: child(of, "HGKappa")
                .map(|of| at_least_0(of, "the hourglass stiffness"))
                .transpose()?,
        })
    }
}

impl System {
    /// The end of NiftySim's last step [s]. NiftySim takes one step more than the total time holds, and
    /// writes its outputs after this step.
    pub fn end(&self) -> f64 {
        let end = ((self.total / self.step).round() + 1.0) * self.step;
        // Rid of the product's round-off, which would be read as intention.
        format!("{end:.12e}").parse().unwrap_or(end)
    }
}
