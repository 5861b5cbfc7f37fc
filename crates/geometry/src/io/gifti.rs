//! Reads surfaces in GIfTI (`.gii`): XML with an array of points and one of triangles, as text, base64, or
//! base64 packed with zlib or gzip (GIfTI Surface Data Format 1.0). Lengths are millimetres by custom. Leaves
//! out: data in other files, data at the points, transforms (which are reported).

use std::collections::BTreeMap;
use std::io::Read;

use roxmltree::Node;

use super::base64::Base64;
use super::cells::{Cells, array_limit, finite_points, node};
use super::cursor::{Cursor, Order, Scalar, shown};
use super::error::{Fault, Place};
use super::xml::parse_xml;
use super::{Format, MeshFile};
use crate::CellKind;

/// Reads a surface.
pub(super) fn read(bytes: &[u8]) -> Result<MeshFile, Fault> {
    let text = without_doctype(&String::from_utf8_lossy(bytes))?;
    let document = parse_xml(&text).map_err(|error| {
        Fault::malformed(Place::Line(error.line), format!("the XML is broken or truncated: {error}"))
    })?;
    let root = document.root_element();
    if root.tag_name().name() != "GIFTI" {
        let name = shown(root.tag_name().name().as_bytes());
        return Err(Fault::malformed(Place::Line(1), format!("the first element is `{name}`, not `GIFTI`")));
    }
    let mut budget = array_limit(bytes.len());
    let (mut points, mut corners, mut notes, mut others) = (None, None, Vec::new(), 0);
    for node in root.children().filter(|child| child.has_tag_name("DataArray")) {
        let place = || Place::Line(document.text_pos_at(node.range().start).row as usize);
        match node.attribute("Intent") {
            Some("NIFTI_INTENT_POINTSET") if points.is_none() => {
                let array = Array { node, place: place() };
                let coordinates = array.numbers(&mut budget)?;
                notes.extend(array.transform());
                points = Some(finite_points(&coordinates, array.place)?);
            }
            Some("NIFTI_INTENT_TRIANGLE") if corners.is_none() => {
                let array = Array { node, place: place() };
                corners = Some((array.numbers(&mut budget)?, array.place));
            }
            _ => others += 1,
        }
    }
    if others > 0 {
        notes.push(format!("skipped arrays other than points and triangles: {others}"));
    }
    let points = points.unwrap_or_default();
    let mut cells = Cells::default();
    if let Some((corners, place)) = &corners {
        for (number, corners) in corners.chunks_exact(3).enumerate() {
            let mut nodes = [0; 3];
            for (slot, &corner) in nodes.iter_mut().zip(corners) {
                *slot = node(corner as i64, points.len(), *place, || format!("triangle {number}"))?;
            }
            cells.open();
            cells.push(CellKind::Triangle, &nodes);
        }
    }
    let mesh = cells.into_mesh(points, BTreeMap::new(), &mut notes)?;
    let version = shown(root.attribute("Version").unwrap_or("1.0").as_bytes());
    Ok(MeshFile { mesh, format: format!("{} {version}", Format::Gifti.name()), notes, time: None })
}

/// The text without the declaration of its type, which the parser rejects. This function rejects declarations
/// of entities.
fn without_doctype(text: &str) -> Result<String, Fault> {
    let Some(start) = text.find("<!DOCTYPE") else { return Ok(text.to_owned()) };
    let length =
        text[start..].find('>').ok_or_else(|| Fault::truncated(Place::Line(1), "the document type"))? + 1;
    let declaration = &text[start..start + length];
    if declaration.contains('[') {
        return Err(Fault::unsupported(
            Place::Line(1),
            "a document type with its own declarations is",
            "remove it",
        ));
    }
    // Spaces keep the places of what follows.
    let blank: String = declaration.chars().map(|c| if c == '\n' { c } else { ' ' }).collect();
    Ok([&text[..start], &blank, &text[start + length..]].concat())
}

/// A `DataArray`.
struct Array<'a, 'd> {
    node: Node<'a, 'd>,
    place: Place,
}

impl<'a> Array<'a, '_> {
    fn attribute(&self, name: &str) -> &'a str {
        self.node.attribute(name).unwrap_or_default()
    }

    fn malformed(&self, what: impl Into<String>) -> Fault {
        Fault::malformed(self.place, what)
    }

    /// Three numbers for each of its items.
    fn numbers(&self, budget: &mut usize) -> Result<Vec<f64>, Fault> {
        let scalar = match self.attribute("DataType") {
            "NIFTI_TYPE_FLOAT32" => Scalar::F32,
            "NIFTI_TYPE_FLOAT64" => Scalar::F64,
            "NIFTI_TYPE_INT32" => Scalar::I32,
            "NIFTI_TYPE_UINT32" => Scalar::U32,
            "NIFTI_TYPE_INT64" => Scalar::I64,
            "NIFTI_TYPE_UINT8" => Scalar::U8,
            other => {
                return Err(self.malformed(format!(
                    "`{}` is not a type of points or triangles",
                    shown(other.as_bytes())
                )));
            }
        };
        let dim = |name| self.attribute(name).trim().parse::<usize>();
        let (Ok(items), Ok(3)) = (dim("Dim0"), dim("Dim1")) else {
            return Err(self.malformed("`Dim0` and `Dim1` of points and triangles must be a count and 3"));
        };
        let count = items.saturating_mul(3);
        let bytes = count.saturating_mul(scalar.size().max(size_of::<f64>()));
        *budget = budget
            .checked_sub(bytes)
            .ok_or_else(|| self.malformed("the announced arrays are far larger than the file"))?;
        let data = self.node.children().find(|child| child.has_tag_name("Data"));
        let text = data.and_then(|data| data.text()).unwrap_or_default();
        let values = match self.attribute("Encoding") {
            "ASCII" => self.words(text, count)?,
            "Base64Binary" => self.decode(self.unpacked(text, count * scalar.size(), false)?, scalar),
            "GZipBase64Binary" => self.decode(self.unpacked(text, count * scalar.size(), true)?, scalar),
            other => {
                let what = format!("data in the encoding `{}` is", shown(other.as_bytes()));
                return Err(Fault::unsupported(
                    self.place,
                    what,
                    "save it with ASCII, Base64Binary or GZipBase64Binary",
                ));
            }
        };
        Ok(match self.attribute("ArrayIndexingOrder") {
            "ColumnMajorOrder" => (0..count).map(|at| values[at / 3 + items * (at % 3)]).collect(),
            _ => values,
        })
    }

    fn words(&self, text: &str, count: usize) -> Result<Vec<f64>, Fault> {
        let mut words = Cursor::of_line(text.as_bytes(), self.place);
        words.room(count, 2, "the numbers")?;
        (0..count).map(|_| words.real(format_args!("the numbers"))).collect()
    }

    /// Exactly `count` bytes of base64, packed or not.
    fn unpacked(&self, text: &str, count: usize, packed: bool) -> Result<Vec<u8>, Fault> {
        let cut = || Fault::truncated(self.place, "the numbers");
        if !packed {
            return Base64::new(text.as_bytes()).take(count).ok_or_else(cut);
        }
        let bytes = Base64::new(text.as_bytes()).rest().ok_or_else(cut)?;
        let mut found = Vec::new();
        let read = if bytes.starts_with(&[0x1f, 0x8b]) {
            flate2::bufread::GzDecoder::new(&bytes[..]).take(count as u64).read_to_end(&mut found)
        } else {
            flate2::bufread::ZlibDecoder::new(&bytes[..]).take(count as u64).read_to_end(&mut found)
        };
        match read {
            Ok(_) if found.len() == count => Ok(found),
            Ok(_) => Err(cut()),
            Err(error) => Err(self.malformed(format!("the numbers cannot be decompressed ({error})"))),
        }
    }

    fn decode(&self, bytes: Vec<u8>, scalar: Scalar) -> Vec<f64> {
        let order = if self.attribute("Endian") == "BigEndian" { Order::Big } else { Order::Little };
        scalar.decode(&bytes, order)
    }

    /// Returns a note if the file gives a transform, which is not applied.
    fn transform(&self) -> Option<String> {
        let within = |node: Node<'a, '_>, name| {
            node.children().find(|child| child.has_tag_name(name)).and_then(|child| child.text())
        };
        let system =
            self.node.children().find(|child| child.has_tag_name("CoordinateSystemTransformMatrix"))?;
        let matrix = within(system, "MatrixData")?;
        let numbers: Vec<f64> = matrix.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        let unit =
            numbers.len() == 16 && numbers.iter().enumerate().all(|(at, &x)| x == f64::from(at % 5 == 0));
        let to = shown(within(system, "TransformedSpace").unwrap_or_default().trim().as_bytes());
        (!unit).then(|| format!("points keep their coordinates; the transform to `{to}` was not applied"))
    }
}
