//! A surface of triangles that changes: edges collapse, are halved or flipped. Borders and creases are marked
//! edges; a point where a number of marked edges other than two meet is a corner and stays. Surfaces from
//! files are made manifold first. Points at one place become one, and faces without area or given twice go.
//! The surface is cut where more than two faces share an edge. Faces are turned alike and outwards. Leaves
//! out: finding and mending surfaces that pass through themselves.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fmt;

use pliant_geometry::{CellKind, Mesh, Surface, Vector3, boundary};
use serde::Serialize;

use crate::error::{MeshingError, counted};
use crate::surface::edges::key;
use crate::surface::nesting::{Shell, containers, signed_volume};

/// Triangles of a worse shape have a normal by round-off only.
const LEAST_SIDED: f64 = 1e-6;

/// A removed triangle.
const GONE: [u32; 3] = [u32::MAX; 3];

/// Points closer than this part of the box's diagonal are one.
const SAME: f64 = 1e-9;

/// Points at one place are moved apart by this part of the diagonal: more than readers take for one point, in
/// single precision too.
const APART: f64 = 1e-5;

/// A triangulated surface, manifold with or without borders.
#[derive(Clone, Debug)]
pub struct TriangleMesh {
    pub(crate) points: Vec<Vector3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// The triangles round each point.
    pub(crate) star: Vec<Vec<u32>>,
    /// Edges that stay edges, smaller point first.
    creases: BTreeSet<[u32; 2]>,
    /// True if it has borders. Collapses, splits and flips open and close nothing.
    open: bool,
}

/// Repairs of a surface from a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct SurfaceRepairs {
    /// Points joined to another at the same place.
    pub joined_points: usize,
    /// Faces without area, or given twice, that were dropped.
    pub dropped_faces: usize,
    /// Edges of more than two faces, along which the surface was cut.
    pub cut_edges: usize,
    /// Faces turned to the orientation of their neighbours, and outwards on closed surfaces.
    pub turned_faces: usize,
}

impl fmt::Display for SurfaceRepairs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts = [
            (self.joined_points, ["point", "points"], "joined"),
            (self.dropped_faces, ["face", "faces"], "dropped (duplicate or without area)"),
            (self.cut_edges, ["edge", "edges"], "of more than two faces split"),
            (self.turned_faces, ["face", "faces"], "turned"),
        ];
        let notes: Vec<String> = parts
            .iter()
            .filter(|(n, ..)| *n > 0)
            .map(|(n, [one, more], done)| format!("{} {done}", counted(*n, one, more)))
            .collect();
        f.write_str(&if notes.is_empty() { "nothing".into() } else { notes.join(", ") })
    }
}

/// Twice the area times the normal [m²].
pub(crate) fn cross([a, b, c]: [Vector3; 3]) -> Vector3 {
    (b - a).cross(&(c - a))
}

/// 4 √3 A / Σ l²: 1 of an equilateral triangle, 0 of a flat one.
pub(crate) fn shape(x: [Vector3; 3]) -> f64 {
    let squares = (x[1] - x[0]).norm_squared() + (x[2] - x[1]).norm_squared() + (x[0] - x[2]).norm_squared();
    if squares > 0.0 { 2.0 * 3.0_f64.sqrt() * cross(x).norm() / squares } else { 0.0 }
}

impl TriangleMesh {
    /// A surface of points [m] and triangles that is known to be manifold.
    pub(crate) fn new(points: Vec<Vector3>, triangles: Vec<[u32; 3]>) -> Self {
        let mut star = vec![Vec::new(); points.len()];
        for (triangle, nodes) in (0..).zip(&triangles) {
            nodes.iter().for_each(|&node| star[node as usize].push(triangle));
        }
        let mut mesh = Self { points, triangles, star, creases: BTreeSet::new(), open: false };
        mesh.open = 2 * mesh.edges().len() != 3 * mesh.triangles.len();
        mesh
    }

    /// The triangles and quads of a mesh (quads halved), or the boundary of its volume cells, mended where
    /// needed.
    pub fn from_mesh(mesh: &Mesh) -> Result<(Self, SurfaceRepairs), MeshingError> {
        let (surface, mut repairs) = Self::from_surface(&boundary(mesh), &mesh.points)?;
        if mesh.volume_blocks().all(|block| block.is_empty()) {
            // Faces with a repeated point are dropped from the start.
            let blocks = mesh.blocks.iter().filter(|block| block.kind.dimension() == 2);
            let lines = |nodes: &&[u32]| {
                nodes.iter().enumerate().filter(|(k, n)| !nodes[..*k].contains(n)).count() < 3
            };
            repairs.dropped_faces += blocks.flat_map(|block| block.cells()).filter(lines).count();
        }
        Ok((surface, repairs))
    }

    fn from_surface(surface: &Surface, points: &[Vector3]) -> Result<(Self, SurfaceRepairs), MeshingError> {
        if let Some(&value) = points.iter().find(|x| !x.iter().all(|x| x.is_finite())) {
            return Err(MeshingError::NotFinite { what: "a point of the surface", value });
        }
        let mut repairs = SurfaceRepairs::default();
        let (numbers, points) = joined(&surface.nodes(), points, &mut repairs);
        let mut triangles: Vec<[u32; 3]> = Vec::with_capacity(surface.faces.len());
        let mut seen = BTreeSet::new();
        for face in &surface.faces {
            let nodes: Vec<u32> = face.nodes().iter().map(|node| numbers[node]).collect();
            for k in 2..nodes.len() {
                let triangle = [nodes[0], nodes[k - 1], nodes[k]];
                let mut sorted = triangle;
                sorted.sort_unstable();
                if shape(triangle.map(|n| points[n as usize])) > 1e-12 && seen.insert(sorted) {
                    triangles.push(triangle);
                } else {
                    repairs.dropped_faces += 1;
                }
            }
        }
        if triangles.is_empty() {
            return Err(MeshingError::NoSurface);
        }
        repairs.turned_faces = turn_alike(&mut triangles, &points);
        let (points, triangles) = cut(points, triangles, &mut repairs);
        Ok((Self::new(points, triangles), repairs))
    }

    /// The surface as a mesh, points that no triangle uses left out.
    pub fn to_mesh(&self) -> Mesh {
        let (points, triangles) = self.compact();
        let mut mesh = Mesh { points, ..Mesh::default() };
        mesh.block_mut(CellKind::Triangle).nodes = triangles.into_flattened();
        mesh
    }

    /// Returns the mesh for a file or a body, where readers take points at one place for one. Points at one
    /// place, where the surface touches itself, are moved a little apart, each towards its neighbours.
    pub fn to_parted_mesh(&self) -> Mesh {
        let mut mesh = self.to_mesh();
        let rest = mesh.points.clone();
        let key = |node: u32| <[f64; 3]>::from(rest[node as usize]).map(f64::to_bits);
        let mut order: Vec<u32> = (0..rest.len() as u32).collect();
        order.sort_by_key(|&node| (key(node), node));
        let twins: BTreeSet<u32> = order
            .chunk_by(|&a, &b| key(a) == key(b))
            .filter(|same| same.len() > 1)
            .flatten()
            .copied()
            .collect();
        if twins.is_empty() {
            return mesh;
        }
        let apart = APART * mesh.bounds().map_or(0.0, |(low, high)| (high - low).norm());
        let mut ways: BTreeMap<u32, Vector3> = BTreeMap::new();
        for nodes in mesh.blocks[0].cells() {
            for &node in nodes.iter().filter(|node| twins.contains(node)) {
                let sum: Vector3 = nodes.iter().map(|&n| rest[n as usize] - rest[node as usize]).sum();
                *ways.entry(node).or_default() += sum;
            }
        }
        for (node, way) in ways {
            mesh.points[node as usize] += apart * way.try_normalize(0.0).unwrap_or_default();
        }
        mesh
    }

    /// Returns the points in use and the triangles with these points' numbers.
    pub(crate) fn compact(&self) -> (Vec<Vector3>, Vec<[u32; 3]>) {
        let mut number = vec![u32::MAX; self.points.len()];
        let mut points = Vec::new();
        for (at, star) in self.star.iter().enumerate() {
            if !star.is_empty() {
                number[at] = points.len() as u32;
                points.push(self.points[at]);
            }
        }
        let triangles = self.alive().map(|t| self.triangles[t as usize].map(|node| number[node as usize]));
        (points, triangles.collect())
    }

    /// Marks edges as creases where faces meet at more than an angle [rad].
    pub fn mark_creases(&mut self, angle: f64) {
        for [a, b] in self.edges() {
            if let [Some(s), Some(t)] = self.sides(a, b)
                && self.normal(s).dot(&self.normal(t)) < angle.cos()
            {
                self.creases.insert([a, b]);
            }
        }
    }

    /// The edges that are marked as creases, increasing.
    pub(crate) fn creases(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        self.creases.iter().copied()
    }

    /// Marks these edges as creases, and no others.
    pub(crate) fn set_creases(&mut self, edges: impl IntoIterator<Item = [u32; 2]>) {
        self.creases = edges.into_iter().map(|[a, b]| key(a, b)).collect();
    }

    /// Drops points that no triangle uses and numbers the others anew, in their order. Creases stay marked.
    pub(crate) fn compacted(&self) -> Self {
        let (points, triangles) = self.compact();
        let mut compacted = Self::new(points, triangles);
        let used = self.star.iter().scan(0, |count, star| {
            let number = *count;
            *count += u32::from(!star.is_empty());
            Some(number)
        });
        let number: Vec<u32> = used.collect();
        compacted.set_creases(self.creases().map(|edge| edge.map(|node| number[node as usize])));
        compacted
    }

    /// Puts in the triangles of a changed part of this surface: they replace others and add new ones.
    /// `triangles` and `nodes` are the numbers of its triangles and points here. Creases between its points
    /// are taken from the part.
    pub(crate) fn put(&mut self, part: &Self, triangles: &[u32], nodes: &[u32]) {
        for &t in triangles.iter().filter(|&&t| (t as usize) < self.triangles.len()) {
            let [a, b, c] = self.triangles[t as usize];
            for (edge, node) in [([a, b], a), ([b, c], b), ([c, a], c)] {
                self.creases.remove(&key(edge[0], edge[1]));
                self.star[node as usize].retain(|&other| other != t);
            }
        }
        let count =
            |numbers: &[u32], old: usize| numbers.iter().map(|&n| n as usize + 1).fold(old, usize::max);
        self.triangles.resize(count(triangles, self.triangles.len()), GONE);
        self.points.resize(count(nodes, self.points.len()), Vector3::zeros());
        self.star.resize(self.points.len(), Vec::new());
        for (x, &node) in part.points.iter().zip(nodes) {
            self.points[node as usize] = *x;
        }
        for (at, &t) in triangles.iter().enumerate() {
            let exists = part.exists(at as u32);
            let place = |n: u32| nodes[n as usize];
            self.triangles[t as usize] = if exists { part.triangles[at].map(place) } else { GONE };
            if exists {
                self.triangles[t as usize].iter().for_each(|&node| self.star[node as usize].push(t));
            }
        }
        self.creases.extend(part.creases().map(|[a, b]| key(nodes[a as usize], nodes[b as usize])));
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.alive().count()
    }

    /// True without triangles.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The existing triangles, in order.
    pub(crate) fn alive(&self) -> impl Iterator<Item = u32> + '_ {
        (0_u32..).zip(&self.triangles).filter(|(_, nodes)| **nodes != GONE).map(|(triangle, _)| triangle)
    }

    pub(crate) fn exists(&self, triangle: u32) -> bool {
        self.triangles[triangle as usize] != GONE
    }

    pub(crate) fn corners(&self, triangle: u32) -> [Vector3; 3] {
        self.triangles[triangle as usize].map(|node| self.points[node as usize])
    }

    /// Area [m²].
    pub(crate) fn area(&self, triangle: u32) -> f64 {
        0.5 * cross(self.corners(triangle)).norm()
    }

    pub(crate) fn normal(&self, triangle: u32) -> Vector3 {
        cross(self.corners(triangle)).try_normalize(0.0).unwrap_or_default()
    }

    /// Edges, increasing, each once.
    pub(crate) fn edges(&self) -> Vec<[u32; 2]> {
        let of = |t: u32| {
            let [a, b, c] = self.triangles[t as usize];
            [key(a, b), key(b, c), key(c, a)]
        };
        let mut edges: Vec<[u32; 2]> = self.alive().flat_map(of).collect();
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    /// The triangles at an edge: two, one at a border, none if the edge does not exist.
    pub(crate) fn sides(&self, a: u32, b: u32) -> [Option<u32>; 2] {
        let mut at = self.star[a as usize].iter().filter(|&&t| self.triangles[t as usize].contains(&b));
        [at.next().copied(), at.next().copied()]
    }

    /// The third corner of a triangle at an edge.
    pub(crate) fn opposite(&self, triangle: u32, a: u32, b: u32) -> u32 {
        let [p, q, r] = self.triangles[triangle as usize];
        if p != a && p != b {
            p
        } else if q != a && q != b {
            q
        } else {
            r
        }
    }

    /// Points joined to a point by an edge, increasing.
    pub(crate) fn neighbours(&self, point: u32) -> Vec<u32> {
        let star = self.star[point as usize].iter();
        let mut found: Vec<u32> =
            star.flat_map(|&t| self.triangles[t as usize]).filter(|&n| n != point).collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    pub(crate) fn is_border(&self, a: u32, b: u32) -> bool {
        self.open && matches!(self.sides(a, b), [Some(_), None])
    }

    /// True if an edge is a border or a crease.
    pub(crate) fn is_marked(&self, a: u32, b: u32) -> bool {
        self.is_border(a, b) || self.creases.contains(&key(a, b))
    }

    /// The other ends of the marked edges at a point.
    pub(crate) fn marked(&self, point: u32) -> Vec<u32> {
        if !self.open && self.creases.is_empty() {
            return Vec::new();
        }
        let mut found = self.neighbours(point);
        found.retain(|&n| self.is_marked(point, n));
        found
    }

    /// True if the edge can collapse into its first end so that the surface keeps its topology and its marked
    /// lines. This is the link condition (Dey et al. 1999), with the outside of a border as one more point.
    pub(crate) fn may_collapse(&self, keep: u32, gone: u32) -> bool {
        let lines = self.marked(gone);
        if !(lines.is_empty() || lines.len() == 2 && lines.contains(&keep)) {
            return false;
        }
        let sides = self.sides(keep, gone);
        let on_border = |p: u32| self.open && self.neighbours(p).iter().any(|&n| self.is_border(p, n));
        let border = sides[1].is_none();
        if !border && on_border(keep) && on_border(gone) {
            return false;
        }
        let apexes: Vec<u32> = sides.iter().flatten().map(|&t| self.opposite(t, keep, gone)).collect();
        let (first, second) = (self.neighbours(keep), self.neighbours(gone));
        let common = first.iter().filter(|n| second.binary_search(n).is_ok()).count();
        if common != apexes.len() {
            return false;
        }
        match apexes[..] {
            // A tetrahedron, or a triangle all alone.
            [c, d] => ![keep, gone].iter().all(|end| {
                self.sides(c, d).iter().flatten().any(|&t| self.triangles[t as usize].contains(end))
            }),
            [c] => !(self.is_border(keep, c) && self.is_border(gone, c)),
            _ => false,
        }
    }

    /// True if all triangles round two points that stay keep their side and some shape if the points become
    /// one at `position`.
    pub(crate) fn keeps_sides(&self, keep: u32, gone: u32, position: &Vector3, least_shape: f64) -> bool {
        [(keep, gone), (gone, keep)].into_iter().all(|(moved, other)| {
            self.star[moved as usize].iter().all(|&t| {
                let nodes = self.triangles[t as usize];
                if nodes.contains(&other) {
                    return true;
                }
                let before = self.corners(t);
                let after = [0, 1, 2].map(|k| if nodes[k] == moved { *position } else { before[k] });
                let (old, new) = (cross(before), cross(after));
                // A triangle that is a line or a point has no side and no shape to keep.
                let turned = shape(before) > LEAST_SIDED && old.dot(&new) <= 0.5 * old.norm() * new.norm();
                !turned && shape(after) >= least_shape.min(0.5 * shape(before))
            })
        })
    }

    /// Makes two ends of an edge one point, at a position. The edge must be allowed to collapse.
    pub(crate) fn collapse(&mut self, keep: u32, gone: u32, position: Vector3) {
        for other in self.neighbours(gone) {
            if self.creases.remove(&key(gone, other)) && other != keep {
                self.creases.insert(key(keep, other));
            }
        }
        for t in std::mem::take(&mut self.star[gone as usize]) {
            let nodes = self.triangles[t as usize];
            if nodes.contains(&keep) {
                for node in nodes.into_iter().filter(|&n| n != gone) {
                    self.star[node as usize].retain(|&s| s != t);
                }
                self.triangles[t as usize] = GONE;
            } else {
                self.triangles[t as usize] = nodes.map(|n| if n == gone { keep } else { n });
                self.star[keep as usize].push(t);
            }
        }
        self.points[keep as usize] = position;
    }

    /// Halves an edge at a position; returns the new point.
    pub(crate) fn split(&mut self, a: u32, b: u32, position: Vector3) -> u32 {
        let middle = self.points.len() as u32;
        self.points.push(position);
        self.star.push(Vec::new());
        for t in self.sides(a, b).into_iter().flatten() {
            let nodes = self.triangles[t as usize];
            let fresh = self.triangles.len() as u32;
            self.triangles[t as usize] = nodes.map(|n| if n == b { middle } else { n });
            self.triangles.push(nodes.map(|n| if n == a { middle } else { n }));
            let apex = nodes.into_iter().find(|&n| n != a && n != b).unwrap_or(a);
            self.star[b as usize].retain(|&s| s != t);
            self.star[b as usize].push(fresh);
            self.star[apex as usize].push(fresh);
            self.star[middle as usize].extend([t, fresh]);
        }
        if self.creases.remove(&key(a, b)) {
            self.creases.extend([key(a, middle), key(b, middle)]);
        }
        middle
    }

    /// The two triangles after flipping an edge; `None` if it cannot be flipped.
    pub(crate) fn flipped(&self, a: u32, b: u32) -> Option<[[u32; 3]; 2]> {
        let [Some(s), Some(t)] = self.sides(a, b) else { return None };
        let (c, d) = (self.opposite(s, a, b), self.opposite(t, a, b));
        if self.is_marked(a, b) || c == d || self.sides(c, d)[0].is_some() {
            return None;
        }
        let swap = |from: [u32; 3], out: u32, into: u32| from.map(|n| if n == out { into } else { n });
        Some([swap(self.triangles[s as usize], b, d), swap(self.triangles[t as usize], a, c)])
    }

    /// Flips an edge, which must be flippable.
    pub(crate) fn flip(&mut self, a: u32, b: u32, new: [[u32; 3]; 2]) {
        let [Some(s), Some(t)] = self.sides(a, b) else { return };
        let (c, d) = (self.opposite(s, a, b), self.opposite(t, a, b));
        (self.triangles[s as usize], self.triangles[t as usize]) = (new[0], new[1]);
        self.star[b as usize].retain(|&x| x != s);
        self.star[a as usize].retain(|&x| x != t);
        self.star[d as usize].push(s);
        self.star[c as usize].push(t);
    }

    /// Mean normal of the triangles round a point, weighted by their angles there (Thürmer and Wüthrich
    /// 1998).
    pub(crate) fn point_normal(&self, point: u32) -> Vector3 {
        let of = |&t: &u32| {
            let at = self.triangles[t as usize].iter().position(|&n| n == point).unwrap_or(0);
            let x = self.corners(t);
            let (u, v) = (x[(at + 1) % 3] - x[at], x[(at + 2) % 3] - x[at]);
            u.angle(&v) * self.normal(t)
        };
        self.star[point as usize].iter().map(of).sum::<Vector3>().try_normalize(0.0).unwrap_or_default()
    }

    /// Diagonal of its box [m].
    pub fn diagonal(&self) -> f64 {
        self.to_mesh().bounds().map_or(0.0, |(low, high)| (high - low).norm())
    }
}

/// Points by place: for each old one its new number, and the new ones.
fn joined(
    nodes: &[u32],
    points: &[Vector3],
    repairs: &mut SurfaceRepairs,
) -> (BTreeMap<u32, u32>, Vec<Vector3>) {
    let of = |&n: &u32| points[n as usize];
    let start = nodes.first().map(of).unwrap_or_default();
    let (low, high) = nodes.iter().map(of).fold((start, start), |(l, h), x| (l.inf(&x), h.sup(&x)));
    let size = (SAME * (high - low).norm()).max(f64::MIN_POSITIVE);
    let mut places: BTreeMap<[i64; 3], u32> = BTreeMap::new();
    let (mut numbers, mut kept) = (BTreeMap::new(), Vec::new());
    for &node in nodes {
        let place = (points[node as usize] - low) / size;
        let number = *places.entry([0, 1, 2].map(|i| place[i].round() as i64)).or_insert_with(|| {
            kept.push(points[node as usize]);
            kept.len() as u32 - 1
        });
        numbers.insert(node, number);
    }
    repairs.joined_points = nodes.len() - kept.len();
    (numbers, kept)
}

/// The sides of each edge: triangle and whether it runs from the smaller end to the larger.
fn sides_of(triangles: &[[u32; 3]]) -> BTreeMap<[u32; 2], Vec<(u32, bool)>> {
    let mut sides: BTreeMap<[u32; 2], Vec<(u32, bool)>> = BTreeMap::new();
    for (number, &[a, b, c]) in (0..).zip(triangles) {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            sides.entry(key(from, to)).or_default().push((number, from < to));
        }
    }
    sides
}

/// Orients triangles consistently with the majority of each piece; closed pieces outwards together with the
/// pieces inside, where a cavity is oriented towards itself. Returns the number of turned triangles.
fn turn_alike(triangles: &mut [[u32; 3]], points: &[Vector3]) -> usize {
    let before = triangles.to_vec();
    let (pieces, closed) = turn_pieces(triangles);
    let shell = |piece: &Vec<u32>| {
        let nodes: Vec<[u32; 3]> = piece.iter().map(|&t| triangles[t as usize]).collect();
        Shell { volume: signed_volume(points, &nodes), triangles: piece.clone() }
    };
    let shells: Vec<Shell> = pieces.iter().zip(&closed).filter(|(_, c)| **c).map(|(p, _)| shell(p)).collect();
    let containers = containers(points, triangles, &shells);
    for (number, shell) in shells.iter().enumerate() {
        let around = containers[number].iter().chain([&number]);
        let outermost = around.max_by(|&&a, &&b| shells[a].volume.abs().total_cmp(&shells[b].volume.abs()));
        if outermost.is_some_and(|&at| shells[at].volume < 0.0) {
            shell.triangles.iter().for_each(|&t| triangles[t as usize].swap(1, 2));
        }
    }
    (0..before.len()).filter(|&t| before[t] != triangles[t]).count()
}

/// Orients the triangles of each piece consistently with their majority. Returns the pieces, and whether each
/// is closed.
fn turn_pieces(triangles: &mut [[u32; 3]]) -> (Vec<Vec<u32>>, Vec<bool>) {
    let sides = sides_of(triangles);
    let mut turn: Vec<Option<bool>> = vec![None; triangles.len()];
    let (mut pieces, mut closed) = (Vec::new(), Vec::new());
    for first in 0..triangles.len() {
        if turn[first].is_some() {
            continue;
        }
        turn[first] = Some(false);
        let mut piece = vec![first as u32];
        let mut next = VecDeque::from([first as u32]);
        // Edges of one triangle or of more than two: how often they run one way more than the other.
        let mut open: BTreeMap<[u32; 2], i32> = BTreeMap::new();
        while let Some(at) = next.pop_front() {
            let turned = turn[at as usize] == Some(true);
            let [a, b, c] = triangles[at as usize];
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let [(s, forward), (t, other)] = sides[&key(from, to)][..] else {
                    *open.entry(key(from, to)).or_default() += if (from < to) != turned { 1 } else { -1 };
                    continue;
                };
                let across = if s == at { t } else { s };
                if turn[across as usize].is_none() {
                    turn[across as usize] = Some(turned ^ (forward == other));
                    piece.push(across);
                    next.push_back(across);
                }
            }
        }
        let turned = piece.iter().filter(|&&t| turn[t as usize] == Some(true)).count();
        let most = 2 * turned > piece.len();
        for &t in &piece {
            if (turn[t as usize] == Some(true)) != most {
                triangles[t as usize].swap(1, 2);
            }
        }
        piece.sort_unstable();
        pieces.push(piece);
        closed.push(open.values().all(|&sum| sum == 0));
    }
    (pieces, closed)
}

/// Pairs of triangles of an edge that continue each other on one surface. If there are more than two, pairs
/// bound the same inside. From each triangle the search turns about the edge into its inside, to the next
/// triangle that runs the other way.
fn joined_at(
    edge: [u32; 2],
    sides: &[(u32, bool)],
    triangles: &[[u32; 3]],
    points: &[Vector3],
) -> Vec<[u32; 2]> {
    let (forth, back): (Vec<_>, Vec<_>) = sides.iter().partition(|(_, forward)| *forward);
    if forth.len() != back.len() {
        return Vec::new();
    }
    if let ([(s, _)], [(t, _)]) = (&forth[..], &back[..]) {
        return vec![[*s, *t]];
    }
    let [from, to] = edge.map(|end| points[end as usize]);
    let along = (to - from).normalize();
    // From the edge into a triangle.
    let into = |t: u32| {
        let apex = triangles[t as usize].into_iter().find(|node| !edge.contains(node));
        let way = apex.map_or(along, |apex| points[apex as usize] - from);
        way - along * way.dot(&along)
    };
    let mut left: Vec<u32> = back.iter().map(|&(t, _)| t).collect();
    let pair = |(s, _): (u32, bool)| {
        let start = into(s);
        let inward = -cross(triangles[s as usize].map(|node| points[node as usize]));
        let angle = |t: u32| {
            let way = into(t);
            (way.dot(&inward) / inward.norm())
                .atan2(way.dot(&start) / start.norm())
                .rem_euclid(std::f64::consts::TAU)
        };
        let next = (0..left.len()).min_by(|&a, &b| angle(left[a]).total_cmp(&angle(left[b])))?;
        Some([s, left.swap_remove(next)])
    };
    forth.into_iter().filter_map(pair).collect()
}

/// Gives each fan of triangles around a point its own point. A fan is joined by edges of two triangles with
/// the same orientation, and by pairs of more.
fn cut(
    mut points: Vec<Vector3>,
    mut triangles: Vec<[u32; 3]>,
    repairs: &mut SurfaceRepairs,
) -> (Vec<Vector3>, Vec<[u32; 3]>) {
    let sides = sides_of(&triangles);
    repairs.cut_edges = sides.values().filter(|s| s.len() > 2 || s.len() == 2 && s[0].1 == s[1].1).count();
    let mut star = vec![Vec::new(); points.len()];
    for (t, nodes) in (0_u32..).zip(&triangles) {
        nodes.iter().for_each(|&n| star[n as usize].push(t));
    }
    let before = triangles.clone();
    let mut across: BTreeMap<(u32, [u32; 2]), u32> = BTreeMap::new();
    for (&edge, around) in &sides {
        for [s, t] in joined_at(edge, around, &before, &points) {
            across.insert((s, edge), t);
            across.insert((t, edge), s);
        }
    }
    for (point, star) in (0_u32..).zip(&star) {
        let mut left = star.clone();
        let mut first = true;
        while let Some(start) = left.pop() {
            let mut fan = vec![start];
            let mut at = 0;
            while at < fan.len() {
                for other in before[fan[at] as usize].into_iter().filter(|&n| n != point) {
                    if let Some(next) = across.get(&(fan[at], key(point, other)))
                        && let Some(place) = left.iter().position(|l| l == next)
                    {
                        left.swap_remove(place);
                        fan.push(*next);
                    }
                }
                at += 1;
            }
            if !first {
                let fresh = points.len() as u32;
                points.push(points[point as usize]);
                for t in fan {
                    triangles[t as usize] = triangles[t as usize].map(|n| if n == point { fresh } else { n });
                }
            }
            first = false;
        }
    }
    (points, triangles)
}
