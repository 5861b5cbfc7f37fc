//! What a solution of linear equations took, or why there is none.

/// What a solution took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinearReport {
    /// Iterations of conjugate gradients; 0 with factors.
    pub iterations: usize,
    /// Residual over the right-hand side; 0 with factors.
    pub residual: f64,
}

/// Why a linear solve failed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum LinearError {
    NotFinite,
    Indefinite(usize),
    Stalled(LinearReport),
}
