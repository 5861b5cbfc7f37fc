//! Findings of a device at an instant.

use pliant_explicit::recover::stored_at_start;
use pliant_explicit::{Deformed, State, Sums};
use pliant_mechanics::Energies;
use pliant_mechanics::model::{FREE, Model};
use pliant_mechanics::tensor::Vector;

use super::GpuStepper;
use super::stage::Stage;
use crate::GpuError;
use crate::nodes::{DeviceNodes, SUMS};
use crate::run::{Instant, UNLISTED};
use crate::transfer::Four;

impl GpuStepper {
    /// Evaluates an instant once candidates for contact are listed for it, with the forces of cells found
    /// anew or as they stand.
    pub(super) fn evaluate_listed(
        &mut self,
        state: &State<f32>,
        flags: u32,
        anew: bool,
    ) -> Result<Results, GpuError> {
        loop {
            let results = self.submit_evaluation(state, flags, anew)?;
            if results.unlisted.is_none() {
                return Ok(results);
            }
            self.list(self.stage.side())?;
        }
    }

    /// Evaluates an instant, with the forces of cells found anew or as they stand.
    fn submit_evaluation(&mut self, state: &State<f32>, flags: u32, anew: bool) -> Result<Results, GpuError> {
        let damping = self.damping_factors(state, self.lengths.before);
        let instant = Instant::new(self.stage.instants(), flags, self.lengths, damping);
        self.instants.push((&self.model, &state.driven), state.time, self.lengths.next, instant);
        let (forces, kernels, side) = (&self.forces, &self.kernels, self.stage.side());
        let sum = forces.contacts.as_ref().map(|contacts| &contacts.sum);
        self.instants.submit(&self.device, |pass, bound, _, offset| {
            let sequence = forces.kernels(anew).chain(sum).chain([&kernels.pass]);
            sequence.for_each(|kernel| kernel.run(pass, bound, offset, side));
        });
        self.results()
    }

    /// Reads what the last evaluation and the instants before it found.
    pub(super) fn results(&mut self) -> Result<Results, GpuError> {
        let (nodes, findings) = (&self.nodes, &self.instants.findings);
        let bytes = |count: usize| (count * size_of::<f32>()) as u64;
        let mut arrays = vec![
            (&nodes.sums, bytes(nodes.groups * SUMS)),
            (findings, bytes(UNLISTED + 1)),
            (&nodes.reactions, bytes(nodes.held.len() * 4)),
        ];
        let touching = bytes(self.readings.contact_forces.len() * 4);
        arrays.extend(self.forces.contacts.iter().map(|contacts| (&contacts.sums, touching)));
        let mut read = None;
        self.transfer.read_all(&self.device, &arrays, |parts| {
            let mut sums = [0.0; SUMS];
            for group in bytemuck::cast_slice::<u8, [f32; SUMS]>(parts[0]) {
                sums.iter_mut().zip(group).for_each(|(sum, &number)| *sum += f64::from(number));
            }
            let found: &[u32] = bytemuck::cast_slice(parts[1]);
            read = Some((
                sums,
                [found[0], found[1], found[2], found[3], found[UNLISTED]],
                bytemuck::cast_slice(parts[2]).to_vec(),
                parts.get(3).map_or_else(Vec::new, |forces| bytemuck::cast_slice(forces).to_vec()),
            ));
        })?;
        let (sums, [broken, overflown, least, largest, unlisted], reactions, contact_forces) =
            read.unwrap_or_default();
        Ok(Results {
            sums: Sums {
                kinetic: sums[0],
                damping_power: sums[1],
                internal_before: sums[2],
                internal_after: sums[3],
                external_before: sums[4],
                external_after: sums[5],
            },
            hourglass: sums[6],
            error: sums[7],
            passed: [sums[8], sums[9], sums[10]],
            broken: (broken != u32::MAX).then_some(broken),
            overflown: (overflown != u32::MAX).then_some(overflown),
            unlisted: (unlisted != u32::MAX).then_some(unlisted),
            deformed: Deformed {
                least_volume_ratio: f64::from(f32::from_bits(least)),
                largest_strain: f64::from(f32::from_bits(largest)),
            },
            reactions,
            contact_forces,
        })
    }

    /// Enters the work of the instants passed over, `step` seconds from one to the next, once.
    pub(super) fn enter_passed(&mut self, state: &mut State<f32>, results: &Results, step: f64) {
        let Stage::Evaluated(progress) = &mut self.stage else { return };
        if progress.instants > 1 && !progress.entered {
            let [internal, external, power] = results.passed;
            state.work.pass_over(internal, external, power, step);
        }
        progress.entered = true;
    }

    /// Settles the energies of an instant and keeps the forces found there. `shock` is the error of the step
    /// [J] before its length changed.
    pub(super) fn settle(&mut self, state: &mut State<f32>, results: &Results, shock: f64) {
        let at_start = state.is_at_start();
        if at_start {
            let stored = stored_at_start(&self.model, state, results.hourglass);
            state.work.begin(self.kinetic_at_start(), stored, shock);
        }
        let before = (!at_start).then_some(self.lengths.before);
        let again = std::mem::replace(&mut state.evaluated, true);
        let change = self.lengths.change_energy(results.error);
        let Results { sums, hourglass, .. } = results;
        self.readings.energies =
            state.work.settle(sums, *hourglass, change, before, self.balance_floor, again);
        self.readings.keep_forces(results);
    }

    /// ½ Σ m v² of the velocities given at the start [J].
    fn kinetic_at_start(&self) -> f64 {
        let of_node = |(node, velocity): (usize, &Vector<f64>)| {
            let square: f64 =
                (0..3).filter(|&c| self.owners[node][c] == FREE).map(|c| velocity[c] * velocity[c]).sum();
            0.5 * self.model.inertia(node) * square
        };
        self.model.initial_velocity.iter().take(self.nodes.count).enumerate().map(of_node).sum()
    }
}

/// The results of an evaluation.
pub(super) struct Results {
    pub(super) sums: Sums,
    pub(super) hourglass: f64,
    /// ⅛ Δt⁻² Σ m|a|² [J].
    pub(super) error: f64,
    /// Internal and external work and damping power of the instants passed over.
    pub(super) passed: [f64; 3],
    /// The first instant at which a cell is broken, and the first at which a force is out of range.
    pub(super) broken: Option<u32>,
    pub(super) overflown: Option<u32>,
    /// The first instant that waits for lists of candidates for contact.
    pub(super) unlisted: Option<u32>,
    pub(super) deformed: Deformed,
    pub(super) reactions: Vec<Four>,
    pub(super) contact_forces: Vec<Four>,
}

/// Numbers that were read back for observers.
pub(super) struct Readings {
    /// Energies at the last evaluated instant.
    pub(super) energies: Energies,
    /// Reaction [N] of each constraint there.
    pub(super) reactions: Vec<Vector<f64>>,
    /// Reaction [N] of each held node there.
    pub(super) held_reactions: Vec<Four>,
    /// Force [N] of each contact on its surface there.
    pub(super) contact_forces: Vec<Four>,
    /// Increment [m] of each node after the last instant that was read back whole.
    pub(super) next: Vec<Vector<f32>>,
    /// Places of the nodes of each constraint among the held nodes, and the components it owns.
    owned: Vec<Vec<(u32, [bool; 3])>>,
}

impl Readings {
    /// Zeros, with the owners of components and the number of contacts.
    pub(super) fn new(model: &Model, owners: &[[u32; 3]], nodes: &DeviceNodes, contacts: usize) -> Self {
        Self {
            energies: Energies::default(),
            reactions: vec![[0.0; 3]; model.constraints.len()],
            held_reactions: vec![Four::default(); nodes.held.len()],
            contact_forces: vec![Four::default(); contacts],
            next: vec![[0.0; 3]; nodes.count],
            owned: owned(model, owners, &nodes.held),
        }
    }

    /// Keeps the reactions and the forces of contacts.
    fn keep_forces(&mut self, results: &Results) {
        self.contact_forces.clone_from(&results.contact_forces);
        self.held_reactions.copy_from_slice(&results.reactions);
        for (sum, owned) in self.reactions.iter_mut().zip(&self.owned) {
            *sum = [0.0; 3];
            for &(hold, owns) in owned {
                for c in (0..3).filter(|&c| owns[c]) {
                    sum[c] += f64::from(results.reactions[hold as usize][c]);
                }
            }
        }
    }
}

/// Returns for each constraint the places of its nodes in `held`, and the components it owns.
fn owned(model: &Model, owners: &[[u32; 3]], held: &[u32]) -> Vec<Vec<(u32, [bool; 3])>> {
    let of_node = |index: u32, node: u32| {
        let owns = owners[node as usize].map(|owner| owner == index);
        held.binary_search(&node).ok().map(|hold| (hold as u32, owns))
    };
    (0..)
        .zip(&model.constraints)
        .map(|(index, constraint)| constraint.nodes.iter().filter_map(|&node| of_node(index, node)).collect())
        .collect()
}
