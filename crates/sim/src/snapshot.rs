//! The states of participants as they are kept: snapshots, and bytes of checkpoints.

use std::collections::VecDeque;

use nalgebra::{Quaternion, UnitQuaternion, Vector3, Vector4};
use pliant_contact::barrier::NodeTouch;
use pliant_contact::lag::Lag;
use pliant_contact::pose::Leg;
use pliant_contact::touch::{Contacts, Gripped};
use pliant_explicit::{Scalar, State};
use pliant_implicit::History;
use pliant_mechanics::count::{self, is_time};
use pliant_mechanics::tensor::Symmetric;
use pliant_mechanics::{Energies, Model};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::instant::Effort;
use crate::participant_setup::{Method, ParticipantSetup, Precision};
use crate::path::Path;
use crate::solver::Memory;

/// The state of a participant with all other data that a restart needs.
#[derive(Clone, Debug)]
pub(crate) enum Snapshot {
    /// In single precision.
    Single(State<f32>, Memory<f32>),
    /// In double precision.
    Double(State<f64>, Memory<f64>),
    /// State of shells, and of solids whose equations are solved.
    Implicit(Box<ImplicitState>),
}

impl Snapshot {
    /// Reads the snapshot of a participant from bytes; `None` if the bytes are no snapshot, or of another
    /// size.
    pub fn decode(part: &ParticipantSetup, bytes: &[u8]) -> Option<Self> {
        fn read<T: DeserializeOwned>(bytes: &[u8]) -> Option<T> {
            postcard::from_bytes(bytes).ok()
        }
        let snapshot = match (part.method.bodies(), part.method.precision()) {
            (Some(_), _) => Self::Implicit(read(bytes)?),
            (None, Precision::Single) => read(bytes).map(|(state, memory)| Self::Single(state, memory))?,
            (None, Precision::Double) => read(bytes).map(|(state, memory)| Self::Double(state, memory))?,
        };
        snapshot.fits(part).then_some(snapshot)
    }

    /// Returns the bytes for a checkpoint.
    ///
    /// # Errors
    /// If it can't be encoded.
    pub fn encode(&self) -> postcard::Result<Vec<u8>> {
        match self {
            Self::Single(state, memory) => postcard::to_stdvec(&(state, memory)),
            Self::Double(state, memory) => postcard::to_stdvec(&(state, memory)),
            Self::Implicit(state) => postcard::to_stdvec(state),
        }
    }

    /// Drives a tool or a jaw from the step on that follows.
    pub fn drive(&mut self, rigid: usize, leg: Leg) {
        match self {
            Self::Single(state, _) => state.drive(rigid, leg),
            Self::Double(state, _) => state.drive(rigid, leg),
            Self::Implicit(state) => {
                state.legs.retain(|(known, _)| *known as usize != rigid);
                state.legs.push((rigid as u32, leg));
            }
        }
    }

    /// Halves the steps of explicit solids; false where that cannot be done again.
    pub fn halve_steps(&mut self) -> bool {
        match self {
            Self::Single(state, _) => state.halve_steps(),
            Self::Double(state, _) => state.halve_steps(),
            Self::Implicit(_) => false,
        }
    }

    /// Its time [s], and the steps done.
    pub fn at(&self) -> (f64, u64) {
        match self {
            Self::Single(state, _) => (state.time, state.steps),
            Self::Double(state, _) => (state.time, state.steps),
            Self::Implicit(state) => (state.time, state.done),
        }
    }

    /// True if the snapshot has the sizes of a participant's model, and is of its method.
    pub fn fits(&self, part: &ParticipantSetup) -> bool {
        match self {
            Self::Single(state, memory) => fits(state, memory, part),
            Self::Double(state, memory) => fits(state, memory, part),
            Self::Implicit(state) => state.fits(part),
        }
    }
}

/// State that a resumed run needs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ImplicitState {
    /// Whole steps done, and the time [s] they end at.
    #[serde(deserialize_with = "count::read")]
    pub done: u64,
    pub time: f64,
    pub state: PlainState,
    pub before: Option<(Vec<f64>, PlainState)>,
    /// The state that an implicit step takes differences with.
    pub previous: Option<PlainState>,
    pub energies: Energies,
    pub effort: Effort,
    pub convergence: VecDeque<Iterated>,
    pub contact: Option<ContactState>,
    /// Ways of tools that are driven from outside.
    pub legs: Vec<(u32, Leg)>,
    pub path: Path,
    /// Lags of moved nodes with limited force behind their motion, and of volumes with limited pressure
    /// behind their growth.
    pub lags: Vec<Lag>,
    /// Values of the older matrix whose factors precondition the next one.
    pub factored: Option<Vec<f64>>,
    /// True if forces were found at the instant, so that their work is added up.
    pub entered: bool,
}

/// State of contacts that a resumed run needs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ContactState {
    /// Forces on nodes, six a node [N], and on the second side of each contact [N].
    pub forces: Vec<f64>,
    pub totals: Vec<[f64; 3]>,
    /// Their moments about the origin [N m].
    pub moments: Vec<[f64; 3]>,
    /// Energy of the barriers [J].
    pub energy: f64,
    /// Nodes that touch something, increasing.
    pub touches: Vec<NodeTouch>,
    /// Pairs of nodes in the pattern of the equations in addition to the pairs of cells: the order of sums
    /// depends on it.
    pub pairs: Vec<[u32; 2]>,
    /// Lags of tools with limited force behind their trajectories.
    pub lags: Vec<Lag>,
}

impl ContactState {
    /// True if the state belongs to a model with this number of nodes and these contacts.
    fn fits(&self, nodes: usize, contacts: &Contacts) -> bool {
        let limited = contacts.rigids.iter().enumerate();
        let limited = limited.filter(|(_, rigid)| rigid.trajectory.limit().is_some());
        let known = |node: u32| (node as usize) < nodes;
        self.forces.len() == 6 * nodes
            && self.touches.is_sorted_by(|a, b| a.node < b.node)
            && self.touches.iter().all(|touched| known(touched.node) && touched.slip.is_finite())
            && self.pairs.iter().flatten().all(|&node| known(node))
            && self.lags.iter().map(Lag::number).eq(limited.map(|(number, _)| number))
            && self.lags.iter().all(Lag::is_finite)
    }
}

impl ImplicitState {
    /// True if the state has the sizes of a participant's model and contacts.
    pub(crate) fn fits(&self, part: &ParticipantSetup) -> bool {
        let model: &Model = &part.model;
        let nodes = model.node_count();
        let before = self.before.iter().all(|(forces, state)| forces.len() == 6 * nodes && state.fits(model));
        let contact = match (&self.contact, part.method.contacts()) {
            (None, _) => true,
            (Some(contact), Some(contacts)) => contact.fits(nodes, contacts),
            (Some(_), None) => false,
        };
        let limited = match &part.method {
            Method::Static(bodies, _) | Method::Implicit(bodies, _) => Some(&bodies.model.force_limits),
            _ => None,
        };
        let limited = limited.into_iter().flat_map(|limits| limits.keys().copied());
        let lags = self.lags.iter().map(Lag::number).eq(limited) && self.lags.iter().all(Lag::is_finite);
        let times = [self.time, self.state.time];
        before
            && contact
            && lags
            && times.into_iter().all(|time| is_time(time, part.steps.step))
            && self.path.fits(nodes)
            && self.legs.iter().all(|(_, leg)| leg.is_finite())
            && self.previous.iter().all(|state| state.fits(model))
            && self.state.fits(model)
    }
}

/// A state in plain numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct PlainState {
    pub time: f64,
    pub load_factor: f64,
    pub position: Vec<[f64; 3]>,
    /// Quaternions (i, j, k, w).
    pub rotation: Vec<[f64; 4]>,
    pub velocity: Vec<[f64; 3]>,
    pub spin: Vec<[f64; 3]>,
    /// History of relaxing laws: whether it has begun, the tensors of each solid [Pa], and their work [J].
    pub history: (bool, Vec<Vec<Symmetric<f64>>>, Vec<f64>),
}

impl PlainState {
    pub fn of(state: &pliant_implicit::AssemblyState) -> Self {
        let plain = |vectors: &[Vector3<f64>]| vectors.iter().map(|&v| v.into()).collect();
        Self {
            time: state.time,
            load_factor: state.load_factor,
            position: plain(&state.position),
            rotation: state.rotation.iter().map(|q| q.coords.into()).collect(),
            velocity: plain(&state.velocity),
            spin: plain(&state.spin),
            history: {
                let History { begun, tensors, work } = state.history.clone();
                (begun, tensors, work)
            },
        }
    }

    pub fn fits(&self, model: &Model) -> bool {
        let nodes = [self.position.len(), self.rotation.len(), self.velocity.len(), self.spin.len()];
        let sizes = |tensors: &[Vec<Symmetric<f64>>]| tensors.iter().map(Vec::len).collect::<Vec<_>>();
        let (rest, (_, tensors, work)) = (History::at_rest(model), &self.history);
        nodes == [model.node_count(); 4]
            && sizes(tensors) == sizes(&rest.tensors)
            && work.len() == rest.work.len()
    }

    pub fn state(&self) -> pliant_implicit::AssemblyState {
        let vectors = |plain: &[[f64; 3]]| plain.iter().map(|&v| v.into()).collect();
        let rotation = |&q: &[f64; 4]| UnitQuaternion::new_unchecked(Quaternion::from(Vector4::from(q)));
        pliant_implicit::AssemblyState {
            time: self.time,
            load_factor: self.load_factor,
            position: vectors(&self.position),
            rotation: self.rotation.iter().map(rotation).collect(),
            velocity: vectors(&self.velocity),
            spin: vectors(&self.spin),
            history: {
                let (begun, tensors, work) = self.history.clone();
                History { begun, tensors, work }
            },
        }
    }
}

/// An iteration of Newton's method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Iterated {
    /// Step, counted from 1, and the attempt at it.
    #[serde(deserialize_with = "count::read")]
    pub step: u64,
    #[serde(deserialize_with = "count::read")]
    pub attempt: usize,
    /// The time that it was to reach [s].
    pub time: f64,
    #[serde(deserialize_with = "count::read")]
    pub iteration: usize,
    /// Residual, and what was allowed at the end of the attempt: [N] of static steps, over the largest force
    /// of implicit ones.
    pub residual: f64,
    pub allowed: f64,
    /// True if the attempt found its equilibrium.
    pub found: bool,
}

/// True if a state and its memory have the sizes of a participant's, and are of its method.
fn fits<R: Scalar>(state: &State<R>, memory: &Memory<R>, part: &ParticipantSetup) -> bool {
    let model: &Model = &part.model;
    let found = matches!(memory, Memory::Equilibrium(_));
    if found != matches!(part.method, Method::QuasiStatic { .. }) {
        return false;
    }
    let things = part.method.contacts().map_or(0, |contacts| contacts.rigids.len());
    let led = state.driven.iter().all(|(rigid, leg)| (*rigid as usize) < things && leg.is_finite());
    let lags = state.lags.iter().all(|lag| lag.number() < things && lag.is_finite());
    let grips = |held: &Gripped| {
        (held.rigid as usize) < things
            && (held.node as usize) < model.node_count()
            && held.at.iter().all(|x| x.is_finite())
    };
    let slides = state.slip.is_sorted_by(|(a, _), (b, _)| a < b)
        && state.slip.iter().all(|&(node, way)| (node as usize) < model.node_count() && way.is_finite());
    if !led || !lags || !slides || !state.gripped.iter().all(grips) {
        return false;
    }
    let rest = State::<R>::at_rest(model);
    let sizes = |state: &State<R>| {
        let history = state.history.iter().map(|h| (h.cells.len(), h.pressures.len()));
        let nodes = [&state.displacement, &state.increment, &state.reference].map(Vec::len);
        (nodes, history.collect::<Vec<_>>())
    };
    let keeps = |forces: &Vec<_>| forces.is_empty() || forces.len() == model.node_count();
    sizes(state) == sizes(&rest)
        && state.forces.iter().all(keeps)
        && state.forces[0].len() == state.forces[1].len()
        && is_time(state.time, part.steps.step)
        && state.stability.fits(model, state.steps)
        && memory.fits(model.node_count())
}
