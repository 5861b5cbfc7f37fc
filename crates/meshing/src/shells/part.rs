//! Some shells cut out of the whole. A change of a few points is tried on their surroundings only, so it
//! costs no more on a large organ.

use super::Shells;
use super::measure::Distances;

/// The shells that some points may change, and their surroundings.
#[derive(Clone)]
pub(super) struct Part {
    pub(super) shells: Shells,
    pub(super) distances: Distances,
    /// The numbers of its shells in the whole, increasing.
    shell_numbers: Vec<u32>,
    /// The numbers of its points in the whole, increasing.
    pub(super) nodes: Vec<u32>,
}

impl Part {
    /// The part in which some points and their neighbours may move. `None` if no shells are there.
    pub(super) fn new(whole: &mut Shells, points: &[u32], distances: &Distances) -> Option<Self> {
        // Normals of their neighbours turn, too.
        whole.activate(points.to_vec());
        let mut inner = vec![false; whole.mesh.points.len()];
        let near = whole.near(|shell| whole.moves(shell));
        near.iter().flat_map(|&t| whole.mesh.triangles[t as usize]).for_each(|n| inner[n as usize] = true);
        let has_inner = |t: &u32| whole.mesh.triangles[*t as usize].iter().any(|&n| inner[n as usize]);
        let shell_numbers: Vec<u32> = whole.mesh.alive().filter(has_inner).collect();
        let (shells, nodes) = whole.part(&shell_numbers);
        let distances = distances.part(&shell_numbers, |t| whole.moves(t));
        (!shell_numbers.is_empty()).then_some(Self { shells, distances, shell_numbers, nodes })
    }

    /// The number in the part of a point of the whole.
    pub(super) fn point(&self, node: u32) -> Option<u32> {
        Some(self.nodes.binary_search(&node).ok()? as u32)
    }

    /// The number in the part of a shell of the whole.
    pub(super) fn shell(&self, shell: u32) -> Option<u32> {
        Some(self.shell_numbers.binary_search(&shell).ok()? as u32)
    }

    /// Puts the changed part in its place in the whole, which has not changed since the part was cut out.
    pub(super) fn put_back(self, whole: &mut Shells, distances: &mut Distances) {
        let Self { shells, distances: found, mut shell_numbers, mut nodes } = self;
        let moved: Vec<bool> = (0..whole.mesh.triangles.len() as u32).map(|t| whole.moves(t)).collect();
        let fresh = |old: usize, new: usize, first: usize| (first as u32..).take(new - old);
        shell_numbers.extend(fresh(shell_numbers.len(), shells.mesh.triangles.len(), moved.len()));
        nodes.extend(fresh(nodes.len(), shells.mesh.points.len(), whole.mesh.points.len()));
        whole.mesh.put(&shells.mesh, &shell_numbers, &nodes);
        let count = whole.mesh.points.len();
        whole.normals.resize(count, Default::default());
        for flags in [&mut whole.on_border, &mut whole.active, &mut whole.creased, &mut whole.sharp] {
            flags.resize(count, false);
        }
        for (at, &node) in nodes.iter().enumerate() {
            let node = node as usize;
            whole.normals[node] = shells.normals[at];
            whole.on_border[node] = shells.on_border[at];
            whole.active[node] = shells.active[at];
            whole.creased[node] = shells.creased[at];
            whole.sharp[node] = shells.sharp[at];
        }
        distances.put(&found, &shell_numbers, |t| moved[t as usize]);
    }
}
