//! An image in memory: the numbers as the file holds them, and label images made from the numbers.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::path::PathBuf;

use pliant_geometry::Grid;
use rayon::prelude::*;

use crate::error::LabelError;
use crate::names::LabelNames;

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
    const fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

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

/// The numbers of an image, as stored in the file.
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

/// Largest distance of labels from whole numbers after scaling by a single-precision slope, for usual label
/// numbers.
const ROUND_OFF: f64 = 1e-4;

/// Largest distance of labels from whole numbers after interpolation between equal labels.
const INTERPOLATED: f64 = 0.05;

/// Different values that are counted; a scan may have more.
const MOST_VALUES: usize = 1 << 16;

/// Statistics of the values of an image: voxels and runs along i of each value.
#[derive(Default)]
struct Counts {
    values: BTreeMap<i32, [u64; 2]>,
    /// True if there are more values than are counted.
    more: bool,
}

impl Counts {
    fn add(&mut self, label: i32, begins: bool) {
        if self.values.len() < MOST_VALUES || self.values.contains_key(&label) {
            let [voxels, runs] = self.values.entry(label).or_default();
            *voxels += 1;
            *runs += u64::from(begins);
        } else {
            self.more = true;
        }
    }

    fn and(mut self, other: Self) -> Self {
        for (label, [voxels, runs]) in other.values {
            let counts = self.values.entry(label).or_default();
            *counts = [counts[0] + voxels, counts[1] + runs];
        }
        self.more |= other.more || self.values.len() > MOST_VALUES;
        self
    }

    /// The labels without 0; an error if the values change from voxel to voxel, as in a scan. A run of a
    /// label along i is several voxels long, a run in a scan hardly more than one, except around the patient.
    fn labels(self) -> Result<Vec<i32>, LabelError> {
        let around = self.values.values().max().copied().unwrap_or_default();
        let [voxels, runs] =
            self.values.values().fold([0; 2], |[voxels, runs], [v, r]| [voxels + v, runs + r]);
        let length = (voxels - around[0]) as f64 / (runs - around[1]).max(1) as f64;
        let (first, last) = (self.values.keys().next().copied(), self.values.keys().next_back().copied());
        if self.more || self.values.len() > 64 && length < 1.5 || self.values.len() > 1000 && length < 3.0 {
            let range = [first.unwrap_or(0), last.unwrap_or(0)];
            return Err(LabelError::Grey { values: self.values.len(), more: self.more, range });
        }
        Ok(self.values.into_keys().filter(|&label| label != 0).collect())
    }
}

/// A volume read from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Grid of its voxels.
    pub grid: Grid,
    /// The format found, e.g. `NIfTI-1`.
    pub format: String,
    /// Skipped items and assumptions, one sentence each.
    pub notes: Vec<String>,
    /// Names of the labels that the file gives.
    pub names: LabelNames,
    pub(crate) numbers: Numbers,
    /// A value is slope × number + intercept; [1, 0] leaves integers integers.
    pub(crate) scale: [f64; 2],
}

impl Image {
    /// An image from memory: numbers of a type as little-endian bytes, i fastest, and names of its labels.
    /// `None` where these are not as many numbers as the grid has points.
    ///
    /// ```
    /// use pliant_geometry::{Grid, Vector3};
    /// use pliant_imaging::{Image, LabelNames, Scalar};
    ///
    /// let grid = Grid::along_axes([2, 2, 1], Vector3::zeros(), [1e-3; 3])?;
    /// let image = Image::new(grid, Scalar::U8, vec![0, 1, 1, 0], LabelNames::default()).unwrap();
    /// assert_eq!(image.labels()?.present(), [1]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn new(grid: Grid, scalar: Scalar, bytes: Vec<u8>, names: LabelNames) -> Option<Self> {
        let numbers = Numbers { scalar, order: Order::Little, bytes };
        (numbers.bytes.len() == grid.len() * scalar.size()).then(|| Self {
            grid,
            format: "given by the program".to_owned(),
            notes: Vec::new(),
            names,
            numbers,
            scale: [1.0, 0.0],
        })
    }

    /// Type of the numbers in the file.
    pub fn scalar(&self) -> Scalar {
        self.numbers.scalar
    }

    /// Value of the voxel at a place in memory, scaled as the file says.
    pub fn value(&self, at: usize) -> f64 {
        let [slope, intercept] = self.scale;
        slope * self.numbers.value(at) + intercept
    }

    /// The values as labels. Floating-point images count if all their values are whole numbers; a scan, whose
    /// values change from voxel to voxel, does not.
    pub fn labels(&self) -> Result<LabelImage, LabelError> {
        self.survey()?;
        let labels = (0..self.grid.len()).into_par_iter().map(|at| self.label(at)).collect();
        Ok(LabelImage { grid: self.grid, labels })
    }

    /// The label of a voxel of a label image, as confirmed by a survey.
    pub(crate) fn label(&self, at: usize) -> i32 {
        match self.numbers.at(at) {
            Number::Integer(number) if self.scale == [1.0, 0.0] => number as i32,
            _ => self.value(at).round() as i32,
        }
    }

    /// The existing labels without 0, increasing; an error if the values are not labels.
    pub(crate) fn survey(&self) -> Result<Vec<i32>, LabelError> {
        let off = self.label_tolerance();
        let whole = |at: usize| match self.numbers.at(at) {
            Number::Integer(number) if self.scale == [1.0, 0.0] => i32::try_from(number)
                .map_err(|_| LabelError::TooLarge { label: number, voxel: self.grid.triple(at) }),
            _ => {
                let value = self.value(at);
                if (value - value.round()).abs() <= off && value.abs() <= f64::from(i32::MAX) {
                    Ok(value.round() as i32)
                } else {
                    let (range, voxel) = ([f64::NAN; 2], self.grid.triple(at));
                    Err(LabelError::NotWhole { value, voxel, range })
                }
            }
        };
        let row = self.grid.dims[0];
        let counted = (0..self.grid.len() / row).into_par_iter().with_min_len(64).fold(
            || Ok(Counts::default()),
            |counts: Result<Counts, (usize, LabelError)>, number| {
                let mut counts = counts?;
                let mut last = None;
                for at in number * row..(number + 1) * row {
                    let label = whole(at).map_err(|error| (at, error))?;
                    counts.add(label, last != Some(label));
                    last = Some(label);
                }
                Ok(counts)
            },
        );
        let first =
            |a: Result<Counts, (usize, LabelError)>, b: Result<Counts, (usize, LabelError)>| match (a, b) {
                (Ok(a), Ok(b)) => Ok(a.and(b)),
                // The first error in memory order, whichever thread meets it.
                (Err(a), Err(b)) => Err(if a.0 <= b.0 { a } else { b }),
                (Err(error), _) | (_, Err(error)) => Err(error),
            };
        match counted.reduce(|| Ok(Counts::default()), first) {
            Ok(counts) => counts.labels(),
            Err((_, LabelError::NotWhole { value, voxel, .. })) => {
                Err(LabelError::NotWhole { value, voxel, range: self.range() })
            }
            Err((_, error)) => Err(error),
        }
    }

    /// Largest distance of a label from a whole number. Scaled integers are within half a step of the stored
    /// label, and have lost labels from a step of 1 on. Interpolation of equal labels misses them slightly,
    /// since its weights do not add up to exactly 1.
    fn label_tolerance(&self) -> f64 {
        let step = self.scale[0].abs();
        let scaled = if self.numbers.scalar.is_integer() && step < 1.0 { 0.5 * step } else { 0.0 };
        let least = if self.numbers.scalar.is_integer() { ROUND_OFF } else { INTERPOLATED };
        least.max(scaled)
    }

    /// A note on labels that are not whole numbers and were rounded, if there are any.
    pub fn rounding(&self) -> Option<String> {
        if self.numbers.scalar.is_integer() && self.scale == [1.0, 0.0] {
            return None;
        }
        let off = |at: usize| {
            let value = self.value(at);
            (value - value.round()).abs()
        };
        let far = (0..self.grid.len()).into_par_iter().map(off).filter(|&off| off > ROUND_OFF);
        let (voxels, most) = far
            .fold(|| (0_usize, 0.0_f64), |(n, most), off| (n + 1, most.max(off)))
            .reduce(|| (0, 0.0), |a, b| (a.0 + b.0, a.1.max(b.1)));
        (voxels > 0).then(|| {
            format!("{voxels} voxels differ from whole numbers by up to {most:.2e}: rounded to labels")
        })
    }

    /// The least and the largest value that is finite.
    fn range(&self) -> [f64; 2] {
        let values = (0..self.grid.len()).into_par_iter().map(|at| self.value(at)).filter(|x| x.is_finite());
        let wider = |[low, high]: [f64; 2], [least, most]: [f64; 2]| [low.min(least), high.max(most)];
        values.map(|x| [x, x]).reduce(|| [f64::INFINITY, f64::NEG_INFINITY], wider)
    }

    /// Several masks on the same voxels as one label image: the first has label 1, the second 2, and so on,
    /// named after their files. Where they overlap, the last one wins. A voxel is in a mask if its value is
    /// at least `least`, or, without `least`, not 0.
    pub fn of_masks(masks: &[(PathBuf, Self)], least: Option<f64>) -> Result<Self, LabelError> {
        let Some((_, first)) = masks.first() else {
            return Err(LabelError::NoneChosen { present: Vec::new() });
        };
        let mut labels = vec![0_u16; first.grid.len()];
        let mut names = LabelNames::default();
        let mut notes = Vec::new();
        let mut shared = 0;
        for (number, (path, mask)) in (1_u16..).zip(masks) {
            let file = path.file_name().unwrap_or_default().to_string_lossy();
            let name = file.split('.').next().unwrap_or_default();
            first.require_same_voxels(mask)?;
            if least.is_none() {
                let present = mask.survey()?;
                if present.len() > 1 {
                    return Err(LabelError::NoMask { name: file.into_owned(), labels: present });
                }
            }
            let inside = |at| least.map_or_else(|| mask.label(at) != 0, |least| mask.value(at) >= least);
            for (_, label) in labels.iter_mut().enumerate().filter(|(at, _)| inside(*at)) {
                shared += usize::from(*label != 0);
                *label = number;
            }
            names.insert(number.into(), name);
            notes.extend(mask.notes.iter().map(|note| format!("{name}: {note}")));
        }
        if shared > 0 {
            notes.push(format!("the masks overlap in {shared} voxels, which belong to the last one"));
        }
        let bytes = labels.into_iter().flat_map(u16::to_le_bytes).collect();
        let numbers = Numbers { scalar: Scalar::U16, order: Order::Little, bytes };
        let format = format!("{} masks ({})", masks.len(), first.format);
        Ok(Self { grid: first.grid, format, notes, names, numbers, scale: [1.0, 0.0] })
    }

    fn require_same_voxels(&self, other: &Self) -> Result<(), LabelError> {
        let off =
            (self.grid.axes - other.grid.axes).amax().max((self.grid.origin - other.grid.origin).amax());
        let least = self.grid.spacing().into_iter().fold(f64::INFINITY, f64::min);
        if self.grid.dims != other.grid.dims || off > 1e-3 * least {
            return Err(LabelError::OtherVoxels { first: self.grid.dims, second: other.grid.dims });
        }
        Ok(())
    }

    /// Passes the data of the image to `hear`, piece by piece, for a hash of its content.
    pub fn content(&self, mut hear: impl FnMut(&[u8])) {
        let Numbers { scalar, order, bytes } = &self.numbers;
        hear(format!("{:?} {scalar:?} {order:?} {:?}", self.grid, self.scale).as_bytes());
        hear(bytes);
    }

    /// The sum of two images on the same voxels, such as probability maps of grey and white matter.
    pub fn plus(&self, other: &Self) -> Result<Self, LabelError> {
        self.require_same_voxels(other)?;
        let sums: Vec<[u8; 8]> = (0..self.grid.len())
            .into_par_iter()
            .map(|at| (self.value(at) + other.value(at)).to_le_bytes())
            .collect();
        let numbers = Numbers { scalar: Scalar::F64, order: Order::Little, bytes: sums.concat() };
        let notes = self.notes.iter().chain(&other.notes).cloned().collect();
        let (format, names) = (self.format.clone(), LabelNames::default());
        Ok(Self { grid: self.grid, format, notes, names, numbers, scale: [1.0, 0.0] })
    }

    /// Label 1 if the value is in a range, otherwise 0: a region of a probability map or a level set.
    pub fn threshold(&self, range: RangeInclusive<f64>) -> LabelImage {
        let label = |at| i32::from(range.contains(&self.value(at)));
        LabelImage { grid: self.grid, labels: (0..self.grid.len()).into_par_iter().map(label).collect() }
    }
}

/// An image of labels: one region a number, 0 the background.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelImage {
    /// Grid of its voxels.
    pub grid: Grid,
    /// One label a voxel, i fastest; as long as the grid.
    pub labels: Vec<i32>,
}

impl LabelImage {
    /// The label of a voxel; 0 beyond the image.
    pub(crate) fn label_at(&self, voxel: [i64; 3]) -> i32 {
        let [nx, ny, nz] = self.grid.dims;
        let [i, j, k] = voxel.map(|at| usize::try_from(at).unwrap_or(usize::MAX));
        if i < nx && j < ny && k < nz { self.labels[i + nx * (j + ny * k)] } else { 0 }
    }
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
            names: LabelNames::default(),
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
            let mut bytes = Vec::new();
            image.content(|piece| bytes.extend_from_slice(piece));
            bytes
        };
        let first = image([1, 2], 1.0, 1e-3);
        assert_eq!(content(&first), content(&Image { format: "there".into(), ..first.clone() }));
        for other in [image([1, 3], 1.0, 1e-3), image([1, 2], 0.5, 1e-3), image([1, 2], 1.0, 2e-3)] {
            assert_ne!(content(&first), content(&other));
        }
    }
}
