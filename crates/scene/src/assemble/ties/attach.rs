//! Nodes of one body in the cells of another one: where they lie, and doubts about that.

use pliant_format::diagnostic::Diagnostic;
use pliant_format::source::Source;
use pliant_format::tables::TieTable;
use pliant_geometry::words::{counted, number};
use pliant_geometry::{CellId, Mesh, QualityReport};
use pliant_mechanics::Model;
use pliant_mechanics::mapping::Weights;

use crate::assemble::{BuiltBody, in_metres};

/// Part of the median edge of the followed body that a gap may have.
pub(super) const GAP: f64 = 0.1;
/// A body whose edges are longer by this factor than the edges of the body that it follows is coarser.
const COARSER: f64 = 1.2;

/// Nodes of a body with the points of another one that they follow.
pub(crate) struct Attached {
    /// The nodes, numbered in the first model.
    pub nodes: Vec<u32>,
    /// Nodes of the second model with their weights, for each node.
    pub mapping: Weights,
    /// Cell that holds each node; empty for mortar rows.
    pub(super) cells: Vec<CellId>,
    /// The widest gap [m].
    pub(super) widest: f64,
    /// A remark on how many there are, and the widest gap.
    pub note: String,
}

/// A body with the model that it is in.
#[derive(Clone, Copy)]
pub(crate) struct Placed<'b> {
    pub body: &'b BuiltBody,
    pub model: &'b Model,
    /// Its place among the bodies of the model.
    pub index: usize,
}

/// The median edge of a mesh [m].
pub(super) fn median_edge(mesh: &Mesh) -> f64 {
    QualityReport::new(mesh).edge_length.map_or(0.0, |edges| edges.median)
}

/// Finds where nodes of one body lie in another one, and reports the nodes that are too far away.
pub(crate) fn attach(
    source: &Source,
    (name, table): (&str, &TieTable),
    (guest, nodes): (Placed<'_>, &[u32]),
    host: Placed<'_>,
    out: &mut Vec<Diagnostic>,
) -> Option<Attached> {
    let path = ["tie", name, "between"];
    let names = &table.between;
    let tolerance = table.tolerance.unwrap_or(GAP * median_edge(&host.body.mesh));
    let locator = host.body.locator();
    let host_body = &host.model.bodies[host.index];
    let (mut tied, mut rows, mut cells, mut left) = (Vec::new(), Vec::new(), Vec::new(), 0);
    let (mut widest, mut farthest, mut nearest) = (0.0_f64, (0.0_f64, [0.0; 3]), f64::INFINITY);
    for &node in nodes {
        let place = guest.model.rest[node as usize];
        let Some(found) = locator.locate(&place.into()) else { continue };
        nearest = nearest.min(found.distance);
        if found.distance > tolerance {
            left += 1;
            if found.distance > farthest.0 {
                farthest = (found.distance, place);
            }
            continue;
        }
        widest = widest.max(found.distance);
        tied.push(node);
        cells.push(CellId { kind: found.kind, index: found.cell });
        rows.push(found.weights.iter().map(|&(node, w)| (host_body.node(node), w)).collect::<Vec<_>>());
    }
    let gap = format!("{} m", number(tolerance));
    let help = "move one of them (`at`), or give a larger `tolerance` in metres";
    let mut error = |path: &[&str], message: String, label: &str| {
        out.push(Diagnostic::error(message).at(source.span(path), label).help(help));
    };
    if tied.is_empty() {
        let message = format!(
            "no node of `{}` lies within {gap} of `{}`: the nearest is {} m away",
            names[0],
            names[1],
            number(nearest)
        );
        error(&path, message, "too far apart");
        return None;
    }
    if left > 0 {
        let message = format!(
            "{} of {} of `{}` {} farther than {gap} from `{}`, up to {} m at {}",
            left,
            counted(nodes.len(), "node"),
            names[0],
            if left == 1 { "lies" } else { "lie" },
            names[1],
            number(farthest.0),
            in_metres(farthest.1)
        );
        if table.nodes.is_some() {
            error(&["tie", name, "nodes"], message, "beyond the tolerance");
            return None;
        }
        out.push(Diagnostic::warning(message).at(source.span(&path), "not tied there").help(help));
    }
    let note = format!(
        "`{name}`: {} of `{}` {} `{}`, with gaps of at most {} m",
        counted(tied.len(), "node"),
        names[0],
        if tied.len() == 1 { "follows" } else { "follow" },
        names[1],
        number(widest)
    );
    let mapping = Weights::from_rows(rows.iter().map(Vec::as_slice));
    Some(Attached { nodes: tied, mapping, cells, widest, note })
}

/// A warning that the points of a coarse body hold a fine one, whose nodes in between stay free.
pub(crate) fn doubt_points(
    source: &Source,
    name: &str,
    table: &TieTable,
    [guest, host]: [&BuiltBody; 2],
) -> Option<Diagnostic> {
    let [mine, theirs] = [guest, host].map(|body| median_edge(&body.mesh));
    if guest.is_of_bars() || host.is_of_bars() || mine <= COARSER * theirs {
        return None;
    }
    let [coarse, fine] = &table.between;
    let message = format!(
        "`{coarse}` is coarser than `{fine}` (median edges {} and {} m), so nodes of `{fine}` between its nodes stay free",
        number(mine),
        number(theirs)
    );
    let help = format!("name `{fine}` first: `between = [\"{fine}\", \"{coarse}\"]`");
    let at = source.span(&["tie", name, "between"]);
    Some(Diagnostic::warning(message).at(at, "the finer one second").help(&help))
}
