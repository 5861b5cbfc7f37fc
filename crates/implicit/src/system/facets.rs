//! Forces and stiffness of facets, packs of eight in parallel, added node by node in their order.

use nalgebra::Vector3;
use pliant_linear::lanes::PACK;
use pliant_linear::sparse::{Cell, Equations, NONE};
use pliant_mechanics::load::{Load, LoadKind, Spread};
use pliant_mechanics::model::{Constraint, Motion};
use pliant_shells::facet_packs::{FacetPack, Work};
use pliant_shells::rotation::skew;
use pliant_shells::{Broken, EdgeRule, Facet, Matrix18, Patch, Vector18, symmetrise};
use pulp::Arch;
use rayon::prelude::*;

use super::followers::Followers;
use super::gathering::{ColumnSums, Corners, NodeSums};
use super::stiffness::Stiffness;
use super::{FACETS, Sums};
use crate::curved::surface::CurvedSurface;
use crate::model::assembly::Assembly;
use crate::model::error::SolveError;
use crate::model::state::AssemblyState;

/// Data of facets besides the model.
pub(crate) struct Facets {
    /// Packs of facets at rest.
    packs: Vec<FacetPack>,
    /// The instructions of the processor.
    arch: Arch,
    pub(super) pressure: Vec<Pressure>,
    /// The curved surface, if a load acts on it.
    pub(super) surface: Option<CurvedSurface>,
    /// True if the stiffness has the change of pressures on the curved surface. Otherwise it has the change
    /// on the flat facets. Conjugate gradients then converge more often, and Newton's method converges
    /// slowly.
    pub(crate) exact_pressure: bool,
    /// Places in the matrix.
    places: Vec<Vec<u32>>,
    /// Flags of facets with nodes that follow others.
    bound: Vec<bool>,
    /// Corners of each chunk.
    corners: Vec<Corners>,
    /// Results of the current chunk of facets, and of the previous chunk while its nodes take them up.
    results: [ChunkResults; 2],
}

impl Facets {
    pub(super) fn new(model: &Assembly) -> Self {
        let arch = Arch::new();
        Self {
            packs: FacetPack::packed(arch, &model.facets, |node| model.place(node as usize)),
            arch,
            pressure: vec![Pressure::default(); model.facets.len()],
            surface: needs_surface(model).then(|| CurvedSurface::new(model, EdgeRule::Arc)),
            exact_pressure: true,
            places: Vec::new(),
            bound: Vec::new(),
            corners: model.facets.chunks(FACETS).map(corners_of).collect(),
            // The second only where there is a second chunk.
            results: [0, FACETS]
                .map(|first| ChunkResults::new(FACETS.min(model.facets.len().saturating_sub(first)))),
        }
    }

    /// Takes the places of facets.
    pub(super) fn take_places(
        &mut self,
        model: &Assembly,
        followers: Option<&Followers>,
        places: impl Fn(&[u32]) -> Vec<u32>,
    ) {
        let follows = |followers: &Followers, facet: &Facet| followers.expanded(&facet.nodes, true).is_some();
        let is_bound = |facet: &Facet| followers.is_some_and(|followers| follows(followers, facet));
        self.places = model.facets.iter().map(|facet| places(&facet.nodes)).collect();
        self.bound = model.facets.iter().map(is_bound).collect();
    }

    /// The places of one.
    pub(super) fn places_of(&self, facet: u32) -> &[u32] {
        &self.places[facet as usize]
    }

    /// True if a pressure acts on the curved surface.
    pub(super) fn are_pressed(&self) -> bool {
        self.pressure.iter().any(|pressure| pressure.curved != [0.0; 2])
    }

    /// Adds forces and, with prescribed increments, the stiffness. The nodes of a chunk of facets take it up
    /// while the next one is found, so that threads seldom wait for each other.
    pub(super) fn add(
        &mut self,
        model: &Assembly,
        state: &AssemblyState,
        moved: Option<&[f64]>,
        sums: &mut Sums<'_>,
    ) -> Result<(), SolveError> {
        let Self { packs, arch, pressure, surface, exact_pressure, places, bound, corners, results } = self;
        let (symmetric, tangent) = (sums.stiffness.is_symmetric(), moved.is_some());
        let wanted = Wanted { tangent, symmetric, exact_pressure: *exact_pressure };
        let finding =
            Finding { model, state, wanted, packs, arch: *arch, pressure, surface: surface.as_ref() };
        let coupled = moved.filter(|moved| moved.iter().any(|&by| by != 0.0));
        let gathering = Gathering { model, tangent, moved: coupled, pressure, places, bound };
        let [mut now, mut next] = results.each_mut();
        let count = model.facets.len();
        finding.find(0, now);
        for first in (0..count).step_by(FACETS) {
            let heads = &now.heads[..FACETS.min(count - first)];
            if let Some((cell, why)) =
                (first..).zip(heads).find_map(|(cell, head)| Some((cell, head.broken?)))
            {
                return Err(SolveError::Broken { cell, why });
            }
            for head in heads {
                sums.forces.energy += head.energy;
                sums.forces.largest = sums.forces.largest.max(head.largest);
            }
            rayon::join(
                || gathering.gather((first, &corners[first / FACETS]), &now.results, sums),
                || finding.find(first + FACETS, next),
            );
            if let Some(moved) = moved {
                gathering.add_bound(first, &now.results, moved, sums);
            }
            std::mem::swap(&mut now, &mut next);
        }
        Ok(())
    }
}

/// Inputs for the forces of facets.
struct Finding<'a> {
    model: &'a Assembly,
    state: &'a AssemblyState,
    wanted: Wanted,
    packs: &'a [FacetPack],
    arch: Arch,
    pressure: &'a [Pressure],
    surface: Option<&'a CurvedSurface>,
}

impl Finding<'_> {
    /// Finds forces of the facets from one on, at most a chunk, and their stiffness if it is wanted.
    fn find(&self, first: usize, found: &mut ChunkResults) {
        let Self { state, wanted, .. } = *self;
        let facets = self.model.facets.get(first..).unwrap_or_default();
        let heads = found.heads.par_chunks_mut(PACK).zip(found.results.par_chunks_mut(PACK));
        let packs = heads.zip(facets.par_chunks(PACK)).enumerate().with_min_len(2);
        packs.for_each_init(Work::new, |work, (at, ((heads, results), facets))| {
            let from = first + at * PACK;
            for (lane, facet) in facets.iter().enumerate() {
                let (x, rotation) = state.corners(facet.nodes);
                work.put(lane, &x, &rotation);
            }
            work.find(self.arch, &self.packs[from / PACK], facets.len(), wanted.tangent);
            take(work, wanted, heads, results);
            for ((number, facet), (head, result)) in (from..).zip(facets).zip(heads.iter().zip(results)) {
                let pressure = self.pressure[number];
                if pressure != Pressure::default() && head.broken.is_none() {
                    let patch =
                        || self.surface.map(|surface| surface.patch(self.model, state, number as u32));
                    let (x, _) = state.corners(facet.nodes);
                    result.press(&x, pressure, patch, state.load_factor, wanted);
                }
            }
        });
    }
}

/// Addition of the results of facets.
struct Gathering<'a> {
    model: &'a Assembly,
    /// True if the stiffness is added, too.
    tangent: bool,
    /// Prescribed increments, where there are some.
    moved: Option<&'a [f64]>,
    pressure: &'a [Pressure],
    places: &'a [Vec<u32>],
    bound: &'a [bool],
}

impl Gathering<'_> {
    /// Adds forces of a chunk of facets. If wanted, it adds the stiffness of facets whose nodes follow no
    /// others, and its product with prescribed motions.
    fn gather(&self, (first, corners): (usize, &Corners), results: &[FacetResult], sums: &mut Sums<'_>) {
        let Stiffness { equations, matrix, coupling, .. } = &mut *sums.stiffness;
        let equations = &*equations;
        let stiffness = self.tangent.then(|| {
            let (values, column_start) = matrix.values();
            ColumnSums { first: 0, coupling, values, column_start }
        });
        let forces = sums.forces.kinds();
        let (facets, pressure) = (&self.model.facets[first..], &self.pressure[first..]);
        let take = |node: u32, corners: &[u32], sums: &mut NodeSums<'_>| {
            for &corner in corners {
                let (at, corner) = (corner as usize / 3, corner as usize % 3);
                let (result, facet) = (&results[at], &facets[at]);
                result.add_forces(
                    corner,
                    pressure[at] != Pressure::default(),
                    node - sums.first,
                    &mut sums.forces,
                );
                let Some(sums) = sums.stiffness.as_mut().filter(|_| !self.bound[first + at]) else {
                    continue;
                };
                let (places, entries) = (&self.places[first + at][..], result.tangent.as_slice());
                let cell = Cell { nodes: &facet.nodes, components: 6, places, entries };
                sums.values.add(equations, &cell, corner);
                if let Some(moved) = self.moved {
                    result.couple(facet, corner, moved, equations, sums);
                }
            }
        };
        corners.visit(equations, NodeSums { first: 0, forces, stiffness }, &take);
    }

    /// Adds the stiffness of those facets of a chunk whose nodes follow others.
    fn add_bound(&self, first: usize, results: &[FacetResult], moved: &[f64], sums: &mut Sums<'_>) {
        let Some(followers) = sums.followers else { return };
        for (number, result) in (first..self.model.facets.len()).zip(results) {
            if !self.bound[number] {
                continue;
            }
            let nodes = &self.model.facets[number].nodes;
            let Some(expanded) = followers.expanded(nodes, true) else { continue };
            let whole = followers.condensed(nodes, 6, &expanded, result.tangent.as_slice());
            sums.stiffness.add_block((&expanded.0, expanded.1), &self.places[number], &whole, moved);
        }
    }
}

/// True if something acts on the curved surface of shells.
fn needs_surface(model: &Assembly) -> bool {
    let loads = |load: &Load| {
        let curved = matches!(load.kind, LoadKind::ShellPressure { spread: Spread::Curved, .. });
        curved || load.surface.is_some_and(|surface| model.carried.contains_key(&surface))
    };
    let encloses = |constraint: &Constraint| matches!(&constraint.motion, Motion::Volume { enclosure, .. } if !enclosure.facets.is_empty());
    model.loads.iter().any(loads) || model.constraints.iter().any(encloses)
}

/// Pressures on a facet [Pa], each fixed and controlled.
#[derive(Clone, Copy, Default, PartialEq)]
pub(super) struct Pressure {
    pub(super) lumped: [f64; 2],
    pub(super) curved: [f64; 2],
}

/// Results of the facets of a chunk.
#[derive(Default)]
struct ChunkResults {
    /// Kept apart from the results, because one thread looks at all heads.
    heads: Vec<FacetHead>,
    results: Vec<FacetResult>,
}

#[derive(Clone, Copy, Default)]
struct FacetHead {
    energy: f64,
    /// Largest force on a node [N].
    largest: f64,
    broken: Option<Broken>,
}

#[derive(Clone)]
struct FacetResult {
    force: Vector18,
    /// Loads from the fixed and the controlled pressures.
    loads: [Vector18; 2],
    tangent: Matrix18,
}

/// The corners of facets by nodes.
fn corners_of(facets: &[Facet]) -> Corners {
    Corners::of(facets.iter().map(|facet| facet.nodes))
}

/// A third of the area times the normal on each corner, as six numbers a node [m²].
fn flat_forces([a, b, c]: &[Vector3<f64>; 3]) -> Vector18 {
    let third = (b - a).cross(&(c - a)) / 6.0;
    Vector18::from_fn(|i, _| if i % 6 < 3 { third[i % 6] } else { 0.0 })
}

/// Wanted results of facets.
#[derive(Clone, Copy)]
struct Wanted {
    /// True if their stiffness is wanted, too.
    tangent: bool,
    /// True if only the symmetric part of the stiffness is wanted.
    symmetric: bool,
    /// True for the change of pressures on the curved surface, false for the change on the flat facets.
    exact_pressure: bool,
}

impl ChunkResults {
    /// With room for some facets.
    fn new(facets: usize) -> Self {
        Self { heads: vec![FacetHead::default(); facets], results: vec![FacetResult::none(); facets] }
    }
}

impl FacetResult {
    fn none() -> Self {
        let loads = [Vector18::zeros(); 2];
        let (force, tangent) = (Vector18::zeros(), Matrix18::zeros());
        Self { force, loads, tangent }
    }

    /// Adds what a corner is given to the sums of a node, a number of nodes after the first.
    fn add_forces(
        &self,
        corner: usize,
        pressed: bool,
        node: u32,
        [internal, fixed, controlled]: &mut [&mut [f64]; 3],
    ) {
        let (from, to) = (6 * corner, 6 * node as usize);
        let add = |sums: &mut [f64], forces: &Vector18| {
            let forces = &forces.as_slice()[from..from + 6];
            sums[to..to + 6].iter_mut().zip(forces).for_each(|(sum, force)| *sum += force);
        };
        add(internal, &self.force);
        if pressed {
            add(fixed, &self.loads[0]);
            add(controlled, &self.loads[1]);
        }
    }

    /// Adds what prescribed increments, six a node, make of the forces on a corner.
    fn couple(
        &self,
        facet: &Facet,
        corner: usize,
        moved: &[f64],
        equations: &Equations,
        ColumnSums { first, coupling, .. }: &mut ColumnSums<'_>,
    ) {
        let rows = &equations.number[6 * facet.nodes[corner] as usize..][..6];
        for (j, column) in self.tangent.column_iter().enumerate() {
            let by = moved[6 * facet.nodes[j / 6] as usize + j % 6];
            if by == 0.0 {
                continue;
            }
            for (c, &row) in rows.iter().enumerate().filter(|(_, row)| **row != NONE) {
                coupling[row as usize - *first] += column[6 * corner + c] * by;
            }
        }
    }

    /// Takes up the pressures.
    fn press(
        &mut self,
        x: &[Vector3<f64>; 3],
        Pressure { lumped, curved }: Pressure,
        patch: impl Fn() -> Option<Patch>,
        factor: f64,
        wanted: Wanted,
    ) {
        let whole = |[fixed, controlled]: [f64; 2]| fixed + factor * controlled;
        let flat = flat_forces(x);
        self.loads = lumped.map(|pressure| flat * pressure);
        let mut follows = whole(lumped);
        if let Some(patch) = (curved != [0.0; 2]).then(patch).flatten() {
            let forces = patch.pressure_forces();
            for (load, pressure) in self.loads.iter_mut().zip(curved) {
                *load += forces * pressure;
            }
            if wanted.tangent && wanted.exact_pressure {
                let mut change = patch.pressure_change() * whole(curved);
                if wanted.symmetric {
                    symmetrise(&mut change);
                }
                self.tangent -= change;
            } else {
                follows += whole(curved);
            }
        }
        if wanted.tangent && follows != 0.0 {
            follow(&mut self.tangent, x, follows, wanted.symmetric);
        }
    }
}

/// Takes what was found of each lane.
fn take(work: &Work, wanted: Wanted, heads: &mut [FacetHead], results: &mut [FacetResult]) {
    for (lane, (head, result)) in heads.iter_mut().zip(results).enumerate() {
        let energy;
        (energy, result.force) = work.force(lane);
        let forces = result.force.iter().enumerate().filter(|(i, _)| i % 6 < 3);
        let largest = forces.fold(0.0, |largest: f64, (_, force)| largest.max(force.abs()));
        *head = FacetHead { energy, largest, broken: work.broken(lane) };
        if wanted.tangent {
            work.take_tangent(lane, &mut result.tangent);
        }
    }
}

/// Takes from a stiffness how p A n/3 changes with the corners, or the symmetric part of that.
fn follow(k: &mut Matrix18, x: &[Vector3<f64>; 3], pressure: f64, symmetric: bool) {
    let opposite = [0, 1, 2].map(|j| (x[(j + 2) % 3] - x[(j + 1) % 3]) * (pressure / 6.0));
    for (i, j) in (0..3).flat_map(|j| (0..3).map(move |i| (i, j))) {
        // Of a block S(a) and its mirror S(b)ᵀ = −S(b) the mean.
        let axial = if symmetric { (opposite[j] - opposite[i]) * 0.5 } else { opposite[j] };
        let mut block = k.fixed_view_mut::<3, 3>(6 * i, 6 * j);
        block -= skew(&axial);
    }
}
