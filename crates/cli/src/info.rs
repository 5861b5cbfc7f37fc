//! `pliant info`: contents, quality and defects of a mesh file, the shape of its surface, and its distance
//! from another mesh.

use std::path::Path;

use pliant_format::foreign_file;
use pliant_geometry::io::{self, MeshFile};
use pliant_geometry::words::number;
use pliant_geometry::{CellKind, Mesh, QualityReport, Spread, Vector3, boundary, diagnose};
use pliant_meshing::{Curvature, Hausdorff, Percentiles, Thickness, TriangleMesh};
use pliant_scene::SizeDoubt;
use serde_json::{Map, Value as Json, json};

use crate::SUCCESS;
use crate::arguments::Info;
use crate::report::{Failure, say};

/// Samples of distances along the diagonal.
const SAMPLES: f64 = 800.0;

/// The shape of the surface of a mesh, if it has one.
struct Shape {
    curvature: Option<Curvature>,
    /// Thickness of the body inside the surface.
    within: Option<Thickness>,
    /// Thickness of shells with data `thickness` [m].
    of_shells: Option<Percentiles>,
}

/// Distances between a mesh and another one.
struct Against {
    distances: Hausdorff,
    /// The farthest points of this mesh and of the other [m].
    farthest: [[f64; 3]; 2],
    /// Diagonal of the other mesh's box [m].
    diagonal: f64,
}

pub fn info(arguments: &Info) -> Result<u8, Failure> {
    let file = read(&arguments.mesh, arguments.scale, "--scale")?;
    let shape = Shape::of(&file.mesh);
    let other_scale = arguments.against_scale.unwrap_or(arguments.scale);
    let against =
        arguments.against.as_deref().map(|other| Against::new(&file.mesh, other, other_scale)).transpose()?;
    if arguments.json {
        let mut object = info_object(&file);
        object["curvature"] = json!(shape.curvature);
        object["thickness"] = json!(shape.within);
        object["shell_thickness"] = json!(shape.of_shells);
        object["against"] = json!(against.as_ref().map(Against::object));
        say(object)?;
    } else {
        let mut lines = vec![format!("{}: {}", arguments.mesh.display(), info_page(&file))];
        lines.extend(shape.lines());
        lines.extend(arguments.against.iter().zip(&against).flat_map(|(other, apart)| apart.lines(other)));
        say(lines.join("\n"))?;
    }
    if let Some(target) = &arguments.convert {
        io::write(target, &file.mesh).map_err(|error| Failure::plain(error, ""))?;
        eprintln!("wrote {}", target.display());
    }
    Ok(SUCCESS)
}

/// A mesh file in metres.
fn read(path: &Path, scale: f64, option: &str) -> Result<MeshFile, Failure> {
    if !(scale > 0.0 && scale.is_finite()) {
        let message = format!("`{option}` must be greater than 0, found {scale}");
        return Err(Failure::plain(message, "0.001 for millimetres"));
    }
    let mut file = io::read(path).map_err(|error| match foreign_file(path) {
        Some([what, help]) => Failure::plain(format!("`{}` is {what}", path.display()), help),
        None => Failure::plain(error, ""),
    })?;
    file.mesh.points.iter_mut().for_each(|point| *point *= scale);
    Ok(file)
}

impl Shape {
    fn of(mesh: &Mesh) -> Self {
        // A mesh without faces has no shape, which is valid here.
        let surface = TriangleMesh::from_mesh(mesh).ok().map(|(surface, _)| surface);
        Self {
            curvature: surface.as_ref().and_then(TriangleMesh::curvature),
            within: surface.as_ref().and_then(TriangleMesh::thickness),
            of_shells: shell_thickness(mesh),
        }
    }

    fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if let Some(Curvature { mean, gaussian, larger, smaller, sharpest }) = &self.curvature {
            let row = |name: &str, p: &Percentiles, unit: &str| {
                let [least, p5, median, p95, most] = [p.least, p.p5, p.median, p.p95, p.most].map(number);
                format!("  {name:<10} {median} {unit}, 5 % to 95 %: {p5} to {p95}, all: {least} to {most}")
            };
            lines.push("curvature of the surface (convex is positive), medians by area:".into());
            lines.push(row("mean", mean, "1/m"));
            lines.push(row("Gaussian", gaussian, "1/m²"));
            lines.push(row("larger", larger, "1/m"));
            lines.push(row("smaller", smaller, "1/m"));
            lines.push(format!("  sharpest   at {}", millimetres(sharpest)));
        }
        let row = |p: &Percentiles| {
            let [least, p5, median, p95, most] =
                [p.least, p.p5, p.median, p.p95, p.most].map(|x| number(x * 1e3));
            format!("{median} mm (median), 5 % to 95 %: {p5} to {p95} mm, all: {least} to {most} mm")
        };
        if let Some(Thickness { thickness, thinnest }) = &self.within {
            lines.push(format!("thickness inside the surface: {}", row(thickness)));
            lines.push(format!("  thinnest   at {}", millimetres(thinnest)));
        }
        lines.extend(self.of_shells.iter().map(|p| format!("thickness of the shells: {}", row(p))));
        lines
    }
}

/// The data `thickness` of the faces or points of a mesh without volume cells, over its area.
fn shell_thickness(mesh: &Mesh) -> Option<Percentiles> {
    if mesh.volume_blocks().any(|block| !block.is_empty()) {
        return None;
    }
    let at_points = mesh.point_data.get("thickness").filter(|data| data.components == 1);
    let of_face = |kind: CellKind, index: u32, nodes: &[u32]| {
        let at_cells = mesh.block(kind)?.data.get("thickness").filter(|data| data.components == 1);
        let mean = |data: &[f64]| {
            let values = nodes.iter().filter_map(|&node| data.get(node as usize));
            values.sum::<f64>() / nodes.len() as f64
        };
        at_cells
            .and_then(|data| data.values.get(index as usize).copied())
            .or_else(|| at_points.map(|data| mean(&data.values)))
    };
    let surface = boundary(mesh);
    let faces = surface.faces.iter().filter_map(|face| {
        let thickness = of_face(face.parent.kind, face.parent.index, face.nodes())?;
        Some((thickness, face.area(&mesh.points)))
    });
    Percentiles::weighted(faces.collect())
}

impl Against {
    fn new(mesh: &Mesh, other: &Path, scale: f64) -> Result<Self, Failure> {
        let surface = |mesh: &Mesh| {
            let made = TriangleMesh::from_mesh(mesh);
            made.map(|(surface, _)| surface)
                .map_err(|error| Failure::plain(error, "distances are measured between surfaces"))
        };
        let target = surface(&read(other, scale, "--against-scale")?.mesh)?;
        let measured = surface(mesh)?;
        let diagonal = target.diagonal();
        let (distances, farthest) = Hausdorff::with_places(&measured, &target, diagonal / SAMPLES);
        Ok(Self { distances, farthest, diagonal })
    }

    fn lines(&self, other: &Path) -> Vec<String> {
        let mut lines = vec![format!("against {}:", other.display())];
        let ways = self.distances.lines(self.diagonal, ["there", "back "]);
        let places = self.farthest.iter().map(millimetres);
        lines.extend(ways.iter().zip(places).map(|(way, place)| format!("  {way}, at {place}")));
        let largest = self.distances.largest();
        let part = 100.0 * largest / self.diagonal;
        lines.push(format!("  Hausdorff distance {:.3} mm, {part:.3} % of the diagonal", largest * 1e3));
        lines
    }

    fn object(&self) -> Json {
        json!({
            "distances": self.distances,
            "hausdorff": self.distances.largest(),
            "diagonal": self.diagonal,
            "farthest_forward": self.farthest[0],
            "farthest_backward": self.farthest[1],
        })
    }
}

/// A place in millimetres.
fn millimetres(place: &[f64; 3]) -> String {
    let [x, y, z] = place.map(|x| number(x * 1e3));
    format!("({x}, {y}, {z}) mm")
}

/// The named sets of a mesh with their numbers of nodes.
fn sets(mesh: &Mesh) -> impl Iterator<Item = (&str, usize)> {
    mesh.set_names().into_iter().map(|name| (name, mesh.set_points(name).map_or(0, |set| set.len())))
}

fn info_object(MeshFile { mesh, format, notes, .. }: &MeshFile) -> Json {
    let (quality, found) = (QualityReport::new(mesh), diagnose(mesh));
    let cells: Map<_, _> =
        quality.cells.iter().map(|(kind, count)| (kind.name().to_owned(), json!(count))).collect();
    let sets: Map<_, _> = sets(mesh).map(|(name, count)| (name.to_owned(), json!(count))).collect();
    let spread = |s: Spread| json!({ "min": s.min, "median": s.median, "max": s.max });
    json!({
        "format": format,
        "nodes": quality.nodes,
        "cells": cells,
        "bounds": mesh.bounds().map(|(low, high)| [<[f64; 3]>::from(low), <[f64; 3]>::from(high)]),
        "volume": quality.volume,
        "acoustic_length": quality.acoustic_length.map(spread),
        "edge_length": quality.edge_length.map(spread),
        "dihedral": quality.dihedral,
        "scaled_jacobian": quality.scaled_jacobian,
        "sets": sets,
        "usable": found.is_usable(),
        "problems": found.to_string(),
        "notes": notes,
    })
}

fn info_page(MeshFile { mesh, format, notes, .. }: &MeshFile) -> String {
    let mut lines = vec![format.clone()];
    if let Some((low, high)) = mesh.bounds() {
        let at = |p: Vector3| format!("({}, {}, {})", number(p.x), number(p.y), number(p.z));
        lines.push(format!("from {} to {} m", at(low), at(high)));
        lines.extend(SizeDoubt::of(mesh).map(|doubt| format!("note: {doubt}; {}", doubt.advice("--scale "))));
    }
    lines.push(QualityReport::new(mesh).to_string().trim_end().to_owned());
    lines.extend(sets(mesh).map(|(name, count)| format!("set `{name}`: {count} nodes")));
    lines.extend(mesh.point_data.keys().map(|name| format!("point data `{name}`")));
    for block in &mesh.blocks {
        let kind = block.kind.name();
        lines.extend(block.data.keys().map(|name| format!("cell data `{name}` of {kind} cells")));
    }
    lines.extend(notes.iter().map(|note| format!("note: {note}")));
    lines.push(diagnose(mesh).to_string().trim_end().to_owned());
    lines.join("\n")
}
