//! Surfaces of triangles: made, changed, measured.

pub(crate) mod boxes;
pub(crate) mod crossings;
pub(crate) mod curvature;
pub(crate) mod decimate;
pub(crate) mod edges;
pub(crate) mod isosurface;
pub(crate) mod nesting;
pub(crate) mod remesh;
pub(crate) mod sampled;
pub(crate) mod surface_volume;
pub(crate) mod taubin;
pub(crate) mod thickness;
pub(crate) mod triangles;
pub(crate) mod winding;
