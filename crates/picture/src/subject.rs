//! The drawn parts of a mesh: its surface as triangles whose corners share normals where the surface is
//! smooth, and its volume cells for sections.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use pliant_geometry::{
    CellBlock, CellId, CellKind, Face, Mesh, Region, Vector3, borders, boundary, cell_body, cell_label,
    vector_area, volume,
};

use crate::lines::{Fibres, Line, outline};
use crate::regions::{Kind, Paint, Regions};

/// Cosine of the angle between faces [75°] from which on their edge is sharp: the round sides of a coarse
/// organ stay smooth.
const SHARP: f64 = 0.26;

/// The surface and the cells of a mesh, ready to be drawn in any deformed state.
#[derive(Clone, Debug, Default)]
pub struct Subject {
    /// Points at rest [m].
    pub points: Vec<Vector3>,
    /// Three corners, each a vertex, and a word. The word has a bit for each edge, numbered by the opposite
    /// corner and set if it is an edge of a cell. The other bits hold the marks of things and the kind of the
    /// cell. First come the triangles of the surface, then the borders between labels.
    pub(crate) triangles: Vec<[u32; 4]>,
    /// Number of triangles of the surface.
    pub(crate) outer: usize,
    /// The kind of the cell beyond each triangle of a border.
    pub(crate) beyond: Vec<u32>,
    /// Kinds of the cells.
    pub(crate) kinds: Vec<Kind>,
    /// The cell of each triangle.
    parents: Vec<CellId>,
    /// The point of each vertex. A point on a sharp edge has several vertices, each with its own normal.
    pub(crate) vertices: Vec<u32>,
    /// Number of vertices of the surface.
    outer_vertices: usize,
    /// Beginning of the triangles around each vertex in the next list; one more entry than vertices.
    pub(crate) offsets: Vec<u32>,
    /// Triangles around vertices.
    pub(crate) around: Vec<u32>,
    /// Cells with a face: kind and nodes.
    cells: Vec<(CellKind, Vec<u32>)>,
    /// Marks and kind of each volume cell.
    words: Vec<u32>,
    pub(crate) fibres: Fibres,
    /// Cells that are lines, such as ligaments.
    pub(crate) bars: Vec<Line>,
}

/// A face that is drawn: its three or four nodes, and the sides of a triangle that are edges of cells.
struct Patch {
    nodes: Vec<u32>,
    parent: CellId,
    edges: u32,
}

/// Cell data of the triangles of a subdivided element: bit i means that the side opposite to corner i is an
/// edge of the element.
const ELEMENT_EDGES: &str = "element-edges";

fn edges_of(block: Option<&CellBlock>, cell: u32) -> u32 {
    let edges = block.and_then(|block| block.data.get(ELEMENT_EDGES));
    let mask = edges.and_then(|edges| edges.values.get(cell as usize)).filter(|bits| bits.is_finite());
    mask.map_or(0b111, |&bits| bits as u32 & 0b111)
}

/// Cell data: 1 for obstacles and tools, 2 for things whose inside bodies touch, 0 for bodies.
pub(crate) const THING: &str = "thing";

/// Marks the faces of things that bodies touch: they are drawn from the front.
const STEEL: u32 = 0b1_0000;

/// Mark of the triangles of things that hold bodies inside: they are drawn from the back.
const HOLLOW: u32 = 0b10_0000;

/// First bit of the number of the kind in the word of a triangle.
pub(crate) const KIND: u32 = 8;

/// List of the kinds of cells, each once.
#[derive(Default)]
struct Kinds {
    list: Vec<Kind>,
    known: BTreeMap<Kind, u32>,
}

impl Kinds {
    /// Returns the shader's word of a cell without the bits of edges: the marks of a thing, and the number of
    /// its kind.
    fn word(&mut self, block: Option<&CellBlock>, cell: u32) -> u32 {
        let thing = block.and_then(|block| block.data.get(THING)?.values.get(cell as usize).copied());
        let marks = match thing {
            Some(1.0) => STEEL,
            Some(2.0) => STEEL | HOLLOW,
            _ => 0,
        };
        let label = block.filter(|_| marks == 0).and_then(|block| cell_label(block, cell));
        let body = block.map_or(0, |block| cell_body(block, cell));
        let kind = Kind { label, body, thing: marks != 0 };
        let number = *self.known.entry(kind).or_insert_with(|| {
            self.list.push(kind);
            self.list.len() as u32 - 1
        });
        marks | (number << KIND)
    }
}

impl Subject {
    /// The boundary of the volume cells, and triangles and quads that are not on it.
    pub fn new(mesh: &Mesh) -> Self {
        let mut kinds = Kinds::default();
        let mut triangles = Vec::new();
        let mut parents = Vec::new();
        let mut vertices = Vec::new();
        let mut groups: Vec<u32> = Vec::new();
        let mut add = |faces: &[Patch], kinds: &mut Kinds| {
            let normals: Vec<Vector3> = faces.iter().map(|face| normal(&face.nodes, &mesh.points)).collect();
            let Split { corners, vertices: split_vertices, groups: split_groups } =
                split_at_sharp_edges(faces, &normals, &places(mesh, faces));
            let first = vertices.len() as u32;
            let first_group = groups.iter().max().map_or(0, |last| last + 1);
            vertices.extend(split_vertices);
            groups.extend(split_groups.iter().map(|group| first_group + group));
            for (corners, Patch { parent, edges, .. }) in corners.iter().zip(faces) {
                parents.resize(parents.len() + corners.len().saturating_sub(2).min(2), *parent);
                let word = kinds.word(mesh.block(parent.kind), parent.index);
                let corner = |at: usize| first + corners[at];
                match corners.len() {
                    3 => triangles.push([corner(0), corner(1), corner(2), word | edges]),
                    // The second bit of the first half and the third of the other are the diagonal.
                    4 => triangles.extend([
                        [corner(0), corner(1), corner(2), word | 0b101],
                        [corner(0), corner(2), corner(3), word | 0b011],
                    ]),
                    _ => {}
                }
            }
            (triangles.len(), vertices.len())
        };
        let (outer, outer_vertices) = add(&faces(mesh), &mut kinds);
        let mut beyond = Vec::new();
        let mut inner = Vec::new();
        for (face, other) in borders_of_labels(mesh) {
            let kind = kinds.word(mesh.block(other.kind), other.index) >> KIND;
            beyond.resize(beyond.len() + face.nodes.len() - 2, kind);
            inner.push(face);
        }
        add(&inner, &mut kinds);
        let (offsets, around) = around_vertices(&triangles, &groups);
        let cells: Vec<_> = shown_blocks(mesh).map(|block| (block.kind, block.nodes.clone())).collect();
        let volumes = shown_blocks(mesh).filter(|block| block.kind.dimension() == 3);
        let cells_of = |block| (0..CellBlock::len(block) as u32).map(move |cell| (block, cell));
        let words = volumes.flat_map(cells_of).map(|(block, cell)| kinds.word(Some(block), cell)).collect();
        let fibres = Fibres::new(mesh, &cells);
        let lines = mesh.block(CellKind::Line).into_iter().flat_map(CellBlock::cells);
        let known = |nodes: &&[u32]| nodes.iter().all(|&node| (node as usize) < mesh.points.len());
        let bars = lines.filter(known).flat_map(|nodes| outline(CellKind::Line, nodes)).collect();
        Self {
            points: mesh.points.clone(),
            triangles,
            outer,
            beyond,
            kinds: kinds.list,
            parents,
            vertices,
            outer_vertices,
            offsets,
            around,
            cells,
            words,
            fibres,
            bars,
        }
    }

    /// True if its cells have fibres (the field `fibre` of its mesh).
    pub fn has_fibres(&self) -> bool {
        !self.fibres.is_empty()
    }

    /// The edges of a cell, in the order of the mesh.
    pub(crate) fn outline(&self, cell: u32) -> Vec<Line> {
        let cells = self
            .cells
            .iter()
            .flat_map(|(kind, nodes)| nodes.chunks_exact(kind.node_count()).map(move |nodes| (*kind, nodes)));
        cells.skip(cell as usize).take(1).flat_map(|(kind, nodes)| outline(kind, nodes)).collect()
    }

    /// True if a field has values, but none at one of some points.
    pub fn lacks_value(&self, points: &[u32], values: &[f64]) -> bool {
        !values.is_empty() && points.iter().any(|&point| !values[point as usize].is_finite())
    }

    /// Returns true for each kind of cells that shows its values. Obstacles and tools do not, nor do
    /// invisible regions or regions with a fixed colour.
    pub(crate) fn showing(&self, regions: &Regions) -> Vec<bool> {
        let shows = |kind: &Kind| {
            let coat = regions.coat(*kind);
            coat.paint == Paint::AsAll && coat.opacity > 0.0 && !kind.thing
        };
        self.kinds.iter().map(shows).collect()
    }

    /// Points of the surface that show values, increasing, each once.
    pub fn showing_points(&self, regions: &Regions) -> Vec<u32> {
        let shows = self.showing(regions);
        let outer =
            self.triangles[..self.outer].iter().filter(|triangle| shows[(triangle[3] >> KIND) as usize]);
        let mut points: Vec<u32> =
            outer.flat_map(|triangle| &triangle[..3]).map(|&vertex| self.vertices[vertex as usize]).collect();
        points.sort_unstable();
        points.dedup();
        points
    }

    /// Returns the labels that are visible in colours of labels. They are on visible points of the surface,
    /// on visible borders within transparent bodies, and in the kinds of cells that a section cuts.
    pub(crate) fn labels_seen(
        &self,
        regions: &Regions,
        is_seen: impl Fn(u32) -> bool,
        cut: impl Iterator<Item = u32>,
    ) -> BTreeSet<i32> {
        let through = self.kinds.iter().any(|kind| regions.coat(*kind).opacity < 1.0);
        let drawn = if through { &self.triangles[..] } else { &self.triangles[..self.outer] };
        let seen = |triangle: &&[u32; 4]| {
            triangle[..3].iter().any(|&vertex| is_seen(self.vertices[vertex as usize]))
        };
        let surface = drawn.iter().filter(seen).map(|triangle| triangle[3] >> KIND);
        let beyond = self.beyond.iter().copied().filter(|_| through);
        let kinds: BTreeSet<u32> = surface.chain(beyond).chain(cut).collect();
        let kinds = kinds.into_iter().filter_map(|number| self.kinds.get(number as usize));
        kinds
            .filter(|kind| {
                let coat = regions.coat(**kind);
                !kind.thing && coat.opacity > 0.0 && !matches!(coat.paint, Paint::Plain(_))
            })
            .filter_map(|kind| kind.label)
            .collect()
    }

    /// The diagonal of the box around the surface at rest [m].
    pub fn extent(&self) -> f64 {
        let points = self.surface_points().into_iter().map(|point| [self.points[point as usize]; 2]);
        let around = points.reduce(|[a, b], [c, d]| [a.inf(&c), b.sup(&d)]);
        around.map_or(0.0, |[low, high]| (high - low).norm())
    }

    /// Triangles drawn.
    pub fn triangle_count(&self) -> usize {
        self.outer
    }

    /// True if a triangle is drawn when it is seen from its front, or from its back. Things are drawn from
    /// one side only.
    pub fn is_drawn(&self, triangle: usize, from_front: bool) -> bool {
        let mark = self.triangles[triangle][3] & (STEEL | HOLLOW);
        mark == 0 || (mark == STEEL) == from_front
    }

    /// A triangle of each obstacle and tool.
    pub fn things(&self) -> Vec<u32> {
        let mut known = BTreeSet::new();
        let outer = self.triangles[..self.outer].iter().zip(0..);
        let of_things = outer.filter(|(triangle, _)| triangle[3] & STEEL != 0);
        of_things
            .filter(|(triangle, _)| known.insert(triangle[3] >> KIND))
            .map(|(_, number)| number)
            .collect()
    }

    /// The points of each triangle, in the order in which they are drawn.
    pub fn triangles(&self) -> impl ExactSizeIterator<Item = [u32; 3]> + '_ {
        self.triangles[..self.outer]
            .iter()
            .map(|&[a, b, c, _]| [a, b, c].map(|vertex| self.vertices[vertex as usize]))
    }

    /// The points of the triangles of shells.
    pub(crate) fn shell_triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        let with_parents = self.triangles().zip(&self.parents).zip(&self.triangles);
        let shells = with_parents
            .filter(|((_, parent), triangle)| parent.kind.dimension() == 2 && triangle[3] & STEEL == 0);
        shells.map(|((corners, _), _)| corners)
    }

    /// The cell of the mesh that a triangle is a part of.
    pub fn cell(&self, triangle: usize) -> Option<CellId> {
        self.parents.get(triangle).copied()
    }

    /// Points on the surface and of lines, increasing, each once.
    pub fn surface_points(&self) -> Vec<u32> {
        let mut points = self.vertices[..self.outer_vertices].to_vec();
        points.extend(self.bars.iter().flat_map(Line::ends));
        points.sort_unstable();
        points.dedup();
        points
    }

    /// Marks and kind of a volume cell, as in the word of a triangle.
    pub(crate) fn word(&self, cell: usize) -> u32 {
        self.words.get(cell).copied().unwrap_or(0)
    }

    /// Volume cells with their nodes.
    pub(crate) fn volume_cells(&self) -> impl Iterator<Item = (CellKind, &[u32])> {
        let volumes = self.cells.iter().filter(|(kind, _)| kind.dimension() == 3);
        volumes.flat_map(|(kind, nodes)| nodes.chunks_exact(kind.node_count()).map(move |n| (*kind, n)))
    }
}

/// A mesh without the cells of regions that are hidden; its points stay.
pub fn visible<'m>(mesh: &'m Mesh, hidden: &[Region]) -> Cow<'m, Mesh> {
    if hidden.is_empty() {
        return Cow::Borrowed(mesh);
    }
    let mut rest = mesh.clone();
    rest.drop_regions(hidden);
    Cow::Owned(rest)
}

/// Blocks of cells that have a face, and whose nodes are known.
fn shown_blocks(mesh: &Mesh) -> impl Iterator<Item = &CellBlock> + Clone {
    let known = |block: &&CellBlock| {
        block.kind.dimension() >= 2 && block.nodes.iter().all(|&node| (node as usize) < mesh.points.len())
    };
    mesh.blocks.iter().filter(known)
}

/// The cell with the smallest stable step (the cell field `element-step`), counted over the cells that have a
/// face; and its step [s]. `None` without this field.
pub fn critical_cell(mesh: &Mesh) -> Option<(u32, f64)> {
    let mut first = 0;
    let mut least: Option<(u32, f64)> = None;
    for block in shown_blocks(mesh) {
        if let Some(steps) = block.data.get("element-step") {
            for (&step, cell) in steps.values.iter().zip(first..) {
                if step.is_finite() && least.is_none_or(|(_, smallest)| step < smallest) {
                    least = Some((cell, step));
                }
            }
        }
        first += block.len() as u32;
    }
    least
}

/// The faces that are drawn.
fn faces(mesh: &Mesh) -> Vec<Patch> {
    let skin = boundary(mesh);
    let of_skin = skin.faces.iter().map(|face| Patch {
        nodes: face.nodes().to_vec(),
        parent: face.parent,
        edges: edges_of(mesh.block(face.parent.kind), face.parent.index),
    });
    let mut faces: Vec<Patch> = of_skin.collect();
    if mesh.volume_blocks().all(|block| block.is_empty()) {
        return faces;
    }
    let key = |nodes: &[u32]| {
        let mut key = nodes.to_vec();
        key.sort_unstable();
        key
    };
    let drawn: BTreeSet<Vec<u32>> = faces.iter().map(|face| key(&face.nodes)).collect();
    for block in mesh.blocks.iter().filter(|block| block.kind.dimension() == 2) {
        for (nodes, cell) in block.cells().zip(0..) {
            let known = nodes.iter().all(|&node| (node as usize) < mesh.points.len());
            if known && !drawn.contains(&key(nodes)) {
                let edges = edges_of(Some(block), cell);
                let parent = CellId { kind: block.kind, index: cell };
                faces.push(Patch { nodes: nodes.to_vec(), parent, edges });
            }
        }
    }
    faces
}

/// The faces between volume cells of different labels, each with the cell beyond.
fn borders_of_labels(mesh: &Mesh) -> Vec<(Patch, CellId)> {
    if mesh.volume_blocks().all(|block| !block.data.contains_key("label")) {
        return Vec::new();
    }
    let label = |cell: CellId| mesh.block(cell.kind).and_then(|block| cell_label(block, cell.index));
    let patch = |face: &Face| Patch { nodes: face.nodes().to_vec(), parent: face.parent, edges: 0b111 };
    borders(mesh, label).iter().map(|(face, other)| (patch(face), *other)).collect()
}

fn normal(face: &[u32], points: &[Vector3]) -> Vector3 {
    let corners: Vec<Vector3> = face.iter().map(|&node| points[node as usize]).collect();
    vector_area(&corners).try_normalize(0.0).unwrap_or_default()
}

/// Returns the triangles around each vertex. They include the triangles of all vertices of its group. The
/// result has the beginning of each vertex in the list, and the list.
fn around_vertices(triangles: &[[u32; 4]], groups: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let count = groups.iter().max().map_or(0, |last| *last as usize + 1);
    let mut of_group: Vec<Vec<u32>> = vec![Vec::new(); count];
    for (triangle, number) in triangles.iter().zip(0..) {
        for &vertex in &triangle[..3] {
            of_group[groups[vertex as usize] as usize].push(number);
        }
    }
    let (mut offsets, mut around) = (vec![0], Vec::new());
    for &group in groups {
        around.extend(&of_group[group as usize]);
        offsets.push(around.len() as u32);
    }
    (offsets, around)
}

/// Returns for each point of a mesh the first point of the same body at the same place at rest. So blocks
/// with doubled nodes at their interface have one surface.
fn places(mesh: &Mesh, faces: &[Patch]) -> Vec<u32> {
    let mut places: Vec<u32> = (0..mesh.points.len() as u32).collect();
    let mut known: BTreeMap<([u64; 3], i32), u32> = BTreeMap::new();
    for face in faces {
        let body = mesh.block(face.parent.kind).map_or(0, |block| cell_body(block, face.parent.index));
        for &node in &face.nodes {
            // Zeros of both signs are one.
            let point = mesh.points[node as usize].map(|x| (x + 0.0).to_bits());
            places[node as usize] = *known.entry((point.into(), body)).or_insert(node);
        }
    }
    places
}

/// Faces whose corners are vertices.
struct Split {
    /// The vertices of each face.
    corners: Vec<Vec<u32>>,
    /// The point of each vertex.
    vertices: Vec<u32>,
    /// The group of each vertex. Vertices of one group share their normal.
    groups: Vec<u32>,
}

/// Around a place, faces that meet in edges that are not sharp share a vertex, or several with one normal if
/// points are doubled there.
fn split_at_sharp_edges(faces: &[Patch], normals: &[Vector3], places: &[u32]) -> Split {
    let mut at_place: Vec<Vec<(u32, u32)>> = vec![Vec::new(); places.len()];
    for (face, number) in faces.iter().zip(0..) {
        for (&node, corner) in face.nodes.iter().zip(0..) {
            at_place[places[node as usize] as usize].push((number, corner));
        }
    }
    let mut corners: Vec<Vec<u32>> = faces.iter().map(|face| vec![0; face.nodes.len()]).collect();
    let (mut vertices, mut groups) = (Vec::new(), Vec::new());
    let mut count = 0;
    for around in at_place {
        // Groups of the faces around the place, by the smallest index in it.
        let mut group: Vec<usize> = (0..around.len()).collect();
        let mut by_edge: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (index, &(face, corner)) in around.iter().enumerate() {
            let nodes = &faces[face as usize].nodes;
            let (corner, count) = (corner as usize, nodes.len());
            for other in [nodes[(corner + 1) % count], nodes[(corner + count - 1) % count]] {
                let beside = by_edge.entry(places[other as usize]).or_default();
                for &before in &*beside {
                    let angle = normals[face as usize].dot(&normals[around[before].0 as usize]);
                    if angle > SHARP {
                        let (one, two) = (group[before], group[index]);
                        group.iter_mut().filter(|g| **g == one.max(two)).for_each(|g| *g = one.min(two));
                    }
                }
                beside.push(index);
            }
        }
        let mut number: BTreeMap<(usize, u32), u32> = BTreeMap::new();
        let mut known: BTreeMap<usize, u32> = BTreeMap::new();
        for (&(face, corner), &smooth_group) in around.iter().zip(&group) {
            let point = faces[face as usize].nodes[corner as usize];
            let vertex = *number.entry((smooth_group, point)).or_insert_with(|| {
                vertices.push(point);
                groups.push(*known.entry(smooth_group).or_insert_with(|| {
                    count += 1;
                    count - 1
                }));
                vertices.len() as u32 - 1
            });
            corners[face as usize][corner as usize] = vertex;
        }
    }
    Split { corners, vertices, groups }
}

/// The points of a mesh, moved by its field `displacement` [m] if it has one.
pub fn deformed_points(mesh: &Mesh) -> Vec<Vector3> {
    let mut points = mesh.points.clone();
    if let Some(moved) = mesh.point_data.get("displacement").filter(|array| array.components == 3) {
        for (point, by) in points.iter_mut().zip(moved.values.chunks_exact(3)) {
            *point += Vector3::new(by[0], by[1], by[2]);
        }
    }
    points
}

/// Returns the fields of a mesh that colours can show, with their components, by the names that
/// [`nodal_values`] takes. `label` is included.
pub fn field_choices(mesh: &Mesh) -> Vec<String> {
    let of_cells = mesh.blocks.iter().flat_map(|block| &block.data);
    let fields: BTreeMap<&String, usize> =
        mesh.point_data.iter().chain(of_cells).map(|(name, array)| (name, array.components)).collect();
    let mut choices = Vec::new();
    for (name, components) in fields {
        let parts: &[&str] = match components {
            3 => &["x", "y", "z"],
            9 => &["xx", "yy", "zz", "xy", "yz", "xz"],
            _ => &[],
        };
        if components == 1 && ![ELEMENT_EDGES, THING].contains(&name.as_str()) || components == 3 {
            choices.push(name.clone());
        }
        choices.extend(parts.iter().map(|part| format!("{name}:{part}")));
    }
    choices
}

/// The values of a field at the points of a mesh. Vectors count by their norm, or by a component as in
/// `displacement:z`; tensors need a component, as in `cauchy-stress:xx`. Values of cells are averaged,
/// weighted by volume or area. `None` without this field.
pub fn nodal_values(mesh: &Mesh, field: &str) -> Option<Vec<f64>> {
    let (name, component) = field.split_once(':').map_or((field, None), |(name, part)| (name, Some(part)));
    let number = |item: &[f64]| -> Option<f64> {
        match (item.len(), component) {
            (1, None) => Some(item[0]),
            (3, None) => Some(item.iter().map(|x| x * x).sum::<f64>().sqrt()),
            (3, Some(part)) => item.get(["x", "y", "z"].iter().position(|name| *name == part)?).copied(),
            (9, Some(part)) => {
                let names = ["xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"];
                item.get(names.iter().position(|name| *name == part)?).copied()
            }
            _ => None,
        }
    };
    if let Some(array) = mesh.point_data.get(name) {
        let mut values: Vec<f64> =
            (0..array.len()).map(|index| number(array.item(index))).collect::<Option<_>>()?;
        for block in &mesh.blocks {
            let Some(things) = block.data.get(THING) else { continue };
            let of_things = block.cells().zip(&things.values).filter(|(_, thing)| **thing > 0.0);
            of_things.flat_map(|(nodes, _)| nodes).for_each(|&node| values[node as usize] = f64::NAN);
        }
        return Some(values);
    }
    let mut sums = vec![0.0; mesh.points.len()];
    let mut weights = vec![0.0; mesh.points.len()];
    let mut found = false;
    for block in &mesh.blocks {
        let Some(array) = block.data.get(name) else { continue };
        for (index, nodes) in block.cells().enumerate().take(array.len()) {
            let value = number(array.item(index))?;
            found = true;
            if value.is_nan() {
                continue;
            }
            let corners: Vec<Vector3> = nodes.iter().map(|&node| mesh.points[node as usize]).collect();
            let weight = match block.kind.dimension() {
                3 => volume(block.kind, &corners).abs(),
                2 => vector_area(&corners).norm(),
                _ => continue,
            };
            for &node in nodes {
                sums[node as usize] += value * weight;
                weights[node as usize] += weight;
            }
        }
    }
    found.then(|| sums.iter().zip(weights).map(|(sum, weight)| sum / weight).collect())
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use pliant_geometry::DataArray;

    /// The unit cube in n³ hexes.
    pub fn block(n: u32) -> Mesh {
        let at = |i: u32, j: u32, k: u32| (k * (n + 1) + j) * (n + 1) + i;
        let mut mesh = Mesh::default();
        for k in 0..=n {
            for j in 0..=n {
                for i in 0..=n {
                    mesh.points.push(Vector3::new(i.into(), j.into(), k.into()) / f64::from(n));
                }
            }
        }
        let nodes = &mut mesh.block_mut(CellKind::Hex).nodes;
        for (i, j, k) in (0..n * n * n).map(|c| (c % n, c / n % n, c / n / n)) {
            for k in [k, k + 1] {
                nodes.extend([at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k)]);
            }
        }
        mesh
    }

    /// Returns the unit cube in n³ hexes of six tets each.
    pub fn tets(n: u32) -> Mesh {
        let hexes = block(n);
        let mut mesh = Mesh { points: hexes.points.clone(), ..Mesh::default() };
        // Around the diagonal from 0 to 6 of each.
        let ring = [1, 2, 3, 7, 4, 5, 1];
        let six = |hex: &[u32]| {
            ring.map(|corner| hex[corner])
                .windows(2)
                .map(|p| [hex[0], p[0], p[1], hex[6]])
                .collect::<Vec<_>>()
        };
        let nodes = hexes.blocks[0].cells().flat_map(six).flatten();
        mesh.block_mut(CellKind::Tet).nodes = nodes.collect();
        mesh
    }

    #[test]
    fn corners_of_a_block_have_a_normal_a_side_and_its_sides_share_them() {
        let subject = Subject::new(&block(2));
        assert_eq!(subject.triangle_count(), 48);
        let of_last = (0..48).filter(|&t| subject.cell(t).is_some_and(|cell| cell.index == 7)).count();
        assert_eq!(
            (of_last, subject.cell(48)),
            (6, None),
            "three faces of the last cell are on the boundary"
        );
        // 8 corners with 3, 12 middles of edges with 2, 6 middles of sides with 1.
        assert_eq!(subject.vertices.len(), 8 * 3 + 12 * 2 + 6);
        assert_eq!(subject.around.len(), 48 * 3);
        assert_eq!(subject.surface_points().len(), 26);
        let diagonals = subject.triangles.iter().filter(|t| t[3].count_ones() == 2).count();
        assert_eq!(diagonals, 48, "each half of a quad has two edges of its cell");
    }

    #[test]
    fn a_sheet_that_is_bent_a_little_stays_smooth() {
        let mut mesh = Mesh { points: block(1).points, ..Mesh::default() };
        mesh.points[2].z = 0.2;
        mesh.points[3].z = 0.2;
        mesh.block_mut(CellKind::Triangle).nodes = vec![0, 1, 2, 2, 1, 3];
        assert_eq!(Subject::new(&mesh).vertices.len(), 4);
    }

    #[test]
    fn triangles_and_cells_have_the_kind_of_their_label_and_body() {
        let mut mesh = tets(1);
        mesh.blocks[0].data.insert("label".into(), DataArray::scalar(vec![1.0, 1.0, 2.0, 2.0, 2.0, 1.0]));
        let subject = Subject::new(&mesh);
        let kind = |label: i32| Kind { label: Some(label), body: 0, thing: false };
        assert_eq!(subject.kinds, [kind(1), kind(2)]);
        let of = |number: u32| {
            subject.triangles[..subject.outer].iter().filter(|t| t[3] >> KIND == number).count()
        };
        assert_eq!((of(0), of(1)), (6, 6), "two faces of each tet are on the boundary");
        assert_eq!([subject.word(0), subject.word(2), subject.word(6)], [0, 1 << KIND, 0]);
        // Without the cells that hide them, the faces between the labels are drawn.
        mesh.drop_regions(&[Region::Label(1)]);
        let rest = Subject::new(&mesh);
        assert!(rest.kinds == [kind(2)] && rest.triangle_count() > 6 && rest.beyond.is_empty());
        mesh.blocks[0].data.insert("body".into(), DataArray::scalar(vec![0.0, 3.0, 3.0]));
        assert_eq!(Subject::new(&mesh).kinds[1], Kind { body: 3, ..kind(2) });
        assert_eq!(Subject::new(&tets(1)).triangles[0][3], 0b111, "without labels");
    }

    #[test]
    fn only_sides_that_are_edges_of_elements_are_drawn_as_such() {
        let mut mesh = Mesh { points: block(1).points, ..Mesh::default() };
        let triangles = mesh.block_mut(CellKind::Triangle);
        triangles.nodes = vec![0, 1, 2, 2, 1, 3];
        triangles.data.insert(ELEMENT_EDGES.into(), DataArray::scalar(vec![6.0, f64::NAN]));
        let edges: Vec<u32> = Subject::new(&mesh).triangles.iter().map(|triangle| triangle[3]).collect();
        assert_eq!(edges, [0b110, 0b111]);
        let values = [0.0, 1.0, 2.0, f64::NAN];
        let subject = Subject::new(&mesh);
        let points = subject.showing_points(&Regions::default());
        assert!(subject.lacks_value(&points, &values) && !subject.lacks_value(&points, &[0.0; 4]));
    }

    #[test]
    fn fields_can_be_chosen_by_component_and_points_are_moved() {
        let mut mesh = Mesh { points: block(1).points, ..Mesh::default() };
        mesh.point_data.insert("displacement".into(), DataArray { components: 3, values: vec![0.5; 24] });
        let triangles = mesh.block_mut(CellKind::Triangle);
        triangles.nodes = vec![0, 1, 2];
        triangles.data.insert(ELEMENT_EDGES.into(), DataArray::scalar(vec![7.0]));
        triangles.data.insert("pressure".into(), DataArray::scalar(vec![1.0]));
        triangles.data.insert("stress".into(), DataArray { components: 9, values: vec![1.0; 9] });
        let choices = field_choices(&mesh);
        assert!(choices.iter().all(|choice| nodal_values(&mesh, choice).is_some()), "{choices:?}");
        assert_eq!(
            choices[..5],
            ["displacement", "displacement:x", "displacement:y", "displacement:z", "pressure"]
        );
        assert_eq!(choices.len(), 11);
        assert_eq!(deformed_points(&mesh)[1], mesh.points[1] + Vector3::repeat(0.5));
    }

    /// A tool near a wall: its faces are marked, and the movement of its points is no value of the field.
    #[test]
    fn things_are_marked_and_have_no_values() {
        let mut mesh = Mesh { points: vec![Vector3::zeros(); 7], ..Mesh::default() };
        mesh.points[1].x = 1.0;
        mesh.points[2].y = 1.0;
        let block = mesh.block_mut(CellKind::Triangle);
        block.nodes.extend([0, 1, 2, 3, 4, 5, 3, 4, 6]);
        block.data.insert(THING.into(), DataArray::scalar(vec![0.0, 1.0, 2.0]));
        mesh.point_data.insert("displacement".into(), DataArray { components: 3, values: vec![2.0; 21] });
        let marks = Subject::new(&mesh).triangles.iter().map(|t| t[3] & 0b11_1000).collect::<Vec<_>>();
        assert_eq!(marks, [0, STEEL, STEEL | HOLLOW]);
        assert_eq!(Subject::new(&mesh).things(), [1], "both are of one body");
        let block = mesh.block_mut(CellKind::Triangle);
        block.data.insert("body".into(), DataArray::scalar(vec![0.0, 1.0, 2.0]));
        let subject = Subject::new(&mesh);
        assert_eq!(subject.things(), [1, 2]);
        assert_eq!([0, 1, 2].map(|triangle| subject.is_drawn(triangle, true)), [true, true, false]);
        assert_eq!([0, 1, 2].map(|triangle| subject.is_drawn(triangle, false)), [true, false, true]);
        let values = nodal_values(&mesh, "displacement:x").unwrap();
        assert_eq!(values[..3], [2.0; 3]);
        assert!(values[3..].iter().all(|value| value.is_nan()), "{values:?}");
    }

    #[test]
    fn fields_of_points_and_cells_come_to_the_points() {
        let mut mesh = block(1);
        let vectors = (0..8).flat_map(|i| [3.0 * f64::from(i), 4.0 * f64::from(i), 0.0]).collect();
        mesh.point_data.insert("displacement".into(), DataArray { components: 3, values: vectors });
        mesh.blocks[0].data.insert("von-mises".into(), DataArray::scalar(vec![7.0]));
        mesh.blocks[0]
            .data
            .insert("stress".into(), DataArray { components: 9, values: (0..9).map(f64::from).collect() });
        assert_eq!(nodal_values(&mesh, "displacement").unwrap()[2], 10.0);
        assert_eq!(nodal_values(&mesh, "displacement:y").unwrap()[2], 8.0);
        assert_eq!(nodal_values(&mesh, "von-mises").unwrap(), vec![7.0; 8]);
        assert_eq!(nodal_values(&mesh, "stress:yz").unwrap(), vec![5.0; 8]);
        for none in ["pressure", "stress", "stress:ab", "displacement:w", "von-mises:x"] {
            assert_eq!(nodal_values(&mesh, none), None, "{none}");
        }
    }
}
