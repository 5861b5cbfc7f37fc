//! Parts of a body that its mesh lacks. The input body, voxels or the inside of triangles, is sampled on a
//! grid. Samples in no tet of the mesh form a thin layer under curved surfaces everywhere. They form lumps
//! where a part is lost: thinner than the cells, torn off, or too small. A lump has samples far from the
//! mesh; from there it is followed up to where it meets the mesh.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use pliant_geometry::{Grid, Vector3};

use crate::input::anatomy::Anatomy;
use crate::input::given::Given;
use crate::tets::complex::Complex;

/// Steps of the grid along an edge of the cells inside triangles.
const STEPS_PER_EDGE: f64 = 8.0;

/// Most samples of a box.
const MOST_SAMPLES: f64 = (1 << 23) as f64;

/// Parts of a voxel up to this one come from rounding.
const LEAST_PART: f32 = 1e-6;

/// A lump is followed from its far samples down to this part of their least distance.
const NEAR: f64 = 0.5;

/// A part of a body that its mesh lacks.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LostPart {
    /// Its volume of each material [m³].
    pub(crate) volumes: Vec<f64>,
    /// Its point that is farthest from the mesh [m].
    pub(crate) place: Vector3,
}

impl LostPart {
    /// Its volume [m³].
    pub(crate) fn volume(&self) -> f64 {
        self.volumes.iter().sum()
    }
}

/// A body on a grid.
pub(crate) struct Samples {
    grid: Grid,
    /// Material of each sample, 0 outside.
    materials: Vec<u8>,
    /// Part of a voxel in the body that each sample stands for; a whole voxel if empty.
    parts: Vec<f32>,
}

impl Samples {
    /// Samples a body made of voxels or of triangles, for cells of `edge` [m].
    pub(crate) fn of(anatomy: &Anatomy<'_>, edge: f64) -> Option<Self> {
        match anatomy.given()? {
            Given::Voxels { grid, materials } => {
                Some(Self { grid: *grid, materials: materials.clone(), parts: Vec::new() })
            }
            Given::Triangles(surface, _) => {
                let (points, triangles) = surface.compact();
                Self::within(&points, &triangles, edge / STEPS_PER_EDGE)
            }
        }
    }

    /// Samples the inside of triangles, on a grid of `step` [m] or more. Rows along x are cut at the
    /// triangles, so parts thinner than a step count with their volume on average.
    fn within(points: &[Vector3], triangles: &[[u32; 3]], step: f64) -> Option<Self> {
        let start = *points.first()?;
        let (low, high) = points.iter().fold((start, start), |(low, high), x| (low.inf(x), high.sup(x)));
        let size = high - low;
        let step = step.max((size.product() / MOST_SAMPLES).cbrt());
        let dims = [0, 1, 2].map(|axis| (size[axis] / step).ceil() as usize + 2);
        let grid = Grid::along_axes(dims, low.add_scalar(-0.5 * step), [step; 3]).ok()?;
        let nx = dims[0];
        // Rows off the middle of their voxels: faces along the grid are met by their share of rows.
        let off = |row: usize, seed: f64| (row as f64 * seed).fract() - 0.5;
        let off = |row: usize| [off(row, 0.618_033_988_75), off(row, 0.754_877_666_25)];
        let mut materials = vec![0; grid.len()];
        let mut parts = vec![0.0_f32; grid.len()];
        for (row, ways) in inner_rows(&grid, points, triangles, off).into_iter().enumerate() {
            for [from, to] in ways {
                for i in (from + 0.5).floor().max(0.0) as usize..=((to + 0.5).floor() as usize).min(nx - 1) {
                    let part = (to.min(i as f64 + 0.5) - from.max(i as f64 - 0.5)).max(0.0);
                    let at = i + nx * row;
                    parts[at] += part as f32;
                    materials[at] = u8::from(parts[at] > LEAST_PART);
                }
            }
        }
        Some(Self { grid, materials, parts })
    }

    fn part(&self, at: usize) -> f64 {
        self.parts.get(at).map_or(1.0, |&part| f64::from(part))
    }

    /// Marks the samples within triangles.
    pub(crate) fn within_surface(&self, points: &[Vector3], triangles: &[[u32; 3]]) -> Vec<bool> {
        let nx = self.grid.dims[0];
        let mut covered = vec![false; self.materials.len()];
        // Points of surfaces may lie on rows of voxels.
        for (row, ways) in inner_rows(&self.grid, points, triangles, |_| [1.3e-5, 1.7e-5]).iter().enumerate()
        {
            for [from, to] in ways {
                for i in from.ceil().max(0.0) as usize..((to.floor() + 1.0).max(0.0) as usize).min(nx) {
                    covered[i + nx * row] = true;
                }
            }
        }
        covered
    }

    /// Volume of each material among some samples [m³].
    pub(crate) fn volumes(&self, is_chosen: impl Fn(usize) -> bool) -> Vec<f64> {
        let mut volumes = vec![0.0; self.most()];
        for at in (0..self.materials.len()).filter(|&at| self.materials[at] > 0 && is_chosen(at)) {
            volumes[usize::from(self.materials[at]) - 1] += self.part(at) * self.grid.voxel_volume();
        }
        volumes
    }

    /// Volume of each material among the samples inside a surface [m³]. Samples of the outside there count to
    /// the material that most of their neighbours have.
    pub(crate) fn volumes_with_neighbours(&self, inside: &[bool]) -> Vec<f64> {
        let mut volumes = self.volumes(|at| inside[at]);
        for at in (0..inside.len()).filter(|&at| inside[at] && self.materials[at] == 0) {
            let mut counts = vec![0; volumes.len() + 1];
            self.around(at, 1).for_each(|(next, _)| counts[usize::from(self.materials[next])] += 1);
            let most = (1..counts.len()).rev().max_by_key(|&material| counts[material]);
            if let Some(most) = most.filter(|&material| counts[material] > 0) {
                volumes[most - 1] += self.grid.voxel_volume();
            }
        }
        volumes
    }

    /// The last material.
    fn most(&self) -> usize {
        self.materials.iter().copied().max().map_or(0, usize::from)
    }

    /// Marks the samples that tets hold.
    pub(crate) fn within_tets(&self, complex: &Complex) -> Vec<bool> {
        let mut covered = vec![false; self.materials.len()];
        let index: Vec<Vector3> = complex.points.iter().map(|point| self.grid.index(point)).collect();
        let [nx, ny, nz] = self.grid.dims;
        for tet in complex.alive() {
            let x = complex.tets[tet as usize].map(|node| index[node as usize]);
            let (low, high) = (x[0].inf(&x[1]).inf(&x[2]).inf(&x[3]), x[0].sup(&x[1]).sup(&x[2]).sup(&x[3]));
            let range = |axis: usize, most: usize| {
                let last = high[axis].floor().min(most as f64 - 1.0);
                (low[axis].ceil().max(0.0) as usize)..(last + 1.0).max(0.0) as usize
            };
            let Some(inverse) =
                nalgebra::Matrix3::from_columns(&[x[1] - x[0], x[2] - x[0], x[3] - x[0]]).try_inverse()
            else {
                continue;
            };
            for k in range(2, nz) {
                for j in range(1, ny) {
                    for i in range(0, nx) {
                        let weights = inverse * (Vector3::new(i as f64, j as f64, k as f64) - x[0]);
                        if weights.iter().all(|&w| w >= -1e-9) && weights.sum() <= 1.0 + 1e-9 {
                            covered[i + nx * (j + ny * k)] = true;
                        }
                    }
                }
            }
        }
        covered
    }

    /// The parts with samples farther than `far` [m] from the samples in the mesh, the largest first.
    pub(crate) fn lost(&self, covered: &[bool], far: f64) -> Vec<LostPart> {
        let is_lost = |at: usize| self.materials[at] > 0 && !covered[at];
        let distances = self.distances(covered);
        // One layer of samples lies under every curved surface.
        let layer = self.grid.spacing().into_iter().fold(0.0, f64::max);
        let near = (NEAR * far).max(1.01 * layer) as f32;
        let most = self.most();
        let mut is_taken = vec![false; self.materials.len()];
        let mut lost = Vec::new();
        for start in 0..self.materials.len() {
            if is_taken[start] || !is_lost(start) || distances[start] <= far as f32 {
                continue;
            }
            let (mut volumes, mut farthest) = (vec![0.0; most], start);
            let mut ahead = vec![start];
            is_taken[start] = true;
            while let Some(at) = ahead.pop() {
                volumes[usize::from(self.materials[at]) - 1] += self.part(at) * self.grid.voxel_volume();
                if distances[at] > distances[farthest] {
                    farthest = at;
                }
                // Through the lump in every direction, over gaps that rows leave in parts as thin as a step;
                // then only towards the mesh.
                let lump = self.around(at, 2).filter(|&(next, _)| distances[next] > near);
                let rest = self.around(at, 1).filter(|&(next, _)| distances[next] < distances[at]);
                for (next, _) in lump.chain(rest) {
                    if is_lost(next) && !std::mem::replace(&mut is_taken[next], true) {
                        ahead.push(next);
                    }
                }
            }
            let triple = self.grid.triple(farthest).map(|i| i as f64);
            lost.push(LostPart { volumes, place: self.grid.position(&Vector3::from(triple)) });
        }
        lost.sort_by(|a, b| b.volume().total_cmp(&a.volume()));
        lost
    }

    /// Distances [m] through the body from the samples that the mesh holds; infinite for loose pieces
    /// (Dijkstra 1959).
    fn distances(&self, covered: &[bool]) -> Vec<f32> {
        let mut distances = vec![f32::INFINITY; covered.len()];
        let mut ahead = BinaryHeap::new();
        for at in 0..covered.len() {
            if covered[at] {
                distances[at] = 0.0;
            } else if self.materials[at] > 0 {
                let nearest = self.around(at, 1).filter(|&(next, _)| covered[next]).map(|(_, step)| step);
                distances[at] = nearest.fold(f32::INFINITY, f32::min);
                if distances[at].is_finite() {
                    ahead.push(Reached { distance: distances[at], at });
                }
            }
        }
        while let Some(Reached { distance, at }) = ahead.pop() {
            if distance > distances[at] {
                continue;
            }
            for (next, step) in self.around(at, 1) {
                let far = distance + step;
                if self.materials[next] > 0 && far < distances[next] {
                    distances[next] = far;
                    ahead.push(Reached { distance: far, at: next });
                }
            }
        }
        distances
    }

    /// The samples up to `reach` steps from one along each axis, and how far they are from it [m].
    fn around(&self, at: usize, reach: usize) -> impl Iterator<Item = (usize, f32)> {
        let dims = self.grid.dims;
        let from = self.grid.triple(at);
        let axes = self.grid.axes;
        let side = 2 * reach + 1;
        let middle = side.pow(3) / 2;
        (0..side.pow(3)).filter(move |&way| way != middle).filter_map(move |way| {
            let shift = [way % side, way / side % side, way / side / side];
            let mut to = [0; 3];
            for axis in 0..3 {
                to[axis] = (from[axis] + shift[axis]).checked_sub(reach).filter(|&i| i < dims[axis])?;
            }
            let step = axes * Vector3::from(shift.map(|i| i as f64 - reach as f64));
            Some((to[0] + dims[0] * (to[1] + dims[1] * to[2]), step.norm() as f32))
        })
    }
}

/// Intervals of the rows of a grid along i that lie within triangles [voxels], row by row. `off` shifts a row
/// along j and k [voxels].
fn inner_rows(
    grid: &Grid,
    points: &[Vector3],
    triangles: &[[u32; 3]],
    off: impl Fn(usize) -> [f64; 2],
) -> Vec<Vec<[f64; 2]>> {
    let [_, ny, nz] = grid.dims;
    let handed = grid.axes.determinant().signum();
    let mut cuts: Vec<Vec<(f64, f64)>> = vec![Vec::new(); ny * nz];
    for nodes in triangles {
        let [a, b, c] = nodes.map(|node| grid.index(&points[node as usize]));
        let range = |axis: usize, most: usize| {
            let [first, last] = [a.inf(&b).inf(&c)[axis] - 1.0, a.sup(&b).sup(&c)[axis] + 1.0];
            (first.floor().max(0.0) as usize)..((last.ceil() + 1.0).max(0.0) as usize).min(most)
        };
        let area = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
            (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
        };
        let [p, q, r] = [a, b, c].map(|x| [x.y, x.z]);
        let whole = area(p, q, r);
        if whole == 0.0 {
            continue;
        }
        for k in range(2, nz) {
            for j in range(1, ny) {
                let [y, z] = off(j + ny * k);
                let at = [j as f64 + y, k as f64 + z];
                let weights = [area(at, q, r), area(p, at, r), area(p, q, at)].map(|part| part / whole);
                if weights.iter().all(|&weight| weight >= 0.0) {
                    let x = a.x * weights[0] + b.x * weights[1] + c.x * weights[2];
                    // A normal against the row is an entrance.
                    cuts[j + ny * k].push((x, -whole.signum() * handed));
                }
            }
        }
    }
    let ways = |mut cuts: Vec<(f64, f64)>| {
        cuts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut wound = 0.0;
        let ways = cuts.windows(2).filter_map(|pair| {
            wound += pair[0].1;
            (wound > 0.5).then_some([pair[0].0, pair[1].0])
        });
        ways.collect()
    };
    cuts.into_iter().map(ways).collect()
}

/// A sample on the way, the nearest first.
struct Reached {
    distance: f32,
    at: usize,
}

impl Ord for Reached {
    fn cmp(&self, other: &Self) -> Ordering {
        other.distance.total_cmp(&self.distance).then(other.at.cmp(&self.at))
    }
}

impl PartialOrd for Reached {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Reached {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Reached {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::triangles::TriangleMesh;

    /// A box as an outward surface.
    fn cuboid(low: [f64; 3], high: [f64; 3]) -> (Vec<Vector3>, Vec<[u32; 3]>) {
        let corner = |at: usize| {
            Vector3::from([0, 1, 2].map(|axis| if at >> axis & 1 == 0 { low[axis] } else { high[axis] }))
        };
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let halves = faces.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
        ((0..8).map(corner).collect(), halves.collect())
    }

    /// A plate of 0.3 mm, far thinner than the grid, has its volume but for one row of samples.
    #[test]
    fn a_plate_thinner_than_the_grid_has_its_volume() {
        for thin in 0..3 {
            let (mut low, mut high) = ([0.0, 0.0, 0.0], [0.05, 0.04, 0.045]);
            (low[thin], high[thin]) = (0.01234, 0.01264);
            let (points, triangles) = cuboid(low, high);
            let whole: f64 = (0..3).map(|axis| high[axis] - low[axis]).product();
            let samples = Samples::within(&points, &triangles, 0.001).unwrap();
            let sum: f64 = samples.parts.iter().map(|&part| f64::from(part)).sum();
            let volume = sum * samples.grid.voxel_volume();
            // Rows are met or missed as a whole: 12 of 40 for the last plate.
            let row = (high[0] - low[0]) * 0.001 * 0.001;
            assert!((volume - whole).abs() < 1.01 * row, "{thin}: {}", volume / whole);
        }
    }

    /// Two boxes with a gap between. The mesh is one tet in the first box, and lacks a thin layer there.
    #[test]
    fn a_lump_is_lost_and_a_thin_layer_is_not() {
        let (points, triangles) = cuboid([0.0; 3], [0.02, 0.02, 0.02]);
        let (other, more) = cuboid([0.03, 0.0, 0.0], [0.05, 0.02, 0.02]);
        let shifted = more.into_iter().map(|nodes| nodes.map(|node| node + 8));
        let surface =
            TriangleMesh::new([points, other].concat(), triangles.into_iter().chain(shifted).collect());
        let (points, triangles) = surface.compact();
        let samples = Samples::within(&points, &triangles, 0.001).unwrap();
        // Six tets in the first box but for 1 mm on all sides.
        let corners = (0..8)
            .map(|at| Vector3::from([at & 1, at >> 1 & 1, at >> 2].map(|i| 0.001 + 0.018 * f64::from(i))));
        let ring = [1, 3, 2, 6, 4, 5];
        let tets = (0..6).map(|at| [0, ring[at], ring[(at + 1) % 6], 7]).collect();
        let complex = Complex::new(corners.collect(), tets, 0.01);
        let lost = samples.lost(&samples.within_tets(&complex), 0.005);
        assert_eq!(lost.len(), 1);
        assert!((lost[0].volume() / 8e-6 - 1.0).abs() < 0.02, "{:e}", lost[0].volume());
        assert!(lost[0].place.x > 0.03);
    }
}
