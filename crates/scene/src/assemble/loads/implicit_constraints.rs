//! Constraints and springs of the implicit solvers.

use pliant_format::tables::{Axis, MoveTable, SpringTable, Vectors};
use pliant_geometry::Vector3;
use pliant_implicit::Spring;
use pliant_mechanics::model::Motion;

use crate::assemble::ties::Tied;

impl Tied<'_> {
    /// The components of a constraint: translations and rotations. By default all translations, and rotations
    /// if the body has some and `turns`.
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

    /// Returns the motion that moves and turns nodes of shells.
    pub(in crate::assemble) fn motion_of_shell(
        &mut self,
        name: &str,
        table: &MoveTable,
        nodes: Option<(usize, &[u32])>,
    ) -> Option<Motion> {
        let path = ["constraint", name];
        let turn = Vector3::from(table.turn.unwrap_or_default());
        self.note_turns(&format!("constraint `{name}`: `turn`"), turn.norm());
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
                let curve = self.course(&table.timing, &path)?;
                return Some(match table.turn {
                    Some(turn) => Motion::Turn { by, turn, curve },
                    None => Motion::Displacements(by, curve),
                });
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
        let curve = self.course(&table.timing, &path)?;
        Some(match table.turn {
            Some(turn) => Motion::turn(shift, turn, nodes?.1.len(), curve),
            None => Motion::Displacement(shift, curve),
        })
    }

    /// Adds springs.
    pub(in crate::assemble) fn add_springs(&mut self, name: &str, table: &SpringTable) {
        let path = ["constraint", name];
        let Some(body) = self.find_body(&table.body, &[path[0], path[1], "body"]) else { return };
        let Some(nodes) = self.body_nodes(body, &table.nodes, &[path[0], path[1], "nodes"]) else { return };
        if !self.scene.is_implicit() {
            let message = "springs are for shells and for the solvers `static` and `implicit`";
            self.error(&path, message, "not with this solver", "take `fix`, or change the solver");
            return;
        }
        for node in nodes {
            let anchor = table.to.map_or(self.assembly.place(node as usize), Vector3::from);
            self.assembly.springs.push(Spring { node, anchor, stiffness: table.stiffness });
        }
    }
}
