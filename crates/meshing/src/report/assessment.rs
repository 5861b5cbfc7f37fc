//! Differences between a mesh and its input: distances, labels, missed features.

use pliant_geometry::Mesh;
use serde::Serialize;

use crate::error::MeshingError;
use crate::input::anatomy::Anatomy;
use crate::report::deviation::Deviation;
use crate::report::regions::Regions;
use crate::tets::missed::Missed;

/// Differences between a mesh and its anatomy.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Assessment {
    /// Distances between its boundary and the surface of the body as it was given.
    pub deviation: Deviation,
    /// Its labels and interfaces.
    pub regions: Regions,
    /// Features that are missed, too far away, or of wrong size.
    pub missed: Vec<Missed>,
}

impl Assessment {
    /// Assesses a mesh with cells of `edge` [m].
    ///
    /// # Errors
    /// If the box of the body is empty or not finite.
    pub fn of(mesh: &Mesh, anatomy: &Anatomy<'_>, edge: f64) -> Result<Self, MeshingError> {
        let deviation = Deviation::of(mesh, anatomy, edge)?;
        let regions = Regions::of(mesh, anatomy, edge);
        // No smooth surface is nearer to the corners of voxels than about the diagonal of one.
        let allowed = Missed::allowed(mesh, edge).max(anatomy.resolution());
        let mut missed = Missed::of(mesh, anatomy.field(), edge, &deviation, allowed)?;
        missed.extend(regions.missed(allowed));
        Ok(Self { deviation, regions, missed })
    }
}
