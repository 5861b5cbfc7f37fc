//! Shells that certainly do not cross: of two that cross, one becomes as flat as its triangle. Flat triangles
//! do not cross, so in the end no shells do. Leaves out: triangles that cross; these stay.

use pliant_geometry::Vector3;

use super::Shells;
use super::target::Target;

/// Most rounds in which shells become flat because they are nearer then.
const TIMES: usize = 6;

impl Shells {
    /// Flattens shells until none cross except where their triangles do. Of two that cross it flattens the
    /// one that bulges more. Nothing may change triangles or turn normals afterwards.
    pub(super) fn flatten(&mut self) {
        self.flat.resize(self.mesh.triangles.len(), false);
        loop {
            let curved = |t: &u32| !self.flat[*t as usize];
            let bulge = |t: &u32| self.bulge(*t);
            let more = |pair: [u32; 2]| {
                pair.into_iter().filter(curved).max_by(|a, b| bulge(a).total_cmp(&bulge(b)).then(b.cmp(a)))
            };
            let chosen: Vec<u32> = self.crossing().pairs.into_iter().filter_map(more).collect();
            if chosen.is_empty() {
                return;
            }
            chosen.into_iter().for_each(|t| self.flat[t as usize] = true);
        }
    }

    /// Flattens shells that are farther off than a bound [m] and nearer as flat triangles, as long as the
    /// largest distance falls. `bound` is computed from the distances of all shells. Returns whether any
    /// shell was flattened.
    pub(super) fn flatten_nearer(&mut self, target: &Target, bound: impl Fn(&[f64]) -> f64) -> bool {
        let largest = |far: &[f64]| far.iter().copied().fold(0.0, f64::max);
        let flat = Self { flat: vec![true; self.mesh.triangles.len()], ..self.clone() };
        let if_flat = flat.distances(&target.fine, target).far();
        let mut far = self.distances(&target.fine, target).far();
        let mut is_changed = false;
        for _ in 0..TIMES {
            let bound = bound(&far);
            let mut next = self.clone();
            next.flat.resize(next.mesh.triangles.len(), false);
            let nearer = |&t: &usize| far[t] > bound && if_flat[t] < far[t];
            let chosen: Vec<usize> = self.mesh.alive().map(|t| t as usize).filter(nearer).collect();
            chosen.iter().for_each(|&t| next.flat[t] = true);
            let now = next.distances(&target.fine, target).far();
            if chosen.is_empty() || largest(&now) >= largest(&far) {
                break;
            }
            (*self, far, is_changed) = (next, now, true);
        }
        is_changed
    }

    /// Largest distance of the control points of a shell from its triangle [m].
    fn bulge(&self, shell: u32) -> f64 {
        let patch = self.patch(shell);
        let (start, normal) = (patch.corners()[0], patch.facet_normal());
        let off = |x: &Vector3| normal.dot(&(x - start)).abs();
        patch.edge_points().iter().map(off).fold(0.0, f64::max)
    }

    /// True if a shell is flat.
    pub(super) fn is_flat(&self, shell: u32) -> bool {
        self.flat.get(shell as usize).is_some_and(|flat| *flat)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::triangles::TriangleMesh;

    /// Two squares 0.13 apart, of four triangles each. With these normals the shells of each square bulge by
    /// 0.08 towards the other.
    fn bulging() -> Shells {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.5]];
        let of = |z: f64, lean: f64| {
            corners.map(|[x, y]| {
                let normal = Vector3::new(lean * (2.0 * x - 1.0), lean * (2.0 * y - 1.0), 1.0).normalize();
                (Vector3::new(x, y, z), normal)
            })
        };
        let (points, normals) = [of(0.0, 0.4), of(0.13, -0.4)].concat().into_iter().unzip();
        let around = |first: u32| (0..4).map(move |k| [first + k, first + (k + 1) % 4, first + 4]);
        let triangles = around(0).chain(around(5)).collect();
        Shells {
            mesh: TriangleMesh::new(points, triangles),
            normals,
            on_border: vec![true; 10],
            active: vec![true; 10],
            strict: true,
            creased: vec![false; 10],
            sharp: vec![false; 10],
            flat: Vec::new(),
        }
    }

    /// At most one of each two shells that crossed is flat, and flat shells are exactly their triangles.
    #[test]
    fn shells_that_bulge_into_each_other_become_flat() {
        let mut shells = bulging();
        let before = shells.crossing();
        assert!(before.pairs.len() >= 4, "{:?}", before.pairs);
        shells.flatten();
        assert!(shells.crossing().pairs.is_empty());
        let flat: Vec<u32> = shells.mesh.alive().filter(|&t| shells.is_flat(t)).collect();
        assert!(!flat.is_empty() && flat.len() < before.shells().len(), "{flat:?}");
        for &t in &flat {
            assert!(shells.bulge(t) < 1e-15);
            for other in shells.mesh.alive().filter(|&other| !shells.is_flat(other)) {
                // The edge in common is straight on both sides.
                let shared = |n: &u32| shells.mesh.triangles[t as usize].contains(n);
                if shells.mesh.triangles[other as usize].iter().filter(|n| shared(n)).count() == 2 {
                    assert!(shells.patch(other).straight().iter().filter(|straight| **straight).count() >= 2);
                }
            }
        }
    }
}
