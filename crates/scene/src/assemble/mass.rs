//! Mass scaling, and the keys of `[run]` that are for dynamics only.

use pliant_explicit::mass_scaling::{self, Goal};
use pliant_format::diagnostic::Diagnostic;
use pliant_format::tables::{LoadSteps, LoadTimes, MassScalingTable, SolverName, StepChoice};
use pliant_geometry::words::{counted, number};

use super::Builder;

/// Added mass, as a fraction, above which a scene gives a warning.
const MUCH: f64 = 0.05;

impl Builder<'_> {
    /// Refuses what means nothing to a solver without inertia.
    pub(super) fn check_explicit_only(&mut self) {
        self.check_load_times();
        let scene = self.scene;
        let run = &scene.run;
        if run.solver != SolverName::QuasiStatic {
            return;
        }
        let given =
            [("on-unstable", run.on_unstable.is_some()), ("mass-scaling", run.mass_scaling.is_some())];
        for (key, _) in given.into_iter().filter(|(_, given)| *given) {
            let message = format!(
                "`{key}` is for `solver = \"explicit\"`: quasi-static equilibria have no critical time step"
            );
            self.error(
                &scene.run_at(key),
                message,
                "has no effect here",
                "remove it, or take `solver = \"explicit\"`",
            );
        }
    }

    /// Refuses times of load steps that can't be.
    fn check_load_times(&mut self) {
        let scene = self.scene;
        let run = &scene.run;
        let LoadSteps::Times(LoadTimes { times }) = &run.load_steps else { return };
        let path = scene.run_at("load-steps");
        let increasing = [&[0.0], times.as_slice()].concat().windows(2).all(|pair| pair[0] < pair[1]);
        if !increasing {
            let help =
                "such as `load-steps = { times = [0.1, 0.2, 0.5] }`; the last load step ends with the scene";
            self.error(&path, "times of load steps lie above 0 s and increase", "out of order", help);
        }
        if matches!(run.step, StepChoice::Seconds(_)) {
            let message = "the load steps are given in two ways, by `step` and by their times";
            self.error(&path, message, "and by `step`", "leave one of them out");
        }
        if run.control.is_some() {
            let message =
                "`control` goes on by equal parts in each load step, and these end at times of their own";
            let help = "give their number, such as `load-steps = 10`";
            self.error(&path, message, "not with `control`", help);
        }
    }

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
