//! What a hand did, repeated: before the same steps, so that it comes to the same bits.

use pliant_mechanics::grip::Grip;
use pliant_scene::live;
use serde::Serialize;

use crate::hand::Recording;
use crate::session::Stage;

/// What a replay came to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Replayed {
    /// Simulated time [s].
    pub time: f64,
    /// A fingerprint of the state.
    pub fingerprint: u64,
    /// The largest force of the hand [N].
    pub largest_force: f64,
    /// The point that the hand holds in the end [m] and the force on it [N].
    pub held: Option<[[f64; 3]; 2]>,
    /// Force [N] of each constraint in the end.
    pub reactions: Vec<[f64; 3]>,
}

/// Repeats a recording.
///
/// # Errors
/// Why the run could not go on.
pub fn replay(stage: &Stage, recording: &Recording) -> Result<Replayed, String> {
    let mut live = live(&stage.scene, &stage.built, &stage.plan).map_err(|failure| failure.message)?;
    let mut hand: Option<Grip> = None;
    let mut moves = recording.moves.iter().peekable();
    let mut largest_force = 0.0_f64;
    let mut steps = 0;
    loop {
        while let Some((_, grips, by_hand)) = moves.next_if(|(before, ..)| *before <= steps) {
            live.hold(grips);
            hand = grips.first().filter(|_| *by_hand).cloned();
        }
        if steps >= recording.steps {
            break;
        }
        let next = moves.peek().map_or(recording.steps, |(before, ..)| (*before).min(recording.steps));
        steps += live.advance(next - steps).map_err(|failure| failure.message)?;
        if let Some(grip) = &hand {
            let [_, [x, y, z]] = live.pulled(grip);
            largest_force = largest_force.max((x * x + y * y + z * z).sqrt());
        }
    }
    let (time, fingerprint) = (live.time(), live.fingerprint());
    // Reactions belong to the instant at which forces are found.
    live.mesh().map_err(|failure| failure.message)?;
    let reactions = (0..stage.built.model.constraints.len()).map(|index| live.reaction(index)).collect();
    let held = hand.map(|grip| live.pulled(&grip));
    Ok(Replayed { time, fingerprint, largest_force, held, reactions })
}
