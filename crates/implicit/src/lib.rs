//! Static and implicit solvers of thin structures and solids: co-rotational triangular shells with membrane, bending and twist in large
//! rotation, and solids of any elastic law, which may share nodes with them. Knows nothing of files or windows. SI units throughout.
//!
//! A shell element is the discrete Kirchhoff triangle (Batoz, Bathe, Ho 1980) with the ANDES membrane (Felippa 2003), which takes the
//! mean strain of the curved triangle, six degrees of freedom a node, in a frame that turns with the facet; its force is the gradient of its energy. [`Model`] is constant, [`State`]
//! changes; [`Statics`] finds equilibria, [`BackwardEuler`] and [`Explicit`] move a state in time; [`CurvedSurface`] is the smooth
//! surface of the shells for pictures and for forces on any of its points.
//!
//! ```
//! use nalgebra::Vector3;
//! use pliant_implicit::element::Elasticity;
//! use pliant_implicit::{
//!     Constraint, Load, LoadKind, Material, Model, Motion, Shell, State, StaticSettings, Statics,
//! };
//! use pliant_mechanics::curve::{Curve, Shape};
//!
//! // A strip of 1 m × 0.1 m × 10 mm in ten squares, clamped at x = 0, lifted at its other end.
//! let points = (0..22).map(|i| Vector3::new(f64::from(i / 2) * 0.1, f64::from(i % 2) * 0.1, 0.0)).collect();
//! let cells = (0..10).flat_map(|i| [[2 * i, 2 * i + 2, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 1]]).collect();
//! let material = Material { elastic: Elasticity { young: 1e6, poisson: 0.3 }, density: 1000.0 };
//! let mut model = Model::new(points);
//! model.add_shell(&Shell::new("strip", cells, 0.01, material))?;
//! let clamp = Constraint { name: "clamp".into(), nodes: vec![0, 1], components: [true; 6], motion: Motion::Fixed };
//! model.constraints.push(clamp);
//! let kind = LoadKind::Force { nodes: vec![20, 21], force: Vector3::new(0.0, 0.0, 0.02) };
//! let curve = Curve { shape: Shape::Ramp, from: 0.0, to: 1.0 };
//! model.loads.push(Load { name: "lift".into(), kind, curve, controlled: false });
//!
//! let mut state = State::at_rest(&model);
//! let step = Statics::new(model.clone(), StaticSettings::default())?.solve(&mut state, 1.0)?;
//! assert!(step.residuals.len() < 20 && step.negative_pivots == 0);
//! assert!(state.displacement(&model, 21).z > 0.5);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod carry;
mod control;
mod creases;
mod dynamics;
pub mod element;
mod error;
mod facet;
mod forces;
mod initial;
mod linear;
mod model;
mod patch;
mod picture;
mod pressure;
mod recover;
mod resolution;
mod rotation;
mod solid;
mod sparse;
mod state;
mod statics;
mod strain;
mod surface;
mod system;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;

pub use creases::Normal;
pub use dynamics::{BackwardEuler, DynamicSettings, DynamicStep, Explicit, Integrator};
pub use element::Material;
pub use error::{ModelError, SolveError};
pub use facet::{Broken, Facet, Resultants, ShellEnergy, Tangent};
pub use forces::Forces;
pub use linear::{LinearReport, LinearSolver, Preconditioner};
pub use model::{Constraint, Load, LoadKind, Model, Motion, Notes, Shell, Spread, Spring};
pub use patch::{Carried, EdgeRule, Patch, Place};
pub use picture::{Picture, PictureFields};
pub use recover::{ShellFields, von_mises};
pub use resolution::Resolution;
pub use state::State;
pub use statics::{Attempted, Control, StaticSettings, Statics, Step, check_held};
pub use strain::ShellStrain;
pub use surface::CurvedSurface;
pub use system::Phases;
