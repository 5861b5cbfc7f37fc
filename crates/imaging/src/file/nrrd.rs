//! NRRD: a text header, `field: value`, then the voxels (Teem's definition of the format, NRRD0001 to
//! NRRD0005). The header ends at an empty line or with the file (detached header). An axis of one element
//! without direction is dropped. Names of labels are read as 3D Slicer writes them: `Segment0_Name:=liver`
//! with `Segment0_LabelValue:=5`. A first axis of layers of segments becomes one image. Leaves out: several
//! values a voxel otherwise, encodings hex and bzip2, data spread over several files.

use std::collections::BTreeMap;

use pliant_geometry::Grid;
use pliant_geometry::Vector3;

use super::input::Input;
use super::layers;
use super::text::{Field, ToWorld};
use super::{ReadOptions, checked_size};
use crate::error::{Fault, ImageProblem};
use crate::image::{Image, Numbers, Order, Scalar};
use crate::names::LabelNames;

/// Fields that are read, each with its synonyms; all others are passed over.
const FIELDS: [&[&str]; 16] = [
    &["type"],
    &["dimension"],
    &["sizes"],
    &["encoding"],
    &["endian"],
    &["space"],
    &["space dimension"],
    &["space directions"],
    &["space origin"],
    &["space units"],
    &["spacings"],
    &["axis mins", "axismins"],
    &["units"],
    &["data file", "datafile"],
    &["byte skip", "byteskip"],
    &["line skip", "lineskip"],
];

pub(super) fn read(input: &mut Input<'_>, options: &ReadOptions) -> Result<Image, Fault> {
    let header = NrrdHeader::read(input)?;
    let axes = header.axes()?;
    let dims = header.need("sizes")?;
    let size = checked_size(axes.dims, "sizes", options).map_err(|problem| problem.at_line(dims.line))?;
    let scalar = header.scalar()?;
    let mut notes = Vec::new();
    let world = header.world(&mut notes)?;
    let line =
        header.get("space directions").or(header.get("spacings")).map_or(dims.line, |field| field.line);
    let grid = Grid::new(size, world.vector(header.origin(&axes)?), world.axes(axes.steps))
        .map_err(|flat| ImageProblem::from(flat).at_line(line))?;
    let (numbers, names) = if axes.layers > 1 {
        let voxels = (grid.len() as u64).saturating_mul(axes.layers);
        if voxels > options.voxel_limit {
            let limit = options.voxel_limit;
            return Err(ImageProblem::TooManyVoxels { voxels, limit }.at_line(dims.line));
        }
        let read = header.numbers(input, voxels as usize, scalar)?;
        layers::joined(axes.layers as usize, &read, &layers::segments(&header.pairs), &mut notes)
    } else {
        (header.numbers(input, grid.len(), scalar)?, header.names())
    };
    Ok(Image { grid, format: "NRRD".to_owned(), notes, names, numbers, scale: [1.0, 0.0] })
}

struct NrrdHeader {
    fields: Vec<Field>,
    /// `key:=value`.
    pairs: Vec<(String, String)>,
}

/// The three axes of the image, in units of the file.
struct Axes {
    dims: [u64; 3],
    steps: [Vector3; 3],
    /// Their places among the axes of the file.
    kept: [usize; 3],
    /// Layers of segments; each voxel has one value per layer.
    layers: u64,
}

impl NrrdHeader {
    fn read(input: &mut Input<'_>) -> Result<Self, Fault> {
        let magic = input.line()?.unwrap_or_default();
        if !(magic.starts_with("NRRD000") && magic.len() == 8) {
            let found =
                format!("it begins with `{}`", magic.chars().take(12).collect::<String>().escape_debug());
            return Err(ImageProblem::NotThisFormat { format: "NRRD", found }.at_line(1));
        }
        let (mut fields, mut pairs) = (Vec::new(), Vec::new());
        let mut line_number = 1;
        while let Some(line) = input.line()?.filter(|line| !line.is_empty()) {
            line_number += 1;
            if line.starts_with('#') {
                continue;
            }
            if let Some((key, value)) = line.split_once(":=") {
                pairs.push((key.to_owned(), value.to_owned()));
                continue;
            }
            let Some((key, value)) = line.split_once(": ") else {
                let found = format!("line {line_number} is not `field: value`");
                return Err(ImageProblem::NotThisFormat { format: "NRRD", found }.at_line(line_number));
            };
            let key = key.trim().to_ascii_lowercase();
            if let Some(names) = FIELDS.iter().find(|names| names.contains(&key.as_str())) {
                fields.push(Field { name: names[0], value: value.trim().to_owned(), line: line_number });
            }
        }
        Ok(Self { fields, pairs })
    }

    /// The names of the segments by their labels.
    fn names(&self) -> LabelNames {
        let labels = self.pairs.iter().filter_map(|(key, value)| {
            Some((
                key.strip_suffix("_LabelValue").filter(|key| key.starts_with("Segment"))?,
                value.trim().parse().ok()?,
            ))
        });
        let labels: BTreeMap<&str, i32> = labels.collect();
        let mut names = LabelNames::default();
        for (key, name) in &self.pairs {
            if let Some(&label) = key.strip_suffix("_Name").and_then(|key| labels.get(key)) {
                names.insert(label, name);
            }
        }
        names
    }

    fn get(&self, name: &str) -> Option<&Field> {
        self.fields.iter().rev().find(|field| field.name == name)
    }

    fn need(&self, name: &'static str) -> Result<&Field, Fault> {
        self.get(name).ok_or_else(|| ImageProblem::MissingField { field: name }.into())
    }

    fn scalar(&self) -> Result<Scalar, Fault> {
        let field = self.need("type")?;
        Ok(match field.value.as_str() {
            "signed char" | "int8" | "int8_t" => Scalar::I8,
            "uchar" | "unsigned char" | "uint8" | "uint8_t" => Scalar::U8,
            "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => Scalar::I16,
            "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => Scalar::U16,
            "int" | "signed int" | "int32" | "int32_t" => Scalar::I32,
            "uint" | "unsigned int" | "uint32" | "uint32_t" => Scalar::U32,
            "longlong"
            | "long long"
            | "long long int"
            | "signed long long"
            | "signed long long int"
            | "int64"
            | "int64_t" => Scalar::I64,
            "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => {
                Scalar::U64
            }
            "float" => Scalar::F32,
            "double" => Scalar::F64,
            _ => {
                return Err(field.bad(
                    "only integers of 8 to 64 bits, float and double are supported; convert the image",
                ));
            }
        })
    }

    /// The axes with a direction, or all if the file has none.
    fn axes(&self) -> Result<Axes, Fault> {
        let sizes_field = self.need("sizes")?;
        let sizes: Vec<u64> = sizes_field.list("whole numbers are needed, one per axis")?;
        let rank: usize = self.need("dimension")?.one("a whole number is needed")?;
        if sizes.len() != rank || !(2..=16).contains(&rank) {
            return Err(sizes_field.bad("one size for each of 2 to 16 dimensions is needed"));
        }
        let steps = self.steps(rank)?;
        let (mut dims, mut kept_steps, mut kept) = ([1; 3], [Vector3::zeros(); 3], [usize::MAX; 3]);
        let (mut count, mut layers) = (0, 1);
        let layered = !layers::segments(&self.pairs).is_empty();
        for (axis, (&size, step)) in sizes.iter().zip(&steps).enumerate() {
            match step {
                Some(_) if count == 3 && size == 1 => {}
                None if size == 1 => {}
                None if axis == 0 && layered => layers = size,
                Some(step) if count < 3 => {
                    (dims[count], kept_steps[count], kept[count]) = (size, *step, axis);
                    count += 1;
                }
                _ => {
                    return Err(ImageProblem::Unsupported {
                        what: format!(
                            "an image with several values per voxel or several volumes (sizes {sizes:?})"
                        ),
                        remedy: "extract one of them (3D Slicer: save the segmentation as one label map)",
                    }
                    .at_line(sizes_field.line));
                }
            }
        }
        if count < 2 {
            return Err(sizes_field.bad("2 or 3 axes in space are needed"));
        }
        if count == 2 {
            // A single slice: one unit thick, square to it.
            kept_steps[2] = kept_steps[0].cross(&kept_steps[1]).try_normalize(0.0).unwrap_or_default();
        }
        Ok(Axes { dims, steps: kept_steps, kept, layers })
    }

    /// The step along each axis of the file; `None` for one without direction.
    fn steps(&self, rank: usize) -> Result<Vec<Option<Vector3>>, Fault> {
        if let Some(field) = self.get("space directions") {
            let vectors = vectors(field)?;
            return if vectors.len() == rank {
                Ok(vectors)
            } else {
                Err(field.bad("one vector per axis is needed"))
            };
        }
        let unit = |axis: usize, length: f64| {
            let mut step = Vector3::zeros();
            step[axis.min(2)] = length;
            step
        };
        let mut lengths = vec![1.0; rank];
        if let Some(field) = self.get("spacings") {
            lengths = field.list("one number per axis is needed")?;
            if lengths.len() != rank || lengths.iter().take(3).any(|&h: &f64| h.is_nan() || h <= 0.0) {
                return Err(field.bad("one positive number per axis is needed"));
            }
        }
        Ok(lengths.into_iter().enumerate().map(|(axis, length)| Some(unit(axis, length))).collect())
    }

    /// Centre of the first voxel, in units of the file.
    fn origin(&self, axes: &Axes) -> Result<Vector3, Fault> {
        if let Some(field) = self.get("space origin") {
            return match vectors(field)?.as_slice() {
                [Some(origin)] => Ok(*origin),
                _ => Err(field.bad("one vector is needed")),
            };
        }
        let Some(field) = self.get("axis mins") else { return Ok(Vector3::zeros()) };
        let mins: Vec<f64> = field.list("one number per axis is needed")?;
        let of_axis = |&axis: &usize| mins.get(axis).copied().filter(|x| x.is_finite()).unwrap_or(0.0);
        Ok(Vector3::from_iterator(axes.kept.iter().map(of_axis)))
    }

    fn world(&self, notes: &mut Vec<String>) -> Result<ToWorld, Fault> {
        let space = self.get("space").map(|field| (field, field.value.to_ascii_lowercase()));
        let signs = match space.as_ref().map(|(field, name)| (field, name.as_str())) {
            Some((_, "right-anterior-superior" | "ras")) => [1.0, 1.0, 1.0],
            Some((_, "left-anterior-superior" | "las")) => [-1.0, 1.0, 1.0],
            Some((_, "left-posterior-superior" | "lps")) => [-1.0, -1.0, 1.0],
            None | Some((_, "scanner-xyz" | "3d-right-handed" | "3d-left-handed")) => {
                notes.push("no anatomical space: assuming axes right, front, head".to_owned());
                [1.0, 1.0, 1.0]
            }
            Some((field, _)) => {
                return Err(field.bad("a space of three axes is needed, e.g. left-posterior-superior"));
            }
        };
        Ok(ToWorld { unit: self.unit()?, signs })
    }

    /// Metres a unit of length.
    fn unit(&self) -> Result<f64, Fault> {
        let Some(field) = self.get("space units").or(self.get("units")) else { return Ok(1e-3) };
        let word = field.value.split('"').map(str::trim).find(|word| !word.is_empty()).unwrap_or("mm");
        match word {
            "mm" | "millimeter" | "millimeters" | "???" => Ok(1e-3),
            "um" | "µm" | "micrometer" | "micrometers" | "microns" => Ok(1e-6),
            "cm" | "centimeter" | "centimeters" => Ok(1e-2),
            "m" | "meter" | "meters" => Ok(1.0),
            _ => Err(field.bad("\"mm\", \"um\", \"cm\" or \"m\" is needed")),
        }
    }

    fn order(&self, scalar: Scalar) -> Result<Order, Fault> {
        match self.get("endian").map(|field| (field, field.value.to_ascii_lowercase())) {
            None if scalar.size() == 1 => Ok(Order::Little),
            None => Err(ImageProblem::MissingField { field: "endian" }.into()),
            Some((_, word)) if word == "little" => Ok(Order::Little),
            Some((_, word)) if word == "big" => Ok(Order::Big),
            Some((field, _)) => Err(field.bad("little or big is needed")),
        }
    }

    fn numbers(&self, input: &mut Input<'_>, count: usize, scalar: Scalar) -> Result<Numbers, Fault> {
        let mut data = match self.get("data file") {
            None => input.rest(),
            Some(field) if field.value.starts_with("LIST") || field.value.contains('%') => {
                return Err(field.bad("one file is needed; write the image as a single .nrrd"));
            }
            Some(field) => input.beside("data file", &field.value)?,
        };
        for _ in 0..self.skip("line skip")? {
            data.line()?;
        }
        let bytes = self.skip("byte skip")?;
        let encoding = self.need("encoding")?;
        match encoding.value.to_ascii_lowercase().as_str() {
            "raw" => {
                data.skip(bytes, "the bytes before the voxels")?;
                data.numbers(count, scalar, self.order(scalar)?)
            }
            "gzip" | "gz" => {
                // In packed data, bytes are skipped after unpacking.
                let mut data = data.unpack_gzip();
                data.skip(bytes, "the bytes before the voxels")?;
                data.numbers(count, scalar, self.order(scalar)?)
            }
            "ascii" | "text" | "txt" => read_text(&mut data, count, scalar),
            _ => Err(encoding.bad("only raw, gzip and ascii are supported; write the image with gzip")),
        }
    }

    /// Lines or bytes to pass over.
    fn skip(&self, name: &str) -> Result<u64, Fault> {
        let Some(field) = self.get(name) else { return Ok(0) };
        match field.one::<i64>("a whole number is needed")? {
            count @ 0..=0x4000_0000 => Ok(count as u64),
            _ => Err(field.bad("only 0 to 2³⁰ is supported; write the image as a single .nrrd")),
        }
    }
}

/// Vectors like `(1,0,0) none (0,1,0)`.
fn vectors(field: &Field) -> Result<Vec<Option<Vector3>>, Fault> {
    const EXPECTED: &str = "vectors of three numbers are needed, like (1,0,0)";
    let mut rest = field.value.trim();
    let mut vectors = Vec::new();
    while !rest.is_empty() {
        if let Some(after) = rest.strip_prefix("none") {
            vectors.push(None);
            rest = after.trim_start();
            continue;
        }
        let inner = rest.strip_prefix('(').and_then(|rest| rest.split_once(')'));
        let (inner, after) = inner.ok_or_else(|| field.bad(EXPECTED))?;
        let numbers: Result<Vec<f64>, _> = inner.split(',').map(|word| word.trim().parse()).collect();
        let numbers: [f64; 3] =
            numbers.ok().and_then(|numbers| numbers.try_into().ok()).ok_or_else(|| field.bad(EXPECTED))?;
        // A vector of NaNs means `none`.
        let none = numbers.iter().all(|x| x.is_nan());
        vectors.push((!none).then(|| numbers.into()));
        rest = after.trim_start();
    }
    Ok(vectors)
}

/// Numbers as text, stored in the type of the header.
fn read_text(data: &mut Input<'_>, count: usize, scalar: Scalar) -> Result<Numbers, Fault> {
    // A voxel takes a digit and a space at least, so memory stays within a few times the file.
    data.within_limit(count, scalar)?;
    let text = data.up_to(count as u64 * 32, "the voxels")?;
    let mut bytes = Vec::new();
    let mut found = 0;
    for word in text.split(|byte| byte.is_ascii_whitespace()).filter(|word| !word.is_empty()).take(count) {
        let word = String::from_utf8_lossy(word);
        let bad =
            || ImageProblem::bad("a voxel", &word, "a number of the header's type is needed").at_byte(found);
        macro_rules! push {
            ($number:ty) => {
                bytes.extend_from_slice(&word.parse::<$number>().map_err(|_| bad())?.to_le_bytes())
            };
        }
        match scalar {
            Scalar::I8 => push!(i8),
            Scalar::U8 => push!(u8),
            Scalar::I16 => push!(i16),
            Scalar::U16 => push!(u16),
            Scalar::I32 => push!(i32),
            Scalar::U32 => push!(u32),
            Scalar::I64 => push!(i64),
            Scalar::U64 => push!(u64),
            Scalar::F32 => push!(f32),
            Scalar::F64 => push!(f64),
        }
        found += 1;
    }
    if found < count {
        let problem =
            ImageProblem::Truncated { reading: "the voxels", expected: count as u64, found: found as u64 };
        return Err(problem.into());
    }
    Ok(Numbers { scalar, order: Order::Little, bytes })
}
