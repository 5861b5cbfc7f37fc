//! What can go wrong with a picture.

use std::path::PathBuf;

/// A picture or a film that could not be made.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// Nothing on this machine draws.
    #[error("no graphics processor was found, nor a software driver that stands in for one")]
    NoAdapter,
    /// The adapter does not open.
    #[error("the graphics processor `{adapter}` cannot be opened: {reason}")]
    Refused {
        /// Its name.
        adapter: String,
        /// What the driver says.
        reason: String,
    },
    /// A picture of this size is more than the adapter draws.
    #[error(
        "a picture of {width} × {height} pixels cannot be drawn by `{adapter}`: it takes 1 to {largest} each way"
    )]
    Size {
        /// Its name.
        adapter: String,
        /// Width asked for.
        width: u32,
        /// Height asked for.
        height: u32,
        /// Most pixels each way.
        largest: u32,
    },
    /// The device failed while it drew.
    #[error("the graphics processor `{adapter}` failed: {reason}")]
    Device {
        /// Its name.
        adapter: String,
        /// What the driver says.
        reason: String,
    },
    /// Pixels that are no PNG file, or cannot become one.
    #[error("the picture cannot be coded: {0}")]
    Coding(String),
    /// A file that can't be written.
    #[error("`{path}` cannot be written: {reason}")]
    Write {
        /// Its path.
        path: PathBuf,
        /// What the system says.
        reason: String,
    },
    /// ffmpeg ended with an error.
    #[error("ffmpeg could not make `{path}`: {reason}")]
    Ffmpeg {
        /// The film.
        path: PathBuf,
        /// The last of what it said.
        reason: String,
    },
}

impl PictureError {
    /// What to try.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::NoAdapter => {
                "install the driver of your graphics card, or Mesa's software Vulkan (Debian, Ubuntu: `apt-get install \
                 mesa-vulkan-drivers libvulkan1`; Fedora: `dnf install mesa-vulkan-drivers vulkan-loader`)"
            }
            Self::Refused { .. } | Self::Device { .. } => {
                "renew its driver, or take Mesa's software Vulkan by the variable VK_DRIVER_FILES"
            }
            Self::Size { .. } => "choose another size",
            Self::Coding(_) => "check that the file is a PNG picture of red, green, blue and coverage",
            Self::Write { .. } => "check the folder, its permissions and the free space",
            Self::Ffmpeg { .. } => "try a film whose name ends in .png, an animated PNG that needs no ffmpeg",
        }
    }
}
