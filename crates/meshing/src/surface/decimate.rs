//! Fewer triangles for the same surface: edges collapse in the order of their cost. The cost is the sum of
//! squared distances from the surrounding planes, each weighted by its area (Garland and Heckbert 1997).
//! Planes through borders and creases preserve these. A collapse must keep the topology, the orientation of
//! faces and some of their shape.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use nalgebra::Matrix3;
use pliant_geometry::Vector3;

use crate::error::{MeshingError, require_positive};
use crate::surface::boxes::Boxes;
use crate::surface::triangles::{TriangleMesh, cross};

/// Planes through borders and creases weigh this many times as much as faces of the same size.
const LINE_WEIGHT: f64 = 10.0;

/// Weight of a point's own place relative to its planes: makes places on flat parts unique and triangles
/// there even.
const PLACE_WEIGHT: f64 = 1e-3;

/// Collapses leave no triangle of a worse shape, unless it was worse before.
const LEAST_SHAPE: f64 = 0.1;

/// The search boxes are rebuilt once the insertions exceed the number of triangles by this factor.
const PUT_IN: usize = 4;

/// Condition to stop at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fewer {
    /// Stop at this many triangles.
    Triangles(usize),
    /// Stop when the root mean square distance from the planes of a point exceeds this [m].
    Distance(f64),
}

/// Sum of w (n·x + d)²: x·A x + 2 b·x + c, and the sum of w.
#[derive(Clone, Copy, Debug, Default)]
struct Quadric {
    a: Matrix3<f64>,
    b: Vector3,
    c: f64,
    weight: f64,
}

impl Quadric {
    fn plane(normal: &Vector3, through: &Vector3, weight: f64) -> Self {
        let d = -normal.dot(through);
        let a = weight * normal * normal.transpose();
        Self { a, b: weight * d * normal, c: weight * d * d, weight }
    }

    fn place(at: &Vector3, weight: f64) -> Self {
        let a = Matrix3::from_diagonal_element(weight);
        Self { a, b: -weight * at, c: weight * at.norm_squared(), weight: 0.0 }
    }

    fn add(&mut self, other: &Self) {
        self.a += other.a;
        self.b += other.b;
        self.c += other.c;
        self.weight += other.weight;
    }

    fn value(&self, x: &Vector3) -> f64 {
        (x.dot(&(self.a * x)) + 2.0 * self.b.dot(x) + self.c).max(0.0)
    }

    fn least(&self) -> Option<Vector3> {
        let found = self.a.cholesky()?.solve(&-self.b);
        found.iter().all(|x| x.is_finite()).then_some(found)
    }
}

/// A collapse with its cost when it was found.
struct Candidate {
    cost: f64,
    /// The part of the planes in the cost.
    off: f64,
    edge: [u32; 2],
    position: Vector3,
    /// Numbers of changes of its ends when it was found.
    changes: [u32; 2],
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.cost.total_cmp(&other.cost).then(self.edge.cmp(&other.edge))
    }
}

struct Decimation<'m> {
    mesh: &'m mut TriangleMesh,
    /// Quadrics of the planes, and of the points' own places.
    quadrics: Vec<[Quadric; 2]>,
    changes: Vec<u32>,
    queue: BinaryHeap<Reverse<Candidate>>,
    /// Present and past places of the triangles, if the surface is kept from crossing itself.
    placed: Option<Boxes>,
    /// Origin of the points, so that sums of squares keep their digits [m].
    origin: Vector3,
}

impl TriangleMesh {
    /// Reduces the number of triangles and returns it. It exceeds the requested number if nothing more can
    /// collapse.
    pub fn decimate(&mut self, until: Fewer) -> Result<usize, MeshingError> {
        let (least, limit) = match until {
            Fewer::Triangles(number) => {
                require_positive("the number of triangles", number as f64)?;
                (number, f64::INFINITY)
            }
            Fewer::Distance(distance) => {
                require_positive("the distance", distance)?;
                (0, distance)
            }
        };
        Ok(Decimation::new(self).run(least, limit))
    }

    /// The surface in each of some numbers of triangles, decreasing, or in a few more if nothing more can
    /// collapse. From `uncrossed` triangles down, collapses do not make triangles cross each other.
    pub(crate) fn decimated_to_each(mut self, numbers: &[usize], uncrossed: usize) -> Vec<Self> {
        let mut work = Decimation::new(&mut self);
        work.run(uncrossed.max(numbers.first().copied().unwrap_or(0)), f64::INFINITY);
        work.placed = Some(work.places());
        let at = |&number: &usize| {
            work.run(number, f64::INFINITY);
            work.mesh.compacted()
        };
        numbers.iter().map(at).collect()
    }
}

impl<'m> Decimation<'m> {
    fn new(mesh: &'m mut TriangleMesh) -> Self {
        let origin = mesh.alive().next().map_or(Vector3::zeros(), |t| mesh.corners(t)[0]);
        let mut quadrics = vec![[Quadric::default(); 2]; mesh.points.len()];
        for t in mesh.alive() {
            let x = mesh.corners(t).map(|x| x - origin);
            let area = 0.5 * cross(x).norm();
            let nodes = mesh.triangles[t as usize];
            let plane = Quadric::plane(&mesh.normal(t), &x[0], area / 3.0);
            for (node, x) in nodes.into_iter().zip(&x) {
                quadrics[node as usize][0].add(&plane);
                quadrics[node as usize][1].add(&Quadric::place(x, PLACE_WEIGHT * area / 3.0));
            }
            for k in 0..3 {
                let (a, b) = (nodes[k], nodes[(k + 1) % 3]);
                // The faces of a crease hold its points by themselves.
                if mesh.is_border(a, b) {
                    let along = x[(k + 1) % 3] - x[k];
                    let across = along.cross(&mesh.normal(t)).try_normalize(0.0).unwrap_or_default();
                    let mut wall = Quadric::plane(&across, &x[k], LINE_WEIGHT * along.norm_squared());
                    wall.weight = 0.0;
                    quadrics[a as usize][0].add(&wall);
                    quadrics[b as usize][0].add(&wall);
                }
            }
        }
        let changes = vec![0; mesh.points.len()];
        let mut work = Self { mesh, quadrics, changes, queue: BinaryHeap::new(), placed: None, origin };
        for edge in work.mesh.edges() {
            work.consider(edge);
        }
        work
    }

    fn consider(&mut self, [a, b]: [u32; 2]) {
        let planes = self.planes([a, b]);
        let mut sum = planes;
        self.quadrics[a as usize][1..].iter().chain(&self.quadrics[b as usize][1..]).for_each(|q| sum.add(q));
        let [p, q] = [a, b].map(|n| self.mesh.points[n as usize] - self.origin);
        let lines = [a, b].map(|n| self.mesh.marked(n).len());
        let position = match lines {
            [0, 0] => sum.least().filter(|x| (x - p).norm() < 2.0 * (p - q).norm()).unwrap_or((p + q) / 2.0),
            [0, _] => q,
            [_, 0] => p,
            [2, 2] => sum.least().filter(|x| (x - p).norm() < 2.0 * (p - q).norm()).unwrap_or((p + q) / 2.0),
            [2, _] => q,
            _ => p,
        };
        let candidate = Candidate {
            cost: sum.value(&position),
            off: planes.value(&position),
            edge: [a, b],
            position,
            changes: [self.changes[a as usize], self.changes[b as usize]],
        };
        self.queue.push(Reverse(candidate));
    }

    fn planes(&self, [a, b]: [u32; 2]) -> Quadric {
        let mut sum = self.quadrics[a as usize][0];
        sum.add(&self.quadrics[b as usize][0]);
        sum
    }

    fn run(&mut self, least: usize, limit: f64) -> usize {
        let mut count = self.mesh.len();
        while count > least
            && let Some(Reverse(next)) = self.queue.pop()
        {
            let [a, b] = next.edge;
            if [a, b].map(|n| self.changes[n as usize]) != next.changes || self.mesh.sides(a, b)[0].is_none()
            {
                continue;
            }
            if next.off > limit * limit * self.planes([a, b]).weight {
                continue;
            }
            let position = next.position + self.origin;
            let way = [[a, b], [b, a]].into_iter().find(|&[keep, gone]| self.mesh.may_collapse(keep, gone));
            let Some([keep, gone]) = way else { continue };
            if !self.mesh.keeps_sides(keep, gone, &position, LEAST_SHAPE) {
                continue;
            }
            if self.makes_cross(keep, gone, position) {
                continue;
            }
            count -= self.mesh.sides(a, b).iter().flatten().count();
            self.mesh.collapse(keep, gone, position);
            self.place_round(keep, count);
            let moved = self.quadrics[gone as usize];
            self.quadrics[keep as usize]
                .iter_mut()
                .zip(&moved)
                .for_each(|(quadric, other)| quadric.add(other));
            self.changes[keep as usize] += 1;
            self.changes[gone as usize] += 1;
            for other in self.mesh.neighbours(keep) {
                self.consider([keep.min(other), keep.max(other)]);
            }
        }
        count
    }

    /// Places of all triangles.
    fn places(&self) -> Boxes {
        let count = self.mesh.len().max(1) as f64;
        let area: f64 = self.mesh.alive().map(|t| self.mesh.area(t)).sum();
        let mut places = Boxes::new((area / count).sqrt());
        for t in self.mesh.alive() {
            places.insert(t, self.box_of(t));
        }
        places
    }

    fn box_of(&self, t: u32) -> [Vector3; 2] {
        let [a, b, c] = self.mesh.corners(t);
        [a.inf(&b).inf(&c), a.sup(&b).sup(&c)]
    }

    /// Inserts the changed triangles round a point. If too many old entries remain, all are inserted anew.
    fn place_round(&mut self, point: u32, count: usize) {
        let Some(mut placed) = self.placed.take() else { return };
        if placed.len() > PUT_IN * count {
            placed = self.places();
        } else {
            let star = &self.mesh.star[point as usize];
            star.iter().for_each(|&t| placed.insert(t, self.box_of(t)));
        }
        self.placed = Some(placed);
    }

    /// True if triangles cross after a collapse where none did before. Always false if crossings are allowed.
    fn makes_cross(&mut self, keep: u32, gone: u32, position: Vector3) -> bool {
        let Some(placed) = &self.placed else { return false };
        let mut old: Vec<u32> =
            [keep, gone].iter().flat_map(|&n| &self.mesh.star[n as usize]).copied().collect();
        old.sort_unstable();
        old.dedup();
        let before: Vec<[u32; 3]> = old.iter().map(|&t| self.mesh.triangles[t as usize]).collect();
        let stay = before.iter().filter(|nodes| !(nodes.contains(&keep) && nodes.contains(&gone)));
        let after: Vec<[u32; 3]> =
            stay.map(|nodes| nodes.map(|n| if n == gone { keep } else { n })).collect();
        let cross = |mesh: &TriangleMesh, triangles: &[[u32; 3]]| {
            let near = mesh.bounds(triangles).map(|bounds| placed.near(bounds)).unwrap_or_default();
            mesh.would_cross_among(triangles, &old, near.into_iter().filter(|&t| mesh.exists(t)))
        };
        let here = std::mem::replace(&mut self.mesh.points[keep as usize], position);
        let crosses = cross(self.mesh, &after);
        self.mesh.points[keep as usize] = here;
        crosses && !cross(self.mesh, &before)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::hausdorff::Hausdorff;
    use crate::surface::crossings::crossings;
    use crate::{DEFAULT_CELL_LIMIT, Pattern, Sheet, sphere};

    /// On a sphere, flat triangles of edge h are up to h²/6R off at their centres; 500 triangles have a mean
    /// edge of 0.24: 0.010, and half as much again for the longest.
    #[test]
    fn a_sphere_keeps_its_shape_and_stays_closed() {
        let (fine, _) = TriangleMesh::from_mesh(&sphere(1.0, 4, DEFAULT_CELL_LIMIT).unwrap()).unwrap();
        let mut coarse = fine.clone();
        assert_eq!(coarse.decimate(Fewer::Triangles(500)).unwrap(), 500);
        assert!(coarse.edges().iter().all(|&[a, b]| !coarse.is_border(a, b)));
        assert_eq!(coarse.compact().0.len() + 500 - coarse.edges().len(), 2);
        let apart = Hausdorff::between(&coarse, &fine, 0.02);
        assert!(apart.largest_forward < 0.015 && apart.largest_backward < 0.015, "{apart:?}");
    }

    /// A ball with a cavity, whose wall is thinner than the error of the last flat triangles. The faces of
    /// the wall do not cross.
    #[test]
    fn the_faces_of_a_thin_wall_do_not_cross() {
        let mut ball = sphere(1.0, 4, DEFAULT_CELL_LIMIT).unwrap();
        let cavity = sphere(0.95, 4, DEFAULT_CELL_LIMIT).unwrap();
        let first = ball.points.len() as u32;
        ball.points.extend(&cavity.points);
        for block in &cavity.blocks {
            ball.block_mut(block.kind).nodes.extend(block.nodes.iter().map(|node| first + node));
        }
        let (fine, _) = TriangleMesh::from_mesh(&ball).unwrap();
        let crossing = |mesh: &TriangleMesh| {
            let (points, triangles) = mesh.compact();
            crossings(&points, &triangles).0.len()
        };
        let mut plain = fine.clone();
        plain.decimate(Fewer::Triangles(120)).unwrap();
        assert!(crossing(&plain) > 0);
        let stages = fine.decimated_to_each(&[1000, 120], usize::MAX);
        assert!(stages.iter().all(|stage| crossing(stage) == 0));
        assert!(stages[0].len() <= 1000 && stages[1].len() < 500, "{}", stages[1].len());
    }

    /// A square needs two triangles, and its border doesn't move.
    #[test]
    fn a_square_becomes_few_triangles_within_its_border() {
        let square = Sheet::Plate { size: [1.0; 2] };
        let square = square.mesh([8; 2], Pattern::default(), None, DEFAULT_CELL_LIMIT).unwrap();
        let (mut mesh, _) = TriangleMesh::from_mesh(&square).unwrap();
        let fewer = mesh.decimate(Fewer::Distance(1e-6)).unwrap();
        assert!(fewer <= 16, "{fewer}");
        let area: f64 = mesh.alive().map(|t| mesh.area(t)).sum();
        assert!((area - 1.0).abs() < 1e-9, "{area}");
    }
}
