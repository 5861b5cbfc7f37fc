//! Shapes of obstacles and tools from mesh files and images. They are signed distances of a closed surface on
//! a grid, made once or read from the cache.

use std::path::Path;
use std::sync::Arc;

use pliant_format::diagnostic::Diagnostic;
use pliant_format::tables::{Cells, ImageTool, LabelOrGroups, MeshTable, MeshTool, Sampling};
use pliant_geometry::words::number;
use pliant_geometry::{CellKind, Mesh};
use pliant_meshing::{Closing, Enclosed, MeshingError};
use pliant_sim::contact::grid::Grid;
use pliant_sim::contact::shape::Shape;

use super::Loaded;
use crate::assemble::Meshing;
use crate::assemble::meshes::{SizeDoubt, content_of};
use crate::cache::{KeptGrid, Key};

/// Steps of a grid along the diagonal of the box, if no `resolution` is given. The error at a surface as
/// round as the box is below 1e-5 of its diagonal. That makes at most 3.4 million points (13 MiB).
const STEPS: f64 = 256.0;
/// Steps along an edge of the surface, if no `resolution` is given and the triangles are small.
const STEPS_PER_EDGE: f64 = 2.0;
/// Points of a grid at most: 64 MiB, if no `resolution` is given, and 256 MiB.
const MOST_POINTS: [f64; 2] = [(1 << 24) as f64, (1 << 26) as f64];
/// A shape of this many times the size of the bodies was probably not given in metres.
const TOO_LARGE: f64 = 50.0;
/// A point of a grid in memory [MiB].
const MEBIBYTES: f64 = 4.0 / 1_048_576.0;

impl Loaded<'_> {
    /// Makes the shape of a mesh file; `path` is the place of its table.
    pub(super) fn shape_of_mesh(&mut self, table: &MeshTool, path: &[&str]) -> Option<Shape> {
        let source = MeshTable { file: Some(table.file.clone()), scale: table.scale, ..MeshTable::default() };
        let mesh = self.with_own_cells(&source, path)?.mesh;
        self.sampled(&mesh, &table.file, table.sampling(), path)
    }

    /// Makes the shape of a part of an image; `path` is the place of its table.
    pub(super) fn shape_of_image(&mut self, table: &ImageTool, path: &[&str]) -> Option<Shape> {
        let source = MeshTable {
            image: Some(table.file.clone()),
            names: table.names.clone(),
            label: table.label.clone().map(LabelOrGroups::One),
            labels: table.labels.clone(),
            threshold: table.threshold,
            clean: table.clean,
            cells: Some(Cells::Surface),
            ..MeshTable::default()
        };
        let mesh = self.scanned(&source, path)?.mesh;
        self.sampled(&mesh, &table.file, table.sampling(), path)
    }

    /// The distances of the surface of a mesh.
    fn sampled(&mut self, mesh: &Mesh, file: &Path, wanted: Sampling, path: &[&str]) -> Option<Shape> {
        let Sampling { grow, resolution } = wanted;
        let name = file.display();
        let key = self.cache.is_on().then(|| {
            let recipe =
                format!("distances, {grow:?} {resolution:?} {STEPS} {STEPS_PER_EDGE} {MOST_POINTS:?}");
            Key::new(|sink| content_of(mesh, sink), &recipe)
        });
        let kept = key.as_ref().and_then(|key| self.cache.get_grid(key));
        let (kept, how) = match kept {
            Some(kept) => (kept, ", from the cache".into()),
            None => {
                let made = match self.distances(mesh, wanted, path) {
                    Ok(made) => made,
                    Err((key, message, help)) => {
                        self.error(&[path, &[key]].concat(), message, "here", help);
                        return None;
                    }
                };
                let how = key.map(|key| match self.cache.put_grid(&key, &made) {
                    Ok(()) => ", made and stored in the cache".to_owned(),
                    Err(error) => format!(", made, but not stored in the cache: {error}"),
                });
                (made, how.unwrap_or_default())
            }
        };
        self.doubt_shape(mesh, path);
        let points: f64 = kept.counts.iter().map(|&n| f64::from(n)).product();
        self.notes.push(format!(
            "`{}`: distances to the surface of {name} on a grid of {} mm, {} million points ({:.1} MiB){how}",
            path[1],
            number(rounded(1e3 * kept.spacing)),
            number(rounded(1e-6 * points)),
            points * MEBIBYTES
        ));
        self.notes.extend(kept.notes.iter().map(|note| format!("{name}: {note}")));
        let counts = kept.counts.map(|n| n as usize);
        let points = kept.points.into_iter().map(Into::into).collect();
        let grid = Grid::new(kept.origin.into(), kept.spacing, counts, kept.values)?;
        // The radius of a ball is half of its thickness, as of a sphere.
        let grid = grid.with_thinnest(0.5 * kept.thickness).with_surface((points, kept.triangles));
        Some(Shape::Grid(Arc::new(grid)))
    }

    /// Makes the distances; on failure returns the key to point at, the message and the remedy.
    fn distances(
        &self,
        mesh: &Mesh,
        Sampling { grow, resolution }: Sampling,
        path: &[&str],
    ) -> Result<KeptGrid, (&'static str, String, String)> {
        let (low, high) = mesh.bounds().unwrap_or_default();
        let diagonal = (high - low).norm();
        let fault = |error: MeshingError| {
            let help = match &error {
                MeshingError::OpenSurface { .. } => {
                    "close it in the program that made it; holes narrower than `resolution` are closed here"
                }
                MeshingError::NoSurface => "it needs triangles, quads, tets or hexes",
                MeshingError::NothingEnclosed if grow < 0.0 => {
                    "the surface goes inward by more than it is thick"
                }
                MeshingError::NothingEnclosed => "give a surface around a volume",
                _ => "`pliant info` tells about a mesh file",
            };
            let key = match &error {
                MeshingError::NothingEnclosed if grow < 0.0 => "grow",
                _ => "file",
            };
            (key, error.to_string(), help.to_owned())
        };
        let narrow = resolution.unwrap_or(diagonal / STEPS);
        if narrow <= 0.0 {
            return Err(fault(MeshingError::NoSurface));
        }
        let surface = Enclosed::new(mesh, narrow, &Closing::default()).map_err(fault)?;
        let points = |spacing: f64| surface.grid_counts(spacing, grow).iter().product::<f64>();
        let fitting = |from: f64, most: f64| {
            std::iter::successors(Some(from), |spacing| Some(1.05 * spacing))
                .find(|&spacing| points(spacing) <= most)
                .unwrap_or(from)
        };
        let chosen = (diagonal / STEPS).min(surface.mean_edge() / STEPS_PER_EDGE);
        let spacing = resolution.unwrap_or_else(|| fitting(chosen, MOST_POINTS[0]));
        if points(spacing) > MOST_POINTS[1] {
            let message = format!(
                "a grid of {} m has {:.3e} points in {:.0} MiB, more than {:.0} MiB",
                number(spacing),
                points(spacing),
                points(spacing) * MEBIBYTES,
                MOST_POINTS[1] * MEBIBYTES
            );
            let fits = fitting(spacing, MOST_POINTS[1]);
            let help = format!("`resolution = {fits:.1e}` fits; without it a grid is chosen");
            return Err(("resolution", message, help));
        }
        let progress =
            |part: f64| (self.watch)(Meshing { body: path[1], part, now: "finding distances to a surface" });
        let sampled = surface.sampled(spacing, grow, &progress).map_err(fault)?;
        let drawn = sampled.surface.to_mesh();
        let triangles = drawn.block(CellKind::Triangle).into_iter().flat_map(|block| block.cells());
        Ok(KeptGrid {
            origin: sampled.origin.into(),
            spacing,
            counts: sampled.counts.map(|n| n as u32),
            values: sampled.values,
            thickness: sampled.thickness,
            triangles: triangles.map(|nodes| [nodes[0], nodes[1], nodes[2]]).collect(),
            points: drawn.points.into_iter().map(Into::into).collect(),
            notes: surface
                .report
                .is_mended()
                .then(|| format!("mended: {}", surface.report))
                .into_iter()
                .collect(),
        })
    }

    /// Warns of a shape that is much larger than the bodies.
    fn doubt_shape(&mut self, mesh: &Mesh, path: &[&str]) {
        let bounds = self.bodies.iter().filter_map(|body| body.mesh.bounds());
        let bodies = bounds.reduce(|(a, b), (c, d)| (a.inf(&c), b.sup(&d)));
        let (Some((low, high)), Some((from, to))) = (mesh.bounds(), bodies) else { return };
        let (size, bodies) = ((high - low).norm(), (to - from).norm());
        if size <= TOO_LARGE * bodies {
            return;
        }
        let message = format!(
            "`{}` is {} m across, {:.0} times the bodies ({} m)",
            path[1],
            number(rounded(size)),
            size / bodies,
            number(rounded(bodies))
        );
        let help = SizeDoubt::of(mesh).map_or_else(
            || "`scale` is the size of one unit of the file in metres".into(),
            |doubt| doubt.advice("scale = "),
        );
        let place = self.source().span(path);
        self.out.push(Diagnostic::warning(message).at(place, "this shape").help(help));
    }
}

/// To three digits, for messages.
fn rounded(x: f64) -> f64 {
    format!("{x:.2e}").parse().unwrap_or(x)
}
