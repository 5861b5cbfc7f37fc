//! Triangles of thin walls that are much longer than high: equations lose their digits there.

use pliant_format::diagnostic::Diagnostic;
use pliant_geometry::words::number;
use pliant_geometry::{CellId, CellKind, Mesh};

use super::list_cells;
use crate::assemble::Context;

/// The longest edge over the least altitude of a triangle from which on it is doubted, and refused.
const DOUBTED: f64 = 1e4;
const REFUSED: f64 = 1e6;

impl Context<'_> {
    /// Refuses a mesh with triangles that are far too thin, and warns of thin ones; returns true if the mesh
    /// can be used. Triangles without area have been refused before.
    pub(super) fn check_slivers(&mut self, mesh: &Mesh, path: &[&str], place: &[&str]) -> bool {
        let Some(block) = mesh.block(CellKind::Triangle) else { return true };
        let aspect = |corners: &[u32]| {
            let [a, b, c] = [0, 1, 2].map(|k| mesh.points[corners[k] as usize]);
            let longest = [b - a, c - b, a - c].iter().map(|edge| edge.norm()).fold(0.0, f64::max);
            longest * longest / (b - a).cross(&(c - a)).norm()
        };
        let aspects: Vec<f64> = block.nodes.chunks_exact(3).map(aspect).collect();
        let above = |limit: f64| -> Vec<CellId> {
            let cells = (0..).zip(&aspects).filter(|(_, aspect)| **aspect > limit);
            cells.map(|(index, _)| CellId { kind: CellKind::Triangle, index }).collect()
        };
        let (refused, doubted) = (above(REFUSED), above(DOUBTED));
        let worst = aspects.iter().copied().fold(0.0, f64::max);
        if !refused.is_empty() {
            let message = format!(
                "`{}` has triangles more than 10⁶ times as long as high: {}",
                path[1],
                list_cells(&refused)
            );
            self.error(place, message, "this mesh", "remesh there, or take them out of the mesh");
        } else if !doubted.is_empty() {
            let message = format!(
                "`{}` has triangles up to {} times as long as high: {}",
                path[1],
                number(worst),
                list_cells(&doubted)
            );
            let span = self.source().span(place);
            let help = "equations lose digits there, and explicit steps are short: remesh";
            self.out.push(Diagnostic::warning(message).at(span, "this mesh").help(help));
        }
        refused.is_empty()
    }
}
