//! PLY: reads text and binary of both byte orders, writes binary surfaces. Further properties of vertices,
//! faces and edges become data; `name_0`, `name_1`, … one array `name`; `set:NAME` a named set. Leaves out
//! properties that are lists, and elements other than vertices, faces and edges.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Write};

use super::cells::{Cells, SET_PREFIX, check_filled, finite, index_limit, node};
use super::cursor::{Cursor, Order, Scalar, name, shown};
use super::error::Fault;
use super::surface_out::SurfaceOut;
use super::{Format, MeshFile};
use crate::{CellKind, DataArray, Vector3};

/// A property of an element.
struct Property {
    name: String,
    scalar: Scalar,
    /// The type of the length if the property is a list.
    length: Option<Scalar>,
}

/// A list of vertices, faces, ….
struct PlyElement {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

#[derive(Clone, Copy)]
enum PlyEncoding {
    Text,
    Binary(Order),
}

struct PlyReader<'a> {
    cursor: Cursor<'a>,
    file_size: usize,
    encoding: PlyEncoding,
    points: Vec<Vector3>,
    cells: Cells,
    point_data: BTreeMap<String, Vec<f64>>,
    cell_data: BTreeMap<String, Vec<f64>>,
    notes: Vec<String>,
}

/// Reads a PLY file.
pub(super) fn read(bytes: &[u8]) -> Result<MeshFile, Fault> {
    let mut cursor = Cursor::new(bytes);
    let (encoding, elements) = read_head(&mut cursor)?;
    let mut reader = PlyReader {
        cursor,
        file_size: bytes.len(),
        encoding,
        points: Vec::new(),
        cells: Cells::default(),
        point_data: BTreeMap::new(),
        cell_data: BTreeMap::new(),
        notes: Vec::new(),
    };
    for element in &elements {
        match element.name.as_str() {
            "vertex" => reader.read_points(element)?,
            "face" | "edge" => reader.read_cells(element)?,
            _ => reader.skip(element)?,
        }
    }
    let encoding = match encoding {
        PlyEncoding::Text => "ASCII",
        PlyEncoding::Binary(Order::Little) => "binary little-endian",
        PlyEncoding::Binary(Order::Big) => "binary big-endian",
    };
    let PlyReader { points, mut cells, point_data, mut cell_data, mut notes, .. } = reader;
    check_filled(cell_data.len().saturating_mul(cells.len()), bytes.len())?;
    for values in cell_data.values_mut() {
        values.resize(cells.len(), f64::NAN);
    }
    for (name, array) in joined(cell_data) {
        cells.add_data(&name, &array);
    }
    let mesh = cells.into_mesh(points, joined(point_data), &mut notes)?;
    Ok(MeshFile { mesh, format: format!("{} {encoding}", Format::Ply.name()), notes, time: None })
}

fn read_head(cursor: &mut Cursor<'_>) -> Result<(PlyEncoding, Vec<PlyElement>), Fault> {
    let mut encoding = None;
    let mut elements: Vec<PlyElement> = Vec::new();
    if cursor.line().is_none_or(|line| line.trim_ascii() != b"ply") {
        return Err(cursor.malformed("the first line is not `ply`"));
    }
    loop {
        let place = cursor.place();
        let Some(line) = cursor.line() else { return Err(cursor.truncated("the header of the file")) };
        let mut words = Cursor::of_line(line, place);
        match words.word() {
            Some(b"format") => {
                encoding = Some(match words.need_word("the format")? {
                    b"ascii" => PlyEncoding::Text,
                    b"binary_little_endian" => PlyEncoding::Binary(Order::Little),
                    b"binary_big_endian" => PlyEncoding::Binary(Order::Big),
                    other => return Err(words.malformed(format!("`{}` is not a PLY format", shown(other)))),
                });
            }
            Some(b"element") => {
                let name = name(words.need_word("the name of an element")?);
                let word = words.need_word("a count")?;
                let count = words.parse(word, "a count", format_args!("the number of `{name}`"))?;
                if elements.iter().any(|element| element.name == name) {
                    return Err(words.malformed(format!("there are two lists of `{name}`")));
                }
                elements.push(PlyElement { name, count, properties: Vec::new() });
            }
            Some(b"property") => {
                let property = read_property(&mut words)?;
                let Some(element) = elements.last_mut() else {
                    return Err(words.malformed("a property comes before the first element"));
                };
                element.properties.push(property);
            }
            Some(b"end_header") => break,
            // Comments.
            _ => {}
        }
    }
    match encoding {
        Some(encoding) => Ok((encoding, elements)),
        None => Err(cursor.malformed("the header has no line `format …`")),
    }
}

fn read_property(words: &mut Cursor<'_>) -> Result<Property, Fault> {
    let what = "a property";
    let mut word = words.need_word(what)?;
    let mut length = None;
    if word == b"list" {
        let kind = scalar(words)?;
        if !kind.is_integer() {
            return Err(words.malformed("the length of a list must be an integer"));
        }
        length = Some(kind);
        word = words.need_word(what)?;
    }
    let scalar =
        scalar_of(word).ok_or_else(|| words.malformed(format!("`{}` is not a number type", shown(word))))?;
    Ok(Property { name: name(words.need_word(what)?), scalar, length })
}

fn scalar(words: &mut Cursor<'_>) -> Result<Scalar, Fault> {
    let word = words.need_word("a type")?;
    scalar_of(word).ok_or_else(|| words.malformed(format!("`{}` is not a number type", shown(word))))
}

fn scalar_of(word: &[u8]) -> Option<Scalar> {
    Some(match word {
        b"char" | b"int8" => Scalar::I8,
        b"uchar" | b"uint8" => Scalar::U8,
        b"short" | b"int16" => Scalar::I16,
        b"ushort" | b"uint16" => Scalar::U16,
        b"int" | b"int32" => Scalar::I32,
        b"uint" | b"uint32" => Scalar::U32,
        b"float" | b"float32" => Scalar::F32,
        b"double" | b"float64" => Scalar::F64,
        _ => return None,
    })
}

/// Joins `name_0`, `name_1`, … into one array `name` of as many components.
fn joined(mut columns: BTreeMap<String, Vec<f64>>) -> BTreeMap<String, DataArray> {
    let stems: Vec<String> = columns
        .keys()
        .filter_map(|name| name.strip_suffix("_0"))
        .filter(|stem| columns.contains_key(&format!("{stem}_1")) && !columns.contains_key(*stem))
        .map(str::to_owned)
        .collect();
    let mut arrays = BTreeMap::new();
    for stem in stems {
        let parts: Vec<Vec<f64>> = (0..).map_while(|i| columns.remove(&format!("{stem}_{i}"))).collect();
        let items = parts[0].len();
        let values = (0..items).flat_map(|item| parts.iter().map(move |part| part[item])).collect();
        arrays.insert(stem, DataArray { components: parts.len(), values });
    }
    arrays.extend(columns.into_iter().map(|(name, values)| (name, DataArray::scalar(values))));
    arrays
}

impl PlyReader<'_> {
    /// Checks that the items of an element can be there, by their smallest size.
    fn room(&self, element: &PlyElement) -> Result<(), Fault> {
        let each = |property: &Property| match self.encoding {
            PlyEncoding::Text => 2,
            PlyEncoding::Binary(_) => property.length.unwrap_or(property.scalar).size(),
        };
        let each = element.properties.iter().map(each).sum();
        self.cursor.room(element.count, each, format_args!("{} of `{}`", element.count, element.name))
    }

    fn number(&mut self, scalar: Scalar, element: &PlyElement, item: usize) -> Result<f64, Fault> {
        let what = format_args!("item {item} of `{}`", element.name);
        match self.encoding {
            PlyEncoding::Text => self.cursor.real(what),
            PlyEncoding::Binary(order) => Ok(scalar.decode(self.cursor.take(scalar.size(), what)?, order)[0]),
        }
    }

    /// A list into `list`.
    fn list(
        &mut self,
        scalar: Scalar,
        length: Scalar,
        element: &PlyElement,
        item: usize,
        list: &mut Vec<i64>,
    ) -> Result<(), Fault> {
        list.clear();
        let count = self.number(length, element, item)?;
        if !(count >= 0.0 && count.fract() == 0.0) {
            let what = format!("item {item} of `{}` has a list of {count} numbers", element.name);
            return Err(self.cursor.malformed(what));
        }
        let what = format_args!("a list of item {item} of `{}`", element.name);
        let count = count as usize;
        match self.encoding {
            PlyEncoding::Text => {
                self.cursor.room(count, 2, what)?;
                for _ in 0..count {
                    // Lists other than the corners may hold fractions.
                    list.push(self.cursor.real(what)? as i64);
                }
            }
            PlyEncoding::Binary(order) => {
                let bytes = self.cursor.take_numbers(count, scalar, what)?;
                list.extend(scalar.decode_integers(bytes, order));
            }
        }
        Ok(())
    }

    fn read_points(&mut self, element: &PlyElement) -> Result<(), Fault> {
        self.room(element)?;
        index_limit(element.count, self.cursor.place())?;
        let at = |wanted: &str| element.properties.iter().position(|property| property.name == wanted);
        let (Some(x), Some(y), Some(z)) = (at("x"), at("y"), at("z")) else {
            return Err(self.cursor.malformed("the vertices lack x, y or z"));
        };
        let mut columns = vec![Vec::new(); element.properties.len()];
        let mut row = vec![0.0; element.properties.len()];
        let mut list = Vec::new();
        for item in 0..element.count {
            for (i, property) in element.properties.iter().enumerate() {
                match property.length {
                    None => row[i] = self.number(property.scalar, element, item)?,
                    Some(length) => self.list(property.scalar, length, element, item, &mut list)?,
                }
                if property.length.is_none() && ![x, y, z].contains(&i) {
                    columns[i].push(row[i]);
                }
            }
            self.points.push(finite(row[x], row[y], row[z], item as u64, self.cursor.place())?);
        }
        for (i, (property, column)) in element.properties.iter().zip(columns).enumerate() {
            match property.length {
                Some(_) => self.note_list(element, property),
                None if [x, y, z].contains(&i) => {}
                None => {
                    self.point_data.insert(property.name.clone(), column);
                }
            }
        }
        Ok(())
    }

    fn note_list(&mut self, element: &PlyElement, property: &Property) {
        self.notes.push(format!("the list `{}` of `{}` was ignored", property.name, element.name));
    }

    /// Faces, by their list of corners, or edges, by two vertices.
    fn read_cells(&mut self, element: &PlyElement) -> Result<(), Fault> {
        self.room(element)?;
        index_limit(element.count, self.cursor.place())?;
        let at = |wanted: &str| element.properties.iter().position(|property| property.name == wanted);
        let is_face = element.name == "face";
        let corner_list = at("vertex_indices").or_else(|| at("vertex_index")).filter(|_| is_face);
        let ends = at("vertex1").zip(at("vertex2")).filter(|_| !is_face);
        if element.count > 0 && corner_list.is_none() && ends.is_none() {
            let what = format!("`{}` lacks the numbers of its vertices", element.name);
            return Err(self.cursor.malformed(what));
        }
        let is_data = |i: usize, property: &Property| {
            property.length.is_none() && ends.is_none_or(|(a, b)| i != a && i != b)
        };
        let first = self.cells.len();
        check_filled((first + element.count).saturating_mul(element.properties.len()), self.file_size)?;
        let mut columns = vec![Vec::new(); element.properties.len()];
        let mut row = vec![0.0; element.properties.len()];
        let (mut list, mut indices, mut corners) = (Vec::new(), Vec::new(), Vec::new());
        for item in 0..element.count {
            indices.clear();
            for (i, property) in element.properties.iter().enumerate() {
                match property.length {
                    Some(length) if corner_list == Some(i) => {
                        self.list(property.scalar, length, element, item, &mut indices)?;
                    }
                    Some(length) => self.list(property.scalar, length, element, item, &mut list)?,
                    None => row[i] = self.number(property.scalar, element, item)?,
                }
                if is_data(i, property) {
                    columns[i].push(row[i]);
                }
            }
            if let Some((a, b)) = ends {
                indices.extend([row[a] as i64, row[b] as i64]);
            }
            let place = self.cursor.place();
            corners.clear();
            for &index in &indices {
                corners.push(node(index, self.points.len(), place, || format!("{} {item}", element.name))?);
            }
            self.cells.open();
            match corners.len() {
                0 => self.cells.skip("face without corners", 0),
                1 => self.cells.push(CellKind::Vertex, &corners),
                2 => self.cells.push(CellKind::Line, &corners),
                _ => self.cells.push_polygon(&corners),
            }
        }
        for (i, (property, column)) in element.properties.iter().zip(columns).enumerate() {
            if is_data(i, property) {
                let values = self.cell_data.entry(property.name.clone()).or_default();
                values.resize(first, f64::NAN);
                values.extend(column);
            } else if property.length.is_some() && corner_list != Some(i) {
                self.note_list(element, property);
            }
        }
        Ok(())
    }

    /// Passes over an element that is not used.
    fn skip(&mut self, element: &PlyElement) -> Result<(), Fault> {
        self.notes.push(format!("{} `{}` were ignored", element.count, element.name));
        if element.properties.is_empty() {
            return Ok(());
        }
        self.room(element)?;
        let mut list = Vec::new();
        for item in 0..element.count {
            for property in &element.properties {
                match property.length {
                    None => {
                        self.number(property.scalar, element, item)?;
                    }
                    Some(length) => self.list(property.scalar, length, element, item, &mut list)?,
                }
            }
        }
        Ok(())
    }
}

/// A column to be written: the name, the type, and the values.
struct Column {
    name: String,
    scalar: Scalar,
    values: Vec<f64>,
}

impl Column {
    /// The columns of an array, one for each component.
    fn of(name: &str, array: &DataArray, items: impl Iterator<Item = usize> + Clone) -> Vec<Self> {
        let is_integer = |value: f64| value.fract() == 0.0 && f64::from(value as i32) == value;
        (0..array.components)
            .map(|component| {
                let values: Vec<f64> = items.clone().map(|item| array.item(item)[component]).collect();
                let integral = name == "label" && values.iter().all(|&value| is_integer(value));
                let suffix = if array.components == 1 { String::new() } else { format!("_{component}") };
                let scalar = if integral { Scalar::I32 } else { Scalar::F64 };
                Self { name: format!("{name}{suffix}"), scalar, values }
            })
            .collect()
    }

    fn of_set(name: &str, items: usize, members: impl Iterator<Item = usize>) -> Self {
        let mut values = vec![0.0; items];
        members.for_each(|member| values[member] = 1.0);
        Self { name: format!("{SET_PREFIX}{name}"), scalar: Scalar::U8, values }
    }

    /// The line of the head; names are one word.
    fn write_head(&self, out: &mut dyn Write) -> io::Result<()> {
        let kind = match self.scalar {
            Scalar::U8 => "uchar",
            Scalar::I32 => "int",
            _ => "double",
        };
        let word: String = self.name.chars().map(|c| if c.is_whitespace() { '_' } else { c }).collect();
        writeln!(out, "property {kind} {word}")
    }

    fn write_item(&self, out: &mut dyn Write, item: usize) -> io::Result<()> {
        let value = self.values[item];
        match self.scalar {
            Scalar::U8 => out.write_all(&[value as u8]),
            Scalar::I32 => out.write_all(&(value as i32).to_le_bytes()),
            _ => out.write_all(&value.to_le_bytes()),
        }
    }
}

/// Writes the surface cells of a mesh with data and sets, binary little-endian. White space in names becomes
/// `_`.
pub(super) fn write(
    out: &mut dyn Write,
    surface: &SurfaceOut<'_>,
    point_data: &BTreeMap<String, DataArray>,
    point_sets: &BTreeMap<String, Vec<u32>>,
) -> io::Result<()> {
    let kept = surface.kept.iter().map(|&point| point as usize);
    let mut of_points: Vec<Column> =
        point_data.iter().flat_map(|(name, array)| Column::of(name, array, kept.clone())).collect();
    for (name, set) in point_sets {
        let members = set.iter().filter_map(|point| surface.kept.binary_search(point).ok());
        of_points.push(Column::of_set(name, surface.points.len(), members));
    }
    let of_faces = face_columns(surface);

    writeln!(out, "ply\nformat binary_little_endian 1.0\ncomment written by Pliant")?;
    writeln!(out, "element vertex {}", surface.points.len())?;
    writeln!(out, "property double x\nproperty double y\nproperty double z")?;
    of_points.iter().try_for_each(|column| column.write_head(out))?;
    writeln!(out, "element face {}\nproperty list uchar int vertex_indices", surface.faces.len())?;
    of_faces.iter().try_for_each(|column| column.write_head(out))?;
    writeln!(out, "end_header")?;
    for (item, x) in surface.points.iter().enumerate() {
        for component in x.iter() {
            out.write_all(&component.to_le_bytes())?;
        }
        of_points.iter().try_for_each(|column| column.write_item(out, item))?;
    }
    for (item, face) in surface.faces.iter().enumerate() {
        out.write_all(&[face.nodes.len() as u8])?;
        for node in &face.nodes {
            out.write_all(&node.to_le_bytes())?;
        }
        of_faces.iter().try_for_each(|column| column.write_item(out, item))?;
    }
    Ok(())
}

/// Data and sets of the faces; NaN for kinds without these data.
fn face_columns(surface: &SurfaceOut<'_>) -> Vec<Column> {
    let mut columns = Vec::new();
    let names: BTreeMap<&String, usize> = surface
        .blocks
        .iter()
        .flat_map(|block| block.data.iter().map(|(name, array)| (name, array.components)))
        .collect();
    for (name, components) in names {
        let mut joined = DataArray { components, values: Vec::new() };
        for block in &surface.blocks {
            match block.data.get(name) {
                Some(array) => joined.values.extend_from_slice(&array.values),
                None => joined.values.resize(joined.values.len() + block.len() * components, f64::NAN),
            }
        }
        columns.extend(Column::of(name, &joined, 0..surface.faces.len()));
    }
    let sets: BTreeSet<&String> = surface.blocks.iter().flat_map(|block| block.sets.keys()).collect();
    for name in sets {
        let starts = surface.blocks.iter().scan(0, |next, block| {
            let start = *next;
            *next += block.len();
            Some(start)
        });
        let members = surface.blocks.iter().zip(starts).flat_map(|(block, start)| {
            block.sets.get(name).into_iter().flatten().map(move |&cell| start + cell as usize)
        });
        columns.push(Column::of_set(name, surface.faces.len(), members));
    }
    columns
}
