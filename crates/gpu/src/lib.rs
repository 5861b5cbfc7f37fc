//! Explicit dynamics of solids on any graphics processor, through wgpu: Vulkan, Metal or Direct3D 12, found at run time.
//!
//! ```
//! for adapter in pliant_gpu::adapters() {
//!     println!("{} ({}), {} MiB a buffer", adapter.name, adapter.backend, adapter.largest_buffer >> 20);
//! }
//! ```

mod blocks;
mod design;
mod device;
mod error;
mod kernel;
mod loads;
mod nodes;
mod paths;
mod rates;
mod run;
mod solids;
mod stepper;
mod transfer;

pub use design::{Design, UnknownDesign};
pub use device::{Adapter, Device, Kind, adapters};
pub use error::GpuError;
pub use rates::DeviceRates;
pub use run::StepFailure;
pub use stepper::{GpuStepper, Wanted};
