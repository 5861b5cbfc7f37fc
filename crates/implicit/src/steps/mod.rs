//! Solvers of the equations of a model: equilibria, implicit and explicit steps, and the descent of an energy
//! in contact.

pub(crate) mod backward_euler;
pub(crate) mod descent;
pub(crate) mod explicit_shells;
pub(crate) mod forces;
pub(crate) mod limits;
pub(crate) mod solver;
pub(crate) mod statics;
