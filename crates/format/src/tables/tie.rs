//! Ties between bodies.

use pliant_geometry::Selection;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Ties the nodes of one body to another body, whose mesh need not match. The tied nodes follow nodes of the
/// other body, which take their forces and masses. For vessels inside an organ, walls on a surface, parts
/// that are glued. Bodies of two participants are tied by springs, as stiff as their steps allow.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct TieTable {
    /// The body whose nodes follow, and the body that they follow: `between = ["vessels", "liver"]`. With
    /// `points`, take the finer or the softer one first.
    pub between: [String; 2],
    /// Method by which nodes follow. If not given, `mortar` where faces of one solid lie on faces of another
    /// solid. Elsewhere `points`: for walls, bars, a solid inside another one, and gaps wider than the
    /// default `tolerance`.
    #[serde(default)]
    pub method: Option<TieMethod>,
    /// The nodes of the first body that follow; if not given, all inside or on the second.
    #[serde(default)]
    pub nodes: Option<Selection>,
    /// Largest distance of a tied node from the second body [m]; if not given, a tenth of its median edge.
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub tolerance: Option<f64>,
    /// Behaviour of the rotations of tied nodes of a shell, with the solvers `implicit` and `static`.
    #[serde(default)]
    pub rotations: Rotations,
}

/// Method by which nodes of a body follow another body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum TieMethod {
    /// Weighted means over the common area of faces of two solids, so that a constant stress is transmitted
    /// in either order of the bodies.
    Mortar,
    /// Each node follows the element of the other body that holds it, or on whose surface it lies.
    Points,
}

/// Behaviour of the rotations of shell nodes that move with a solid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Rotations {
    /// They are unknowns of their own: a hinge.
    #[default]
    Free,
    /// They follow the rotation of the solid's deformation gradient in the element that holds the node. On a
    /// wall they follow the mean of the elements behind the faces around the node. Moments go to the solid as
    /// couples.
    Follow,
}
