//! Explicit dynamics of solids on any graphics processor, through wgpu: Vulkan, Metal or Direct3D 12, found at run time.
//!
//! ```
//! for adapter in pliant_gpu::adapters() {
//!     println!("{} ({}), {} MiB a buffer", adapter.name, adapter.backend, adapter.largest_buffer >> 20);
//! }
//! ```

mod device;
mod error;

pub use device::{Adapter, Device, Kind, adapters};
pub use error::GpuError;
