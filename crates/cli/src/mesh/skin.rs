//! `pliant mesh --as surface` and `--as shells`: triangles and curved shells of an image or of a mesh file.

use std::path::Path;

use pliant_geometry::io::{self, Format};
use pliant_geometry::{CellKind, Mesh, Vector3, diagnose};
use pliant_meshing::{
    Anatomy, Fewer, FitProgress, FittedShells, Hausdorff, SURFACE_SMOOTHING, ShellGoal, SurfaceCheck,
    SurfaceRepairs, TriangleMesh,
};
use serde_json::{Value as Json, json};

use super::input::{Segmented, anatomy, cell_limit, is_mesh_file, mesh_file, meshing_failure, regions};
use crate::SUCCESS;
use crate::arguments::{MeshCells, MeshImage};
use crate::report::{Bar, Failure, failed_output, say};

/// Faces at more than this angle form a crease, which remeshing preserves [rad].
const CREASE: f64 = std::f64::consts::FRAC_PI_3;

/// Samples of distances along the diagonal.
const SAMPLES: f64 = 400.0;

/// The input surface with notes on its source.
struct InputSurface {
    surface: TriangleMesh,
    /// The labels that it is the surface of, of an image.
    anatomy: Option<Anatomy<'static>>,
    lines: Vec<String>,
    object: Json,
    warnings: Vec<String>,
}

pub fn mesh(arguments: &MeshImage) -> Result<u8, Failure> {
    let goal = goal(arguments)?;
    require_surface_format(&arguments.out)?;
    arguments.error_map.as_deref().map(require_surface_format).transpose()?;
    let bar = Bar::new();
    let made = found(arguments, &bar).and_then(|found| {
        let made = make(arguments, &found, goal, &bar)?;
        Ok((found, made))
    });
    bar.finish();
    let (found, made) = made?;
    if !arguments.json {
        say(found.lines.iter().chain(&made.lines).cloned().collect::<Vec<_>>().join("\n"))?;
    }
    // The lines of shells have their warnings.
    let is_new = |warning: &&String| arguments.json || !made.lines.iter().any(|line| line.contains(*warning));
    let warnings = found.warnings.iter().chain(made.warnings.iter().filter(is_new));
    warnings.for_each(|warning| eprintln!("warning: {warning}"));
    let mut files = vec![(&arguments.out, &made.mesh)];
    files.extend(arguments.error_map.as_ref().zip(made.error_map.as_ref()));
    for (path, mesh) in &files {
        if let Err(error) = io::write(path, mesh) {
            return failed_output(&error, arguments.json);
        }
        eprintln!("wrote {}", path.display());
    }
    if arguments.json {
        let mut object = made.object;
        object["input"] = found.object;
        object["warnings"] = json!(found.warnings.iter().chain(&made.warnings).collect::<Vec<_>>());
        object["files"] = json!(files.iter().map(|(path, _)| path).collect::<Vec<_>>());
        say(object)?;
    }
    Ok(SUCCESS)
}

/// The requested resolution.
#[derive(Clone, Copy)]
enum Goal {
    Edge(f64),
    Triangles(usize),
    Shells(ShellGoal),
}

fn goal(arguments: &MeshImage) -> Result<Goal, Failure> {
    let surface = matches!(arguments.cells, MeshCells::Surface);
    match (arguments.edge, arguments.triangles, arguments.shells, arguments.error) {
        (Some(edge), None, None, None) if surface => Ok(Goal::Edge(edge)),
        (None, Some(number), None, None) if surface => Ok(Goal::Triangles(number)),
        (None, None, Some(number), None) if !surface => Ok(Goal::Shells(ShellGoal::Shells(number))),
        (None, None, None, Some(error)) if !surface => Ok(Goal::Shells(ShellGoal::Error(error))),
        _ if surface => Err(Failure::plain(
            "the resolution of the surface is missing",
            "`--edge 5mm` makes even triangles of 5 mm, `--cells 8000` that many triangles",
        )),
        _ => Err(Failure::plain(
            "the accuracy of the shells is missing",
            "`--error 0.5%` sets the largest distance as a fraction of the diagonal, `--shells 800` the number of shells",
        )),
    }
}

fn require_surface_format(path: &Path) -> Result<(), Failure> {
    match Format::of_path(path) {
        Some(format) if Format::WRITTEN.contains(&format) => Ok(()),
        _ => {
            let message = format!("`{}` is not a name for a mesh of triangles", path.display());
            Err(Failure::plain(message, "choose a name that ends in .vtu, .msh, .ply, .obj or .stl"))
        }
    }
}

/// The surface of a mesh file or of regions of an image.
fn found(arguments: &MeshImage, bar: &Bar) -> Result<InputSurface, Failure> {
    let refused = |error| meshing_failure(&error, arguments.force);
    if is_mesh_file(arguments) {
        let mut warnings = Vec::new();
        let file = mesh_file(arguments, &mut warnings)?;
        let (surface, repairs) = TriangleMesh::from_mesh(&file.mesh).map_err(refused)?;
        let mut lines =
            vec![format!("{}: {}, {} triangles", arguments.image.display(), file.format, surface.len())];
        lines.extend(file.notes.iter().map(|note| format!("note: {note}")));
        lines.push(format!("mended           {repairs}"));
        let object = file_object(&file.format, &repairs);
        return Ok(InputSurface { surface, anatomy: None, lines, object, warnings });
    }
    let found = regions(arguments, bar)?;
    let (anatomy, cleaned) = anatomy(arguments, &found, &SURFACE_SMOOTHING, bar)?;
    let surface = TriangleMesh::of_image(&anatomy, found.voxel, cell_limit(arguments)).map_err(refused)?;
    let Segmented { mut lines, mut object, warnings, .. } = found;
    lines.push(format!("cleaned          {cleaned}"));
    object["cleaned"] = json!(cleaned);
    Ok(InputSurface { surface, anatomy: Some(anatomy), lines, object, warnings })
}

fn file_object(format: &str, repairs: &SurfaceRepairs) -> Json {
    json!({ "format": format, "repairs": repairs })
}

/// The resulting surface with its report.
struct MadeSurface {
    mesh: Mesh,
    error_map: Option<Mesh>,
    lines: Vec<String>,
    object: Json,
    warnings: Vec<String>,
}

fn make(arguments: &MeshImage, found: &InputSurface, goal: Goal, bar: &Bar) -> Result<MadeSurface, Failure> {
    let refused = |error| meshing_failure(&error, arguments.force);
    let InputSurface { surface: input, anatomy, .. } = found;
    let mut surface = input.clone();
    bar.show(0.5, "making triangles");
    match goal {
        Goal::Shells(goal) => {
            bar.show(0.3, "making the initial triangles");
            let progress = |now: FitProgress| {
                let words = format!(
                    "fitting: round {}, {} shells, {:.2} % off",
                    now.round,
                    now.shells,
                    100.0 * now.off
                );
                bar.show(0.3 + 0.7 * now.part, words);
            };
            return FittedShells::new(input, goal, &progress).map(shells).map_err(refused);
        }
        Goal::Edge(edge) => {
            surface.mark_creases(CREASE);
            surface.remesh(edge, cell_limit(arguments)).map_err(refused)?;
        }
        Goal::Triangles(number) => {
            surface.decimate(Fewer::Triangles(number)).map_err(refused)?;
        }
    }
    bar.show(0.8, "measuring distances");
    let kept = anatomy.as_ref().and_then(|anatomy| surface.keep_volume(anatomy));
    let diagonal = input.diagonal();
    let mesh = surface.to_parted_mesh();
    let mut check = SurfaceCheck::of(&mesh);
    check.of_body = anatomy.is_none().then(|| SurfaceCheck::of(&input.to_mesh()).euler_number);
    if let (Some(anatomy), Some(edge)) = (anatomy, arguments.edge) {
        check = check.with_body(anatomy.field(), edge);
    }
    let mut made = triangles(mesh, check, &Hausdorff::between(&surface, input, diagonal / SAMPLES), diagonal);
    made.warnings.extend(surface.volume_warning(input).filter(|_| kept.is_none()));
    if let Some(kept) = kept {
        made.lines.extend(kept.lines());
        made.warnings.extend(kept.warnings());
        made.object["labels"] = json!(kept.labels);
        made.object["lost"] = json!(kept.lost);
    }
    Ok(made)
}

fn shells(fitted: FittedShells) -> MadeSurface {
    let FittedShells { mesh, error_map, report } = fitted;
    let lines = vec![report.to_string()];
    let object = json!({ "status": "done", "as": "shells", "report": report });
    MadeSurface { mesh, error_map: Some(error_map), lines, object, warnings: report.warnings() }
}

fn triangles(mesh: Mesh, check: SurfaceCheck, distances: &Hausdorff, diagonal: f64) -> MadeSurface {
    let of = |nodes: &[u32]| [0, 1, 2].map(|k| mesh.points[nodes[k] as usize]);
    let block = mesh.block(CellKind::Triangle);
    let corners: Vec<[Vector3; 3]> = block.into_iter().flat_map(|block| block.cells().map(of)).collect();
    let area: f64 = corners.iter().map(|[a, b, c]| 0.5 * (b - a).cross(&(c - a)).norm()).sum();
    let angle = corners.iter().map(least_angle).fold(f64::INFINITY, f64::min).to_degrees();
    let diagnosis = diagnose(&mesh);
    let (borders, pieces) = (diagnosis.open_edges.len(), diagnosis.components);
    let volume =
        (borders == 0).then(|| corners.iter().map(|[a, b, c]| a.dot(&b.cross(c)) / 6.0).sum::<f64>());
    let mut lines = vec![
        format!("nodes            {}", mesh.points.len()),
        format!("triangles        {}", corners.len()),
        format!("area             {:.2} cm²", area * 1e4),
        volume.map_or("volume           none: the surface is open".into(), |volume| {
            format!("volume           {:.2} ml", volume * 1e6)
        }),
        format!("angle            {angle:.1}° at least"),
        format!("pieces           {pieces}"),
        format!("border edges     {borders}"),
        check.line(),
    ];
    lines.extend(distances.lines(diagonal, ["result to input ", "input to result "]));
    let object = json!({
        "status": "done", "as": "surface", "nodes": mesh.points.len(), "cells": corners.len(), "area": area,
        "volume": volume, "least_angle": angle, "components": pieces, "border_edges": borders,
        "distances": distances, "diagonal": diagonal, "surface_check": check,
    });
    MadeSurface { mesh, error_map: None, lines, object, warnings: check.doubt().into_iter().collect() }
}

/// The smallest angle of a triangle [rad].
fn least_angle(x: &[Vector3; 3]) -> f64 {
    (0..3).map(|k| (x[(k + 1) % 3] - x[k]).angle(&(x[(k + 2) % 3] - x[k]))).fold(f64::INFINITY, f64::min)
}
