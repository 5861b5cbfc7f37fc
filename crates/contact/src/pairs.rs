//! Pairs of two deformable surfaces, or parts of a surface, that come near each other: a node above a
//! triangle, and two edges that cross. The outward side of the surfaces gives the sign of a distance, so that
//! a small overlap is seen as one.
//!
//! Trees of triangles and edges give lists of candidates. These hold until a node has moved by half of a
//! margin, the skin. Till then they contain all pairs of a step, so that results do not depend on when they
//! were made. Results do not depend on the order of bodies or threads either.
//!
//! A node is compared with each triangle that it lies above or beneath, and with the nearest edge or corner
//! if that is nearer still. Two edges count where the normal between them is in the cones of normals of both
//! (Gauss map). Surfaces that look the same way do not touch.

mod narrow;

use std::collections::BTreeMap;

use nalgebra::Vector3;

use crate::barrier::distance::{edge_edge, point_triangle};
use crate::tree::{Bounds, Tree};
pub use narrow::Edge;
use narrow::{Above, Across, is_beyond};
pub(crate) use narrow::{FLAT, PARALLEL};

/// Distance beyond the one to keep within which pairs are found, over the mean edge.
const REACH: f64 = 0.25;
/// The skin of the lists, over the mean edge.
const SKIN: f64 = 0.25;
/// Margin that lists contain, over the skin: the excess is for round-off of single precision.
const HELD: f64 = 1.01;
/// Factor on the ways of nodes, for the round-off of single precision.
const ROUND_OFF: f64 = 1.0 + 1e-6;
/// Overlap, over the mean edge, up to which a surface is seen from behind.
const DEPTH: f64 = 0.25;
/// The cosine of the angle between outward normals up to which surfaces face each other.
pub(crate) const FACING: f64 = 0.3;
/// Distance beside a triangle, over its height, within which a node still counts as above it if its surface
/// faces the triangle. Bodies with common borders hold each other there, and do not catch on each other's
/// sides.
pub(crate) const BESIDE: f64 = 0.02;
/// Overlap, over the deepest one, that is undone though a side that faces away is nearer.
pub(crate) const SLIGHT: f64 = 0.1;
/// Distance from a triangle, edge or corner at which a node lies on it, over the overlap up to which a
/// surface is seen from behind. Such a node is not beneath, and the way to it has no usable direction.
/// Impulses leave a smaller distance, and round-off of single precision is smaller too.
pub(crate) const ON: f64 = 1e-4;
/// Relative difference up to which distances are the same.
const SAME: f64 = 1e-9;
/// Rest distances, over the distance to keep, up to which parts of a surface never touch each other.
const AT_REST: f64 = 1.02;

/// A surface that touches: triangles, outward, and their nodes.
#[derive(Clone, Debug, Default)]
pub struct Surface {
    /// The nodes.
    pub nodes: Vec<u32>,
    /// Triangles of these nodes.
    pub faces: Vec<[u32; 3]>,
}

impl Surface {
    /// Returns the surface with other numbers of its nodes, in the same order.
    pub fn numbered(&self, number: impl Fn(u32) -> u32) -> Self {
        let faces = self.faces.iter().map(|face| face.map(&number)).collect();
        Self { nodes: self.nodes.iter().map(|&node| number(node)).collect(), faces }
    }

    /// Length [m] of its longest edge, with nodes at these places [m].
    pub fn longest_edge(&self, place: impl Fn(u32) -> Vector3<f64>) -> f64 {
        let edges = self.faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        edges.map(|[a, b]| (place(a) - place(b)).norm()).fold(0.0, f64::max)
    }
}

/// A near pair: a point of one surface and a point of another.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    /// Nodes that take part: a node and the corners of a triangle, or the ends of two edges.
    pub nodes: [u32; 4],
    /// Weights w: Σ wᵢ xᵢ is the way [m] from the point of the second primitive to the point of the first.
    pub weights: [f64; 4],
    /// Outward from the second.
    pub normal: Vector3<f64>,
    /// The distance [m] along it, negative of an overlap.
    pub distance: f64,
    /// The distance [m] that both keep.
    pub kept: f64,
    /// True if the first primitive belongs to the first of two surfaces.
    pub in_order: bool,
}

/// A node with the triangles that are candidates.
pub struct Point<'p> {
    /// The node.
    pub node: u32,
    /// The triangles of its surface around the node: each by its other corners, in order.
    pub ring: &'p [[u32; 2]],
    /// True if the node belongs to the first of two surfaces.
    pub in_order: bool,
    list: &'p [[u32; 2]],
    other: &'p Side,
}

impl Point<'_> {
    /// The triangles, and which of their corners are at borders of an open surface.
    pub fn faces(&self) -> impl Iterator<Item = ([u32; 3], [bool; 3])> {
        let face = |&[_, face]: &[u32; 2]| self.other.faces[face as usize];
        let is_at_border = |node: u32| self.other.border.binary_search(&node).is_ok();
        self.list.iter().map(move |pair| (face(pair), face(pair).map(is_at_border)))
    }
}

/// One of the surfaces.
struct Side {
    nodes: Vec<u32>,
    faces: Vec<[u32; 3]>,
    edges: Vec<Edge>,
    /// Nodes at borders of an open surface, increasing.
    border: Vec<u32>,
    /// Triangles around the nodes, one node after the other: each by its other corners, in order. `ring_ends`
    /// has the end of each node's triangles.
    rings: Vec<[u32; 2]>,
    ring_ends: Vec<usize>,
    face_tree: Tree,
    edge_tree: Tree,
    /// Places [m] of the nodes when candidates were listed.
    listed: Vec<Vector3<f64>>,
}

impl Side {
    fn new(surface: &Surface, place: &impl Fn(u32) -> Vector3<f64>) -> Self {
        let mut edges = BTreeMap::<[u32; 2], Edge>::new();
        for &[a, b, c] in &surface.faces {
            for [from, to, across] in [[a, b, c], [b, c, a], [c, a, b]] {
                let fresh = Edge { ends: [from, to], across: [across; 2] };
                let both = edges.entry([from.min(to), from.max(to)]).or_insert(fresh);
                both.across[1] = across;
            }
        }
        let edges: Vec<Edge> = edges.into_values().collect();
        let borders = edges.iter().filter(|edge| edge.across[0] == edge.across[1]);
        let mut border: Vec<u32> = borders.flat_map(|edge| edge.ends).collect();
        border.sort_unstable();
        border.dedup();
        let face_tree = Tree::new(surface.faces.len(), |face| around(surface.faces[face as usize], place));
        let edge_tree = Tree::new(edges.len(), |edge| around(edges[edge as usize].ends, place));
        let turned = surface.faces.iter().flat_map(|&[a, b, c]| [(a, [b, c]), (b, [c, a]), (c, [a, b])]);
        let mut around_nodes: Vec<(u32, [u32; 2])> = turned.collect();
        around_nodes.sort_by_key(|&(node, _)| node);
        let end = |&node: &u32| around_nodes.partition_point(|&(known, _)| known <= node);
        Self {
            nodes: surface.nodes.clone(),
            faces: surface.faces.clone(),
            edges,
            border,
            ring_ends: surface.nodes.iter().map(end).collect(),
            rings: around_nodes.into_iter().map(|(_, others)| others).collect(),
            face_tree,
            edge_tree,
            listed: Vec::new(),
        }
    }

    /// The triangles around a node, by its place among the nodes.
    fn ring(&self, index: usize) -> &[[u32; 2]] {
        let first = index.checked_sub(1).map_or(0, |before| self.ring_ends[before]);
        &self.rings[first..self.ring_ends[index]]
    }

    /// The outward normal of a node, by its place among the nodes.
    fn outward(&self, index: usize, place: &impl Fn(u32) -> Vector3<f64>) -> Vector3<f64> {
        let at = place(self.nodes[index]);
        let area = |&[b, c]: &[u32; 2]| (place(b) - at).cross(&(place(c) - at));
        self.ring(index).iter().map(area).sum::<Vector3<f64>>().try_normalize(0.0).unwrap_or_default()
    }

    /// The square of the longest way [m²] of a node since candidates were listed.
    fn moved(&self, place: &impl Fn(u32) -> Vector3<f64>) -> f64 {
        let ways =
            self.nodes.iter().zip(&self.listed).map(|(&node, then)| (place(node) - then).norm_squared());
        if self.listed.is_empty() { f64::INFINITY } else { ways.fold(0.0, f64::max) }
    }

    fn take_places(&mut self, place: &impl Fn(u32) -> Vector3<f64>) {
        self.listed.clear();
        self.listed.extend(self.nodes.iter().map(|&node| place(node)));
        let Self { faces, edges, face_tree, edge_tree, .. } = self;
        face_tree.refit(|face| around(faces[face as usize], place));
        edge_tree.refit(|edge| around(edges[edge as usize].ends, place));
    }
}

#[inline]
fn around<const N: usize>(nodes: [u32; N], place: &impl Fn(u32) -> Vector3<f64>) -> Bounds {
    Bounds::of(nodes.map(place))
}

/// The distance [m] of two edges: boxes of edges that lie askew reach farther.
fn between(first: &Edge, second: &Edge, place: &impl Fn(u32) -> Vector3<f64>) -> f64 {
    let ([a, b], [c, d]) = (first.ends.map(place), second.ends.map(place));
    edge_edge(&[a, b, c, d]).distance
}

/// Two surfaces, or one, with the candidates for contact.
pub struct Pairs {
    sides: Vec<Side>,
    /// Distance [m] that they keep.
    offset: f64,
    /// The distance [m] that each node keeps, by its number; the same of all nodes beyond its end.
    kept: Vec<f64>,
    /// Distance [m] beyond the one to keep within which pairs are found.
    reach: f64,
    skin: f64,
    depth: f64,
    /// Nodes, by their place in the surface, with triangles of the other surface.
    points: [Vec<[u32; 2]>; 2],
    /// Edges of the first with edges of the second.
    crossings: Vec<[u32; 2]>,
    /// Distance [m] of candidates beyond the range of a step, when they were listed: points by boxes, then
    /// crossings.
    room: [Vec<f32>; 3],
    /// Candidates of one surface that never touch, since they are too near at rest: nodes with triangles,
    /// edges with edges.
    apart: [Vec<[u32; 2]>; 2],
    near: Vec<u32>,
}

impl Pairs {
    /// Makes the pairs of two surfaces that keep a distance [m], or of a surface with itself. `place` gives
    /// the rest places [m] of nodes. Nodes of surfaces are increasing.
    pub fn new(
        first: &Surface,
        second: Option<&Surface>,
        offset: f64,
        place: impl Fn(u32) -> Vector3<f64>,
    ) -> Self {
        let sides: Vec<Side> =
            [Some(first), second].into_iter().flatten().map(|surface| Side::new(surface, &place)).collect();
        let edges = sides.iter().flat_map(|side| &side.edges);
        let (sum, count) = edges.fold((0.0, 0.0_f64), |(sum, count), edge| {
            let [a, b] = edge.ends.map(&place);
            (sum + (b - a).norm(), count + 1.0)
        });
        let mean = sum / count.max(1.0);
        let [reach, skin, depth] = [REACH, SKIN, DEPTH].map(|part| part * mean);
        let (points, crossings, room, apart, near) = Default::default();
        let kept = Vec::new();
        let mut pairs =
            Self { sides, offset, kept, reach, skin, depth, points, crossings, room, apart, near };
        if second.is_none() {
            pairs.set_apart(&place, AT_REST * offset);
        }
        pairs
    }

    /// Nodes that keep a smaller distance [m] than the others, with that distance. Parts of a surface that
    /// are nearer at rest than others keep may then touch each other; only those behind each other never do.
    /// `place` is where nodes are at rest [m].
    #[must_use]
    pub fn keeping(
        mut self,
        near: impl IntoIterator<Item = (u32, f64)>,
        place: impl Fn(u32) -> Vector3<f64>,
    ) -> Self {
        for (node, kept) in near {
            let count = self.kept.len().max(node as usize + 1);
            self.kept.resize(count, self.offset);
            self.kept[node as usize] = kept;
        }
        if self.sides.len() == 1 {
            self.apart = Default::default();
            self.set_apart(&place, 0.0);
        }
        self
    }

    /// Returns the nodes of pairs whose distance is less than the one to keep, whichever way they look, with
    /// the least distance [m]. For two edges, the nodes of the first count.
    pub fn nearer(&mut self, place: impl Fn(u32) -> Vector3<f64>) -> Vec<(u32, f64)> {
        self.list_again(&place);
        let mut least = BTreeMap::<u32, f64>::new();
        let mut note = |node: u32, distance: f64| {
            if distance < self.offset {
                let known = least.entry(node).or_insert(distance);
                *known = known.min(distance);
            }
        };
        for point in self.points() {
            for ([a, b, c], _) in point.faces() {
                note(point.node, point_triangle(&[point.node, a, b, c].map(&place)).distance);
            }
        }
        for [first, second] in self.crossings() {
            let distance = between(&first, &second, &place);
            first.ends.into_iter().for_each(|end| note(end, distance));
        }
        least.into_iter().collect()
    }

    /// The mean length [m] of the edges at rest.
    pub fn mean_edge(&self) -> f64 {
        self.reach / REACH
    }

    /// The distance [m] that each node keeps, by its number, where some keep less than
    /// [`lengths`](Self::lengths) says; the others beyond its end do not.
    pub fn kept(&self) -> &[f64] {
        &self.kept
    }

    /// The distance [m] that two points keep, by the nodes of each and their weights.
    fn kept_by(&self, sides: [&[(u32, f64)]; 2]) -> f64 {
        if self.kept.is_empty() {
            return self.offset;
        }
        let of = |&(node, weight): &(u32, f64)| {
            weight * self.kept.get(node as usize).copied().unwrap_or(self.offset)
        };
        let [first, second] = sides.map(|side| side.iter().map(of).sum::<f64>());
        first.min(second).clamp(0.0, self.offset)
    }

    /// Finds the parts of a surface that are nearer each other at rest than a distance [m]. They are
    /// neighbours, or on both sides of a thin part.
    fn set_apart(&mut self, place: &impl Fn(u32) -> Vector3<f64>, keep: f64) {
        self.list(place, keep.max(2.0 * self.depth) + self.skin);
        let side = &self.sides[0];
        let behind = |distance: f64| -2.0 * self.depth < distance && distance < keep;
        let points = self.points[0].iter().filter(|[node, face]| {
            let corners = side.faces[*face as usize].map(place);
            let above = Above::of(&corners, &place(side.nodes[*node as usize]), BESIDE);
            above.is_inner && behind(above.height) || above.distance() < keep
        });
        let crossings = self.crossings.iter().filter(|[first, second]| {
            let edges = [first, second].map(|&edge| &side.edges[edge as usize]);
            let across = Across::of(edges, f64::INFINITY, place);
            across.is_some_and(|across| behind(across.distance))
        });
        let mut apart = [points.copied().collect::<Vec<_>>(), crossings.copied().collect()];
        apart.iter_mut().for_each(|list| list.sort_unstable());
        self.apart = apart;
        self.sides.iter_mut().for_each(|side| side.listed.clear());
    }

    /// Number of candidates of a surface that never touch each other because they are too near at rest.
    pub fn set_apart_count(&self) -> usize {
        self.apart.iter().map(Vec::len).sum()
    }

    /// Returns the range [m] of a node or an edge: boxes of its partners are within that distance.
    fn within(&self) -> f64 {
        (self.offset + self.reach).max(self.depth)
    }

    /// Lists candidates anew if nodes have moved too far for the lists.
    pub fn update(&mut self, place: impl Fn(u32) -> Vector3<f64>) {
        let moved = self.sides.iter().map(|side| side.moved(&place)).fold(0.0, f64::max);
        if moved > (0.5 * self.skin).powi(2) {
            self.list_again(place);
        }
    }

    /// Lists candidates anew; returns how far [m] nodes may move before the lists miss something.
    pub fn list_again(&mut self, place: impl Fn(u32) -> Vector3<f64>) -> f64 {
        self.list(&place, self.within() + HELD * self.skin);
        0.5 * self.skin
    }

    /// Lists candidates whose boxes are within a reach [m].
    fn list(&mut self, place: &impl Fn(u32) -> Vector3<f64>, reach: f64) {
        self.sides.iter_mut().for_each(|side| side.take_places(place));
        let within = self.within();
        let Self { sides, points, crossings, room, apart, near, .. } = self;
        near.clear();
        room.iter_mut().for_each(Vec::clear);
        let alone = sides.len() == 1;
        let other = |side: usize| if alone { &sides[0] } else { &sides[1 - side] };
        for (number, side) in sides.iter().enumerate() {
            let (list, other) = (&mut points[number], other(number));
            list.clear();
            for ((&node, at), index) in side.nodes.iter().zip(&side.listed).zip(0..) {
                let wanted = Bounds::of([*at]).grown(reach);
                let first = list.len();
                other.face_tree.near(&wanted, |face| {
                    let corners = other.faces[face as usize];
                    let meets = !corners.contains(&node) && around(corners, place).touches(&wanted);
                    if meets && apart[0].binary_search(&[index, face]).is_err() {
                        list.push([index, face]);
                    }
                });
                list[first..].sort_unstable();
                for [_, face] in &list[first..] {
                    let corners = other.faces[*face as usize];
                    room[number].push((around(corners, place).apart(&Bounds::of([*at])) - within) as f32);
                    near.extend(corners);
                }
                near.extend((list.len() > first).then_some(node));
            }
        }
        crossings.clear();
        let (side, other) = (&sides[0], other(0));
        for (edge, number) in side.edges.iter().zip(0..) {
            let wanted = around(edge.ends, place).grown(reach);
            let first = crossings.len();
            other.edge_tree.near(&wanted, |against| {
                let ends = other.edges[against as usize].ends;
                let once = !alone || number < against && !edge.ends.iter().any(|end| ends.contains(end));
                if once
                    && around(ends, place).touches(&wanted)
                    && apart[1].binary_search(&[number, against]).is_err()
                    && between(edge, &other.edges[against as usize], place) <= reach
                {
                    crossings.push([number, against]);
                }
            });
            crossings[first..].sort_unstable();
            for [_, against] in &crossings[first..] {
                near.extend(other.edges[*against as usize].ends);
            }
            near.extend(edge.ends.iter().take(if crossings.len() > first { 2 } else { 0 }));
        }
        near.sort_unstable();
        near.dedup();
        let distances = crossings.iter().map(|&[first, second]| {
            between(&side.edges[first as usize], &other.edges[second as usize], place)
        });
        room[2].extend(distances.map(|distance| (distance - within) as f32));
    }

    /// Nodes of all candidates, increasing.
    pub fn near(&self) -> &[u32] {
        &self.near
    }

    /// The distance to keep, how far beyond that pairs are found, and the overlap up to which a surface is
    /// seen from behind [m].
    pub fn lengths(&self) -> [f64; 3] {
        [self.offset, self.reach, self.depth]
    }

    #[inline]
    fn other(&self, side: usize) -> &Side {
        if self.sides.len() == 1 { &self.sides[0] } else { &self.sides[1 - side] }
    }

    /// The nodes with candidates, in the order in which [`find`](Self::find) takes them.
    pub fn points(&self) -> impl Iterator<Item = Point<'_>> {
        let of_side = move |(number, side)| {
            let (side, other): (&Side, _) = (side, self.other(number));
            self.points[number].chunk_by(|a, b| a[0] == b[0]).map(move |list| Point {
                node: side.nodes[list[0][0] as usize],
                ring: side.ring(list[0][0] as usize),
                in_order: number == 0,
                list,
                other,
            })
        };
        self.sides.iter().enumerate().flat_map(of_side)
    }

    /// The pairs of edges that are candidates, in the order in which [`find`](Self::find) takes them.
    pub fn crossings(&self) -> impl Iterator<Item = [Edge; 2]> {
        let edge = |side: &Side, edge: u32| side.edges[edge as usize];
        self.crossings.iter().map(move |&[a, b]| [edge(&self.sides[0], a), edge(self.other(0), b)])
    }

    /// Calls back with the pairs that are nearer than the reach beyond the distance to keep, with nodes at
    /// places [m]. As long as the lists hold, the result depends on these places alone.
    pub fn find(&self, place: impl Fn(u32) -> Vector3<f64>, mut found: impl FnMut(Pair)) {
        let (limit, within) = (self.offset + self.reach, self.within());
        let wanted = |pair: &Pair| -self.depth < pair.distance && pair.distance < limit;
        // Candidates come nearer by what both have moved at most. So most of the skin need no look.
        let moved = self.sides.iter().map(|side| side.moved(&place)).fold(0.0, f64::max).sqrt();
        let closed = (2.0 * ROUND_OFF * moved) as f32;
        let mut rows = Vec::new();
        for (number, side) in self.sides.iter().enumerate() {
            let mut room = &self.room[number][..];
            for list in self.points[number].chunk_by(|a, b| a[0] == b[0]) {
                let (rooms, rest) = room.split_at(list.len());
                room = rest;
                let near =
                    list.iter().zip(rooms).filter(|(_, room)| **room <= closed).map(|([_, face], _)| *face);
                let of_node = (list[0][0] as usize, side);
                self.find_above(of_node, (near, self.other(number)), &place, &mut rows, |pair| {
                    if wanted(&pair) {
                        found(Pair { in_order: number == 0, ..pair });
                    }
                });
            }
        }
        let other = self.other(0);
        let mut room = &self.room[2][..];
        for list in self.crossings.chunk_by(|a, b| a[0] == b[0]) {
            let (rooms, rest) = room.split_at(list.len());
            room = rest;
            let first = &self.sides[0].edges[list[0][0] as usize];
            let near = around(first.ends, &place).grown(within);
            for (&[_, second], _) in list.iter().zip(rooms).filter(|(_, room)| **room <= closed) {
                let second = &other.edges[second as usize];
                // Boxes are compared in a fifth of the time of closest points.
                if !around(second.ends, &place).touches(&near) {
                    continue;
                }
                let Some(Across { weights: [s, t], normal, distance }) =
                    Across::of([first, second], within, &place)
                else {
                    continue;
                };
                let [[a, b], [c, d]] = [first.ends, second.ends];
                let weights = [1.0 - s, s, t - 1.0, -t];
                let kept = self.kept_by([&[(a, 1.0 - s), (b, s)], &[(c, 1.0 - t), (d, t)]]);
                let pair = Pair { nodes: [a, b, c, d], weights, normal, distance, kept, in_order: true };
                if wanted(&pair) {
                    found(pair);
                }
            }
        }
    }

    /// Calls back with the pairs of a node, by its index in its surface, and the triangles that may be near
    /// it. `rows` is memory for pairs.
    fn find_above(
        &self,
        (index, side): (usize, &Side),
        (list, other): (impl Iterator<Item = u32>, &Side),
        place: &impl Fn(u32) -> Vector3<f64>,
        rows: &mut Vec<(u32, Pair)>,
        mut found: impl FnMut(Pair),
    ) {
        let node = side.nodes[index];
        let point = place(node);
        let within = self.within();
        let wanted = Bounds::of([point]).grown(within);
        let mut outward = None;
        let pair = |[a, b, c]: [u32; 3], [u, v, w]: [f64; 3], normal, distance| Pair {
            nodes: [node, a, b, c],
            weights: [1.0, -u, -v, -w],
            normal,
            distance,
            kept: self.kept_by([&[(node, 1.0)], &[(a, u), (b, v), (c, w)]]),
            in_order: true,
        };
        let mut nearest = Nearest::default();
        let mut seen = Seen { beneath: None, above: f64::INFINITY, on: ON * self.depth, rows };
        // The least distance from a triangle that faces away: no contact, but perhaps a shorter way out.
        let mut hidden = f64::INFINITY;
        seen.rows.clear();
        for face in list {
            let nodes = other.faces[face as usize];
            let [a, b, c] = nodes;
            let corners = [place(a), place(b), place(c)];
            if !Bounds::of(corners).touches(&wanted) || is_beyond(within, &corners, &point) {
                continue;
            }
            let outward = *outward.get_or_insert_with(|| side.outward(index, place));
            let mut here = Above::of(&corners, &point, BESIDE);
            if here.is_beside() && here.normal.dot(&outward) > -FACING {
                here = Above::of(&corners, &point, 0.0);
            }
            let faces_away = here.normal.dot(&outward) > FACING;
            if here.is_inner && faces_away {
                hidden = hidden.min(here.height.abs());
                continue;
            }
            if here.is_inner {
                seen.add(face, pair(nodes, here.weights, here.normal, here.height));
            } else {
                nearest.take(face, &here, faces_away);
            }
        }
        if nearest.faces
            && nearest.distance < seen.above.min(hidden) * (1.0 - SAME)
            && let Some((normal, distance)) = nearest.outward(other, seen.on)
        {
            let nodes = other.faces[nearest.face as usize];
            seen.add(nearest.face, pair(nodes, nearest.weights, normal, distance));
        }
        match seen.beneath {
            Some(Pair { distance, .. }) if -distance > hidden && -distance > SLIGHT * self.depth => {}
            Some(pair) if -pair.distance < seen.above => found(pair),
            _ => seen.rows.drain(..).for_each(|(_, pair)| found(pair)),
        }
    }
}

/// The triangles and edges of a surface that a node meets.
struct Seen<'r> {
    /// Pair with the nearest triangle above the node: a node inside leaves by the shortest way.
    beneath: Option<Pair>,
    /// The least distance [m] from the triangles that it lies above, or on.
    above: f64,
    /// The overlap [m] up to which it lies on a triangle.
    on: f64,
    /// The pairs with these, by increasing triangles.
    rows: &'r mut Vec<(u32, Pair)>,
}

impl Seen<'_> {
    #[inline]
    fn add(&mut self, face: u32, pair: Pair) {
        if pair.distance >= -self.on {
            self.above = self.above.min(pair.distance);
            self.rows.insert(self.rows.partition_point(|&(known, _)| known < face), (face, pair));
        } else if self.beneath.is_none_or(|known| known.distance < pair.distance) {
            self.beneath = Some(pair);
        }
    }
}

/// The nearest edge or corner of a surface to a node.
struct Nearest {
    distance: f64,
    /// The way [m] from there.
    way: Vector3<f64>,
    /// The sum of the normals of its triangles.
    normals: Vector3<f64>,
    /// True if one of these triangles does not face away.
    faces: bool,
    /// The first of its triangles, and the weights in it.
    face: u32,
    weights: [f64; 3],
}

impl Default for Nearest {
    #[inline]
    fn default() -> Self {
        let none = Vector3::zeros();
        Self { distance: f64::INFINITY, way: none, normals: none, faces: false, face: 0, weights: [0.0; 3] }
    }
}

impl Nearest {
    /// Takes the nearest point of a triangle, if nothing was nearer.
    #[inline]
    fn take(&mut self, face: u32, here: &Above, faces_away: bool) {
        let distance = here.distance();
        if distance < self.distance * (1.0 - SAME) {
            let (way, normals, weights) = (here.way, here.normal, here.weights);
            *self = Self { distance, way, normals, faces: !faces_away, face, weights };
        } else if distance <= self.distance * (1.0 + SAME) {
            self.normals += here.normal;
            self.faces |= !faces_away;
        }
    }

    /// The outward normal there and the distance [m] along it, with the overlap [m] up to which a node lies
    /// on it; `None` beside an open surface.
    #[inline]
    fn outward(&self, surface: &Side, on: f64) -> Option<(Vector3<f64>, f64)> {
        let Self { distance, way, normals, .. } = self;
        // A node in the plane of a triangle, but outside the triangle, is not beneath it.
        let sign = if way.dot(normals) < -SAME * distance * normals.norm() { -1.0 } else { 1.0 };
        // A node behind a border is beside the surface.
        let nodes = surface.faces[self.face as usize];
        let mut at = nodes.iter().zip(&self.weights).filter(|(_, weight)| **weight != 0.0);
        let beside = sign < 0.0 && at.all(|(node, _)| surface.border.binary_search(node).is_ok());
        let normal = (way * sign).try_normalize(on).or_else(|| normals.try_normalize(0.0));
        normal.filter(|_| !beside).map(|normal| (normal, sign * distance))
    }
}

#[cfg(test)]
mod tests;
