//! Reads legacy VTK files (`.vtk`), text and binary, versions 1 to 5.1: unstructured grids and poly-data.
//! Leaves out structured grids and images, look-up tables and texts.

use std::collections::BTreeMap;

use super::cells::{Cells, finite_points};
use super::cursor::{Cursor, Order, Scalar, name, shown};
use super::error::{Fault, Place};
use super::vtk_cells::{Connectivity, PolyList, add_grid, add_poly};
use super::{Format, MeshFile};
use crate::{DataArray, Vector3};

/// Owner of the attributes: points or cells.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Owner {
    Points,
    Cells,
    File,
}

/// A type of numbers in a legacy file.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Stored {
    Number(Scalar),
    /// Eight to the byte in binary.
    Bit,
    Text,
}

#[derive(Default)]
struct Model {
    points: Vec<Vector3>,
    grid: Option<(Connectivity, Place)>,
    types: Option<Vec<i64>>,
    lists: Vec<(PolyList, Connectivity, Place)>,
    point_data: BTreeMap<String, DataArray>,
    cell_data: BTreeMap<String, DataArray>,
    time: Option<f64>,
}

struct Reader<'a> {
    cursor: Cursor<'a>,
    binary: bool,
    version: String,
    model: Model,
    notes: Vec<String>,
}

/// Reads a legacy VTK file.
pub(super) fn read(bytes: &[u8]) -> Result<MeshFile, Fault> {
    let mut cursor = Cursor::new(bytes);
    let head = cursor.line().unwrap_or_default();
    let version = head.strip_prefix(b"# vtk DataFile Version ");
    let Some(version) = version else {
        return Err(Fault::malformed(
            Place::Line(1),
            format!("the first line is `{}`, not `# vtk DataFile Version …`", shown(head)),
        ));
    };
    cursor.line();
    let encoding = cursor.need_word("ASCII or BINARY")?;
    let binary = match encoding {
        word if word.eq_ignore_ascii_case(b"ASCII") => false,
        word if word.eq_ignore_ascii_case(b"BINARY") => true,
        word => return Err(cursor.malformed(format!("`{}` found instead of ASCII or BINARY", shown(word)))),
    };
    let mut reader =
        Reader { cursor, binary, version: name(version), model: Model::default(), notes: Vec::new() };
    reader.read_sections()?;
    let format =
        format!("{} {} {}", Format::Vtk.name(), reader.version, if binary { "binary" } else { "ASCII" });
    let mut file = reader.finish()?;
    file.format = format;
    Ok(file)
}

impl Reader<'_> {
    fn read_sections(&mut self) -> Result<(), Fault> {
        let mut owner = (Owner::File, 0);
        while let Some(word) = self.cursor.word() {
            match word.to_ascii_uppercase().as_slice() {
                b"DATASET" => self.read_dataset()?,
                b"POINTS" => self.read_points()?,
                b"CELLS" => {
                    let place = self.cursor.place();
                    let connectivity = self.read_connectivity()?;
                    self.model.grid = Some((connectivity, place));
                }
                b"CELL_TYPES" => {
                    let count = self.cursor.count(1, format_args!("the number of cell types"))?;
                    self.model.types = Some(self.integers(count, Scalar::I32, "cell types")?);
                }
                b"VERTICES" => self.read_list(PolyList::Vertices)?,
                b"LINES" => self.read_list(PolyList::Lines)?,
                b"POLYGONS" => self.read_list(PolyList::Polygons)?,
                b"TRIANGLE_STRIPS" => self.read_list(PolyList::Strips)?,
                b"POINT_DATA" => owner = (Owner::Points, self.items("POINT_DATA", self.model.points.len())?),
                b"CELL_DATA" => owner = (Owner::Cells, self.items("CELL_DATA", self.cell_count())?),
                b"METADATA" => self.skip_metadata(),
                b"FIELD" => self.read_field(owner)?,
                attribute => self.read_attribute(attribute, owner)?,
            }
        }
        Ok(())
    }

    /// Metadata end with an empty line.
    fn skip_metadata(&mut self) {
        self.cursor.line();
        while self.cursor.line().is_some_and(|line| !line.trim_ascii().is_empty()) {}
    }

    fn read_dataset(&mut self) -> Result<(), Fault> {
        let kind = self.cursor.need_word("the kind of data set")?.to_ascii_uppercase();
        if kind == b"UNSTRUCTURED_GRID" || kind == b"POLYDATA" {
            return Ok(());
        }
        Err(Fault::unsupported(
            self.cursor.place(),
            format!("the VTK data set {} is", shown(&kind)),
            "save it as an unstructured grid or as poly-data",
        ))
    }

    fn cell_count(&self) -> usize {
        let grid = self.model.grid.as_ref().map_or(0, |(connectivity, _)| connectivity.len());
        grid + self.model.lists.iter().map(|(_, connectivity, _)| connectivity.len()).sum::<usize>()
    }

    /// The count of a data section, which must equal the number of points or cells.
    fn items(&mut self, section: &str, expected: usize) -> Result<usize, Fault> {
        let count = self.cursor.count(0, format_args!("the count of {section}"))?;
        if count == expected {
            return Ok(count);
        }
        Err(self.cursor.malformed(format!("{section} announces {count} items, but there are {expected}")))
    }

    fn read_points(&mut self) -> Result<(), Fault> {
        let count = self.cursor.count(3, format_args!("the number of points"))?;
        let stored = self.stored()?;
        let place = self.cursor.place();
        let coordinates = self.reals(count.saturating_mul(3), stored, "the points")?;
        self.model.points = finite_points(&coordinates, place)?;
        Ok(())
    }

    /// `n size` and the cells: counts with nodes, or (version 5) offsets and connectivity.
    fn read_connectivity(&mut self) -> Result<Connectivity, Fault> {
        let count = self.cursor.count(1, format_args!("the number of cells"))?;
        let size = self.cursor.count(1, format_args!("the size of the cell list"))?;
        let place = self.cursor.place();
        let before = self.cursor.clone();
        if !self.cursor.word().is_some_and(|word| word.eq_ignore_ascii_case(b"OFFSETS")) {
            self.cursor.rewind(before);
            let counted = self.integers(size, Scalar::I32, "the cells")?;
            return Connectivity::from_counted(&counted, count, place);
        }
        let scalar = self.stored_integer()?;
        let offsets = self.integers(count, scalar, "the offsets of the cells")?;
        let word = self.cursor.need_word("CONNECTIVITY")?;
        if !word.eq_ignore_ascii_case(b"CONNECTIVITY") {
            return Err(self.cursor.malformed(format!("`{}` found instead of CONNECTIVITY", shown(word))));
        }
        let scalar = self.stored_integer()?;
        let nodes = self.integers(size, scalar, "the connectivity of the cells")?;
        Ok(Connectivity::from_offsets(offsets, nodes))
    }

    fn read_list(&mut self, list: PolyList) -> Result<(), Fault> {
        let place = self.cursor.place();
        let connectivity = self.read_connectivity()?;
        self.model.lists.push((list, connectivity, place));
        Ok(())
    }

    /// An attribute of points or cells: `SCALARS`, `VECTORS`, ….
    fn read_attribute(&mut self, attribute: &[u8], (owner, items): (Owner, usize)) -> Result<(), Fault> {
        let known: &[&[u8]] = &[
            b"SCALARS",
            b"COLOR_SCALARS",
            b"LOOKUP_TABLE",
            b"VECTORS",
            b"NORMALS",
            b"TENSORS",
            b"TENSORS6",
            b"TEXTURE_COORDINATES",
            b"GLOBAL_IDS",
            b"PEDIGREE_IDS",
            b"EDGE_FLAGS",
        ];
        if !known.contains(&attribute) {
            let what =
                format!("`{}` found where a section must begin (wrong count before?)", shown(attribute));
            return Err(self.cursor.malformed(what));
        }
        let title = decoded(self.cursor.need_word("the name of an array")?);
        let byte = Stored::Number(Scalar::U8);
        let colour = if self.binary { byte } else { Stored::Number(Scalar::F32) };
        let what = format!("array `{title}`");
        let (components, stored, scale) = match attribute {
            b"SCALARS" => {
                let stored = self.stored()?;
                let mut line = Cursor::new(self.cursor.line().unwrap_or_default());
                let components = match line.word() {
                    Some(_) if owner == Owner::File => 1,
                    Some(word) => self.cursor.parse(word, "a count", &what)?,
                    None => 1,
                };
                let before = self.cursor.clone();
                if self.cursor.word().is_some_and(|word| word.eq_ignore_ascii_case(b"LOOKUP_TABLE")) {
                    self.cursor.line();
                } else {
                    self.cursor.rewind(before);
                }
                return self.read_array(title, components, items, stored, 1.0, owner, true);
            }
            b"LOOKUP_TABLE" => {
                let count = self.cursor.count(4, format_args!("the size of a look-up table"))?;
                self.reals(count.saturating_mul(4), colour, &what)?;
                return Ok(());
            }
            b"COLOR_SCALARS" => {
                let components = self.cursor.count(0, format_args!("{what}"))?;
                (components, colour, if self.binary { 1.0 / 255.0 } else { 1.0 })
            }
            b"TEXTURE_COORDINATES" => {
                let components = self.cursor.count(0, format_args!("{what}"))?;
                (components, self.stored()?, 1.0)
            }
            b"VECTORS" | b"NORMALS" => (3, self.stored()?, 1.0),
            b"TENSORS" => (9, self.stored()?, 1.0),
            b"TENSORS6" => (6, self.stored()?, 1.0),
            _ => (1, self.stored()?, 1.0),
        };
        self.read_array(title, components, items, stored, scale, owner, false)
    }

    /// `FIELD name count`, then arrays with their own name, components, items and type.
    fn read_field(&mut self, (owner, items): (Owner, usize)) -> Result<(), Fault> {
        self.cursor.need_word("the name of a field")?;
        let count = self.cursor.count(4, format_args!("the number of arrays of a field"))?;
        for i in 1..=count {
            let word = self.cursor.need_word(format_args!("array {i} of {count} of a field"))?;
            let mut title = decoded(word);
            if word == b"METADATA" {
                self.skip_metadata();
                title = decoded(self.cursor.need_word("the name of an array")?);
            }
            if title == "NULL_ARRAY" {
                continue;
            }
            let components = self.cursor.count(0, format_args!("the components of array `{title}`"))?;
            let tuples = self.cursor.count(0, format_args!("the items of array `{title}`"))?;
            let stored = self.stored()?;
            if owner != Owner::File && tuples != items && stored != Stored::Text {
                return Err(self
                    .cursor
                    .malformed(format!("array `{title}` has {tuples} items, not {items}")));
            }
            self.read_array(title, components, tuples, stored, 1.0, owner, false)?;
        }
        Ok(())
    }

    #[expect(clippy::too_many_arguments, reason = "the words of an array's head, in their order")]
    fn read_array(
        &mut self,
        title: String,
        components: usize,
        items: usize,
        stored: Stored,
        scale: f64,
        owner: Owner,
        line_read: bool,
    ) -> Result<(), Fault> {
        let what = format!("array `{title}`");
        let Some(count) = components.checked_mul(items) else { return Err(self.cursor.truncated(what)) };
        if stored == Stored::Text {
            return self.skip_texts(count, &title);
        }
        let mut values = self.reals_after(count, stored, &what, line_read)?;
        if scale != 1.0 {
            values.iter_mut().for_each(|value| *value *= scale);
        }
        if owner == Owner::File {
            if title.eq_ignore_ascii_case("TimeValue") {
                self.model.time = values.first().copied().filter(|time| time.is_finite());
            }
            return Ok(());
        }
        if components == 0 {
            return Ok(());
        }
        let array = DataArray { components, values };
        let data =
            if owner == Owner::Points { &mut self.model.point_data } else { &mut self.model.cell_data };
        data.insert(title, array);
        Ok(())
    }

    /// Texts are passed over: lines, or in binary bytes after their length.
    fn skip_texts(&mut self, count: usize, title: &str) -> Result<(), Fault> {
        self.notes.push(format!("array `{title}` contains text and was ignored"));
        let what = format!("text array `{title}`");
        self.cursor.line();
        for _ in 0..count {
            if !self.binary {
                self.cursor.line().ok_or_else(|| self.cursor.truncated(&what))?;
                continue;
            }
            // The two highest bits of the first byte give the number of bytes of the length.
            let first = self.cursor.take(1, &what)?[0];
            let more = match first >> 6 {
                3 => 0,
                2 => 1,
                1 => 3,
                _ => 7,
            };
            let more = self.cursor.take(more, &what)?;
            let length =
                more.iter().fold(usize::from(first & 0x3f), |sum, &byte| (sum << 8) | usize::from(byte));
            self.cursor.take(length, &what)?;
        }
        Ok(())
    }

    fn stored(&mut self) -> Result<Stored, Fault> {
        let word = self.cursor.need_word("the type of an array")?.to_ascii_lowercase();
        Ok(Stored::Number(match word.as_slice() {
            b"bit" => return Ok(Stored::Bit),
            b"string" | b"utf8_string" => return Ok(Stored::Text),
            b"unsigned_char" | b"vtktypeuint8" => Scalar::U8,
            b"char" | b"signed_char" | b"vtktypeint8" => Scalar::I8,
            b"unsigned_short" | b"vtktypeuint16" => Scalar::U16,
            b"short" | b"vtktypeint16" => Scalar::I16,
            b"unsigned_int" | b"vtktypeuint32" => Scalar::U32,
            // VTK writes its index type as `int`.
            b"int" | b"vtktypeint32" | b"vtkidtype" => Scalar::I32,
            b"unsigned_long" | b"unsigned_long_long" | b"vtktypeuint64" => Scalar::U64,
            b"long" | b"long_long" | b"vtktypeint64" => Scalar::I64,
            b"float" | b"vtktypefloat32" => Scalar::F32,
            b"double" | b"vtktypefloat64" => Scalar::F64,
            other => return Err(self.cursor.malformed(format!("`{}` is not a number type", shown(other)))),
        }))
    }

    fn stored_integer(&mut self) -> Result<Scalar, Fault> {
        match self.stored()? {
            Stored::Number(scalar) if scalar.is_integer() => Ok(scalar),
            _ => Err(self.cursor.malformed("offsets and connectivity must be integers")),
        }
    }

    fn reals(&mut self, count: usize, stored: Stored, what: &str) -> Result<Vec<f64>, Fault> {
        self.reals_after(count, stored, what, false)
    }

    /// Numbers, in binary after the end of the line unless that was read before.
    fn reals_after(
        &mut self,
        count: usize,
        stored: Stored,
        what: &str,
        line_read: bool,
    ) -> Result<Vec<f64>, Fault> {
        if !self.binary {
            self.cursor.room(count, 2, what)?;
            return (0..count).map(|_| self.cursor.real(format_args!("{what}"))).collect();
        }
        if !line_read {
            self.cursor.line();
        }
        match stored {
            Stored::Number(scalar) => {
                Ok(scalar.decode(self.cursor.take_numbers(count, scalar, what)?, Order::Big))
            }
            _ => {
                let bytes = self.cursor.take(count.div_ceil(8), what)?;
                Ok((0..count).map(|i| f64::from(bytes[i / 8] >> (7 - i % 8) & 1)).collect())
            }
        }
    }

    fn integers(&mut self, count: usize, scalar: Scalar, what: &str) -> Result<Vec<i64>, Fault> {
        if !self.binary {
            self.cursor.room(count, 2, what)?;
            return (0..count).map(|_| self.cursor.integer(format_args!("{what}"))).collect();
        }
        self.cursor.line();
        Ok(scalar.decode_integers(self.cursor.take_numbers(count, scalar, what)?, Order::Big))
    }

    fn finish(self) -> Result<MeshFile, Fault> {
        let Model { points, grid, types, mut lists, point_data, cell_data, time } = self.model;
        let mut cells = Cells::default();
        if let Some((connectivity, place)) = grid {
            let types = types.unwrap_or_default();
            add_grid(&mut cells, &types, &connectivity, 0, points.len(), place)?;
        }
        // Cell data of poly-data follow the lists in this order, whatever the order in the file.
        lists.sort_by_key(|(list, ..)| match list {
            PolyList::Vertices => 0,
            PolyList::Lines => 1,
            PolyList::Polygons => 2,
            PolyList::Strips => 3,
        });
        for (list, connectivity, place) in &lists {
            add_poly(&mut cells, *list, connectivity, 0, points.len(), *place)?;
        }
        for (title, array) in &cell_data {
            if array.len() == cells.len() {
                cells.add_data(title, array);
            }
        }
        let mut point_data = point_data;
        point_data.retain(|_, array| array.len() == points.len());
        let mut notes = self.notes;
        let mesh = cells.into_mesh(points, point_data, &mut notes)?;
        Ok(MeshFile { mesh, format: String::new(), notes, time })
    }
}

/// A name with `%20` and the like turned back into characters.
fn decoded(word: &[u8]) -> String {
    let mut bytes = Vec::with_capacity(word.len());
    let mut rest = word;
    while let [first, tail @ ..] = rest {
        let hex = tail.get(..2).and_then(|hex| std::str::from_utf8(hex).ok());
        match hex.and_then(|hex| u8::from_str_radix(hex, 16).ok()) {
            Some(byte) if *first == b'%' => {
                bytes.push(byte);
                rest = &tail[2..];
            }
            _ => {
                bytes.push(*first);
                rest = tail;
            }
        }
    }
    name(&bytes)
}
