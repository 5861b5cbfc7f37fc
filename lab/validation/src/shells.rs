//! Shells of the literature (from `pliant-reproduce`), and the same shells with other numbers of nodes.

use pliant_geometry::Mesh;
pub use pliant_reproduce::shells::{CLAMPED, FLAT, Specimen, ramp, sheet, symmetry, triangles};

use crate::Random;

/// Renumbers nodes and corners at random; the shell stays the same. Returns the new number of each node, too.
pub fn renumbered(mesh: &Mesh, seed: u64) -> (Mesh, Vec<u32>) {
    let mut random = Random::new(seed);
    let mut order: Vec<u32> = (0..mesh.points.len() as u32).collect();
    for last in (1..order.len()).rev() {
        let other = ((0.5 + 0.5 * random.number()) * (last + 1) as f64) as usize;
        order.swap(last, other.min(last));
    }
    let mut other = mesh.clone();
    for (old, &new) in order.iter().enumerate() {
        other.points[new as usize] = mesh.points[old];
    }
    for set in other.point_sets.values_mut() {
        set.iter_mut().for_each(|node| *node = order[*node as usize]);
    }
    for triangle in other.blocks[0].nodes.chunks_exact_mut(3) {
        triangle.iter_mut().for_each(|node| *node = order[*node as usize]);
        triangle.rotate_left(((1.5 + 1.5 * random.number()) as usize).min(2));
    }
    (other, order)
}
