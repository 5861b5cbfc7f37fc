//! The contact around a tool, as the simulation last found it: tangent planes and a compliance. A tool at p
//! that feels the force f has the unloaded place u = p + W f. It would be there if the tissue had not given
//! way. With the simulation's unloaded place a = p₀ + W f₀, plane i asks
//!
//! ```text
//! nᵢ·(u − a) + gᵢ ≥ 0
//! ```
//!
//! so that the model gives the simulation's own force f₀ at its own place p₀, whatever W. W only sets the
//! change of the force around this place. Sources of the local models: Adachi, Kumano and Ogino (1995),
//! "Intermediate representation for stiff virtual objects"; Mark et al. (1996), "Adding force feedback to
//! graphics systems". The compliance is by Duriez, Dubois, Kheddar and Andriot (2006). Leaves out: moments,
//! curvature of the tool, inertia and viscosity of the tissue between two models.
//!
//! ```
//! use nalgebra::{Matrix3, Vector3};
//! use pliant_haptics::model::LocalModel;
//!
//! // The simulation pushes its tool with 1 N, some of it across the surface.
//! let force = Vector3::new(0.2, 0.0, 1.0);
//! let model = LocalModel::touching(Vector3::zeros(), force, Matrix3::identity() / 300.0, 0.3, &[], 0.002)?;
//! assert_eq!(model.planes().len(), 1);
//! # Ok::<(), pliant_haptics::error::HapticsError>(())
//! ```

use nalgebra::{Matrix3, Vector3};

use crate::error::HapticsError;

/// Largest number of planes of a model.
pub const MOST_PLANES: usize = 16;
/// Least force [N] with a direction: the square of a smaller one loses digits.
const LEAST_FORCE: f64 = 1e-100;
/// Longest time [s] between two models.
const LONGEST_PERIOD: f64 = 1.0;

/// A tangent plane that the tool does not pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// The direction, of length 1, in which it pushes the tool.
    pub normal: Vector3<f64>,
    /// Distance [m] of the tool at the model's place: 0 where it touches, positive where it is free.
    pub gap: f64,
    /// Coulomb's coefficient μ.
    pub friction: f64,
}

impl Plane {
    const NONE: Self = Self { normal: Vector3::new(0.0, 0.0, 1.0), gap: 0.0, friction: 0.0 };
}

/// The contact around a place of the tool.
#[derive(Clone, Debug, PartialEq)]
pub struct LocalModel {
    planes: [Plane; MOST_PLANES],
    count: usize,
    compliance: Matrix3<f64>,
    place: Vector3<f64>,
    force: Vector3<f64>,
    period: f64,
}

impl LocalModel {
    /// Nothing around a place [m]. `period` [s]: time from the last model to this one.
    ///
    /// # Errors
    /// If a number is not finite, or the period is not in (0, 1] s.
    pub fn free(place: Vector3<f64>, period: f64) -> Result<Self, HapticsError> {
        Self::new(place, Vector3::zeros(), Matrix3::zeros(), &[], period)
    }

    /// Makes a model of planes around a place [m] at which the simulation pushes the tool with a force [N].
    /// `compliance` [m/N], 3 × 3: change of the tool's place with the force. `period` [s]: time from the last
    /// model to this one, over which the force changes to the new one.
    ///
    /// The force should be one that the planes can give; [`touching`](Self::touching) sees to that.
    ///
    /// # Errors
    /// With more than 16 planes, numbers that are not finite, or normals of another length than 1. With
    /// negative friction, a compliance that is not symmetric or has negative eigenvalues, or a period outside
    /// of (0, 1] s.
    pub fn new(
        place: Vector3<f64>,
        force: Vector3<f64>,
        compliance: Matrix3<f64>,
        planes: &[Plane],
        period: f64,
    ) -> Result<Self, HapticsError> {
        if planes.len() > MOST_PLANES {
            return Err(HapticsError::TooManyPlanes { count: planes.len(), most: MOST_PLANES });
        }
        let finite = "give finite numbers: check the state of the simulation";
        for number in place.iter() {
            HapticsError::check("a coordinate of a local model [m]", *number, true, finite)?;
        }
        for number in force.iter() {
            HapticsError::check("a force of a local model [N]", *number, true, finite)?;
        }
        for number in compliance.iter() {
            HapticsError::check("a compliance of a local model [m/N]", *number, true, finite)?;
        }
        for plane in planes {
            let length = plane.normal.norm();
            let unit = (length - 1.0).abs() < 1e-6;
            HapticsError::check("the length of a plane's normal", length, unit, "scale it to 1")?;
            HapticsError::check("the gap of a plane [m]", plane.gap, true, finite)?;
            let friction = plane.friction;
            HapticsError::check("the friction of a plane", friction, friction >= 0.0, "give at least 0")?;
        }
        let fits = period > 0.0 && period <= LONGEST_PERIOD;
        HapticsError::check(
            "the period of a local model [s]",
            period,
            fits,
            "give more than 0 s and at most 1 s",
        )?;
        let scale = compliance.amax();
        let least = compliance.symmetric_eigenvalues().min();
        let skew = (compliance - compliance.transpose()).amax();
        if skew > 1e-9 * scale || least < -1e-9 * scale {
            return Err(HapticsError::Compliance { least });
        }
        let mut padded = [Plane::NONE; MOST_PLANES];
        padded[..planes.len()].copy_from_slice(planes);
        Ok(Self { planes: padded, count: planes.len(), compliance, place, force, period })
    }

    /// Makes a model that gives exactly this force [N] at this place [m]. Its first plane touches, and the
    /// cone of friction around the plane's normal contains the force. The normal is the mean normal of the
    /// planes of `around` that touch, turned towards the force as far as needed. If none touches, the normal
    /// is along the force. The nearest planes of `around` follow, with gaps of at least 0.
    ///
    /// # Errors
    /// As for [`new`](Self::new).
    pub fn touching(
        place: Vector3<f64>,
        force: Vector3<f64>,
        compliance: Matrix3<f64>,
        friction: f64,
        around: &[Plane],
        period: f64,
    ) -> Result<Self, HapticsError> {
        let mut planes: Vec<Plane> =
            around.iter().map(|plane| Plane { gap: plane.gap.max(0.0), ..*plane }).collect();
        planes.sort_by(|a, b| a.gap.total_cmp(&b.gap));
        if let Some(direction) = force.try_normalize(LEAST_FORCE) {
            planes.truncate(MOST_PLANES - 1);
            // Planes that touch push together.
            let touching = planes.iter().take_while(|plane| plane.gap <= 0.0);
            let mean: Vector3<f64> = touching.map(|plane| plane.normal).sum();
            let known = mean.try_normalize(1e-9).unwrap_or(direction);
            let normal = towards(known, direction, friction);
            planes.insert(0, Plane { normal, gap: 0.0, friction });
        }
        planes.truncate(MOST_PLANES);
        Self::new(place, force, compliance, &planes, period)
    }

    /// Its planes.
    pub fn planes(&self) -> &[Plane] {
        &self.planes[..self.count]
    }

    /// Compliance W [m/N] of the tissue at the tool.
    pub fn compliance(&self) -> &Matrix3<f64> {
        &self.compliance
    }

    /// The place [m] of the simulated tool.
    pub fn place(&self) -> Vector3<f64> {
        self.place
    }

    /// The force [N] on the simulated tool.
    pub fn force(&self) -> Vector3<f64> {
        self.force
    }

    /// Time [s] from the last model to this one.
    pub fn period(&self) -> f64 {
        self.period
    }

    /// The place [m] where the simulated tool would be without load.
    pub fn unloaded(&self) -> Vector3<f64> {
        self.place + self.compliance * self.force
    }
}

/// A normal, turned towards a direction until this one is within 0.9 of its cone of friction.
fn towards(normal: Vector3<f64>, direction: Vector3<f64>, friction: f64) -> Vector3<f64> {
    let within = (0.9 * friction).atan();
    let angle = normal.angle(&direction);
    let axis = normal.cross(&direction);
    if angle <= within || axis.norm() < 1e-12 {
        return if angle <= within { normal } else { direction };
    }
    let turn = nalgebra::UnitQuaternion::new(axis.normalize() * (angle - within));
    (turn * normal).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn broken_numbers_are_refused_with_a_remedy() {
        let (zero, one) = (Vector3::zeros(), Matrix3::identity());
        let plane = |normal, gap, friction| Plane { normal, gap, friction };
        let made = |planes: &[Plane]| LocalModel::new(zero, zero, one, planes, 0.01);
        assert!(made(&[plane(Vector3::z(), 0.0, 0.3); 16]).is_ok());
        for planes in [
            vec![plane(Vector3::z(), 0.0, 0.0); 17],
            vec![plane(2.0 * Vector3::z(), 0.0, 0.0)],
            vec![plane(Vector3::z(), f64::NAN, 0.0)],
            vec![plane(Vector3::z(), 0.0, -0.1)],
        ] {
            assert!(made(&planes).unwrap_err().to_string().contains("; "));
        }
        assert!(LocalModel::new(zero, zero, -one, &[], 0.01).is_err());
        let skew = Matrix3::new(1.0, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        assert!(LocalModel::new(zero, zero, skew, &[], 0.01).is_err());
        for period in [0.0, 2.0, f64::NAN] {
            assert!(LocalModel::free(zero, period).is_err());
        }
        assert!(LocalModel::free(Vector3::new(f64::INFINITY, 0.0, 0.0), 0.01).is_err());
    }

    #[test]
    fn the_first_plane_can_give_the_force() {
        let around = [Plane { normal: Vector3::z(), gap: 0.0, friction: 0.0 }; 20];
        for (across, friction) in [(0.0, 0.0), (0.1, 0.3), (2.0, 0.3), (0.5, 0.0)] {
            let force = Vector3::new(across, 0.0, 1.0);
            let model =
                LocalModel::touching(Vector3::zeros(), force, Matrix3::identity(), friction, &around, 0.01)
                    .unwrap();
            assert_eq!(model.planes().len(), MOST_PLANES);
            let normal = model.planes()[0].normal;
            let push = normal.dot(&force);
            assert!((force - normal * push).norm() <= friction * push + 1e-7, "{across} {friction}");
        }
        for power in 1..320 {
            let force = Vector3::new(0.3, 0.2, 1.0) * 10.0_f64.powi(-power);
            LocalModel::touching(Vector3::zeros(), force, Matrix3::identity(), 0.3, &[], 0.01).unwrap();
        }
    }
}
