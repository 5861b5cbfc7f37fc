//! Quasi-static equilibrium by adaptive dynamic relaxation (Joldes, Wittek and Miller 2011). The nodes make a
//! fictitious damped motion, uⁿ⁺¹ = uⁿ + β (uⁿ − uⁿ⁻¹) − α M⁻¹ r. Here α = 2/(2+c) and β = (2−c)/(2+c). The
//! masses make every cell equally fast. The damping follows the slowest mode still moving: c = 2 √(A₀
//! A_m/(A₀ + A_m)) with A_m = 4. A₀ is a running Rayleigh quotient Δuᵀ Δr / Δuᵀ M Δu of the last increment.
//! Masses: m_a = s/n Σ_e V_e (λ+2μ) Σ|B|² over the cells at a node, n nodes per cell, s = 1.25.
//!
//! Time is the time of loads, motions and relaxing laws; inertia and damping of the bodies play no part.
//! Loads and motions that act at time 0 already come at once. The first equilibrium, reached from rest, is
//! the one of the instantaneous laws at time 0. A load step that fails is tried again in halves, with twice
//! the masses. History is committed only at convergence: inside a step every trial starts from the history of
//! the step before.
//!
//! *Energies.* Internal energy is ∫ S:dE: the energy Σ V Ψ stored by the instantaneous laws, less ∫ (f_Ψ −
//! f)·du. Here f_Ψ is the force of the instantaneous laws and f the relaxed one; Simpson's rule integrates
//! over each load step. So internal energy is the energy stored, and the energy that relaxing laws have
//! dissipated. External is the work of loads, reactions and prescribed motions, by the trapezoidal rule over
//! each load step. The two have nothing in common but the displacements. The error of a trapezium over b,
//! after one over a, is estimated from both: (T_ab − T_a − T_b) b²/(3 a (a + b)), with a and b the lengths of
//! the ways of all nodes.
//!
//! *Error of the displacements.* In double precision it is |M⁻¹ r|/(ω² |u|), in the norm of M, with ω² of the
//! slowest mode. In single precision round-off fills the residual, so the error is found from the work of the
//! residual along the load step.

mod accuracy;
mod path;
mod settings;

use std::sync::Arc;

use pliant_mechanics::load::Load;
use pliant_mechanics::model::{Constraint, Contradiction, Enclosed, FREE, Model};
use pliant_mechanics::tensor::{Vector, add, cast, scale, sub};
use pliant_mechanics::{Energies, StopFlag};
use rayon::prelude::*;

use self::accuracy::{Extremes, Search};
pub use self::path::{Equilibrium, Way};
use self::path::{Instant, LoadPath};
use self::settings::is_single;
pub use self::settings::{Convergence, Iteration, PATIENCE, RelaxationError, RelaxationSettings};
use crate::applied::AppliedForces;
use crate::collective::{Collective, Predicted, enclosed};
use crate::forces::InternalForces;
use crate::history::History;
use crate::lanes::LaneNumber;
use crate::recover::Recovery;
use crate::state::State;
use crate::stepper::{Observable, owned_only, sum_owned};

/// Nodes per parallel task.
const CHUNK: usize = 512;
/// s: margin of the fictitious masses against stiffening. Doubled when a load step fails: cells at a glued
/// edge stiffen many times over in compression. A motion too fast for such cells turns them inside out.
const MASS_MARGIN: f64 = 1.25;
/// Iterations over which a load step is brought on.
const RAMP: usize = 200;
/// c while the load is brought on.
const RAMP_DAMPING: f64 = 0.02;
/// Iterations from one report to the next.
const REPORT: usize = 20;
/// Multiple of the tolerance below which round-off of single precision makes the slowest mode look faster
/// than it is.
const ROUGH: f64 = 10.0;
/// Least ratio of the lengths of two ways at which the shorter one shows how forces bend along the longer
/// one.
const SHORTEST: f64 = 0.1;

/// Finds equilibria of one model. Holds constants, scratch and the [`Equilibrium`] last found; the next one
/// comes from the state alone.
pub struct DynamicRelaxation<R> {
    model: Arc<Model>,
    settings: RelaxationSettings,
    owners: Vec<[u32; 3]>,
    /// Fictitious masses.
    mass: Vec<R>,
    /// Factor on them.
    slowness: f64,
    applied: AppliedForces<R>,
    collectives: Vec<Collective>,
    /// Forces [N] of the constraints that bind nodes to each other, on every node; empty without any.
    bound: Vec<Vector<R>>,
    trial_history: Vec<History<R>>,
    /// u − u one iteration before.
    increment: Vec<Vector<R>>,
    /// Internal minus applied force now and one iteration before.
    residual: Vec<Vector<R>>,
    residual_before: Vec<Vector<R>>,
    sums: Vec<Extremes>,
    /// The first hexahedron of the last trial of which a corner is turned inside out, as (solid, cell).
    folded: Option<(usize, usize)>,
    stop: StopFlag,
    energies: Energies,
    way: Way<R>,
}

/// Number type of [`DynamicRelaxation`], with the functions compiled for it here and not again where a model
/// is solved.
pub trait RelaxedIn: LaneNumber {
    /// Runs [`DynamicRelaxation::new`].
    #[doc(hidden)]
    fn relaxation(
        model: Arc<Model>,
        settings: RelaxationSettings,
    ) -> Result<DynamicRelaxation<Self>, Contradiction>;

    /// Runs [`DynamicRelaxation::begin`].
    #[doc(hidden)]
    fn begin(
        relaxation: &mut DynamicRelaxation<Self>,
        state: &mut State<Self>,
    ) -> Result<(), RelaxationError>;

    /// Runs [`DynamicRelaxation::solve_watched`].
    #[doc(hidden)]
    fn solve(
        relaxation: &mut DynamicRelaxation<Self>,
        state: &mut State<Self>,
        time: f64,
        watch: &mut dyn FnMut(Iteration),
    ) -> Result<Convergence, RelaxationError>;
}

macro_rules! relaxed_in {
    ($number:ty) => {
        impl RelaxedIn for $number {
            fn relaxation(
                model: Arc<Model>,
                settings: RelaxationSettings,
            ) -> Result<DynamicRelaxation<Self>, Contradiction> {
                DynamicRelaxation::of_model(model, settings)
            }

            fn begin(
                relaxation: &mut DynamicRelaxation<Self>,
                state: &mut State<Self>,
            ) -> Result<(), RelaxationError> {
                relaxation.relax_at_start(state)
            }

            fn solve(
                relaxation: &mut DynamicRelaxation<Self>,
                state: &mut State<Self>,
                time: f64,
                watch: &mut dyn FnMut(Iteration),
            ) -> Result<Convergence, RelaxationError> {
                relaxation.relax_until(state, time, watch)
            }
        }
    };
}

relaxed_in!(f32);
relaxed_in!(f64);

/// Results at the last equilibrium. Kinetic energy, damping and velocities are zero.
impl<R: RelaxedIn> Observable<R> for DynamicRelaxation<R> {
    fn energies(&self) -> &Energies {
        &self.energies
    }

    fn reaction(&self, constraint: usize) -> Vector<f64> {
        match &self.model.constraints[constraint] {
            collective if collective.motion.is_collective() => {
                collective.mean_force(|node| self.residual[node as usize].map(R::to_f64))
            }
            _ => sum_owned(&self.model, &self.owners, constraint, &self.residual),
        }
    }

    fn enclosed(&self, constraint: usize) -> Option<Enclosed> {
        enclosed(&self.model, &self.collectives, constraint)
    }

    fn nodal_reaction(&self, node: usize) -> Vector<f64> {
        owned_only(&self.owners[node], self.residual[node])
    }

    fn velocity(&self, _state: &State<R>, _node: usize) -> Vector<f64> {
        [0.0; 3]
    }
}

impl<R: RelaxedIn> DynamicRelaxation<R> {
    /// A solver for a model.
    ///
    /// # Errors
    /// If constraints contradict each other.
    pub fn new(model: impl Into<Arc<Model>>, settings: RelaxationSettings) -> Result<Self, Contradiction> {
        R::relaxation(model.into(), settings)
    }

    fn of_model(model: Arc<Model>, settings: RelaxationSettings) -> Result<Self, Contradiction> {
        let nodes = model.node_count();
        Ok(Self {
            settings,
            owners: model.constrained_components()?,
            mass: fictitious_masses(&model).into_iter().map(R::of).collect(),
            slowness: 1.0,
            applied: AppliedForces::new(Arc::clone(&model)),
            collectives: Collective::of_model(&model),
            bound: vec![[R::ZERO; 3]; if model.collective().is_some() { nodes } else { 0 }],
            trial_history: vec![History::default(); model.solids.len()],
            increment: vec![[R::ZERO; 3]; nodes],
            residual: vec![[R::ZERO; 3]; nodes],
            residual_before: vec![[R::ZERO; 3]; nodes],
            sums: vec![Extremes::default(); nodes.div_ceil(CHUNK)],
            folded: None,
            stop: StopFlag::default(),
            energies: Energies::default(),
            way: Way::default(),
            model,
        })
    }

    /// Returns the record of the last equilibrium.
    pub fn equilibrium(&self) -> Equilibrium<R> {
        Equilibrium { energies: self.energies, residual: self.residual.clone(), way: self.way.clone() }
    }

    /// Replaces the forces [N] from outside, one per node, or none. They act in the coming equilibria until
    /// they are replaced. Their work is external.
    pub fn push(&mut self, forces: &[Vector<f64>]) {
        self.applied.push(forces);
    }

    /// Resumes from an equilibrium of the same model, so that all results belong to it.
    pub fn resume(&mut self, Equilibrium { energies, residual, way }: Equilibrium<R>) {
        (self.energies, self.residual, self.way) = (energies, residual, way);
    }

    /// Returns the way to the last equilibrium.
    pub fn way(&self) -> &Way<R> {
        &self.way
    }

    /// Brings a state at time 0 to its equilibrium there, if any load or motion acts then already. Does
    /// nothing otherwise, or if the equilibrium was found before. [`solve`](Self::solve) does this first.
    ///
    /// # Errors
    /// If no equilibrium is found, however small the parts in which loads and motions are brought on.
    pub fn begin(&mut self, state: &mut State<R>) -> Result<(), RelaxationError> {
        R::begin(self, state)
    }

    fn relax_at_start(&mut self, state: &mut State<R>) -> Result<(), RelaxationError> {
        let moved = |u: &Vector<R>| u.iter().any(|&x| x != R::ZERO);
        let acts = |load: &Load| load.curve.value(0.0) != 0.0;
        let at_rest = !state.displacement.iter().any(moved) && !self.model.loads.iter().any(acts);
        if !state.is_at_start() || self.way.equilibria > 0 || at_rest {
            return Ok(());
        }
        let before = state.displacement.clone();
        state.displacement.fill([R::ZERO; 3]);
        self.approach(state, LoadPath::Start, [0.0, 1.0], &mut Convergence::default(), &mut |_| ())
            .inspect_err(|_| state.displacement.copy_from_slice(&before))
    }

    /// Looks at a flag from now on, every few iterations, and stops where it asks.
    pub fn stop_on(&mut self, flag: &StopFlag) {
        self.stop = flag.clone();
    }

    /// Brings a state to the equilibrium at a later time [s]. On failure the state is the last equilibrium.
    ///
    /// # Errors
    /// If no equilibrium is found in load steps of the least allowed size.
    pub fn solve(&mut self, state: &mut State<R>, time: f64) -> Result<Convergence, RelaxationError> {
        self.solve_watched(state, time, &mut |_| ())
    }

    /// Runs like [`solve`](Self::solve), with a report of progress to `watch` every few iterations.
    ///
    /// # Errors
    /// If no equilibrium is found in load steps of the least allowed size.
    pub fn solve_watched(
        &mut self,
        state: &mut State<R>,
        time: f64,
        watch: &mut dyn FnMut(Iteration),
    ) -> Result<Convergence, RelaxationError> {
        R::solve(self, state, time, watch)
    }

    fn relax_until(
        &mut self,
        state: &mut State<R>,
        time: f64,
        watch: &mut dyn FnMut(Iteration),
    ) -> Result<Convergence, RelaxationError> {
        let mut convergence = Convergence::default();
        self.begin(state)?;
        self.approach(state, LoadPath::Time, [state.time, time], &mut convergence, watch)?;
        Ok(convergence)
    }

    /// Advances from one place of a path to another, in as many parts as needed.
    fn approach(
        &mut self,
        state: &mut State<R>,
        path: LoadPath,
        [mut reached, goal]: [f64; 2],
        convergence: &mut Convergence,
        watch: &mut dyn FnMut(Iteration),
    ) -> Result<(), RelaxationError> {
        let whole = goal - reached;
        let mut size = whole;
        let least = whole / f64::from(1_u32 << self.settings.halvings.min(30));
        self.slowness = 1.0;
        while reached < goal {
            let left = goal - reached;
            let end = if size >= left * (1.0 - 1e-9) { goal } else { reached + size };
            let before = state.displacement.clone();
            match self.load_step(state, path, [reached, end], convergence, watch) {
                Ok(()) => {
                    convergence.parts += 1;
                    reached = end;
                }
                Err(error) => {
                    state.displacement.copy_from_slice(&before);
                    if matches!(error, RelaxationError::Stopped { .. }) {
                        return Err(error);
                    }
                    self.slowness *= 2.0;
                    size = 0.5 * (end - reached);
                    if size < least * (1.0 - 1e-9) {
                        return Err(error);
                    }
                }
            }
        }
        Ok(())
    }

    fn load_step(
        &mut self,
        state: &mut State<R>,
        path: LoadPath,
        [from, to]: [f64; 2],
        convergence: &mut Convergence,
        watch: &mut dyn FnMut(Iteration),
    ) -> Result<(), RelaxationError> {
        let duration = path.duration(from, to);
        let end = path.instant(to);
        let mut forces = InternalForces::new(&self.model, duration);
        let start = self.start(state, path.instant(from));
        self.increment.fill([R::ZERO; 3]);
        self.bound.fill([R::ZERO; 3]);
        self.collectives.iter_mut().for_each(|collective| collective.enclosed.pressure = 0.0);
        let (single, tolerance) = (is_single::<R>(), self.settings.tolerance);
        let mut search = Search::default();
        for iteration in 0..self.settings.iterations {
            let ramped = iteration >= RAMP;
            let instant = if ramped { end } else { path.instant(brought_on([from, to], iteration)) };
            self.prescribe(state, instant);
            let sums = self.evaluate(&mut forces, state, instant, iteration)?;
            let residual = sums.relative_residual();
            convergence.iterations += 1;
            convergence.residual = residual;
            if ramped && single && iteration % REPORT == 0 {
                search.accuracy.note(self.left_along_the_way(&forces, state, &start));
            }
            if ramped && residual <= tolerance && search.accuracy.suffices(self.settings.displacement) {
                self.check_corners(state, iteration, end.time)?;
                let error = match single {
                    true => search.accuracy.mean(),
                    false => self.error_of_slowest(state, search.slowest),
                };
                self.way.displacement_error = self.way.displacement_error.max(error);
                self.commit(&mut forces, state, &start, end, duration);
                return Ok(());
            }
            if search.runs_away(residual, ramped) {
                self.increment.fill([R::ZERO; 3]);
            }
            if iteration % REPORT == 0 {
                let (span, fraction) = ([state.time, end.time], search.fraction(tolerance));
                watch(Iteration { span, number: iteration, residual, fraction });
                if self.stop.is_asked() {
                    return Err(RelaxationError::Stopped { time: end.time });
                }
            }
            let damping = match ramped {
                true => search.damping(&sums, single && residual < ROUGH * tolerance),
                false => RAMP_DAMPING,
            };
            self.advance(state, damping, instant);
        }
        let (body, node) = self.model.locate_node(self.total().residual_node as u32);
        Err(RelaxationError::NotConverged {
            body: self.model.bodies[body].name.clone(),
            node,
            residual: convergence.residual,
            tolerance,
            iterations: self.settings.iterations,
            time: end.time,
        })
    }

    /// Corners of hexahedra are judged in equilibria only: on the way there they may be out of place for a
    /// while.
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
        })
    }

    /// Returns the relative error of the displacements, |M⁻¹ r|/(ω² |u|) in the norm of the masses. `slowest`
    /// is ω², the squared frequency of the slowest mode.
    fn error_of_slowest(&self, state: &State<R>, slowest: f64) -> f64 {
        let (mut left, mut size) = (0.0, 0.0);
        for (node, u) in state.displacement.iter().enumerate() {
            let mass = self.slowness * self.mass[node].to_f64();
            for (c, x) in u.iter().enumerate() {
                size += mass * x.to_f64().powi(2);
                if self.owners[node][c] == FREE {
                    left += self.residual[node][c].to_f64().powi(2) / mass;
                }
            }
        }
        let error = (left / size).sqrt() / slowest;
        if error.is_finite() { error } else { 0.0 }
    }

    /// Returns the part of the way that is left. It is the work of the residual along the load step over the
    /// work of the forces from outside. Round-off averages out in this work.
    fn left_along_the_way(&self, forces: &InternalForces<R>, state: &State<R>, start: &Start<R>) -> f64 {
        let (mut left, mut work) = (0.0, 0.0);
        for (node, (u, u0)) in state.displacement.iter().zip(&start.displacement).enumerate() {
            let (internal, residual, before) = (forces.at(node), self.residual[node], start.outside[node]);
            for c in 0..3 {
                let motion = (u[c] - u0[c]).to_f64();
                let free = if self.owners[node][c] == FREE { residual[c].to_f64() } else { 0.0 };
                left += free * motion;
                work += (internal[c].to_f64() - free - before[c].to_f64()) * motion;
            }
        }
        if work > 0.0 { left / work } else { 0.0 }
    }

    /// Moves the prescribed components to their places at an instant.
    fn prescribe(&self, state: &mut State<R>, Instant { time, part }: Instant) {
        for (index, constraint) in self.model.constraints.iter().enumerate() {
            for (at, &node) in constraint.nodes.iter().enumerate() {
                let place = constraint.motion.displacement(at, time, part);
                for c in (0..3).filter(|&c| self.owners[node as usize][c] == index as u32) {
                    state.displacement[node as usize][c] = R::of(place[c]);
                }
            }
        }
        self.model.follow(&mut state.displacement);
    }

    /// Residual forces of a trial state; the history in the state stays.
    fn evaluate(
        &mut self,
        forces: &mut InternalForces<R>,
        state: &State<R>,
        Instant { time, part }: Instant,
        iterations: usize,
    ) -> Result<Extremes, RelaxationError> {
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
            });
        }
        self.folded = found.folded;
        self.applied.update(time, &state.displacement);
        for collective in &mut self.collectives {
            collective.renew(&self.model, &state.displacement, &mut self.bound);
        }
        std::mem::swap(&mut self.residual, &mut self.residual_before);
        let (residual, before) = (&mut self.residual, &self.residual_before);
        let (increment, owners, mass, slowness) = (&self.increment, &self.owners, &self.mass, self.slowness);
        let (applied, bound, forces, part) = (&self.applied, &self.bound, &*forces, R::of(part));
        (residual.par_chunks_mut(CHUNK).zip(&mut self.sums)).enumerate().for_each(
            |(task, (residual, sums))| {
                *sums = Extremes { finite: true, ..Extremes::default() };
                for (offset, r) in residual.iter_mut().enumerate() {
                    let node = task * CHUNK + offset;
                    let internal = forces.at(node);
                    *r = sub(internal, scale(applied.at(node), part));
                    if let Some(bound) = bound.get(node) {
                        *r = sub(*r, *bound);
                    }
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
            });
        }
        Ok(total)
    }

    fn total(&self) -> Extremes {
        self.sums.iter().fold(Extremes { finite: true, ..Extremes::default() }, Extremes::merge)
    }

    fn advance(&mut self, state: &mut State<R>, damping: f64, instant: Instant) {
        let alpha = R::of(2.0 / (2.0 + damping) / self.slowness);
        let beta = R::of((2.0 - damping) / (2.0 + damping));
        self.bind(state, [alpha, beta], instant);
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
        self.model.follow(&mut state.displacement);
    }

    /// Adds to the residual the forces of collective constraints, from the places that their nodes would
    /// reach without more such forces.
    fn bind(&mut self, state: &State<R>, [alpha, beta]: [R; 2], Instant { time, part }: Instant) {
        let Self { model, collectives, bound, residual, increment, mass, owners, .. } = self;
        for collective in collectives {
            let predicted = |node: u32| {
                let (at, mobility) = (node as usize, alpha / mass[node as usize]);
                let now = state.displacement[at];
                let held = owners[at].map(|owner| owner != FREE);
                let then = |c: usize| {
                    let way = beta * increment[at][c] - mobility * residual[at][c];
                    if held[c] { now[c] } else { now[c] + way }
                };
                Predicted {
                    now: cast(now),
                    displacement: [0, 1, 2].map(then).map(R::to_f64),
                    mobility: mobility.to_f64(),
                    held,
                }
            };
            let [factor, _] = model.constraints[collective.constraint].motion.factors(time);
            collective.find(model, predicted, part * factor);
            for (node, force) in collective.forces(model) {
                for c in 0..3 {
                    bound[node as usize][c] += R::of(force[c]);
                    residual[node as usize][c] -= R::of(force[c]);
                }
            }
        }
    }

    /// Removes the forces of collective constraints from the residual: it is internal minus applied force
    /// again.
    fn unbind(&mut self) {
        for (residual, bound) in self.residual.iter_mut().zip(&self.bound) {
            (0..3).for_each(|c| residual[c] += bound[c]);
        }
    }

    /// Returns the forces [N] that mean constraints on faces and enclosed volumes bear: work from outside.
    /// `resisting` is the force of each node beyond the applied ones.
    fn borne(&self, state: &State<R>, resisting: impl Fn(usize) -> Vector<R>) -> Vec<(u32, Vector<R>)> {
        let place = |node: u32| {
            let node = node as usize;
            add(self.model.rest[node], cast(state.displacement[node]))
        };
        let of = |constraint: &Constraint| {
            let resisting = |node: u32| cast(resisting(node as usize));
            let is_free = |node: u32, c: usize| self.owners[node as usize][c] == FREE;
            let forces = constraint.borne(place, resisting, is_free).into_iter().map(cast);
            constraint.nodes.iter().copied().zip(forces).collect::<Vec<_>>()
        };
        self.model.constraints.iter().flat_map(of).collect()
    }

    /// Takes a converged trial as the new state.
    fn commit(
        &mut self,
        forces: &mut InternalForces<R>,
        state: &mut State<R>,
        start: &Start<R>,
        end: Instant,
        duration: f64,
    ) {
        let given_up = self.given_up(forces, state, start, duration);
        let hourglass = forces.evaluate(&state.displacement, &mut state.history).hourglass;
        let stored = Recovery::new(&self.model, state).stored_energy();
        self.unbind();
        let mut borne = vec![[R::ZERO; 3]; self.bound.len()];
        self.borne(state, |node| self.residual[node])
            .into_iter()
            .for_each(|(node, force)| borne[node as usize] = force);
        let work = &mut state.work;
        let mut way = Vec::with_capacity(state.displacement.len());
        for (node, (u, u0)) in state.displacement.iter().zip(&start.displacement).enumerate() {
            let (before, residual) = (start.outside[node], self.residual[node]);
            let mut outside = forces.at(node);
            for c in (0..3).filter(|&c| self.owners[node][c] == FREE) {
                outside[c] -= residual[c];
            }
            if let Some(force) = borne.get(node) {
                outside = add(outside, *force);
            }
            let motion = sub(*u, *u0);
            for c in 0..3 {
                work.external += 0.5 * (before[c].to_f64() + outside[c].to_f64()) * motion[c].to_f64();
            }
            way.push([motion, sub(outside, before)]);
        }
        self.way.go_on(way);
        work.internal += stored + hourglass - start.stored - given_up;
        work.largest = work.largest.max(work.internal - hourglass).max(work.external.abs());
        self.energies = Energies {
            internal: work.internal - hourglass,
            hourglass,
            external: work.external,
            balance: (work.internal - work.external).abs() / work.largest.max(f64::MIN_POSITIVE),
            ..Energies::default()
        };
        state.steps += u64::from(end.time > state.time);
        state.time = end.time;
    }

    /// Returns ∫ (f_Ψ − f)·du [J] over a load step that came to an equilibrium. This is energy that
    /// instantaneous laws would have stored, but relaxing ones did not take up. By Simpson's rule; where a
    /// cell is inverted halfway on the straight line, by the trapezoidal rule.
    fn given_up(
        &mut self,
        forces: &mut InternalForces<R>,
        state: &State<R>,
        start: &Start<R>,
        duration: f64,
    ) -> f64 {
        if self.model.solids.iter().all(|solid| solid.material.prony.is_elastic()) || duration == 0.0 {
            return 0.0;
        }
        let half = R::of(0.5);
        let halfway: Vec<Vector<R>> = (start.displacement.iter().zip(&state.displacement))
            .map(|(u, v)| [0, 1, 2].map(|c| u[c] + half * (v[c] - u[c])))
            .collect();
        forces.set_step(&self.model, 0.5 * duration);
        let (middle, sound) = self.missing(forces, &halfway, state);
        forces.set_step(&self.model, duration);
        let (end, _) = self.missing(forces, &state.displacement, state);
        let [ends, between] = if sound { [1.0 / 6.0, 4.0 / 6.0] } else { [0.5, 0.0] };
        let of_node = |node: usize| -> f64 {
            let motion = sub(state.displacement[node], start.displacement[node]);
            let force = |c: usize| {
                ends * (start.missing[node][c] + end[node][c]).to_f64() + between * middle[node][c].to_f64()
            };
            (0..3).map(|c| force(c) * motion[c].to_f64()).sum()
        };
        (0..state.displacement.len()).map(of_node).sum()
    }

    /// f_Ψ − f [N] of the nodes in some place, a step of the forces after the state's history; whether no
    /// cell is inverted there.
    fn missing(
        &mut self,
        forces: &mut InternalForces<R>,
        displacement: &[Vector<R>],
        state: &State<R>,
    ) -> (Vec<Vector<R>>, bool) {
        self.take_committed_history(state);
        let nodes = 0..displacement.len();
        forces.evaluate(displacement, &mut self.trial_history);
        let relaxed: Vec<Vector<R>> = nodes.clone().map(|node| forces.at(node)).collect();
        let mut none = vec![History::default(); self.model.solids.len()];
        let inverted = forces.evaluate(displacement, &mut none).inverted;
        (nodes.map(|node| sub(forces.at(node), relaxed[node])).collect(), inverted.is_none())
    }

    /// The equilibrium that a load step starts from.
    fn start(&mut self, state: &State<R>, Instant { time, part }: Instant) -> Start<R> {
        // A step of no time leaves relaxing stresses as they are.
        let mut forces = InternalForces::new(&self.model, 0.0);
        let (missing, _) = self.missing(&mut forces, &state.displacement, state);
        self.take_committed_history(state);
        let hourglass = forces.evaluate(&state.displacement, &mut self.trial_history).hourglass;
        self.applied.update(time, &state.displacement);
        let outside = |node: usize| {
            let (internal, applied) = (forces.at(node), scale(self.applied.at(node), R::of(part)));
            [0, 1, 2].map(|c| if self.owners[node][c] == FREE { applied[c] } else { internal[c] })
        };
        let mut external: Vec<Vector<R>> = (0..self.model.node_count()).map(outside).collect();
        let resisting = |node: usize| sub(forces.at(node), scale(self.applied.at(node), R::of(part)));
        for (node, force) in self.borne(state, resisting) {
            external[node as usize] = add(external[node as usize], force);
        }
        Start {
            displacement: state.displacement.clone(),
            outside: external,
            missing,
            stored: Recovery::new(&self.model, state).stored_energy() + hourglass,
        }
    }

    fn take_committed_history(&mut self, state: &State<R>) {
        for (trial, committed) in self.trial_history.iter_mut().zip(&state.history) {
            trial.clone_from(committed);
        }
    }
}

/// Returns the point on the way of a load step that the load has reached at an iteration before [`RAMP`].
fn brought_on([from, to]: [f64; 2], iteration: usize) -> f64 {
    let s = (iteration + 1) as f64 / RAMP as f64;
    from + (to - from) * s * s * (3.0 - 2.0 * s)
}

/// The equilibrium a load step starts from.
struct Start<R> {
    displacement: Vec<Vector<R>>,
    /// Loads and reactions [N].
    outside: Vec<Vector<R>>,
    /// f_Ψ − f [N].
    missing: Vec<Vector<R>>,
    /// Energy [J] in the instantaneous laws and hourglass control.
    stored: f64,
}

/// Masses with which no mode is faster than 2/√s per iteration.
fn fictitious_masses(model: &Model) -> Vec<f64> {
    let mut mass = vec![0.0; model.node_count()];
    for solid in &model.solids {
        for cell in 0..solid.cells.len() {
            let nodes = solid.cells.nodes(cell);
            let stiffest = solid.cells.volume(cell)
                * solid.longitudinal_modulus()
                * solid.cells.gradient_square_sum(cell);
            for &node in nodes {
                mass[node as usize] += MASS_MARGIN / nodes.len() as f64 * stiffest;
            }
        }
    }
    model.give_down_stiffness(&mut mass);
    // Nodes that follow others feel no force.
    for (mass, follows) in mass.iter_mut().zip(model.followers()) {
        *mass = if follows { 1.0 } else { *mass };
    }
    mass
}
