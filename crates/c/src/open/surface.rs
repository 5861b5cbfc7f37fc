//! A surface of a simulation that is open.

use pliant_run::Skin;

/// A surface with places and normals of its vertices.
pub(crate) struct OpenSurface {
    pub(crate) skin: Skin,
    /// Lent vertices: they change when the surface is lent again.
    pub(crate) lent: Vertices,
    /// Vertices that normals are copied from.
    pub(crate) copied: Vertices,
}

/// Places [m] and unit normals.
#[derive(Clone)]
pub(crate) struct Vertices {
    pub(crate) places: Vec<[f64; 3]>,
    pub(crate) normals: Vec<[f64; 3]>,
}
