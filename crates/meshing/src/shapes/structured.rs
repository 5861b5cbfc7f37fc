//! Blocks and tubes on a structured grid, as hexahedra or six tetrahedra each. The split is Todd's
//! triangulation J1: Kuhn's six paths from corner to opposite corner, mirrored from cell to cell, so
//! neighbouring diagonals meet and no direction is preferred. Leaves out: grading, and blocks or tubes that
//! are not straight (move the points afterwards).

use std::f64::consts::TAU;

use pliant_geometry::{CellBlock, CellKind, Mesh, Vector3};

use crate::error::{MeshingError, require_at_most, require_finite, require_positive};
use crate::input::extent::allowed;

/// The volume cells that a mesher of regular shapes can make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VolumeCell {
    /// Linear tetrahedra, six per cell of the grid.
    Tet,
    /// Linear hexahedra.
    Hex,
}

impl VolumeCell {
    /// Cells of this kind per cell of the grid.
    const fn per_grid_cell(self) -> usize {
        match self {
            Self::Tet => 6,
            Self::Hex => 1,
        }
    }
}

/// Number or size of the cells of a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Resolution {
    /// About this edge [m]: along each axis the nearest whole number of cells, at least 1.
    Edge(f64),
    /// Cells along x, y and z.
    Counts([usize; 3]),
}

/// A box along the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// Corner with the smallest coordinates [m].
    pub origin: Vector3,
    /// Lengths along x, y and z [m].
    pub size: [f64; 3],
}

impl Block {
    /// A block from the origin of space to `size` [m].
    pub fn new(size: [f64; 3]) -> Self {
        Self { origin: Vector3::zeros(), size }
    }

    /// Divides the block into cells. Its six faces are the point sets `x-min`, `x-max`, `y-min`, `y-max`,
    /// `z-min` and `z-max`.
    pub fn mesh(
        &self,
        resolution: Resolution,
        cells: VolumeCell,
        cell_limit: usize,
    ) -> Result<Mesh, MeshingError> {
        require_finite("origin", self.origin)?;
        for (what, length) in ["size along x", "size along y", "size along z"].into_iter().zip(self.size) {
            require_positive(what, length)?;
        }
        let counts = match resolution {
            Resolution::Edge(edge) => {
                require_positive("edge", edge)?;
                checked_counts(self.size.map(|length| (length / edge).round().max(1.0)), cells, cell_limit)?
            }
            Resolution::Counts(counts) => {
                if let Some(axis) = counts.iter().position(|&n| n == 0) {
                    return Err(MeshingError::NoCellsAlong { axis: ['x', 'y', 'z'][axis] });
                }
                checked_counts(counts.map(|n| n as f64), cells, cell_limit)?
            }
        };
        let grid = Grid { counts, wraps: false };
        let names = [Some(["x-min", "x-max"]), Some(["y-min", "y-max"]), Some(["z-min", "z-max"])];
        let size = Vector3::from(self.size);
        Ok(grid.mesh(cells, names, |along| self.origin + Vector3::from(along).component_mul(&size)))
    }
}

/// A tube round the z axis, from z = 0 to its length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tube {
    /// Radius of the hole [m].
    pub inner_radius: f64,
    /// Outer radius [m].
    pub outer_radius: f64,
    /// Length [m].
    pub length: f64,
}

impl Tube {
    /// Divides the tube into cells of about `edge` [m] (round it: half way through the wall, an even number,
    /// at least 6). All points lie in the tube. Points of its round faces lie on the circles, and the edges
    /// between them a little inside. Its faces are the point sets `inner`, `outer`, `z-min` and `z-max`.
    pub fn mesh(&self, edge: f64, cells: VolumeCell, cell_limit: usize) -> Result<Mesh, MeshingError> {
        let Self { inner_radius: inner, outer_radius: outer, length } = *self;
        require_positive("inner radius", inner)?;
        require_positive("outer radius", outer)?;
        require_positive("length", length)?;
        require_positive("edge", edge)?;
        if inner >= outer {
            return Err(MeshingError::NoWall { inner, outer });
        }
        let through = ((outer - inner) / edge).round().max(1.0);
        let around = 2.0 * (TAU * 0.5 * (inner + outer) / edge / 2.0).round().max(3.0);
        let along = (length / edge).round().max(1.0);
        let grid = Grid { counts: checked_counts([through, around, along], cells, cell_limit)?, wraps: true };
        let names = [Some(["inner", "outer"]), None, Some(["z-min", "z-max"])];
        Ok(grid.mesh(cells, names, |[through, around, along]| {
            let radius = inner + through * (outer - inner);
            let (sine, cosine) = (TAU * around).sin_cos();
            Vector3::new(radius * cosine, radius * sine, along * length)
        }))
    }
}

/// Numbers of cells along three axes as integers, once their product is known to fit.
fn checked_counts(
    counts: [f64; 3],
    cells: VolumeCell,
    cell_limit: usize,
) -> Result<[usize; 3], MeshingError> {
    let grid_cells: f64 = counts.iter().product();
    require_at_most(grid_cells * cells.per_grid_cell() as f64, allowed(cell_limit))?;
    Ok(counts.map(|n| n as usize))
}

/// Corners of a hexahedron as steps along the three axes, in the order of VTK.
const HEX_CORNERS: [[usize; 3]; 8] =
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];

/// Orders of the axes on Kuhn's six paths; the first three are even permutations.
const PATHS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];

/// A grid of cells with right-handed axes. Points and cells are numbered along the first axis, then the
/// second, then the third.
pub(crate) struct Grid {
    /// Cells along each axis.
    pub(crate) counts: [usize; 3],
    /// True if the second axis closes on itself.
    pub(crate) wraps: bool,
}

impl Grid {
    pub(crate) fn cell_count(&self) -> usize {
        self.counts.iter().product()
    }

    /// The steps along the axes of a cell by its number.
    pub(crate) fn cell(&self, number: usize) -> [usize; 3] {
        let [nx, ny, _] = self.counts;
        [number % nx, number / nx % ny, number / nx / ny]
    }

    /// Points along each axis.
    fn points_along(&self) -> [usize; 3] {
        let [nx, ny, nz] = self.counts;
        [nx + 1, ny + usize::from(!self.wraps), nz + 1]
    }

    /// The steps along the axes of a point by its number.
    pub(crate) fn point(&self, number: u32) -> [usize; 3] {
        let [nx, ny, _] = self.points_along();
        let number = number as usize;
        [number % nx, number / nx % ny, number / nx / ny]
    }

    fn point_number(&self, [i, j, k]: [usize; 3]) -> u32 {
        let [nx, ny, _] = self.points_along();
        (i + nx * (j % ny + ny * k)) as u32
    }

    /// The nodes of a cell as a hexahedron.
    pub(crate) fn hex(&self, cell: [usize; 3]) -> [u32; 8] {
        HEX_CORNERS.map(|step| self.point_number([0, 1, 2].map(|axis| cell[axis] + step[axis])))
    }

    /// Six tetrahedra along the paths from the corner with three even steps to the one with three odd steps.
    /// An odd number of mirrored axes and an odd path each turn the tetrahedron over.
    fn tets(&self, cell: [usize; 3]) -> impl Iterator<Item = u32> {
        let even = cell.map(|i| i + i % 2);
        let odd = cell.map(|i| i + 1 - i % 2);
        let mirrored = cell.iter().sum::<usize>() % 2 == 1;
        PATHS.into_iter().enumerate().flat_map(move |(path, axes)| {
            let mut at = even;
            let mut tet = [self.point_number(at); 4];
            for (axis, node) in axes.into_iter().zip(&mut tet[1..]) {
                at[axis] = odd[axis];
                *node = self.point_number(at);
            }
            if mirrored != (path >= 3) {
                tet.swap(1, 2);
            }
            tet
        })
    }

    /// Builds the mesh with its points where `position` puts fractions of the way along the axes. The first
    /// and last points along each axis become named sets.
    fn mesh(
        &self,
        cells: VolumeCell,
        names: [Option<[&str; 2]>; 3],
        position: impl Fn([f64; 3]) -> Vector3,
    ) -> Mesh {
        let counts = self.counts;
        let point_count = self.points_along().iter().product::<usize>() as u32;
        let steps = |point| self.point(point);
        let fraction = |i: usize, n: usize| i as f64 / n as f64;
        let places = (0..self.cell_count()).map(|number| self.cell(number));
        let block = match cells {
            VolumeCell::Tet => {
                CellBlock::new(CellKind::Tet, places.flat_map(|cell| self.tets(cell)).collect())
            }
            VolumeCell::Hex => {
                CellBlock::new(CellKind::Hex, places.flat_map(|cell| self.hex(cell)).collect())
            }
        };
        let mut mesh = Mesh {
            points: (0..point_count)
                .map(|point| position([0, 1, 2].map(|axis| fraction(steps(point)[axis], counts[axis]))))
                .collect(),
            blocks: vec![block],
            ..Mesh::default()
        };
        for (axis, [first, last]) in
            names.into_iter().enumerate().filter_map(|(axis, pair)| Some((axis, pair?)))
        {
            for (name, step) in [(first, 0), (last, counts[axis])] {
                let set = (0..point_count).filter(|&point| steps(point)[axis] == step).collect();
                mesh.point_sets.insert(name.into(), set);
            }
        }
        mesh
    }
}
