//! How far a run is: what checkpoints and rollback points have beside the states of participants.

use pliant_mechanics::count;
use pliant_sim::Schedule;
use serde::{Deserialize, Serialize};

use crate::output::{History, Watched, Written};

/// How far a run and its outputs were.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Progressed {
    pub time: f64,
    #[serde(deserialize_with = "count::read")]
    pub steps: u64,
    pub wall_seconds: f64,
    /// The worst that was seen of each participant.
    pub watched: Vec<Watched>,
    /// Samples for plot and summary.
    pub history: History,
    pub sampling: Schedule,
    /// Of each output of the scene.
    pub outputs: Vec<(Schedule, Written)>,
}
