//! Size and shape of cells. The acoustic length is the characteristic length of the explicit time step. A
//! step of l / c is stable, with the speed c of pressure waves. It is l = V / ‖∫∇N‖ = (Σ_a |B_a|²)^(−1/2),
//! with B_a the mean gradient of shape function a. For a tet B_a = ∇N_a and |B_a| = 1/h_a with the heights
//! h_a. So l = 6 V / (Σ (2 A_a)²)^(1/2). For a hex 2×2×2 Gauss points give the exact mean. Leaves out:
//! materials, and with them the time step itself.

use std::fmt;

use crate::cell::{CellId, HEX_CORNERS, corners, edges, hex_gauss_points, hex_local_gradients, hex_tangents};
use crate::{CellKind, Mesh, Vector3};

/// Volume of a tet or a hex [m³], negative if inverted; area of a triangle or a quad [m²]; length of a line
/// [m]; 0 for a vertex. `points` are the positions of the cell's `kind.node_count()` nodes.
///
/// The hex is the image of the trilinear map, exactly. A quad that is not planar has the area of its vector
/// area, half the cross product of its diagonals.
pub fn volume(kind: CellKind, points: &[Vector3]) -> f64 {
    match kind {
        CellKind::Vertex => 0.0,
        CellKind::Line => (points[1] - points[0]).norm(),
        CellKind::Triangle | CellKind::Quad => vector_area(points).norm(),
        CellKind::Tet | CellKind::Hex => gradient_integrals(kind, points).0,
    }
}

/// Area times unit normal [m²] of a triangle or a quad, out of the side seen counter-clockwise.
/// A quad need not be planar: this is the integral of its normal.
pub fn vector_area(points: &[Vector3]) -> Vector3 {
    let last = points.len() - 1;
    match last {
        2 => (points[1] - points[0]).cross(&(points[2] - points[0])) / 2.0,
        _ => (points[2] - points[0]).cross(&(points[last] - points[1])) / 2.0,
    }
}

/// Volume V [m³] of a tet or a hex and the integrals ∫ ∇N_a dV [m²] of its shape gradients, the first
/// `kind.node_count()` of eight. Divided by V they are the mean gradients B_a [1/m]. Exact; zero for other
/// kinds.
pub fn gradient_integrals(kind: CellKind, points: &[Vector3]) -> (f64, [Vector3; 8]) {
    let mut integrals = [Vector3::zeros(); 8];
    let mut volume = 0.0;
    match kind {
        CellKind::Tet => {
            let [u, v, w] = [1, 2, 3].map(|a| points[a] - points[0]);
            integrals[1] = v.cross(&w) / 6.0;
            integrals[2] = w.cross(&u) / 6.0;
            integrals[3] = u.cross(&v) / 6.0;
            integrals[0] = -(integrals[1] + integrals[2] + integrals[3]);
            volume = u.dot(&integrals[1]);
        }
        CellKind::Hex => {
            // dV = det J dξ and ∇N_a det J = cof J ∂N_a/∂ξ are polynomials that the Gauss points integrate
            // exactly.
            for xi in hex_gauss_points() {
                let local = hex_local_gradients(&xi);
                let [u, v, w] = hex_tangents(points, &local);
                let cofactor = [v.cross(&w), w.cross(&u), u.cross(&v)];
                volume += u.dot(&cofactor[0]);
                for (integral, g) in integrals.iter_mut().zip(&local) {
                    *integral += cofactor[0] * g.x + cofactor[1] * g.y + cofactor[2] * g.z;
                }
            }
        }
        _ => {}
    }
    (volume, integrals)
}

/// Acoustic length l = (Σ_a |B_a|²)^(−1/2) [m] of a tet or a hex, with the mean shape gradients B_a. For a
/// tet with heights h_a it is (Σ 1/h_a²)^(−1/2). A time step of l / c is stable, c being the speed of
/// pressure waves. Negative if inverted, 0 if flat, and 0 for other kinds.
pub fn acoustic_length(kind: CellKind, points: &[Vector3]) -> f64 {
    let (volume, integrals) = gradient_integrals(kind, points);
    let norm = integrals.iter().map(|b| b.norm_squared()).sum::<f64>().sqrt();
    if norm > 0.0 { volume / norm } else { 0.0 }
}

/// Acoustic length relative to the ideal cell of the same volume, a regular tet or a cube: 1 ideal, 0 flat,
/// negative inverted. Dimensionless. No tet exceeds 1. A hex may exceed it slightly: 1.007 where the corners
/// of a cube move by up to 0.4 of its side. Mean gradients don't detect every distortion, so check
/// [`scaled_jacobian`] too.
pub fn relative_acoustic_length(kind: CellKind, points: &[Vector3]) -> f64 {
    let volume = volume(kind, points);
    // Regular tet of edge a: V = a³ / (6 √2), l = a / √6. Cube: l = a √(2/3).
    let ideal = match kind {
        CellKind::Tet => (6.0 * 2f64.sqrt() * volume.abs()).cbrt() / 6f64.sqrt(),
        CellKind::Hex => volume.abs().cbrt() * (2f64 / 3.0).sqrt(),
        _ => 0.0,
    };
    if ideal > 0.0 { acoustic_length(kind, points) / ideal } else { 0.0 }
}

/// The six dihedral angles of a tet [°], at the edges 01, 02, 03, 12, 13, 23; 0 to 180, also if inverted.
pub(crate) fn dihedral_angles(points: &[Vector3; 4]) -> [f64; 6] {
    let opposite = [[2, 3], [1, 3], [1, 2], [0, 3], [0, 2], [0, 1]];
    std::array::from_fn(|at| {
        let [i, j] = edges(CellKind::Tet)[at];
        let [m, n] = opposite[at];
        let edge = points[j] - points[i];
        let a = edge.cross(&(points[m] - points[i]));
        let b = edge.cross(&(points[n] - points[i]));
        a.cross(&b).norm().atan2(a.dot(&b)).to_degrees()
    })
}

/// Smallest scaled Jacobian over the corners of a hex: the determinant of the unit vectors along the three
/// edges at a corner. 1 for a box, 0 if flat at a corner, negative if turned inside out there.
pub fn scaled_jacobian(points: &[Vector3; 8]) -> f64 {
    HEX_CORNERS
        .map(|corner| {
            let [u, v, w] = hex_tangents(points, &hex_local_gradients(&Vector3::from(corner)));
            let lengths = u.norm() * v.norm() * w.norm();
            if lengths > 0.0 { u.dot(&v.cross(&w)) / lengths } else { 0.0 }
        })
        .into_iter()
        .fold(f64::INFINITY, f64::min)
}

/// Smallest, middle and largest of a set of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Smallest.
    pub min: f64,
    /// Middle: half are smaller, half larger.
    pub median: f64,
    /// Largest.
    pub max: f64,
}

impl Spread {
    /// Spread of `values`, which it sorts; `None` without any.
    fn of(values: &mut [f64]) -> Option<Self> {
        values.sort_unstable_by(f64::total_cmp);
        let (&min, &max) = (values.first()?, values.last()?);
        let (lower, upper) = (values[(values.len() - 1) / 2], values[values.len() / 2]);
        Some(Self { min, median: lower + (upper - lower) / 2.0, max })
    }
}

/// Size and shape of all cells of a mesh, for a person to read (`Display`) or a test to check.
#[derive(Clone, Debug, PartialEq)]
pub struct QualityReport {
    /// Number of points.
    pub nodes: usize,
    /// Number of cells by kind, in the order of `CellKind`, without absent kinds.
    pub cells: Vec<(CellKind, usize)>,
    /// Cells left out of everything below: a node does not exist or is not finite.
    pub unmeasured: usize,
    /// Total volume of tets and hexes [m³]; inverted ones count negative.
    pub volume: f64,
    /// Acoustic length of tets and hexes [m].
    pub acoustic_length: Option<Spread>,
    /// The cell of the smallest acoustic length, which sets the time step (the first among equals).
    pub shortest: Option<CellId>,
    /// Smallest and largest dihedral angle of tets [°].
    pub dihedral: Option<[f64; 2]>,
    /// Smallest scaled Jacobian of hexes, 1 for a box.
    pub scaled_jacobian: Option<f64>,
    /// Length of the edges of all cells [m], each edge once.
    pub edge_length: Option<Spread>,
    /// Number of tets and hexes by acoustic length relative to the ideal cell of the same volume. Bin i
    /// counts cells from i/10 to (i+1)/10. Inverted and flat cells are in the first bin, the few hexes above
    /// 1 in the last.
    pub histogram: [usize; 10],
}

impl QualityReport {
    /// Measures every cell of `mesh`.
    pub fn new(mesh: &Mesh) -> Self {
        let mut report = Self::empty(mesh);
        let mut lengths = Vec::new();
        let mut edge_nodes = Vec::new();
        let mut shortest = f64::INFINITY;
        for block in &mesh.blocks {
            for (index, nodes) in block.cells().enumerate() {
                let mut buffer = [Vector3::zeros(); 8];
                let Some(points) = corners(&mesh.points, nodes, &mut buffer) else {
                    report.unmeasured += 1;
                    continue;
                };
                edge_nodes.extend(edges(block.kind).iter().map(|&[a, b]| {
                    let (a, b) = (nodes[a], nodes[b]);
                    [a.min(b), a.max(b)]
                }));
                if block.kind.dimension() == 3 {
                    let length = report.add_volume_cell(block.kind, points);
                    if length < shortest {
                        shortest = length;
                        report.shortest = Some(CellId { kind: block.kind, index: index as u32 });
                    }
                    lengths.push(length);
                }
            }
        }
        edge_nodes.sort_unstable();
        edge_nodes.dedup();
        let mut edge_lengths: Vec<f64> = edge_nodes
            .iter()
            .map(|&[a, b]| (mesh.points[b as usize] - mesh.points[a as usize]).norm())
            .collect();
        report.acoustic_length = Spread::of(&mut lengths);
        report.edge_length = Spread::of(&mut edge_lengths);
        report
    }

    /// Counts only.
    fn empty(mesh: &Mesh) -> Self {
        let mut cells: Vec<_> =
            mesh.blocks.iter().filter(|b| !b.is_empty()).map(|b| (b.kind, b.len())).collect();
        cells.sort_unstable();
        Self {
            nodes: mesh.points.len(),
            cells,
            unmeasured: 0,
            volume: 0.0,
            acoustic_length: None,
            shortest: None,
            dihedral: None,
            scaled_jacobian: None,
            edge_length: None,
            histogram: [0; 10],
        }
    }

    /// Adds one tet or hex to the sums and extremes; returns its acoustic length [m].
    fn add_volume_cell(&mut self, kind: CellKind, points: &[Vector3]) -> f64 {
        self.volume += volume(kind, points);
        // A float cast saturates: negative values fall into the first bin.
        let bin = (relative_acoustic_length(kind, points) * 10.0) as usize;
        self.histogram[bin.min(9)] += 1;
        if let Ok(points) = <&[Vector3; 4]>::try_from(points) {
            let [mut low, mut high] = self.dihedral.unwrap_or([f64::INFINITY, f64::NEG_INFINITY]);
            for angle in dihedral_angles(points) {
                (low, high) = (low.min(angle), high.max(angle));
            }
            self.dihedral = Some([low, high]);
        }
        if let Ok(points) = <&[Vector3; 8]>::try_from(points) {
            let jacobian = scaled_jacobian(points);
            self.scaled_jacobian = Some(self.scaled_jacobian.map_or(jacobian, |least| least.min(jacobian)));
        }
        acoustic_length(kind, points)
    }

    /// The histogram as ten lines of text: range, bar and count. The longest bar has 40 characters, and every
    /// count above 0 has a bar.
    pub fn histogram_lines(&self) -> Vec<String> {
        let most = self.histogram.iter().copied().max().unwrap_or(0).max(1);
        let digits = most.to_string().len();
        let line = |(bin, &count): (usize, &usize)| {
            let bar = "█".repeat((count * 40).div_ceil(most));
            let (from, to) = (bin as f64 / 10.0, (bin + 1) as f64 / 10.0);
            format!("{from:.1}–{to:.1} {count:>digits$} {bar}").trim_end().to_owned()
        };
        self.histogram.iter().enumerate().map(line).collect()
    }
}

impl fmt::Display for QualityReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "nodes            {}", self.nodes)?;
        for (kind, count) in &self.cells {
            write!(f, "\n{:<16} {count}", format!("{} cells", kind.name()))?;
        }
        if self.unmeasured > 0 {
            write!(f, "\nnot measured     {} (missing or non-finite nodes)", self.unmeasured)?;
        }
        if let Some(edge) = self.edge_length {
            let Spread { min, median, max } = edge;
            write!(f, "\nedge length      {min:.4e} to {max:.4e} m, median {median:.4e} m")?;
        }
        if let Some([low, high]) = self.dihedral {
            write!(f, "\ndihedral angle   {low:.2}° to {high:.2}°")?;
        }
        if let Some(least) = self.scaled_jacobian {
            write!(f, "\nscaled Jacobian  {least:.4} at least")?;
        }
        if let (Some(length), Some(cell)) = (self.acoustic_length, self.shortest) {
            write!(f, "\nvolume           {:.6e} m³", self.volume)?;
            let Spread { min, median, .. } = length;
            write!(f, "\nacoustic length  {min:.4e} m at least ({cell}), median {median:.4e} m")?;
            write!(f, "\nacoustic length relative to the ideal cell of the same volume:")?;
            for line in self.histogram_lines() {
                write!(f, "\n  {line}")?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pliant_testing::Random;

    use crate::testing::{UNIT_CUBE, block_of_hexes, block_of_tets, noise, points};

    /// Regular tet of edge 2 √2.
    const REGULAR: [[f64; 3]; 4] = [[1., 1., 1.], [-1., 1., -1.], [1., -1., -1.], [-1., -1., 1.]];

    fn regular() -> [Vector3; 4] {
        let [a, b, c, d] = REGULAR.map(Vector3::from);
        [a, b, c, d]
    }

    #[test]
    fn regular_tet_is_ideal_and_right_handed() {
        let tet = regular();
        assert!((volume(CellKind::Tet, &tet) - 8.0 / 3.0).abs() < 1e-14);
        assert!((relative_acoustic_length(CellKind::Tet, &tet) - 1.0).abs() < 1e-14);
        let angle = (1f64 / 3.0).acos().to_degrees();
        assert!(dihedral_angles(&tet).iter().all(|a| (a - angle).abs() < 1e-12));
        let mirrored = [tet[0], tet[2], tet[1], tet[3]];
        assert!((volume(CellKind::Tet, &mirrored) + 8.0 / 3.0).abs() < 1e-14);
        assert!((relative_acoustic_length(CellKind::Tet, &mirrored) + 1.0).abs() < 1e-14);
    }

    #[test]
    fn acoustic_length_of_a_tet_is_made_of_its_heights() {
        let mut random = Random::new(1);
        for _ in 0..100 {
            let x: [Vector3; 4] = std::array::from_fn(|_| noise(&mut random));
            let sum: f64 = (0..4)
                .map(|a| {
                    let [i, j, k] = [(a + 1) % 4, (a + 2) % 4, (a + 3) % 4];
                    let normal = (x[j] - x[i]).cross(&(x[k] - x[i])).normalize();
                    (x[a] - x[i]).dot(&normal).powi(-2)
                })
                .sum();
            let length = acoustic_length(CellKind::Tet, &x);
            assert!((length.abs() / sum.powf(-0.5) - 1.0).abs() < 1e-9, "{length}");
        }
    }

    /// Meshing specification 1.1: the ideal BCC tet of lattice constant a has l = a / (2 √2).
    #[test]
    fn bcc_tet_has_the_length_of_the_specification() {
        let tet = points(&[[0., 0., 0.], [1., 0., 0.], [0.5, 0.5, 0.5], [0.5, -0.5, 0.5]]);
        assert!((acoustic_length(CellKind::Tet, &tet).abs() - 8f64.sqrt().recip()).abs() < 1e-15);
    }

    #[test]
    fn cube_is_ideal() {
        let cube = points(&UNIT_CUBE);
        assert!((volume(CellKind::Hex, &cube) - 1.0).abs() < 1e-15);
        assert!((acoustic_length(CellKind::Hex, &cube) - (2f64 / 3.0).sqrt()).abs() < 1e-15);
        assert!((relative_acoustic_length(CellKind::Hex, &cube) - 1.0).abs() < 1e-15);
        assert!((scaled_jacobian(cube.as_slice().try_into().unwrap()) - 1.0).abs() < 1e-15);
    }

    /// The frustum of a pyramid, sides 2 and 1, height 3: V = 3/3 (4 + 1 + 2) = 7; its hex map is exact for
    /// it.
    #[test]
    fn frustum_has_its_textbook_volume() {
        let hex = points(&[
            [-1., -1., 0.],
            [1., -1., 0.],
            [1., 1., 0.],
            [-1., 1., 0.],
            [-0.5, -0.5, 3.],
            [0.5, -0.5, 3.],
            [0.5, 0.5, 3.],
            [-0.5, 0.5, 3.],
        ]);
        assert!((volume(CellKind::Hex, &hex) - 7.0).abs() < 1e-13);
    }

    /// Σ_a X_a ⊗ ∫∇N_a = V I and Σ_a ∫∇N_a = 0: mean gradients see a linear field exactly.
    #[test]
    fn gradient_integrals_reproduce_linear_fields() {
        let mut random = Random::new(2);
        for kind in [CellKind::Tet, CellKind::Hex] {
            let x: Vec<Vector3> = points(&UNIT_CUBE)[..kind.node_count()]
                .iter()
                .map(|p| p + noise(&mut random) * 0.2)
                .collect();
            let (volume, integrals) = gradient_integrals(kind, &x);
            let sum =
                x.iter().zip(&integrals).map(|(x, b)| x * b.transpose()).sum::<nalgebra::Matrix3<f64>>();
            assert!((sum - nalgebra::Matrix3::identity() * volume).norm() < 1e-14);
            assert!(integrals.iter().sum::<Vector3>().norm() < 1e-14);
        }
    }

    #[test]
    fn no_tet_is_better_than_the_regular_one() {
        let mut random = Random::new(3);
        for _ in 0..2000 {
            let tet: Vec<Vector3> = regular().iter().map(|p| p + noise(&mut random)).collect();
            assert!(relative_acoustic_length(CellKind::Tet, &tet) <= 1.0 + 1e-12);
        }
    }

    #[test]
    fn report_of_a_block_of_cubes() {
        let report = QualityReport::new(&block_of_hexes([3, 2, 1]));
        assert_eq!(report.cells, [(CellKind::Hex, 6)]);
        assert!((report.volume - 6.0).abs() < 1e-13);
        assert_eq!(report.histogram[9], 6);
        let edge = report.edge_length.unwrap();
        assert_eq!([edge.min, edge.median, edge.max], [1.0; 3]);
        assert_eq!(report.dihedral, None);
        assert!(report.to_string().contains("volume           6.000000e0 m³"), "{report}");
    }

    #[test]
    fn report_of_tets_names_the_worst_one_and_survives_broken_cells() {
        let mut mesh = block_of_tets([2, 2, 2]);
        let tets = mesh.block(CellKind::Tet).unwrap().len();
        mesh.points.extend(points(&[[0., 0., 9.], [1., 0., 9.], [0., 1., 9.], [0.3, 0.3, 9.01]]));
        mesh.points.push(Vector3::repeat(f64::NAN));
        mesh.block_mut(CellKind::Tet).nodes.extend([27, 28, 29, 30, 0, 1, 2, 31, 0, 1, 2, 99]);
        let report = QualityReport::new(&mesh);
        assert_eq!(report.unmeasured, 2);
        assert_eq!(report.shortest, Some(CellId { kind: CellKind::Tet, index: tets as u32 }));
        assert_eq!(report.histogram.iter().sum::<usize>(), tets + 1);
        assert!(report.dihedral.unwrap()[0] < 3.0);
        let lines = report.histogram_lines();
        assert_eq!(lines.len(), 10);
        assert!(lines.iter().any(|line| line.chars().filter(|&c| c == '█').count() == 40), "{lines:#?}");
    }

    #[test]
    fn quad_and_triangle_have_areas() {
        let quad = points(&[[0., 0., 0.], [2., 0., 0.], [2., 3., 0.], [0., 3., 0.]]);
        assert_eq!(volume(CellKind::Quad, &quad), 6.0);
        assert_eq!(volume(CellKind::Triangle, &quad[..3]), 3.0);
        assert_eq!(vector_area(&quad), Vector3::new(0.0, 0.0, 6.0));
        assert_eq!(volume(CellKind::Line, &quad[..2]), 2.0);
    }
}
