//! Snapshots.

use pliant_explicit::Clock;
use pliant_mechanics::count::is_time;
use serde::{Deserialize, Serialize};

use super::Setup;
use crate::coupled_surfaces::CouplingMemory;
use crate::failure::Failure;
use crate::participant_setup::ParticipantSetup;
use crate::penalty::TieMemory;
use crate::snapshot::Snapshot;

/// The state of a simulation between two steps: a snapshot with all data that another simulation needs to
/// continue.
#[derive(Clone, Debug)]
pub struct SimulationState(pub(super) Vec<OwnState>, pub(super) Between);

/// State of ties and contacts between participants that a restart needs.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Between {
    pub(super) ties: TieMemory,
    pub(super) coupled_surfaces: CouplingMemory,
}

impl Between {
    /// True if participants have neither ties nor contacts.
    pub(super) fn is_empty(&self) -> bool {
        self.ties.is_empty() && self.coupled_surfaces.is_empty()
    }

    pub(super) fn fits(&self, setup: &Setup) -> bool {
        self.ties.fits(&setup.ties) && self.coupled_surfaces.fits(&setup.coupled_surfaces)
    }
}

/// The state of a participant.
#[derive(Clone, Debug)]
pub(super) struct OwnState {
    pub(super) snapshot: Snapshot,
    pub(super) clock: Option<Clock>,
    /// Length of its steps [s].
    pub(super) step: f64,
}

impl OwnState {
    /// Clock of its steps, and their length [s].
    pub(super) fn steps(&self) -> Option<(Clock, f64)> {
        self.clock.map(|clock| (clock, self.step))
    }
}

impl SimulationState {
    /// The state of each participant as bytes, as [`Simulation::encode`](crate::Simulation::encode) has it.
    ///
    /// # Errors
    /// If a state can't be encoded.
    pub fn encode(&self) -> postcard::Result<Vec<Vec<u8>>> {
        let Self(parts, between) = self;
        let alone = between.is_empty();
        let between = (!alone).then(|| postcard::to_stdvec(between));
        let of = |remembered: &OwnState| {
            let steps = postcard::to_stdvec(&remembered.steps())?;
            Ok([steps, remembered.snapshot.encode()?].concat())
        };
        parts.iter().map(of).chain(between).collect()
    }

    /// Its time [s].
    pub fn time(&self) -> f64 {
        self.0.first().map_or(0.0, |remembered| remembered.snapshot.at().0)
    }

    /// Halves the steps of all participants of its setup that [cut theirs](Setup::cuts_steps) from here on.
    /// False if no participant does, or after the steps were halved
    /// [three times](pliant_explicit::stability::MOST_HALVINGS).
    pub fn halve_steps(&mut self, setup: &Setup) -> bool {
        let mut cut = self.0.iter_mut().zip(&setup.parts).filter(|(_, part)| part.cuts_steps()).peekable();
        cut.peek().is_some() && cut.all(|(remembered, _)| remembered.snapshot.halve_steps())
    }

    /// Checks that the state belongs to a setup.
    ///
    /// # Errors
    /// If it does not.
    pub(super) fn check(&self, setup: &Setup) -> Result<(), Failure> {
        let Self(parts, between) = self;
        let is_own = parts.len() == setup.parts.len()
            && between.fits(setup)
            && parts.iter().zip(&setup.parts).all(|(remembered, part)| remembered.snapshot.fits(part));
        if is_own { Ok(()) } else { Err(Failure::input(&"the state is of another model")) }
    }

    /// The state whose participants were [encoded](crate::Simulation::encode); `None` where these bytes are
    /// none of this setup.
    pub fn decode<B: AsRef<[u8]>>(setup: &Setup, bytes: &[B]) -> Option<Self> {
        let (participants, between) = bytes.split_at_checked(setup.parts.len())?;
        let between: Between = match between {
            [] => Between::default(),
            [between] => postcard::from_bytes(between.as_ref()).ok()?,
            _ => return None,
        };
        let of = |(part, bytes): (&ParticipantSetup, &B)| {
            let (steps, bytes) = postcard::take_from_bytes::<Option<(Clock, f64)>>(bytes.as_ref()).ok()?;
            let snapshot = Snapshot::decode(part, bytes)?;
            let done = snapshot.at().1;
            let fits = |&(clock, step): &(Clock, f64)| {
                clock.steps <= done
                    && is_time(clock.since, step)
                    && clock.before.is_finite()
                    && step.is_finite()
            };
            if !steps.iter().all(fits) {
                return None;
            }
            Some(OwnState {
                snapshot,
                clock: steps.map(|of| of.0),
                step: steps.map_or(part.steps.step, |of| of.1),
            })
        };
        let parts = setup.parts.iter().zip(participants).map(of).collect::<Option<_>>()?;
        between.fits(setup).then_some(Self(parts, between))
    }
}
