//! Ties: nodes of one body that follow the cells of another.

use pliant_geometry::words::{counted, number};
use pliant_geometry::{CellId, Mesh, QualityReport};
use pliant_implicit::CarriedTurn;
use pliant_mechanics::Model;
use pliant_mechanics::mapping::Weights;
use pliant_mechanics::model::Cells;
use pliant_mechanics::tie::TieError;

use super::mortar::Joint;
use super::{Builder, BuiltBody, in_metres};
use pliant_format::diagnostic::Diagnostic;
use pliant_format::source::Source;
use pliant_format::tables::{Rotations, TieTable};

/// Part of the median edge of the followed body that a gap may have.
pub(super) const GAP: f64 = 0.1;
/// A body whose edges are longer by this factor than those of what it follows is coarser.
const COARSER: f64 = 1.2;
/// A body inside another that takes more of its volume is reported: both are stiff there.
const CROWDED: f64 = 1e-3;

/// Nodes of a body with the points of another one that they follow.
pub(crate) struct Attached {
    /// The nodes, numbered in the first model.
    pub nodes: Vec<u32>,
    /// Nodes of the second model with their weights, for each of them.
    pub mapping: Weights,
    /// The cell that holds each of them; none by mortar rows.
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
    let own = &host.model.bodies[host.index];
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
        rows.push(found.weights.iter().map(|&(node, w)| (own.node(node), w)).collect::<Vec<_>>());
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

/// The complaint about a bar that shall hold another body.
pub(crate) fn holds_nothing(source: &Source, path: &[&str], host: &str) -> Diagnostic {
    Diagnostic::error(format!("`{host}` is a bar, which holds no other body"))
        .at(source.span(path), "a bar")
        .help("name it first: its nodes follow the other body")
}

impl Builder<'_> {
    /// Adds all ties, once the bodies are there.
    pub(super) fn add_ties(&mut self) {
        let scene = self.scene;
        for (name, table) in &scene.ties {
            self.add_tie(name, table);
        }
    }

    fn add_tie(&mut self, name: &str, table: &TieTable) -> Option<()> {
        let path = ["tie", name, "between"];
        let [guest, host] = [0, 1].map(|at: usize| {
            let index = at.to_string();
            self.find_body(&table.between[at], &[path[0], path[1], path[2], &index])
        });
        let (guest, host) = (guest?, host?);
        let names = &table.between;
        if guest == host {
            let message = format!("`{}` would be tied to itself", names[0]);
            self.error(&path, message, "one body", "name two bodies");
            return None;
        }
        if self.bodies[host].is_of_bars() {
            let refused = holds_nothing(self.source(), &path, &names[1]);
            self.out.push(refused);
            return None;
        }
        let shares = |a: usize, b: usize| {
            let of = &self.assembly.bodies;
            of[a].shared.iter().any(|node| of[b].nodes.contains(node))
        };
        if shares(guest, host) || shares(host, guest) {
            let message = format!("`{}` and `{}` share their nodes already", names[0], names[1]);
            self.error(&path, message, "one on the other", "leave the tie out: `on` joins them");
            return None;
        }
        let nodes: Vec<u32> = match &table.nodes {
            Some(selection) => self.body_nodes(guest, selection, &["tie", name, "nodes"])?,
            None => self.assembly.bodies[guest].all_nodes().collect(),
        };
        let follow = table.rotations == Rotations::Follow;
        if follow && !self.can_turn(name, [guest, host], names) {
            return None;
        }
        let placed = |index: usize| Placed { body: &self.bodies[index], model: &self.assembly.model, index };
        let (source, out) = (&self.scene.source, &mut self.out);
        let found = attach(source, (name, table), (placed(guest), &nodes), placed(host), out)?;
        let found = self.by_method(Joint { name, table, guest, host }, &nodes, found)?;
        self.notes.push(found.note);
        if follow {
            let turns =
                found.nodes.iter().zip(&found.cells).map(|(&node, &cell)| self.turn(host, node, &[cell]));
            let turns: Vec<CarriedTurn> = turns.collect();
            self.assembly.turns.extend(turns);
        }
        if let Err(error) = self.assembly.model_mut().tie(name, found.nodes, found.mapping) {
            let help = self.instead_of(names, &error);
            self.error(&path, error.to_string(), "this tie", &help);
            return None;
        }
        if self.shell_cells(guest).is_some() && !follow {
            let remedy = match self.shell_cells(host) {
                Some(_) => "shells that shall keep their angle have common nodes, in one mesh",
                None => "`rotations = \"follow\"` turns it with a solid",
            };
            self.notes.push(format!(
                "`{name}` holds places, not rotations: `{}` is hinged where it is tied ({remedy})",
                names[0]
            ));
        }
        self.tell_crowding([guest, host], names);
        Some(())
    }

    /// What to do instead of a tie of two bodies that cannot be.
    fn instead_of(&self, [guest, host]: &[String; 2], error: &TieError) -> String {
        let ties = || self.scene.ties.iter().map(|(_, table)| &table.between);
        match error {
            TieError::Chain { .. } if ties().any(|[a, b]| [a, b] == [host, guest]) => {
                "leave one of the two ties out".to_owned()
            }
            TieError::Chain { .. } => {
                // What follows the guest, or what the host follows.
                let chain = ties().find_map(|[a, b]| match () {
                    () if b == guest => Some((a, guest, host)),
                    () if a == host => Some((guest, host, b)),
                    () => None,
                });
                match chain {
                    Some((last, middle, first)) => format!(
                        "tie `{last}` to `{first}`, as `{middle}` is, or leave those nodes out of one of the ties (`nodes`)"
                    ),
                    None => "leave those nodes out of one of the ties (`nodes`)".to_owned(),
                }
            }
            TieError::Twice { .. } => "leave those nodes out of one of the ties (`nodes`)".to_owned(),
        }
    }

    /// Says how much of a solid a wall inside it takes: the solid is not removed there.
    fn tell_crowding(&mut self, [guest, host]: [usize; 2], names: &[String; 2]) {
        let volume = |body: usize, walls: bool| -> f64 {
            let own = self.assembly.solids.iter().filter(|solid| solid.body == body);
            let own = own.filter(|solid| matches!(solid.cells, Cells::Membrane(..)) == walls);
            own.map(|solid| (0..solid.cells.len()).map(|cell| solid.cells.volume(cell)).sum::<f64>()).sum()
        };
        let shells: f64 = match self.shell_cells(guest) {
            Some(cells) => cells
                .iter()
                .map(|&cell| &self.assembly.facets[cell as usize])
                .map(|f| f.area * f.thickness)
                .sum(),
            None => 0.0,
        };
        let (wall, solid) = (volume(guest, true) + shells, volume(host, false));
        if solid > 0.0 && wall > CROWDED * solid {
            self.notes.push(format!(
                "the wall of `{}` takes {} % of the volume of `{}`, which is stiff and heavy there, too",
                names[0],
                number(100.0 * wall / solid),
                names[1]
            ));
        }
    }
}
