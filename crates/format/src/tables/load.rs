//! Constraints and loads.

use std::path::PathBuf;

use pliant_geometry::Selection;
use schemars::JsonSchema;
use serde::Deserialize;

/// A component of the motion of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Axis {
    /// Along x.
    X,
    /// Along y.
    Y,
    /// Along z.
    Z,
    /// Rotation about x, of the nodes of shells.
    Rx,
    /// Rotation about y, of the nodes of shells.
    Ry,
    /// Rotation about z, of the nodes of shells.
    Rz,
}

/// Growth of a motion or a load over time.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CurveShape {
    /// Linear from 0 to 1; its kinks send waves through the body.
    Ramp,
    /// 3s² − 2s³: starts and ends without a jolt.
    SmoothStep,
    /// 10s³ − 15s⁴ + 6s⁵: even smoother.
    #[serde(rename = "polynomial-10-15-6")]
    Polynomial,
    /// The full value from the start.
    Hold,
    /// From 0 to 1 and back without a jolt, again and again, in this period [s]: breath, a beating heart.
    Wave(f64),
    /// Pairs of time [s] and factor, linear in between, constant outside; times increase.
    Table(Vec<[f64; 2]>),
}

/// The curve over time: the factor goes from 0 at `from` to 1 at `to`. If the factor is not 0 at t = 0,
/// `explicit` and `implicit` runs begin with the nodes moved and at rest. They count the stored energy as
/// external work. `static` and `quasi-static` runs move them in the first load step.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct Timing {
    /// The form of the growth.
    #[serde(default)]
    pub curve: Option<CurveShape>,
    /// Time [s] at which it starts.
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub from: f64,
    /// Time [s] at which it is complete; if not given, the end of the scene.
    #[serde(default)]
    pub to: Option<f64>,
}

/// Nodes held where they are.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct FixTable {
    /// The body.
    pub body: String,
    /// Selected nodes.
    pub nodes: Selection,
    /// Components held; if not given, all: of shells also the rotations, which clamps them.
    #[serde(default)]
    pub components: Option<Vec<Axis>>,
}

/// Nodes whose mean displacement is prescribed, while each node is free: a face under a plate that tilts. If
/// the nodes have whole faces, the mean is weighted by the area of the boundary at each node; otherwise all
/// nodes count equally. The reaction is the force of the plate. With every solver on the CPU except explicit
/// shells.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct MeanTable {
    /// The body.
    pub body: String,
    /// Selected nodes.
    pub nodes: Selection,
    /// Mean displacement [m], reached along the curve.
    pub by: [f64; 3],
    /// Components that are prescribed; if not given, all three.
    #[serde(default)]
    pub components: Option<Vec<Axis>>,
    /// Its curve over time.
    #[serde(flatten)]
    pub timing: Timing,
}

/// A rigid part of a body, such as bone or an implant: its nodes keep their distances, and move and turn
/// together, free in space. The rotations of shell nodes turn with the part. With every solver on the CPU
/// except explicit shells.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct RigidTable {
    /// The body.
    pub body: String,
    /// Selected nodes.
    pub nodes: Selection,
}

/// A closed surface whose volume is prescribed by a uniform pressure within, however large: a balloon, an
/// eye, a full bladder. Columns `volume.NAME` [m³] and `pressure.NAME` [Pa] of tables record both. With every
/// solver on the CPU except explicit shells.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct VolumeTable {
    /// The body, a solid, a membrane or a shell.
    pub body: String,
    /// Faces of the surface; if not given, the whole boundary. They have to be closed, and may be the faces
    /// of a cavity.
    #[serde(default)]
    pub faces: Option<Selection>,
    /// Growth of the enclosed volume from rest [m³], along the curve; 0 keeps the volume, less than 0 empties
    /// it.
    pub by: f64,
    /// Largest pressure or suction [Pa]. At this pressure the volume lags behind its curve; when less is
    /// needed, it catches up. With the solvers `implicit` and `static`.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub pressure_limit: Option<f64>,
    /// Its curve over time.
    #[serde(flatten)]
    pub timing: Timing,
}

/// Springs without rest length that pull nodes to points: of shells, and of solids with the solvers
/// `implicit` and `static`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct SpringTable {
    /// The body.
    pub body: String,
    /// Selected nodes.
    pub nodes: Selection,
    /// Stiffness of the spring of each node [N/m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub stiffness: f64,
    /// The point they are pulled to [m]; if not given, each node to its own place at rest.
    #[serde(default)]
    pub to: Option<[f64; 3]>,
}

/// Nodes moved as prescribed: exactly one of `by`, `velocity` and `rotate`; of shells `by`, `turn` or both.
/// Curve: `smooth-step` if not given.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct MoveTable {
    /// The body.
    pub body: String,
    /// Selected nodes.
    pub nodes: Selection,
    /// Displacement [m], reached along the curve: one for all nodes, or one for each node from a file.
    #[serde(default)]
    pub by: Option<Vectors>,
    /// Velocity [m/s], multiplied by the curve.
    #[serde(default)]
    pub velocity: Option<[f64; 3]>,
    /// Rotation of nodes of shells about their own places [rad]: about the axis of this vector by its length,
    /// reached along the curve.
    #[serde(default)]
    pub turn: Option<[f64; 3]>,
    /// Rotation of nodes of a solid about an axis, reached along the curve; each node stays on its circle all
    /// the way.
    #[serde(default)]
    pub rotate: Option<RotateTable>,
    /// Components prescribed; if not given, all three of the displacement, and with `turn` the rotations. A
    /// rotation takes all three.
    #[serde(default)]
    pub components: Option<Vec<Axis>>,
    /// Largest force [N] with which they push, measured by their reaction. From half of this force on they
    /// give way together, and lag behind their motion. When the obstacle is gone, they catch up. With the
    /// solvers `implicit` and `static`.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub force_limit: Option<f64>,
    /// Its curve over time.
    #[serde(flatten)]
    pub timing: Timing,
}

/// A rotation about an axis, by `angle` or `degrees`.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct RotateTable {
    /// Direction of the axis; its length does not matter.
    pub axis: [f64; 3],
    /// A point of the axis [m].
    pub centre: [f64; 3],
    /// Angle [rad] by which it turns, right-handed about the axis; 6.2832 is a whole turn.
    #[serde(default)]
    pub angle: Option<f64>,
    /// The angle [degrees], instead of `angle`; 360 is a whole turn.
    #[serde(default)]
    pub degrees: Option<f64>,
}

/// Displacements [m] or forces [N] of nodes.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Vectors {
    /// One vector for all nodes.
    Uniform([f64; 3]),
    /// One for each node.
    PerNode(NodeVectors),
}

/// Vectors node by node: `{ point-data = "shift" }` or `{ csv = "motion.csv" }`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct NodeVectors {
    /// Source of the vectors.
    #[serde(flatten)]
    pub from: NodeVectorSource,
    /// Factor on them: the size of one unit of the data in metres (0.001 for millimetres) or newtons.
    #[serde(default = "one")]
    pub scale: f64,
}

fn one() -> f64 {
    1.0
}

/// Source of vectors on nodes.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum NodeVectorSource {
    /// The name of a point-data array of three components in the body's mesh file.
    PointData(String),
    /// A file beside the scene with a row `node,x,y,z` for each node, with or without a header. Nodes are
    /// counted from 0 in the order of the mesh file.
    Csv(PathBuf),
}

/// Forces on nodes: exactly one of `each` and `total`. Curve: `smooth-step` if not given.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct ForceTable {
    /// The body or the carried surface.
    pub on: String,
    /// Selected nodes.
    pub nodes: Selection,
    /// Force on each node [N]: the same for all, or one for each node of a body from a file.
    #[serde(default)]
    pub each: Option<Vectors>,
    /// Force [N] shared equally among the nodes.
    #[serde(default)]
    pub total: Option<[f64; 3]>,
    /// Its curve over time.
    #[serde(flatten)]
    pub timing: Timing,
}

/// Moments on nodes of shells, about axes that stay in space: exactly one of `each` and `total`. Curve:
/// `smooth-step` if not given.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct MomentTable {
    /// The body.
    pub on: String,
    /// Selected nodes.
    pub nodes: Selection,
    /// Moment on each node [N m].
    #[serde(default)]
    pub each: Option<[f64; 3]>,
    /// Moment [N m] shared equally among the nodes.
    #[serde(default)]
    pub total: Option<[f64; 3]>,
    /// Its curve over time.
    #[serde(flatten)]
    pub timing: Timing,
}

/// A force per length on edges of shells that only one triangle has and whose ends are both selected. Curve:
/// `smooth-step` if not given.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct EdgeLoadTable {
    /// The body.
    pub on: String,
    /// Selected nodes.
    pub nodes: Selection,
    /// Force per length at rest [N/m]; its direction stays.
    pub traction: [f64; 3],
    /// Its curve over time.
    #[serde(flatten)]
    pub timing: Timing,
}

/// A force per reference area on faces. Curve: `smooth-step` if not given.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct TractionTable {
    /// The body or the carried surface.
    pub on: String,
    /// Faces whose nodes are all selected.
    pub faces: Selection,
    /// Force per area at rest [Pa]; its direction stays.
    pub traction: [f64; 3],
    /// Its curve over time.
    #[serde(flatten)]
    pub timing: Timing,
}

/// Pressure on faces, which follows the faces as they deform. Curve: `smooth-step` if not given.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct PressureTable {
    /// The body or the carried surface.
    pub on: String,
    /// Faces whose nodes are all selected.
    pub faces: Selection,
    /// Pressure [Pa]; positive pushes a solid inwards, and a shell to the side that its triangles face. A
    /// closed shell that faces outwards is blown up.
    pub pressure: f64,
    /// Distribution of the pressure to the nodes of a shell. If not given, `curved` with `dkt-curved` and
    /// `lumped` with other elements. Other pairs are not possible.
    #[serde(default)]
    pub spread: Option<SpreadName>,
    /// Its curve over time.
    #[serde(flatten)]
    pub timing: Timing,
}

/// An acceleration, in addition to `gravity` of `[scene]`. Curve: `smooth-step` if not given.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct GravityTable {
    /// The body; if not given, all.
    #[serde(default)]
    pub on: Option<String>,
    /// Nodes of the body; if not given, all nodes.
    #[serde(default)]
    pub nodes: Option<Selection>,
    /// Acceleration [m/s²].
    pub acceleration: [f64; 3],
    /// Its curve over time.
    #[serde(flatten)]
    pub timing: Timing,
}

/// Distribution of a pressure on a shell to its nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SpreadName {
    /// A third of the force on each flat triangle to each of its corners.
    Lumped,
    /// From the curved surface, as forces and moments.
    Curved,
}
