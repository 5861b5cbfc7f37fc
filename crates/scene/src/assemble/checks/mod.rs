//! The phase [`Checked`]: the model has everything that the scene asks for, bodies are held, and mass is
//! scaled.

mod outputs;

use pliant_explicit::mass_scaling::{self, Goal};
use pliant_format::diagnostic::{Diagnostic, SceneErrors};
use pliant_format::registry::LoadTable;
use pliant_format::tables::{MassScalingTable, SolverName};
use pliant_geometry::words::{counted, number};

use super::contacts::{InContact, Meet};
use super::context::follows;

/// Added mass, as a fraction, above which a scene gives a warning.
const MUCH: f64 = 0.05;

/// The fifth phase: a model without mistakes.
pub(super) struct Checked<'s> {
    pub in_contact: InContact<'s>,
    /// Surfaces that bodies of other participants touch.
    pub meets: Vec<Meet>,
    /// The bodies that touch something; `None` where a mistake leaves that open.
    touching: Option<Vec<bool>>,
}

follows!(Checked, in_contact: InContact);

impl<'s> InContact<'s> {
    /// Checks outputs, the view and whether bodies are held, and scales the mass.
    ///
    /// # Errors
    /// All mistakes that were found.
    pub fn checked(mut self) -> Result<Checked<'s>, SceneErrors> {
        let meets = self.meets();
        let touching = self.touching(&meets);
        let mut checked = Checked { in_contact: self, meets, touching };
        checked.check_outputs();
        checked.check_view();
        checked.check_free_bodies();
        checked.check_held();
        if !checked.failed() {
            checked.scale_mass();
        }
        checked.stop_at_mistakes()?;
        Ok(checked)
    }
}

impl Checked<'_> {
    /// Says which bodies nothing holds.
    fn check_free_bodies(&mut self) {
        let scene = self.scene;
        let flies =
            |name: &str| scene.bodies.iter().any(|(known, body)| known == name && body.velocity.is_some());
        // A wall is held with the body that it is on.
        let with_nodes = self.assembly.bodies.iter().enumerate().filter(|(_, body)| !body.nodes.is_empty());
        let mut notes = Vec::new();
        for (index, body) in with_nodes {
            let springs = &self.assembly.springs;
            let held = self
                .assembly
                .constraints
                .iter()
                .any(|c| c.nodes.iter().any(|node| body.nodes.contains(node)))
                || springs.iter().any(|spring| body.nodes.contains(&spring.node))
                || scene.tied_outside.contains(&body.name)
                || scene
                    .contacts
                    .iter()
                    .flat_map(|(_, contact)| &contact.between)
                    .any(|name| *name == body.name || name == "all")
                || self.assembly.ties.iter().flat_map(|tie| &tie.nodes).any(|node| body.nodes.contains(node));
            if held || scene.run.solver == SolverName::Static {
                continue;
            }
            let name = &body.name;
            let surfaces = self.assembly.surfaces.iter().filter(|s| s.body == index).map(|s| s.name.as_str());
            let names: Vec<&str> = surfaces.chain([name.as_str()]).collect();
            let loaded = scene.loads.iter().any(|(_, load)| match load {
                LoadTable::Gravity(_) => false,
                load => load.on().is_some_and(|on| names.contains(&on)),
            });
            let falls = scene.scene.gravity.is_some()
                || scene.loads.iter().any(|(_, load)| matches!(load, LoadTable::Gravity(g) if g.on.as_ref().is_none_or(|on| on == name)));
            let fate = match (falls, loaded) {
                (true, false) => "gravity makes it fall",
                (false, true) => "its loads push it away",
                (true, true) => "gravity and its loads carry it away",
                (false, false) if flies(name) => "it keeps its initial velocity",
                (false, false) => "nothing moves it",
            };
            notes.push(format!("`{name}` is held by no constraint: {fate}"));
        }
        self.notes.extend(notes);
    }

    /// Refuses bodies that are free to move in a static run.
    fn check_held(&mut self) {
        if self.scene.run.solver != SolverName::Static {
            return;
        }
        if let Err(pliant_implicit::SolveError::FreeBody { node, free_modes }) =
            pliant_implicit::check_held(&self.assembly)
        {
            let owner = self.assembly.bodies.iter().find(|body| body.nodes.contains(&node));
            let Some((name, first)) = owner.map(|body| (body.name.clone(), body.nodes.start)) else { return };
            let message = format!(
                "`{name}` is free in {} of 6, but a static run needs every part constrained, including the one with node {}",
                counted(free_modes, "rigid motion"),
                node - first
            );
            let help = match self.source().node(&["participant"]) {
                None => {
                    "fix more of its nodes, tie it to points with `type = \"spring\"`, or take `solver = \"implicit\"`"
                }
                Some(_) => {
                    "fix more of its nodes, or give its participant `solver = \"implicit\"`: ties to bodies of other \
                     participants hold nothing in a static run"
                }
            };
            self.error(&["body", &name], message, "not held", help);
        }
    }

    /// Makes the nodes that limit the step heavier, and notes how much mass that adds.
    fn scale_mass(&mut self) {
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
        let message = match scaling.nodes() {
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
            let help = "mass scaling slows motions down: add less, or run without it to compare";
            self.out.push(Diagnostic::warning(message).at(place, "more than 5 %").help(help));
        } else {
            self.notes.push(message);
        }
    }
}
