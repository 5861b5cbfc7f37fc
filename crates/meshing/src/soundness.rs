//! Whether the boundary of a mesh bounds a body: its Euler number, and faces that pass through each other.

use pliant_geometry::Vector3;

use crate::crossings::crossings;
use crate::edges::key;

/// V − E + F of the triangles: 2 for each closed piece, less 2 for each handle.
pub(crate) fn euler_number(triangles: &[[u32; 3]]) -> i64 {
    let count = |mut all: Vec<[u32; 2]>| {
        all.sort_unstable();
        all.dedup();
        all.len() as i64
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
