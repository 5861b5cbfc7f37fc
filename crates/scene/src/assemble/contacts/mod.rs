//! The phase [`InContact`]: obstacles and tools, and who touches whom.

mod barriers;
mod obstacles;
mod rigids;
mod separate;

use std::collections::HashSet;
use std::sync::Arc;

use pliant_explicit::State;
use pliant_format::suggestion;
use pliant_format::tables::{ContactTable, SolverName, ToolTable};
use pliant_geometry::words::{counted, number};
use pliant_geometry::{Locator, Selection, SurfaceLocator, Vector3};
use pliant_mechanics::load::NO_NODE;
use pliant_mechanics::model::{Body, Constraint};
use pliant_mechanics::tie::Tie;
use pliant_sim::contact::pairs::{Pairs, Surface};
use pliant_sim::contact::shape::Shape;
use pliant_sim::contact::touch::{Contact, Contacts, Rigid, Touch, With, lattice, parts_of};

use super::context::follows;
use super::loads::Loaded;
use super::ties::Subject;
use super::{BuiltBody, in_metres};
use barriers::BarrierTables;

/// Overlap, over the size of all, above which bodies are in each other.
pub(super) const OVERLAP: f64 = 1e-9;

/// The remedy for contact with other solvers.
const EXPLICIT: &str = "take `solver = \"explicit\"` on the CPU (solids, membranes, bars), or `\"implicit\"` or `\"static\"` (solids, shells)";

/// The distance [m] that surfaces keep without a barrier if none is given, over the mean edge of both. Sharp
/// parts slip by each other where it is zero.
const KEPT: f64 = 0.005;

/// The distance [m] that bodies keep if none is given, or parts of one.
pub(crate) fn usual_distance(
    first: &Surface,
    second: Option<&Surface>,
    place: impl Fn(u32) -> Vector3,
) -> f64 {
    KEPT * Pairs::new(first, second, 0.0, place).mean_edge()
}

/// Remark on the distances [m] that the surfaces of a contact keep if none is given.
pub(crate) fn told_distance(name: &str, [least, most]: [f64; 2]) -> String {
    let range = match least == most {
        true => number(most),
        false => format!("{} to {}", number(least), number(most)),
    };
    format!(
        "contact `{name}`: surfaces keep {range} m apart, {} % of their mean edge, because `thickness` is not given",
        100.0 * KEPT
    )
}

/// The places where two bodies overlap by more than round-off of a size [m]: how deep [m], and the places.
/// `place` has nodes by their numbers in the surfaces.
pub(crate) fn overlaps(
    sides: [(&BuiltBody, &Surface); 2],
    size: f64,
    place: impl Fn(u32) -> Vector3 + Copy,
) -> Vec<(f64, Vector3)> {
    // How deep nodes lie in the other body: from cells for large overlaps, from faces for small ones.
    let mut inside = Vec::new();
    let [first, second] = sides;
    for ((_, surface), (body, _)) in [(first, second), (second, first)] {
        // A sheet has no inside.
        if body.mesh.volume_blocks().all(|block| block.is_empty()) {
            continue;
        }
        let (cells, face_numbers) =
            (Locator::new(&body.mesh), (0..body.boundary.faces.len() as u32).collect::<Vec<_>>());
        let faces = SurfaceLocator::new(&body.boundary, &face_numbers, &body.mesh.points);
        for at in surface.nodes.iter().map(|&node| place(node)) {
            if cells.locate(at).is_some_and(|found| found.distance == 0.0)
                && let Some(on) = faces.closest(&at)
            {
                inside.push(((on.position - at).norm(), at));
            }
        }
    }
    let mut pairs = Pairs::new(first.1, Some(second.1), 0.0, place);
    pairs.update(place);
    pairs.find(place, |pair| inside.push((-pair.distance, place(pair.nodes[0]))));
    inside.retain(|(depth, _)| *depth > OVERLAP * size);
    inside
}

/// The overlap of two bodies in words, with the deepest of these places; `None` without any.
pub(crate) fn told_overlap([first, second]: [&str; 2], inside: &[(f64, Vector3)]) -> Option<String> {
    let (depth, at) = inside.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(format!(
        "`{first}` and `{second}` overlap at the start in {}, up to {} m deep at {}",
        counted(inside.len(), "place"),
        number(*depth),
        in_metres(*at)
    ))
}

/// The surface of a body that one of another participant touches.
#[derive(Clone, Debug)]
pub(crate) struct Meet {
    /// The name of the contact.
    pub contact: String,
    /// Its place among the two that touch.
    pub side: usize,
    /// The body.
    pub body: usize,
    /// Its surface.
    pub surface: Surface,
    /// Half of its thickness, if it is a shell [m].
    pub offset: f64,
}

/// Who touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Partner {
    /// A body of the model.
    Body(usize),
    /// An obstacle or tool.
    Rigid(usize),
}

impl Partner {
    /// The body, if it is one.
    pub(super) fn body(self) -> Option<usize> {
        match self {
            Self::Body(body) => Some(body),
            Self::Rigid(_) => None,
        }
    }
}

/// The fourth phase: bodies that touch.
pub(super) struct InContact<'s> {
    pub loaded: Loaded<'s>,
    /// The contacts with obstacles, tools and each other; `None` without any.
    pub contacts: Option<Arc<Contacts>>,
    terms: Terms,
}

follows!(InContact, loaded: Loaded);

/// The terms of the tables of contacts, without the contacts themselves.
#[derive(Default)]
struct Terms {
    /// The action of barriers.
    barriers: BarrierTables,
    /// The gap [m] that each contact gets between shapes at rest.
    gaps: Vec<Option<f64>>,
    /// A contact without a barrier whose bodies overlap at the start, and are to be pushed apart.
    overlapping: Option<String>,
}

impl<'s> Loaded<'s> {
    /// Finds the contacts of the scene.
    pub(crate) fn in_contact(mut self) -> InContact<'s> {
        let mut terms = Terms::default();
        let contacts = self.contacts(&mut terms);
        let contacts = (!contacts.contacts.is_empty()).then(|| Arc::new(contacts));
        InContact { loaded: self, contacts, terms }
    }
}

impl Loaded<'_> {
    /// The contacts of the scene.
    fn contacts(&mut self, terms: &mut Terms) -> Contacts {
        let scene = self.scene;
        let mut found = Contacts::default();
        // Things that nothing touches are checked, too.
        for (kind, tables) in [("obstacle", &scene.obstacles), ("tool", &scene.tools)] {
            for (name, table) in tables {
                if kind == "tool" && scene.obstacles.iter().any(|(known, _)| known == name) {
                    let message = format!("`{name}` is an obstacle already");
                    self.error(&[kind, name], message, "again", "give one of them another name");
                }
                found.rigids.extend(self.rigids(kind, name, table).into_iter().flatten());
            }
        }
        for (name, table) in &scene.contacts {
            let contacts = self.contact(name, table, &found.rigids, terms).unwrap_or_default();
            if !scene.run.solver.solves_equations() {
                self.keep_apart(name, table, &contacts, &mut found);
            }
            found.contacts.extend(contacts);
            if scene.run.solver.solves_equations() {
                self.check_goes_with_barriers(name, &found);
            }
        }
        found
    }

    /// Notes contacts of a table whose bodies keep a smaller distance where they are nearer at the start.
    /// Also notes the distances that bodies keep if none is given. The new contacts get the next numbers
    /// after the present ones.
    fn keep_apart(&mut self, name: &str, table: &ContactTable, contacts: &[Contact], found: &mut Contacts) {
        let first = found.contacts.len();
        let mut usual: Option<[f64; 2]> = None;
        for (contact, index) in contacts.iter().zip(first..) {
            let is_usual = table.thickness.is_none();
            let keeps_less = match contact.with {
                With::Rigid(_) => continue,
                With::Body(_) => true,
                With::Itself => is_usual,
            };
            let offset = contact.touch.offset;
            if keeps_less && offset > 0.0 {
                found.near.insert(index, Vec::new());
            }
            if is_usual {
                let [least, most] = usual.unwrap_or([offset; 2]);
                usual = Some([least.min(offset), most.max(offset)]);
            }
        }
        self.notes.extend(usual.map(|range| told_distance(name, range)));
    }

    /// The contacts of a table: one, or with `"all"` one for each pair.
    fn contact(
        &mut self,
        name: &str,
        table: &ContactTable,
        rigids: &[Rigid],
        terms: &mut Terms,
    ) -> Option<Vec<Contact>> {
        let is_barrier = self.scene.run.solver.solves_equations();
        if !self.check_contact(name, table, is_barrier) {
            return None;
        }
        let pairs = self.pairs(name, table, rigids)?;
        terms.barriers.check |= table.check_intersections;
        let with_bodies = pairs.iter().any(|(_, with)| with.body().is_some());
        if table.check_intersections && !is_barrier && !with_bodies {
            let message = "`check-intersections` is for bodies that touch each other or themselves with the solver `explicit`";
            let path = ["contact", name, "check-intersections"];
            self.error(&path, message, "no bodies that touch each other", "leave it out");
            return None;
        }
        let several = pairs.len() > 1;
        let mut contacts = Vec::new();
        for (body, partner) in pairs {
            let body_name = &self.bodies[body].name;
            let full = match partner {
                _ if !several => name.into(),
                Partner::Rigid(rigid) => format!("{name}.{body_name}-{}", rigids[rigid].name),
                Partner::Body(other) => format!("{name}.{body_name}-{}", self.bodies[other].name),
            };
            let surface = self.surface_of(name, table, body, 0)?;
            let with = match partner {
                Partner::Rigid(rigid) => With::Rigid(rigid),
                Partner::Body(other) if other == body => With::Itself,
                Partner::Body(other) => With::Body(self.surface_of(name, table, other, 1)?),
            };
            let offset = match is_barrier {
                true => self.barrier(name, table, [Partner::Body(body), partner], &mut terms.barriers)?,
                false => self.distance_to_keep(table, &surface, &with),
            };
            match (&with, partner) {
                _ if is_barrier => {}
                (With::Rigid(rigid), _) => {
                    self.check_apart((name, table), body, &rigids[*rigid], &surface, terms);
                }
                (With::Body(second), Partner::Body(other)) => {
                    self.check_bodies_apart((name, table), [body, other], [&surface, second], terms);
                }
                _ => self.note_apart(&full, &surface, table.thickness),
            }
            let touch = Touch { friction: table.friction, offset };
            contacts.push(Contact { name: full, surface, with, touch });
            terms.gaps.push(table.gap);
        }
        Some(contacts)
    }

    /// True if the solver knows contact, and the keys of a table go with the solver and with each other.
    /// Reports mistakes.
    fn check_contact(&mut self, name: &str, table: &ContactTable, is_barrier: bool) -> bool {
        let solver = self.scene.run.solver;
        if solver != SolverName::Explicit && !is_barrier {
            let message = format!(
                "contact is for the solvers `explicit`, `implicit` and `static`, but the solver of this scene is `{}`",
                solver.word()
            );
            self.error(&["contact", name, "between"], message, "not for this solver", EXPLICIT);
            return false;
        }
        if !self.check_keys_of_contact(name, table, is_barrier) {
            return false;
        }
        if table.separate && table.gap.is_some() {
            let message =
                "`gap` and `separate` push the same bodies apart: `gap` at rest, `separate` at the start";
            self.error(&["contact", name, "gap"], message, "one too many", "leave one of them out");
            return false;
        }
        true
    }

    /// Returns the bodies of a contact, each with its partner; every pair once.
    fn pairs(&mut self, name: &str, table: &ContactTable, rigids: &[Rigid]) -> Option<Vec<(usize, Partner)>> {
        let [first, second] = [0, 1].map(|side| self.partners(name, table, side, rigids));
        let (first, second) = (first?, second?);
        let mut pairs = Vec::new();
        for &a in &first {
            for &b in &second {
                let pair = match (a, b) {
                    (Partner::Rigid(_), Partner::Rigid(_)) => continue,
                    (Partner::Rigid(_), Partner::Body(body)) => (body, a),
                    (Partner::Body(one), Partner::Body(other)) if other < one && first.len() > 1 => {
                        (other, a)
                    }
                    (Partner::Body(body), _) => (body, b),
                };
                if !pairs.contains(&pair) {
                    pairs.push(pair);
                }
            }
        }
        if pairs.is_empty() {
            let help = "name a body first: `between = [\"liver\", \"probe\"]`";
            self.error(&["contact", name, "between"], "this contact has no body", "no body", help);
            return None;
        }
        Some(pairs)
    }

    /// The distance [m] that surfaces keep without a barrier.
    fn distance_to_keep(&self, table: &ContactTable, surface: &Surface, with: &With) -> f64 {
        let rest = |node: u32| Vector3::from(self.assembly.rest[node as usize]);
        table.thickness.unwrap_or_else(|| match with {
            With::Rigid(_) => 0.0,
            With::Body(other) => usual_distance(surface, Some(other), rest),
            With::Itself => usual_distance(surface, None, rest),
        })
    }

    /// The bodies and things of a side of a contact.
    fn partners(
        &mut self,
        name: &str,
        table: &ContactTable,
        side: usize,
        rigids: &[Rigid],
    ) -> Option<Vec<Partner>> {
        let wanted = &table.between[side];
        let bodies = self.bodies.iter().zip(0..);
        if wanted == "all" {
            let is_solid = |body: &BuiltBody| body.mesh.volume_blocks().any(|block| !block.is_empty());
            // Under barriers thin walls touch, too; one on the boundary of a solid touches with that.
            let is_barrier = self.scene.run.solver.solves_equations();
            let on_solid = |name: &str| {
                self.scene.bodies.iter().any(|(known, table)| known == name && table.on.is_some())
            };
            let is_wall = |index: usize| is_barrier && self.shell_cells(index).is_some();
            let touching =
                bodies.filter(|&(body, index)| is_solid(body) || is_wall(index) && !on_solid(&body.name));
            let touching: Vec<Partner> = touching.map(|(_, index)| Partner::Body(index)).collect();
            return Some(touching.into_iter().chain((0..rigids.len()).map(Partner::Rigid)).collect());
        }
        let is_wanted = |rigid: &Rigid| rigid.name == *wanted || rigid.tool() == wanted;
        let found: Vec<Partner> =
            (0..rigids.len()).filter(|&at| is_wanted(&rigids[at])).map(Partner::Rigid).collect();
        if !found.is_empty() {
            return Some(found);
        }
        let named = |(known, _): &(String, ToolTable)| known == wanted;
        if self.scene.obstacles.iter().chain(&self.scene.tools).any(named) {
            // Its own mistake is reported.
            return None;
        }
        if let Some(body) = self.bodies.iter().position(|body| body.name == *wanted) {
            return Some(vec![Partner::Body(body)]);
        }
        let known = self.bodies.iter().map(|body| body.name.as_str());
        let known: Vec<&str> =
            known.chain(rigids.iter().map(|rigid| rigid.name.as_str())).chain(["all"]).collect();
        let help = suggestion(wanted, &known, "the scene", "bodies, obstacles and tools");
        let place = ["0", "1"][side];
        let message = format!("there is no body, obstacle or tool `{wanted}`");
        self.error(&["contact", name, "between", place], message, "no such name", help);
        None
    }

    /// The faces and nodes of a body that touch.
    fn surface_of(&mut self, name: &str, table: &ContactTable, body: usize, side: usize) -> Option<Surface> {
        let path = ["contact", name, "between"];
        let body_name = self.bodies[body].name.clone();
        let is_barrier = self.scene.run.solver.solves_equations();
        if self.shell_cells(body).is_some() && !is_barrier {
            let message =
                format!("explicit contact is for solids, membranes and bars, and `{body_name}` is a shell");
            self.error(&path, message, "a shell", EXPLICIT);
            return None;
        }
        let (selection, key) = match side {
            0 => (&table.faces, "faces"),
            _ => (&table.other_faces, "other-faces"),
        };
        let faces = match selection {
            Some(selection) => self.faces(Subject::Body(body), selection, &["contact", name, key])?,
            None => self.faces(Subject::Body(body), &Selection::All, &path)?,
        };
        let halves = faces.iter().flat_map(|&[a, b, c, d]| {
            let second = (d != NO_NODE).then_some([a, c, d]);
            std::iter::once([a, b, c]).chain(second)
        });
        let halves: Vec<[u32; 3]> = halves.collect();
        let mut nodes: Vec<u32> = faces.into_iter().flatten().filter(|&node| node != NO_NODE).collect();
        if nodes.is_empty() {
            nodes = self.assembly.bodies[body].all_nodes().collect();
        }
        nodes.sort_unstable();
        nodes.dedup();
        // Barriers act on tied nodes, which move with others by weights.
        let follows = self.assembly.followers();
        let tied = self.assembly.ties.iter().flat_map(Tie::rows);
        // Barriers act on nodes around a constrained volume, too.
        let binds = |constraint: &&Constraint| {
            let motion = &constraint.motion;
            motion.is_collective() && !(is_barrier && motion.encloses())
        };
        let bound = self.assembly.constraints.iter().filter(binds);
        let mut bound: Vec<u32> = bound.flat_map(|constraint| constraint.nodes.iter().copied()).collect();
        bound.sort_unstable();
        let is_bound = |node: u32| bound.binary_search(&node).is_ok();
        let with_bound =
            tied.filter_map(|(node, mut row)| row.any(|(followed, _)| is_bound(followed)).then_some(node));
        let with_bound: HashSet<u32> = with_bound.collect();
        let moved = |&&node: &&u32| {
            is_bound(node) || with_bound.contains(&node) || (follows[node as usize] && !is_barrier)
        };
        if let Some(&node) = nodes.iter().find(moved) {
            let message = format!(
                "node {} of `{body_name}` is bound to other nodes by {}",
                self.assembly.locate_node(node).1,
                if is_barrier { "a rigid part or a mean" } else { "a tie, a rigid part, a mean or a volume" }
            );
            let help = format!("choose `{key}` without such nodes");
            self.error(&path, message, "bound to others", help);
            return None;
        }
        Some(Surface { nodes, faces: halves })
    }

    /// Remarks on parts of a body that are too near each other at rest to touch, and on gaps that are small
    /// for its faces.
    fn note_apart(&mut self, name: &str, surface: &Surface, thickness: Option<f64>) {
        let place = |node: u32| Vector3::from(self.assembly.rest[node as usize]);
        let mut pairs = Pairs::new(surface, None, thickness.unwrap_or(0.0), place);
        let count = pairs.set_apart_count();
        let mut narrow: Option<(f64, Vector3)> = None;
        pairs.update(place);
        pairs.find(place, |pair| {
            if pair.distance > 0.0 && narrow.is_none_or(|(least, _)| pair.distance < least) {
                narrow = Some((pair.distance, place(pair.nodes[0])));
            }
        });
        if count > 0 {
            self.notes.push(format!(
                "contact `{name}`: {} (a node and a face, or two edges) never touch, because they are too near or behind each other \
                 at rest",
                counted(count, "pair")
            ));
        }
        if let Some((gap, at)) = narrow {
            self.notes.push(format!(
                "contact `{name}`: the gap of {} m at {} is less than a quarter of the mean edge; smaller elements resolve it better",
                number(gap),
                in_metres(at)
            ));
        }
    }

    /// Refuses bodies that overlap at the start, or have no inside.
    fn check_bodies_apart(
        &mut self,
        (name, table): (&str, &ContactTable),
        bodies: [usize; 2],
        surfaces: [&Surface; 2],
        terms: &mut Terms,
    ) {
        let path = ["contact", name, "between"];
        let names = bodies.map(|body| self.bodies[body].name.clone());
        for body in bodies {
            if self.bodies[body].mesh.volume_blocks().all(|block| block.is_empty()) {
                let message = format!(
                    "only solids can touch each other, and `{}` is not a solid",
                    self.bodies[body].name
                );
                let help = "name the solid under it, or let it touch obstacles and tools only";
                self.error(&path, message, "no solid", help);
                return;
            }
        }
        let size = self.assembly.rest.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
        let place = |node: u32| Vector3::from(self.assembly.rest[node as usize]);
        let sides = [0, 1].map(|side| (&self.bodies[bodies[side]], surfaces[side]));
        let inside = overlaps(sides, size, place);
        if !inside.is_empty() && self.moves_apart(name, table, terms) {
            return;
        }
        let Some(message) = told_overlap([&names[0], &names[1]], &inside) else { return };
        let help = "move one of them (`at` of its mesh), or push them apart with `gap` or `separate = true`";
        self.error(&path, message, "overlapping", help);
    }

    /// True if bodies that overlap are moved apart before the run.
    fn moves_apart(&self, name: &str, table: &ContactTable, terms: &mut Terms) -> bool {
        if table.separate {
            terms.overlapping.get_or_insert_with(|| name.into());
        }
        table.separate || table.gap.is_some() && !self.is_parted
    }

    /// Refuses bodies that are in an obstacle or a tool at the start: a step would throw them out.
    fn check_apart(
        &mut self,
        (name, table): (&str, &ContactTable),
        body: usize,
        rigid: &Rigid,
        surface: &Surface,
        terms: &mut Terms,
    ) {
        let stance = rigid.stance(0.0, None);
        let rest = |node: u32| Vector3::from(self.assembly.rest[node as usize]);
        let size = self.assembly.rest.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
        let inside = |places: &mut dyn Iterator<Item = Vector3>| -> Vec<(f64, Vector3)> {
            let kept = table.thickness.unwrap_or(0.0);
            let gaps = places.map(|place| (rigid.near(&stance, &place).distance - kept, place));
            gaps.filter(|(gap, _)| *gap < -OVERLAP * size).collect()
        };
        let mut of = "node";
        let mut found = inside(&mut surface.nodes.iter().map(|&node| rest(node)));
        if found.is_empty() {
            // A thin thing can go through a face between its corners.
            of = "point";
            let longest = surface.longest_edge(rest);
            let samples = lattice(parts_of(longest, &rigid.shape));
            found = inside(&mut surface.faces.iter().flat_map(|face| {
                let corners = face.map(rest);
                samples.iter().map(move |weights| (0..3).map(|k| corners[k] * weights[k]).sum())
            }));
            let hangs = hang(rigid, longest);
            found.retain(|(gap, _)| hangs == 0.0 || -gap > hangs);
        }
        if !found.is_empty() && self.moves_apart(name, table, terms) {
            return;
        }
        let Some((gap, place)) = found.iter().min_by(|a, b| a.0.total_cmp(&b.0)) else { return };
        let message = format!(
            "{} of `{}` {} in `{}` at the start, up to {} m deep at {}",
            counted(found.len(), of),
            self.bodies[body].name,
            if found.len() == 1 { "lies" } else { "lie" },
            rigid.name,
            number(-gap),
            in_metres(*place)
        );
        let help = "move one of them (`at`), make `thickness` smaller, or push them apart with `gap` or `separate = true`; \
                    `inside = true` is for bodies within an obstacle";
        self.error(&["contact", name, "between"], message, "overlapping", help);
    }
}

impl InContact<'_> {
    /// Returns the surfaces of bodies that touch surfaces of other participants.
    pub fn meets(&mut self) -> Vec<Meet> {
        let scene = self.scene;
        let meet = |assembling: &mut Self, (name, table): &(String, ContactTable)| {
            let side =
                table.between.iter().position(|body| scene.bodies.iter().any(|(known, _)| known == body))?;
            let parts = [("separate", table.separate), ("gap", table.gap.is_some())];
            if let Some((key, _)) = parts.into_iter().find(|(_, given)| *given) {
                let message = format!("`{key}` is for bodies of one participant");
                assembling.error(
                    &["contact", name, key],
                    message,
                    "between participants",
                    "leave it out, and move one of the bodies (`at`)",
                );
                return None;
            }
            if !assembling.check_keys_of_contact(name, table, false) {
                return None;
            }
            let body = assembling.bodies.iter().position(|built| built.name == table.between[side])?;
            let surface = assembling.surface_of(name, table, body, side)?;
            Some(Meet { contact: name.clone(), side, body, surface, offset: 0.5 * assembling.thickest(body) })
        };
        scene.meets.iter().filter_map(|table| meet(self, table)).collect()
    }

    /// The bodies that touch something; `None` where a mistake leaves that open.
    pub fn touching(&self, meets: &[Meet]) -> Option<Vec<bool>> {
        if self.failed() {
            return None;
        }
        let is_host = self.scene.run.solver == SolverName::Explicit;
        let bodies = self.assembly.bodies.iter().enumerate();
        let touching = bodies.map(|(index, body)| {
            self.contacts.as_ref().is_some_and(|contacts| touches(contacts, body))
                || is_host && meets.iter().any(|meet| meet.body == index)
        });
        Some(touching.collect())
    }

    /// Finds the nodes of bodies that are nearer at the start than the distance to keep; `pushed` are
    /// displacements [m] there, if bodies were pushed apart.
    pub(crate) fn find_near(&mut self, pushed: Option<&[[f64; 3]]>) {
        let Some(contacts) = &mut self.contacts else { return };
        if contacts.near.is_empty() {
            return;
        }
        let (contacts, assembly) = (Arc::make_mut(contacts), &self.loaded.assembly);
        let start = State::<f64>::at_rest(&assembly.model).displacement;
        let moved = pushed.unwrap_or(&start);
        let rest = |node: u32| Vector3::from(assembly.rest[node as usize]);
        let place = |node: u32| rest(node) + Vector3::from(moved[node as usize]);
        let mut notes = Vec::new();
        let mut near = std::mem::take(&mut contacts.near);
        for (&index, near) in &mut near {
            let contact = &contacts.contacts[index];
            let pairs = contact.pairs(|node| node, rest).map(|(pairs, _)| pairs.keeping([], rest));
            *near = pairs.map_or_else(Vec::new, |mut pairs| pairs.nearer(place));
            if !near.is_empty() {
                notes.push(format!(
                    "contact `{}`: {} nearer at the start than {} m and {} the distance of the start",
                    contact.name,
                    match near.len() {
                        1 => "1 node is".to_owned(),
                        count => format!("{} are", counted(count, "node")),
                    },
                    number(contact.touch.offset),
                    if near.len() == 1 { "keeps" } else { "keep" }
                ));
            }
        }
        contacts.near = near;
        self.loaded.notes.extend(notes);
    }
}

/// Depth [m] by which faces with edges of a length [m] hang into a round thing on which their corners lie.
/// The depth is up to edge²/(8 R). More than a tenth of the radius counts as an overlap.
pub(super) fn hang(rigid: &Rigid, edge: f64) -> f64 {
    let radius = rigid.shape.thinnest();
    match rigid.shape {
        Shape::Sphere { .. } | Shape::Capsule { .. } | Shape::Cylinder { .. } | Shape::Grid(_) => {
            (edge * edge / (8.0 * radius)).min(0.1 * radius)
        }
        _ => 0.0,
    }
}

/// True if a body touches something.
pub(crate) fn touches(contacts: &Contacts, body: &Body) -> bool {
    let mut surfaces = contacts.contacts.iter().flat_map(Contact::surfaces);
    surfaces.any(|surface| body.all_nodes().any(|node| surface.nodes.binary_search(&node).is_ok()))
}
