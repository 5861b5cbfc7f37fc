//! Finds the cell that contains a point and the weights of its nodes: p = Σ w_a X_a. For a point outside all
//! cells, the closest cell is extrapolated. A tet extrapolates with its own (barycentric) coordinates. A hex
//! inverts its trilinear map by Newton's method. Outside, it takes the weights N_a(ξ) of its closest point
//! and adds B_a · (p − X(ξ)) with its mean gradients B_a. These weights stay bounded where the trilinear map
//! itself folds over. They are as exact: Σ_a X_a ⊗ B_a = I, so linear fields are reproduced everywhere.

use rstar::{AABB, PointDistance, RTree, RTreeObject};

use crate::cell::{
    CellId, HEX_CORNERS, corners, faces, hex_local_gradients, hex_tangents, hex_weights, is_finite,
};
use crate::quality::gradient_integrals;
use crate::{CellKind, Mesh, Vector3};

/// Points closer to a cell than this part of its size are inside, and cells whose distances differ by less
/// are equally close.
const ROUNDING: f64 = 1e-12;
/// Cells of less volume than this part of the cube of their size can't give weights and are left out.
const FLAT: f64 = 1e-14;

/// Position of a point in a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Location {
    /// Shape of the cell.
    pub kind: CellKind,
    /// The cell's index within the block of its kind.
    pub cell: u32,
    /// Weights of the cell's nodes, the first `kind.node_count()` of eight. Their sum is 1 and the weighted
    /// sum of the node positions is the point. Inside the cell all are from 0 to 1 (up to rounding), outside
    /// not.
    pub weights: [f64; 8],
    /// Distance to the cell [m], 0 inside.
    pub distance: f64,
}

impl Location {
    /// The cell.
    pub fn id(&self) -> CellId {
        CellId { kind: self.kind, index: self.cell }
    }

    /// The weights in use, one per node of the cell.
    pub fn weights(&self) -> &[f64] {
        &self.weights[..self.kind.node_count()]
    }
}

/// A search tree over the tets and hexes of a mesh, with its own copy of their data. Outside the mesh, the
/// weights of the closest cell continue linearly. For a tet these are its barycentric coordinates. For a hex
/// they are the weights at its closest point, plus its mean gradients times the offset from there. Cells with
/// missing or non-finite nodes and cells without volume are skipped.
#[derive(Clone, Debug)]
pub struct Locator {
    tree: RTree<Entry>,
}

/// One cell in the tree.
#[derive(Clone, Debug)]
struct Entry {
    id: CellId,
    /// Positions of its nodes [m], the first `node_count` of eight.
    corners: [Vector3; 8],
}

impl RTreeObject for Entry {
    type Envelope = AABB<[f64; 3]>;

    fn envelope(&self) -> Self::Envelope {
        let (low, high) = self.bounds();
        AABB::from_corners(low.into(), high.into())
    }
}

impl PointDistance for Entry {
    fn distance_2(&self, point: &[f64; 3]) -> f64 {
        let p = Vector3::from(*point);
        let (low, high) = self.bounds();
        (p.sup(&low).inf(&high) - p).norm_squared()
    }
}

impl Locator {
    /// Sorts the volume cells of `mesh` into a tree; n log n.
    pub fn new(mesh: &Mesh) -> Self {
        let mut entries = Vec::new();
        for block in mesh.volume_blocks() {
            for (index, nodes) in (0u32..).zip(block.cells()) {
                let mut buffer = [Vector3::zeros(); 8];
                if corners(&mesh.points, nodes, &mut buffer).is_some() {
                    entries.push(Entry { id: CellId { kind: block.kind, index }, corners: buffer });
                }
            }
        }
        entries.retain(|entry| {
            let volume = gradient_integrals(entry.id.kind, entry.points()).0;
            volume.is_finite() && volume.abs() > FLAT * entry.size().powi(3)
        });
        Self { tree: RTree::bulk_load(entries) }
    }

    /// The cell that contains `point` [m], otherwise the closest one; `None` without cells or if the point is
    /// not finite. On a face between cells it is the first cell. Among equally close cells it is the one with
    /// the smallest extrapolation, then the first. Tets come before hexes.
    pub fn locate(&self, point: Vector3) -> Option<Location> {
        if !is_finite(&point) {
            return None;
        }
        let mut best: Option<Candidate> = None;
        // Ordered by the distance of the box, a lower bound for the distance of the cell. After the first box
        // that is too far, all others are.
        for (entry, box_distance_2) in self.tree.nearest_neighbor_iter_with_distance_2(point.into()) {
            if best.as_ref().is_some_and(|b| box_distance_2.sqrt() > b.distance + b.tolerance) {
                break;
            }
            let candidate = entry.locate(&point);
            if best.as_ref().is_none_or(|best| candidate.beats(best)) {
                best = Some(candidate);
            }
        }
        let Candidate { id, weights, distance, .. } = best?;
        Some(Location { kind: id.kind, cell: id.index, weights, distance })
    }
}

/// The result of one cell for a point.
struct Candidate {
    id: CellId,
    weights: [f64; 8],
    distance: f64,
    /// Distances that differ less are equal [m].
    tolerance: f64,
}

impl Candidate {
    fn beats(&self, other: &Self) -> bool {
        let tolerance = self.tolerance.max(other.tolerance);
        if (self.distance - other.distance).abs() > tolerance {
            return self.distance < other.distance;
        }
        let extrapolates = |c: &Self| if c.distance == 0.0 { 0.0 } else { -least(&c.weights) };
        let (mine, theirs) = (extrapolates(self), extrapolates(other));
        if (mine - theirs).abs() > ROUNDING { mine < theirs } else { self.id < other.id }
    }
}

fn least(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min)
}

impl Entry {
    fn points(&self) -> &[Vector3] {
        &self.corners[..self.id.kind.node_count()]
    }

    fn bounds(&self) -> (Vector3, Vector3) {
        let first = self.corners[0];
        self.points().iter().fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)))
    }

    /// Diagonal of its box [m].
    fn size(&self) -> f64 {
        let (low, high) = self.bounds();
        (high - low).norm()
    }

    fn locate(&self, p: &Vector3) -> Candidate {
        let (weights, distance) = match self.id.kind {
            CellKind::Tet => self.locate_in_tet(p),
            _ => self.locate_in_hex(p),
        };
        Candidate { id: self.id, weights, distance, tolerance: ROUNDING * self.size() }
    }

    /// Adds B_a · (p − Σ w_a X_a) to the weights, twice: the second time it removes the rounding of the
    /// first. The sum of the weights stays 1.
    fn correct(&self, p: &Vector3, weights: &mut [f64; 8]) {
        let (volume, integrals) = gradient_integrals(self.id.kind, self.points());
        for _ in 0..2 {
            let reached: Vector3 = self.points().iter().zip(&*weights).map(|(x, w)| x * *w).sum();
            let rest = (p - reached) / volume;
            for (weight, b) in weights.iter_mut().zip(&integrals) {
                *weight += b.dot(&rest);
            }
        }
    }

    fn locate_in_tet(&self, p: &Vector3) -> ([f64; 8], f64) {
        let mut weights = [0.25, 0.25, 0.25, 0.25, 0.0, 0.0, 0.0, 0.0];
        self.correct(p, &mut weights);
        if least(&weights[..4]) >= -ROUNDING {
            return (weights, 0.0);
        }
        let triangles = faces(CellKind::Tet).iter().map(|face| [face[0], face[1], face[2]]);
        let distance = triangles
            .map(|triangle| {
                let x = triangle.map(|a| self.corners[a]);
                (on_triangle(&x, barycentric_of_closest(&x, p)) - p).norm()
            })
            .fold(f64::INFINITY, f64::min);
        (weights, distance)
    }

    fn locate_in_hex(&self, p: &Vector3) -> ([f64; 8], f64) {
        let size = self.size();
        let (low, high) = self.bounds();
        let slack = Vector3::repeat(ROUNDING * size);
        let in_box = (p - low + slack).min() >= 0.0 && (high - p + slack).min() >= 0.0;
        let inside = if in_box { self.invert(p) } else { None };
        let (xi, distance) = match inside {
            Some(xi) => (xi, 0.0),
            None => self.closest_on_hex(p),
        };
        let mut weights = hex_weights(&xi);
        self.correct(p, &mut weights);
        (weights, distance)
    }

    /// Position of the natural coordinates ξ.
    fn map(&self, xi: &Vector3) -> Vector3 {
        self.corners.iter().zip(hex_weights(xi)).map(|(x, w)| x * w).sum()
    }

    /// Natural coordinates of a point inside; `None` outside.
    fn invert(&self, p: &Vector3) -> Option<Vector3> {
        let centre = Vector3::zeros();
        if let Some(xi) = self.newton(p, centre, f64::INFINITY) {
            return (xi.amax() <= 1.0 + 10.0 * ROUNDING).then(|| clamped(xi));
        }
        // Far from a box, Newton's method may leave the cell and not come back: hold it inside and try from
        // the middle of each octant.
        HEX_CORNERS.iter().find_map(|&corner| self.newton(p, Vector3::from(corner) / 2.0, 1.0))
    }

    /// Newton's method for X(ξ) = p with each coordinate held within ± `limit`; `None` without convergence.
    fn newton(&self, p: &Vector3, mut xi: Vector3, limit: f64) -> Option<Vector3> {
        const ITERATIONS: usize = 30;
        let close = ROUNDING * self.size();
        for _ in 0..ITERATIONS {
            let rest = p - self.map(&xi);
            if rest.norm() <= close {
                return Some(xi);
            }
            let [u, v, w] = hex_tangents(&self.corners, &hex_local_gradients(&xi));
            let det = u.dot(&v.cross(&w));
            let step =
                Vector3::new(rest.dot(&v.cross(&w)), rest.dot(&w.cross(&u)), rest.dot(&u.cross(&v))) / det;
            if !step.amax().is_finite() || xi.amax() > 1e3 {
                return None;
            }
            xi += step;
            xi.apply(|x| *x = x.clamp(-limit, limit));
        }
        None
    }

    /// Natural coordinates of the point of the hex's faces closest to `p`, and its distance [m].
    fn closest_on_hex(&self, p: &Vector3) -> (Vector3, f64) {
        let mut best = (Vector3::zeros(), f64::INFINITY);
        for face in faces(CellKind::Hex) {
            let on_face = self.closest_on_face(face, p);
            if on_face.1 < best.1 {
                best = on_face;
            }
        }
        best
    }

    /// Finds the closest point of one face. It starts from the closest point of four triangles around the
    /// centre. Gauss–Newton steps on the bilinear face follow, as long as they come closer.
    fn closest_on_face(&self, face: &[usize], p: &Vector3) -> (Vector3, f64) {
        let ring = [face[0], face[1], face[2], face[3]];
        let xi_centre = ring.iter().map(|&a| Vector3::from(HEX_CORNERS[a])).sum::<Vector3>() / 4.0;
        let centre = self.map(&xi_centre);
        let mut best = (Vector3::zeros(), f64::INFINITY);
        for at in 0..4 {
            let (a, b) = (ring[at], ring[(at + 1) % 4]);
            let weights = barycentric_of_closest(&[centre, self.corners[a], self.corners[b]], p);
            let naturals = [xi_centre, Vector3::from(HEX_CORNERS[a]), Vector3::from(HEX_CORNERS[b])];
            let xi = on_triangle(&naturals, weights);
            let distance = (self.map(&xi) - p).norm();
            if distance < best.1 {
                best = (xi, distance);
            }
        }
        // The coordinate that stays fixed on the face is the one that is not 0 at its centre.
        let fixed = xi_centre.iamax();
        let (i, j) = ((fixed + 1) % 3, (fixed + 2) % 3);
        for _ in 0..10 {
            let (mut xi, before) = best;
            let tangents = hex_tangents(&self.corners, &hex_local_gradients(&xi));
            let rest = p - self.map(&xi);
            let [di, dj] = step_in_square([tangents[i], tangents[j]], rest, [xi[i], xi[j]]);
            (xi[i], xi[j]) = (xi[i] + di, xi[j] + dj);
            let xi = clamped(xi);
            let after = (self.map(&xi) - p).norm();
            if after.is_nan() || after >= before {
                break;
            }
            best = (xi, after);
            if before - after <= ROUNDING * before {
                break;
            }
        }
        best
    }
}

/// The step (a, b) that minimises |rest − a u − b v|² for a coordinate pair in [−1, 1]². A coordinate at its
/// limit that would leave stays, and the other one moves alone.
fn step_in_square([u, v]: [Vector3; 2], rest: Vector3, at: [f64; 2]) -> [f64; 2] {
    let (uu, uv, vv) = (u.dot(&u), u.dot(&v), v.dot(&v));
    let (ru, rv) = (rest.dot(&u), rest.dot(&v));
    let det = uu * vv - uv * uv;
    let both = [(ru * vv - rv * uv) / det, (rv * uu - ru * uv) / det];
    let leaves = |axis: usize| at[axis].abs() >= 1.0 && at[axis] * both[axis] > 0.0;
    let alone = |r: f64, length_2: f64| if length_2 > 0.0 { r / length_2 } else { 0.0 };
    match (leaves(0) || !both[0].is_finite(), leaves(1) || !both[1].is_finite()) {
        (false, false) => both,
        (true, false) => [0.0, alone(rv, vv)],
        (false, true) => [alone(ru, uu), 0.0],
        (true, true) => [alone(ru, uu), alone(rv, vv)],
    }
}

/// With each coordinate held in [−1, 1].
fn clamped(xi: Vector3) -> Vector3 {
    xi.map(|x| x.clamp(-1.0, 1.0))
}

/// Σ w_a x_a.
pub(crate) fn on_triangle(x: &[Vector3; 3], weights: [f64; 3]) -> Vector3 {
    x[0] * weights[0] + x[1] * weights[1] + x[2] * weights[2]
}

/// Barycentric coordinates of the point of a triangle closest to `p`. It is on the corner, edge or face in
/// whose Voronoi region `p` lies (Ericson, Real-Time Collision Detection, 2005, section 5.1.5).
pub fn barycentric_of_closest([a, b, c]: &[Vector3; 3], p: &Vector3) -> [f64; 3] {
    let (ab, ac) = (b - a, c - a);
    let from = |x: &Vector3| (ab.dot(&(p - x)), ac.dot(&(p - x)));
    let part = |x: f64, of: f64| if of > 0.0 { x / of } else { 0.0 };
    let (d1, d2) = from(a);
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let (d3, d4) = from(b);
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = part(d1, d1 - d3);
        return [1.0 - t, t, 0.0];
    }
    let (d5, d6) = from(c);
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = part(d2, d2 - d6);
        return [1.0 - t, 0.0, t];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let t = part(d4 - d3, (d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - t, t];
    }
    let sum = va + vb + vc;
    let (v, w) = (part(vb, sum), part(vc, sum));
    [1.0 - v - w, v, w]
}

#[cfg(test)]
mod tests {
    use super::*;
    use pliant_testing::Random;

    use crate::testing::{UNIT_CUBE, block_of_hexes, block_of_tets, noise, points};

    /// A block 4 × 3 × 3 with every node moved by up to `amount` in each direction.
    fn distorted(mut mesh: Mesh, amount: f64) -> Mesh {
        let mut random = Random::new(7);
        for point in &mut mesh.points {
            *point += noise(&mut random) * amount;
        }
        mesh
    }

    fn meshes() -> [Mesh; 4] {
        let cells = [4, 3, 3];
        [
            block_of_hexes(cells),
            block_of_tets(cells),
            distorted(block_of_hexes(cells), 0.2),
            distorted(block_of_tets(cells), 0.2),
        ]
    }

    fn nodes_of<'m>(mesh: &'m Mesh, location: &Location) -> &'m [u32] {
        mesh.block(location.kind).unwrap().cell(location.cell as usize)
    }

    fn reproduces(mesh: &Mesh, location: &Location, p: &Vector3) {
        let x = nodes_of(mesh, location).iter().map(|&node| mesh.points[node as usize]);
        let reached: Vector3 = x.zip(location.weights()).map(|(x, w)| x * *w).sum();
        let sum: f64 = location.weights().iter().sum();
        assert!((reached - p).norm() <= 1e-12 * p.norm().max(1.0), "{reached} instead of {p}");
        assert!((sum - 1.0).abs() < 1e-12);
    }

    #[test]
    fn weights_reproduce_every_point_inside_and_outside() {
        for mesh in meshes() {
            let locator = Locator::new(&mesh);
            let mut random = Random::new(8);
            for _ in 0..500 {
                let p = Vector3::new(2.0, 1.5, 1.5) + noise(&mut random) * 4.0;
                let location = locator.locate(p).unwrap();
                reproduces(&mesh, &location, &p);
                assert!(location.distance > 0.0 || least(location.weights()) >= -1e-11);
            }
        }
    }

    #[test]
    fn a_point_made_in_a_cell_is_found_there() {
        for mesh in meshes() {
            let locator = Locator::new(&mesh);
            let mut random = Random::new(9);
            let block = &mesh.blocks[0];
            for (index, nodes) in block.cells().enumerate() {
                let x: Vec<Vector3> = nodes.iter().map(|&node| mesh.points[node as usize]).collect();
                for _ in 0..20 {
                    let weights: Vec<f64> = match block.kind {
                        CellKind::Hex => hex_weights(&(noise(&mut random) * 0.999)).to_vec(),
                        _ => {
                            let raw: Vec<f64> = (0..4).map(|_| random.number().abs() + 1e-3).collect();
                            raw.iter().map(|w| w / raw.iter().sum::<f64>()).collect()
                        }
                    };
                    let p: Vector3 = x.iter().zip(&weights).map(|(x, w)| x * *w).sum();
                    let location = locator.locate(p).unwrap();
                    assert_eq!((location.cell as usize, location.distance), (index, 0.0));
                    for (found, made) in location.weights().iter().zip(&weights) {
                        assert!((found - made).abs() < 1e-9, "{location:?} {weights:?}");
                    }
                }
            }
        }
    }

    /// The distance of every cell, without the tree: slow and simple.
    #[test]
    fn closest_cell_outside_is_the_one_of_brute_force() {
        for mesh in meshes() {
            let locator = Locator::new(&mesh);
            let entries: Vec<&Entry> = locator.tree.iter().collect();
            let mut random = Random::new(10);
            for _ in 0..300 {
                let p = Vector3::new(2.0, 1.5, 1.5) + noise(&mut random) * 6.0;
                let found = locator.locate(p).unwrap().distance;
                let least = entries.iter().map(|e| e.locate(&p).distance).fold(f64::INFINITY, f64::min);
                assert!((found - least).abs() <= 1e-11);
            }
        }
    }

    #[test]
    fn distance_agrees_with_sampling() {
        let mut random = Random::new(11);
        for mesh in meshes() {
            let locator = Locator::new(&mesh);
            let entry = locator.tree.iter().next().unwrap();
            for _ in 0..20 {
                let p = entry.corners[0] + noise(&mut random) * 3.0;
                let distance = entry.locate(&p).distance;
                let mut sampled = f64::INFINITY;
                for i in 0..=40 {
                    for j in 0..=40 {
                        for k in 0..=40 {
                            let t = [i, j, k].map(|n: i32| f64::from(n) / 40.0);
                            let x = match entry.id.kind {
                                CellKind::Hex => entry.map(&Vector3::from(t.map(|t| 2.0 * t - 1.0))),
                                _ if t.iter().sum::<f64>() <= 1.0 => {
                                    let c = entry.corners;
                                    c[0] + (c[1] - c[0]) * t[0] + (c[2] - c[0]) * t[1] + (c[3] - c[0]) * t[2]
                                }
                                _ => continue,
                            };
                            sampled = sampled.min((x - p).norm());
                        }
                    }
                }
                // Samples are at most 1/20 of a cell apart; inside the sample is not the point itself.
                assert!(distance <= sampled + 1e-12 && sampled <= distance + 0.06, "{distance} {sampled}");
            }
        }
    }

    #[test]
    fn linear_fields_are_continued_outside() {
        for mesh in meshes() {
            let locator = Locator::new(&mesh);
            let slope = Vector3::new(0.3, -2.0, 1.0);
            let p = Vector3::new(-1.0, 5.0, 1.3);
            let location = locator.locate(p).unwrap();
            let nodes = nodes_of(&mesh, &location).iter();
            let value: f64 =
                nodes.zip(location.weights()).map(|(&n, w)| w * slope.dot(&mesh.points[n as usize])).sum();
            assert!((value - slope.dot(&p)).abs() < 1e-11);
        }
    }

    #[test]
    fn nodes_and_face_points_belong_to_the_first_cell() {
        let mesh = block_of_hexes([2, 1, 1]);
        let locator = Locator::new(&mesh);
        let on_face = locator.locate(Vector3::new(1.0, 0.5, 0.5)).unwrap();
        assert_eq!((on_face.cell, on_face.distance), (0, 0.0));
        let beyond = locator.locate(Vector3::new(1.0, 0.5, 3.0)).unwrap();
        assert_eq!((beyond.cell, beyond.distance), (0, 2.0));
        for (node, point) in mesh.points.iter().enumerate() {
            let location = locator.locate(*point).unwrap();
            let at = nodes_of(&mesh, &location).iter().position(|&n| n as usize == node).unwrap();
            assert!((location.weights[at] - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn collapsed_and_twisted_hexes_are_survived() {
        let mut mesh = block_of_hexes([1, 1, 1]);
        mesh.points = points(&UNIT_CUBE);
        for nodes in [[0, 1, 2, 2, 4, 5, 6, 6], [0, 1, 2, 3, 4, 5, 7, 6], [0, 1, 2, 3, 5, 6, 7, 4]] {
            mesh.blocks[0].nodes = nodes.to_vec();
            let locator = Locator::new(&mesh);
            let mut random = Random::new(12);
            for _ in 0..200 {
                let p = noise(&mut random) * 2.0;
                let location = locator.locate(p).unwrap();
                assert!(location.distance.is_finite());
                reproduces(&mesh, &location, &p);
            }
        }
    }

    #[test]
    fn nothing_is_found_without_cells_or_without_a_point() {
        assert_eq!(Locator::new(&Mesh::default()).locate(Vector3::zeros()), None);
        let mesh = block_of_tets([1, 1, 1]);
        assert_eq!(Locator::new(&mesh).locate(Vector3::new(0.0, f64::NAN, 0.0)), None);
        let mut flat = mesh.clone();
        flat.points.iter_mut().for_each(|p| p.z = 0.0);
        assert_eq!(Locator::new(&flat).locate(Vector3::zeros()), None);
    }

    #[test]
    fn tets_come_before_hexes() {
        let mut mesh = block_of_hexes([1, 1, 1]);
        mesh.points.push(Vector3::new(0.5, 0.5, 2.0));
        mesh.block_mut(CellKind::Tet).nodes.extend([4, 5, 6, 8, 4, 6, 7, 8]);
        let location = Locator::new(&mesh).locate(Vector3::new(0.7, 0.2, 1.0)).unwrap();
        assert_eq!(location.id(), CellId { kind: CellKind::Tet, index: 0 });
    }
}
