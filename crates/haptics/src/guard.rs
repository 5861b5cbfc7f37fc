//! The passivity guard. It adds up the work that the device does against the force, held constant over a
//! tick:
//!
//! ```text
//! E(n) = E(n−1) − F(n−1)·(x(n) − x(n−1))
//! ```
//!
//! which is exact at the ticks. A negative E means that the device has got more energy than it gave. The
//! guard then adds a damping that takes this energy back within a tick, up to a limit. Its force changes
//! gently, so that it is not felt as a click. Source: Hannaford and Ryu (2002), "Time-domain passivity
//! control of haptic interfaces". The exact sum is by Ryu, Kim and Hannaford (2004). Friction would fill the
//! sum without end, and hide later trouble. So the sum for the guard is held below a reserve. The reported
//! sum is not.

use nalgebra::Vector3;

use crate::error::HapticsError;

/// Limits of a guard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guard {
    /// Most damping [N s/m] that it adds; below m/T of a device of mass m.
    pub most_damping: f64,
    /// Largest change of its force [N] from a tick to the next.
    pub most_jump: f64,
    /// Largest energy [J] that the guard remembers. It should exceed the energy that the tissue stores and
    /// gives back, F²/2k.
    pub reserve: f64,
}

impl Default for Guard {
    /// 20 N s/m, by 0.1 N a tick; 0.1 J, as 3.3 N store in a tissue of 54 N/m.
    fn default() -> Self {
        Self { most_damping: 20.0, most_jump: 0.1, reserve: 0.1 }
    }
}

impl Guard {
    pub(crate) fn check(&self) -> Result<(), HapticsError> {
        let Self { most_damping, most_jump, reserve } = *self;
        for (what, value) in [
            ("the largest damping of the guard [N s/m]", most_damping),
            ("the largest jump of the guard [N]", most_jump),
            ("the reserve of the guard [J]", reserve),
        ] {
            HapticsError::check(what, value, value >= 0.0, "give at least 0")?;
        }
        Ok(())
    }
}

/// Energy that the device has put in.
#[derive(Clone, Copy, Debug, Default)]
pub struct Observer {
    /// Total energy [J].
    pub energy: f64,
    /// Least total energy so far [J].
    pub least: f64,
    /// Energy [J] for the guard, held below the reserve.
    left: f64,
    /// Force [N] of the guard's damping in the last tick.
    damping: Vector3<f64>,
}

impl Observer {
    /// Adds the work of a tick in which the device went a way [m] against a force [N].
    pub fn add(&mut self, force: &Vector3<f64>, way: &Vector3<f64>, reserve: f64) {
        let work = -force.dot(way);
        self.energy += work;
        self.least = self.least.min(self.energy);
        self.left = (self.left + work).min(reserve);
    }

    /// Returns the force [N] by which a guard damps a device, which moved by a way [m] in the last tick of a
    /// period [s]. The force goes to zero unless energy is missing.
    pub fn damp(&mut self, guard: &Guard, way: &Vector3<f64>, period: f64) -> Vector3<f64> {
        let square = way.norm_squared();
        // α v² T = −E with v = way / T.
        let damping = match square > 0.0 {
            true => (-self.left * period / square).clamp(0.0, guard.most_damping),
            false => 0.0,
        };
        let change = way * (-damping / period) - self.damping;
        let size = change.norm();
        self.damping += if size > guard.most_jump { change * (guard.most_jump / size) } else { change };
        self.damping
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_energy_is_taken_back_in_a_tick_up_to_the_limit() {
        let guard = Guard { most_damping: 20.0, most_jump: 10.0, reserve: 0.1 };
        let (way, period) = (Vector3::x() * 1e-4, 1e-3);
        let mut observer = Observer::default();
        assert_eq!(observer.damp(&guard, &way, period), Vector3::zeros());
        observer.add(&Vector3::x(), &way, guard.reserve);
        assert_eq!(observer.energy, -1e-4);
        // 1e-4 J over 1e-4 m would be 1 N, as of 10 N s/m.
        let force = observer.damp(&guard, &way, period);
        assert!((force + Vector3::x()).norm() < 1e-12, "{force}");
        observer.add(&force, &way, guard.reserve);
        assert!(observer.energy.abs() < 1e-15);
        observer.add(&Vector3::x(), &(0.1 * Vector3::x()), guard.reserve);
        assert!((observer.damp(&guard, &way, period) + Vector3::x() * 2.0).norm() < 1e-12);
        // A long drag leaves no more than the reserve.
        observer.add(&Vector3::x(), &(-10.0 * Vector3::x()), guard.reserve);
        assert!((observer.left - 0.1).abs() < 1e-15 && observer.energy > 9.0 && observer.least < -0.09);
        assert_eq!(observer.damp(&guard, &way, period), Vector3::zeros());
    }

    #[test]
    fn the_damping_sets_in_and_off_gently() {
        let guard = Guard { most_damping: 20.0, most_jump: 0.1, reserve: 0.1 };
        let (way, period) = (Vector3::x() * 1e-4, 1e-3);
        let mut observer = Observer::default();
        observer.add(&Vector3::x(), &(1e3 * way), guard.reserve);
        let mut force: Vec<f64> = (0..30).map(|_| observer.damp(&guard, &way, period).x).collect();
        assert!((force[29] + 2.0).abs() < 1e-12, "20 N s/m at 0.1 m/s");
        observer.add(&-Vector3::x(), &(2e3 * way), guard.reserve);
        force.extend((0..30).map(|_| observer.damp(&guard, &way, period).x));
        assert!(
            force[59].abs() < 1e-12 && force.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 0.1 + 1e-9)
        );
    }
}
