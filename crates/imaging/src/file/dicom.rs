//! DICOM series: a folder of slices, one file each, uncompressed (implicit or explicit, little- or big-endian, or
//! deflated). Encoding: DICOM PS3.5 sections 7.1, 7.5 and annex A; place of a pixel: PS3.3 C.7.6.2.1.1 (equation
//! C.7.6.2.1-1), in LPS. Slices are sorted along their common normal; a tilted gantry shears the grid.
//! Leaves out: compressed pixels, several frames a file (enhanced and segmentation objects), colours.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::Path;

use pliant_geometry::Vector3;

use super::text::ToWorld;
use super::{ReadOptions, check_within, checked_size};
use crate::error::{Fault, ImageError, ImageProblem};
use crate::grid::Grid;
use crate::image::{Image, Numbers, Order, Scalar};

/// Distances between slices may differ by this part of their median.
const UNEVEN: f64 = 0.01;

/// Largest file taken for a slice [bytes].
const SLICE_LIMIT: u64 = 1 << 29;

/// Sequences within sequences.
const DEEPEST: usize = 64;

const DECOMPRESS: &str = "decompress the series first, e.g. with `gdcmconv --raw` or `dcmdjpeg`";
const EXPORT: &str = "export it as single-frame slices, or as NIfTI or NRRD";

/// Reads the series in a folder. Files that are no slices are passed over and noted.
pub(super) fn read_folder(folder: &Path, options: &ReadOptions) -> Result<Image, ImageError> {
    let open = |path: &Path| {
        let path = path.to_owned();
        move |source| ImageError::Open { path, source }
    };
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder).map_err(open(folder))? {
        let path = entry.map_err(open(folder))?.path();
        if path.is_file() {
            paths.push(path);
        }
    }
    paths.sort();
    let mut series: BTreeMap<String, Vec<Slice>> = BTreeMap::new();
    let mut voxels = 0;
    for path in &paths {
        let mut bytes = Vec::new();
        check_within(path, options.within.as_deref()).map_err(open(path))?;
        let file = fs::File::open(path).map_err(open(path))?;
        file.take(SLICE_LIMIT).read_to_end(&mut bytes).map_err(open(path))?;
        let in_file = |fault: Fault| fault.in_file(path);
        let Some(elements) = Elements::of(&bytes).map_err(in_file)? else { continue };
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let Some(mut slice) = Slice::new(&elements, name, options).map_err(in_file)? else { continue };
        if options.series.as_ref().is_none_or(|asked| *asked == slice.series) {
            voxels += slice.size[0] * slice.size[1];
        } else {
            slice.pixels = Vec::new();
        }
        if voxels > options.voxel_limit {
            let problem = ImageProblem::TooManyVoxels { voxels, limit: options.voxel_limit };
            return Err(Fault::from(problem).in_file(folder));
        }
        series.entry(slice.series.clone()).or_default().push(slice);
    }
    let slices =
        chosen(series, paths.len(), options).map_err(|problem| Fault::from(problem).in_file(folder))?;
    let others = paths.len() - slices.len();
    let mut image = volume(slices, options).map_err(|problem| Fault::from(problem).in_file(folder))?;
    if others > 0 {
        image.notes.push(format!("{others} other files in the folder were passed over"));
    }
    Ok(image)
}

/// A volume of the one slice in `bytes`.
pub(super) fn read_slice_bytes(bytes: &[u8], options: &ReadOptions) -> Result<Image, Fault> {
    let slice = match Elements::of(bytes)? {
        Some(elements) => Slice::new(&elements, "bytes".to_owned(), options)?,
        None => None,
    };
    let slice = slice.ok_or(ImageProblem::NoSlices { files: 1 })?;
    Ok(volume(vec![slice], options)?)
}

/// The series asked for, or the only one.
fn chosen(
    mut series: BTreeMap<String, Vec<Slice>>,
    files: usize,
    options: &ReadOptions,
) -> Result<Vec<Slice>, ImageProblem> {
    let list = |series: &BTreeMap<String, Vec<Slice>>| -> Vec<String> {
        let line = |(uid, slices): (&String, &Vec<Slice>)| {
            format!("{uid} ({}, {} slices)", slices[0].description, slices.len())
        };
        series.iter().map(line).collect()
    };
    if series.is_empty() {
        return Err(ImageProblem::NoSlices { files });
    }
    match &options.series {
        Some(asked) => series
            .remove(asked)
            .ok_or_else(|| ImageProblem::NoSuchSeries { asked: asked.clone(), series: list(&series) }),
        None if series.len() > 1 => Err(ImageProblem::MixedSeries { series: list(&series) }),
        None => Ok(series.into_values().flatten().collect()),
    }
}

/// What a slice says of itself.
struct Slice {
    name: String,
    series: String,
    description: String,
    /// Columns and rows.
    size: [u64; 2],
    scalar: Scalar,
    /// [slope, intercept].
    scale: [f64; 2],
    /// Centre of the first pixel, LPS [mm].
    position: Vector3,
    /// Steps along a row and down a column, LPS [mm].
    steps: [Vector3; 2],
    /// Along the normal [mm], if given.
    thickness: Option<f64>,
    /// Little-endian numbers.
    pixels: Vec<u8>,
}

impl Slice {
    /// `None` if the object has no pixels at all (a report, a plan).
    fn new(elements: &Elements<'_>, name: String, options: &ReadOptions) -> Result<Option<Self>, Fault> {
        let Some(pixels) = elements.get(0x7FE0_0010) else { return Ok(None) };
        elements.require_plain()?;
        let [columns, rows] =
            [elements.short(0x0028_0011, "Columns")?.into(), elements.short(0x0028_0010, "Rows")?.into()];
        checked_size([columns, rows, 1], "Rows", options)?;
        let scalar = elements.scalar()?;
        let needed = columns * rows * scalar.size() as u64;
        if (pixels.len() as u64) < needed {
            let found = pixels.len() as u64;
            return Err(ImageProblem::Truncated { reading: "the pixels", expected: needed, found }.into());
        }
        let position = elements.reals::<3>(0x0020_0032, "ImagePositionPatient")?;
        let o = elements.reals::<6>(0x0020_0037, "ImageOrientationPatient")?;
        let [down, along] = elements.reals::<2>(0x0028_0030, "PixelSpacing")?;
        if !(down > 0.0 && along > 0.0) {
            let expected = "spacings must be positive; export the series again";
            return Err(ImageProblem::bad("PixelSpacing", format!("{down}\\{along}"), expected).into());
        }
        let steps = [Vector3::new(o[0], o[1], o[2]), Vector3::new(o[3], o[4], o[5])];
        if steps.iter().any(|unit| (unit.norm() - 1.0).abs() > 1e-2) || steps[0].dot(&steps[1]).abs() > 1e-2 {
            let expected = "two unit vectors square to each other are needed; export the series again";
            return Err(ImageProblem::bad("ImageOrientationPatient", format!("{o:?}"), expected).into());
        }
        let optional = |tag, default| {
            elements.get(tag).map_or(Ok(default), |_| {
                elements.reals::<1>(tag, "RescaleSlope or RescaleIntercept").map(|[value]| value)
            })
        };
        Ok(Some(Self {
            name,
            series: elements.text(0x0020_000E).unwrap_or_default(),
            description: elements.text(0x0008_103E).unwrap_or_else(|| "no description".to_owned()),
            size: [columns, rows],
            scalar,
            scale: [optional(0x0028_1053, 1.0)?, optional(0x0028_1052, 0.0)?],
            position: position.into(),
            steps: [steps[0] * along, steps[1] * down],
            thickness: elements
                .reals::<1>(0x0018_0050, "SliceThickness")
                .ok()
                .map(|[h]| h)
                .filter(|&h| h > 0.0),
            pixels: elements.pixels(pixels, needed as usize, scalar),
        }))
    }
}

/// The slices as a volume, sorted along their normal.
fn volume(mut slices: Vec<Slice>, options: &ReadOptions) -> Result<Image, ImageProblem> {
    for slice in &slices[1..] {
        require_alike(&slices[0], slice)?;
    }
    let steps = slices[0].steps;
    let normal = steps[0].cross(&steps[1]).normalize();
    slices.sort_by(|a, b| a.position.dot(&normal).total_cmp(&b.position.dot(&normal)));
    let step = slice_step(&slices, &normal)?;
    let [columns, rows] = slices[0].size;
    let dims = checked_size([columns, rows, slices.len() as u64], "Rows", options)?;
    let world = ToWorld::LPS_MILLIMETRES;
    let grid = Grid::new(dims, world.vector(slices[0].position), world.axes([steps[0], steps[1], step]))?;
    let scale = slices[0].scale;
    let numbers = if slices.iter().all(|slice| slice.scale == scale) {
        let bytes = slices.iter().flat_map(|slice| &slice.pixels).copied().collect();
        Numbers { scalar: slices[0].scalar, order: Order::Little, bytes }
    } else {
        // Each slice has a scale of its own (PET): the values themselves are kept.
        Numbers { scalar: Scalar::F32, order: Order::Little, bytes: rescaled(&slices, dims) }
    };
    let scale = if numbers.scalar == slices[0].scalar { scale } else { [1.0, 0.0] };
    Ok(Image { grid, format: "DICOM".to_owned(), notes: Vec::new(), numbers, scale })
}

fn rescaled(slices: &[Slice], dims: [usize; 3]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(4 * dims.iter().product::<usize>());
    for slice in slices {
        let numbers = Numbers { scalar: slice.scalar, order: Order::Little, bytes: slice.pixels.clone() };
        for at in 0..dims[0] * dims[1] {
            let value = slice.scale[0] * numbers.value(at) + slice.scale[1];
            bytes.extend((value as f32).to_le_bytes());
        }
    }
    bytes
}

fn require_alike(first: &Slice, other: &Slice) -> Result<(), ImageProblem> {
    let differs = |what, found: String, expected: String| {
        Err(ImageProblem::SliceDiffers { file: other.name.clone(), what, found, expected })
    };
    if first.size != other.size {
        return differs("size", format!("{:?}", other.size), format!("{:?}", first.size));
    }
    if first.scalar != other.scalar {
        return differs("type of number", format!("{:?}", other.scalar), format!("{:?}", first.scalar));
    }
    for (what, step, expected) in
        [("row step", other.steps[0], first.steps[0]), ("column step", other.steps[1], first.steps[1])]
    {
        if (step - expected).norm() > 1e-3 * expected.norm() {
            return differs(
                what,
                format!("{:?} mm", step.as_slice()),
                format!("{:?} mm", expected.as_slice()),
            );
        }
    }
    Ok(())
}

/// The step from slice to slice [mm, LPS]; an error where the slices are not evenly spaced.
fn slice_step(slices: &[Slice], normal: &Vector3) -> Result<Vector3, ImageProblem> {
    let [first, .., last] = slices else {
        let thickness = slices[0].thickness.ok_or(ImageProblem::MissingField { field: "SliceThickness" })?;
        return Ok(normal * thickness);
    };
    let steps: Vec<Vector3> = slices.windows(2).map(|pair| pair[1].position - pair[0].position).collect();
    let mut gaps: Vec<f64> = steps.iter().map(|step| step.dot(normal)).collect();
    gaps.sort_by(f64::total_cmp);
    let median = gaps[gaps.len() / 2];
    for (pair, step) in slices.windows(2).zip(&steps) {
        let gap = step.dot(normal);
        if gap <= 1e-3 * median.max(1e-3) {
            return Err(ImageProblem::SamePlace {
                first: pair[0].name.clone(),
                second: pair[1].name.clone(),
            });
        }
        if (gap / median - 1.0).abs() > UNEVEN {
            let [before, after] = [&pair[0], &pair[1]].map(|slice| slice.name.clone());
            return Err(ImageProblem::MissingSlices { before, after, gap, expected: median });
        }
    }
    let step = (last.position - first.position) / (slices.len() - 1) as f64;
    // A shift within the plane (tilted gantry) must be the same from slice to slice.
    if let Some(at) = steps.iter().position(|own| (own - step).norm() > 0.1 * step.norm()) {
        return Err(ImageProblem::SliceDiffers {
            file: slices[at + 1].name.clone(),
            what: "a step from the slice before of",
            found: format!("{:?} mm", steps[at].as_slice()),
            expected: format!("(like all others) {:?} mm", step.as_slice()),
        });
    }
    Ok(step)
}

/// The elements of a file that matter here.
struct Elements<'a> {
    /// Value by tag (group × 2¹⁶ + element), of the top level only.
    values: BTreeMap<u32, Cow<'a, [u8]>>,
    order: Order,
    /// Name of a transfer syntax that is not read.
    compressed: Option<String>,
}

/// The tags that are read.
const TAGS: [u32; 18] = [
    0x0002_0010,
    0x0008_103E,
    0x0018_0050,
    0x0020_000E,
    0x0020_0032,
    0x0020_0037,
    0x0028_0002,
    0x0028_0004,
    0x0028_0008,
    0x0028_0010,
    0x0028_0011,
    0x0028_0030,
    0x0028_0100,
    0x0028_0101,
    0x0028_0102,
    0x0028_0103,
    0x0028_1052,
    0x0028_1053,
];

impl<'a> Elements<'a> {
    /// `None` if the bytes are not those of a DICOM file.
    fn of(bytes: &'a [u8]) -> Result<Option<Self>, Fault> {
        if bytes.get(128..132) != Some(b"DICM") {
            return Ok(None);
        }
        let mut values = BTreeMap::new();
        let mut meta = Walk { bytes, at: 132, explicit: true, order: Order::Little };
        meta.collect(&mut values, true)?;
        let syntax = values.get(&0x0002_0010).map(|value: &Cow<'_, [u8]>| trimmed(value));
        let rest = &bytes[meta.at..];
        let (explicit, order) = match syntax.as_deref() {
            Some("1.2.840.10008.1.2") => (false, Order::Little),
            Some("1.2.840.10008.1.2.2") => (true, Order::Big),
            _ => (true, Order::Little),
        };
        let compressed = match syntax.as_deref() {
            Some(
                "1.2.840.10008.1.2"
                | "1.2.840.10008.1.2.1"
                | "1.2.840.10008.1.2.1.99"
                | "1.2.840.10008.1.2.2",
            ) => None,
            Some(other) => Some(other.to_owned()),
            None => return Err(ImageProblem::MissingField { field: "TransferSyntaxUID" }.at_byte(132)),
        };
        if syntax.as_deref() == Some("1.2.840.10008.1.2.1.99") {
            let mut unpacked = Vec::new();
            let result =
                flate2::bufread::DeflateDecoder::new(rest).take(SLICE_LIMIT).read_to_end(&mut unpacked);
            if let Err(error) = result {
                let (found, message) = (unpacked.len() as u64, error.to_string());
                return Err(ImageProblem::Packed { reading: "the slice", found, message }.at_byte(meta.at));
            }
            let mut walked = BTreeMap::new();
            Walk { bytes: &unpacked, at: 0, explicit, order }.collect(&mut walked, false)?;
            values.extend(walked.into_iter().map(|(tag, value)| (tag, value.into_owned().into())));
        } else {
            Walk { bytes, at: meta.at, explicit, order }.collect(&mut values, false)?;
        }
        Ok(Some(Self { values, order, compressed }))
    }

    fn get(&self, tag: u32) -> Option<&[u8]> {
        self.values.get(&tag).map(AsRef::as_ref)
    }

    fn text(&self, tag: u32) -> Option<String> {
        self.get(tag).map(trimmed).filter(|text| !text.is_empty())
    }

    fn short(&self, tag: u32, field: &'static str) -> Result<u16, ImageProblem> {
        let value = self.get(tag).ok_or(ImageProblem::MissingField { field })?;
        let bytes: [u8; 2] = value.get(..2).and_then(|bytes| bytes.try_into().ok()).ok_or_else(|| {
            ImageProblem::bad(field, format!("{} bytes long", value.len()), "2 bytes are needed")
        })?;
        Ok(if self.order == Order::Little { u16::from_le_bytes(bytes) } else { u16::from_be_bytes(bytes) })
    }

    /// `N` numbers of a decimal string.
    fn reals<const N: usize>(&self, tag: u32, field: &'static str) -> Result<[f64; N], ImageProblem> {
        let text = self.get(tag).map(trimmed).ok_or(ImageProblem::MissingField { field })?;
        let numbers: Option<Vec<f64>> =
            text.split('\\').map(|word| word.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
        numbers.and_then(|numbers| numbers.try_into().ok()).ok_or_else(|| {
            ImageProblem::bad(field, text, "it has the wrong number of values, or one is no number")
        })
    }

    /// An error for pixels that are not one uncompressed grey or label value each.
    fn require_plain(&self) -> Result<(), ImageProblem> {
        if let Some(syntax) = &self.compressed {
            let what = format!("a slice in transfer syntax {syntax} (compressed)");
            return Err(ImageProblem::Unsupported { what, remedy: DECOMPRESS });
        }
        let frames = self.text(0x0028_0008).unwrap_or_else(|| "1".to_owned());
        if frames != "1" {
            return Err(ImageProblem::Unsupported {
                what: format!("a file of {frames} frames"),
                remedy: EXPORT,
            });
        }
        let samples = self.short(0x0028_0002, "SamplesPerPixel")?;
        let meaning = self.text(0x0028_0004).unwrap_or_default();
        if samples != 1 || !(meaning.starts_with("MONOCHROME") || meaning == "PALETTE COLOR") {
            let what = format!("pixels of {samples} samples ({meaning})");
            return Err(ImageProblem::Unsupported { what, remedy: EXPORT });
        }
        Ok(())
    }

    fn scalar(&self) -> Result<Scalar, ImageProblem> {
        let allocated = self.short(0x0028_0100, "BitsAllocated")?;
        let stored = self.short(0x0028_0101, "BitsStored")?;
        let high = self.short(0x0028_0102, "HighBit")?;
        if stored == 0 || stored > allocated || high != stored - 1 {
            let value = format!("{stored} of {allocated} bits, the highest {high}");
            return Err(ImageProblem::bad(
                "BitsStored",
                value,
                "the lowest bits must be used; export the series again",
            ));
        }
        match (allocated, self.short(0x0028_0103, "PixelRepresentation")?) {
            (8, 0) => Ok(Scalar::U8),
            (8, 1) => Ok(Scalar::I8),
            (16, 0) => Ok(Scalar::U16),
            (16, 1) => Ok(Scalar::I16),
            (32, 0) => Ok(Scalar::U32),
            (32, 1) => Ok(Scalar::I32),
            (bits, sign) => Err(ImageProblem::Unsupported {
                what: format!("pixels of {bits} bits with PixelRepresentation {sign}"),
                remedy: EXPORT,
            }),
        }
    }

    /// Pixels as little-endian numbers, with what stands in unused high bits replaced by the sign or by 0.
    fn pixels(&self, bytes: &[u8], needed: usize, scalar: Scalar) -> Vec<u8> {
        let size = scalar.size();
        let mut pixels = bytes[..needed].to_vec();
        if self.order == Order::Big {
            pixels.chunks_exact_mut(size).for_each(<[u8]>::reverse);
        }
        let stored = u32::from(self.short(0x0028_0101, "BitsStored").unwrap_or(8 * size as u16));
        let unused = 64 - stored.clamp(1, 64);
        if stored < 8 * size as u32 {
            for pixel in pixels.chunks_exact_mut(size) {
                let mut wide = [0; 8];
                wide[..size].copy_from_slice(pixel);
                let raw = u64::from_le_bytes(wide) << unused;
                let signed = matches!(scalar, Scalar::I8 | Scalar::I16 | Scalar::I32);
                let value = if signed { (raw as i64 >> unused) as u64 } else { raw >> unused };
                pixel.copy_from_slice(&value.to_le_bytes()[..size]);
            }
        }
        pixels
    }
}

/// Text of a value without its padding.
fn trimmed(value: impl AsRef<[u8]>) -> String {
    String::from_utf8_lossy(value.as_ref()).trim_matches(['\0', ' ']).to_owned()
}

/// A walk over the elements of a data set.
struct Walk<'a> {
    bytes: &'a [u8],
    at: usize,
    explicit: bool,
    order: Order,
}

/// Length that stands for "until a delimiter".
const UNDEFINED: u32 = u32::MAX;

impl<'a> Walk<'a> {
    /// Notes the elements of the top level, up to the pixels or the end; of the group 2 only if `meta`.
    fn collect(&mut self, values: &mut BTreeMap<u32, Cow<'a, [u8]>>, meta: bool) -> Result<(), Fault> {
        let mut depth = 0_usize;
        while self.at < self.bytes.len() {
            let start = self.at;
            let tag = self.tag()?;
            if meta && tag >> 16 != 2 {
                self.at = start;
                return Ok(());
            }
            let delimiter = tag >> 16 == 0xFFFE;
            let (sequence, length) = if delimiter { (false, self.long()?) } else { self.kind_and_length()? };
            match tag {
                0xFFFE_E00D | 0xFFFE_E0DD => {
                    depth = depth.checked_sub(1).ok_or_else(|| {
                        ImageProblem::bad(
                            "a delimiter",
                            "outside any sequence",
                            "the file is damaged; copy it again",
                        )
                        .at_byte(start)
                    })?;
                }
                0x7FE0_0010 if depth == 0 => {
                    // Packed pixels come in pieces; the transfer syntax tells, and they are refused later.
                    let rest = &self.bytes[self.at..];
                    let count =
                        if length == UNDEFINED { rest.len() } else { (length as usize).min(rest.len()) };
                    values.insert(tag, rest[..count].into());
                    self.at += count;
                    return Ok(());
                }
                _ if length == UNDEFINED => {
                    depth += 1;
                    if depth > DEEPEST {
                        let expected = "no more than 64 levels are read; the file is damaged: copy it again";
                        return Err(
                            ImageProblem::bad("sequences", "nested too deep", expected).at_byte(start)
                        );
                    }
                }
                _ => {
                    let value = self.take(length as usize)?;
                    if depth == 0 && !sequence && TAGS.contains(&tag) {
                        values.insert(tag, value.into());
                    }
                }
            }
        }
        Ok(())
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], Fault> {
        let rest = &self.bytes[self.at..];
        if count > rest.len() {
            let (expected, found) = (count as u64, rest.len() as u64);
            return Err(ImageProblem::Truncated { reading: "an element", expected, found }.at_byte(self.at));
        }
        self.at += count;
        Ok(&rest[..count])
    }

    fn word(&mut self) -> Result<u16, Fault> {
        let bytes = self.take(2)?;
        let bytes = [bytes[0], bytes[1]];
        Ok(if self.order == Order::Little { u16::from_le_bytes(bytes) } else { u16::from_be_bytes(bytes) })
    }

    fn long(&mut self) -> Result<u32, Fault> {
        let [first, second] = [self.word()?, self.word()?].map(u32::from);
        Ok(if self.order == Order::Little { second << 16 | first } else { first << 16 | second })
    }

    fn tag(&mut self) -> Result<u32, Fault> {
        Ok(u32::from(self.word()?) << 16 | u32::from(self.word()?))
    }

    /// Whether the element is a sequence, and how long its value is.
    fn kind_and_length(&mut self) -> Result<(bool, u32), Fault> {
        if !self.explicit {
            return Ok((false, self.long()?));
        }
        let kind = self.take(2)?;
        match kind {
            b"OB" | b"OW" | b"OF" | b"OD" | b"OL" | b"OV" | b"SQ" | b"UN" | b"UC" | b"UR" | b"UT" | b"SV"
            | b"UV" => {
                self.take(2)?;
                Ok((kind == b"SQ", self.long()?))
            }
            _ => Ok((false, u32::from(self.word()?))),
        }
    }
}
