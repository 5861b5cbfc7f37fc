//! Rigid surfaces of NiftySim as closed ones: a sheet gets a thickness behind its front.

use std::collections::BTreeMap;

use pliant_geometry::{CellKind, Mesh, Vector3};

use super::Files;
use super::error::{Fault, ImportProblem};
use super::geometry::{check_listed, place};
use super::xml::{XmlElement, attribute, child, fault, indices, needed, numbers, text};

/// Thickness of a sheet over the diagonal of its box: eight points of the grid of its distances.
const THICKNESS: f64 = 1.0 / 32.0;

/// Points [m] and triangles.
#[derive(Debug)]
pub(super) struct RigidSurface {
    points: Vec<Vector3>,
    triangles: Vec<[u32; 3]>,
}

/// Reads the surface of a `<ContactSurface>`: listed, or from a file. Quads become two triangles each.
pub(super) fn read(
    of: XmlElement<'_>,
    files: &Files<'_>,
    notes: &mut Vec<String>,
) -> Result<RigidSurface, Fault> {
    match child(of, "VTKSurface") {
        Some(file) => from_file(file, files, notes),
        None => listed(of),
    }
}

fn corners(of: XmlElement<'_>) -> Result<usize, Fault> {
    match attribute(of, "Type", "Type=\"T3\"")? {
        "T3" => Ok(3),
        "Q4" => Ok(4),
        other => {
            let (what, known) = ("type of surface", "T3, Q4");
            Err(fault(of, ImportProblem::Unknown { what, found: other.into(), known }))
        }
    }
}

fn listed(of: XmlElement<'_>) -> Result<RigidSurface, Fault> {
    let nodes = needed(of, "Nodes", "<Nodes> and <Elements>, or a <VTKSurface>")?;
    let coordinates = numbers(nodes)?;
    check_listed(nodes, "NumNodes", "coordinates", coordinates.len(), 3)?;
    let points: Vec<_> = coordinates.chunks_exact(3).map(Vector3::from_column_slice).collect();
    let elements = needed(of, "Elements", "<Elements NumEls=\"…\" Type=\"T3\">…</Elements>")?;
    let corners = corners(elements)?;
    let cells = indices(elements, "node", points.len())?;
    check_listed(elements, "NumEls", "node indices", cells.len(), corners)?;
    some(of, RigidSurface { points, triangles: split(&cells, corners) })
}

fn from_file(of: XmlElement<'_>, files: &Files<'_>, notes: &mut Vec<String>) -> Result<RigidSurface, Fault> {
    corners(of)?;
    let name = text(of);
    if name.is_empty() {
        let problem = ImportProblem::Count { what: "names of surface files", found: 0, wanted: "1".into() };
        return Err(fault(of, problem));
    }
    let file = files.mesh(&name).map_err(|error| fault(of, ImportProblem::Mesh(Box::new(error))))?;
    notes.extend(file.notes.iter().map(|note| format!("{name}: {note}")));
    let of_kind =
        |kind, corners| file.mesh.block(kind).map_or(Vec::new(), |block| split(&block.nodes, corners));
    let triangles = [of_kind(CellKind::Triangle, 3), of_kind(CellKind::Quad, 4)].concat();
    let mut points = file.mesh.points;
    place(of, &mut points)?;
    some(of, RigidSurface { points, triangles })
}

fn some(of: XmlElement<'_>, surface: RigidSurface) -> Result<RigidSurface, Fault> {
    match surface.triangles.is_empty() {
        true => {
            let problem = ImportProblem::Count { what: "triangles", found: 0, wanted: "some".into() };
            Err(fault(of, problem))
        }
        false => Ok(surface),
    }
}

fn split(cells: &[u32], corners: usize) -> Vec<[u32; 3]> {
    let fan = |cell: &[u32]| (2..cell.len()).map(|k| [cell[0], cell[k - 1], cell[k]]).collect::<Vec<_>>();
    cells.chunks_exact(corners).flat_map(fan).collect()
}

impl RigidSurface {
    /// Makes a mesh of a closed surface. Also returns whether bodies are inside, and the thickness [m] that a
    /// sheet got. The error says why no mesh is possible.
    pub fn solid(self) -> Result<(Mesh, bool, Option<f64>), String> {
        let Self { points, triangles } = self.welded();
        if triangles.is_empty() {
            return Err("all its triangles are degenerate; give it an area".into());
        }
        // Number of times that each edge is passed, from the smaller to the larger node and back.
        let mut edges: BTreeMap<[u32; 2], [u32; 2]> = BTreeMap::new();
        for &[a, b, c] in &triangles {
            for [from, to] in [[a, b], [b, c], [c, a]] {
                edges.entry([from.min(to), from.max(to)]).or_default()[usize::from(from > to)] += 1;
            }
        }
        let shared = edges.values().filter(|[there, back]| *there > 1 || *back > 1).count();
        if shared > 0 {
            return Err(format!(
                "{shared} of its edges lie between triangles that turn to different sides, or between more than two triangles; turn \
                 all triangles to the side of the nodes"
            ));
        }
        let rim: Vec<[u32; 2]> = edges
            .into_iter()
            .filter(|(_, [there, back])| there != back)
            .map(|([a, b], [there, _])| if there > 0 { [a, b] } else { [b, a] })
            .collect();
        if rim.is_empty() {
            let volume = |[a, b, c]: &[u32; 3]| {
                let [a, b, c] = [a, b, c].map(|&node| points[node as usize] - points[0]);
                a.cross(&b).dot(&c) / 6.0
            };
            let inside = triangles.iter().map(volume).sum::<f64>() < 0.0;
            let outward = |&[a, b, c]: &[u32; 3]| if inside { [a, c, b] } else { [a, b, c] };
            let triangles: Vec<[u32; 3]> = triangles.iter().map(outward).collect();
            return Ok((mesh(points, &triangles), inside, None));
        }
        let (low, high) = bounds(&points);
        let depth = THICKNESS * (high - low).norm();
        let back = points.len() as u32;
        let mut normals = vec![Vector3::zeros(); points.len()];
        for &[a, b, c] in &triangles {
            let [x, y, z] = [a, b, c].map(|node| points[node as usize]);
            let normal = (y - x).cross(&(z - x));
            [a, b, c].iter().for_each(|&node| normals[node as usize] += normal);
        }
        let behind = points.iter().zip(&normals).map(|(point, normal)| {
            let normal = normal.try_normalize(0.0).unwrap_or_default();
            point - normal * depth
        });
        let behind: Vec<Vector3> = behind.collect();
        let mut closed = triangles.clone();
        closed.extend(triangles.iter().map(|&[a, b, c]| [a + back, c + back, b + back]));
        closed.extend(rim.iter().flat_map(|&[a, b]| [[b, a, a + back], [b, a + back, b + back]]));
        Ok((mesh([points, behind].concat(), &closed), false, Some(depth)))
    }

    /// Joins points at one place, and drops triangles without area.
    fn welded(self) -> Self {
        let mut known: BTreeMap<[u64; 3], u32> = BTreeMap::new();
        let mut points = Vec::new();
        let place = |point: &Vector3| {
            // Adding 0 makes −0 the same as 0.
            let key = [point.x, point.y, point.z].map(|x| (x + 0.0).to_bits());
            *known.entry(key).or_insert_with(|| {
                points.push(*point);
                points.len() as u32 - 1
            })
        };
        let new: Vec<u32> = self.points.iter().map(place).collect();
        let triangles = self.triangles.iter().map(|nodes| nodes.map(|node| new[node as usize]));
        let triangles = triangles.filter(|[a, b, c]| a != b && b != c && c != a).collect();
        Self { points, triangles }
    }
}

fn bounds(points: &[Vector3]) -> (Vector3, Vector3) {
    let first = points.first().copied().unwrap_or_default();
    points.iter().fold((first, first), |(low, high), point| (low.inf(point), high.sup(point)))
}

fn mesh(points: Vec<Vector3>, triangles: &[[u32; 3]]) -> Mesh {
    let mut mesh = Mesh { points, ..Mesh::default() };
    mesh.block_mut(CellKind::Triangle).nodes = triangles.concat();
    mesh.drop_unused_points();
    mesh
}
