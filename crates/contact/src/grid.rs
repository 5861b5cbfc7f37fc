//! Signed distances on a regular grid, sampled once: the shape of a mesh or of an image.

use std::fmt;

use nalgebra::Vector3;

use crate::near::{Near, Triangles};

/// Signed distances [m] at the points of a regular grid, linear in between along each axis. Beyond the grid
/// the distance is measured to the point of the surface that is nearest to the rim of the grid.
#[derive(Clone)]
pub struct Grid {
    origin: Vector3<f64>,
    spacing: f64,
    /// One over the spacing [1/m].
    per_metre: f64,
    counts: [usize; 3],
    /// Distances [m], negative inside, x fastest.
    values: Vec<f32>,
    /// The least distance [m] that a point can go through the shape.
    thinnest: f64,
    /// Radius [m] around the origin of all that is inside.
    reach: f64,
    /// Its surface, to be drawn.
    surface: Triangles,
    /// A number for the values.
    digest: u64,
}

/// The values as a number: there are too many to be written.
impl fmt::Debug for Grid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { origin, spacing, counts, thinnest, digest, .. } = self;
        let mut shown = f.debug_struct("Grid");
        shown.field("origin", origin).field("spacing", spacing).field("counts", counts);
        shown.field("thinnest", thinnest).field("digest", digest).finish()
    }
}

/// Largest defect of the slope, which is 1 for a distance, that is corrected. A larger defect means that the
/// direction to the surface jumps.
pub(crate) const FLATTEST: f64 = 0.3;

impl Grid {
    /// Makes a grid of distances [m] at points from `origin` [m] on, negative inside, x fastest. `None` if
    /// the number of values and of points differ, a value or a length is not finite, or an axis has fewer
    /// than two points.
    pub fn new(origin: Vector3<f64>, spacing: f64, counts: [usize; 3], values: Vec<f32>) -> Option<Self> {
        let points = counts.iter().try_fold(1_usize, |points, &count| points.checked_mul(count))?;
        let sound = points == values.len()
            && counts.iter().all(|&count| count > 1)
            && spacing.is_finite()
            && spacing > 0.0
            && origin.iter().all(|x| x.is_finite())
            && values.iter().all(|x| x.is_finite());
        if !sound {
            return None;
        }
        let inside = (0..points).filter(|&at| values[at] <= 0.0);
        let farthest = inside.map(|at| place(at, &origin, spacing, counts).norm()).fold(0.0, f64::max);
        // FNV-1a, a value at a time.
        let digest = values.iter().fold(0xcbf2_9ce4_8422_2325, |digest: u64, value| {
            (digest ^ u64::from(value.to_bits())).wrapping_mul(0x0100_0000_01b3)
        });
        let (thinnest, reach) = (spacing, farthest + spacing);
        let surface = (Vec::new(), Vec::new());
        Some(Self {
            origin,
            spacing,
            per_metre: spacing.recip(),
            counts,
            values,
            thinnest,
            reach,
            surface,
            digest,
        })
    }

    /// Samples a function, which is negative inside, in a box of two corners [m]; a point every `spacing` [m]
    /// at most. `None` if the function or a length is not finite.
    pub fn sample(
        [low, high]: [Vector3<f64>; 2],
        spacing: f64,
        distance: impl Fn(&Vector3<f64>) -> f64,
    ) -> Option<Self> {
        let counts = [0, 1, 2].map(|c| ((high[c] - low[c]) / spacing).ceil().max(1.0) as usize + 1);
        let points = counts.iter().try_fold(1_usize, |points, &count| points.checked_mul(count))?;
        let values = (0..points).map(|at| distance(&place(at, &low, spacing, counts)) as f32).collect();
        Self::new(low, spacing, counts, values)
    }

    /// Sets the least distance [m] that a point can go through the shape. The default is the spacing.
    pub fn with_thinnest(self, thinnest: f64) -> Self {
        Self { thinnest: thinnest.max(self.spacing), ..self }
    }

    /// Sets a surface to be drawn. The default is no surface.
    pub fn with_surface(self, surface: Triangles) -> Self {
        Self { surface, ..self }
    }

    /// Its first point [m].
    pub fn origin(&self) -> &Vector3<f64> {
        &self.origin
    }

    /// Points along each axis.
    pub fn counts(&self) -> [usize; 3] {
        self.counts
    }

    /// Distances [m] at its points, negative inside, x fastest.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Distance [m] between its points.
    pub fn spacing(&self) -> f64 {
        self.spacing
    }

    /// The least distance [m] that a point can go through the shape.
    pub fn thinnest(&self) -> f64 {
        self.thinnest
    }

    /// Radius [m] around the origin of all that is inside.
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// Its surface, to be drawn.
    pub fn surface(&self) -> &Triangles {
        &self.surface
    }

    /// The distance at a point [m] and the direction in which it grows.
    pub fn near(&self, point: &Vector3<f64>) -> Near {
        let [nx, ny, nz] = self.counts;
        let along = (point - self.origin) * self.per_metre;
        let last = Vector3::new((nx - 1) as f64, (ny - 1) as f64, (nz - 1) as f64);
        let inner = along.zip_map(&last, |x, last| x.clamp(0.0, last));
        let [i, j, k] = [0, 1, 2].map(|c| (inner[c] as u32 as usize).min(self.counts[c] - 2));
        let part = inner - Vector3::new(i as f64, j as f64, k as f64);
        let first = (k * ny + j) * nx + i;
        let pair = |at: usize| {
            <[f32; 2]>::try_from(&self.values[at..at + 2]).map_or([0.0; 2], |pair| pair.map(f64::from))
        };
        // The four edges along x, then the two lines between them along y.
        let edges = [first, first + nx, first + nx * ny, first + nx * ny + nx].map(pair);
        let between = |[a, b]: [f64; 2], part: f64| a + (b - a) * part;
        let [a, b, c, d] = edges.map(|edge| between(edge, part.x));
        let [e, f] = [between([a, b], part.y), between([c, d], part.y)];
        let [p, q, r, s] = edges.map(|[from, to]| to - from);
        let slope = Vector3::new(
            between([between([p, q], part.y), between([r, s], part.y)], part.z),
            between([b - a, d - c], part.z),
            f - e,
        );
        let distance = between([e, f], part.z);
        // Times the spacing.
        let steepness = slope.norm();
        let normal = if steepness > 0.0 { slope * steepness.recip() } else { Vector3::z() };
        // Chords make the function flatter than a distance: within a step of the surface, about where its
        // tangent reaches zero.
        let close = (1.0 - distance.abs() * self.per_metre).max(0.0);
        let missing = (1.0 - steepness * self.per_metre).clamp(0.0, FLATTEST);
        let distance = distance + distance * close * missing * (1.0 + missing);
        self.beyond([&along, &inner], distance, normal)
    }

    /// The distance at a point [m] by splines of second degree, and its gradient. This gradient is
    /// continuous, unlike the gradient of [`near`](Self::near). Splines round corners by about the spacing,
    /// where the gradient is shorter than 1.
    pub fn smooth(&self, point: &Vector3<f64>) -> Near {
        let along = (point - self.origin) * self.per_metre;
        let last = Vector3::from_fn(|c, _| (self.counts[c] - 1) as f64);
        let inner = along.zip_map(&last, |x, last| x.clamp(0.0, last));
        // Three points along each axis; beyond the grid values are extrapolated linearly.
        let axes = [0, 1, 2].map(|c| {
            let middle = inner[c].round();
            let t = inner[c] - middle;
            let weights = [0.5 * (0.5 - t).powi(2), 0.75 - t * t, 0.5 * (0.5 + t).powi(2)];
            (middle as i64 - 1, weights, [t - 0.5, -2.0 * t, t + 0.5])
        });
        let value = |at: [i64; 3]| {
            let last = self.counts.map(|count| count as i64 - 1);
            let [i, j, k] = [0, 1, 2].map(|c| at[c].clamp(0, last[c]));
            let step = |c: usize| {
                let inward = if at[c] < 0 { 1 } else { -1 };
                let mut to = [i, j, k];
                to[c] += inward;
                to
            };
            let read = |[i, j, k]: [i64; 3]| {
                let [nx, ny, _] = self.counts;
                f64::from(self.values[(k as usize * ny + j as usize) * nx + i as usize])
            };
            let here = read([i, j, k]);
            let out = (0..3).filter(|&c| at[c] != [i, j, k][c]);
            here + out.map(|c| here - read(step(c))).sum::<f64>()
        };
        let (mut distance, mut slope) = (0.0, Vector3::zeros());
        for k in 0..3 {
            for j in 0..3 {
                for i in 0..3 {
                    let offsets = [i, j, k];
                    let at = [0, 1, 2].map(|c| axes[c].0 + offsets[c] as i64);
                    let value = value(at);
                    let [wx, wy, wz] = [0, 1, 2].map(|c| axes[c].1[offsets[c]]);
                    let [gx, gy, gz] = [0, 1, 2].map(|c| axes[c].2[offsets[c]]);
                    distance += value * wx * wy * wz;
                    slope += value * Vector3::new(gx * wy * wz, wx * gy * wz, wx * wy * gz);
                }
            }
        }
        self.beyond([&along, &inner], distance, slope * self.per_metre)
    }

    /// A distance and its direction at a point of the grid, as they are at one beyond; both places in
    /// spacings.
    fn beyond(&self, [along, inner]: [&Vector3<f64>; 2], distance: f64, normal: Vector3<f64>) -> Near {
        if inner == along {
            return Near { distance, normal };
        }
        let beyond = (along - inner) * self.spacing;
        if distance <= 0.0 {
            // Beyond the grid the shape continues as a plane.
            return Near { distance: distance + normal.dot(&beyond), normal };
        }
        let from_surface = beyond + normal * distance;
        let distance = from_surface.norm();
        Near { distance, normal: from_surface.try_normalize(0.0).unwrap_or(normal) }
    }
}

/// A point of a grid [m].
fn place(at: usize, origin: &Vector3<f64>, spacing: f64, [nx, ny, _]: [usize; 3]) -> Vector3<f64> {
    origin + spacing * Vector3::new((at % nx) as f64, (at / nx % ny) as f64, (at / (nx * ny)) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use pliant_testing::Random;

    const RADIUS: f64 = 0.05;

    fn ball(spacing: f64) -> Grid {
        let corner = Vector3::repeat(0.07);
        Grid::sample([-corner, corner], spacing, |x| x.norm() - RADIUS).unwrap()
    }

    /// Take a function with the second derivatives 1/r, 1/r, 0. Its linear interpolation is off by at most 2
    /// h²/(8 r) within a cell, times the diagonals of its directions: never above 3 h²/(8 r). Halving the
    /// spacing quarters the error.
    #[test]
    fn a_sampled_ball_is_a_ball_to_second_order() {
        let worst = [0.008, 0.004, 0.002, 0.001].map(|spacing| {
            let grid = ball(spacing);
            let mut random = Random::new(5);
            let worst = (0..4000).map(|_| {
                let way = Vector3::from_fn(|_, _| 2.0 * random.part() - 1.0).normalize();
                let point = way * (RADIUS + 0.01 * (2.0 * random.part() - 1.0));
                let near = grid.near(&point);
                assert!((near.normal.norm() - 1.0).abs() < 1e-12);
                let across = near.normal.cross(&way).norm();
                assert!(across < spacing / 0.04, "{across} across at {point}");
                (near.distance - (point.norm() - RADIUS)).abs()
            });
            let worst = worst.fold(0.0, f64::max);
            assert!(worst < 3.0 * spacing * spacing / (8.0 * 0.04), "{worst} m at a spacing of {spacing} m");
            worst
        });
        println!("largest error [m] of the distance at spacings of 8, 4, 2, 1 mm: {worst:?}");
        for pair in worst.windows(2) {
            assert!((3.0..5.5).contains(&(pair[0] / pair[1])), "{worst:?}");
        }
    }

    /// Far away the distance is about that to the ball, and grows outward; it is continuous at the rim of the
    /// grid.
    #[test]
    fn beyond_the_grid_distances_go_on() {
        let grid = ball(0.005);
        let mut random = Random::new(6);
        for _ in 0..2000 {
            let point = Vector3::from_fn(|_, _| 2.0 * random.part() - 1.0);
            let near = grid.near(&point);
            let exact = point.norm() - RADIUS;
            if point.amax() > 0.07 {
                // The way to a point of the ball that is not the nearest one is longer, by up to a part of
                // the radius.
                let longer = near.distance - exact;
                assert!((-2e-4..0.5 * RADIUS).contains(&longer), "{point}: {near:?}");
                assert!(near.normal.dot(&point.normalize()) > 0.95, "{point}: {near:?}");
            }
            let rim = point * (0.07 / point.amax());
            let jump = grid.near(&(rim * (1.0 + 1e-9))).distance - grid.near(&(rim * (1.0 - 1e-9))).distance;
            assert!(jump.abs() < 1e-6, "{jump} at {rim}");
        }
        assert!((grid.reach() - RADIUS).abs() < 0.006);
    }

    /// A plane that leaves the grid is a plane beyond it.
    #[test]
    fn a_half_space_has_no_end() {
        let corner = Vector3::repeat(0.07);
        let grid = Grid::sample([-corner, corner], 0.01, |x| x.z).unwrap();
        for point in [[0.5, 0.0, -0.03], [0.0, -0.4, -0.3], [0.01, 0.02, 0.6]] {
            let near = grid.near(&point.into());
            assert!((near.distance - point[2]).abs() < 1e-6, "{point:?}: {near:?}");
            assert!((near.normal - Vector3::z()).norm() < 1e-5, "{point:?}: {near:?}");
        }
    }

    #[test]
    fn values_that_make_no_grid_are_refused() {
        let grid = |counts, values| Grid::new(Vector3::zeros(), 0.1, counts, values);
        assert!(grid([2, 2, 2], vec![1.0; 8]).is_some());
        assert!(grid([2, 2, 2], vec![1.0; 7]).is_none());
        assert!(grid([8, 1, 1], vec![1.0; 8]).is_none());
        assert!(grid([2, 2, 2], vec![f32::NAN; 8]).is_none());
        assert!(grid([usize::MAX, 2, 2], vec![1.0; 8]).is_none());
        assert!(Grid::new(Vector3::zeros(), 0.0, [2, 2, 2], vec![1.0; 8]).is_none());
        assert!(Grid::sample([Vector3::zeros(), Vector3::repeat(1.0)], 0.5, |_| f64::NAN).is_none());
    }

    /// Two grids that differ in one value have different debug texts, as checkpoints need.
    #[test]
    fn another_value_is_another_grid() {
        let mut values = vec![1.0; 27];
        let shown = |values: &[f32]| {
            format!("{:?}", Grid::new(Vector3::zeros(), 0.1, [3; 3], values.to_vec()).unwrap())
        };
        let before = shown(&values);
        values[13] = 0.999;
        assert_ne!(before, shown(&values));
    }

    /// Ten thousand points near the surface of a ball against a grid of 128³ points:
    /// `cargo test -p pliant-contact ten_thousand -- --nocapture`.
    #[test]
    fn ten_thousand_points_find_their_distance() {
        let grid = ball(0.14 / 127.0);
        let mut random = Random::new(7);
        // A spiral around the ball, in turns as nodes of a mesh are near each other in memory.
        let points: Vec<Vector3<f64>> = (0..10_000)
            .map(|k| {
                let z = 1.0 - (2.0 * f64::from(k) + 1.0) / 10_000.0;
                let angle = (10_000.0 * std::f64::consts::PI).sqrt() * z.asin();
                let across = (1.0 - z * z).sqrt();
                let way = Vector3::new(across * angle.cos(), across * angle.sin(), z);
                way * (RADIUS + 0.002 * (random.part() - 0.5))
            })
            .collect();
        let mut times: Vec<f64> = (0..200)
            .map(|_| {
                let start = std::time::Instant::now();
                let sum: f64 = points.iter().map(|point| grid.near(point).distance.abs()).sum();
                assert!(std::hint::black_box(sum) < 10_000.0 * 0.0011);
                start.elapsed().as_secs_f64()
            })
            .collect();
        times.sort_by(f64::total_cmp);
        println!("10,000 points: {:.0} µs (median), {:.0} µs (best)", times[100] * 1e6, times[0] * 1e6);
    }
}
