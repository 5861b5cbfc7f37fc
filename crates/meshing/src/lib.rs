//! Volume meshes made from shapes: structured blocks and tubes, and bodies of fields, image regions or closed surfaces filled with tetrahedra
//! (isosurface stuffing) or cubes. Lengths are in metres. The same request gives the same mesh, bit for bit,
//! on any number of threads.
//! Surfaces of fields and files in even or few triangles, and curved shells fitted to them.
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
mod assessment;
mod boxes;
mod complex;
mod crossings;
mod curvature;
mod cut;
mod decimate;
mod deviation;
mod edges;
mod enclosed;
mod error;
mod extent;
mod field;
mod flip;
mod given;
mod grading;
mod guard;
mod hausdorff;
mod isosurface;
mod lattice;
mod lens;
mod long_edges;
mod lost;
mod manifold;
mod missed;
mod near_materials;
mod nesting;
mod octree;
#[cfg(feature = "imaging")]
mod of_image;
mod optimise;
mod percentiles;
mod phantom;
mod regions;
mod remesh;
mod request;
mod sampled;
mod sheets;
mod shells;
mod soundness;
mod stencil;
mod structured;
mod stuffing;
mod surface_volume;
mod surfaces;
mod taubin;
mod tears;
mod tets;
mod thickness;
mod topology;
mod triangles;
mod voxels;
mod winding;

use pliant_geometry::Mesh;

pub use anatomy::Anatomy;
pub use assessment::Assessment;
pub use complex::MOST_MATERIALS;
pub use curvature::Curvature;
pub use decimate::Fewer;
pub use deviation::Deviation;
pub use enclosed::{Closing, Enclosed, EnclosedReport};
pub use error::MeshingError;
pub use extent::require_room_for;
pub use field::{Ellipsoid, ImplicitField};
pub use given::MeasuredTo;
pub use hausdorff::Hausdorff;
pub use lens::Lens;
pub use missed::Missed;
#[cfg(feature = "imaging")]
pub use of_image::{SURFACE_PAIRS, SURFACE_SMOOTHING};
pub use percentiles::Percentiles;
pub use phantom::{Organ, Phantom, brain_label};
pub use regions::{InterfaceReport, LabelReport, Regions};
pub use request::OrganTets;
pub use sampled::SampledDistances;
pub use sheets::{Distortion, Pattern, Sheet, sphere};
pub use shells::{FitProgress, FittedShells, Flaw, ShellGoal, ShellReport};
pub use soundness::SurfaceCheck;
pub use structured::{Block, Resolution, Tube, VolumeCell};
pub use stuffing::Stuffing;
pub use surface_volume::{LabelVolume, SurfaceVolume};
pub use tets::{
    DistanceReport, EdgeLengths, LostReport, MaterialReport, OrganMesh, Repairs, Steps, Tears, TetReport,
};
pub use thickness::Thickness;
pub use triangles::{SurfaceRepairs, TriangleMesh};
pub use voxels::Voxels;

/// Cells allowed in a mesh unless the caller says otherwise. Limits above 2²⁵ (34 million) act as 2²⁵.
pub const DEFAULT_CELL_LIMIT: usize = 5_000_000;

/// The body of a field as a mesh, with the dropped parts.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldMesh {
    /// One block of cells, the largest face-connected component.
    pub mesh: Mesh,
    /// Smaller components that were dropped.
    pub dropped_components: usize,
    /// Cells in them.
    pub dropped_cells: usize,
    /// Boundary edges of more than two boundary faces: the body touches itself there, because a gap is
    /// thinner than the cells.
    pub non_manifold_edges: usize,
}
