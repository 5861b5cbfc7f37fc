//! Pieces of a surface, and which closed ones lie in which.

use std::collections::BTreeMap;

use pliant_geometry::Vector3;

use crate::surface::edges::key;
use crate::surface::winding::Winding;

/// A piece of a surface, held together by edges.
pub(crate) struct Shell {
    /// Its triangles, by number, increasing.
    pub(crate) triangles: Vec<u32>,
    /// The enclosed volume [m³]; negative if it is oriented inwards.
    pub(crate) volume: f64,
}

/// The pieces of a surface, by their first triangle.
pub(crate) fn shells(points: &[Vector3], triangles: &[[u32; 3]]) -> Vec<Shell> {
    let mut at_edge: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    let mut root: Vec<u32> = (0..triangles.len() as u32).collect();
    for (number, &[a, b, c]) in (0_u32..).zip(triangles) {
        for edge in [key(a, b), key(b, c), key(c, a)] {
            let other = *at_edge.entry(edge).or_insert(number);
            let [p, q] = [find(&mut root, number), find(&mut root, other)];
            root[p.max(q) as usize] = p.min(q);
        }
    }
    let mut pieces: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for number in 0..triangles.len() as u32 {
        pieces.entry(find(&mut root, number)).or_default().push(number);
    }
    let shell = |numbers: Vec<u32>| {
        let nodes: Vec<[u32; 3]> = numbers.iter().map(|&t| triangles[t as usize]).collect();
        Shell { volume: signed_volume(points, &nodes), triangles: numbers }
    };
    pieces.into_values().map(shell).collect()
}

fn find(root: &mut [u32], mut at: u32) -> u32 {
    while root[at as usize] != at {
        root[at as usize] = root[root[at as usize] as usize];
        at = root[at as usize];
    }
    at
}

/// For each piece the pieces around it. Intersecting pieces are judged by one of their points.
pub(crate) fn containers(points: &[Vector3], triangles: &[[u32; 3]], shells: &[Shell]) -> Vec<Vec<usize>> {
    let of = |shell: &Shell| shell.triangles.iter().map(|&t| triangles[t as usize]).collect::<Vec<_>>();
    let boxes: Vec<(Vector3, Vector3)> = shells
        .iter()
        .map(|shell| box_of(of(shell).iter().flatten().map(|&node| points[node as usize])))
        .collect();
    let mut found = vec![Vec::new(); shells.len()];
    for (outer, shell) in shells.iter().enumerate() {
        let (low, high) = boxes[outer];
        let holds = |&inner: &usize| {
            let (first, last) = boxes[inner];
            inner != outer && (0..3).all(|axis| low[axis] < first[axis] && last[axis] < high[axis])
        };
        let candidates: Vec<usize> = (0..shells.len()).filter(holds).collect();
        if candidates.is_empty() {
            continue;
        }
        let winding = Winding::new(corners_of(points, &of(shell)));
        for inner in candidates {
            let start = triangles[shells[inner].triangles[0] as usize][0];
            if winding.at(&points[start as usize]).abs() > 0.5 {
                found[inner].push(outer);
            }
        }
    }
    found
}

/// The volume enclosed by triangles [m³] (Gauss: a third of the flux of x), negative if they are oriented
/// inwards.
pub(crate) fn signed_volume(points: &[Vector3], triangles: &[[u32; 3]]) -> f64 {
    // About a nearby point, so that positions far from the origin lose no digits.
    let Some(about) = triangles.first().map(|nodes| points[nodes[0] as usize]) else { return 0.0 };
    let volume = |[a, b, c]: [Vector3; 3]| (a - about).dot(&(b - about).cross(&(c - about))) / 6.0;
    corners_of(points, triangles).into_iter().map(volume).sum()
}

pub(crate) fn corners_of(points: &[Vector3], triangles: &[[u32; 3]]) -> Vec<[Vector3; 3]> {
    triangles.iter().map(|nodes| nodes.map(|node| points[node as usize])).collect()
}

/// Smallest and largest corner of a box round points.
pub(crate) fn box_of(points: impl Iterator<Item = Vector3>) -> (Vector3, Vector3) {
    let empty = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    points.fold(empty, |(low, high), x| (low.inf(&x), high.sup(&x)))
}
