//! Participants at their start, or from a state on.

use pliant_explicit::{Clock, State};
use pliant_mechanics::Model;

use crate::assembled::Assembled;
use crate::failure::Failure;
use crate::part::{Explicit, Method, Part, Precision};
use crate::participant::Participant;
use crate::snapshot::Snapshot;
use crate::solids::{Numeric, Solids};
use crate::solver::Memory;

/// A participant at its start.
///
/// # Errors
/// If its stepper can't be made.
pub(crate) fn begin(part: &Part) -> Result<Box<dyn Participant>, Failure> {
    part.has_room()?;
    Ok(match (part.method.bodies(), part.method.precision()) {
        (Some(bodies), _) => Box::new(Assembled::new(part, bodies)?),
        (None, Precision::Single) => Box::new(Solids::<f32>::new(part, at_start(part)?)?),
        (None, Precision::Double) => Box::new(Solids::<f64>::new(part, at_start(part)?)?),
    })
}

/// The state of solids at their start.
///
/// # Errors
/// If the displacements that are given are of another model.
fn at_start<R: Numeric>(part: &Part) -> Result<State<R>, Failure> {
    let mut state = State::at_rest(&part.model);
    if let Method::Explicit(Explicit { start: Some(start), .. }) = &part.method {
        if start.len() != state.displacement.len() {
            return Err(Failure::input(&"the displacements at the start are of another model"));
        }
        for (to, from) in state.displacement.iter_mut().zip(start.iter()) {
            *to = from.map(R::of);
        }
    }
    Ok(state)
}

/// The steps of a run whose state continues with other values: their clock, their length [s], and the model.
pub(crate) struct Before<'a> {
    pub clock: Clock,
    pub step: f64,
    /// The model of the run before, where it is another one.
    pub model: Option<&'a Model>,
}

/// Makes a participant that continues from a state of a run of the same mesh. Explicit steps need the clock
/// and length of the steps before. `None` where this participant has another solver, precision or size.
///
/// # Errors
/// If its stepper can't be made.
pub(crate) fn go_on(
    part: &Part,
    snapshot: Snapshot,
    before: Option<Before<'_>>,
) -> Result<Option<Box<dyn Participant>>, Failure> {
    if !snapshot.fits(part) {
        return Ok(None);
    }
    part.has_room()?;
    Ok(match (snapshot, part.method.bodies(), part.method.precision()) {
        (Snapshot::Implicit(state), Some(bodies), _) => {
            let mut participant = Assembled::new(part, bodies)?;
            participant.resume(*state)?;
            Some(Box::new(participant))
        }
        (Snapshot::Single(state, memory), None, Precision::Single) => {
            Some(resumed(part, state, memory, before)?)
        }
        (Snapshot::Double(state, memory), None, Precision::Double) => {
            Some(resumed(part, state, memory, before)?)
        }
        _ => None,
    })
}

fn resumed<R: Numeric>(
    part: &Part,
    mut state: State<R>,
    memory: Memory<R>,
    before: Option<Before<'_>>,
) -> Result<Box<dyn Participant>, Failure> {
    if let Some(Before { model: Some(model), clock, .. }) = &before
        && model.fingerprints() != part.model.fingerprints()
    {
        state.change_model(model, &part.model, clock.before);
    }
    let mut solids = Solids::new(part, state)?;
    solids.resume(memory, before.map(|before| (before.clock, before.step)));
    Ok(Box::new(solids))
}
