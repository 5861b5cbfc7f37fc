//! A finer surface carried by a body: each point is a fixed combination of the nodes of one cell, x = J x_parent with
//! barycentric (tet) or trilinear (hex) weights. Forces come back by the literal transpose, f_parent += Jᵀ f.

use crate::Real;
use crate::tensor::Vector;

/// A sparse J: rows of (node, weight), one row per carried point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mapping {
    /// First entry of each row, one more than there are rows.
    pub offsets: Vec<u32>,
    /// Parent nodes.
    pub nodes: Vec<u32>,
    /// Weights; each row sums to 1.
    pub weights: Vec<f64>,
}

impl Mapping {
    /// From one row of (node, weight) per carried point.
    pub fn from_rows<'a>(rows: impl IntoIterator<Item = &'a [(u32, f64)]>) -> Self {
        let mut mapping = Self { offsets: vec![0], ..Self::default() };
        for row in rows {
            for &(node, weight) in row {
                mapping.nodes.push(node);
                mapping.weights.push(weight);
            }
            mapping.offsets.push(mapping.nodes.len() as u32);
        }
        mapping
    }

    /// Number of carried points.
    pub fn len(&self) -> usize {
        self.offsets.len().saturating_sub(1)
    }

    /// True if nothing is carried.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The (node, weight) pairs of point `row`.
    pub fn row(&self, row: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.offsets[row] as usize..self.offsets[row + 1] as usize;
        range.map(|k| (self.nodes[k] as usize, self.weights[k]))
    }

    /// J v at one point: the carried value of a field on the parent's nodes.
    #[inline]
    pub fn apply_row<R: Real>(&self, row: usize, parent: &[Vector<R>]) -> Vector<f64> {
        let mut value = [0.0; 3];
        for (node, weight) in self.row(row) {
            for (v, p) in value.iter_mut().zip(parent[node]) {
                *v += weight * p.to_f64();
            }
        }
        value
    }

    /// J v at all points.
    pub fn apply<R: Real>(&self, parent: &[Vector<R>]) -> Vec<Vector<f64>> {
        (0..self.len()).map(|row| self.apply_row(row, parent)).collect()
    }

    /// Jᵀ f of one point's force, added to the parent's forces.
    #[inline]
    pub fn apply_transpose_row(&self, row: usize, force: Vector<f64>, parent: &mut [Vector<f64>]) {
        for (node, weight) in self.row(row) {
            for (p, f) in parent[node].iter_mut().zip(force) {
                *p += weight * f;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use pliant_testing::Random;

    use super::*;

    #[test]
    fn forces_come_up_by_the_transpose_of_what_went_down() {
        let mut numbers = Random::new(1);
        let mut random = || numbers.half();
        let rows: Vec<Vec<(u32, f64)>> =
            (0..50).map(|i| (0..8).map(|k| ((i * 7 + k * 3) % 20, random())).collect()).collect();
        let mapping = Mapping::from_rows(rows.iter().map(Vec::as_slice));
        let velocity: Vec<[f64; 3]> = (0..20).map(|_| [random(), random(), random()]).collect();
        let force: Vec<[f64; 3]> = (0..50).map(|_| [random(), random(), random()]).collect();
        let down = mapping.apply(&velocity);
        let mut up = vec![[0.0; 3]; 20];
        for (row, &f) in force.iter().enumerate() {
            mapping.apply_transpose_row(row, f, &mut up);
        }
        let inner = |a: &[[f64; 3]], b: &[[f64; 3]]| -> f64 {
            a.iter().flatten().zip(b.iter().flatten()).map(|(x, y)| x * y).sum()
        };
        assert!((inner(&down, &force) - inner(&velocity, &up)).abs() < 1e-12);
    }
}
