//! Built-in shapes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A box with one corner at the origin.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct BlockShape {
    /// Lengths along x, y, z [m].
    pub size: [f64; 3],
    /// Cells along x, y, z; if not given, from `edge`.
    #[serde(default)]
    pub cells: Option<[u32; 3]>,
}

/// An ellipsoid about the origin.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct EllipsoidShape {
    /// Half axes along x, y, z [m].
    pub radii: [f64; 3],
}

/// A tube about the z axis from z = 0.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct TubeShape {
    /// Inner radius [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub inner_radius: f64,
    /// Outer radius [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub outer_radius: f64,
    /// Length [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub length: f64,
}

/// Triangles on a grid.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct SheetGrid {
    /// Cells of the grid along its two axes; if not given, from `edge`.
    #[serde(default)]
    pub cells: Option<[u32; 2]>,
    /// Pattern that cuts cells into triangles.
    #[serde(default)]
    pub pattern: PatternName,
    /// Largest shift of inner points along each axis, at random, as a part of a cell, below 0.5.
    #[serde(default)]
    #[schemars(extend("minimum" = 0.0, "exclusiveMaximum" = 0.5))]
    pub distortion: f64,
    /// Another seed, other shifts.
    #[serde(default)]
    pub seed: u64,
}

/// Pattern that cuts the cells of a grid into triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PatternName {
    /// Two triangles, all diagonals from the start of both axes to their ends.
    #[default]
    Diagonal,
    /// Two triangles, all diagonals the other way.
    Antidiagonal,
    /// Two triangles, diagonals mirrored from cell to cell.
    UnionJack,
    /// Four triangles around the middle.
    Crossed,
}

/// A rectangle; grid axes are x and y.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct PlateShape {
    /// Lengths along x and y [m].
    pub size: [f64; 2],
    /// Its triangles.
    #[serde(flatten)]
    pub grid: SheetGrid,
}

/// A cylinder or a part of one; grid axes are round and along.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct CylinderShape {
    /// Radius [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius: f64,
    /// Length [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub length: f64,
    /// Angle from the x axis [degrees] at which a part starts.
    #[serde(default)]
    pub from: f64,
    /// Angle that it spans [degrees].
    #[serde(default = "whole_turn")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 360.0))]
    pub span: f64,
    /// Its triangles.
    #[serde(flatten)]
    pub grid: SheetGrid,
}

/// A sphere: an icosahedron whose triangles are repeatedly cut into four.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct SphereShape {
    /// Radius [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius: f64,
    /// Number of times that triangles are cut: 0 makes 20, 1 makes 80, 2 makes 320; if not given, from
    /// `edge`.
    #[serde(default)]
    pub levels: Option<u32>,
}

/// A hemisphere or a part of one; grid axes are round and towards the pole.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct HemisphereShape {
    /// Radius [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius: f64,
    /// Angle between the axis and the edge of the hole [degrees].
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 90.0))]
    pub hole: f64,
    /// Angle from the x axis that it spans [degrees].
    #[serde(default = "whole_turn")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 360.0))]
    pub span: f64,
    /// Its triangles.
    #[serde(flatten)]
    pub grid: SheetGrid,
}

/// A ring; grid axes are outwards and round. A whole turn has a slit: its sides lie on each other, but are
/// not joined.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct AnnulusShape {
    /// Inner radius [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub inner: f64,
    /// Outer radius [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub outer: f64,
    /// Angle from the x axis that it spans [degrees].
    #[serde(default = "whole_turn")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 360.0))]
    pub span: f64,
    /// Its triangles.
    #[serde(flatten)]
    pub grid: SheetGrid,
}

/// A strip that turns; grid axes are along and across.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct TwistedStripShape {
    /// Length along x [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub length: f64,
    /// Width [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub width: f64,
    /// Angle between its ends [degrees].
    pub twist: f64,
    /// Its triangles.
    #[serde(flatten)]
    pub grid: SheetGrid,
}

/// An intra-ocular lens: a disc, the optic, and two loops half a turn apart, the haptics. A haptic leaves the
/// optic at the x axis and continues at the overall diameter.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct LensShape {
    /// Diameter of the optic [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub optic: f64,
    /// Diameter of the circle around the whole lens [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub overall: f64,
    /// Width of a haptic [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub width: f64,
    /// Angle over which a haptic leaves the optic [degrees].
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 180.0))]
    pub transition: f64,
    /// Whole angle of a haptic [degrees].
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 180.0))]
    pub sweep: f64,
}

pub(super) fn whole_turn() -> f64 {
    360.0
}

/// A built-in organ of analytic shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Organ {
    /// A liver of 0.77 l; about 1.5 l at scale 1.25.
    Liver,
    /// A brain of 1.3 l with sulci and fissure; labels 1 (tissue), 2 (ventricles) and 3 (tumour).
    Brain,
}
