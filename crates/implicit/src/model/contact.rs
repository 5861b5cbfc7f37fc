//! Contacts of a model: pairs of surfaces that touch each other by barriers, with their settings.

use std::sync::Arc;

use pliant_contact::barrier::BarrierSettings;
use pliant_contact::touch::Contacts;

/// Contacts by a barrier: surfaces never go into each other. Rigid things move as their courses say.
#[derive(Clone, Debug)]
pub struct ContactModel {
    /// Who touches whom.
    pub contacts: Arc<Contacts>,
    /// Settings of each contact.
    pub settings: Vec<BarrierSettings>,
    /// Number of times that triangles of shells are divided into four on their curved surface, for each
    /// contact; empty: never.
    pub levels: Vec<u8>,
    /// True if each accepted state is searched for edges that go through triangles, which would be an error
    /// of the program.
    pub check_intersections: bool,
}
