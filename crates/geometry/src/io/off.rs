//! Reads OFF surfaces (`.off`), text, with or without normals, colours and texture coordinates, which are
//! passed over. Leaves out the binary and the 4- and n-dimensional kinds.

use std::collections::BTreeMap;

use super::cells::{Cells, finite, index_limit, node};
use super::cursor::{Cursor, shown};
use super::error::Fault;
use super::{Format, MeshFile};
use crate::CellKind;

/// The words of the next line that is not empty and no comment.
fn next_line<'a>(cursor: &mut Cursor<'a>) -> Option<Cursor<'a>> {
    loop {
        let place = cursor.place();
        let line = cursor.line()?.split(|&byte| byte == b'#').next().unwrap_or_default().trim_ascii();
        if !line.is_empty() {
            return Some(Cursor::of_line(line, place));
        }
    }
}

/// Reads an OFF file.
pub(super) fn read(bytes: &[u8]) -> Result<MeshFile, Fault> {
    let mut cursor = Cursor::new(bytes);
    let Some(mut words) = next_line(&mut cursor) else { return Err(cursor.truncated("the word OFF")) };
    let mut kind = "OFF".to_owned();
    // The word may be missing; the counts may follow on its line.
    if words.peek().is_some_and(|word| word.iter().any(u8::is_ascii_alphabetic)) {
        kind = shown(words.need_word("the word OFF")?);
        if !kind.to_ascii_uppercase().ends_with("OFF") {
            return Err(words.malformed(format!("the first word is `{kind}`, not OFF")));
        }
        if kind.contains(['4', 'n']) {
            let what = format!("OFF with other than 3 dimensions (`{kind}`) is");
            return Err(Fault::unsupported(words.place(), what, "save it in 3 dimensions"));
        }
        if words.peek().is_some_and(|word| word.eq_ignore_ascii_case(b"BINARY")) {
            return Err(Fault::unsupported(words.place(), "binary OFF is", "save it as text"));
        }
        if words.peek().is_none() {
            let next = next_line(&mut cursor);
            words = next.ok_or_else(|| cursor.truncated("the counts of points and faces"))?;
        }
    }
    let point_count = words.integer(format_args!("the number of points"))?;
    let face_count = words.integer(format_args!("the number of faces"))?;
    let (Ok(point_count), Ok(face_count)) = (usize::try_from(point_count), usize::try_from(face_count))
    else {
        return Err(words.malformed("the counts of points and faces are negative"));
    };
    cursor.room(point_count, 6, "the points")?;
    cursor.room(face_count, 2, "the faces")?;
    index_limit(point_count, words.place())?;

    let mut points = Vec::with_capacity(point_count);
    for i in 0..point_count {
        let mut words = next_line(&mut cursor).ok_or_else(|| cursor.truncated(format!("point {i}")))?;
        let what = format_args!("point {i}");
        let (x, y, z) = (words.real(what)?, words.real(what)?, words.real(what)?);
        points.push(finite(x, y, z, i as u64, words.place())?);
    }
    let mut cells = Cells::default();
    let mut corners = Vec::new();
    for i in 0..face_count {
        let mut words = next_line(&mut cursor).ok_or_else(|| cursor.truncated(format!("face {i}")))?;
        let what = format_args!("face {i}");
        let count = words.count(2, what)?;
        corners.clear();
        for _ in 0..count {
            let index = words.integer(what)?;
            corners.push(node(index, points.len(), words.place(), || format!("face {i}"))?);
        }
        cells.open();
        match corners.len() {
            0 => cells.skip("face without corners", 0),
            1 => cells.push(CellKind::Vertex, &corners),
            2 => cells.push(CellKind::Line, &corners),
            _ => cells.push_polygon(&corners),
        }
    }
    let mut notes = Vec::new();
    if !kind.eq_ignore_ascii_case("OFF") {
        notes.push(format!("only points and faces of `{kind}` were used"));
    }
    let mesh = cells.into_mesh(points, BTreeMap::new(), &mut notes)?;
    Ok(MeshFile { mesh, format: Format::Off.name().to_owned(), notes, time: None })
}
