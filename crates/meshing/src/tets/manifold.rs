//! Repairs a body that touches itself: where a gap is thinner than the cells, its two sides share points or
//! edges. A point is doubled for every group of its tets connected through faces. An edge with more than two
//! boundary faces is halved first, which gives each side its own point. Two stretches of the boundary may
//! meet in a point whose tets are connected (a sheet without thickness). Then one of the two gets its own
//! point slightly further out, with a tet on each of its faces, or the point is taken off. Points in one
//! place then move apart, each into its own tets, so that the sides have a gap between them.

use std::collections::BTreeMap;

use pliant_geometry::Vector3;

use crate::surface::edges::key;
use crate::tets::complex::{Complex, OUTSIDE, acoustic_length};
use crate::tets::optimise::directions;

/// Distances of the new point of a pinch from the old one, in lattice constants.
const LIFTS: [f64; 5] = [0.5, 0.35, 0.25, 0.15, 0.08];

/// Move of points in one place into their tets, in lattice constants.
const APART: f64 = 0.08;

/// Part of its edges that a point takes along where it is taken off.
const DUG: f64 = 0.35;

/// Moving apart must leave tets this part of their acoustic length.
const LEAST_AFTER_MOVE: f64 = 0.3;

/// The repairs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Mended {
    /// Points added by doubling.
    pub(crate) doubled: usize,
    /// Edges halved.
    pub(crate) halved: usize,
    /// Points doubled where the boundary met itself in a point.
    pub(crate) parted: usize,
}

/// Mends all points and edges.
pub(crate) fn mend(complex: &mut Complex) -> Mended {
    let doubled = double_points(complex, 0..complex.points.len() as u32);
    let mut mended = Mended { doubled, ..Mended::default() };
    // Halving leaves two valid edges, so one pass suffices except for edges made by doubling.
    for _ in 0..4 {
        let edges = crowded_edges(complex);
        if edges.is_empty() {
            break;
        }
        for [p, q] in edges {
            let middle = (complex.points[p as usize] + complex.points[q as usize]) / 2.0;
            let new = complex.bisect([p, q], middle);
            mended.halved += 1;
            mended.doubled += double_points(complex, new..new + 1);
        }
    }
    for point in pinched_points(complex) {
        while fans(complex, point).len() > 1 {
            if !part_pinch(complex, point) {
                dig(complex, point);
            }
            mended.parted += 1;
        }
    }
    move_apart(complex);
    mended
}

/// Moves points that lie in one place apart.
fn move_apart(complex: &mut Complex) {
    let mut places: BTreeMap<[u64; 3], Vec<u32>> = BTreeMap::new();
    for (point, (place, star)) in (0..).zip(complex.points.iter().zip(&complex.star)) {
        if !star.is_empty() {
            places.entry([place.x, place.y, place.z].map(f64::to_bits)).or_default().push(point);
        }
    }
    for point in places.into_values().filter(|points| points.len() > 1).flatten() {
        move_inwards(complex, point);
    }
}

/// Moves a point of the boundary into its tets, in the direction that leads deepest behind all faces round
/// it.
fn move_inwards(complex: &mut Complex, point: u32) {
    let (here, size) = (complex.points[point as usize], complex.size[point as usize]);
    let normal = |face: [u32; 3]| {
        let [a, b, c] = face.map(|node| complex.points[node as usize]);
        (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default()
    };
    let normals: Vec<Vector3> = complex.rim_of(point, |_| true).into_iter().map(normal).collect();
    let behind = |way: &Vector3| normals.iter().map(|normal| -normal.dot(way)).fold(f64::INFINITY, f64::min);
    let mean = -normals.iter().sum::<Vector3>().try_normalize(0.0).unwrap_or_default();
    // Corners too narrow for these directions have their own tets.
    let corner = |&tet: &u32| {
        let centre = complex.corners(tet).iter().sum::<Vector3>() / 4.0;
        (centre - here).try_normalize(0.0).unwrap_or_default()
    };
    let into_tets: Vec<Vector3> = complex.star[point as usize].iter().map(corner).collect();
    let (depth, way) = std::iter::once(mean)
        .chain(directions())
        .chain(into_tets)
        .map(|way| (behind(&way), way))
        .fold((0.0, mean), |best, other| if other.0 > best.0 { other } else { best });
    let least = |complex: &Complex| {
        let star = &complex.star[point as usize];
        star.iter().map(|&tet| complex.part(tet)).fold(f64::INFINITY, f64::min)
    };
    let enough = LEAST_AFTER_MOVE * least(complex);
    for halvings in 0..5 {
        let reach = APART * size * 0.5_f64.powi(halvings);
        complex.points[point as usize] = here + way * reach;
        if depth > 0.0 && least(complex) >= enough {
            return;
        }
    }
    complex.points[point as usize] = here;
}

/// Points where the boundary touches itself: their boundary faces form more than one fan.
/// Increasing.
pub(crate) fn pinched_points(complex: &Complex) -> Vec<u32> {
    let outer = |point: &u32| complex.sides[*point as usize] & OUTSIDE != 0;
    (0..complex.points.len() as u32).filter(outer).filter(|&point| fans(complex, point).len() > 1).collect()
}

/// Boundary faces round a point, outward, in groups that are connected through edges at the point.
fn fans(complex: &Complex, point: u32) -> Vec<Vec<[u32; 3]>> {
    let mut rest = complex.rim_of(point, |_| true);
    let meet = |a: &[u32; 3], b: &[u32; 3]| a.iter().any(|node| *node != point && b.contains(node));
    let mut fans = Vec::new();
    while let Some(first) = rest.pop() {
        let mut fan = vec![first];
        let mut at = 0;
        while at < fan.len() {
            let (joined, left) = rest.iter().partition(|face| meet(&fan[at], face));
            fan.extend::<Vec<[u32; 3]>>(joined);
            rest = left;
            at += 1;
        }
        fans.push(fan);
    }
    fans
}

/// Gives one of the fans round a point a new point further out, and a tet on each of its faces. Of all fans
/// and places it takes the one whose worst new tet is best. False where every choice would turn a tet over.
fn part_pinch(complex: &mut Complex, point: u32) -> bool {
    let (here, size) = (complex.points[point as usize], complex.size[point as usize]);
    let mut best: Option<(f64, Vec<[u32; 3]>, Vector3)> = None;
    for fan in fans(complex, point) {
        let corners = |face: &[u32; 3]| face.map(|node| complex.points[node as usize]);
        let normals = fan.iter().map(|face| {
            let [a, b, c] = corners(face);
            (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default()
        });
        let normals: Vec<Vector3> = normals.collect();
        let mean = normals.iter().sum::<Vector3>().try_normalize(0.0);
        let ways = mean.into_iter().chain(normals).chain(directions());
        for place in ways.flat_map(|way| LIFTS.map(|lift| here + way * (lift * size))) {
            let lengths = fan.iter().map(|face| {
                let [a, b, c] = corners(face);
                acoustic_length([a, b, c, place])
            });
            let least = lengths.fold(f64::INFINITY, f64::min);
            if least > best.as_ref().map_or(0.0, |best| best.0) {
                best = Some((least, fan.clone(), place));
            }
        }
    }
    let Some((_, fan, place)) = best else { return false };
    complex.cap(point, &fan, place);
    true
}

/// Removes a point with the near thirds of its tets, which joins the spaces that its fans bound.
fn dig(complex: &mut Complex, point: u32) {
    for other in complex.neighbours(point) {
        let place = complex.points[point as usize].lerp(&complex.points[other as usize], DUG);
        complex.bisect([point, other], place);
    }
    for tet in complex.star[point as usize].clone() {
        let nodes = complex.tets[tet as usize];
        complex.remove(tet);
        complex.find_sides_of(&nodes);
    }
}

/// Edges with more than two boundary faces, increasing.
pub(crate) fn crowded_edges(complex: &Complex) -> Vec<[u32; 2]> {
    let mut edges: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    for [a, b, c] in complex.outer_faces() {
        for [p, q] in [[a, b], [b, c], [c, a]] {
            *edges.entry(key(p, q)).or_default() += 1;
        }
    }
    edges.into_iter().filter(|(_, count)| *count > 2).map(|(edge, _)| edge).collect()
}

/// Doubles the points whose tets fall into groups. Returns the number of points added.
fn double_points(complex: &mut Complex, points: std::ops::Range<u32>) -> usize {
    let mut added = 0;
    for point in points {
        let groups = groups(complex, point);
        for group in groups.iter().skip(1) {
            let twin = complex.points.len() as u32;
            complex.points.push(complex.points[point as usize]);
            complex.sides.push(complex.sides[point as usize]);
            complex.size.push(complex.size[point as usize]);
            complex.star.push(group.clone());
            complex.star[point as usize].retain(|tet| !group.contains(tet));
            for &tet in group {
                for node in &mut complex.tets[tet as usize] {
                    if *node == point {
                        *node = twin;
                    }
                }
            }
            added += 1;
        }
    }
    added
}

/// Tets round a point in groups that are connected through faces with the point; the group of the first tet
/// first.
fn groups(complex: &Complex, point: u32) -> Vec<Vec<u32>> {
    let star = &complex.star[point as usize];
    let mut rest: Vec<u32> = star.clone();
    rest.sort_unstable();
    let shares_face = |a: u32, b: u32| {
        let [a, b] = [a, b].map(|tet| complex.tets[tet as usize]);
        a.iter().filter(|node| b.contains(node)).count() == 3
    };
    let mut groups = Vec::new();
    while !rest.is_empty() {
        let mut group = vec![rest.remove(0)];
        let mut at = 0;
        while at < group.len() {
            let tet = group[at];
            let (joined, left): (Vec<u32>, Vec<u32>) =
                rest.iter().partition(|&&other| shares_face(tet, other));
            group.extend(joined);
            rest = left;
            at += 1;
        }
        groups.push(group);
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two cubes of six tets that share an edge, joined by nothing else or round it.
    #[test]
    fn two_bodies_that_share_an_edge_come_apart() {
        let corner = |x: f64, y: f64, z: f64| Vector3::new(x, y, z);
        let points = vec![
            corner(0., 0., 0.),
            corner(0., 0., 1.),
            corner(1., 0., 0.),
            corner(1., 0.5, 0.5),
            corner(-1., 0., 0.),
            corner(-1., -0.5, 0.5),
        ];
        let mut complex = Complex::new(points, vec![[0, 2, 3, 1], [0, 4, 5, 1]], 1.0);
        assert_eq!(crowded_edges(&complex), [[0, 1]]);
        assert_eq!(mend(&mut complex), Mended { doubled: 2, ..Mended::default() });
        assert!(crowded_edges(&complex).is_empty());
        assert_eq!(complex.points.len(), 8);
        // Each moves by 0.08 lattice constants into its tet, which both lean along the edge.
        assert!(complex.alive().all(|tet| complex.length(tet) > 0.0));
        for (point, twin) in [(0, 6), (1, 7)] {
            assert!((complex.points[point] - complex.points[twin]).norm() > 0.1);
        }
    }

    /// A ring of tets round an edge without two opposite ones: its ends hold the halves together.
    #[test]
    fn an_edge_between_halves_that_hang_together_elsewhere_is_halved() {
        let around = |at: usize| {
            let (sine, cosine) = (at as f64 * std::f64::consts::FRAC_PI_3).sin_cos();
            Vector3::new(cosine, sine, 0.5)
        };
        let mut points = vec![Vector3::zeros(), Vector3::z()];
        points.extend((0..6).map(around));
        // Above and below, full rings.
        points.extend([Vector3::new(0.0, 0.0, 2.0), Vector3::new(0.0, 0.0, -1.0)]);
        let ring = |at: u32| 2 + at % 6;
        let mut tets: Vec<[u32; 4]> =
            (0..6).filter(|at| at % 3 != 0).map(|at| [0, ring(at), ring(at + 1), 1]).collect();
        tets.extend((0..6).map(|at| [1, ring(at), ring(at + 1), 8]));
        tets.extend((0..6).map(|at| [9, ring(at), ring(at + 1), 0]));
        let mut complex = Complex::new(points, tets, 1.0);
        // The edges opposite to it hold rings together likewise, above and below.
        assert_eq!(crowded_edges(&complex), [[0, 1], [2, 3], [5, 6]]);
        let mended = mend(&mut complex);
        assert_eq!(mended.halved, 3);
        assert!(crowded_edges(&complex).is_empty());
        assert!(complex.alive().all(|tet| complex.length(tet) > 0.0));
    }

    /// The wedges of a plate between two cones that meet at its middle, each of two tets.
    fn plate() -> Complex {
        let around = |at: usize, height: f64| {
            let (sine, cosine) = (at as f64 * std::f64::consts::FRAC_PI_3).sin_cos();
            Vector3::new(cosine, sine, height)
        };
        let mut points = vec![Vector3::zeros()];
        points.extend((0..6).map(|at| around(at, 0.4)));
        points.extend((0..6).map(|at| around(at, -0.4)));
        let (top, low) = (|at: u32| 1 + at % 6, |at: u32| 7 + at % 6);
        let wedge = |at: u32| [[0, low(at), low(at + 1), top(at + 1)], [0, low(at), top(at + 1), top(at)]];
        Complex::new(points, (0..6).flat_map(wedge).collect(), 1.0)
    }

    #[test]
    fn a_boundary_that_meets_itself_in_a_point_is_parted() {
        let mut complex = plate();
        assert!(complex.alive().all(|tet| complex.length(tet) > 0.0));
        assert!(crowded_edges(&complex).is_empty());
        assert_eq!(pinched_points(&complex), [0]);
        assert_eq!(mend(&mut complex).parted, 1);
        assert!(pinched_points(&complex).is_empty());
        assert!(complex.alive().all(|tet| complex.length(tet) > 0.0));
        assert_eq!(complex.alive().count(), 12 + 6);
    }

    /// A plate where no cap fits: a hole joins the cones.
    #[test]
    fn a_point_that_is_taken_off_leaves_a_hole() {
        let mut complex = plate();
        dig(&mut complex, 0);
        assert!(complex.star[0].is_empty() && complex.sides[0] == 0);
        assert!(crowded_edges(&complex).is_empty() && pinched_points(&complex).is_empty());
        assert!(complex.alive().all(|tet| complex.length(tet) > 0.0));
        assert_eq!(crate::report::soundness::euler_number(&complex.outer_faces()), 0);
    }
}
