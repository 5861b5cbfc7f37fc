//! Image files in: NIfTI-1 and -2, NRRD, MetaImage, GIPL, DICOM series and segmentations. The first bytes
//! select the reader if they identify a format, otherwise the extension; gzip is recognised by its own first
//! bytes. Sizes are compared with the limit and the existing bytes before allocation. Leaves out: more than
//! one value per voxel except for layers of segments, time series, compressed DICOM slices, contours.

mod dicom;
mod gipl;
mod input;
mod layers;
mod metaimage;
mod nifti;
mod nrrd;
mod text;

use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};

use crate::error::{Fault, ImageError, ImageProblem};
use crate::image::Image;
use input::Input;

/// Limits of a reader.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadOptions {
    /// Most voxels allowed.
    pub voxel_limit: u64,
    /// Most bytes of voxels allowed, unpacked.
    pub byte_limit: u64,
    /// UID of the DICOM series to read, if a folder holds several.
    pub series: Option<String>,
    /// Folder, links resolved, that files named in headers and slices have to be in; anywhere if not given.
    pub within: Option<PathBuf>,
}

impl Default for ReadOptions {
    /// 2²⁹ voxels of 2 GiB at most (as of 32-bit numbers), the only series of a folder.
    fn default() -> Self {
        Self { voxel_limit: 1 << 29, byte_limit: 1 << 31, series: None, within: None }
    }
}

/// A format of image files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageFormat {
    /// NIfTI-1 or NIfTI-2: `.nii`, or `.hdr` beside `.img`.
    Nifti,
    /// NRRD: `.nrrd`, or `.nhdr` beside its data.
    Nrrd,
    /// MetaImage: `.mha`, or `.mhd` beside its data.
    MetaImage,
    /// GIPL: `.gipl`.
    Gipl,
    /// DICOM: a folder of slices, or a file of several frames.
    Dicom,
}

impl ImageFormat {
    /// The formats of single files.
    pub const FILES: &[Self] = &[Self::Nifti, Self::Nrrd, Self::MetaImage, Self::Gipl];

    /// The format that the ending of a path names, in capitals or not; `.gz` counts as nothing.
    pub fn of_path(path: &Path) -> Option<Self> {
        let extension = |path: &Path| path.extension().and_then(OsStr::to_str).map(str::to_ascii_lowercase);
        let inner = match extension(path).as_deref() {
            Some("gz") => path.with_extension(""),
            _ => path.to_owned(),
        };
        match extension(&inner)?.as_str() {
            "nii" | "hdr" | "img" => Some(Self::Nifti),
            "nrrd" | "nhdr" => Some(Self::Nrrd),
            "mha" | "mhd" => Some(Self::MetaImage),
            "gipl" => Some(Self::Gipl),
            "dcm" | "dicom" | "ima" => Some(Self::Dicom),
            _ => None,
        }
    }

    /// The format of the first bytes (unpacked).
    fn of_bytes(head: &[u8]) -> Option<Self> {
        if head.starts_with(b"NRRD") {
            Some(Self::Nrrd)
        } else if nifti::has_magic(head) {
            Some(Self::Nifti)
        } else if head.get(128..132) == Some(b"DICM") {
            Some(Self::Dicom)
        } else if gipl::has_magic(head) {
            Some(Self::Gipl)
        } else if head.starts_with(b"ObjectType") || head.starts_with(b"NDims") {
            Some(Self::MetaImage)
        } else {
            None
        }
    }
}

/// Reads an image file, or the DICOM series of a folder.
pub fn read(path: &Path, options: &ReadOptions) -> Result<Image, ImageError> {
    read_with(path, options, &|_| {})
}

/// Reads an image file, or the DICOM series of a folder. `progress` hears fractions from 0 to 1.
pub fn read_with(path: &Path, options: &ReadOptions, progress: &dyn Fn(f64)) -> Result<Image, ImageError> {
    if path.is_dir() {
        return dicom::read_folder(path, options, progress);
    }
    // A file that cannot be opened is reported first: a missing one is not of an unknown format.
    let mut input = Input::open(path, options.byte_limit, progress)
        .map_err(|source| ImageError::Open { path: path.to_owned(), source })?;
    input.stay_within(options.within.clone());
    let content = |fault: Fault| fault.in_file(path);
    let head = input.peek(352).map_err(content)?;
    match ImageFormat::of_bytes(&head).or(ImageFormat::of_path(path)) {
        Some(ImageFormat::Dicom) => {
            dicom::read_file(&dicom::file_bytes(path)?, false, options).map_err(content)
        }
        Some(format) => read_input(&mut input, format, options).map_err(content),
        None => Err(ImageError::UnknownFormat { path: path.to_owned() }),
    }
}

/// Reads an image from the bytes of a file, compressed with gzip or not. Errors name the file `bytes`. Data
/// in a second file are rejected. A DICOM slice counts as a volume of one slice.
pub fn read_bytes(bytes: &[u8], format: ImageFormat, options: &ReadOptions) -> Result<Image, ImageError> {
    let result = match format {
        ImageFormat::Dicom => dicom::read_file(bytes, true, options),
        _ => read_input(&mut Input::of_bytes(bytes, options.byte_limit), format, options),
    };
    result.map_err(|fault| fault.in_file(Path::new("bytes")))
}

fn read_input(input: &mut Input<'_>, format: ImageFormat, options: &ReadOptions) -> Result<Image, Fault> {
    match format {
        ImageFormat::Nifti => nifti::read(input, options),
        ImageFormat::Nrrd => nrrd::read(input, options),
        ImageFormat::MetaImage => metaimage::read(input, options),
        ImageFormat::Gipl => gipl::read(input, options),
        ImageFormat::Dicom => Err(ImageProblem::NoSlices { files: 1 }.into()),
    }
}

impl Fault {
    pub(crate) fn in_file(self, path: &Path) -> ImageError {
        ImageError::Content { path: path.to_owned(), place: self.place, problem: Box::new(self.problem) }
    }
}

/// Rejects a file that lies outside a folder, with links resolved.
fn check_within(path: &Path, folder: Option<&Path>) -> io::Result<()> {
    match folder {
        Some(folder) if !path.canonicalize()?.starts_with(folder) => {
            let reason = format!("it is outside the folder `{}`, the only readable one", folder.display());
            Err(io::Error::new(io::ErrorKind::PermissionDenied, reason))
        }
        _ => Ok(()),
    }
}

/// Number of voxels of a size, within the limit and above 0.
fn checked_size(
    dims: [u64; 3],
    field: &'static str,
    options: &ReadOptions,
) -> Result<[usize; 3], ImageProblem> {
    if dims.contains(&0) {
        return Err(ImageProblem::bad(field, format!("{dims:?}"), "every size must be at least 1"));
    }
    let voxels = dims.iter().try_fold(1_u64, |product, &n| product.checked_mul(n)).unwrap_or(u64::MAX);
    if voxels > options.voxel_limit || usize::try_from(voxels).is_err() {
        return Err(ImageProblem::TooManyVoxels { voxels, limit: options.voxel_limit });
    }
    Ok(dims.map(|n| n as usize))
}
