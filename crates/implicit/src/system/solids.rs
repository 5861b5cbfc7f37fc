//! Forces and stiffness of the cells of solids.

use super::{CHUNK, System};
use crate::model::error::SolveError;
use crate::model::state::State;
use rayon::prelude::*;
use std::sync::Arc;

impl System {
    pub(super) fn evaluate_solids(&mut self, state: &State, moved: Option<&[f64]>) -> Result<(), SolveError> {
        let model = Arc::clone(&self.model);
        let displacement = |node: u32| model.displacement(&state.position, node);
        let mut results = std::mem::take(&mut self.solid_results);
        let mut all_stars = std::mem::take(&mut self.stars);
        let relaxation = std::mem::take(&mut self.relaxation);
        self.energy += relaxation.work(&state.history);
        let mut first_cell = model.facets.len();
        let mut broken = None;
        for (index, (solid, stars)) in model.solids.iter().zip(&mut all_stars).enumerate() {
            let count = solid.cells.len();
            if let Some(stars) = stars {
                self.energy += stars.find(solid, displacement);
            }
            for first in (0..count).step_by(CHUNK) {
                let last = (first + CHUNK).min(count);
                results[..last - first].par_iter_mut().with_min_len(16).enumerate().for_each(
                    |(at, result)| {
                        let pressure = stars.as_ref().map(|stars| stars.pressure(first + at));
                        let lag = relaxation.of_cell(index, solid, first + at);
                        result.fill(solid, first + at, pressure, lag, displacement, moved.is_some());
                    },
                );
                broken = (first..last).zip(&results).find_map(|(cell, result)| Some((cell, result.broken?)));
                if broken.is_some() {
                    break;
                }
                for (cell, result) in (first..last).zip(&results) {
                    self.energy += result.energy;
                    self.hourglass += result.hourglass;
                    self.add_forces(solid.cells.nodes(cell), &result.force);
                    if let Some(moved) = moved {
                        self.add_stiffness(solid.cells.nodes(cell), [index, 0, cell], &result.tangent, moved);
                    }
                }
            }
            if let (Some(stars), Some(moved), None) = (stars, moved, broken) {
                for (star, nodes) in stars.nodes.iter().enumerate() {
                    let tangent = &mut results[0].tangent;
                    stars.stiffness(star, solid, displacement, tangent);
                    self.add_stiffness(nodes, [index, 1, star], tangent, moved);
                }
            }
            if broken.is_some() {
                break;
            }
            first_cell += count;
        }
        (self.solid_results, self.stars, self.relaxation) = (results, all_stars, relaxation);
        broken.map_or(Ok(()), |(cell, why)| Err(SolveError::Broken { cell: first_cell + cell, why }))
    }
}
