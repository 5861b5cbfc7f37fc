//! The order of the cells of a solid. Cells are cut in two across their longest extent until each part is a
//! block of neighbours (recursive coordinate bisection). A block then has few nodes, most of them its own,
//! whatever the order in the user's mesh. Within a block each lane of the packs walks through a separate
//! corner, so that cells side by side rarely share a node. In a row of tets around one edge each sum would
//! wait for the one before.

use crate::tensor::Vector;

/// Cells whose forces are computed side by side: a pack of kernels.
pub const LANES: usize = 16;

/// Cells of a block.
pub(crate) const BLOCK_CELLS: usize = 64 * LANES;

/// The cells in order, from their centres [m].
pub fn order(centres: &[Vector<f64>]) -> Vec<u32> {
    let mut cells: Vec<u32> = (0..centres.len() as u32).collect();
    bisect(&mut cells, centres, BLOCK_CELLS);
    let mut ordered = Vec::with_capacity(cells.len());
    for block in cells.chunks_mut(BLOCK_CELLS) {
        let corner = block.len().div_ceil(LANES);
        bisect(block, centres, corner);
        block.chunks_mut(corner).for_each(<[u32]>::sort_unstable);
        for k in 0..corner {
            ordered.extend(block.iter().skip(k).step_by(corner));
        }
    }
    ordered
}

/// Cuts cells across their longest extent until each part has at most `size` cells. All parts but the last
/// have exactly `size`.
fn bisect(cells: &mut [u32], centres: &[Vector<f64>], size: usize) {
    let parts = cells.len().div_ceil(size);
    if parts < 2 {
        return;
    }
    let extent = |axis: usize| {
        let along = cells.iter().map(|&cell| centres[cell as usize][axis]);
        along.clone().fold(f64::MIN, f64::max) - along.fold(f64::MAX, f64::min)
    };
    let axis = (0..3).max_by(|&a, &b| extent(a).total_cmp(&extent(b))).unwrap_or(0);
    let at = parts / 2 * size;
    let place = |cell: u32| centres[cell as usize][axis];
    // Cells at the same place go by number, so that the order is the same every time.
    cells.select_nth_unstable_by(at, |&a, &b| place(a).total_cmp(&place(b)).then(a.cmp(&b)));
    let (low, high) = cells.split_at_mut(at);
    bisect(low, centres, size);
    bisect(high, centres, size);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Centres of the cells of a cube, in an order without pattern.
    fn shuffled(edge: usize) -> Vec<Vector<f64>> {
        let count = edge.pow(3);
        // A generator of the group of numbers prime to `count` would do; 7919 is prime.
        (0..count)
            .map(|i| i * 7919 % count)
            .map(|i| [i % edge, i / edge % edge, i / (edge * edge)].map(|k| k as f64))
            .collect()
    }

    #[test]
    fn every_cell_comes_once() {
        for count in [0, 1, 15, 16, 17, 511, 512, 513, 4096] {
            let centres = &shuffled(16)[..count];
            let mut ordered = order(centres);
            ordered.sort_unstable();
            assert!(ordered.into_iter().eq(0..count as u32));
        }
    }

    #[test]
    fn blocks_are_compact_and_lanes_apart() {
        let centres = shuffled(16);
        let ordered = order(&centres);
        let extent = |cells: &[u32], axis: usize| {
            let along = cells.iter().map(|&cell| centres[cell as usize][axis]);
            along.clone().fold(f64::MIN, f64::max) - along.fold(f64::MAX, f64::min) + 1.0
        };
        let largest = |cells: &[u32]| (0..3).map(|axis| extent(cells, axis)).fold(0.0, f64::max);
        // A block fills its box.
        let volume = |cells: &[u32]| (0..3).map(|axis| extent(cells, axis)).product::<f64>();
        assert!(ordered.chunks(BLOCK_CELLS).all(|block| volume(block) == (BLOCK_CELLS) as f64));
        // Cells that share no node are two apart.
        let sharing =
            ordered.chunks(LANES).flat_map(|pack| pack.windows(2)).filter(|pair| largest(pair) < 3.0);
        assert!(sharing.count() * 10 < centres.len());
    }
}
