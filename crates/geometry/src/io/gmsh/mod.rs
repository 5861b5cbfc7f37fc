//! Gmsh meshes (`.msh`): reads versions 1, 2 and 4.1, text and binary; writes version 4.1 as text.
//!
//! Physical groups become named cell sets (and, for points, named point sets); their numbers become the cell
//! data `label`. Leaves out geometry, parametric coordinates, periodicity and data per element node.

mod numbers;
mod read;
mod write;

pub(super) use read::read;
pub(super) use write::write;

use super::cells::FileKind::{self, Kept, Split};
use crate::{CellKind, SplitKind};

/// Element types of Gmsh by number: the kind, or the dimension if the kind is not supported; the name, and
/// the number of nodes.
fn element_type(number: i64) -> Option<(Result<FileKind, usize>, &'static str, usize)> {
    Some(match number {
        1 => (Ok(Kept(CellKind::Line)), "line", 2),
        2 => (Ok(Kept(CellKind::Triangle)), "triangle", 3),
        3 => (Ok(Kept(CellKind::Quad)), "quad", 4),
        4 => (Ok(Kept(CellKind::Tet)), "tet", 4),
        5 => (Ok(Kept(CellKind::Hex)), "hex", 8),
        6 => (Ok(Split(SplitKind::Wedge)), "wedge", 6),
        7 => (Ok(Split(SplitKind::Pyramid)), "pyramid", 5),
        8 => (Err(1), "quadratic line (line3)", 3),
        9 => (Err(2), "quadratic triangle (tri6)", 6),
        10 => (Err(2), "quadratic quad (quad9)", 9),
        11 => (Err(3), "quadratic tet (tet10)", 10),
        12 => (Err(3), "quadratic hex (hex27)", 27),
        13 => (Err(3), "quadratic prism (wedge18)", 18),
        14 => (Err(3), "quadratic pyramid (pyramid14)", 14),
        15 => (Ok(Kept(CellKind::Vertex)), "vertex", 1),
        16 => (Err(2), "quadratic quad (quad8)", 8),
        17 => (Err(3), "quadratic hex (hex20)", 20),
        18 => (Err(3), "quadratic prism (wedge15)", 15),
        19 => (Err(3), "quadratic pyramid (pyramid13)", 13),
        20 => (Err(2), "cubic triangle (tri9)", 9),
        21 => (Err(2), "cubic triangle (tri10)", 10),
        22 => (Err(2), "quartic triangle (tri12)", 12),
        23 => (Err(2), "quartic triangle (tri15)", 15),
        24 => (Err(2), "quintic triangle (tri15i)", 15),
        25 => (Err(2), "quintic triangle (tri21)", 21),
        26 => (Err(1), "cubic line (line4)", 4),
        27 => (Err(1), "quartic line (line5)", 5),
        28 => (Err(1), "quintic line (line6)", 6),
        29 => (Err(3), "cubic tet (tet20)", 20),
        30 => (Err(3), "quartic tet (tet35)", 35),
        31 => (Err(3), "quintic tet (tet56)", 56),
        36 => (Err(2), "cubic quad (quad16)", 16),
        37 => (Err(2), "quartic quad (quad25)", 25),
        38 => (Err(2), "quintic quad (quad36)", 36),
        92 => (Err(3), "cubic hex (hex64)", 64),
        93 => (Err(3), "quartic hex (hex125)", 125),
        _ => return None,
    })
}

/// Number of the element type of a kind.
const fn type_number(kind: CellKind) -> usize {
    match kind {
        CellKind::Line => 1,
        CellKind::Triangle => 2,
        CellKind::Quad => 3,
        CellKind::Tet => 4,
        CellKind::Hex => 5,
        CellKind::Vertex => 15,
    }
}
