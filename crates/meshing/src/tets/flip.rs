//! Flips of a tetrahedral mesh: the tets around an edge become those over the best triangulation of its ring
//! (Klincsek 1980; 3-2, 4-4 and longer rings alike, open rings on the boundary), or two tets with a common
//! face become three around a new edge. A flip is accepted if its worst tet improves, within one material; on
//! the boundary also only if the new edge follows the surface.

use crate::tets::complex::{Complex, acoustic_length};

/// Longest ring of an edge that is taken away.
const LONGEST_RING: usize = 8;

/// A flip must lengthen the worst tet by this factor.
const GAIN: f64 = 1.0 + 1e-3;

/// Returns true if an edge of the boundary may turn, given its nodes and the nodes of the new edge.
pub(crate) type Follows<'a> = dyn Fn(&Complex, [u32; 2], [u32; 2]) -> bool + 'a;

impl Complex {
    /// Flips one tet away if that lengthens the worst acoustic length of the tets that change: its edges
    /// first, then its faces.
    pub(crate) fn flip(&mut self, tet: u32, follows: &Follows<'_>) -> bool {
        let nodes = self.tets[tet as usize];
        (0..4).any(|i| (i + 1..4).any(|j| self.remove_edge([nodes[i], nodes[j]], follows)))
            || self.faces(tet).into_iter().zip(nodes).any(|(face, apex)| self.remove_face(tet, face, apex))
    }

    fn remove_edge(&mut self, [p, q]: [u32; 2], follows: &Follows<'_>) -> bool {
        let around = self.round_edge(p, q);
        let Some(Ring { nodes, open }) = self.ring(&around, p, q) else { return false };
        let old = around.iter().map(|&tet| self.length(tet)).fold(f64::INFINITY, f64::min);
        let Some((least, triangles)) = self.best_triangulation(&nodes, p, q) else { return false };
        if least <= GAIN * old {
            return false;
        }
        let joined =
            |a: u32, b: u32| self.star[a as usize].iter().any(|&t| self.tets[t as usize].contains(&b));
        let last = nodes.len() - 1;
        let is_new = |i: usize, j: usize| j - i > 1 && (open || j - i < last);
        let unfit = |a: u32, b: u32| joined(a, b) || self.is_too_long(a, b);
        let refused = triangles.iter().any(|&[i, j, k]| {
            [[i, j], [j, k], [i, k]].into_iter().any(|[i, j]| is_new(i, j) && unfit(nodes[i], nodes[j]))
        });
        if refused || open && !follows(self, [p, q], [nodes[0], nodes[last]]) {
            return false;
        }
        let new = triangles.into_iter().flat_map(|[i, j, k]| {
            let [a, b, c] = [nodes[i], nodes[j], nodes[k]];
            [[a, b, c, q], [a, c, b, p]]
        });
        let new = new.collect::<Vec<_>>();
        self.replace(&around, &new);
        true
    }

    /// Two tets with a common face become three round the edge between their apexes.
    fn remove_face(&mut self, tet: u32, face: [u32; 3], apex: u32) -> bool {
        let [a, b, c] = face;
        let has_face = |other: &&u32| face.iter().all(|node| self.tets[**other as usize].contains(node));
        let Some(&other) = self.star[a as usize].iter().filter(has_face).find(|&&other| other != tet) else {
            return false;
        };
        let far = self.tets[other as usize].into_iter().find(|node| !face.contains(node));
        let Some(far) = far.filter(|_| self.material[tet as usize] == self.material[other as usize]) else {
            return false;
        };
        // The face is outward, seen from beyond: its own apex is below, the other one above.
        let new = [[apex, far, a, b], [apex, far, b, c], [apex, far, c, a]];
        let least = new.iter().map(|nodes| self.length_of(*nodes)).fold(f64::INFINITY, f64::min);
        if least <= GAIN * self.length(tet).min(self.length(other))
            || !self.round_edge(apex, far).is_empty()
            || self.is_too_long(apex, far)
        {
            return false;
        }
        self.replace(&[tet, other], &new);
        true
    }

    fn length_of(&self, nodes: [u32; 4]) -> f64 {
        acoustic_length(nodes.map(|node| self.points[node as usize]))
    }

    fn round_edge(&self, p: u32, q: u32) -> Vec<u32> {
        let star = self.star[p as usize].iter();
        star.copied().filter(|&tet| self.tets[tet as usize].contains(&q)).collect()
    }

    /// The nodes opposite to an edge, right-handed about the direction from p to q; `None` unless the tets
    /// are one fan of one material that may be flipped.
    fn ring(&self, around: &[u32], p: u32, q: u32) -> Option<Ring> {
        let first = *around.first()?;
        if around.len() > LONGEST_RING
            || around.iter().any(|&tet| self.material[tet as usize] != self.material[first as usize])
        {
            return None;
        }
        let mut links: Vec<[u32; 2]> = around.iter().map(|&tet| self.opposite_edge(tet, p, q)).collect();
        // An open fan starts at a node without an incoming link.
        let starts: Vec<u32> =
            links.iter().map(|link| link[0]).filter(|a| links.iter().all(|link| link[1] != *a)).collect();
        let open = !starts.is_empty();
        let start = *starts.first().unwrap_or(&links[0][0]);
        let mut nodes = vec![start];
        while let Some(at) = links.iter().position(|link| link[0] == nodes[nodes.len() - 1]) {
            nodes.push(links.swap_remove(at)[1]);
        }
        if !open {
            nodes.pop();
        }
        (links.is_empty() && nodes.len() > 2).then_some(Ring { nodes, open })
    }

    /// The other two nodes of a tet with an edge, with (p, q, a, b) in right-handed order.
    fn opposite_edge(&self, tet: u32, p: u32, q: u32) -> [u32; 2] {
        let nodes = self.tets[tet as usize];
        let place = |node: u32| nodes.iter().position(|&n| n == node).unwrap_or(0);
        let (i, j) = (place(p), place(q));
        let mut rest = (0..4).filter(|&at| at != i && at != j);
        let [k, l] = [rest.next().unwrap_or(0), rest.next().unwrap_or(0)];
        let order = [i, j, k, l];
        let inversions =
            (0..4).flat_map(|a| (a + 1..4).map(move |b| (a, b))).filter(|&(a, b)| order[a] > order[b]);
        if inversions.count() % 2 == 0 { [nodes[k], nodes[l]] } else { [nodes[l], nodes[k]] }
    }

    /// The best triangulation of a ring by its worst tet with p or q, and the acoustic length of this tet.
    fn best_triangulation(&self, ring: &[u32], p: u32, q: u32) -> Option<(f64, Vec<[usize; 3]>)> {
        let n = ring.len();
        let mut best = [[f64::INFINITY; LONGEST_RING + 1]; LONGEST_RING + 1];
        let mut split = [[0; LONGEST_RING + 1]; LONGEST_RING + 1];
        for span in 2..n {
            for i in 0..n - span {
                let k = i + span;
                best[i][k] = f64::NEG_INFINITY;
                for j in i + 1..k {
                    let [a, b, c] = [ring[i], ring[j], ring[k]];
                    let length = self.length_of([a, b, c, q]).min(self.length_of([a, c, b, p]));
                    let least = length.min(best[i][j]).min(best[j][k]);
                    if least > best[i][k] {
                        (best[i][k], split[i][k]) = (least, j);
                    }
                }
            }
        }
        let (mut open, mut triangles) = (vec![[0, n - 1]], Vec::new());
        while let Some([i, k]) = open.pop() {
            if k - i > 1 {
                let j = split[i][k];
                triangles.push([i, j, k]);
                open.extend([[i, j], [j, k]]);
            }
        }
        (best[0][n - 1] > 0.0).then_some((best[0][n - 1], triangles))
    }

    /// Takes tets out and puts others of the same material in their place.
    fn replace(&mut self, old: &[u32], new: &[[u32; 4]]) {
        let material = self.material[old[0] as usize];
        old.iter().for_each(|&tet| self.remove(tet));
        for &nodes in new {
            let tet = self.tets.len() as u32;
            self.tets.push(nodes);
            self.material.push(material);
            nodes.iter().for_each(|&node| self.star[node as usize].push(tet));
        }
    }
}

/// The nodes round an edge.
struct Ring {
    nodes: Vec<u32>,
    /// True if the edge lies on the boundary.
    open: bool,
}

#[cfg(test)]
mod tests {
    use pliant_geometry::Vector3;

    use super::*;

    fn volume(complex: &Complex) -> f64 {
        let of_tet = |tet| pliant_geometry::volume(pliant_geometry::CellKind::Tet, &complex.corners(tet));
        complex.alive().map(of_tet).sum()
    }

    fn shape(complex: &Complex) -> (usize, f64) {
        (complex.alive().count(), volume(complex))
    }

    /// Three tets round a short axis become two and back: the worst tet decides.
    #[test]
    fn three_tets_round_an_edge_become_two_where_that_is_better() {
        let ring = |at: f64| {
            let (sine, cosine) = (at * std::f64::consts::TAU / 3.0).sin_cos();
            Vector3::new(cosine, sine, 0.0)
        };
        let points =
            |half: f64| vec![ring(0.), ring(1.), ring(2.), Vector3::z() * -half, Vector3::z() * half];
        let mut tall = Complex::new(points(1.5), vec![[3, 4, 0, 1], [3, 4, 1, 2], [3, 4, 2, 0]], 3.0);
        let before = shape(&tall);
        assert!(tall.flip(0, &|_, _, _| true));
        assert_eq!(shape(&tall).0, 2);
        assert!((shape(&tall).1 - before.1).abs() < 1e-14);
        let mut flat = Complex::new(points(0.3), vec![[0, 1, 2, 4], [0, 2, 1, 3]], 3.0);
        assert!(flat.flip(0, &|_, _, _| false));
        assert_eq!(shape(&flat).0, 3);
        assert!(flat.alive().all(|tet| flat.length(tet) > 0.0));
    }

    /// A boundary edge between two tets flips only if the surface may change.
    #[test]
    fn an_edge_of_the_boundary_turns_where_it_may() {
        let corner = |x: f64, y: f64, z: f64| Vector3::new(x, y, z);
        let points = vec![
            corner(-1.5, 0., 0.),
            corner(1.5, 0., 0.),
            corner(0., -0.5, 0.),
            corner(0., 0.5, 0.),
            corner(0., 0., -1.),
        ];
        let mut wedge = Complex::new(points, vec![[0, 1, 2, 4], [0, 1, 4, 3]], 3.0);
        wedge.tets.iter_mut().for_each(|tet| {
            let x = tet.map(|node| wedge.points[node as usize]);
            if acoustic_length(x) < 0.0 {
                tet.swap(2, 3);
            }
        });
        assert!(!wedge.flip(0, &|_, _, _| false));
        let before = shape(&wedge);
        assert!(wedge.flip(0, &|_, _, _| true));
        assert_eq!(shape(&wedge), before);
        assert!(
            wedge
                .alive()
                .all(|tet| wedge.tets[tet as usize].contains(&2) && wedge.tets[tet as usize].contains(&3))
        );
    }
}
