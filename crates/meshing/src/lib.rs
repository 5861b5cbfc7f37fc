//! Volume meshes made from shapes and images: structured blocks and tubes, bodies of fields filled with tetrahedra
//! (isosurface stuffing) or cubes, and organs of label images in tetrahedra made for the time step. Lengths are in
//! metres. The same request gives the same mesh, bit for bit, on any number of threads.
//! Leaves out: surfaces as input, hexahedra of images.
//!
//! ```
//! use pliant_imaging::{Cleaning, Grid, LabelImage, Smoothing};
//! use pliant_meshing::{Anatomy, OrganTets};
//!
//! // A ball of label 5 in voxels of 2 mm, as an image would give it.
//! let grid = Grid::along_axes([40; 3], [0.0; 3].into(), [2e-3; 3])?;
//! let inside = |at| grid.triple(at).iter().map(|&i| (i as f64 - 19.5).powi(2)).sum::<f64>() < 225.0;
//! let image = LabelImage { labels: (0..grid.len()).map(|at| if inside(at) { 5 } else { 0 }).collect(), grid };
//!
//! let cleaning = Cleaning { keep_largest: true, ..Cleaning::default() };
//! let (body, cleaned) = Anatomy::from_image(&image, &[5], &cleaning, &Smoothing::default(), &|_| {})?;
//! let made = OrganTets::new(0.010).mesh(&body, &|_| {})?;
//! println!("{}", made.report);
//! assert_eq!(cleaned.pieces_removed, 0);
//! assert!(made.report.acoustic_part >= 0.75);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! ```
//! use pliant_meshing::{Block, DEFAULT_CELL_LIMIT, Organ, Phantom, Resolution, Stuffing, VolumeCell};
//!
//! // A liver of about 0.8 l in tetrahedra with edges of 10 mm.
//! let liver = Phantom::new(Organ::Liver, 1.0)?;
//! let filled = Stuffing::new(0.010).mesh(&liver)?;
//! assert!(filled.mesh.blocks[0].len() > 8000);
//! assert_eq!(filled.non_manifold_edges, 0);
//!
//! // A bar of 40 × 10 × 10 mm in hexahedra, to be held at one end by its point set.
//! let bar = Block::new([0.04, 0.01, 0.01]);
//! let mesh = bar.mesh(Resolution::Edge(0.005), VolumeCell::Hex, DEFAULT_CELL_LIMIT)?;
//! assert_eq!(mesh.blocks[0].len(), 8 * 2 * 2);
//! assert_eq!(mesh.point_sets["x-min"].len(), 9);
//! # Ok::<(), pliant_meshing::MeshingError>(())
//! ```

// Units stand in brackets; rustdoc takes [m] for a link.

mod anatomy;
mod complex;
mod cut;
mod error;
mod extent;
mod field;
mod lattice;
mod manifold;
mod optimise;
mod phantom;
mod stencil;
mod structured;
mod stuffing;
mod surfaces;
mod tets;
mod topology;
mod voxels;

use pliant_geometry::Mesh;

pub use anatomy::Anatomy;
pub use error::MeshingError;
pub use field::{Ellipsoid, ImplicitField};
pub use phantom::{Organ, Phantom, brain_label};
pub use structured::{Block, Resolution, Tube, VolumeCell};
pub use stuffing::Stuffing;
pub use tets::{MaterialReport, OrganMesh, OrganTets, Repairs, Steps, TetReport};
pub use voxels::Voxels;

/// Cells allowed in a mesh unless the caller says otherwise. Limits above 2²⁵ (34 million) act as 2²⁵.
pub const DEFAULT_CELL_LIMIT: usize = 5_000_000;

/// The body of a field as a mesh, and what was left out of it.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldMesh {
    /// One block of cells, the largest face-connected component.
    pub mesh: Mesh,
    /// Smaller components that were dropped.
    pub dropped_components: usize,
    /// Cells in them.
    pub dropped_cells: usize,
    /// Edges of the boundary that more than two boundary faces share: there the body touches itself, where a
    /// gap is thinner than the cells.
    pub non_manifold_edges: usize,
}
