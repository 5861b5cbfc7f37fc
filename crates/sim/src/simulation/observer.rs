//! Observers of instants.

use pliant_explicit::Wanted;
use pliant_mechanics::Energies;
use pliant_mechanics::model::Enclosed;

use super::Simulation;
use crate::failure::Failure;
use crate::instant::Instant;
use crate::participant_setup::ParticipantSetup;
use crate::solver::LoadStepProgress;

/// Looks at a run ([`Simulation::observe`]) and changes nothing.
///
/// An observer that samples the height of a body every tenth of a second:
///
/// ```
/// use pliant_sim::{Failure, Observer, Schedule, Simulation};
///
/// struct Height {
///     schedule: Schedule,
///     samples: Vec<f64>,
/// }
///
/// impl Observer for Height {
///     fn stride(&self, simulation: &Simulation) -> u64 {
///         self.schedule.stride(simulation.time(), simulation.step_length())
///     }
///
///     fn see(&mut self, simulation: &Simulation, last: bool) -> Result<(), Failure> {
///         if self.schedule.is_due(simulation.time(), simulation.step_length(), last) {
///             self.samples.extend(simulation.instants().map(|now| now.displacement(3)[2]));
///         }
///         Ok(())
///     }
/// }
/// # use pliant_mechanics::Model;
/// # use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
/// # use pliant_mechanics::load::Load;
/// # use pliant_mechanics::model::{Cells, Material, Solid};
/// # let mut model = Model::default();
/// # let tet = model.add_body("tet", &[[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]]);
/// # let law = AnyLaw::NeoHookean(NeoHookean { shear: 1000.0, volumetric: Volumetric::quadratic(10_000.0) });
/// # let cells = Cells::tet4(vec![[0, 1, 2, 3]], &model.rest);
/// # model.add_solid(Solid::new(tet, Material::elastic(law, 1000.0), cells));
/// # model.fix("base", vec![0, 1, 2]);
/// # model.loads.push(Load::gravity(tet, [0.0, 0.0, -9.81]));
/// # let part = pliant_sim::ParticipantSetup::explicit("tet", model, 0.5)?;
///
/// let mut height = Height { schedule: Schedule::new(0.1), samples: Vec::new() };
/// Simulation::new(part)?.observe(0.5, &mut height)?;
/// assert_eq!(height.samples.len(), 6);
/// # Ok::<(), Failure>(())
/// ```
pub trait Observer {
    /// The most common steps from here that miss no instant it has to see; at least one.
    fn stride(&self, _simulation: &Simulation) -> u64 {
        1
    }

    /// Values that it reads at an instant, the last or not.
    fn wanted(&self, _simulation: &Simulation, _last: bool) -> Wanted {
        Wanted::Everything
    }

    /// Reads an instant whose forces are found.
    ///
    /// # Errors
    /// Whatever shall end the run.
    fn see(&mut self, simulation: &Simulation, last: bool) -> Result<(), Failure>;

    /// Follows a step, or one that was stopped before its end and not taken. Forces are not found yet.
    ///
    /// # Errors
    /// Whatever shall end the run.
    fn stepped(&mut self, _simulation: &mut Simulation, _last: bool) -> Result<(), Failure> {
        Ok(())
    }

    /// Follows a step that failed.
    fn step_failed(&mut self, _simulation: &mut Simulation) {}

    /// Hears how far a load step is.
    fn watch(&mut self, _progress: LoadStepProgress) {}
}

/// A simulation at an instant whose forces are found.
#[derive(Clone, Copy)]
pub struct Frame<'a> {
    pub(crate) simulation: &'a Simulation,
}

impl<'a> Frame<'a> {
    /// Time [s].
    pub fn time(&self) -> f64 {
        self.simulation.time()
    }

    /// The participants.
    pub fn parts(&self) -> impl Iterator<Item = (&'a ParticipantSetup, &'a dyn Instant)> {
        self.simulation.setup.parts.iter().zip(self.simulation.instants())
    }

    /// Energies of all participants together [J].
    pub fn energies(&self) -> Energies {
        self.simulation.energies()
    }

    /// Displacements [m] of the nodes of a body; `None` without a body of this name.
    pub fn displacements(&self, body: &str) -> Option<Vec<[f64; 3]>> {
        self.nodal(body, |now, node| now.displacement(node))
    }

    /// Velocities [m/s] of the nodes of a body; `None` without a body of this name.
    pub fn velocities(&self, body: &str) -> Option<Vec<[f64; 3]>> {
        self.nodal(body, |now, node| now.velocity(node))
    }

    pub(super) fn nodal(
        &self,
        body: &str,
        value: impl Fn(&dyn Instant, usize) -> [f64; 3],
    ) -> Option<Vec<[f64; 3]>> {
        let (now, nodes) = self.parts().find_map(|(part, now)| {
            let found = part.model.bodies.iter().find(|known| known.name == body)?;
            Some((now, found.nodes.clone()))
        })?;
        Some(nodes.map(|node| value(now, node as usize)).collect())
    }

    /// Force [N] by which a constraint holds or moves its nodes; `None` without one of this name.
    pub fn reaction(&self, constraint: &str) -> Option<[f64; 3]> {
        let forces = self.parts().flat_map(|(part, now)| {
            let found =
                part.model.constraints.iter().enumerate().filter(|(_, known)| known.name == constraint);
            found.map(|(index, _)| now.reaction(index))
        });
        forces.reduce(|a, b| [a[0] + b[0], a[1] + b[1], a[2] + b[2]])
    }

    /// The volume that a constraint of volume encloses, and its pressure; `None` without one of this name.
    pub fn enclosed(&self, constraint: &str) -> Option<Enclosed> {
        self.parts().find_map(|(part, now)| {
            let index = part.model.constraints.iter().position(|known| known.name == constraint)?;
            now.enclosed(index)
        })
    }

    /// Force [N] of a contact on the obstacle or tool that it is with; `None` without one of this name.
    pub fn contact_force(&self, contact: &str) -> Option<[f64; 3]> {
        self.parts().find_map(|(part, now)| {
            let contacts = &part.method.contacts()?.contacts;
            let index = contacts.iter().position(|known| known.name == contact)?;
            now.contact_forces().get(index).copied()
        })
    }
}
