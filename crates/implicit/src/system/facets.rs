//! Forces and stiffness of facets, packs of eight in parallel, added node by node in their order.

use super::{FACETS, System};
use crate::model::error::SolveError;
use crate::model::state::State;
use crate::system::gathering::{ColumnSums, Corners, NodeSums};
use nalgebra::Vector3;
use pliant_linear::lanes::PACK;
use pliant_linear::sparse::{Cell, Equations, LowerMatrix, NONE};
use pliant_shells::Patch;
use pliant_shells::Vector18;
use pliant_shells::facet_packs::Work;
use pliant_shells::rotation::skew;
use pliant_shells::{Broken, Facet, Matrix18, symmetrise};
use rayon::prelude::*;
use std::sync::Arc;

impl System {
    pub(super) fn evaluate_facets(&mut self, state: &State, moved: Option<&[f64]>) -> Result<(), SolveError> {
        let [mut now, mut next] = std::mem::take(&mut self.results);
        let found = self.evaluate_chunks(state, moved, [&mut now, &mut next]);
        self.results = [now, next];
        found
    }

    /// The nodes of a chunk of facets take it up while the next one is found, so that threads seldom wait for each other.
    pub(super) fn evaluate_chunks(
        &mut self,
        state: &State,
        moved: Option<&[f64]>,
        [mut now, mut next]: [&mut ChunkResults; 2],
    ) -> Result<(), SolveError> {
        let symmetric = self.matrix.mirror.is_empty();
        let tangent = moved.is_some();
        let wanted = Wanted { tangent, symmetric, exact_pressure: self.exact_pressure };
        let coupled = moved.filter(|moved| moved.iter().any(|&by| by != 0.0));
        let count = self.model.facets.len();
        self.find_facets(0, state, wanted, now);
        for first in (0..count).step_by(FACETS) {
            let heads = &now.heads[..FACETS.min(count - first)];
            if let Some((cell, why)) =
                (first..).zip(heads).find_map(|(cell, head)| Some((cell, head.broken?)))
            {
                return Err(SolveError::Broken { cell, why });
            }
            for head in heads {
                self.energy += head.energy;
                self.largest = self.largest.max(head.largest);
            }
            let mut sums = self.lend_sums();
            rayon::join(
                || self.gather_facets(first / FACETS, &now.results, tangent, coupled, &mut sums),
                || self.find_facets(first + FACETS, state, wanted, next),
            );
            self.take_back(sums);
            self.add_bound_facets(first, &now.results, moved);
            std::mem::swap(&mut now, &mut next);
        }
        Ok(())
    }

    pub(super) fn lend_sums(&mut self) -> FacetSums {
        let forces = [&mut self.internal, &mut self.external, &mut self.controlled];
        FacetSums {
            matrix: std::mem::take(&mut self.matrix),
            coupling: std::mem::take(&mut self.coupling),
            forces: forces.map(std::mem::take),
        }
    }

    pub(super) fn take_back(&mut self, FacetSums { matrix, coupling, forces }: FacetSums) {
        (self.matrix, self.coupling) = (matrix, coupling);
        [self.internal, self.external, self.controlled] = forces;
    }

    /// Finds forces of the facets from one on, at most a chunk, and their stiffness if it is wanted.
    pub(super) fn find_facets(&self, first: usize, state: &State, wanted: Wanted, found: &mut ChunkResults) {
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
                    let patch = || {
                        self.surface.as_ref().map(|surface| surface.patch(&self.model, state, number as u32))
                    };
                    let (x, _) = state.corners(facet.nodes);
                    result.press(&x, pressure, patch, state.load_factor, wanted);
                }
            }
        });
    }

    /// Adds forces of a chunk of facets and, if it is wanted, the stiffness of those whose nodes follow no others; with what it makes of
    /// prescribed motions.
    pub(super) fn gather_facets(
        &self,
        chunk: usize,
        results: &[FacetResult],
        tangent: bool,
        moved: Option<&[f64]>,
        FacetSums { matrix, coupling, forces }: &mut FacetSums,
    ) {
        let stiffness = tangent.then(|| {
            let (values, column_start) = matrix.values();
            ColumnSums { first: 0, coupling, values, column_start }
        });
        let forces = forces.each_mut().map(|own| &mut own[..]);
        let (first, equations) = (chunk * FACETS, &self.equations);
        let (facets, pressure) = (&self.model.facets[first..], &self.pressure[first..]);
        let (places, bound) = (&self.places, &self.bound);
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
                let Some(sums) = sums.stiffness.as_mut().filter(|_| !bound[first + at]) else { continue };
                let entries = result.tangent.as_slice();
                let cell = Cell { nodes: &facet.nodes, components: 6, places: &places[first + at], entries };
                sums.values.add(equations, &cell, corner);
                if let Some(moved) = moved {
                    result.couple(facet, corner, moved, equations, sums);
                }
            }
        };
        self.corners[chunk].visit(equations, NodeSums { first: 0, forces, stiffness }, &take);
    }

    /// Adds the stiffness of those facets of a chunk whose nodes follow others.
    pub(super) fn add_bound_facets(&mut self, first: usize, results: &[FacetResult], moved: Option<&[f64]>) {
        let model = Arc::clone(&self.model);
        let Some(moved) = moved else { return };
        for (number, result) in (first..model.facets.len()).zip(results) {
            if !self.bound[number] {
                continue;
            }
            let nodes = &model.facets[number].nodes;
            let Some(followers) = &self.followers else { continue };
            let Some(expanded) = followers.expanded(nodes, true) else { continue };
            let whole = followers.condensed(nodes, 6, &expanded, result.tangent.as_slice());
            let places = std::mem::take(&mut self.places[number]);
            self.add_block(&expanded.0, expanded.1, &places, &whole, moved);
            self.places[number] = places;
        }
    }
}

/// Pressures on a facet [Pa], each fixed and controlled.
#[derive(Clone, Copy, Default, PartialEq)]
pub(super) struct Pressure {
    pub(super) lumped: [f64; 2],
    pub(super) curved: [f64; 2],
}

/// What is found of the facets of a chunk.
#[derive(Default)]
pub(super) struct ChunkResults {
    /// Apart from the rest: one thread looks at all of them.
    pub(super) heads: Vec<FacetHead>,
    pub(super) results: Vec<FacetResult>,
}

#[derive(Clone, Copy, Default)]
pub(super) struct FacetHead {
    pub(super) energy: f64,
    /// Largest force on a node [N].
    pub(super) largest: f64,
    pub(super) broken: Option<Broken>,
}

#[derive(Clone)]
pub(super) struct FacetResult {
    pub(super) force: Vector18,
    /// What the fixed and the controlled pressures make.
    pub(super) loads: [Vector18; 2],
    pub(super) tangent: Matrix18,
}

/// What facets are added to.
pub(super) struct FacetSums {
    pub(super) matrix: LowerMatrix,
    pub(super) coupling: Vec<f64>,
    /// Internal forces, and fixed and controlled loads.
    pub(super) forces: [Vec<f64>; 3],
}

/// The corners of facets by nodes.
pub(super) fn corners_of(facets: &[Facet]) -> Corners {
    Corners::of(facets.iter().map(|facet| facet.nodes))
}

/// A third of the area times the normal on each corner, as six numbers a node [m²].
pub(super) fn flat_forces([a, b, c]: &[Vector3<f64>; 3]) -> Vector18 {
    let third = (b - a).cross(&(c - a)) / 6.0;
    Vector18::from_fn(|i, _| if i % 6 < 3 { third[i % 6] } else { 0.0 })
}

/// What is wanted of facets.
#[derive(Clone, Copy)]
pub(super) struct Wanted {
    /// Whether their stiffness, too.
    pub(super) tangent: bool,
    /// Whether only the symmetric part of it.
    pub(super) symmetric: bool,
    /// Whether the change of pressures on the curved surface is that of the flat facets.
    pub(super) exact_pressure: bool,
}

impl ChunkResults {
    /// With room for some facets.
    pub(super) fn new(facets: usize) -> Self {
        Self { heads: vec![FacetHead::default(); facets], results: vec![FacetResult::none(); facets] }
    }
}

impl FacetResult {
    pub(super) fn none() -> Self {
        let loads = [Vector18::zeros(); 2];
        let (force, tangent) = (Vector18::zeros(), Matrix18::zeros());
        Self { force, loads, tangent }
    }

    /// Adds what a corner is given to the sums of a node, a number of nodes after the first.
    pub(super) fn add_forces(
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
    pub(super) fn couple(
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
    pub(super) fn press(
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
pub(super) fn take(work: &Work, wanted: Wanted, heads: &mut [FacetHead], results: &mut [FacetResult]) {
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
pub(super) fn follow(k: &mut Matrix18, x: &[Vector3<f64>; 3], pressure: f64, symmetric: bool) {
    let opposite = [0, 1, 2].map(|j| (x[(j + 2) % 3] - x[(j + 1) % 3]) * (pressure / 6.0));
    for (i, j) in (0..3).flat_map(|j| (0..3).map(move |i| (i, j))) {
        // Of a block S(a) and its mirror S(b)ᵀ = −S(b) the mean.
        let own = if symmetric { (opposite[j] - opposite[i]) * 0.5 } else { opposite[j] };
        let mut block = k.fixed_view_mut::<3, 3>(6 * i, 6 * j);
        block -= skew(&own);
    }
}
