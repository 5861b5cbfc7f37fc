//! Distance and normal of a rigid surface at a point near it, and the triangles of the surface.

use nalgebra::Vector3;

/// The surface of a shape as seen from a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Near {
    /// Distance [m] to its surface, negative inside.
    pub distance: f64,
    /// The direction, of length 1, in which the distance grows.
    pub normal: Vector3<f64>,
}

/// Points [m] and triangles of a surface, outward.
pub type Triangles = (Vec<Vector3<f64>>, Vec<[u32; 3]>);
