//! Implementation of [`Participant`] for assembled bodies.

use pliant_contact::pose::Leg;
use pliant_explicit::{Clock, Wanted};
use pliant_mechanics::grip::{Grip, ROOM};
use pliant_mechanics::mapping::Mapping;
use pliant_mechanics::tensor::Vector;
use pliant_mechanics::{StopFlag, fingerprint};

use super::*;
use crate::failure::Failure;
use crate::participant::Participant;
use crate::snapshot::Snapshot;
use crate::solver::LoadStepProgress;

impl Participant for Assembled {
    fn evaluate(&mut self, _wanted: Wanted) -> Result<(), Failure> {
        if self.evaluated {
            return Ok(());
        }
        self.put_springs();
        if self.contact.is_none() {
            self.contact = self.method.contact_mut().map(|system| system.at(&self.state));
        }
        if let (Some(now), SolverMethod::Static(_, forces) | SolverMethod::Implicit(_, forces)) =
            (&self.contact, &mut self.method)
        {
            forces.touch(&now.forces);
        }
        let found = self.method.evaluate(&self.state);
        found.map_err(|error| failure(&error, &self.model, &self.bodies, self.time))?;
        self.find_energies();
        self.find_reactions();
        if let Some(solids) = &mut self.solids {
            let places = self.bodies.model.places();
            for (displacement, (now, rest)) in
                solids.displacement.iter_mut().zip(self.state.position.iter().zip(places))
            {
                *displacement = (now - rest).into();
            }
            for ((history, solid), tensors) in
                solids.history.iter_mut().zip(&self.model.solids).zip(&self.state.history.tensors)
            {
                let slots = tensors.len() / solid.cells.len();
                for (cell, tensors) in tensors.chunks_exact(slots.max(1)).enumerate() {
                    history.set_cell(cell, tensors);
                }
            }
        }
        (self.evaluated, self.entered) = (true, true);
        Ok(())
    }

    fn advance(&mut self, steps: u64, _watch: &mut dyn FnMut(LoadStepProgress)) -> Result<(), Failure> {
        debug_assert!(steps <= self.stride(), "{steps} steps in one go");
        self.put_springs();
        #[cfg(feature = "gpu")]
        if self.device.is_some() {
            return self.advance_with_device(steps);
        }
        self.advance_on_processor()
    }

    /// A grip pulls by where its nodes are at each step.
    #[cfg(feature = "gpu")]
    fn stride(&self) -> u64 {
        if self.device.is_some() && self.grips.is_empty() { STRIDE } else { 1 }
    }

    fn grip(&mut self, grips: &[Grip]) -> bool {
        self.grips.clear();
        self.grips.extend_from_slice(grips);
        self.evaluated = false;
        true
    }

    fn push(&mut self, forces: &[Vector<f64>]) {
        let acting = (0..).zip(forces.iter().copied()).filter(|(_, force)| *force != [0.0; 3]);
        let acting: Vec<_> = acting.collect();
        self.method.act(|forces| forces.push(&acting), |solver| solver.push(&acting));
        #[cfg(feature = "gpu")]
        if let Some(device) = &mut self.device {
            device.pushed = acting;
        }
        self.evaluated = false;
    }

    fn drive(&mut self, rigid: usize, leg: Leg) {
        if let Some(system) = self.method.contact_mut() {
            system.legs_mut().insert(rigid as u32, leg);
        }
    }

    /// Returns the stiffness limit of a grip. Explicit steps of 0.9 of the stable step stay stable up to it,
    /// as for solids. Implicit and static steps are always stable, and with this limit their equations stay
    /// well conditioned.
    fn stiffest(&self, grip: &Grip) -> f64 {
        if !matches!(self.method, SolverMethod::Explicit(_)) {
            return FIRM * self.bodies.model.stiffest();
        }
        let mass = |&(node, weight): &(u32, f64)| self.bodies.model.mass[node as usize] / weight;
        let lightest = grip.nodes.iter().map(mass).fold(f64::INFINITY, f64::min);
        ROOM * 4.0 * lightest / (self.steps.step * self.steps.step)
    }

    fn last_velocity(&self, node: usize) -> [f64; 3] {
        self.state.velocity[node].into()
    }

    fn pulled(&self, grip: &Grip) -> [[f64; 3]; 2] {
        [grip.position(&self.state, 0), grip.force(&self.state)]
    }

    /// True if the participant can go back to a snapshot. Effort spent since then counts.
    fn goes_back_to(&self, snapshot: &Snapshot) -> bool {
        // Contacts at the start are unknown before their first evaluation.
        matches!(snapshot, Snapshot::Implicit(state) if state.contact.is_some() || self.method.contact().is_none())
    }

    fn go_back(&mut self, snapshot: &Snapshot, _steps: Option<(Clock, f64)>) -> Result<(), Failure> {
        let Snapshot::Implicit(state) = snapshot else { return Ok(()) };
        let spent = (self.effort.clone(), self.effort_before.clone());
        let convergence = std::mem::take(&mut self.convergence);
        self.resume((**state).clone())?;
        (self.effort, self.effort_before) = spent;
        self.convergence = convergence;
        Ok(())
    }

    fn stop_on(&mut self, flag: &StopFlag) {
        if let Some(solver) = self.method.equations_mut() {
            solver.stop_on(flag);
        }
    }

    fn snapshot(&self) -> Snapshot {
        Snapshot::Implicit(Box::new(self.implicit_state()))
    }

    fn add_log(&self, snapshot: &mut Snapshot) {
        if let Snapshot::Implicit(state) = snapshot {
            state.convergence.clone_from(&self.convergence);
        }
    }

    fn cut_log(&mut self) {
        let done = self.done;
        self.convergence.retain(|row| row.step <= done);
    }

    fn fingerprint(&self) -> u64 {
        let bits = |numbers: &[f64]| -> Vec<u64> { numbers.iter().map(|x| x.to_bits()).collect() };
        let positions = self.state.position.iter().flat_map(|x| bits(x.as_slice()));
        let rotations = self.state.rotation.iter().flat_map(|q| bits(q.coords.as_slice()));
        fingerprint(&(positions.collect::<Vec<_>>(), rotations.collect::<Vec<_>>()))
    }

    /// A static state stands at the last equilibrium found, which may lie within the step that failed.
    fn keeps_what_it_found(&mut self) -> bool {
        let is_static = matches!(self.method, SolverMethod::Static(..));
        if is_static && self.state.time > self.time {
            self.time = self.state.time;
            // Contacts restart without friction: the friction of the part of the step that was found is
            // unknown.
            self.contact = None;
            (self.evaluated, self.entered) = (false, false);
        }
        is_static
    }
}
