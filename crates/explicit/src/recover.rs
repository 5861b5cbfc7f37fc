//! Fields recovered from a state: strains, stresses and energies of the cells, in double precision. Points of
//! solid cells are taken a pack at a time, in lanes; triangles of membranes and bars one by one.

use std::array::from_fn;

use pliant_mechanics::element::{Cord, Rest, Sheet};
use pliant_mechanics::law::plane_stress::InPlane;
use pliant_mechanics::law::{AnyLaw, Deformation, Law, MOST_FAMILIES, Split, with_law};
use pliant_mechanics::model::{Averaging, Cells, LocalNodes, Material, Model, Solid, with_cells};
use pliant_mechanics::tensor::{Symmetric, Tensor, Vector, add, cast, cross, dot, scale, sub};
use rayon::prelude::*;

use crate::forces::pressure;
use crate::history::History;
use crate::lanes::LaneNumber;
use crate::lanes::{
    LaneWork, Lanes, PACK, Pack, Processor, load_symmetric, load_tensor, load_vector, store_symmetric,
    store_vector,
};
use crate::state::State;

/// The state of one cell.
#[derive(Clone, Copy, Debug)]
pub struct CellFields {
    /// Deformation gradient F (mean over the cell).
    pub gradient: Tensor<f64>,
    /// J that the volumetric part of the law sees, to which its pressure belongs: det F, or the average that
    /// the element takes.
    pub volume_ratio: f64,
    /// The cell's own det F (mean over the cell).
    pub cell_volume_ratio: f64,
    /// Green–Lagrange strain.
    pub green_strain: Symmetric<f64>,
    /// Second Piola–Kirchhoff stress [Pa], relaxation included.
    pub pk2_stress: Symmetric<f64>,
    /// Cauchy stress [Pa].
    pub cauchy_stress: Symmetric<f64>,
    /// Strain energy per reference volume [J/m³] of the instantaneous elastic law. Its volumetric part uses
    /// the averages that the element takes: the forces are the gradient of Σ V ψ.
    pub energy_density: f64,
    /// Unit fibre at rest; `None` if the law has none.
    pub fibre: Option<Vector<f64>>,
    /// Length of the deformed unit fibre (of the first family); `None` if the law has none.
    pub fibre_stretch: Option<f64>,
    /// Thickness [m] of a membrane, at rest and now; `None` of others.
    pub thickness: Option<[f64; 2]>,
    /// Length of a bar over that without force, and its force [N]; `None` of others.
    pub axial: Option<[f64; 2]>,
    /// Largest stable step [s] of the cell alone; `None` where nobody has asked for it.
    pub stable_step: Option<f64>,
}

impl CellFields {
    /// Von Mises stress [Pa]: √(3/2 s:s) of the Cauchy stress.
    pub fn von_mises(&self) -> f64 {
        let [xx, yy, zz, xy, yz, xz] = self.cauchy_stress.0;
        let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
        (0.5 * normal + 3.0 * (xy * xy + yz * yz + xz * xz)).sqrt()
    }

    /// Force per length [N/m] in the wall of a membrane, as a tensor in space; `None` of others.
    pub fn membrane_force(&self) -> Option<Symmetric<f64>> {
        self.thickness.map(|[_, now]| self.cauchy_stress * now)
    }

    /// Pressure [Pa]: minus a third of the trace of the Cauchy stress.
    pub fn pressure(&self) -> f64 {
        -self.cauchy_stress.trace() / 3.0
    }
}

/// Fields of the cells of a state. The history of a relaxing law belongs to the last evaluated instant: ask
/// between [`evaluate`](crate::CentralDifference::evaluate) and
/// [`advance`](crate::CentralDifference::advance).
pub struct Recovery<'a, R> {
    model: &'a Model,
    state: &'a State<R>,
    averages: Vec<Averages>,
}

/// Returns the energy [J] stored in a state whose nodes start displaced, including `hourglass` [J] of
/// hourglass control.
pub fn stored_at_start<R: LaneNumber>(model: &Model, state: &State<R>, hourglass: f64) -> f64 {
    let is_moved = state.displacement.iter().flatten().any(|&u| u != R::ZERO);
    if is_moved { Recovery::new(model, state).stored_energy() + hourglass } else { 0.0 }
}

/// Averages that the cells of a solid use.
enum Averages {
    /// No averages.
    None,
    /// Averages of the volumetric part of the law.
    Volumetric(Vec<Dilatation>),
    /// Averaged volume ratio J̄ of each cell, minus 1.
    VolumeChange(Vec<f64>),
}

/// The volumetric part of a law in a cell, averaged.
#[derive(Clone, Copy)]
struct Dilatation {
    /// J − 1.
    change: f64,
    /// U' [Pa], relaxed.
    pressure: f64,
    /// U [J/m³].
    energy: f64,
}

impl<'a, R: LaneNumber> Recovery<'a, R> {
    /// Finds the averages that the elements take; the rest is found cell by cell.
    pub fn new(model: &'a Model, state: &'a State<R>) -> Self {
        let averages =
            model.solids.iter().zip(&state.history).map(|(s, h)| averages(s, h, &state.displacement));
        Self { model, state, averages: averages.collect() }
    }

    /// Σ V ψ over all cells [J], without what hourglass control holds. The number of threads never changes a
    /// bit.
    pub fn stored_energy(&self) -> f64 {
        let of_solid = |(index, solid): (usize, &Solid)| {
            let densities = self.numbers(index, 1, |_, fields, to| to[0] = fields.energy_density);
            (0..solid.cells.len()).map(|cell| solid.cells.volume(cell) * densities[cell]).sum::<f64>()
        };
        self.model.solids.iter().enumerate().map(of_solid).sum()
    }

    /// Returns `width` numbers of each cell of a solid, which `of` writes from its number and fields. Fields
    /// of all cells would take a lot of memory.
    pub fn numbers(
        &self,
        solid: usize,
        width: usize,
        of: impl Fn(usize, &CellFields, &mut [f64]) + Sync,
    ) -> Vec<f64> {
        let part = &self.model.solids[solid];
        let count = part.cells.len();
        let mut numbers = vec![0.0; count * width];
        numbers.par_chunks_mut(PACK * width.max(1)).enumerate().for_each(|(pack, numbers)| {
            let first = pack * PACK;
            let cells = (first..).zip(numbers.chunks_exact_mut(width));
            if takes_packs(&part.cells) {
                let found = self.pack(solid, |lane| (first + lane).min(count - 1));
                cells.for_each(|(cell, to)| of(cell, &found.fields(part, cell, cell - first), to));
            } else {
                cells.for_each(|(cell, to)| of(cell, &self.cell(solid, cell), to));
            }
        });
        numbers
    }

    /// The fields of one cell of a solid, means over its points.
    pub fn cell(&self, solid: usize, cell: usize) -> CellFields {
        let part = &self.model.solids[solid];
        match &part.cells {
            Cells::FullHex8(_, points) => {
                let quadrature = &points[cell];
                let at =
                    |point: usize| (cell, point, self.gradient(solid, cell, &quadrature.gradient[point]));
                let found = self.points(solid, &from_fn(|lane| at(lane % quadrature.weight.len())));
                let points = quadrature.weight.iter().enumerate();
                mean(points.map(|(lane, &w)| (found.fields(part, cell, lane), w)), part.cells.volume(cell))
            }
            Cells::Membrane(block, sheets) => {
                let h = self.gradient(solid, cell, &block.rest[cell].gradient);
                membrane_fields(part, &h, cell, &sheets[cell], &self.history(solid, cell))
            }
            Cells::Bar(block, cord) => {
                let [_, moved] = self.moved(solid, cell);
                bar_fields(part, &block.rest[cell], cord, moved, &self.history(solid, cell))
            }
            _ => self.pack(solid, |_| cell).fields(part, cell, 0),
        }
    }

    /// A pack of cells with one point.
    fn pack(&self, solid: usize, cell: impl Fn(usize) -> usize) -> Found {
        with_cells!(&self.model.solids[solid].cells, block => self.points(solid, &from_fn(|lane| {
            let cell = cell(lane);
            (cell, 0, self.gradient(solid, cell, &block.rest[cell].gradient))
        })))
    }

    /// ∂u/∂X of a cell from the gradients of its shape functions [1/m].
    fn gradient<const N: usize>(&self, solid: usize, cell: usize, shape: &[Vector<f64>; N]) -> Tensor<f64> {
        gradient(&self.moved::<N>(solid, cell), shape)
    }

    /// Returns the displacements [m] of the nodes of a cell relative to its first node.
    fn moved<const N: usize>(&self, solid: usize, cell: usize) -> [Vector<f64>; N] {
        let nodes = self.model.solids[solid].cells.nodes(cell);
        let at = |a: usize| -> Vector<f64> { cast(self.state.displacement[nodes[a] as usize]) };
        let origin = at(0);
        from_fn(|a| sub(at(a), origin))
    }

    /// Returns the history [Pa] of a cell with one point.
    fn history(&self, solid: usize, cell: usize) -> Vec<Symmetric<f64>> {
        self.state.history[solid].of_point(&self.model.solids[solid], cell, 0).collect()
    }

    /// A pack of points, each with its cell, its number there and its ∂u/∂X.
    fn points(&self, solid: usize, points: &[(usize, usize, Tensor<f64>); PACK]) -> Found {
        let part = &self.model.solids[solid];
        let Material { law, prony, .. } = &part.material;
        let (history, averages) = (&self.state.history[solid], &self.averages[solid]);
        let mut given = Given {
            gradient: NO_TENSOR,
            fibres: [[Pack::ZERO; 3]; MOST_FAMILIES],
            remaining: prony.remaining(),
            lag: NO_SYMMETRIC,
            pressure: None,
        };
        for (lane, (cell, point, h)) in points.iter().enumerate() {
            let fill = |to: &mut [Pack<f64>], from: &[f64]| {
                to.iter_mut().zip(from).for_each(|(to, &number)| to.0[lane] = number);
            };
            let seen = match averages {
                Averages::VolumeChange(changes) => &dilated(h, changes[*cell]),
                Averages::None | Averages::Volumetric(_) => h,
            };
            fill(given.gradient.0.as_flattened_mut(), seen.0.as_flattened());
            fill(given.fibres.as_flattened_mut(), part.fibres(*cell).as_flattened());
            if !prony.is_elastic() {
                fill(&mut given.lag.0, &prony.lag(history.of_point(part, *cell, *point)).0);
            }
            if let Averages::Volumetric(cells) = averages {
                given.pressure.get_or_insert(Pack::ZERO).0[lane] = cells[*cell].pressure;
            }
        }
        let mut found = Found {
            gradient: NO_TENSOR,
            volume_ratio: Pack::ZERO,
            cell_volume_ratio: Pack::ZERO,
            green_strain: NO_SYMMETRIC,
            pk2_stress: NO_SYMMETRIC,
            cauchy_stress: NO_SYMMETRIC,
            energy: Split { isochoric: Pack::ZERO, volumetric: Pack::ZERO },
            fibre_stretch: Pack::ZERO,
        };
        at_points(law, &given, &mut found);
        found.cell_volume_ratio = found.volume_ratio;
        for (lane, (cell, _, h)) in points.iter().enumerate() {
            match averages {
                Averages::Volumetric(cells) => {
                    let Dilatation { change, energy, .. } = cells[*cell];
                    found.volume_ratio.0[lane] = 1.0 + change;
                    found.energy.volumetric.0[lane] = energy;
                }
                Averages::VolumeChange(_) => found.cell_volume_ratio.0[lane] = 1.0 + volume_change(h),
                Averages::None => {}
            }
        }
        found
    }
}

const NO_TENSOR: Tensor<Pack<f64>> = Tensor([[Pack::ZERO; 3]; 3]);
const NO_SYMMETRIC: Symmetric<Pack<f64>> = Symmetric([Pack::ZERO; 6]);

/// Input of a pack of points.
struct Given {
    /// ∂u/∂X that the law sees.
    gradient: Tensor<Pack<f64>>,
    fibres: [Vector<Pack<f64>>; MOST_FAMILIES],
    /// Parts of the elastic stress that do not relax.
    remaining: Split<f64>,
    /// Stress [Pa] that relaxing parts remember.
    lag: Symmetric<Pack<f64>>,
    /// U' [Pa] in place of the volumetric stress of the law.
    pressure: Option<Pack<f64>>,
}

/// Fields found at a pack of points; see [`CellFields`].
struct Found {
    gradient: Tensor<Pack<f64>>,
    volume_ratio: Pack<f64>,
    cell_volume_ratio: Pack<f64>,
    green_strain: Symmetric<Pack<f64>>,
    pk2_stress: Symmetric<Pack<f64>>,
    cauchy_stress: Symmetric<Pack<f64>>,
    energy: Split<Pack<f64>>,
    fibre_stretch: Pack<f64>,
}

impl Found {
    /// The fields of a lane, which has a cell.
    fn fields(&self, solid: &Solid, cell: usize, lane: usize) -> CellFields {
        let symmetric = |of: &Symmetric<Pack<f64>>| Symmetric(of.0.each_ref().map(|entry| entry.0[lane]));
        let fibre = solid.fibres(cell).first().copied();
        CellFields {
            gradient: Tensor(self.gradient.0.each_ref().map(|row| row.each_ref().map(|entry| entry.0[lane]))),
            volume_ratio: self.volume_ratio.0[lane],
            cell_volume_ratio: self.cell_volume_ratio.0[lane],
            green_strain: symmetric(&self.green_strain),
            pk2_stress: symmetric(&self.pk2_stress),
            cauchy_stress: symmetric(&self.cauchy_stress),
            energy_density: self.energy.isochoric.0[lane] + self.energy.volumetric.0[lane],
            fibre,
            fibre_stretch: fibre.map(|_| self.fibre_stretch.0[lane]),
            thickness: None,
            axial: None,
            stable_step: None,
        }
    }
}

/// Evaluates a law at a pack of points. Not generic, so that laws are compiled here and not again in every
/// crate that recovers fields.
fn at_points(law: &AnyLaw, given: &Given, found: &mut Found) {
    with_law!(law, law => Processor::detect().run(AtPoints { law: *law, given, found }));
}

/// A law at a pack of points.
struct AtPoints<'a, T> {
    law: T,
    given: &'a Given,
    found: &'a mut Found,
}

impl<T: Law> LaneWork<f64> for AtPoints<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<f64>>(self) {
        let Self { law, given, found } = self;
        for at in (0..PACK).step_by(L::WIDTH) {
            let deformation = Deformation::<L>::from_displacement_gradient(&load_tensor(&given.gradient, at));
            let mut directions = [[L::ZERO; 3]; MOST_FAMILIES];
            for (direction, fibre) in directions.iter_mut().zip(&given.fibres) {
                *direction = load_vector(fibre, at);
            }
            let directions = &directions[..law.families()];
            let energy = law.energy(&deformation, directions);
            let elastic = law.stress(&deformation, directions);
            let volumetric = match &given.pressure {
                Some(pressure) => {
                    let ratio = deformation.volume_ratio;
                    deformation.inverse_cauchy_green * (ratio * L::load(pressure, at))
                }
                None => elastic.volumetric * L::splat(given.remaining.volumetric),
            };
            let isochoric = elastic.isochoric * L::splat(given.remaining.isochoric);
            let stress = isochoric + volumetric + load_symmetric(&given.lag, at);
            let gradient = &deformation.gradient;
            let spatial = stress.push_forward(gradient) * (L::ONE / deformation.volume_ratio);
            for (row, to) in gradient.0.into_iter().zip(&mut found.gradient.0) {
                store_vector(row, to, at);
            }
            deformation.volume_ratio.store(&mut found.volume_ratio, at);
            store_symmetric(deformation.strain_twice * L::of(0.5), &mut found.green_strain, at);
            store_symmetric(stress, &mut found.pk2_stress, at);
            store_symmetric(spatial, &mut found.cauchy_stress, at);
            energy.isochoric.store(&mut found.energy.isochoric, at);
            energy.volumetric.store(&mut found.energy.volumetric, at);
            if let Some(fibre) = directions.first() {
                let deformed = gradient.apply(*fibre);
                dot(deformed, deformed).sqrt().store(&mut found.fibre_stretch, at);
            }
        }
    }
}

/// True if cells are solid, with one point each.
fn takes_packs(cells: &Cells) -> bool {
    cells.points() == 1 && !matches!(cells, Cells::Membrane(..) | Cells::Bar(..))
}

/// ∂u/∂X.
fn gradient(u: &[Vector<f64>], shape: &[Vector<f64>]) -> Tensor<f64> {
    let mut h = Tensor::ZERO;
    for (&u, &b) in u.iter().zip(shape) {
        h.add_outer(u, b);
    }
    h
}

/// Fields of a triangle of a membrane, in space: across it F has the stretch that plane stress asks for.
fn membrane_fields(
    solid: &Solid,
    h: &Tensor<f64>,
    cell: usize,
    sheet: &Sheet,
    history: &[Symmetric<f64>],
) -> CellFields {
    let Material { law, prony, .. } = &solid.material;
    let axes = &sheet.axes;
    let changes = axes.map(|axis| h.apply(axis));
    let plane = InPlane::from_changes(axes, &changes);
    let found = law.plane_stress(plane.strain_twice, &solid.law_fibres(cell));
    let tangents = [add(axes[0], changes[0]), add(axes[1], changes[1])];
    let across = cross(tangents[0], tangents[1]);
    let stretch = 1.0 + found.thickness_change;
    let now = scale(across, stretch / dot(across, across).sqrt());
    let normal = cross(axes[0], axes[1]);
    let mut gradient = Tensor::ZERO;
    for (to, from) in [(tangents[0], axes[0]), (tangents[1], axes[1]), (now, normal)] {
        gradient.add_outer(to, from);
    }
    // From the frame of the triangle to space.
    let frame = Tensor([0, 1, 2].map(|k| [axes[0][k], axes[1][k], normal[k]]));
    let [xx, yy, xy] = found.stress;
    let elastic = Split { isochoric: Symmetric([xx, yy, 0.0, xy, 0.0, 0.0]), volumetric: Symmetric::ZERO };
    let pk2_stress = prony.stress(elastic, history).push_forward(&frame);
    let volume_ratio = (1.0 + plane.area_change()) * stretch;
    let fibre = solid.fibres(cell).first().copied();
    CellFields {
        gradient,
        volume_ratio,
        cell_volume_ratio: volume_ratio,
        green_strain: (found.deformation.strain_twice * 0.5).push_forward(&frame),
        pk2_stress,
        cauchy_stress: pk2_stress.push_forward(&gradient) * (1.0 / volume_ratio),
        energy_density: found.energy,
        fibre,
        fibre_stretch: fibre.map(|a| {
            let deformed = gradient.apply(a);
            dot(deformed, deformed).sqrt()
        }),
        thickness: Some([sheet.thickness, sheet.thickness * stretch]),
        axial: None,
        stable_step: None,
    }
}

/// Fields of a bar: its stress is force over the cross section at rest, in space, and its strains are along
/// it. They know nothing of its thickness.
fn bar_fields(
    solid: &Solid,
    rest: &Rest<2>,
    cord: &Cord,
    moved: Vector<f64>,
    history: &[Symmetric<f64>],
) -> CellFields {
    let pull = cord.pull(rest, moved, solid.material.law.small_strain().young());
    let elastic = Split {
        isochoric: Symmetric([pull.stress[0], 0.0, 0.0, 0.0, 0.0, 0.0]),
        volumetric: Symmetric::ZERO,
    };
    let relaxed = solid.material.prony.stress(elastic, history).0[0];
    let stress = if cord.tension_only { relaxed.max(0.0) } else { relaxed };
    let tangent = scale(rest.between(), 1.0 / rest.length());
    // Length over the length at rest, from the mesh.
    let grown = pull.length / rest.length();
    let mut gradient = Tensor::IDENTITY;
    gradient.add_outer(sub(scale(pull.along, grown), tangent), tangent);
    CellFields {
        gradient,
        volume_ratio: f64::NAN,
        cell_volume_ratio: f64::NAN,
        green_strain: Symmetric::dyad(tangent) * (0.5 * (grown * grown - 1.0)),
        pk2_stress: Symmetric::dyad(tangent) * (stress / grown),
        cauchy_stress: Symmetric::dyad(pull.along) * stress,
        energy_density: cord.energy(rest, &pull) / rest.volume,
        fibre: None,
        fibre_stretch: None,
        thickness: None,
        axial: Some([pull.stretch, stress * rest.area()]),
        stable_step: None,
    }
}

/// J − 1, without cancellation.
fn volume_change(h: &Tensor<f64>) -> f64 {
    h.trace() + h.second_invariant() + h.determinant()
}

/// H of F̄ = (J̄/J)^(1/3) F.
fn dilated(h: &Tensor<f64>, change: f64) -> Tensor<f64> {
    let ratio = ((1.0 + change) / (1.0 + volume_change(h))).cbrt();
    let mut scaled = Tensor(h.0.map(|row| row.map(|x| ratio * x)));
    (0..3).for_each(|i| scaled.0[i][i] += ratio - 1.0);
    scaled
}

/// The mean of fields at points, weighted by volume.
fn mean(points: impl Iterator<Item = (CellFields, f64)>, volume: f64) -> CellFields {
    let weighted = points.map(|(fields, weight)| (fields, weight / volume));
    let add_up = |sum: CellFields, (point, w): (CellFields, f64)| CellFields {
        gradient: Tensor([0, 1, 2].map(|i| add(sum.gradient.0[i], scale(point.gradient.0[i], w)))),
        volume_ratio: sum.volume_ratio + w * point.volume_ratio,
        cell_volume_ratio: sum.cell_volume_ratio + w * point.cell_volume_ratio,
        green_strain: sum.green_strain + point.green_strain * w,
        pk2_stress: sum.pk2_stress + point.pk2_stress * w,
        cauchy_stress: sum.cauchy_stress + point.cauchy_stress * w,
        energy_density: sum.energy_density + w * point.energy_density,
        fibre: point.fibre,
        fibre_stretch: point.fibre_stretch.map(|stretch| sum.fibre_stretch.unwrap_or(0.0) + w * stretch),
        thickness: None,
        axial: None,
        stable_step: None,
    };
    let nothing = CellFields {
        gradient: Tensor::ZERO,
        volume_ratio: 0.0,
        cell_volume_ratio: 0.0,
        green_strain: Symmetric::ZERO,
        pk2_stress: Symmetric::ZERO,
        cauchy_stress: Symmetric::ZERO,
        energy_density: 0.0,
        fibre: None,
        fibre_stretch: None,
        thickness: None,
        axial: None,
        stable_step: None,
    };
    weighted.fold(nothing, add_up)
}

fn averages<R: LaneNumber>(solid: &Solid, history: &History<R>, displacement: &[Vector<R>]) -> Averages {
    let Material { law, prony, .. } = &solid.material;
    let relaxed =
        |index: usize, change: f64| prony.pressure(pressure(law, change), &history.of_pressure(solid, index));
    let change = |cell: usize, gradients: &[Vector<f64>]| {
        let nodes = solid.cells.nodes(cell);
        let origin: Vector<f64> = cast(displacement[nodes[0] as usize]);
        let u: Vec<_> = nodes.iter().map(|&node| sub(cast(displacement[node as usize]), origin)).collect();
        volume_change(&gradient(&u, gradients))
    };
    let energies = |changes: &[f64]| -> Vec<f64> { changes.iter().map(|&x| law.volume_energy(x)).collect() };
    let together = |changes: Vec<f64>, pressures: Vec<f64>, energies: Vec<f64>| {
        let cells = changes.into_iter().zip(pressures).zip(energies);
        Averages::Volumetric(
            cells.map(|((change, pressure), energy)| Dilatation { change, pressure, energy }).collect(),
        )
    };
    let relax = |changes: &[f64]| -> Vec<f64> {
        changes.iter().enumerate().map(|(index, &change)| relaxed(index, change)).collect()
    };
    match &solid.cells {
        Cells::Tet4(_) | Cells::Hex8(_) | Cells::Membrane(..) | Cells::Bar(..) => Averages::None,
        Cells::FullHex8(block, points) => {
            let mean_change = |cell: usize| {
                let at =
                    |point: usize| points[cell].weight[point] * change(cell, &points[cell].gradient[point]);
                (0..8).map(at).sum::<f64>() / block.rest[cell].volume
            };
            let changes: Vec<f64> = (0..block.nodes.len()).map(mean_change).collect();
            let (pressures, energies) = (relax(&changes), energies(&changes));
            together(changes, pressures, energies)
        }
        Cells::AveragedTet4(block, averaging) => {
            let local = LocalNodes::new(block);
            let to_nodes = |values: &[f64]| -> Vec<f64> {
                let at = |node: usize| {
                    let volume = |cell: usize| block.rest[cell].volume;
                    let total: f64 = local.cells_at(node).map(volume).sum();
                    local.cells_at(node).map(|cell| volume(cell) * values[cell]).sum::<f64>() / total
                };
                (0..local.len()).map(at).collect()
            };
            let to_cells = |values: &[f64]| -> Vec<f64> {
                local.nodes.iter().map(|cell| cell.iter().map(|&n| 0.25 * values[n as usize]).sum()).collect()
            };
            let changes: Vec<f64> =
                (0..block.nodes.len()).map(|cell| change(cell, &block.rest[cell].gradient)).collect();
            let nodal = to_nodes(&changes);
            let averaged = to_cells(&nodal);
            match averaging {
                Averaging::Nodal => together(averaged, to_cells(&relax(&nodal)), to_cells(&energies(&nodal))),
                Averaging::Variational => {
                    let (pressures, energies) = (relax(&averaged), energies(&averaged));
                    together(averaged, to_cells(&to_nodes(&pressures)), energies)
                }
                Averaging::NiftySim => Averages::VolumeChange(averaged),
            }
        }
    }
}
