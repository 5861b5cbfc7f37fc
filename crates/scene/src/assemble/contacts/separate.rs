//! Bodies that overlap at the start are pushed apart. With the gap g < 0 of points Σ cᵢ xᵢ along a normal n,
//! xᵢ += cᵢ n λ, λ = −g / Σ cᵢ². Passes over all contacts repeat until nothing overlaps, and no edge of one
//! body goes through another. Nodes inside of bodies follow harmonically. With `separate` the shape at rest
//! stays, so that the run starts deformed; with `gap` the shape at rest moves. No body is moved as a whole.

use std::collections::BTreeSet;
use std::sync::Arc;

use nalgebra::Vector3 as Vector;
use pliant_explicit::State;
use pliant_explicit::recover::Recovery;
use pliant_geometry::words::{counted, number};
use pliant_geometry::{Locator, SurfaceLocator, Vector3};
use pliant_mechanics::model::FREE;
use pliant_sim::contact::barrier::IntersectionCheck;
use pliant_sim::contact::pairs::{Pairs, Surface};
use pliant_sim::contact::touch::{Contact, Contacts, Rigid, With, lattice, parts_of};

use super::{InContact, OVERLAP, hang};
use crate::assemble::bodies::Meshed;
use crate::assemble::ties::Tied;
use crate::assemble::{BuiltBody, Context, in_metres};

/// The gap between bodies that were pushed apart, over the distance of their barrier, is this at least.
const LEAST_GAP: f64 = 0.5;
/// Passes at most.
const PASSES: usize = 400;
/// Cosine of the angle between the shortest way out of a thing and that into the own body, below which the
/// latter is taken.
const FACING: f64 = 0.3;
/// Sweeps in which inner nodes follow.
const SWEEPS: usize = 200;

/// Points that are pushed along a normal: nodes with their weights.
struct Row {
    parts: Vec<(u32, f64)>,
    normal: Vector3,
}

/// Nodes that are pushed.
struct Pushed {
    places: Vec<Vector3>,
    /// 1 along components that are free, else 0.
    free: Vec<Vector3>,
    /// Gap [m] below which points are pushed, and the gap left between them. Barriers set the gaps; without
    /// barriers no gap is left.
    least: f64,
    left: f64,
    /// Ways [m] up to this have no direction.
    round_off: f64,
    /// The deepest overlap [m] in a pass, and where.
    deepest: (f64, Vector3),
}

impl Pushed {
    fn push(&mut self, row: &Row) {
        let place: Vector3 = row.parts.iter().map(|&(node, c)| self.places[node as usize] * c).sum();
        self.push_by(row, row.normal.dot(&place));
    }

    /// Pushes points with too small a gap [m] apart.
    fn push_by(&mut self, row: &Row, gap: f64) {
        if gap >= self.least {
            return;
        }
        if self.least - gap > self.deepest.0 {
            self.deepest = (self.least - gap, self.places[row.parts[0].0 as usize]);
        }
        let along = |&(node, c): &(u32, f64)| {
            c * c * row.normal.component_mul(&row.normal).dot(&self.free[node as usize])
        };
        let mobility: f64 = row.parts.iter().map(along).sum();
        if mobility > 0.0 {
            let push = (self.left - gap) / mobility;
            for &(node, c) in &row.parts {
                let at = node as usize;
                self.places[at] += self.free[at].component_mul(&row.normal) * (c * push);
            }
        }
    }
}

impl<'s> InContact<'s> {
    /// The ways [m] of all nodes to shapes at rest that have the gaps of contacts between them; `None` if
    /// nothing has to move, or can't, or did already.
    pub(in crate::assemble) fn ways_to_gaps(&mut self) -> Option<Vec<Vector3>> {
        let contacts = self.contacts.clone()?;
        if self.is_parted || self.failed() {
            return None;
        }
        let scene = self.scene;
        let (name, _) = scene.contacts.iter().find(|(_, table)| table.gap.is_some())?;
        let before: Vec<Vector3> = self.assembly.rest.iter().map(|&rest| rest.into()).collect();
        let gaps = self.terms.gaps.clone();
        let kept = |index: usize| match (gaps[index], &contacts.contacts[index].with) {
            (None, _) => None,
            (Some(gap), With::Rigid(_)) => Some([gap; 2]),
            (Some(gap), _) => Some([gap + contacts.contacts[index].touch.offset; 2]),
        };
        let free = vec![Vector3::repeat(1.0); before.len()];
        let places = self.push_all_apart([name, "gap"], &contacts, &before, free, kept)?;
        let ways = self.follow_inside(&contacts, vec![false; before.len()], &before, &places);
        let displacement: Vec<[f64; 3]> = ways.iter().map(|way| (*way).into()).collect();
        let start = State::<f64>::at_rest(&self.assembly.model);
        self.check_cells_apart([name, "gap"], &displacement, start)?;
        self.note_pushed(&before, &places, OVERLAP * size_of(&before), "too near each other");
        ways.iter().any(|way| *way != Vector3::zeros()).then_some(ways)
    }

    /// Returns the bodies with shapes at rest moved by these ways [m], and a context for a new start. The
    /// context keeps the notes on how the bodies were made, and the last note: how they were parted.
    pub(in crate::assemble) fn parted(self, ways: &[Vector3]) -> (Context<'s>, Vec<BuiltBody>) {
        let Tied { meshed, noted, .. } = self.loaded.tied;
        let Meshed { context, assembly, mut bodies, .. } = meshed;
        for (body, model_body) in bodies.iter_mut().zip(&assembly.bodies) {
            for (point, node) in body.mesh.points.iter_mut().zip(model_body.all_nodes()) {
                *point += ways[node as usize];
            }
        }
        let Context { scene, cache, watch, mut notes, .. } = context;
        notes.drain(noted..notes.len() - 1);
        (Context { notes, ..Context::new(scene, cache, watch) }, bodies)
    }

    /// Returns the places of nodes [m] once nothing overlaps; `None` if something still does. For each
    /// contact that counts `kept` gives the gap [m] below which points are pushed, and the gap that is left.
    fn push_all_apart(
        &mut self,
        asked: [&str; 2],
        contacts: &Contacts,
        before: &[Vector3],
        free: Vec<Vector3>,
        kept: impl Fn(usize) -> Option<[f64; 2]>,
    ) -> Option<Vec<Vector3>> {
        let round_off = OVERLAP * size_of(before);
        let mut pushed = Pushed {
            places: before.to_vec(),
            free,
            least: 0.0,
            left: round_off,
            round_off,
            deepest: (0.0, Vector3::zeros()),
        };
        let check = IntersectionCheck::new(contacts, &self.assembly.rest);
        // A barrier cannot begin with an edge through a face, even by less than explicit runs count.
        let check = if self.scene.run.solver.solves_equations() { check.of_all() } else { check };
        let mut crossings = Vec::new();
        for pass in 0..=PASSES {
            pushed.deepest.0 = 0.0;
            for (index, contact) in contacts.contacts.iter().enumerate() {
                let Some(gaps) = kept(index) else { continue };
                [pushed.least, pushed.left] = gaps;
                self.push_apart(contact, contacts, &mut pushed);
            }
            check.find(|node| pushed.places[node as usize], |found| crossings.push(found));
            for found in crossings.drain(..) {
                let Some(gaps) = kept(found.contact) else { continue };
                if matches!(contacts.contacts[found.contact].with, With::Itself) {
                    continue;
                }
                [pushed.least, pushed.left] = gaps;
                let parts = found.nodes.into_iter().zip(found.coefficients).collect();
                pushed.push_by(&Row { parts, normal: -found.normal }, -found.depth);
            }
            if pushed.deepest.0 <= round_off {
                break;
            }
            if pass == PASSES {
                let (depth, at) = pushed.deepest;
                self.refuse_overlap(asked, depth, &at);
                return None;
            }
        }
        Some(pushed.places)
    }

    fn refuse_overlap(&mut self, [name, key]: [&str; 2], depth: f64, at: &Vector3) {
        let message = format!(
            "bodies cannot be pushed apart: an overlap of {} m at {} is left after {PASSES} passes",
            number(depth),
            in_metres(*at)
        );
        let help = "move one of them (`at`), or release constrained nodes there";
        self.error(&["contact", name, key], message, "still overlapping", help);
    }

    /// A pass over a contact.
    fn push_apart(&self, contact: &Contact, contacts: &Contacts, pushed: &mut Pushed) {
        match &contact.with {
            &With::Rigid(rigid) => {
                let is_solid = self.holder(&contact.surface).is_some_and(|body| {
                    self.bodies[body].mesh.volume_blocks().any(|block| !block.is_empty())
                });
                push_out(&contacts.rigids[rigid], contact.touch.offset, &contact.surface, is_solid, pushed);
            }
            With::Body(other) => {
                self.push_nodes_out(&contact.surface, other, pushed);
                self.push_nodes_out(other, &contact.surface, pushed);
                push_pairs(&contact.surface, other, pushed);
            }
            // Surfaces that are near at rest never touch.
            With::Itself => {}
        }
    }

    /// The body whose nodes a surface has.
    fn holder(&self, surface: &Surface) -> Option<usize> {
        let &node = surface.nodes.first()?;
        self.assembly.bodies.iter().position(|body| body.nodes.contains(&node))
    }

    /// Pushes nodes of a surface out of the cells of another body, the shortest way to its boundary.
    fn push_nodes_out(&self, surface: &Surface, other: &Surface, pushed: &mut Pushed) {
        let Some(body) = self.holder(other) else { return };
        let (model_body, built) = (&self.assembly.bodies[body], &self.bodies[body]);
        let mut mesh = built.mesh.clone();
        for (point, node) in mesh.points.iter_mut().zip(model_body.all_nodes()) {
            *point = pushed.places[node as usize];
        }
        let face_numbers: Vec<u32> = (0..built.boundary.faces.len() as u32).collect();
        let cells = Locator::new(&mesh);
        let faces = SurfaceLocator::new(&built.boundary, &face_numbers, &mesh.points);
        for &node in &surface.nodes {
            let at = pushed.places[node as usize];
            let inside = cells.locate(at).is_some_and(|found| found.distance == 0.0);
            let Some(on) = faces.closest(&at).filter(|_| inside) else { continue };
            let Some(normal) = (on.position - at).try_normalize(pushed.round_off) else { continue };
            let on =
                on.nodes.iter().zip(on.weights).map(|(&corner, weight)| (model_body.node(corner), -weight));
            let parts = std::iter::once((node, 1.0)).chain(on).collect();
            pushed.push(&Row { parts, normal });
        }
    }

    /// Ways [m] of all nodes; inner nodes that do not stay take the mean of their neighbours.
    fn follow_inside(
        &self,
        contacts: &Contacts,
        mut stays: Vec<bool>,
        before: &[Vector3],
        places: &[Vector3],
    ) -> Vec<Vector3> {
        let mut ways: Vec<Vector3> = places.iter().zip(before).map(|(now, then)| now - then).collect();
        let surfaces = contacts.contacts.iter().flat_map(Contact::surfaces);
        surfaces.flat_map(|surface| &surface.nodes).for_each(|&node| stays[node as usize] = true);
        let mut around = vec![BTreeSet::new(); places.len()];
        for solid in &self.assembly.model.solids {
            for cell in 0..solid.cells.len() {
                let nodes = solid.cells.nodes(cell);
                for &node in nodes.iter().filter(|&&node| !stays[node as usize]) {
                    around[node as usize].extend(nodes.iter().copied().filter(|&other| other != node));
                }
            }
        }
        for _ in 0..SWEEPS {
            for (node, around) in around.iter().enumerate().filter(|(_, around)| !around.is_empty()) {
                let sum: Vector3 = around.iter().map(|&other| ways[other as usize]).sum();
                ways[node] = sum / around.len() as f64;
            }
        }
        ways
    }

    /// Refuses displacements that invert a cell; `None` then.
    fn check_cells_apart(
        &mut self,
        [name, key]: [&str; 2],
        displacement: &[[f64; 3]],
        start: State<f64>,
    ) -> Option<()> {
        let model = Arc::clone(&self.assembly.model);
        let state = State { displacement: displacement.to_vec(), ..start };
        let recovery = Recovery::new(&model, &state);
        let inverted = |(index, solid)| {
            let ratios = recovery.numbers(index, 1, |_, fields, to| to[0] = fields.cell_volume_ratio);
            // Of bars it is not a number.
            Some((solid, ratios.iter().position(|&ratio| ratio <= 0.0)?))
        };
        let found = model.solids.iter().enumerate().find_map(inverted);
        let Some((solid, cell)) = found else { return Some(()) };
        let message = format!(
            "pushing bodies apart would invert element {} of `{}`",
            solid.original[cell], model.bodies[solid.body].name
        );
        let help = "move one of them (`at`): overlaps must be smaller than the elements there";
        self.error(&["contact", name, key], message, "too deep", help);
        None
    }

    /// Notes the number of pushed nodes, and the largest displacement.
    fn note_pushed(&mut self, before: &[Vector3], places: &[Vector3], least: f64, which: &str) {
        let ways = before.iter().zip(places).map(|(then, now)| (now - then).norm()).enumerate();
        let moved: Vec<(usize, f64)> = ways.filter(|(_, way)| *way > least).collect();
        let Some(&(node, way)) = moved.iter().max_by(|a, b| a.1.total_cmp(&b.1)) else { return };
        let (body, _) = self.assembly.locate_node(node as u32);
        let note = format!(
            "{} {which} {} pushed apart before the run, by up to {} m at {} of `{}`",
            counted(moved.len(), "node"),
            if moved.len() == 1 { "was" } else { "were" },
            number(way),
            in_metres(before[node]),
            self.assembly.bodies[body].name
        );
        self.notes.push(note);
    }
}

impl InContact<'_> {
    /// The displacements [m] that push bodies apart which overlap, of all nodes; `None` if nothing has to, or
    /// cannot be. Bodies with a barrier are pushed apart by its distance, so that the run starts without
    /// forces between them.
    pub(in crate::assemble) fn separate(
        &mut self,
        start: Option<&pliant_implicit::AssemblyState>,
    ) -> Option<Arc<Vec<[f64; 3]>>> {
        let without_gap = start.and_then(|start| self.without_gap(start));
        let (contacts, name) =
            (self.contacts.clone()?, without_gap.or_else(|| self.terms.overlapping.clone())?);
        if self.failed() {
            return None;
        }
        let distances = self.terms.barriers.distances();
        let owners = self.assembly.constrained_components().ok()?;
        let mut at_first = State::<f64>::at_rest(&self.assembly.model);
        if let Some(start) = start {
            let moved = start.position.iter().zip(&self.assembly.rest);
            at_first.displacement = moved.map(|(now, rest)| (now - Vector::from(*rest)).into()).collect();
        }
        let start = at_first;
        let at_rest = |(rest, u): (&[f64; 3], &[f64; 3])| Vector::from(*rest) + Vector::from(*u);
        let before: Vec<Vector3> = self.assembly.rest.iter().zip(&start.displacement).map(at_rest).collect();
        let kept = |index: usize| {
            let contact = &contacts.contacts[index];
            let Some(distance) = distances.get(index) else { return Some([0.0, OVERLAP * size_of(&before)]) };
            let kept = match contact.with {
                With::Rigid(_) => 0.0,
                _ => contact.touch.offset,
            };
            Some([kept + LEAST_GAP * distance, kept + distance])
        };
        let is_free = |owner: &[u32; 3]| Vector3::from_fn(|c, _| if owner[c] == FREE { 1.0 } else { 0.0 });
        let free = owners.iter().map(is_free).collect();
        let places = self.push_all_apart([&name, "separate"], &contacts, &before, free, kept)?;
        let stays: Vec<bool> = owners.iter().map(|owner| *owner != [FREE; 3]).collect();
        let ways = self.follow_inside(&contacts, stays, &before, &places);
        let moved = ways.iter().zip(&start.displacement).map(|(way, u)| (Vector::from(*u) + way).into());
        let mut displacement: Vec<[f64; 3]> = moved.collect();
        self.assembly.model.follow(&mut displacement);
        self.check_cells_apart([&name, "separate"], &displacement, start)?;
        self.note_pushed(&before, &places, OVERLAP * size_of(&before), "that overlapped");
        Some(Arc::new(displacement))
    }
}

/// The largest coordinate [m].
fn size_of(places: &[Vector3]) -> f64 {
    places.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()))
}

/// Pushes nodes and points of faces out of a rigid thing: the shortest way, unless this leads out of the
/// body. A solid then draws back into itself.
fn push_out(rigid: &Rigid, offset: f64, surface: &Surface, is_solid: bool, pushed: &mut Pushed) {
    let stance = rigid.stance(0.0, None);
    let thinnest = rigid.shape.thinnest();
    let push = |parts: Vec<(u32, f64)>, inward: Vector3, hangs: f64, pushed: &mut Pushed| {
        let place: Vector3 = parts.iter().map(|&(node, c)| pushed.places[node as usize] * c).sum();
        let gap = |place: &Vector3| rigid.near(&stance, place).distance - offset + hangs;
        let near = rigid.near(&stance, &place);
        let (mut normal, mut depth) = (near.normal, gap(&place));
        if depth < 0.0
            && normal.dot(&inward) < FACING
            && let Some(way) = way_out(&place, &inward, thinnest, gap)
        {
            (normal, depth) = (inward, -way);
        }
        pushed.push_by(&Row { parts, normal }, depth);
    };
    let mut inward = vec![Vector3::zeros(); if is_solid { pushed.places.len() } else { 0 }];
    let longest = surface.longest_edge(|node| pushed.places[node as usize]);
    for face in &surface.faces {
        let [a, b, c] = face.map(|node| pushed.places[node as usize]);
        let area = (b - a).cross(&(c - a));
        if is_solid {
            face.iter().for_each(|&node| inward[node as usize] -= area);
        }
    }
    let unit = |sum: Vector3| sum.try_normalize(0.0).unwrap_or_default();
    let at = |node: u32| inward.get(node as usize).copied().map_or(Vector3::zeros(), unit);
    for &node in &surface.nodes {
        push(vec![(node, 1.0)], at(node), 0.0, pushed);
    }
    let samples = lattice(parts_of(longest, &rigid.shape));
    let hangs = hang(rigid, longest);
    for face in &surface.faces {
        let inward = unit(face.iter().map(|&node| at(node)).sum());
        for weights in &samples {
            push(face.iter().copied().zip(*weights).collect(), inward, hangs, pushed);
        }
    }
}

/// Returns the distance [m] along a direction from a point to the outside of a thing whose thinnest part is
/// known [m]. Returns `None` without a direction, or if the thing is too thick there.
fn way_out(from: &Vector3, along: &Vector3, thinnest: f64, gap: impl Fn(&Vector3) -> f64) -> Option<f64> {
    let mut way = 0.0;
    while way <= 4.0 * thinnest && *along != Vector3::zeros() {
        let depth = -gap(&(from + along * way));
        if depth <= 0.0 {
            return Some(way);
        }
        way += depth.max(1e-3 * thinnest);
    }
    None
}

/// Pushes nodes and faces, and edges and edges, of two surfaces out of each other.
fn push_pairs(first: &Surface, second: &Surface, pushed: &mut Pushed) {
    let mut rows = Vec::new();
    {
        let place = |node: u32| pushed.places[node as usize];
        let mut pairs = Pairs::new(first, Some(second), 0.0, place);
        pairs.update(place);
        pairs.find(place, |pair| {
            if pair.distance < pushed.least {
                let parts = pair.nodes.into_iter().zip(pair.weights).collect();
                rows.push(Row { parts, normal: pair.normal });
            }
        });
    }
    rows.iter().for_each(|row| pushed.push(row));
}
