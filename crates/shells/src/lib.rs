//! Elements of thin walls: triangles in large rotation and the curved surface over them. Knows no solver and
//! no model. SI units throughout.
//!
//! A shell element is the discrete Kirchhoff triangle (Batoz, Bathe, Ho 1980) with the ANDES membrane
//! (Felippa 2003). The membrane takes the mean strain of the curved triangle. The element has six degrees of
//! freedom a node, in a frame that turns with the [`Facet`]. Its force is the gradient of its energy. A
//! [`Patch`] is the smooth surface over a facet, for contact, pressure and pictures.
//!
//! ```
//! use nalgebra::Vector3;
//! use pliant_shells::element::{Elasticity, Formulation, Wall};
//! use pliant_shells::Facet;
//!
//! let wall = Wall { elastic: Elasticity { young: 1e6, poisson: 0.3 }, density: 1000.0 };
//! let corners = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]].map(Vector3::from);
//! let facet = Facet::new([0, 1, 2], corners, 1e-3, wall, Formulation::default()).ok_or("no area")?;
//! assert!((facet.area - 0.005).abs() < 1e-15 && (3.0 * facet.mass - 0.005).abs() < 1e-12);
//! # Ok::<(), &str>(())
//! ```

mod control;
mod creases;
pub mod element;
mod facet;
pub mod facet_packs;
mod patch;
mod pressure;
pub mod rotation;
mod strain;
#[cfg(test)]
mod testing;

pub use creases::{Normal, sides, straight_edges};
pub use facet::{Broken, Facet, FacetAtRest, Matrix18, Placed, Resultants, ShellEnergy, symmetrise};
pub use patch::{Carried, EdgeRule, Patch, Place, Vector18};
pub use strain::ShellStrain;
