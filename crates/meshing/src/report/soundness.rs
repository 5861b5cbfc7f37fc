//! Checks that the boundary of a mesh bounds a body: its Euler number, and faces that pass through each
//! other.

use pliant_geometry::{Mesh, Vector3, boundary};
use serde::Serialize;

use crate::input::field::ImplicitField;
use crate::report::deviation::sample_step;
use crate::surface::crossings::crossings;
use crate::surface::edges::key;
use crate::surface::isosurface::euler_number_of_field;

/// Comparison of the boundary of a mesh with the boundary of a body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SurfaceCheck {
    /// Euler number of the boundary of the mesh: 2 for each closed surface, less 2 for each handle.
    pub euler_number: i64,
    /// Euler number of the body's surface, if it is known.
    pub of_body: Option<i64>,
    /// Boundary faces that pass through others, quads as two triangles.
    pub self_intersections: usize,
    /// Place of the first intersection [m].
    pub first_crossing: Option<[f64; 3]>,
}

impl SurfaceCheck {
    /// Checks the boundary of volume cells, or a mesh of triangles and quads itself.
    pub fn of(mesh: &Mesh) -> Self {
        let faces = boundary(mesh).faces;
        let fan =
            |nodes: &[u32]| (2..nodes.len()).map(|k| [nodes[0], nodes[k - 1], nodes[k]]).collect::<Vec<_>>();
        let triangles: Vec<[u32; 3]> = faces.iter().flat_map(|face| fan(face.nodes())).collect();
        let (crossing, first_crossing) = self_intersections(&mesh.points, &triangles);
        let (euler_number, self_intersections) = (euler_number(&triangles), crossing.len());
        Self { euler_number, of_body: None, self_intersections, first_crossing }
    }

    /// Beside the surface of the body, the field sampled at a quarter of an edge [m].
    pub fn with_body(self, field: &(impl ImplicitField + ?Sized), edge: f64) -> Self {
        let step = sample_step(field, edge);
        Self { of_body: step.and_then(|step| euler_number_of_field(field, step)).ok(), ..self }
    }

    /// The numbers in words.
    pub fn line(&self) -> String {
        let of_body = self.of_body.map_or_else(String::new, |number| format!(" (body: {number})"));
        let Self { euler_number, self_intersections, .. } = self;
        format!(
            "surface          Euler number {euler_number}{of_body}, {self_intersections} faces intersect others"
        )
    }

    /// Describes the first intersection of faces; `None` if no face passes through another.
    pub fn doubt(&self) -> Option<String> {
        let [x, y, z] = self.first_crossing?;
        let number = self.self_intersections;
        Some(format!(
            "{number} faces of the mesh boundary pass through others, the first at ({x:.4}, {y:.4}, {z:.4}) \
             m; use a smaller edge there, unless the body's surface passes through itself"
        ))
    }
}

/// V − E + F of the triangles: 2 for each closed piece, less 2 for each handle.
pub(crate) fn euler_number(triangles: &[[u32; 3]]) -> i64 {
    let count = |mut pairs: Vec<[u32; 2]>| {
        pairs.sort_unstable();
        pairs.dedup();
        pairs.len() as i64
    };
    let edges = triangles.iter().flat_map(|&[a, b, c]| [key(a, b), key(b, c), key(c, a)]).collect();
    let points = triangles.as_flattened().iter().map(|&node| [node; 2]).collect();
    count(points) - count(edges) + triangles.len() as i64
}

/// Triangles that pass through others, and where the first do [m].
pub(crate) fn self_intersections(points: &[Vector3], triangles: &[[u32; 3]]) -> (Vec<u32>, Option<[f64; 3]>) {
    let (pairs, place) = crossings(points, triangles);
    let mut faces = pairs.concat();
    faces.sort_unstable();
    faces.dedup();
    (faces, place.map(Into::into))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tetrahedron_has_two_and_a_ring_of_boxes_none() {
        let tet = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
        assert_eq!(euler_number(&tet), 2);
        // A torus of 3 × 3 squares, each of two triangles.
        let at = |i: u32, j: u32| i % 3 + 3 * (j % 3);
        let square = |i: u32, j: u32| {
            [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
        };
        let torus: Vec<[u32; 3]> = (0..9).flat_map(|k| square(k / 3, k % 3)).collect();
        assert_eq!(euler_number(&torus), 0);
    }
}
