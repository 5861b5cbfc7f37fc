//! The constant part of a simulation.

use std::sync::Arc;

use pliant_mechanics::fingerprint;

use super::meshes;
use crate::coupled_surfaces::CoupledSurface;
use crate::failure::Failure;
use crate::participant_setup::ParticipantSetup;
use crate::penalty::PenaltyTie;

/// The participants of a simulation: constant while it runs.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Bodies that one stepper advances together: at least one participant.
    pub parts: Vec<ParticipantSetup>,
    /// Ties between participants.
    pub ties: Vec<PenaltyTie>,
    /// Nodes of participants that others touch.
    pub coupled_surfaces: Vec<CoupledSurface>,
}

impl Setup {
    /// Makes a setup of participants that meet at common instants. The number of steps of each becomes a
    /// multiple of the number of the participant with the fewest. All have the same duration.
    pub fn new(mut parts: Vec<ParticipantSetup>) -> Self {
        let common = parts.iter().map(|part| part.steps.number).min().unwrap_or(1);
        for part in &mut parts {
            let duration = part.steps.step * part.steps.number as f64;
            part.steps.meet(common, duration);
        }
        Self { parts, ties: Vec::new(), coupled_surfaces: Vec::new() }
    }

    /// A fingerprint of its bodies with their meshes, and of its tools and obstacles, by name; not of laws,
    /// loads or steps.
    pub fn fingerprint_of_bodies(&self) -> u64 {
        fn of(part: &ParticipantSetup) -> (Vec<(String, u64)>, Vec<&str>) {
            let things = part.method.contacts().into_iter().flat_map(|contacts| &contacts.rigids);
            (meshes(&part.model), things.map(|rigid| rigid.name.as_str()).collect())
        }
        fingerprint(&self.parts.iter().map(of).collect::<Vec<_>>())
    }

    /// Steps of each participant between two common instants.
    pub(super) fn ratios(&self) -> Vec<u64> {
        let numbers = || self.parts.iter().map(|part| part.steps.number.max(1));
        let common = numbers().min().unwrap_or(1);
        numbers().map(|number| number / common).collect()
    }

    /// True if the steps of a participant are cut where they are too long. The steps of a run can then be
    /// halved.
    pub fn cuts_steps(&self) -> bool {
        self.parts.iter().any(ParticipantSetup::cuts_steps)
    }

    /// True if shorter steps may avoid a failure: the failure is of a participant whose steps are cut.
    pub fn shorter_steps_may_avoid(&self, failure: &Failure) -> bool {
        let of_body = |part: &ParticipantSetup| {
            part.model.bodies.iter().any(|body| failure.body.as_deref() == Some(body.name.as_str()))
        };
        failure.kind.is_of_long_steps() && self.parts.iter().any(|part| part.cuts_steps() && of_body(part))
    }

    /// Length [s] of the step of all from a time [s] on.
    pub(super) fn step_from(&self, time: f64) -> f64 {
        let slowest = self.parts.iter().min_by_key(|part| part.steps.number);
        slowest.map_or(0.0, |part| part.steps.step_from(time))
    }
}

impl From<ParticipantSetup> for Setup {
    fn from(part: ParticipantSetup) -> Self {
        Self { parts: vec![part], ties: Vec::new(), coupled_surfaces: Vec::new() }
    }
}

impl From<ParticipantSetup> for Arc<Setup> {
    fn from(part: ParticipantSetup) -> Self {
        Self::new(part.into())
    }
}
