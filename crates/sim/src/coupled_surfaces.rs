//! Contact between participants: the surface of one whose equations are solved is coupled into the contacts
//! of an explicit one.
//!
//! The implicit participant takes its step H. Its surface then moves from its old to its new place at
//! constant speed. The explicit participant takes its steps h against this surface, as against a tool. Its
//! impulses P give the mean force P/H on the implicit participant. The step is repeated with this force,
//! [`PASSES`] times at most. It ends when the force on the surface differs by less than a part of [`FOUND`].
//! The rest acts in the next step, so that momentum is kept.
//!
//! In a pass the surface feels f − k (x − x̄), with f and x̄ of the pass before: at the end only f. The
//! impedance of an explicit body with the mass m of a surface node is 2 m/h. So its force changes by 2 m/(h
//! H) (x − x̄) in the step. With twice that as k, passes converge for walls of a hundredth of the mass of a
//! node and for heavy ones. This holds with and without stiffness. With half of that they do not converge
//! (measured with bars).

use std::ops::Range;

use pliant_contact::pairs::Surface;
use pliant_contact::touch::Contact;
use pliant_mechanics::count::Count;
use pliant_mechanics::grip::Grip;
use pliant_mechanics::tensor::{Vector, add, cross, dot, scale, sub};
use serde::{Deserialize, Serialize};

use crate::failure::Failure;
use crate::participant::Participant;
use crate::participant_setup::{Method, ParticipantSetup};

/// Difference of the forces on both sides at which a step is found, over the mean force of the impulses.
const FOUND: f64 = 0.01;
/// Times that a step is taken at most.
const PASSES: u32 = 6;
/// k h H/m.
const FIRM: f64 = 4.0;

/// Nodes of a participant that are coupled into the contacts of another one: in the order of these sets, its
/// [`coupled_nodes`](pliant_contact::touch::Contacts::coupled_nodes).
#[derive(Clone, Debug)]
pub struct CoupledSurface {
    /// The explicit participant, by its place in the setup.
    pub host: usize,
    /// The implicit participant whose nodes they are.
    pub of: usize,
    /// The nodes.
    pub nodes: Vec<u32>,
}

/// The contact of two participants at an instant.
#[derive(Clone, Copy, Debug)]
pub struct CoupledSurfaceNow {
    /// The explicit and the implicit participant, by their places in the setup.
    pub parts: [usize; 2],
    /// The mean force [N] over the last step on the explicit and on the implicit one.
    pub forces: [Vector<f64>; 2],
    /// Mean of the times that a step in contact was taken.
    pub passes: f64,
    /// The largest difference of the forces on both sides in a step, over the mean force of the impulses.
    pub worst: f64,
}

/// State of coupled nodes that a restart needs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct CouplingMemory {
    /// Force of each coupled node in the last step [N], and the impulse [N s] that the node is still to feel.
    nodes: Vec<[Vector<f64>; 2]>,
    /// Steps of each set in contact, and the passes that they took in all.
    counts: Vec<[u64; 2]>,
    /// Relative difference of the forces of each set on both sides over the last step, and these forces [N].
    last: Vec<(f64, [Vector<f64>; 2])>,
    /// The largest difference so far.
    worst: Vec<f64>,
}

impl CouplingMemory {
    /// True if there are no sets.
    pub(crate) fn is_empty(&self) -> bool {
        self.counts.is_empty()
    }

    /// True if the memory belongs to some sets, or is empty.
    pub(crate) fn fits(&self, sets: &[CoupledSurface]) -> bool {
        let coupled_nodes: usize = sets.iter().map(|set| set.nodes.len()).sum();
        let lengths = [self.nodes.len(), self.counts.len(), self.last.len(), self.worst.len()];
        let counted = self.counts.iter().flatten().all(|count| count.can_go_on());
        counted && (lengths == [0; 4] || lengths == [coupled_nodes, sets.len(), sets.len(), sets.len()])
    }
}

/// A coupled node.
struct CoupledNode {
    node: u32,
    /// Its place at rest [m].
    rest: Vector<f64>,
    /// k [N/m].
    stiffness: f64,
    /// x̄ [m].
    anchor: Vector<f64>,
    /// f [N].
    force: Vector<f64>,
    /// Its way in the step [m].
    way: [Vector<f64>; 2],
}

impl CoupledNode {
    fn place(&self, participant: &dyn Participant) -> Vector<f64> {
        add(self.rest, participant.displacement(self.node as usize))
    }

    /// True if contacts push the node.
    fn is_pushed(&self) -> bool {
        self.force != [0.0; 3]
    }

    fn grip(&self) -> Grip {
        let place = add(self.anchor, scale(self.force, 1.0 / self.stiffness));
        Grip { nodes: vec![(self.node, 1.0)], place, stiffness: self.stiffness }
    }
}

/// Ranges of the coupled nodes of a set among all coupled nodes, and among the coupled nodes of its host.
#[derive(Clone)]
struct Places {
    among_all: Range<usize>,
    at_host: Range<usize>,
}

/// The coupled nodes of a simulation.
pub(crate) struct Meetings {
    sets: Vec<CoupledSurface>,
    places: Vec<Places>,
    coupled_nodes: Vec<CoupledNode>,
    /// Room for the ways of all coupled nodes of a host.
    ways: Vec<[Vector<f64>; 2]>,
    memory: CouplingMemory,
}

impl Meetings {
    /// Makes the coupled nodes of a setup, from a remembered state or an empty one. `ratios` are the steps of
    /// each participant between common instants.
    ///
    /// # Errors
    /// If participants cannot be coupled like this.
    pub(crate) fn new(
        sets: &[CoupledSurface],
        parts: &[ParticipantSetup],
        ratios: &[u64],
        memory: CouplingMemory,
    ) -> Result<Self, Failure> {
        let (mut coupled_nodes, mut places) = (Vec::new(), Vec::new());
        let mut counts = vec![0; parts.len()];
        for set in sets {
            set.check(parts)?;
            if ratios[set.of] != 1 {
                return Err(set
                    .refused(parts, "has shorter steps than another participant: give it the longest step"));
            }
            let (host, of) = (&parts[set.host], &parts[set.of]);
            let at_host = counts[set.host]..counts[set.host] + set.nodes.len();
            counts[set.host] = at_host.end;
            let [first, end] =
                [at_host.start, at_host.end].map(|number| (host.model.node_count() + number) as u32);
            let rest = |node: u32| of.model.rest[node as usize];
            let areas = areas(host, &(first..end), |node| rest(set.nodes[(node - first) as usize]));
            let unit = FIRM / (host.steps.step * of.steps.step) * mass_per_area(host, &(first..end));
            if areas.iter().any(|&area| unit * area <= 0.0) {
                return Err(set.refused(
                    parts,
                    "has contact nodes without a face, or the other participant has no surface that they touch",
                ));
            }
            places.push(Places {
                among_all: coupled_nodes.len()..coupled_nodes.len() + set.nodes.len(),
                at_host,
            });
            coupled_nodes.extend(set.nodes.iter().zip(areas).map(|(&node, area)| CoupledNode {
                node,
                rest: rest(node),
                stiffness: unit * area,
                anchor: [0.0; 3],
                force: [0.0; 3],
                way: [[0.0; 3]; 2],
            }));
        }
        for (part, count) in parts.iter().zip(counts) {
            let awaited = part.method.contacts().map_or(0, |contacts| contacts.coupled_nodes.len());
            if awaited != count {
                return Err(Failure::input(&format_args!(
                    "contacts of participant `{}` expect {awaited} nodes of other participants, but the setup has {count}",
                    part.name
                )));
            }
        }
        let memory = match memory.counts.is_empty() {
            true => CouplingMemory {
                nodes: vec![[[0.0; 3]; 2]; coupled_nodes.len()],
                counts: vec![[0; 2]; sets.len()],
                last: vec![(0.0, [[0.0; 3]; 2]); sets.len()],
                worst: vec![0.0; sets.len()],
            },
            false => memory,
        };
        Ok(Self { sets: sets.to_vec(), places, coupled_nodes, ways: Vec::new(), memory })
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.sets.is_empty()
    }

    pub(crate) fn memory(&self) -> &CouplingMemory {
        &self.memory
    }

    /// True if a participant is a host: it takes its steps against coupled nodes.
    pub(crate) fn is_host(&self, part: usize) -> bool {
        self.sets.iter().any(|set| set.host == part)
    }

    /// Prepares the first pass of a step from where all participants meet: forces and places to be expected,
    /// so that forces can be found there.
    pub(crate) fn meet(&mut self, parts: &[ParticipantSetup], participants: &mut [Box<dyn Participant>]) {
        for (set, Places { among_all, .. }) in self.sets.iter().zip(&self.places) {
            let (step, participant) = (parts[set.of].steps.step, participants[set.of].as_ref());
            let remembered = &self.memory.nodes[among_all.clone()];
            for (coupled, &[force, owed]) in self.coupled_nodes[among_all.clone()].iter_mut().zip(remembered)
            {
                let here = coupled.place(participant);
                coupled.anchor = add(here, scale(participant.last_velocity(coupled.node as usize), step));
                coupled.force = add(force, scale(owed, 1.0 / step));
                coupled.way = [here, coupled.anchor];
            }
        }
        self.lead(|_| true, parts, participants);
    }

    /// Follows the step of a participant, before its hosts take theirs.
    pub(crate) fn after(
        &mut self,
        part: usize,
        parts: &[ParticipantSetup],
        participants: &mut [Box<dyn Participant>],
    ) {
        for (_, Places { among_all, .. }) in
            self.sets.iter().zip(&self.places).filter(|(set, _)| set.of == part)
        {
            for coupled in &mut self.coupled_nodes[among_all.clone()] {
                coupled.way[1] = coupled.place(participants[part].as_ref());
            }
        }
        self.lead(|set| set.of == part, parts, participants);
    }

    /// Passes to the hosts of some sets the ways of their coupled nodes in the step. The step begins where
    /// all participants meet.
    fn lead(
        &mut self,
        of: impl Fn(&CoupledSurface) -> bool,
        parts: &[ParticipantSetup],
        participants: &mut [Box<dyn Participant>],
    ) {
        let Self { sets, places, coupled_nodes, ways, .. } = self;
        for (host, participant) in participants.iter_mut().enumerate() {
            let of_host = || sets.iter().zip(&*places).filter(|(set, _)| set.host == host);
            let Some((set, _)) = of_host().find(|(set, _)| of(set)) else { continue };
            ways.clear();
            ways.extend(
                of_host()
                    .flat_map(|(_, places)| &coupled_nodes[places.among_all.clone()])
                    .map(|coupled| coupled.way),
            );
            let begin = participant.time();
            participant.lead_coupled_surfaces([begin, begin + parts[set.of].steps.step], ways);
        }
    }

    /// Adds what pushes a participant's nodes to grips.
    pub(crate) fn add_to(&self, part: usize, grips: &mut Vec<Grip>) {
        let of_part = self.sets.iter().zip(&self.places).filter(|(set, _)| set.of == part);
        let coupled_nodes = of_part.flat_map(|(_, places)| &self.coupled_nodes[places.among_all.clone()]);
        grips.extend(coupled_nodes.filter(|coupled| coupled.is_pushed()).map(CoupledNode::grip));
    }

    /// Ends a pass: whether the step is found, and taken note of, or has to be taken anew with the forces of
    /// this one.
    pub(crate) fn settle(
        &mut self,
        pass: u32,
        parts: &[ParticipantSetup],
        participants: &[Box<dyn Participant>],
    ) -> bool {
        let Self { sets, places, coupled_nodes, memory, .. } = self;
        let impulses = |set: &CoupledSurface, ranges: &Places| {
            &participants[set.host].coupled_impulses()[ranges.at_host.clone()]
        };
        let mut is_found = true;
        for (index, (set, ranges)) in sets.iter().zip(&*places).enumerate() {
            let step = parts[set.of].steps.step;
            let (mut apart, mut size, mut sums) = (0.0, 0.0, [[0.0; 3]; 2]);
            let remembered = &memory.nodes[ranges.among_all.clone()];
            for ((coupled, [_, owed]), &impulse) in
                coupled_nodes[ranges.among_all.clone()].iter().zip(remembered).zip(impulses(set, ranges))
            {
                let (wanted, felt) = (scale(add(impulse, *owed), 1.0 / step), coupled.felt());
                let difference = sub(wanted, felt);
                (apart, size) = (apart + dot(difference, difference), size + dot(wanted, wanted));
                sums = [sub(sums[0], scale(impulse, 1.0 / step)), add(sums[1], felt)];
            }
            let difference = if size > 0.0 { (apart / size).sqrt() } else { apart };
            memory.last[index] = (difference, sums);
            is_found &= difference <= FOUND;
        }
        is_found |= pass + 1 == PASSES;
        for (index, (set, ranges)) in sets.iter().zip(&*places).enumerate() {
            let step = parts[set.of].steps.step;
            let remembered = memory.nodes[ranges.among_all.clone()].iter_mut();
            let mut touches = false;
            for ((coupled, [force, owed]), &impulse) in
                coupled_nodes[ranges.among_all.clone()].iter_mut().zip(remembered).zip(impulses(set, ranges))
            {
                let mean = scale(impulse, 1.0 / step);
                touches |= mean != [0.0; 3] || coupled.is_pushed();
                if is_found {
                    (*force, *owed) = (mean, sub(add(*owed, impulse), scale(coupled.felt(), step)));
                } else {
                    (coupled.force, coupled.anchor) = (add(mean, scale(*owed, 1.0 / step)), coupled.way[1]);
                }
            }
            if is_found && touches {
                let [steps, passes] = &mut memory.counts[index];
                (*steps, *passes) = (*steps + 1, *passes + u64::from(pass + 1));
                memory.worst[index] = memory.worst[index].max(memory.last[index].0);
            }
        }
        is_found
    }

    /// The contacts of participants at the instant where they met last.
    pub(crate) fn now(&self) -> impl Iterator<Item = CoupledSurfaceNow> {
        let CouplingMemory { counts, last, worst, .. } = &self.memory;
        self.sets.iter().zip(counts).zip(last).zip(worst).map(
            |(((set, [steps, passes]), (_, forces)), &worst)| CoupledSurfaceNow {
                parts: [set.host, set.of],
                forces: *forces,
                passes: *passes as f64 / (*steps).max(1) as f64,
                worst,
            },
        )
    }
}

impl CoupledNode {
    /// The mean force [N] that it has felt in the step.
    fn felt(&self) -> Vector<f64> {
        match self.is_pushed() {
            true => sub(self.force, scale(sub(self.way[1], self.anchor), self.stiffness)),
            false => [0.0; 3],
        }
    }
}

impl CoupledSurface {
    /// Checks that its participants can be coupled.
    ///
    /// # Errors
    /// If one is not explicit on the CPU, the other one not implicit, or nodes are not theirs.
    pub fn check(&self, parts: &[ParticipantSetup]) -> Result<(), Failure> {
        let [Some(host), Some(of)] = [self.host, self.of].map(|part| parts.get(part)) else {
            return Err(Failure::input(
                &"a contact between participants names a participant that does not exist",
            ));
        };
        match &host.method {
            #[cfg(feature = "gpu")]
            Method::Explicit(settings) if settings.device.is_some() => {
                return Err(self.refused(
                    parts,
                    "touches a participant on a GPU, which has no contact between participants",
                ));
            }
            Method::Explicit(_) => {}
            _ => {
                return Err(self.refused(
                    parts,
                    "touches a participant that is not explicit: one of the two must take explicit steps",
                ));
            }
        }
        if !of.method.solves_steps() {
            return Err(self.refused(parts, "is not implicit: one of the two must take implicit steps"));
        }
        if self.nodes.iter().any(|&node| node as usize >= of.model.node_count()) {
            return Err(self.refused(parts, "has fewer nodes than the contact names"));
        }
        Ok(())
    }

    fn refused(&self, parts: &[ParticipantSetup], why: &str) -> Failure {
        Failure::input(&format_args!("contact between participants: `{}` {why}", parts[self.of].name))
    }
}

/// Contacts of a host whose surfaces have nodes of a set.
fn surfaces<'a>(host: &'a ParticipantSetup, coupled_nodes: &Range<u32>) -> impl Iterator<Item = &'a Contact> {
    let coupled_nodes = coupled_nodes.clone();
    let contacts = host.method.contacts().into_iter().flat_map(|contacts| &contacts.contacts);
    contacts.filter(move |contact| {
        contact.surfaces().any(|surface| surface.nodes.iter().any(|node| coupled_nodes.contains(node)))
    })
}

/// A third of the areas [m²] of the triangles around nodes, added up; each triangle once.
fn add_areas(surface: &Surface, place: impl Fn(u32) -> Vector<f64>, mut add_to: impl FnMut(u32, f64)) {
    for face in &surface.faces {
        let [a, b, c] = face.map(&place);
        let area = cross(sub(b, a), sub(c, a));
        let third = dot(area, area).sqrt() / 6.0;
        face.iter().for_each(|&node| add_to(node, third));
    }
}

/// The share of each coupled node [m²] in the surfaces that it is part of, at rest.
fn areas(
    host: &ParticipantSetup,
    coupled_nodes: &Range<u32>,
    place: impl Fn(u32) -> Vector<f64>,
) -> Vec<f64> {
    let mut areas = vec![0.0_f64; coupled_nodes.len()];
    for contact in surfaces(host, coupled_nodes) {
        let mut of_contact = vec![0.0; coupled_nodes.len()];
        for surface in
            contact.surfaces().filter(|surface| surface.nodes.iter().all(|node| coupled_nodes.contains(node)))
        {
            add_areas(surface, &place, |node, area| {
                of_contact[(node - coupled_nodes.start) as usize] += area
            });
        }
        areas.iter_mut().zip(of_contact).for_each(|(area, found)| *area = area.max(found));
    }
    areas
}

/// Mass of the nodes of a host's surfaces that meet coupled nodes, over their area [kg/m²].
fn mass_per_area(host: &ParticipantSetup, coupled_nodes: &Range<u32>) -> f64 {
    let (mut mass, mut area) = (0.0, 0.0);
    for contact in surfaces(host, coupled_nodes) {
        for surface in contact
            .surfaces()
            .filter(|surface| surface.nodes.iter().all(|node| !coupled_nodes.contains(node)))
        {
            mass += surface.nodes.iter().map(|&node| host.model.inertia(node as usize)).sum::<f64>();
            add_areas(surface, |node| host.model.rest[node as usize], |_, third| area += third);
        }
    }
    if area > 0.0 { mass / area } else { 0.0 }
}
