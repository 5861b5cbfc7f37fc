//! The simulation of a world: participants brought from one common instant to the next, each at its own step.

use pliant_gpu::Wanted;
use pliant_mechanics::Energies;
use pliant_mechanics::grip::Grip;

use crate::output::{FailureSummary, Frame};
use crate::participant::{Kept, Participant, participant};
use crate::solver::LoadStepProgress;
use crate::world::World;

/// The participants of a world, under way.
pub(crate) struct Simulation {
    participants: Vec<Box<dyn Participant>>,
    /// Steps of each participant between two common instants.
    ratios: Vec<u64>,
}

impl Simulation {
    /// At the start of a world, or from kept states of all its participants.
    ///
    /// # Errors
    /// If a stepper can't be made.
    pub fn new(world: &World, kept: Option<Vec<Kept>>) -> Result<Self, FailureSummary> {
        let mut kept = kept.into_iter().flatten();
        let participants = world.participants.iter().map(|part| participant(part, kept.next()));
        Ok(Self::of(world, participants.collect::<Result<_, _>>()?))
    }

    /// Of participants that are there already.
    pub fn of(world: &World, participants: Vec<Box<dyn Participant>>) -> Self {
        let ratios = world.participants.iter().map(|part| world.ratio(part)).collect();
        Self { participants, ratios }
    }

    /// The participants, in the order of the world.
    pub fn participants(&self) -> &[Box<dyn Participant>] {
        &self.participants
    }

    /// Takes hold of points, by grips of each participant. False where a stepper knows none.
    pub fn hold(&mut self, grips: &[Vec<Grip>]) -> bool {
        let mut all = true;
        for (participant, own) in self.participants.iter_mut().zip(grips) {
            all &= participant.hold(own);
        }
        all
    }

    /// Brings all states back to ordinary memory.
    ///
    /// # Errors
    /// If a device fails.
    pub fn bring_back(&mut self) -> Result<(), FailureSummary> {
        self.participants.iter_mut().try_for_each(|participant| participant.bring_back())
    }

    /// The participant where all bodies go together.
    pub fn only(&mut self) -> Option<&mut dyn Participant> {
        match &mut self.participants[..] {
            [one] => Some(one.as_mut()),
            _ => None,
        }
    }

    /// Time of the common instant [s].
    pub fn time(&self) -> f64 {
        self.participants[0].time()
    }

    /// Common instants since the start.
    pub fn steps(&self) -> u64 {
        self.participants[0].steps() / self.ratios[0]
    }

    /// Finds forces of all participants at the instant.
    ///
    /// # Errors
    /// If those of one can't be found.
    pub fn evaluate(&mut self, wanted: Wanted) -> Result<(), FailureSummary> {
        self.participants.iter_mut().try_for_each(|participant| participant.evaluate(wanted))
    }

    /// Goes so many common instants on from an evaluated one, not more than the stride.
    ///
    /// # Errors
    /// If a step of a participant can't be taken.
    pub fn advance(
        &mut self,
        steps: u64,
        watch: &mut dyn FnMut(LoadStepProgress),
    ) -> Result<(), FailureSummary> {
        for (participant, ratio) in self.participants.iter_mut().zip(&self.ratios) {
            let mut left = steps * ratio;
            loop {
                let now = left.min(participant.stride());
                participant.advance(now, watch)?;
                left -= now;
                if left == 0 {
                    break;
                }
                participant.evaluate(Wanted::Energies)?;
            }
        }
        Ok(())
    }

    /// The most common instants that it passes in one go.
    pub fn stride(&self) -> u64 {
        let of = self.participants.iter().zip(&self.ratios);
        of.map(|(participant, ratio)| participant.stride() / ratio).min().unwrap_or(1).max(1)
    }

    /// All participants as outputs read them.
    pub fn frames<'a>(&'a self, world: &'a World) -> Vec<Frame<'a>> {
        let of = world.participants.iter().zip(&self.participants);
        of.map(|(part, participant)| Frame { part, now: participant.as_ref() }).collect()
    }

    /// Energies of all participants together; the worst of their balances.
    pub fn energies(&self) -> Energies {
        total(self.participants.iter().map(|participant| participant.energies()))
    }

    /// Why it is at its end before the time of the scene is over.
    pub fn ended(&self) -> Option<&str> {
        self.participants.iter().find_map(|participant| participant.ended())
    }
}

/// The sum of energies, and the worst of their balances.
pub(crate) fn total(all: impl Iterator<Item = Energies>) -> Energies {
    let add = |a: Energies, b: Energies| Energies {
        kinetic: a.kinetic + b.kinetic,
        internal: a.internal + b.internal,
        damping: a.damping + b.damping,
        hourglass: a.hourglass + b.hourglass,
        external: a.external + b.external,
        balance: a.balance.max(b.balance),
    };
    all.reduce(add).unwrap_or_default()
}
