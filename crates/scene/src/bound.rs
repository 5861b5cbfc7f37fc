//! The stable step of a mesh by itself, for a material that it might be of.

use pliant_explicit::critical_step::cell_bound;
use pliant_geometry::{CellBlock, CellKind, Mesh};
use pliant_mechanics::model::{Cells, Material, Solid};

/// The smallest element bound [s] over the tets and hexes of a mesh, all of one material; `None` without any.
pub fn element_bound(mesh: &Mesh, material: &Material) -> Option<f64> {
    let rest: Vec<[f64; 3]> = mesh.points.iter().map(|&point| point.into()).collect();
    let of_block = |block: &CellBlock| {
        let cells = match block.kind {
            CellKind::Tet => Cells::tet4(nodes(block), &rest),
            // Patterns of hourglasses are slower than the law's own waves.
            CellKind::Hex => Cells::hex8(nodes(block), &rest, 0.0, 0.0),
            _ => return None,
        };
        let original = (0..cells.len() as u32).collect();
        let solid = Solid { body: 0, material: material.clone(), cells, fibre: Vec::new(), original };
        (0..solid.cells.len()).map(|cell| cell_bound(&solid, cell)).reduce(f64::min)
    };
    mesh.blocks.iter().filter_map(of_block).reduce(f64::min)
}

/// The nodes of cells with `N` each.
fn nodes<const N: usize>(block: &CellBlock) -> Vec<[u32; N]> {
    block.cells().map(|cell| std::array::from_fn(|at| cell[at])).collect()
}
