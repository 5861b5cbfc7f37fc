//! The curved surface of a shell: a cubic Bézier triangle over each facet, from the positions of its nodes and the normals that turn with
//! them. Each control point of an edge depends on that edge's nodes alone, so the surface is watertight in every
//! configuration. Its velocity is J times the nodes' velocities and spins; forces on it go back by the transpose of the
//! same J, so their work is the same. PN triangles (Vlachos et al. 2001), with control points along edges placed so that an
//! edge with equal end angles is an arc.
//! Leaves out: continuous tangents across edges (their jump falls with h²).

use std::collections::BTreeMap;
use std::ops::Deref;

use nalgebra::{Matrix3, SMatrix, Vector3};
pub use pliant_geometry::EdgeRule;
use pliant_geometry::{ControlWeights, CurvedTriangle, EDGES};

use crate::facet::{Facet, Vector18};
use crate::model::Model;
use crate::rotation::skew;
use crate::state::State;

/// Cosine of the angle between a nodal normal and a facet beyond which edges are straight: 60°.
const LEANING: f64 = 0.5;

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
    /// Edge control points on the straight edge, as at creases.
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

/// The curved triangle over a facet, and its motion with the facet's nodes.
#[derive(Clone, Debug)]
pub struct Patch(CurvedTriangle);

impl Deref for Patch {
    type Target = CurvedTriangle;

    fn deref(&self) -> &CurvedTriangle {
        &self.0
    }
}

impl CurvedSurface {
    /// The surface of all facets.
    pub fn new(model: &Model, rule: EdgeRule) -> Self {
        let mut neighbours = vec![[None; 3]; model.facets.len()];
        for sides in sides(&model.facets).values() {
            if let [(a, i), (b, j)] = sides[..] {
                neighbours[a][i] = Some(b as u32);
                neighbours[b][j] = Some(a as u32);
            }
        }
        let straight = straight_edges(model);
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

/// The facets at each edge, lower node first, and which of their edges 12, 23, 31 it is.
fn sides(facets: &[Facet]) -> BTreeMap<[u32; 2], Vec<(usize, usize)>> {
    let mut sides: BTreeMap<[u32; 2], Vec<(usize, usize)>> = BTreeMap::new();
    for (number, facet) in facets.iter().enumerate() {
        for i in 0..3 {
            let (a, b) = (facet.nodes[i], facet.nodes[(i + 1) % 3]);
            sides.entry([a.min(b), a.max(b)]).or_default().push((number, i));
        }
    }
    sides
}

/// Control points on the straight edge: at creases, whose sides have normals of their own, and where a normal leans so far from a
/// facet at the edge that a curve along it would fold.
pub(crate) fn straight_edges(model: &Model) -> Vec<[bool; 6]> {
    let mut straight = vec![[false; 6]; model.facets.len()];
    for sides in sides(&model.facets).values() {
        let normal = |facet: usize, node: u32| {
            let corner = model.facets[facet].nodes.iter().position(|&n| n == node);
            corner.map(|corner| model.corner_normals[facet][corner])
        };
        let leans = |facet: usize, normal: Option<u32>| {
            let [a, b, c] = model.facets[facet].nodes.map(|node| model.rest[node as usize]);
            let across = (b - a).cross(&(c - a)).normalize();
            normal.is_some_and(|normal| model.normals[normal as usize].direction.dot(&across) < LEANING)
        };
        for &(facet, i) in sides {
            for (k, [start, _]) in EDGES.into_iter().enumerate().filter(|(k, _)| k / 2 == i) {
                let node = model.facets[facet].nodes[start];
                let own = normal(facet, node);
                straight[facet][k] =
                    sides.iter().any(|&(other, _)| normal(other, node) != own || leans(other, own));
            }
        }
    }
    straight
}

impl Patch {
    /// A patch of corners [m] and unit normals; control points on straight edges where told.
    pub fn new(p: [Vector3<f64>; 3], n: [Vector3<f64>; 3], straight: [bool; 6], rule: EdgeRule) -> Self {
        Self(CurvedTriangle::new(p, n, straight, rule))
    }

    /// Two unit tangents and the normal.
    fn frame(&self, weights: [f64; 3]) -> [Vector3<f64>; 3] {
        let first = self.tangents(weights)[0].normalize();
        let normal = self.normal(weights);
        [first, normal.cross(&first), normal]
    }

    /// J: the velocity of a point over velocities and spins of the three nodes.
    pub fn jacobian(&self, weights: [f64; 3]) -> SMatrix<f64, 3, 18> {
        self.velocity_map(CurvedTriangle::weights(weights))
    }

    /// The velocity of the sum of the control points with weights.
    fn velocity_map(&self, weights: ControlWeights) -> SMatrix<f64, 3, 18> {
        let mut j = SMatrix::<f64, 3, 18>::zeros();
        let by = self.derivatives(weights);
        for (node, ([by_corner, by_normal], normal)) in by.into_iter().zip(self.normals()).enumerate() {
            j.fixed_columns_mut::<3>(6 * node).copy_from(&by_corner);
            j.fixed_columns_mut::<3>(6 * node + 3).copy_from(&(-by_normal * skew(normal)));
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
        let [by_second, by_third] = CurvedTriangle::weight_slopes(weights);
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

    /// Nodal forces and moments of a force on a point: Jᵀ f.
    pub fn nodal_forces(&self, weights: [f64; 3], force: &Vector3<f64>) -> Vector18 {
        self.jacobian(weights).tr_mul(force)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rotation::exponential;
    use crate::testing::moved;
    use pliant_testing::Random;

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

    /// How a point moves with one of the eighteen numbers of a patch, by central differences with 1e-6.
    fn slope(
        (p, n): ([Vector3<f64>; 3], [Vector3<f64>; 3]),
        place: usize,
        point: impl Fn([Vector3<f64>; 3], [Vector3<f64>; 3]) -> Vector3<f64>,
    ) -> Vector3<f64> {
        let h = 1e-6;
        let at = |by: f64| {
            let (p, n) = moved(&(p, n), place, by);
            point(p, n)
        };
        (at(h) - at(-h)) / (2.0 * h)
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
                for place in 0..18 {
                    let slope = slope((p, n), place, |p, n| Patch::new(p, n, straight, rule).point(l));
                    let off = slope - j.column(place);
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
                for place in 0..18 {
                    let slope = slope((p, n), place, |p, n| Patch::new(p, n, straight, rule).carried(&point));
                    let off = slope - j.column(place);
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
}
