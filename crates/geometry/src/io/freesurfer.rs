//! Reads FreeSurfer's surfaces: the binary format of triangles (`lh.pial`, big-endian) and the text that
//! `mris_convert` writes (`lh.pial.asc`). Coordinates are millimetres in FreeSurfer's own axes; the footer
//! gives their offset from the scanner's. Leaves out: the older binary formats of quadrilaterals, patches.

use std::collections::BTreeMap;

use super::cells::{Cells, finite_points, index_limit, node};
use super::cursor::{Cursor, Order, Scalar};
use super::error::{Fault, Place};
use super::{Format, MeshFile};
use crate::CellKind;

/// The first bytes of a binary file of triangles.
pub(super) const MAGIC: [u8; 3] = [0xFF, 0xFF, 0xFE];

/// The first bytes of a text.
pub(super) const TEXT: &[u8] = b"#!ascii";

/// Endings that surfaces have by custom, after the side.
pub(super) const NAMES: [&str; 7] =
    ["pial", "white", "smoothwm", "inflated", "sphere", "orig", "midthickness"];

/// Reads a surface.
pub(super) fn read(bytes: &[u8]) -> Result<MeshFile, Fault> {
    match bytes {
        [0xFF, 0xFF, 0xFE, ..] => read_binary(bytes),
        [0xFF, 0xFF, 0xFF | 0xFD, ..] => Err(Fault::unsupported(
            Place::Byte(0),
            "FreeSurfer's older format of quadrilaterals is",
            "convert it with `mris_convert`",
        )),
        _ if bytes.starts_with(TEXT) => read_text(bytes),
        _ => Err(Fault::malformed(
            Place::Byte(0),
            "the file does not start with the header of a FreeSurfer surface",
        )),
    }
}

fn read_binary(bytes: &[u8]) -> Result<MeshFile, Fault> {
    let mut cursor = Cursor::new(&bytes[MAGIC.len()..]);
    // Who made it and when, up to an empty line.
    while !cursor.line().ok_or_else(|| cursor.truncated("the comment"))?.is_empty() {}
    let integers = |cursor: &mut Cursor<'_>, count, what| {
        cursor.take_numbers(count, Scalar::I32, what).map(|raw| Scalar::I32.decode_integers(raw, Order::Big))
    };
    let counts = integers(&mut cursor, 2, "the numbers of points and triangles")?;
    let place = cursor.place();
    let (Ok(points), Ok(triangles)) = (usize::try_from(counts[0]), usize::try_from(counts[1])) else {
        return Err(Fault::malformed(place, "the numbers of points and triangles are negative"));
    };
    index_limit(points, place)?;
    let coordinates = cursor.take_numbers(points.saturating_mul(3), Scalar::F32, "the points")?;
    let points = finite_points(&Scalar::F32.decode(coordinates, Order::Big), place)?;
    let place = cursor.place();
    let corners = integers(&mut cursor, triangles.saturating_mul(3), "the triangles")?;
    let mut cells = Cells::default();
    for (number, corners) in corners.chunks_exact(3).enumerate() {
        push(&mut cells, corners, points.len(), number, place)?;
    }
    let mut notes = Vec::new();
    notes.extend(shift(cursor.rest()));
    let mesh = cells.into_mesh(points, BTreeMap::new(), &mut notes)?;
    Ok(MeshFile { mesh, format: format!("{} binary", Format::FreeSurfer.name()), notes, time: None })
}

fn read_text(bytes: &[u8]) -> Result<MeshFile, Fault> {
    let mut cursor = Cursor::new(bytes);
    cursor.line();
    let points = cursor.count(2, format_args!("the number of points"))?;
    let triangles = cursor.count(2, format_args!("the number of triangles"))?;
    index_limit(points, cursor.place())?;
    cursor.room(points, 8, "the points")?;
    cursor.room(triangles, 8, "the triangles")?;
    let mut coordinates = Vec::with_capacity(3 * points);
    for number in 0..points {
        for _ in 0..3 {
            coordinates.push(cursor.real(format_args!("point {number}"))?);
        }
        // Whether the point belongs to a patch.
        cursor.real(format_args!("point {number}"))?;
    }
    let points = finite_points(&coordinates, cursor.place())?;
    let mut cells = Cells::default();
    for number in 0..triangles {
        let mut corners = [0; 3];
        for corner in &mut corners {
            *corner = cursor.integer(format_args!("triangle {number}"))?;
        }
        cursor.real(format_args!("triangle {number}"))?;
        push(&mut cells, &corners, points.len(), number, cursor.place())?;
    }
    let mut notes = Vec::new();
    let mesh = cells.into_mesh(points, BTreeMap::new(), &mut notes)?;
    Ok(MeshFile { mesh, format: format!("{} text", Format::FreeSurfer.name()), notes, time: None })
}

fn push(cells: &mut Cells, corners: &[i64], points: usize, number: usize, place: Place) -> Result<(), Fault> {
    let mut nodes = [0; 3];
    for (slot, &corner) in nodes.iter_mut().zip(corners) {
        *slot = node(corner, points, place, || format!("triangle {number}"))?;
    }
    cells.open();
    cells.push(CellKind::Triangle, &nodes);
    Ok(())
}

/// The position of FreeSurfer's origin in the scanner's axes, from the footer.
fn shift(footer: &[u8]) -> Option<String> {
    let text = String::from_utf8_lossy(&footer[..footer.len().min(1 << 16)]);
    let line = text.lines().find(|line| line.trim_start().starts_with("cras"))?;
    let numbers = line.split_once('=')?.1.split_whitespace().map(str::parse).collect::<Result<Vec<f64>, _>>();
    let [x, y, z] = numbers.ok()?.try_into().ok()?;
    Some(format!("axes of FreeSurfer: scanner coordinates add ({x}, {y}, {z}) mm (c_ras)"))
}
