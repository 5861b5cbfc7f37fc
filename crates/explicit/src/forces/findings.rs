//! Findings of a force evaluation besides the forces: energies, broken cells, deformation of the cells.

use serde::{Deserialize, Serialize};

use crate::lanes::LaneNumber;
use crate::lanes::{PACK, Pack};

/// Findings of a pass over some packs of cells, lane by lane.
#[derive(Clone, Copy, Debug)]
pub struct Findings<R> {
    /// Energy held by hourglass patterns [J].
    pub(super) hourglass: Pack<R>,
    /// The first cell of the pass with det F ≤ 0 or not a number, and its det F.
    pub(super) inverted: Option<(usize, f64)>,
    /// A cell of the pass with a corner turned inside out.
    pub(super) folded: Option<usize>,
    /// The least det F.
    pub(super) least_volume_ratio: Pack<R>,
    /// The largest |C − I|².
    pub(super) largest_strain: Pack<R>,
}

impl<R: LaneNumber> Default for Findings<R> {
    fn default() -> Self {
        let least_volume_ratio = Pack([R::ONE; PACK]);
        Self {
            hourglass: Pack::ZERO,
            inverted: None,
            folded: None,
            least_volume_ratio,
            largest_strain: Pack::ZERO,
        }
    }
}

/// The extremes of deformation over some cells.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Deformed {
    /// The least det F.
    pub least_volume_ratio: f64,
    /// The largest |C − I|².
    pub largest_strain: f64,
}

impl Default for Deformed {
    fn default() -> Self {
        Self { least_volume_ratio: 1.0, largest_strain: 0.0 }
    }
}

impl Deformed {
    pub(super) fn merge(self, other: Self) -> Self {
        Self {
            least_volume_ratio: self.least_volume_ratio.min(other.least_volume_ratio),
            largest_strain: self.largest_strain.max(other.largest_strain),
        }
    }

    /// True if the least J or the largest stretch, taken as √(1 + |C − I|), differ by more than a factor.
    pub fn differs(&self, other: &Self, factor: f64) -> bool {
        self.change(other) > factor
    }

    /// The factor, 1 or more, by which one of these two differs.
    pub fn change(&self, other: &Self) -> f64 {
        let stretch = |d: &Self| (1.0 + d.largest_strain.sqrt()).sqrt();
        let apart = |a: f64, b: f64| (a / b).max(b / a);
        apart(self.least_volume_ratio, other.least_volume_ratio).max(apart(stretch(self), stretch(other)))
    }
}

/// Findings of an evaluation of all cells.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Found {
    /// Energy held by hourglass patterns [J].
    pub hourglass: f64,
    /// The first inverted cell as (solid, cell, det F).
    pub inverted: Option<(usize, usize, f64)>,
    /// The first hexahedron of which a corner is turned inside out, as (solid, cell).
    pub folded: Option<(usize, usize)>,
    /// Deformation of the cells.
    pub(crate) deformed: Deformed,
}
