//! MetaImage: a text header, `Key = Value`, that ends with `ElementDataFile`. The voxels follow (`.mha`) or
//! lie in a file of the same folder (`.mhd`). Each triple of `TransformMatrix` is the direction of an axis;
//! world coordinates are LPS [mm] (ITK's MetaImageIO). Leaves out: several values a voxel, several volumes,
//! data spread over several files, text data.

use nalgebra::Matrix3;
use pliant_geometry::Grid;
use pliant_geometry::Vector3;

use super::input::Input;
use super::text::{Field, ToWorld};
use super::{ReadOptions, checked_size};
use crate::error::{Fault, ImageProblem};
use crate::image::{Image, Order, Scalar};
use crate::names::LabelNames;

/// Keys that are read, each with its synonyms; all others are passed over.
const KEYS: [&[&str]; 15] = [
    &["NDims"],
    &["DimSize"],
    &["ElementType"],
    &["ElementNumberOfChannels"],
    &["BinaryData"],
    &["BinaryDataByteOrderMSB", "ElementByteOrderMSB"],
    &["CompressedData"],
    &["TransformMatrix", "Rotation", "Orientation"],
    &["Offset", "Position", "Origin"],
    &["ElementSpacing"],
    &["ElementSize"],
    &["HeaderSize"],
    &["DistanceUnits"],
    &["ElementToIntensityFunctionSlope"],
    &["ElementToIntensityFunctionOffset"],
];

const DATA: &str = "ElementDataFile";

pub(super) fn read(input: &mut Input<'_>, options: &ReadOptions) -> Result<Image, Fault> {
    let header = MetaImageHeader::read(input)?;
    let rank: usize = header.need("NDims")?.one("it must be 2 or 3")?;
    if !(2..=3).contains(&rank) {
        return Err(header.need("NDims")?.bad("it must be 2 or 3; extract one volume"));
    }
    let channels =
        header.optional("ElementNumberOfChannels", |field| field.one::<u32>("it must be a number"))?;
    if channels.unwrap_or(1) != 1 {
        return Err(header.need("ElementNumberOfChannels")?.bad("it must be 1; extract one channel"));
    }
    let dims = header.dims(rank, options)?;
    let scalar = header.scalar()?;
    let mut notes = Vec::new();
    let grid = header.grid(rank, dims, &mut notes)?;
    let scale = header.scale()?;
    let order = if header.flag("BinaryDataByteOrderMSB")? { Order::Big } else { Order::Little };
    if header.get("BinaryData").is_some() && !header.flag("BinaryData")? {
        return Err(header.need("BinaryData")?.bad("it must be True; write the image in binary"));
    }
    let numbers = header.data(input)?.numbers(grid.len(), scalar, order)?;
    Ok(Image { grid, format: "MetaImage".to_owned(), notes, names: LabelNames::default(), numbers, scale })
}

struct MetaImageHeader {
    fields: Vec<Field>,
}

impl MetaImageHeader {
    /// The lines up to `ElementDataFile`.
    fn read(input: &mut Input<'_>) -> Result<Self, Fault> {
        let mut fields: Vec<Field> = Vec::new();
        let mut line_number = 0;
        while let Some(line) = input.line()? {
            line_number += 1;
            let Some((key, value)) = line.split_once('=').filter(|_| line.is_ascii()) else {
                let found = format!("line {line_number} is not `Key = Value`");
                return Err(ImageProblem::NotThisFormat { format: "MetaImage", found }.at_line(line_number));
            };
            let (key, value) = (key.trim(), value.trim().to_owned());
            let last = key == DATA;
            let name = if last {
                Some(DATA)
            } else {
                KEYS.iter().find(|names| names.contains(&key)).map(|names| names[0])
            };
            if let Some(name) = name {
                fields.push(Field { name, value, line: line_number });
            }
            if last {
                return Ok(Self { fields });
            }
        }
        Err(ImageProblem::MissingField { field: DATA }.at_line(line_number))
    }

    fn get(&self, name: &str) -> Option<&Field> {
        self.fields.iter().rev().find(|field| field.name == name)
    }

    fn need(&self, name: &'static str) -> Result<&Field, Fault> {
        self.get(name).ok_or_else(|| ImageProblem::MissingField { field: name }.into())
    }

    fn optional<T>(&self, name: &str, read: impl Fn(&Field) -> Result<T, Fault>) -> Result<Option<T>, Fault> {
        self.get(name).map(read).transpose()
    }

    fn flag(&self, name: &str) -> Result<bool, Fault> {
        let Some(field) = self.get(name) else { return Ok(false) };
        match field.value.to_ascii_lowercase().as_str() {
            "true" | "t" | "1" => Ok(true),
            "false" | "f" | "0" => Ok(false),
            _ => Err(field.bad("it must be True or False")),
        }
    }

    fn dims(&self, rank: usize, options: &ReadOptions) -> Result<[usize; 3], Fault> {
        let field = self.need("DimSize")?;
        let sizes: Vec<u64> = field.list("whole numbers are needed, one per axis")?;
        if sizes.len() != rank {
            return Err(field.bad("one whole number per axis is needed"));
        }
        let dims = [sizes[0], sizes[1], sizes.get(2).copied().unwrap_or(1)];
        checked_size(dims, "DimSize", options).map_err(|problem| problem.at_line(field.line))
    }

    fn scalar(&self) -> Result<Scalar, Fault> {
        let field = self.need("ElementType")?;
        Ok(match field.value.as_str() {
            "MET_CHAR" => Scalar::I8,
            "MET_UCHAR" => Scalar::U8,
            "MET_SHORT" => Scalar::I16,
            "MET_USHORT" => Scalar::U16,
            "MET_INT" | "MET_LONG" => Scalar::I32,
            "MET_UINT" | "MET_ULONG" => Scalar::U32,
            "MET_LONG_LONG" => Scalar::I64,
            "MET_ULONG_LONG" => Scalar::U64,
            "MET_FLOAT" => Scalar::F32,
            "MET_DOUBLE" => Scalar::F64,
            _ => return Err(field.bad("only MET_CHAR to MET_DOUBLE are supported; convert the image")),
        })
    }

    /// [slope, intercept].
    fn scale(&self) -> Result<[f64; 2], Fault> {
        let number = |name, default: f64| {
            let read = |field: &Field| match field.one::<f64>("a number is needed")? {
                value if value.is_finite() => Ok(value),
                _ => Err(field.bad("it must be finite")),
            };
            Ok::<_, Fault>(self.optional(name, read)?.unwrap_or(default))
        };
        Ok([
            number("ElementToIntensityFunctionSlope", 1.0)?,
            number("ElementToIntensityFunctionOffset", 0.0)?,
        ])
    }

    fn grid(&self, rank: usize, dims: [usize; 3], notes: &mut Vec<String>) -> Result<Grid, Fault> {
        let numbers = |name: &str, count: usize| {
            let read = |field: &Field| {
                let values: Vec<f64> = field.list("numbers are needed")?;
                if values.len() == count {
                    Ok(values)
                } else {
                    Err(field.bad("it has the wrong number of values"))
                }
            };
            self.optional(name, read)
        };
        let mut spacing = Vector3::repeat(1.0);
        match numbers("ElementSpacing", rank)?.or(numbers("ElementSize", rank)?) {
            Some(values) => spacing.iter_mut().zip(values).for_each(|(h, value)| *h = value),
            None => notes.push("no ElementSpacing: 1 mm assumed".to_owned()),
        }
        if spacing.iter().any(|&h| !(h.is_finite() && h > 0.0)) {
            let name = if self.get("ElementSpacing").is_some() { "ElementSpacing" } else { "ElementSize" };
            return Err(self.need(name)?.bad("spacings must be positive and finite; correct them"));
        }
        let mut direction = Matrix3::identity();
        if let Some(matrix) = numbers("TransformMatrix", rank * rank)? {
            for (at, value) in matrix.into_iter().enumerate() {
                direction[(at % rank, at / rank)] = value;
            }
        }
        let mut origin = Vector3::zeros();
        if let Some(offset) = numbers("Offset", rank)? {
            origin.iter_mut().zip(offset).for_each(|(x, value)| *x = value);
        }
        let world = ToWorld { unit: self.unit()?, ..ToWorld::LPS_MILLIMETRES };
        let steps = [0, 1, 2].map(|axis| direction.column(axis) * spacing[axis]);
        let line = self.get("TransformMatrix").map_or(1, |field| field.line);
        Grid::new(dims, world.vector(origin), world.axes(steps))
            .map_err(|flat| ImageProblem::from(flat).at_line(line))
    }

    /// Metres per unit of length.
    fn unit(&self) -> Result<f64, Fault> {
        match self.get("DistanceUnits").map(|field| (field, field.value.as_str())) {
            None | Some((_, "mm" | "?" | "")) => Ok(1e-3),
            Some((_, "um")) => Ok(1e-6),
            Some((_, "cm")) => Ok(1e-2),
            Some((_, "m")) => Ok(1.0),
            Some((field, _)) => Err(field.bad("mm, um, cm or m is needed")),
        }
    }

    /// Returns the voxels from their start, unpacked.
    fn data<'i>(&self, input: &'i mut Input<'_>) -> Result<Input<'i>, Fault> {
        let file = self.need(DATA)?;
        let local = file.value.eq_ignore_ascii_case("local");
        if file.value == "LIST" || file.value.contains('%') || file.value.split_whitespace().count() > 1 {
            return Err(file.bad("one file is needed; write the image as a single .mha"));
        }
        let mut data: Input<'i> = if local { input.rest() } else { input.beside(DATA, &file.value)? };
        let skip =
            self.optional("HeaderSize", |field| match field.one::<i64>("a whole number is needed")? {
                bytes @ 0.. => Ok(bytes as u64),
                _ => Err(field.bad("a size counted from the end is not supported; write the image as .mha")),
            })?;
        data.skip(skip.unwrap_or(0), "the bytes before the voxels")?;
        Ok(if self.flag("CompressedData")? { data.unpack_zlib() } else { data })
    }
}
