//! Shells, and solids whose equations are solved: their cells, constraints, loads and start.

mod cells;
mod constraints;
mod loads;

use pliant_format::tables::SolverName;
use pliant_geometry::Vector3;
use pliant_geometry::words::counted;
use pliant_implicit::State;

use crate::assemble::Builder;

impl Builder<'_> {
    /// Refuses what a static solver cannot hold.
    pub(in crate::assemble) fn check_held(&mut self) {
        if self.scene.run.solver != SolverName::Static {
            return;
        }
        if let Err(pliant_implicit::SolveError::FreeBody { node, free_modes }) =
            pliant_implicit::check_held(&self.assembly)
        {
            let owner = self.assembly.bodies.iter().find(|body| body.nodes.contains(&node));
            let Some((name, first)) = owner.map(|body| (body.name.clone(), body.nodes.start)) else { return };
            let message = format!(
                "`{name}` is free in {} of 6, and a static run needs every part constrained (this one has node {})",
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

    /// Displacements [m] of all nodes at the start, if some body has some.
    fn initial_displacement(&mut self) -> Option<Vec<Vector3>> {
        let scene = self.scene;
        let mut all = None;
        for (body, (name, table)) in scene.bodies.iter().enumerate() {
            let Some(wanted) = &table.initial_displacement else { continue };
            let nodes: Vec<u32> = self.assembly.bodies[body].all_nodes().collect();
            let path = ["body", name.as_str(), "initial-displacement"];
            let given = self.node_vectors(wanted, body, &nodes, &path)?;
            let all = all.get_or_insert_with(|| vec![Vector3::zeros(); self.assembly.rest.len()]);
            for (&node, vector) in nodes.iter().zip(given) {
                all[node as usize] = Vector3::from(vector);
            }
        }
        all
    }

    /// The state that a run of an implicit solver starts from.
    pub(in crate::assemble) fn start(&mut self) -> Option<State> {
        let displacement = self.initial_displacement();
        let assembly = &self.assembly;
        let mut start = self.scene.is_implicit().then(|| State::at_rest(assembly))?;
        if let Some(displacement) = displacement {
            let positions: Vec<Vector3> = assembly.places().zip(displacement).map(|(x, u)| x + u).collect();
            start.set_positions(assembly, &positions);
        }
        for (own, given) in start.velocity.iter_mut().zip(&assembly.initial_velocity) {
            *own = Vector3::from(*given);
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
    pub(in crate::assemble) fn place(&self, start: &mut State, displacement: &[[f64; 3]]) {
        let moved = self.assembly.places().zip(displacement).map(|(x, u)| x + Vector3::from(*u));
        let positions: Vec<Vector3> = moved.collect();
        start.set_positions(&self.assembly, &positions);
    }
}

#[cfg(test)]
mod tests {
    use pliant_geometry::{DataArray, Vector3, io};
    use pliant_implicit::Forces;

    use crate::assemble::build;
    use pliant_format::Scene;
    use pliant_format::source::Source;

    /// A sphere of 20 triangles, whose mesh has the normals of an ellipsoid.
    #[test]
    fn the_normals_of_a_mesh_are_taken_unless_creases_are_asked_for() {
        let folder = tempfile::tempdir().unwrap();
        let mut mesh = pliant_meshing::sphere(0.1, 0, 100).unwrap();
        let normal = |p: &Vector3| [-p.x, -p.y, -2.0 * p.z];
        let values = mesh.points.iter().flat_map(normal).collect();
        mesh.point_data.insert("normal".into(), DataArray { components: 3, values });
        io::write(&folder.path().join("ball.vtu"), &mesh).unwrap();
        mesh.point_data.clear();
        io::write(&folder.path().join("plain.vtu"), &mesh).unwrap();
        let built = |file: &str, more: &str| {
            let text = format!(
                "[scene]\nuntil = 1\n[run]\nsolver = 'implicit'\n[law.wall]\ntype = 'neo-hookean'\nyoung-modulus = 1e6\n\
                 poisson-ratio = 0.3\n[body.wall]\nmodel = 'shell'\nlaw = 'wall'\nmesh = {{ file = '{file}' }}\n\
                 density = 1000\nthickness = 0.001\n{more}"
            );
            let source = Source::parse("ball.toml", text).unwrap();
            build(&Scene::from_source(source, folder.path().into()).unwrap())
        };
        let off = |file: &str, more: &str| {
            let part = built(file, more).unwrap().implicit.unwrap();
            let model = &part.model;
            assert_eq!(model.normals.len(), 12);
            let wanted = model.places().map(|p| Vector3::new(p.x, p.y, 2.0 * p.z).normalize());
            let off = model.normals.iter().zip(wanted).map(|(n, wanted)| (n.direction - wanted).norm());
            off.fold(0.0, f64::max)
        };
        for (file, more, same) in [
            ("ball.vtu", "", true),
            ("ball.vtu", "normals = 'mesh'", true),
            ("ball.vtu", "normals = 'triangles'", false),
            ("ball.vtu", "crease = 45", false),
            ("plain.vtu", "", false),
        ] {
            assert_eq!(off(file, more) < 1e-12, same, "{file} {more}: {}", off(file, more));
        }
        for (file, more, says) in [
            ("plain.vtu", "normals = 'mesh'", "has no point data `normal`"),
            ("ball.vtu", "normals = 'mesh'\ncrease = 30", "takes its normals from the mesh"),
        ] {
            let message = built(file, more).unwrap_err().plain().to_string();
            assert!(message.contains(says), "{message}");
        }
    }

    /// A plate that starts rotated by a right angle, as in a table, is not strained: its nodes have turned with it.
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
