//! Pressure on a curved triangle: the nodal forces and moments ∫ Jᵀ n dA of a pressure of 1, and their
//! change. Let h_a = ∫ F_a n dA on each control point b_a, and let D_a be the control points' velocities. The
//! forces are Σ D_aᵀ h_a. h is a sum of b_b × b_c with constant weights, so all is exact. Over a closed
//! surface, or one whose rim does not move, the force is the gradient of the volume. Its change is then
//! symmetric; otherwise the sides at the rim add an unsymmetric part.

use std::sync::LazyLock;

use nalgebra::{Matrix3, Vector3};
use pliant_geometry::EDGES;

use crate::control::points;
use crate::element::Matrix3x18;
use crate::facet::Matrix18;
use crate::patch::Patch;
use crate::patch::Vector18;
use crate::rotation::skew;

/// ∫ F_a (F_b,u F_c,v − F_c,u F_b,v) over the triangle of area ½: constants of the cubic patch.
static WEIGHTS: LazyLock<[[[f64; 9]; 9]; 9]> = LazyLock::new(|| {
    let mut table = [[[0.0; 9]; 9]; 9];
    for point in points() {
        let [along, across] = &point.slopes;
        for (a, weights) in table.iter_mut().enumerate() {
            let value = 0.5 * point.weight * point.value[a];
            for (b, weights) in weights.iter_mut().enumerate() {
                for (c, weight) in weights.iter_mut().enumerate() {
                    *weight += value * (along[b] * across[c] - along[c] * across[b]);
                }
            }
        }
    }
    table
});

/// The weights of b_b × b_c on each control point, for the pairs b < c in their order. Side by side, the sum
/// takes a fifth less time.
static PAIRS: LazyLock<[[f64; 9]; 36]> = LazyLock::new(|| {
    let mut pairs = (0..9).flat_map(|b| (b + 1..9).map(move |c| [b, c]));
    std::array::from_fn(|_| {
        let [b, c] = pairs.next().unwrap_or_default();
        std::array::from_fn(|a| WEIGHTS[a][b][c])
    })
});

impl Patch {
    /// Weights of the products b_b × b_c of control points in ∫ F_a n dA on each, for the pairs b < c of nine
    /// in their order.
    pub fn pressure_weights() -> &'static [[f64; 9]; 36] {
        &PAIRS
    }

    /// Nodal forces [m²] and moments [m³] of a pressure of 1: ∫ Jᵀ n dA.
    pub fn pressure_forces(&self) -> Vector18 {
        let forces = self.control_forces();
        let mut nodal = Vector18::zeros();
        let mut add = |row: usize, part: &Vector3<f64>| {
            let mut rows = nodal.fixed_rows_mut::<3>(row);
            rows += part;
        };
        (0..3).for_each(|corner| add(6 * corner, &forces[corner]));
        for (k, ([start, end], force)) in EDGES.into_iter().zip(&forces[3..]).enumerate() {
            let [along, turning] = self.edge_forces(k, force);
            add(6 * start, &(force - along));
            add(6 * end, &along);
            // Over the spin of the start, δn = −S(n) φ.
            add(6 * start + 3, &self.normals()[start].cross(&turning));
        }
        nodal
    }

    /// ⅓ ∫ x·n dA [m³]: over a closed surface the volume in it.
    pub fn volume(&self) -> f64 {
        let forces = self.control_forces();
        self.controls().iter().zip(&forces).map(|(place, force)| place.dot(force)).sum::<f64>() / 3.0
    }

    /// ∫ F_a n dA on each control point [m²].
    fn control_forces(&self) -> [Vector3<f64>; 9] {
        let place = self.centred();
        let mut forces = [Vector3::zeros(); 9];
        let mut pairs = PAIRS.iter();
        for b in 0..9 {
            for (other, weights) in place[b + 1..].iter().zip(&mut pairs) {
                let cross = place[b].cross(other);
                for (force, weight) in forces.iter_mut().zip(weights) {
                    *force += cross * *weight;
                }
            }
        }
        forces
    }

    /// The control points from the mean of the corners: no place in space makes a difference but for
    /// round-off.
    fn centred(&self) -> [Vector3<f64>; 9] {
        let centre = self.corners().iter().sum::<Vector3<f64>>() / 3.0;
        self.controls().map(|point| point - centre)
    }

    /// The change of [`Self::pressure_forces`] with positions and spins.
    pub fn pressure_change(&self) -> Matrix18 {
        let (place, maps, forces) = (self.centred(), self.edge_maps(), self.control_forces());
        let mut change = Matrix18::zeros();
        for (a, weights) in WEIGHTS.iter().enumerate() {
            // δh_a = Σ_c (Σ_b w_abc b_b) × δb_c.
            let mut moved = Matrix3x18::zeros();
            for c in 0..9 {
                let arm: Vector3<f64> = place.iter().zip(weights).map(|(b, weights)| b * weights[c]).sum();
                let arm = skew(&arm);
                let mut add = |column: usize, block: Matrix3<f64>| {
                    let mut columns = moved.fixed_columns_mut::<3>(column);
                    columns += block;
                };
                if c < 3 {
                    add(6 * c, arm);
                    continue;
                }
                let ([start, end], [along, turning]) = (EDGES[c - 3], &maps[c - 3]);
                let followed = arm * along;
                add(6 * start, arm - followed);
                add(6 * end, followed);
                add(6 * start + 3, arm * turning);
            }
            let mut add = |row: usize, block: &Matrix3x18| {
                let mut rows = change.fixed_rows_mut::<3>(row);
                rows += block;
            };
            if a < 3 {
                add(6 * a, &moved);
                continue;
            }
            let ([start, end], [along, turning]) = (EDGES[a - 3], &maps[a - 3]);
            let followed = along.tr_mul(&moved);
            add(6 * start, &(moved - followed));
            add(6 * end, &followed);
            add(6 * start + 3, &turning.tr_mul(&moved));
        }
        for (k, force) in forces[3..].iter().enumerate() {
            self.add_turning(k, force, &mut change);
        }
        change
    }

    /// Adds how Dᵀ h of an edge's control point changes with D.
    fn add_turning(&self, k: usize, force: &Vector3<f64>, change: &mut Matrix18) {
        let [start, end] = EDGES[k];
        let normal = &self.normals()[start];
        let [ee, en, nn] = self.edge_second_derivative(k, force);
        // Over the spin of the start, δn = −S(n) φ.
        let spin = skew(normal);
        let turned = -en * spin;
        let slope = self.edge_derivative(k).1.tr_mul(force);
        let both = -spin * nn * spin + normal * slope.transpose() - Matrix3::identity() * slope.dot(normal);
        let mut add = |row: usize, column: usize, block: &Matrix3<f64>| {
            let mut entries = change.fixed_view_mut::<3, 3>(row, column);
            entries += block;
        };
        for (row, sign) in [(start, -1.0), (end, 1.0)] {
            for (column, other) in [(start, -1.0), (end, 1.0)] {
                add(6 * row, 6 * column, &(ee * (sign * other)));
            }
            add(6 * row, 6 * start + 3, &(turned * sign));
            add(6 * start + 3, 6 * row, &(turned.transpose() * sign));
        }
        add(6 * start + 3, 6 * start + 3, &both);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patch::EdgeRule;
    use crate::rotation::exponential;
    use crate::testing::{Pose, moved};
    use pliant_testing::Random;

    const STRAIGHT: [[bool; 6]; 2] = [[false; 6], [true, true, false, false, false, true]];

    /// Σ D_aᵀ h_a.
    fn back(forces: &[Vector3<f64>; 9], maps: &[Matrix3x18; 9]) -> Vector18 {
        forces.iter().zip(maps).fold(Vector18::zeros(), |sum, (force, map)| sum + map.tr_mul(force))
    }

    fn vector(random: &mut Random) -> Vector3<f64> {
        Vector3::from_fn(|_, _| random.number())
    }

    /// A random triangle far from the origin with normals tilted by up to 0.3 rad.
    fn pose(random: &mut Random) -> Pose {
        let p = [[5.0, 0.0, 0.0], [6.0, 0.1, 0.0], [5.2, 0.9, 0.0]]
            .map(|p| Vector3::from(p) + 0.2 * vector(random));
        let normal = (p[1] - p[0]).cross(&(p[2] - p[0])).normalize();
        (p, [(); 3].map(|()| exponential(&(0.3 * vector(random))) * normal))
    }

    /// The written-out forces equal the products of whole matrices to 1e-14 of the largest.
    #[test]
    fn forces_are_those_by_the_maps_of_the_control_points() {
        let mut random = Random::new(4);
        for rule in [EdgeRule::Arc, EdgeRule::Third] {
            for straight in STRAIGHT {
                let (p, n) = pose(&mut random);
                let patch = Patch::new(p, n, straight, rule);
                let expected = back(&patch.control_forces(), &patch.control_maps());
                let off = (patch.pressure_forces() - expected).amax() / expected.amax();
                assert!(off < 1e-14, "{rule:?} {straight:?}: {off:e}");
            }
        }
    }

    /// Central differences with steps of 1e-5: 1e-8 of the largest.
    #[test]
    fn the_change_is_the_derivative_of_the_forces() {
        let mut random = Random::new(1);
        for rule in [EdgeRule::Arc, EdgeRule::Third] {
            for straight in STRAIGHT {
                let pose = pose(&mut random);
                let forces = |(p, n): Pose| Patch::new(p, n, straight, rule).pressure_forces();
                let change = Patch::new(pose.0, pose.1, straight, rule).pressure_change();
                for place in 0..18 {
                    let h = 1e-5;
                    let slope =
                        (forces(moved(&pose, place, h)) - forces(moved(&pose, place, -h))) / (2.0 * h);
                    let off = (slope - change.column(place)).amax() / change.amax();
                    assert!(off < 1e-8, "{rule:?} {straight:?} {place}: {off:e}");
                }
            }
        }
    }

    /// The force is f = dV + ⅓ ∮ (x × x_s)·dx over the rim, run through with the surface on its left, to
    /// 1e-12. V = ⅓ ∫ x·n dA is the volume of the cone to the origin. Five points of Gauss are exact for the
    /// rim, of the eighth degree.
    #[test]
    fn forces_are_the_gradient_of_the_volume_and_a_rim() {
        let mut random = Random::new(2);
        for straight in STRAIGHT {
            let (p, n) = pose(&mut random);
            let patch = Patch::new(p, n, straight, EdgeRule::Arc);
            let (place, maps, forces) = (patch.controls(), patch.control_maps(), patch.control_forces());
            let gradient: Vec<Vector3<f64>> = (0..9)
                .map(|c| {
                    // ⅓ (h_c + Σ_a ∂h_a/∂b_cᵀ b_a).
                    let moved = (0..9).fold(Vector3::zeros(), |sum, a| {
                        let arm: Vector3<f64> = (0..9).map(|b| place[b] * WEIGHTS[a][b][c]).sum();
                        sum + place[a].cross(&arm)
                    });
                    (forces[c] + moved) / 3.0
                })
                .collect();
            let gradient: [Vector3<f64>; 9] = gradient.try_into().unwrap();
            let mut expected = back(&gradient, &maps);
            // The points of one row of the rule on the triangle lie on a line: their weights there by their
            // own rule.
            let line = [
                (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
                (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
                (0.0, 0.568_888_888_888_888_9),
                (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
                (0.906_179_845_938_664, 0.236_926_885_056_189_1),
            ];
            for side in 0..3 {
                let controls = [side, 3 + 2 * side, 4 + 2 * side, (side + 1) % 3];
                for (at, weight) in line {
                    let (s, r) = (0.5 * (1.0 + at), 0.5 * (1.0 - at));
                    let value = [r * r * r, 3.0 * r * r * s, 3.0 * r * s * s, s * s * s];
                    let slope = [-3.0 * r * r, 3.0 * r * (r - 2.0 * s), 3.0 * s * (2.0 * r - s), 3.0 * s * s];
                    let sum = |w: [f64; 4]| {
                        controls.iter().zip(w).map(|(&b, w)| place[b] * w).sum::<Vector3<f64>>()
                    };
                    let moment = sum(value).cross(&sum(slope)) * (0.5 * weight / 3.0);
                    for (&b, value) in controls.iter().zip(value) {
                        expected += maps[b].tr_mul(&(moment * value));
                    }
                }
            }
            let off = (patch.pressure_forces() - expected).amax();
            assert!(off < 1e-12, "{off:e}");
        }
    }
}
