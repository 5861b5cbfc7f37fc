//! The mesh of a model or submodel: listed in the XML, or read from a file and then turned, scaled and
//! shifted.

use std::collections::BTreeMap;

use pliant_geometry::{CellKind, DisjointSets, Mesh, Vector3};

use super::Files;
use super::error::{Fault, ImportProblem};
use super::xml::{
    XmlElement, attribute, child, count, fault, indices, needed, number, numbers, numbers_of, text,
};

/// A solid element of NiftySim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Solid {
    T4,
    T4Anp,
    H8,
}

impl Solid {
    fn read(of: XmlElement<'_>) -> Result<Self, Fault> {
        match attribute(of, "Type", "Type=\"T4\", \"T4ANP\" or \"H8\"")? {
            "T4" => Ok(Self::T4),
            "T4ANP" => Ok(Self::T4Anp),
            "H8" => Ok(Self::H8),
            other => {
                let (what, known) = ("element type", "T4, T4ANP, H8");
                Err(fault(of, ImportProblem::Unknown { what, found: other.into(), known }))
            }
        }
    }

    /// Its name in NiftySim.
    pub fn name(self) -> &'static str {
        match self {
            Self::T4 => "T4",
            Self::T4Anp => "T4ANP",
            Self::H8 => "H8",
        }
    }

    /// Its name in a scene.
    pub fn element(self) -> &'static str {
        match self {
            Self::T4 => "tet4",
            Self::T4Anp => "tet4-ianp-niftysim",
            Self::H8 => "hex8",
        }
    }

    pub fn cell(self) -> CellKind {
        match self {
            Self::T4 | Self::T4Anp => CellKind::Tet,
            Self::H8 => CellKind::Hex,
        }
    }

    /// The sides of its cells.
    pub fn face(self) -> CellKind {
        match self {
            Self::T4 | Self::T4Anp => CellKind::Triangle,
            Self::H8 => CellKind::Quad,
        }
    }
}

/// Points, and cells of one kind.
#[derive(Clone, Debug)]
pub(super) struct Geometry {
    pub solid: Solid,
    pub mesh: Mesh,
}

impl Geometry {
    fn new(solid: Solid, points: Vec<Vector3>, cells: Vec<u32>) -> Self {
        let mut mesh = Mesh { points, ..Mesh::default() };
        mesh.block_mut(solid.cell()).nodes = cells;
        Self { solid, mesh }
    }

    pub fn node_count(&self) -> usize {
        self.mesh.points.len()
    }

    pub fn cell_count(&self) -> usize {
        self.cells().len() / self.solid.cell().node_count()
    }

    /// Number of parts without a common node.
    pub(crate) fn piece_count(&self) -> usize {
        let mut pieces = DisjointSets::new(self.node_count());
        let mut used = vec![false; self.node_count()];
        for cell in self.cells().chunks_exact(self.solid.cell().node_count()) {
            for &node in cell {
                used[node as usize] = true;
                pieces.join(cell[0] as usize, node as usize);
            }
        }
        (0..used.len()).filter(|&node| used[node] && pieces.root(node) == node).count()
    }

    /// Nodes of all cells, one after another.
    pub fn cells(&self) -> &[u32] {
        self.mesh.block(self.solid.cell()).map_or(&[], |block| &block.nodes)
    }
}

/// Reads the geometry of a model or submodel.
pub(super) fn read(
    of: XmlElement<'_>,
    files: &Files<'_>,
    notes: &mut Vec<String>,
) -> Result<Geometry, Fault> {
    let geometry = match child(of, "VTKMesh").or_else(|| child(of, "MSHMesh")) {
        Some(file) => from_file(file, files, notes)?,
        None => listed(of)?,
    };
    if geometry.cells().is_empty() {
        return Err(fault(of, ImportProblem::NothingSolid));
    }
    Ok(geometry)
}

fn listed(of: XmlElement<'_>) -> Result<Geometry, Fault> {
    let nodes = needed(of, "Nodes", "<Nodes> and <Elements>, an <MSHMesh> or a <VTKMesh>")?;
    let coordinates = numbers(nodes)?;
    check_listed(nodes, "NumNodes", "coordinates", coordinates.len(), 3)?;
    let points: Vec<_> = coordinates.chunks_exact(3).map(Vector3::from_column_slice).collect();
    let elements = needed(of, "Elements", "<Elements NumEls=\"…\" Type=\"T4\">…</Elements>")?;
    let solid = Solid::read(elements)?;
    let cells = indices(elements, "node", points.len())?;
    check_listed(elements, "NumEls", "node indices", cells.len(), solid.cell().node_count())?;
    Ok(Geometry::new(solid, points, cells))
}

/// Checks that as many numbers are listed as the attribute says, or whole items where it is missing.
pub(super) fn check_listed(
    of: XmlElement<'_>,
    name: &str,
    what: &'static str,
    found: usize,
    each: usize,
) -> Result<(), Fault> {
    let items = match of.attribute(name) {
        Some(word) => count(of, word.trim())?,
        None => found.div_ceil(each),
    };
    if items.checked_mul(each) == Some(found) {
        return Ok(());
    }
    let wanted = format!("{items} × {each}");
    Err(fault(of, ImportProblem::Count { what, found, wanted }))
}

fn from_file(of: XmlElement<'_>, files: &Files<'_>, notes: &mut Vec<String>) -> Result<Geometry, Fault> {
    let solid = Solid::read(of)?;
    let name = text(of);
    if name.is_empty() {
        let problem = ImportProblem::Count { what: "names of mesh files", found: 0, wanted: "1".into() };
        return Err(fault(of, problem));
    }
    let file = files.mesh(&name).map_err(|error| fault(of, ImportProblem::Mesh(Box::new(error))))?;
    // Labels are not taken over: materials go by <ElementSet>.
    let kept = file.notes.iter().filter(|note| !note.contains("`label`"));
    notes.extend(kept.map(|note| format!("{name}: {note}")));
    let cells = file.mesh.block(solid.cell()).map(|block| block.nodes.clone()).unwrap_or_default();
    let mut geometry = Geometry::new(solid, file.mesh.points, cells);
    place(of, &mut geometry.mesh.points)?;
    Ok(geometry)
}

/// Turns about a centre, then scales about the origin, then shifts: NiftySim's order, wherever they stand.
pub(super) fn place(of: XmlElement<'_>, points: &mut [Vector3]) -> Result<(), Fault> {
    if let Some(rotation) = child(of, "Rotation") {
        let [x, y, z, angles @ ..] = numbers_of::<6>(rotation, "numbers of a rotation")?;
        let centre = Vector3::new(x, y, z);
        let [x, y, z] = angles.map(f64::to_radians);
        let about = |axis, angle| nalgebra::Rotation3::from_axis_angle(&axis, angle);
        let turn = about(Vector3::x_axis(), x) * about(Vector3::y_axis(), y) * about(Vector3::z_axis(), z);
        points.iter_mut().for_each(|point| *point = turn * (*point - centre) + centre);
    }
    if let Some(scale) = child(of, "ScaleFactor") {
        let factor = positive(scale, "the scale factor")?;
        points.iter_mut().for_each(|point| *point *= factor);
    }
    if let Some(translation) = child(of, "Translation") {
        let shift = Vector3::from(numbers_of::<3>(translation, "numbers of a translation")?);
        points.iter_mut().for_each(|point| *point += shift);
    }
    Ok(())
}

/// The only number of an element, greater than 0.
pub(super) fn positive(of: XmlElement<'_>, what: &'static str) -> Result<f64, Fault> {
    let value = number(of)?;
    let problem = ImportProblem::OutOfRange { what, value, range: "greater than 0" };
    if value > 0.0 { Ok(value) } else { Err(fault(of, problem)) }
}

/// Puts geometries together. A node closer than `distance` to one that is already there becomes the first
/// such node. Returns for each geometry the node that each of its nodes became. The distance of NiftySim
/// holds within a submodel too, except in the first.
pub(super) fn join(parts: &[Geometry], distance: Option<f64>) -> (Vec<Vector3>, Vec<u32>, Vec<Vec<u32>>) {
    let mut points: Vec<Vector3> = Vec::new();
    let mut cells = Vec::new();
    let mut maps = Vec::new();
    let mut near = Near::new(distance);
    for (part, geometry) in parts.iter().enumerate() {
        let mut map = Vec::with_capacity(geometry.node_count());
        for &point in &geometry.mesh.points {
            let known = if part == 0 { None } else { near.first(&points, point) };
            let node = known.unwrap_or_else(|| {
                points.push(point);
                near.add(points.len() as u32 - 1, point)
            });
            map.push(node);
        }
        cells.extend(geometry.cells().iter().map(|&node| map[node as usize]));
        maps.push(map);
    }
    (points, cells, maps)
}

/// Points in cubes of the size of the distance at which they merge.
struct Near {
    distance: f64,
    cubes: BTreeMap<[i64; 3], Vec<u32>>,
}

impl Near {
    fn new(distance: Option<f64>) -> Self {
        Self { distance: distance.unwrap_or(0.0), cubes: BTreeMap::new() }
    }

    fn cube(&self, point: Vector3) -> [i64; 3] {
        // Saturates far out: points share a cube there, which costs only time.
        [point.x, point.y, point.z].map(|x| (x / self.distance).floor() as i64)
    }

    fn add(&mut self, index: u32, point: Vector3) -> u32 {
        if self.distance > 0.0 {
            self.cubes.entry(self.cube(point)).or_default().push(index);
        }
        index
    }

    /// The smallest index of a point closer than the distance.
    fn first(&self, points: &[Vector3], to: Vector3) -> Option<u32> {
        if self.distance <= 0.0 {
            return None;
        }
        let [x, y, z] = self.cube(to);
        let around = |a: i64| a.saturating_sub(1)..=a.saturating_add(1);
        let cubes = around(x).flat_map(|x| around(y).flat_map(move |y| around(z).map(move |z| [x, y, z])));
        let known = cubes.filter_map(|cube| self.cubes.get(&cube)).flatten().copied();
        known.filter(|&index| (points[index as usize] - to).norm() < self.distance).min()
    }
}
