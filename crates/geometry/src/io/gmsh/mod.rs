//! Gmsh meshes (`.msh`): reads versions 1, 2 and 4.1, text and binary; writes version 4.1 as text.
//!
//! Physical groups become named cell sets (and, for points, named point sets); their numbers become the cell
//! data `label`. Leaves out geometry, parametric coordinates, periodicity and data per element node.

mod numbers;
mod read;
mod write;

pub(super) use read::read;
pub(super) use write::write;

use crate::CellKind;

/// Element types of Gmsh by number: the kind if it is supported, the name, and the number of nodes.
fn element_type(number: i64) -> Option<(Option<CellKind>, &'static str, usize)> {
    Some(match number {
        1 => (Some(CellKind::Line), "line", 2),
        2 => (Some(CellKind::Triangle), "triangle", 3),
        3 => (Some(CellKind::Quad), "quad", 4),
        4 => (Some(CellKind::Tet), "tet", 4),
        5 => (Some(CellKind::Hex), "hex", 8),
        6 => (None, "prism (wedge6)", 6),
        7 => (None, "pyramid (pyramid5)", 5),
        8 => (None, "quadratic line (line3)", 3),
        9 => (None, "quadratic triangle (tri6)", 6),
        10 => (None, "quadratic quad (quad9)", 9),
        11 => (None, "quadratic tet (tet10)", 10),
        12 => (None, "quadratic hex (hex27)", 27),
        13 => (None, "quadratic prism (wedge18)", 18),
        14 => (None, "quadratic pyramid (pyramid14)", 14),
        15 => (Some(CellKind::Vertex), "vertex", 1),
        16 => (None, "quadratic quad (quad8)", 8),
        17 => (None, "quadratic hex (hex20)", 20),
        18 => (None, "quadratic prism (wedge15)", 15),
        19 => (None, "quadratic pyramid (pyramid13)", 13),
        20 => (None, "cubic triangle (tri9)", 9),
        21 => (None, "cubic triangle (tri10)", 10),
        22 => (None, "quartic triangle (tri12)", 12),
        23 => (None, "quartic triangle (tri15)", 15),
        24 => (None, "quintic triangle (tri15i)", 15),
        25 => (None, "quintic triangle (tri21)", 21),
        26 => (None, "cubic line (line4)", 4),
        27 => (None, "quartic line (line5)", 5),
        28 => (None, "quintic line (line6)", 6),
        29 => (None, "cubic tet (tet20)", 20),
        30 => (None, "quartic tet (tet35)", 35),
        31 => (None, "quintic tet (tet56)", 56),
        36 => (None, "cubic quad (quad16)", 16),
        37 => (None, "quartic quad (quad25)", 25),
        38 => (None, "quintic quad (quad36)", 36),
        92 => (None, "cubic hex (hex64)", 64),
        93 => (None, "quartic hex (hex125)", 125),
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
