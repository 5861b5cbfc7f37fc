//! Medical images: volumes read from files, regions of a label, their cleaning, and their smooth fields.
//! World coordinates are metres, in RAS: x to the patient's right, y to the front, z to the head. Voxel
//! centres lie at whole numbers of the grid. Leaves out: registration, resampling (except to coarser voxels),
//! segmentation.
//!
//! ```no_run
//! use pliant_imaging::{ReadOptions, read};
//!
//! let image = read("seg.nii.gz".as_ref(), &ReadOptions::default())?;
//! for region in image.regions(&|_| {})? {
//!     println!("{region}");
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

// Units stand in brackets; rustdoc takes [m] for a link.

mod border;
mod clean;
mod cut;
mod distance;
mod error;
mod file;
mod image;
mod labels;
mod names;
mod parts;
mod region;
mod vessels;

pub use border::Border;
pub use clean::{Cleaned, Cleaning};
pub use cut::{Choice, Cut};
pub use distance::Smoothing;
pub use error::{ImageError, ImageProblem, LabelError};
pub use file::{ImageFormat, ReadOptions, read, read_bytes, read_with};
pub use image::{Image, LabelImage, Scalar};
pub use labels::RegionReport;
pub use names::{LabelChoice, LabelNames};
pub use parts::Parts;
pub use region::Region;
