//! The state: everything that changes in a run. `Clone` is a snapshot.

use pliant_contact::lag::Lag;
use pliant_contact::pose::Leg;
use pliant_contact::touch::Gripped;
use pliant_mechanics::count;
use pliant_mechanics::model::{self, Constraint, FREE, Model, Motion, fill, placed};
use pliant_mechanics::tensor::{Vector, add};
use serde::{Deserialize, Serialize};

use crate::history::History;
use crate::lanes::LaneNumber;
use crate::stability_record::Stability;
use crate::substeps::MOST_HALVINGS;

/// State that a stepper advances.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct State<R> {
    /// Time [s].
    pub time: f64,
    /// Whole steps done.
    #[serde(deserialize_with = "count::read")]
    pub steps: u64,
    /// Displacements u of the nodes [m].
    pub displacement: Vec<Vector<R>>,
    /// The last increments, u − u one step before [m].
    pub increment: Vec<Vector<R>>,
    /// Internal forces [N] at the last two instants, the later ones first; empty where no stepper damps by
    /// them.
    pub forces: [Vec<Vector<R>>; 2],
    /// History of each solid.
    pub history: Vec<History<R>>,
    /// Energies so far.
    pub work: Work,
    /// Record of the cuts of steps, and of the limits found.
    pub stability: Stability,
    /// Displacements [m] of the state whose critical time step is known, at first rest; see
    /// [`Monitor`](crate::stability::Monitor).
    pub reference: Vec<Vector<R>>,
    /// Tools and jaws that were driven from outside, by their place among the rigid things of the contacts.
    pub driven: Vec<(u32, Leg)>,
    /// Lags of the rigid things whose force is limited; empty before the first evaluation.
    pub lags: Vec<Lag>,
    /// Nodes that jaws hold.
    pub gripped: Vec<Gripped>,
    /// Nodes that touch something, increasing, with how far each has slid on it since its touch began [m].
    pub slip: Vec<(u32, f64)>,
    /// True if forces were found at the instant. Their work is then entered, laws have relaxed to the
    /// instant, and the limit of the step is known. A stepper that finds the forces again enters nothing
    /// twice.
    pub evaluated: bool,
}

/// Work accumulated over the steps [J].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Work {
    /// ∫ f_int · du, stored and viscous part and hourglass together, to the current time.
    pub internal: f64,
    /// Work of loads and of prescribed motions, to the current time, and the kinetic energy given at time 0.
    pub external: f64,
    /// Energy taken by damping, to the current time.
    pub damping: f64,
    /// Energy that changes of the step length added, to the current time.
    pub step_changes: f64,
    /// Running maximum of kinetic energy, internal and |external| work.
    pub largest: f64,
    /// ⅛ Δt² Σ m|a|² at the start, which the mean velocity of the method keeps from the kinetic energy from
    /// then on.
    pub(crate) at_start: f64,
    /// Steps in a row that were off balance.
    #[serde(deserialize_with = "count::read")]
    pub(crate) steps_off_balance: u32,
    /// True if the model was changed, and the energies have not been balanced since.
    pub(crate) shaken: bool,
    /// First half of the internal work of the step under way.
    pub(crate) pending_internal: f64,
    /// First half of the external work of the step under way.
    pub(crate) pending_external: f64,
    /// Energy that the step under way adds by its length, where it differs from the one before.
    pub(crate) pending_change: f64,
    /// Damping power [W] at the last evaluation.
    pub(crate) damping_power: f64,
}

/// Puts nodes with a prescribed mean or around a prescribed volume where they are at time 0, by displacements
/// [m].
fn place_collective(
    model: &Model,
    constraint: &Constraint,
    owners: &[[u32; 3]],
    displacement: &mut [Vector<f64>],
) {
    let missing = constraint.missing_mean(0.0, |node| displacement[node as usize]);
    for &node in &constraint.nodes {
        displacement[node as usize] = add(displacement[node as usize], missing);
    }
    let Motion::Volume { enclosure, by, curve } = &constraint.motion else { return };
    let volume = |displacement: &[Vector<f64>], gradient: &mut [f64]| {
        let place = |at: u32| {
            let node = constraint.nodes[at as usize] as usize;
            add(model.rest[node], displacement[node])
        };
        let mut along = vec![[0.0; 3]; constraint.nodes.len()];
        let volume = enclosure.add_gradient(place, &mut along);
        for ((to, from), &node) in gradient.chunks_exact_mut(3).zip(along).zip(&constraint.nodes) {
            (0..3).for_each(|c| to[c] = if owners[node as usize][c] == FREE { from[c] } else { 0.0 });
        }
        volume
    };
    let advance = |displacement: &mut [Vector<f64>], gradient: &[f64], part: f64| {
        for (by, &node) in gradient.chunks_exact(3).zip(&constraint.nodes) {
            (0..3).for_each(|c| displacement[node as usize][c] += part * by[c]);
        }
    };
    let mut gradient = vec![0.0; 3 * constraint.nodes.len()];
    let wanted = volume(&vec![[0.0; 3]; model.node_count()], &mut gradient) + by * curve.value(0.0);
    fill(displacement, wanted, &mut gradient, volume, advance);
}

impl<R: LaneNumber> State<R> {
    /// Makes the state at rest at time 0. Prescribed nodes and their followers are where their motion starts.
    /// Nodes of a mean shift together, nodes around a prescribed volume along its gradient.
    pub fn at_rest(model: &Model) -> Self {
        let mut displacement = vec![[0.0; 3]; model.node_count()];
        if let Ok(owners) = model.constrained_components() {
            let amplitudes = model.amplitudes(&owners);
            for ((u, owner), amplitudes) in displacement.iter_mut().zip(&owners).zip(amplitudes) {
                for component in (0..3).filter(|&c| owner[c] != FREE) {
                    let motion = &model.constraints[owner[component] as usize].motion;
                    u[component] = placed(model::component(&amplitudes, component), motion.factors(0.0));
                }
            }
            for constraint in &model.constraints {
                place_collective(model, constraint, &owners, &mut displacement);
            }
        }
        model.follow(&mut displacement);
        let displacement = displacement.into_iter().map(|u| u.map(R::of)).collect();
        Self {
            time: 0.0,
            steps: 0,
            increment: vec![[R::ZERO; 3]; model.node_count()],
            reference: vec![[R::ZERO; 3]; model.node_count()],
            displacement,
            forces: [Vec::new(), Vec::new()],
            history: model.solids.iter().map(History::at_rest).collect(),
            work: Work::default(),
            stability: Stability::default(),
            driven: Vec::new(),
            lags: Vec::new(),
            gripped: Vec::new(),
            slip: Vec::new(),
            evaluated: false,
        }
    }

    /// Makes room for the internal forces of the last two instants.
    pub fn keep_forces(&mut self) {
        let nodes = self.displacement.len();
        if self.forces[0].len() != nodes {
            self.forces = [(); 2].map(|()| vec![[R::ZERO; 3]; nodes]);
            self.stability.extrapolation = None;
        }
    }

    /// Returns the way of a tool or a jaw that was driven; `rigid` counts among the rigid things of the
    /// contacts.
    pub fn leg(&self, rigid: usize) -> Option<&Leg> {
        self.driven.iter().find(|(number, _)| *number as usize == rigid).map(|(_, leg)| leg)
    }

    /// Returns the lag of a rigid thing behind its trajectory, if its force is limited.
    pub fn lag(&self, rigid: usize) -> Option<&Lag> {
        self.lags.iter().find(|lag| lag.number() == rigid)
    }

    /// Drives a tool or a jaw from the step on that follows.
    pub fn drive(&mut self, rigid: usize, leg: Leg) {
        self.driven.retain(|(number, _)| *number as usize != rigid);
        self.driven.push((rigid as u32, leg));
    }

    /// Takes the state from a model to another one of the same mesh, after a (sub)step of `before` [s].
    /// Displacements, velocities and the history of relaxing laws stay. The kinetic energy of mass that comes
    /// or goes is external work.
    pub fn change_model(&mut self, from: &Model, to: &Model, before: f64) {
        let speed_squared = |u: &Vector<R>| u.iter().map(|x| (x.to_f64() / before).powi(2)).sum::<f64>();
        let gained = self
            .increment
            .iter()
            .enumerate()
            .map(|(node, u)| 0.5 * (to.inertia(node) - from.inertia(node)) * speed_squared(u));
        self.work.shake(gained.sum::<f64>());
        self.stability.forget();
        self.reference.fill([R::ZERO; 3]);
    }

    /// Halves all steps from here on, in a run that [cuts steps](crate::stability::OnUnstable::Substep);
    /// false where that was done [`MOST_HALVINGS`] times.
    pub fn halve_steps(&mut self) -> bool {
        let may = self.stability.halvings < MOST_HALVINGS;
        self.stability.halvings += u32::from(may);
        may
    }

    /// True before the first step.
    pub fn is_at_start(&self) -> bool {
        self.steps == 0 && self.is_between_steps()
    }

    /// True at the end of a whole step, false between the parts of one.
    pub fn is_between_steps(&self) -> bool {
        self.stability.done == 0
    }
}
