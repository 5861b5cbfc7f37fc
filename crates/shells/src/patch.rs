//! One patch of the curved surface of shells: a cubic Bézier triangle over a facet, from the positions of its
//! nodes and the normals that turn with them. Its velocity is J times the nodes' velocities and spins. Forces
//! on the patch go back by the transpose of the same J, so their work is the same. The patches are PN
//! triangles (Vlachos et al. 2001), with control points along edges placed so that an edge with equal end
//! angles is an arc.

use std::ops::Deref;

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
pub use pliant_geometry::EdgeRule;
use pliant_geometry::{ControlWeights, CurvedTriangle};

use crate::rotation::skew;

/// Numbers of (u, v, w, θx, θy, θz) of three nodes, node by node.
pub type Vector18 = SVector<f64, 18>;

/// A place on the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The facet.
    pub facet: u32,
    /// Area coordinates, which add up to 1.
    pub weights: [f64; 3],
}

/// A point of a visual mesh that follows the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Carried {
    /// Its foot on the surface.
    pub place: Place,
    /// Its height above the foot along the normal [m].
    pub height: f64,
    /// Rest of its offset [m], along the facet's first tangent and the tangent across: 0 unless the foot is
    /// on a border.
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

impl Patch {
    /// A patch of corners [m] and unit normals; control points on straight edges where told.
    pub fn new(p: [Vector3<f64>; 3], n: [Vector3<f64>; 3], straight: [bool; 6], rule: EdgeRule) -> Self {
        Self(CurvedTriangle::new(p, n, straight, rule))
    }

    /// Two unit tangents and the normal.
    pub fn frame(&self, weights: [f64; 3]) -> [Vector3<f64>; 3] {
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

    /// A unit normal that is quadratic between the corners' normals. At the middle of an edge it is the
    /// normal that an S-shaped edge needs (Vlachos et al. 2001). It is the same on both sides of an edge. It
    /// differs from the surface's normal by a term that falls with the square of the edges.
    pub fn shading_normal(&self, weights: [f64; 3]) -> Vector3<f64> {
        let (p, n) = (self.corners(), self.normals());
        let sum = (0..3).fold(Vector3::zeros(), |sum, i| {
            let j = (i + 1) % 3;
            let (e, ends) = (p[j] - p[i], n[i] + n[j]);
            // The mean of the ends mirrored at the plane across the edge.
            let middle = ends - e * (2.0 * e.dot(&ends) / e.norm_squared());
            let middle = middle.try_normalize(0.0).unwrap_or(n[i]);
            sum + weights[i] * (weights[i] * n[i] + 2.0 * weights[j] * middle)
        });
        sum.try_normalize(0.0).unwrap_or(n[0])
    }

    /// Position [m] of a carried point on this patch.
    pub fn carried(&self, point: &Carried) -> Vector3<f64> {
        let [first, second, normal] = self.frame(point.place.weights);
        let aside = point.aside[0] * first + point.aside[1] * second;
        self.point(point.place.weights) + aside + point.height * normal
    }

    /// J of a carried point: the sum of J of its foot and J of its offset o = α t + β n × t + h n. Here t =
    /// a/|a| and n = a × b/|a × b| of the tangents a and b.
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

    /// Derivative of a point by one of the eighteen numbers of a patch, by central differences with 1e-6.
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
        let mut motion = Vector18::zeros();
        for (i, p) in p.iter().enumerate() {
            motion.fixed_rows_mut::<3>(6 * i).copy_from(&(v + w.cross(p)));
            motion.fixed_rows_mut::<3>(6 * i + 3).copy_from(&w);
        }
        let off = patch.jacobian(l) * motion - v - w.cross(&patch.point(l));
        assert!(off.norm() < 1e-13, "{off}");
    }

    /// A point off the surface, with its foot on a border: J by central differences with 1e-6, 1e-8; its
    /// forces keep their resultants, 1e-12, and ⟨J v, f⟩ = ⟨v, Jᵀ f⟩, 1e-13.
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
