//! A simulation of many bodies. A [`Setup`] holds participants: bodies that one stepper advances together.
//! Steps are explicit, quasi-static, static or implicit. They run on the CPU or (feature `gpu`, on by
//! default) a GPU. A [`Simulation`] owns a setup and its state, and knows nothing of files or windows. SI
//! units throughout.
//!
//! Two participants, each at its own step:
//!
//! ```
//! use pliant_shells::element::Elasticity;
//! use pliant_implicit::{Assembly, Shell};
//! use pliant_shells::element::Wall;
//! use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
//! use pliant_mechanics::load::Load;
//! use pliant_mechanics::model::{Cells, Material, Model, Solid};
//! use pliant_sim::{ParticipantSetup, Simulation, Setup};
//!
//! let corners = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]];
//! let mut tissue = Model::default();
//! let tet = tissue.add_body("tissue", &corners);
//! let law = AnyLaw::NeoHookean(NeoHookean { shear: 1000.0, volumetric: Volumetric::quadratic(10_000.0) });
//! let cells = Cells::tet4(vec![[0, 1, 2, 3]], &tissue.rest);
//! tissue.add_solid(Solid::new(tet, Material::elastic(law, 1000.0), cells));
//! tissue.loads.push(Load::gravity(tet, [0.0, 0.0, -9.81]));
//!
//! let mut wall = Assembly::new("wall", corners[..3].iter().map(|&corner| corner.into()));
//! let material = Wall { elastic: Elasticity { young: 1e6, poisson: 0.3 }, density: 1000.0 };
//! wall.add_shell(&Shell::new("wall", vec![[0, 1, 2]], 0.001, material))?;
//! wall.model_mut().loads.push(Load::gravity(0, [0.0, 0.0, -9.81]));
//!
//! let tissue = ParticipantSetup::explicit("tissue", tissue, 0.1)?;
//! let wall = ParticipantSetup::implicit("wall", wall, 0.1, 0.01);
//! let mut simulation = Simulation::new(Setup::new(vec![tissue, wall]))?;
//! simulation.run(0.1, |_| ())?;
//! let frame = simulation.frame()?;
//! for body in ["tissue", "wall"] {
//!     let down = frame.displacements(body).unwrap()[0][2];
//!     // ½ g t²; backward Euler falls by ½ g t² (1 + h/t).
//!     assert!((-down / 0.049_05 - 1.0).abs() < 0.11, "{body}: {down} m");
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod assembled;
mod bodies;
mod coupled_surfaces;
#[cfg(feature = "gpu")]
mod device;
mod failure;
mod instant;
mod participant;
mod participant_setup;
mod path;
mod penalty;
mod reals;
mod schedule;
mod simulation;
mod snapshot;
mod solids;
mod solver;
mod start;
mod steps;
mod tools;

pub use bodies::{BodyCells, ImplicitBodies, RunControl, Stop};
pub use coupled_surfaces::{CoupledSurface, CoupledSurfaceNow};
#[cfg(feature = "gpu")]
pub use device::{MappedPoint, OnDevice};
pub use failure::{BlockedDriver, FailedLoadStep, Failure, FailureKind, panicked};
pub use instant::{CellsNow, Effort, Instant};
pub use participant_setup::{Explicit, LongSteps, Method, ParticipantSetup, Precision, ShortSteps};
pub use penalty::{PenaltyTie, TieNow};
pub use reals::Reals;
pub use schedule::Schedule;
pub use simulation::{Frame, Observer, Setup, Simulation, SimulationState};
pub use solver::{Equilibria, LoadStepProgress};
pub use steps::{Critical, SAFETY, Steps};
pub use tools::{ToolNow, pose_of};

/// Ends long work early.
pub use pliant_mechanics::StopFlag;

/// Obstacles, tools, and bodies that touch them.
pub use pliant_contact as contact;
/// Devices, and points on them.
#[cfg(feature = "gpu")]
pub use pliant_gpu as gpu;
