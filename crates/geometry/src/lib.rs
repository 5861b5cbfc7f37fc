//! Meshes and their geometry. Knows nothing of physics.
//!
//! A block of two tets, from diagnosis to interpolation weights:
//!
//! ```
//! use pliant_geometry::{
//!     CellKind, Locator, Mesh, QualityReport, Selection, Vector3, boundary, diagnose, reorder,
//! };
//!
//! let points = [[0., 0., 0.], [0.1, 0., 0.], [0., 0.1, 0.], [0., 0., 0.1], [0.1, 0.1, 0.1]];
//! let mut mesh = Mesh { points: points.map(Vector3::from).to_vec(), ..Mesh::default() };
//! mesh.block_mut(CellKind::Tet).nodes.extend([0, 1, 2, 3, 1, 3, 2, 4]);
//!
//! // Is something wrong with it? The second tet is inverted: repair it.
//! assert_eq!(diagnose(&mesh).to_string(), "inverted cells: 1 (tet 1)");
//! assert_eq!(reorder(&mut mesh), 1);
//! assert!(diagnose(&mesh).is_clean());
//!
//! // How good is it? The acoustic length sets the time step.
//! let quality = QualityReport::new(&mesh);
//! assert!((quality.volume - 0.5e-3).abs() < 1e-12);
//! assert!(quality.acoustic_length.unwrap().min > 0.03);
//!
//! // Which nodes lie on the plane z = 0?
//! let surface = boundary(&mesh);
//! let floor = Selection::Plane { point: [0.0; 3], normal: [0.0, 0.0, 1.0], tolerance: None };
//! assert_eq!(floor.nodes(&mesh, &surface)?, [0, 1, 2]);
//!
//! // Where is a point, and with which weights do nodes make it up?
//! let place = Locator::new(&mesh).locate(Vector3::new(0.02, 0.02, 0.02)).unwrap();
//! assert_eq!((place.kind, place.cell, place.distance), (CellKind::Tet, 0, 0.0));
//! assert!((place.weights[1] - 0.2).abs() < 1e-12);
//! # Ok::<(), pliant_geometry::SelectionError>(())
//! ```

mod bezier;
mod cell;
mod closest;
mod diagnosis;
mod disjoint_sets;
mod distance_field;
mod grid;
pub mod io;
mod labels;
mod locate;
mod mesh;
mod mortar;
mod patch;
mod quality;
mod regions;
mod selection;
mod split;
mod surface;
#[cfg(test)]
mod testing;
pub mod words;

pub use bezier::{ControlWeights, CurvedTriangle, EDGES, EdgeRule};
pub use cell::{CellId, body_blocks};
pub use closest::{SurfaceLocator, SurfacePoint};
pub use diagnosis::{CrowdedFace, Diagnosis, diagnose, reorder};
pub use disjoint_sets::DisjointSets;
pub use distance_field::DistanceField;
pub use grid::{FlatGrid, Grid};
pub use labels::{CellLabel, Labels, UnknownLabel};
pub use locate::{Location, Locator, barycentric_of_closest};
pub use mesh::{CellBlock, CellKind, DataArray, Mesh};
pub use mortar::{MortarRow, MortarRows, MortarSide, mortar_rows};
pub use patch::patch;
pub use quality::{
    QualityReport, Spread, acoustic_length, gradient_integrals, relative_acoustic_length, scaled_jacobian,
    vector_area, volume,
};
pub use regions::{Region, RegionNames, cell_body};
pub use selection::{Selection, SelectionError};
pub use split::{SplitCells, SplitKind, add_as_tets, faces_met_by_two_tets};
pub use surface::{Face, Surface, borders, boundary, cell_label, labels};

/// A point or a vector in space.
pub type Vector3 = nalgebra::Vector3<f64>;
