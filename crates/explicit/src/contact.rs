//! Contacts in a step. Nodes are predicted, then impulses keep them, and points between them, apart from
//! rigid things, other bodies and other parts of their own body. A point pair x = Σ cᵢ xᵢ with normal n and
//! gap g is a row. Its nodes get impulses cᵢ λ n with λ ≥ 0, g ≥ 0 and λ g = 0. Friction adds impulses of at
//! most μ λ against the slip. Projected Gauss–Seidel finds them, in the order of the rows: momentum is kept
//! to the last bit of each impulse. A last pass over nodes alone keeps these out of curved rigid things, too.

mod at_rigid;
mod coupled_surfaces;
mod nodal;
mod rows;
mod ways;

use std::ops::Range;
use std::sync::Arc;

use nalgebra::Vector3;
use pliant_contact::lag::Lag;
use pliant_contact::pairs::Pairs;
use pliant_contact::pose::{Leg, Stance};
use pliant_contact::pressure::faces;
use pliant_contact::shape::Near;
use pliant_contact::touch::{
    BAND, Contact, Contacts, FOUND, Gripped, LIFTED, LIFTS, LOOKED, OFF, PASSES, Passage, ROUNDS, Rigid, With,
};
use pliant_mechanics::tensor::{Vector, add};

use crate::lanes::LaneNumber;
use at_rigid::{AtRigid, Seen};
use coupled_surfaces::CoupledSurfaces;
pub use nodal::NodeContact;
use rows::{NONE, Row, idle, push_alone, take_back};
pub(crate) use ways::Nodes;

/// Distance [thinnest part of a jaw] at which a node touches it.
const TOUCHING: f64 = 1e-6;
/// Cosine of the angle to the normal of a jaw's inner face up to which nodes are between the jaws.
const INWARD: f64 = 0.7;

/// Placement of a rigid thing in a step.
pub(crate) struct Posture {
    /// Poses and sizes before and after the step.
    pub stances: [Stance; 2],
    /// The angle [rad] between its jaws after.
    pub opening: f64,
}

/// Motion of a node in a step without contact.
pub(crate) struct Free {
    /// Place [m] of the node after the step.
    pub then: Vector<f64>,
    /// Mobility: way of each component per force over the step [m/N]; zero for prescribed components.
    pub mobility: Vector<f64>,
}

/// A node in a step.
#[derive(Clone, Copy, Debug)]
struct Node {
    free: Vector3<f64>,
    then: Vector3<f64>,
    /// Mobility [m/N] under contacts; zero for prescribed components and for nodes that jaws hold.
    mobility: Vector3<f64>,
    /// Mobility [m/N] under any force.
    free_mobility: Vector3<f64>,
    /// Impulses [N] of rows on it, of a node that jaws hold.
    borne: Vector3<f64>,
    /// Impulses [N] of the last pass on it.
    lifted: Vector3<f64>,
    /// Length [m] of its way by impulses at most.
    way: f64,
    /// True if the node may touch something, so that its prediction is known.
    near: bool,
    /// True if the node is in a pair of bodies.
    paired: bool,
    /// The first of the rows on it alone.
    first: u32,
    /// Depth [m] of the node in things at the predicted place.
    depth: f64,
}

impl Node {
    const NONE: Self = {
        let zero = Vector3::new(0.0, 0.0, 0.0);
        Self {
            free: zero,
            then: zero,
            mobility: zero,
            free_mobility: zero,
            borne: zero,
            lifted: zero,
            way: 0.0,
            near: false,
            paired: false,
            first: NONE,
            depth: 0.0,
        }
    };

    /// Impulses take it along a way [m].
    fn go(&mut self, way: Vector3<f64>) {
        self.then += way;
        self.way += way.x.abs() + way.y.abs() + way.z.abs();
    }
}

/// The partner of a surface in a contact, with nodes numbered as in [`ContactSolver`].
enum Own {
    Rigid(Box<AtRigid>),
    /// Bodies, with a sign ([`Contact::pairs`](pliant_contact::touch::Contact::pairs)).
    Bodies(Box<Pairs>, f64),
}

/// The contacts of a model, with the nodes that they are about.
pub(crate) struct ContactSolver<R> {
    contacts: Arc<Contacts>,
    /// Numbers of the nodes in the model, increasing; coupled nodes are numbered after the model's nodes.
    numbers: Vec<u32>,
    coupled_surfaces: CoupledSurfaces,
    /// Places [m] of the nodes at rest, and before the step; the latter only for nodes in `placed`.
    rest: Vec<Vector3<f64>>,
    places: Vec<Vector3<f64>>,
    /// Nodes that a list of a thing has, and those that may touch other bodies; increasing.
    placed: Vec<u32>,
    /// The latter alone.
    of_bodies: Vec<u32>,
    /// Displacements [m] of all nodes of the model between the first and the last that touch, when lists were
    /// made.
    listed: Vec<Vector<R>>,
    nodes: Vec<Node>,
    /// The nodes that may touch something in the step, increasing.
    near: Vec<u32>,
    partners: Vec<Own>,
    /// Nodes at a rigid thing.
    seen: Vec<Seen>,
    rows: Vec<Row>,
    /// Triangles of all surfaces, each once.
    faces: Vec<[u32; 3]>,
    /// Impulses [N] on each node in a step, and their slips weighted by them.
    slips: Vec<[f64; 2]>,
    /// Nodes that jaws hold from the next step on.
    pub taken: Vec<Gripped>,
    /// Room for the nodes that slide.
    slid: Vec<(u32, f64)>,
    /// The force [N] of each contact on its first surface at the last evaluation.
    pub forces: Vec<Vector<f64>>,
    /// Moment [N m] of the force of each contact with a rigid thing, about the origin, with points where they
    /// were before the step.
    pub moments: Vec<Vector<f64>>,
}

impl<R: LaneNumber> ContactSolver<R> {
    /// Contacts of a model with these nodes at rest [m].
    pub fn new(contacts: Arc<Contacts>, rest: &[Vector<f64>]) -> Self {
        let numbers = contacts.nodes();
        let coupled_surfaces = CoupledSurfaces::new(rest.len(), &contacts.coupled_nodes);
        // Faces are of nodes that touch.
        let number = |node: u32| numbers.partition_point(|&known| known < node) as u32;
        let place = |node: u32| {
            let number = numbers[node as usize] as usize;
            rest.get(number).map_or_else(|| coupled_surfaces.rest(number), |&rest| rest.into())
        };
        let parts = contacts.contacts.iter().enumerate().map(|(index, contact)| {
            let at_rigid = |rigid: usize| {
                let surface = contact.surface.numbered(number);
                Own::Rigid(Box::new(AtRigid::new(&contacts.rigids[rigid], rigid, surface, place)))
            };
            match contact.with {
                With::Rigid(rigid) => Some(at_rigid(rigid)),
                _ => contacts
                    .pairs(index, number, place)
                    .map(|(pairs, sign)| Own::Bodies(Box::new(pairs), sign)),
            }
        });
        let partners = parts.flatten().collect();
        let with_bodies = contacts.contacts.iter().filter(|contact| !matches!(contact.with, With::Rigid(_)));
        let of_bodies = with_bodies.flat_map(Contact::surfaces).flat_map(|surface| &surface.nodes);
        let of_bodies = of_bodies.map(|&node| number(node)).collect();
        Self {
            rest: (0..numbers.len() as u32).map(place).collect(),
            places: vec![Vector3::zeros(); numbers.len()],
            placed: Vec::new(),
            of_bodies,
            listed: Vec::new(),
            near: Vec::new(),
            nodes: vec![Node::NONE; numbers.len()],
            seen: vec![Seen::default(); numbers.len()],
            rows: Vec::new(),
            faces: faces(&contacts, &numbers),
            slips: vec![[0.0; 2]; numbers.len()],
            taken: Vec::new(),
            slid: Vec::new(),
            numbers,
            coupled_surfaces,
            partners,
            forces: vec![[0.0; 3]; contacts.contacts.len()],
            moments: vec![[0.0; 3]; contacts.contacts.len()],
            contacts,
        }
    }

    /// Finds the forces of contacts in a step; `gripped` are the nodes that jaws hold.
    pub fn find(
        &mut self,
        postures: impl Fn(usize, &Rigid) -> Posture,
        now: &Nodes<'_, R>,
        times: [f64; 2],
        free: impl Fn(u32) -> Free,
        gripped: &mut Vec<Gripped>,
    ) {
        self.coupled_surfaces.go(times);
        self.taken.clear();
        self.forces.fill([0.0; 3]);
        self.moments.fill([0.0; 3]);
        for node in self.near.drain(..) {
            let node = &mut self.nodes[node as usize];
            (node.near, node.paired) = (false, false);
        }
        for partner in &mut self.partners {
            if let Own::Rigid(at_rigid) = partner {
                let rigid = &self.contacts.rigids[at_rigid.rigid];
                let posture = postures(at_rigid.rigid, rigid);
                (at_rigid.passage, at_rigid.grips) =
                    (Passage::new(rigid, posture.stances), rigid.grips(posture.opening));
            }
        }
        gripped.retain(|held| self.holder(held).is_some_and(|(_, at_rigid, _)| at_rigid.grips));
        let way = self.list(now);
        self.place(now, gripped);
        self.look(way, free, gripped);
        if !self.near.is_empty() {
            self.grip(gripped);
            self.measure();
            self.solve();
            self.lift();
            self.bear(gripped);
            self.take(gripped);
        }
    }

    /// Finds the lags of things whose force is limited, after the step between two times [s]; `leg` is where
    /// a thing is driven to.
    pub fn lag<'a>(&self, lags: &mut Vec<Lag>, times: [f64; 2], leg: impl Fn(usize) -> Option<&'a Leg>) {
        let rigids = &self.contacts.rigids;
        if lags.is_empty() {
            let limited = rigids.iter().zip(0..).filter(|(rigid, _)| rigid.trajectory.limit().is_some());
            lags.extend(limited.map(|(_, number)| Lag::new(number)));
        }
        for lag in lags {
            let rigid = &rigids[lag.number()];
            let place = |time| rigid.posture(time, leg(lag.number())).0.translation.vector;
            let way = place(times[1]) - place(times[0]);
            lag.follow(rigid.trajectory.limit().unwrap_or(f64::INFINITY), way, times[1] - times[0]);
        }
    }

    /// Gives each lag the force of its tool in the step.
    pub fn bear_on(&self, lags: &mut [Lag]) {
        let Contacts { rigids, contacts, .. } = &*self.contacts;
        for lag in lags {
            let tool = rigids[lag.number()].tool();
            let on = |(contact, force): (&Contact, &Vector<f64>)| {
                let of_tool = matches!(contact.with, With::Rigid(rigid) if rigids[rigid].tool() == tool);
                of_tool.then(|| Vector3::from(*force))
            };
            lag.found(contacts.iter().zip(&self.forces).filter_map(on).sum());
        }
    }

    /// The force [N] on each node that touches something.
    pub fn nodal_forces(&self) -> impl Iterator<Item = (u32, Vector<f64>)> {
        let nodes = self.near.iter().map(|&node| (&self.nodes[node as usize], self.numbers[node as usize]));
        // Coupled nodes are the last ones.
        let uncoupled = nodes.take_while(|(_, number)| self.coupled_surfaces.place_of(*number).is_none());
        let touching = uncoupled.filter(|(node, _)| node.then != node.free);
        touching.map(|(node, number)| (number, over(&(node.then - node.free), &node.free_mobility).into()))
    }

    /// Leads the coupled nodes from one place [m] to another between two times [s], at constant speed.
    /// Impulses on them count from now on.
    pub fn lead(&mut self, times: [f64; 2], ways: &[[Vector<f64>; 2]]) {
        self.coupled_surfaces.lead(times, ways);
    }

    /// Impulses [N s] on the coupled nodes since they were led.
    pub fn impulses(&self) -> &[Vector<f64>] {
        self.coupled_surfaces.impulses()
    }

    /// Adds the impulses on coupled nodes of the step whose forces were found last, over its length [s].
    pub(crate) fn press_coupled_surfaces(&mut self, length: f64) {
        for &near in self.near.iter().rev() {
            let Some(coupled) = self.coupled_surfaces.place_of(self.numbers[near as usize]) else { break };
            self.coupled_surfaces.press(coupled, self.nodes[near as usize].borne * length);
        }
    }

    /// The nodes of the model between the first and the last that touch.
    fn span(&self) -> Range<usize> {
        let uncoupled = &self.numbers
            [..self.numbers.partition_point(|&node| self.coupled_surfaces.place_of(node).is_none())];
        match (uncoupled.first(), uncoupled.last()) {
            (Some(&first), Some(&last)) => first as usize..last as usize + 1,
            _ => 0..0,
        }
    }

    /// Lists the nodes and faces that may come near rigid things, if a list has expired. Returns a bound on
    /// the motion of a node in the step [m], from its motion in the step before.
    fn list(&mut self, now: &Nodes<'_, R>) -> f64 {
        let span = self.span();
        let is_first = self.listed.is_empty();
        let [way, moved] =
            now.ways(span.clone(), if is_first { &now.displacement[span.clone()] } else { &self.listed });
        let rigids = &self.contacts.rigids;
        let rooms = self.contacts.contacts.iter().map(|contact| contact.touch.offset + 2.0 * way);
        let holds = |(partner, room): (&Own, f64)| match partner {
            Own::Rigid(at_rigid) => at_rigid.holds(&rigids[at_rigid.rigid], room, moved),
            Own::Bodies(..) => true,
        };
        if !is_first && self.partners.iter().zip(rooms.clone()).all(holds) {
            return way;
        }
        self.listed.clear();
        self.listed.extend_from_slice(&now.displacement[span]);
        self.coupled_surfaces.place(
            0..self.numbers.len() as u32,
            &self.numbers,
            &self.rest,
            now,
            &mut self.places,
        );
        self.placed.clone_from(&self.of_bodies);
        for (partner, room) in self.partners.iter_mut().zip(rooms) {
            if let Own::Rigid(at_rigid) = partner {
                at_rigid.list(&rigids[at_rigid.rigid], room, &self.places);
                self.placed.extend_from_slice(at_rigid.listed());
            }
        }
        self.placed.sort_unstable();
        self.placed.dedup();
        way
    }

    /// Finds the places before the step of the nodes that may touch something in the step, and of nodes that
    /// jaws hold.
    fn place(&mut self, now: &Nodes<'_, R>, gripped: &[Gripped]) {
        let held = gripped.iter().filter_map(|held| self.numbers.binary_search(&held.node).ok());
        let nodes = self.placed.iter().copied().chain(held.map(|node| node as u32));
        self.coupled_surfaces.place(nodes, &self.numbers, &self.rest, now, &mut self.places);
    }

    /// Finds the nodes that may touch in the step, and where they go; rows of the points near rigid things.
    fn look(&mut self, way: f64, free: impl Fn(u32) -> Free, gripped: &[Gripped]) {
        let Self { contacts, numbers, coupled_surfaces, places, nodes, near, partners, seen, rows, .. } =
            self;
        rows.clear();
        let mut mark = |node: u32| {
            if !std::mem::replace(&mut nodes[node as usize].near, true) {
                near.push(node);
            }
        };
        for (index, partner) in partners.iter_mut().enumerate() {
            match partner {
                Own::Rigid(at_rigid) => {
                    let offset = contacts.contacts[index].touch.offset;
                    let (rigid, room) = (&contacts.rigids[at_rigid.rigid], offset + 2.0 * way);
                    at_rigid.look(rigid, room, places, seen, |row| {
                        rows.push(Row { contact: index, ..row });
                    });
                    at_rigid.near.iter().for_each(|&node| mark(node));
                }
                Own::Bodies(pairs, _) => {
                    pairs.update(|node| places[node as usize]);
                    pairs.near().iter().for_each(|&node| mark(node));
                }
            }
        }
        for node in gripped.iter().filter_map(|held| numbers.binary_search(&held.node).ok()) {
            mark(node as u32);
        }
        near.sort_unstable();
        for &node in near.iter() {
            let (node, number) = (&mut nodes[node as usize], numbers[node as usize]);
            let Free { then, mobility } = coupled_surfaces.free(number).unwrap_or_else(|| free(number));
            (node.free, node.then) = (then.into(), then.into());
            (node.mobility, node.free_mobility) = (mobility.into(), mobility.into());
            (node.borne, node.lifted, node.way) = (Vector3::zeros(), Vector3::zeros(), 0.0);
        }
    }

    /// The contact by which a jaw holds a node, by its place, and the node's own number.
    fn holder(&self, held: &Gripped) -> Option<(usize, &AtRigid, usize)> {
        let node = self.numbers.binary_search(&held.node).ok()?;
        self.partners.iter().enumerate().find_map(|(index, partner)| {
            let Own::Rigid(at_rigid) = partner else { return None };
            let holds = at_rigid.rigid == held.rigid as usize
                && at_rigid.surface.nodes.binary_search(&(node as u32)).is_ok();
            holds.then_some((index, &**at_rigid, node))
        })
    }

    /// Takes along the nodes that jaws hold.
    fn grip(&mut self, gripped: &[Gripped]) {
        for held in gripped {
            let Some((_, at_rigid, node)) = self.holder(held) else { continue };
            let goal = at_rigid.passage.place(&held.at.into());
            let node = &mut self.nodes[node];
            for c in (0..3).filter(|&c| node.free_mobility[c] > 0.0) {
                (node.then[c], node.mobility[c]) = (goal[c], 0.0);
            }
        }
    }

    /// Adds the forces of jaws on the nodes that they hold: what rows on these do not bear.
    fn bear(&mut self, gripped: &[Gripped]) {
        for held in gripped {
            let Some((index, _, at)) = self.holder(held) else { continue };
            let node = &self.nodes[at];
            let force = over(&(node.then - node.free), &node.free_mobility) - node.borne;
            self.forces[index] = add(self.forces[index], force.into());
            self.moments[index] = add(self.moments[index], self.places[at].cross(&force).into());
        }
    }

    /// Lets jaws that are closed hold, from the next step on, the nodes that touch their inner faces.
    fn take(&mut self, gripped: &[Gripped]) {
        let Self { contacts, partners, nodes, numbers, taken, .. } = self;
        for (contact, partner) in contacts.contacts.iter().zip(&*partners) {
            let Own::Rigid(at_rigid) = partner else { continue };
            if !at_rigid.grips {
                continue;
            }
            let rigid = &contacts.rigids[at_rigid.rigid];
            let inward = rigid.jaw.as_ref().map_or(0.0, |jaw| jaw.part.signum());
            for &node in at_rigid.surface.nodes.iter().filter(|&&node| nodes[node as usize].near) {
                let (at, Near { distance, normal }) =
                    at_rigid.passage.within(rigid, &nodes[node as usize].then);
                let node = numbers[node as usize];
                let touches = distance - contact.touch.offset <= TOUCHING * rigid.shape.thinnest();
                let known = || gripped.iter().chain(&*taken).any(|held| held.node == node);
                if touches && normal.y * inward > INWARD && !known() {
                    taken.push(Gripped { rigid: at_rigid.rigid as u32, node, at: at.into() });
                }
            }
        }
    }

    /// Finds the gaps of all rows; leaves out those that are too wide to close.
    fn measure(&mut self) {
        let Self { contacts, places, nodes, partners, rows, .. } = self;
        let mut deepest = 0.0_f64;
        rows.retain_mut(|row| {
            let Own::Rigid(at_rigid) = &partners[row.contact] else { return false };
            let now = row.place(places, nodes);
            let rigid = &contacts.rigids[at_rigid.rigid];
            let offset = contacts.contacts[row.contact].touch.offset;
            let Near { distance, normal } = at_rigid.passage.meet(rigid, offset, &now, &row.place);
            (row.normal, row.gap, row.carried) = (normal, distance - offset, at_rigid.passage.carry(&now));
            deepest = deepest.max(-row.gap);
            row.gap < at_rigid.margin
        });
        for (index, partner) in partners.iter().enumerate() {
            let Own::Bodies(pairs, sign) = partner else { continue };
            let first = rows.len();
            // Impulses along the way between two points before the step have no moment.
            pairs.find(
                |node| places[node as usize],
                |pair| {
                    let mut row = Row::new(index, pair.nodes, pair.weights);
                    row.carried = row.place(places, nodes);
                    (row.normal, row.sign) = (pair.normal, if pair.in_order { *sign } else { -sign });
                    row.gap = row.normal.dot(&row.place) - pair.kept;
                    deepest = deepest.max(-row.gap);
                    rows.push(row);
                },
            );
            let parts = rows[first..].iter().flat_map(Row::parts);
            parts.filter(|(_, weight)| *weight != 0.0).for_each(|(node, _)| nodes[node].paired = true);
        }
        // No impulse moves a point farther than a few times the deepest one.
        rows.retain(|row| row.gap < BAND * deepest);
    }

    /// Finds the impulses of all rows. A node meets a thing at the side where it is predicted, which can be
    /// deep. If the node comes to lie off this side, the adjacent side replaces it. If the node lies behind
    /// another side, that side becomes one more row.
    fn solve(&mut self) {
        let deepest = self.rows.iter().map(|row| -row.gap).fold(0.0, f64::max);
        if deepest <= 0.0 {
            return;
        }
        self.chain();
        for _ in 0..ROUNDS {
            self.relax(deepest);
            if self.settle(deepest) <= FOUND * deepest {
                break;
            }
        }
        let Self { nodes, rows, forces, moments, places, partners, .. } = self;
        for row in rows.iter() {
            let force = (row.normal * row.push + row.drag) * row.sign;
            forces[row.contact] = add(forces[row.contact], force.into());
            if matches!(partners[row.contact], Own::Rigid(_)) {
                let place: Vector3<f64> = row.parts().map(|(node, weight)| places[node] * weight).sum();
                moments[row.contact] = add(moments[row.contact], place.cross(&force).into());
            }
            for (node, weight) in row.parts() {
                nodes[node].borne += (row.normal * row.push + row.drag) * weight;
            }
        }
    }

    /// Links the rows of each node alone.
    fn chain(&mut self) {
        for &node in &self.near {
            let node = &mut self.nodes[node as usize];
            (node.first, node.depth) = (NONE, 0.0);
        }
        let numbered = self.rows.iter_mut().enumerate().rev();
        for (number, row) in numbered.filter(|(_, row)| row.count == 1) {
            let node = &mut self.nodes[row.nodes[0] as usize];
            node.depth = node.depth.max(-row.gap);
            row.next = std::mem::replace(&mut node.first, number as u32);
        }
    }

    /// Impulses of the rows there are, by projected Gauss–Seidel.
    fn relax(&mut self, deepest: f64) {
        let Self { contacts, nodes, rows, .. } = self;
        for _ in 0..PASSES {
            let mut moved = 0.0_f64;
            for row in rows.iter_mut() {
                moved = moved.max(row.push_apart(nodes, contacts));
            }
            if moved < FOUND * deepest {
                break;
            }
        }
    }

    /// Sides of things beside nodes that impulses have moved, and their impulses, a node at a time. How far
    /// that moves a node at most [m].
    fn settle(&mut self, deepest: f64) -> f64 {
        let Self { contacts, places, nodes, partners, rows, .. } = self;
        let mut farthest = 0.0_f64;
        for (index, partner) in partners.iter().enumerate() {
            let Own::Rigid(at_rigid) = partner else { continue };
            let (rigid, touch) = (&contacts.rigids[at_rigid.rigid], &contacts.contacts[index].touch);
            for &number in &at_rigid.near {
                let at = number as usize;
                if nodes[at].then == nodes[at].free {
                    continue;
                }
                let depth = nodes[at].depth.max(FOUND * deepest);
                let before = nodes[at].then;
                for _ in 0..LOOKED {
                    let place = nodes[at].then;
                    let (gap, normal) = at_rigid.gap(rigid, touch.offset, &places[at], &place);
                    let side = if gap < -OFF * depth {
                        let carried = at_rigid.passage.carry(&places[at]);
                        idle(rows, &mut nodes[at], Row { carried, ..Row::new(index, [number], [1.0]) })
                    } else if gap > OFF * depth {
                        take_back(rows, &mut nodes[at], index)
                    } else {
                        None
                    };
                    let Some(side) = side else { break };
                    let row = &mut rows[side as usize];
                    (row.place, row.mobility) = (place, nodes[at].mobility);
                    (row.normal, row.gap, row.idle_to) = (normal, gap, f64::NEG_INFINITY);
                    push_alone(rows, nodes, number, FOUND * depth, contacts);
                }
                farthest = farthest.max((nodes[at].then - before).norm());
            }
        }
        farthest
    }

    /// Lifts nodes that are still in a thing.
    fn lift(&mut self) {
        let sums = self.forces.iter_mut().zip(&mut self.moments);
        for ((contact, partner), (force, moment)) in
            self.contacts.contacts.iter().zip(&self.partners).zip(sums)
        {
            let Own::Rigid(at_rigid) = partner else { continue };
            let rigid = &self.contacts.rigids[at_rigid.rigid];
            for &node in &at_rigid.near {
                let now = &self.places[node as usize];
                let node = &mut self.nodes[node as usize];
                // Where it goes freely it is out of the thing, or it would have a row.
                if node.then == node.free {
                    continue;
                }
                let mut first = None;
                for _ in 0..LIFTS {
                    let (gap, normal) = at_rigid.gap(rigid, contact.touch.offset, now, &node.then);
                    let deepest = *first.get_or_insert(gap.min(0.0));
                    let along = node.mobility.component_mul(&normal);
                    if gap >= LIFTED * deepest || along.dot(&normal) <= 0.0 {
                        break;
                    }
                    let push = -gap / along.dot(&normal);
                    node.then += along * push;
                    node.lifted += normal * push;
                    *force = add(*force, (normal * push).into());
                    *moment = add(*moment, now.cross(&(normal * push)).into());
                }
            }
        }
    }
}

/// The force [N] of a way [m] over a mobility [m/N].
fn over(moved: &Vector3<f64>, mobility: &Vector3<f64>) -> Vector3<f64> {
    moved.zip_map(mobility, |moved, m| if m > 0.0 { moved / m } else { 0.0 })
}
