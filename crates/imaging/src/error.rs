//! Errors of images: the problem, its position and a remedy.

use std::path::PathBuf;

use pliant_geometry::io::Place;
use pliant_geometry::{FlatGrid, Vector3};

/// An image that could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The file or folder could not be opened or read from disk.
    #[error("cannot open `{}`: {source}; check the path and the permissions", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// Neither the first bytes nor the extension identify a readable format.
    #[error(
        "`{}` is not a supported image; formats read: NIfTI (.nii, .nii.gz, .hdr + .img), NRRD (.nrrd, .nhdr), MetaImage \
         (.mha, .mhd), GIPL (.gipl, .gipl.gz), DICOM (a folder of slices, or a segmentation); convert it, e.g. with ITK-SNAP or 3D Slicer",
        path.display()
    )]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// The file was opened, but contains no usable image.
    #[error("cannot read `{}`{place}: {problem}", path.display())]
    Content {
        /// The file, or the folder of a series.
        path: PathBuf,
        /// Place in the file.
        place: Place,
        /// The problem.
        problem: Box<ImageProblem>,
    },
}

/// The problem inside an image file, and a remedy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ImageProblem {
    /// The file ends too early, or announces more than it holds.
    #[error(
        "the file ends while reading {reading}: {expected} bytes are needed, {found} exist; copy or export it again"
    )]
    Truncated {
        /// The item being read.
        reading: &'static str,
        /// Bytes needed.
        expected: u64,
        /// Bytes found.
        found: u64,
    },
    /// Compressed data that cannot be decompressed.
    #[error(
        "{reading} cannot be decompressed after {found} bytes ({message}): the file is truncated or damaged; copy it again"
    )]
    Packed {
        /// The item being read.
        reading: &'static str,
        /// Bytes unpacked before.
        found: u64,
        /// Error of the decoder.
        message: String,
    },
    /// The first bytes do not belong to the format.
    #[error("the file is not {format}: {found}; check the extension, or that the file is complete")]
    NotThisFormat {
        /// The format expected.
        format: &'static str,
        /// The content found.
        found: String,
    },
    /// A field of the header is missing.
    #[error("the header has no `{field}`; export the image again")]
    MissingField {
        /// The field.
        field: &'static str,
    },
    /// A field of the header has an invalid value.
    #[error("`{field}` is {value}; {expected}")]
    BadField {
        /// The field.
        field: &'static str,
        /// Its value.
        value: String,
        /// The valid values, and a remedy.
        expected: &'static str,
    },
    /// An unsupported variant of the format.
    #[error("{what} cannot be read here; {remedy}")]
    Unsupported {
        /// The item found.
        what: String,
        /// The remedy.
        remedy: &'static str,
    },
    /// More voxels than allowed. Found before they are allocated.
    #[error(
        "the image has {voxels} voxels, more than the {limit} allowed; crop or resample it, or raise the limit"
    )]
    TooManyVoxels {
        /// Voxels announced; the largest number there is if they cannot be counted.
        voxels: u64,
        /// Voxels allowed.
        limit: u64,
    },
    /// More bytes than allowed. Found before they are read.
    #[error(
        "the voxels take {:.1} GB uncompressed, more than the {:.1} GB allowed; crop the image, resample it, or save it with smaller numbers \
         (8 or 16 bits)",
        *bytes as f64 * 1e-9, *limit as f64 * 1e-9
    )]
    TooManyBytes {
        /// Bytes of the voxels.
        bytes: u64,
        /// Bytes allowed.
        limit: u64,
    },
    /// The steps from voxel to voxel span no volume, or are not finite.
    #[error(
        "the steps from voxel to voxel ({}, {} and {} m) span no volume; correct the orientation in the header",
        shown(&steps[0]), shown(&steps[1]), shown(&steps[2])
    )]
    Singular {
        /// Steps along i, j and k [m].
        steps: [Vector3; 3],
    },
    /// A folder without any DICOM slice.
    #[error("no DICOM slice among {files} files; give the folder of the slices themselves")]
    NoSlices {
        /// Files examined.
        files: usize,
    },
    /// A folder with slices of several series.
    #[error("the folder holds {} series: {}; choose one by its UID", series.len(), series.join("; "))]
    MixedSeries {
        /// Each series: UID, description and number of slices.
        series: Vec<String>,
    },
    /// The requested series is not in the folder.
    #[error("no slice belongs to series {asked}; the folder holds {}", series.join("; "))]
    NoSuchSeries {
        /// The requested UID.
        asked: String,
        /// Each series: UID, description and number of slices.
        series: Vec<String>,
    },
    /// A slice differs from the first one where all must agree.
    #[error("`{file}` has {what} {found}, the first slice {expected}; remove files of other series")]
    SliceDiffers {
        /// File name of the slice.
        file: String,
        /// The property that differs.
        what: &'static str,
        /// The value of this slice.
        found: String,
        /// The value of the first slice.
        expected: String,
    },
    /// Slices are not evenly spaced.
    #[error(
        "between `{before}` and `{after}` the slices are {gap:.3} mm apart, elsewhere {expected:.3} mm: slices are missing; \
         copy the whole series"
    )]
    MissingSlices {
        /// File name before the gap.
        before: String,
        /// File name after the gap.
        after: String,
        /// Distance there [mm].
        gap: f64,
        /// Median distance [mm].
        expected: f64,
    },
    /// Two slices at the same place.
    #[error("`{first}` and `{second}` lie at the same position; keep one phase or echo in the folder")]
    SamePlace {
        /// File name of one.
        first: String,
        /// File name of the other.
        second: String,
    },
}

/// Three lengths for a message.
fn shown(step: &Vector3) -> String {
    format!("({:.3e}, {:.3e}, {:.3e})", step.x, step.y, step.z)
}

/// The error of a region.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LabelError {
    /// A value that is not a whole number.
    #[error(
        "voxel {voxel:?} is {value}, which is not a label (values from {} to {}); give a label image (resampled by nearest neighbours, not interpolated), or choose the region by a threshold",
        range[0], range[1]
    )]
    NotWhole {
        /// The value.
        value: f64,
        /// The voxel (i, j, k).
        voxel: [usize; 3],
        /// The least and the largest value of the image.
        range: [f64; 2],
    },
    /// A scan instead of a segmentation: many values that change from voxel to voxel.
    #[error(
        "this is not a label image: {values}{} values from {} to {} change from voxel to voxel, as in a CT or MR scan; segment it \
         first, or choose the region by a threshold",
        if *more { " or more" } else { "" }, range[0], range[1]
    )]
    Grey {
        /// Different values.
        values: usize,
        /// True if there are more than were counted.
        more: bool,
        /// The least and the largest value.
        range: [i32; 2],
    },
    /// A name that no label has.
    #[error("no label is named `{name}`; {}", instead(nearest, names))]
    NoSuchName {
        /// The name.
        name: String,
        /// The most similar name, if one is similar.
        nearest: Option<String>,
        /// The labels of the image that have names, each with its number.
        names: Vec<String>,
    },
    /// A name that several labels have.
    #[error("`{name}` names the labels {}; choose by number", list(labels))]
    AmbiguousName {
        /// The name.
        name: String,
        /// The labels.
        labels: Vec<i32>,
    },
    /// A range in which the image has no label.
    #[error("no voxel has a label in {range}; the image has {}", list(present))]
    EmptyRange {
        /// The range.
        range: String,
        /// Labels of the image, without 0.
        present: Vec<i32>,
    },
    /// An image with labels instead of a mask.
    #[error(
        "`{name}` is not a mask: it has the labels {}; give it as the only image, or give a threshold",
        list(labels)
    )]
    NoMask {
        /// The image.
        name: String,
        /// Its labels.
        labels: Vec<i32>,
    },
    /// A label beyond 32 bits.
    #[error("voxel {voxel:?} has the label {label}, beyond ±2147483647; renumber the labels")]
    TooLarge {
        /// The label.
        label: i128,
        /// The voxel (i, j, k).
        voxel: [usize; 3],
    },
    /// No voxel has the label.
    #[error("no voxel has label {label}; the image has {}", list(present))]
    Absent {
        /// Requested label.
        label: i32,
        /// Labels of the image, without 0.
        present: Vec<i32>,
    },
    /// The background was chosen.
    #[error("label 0 is the background; the image has {}", list(present))]
    Background {
        /// Labels of the image, without 0.
        present: Vec<i32>,
    },
    /// No label was chosen.
    #[error("no label was chosen; the image has {}", list(present))]
    NoneChosen {
        /// Labels of the image, without 0.
        present: Vec<i32>,
    },
    /// A label was chosen twice.
    #[error("label {label} is named twice; name each once")]
    Repeated {
        /// The label.
        label: i32,
    },
    /// The cleaning left nothing.
    #[error("nothing is left of label {label} after {operation}: {}", advice(operation))]
    Emptied {
        /// The label.
        label: i32,
        /// The operation that removed the last voxel.
        operation: &'static str,
    },
    /// A length that is negative, too large or not finite.
    #[error("{what} is {value}; it must be finite and not negative")]
    BadLength {
        /// Name of the length.
        what: &'static str,
        /// Its value [m].
        value: f64,
    },
    /// Two images to add have different voxels.
    #[error(
        "the images have different voxels ({first:?} and {second:?}, or other positions); resample one of them"
    )]
    OtherVoxels {
        /// Voxels along i, j, k of the first.
        first: [usize; 3],
        /// Voxels of the second.
        second: [usize; 3],
    },
    /// More labels than a mesh can distinguish.
    #[error("{labels} labels in one mesh, more than {limit}; mesh them in parts")]
    TooManyLabels {
        /// Requested labels.
        labels: usize,
        /// Labels allowed.
        limit: usize,
    },
    /// A region too large to work on.
    #[error("the region with its margin has {voxels} voxels, more than {limit}; crop or resample the image")]
    TooManyVoxels {
        /// Voxels needed.
        voxels: u64,
        /// Voxels allowed.
        limit: u64,
    },
}

/// Advice if an operation left nothing of a label.
fn advice(operation: &str) -> &'static str {
    match operation {
        "cleaning" => {
            "its voxels lie in pieces that cleaning removes; keep all pieces, or leave the label out"
        }
        "resampling" => {
            "it has too few voxels for a box of this size; mesh it by itself, or use a shorter edge"
        }
        _ => "it is about as thin as a voxel; take an image of finer voxels, or leave the label out",
    }
}

fn instead(nearest: &Option<String>, names: &[String]) -> String {
    match nearest {
        Some(nearest) => format!("did you mean `{nearest}`? ({})", named(names)),
        None => named(names),
    }
}

fn named(names: &[String]) -> String {
    match names {
        [] => "the labels of this image have no names: choose by number, or give a table of names".to_owned(),
        names => {
            let rest = names.len().saturating_sub(60);
            let more = if rest > 0 { format!(" and {rest} more") } else { String::new() };
            format!("the image has {}{more}", names[..names.len() - rest].join(", "))
        }
    }
}

fn list(labels: &[i32]) -> String {
    match labels {
        [] => "only background (0)".to_owned(),
        labels => {
            let words: Vec<String> = labels.iter().take(60).map(i32::to_string).collect();
            let rest = labels.len().saturating_sub(60);
            words.join(", ") + &if rest > 0 { format!(" and {rest} more") } else { String::new() }
        }
    }
}

/// A problem and its position, as returned by the readers of bytes, which do not know the path.
#[derive(Debug)]
pub(crate) struct Fault {
    pub(crate) place: Place,
    pub(crate) problem: ImageProblem,
}

impl From<FlatGrid> for ImageProblem {
    fn from(FlatGrid { steps }: FlatGrid) -> Self {
        Self::Singular { steps }
    }
}

impl From<FlatGrid> for Fault {
    fn from(flat: FlatGrid) -> Self {
        ImageProblem::from(flat).into()
    }
}

impl From<ImageProblem> for Fault {
    fn from(problem: ImageProblem) -> Self {
        Self { place: Place::File, problem }
    }
}

impl ImageProblem {
    pub(crate) fn at_byte(self, byte: usize) -> Fault {
        Fault { place: Place::Byte(byte), problem: self }
    }

    pub(crate) fn at_line(self, line: usize) -> Fault {
        Fault { place: Place::Line(line), problem: self }
    }

    /// A field with an invalid value; long values are shortened.
    pub(crate) fn bad(field: &'static str, value: impl ToString, expected: &'static str) -> Self {
        let value = value.to_string();
        let mut short: String = value.chars().take(60).filter(|c| !c.is_control()).collect();
        if short.len() < value.len() {
            short.push('…');
        }
        Self::BadField { field, value: format!("`{short}`"), expected }
    }
}
