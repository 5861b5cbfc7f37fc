//! A participant under way: bodies that one stepper advances together, with their state. Its stepper and number type stay hidden here.

use pliant_explicit::{Clock, State, Wanted};
#[cfg(feature = "gpu")]
use pliant_gpu::GpuStepper;
use pliant_mechanics::Model;
use pliant_mechanics::grip::Grip;
use serde::de::DeserializeOwned;

use crate::failure::Failure;
use crate::implicit::{Implicit, ImplicitState};
use crate::instant::Instant;
use crate::part::{Part, Precision};
use crate::solids::{Numeric, Solids, fits};
use crate::solver::{LoadStepProgress, Memory};

/// The state of a participant with all that a restart needs beside it.
#[derive(Clone, Debug)]
pub(crate) enum Kept {
    /// In single precision.
    Single(State<f32>, Memory<f32>),
    /// In double precision.
    Double(State<f64>, Memory<f64>),
    /// Of shells, and of solids whose equations are solved.
    Implicit(Box<ImplicitState>),
}

impl Kept {
    /// That of a participant from its bytes; `None` where these are none, or of another size.
    pub fn decode(part: &Part, bytes: &[u8]) -> Option<Self> {
        fn read<T: DeserializeOwned>(bytes: &[u8]) -> Option<T> {
            postcard::from_bytes(bytes).ok()
        }
        let kept = match (part.method.bodies(), part.method.precision()) {
            (Some(_), _) => Self::Implicit(read(bytes)?),
            (None, Precision::Single) => read(bytes).map(|(state, memory)| Self::Single(state, memory))?,
            (None, Precision::Double) => read(bytes).map(|(state, memory)| Self::Double(state, memory))?,
        };
        kept.fits(part).then_some(kept)
    }

    /// Whether it has the sizes of a participant's model, and is of its method.
    fn fits(&self, part: &Part) -> bool {
        match self {
            Self::Single(state, memory) => fits(state, memory, part),
            Self::Double(state, memory) => fits(state, memory, part),
            Self::Implicit(state) => state.fits(part.model.node_count()),
        }
    }
}

/// Bodies that one stepper advances together.
pub(crate) trait Participant: Instant + Send {
    /// Finds forces, and with them all that can be asked, at the instant.
    ///
    /// # Errors
    /// If forces can't be found there.
    fn evaluate(&mut self, wanted: Wanted) -> Result<(), Failure>;

    /// Goes so many steps on from an evaluated instant, not more than its stride. `watch` hears how far it is, if that takes long.
    ///
    /// # Errors
    /// If a step can't be taken.
    fn advance(&mut self, steps: u64, watch: &mut dyn FnMut(LoadStepProgress)) -> Result<(), Failure>;

    /// The most steps it takes in one go: more than one where the state lies on a device.
    fn stride(&self) -> u64 {
        1
    }

    /// The stepper of a state on a GPU, and the state; `None` of a state in ordinary memory.
    #[cfg(feature = "gpu")]
    fn on_device(&mut self) -> Option<(&mut GpuStepper, &mut State<f32>)> {
        None
    }

    /// Takes hold of points: these grips and no others act from the next evaluation on. False of a stepper that knows none.
    fn hold(&mut self, grips: &[Grip]) -> bool;

    /// The stiffness [N/m] up to which a grip leaves steps stable; infinite where they are stable with any.
    fn stiffest(&self, grip: &Grip) -> f64;

    /// The point of a grip now [m], and its force on the body [N].
    fn pulled(&self, grip: &Grip) -> [[f64; 3]; 2];

    /// Brings the state back to ordinary memory, whole.
    ///
    /// # Errors
    /// If a device fails.
    fn bring_back(&mut self) -> Result<(), Failure> {
        Ok(())
    }

    /// The state and what a restart needs beside it, after [`advance`](Self::advance).
    fn kept(&self) -> Kept;

    /// The same as bytes of a checkpoint.
    ///
    /// # Errors
    /// If it can't be encoded.
    fn encode(&self) -> postcard::Result<Vec<u8>>;

    /// How its steps are counted, of a stepper whose increments tell velocities.
    fn clock(&self) -> Option<Clock> {
        None
    }

    /// A fingerprint of the motion: the same bits have the same one.
    fn fingerprint(&self) -> u64;

    /// After a step that failed: whether the state found on the way is worth showing; the time is then that of it.
    fn keeps_what_it_found(&mut self) -> bool {
        false
    }
}

/// A participant at its start.
///
/// # Errors
/// If its stepper can't be made.
pub(crate) fn begin(part: &Part) -> Result<Box<dyn Participant>, Failure> {
    Ok(match (part.method.bodies(), part.method.precision()) {
        (Some(bodies), _) => Box::new(Implicit::new(part, bodies)?),
        (None, Precision::Single) => Box::new(Solids::<f32>::new(part, State::at_rest(&part.model))?),
        (None, Precision::Double) => Box::new(Solids::<f64>::new(part, State::at_rest(&part.model))?),
    })
}

/// The steps of a run whose state goes on with other numbers: how they are counted, their length [s], and the model.
pub(crate) struct Before<'a> {
    pub clock: Clock,
    pub step: f64,
    pub model: &'a Model,
}

/// A participant that goes on from a state of a run of the same mesh, of explicit steps with what they were. `None` where this one has
/// another solver, precision or size.
///
/// # Errors
/// If its stepper can't be made.
pub(crate) fn go_on(
    part: &Part,
    kept: Kept,
    before: Option<Before<'_>>,
) -> Result<Option<Box<dyn Participant>>, Failure> {
    if !kept.fits(part) {
        return Ok(None);
    }
    Ok(match (kept, part.method.bodies(), part.method.precision()) {
        (Kept::Implicit(state), Some(bodies), _) => {
            let mut participant = Implicit::new(part, bodies)?;
            participant.resume(*state);
            Some(Box::new(participant))
        }
        (Kept::Single(state, memory), None, Precision::Single) => Some(resumed(part, state, memory, before)?),
        (Kept::Double(state, memory), None, Precision::Double) => Some(resumed(part, state, memory, before)?),
        _ => None,
    })
}

fn resumed<R: Numeric>(
    part: &Part,
    mut state: State<R>,
    memory: Memory<R>,
    before: Option<Before<'_>>,
) -> Result<Box<dyn Participant>, Failure> {
    if let Some(before) = &before
        && before.model.fingerprints() != part.model.fingerprints()
    {
        state.change_model(before.model, &part.model, before.clock.before);
    }
    let mut solids = Solids::new(part, state)?;
    solids.resume(memory, before.map(|before| (before.clock, before.step)));
    Ok(Box::new(solids))
}
