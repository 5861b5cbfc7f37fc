//! Errors of pictures and films.

use std::path::PathBuf;

/// A picture or a film that could not be made.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// No adapter can draw.
    #[error("no GPU and no software driver was found")]
    NoAdapter,
    /// The adapter does not open.
    #[error("the GPU `{adapter}` cannot be opened: {reason}")]
    Refused {
        /// Its name.
        adapter: String,
        /// Error of the driver.
        reason: String,
    },
    /// A picture of this size is more than the adapter draws.
    #[error(
        "`{adapter}` cannot draw a picture of {width} × {height} pixels: the limits are 1 to {largest} in each direction"
    )]
    Size {
        /// Its name.
        adapter: String,
        /// Requested Width.
        width: u32,
        /// Requested Height.
        height: u32,
        /// Most pixels each way.
        largest: u32,
    },
    /// The device failed while it drew.
    #[error("the GPU `{adapter}` failed: {reason}")]
    Device {
        /// Its name.
        adapter: String,
        /// Error of the driver.
        reason: String,
    },
    /// Pixels that are not a PNG file, or cannot become one.
    #[error("the picture cannot be encoded: {0}")]
    Coding(String),
    /// A file that can't be written.
    #[error("`{path}` cannot be written: {reason}")]
    Write {
        /// Its path.
        path: PathBuf,
        /// Error of the system.
        reason: String,
    },
    /// ffmpeg ended with an error.
    #[error("ffmpeg could not make `{path}`: {reason}")]
    Ffmpeg {
        /// The film.
        path: PathBuf,
        /// The last line of its output.
        reason: String,
    },
}

impl PictureError {
    /// The remedy.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::NoAdapter => {
                "install the driver of your graphics card, or Mesa's software Vulkan (Debian, Ubuntu: `apt-get install \
                 mesa-vulkan-drivers libvulkan1`; Fedora: `dnf install mesa-vulkan-drivers vulkan-loader`)"
            }
            Self::Refused { .. } | Self::Device { .. } => {
                "update its driver, or select Mesa's software Vulkan with the variable VK_DRIVER_FILES"
            }
            Self::Size { .. } => "choose another size",
            Self::Coding(_) => "check that the file is a PNG picture with red, green, blue and alpha",
            Self::Write { .. } => "check the folder, its permissions and the free space",
            Self::Ffmpeg { .. } => "try a film whose name ends in .png, an animated PNG that needs no ffmpeg",
        }
    }
}
