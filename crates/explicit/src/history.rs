//! History of relaxing laws.

use pliant_mechanics::model::Solid;
use pliant_mechanics::tensor::Symmetric;
use serde::{Deserialize, Serialize};

use crate::lanes::LaneNumber;
use crate::lanes::{PACK, Pack};

/// History of the relaxing law of a solid.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct History<R> {
    /// [`History::slots`] tensors of six packs for each pack of cells.
    pub cells: Vec<Pack<R>>,
    /// Φⁿ⁻¹ and one h per volumetric term for each pack of averaged pressures; empty if pressures are not
    /// averaged.
    pub pressures: Vec<Pack<R>>,
}

impl<R: LaneNumber> History<R> {
    /// Makes the history at rest.
    pub(crate) fn at_rest(solid: &Solid) -> Self {
        let packs = |count: usize, slots: usize| vec![Pack::ZERO; count.div_ceil(PACK) * slots];
        Self {
            cells: packs(solid.cells.len(), 6 * Self::slots(solid)),
            pressures: packs(solid.cells.averaged_pressures(), solid.material.prony.volumetric_slots()),
        }
    }

    /// The tensors of a point of a cell.
    pub(crate) fn of_point(
        &self,
        solid: &Solid,
        cell: usize,
        point: usize,
    ) -> impl Iterator<Item = Symmetric<f64>> + '_ {
        let slots = Self::slots(solid);
        let per_point = slots / solid.cells.points();
        let packs = cell / PACK * slots + point * per_point..cell / PACK * slots + (point + 1) * per_point;
        let tensors = self.cells[6 * packs.start..6 * packs.end].chunks_exact(6);
        tensors.map(move |packs| Symmetric(std::array::from_fn(|k| packs[k].0[cell % PACK].to_f64())))
    }

    /// Sets the tensors of a cell.
    pub fn set_cell(&mut self, cell: usize, tensors: &[Symmetric<f64>]) {
        for (slot, tensor) in tensors.iter().enumerate() {
            for (k, &entry) in tensor.0.iter().enumerate() {
                self.cells[(cell / PACK * tensors.len() + slot) * 6 + k].0[cell % PACK] = R::of(entry);
            }
        }
    }

    /// Returns the history [Pa] of an averaged pressure.
    pub(crate) fn of_pressure(&self, solid: &Solid, index: usize) -> Vec<f64> {
        let slots = solid.material.prony.volumetric_slots();
        (0..slots).map(|slot| self.pressures[index / PACK * slots + slot].0[index % PACK].to_f64()).collect()
    }

    /// Tensors of history per cell.
    pub fn slots(solid: &Solid) -> usize {
        solid.cells.points() * solid.material.prony.point_slots(solid.cells.averages_pressure())
    }
}
