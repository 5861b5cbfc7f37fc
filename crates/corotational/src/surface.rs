//! The curved surface of a shell: a cubic Bézier triangle over each facet, from the positions of its nodes and the normals that turn with
//! them. Each control point of an edge depends on that edge's nodes alone, so the surface is watertight in every
//! configuration. Its velocity is J times the nodes' velocities and spins; forces on it go back by the transpose of the
//! same J, so their work is the same. PN triangles (Vlachos et al. 2001), with control points along edges placed so that an
//! edge with equal end angles is an arc.
//! Leaves out: continuous tangents across edges (their jump falls with h²).

use std::collections::BTreeMap;

use nalgebra::{Matrix3, SMatrix, Vector3};

use crate::facet::Vector18;
use crate::model::Model;
use crate::rotation::skew;
use crate::state::State;

/// Where control points lie along the tangent of an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EdgeRule {
    /// 2/(3 c (1 + c)) of the tangent, with c the cosine between edge and tangent: arcs, three to four times closer to spheres.
    #[default]
    Arc,
    /// A third: plain PN triangles.
    Third,
}

/// Cosines between edge and tangent below this do not shorten the tangent further.
const STEEPEST: f64 = 0.1;

/// Ends of the six control points along edges: 12, 21, 23, 32, 31, 13.
const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 0], [1, 2], [2, 1], [2, 0], [0, 2]];

/// A place on the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The facet.
    pub facet: u32,
    /// Area coordinates, which add up to 1.
    pub weights: [f64; 3],
}

/// The curved surface of a model's shells.
#[derive(Clone, Debug)]
pub struct CurvedSurface {
    rule: EdgeRule,
    /// Edge control points at creases: on the straight edge, since the two sides have normals of their own.
    straight: Vec<[bool; 6]>,
    /// The facet across each edge 12, 23, 31.
    neighbours: Vec<[Option<u32>; 3]>,
}

/// A point of a visual mesh that follows the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Carried {
    /// Its foot on the surface.
    pub place: Place,
    /// Its height above the foot along the normal [m].
    pub height: f64,
    /// What is left of its offset [m], along the facet's first tangent and the one across: 0 unless the foot is on a border.
    pub aside: [f64; 2],
}

/// One Bézier triangle.
#[derive(Clone, Debug)]
pub struct Patch {
    pub(crate) p: [Vector3<f64>; 3],
    pub(crate) n: [Vector3<f64>; 3],
    edge: [Vector3<f64>; 6],
    straight: [bool; 6],
    rule: EdgeRule,
}

impl CurvedSurface {
    /// The surface of all facets.
    pub fn new(model: &Model, rule: EdgeRule) -> Self {
        let mut sides: BTreeMap<[u32; 2], Vec<(usize, usize)>> = BTreeMap::new();
        for (number, facet) in model.facets.iter().enumerate() {
            for i in 0..3 {
                let (a, b) = (facet.nodes[i], facet.nodes[(i + 1) % 3]);
                sides.entry([a.min(b), a.max(b)]).or_default().push((number, i));
            }
        }
        let mut straight = vec![[false; 6]; model.facets.len()];
        let mut neighbours = vec![[None; 3]; model.facets.len()];
        for sides in sides.values() {
            if let [(a, i), (b, j)] = sides[..] {
                neighbours[a][i] = Some(b as u32);
                neighbours[b][j] = Some(a as u32);
            }
            let normal = |facet: usize, node: u32| {
                let corner = model.facets[facet].nodes.iter().position(|&n| n == node);
                corner.map(|corner| model.corner_normals[facet][corner])
            };
            for &(facet, i) in sides {
                for (k, [start, _]) in EDGES.into_iter().enumerate().filter(|(k, _)| k / 2 == i) {
                    let node = model.facets[facet].nodes[start];
                    straight[facet][k] =
                        sides.iter().any(|&(other, _)| normal(other, node) != normal(facet, node));
                }
            }
        }
        Self { rule, straight, neighbours }
    }

    /// The patch over a facet.
    pub fn patch(&self, model: &Model, state: &State, facet: u32) -> Patch {
        let facet = facet as usize;
        let p = model.facets[facet].nodes.map(|node| state.position[node as usize]);
        let n = model.corner_normals[facet].map(|normal| state.normal(model, normal as usize));
        Patch::new(p, n, self.straight[facet], self.rule)
    }

    /// The foot of a point on the surface at a state, found from a facet near it: the nearest place of its patch, then those of the
    /// neighbours across edges on which it lies, as long as they are nearer.
    pub fn project(&self, model: &Model, state: &State, point: Vector3<f64>, facet: u32) -> Place {
        let nearest = |facet: u32| {
            let (weights, distance) = self.patch(model, state, facet).closest(&point, [1.0 / 3.0; 3]);
            (Place { facet, weights }, distance)
        };
        let mut best = nearest(facet);
        let mut seen = vec![facet];
        let mut next = vec![best.0];
        while let Some(place) = next.pop() {
            for corner in (0..3).filter(|&corner| place.weights[corner] < 1e-12) {
                // The edge opposite to a corner lies across from it.
                let across = self.neighbours[place.facet as usize][(corner + 1) % 3];
                let Some(across) = across.filter(|facet| !seen.contains(facet)) else { continue };
                seen.push(across);
                let found = nearest(across);
                // Equally near, round a common corner, are ways on.
                if found.1 <= best.1 * (1.0 + 1e-9) {
                    next.push(found.0);
                }
                if found.1 < best.1 {
                    best = found;
                }
            }
        }
        best.0
    }

    /// A point of a visual mesh, bound to the surface where it now is; `facet` is one near it.
    pub fn carry(&self, model: &Model, state: &State, point: Vector3<f64>, facet: u32) -> Carried {
        self.bind(model, state, &point, self.project(model, state, point, facet))
    }

    pub(crate) fn bind(&self, model: &Model, state: &State, point: &Vector3<f64>, place: Place) -> Carried {
        let patch = self.patch(model, state, place.facet);
        let offset = point - patch.point(place.weights);
        let [first, second, normal] = patch.frame(place.weights);
        Carried { place, height: offset.dot(&normal), aside: [offset.dot(&first), offset.dot(&second)] }
    }

    /// Where a carried point is.
    pub fn carried(&self, model: &Model, state: &State, point: &Carried) -> Vector3<f64> {
        self.patch(model, state, point.place.facet).carried(point)
    }
}

/// Area coordinates of the point of a triangle that is closest to a point (Ericson 2005, Real-Time Collision Detection, 5.1.5).
pub(crate) fn closest_on_triangle([a, b, c]: &[Vector3<f64>; 3], to: &Vector3<f64>) -> [f64; 3] {
    let (ab, ac) = (b - a, c - a);
    let products = |from: &Vector3<f64>| (ab.dot(&(to - from)), ac.dot(&(to - from)));
    let ((d1, d2), (d3, d4), (d5, d6)) = (products(a), products(b), products(c));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let (over_a, over_b, over_c) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    if over_c <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let part = d1 / (d1 - d3);
        return [1.0 - part, part, 0.0];
    }
    if over_b <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let part = d2 / (d2 - d6);
        return [1.0 - part, 0.0, part];
    }
    if over_a <= 0.0 && d4 >= d3 && d5 >= d6 {
        let part = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - part, part];
    }
    let sum = over_a + over_b + over_c;
    [over_a / sum, over_b / sum, over_c / sum]
}

/// g(c) and its derivative.
fn reach(rule: EdgeRule, c: f64) -> (f64, f64) {
    match rule {
        EdgeRule::Third => (1.0 / 3.0, 0.0),
        EdgeRule::Arc if c < STEEPEST => (2.0 / (3.0 * STEEPEST * (1.0 + STEEPEST)), 0.0),
        EdgeRule::Arc => {
            let below = c * (1.0 + c);
            (2.0 / (3.0 * below), -2.0 * (1.0 + 2.0 * c) / (3.0 * below * below))
        }
    }
}

impl Patch {
    /// A patch of corners [m] and unit normals; control points on straight edges where told.
    pub fn new(p: [Vector3<f64>; 3], n: [Vector3<f64>; 3], straight: [bool; 6], rule: EdgeRule) -> Self {
        let mut patch = Self { p, n, edge: [Vector3::zeros(); 6], straight, rule };
        for (k, [i, j]) in EDGES.into_iter().enumerate() {
            let e = p[j] - p[i];
            patch.edge[k] = if straight[k] {
                p[i] + e / 3.0
            } else {
                let t = e - e.dot(&n[i]) * n[i];
                p[i] + reach(rule, t.norm() / e.norm()).0 * t
            };
        }
        patch
    }

    /// Weights of the corners and of the edges' control points; the middle one is spread over them with quadratic precision.
    fn weights([a, b, c]: [f64; 3]) -> ([f64; 3], [f64; 6]) {
        let middle = 6.0 * a * b * c;
        let corner = [a, b, c].map(|w| w * w * w - middle / 6.0);
        let edge = EDGES.map(|[i, j]| {
            let w = [a, b, c];
            3.0 * w[i] * w[i] * w[j] + 0.25 * middle
        });
        (corner, edge)
    }

    /// The point at area coordinates [m].
    pub fn point(&self, weights: [f64; 3]) -> Vector3<f64> {
        self.sum(Self::weights(weights))
    }

    /// Derivatives of the weights with respect to the second and the third area coordinate.
    fn weight_slopes([a, b, c]: [f64; 3]) -> [([f64; 3], [f64; 6]); 2] {
        let w = [a, b, c];
        // ∂/∂w of each weight, the three taken as independent.
        let middle = [6.0 * b * c, 6.0 * a * c, 6.0 * a * b];
        let slope = |k: usize| {
            let corner = [0, 1, 2].map(|i| if i == k { 3.0 * w[i] * w[i] } else { 0.0 } - middle[k] / 6.0);
            let edge = EDGES.map(|[i, j]| {
                let own = if k == i {
                    6.0 * w[i] * w[j]
                } else if k == j {
                    3.0 * w[i] * w[i]
                } else {
                    0.0
                };
                own + 0.25 * middle[k]
            });
            (corner, edge)
        };
        let first = slope(0);
        [slope(1), slope(2)].map(|(corner, edge)| {
            (std::array::from_fn(|i| corner[i] - first.0[i]), std::array::from_fn(|k| edge[k] - first.1[k]))
        })
    }

    /// The sum of the control points with weights.
    fn sum(&self, (corner, edge): ([f64; 3], [f64; 6])) -> Vector3<f64> {
        let corners = self.p.iter().zip(corner).map(|(p, w)| p * w);
        corners.chain(self.edge.iter().zip(edge).map(|(b, w)| b * w)).sum()
    }

    /// Its derivatives with respect to the second and the third area coordinate.
    pub fn tangents(&self, weights: [f64; 3]) -> [Vector3<f64>; 2] {
        Self::weight_slopes(weights).map(|slopes| self.sum(slopes))
    }

    /// The unit normal.
    pub fn normal(&self, weights: [f64; 3]) -> Vector3<f64> {
        let [along, across] = self.tangents(weights);
        along.cross(&across).normalize()
    }

    /// Two unit tangents and the normal.
    fn frame(&self, weights: [f64; 3]) -> [Vector3<f64>; 3] {
        let first = self.tangents(weights)[0].normalize();
        let normal = self.normal(weights);
        [first, normal.cross(&first), normal]
    }

    /// J: the velocity of a point over velocities and spins of the three nodes.
    pub fn jacobian(&self, weights: [f64; 3]) -> SMatrix<f64, 3, 18> {
        self.velocity_map(Self::weights(weights))
    }

    /// The velocity of the sum of the control points with weights.
    fn velocity_map(&self, (corner, edge): ([f64; 3], [f64; 6])) -> SMatrix<f64, 3, 18> {
        let mut j = SMatrix::<f64, 3, 18>::zeros();
        let mut add = |node: usize, spin: bool, part: Matrix3<f64>| {
            let mut block = j.fixed_columns_mut::<3>(6 * node + if spin { 3 } else { 0 });
            block += part;
        };
        for (node, w) in corner.into_iter().enumerate() {
            add(node, false, Matrix3::from_diagonal_element(w));
        }
        for (k, [start, end]) in EDGES.into_iter().enumerate() {
            let (along, turning) = self.edge_derivative(k);
            add(start, false, (Matrix3::identity() - along) * edge[k]);
            add(end, false, along * edge[k]);
            add(start, true, -turning * skew(&self.n[start]) * edge[k]);
        }
        j
    }

    /// Where a carried point is, of which this is the patch [m].
    pub fn carried(&self, point: &Carried) -> Vector3<f64> {
        let [first, second, normal] = self.frame(point.place.weights);
        let aside = point.aside[0] * first + point.aside[1] * second;
        self.point(point.place.weights) + aside + point.height * normal
    }

    /// J of a carried point: that of its foot, and of its offset o = α t + β n × t + h n with t = a/|a| and n = a × b/|a × b| of the
    /// tangents a and b.
    pub fn carried_jacobian(&self, point: &Carried) -> SMatrix<f64, 3, 18> {
        let weights = point.place.weights;
        let [by_second, by_third] = Self::weight_slopes(weights);
        let (a, b) = (self.sum(by_second), self.sum(by_third));
        let cross = a.cross(&b);
        let (t, n) = (a.normalize(), cross.normalize());
        let across =
            |unit: &Vector3<f64>, length: f64| (Matrix3::identity() - unit * unit.transpose()) / length;
        let [alpha, beta] = point.aside;
        // δo = (α I + β S(n)) δt + (h I − β S(t)) δn and δ(a × b) = S(a) δb − S(b) δa.
        let by_t = Matrix3::from_diagonal_element(alpha) + beta * skew(&n);
        let by_n =
            (Matrix3::from_diagonal_element(point.height) - beta * skew(&t)) * across(&n, cross.norm());
        let by_a = by_t * across(&t, a.norm()) - by_n * skew(&b);
        let by_b = by_n * skew(&a);
        self.jacobian(weights) + by_a * self.velocity_map(by_second) + by_b * self.velocity_map(by_third)
    }

    /// Nodal forces and moments of a force on a carried point: Jᵀ f.
    pub fn carried_forces(&self, point: &Carried, force: &Vector3<f64>) -> Vector18 {
        self.carried_jacobian(point).tr_mul(force)
    }

    /// The nearest place of the patch and its distance [m]: Gauss–Newton, in which each step goes to the nearest point of the tangent
    /// triangle, and is halved until it comes closer.
    pub(crate) fn closest(&self, point: &Vector3<f64>, start: [f64; 3]) -> ([f64; 3], f64) {
        let mut at = start;
        let mut distance = (self.point(at) - point).norm();
        for _ in 0..40 {
            let (x, [along, across]) = (self.point(at), self.tangents(at));
            let corner = |second: f64, third: f64| x + along * (second - at[1]) + across * (third - at[2]);
            let aim = closest_on_triangle(&[corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0)], point);
            let change = [0, 1, 2].map(|i| aim[i] - at[i]);
            if change.iter().all(|c| c.abs() < 1e-13) {
                break;
            }
            let closer = [1.0, 0.5, 0.25, 0.125, 1.0 / 64.0, 1.0 / 512.0].into_iter().find_map(|part| {
                let next = if part == 1.0 { aim } else { [0, 1, 2].map(|i| at[i] + part * change[i]) };
                let there = (self.point(next) - point).norm();
                (there < distance).then_some((next, there))
            });
            let Some(next) = closer else { break };
            (at, distance) = next;
        }
        (at, distance)
    }

    /// An upper bound for the distance of its points from the flat facet [m]: it lies in the convex hull of its control points.
    pub(crate) fn bulge(&self) -> f64 {
        let edges: Vector3<f64> = self.edge.iter().sum();
        let corners: Vector3<f64> = self.p.iter().sum();
        let middle = 0.25 * edges - corners / 6.0;
        let off = |control: &Vector3<f64>| {
            let foot = closest_on_triangle(&self.p, control);
            (self.p.iter().zip(foot).map(|(p, w)| p * w).sum::<Vector3<f64>>() - control).norm()
        };
        self.edge.iter().chain([&middle]).map(off).fold(0.0, f64::max)
    }

    /// ∂b/∂e and ∂b/∂n of an edge's control point.
    fn edge_derivative(&self, k: usize) -> (Matrix3<f64>, Matrix3<f64>) {
        if self.straight[k] {
            return (Matrix3::from_diagonal_element(1.0 / 3.0), Matrix3::zeros());
        }
        let [i, j] = EDGES[k];
        let (e, n) = (self.p[j] - self.p[i], self.n[i]);
        let t = e - e.dot(&n) * n;
        let (length, size) = (e.norm(), t.norm());
        let c = size / length;
        let (g, slope) = reach(self.rule, c);
        let by_e = Matrix3::identity() - n * n.transpose();
        let by_n = -(n * e.transpose() + Matrix3::from_diagonal_element(e.dot(&n)));
        if slope == 0.0 {
            return (g * by_e, g * by_n);
        }
        let c_e = t.transpose() * by_e / (size * length) - e.transpose() * (c / (length * length));
        let c_n = t.transpose() * by_n / (size * length);
        (g * by_e + slope * t * c_e, g * by_n + slope * t * c_n)
    }

    /// Nodal forces [m²] and moments [m³] of a pressure of 1: ∫ Jᵀ n dA, with the rule of six points of Dunavant (1985), exact to the
    /// fourth degree.
    pub fn pressure_forces(&self) -> Vector18 {
        const POINTS: [(f64, f64); 2] =
            [(0.445_948_490_915_965, 0.223_381_589_678_011), (0.091_576_213_509_771, 0.109_951_743_655_322)];
        let mut sum = Vector18::zeros();
        for (a, weight) in POINTS {
            for corner in 0..3 {
                let mut at = [a; 3];
                at[corner] = 1.0 - 2.0 * a;
                let [along, across] = self.tangents(at);
                sum += self.nodal_forces(at, &(0.5 * weight * along.cross(&across)));
            }
        }
        sum
    }

    /// Nodal forces and moments of a force on a point: Jᵀ f.
    pub fn nodal_forces(&self, weights: [f64; 3], force: &Vector3<f64>) -> Vector18 {
        self.jacobian(weights).tr_mul(force)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rotation::exponential;
    use crate::testing::Random;

    fn clamped(weights: [f64; 3]) -> [f64; 3] {
        let positive = weights.map(|w| w.max(0.0));
        let sum: f64 = positive.iter().sum();
        positive.map(|w| w / sum)
    }

    fn vector(random: &mut Random) -> Vector3<f64> {
        Vector3::from_fn(|_, _| random.number())
    }

    /// A random triangle with normals tilted by up to 0.3 rad.
    fn patch(random: &mut Random, rule: EdgeRule) -> ([Vector3<f64>; 3], [Vector3<f64>; 3], EdgeRule) {
        let p = [[0.0, 0.0, 0.0], [1.0, 0.1, 0.0], [0.2, 0.9, 0.0]]
            .map(|p| Vector3::from(p) + 0.2 * vector(random));
        let normal = (p[1] - p[0]).cross(&(p[2] - p[0])).normalize();
        let n = [(); 3].map(|()| exponential(&(0.3 * vector(random))) * normal);
        (p, n, rule)
    }

    fn weights(random: &mut Random) -> [f64; 3] {
        clamped([(); 3].map(|()| random.number().abs()))
    }

    /// Central differences with 1e-6: 1e-8.
    #[test]
    fn jacobian_is_the_derivative_of_the_point() {
        let mut random = Random::new(1);
        for rule in [EdgeRule::Arc, EdgeRule::Third] {
            for straight in [[false; 6], [true, true, false, false, false, true]] {
                let (p, n, rule) = patch(&mut random, rule);
                let l = weights(&mut random);
                let j = Patch::new(p, n, straight, rule).jacobian(l);
                let h = 1e-6;
                for place in 0..18 {
                    let at = |by: f64| {
                        let (mut p, mut n) = (p, n);
                        let mut change = Vector3::zeros();
                        change[place % 3] = by;
                        if place % 6 < 3 {
                            p[place / 6] += change;
                        } else {
                            n[place / 6] = exponential(&change) * n[place / 6];
                        }
                        Patch::new(p, n, straight, rule).point(l)
                    };
                    let off = (at(h) - at(-h)) / (2.0 * h) - j.column(place);
                    assert!(off.norm() < 1e-8, "{rule:?} {place}: {off}");
                }
            }
        }
    }

    /// ⟨J v, f⟩ = ⟨v, Jᵀ f⟩ to 1e-13, Σ f_i = f and Σ x_i × f_i + m_i = x × f to 1e-12.
    #[test]
    fn forces_go_back_by_the_transpose_and_keep_their_resultants() {
        let mut random = Random::new(2);
        for rule in [EdgeRule::Arc, EdgeRule::Third] {
            let (p, n, rule) = patch(&mut random, rule);
            let l = weights(&mut random);
            let patch = Patch::new(p, n, [false; 6], rule);
            let (f, v) = (vector(&mut random), Vector18::from_fn(|_, _| random.number()));
            let back = patch.nodal_forces(l, &f);
            assert!(((patch.jacobian(l) * v).dot(&f) - v.dot(&back)).abs() < 1e-13);
            let part = |a: usize| back.fixed_rows::<3>(3 * a).into_owned();
            assert!((part(0) + part(2) + part(4) - f).norm() < 1e-12);
            let moment = (0..3).fold(Vector3::zeros(), |m, i| m + p[i].cross(&part(2 * i)) + part(2 * i + 1));
            assert!((moment - patch.point(l).cross(&f)).norm() < 1e-12);
        }
    }

    /// A rigid spin moves points as part of the body, 1e-13.
    #[test]
    fn a_rigid_motion_is_reproduced() {
        let mut random = Random::new(3);
        let (p, n, rule) = patch(&mut random, EdgeRule::Arc);
        let patch = Patch::new(p, n, [false; 6], rule);
        let l = weights(&mut random);
        let (v, w) = (vector(&mut random), vector(&mut random));
        let mut all = Vector18::zeros();
        for (i, p) in p.iter().enumerate() {
            all.fixed_rows_mut::<3>(6 * i).copy_from(&(v + w.cross(p)));
            all.fixed_rows_mut::<3>(6 * i + 3).copy_from(&w);
        }
        let off = patch.jacobian(l) * all - v - w.cross(&patch.point(l));
        assert!(off.norm() < 1e-13, "{off}");
    }

    /// A point off the surface, with its foot on a border: J by central differences with 1e-6, 1e-8; its forces keep their resultants,
    /// 1e-12, and ⟨J v, f⟩ = ⟨v, Jᵀ f⟩, 1e-13.
    #[test]
    fn forces_on_carried_points_go_back_by_the_transpose() {
        let mut random = Random::new(5);
        for rule in [EdgeRule::Arc, EdgeRule::Third] {
            for straight in [[false; 6], [true, true, false, false, false, true]] {
                let (p, n, rule) = patch(&mut random, rule);
                let place = Place { facet: 0, weights: weights(&mut random) };
                let point = Carried { place, height: 0.3, aside: [-0.1, 0.2] };
                let patch = Patch::new(p, n, straight, rule);
                let j = patch.carried_jacobian(&point);
                let h = 1e-6;
                for place in 0..18 {
                    let at = |by: f64| {
                        let (mut p, mut n) = (p, n);
                        let mut change = Vector3::zeros();
                        change[place % 3] = by;
                        if place % 6 < 3 {
                            p[place / 6] += change;
                        } else {
                            n[place / 6] = exponential(&change) * n[place / 6];
                        }
                        Patch::new(p, n, straight, rule).carried(&point)
                    };
                    let off = (at(h) - at(-h)) / (2.0 * h) - j.column(place);
                    assert!(off.norm() < 1e-8, "{rule:?} {place}: {off}");
                }
                let (f, v) = (vector(&mut random), Vector18::from_fn(|_, _| random.number()));
                let back = patch.carried_forces(&point, &f);
                assert!(((j * v).dot(&f) - v.dot(&back)).abs() < 1e-13);
                let part = |a: usize| back.fixed_rows::<3>(3 * a).into_owned();
                assert!((part(0) + part(2) + part(4) - f).norm() < 1e-12);
                let moment =
                    (0..3).fold(Vector3::zeros(), |m, i| m + p[i].cross(&part(2 * i)) + part(2 * i + 1));
                assert!((moment - patch.carried(&point).cross(&f)).norm() < 1e-12);
            }
        }
    }

    #[test]
    fn tangents_are_derivatives() {
        let mut random = Random::new(4);
        let (p, n, rule) = patch(&mut random, EdgeRule::Arc);
        let patch = Patch::new(p, n, [false; 6], rule);
        let [a, b, c] = weights(&mut random);
        let h = 1e-6;
        let second = (patch.point([a - h, b + h, c]) - patch.point([a + h, b - h, c])) / (2.0 * h);
        let third = (patch.point([a - h, b, c + h]) - patch.point([a + h, b, c - h])) / (2.0 * h);
        let [along, across] = patch.tangents([a, b, c]);
        assert!((along - second).norm() < 1e-8 && (across - third).norm() < 1e-8);
    }

    /// Arcs: an edge whose end normals are those of a circle lies on it to 1e-3 of its sagitta at 40°.
    #[test]
    fn an_edge_of_a_circle_is_an_arc() {
        let at = |angle: f64| Vector3::new(angle.cos(), angle.sin(), 0.0);
        let ends = [at(0.0), at(0.7), Vector3::new(0.9, 0.3, 0.5)];
        let patch = Patch::new(ends, [ends[0], ends[1], Vector3::x()], [false; 6], EdgeRule::Arc);
        for s in [0.2, 0.5, 0.8] {
            let off = (patch.point([1.0 - s, s, 0.0]).norm() - 1.0).abs();
            assert!(off < 1e-4, "{off:e}");
        }
    }
}
