//! Triangles of an even size on the same surface: edges are halved, collapsed and flipped, points move along
//! the surface (Botsch and Kobbelt 2004). Points of borders and creases stay on them, corners stay in place.

use pliant_geometry::{SurfaceLocator, Vector3};
use rstar::{AABB, PointDistance, RTree, RTreeObject};

use crate::error::{MeshingError, require_at_most, require_positive};
use crate::surface::triangles::{TriangleMesh, shape};

/// Rounds of splits, collapses, flips and moves.
const ROUNDS: usize = 8;

/// Collapses leave no triangle of a worse shape, unless it was worse before.
const LEAST_SHAPE: f64 = 0.3;

/// A surface to stay on, with its marked lines.
pub(crate) struct Reference {
    locator: SurfaceLocator,
    lines: RTree<Segment>,
}

struct Segment([Vector3; 2]);

impl Segment {
    fn closest(&self, to: &Vector3) -> Vector3 {
        let along = self.0[1] - self.0[0];
        let part = (to - self.0[0]).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE);
        self.0[0] + part.clamp(0.0, 1.0) * along
    }
}

impl RTreeObject for Segment {
    type Envelope = AABB<[f64; 3]>;

    fn envelope(&self) -> Self::Envelope {
        AABB::from_corners(self.0[0].inf(&self.0[1]).into(), self.0[0].sup(&self.0[1]).into())
    }
}

impl PointDistance for Segment {
    fn distance_2(&self, point: &[f64; 3]) -> f64 {
        let point = Vector3::from(*point);
        (self.closest(&point) - point).norm_squared()
    }
}

impl Reference {
    pub(crate) fn new(mesh: &TriangleMesh) -> Self {
        let marked = mesh.edges().into_iter().filter(|&[a, b]| mesh.is_marked(a, b));
        let lines = marked.map(|edge| Segment(edge.map(|n| mesh.points[n as usize]))).collect();
        let locator = crate::report::hausdorff::locator(mesh);
        Self { locator, lines: RTree::bulk_load(lines) }
    }

    /// The nearest point of the surface and the normal there.
    pub(crate) fn closest(&self, to: &Vector3) -> (Vector3, Vector3) {
        self.locator.closest(to).map_or((*to, Vector3::zeros()), |at| (at.position, at.normal))
    }

    /// Returns the nearest point, and its normal, among normals with a cosine above `least` with `facing`;
    /// `None` if no such point is less than `within` [m] away.
    pub(crate) fn closest_facing(
        &self,
        to: &Vector3,
        facing: &Vector3,
        least: f64,
        within: f64,
    ) -> Option<(Vector3, Vector3)> {
        self.locator.closest_facing(to, facing, least, within).map(|at| (at.position, at.normal))
    }

    /// The nearest point of its marked lines.
    pub(crate) fn closest_on_lines(&self, to: &Vector3) -> Vector3 {
        self.lines.nearest_neighbor((*to).into()).map_or(*to, |line| line.closest(to))
    }
}

impl TriangleMesh {
    /// Makes all edges about `edge` [m] long. Refuses to make more than `cell_limit` triangles.
    pub fn remesh(&mut self, edge: f64, cell_limit: usize) -> Result<(), MeshingError> {
        require_positive("the edge", edge)?;
        let area: f64 = self.alive().map(|t| self.area(t)).sum();
        require_at_most(area / (edge * edge * 3.0_f64.sqrt() / 4.0), cell_limit)?;
        let reference = Reference::new(self);
        for _ in 0..ROUNDS {
            self.halve_longer(4.0 / 3.0 * edge);
            self.collapse_shorter(0.8 * edge, 4.0 / 3.0 * edge);
            self.flip_for_valence();
            self.relax(&reference);
        }
        Ok(())
    }

    fn length(&self, a: u32, b: u32) -> f64 {
        (self.points[a as usize] - self.points[b as usize]).norm()
    }

    fn halve_longer(&mut self, longest: f64) {
        loop {
            let long: Vec<_> =
                self.edges().into_iter().filter(|&[a, b]| self.length(a, b) > longest).collect();
            if long.is_empty() {
                return;
            }
            for [a, b] in long {
                let middle = (self.points[a as usize] + self.points[b as usize]) / 2.0;
                self.split(a, b, middle);
            }
        }
    }

    fn collapse_shorter(&mut self, shortest: f64, longest: f64) {
        for [a, b] in self.edges() {
            if self.sides(a, b)[0].is_none() || self.length(a, b) >= shortest {
                continue;
            }
            let lines = [a, b].map(|n| self.marked(n).len());
            for [keep, gone] in [[a, b], [b, a]] {
                let [kept, other] = if keep == a { lines } else { [lines[1], lines[0]] };
                let ends = [keep, gone].map(|n| self.points[n as usize]);
                let position = if kept == other && kept == 0 { (ends[0] + ends[1]) / 2.0 } else { ends[0] };
                let short = |n: &u32| (self.points[*n as usize] - position).norm() <= longest;
                if self.may_collapse(keep, gone)
                    && self.neighbours(gone).iter().all(short)
                    && self.keeps_sides(keep, gone, &position, LEAST_SHAPE)
                {
                    self.collapse(keep, gone, position);
                    break;
                }
            }
        }
    }

    /// Flips edges to bring points nearer to six neighbours, four on a border.
    fn flip_for_valence(&mut self) {
        let off = |mesh: &Self, point: u32, change: i64| {
            let border = mesh.neighbours(point).iter().any(|&n| mesh.is_border(point, n));
            let ideal = if border { 3 } else { 6 };
            (mesh.star[point as usize].len() as i64 + change - ideal).pow(2)
        };
        for [a, b] in self.edges() {
            let Some(new) = self.flipped(a, b) else { continue };
            let [Some(s), Some(t)] = self.sides(a, b) else { continue };
            let (c, d) = (self.opposite(s, a, b), self.opposite(t, a, b));
            let sum = |by: i64| off(self, a, -by) + off(self, b, -by) + off(self, c, by) + off(self, d, by);
            if sum(1) < sum(0) && self.flip_is_sound([s, t], new, 0.0) {
                self.flip(a, b, new);
            }
        }
    }

    /// True if two new triangles have the orientation of the old ones, and the worse shape is better than
    /// `factor` times the old.
    pub(crate) fn flip_is_sound(&self, old: [u32; 2], new: [[u32; 3]; 2], factor: f64) -> bool {
        let mean = self.normal(old[0]) + self.normal(old[1]);
        let x = new.map(|nodes| nodes.map(|n| self.points[n as usize]));
        let worst = |x: [f64; 2]| x[0].min(x[1]);
        let turned = x.iter().any(|&x| {
            let normal = crate::surface::triangles::cross(x);
            normal.dot(&mean) <= 0.5 * normal.norm() * mean.norm()
        });
        !turned
            && worst(x.map(shape))
                > factor * worst(old.map(|t| shape(self.corners(t)))).max(0.1 * (1.0 - factor).max(0.0))
    }

    /// Moves each point to the mean of the triangles around it, weighted by area, along the surface.
    fn relax(&mut self, reference: &Reference) {
        for point in 0..self.points.len() as u32 {
            if let Some(position) = self.evener(point, reference) {
                let turned = self.star[point as usize].iter().any(|&t| {
                    let nodes = self.triangles[t as usize];
                    let x = self.corners(t);
                    let moved = [0, 1, 2].map(|k| if nodes[k] == point { position } else { x[k] });
                    crate::surface::triangles::cross(moved).dot(&self.normal(t)) <= 0.0
                });
                if !turned {
                    self.points[point as usize] = position;
                }
            }
        }
    }

    /// A place of a point on the surface among evener triangles.
    fn evener(&self, point: u32, reference: &Reference) -> Option<Vector3> {
        let aim = self.even_place(point)?;
        let free = self.marked(point).is_empty();
        Some(if free { reference.closest(&aim).0 } else { reference.closest_on_lines(&aim) })
    }

    /// A place of a point near the surface among evener triangles.
    pub(crate) fn even_place(&self, point: u32) -> Option<Vector3> {
        if self.star[point as usize].is_empty() {
            return None;
        }
        let here = self.points[point as usize];
        match self.marked(point)[..] {
            [] => {
                let parts = self.star[point as usize].iter().map(|&t| {
                    let [a, b, c] = self.corners(t);
                    (self.area(t), (a + b + c) / 3.0)
                });
                let (area, sum) = parts.fold((0.0, Vector3::zeros()), |(area, sum), (part, centre)| {
                    (area + part, sum + part * centre)
                });
                let normal = self.point_normal(point);
                let way = sum / area - here;
                Some(here + way - way.dot(&normal) * normal)
            }
            [a, b] => {
                let middle = (self.points[a as usize] + self.points[b as usize]) / 2.0;
                let along = (self.points[b as usize] - self.points[a as usize]).try_normalize(0.0)?;
                Some(here + 0.5 * (middle - here).dot(&along) * along)
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::hausdorff::Hausdorff;
    use crate::shapes::phantom::{Organ, Phantom};

    /// The liver phantom at 8 mm: mean shape above 0.9, no triangle below 0.4, edges near 8 mm. The distance
    /// from the fine surface is the sagitta of chords of 8 mm on radii of 10 mm and more (h²/8r = 0.8 mm). At
    /// the thin edge of the lobe, which has no marked line, triangles stay behind by up to an edge.
    #[test]
    fn a_liver_gets_even_triangles_and_keeps_its_shape() {
        let fine =
            TriangleMesh::of_field(&Phantom::new(Organ::Liver, 1.0).unwrap(), 0.003, 1_000_000).unwrap();
        let mut even = fine.clone();
        even.remesh(0.008, 100_000).unwrap();
        let shapes: Vec<f64> = even.alive().map(|t| shape(even.corners(t))).collect();
        let mean = shapes.iter().sum::<f64>() / shapes.len() as f64;
        let least = shapes.iter().copied().fold(1.0, f64::min);
        assert!(mean > 0.9 && least > 0.4, "{mean} {least}");
        assert!(even.edges().iter().all(|&[a, b]| !even.is_border(a, b)));
        let apart = Hausdorff::between(&even, &fine, 0.002);
        assert!(apart.largest() < 0.008, "{apart:?}");
        assert!(apart.rms_forward < 0.0005, "{apart:?}");
    }
}
