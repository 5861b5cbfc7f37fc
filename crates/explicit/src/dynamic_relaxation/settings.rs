//! Settings, errors, and what a solution took.

use crate::lanes::LaneNumber;
use crate::step_error::at_corner;

/// Iterations for which a search that has reached its residual continues for the displacements.
pub const PATIENCE: usize = 4000;

/// Criteria of convergence and of failure of a load step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelaxationSettings {
    /// Largest residual force on a free component, over the largest internal force.
    pub tolerance: f64,
    /// Estimated error of the displacements over the largest one, in single precision. Round-off hides the
    /// distance to the equilibrium in the residual of slender bodies. So a search continues until this error
    /// is reached, though for no more than `PATIENCE` iterations.
    pub displacement: f64,
    /// Iterations after which a load step has failed.
    pub iterations: usize,
    /// Number of times that a failed load step may be halved.
    pub halvings: u32,
}

impl RelaxationSettings {
    /// The usual ones for a number type.
    pub fn usual<R: LaneNumber>() -> Self {
        let precise = Self::default();
        match is_single::<R>() {
            true => Self { tolerance: 100.0 * precise.tolerance, displacement: 1e-3, ..precise },
            false => precise,
        }
    }
}

pub(super) fn is_single<R: LaneNumber>() -> bool {
    R::EPSILON > 1e-10
}

impl Default for RelaxationSettings {
    fn default() -> Self {
        Self { tolerance: 1e-6, displacement: f64::INFINITY, iterations: 20_000, halvings: 6 }
    }
}

/// Reason why no equilibrium was found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RelaxationError {
    /// Still moving after the allowed iterations.
    #[error(
        "no equilibrium at t = {time:.6} s: residual {residual:.2e} > {tolerance:.0e} after {iterations} iterations, \
         largest at node {node} of `{body}`"
    )]
    NotConverged {
        /// The body of the node of the largest residual.
        body: String,
        /// Node of the largest residual, numbered in its body.
        node: u32,
        /// The relative residual.
        residual: f64,
        /// Tolerance of the relative residual.
        tolerance: f64,
        /// Iterations spent on the last try.
        iterations: usize,
        /// Time [s].
        time: f64,
    },
    /// A cell turns inside out however small the load step.
    #[error(
        "element {element} of `{body}` is inverted{} (det F = {determinant:.3e}) on the way to t = {time:.6} s, after \
         {iterations} iterations",
        at_corner(*corner, *node)
    )]
    Inverted {
        /// The body.
        body: String,
        /// The element, numbered as in the user's mesh.
        element: u32,
        /// First node of the element, or the node of the corner, numbered in its body.
        node: u32,
        /// True if the inversion is at a corner of a hexahedron, not at its middle.
        corner: bool,
        /// det F there.
        determinant: f64,
        /// Iterations spent on the last try.
        iterations: usize,
        /// Time [s].
        time: f64,
    },
    /// A displacement is not a number or infinite.
    #[error(
        "the displacement of node {node} of `{body}` is no longer finite on the way to t = {time:.6} s, after \
         {iterations} iterations"
    )]
    NotFinite {
        /// The body.
        body: String,
        /// The node, numbered in its body.
        node: u32,
        /// Iterations spent on the last try.
        iterations: usize,
        /// Time [s].
        time: f64,
    },
    /// Someone [asked](super::DynamicRelaxation::stop_on) for it.
    #[error("the search for the equilibrium at t = {time:.6} s was stopped")]
    Stopped {
        /// Time [s].
        time: f64,
    },
}

impl RelaxationError {
    /// Returns advice on what to try.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Inverted { time, .. } | Self::NotConverged { time, .. } | Self::NotFinite { time, .. }
                if *time == 0.0 =>
            {
                "what acts at t = 0 comes at once: let it grow over time (`curve = \"smooth-step\"`), or make it smaller; a body \
                 that nothing holds has no equilibrium"
            }
            Self::NotConverged { .. } => {
                "try more load steps, a looser tolerance or double precision; a body that nothing holds has no equilibrium"
            }
            Self::Inverted { .. } => "try more load steps, a smaller motion, or a finer mesh there",
            Self::NotFinite { .. } => "try more load steps; a body that nothing holds has no equilibrium",
            Self::Stopped { .. } => "the state is that of the equilibrium before",
        }
    }
}

/// Statistics of a load step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Convergence {
    /// Iterations, including failed tries.
    pub iterations: usize,
    /// Relative residual at the end.
    pub residual: f64,
    /// Parts the load step was cut into.
    pub parts: u32,
}

/// Progress of the search for an equilibrium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iteration {
    /// Time [s] of the last equilibrium and of the one that is sought.
    pub span: [f64; 2],
    /// Iterations of this try.
    pub number: usize,
    /// Relative residual.
    pub residual: f64,
    /// Part of the way, in orders of magnitude of the residual; 0 while the load is brought on.
    pub fraction: f64,
}
