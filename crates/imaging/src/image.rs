//! An image in memory: the numbers as the file holds them, and label images made of them.

use std::ops::RangeInclusive;

use rayon::prelude::*;

use crate::error::LabelError;
use crate::grid::Grid;

/// Type of the numbers of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scalar {
    /// Signed, 8 bits.
    I8,
    /// Unsigned, 8 bits.
    U8,
    /// Signed, 16 bits.
    I16,
    /// Unsigned, 16 bits.
    U16,
    /// Signed, 32 bits.
    I32,
    /// Unsigned, 32 bits.
    U32,
    /// Signed, 64 bits.
    I64,
    /// Unsigned, 64 bits.
    U64,
    /// Floating point, 32 bits.
    F32,
    /// Floating point, 64 bits.
    F64,
}

impl Scalar {
    /// Bytes of a number.
    pub const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }
}

/// Byte order of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Order {
    Little,
    Big,
}

impl Order {
    /// The other order.
    pub(crate) fn swapped(self) -> Self {
        if self == Self::Little { Self::Big } else { Self::Little }
    }
}

/// The numbers of an image, as they stand in the file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Numbers {
    pub(crate) scalar: Scalar,
    pub(crate) order: Order,
    pub(crate) bytes: Vec<u8>,
}

macro_rules! decode {
    ($bytes:expr, $order:expr, $number:ty) => {{
        let raw = $bytes.try_into().unwrap_or_default();
        if $order == Order::Little { <$number>::from_le_bytes(raw) } else { <$number>::from_be_bytes(raw) }
    }};
}

/// One number of an image.
enum Number {
    Integer(i128),
    Real(f64),
}

impl Numbers {
    fn at(&self, index: usize) -> Number {
        let size = self.scalar.size();
        let bytes = &self.bytes[index * size..(index + 1) * size];
        let order = self.order;
        match self.scalar {
            Scalar::I8 => Number::Integer(decode!(bytes, order, i8).into()),
            Scalar::U8 => Number::Integer(decode!(bytes, order, u8).into()),
            Scalar::I16 => Number::Integer(decode!(bytes, order, i16).into()),
            Scalar::U16 => Number::Integer(decode!(bytes, order, u16).into()),
            Scalar::I32 => Number::Integer(decode!(bytes, order, i32).into()),
            Scalar::U32 => Number::Integer(decode!(bytes, order, u32).into()),
            Scalar::I64 => Number::Integer(decode!(bytes, order, i64).into()),
            Scalar::U64 => Number::Integer(decode!(bytes, order, u64).into()),
            Scalar::F32 => Number::Real(decode!(bytes, order, f32).into()),
            Scalar::F64 => Number::Real(decode!(bytes, order, f64)),
        }
    }

    /// The number as floating point.
    pub(crate) fn value(&self, index: usize) -> f64 {
        match self.at(index) {
            Number::Integer(number) => number as f64,
            Number::Real(number) => number,
        }
    }
}

/// A volume read from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Where its voxels are.
    pub grid: Grid,
    /// The format found, e.g. `NIfTI-1`.
    pub format: String,
    /// What was left out or assumed, one sentence each.
    pub notes: Vec<String>,
    pub(crate) numbers: Numbers,
    /// A value is slope × number + intercept; [1, 0] leaves integers integers.
    pub(crate) scale: [f64; 2],
}

impl Image {
    /// Type of the numbers in the file.
    pub fn scalar(&self) -> Scalar {
        self.numbers.scalar
    }

    /// Value of the voxel at a place in memory, scaled as the file says.
    pub fn value(&self, at: usize) -> f64 {
        let [slope, intercept] = self.scale;
        slope * self.numbers.value(at) + intercept
    }

    /// The values as labels. Floating-point images count if all their values are whole numbers.
    pub fn labels(&self) -> Result<LabelImage, LabelError> {
        let whole = |at: usize| match self.numbers.at(at) {
            Number::Integer(number) if self.scale == [1.0, 0.0] => i32::try_from(number)
                .map_err(|_| LabelError::TooLarge { label: number, voxel: self.grid.triple(at) }),
            _ => {
                let value = self.value(at);
                // Values scaled by a single-precision slope miss whole numbers by round-off.
                if (value - value.round()).abs() <= 1e-4 && value.abs() <= f64::from(i32::MAX) {
                    Ok(value.round() as i32)
                } else {
                    Err(LabelError::NotWhole { value, voxel: self.grid.triple(at) })
                }
            }
        };
        let results = (0..self.grid.len()).into_par_iter().map(whole);
        // The first error in memory order, whichever thread meets it.
        match results.clone().find_first(Result::is_err) {
            Some(Err(error)) => Err(error),
            _ => {
                Ok(LabelImage { grid: self.grid, labels: results.map(|label| label.unwrap_or(0)).collect() })
            }
        }
    }

    /// All that makes the image what it is, piece by piece, for a hash of its content.
    pub fn content(&self, mut hear: impl FnMut(&[u8])) {
        let Numbers { scalar, order, bytes } = &self.numbers;
        hear(format!("{:?} {scalar:?} {order:?} {:?}", self.grid, self.scale).as_bytes());
        hear(bytes);
    }

    /// The sum of the values of two images of the same voxels, such as maps of the probability of grey and white matter.
    pub fn plus(&self, other: &Self) -> Result<Self, LabelError> {
        let off =
            (self.grid.axes - other.grid.axes).amax().max((self.grid.origin - other.grid.origin).amax());
        let least = self.grid.spacing().into_iter().fold(f64::INFINITY, f64::min);
        if self.grid.dims != other.grid.dims || off > 1e-3 * least {
            return Err(LabelError::OtherVoxels { first: self.grid.dims, second: other.grid.dims });
        }
        let sums: Vec<[u8; 8]> = (0..self.grid.len())
            .into_par_iter()
            .map(|at| (self.value(at) + other.value(at)).to_le_bytes())
            .collect();
        let numbers = Numbers { scalar: Scalar::F64, order: Order::Little, bytes: sums.concat() };
        let notes = self.notes.iter().chain(&other.notes).cloned().collect();
        Ok(Self { grid: self.grid, format: self.format.clone(), notes, numbers, scale: [1.0, 0.0] })
    }

    /// Label 1 where the value lies in a range, 0 elsewhere: a region of a probability map or a level set.
    pub fn threshold(&self, range: RangeInclusive<f64>) -> LabelImage {
        let label = |at| i32::from(range.contains(&self.value(at)));
        LabelImage { grid: self.grid, labels: (0..self.grid.len()).into_par_iter().map(label).collect() }
    }
}

/// An image of labels: one region a number, 0 the background.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelImage {
    /// Where its voxels are.
    pub grid: Grid,
    /// One label a voxel, i fastest; as long as the grid.
    pub labels: Vec<i32>,
}

#[cfg(test)]
mod tests {
    use pliant_geometry::Vector3;

    use super::*;

    fn image(values: [i16; 2], slope: f64, spacing: f64) -> Image {
        let bytes = values.iter().flat_map(|value| value.to_be_bytes()).collect();
        Image {
            grid: Grid::along_axes([2, 1, 1], Vector3::zeros(), [spacing; 3]).unwrap(),
            format: "here".into(),
            notes: Vec::new(),
            numbers: Numbers { scalar: Scalar::I16, order: Order::Big, bytes },
            scale: [slope, 0.0],
        }
    }

    #[test]
    fn values_of_two_images_are_added_where_their_voxels_are_the_same() {
        let sum = image([1, 300], 0.5, 1e-3).plus(&image([4, -100], 2.0, 1e-3)).unwrap();
        assert_eq!([0, 1].map(|at| sum.value(at)), [8.5, -50.0]);
        assert!(image([1, 2], 1.0, 1e-3).plus(&image([1, 2], 1.0, 2e-3)).is_err());
    }

    #[test]
    fn the_content_tells_images_apart_and_not_their_names() {
        let content = |image: &Image| {
            let mut all = Vec::new();
            image.content(|piece| all.extend_from_slice(piece));
            all
        };
        let first = image([1, 2], 1.0, 1e-3);
        assert_eq!(content(&first), content(&Image { format: "there".into(), ..first.clone() }));
        for other in [image([1, 3], 1.0, 1e-3), image([1, 2], 0.5, 1e-3), image([1, 2], 1.0, 2e-3)] {
            assert_ne!(content(&first), content(&other));
        }
    }
}
