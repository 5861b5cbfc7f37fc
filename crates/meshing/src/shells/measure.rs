//! Distances between shells and their target, both ways.

use pliant_geometry::{
    CellKind, CurvedTriangle, DataArray, Mesh, Surface, SurfaceLocator, SurfacePoint, Vector3, boundary,
};
use rayon::prelude::*;

use super::effort::{Effort, LANDING};
use super::report::{Flaw, ShellReport};
use super::target::{Detail, FACING, Target};
use super::{FittedShells, ShellGoal, Shells};
use crate::report::hausdorff::{Hausdorff, Sample, distance, lattice, locator, samples, spread};
use crate::surface::triangles::shape;

/// Parts of an edge of the flat triangles that start the search for the nearest place of the shells.
const FACETS: usize = 8;

/// Parts of an edge with more than [`MANY`] shells.
const FEWER_FACETS: usize = 4;
const MANY: usize = 2000;

/// Steps from there to the nearest place of a shell.
const STEPS: usize = 10;

/// Place on the shells that is nearest to a point of the target.
#[derive(Clone, Copy)]
pub(super) struct Landing {
    pub(super) point: Vector3,
    /// The normal of the target there.
    normal: Vector3,
    pub(super) shell: u32,
    pub(super) place: [f64; 3],
    pub(super) off: f64,
    /// Unit vector from the point to its nearest place.
    pub(super) along: Vector3,
}

/// Distances of shells.
#[derive(Clone)]
pub(super) struct Distances {
    /// Largest distance of each shell from the target, by the number of its triangle [m].
    there: Vec<f64>,
    /// Parts of an edge between the sampled places of a shell.
    parts: usize,
    /// Nearest places of the points of the target, in the order of these points.
    pub(super) landings: Vec<Landing>,
}

impl Distances {
    /// Largest distance of each shell, both ways, by the number of its triangle [m].
    pub(super) fn far(&self) -> Vec<f64> {
        let mut far = self.there.clone();
        for landing in &self.landings {
            let far = &mut far[landing.shell as usize];
            *far = far.max(landing.off);
        }
        far
    }

    /// Returns the distances of some shells, increasing, which are numbered anew, and of the points of the
    /// target that are nearest to moving shells.
    pub(super) fn part(&self, shells: &[u32], moves: impl Fn(u32) -> bool) -> Self {
        let there = shells.iter().map(|&t| self.there[t as usize]).collect();
        let landings = self.landings.iter().filter(|landing| moves(landing.shell)).filter_map(|landing| {
            Some(Landing { shell: shells.binary_search(&landing.shell).ok()? as u32, ..*landing })
        });
        Self { there, parts: self.parts, landings: landings.collect() }
    }
}

impl Distances {
    /// Replaces the distances of the shells that moved by the distances of a part. `shells` holds the numbers
    /// of the part's shells here.
    pub(super) fn put(&mut self, part: &Self, shells: &[u32], moved: impl Fn(u32) -> bool) {
        let count = shells.iter().map(|&t| t as usize + 1).fold(self.there.len(), usize::max);
        self.there.resize(count, 0.0);
        shells.iter().zip(&part.there).for_each(|(&t, &off)| self.there[t as usize] = off);
        let changed = self.landings.iter_mut().filter(|landing| moved(landing.shell));
        for (landing, found) in changed.zip(&part.landings) {
            *landing = Landing { shell: shells[found.shell as usize], ..*found };
        }
    }

    /// The largest distance of points of the target from the shells.
    pub(super) fn largest_back(&self) -> f64 {
        self.landings.iter().map(|landing| landing.off).fold(0.0, f64::max)
    }
}

impl Shells {
    /// The largest distance of the shells that move [m].
    pub(super) fn farthest_moving(&self, distances: &Distances) -> f64 {
        let far = distances.far();
        self.mesh.alive().filter(|&t| self.moves(t)).map(|t| far[t as usize]).fold(0.0, f64::max)
    }

    /// Measures all distances.
    pub(super) fn distances(&self, detail: &Detail, target: &Target) -> Distances {
        let shells: Vec<u32> = self.mesh.alive().collect();
        let mut there = vec![0.0; self.mesh.triangles.len()];
        self.measure(&shells, detail.parts, target, &mut there);
        Distances { there, parts: detail.parts, landings: self.landings(shells, detail) }
    }

    /// Nearest places of the points of the target on some shells.
    fn landings(&self, shells: Vec<u32>, detail: &Detail) -> Vec<Landing> {
        let nearest = Nearest::new(self, shells);
        let spots = detail.samples.par_iter().zip(&detail.normals);
        spots.filter_map(|(sample, normal)| nearest.landing(&sample.point, normal)).collect()
    }

    /// Distances after some shells have moved. Points of the target that were nearest to moved shells are
    /// searched on these shells and their neighbours. All others are at most as far off as before.
    pub(super) fn distances_after(
        &self,
        before: &Distances,
        target: &Target,
        effort: &mut Effort,
    ) -> Distances {
        let (moving, resting): (Vec<u32>, Vec<u32>) = self.mesh.alive().partition(|&t| self.moves(t));
        let mut there = before.there.clone();
        there.resize(self.mesh.triangles.len(), 0.0);
        (0..).zip(&mut there).filter(|(t, _)| !self.mesh.exists(*t)).for_each(|(_, off)| *off = 0.0);
        self.measure(&moving, before.parts, target, &mut there);
        let mut near = vec![false; self.mesh.points.len()];
        moving.iter().flat_map(|&t| self.mesh.triangles[t as usize]).for_each(|n| near[n as usize] = true);
        let beside = resting
            .into_iter()
            .filter(|&t| self.mesh.triangles[t as usize].iter().any(|&n| near[n as usize]));
        let nearest = Nearest::new(self, moving.iter().copied().chain(beside).collect());
        let searched = before.landings.iter().filter(|landing| self.moves(landing.shell)).count();
        effort.search(searched, LANDING);
        effort.search(
            moving.len() * lattice(before.parts).len() + FEWER_FACETS * FEWER_FACETS * moving.len(),
            1,
        );
        let again = |landing: &Landing| {
            if self.moves(landing.shell) {
                nearest.landing(&landing.point, &landing.normal).unwrap_or(*landing)
            } else {
                *landing
            }
        };
        Distances { there, parts: before.parts, landings: before.landings.par_iter().map(again).collect() }
    }

    /// Computes the largest distance of each of some shells from the target.
    fn measure(&self, shells: &[u32], parts: usize, target: &Target, there: &mut [f64]) {
        let places = lattice(parts);
        let of = |&t: &u32| {
            let patch = self.patch(t);
            let off = |&w: &[f64; 3]| {
                let x = patch.point(w);
                (target.reference.closest(&x).0 - x).norm()
            };
            places.iter().map(off).fold(0.0, f64::max)
        };
        let found: Vec<f64> = shells.par_iter().map(of).collect();
        shells.iter().zip(found).for_each(|(&t, off)| there[t as usize] = off);
    }

    /// Measures everything and reports the findings.
    pub(super) fn finished(
        &self,
        target: &Target,
        rounds: usize,
        goal: ShellGoal,
        stopped: bool,
    ) -> FittedShells {
        let Picture { error_map, forward, mut far, mut farthest } = self.picture(target);
        let shells: Vec<u32> = self.mesh.alive().collect();
        let nearest = Nearest::new(self, shells);
        let samples = &target.fine.samples;
        let back = samples.par_iter().filter_map(|sample| nearest.nearest(&sample.point));
        let back: Vec<(usize, f64)> = back.map(|(shell, _, off)| (shell, off)).collect();
        let backward = spread(samples, &back.iter().map(|(_, off)| *off).collect::<Vec<_>>());
        let distances = Hausdorff::of(forward, backward);
        if let Some((at, (_, off))) = back.iter().enumerate().max_by(|a, b| a.1.1.total_cmp(&b.1.1))
            && *off > forward.0
        {
            farthest = samples[at].point;
        }
        for (shell, off) in back {
            far[shell] = far[shell].max(off);
        }
        let shapes: Vec<f64> = self.mesh.alive().map(|t| shape(self.mesh.corners(t))).collect();
        let creased = |n: &usize| self.creased[*n];
        let folds = |n: &usize| self.creased[*n] && !self.sharp[*n];
        let creases = (0..self.creased.len()).filter(folds).collect::<Vec<_>>();
        let crossing = self.crossing();
        let mut mesh = self.mesh.to_parted_mesh();
        let normal = |(n, normal): (usize, &Vector3)| if creased(&n) { [0.0; 3] } else { (*normal).into() };
        let normals = self.normals.iter().enumerate().flat_map(normal).collect();
        mesh.point_data.insert("normal".into(), DataArray { components: 3, values: normals });
        let data = &mut mesh.block_mut(CellKind::Triangle).data;
        data.insert("distance".into(), DataArray::scalar(far));
        let flat: Vec<bool> = self.mesh.alive().map(|t| self.is_flat(t)).collect();
        let flattened = flat.iter().filter(|flat| **flat).count();
        if flattened > 0 {
            data.insert(
                "flat".into(),
                DataArray::scalar(flat.iter().map(|&flat| u8::from(flat).into()).collect()),
            );
        }
        let first_flat = self.mesh.alive().find(|&t| self.is_flat(t)).map(|t| self.mesh.corners(t)[0]);
        let asked = match goal {
            ShellGoal::Error(error) => Some(error),
            ShellGoal::Shells(_) => None,
        };
        let reached = match goal {
            ShellGoal::Error(error) => distances.largest() <= error * target.diagonal,
            ShellGoal::Shells(number) => shapes.len() + 1 >= number,
        };
        let report = ShellReport {
            shells: shapes.len(),
            nodes: self.mesh.points.len(),
            shape: [
                shapes.iter().copied().fold(f64::INFINITY, f64::min),
                shapes.iter().sum::<f64>() / shapes.len().max(1) as f64,
            ],
            distances,
            farthest: farthest.into(),
            flat: self.flat(target),
            diagonal: target.diagonal,
            rounds,
            asked,
            reached,
            stopped: stopped && !reached,
            sharp: self.sharp.iter().filter(|sharp| **sharp).count(),
            creases: Flaw::of(creases.len(), creases.first().map(|&n| self.mesh.points[n])),
            flattened: Flaw::of(flattened, first_flat),
            crossings: Flaw::of(crossing.shells().len(), crossing.place),
        };
        FittedShells { mesh, error_map, report }
    }

    /// Distances of the flat triangles.
    fn flat(&self, target: &Target) -> Hausdorff {
        let locator = locator(&self.mesh);
        let points = samples(&self.mesh, target.diagonal / 200.0);
        let there = |s: &Sample| (target.reference.closest(&s.point).0 - s.point).norm();
        let there: Vec<f64> = points.par_iter().map(there).collect();
        let back = target.fine.samples.par_iter().map(|s| distance(&locator, &s.point)).collect::<Vec<_>>();
        Hausdorff::of(spread(&points, &there), spread(&target.fine.samples, &back))
    }

    /// The curved surface in small triangles with its distances.
    fn picture(&self, target: &Target) -> Picture {
        let (places, pieces) = (lattice(target.fine.parts), pieces(target.fine.parts));
        let triangles: Vec<u32> = self.mesh.alive().collect();
        let of = |&t: &u32| {
            let patch = self.patch(t);
            let area = self.mesh.area(t) / places.len() as f64;
            let place = |&w: &[f64; 3]| {
                let point = patch.point(w);
                (Sample { point, area }, (target.reference.closest(&point).0 - point).norm())
            };
            places.iter().map(place).collect::<Vec<_>>()
        };
        let measured: Vec<(Sample, f64)> = triangles.par_iter().flat_map_iter(of).collect();
        let (samples, off): (Vec<Sample>, Vec<f64>) = measured.into_iter().unzip();
        let mut error_map = Mesh { points: samples.iter().map(|s| s.point).collect(), ..Mesh::default() };
        let corners = (0..triangles.len()).flat_map(|t| {
            let places = places.len();
            pieces.iter().flatten().map(move |&k| (t * places) as u32 + k)
        });
        error_map.block_mut(CellKind::Triangle).nodes = corners.collect();
        let farthest = samples.iter().zip(&off).max_by(|a, b| a.1.total_cmp(b.1));
        let farthest = farthest.map(|(sample, _)| sample.point).unwrap_or_default();
        let far = off.chunks(places.len()).map(|off| off.iter().copied().fold(0.0, f64::max)).collect();
        let forward = spread(&samples, &off);
        error_map.point_data.insert("distance".into(), DataArray::scalar(off));
        Picture { error_map, forward, far, farthest }
    }
}

/// The curved surface in small triangles.
struct Picture {
    /// The triangles, with their distances from the target.
    error_map: Mesh,
    /// The largest of these distances and their root mean square [m].
    forward: (f64, f64),
    /// The largest distance of each shell [m].
    far: Vec<f64>,
    /// Place of the largest distance [m].
    farthest: Vector3,
}

/// The small triangles between the places of a lattice.
pub(super) fn pieces(n: usize) -> Vec<[u32; 3]> {
    // Row i of the lattice has n − i + 1 places.
    let at = |i: usize, j: usize| ((i * (2 * n + 3 - i)) / 2 + j) as u32;
    let mut found = Vec::with_capacity(n * n);
    for i in 0..n {
        for j in 0..n - i {
            found.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
            if j + 1 < n - i {
                found.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    found
}

/// Search for the nearest place of all shells, which starts from small flat triangles.
struct Nearest {
    patches: Vec<CurvedTriangle>,
    triangles: Vec<u32>,
    locator: SurfaceLocator,
    places: Vec<[f64; 3]>,
}

impl Nearest {
    fn new(shells: &Shells, triangles: Vec<u32>) -> Self {
        let facets = if triangles.len() > MANY { FEWER_FACETS } else { FACETS };
        let (places, pieces) = (lattice(facets), pieces(facets));
        let patches: Vec<CurvedTriangle> = triangles.iter().map(|&t| shells.patch(t)).collect();
        let mut mesh = Mesh {
            points: patches.iter().flat_map(|patch| places.iter().map(|&w| patch.point(w))).collect(),
            ..Mesh::default()
        };
        let count = places.len();
        mesh.block_mut(CellKind::Triangle).nodes = (0..patches.len())
            .flat_map(|t| pieces.iter().flatten().map(move |&k| (t * count) as u32 + k))
            .collect();
        let surface: Surface = boundary(&mesh);
        let faces: Vec<u32> = (0..surface.faces.len() as u32).collect();
        Self { patches, triangles, locator: SurfaceLocator::new(&surface, &faces, &mesh.points), places }
    }

    /// Returns the shell, the place on it and the distance [m] that are nearest to a point.
    fn nearest(&self, point: &Vector3) -> Option<(usize, [f64; 3], f64)> {
        Some(self.refined_from(point, self.locator.closest(point)?))
    }

    /// Returns the nearest place that looks the same way as the target. A place that looks the other way
    /// counts if nothing else is near, relative to the size of a shell.
    fn landing(&self, point: &Vector3, normal: &Vector3) -> Option<Landing> {
        let (mut shell, mut place, mut off) = self.nearest(point)?;
        let patch = &self.patches[shell];
        if patch.facet_normal().dot(normal) < FACING
            && let Some(at) = self.locator.closest_facing(point, normal, FACING, off + patch.size())
        {
            (shell, place, off) = self.refined_from(point, at);
        }
        let along = (self.patches[shell].point(place) - point).try_normalize(0.0).unwrap_or_default();
        Some(Landing { point: *point, normal: *normal, shell: self.triangles[shell], place, off, along })
    }

    fn refined_from(&self, point: &Vector3, at: SurfacePoint) -> (usize, [f64; 3], f64) {
        let count = self.places.len();
        let shell = at.nodes[0] as usize / count;
        let corners = at.nodes.map(|node| self.places[node as usize % count]);
        let start = [0, 1, 2].map(|k| (0..3).map(|c| at.weights[c] * corners[c][k]).sum());
        let (place, off) = self.patches[shell].closest_in(STEPS, point, start);
        (shell, place, off)
    }
}
