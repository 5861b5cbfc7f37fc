//! Contacts on the device: nodes and points between them as rows, found and solved there at every instant.
//! The CPU sends only the ways of obstacles and tools, with the factors of loads. It also sends lists of
//! candidates for pairs of surfaces when these are to be made anew. Not available: ideal grips of jaws,
//! bodies of revolution.

use std::collections::BTreeMap;
use std::sync::Arc;

use pliant_contact::face_points::FacePoints;
use pliant_contact::pose::Leg;
use pliant_contact::shader::{PASSAGE, THING, face_points_shader, pairs_shader, shader, split, things};
use pliant_contact::shape::Shape;
use pliant_contact::touch::{
    BAND, Contact, Contacts, FOUND, LIFTED, LIFTS, LOOKED, MARGIN, OFF, PASSES, Passage, ROUNDS, Rigid,
    SIDES, With,
};
use pliant_mechanics::model::Model;
use pliant_mechanics::tensor::Vector;

use crate::kernel::{Binding, Bound, GROUP, Kernel, Memory};
use crate::loads::DeviceLoads;
use crate::nodes::{DeviceNodes, MOTION, MOVE, UNTOUCHED, external_forces};
use crate::pairs::DevicePairs;
use crate::transfer::Four;
use crate::{Device, GpuError, Kind};

/// Names a feature of the contacts that runs on the CPU only.
pub fn processor_only(contacts: &Contacts) -> Option<String> {
    let grips = |rigid: &&Rigid| rigid.jaw.as_ref().is_some_and(|jaw| jaw.grip.is_some());
    let gripping =
        contacts.rigids.iter().find(grips).map(|rigid| format!("the ideal grip of `{}`", rigid.tool()));
    let limited = contacts.rigids.iter().find(|rigid| rigid.trajectory.limit().is_some());
    let growing = contacts.rigids.iter().find(|rigid| rigid.trajectory.grows());
    let revolved = contacts.rigids.iter().find(|rigid| matches!(rigid.shape, Shape::Revolved(_)));
    gripping
        .or_else(|| limited.map(|rigid| format!("the force limit of `{}`", rigid.tool())))
        .or_else(|| growing.map(|rigid| format!("the growth of `{}`", rigid.tool())))
        .or_else(|| revolved.map(|rigid| format!("the outline of `{}`", rigid.tool())))
}

/// Adds the ways of all things in the step between two times [s], as touch.wgsl reads them.
pub(crate) fn add_passages(
    contacts: &Contacts,
    driven: &[(u32, Leg)],
    times: [f64; 2],
    numbers: &mut Vec<f32>,
) {
    for (index, rigid) in (0..).zip(&contacts.rigids) {
        let leg = driven.iter().find(|(moved, _)| *moved == index).map(|(_, leg)| leg);
        numbers.extend(Passage::new(rigid, times.map(|time| rigid.stance(time, leg))).numbers());
    }
}

/// Numbers of the ways of all things in a step.
pub(crate) fn passage_numbers(contacts: Option<&Contacts>) -> usize {
    PASSAGE * contacts.map_or(0, |contacts| contacts.rigids.len())
}

/// The arrays of contacts.
struct Arrays {
    surface: wgpu::Buffer,
    things: wgpu::Buffer,
    numbers: wgpu::Buffer,
    states: wgpu::Buffer,
    rows: wgpu::Buffer,
    queue: wgpu::Buffer,
}

/// Group of bindings for contacts.
const OWN_GROUP: usize = 2;

/// The contacts of a model.
pub(crate) struct DeviceContacts {
    /// The things and who touches them.
    pub contacts: Arc<Contacts>,
    /// The force on each node [N].
    pub forces: wgpu::Buffer,
    /// The force [N] of each contact on its surface, four numbers each, once [`sum`](Self::sum) has run.
    pub sums: wgpu::Buffer,
    /// Kernel that runs before the forces of cells are found; it stops where candidates for pairs are to be
    /// listed anew.
    pub before: Option<Kernel>,
    /// Kernels that find the forces on nodes, in order.
    pub kernels: Vec<Kernel>,
    /// Sums the forces of each contact.
    pub sum: Kernel,
    arrays: Arrays,
    pairs: Option<DevicePairs>,
    /// Index of the kernel that finds pairs.
    finder: usize,
    /// Vectors of four in `rows` before the rows of pairs.
    other_rows: usize,
}

impl DeviceContacts {
    /// Makes the contacts; `gather` and `gathered` collect forces from the cells.
    ///
    /// # Errors
    /// If an array is too large, or the adapter allows fewer arrays.
    pub(crate) fn new(
        (memory, device): (&Memory<'_>, &Device),
        instant: &Bound,
        (model, contacts): (&Model, &Arc<Contacts>),
        nodes: &DeviceNodes,
        (gather, gathered): (&str, &Bound),
        loads: Option<&DeviceLoads>,
        constants: &[(&str, usize)],
    ) -> Result<Self, GpuError> {
        let passages = constants.iter().find(|(name, _)| *name == "PASSAGES").map_or(0, |&(_, at)| at);
        let touching = contacts.nodes();
        let pairs = DevicePairs::new(memory, contacts, &touching, &model.rest)?;
        let lists = Lists::new(contacts, touching, &model.rest, passages);
        let forces = memory.zeros("the forces of contacts", model.node_count() * size_of::<Four>())?;
        let sums = memory.zeros("the forces of contacts", contacts.contacts.len() * size_of::<Four>())?;
        let arrays = Arrays {
            surface: memory.filled("the nodes that touch", &lists.surface)?,
            things: memory.filled("obstacles and tools", &lists.things)?,
            numbers: memory.filled("the faces that touch", &lists.numbers)?,
            states: memory.zeros("the nodes that touch", 2 * lists.nodes * size_of::<Four>())?,
            rows: rows(memory, lists.rows, pairs.as_ref())?,
            queue: memory.zeros("the faces that touch", lists.queue() * size_of::<u32>())?,
        };
        let bound = bound(device, nodes, &arrays, [&forces, &sums], pairs.as_ref());
        // Whether several nodes have rows in common.
        let is_shared = lists.faces > 0 || pairs.is_some();
        let source = Source {
            device,
            constants: [constants, &lists.constants].concat(),
            common: common(device, contacts, is_shared, pairs.is_some()),
        };
        let groups = [instant, gathered, &bound];
        let with = |entry: &str, invocations: usize| source.kernel(&[entry], &groups, invocations);
        let loaded = loads.map(|loads| Bound::new(device, &loads.bindings()));
        let with_loads: Vec<&Bound> = groups.into_iter().chain(&loaded).collect();
        let predicting = [
            gather,
            MOVE,
            external_forces(loads),
            UNTOUCHED,
            MOTION,
            include_str!("shaders/touch_nodes.wgsl"),
        ];
        let mut kernels = vec![source.kernel(&predicting, &with_loads, lists.nodes)?];
        if lists.faces > 0 {
            let faces = [&face_points_shader(), include_str!("shaders/touch_faces.wgsl")].concat();
            kernels.push(with(&faces, lists.faces)?);
        }
        let finder = kernels.len();
        let mut before = None;
        if let Some(pairs) = &pairs {
            before = Some(with(include_str!("shaders/touch_moved.wgsl"), lists.nodes)?);
            kernels.push(with(include_str!("shaders/touch_pairs.wgsl"), pairs.finders)?);
        }
        if is_shared {
            kernels.push(with(include_str!("shaders/touch_solve.wgsl"), 1)?);
            kernels.push(with(include_str!("shaders/touch_lift.wgsl"), lists.nodes)?);
        }
        let mut sum = with(include_str!("shaders/touch_sums.wgsl"), 1)?;
        sum.dispatch_groups(contacts.contacts.len() as u32);
        let (contacts, other_rows) = (Arc::clone(contacts), lists.rows);
        Ok(Self { contacts, forces, sums, before, kernels, sum, arrays, pairs, finder, other_rows })
    }

    /// True if bodies touch each other or themselves.
    pub(crate) fn has_pairs(&self) -> bool {
        self.pairs.is_some()
    }

    /// Lists candidates for pairs, with nodes at displacements [m].
    ///
    /// # Errors
    /// If an array is too large.
    pub(crate) fn list(
        &mut self,
        device: &Device,
        nodes: &DeviceNodes,
        displacements: &[Four],
    ) -> Result<(), GpuError> {
        let Some(pairs) = &mut self.pairs else { return Ok(()) };
        if pairs.list(device, displacements)? {
            self.arrays.rows = rows(&Memory::new(device), self.other_rows, Some(pairs))?;
            let bound = bound(device, nodes, &self.arrays, [&self.forces, &self.sums], Some(pairs));
            let kernels = self.kernels.iter_mut().chain(&mut self.before).chain([&mut self.sum]);
            kernels.for_each(|kernel| kernel.rebind(OWN_GROUP, &bound));
        }
        self.kernels[self.finder].resize(pairs.finders);
        Ok(())
    }
}

/// Common beginning of all kernels of contacts.
struct Source<'a> {
    device: &'a Device,
    constants: Vec<(&'a str, usize)>,
    common: String,
}

impl Source<'_> {
    /// The kernel that ends with these snippets.
    fn kernel(&self, snippets: &[&str], bound: &[&Bound], invocations: usize) -> Result<Kernel, GpuError> {
        let snippets = [&[self.common.as_str()], snippets].concat();
        Kernel::new(self.device, "contacts", &self.constants, &snippets, bound, invocations)
    }
}

/// The WGSL that all kernels of contacts have.
fn common(device: &Device, contacts: &Contacts, is_shared: bool, has_pairs: bool) -> String {
    let counts = [
        ("PASSES", PASSES),
        ("ROUNDS", ROUNDS),
        ("LOOKED", LOOKED),
        ("SIDES", SIDES),
        ("LIFTS", LIFTS),
        ("ROWS", NODE_ROWS),
        ("FACE_ROW", FACE_ROW),
        ("SOLVERS", solvers(device)),
    ];
    let counts = counts.map(|(name, count)| format!("const {name} = {count}u;\n"));
    let parts = [("FOUND", FOUND), ("OFF", OFF), ("LIFTED", LIFTED), ("BAND", BAND)];
    let parts = parts.map(|(name, part)| format!("const {name} = {:e}f;\n", part as f32));
    let limits = [counts.concat(), parts.concat(), format!("const IS_SHARED = {is_shared};\n")].concat();
    let of_pairs = match has_pairs {
        true => {
            [&pairs_shader(), include_str!("shaders/pairs.wgsl"), include_str!("shaders/pair_levels.wgsl")]
                .concat()
        }
        false => include_str!("shaders/no_pairs.wgsl").to_owned(),
    };
    [
        include_str!("shaders/instant.wgsl"),
        &limits,
        &shader(&contacts.rigids),
        include_str!("shaders/touching.wgsl"),
        &of_pairs,
    ]
    .join("\n")
}

/// Makes the rows, including rows of pairs.
fn rows(
    memory: &Memory<'_>,
    of_things: usize,
    pairs: Option<&DevicePairs>,
) -> Result<wgpu::Buffer, GpuError> {
    let of_pairs = pairs.map_or(0, |pairs| PAIR_ROW * pairs.most_rows);
    memory.zeros("the points that touch", (of_things + of_pairs) * size_of::<Four>())
}

/// Binds the arrays of kernels of contacts, besides the nodes.
fn bound(
    device: &Device,
    nodes: &DeviceNodes,
    Arrays { surface, things, numbers, states, rows, queue }: &Arrays,
    [forces, sums]: [&wgpu::Buffer; 2],
    pairs: Option<&DevicePairs>,
) -> Bound {
    let mut bindings = vec![
        Binding::Read(surface),
        Binding::Read(things),
        Binding::Read(numbers),
        Binding::Write(states),
        Binding::Write(rows),
        Binding::Write(forces),
        Binding::Write(queue),
        Binding::Write(sums),
    ];
    if let Some(DevicePairs { candidates, listed, queue, .. }) = pairs {
        bindings.extend([Binding::Read(candidates), Binding::Read(listed), Binding::Write(queue)]);
    }
    nodes.of_contacts(device, &bindings)
}

/// Returns the invocations of the group that solves all rows. The group waits after each colour and level.
/// Software changes from one part of a group to another there, and has one part only if the group fills one
/// vector.
fn solvers(device: &Device) -> usize {
    match device.adapter().kind {
        Kind::Software => 8,
        _ => GROUP as usize,
    }
}

/// Fours of `rows` of a candidate for a pair; twin of the one in pairs.wgsl.
const PAIR_ROW: usize = 4;

/// Fours of `rows` of a contact at a node: its force, and three of each side of the thing.
const NODE_ROWS: usize = 1 + 3 * SIDES;
/// Fours of a point of a face.
const FACE_ROW: usize = 4;

/// Numbers of a contact in `things`; twin of the one in touching.wgsl.
const CONTACT: usize = 8;

/// A face with points that touch.
#[derive(Default)]
struct Face {
    colour: usize,
    /// Contacts of the face, each with its edges as [`FacePoints::edges`] has them.
    contacts: Vec<(usize, [bool; 3])>,
}

/// Contacts with things, and what touches these.
struct Touched {
    /// The things, the contacts, and points of faces.
    things: Vec<f32>,
    first_contact: usize,
    first_point: usize,
    /// The contacts of each node.
    at_node: Vec<Vec<usize>>,
    /// Faces in the order of their colours.
    faces: Vec<([u32; 3], Face)>,
    /// Most points of a face, of each contact.
    points_of: Vec<usize>,
}

impl Touched {
    fn new(
        Contacts { rigids, contacts, .. }: &Contacts,
        nodes: &[u32],
        rest: &[Vector<f64>],
        passages: usize,
    ) -> Self {
        let place_of = |node: u32| nodes.partition_point(|&known| known < node);
        let mut at_node = vec![Vec::new(); nodes.len()];
        let mut things = things(rigids);
        let first_contact = things.len();
        let mut points: Vec<[f64; 3]> = Vec::new();
        let mut faces: BTreeMap<[u32; 3], Face> = BTreeMap::new();
        let mut points_of = Vec::new();
        for (index, Contact { surface, with, touch, .. }) in contacts.iter().enumerate() {
            let &With::Rigid(rigid) = with else {
                things.extend([0.0; CONTACT]);
                points_of.push(0);
                continue;
            };
            surface.nodes.iter().for_each(|&node| at_node[place_of(node)].push(index));
            let longest = surface.longest_edge(|node| rest[node as usize].into());
            let face_points =
                FacePoints::new(&surface.faces, longest, &rigids[rigid].shape, rigids[rigid].inside);
            let most = face_points.most();
            // Edges may be twice as long as at rest.
            let beyond = if most == 0 { 0.0 } else { 2.0 * longest };
            let numbers = [touch.friction, touch.offset, MARGIN * longest, beyond].map(|x| x as f32);
            let whole = |number: usize| number as f32;
            things.extend([whole(THING * rigid), whole(passages + PASSAGE * rigid)]);
            things.extend(numbers);
            things.extend([whole(points.len()), whole(most)]);
            points_of.push(most);
            if most > 0 {
                for (number, face) in surface.faces.iter().enumerate() {
                    let face = face.map(|node| place_of(node) as u32);
                    faces.entry(face).or_default().contacts.push((index, face_points.edges(number)));
                }
            }
            if let FacePoints::Lattice(lattice) = face_points {
                points.extend(lattice);
            }
        }
        let first_point = things.len();
        things.extend(points.as_flattened().iter().map(|&weight| weight as f32));
        let faces = coloured(faces, nodes.len());
        Self { things, first_contact, first_point, at_node, faces, points_of }
    }
}

/// Places of rows.
struct Places {
    /// Length of `rows`.
    rows: usize,
    /// The rows of each contact.
    of_contacts: Vec<Vec<u32>>,
}

impl Places {
    /// Gives a contact the next fours of `rows`; where they begin.
    fn next(&mut self, contact: usize, fours: usize) -> u32 {
        let begin = self.rows as u32;
        self.of_contacts[contact].push(begin);
        self.rows += fours;
        begin
    }
}

/// Arrays that touching.wgsl reads.
struct Lists {
    surface: Vec<Four>,
    things: Vec<f32>,
    numbers: Vec<u32>,
    nodes: usize,
    faces: usize,
    colours: usize,
    /// Length of `rows`.
    rows: usize,
    constants: Vec<(&'static str, usize)>,
}

impl Lists {
    /// Lists the nodes that touch; the ways of things begin at `passages` in a row of the table.
    fn new(contacts: &Contacts, nodes: Vec<u32>, rest: &[Vector<f64>], passages: usize) -> Self {
        let Touched { things, first_contact, first_point, at_node, faces, points_of } =
            Touched::new(contacts, &nodes, rest, passages);
        let colours = faces.last().map_or(0, |(_, face)| face.colour + 1);
        let mut places = Places { rows: 0, of_contacts: vec![Vec::new(); contacts.contacts.len()] };

        let mut surface = Vec::with_capacity(2 * nodes.len() + 2);
        let mut numbers: Vec<u32> = Vec::new();
        for (&node, touched) in nodes.iter().zip(&at_node) {
            let [[a, b, c], [d, e, f]] = split(rest[node as usize].into());
            surface
                .extend([[a, b, c, f32::from_bits(node)], [d, e, f, f32::from_bits(numbers.len() as u32)]]);
            for &contact in touched {
                places.next(contact, NODE_ROWS);
                numbers.push(contact as u32);
            }
        }
        surface.extend([[0.0; 4], [0.0, 0.0, 0.0, f32::from_bits(numbers.len() as u32)]]);

        let first_face = numbers.len();
        let mut of_faces: Vec<u32> = Vec::new();
        for (corners, face) in &faces {
            numbers.extend(corners);
            numbers.extend([face.colour as u32, of_faces.len() as u32 / 3]);
            for &(contact, edges) in &face.contacts {
                let row = places.next(contact, 1 + FACE_ROW * points_of[contact]);
                let bits = (0..3).map(|k| u32::from(edges[k]) << k).sum();
                of_faces.extend([contact as u32, row, bits]);
            }
        }
        numbers.extend([0, 0, 0, 0, of_faces.len() as u32 / 3]);
        let contacts_of_faces = numbers.len();
        numbers.append(&mut of_faces);
        let first_colour = numbers.len();
        let begins = |colour: usize| faces.partition_point(|(_, face)| face.colour < colour) as u32;
        numbers.extend((0..colours).map(begins));
        let first_sum = numbers.len();
        let mut end = first_sum + places.of_contacts.len() + 1;
        for places_of_contact in &places.of_contacts {
            numbers.push(end as u32);
            end += places_of_contact.len();
        }
        numbers.push(end as u32);
        numbers.extend(places.of_contacts.concat());
        let rows = places.rows;
        let constants = vec![
            ("TOUCHING", nodes.len()),
            ("FACES", faces.len()),
            ("COLOURS", colours),
            ("CONTACTS", first_contact),
            ("POINTS", first_point),
            ("FACES_AT", first_face),
            ("FACE_CONTACTS", contacts_of_faces),
            ("COLOURS_AT", first_colour),
            ("SUMS_AT", first_sum),
            ("PAIR_ROWS", rows),
        ];
        let (nodes, faces) = (nodes.len(), faces.len());
        Self { surface, things, numbers, nodes, faces, colours, rows, constants }
    }

    /// Length of the queue.
    fn queue(&self) -> usize {
        2 + self.colours + self.nodes + self.faces
    }
}

/// Sorts faces by colour, so that faces of a colour share no node. Each face takes the first colour that is
/// free.
fn coloured(faces: BTreeMap<[u32; 3], Face>, nodes: usize) -> Vec<([u32; 3], Face)> {
    let mut taken: Vec<Vec<usize>> = vec![Vec::new(); nodes];
    let mut faces: Vec<_> = faces.into_iter().collect();
    for (corners, face) in &mut faces {
        let is_free = |colour: &usize| corners.iter().all(|&node| !taken[node as usize].contains(colour));
        face.colour = (0..).find(is_free).unwrap_or_default();
        corners.iter().for_each(|&node| taken[node as usize].push(face.colour));
    }
    faces.sort_by_key(|(_, face)| face.colour);
    faces
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The faces around a point have a colour each; other faces use these colours again.
    #[test]
    fn faces_of_a_colour_share_no_node() {
        let fan = (1..=7).map(|k| [0, k, k % 7 + 1]).chain([[8, 9, 10], [10, 11, 12]]);
        let faces = coloured(fan.map(|face| (face, Face::default())).collect(), 13);
        for (one, (a, of_a)) in faces.iter().enumerate() {
            for (b, of_b) in &faces[one + 1..] {
                assert!(of_a.colour != of_b.colour || !a.iter().any(|node| b.contains(node)), "{a:?} {b:?}");
            }
        }
        assert_eq!(faces.last().map(|(_, face)| face.colour), Some(6));
    }
}
