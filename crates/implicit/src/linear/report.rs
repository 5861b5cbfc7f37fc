//! What a solution of linear equations took, or why there is none.

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
    Device(DeviceError),
    NotFinite,
    Indefinite(usize),
    Stalled(LinearReport),
}
