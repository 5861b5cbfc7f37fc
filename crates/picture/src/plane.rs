//! Planes that cut pictures.

use pliant_geometry::Vector3;

/// A plane: removes the part on the side of its normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit normal.
    pub normal: Vector3,
    /// Distance from the origin along the normal [m].
    pub offset: f64,
}

impl Plane {
    /// Through a point; `None` for a normal without direction.
    pub fn through(point: &Vector3, normal: &Vector3) -> Option<Self> {
        let normal = normal.try_normalize(1e-300)?;
        Some(Self { normal, offset: normal.dot(point) })
    }

    /// Distance of a point [m], positive on the side that is taken away.
    pub fn distance(&self, point: &Vector3) -> f64 {
        self.normal.dot(point) - self.offset
    }
}
