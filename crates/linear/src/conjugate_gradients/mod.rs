//! Conjugate gradients (Hestenes and Stiefel 1952) on the blocks of the nodes. Preconditioners: inverted
//! diagonal blocks; these, deflated by the rigid motions of aggregates, groups of neighbouring nodes
//! (Nicolaides 1987, SIAM J. Numer. Anal. 24:355; the variant A-DEF2 of Tang et al. 2009, J. Sci. Comput.
//! 39:340); or older factors. Rows are shared between threads; sums over them run in one order, so the number
//! of threads changes no bit.

mod aggregates;
mod blocks;
mod coarse;
mod kernels;
mod krylov;
#[cfg(test)]
mod tests;

pub(crate) use self::blocks::{Block, BlockMatrix};
pub(crate) use self::coarse::Coarse;
pub(crate) use self::krylov::{Approximation, KrylovVectors};
