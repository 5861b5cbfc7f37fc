//! Constraints and springs of the implicit solvers.

use pliant_geometry::Vector3;
use pliant_implicit::{Motion, Spring};
use pliant_mechanics::curve::Curve;
use pliant_mechanics::model;

use crate::assemble::Builder;
use crate::diagnostic::Diagnostic;
use crate::format::{Axis, MoveTable, SpringTable, Vectors};
use crate::registry::ConstraintTable;

impl Builder<'_> {
    /// Whether the nodes of a body turn.
    pub(super) fn has_rotations(&self, body: usize) -> bool {
        self.shell_cells(body).is_some()
    }

    /// The components of a constraint: translations and rotations. By default all translations, and rotations if the body has
    /// some and `turns`.
    pub(in crate::assemble) fn components(
        &mut self,
        axes: Option<&[Axis]>,
        body: Option<usize>,
        turns: bool,
        path: &[&str],
    ) -> Option<[bool; 6]> {
        const AXES: [Axis; 6] = [Axis::X, Axis::Y, Axis::Z, Axis::Rx, Axis::Ry, Axis::Rz];
        let rotates = body.is_some_and(|body| self.has_rotations(body));
        let chosen = match axes {
            None => [true, true, true, rotates && turns, rotates && turns, rotates && turns],
            Some([]) => {
                let at = [path, &["components"]].concat();
                let help = "name x, y, z (of shells also rx, ry, rz), or leave it out for all";
                self.error(&at, "`components` is empty", "here", help);
                return None;
            }
            Some(axes) => AXES.map(|axis| axes.contains(&axis)),
        };
        if body.is_some() && !rotates && chosen[3..].contains(&true) {
            let at = [path, &["components"]].concat();
            let message = "only the nodes of shells have rotations";
            self.error(&at, message, "not of this body", "leave out rx, ry and rz");
            return None;
        }
        Some(chosen)
    }

    /// Adds a constraint to the model of the implicit solvers, as the scene's own model has it in displacements.
    pub(in crate::assemble) fn constrain_implicit(
        &mut self,
        name: &str,
        table: &ConstraintTable,
        motion: &model::Motion,
        nodes: &[u32],
        components: [bool; 6],
    ) {
        let Some(part) = &mut self.implicit else { return };
        let turn = match table {
            ConstraintTable::Move(moved) => moved.turn.unwrap_or_default(),
            _ => [0.0; 3],
        };
        let moved = |[x, y, z]: [f64; 3], curve: &Curve| Motion::Moved {
            by: [x, y, z, turn[0], turn[1], turn[2]],
            curve: curve.clone(),
        };
        let all: Vec<(Vec<u32>, Motion)> = match motion {
            model::Motion::Displacement(by, curve) => vec![(nodes.to_vec(), moved(*by, curve))],
            model::Motion::Displacements(by, curve) => {
                nodes.iter().zip(by).map(|(&node, &by)| (vec![node], moved(by, curve))).collect()
            }
            model::Motion::Fixed => vec![(nodes.to_vec(), Motion::Fixed)],
            model::Motion::Velocity(..) | model::Motion::Rotation { .. } => {
                vec![(nodes.to_vec(), Motion::Displaced(motion.clone()))]
            }
        };
        let constraint = |(nodes, motion)| pliant_implicit::Constraint {
            name: name.to_owned(),
            nodes,
            components,
            motion,
        };
        let all: Vec<_> = all.into_iter().map(constraint).collect();
        let clash = part
            .model
            .constraints
            .iter()
            .find(|known| all.iter().any(|own| clash(known, own)))
            .map(|known| known.name.clone());
        part.model_mut().constraints.extend(all);
        if let Some(other) = clash {
            let first = self.source().key_span(&["constraint", &other]);
            let second = self.source().key_span(&["constraint", name]);
            let message = format!("`{other}` and `{name}` both prescribe rotations of the same nodes");
            let help = "take the shared nodes out of one of them, or limit `components`";
            let diagnostic = Diagnostic::error(message).at(second, "contradicts the other");
            self.out.push(diagnostic.also(first, "contradicts the other").help(help));
        }
    }

    /// How nodes of shells are moved, without their rotation.
    pub(in crate::assemble) fn motion_of_shell(
        &mut self,
        name: &str,
        table: &MoveTable,
        nodes: Option<(usize, &[u32])>,
    ) -> Option<model::Motion> {
        let path = ["constraint", name];
        if table.rotate.is_some() {
            let message = "a rotation about an axis is for nodes of solids";
            let help = "of shells `turn` turns the nodes about their own places; give their way node by node in `by`";
            self.error(&[path[0], path[1], "rotate"], message, "not for this model", help);
            return None;
        }
        let shift = match (&table.by, table.velocity) {
            (_, Some(_)) => {
                let message = "nodes of shells move by a way, not with a velocity";
                let help = "give the whole way in `by`, with a `curve`";
                self.error(&[path[0], path[1], "velocity"], message, "not for this model", help);
                return None;
            }
            (Some(Vectors::PerNode(by)), _) => {
                let (body, nodes) = nodes?;
                let by = self.node_vectors(by, body, nodes, &[path[0], path[1], "by"])?;
                return Some(model::Motion::Displacements(by, self.curve(&table.timing, &path)?));
            }
            (None, None) if table.turn.is_none() => {
                let message = "a motion has `by`, `turn` or both, found neither";
                self.error(&path, message, "this motion", "`by` in metres, `turn` in radians");
                return None;
            }
            (by, None) => match by {
                Some(Vectors::Uniform(by)) => *by,
                _ => [0.0; 3],
            },
        };
        Some(model::Motion::Displacement(shift, self.curve(&table.timing, &path)?))
    }

    /// Adds springs.
    pub(in crate::assemble) fn add_springs(&mut self, name: &str, table: &SpringTable) {
        let path = ["constraint", name];
        let Some(body) = self.find_body(&table.body, &[path[0], path[1], "body"]) else { return };
        let Some(nodes) = self.body_nodes(body, &table.nodes, &[path[0], path[1], "nodes"]) else { return };
        let Some(part) = &mut self.implicit else {
            let message = "springs are for shells and for the solvers `static` and `implicit`";
            self.error(&path, message, "not with this solver", "take `fix`, or change the solver");
            return;
        };
        for node in nodes {
            let anchor = table.to.map_or(part.model.rest[node as usize], Vector3::from);
            part.model_mut().springs.push(Spring { node, anchor, stiffness: table.stiffness });
        }
    }
}

/// Whether two constraints prescribe the same rotation of a node, and not both that it stays.
fn clash(a: &pliant_implicit::Constraint, b: &pliant_implicit::Constraint) -> bool {
    let shared = (3..6).any(|c| a.components[c] && b.components[c]);
    let still = matches!((&a.motion, &b.motion), (Motion::Fixed, Motion::Fixed));
    shared && !still && a.nodes.iter().any(|node| b.nodes.contains(node))
}
