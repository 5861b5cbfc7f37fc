//! DICOM: series in a folder of slices, one file each; files of several frames; segmentations
//! (`segmentation.rs`). All uncompressed (implicit or explicit, little- or big-endian, or deflated;
//! `elements.rs`). Place of a pixel: PS3.3 C.7.6.2.1.1 (equation C.7.6.2.1-1), in LPS. Slices are sorted
//! along their common normal; a tilted gantry shears the grid. Leaves out: compressed pixels, colours,
//! contours (RT structure sets, which are named).

mod elements;
mod segmentation;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use pliant_geometry::Grid;
use pliant_geometry::Vector3;

use super::text::ToWorld;
use super::{ReadOptions, check_within, checked_size};
use crate::error::{Fault, ImageError, ImageProblem};
use crate::image::{Image, Numbers, Order, Scalar};
use crate::names::LabelNames;
use elements::{DataSet, Elements, PIXELS};

/// Distances between slices may differ by this part of their median.
const UNEVEN: f64 = 0.01;

/// Largest file read [bytes].
const FILE_LIMIT: u64 = 1 << 29;

const DECOMPRESS: &str = "decompress the series first, e.g. with `gdcmconv --raw` or `dcmdjpeg`";
const EXPORT: &str = "export it as single-frame slices, or as NIfTI or NRRD";

/// The type of a DICOM file.
enum Object {
    /// Slices of a series: one, or the frames of the file.
    Slices(Vec<Slice>),
    /// A segmentation.
    Segmentation,
    /// An RT structure set.
    Contours,
    /// A file without pixels, such as a report.
    Other,
}

impl Object {
    fn of(elements: &Elements<'_>, name: &str, options: &ReadOptions) -> Result<Self, Fault> {
        Ok(match elements.text(0x0008_0016).as_deref() {
            Some("1.2.840.10008.5.1.4.1.1.481.3") => Self::Contours,
            Some("1.2.840.10008.5.1.4.1.1.66.4" | "1.2.840.10008.5.1.4.1.1.66.7") => Self::Segmentation,
            _ if elements.get(PIXELS).is_none() => Self::Other,
            _ => Self::Slices(Slice::of_file(elements, name, options)?),
        })
    }
}

/// Contours instead of voxels.
fn contours() -> ImageProblem {
    ImageProblem::Unsupported {
        what: "an RT structure set (RTSTRUCT), which has contours instead of voxels,".to_owned(),
        remedy: "convert it to a label image, e.g. with 3D Slicer (SlicerRT: export the segmentation as NRRD or NIfTI), plastimatch \
                 (`plastimatch convert --input rtss.dcm --referenced-ct FOLDER --output-labelmap seg.nrrd`) or dcmrtstruct2nii",
    }
}

/// Reads a file by itself: a segmentation, an image of several frames or, where `slice` says so, the volume
/// of a single slice.
pub(super) fn read_file(bytes: &[u8], slice: bool, options: &ReadOptions) -> Result<Image, Fault> {
    let set = DataSet::of(bytes)?.ok_or(ImageProblem::NoSlices { files: 1 })?;
    let elements = set.elements()?;
    match Object::of(&elements, "the file", options)? {
        Object::Slices(slices) if slice || slices.len() > 1 => Ok(volume(slices, options)?),
        Object::Slices(_) => Err(ImageProblem::Unsupported {
            what: "a single DICOM slice".to_owned(),
            remedy: "give the folder of the whole series",
        }
        .into()),
        Object::Segmentation => segmentation::read(&elements, options),
        Object::Contours => Err(contours().into()),
        Object::Other => Err(ImageProblem::NoSlices { files: 1 }.into()),
    }
}

/// The bytes of a file.
pub(super) fn file_bytes(path: &Path) -> Result<Vec<u8>, ImageError> {
    let failed = |source| ImageError::Open { path: path.to_owned(), source };
    pliant_geometry::io::read_limited(path, FILE_LIMIT).map_err(failed)
}

/// The DICOM files of a folder.
#[derive(Default)]
struct Found {
    series: BTreeMap<String, Vec<Slice>>,
    /// Segmentations by the UIDs of their series, with their files.
    segmentations: BTreeMap<String, Vec<PathBuf>>,
    contours: usize,
    files: usize,
}

impl Found {
    /// The choices: UID and description of each series.
    fn list(&self) -> Vec<String> {
        let slices = self
            .series
            .iter()
            .map(|(uid, slices)| format!("{uid} ({}, {} slices)", slices[0].description, slices.len()));
        let name = |path: &PathBuf| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let segmentations = self.segmentations.iter().map(|(uid, files)| {
            format!("{uid} (segmentation, {})", files.iter().map(name).collect::<Vec<_>>().join(", "))
        });
        slices.chain(segmentations).collect()
    }

    /// The requested UID, or the only one.
    fn chosen(&self, options: &ReadOptions) -> Result<String, ImageProblem> {
        let mut uids = self.series.keys().chain(self.segmentations.keys());
        match (&options.series, uids.next()) {
            (None, None) if self.contours > 0 => Err(contours()),
            (_, None) => Err(ImageProblem::NoSlices { files: self.files }),
            (Some(asked), _) if self.series.contains_key(asked) || self.segmentations.contains_key(asked) => {
                Ok(asked.clone())
            }
            (Some(asked), _) => Err(ImageProblem::NoSuchSeries { asked: asked.clone(), series: self.list() }),
            (None, Some(first)) => match uids.next() {
                Some(_) => Err(ImageProblem::MixedSeries { series: self.list() }),
                None => Ok(first.clone()),
            },
        }
    }
}

/// Reads the series in a folder. Other files are ignored with a note.
pub(super) fn read_folder(
    folder: &Path,
    options: &ReadOptions,
    progress: &dyn Fn(f64),
) -> Result<Image, ImageError> {
    let open = |source| ImageError::Open { path: folder.to_owned(), source };
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder).map_err(open)? {
        let path = entry.map_err(open)?.path();
        if path.is_file() {
            paths.push(path);
        }
    }
    paths.sort();
    let in_folder = |problem| Fault::from(problem).in_file(folder);
    let mut found = Found { files: paths.len(), ..Found::default() };
    let mut voxels = 0;
    for (at, path) in paths.iter().enumerate() {
        progress(at as f64 / paths.len() as f64);
        check_within(path, options.within.as_deref())
            .map_err(|source| ImageError::Open { path: path.clone(), source })?;
        let bytes = file_bytes(path)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let in_file = |fault: Fault| fault.in_file(path);
        let Some(set) = DataSet::of(&bytes).map_err(in_file)? else { continue };
        let elements = set.elements().map_err(in_file)?;
        let uid = elements.text(0x0020_000E).unwrap_or_default();
        match Object::of(&elements, &name, options).map_err(in_file)? {
            Object::Slices(mut slices) => {
                if options.series.as_ref().is_none_or(|asked| *asked == uid) {
                    voxels += slices.iter().map(|slice| slice.size[0] * slice.size[1]).sum::<u64>();
                } else {
                    slices.iter_mut().for_each(|slice| slice.pixels = Vec::new());
                }
                if voxels > options.voxel_limit {
                    let limit = options.voxel_limit;
                    return Err(in_folder(ImageProblem::TooManyVoxels { voxels, limit }));
                }
                found.series.entry(uid).or_default().append(&mut slices);
            }
            Object::Segmentation => found.segmentations.entry(uid).or_default().push(path.clone()),
            Object::Contours => found.contours += 1,
            Object::Other => {}
        }
    }
    let uid = found.chosen(options).map_err(in_folder)?;
    let (mut image, used) = match (found.segmentations.remove(&uid), found.series.remove(&uid)) {
        (Some(files), _) => match files.as_slice() {
            [file] => {
                let image = read_file(&file_bytes(file)?, false, options);
                (image.map_err(|fault| fault.in_file(file))?, 1)
            }
            _ => {
                let what = format!("a series of {} segmentations", files.len());
                let remedy = "give one of the files itself";
                return Err(in_folder(ImageProblem::Unsupported { what, remedy }));
            }
        },
        (None, slices) => {
            let slices = slices.unwrap_or_default();
            let names: std::collections::BTreeSet<&str> =
                slices.iter().map(|slice| slice.name.as_str()).collect();
            let used = names.len();
            (volume(slices, options).map_err(in_folder)?, used)
        }
    };
    if found.files > used {
        image.notes.push(format!("{} other files in the folder were ignored", found.files - used));
    }
    if found.contours > 0 {
        image.notes.push(format!("RT structure sets (contours) among the ignored files: {}", found.contours));
    }
    Ok(image)
}

/// The properties of a slice.
struct Slice {
    name: String,
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
    /// The slice of a file, or its frames, each as a slice.
    fn of_file(elements: &Elements<'_>, name: &str, options: &ReadOptions) -> Result<Vec<Self>, Fault> {
        elements.require_plain()?;
        let frames = Frames::of(elements)?;
        let [columns, rows] = frames.size(options)?;
        let scalar = elements.scalar()?;
        let each = columns * rows * scalar.size() as u64;
        let (needed, bytes) = (each * frames.count as u64, elements.get(PIXELS).unwrap_or_default());
        if (bytes.len() as u64) < needed {
            let found = bytes.len() as u64;
            return Err(ImageProblem::Truncated { reading: "the pixels", expected: needed, found }.into());
        }
        let slice = |frame: usize| {
            let Placed { position, steps, thickness, .. } = frames.place(frame)?;
            let scale = |tag, default| {
                let group = frames.group(frame, 0x0028_9145).filter(|group| group.get(tag).is_some());
                let holder = group.unwrap_or(elements);
                holder.get(tag).map_or(Ok(default), |_| {
                    holder.reals::<1>(tag, "RescaleSlope or RescaleIntercept").map(|[value]| value)
                })
            };
            let pixels = &bytes[frame * each as usize..(frame + 1) * each as usize];
            Ok(Self {
                name: name.to_owned(),
                description: elements.text(0x0008_103E).unwrap_or_else(|| "no description".to_owned()),
                size: [columns, rows],
                scalar,
                scale: [scale(0x0028_1053, 1.0)?, scale(0x0028_1052, 0.0)?],
                position,
                steps,
                thickness,
                pixels: elements.pixels(pixels, scalar),
            })
        };
        (0..frames.count).map(slice).collect()
    }
}

/// Places of the frames of a file. They come from the functional groups, shared or of one frame, otherwise
/// from the file as a whole.
struct Frames<'a> {
    elements: &'a Elements<'a>,
    shared: Option<&'a Elements<'a>>,
    per_frame: &'a [Elements<'a>],
    count: usize,
}

/// The place of a frame, LPS [mm].
struct Placed {
    /// Centre of the first pixel.
    position: Vector3,
    /// Steps along a row and down a column.
    steps: [Vector3; 2],
    /// From frame to frame, if given.
    spacing: Option<f64>,
    thickness: Option<f64>,
}

impl<'a> Frames<'a> {
    fn of(elements: &'a Elements<'a>) -> Result<Self, ImageProblem> {
        let count = elements.frames()?;
        let per_frame = elements.items(0x5200_9230);
        if count > 1 && per_frame.len() != count {
            let what = format!("a file of {count} frames with the positions of {} frames", per_frame.len());
            return Err(ImageProblem::Unsupported { what, remedy: EXPORT });
        }
        Ok(Self { elements, shared: elements.items(0x5200_9229).first(), per_frame, count })
    }

    /// Columns and rows.
    fn size(&self, options: &ReadOptions) -> Result<[u64; 2], ImageProblem> {
        let of = |tag, field| self.elements.short(tag, field).map(u64::from);
        let [columns, rows] = [of(0x0028_0011, "Columns")?, of(0x0028_0010, "Rows")?];
        checked_size([columns, rows, self.count as u64], "Rows", options)?;
        Ok([columns, rows])
    }

    /// A functional group of a frame.
    fn group(&self, frame: usize, sequence: u32) -> Option<&'a Elements<'a>> {
        let in_item = |item: &'a Elements<'a>| item.items(sequence).first();
        self.per_frame.get(frame).and_then(in_item).or_else(|| self.shared.and_then(in_item))
    }

    fn place(&self, frame: usize) -> Result<Placed, ImageProblem> {
        let group = |sequence| self.group(frame, sequence).unwrap_or(self.elements);
        let position = group(0x0020_9113).reals::<3>(0x0020_0032, "ImagePositionPatient")?;
        let o = group(0x0020_9116).reals::<6>(0x0020_0037, "ImageOrientationPatient")?;
        let measures = group(0x0028_9110);
        let [down, along] = measures.reals::<2>(0x0028_0030, "PixelSpacing")?;
        if !(down > 0.0 && along > 0.0) {
            let expected = "spacings must be positive; export the series again";
            return Err(ImageProblem::bad("PixelSpacing", format!("{down}\\{along}"), expected));
        }
        let steps = [Vector3::new(o[0], o[1], o[2]), Vector3::new(o[3], o[4], o[5])];
        if steps.iter().any(|unit| (unit.norm() - 1.0).abs() > 1e-2) || steps[0].dot(&steps[1]).abs() > 1e-2 {
            let expected = "two perpendicular unit vectors are needed; export the series again";
            return Err(ImageProblem::bad("ImageOrientationPatient", format!("{o:?}"), expected));
        }
        let length = |tag, field| measures.reals::<1>(tag, field).ok().map(|[h]| h).filter(|&h| h > 0.0);
        Ok(Placed {
            position: position.into(),
            steps: [steps[0] * along, steps[1] * down],
            spacing: length(0x0018_0088, "SpacingBetweenSlices"),
            thickness: length(0x0018_0050, "SliceThickness"),
        })
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
        // Each slice has its own scale (PET), so the values themselves are stored.
        Numbers { scalar: Scalar::F32, order: Order::Little, bytes: rescaled(&slices, dims) }
    };
    let scale = if numbers.scalar == slices[0].scalar { scale } else { [1.0, 0.0] };
    Ok(Image {
        grid,
        format: "DICOM".to_owned(),
        notes: Vec::new(),
        names: LabelNames::default(),
        numbers,
        scale,
    })
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

/// The step from slice to slice [mm, LPS]; an error if slices are unevenly spaced.
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
    if let Some(at) = steps.iter().position(|between| (between - step).norm() > 0.1 * step.norm()) {
        return Err(ImageProblem::SliceDiffers {
            file: slices[at + 1].name.clone(),
            what: "a step of",
            found: format!("{:?} mm from the previous slice", steps[at].as_slice()),
            expected: format!("{:?} mm, like all others", step.as_slice()),
        });
    }
    Ok(step)
}
