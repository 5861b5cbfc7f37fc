//! What a device found at an instant.

use pliant_explicit::{Deformed, State, Sums};
use pliant_mechanics::model::FREE;
use pliant_mechanics::tensor::Vector;

use super::{GpuStepper, force_kernels};
use crate::GpuError;
use crate::nodes::SUMS;
use crate::run::{Instant, UNLISTED};
use crate::transfer::Four;

impl GpuStepper {
    /// Evaluates an instant once candidates for contact are listed for it, with the forces of cells found anew or as they stand.
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
            self.list()?;
        }
    }

    /// Evaluates an instant, with the forces of cells found anew or as they stand.
    pub(super) fn submit_evaluation(
        &mut self,
        state: &State<f32>,
        flags: u32,
        anew: bool,
    ) -> Result<Results, GpuError> {
        let damping = self.damping_factors(state, self.lengths.before);
        let instant = Instant::new(self.since, flags, self.lengths, damping);
        self.instants.push((&self.model, &state.driven), state.time, self.lengths.next, instant);
        let (nodes, side, contacts) = (&self.kernels, self.side, &self.contacts);
        let forces = || force_kernels(&self.loads, &self.grips, &self.solids, &self.ties);
        self.instants.submit(&self.device, |pass, bound, _, offset| {
            let before = contacts.iter().filter_map(|contacts| contacts.before.as_ref());
            before.for_each(|kernel| kernel.run(pass, bound, offset, side));
            if anew {
                forces().for_each(|kernel| kernel.run(pass, bound, offset, side));
            }
            if let Some(contacts) = contacts {
                contacts.kernels.iter().for_each(|kernel| kernel.run(pass, bound, offset, side));
                contacts.sum.run(pass, bound, offset, side);
            }
            nodes.pass.run(pass, bound, offset, side);
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
        arrays.extend(self.contacts.iter().map(|own| (&own.sums, bytes(self.contact_forces.len() * 4))));
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
        if self.since > 1 && !self.entered {
            let [internal, external, power] = results.passed;
            state.work.pass_over(internal, external, power, step);
        }
        self.entered = true;
    }

    pub(super) fn enter_reactions(&mut self, forces: &[Four]) {
        self.held_reactions.copy_from_slice(forces);
        for (sum, owned) in self.reactions.iter_mut().zip(&self.owned) {
            *sum = [0.0; 3];
            for &(hold, owns) in owned {
                for c in (0..3).filter(|&c| owns[c]) {
                    sum[c] += f64::from(forces[hold as usize][c]);
                }
            }
        }
    }

    /// ½ Σ m v² of the velocities given at the start [J].
    pub(super) fn kinetic_at_start(&self) -> f64 {
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
