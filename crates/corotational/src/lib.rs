//! Co-rotational triangular shells.
pub mod element;
mod rotation;
#[cfg(test)]
mod testing;
