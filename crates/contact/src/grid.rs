//! Distances to a closed surface on a regular grid, sampled once.

use nalgebra::Vector3;

use crate::shape::Near;

/// Signed distances [m] at the points of a regular grid, linear in between along each axis. Beyond the grid they grow with the distance to it.
#[derive(Clone, Debug)]
pub struct Grid {
    origin: Vector3<f64>,
    spacing: f64,
    counts: [usize; 3],
    values: Vec<f32>,
}

impl Grid {
    /// Samples a function, which is negative inside, in a box of two corners [m]; a point every `spacing` [m] at most.
    pub fn sample(
        [low, high]: [Vector3<f64>; 2],
        spacing: f64,
        distance: impl Fn(&Vector3<f64>) -> f64,
    ) -> Self {
        let counts = [0, 1, 2].map(|c| ((high[c] - low[c]) / spacing).ceil().max(1.0) as usize + 1);
        let place = |i: usize| low + spacing * lattice(i, counts).map(|x| x as f64);
        let values = (0..counts.iter().product()).map(|i| distance(&place(i)) as f32).collect();
        Self { origin: low, spacing, counts, values }
    }

    /// Distance [m] between its points.
    pub fn spacing(&self) -> f64 {
        self.spacing
    }

    /// The largest distance [m] of its points from the origin.
    pub fn reach(&self) -> f64 {
        let far = self.origin + self.spacing * Vector3::from(self.counts.map(|count| (count - 1) as f64));
        self.origin.abs().sup(&far.abs()).norm()
    }

    /// The distance at a point [m] and the direction in which it grows.
    pub fn near(&self, point: &Vector3<f64>) -> Near {
        let inner = Vector3::from_fn(|c, _| {
            let x = (point[c] - self.origin[c]) / self.spacing;
            x.clamp(0.0, (self.counts[c] - 1) as f64)
        });
        let cell = [0, 1, 2].map(|c| (inner[c] as usize).min(self.counts[c].saturating_sub(2)));
        let part = Vector3::from_fn(|c, _| inner[c] - cell[c] as f64);
        let value = |corner: usize| {
            let at = [0, 1, 2].map(|c| (cell[c] + (corner >> c & 1)).min(self.counts[c] - 1));
            f64::from(self.values[(at[2] * self.counts[1] + at[1]) * self.counts[0] + at[0]])
        };
        let corners: [f64; 8] = std::array::from_fn(value);
        let weight = |corner: usize, c: usize| if corner >> c & 1 == 1 { part[c] } else { 1.0 - part[c] };
        let mut distance = 0.0;
        let mut slope = Vector3::zeros();
        for (corner, value) in corners.iter().enumerate() {
            let [x, y, z] = [0, 1, 2].map(|c| weight(corner, c));
            let sign = |c: usize| if corner >> c & 1 == 1 { 1.0 } else { -1.0 };
            distance += x * y * z * value;
            slope += Vector3::new(sign(0) * y * z, x * sign(1) * z, x * y * sign(2)) * *value;
        }
        let nearest = self.origin + self.spacing * inner;
        let beyond = (point - nearest).norm();
        let normal = slope.try_normalize(0.0).unwrap_or_else(Vector3::z);
        match beyond > 1e-9 * self.spacing {
            true => Near { distance: distance + beyond, normal: (point - nearest) / beyond },
            false => Near { distance, normal },
        }
    }
}

fn lattice(index: usize, counts: [usize; 3]) -> Vector3<usize> {
    Vector3::new(index % counts[0], index / counts[0] % counts[1], index / (counts[0] * counts[1]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use pliant_testing::Random;

    /// Of a ball: distances to a tenth of the spacing, normals to 5 degrees near the surface.
    #[test]
    fn a_sampled_ball_is_a_ball() {
        let radius = 0.05;
        let corner = Vector3::repeat(0.07);
        let grid = Grid::sample([-corner, corner], 0.005, |x| x.norm() - radius);
        let mut random = Random::new(5);
        for _ in 0..2000 {
            let point = Vector3::from_fn(|_, _| 0.2 * random.part() - 0.1);
            let near = grid.near(&point);
            let exact = point.norm() - radius;
            let inside = point.amax() < 0.07;
            let bound = if inside { 5e-4 } else { 0.03 };
            assert!(point.norm() < 0.005 || (near.distance - exact).abs() < bound, "{point}: {near:?}");
            assert!(inside || near.distance > 0.0);
            if exact.abs() < 0.01 {
                assert!(near.normal.dot(&point.normalize()) > 0.996, "{point}: {near:?}");
            }
        }
    }
}
