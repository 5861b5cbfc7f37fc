//! Tetrahedra and cubes in a body: lattice, stuffing, cuts between materials, improvement, and what a mesh
//! misses.

pub(crate) mod complex;
pub(crate) mod cut;
pub(crate) mod flip;
pub(crate) mod grading;
pub(crate) mod guard;
pub(crate) mod lattice;
pub(crate) mod long_edges;
pub(crate) mod lost;
pub(crate) mod manifold;
pub(crate) mod missed;
pub(crate) mod near_materials;
pub(crate) mod octree;
pub(crate) mod optimise;
pub(crate) mod organ;
pub(crate) mod request;
pub(crate) mod stencil;
pub(crate) mod stuffing;
pub(crate) mod tears;
pub(crate) mod topology;
pub(crate) mod voxels;
