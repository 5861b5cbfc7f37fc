//! Forces for haptic devices at 1 kHz, next to a simulation that takes 2 to 33 ms for a step. The simulation
//! publishes a [local model](model) of the contact: planes, a compliance, and the contact force. A separate
//! thread moves a [proxy] over these planes, which a [virtual coupling](coupling) ties to the device. A
//! [guard] watches the energy that the device gets back. Devices connect over [datagrams](protocol) on the
//! loopback interface. The crate knows no solver and no scene. SI units throughout.
//!
//! A device pressed 4 mm into a wall of 500 N/m through a coupling of 1000 N/m:
//!
//! ```
//! use nalgebra::{Isometry3, Matrix3, Vector3};
//! use pliant_haptics::model::{LocalModel, Plane};
//! use pliant_haptics::renderer::{Renderer, Settings};
//!
//! let wall = Plane { normal: Vector3::z(), gap: 0.0, friction: 0.3 };
//! let compliance = Matrix3::identity() / 500.0;
//! let model = LocalModel::new(Vector3::zeros(), Vector3::zeros(), compliance, &[wall], 0.002)?;
//! let mut renderer = Renderer::new(Settings::default())?;
//! renderer.take(model);
//! let mut force = Vector3::zeros();
//! for tick in 0..1000 {
//!     let depth = 0.004 * (f64::from(tick) / 500.0).min(1.0);
//!     force = renderer.tick(&Isometry3::translation(0.0, 0.0, -depth)).force;
//! }
//! // Springs in series: 1000 · 500 / 1500 N/m.
//! assert!((force.z - 0.004 * 1000.0 / 3.0).abs() < 1e-6);
//! # Ok::<(), pliant_haptics::error::HapticsError>(())
//! ```

pub mod coupling;
pub mod device;
pub mod error;
pub mod estimate;
pub mod guard;
pub mod hand;
pub mod link;
pub mod model;
pub mod protocol;
pub mod proxy;
pub mod renderer;
pub mod replay;
pub mod statistics;
pub mod thread;
pub mod trace;
