//! From an anatomy to tetrahedra that an explicit solver can take large steps with: isosurface stuffing of the whole body,
//! its materials cut out, banks that touch parted, then the optimiser. Rules and thresholds: the project's meshing
//! specification 1.3.

use std::fmt;

use pliant_geometry::{CellKind, DataArray, Mesh, QualityReport, Spread, Vector3, volume};
use serde::Serialize;

use crate::anatomy::Anatomy;
use crate::complex::Complex;
use crate::cut::{cut_gaps, cut_materials};
use crate::error::{MeshingError, require_positive};
use crate::manifold::{crowded_edges, mend};

use crate::optimise::Optimiser;
use crate::surfaces::Surfaces;
use crate::{DEFAULT_CELL_LIMIT, Stuffing};

/// A request for tetrahedra of an anatomy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrganTets {
    /// Lattice constant [m]: the long edges of the inner tetrahedra; the short ones are √3/2 of it.
    pub edge: f64,
    /// A lattice point [m]; the centre of the box of the body if `None`.
    pub origin: Option<Vector3>,
    /// Least acoustic length to reach, as a part of that of the ideal tet: 0.75 is reached as a rule, 0.9 is as good as it
    /// gets, 0 leaves the mesh as stuffed.
    pub target: f64,
    /// Most rounds of the optimiser.
    pub rounds: usize,
    /// Pieces of the mesh with fewer cells than this part of the largest one are left out.
    pub smallest_piece: f64,
    /// Most cells allowed.
    pub cell_limit: usize,
}

impl OrganTets {
    /// Lattice constant `edge` [m], target 0.75 in at most 10 rounds, pieces of a twentieth of the largest one and more.
    pub fn new(edge: f64) -> Self {
        Self {
            edge,
            origin: None,
            target: 0.75,
            rounds: 10,
            smallest_piece: 0.05,
            cell_limit: DEFAULT_CELL_LIMIT,
        }
    }

    /// Fills an anatomy with tetrahedra; the label of each is its cell data `label`. `progress` hears fractions from 0 to
    /// 1. The result does not depend on the number of threads.
    pub fn mesh(&self, anatomy: &Anatomy<'_>, progress: &dyn Fn(f64)) -> Result<OrganMesh, MeshingError> {
        if !(0.0..1.0).contains(&self.target) {
            require_positive("target", self.target)?;
            return Err(MeshingError::TargetTooHigh { target: self.target });
        }
        let stuffing = Stuffing { edge: self.edge, origin: self.origin, cell_limit: self.cell_limit };
        let stuffed = stuffing.parts(anatomy.field(), self.smallest_piece)?;
        progress(0.1);
        let block = &stuffed.mesh.blocks[0];
        let tets = block.cells().map(|cell| [cell[0], cell[1], cell[2], cell[3]]).collect();
        let mut complex = Complex::new(stuffed.mesh.points.clone(), tets);
        // The ideal tet of a body-centred lattice: a / (2 √2).
        let ideal = self.edge / 8_f64.sqrt();
        let raw = complex.worst();
        let surfaces = Surfaces::new(anatomy);
        let bridges = cut_gaps(&mut complex, anatomy.field(), self.edge, ideal);
        cut_materials(&mut complex, &surfaces, ideal);
        let crowded = crowded_edges(&complex).len();
        let mended = mend(&mut complex);
        progress(0.2);
        let optimised = if self.target > 0.0 {
            let onward = |done: f64| progress(0.2 + 0.75 * done);
            let volumes = wanted_volumes(anatomy);
            Optimiser::new(&mut complex, surfaces, self.edge, ideal).run(
                self.target,
                self.rounds,
                &volumes,
                &onward,
            )
        } else {
            Default::default()
        };
        let repairs = Repairs {
            dropped_pieces: stuffed.dropped_components,
            dropped_cells: stuffed.dropped_cells,
            bridges,
            crowded_edges: crowded,
            doubled_points: mended.doubled,
            halved_edges: mended.halved,
        };
        let steps = Steps {
            rounds: optimised.rounds,
            peeled: optimised.peeled,
            collapsed: optimised.collapsed,
            flipped: optimised.flipped,
            moved: optimised.moved,
        };
        let left = crowded_edges(&complex).len();
        let (points, nodes, material) = complex.compacted();
        let mesh = labelled(points, nodes, &material, &anatomy.labels());
        let report = TetReport::new(&mesh, &material, anatomy, ideal, raw, repairs, steps, left);
        progress(1.0);
        Ok(OrganMesh { mesh, report })
    }
}

/// Volume of the whole and of each inner material [m³], where known.
fn wanted_volumes(anatomy: &Anatomy<'_>) -> Vec<Option<f64>> {
    let mut volumes = anatomy.volumes().to_vec();
    volumes[0] = volumes.iter().copied().sum();
    volumes
}

fn labelled(points: Vec<Vector3>, nodes: Vec<u32>, material: &[u8], labels: &[i32]) -> Mesh {
    let mut mesh = Mesh { points, ..Mesh::default() };
    let block = mesh.block_mut(CellKind::Tet);
    block.nodes = nodes;
    let label = |&material: &u8| f64::from(labels[usize::from(material) - 1]);
    block.data.insert("label".to_owned(), DataArray::scalar(material.iter().map(label).collect()));
    mesh
}

/// A mesh of an anatomy, and what there is to know about it.
#[derive(Clone, Debug, PartialEq)]
pub struct OrganMesh {
    /// One block of tets with the cell data `label`.
    pub mesh: Mesh,
    /// Sizes, quality, repairs.
    pub report: TetReport,
}

/// What was repaired.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Repairs {
    /// Small pieces left out.
    pub dropped_pieces: usize,
    /// Cells in them.
    pub dropped_cells: usize,
    /// Edges that bridged a gap thinner than they are long.
    pub bridges: usize,
    /// Edges where the body touched itself (more than two boundary faces).
    pub crowded_edges: usize,
    /// Points doubled so that banks of a thin gap can slide.
    pub doubled_points: usize,
    /// Edges halved to that end.
    pub halved_edges: usize,
}

/// What the optimiser did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Steps {
    /// Rounds run.
    pub rounds: usize,
    /// Tets taken off the boundary.
    pub peeled: usize,
    /// Edges collapsed.
    pub collapsed: usize,
    /// Edges and faces flipped.
    pub flipped: usize,
    /// Moves of points.
    pub moved: usize,
}

/// One material of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MaterialReport {
    /// Its label.
    pub label: i32,
    /// Its tets.
    pub tets: usize,
    /// Their volume [m³].
    pub volume: f64,
    /// Volume of its voxels, or within the surface it was made of [m³], where known.
    pub voxel_volume: Option<f64>,
}

/// Size and quality of a mesh of an anatomy.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TetReport {
    /// Points.
    pub nodes: usize,
    /// Tets.
    pub tets: usize,
    /// Its materials.
    pub materials: Vec<MaterialReport>,
    /// Least acoustic length [m]: a step of this over the speed of pressure waves is stable.
    pub acoustic_length: f64,
    /// The same as a part of that of the ideal tet of the lattice.
    pub acoustic_part: f64,
    /// That part before the optimiser.
    pub raw_acoustic_part: f64,
    /// Median acoustic length [m].
    pub median_acoustic_length: f64,
    /// Smallest and largest dihedral angle [°].
    pub dihedral: [f64; 2],
    /// Most tets round a point.
    pub most_tets_round_a_node: usize,
    /// Edges of the boundary that still have more than two boundary faces.
    pub crowded_edges_left: usize,
    /// What was repaired.
    pub repairs: Repairs,
    /// What the optimiser did.
    pub steps: Steps,
}

impl TetReport {
    #[expect(clippy::too_many_arguments, reason = "what the stages before found, each once")]
    fn new(
        mesh: &Mesh,
        material: &[u8],
        anatomy: &Anatomy<'_>,
        ideal: f64,
        raw: f64,
        repairs: Repairs,
        steps: Steps,
        crowded_edges_left: usize,
    ) -> Self {
        let quality = QualityReport::new(mesh);
        let block = &mesh.blocks[0];
        let mut materials: Vec<MaterialReport> = anatomy
            .labels()
            .into_iter()
            .zip(anatomy.volumes())
            .map(|(label, &voxel_volume)| MaterialReport { label, tets: 0, volume: 0.0, voxel_volume })
            .collect();
        let mut around = vec![0_usize; mesh.points.len()];
        for (cell, &material) in block.cells().zip(material) {
            let corners = [0, 1, 2, 3].map(|at| mesh.points[cell[at] as usize]);
            let own = &mut materials[usize::from(material) - 1];
            own.tets += 1;
            own.volume += volume(CellKind::Tet, &corners);
            cell.iter().for_each(|&node| around[node as usize] += 1);
        }
        let Spread { min, median, .. } =
            quality.acoustic_length.unwrap_or(Spread { min: 0.0, median: 0.0, max: 0.0 });
        Self {
            nodes: mesh.points.len(),
            tets: block.len(),
            materials,
            acoustic_length: min,
            acoustic_part: min / ideal,
            raw_acoustic_part: raw / ideal,
            median_acoustic_length: median,
            dihedral: quality.dihedral.unwrap_or([0.0; 2]),
            most_tets_round_a_node: around.into_iter().max().unwrap_or(0),
            crowded_edges_left,
            repairs,
            steps,
        }
    }
}

impl fmt::Display for TetReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "nodes            {}", self.nodes)?;
        writeln!(f, "tets             {}", self.tets)?;
        for material in &self.materials {
            write!(
                f,
                "label {:<10} {} tets, {:.2} ml",
                material.label,
                material.tets,
                material.volume * 1e6
            )?;
            match material.voxel_volume {
                Some(voxels) => {
                    writeln!(f, " ({:+.2} % of the input)", (material.volume / voxels - 1.0) * 100.0)?
                }
                None => writeln!(f)?,
            }
        }
        let [low, high] = self.dihedral;
        writeln!(f, "dihedral angle   {low:.1}° to {high:.1}°")?;
        writeln!(
            f,
            "acoustic length  {:.4e} m at least, {:.3} of the ideal ({:.3} before optimisation)",
            self.acoustic_length, self.acoustic_part, self.raw_acoustic_part
        )?;
        let Repairs { dropped_pieces, dropped_cells, bridges, crowded_edges, doubled_points, halved_edges } =
            self.repairs;
        if dropped_pieces > 0 {
            writeln!(f, "left out         {dropped_cells} cells in {dropped_pieces} small pieces")?;
        }
        if bridges > 0 {
            writeln!(f, "gaps cut out     {bridges} edges bridged gaps thinner than the lattice")?;
        }
        if crowded_edges > 0 {
            writeln!(
                f,
                "parted           {crowded_edges} edges where the body touched itself ({doubled_points} points doubled, \
                 {halved_edges} edges halved)"
            )?;
        }
        if self.crowded_edges_left > 0 {
            writeln!(f, "still touching   {} edges", self.crowded_edges_left)?;
        }
        let Steps { rounds, peeled, collapsed, flipped, moved } = self.steps;
        write!(
            f,
            "optimiser        {rounds} rounds: {peeled} tets peeled, {collapsed} edges collapsed, {flipped} flips, {moved} moves"
        )
    }
}
