//! Constraints: which nodes are held or moved, and that no two contradict each other.

use std::collections::{BTreeMap, HashMap};

use pliant_format::diagnostic::Diagnostic;
use pliant_format::registry::ConstraintTable;
use pliant_format::tables::{MoveTable, RotateTable, Vectors, VolumeTable};
use pliant_geometry::Selection;
use pliant_geometry::words::number;
use pliant_mechanics::curve::Curve;
use pliant_mechanics::load::{Face, NO_NODE};
use pliant_mechanics::model::{Constraint, Enclosure, Motion};
use pliant_shells::element::Membrane;

use crate::assemble::in_metres;
use crate::assemble::ties::{Subject, Tied};

impl Tied<'_> {
    pub(super) fn add_constraints(&mut self) {
        let scene = self.scene;
        for (name, table) in &scene.constraints {
            let path = ["constraint", name.as_str()];
            let (body, selection, axes, turns) = match table {
                ConstraintTable::Fix(fix) => (&fix.body, &fix.nodes, &fix.components, true),
                ConstraintTable::Move(moved) => {
                    (&moved.body, &moved.nodes, &moved.components, moved.turn.is_some())
                }
                ConstraintTable::Spring(spring) => {
                    self.add_springs(name, spring);
                    continue;
                }
                ConstraintTable::Mean(mean) => (&mean.body, &mean.nodes, &mean.components, false),
                ConstraintTable::Rigid(rigid) => (&rigid.body, &rigid.nodes, &None, false),
                ConstraintTable::Volume(volume) => {
                    self.add_volume(name, volume);
                    continue;
                }
            };
            let body = self.find_body(body, &[path[0], path[1], "body"]);
            let components = self.components(axes.as_deref(), body, turns, &path);
            let nodes = body.and_then(|body| self.body_nodes(body, selection, &[path[0], path[1], "nodes"]));
            let motion = match table {
                ConstraintTable::Move(moved) if body.is_some_and(|body| self.shell_cells(body).is_some()) => {
                    self.motion_of_shell(name, moved, body.zip(nodes.as_deref()))
                }
                ConstraintTable::Move(moved) => self.motion(moved, body.zip(nodes.as_deref()), &path),
                ConstraintTable::Mean(_) | ConstraintTable::Rigid(_) => {
                    self.collective(table, body.zip(nodes.as_deref()), &path)
                }
                _ => Some(Motion::Fixed),
            };
            if let (Some(motion), Some(components), Some(nodes)) = (motion, components, nodes) {
                if let ConstraintTable::Move(MoveTable { force_limit: Some(limit), .. }) = table {
                    self.limit(&[path[0], path[1], "force-limit"], *limit);
                }
                self.assembly.model_mut().constraints.push(Constraint {
                    name: name.clone(),
                    nodes,
                    components,
                    motion,
                });
            }
        }
        self.assembly.model_mut().prescribe_tied();
        if let Err(contradiction) = self.assembly.constrained_components() {
            let tie = self.scene.ties.iter().find(|(name, _)| *name == contradiction.second);
            let first = self.source().key_span(&["constraint", &contradiction.first]);
            let second = self
                .source()
                .key_span(&[if tie.is_some() { "tie" } else { "constraint" }, &contradiction.second]);
            let (label, help) = match tie {
                Some((_, table)) => (
                    "moves it already",
                    format!(
                        "constrain `{}`, which the node follows, or leave the node out of the tie (`nodes`)",
                        table.between[1]
                    ),
                ),
                None => (
                    "contradicts the other",
                    "take the shared nodes out of one of them with `{ difference = [ …, … ] }`, or limit `components`".to_owned(),
                ),
            };
            let diagnostic = Diagnostic::error(contradiction.to_string())
                .at(second, label)
                .also(first, "contradicts the other")
                .help(help);
            self.out.push(diagnostic);
        }
        self.check_limited();
        self.check_turns();
    }

    /// Limits the force [N] or the pressure [Pa] of the constraint that is added next, by this key.
    fn limit(&mut self, path: &[&str; 3], limit: f64) {
        let [_, name, key] = *path;
        if !self.scene.run.solver.solves_equations() {
            let (what, help) = match key {
                "force-limit" => (
                    "force",
                    "take the solver `implicit` or `static`, or push with a tool that has a `force-limit`",
                ),
                _ => ("pressure", "take the solver `implicit` or `static`, or a load of type `pressure`"),
            };
            let solver = self.scene.run.solver.word();
            let message = format!("the solver `{solver}` cannot limit the {what} of `{name}`");
            self.error(path, message, "not with this solver", help);
        }
        let number = self.assembly.constraints.len();
        self.assembly.force_limits.insert(number, limit);
    }

    /// Refuses constraints on components of nodes that another one moves with a limited force: these lag.
    fn check_limited(&mut self) {
        let mut found = Vec::new();
        for &limited in self.assembly.force_limits.keys() {
            let constraint = &self.assembly.constraints[limited];
            let shares = |other: &Constraint| {
                let component = (0..3).any(|c| constraint.components[c] && other.components[c]);
                component && other.nodes.iter().any(|node| constraint.nodes.contains(node))
            };
            let others = self.assembly.constraints.iter().enumerate();
            let Some((_, other)) = others.filter(|(number, _)| *number != limited).find(|(_, o)| shares(o))
            else {
                continue;
            };
            let diagnostic = Diagnostic::error(format!(
                "`{}` prescribes nodes of `{}`, which lag behind where the force reaches its limit",
                other.name, constraint.name
            ));
            let place = self.source().key_span(&["constraint", &other.name]);
            let limit = self.source().span(&["constraint", &constraint.name, "force-limit"]);
            let help = "take the shared nodes out of one of them with `{ difference = [ …, … ] }`, or limit `components`";
            let diagnostic = diagnostic.at(place, "shares nodes").also(limit, "this limit").help(help);
            found.push(diagnostic);
        }
        self.out.extend(found);
    }

    /// Refuses constraints of rotations that follow a solid, and volumes that shells with such rotations
    /// enclose.
    fn check_turns(&mut self) {
        let mut turning: Vec<u32> = self.assembly.turns.iter().map(|turn| turn.node).collect();
        turning.sort_unstable();
        let turns = |node: &&u32| turning.binary_search(node).is_ok();
        let holds = |constraint: &&Constraint| {
            let encloses = constraint.motion.encloses() && !self.assembly.facets.is_empty();
            encloses || (!constraint.motion.is_collective() && constraint.components[3..].contains(&true))
        };
        let held = self.assembly.constraints.iter().filter(holds);
        let met: Vec<(String, u32, bool)> = held
            .filter_map(|constraint| {
                Some((
                    constraint.name.clone(),
                    *constraint.nodes.iter().find(turns)?,
                    constraint.motion.encloses(),
                ))
            })
            .collect();
        for (name, node, encloses) in met {
            let (body, node) = self.assembly.locate_node(node);
            let body = &self.bodies[body].name;
            let message = format!(
                "the rotation of node {node} of `{body}` follows a solid, but `{name}` prescribes it, too"
            );
            let help = match encloses {
                true => "leave `rotations` free, or fill a body of model `membrane`",
                false => "limit it to translations: `components = [\"x\", \"y\", \"z\"]`",
            };
            self.error(&["constraint", &name], message, "prescribes a rotation", help);
        }
    }

    /// Adds a volume that faces of a body enclose.
    fn add_volume(&mut self, name: &str, table: &VolumeTable) {
        let path = ["constraint", name];
        let at = |key| [path[0], path[1], key];
        let Some(body) = self.find_body(&table.body, &at("body")) else { return };
        let explicit = !self.scene.run.solver.solves_equations();
        if explicit && self.shell_cells(body).is_some() {
            let message = format!(
                "with the solver `explicit` no shell can enclose a volume, and `{}` is a shell",
                table.body
            );
            let help = "take the solver `implicit` or `static`, or a body of model `membrane`";
            self.error(&at("body"), message, "a shell in an explicit run", help);
            return;
        }
        let (selection, key) = match &table.faces {
            Some(selection) => (selection, "faces"),
            None => (&Selection::All, "body"),
        };
        let faces = self.faces(Subject::Body(body), selection, &at(key));
        let (Some(mut faces), Some(curve)) = (faces, self.course(&table.timing, &path)) else { return };
        if faces.is_empty() {
            let message = format!("`{name}` has no faces that enclose a volume");
            let help = "take a body of model `solid`, `membrane` or `shell`";
            self.error(&at(key), message, "no faces", help);
            return;
        }
        if let Some([from, to]) = open_edge(&faces) {
            let place = |node: u32| self.assembly.rest[node as usize];
            let middle: [f64; 3] = std::array::from_fn(|c| 0.5 * (place(from)[c] + place(to)[c]));
            let message = format!("the faces of `{name}` leave an opening at {}", in_metres(middle));
            let help = "choose faces that close, or add a membrane over the opening";
            self.error(&at(key), message, "an open surface encloses no volume", help);
            return;
        }
        let facets = match self.shell_cells(body) {
            Some(_) => self.facets(body, selection, &at(key)).unwrap_or_default(),
            None => Vec::new(),
        };
        let mut nodes: Vec<u32> = faces.iter().flatten().copied().filter(|&node| node != NO_NODE).collect();
        nodes.sort_unstable();
        nodes.dedup();
        for corner in faces.iter_mut().flatten().filter(|corner| **corner != NO_NODE) {
            *corner = nodes.partition_point(|node| node < corner) as u32;
        }
        let mut enclosure = Enclosure { faces, facets: Vec::new() };
        let rest = |at: u32| self.assembly.rest[nodes[at as usize] as usize];
        let volume = enclosure.add_gradient(rest, &mut vec![[0.0; 3]; nodes.len()]);
        let curved = facets.first().map(|&cell| self.assembly.facets[cell as usize].membrane());
        if matches!(curved, Some(Membrane::Curved { .. })) {
            if volume < 0.0 {
                let message = format!("the triangles of `{}` face inwards", self.bodies[body].name);
                let help = "reverse the triangles of the mesh, so that they face outwards";
                self.error(&at(key), message, "an inside-out surface", help);
                return;
            }
            enclosure = Enclosure { faces: Vec::new(), facets };
        } else if volume < 0.0 {
            // The faces of a cavity point into it.
            enclosure.faces.iter_mut().for_each(turn_round);
        }
        if table.by <= -volume.abs() {
            let message =
                format!("`{name}` encloses {} m³ at rest, but `by` removes more", number(volume.abs()));
            self.error(&at("by"), message, "no volume is left", "`by` must be above minus this volume");
            return;
        }
        if let Some(limit) = table.pressure_limit {
            self.limit(&at("pressure-limit"), limit);
        }
        self.assembly.model_mut().constraints.push(Constraint {
            name: name.to_owned(),
            nodes,
            components: [false; 6],
            motion: Motion::Volume { enclosure, by: table.by, curve },
        });
    }

    /// Returns the motion that binds some nodes of a body to each other.
    fn collective(
        &mut self,
        table: &ConstraintTable,
        nodes: Option<(usize, &[u32])>,
        path: &[&str; 2],
    ) -> Option<Motion> {
        let name = path[1];
        let (body, nodes) = nodes?;
        if self.shell_cells(body).is_some() && !self.scene.run.solver.solves_equations() {
            let message = format!("`{name}` binds nodes of an explicit shell");
            let help = "take the solver `implicit` or `static`, or a body of another model";
            self.error(&[path[0], name, "body"], message, "a shell in an explicit run", help);
            return None;
        }
        match table {
            ConstraintTable::Mean(mean) => {
                let curve = self.course(&mean.timing, path)?;
                Some(Motion::Mean { weights: self.shares(body, nodes), by: mean.by, curve })
            }
            _ if nodes.len() < 2 => {
                let message = format!("`{name}` has one node, which is rigid by itself");
                self.error(&[path[0], name, "nodes"], message, "one node", "choose the nodes of a part");
                None
            }
            _ => Some(Motion::Rigid),
        }
    }

    /// Shares of some nodes in the area of a body's boundary; only faces count all of whose nodes are chosen.
    /// Without such faces the shares are equal. They sum to 1.
    fn shares(&self, body: usize, nodes: &[u32]) -> Vec<f64> {
        let (built, model_body) = (&self.bodies[body], &self.assembly.bodies[body]);
        let places: HashMap<u32, usize> = nodes.iter().copied().zip(0..).collect();
        let place = |node: u32| places.get(&model_body.node(node)).copied();
        let mut shares = vec![0.0; nodes.len()];
        for face in &built.boundary.faces {
            let corners: Option<Vec<usize>> = face.nodes().iter().map(|&node| place(node)).collect();
            for corner in corners.iter().flatten() {
                shares[*corner] += face.area(&built.mesh.points) / face.nodes().len() as f64;
            }
        }
        let whole: f64 = shares.iter().sum();
        let equal = 1.0 / nodes.len().max(1) as f64;
        shares.into_iter().map(|share| if whole > 0.0 { share / whole } else { equal }).collect()
    }

    /// The motion of some nodes of a body (`None`: they are unknown, which is already reported).
    fn motion(&mut self, table: &MoveTable, nodes: Option<(usize, &[u32])>, path: &[&str]) -> Option<Motion> {
        // A way is the integral of a velocity, which begins at 0.
        let curve = match table.velocity {
            Some(_) => self.curve(&table.timing, path),
            None => self.course(&table.timing, path),
        };
        if let Some(rotate) = &table.rotate {
            return self.rotation(table, rotate, curve?, nodes?.1, path);
        }
        match (&table.by, table.velocity) {
            (Some(Vectors::Uniform(by)), None) => Some(Motion::Displacement(*by, curve?)),
            (Some(Vectors::PerNode(by)), None) => {
                let (body, nodes) = nodes?;
                let by = self.node_vectors(by, body, nodes, &[path, &["by"]].concat());
                Some(Motion::Displacements(by?, curve?))
            }
            (None, Some(velocity)) => Some(Motion::Velocity(velocity, curve?)),
            (None, None) if table.turn.is_some() => {
                let message = "the nodes of a solid have no rotations";
                self.error(
                    &[path, &["turn"]].concat(),
                    message,
                    "not for a `solid`",
                    "give displacements in `by`",
                );
                None
            }
            (by, _) => {
                let found = if by.is_some() { "both" } else { "neither" };
                let message =
                    format!("a motion has exactly one of `by`, `velocity` and `rotate`, found {found}");
                let help = "`by` in metres, `velocity` in metres per second, `rotate` with an axis";
                self.error(path, message, "this motion", help);
                None
            }
        }
    }

    /// The rotation of some nodes of a solid.
    fn rotation(
        &mut self,
        table: &MoveTable,
        rotate: &RotateTable,
        curve: Curve,
        nodes: &[u32],
        path: &[&str],
    ) -> Option<Motion> {
        let others = [
            ("by", table.by.is_some()),
            ("velocity", table.velocity.is_some()),
            ("turn", table.turn.is_some()),
            ("components", table.components.is_some()),
        ];
        if let Some((key, _)) = others.iter().find(|(_, given)| *given) {
            let message = format!("`rotate` prescribes the whole motion, so `{key}` cannot be used with it");
            self.error(&[path, &[*key]].concat(), message, "not with `rotate`", "leave one of them out");
            return None;
        }
        if rotate.axis.iter().all(|&x| x == 0.0) {
            let at = [path, &["rotate", "axis"]].concat();
            self.error(&at, "the axis of the rotation is zero", "no direction", "such as `[0, 0, 1]`");
            return None;
        }
        let angle = self.angle(&[path, &["rotate"]].concat(), rotate.angle, rotate.degrees)?;
        let rest = nodes.iter().map(|&node| self.assembly.rest[node as usize]);
        Some(Motion::rotation(rotate.axis, rotate.centre, angle, curve, rest))
    }
}

/// An edge of faces without a face across it; `None` if they close.
fn open_edge(faces: &[Face]) -> Option<[u32; 2]> {
    let edges = faces.iter().flat_map(|face| {
        let count = if face[3] == NO_NODE { 3 } else { 4 };
        (0..count).map(move |k| [face[k], face[(k + 1) % count]])
    });
    let mut open: BTreeMap<[u32; 2], i32> = BTreeMap::new();
    for [from, to] in edges {
        *open.entry([from.min(to), from.max(to)]).or_default() += if from < to { 1 } else { -1 };
    }
    open.into_iter().find(|(_, sides)| *sides != 0).map(|(edge, _)| edge)
}

fn turn_round(face: &mut Face) {
    if face[3] == NO_NODE {
        face.swap(1, 2);
    } else {
        face.swap(1, 3);
    }
}

#[cfg(test)]
mod tests {
    use pliant_mechanics::model::Motion;

    use crate::testing::{built, mistakes};

    fn top(what: &str) -> String {
        format!("[constraint.top]\nbody = 'cube'\nnodes = {{ set = 'z-max' }}\n{what}\n")
    }

    #[test]
    fn components_and_motions_are_as_written() {
        let model = built(&top("type = 'move'\nvelocity = [1, 2, 3]\ncomponents = ['z', 'x']")).model;
        let top = &model.constraints[1];
        assert_eq!((top.nodes.len(), top.components), (9, [true, false, true, false, false, false]));
        assert!(matches!(top.motion, Motion::Velocity([1.0, 2.0, 3.0], _)));
        assert_eq!(model.constraints[0].components, [true, true, true, false, false, false]);
    }

    #[test]
    fn a_motion_has_one_of_two_forms_and_some_components() {
        for (what, says) in [
            ("type = 'move'", "exactly one of `by`, `velocity` and `rotate`, found neither"),
            (
                "type = 'move'\nby = [0, 0, 1]\nrotate = { axis = [0, 0, 1], centre = [0, 0, 0], angle = 1 }",
                "so `by` cannot be used with it",
            ),
            (
                "type = 'move'\nrotate = { axis = [0, 0, 0], centre = [0, 0, 0], angle = 1 }",
                "the axis of the rotation is zero",
            ),
            (
                "type = 'move'\ncomponents = ['x']\nrotate = { axis = [0, 0, 1], centre = [0, 0, 0], angle = 1 }",
                "so `components` cannot be used with it",
            ),
            ("type = 'move'\nby = [0, 0, 1]\nvelocity = [0, 0, 1]", "found both"),
            ("type = 'fix'\ncomponents = []", "`components` is empty"),
        ] {
            let message = mistakes(&top(what)).plain().to_string();
            assert!(message.contains(says), "{message}");
        }
    }

    #[test]
    fn angles_are_in_radians_or_degrees_and_many_turns_are_noted() {
        let turned = |angle: &str| {
            let rotate = format!("rotate = {{ axis = [0, 0, 1], centre = [0, 0, 0], {angle} }}");
            let model = built(&top(&format!("type = 'move'\n{rotate}")));
            let Motion::Rotation { angle, .. } = model.model.constraints[1].motion else {
                panic!("no rotation")
            };
            (angle, model.notes.join("\n"))
        };
        let (quarter, notes) = turned("degrees = 90");
        assert!((quarter - std::f64::consts::FRAC_PI_2).abs() < 1e-15 && !notes.contains("turns"), "{notes}");
        let (large, notes) = turned("angle = 90");
        assert_eq!(large, 90.0);
        let note = "`constraint.top.rotate.angle`: 90.00 rad are 14.3 turns: is the angle meant in degrees?";
        assert!(notes.contains(note), "{notes}");
        assert!(!turned("angle = 6.2831853").1.contains("turns"));
        for (angle, found) in [("", "neither"), (", angle = 1, degrees = 60", "both")] {
            let rotate = format!("rotate = {{ axis = [0, 0, 1], centre = [0, 0, 0]{angle} }}");
            let message = mistakes(&top(&format!("type = 'move'\n{rotate}"))).plain().to_string();
            assert!(message.contains(&format!("either `angle` or `degrees`, found {found}")), "{message}");
        }
    }

    #[test]
    fn two_constraints_may_hold_the_same_node_but_not_move_it_apart() {
        let edge = "[constraint.edge]\nbody = 'cube'\nnodes = { set = 'x-min' }\n";
        built(&format!("{edge}type = 'fix'\n"));
        let message = mistakes(&format!("{edge}type = 'move'\nby = [0, 0, 1]\n")).plain().to_string();
        assert!(message.contains("`base` and `edge` both prescribe z of node 0 of `cube`"), "{message}");
    }
}
