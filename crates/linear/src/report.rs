//! Reports of linear solutions, and reasons for failures.

use faer::sparse::FaerError;

use crate::memory::OutOfMemory;

/// Cost and accuracy of a solution.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinearReport {
    /// Iterations of conjugate gradients; 0 with factors.
    pub iterations: usize,
    /// Residual over the right-hand side; 0 with factors.
    pub residual: f64,
}

/// Reason why a linear solve failed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LinearError {
    /// More equations than factors can number.
    #[error("there are too many equations for the direct solver")]
    TooLarge,
    /// Factors that the system has no room for, and how much of it they take where that is known.
    #[error("not enough memory for the factors{}", .0.map_or_else(String::new, |needed| format!(": {needed}")))]
    OutOfMemory(Option<OutOfMemory>),
    /// The device failed.
    #[error("{0}")]
    Device(DeviceError),
    /// The matrix or the right-hand side holds a number that is not finite.
    #[error("the matrix is not finite")]
    NotFinite,
    /// A direction has no positive stiffness, after this number of iterations.
    #[error("conjugate gradients found a direction without positive stiffness after {0} iterations")]
    Indefinite(usize),
    /// Iterations ran out; the report of the state reached.
    #[error("conjugate gradients stopped after {} iterations, residual {:e}", .0.iterations, .0.residual)]
    Stalled(LinearReport),
}

/// Reason why a device solves no equations, with a remedy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct DeviceError(pub String);

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
