//! NIfTI-1 and NIfTI-2, single files (`.nii`) and pairs (`.hdr`, `.img`). Fields and methods 1 to 3 of
//! orientation: nifti1.h of the NIfTI Data Format Working Group; 540-byte header: nifti2.h. The sform is
//! taken where its code is above 0, else the qform, else the spacing alone. A table of labels in an extension
//! (Caret, Connectome Workbench, TotalSegmentator) names them. Leaves out: several volumes, colours, complex
//! numbers, ANALYZE 7.5 (which has no orientation).

use nalgebra::Matrix3;
use pliant_geometry::Grid;
use pliant_geometry::Vector3;

use super::input::Input;
use super::{ReadOptions, checked_size};
use crate::error::{Fault, ImageProblem};
use crate::image::{Image, Order, Scalar};
use crate::names::{self, LabelNames};

/// Bytes of the extensions that are searched for label names.
const EXTENSIONS: u64 = 1 << 22;

/// Bytes of the headers of version 1 and 2.
const HEADER: [usize; 2] = [348, 540];

const POSITIVE: &str =
    "spacings must be positive and finite; correct pixdim (e.g. with fslorient or nibabel)";

/// True if the first bytes belong to NIfTI, in either byte order.
pub(super) fn has_magic(head: &[u8]) -> bool {
    let magic =
        |at: usize, words: [&[u8]; 2]| words.iter().any(|word| head.get(at..at + word.len()) == Some(word));
    magic(344, [b"n+1\0", b"ni1\0"]) || magic(4, [b"n+2\0", b"ni2\0"])
}

pub(super) fn read(input: &mut Input<'_>, options: &ReadOptions) -> Result<Image, Fault> {
    let header = NiftiHeader::read(input)?;
    let dims = header.dims(options)?;
    let scalar = header.scalar()?;
    let mut notes = Vec::new();
    let grid = header.grid(dims, &mut notes)?;
    let scale = header.scale()?;
    let offset = header.vox_offset()?;
    let mut names = LabelNames::default();
    let numbers = if header.single {
        let extensions = offset - header.bytes.len() as u64;
        let looked = input.exact(extensions.min(EXTENSIONS), "the extensions of the header")?;
        input.skip(extensions - looked.len() as u64, "the extensions of the header")?;
        names::of_xml(&String::from_utf8_lossy(&looked), &mut names);
        input.numbers(grid.len(), scalar, header.order)?
    } else {
        let mut data = header.pair(input)?;
        data.skip(offset, "the bytes before the voxels")?;
        data.numbers(grid.len(), scalar, header.order)?
    };
    Ok(Image { grid, format: format!("NIfTI-{}", header.version), notes, names, numbers, scale })
}

/// A note on two orientations of one image that place a corner differently by more than a tenth of a voxel.
fn different_forms(taken: &Grid, other: &Grid) -> Option<String> {
    let corner = |grid: &Grid, at: usize| {
        grid.position(&Vector3::from_fn(|axis, _| (at >> axis & 1) as f64 * (grid.dims[axis] as f64 - 1.0)))
    };
    let apart = (0..8).map(|at| (corner(taken, at) - corner(other, at)).norm()).fold(0.0, f64::max);
    let least = taken.spacing().into_iter().fold(f64::INFINITY, f64::min);
    (apart > 0.1 * least).then(|| {
        let apart = 1e3 * apart;
        format!("sform and qform place the image differently, by up to {apart:.1} mm: the sform is taken")
    })
}

/// The header as bytes, and how to read them.
struct NiftiHeader {
    bytes: Vec<u8>,
    order: Order,
    version: usize,
    /// Voxels in the same file.
    single: bool,
}

impl NiftiHeader {
    fn read(input: &mut Input<'_>) -> Result<Self, Fault> {
        let mut bytes = input.exact(HEADER[0] as u64, "the header")?;
        let size = [bytes[0], bytes[1], bytes[2], bytes[3]];
        let orders = [(Order::Little, u32::from_le_bytes(size)), (Order::Big, u32::from_be_bytes(size))];
        let found = orders.into_iter().find_map(|(order, size)| {
            Some((order, HEADER.iter().position(|&known| known as u32 == size)? + 1))
        });
        let Some((order, version)) = found else {
            let found = format!("its first number is {}, not 348 or 540", orders[0].1);
            return Err(ImageProblem::NotThisFormat { format: "NIfTI", found }.at_byte(0));
        };
        bytes.extend(input.exact((HEADER[version - 1] - HEADER[0]) as u64, "the header")?);
        let magic_at = if version == 1 { 344 } else { 4 };
        let single = match &bytes[magic_at..magic_at + 4] {
            b"n+1\0" | b"n+2\0" => true,
            b"ni1\0" | b"ni2\0" => false,
            [0, 0, 0, 0] if version == 1 => {
                return Err(ImageProblem::Unsupported {
                    what: "ANALYZE 7.5, which does not distinguish left from right".to_owned(),
                    remedy: "convert it to NIfTI with the program that made it",
                }
                .at_byte(magic_at));
            }
            other => {
                let found = format!("its magic is `{}`", other.escape_ascii());
                return Err(ImageProblem::NotThisFormat { format: "NIfTI", found }.at_byte(magic_at));
            }
        };
        let header = Self { bytes, order, version, single };
        let rank = header.dim(0);
        if !(1..=7).contains(&rank) {
            let swapped = Self { order: header.order.swapped(), ..header };
            let expected = if (1..=7).contains(&swapped.dim(0)) {
                "1 to 7 are possible; the header mixes two byte orders: convert the image again"
            } else {
                "1 to 7 are possible; the header is damaged: convert the image again"
            };
            return Err(ImageProblem::bad("dim[0]", rank, expected).at_byte(if version == 1 {
                40
            } else {
                16
            }));
        }
        Ok(header)
    }

    /// Bytes from `v1` of a version 1, `v2` of a version 2 header.
    fn field<const N: usize>(&self, v1: usize, v2: usize) -> [u8; N] {
        let at = if self.version == 1 { v1 } else { v2 };
        let mut field = [0; N];
        field.copy_from_slice(&self.bytes[at..at + N]);
        if self.order == Order::Big {
            field.reverse();
        }
        field
    }

    /// A 16-bit integer in version 1; `wide` bytes in version 2.
    fn integer(&self, v1: usize, v2: usize, wide: usize) -> i64 {
        match (self.version, wide) {
            (1, _) | (_, 2) => i16::from_le_bytes(self.field(v1, v2)).into(),
            (_, 4) => i32::from_le_bytes(self.field(v1, v2)).into(),
            _ => i64::from_le_bytes(self.field(v1, v2)),
        }
    }

    /// Single precision in version 1, double in version 2.
    fn real(&self, v1: usize, v2: usize) -> f64 {
        if self.version == 1 {
            f32::from_le_bytes(self.field(v1, v2)).into()
        } else {
            f64::from_le_bytes(self.field(v1, v2))
        }
    }

    fn dim(&self, at: usize) -> i64 {
        self.integer(40 + 2 * at, 16 + 8 * at, 8)
    }

    fn pixdim(&self, at: usize) -> f64 {
        self.real(76 + 4 * at, 104 + 8 * at)
    }

    fn dims(&self, options: &ReadOptions) -> Result<[usize; 3], ImageProblem> {
        let rank = self.dim(0) as usize;
        let dims: Vec<i64> = (1..=7).map(|at| if at <= rank { self.dim(at) } else { 1 }).collect();
        if dims.iter().any(|&n| n < 1) {
            return Err(ImageProblem::bad("dim", format!("{dims:?}"), "every size must be at least 1"));
        }
        if let Some(more) = dims[3..].iter().find(|&&n| n > 1) {
            return Err(ImageProblem::Unsupported {
                what: format!("an image of {more} volumes (dim = {dims:?})"),
                remedy: "extract one volume, e.g. with fslroi or nibabel",
            });
        }
        checked_size([dims[0] as u64, dims[1] as u64, dims[2] as u64], "dim", options)
    }

    fn scalar(&self) -> Result<Scalar, Fault> {
        let code = self.integer(70, 12, 2);
        let at = if self.version == 1 { 70 } else { 12 };
        let scalar = match code {
            2 => Scalar::U8,
            4 => Scalar::I16,
            8 => Scalar::I32,
            16 => Scalar::F32,
            64 => Scalar::F64,
            256 => Scalar::I8,
            512 => Scalar::U16,
            768 => Scalar::U32,
            1024 => Scalar::I64,
            1280 => Scalar::U64,
            1 | 32 | 128 | 1536 | 1792 | 2048 | 2304 => {
                return Err(ImageProblem::Unsupported {
                    what: format!("datatype {code} (bits, complex numbers, colours or quadruple precision)"),
                    remedy: "convert to integers or floating-point numbers",
                }
                .at_byte(at));
            }
            _ => {
                return Err(ImageProblem::bad(
                    "datatype",
                    code,
                    "this type does not exist; convert the image again",
                )
                .at_byte(at));
            }
        };
        let bits = self.integer(72, 14, 2);
        if bits != 8 * scalar.size() as i64 {
            let expected = "it must match `datatype`; convert the image again";
            return Err(ImageProblem::bad("bitpix", bits, expected).at_byte(at + 2));
        }
        Ok(scalar)
    }

    /// [slope, intercept]; a slope of 0 means none.
    fn scale(&self) -> Result<[f64; 2], ImageProblem> {
        let [slope, intercept] = [self.real(112, 176), self.real(116, 184)];
        if slope == 0.0 || !slope.is_finite() {
            return Ok([1.0, 0.0]);
        }
        if !intercept.is_finite() {
            return Err(ImageProblem::bad(
                "scl_inter",
                intercept,
                "it must be finite; convert the image again",
            ));
        }
        Ok([slope, intercept])
    }

    fn vox_offset(&self) -> Result<u64, ImageProblem> {
        let offset = if self.version == 1 { self.real(108, 0) } else { self.integer(0, 168, 8) as f64 };
        let least = if self.single { self.bytes.len() as f64 } else { 0.0 };
        // 2³⁰: no extensions have a gigabyte.
        if offset.fract() == 0.0 && (least..=(1_u64 << 30) as f64).contains(&offset) {
            Ok(offset as u64)
        } else {
            let expected = "it must be a whole number of bytes, past the header; convert the image again";
            Err(ImageProblem::bad("vox_offset", offset, expected))
        }
    }

    /// Metres per unit of length; unknown units are taken as millimetres.
    fn unit(&self, notes: &mut Vec<String>) -> f64 {
        let code = if self.version == 1 { self.bytes[123].into() } else { self.integer(0, 500, 4) };
        match code & 7 {
            1 => 1.0,
            3 => 1e-6,
            2 => 1e-3,
            _ => {
                notes.push("no unit of length: millimetres assumed".to_owned());
                1e-3
            }
        }
    }

    fn grid(&self, dims: [usize; 3], notes: &mut Vec<String>) -> Result<Grid, ImageProblem> {
        let unit = self.unit(notes);
        let has_qform = self.integer(252, 344, 4) > 0;
        if self.integer(254, 348, 4) > 0 {
            let row = |row: usize| {
                [0, 1, 2, 3].map(|at| self.real(280 + 16 * row + 4 * at, 400 + 32 * row + 8 * at) * unit)
            };
            let rows = [row(0), row(1), row(2)];
            let axes = Matrix3::from_fn(|i, j| rows[i][j]);
            let grid = Grid::new(dims, Vector3::from(rows.map(|row| row[3])), axes)?;
            let other = if has_qform { self.of_qform(dims, unit).ok() } else { None };
            notes.extend(other.and_then(|other| different_forms(&grid, &other)));
            return Ok(grid);
        }
        if has_qform {
            return self.of_qform(dims, unit);
        }
        let spacing = self.steps(unit)?;
        notes.push(
            "no orientation (sform and qform codes are 0): assuming axes x, y and z from the origin"
                .to_owned(),
        );
        Ok(Grid::new(dims, Vector3::zeros(), spacing)?)
    }

    /// Steps along i, j and k [m], as a diagonal matrix.
    fn steps(&self, unit: f64) -> Result<Matrix3<f64>, ImageProblem> {
        let spacing = [1, 2, 3].map(|at| self.pixdim(at));
        if spacing.iter().any(|&h| !(h.is_finite() && h > 0.0)) {
            return Err(ImageProblem::bad("pixdim", format!("{spacing:?}"), POSITIVE));
        }
        Ok(Matrix3::from_diagonal(&(Vector3::from(spacing) * unit)))
    }

    /// The grid of the qform.
    fn of_qform(&self, dims: [usize; 3], unit: f64) -> Result<Grid, ImageProblem> {
        let offset = [0, 1, 2].map(|at| self.real(268 + 4 * at, 376 + 8 * at) * unit);
        let side = if self.pixdim(0) < 0.0 { -1.0 } else { 1.0 };
        let mirror = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, side));
        Ok(Grid::new(dims, offset.into(), self.rotation()? * mirror * self.steps(unit)?)?)
    }

    /// Rotation of the quaternion (a, b, c, d); the file contains b, c and d.
    fn rotation(&self) -> Result<Matrix3<f64>, ImageProblem> {
        let [mut b, mut c, mut d] = [0, 1, 2].map(|at| self.real(256 + 4 * at, 352 + 8 * at));
        let square = b * b + c * c + d * d;
        // 1e-3: single-precision round-off is 1e-6; a larger deviation is not a rotation.
        if !square.is_finite() || square > 1.0 + 1e-3 {
            let expected = "its square must be at most 1; correct the qform, or set an sform";
            return Err(ImageProblem::bad("quatern", format!("({b}, {c}, {d})"), expected));
        }
        let a = if square < 1.0 {
            (1.0 - square).sqrt()
        } else {
            let norm = square.sqrt();
            (b, c, d) = (b / norm, c / norm, d / norm);
            0.0
        };
        Ok(Matrix3::new(
            a * a + b * b - c * c - d * d,
            2.0 * (b * c - a * d),
            2.0 * (b * d + a * c),
            2.0 * (b * c + a * d),
            a * a + c * c - b * b - d * d,
            2.0 * (c * d - a * b),
            2.0 * (b * d - a * c),
            2.0 * (c * d + a * b),
            a * a + d * d - b * b - c * c,
        ))
    }

    /// The `.img` that belongs to a `.hdr`.
    fn pair<'i>(&self, input: &Input<'i>) -> Result<Input<'i>, Fault> {
        let names = input.sibling_names("img");
        let [plain, packed] = names.as_slice() else {
            return input.beside("magic", "the .img of this .hdr");
        };
        let unpacked = |_| input.beside("magic", packed).map(Input::unpack_gzip);
        input.beside("magic", plain).or_else(|fault| unpacked(()).map_err(|_| fault))
    }
}
