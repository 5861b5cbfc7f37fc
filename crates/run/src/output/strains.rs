//! Largest strains of shells, and the warning where they exceed the range of small-strain elasticity.

use pliant_geometry::words::number;
use pliant_implicit::State;
use pliant_sim::BodyCells;
use serde::{Deserialize, Serialize};

use pliant_scene::Built;

/// Strain above which a run of shells gives a warning.
const MUCH: f64 = 0.1;

/// The largest strain of a shell during a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StrainSummary {
    /// Its body.
    pub body: String,
    /// The largest principal strain at top or bottom, its size.
    pub largest: f64,
    /// Strain of the middle surface in the same triangle.
    pub membrane: f64,
    /// The triangle, counted from 0.
    pub element: u32,
    /// Time of the largest strain [s].
    pub time: f64,
    /// Time at which a strain above 10 % was first seen [s].
    pub above_from: Option<f64>,
}

/// The largest strains of the shells of a run so far, in the order of their bodies.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct ShellStrains(pub Vec<StrainSummary>);

impl ShellStrains {
    /// Looks at an instant.
    pub fn look(&mut self, built: &Built, state: Option<&State>) {
        let (Some(part), Some(state)) = (&built.implicit, state) else { return };
        if part.model.facets.is_empty() {
            return;
        }
        let strains = state.shell_strains(&part.model);
        let shells = built.bodies.iter().zip(&part.cells).filter_map(|(body, cells)| match cells {
            BodyCells::Facets(range) => Some((body, range)),
            BodyCells::Solids => None,
        });
        for (at, (body, range)) in shells.enumerate() {
            let of = |&cell: &u32| strains[cell as usize].surface;
            let Some(cell) = range.clone().max_by(|a, b| of(a).total_cmp(&of(b))) else { continue };
            let (largest, membrane) = (of(&cell), strains[cell as usize].membrane);
            let before = self.0.get(at);
            let above_from = before.and_then(|before| before.above_from);
            let above_from = above_from.or((largest > MUCH).then_some(state.time));
            let now = StrainSummary {
                body: body.name.clone(),
                largest,
                membrane,
                element: cell - range.start,
                time: state.time,
                above_from,
            };
            match self.0.get_mut(at) {
                None => self.0.push(now),
                Some(before) if largest > before.largest => *before = now,
                Some(before) => before.above_from = above_from,
            }
        }
    }

    /// Returns what a user should know before trusting the result.
    pub fn doubts(&self) -> impl Iterator<Item = String> {
        self.0.iter().filter_map(|strain| {
            let StrainSummary { body, largest, membrane, element, time, above_from } = strain;
            let percent = |strain: &f64| format!("{:.1} %", 100.0 * strain);
            Some(format!(
                "`{body}` is strained by {} in triangle {element} (counted from 0) at t = {} s, by {} of it in its middle \
                 surface, and by more than 10 % from t = {} s on: shells are linearly elastic for small strain, so forces \
                 and stresses are questionable there; take smaller loads, `model = \"membrane\"` if bending does not matter, or a \
                 solid, both with a hyperelastic law",
                percent(largest),
                number(*time),
                percent(membrane),
                number((*above_from)?)
            ))
        })
    }
}
