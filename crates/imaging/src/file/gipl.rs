//! GIPL (Guy's Image Processing Lab): 256 bytes of header, then the voxels, all big-endian. Fields follow
//! ITK's GiplImageIO: the axes are LPS world coordinates and `origin` is the centre of the first voxel.
//! Leaves out: complex numbers, several volumes.

use nalgebra::Matrix3;
use pliant_geometry::Grid;

use super::input::Input;
use super::text::ToWorld;
use super::{ReadOptions, checked_size};
use crate::error::{Fault, ImageProblem};
use crate::image::{Image, Order, Scalar};
use crate::names::LabelNames;

const HEADER: usize = 256;

/// The two numbers in use at byte 252.
const MAGIC: [u32; 2] = [0xEFFF_E9B0, 0x2AE3_89B8];

pub(super) fn has_magic(head: &[u8]) -> bool {
    head.get(252..256).is_some_and(|bytes| MAGIC.iter().any(|magic| bytes == magic.to_be_bytes()))
}

pub(super) fn read(input: &mut Input<'_>, options: &ReadOptions) -> Result<Image, Fault> {
    let header = input.exact(HEADER as u64, "the header")?;
    if !has_magic(&header) {
        let little = MAGIC.iter().any(|magic| header[252..256] == magic.to_le_bytes());
        let found = if little {
            "its numbers are little-endian, GIPL needs big-endian".to_owned()
        } else {
            format!("its magic is {:02x?}", &header[252..256])
        };
        return Err(ImageProblem::NotThisFormat { format: "GIPL", found }.at_byte(252));
    }
    let u16_at = |at: usize| u16::from_be_bytes([header[at], header[at + 1]]);
    let dims = [0, 1, 2, 3].map(|axis| u64::from(u16_at(2 * axis)));
    if dims[3] > 1 {
        return Err(ImageProblem::Unsupported {
            what: format!("an image of {} volumes", dims[3]),
            remedy: "extract one volume",
        }
        .at_byte(6));
    }
    let dims =
        checked_size([dims[0], dims[1], dims[2]], "sizes", options).map_err(|problem| problem.at_byte(0))?;
    let scalar = match u16_at(8) {
        1 | 8 => Scalar::U8,
        7 => Scalar::I8,
        15 => Scalar::I16,
        16 => Scalar::U16,
        31 => Scalar::U32,
        32 => Scalar::I32,
        64 => Scalar::F32,
        65 => Scalar::F64,
        code => {
            return Err(ImageProblem::Unsupported {
                what: format!("GIPL image type {code}"),
                remedy: "convert to integers or floating-point numbers",
            }
            .at_byte(8));
        }
    };
    let spacing = [0, 1, 2].map(|axis| {
        let at = 10 + 4 * axis;
        f64::from(f32::from_be_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]]))
    });
    if spacing.iter().any(|&h| !(h.is_finite() && h > 0.0)) {
        let expected =
            "spacings must be positive and finite; correct them in the program that made the image";
        return Err(ImageProblem::bad("voxel sizes", format!("{spacing:?}"), expected).at_byte(10));
    }
    let origin = [0, 1, 2].map(|axis| {
        let mut bytes = [0; 8];
        bytes.copy_from_slice(&header[204 + 8 * axis..212 + 8 * axis]);
        f64::from_be_bytes(bytes)
    });
    let world = ToWorld::LPS_MILLIMETRES;
    let axes = Matrix3::from_diagonal(&spacing.into());
    let steps = [0, 1, 2].map(|axis| axes.column(axis).into());
    let grid = Grid::new(dims, world.vector(origin.into()), world.axes(steps))?;
    let numbers = input.numbers(grid.len(), scalar, Order::Big)?;
    Ok(Image {
        grid,
        format: "GIPL".to_owned(),
        notes: Vec::new(),
        names: LabelNames::default(),
        numbers,
        scale: [1.0, 0.0],
    })
}
