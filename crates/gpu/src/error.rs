//! Errors of a device, with remedies.

use pliant_mechanics::model::Contradiction;

/// Reason why a device can't be used, or not any longer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GpuError {
    /// No adapter was found.
    #[error("no GPU was found: no driver for Vulkan, Metal or Direct3D 12 answers")]
    NoAdapter,
    /// No adapter has this name.
    #[error("there is no adapter `{asked}`; found: {}", found.join(", "))]
    UnknownAdapter {
        /// The requested name.
        asked: String,
        /// The names of those found.
        found: Vec<String>,
    },
    /// The driver refused to open the adapter.
    #[error("`{adapter}` can't be opened: {reason}")]
    Refused {
        /// The adapter.
        adapter: String,
        /// Message of the driver.
        reason: String,
    },
    /// The device is gone: unplugged, reset, or stopped by a watchdog.
    #[error("`{adapter}` was lost: {reason}")]
    Lost {
        /// The adapter.
        adapter: String,
        /// Message of the driver.
        reason: String,
    },
    /// The device's memory is full.
    #[error("`{adapter}` is out of memory; the model takes at least {needed} MiB there")]
    OutOfMemory {
        /// The adapter.
        adapter: String,
        /// Size of the arrays of the model, as far as they were made [MiB].
        needed: u64,
    },
    /// An array is larger than the adapter allows.
    #[error(
        "{what} of the model take {needed} bytes, more than the {limit} bytes `{adapter}` allows in one buffer"
    )]
    TooLarge {
        /// The adapter.
        adapter: String,
        /// Contents of the array.
        what: &'static str,
        /// Size of the array [B].
        needed: u64,
        /// The most that is allowed [B].
        limit: u64,
    },
    /// The adapter lacks something.
    #[error("`{adapter}` lacks {what}")]
    Lacks {
        /// The adapter.
        adapter: String,
        /// Missing feature.
        what: String,
    },
    /// The nodes around one node do not fit into the memory that a group of invocations shares.
    #[error(
        "the {neighbours} nodes of the elements at node {node} take {needed} bytes of shared memory, more than the {limit} bytes of `{adapter}`"
    )]
    Crowded {
        /// The adapter.
        adapter: String,
        /// The node.
        node: u32,
        /// Nodes of the elements there.
        neighbours: usize,
        /// Size of these nodes [B].
        needed: u64,
        /// The most that is allowed [B].
        limit: u64,
    },
    /// Something that runs on the CPU only.
    #[error("{what} can't run on a GPU")]
    Unsupported {
        /// Name of the feature.
        what: String,
    },
    /// A design without contact.
    #[error("the design `{design}` has no contact")]
    NoContact {
        /// The design.
        design: String,
    },
    /// A design without ties.
    #[error("the design `{design}` has no ties")]
    NoTies {
        /// The design.
        design: String,
    },
    /// A force is too large for a design that adds forces up as whole numbers.
    #[error("a force at t = {time:.6} s is out of the range of the design `{design}`")]
    Overflow {
        /// The design.
        design: String,
        /// Time [s].
        time: f64,
    },
    /// Constraints contradict each other.
    #[error(transparent)]
    Contradiction(#[from] Contradiction),
    /// The driver reports an error of the program.
    #[error("`{adapter}` reports an error: {reason}")]
    Internal {
        /// The adapter.
        adapter: String,
        /// Message of the driver.
        reason: String,
    },
}

impl GpuError {
    /// True if another model could run on the device.
    pub fn is_about_the_model(&self) -> bool {
        matches!(
            self,
            Self::TooLarge { .. }
                | Self::OutOfMemory { .. }
                | Self::Crowded { .. }
                | Self::Unsupported { .. }
                | Self::NoContact { .. }
                | Self::NoTies { .. }
        )
    }

    /// Returns advice on what to try.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::NoAdapter => {
                "install a driver (Debian and Ubuntu: `mesa-vulkan-drivers libvulkan1`, or that of the vendor; Fedora: \
                 `mesa-vulkan-drivers vulkan-loader`), see what is found with `pliant devices`, or take `device = \"cpu\"`"
            }
            Self::UnknownAdapter { .. } => {
                "`pliant devices` lists what is there; a part of the name is enough"
            }
            Self::Refused { .. } => "update the driver, or take another adapter of `pliant devices`",
            Self::Lost { .. } => {
                "run again, from the last checkpoint if there is one (`--resume`); if it comes back, update the driver \
                 or take `device = \"cpu\"`"
            }
            Self::OutOfMemory { .. } | Self::TooLarge { .. } => {
                "take a coarser mesh, an adapter with more memory (`pliant devices`) or `device = \"cpu\"`"
            }
            Self::Lacks { .. } => {
                "update the driver, or take another design, another adapter of `pliant devices` or `device = \"cpu\"`"
            }
            Self::Crowded { .. } => "take the design `gather`, which shares no memory",
            Self::Unsupported { .. } => "take `device = \"cpu\"`",
            Self::NoContact { .. } | Self::NoTies { .. } => {
                "take the design `gather` or `fast`, or leave `design` out"
            }
            Self::Overflow { .. } => "take the design `gather`, whose forces are floating-point numbers",
            Self::Contradiction(_) => "leave the node out of one of the two, or give both the same motion",
            Self::Internal { .. } => {
                "take `device = \"cpu\"`, and report this: it is an error in Pliant or in the driver"
            }
        }
    }
}
