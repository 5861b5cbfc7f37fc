//! Ties of faces of solids by mortar rows (`pliant_geometry::mortar_rows`), and which ties take them.

use std::collections::BTreeSet;

use pliant_format::diagnostic::Diagnostic;
use pliant_format::tables::{BodyModel, TieMethod, TieTable};
use pliant_geometry::words::number;
use pliant_geometry::{
    Face, Locator, MortarRow, MortarRows, MortarSide, SurfaceLocator, Vector3, mortar_rows,
};
use pliant_mechanics::mapping::Weights;

use super::Meshed;
use super::attach::{Attached, GAP, doubt_points, median_edge};
use crate::assemble::{BuiltBody, in_metres};

/// A place that is off by less than this part of the median edge is right.
const ROUNDING: f64 = 1e-13;
/// The part of the common area without tied nodes from which on a warning says so.
const MUCH_UNTIED: f64 = 0.01;

/// A tie with the places of its two bodies.
#[derive(Clone, Copy)]
pub(super) struct Joint<'t> {
    pub name: &'t str,
    pub table: &'t TieTable,
    pub guest: usize,
    pub host: usize,
}

/// Reason why mortar rows do not fit a tie.
struct Refusal {
    message: String,
    label: &'static str,
    help: &'static str,
}

impl Meshed<'_> {
    /// Lets nodes that were found as points follow by the method of a tie. `selected` are all nodes that the
    /// tie names, numbered in the model.
    pub(super) fn by_method(
        &mut self,
        joint: Joint<'_>,
        selected: &[u32],
        points: Attached,
    ) -> Option<Attached> {
        let method = joint.table.method;
        if method != Some(TieMethod::Points) {
            match self.mortar(joint, selected, &points) {
                Ok(found) if method.is_some() || self.is_glued(joint, &points, &found) => {
                    return Some(self.attached(joint, &points, found));
                }
                Err(Refusal { message, label, help }) if method.is_some() => {
                    self.error(&["tie", joint.name, "method"], message, label, help);
                    return None;
                }
                _ => {}
            }
        }
        let bodies = [joint.guest, joint.host].map(|body| &self.bodies[body]);
        let doubt = doubt_points(self.source(), joint.name, joint.table, bodies);
        self.out.extend(doubt);
        Some(points)
    }

    /// The mortar rows of the nodes that were found.
    fn mortar(
        &self,
        Joint { name, table, guest, host }: Joint<'_>,
        selected: &[u32],
        points: &Attached,
    ) -> Result<MortarRows, Refusal> {
        let names = &table.between;
        let bodies =
            names.iter().filter_map(|name| self.scene.bodies.iter().find(|(known, _)| known == name));
        if let Some((wall, table)) = bodies.into_iter().find(|(_, table)| table.model != BodyModel::Solid) {
            let model = table.model.word();
            let message = format!("`{wall}` is a {model}, and `mortar` joins faces of solids");
            return Err(Refusal {
                message,
                label: "not for these bodies",
                help: "take `method = \"points\"`",
            });
        }
        let guest_body = &self.assembly.bodies[guest];
        let selected: BTreeSet<u32> = selected.iter().copied().collect();
        let tied: BTreeSet<u32> = points.nodes.iter().copied().collect();
        let is_selected =
            |face: &&Face| face.nodes().iter().all(|&node| selected.contains(&guest_body.node(node)));
        let [BuiltBody { boundary, mesh, .. }, other] = [guest, host].map(|body| &self.bodies[body]);
        let faces: Vec<Face> = boundary.faces.iter().filter(is_selected).copied().collect();
        let found = mortar_rows(
            MortarSide { faces: &faces, points: &mesh.points },
            MortarSide { faces: &other.boundary.faces, points: &other.mesh.points },
            |node| tied.contains(&guest_body.node(node)),
            table.tolerance.unwrap_or(GAP * median_edge(&other.mesh)),
        );
        if found.rows.is_empty() {
            let message =
                format!("no face of `{}` with a tied node lies on a face of `{}`", names[0], names[1]);
            let help = "select whole faces (`nodes`), or take `method = \"points\"`";
            return Err(Refusal { message, label: "no faces", help });
        }
        let has_other = |(other, tie): &&(String, TieTable)| other != name && tie.between.contains(&names[0]);
        if found.rows.iter().any(|row| !row.free.is_empty())
            && let Some((other, _)) = self.scene.ties.iter().find(has_other)
        {
            let message = format!(
                "faces of `{}` reach beyond `{}` to nodes that `{other}` may tie, and two mortar ties cannot share a face",
                names[0], names[1]
            );
            let help =
                "take `method = \"points\"`, or a mesh with nodes where the faces of the other body end";
            return Err(Refusal { message, label: "shared faces", help });
        }
        Ok(found)
    }

    /// True if a tie without a method takes its mortar rows. The rows have to hold all selected nodes, and no
    /// node may lie deep in the other body or across a wide gap.
    fn is_glued(&self, joint: Joint<'_>, points: &Attached, found: &MortarRows) -> bool {
        let BuiltBody { boundary, mesh, .. } = &self.bodies[joint.host];
        let most = GAP * median_edge(mesh);
        if points.widest > most
            || joint.table.nodes.is_some() && !self.left_out(joint, points, found).is_empty()
        {
            return false;
        }
        let face_numbers: Vec<u32> = (0..boundary.faces.len() as u32).collect();
        let surface = SurfaceLocator::new(boundary, &face_numbers, &mesh.points);
        points.nodes.iter().all(|&node| {
            let place = Vector3::from(self.assembly.rest[node as usize]);
            surface.closest(&place).is_some_and(|found| (found.position - place).norm() <= most)
        })
    }

    /// The nodes that were found but have no row.
    fn left_out(&self, joint: Joint<'_>, points: &Attached, found: &MortarRows) -> Vec<u32> {
        let guest_body = &self.assembly.bodies[joint.guest];
        let joined: BTreeSet<u32> = found.rows.iter().map(|row| guest_body.node(row.node)).collect();
        points.nodes.iter().filter(|node| !joined.contains(node)).copied().collect()
    }

    /// Returns the nodes with their rows in the model, and notes nodes that are not tied.
    fn attached(&mut self, joint: Joint<'_>, points: &Attached, found: MortarRows) -> Attached {
        let Joint { name, table, guest, host } = joint;
        let names = &table.between;
        let left = self.left_out(joint, points, &found);
        if let (Some(&node), true) = (left.first(), table.nodes.is_some()) {
            let message = format!(
                "{} of {} selected nodes of `{}` are on no face that lies on `{}`, for example at {}",
                left.len(),
                points.nodes.len(),
                names[0],
                names[1],
                in_metres(self.assembly.rest[node as usize])
            );
            let at = self.source().span(&["tie", name, "nodes"]);
            let help = "select whole faces, or take `method = \"points\"`";
            self.out.push(Diagnostic::warning(message).at(at, "not tied").help(help));
        } else if let Some(&node) = left.first() {
            let place = in_metres(self.assembly.rest[node as usize]);
            self.notes.push(format!(
                "`{name}`: {} of {} nodes of `{}` near `{}` stay free, for example at {place}: none of their faces lies on it",
                left.len(),
                points.nodes.len(),
                names[0],
                names[1]
            ));
        }
        if found.untied > MUCH_UNTIED * found.area {
            let message = format!(
                "{} % of the common area of `{}` and `{}` is not joined: the faces of `{}` there have no node on `{}`",
                number(100.0 * found.untied / found.area),
                names[0],
                names[1],
                names[0],
                names[1]
            );
            let at = self.source().span(&["tie", name, "between"]);
            let help = "name the other body first, or refine the first one";
            self.out.push(Diagnostic::warning(message).at(at, "not joined there").help(help));
        }
        let [guest_body, other] = [guest, host].map(|body| &self.assembly.bodies[body]);
        let mesh = &self.bodies[host].mesh;
        let (locator, rounding) = (Locator::new(mesh), ROUNDING * median_edge(mesh));
        let in_model = |MortarRow { node, followed, free, offset }: &MortarRow| {
            let mut row: Vec<(u32, f64)> = followed.iter().map(|&(node, w)| (other.node(node), w)).collect();
            let place = Vector3::from(self.assembly.rest[guest_body.node(*node) as usize]);
            if offset.norm() > rounding {
                // The displacement is continued over the offset by the gradient of the cells there.
                for (at, sign) in [(place, 1.0), (place - offset, -1.0)] {
                    let Some(found) = locator.locate(at) else { continue };
                    let nodes =
                        mesh.block(found.kind).map_or(&[][..], |block| block.cell(found.cell as usize));
                    for (&node, w) in nodes.iter().zip(found.weights()) {
                        match row.iter_mut().find(|(known, _)| *known == other.node(node)) {
                            Some((_, known)) => *known += sign * w,
                            None => row.push((other.node(node), sign * w)),
                        }
                    }
                }
                row.retain(|(_, weight)| *weight != 0.0);
            }
            row.extend(free.iter().map(|&(node, w)| (guest_body.node(node), w)));
            row
        };
        let rows: Vec<Vec<(u32, f64)>> = found.rows.iter().map(in_model).collect();
        let nodes: Vec<u32> = found.rows.iter().map(|row| guest_body.node(row.node)).collect();
        let note = format!(
            "`{name}`: faces of `{}` with {} tied nodes lie on `{}` (mortar), with gaps of at most {} m",
            names[0],
            nodes.len(),
            names[1],
            number(points.widest)
        );
        let mapping = Weights::from_rows(rows.iter().map(Vec::as_slice));
        Attached { nodes, mapping, cells: Vec::new(), widest: points.widest, note }
    }
}
