//! Bodies to be meshed: fields, images, closed surfaces.

pub(crate) mod anatomy;
pub(crate) mod enclosed;
pub(crate) mod extent;
pub(crate) mod field;
pub(crate) mod given;
#[cfg(feature = "imaging")]
pub(crate) mod of_image;
pub(crate) mod surfaces;
