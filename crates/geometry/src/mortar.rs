//! Mortar rows: how the nodes of one surface follow another surface whose mesh does not match, so that a
//! constant stress passes.
//!
//! A multiplier ψ_a at each tied node of the follower requires ∫ ψ_a (u_f − u_m) = 0 over the common area.
//! The ψ_a are dual to the shape functions N_b of the follower, ∫ ψ_a N_b = δ_ab ∫ N_b (Wohlmuth 2000). So
//! each tied node has its own row:
//!
//! ```text
//! u_a = Σ_m M_am u_m / D_a,   M_am = ∫ ψ_a N_m,   D_a = ∫ N_a.
//! ```
//!
//! * *Integration* runs over segments. A face of the other surface is projected on the plane of a follower's
//!   face and clipped by this face (Puso and Laursen 2004). The polygon is split into triangles round its
//!   centre, which have Gauss points. The same points are used for ψ, D and M, so linear fields are followed
//!   to round-off whatever the rule. The rule decides how exactly forces pass: exactly for triangles and
//!   parallelograms, to about 1e-12 for other quadrilaterals.
//! * *Borders.* ψ on a face comes from the part that has a counterpart (Cichosz and Bischoff 2011). Nodes of
//!   the face that are not tied, such as those beyond the end of the other surface, have no ψ. Their shape
//!   functions are shared out among the tied nodes, so that Σ ψ_a = 1 everywhere (as at crosspoints, Puso and
//!   Laursen 2004). These nodes appear in the rows of the tied ones.
//! * *Curved surfaces.* A row gives Σ X_m ≠ X_a where the meshes are apart. [`MortarRow::offset`] is the
//!   difference. The caller has to add it by a gradient, so that rotations cost nothing.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, Vector2};
use rstar::{AABB, RTree, primitives::GeomWithData, primitives::Rectangle};

use crate::{CellKind, Face, Vector3};

/// Largest cosine between the normals of two faces that lie on each other.
const FACING: f64 = -0.5;
/// Segments below this part of a face are round-off.
const SLIVER: f64 = 1e-10;
/// Weights below this are round-off.
const TINY: f64 = 1e-15;

/// A side of an interface.
#[derive(Clone, Copy, Debug)]
pub struct MortarSide<'a> {
    /// Its faces.
    pub faces: &'a [Face],
    /// Points [m], by the numbers that faces have.
    pub points: &'a [Vector3],
}

/// Dependence of a node on other nodes.
#[derive(Clone, Debug, PartialEq)]
pub struct MortarRow {
    /// The node of the follower.
    pub node: u32,
    /// Nodes of the other side with their weights.
    pub followed: Vec<(u32, f64)>,
    /// Nodes of its own side that are not tied, with their weights. All weights of both sides sum to 1.
    pub free: Vec<(u32, f64)>,
    /// The place of the node less the place that its weights give [m]: zero up to round-off where both
    /// surfaces are flat.
    pub offset: Vector3,
}

/// The rows of an interface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MortarRows {
    /// By increasing node.
    pub rows: Vec<MortarRow>,
    /// Common area that no tied node takes part in [m²].
    pub untied: f64,
    /// Common area [m²].
    pub area: f64,
}

/// Computes the rows of the tied nodes of `follower`, over its faces that lie on faces of `other`. The gap is
/// at most `reach` [m], or half of the size of the follower's face if that is more.
pub fn mortar_rows(
    follower: MortarSide<'_>,
    other: MortarSide<'_>,
    tied: impl Fn(u32) -> bool,
    reach: f64,
) -> MortarRows {
    let boxes = other.faces.iter().enumerate().map(|(index, face)| {
        let (low, high) = bounds(face, other.points);
        GeomWithData::new(Rectangle::<[f64; 3]>::from_corners(low.into(), high.into()), index)
    });
    let tree: RTree<_> = RTree::bulk_load(boxes.collect());
    let mut sums: BTreeMap<u32, Sums> = BTreeMap::new();
    let mut found = MortarRows::default();
    for face in follower.faces {
        let (low, high) = bounds(face, follower.points);
        let reach = reach.max(0.5 * (high - low).norm());
        let slack = Vector3::repeat(reach);
        let around = AABB::from_corners((low - slack).into(), (high + slack).into());
        let mut near: Vec<usize> =
            tree.locate_in_envelope_intersecting(around).map(|entry| entry.data).collect();
        near.sort_unstable();
        let Some(plane) = Plane::of(face, follower.points) else { continue };
        let mine = plane.face(face, follower.points);
        let segments = near.iter().filter_map(|&index| {
            let yours = &other.faces[index];
            let facing = yours.normal(other.points).dot(&plane.normal) <= FACING;
            let segment = facing.then(|| mine.segment(&plane.face(yours, other.points), reach)).flatten()?;
            Some((index, segment))
        });
        let segments: Vec<(usize, Vec<Sample>)> = segments.collect();
        let area: f64 = segments.iter().flat_map(|(_, samples)| samples).map(|sample| sample.weight).sum();
        found.area += area;
        let nodes = face.nodes();
        let multipliers: Vec<usize> = (0..nodes.len()).filter(|&a| tied(nodes[a])).collect();
        let Some(dual) = dual_functions(&segments, nodes.len(), &multipliers) else {
            found.untied += area;
            continue;
        };
        for (index, sample) in
            segments.iter().flat_map(|(index, samples)| samples.iter().map(move |sample| (index, sample)))
        {
            for (row, &a) in multipliers.iter().enumerate() {
                let psi: f64 = (0..nodes.len()).map(|b| dual[(row, b)] * sample.follower[b]).sum();
                let sums = sums.entry(nodes[a]).or_default();
                sums.diagonal += sample.weight * sample.follower[a];
                for (&node, n) in other.faces[*index].nodes().iter().zip(sample.other) {
                    *sums.followed.entry(node).or_default() += sample.weight * psi * n;
                }
                for (b, &node) in nodes.iter().enumerate().filter(|(b, _)| !multipliers.contains(b)) {
                    *sums.untied.entry(node).or_default() -= sample.weight * psi * sample.follower[b];
                }
            }
        }
    }
    found.rows = sums.into_iter().map(|(node, sums)| sums.row(node, follower.points, other.points)).collect();
    found
}

/// Sums for a tied node.
#[derive(Default)]
struct Sums {
    diagonal: f64,
    followed: BTreeMap<u32, f64>,
    untied: BTreeMap<u32, f64>,
}

impl Sums {
    fn row(self, node: u32, own_points: &[Vector3], points: &[Vector3]) -> MortarRow {
        let over = |sums: BTreeMap<u32, f64>| -> Vec<(u32, f64)> {
            let weights = sums.into_iter().map(|(node, sum)| (node, sum / self.diagonal));
            weights.filter(|(_, weight)| weight.abs() > TINY).collect()
        };
        let (followed, free) = (over(self.followed), over(self.untied));
        let reached = |weights: &[(u32, f64)], points: &[Vector3]| -> Vector3 {
            weights.iter().map(|&(node, weight)| points[node as usize] * weight).sum()
        };
        let offset = own_points[node as usize] - reached(&followed, points) - reached(&free, own_points);
        MortarRow { node, followed, free, offset }
    }
}

/// The coefficients of ψ over the shape functions of a face, a row for each tied node: D G⁻¹ φ. In φ, the
/// shape functions of nodes that are not tied are shared out among the tied ones, and G = ∫ φ Nᵀ over these.
/// `None` without common area or tied nodes.
fn dual_functions(segments: &[(usize, Vec<Sample>)], nodes: usize, tied: &[usize]) -> Option<DMatrix<f64>> {
    let mut mass = DMatrix::zeros(nodes, nodes);
    for sample in segments.iter().flat_map(|(_, samples)| samples) {
        for (a, b) in (0..nodes).flat_map(|a| (0..nodes).map(move |b| (a, b))) {
            mass[(a, b)] += sample.weight * sample.follower[a] * sample.follower[b];
        }
    }
    if tied.is_empty() || segments.is_empty() {
        return None;
    }
    let share = 1.0 / tied.len() as f64;
    let shared =
        DMatrix::from_fn(tied.len(), nodes, |row, b| match tied.iter().position(|&corner| corner == b) {
            Some(at) => f64::from(u8::from(at == row)),
            None => share,
        });
    let products = &shared * &mass;
    let gram = DMatrix::from_fn(tied.len(), tied.len(), |row, column| products[(row, tied[column])]);
    let diagonal = DMatrix::from_diagonal(&gram.row_sum().transpose());
    Some(diagonal * gram.try_inverse()? * shared)
}

/// A Gauss point of a segment.
struct Sample {
    /// Its part of the area [m²].
    weight: f64,
    /// Shape functions of the follower's face and of the other one.
    follower: [f64; 4],
    other: [f64; 4],
}

/// The plane of a face.
struct Plane {
    origin: Vector3,
    normal: Vector3,
    axes: [Vector3; 2],
}

impl Plane {
    /// `None` of a face without area.
    fn of(face: &Face, points: &[Vector3]) -> Option<Self> {
        let normal = face.normal(points);
        let origin = face.centre(points);
        let first = points[face.nodes()[0] as usize] - origin;
        let along = (first - normal * normal.dot(&first)).try_normalize(0.0)?;
        (normal != Vector3::zeros()).then(|| Self { origin, normal, axes: [along, normal.cross(&along)] })
    }

    fn face(&self, face: &Face, points: &[Vector3]) -> Projected {
        let place = |&node: &u32| {
            let from = points[node as usize] - self.origin;
            (Vector2::new(from.dot(&self.axes[0]), from.dot(&self.axes[1])), from.dot(&self.normal))
        };
        let (corners, heights) = face.nodes().iter().map(place).unzip();
        Projected { kind: face.kind, corners, heights }
    }
}

/// A face seen along the normal of a plane.
struct Projected {
    kind: CellKind,
    /// In the axes of the plane [m].
    corners: Vec<Vector2<f64>>,
    /// Above the plane [m].
    heights: Vec<f64>,
}

impl Projected {
    /// The part that lies below another face, in Gauss points. `None` without such a part, or if the gap at
    /// its centre is wider than `reach` [m].
    fn segment(&self, other: &Self, reach: f64) -> Option<Vec<Sample>> {
        let polygon = clipped(&other.corners, &self.corners);
        let whole = doubled_area(&self.corners);
        let area = doubled_area(&polygon).abs();
        if polygon.len() < 3 || area <= SLIVER * whole {
            return None;
        }
        let centre = polygon.iter().sum::<Vector2<f64>>() / polygon.len() as f64;
        let height = |face: &Self| -> Option<f64> {
            let n = face.shape_functions(&centre)?;
            Some(face.heights.iter().zip(n).map(|(h, n)| h * n).sum())
        };
        if (height(other)? - height(self)?).abs() > reach {
            return None;
        }
        let rule = triangle_rule(self.gauss_points().max(other.gauss_points()));
        let mut samples = Vec::with_capacity(rule.len() * polygon.len());
        for (k, a) in polygon.iter().enumerate() {
            let b = polygon[(k + 1) % polygon.len()];
            let (u, v) = (a - centre, b - centre);
            let double = u.perp(&v).abs();
            for &([s, t], weight) in &rule {
                let at = centre + u * s + v * t;
                let (follower, other) = (self.shape_functions(&at)?, other.shape_functions(&at)?);
                samples.push(Sample { weight: weight * double, follower, other });
            }
        }
        Some(samples)
    }

    /// Gauss points along a side of a segment for an error of 1e-13. On triangles and parallelograms the
    /// product of two shape functions is of fourth order at most. On other quadrilaterals shape functions are
    /// not polynomials of the place. They are singular where the Jacobian J₀ + J₁ ξ + J₂ η vanishes. The
    /// error of n points is ρ^(−2n) with ρ = z + √(z² − 1), z = J₀/(|J₁| + |J₂|).
    fn gauss_points(&self) -> usize {
        const AFFINE: usize = 3;
        let x = &self.corners;
        if self.kind == CellKind::Triangle {
            return AFFINE;
        }
        let [u, v, w] = [x[1] + x[2] - x[0] - x[3], x[2] + x[3] - x[0] - x[1], x[0] - x[1] + x[2] - x[3]];
        let z = u.perp(&v).abs() / (u.perp(&w).abs() + w.perp(&v).abs());
        let digits = 13.0 * std::f64::consts::LN_10;
        // An infinite z, of a parallelogram, needs no more points.
        let more = digits / (2.0 * z.max(1.05).acosh());
        (AFFINE + more.ceil() as usize).min(16)
    }

    /// The shape functions at a place of the plane; `None` where a quadrilateral has no such place.
    fn shape_functions(&self, at: &Vector2<f64>) -> Option<[f64; 4]> {
        let x = &self.corners;
        if self.kind == CellKind::Triangle {
            let (u, v, w) = (x[1] - x[0], x[2] - x[0], at - x[0]);
            let [s, t] = [w.perp(&v) / u.perp(&v), u.perp(&w) / u.perp(&v)];
            return Some([1.0 - s - t, s, t, 0.0]);
        }
        let bilinear = |[s, t]: [f64; 2]| {
            [(1.0 - s) * (1.0 - t), (1.0 + s) * (1.0 - t), (1.0 + s) * (1.0 + t), (1.0 - s) * (1.0 + t)]
                .map(|n| 0.25 * n)
        };
        let size = (x[2] - x[0]).norm();
        let mut xi = [0.0; 2];
        // Newton's method from the middle.
        for _ in 0..30 {
            let n = bilinear(xi);
            let rest = at - (0..4).map(|k| x[k] * n[k]).sum::<Vector2<f64>>();
            let along = |[a, b]: [f64; 2]| ((x[1] - x[0]) * a + (x[2] - x[3]) * b) * 0.25;
            let du = along([1.0 - xi[1], 1.0 + xi[1]]);
            let dv = ((x[3] - x[0]) * (1.0 - xi[0]) + (x[2] - x[1]) * (1.0 + xi[0])) * 0.25;
            let step = [rest.perp(&dv) / du.perp(&dv), du.perp(&rest) / du.perp(&dv)];
            xi = [xi[0] + step[0], xi[1] + step[1]];
            if !(xi[0].abs() < 10.0 && xi[1].abs() < 10.0) {
                return None;
            }
            if rest.norm() <= 1e-15 * size || step[0].abs().max(step[1].abs()) <= 1e-16 {
                break;
            }
        }
        Some(bilinear(xi))
    }
}

/// Twice the area of a polygon in the plane [m²], positive where it turns to the left.
fn doubled_area(polygon: &[Vector2<f64>]) -> f64 {
    let from = |k: usize| polygon[k] - polygon[0];
    (1..polygon.len().saturating_sub(1)).map(|k| from(k).perp(&from(k + 1))).sum()
}

/// The part of a polygon inside of a convex one that turns to the left (Sutherland and Hodgman 1974).
fn clipped(polygon: &[Vector2<f64>], by: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
    let mut left = polygon.to_vec();
    for (k, a) in by.iter().enumerate() {
        let edge = by[(k + 1) % by.len()] - a;
        let depth = |x: &Vector2<f64>| edge.perp(&(x - a));
        let mut next = Vec::with_capacity(left.len() + 1);
        for (i, x) in left.iter().enumerate() {
            let y = left[(i + 1) % left.len()];
            let (dx, dy) = (depth(x), depth(&y));
            if dx >= 0.0 {
                next.push(*x);
            }
            if (dx > 0.0 && dy < 0.0) || (dx < 0.0 && dy > 0.0) {
                next.push(x + (y - x) * (dx / (dx - dy)));
            }
        }
        left = next;
    }
    left
}

/// Points (s, t) of the triangle s, t ≥ 0, s + t ≤ 1 with their weights, which sum to ½. This is the product
/// of Gauss rules of `n` points on the square, collapsed. Exact for polynomials of order 2 n − 2.
fn triangle_rule(n: usize) -> Vec<([f64; 2], f64)> {
    let line = gauss_rule(n);
    let point =
        |&(x, w): &(f64, f64)| line.iter().map(move |&(y, v)| ([x, y * (1.0 - x)], w * v * (1.0 - x)));
    line.iter().flat_map(point).collect()
}

/// Gauss's rule of `n` points on [0, 1], by Newton's method for the roots of Legendre's polynomial.
fn gauss_rule(n: usize) -> Vec<(f64, f64)> {
    let legendre = |x: f64| {
        let (mut before, mut now) = (1.0, x);
        for k in 2..=n {
            let k = k as f64;
            (before, now) = (now, ((2.0 * k - 1.0) * x * now - (k - 1.0) * before) / k);
        }
        (now, n as f64 * (x * now - before) / (x * x - 1.0))
    };
    let point = |i: usize| {
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        for _ in 0..10 {
            let (value, slope) = legendre(x);
            x -= value / slope;
        }
        let slope = legendre(x).1;
        (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..n).map(point).collect()
}

fn bounds(face: &Face, points: &[Vector3]) -> (Vector3, Vector3) {
    let first = points[face.nodes()[0] as usize];
    let corners = face.nodes().iter().map(|&node| points[node as usize]);
    corners.fold((first, first), |(low, high), x| (low.inf(&x), high.sup(&x)))
}

#[cfg(test)]
mod tests {
    use pliant_testing::Random;

    use super::*;
    use crate::testing::{block_of_hexes, block_of_tets, noise};
    use crate::{Mesh, Surface, boundary};

    type MeshOfCells = fn([u32; 3]) -> Mesh;

    /// A block over [0, 1] × [0, 1] with `cells` cells each way. Its points move by up to a part of a cell,
    /// points on its sides along them.
    fn block(mut mesh: Mesh, cells: [u32; 3], height: f64, seed: u64, amount: f64) -> Mesh {
        let mut random = Random::new(seed);
        for point in &mut mesh.points {
            let moved = noise(&mut random);
            for c in 0..3 {
                let inside = point[c] > 0.0 && point[c] < f64::from(cells[c]);
                point[c] = (point[c] + if inside { amount * moved[c] } else { 0.0 }) / f64::from(cells[c]);
            }
            point.z += height;
        }
        mesh
    }

    /// The faces of a boundary whose normal is along z, up or down.
    fn level(mesh: &Mesh, up: bool) -> Vec<Face> {
        let Surface { faces } = boundary(mesh);
        let sign = if up { 1.0 } else { -1.0 };
        faces.into_iter().filter(|face| sign * face.normal(&mesh.points).z > 0.99).collect()
    }

    /// ∫ N_a over faces [m²], by the rule that is exact for flat faces.
    fn nodal_areas(faces: &[Face], mesh: &Mesh) -> Vec<f64> {
        let mut areas = vec![0.0; mesh.points.len()];
        for face in faces {
            let plane = Plane::of(face, &mesh.points).unwrap();
            let projected = plane.face(face, &mesh.points);
            let samples = projected.segment(&plane.face(face, &mesh.points), 1.0).unwrap();
            for (a, &node) in face.nodes().iter().enumerate() {
                areas[node as usize] += samples.iter().map(|s| s.weight * s.follower[a]).sum::<f64>();
            }
        }
        areas
    }

    /// Crooked meshes of tets and hexes in every order. A row sums to 1 and follows linear fields, and a
    /// constant stress passes from mesh to mesh.
    #[test]
    fn rows_pass_linear_fields_and_constant_stresses() {
        let kinds: [(MeshOfCells, &str); 2] = [(block_of_hexes, "hexes"), (block_of_tets, "tets")];
        for ((low, low_name), (high, high_name)) in
            kinds.into_iter().flat_map(|low| kinds.map(|high| (low, high)))
        {
            for (a, b) in [(3, 5), (5, 3), (4, 4), (1, 6), (8, 3)] {
                let name = format!("{a} {low_name}, {b} {high_name}");
                let below = block(low([a, a, 2]), [a, a, 2], -1.0, 3, 0.25);
                let above = block(high([b, b, 2]), [b, b, 2], 0.0, 4, 0.25);
                let [mine, yours] = [level(&below, true), level(&above, false)];
                let follower = MortarSide { faces: &mine, points: &below.points };
                let other = MortarSide { faces: &yours, points: &above.points };
                let found = mortar_rows(follower, other, |_| true, 0.01);
                assert_eq!(found.rows.len() as u32, (a + 1) * (a + 1), "{name}");
                assert!((found.area - 1.0).abs() < 1e-12 && found.untied == 0.0, "{name}: {}", found.area);
                let given = nodal_areas(&mine, &below);
                let mut taken = vec![0.0; above.points.len()];
                for row in &found.rows {
                    assert!(row.free.is_empty() && row.offset.norm() < 1e-13, "{name}: {row:?}");
                    let sum: f64 = row.followed.iter().map(|(_, weight)| weight).sum();
                    assert!((sum - 1.0).abs() < 1e-13, "{name}: {sum}");
                    for &(node, weight) in &row.followed {
                        taken[node as usize] += weight * given[row.node as usize];
                    }
                }
                for (node, wanted) in nodal_areas(&yours, &above).into_iter().enumerate() {
                    let off = (taken[node] - wanted).abs() * f64::from(b * b);
                    assert!(off < 1e-11, "{name}: {off:e} of a face at {node}");
                }
            }
        }
    }

    /// The other surface ends within faces of the follower: nodes beyond its end are not tied. A row with
    /// these nodes sums to 1 and follows linear fields. Forces of a constant stress on the common area
    /// balance at every node.
    #[test]
    fn faces_that_reach_beyond_the_other_surface_count_in_part() {
        for (shift, tied_columns) in [(0.55, 3), (0.5 + 1e-9, 2), (0.749, 3)] {
            let below = block(block_of_hexes([4, 4, 1]), [4, 4, 1], -1.0, 3, 0.2);
            let mut above = block(block_of_hexes([3, 5, 1]), [3, 5, 1], 0.0, 4, 0.2);
            // Only x < `shift` of the follower is covered.
            above.points.iter_mut().for_each(|x| x.x *= shift);
            let [mine, yours] = [level(&below, true), level(&above, false)];
            let end = above.points.iter().map(|x| x.x).fold(0.0, f64::max);
            let tied = |node: u32| below.points[node as usize].x <= end;
            let other = MortarSide { faces: &yours, points: &above.points };
            let found = mortar_rows(MortarSide { faces: &mine, points: &below.points }, other, tied, 0.01);
            assert!(found.rows.len() >= 5 * (tied_columns - 1), "{}", found.rows.len());
            assert!((found.area - shift).abs() < 1e-9 && found.untied == 0.0, "{found:?}");
            let mut taken = vec![0.0; above.points.len()];
            let mut beyond = 0.0;
            for row in &found.rows {
                let sum: f64 = row.followed.iter().chain(&row.free).map(|(_, weight)| weight).sum();
                assert!((sum - 1.0).abs() < 1e-12 && row.offset.norm() < 1e-12, "{row:?}");
                assert!(row.free.iter().all(|&(node, _)| !tied(node)));
                let largest = row.followed.iter().map(|(_, w)| w.abs()).fold(0.0, f64::max);
                assert!(largest < 4.0, "{row:?}");
                beyond += row.free.iter().map(|(_, weight)| weight).sum::<f64>();
                // D_a is the force on the tied node of a unit stress on the common area.
                let given = common_area_of(row.node, &mine, &below, &yours, &above);
                row.followed.iter().for_each(|&(node, w)| taken[node as usize] += w * given);
            }
            assert!(beyond != 0.0);
            for (node, wanted) in nodal_areas(&yours, &above).into_iter().enumerate() {
                assert!((taken[node] - wanted).abs() < 1e-11, "{} for {wanted} at {node}", taken[node]);
            }
        }
    }

    /// ∫ N_a over the part of the faces that lies on the others [m²].
    fn common_area_of(node: u32, mine: &[Face], below: &Mesh, yours: &[Face], above: &Mesh) -> f64 {
        let of_face = |face: &Face| {
            let Some(a) = face.nodes().iter().position(|&corner| corner == node) else { return 0.0 };
            let plane = Plane::of(face, &below.points).unwrap();
            let projected = plane.face(face, &below.points);
            let segments =
                yours.iter().filter_map(|other| projected.segment(&plane.face(other, &above.points), 1.0));
            segments.flatten().map(|sample| sample.weight * sample.follower[a]).sum()
        };
        mine.iter().map(of_face).sum()
    }
}
