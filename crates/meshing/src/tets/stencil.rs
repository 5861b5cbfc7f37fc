//! Step 4 of isosurface stuffing: the part of one lattice tetrahedron inside the body, as tetrahedra. Quads
//! shared by two tetrahedra get a diagonal that depends on the face alone, so the pieces fit. There are two
//! rules for faces with a long cut edge. This one gave the organs the larger minimum of the acoustic length
//! at 10 and 8 mm. The opposite one bounds dihedral angles better.

use crate::tets::lattice::{Triple, is_long};

/// A corner of a lattice tetrahedron.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner {
    /// Position in the lattice (before warping).
    pub(crate) triple: Triple,
    /// Its node.
    pub(crate) node: u32,
    /// 1 inside, 0 on the surface, −1 outside.
    pub(crate) sign: i8,
}

/// Tetrahedra of nodes inside the body, of either orientation. `cut` gives the node where the surface
/// crosses the edge from an inner to an outer corner.
pub(crate) fn stencil(mut corners: [Corner; 4], cut: impl Fn(Corner, Corner) -> u32) -> Pieces {
    corners.sort_by_key(|corner| -corner.sign);
    let count = |sign: i8| corners.iter().filter(|corner| corner.sign == sign).count();
    let [a, b, c, d] = corners;
    match (count(1), count(-1)) {
        (0, _) => Pieces::default(),
        (_, 0) => Pieces::of(&[corners.map(|corner| corner.node)]),
        (1, _) => Pieces::of(&[corners.map(|to| if to.sign < 0 { cut(a, to) } else { to.node })]),
        (2, 1) => pyramid(a, b, c.node, cut(a, d), cut(b, d), starts_at_first(a, b, d)),
        (2, _) => wedge([a, b], [c, d], cut),
        _ => {
            let starts = [(a, b), (b, c), (c, a)].map(|(p, q)| starts_at_first(p, q, d));
            prism([a.node, b.node, c.node], [cut(a, d), cut(b, d), cut(c, d)], starts)
        }
    }
}

/// Up to three tetrahedra.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pieces {
    tets: [[u32; 4]; 3],
    count: usize,
}

impl Pieces {
    fn of(tets: &[[u32; 4]]) -> Self {
        let mut pieces = Self { count: tets.len(), ..Self::default() };
        pieces.tets[..tets.len()].copy_from_slice(tets);
        pieces
    }

    pub(crate) fn as_slice(&self) -> &[[u32; 4]] {
        &self.tets[..self.count]
    }
}

/// The face (p inside, q inside, n outside) leaves a quad p, q and two cuts. True if its diagonal starts at p
/// (and ends at the cut of qn), false if at q. The diagonal starts where the long cut edge starts. If both
/// cut edges are short, p and q differ in one coordinate. Then it starts at p or q, whichever has an even
/// number of coordinates greater than the coordinates of n.
fn starts_at_first(p: Corner, q: Corner, n: Corner) -> bool {
    let greater = (0..3).filter(|&axis| p.triple[axis] > n.triple[axis]).count();
    match (is_long(p.triple, n.triple), is_long(q.triple, n.triple)) {
        (true, _) => true,
        (false, true) => false,
        (false, false) => greater % 2 == 0,
    }
}

/// Apex over the quad p, q, cut of qn, cut of pn.
fn pyramid(p: Corner, q: Corner, apex: u32, cut_p: u32, cut_q: u32, from_p: bool) -> Pieces {
    let (p, q) = (p.node, q.node);
    if from_p {
        Pieces::of(&[[p, q, cut_q, apex], [p, cut_q, cut_p, apex]])
    } else {
        Pieces::of(&[[q, p, cut_p, apex], [q, cut_p, cut_q, apex]])
    }
}

/// Two corners inside (p, q), two outside (m, n): a prism between the triangles at p and at q. Its third quad
/// lies on the surface. In this lattice the diagonals of the other two quads start at different ends, one at
/// p and one at q. This leaves one choice for the third. Proof: if no cut edge is long, the parities with m
/// and n differ, since m and n differ by one coordinate. Otherwise two opposite cut edges are long, one at p
/// and one at q.
fn wedge([p, q]: [Corner; 2], [m, n]: [Corner; 2], cut: impl Fn(Corner, Corner) -> u32) -> Pieces {
    let bottom = [p.node, cut(p, m), cut(p, n)];
    let top = [q.node, cut(q, m), cut(q, n)];
    let (on_m, on_n) = (starts_at_first(p, q, m), starts_at_first(p, q, n));
    debug_assert!(on_m != on_n, "the diagonal on the surface is free");
    prism(bottom, top, [on_m, on_n, !on_n])
}

/// Three tetrahedra of a prism whose quad i stands on the edge from bottom i to bottom i + 1. `from_first`
/// says for each quad whether its diagonal starts at bottom i (true) or at bottom i + 1. Not all three may be
/// equal: such a prism has no triangulation. Face rules exclude it, since both faces with the long edge of an
/// outer corner start there.
fn prism(bottom: [u32; 3], top: [u32; 3], from_first: [bool; 3]) -> Pieces {
    debug_assert!(from_first != [true; 3] && from_first != [false; 3], "cyclic prism");
    let mut starts = [0; 3];
    for (quad, first) in from_first.into_iter().enumerate() {
        starts[if first { quad } else { (quad + 1) % 3 }] += 1;
    }
    let mut order = [0, 1, 2];
    order.sort_by_key(|&corner| -starts[corner]);
    let [i, j, k] = order;
    Pieces::of(&[
        [bottom[i], top[i], top[j], top[k]],
        [bottom[i], bottom[j], top[j], top[k]],
        [bottom[i], bottom[j], bottom[k], top[k]],
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tets::lattice::tets_from;

    /// Every lattice tetrahedron with every choice of signs.
    fn cases() -> impl Iterator<Item = [Corner; 4]> {
        tets_from([3, 3, 3]).chain(tets_from([4, 4, 4])).flat_map(|triples| {
            (0..81_usize).map(move |code| {
                let mut digits = code;
                let mut node = 0;
                triples.map(|triple| {
                    let sign = (digits % 3) as i8 - 1;
                    digits /= 3;
                    node += 1;
                    Corner { triple, node: node - 1, sign }
                })
            })
        })
    }

    fn cut(p: Corner, n: Corner) -> u32 {
        assert!(p.sign > 0 && n.sign < 0);
        10 + 4 * p.node + n.node
    }

    #[test]
    fn no_prism_is_cyclic_and_no_diagonal_is_free() {
        // `prism` and `wedge` assert it.
        for corners in cases() {
            stencil(corners, cut);
        }
    }

    #[test]
    fn pieces_are_distinct_nodes_without_outer_corners() {
        for corners in cases() {
            let inside = corners.iter().filter(|corner| corner.sign > 0).count();
            let pieces = stencil(corners, cut);
            assert_eq!(pieces.as_slice().is_empty(), inside == 0);
            for tet in pieces.as_slice() {
                for (i, node) in tet.iter().enumerate() {
                    assert!(!tet[i + 1..].contains(node));
                    assert!(*node >= 10 || corners[*node as usize].sign >= 0);
                }
            }
        }
    }
}
