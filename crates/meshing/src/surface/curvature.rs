//! Curvature of a surface at its points (Rusinkiewicz 2004). The points' normals change linearly over each
//! triangle. This change is rotated into the points' tangent planes and averaged by area. Positive where the
//! surface is convex seen from outside: 1/R on a ball. Leaves out: points at borders, whose normals are
//! one-sided.

use nalgebra::{Matrix3, Rotation3};
use pliant_geometry::Vector3;
use rayon::prelude::*;
use serde::Serialize;

use crate::report::percentiles::Percentiles;
use crate::surface::triangles::TriangleMesh;

/// Curvature over the area of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Curvature {
    /// Mean curvature (κ₁ + κ₂)/2 [1/m].
    pub mean: Percentiles,
    /// Gaussian curvature κ₁ κ₂ [1/m²].
    pub gaussian: Percentiles,
    /// The larger principal curvature κ₁ [1/m].
    pub larger: Percentiles,
    /// The smaller principal curvature κ₂ [1/m].
    pub smaller: Percentiles,
    /// The point of the largest |κ| [m].
    pub sharpest: [f64; 3],
}

impl TriangleMesh {
    /// Curvature at all points except border points; `None` if no others exist.
    pub fn curvature(&self) -> Option<Curvature> {
        let normals: Vec<Vector3> =
            (0..self.points.len() as u32).into_par_iter().map(|p| self.round_normal(p)).collect();
        let triangles: Vec<u32> = self.alive().collect();
        let found: Vec<(u32, Matrix3<f64>)> =
            triangles.par_iter().filter_map(|&t| Some((t, self.change_of_normals(t, &normals)?))).collect();
        let mut tensors = vec![(Matrix3::zeros(), 0.0); self.points.len()];
        for (t, tensor) in found {
            let (normal, weight) = (self.normal(t), self.area(t) / 3.0);
            for node in self.triangles[t as usize] {
                // Opposite normals have no shortest rotation: the surface is not smooth at this point.
                let Some(turn) = Rotation3::rotation_between(&normal, &normals[node as usize]) else {
                    continue;
                };
                let (sum, area) = &mut tensors[node as usize];
                *sum += weight * (turn * tensor * turn.inverse());
                *area += weight;
            }
        }
        let inner = |p: &u32| self.neighbours(*p).iter().all(|&n| !self.is_border(*p, n));
        let points: Vec<(u32, f64, [f64; 2])> = (0..self.points.len() as u32)
            .into_par_iter()
            .filter(|p| tensors[*p as usize].1 > 0.0 && inner(p))
            .map(|p| {
                let (sum, area) = tensors[p as usize];
                (p, area, principal(&(sum / area), &normals[p as usize]))
            })
            .collect();
        let over_area = |of: &dyn Fn([f64; 2]) -> f64| {
            Percentiles::weighted(points.iter().map(|&(_, area, k)| (of(k), area)).collect())
        };
        let sharp = |k: [f64; 2]| k[0].abs().max(k[1].abs());
        let sharpest = points.iter().max_by(|a, b| sharp(a.2).total_cmp(&sharp(b.2)))?;
        Some(Curvature {
            mean: over_area(&|k| (k[0] + k[1]) / 2.0)?,
            gaussian: over_area(&|k| k[0] * k[1])?,
            larger: over_area(&|k| k[0])?,
            smaller: over_area(&|k| k[1])?,
            sharpest: self.points[sharpest.0 as usize].into(),
        })
    }

    /// The normal at a point, exact if the point and its neighbours lie on a ball (Max 1999).
    fn round_normal(&self, point: u32) -> Vector3 {
        let of = |&t: &u32| {
            let at = self.triangles[t as usize].iter().position(|&n| n == point).unwrap_or(0);
            let x = self.corners(t);
            let (u, v) = (x[(at + 1) % 3] - x[at], x[(at + 2) % 3] - x[at]);
            u.cross(&v) / (u.norm_squared() * v.norm_squared())
        };
        let sum: Vector3 = self.star[point as usize].iter().map(of).sum();
        sum.try_normalize(0.0).filter(|n| n.iter().all(|x| x.is_finite())).unwrap_or_default()
    }

    /// The linear map in the plane of a triangle from its edges to the changes of normals along them. It is a
    /// least-squares fit, made symmetric [1/m].
    fn change_of_normals(&self, triangle: u32, normals: &[Vector3]) -> Option<Matrix3<f64>> {
        let nodes = self.triangles[triangle as usize];
        let x = self.corners(triangle);
        let t = (x[1] - x[0]).try_normalize(0.0)?;
        let b = self.normal(triangle).cross(&t);
        // Unknowns e, f, g of [e f; f g]. Each edge (u, v) has two equations: e u + f v = Δn·t and f u + g
        // v = Δn·b.
        let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for k in 0..3 {
            let (from, to) = ((k + 1) % 3, (k + 2) % 3);
            let (edge, change) =
                (x[to] - x[from], normals[nodes[to] as usize] - normals[nodes[from] as usize]);
            let (u, v) = (edge.dot(&t), edge.dot(&b));
            for (row, value) in
                [(Vector3::new(u, v, 0.0), change.dot(&t)), (Vector3::new(0.0, u, v), change.dot(&b))]
            {
                matrix += row * row.transpose();
                right += row * value;
            }
        }
        let [e, f, g] = matrix.try_inverse().map(|inverse| <[f64; 3]>::from(inverse * right))?;
        let tensor =
            e * t * t.transpose() + f * (t * b.transpose() + b * t.transpose()) + g * b * b.transpose();
        tensor.iter().all(|x| x.is_finite()).then_some(tensor)
    }
}

/// Eigenvalues in the plane across a normal, the larger first.
fn principal(tensor: &Matrix3<f64>, normal: &Vector3) -> [f64; 2] {
    let mut axis = Vector3::zeros();
    axis[normal.iamin()] = 1.0;
    let u = normal.cross(&axis).normalize();
    let v = normal.cross(&u);
    let (e, f, g) = (u.dot(&(tensor * u)), u.dot(&(tensor * v)), v.dot(&(tensor * v)));
    let (middle, half) = ((e + g) / 2.0, ((e - g) / 2.0).hypot(f));
    [middle + half, middle - half]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DEFAULT_CELL_LIMIT, Pattern, Sheet, sphere};

    fn curvature(mesh: &pliant_geometry::Mesh) -> Curvature {
        TriangleMesh::from_mesh(mesh).unwrap().0.curvature().unwrap()
    }

    /// κ = 1/R both ways and everywhere: normals and changes of normals are exact on a ball.
    #[test]
    fn a_ball_has_the_curvature_of_its_radius() {
        let found = curvature(&sphere(0.05, 4, DEFAULT_CELL_LIMIT).unwrap());
        for (percentiles, expected) in
            [(found.mean, 20.0), (found.larger, 20.0), (found.smaller, 20.0), (found.gaussian, 400.0)]
        {
            for value in [percentiles.least, percentiles.median, percentiles.most] {
                assert!((value / expected - 1.0).abs() < 1e-9, "{found:?}");
            }
        }
    }

    /// κ₁ = 1/R round it, 0 along it.
    #[test]
    fn a_cylinder_is_curved_one_way() {
        let cylinder = Sheet::Cylinder { radius: 0.02, length: 0.1, from: 0.0, span: std::f64::consts::TAU };
        let found = curvature(&cylinder.mesh([64, 50], Pattern::UnionJack, None, 100_000).unwrap());
        assert!((found.larger.median / 50.0 - 1.0).abs() < 0.01, "{found:?}");
        assert!(found.smaller.median.abs() < 0.1 && found.gaussian.median.abs() < 10.0, "{found:?}");
        assert!((found.mean.median / 25.0 - 1.0).abs() < 0.01, "{found:?}");
    }

    #[test]
    fn a_plate_has_none_and_its_border_is_left_out() {
        let plate = Sheet::Plate { size: [0.1, 0.1] };
        let mesh = plate.mesh([8, 8], Pattern::Diagonal, None, 1000).unwrap();
        let found = curvature(&mesh);
        assert!(found.larger.most.abs() < 1e-9 && found.smaller.least.abs() < 1e-9, "{found:?}");
        let one = plate.mesh([1, 1], Pattern::Diagonal, None, 1000).unwrap();
        assert!(TriangleMesh::from_mesh(&one).unwrap().0.curvature().is_none());
    }
}
