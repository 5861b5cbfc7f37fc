//! The scene as the user wrote it: plain data, nothing computed. Every parameter is declared here once (or,
//! for a law, beside its formulas) with meaning, unit, range and default; schema, checks and reference page
//! come from that.

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

/// What the scene is and how long it lasts.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct SceneTable {
    /// A title for reports.
    #[serde(default)]
    pub title: String,
    /// Simulated time [s].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub until: f64,
    /// Acceleration of all bodies [m/s²], from the start; for one that grows, use a load of type `gravity`.
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
    /// Blocks of neighbouring nodes do a step in one kernel: they find the forces of all cells at their nodes
    /// in shared memory and move them. Cells at the borders of blocks are found by each. The same bits every
    /// time, forces of a limited range.
    Blocks,
    /// Cells add their forces to those of the nodes by floating-point atomics, in any order: the last bits
    /// vary from run to run.
    FloatAtomics,
    /// Blocks of neighbouring cells add their forces up in shared memory, nodes gather the sums of their
    /// blocks; shapes of plain tetrahedra at rest are found again from their nodes. The same bits every time.
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

/// What a run does when the limit falls below its step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "OnUnstable")]
pub enum OnUnstableName {
    /// Cut the steps into equal parts until the limit recovers.
    #[default]
    Substep,
    /// End with an error.
    Stop,
    /// Go on at the same step; the smallest limit is reported.
    Report,
}

/// How the scene is run.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct RunTable {
    /// Where the solver runs.
    #[serde(default)]
    pub device: DeviceName,
    /// The GPU, by a part of its name in `pliant devices`; if not given, the best one.
    #[serde(default)]
    pub adapter: Option<String>,
    /// How the kernels of a GPU bring forces from cells to nodes; if not given, the ways that measured best:
    /// `fast`, and `gather` on adapters that are software.
    #[serde(default)]
    pub design: Option<DesignName>,
    /// Number type of the solver; if not given, `double` on the CPU and `single` on a GPU, which has
    /// no other.
    #[serde(default)]
    pub precision: Option<PrecisionName>,
    /// How the state goes from instant to instant.
    #[serde(default)]
    pub solver: SolverName,
    /// Time step [s], made a little shorter where it does not divide the duration; `auto`: 0.9 × the critical
    /// time step of the assembled model at rest, `load-steps` where the solver is `quasi-static` or `static`,
    /// and 0.01 s where it is `implicit`.
    #[serde(default)]
    pub step: StepChoice,
    /// What an explicit run does when the largest stable step of the deformed model, watched during the run,
    /// falls below its step; if not given, `substep`.
    #[serde(default)]
    pub on_unstable: Option<OnUnstableName>,
    /// Makes the nodes that limit an explicit step heavier.
    #[serde(default)]
    pub mass_scaling: Option<MassScalingTable>,
    /// Load steps of a quasi-static or static run with `step = "auto"`: so many equal ones, or the times at
    /// which they end.
    #[serde(default)]
    pub load_steps: LoadSteps,
    /// Largest residual force over the largest internal force (or load, or inertial force) at which an
    /// equilibrium is found; if not given, 1e-6 in double and 1e-4 in single precision with the solver
    /// `quasi-static`, 1e-8 with `static`, 1e-6 with `implicit`.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
    pub tolerance: Option<f64>,
    /// Iterations of Newton's method at the most in a step of `implicit` (20 if not given) or `static` (40).
    /// With 1 a step of `implicit` is one linear solution, and its residual is not checked: for real time.
    #[serde(default)]
    #[schemars(range(min = 1, max = 10_000))]
    pub iterations: Option<u32>,
    /// Speed [m/s] of all nodes below which a Newton step of `implicit` in contact is the last one; it is
    /// still made. If not given, a step must move nothing by more than a thousandth of `barrier-distance`.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub speed_tolerance: Option<f64>,
    /// Whether a step of `implicit` whose `iterations` run out, or whose energy does not fall any more, goes
    /// on with what it has reached instead of being halved: bounded time, for real time. In contact that
    /// state has no intersection. Summary and window tell how many steps did so.
    #[serde(default)]
    pub accept_unconverged: Option<bool>,
    /// How `implicit` goes on in time; `backward-euler` if not given.
    #[serde(default)]
    pub integrator: Option<IntegratorName>,
    /// How `implicit` and `static` solve their linear equations.
    #[serde(default)]
    pub linear: LinearWay,
    /// What a `static` run prescribes instead of the size of a load, so that it goes past limit points.
    #[serde(default)]
    pub control: Option<ControlTable>,
    /// The part of the internal energy that a run may hold in hourglass modes of `hex8` at its end. With more
    /// it writes all outputs and ends with an error: the shape of the elements is not resolved.
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

/// When checkpoints are written.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct CheckpointTable {
    /// Simulated time between them [s]; there is one at the end, too.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub every: f64,
}

/// Mass added at the start for a larger critical time step: exactly one of `target-step` and `share`. It
/// resists acceleration (and so damping acts on it); gravity and other loads act on the mass of the material,
/// so that equilibria and their forces do not change.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum MassScalingTable {
    /// Critical time step [s] of the assembled model at rest that is reached at least, with little more mass
    /// than it needs. The automatic `step` is 0.9 × as long.
    TargetStep(#[schemars(extend("exclusiveMinimum" = 0.0))] f64),
    /// The most mass that is added, as a part of the mass of the materials: 0.01 is 1 %. The critical time
    /// step becomes as long as it allows.
    Share(#[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0))] f64),
}

/// The load steps of a quasi-static or static run.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum LoadSteps {
    /// So many equal ones.
    Count(#[schemars(range(min = 1, max = 1_000_000))] u32),
    /// Unequal ones.
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
    /// The first one of a scene of a duration [s].
    pub fn first(&self, until: f64) -> f64 {
        match self {
            Self::Count(count) => until / f64::from(*count),
            Self::Times(_) => self.ends(until).and_then(|ends| ends.first().copied()).unwrap_or(until),
        }
    }

    /// Where unequal ones end [s]; the last one with the scene.
    pub fn ends(&self, until: f64) -> Option<Vec<f64>> {
        let Self::Times(LoadTimes { times }) = self else { return None };
        let within = times.iter().copied().filter(|&time| time < until * (1.0 - 1e-9));
        Some(within.chain([until]).collect())
    }
}

/// How the state goes from instant to instant.
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

    /// Whether it solves equations by Newton's method, for solids and shells together.
    pub fn solves_equations(self) -> bool {
        matches!(self, Self::Implicit | Self::Static)
    }

    /// Whether it knows no inertia.
    pub fn finds_equilibria(self) -> bool {
        matches!(self, Self::QuasiStatic | Self::Static)
    }
}

/// Where a solver runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DeviceName {
    /// The CPU.
    #[default]
    Cpu,
    /// A GPU.
    Gpu,
    /// A GPU where there is one and it can run the scene, else the CPU; the run says which and why.
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

/// What every law can have beside its own parameters.
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
    /// How the relaxation advances over a step.
    #[serde(default)]
    pub prony_update: PronyUpdate,
}
