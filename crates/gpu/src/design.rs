//! Paths of forces from cells to nodes.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::Kind;

/// A design of the kernels; all give the same answers within round-off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Design {
    /// Cells write forces into slots of their own, nodes gather them in a fixed order. The same bits every
    /// time.
    Gather,
    /// Blocks of neighbouring nodes do a step in one kernel. They find the forces of all cells at their nodes
    /// in shared memory and move the nodes. Cells at the borders of blocks are found by each block. The same
    /// bits every time, forces of a limited range.
    Blocks,
    /// Cells add their forces to the nodes by floating-point atomics, in any order: the last bits vary from
    /// run to run.
    FloatAtomics,
    /// Blocks of neighbouring cells add their forces up in shared memory, and nodes gather the sums of their
    /// blocks. Shapes of plain tetrahedra at rest are found again from their nodes. The same bits every time.
    Fast,
}

impl Design {
    /// Every design.
    pub const ALL: &[Self] = &[Self::Gather, Self::Blocks, Self::FloatAtomics, Self::Fast];

    /// The default.
    ///
    /// On software adapters `gather` measured best (Mesa's llvmpipe, 55,566 tetrahedra: 78 ns of CPU time per
    /// cell and step, 113 to 161 for the others). On GPUs `fast` moves the fewest bytes, needs no atomics and
    /// has forces of any size. On an NVIDIA H100 only `blocks` is faster (0.32 ns for 0.40 ns), which has no
    /// contact and forces of a limited range.
    pub fn usual(kind: Kind) -> Self {
        match kind {
            Kind::Software => Self::Gather,
            Kind::Discrete | Kind::Integrated | Kind::Virtual | Kind::Other => Self::Fast,
        }
    }
}

impl fmt::Display for Design {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Gather => "gather",
            Self::Blocks => "blocks",
            Self::FloatAtomics => "float-atomics",
            Self::Fast => "fast",
        })
    }
}

impl FromStr for Design {
    type Err = UnknownDesign;

    fn from_str(name: &str) -> Result<Self, UnknownDesign> {
        let known = Self::ALL.iter().find(|design| design.to_string() == name);
        known.copied().ok_or_else(|| UnknownDesign { name: name.to_owned() })
    }
}

/// A name no design has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no design `{name}`; there are {}", Design::ALL.iter().map(Design::to_string).collect::<Vec<_>>().join(", "))]
pub struct UnknownDesign {
    /// The name.
    pub name: String,
}
