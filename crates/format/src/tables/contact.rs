//! Obstacles, tools, and bodies that touch them.

use std::path::PathBuf;

use pliant_geometry::Selection;
use schemars::JsonSchema;
use serde::Deserialize;

use super::body::{CleanTable, Label};
use super::load::{RotateTable, Timing};

/// A rigid thing that bodies touch: an obstacle such as a bone, or a tool. `at` and `turn` set its pose; it
/// moves by one of `by`, `rotate` and `poses`, or not at all. Curve: `smooth-step` if not given.
/// `[contact.NAME]` names the bodies that touch it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct ToolTable {
    /// Its shape, around the origin of its own frame.
    pub shape: ShapeName,
    /// Position of the origin of its frame [m].
    #[serde(default)]
    pub at: [f64; 3],
    /// Rotation of its frame [rad]: about the axis of this vector, by its length.
    #[serde(default)]
    pub turn: [f64; 3],
    /// True if bodies are inside, as a brain in its skull.
    #[serde(default)]
    pub inside: bool,
    /// Opening of the jaws over time, for a tool with jaws; closed if not given.
    #[serde(default)]
    pub opening: Option<OpeningTable>,
    /// The angle [rad] between jaws at or below which they hold everything that touches their inner faces, as
    /// if tied. They let go when they open wider. If not given, they hold by the contact's friction.
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub ideal_grip: Option<f64>,
    /// Largest force [N] with which it pushes. From half of this force on it gives way, and lags behind its
    /// trajectory. When the obstacle is gone, it catches up.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub force_limit: Option<f64>,
    /// Growth over time.
    #[serde(default)]
    pub grows: Option<GrowthTable>,
    /// Displacement [m], reached along the curve.
    #[serde(default)]
    pub by: Option<[f64; 3]>,
    /// Rotation about an axis, reached along the curve.
    #[serde(default)]
    pub rotate: Option<RotateTable>,
    /// A CSV file of poses. A row for each time [s] has a position [m] and a unit quaternion, in columns t,
    /// x, y, z, qw, qx, qy, qz. Between rows it moves on straight lines and shortest arcs; before the first
    /// and after the last row it rests.
    #[serde(default)]
    pub poses: Option<PathBuf>,
    /// Its curve over time.
    #[serde(flatten)]
    pub timing: Timing,
}

/// A rigid shape.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ShapeName {
    /// A ball around the origin.
    Sphere(SphereTool),
    /// The points within a radius of a segment along z, centred at the origin.
    Capsule(CapsuleTool),
    /// A cylinder along z with flat ends, centred at the origin.
    Cylinder(CylinderTool),
    /// A box centred at the origin.
    Box(BoxTool),
    /// A cone along z: its base in the plane z = 0, its tip above.
    Cone(ConeTool),
    /// The space below the plane z = 0: `shape = "half-space"`.
    HalfSpace,
    /// A body of revolution about the z axis, such as a funnel with its tube when `inside = true`. Not on
    /// GPUs.
    Revolved(RevolvedTool),
    /// Two jaws of a grasper: boxes along z from a hinge at the origin, which open about the x axis. They are
    /// `NAME.upper` and `NAME.lower`.
    Jaws(JawsTool),
    /// The volume that the closed surface of a mesh file encloses.
    Mesh(MeshTool),
    /// A part of a segmented image.
    Image(ImageTool),
}

/// A ball.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct SphereTool {
    /// Radius [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius: f64,
}

/// The points within a radius of a segment.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct CapsuleTool {
    /// Radius [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius: f64,
    /// Length of the segment [m].
    #[schemars(range(min = 0.0))]
    pub length: f64,
}

/// A cylinder with flat ends.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct CylinderTool {
    /// Radius [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius: f64,
    /// Length [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub length: f64,
}

/// A box.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct BoxTool {
    /// Its edges [m].
    pub size: [f64; 3],
}

/// A cone.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ConeTool {
    /// Radius of its base [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius: f64,
    /// Height [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub height: f64,
}

/// A body of revolution.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct RevolvedTool {
    /// Its outline from below upwards: heights, distances from the axis, and radii of the arcs in place of
    /// corners [m]. The body is the space between outline and axis. Beyond an end off the axis the outline
    /// continues straight.
    pub outline: Vec<[f64; 3]>,
}

/// Two jaws.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct JawsTool {
    /// Length from the hinge to the tips [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub length: f64,
    /// Width along the axis of the hinge [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub width: f64,
    /// Thickness of each jaw [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub thickness: f64,
}

/// The angle between two jaws: 0 at `from`, `angle` or `degrees` at `to`. `curve = "hold"` keeps them open; a
/// table opens and closes them: `curve = { table = [[0, 1], [0.5, 0.1]] }`. Curve: `smooth-step` if not
/// given.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct OpeningTable {
    /// The angle [rad].
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 3.0))]
    pub angle: Option<f64>,
    /// The angle [degrees], instead of `angle`.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 170.0))]
    pub degrees: Option<f64>,
    /// Its curve over time.
    #[serde(flatten)]
    pub timing: Timing,
}

/// Growth of a rigid thing: its surface moves outward, by 0 at `from` and the whole distance at `to`. With
/// `inside = true` the room inside grows. Edges become round. A table lets it shrink again:
/// `curve = { table = [[0, 0], [1, 1], [2, 0.2]] }`. Balls and capsules may shrink below the size of their
/// shape. Not on GPUs. Curve: `smooth-step` if not given.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct GrowthTable {
    /// The distance [m].
    pub by: f64,
    /// Its curve over time.
    #[serde(flatten)]
    pub timing: Timing,
}

/// The volume that the surface of a mesh file encloses. Distances to the surface are sampled once on a grid,
/// and kept in the cache.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct MeshTool {
    /// A mesh file, relative to the scene: Gmsh (.msh), VTK (.vtk, .vtu, .vtp), OBJ, OFF, STL, PLY, GIfTI,
    /// FreeSurfer. Its triangles and quads are the surface, or the boundary of its tets and hexes.
    pub file: PathBuf,
    /// Factor on all lengths: the size of one unit of the mesh in metres (0.001 for millimetres); 1 if not
    /// given. A file that would be larger than 10 m needs it.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub scale: Option<f64>,
    /// Distance [m] by which the surface is moved outward, or inward if it is negative.
    #[serde(default)]
    pub grow: f64,
    /// Distance [m] between the points of the grid. If not given, 1/256 of the diagonal of the box, or half
    /// of the mean edge of the triangles if this is less. The grid is coarser if it does not fit into 64 MiB.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub resolution: Option<f64>,
}

/// A part of a segmented image, with the coordinates of the image. Distances to its surface are sampled once
/// on a grid, and kept in the cache.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ImageTool {
    /// A segmented image, relative to the scene: NIfTI (.nii, .nii.gz), NRRD, MetaImage (.mha, .mhd), GIPL, a
    /// DICOM segmentation, or the folder of a DICOM series.
    pub file: PathBuf,
    /// Names for the labels: a table of ITK-SNAP, FreeSurfer or 3D Slicer, lines like `5 liver`, JSON, or the
    /// word `totalsegmentator`.
    #[serde(default)]
    pub names: Option<PathBuf>,
    /// Label of the image, by number or name.
    #[serde(default)]
    pub label: Option<Label>,
    /// Several labels of the image together, by number, name or range as `"5-8"`.
    #[serde(default)]
    pub labels: Option<Vec<Label>>,
    /// Instead of labels: all voxels of at least this value, as bone in a CT.
    #[serde(default)]
    pub threshold: Option<f64>,
    /// Cleaning of the labels.
    #[serde(default)]
    pub clean: Option<CleanTable>,
    /// Distance [m] by which the surface is moved outward, or inward if it is negative.
    #[serde(default)]
    pub grow: f64,
    /// Distance [m] between the points of the grid; if not given, chosen as for a mesh file.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub resolution: Option<f64>,
}

/// Settings for sampling the distances of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    /// Distance [m] by which the surface is moved outward.
    pub grow: f64,
    /// Distance [m] between the points of the grid, if it is given.
    pub resolution: Option<f64>,
}

impl MeshTool {
    /// Settings for sampling its distances.
    pub fn sampling(&self) -> Sampling {
        Sampling { grow: self.grow, resolution: self.resolution }
    }
}

impl ImageTool {
    /// Settings for sampling its distances.
    pub fn sampling(&self) -> Sampling {
        Sampling { grow: self.grow, resolution: self.resolution }
    }
}

/// Contact of a body with an obstacle or a tool, with another body, or with itself. With the solver
/// `explicit`, for bodies without bending, impulses keep surfaces apart; only solids can touch each other.
/// With the solvers `implicit` and `static`, for solids and shells, a barrier keeps surfaces apart. Only
/// barriers exclude intersections: no accepted state has an intersection. `csv` outputs have the force on the
/// second body as `contact.NAME`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ContactTable {
    /// The body, and the thing that it touches: `between = ["liver", "probe"]`. The same body twice means
    /// self-contact. `"all"`: all solids, obstacles and tools; with the solvers `implicit` and `static` also
    /// shells and membranes that are not `on` a solid. Each pair has an entry of its own,
    /// `contact.NAME.liver-probe`.
    pub between: [String; 2],
    /// Faces of the first body that touch; if not given, its whole boundary.
    #[serde(default)]
    pub faces: Option<Selection>,
    /// Faces of the second, if it is another body; if not given, its whole boundary.
    #[serde(default)]
    pub other_faces: Option<Selection>,
    /// Coulomb's coefficient of friction [1].
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub friction: f64,
    /// Distance [m] that the surfaces keep. If not given with the solver `explicit`, 0.5 % of the mean edge
    /// for bodies and self-contact, and 0 from a rigid thing. If not given with the solvers `implicit` and
    /// `static`, half of the thickness of each shell that takes part. Nodes of explicit bodies that are
    /// nearer at the start keep their distance.
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub thickness: Option<f64>,
    /// The gap [m], in addition to `thickness`, below which surfaces push each other away. A thousandth of
    /// the diagonal of all bodies if not given. With the solvers `implicit` and `static`.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub barrier_distance: Option<f64>,
    /// Stiffness κ [Pa] of the barrier. At the gap y times its distance, its pressure is κ (2 (y − 1) ln y +
    /// (y − 1)²/y). A tenth of Young's modulus of the softest body of the contact if not given.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub barrier_stiffness: Option<f64>,
    /// Number of times that each triangle of a shell is divided into four on its curved surface, which
    /// touches in its place: 0 (flat triangles), 1 or 2. With the solvers `implicit` and `static`.
    #[serde(default)]
    #[schemars(range(max = 2))]
    pub subdivision: Option<u8>,
    /// Largest speed [m/s] at which bodies creep that friction should hold. With the solvers `implicit` and
    /// `static`; 0.001 if not given.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub creep_speed: Option<f64>,
    /// True to search states for edges that go through triangles, independently of the contact search. With
    /// the solvers `implicit` and `static` the search looks at each state; an intersection would be a fault
    /// of the program, and ends the run. With the solver `explicit` the search looks at the last state and
    /// the states that outputs write. It counts the intersections of bodies that are deeper than 1e-4 of the
    /// mean edge, in a warning and in `intersections` of `--json`. Holds for all contacts of the solver.
    #[serde(default)]
    pub check_intersections: bool,
    /// True to push bodies that overlap at the start apart before the run, with the smallest displacements of
    /// their nodes. The shape at rest stays, so that the run starts deformed. Without this key overlapping
    /// bodies are an error.
    #[serde(default)]
    pub separate: bool,
    /// Gap [m] between the shapes at rest, beyond the distance that surfaces keep. Where bodies overlap or
    /// are nearer, their nodes at rest move apart by the smallest displacements, so that the run starts
    /// without stress. For organs that touch in one segmentation and are meshed one by one.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub gap: Option<f64>,
}
