//! Contacts in a step: nodes are predicted, and impulses found that keep them and points between them apart from rigid things, other bodies and
//! other parts of their own. A point pair x = Σ cᵢ xᵢ with normal n and gap g is a row: impulses cᵢ λ n on its nodes with λ ≥ 0, g ≥ 0 and
//! λ g = 0, and against its slip by at most μ λ. Projected Gauss–Seidel finds them, in the order of the rows: momentum is kept to the last bit of
//! each impulse. A last pass over nodes alone keeps these out of curved rigid things, too.

mod nodal;

use std::sync::Arc;

use nalgebra::Vector3;
use pliant_contact::pairs::{Pairs, Surface};
use pliant_contact::pose::Pose;
use pliant_contact::shape::{Near, Shape};
use pliant_contact::touch::{Contact, Contacts, Gripped, LEFT, Passage, Rigid, With, lattice, parts_of};
use pliant_mechanics::tensor::{Vector, add};

pub use nodal::NodeContact;

/// Passes over all rows at most.
const PASSES: usize = 30;
/// The motion by an impulse, over the depth of the deepest point, that others are not found anew for.
const FOUND: f64 = 1e-3;
/// Times at most that impulses are found with sides of things where nodes came to lie.
const ROUNDS: usize = 4;
/// Sides of things at most that are looked for at a node in a round.
const SIDES: usize = 8;
/// Distance of a node from the surface of a thing, over the depth of the deepest point, from which on it lies off or behind it.
const OFF: f64 = 1e-3;
/// Gaps, over the depth of the deepest point, up to which points take part.
const BAND: f64 = 8.0;
/// Times at most that a node is lifted out of a thing: creases turn it from one side to another.
const LIFTS: usize = 16;
/// The gap, over the first one, at which it is out.
const LIFTED: f64 = 1e-4;
/// Part of the longest edge of a surface that a node may be away from a thing and still count as near, in addition to its way in the step.
const MARGIN: f64 = 0.1;
/// How much farther than nodes count as near they are listed, over that margin.
const SKIN: f64 = 1.0;

/// Distance [thinnest part of a jaw] at which a node touches it.
const TOUCHING: f64 = 1e-6;
/// Cosine of the angle to the normal of a jaw's inner face up to which nodes are between the jaws.
const INWARD: f64 = 0.7;

/// No row.
const NONE: u32 = u32::MAX;

/// How a rigid thing is in a step.
pub(crate) struct Posture {
    /// Its poses before and after.
    pub poses: [Pose; 2],
    /// The angle [rad] between its jaws after.
    pub opening: f64,
}

/// Where a node goes without contact.
pub(crate) struct Free {
    /// Its place [m] after the step.
    pub then: Vector<f64>,
    /// By how much a force moves each component over the step [m/N]; zero of those that are prescribed.
    pub mobility: Vector<f64>,
}

/// A node in a step.
#[derive(Clone, Copy, Debug)]
struct Node {
    now: Vector3<f64>,
    free: Vector3<f64>,
    then: Vector3<f64>,
    /// By how much contacts can move each component; zero also of nodes that jaws hold.
    mobility: Vector3<f64>,
    /// By how much a force does.
    own: Vector3<f64>,
    /// Impulses [N] of rows on it, of a node that jaws hold.
    borne: Vector3<f64>,
    /// Impulses [N] of the last pass on it.
    lifted: Vector3<f64>,
    /// Whether it may touch something, so that its prediction is known.
    near: bool,
    /// The count of motions by impulses when one last moved it.
    moved: u32,
    /// The first of the rows on it alone.
    first: u32,
}

impl Node {
    const NONE: Self = {
        let zero = Vector3::new(0.0, 0.0, 0.0);
        Self {
            now: zero,
            free: zero,
            then: zero,
            mobility: zero,
            own: zero,
            borne: zero,
            lifted: zero,
            near: false,
            moved: 0,
            first: NONE,
        }
    };
}

/// What a contact is about, in numbers of nodes of [`Touching`].
enum Own {
    Rigid(AtRigid),
    /// Bodies in the order of their nodes, with −1 where the contact names them in the other one: results don't depend on that.
    Bodies(Pairs, f64),
}

/// A surface at a rigid thing.
struct AtRigid {
    /// The thing, by its place in [`Contacts::rigids`].
    rigid: usize,
    surface: Surface,
    /// Points of each face.
    samples: Vec<[f64; 3]>,
    /// How far [m] a point of a face can be from its nearest corner.
    reach: f64,
    /// Distance [m] at which a node at rest still counts as near.
    margin: f64,
    passage: Passage,
    /// Whether it is a jaw that holds what touches it.
    grips: bool,
    listed: Listed,
}

/// What may come near a rigid thing, until the surface and the thing have moved too far.
#[derive(Default)]
struct Listed {
    /// Distance [m] up to which nodes and faces are listed.
    reach: f64,
    /// The pose of the thing then, and the places [m] of the nodes of the surface.
    pose: Pose,
    places: Vec<Vector3<f64>>,
    /// Nodes of the surface with the corners of the faces, and faces by their place; increasing.
    nodes: Vec<u32>,
    faces: Vec<u32>,
}

/// A pair of points that may touch.
struct Row {
    contact: usize,
    nodes: [u32; 4],
    weights: [f64; 4],
    /// How many nodes take part.
    count: usize,
    normal: Vector3<f64>,
    /// The gap [m] as predicted, and Σ cᵢ xᵢ [m] then.
    gap: f64,
    place: Vector3<f64>,
    /// Σ cᵢ xᵢ [m] of no slip.
    carried: Vector3<f64>,
    mobility: Vector3<f64>,
    /// Impulse over the step along the normal [N], and across it.
    push: f64,
    drag: Vector3<f64>,
    /// 1 if the impulse acts on the first surface of the contact, −1 if on the second.
    sign: f64,
    /// The count of motions by impulses when it was last looked at.
    seen: u32,
    /// Of a row on a node alone: the next one.
    next: u32,
}

impl Row {
    fn new<const N: usize>(contact: usize, nodes: [u32; N], weights: [f64; N]) -> Self {
        let zero = Vector3::zeros();
        let (normal, place, carried, mobility, drag) = (zero, zero, zero, zero, zero);
        let at = |k: usize| k.min(N - 1);
        let nodes = std::array::from_fn(|k| nodes[at(k)]);
        let weights = std::array::from_fn(|k| weights[at(k)]);
        Self {
            contact,
            nodes,
            weights,
            count: N,
            normal,
            gap: 0.0,
            place,
            carried,
            mobility,
            push: 0.0,
            drag,
            sign: 1.0,
            seen: 0,
            next: NONE,
        }
    }

    /// The nodes that take part, with their weights.
    fn parts(&self) -> impl Iterator<Item = (usize, f64)> {
        self.nodes.iter().zip(&self.weights).take(self.count).map(|(&node, &weight)| (node as usize, weight))
    }

    /// Finds its impulse with the others as they are. How far it moves its point [m].
    fn push_apart(&mut self, nodes: &mut [Node], friction: f64) -> f64 {
        let along = self.mobility.component_mul(&self.normal).dot(&self.normal);
        if along <= 0.0 {
            return 0.0;
        }
        let mut place = Vector3::zeros();
        for (node, weight) in self.parts() {
            place += nodes[node].then * weight;
        }
        let gap = self.gap + self.normal.dot(&(place - self.place));
        let before = self.push;
        self.push = (before - gap / along).max(0.0);
        let mut more = self.normal * (self.push - before);
        if friction > 0.0 && (self.push > 0.0 || before > 0.0) {
            let slip = place + self.mobility.component_mul(&more) - self.carried;
            let slip = slip - self.normal * self.normal.dot(&slip);
            let across = self.mobility.component_mul(&slip).dot(&slip) / slip.norm_squared();
            let wanted = if across > 0.0 { self.drag - slip / across } else { self.drag };
            let limit = friction * self.push;
            let size = wanted.norm();
            let drag = if size > limit { wanted * (limit / size) } else { wanted };
            more += drag - self.drag;
            self.drag = drag;
        }
        if more == Vector3::zeros() {
            return 0.0;
        }
        for (node, weight) in self.parts() {
            let node = &mut nodes[node];
            node.then += node.mobility.component_mul(&more) * weight;
        }
        self.mobility.component_mul(&more).norm()
    }

    /// Takes places and mobilities; returns Σ cᵢ xᵢ [m] before the step.
    fn place(&mut self, nodes: &[Node]) -> Vector3<f64> {
        let mut now = Vector3::zeros();
        let (mut place, mut mobility) = (Vector3::zeros(), Vector3::zeros());
        for (node, weight) in self.parts() {
            let node = &nodes[node];
            place += node.then * weight;
            now += node.now * weight;
            mobility += node.mobility * (weight * weight);
        }
        (self.place, self.mobility) = (place, mobility);
        now
    }
}

/// Of the rows of a contact on a node alone, one without an impulse.
fn idle(rows: &[Row], node: &Node, contact: usize) -> Option<u32> {
    let mut next = node.first;
    while let Some(row) = rows.get(next as usize) {
        if row.contact == contact && row.push == 0.0 {
            return Some(next);
        }
        next = row.next;
    }
    None
}

/// Takes back the impulses of a contact on a node alone; the last such row, if there are any.
fn take_back(rows: &mut [Row], node: &mut Node, contact: usize) -> Option<u32> {
    let (mut next, mut last) = (node.first, None);
    while let Some(row) = rows.get_mut(next as usize) {
        if row.contact == contact && row.push > 0.0 {
            node.then -= node.mobility.component_mul(&(row.normal * row.push + row.drag));
            (row.push, row.drag) = (0.0, Vector3::zeros());
            last = Some(next);
        }
        next = row.next;
    }
    last
}

/// Impulses of the rows of a node alone, until they move it by no more than a length [m].
fn push_alone(rows: &mut [Row], nodes: &mut [Node], number: u32, found: f64, friction: impl Fn(&Row) -> f64) {
    for _ in 0..PASSES {
        let (mut moved, mut next) = (0.0_f64, nodes[number as usize].first);
        while let Some(row) = rows.get_mut(next as usize) {
            let friction = friction(row);
            moved = moved.max(row.push_apart(nodes, friction));
            next = row.next;
        }
        if moved <= found {
            break;
        }
    }
}

/// The contacts of a model, with the nodes that they are about.
pub(crate) struct Touching {
    contacts: Arc<Contacts>,
    numbers: Vec<u32>,
    nodes: Vec<Node>,
    own: Vec<Own>,
    /// Distances [m] of the nodes from a rigid thing, by node.
    distances: Vec<f64>,
    rows: Vec<Row>,
    /// Triangles of all surfaces, each once.
    faces: Vec<[u32; 3]>,
    /// Impulses [N] on each node in a step, and their slips weighted by them.
    slips: Vec<[f64; 2]>,
    /// The force [N] of each contact on its first surface at the last evaluation.
    pub forces: Vec<Vector<f64>>,
}

impl Touching {
    /// Those of a model with these nodes at rest [m].
    pub fn new(contacts: Arc<Contacts>, rest: &[Vector<f64>]) -> Self {
        let surfaces = contacts.contacts.iter().flat_map(|Contact { surface, with, .. }| {
            let other = if let With::Body(other) = with { Some(other) } else { None };
            std::iter::once(surface).chain(other)
        });
        let mut numbers: Vec<u32> = surfaces.flat_map(|surface| &surface.nodes).copied().collect();
        numbers.sort_unstable();
        numbers.dedup();
        // Faces are of nodes that touch.
        let number = |node: &u32| numbers.partition_point(|known| known < node) as u32;
        let own = |Surface { nodes, faces }: &Surface| {
            let faces = faces.iter().map(|face| face.map(|node| number(&node))).collect();
            Surface { nodes: nodes.iter().map(number).collect(), faces }
        };
        let place = |node: u32| Vector3::from(rest[numbers[node as usize] as usize]);
        let pairs = |contact: &Contact, second: Option<&Surface>| {
            let first = own(&contact.surface);
            let (first, second, sign) = match second {
                Some(second) if second.nodes < first.nodes => (second, Some(&first), -1.0),
                _ => (&first, second, 1.0),
            };
            Own::Bodies(Pairs::new(first, second, contact.touch.offset, place), sign)
        };
        let parts = contacts.contacts.iter().map(|contact| match &contact.with {
            &With::Rigid(rigid) => {
                Own::Rigid(AtRigid::new(&contacts.rigids[rigid], rigid, own(&contact.surface), place))
            }
            With::Body(second) => pairs(contact, Some(&own(second))),
            With::Itself => pairs(contact, None),
        });
        let own = parts.collect();
        Self {
            nodes: vec![Node::NONE; numbers.len()],
            distances: vec![0.0; numbers.len()],
            rows: Vec::new(),
            faces: nodal::faces(&contacts, &numbers),
            slips: vec![[0.0; 2]; numbers.len()],
            numbers,
            own,
            forces: vec![[0.0; 3]; contacts.contacts.len()],
            contacts,
        }
    }

    /// Finds the forces of contacts in a step. `now` is the place of a node [m] and about the way [m] it goes in the step; `gripped` are the
    /// nodes that jaws hold.
    pub fn find(
        &mut self,
        postures: impl Fn(usize, &Rigid) -> Posture,
        now: impl Fn(u32) -> (Vector<f64>, f64),
        free: impl Fn(u32) -> Free,
        gripped: &mut Vec<Gripped>,
    ) {
        self.forces.fill([0.0; 3]);
        let mut farthest = 0.0_f64;
        for (node, &number) in self.nodes.iter_mut().zip(&self.numbers) {
            let (place, way) = now(number);
            (node.now, node.near) = (place.into(), false);
            farthest = farthest.max(way);
        }
        for own in &mut self.own {
            if let Own::Rigid(own) = own {
                let rigid = &self.contacts.rigids[own.rigid];
                let posture = postures(own.rigid, rigid);
                (own.passage, own.grips) = (Passage::new(rigid, posture.poses), rigid.grips(posture.opening));
            }
        }
        gripped.retain(|held| self.holder(held).is_some_and(|(_, own, _)| own.grips));
        self.look(farthest, free, gripped);
        if self.nodes.iter().any(|node| node.near) {
            self.hold(gripped);
            self.measure();
            self.solve();
            self.lift();
            self.bear(gripped);
            self.take(gripped);
        }
    }

    /// The force [N] on each node that touches something.
    pub fn nodal_forces(&self) -> impl Iterator<Item = (u32, Vector<f64>)> {
        let touching = |(node, _): &(&Node, &u32)| node.near && node.then != node.free;
        let nodes = self.nodes.iter().zip(&self.numbers).filter(touching);
        nodes.map(|(node, &number)| (number, over(&(node.then - node.free), &node.own).into()))
    }

    /// Finds the nodes that may touch in the step, and where they go; rows of the points near rigid things.
    fn look(&mut self, farthest: f64, free: impl Fn(u32) -> Free, gripped: &[Gripped]) {
        let Self { contacts, numbers, nodes, own, distances, rows, .. } = self;
        rows.clear();
        for (index, own) in own.iter_mut().enumerate() {
            match own {
                Own::Rigid(own) => {
                    let offset = contacts.contacts[index].touch.offset;
                    own.look(&contacts.rigids[own.rigid], offset + 2.0 * farthest, nodes, distances, |row| {
                        rows.push(Row { contact: index, ..row });
                    });
                }
                Own::Bodies(pairs, _) => {
                    // A way can double in a step.
                    pairs.update(|node| nodes[node as usize].now, 2.0 * farthest);
                    pairs.near().iter().for_each(|&node| nodes[node as usize].near = true);
                }
            }
        }
        for node in gripped.iter().filter_map(|held| numbers.binary_search(&held.node).ok()) {
            nodes[node].near = true;
        }
        for (node, &number) in nodes.iter_mut().zip(numbers.iter()).filter(|(node, _)| node.near) {
            let Free { then, mobility } = free(number);
            (node.free, node.then) = (then.into(), then.into());
            (node.mobility, node.own) = (mobility.into(), mobility.into());
            (node.borne, node.lifted, node.moved) = (Vector3::zeros(), Vector3::zeros(), 1);
        }
    }

    /// The contact by which a jaw holds a node, by its place, and the node's own number.
    fn holder(&self, held: &Gripped) -> Option<(usize, &AtRigid, usize)> {
        let node = self.numbers.binary_search(&held.node).ok()?;
        self.own.iter().enumerate().find_map(|(index, own)| {
            let Own::Rigid(own) = own else { return None };
            let holds =
                own.rigid == held.rigid as usize && own.surface.nodes.binary_search(&(node as u32)).is_ok();
            holds.then_some((index, own, node))
        })
    }

    /// Takes nodes along that jaws hold.
    fn hold(&mut self, gripped: &[Gripped]) {
        for held in gripped {
            let Some((_, own, node)) = self.holder(held) else { continue };
            let goal = own.passage.place(&held.at.into());
            let node = &mut self.nodes[node];
            for c in (0..3).filter(|&c| node.own[c] > 0.0) {
                (node.then[c], node.mobility[c]) = (goal[c], 0.0);
            }
        }
    }

    /// Adds the forces of jaws on the nodes that they hold: what rows on these do not bear.
    fn bear(&mut self, gripped: &[Gripped]) {
        for held in gripped {
            let Some((index, _, node)) = self.holder(held) else { continue };
            let node = &self.nodes[node];
            let force = over(&(node.then - node.free), &node.own) - node.borne;
            self.forces[index] = add(self.forces[index], force.into());
        }
    }

    /// Lets jaws that are closed hold the nodes that touch their inner faces.
    fn take(&self, gripped: &mut Vec<Gripped>) {
        for (contact, own) in self.contacts.contacts.iter().zip(&self.own) {
            let Own::Rigid(own @ AtRigid { grips: true, .. }) = own else { continue };
            let rigid = &self.contacts.rigids[own.rigid];
            let inward = rigid.jaw.as_ref().map_or(0.0, |jaw| jaw.part.signum());
            for &node in own.surface.nodes.iter().filter(|&&node| self.nodes[node as usize].near) {
                let (at, Near { distance, normal }) =
                    own.passage.within(rigid, &self.nodes[node as usize].then);
                let node = self.numbers[node as usize];
                let touches = distance - contact.touch.offset <= TOUCHING * rigid.shape.thinnest();
                if touches && normal.y * inward > INWARD && gripped.iter().all(|held| held.node != node) {
                    gripped.push(Gripped { rigid: own.rigid as u32, node, at: at.into() });
                }
            }
        }
    }

    /// Finds the gaps of all rows; leaves out those that are too wide to close.
    fn measure(&mut self) {
        let Self { contacts, nodes, own, rows, .. } = self;
        let mut deepest = 0.0_f64;
        rows.retain_mut(|row| {
            let Own::Rigid(own) = &own[row.contact] else { return false };
            let now = row.place(nodes);
            let rigid = &contacts.rigids[own.rigid];
            let offset = contacts.contacts[row.contact].touch.offset;
            let Near { distance, normal } = own.passage.meet(rigid, offset, &now, &row.place);
            (row.normal, row.gap, row.carried) = (normal, distance - offset, own.passage.carry(&now));
            deepest = deepest.max(-row.gap);
            row.gap < own.margin
        });
        for (index, own) in own.iter().enumerate() {
            let Own::Bodies(pairs, sign) = own else { continue };
            let offset = contacts.contacts[index].touch.offset;
            // Impulses along the way between two points before the step have no moment.
            pairs.find(
                |node| nodes[node as usize].now,
                |pair| {
                    let mut row = Row::new(index, pair.nodes, pair.weights);
                    row.carried = row.place(nodes);
                    (row.normal, row.sign) = (pair.normal, if pair.in_order { *sign } else { -sign });
                    row.gap = row.normal.dot(&row.place) - offset;
                    deepest = deepest.max(-row.gap);
                    rows.push(row);
                },
            );
        }
        // No impulse moves a point farther than a few times the deepest one.
        rows.retain(|row| row.gap < BAND * deepest);
    }

    /// Impulses of all rows. The side of a thing is that where a node is predicted, which can be deep; where the node comes to lie off this
    /// side, the side beside it takes its place, and where it lies behind another one, that is one more row.
    fn solve(&mut self) {
        let deepest = self.rows.iter().map(|row| -row.gap).fold(0.0, f64::max);
        if deepest <= 0.0 {
            return;
        }
        self.chain();
        let (mut looked, mut motions) = (0, 1);
        for _ in 0..ROUNDS {
            let before = motions;
            motions = self.relax(deepest, motions);
            if motions == before {
                break;
            }
            let since = std::mem::replace(&mut looked, motions);
            motions = self.settle(deepest, since, motions);
        }
        let Self { nodes, rows, forces, .. } = self;
        for row in rows.iter() {
            let force = (row.normal * row.push + row.drag) * row.sign;
            forces[row.contact] = add(forces[row.contact], force.into());
            for (node, weight) in row.parts() {
                nodes[node].borne += (row.normal * row.push + row.drag) * weight;
            }
        }
    }

    /// Links the rows of each node alone.
    fn chain(&mut self) {
        self.nodes.iter_mut().for_each(|node| node.first = NONE);
        for (row, number) in self.rows.iter_mut().zip(0..).filter(|(row, _)| row.count == 1) {
            row.next = std::mem::replace(&mut self.nodes[row.nodes[0] as usize].first, number);
        }
    }

    /// Impulses of the rows there are, by projected Gauss–Seidel: of those whose nodes have moved since they were looked at. Counts motions.
    fn relax(&mut self, deepest: f64, mut motions: u32) -> u32 {
        let Self { contacts, nodes, rows, .. } = self;
        for _ in 0..PASSES {
            let mut is_found = true;
            for row in rows.iter_mut() {
                if row.parts().all(|(node, _)| nodes[node].moved <= row.seen) {
                    continue;
                }
                (row.seen, is_found) = (motions, false);
                if row.push_apart(nodes, contacts.contacts[row.contact].touch.friction) > FOUND * deepest {
                    motions += 1;
                    row.parts().for_each(|(node, _)| nodes[node].moved = motions);
                }
            }
            if is_found {
                break;
            }
        }
        motions
    }

    /// Sides of things beside nodes that have moved since a count of motions, and their impulses, a node at a time. Counts motions.
    fn settle(&mut self, deepest: f64, since: u32, mut motions: u32) -> u32 {
        let Self { contacts, nodes, own, rows, .. } = self;
        for (index, own) in own.iter().enumerate() {
            let Own::Rigid(own) = own else { continue };
            let (rigid, touch) = (&contacts.rigids[own.rigid], &contacts.contacts[index].touch);
            for &number in &own.listed.nodes {
                let at = number as usize;
                if !nodes[at].near || nodes[at].moved <= since {
                    continue;
                }
                let mut has_moved = false;
                for _ in 0..SIDES {
                    let (place, now) = (nodes[at].then, nodes[at].now);
                    let Near { distance, normal } = own.passage.near(rigid, &place);
                    let mut gap = distance - touch.offset;
                    if gap < 0.0 {
                        gap -= own.left(rigid, touch.offset, &now);
                    }
                    let side = if gap < -OFF * deepest {
                        idle(rows, &nodes[at], index).unwrap_or_else(|| {
                            let side = Row::new(index, [number], [1.0]);
                            let carried = own.passage.carry(&now);
                            rows.push(Row { carried, next: nodes[at].first, ..side });
                            nodes[at].first = (rows.len() - 1) as u32;
                            nodes[at].first
                        })
                    } else if gap > OFF * deepest
                        && let Some(side) = take_back(rows, &mut nodes[at], index)
                    {
                        side
                    } else {
                        break;
                    };
                    let row = &mut rows[side as usize];
                    (row.place, row.mobility) = (place, nodes[at].mobility);
                    (row.normal, row.gap) = (normal, gap);
                    push_alone(rows, nodes, number, FOUND * deepest, |row| {
                        contacts.contacts[row.contact].touch.friction
                    });
                    has_moved = true;
                }
                motions += u32::from(has_moved);
                nodes[at].moved = if has_moved { motions } else { nodes[at].moved };
            }
        }
        motions
    }

    /// Lifts nodes that are still in a thing.
    fn lift(&mut self) {
        for ((contact, own), force) in self.contacts.contacts.iter().zip(&self.own).zip(&mut self.forces) {
            let Own::Rigid(own) = own else { continue };
            let rigid = &self.contacts.rigids[own.rigid];
            for &node in &own.listed.nodes {
                let node = &mut self.nodes[node as usize];
                if !node.near {
                    continue;
                }
                let offset = contact.touch.offset;
                let mut first = None;
                for _ in 0..LIFTS {
                    let Near { distance, normal } = own.passage.near(rigid, &node.then);
                    let gap = distance - offset;
                    if gap >= 0.0 {
                        break;
                    }
                    let left = || own.left(rigid, offset, &node.now);
                    let (deepest, left) = *first.get_or_insert_with(|| (gap, left()));
                    let along = node.mobility.component_mul(&normal);
                    if gap - left >= LIFTED * deepest || along.dot(&normal) <= 0.0 {
                        break;
                    }
                    let push = (left - gap) / along.dot(&normal);
                    node.then += along * push;
                    node.lifted += normal * push;
                    *force = add(*force, (normal * push).into());
                }
            }
        }
    }
}

impl AtRigid {
    fn new(rigid: &Rigid, number: usize, surface: Surface, place: impl Fn(u32) -> Vector3<f64>) -> Self {
        let edges = surface.faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let longest = edges.map(|[a, b]| (place(a) - place(b)).norm()).fold(0.0, f64::max);
        Self {
            rigid: number,
            samples: lattice(parts_of(longest, &rigid.shape)),
            reach: longest,
            margin: MARGIN * longest,
            passage: Passage::new(rigid, [Pose::identity(); 2]),
            grips: false,
            listed: Listed::default(),
            surface,
        }
    }

    /// How far behind an offset [m] a node may stay that is at a place [m] before the step: at most 0.
    fn left(&self, rigid: &Rigid, offset: f64, now: &Vector3<f64>) -> f64 {
        LEFT * (self.passage.distance_before(rigid, now) - offset).min(0.0)
    }

    /// Lists what is within a distance [m] of the thing, if the list does not hold so much any more.
    fn list(&mut self, rigid: &Rigid, room: f64, nodes: &[Node]) {
        let Self { surface, samples, margin, passage, listed, .. } = self;
        let places = || surface.nodes.iter().map(|&node| nodes[node as usize].now);
        let moved = places().zip(&listed.places).map(|(now, then)| (now - then).norm_squared());
        let moved = moved.fold(0.0, f64::max).sqrt() + passage.travel_from(rigid, &listed.pose);
        if !listed.places.is_empty() && room + moved <= listed.reach {
            return;
        }
        let Listed { reach, pose, places: then, nodes: near, faces } = listed;
        // Sampled distances can change faster than a point moves.
        let grows_evenly = !matches!(rigid.shape, Shape::Grid(_));
        (*reach, *pose) = (if grows_evenly { room + SKIN * *margin } else { f64::INFINITY }, passage.pose());
        then.clear();
        then.extend(places());
        near.clear();
        faces.clear();
        let distance = |point: &Vector3<f64>| passage.near(rigid, point).distance;
        near.extend(surface.nodes.iter().filter(|&&node| distance(&nodes[node as usize].now) < *reach));
        if samples.is_empty() {
            return;
        }
        for (face, number) in surface.faces.iter().zip(0..) {
            let (middle, around) = middle(face, nodes);
            if distance(&middle) < *reach + around {
                faces.push(number);
                near.extend(face);
            }
        }
        near.sort_unstable();
        near.dedup();
    }

    /// Marks the nodes that may come nearer than a room [m] in the passage; rows of these and of points between them.
    fn look(
        &mut self,
        rigid: &Rigid,
        room: f64,
        nodes: &mut [Node],
        distances: &mut [f64],
        mut found: impl FnMut(Row),
    ) {
        let room = room + self.margin + self.passage.travel();
        self.list(rigid, room, nodes);
        let mut nearest = f64::INFINITY;
        for &node in &self.listed.nodes {
            let distance = self.passage.near(rigid, &nodes[node as usize].now).distance;
            distances[node as usize] = distance;
            nearest = nearest.min(distance);
            if distance < room {
                nodes[node as usize].near = true;
                found(Row::new(0, [node], [1.0]));
            }
        }
        if nearest > room + self.reach {
            return;
        }
        for &face in &self.listed.faces {
            let face = self.surface.faces[face as usize];
            let corners = face.map(|node| nodes[node as usize].now);
            let (middle, around) = middle(&face, nodes);
            // No point is nearer than one beside it by more than the way between both.
            let own = face.map(|node| distances[node as usize]);
            if own.iter().all(|&distance| distance > room + 2.0 * around) {
                continue;
            }
            let between = self.passage.near(rigid, &middle).distance;
            if between > room + around {
                continue;
            }
            let mut is_near = false;
            for &weights in &self.samples {
                let place = (0..3).map(|k| corners[k] * weights[k]).sum::<Vector3<f64>>();
                let is_beyond = |at: &Vector3<f64>, distance: f64| {
                    let far = distance - room;
                    far > 0.0 && (place - at).norm_squared() < far * far
                };
                if !is_beyond(&middle, between) && !(0..3).any(|k| is_beyond(&corners[k], own[k])) {
                    is_near = true;
                    found(Row::new(0, face, weights));
                }
            }
            if is_near {
                face.iter().for_each(|&node| nodes[node as usize].near = true);
            }
        }
    }
}

/// The middle of a face [m], and how far its corners are from there at most [m].
fn middle(face: &[u32; 3], nodes: &[Node]) -> (Vector3<f64>, f64) {
    let corners = face.map(|node| nodes[node as usize].now);
    let middle = corners.iter().sum::<Vector3<f64>>() / 3.0;
    (middle, corners.iter().map(|corner| (corner - middle).norm()).fold(0.0, f64::max))
}

/// The force [N] of a way [m] over a mobility [m/N].
fn over(moved: &Vector3<f64>, mobility: &Vector3<f64>) -> Vector3<f64> {
    moved.zip_map(mobility, |moved, m| if m > 0.0 { moved / m } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use pliant_contact::pose::Course;
    use pliant_testing::Random;

    const CELLS: u32 = 12;

    /// A sheet of triangles over the unit square.
    fn sheet() -> (Surface, Vec<Vector3<f64>>) {
        let across = CELLS + 1;
        let node = |i: u32, j: u32| i * across + j;
        let cells = (0..CELLS).flat_map(|i| (0..CELLS).map(move |j| (i, j)));
        let faces = cells.flat_map(|(i, j)| {
            let [a, b, c, d] = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
            [[a, b, c], [a, c, d]]
        });
        let place =
            |k: u32| Vector3::new(f64::from(k / across), f64::from(k % across), 0.0) / f64::from(CELLS);
        let nodes: Vec<u32> = (0..across * across).collect();
        (Surface { faces: faces.collect(), nodes: nodes.clone() }, nodes.into_iter().map(place).collect())
    }

    /// The rows of a step are those of lists made in this step, however the sheet waves and the thing moves and turns.
    #[test]
    fn lists_leave_nothing_out() {
        let (surface, rest) = sheet();
        let shapes = [
            Shape::Capsule { radius: 0.05, length: 0.3 },
            Shape::Cuboid { size: [0.1, 0.3, 0.2] },
            Shape::HalfSpace,
        ];
        for shape in shapes {
            let rigid = Rigid {
                name: "thing".into(),
                shape,
                course: Course::fixed(Pose::identity()),
                inside: false,
                jaw: None,
            };
            let fresh = || AtRigid::new(&rigid, 0, surface.clone(), |node| rest[node as usize]);
            let (mut own, mut random) = (fresh(), Random::new(7));
            let mut nodes = vec![Node::NONE; rest.len()];
            let mut before = Pose::translation(0.1, 0.5, 0.1);
            let (mut listed, mut found) = (0, 0);
            for step in 0..400 {
                let time = f64::from(step) * 0.01;
                for (node, at) in nodes.iter_mut().zip(&rest) {
                    node.now =
                        at + Vector3::z() * (0.02 * (3.0 * time + 5.0 * at.x).sin() + 1e-4 * random.part());
                }
                let turn = Vector3::new(0.2 * time.sin(), 0.0, 0.1 * time);
                let after = Pose::new(Vector3::new(0.1 + 0.2 * time, 0.5, 0.08 + 0.05 * time.cos()), turn);
                let mut rows = |own: &mut AtRigid| {
                    own.passage = Passage::new(&rigid, [before, after]);
                    let mut rows = Vec::new();
                    let mut distances = vec![0.0; rest.len()];
                    own.look(&rigid, 1e-3, &mut nodes, &mut distances, |row| {
                        rows.push((row.nodes, row.weights))
                    });
                    rows
                };
                let anew = rows(&mut fresh());
                let (pose, reach) = (own.listed.pose, own.listed.reach);
                assert_eq!(rows(&mut own), anew, "{:?} at {time} s", rigid.shape);
                listed += u32::from((own.listed.pose, own.listed.reach) != (pose, reach));
                found += anew.len();
                before = after;
            }
            println!("{:?}: {found} rows in 400 steps, listed anew in {listed}", rigid.shape);
            assert!(found > 1000 && (listed < 200 || matches!(rigid.shape, Shape::HalfSpace)));
        }
    }
}
