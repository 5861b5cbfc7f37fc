//! Contacts of the solvers `implicit` and `static`: how their barriers act, and whether bodies are apart at
//! the start.

use std::collections::HashSet;
use std::sync::Arc;

use pliant_format::tables::ContactTable;
use pliant_implicit::{AssemblyState, ContactModel, meetings};
use pliant_sim::contact::barrier::BarrierSettings;
use pliant_sim::contact::touch::{Contacts, With};

use super::{InContact, Loaded, Partner};

/// The distance of a barrier over the diagonal of all bodies, if none is given.
const DISTANCE: f64 = 1e-3;
/// Its stiffness over Young's modulus of the softest body of the contact, if none is given.
const STIFFNESS: f64 = 0.1;
/// The speed [m/s] below which friction lets bodies creep, if none is given.
const CREEP: f64 = 1e-3;

/// The barriers of a scene, as their contacts are made.
#[derive(Debug, Default)]
pub(in crate::assemble) struct BarrierTables {
    settings: Vec<BarrierSettings>,
    levels: Vec<u8>,
    /// The table of each contact.
    pub(in crate::assemble) tables: Vec<String>,
    /// True if states are searched for intersections, also without barriers.
    pub check: bool,
}

impl BarrierTables {
    /// The distance of the barrier of each contact [m].
    pub(super) fn distances(&self) -> Vec<f64> {
        self.settings.iter().map(|settings| settings.distance).collect()
    }

    pub(in crate::assemble) fn contact_model(&self, contacts: &Arc<Contacts>) -> ContactModel {
        ContactModel {
            contacts: Arc::clone(contacts),
            settings: self.settings.clone(),
            levels: self.levels.clone(),
            check_intersections: self.check,
        }
    }
}

impl Loaded<'_> {
    /// Refuses keys that only barriers have, or only contacts without them.
    pub(super) fn check_keys_of_contact(
        &mut self,
        name: &str,
        table: &ContactTable,
        is_barrier: bool,
    ) -> bool {
        let is_meet = self.scene.meets.iter().any(|(known, _)| known == name);
        let given = [
            ("barrier-distance", table.barrier_distance.is_some(), true),
            ("barrier-stiffness", table.barrier_stiffness.is_some(), true),
            ("creep-speed", table.creep_speed.is_some(), true),
            ("subdivision", table.subdivision.is_some(), true),
            ("check-intersections", table.check_intersections && is_meet, true),
        ];
        let mut fits = true;
        for (key, _, of_barrier) in given.into_iter().filter(|(_, given, of)| *given && *of != is_barrier) {
            let solvers =
                if of_barrier { "the solvers `implicit` and `static`" } else { "the solver `explicit`" };
            let message = match is_meet {
                true => format!("`{key}` of a contact is for bodies of one participant with {solvers}"),
                false => format!(
                    "`{key}` of a contact is for {solvers}, but the solver of this scene is `{}`",
                    self.scene.run.solver.word()
                ),
            };
            self.error(&["contact", name, key], message, "not for this solver", "leave it out");
            fits = false;
        }
        fits
    }

    /// Takes note of how a contact of two partners acts; the distance [m] that its surfaces keep.
    pub(super) fn barrier(
        &mut self,
        name: &str,
        table: &ContactTable,
        [touching, with]: [Partner; 2],
        barriers: &mut BarrierTables,
    ) -> Option<f64> {
        let bodies: Vec<usize> = [touching, with].into_iter().filter_map(Partner::body).collect();
        let distance = table.barrier_distance.unwrap_or_else(|| DISTANCE * self.diagonal());
        let softest = bodies.iter().filter_map(|&body| self.softest(body)).reduce(f64::min);
        let Some(stiffness) = table.barrier_stiffness.or_else(|| softest.map(|young| STIFFNESS * young))
        else {
            let message =
                format!("`{name}` needs `barrier-stiffness`: its bodies have no law to take it from");
            let help = "take a tenth of Young's modulus of the softer body [Pa]";
            self.error(&["contact", name, "between"], message, "no stiffness", help);
            return None;
        };
        let thick = |body: usize| self.thickest(body);
        let offset = table.thickness.unwrap_or_else(|| match with {
            Partner::Body(other) => 0.5 * (thick(bodies[0]) + thick(other)),
            Partner::Rigid(_) => 0.5 * thick(bodies[0]),
        });
        let level = self.level(name, table, &bodies)?;
        barriers.settings.push(BarrierSettings {
            distance,
            stiffness,
            creep_speed: table.creep_speed.unwrap_or(CREEP),
        });
        barriers.levels.push(level);
        barriers.tables.push(name.into());
        Some(offset)
    }

    /// Number of times that the triangles of shells among these bodies are divided.
    fn level(&mut self, name: &str, table: &ContactTable, bodies: &[usize]) -> Option<u8> {
        let level = table.subdivision.unwrap_or(0);
        if level == 0 {
            return Some(0);
        }
        let path = ["contact", name, "subdivision"];
        let shells: Vec<usize> =
            bodies.iter().copied().filter(|&body| self.shell_cells(body).is_some()).collect();
        if shells.is_empty() {
            let names: Vec<String> =
                bodies.iter().map(|&body| format!("`{}`", self.bodies[body].name)).collect();
            let message =
                format!("only shells have a curved surface, and {} is not a shell", names.join(" or "));
            self.error(&path, message, "no shell", "leave it out");
            return None;
        }
        let follows = self.assembly.followers();
        let turns: HashSet<u32> = self.assembly.turns.iter().map(|turn| turn.node).collect();
        let bound = shells
            .iter()
            .flat_map(|&body| self.assembly.bodies[body].all_nodes())
            .find(|node| follows[*node as usize] || turns.contains(node));
        if let Some(node) = bound {
            let (body, node) = self.assembly.locate_node(node);
            let message = format!("a tie binds node {node} of `{}` to another body", self.bodies[body].name);
            self.error(&path, message, "tied nodes", "leave it out: contact then uses flat triangles");
            return None;
        }
        Some(level)
    }

    /// The diagonal [m] of all bodies.
    fn diagonal(&self) -> f64 {
        let bounds = self.bodies.iter().filter_map(|body| body.mesh.bounds());
        let enclosing = bounds.reduce(|(a, b), (c, d)| (a.inf(&c), b.sup(&d)));
        enclosing.map_or(1.0, |(low, high)| (high - low).norm())
    }

    /// The least Young's modulus [Pa] of the laws of a body at small strain.
    fn softest(&self, body: usize) -> Option<f64> {
        let (_, table) = self.scene.bodies.get(body)?;
        let layers = table.layers.iter().filter_map(|layer| layer.law.as_ref());
        let names = table.law.values().into_iter().chain(layers);
        let laws = names.filter_map(|name| self.scene.laws.iter().find(|(known, _)| known == name));
        laws.map(|(_, law)| law.law.small_strain().young()).reduce(f64::min)
    }

    /// The largest thickness [m] of a shell; zero of another body.
    pub(super) fn thickest(&self, body: usize) -> f64 {
        let cells = self.shell_cells(body).unwrap_or_default();
        cells.iter().map(|&cell| self.assembly.facets[cell as usize].thickness).fold(0.0, f64::max)
    }

    /// Refuses features that no barrier supports: a controlled load, and jaws that hold by an ideal grip.
    pub(super) fn check_goes_with_barriers(&mut self, name: &str, contacts: &Contacts) {
        if self.scene.run.control.is_some() {
            let help = "prescribe the load, or move a tool or nodes instead";
            self.error(&["contact", name, "between"], "contact does not go with `control`", "here", help);
        }
        let held = contacts.contacts.iter().find_map(|contact| match contact.with {
            With::Rigid(rigid) => contacts.rigids[rigid].jaw.as_ref().filter(|jaw| jaw.grip.is_some()),
            _ => None,
        });
        if let Some(jaw) = held {
            let message = format!(
                "`{}` has an `ideal-grip`, which the solver `{}` does not support",
                jaw.tool,
                self.scene.run.solver.word()
            );
            let help = "leave it out, so that the jaws hold by friction, or take `solver = \"explicit\"`";
            self.error(&["contact", name, "between"], message, "an ideal grip", help);
        }
    }
}

impl InContact<'_> {
    /// The barriers of the scene.
    pub(in crate::assemble) fn barriers(&self) -> &BarrierTables {
        &self.terms.barriers
    }

    /// True if written states are searched for intersections, because no barrier prevents them.
    pub(in crate::assemble) fn checks_intersections(&self) -> bool {
        !self.scene.run.solver.solves_equations() && self.contacts.is_some() && self.terms.barriers.check
    }

    /// A contact with a barrier whose bodies have no gap at the start, and are to be pushed apart.
    pub(super) fn without_gap(&self, start: &AssemblyState) -> Option<String> {
        let (contacts, barriers) = (self.contacts.as_ref()?, &self.terms.barriers);
        let is_asked =
            |name: &String| self.scene.contacts.iter().any(|(known, table)| known == name && table.separate);
        if !barriers.tables.iter().any(is_asked) {
            return None;
        }
        let met = meetings(&barriers.contact_model(contacts), &self.assembly, start);
        let names = met.iter().map(|one| &barriers.tables[one.contact as usize]);
        names.into_iter().find(|name| is_asked(name)).cloned()
    }
}
