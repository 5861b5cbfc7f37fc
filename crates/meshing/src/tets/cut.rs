//! Cuts a mesh along a surface: separates inner materials from the whole body, and opens gaps bridged by
//! edges with both ends inside. Points near the surface first move onto it. Then every edge that still
//! crosses it is halved there, the longest first. The mesh stays conforming in any order, and no edge crosses
//! the surface afterwards.

use pliant_geometry::Vector3;

use crate::input::field::ImplicitField;
use crate::input::surfaces::Surfaces;
use crate::tets::complex::{Complex, OUTSIDE};

/// Bisections of an edge to find its intersection with a surface.
const BISECTIONS: u32 = 24;

/// A cut nearer to an end than this part of its edge moves that end, if it may move.
const ALPHA: f64 = 0.35;

/// A cut nearer to an end that may not move than this part of its edge counts as that end.
const AT_END: f64 = 0.1;

/// Moving a point onto the surface must leave its tets this part of the ideal acoustic length.
const LEAST_AFTER_MOVE: f64 = 0.2;

/// An edge bridges a gap if the field falls below minus this fraction of the lattice constant along
/// it.
const GAP: f64 = 0.1;

/// Largest distance from the first material, in lattice constants, at which it keeps a tet that no cut gave
/// to a material.
const FAR: f64 = 0.25;

/// Crossing of a surface and an edge.
struct EdgeCrossing {
    edge: [u32; 2],
    /// Fraction of the way from the first end.
    at: f64,
    length: f64,
}

/// Separates all materials except the first.
pub(crate) fn cut_materials(complex: &mut Complex, surfaces: &Surfaces<'_>) {
    for material in 2..=surfaces.materials() {
        let inside = |point: &Vector3| surfaces.inside(material, point);
        let values = complex.points.iter().map(inside).collect();
        let sides = Surface { inside: &inside }.cut(complex, values);
        let taken = sides.into_iter().filter(|(_, side)| *side > 0.0).map(|(tet, _)| (tet, material));
        give(complex, taken.collect());
    }
    // Flat tets where many materials meet can have a side of no material; the first one may be far away.
    let lost = |&tet: &u32| {
        let centre = complex.corners(tet).iter().sum::<Vector3>() / 4.0;
        (complex.material[tet as usize] == 1 && surfaces.inside(1, &centre) < -FAR * surfaces.edge())
            .then(|| (tet, surfaces.deepest(&centre)))
    };
    let lost = complex.alive().filter_map(|tet| lost(&tet)).collect();
    give(complex, lost);
}

/// Gives tets to materials.
fn give(complex: &mut Complex, tets: Vec<(u32, usize)>) {
    let mut points: Vec<u32> = tets.iter().flat_map(|&(tet, _)| complex.tets[tet as usize]).collect();
    points.sort_unstable();
    points.dedup();
    for (tet, material) in tets {
        complex.material[tet as usize] = material as u8;
    }
    complex.find_sides_of(&points);
}

/// Removes the part outside a body.
pub(crate) fn cut_outside(complex: &mut Complex, field: &dyn ImplicitField) {
    let inside = |point: &Vector3| field.value(point);
    let values = complex.points.iter().map(inside).collect();
    for (tet, side) in (Surface { inside: &inside }).cut(complex, values) {
        if side <= 0.0 {
            complex.remove(tet);
        }
    }
    complex.find_sides();
}

/// Cuts out gaps between banks of the body that edges of the mesh bridge. Returns the number of such edges.
pub(crate) fn cut_gaps(complex: &mut Complex, field: &dyn ImplicitField) -> usize {
    let inside = |point: &Vector3| field.value(point);
    let mut values: Vec<f64> = complex.points.iter().map(inside).collect();
    let deepest = |[p, q]: [u32; 2]| {
        let [p, q] = [p, q].map(|point| complex.points[point as usize]);
        // From the middle outwards, so the one nearest to it wins among equal depths.
        let samples = [4, 3, 5, 2, 6, 1, 7].map(|eighths| p.lerp(&q, f64::from(eighths) / 8.0));
        let depths = samples.map(|point| (inside(&point), point));
        depths.into_iter().fold(depths[0], |least, other| if other.0 < least.0 { other } else { least })
    };
    let mut bridges: Vec<([u32; 2], f64, Vector3)> = Vec::new();
    for ends in complex.edges() {
        let (value, point) = deepest(ends);
        let [p, q] = ends.map(|end| complex.size[end as usize]);
        if value < -GAP * p.max(q) {
            bridges.push((ends, value, point));
        }
    }
    bridges.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    let count = bridges.len();
    if count == 0 {
        return 0;
    }
    for (ends, value, point) in bridges {
        complex.bisect(ends, point);
        values.push(value);
    }
    // Boundary points lie on the surface up to round-off.
    for ((value, sides), size) in values.iter_mut().zip(&complex.sides).zip(&complex.size) {
        if sides & OUTSIDE != 0 && value.abs() < 1e-6 * size {
            *value = 0.0;
        }
    }
    for (tet, side) in (Surface { inside: &inside }).cut(complex, values) {
        if side < 0.0 {
            complex.remove(tet);
        }
    }
    complex.find_sides();
    count
}

/// The zero surface of a function.
struct Surface<'a> {
    inside: &'a dyn Fn(&Vector3) -> f64,
}

impl Surface<'_> {
    /// Cuts the mesh along the surface, given the function at its points. Returns the side of each tet:
    /// positive inside.
    fn cut(&self, complex: &mut Complex, mut values: Vec<f64>) -> Vec<(u32, f64)> {
        self.move_points(complex, &mut values);
        let mut crossings = self.crossings(complex, &values);
        for crossing in &crossings {
            // Ends that could not be moved.
            if let Some(end) = crossing.near_end(AT_END) {
                values[crossing.edge[end] as usize] = 0.0;
            }
        }
        crossings.retain(|crossing| crossing.edge.iter().all(|&end| values[end as usize] != 0.0));
        crossings.sort_by(|a, b| b.length.total_cmp(&a.length).then(a.edge.cmp(&b.edge)));
        for EdgeCrossing { edge: [p, q], at, .. } in crossings {
            let position = complex.points[p as usize].lerp(&complex.points[q as usize], at);
            complex.bisect([p, q], position);
            values.push(0.0);
        }
        let side = |tet: u32| match complex.tets[tet as usize]
            .iter()
            .map(|&node| values[node as usize])
            .sum::<f64>()
        {
            0.0 => (self.inside)(&(complex.corners(tet).iter().sum::<Vector3>() / 4.0)),
            sum => sum,
        };
        complex.alive().map(|tet| (tet, side(tet))).collect()
    }

    /// Edges that cross the surface, and their intersections.
    fn crossings(&self, complex: &Complex, values: &[f64]) -> Vec<EdgeCrossing> {
        let crossed = |[p, q]: &[u32; 2]| values[*p as usize] * values[*q as usize] < 0.0;
        let mut edges: Vec<[u32; 2]> =
            complex.alive().flat_map(|tet| complex.edges_of(tet)).filter(crossed).collect();
        edges.sort_unstable();
        edges.dedup();
        edges.into_iter().map(|edge| self.crossing(complex, edge, values)).collect()
    }

    fn crossing(&self, complex: &Complex, edge: [u32; 2], values: &[f64]) -> EdgeCrossing {
        let [start, end] = edge.map(|point| complex.points[point as usize]);
        let begins_inside = values[edge[0] as usize] > 0.0;
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if ((self.inside)(&start.lerp(&end, middle)) > 0.0) == begins_inside {
                low = middle;
            } else {
                high = middle;
            }
        }
        EdgeCrossing { edge, at: 0.5 * (low + high), length: (end - start).norm() }
    }

    /// Moves each free point that is near a crossing to its nearest one, if the quality of its tets allows
    /// that.
    fn move_points(&self, complex: &mut Complex, values: &mut [f64]) {
        let mut nearest: Vec<Option<(f64, Vector3)>> = vec![None; complex.points.len()];
        for crossing in self.crossings(complex, values) {
            if let Some(end) = crossing.near_end(ALPHA) {
                let [p, q] = crossing.edge.map(|point| complex.points[point as usize]);
                let to = p.lerp(&q, crossing.at);
                let distance = (to - [p, q][end]).norm();
                let best = &mut nearest[crossing.edge[end] as usize];
                if best.is_none_or(|(least, _)| distance < least) {
                    *best = Some((distance, to));
                }
            }
        }
        for (point, (_, to)) in
            nearest.into_iter().enumerate().filter_map(|(point, best)| Some((point, best?)))
        {
            let free = complex.sides[point].count_ones() == 1 && complex.sides[point] & OUTSIDE == 0;
            let before = std::mem::replace(&mut complex.points[point], to);
            let bears = || complex.star[point].iter().all(|&tet| complex.part(tet) > LEAST_AFTER_MOVE);
            if free && bears() {
                values[point] = 0.0;
            } else {
                complex.points[point] = before;
            }
        }
    }
}

impl EdgeCrossing {
    /// The end that the crossing is near to.
    fn near_end(&self, part: f64) -> Option<usize> {
        if self.at < part {
            Some(0)
        } else if 1.0 - self.at < part {
            Some(1)
        } else {
            None
        }
    }
}
