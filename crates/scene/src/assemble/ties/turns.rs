//! Rotations of shells that follow the solid that they are tied to or on.

use std::collections::HashSet;

use pliant_geometry::{CellId, Face, Vector3, gradient_integrals};
use pliant_implicit::CarriedTurn;

use super::Meshed;

impl Meshed<'_> {
    /// True if tied nodes of one body can turn with another.
    pub(super) fn can_turn(&mut self, name: &str, [guest, host]: [usize; 2], names: &[String; 2]) -> bool {
        let path = ["tie", name, "rotations"];
        if self.shell_cells(guest).is_none() {
            let message = format!("`{}` is not a shell: its nodes have no rotations", names[0]);
            self.error(&path, message, "nothing turns", "leave it out");
            return false;
        }
        if self.bodies[host].mesh.volume_blocks().all(|block| block.is_empty()) {
            let message = format!("`{}` is not a solid, and rotations follow only solids", names[1]);
            let help = "leave it out; shells of one mesh, or with common nodes, turn together";
            self.error(&path, message, "not a solid", help);
            return false;
        }
        true
    }

    /// Returns the rotation of a node with cells of a solid: with the mean of their gradients, by volume.
    pub(super) fn turn(&self, host: usize, node: u32, cells: &[CellId]) -> CarriedTurn {
        let (mesh, host_body) = (&self.bodies[host].mesh, &self.assembly.bodies[host]);
        let mut gradient: Vec<(u32, Vector3)> = Vec::new();
        let mut whole = 0.0;
        for cell in cells {
            let Some(block) = mesh.block(cell.kind) else { continue };
            let corners = block.cell(cell.index as usize);
            let places: Vec<Vector3> = corners.iter().map(|&corner| mesh.points[corner as usize]).collect();
            let (volume, integrals) = gradient_integrals(cell.kind, &places);
            whole += volume;
            for (&corner, integral) in corners.iter().zip(integrals) {
                let corner = host_body.node(corner);
                match gradient.iter_mut().find(|(known, _)| *known == corner) {
                    Some((_, sum)) => *sum += integral,
                    None => gradient.push((corner, integral)),
                }
            }
        }
        gradient.iter_mut().for_each(|(_, g)| *g /= whole);
        CarriedTurn { node, gradient }
    }

    /// Lets the nodes of a wall on faces of a solid turn with the cells behind these.
    pub(in crate::assemble) fn turn_wall(&mut self, host: usize, faces: &[Face]) {
        let mut behind: Vec<(u32, CellId)> = Vec::new();
        for face in faces {
            behind.extend(face.nodes().iter().map(|&node| (node, face.parent)));
        }
        behind.sort_unstable();
        behind.dedup();
        // Where two walls meet, the first one says.
        let known: HashSet<u32> = self.assembly.turns.iter().map(|turn| turn.node).collect();
        for of_node in behind.chunk_by(|a, b| a.0 == b.0) {
            let cells: Vec<CellId> = of_node.iter().map(|&(_, cell)| cell).collect();
            let node = self.assembly.bodies[host].node(of_node[0].0);
            if !known.contains(&node) {
                let turn = self.turn(host, node, &cells);
                self.assembly.turns.push(turn);
            }
        }
    }
}
