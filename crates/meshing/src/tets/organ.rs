//! From an anatomy to tetrahedra that allow an explicit solver large steps. The whole body is filled by
//! isosurface stuffing, its materials are cut out, banks that touch are parted, then the optimiser runs.
//! Rules and thresholds: the project's meshing specification 1.3. Cells of several sizes, and cells made
//! smaller until a distance is held: `grading.rs`.

use std::fmt;

use pliant_geometry::{CellKind, DataArray, Mesh, QualityReport, Spread, Vector3, acoustic_length, volume};
use serde::Serialize;

use crate::Stuffing;
use crate::error::{MeshingError, require_positive};
use crate::input::anatomy::Anatomy;
use crate::input::given::MeasuredTo;
use crate::input::surfaces::Surfaces;
use crate::report::deviation::Measured;
use crate::report::soundness::{SurfaceCheck, self_intersections};
use crate::tets::complex::{Complex, LONGEST};
use crate::tets::cut::{cut_gaps, cut_materials};
use crate::tets::grading::{Filled, Levels, Wanted, fill, tree};
use crate::tets::guard::Guard;
use crate::tets::long_edges::halve_long_edges;
use crate::tets::lost::{LostPart, Samples};
use crate::tets::manifold::{crowded_edges, mend, pinched_points};
use crate::tets::octree::{Octree, around};
use crate::tets::optimise::{Optimiser, Steps};
use crate::tets::request::{OrganTets, SMALLEST_PART};

/// Most meshes made until a distance is held.
const MOST_PASSES: usize = 8;

/// Lost parts below this part of the body's volume are not named.
const LEAST_LOST: f64 = 1e-4;

/// Number of lost parts that are listed.
const LISTED: usize = 3;

/// Cells may be halved this often where a thin part would be torn.
const TEAR_HALVINGS: usize = 2;

/// Cells become smaller where the distance exceeds this fraction of the requested one.
const BEYOND: f64 = 0.85;

/// Least factor by which the cells of a place shorten the step for the report to name it.
const COSTLY: f64 = 2.0;

/// Radius of a place around its smallest cell, over the longest edge.
const REACH: f64 = 3.0;

/// An unoptimised mesh is refined where its distance exceeds the requested one by this factor.
const RAW_BEYOND: f64 = 1.2;

impl OrganTets {
    /// Fills an anatomy with tetrahedra; the label of each is its cell data `label`. `progress` hears
    /// fractions from 0 to
    /// 1. The result does not depend on the number of threads.
    pub fn mesh(&self, anatomy: &Anatomy<'_>, progress: &dyn Fn(f64)) -> Result<OrganMesh, MeshingError> {
        if !(0.0..1.0).contains(&self.target) {
            require_positive("target", self.target)?;
            return Err(MeshingError::TargetTooHigh { target: self.target });
        }
        if let Some(inner) = self.inner_edge {
            require_positive("inner edge", inner)?;
        }
        if let Some(distance) = self.distance {
            return self.within(distance, anatomy, progress);
        }
        let filled = self.filled(anatomy)?;
        progress(0.1);
        self.finished(filled, anatomy, &|done| progress(0.1 + 0.9 * done))
    }

    /// Refines cells until a distance is reached; otherwise returns the best mesh.
    fn within(
        &self,
        distance: f64,
        anatomy: &Anatomy<'_>,
        progress: &dyn Fn(f64),
    ) -> Result<OrganMesh, MeshingError> {
        require_positive("distance", distance)?;
        let finest = finest_for(distance, self.edge).min(self.edge / f64::from(1 << TEAR_HALVINGS));
        let levels = Levels::new(self, finest)?;
        let (mut wanted, mut coarser) = (Wanted::new(), Wanted::new());
        let (mut best, mut is_final): (Option<OrganMesh>, bool) = (None, false);
        for pass in 0..=MOST_PASSES {
            let share = |done: f64| progress((pass as f64 + done) / (MOST_PASSES + 1) as f64);
            is_final |= pass + 1 >= MOST_PASSES;
            let (filled, tree) = match self.whole(anatomy, &levels, &mut wanted) {
                Err(MeshingError::TooManyCells { .. }) if best.is_some() => break,
                // The mesh before it fits, and is finished.
                Err(MeshingError::TooManyCells { .. }) if pass > 0 && !wanted.eq(&coarser) => {
                    (wanted, is_final) = (coarser.clone(), true);
                    continue;
                }
                filled => filled?,
            };
            let (points, nodes, material) = filled.complex.compacted();
            let raw =
                Measured::of(&labelled(points, nodes, &material, &anatomy.labels()), anatomy, distance)?;
            coarser.clone_from(&wanted);
            if !is_final && raw.largest() > RAW_BEYOND * distance && finer(&mut wanted, &tree, &raw, distance)
            {
                continue;
            }
            let mut made = self.finished(filled, anatomy, &share)?;
            let measured = Measured::of(&made.mesh, anatomy, distance)?;
            let reached = measured.largest();
            made.report.distance =
                Some(DistanceReport { asked: distance, reached, passes: pass + 1, to: measured.to });
            let so_far = best.as_ref().and_then(|best| best.report.distance);
            if so_far.is_none_or(|so_far| reached < so_far.reached) {
                best = Some(made);
            }
            if reached <= distance || is_final || !finer(&mut wanted, &tree, &measured, distance) {
                break;
            }
        }
        progress(1.0);
        best.ok_or(MeshingError::NoCells { edge: self.edge, size: Vector3::zeros() })
    }

    /// A body filled with tets, with smaller ones where thin parts would be torn.
    fn filled(&self, anatomy: &Anatomy<'_>) -> Result<Filled, MeshingError> {
        let levels = Levels::new(self, self.edge / f64::from(1 << TEAR_HALVINGS))?;
        let mut wanted = Wanted::new();
        if self.inner_edge.is_some() || !self.protect.is_empty() {
            return Ok(self.whole(anatomy, &levels, &mut wanted)?.0);
        }
        let stuffed = self.stuffed(anatomy)?;
        if stuffed.tears.is_empty() {
            return Ok(stuffed);
        }
        if !levels.close(self, &tree(self, anatomy, &levels, &wanted)?, &stuffed.tears, &mut wanted) {
            return Ok(stuffed);
        }
        match self.whole(anatomy, &levels, &mut wanted) {
            Err(MeshingError::TooManyCells { .. }) => Ok(stuffed),
            filled => filled.map(|(filled, _)| Filled {
                closed_tears: stuffed.tears.len().saturating_sub(filled.tears.len()).max(filled.closed_tears),
                ..filled
            }),
        }
    }

    /// Fills a body with tets of several sizes, smaller than `wanted` where thin parts would be torn. Also
    /// returns the lattice.
    fn whole(
        &self,
        anatomy: &Anatomy<'_>,
        levels: &Levels,
        wanted: &mut Wanted,
    ) -> Result<(Filled, Octree), MeshingError> {
        let mut best: Option<(Filled, Octree)> = None;
        let mut found = 0_usize;
        loop {
            let lattice = tree(self, anatomy, levels, wanted)?;
            let mut filled = match fill(self, anatomy, &lattice) {
                Err(MeshingError::TooManyCells { .. }) if best.is_some() => break,
                filled => filled?,
            };
            filled.closed_tears = found.saturating_sub(filled.tears.len());
            found = found.max(filled.tears.len());
            let is_finer = levels.close(self, &lattice, &filled.tears, wanted);
            best = Some((filled, lattice));
            if !is_finer {
                break;
            }
        }
        best.ok_or(MeshingError::NoCells { edge: self.edge, size: Vector3::zeros() })
    }

    /// Tets of one size.
    fn stuffed(&self, anatomy: &Anatomy<'_>) -> Result<Filled, MeshingError> {
        let stuffing = Stuffing { edge: self.edge, origin: self.origin, cell_limit: self.cell_limit };
        let stuffed = stuffing.parts(anatomy.field(), 0.0)?;
        let block = &stuffed.mesh.blocks[0];
        let tets = block.cells().map(|cell| [cell[0], cell[1], cell[2], cell[3]]).collect();
        let complex = Complex::new(stuffed.mesh.points.clone(), tets, self.edge);
        Ok(Filled::of(complex, self.smallest_piece, anatomy.field()))
    }

    /// Cuts materials out, parts banks that touch, and optimises.
    fn finished(
        &self,
        filled: Filled,
        anatomy: &Anatomy<'_>,
        progress: &dyn Fn(f64),
    ) -> Result<OrganMesh, MeshingError> {
        let Filled { mut complex, dropped_pieces, dropped_cells, tears, closed_tears } = filled;
        let raw = complex.worst();
        let bridges = cut_gaps(&mut complex, anatomy.field());
        cut_materials(&mut complex, &Surfaces::new(anatomy, self.edge));
        let crowded = crowded_edges(&complex).len();
        let mended = mend(&mut complex);
        progress(0.1);
        let samples = Samples::of(anatomy, self.edge);
        // A mesh has the surface of its body within half an edge, a smooth one of voxels within their
        // diagonal.
        let far = (self.edge / 2.0).max(anatomy.resolution());
        let lost = |complex: &Complex| {
            samples.as_ref().map_or_else(Vec::new, |sampled| sampled.lost(&sampled.within_tets(complex), far))
        };
        let volumes = |complex: &Complex| wanted_volumes(anatomy, &lost(complex));
        let is_tight = mended.doubled + mended.parted > 0;
        let (complex, long_edges, steps) =
            self.improved(complex, anatomy, is_tight, &volumes, &|done| progress(0.1 + 0.85 * done));
        let repairs = Repairs {
            dropped_pieces,
            dropped_cells,
            bridges,
            crowded_edges: crowded,
            doubled_points: mended.doubled,
            halved_edges: mended.halved,
            parted_points: mended.parted,
            long_edges,
            closed_tears,
        };
        let crowded_edges_left = crowded_edges(&complex).len();
        let pinched = pinched_points(&complex);
        let pinched_points = pinched.iter().map(|&point| complex.points[point as usize].into()).collect();
        let lost = lost(&complex);
        let (acoustic_part, edges) = (complex.worst(), EdgeLengths::of(&complex));
        let (points, nodes, material) = complex.compacted();
        let mesh = labelled(points, nodes, &material, &anatomy.labels());
        let surface = SurfaceCheck::of(&mesh).with_body(anatomy.field(), self.edge);
        let tears = Tears { number: tears.len(), first: tears.first().map(|tear| tear.places[0].into()) };
        let of_complex =
            OfComplex { raw, acoustic_part, edges, crowded_edges_left, pinched_points, surface, tears, lost };
        let report = TetReport::new(&mesh, &material, anatomy, of_complex, repairs, steps);
        progress(1.0);
        Ok(OrganMesh { mesh, report })
    }

    /// Halves long edges and optimises. Returns the number of halved edges, and the steps. Few bodies have
    /// banks that could meet, and guarding all moves takes long. Moves are guarded where the body touched
    /// itself (`is_tight`), or where the result intersects itself without a guard.
    fn improved(
        &self,
        mut complex: Complex,
        anatomy: &Anatomy<'_>,
        is_tight: bool,
        volumes: &dyn Fn(&Complex) -> Vec<Option<f64>>,
        progress: &dyn Fn(f64),
    ) -> (Complex, usize, Steps) {
        let improve = |complex: &mut Complex, mut guard: Option<Guard>| {
            let surfaces = Surfaces::new(anatomy, self.edge);
            let long_edges = halve_long_edges(complex, &surfaces, &mut guard);
            let steps = match self.target > 0.0 {
                true => {
                    Optimiser::new(complex, surfaces, guard).run(self.target, self.rounds, volumes, progress)
                }
                false => Steps::default(),
            };
            (long_edges, steps)
        };
        if !is_tight {
            let mut free = complex.clone();
            let (long_edges, steps) = improve(&mut free, None);
            if self_intersections(&free.points, &free.outer_faces()).0.is_empty() {
                return (free, long_edges, steps);
            }
        }
        let guard = Guard::new(&complex);
        let (long_edges, steps) = improve(&mut complex, Some(guard));
        (complex, long_edges, steps)
    }
}

/// The shortest edge that serves a distance [m].
fn finest_for(distance: f64, edge: f64) -> f64 {
    (distance / 2.0).clamp(SMALLEST_PART * edge, edge)
}

/// Halves the cubes where a mesh is too far away; returns whether any can be halved.
fn finer(wanted: &mut Wanted, tree: &Octree, measured: &Measured, distance: f64) -> bool {
    let before = wanted.len();
    for place in measured.beyond(BEYOND * distance) {
        if let Some(level) = tree.level_at(&place).checked_sub(1) {
            wanted.extend(around(tree.cube_at(level, &place)).map(|cube| (level, cube)));
        }
    }
    wanted.len() > before
}

/// Volume of the whole and of each inner material [m³], where known, less the parts that a mesh lacks.
/// Otherwise the rest would grow to compensate.
fn wanted_volumes(anatomy: &Anatomy<'_>, lost: &[LostPart]) -> Vec<Option<f64>> {
    let mut volumes = anatomy.volumes().to_vec();
    for part in lost {
        for (volume, missing) in volumes.iter_mut().zip(&part.volumes) {
            *volume = volume.map(|volume| volume - missing);
        }
    }
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

/// A mesh of an anatomy, with its report.
#[derive(Clone, Debug, PartialEq)]
pub struct OrganMesh {
    /// One block of tets with the cell data `label`.
    pub mesh: Mesh,
    /// Sizes, quality, repairs.
    pub report: TetReport,
}

/// The repairs.
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
    /// Edges halved for this doubling.
    pub halved_edges: usize,
    /// Points where the boundary met itself, each doubled.
    pub parted_points: usize,
    /// Edges halved because they were too long for the size requested at their location.
    pub long_edges: usize,
    /// Tears of thin parts that were closed by smaller cells.
    pub closed_tears: usize,
}

impl Repairs {
    /// Writes the lines of the repairs that were made.
    fn write(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            dropped_pieces,
            dropped_cells,
            bridges,
            crowded_edges,
            doubled_points,
            halved_edges,
            parted_points,
            long_edges,
            closed_tears,
        } = *self;
        if dropped_pieces > 0 {
            writeln!(f, "left out         {dropped_cells} cells in {dropped_pieces} small pieces")?;
        }
        if bridges > 0 {
            writeln!(f, "gaps cut out     {bridges} edges across gaps thinner than the lattice")?;
        }
        if crowded_edges > 0 {
            writeln!(
                f,
                "parted           {crowded_edges} edges where the body touched itself ({doubled_points} points doubled, \
                 {halved_edges} edges halved)"
            )?;
        }
        if parted_points > 0 {
            writeln!(f, "parted           {parted_points} points where the boundary touched itself")?;
        }
        if long_edges > 0 {
            writeln!(
                f,
                "halved           {long_edges} edges too long for the size requested at their location"
            )?;
        }
        if closed_tears > 0 {
            writeln!(f, "refined          {closed_tears} places where thin parts would be torn")?;
        }
        Ok(())
    }
}

/// Lengths of the edges of a mesh [m].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct EdgeLengths {
    /// The shortest.
    pub least: f64,
    /// Half of the edges are as short as this.
    pub median: f64,
    /// The longest.
    pub longest: f64,
    /// The longest one over the local lattice constant.
    pub longest_part: f64,
}

impl EdgeLengths {
    fn of(complex: &Complex) -> Self {
        let of_edge = |[p, q]: [u32; 2]| {
            let [x, y] = [p, q].map(|point| complex.points[point as usize]);
            let size = complex.size[p as usize].max(complex.size[q as usize]);
            ((x - y).norm(), size)
        };
        let mut found: Vec<(f64, f64)> = complex.edges().into_iter().map(of_edge).collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (Some(first), Some(last)) = (found.first(), found.last()) else { return Self::default() };
        let longest_part = found.iter().map(|(length, size)| length / size).fold(0.0, f64::max);
        Self { least: first.0, median: found[found.len() / 2].0, longest: last.0, longest_part }
    }
}

/// Data from before the renumbering of points and tets.
struct OfComplex {
    raw: f64,
    acoustic_part: f64,
    edges: EdgeLengths,
    crowded_edges_left: usize,
    pinched_points: Vec<[f64; 3]>,
    surface: SurfaceCheck,
    tears: Tears,
    lost: Vec<LostPart>,
}

/// A part of a body that its mesh lacks: thinner than the cells, torn off, or too small.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LostReport {
    /// Label of the largest share of its volume.
    pub label: i32,
    /// Its volume [m³].
    pub volume: f64,
    /// Its point that is farthest from the mesh [m].
    pub place: [f64; 3],
}

impl LostReport {
    /// Names the lost parts that are not negligible in a body of a volume [m³].
    pub(crate) fn of(parts: Vec<LostPart>, labels: &[i32], whole: f64) -> Vec<Self> {
        let named = |part: LostPart| {
            let most = (0..part.volumes.len()).max_by(|&a, &b| part.volumes[a].total_cmp(&part.volumes[b]));
            let label = labels.get(most.unwrap_or(0)).copied().unwrap_or(0);
            Self { label, volume: part.volume(), place: part.place.into() }
        };
        parts.into_iter().map(named).filter(|part| part.volume >= LEAST_LOST * whole).collect()
    }

    /// The first of some parts, and the volume of the rest; `None` without any.
    pub(crate) fn in_words(parts: &[Self]) -> Option<String> {
        let one = |part: &Self| {
            let [x, y, z] = part.place;
            format!("{:.3} ml of label {} at ({x:.4}, {y:.4}, {z:.4}) m", part.volume * 1e6, part.label)
        };
        let first: Vec<String> = parts.iter().take(LISTED).map(one).collect();
        let more = parts.iter().skip(LISTED);
        let rest: f64 = more.clone().map(|part| part.volume).sum();
        match more.count() {
            _ if first.is_empty() => None,
            0 => Some(first.join(", ")),
            count => Some(format!("{}, {:.3} ml in {count} other parts", first.join(", "), rest * 1e6)),
        }
    }
}

/// Thin parts of a body that a mesh tears.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Tears {
    /// Number of tears.
    pub number: usize,
    /// Place of the first [m].
    pub first: Option<[f64; 3]>,
}

/// Distance between a mesh and its body, if requested.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DistanceReport {
    /// Largest requested distance [m].
    pub asked: f64,
    /// Largest distance both ways [m].
    pub reached: f64,
    /// Number of times that cells were made.
    pub passes: usize,
    /// The reference of the distance.
    pub to: MeasuredTo,
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

/// A place whose cells alone set the step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CostlyPlace {
    /// The middle of the smallest cell [m].
    pub place: [f64; 3],
    /// Factor by which the step would grow without the cells nearer than three times the longest edge.
    pub factor: f64,
}

impl CostlyPlace {
    /// Finds it among cells with centres and acoustic lengths [m]; `None` if its factor is below [`COSTLY`].
    fn of(cells: &[(Vector3, f64)], reach: f64) -> Option<Self> {
        let &(place, least) = cells.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
        let beyond = cells.iter().filter(|(middle, _)| (middle - place).norm() > reach);
        let next = beyond.map(|(_, length)| *length).fold(f64::INFINITY, f64::min);
        let factor = next / least;
        (factor.is_finite() && factor >= COSTLY).then(|| Self { place: place.into(), factor })
    }
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
    /// The smallest acoustic length of a tet over the local ideal.
    pub acoustic_part: f64,
    /// Smallest acoustic length before the optimiser, over the local ideal.
    pub raw_acoustic_part: f64,
    /// Median acoustic length [m].
    pub median_acoustic_length: f64,
    /// The place whose cells alone set the step, if there is one.
    pub costly: Option<CostlyPlace>,
    /// Smallest and largest dihedral angle [°].
    pub dihedral: [f64; 2],
    /// Most tets round a point.
    pub most_tets_round_a_node: usize,
    /// Lengths of the edges [m].
    pub edges: EdgeLengths,
    /// Edges of the boundary that still have more than two boundary faces.
    pub crowded_edges_left: usize,
    /// Points where the boundary still meets itself [m].
    pub pinched_points: Vec<[f64; 3]>,
    /// The repairs.
    pub repairs: Repairs,
    /// The steps of the optimiser.
    pub steps: Steps,
    /// The distance, if requested.
    pub distance: Option<DistanceReport>,
    /// The boundary.
    pub surface: SurfaceCheck,
    /// Thin parts that cells of the smallest size still tear.
    pub tears: Tears,
    /// Parts of the body that the mesh lacks, the largest first, of a ten-thousandth of the body and more.
    pub lost: Vec<LostReport>,
}

impl TetReport {
    /// Deviations from the request.
    pub fn doubts(&self) -> Vec<String> {
        let mut doubts = Vec::new();
        doubts.extend(LostReport::in_words(&self.lost).map(|lost| {
            format!("the mesh lacks parts of the body: {lost}; use an edge no longer than their thickness")
        }));
        if let Some(DistanceReport { asked, reached, to, .. }) = self.distance.filter(|d| d.reached > d.asked)
        {
            doubts.push(format!(
                "the distance of {:.3} mm to {to} was not reached; the best mesh reaches {:.3} mm: give a \
                 larger distance, or a surface without folds and specks",
                asked * 1e3,
                reached * 1e3
            ));
        }
        if let (Some(CostlyPlace { place: [x, y, z], factor }), Some(_)) = (self.costly, self.distance) {
            doubts.push(format!(
                "small cells at ({x:.4}, {y:.4}, {z:.4}) m, which keep the distance, make the step \
                 {factor:.1} times as short; for longer steps, give a larger distance or smooth the surface \
                 there"
            ));
        }
        doubts.extend(self.surface.doubt());
        if let Tears { number, first: Some([x, y, z]) } = self.tears {
            doubts.push(format!(
                "the mesh tears thin parts of the body in {number} places, the first at ({x:.4}, {y:.4}, \
                 {z:.4}) m; use an edge shorter than their thickness"
            ));
        }
        if self.edges.longest_part > LONGEST + 1e-9 {
            let part = self.edges.longest_part;
            doubts.push(format!("an edge is {part:.2} times the requested length at its location"));
        }
        if let Some([x, y, z]) = self.pinched_points.first() {
            let number = self.pinched_points.len();
            doubts.push(format!(
                "the mesh boundary touches itself in {number} points, the first at ({x:.4}, {y:.4}, {z:.4}) m; a smaller edge may part \
                 them"
            ));
        }
        doubts
    }

    fn new(
        mesh: &Mesh,
        material: &[u8],
        anatomy: &Anatomy<'_>,
        of_complex: OfComplex,
        repairs: Repairs,
        steps: Steps,
    ) -> Self {
        let OfComplex { raw, acoustic_part, edges, crowded_edges_left, pinched_points, surface, tears, lost } =
            of_complex;
        let quality = QualityReport::new(mesh);
        let block = &mesh.blocks[0];
        let mut materials: Vec<MaterialReport> = anatomy
            .labels()
            .into_iter()
            .zip(anatomy.volumes())
            .map(|(label, &voxel_volume)| MaterialReport { label, tets: 0, volume: 0.0, voxel_volume })
            .collect();
        let lost = LostReport::of(lost, &anatomy.labels(), anatomy.volumes().iter().flatten().sum());
        let mut around = vec![0_usize; mesh.points.len()];
        let mut lengths = Vec::with_capacity(block.len());
        for (cell, &material) in block.cells().zip(material) {
            let corners = [0, 1, 2, 3].map(|at| mesh.points[cell[at] as usize]);
            lengths.push((corners.iter().sum::<Vector3>() / 4.0, acoustic_length(CellKind::Tet, &corners)));
            let report = &mut materials[usize::from(material) - 1];
            report.tets += 1;
            report.volume += volume(CellKind::Tet, &corners);
            cell.iter().for_each(|&node| around[node as usize] += 1);
        }
        let Spread { min, median, .. } =
            quality.acoustic_length.unwrap_or(Spread { min: 0.0, median: 0.0, max: 0.0 });
        Self {
            nodes: mesh.points.len(),
            tets: block.len(),
            materials,
            acoustic_length: min,
            acoustic_part,
            raw_acoustic_part: raw,
            median_acoustic_length: median,
            costly: CostlyPlace::of(&lengths, REACH * edges.longest),
            dihedral: quality.dihedral.unwrap_or([0.0; 2]),
            most_tets_round_a_node: around.into_iter().max().unwrap_or(0),
            edges,
            crowded_edges_left,
            pinched_points,
            repairs,
            steps,
            distance: None,
            surface,
            tears,
            lost,
        }
    }

    /// Writes the lines on the cells.
    fn write_cells(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
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
        if let Some(CostlyPlace { place: [x, y, z], factor }) = self.costly {
            writeln!(
                f,
                "shortest step    at ({:.1}, {:.1}, {:.1}) mm: without the cells there it would be {factor:.1} times as long",
                x * 1e3,
                y * 1e3,
                z * 1e3
            )?;
        }
        let EdgeLengths { least, median, longest, longest_part } = self.edges;
        writeln!(
            f,
            "edges            {:.2} to {:.2} mm, median {:.2} mm, at most {longest_part:.2} times the requested length",
            least * 1e3,
            longest * 1e3,
            median * 1e3
        )
    }

    /// Writes the lines on differences from the body.
    fn write_flaws(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(lost) = LostReport::in_words(&self.lost) {
            writeln!(f, "lost             {lost}")?;
        }
        writeln!(f, "{}", self.surface.line())?;
        if self.crowded_edges_left > 0 {
            writeln!(f, "still touching   {} edges", self.crowded_edges_left)?;
        }
        if let Some([x, y, z]) = self.pinched_points.first() {
            writeln!(
                f,
                "still touching   at {} points, the first at ({:.2}, {:.2}, {:.2}) mm",
                self.pinched_points.len(),
                x * 1e3,
                y * 1e3,
                z * 1e3
            )?;
        }
        Ok(())
    }
}

impl fmt::Display for TetReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write_cells(f)?;
        self.repairs.write(f)?;
        self.write_flaws(f)?;
        if let Some(DistanceReport { asked, reached, passes, to }) = self.distance {
            writeln!(
                f,
                "distance         {:.3} mm at most to {to}; requested {:.3} mm, {} in {passes} passes",
                reached * 1e3,
                asked * 1e3,
                if reached <= asked { "reached" } else { "not reached" }
            )?;
        }
        let Steps { rounds, peeled, given, collapsed, flipped, moved } = self.steps;
        write!(
            f,
            "optimiser        {rounds} rounds: {peeled} tets peeled, {given} moved to another label, {collapsed} edges collapsed, {flipped} flips, {moved} moves"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The factor of a small cell among even ones is the ratio of their sizes. Where small cells are
    /// everywhere, no place is costly.
    #[test]
    fn a_place_costs_what_its_cells_shorten_the_step_by() {
        let row = |least: f64| -> Vec<(Vector3, f64)> {
            (0..10)
                .map(|k| (Vector3::new(f64::from(k), 0.0, 0.0), if k == 4 { least } else { 1.0 }))
                .collect()
        };
        let found = CostlyPlace::of(&row(0.1), 0.5).unwrap();
        assert_eq!(found.place, [4.0, 0.0, 0.0]);
        assert!((found.factor - 10.0).abs() < 1e-12);
        assert_eq!(CostlyPlace::of(&row(0.6), 0.5), None);
        let small: Vec<(Vector3, f64)> = row(0.1).into_iter().map(|(x, _)| (x, 0.1)).collect();
        assert_eq!(CostlyPlace::of(&small, 0.5), None);
        assert_eq!(CostlyPlace::of(&[], 0.5), None);
    }
}
