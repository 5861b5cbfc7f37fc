//! The phase [`Tied`]: nodes of one body follow the cells of another, and bodies carry surfaces.

mod attach;
mod mortar;
mod surfaces;
mod targets;
mod turns;

use pliant_format::diagnostic::{Diagnostic, SceneErrors};
use pliant_format::source::Source;
use pliant_format::tables::{Rotations, TieTable};
use pliant_geometry::Mesh;
use pliant_geometry::words::number;
use pliant_implicit::{CarriedTurn, CurvedSurface};
use pliant_mechanics::model::Cells;
use pliant_mechanics::tie::TieError;

use super::bodies::Meshed;
use super::context::follows;
pub(crate) use attach::{Placed, attach, doubt_points};
use mortar::Joint;
pub(super) use targets::Subject;

/// A body inside another that takes more of its volume is reported: both are stiff there.
const CROWDED: f64 = 1e-3;

/// The complaint about a bar that shall hold another body.
pub(crate) fn holds_nothing(source: &Source, path: &[&str], host: &str) -> Diagnostic {
    Diagnostic::error(format!("`{host}` is a bar, and no other body can be tied to a bar"))
        .at(source.span(path), "a bar")
        .help("name it first, so that its nodes follow the other body")
}

/// The second phase: bodies that are tied to each other, with the surfaces that they carry.
pub(super) struct Tied<'s> {
    pub meshed: Meshed<'s>,
    /// The meshes of the carried surfaces.
    pub surfaces: Vec<Mesh>,
    /// The curved surface of the shells, if something is carried by it.
    pub curved: Option<CurvedSurface>,
    /// Number of notes on how the bodies were made.
    pub noted: usize,
}

follows!(Tied, meshed: Meshed);

impl<'s> Meshed<'s> {
    /// Ties the bodies to each other, and adds the surfaces that they carry.
    ///
    /// # Errors
    /// All mistakes that were found, but those in surfaces.
    pub fn tied(mut self) -> Result<Tied<'s>, SceneErrors> {
        let noted = self.notes.len();
        if !self.failed() {
            self.add_ties();
        }
        self.check_explicit_only();
        self.stop_at_mistakes()?;
        let mut tied = Tied { meshed: self, surfaces: Vec::new(), curved: None, noted };
        tied.add_surfaces();
        Ok(tied)
    }
}

impl Meshed<'_> {
    fn add_ties(&mut self) {
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
        let (source, out) = (self.context.source(), &mut self.context.out);
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
                Some(_) => "to keep the angle, give both shells common nodes in one mesh",
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

    /// Returns advice for a tie of two bodies that cannot be.
    fn instead_of(&self, [guest, host]: &[String; 2], error: &TieError) -> String {
        let ties = || self.scene.ties.iter().map(|(_, table)| &table.between);
        match error {
            TieError::Chain { .. } if ties().any(|[a, b]| [a, b] == [host, guest]) => {
                "leave one of the two ties out".to_owned()
            }
            TieError::Chain { .. } => {
                // A body that follows the guest, or a body that the host follows.
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
            let solids = self.assembly.solids.iter().filter(|solid| solid.body == body);
            let solids = solids.filter(|solid| matches!(solid.cells, Cells::Membrane(..)) == walls);
            solids.map(|solid| (0..solid.cells.len()).map(|cell| solid.cells.volume(cell)).sum::<f64>()).sum()
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
                "the wall of `{}` fills {} % of the volume of `{}`: there the stiffness and mass of both count",
                names[0],
                number(100.0 * wall / solid),
                names[1]
            ));
        }
    }
}
