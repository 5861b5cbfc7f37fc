//! Ties between participants: found once all are built.

use pliant_format::diagnostic::Diagnostic;
use pliant_format::tables::{Rotations, SolverName, StepChoice, TieMethod, TieTable};
use pliant_sim::PenaltyTie;

use crate::assemble::{Placed, attach, doubt_points, holds_nothing};
use crate::world::{PlannedParticipant, World};

/// Steps in an automatic one of explicit participants that are tied to others. A body at half of its usual
/// step leaves ties more of the limit of stability: they are some twenty times stiffer.
const FINER: u64 = 2;

impl World {
    /// Finds the ties between participants, and remarks on them; mistakes go to `out`.
    pub(crate) fn find_ties(&mut self, out: &mut Vec<Diagnostic>) {
        let mut notes = Vec::new();
        for (name, table) in &self.scene.ties {
            let found = [0, 1].map(|side: usize| self.tied_body(&table.between[side]));
            let [Some((first, guest)), Some((second, host))] = found else { continue };
            if first == second {
                continue;
            }
            let built = [first, second].map(|part| &self.participants[part].built);
            let at = |side: usize, index: usize| Placed {
                body: &built[side].bodies[index],
                model: &built[side].model,
                index,
            };
            let source = &self.scene.source;
            if at(1, host).body.is_of_bars() {
                out.push(holds_nothing(source, &["tie", name, "between"], &table.between[1]));
                continue;
            }
            if table.rotations == Rotations::Follow {
                let message = format!("`{name}` ties two participants by springs, which hold places only");
                let help = "leave `rotations` out, or put both bodies into one participant with the solver `implicit` or `static`";
                let place = source.span(&["tie", name, "rotations"]);
                out.push(Diagnostic::error(message).at(place, "two participants").help(help));
                continue;
            }
            if table.method == Some(TieMethod::Mortar) {
                let message = format!("`{name}` ties two participants by springs, which act at points");
                let help = "leave `method` out, or put both bodies into one participant";
                let place = source.span(&["tie", name, "method"]);
                out.push(Diagnostic::error(message).at(place, "two participants").help(help));
                continue;
            }
            let guest = at(0, guest);
            let nodes = match chosen(table, guest) {
                Ok(nodes) => nodes,
                Err(message) => {
                    let place = source.span(&["tie", name, "nodes"]);
                    out.push(Diagnostic::error(message).at(place, "this selection"));
                    continue;
                }
            };
            let Some(found) = attach(source, (name, table), (guest, &nodes), at(1, host), out) else {
                continue;
            };
            out.extend(doubt_points(source, name, table, [guest.body, at(1, host).body]));
            let alone = found.nodes.iter().map(|&node| [(node, 1.0)]).collect::<Vec<_>>();
            let guest_nodes = pliant_mechanics::mapping::Weights::from_rows(alone.iter().map(|row| &row[..]));
            notes.push(found.note);
            self.ties.push(PenaltyTie {
                name: name.clone(),
                parts: [first, second],
                points: [guest_nodes, found.mapping],
            });
        }
        notes.into_iter().for_each(|note| self.note(note));
    }

    /// The participant of a body, and its place there.
    fn tied_body(&self, name: &str) -> Option<(usize, usize)> {
        let of = |part: &PlannedParticipant| part.built.bodies.iter().position(|body| body.name == name);
        self.participants.iter().enumerate().find_map(|(index, part)| Some((index, of(part)?)))
    }

    /// Refuses ties that springs can't hold, once steps are chosen.
    pub(crate) fn check_ties(&self, out: &mut Vec<Diagnostic>) {
        let parts = self.simulated().parts;
        for tie in &self.ties {
            if let Err(failure) = tie.slower(&parts) {
                let place = self.scene.source.span(&["tie", &tie.name, "between"]);
                let help = "put both bodies into one participant: `solver = \"implicit\"` or `\"static\"` takes shells and solids, and every solver takes membranes and solids";
                out.push(Diagnostic::error(failure.message).at(place, "of two participants").help(help));
            }
        }
    }

    /// Makes automatic steps of participants short enough for their ties to others to be stiff.
    pub(crate) fn shorten_tied(&mut self) {
        let automatic = |part: &PlannedParticipant| matches!(part.scene.run.step, StepChoice::Auto(_));
        let tied: Vec<[usize; 2]> = self.ties.iter().map(|tie| tie.parts).collect();
        let until = self.scene.scene.until;
        for (index, part) in self.participants.iter_mut().enumerate() {
            let holds = tied.iter().any(|parts| parts.contains(&index));
            if holds && part.scene.run.solver == SolverName::Explicit && automatic(part) {
                part.plan.steps.number *= FINER;
                part.plan.steps.step = until / part.plan.steps.number as f64;
            }
        }
        for [a, b] in tied {
            for (index, other) in [(a, b), (b, a)] {
                let number = self.participants[other].plan.steps.number;
                let part = &mut self.participants[index];
                if part.scene.run.solver == SolverName::Implicit && automatic(part) {
                    let steps = &mut part.plan.steps;
                    steps.number = steps.number.max(number);
                    steps.step = until / steps.number as f64;
                }
            }
        }
    }
}

/// The nodes of a body that a tie is about, in its model.
fn chosen(table: &TieTable, guest: Placed<'_>) -> Result<Vec<u32>, String> {
    let guest_body = &guest.model.bodies[guest.index];
    match &table.nodes {
        Some(selection) => {
            let found = selection.nodes(&guest.body.mesh, &guest.body.boundary);
            found
                .map(|nodes| nodes.into_iter().map(|node| guest_body.node(node)).collect())
                .map_err(|e| e.to_string())
        }
        None => Ok(guest_body.all_nodes().collect()),
    }
}
