//! Lines that follow a body: fibres, and the edges of a marked cell. Each connects two combinations of
//! points, the middle ± half of the line. So the shader draws a line in any deformed state from the points
//! alone. A fibre is h F·a₀ with F = Σ x_a ⊗ ∇N_a of its cell, hence h Σ x_a (∇N_a·a₀).

use std::collections::BTreeSet;

use bytemuck::{Pod, Zeroable};
use pliant_geometry::{CellKind, Vector3, boundary};
use pliant_geometry::{DataArray, Mesh};

/// A line between combinations of at most eight points.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub(crate) struct Line {
    nodes: [u32; 8],
    /// Parts of the nodes in its middle.
    middle: [f32; 8],
    /// Weights of the nodes in half of the line.
    half: [f32; 8],
}

impl Line {
    /// From a place on an edge to one on another: two nodes each, and the part of the way from the first to
    /// the second.
    pub fn across([from, to]: [([u32; 2], f64); 2]) -> Self {
        let mut line = Self::default();
        for (at, (nodes, part), sign) in [(0, from, -0.5), (2, to, 0.5)] {
            for (node, weight) in [(0, 1.0 - part), (1, part)] {
                line.nodes[at + node] = nodes[node];
                line.middle[at + node] = 0.5 * weight as f32;
                line.half[at + node] = sign * weight as f32;
            }
        }
        line
    }

    /// Its ends [m] at some points.
    #[cfg(test)]
    pub fn at(&self, points: &[Vector3]) -> [Vector3; 2] {
        let sum = |sign: f32| {
            let weights =
                self.middle.iter().zip(&self.half).map(|(middle, half)| f64::from(middle + sign * half));
            self.nodes.iter().zip(weights).map(|(&node, weight)| points[node as usize] * weight).sum()
        };
        [sum(-1.0), sum(1.0)]
    }

    /// The points that an edge connects.
    pub fn ends(&self) -> [u32; 2] {
        [self.nodes[0], self.nodes[1]]
    }
}

/// The most edges of a cell.
pub(crate) const MOST_EDGES: usize = 12;
/// Approximate number of cubes along a surface. Each cube shows one fibre.
const CUBES: f64 = 1500.0;
/// Length of a fibre over the distance to the next.
const LENGTH: f64 = 0.8;

/// Local nodes of the edges of a cell.
pub(crate) const fn edges(kind: CellKind) -> &'static [[usize; 2]] {
    match kind {
        CellKind::Tet => &[[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]],
        CellKind::Hex => {
            &[[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]]
        }
        CellKind::Triangle => &[[0, 1], [1, 2], [2, 0]],
        CellKind::Quad => &[[0, 1], [1, 2], [2, 3], [3, 0]],
        CellKind::Line => &[[0, 1]],
        CellKind::Vertex => &[],
    }
}

/// The edges of a cell.
pub(crate) fn outline(kind: CellKind, nodes: &[u32]) -> Vec<Line> {
    let line = |&[a, b]: &[usize; 2]| {
        let mut line = Line::default();
        (line.nodes[0], line.nodes[1]) = (nodes[a], nodes[b]);
        line.middle[..2].fill(0.5);
        (line.half[0], line.half[1]) = (-0.5, 0.5);
        line
    };
    edges(kind).iter().map(line).collect()
}

/// Derivatives of the shape functions at the middle of a volume cell.
fn shape_derivatives(kind: CellKind) -> Vec<Vector3> {
    let hex =
        [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]];
    let derivative = |signs: [i32; 3]| Vector3::from(signs.map(f64::from)) / 8.0;
    match kind {
        CellKind::Tet => {
            [[-1.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Vector3::from).to_vec()
        }
        CellKind::Hex => hex.map(derivative).to_vec(),
        _ => Vec::new(),
    }
}

/// Directions of fibres at rest in volume cells.
#[derive(Clone, Debug, Default)]
pub(crate) struct Fibres {
    /// Direction in each volume cell, in the order of the subject; empty if no cell has fibres.
    directions: Vec<Vector3>,
    /// Edge of the cubes they are chosen from [m].
    cube: f64,
    /// Half of a length of a fibre [m].
    half: f64,
    /// Fibres on the surface.
    pub surface: Vec<Line>,
}

impl Fibres {
    /// Takes the field `fibre` of the cells of a mesh; each cell with its kind and nodes.
    pub fn new(mesh: &Mesh, cells: &[(CellKind, Vec<u32>)]) -> Self {
        let known = |array: &&DataArray| array.components == 3;
        let direction = |array: &DataArray, cell: usize| Vector3::from_column_slice(array.item(cell));
        let mut directions = Vec::new();
        for (kind, nodes) in cells.iter().filter(|(kind, _)| kind.dimension() == 3) {
            let count = nodes.len() / kind.node_count();
            let array = mesh.block(*kind).and_then(|block| block.data.get("fibre")).filter(known);
            directions.extend((0..count).map(|cell| match array {
                Some(array) if cell < array.len() && direction(array, cell).norm() > 0.5 => {
                    direction(array, cell)
                }
                _ => Vector3::zeros(),
            }));
        }
        if directions.iter().all(|direction| direction.norm() == 0.0) {
            return Self::default();
        }
        let mut fibres = Self { directions, ..Self::default() };
        fibres.choose(mesh, cells);
        fibres
    }

    /// Chooses fibres on the surface, evenly.
    fn choose(&mut self, mesh: &Mesh, cells: &[(CellKind, Vec<u32>)]) {
        let faces = boundary(mesh).faces;
        let area: f64 = faces.iter().map(|face| face.area(&mesh.points)).sum();
        self.cube = (area / CUBES).sqrt();
        let mut taken = BTreeSet::new();
        let chosen: Vec<_> = (faces.iter())
            .filter(|face| {
                let nodes = face.nodes();
                let sum: Vector3 = nodes.iter().map(|&node| mesh.points[node as usize]).sum();
                taken.insert(self.cube_of(&(sum / nodes.len() as f64)))
            })
            .collect();
        self.half = 0.5 * LENGTH * (area / chosen.len().max(1) as f64).sqrt();
        let mut first = 0;
        for (kind, nodes) in cells.iter().filter(|(kind, _)| kind.dimension() == 3) {
            let per_cell = kind.node_count();
            for face in chosen.iter().filter(|face| face.parent.kind == *kind) {
                let at = face.parent.index as usize;
                let cell_nodes = &nodes[at * per_cell..(at + 1) * per_cell];
                let part = 1.0 / face.nodes().len() as f64;
                let parts: Vec<f64> = cell_nodes
                    .iter()
                    .map(|node| if face.nodes().contains(node) { part } else { 0.0 })
                    .collect();
                self.surface.extend(self.line(first + at, *kind, cell_nodes, &mesh.points, &parts));
            }
            first += nodes.len() / per_cell;
        }
    }

    /// True if there are no fibres.
    pub fn is_empty(&self) -> bool {
        self.directions.is_empty()
    }

    /// The cube that a place lies in.
    pub(crate) fn cube_of(&self, place: &Vector3) -> [i64; 3] {
        [0, 1, 2].map(|c| (place[c] / self.cube).floor() as i64)
    }

    /// The fibre of a cell, through a position in it given by node weights. `None` if the cell has none.
    pub fn line(
        &self,
        cell: usize,
        kind: CellKind,
        nodes: &[u32],
        rest: &[Vector3],
        parts: &[f64],
    ) -> Option<Line> {
        let direction = self.directions.get(cell)?;
        let derivatives = shape_derivatives(kind);
        let mut jacobian = nalgebra::Matrix3::zeros();
        for (&node, derivative) in nodes.iter().zip(&derivatives) {
            jacobian += rest[node as usize] * derivative.transpose();
        }
        // ∇N·a₀ = (∂N/∂ξ)ᵀ J⁻¹ a₀.
        let along = self.half * (jacobian.try_inverse()? * direction.try_normalize(0.5)?);
        let mut line = Line::default();
        for (slot, (&node, derivative)) in nodes.iter().zip(&derivatives).enumerate() {
            line.nodes[slot] = node;
            line.middle[slot] = parts[slot] as f32;
            line.half[slot] = derivative.dot(&along) as f32;
        }
        Some(line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::subject::Subject;
    use crate::subject::tests::{block, tets};

    fn ends(line: &Line, points: &[Vector3]) -> [Vector3; 2] {
        let sum = |parts: &[f32; 8]| {
            let nodes = line.nodes.iter().zip(parts);
            nodes.map(|(&node, &part)| points[node as usize] * f64::from(part)).sum::<Vector3>()
        };
        [sum(&line.middle) - sum(&line.half), sum(&line.middle) + sum(&line.half)]
    }

    #[test]
    fn fibres_turn_and_stretch_with_the_body() {
        for mut mesh in [block(4), tets(3)] {
            let count = mesh.blocks[0].len();
            let along = Vector3::new(0.6, 0.0, 0.8);
            let values = (0..count).flat_map(|_| [along.x, along.y, along.z]).collect();
            mesh.blocks[0].data.insert("fibre".into(), DataArray { components: 3, values });
            let subject = Subject::new(&mesh);
            let gradient = nalgebra::Matrix3::new(0.2, -1.1, 0.0, 0.9, 0.3, 0.1, 0.0, 0.0, 1.4);
            let moved: Vec<Vector3> = mesh.points.iter().map(|point| gradient * point).collect();
            let surface = &subject.fibres.surface;
            assert!(!surface.is_empty() && surface.len() < 6000, "{}", surface.len());
            for line in surface {
                let [a, b] = ends(line, &moved);
                let expected = gradient * along * (2.0 * subject.fibres.half);
                assert!((b - a - expected).norm() < 1e-6, "{} {expected}", b - a);
                let [a, b] = ends(line, &mesh.points);
                let middle = 0.5 * (a + b);
                let depth = middle.iter().map(|x| x.min(1.0 - x)).fold(f64::INFINITY, f64::min);
                assert!(depth.abs() < 1e-6, "on the surface: {middle}");
            }
        }
    }

    #[test]
    fn of_a_fine_mesh_some_thousands_are_drawn_all_over_it() {
        let mut mesh = block(48);
        let values = (0..mesh.blocks[0].len()).flat_map(|_| [1.0, 0.0, 0.0]).collect();
        mesh.blocks[0].data.insert("fibre".into(), DataArray { components: 3, values });
        let subject = Subject::new(&mesh);
        let surface = &subject.fibres.surface;
        assert!((500..4000).contains(&surface.len()), "{}", surface.len());
        let mut octants = [0; 8];
        for line in surface {
            let [a, b] = ends(line, &mesh.points);
            let middle = 0.5 * (a + b);
            octants[(0..3).map(|c| usize::from(middle[c] > 0.5) << c).sum::<usize>()] += 1;
        }
        assert!(octants.iter().all(|&count| count * 16 > surface.len()), "{octants:?}");
    }

    #[test]
    fn a_body_without_fibres_has_none() {
        let mut mesh = block(2);
        assert!(Subject::new(&mesh).fibres.is_empty());
        mesh.blocks[0].data.insert("fibre".into(), DataArray { components: 3, values: vec![0.0; 24] });
        assert!(Subject::new(&mesh).fibres.is_empty());
    }
}
