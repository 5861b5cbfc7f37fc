//! Smoothing of a surface without shrinking it (Taubin 1995). Each point moves towards the mean of its
//! neighbours by the fraction λ, then away from this mean by a slightly larger fraction μ. Together they damp
//! changes from point to point and preserve longer ones.

use pliant_geometry::Vector3;
use rayon::prelude::*;

use crate::surface::triangles::TriangleMesh;

/// Part of the way to the mean, there and back.
const PARTS: [f64; 2] = [0.5, -0.53];

impl TriangleMesh {
    /// Smooths the surface by a number of pairs of moves. Points at borders and creases stay.
    pub fn smooth(&mut self, pairs: usize) {
        let neighbours: Vec<Vec<u32>> = (0..self.points.len() as u32)
            .into_par_iter()
            .map(|p| if self.marked(p).is_empty() { self.neighbours(p) } else { Vec::new() })
            .collect();
        for part in (0..pairs).flat_map(|_| PARTS) {
            let moved = |(x, near): (&Vector3, &Vec<u32>)| {
                let sum: Vector3 = near.iter().map(|&n| self.points[n as usize]).sum();
                if near.is_empty() { *x } else { x + part * (sum / near.len() as f64 - x) }
            };
            self.points = self.points.par_iter().zip(&neighbours).map(moved).collect();
        }
    }
}
