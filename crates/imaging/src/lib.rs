//! Medical images: volumes read from files, regions of a label, their cleaning, and smooth fields of them. World
//! coordinates are metres, in RAS: x to the patient's right, y to the front, z to the head. Voxel centres lie at
//! whole numbers of the grid.
//! Leaves out: registration, resampling, segmentation.
//!
//! ```no_run
//! use pliant_imaging::{ReadOptions, read};
//!
//! let image = read("seg.nii.gz".as_ref(), &ReadOptions::default())?;
//! for region in image.labels()?.regions() {
//!     println!("{region}");
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

// Units stand in brackets; rustdoc takes [m] for a link.

mod clean;
mod distance;
mod error;
mod file;
mod grid;
mod image;
mod labels;

pub use clean::{Cleaned, Cleaning, Region};
pub use distance::{DistanceField, Smoothing};
pub use error::{ImageError, ImageProblem, LabelError};
pub use file::{ImageFormat, ReadOptions, read, read_bytes};
pub use grid::Grid;
pub use image::{Image, LabelImage, Scalar};
pub use labels::RegionReport;
