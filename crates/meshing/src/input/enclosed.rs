//! The body inside a closed surface, as a field of signed distances. The surface is repaired like every
//! surface from a file (`triangles.rs`); narrow holes are closed. If the surface intersects itself, or
//! contains parts of the same orientation, the body is everything that it winds around (`winding.rs`).
//! Surfaces inside the body are left out. Distances are exact on a grid and linear in between; they are
//! clipped beyond two edges of the cells. Leaves out: open surfaces, several materials.

use std::collections::BTreeMap;
use std::fmt;

use pliant_geometry::{DistanceField, Grid, Mesh, SurfaceLocator, Vector3};
use rayon::prelude::*;
use serde::Serialize;

use crate::error::counted;
use crate::error::{MeshingError, require_positive};
use crate::input::anatomy::Anatomy;
use crate::report::hausdorff::{distance, locator};
use crate::surface::crossings::crossings;
use crate::surface::edges::key;
use crate::surface::nesting::{box_of, containers, corners_of, shells, signed_volume};
use crate::surface::triangles::{SurfaceRepairs, TriangleMesh};
use crate::surface::winding::Winding;

/// Steps of the grid along an edge of the cells; the largest number that fits into memory is used.
const STEPS_PER_EDGE: [f64; 3] = [4.0, 3.0, 2.0];

/// Distances beyond this many edges of the cells are cut.
const REACH: f64 = 2.0;

/// Most points of the grid: 256 MiB.
pub(crate) const MOST_POINTS: usize = 1 << 26;

/// Points along each side of the blocks that are skipped where they are far from the surface.
const BLOCK: usize = 8;

/// Levels of halving of triangles that cross others, at most.
const MOST_LEVELS: u32 = 6;

/// Repairs of a closed surface before filling; by default it only closes holes narrower than the cells.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Closing {
    /// Width of holes to close [m], if larger than the edge of the cells.
    pub holes: f64,
    /// True to fill cavities.
    pub fill_cavities: bool,
    /// True to keep only the largest piece, with its cavities.
    pub keep_largest: bool,
}

/// Findings and repairs of a surface.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct EnclosedReport {
    /// Repairs of its points and faces.
    pub repairs: SurfaceRepairs,
    /// Triangles of the surface as mended.
    pub triangles: usize,
    /// Pieces of the surface, cavities among them.
    pub shells: usize,
    /// Pieces that are cavities in another one.
    pub cavities: usize,
    /// Holes closed.
    pub closed_holes: usize,
    /// Edges round them.
    pub closed_edges: usize,
    /// Width of the widest of them [m].
    pub widest_hole: f64,
    /// Pairs of triangles that pass through each other: overlapping parts were joined.
    pub crossings: usize,
    /// Place of the first crossing [m].
    pub first_crossing: Option<[f64; 3]>,
    /// Pieces inside another one with the same orientation, joined with it.
    pub swallowed_shells: usize,
    /// Cavities filled on request.
    pub filled_cavities: usize,
    /// Pieces left out on request.
    pub dropped_pieces: usize,
}

impl EnclosedReport {
    /// True if anything was repaired, joined, filled or left out.
    pub fn is_mended(&self) -> bool {
        let counts = [
            self.closed_holes,
            self.crossings,
            self.swallowed_shells,
            self.filled_cavities,
            self.dropped_pieces,
        ];
        self.repairs != SurfaceRepairs::default() || counts.iter().any(|&count| count > 0)
    }
}

impl fmt::Display for EnclosedReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut notes = vec![self.repairs.to_string()];
        if self.repairs == SurfaceRepairs::default() {
            notes.clear();
        }
        if self.closed_holes > 0 {
            let holes = counted(self.closed_holes, "hole", "holes");
            notes.push(format!("{holes} of up to {:.2} mm closed", self.widest_hole * 1e3));
        }
        if let Some(place) = self.first_crossing {
            let [x, y, z] = place.map(|x| x * 1e3);
            let pairs = counted(self.crossings, "pair", "pairs");
            notes.push(format!(
                "{pairs} of triangles intersect, the first at ({x:.2}, {y:.2}, {z:.2}) mm: overlapping parts \
                 were joined"
            ));
        }
        if self.swallowed_shells > 0 {
            notes.push(format!(
                "{} joined with an enclosing piece",
                counted(self.swallowed_shells, "piece", "pieces")
            ));
        }
        if self.filled_cavities > 0 {
            notes.push(format!("{} filled", counted(self.filled_cavities, "cavity", "cavities")));
        }
        if self.dropped_pieces > 0 {
            notes
                .push(format!("{} dropped", counted(self.dropped_pieces, "smaller piece", "smaller pieces")));
        }
        f.write_str(&if notes.is_empty() { "nothing".to_owned() } else { notes.join("; ") })
    }
}

/// A closed surface.
#[derive(Clone, Debug)]
pub struct Enclosed {
    pub(crate) points: Vec<Vector3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Pairs of triangles that cross.
    crossing: Vec<[u32; 2]>,
    /// Findings and repairs.
    pub report: EnclosedReport,
}

impl Enclosed {
    /// The triangles and quads of a mesh, or the boundary of its volume cells, mended and closed for cells of
    /// `edge` [m].
    ///
    /// # Errors
    /// If the surface has no area, stays open, or encloses nothing.
    pub fn new(mesh: &Mesh, edge: f64, closing: &Closing) -> Result<Self, MeshingError> {
        require_positive("edge", edge)?;
        let (surface, repairs) = TriangleMesh::from_mesh(mesh)?;
        let (points, triangles) = rejoined(&surface);
        let report = EnclosedReport { repairs, ..EnclosedReport::default() };
        let mut found = Self { points, triangles, crossing: Vec::new(), report };
        found.close(edge.max(closing.holes))?;
        found.choose(closing)?;
        let place;
        (found.crossing, place) = crossings(&found.points, &found.triangles);
        found.report.crossings = found.crossing.len();
        found.report.first_crossing = place.map(Into::into);
        found.report.triangles = found.triangles.len();
        Ok(found)
    }

    /// The enclosed volume [m³]; overlaps count several times.
    pub fn volume(&self) -> f64 {
        signed_volume(&self.points, &self.triangles)
    }

    /// Smallest and largest corner of a box round it [m].
    pub fn bounds(&self) -> (Vector3, Vector3) {
        box_of(self.triangles.iter().flatten().map(|&node| self.points[node as usize]))
    }

    /// True if no part lies inside another and none intersects another.
    pub fn is_simple(&self) -> bool {
        self.crossing.is_empty() && self.report.swallowed_shells == 0
    }

    /// The body as an anatomy of one material, for cells of `edge` [m]. `progress` hears fractions from 0
    /// to 1.
    ///
    /// # Errors
    /// If the grid would not fit into memory.
    pub fn anatomy(
        &self,
        label: i32,
        edge: f64,
        progress: &dyn Fn(f64),
    ) -> Result<Anatomy<'static>, MeshingError> {
        let (field, hull) = self.field_and_hull(edge, progress)?;
        let volume = if self.is_simple() { self.volume() } else { field.volume() };
        Ok(Anatomy::new(label, field).of_surface(hull, volume))
    }

    /// Returns the body as an anatomy for cells as small as `finest` [m], or as near to `finest` as memory
    /// allows.
    ///
    /// # Errors
    /// If the grid would not fit into memory.
    pub fn fine_anatomy(
        &self,
        label: i32,
        edge: f64,
        finest: f64,
        progress: &dyn Fn(f64),
    ) -> Result<Anatomy<'static>, MeshingError> {
        let mut fine = finest.min(edge);
        loop {
            match self.anatomy(label, fine, progress) {
                Err(MeshingError::LatticeTooLarge { .. }) if fine < edge => fine = (1.25 * fine).min(edge),
                found => return found,
            }
        }
    }

    /// Signed distances, positive inside, on a grid of a quarter to half of `edge` [m].
    ///
    /// # Errors
    /// If the grid would not fit into memory.
    pub fn field(&self, edge: f64, progress: &dyn Fn(f64)) -> Result<DistanceField, MeshingError> {
        self.field_and_hull(edge, progress).map(|(field, _)| field)
    }

    /// Returns the signed distances and the surface that bounds the body.
    fn field_and_hull(
        &self,
        edge: f64,
        progress: &dyn Fn(f64),
    ) -> Result<(DistanceField, TriangleMesh), MeshingError> {
        require_positive("edge", edge)?;
        let (low, high) = self.bounds();
        // Four points on each side stay outside.
        let counts_of = |step: f64| ((high - low) / step).map(|n| n.ceil() + 9.0);
        let fits = |step: &f64| counts_of(*step).product() <= MOST_POINTS as f64;
        let Some(step) = STEPS_PER_EDGE.iter().map(|steps| edge / steps).find(fits) else {
            let cubes = counts_of(edge).product() as u64;
            return Err(MeshingError::LatticeTooLarge { cubes, limit: MOST_POINTS / 8 });
        };
        let counts = counts_of(step);
        let dims = [0, 1, 2].map(|axis| counts[axis] as usize);
        let middle = (low + high) / 2.0;
        let origin = middle - step / 2.0 * counts.add_scalar(-1.0);
        let grid =
            Grid::along_axes(dims, origin, [step; 3]).map_err(|_| MeshingError::BadBox { low, high })?;
        let winding = Winding::new(corners_of(&self.points, &self.triangles));
        let hull = self.hull(&winding, step);
        progress(0.2);
        let mut values = distances(&grid, &locator(&hull), REACH * edge);
        progress(0.9);
        sign(&grid, &winding, &mut values);
        progress(1.0);
        let field = DistanceField::of_values(grid, values).ok_or(MeshingError::NothingEnclosed)?;
        Ok((field, hull))
    }

    /// The part of the surface that bounds the body: the whole surface, or the triangles with the body on one
    /// side only. Intersecting triangles are divided to below a step of the grid [m].
    pub(crate) fn hull(&self, winding: &Winding, step: f64) -> TriangleMesh {
        if self.is_simple() {
            return TriangleMesh::new(self.points.clone(), self.triangles.clone());
        }
        let mut crosses = vec![false; self.triangles.len()];
        self.crossing.iter().flatten().for_each(|&t| crosses[t as usize] = true);
        let pieces: Vec<[Vector3; 3]> = corners_of(&self.points, &self.triangles)
            .into_iter()
            .zip(&crosses)
            .flat_map(
                |(corners, &crosses)| if crosses { divided(corners, step / 2.0) } else { vec![corners] },
            )
            .collect();
        let outer = |[a, b, c]: &&[Vector3; 3]| {
            let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
            let centre = (a + b + c) / 3.0;
            let inside = |side: f64| winding.at(&(centre + side * 1e-3 * step * normal)) > 0.5;
            inside(1.0) != inside(-1.0)
        };
        let kept: Vec<[Vector3; 3]> = pieces.par_iter().filter(outer).copied().collect();
        let triangles = (0..kept.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        TriangleMesh::new(kept.into_flattened(), triangles)
    }

    /// Closes holes of up to a width [m] with a fan of triangles each.
    fn close(&mut self, width: f64) -> Result<(), MeshingError> {
        let loops = open_loops(&self.triangles);
        let sized = |nodes: &Vec<u32>| {
            let (low, high) = box_of(nodes.iter().map(|&n| self.points[n as usize]));
            ((high - low).norm(), (low + high) / 2.0)
        };
        let sizes: Vec<(f64, Vector3)> = loops.iter().map(sized).collect();
        let edges = loops.iter().map(Vec::len).sum();
        let Some(&(widest, place)) = sizes.iter().max_by(|a, b| a.0.total_cmp(&b.0)) else { return Ok(()) };
        if widest > width {
            return Err(MeshingError::OpenSurface {
                holes: loops.len(),
                edges,
                widest,
                place,
                closed: width,
            });
        }
        for nodes in &loops {
            let centre = self.points.len() as u32;
            let sum: Vector3 = nodes.iter().map(|&n| self.points[n as usize]).sum();
            self.points.push(sum / nodes.len() as f64);
            for (k, &from) in nodes.iter().enumerate() {
                self.triangles.push([nodes[(k + 1) % nodes.len()], from, centre]);
            }
        }
        self.report.closed_holes = loops.len();
        self.report.closed_edges = edges;
        self.report.widest_hole = widest;
        Ok(())
    }

    /// Counts pieces and cavities, and removes unwanted ones.
    fn choose(&mut self, closing: &Closing) -> Result<(), MeshingError> {
        let shells = shells(&self.points, &self.triangles);
        let containers = containers(&self.points, &self.triangles, &shells);
        let largest = (0..shells.len()).max_by(|&a, &b| shells[a].volume.total_cmp(&shells[b].volume));
        let Some(largest) = largest.filter(|&at| shells[at].volume > 0.0) else {
            return Err(MeshingError::NothingEnclosed);
        };
        let is_cavity = |at: usize| shells[at].volume < 0.0;
        let is_filled = |at: usize| closing.fill_cavities && is_cavity(at);
        let is_other = |at: usize| at != largest && !containers[at].contains(&largest);
        let is_dropped = |at: usize| closing.keep_largest && is_other(at);
        let kept: Vec<usize> = (0..shells.len()).filter(|&at| !is_filled(at) && !is_dropped(at)).collect();
        // The winding number of the kept pieces at a piece: zero in a cavity of the body.
        let surroundings = |at: usize| {
            let around = containers[at].iter().filter(|container| kept.binary_search(container).is_ok());
            around.map(|&container| shells[container].volume.signum()).sum::<f64>()
        };
        let count = |of: &dyn Fn(usize) -> bool| (0..shells.len()).filter(|&at| of(at)).count();
        self.report.filled_cavities = count(&|at| is_filled(at) && !is_dropped(at));
        self.report.dropped_pieces = count(&|at| is_dropped(at) && !is_cavity(at));
        self.report.shells = kept.len();
        self.report.cavities = kept.iter().filter(|&&at| is_cavity(at)).count();
        self.report.swallowed_shells =
            kept.iter().filter(|&&at| !is_cavity(at) && surroundings(at) > 0.0).count();
        let mut numbers: Vec<u32> =
            kept.iter().flat_map(|&at| shells[at].triangles.iter().copied()).collect();
        numbers.sort_unstable();
        self.triangles = numbers.into_iter().map(|t| self.triangles[t as usize]).collect();
        Ok(())
    }
}

/// Points and triangles of a surface with coincident points joined: this closes it where it was split along
/// edges.
fn rejoined(surface: &TriangleMesh) -> (Vec<Vector3>, Vec<[u32; 3]>) {
    let (points, mut triangles) = surface.compact();
    let mut places: BTreeMap<[u64; 3], u32> = BTreeMap::new();
    let mut joined = Vec::with_capacity(points.len());
    let numbers: Vec<u32> = points
        .iter()
        .map(|point| {
            *places.entry([0, 1, 2].map(|axis| point[axis].to_bits())).or_insert_with(|| {
                joined.push(*point);
                joined.len() as u32 - 1
            })
        })
        .collect();
    triangles.iter_mut().flatten().for_each(|node| *node = numbers[*node as usize]);
    (joined, triangles)
}

/// The edges at which triangles don't close, as loops of points; the surface is on the left of each.
fn open_loops(triangles: &[[u32; 3]]) -> Vec<Vec<u32>> {
    let mut sums: BTreeMap<[u32; 2], i32> = BTreeMap::new();
    for &[a, b, c] in triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *sums.entry(key(from, to)).or_default() += if from < to { 1 } else { -1 };
        }
    }
    let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for ([a, b], sum) in sums {
        let (from, to) = if sum > 0 { (a, b) } else { (b, a) };
        (0..sum.abs()).for_each(|_| next.entry(from).or_default().push(to));
    }
    let mut loops = Vec::new();
    let starts: Vec<u32> = next.keys().copied().collect();
    for start in starts {
        // As many edges leave a point as arrive, so every path returns; where it meets itself, a loop is
        // extracted.
        let mut way = vec![start];
        while let Some(to) = way.last().and_then(|at| next.get_mut(at)).and_then(Vec::pop) {
            match way.iter().position(|&n| n == to) {
                Some(at) => {
                    loops.push(way.split_off(at));
                    way.push(to);
                }
                None => way.push(to),
            }
        }
    }
    loops
}

/// Distances to a surface [m] at the points of a grid, cut at `reach`.
fn distances(grid: &Grid, surface: &SurfaceLocator, reach: f64) -> Vec<f32> {
    let [nx, ny, nz] = grid.dims;
    let blocks = grid.dims.map(|n| n.div_ceil(BLOCK));
    let place = |index: [usize; 3]| grid.position(&Vector3::from(index.map(|i| i as f64)));
    let half = grid.spacing().map(|h| h * (BLOCK as f64 - 1.0) / 2.0);
    let of_layer = |layer: usize| {
        let from = layer * BLOCK;
        let depth = BLOCK.min(nz - from);
        let mut values = vec![reach as f32; nx * ny * depth];
        for block in 0..blocks[0] * blocks[1] {
            let first = [block % blocks[0] * BLOCK, block / blocks[0] * BLOCK, from];
            let centre = place(first) + Vector3::from(half);
            if distance(surface, &centre) > reach + Vector3::from(half).norm() {
                continue;
            }
            for k in 0..depth {
                for j in first[1]..(first[1] + BLOCK).min(ny) {
                    for i in first[0]..(first[0] + BLOCK).min(nx) {
                        let found = distance(surface, &place([i, j, from + k])).min(reach);
                        values[i + nx * (j + ny * k)] = found as f32;
                    }
                }
            }
        }
        values
    };
    (0..blocks[2]).into_par_iter().flat_map_iter(of_layer).collect()
}

/// Makes distances outside negative. Along a row of the grid the side changes only where the surface may lie
/// between two points.
pub(crate) fn sign(grid: &Grid, winding: &Winding, distances: &mut [f32]) {
    let nx = grid.dims[0];
    let step = grid.spacing()[0];
    distances.par_chunks_exact_mut(nx).enumerate().for_each(|(row, line)| {
        let (mut inside, mut before) = (false, 0.0);
        for (i, value) in line.iter_mut().enumerate() {
            let distance = f64::from(*value);
            // Half a step for the gaps where intersecting triangles were divided.
            if i > 0 && before + distance <= 1.5 * step {
                let point = grid.position(&Vector3::from(grid.triple(row * nx + i).map(|i| i as f64)));
                inside = winding.at(&point) > 0.5;
            }
            before = distance;
            if !inside {
                *value = -*value;
            }
        }
    });
}

/// A triangle in equal parts with edges of at most `longest` [m].
fn divided(corners: [Vector3; 3], longest: f64) -> Vec<[Vector3; 3]> {
    let [a, b, c] = corners;
    let edge = (b - a).norm().max((c - b).norm()).max((a - c).norm());
    let levels = (edge / longest).log2().ceil().clamp(0.0, f64::from(MOST_LEVELS)) as u32;
    (0..levels).fold(vec![corners], |triangles, _| {
        let four = |[a, b, c]: [Vector3; 3]| {
            let [d, e, f] = [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0];
            [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
        };
        triangles.into_iter().flat_map(four).collect()
    })
}
