//! Settings for the equations of the solvers `implicit` and `static`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Axis;

/// Solver of linear equations: one word, or a table with settings.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum LinearWay {
    /// With the usual settings.
    Named(LinearName),
    /// With settings.
    Set(LinearTable),
}

impl Default for LinearWay {
    fn default() -> Self {
        Self::Named(LinearName::default())
    }
}

impl LinearWay {
    /// Its settings.
    pub fn table(&self) -> LinearTable {
        match self {
            Self::Named(name) => LinearTable::usual(*name),
            Self::Set(table) => table.clone(),
        }
    }
}

/// A way to solve linear equations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LinearName {
    /// Factors of the symmetric stiffness: robust, and detects unstable equilibria.
    #[default]
    Direct,
    /// Factors of the stiffness with the unsymmetric part of loads: twice the work, for moments about fixed
    /// axes.
    Unsymmetric,
    /// Conjugate gradients: for stable equilibria.
    ConjugateGradients,
}

/// A way to solve linear equations with its settings.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct LinearTable {
    /// The way.
    pub by: LinearName,
    /// Residual over the right-hand side at which conjugate gradients stop.
    #[serde(default = "thousandth")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
    pub tolerance: f64,
    /// Most iterations of conjugate gradients.
    #[serde(default = "thousand")]
    #[schemars(range(min = 1, max = 1_000_000))]
    pub iterations: u32,
    /// Preconditioner, by which conjugate gradients multiply residuals.
    #[serde(default)]
    pub preconditioner: PreconditionerName,
    /// True if an `implicit` step accepts the result of conjugate gradients when their iterations run out,
    /// instead of ending the run. This bounds the time of a step, for real time. The summary shows the
    /// residual.
    #[serde(default)]
    pub accept_stalled: bool,
}

impl LinearTable {
    /// A way with the usual settings.
    pub fn usual(by: LinearName) -> Self {
        Self {
            by,
            tolerance: thousandth(),
            iterations: thousand(),
            preconditioner: PreconditionerName::default(),
            accept_stalled: false,
        }
    }
}

fn thousandth() -> f64 {
    1e-3
}

fn thousand() -> u32 {
    1000
}

/// Preconditioner, by which conjugate gradients multiply residuals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PreconditionerName {
    /// The factors of an older stiffness, computed again once they need more than ten iterations.
    LaggedFactors,
    /// The inverse of each node's own block: the least memory.
    BlockJacobi,
    /// Block Jacobi with a solution for the rigid motions of groups of neighbouring nodes: far fewer
    /// iterations on many elements.
    #[default]
    Aggregates,
}

/// Quantity that a static run prescribes instead of the size of one load: exactly one of `displacement`,
/// `arc-length`, `volume`. The run prescribes it in equal parts in its load steps, and finds the factor of
/// the load.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ControlTable {
    /// The load whose factor is found; it has no curve of its own.
    pub load: String,
    /// Motion of a node over the whole run, in equal parts.
    #[serde(default)]
    pub displacement: Option<ControlledNode>,
    /// Length [m] of the increment of all displacements in a load step, √Σ|Δu|². The path ends at `stop`, or
    /// with the last load step.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub arc_length: Option<f64>,
    /// End of a path by `arc-length` before its last load step. If not given, a load factor of 1, where the
    /// load is as written.
    #[serde(default)]
    pub stop: Option<StopTable>,
    /// Volume [m³] inside the pressurised triangles at the end; they must be closed. The volume changes in
    /// equal parts.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub volume: Option<f64>,
}

/// End of a path by arc length: the first state that meets one of these conditions.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct StopTable {
    /// Size of the load factor, forwards or backwards.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub load_factor: Option<f64>,
    /// Displacement of a node.
    #[serde(default)]
    pub displacement: Option<ControlledNode>,
    /// Number of limit points passed, where the load turns back.
    #[serde(default)]
    #[schemars(range(min = 1))]
    pub limit_points: Option<u32>,
}

/// Time integrator of an implicit run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum IntegratorName {
    /// Backward Euler, of first order: robust. In steps of h seconds it damps a vibration of f hertz by about
    /// π f h of critical damping.
    #[default]
    BackwardEuler,
    /// The backward differentiation formula of second order: it damps by about 62 (f h)³ of critical, and
    /// less accurate steps show as vibrations.
    Bdf2,
}

/// A component of the displacement of a node.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ControlledNode {
    /// The body.
    pub body: String,
    /// Place at rest [m]; its nearest node is meant.
    pub at: [f64; 3],
    /// Component of the displacement.
    pub component: Axis,
    /// Displacement at the end [m].
    pub by: f64,
}
