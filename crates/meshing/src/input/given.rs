//! The input surfaces that a mesh is to follow: the triangles of a file, or the faces of the voxels of
//! labels. The smooth fields made from them are elsewhere. Each face knows the labels on its two sides.

use std::fmt;

use pliant_geometry::{CellKind, Grid, Mesh, SurfaceLocator, Vector3, boundary};
use serde::Serialize;

use crate::report::hausdorff::{Sample, lattice};
use crate::surface::triangles::TriangleMesh;

/// Reference that distances of a mesh are measured to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum MeasuredTo {
    /// The zero surface of a function, such as the smooth surface of an image.
    #[default]
    Field,
    /// The triangles of the input, as mended.
    Triangles,
    /// The faces of the voxels of the labels, after cleaning.
    Voxels,
}

impl fmt::Display for MeasuredTo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Field => "the smooth surface",
            Self::Triangles => "the triangles of the input",
            Self::Voxels => "the faces of the voxels of the labels",
        })
    }
}

/// Source of a body.
pub(crate) enum Given {
    /// One material within triangles, with its label.
    Triangles(TriangleMesh, i32),
    /// The material of each voxel, numbered from 1, 0 outside.
    Voxels { grid: Grid, materials: Vec<u8> },
}

/// Stands for the outside as a side of a face.
pub(crate) const OUTSIDE_LABEL: i32 = 0;

impl Given {
    pub(crate) fn measured_to(&self) -> MeasuredTo {
        match self {
            Self::Triangles(..) => MeasuredTo::Triangles,
            Self::Voxels { .. } => MeasuredTo::Voxels,
        }
    }

    /// Tolerated distance of a smooth surface from the input [m]: the diagonal of a voxel.
    pub(crate) fn resolution(&self) -> f64 {
        match self {
            Self::Triangles(..) => 0.0,
            Self::Voxels { grid, .. } => Vector3::from(grid.spacing()).norm(),
        }
    }

    /// Its faces. Of voxels these are the faces between different materials; `labels` gives their labels.
    pub(crate) fn patches(&self, labels: &[i32]) -> Patches {
        match self {
            Self::Triangles(surface, label) => {
                let (points, triangles) = surface.compact();
                let sides = vec![sorted([OUTSIDE_LABEL, *label]); triangles.len()];
                Patches { points, triangles, sides }
            }
            Self::Voxels { grid, materials } => {
                let label = |material: u8| match material {
                    0 => OUTSIDE_LABEL,
                    material => labels[usize::from(material) - 1],
                };
                faces_of_voxels(grid, materials, &label)
            }
        }
    }
}

/// Triangles with the labels on their two sides, the smaller one first.
#[derive(Clone, Debug, Default)]
pub(crate) struct Patches {
    pub(crate) points: Vec<Vector3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) sides: Vec<[i32; 2]>,
}

pub(crate) fn sorted([a, b]: [i32; 2]) -> [i32; 2] {
    [a.min(b), a.max(b)]
}

impl Patches {
    /// Area of its triangles [m²].
    pub(crate) fn area(&self) -> f64 {
        self.triangles.iter().map(|nodes| area(self.corners(nodes))).sum()
    }

    fn corners(&self, nodes: &[u32; 3]) -> [Vector3; 3] {
        nodes.map(|node| self.points[node as usize])
    }

    /// Some of its triangles with the points they use.
    pub(crate) fn only(&self, chosen: impl Fn([i32; 2]) -> bool) -> Self {
        let (mut triangles, mut sides) = (Vec::new(), Vec::new());
        for (triangle, labels) in
            self.triangles.iter().zip(&self.sides).filter(|(_, labels)| chosen(**labels))
        {
            triangles.push(*triangle);
            sides.push(*labels);
        }
        let mut used = triangles.concat();
        used.sort_unstable();
        used.dedup();
        for node in triangles.as_flattened_mut() {
            *node = used.binary_search(node).unwrap_or_default() as u32;
        }
        Self { points: used.iter().map(|&node| self.points[node as usize]).collect(), triangles, sides }
    }

    /// A search tree over its triangles; `None` without any.
    pub(crate) fn locator(&self) -> Option<SurfaceLocator> {
        if self.triangles.is_empty() {
            return None;
        }
        let mut mesh = Mesh { points: self.points.clone(), ..Mesh::default() };
        mesh.block_mut(CellKind::Triangle).nodes = self.triangles.concat();
        let surface = boundary(&mesh);
        let faces: Vec<u32> = (0..surface.faces.len() as u32).collect();
        Some(SurfaceLocator::new(&surface, &faces, &mesh.points))
    }

    /// Samples of its triangles no more than about `spacing` [m] apart, corners once each.
    pub(crate) fn samples(&self, spacing: f64) -> Vec<Sample> {
        /// Samples along an edge at most.
        const MOST_ALONG: usize = 32;
        let mut share = vec![0.0; self.points.len()];
        let mut found = Vec::new();
        for nodes in &self.triangles {
            let [a, b, c] = self.corners(nodes);
            let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
            let places = lattice(((longest / spacing).ceil() as usize).clamp(1, MOST_ALONG));
            let area = area([a, b, c]) / places.len() as f64;
            for weights in places {
                match weights.iter().position(|&weight| weight == 1.0) {
                    Some(corner) => share[nodes[corner] as usize] += area,
                    None => {
                        found.push(Sample { point: a * weights[0] + b * weights[1] + c * weights[2], area })
                    }
                }
            }
        }
        let corners = self.points.iter().zip(share).filter(|(_, area)| *area > 0.0);
        found.extend(corners.map(|(&point, area)| Sample { point, area }));
        found
    }
}

fn area([a, b, c]: [Vector3; 3]) -> f64 {
    0.5 * (b - a).cross(&(c - a)).norm()
}

/// The faces between voxels of different materials, two triangles each.
fn faces_of_voxels(grid: &Grid, materials: &[u8], label: &dyn Fn(u8) -> i32) -> Patches {
    let [nx, ny, nz] = grid.dims;
    let strides = [1, nx, nx * ny];
    // Corners of voxels, one more along each axis than there are voxels.
    let corner = |[i, j, k]: [usize; 3]| i as u64 + (nx as u64 + 1) * (j as u64 + (ny as u64 + 1) * k as u64);
    let (mut quads, mut sides): (Vec<[u64; 4]>, Vec<[i32; 2]>) = Default::default();
    for (at, &material) in materials.iter().enumerate() {
        let here = grid.triple(at);
        for axis in 0..3 {
            if here[axis] + 1 == grid.dims[axis] || materials[at + strides[axis]] == material {
                continue;
            }
            let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
            let shifted = |du: usize, dv: usize| {
                let mut place = here;
                place[axis] += 1;
                place[u] += du;
                place[v] += dv;
                corner(place)
            };
            quads.push([shifted(0, 0), shifted(1, 0), shifted(1, 1), shifted(0, 1)]);
            sides.push(sorted([label(material), label(materials[at + strides[axis]])]));
        }
    }
    let mut used = quads.concat();
    used.sort_unstable();
    used.dedup();
    let point = |&corner: &u64| {
        let (row, i) = (corner / (nx as u64 + 1), corner % (nx as u64 + 1));
        let index = [i, row % (ny as u64 + 1), row / (ny as u64 + 1)].map(|i| i as f64 - 0.5);
        grid.position(&Vector3::from(index))
    };
    debug_assert!(used.last().is_none_or(|&last| last <= corner([nx, ny, nz])));
    let number = |corner: u64| used.binary_search(&corner).unwrap_or_default() as u32;
    let triangles = quads.iter().flat_map(|quad| {
        let [a, b, c, d] = quad.map(number);
        [[a, b, c], [a, c, d]]
    });
    Patches {
        points: used.iter().map(point).collect(),
        triangles: triangles.collect(),
        sides: sides.into_iter().flat_map(|sides| [sides; 2]).collect(),
    }
}

/// True if a pair of sides is on the boundary of the whole.
pub(crate) fn is_outer(sides: [i32; 2]) -> bool {
    sides.contains(&OUTSIDE_LABEL)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two voxels of different labels side by side: five faces each to the outside, one between them.
    #[test]
    fn faces_of_voxels_know_their_sides_and_places() {
        let grid = Grid::along_axes([4, 3, 3], Vector3::zeros(), [1.0, 2.0, 3.0]).unwrap();
        let mut materials = vec![0; grid.len()];
        materials[1 + 4 * (1 + 3)] = 1;
        materials[2 + 4 * (1 + 3)] = 2;
        let given = Given::Voxels { grid, materials };
        let patches = given.patches(&[7, 5]);
        let only = |sides: [i32; 2]| patches.only(|labels| labels == sides);
        let count = |sides: [i32; 2]| only(sides).triangles.len();
        assert_eq!([count([0, 5]), count([0, 7]), count([5, 7])], [10, 10, 2]);
        let inner = only([5, 7]);
        assert!((inner.area() - 6.0).abs() < 1e-12);
        assert!(inner.points.len() == 4 && inner.points.iter().all(|point| point.x == 1.5));
        assert!((patches.area() - 2.0 * (2.0 + 3.0) * 2.0 - 12.0 - 6.0).abs() < 1e-12);
        let area: f64 = inner.samples(0.7).iter().map(|sample| sample.area).sum();
        assert!((area - 6.0).abs() < 1e-12);
    }
}
