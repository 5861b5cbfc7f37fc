//! Contacts between participants: found once all are built.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::Vector3;
use pliant_geometry::SurfaceLocator;
use pliant_geometry::words::number;
use pliant_sim::Guests;
use pliant_sim::contact::pairs::Surface;
use pliant_sim::contact::touch::{Contact, Touch, With};

use crate::assemble::{Meet, overlaps, told_distance, told_overlap, usual_distance};
use crate::world::World;
use pliant_format::diagnostic::Diagnostic;
use pliant_format::tables::SolverName;

/// How bodies of two participants can touch.
const HOW: &str = "a solid with `explicit` steps on the CPU and bodies with `implicit` ones touch each other; or put both bodies into one participant";

impl World {
    /// Finds the contacts between participants; mistakes go to `out`.
    pub(crate) fn find_guests(&mut self, out: &mut Vec<Diagnostic>) {
        let mut notes = Vec::new();
        let mut met: Vec<(Contact, [usize; 2])> = Vec::new();
        let mut nodes: BTreeMap<[usize; 2], Vec<u32>> = BTreeMap::new();
        for (name, table) in &self.scene.contacts {
            let sides = self.participants.iter().enumerate().flat_map(|(part, own)| {
                let meets = own.built.meets.iter().filter(|meet| meet.contact == *name);
                meets.map(move |meet| (part, meet))
            });
            let mut sides: Vec<(usize, &Meet)> = sides.collect();
            sides.sort_by_key(|(part, _)| {
                let own = &self.participants[*part];
                own.built.implicit.is_some() || own.scene.run.solver != SolverName::Explicit
            });
            let [(host, own), (of, other)] = sides[..] else { continue };
            let path = ["contact", name.as_str(), "between"];
            let place = self.scene.source.span(&path);
            let solvers = [host, of].map(|part| self.participants[part].scene.run.solver);
            if solvers != [SolverName::Explicit, SolverName::Implicit] {
                let message = format!(
                    "`{}` and `{}` are of two participants that cannot touch each other",
                    table.between[0], table.between[1]
                );
                out.push(Diagnostic::error(message).at(place, "two participants").help(HOW));
                continue;
            }
            if own.surface.faces.is_empty() || other.surface.faces.is_empty() {
                let message = "bodies of two participants touch each other by faces, and bars have none";
                let help = "name the solid beside it, or let it touch obstacles and tools only";
                out.push(Diagnostic::error(message).at(place, "no faces").help(help));
                continue;
            }
            if !self.ties.is_empty() {
                let message = "participants are tied to each other or touch each other, not both";
                let help = "put bodies that are tied into one participant";
                out.push(Diagnostic::error(message).at(place, "beside a tie").help(help));
                continue;
            }
            let mut surface = other.surface.clone();
            if self.is_behind([(host, own), (of, other)]) {
                surface.faces.iter_mut().for_each(|face| face.swap(1, 2));
                notes.push(format!(
                    "contact `{name}`: `{}` touches by its nearer side, which its normals point away from",
                    table.between[other.side]
                ));
            }
            let sides = [(host, own), (of, other)];
            if let Some(told) = self.overlap(sides, &surface) {
                let help = "move one of them (`at` of its mesh)";
                out.push(Diagnostic::error(told).at(place, "overlapping").help(help));
                continue;
            }
            let (second, place) = self.side_by_side(sides, &surface);
            let offset = table.thickness.unwrap_or_else(|| {
                // Half of the thickness of shells, or what solids keep.
                let usual = own.offset + other.offset;
                if usual > 0.0 { usual } else { usual_distance(&own.surface, Some(&second), place) }
            });
            if table.thickness.is_none() && own.offset + other.offset == 0.0 {
                notes.push(told_distance(name, [offset; 2]));
            }
            let touch = Touch { friction: table.friction, offset };
            nodes.entry([host, of]).or_default().extend(&other.surface.nodes);
            let contact = Contact {
                name: name.clone(),
                surface: own.surface.clone(),
                with: With::Body(surface),
                touch,
            };
            met.push((contact, [host, of]));
        }
        notes.into_iter().for_each(|note| self.note(note));
        let mut counts: BTreeMap<usize, u32> = BTreeMap::new();
        let mut first: BTreeMap<[usize; 2], u32> = BTreeMap::new();
        for (&[host, of], own) in &mut nodes {
            own.sort_unstable();
            own.dedup();
            let model = &self.participants[host].built.model;
            let taken = counts.entry(host).or_insert(model.node_count() as u32);
            first.insert([host, of], *taken);
            *taken += own.len() as u32;
            let rest = &self.participants[of].built.model.rest;
            let places: Vec<[f64; 3]> = own.iter().map(|&node| rest[node as usize]).collect();
            let built = Arc::make_mut(&mut self.participants[host].built);
            Arc::make_mut(built.contacts.get_or_insert_default()).guests.extend(places);
            self.guests.push(Guests { host, of, nodes: own.clone() });
        }
        for (mut contact, pair) in met {
            let (own, first) = (&nodes[&pair], first[&pair]);
            if let With::Body(surface) = &mut contact.with {
                *surface = surface.numbered(|node| first + own.partition_point(|&known| known < node) as u32);
            }
            let built = Arc::make_mut(&mut self.participants[pair[0]].built);
            let (rest, contacts) = (&built.model.rest, Arc::make_mut(built.contacts.get_or_insert_default()));
            let place = |node: u32| -> Vector3<f64> {
                let node = node as usize;
                rest.get(node).unwrap_or_else(|| &contacts.guests[node - rest.len()]).to_owned().into()
            };
            let near = contact.pairs(|node| node, place).map(|(mut pairs, _)| pairs.nearer(place));
            if let Some(near) = near.filter(|near| !near.is_empty()) {
                contacts.near.insert(contacts.contacts.len(), near);
            }
            contacts.contacts.push(contact);
        }
    }

    /// Whether the second body is a sheet whose side towards the first one is that which its normals point away from.
    fn is_behind(&self, sides: [(usize, &Meet); 2]) -> bool {
        let [(host, own), (of, other)] = sides;
        let sheet = &self.participants[of].built.bodies[other.body];
        if sheet.mesh.volume_blocks().any(|block| !block.is_empty()) {
            return false;
        }
        let all: Vec<u32> = (0..sheet.boundary.faces.len() as u32).collect();
        let faces = SurfaceLocator::new(&sheet.boundary, &all, &sheet.mesh.points);
        let rest = &self.participants[host].built.model.rest;
        let ways = own.surface.nodes.iter().filter_map(|&node| {
            let at = Vector3::from(rest[node as usize]);
            let found = faces.closest(&at)?;
            let way = at - found.position;
            Some((way.norm_squared(), way.dot(&found.normal)))
        });
        ways.min_by(|a, b| a.0.total_cmp(&b.0)).is_some_and(|(_, along)| along < 0.0)
    }

    /// A surface of the second participant with its nodes numbered after those of the first, and the places [m] of all at rest.
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

    /// How the surfaces of two participants overlap at the start, in words; `None` where they do not.
    fn overlap(&self, sides: [(usize, &Meet); 2], surface: &Surface) -> Option<String> {
        let bodies = sides.map(|(part, meet)| &self.participants[part].built.bodies[meet.body]);
        let (other, place) = self.side_by_side(sides, surface);
        let own = &sides[0].1.surface;
        let size = own.nodes.iter().map(|&node| place(node).amax()).fold(0.0, f64::max);
        let inside = overlaps([(bodies[0], own), (bodies[1], &other)], size, place);
        told_overlap([&bodies[0].name, &bodies[1].name], &inside)
    }

    /// Refuses contacts between participants whose steps do not fit, once these are chosen.
    pub(crate) fn check_guests(&self, out: &mut Vec<Diagnostic>) {
        let common = self.steps();
        for set in &self.guests {
            let of = &self.participants[set.of];
            if of.plan.steps.number == common {
                continue;
            }
            let names = self.scene.contacts.iter().map(|(name, _)| name);
            let mut names = names.filter(|name| of.built.meets.iter().any(|meet| meet.contact == **name));
            let Some(name) = names.next() else { continue };
            let message = format!(
                "participant `{}` has steps of {} s, and another one has longer ones: its contact with `{}` needs the longest",
                of.name,
                number(of.plan.steps.step),
                self.participants[set.host].name
            );
            let place = self.scene.source.span(&["contact", name, "between"]);
            let help = "give implicit participants the same `step`, longer than that of explicit ones";
            out.push(Diagnostic::error(message).at(place, "shorter steps").help(help));
        }
    }
}
