//! A curved triangle: the cubic Bézier triangle of three positions and unit normals. Each control point of an
//! edge depends on that edge's ends alone, so neighbours of the same ends meet without a gap. PN triangles
//! (Vlachos et al. 2001), with control points along edges placed so that an edge with equal end angles is an
//! arc. Leaves out: continuous tangents across edges (their jump falls with h²).

use nalgebra::Matrix3;

use crate::Vector3;
use crate::locate::barycentric_of_closest;

/// Rule for control points along the tangent of an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EdgeRule {
    /// 2/(3 c (1 + c)) of the tangent, with c the cosine between edge and tangent: arcs, three to four times
    /// closer to spheres.
    #[default]
    Arc,
    /// A third: plain PN triangles.
    Third,
}

/// Cosines between edge and tangent below this do not shorten the tangent further.
const STEEPEST: f64 = 0.1;

/// Ends of the six control points along edges: 12, 21, 23, 32, 31, 13.
pub const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 0], [1, 2], [2, 1], [2, 0], [0, 2]];

/// Weights of the three corners and of the six control points along edges.
pub type ControlWeights = ([f64; 3], [f64; 6]);

/// One Bézier triangle.
#[derive(Clone, Debug)]
pub struct CurvedTriangle {
    corners: [Vector3; 3],
    normals: [Vector3; 3],
    edge: [Vector3; 6],
    straight: [bool; 6],
    rule: EdgeRule,
}

/// g(c) and its first two derivatives.
fn reach(rule: EdgeRule, c: f64) -> [f64; 3] {
    match rule {
        EdgeRule::Third => [1.0 / 3.0, 0.0, 0.0],
        EdgeRule::Arc if c < STEEPEST => [2.0 / (3.0 * STEEPEST * (1.0 + STEEPEST)), 0.0, 0.0],
        EdgeRule::Arc => {
            let below = c * (1.0 + c);
            [
                2.0 / (3.0 * below),
                -2.0 * (1.0 + 2.0 * c) / (3.0 * below * below),
                4.0 * (1.0 + 3.0 * c + 3.0 * c * c) / (3.0 * below * below * below),
            ]
        }
    }
}

impl CurvedTriangle {
    /// Builds a triangle from corners [m] and unit normals. `straight` puts control points on the straight
    /// edge: next to the first and the second end of the edges 12, 23 and 31.
    pub fn new(p: [Vector3; 3], n: [Vector3; 3], straight: [bool; 6], rule: EdgeRule) -> Self {
        let mut patch = Self { corners: p, normals: n, edge: [Vector3::zeros(); 6], straight, rule };
        for (k, [i, j]) in EDGES.into_iter().enumerate() {
            let e = p[j] - p[i];
            patch.edge[k] = if straight[k] {
                p[i] + e / 3.0
            } else {
                let t = e - e.dot(&n[i]) * n[i];
                p[i] + reach(rule, t.norm() / e.norm())[0] * t
            };
        }
        patch
    }

    /// Its corners [m].
    pub fn corners(&self) -> &[Vector3; 3] {
        &self.corners
    }

    /// Its longest straight edge [m].
    pub fn size(&self) -> f64 {
        let [a, b, c] = self.corners;
        (b - a).norm().max((c - b).norm()).max((a - c).norm())
    }

    /// The unit normal of the flat facet; zero without area.
    pub fn facet_normal(&self) -> Vector3 {
        let [a, b, c] = self.corners;
        (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default()
    }

    /// Its control points along edges, in the order of [`EDGES`] [m].
    pub fn edge_points(&self) -> &[Vector3; 6] {
        &self.edge
    }

    /// True for each control point on a straight edge.
    pub fn straight(&self) -> &[bool; 6] {
        &self.straight
    }

    /// The unit normals given at its corners.
    pub fn normals(&self) -> &[Vector3; 3] {
        &self.normals
    }

    /// Weights of the corners and of the edges' control points; the middle one is spread over them with
    /// quadratic precision.
    pub fn weights([a, b, c]: [f64; 3]) -> ControlWeights {
        let middle = 6.0 * a * b * c;
        let corner = [a, b, c].map(|w| w * w * w - middle / 6.0);
        let edge = EDGES.map(|[i, j]| {
            let w = [a, b, c];
            3.0 * w[i] * w[i] * w[j] + 0.25 * middle
        });
        (corner, edge)
    }

    /// The point at area coordinates [m].
    pub fn point(&self, weights: [f64; 3]) -> Vector3 {
        self.sum(Self::weights(weights))
    }

    /// Derivatives of the weights with respect to the second and the third area coordinate.
    pub fn weight_slopes([a, b, c]: [f64; 3]) -> [ControlWeights; 2] {
        let w = [a, b, c];
        // ∂/∂w of each weight, the three taken as independent.
        let middle = [6.0 * b * c, 6.0 * a * c, 6.0 * a * b];
        let slope = |k: usize| {
            let corner = [0, 1, 2].map(|i| if i == k { 3.0 * w[i] * w[i] } else { 0.0 } - middle[k] / 6.0);
            let edge = EDGES.map(|[i, j]| {
                let direct = if k == i {
                    6.0 * w[i] * w[j]
                } else if k == j {
                    3.0 * w[i] * w[i]
                } else {
                    0.0
                };
                direct + 0.25 * middle[k]
            });
            (corner, edge)
        };
        let first = slope(0);
        [slope(1), slope(2)].map(|(corner, edge)| {
            (std::array::from_fn(|i| corner[i] - first.0[i]), std::array::from_fn(|k| edge[k] - first.1[k]))
        })
    }

    /// The sum of the control points with weights.
    pub fn sum(&self, (corner, edge): ControlWeights) -> Vector3 {
        let corners = self.corners.iter().zip(corner).map(|(p, w)| p * w);
        corners.chain(self.edge.iter().zip(edge).map(|(b, w)| b * w)).sum()
    }

    /// Its derivatives with respect to the second and the third area coordinate.
    pub fn tangents(&self, weights: [f64; 3]) -> [Vector3; 2] {
        Self::weight_slopes(weights).map(|slopes| self.sum(slopes))
    }

    /// The unit normal.
    pub fn normal(&self, weights: [f64; 3]) -> Vector3 {
        let [along, across] = self.tangents(weights);
        along.cross(&across).normalize()
    }

    /// Finds the nearest point of the patch and its distance [m], by Gauss–Newton. Each step moves to the
    /// nearest point of the tangent triangle, and is halved until it comes closer.
    pub fn closest(&self, point: &Vector3, start: [f64; 3]) -> ([f64; 3], f64) {
        self.closest_in(40, point, start)
    }

    /// Finds the nearest point like [`closest`](Self::closest), with a limited number of steps. An early stop
    /// returns the distance of a nearby point, which is never too small.
    pub fn closest_in(&self, steps: usize, point: &Vector3, start: [f64; 3]) -> ([f64; 3], f64) {
        let mut at = start;
        let mut distance = (self.point(at) - point).norm();
        for _ in 0..steps {
            let (x, [along, across]) = (self.point(at), self.tangents(at));
            let corner = |second: f64, third: f64| x + along * (second - at[1]) + across * (third - at[2]);
            let aim = barycentric_of_closest(&[corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0)], point);
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

    /// An upper bound for the distance of its points from the flat facet [m]: it lies in the convex hull of
    /// its control points.
    pub fn bulge(&self) -> f64 {
        let edges: Vector3 = self.edge.iter().sum();
        let corners: Vector3 = self.corners.iter().sum();
        let middle = 0.25 * edges - corners / 6.0;
        let off = |control: &Vector3| {
            let foot = barycentric_of_closest(&self.corners, control);
            (self.corners.iter().zip(foot).map(|(p, w)| p * w).sum::<Vector3>() - control).norm()
        };
        self.edge.iter().chain([&middle]).map(off).fold(0.0, f64::max)
    }

    /// ∂b/∂e and ∂b/∂n of an edge's control point b with the edge's vector e and the normal n at its start.
    pub fn edge_derivative(&self, k: usize) -> (Matrix3<f64>, Matrix3<f64>) {
        if self.straight[k] {
            return (Matrix3::from_diagonal_element(1.0 / 3.0), Matrix3::zeros());
        }
        let [i, j] = EDGES[k];
        let (e, n) = (self.corners[j] - self.corners[i], self.normals[i]);
        let t = e - e.dot(&n) * n;
        let (length, size) = (e.norm(), t.norm());
        let c = size / length;
        let [g, slope, _] = reach(self.rule, c);
        let by_e = Matrix3::identity() - n * n.transpose();
        let by_n = -(n * e.transpose() + Matrix3::from_diagonal_element(e.dot(&n)));
        if slope == 0.0 {
            return (g * by_e, g * by_n);
        }
        let c_e = t.transpose() * by_e / (size * length) - e.transpose() * (c / (length * length));
        let c_n = t.transpose() * by_n / (size * length);
        (g * by_e + slope * t * c_e, g * by_n + slope * t * c_n)
    }

    /// Converts a force on an edge's control point to forces on the edge's vector and on the normal at its
    /// start. These are the transposes of [`edge_derivative`](Self::edge_derivative) times the force.
    pub fn edge_forces(&self, k: usize, force: &Vector3) -> [Vector3; 2] {
        if self.straight[k] {
            return [force / 3.0, Vector3::zeros()];
        }
        let [i, j] = EDGES[k];
        let (e, n) = (self.corners[j] - self.corners[i], self.normals[i]);
        let (s, up) = (e.dot(&n), force.dot(&n));
        let t = e - s * n;
        let (length, size) = (e.norm(), t.norm());
        let c = size / length;
        let [g, slope, _] = reach(self.rule, c);
        let (by_e, by_n) = (g * (force - up * n), -g * (up * e + s * force));
        if slope == 0.0 {
            return [by_e, by_n];
        }
        // t and n are at right angles.
        let pull = slope * t.dot(force);
        let c_e = t / (size * length) - e * (c / (length * length));
        [by_e + pull * c_e, by_n - t * (pull * s / (size * length))]
    }

    /// Second derivatives of w·b of an edge's control point b, for a constant vector w. They are ∂²/∂e²,
    /// ∂²/∂e∂n (rows e) and ∂²/∂n².
    pub fn edge_second_derivative(&self, k: usize, w: &Vector3) -> [Matrix3<f64>; 3] {
        if self.straight[k] {
            return [Matrix3::zeros(); 3];
        }
        let identity = Matrix3::<f64>::identity();
        let [i, j] = EDGES[k];
        let (e, n) = (self.corners[j] - self.corners[i], self.normals[i]);
        let s = e.dot(&n);
        let t = e - s * n;
        // t and its derivatives; of a·t the second ones.
        let (t_e, t_n) = (identity - n * n.transpose(), -(n * e.transpose() + identity * s));
        let mixed = |a: &Vector3| -(n * a.transpose() + identity * a.dot(&n));
        let turned = |a: &Vector3| -(a * e.transpose() + e * a.transpose());
        // q = |t|²/|e|² = c².
        let length = e.norm_squared();
        let q = t.norm_squared() / length;
        let c = q.sqrt();
        let [g, slope, bend] = reach(self.rule, c);
        if slope == 0.0 {
            return [Matrix3::zeros(), g * mixed(w), g * turned(w)];
        }
        let (by_q, by_qq) = (0.5 * slope / c, 0.25 * (bend - slope / c) / q);
        let (size_e, size_n) = (2.0 * t_e.tr_mul(&t), 2.0 * t_n.tr_mul(&t));
        let (q_e, q_n) = ((size_e - 2.0 * q * e) / length, size_n / length);
        let both = size_e * e.transpose();
        let q_ee = (2.0 * t_e.tr_mul(&t_e) - 2.0 * q * identity) / length
            + (8.0 * q * e * e.transpose() - 2.0 * (both + both.transpose())) / (length * length);
        let q_en =
            2.0 * (t_e.tr_mul(&t_n) + mixed(&t)) / length - 2.0 * e * size_n.transpose() / (length * length);
        let q_nn = 2.0 * (t_n.tr_mul(&t_n) + turned(&t)) / length;
        let along = w.dot(&t);
        let (w_e, w_n) = (t_e.tr_mul(w), t_n.tr_mul(w));
        let whole = |a: &Vector3, b: &Vector3, w_a: &Vector3, w_b: &Vector3, second: Matrix3<f64>| {
            along * (by_qq * a * b.transpose() + by_q * second)
                + by_q * (a * w_b.transpose() + w_a * b.transpose())
        };
        [
            whole(&q_e, &q_e, &w_e, &w_e, q_ee),
            whole(&q_e, &q_n, &w_e, &w_n, q_en) + g * mixed(w),
            whole(&q_n, &q_n, &w_n, &w_n, q_nn) + g * turned(w),
        ]
    }

    /// Derivatives of the sum of the control points with weights, with respect to each corner and to each
    /// corner's normal.
    pub fn derivatives(&self, (corner, edge): ControlWeights) -> [[Matrix3<f64>; 2]; 3] {
        let mut by = corner.map(|w| [Matrix3::from_diagonal_element(w), Matrix3::zeros()]);
        for (k, [start, end]) in EDGES.into_iter().enumerate() {
            let (along, turning) = self.edge_derivative(k);
            by[start][0] += (Matrix3::identity() - along) * edge[k];
            by[end][0] += along * edge[k];
            by[start][1] += turning * edge[k];
        }
        by
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Arcs: an edge with the end normals of a circle lies on the circle to 1e-3 of its sagitta at
    /// 40°.
    #[test]
    fn an_edge_of_a_circle_is_an_arc() {
        let at = |angle: f64| Vector3::new(angle.cos(), angle.sin(), 0.0);
        let ends = [at(0.0), at(0.7), Vector3::new(0.9, 0.3, 0.5)];
        let patch = CurvedTriangle::new(ends, [ends[0], ends[1], Vector3::x()], [false; 6], EdgeRule::Arc);
        for s in [0.2, 0.5, 0.8] {
            let off = (patch.point([1.0 - s, s, 0.0]).norm() - 1.0).abs();
            assert!(off < 1e-4, "{off:e}");
        }
    }

    /// Neighbours of the same ends share the curve between them, to rounding.
    #[test]
    fn neighbours_meet_without_a_gap() {
        let p = [[0.0, 0.0, 0.0], [1.0, 0.1, 0.0], [0.2, 0.9, 0.1], [0.9, 0.8, -0.2]].map(Vector3::from);
        let n = [[0.1, 0.0, 1.0], [-0.2, 0.1, 1.0], [0.0, 0.3, 1.0], [0.1, 0.1, 1.0]]
            .map(|n| Vector3::from(n).normalize());
        let of = |at: [usize; 3]| {
            CurvedTriangle::new(at.map(|i| p[i]), at.map(|i| n[i]), [false; 6], EdgeRule::Arc)
        };
        let (one, other) = (of([0, 1, 2]), of([3, 2, 1]));
        for s in [0.1, 0.5, 0.7] {
            assert!((one.point([0.0, 1.0 - s, s]) - other.point([0.0, s, 1.0 - s])).norm() < 1e-15);
        }
    }
}
