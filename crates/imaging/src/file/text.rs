//! Values of text headers.

use std::str::FromStr;

use nalgebra::Matrix3;
use pliant_geometry::Vector3;

use crate::error::{Fault, ImageProblem};

/// A field of a text header: its value and its line.
#[derive(Clone, Debug)]
pub(super) struct Field {
    pub name: &'static str,
    pub value: String,
    pub line: usize,
}

impl Field {
    pub fn bad(&self, expected: &'static str) -> Fault {
        ImageProblem::bad(self.name, &self.value, expected).at_line(self.line)
    }

    /// Exactly `N` values separated by spaces.
    pub fn array<T: FromStr + Copy, const N: usize>(&self, expected: &'static str) -> Result<[T; N], Fault> {
        let values: Vec<T> = self.list(expected)?;
        values.try_into().map_err(|_| self.bad(expected))
    }

    /// Values separated by spaces.
    pub fn list<T: FromStr>(&self, expected: &'static str) -> Result<Vec<T>, Fault> {
        self.value.split_whitespace().map(|word| word.parse().map_err(|_| self.bad(expected))).collect()
    }

    /// A single value.
    pub fn one<T: FromStr + Copy>(&self, expected: &'static str) -> Result<T, Fault> {
        self.array(expected).map(|[value]| value)
    }
}

/// Millimetres to metres, and optionally from LPS (x to the left, y to the back) to RAS.
pub(super) struct ToWorld {
    /// Metres a unit.
    pub unit: f64,
    /// Signs of x and y: −1 turns left to right, back to front.
    pub signs: [f64; 3],
}

impl ToWorld {
    pub(crate) const LPS_MILLIMETRES: Self = Self { unit: 1e-3, signs: [-1.0, -1.0, 1.0] };

    pub fn vector(&self, of_file: Vector3) -> Vector3 {
        of_file.component_mul(&Vector3::from(self.signs)) * self.unit
    }

    /// Steps from voxel to voxel.
    pub fn axes(&self, steps: [Vector3; 3]) -> Matrix3<f64> {
        Matrix3::from_columns(&steps.map(|step| self.vector(step)))
    }
}
