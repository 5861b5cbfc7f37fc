//! Keys of a scene that do not go with its solver or with the models of its bodies.

use pliant_format::registry::OutputTable;
use pliant_format::tables::{
    BodyModel, DeviceName, Element, LoadSteps, LoadTimes, PrecisionName, SolverName, StepChoice,
};

use super::Context;

impl Context<'_> {
    /// Rejects scenes of both kinds of bodies without a common solver, and keys that do not go with the model
    /// of the implicit solvers.
    pub(super) fn check_models(&mut self) {
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
                "`{shell}` is a shell and `{solid}` is not: the solver `{solver}` takes only one of both kinds"
            );
            let help = match &of_model(BodyModel::Shell).and_then(|(_, shell)| shell.on.as_ref()) {
                Some(_) => {
                    "set `model = \"membrane\"`, without bending, or take `solver = \"implicit\"` or `\"static\"`"
                }
                None => {
                    "take `solver = \"static\"` or `\"implicit\"`, or put the other bodies into a participant of their own"
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
            let message = format!("on the CPU, {what} use double precision only");
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
            let message = format!("`mass-scaling` is not available for {what}");
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
            let help =
                "leave it out: the step is compared with the critical time step at rest before the run";
            self.error(&scene.run_at("on-unstable"), message, "not for these bodies", help);
        }
    }

    /// Rejects damping by stiffness that differs between bodies, or that the solver does not have.
    fn check_stiffness_damping(&mut self, is_implicit: bool) {
        let scene = self.scene;
        let mut with_nodes = scene.bodies.iter().filter(|(_, body)| body.on.is_none());
        let Some((first, table)) = with_nodes.next() else { return };
        if let Some((name, _)) =
            with_nodes.find(|(_, body)| body.stiffness_damping != table.stiffness_damping)
        {
            let message = format!("`{name}` and `{first}` have different `stiffness-damping`");
            let help = "bodies of a participant share one value";
            self.error(&["body", name, "stiffness-damping"], message, "another value", help);
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
            let has_nodes = body.on.is_none();
            let bar = body.model == BodyModel::Bar;
            let wall = matches!(body.model, BodyModel::Shell | BodyModel::Membrane);
            let others = [
                ("area", bar, "`model = \"bar\"`"),
                ("slack", bar, "`model = \"bar\"`"),
                ("tension-only", bar, "`model = \"bar\"`"),
                ("faces", !has_nodes, "a wall with `on`"),
                ("rotations", !has_nodes && shell, "a shell with `on`"),
                ("damping", has_nodes, "a body with nodes of its own"),
                ("stiffness-damping", has_nodes, "a body with nodes of its own"),
                ("velocity", has_nodes, "a body with nodes of its own"),
                ("initial-displacement", has_nodes, "a body with nodes of its own"),
                (
                    "fraction",
                    matches!(body.model, BodyModel::Solid | BodyModel::Shell),
                    "`model = \"solid\"`",
                ),
                ("thickness", wall, "a shell or a membrane"),
                (
                    "pre-tension",
                    shell && body.element != Some(Element::Plate),
                    "a shell with stiffness in its plane",
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

    /// Refuses keys that have no effect on a solver without inertia.
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
            self.error(&path, "times of load steps must be above 0 s and increase", "out of order", help);
        }
        if matches!(run.step, StepChoice::Seconds(_)) {
            let message = "the load steps are given in two ways, by `step` and by their times";
            self.error(&path, message, "also given by `step`", "leave one of them out");
        }
        if run.control.is_some() {
            let message = "`control` needs equal load steps, but these have times of their own";
            let help = "give their number, such as `load-steps = 10`";
            self.error(&path, message, "not with `control`", help);
        }
    }
}
