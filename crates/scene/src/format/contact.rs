//! Obstacles, tools, and bodies that touch them.

use std::path::PathBuf;

use pliant_geometry::Selection;
use schemars::JsonSchema;
use serde::Deserialize;

use super::load::{RotateTable, Timing};

/// A rigid thing that bodies touch: an obstacle such as a bone, or a tool. It stands where `at` and `turn` put it, and moves by one of `by`,
/// `rotate` and `poses`, or not at all. Curve: `smooth-step` if not given. What touches it is named by `[contact.NAME]`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct ToolTable {
    /// Its shape, around the origin of its own frame.
    pub shape: ShapeName,
    /// Where the origin of its frame is [m].
    #[serde(default)]
    pub at: [f64; 3],
    /// How its frame is turned [rad]: about the axis of this vector by its length.
    #[serde(default)]
    pub turn: [f64; 3],
    /// True if bodies are inside of it, as a brain in its skull.
    #[serde(default)]
    pub inside: bool,
    /// Displacement [m], reached along the curve.
    #[serde(default)]
    pub by: Option<[f64; 3]>,
    /// Rotation about an axis, reached along the curve.
    #[serde(default)]
    pub rotate: Option<RotateTable>,
    /// A CSV file of poses: a row for each time [s] with a position [m] and a unit quaternion, columns t, x, y, z, qw, qx, qy, qz. In between it
    /// moves on straight ways and shortest arcs; before the first and after the last row it rests.
    #[serde(default)]
    pub poses: Option<PathBuf>,
    /// Its course.
    #[serde(flatten)]
    pub timing: Timing,
}

/// A rigid shape.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ShapeName {
    /// A ball around the origin.
    Sphere(SphereTool),
    /// All within a radius of a segment along z, centred at the origin.
    Capsule(CapsuleTool),
    /// A box centred at the origin.
    Box(BoxTool),
    /// A cone along z: its base in the plane z = 0, its tip above.
    Cone(ConeTool),
    /// All below the plane z = 0: `shape = "half-space"`.
    HalfSpace,
}

/// A ball.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct SphereTool {
    /// Radius [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius: f64,
}

/// All within a radius of a segment.
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

/// Who touches whom: a body an obstacle or a tool, another body, or itself. No surface goes into the other. With the solver `explicit` on the
/// CPU, for bodies without bending; bodies that touch each other are solids. The force on the second is in `csv` outputs as `contact.NAME`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ContactTable {
    /// The body, and what it touches: `between = ["liver", "probe"]`. The same body twice: itself. `"all"`: all solids, obstacles and tools, each
    /// pair with an entry of its own, `contact.NAME.liver-probe`.
    pub between: [String; 2],
    /// The faces of the first that touch; if not given, all of its boundary.
    #[serde(default)]
    pub faces: Option<Selection>,
    /// The faces of the second, if that is another body; if not given, all of its boundary.
    #[serde(default)]
    pub other_faces: Option<Selection>,
    /// Coulomb's coefficient of friction.
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub friction: f64,
    /// Distance [m] that the surfaces keep.
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub thickness: f64,
}
