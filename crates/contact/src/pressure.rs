//! Pressures of contacts on single nodes: p = |N|/A. N is the sum of the contact forces on a node along their
//! normals. A = Σ ⅓ max(0, −a·N/|N|) is the node's share of the area that N presses on. Here a are the
//! outward vector areas of its deformed faces.

use nalgebra::Vector3;

use crate::touch::{Contact, Contacts};

/// Triangles of all surfaces of contacts, each once, in places of their nodes among `numbers`, which
/// increase.
pub fn faces(contacts: &Contacts, numbers: &[u32]) -> Vec<[u32; 3]> {
    let surfaces = contacts.contacts.iter().flat_map(Contact::surfaces);
    let place = |node: u32| numbers.partition_point(|&known| known < node) as u32;
    let mut faces: Vec<[u32; 3]> =
        surfaces.flat_map(|surface| &surface.faces).map(|face| face.map(place)).collect();
    faces.sort_unstable();
    faces.dedup();
    faces
}

/// The pressure [Pa] of a force [N] along normals on each node of faces, with the nodes at their places [m];
/// `None` of nodes without faces.
pub fn pressures(faces: &[[u32; 3]], forces: &[Vector3<f64>], places: &[Vector3<f64>]) -> Vec<Option<f64>> {
    let directions: Vec<Vector3<f64>> =
        forces.iter().map(|force| force.try_normalize(0.0).unwrap_or_default()).collect();
    // Of faces that look against the force, and along it: sheets are pressed on from both sides.
    let mut shares = vec![[0.0; 2]; forces.len()];
    let mut has_faces = vec![false; forces.len()];
    for face in faces {
        let [a, b, c] = face.map(|node| places[node as usize]);
        let third = (b - a).cross(&(c - a)) / 6.0;
        for node in face.map(|node| node as usize) {
            let along = third.dot(&directions[node]);
            shares[node][0] += (-along).max(0.0);
            shares[node][1] += along.max(0.0);
            has_faces[node] = true;
        }
    }
    let pressure = |((force, [against, along]), has_faces): ((&Vector3<f64>, [f64; 2]), bool)| {
        let (force, area) = (force.norm(), against.max(along));
        has_faces.then_some(if force > 0.0 && area > 0.0 { force / area } else { 0.0 })
    };
    forces.iter().zip(shares).zip(has_faces).map(pressure).collect()
}
