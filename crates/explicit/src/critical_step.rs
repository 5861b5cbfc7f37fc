//! The largest stable step of the central difference method at rest; see [`stability`](crate::stability) for
//! a run.
//!
//! *Element bound* (rigorous, Irons and Treharne): λ_max(K_e) ≤ V (λ+2μ) Σ|B_a|², hence Δt_e = 2/√(n (λ+2μ)/ρ
//! Σ|B_a|²) and Δt_cr ≥ min Δt_e. *Assembled model*: 2/ω_max of the assembled, constrained operator M⁻¹K by
//! the Lanczos method. It accelerates the power iteration: the same operator calls, but far fewer. K v =
//! (f(hv) − f(−hv))/2h. During a run, isotropic laws take (f(u + hv) − f(u))/h, half of the force
//! evaluations. A run in single precision takes forces in its own precision where they suffice.

use std::borrow::Cow;

use pliant_mechanics::model::{Cells, Contradiction, FREE, Model, Solid};
use pliant_mechanics::tensor::{Vector, add, cast, dot, sub};
use rayon::prelude::*;

use crate::damping_force::damped;
use crate::forces::InternalForces;
use crate::history::History;
use crate::lanes::LaneNumber;

/// The smallest element bound of a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElementBound {
    /// Step [s].
    pub step: f64,
    /// The solid of the cell that sets it.
    pub solid: usize,
    /// The cell in that solid.
    pub cell: usize,
}

/// The bound [s] of one cell, of its material's mass.
pub fn cell_bound(solid: &Solid, cell: usize) -> f64 {
    // Hourglass patterns are as fast as a wave of modulus c μ: slower than the law's own for any usual
    // coefficient c.
    let modulus = solid.longitudinal_modulus().max(solid.cells.hourglass_modulus(cell));
    let wave = modulus / solid.material.density;
    let n = solid.cells.nodes_per_cell() as f64;
    2.0 / (n * wave * solid.cells.gradient_square_sum(cell)).sqrt()
}

/// Returns the least factor by which mass scaling makes a node of a cell heavier. A node that follows others
/// has no mass and gets the factor 1.
fn mass_factor(model: &Model, solid: &Solid, cell: usize) -> f64 {
    let Some(scaling) = &model.mass_scaling else { return 1.0 };
    let factor = |&node: &u32| {
        let (mass, added) = (model.mass[node as usize], scaling.added[node as usize]);
        if mass > 0.0 { 1.0 + added / mass } else { 1.0 }
    };
    solid.cells.nodes(cell).iter().map(factor).fold(f64::INFINITY, f64::min)
}

/// The bound [s] of one cell with what mass scaling adds to it.
pub(crate) fn scaled_bound(model: &Model, solid: &Solid, cell: usize) -> f64 {
    cell_bound(solid, cell) * mass_factor(model, solid, cell).sqrt()
}

/// The smallest bound over all cells, with damping by stiffness; `None` without cells.
pub fn element_bound(model: &Model) -> Option<ElementBound> {
    let mut worst: Option<ElementBound> = None;
    for (index, solid) in model.solids.iter().enumerate() {
        for cell in 0..solid.cells.len() {
            let step = scaled_bound(model, solid, cell);
            if worst.is_none_or(|w| step < w.step) {
                worst = Some(ElementBound { step, solid: index, cell });
            }
        }
    }
    worst.map(|found| ElementBound { step: damped(found.step, model.stiffness_damping), ..found })
}

/// The limit [s] of a cell alone, from the largest eigenvalue of its stiffness over its volume [Pa/m²].
pub(crate) fn limit_alone(model: &Model, solid: &Solid, cell: usize, stiffness: f64) -> f64 {
    let density = solid.material.density * mass_factor(model, solid, cell);
    2.0 / (solid.cells.nodes_per_cell() as f64 * stiffness / density).sqrt()
}

/// The critical time step of the assembled operator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CriticalStep {
    /// Step [s].
    pub step: f64,
    /// Relative error bound of the largest eigenvalue (residual of its Ritz vector); it is counted in, on the
    /// safe side.
    pub error: f64,
    /// Force evaluations spent.
    pub force_calls: usize,
    /// Wall time of one force evaluation in double precision [s], measured on the way.
    pub seconds_per_call: f64,
}

const LARGEST_SUBSPACE: usize = 200;
/// Largest subspace if only a rough value counts.
const DECIDED: usize = 50;
const TOLERANCE: f64 = 1e-4;
/// The relative residual that is small enough of an eigenvalue that leaves steps as they are.
const ROUGH: f64 = 0.01;
/// Nodes that a thread takes at once.
const SHARE: usize = 512;

/// The critical time step at rest, with damping by stiffness; infinite if every node is held.
///
/// # Errors
/// If constraints contradict each other.
pub fn assembled(model: &Model) -> Result<CriticalStep, Contradiction> {
    assembled_at(model, &vec![[0.0; 3]; model.node_count()])
}

/// The critical time step of small vibrations about a deformed state; infinite if every node is held.
///
/// # Errors
/// If constraints contradict each other.
pub fn assembled_at(model: &Model, displacement: &[Vector<f64>]) -> Result<CriticalStep, Contradiction> {
    Ok(assembled_about(model, &model.constrained_components()?, displacement))
}

/// Computes the critical time step as [`assembled_at`] does, with the owner of each component known.
pub(crate) fn assembled_about(
    model: &Model,
    owners: &[[u32; 3]],
    displacement: &[Vector<f64>],
) -> CriticalStep {
    let mut forces = InternalForces::new(&model.with_taut_threads(), 1.0);
    let difference = sized(CENTRAL, cell_sizes(model)[0]);
    let mut operator = Operator::<f64>::new(model, owners, &mut forces, displacement, difference);
    let started = std::time::Instant::now();
    let (eigenvalue, error) =
        largest_eigenvalue(&mut operator, Until::Accurate).unwrap_or((f64::NAN, f64::NAN));
    let seconds_per_call = started.elapsed().as_secs_f64() / operator.calls.max(1) as f64;
    let step = damped(step_of(eigenvalue), model.stiffness_damping);
    CriticalStep { step, error, force_calls: operator.calls, seconds_per_call }
}

/// Returns the critical time step [s] without damping about a deformed state of a run, with the owner of each
/// component known. Once three looks at Lanczos' iteration agree to [`ROUGH`] that the step is at least
/// `enough` [s], the iteration ends. Its remaining error is less than the reserve of `RESERVE`: 2 % of the
/// step at most in the tests below.
///
/// The `forces` of the run are used where possible; afterwards they are the forces of the last evaluation
/// again. In single precision a step below `enough` is found again in double precision.
pub(crate) fn limit_about<R: LaneNumber>(
    model: &Model,
    owners: &[[u32; 3]],
    forces: Option<&mut InternalForces<R>>,
    displacement: &[Vector<R>],
    enough: f64,
) -> f64 {
    let taut = model.with_taut_threads();
    let is_double = R::EPSILON == f64::EPSILON;
    // Where mass is scaled, large cells may be the critical ones, in which differences are small.
    let suits = is_double || !has_search_across(model) && model.mass_scaling.is_none();
    let find = |forces: &mut InternalForces<R>| {
        if is_double {
            Some(limit_or_enough(model, owners, forces, displacement, enough))
        } else {
            limit_if_enough(model, owners, forces, displacement, enough)
        }
    };
    let found = match forces {
        _ if !suits => None,
        Some(forces) if matches!(taut, Cow::Borrowed(_)) => forces.lend(find),
        _ => find(&mut InternalForces::new(&taut, 1.0)),
    };
    found.unwrap_or_else(|| {
        let displacement: Vec<Vector<f64>> = displacement.iter().map(|&u| cast(u)).collect();
        limit_or_enough(model, owners, &mut InternalForces::new(&taut, 1.0), &displacement, enough)
    })
}

/// Computes the limit of [`limit_about`] from forces in double precision.
fn limit_or_enough<R: LaneNumber>(
    model: &Model,
    owners: &[[u32; 3]],
    forces: &mut InternalForces<R>,
    displacement: &[Vector<R>],
    enough: f64,
) -> f64 {
    let difference = sized(if is_smooth(model) { FORWARD } else { CENTRAL }, cell_sizes(model)[0]);
    let mut operator = Operator::new(model, owners, forces, displacement, difference);
    let found = largest_eigenvalue(&mut operator, Until::Enough(enough));
    found.map_or(f64::NAN, |(eigenvalue, _)| step_of(eigenvalue))
}

/// The critical time step [s] by forces in single precision, if it is at least `enough` [s]; `None` also
/// where round-off is too large for small differences.
fn limit_if_enough<R: LaneNumber>(
    model: &Model,
    owners: &[[u32; 3]],
    forces: &mut InternalForces<R>,
    displacement: &[Vector<R>],
    enough: f64,
) -> Option<f64> {
    let farthest = displacement.as_flattened().iter().fold(0.0, |most: f64, u| most.max(u.to_f64().abs()));
    let [smallest, critical] = cell_sizes(model);
    let candidates = [FORWARD_IN_SINGLE, CENTRAL_IN_SINGLE];
    let suiting = if is_smooth(model) { &candidates[..] } else { &candidates[1..] };
    let mut differences = suiting.iter().map(|&difference| sized(difference, smallest));
    // Displacements are rounded, and so are the strains of the critical cell.
    let rounded = R::EPSILON * (farthest + critical);
    let difference = differences.find(|(_, size)| rounded <= NOISE * size)?;
    let mut operator = Operator::new(model, owners, forces, displacement, difference);
    let limit = step_of(largest_eigenvalue(&mut operator, Until::Decided(enough))?.0);
    (limit >= enough).then_some(limit)
}

/// True if one-sided differences suffice, as there are no fibres and no searches across walls. Fibres have
/// two slopes where they are slack.
fn is_smooth(model: &Model) -> bool {
    !has_search_across(model) && model.solids.iter().all(|solid| solid.material.law.is_isotropic())
}

/// True if the thickness of walls in plane stress is found by a search, whose tolerance shows in small
/// differences of a steep law.
fn has_search_across(model: &Model) -> bool {
    let is_searched =
        |solid: &Solid| matches!(solid.cells, Cells::Membrane(..)) && !solid.material.law.is_incompressible();
    model.solids.iter().any(is_searched)
}

/// The critical time step [s] of the largest eigenvalue [1/s²].
fn step_of(eigenvalue: f64) -> f64 {
    2.0 / eigenvalue.sqrt()
}

/// A difference has moves over its size, with their weights in the stiffness, and that size over the one of a
/// cell. It is far from round-off and from the law's curvature.
type Difference = (&'static [[f64; 2]], f64);
/// The central difference takes the mean of two slopes.
const CENTRAL: Difference = (&[[1.0, 0.5], [-1.0, -0.5]], 1e-6);
/// The forward difference starts from the forces of the state itself.
const FORWARD: Difference = (&[[1.0, 1.0]], 1e-7);
/// Both differences in single precision. If a law stiffens by e for each 1 % of strain, the forward
/// difference is off by 1 %.
const CENTRAL_IN_SINGLE: Difference = (CENTRAL.0, 2e-3);
const FORWARD_IN_SINGLE: Difference = (FORWARD.0, 2e-4);
/// The most that rounding may take of a difference.
const NOISE: f64 = 0.01;

/// A difference in a cell of a size [m], with its largest displacement [m].
fn sized((moves, size): Difference, cell: f64) -> Difference {
    (moves, size * cell)
}

/// Sizes [m] of the smallest cell, and of that with the smallest bound.
fn cell_sizes(model: &Model) -> [f64; 2] {
    let smallest_of = |solid: &Solid| {
        let cells =
            (0..solid.cells.len()).into_par_iter().map(|cell| (solid.cells.gradient_square_sum(cell), cell));
        let (square, cell) = cells.reduce(|| (0.0, 0), |a, b| if b.0 > a.0 { b } else { a });
        [square.sqrt().recip(), cell_bound(solid, cell)]
    };
    let (mut smallest, mut critical) = (f64::INFINITY, [0.0, f64::INFINITY]);
    for sizes in model.solids.iter().filter(|solid| !solid.cells.is_empty()).map(smallest_of) {
        smallest = sizes[0].min(smallest);
        if sizes[1] < critical[1] {
            critical = sizes;
        }
    }
    [smallest, critical[0]]
}

/// Finds the forces on some nodes from `first` on, at most [`SHARE`].
fn forces_from<R: LaneNumber>(forces: &InternalForces<R>, first: usize, to: &mut [Vector<R>]) {
    forces.at_nodes(first..first + to.len(), &mut [[R::ZERO; 4]; SHARE], to);
}

/// The symmetric operator M^(−1/2) K M^(−1/2) on the free components, with forces in a precision.
struct Operator<'a, R> {
    model: &'a Model,
    /// The displacements [m] about which the model vibrates, tied nodes where their ties put them.
    about: Vec<Vector<R>>,
    /// Difference, with its largest displacement [m].
    difference: Difference,
    forces: &'a mut InternalForces<R>,
    /// Forces [N] of the state, where a difference is taken from them.
    before: Vec<Vector<R>>,
    history: Vec<History<R>>,
    /// M^(−1/2), zero on held components.
    inverse_root_mass: Vec<Vector<R>>,
    displacement: Vec<Vector<R>>,
    calls: usize,
}

impl<'a, R: LaneNumber> Operator<'a, R> {
    fn new(
        model: &'a Model,
        owners: &[[u32; 3]],
        forces: &'a mut InternalForces<R>,
        displacement: &[Vector<R>],
        difference: Difference,
    ) -> Self {
        let mut displacement = displacement.to_vec();
        model.follow(&mut displacement);
        let about = displacement.clone();
        let inverse_root_mass = (owners.par_iter().enumerate())
            .map(|(node, owner)| (model.inertia(node), owner))
            .map(|(m, owner)| owner.map(|o| if o == FREE && m > 0.0 { 1.0 / m.sqrt() } else { 0.0 }))
            .map(cast)
            .collect();
        let mut history = vec![History::default(); model.solids.len()];
        let mut before = Vec::new();
        if difference.0 == FORWARD.0 {
            forces.evaluate(&displacement, &mut history);
            before.resize(about.len(), [R::ZERO; 3]);
            let parts = before.par_chunks_mut(SHARE).enumerate();
            parts.for_each(|(part, to)| forces_from(forces, part * SHARE, to));
        }
        Self { model, about, difference, forces, before, history, inverse_root_mass, displacement, calls: 0 }
    }

    /// Applies it to a vector of which the largest component, over the root of its mass, is known; returns
    /// the product of both vectors.
    fn apply(&mut self, v: &[Vector<R>], largest: f64, out: &mut [Vector<R>]) -> f64 {
        let (moves, amplitude) = self.difference;
        let h = amplitude / largest;
        let mut product = 0.0;
        for (index, &[side, weight]) in moves.iter().enumerate() {
            let far = R::of(side * h);
            let ways = v.par_iter().zip(&self.inverse_root_mass);
            let nodes = self.displacement.par_iter_mut().zip(&self.about).zip(ways).with_min_len(SHARE);
            nodes.for_each(|((u, about), (v, w))| {
                *u = [0, 1, 2].map(|c| about[c] + far * v[c] * w[c]);
            });
            self.model.follow(&mut self.displacement);
            self.forces.evaluate(&self.displacement, &mut self.history);
            self.calls += 1;
            let (forces, before, scale) = (&self.forces, &self.before, R::of(weight / h));
            let parts = out.par_chunks_mut(SHARE).zip(v.par_chunks(SHARE));
            let parts = parts.zip(self.inverse_root_mass.par_chunks(SHARE)).enumerate();
            product = summed(parts.map(|(part, ((out, v), w))| {
                let first = part * SHARE;
                let mut found = [[R::ZERO; 3]; SHARE];
                forces_from(forces, first, &mut found[..out.len()]);
                let mut product = 0.0;
                for (node, (out, (v, w))) in out.iter_mut().zip(v.iter().zip(w)).enumerate() {
                    let change = before.get(first + node).map_or(found[node], |&f| sub(found[node], f));
                    let term = [0, 1, 2].map(|c| scale * change[c] * w[c]);
                    *out = if index == 0 { term } else { add(*out, term) };
                    product += wide_dot(*out, *v);
                }
                product
            }));
        }
        product
    }
}

/// Criterion that ends the search for an eigenvalue.
#[derive(Clone, Copy, PartialEq)]
enum Until {
    /// The eigenvalue is accurate to [`TOLERANCE`].
    Accurate,
    /// The eigenvalue is accurate to [`TOLERANCE`], or to [`ROUGH`] if the step is at least this one [s].
    Enough(f64),
    /// The step is at least this one [s], to [`ROUGH`]. The search fails if the step is shorter, or if
    /// neither shows soon.
    Decided(f64),
}

/// Largest eigenvalue by Lanczos, with its residual added, and the relative residual; `None` where the search
/// was in vain.
fn largest_eigenvalue<R: LaneNumber>(operator: &mut Operator<'_, R>, until: Until) -> Option<(f64, f64)> {
    let nodes = operator.inverse_root_mass.len();
    let mut v = start_vector(nodes, &operator.inverse_root_mass);
    let mut before = vec![[R::ZERO; 3]; nodes];
    let mut w = v.clone();
    let (mut alphas, mut betas): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut beta = 1.0;
    if v.iter().all(|&v| v == [R::ZERO; 3]) {
        return Some((0.0, 0.0));
    }
    let look_every = if until == Until::Accurate { 10 } else { 5 };
    let largest_subspace = if matches!(until, Until::Decided(_)) { DECIDED } else { LARGEST_SUBSPACE };
    let mut ritz_before = [0.0; 2];
    loop {
        let scale = R::of(1.0 / beta);
        let scaled = v.par_iter_mut().zip(&w).zip(&operator.inverse_root_mass).with_min_len(SHARE);
        let largest = scaled.map(|((v, w), root)| {
            *v = w.map(|x| x * scale);
            (0..3).map(|c| (v[c] * root[c]).to_f64().abs()).fold(f64::MIN_POSITIVE, f64::max)
        });
        let largest = largest.reduce(|| f64::MIN_POSITIVE, f64::max);
        let alpha = operator.apply(&v, largest, &mut w);
        let [along, along_before] = [alpha, betas.last().copied().unwrap_or(0.0)].map(R::of);
        let parts = w.par_chunks_mut(SHARE).zip(v.par_chunks(SHARE)).zip(before.par_chunks(SHARE));
        let square = summed(parts.map(|((w, v), before)| {
            let mut square = 0.0;
            for (w, (v, b)) in w.iter_mut().zip(v.iter().zip(before)) {
                *w = [0, 1, 2].map(|c| w[c] - along * v[c] - along_before * b[c]);
                square += wide_dot(*w, *w);
            }
            square
        }));
        beta = square.sqrt();
        if beta.is_nan() {
            return None;
        }
        alphas.push(alpha);
        let finished = alphas.len() >= largest_subspace || beta < 1e-12 * alpha.abs();
        if finished || alphas.len().is_multiple_of(look_every) {
            let (ritz, last) = largest_ritz_pair(&alphas, &betas);
            let residual = beta * last.abs();
            // A residual says that some eigenvalue is near; that it is the largest, the two looks before.
            let is_rough = residual.max(ritz - ritz_before[0]) < ROUGH * ritz;
            let ended = finished || residual < TOLERANCE * ritz;
            let found = match until {
                Until::Accurate => ended,
                Until::Enough(enough) => ended || is_rough && step_of(ritz + residual) >= enough,
                Until::Decided(_) => is_rough,
            };
            if found {
                return Some((ritz + residual, residual / ritz));
            }
            // Ritz values are below the largest eigenvalue.
            if let Until::Decided(enough) = until
                && (finished || step_of(ritz) < enough)
            {
                return None;
            }
            ritz_before = [ritz_before[1], ritz];
        }
        betas.push(beta);
        std::mem::swap(&mut before, &mut v);
    }
}

/// A unit vector without pattern, the same in every run, zero on held components.
fn start_vector<R: LaneNumber>(nodes: usize, mask: &[Vector<R>]) -> Vec<Vector<R>> {
    let mut seed = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut v: Vec<Vector<f64>> =
        (0..nodes).map(|node| mask[node].map(|m| if m > R::ZERO { random() } else { 0.0 })).collect();
    let norm = v.iter().map(|&v| dot(v, v)).sum::<f64>().sqrt();
    if norm > 0.0 {
        v.iter_mut().flatten().for_each(|x| *x /= norm);
    }
    v.into_iter().map(cast).collect()
}

/// a · b in double precision.
fn wide_dot<R: LaneNumber>(a: Vector<R>, b: Vector<R>) -> f64 {
    dot(a.map(R::to_f64), b.map(R::to_f64))
}

/// The sum of parts in their order, so that the number of threads never changes a bit.
fn summed(parts: impl IndexedParallelIterator<Item = f64>) -> f64 {
    let parts: Vec<f64> = parts.collect();
    parts.iter().sum()
}

/// The largest eigenvalue of the tridiagonal matrix and the last entry of its unit eigenvector.
fn largest_ritz_pair(alphas: &[f64], betas: &[f64]) -> (f64, f64) {
    let n = alphas.len();
    let mut matrix = nalgebra::DMatrix::<f64>::zeros(n, n);
    for i in 0..n {
        matrix[(i, i)] = alphas[i];
        if i + 1 < n {
            matrix[(i, i + 1)] = betas[i];
            matrix[(i + 1, i)] = betas[i];
        }
    }
    let eigen = matrix.symmetric_eigen();
    let top = eigen.eigenvalues.imax();
    (eigen.eigenvalues[top], eigen.eigenvectors[(n - 1, top)])
}

#[cfg(test)]
mod tests {
    use pliant_mechanics::law::samples::law;
    use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
    use pliant_mechanics::model::Material;
    use pliant_mechanics::tensor::{Tensor, scale};
    use pliant_testing::Random;
    use serde_json::json;

    use super::*;
    use crate::State;
    use crate::forces::tests::{distorted_cube, laws};
    use crate::substeps::RESERVE;

    /// Calls `check` with cubes of every element and of laws with and without fibres, also one that stiffens.
    /// The cubes are free or held, and uneven displacements press or shear them.
    fn of_deformed_cubes(mut check: impl FnMut(&str, &Model, &[Vector<f64>])) {
        let pressed = Tensor([[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, -0.3]]);
        let sheared = Tensor([[0.0, 0.4, 0.0], [0.0; 3], [0.0; 3]]);
        let mooney_rivlin = law("mooney-rivlin", json!({ "c10": 300.0, "c01": 150.0, "bulk-modulus": 5e3 }));
        let mut random = Random::new(3);
        for element in ["tet4", "tet4-anp", "tet4-ianp", "hex8", "hex8-full", "membrane", "bar", "thread"] {
            // In plane stress of a steeper law the tolerance of the search across shows.
            let exponent = if element == "membrane" { 5.0 } else { 20.0 };
            let demiray =
                law("demiray", json!({ "shear-modulus": 1e3, "bulk-modulus": 1e4, "exponent": exponent }));
            let volumetric = Volumetric::quadratic(f64::INFINITY);
            let incompressible = AnyLaw::NeoHookean(NeoHookean { shear: 700.0, volumetric });
            let incompressible = (element == "membrane").then_some(incompressible);
            for law in laws().into_iter().chain([mooney_rivlin, demiray]).chain(incompressible) {
                for (h, held) in [(pressed, 0), (pressed, 16), (sheared, 0), (sheared, 16)].repeat(8) {
                    let mut model = distorted_cube(element, law);
                    model.fix("base", (0..held).collect());
                    let mut place = |&x: &Vector<f64>| add(h.apply(x), scale(random.vector(), 0.004));
                    let displacement: Vec<_> = model.rest.iter().map(&mut place).collect();
                    let name = format!("{element} of {}, {held} nodes held, {:?}", law.name(), h.0);
                    check(&name, &model, &displacement);
                }
            }
        }
    }

    /// Both eigenvalues are right to the tolerance, so the steps differ by half the tolerance, and slopes on
    /// one side add a little. A rough eigenvalue is at most [`ROUGH`] too large, as its residual is counted
    /// in. Its other error is less than the reserve of `RESERVE`. Single precision adds 1e-3 at most.
    #[test]
    fn the_limit_of_a_run_is_the_critical_time_step() {
        of_deformed_cubes(|name, model, displacement| {
            let owners = model.constrained_components().unwrap();
            let step = assembled_at(model, displacement).unwrap().step;
            let single: Vec<Vector<f32>> = displacement.iter().map(|&u| cast(u)).collect();
            let found =
                |enough: f64| found_with_and_without_forces(name, model, displacement, enough * step) / step;
            for enough in [f64::INFINITY, 1.0 / RESERVE, 1.02] {
                let found = found(enough);
                assert!((found - 1.0).abs() < TOLERANCE, "{name}: {found} for {enough}");
            }
            let whole = found_with_and_without_forces(name, model, &single, 1.03 * step) / step;
            assert!((whole - 1.0).abs() < TOLERANCE, "{name}: {whole}");
            for enough in [0.5, 0.98] {
                let found = found(enough);
                assert!((1.0 - ROUGH..1.02).contains(&found), "{name}: {found} for {enough}");
            }
            if has_search_across(model) {
                return;
            }
            let mut forces = InternalForces::<f32>::new(&model.with_taut_threads(), step);
            let mut in_single = |at: &[Vector<f32>], enough: f64| {
                limit_if_enough(model, &owners, &mut forces, at, enough * step).map(|limit| limit / step)
            };
            assert_eq!(in_single(&single, 1.03), None, "{name}");
            for enough in [0.5, 0.98] {
                let found = in_single(&single, enough).unwrap();
                assert!(
                    (1.0 - ROUGH..1.02).contains(&found),
                    "{name}: {found} for {enough} in single precision"
                );
            }
            // Displacements of two metres are rounded to too much for the smaller differences, of a kilometre
            // for all.
            let away = |far: f64| -> Vec<Vector<f32>> {
                displacement.iter().map(|&u| cast(add(u, [far, 0.0, 0.0]))).collect()
            };
            let two = in_single(&away(2.0), 0.9).unwrap();
            assert!((1.0 - ROUGH..1.02).contains(&two), "{name}: {two}");
            assert_eq!(in_single(&away(1e3), 0.5), None, "{name}");
        });
    }

    /// The limit, once with what has found other forces with a history, which stay.
    fn found_with_and_without_forces<R: LaneNumber>(
        name: &str,
        model: &Model,
        displacement: &[Vector<R>],
        enough: f64,
    ) -> f64 {
        let owners = model.constrained_components().unwrap();
        let found = limit_about(model, &owners, None, displacement, enough);
        let mut relaxing = model.clone();
        relaxing.solids[0].material.prony.isochoric = vec![(0.3, 0.01)];
        let mut forces = InternalForces::new(&relaxing, 0.01);
        forces.evaluate(displacement, &mut State::<R>::at_rest(&relaxing).history);
        let of_run: Vec<Vector<R>> = (0..model.node_count()).map(|node| forces.at(node)).collect();
        let lent = limit_about(&relaxing, &owners, Some(&mut forces), displacement, enough);
        assert!((0..).zip(&of_run).all(|(node, &force)| forces.at(node) == force), "{name}");
        assert_eq!(lent, found, "{name}");
        found
    }

    /// Beside a soft cell of a tenth of a millimetre, differences in cells of 0.1 m are below the round-off
    /// of single precision.
    #[test]
    fn a_small_cell_that_is_not_critical_leaves_the_search_to_double_precision() {
        let mut model = distorted_cube("tet4", laws()[0]);
        let first = model.node_count() as u32;
        model.rest.extend([[1.0, 0.0, 0.0], [1.0001, 0.0, 0.0], [1.0, 0.0001, 0.0], [1.0, 0.0, 0.0001]]);
        model.mass.resize(model.rest.len(), 0.0);
        model.bodies[0].nodes.end += 4;
        let cells = Cells::tet4(vec![[0, 1, 2, 3].map(|node| first + node)], &model.rest);
        let volumetric = Volumetric::quadratic(5e-4);
        let law = AnyLaw::NeoHookean(NeoHookean { shear: 7e-5, volumetric });
        let material = Material { law, ..model.solids[0].material.clone() };
        model.add_solid(Solid { body: 0, material, cells, fibre: vec![], original: vec![0] });
        let [smallest, critical] = cell_sizes(&model);
        assert!(smallest < 1e-4 && critical > 0.01, "{smallest} {critical}");
        let (owners, at_rest) =
            (model.constrained_components().unwrap(), vec![[0.0_f32; 3]; model.node_count()]);
        let step = assembled(&model).unwrap().step;
        let mut forces = InternalForces::new(&model, step);
        assert_eq!(limit_if_enough(&model, &owners, &mut forces, &at_rest, 0.5 * step), None);
        let found = limit_about(&model, &owners, Some(&mut forces), &at_rest, 1.03 * step) / step;
        assert!((found - 1.0).abs() < TOLERANCE, "{found}");
    }

    #[test]
    fn a_limit_that_is_enough_is_found_earlier() {
        let mut calls = [0; 2];
        of_deformed_cubes(|name, model, displacement| {
            let owners = model.constrained_components().unwrap();
            let needed = [f64::INFINITY, 0.0].map(|enough| {
                let mut forces = InternalForces::<f64>::new(model, 1.0);
                let difference = sized(CENTRAL, cell_sizes(model)[0]);
                let mut operator = Operator::new(model, &owners, &mut forces, displacement, difference);
                largest_eigenvalue(&mut operator, Until::Enough(enough));
                operator.calls
            });
            assert!(needed[1] <= needed[0], "{name}: {needed:?}");
            (0..2).for_each(|k| calls[k] += needed[k]);
        });
        assert!(10 * calls[1] < 9 * calls[0], "{calls:?}");
    }
}
