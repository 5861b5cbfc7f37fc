//! Quasi-static equilibrium by adaptive dynamic relaxation (Joldes, Wittek and Miller 2011): a fictitious damped motion
//! whose masses make every cell equally fast and whose damping follows the slowest mode still moving,
//! uⁿ⁺¹ = uⁿ + β (uⁿ − uⁿ⁻¹) − α M⁻¹ r, α = 2/(2+c), β = (2−c)/(2+c), c = 2 √(A₀ A_m/(A₀ + A_m)), A_m = 4,
//! A₀ a running Rayleigh quotient Δuᵀ Δr / Δuᵀ M Δu of the last increment. Masses: m_a = s/n Σ_e V_e (λ+2μ) Σ|B|²
//! over the cells at a node, n nodes per cell, s = 1.25.
//!
//! Time is that of loads, motions and relaxing laws; inertia and damping of the bodies play no part. A load step that
//! fails is tried again in halves, with twice the masses. History is committed at convergence only: inside a step every trial starts from the
//! history of the step before.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::Real;
use crate::applied::AppliedForces;
use crate::energies::Energies;
use crate::forces::InternalForces;
use crate::model::{Contradiction, FREE, Model};
use crate::state::{History, State};
use crate::step_error::at_corner;
use crate::stepper::{Observable, owned_only, sum_owned};
use crate::tensor::{Vector, cast, sub};

/// Nodes per parallel task.
const CHUNK: usize = 512;
/// s: margin of the fictitious masses against stiffening. Doubled when a load step fails: cells at a glued edge stiffen
/// many times over in compression, and a motion too fast for them turns them inside out.
const MASS_MARGIN: f64 = 1.25;
/// A_m.
const HIGHEST: f64 = 4.0;
/// Iterations over which a load step is brought on.
const RAMP: usize = 200;
/// c while the load is brought on.
const RAMP_DAMPING: f64 = 0.02;
/// Largest relative change of A₀ an iteration, down and up.
const ADAPT: [f64; 2] = [0.90, 1.02];
/// Iterations from one report to the next.
const REPORT: usize = 20;
/// The motion starts anew where the residual grows by this factor over its least.
const RUNAWAY: f64 = 10.0;

/// When a load step counts as converged, and when as failed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelaxationSettings {
    /// Largest residual force on a free component, over the largest internal force.
    pub tolerance: f64,
    /// Iterations after which a load step has failed.
    pub iterations: usize,
    /// How often a failed load step may be halved.
    pub halvings: u32,
}

impl Default for RelaxationSettings {
    fn default() -> Self {
        Self { tolerance: 1e-6, iterations: 20_000, halvings: 6 }
    }
}

/// Why an equilibrium was not found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RelaxationError {
    /// Still moving after the allowed iterations.
    #[error(
        "no equilibrium at t = {time:.6} s: residual {residual:.2e} > {tolerance:.0e} after {iterations} iterations, \
         largest at node {node} of `{body}`"
    )]
    NotConverged {
        /// The body of the node of the largest residual.
        body: String,
        /// That node, numbered in its body.
        node: u32,
        /// The relative residual.
        residual: f64,
        /// What was asked for.
        tolerance: f64,
        /// Iterations spent on the last try.
        iterations: usize,
        /// Time [s].
        time: f64,
        /// Whether the loads and motions do not change on the way there.
        sudden: bool,
    },
    /// A cell turns inside out however small the load step.
    #[error(
        "element {element} of `{body}` is inverted{} (det F = {determinant:.3e}) on the way to t = {time:.6} s, after \
         {iterations} iterations",
        at_corner(*corner, *node)
    )]
    Inverted {
        /// The body.
        body: String,
        /// The element, numbered as in the user's mesh.
        element: u32,
        /// Its first node, or that of the corner, numbered in its body.
        node: u32,
        /// Whether it is a corner of a hexahedron, not its middle.
        corner: bool,
        /// det F there.
        determinant: f64,
        /// Iterations spent on the last try.
        iterations: usize,
        /// Time [s].
        time: f64,
        /// Whether the loads and motions do not change on the way there.
        sudden: bool,
    },
    /// A displacement is not a number or infinite.
    #[error(
        "the displacement of node {node} of `{body}` is no longer finite on the way to t = {time:.6} s, after \
         {iterations} iterations"
    )]
    NotFinite {
        /// The body.
        body: String,
        /// The node, numbered in its body.
        node: u32,
        /// Iterations spent on the last try.
        iterations: usize,
        /// Time [s].
        time: f64,
        /// Whether the loads and motions do not change on the way there.
        sudden: bool,
    },
}

impl RelaxationError {
    /// What to try.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::NotConverged { sudden: true, .. }
            | Self::Inverted { sudden: true, .. }
            | Self::NotFinite { sudden: true, .. } => {
                "the whole load acts from the start (`curve = \"hold\"`), so that no load step makes it smaller: bring it on along \
                 a curve such as `smooth-step`, or choose a smaller load or motion"
            }
            Self::NotConverged { .. } => {
                "try more load steps or a looser tolerance; a body that nothing holds has no equilibrium"
            }
            Self::Inverted { .. } => "try more load steps, a smaller motion, or a finer mesh there",
            Self::NotFinite { .. } => "try more load steps; a body that nothing holds has no equilibrium",
        }
    }
}

impl RelaxationError {
    fn on_a_way(mut self, is_sudden: bool) -> Self {
        let (Self::NotConverged { sudden, .. }
        | Self::Inverted { sudden, .. }
        | Self::NotFinite { sudden, .. }) = &mut self;
        *sudden = is_sudden;
        self
    }
}

/// How a load step went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Convergence {
    /// Iterations, those of failed tries included.
    pub iterations: usize,
    /// Relative residual at the end.
    pub residual: f64,
    /// Parts the load step was cut into.
    pub parts: u32,
}

/// How far the search for an equilibrium is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iteration {
    /// Time [s] of the last equilibrium and of the one that is sought.
    pub span: [f64; 2],
    /// Iterations of this try.
    pub number: usize,
    /// Relative residual.
    pub residual: f64,
    /// Part of the way, in orders of magnitude of the residual; 0 while the load is brought on.
    pub fraction: f64,
}

/// Sums and extremes over the nodes of one task.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    stiffness: f64,
    mass: f64,
    largest_residual: f64,
    residual_node: usize,
    largest_force: f64,
    finite: bool,
}

impl Sums {
    fn merge(self, b: &Self) -> Self {
        let worse = b.largest_residual > self.largest_residual;
        Self {
            stiffness: self.stiffness + b.stiffness,
            mass: self.mass + b.mass,
            largest_residual: if worse { b.largest_residual } else { self.largest_residual },
            residual_node: if worse { b.residual_node } else { self.residual_node },
            largest_force: self.largest_force.max(b.largest_force),
            finite: self.finite && b.finite,
        }
    }

    fn relative_residual(&self) -> f64 {
        if self.largest_residual == 0.0 { 0.0 } else { self.largest_residual / self.largest_force }
    }
}

/// What is known of the equilibrium a state stands at, beside the state: what a restart needs to show it again.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Equilibrium<R> {
    /// Energies [J].
    pub energies: Energies,
    /// Internal minus applied force [N] of each node.
    pub residual: Vec<Vector<R>>,
}

/// Finds equilibria of one model. Holds constants, scratch and the [`Equilibrium`] last found; the next one comes from
/// the state alone.
pub struct DynamicRelaxation<'m, R> {
    model: &'m Model,
    settings: RelaxationSettings,
    owners: Vec<[u32; 3]>,
    /// Fictitious masses.
    mass: Vec<R>,
    /// Factor on them.
    slowness: f64,
    applied: AppliedForces<'m>,
    trial_history: Vec<History<R>>,
    /// u − u one iteration before.
    increment: Vec<Vector<R>>,
    /// Internal minus applied force now and one iteration before.
    residual: Vec<Vector<R>>,
    residual_before: Vec<Vector<R>>,
    sums: Vec<Sums>,
    /// The first hexahedron of the last trial of which a corner is turned inside out, as (solid, cell).
    folded: Option<(usize, usize)>,
    energies: Energies,
}

/// At the last equilibrium. Work is by the trapezoid between equilibria; kinetic energy, damping and velocities are none.
impl<R: Real> Observable<R> for DynamicRelaxation<'_, R> {
    fn energies(&self) -> &Energies {
        &self.energies
    }

    fn reaction(&self, constraint: usize) -> Vector<f64> {
        sum_owned(self.model, &self.owners, constraint, &self.residual)
    }

    fn nodal_reaction(&self, node: usize) -> Vector<f64> {
        owned_only(&self.owners[node], self.residual[node])
    }

    fn velocity(&self, _state: &State<R>, _node: usize) -> Vector<f64> {
        [0.0; 3]
    }
}

impl<'m, R: Real> DynamicRelaxation<'m, R> {
    /// A solver for a model.
    ///
    /// # Errors
    /// If constraints contradict each other.
    pub fn new(model: &'m Model, settings: RelaxationSettings) -> Result<Self, Contradiction> {
        let nodes = model.node_count();
        Ok(Self {
            model,
            settings,
            owners: model.constrained_components()?,
            mass: fictitious_masses(model).into_iter().map(R::of).collect(),
            slowness: 1.0,
            applied: AppliedForces::new(model),
            trial_history: vec![History::default(); model.solids.len()],
            increment: vec![[R::ZERO; 3]; nodes],
            residual: vec![[R::ZERO; 3]; nodes],
            residual_before: vec![[R::ZERO; 3]; nodes],
            sums: vec![Sums::default(); nodes.div_ceil(CHUNK)],
            folded: None,
            energies: Energies::default(),
        })
    }

    /// What is known of the last equilibrium.
    pub fn equilibrium(&self) -> Equilibrium<R> {
        Equilibrium { energies: self.energies, residual: self.residual.clone() }
    }

    /// Takes up an equilibrium of the same model, so that all that can be asked belongs to it.
    pub fn resume(&mut self, Equilibrium { energies, residual }: Equilibrium<R>) {
        (self.energies, self.residual) = (energies, residual);
    }

    /// Brings a state to the equilibrium at a later time [s]. On failure the state is that of the last equilibrium.
    ///
    /// # Errors
    /// If no equilibrium is found in load steps of the least allowed size.
    pub fn solve(&mut self, state: &mut State<R>, time: f64) -> Result<Convergence, RelaxationError> {
        self.solve_watched(state, time, &mut |_| ())
    }

    /// The same, telling now and then how far it is.
    ///
    /// # Errors
    /// If no equilibrium is found in load steps of the least allowed size.
    pub fn solve_watched(
        &mut self,
        state: &mut State<R>,
        time: f64,
        watch: &mut dyn FnMut(Iteration),
    ) -> Result<Convergence, RelaxationError> {
        let whole = time - state.time;
        let mut size = whole;
        let least = whole / f64::from(1_u32 << self.settings.halvings.min(30));
        let mut convergence = Convergence::default();
        self.slowness = 1.0;
        while state.time < time {
            let left = time - state.time;
            let end = if size >= left * (1.0 - 1e-9) { time } else { state.time + size };
            let before = state.displacement.clone();
            match self.load_step(state, end, &mut convergence, watch) {
                Ok(()) => convergence.parts += 1,
                Err(error) => {
                    state.displacement = before;
                    self.slowness *= 2.0;
                    size = 0.5 * (end - state.time);
                    if size < least * (1.0 - 1e-9) {
                        return Err(error.on_a_way(self.is_sudden([state.time, time])));
                    }
                }
            }
        }
        Ok(convergence)
    }

    /// Whether nothing that acts from outside changes between two times [s].
    fn is_sudden(&self, times: [f64; 2]) -> bool {
        let still = |[before, after]: [[f64; 2]; 2]| before == after;
        self.model.constraints.iter().all(|c| still(times.map(|time| c.motion.factors(time))))
            && self.model.loads.iter().all(|load| still(times.map(|time| [load.curve.value(time), 0.0])))
    }

    fn load_step(
        &mut self,
        state: &mut State<R>,
        end: f64,
        convergence: &mut Convergence,
        watch: &mut dyn FnMut(Iteration),
    ) -> Result<(), RelaxationError> {
        let mut forces = InternalForces::new(self.model, end - state.time);
        let start = self.start(state);
        self.increment.fill([R::ZERO; 3]);
        let (mut slowest, mut least) = (0.0, f64::INFINITY);
        let (mut greatest, mut reached) = (0.0_f64, f64::INFINITY);
        for iteration in 0..self.settings.iterations {
            let s = ((iteration + 1) as f64 / RAMP as f64).min(1.0);
            let time = state.time + (end - state.time) * s * s * (3.0 - 2.0 * s);
            let ramped = iteration >= RAMP;
            self.prescribe(state, if ramped { end } else { time });
            let sums = self.evaluate(&mut forces, state, if ramped { end } else { time }, iteration)?;
            convergence.iterations += 1;
            convergence.residual = sums.relative_residual();
            if ramped && convergence.residual <= self.settings.tolerance {
                self.check_corners(state, iteration, end)?;
                self.commit(&mut forces, state, &start, end);
                return Ok(());
            }
            if ramped && convergence.residual > RUNAWAY * least {
                self.increment.fill([R::ZERO; 3]);
                least = convergence.residual;
            }
            least = least.min(convergence.residual);
            greatest = greatest.max(convergence.residual);
            if ramped {
                reached = reached.min(convergence.residual);
            }
            if iteration % REPORT == 0 {
                let tolerance = self.settings.tolerance;
                let fraction = ((greatest / reached).ln() / (greatest / tolerance).ln()).clamp(0.0, 1.0);
                let (span, residual) = ([state.time, end], convergence.residual);
                watch(Iteration { span, number: iteration, residual, fraction });
            }
            let damping = if ramped {
                slowest = follow(slowest, &sums);
                2.0 * (slowest * HIGHEST / (slowest + HIGHEST)).sqrt()
            } else {
                RAMP_DAMPING
            };
            self.advance(state, damping);
        }
        let (body, node) = self.model.locate_node(self.total().residual_node as u32);
        Err(RelaxationError::NotConverged {
            body: self.model.bodies[body].name.clone(),
            node,
            residual: convergence.residual,
            tolerance: self.settings.tolerance,
            iterations: self.settings.iterations,
            time: end,
            sudden: false,
        })
    }

    /// Corners of hexahedra are judged in equilibria only: on the way there they may be out of place for a while.
    fn check_corners(&self, state: &State<R>, iterations: usize, time: f64) -> Result<(), RelaxationError> {
        let Some((solid, cell)) = self.folded else { return Ok(()) };
        let solid = &self.model.solids[solid];
        let worst = solid.cells.worst_corner(cell, |node| cast(state.displacement[node as usize]));
        let (node, determinant) = worst.unwrap_or((solid.cells.nodes(cell)[0], 0.0));
        Err(RelaxationError::Inverted {
            body: self.model.bodies[solid.body].name.clone(),
            element: solid.original[cell],
            node: self.model.locate_node(node).1,
            corner: true,
            determinant,
            iterations,
            time,
            sudden: false,
        })
    }

    /// Moves the prescribed components to their places at a time.
    fn prescribe(&self, state: &mut State<R>, time: f64) {
        for (index, constraint) in self.model.constraints.iter().enumerate() {
            for (at, &node) in constraint.nodes.iter().enumerate() {
                let place = constraint.motion.displacement(at, time);
                for c in (0..3).filter(|&c| self.owners[node as usize][c] == index as u32) {
                    state.displacement[node as usize][c] = R::of(place[c]);
                }
            }
        }
    }

    /// Residual forces of a trial state; the history in the state stays.
    fn evaluate(
        &mut self,
        forces: &mut InternalForces<R>,
        state: &State<R>,
        time: f64,
        iterations: usize,
    ) -> Result<Sums, RelaxationError> {
        self.take_committed_history(state);
        let found = forces.evaluate(&state.displacement, &mut self.trial_history);
        if let Some((solid, cell, determinant)) = found.inverted
            && determinant.is_finite()
        {
            let solid = &self.model.solids[solid];
            return Err(RelaxationError::Inverted {
                body: self.model.bodies[solid.body].name.clone(),
                element: solid.original[cell],
                node: self.model.locate_node(solid.cells.nodes(cell)[0]).1,
                corner: false,
                determinant,
                iterations,
                time,
                sudden: false,
            });
        }
        self.folded = found.folded;
        self.applied.update(time, &state.displacement);
        std::mem::swap(&mut self.residual, &mut self.residual_before);
        let (residual, before) = (&mut self.residual, &self.residual_before);
        let (increment, owners, mass, slowness) = (&self.increment, &self.owners, &self.mass, self.slowness);
        let (applied, forces) = (&self.applied, &*forces);
        (residual.par_chunks_mut(CHUNK).zip(&mut self.sums)).enumerate().for_each(
            |(task, (residual, sums))| {
                *sums = Sums { finite: true, ..Sums::default() };
                for (offset, r) in residual.iter_mut().enumerate() {
                    let node = task * CHUNK + offset;
                    let internal = forces.at(node);
                    *r = sub(internal, applied.at(node));
                    for c in 0..3 {
                        let (force, out) = (internal[c].to_f64().abs(), r[c].to_f64().abs());
                        sums.finite &= force.is_finite() && out.is_finite();
                        sums.largest_force = sums.largest_force.max(force);
                        if owners[node][c] != FREE {
                            continue;
                        }
                        if out > sums.largest_residual {
                            (sums.largest_residual, sums.residual_node) = (out, node);
                        }
                        let du = increment[node][c].to_f64();
                        sums.stiffness += du * (r[c] - before[node][c]).to_f64();
                        sums.mass += du * du * slowness * mass[node].to_f64();
                    }
                }
            },
        );
        let total = self.total();
        if !total.finite {
            let lost = |u: &Vector<R>| u.iter().any(|x| !x.to_f64().is_finite());
            let node = self.residual.iter().position(lost).unwrap_or(0);
            let (body, node) = self.model.locate_node(node as u32);
            return Err(RelaxationError::NotFinite {
                body: self.model.bodies[body].name.clone(),
                node,
                iterations,
                time,
                sudden: false,
            });
        }
        Ok(total)
    }

    fn total(&self) -> Sums {
        self.sums.iter().fold(Sums { finite: true, ..Sums::default() }, Sums::merge)
    }

    fn advance(&mut self, state: &mut State<R>, damping: f64) {
        let alpha = R::of(2.0 / (2.0 + damping) / self.slowness);
        let beta = R::of((2.0 - damping) / (2.0 + damping));
        let (residual, mass, owners) = (&self.residual, &self.mass, &self.owners);
        (state.displacement.par_iter_mut().zip(&mut self.increment))
            .enumerate()
            .with_min_len(CHUNK)
            .for_each(|(node, (u, du))| {
                for c in 0..3 {
                    if owners[node][c] == FREE {
                        du[c] = beta * du[c] - alpha * residual[node][c] / mass[node];
                        u[c] += du[c];
                    }
                }
            });
    }

    /// Takes a converged trial as the new state. Work is that of the mean of the forces before and after.
    fn commit(&mut self, forces: &mut InternalForces<R>, state: &mut State<R>, start: &Start<R>, end: f64) {
        let hourglass = forces.evaluate(&state.displacement, &mut state.history).hourglass;
        let work = &mut state.work;
        for (node, (u, u0)) in state.displacement.iter().zip(&start.displacement).enumerate() {
            let (after, before, residual) = (forces.at(node), start.internal[node], self.residual[node]);
            for c in 0..3 {
                let du = 0.5 * (u[c] - u0[c]).to_f64();
                let internal = (before[c] + after[c]).to_f64();
                let free = self.owners[node][c] == FREE;
                let unbalanced = if free { residual[c].to_f64() } else { 0.0 };
                work.internal += internal * du;
                work.external += (internal - unbalanced) * du;
            }
        }
        work.largest = work.largest.max(work.internal - hourglass).max(work.external.abs());
        self.energies = Energies {
            internal: work.internal - hourglass,
            hourglass,
            external: work.external,
            balance: (work.internal - work.external).abs() / work.largest.max(f64::MIN_POSITIVE),
            ..Energies::default()
        };
        state.time = end;
        state.steps += 1;
    }

    /// Displacements and internal forces at the equilibrium a load step starts from.
    fn start(&mut self, state: &State<R>) -> Start<R> {
        self.take_committed_history(state);
        // A step of no time leaves relaxing stresses as they are.
        let mut forces = InternalForces::new(self.model, f64::MIN_POSITIVE);
        forces.evaluate(&state.displacement, &mut self.trial_history);
        Start {
            displacement: state.displacement.clone(),
            internal: (0..self.model.node_count()).map(|node| forces.at(node)).collect(),
        }
    }

    fn take_committed_history(&mut self, state: &State<R>) {
        for (trial, committed) in self.trial_history.iter_mut().zip(&state.history) {
            trial.clone_from(committed);
        }
    }
}

/// The equilibrium a load step starts from.
struct Start<R> {
    displacement: Vec<Vector<R>>,
    /// Internal forces [N].
    internal: Vec<Vector<R>>,
}

/// The next estimate of the slowest mode's squared frequency.
fn follow(slowest: f64, sums: &Sums) -> f64 {
    let estimate = sums.stiffness / sums.mass;
    if !(estimate.is_finite() && estimate > 0.0) {
        return slowest;
    }
    let estimate = estimate.min(HIGHEST);
    if slowest == 0.0 { estimate } else { estimate.clamp(slowest * ADAPT[0], slowest * ADAPT[1]) }
}

/// Masses with which no mode is faster than 2/√s per iteration.
fn fictitious_masses(model: &Model) -> Vec<f64> {
    let mut mass = vec![0.0; model.node_count()];
    for solid in &model.solids {
        for cell in 0..solid.cells.len() {
            let nodes = solid.cells.nodes(cell);
            let stiffest = solid.cells.volume(cell)
                * solid.material.law.longitudinal_modulus()
                * solid.cells.gradient_square_sum(cell);
            for &node in nodes {
                mass[node as usize] += MASS_MARGIN / nodes.len() as f64 * stiffest;
            }
        }
    }
    mass
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_estimate_of_the_slowest_mode_moves_slowly() {
        let sums = |ratio| Sums { stiffness: ratio, mass: 1.0, ..Sums::default() };
        assert_eq!(follow(0.0, &sums(0.3)), 0.3);
        assert_eq!(follow(1.0, &sums(0.3)), 0.9);
        assert_eq!(follow(1.0, &sums(3.0)), 1.02);
        assert_eq!(follow(1.0, &sums(-1.0)), 1.0);
    }
}
