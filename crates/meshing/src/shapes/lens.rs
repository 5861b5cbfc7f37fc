//! An intra-ocular lens as a flat sheet of triangles: the union of a disc, the optic, and two loops, the
//! haptics, half a turn apart. A haptic is all points within half of its width of a line that leaves the
//! optic and runs round it. This line is r(φ) = r₀ + (R − r₀) S(φ/φ₁), with S(t) = t² (3 − 2 t) up to t = 1
//! and 1 above. A fine lattice is cut at the outline and meshed anew with even edges.

use std::collections::BTreeMap;

use pliant_geometry::{CellBlock, CellKind, Mesh, Vector3};

use crate::error::{MeshingError, require_at_most, require_positive};
use crate::input::extent::allowed;
use crate::surface::triangles::TriangleMesh;

/// Lattice edges per edge of the mesh, for the lattice that is cut at the outline.
const FINER: f64 = 6.0;
/// Nodes of the lattice nearer to the outline than this part of its edge are moved onto it.
const SNAP: f64 = 0.3;
/// Pieces of a line of a haptic.
const PIECES: usize = 400;

/// A lens with two haptics in the plane z = 0 about the origin, its haptics leaving the optic at +x and −x.
/// Lengths in metres, angles in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Diameter of the optic.
    pub optic: f64,
    /// Diameter of the circle around the whole lens.
    pub overall: f64,
    /// Width of a haptic.
    pub width: f64,
    /// The angle φ₁ over which a haptic leaves the optic.
    pub transition: f64,
    /// The angle over which it goes in all.
    pub sweep: f64,
}

impl Lens {
    /// Triangles with edges of about a length [m], facing +z. Point sets: `optic` and `haptics`.
    ///
    /// # Errors
    /// If a length or an angle is not positive, the haptics are not outside the optic, or there are too many
    /// triangles.
    pub fn mesh(&self, edge: f64, cell_limit: usize) -> Result<Mesh, MeshingError> {
        for (name, length) in [
            ("diameter of the optic", self.optic),
            ("width of the haptics", self.width),
            ("transition", self.transition),
            ("sweep", self.sweep),
        ] {
            require_positive(name, length)?;
        }
        require_positive("overall diameter beyond the optic", self.overall - self.optic)?;
        require_positive("the edge", edge)?;
        let spacing = edge.min(self.width) / FINER;
        let cells = (self.overall / spacing).powi(2) * 4.0 / 3.0_f64.sqrt();
        require_at_most(cells, allowed(cell_limit))?;
        let (mut mesh, _) = TriangleMesh::from_mesh(&self.cut(spacing))?;
        mesh.remesh(edge, cell_limit)?;
        let mut mesh = mesh.to_mesh();
        let is_optic = |x: &Vector3| x.norm() < 0.5 * self.optic * (1.0 + 1e-3);
        let (optic, haptics) =
            (0..mesh.points.len() as u32).partition(|&node| is_optic(&mesh.points[node as usize]));
        mesh.point_sets.insert("optic".into(), optic);
        mesh.point_sets.insert("haptics".into(), haptics);
        Ok(mesh)
    }

    /// The line of the first haptic.
    fn line(&self) -> Vec<Vector3> {
        let [from, to] = [self.optic, self.overall].map(|diameter| 0.5 * (diameter - self.width));
        let at = |k: usize| {
            let angle = self.sweep * k as f64 / PIECES as f64;
            let t = (angle / self.transition).min(1.0);
            let radius = from + (to - from) * t * t * (3.0 - 2.0 * t);
            Vector3::new(radius * angle.cos(), radius * angle.sin(), 0.0)
        };
        (0..=PIECES).map(at).collect()
    }

    /// Distance of a point from the lens [m]; negative inside.
    fn outside(&self, line: &[Vector3], point: &Vector3) -> f64 {
        let to_line = |point: Vector3| {
            let piece = |ends: &[Vector3]| {
                let along = ends[1] - ends[0];
                let part = (point - ends[0]).dot(&along) / along.norm_squared();
                (ends[0] + along * part.clamp(0.0, 1.0) - point).norm_squared()
            };
            line.windows(2).map(piece).fold(f64::INFINITY, f64::min).sqrt()
        };
        let to_haptics = to_line(*point).min(to_line(-point)) - 0.5 * self.width;
        to_haptics.min(point.norm() - 0.5 * self.optic)
    }

    /// Triangles of a lattice of this spacing [m], cut at the outline.
    fn cut(&self, spacing: f64) -> Mesh {
        let line = self.line();
        let Lattice { mut points, outside, triangles } = self.lattice(&line, spacing);
        let mut ends = BTreeMap::new();
        let mut kept = Vec::new();
        for corners in triangles {
            let inside: Vec<usize> = (0..3).filter(|&k| outside[corners[k] as usize] < 0.0).collect();
            let mut crossing = |from: u32, to: u32| {
                let [a, b] = [from, to].map(|node| outside[node as usize]);
                if b <= 0.0 {
                    return to;
                }
                *ends.entry([from.min(to), from.max(to)]).or_insert_with(|| {
                    points.push(points[from as usize].lerp(&points[to as usize], a / (a - b)));
                    points.len() as u32 - 1
                })
            };
            match *inside {
                // A triangle with its corners on the outline is in it if its middle is.
                [] if corners.iter().all(|&k| outside[k as usize] == 0.0) => {
                    let middle = corners.iter().map(|&k| points[k as usize]).sum::<Vector3>() / 3.0;
                    if self.outside(&line, &middle) < 0.0 {
                        kept.push(corners);
                    }
                }
                [] => {}
                [k] => {
                    let [from, b, c] = [0, 1, 2].map(|by| corners[(k + by) % 3]);
                    kept.push([from, crossing(from, b), crossing(from, c)]);
                }
                [_, _] => {
                    let out = (0..3).find(|k| !inside.contains(k)).unwrap_or(0);
                    let [gone, a, b] = [0, 1, 2].map(|by| corners[(out + by) % 3]);
                    let (first, second) = (crossing(b, gone), crossing(a, gone));
                    kept.push([a, b, first]);
                    if first != second {
                        kept.push([a, first, second]);
                    }
                }
                _ => kept.push(corners),
            }
        }
        Mesh {
            points,
            blocks: vec![CellBlock::new(CellKind::Triangle, kept.into_flattened())],
            ..Mesh::default()
        }
    }

    /// A lattice of a spacing [m] that covers the lens, its points moved onto the outline where that is near.
    fn lattice(&self, line: &[Vector3], spacing: f64) -> Lattice {
        let height = spacing * 0.75_f64.sqrt();
        let half = 0.5 * self.overall;
        let rows = (half / height).ceil() as i32 + 1;
        let columns = (half / spacing).ceil() as i32 + 2;
        let wide = (2 * columns + 1) as u32;
        let mut lattice = Lattice::default();
        for row in -rows..=rows {
            for column in -columns..=columns {
                let shift = if row % 2 == 0 { 0.0 } else { 0.5 };
                let x = Vector3::new((f64::from(column) + shift) * spacing, f64::from(row) * height, 0.0);
                let (x, out) = self.snapped(line, x, spacing);
                lattice.points.push(x);
                lattice.outside.push(out);
            }
        }
        for row in 0..2 * rows as u32 {
            for column in 0..wide - 1 {
                let [a, b] = [row * wide + column, row * wide + column + 1];
                let [c, d] = [a, b].map(|node| node + wide);
                // Rows are shifted to the right from every other one on.
                let shifted = (row as i32 - rows) % 2 != 0;
                lattice.triangles.extend(if shifted {
                    [[a, b, d], [a, d, c]]
                } else {
                    [[a, b, c], [b, d, c]]
                });
            }
        }
        lattice
    }

    /// Moves a point of a lattice of a spacing [m] onto the outline if it is near. Returns the point and its
    /// distance from the lens [m], negative inside.
    fn snapped(&self, line: &[Vector3], x: Vector3, spacing: f64) -> (Vector3, f64) {
        let out = self.outside(line, &x);
        if out.abs() < SNAP * spacing {
            let h = 1e-3 * spacing;
            let slope =
                |by: Vector3| (self.outside(line, &(x + by)) - self.outside(line, &(x - by))) / (2.0 * h);
            let direction = Vector3::new(slope(Vector3::x() * h), slope(Vector3::y() * h), 0.0);
            return (x - direction * out, 0.0);
        }
        (x, out)
    }
}

/// A lattice around a lens.
#[derive(Default)]
struct Lattice {
    points: Vec<Vector3>,
    /// Distance of each point from the lens [m]; negative inside.
    outside: Vec<f64>,
    triangles: Vec<[u32; 3]>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DEFAULT_CELL_LIMIT;

    /// Area [mm²] and second moments xx, yy, xy [mm⁴] of outlines by the rule of the reference. The tolerance
    /// is 0.3 % and 0.5 % with edges of 0.35 mm at most.
    const DESIGNS: [([f64; 5], [f64; 4]); 3] = [
        ([6.0, 12.5, 0.45, 55.0, 140.0], [40.9839063, 184.296847, 347.799553, 19.0851594]),
        ([5.5, 12.0, 0.45, 55.0, 140.0], [35.9970196, 150.626184, 295.246722, 16.5021854]),
        ([6.0, 12.5, 0.45, 70.0, 110.0], [37.484836, 125.971253, 271.068938, 52.6632982]),
    ];

    #[test]
    fn area_and_moments_are_those_of_the_outline() {
        // Edges of 0.35 mm cut the round ends of the haptics off, which moves the moments by up to 1 %.
        for (edge, ends_are_round) in [(0.35e-3, false), (0.2e-3, true)] {
            for ([optic, overall, width, transition, sweep], wanted) in DESIGNS {
                let [optic, overall, width] = [optic, overall, width].map(|x| 1e-3 * x);
                let [transition, sweep] = [transition, sweep].map(f64::to_radians);
                let lens = Lens { optic, overall, width, transition, sweep };
                let mesh = lens.mesh(edge, DEFAULT_CELL_LIMIT).unwrap();
                let (mut found, mut least) = ([0.0; 4], f64::INFINITY);
                for t in mesh.blocks[0].nodes.chunks_exact(3) {
                    let x = [0, 1, 2].map(|k| 1e3 * mesh.points[t[k] as usize]);
                    let area = 0.5 * (x[1] - x[0]).cross(&(x[2] - x[0])).z;
                    assert!(area > 0.0);
                    let longest = (0..3).map(|k| (x[(k + 1) % 3] - x[k]).norm()).fold(0.0, f64::max);
                    least = least.min(2.0 * area / longest);
                    let moment = |i: usize, j: usize| {
                        let middles = (0..3).map(|k| 0.5 * (x[k] + x[(k + 1) % 3]));
                        middles.map(|m| m[i] * m[j]).sum::<f64>() * area / 3.0
                    };
                    let parts = [area, moment(0, 0), moment(1, 1), moment(0, 1)];
                    found.iter_mut().zip(parts).for_each(|(sum, part)| *sum += part);
                }
                println!(
                    "{} nodes, {} triangles, least altitude {least:.3} mm: {found:?} of {wanted:?}",
                    mesh.points.len(),
                    mesh.blocks[0].len()
                );
                assert!((found[0] / wanted[0] - 1.0).abs() < 3e-3);
                let largest = wanted[1].max(wanted[2]);
                assert!(!ends_are_round || (1..4).all(|k| (found[k] - wanted[k]).abs() < 5e-3 * largest));
                // Of an even triangle it is 0.87 of the edge.
                assert!(least > 0.25 * 1e3 * edge, "{least}");
            }
        }
    }

    #[test]
    fn lengths_that_make_no_lens_are_refused() {
        let lens = Lens { optic: 6e-3, overall: 12.5e-3, width: 0.45e-3, transition: 1.0, sweep: 2.4 };
        for wrong in
            [Lens { optic: 0.0, ..lens }, Lens { overall: 5e-3, ..lens }, Lens { sweep: -1.0, ..lens }]
        {
            assert!(wrong.mesh(3e-4, DEFAULT_CELL_LIMIT).is_err());
        }
        assert!(lens.mesh(1e-8, DEFAULT_CELL_LIMIT).is_err());
    }
}
