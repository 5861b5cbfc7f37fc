//! Vectors of nodes in the numbers of a stepper, without a copy.

use pliant_mechanics::tensor::Vector;

/// Vectors of nodes in single or double precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reals<'a> {
    /// In single precision.
    Single(&'a [Vector<f32>]),
    /// In double precision.
    Double(&'a [Vector<f64>]),
}

impl Reals<'_> {
    /// Address of the first number.
    pub fn address(&self) -> usize {
        match self {
            Self::Single(values) => values.as_ptr().addr(),
            Self::Double(values) => values.as_ptr().addr(),
        }
    }
}

/// The vector that holds them.
pub(crate) enum RealsMut<'a> {
    /// In single precision.
    Single(&'a mut Vec<Vector<f32>>),
    /// In double precision.
    Double(&'a mut Vec<Vector<f64>>),
}

impl RealsMut<'_> {
    /// Moves these numbers to where others were, which end up here; both are as many, in the same precision.
    pub(crate) fn take_place_of(self, other: RealsMut<'_>) {
        fn exchange<T: Copy>(here: &mut Vec<T>, there: &mut Vec<T>) {
            if here.len() == there.len() {
                there.copy_from_slice(here);
                std::mem::swap(here, there);
            }
        }
        match (self, other) {
            (Self::Single(here), RealsMut::Single(there)) => exchange(here, there),
            (Self::Double(here), RealsMut::Double(there)) => exchange(here, there),
            _ => {}
        }
    }
}
