//! Reads VTK's XML files: unstructured grids (`.vtu`) and poly-data (`.vtp`), as text, base64 or appended
//! bytes, plain or compressed with zlib. Leaves out other compressors, texts and look-up tables.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Read;

use roxmltree::Node;

use super::base64::Base64;
use super::cells::{BODY_NAMES, Cells, LABEL_NAMES, array_limit, finite_points, index_limit};
use super::cursor::{Cursor, Order, Scalar};
use super::error::{Fault, Place};
use super::vtk_cells::{Connectivity, PolyList, add_grid, add_poly};
use super::xml::parse_xml;
use super::{Format, MeshFile};
use crate::labels::clean_name;
use crate::{DataArray, Vector3};

/// Zlib makes at most 1032 bytes of one; more is announced by no honest file.
const MOST_INFLATION: usize = 1040;

/// Properties of all arrays of the file.
struct Storage<'a> {
    /// Ends of the lines of the XML.
    line_ends: Vec<usize>,
    order: Order,
    header: Scalar,
    compressed: bool,
    /// Appended data: the bytes after the underscore, whether they are base64, and where they begin.
    appended: Option<(&'a [u8], bool, usize)>,
    /// Bytes that may still be decoded.
    budget: usize,
}

/// The bytes of an array: raw in the file, or decoded.
type Bytes<'a> = Cow<'a, [u8]>;

/// Appended bytes after the underscore, and where they begin in the file.
type Appended<'a> = (&'a [u8], usize);

/// Reads a `.vtu` or `.vtp` file.
pub(super) fn read(bytes: &[u8]) -> Result<MeshFile, Fault> {
    let (xml, appended) = split_appended(bytes)?;
    // The check alone is faster than the repair, which few files need.
    let text = match std::str::from_utf8(&xml) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => String::from_utf8_lossy(&xml),
    };
    let document = parse_xml(&text).map_err(|error| {
        Fault::malformed(Place::Line(error.line), format!("the XML is broken or truncated: {error}"))
    })?;
    let root = document.root_element();
    if root.tag_name().name() != "VTKFile" {
        return Err(Fault::malformed(
            Place::Line(1),
            format!("the first element is `{}`, not `VTKFile`", root.tag_name().name()),
        ));
    }
    let (kind, poly) = match root.attribute("type").unwrap_or_default() {
        "UnstructuredGrid" => ("UnstructuredGrid", false),
        "PolyData" => ("PolyData", true),
        other => {
            return Err(Fault::unsupported(
                Place::Line(1),
                format!("the VTK data set {other} is"),
                "save it as an unstructured grid (.vtu) or as poly-data (.vtp)",
            ));
        }
    };
    let mut storage = Storage::new(&text, root, appended, bytes.len())?;
    let mut file = storage.read_set(root, kind, poly)?;
    let name = if poly { Format::Vtp.name() } else { Format::Vtu.name() };
    file.format = format!("{name} {}", root.attribute("version").unwrap_or("0.1"));
    Ok(file)
}

/// Cuts appended data, which need not be XML, out of the file. Returns the XML without them, and the appended
/// data with their place.
fn split_appended(bytes: &[u8]) -> Result<(Bytes<'_>, Option<Appended<'_>>), Fault> {
    const TAG: &[u8] = b"<AppendedData";
    let mut opened = bytes.iter().enumerate().filter(|(_, byte)| **byte == b'<').map(|(at, _)| at);
    let Some(tag) = opened.find(|&at| bytes[at..].starts_with(TAG)) else {
        return Ok((Cow::Borrowed(bytes), None));
    };
    let truncated = || Fault::truncated(Place::Byte(tag), "the appended data");
    let open = tag + bytes[tag..].iter().position(|&byte| byte == b'>').ok_or_else(truncated)? + 1;
    let start = open + bytes[open..].iter().position(|&byte| byte == b'_').ok_or_else(truncated)? + 1;
    let mut xml = bytes[..open].to_vec();
    xml.extend_from_slice(b"</AppendedData></VTKFile>");
    Ok((Cow::Owned(xml), Some((&bytes[start..], start))))
}

fn children<'a, 'd>(node: Node<'a, 'd>, name: &'static str) -> impl Iterator<Item = Node<'a, 'd>> {
    node.children().filter(move |child| child.tag_name().name() == name)
}

fn child<'a, 'd>(node: Node<'a, 'd>, name: &'static str) -> Option<Node<'a, 'd>> {
    children(node, name).next()
}

/// Arrays of one kind of item, joined over the pieces of a file.
#[derive(Default)]
struct Joined {
    arrays: BTreeMap<String, DataArray>,
    items: usize,
}

impl Joined {
    /// Adds a piece of `items` items; NaN where an array is missing in a piece.
    fn add(&mut self, arrays: Vec<(String, DataArray)>, items: usize) {
        if arrays.is_empty() && items == 0 {
            return;
        }
        for (name, array) in arrays {
            let joined = self.arrays.entry(name).or_insert_with(|| DataArray {
                components: array.components,
                values: vec![f64::NAN; self.items * array.components],
            });
            if joined.components == array.components && joined.values.len() == self.items * array.components {
                joined.values.extend_from_slice(&array.values);
            }
        }
        self.items += items;
        for array in self.arrays.values_mut() {
            array.values.resize(self.items * array.components, f64::NAN);
        }
    }

    /// Bytes of all arrays.
    fn filled(&self) -> usize {
        self.arrays.values().map(|array| size_of_val(array.values.as_slice())).sum()
    }
}

impl<'a> Storage<'a> {
    fn new(
        text: &str,
        root: Node<'a, 'a>,
        appended: Option<Appended<'a>>,
        file_size: usize,
    ) -> Result<Self, Fault> {
        let line_ends: Vec<usize> = text.match_indices('\n').map(|(at, _)| at).collect();
        let order = match root.attribute("byte_order") {
            Some("BigEndian") => Order::Big,
            _ => Order::Little,
        };
        let header = match root.attribute("header_type") {
            Some("UInt64") => Scalar::U64,
            Some("UInt32") | None => Scalar::U32,
            Some(other) => {
                return Err(Fault::malformed(Place::Line(1), format!("`{other}` is not a header type")));
            }
        };
        let compressed = match root.attribute("compressor") {
            None | Some("") => false,
            Some("vtkZLibDataCompressor") => true,
            Some(other) => {
                return Err(Fault::unsupported(
                    Place::Line(1),
                    format!("the compressor {other} is"),
                    "save the file with zlib or without compression",
                ));
            }
        };
        let appended = match (appended, child(root, "AppendedData")) {
            (Some((bytes, start)), Some(node)) => match node.attribute("encoding") {
                Some("raw") => Some((bytes, false, start)),
                Some("base64") | None => Some((bytes, true, start)),
                Some(other) => {
                    let what = format!("the encoding `{other}` of appended data is");
                    return Err(Fault::unsupported(Place::File, what, "use raw or base64"));
                }
            },
            _ => None,
        };
        let budget = array_limit(file_size);
        Ok(Self { line_ends, order, header, compressed, appended, budget })
    }

    fn read_set(&mut self, root: Node<'a, 'a>, kind: &'static str, poly: bool) -> Result<MeshFile, Fault> {
        let Some(set) = child(root, kind) else {
            return Err(Fault::malformed(Place::Line(1), format!("there is no element `{kind}`")));
        };
        let limit = self.budget;
        let mut notes = Vec::new();
        let (mut time, mut label_names, mut body_names) = (None, BTreeMap::new(), BTreeMap::new());
        for array in child(set, "FieldData").into_iter().flat_map(|fields| children(fields, "DataArray")) {
            let name = array.attribute("Name").unwrap_or_default();
            // Earlier versions wrote names as texts.
            let is_names = matches!(array.attribute("type"), Some("UInt8" | "String"));
            if name.eq_ignore_ascii_case("TimeValue") {
                time = self.reals(array)?.first().copied().filter(|time| time.is_finite());
            } else if is_names && name == LABEL_NAMES {
                label_names = self.numbered_names(array)?;
            } else if is_names && name == BODY_NAMES {
                body_names = self.numbered_names(array)?;
            }
        }
        // 3D Slicer names the axes of its files so; VTK writes texts as `Array`.
        let mut is_lps = false;
        for array in child(set, "FieldData").into_iter().flat_map(|fields| children(fields, "Array")) {
            is_lps |= array.attribute("Name") == Some("SPACE") && self.text(array)?.starts_with(b"LPS");
        }
        let mut points: Vec<Vector3> = Vec::new();
        let mut cells = Cells::default();
        let mut point_data = Joined::default();
        let mut cell_data = Joined::default();
        for piece in children(set, "Piece") {
            let first = points.len();
            let new = self.read_points(piece)?;
            let count = new.len();
            points.extend(new);
            index_limit(points.len(), self.line(piece))?;
            let before = cells.len();
            if poly {
                self.read_lists(piece, &mut cells, first, count)?;
            } else {
                self.read_grid(piece, &mut cells, first, count)?;
            }
            let new_cells = cells.len() - before;
            point_data.add(self.read_data(piece, "PointData", count, &mut notes)?, count);
            cell_data.add(self.read_data(piece, "CellData", new_cells, &mut notes)?, new_cells);
            // Filling arrays that only some pieces have must not multiply the file either.
            let filled = point_data.filled().saturating_add(cell_data.filled());
            if filled > limit {
                return Err(Fault::malformed(self.line(piece), "the arrays are far larger than the file"));
            }
        }
        for (name, array) in &cell_data.arrays {
            cells.add_data(name, array);
        }
        let mut mesh = cells.into_mesh(points, point_data.arrays, &mut notes)?;
        (mesh.label_names, mesh.body_names) = (label_names, body_names);
        let mut file = MeshFile { mesh, format: String::new(), notes, time };
        if is_lps {
            file.turn_from_lps();
        }
        Ok(file)
    }

    /// The names in texts such as `5 liver`, each ended by a 0. Other texts contain no names.
    fn numbered_names(&mut self, array: Node<'a, 'a>) -> Result<BTreeMap<i32, String>, Fault> {
        let bytes = self.text(array)?;
        let named = bytes.split(|&byte| byte == 0).filter_map(|text| {
            let text = String::from_utf8_lossy(text);
            let (label, name) = text.split_once(' ')?;
            Some((label.parse().ok()?, clean_name(name)?))
        });
        Ok(named.collect())
    }

    /// The bytes of an array of texts.
    fn text(&mut self, array: Node<'a, 'a>) -> Result<Bytes<'a>, Fault> {
        if !is_text(array) {
            return self.bytes(array);
        }
        let codes = self.words(array, |cursor, what| cursor.integer(format_args!("{what}")))?;
        Ok(codes.into_iter().map(|code| u8::try_from(code).unwrap_or(b'?')).collect::<Vec<u8>>().into())
    }

    /// The line, from 1, of a byte of the XML.
    fn line_at(&self, byte: usize) -> usize {
        self.line_ends.partition_point(|&end| end < byte) + 1
    }

    /// The line where an element begins.
    fn line(&self, node: Node<'_, '_>) -> Place {
        Place::Line(self.line_at(node.range().start))
    }

    /// A count that a piece announces; `None` without.
    fn announced(&self, piece: Node<'a, 'a>, attribute: &str) -> Result<Option<usize>, Fault> {
        let Some(text) = piece.attribute(attribute) else { return Ok(None) };
        match text.trim().parse() {
            Ok(count) => Ok(Some(count)),
            Err(_) => {
                Err(Fault::malformed(self.line(piece), format!("{attribute} is `{text}`, not a count")))
            }
        }
    }

    fn read_points(&mut self, piece: Node<'a, 'a>) -> Result<Vec<Vector3>, Fault> {
        let announced = self.announced(piece, "NumberOfPoints")?;
        let Some(array) = child(piece, "Points").and_then(|points| child(points, "DataArray")) else {
            return match announced {
                Some(0) => Ok(Vec::new()),
                _ => Err(Fault::malformed(self.line(piece), "the piece has no `Points`")),
            };
        };
        let place = self.line(array);
        let coordinates = self.reals(array)?;
        if coordinates.len() % 3 != 0 || announced.is_some_and(|count| count != coordinates.len() / 3) {
            let what = format!(
                "{} points are announced, but there are {} coordinates",
                announced.unwrap_or_default(),
                coordinates.len()
            );
            return Err(Fault::malformed(place, what));
        }
        finite_points(&coordinates, place)
    }

    /// The connectivity of `Cells`, `Polys`, …; empty if missing.
    fn read_connectivity(&mut self, list: Node<'a, 'a>) -> Result<Connectivity, Fault> {
        let mut connectivity = Connectivity::default();
        for array in children(list, "DataArray") {
            match array.attribute("Name") {
                Some("connectivity") => connectivity.nodes = self.integers(array)?,
                Some("offsets") => connectivity.ends = self.integers(array)?,
                _ => {}
            }
        }
        Ok(connectivity)
    }

    fn read_grid(
        &mut self,
        piece: Node<'a, 'a>,
        cells: &mut Cells,
        first: usize,
        points: usize,
    ) -> Result<(), Fault> {
        let Some(list) = child(piece, "Cells") else { return Ok(()) };
        let connectivity = self.read_connectivity(list)?;
        let types = children(list, "DataArray").find(|array| array.attribute("Name") == Some("types"));
        let types = types.map(|array| self.integers(array)).transpose()?.unwrap_or_default();
        let place = self.line(list);
        self.check_cells(piece, "NumberOfCells", connectivity.len())?;
        add_grid(cells, &types, &connectivity, first, points, place)
    }

    fn check_cells(&self, piece: Node<'a, 'a>, attribute: &str, found: usize) -> Result<(), Fault> {
        match self.announced(piece, attribute)? {
            Some(count) if count != found => {
                let what = format!("{attribute} is {count}, but {found} were found");
                Err(Fault::malformed(self.line(piece), what))
            }
            _ => Ok(()),
        }
    }

    fn read_lists(
        &mut self,
        piece: Node<'a, 'a>,
        cells: &mut Cells,
        first: usize,
        points: usize,
    ) -> Result<(), Fault> {
        let lists = [
            (PolyList::Vertices, "Verts", "NumberOfVerts"),
            (PolyList::Lines, "Lines", "NumberOfLines"),
            (PolyList::Polygons, "Polys", "NumberOfPolys"),
            (PolyList::Strips, "Strips", "NumberOfStrips"),
        ];
        for (list, element, attribute) in lists {
            let Some(node) = child(piece, element) else { continue };
            let connectivity = self.read_connectivity(node)?;
            self.check_cells(piece, attribute, connectivity.len())?;
            add_poly(cells, list, &connectivity, first, points, self.line(node))?;
        }
        Ok(())
    }

    /// The arrays of `PointData` or `CellData`, each of `items` items.
    fn read_data(
        &mut self,
        piece: Node<'a, 'a>,
        section: &'static str,
        items: usize,
        notes: &mut Vec<String>,
    ) -> Result<Vec<(String, DataArray)>, Fault> {
        let Some(section) = child(piece, section) else { return Ok(Vec::new()) };
        let mut arrays = Vec::new();
        for (i, array) in children(section, "DataArray").enumerate() {
            let name = array.attribute("Name").map_or_else(|| format!("array{i}"), str::to_owned);
            if array.attribute("type") == Some("String") {
                notes.push(format!("array `{name}` contains text and was ignored"));
                continue;
            }
            let components = self.announced(array, "NumberOfComponents")?.unwrap_or(1).max(1);
            let values = self.reals(array)?;
            if Some(values.len()) != components.checked_mul(items) {
                let what = format!(
                    "array `{name}` has {} numbers, not {components} for each of {items} items",
                    values.len()
                );
                return Err(Fault::malformed(self.line(array), what));
            }
            arrays.push((name, DataArray { components, values }));
        }
        Ok(arrays)
    }

    fn scalar(&self, array: Node<'a, 'a>) -> Result<Scalar, Fault> {
        Ok(match array.attribute("type").unwrap_or_default() {
            "Int8" => Scalar::I8,
            "UInt8" => Scalar::U8,
            "Int16" => Scalar::I16,
            "UInt16" => Scalar::U16,
            "Int32" => Scalar::I32,
            "UInt32" => Scalar::U32,
            "Int64" => Scalar::I64,
            "UInt64" => Scalar::U64,
            "Float32" => Scalar::F32,
            "Float64" => Scalar::F64,
            other => {
                let what = format!("`{other}` is not a number type");
                return Err(Fault::malformed(self.line(array), what));
            }
        })
    }

    fn reals(&mut self, array: Node<'a, 'a>) -> Result<Vec<f64>, Fault> {
        let scalar = self.scalar(array)?;
        if is_text(array) {
            return self.words(array, |cursor, what| cursor.real(format_args!("{what}")));
        }
        Ok(scalar.decode(&self.bytes(array)?, self.order))
    }

    fn integers(&mut self, array: Node<'a, 'a>) -> Result<Vec<i64>, Fault> {
        let scalar = self.scalar(array)?;
        if is_text(array) {
            return self.words(array, |cursor, what| cursor.integer(format_args!("{what}")));
        }
        Ok(scalar.decode_integers(&self.bytes(array)?, self.order))
    }

    /// The numbers of an array that is written as text.
    fn words<T>(
        &self,
        array: Node<'a, 'a>,
        next: impl Fn(&mut Cursor<'_>, &str) -> Result<T, Fault>,
    ) -> Result<Vec<T>, Fault> {
        let what = format!("array `{}`", array.attribute("Name").unwrap_or("Points"));
        let (text, start) = content(array);
        let mut cursor = Cursor::new(text.as_bytes());
        let mut numbers = Vec::new();
        while cursor.peek().is_some() {
            numbers.push(next(&mut cursor, &what).map_err(|fault| {
                // Lines are counted from the text's own first line.
                let first = self.line_at(start);
                match fault.place {
                    Place::Line(line) => Fault { place: Place::Line(first + line - 1), ..fault },
                    _ => fault,
                }
            })?);
        }
        Ok(numbers)
    }

    /// The bytes of an array that is inline base64 or appended.
    fn bytes(&mut self, array: Node<'a, 'a>) -> Result<Bytes<'a>, Fault> {
        let name = array.attribute("Name").unwrap_or("Points");
        let what = format!("array `{name}`");
        match array.attribute("format") {
            Some("binary") => {
                let place = self.line(array);
                let text = content(array).0.trim_ascii().as_bytes();
                if text.is_empty() {
                    return Ok(Cow::Borrowed(&[]));
                }
                self.decode_base64(text, place, &what)
            }
            Some("appended") => {
                let place = self.line(array);
                let offset = self.announced(array, "offset")?.unwrap_or_default();
                let Some((bytes, base64, start)) = self.appended else {
                    return Err(Fault::truncated(place, format!("{what}: there are no appended data")));
                };
                let place = Place::Byte(start.saturating_add(offset));
                let Some(bytes) = bytes.get(offset..) else { return Err(Fault::truncated(place, what)) };
                if base64 {
                    self.decode_base64(bytes, place, &what)
                } else {
                    self.decode_raw(bytes, place, &what)
                }
            }
            other => {
                let what = format!("the format `{}` of {what}", other.unwrap_or_default());
                Err(Fault::malformed(self.line(array), format!("{what} is unknown")))
            }
        }
    }

    fn spend(&mut self, bytes: usize, place: Place, what: &str) -> Result<(), Fault> {
        match self.budget.checked_sub(bytes) {
            Some(left) => {
                self.budget = left;
                Ok(())
            }
            None => {
                Err(Fault::malformed(place, format!("the arrays up to {what} are far larger than the file")))
            }
        }
    }

    fn headers(&self, bytes: &[u8]) -> Vec<usize> {
        let headers = self.header.decode_integers(bytes, self.order);
        headers.into_iter().map(|header| usize::try_from(header).unwrap_or(usize::MAX)).collect()
    }

    /// Raw bytes: a header with their number, then the bytes; or compressed blocks.
    fn decode_raw(&mut self, bytes: &'a [u8], place: Place, what: &str) -> Result<Bytes<'a>, Fault> {
        let mut cursor = Cursor::new(bytes);
        let size = self.header.size();
        let mut take = |count: usize| match cursor.take(count, what) {
            Ok(taken) => Ok(taken),
            Err(_) => Err(Fault::truncated(place, what)),
        };
        if !self.compressed {
            let count = self.headers(take(size)?)[0];
            let taken = take(count)?;
            self.spend(count, place, what)?;
            return Ok(Cow::Borrowed(taken));
        }
        let head = self.headers(take(3 * size)?);
        if head[0] == 0 {
            return Ok(Cow::Borrowed(&[]));
        }
        let count = head[0].checked_mul(size).ok_or_else(|| Fault::truncated(place, what))?;
        let sizes = self.headers(take(count)?);
        self.spend(count, place, what)?;
        let mut inflated = Vec::new();
        for (i, &compressed) in sizes.iter().enumerate() {
            let block = take(compressed)?;
            self.inflate(block, block_size(&head, i), &mut inflated, place, what)?;
        }
        Ok(Cow::Owned(inflated))
    }

    /// Decodes an array in base64, where the header of compressed blocks is a separate piece.
    fn decode_base64(&mut self, text: &[u8], place: Place, what: &str) -> Result<Bytes<'a>, Fault> {
        let size = self.header.size();
        let mut text = Base64::new(text);
        let truncated = || Fault::truncated(place, format!("{what} (base64)"));
        if !self.compressed {
            let count = self.headers(&text.take(size).ok_or_else(truncated)?)[0];
            let bytes = text.take(count).ok_or_else(truncated)?;
            self.spend(count, place, what)?;
            return Ok(Cow::Owned(bytes));
        }
        let head = self.headers(&text.take(3 * size).ok_or_else(truncated)?);
        if head[0] == 0 {
            return Ok(Cow::Borrowed(&[]));
        }
        let count = head[0].checked_mul(size).ok_or_else(truncated)?;
        let sizes = self.headers(&text.take(count).ok_or_else(truncated)?);
        self.spend(count, place, what)?;
        text.end_piece();
        let mut inflated = Vec::new();
        for (i, &compressed) in sizes.iter().enumerate() {
            let block = text.take(compressed).ok_or_else(truncated)?;
            self.inflate(&block, block_size(&head, i), &mut inflated, place, what)?;
        }
        Ok(Cow::Owned(inflated))
    }

    /// Inflates a block, which must give the size announced.
    fn inflate(
        &mut self,
        block: &[u8],
        size: usize,
        inflated: &mut Vec<u8>,
        place: Place,
        what: &str,
    ) -> Result<(), Fault> {
        if size > block.len().saturating_mul(MOST_INFLATION) {
            return Err(Fault::truncated(place, format!("a compressed block of {what}")));
        }
        self.spend(size, place, what)?;
        let before = inflated.len();
        inflated.reserve(size);
        let read = flate2::read::ZlibDecoder::new(block).take(size as u64).read_to_end(inflated);
        match read {
            Ok(_) if inflated.len() - before == size => Ok(()),
            Ok(_) => Err(Fault::truncated(place, format!("a compressed block of {what}"))),
            Err(error) => {
                Err(Fault::malformed(place, format!("a compressed block of {what} is broken ({error})")))
            }
        }
    }
}

/// Size of block `index` once inflated, of a head of (blocks, size, size of the last or 0 if it is whole).
fn block_size(head: &[usize], index: usize) -> usize {
    if index + 1 == head[0] && head[2] != 0 { head[2] } else { head[1] }
}

/// The text of an array, before or after elements with information, and its start.
fn content<'a>(array: Node<'a, '_>) -> (&'a str, usize) {
    let texts = array.children().filter(Node::is_text);
    let mut texts = texts.filter_map(|node| Some((node.text()?, node.range().start)));
    texts.find(|(text, _)| !text.trim_ascii().is_empty()).unwrap_or_default()
}

fn is_text(array: Node<'_, '_>) -> bool {
    matches!(array.attribute("format"), Some("ascii") | None)
}
