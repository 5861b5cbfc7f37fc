//! Participants: bodies that one stepper advances together, apart from the other bodies of the scene.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{
    ControlTable, DesignName, DeviceName, IntegratorName, LinearWay, LoadSteps, MassScalingTable,
    OnUnstableName, PrecisionName, RunTable, SolverName, StepChoice,
};

/// Bodies with a solver and a step of their own. Bodies that no participant names follow `[run]`: with the
/// solvers `implicit` and `static` all together, else the solids together and the shells together.
/// Participants advance at their own steps and meet at common instants, where outputs are written. A key that
/// is left out has the value of `[run]`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ParticipantTable {
    /// The bodies: solids or shells, with the solvers `implicit` and `static` also both.
    pub bodies: Vec<String>,
    /// Same as in `[run]`.
    #[serde(default)]
    pub solver: Option<SolverName>,
    /// Time step [s], as in `[run]`. Common instants are as far apart as the longest step of all
    /// participants; shorter steps are made a little shorter where they don't divide it.
    #[serde(default)]
    pub step: Option<StepChoice>,
    /// Same as in `[run]`.
    #[serde(default)]
    pub on_unstable: Option<OnUnstableName>,
    /// Same as in `[run]`.
    #[serde(default)]
    pub mass_scaling: Option<MassScalingTable>,
    /// Same as in `[run]`.
    #[serde(default)]
    pub load_steps: Option<LoadSteps>,
    /// Same as in `[run]`.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
    pub tolerance: Option<f64>,
    /// Same as in `[run]`.
    #[serde(default)]
    #[schemars(range(min = 1, max = 10_000))]
    pub iterations: Option<u32>,
    /// Speed [m/s] below which a Newton step in contact is the last one, as in `[run]`.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub speed_tolerance: Option<f64>,
    /// Same as in `[run]`.
    #[serde(default)]
    pub accept_unconverged: Option<bool>,
    /// Same as in `[run]`.
    #[serde(default)]
    pub integrator: Option<IntegratorName>,
    /// Same as in `[run]`.
    #[serde(default)]
    pub linear: Option<LinearWay>,
    /// Same as in `[run]`.
    #[serde(default)]
    pub control: Option<ControlTable>,
    /// Same as in `[run]`.
    #[serde(default)]
    pub precision: Option<PrecisionName>,
    /// Same as in `[run]`.
    #[serde(default)]
    pub device: Option<DeviceName>,
    /// Same as in `[run]`.
    #[serde(default)]
    pub adapter: Option<String>,
    /// Same as in `[run]`.
    #[serde(default)]
    pub design: Option<DesignName>,
}

impl ParticipantTable {
    /// Returns `[run]` with its keys replaced by the keys that are given here.
    pub(crate) fn over(&self, run: &RunTable) -> RunTable {
        let run = run.clone();
        RunTable {
            solver: self.solver.unwrap_or(run.solver),
            step: self.step.unwrap_or(run.step),
            on_unstable: self.on_unstable.or(run.on_unstable),
            mass_scaling: self.mass_scaling.or(run.mass_scaling),
            load_steps: self.load_steps.clone().unwrap_or(run.load_steps),
            tolerance: self.tolerance.or(run.tolerance),
            iterations: self.iterations.or(run.iterations),
            speed_tolerance: self.speed_tolerance.or(run.speed_tolerance),
            accept_unconverged: self.accept_unconverged.or(run.accept_unconverged),
            integrator: self.integrator.or(run.integrator),
            linear: self.linear.clone().unwrap_or(run.linear),
            control: self.control.clone().or(run.control),
            precision: self.precision.or(run.precision),
            device: self.device.unwrap_or(run.device),
            adapter: self.adapter.clone().or(run.adapter),
            design: self.design.or(run.design),
            allow_hourglass: run.allow_hourglass,
            threads: run.threads,
            checkpoint: run.checkpoint,
        }
    }
}
