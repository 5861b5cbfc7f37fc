//! The phase [`Started`]: where a run begins.

mod touching;

use std::collections::HashSet;
use std::sync::Arc;

use pliant_format::diagnostic::SceneErrors;
use pliant_format::tables::SolverName;
use pliant_geometry::Vector3;
use pliant_implicit::AssemblyState;
use pliant_sim::ImplicitBodies;

use super::Built;
use super::bodies::Meshed;
use super::checks::Checked;
use super::contacts::InContact;
use super::context::{Context, follows};
use super::loads::Loaded;
use super::ties::Tied;

/// The last phase: a model with a start.
pub(super) struct Started<'s> {
    checked: Checked<'s>,
    /// The state that a run of an implicit solver starts from; `None` with other solvers.
    pub start: Option<AssemblyState>,
    /// Displacements [m] of all nodes at the start, where bodies were pushed apart.
    pushed: Option<Arc<Vec<[f64; 3]>>>,
}

follows!(Started, checked: Checked);

impl<'s> Checked<'s> {
    /// Finds the start, where bodies that overlap are pushed apart.
    pub fn started(mut self) -> Started<'s> {
        let mut start = self.start();
        let pushed = self.separate(start.as_ref());
        if let (Some(start), Some(pushed)) = (&mut start, &pushed) {
            self.place(start, pushed);
        }
        if !self.failed() {
            self.find_near(pushed.as_ref().map(|moved| &moved[..]));
        }
        Started { checked: self, start, pushed }
    }
}

impl Started<'_> {
    /// The model, with the contacts that act from its start on.
    ///
    /// # Errors
    /// All mistakes that were found.
    pub fn built(mut self) -> Result<Built, SceneErrors> {
        self.touch();
        self.stop_at_mistakes()?;
        let check_intersections = self.checks_intersections();
        let Self { checked: Checked { in_contact, meets, .. }, start, pushed } = self;
        let InContact { loaded: Loaded { tied, control }, contacts, .. } = in_contact;
        let Tied { meshed, surfaces, curved, .. } = tied;
        let Meshed { context, assembly, cells, bodies, .. } = meshed;
        let Context { out: warnings, mut notes, .. } = context;
        let mut reported = HashSet::new();
        notes.retain(|note| reported.insert(note.clone()));
        let model = Arc::clone(&assembly.model);
        let implicit = start.map(|start| {
            Arc::new(ImplicitBodies { model: Arc::new(assembly), cells, control, start, surface: curved })
        });
        Ok(Built {
            model,
            implicit,
            bodies,
            surfaces,
            contacts,
            check_intersections,
            meets,
            pushed,
            warnings,
            notes,
        })
    }
}

impl Checked<'_> {
    /// Displacements [m] of all nodes at the start, if some body has some.
    fn initial_displacement(&mut self) -> Option<Vec<Vector3>> {
        let scene = self.scene;
        let mut displacement = None;
        for (body, (name, table)) in scene.bodies.iter().enumerate() {
            let Some(wanted) = &table.initial_displacement else { continue };
            let nodes: Vec<u32> = self.assembly.bodies[body].all_nodes().collect();
            let path = ["body", name.as_str(), "initial-displacement"];
            let given = self.node_vectors(wanted, body, &nodes, &path)?;
            let displacement =
                displacement.get_or_insert_with(|| vec![Vector3::zeros(); self.assembly.rest.len()]);
            for (&node, vector) in nodes.iter().zip(given) {
                displacement[node as usize] = Vector3::from(vector);
            }
        }
        displacement
    }

    /// The state that a run of an implicit solver starts from.
    fn start(&mut self) -> Option<AssemblyState> {
        let displacement = self.initial_displacement();
        let assembly = &self.assembly;
        let mut start = self.scene.is_implicit().then(|| AssemblyState::at_rest(assembly))?;
        if let Some(displacement) = displacement {
            let positions: Vec<Vector3> = assembly.places().zip(displacement).map(|(x, u)| x + u).collect();
            start.set_positions(assembly, &positions);
        }
        for (velocity, given) in start.velocity.iter_mut().zip(&assembly.initial_velocity) {
            *velocity = Vector3::from(*given);
        }
        // A static run goes there in its first load step.
        if self.scene.run.solver == SolverName::Static {
            assembly.take_along(&mut start);
        } else {
            assembly.place_prescribed(&mut start);
        }
        Some(start)
    }

    /// Moves a start to displacements from rest [m].
    fn place(&self, start: &mut AssemblyState, displacement: &[[f64; 3]]) {
        let moved = self.assembly.places().zip(displacement).map(|(x, u)| x + Vector3::from(*u));
        let positions: Vec<Vector3> = moved.collect();
        start.set_positions(&self.assembly, &positions);
    }
}

#[cfg(test)]
mod tests {
    use pliant_format::Scene;
    use pliant_format::source::Source;
    use pliant_implicit::Forces;

    use crate::assemble::build;

    /// A plate that starts rotated by a right angle, as in a table, is not strained: its nodes have turned
    /// with it.
    #[test]
    fn a_start_that_is_a_rotation_costs_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let node = |k: usize| [(k % 3) as f64 / 2.0, (k / 3) as f64 / 2.0];
        let row = |k: usize| {
            let [x, y] = node(k);
            format!("{k},{},{},0\n", -y - x, x - y)
        };
        std::fs::write(folder.path().join("turn.csv"), (0..9).map(row).collect::<String>()).unwrap();
        let text = "[scene]\nuntil = 1\n[run]\nsolver = 'implicit'\n[law.wall]\ntype = 'neo-hookean'\n\
                    young-modulus = 1e6\npoisson-ratio = 0.3\n[body.wall]\nmodel = 'shell'\nlaw = 'wall'\n\
                    mesh = { plate = { size = [1, 1], cells = [2, 2] } }\ndensity = 1000\nthickness = 0.01\n\
                    initial-displacement = { csv = 'turn.csv' }\nvelocity = [1, 2, 3]\n";
        let source = Source::parse("plate.toml", text).unwrap();
        let scene = Scene::from_source(source, folder.path().into()).unwrap();
        let part = build(&scene).unwrap().implicit.unwrap();
        let mut forces = Forces::new(part.model.clone());
        forces.evaluate(&part.start).unwrap();
        let moved = (part.start.position[8] - part.model.place(8)).norm();
        assert!((moved - 2.0).abs() < 1e-12 && forces.strain_energy() < 1e-20, "{}", forces.strain_energy());
        assert!(part.start.velocity.iter().all(|v| <[f64; 3]>::from(*v) == [1.0, 2.0, 3.0]));
    }
}
