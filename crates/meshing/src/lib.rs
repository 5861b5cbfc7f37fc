//! Volume meshes made from shapes: structured blocks and tubes, and bodies of fields, image regions or closed
//! surfaces filled with tetrahedra (isosurface stuffing) or cubes. Lengths are in metres. The same request
//! gives the same mesh, bit for bit, on any number of threads. Surfaces of fields and files in even or few
//! triangles, and curved shells fitted to them.
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

mod error;
mod input;
mod report;
mod shapes;
mod shells;
mod surface;
mod tets;

use pliant_geometry::Mesh;

pub use error::MeshingError;
pub use input::anatomy::Anatomy;
pub use input::enclosed::{Closing, Enclosed, EnclosedReport};
pub use input::extent::require_room_for;
pub use input::field::{Ellipsoid, ImplicitField};
pub use input::given::MeasuredTo;
#[cfg(feature = "imaging")]
pub use input::of_image::{SURFACE_PAIRS, SURFACE_SMOOTHING};
pub use report::assessment::Assessment;
pub use report::deviation::Deviation;
pub use report::hausdorff::Hausdorff;
pub use report::percentiles::Percentiles;
pub use report::regions::{InterfaceReport, LabelReport, Regions};
pub use report::soundness::SurfaceCheck;
pub use shapes::lens::Lens;
pub use shapes::phantom::{Organ, Phantom, brain_label};
pub use shapes::sheets::{Distortion, Pattern, Sheet, sphere};
pub use shapes::structured::{Block, Resolution, Tube, VolumeCell};
pub use shells::{FitProgress, FittedShells, Flaw, ShellGoal, ShellReport};
pub use surface::curvature::Curvature;
pub use surface::decimate::Fewer;
pub use surface::sampled::SampledDistances;
pub use surface::surface_volume::{LabelVolume, SurfaceVolume};
pub use surface::thickness::Thickness;
pub use surface::triangles::{SurfaceRepairs, TriangleMesh};
pub use tets::complex::MOST_MATERIALS;
pub use tets::missed::Missed;
pub use tets::optimise::Steps;
pub use tets::organ::{
    DistanceReport, EdgeLengths, LostReport, MaterialReport, OrganMesh, Repairs, Tears, TetReport,
};
pub use tets::request::OrganTets;
pub use tets::stuffing::Stuffing;
pub use tets::voxels::Voxels;

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
