//! The virtual coupling between device and proxy, and how stiff it may be. A sampled wall of stiffness K and
//! damping B is passive if the device itself has the damping
//!
//! ```text
//! b > K T / 2 + |B|
//! ```
//!
//! (Colgate and Schenkel 1997, "Passivity of a class of sampled-data systems"). With a delay τ besides, about
//! K < 2 (b − |B|) / (T + 2 τ) (Diolaiti, Niemeyer, Barbagli and Salisbury 2006).
//!
//! ```
//! use pliant_haptics::coupling::Coupling;
//!
//! // 1 N s/m at 1 kHz, and at a simulation of 30 Hz that is a step late.
//! assert!((Coupling::limit(1.0, 0.0, 0.001, 0.0) - 2000.0).abs() < 1e-9);
//! assert!((Coupling::limit(1.0, 0.0, 0.033, 0.033) - 20.2).abs() < 0.1);
//! ```

use crate::error::HapticsError;

/// A spring and a damper between device and proxy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling {
    /// Stiffness K [N/m].
    pub stiffness: f64,
    /// Damping B [N s/m].
    pub damping: f64,
}

impl Default for Coupling {
    /// 1000 N/m and 0.2 N s/m: passive at 1 kHz on a device of 0.7 N s/m. With a force half a tick ahead, the
    /// device needs 1.2 N s/m.
    fn default() -> Self {
        Self { stiffness: 1000.0, damping: 0.2 }
    }
}

impl Coupling {
    /// Returns the largest passive stiffness [N/m] on a device of a damping b [N s/m]. The coupling has a
    /// damping B [N s/m], a tick a period T [s], and the force a delay τ [s]. The result is 0 if no stiffness
    /// is passive.
    pub fn limit(device: f64, damping: f64, period: f64, delay: f64) -> f64 {
        (2.0 * (device - damping.abs()) / (period + 2.0 * delay)).max(0.0)
    }

    /// Rejects stiffnesses and dampings out of range.
    pub(crate) fn check(&self) -> Result<(), HapticsError> {
        let Self { stiffness, damping } = *self;
        let remedy = "give a positive number, 1000 N/m by default";
        HapticsError::check("the stiffness of the coupling [N/m]", stiffness, stiffness > 0.0, remedy)?;
        let remedy = "give at least 0, 0.2 N s/m by default";
        HapticsError::check("the damping of the coupling [N s/m]", damping, damping >= 0.0, remedy)
    }
}
