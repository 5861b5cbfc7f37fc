//! Writes unstructured grids as VTK's XML (`.vtu`), and the list of the files of a series (`.pvd`).
//!
//! Arrays are base64 inside their elements. Appended raw bytes would save a quarter of the size, but are not
//! XML. Also, meshio 5.3.5 mixes up the arrays of some such files.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::Path;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use simd_adler32::adler32;

use super::cells::{BODY_NAMES, LABEL_NAMES, SET_PREFIX};
use super::vtk_cells::type_number;
use super::{MeshFileError, base64, check, save};
use crate::{DataArray, Mesh};

/// Options of a `.vtu` file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VtuOptions {
    /// Compresses the arrays with zlib; real numbers that it would hardly shorten are stored in its format as
    /// they are.
    pub compress: bool,
    /// Rounds coordinates and data to 32-bit floating point: half the size.
    pub single: bool,
    /// Time of the state [s]; becomes `TimeValue` of the file.
    pub time: Option<f64>,
}

/// Bytes of an array that are compressed together.
const BLOCK: usize = 1 << 17;

/// Zlib's level: 3 made the files of the test `vtu_speed_with_ten_thousand_nodes` at most 3 % smaller in four
/// times the time.
const LEVEL: u32 = 1;

/// A block of real numbers is stored uncompressed where fewer than one in this many of its numbers is a
/// repeat. Zlib would take a tenth off such fields, and as long as the recovery of stresses.
const REPEATED: usize = 8;

/// Writes a mesh as a `.vtu` file into `writer`, as one piece with all its cells.
///
/// Sets become arrays `set:NAME` of 0 and 1. Cell data that a kind of cells does not have are NaN there.
/// `label` is written as integers if it is integral everywhere; the names of labels become field data
/// `label-names` (byte codes).
pub fn write_vtu(writer: impl Write, mesh: &Mesh, options: &VtuOptions) -> Result<(), MeshFileError> {
    let path = Path::new("stream.vtu");
    check(path, mesh)?;
    let mut writer = writer;
    write(&mut writer, mesh, options).map_err(|source| MeshFileError::Write { path: path.to_owned(), source })
}

/// Writes a mesh as a `.vtu` file with options (see [`write_vtu`]), in place of an older one only once it is
/// complete.
pub fn save_vtu(path: &Path, mesh: &Mesh, options: &VtuOptions) -> Result<(), MeshFileError> {
    check(path, mesh)?;
    save(path, |out| write(out, mesh, options))
}

/// Writes a mesh again and again with other data: points, cells and sets, which stay, are encoded once. Each
/// file is as [`write_vtu`] writes it.
#[derive(Clone, Debug, Default)]
pub struct VtuSeries(Option<Lasting>);

impl VtuSeries {
    /// Writes the next frame into `writer`. Points, cells and sets are taken from the first frame, and
    /// checked only there.
    pub fn write(
        &mut self,
        mut writer: impl Write,
        mesh: &Mesh,
        options: &VtuOptions,
    ) -> Result<(), MeshFileError> {
        let path = Path::new("stream.vtu");
        let failed = |source| MeshFileError::Write { path: path.to_owned(), source };
        let lasting = match &mut self.0 {
            Some(lasting) => lasting,
            first => {
                check(path, mesh)?;
                first.insert(Lasting::of(mesh, options).map_err(failed)?)
            }
        };
        write_with(&mut writer, mesh, options, lasting).map_err(failed)
    }
}

/// Parts that the frames of a mesh share, encoded.
#[derive(Clone, Debug)]
struct Lasting {
    point_sets: Vec<u8>,
    cell_sets: Vec<u8>,
    /// Points and cells.
    shape: Vec<u8>,
}

impl Lasting {
    fn of(mesh: &Mesh, options: &VtuOptions) -> io::Result<Self> {
        let parts = || Parts { xml: Vec::new(), compress: options.compress };
        let (mut point_sets, mut cell_sets, mut shape) = (parts(), parts(), parts());
        for (name, set) in &mesh.point_sets {
            point_sets.set(name, set.iter().map(|&point| point as usize), mesh.points.len())?;
        }
        write_cell_sets(&mut cell_sets, mesh)?;
        shape.push("      <Points>\n");
        let coordinates: Vec<f64> = mesh.points.iter().flat_map(|x| [x.x, x.y, x.z]).collect();
        let fits = coordinates.iter().all(|&x| (x as f32).is_finite());
        shape.reals("Points", 3, &coordinates, options.single && fits)?;
        shape.push("      </Points>\n");
        write_cells(&mut shape, mesh)?;
        Ok(Self { point_sets: point_sets.xml, cell_sets: cell_sets.xml, shape: shape.xml })
    }
}

/// The text of the list of the files of a series, `(time [s], file)`. File names are relative to the list.
///
/// # Errors
/// A sentence, if a time is not finite.
pub fn pvd_text(files: impl Iterator<Item = (f64, String)>) -> Result<String, String> {
    let entries: String = files.map(|(time, file)| pvd_entry(time, &file)).collect::<Result<_, _>>()?;
    Ok(format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n  \
         <Collection>\n{entries}{PVD_TAIL}"
    ))
}

/// The text after the entries of such a list.
pub const PVD_TAIL: &str = "  </Collection>\n</VTKFile>\n";

/// One of the entries: a file at a time [s].
///
/// # Errors
/// A sentence, if the time is not finite.
pub fn pvd_entry(time: f64, file: &str) -> Result<String, String> {
    if !time.is_finite() {
        return Err(format!("the time of `{file}` is {time}; times must be finite"));
    }
    let file = escaped(file);
    Ok(format!("    <DataSet timestep=\"{time:?}\" group=\"\" part=\"0\" file=\"{file}\"/>\n"))
}

/// The file as it grows.
struct Parts {
    xml: Vec<u8>,
    compress: bool,
}

impl Parts {
    fn push(&mut self, text: &str) {
        self.xml.extend_from_slice(text.as_bytes());
    }

    fn array(&mut self, kind: &str, name: &str, components: usize, raw: &[u8]) -> io::Result<()> {
        let name = escaped(name);
        // Arrays of real numbers are compressed only where that pays.
        let repeats: fn(&[u8]) -> bool = match kind {
            "Float32" => repeats::<4>,
            "Float64" => repeats::<8>,
            _ => |_: &[u8]| true,
        };
        write!(self.xml, "        <DataArray type=\"{kind}\" Name=\"{name}\"")?;
        if components != 1 {
            write!(self.xml, " NumberOfComponents=\"{components}\"")?;
        }
        self.push(" format=\"binary\">");
        if self.compress {
            // The header is a separate piece: number and size of blocks, size of the last if it is smaller,
            // compressed sizes.
            let blocks = raw.len().div_ceil(BLOCK);
            let mut head = vec![blocks as u64, BLOCK as u64, (raw.len() % BLOCK) as u64];
            let mut compressed = Vec::with_capacity(raw.len() / 2);
            for block in raw.chunks(BLOCK) {
                let before = compressed.len();
                if repeats(block) {
                    let mut encoder = ZlibEncoder::new(&mut compressed, Compression::new(LEVEL));
                    encoder.write_all(block)?;
                    encoder.finish()?;
                } else {
                    store(block, &mut compressed);
                }
                head.push((compressed.len() - before) as u64);
            }
            let head: Vec<u8> = head.into_iter().flat_map(u64::to_le_bytes).collect();
            base64::encode(&head, &mut self.xml);
            base64::encode(&compressed, &mut self.xml);
        } else {
            // The number of bytes is in one piece with them; nine bytes make whole groups.
            let (first, rest) = raw.split_at(raw.len().min(1));
            let head: Vec<u8> = (raw.len() as u64).to_le_bytes().iter().chain(first).copied().collect();
            base64::encode(&head, &mut self.xml);
            base64::encode(rest, &mut self.xml);
        }
        self.push("</DataArray>\n");
        Ok(())
    }

    fn reals(&mut self, name: &str, components: usize, values: &[f64], single: bool) -> io::Result<()> {
        if single {
            let raw = bytes(values.iter().map(|&value| (value as f32).to_le_bytes()));
            self.array("Float32", name, components, &raw)
        } else {
            let raw = bytes(values.iter().map(|value| value.to_le_bytes()));
            self.array("Float64", name, components, &raw)
        }
    }

    /// Writes indices below `limit` in the narrowest type that VTK reads well.
    fn indices(&mut self, name: &str, indices: impl Iterator<Item = usize>, limit: usize) -> io::Result<()> {
        if i32::try_from(limit).is_ok() {
            let raw = bytes(indices.map(|index| (index as i32).to_le_bytes()));
            self.array("Int32", name, 1, &raw)
        } else {
            let raw = bytes(indices.map(|index| (index as i64).to_le_bytes()));
            self.array("Int64", name, 1, &raw)
        }
    }

    fn data(&mut self, name: &str, array: &DataArray, single: bool) -> io::Result<()> {
        let is_integer = |&value: &f64| value.fract() == 0.0 && f64::from(value as i32) == value;
        if name == "label" && array.values.iter().all(is_integer) {
            let raw = bytes(array.values.iter().map(|&value| (value as i32).to_le_bytes()));
            return self.array("Int32", name, array.components, &raw);
        }
        self.reals(name, array.components, &array.values, single)
    }

    /// A named set as an array of 0 and 1.
    fn set(&mut self, name: &str, members: impl Iterator<Item = usize>, items: usize) -> io::Result<()> {
        let mut raw = vec![0; items];
        members.for_each(|member| raw[member] = 1);
        self.array("UInt8", &format!("{SET_PREFIX}{name}"), 1, &raw)
    }
}

/// The bytes of numbers, whole numbers at a time.
fn bytes<const N: usize>(numbers: impl Iterator<Item = [u8; N]>) -> Vec<u8> {
    numbers.collect::<Vec<_>>().into_flattened()
}

/// Adds bytes as they are in zlib's format (RFC 1950, in stored blocks of RFC 1951): a library's level 0
/// takes five times as long.
fn store(bytes: &[u8], to: &mut Vec<u8>) {
    to.extend([0x78, 0x01]);
    let mut blocks = bytes.chunks(usize::from(u16::MAX)).peekable();
    while let Some(block) = blocks.next() {
        let length = block.len() as u16;
        to.push(u8::from(blocks.peek().is_none()));
        to.extend(length.to_le_bytes().into_iter().chain((!length).to_le_bytes()));
        to.extend_from_slice(block);
    }
    to.extend(adler32(&bytes).to_be_bytes());
}

/// True if at least one in [`REPEATED`] numbers of `WIDTH` bytes was met shortly before in a block. Otherwise
/// zlib saves no space.
fn repeats<const WIDTH: usize>(block: &[u8]) -> bool {
    const SLOTS: usize = 1024;
    let mut seen = [u64::MAX; SLOTS];
    let mut again = 0;
    let (numbers, _) = block.as_chunks::<WIDTH>();
    for number in numbers {
        let mut bits = [0; 8];
        bits[..WIDTH].copy_from_slice(number);
        let bits = u64::from_le_bytes(bits);
        // Fibonacci hashing.
        let slot = (bits.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (64 - SLOTS.ilog2())) as usize;
        again += usize::from(std::mem::replace(&mut seen[slot], bits) == bits);
    }
    again * REPEATED >= numbers.len()
}

/// Writes a mesh that was checked before.
pub(super) fn write(out: &mut dyn Write, mesh: &Mesh, options: &VtuOptions) -> io::Result<()> {
    write_with(out, mesh, options, &Lasting::of(mesh, options)?)
}

fn write_with(out: &mut dyn Write, mesh: &Mesh, options: &VtuOptions, lasting: &Lasting) -> io::Result<()> {
    let mut parts = Parts { xml: Vec::new(), compress: options.compress };
    let cells: usize = mesh.blocks.iter().map(|block| block.len()).sum();
    let compressor = if options.compress { " compressor=\"vtkZLibDataCompressor\"" } else { "" };
    parts.push("<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" ");
    writeln!(
        parts.xml,
        "byte_order=\"LittleEndian\" header_type=\"UInt64\"{compressor}>\n  <UnstructuredGrid>"
    )?;
    write_field_data(&mut parts, mesh, options)?;
    let points = mesh.points.len();
    writeln!(parts.xml, "    <Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">")?;
    write_point_data(&mut parts, mesh, options, &lasting.point_sets)?;
    write_cell_data(&mut parts, mesh, options, cells, &lasting.cell_sets)?;
    parts.xml.extend_from_slice(&lasting.shape);
    parts.push("    </Piece>\n  </UnstructuredGrid>\n</VTKFile>\n");
    out.write_all(&parts.xml)
}

/// Writes the time, and the names of labels and bodies. Each name becomes a text such as `5 liver`, stored as
/// numbers: its bytes in UTF-8 and a 0. Files with an array of type `String` are unreadable for meshio 5.3.5.
fn write_field_data(parts: &mut Parts, mesh: &Mesh, options: &VtuOptions) -> io::Result<()> {
    let names = [(LABEL_NAMES, &mesh.label_names), (BODY_NAMES, &mesh.body_names)];
    if options.time.is_none() && names.iter().all(|(_, names)| names.is_empty()) {
        return Ok(());
    }
    parts.push("    <FieldData>\n");
    if let Some(time) = options.time {
        parts.push("      <DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\"");
        writeln!(parts.xml, " format=\"ascii\">{time:?}</DataArray>")?;
    }
    for (of, names) in names.into_iter().filter(|(_, names)| !names.is_empty()) {
        let texts: String = names.iter().map(|(number, name)| format!("{number} {name}\0")).collect();
        let count = texts.len();
        write!(parts.xml, "      <DataArray type=\"UInt8\" Name=\"{of}\" NumberOfTuples=\"{count}\"")?;
        parts.push(" format=\"ascii\">");
        for byte in texts.bytes() {
            write!(parts.xml, "{byte} ")?;
        }
        parts.push("</DataArray>\n");
    }
    parts.push("    </FieldData>\n");
    Ok(())
}

fn write_point_data(parts: &mut Parts, mesh: &Mesh, options: &VtuOptions, sets: &[u8]) -> io::Result<()> {
    if mesh.point_data.is_empty() && sets.is_empty() {
        return Ok(());
    }
    parts.push("      <PointData>\n");
    for (name, array) in &mesh.point_data {
        parts.data(name, array, options.single)?;
    }
    parts.xml.extend_from_slice(sets);
    parts.push("      </PointData>\n");
    Ok(())
}

fn write_cell_data(
    parts: &mut Parts,
    mesh: &Mesh,
    options: &VtuOptions,
    cells: usize,
    sets: &[u8],
) -> io::Result<()> {
    let names: BTreeMap<&String, usize> = mesh
        .blocks
        .iter()
        .flat_map(|block| block.data.iter().map(|(name, array)| (name, array.components)))
        .collect();
    if names.is_empty() && sets.is_empty() {
        return Ok(());
    }
    parts.push("      <CellData>\n");
    for (name, components) in names {
        let mut joined = DataArray { components, values: Vec::with_capacity(cells * components) };
        for block in &mesh.blocks {
            match block.data.get(name) {
                Some(array) => joined.values.extend_from_slice(&array.values),
                None => joined.values.resize(joined.values.len() + block.len() * components, f64::NAN),
            }
        }
        parts.data(name, &joined, options.single)?;
    }
    parts.xml.extend_from_slice(sets);
    parts.push("      </CellData>\n");
    Ok(())
}

fn write_cell_sets(parts: &mut Parts, mesh: &Mesh) -> io::Result<()> {
    let cells = mesh.blocks.iter().map(|block| block.len()).sum();
    let sets: BTreeSet<&String> = mesh.blocks.iter().flat_map(|block| block.sets.keys()).collect();
    for name in sets {
        let starts = mesh.blocks.iter().scan(0, |next, block| {
            let start = *next;
            *next += block.len();
            Some(start)
        });
        let members = mesh.blocks.iter().zip(starts).flat_map(|(block, start)| {
            block.sets.get(name).into_iter().flatten().map(move |&cell| start + cell as usize)
        });
        parts.set(name, members, cells)?;
    }
    Ok(())
}

fn write_cells(parts: &mut Parts, mesh: &Mesh) -> io::Result<()> {
    parts.push("      <Cells>\n");
    let nodes = mesh.blocks.iter().flat_map(|block| block.nodes.iter().map(|&node| node as usize));
    parts.indices("connectivity", nodes, mesh.points.len())?;
    let sizes =
        mesh.blocks.iter().flat_map(|block| std::iter::repeat_n(block.kind.node_count(), block.len()));
    let ends = sizes.scan(0, |end, size| {
        *end += size;
        Some(*end)
    });
    parts.indices("offsets", ends, mesh.blocks.iter().map(|block| block.nodes.len()).sum())?;
    let types: Vec<u8> = mesh
        .blocks
        .iter()
        .flat_map(|block| std::iter::repeat_n(type_number(block.kind), block.len()))
        .collect();
    parts.array("UInt8", "types", 1, &types)?;
    parts.push("      </Cells>\n");
    Ok(())
}

/// Text for an attribute of an XML element.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            // Other control characters are not allowed in XML at all.
            '\t' | '\n' | '\r' => {
                let _ = write!(escaped, "&#{};", character as u32);
            }
            c if c.is_control() => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;

    #[test]
    fn bytes_stored_as_they_are_are_read_as_zlib() {
        for count in [1, 65_535, 65_536, BLOCK, 200_000] {
            let bytes: Vec<u8> = (0..count).map(|i| (i * i / 7) as u8).collect();
            let (mut stored, mut read) = (Vec::new(), Vec::new());
            store(&bytes, &mut stored);
            flate2::read::ZlibDecoder::new(stored.as_slice()).read_to_end(&mut read).unwrap();
            assert_eq!(read, bytes);
        }
    }
}
