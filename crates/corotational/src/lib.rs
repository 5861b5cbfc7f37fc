//! Co-rotational triangular shells.
mod rotation;
pub mod element;
mod facet;
#[cfg(test)]
mod testing;
pub use facet::*;
