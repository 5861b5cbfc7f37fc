//! Progress of a run, which checkpoints and rollback points hold besides the states of participants.

use pliant_mechanics::count;
use pliant_sim::Schedule;
use serde::{Deserialize, Serialize};

use crate::output::{History, Watched, Written};

/// Progress of a run and its outputs.
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
    /// Schedule and progress of each output of the scene.
    pub outputs: Vec<(Schedule, Written)>,
}
