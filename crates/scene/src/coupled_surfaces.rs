//! Contacts between participants: found once all are built.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::Vector3;
use pliant_format::diagnostic::Diagnostic;
use pliant_format::tables::{ContactTable, SolverName};
use pliant_geometry::SurfaceLocator;
use pliant_geometry::words::number;
use pliant_sim::CoupledSurface;
use pliant_sim::contact::pairs::Surface;
use pliant_sim::contact::touch::{Contact, Touch, With};

use crate::assemble::{Meet, overlaps, told_distance, told_overlap, usual_distance};
use crate::world::World;

/// Help text: bodies of two participants that can touch.
const HOW: &str = "take a solid with `explicit` steps on the CPU and a body with `implicit` ones, or put both bodies into one participant";

/// Reason why bodies of two participants cannot touch.
struct Mistake {
    message: String,
    label: &'static str,
    help: &'static str,
}

/// Nodes of a participant as coupled nodes of another one.
struct Numbers {
    /// The number of the first.
    first: u32,
    /// Their numbers in their own participant, increasing.
    nodes: Vec<u32>,
}

impl Numbers {
    /// The number of a node as a coupled node.
    fn of(&self, node: u32) -> u32 {
        self.first + self.nodes.partition_point(|&known| known < node) as u32
    }
}

impl World {
    /// Finds the contacts between participants; mistakes go to `out`.
    pub(crate) fn find_coupled_surfaces(&mut self, out: &mut Vec<Diagnostic>) {
        let mut notes = Vec::new();
        let mut met: Vec<(Contact, [usize; 2])> = Vec::new();
        for (name, table) in &self.scene.contacts {
            let Some(sides) = self.sides(name) else { continue };
            match self.meeting(name, table, sides, &mut notes) {
                Ok(contact) => met.push((contact, sides.map(|(part, _)| part))),
                Err(Mistake { message, label, help }) => {
                    let place = self.scene.source.span(&["contact", name, "between"]);
                    out.push(Diagnostic::error(message).at(place, label).help(help));
                }
            }
        }
        notes.into_iter().for_each(|note| self.note(note));
        let numbers = self.add_coupled_surfaces(&met);
        for (contact, pair) in met {
            self.add_contact(contact, pair[0], &numbers[&pair]);
        }
    }

    /// The two participants of a contact with the surfaces that touch, first the one whose coupled nodes are
    /// nodes of the other.
    fn sides(&self, name: &str) -> Option<[(usize, &Meet); 2]> {
        let sides = self.participants.iter().enumerate().flat_map(|(part, participant)| {
            let meets = participant.built.meets.iter().filter(|meet| meet.contact == name);
            meets.map(move |meet| (part, meet))
        });
        let mut sides: Vec<(usize, &Meet)> = sides.collect();
        sides.sort_by_key(|(part, _)| {
            let participant = &self.participants[*part];
            participant.built.implicit.is_some() || participant.scene.run.solver != SolverName::Explicit
        });
        sides.try_into().ok()
    }

    /// The contact of two sides, with nodes by their numbers in their own participants.
    fn meeting(
        &self,
        name: &str,
        table: &ContactTable,
        sides: [(usize, &Meet); 2],
        notes: &mut Vec<String>,
    ) -> Result<Contact, Mistake> {
        self.can_meet(table, sides)?;
        let [touching, other] = sides.map(|(_, meet)| meet);
        let mut surface = other.surface.clone();
        if self.is_behind(sides) {
            surface.faces.iter_mut().for_each(|face| face.swap(1, 2));
            notes.push(format!(
                "contact `{name}`: `{}` touches with its nearer side, although its normals point the other way",
                table.between[other.side]
            ));
        }
        if let Some(message) = self.overlap(sides, &surface) {
            let help = "move one of them (`at` of its mesh)";
            return Err(Mistake { message, label: "overlapping", help });
        }
        // Half of the thickness of shells, or what solids keep.
        let usual = touching.offset + other.offset;
        let offset = table.thickness.unwrap_or_else(|| {
            let (second, place) = self.side_by_side(sides, &surface);
            if usual > 0.0 { usual } else { usual_distance(&touching.surface, Some(&second), place) }
        });
        if table.thickness.is_none() && usual == 0.0 {
            notes.push(told_distance(name, [offset; 2]));
        }
        let touch = Touch { friction: table.friction, offset };
        Ok(Contact { name: name.into(), surface: touching.surface.clone(), with: With::Body(surface), touch })
    }

    /// Checks that the solvers, bodies and ties of two participants let them touch.
    fn can_meet(&self, table: &ContactTable, sides: [(usize, &Meet); 2]) -> Result<(), Mistake> {
        let solvers = sides.map(|(part, _)| self.participants[part].scene.run.solver);
        if solvers != [SolverName::Explicit, SolverName::Implicit] {
            let [first, second] = &table.between;
            let message = format!(
                "`{first}` and `{second}` belong to two participants whose solvers cannot share a contact"
            );
            return Err(Mistake { message, label: "two participants", help: HOW });
        }
        if sides.iter().any(|(_, meet)| meet.surface.faces.is_empty()) {
            return Err(Mistake {
                message: "contact between participants needs faces, and bars have no faces".into(),
                label: "no faces",
                help: "name a solid next to the bar, or let the bar touch obstacles and tools only",
            });
        }
        if !self.ties.is_empty() {
            return Err(Mistake {
                message: "participants can be tied to each other or touch each other, but not both".into(),
                label: "next to a tie",
                help: "put bodies that are tied into one participant",
            });
        }
        Ok(())
    }

    /// Makes the nodes of second surfaces coupled nodes of the first participants; their numbers for each
    /// pair of participants.
    fn add_coupled_surfaces(&mut self, met: &[(Contact, [usize; 2])]) -> BTreeMap<[usize; 2], Numbers> {
        let mut nodes: BTreeMap<[usize; 2], Vec<u32>> = BTreeMap::new();
        for (contact, pair) in met {
            if let With::Body(surface) = &contact.with {
                nodes.entry(*pair).or_default().extend(&surface.nodes);
            }
        }
        let add = |(pair, mut nodes): ([usize; 2], Vec<u32>)| {
            nodes.sort_unstable();
            nodes.dedup();
            let [host, of] = pair;
            let rest = &self.participants[of].built.model.rest;
            let places: Vec<[f64; 3]> = nodes.iter().map(|&node| rest[node as usize]).collect();
            let built = Arc::make_mut(&mut self.participants[host].built);
            let coupled_nodes = &mut Arc::make_mut(built.contacts.get_or_insert_default()).coupled_nodes;
            let first = (built.model.node_count() + coupled_nodes.len()) as u32;
            coupled_nodes.extend(places);
            self.coupled_surfaces.push(CoupledSurface { host, of, nodes: nodes.clone() });
            (pair, Numbers { first, nodes })
        };
        nodes.into_iter().map(add).collect()
    }

    /// Adds a contact to its first participant, with these numbers of the nodes of its second surface.
    fn add_contact(&mut self, mut contact: Contact, host: usize, numbers: &Numbers) {
        if let With::Body(surface) = &mut contact.with {
            *surface = surface.numbered(|node| numbers.of(node));
        }
        let built = Arc::make_mut(&mut self.participants[host].built);
        let (rest, contacts) = (&built.model.rest, Arc::make_mut(built.contacts.get_or_insert_default()));
        let place = |node: u32| -> Vector3<f64> {
            let node = node as usize;
            rest.get(node).unwrap_or_else(|| &contacts.coupled_nodes[node - rest.len()]).to_owned().into()
        };
        let near = contact.pairs(|node| node, place).map(|(mut pairs, _)| pairs.nearer(place));
        if let Some(near) = near.filter(|near| !near.is_empty()) {
            contacts.near.insert(contacts.contacts.len(), near);
        }
        contacts.contacts.push(contact);
    }

    /// True if the second body is a sheet whose normals point away from the first one.
    fn is_behind(&self, sides: [(usize, &Meet); 2]) -> bool {
        let [(host, touching), (of, other)] = sides;
        let sheet = &self.participants[of].built.bodies[other.body];
        if sheet.mesh.volume_blocks().any(|block| !block.is_empty()) {
            return false;
        }
        let face_numbers: Vec<u32> = (0..sheet.boundary.faces.len() as u32).collect();
        let faces = SurfaceLocator::new(&sheet.boundary, &face_numbers, &sheet.mesh.points);
        let rest = &self.participants[host].built.model.rest;
        let ways = touching.surface.nodes.iter().filter_map(|&node| {
            let at = Vector3::from(rest[node as usize]);
            let found = faces.closest(&at)?;
            let way = at - found.position;
            Some((way.norm_squared(), way.dot(&found.normal)))
        });
        ways.min_by(|a, b| a.0.total_cmp(&b.0)).is_some_and(|(_, along)| along < 0.0)
    }

    /// Returns a surface of the second participant with its nodes numbered after the nodes of the first. Also
    /// returns the places [m] of all nodes at rest.
    fn side_by_side(
        &self,
        sides: [(usize, &Meet); 2],
        surface: &Surface,
    ) -> (Surface, impl Fn(u32) -> Vector3<f64> + Copy + use<'_>) {
        let models = sides.map(|(part, _)| &self.participants[part].built.model);
        let first = models[0].node_count() as u32;
        let place = move |node: u32| -> Vector3<f64> {
            let (model, node) = if node < first { (models[0], node) } else { (models[1], node - first) };
            model.rest[node as usize].into()
        };
        (surface.numbered(|node| first + node), place)
    }

    /// Describes the overlap of the surfaces of two participants at the start; `None` without one.
    fn overlap(&self, sides: [(usize, &Meet); 2], surface: &Surface) -> Option<String> {
        let bodies = sides.map(|(part, meet)| &self.participants[part].built.bodies[meet.body]);
        let (other, place) = self.side_by_side(sides, surface);
        let touching = &sides[0].1.surface;
        let size = touching.nodes.iter().map(|&node| place(node).amax()).fold(0.0, f64::max);
        let inside = overlaps([(bodies[0], touching), (bodies[1], &other)], size, place);
        told_overlap([&bodies[0].name, &bodies[1].name], &inside)
    }

    /// Refuses contacts between participants whose steps do not fit, once these are chosen.
    pub(crate) fn check_coupled_surfaces(&self, out: &mut Vec<Diagnostic>) {
        let common = self.steps();
        for set in &self.coupled_surfaces {
            let of = &self.participants[set.of];
            if of.plan.steps.number == common {
                continue;
            }
            let names = self.scene.contacts.iter().map(|(name, _)| name);
            let mut names = names.filter(|name| of.built.meets.iter().any(|meet| meet.contact == **name));
            let Some(name) = names.next() else { continue };
            let message = format!(
                "participant `{}` has steps of {} s, but its contact with `{}` needs the longest step of all participants",
                of.name,
                number(of.plan.steps.step),
                self.participants[set.host].name
            );
            let place = self.scene.source.span(&["contact", name, "between"]);
            let help = "give all implicit participants the same `step`, longer than the explicit steps";
            out.push(Diagnostic::error(message).at(place, "shorter steps").help(help));
        }
    }
}
