//! What a solution of linear equations took, or why there is none.

use faer::sparse::FaerError;
use pliant_mechanics::memory::OutOfMemory;

use super::device::DeviceError;

/// What a solution took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinearReport {
    /// Iterations of conjugate gradients; 0 with factors.
    pub iterations: usize,
    /// Residual over the right-hand side; 0 with factors.
    pub residual: f64,
}

/// Why a linear solve failed.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum LinearError {
    /// More equations than factors can number.
    TooLarge,
    /// Factors that the system has no room for, and how much of it they take where that is known.
    OutOfMemory(Option<OutOfMemory>),
    Device(DeviceError),
    NotFinite,
    Indefinite(usize),
    Stalled(LinearReport),
}

impl From<FaerError> for LinearError {
    fn from(error: FaerError) -> Self {
        match error {
            FaerError::OutOfMemory => Self::OutOfMemory(None),
            _ => Self::TooLarge,
        }
    }
}

impl From<OutOfMemory> for LinearError {
    fn from(error: OutOfMemory) -> Self {
        Self::OutOfMemory(Some(error))
    }
}
