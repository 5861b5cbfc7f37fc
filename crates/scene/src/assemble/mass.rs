//! Mass scaling.

use pliant_explicit::mass_scaling::{self, Goal};
use pliant_format::diagnostic::Diagnostic;
use pliant_format::tables::MassScalingTable;
use pliant_geometry::words::{counted, number};

use super::Builder;

/// Added mass, as a fraction, above which a scene gives a warning.
const MUCH: f64 = 0.05;

impl Builder<'_> {
    /// Makes the nodes that limit the step heavier, and notes how much mass that adds.
    pub(super) fn scale_mass(&mut self) {
        let Some(table) = self.scene.run.mass_scaling else { return };
        let goal = match table {
            MassScalingTable::TargetStep(step) => Goal::TargetStep(step),
            MassScalingTable::Share(share) => Goal::Share(share),
        };
        if let Err(contradiction) = mass_scaling::scale_mass(self.assembly.model_mut(), goal) {
            self.out.push(Diagnostic::error(contradiction.to_string()));
        }
        let Some(scaling) = &self.assembly.mass_scaling else { return };
        let (added, mass) = (scaling.total(), self.assembly.mass.iter().sum::<f64>());
        let share = added / mass;
        let told = match scaling.nodes() {
            0 => format!(
                "mass scaling adds nothing: the critical time step is {} s without it",
                number(scaling.unscaled_critical_step)
            ),
            nodes => format!(
                "mass scaling adds {} kg or {:.2} % of the mass, to {nodes} of {}; without it the critical time step is {} s",
                number(added),
                share * 100.0,
                counted(self.assembly.node_count(), "node"),
                number(scaling.unscaled_critical_step)
            ),
        };
        if share > MUCH {
            let place = self.source().span(&self.scene.run_at("mass-scaling"));
            let help = "motions become slower than they are; add less, or remove it to see what it changes";
            self.out.push(Diagnostic::warning(told).at(place, "more than 5 %").help(help));
        } else {
            self.notes.push(told);
        }
    }
}
