//! Contact by a barrier: surfaces that never go into each other, whatever an iteration of a solver does. The energy κ A b(d − ξ) of a pair of
//! primitives at a distance d grows without bound as the gap d − ξ vanishes ([law]); [distances](distance) are those of points and
//! triangles and of edges, and a [filter](advance) of motions stops before any pair meets. [`Barriers`] lists pairs that come near, evaluates
//! their energy, forces and stiffness, and filters steps.
//!
//! Sources: Li et al. 2020 (TOG 39:49), incremental potential contact; Li, Kaufman and Jiang 2021 (arXiv 2012.04457), thickness and additive
//! continuous collision detection; Li et al. 2023 (arXiv 2307.15908), weights by area.

pub mod advance;
mod candidates;
mod crossing;
mod curvature;
pub mod distance;
mod features;
pub mod law;
mod nodal;
mod rows;
mod surfaces;
mod system;
#[cfg(test)]
mod tests;
mod wide;

pub use crossing::{Intersection, IntersectionCheck};
pub use curvature::Matrix12;
pub use nodal::NodeTouch;
pub use rows::{Held, Mollified, Row, Stencil};
pub use system::{BarrierSettings, Barriers, Meeting};
