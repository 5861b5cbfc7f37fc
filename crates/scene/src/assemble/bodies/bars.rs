//! Bars and threads: ligaments, chords of valves, sutures.

use pliant_format::tables::MeshTable;
use pliant_geometry::{CellBlock, CellKind, Mesh, Vector3};
use pliant_mechanics::element::Cord;
use pliant_mechanics::model::Cells;

use super::{Draft, Meshed, nodes};
use crate::assemble::Context;
use crate::assemble::meshes::MeshOrigin;

/// Most bars of a path.
const MOST: f64 = 1e6;

impl Context<'_> {
    /// The bars along paths from point to point. Paths meet where they have a point in common.
    pub(in crate::assemble) fn lines(&mut self, table: &MeshTable, path: &[&str]) -> Option<MeshOrigin> {
        let at = |key| [path, &[key]].concat();
        for (key, given) in [("fix", table.fix.is_some()), ("as", table.cells.is_some())] {
            if given {
                self.error(&at(key), format!("`{key}` does not go with `lines`"), "here", "leave it out");
                return None;
            }
        }
        let (mut points, mut lines): (Vec<Vector3>, Vec<u32>) = (Vec::new(), Vec::new());
        for (index, given) in table.lines.iter().flatten().enumerate() {
            let index = index.to_string();
            let place = [path, &["lines", &index]].concat();
            if given.len() < 2 || given.iter().flatten().any(|x| !x.is_finite()) {
                let help = "a path is a list of points in metres: `[[0, 0, 0], [0, 0, 0.02]]`";
                self.error(
                    &place,
                    "a path needs at least two points with finite coordinates",
                    "this path",
                    help,
                );
                return None;
            }
            let mut node = |point: Vector3| match points.iter().position(|known| *known == point) {
                Some(known) => known as u32,
                None => {
                    points.push(point);
                    points.len() as u32 - 1
                }
            };
            for ends in given.windows(2) {
                let [from, to] = [ends[0], ends[1]].map(|end| Vector3::from(end) * table.factor());
                let count = table.edge.map_or(1.0, |edge| ((to - from).norm() / edge).round().max(1.0));
                if count > MOST {
                    let message = format!("this path would have more than {MOST} bars");
                    self.error(&place, message, "too many", "give a longer `edge`");
                    return None;
                }
                let along = |part: f64| if part == count { to } else { from + (to - from) * (part / count) };
                let nodes: Vec<u32> = (0..=count as u32).map(|part| node(along(f64::from(part)))).collect();
                lines.extend(nodes.windows(2).flatten());
            }
        }
        let count = lines.len() / 2;
        let mesh = Mesh { points, blocks: vec![CellBlock::new(CellKind::Line, lines)], ..Mesh::default() };
        Some(MeshOrigin { mesh, origin: format!("lines, {}", pliant_geometry::words::counted(count, "bar")) })
    }
}

impl Meshed<'_> {
    /// Some lines of a block as bars.
    pub(super) fn bars(
        &mut self,
        draft: &Draft<'_>,
        body: usize,
        block: &CellBlock,
        lines: &[u32],
    ) -> Option<Cells> {
        let &Draft { name, table, .. } = draft;
        let Some(area) = table.area else {
            let message = format!("`{name}` is a bar and needs an `area`");
            let help = "add `area = 1e-6`, its cross section in square metres";
            self.error(&["body", name], message, "`area` is missing", help);
            return None;
        };
        let model_body = &self.assembly.bodies[body];
        let cells: Vec<[u32; 2]> =
            lines.iter().map(|&cell| nodes(block, cell, |node| model_body.node(node))).collect();
        let cord = Cord { slack: table.slack, tension_only: table.tension_only };
        Some(Cells::bar(cells, &self.assembly.rest, area, cord))
    }
}
