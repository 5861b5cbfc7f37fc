//! Static and implicit solvers of thin structures and solids. Shells are co-rotational triangles with
//! membrane, bending and twist in large rotation. Solids follow any elastic law and may share nodes with
//! shells. The crate knows nothing of files or windows. SI units throughout.
//!
//! A shell element is the discrete Kirchhoff triangle (Batoz, Bathe, Ho 1980) with the ANDES membrane
//! (Felippa 2003). The membrane takes the mean strain of the curved triangle. The element has six degrees of
//! freedom a node, in a frame that turns with the facet. Its force is the gradient of its energy. An
//! [`Assembly`] is constant: a model with shells. A [`AssemblyState`] changes. [`Statics`] finds equilibria;
//! [`BackwardEuler`] and [`ExplicitShells`] move a state in time. [`CurvedSurface`] is the smooth surface of
//! the shells for pictures and for forces on any of its points.
//!
//! ```
//! use nalgebra::Vector3;
//! use pliant_implicit::{Assembly, Shell, AssemblyState, StaticSettings, Statics};
//! use pliant_mechanics::curve::{Curve, Shape};
//! use pliant_mechanics::load::{Load, LoadKind};
//! use pliant_shells::element::{Elasticity, Wall};
//!
//! // A strip of 1 m × 0.1 m × 10 mm in ten squares, clamped at x = 0, lifted at its other end.
//! let points = (0..22).map(|i| Vector3::new(f64::from(i / 2) * 0.1, f64::from(i % 2) * 0.1, 0.0));
//! let square = |i: u32| [[2 * i, 2 * i + 2, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 1]];
//! let cells = (0..10).flat_map(square).collect();
//! let material = Wall { elastic: Elasticity { young: 1e6, poisson: 0.3 }, density: 1000.0 };
//! let mut model = Assembly::new("strip", points);
//! model.add_shell(&Shell::new("strip", cells, 0.01, material))?;
//! model.model_mut().fix("clamp", vec![0, 1]);
//! let kind = LoadKind::force([20, 21], [0.0, 0.0, 0.02]);
//! let curve = Curve { shape: Shape::Ramp, from: 0.0, to: 1.0 };
//! model.model_mut().loads.push(Load::new("lift", kind, curve));
//!
//! let mut state = AssemblyState::at_rest(&model);
//! let step = Statics::new(model.clone(), StaticSettings::default())?.solve(&mut state, 1.0)?;
//! assert!(step.residuals.len() < 20 && step.negative_pivots == 0);
//! assert!(state.displacement(&model, 21).z > 0.5);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod curved;
mod model;
mod solid;
mod steps;
mod system;
#[cfg(test)]
mod tests;

pub use curved::mapping::CarriedPoints;
pub use curved::picture::{Picture, PictureFields};
pub use curved::recover::{ShellFields, von_mises};
pub use curved::surface::CurvedSurface;
pub use model::assembly::{Assembly, Notes, Shell, Spring};
pub use model::contact::ContactModel;
pub use model::error::{ModelError, SolveError};
pub use model::resolution::Resolution;
pub use model::state::AssemblyState;
pub use model::turns::CarriedTurn;
pub use solid::relaxation::History;
pub use steps::backward_euler::{BackwardEuler, DynamicSettings, DynamicStep, Integrator};
pub use steps::explicit_shells::ExplicitShells;
pub use steps::forces::Forces;
pub use steps::solver::{AssemblySolver, Attempted};
pub use steps::statics::{Control, StaticSettings, Statics, Step, check_held};
pub use system::contact::{ContactNow, ContactSystem, apart_counts, meetings};
pub use system::{Phases, System, bytes_of_factors};
