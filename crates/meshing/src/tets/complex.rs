//! A tetrahedral mesh under modification: points move, edges collapse or are halved, tets are removed. Each
//! point stores its tets and its *sides*: the materials of its tets, and the outside if it is on the
//! boundary. A point with two sides lies on a surface, with three on a line, with four it is a corner.

use pliant_geometry::Vector3;

/// A removed tet.
const GONE: [u32; 4] = [u32::MAX; 4];

/// Stands for the outside in links: every boundary face is joined with it to a tet.
const GHOST: u32 = u32::MAX;

/// Faces of a tet, outward, each opposite to the corner of its number.
const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// The sides at a point: bit 0 the outside, bit m the material m.
pub(crate) type Sides = u128;

/// The outside as a side.
pub(crate) const OUTSIDE: Sides = 1;

/// The materials among some sides, increasing.
pub(crate) fn materials_of(sides: Sides) -> impl Iterator<Item = usize> {
    let mut left = sides & !OUTSIDE;
    std::iter::from_fn(move || {
        let next = (left != 0).then(|| left.trailing_zeros() as usize)?;
        left &= left - 1;
        Some(next)
    })
}

/// Most materials in a mesh.
pub const MOST_MATERIALS: usize = 127;

/// No step makes an edge longer than this many lattice constants.
pub(crate) const LONGEST: f64 = 1.6;

/// Tets, points and their connections.
#[derive(Clone)]
pub(crate) struct Complex {
    pub(crate) points: Vec<Vector3>,
    pub(crate) tets: Vec<[u32; 4]>,
    /// Material of each tet, from 1.
    pub(crate) material: Vec<u8>,
    /// The tets round each point.
    pub(crate) star: Vec<Vec<u32>>,
    pub(crate) sides: Vec<Sides>,
    /// Lattice constant round each point [m]: the intended length of edges there.
    pub(crate) size: Vec<f64>,
}

/// Acoustic length of a tet [m]: 6 V / (Σ (2 A_a)²)^(1/2), negative if inverted (see
/// `pliant_geometry::acoustic_length`).
#[inline]
pub(crate) fn acoustic_length(x: [Vector3; 4]) -> f64 {
    let [u, v, w] = [x[1] - x[0], x[2] - x[0], x[3] - x[0]];
    let [a, b, c] = [v.cross(&w), w.cross(&u), u.cross(&v)];
    let squares = a.norm_squared() + b.norm_squared() + c.norm_squared() + (a + b + c).norm_squared();
    if squares > 0.0 { u.dot(&a) / squares.sqrt() } else { 0.0 }
}

impl Complex {
    /// Builds a complex of tets of material 1, of a lattice of one constant [m].
    pub(crate) fn new(points: Vec<Vector3>, tets: Vec<[u32; 4]>, edge: f64) -> Self {
        let size = vec![edge; points.len()];
        Self::graded(points, tets, size)
    }

    /// Builds a complex of tets of material 1, of a lattice with its constant round each point [m].
    pub(crate) fn graded(points: Vec<Vector3>, tets: Vec<[u32; 4]>, size: Vec<f64>) -> Self {
        let mut star = vec![Vec::new(); points.len()];
        for (tet, nodes) in (0..).zip(&tets) {
            nodes.iter().for_each(|&node| star[node as usize].push(tet));
        }
        let mut complex =
            Self { material: vec![1; tets.len()], sides: vec![0; points.len()], points, tets, star, size };
        complex.find_sides();
        complex
    }

    /// Recomputes the sides of all points.
    pub(crate) fn find_sides(&mut self) {
        self.sides = (0..self.points.len() as u32).map(|point| self.sides_of(point)).collect();
    }

    /// Recomputes the sides of some points.
    pub(crate) fn find_sides_of(&mut self, points: &[u32]) {
        for &point in points {
            self.sides[point as usize] = self.sides_of(point);
        }
    }

    fn sides_of(&self, point: u32) -> Sides {
        let materials =
            self.star[point as usize].iter().fold(0, |sides, &tet| sides | 1 << self.material[tet as usize]);
        materials | if self.rim_of(point, |_| true).is_empty() { 0 } else { OUTSIDE }
    }

    /// The existing tets, in order.
    pub(crate) fn alive(&self) -> impl Iterator<Item = u32> {
        (0_u32..).zip(&self.tets).filter(|(_, nodes)| **nodes != GONE).map(|(tet, _)| tet)
    }

    pub(crate) fn is_alive(&self, tet: u32) -> bool {
        self.tets[tet as usize] != GONE
    }

    pub(crate) fn corners(&self, tet: u32) -> [Vector3; 4] {
        self.tets[tet as usize].map(|node| self.points[node as usize])
    }

    pub(crate) fn length(&self, tet: u32) -> f64 {
        acoustic_length(self.corners(tet))
    }

    /// Acoustic length of the ideal tet of the lattice round some points [m]: a / (2 √2), of the finest one.
    #[inline]
    pub(crate) fn ideal(&self, nodes: [u32; 4]) -> f64 {
        let [a, b, c, d] = nodes.map(|node| self.size[node as usize]);
        a.min(b).min(c.min(d)) / 8_f64.sqrt()
    }

    /// Acoustic length of a tet over the acoustic length of the ideal one.
    pub(crate) fn part(&self, tet: u32) -> f64 {
        self.length(tet) / self.ideal(self.tets[tet as usize])
    }

    /// Longest allowed length of an edge [m].
    pub(crate) fn longest(&self, p: u32, q: u32) -> f64 {
        LONGEST * self.size[p as usize].max(self.size[q as usize])
    }

    /// True if an edge between two points would be too long.
    pub(crate) fn is_too_long(&self, p: u32, q: u32) -> bool {
        (self.points[p as usize] - self.points[q as usize]).norm() > self.longest(p, q)
    }

    /// True if moving a point to `place` makes one of its edges too long, or lengthens one that already is.
    /// The edge to `without` does not count.
    pub(crate) fn stretches(&self, point: u32, place: &Vector3, without: u32) -> bool {
        let from = &self.points[point as usize];
        let stretched = |&node: &u32| {
            let to = &self.points[node as usize];
            let length = (place - to).norm();
            node != point && node != without && length > self.longest(point, node).max((from - to).norm())
        };
        self.star[point as usize].iter().flat_map(|&tet| &self.tets[tet as usize]).any(stretched)
    }

    /// True if an edge becomes too long when `gone` is joined into `kept` at `place`.
    pub(crate) fn overstretches(&self, gone: u32, kept: u32, place: &Vector3) -> bool {
        let too_long = |&node: &u32| {
            let length = (place - self.points[node as usize]).norm();
            node != gone && node != kept && length > self.longest(kept, node)
        };
        self.star[gone as usize].iter().flat_map(|&tet| &self.tets[tet as usize]).any(too_long)
            || self.stretches(kept, place, gone)
    }

    /// Faces of a tet, outward, in the order of the opposite corners.
    pub(crate) fn faces(&self, tet: u32) -> [[u32; 3]; 4] {
        FACES.map(|face| face.map(|corner| self.tets[tet as usize][corner]))
    }

    /// The tet behind a face of a tet.
    pub(crate) fn behind(&self, tet: u32, face: [u32; 3]) -> Option<u32> {
        let has = |other: &u32| face.iter().all(|node| self.tets[*other as usize].contains(node));
        self.star[face[0] as usize].iter().copied().find(|&other| other != tet && has(&other))
    }

    /// Edges, increasing, each once.
    pub(crate) fn edges(&self) -> Vec<[u32; 2]> {
        let mut edges = Vec::new();
        for tet in self.alive() {
            edges.extend(self.edges_of(tet));
        }
        distinct(edges)
    }

    /// The edges of a tet, each from the smaller point.
    pub(crate) fn edges_of(&self, tet: u32) -> [[u32; 2]; 6] {
        let [a, b, c, d] = self.tets[tet as usize];
        [[a, b], [a, c], [a, d], [b, c], [b, d], [c, d]].map(|[p, q]| [p.min(q), p.max(q)])
    }

    /// Least acoustic length of all tets as a part of the ideal one.
    pub(crate) fn worst(&self) -> f64 {
        self.alive().map(|tet| self.part(tet)).fold(f64::INFINITY, f64::min)
    }

    /// Acoustic length of a single point if it were at `place` [m]: 1 / √(K / m) for a wave speed of 1. K = Σ
    /// V |∇N|² is its stiffness and m = Σ V / 4 its mass, summed over its tets. A step above twice that is
    /// unstable, since K c² / m is a Rayleigh quotient of M⁻¹ K. In the ideal lattice it equals the acoustic
    /// length; points with few tets can have half of their tets' length.
    pub(crate) fn nodal_length(&self, point: u32, place: &Vector3) -> f64 {
        let (mut stiffness, mut mass) = (0.0, 0.0);
        for &tet in &self.star[point as usize] {
            let nodes = self.tets[tet as usize];
            let at = nodes.iter().position(|&node| node == point).unwrap_or(0);
            let [a, b, c] = FACES[at].map(|corner| self.points[nodes[corner] as usize]);
            let normal = (b - a).cross(&(c - a));
            // Six times the volume; |∇N| = 2 A / 6 V.
            let six = normal.dot(&(a - place)).abs();
            stiffness += normal.norm_squared() / (6.0 * six);
            mass += six / 24.0;
        }
        (mass / stiffness).sqrt()
    }

    /// The faces that only one tet has, outward, in the order of their sorted nodes.
    pub(crate) fn outer_faces(&self) -> Vec<[u32; 3]> {
        lone(self.alive().flat_map(|tet| self.faces(tet)).collect())
    }

    /// Faces round a point that only one of the chosen tets has, outward from it.
    pub(crate) fn rim_of(&self, point: u32, chosen: impl Fn(u32) -> bool) -> Vec<[u32; 3]> {
        let mut faces: Vec<[u32; 3]> = Vec::with_capacity(72);
        for &tet in self.star[point as usize].iter().filter(|&&tet| chosen(tet)) {
            faces.extend(self.faces(tet).into_iter().filter(|face| face.contains(&point)));
        }
        lone(faces)
    }

    /// Points joined to a point by an edge, increasing.
    pub(crate) fn neighbours(&self, point: u32) -> Vec<u32> {
        let tets = self.star[point as usize].iter();
        let mut neighbours: Vec<u32> =
            tets.flat_map(|&tet| self.tets[tet as usize]).filter(|&other| other != point).collect();
        neighbours.sort_unstable();
        neighbours.dedup();
        neighbours
    }

    /// Removes a tet.
    pub(crate) fn remove(&mut self, tet: u32) {
        for node in self.tets[tet as usize] {
            self.star[node as usize].retain(|&other| other != tet);
        }
        self.tets[tet as usize] = GONE;
    }

    /// Halves an edge at `position`: every tet round it becomes two. Returns the new point.
    pub(crate) fn bisect(&mut self, [p, q]: [u32; 2], position: Vector3) -> u32 {
        let new = self.points.len() as u32;
        self.points.push(position);
        self.star.push(Vec::new());
        self.sides.push(0);
        self.size.push(self.size[p as usize].min(self.size[q as usize]));
        let around: Vec<u32> = self.star[p as usize]
            .iter()
            .copied()
            .filter(|&tet| self.tets[tet as usize].contains(&q))
            .collect();
        for tet in around {
            let nodes = self.tets[tet as usize];
            let with = |from: u32| nodes.map(|node| if node == from { new } else { node });
            let second = self.tets.len() as u32;
            self.tets[tet as usize] = with(q);
            self.tets.push(with(p));
            self.material.push(self.material[tet as usize]);
            self.star[q as usize].retain(|&other| other != tet);
            for node in with(p) {
                self.star[node as usize].push(second);
            }
            self.star[new as usize].push(tet);
        }
        self.sides[new as usize] = self.sides_of(new);
        new
    }

    /// Puts a tet on each of some boundary faces, outward. Their common apex is a new point at `position`
    /// with the data of `point`.
    pub(crate) fn cap(&mut self, point: u32, faces: &[[u32; 3]], position: Vector3) {
        let apex = self.points.len() as u32;
        self.points.push(position);
        self.star.push(Vec::new());
        self.size.push(self.size[point as usize]);
        for &[a, b, c] in faces {
            let has = |tet: &&u32| [b, c].iter().all(|node| self.tets[**tet as usize].contains(node));
            let behind = self.star[a as usize].iter().find(has).map_or(1, |&tet| self.material[tet as usize]);
            let tet = self.tets.len() as u32;
            self.tets.push([a, b, c, apex]);
            self.material.push(behind);
            [a, b, c, apex].into_iter().for_each(|node| self.star[node as usize].push(tet));
        }
        self.sides.push(self.sides_of(apex));
        self.find_sides_of(&faces.concat());
    }

    /// Joins `gone` into `kept`, which moves to `position`. The caller has checked
    /// [`Self::may_collapse`].
    pub(crate) fn collapse(&mut self, gone: u32, kept: u32, position: Vector3) {
        for tet in std::mem::take(&mut self.star[gone as usize]) {
            if self.tets[tet as usize].contains(&kept) {
                for node in self.tets[tet as usize] {
                    self.star[node as usize].retain(|&other| other != tet);
                }
                self.tets[tet as usize] = GONE;
            } else {
                for node in &mut self.tets[tet as usize] {
                    if *node == gone {
                        *node = kept;
                    }
                }
                self.star[kept as usize].push(tet);
            }
        }
        self.points[kept as usize] = position;
    }

    /// True if joining the ends of an edge keeps the topology of the body and of each of its materials. This
    /// is the link condition (Dey, Edelsbrunner, Guha, Nekhayev 1999) in the body and in every material, each
    /// closed by a ghost point on its boundary.
    pub(crate) fn may_collapse(&self, u: u32, v: u32) -> bool {
        let stars = [u, v].map(|point| self.star[point as usize].as_slice());
        let materials: Sides =
            stars.concat().iter().fold(0, |sides, &tet| sides | 1 << self.material[tet as usize]);
        if !self.link_condition(u, v, |_| true) {
            return false;
        }
        materials.count_ones() == 1
            || materials_of(materials)
                .all(|m| self.link_condition(u, v, |tet| usize::from(self.material[tet as usize]) == m))
    }

    fn link_condition(&self, u: u32, v: u32, chosen: impl Fn(u32) -> bool + Copy) -> bool {
        let has = |point: u32| self.star[point as usize].iter().any(|&tet| chosen(tet));
        if !(has(u) && has(v)) {
            return true;
        }
        let (of_u, of_v) = (self.link(u, chosen), self.link(v, chosen));
        let of_edge = self.link_of_edge(u, v, chosen);
        !of_edge.points.is_empty()
            && common(&of_u.points, &of_v.points) == of_edge.points
            && common(&of_u.edges, &of_v.edges) == of_edge.edges
            && common(&of_u.faces, &of_v.faces).is_empty()
    }

    fn link(&self, point: u32, chosen: impl Fn(u32) -> bool) -> Link {
        let mut faces: Vec<[u32; 3]> = Vec::with_capacity(64);
        for &tet in self.star[point as usize].iter().filter(|&&tet| chosen(tet)) {
            faces.extend(self.faces(tet).iter().filter(|face| !face.contains(&point)));
        }
        for face in self.rim_of(point, chosen) {
            faces.push(face.map(|node| if node == point { GHOST } else { node }));
        }
        faces.iter_mut().for_each(|face| face.sort_unstable());
        let edges = faces.iter().flat_map(|&[a, b, c]| [[a, b], [a, c], [b, c]]).collect();
        Link { points: distinct(faces.concat()), edges: distinct(edges), faces: distinct(faces) }
    }

    fn link_of_edge(&self, u: u32, v: u32, chosen: impl Fn(u32) -> bool) -> Link {
        let mut edges: Vec<[u32; 2]> = Vec::with_capacity(16);
        for &tet in self.star[u as usize].iter().filter(|&&tet| chosen(tet)) {
            let nodes = self.tets[tet as usize];
            if nodes.contains(&v) {
                let mut rest = nodes.into_iter().filter(|&node| node != u && node != v);
                let [a, b] = [rest.next().unwrap_or(GHOST), rest.next().unwrap_or(GHOST)];
                edges.push([a.min(b), a.max(b)]);
            }
        }
        for face in self.rim_of(u, chosen).into_iter().filter(|face| face.contains(&v)) {
            edges.extend(face.into_iter().filter(|&node| node != u && node != v).map(|node| [node, GHOST]));
        }
        Link { points: distinct(edges.concat()), edges: distinct(edges), faces: Vec::new() }
    }

    /// Points without gaps in their numbers, tets, and their materials.
    pub(crate) fn compacted(&self) -> (Vec<Vector3>, Vec<u32>, Vec<u8>) {
        let mut number = vec![u32::MAX; self.points.len()];
        let mut points = Vec::new();
        for (at, _) in self.star.iter().enumerate().filter(|(_, star)| !star.is_empty()) {
            number[at] = points.len() as u32;
            points.push(self.points[at]);
        }
        let nodes =
            self.alive().flat_map(|tet| self.tets[tet as usize]).map(|node| number[node as usize]).collect();
        (points, nodes, self.alive().map(|tet| self.material[tet as usize]).collect())
    }
}

/// The link of a point or an edge, sorted.
struct Link {
    points: Vec<u32>,
    edges: Vec<[u32; 2]>,
    faces: Vec<[u32; 3]>,
}

/// The faces that occur once, in the order of their sorted nodes.
fn lone(faces: Vec<[u32; 3]>) -> Vec<[u32; 3]> {
    let keyed = |face: [u32; 3]| {
        let mut key = face;
        key.sort_unstable();
        (key, face)
    };
    let mut faces: Vec<([u32; 3], [u32; 3])> = faces.into_iter().map(keyed).collect();
    faces.sort_unstable();
    faces.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1).map(|same| same[0].1).collect()
}

fn distinct<T: Ord>(mut values: Vec<T>) -> Vec<T> {
    values.sort_unstable();
    values.dedup();
    values
}

/// The intersection of two sorted lists.
fn common<T: Ord + Copy>(a: &[T], b: &[T]) -> Vec<T> {
    a.iter().copied().filter(|item| b.binary_search(item).is_ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Six tets round the edge from 0 to 7 of a cube (Kuhn), points by bits.
    fn cube() -> Complex {
        let points = (0..8).map(|at| Vector3::from([at & 1, at >> 1 & 1, at >> 2].map(f64::from))).collect();
        let ring = [1, 3, 2, 6, 4, 5];
        let tets = (0..6).map(|at| [0, ring[at], ring[(at + 1) % 6], 7]).collect();
        Complex::new(points, tets, 1.0)
    }

    #[test]
    fn acoustic_length_is_that_of_geometry() {
        let cube = cube();
        for tet in cube.alive() {
            let corners = cube.corners(tet);
            let reference = pliant_geometry::acoustic_length(pliant_geometry::CellKind::Tet, &corners);
            assert!((cube.length(tet) - reference).abs() < 1e-15 && reference > 0.0);
        }
    }

    #[test]
    fn a_halved_edge_is_on_the_boundary_if_the_edge_was() {
        let mut cube = cube();
        let inner = cube.bisect([0, 7], Vector3::repeat(0.5));
        let outer = cube.bisect([0, 1], Vector3::new(0.5, 0.0, 0.0));
        assert_eq!((cube.sides[inner as usize], cube.sides[outer as usize]), (2, 3));
        // Two of the halved tets have the second edge.
        assert_eq!(cube.alive().count(), 6 + 6 + 2);
        let volume: f64 = cube
            .alive()
            .map(|tet| pliant_geometry::volume(pliant_geometry::CellKind::Tet, &cube.corners(tet)))
            .sum();
        assert!((volume - 1.0).abs() < 1e-14);
    }

    #[test]
    fn an_edge_through_the_body_between_boundary_points_may_not_collapse() {
        let mut cube = cube();
        assert!(!cube.may_collapse(0, 7), "the diagonal of the cube");
        let middle = cube.bisect([0, 7], Vector3::repeat(0.5));
        assert!(cube.may_collapse(middle, 0));
        cube.collapse(middle, 0, Vector3::zeros());
        assert_eq!(cube.alive().count(), 6);
        assert!(cube.may_collapse(1, 0), "an edge of the cube");
    }

    #[test]
    fn a_material_may_not_be_pinched() {
        let mut cube = cube();
        let middle = cube.bisect([0, 7], Vector3::repeat(0.5));
        // Three tets round the lower half of the diagonal are another material.
        let lower: Vec<u32> =
            cube.alive().filter(|&tet| cube.tets[tet as usize].contains(&0)).take(3).collect();
        lower.iter().for_each(|&tet| cube.material[tet as usize] = 2);
        cube.find_sides();
        assert_eq!(cube.sides[middle as usize], 0b110);
        assert!(
            !cube.may_collapse(middle, 0),
            "its edge from point 0 to the middle is all that holds it there"
        );
        assert!(!cube.may_collapse(middle, 7), "the middle is inside, 7 is not on material 2");
    }
}
