//! Relaxing laws ([`pliant_mechanics::prony`]) in equations that are solved. Within a step both updates are
//! affine in the elastic stress at its end: S = f Φ + k, with f = 1 − Σ aᵢ + Σ gᵢ and k = Σ (dᵢ hᵢ − gᵢ Φ) of
//! the instant before. So a step is the minimum of f ψ + k : E, and its stiffness is symmetric. At an instant
//! itself f = 1 − Σ aᵢ and k = Σ hᵢ.
//!
//! A history begins by a step of no time: strains at the start load the instantaneous law. What relaxing
//! stresses did is their work, summed by the trapezoidal rule. Leaves out: pressures that are averaged over
//! cells, and bars.

use pliant_mechanics::Model;
use pliant_mechanics::model::Solid;
use pliant_mechanics::prony::Prony;
use pliant_mechanics::tensor::{Symmetric, Vector};
use rayon::prelude::*;

use crate::solid::{MOST_POINTS, visit_points};

/// Cells that are advanced one after the other.
const CHUNK: usize = 256;

/// Memory of the relaxing laws of all solids.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct History {
    /// True if the history has begun.
    pub begun: bool,
    /// Tensors [Pa] of the series of each solid, cell by cell and point by point. A point has Φ of the last
    /// instant and one h a term, first of the isochoric, then of the volumetric part. Empty for a solid that
    /// does not relax.
    pub tensors: Vec<Vec<Symmetric<f64>>>,
    /// Work of the stresses of each relaxing solid so far [J].
    pub work: Vec<f64>,
}

impl History {
    /// At rest; empty where no solid of a model relaxes.
    pub fn at_rest(model: &Model) -> Self {
        if model.solids.iter().all(|solid| solid.material.prony.is_elastic()) {
            return Self::default();
        }
        let tensors = |solid: &Solid| vec![Symmetric::ZERO; solid.cells.len() * slots_of_cell(solid)];
        Self {
            begun: false,
            tensors: model.solids.iter().map(tensors).collect(),
            work: vec![0.0; model.solids.len()],
        }
    }

    pub(crate) fn copy_from(&mut self, source: &Self) {
        self.begun = source.begun;
        self.tensors.clone_from(&source.tensors);
        self.work.clone_from(&source.work);
    }
}

/// Tensors of history of a cell.
fn slots_of_cell(solid: &Solid) -> usize {
    solid.cells.points() * solid.material.prony.point_slots(solid.cells.averages_pressure())
}

/// Relaxation of the stresses of a cell: S = f Φ + k at each of its points.
#[derive(Clone, Copy)]
pub(crate) struct Lag<'a> {
    /// f of the isochoric and the volumetric part.
    pub(crate) factors: [f64; 2],
    /// k of each point [Pa]; empty for none.
    pub(crate) kept: &'a [Symmetric<f64>],
    /// Three flags: k : E counts as energy, f ψ of the isochoric part counts, f ψ of the volumetric part
    /// counts. In a step all count. At an instant only the f ψ of parts that do not relax count.
    pub(crate) counts: [bool; 3],
}

impl Lag<'static> {
    /// Value for a law that does not relax.
    pub(crate) const NONE: Self = Self { factors: [1.0; 2], kept: &[], counts: [true; 3] };
}

/// The two parts of the stress of a relaxing solid, as a step or an instant takes them.
#[derive(Default)]
struct StressParts {
    factors: [f64; 2],
    kept: Vec<Symmetric<f64>>,
    /// d and g of each term of the isochoric and the volumetric part.
    coefficients: [Vec<(f64, f64)>; 2],
}

impl StressParts {
    /// Sets the coefficients for a step [s]. Without a step it sets the coefficients for an instant, which
    /// leave h unchanged.
    fn set_step(&mut self, Prony { isochoric, volumetric, update }: &Prony, step: Option<f64>) {
        let of_term = |&term: &(f64, f64)| step.map_or((1.0, 0.0), |step| update.coefficients(term, step));
        for (coefficients, terms) in self.coefficients.iter_mut().zip([isochoric, volumetric]) {
            coefficients.clear();
            coefficients.extend(terms.iter().map(of_term));
        }
    }
}

/// Relaxation of all solids, as a step or an instant takes it. Empty where none relaxes.
#[derive(Default)]
pub(crate) struct Relaxation {
    solids: Vec<StressParts>,
    /// True for a step, false for an instant.
    steps: bool,
    /// Work of each chunk of cells [J].
    sums: Vec<f64>,
}

impl Relaxation {
    /// For a model; at first nothing is remembered.
    pub(crate) fn of(model: &Model) -> Self {
        let history = History::at_rest(model);
        let mut new = Self {
            solids: history.tensors.iter().map(|_| StressParts::default()).collect(),
            ..Self::default()
        };
        new.stand(model, &history);
        new
    }

    /// True if any solid relaxes.
    pub(crate) fn is_there(&self) -> bool {
        !self.solids.is_empty()
    }

    /// For a step [s] from the last instant on.
    pub(crate) fn begin(&mut self, model: &Model, history: &History, step: f64) {
        self.take(model, history, Some(step));
    }

    /// For the last instant itself.
    pub(crate) fn stand(&mut self, model: &Model, history: &History) {
        self.take(model, history, None);
    }

    fn take(&mut self, model: &Model, history: &History, step: Option<f64>) {
        self.steps = step.is_some();
        for ((parts, solid), tensors) in self.solids.iter_mut().zip(&model.solids).zip(&history.tensors) {
            let (prony, averages) = (&solid.material.prony, solid.cells.averages_pressure());
            parts.set_step(prony, step);
            let StressParts { factors, kept: stresses, coefficients } = parts;
            let [shape, volume] = &*coefficients;
            *factors = [factor(&prony.isochoric, shape), factor(&prony.volumetric, volume)];
            stresses.clear();
            let slots = prony.point_slots(averages);
            if slots > 0 {
                stresses.extend(tensors.chunks_exact(slots).map(|point| kept(prony, coefficients, point)));
            }
        }
    }

    /// Relaxation of the stresses of a cell.
    pub(crate) fn of_cell(&self, number: usize, solid: &Solid, cell: usize) -> Lag<'_> {
        let Some(parts) = self.solids.get(number).filter(|parts| !parts.kept.is_empty()) else {
            return Lag::NONE;
        };
        let points = solid.cells.points();
        let kept = &parts.kept[cell * points..(cell + 1) * points];
        let Prony { isochoric, volumetric, .. } = &solid.material.prony;
        let counts = [false, isochoric.is_empty(), volumetric.is_empty()].map(|counts| counts || self.steps);
        Lag { factors: parts.factors, kept, counts }
    }

    /// Work of relaxing stresses so far [J], where energies of an instant are asked for.
    pub(crate) fn work(&self, history: &History) -> f64 {
        if self.steps { 0.0 } else { history.work.iter().sum() }
    }

    /// Ends a step [s]: the history is advanced from one displacement [m] of the nodes to another.
    pub(crate) fn end(
        &mut self,
        model: &Model,
        before: impl Fn(u32) -> Vector<f64> + Sync,
        now: impl Fn(u32) -> Vector<f64> + Sync,
        step: f64,
        history: &mut History,
    ) {
        history.begun = true;
        let solids = self.solids.iter_mut().zip(&model.solids);
        for (((parts, solid), tensors), work) in solids.zip(&mut history.tensors).zip(&mut history.work) {
            parts.set_step(&solid.material.prony, Some(step));
            let coefficients = &parts.coefficients;
            let slots = slots_of_cell(solid);
            if slots == 0 {
                continue;
            }
            let chunk = |(number, of_chunk): (usize, &mut [Symmetric<f64>])| {
                let cells = of_chunk.chunks_exact_mut(slots).enumerate();
                cells
                    .map(|(at, of_cell)| {
                        advance(solid, number * CHUNK + at, (&before, &now), coefficients, of_cell)
                    })
                    .sum()
            };
            tensors.par_chunks_mut(CHUNK * slots).enumerate().map(chunk).collect_into_vec(&mut self.sums);
            *work += self.sums.iter().sum::<f64>();
        }
    }
}

/// f of one part, 1 − Σ a + Σ g.
fn factor(terms: &[(f64, f64)], coefficients: &[(f64, f64)]) -> f64 {
    terms.iter().zip(coefficients).fold(1.0, |sum, (term, coefficient)| sum - term.0 + coefficient.1)
}

/// k of a point with its tensors, Σ (d h − g Φ).
fn kept(prony: &Prony, [shape, volume]: &[Vec<(f64, f64)>; 2], tensors: &[Symmetric<f64>]) -> Symmetric<f64> {
    let part = |coefficients: &[(f64, f64)], tensors: &[Symmetric<f64>]| {
        let Some((elastic, histories)) = tensors.split_first() else { return Symmetric::ZERO };
        let of_terms = coefficients.iter().zip(histories);
        of_terms.fold(Symmetric::ZERO, |sum, (&(decay, gain), h)| sum + *h * decay - *elastic * gain)
    };
    let (isochoric, volumetric) = tensors.split_at(prony.isochoric_slots());
    part(shape, isochoric) + part(volume, volumetric)
}

/// Advances the tensors of a cell over a step [s]; the work of its relaxing stress [J].
fn advance(
    solid: &Solid,
    cell: usize,
    (before, now): (impl Fn(u32) -> Vector<f64>, impl Fn(u32) -> Vector<f64>),
    [shape, volume]: &[Vec<(f64, f64)>; 2],
    tensors: &mut [Symmetric<f64>],
) -> f64 {
    let Prony { isochoric, volumetric, .. } = &solid.material.prony;
    let slots = tensors.len() / solid.cells.points();
    let fibres = solid.law_fibres(cell);
    let mut from = [Symmetric::ZERO; MOST_POINTS];
    visit_points(solid, cell, before, |point, _, strained| from[point] = strained.twice());
    let mut work = 0.0;
    visit_points(solid, cell, now, |point, weight, strained| {
        let at_point = &mut tensors[point * slots..(point + 1) * slots];
        let elastic = strained.stress(&solid.material.law, &fibres);
        let (first, second) = at_point.split_at_mut(solid.material.prony.isochoric_slots());
        let mut sum = Symmetric::ZERO;
        for (terms, coefficients, elastic, stored) in
            [(isochoric, shape, elastic.isochoric, first), (volumetric, volume, elastic.volumetric, second)]
        {
            let Some((last, histories)) = stored.split_first_mut() else { continue };
            let remaining = terms.iter().fold(1.0, |sum, (weight, _)| sum - weight);
            sum = sum + (*last + elastic) * remaining;
            let change = elastic - *last;
            for (&(decay, gain), h) in coefficients.iter().zip(histories) {
                sum = sum + *h;
                *h = *h * decay + change * gain;
                sum = sum + *h;
            }
            *last = elastic;
        }
        // ½ (S before + S now) : (E now − E before), of which twice is at hand.
        work += 0.25 * weight * sum.double_dot(&(strained.twice() - from[point]));
    });
    work
}
