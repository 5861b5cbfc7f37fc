//! How the solvers `implicit` and `static` solve their equations.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Axis;

/// How linear equations are solved: one word, or a table with settings.
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
    /// Factors of the symmetric stiffness: robust, and unstable equilibria are noticed.
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
    /// Iterations of conjugate gradients at the most.
    #[serde(default = "thousand")]
    #[schemars(range(min = 1, max = 1_000_000))]
    pub iterations: u32,
    /// What conjugate gradients multiply residuals by.
    #[serde(default)]
    pub preconditioner: PreconditionerName,
    /// Whether an `implicit` step goes on with what conjugate gradients have reached when their iterations
    /// run out, instead of ending the run: bounded time, for real time. The summary tells the residual.
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

/// What conjugate gradients multiply residuals by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PreconditionerName {
    /// The factors of an older stiffness, made anew once they need more than ten iterations.
    LaggedFactors,
    /// The inverse of each node's own block: the least memory.
    BlockJacobi,
    /// This, and a solution for the rigid motions of groups of neighbouring nodes: far fewer iterations on
    /// many elements.
    #[default]
    Aggregates,
}

/// What a static run prescribes instead of the size of one load: exactly one of `displacement`, `arc-length`,
/// `volume`. It finds the factor of the load, equal in all its load steps.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ControlTable {
    /// The load whose factor is found; it has no curve of its own.
    pub load: String,
    /// How a node moves over the whole run, in equal parts.
    #[serde(default)]
    pub displacement: Option<ControlledNode>,
    /// Length [m] that all displacements together go in a load step, √Σ|Δu|². The path ends where `stop`
    /// says, or with the last load step.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub arc_length: Option<f64>,
    /// Where a path by `arc-length` ends before its last load step; if not given, at a load factor of 1,
    /// where the load is as written.
    #[serde(default)]
    pub stop: Option<StopTable>,
    /// Volume [m³] that the pressurised triangles, which must be closed, enclose at the end; it changes in
    /// equal parts.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub volume: Option<f64>,
}

/// Where a path by arc length ends: at the first state that meets one of these.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct StopTable {
    /// Size of the load factor, forwards or backwards.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub load_factor: Option<f64>,
    /// How far a node has moved.
    #[serde(default)]
    pub displacement: Option<ControlledNode>,
    /// Number of limit points passed, where the load turns round.
    #[serde(default)]
    #[schemars(range(min = 1))]
    pub limit_points: Option<u32>,
}

/// How an implicit run goes on in time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum IntegratorName {
    /// Backward Euler, of first order: robust, and it damps a vibration of f hertz in steps of h seconds by
    /// about π f h of critical.
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
    /// Which component.
    pub component: Axis,
    /// How far it moves in the end [m].
    pub by: f64,
}
