//! The scene as the user wrote it: plain data, nothing computed. Every parameter is declared once with
//! meaning, unit, range and default: here, or for a law beside its formulas. Schema, checks and reference
//! page come from these declarations.

mod body;
mod contact;
mod linear;
mod load;
mod output;
mod participant;
mod tie;
mod view;

use pliant_mechanics::prony::{PronyTerm, PronyUpdate};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use body::{
    AnnulusShape, BlockShape, BodyModel, BodyTable, ByLabel, Cells, CleanTable, CylinderShape, Density,
    Element, EllipsoidShape, Fibre, FibreRule, Fix, Fixes, HemisphereShape, Hourglass, Label, LabelGroup,
    LabelOrGroups, LayerTable, LensShape, MeshTable, Normals, Organ, PatternName, PlateShape, Protected,
    SheetGrid, SphereShape, SurfaceTable, Thickness, ThicknessRule, TubeShape, TwistedStripShape,
};
pub use contact::{
    BoxTool, CapsuleTool, ConeTool, ContactTable, GrowthTable, ImageTool, JawsTool, MeshTool, OpeningTable,
    RevolvedTool, Sampling, ShapeName, SphereTool, ToolTable,
};
pub use linear::{
    ControlTable, ControlledNode, IntegratorName, LinearName, LinearTable, LinearWay, PreconditionerName,
    StopTable,
};
pub use load::{
    Axis, CurveShape, EdgeLoadTable, FixTable, ForceTable, GravityTable, MeanTable, MomentTable, MoveTable,
    NodeVectorSource, NodeVectors, PressureTable, RigidTable, RotateTable, SpreadName, SpringTable, Timing,
    TractionTable, Vectors, VolumeTable,
};
pub use output::{At, CsvTable, FieldName, ProbeTable, VtuTable};
pub use participant::ParticipantTable;
pub use tie::{Rotations, TieMethod, TieTable};
pub use view::{
    BackgroundName, CameraTable, Choice, ClipTable, ColourBy, Component, Labels, LookColour, LookTable,
    MapName, Nothing, TextureName, UpName, ViewTable,
};

/// Most threads of a run or a simulation.
pub const MOST_THREADS: u32 = 1024;

/// Most parts that an edge of a shell is cut into in pictures.
pub const MOST_CURVED: u32 = 100;

/// Title, duration and gravity of the scene.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct SceneTable {
    /// A title for reports.
    #[serde(default)]
    pub title: String,
    /// Simulated time [s].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub until: f64,
    /// Acceleration of all bodies [m/s²], from the start; for an acceleration that grows, use a load of type
    /// `gravity`.
    #[serde(default)]
    pub gravity: Option<[f64; 3]>,
}

/// A design of the kernels; all give the same answers within round-off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "Design")]
pub enum DesignName {
    /// Cells write forces into slots of their own, nodes gather them in a fixed order. The same bits every
    /// time.
    Gather,
    /// Blocks of neighbouring nodes do a step in one kernel. Each block computes the forces of all cells at
    /// its nodes in shared memory, and moves the nodes. Cells at the borders of blocks are computed by each.
    /// The same bits every time, forces of a limited range.
    Blocks,
    /// Cells add their forces to the nodal forces by floating-point atomics, in any order: the last bits vary
    /// from run to run.
    FloatAtomics,
    /// Blocks of neighbouring cells add their forces up in shared memory, and nodes gather the sums of their
    /// blocks. Shapes at rest of plain tetrahedra are computed again from their nodes. The same bits every
    /// time.
    Fast,
}

/// Number type of the solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "Precision")]
pub enum PrecisionName {
    /// 32-bit numbers: faster, about six digits.
    Single,
    /// 64-bit numbers: the reference.
    Double,
}

/// Reaction of a run when the critical time step falls below its step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "OnUnstable")]
pub enum OnUnstableName {
    /// Cut the steps into equal parts until the limit recovers.
    #[default]
    Substep,
    /// End with an error.
    Stop,
    /// Continue with the same step; the smallest limit is reported.
    Report,
}

/// Settings of the run.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct RunTable {
    /// Device of the solver.
    #[serde(default)]
    pub device: DeviceName,
    /// The GPU, by a part of its name in `pliant devices`; if not given, the best one.
    #[serde(default)]
    pub adapter: Option<String>,
    /// Design of the GPU kernels that bring forces from cells to nodes. If not given, the ways that measured
    /// best: `fast`, and `gather` on adapters that are software.
    #[serde(default)]
    pub design: Option<DesignName>,
    /// Number type of the solver; if not given, `double` on the CPU and `single` on a GPU, which has only
    /// this.
    #[serde(default)]
    pub precision: Option<PrecisionName>,
    /// Solver that advances the state in time.
    #[serde(default)]
    pub solver: SolverName,
    /// Time step [s], made a little shorter if it does not divide the duration. `auto` is 0.9 × the critical
    /// time step of the assembled model at rest. With the solvers `quasi-static` and `static`, `auto` follows
    /// `load-steps`; with `implicit` it is 0.01 s.
    #[serde(default)]
    pub step: StepChoice,
    /// Reaction of an explicit run when the critical time step of the deformed model falls below its step.
    /// The critical step is watched during the run. If not given, `substep`.
    #[serde(default)]
    pub on_unstable: Option<OnUnstableName>,
    /// Makes the nodes that limit an explicit step heavier.
    #[serde(default)]
    pub mass_scaling: Option<MassScalingTable>,
    /// Load steps of a quasi-static or static run with `step = "auto"`: their number if equal, or the times
    /// at which they end.
    #[serde(default)]
    pub load_steps: LoadSteps,
    /// Largest residual force over the largest internal force (or load, or inertial force) at which an
    /// equilibrium is found. If not given, 1e-8 with the solver `static` and 1e-6 with `implicit`. With
    /// `quasi-static` 1e-6 in double and 1e-4 in single precision if not given.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
    pub tolerance: Option<f64>,
    /// Most iterations of Newton's method in a step of `implicit` (20 if not given) or `static` (40). With 1
    /// a step of `implicit` is one linear solution, and its residual is not checked: for real time.
    #[serde(default)]
    #[schemars(range(min = 1, max = 10_000))]
    pub iterations: Option<u32>,
    /// Speed [m/s] of all nodes below which a Newton step of `implicit` in contact is the last one; this step
    /// is still made. If not given, a step must move no node by more than a thousandth of `barrier-distance`.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub speed_tolerance: Option<f64>,
    /// True to accept the last state of an `implicit` step, instead of halving it, when its `iterations` run
    /// out or its energy stops falling. This bounds the time of a step, for real time. In contact that state
    /// has no intersection. Summary and window count these steps.
    #[serde(default)]
    pub accept_unconverged: Option<bool>,
    /// Time integrator of `implicit`; `backward-euler` if not given.
    #[serde(default)]
    pub integrator: Option<IntegratorName>,
    /// Linear solver of `implicit` and `static`.
    #[serde(default)]
    pub linear: LinearWay,
    /// Quantity that a `static` run prescribes instead of the size of a load, so that it passes limit points.
    #[serde(default)]
    pub control: Option<ControlTable>,
    /// Part of the internal energy that may be in hourglass modes of `hex8` at the end of a run. With more,
    /// the run writes all outputs and ends with an error: the shape of the elements is not resolved.
    #[serde(default = "tenth")]
    #[schemars(range(min = 0.0))]
    pub allow_hourglass: f64,
    /// Threads; 0: one per core. The number never changes a result.
    #[serde(default)]
    #[schemars(range(max = MOST_THREADS))]
    pub threads: u32,
    /// Checkpoints to resume an interrupted run from (`pliant run --resume`); the last two are kept.
    #[serde(default)]
    pub checkpoint: Option<CheckpointTable>,
}

fn tenth() -> f64 {
    0.1
}

/// Times of checkpoints.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct CheckpointTable {
    /// Simulated time between checkpoints [s]; the last one is at the end.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub every: f64,
}

/// Mass added at the start for a larger critical time step: exactly one of `target-step` and `share`. The
/// added mass resists acceleration, and damping acts on it. Gravity and other loads act on the mass of the
/// material, so that equilibria and their forces do not change.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum MassScalingTable {
    /// Least critical time step [s] of the assembled model at rest, reached with little more mass than it
    /// needs. The automatic `step` is 0.9 × as long.
    TargetStep(#[schemars(extend("exclusiveMinimum" = 0.0))] f64),
    /// Most mass that is added, as a part of the mass of the materials: 0.01 is 1 %. The critical time step
    /// becomes as long as this mass allows.
    Share(#[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0))] f64),
}

/// The load steps of a quasi-static or static run.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum LoadSteps {
    /// Number of equal load steps.
    Count(#[schemars(range(min = 1, max = 1_000_000))] u32),
    /// Unequal load steps.
    Times(LoadTimes),
}

/// The instants of unequal load steps.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct LoadTimes {
    /// Times [s] at which load steps end, above 0 and increasing; the last one ends with the scene.
    pub times: Vec<f64>,
}

impl Default for LoadSteps {
    fn default() -> Self {
        Self::Count(10)
    }
}

impl LoadSteps {
    /// End of the first load step [s] of a scene of a duration [s].
    pub fn first(&self, until: f64) -> f64 {
        match self {
            Self::Count(count) => until / f64::from(*count),
            Self::Times(_) => self.ends(until).and_then(|ends| ends.first().copied()).unwrap_or(until),
        }
    }

    /// Ends of unequal load steps [s]; the last one ends with the scene.
    pub fn ends(&self, until: f64) -> Option<Vec<f64>> {
        let Self::Times(LoadTimes { times }) = self else { return None };
        let within = times.iter().copied().filter(|&time| time < until * (1.0 - 1e-9));
        Some(within.chain([until]).collect())
    }
}

/// Solver that advances the state in time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SolverName {
    /// Dynamics with inertia, by central differences.
    #[default]
    Explicit,
    /// Equilibria without inertia, by dynamic relaxation.
    QuasiStatic,
    /// Dynamics with inertia in long steps, by backward Euler: shells and solids.
    Implicit,
    /// Equilibria without inertia, by Newton's method: shells and solids.
    Static,
}

impl SolverName {
    /// Its word in a scene file.
    pub fn word(self) -> &'static str {
        match self {
            Self::Explicit => "explicit",
            Self::QuasiStatic => "quasi-static",
            Self::Implicit => "implicit",
            Self::Static => "static",
        }
    }

    /// True if it solves equations by Newton's method, for solids and shells together.
    pub fn solves_equations(self) -> bool {
        matches!(self, Self::Implicit | Self::Static)
    }

    /// True if it finds equilibria, without inertia.
    pub fn finds_equilibria(self) -> bool {
        matches!(self, Self::QuasiStatic | Self::Static)
    }
}

/// Device of a solver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DeviceName {
    /// The CPU.
    #[default]
    Cpu,
    /// A GPU.
    Gpu,
    /// A GPU where there is one and it can run the scene, else the CPU; the run reports its choice and the
    /// reason.
    Auto,
}

/// A time step.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum StepChoice {
    /// Chosen from the mesh and the laws.
    Auto(Auto),
    /// Seconds.
    Seconds(#[schemars(extend("exclusiveMinimum" = 0.0))] f64),
}

/// The word `auto`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Auto {
    /// Let Pliant choose.
    Auto,
}

impl Default for StepChoice {
    fn default() -> Self {
        Self::Auto(Auto::Auto)
    }
}

/// Parameters that every law can have besides its own.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct LawExtras {
    /// Fibre direction at rest, for laws with fibres; a body may give its own.
    #[serde(default)]
    pub fibre: Option<Fibre>,
    /// Direction of the second family of fibres at rest, for laws with two; a body may give its own.
    #[serde(default)]
    pub second_fibre: Option<Fibre>,
    /// Relaxation by Prony series; any number of terms on either part of the stress.
    #[serde(default)]
    pub prony: Vec<PronyTerm>,
    /// Update of the relaxation over a step.
    #[serde(default)]
    pub prony_update: PronyUpdate,
}
