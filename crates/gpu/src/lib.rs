//! Explicit dynamics of solids on any graphics processor, through wgpu: Vulkan, Metal or Direct3D 12, found at run time.
//!
//! ```
//! for adapter in pliant_gpu::adapters() {
//!     println!("{} ({}), {} MiB a buffer", adapter.name, adapter.backend, adapter.largest_buffer >> 20);
//! }
//! ```
//!
//! [`GpuStepper`] advances a state of a model as `CentralDifference` does on the processor, hundreds of steps at a time:
//!
//! ```
//! use pliant_gpu::{Device, GpuStepper, StepFailure, Wanted};
//! use pliant_explicit::{Observable, State};
//! use pliant_mechanics::Model;
//!
//! fn fall(device: &Device, model: &Model, step: f64) -> Result<State<f32>, StepFailure> {
//!     let mut state = State::at_rest(model);
//!     let mut stepper = GpuStepper::new(device, model.clone(), step, None)?;
//!     stepper.advance(&mut state, 1000)?;
//!     stepper.evaluate(&mut state, Wanted::Everything)?;
//!     println!("{} J", stepper.energies().kinetic);
//!     Ok(state)
//! }
//! ```

mod blocks;
mod design;
mod device;
mod error;
mod grips;
mod kernel;
mod loads;
mod mapping;
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
pub use mapping::{DeviceMapping, DevicePoints, PointValue};
pub use rates::DeviceRates;
pub use run::StepFailure;
pub use stepper::{GpuStepper, Wanted};
