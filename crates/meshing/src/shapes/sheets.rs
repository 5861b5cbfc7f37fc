//! Triangle meshes of thin bodies on a structured grid: plates, cylinders, hemispheres, annuli, twisted
//! strips; and spheres by subdivision of an icosahedron. Cells can be split in three patterns and inner
//! points moved at random. An element that is right on one regular mesh may be wrong on every other.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, TAU};

use pliant_geometry::{CellBlock, CellKind, DataArray, Mesh, Vector3};

use crate::error::{MeshingError, require_at_most, require_positive};
use crate::input::extent::allowed;

/// Division of the cells of a grid into triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pattern {
    /// Two triangles, all diagonals from the start of both axes to their ends.
    #[default]
    Diagonal,
    /// Two triangles, all diagonals the other way.
    Antidiagonal,
    /// Two triangles, diagonals mirrored from cell to cell.
    UnionJack,
    /// Four triangles round the middle.
    Crossed,
}

/// Inner points moved along the grid at random.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distortion {
    /// Largest shift along each axis as a part of a cell (of half a cell with [`Pattern::Crossed`]), below
    /// 0.5. No triangle turns over up to 0.25.
    pub amount: f64,
    /// Other seeds, other shifts; the same seed, the same shifts.
    pub seed: u64,
}

/// A thin body of triangles. Lengths in metres, angles in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sheet {
    /// A rectangle in the plane z = 0 from the origin on, facing +z. Its edges are the point sets `x-min`,
    /// `x-max`, `y-min`, `y-max`; grid axes are x and y.
    Plate {
        /// Lengths along x and y.
        size: [f64; 2],
    },
    /// A part of a cylinder around the z axis from z = 0, facing outwards. Edges: `z-min`, `z-max`, and on an
    /// open cylinder `start` and `end`; the grid axes run around and along.
    Cylinder {
        /// Radius.
        radius: f64,
        /// Length along z.
        length: f64,
        /// Angle from the x axis at which it starts.
        from: f64,
        /// Angle that it spans; 2π closes it.
        span: f64,
    },
    /// A part of a hemisphere z ≥ 0 round the z axis with a hole at the pole, facing outwards. Edges:
    /// `equator`, `hole`, and where it is open `start` and `end`; grid axes are round and towards the pole.
    Hemisphere {
        /// Radius.
        radius: f64,
        /// Angle between the axis and the edge of the hole.
        hole: f64,
        /// Angle from the x axis that it spans; 2π closes it.
        span: f64,
    },
    /// A part of a ring in the plane z = 0, facing +z. Edges: `inner`, `outer`, `start` and `end`; grid axes
    /// are outwards and round. A span of 2π has a slit: the edges `start` and `end` lie on each other, but
    /// are not joined.
    Annulus {
        /// Inner radius.
        inner: f64,
        /// Outer radius.
        outer: f64,
        /// Angle from the x axis that it spans, at most 2π.
        span: f64,
    },
    /// A strip along x whose width turns round the x axis, from the y axis at x = 0. Edges: `x-min`, `x-max`,
    /// `low`, `high`; grid axes are along and across.
    TwistedStrip {
        /// Length along x.
        length: f64,
        /// Width.
        width: f64,
        /// Angle between its ends.
        twist: f64,
    },
}

impl Sheet {
    /// Triangles on a grid with `counts` cells along its two axes. Point data `normal` are the unit normals
    /// of a sheet that is curved, if no triangle leans more than 60° from them.
    ///
    /// # Errors
    /// If a length is not positive, a count is zero, the distortion is half a cell or more, or there are too
    /// many triangles.
    pub fn mesh(
        &self,
        counts: [usize; 2],
        pattern: Pattern,
        distortion: Option<Distortion>,
        cell_limit: usize,
    ) -> Result<Mesh, MeshingError> {
        self.check()?;
        if let Some(axis) = counts.iter().position(|&n| n == 0) {
            return Err(MeshingError::NoCellsAlong { axis: ['x', 'y'][axis] });
        }
        if let Some(Distortion { amount, .. }) = distortion
            && !(0.0..0.5).contains(&amount)
        {
            return Err(MeshingError::Distortion { amount });
        }
        let triangles = if pattern == Pattern::Crossed { 4.0 } else { 2.0 };
        require_at_most(counts[0] as f64 * counts[1] as f64 * triangles, allowed(cell_limit))?;
        let grid = CellSheet { counts, wraps: self.closes() };
        let place = || grid.parameters(pattern, distortion);
        let mut mesh = Mesh {
            points: place().map(|[s, t]| self.point(s, t)).collect(),
            blocks: vec![CellBlock::new(CellKind::Triangle, grid.triangles(pattern))],
            ..Mesh::default()
        };
        if let Some(normals) = place().map(|[s, t]| self.normal(s, t)).collect() {
            add_normals(&mut mesh, normals);
        }
        for (name, points) in self.edge_names().into_iter().zip(grid.edges()) {
            if let Some(name) = name {
                mesh.point_sets.insert(name.into(), points);
            }
        }
        Ok(mesh)
    }

    fn check(&self) -> Result<(), MeshingError> {
        match *self {
            Self::Plate { size } => {
                require_positive("size along x", size[0])?;
                require_positive("size along y", size[1])
            }
            Self::Cylinder { radius, length, span, .. } => {
                require_positive("radius", radius)?;
                require_positive("length", length)?;
                require_positive("span", span)
            }
            Self::Hemisphere { radius, hole, span } => {
                require_positive("radius", radius)?;
                require_positive("angle of the hole", hole)?;
                require_positive("span", span)
            }
            Self::Annulus { inner, outer, span } => {
                require_positive("inner radius", inner)?;
                require_positive("outer radius", outer)?;
                require_positive("span", span)?;
                if inner < outer { Ok(()) } else { Err(MeshingError::NoWall { inner, outer }) }
            }
            Self::TwistedStrip { length, width, .. } => {
                require_positive("length", length)?;
                require_positive("width", width)
            }
        }
    }

    /// True if the first grid axis is closed.
    fn closes(&self) -> bool {
        match *self {
            Self::Cylinder { span, .. } | Self::Hemisphere { span, .. } => span > TAU * (1.0 - 1e-12),
            _ => false,
        }
    }

    /// The point at fractions of the way along the grid axes.
    fn point(&self, s: f64, t: f64) -> Vector3 {
        match *self {
            Self::Plate { size } => Vector3::new(s * size[0], t * size[1], 0.0),
            Self::Cylinder { radius, length, from, span } => {
                let (sine, cosine) = (from + s * span).sin_cos();
                Vector3::new(radius * cosine, radius * sine, t * length)
            }
            Self::Hemisphere { radius, hole, span } => {
                let (round_sine, round_cosine) = (s * span).sin_cos();
                let (sine, cosine) = (t * (FRAC_PI_2 - hole)).sin_cos();
                Vector3::new(radius * cosine * round_cosine, radius * cosine * round_sine, radius * sine)
            }
            Self::Annulus { inner, outer, span } => {
                let radius = inner + s * (outer - inner);
                let (sine, cosine) = (t * span).sin_cos();
                Vector3::new(radius * cosine, radius * sine, 0.0)
            }
            Self::TwistedStrip { length, width, twist } => {
                let (sine, cosine) = (s * twist).sin_cos();
                let across = (t - 0.5) * width;
                Vector3::new(s * length, across * cosine, across * sine)
            }
        }
    }

    /// The unit normal there, of a sheet that is curved.
    fn normal(&self, s: f64, t: f64) -> Option<Vector3> {
        match *self {
            Self::Plate { .. } | Self::Annulus { .. } => None,
            Self::Cylinder { .. } => Some(self.point(s, t).xy().normalize().push(0.0)),
            Self::Hemisphere { .. } => Some(self.point(s, t).normalize()),
            Self::TwistedStrip { length, width, twist } => {
                let (sine, cosine) = (s * twist).sin_cos();
                let turning = (t - 0.5) * width * twist;
                let along = Vector3::new(length, -turning * sine, turning * cosine);
                Some(along.cross(&Vector3::new(0.0, cosine, sine)).normalize())
            }
        }
    }

    /// Names of the edges at the start and the end of the two grid axes.
    fn edge_names(&self) -> [Option<&'static str>; 4] {
        let closes = self.closes();
        let ends = |name| (!closes).then_some(name);
        match self {
            Self::Plate { .. } => [Some("x-min"), Some("x-max"), Some("y-min"), Some("y-max")],
            Self::Cylinder { .. } => [ends("start"), ends("end"), Some("z-min"), Some("z-max")],
            Self::Hemisphere { .. } => [ends("start"), ends("end"), Some("equator"), Some("hole")],
            Self::Annulus { .. } => [Some("inner"), Some("outer"), Some("start"), Some("end")],
            Self::TwistedStrip { .. } => [Some("x-min"), Some("x-max"), Some("low"), Some("high")],
        }
    }
}

/// Gives a mesh the normals of its smooth surface, unless a triangle leans more than 60° from one of its
/// normals, as folded triangles do.
fn add_normals(mesh: &mut Mesh, normals: Vec<Vector3>) {
    let stands = |corners: &[u32]| {
        let [a, b, c] = [0, 1, 2].map(|i| mesh.points[corners[i] as usize]);
        let across = (b - a).cross(&(c - a)).normalize();
        corners.iter().all(|&node| normals[node as usize].dot(&across) > 0.5)
    };
    if mesh.blocks[0].cells().all(stands) {
        let values = normals.into_iter().flat_map(<[f64; 3]>::from).collect();
        mesh.point_data.insert("normal".into(), DataArray { components: 3, values });
    }
}

/// Cells along two axes; points are numbered along the first, then the second; middles of crossed cells
/// follow.
struct CellSheet {
    counts: [usize; 2],
    wraps: bool,
}

impl CellSheet {
    fn points_along(&self) -> [usize; 2] {
        [self.counts[0] + usize::from(!self.wraps), self.counts[1] + 1]
    }

    fn point(&self, i: usize, j: usize) -> u32 {
        let [along, _] = self.points_along();
        (i % along + along * j) as u32
    }

    /// Fractions of the way along the axes, of every point.
    fn parameters(&self, pattern: Pattern, distortion: Option<Distortion>) -> impl Iterator<Item = [f64; 2]> {
        let [nx, ny] = self.counts;
        let [px, py] = self.points_along();
        let wraps = self.wraps;
        let corners = (0..px * py).map(move |number| {
            let inner = |at: usize, count: usize| at > 0 && at < count;
            let (i, j) = (number % px, number / px);
            ([i as f64, j as f64], (wraps || inner(i, nx)) && inner(j, ny))
        });
        let cells = if pattern == Pattern::Crossed { nx * ny } else { 0 };
        let middles =
            (0..cells).map(move |cell| ([(cell % nx) as f64 + 0.5, (cell / nx) as f64 + 0.5], true));
        // Crossed triangles are half as high.
        let size = if pattern == Pattern::Crossed { 0.5 } else { 1.0 };
        let mut shifts = Shifts::new(distortion.map(|d| Distortion { amount: size * d.amount, ..d }));
        corners.chain(middles).map(move |([x, y], inner)| {
            let [dx, dy] = if inner { [shifts.next(), shifts.next()] } else { [0.0; 2] };
            [(x + dx) / nx as f64, (y + dy) / ny as f64]
        })
    }

    fn triangles(&self, pattern: Pattern) -> Vec<u32> {
        let [nx, ny] = self.counts;
        let [px, py] = self.points_along();
        let mut nodes = Vec::new();
        for cell in 0..nx * ny {
            let (i, j) = (cell % nx, cell / nx);
            let [a, b, c, d] =
                [self.point(i, j), self.point(i + 1, j), self.point(i + 1, j + 1), self.point(i, j + 1)];
            match pattern {
                Pattern::UnionJack if (i + j) % 2 == 0 => nodes.extend([a, b, c, a, c, d]),
                Pattern::Diagonal => nodes.extend([a, b, c, a, c, d]),
                Pattern::Antidiagonal | Pattern::UnionJack => nodes.extend([a, b, d, b, c, d]),
                Pattern::Crossed => {
                    let middle = (px * py + cell) as u32;
                    nodes.extend([a, b, middle, b, c, middle, c, d, middle, d, a, middle]);
                }
            }
        }
        nodes
    }

    /// The points at the start and the end of the first and of the second axis, in order.
    fn edges(&self) -> [Vec<u32>; 4] {
        let [nx, ny] = self.counts;
        let [px, py] = self.points_along();
        [
            (0..py).map(|j| self.point(0, j)).collect(),
            (0..py).map(|j| self.point(nx, j)).collect(),
            (0..px).map(|i| self.point(i, 0)).collect(),
            (0..px).map(|i| self.point(i, ny)).collect(),
        ]
    }
}

/// Numbers in [−amount, amount) without pattern (Knuth's MMIX).
struct Shifts {
    amount: f64,
    state: u64,
}

impl Shifts {
    fn new(distortion: Option<Distortion>) -> Self {
        let Distortion { amount, seed } = distortion.unwrap_or(Distortion { amount: 0.0, seed: 0 });
        Self { amount, state: seed }
    }

    fn next(&mut self) -> f64 {
        self.state = self.state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        self.amount * ((self.state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0)
    }
}

/// A sphere about the origin, facing outwards: an icosahedron whose triangles are cut into four `levels`
/// times; point data `normal` are its normals.
///
/// # Errors
/// If the radius is not positive or there are too many triangles.
pub fn sphere(radius: f64, levels: u32, cell_limit: usize) -> Result<Mesh, MeshingError> {
    require_positive("radius", radius)?;
    require_at_most(20.0 * 4_f64.powi(levels.min(1000) as i32), allowed(cell_limit))?;
    let golden = 0.5 * (1.0 + 5_f64.sqrt());
    let mut points: Vec<Vector3> = (0..12)
        .map(|i: usize| {
            let (one, phi) = (if i & 1 == 0 { 1.0 } else { -1.0 }, if i & 2 == 0 { golden } else { -golden });
            let mut p = Vector3::zeros();
            (p[i / 4], p[(i / 4 + 1) % 3]) = (one, phi);
            p.normalize()
        })
        .collect();
    let mut triangles = convex_faces(&points);
    for _ in 0..levels {
        let mut middles: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[p, q]| {
                *middles.entry([p.min(q), p.max(q)]).or_insert_with(|| {
                    points.push((points[p as usize] + points[q as usize]).normalize());
                    points.len() as u32 - 1
                })
            });
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    let mut mesh = Mesh {
        points: points.iter().map(|p| radius * p).collect(),
        blocks: vec![CellBlock::new(CellKind::Triangle, triangles.into_flattened())],
        ..Mesh::default()
    };
    add_normals(&mut mesh, points);
    Ok(mesh)
}

/// The faces of an icosahedron: three corners that are all an edge apart, seen counter-clockwise from
/// outside.
fn convex_faces(points: &[Vector3]) -> Vec<[u32; 3]> {
    // Corners of an edge are 63.4° apart, others at least 116.6°.
    let near = |a: usize, b: usize| points[a].dot(&points[b]) > 0.0;
    let mut faces = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let outward = points[a].dot(&points[b].cross(&points[c])) > 0.0;
                    let [b, c] = if outward { [b, c] } else { [c, b] };
                    faces.push([a, b, c].map(|i| i as u32));
                }
            }
        }
    }
    faces
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DEFAULT_CELL_LIMIT;

    fn area(mesh: &Mesh) -> f64 {
        let nodes = &mesh.blocks[0].nodes;
        let triangle = |t: &[u32]| {
            let [a, b, c] = [0, 1, 2].map(|i| mesh.points[t[i] as usize]);
            0.5 * (b - a).cross(&(c - a)).norm()
        };
        nodes.chunks_exact(3).map(triangle).sum()
    }

    fn sheets() -> [(Sheet, f64); 5] {
        [
            (Sheet::Plate { size: [2.0, 3.0] }, 6.0),
            (Sheet::Cylinder { radius: 1.0, length: 2.0, from: 0.0, span: TAU }, 2.0 * TAU),
            (Sheet::Hemisphere { radius: 1.0, hole: 0.3, span: TAU }, TAU * 0.3_f64.cos()),
            (Sheet::Annulus { inner: 1.0, outer: 2.0, span: TAU }, 1.5 * TAU),
            (Sheet::TwistedStrip { length: 3.0, width: 0.5, twist: 0.0 }, 1.5),
        ]
    }

    /// Areas to 1 %: chords cut off 0.1 %, and middles of crossed cells bulge.
    #[test]
    fn sheets_have_their_area_and_edges() {
        for (sheet, exact) in sheets() {
            for pattern in [Pattern::Diagonal, Pattern::Antidiagonal, Pattern::UnionJack, Pattern::Crossed] {
                for distortion in [None, Some(Distortion { amount: 0.25, seed: 5 })] {
                    let mesh = sheet.mesh([40, 40], pattern, distortion, DEFAULT_CELL_LIMIT).unwrap();
                    assert!((area(&mesh) / exact - 1.0).abs() < 1e-2, "{sheet:?} {pattern:?}");
                    assert!(mesh.point_sets.values().all(|set| set.len() >= 40));
                }
            }
        }
    }

    #[test]
    fn hemispheres_and_cylinders_face_outwards() {
        for (sheet, _) in sheets() {
            let mesh = sheet.mesh([8, 4], Pattern::Diagonal, None, DEFAULT_CELL_LIMIT).unwrap();
            let [a, b, c] = [0, 1, 2].map(|i| mesh.points[mesh.blocks[0].nodes[i] as usize]);
            let normal = (b - a).cross(&(c - a));
            let expected = match sheet {
                Sheet::Cylinder { .. } | Sheet::Hemisphere { .. } => a + b + c,
                _ => Vector3::z(),
            };
            assert!(normal.dot(&expected) > 0.0, "{sheet:?}");
        }
    }

    /// Normals are within 4° of the triangles on a fine mesh, and on the same side. Flat sheets have no
    /// normals.
    #[test]
    fn normals_are_those_of_the_sheet() {
        for (sheet, _) in sheets() {
            let mesh = sheet.mesh([90, 90], Pattern::Diagonal, None, 100_000).unwrap();
            let Some(normals) = mesh.point_data.get("normal") else {
                assert!(matches!(sheet, Sheet::Plate { .. } | Sheet::Annulus { .. }), "{sheet:?}");
                continue;
            };
            for corners in mesh.blocks[0].cells() {
                let [a, b, c] = [0, 1, 2].map(|i| mesh.points[corners[i] as usize]);
                let across = (b - a).cross(&(c - a)).normalize();
                for &node in corners {
                    let off = Vector3::from_row_slice(normals.item(node as usize)).angle(&across);
                    assert!(off < 0.07, "{sheet:?}: {off}");
                }
            }
        }
        let twisted = Sheet::TwistedStrip { length: 3.0, width: 0.5, twist: 1.0 };
        let (s, t, h) = (0.4, 0.9, 1e-6);
        let slope = |ds: f64, dt: f64| twisted.point(s + ds, t + dt) - twisted.point(s - ds, t - dt);
        let across = slope(h, 0.0).cross(&slope(0.0, h)).normalize();
        assert!((twisted.normal(s, t).unwrap() - across).norm() < 1e-8);
    }

    #[test]
    fn a_sphere_is_closed_and_faces_outwards() {
        let mesh = sphere(2.0, 4, DEFAULT_CELL_LIMIT).unwrap();
        assert_eq!(mesh.blocks[0].len(), 5120);
        assert_eq!(mesh.points.len(), 2562);
        assert!((area(&mesh) / (8.0 * TAU) - 1.0).abs() < 0.01);
        let volume: f64 = (mesh.blocks[0].nodes.chunks_exact(3))
            .map(|t| {
                let [a, b, c] = [0, 1, 2].map(|i| mesh.points[t[i] as usize]);
                a.dot(&b.cross(&c)) / 6.0
            })
            .sum();
        assert!((volume / (TAU * 16.0 / 3.0) - 1.0).abs() < 0.01, "{volume}");
    }

    #[test]
    fn bad_requests_are_told() {
        let mesh = |sheet: Sheet, counts| sheet.mesh(counts, Pattern::Diagonal, None, 1000);
        assert!(mesh(Sheet::Plate { size: [0.0, 1.0] }, [2, 2]).is_err());
        assert!(mesh(Sheet::Annulus { inner: 2.0, outer: 1.0, span: 1.0 }, [2, 2]).is_err());
        assert!(mesh(Sheet::Plate { size: [1.0, 1.0] }, [0, 2]).is_err());
        assert!(mesh(Sheet::Plate { size: [1.0, 1.0] }, [100, 100]).is_err());
        assert!(sphere(1.0, 30, 1000).is_err());
        let torn = Some(Distortion { amount: 0.6, seed: 1 });
        assert!(Sheet::Plate { size: [1.0, 1.0] }.mesh([2, 2], Pattern::Diagonal, torn, 1000).is_err());
    }
}
