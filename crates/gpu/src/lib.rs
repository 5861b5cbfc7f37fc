//! Explicit dynamics of solids and shells, and the linear equations of implicit steps, on any GPU, through
//! wgpu: Vulkan, Metal or Direct3D 12, found at run time. All numbers are in single precision.
//!
//! ```
//! for adapter in pliant_gpu::adapters() {
//!     println!("{} ({}), {} MiB a buffer", adapter.name, adapter.backend, adapter.largest_buffer >> 20);
//! }
//! ```
//!
//! The stepper [`GpuStepper`] advances a state of a model as `CentralDifference` does on the CPU, hundreds of
//! steps at a time:
//!
//! ```
//! use pliant_explicit::{Observable, State, Wanted};
//! use pliant_gpu::{Device, GpuStepper, StepFailure};
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
//!
//! # State
//!
//! The current state is on the device. A checkpoint holds the state in memory. Two functions copy it in the
//! same layout of histories, [`GpuStepper::bring_back`] and [`GpuStepper::upload`]. So a run started on a CPU
//! can continue on a GPU and back.
//!
//! # Kernels
//!
//! Kernels are WGSL, one file each (`shaders/`), joined when a stepper is made. An *element* computes the
//! forces of a cell with the stress of its law (`AnyLaw::shader`). A *design* ([`Design`]) finds
//! displacements and takes forces (`displacement_of`, `give`, `internal_force`), so a new element or law
//! works in every design. Binding group 0 has the instant, group 1 the arrays of the cells (in node passes
//! their forces). Group 2 has the arrays of the design or of the nodes, group 3 the arrays of blocks and
//! loads.
//!
//! # Designs
//!
//! The type [`Design`] lists the designs, and `paths.rs` counts bytes and operations of each. All but
//! `float-atomics` give the same bits every time, however the steps are divided. A force beyond the range of
//! whole numbers is an error and never wraps around.
//!
//! `blocks` adds forces as whole multiples of a small one, in shared memory; a group owns up to 64 nodes.
//! Every block at a border cell computes this cell with the same numbers and its own copy of the history. Any
//! copy can be read back. Displacements and increments have two sides: a kernel reads *now* and writes
//! *next*. So blocks do not wait for each other, and the instant of a failure stays intact on its side. Each
//! solid has a kernel: the last one at a node moves it, earlier ones leave their forces. When an instant is
//! evaluated, the forces are left for the node pass. Averaged pressures have their own kernels before.
//!
//! # Submissions
//!
//! A submission holds up to 128 instants, of 0.2 s at most together. The values of an instant are a uniform
//! with a moving offset. Factors of curves are computed in double precision on the CPU and are rows of a
//! table, one per instant.
//!
//! # Evaluations
//!
//! Every 1 to 100 steps the stepper evaluates an instant: energies, reactions, extremes of J and |C − I|. The
//! interval halves where the deformation changed by more than 2 % since the last evaluation. In between, the
//! device sums work in single precision, group by group; the sums go into the energy balance of the CPU.
//! Every step is evaluated while the energies are off balance. `StepControl` monitors the critical time step
//! as on the CPU, from displacements read back after a change of 10 % or after 1000 steps.
//!
//! # Failures
//!
//! The first cell with J ≤ 0, inverted corner or force that is not a number stops the device at that instant:
//! later kernels do nothing. The state is read back as it was, and one evaluation on the CPU names element,
//! node and time. A lost or full device and a model beyond its limits are errors of their own ([`GpuError`]).
//!
//! # Grips and windows
//!
//! While a grip holds, a kernel finds its force from the displacements, and marked nodes add it to their
//! loads. Only p − Σ wᵢ Xᵢ is computed before, in double precision. For windows,
//! [`GpuStepper::advance_without_read_back`] takes steps for a given time without any read-back. A
//! [`DeviceMapping`] computes points that are combinations of nodes, with a value each, in an array that a
//! renderer binds. The counter [`Device::read_backs`] counts all read-backs.
//!
//! # Contact
//!
//! [`GpuStepper::with_contacts`] lets nodes, and points on faces, touch rigid things, other bodies and
//! themselves as `contact.rs` does on the CPU. A kernel before the node pass predicts the nodes without
//! contact, from the forces of cells. A group solves the rows of points that share nodes, colour by colour
//! and level by level. The node pass takes the forces. The ways of tools in a step are numbers of its row of
//! the table. Contacts that are not available on GPUs are named by [`processor_only`].
//!
//! Candidates for pairs of surfaces are listed in ordinary memory (`pairs.rs`). A kernel before the forces of
//! an instant stops the device there if nodes may leave the skin of the lists. The findings note this instant
//! like a failure, and all later kernels do nothing. The stepper reads the findings after its last
//! submission, goes back to this instant, lists anew and submits the rest again. So
//! [`GpuStepper::advance_without_read_back`] does read back there.
//!
//! # Ties
//!
//! Nodes that follow others have no cells in the pass over the nodes. A kernel before this pass sums the
//! forces on each follower. It writes a part for each followed node into a slot of its own, which that node
//! gathers like the slots of its cells. With atomic additions the kernel adds the part. Another kernel after
//! each motion places the followers, u = Σ w u. `blocks` moves nodes while it finds forces, and refuses ties.
//!
//! # Equations of implicit steps
//!
//! [`Device`] is a `LinearDevice` of `pliant-linear`: it solves block matrices by conjugate gradients
//! (`gradients.rs`). Its solutions are corrections under a residual in double precision on the CPU.
//!
//! # Shells
//!
//! For shells, [`GpuShells`] advances a state as `pliant_implicit::ExplicitShells` does (`shells.rs`). A
//! state is read back after each call; forces, energies and reactions there are found on the CPU.
//!
//! # Tests
//!
//! The tests in `tests/gpu/stepper/` compare with double precision on the CPU. Displacements differ by at
//! most 1e-5 after 200 steps, with every law, element and load on unordered meshes deformed at random.
//! `tests/gpu/shells.rs` holds shells to the same, with their rotations and the work of loads.
//! `tests/gpu/gradients.rs` compares solutions, pulsing tubes, contact, ties and volumes with the CPU. Tests
//! also run devices opened with lower limits (`Device::open_within`) and devices destroyed during a run. The
//! gate runs all of them on Mesa's software Vulkan (`PLIANT_REQUIRE_GPU=1`); elsewhere they report when they
//! are skipped.

mod blocks;
mod contacts;
mod design;
mod device;
mod error;
mod gradients;
mod grips;
mod kernel;
mod loads;
mod mapping;
mod nodes;
mod pairs;
mod paths;
mod rates;
mod run;
mod shells;
mod solid_kernels;
mod solids;
mod stepper;
mod ties;
mod transfer;

pub use contacts::processor_only;
pub use design::{Design, UnknownDesign};
pub use device::{Adapter, Device, Kind, adapters};
pub use error::GpuError;
pub use mapping::{DeviceMapping, DevicePoints, PointValue};
pub use rates::DeviceRates;
pub use run::StepFailure;
pub use shells::{GpuShells, ShellsMoved};
pub use stepper::GpuStepper;
