//! Shells, and solids whose equations are solved: their cells, constraints, loads and start.

mod cells;
mod constraints;
mod loads;

use pliant_format::registry::OutputTable;
use pliant_format::tables::{BodyModel, DeviceName, Element, PrecisionName, SolverName};
use pliant_geometry::Vector3;
use pliant_geometry::words::counted;
use pliant_implicit::State;

use crate::assemble::Builder;

impl Builder<'_> {
    /// Rejects scenes of both kinds of bodies without a common solver, and keys that do not go with the model of the implicit solvers.
    pub(in crate::assemble) fn check_models(&mut self) {
        let scene = self.scene;
        let is_implicit = scene.is_implicit();
        self.check_keys_of_solver(is_implicit);
        self.check_keys_of_bodies(is_implicit);
        self.check_stiffness_damping(is_implicit);
        if scene.bodies.is_empty() || !is_implicit {
            return;
        }
        let solver = scene.run.solver.word();
        let of_model = |model: BodyModel| scene.bodies.iter().find(|(_, body)| body.model == model);
        if let (Some((solid, _)), Some((shell, _)), false) = (
            of_model(BodyModel::Solid).or(of_model(BodyModel::Membrane)).or(of_model(BodyModel::Bar)),
            of_model(BodyModel::Shell),
            scene.run.solver.solves_equations(),
        ) {
            let message = format!(
                "`{shell}` is a shell and `{solid}` is not: they do not go together with the solver `{solver}`"
            );
            let help = match &of_model(BodyModel::Shell).and_then(|(_, shell)| shell.on.as_ref()) {
                Some(_) => {
                    "a wall on a solid takes `model = \"membrane\"` with this solver, without bending, or the solver \"implicit\" or \"static\""
                }
                None => {
                    "take `solver = \"static\"` or `\"implicit\"`, or give the others a participant of their own"
                }
            };
            self.error(&["body", shell, "model"], message, "not with this solver", help);
        }
        if scene.run.solver == SolverName::QuasiStatic {
            let message = "the solver `quasi-static` is not for bodies of model `shell`";
            let help = "take `solver = \"static\"`";
            self.error(&scene.run_at("solver"), message, "not for these bodies", help);
        }
        let what = match of_model(BodyModel::Shell) {
            Some(_) => "shells".to_owned(),
            None => format!("runs with `solver = \"{solver}\"`"),
        };
        let on_gpu = scene.run.solver == SolverName::Explicit && scene.run.device == DeviceName::Gpu;
        if scene.run.precision == Some(PrecisionName::Single) && !on_gpu {
            let message = format!("{what} are computed in double precision only on the CPU");
            self.error(&scene.run_at("precision"), message, "not for these bodies", "leave `precision` out");
        }
        if scene.run.checkpoint.is_some()
            && scene.run.control.as_ref().is_some_and(|c| c.arc_length.is_some())
        {
            let message = "a run by arc length has no checkpoints, since it continues in the direction of its last step";
            let help = "leave it out, or control a displacement";
            self.error(&scene.run_at("checkpoint"), message, "not with `arc-length`", help);
        }
        if scene.run.mass_scaling.is_some() {
            let message = format!("mass is not scaled for {what}");
            let help = match scene.run.solver {
                SolverName::Explicit => {
                    "leave it out, or take `solver = \"implicit\"`, which has no critical time step"
                        .to_owned()
                }
                _ => format!("leave it out: the solver `{solver}` has no critical time step"),
            };
            self.error(&scene.run_at("mass-scaling"), message, "not for these bodies", &help);
        }
        if scene.run.on_unstable.is_some() {
            let message = format!("the critical time step of {what} is not monitored");
            let help = "leave it out; their step is compared with the critical one at rest before the run";
            self.error(&scene.run_at("on-unstable"), message, "not for these bodies", help);
        }
    }

    /// Rejects damping by stiffness that differs between bodies, or that the solver does not have.
    fn check_stiffness_damping(&mut self, is_implicit: bool) {
        let scene = self.scene;
        let mut own = scene.bodies.iter().filter(|(_, body)| body.on.is_none());
        let Some((first, table)) = own.next() else { return };
        if let Some((name, _)) = own.find(|(_, body)| body.stiffness_damping != table.stiffness_damping) {
            let message = format!("`{name}` and `{first}` have different `stiffness-damping`");
            let help = "bodies of a participant share one value";
            self.error(&["body", name, "stiffness-damping"], message, "another", help);
        }
        let solver = scene.run.solver;
        let (damps, wanted) = match (solver, is_implicit) {
            (SolverName::Implicit, _) | (SolverName::Explicit, false) => (true, ""),
            (SolverName::Explicit, true) => (false, "the solver `implicit` for shells"),
            (SolverName::QuasiStatic, _) => (false, "the solver `explicit` or `implicit`"),
            _ => (false, "the solver `implicit`"),
        };
        if table.stiffness_damping > 0.0 && !damps {
            let message = format!("damping by stiffness needs {wanted}, not `{}`", solver.word());
            let help = "leave it out, or take `solver = \"implicit\"`";
            let path = ["body", first.as_str(), "stiffness-damping"];
            self.error(&path, message, "not with this solver", help);
        }
    }

    /// Rejects keys without effect on the solver.
    fn check_keys_of_solver(&mut self, is_implicit: bool) {
        let scene = self.scene;
        let run = &scene.run;
        let newton = is_implicit && run.solver.solves_equations();
        let dynamic = matches!(run.solver, SolverName::Explicit | SolverName::Implicit);
        if dynamic && scene.gives("load-steps") {
            let message = "`load-steps` is for `solver = \"quasi-static\"` and `\"static\"`; others take a `step` in seconds";
            self.error(&scene.run_at("load-steps"), message, "has no effect here", "remove it");
        }
        for (key, wanted, of) in [
            ("iterations", newton, "`solver = \"implicit\"` and `\"static\"`"),
            ("linear", newton, "`solver = \"implicit\"` and `\"static\"`"),
            ("control", newton && run.solver == SolverName::Static, "`solver = \"static\"`"),
            ("speed-tolerance", newton && run.solver == SolverName::Implicit, "`solver = \"implicit\"`"),
            ("accept-unconverged", newton && run.solver == SolverName::Implicit, "`solver = \"implicit\"`"),
            ("integrator", newton && run.solver == SolverName::Implicit, "`solver = \"implicit\"`"),
        ] {
            if scene.gives(key) && !wanted {
                let message = format!("`{key}` is for {of}");
                self.error(&scene.run_at(key), message, "has no effect here", "remove it");
            }
        }
        let taken = self
            .scene
            .outputs
            .iter()
            .any(|(name, table)| newton && name == "convergence" && matches!(table, OutputTable::Csv(_)));
        if taken {
            let message = format!(
                "a run with `solver = \"{}\"` writes its residuals into `convergence.csv`",
                run.solver.word()
            );
            self.error(&["output", "convergence"], message, "the same file", "give the output another name");
        }
    }

    /// Rejects keys without effect on the models of the bodies.
    fn check_keys_of_bodies(&mut self, is_implicit: bool) {
        for (name, body) in &self.scene.bodies {
            let shell = body.model == BodyModel::Shell;
            let own = body.on.is_none();
            let bar = body.model == BodyModel::Bar;
            let wall = matches!(body.model, BodyModel::Shell | BodyModel::Membrane);
            let others = [
                ("area", bar, "`model = \"bar\"`"),
                ("slack", bar, "`model = \"bar\"`"),
                ("tension-only", bar, "`model = \"bar\"`"),
                ("faces", !own, "a wall with `on`"),
                ("rotations", !own && shell, "a shell with `on`"),
                ("damping", own, "a body with nodes of its own"),
                ("stiffness-damping", own, "a body with nodes of its own"),
                ("velocity", own, "a body with nodes of its own"),
                ("initial-displacement", own, "a body with nodes of its own"),
                (
                    "fraction",
                    matches!(body.model, BodyModel::Solid | BodyModel::Shell),
                    "`model = \"solid\"`",
                ),
                ("thickness", wall, "a shell or a membrane"),
                (
                    "pre-tension",
                    shell && body.element != Some(Element::Plate),
                    "a shell that resists in its plane",
                ),
                ("crease", shell, "a shell"),
                ("normals", shell, "a shell"),
                ("branches", shell, "a shell"),
                ("initial-displacement", is_implicit, "shells and the solvers `implicit` and `static`"),
                ("hourglass", body.model == BodyModel::Solid, "`model = \"solid\"`"),
                ("layers", shell, "a shell"),
                ("thickness", body.layers.is_empty(), "a shell without `layers`"),
                (
                    "fibre",
                    !bar && (!shell || !body.layers.is_empty()),
                    "solids, membranes and shells with `layers`",
                ),
                ("second-fibre", !bar && !shell, "solids and membranes"),
            ];
            for (key, wanted, of) in others {
                if !wanted && self.source().node(&["body", name, key]).is_some() {
                    let message =
                        format!("`{key}` is for {of}, and `{name}` is of model `{}`", body.model.word());
                    let help = "remove it, or change `model` or the solver";
                    self.error(&["body", name, key], message, "has no effect here", help);
                }
            }
        }
    }

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
