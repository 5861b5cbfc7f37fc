//! Ties between bodies.

use pliant_geometry::Selection;
use schemars::JsonSchema;
use serde::Deserialize;

/// Ties the nodes of one body to another body, whose mesh need not match: each follows the cell of the other in which it lies, or on
/// whose surface, and its forces and its mass go there. For vessels inside an organ, walls on a surface, parts that are glued. Bodies of
/// two participants are tied by springs, as stiff as their steps allow. On the CPU.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct TieTable {
    /// The body whose nodes follow, and the body that they follow: `between = ["vessels", "liver"]`. Take the finer or the softer one
    /// first.
    pub between: [String; 2],
    /// The nodes of the first body that follow; if not given, all inside or on the second.
    #[serde(default)]
    pub nodes: Option<Selection>,
    /// Largest distance of such a node from the second body [m]; if not given, a tenth of its median edge.
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub tolerance: Option<f64>,
}
