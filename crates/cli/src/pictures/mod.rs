//! `pliant render` and `pliant view`, and the picture of `pliant run --picture`.

mod gallery;
mod render;

pub use self::gallery::render;
pub use self::render::{FinalPicture, look_of_world};
pub use crate::view::view;
