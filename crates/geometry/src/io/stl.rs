//! STL surfaces: reads text and binary, writes binary. Corners with exactly the same coordinates become one
//! point. Normals are ignored: the order of the corners defines the outside.

use std::collections::{BTreeMap, HashMap};
use std::io::{self, Write};

use super::cells::{Cells, finite, index_limit};
use super::cursor::{Cursor, Order, Scalar, name, shown};
use super::error::Fault;
use super::surface_out::SurfaceOut;
use super::{Format, MeshFile};
use crate::{CellKind, DataArray, Vector3};

/// Bytes of the head and of a triangle in binary files.
const HEAD: usize = 84;
const TRIANGLE: usize = 50;

/// Triangles with shared points.
#[derive(Default)]
struct Soup {
    points: Vec<Vector3>,
    index: HashMap<[u64; 3], u32>,
    cells: Cells,
    degenerate: usize,
}

impl Soup {
    /// The index of a point: the existing one with the same coordinates, or a new one.
    fn point(&mut self, x: Vector3) -> u32 {
        // Adding 0 makes −0 into 0.
        let key = [x.x + 0.0, x.y + 0.0, x.z + 0.0].map(f64::to_bits);
        let next = self.points.len() as u32;
        let index = *self.index.entry(key).or_insert(next);
        if index == next {
            self.points.push(x);
        }
        index
    }

    fn triangle(&mut self, corners: [Vector3; 3]) {
        let [a, b, c] = corners.map(|corner| self.point(corner));
        self.cells.open();
        if a == b || b == c || c == a {
            self.degenerate += 1;
        } else {
            self.cells.push(CellKind::Triangle, &[a, b, c]);
        }
    }

    fn finish(self, kind: &str, mut notes: Vec<String>) -> Result<MeshFile, Fault> {
        if self.degenerate > 0 {
            notes.push(format!("{} triangles with two equal corners were dropped", self.degenerate));
        }
        let mesh = self.cells.into_mesh(self.points, BTreeMap::new(), &mut notes)?;
        Ok(MeshFile { mesh, format: format!("{} {kind}", Format::Stl.name()), notes, time: None })
    }
}

/// Reads an STL file: binary if its length fits its count, or if it does not begin like text.
pub(super) fn read(bytes: &[u8]) -> Result<MeshFile, Fault> {
    let announced =
        bytes.get(80..HEAD).map(|count| Scalar::U32.decode_integers(count, Order::Little)[0] as u64);
    let fits = announced.is_some_and(|count| HEAD as u64 + count * TRIANGLE as u64 == bytes.len() as u64);
    let text = bytes.trim_ascii_start();
    let solid = text.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    if solid && !fits { read_text(bytes) } else { read_binary(bytes) }
}

fn read_binary(bytes: &[u8]) -> Result<MeshFile, Fault> {
    let mut cursor = Cursor::new(bytes);
    cursor.take(80, "the header of a binary STL file")?;
    let count = Scalar::U32.decode_integers(cursor.take(4, "the number of triangles")?, Order::Little)[0];
    let count = usize::try_from(count).unwrap_or_default();
    let place = cursor.place();
    let triangles =
        cursor.take_numbers(count.saturating_mul(TRIANGLE), Scalar::U8, format!("{count} triangles"))?;
    index_limit(count.saturating_mul(3), place)?;
    let mut notes = Vec::new();
    if !cursor.rest().is_empty() {
        notes.push(format!("{} bytes after the last triangle were ignored", cursor.rest().len()));
    }
    let mut soup = Soup::default();
    let mut attributes = Vec::with_capacity(count);
    for (i, triangle) in triangles.chunks_exact(TRIANGLE).enumerate() {
        let x = Scalar::F32.decode(&triangle[12..48], Order::Little);
        let corner = |c: usize| finite(x[c], x[c + 1], x[c + 2], (3 * i + c / 3) as u64, place);
        soup.triangle([corner(0)?, corner(3)?, corner(6)?]);
        attributes.push(f64::from(u16::from_le_bytes([triangle[48], triangle[49]])));
    }
    // Colours or numbers of parts, in the two bytes that are meant to be 0.
    if attributes.iter().any(|&attribute| Some(&attribute) != attributes.first()) {
        soup.cells.add_data("attribute", &DataArray::scalar(attributes));
    }
    soup.finish("binary", notes)
}

fn read_text(bytes: &[u8]) -> Result<MeshFile, Fault> {
    let mut cursor = Cursor::new(bytes);
    let mut soup = Soup::default();
    let mut solids: Vec<(String, usize)> = Vec::new();
    while let Some(word) = cursor.word() {
        match word.to_ascii_lowercase().as_slice() {
            b"solid" => {
                let title = name(cursor.line().unwrap_or_default());
                solids.push((title, soup.cells.len()));
            }
            b"facet" => {
                cursor.line();
                read_facet(&mut cursor, &mut soup)?;
            }
            // The rest of the line has the second word and the name.
            b"endsolid" | b"end" => {
                cursor.line();
            }
            // Lines that some programs add, such as `color`.
            b"color" => {
                cursor.line();
            }
            other => {
                let what = format!("`{}` found where `facet` or `endsolid` must be", shown(other));
                return Err(cursor.malformed(what));
            }
        }
    }
    for (i, (title, start)) in solids.iter().enumerate() {
        let end = solids.get(i + 1).map_or(soup.cells.len(), |next| next.1);
        if !title.is_empty() && end > *start {
            soup.cells.add_set(title, *start..end);
        }
    }
    soup.finish("ASCII", Vec::new())
}

/// `outer loop`, three times `vertex x y z`, `endloop`, `endfacet`.
fn read_facet(cursor: &mut Cursor<'_>, soup: &mut Soup) -> Result<(), Fault> {
    let facet = soup.cells.len() + 1;
    expect(cursor, b"outer", facet)?;
    expect(cursor, b"loop", facet)?;
    let mut corners = [Vector3::zeros(); 3];
    for (i, corner) in corners.iter_mut().enumerate() {
        expect(cursor, b"vertex", facet)?;
        let what = format_args!("facet {facet}");
        let (x, y, z) = (cursor.real(what)?, cursor.real(what)?, cursor.real(what)?);
        *corner = finite(x, y, z, (3 * (facet - 1) + i) as u64, cursor.place())?;
    }
    expect_end(cursor, b"loop", facet)?;
    expect_end(cursor, b"facet", facet)?;
    soup.triangle(corners);
    Ok(())
}

/// `endloop` as one word, or as two.
fn expect_end(cursor: &mut Cursor<'_>, word: &[u8], facet: usize) -> Result<(), Fault> {
    let joined = [b"end", word].concat();
    let found = cursor.need_word(format_args!("facet {facet}"))?;
    match found.to_ascii_lowercase() {
        found if found == b"end" => expect(cursor, word, facet),
        found if found == joined => Ok(()),
        _ => Err(unexpected(cursor, found, &joined, facet)),
    }
}

fn expect(cursor: &mut Cursor<'_>, word: &[u8], facet: usize) -> Result<(), Fault> {
    let found = cursor.need_word(format_args!("facet {facet}"))?;
    if found.eq_ignore_ascii_case(word) {
        return Ok(());
    }
    Err(unexpected(cursor, found, word, facet))
}

fn unexpected(cursor: &Cursor<'_>, found: &[u8], word: &[u8], facet: usize) -> Fault {
    cursor.malformed(format!("`{}` found instead of `{}` in facet {facet}", shown(found), shown(word)))
}

/// Writes the surface cells of a mesh; quads as two triangles. Coordinates are rounded to 32 bits.
pub(super) fn write(out: &mut dyn Write, surface: &SurfaceOut<'_>) -> io::Result<()> {
    let triangles: Vec<[u32; 3]> = surface
        .faces
        .iter()
        .flat_map(|face| face.nodes[1..].windows(2).map(|pair| [face.nodes[0], pair[0], pair[1]]))
        .collect();
    let Ok(count) = u32::try_from(triangles.len()) else {
        return Err(io::Error::other("more triangles than a binary STL file can count"));
    };
    let mut head = [b' '; 80];
    let title = b"binary STL, written by Pliant";
    head[..title.len()].copy_from_slice(title);
    out.write_all(&head)?;
    out.write_all(&count.to_le_bytes())?;
    for triangle in triangles {
        let [a, b, c] = triangle.map(|node| surface.points[node as usize]);
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
        for x in [normal, a, b, c] {
            for component in x.iter() {
                out.write_all(&(*component as f32).to_le_bytes())?;
            }
        }
        out.write_all(&[0, 0])?;
    }
    Ok(())
}
