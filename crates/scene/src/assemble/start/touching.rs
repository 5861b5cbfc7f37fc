//! Contacts of solvers with barriers act from the start on, unless bodies have no gap there.

use std::collections::BTreeMap;

use pliant_geometry::words::{counted, number};
use pliant_implicit::{apart_counts, meetings};
use pliant_sim::contact::barrier::Meeting;

use super::Started;
use crate::assemble::in_metres;

/// Places without a gap that are listed.
const LISTED: usize = 3;

impl Started<'_> {
    /// Gives the contacts to the model of a solver with barriers, unless bodies have no gap at the start.
    pub(super) fn touch(&mut self) {
        let (Some(contacts), Some(start)) = (self.contacts.clone(), &self.start) else { return };
        if !self.scene.run.solver.solves_equations() {
            return;
        }
        let model = self.barriers().contact_model(&contacts);
        let tables = self.barriers().tables.clone();
        let met = meetings(&model, &self.assembly, start);
        let mut of_contacts = BTreeMap::<u32, Vec<Meeting>>::new();
        met.into_iter().for_each(|one| of_contacts.entry(one.contact).or_default().push(one));
        for (contact, met) in &of_contacts {
            self.refuse_meetings(&contacts.contacts[*contact as usize].name, &tables[*contact as usize], met);
        }
        for (contact, count) in contacts.contacts.iter().zip(apart_counts(&model, &self.assembly)) {
            if count > 0 {
                self.notes.push(format!(
                    "contact `{}`: {} (a node and a triangle, or two edges) never touch, because they are in one place at rest",
                    contact.name,
                    counted(count, "pair")
                ));
            }
        }
        self.assembly.contact = Some(model);
    }

    fn refuse_meetings(&mut self, contact: &str, table: &str, met: &[Meeting]) {
        let message = |one: &Meeting| {
            let (body, node) = self.assembly.locate_node(one.node);
            let how = match one.gap {
                Some(gap) => format!("a gap of {} m", number(gap)),
                None => "an edge through a triangle".into(),
            };
            format!("node {node} of `{}` at {}: {how}", self.bodies[body].name, in_metres(one.place))
        };
        let mut sorted = met.to_vec();
        sorted.sort_by(|a, b| {
            a.gap.unwrap_or(f64::NEG_INFINITY).total_cmp(&b.gap.unwrap_or(f64::NEG_INFINITY))
        });
        let first: Vec<String> = sorted.iter().take(LISTED).map(message).collect();
        let message = format!(
            "contact `{contact}` has no gap at the start in {}: {}{}",
            counted(met.len(), "place"),
            first.join("; "),
            if met.len() > LISTED { "; …" } else { "" }
        );
        let asked = self.scene.contacts.iter().find(|(known, _)| known == table).map(|(_, table)| table);
        let help = match asked {
            Some(table) if table.separate || table.gap.is_some() => {
                "move one of them (`at`), make `thickness` smaller, or take finer cells there: overlaps must be smaller than the cells"
            }
            _ => {
                "push the bodies apart with `gap = 2e-4` or `separate = true`, move one of them (`at`), or make `thickness` smaller: \
                 a barrier needs a gap at the start"
            }
        };
        self.error(&["contact", table, "between"], message, "no gap", help);
    }
}
