//! Scenes whose state lies on a GPU: their points are computed and drawn there. Energies, forces, the range
//! of colours, checks and fields other than displacements need ordinary memory. They are inspected now and
//! then.

use std::time::{Duration, Instant};

use pliant_geometry::Vector3;
use pliant_mechanics::Energies;
use pliant_picture::{Mark, PointForce};
use pliant_sim::gpu::PointValue;

use crate::followed::FollowedPoint;

/// Wall time between two inspections of a state that lies on a device.
pub(crate) const INSPECTION: Duration = Duration::from_millis(250);

/// Results of the last inspection.
#[derive(Debug, Default)]
pub(crate) struct Seen {
    /// Number of inspections so far.
    pub number: u64,
    /// Positions [m].
    pub points: Vec<Vector3>,
    /// Values of the field that is shown; empty for none.
    pub values: Vec<f64>,
    /// Cell with the smallest stable step, if the view asks for it.
    pub critical: Option<u32>,
    /// Energies [J].
    pub energies: Energies,
    /// The least gap [m] in contacts with barriers.
    pub least_gap: Option<f64>,
    /// Steps that were taken though they had not converged.
    pub unconverged: u64,
    /// Point [m] and force [N] of each hand that holds something, then of each pin.
    pub held: Vec<[[f64; 3]; 2]>,
    /// Index of each hand in [`Self::held`].
    pub hands: [Option<usize>; 2],
    /// Forces of contacts, if the view asks for them.
    pub contacts: Vec<PointForce>,
    /// Marks of constraints and loads, if the view asks for them.
    pub marks: Vec<Mark>,
    /// Points that the user follows.
    pub followed: Vec<FollowedPoint>,
    /// Wall time of the inspection; `None` if the next one is due at once.
    pub at: Option<Instant>,
}

impl Seen {
    /// True if the next inspection of a playing run is due.
    pub(crate) fn is_old(&self) -> bool {
        self.at.is_none_or(|at| at.elapsed() >= INSPECTION)
    }
}

/// A field, with its component, as the device finds it.
pub(crate) fn point_value(field: Option<&str>) -> PointValue {
    match field {
        None | Some("displacement") => PointValue::Size,
        Some("displacement:x") => PointValue::Component(0),
        Some("displacement:y") => PointValue::Component(1),
        Some("displacement:z") => PointValue::Component(2),
        Some(_) => PointValue::Given,
    }
}
