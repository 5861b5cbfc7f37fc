//! The proxy: the place of the tool at the surface while the device is in the tissue. The coupling's force is
//! κ (p − x) = f. The unloaded place is u = p + W f = x + D f with D = 1/κ + W. The planes of a
//! [local model](crate::model) ask
//!
//! ```text
//! 0 ≤ λᵢ ⊥ nᵢ·(u − a) + gᵢ ≥ 0,   |tᵢ| ≤ μᵢ λᵢ against the slip of u,   f = Σ λᵢ nᵢ + tᵢ
//! ```
//!
//! which minimises κ|p − x|² + fᵀ W f without friction. A point that sticks keeps its unloaded place.
//! Projected Gauss–Seidel finds λ and t, starting from the values of the last tick. Sources: Zilles and
//! Salisbury (1995), "A constraint-based god-object method"; Ruspini et al. (1997) for the coupling; Duriez
//! et al. (2006) for compliance and friction.

use nalgebra::{Matrix3, Vector3};

use crate::model::{LocalModel, MOST_PLANES};

/// Largest number of passes over all planes.
const PASSES: usize = 50;
/// Change [N] of the force in a pass at which it is found.
const FOUND: f64 = 1e-9;
/// Slip [m] below which friction changes nothing. A slip that decays tick by tick would lose its digits, and
/// its square become 0.
const STILL: f64 = 1e-15;

/// The state of a proxy on the planes of a model.
#[derive(Clone, Debug)]
pub(crate) struct Proxy {
    push: [f64; MOST_PLANES],
    drag: [Vector3<f64>; MOST_PLANES],
    /// The unloaded place [m] after the last tick, from which slip counts.
    stuck: Vector3<f64>,
}

impl Proxy {
    /// On a model whose slip counts from an unloaded place [m].
    pub fn new(stuck: Vector3<f64>) -> Self {
        Self { push: [0.0; MOST_PLANES], drag: [Vector3::zeros(); MOST_PLANES], stuck }
    }

    /// Returns the force [N] on the tool, which the coupling pulls to a place [m] with a stiffness [N/m]. The
    /// slip continues from the last call.
    pub fn force(&mut self, model: &LocalModel, pulled_to: Vector3<f64>, stiffness: f64) -> Vector3<f64> {
        let planes = model.planes();
        let mobility = Matrix3::identity() / stiffness + model.compliance();
        let from = pulled_to - model.unloaded();
        let mut force: Vector3<f64> =
            (0..planes.len()).map(|i| planes[i].normal * self.push[i] + self.drag[i]).sum();
        for _ in 0..PASSES {
            let before = force;
            for (i, plane) in planes.iter().enumerate() {
                let normal = plane.normal;
                let gap = normal.dot(&(from + mobility * force)) + plane.gap;
                let push = (self.push[i] - gap / normal.dot(&(mobility * normal))).max(0.0);
                force += normal * (push - self.push[i]);
                self.push[i] = push;
                if plane.friction == 0.0 {
                    continue;
                }
                let slip = pulled_to + mobility * force - self.stuck;
                let slip = slip - normal * normal.dot(&slip);
                let square = slip.norm_squared();
                let wanted = match square > STILL * STILL {
                    true => self.drag[i] - slip * (square / slip.dot(&(mobility * slip))),
                    false => self.drag[i],
                };
                let (size, limit) = (wanted.norm(), plane.friction * push);
                let drag = if size > limit { wanted * (limit / size) } else { wanted };
                force += drag - self.drag[i];
                self.drag[i] = drag;
            }
            if (force - before).norm() < FOUND {
                break;
            }
        }
        self.stuck = pulled_to + mobility * force;
        force
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Plane;
    use pliant_testing::Random;

    const K: f64 = 1000.0;

    fn model(compliance: Matrix3<f64>, planes: &[Plane]) -> LocalModel {
        LocalModel::new(Vector3::zeros(), Vector3::zeros(), compliance, planes, 0.01).unwrap()
    }

    #[test]
    fn a_compliant_wall_is_two_springs_in_series() {
        let wall =
            model(Matrix3::identity() / 250.0, &[Plane { normal: Vector3::z(), gap: 0.0, friction: 0.0 }]);
        let mut proxy = Proxy::new(Vector3::zeros());
        let force = proxy.force(&wall, Vector3::new(0.01, 0.0, -0.003), K);
        assert!((force - Vector3::z() * 0.003 * 200.0).norm() < 1e-12, "{force}");
        assert_eq!(proxy.force(&wall, Vector3::new(0.0, 0.0, 0.003), K), Vector3::zeros());
    }

    /// Within the cone the point sticks as on a spring; beyond, it drags with μ times the pressure, against
    /// the slip.
    #[test]
    fn forces_stay_in_the_cone_of_friction() {
        let (friction, wall) = (0.4, Matrix3::identity() / 500.0);
        let wall = model(wall, &[Plane { normal: Vector3::z(), gap: 0.0, friction }]);
        let mut proxy = Proxy::new(Vector3::zeros());
        proxy.force(&wall, Vector3::new(0.0, 0.0, -0.003), K);
        let series = 1.0 / (1.0 / K + 1.0 / 500.0);
        let stick = proxy.force(&wall, Vector3::new(0.001, 0.0, -0.003), K);
        assert!((stick - Vector3::new(-0.001, 0.0, 0.003) * series).norm() < 1e-9, "{stick}");
        for step in 2..100 {
            proxy.force(&wall, Vector3::new(0.001 * f64::from(step), 0.0, -0.003), K);
        }
        let slide = proxy.force(&wall, Vector3::new(0.1, 0.0, -0.003), K);
        assert!((slide - Vector3::new(-friction, 0.0, 1.0) * 0.003 * series).norm() < 1e-9, "{slide}");
        // Back by less than it takes to let go.
        let back = proxy.force(&wall, Vector3::new(0.0995, 0.0, -0.003), K);
        assert!((back - slide - Vector3::x() * 0.0005 * series).norm() < 1e-9, "{back}");
    }

    /// A tool that leaves a wall slips by less and less, down to numbers whose squares are 0.
    #[test]
    fn a_slip_that_dies_away_gives_finite_forces() {
        let wall = Matrix3::identity() / 500.0;
        let wall = model(wall, &[Plane { normal: Vector3::z(), gap: 0.0, friction: 0.4 }]);
        for power in 1..320 {
            let mut proxy = Proxy::new(Vector3::new(10.0_f64.powi(-power), 0.0, 0.0));
            let force = proxy.force(&wall, Vector3::new(0.0, 0.0, -0.003), K);
            assert!(force.iter().all(|x| x.is_finite()) && force.z > 0.9, "1e-{power} m: {force}");
        }
    }

    /// Conditions of the solution, not the way to it, on wedges at random.
    #[test]
    fn complementarity_holds_on_many_planes() {
        let mut random = Random::new(7);
        let mut loaded = 0;
        for _ in 0..300 {
            let half = Matrix3::from_fn(|_, _| random.number()) * 0.03;
            let compliance = half * half.transpose();
            let planes: Vec<Plane> = (0..1 + random.below(5))
                .map(|_| {
                    let normal = Vector3::new(random.number(), random.number(), 1.0 + random.part());
                    Plane { normal: normal.normalize(), gap: 2e-3 * random.number(), friction: 0.0 }
                })
                .collect();
            let model = model(compliance, &planes);
            let to = Vector3::from(random.vector()) * 0.01;
            let mut proxy = Proxy::new(to);
            let mut force = Vector3::zeros();
            for _ in 0..40 {
                force = proxy.force(&model, to, K);
            }
            let unloaded = to + force / K + compliance * force;
            let push: Vector3<f64> = (0..planes.len()).map(|i| planes[i].normal * proxy.push[i]).sum();
            assert!((push - force).norm() < 1e-9);
            for (plane, &push) in planes.iter().zip(&proxy.push) {
                let gap = plane.normal.dot(&unloaded) + plane.gap;
                assert!(push >= 0.0 && gap > -1e-8 && push * gap < 1e-8, "{push} N at {gap} m");
            }
            loaded += u32::from(force.norm() > 0.1);
        }
        assert!(loaded > 50, "{loaded}");
    }
}
