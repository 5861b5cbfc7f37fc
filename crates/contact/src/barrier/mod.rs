//! Contact by a barrier: surfaces never intersect, whatever an iteration of a solver does. The energy κ A
//! b(d − ξ) of a pair of primitives at a distance d grows without bound as the gap d − ξ vanishes ([law]).
//! There are [distances](distance) of points and triangles and of edges. A [filter](ccd) of motions stops
//! before any pair meets. [`Barriers`] lists pairs that come near. A [`BarrierStep`] evaluates their energy,
//! forces and stiffness, and filters motions.
//!
//! Sources: Li et al. 2020 (TOG 39:49), incremental potential contact; Li, Kaufman and Jiang 2021 (arXiv
//! 2012.04457), thickness and additive continuous collision detection; Li et al. 2023 (arXiv 2307.15908),
//! weights by area.

mod broad_phase;
mod candidates;
pub mod ccd;
mod collision_mesh;
mod collisions;
mod configuration;
pub mod distance;
mod features;
mod filter;
mod hessian;
mod intersections;
pub mod law;
mod nodal;
mod step;
mod stiffness;
mod system;
#[cfg(test)]
mod tests;

pub use collisions::{FrictionCollision, Mollified, NormalCollision, Stencil};
pub use hessian::Matrix12;
pub use intersections::{Intersection, IntersectionCheck};
pub use nodal::NodeTouch;
pub use step::BarrierStep;
pub use system::{BarrierSettings, Barriers, Meeting};
