//! Obstacles and tools, and who touches whom.

use std::collections::HashSet;
use std::io;
use std::path::Path;
use std::sync::Arc;

use pliant_explicit::State;
use pliant_geometry::words::{counted, number};
use pliant_geometry::{Locator, Selection, SurfaceLocator, Vector3};
use pliant_mechanics::curve::{Curve, Shape as CurveShape};
use pliant_mechanics::load::NO_NODE;
use pliant_mechanics::model::{Body, Constraint};
use pliant_mechanics::tie::Tie;
use pliant_sim::contact::pairs::{Pairs, Surface};
use pliant_sim::contact::pose::{Pose, Trajectory};
use pliant_sim::contact::profile::{Corner, Profile};
use pliant_sim::contact::shape::Shape;
use pliant_sim::contact::touch::{Contact, Contacts, Jaw, Rigid, Touch, With, lattice, parts_of};

use super::barriers::BarrierTables;
use super::{Builder, BuiltBody, Subject, in_metres};
use pliant_format::suggestion;
use pliant_format::tables::{ContactTable, GrowthTable, ShapeName, SolverName, ToolTable};
use pliant_format::{rows_of, table as table_file};

/// What a row of a table of poses holds.
const ROW: &str =
    "each row is `t,x,y,z,qw,qx,qy,qz`: a time in seconds, a position in metres, a unit quaternion";
/// The fastest that a tool goes by a table of poses [m/s]: faster than hands, and slow enough for nodes to be pushed along.
const FASTEST: f64 = 10.0;
/// How far the length of a quaternion may be off 1.
const UNIT: f64 = 1e-3;

/// Overlap, over the size of all, above which bodies are in each other.
pub(super) const OVERLAP: f64 = 1e-9;

/// What to do about contact with other solvers.
const EXPLICIT: &str = "take `solver = \"explicit\"` on the CPU, for solids, membranes and bars, or `\"implicit\"` or `\"static\"`, for solids and shells";

/// The distance [m] that surfaces keep without a barrier if none is given, over the mean edge of both. Sharp parts slip by each other where it is
/// zero.
const KEPT: f64 = 0.005;

/// The distance [m] that bodies keep if none is given, or parts of one.
pub(crate) fn usual_distance(
    first: &Surface,
    second: Option<&Surface>,
    place: impl Fn(u32) -> Vector3,
) -> f64 {
    KEPT * Pairs::new(first, second, 0.0, place).mean_edge()
}

/// What tells which distances [m] the surfaces of a contact keep since none is given.
pub(crate) fn told_distance(name: &str, [least, most]: [f64; 2]) -> String {
    let range = match least == most {
        true => number(most),
        false => format!("{} to {}", number(least), number(most)),
    };
    format!(
        "contact `{name}`: surfaces keep {range} m, {} % of their mean edge, since `thickness` is not given",
        100.0 * KEPT
    )
}

/// Where two bodies overlap by more than round-off of a size [m]: how deep [m], and the places. `place` has nodes by their numbers in the surfaces.
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
        let (cells, all) =
            (Locator::new(&body.mesh), (0..body.boundary.faces.len() as u32).collect::<Vec<_>>());
        let faces = SurfaceLocator::new(&body.boundary, &all, &body.mesh.points);
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

/// How two bodies overlap, in words, with the deepest of these places; `None` without any.
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

impl Builder<'_> {
    /// The contacts of the scene, and how their barriers act; `None` without any.
    pub(super) fn contacts(&mut self) -> Option<(Arc<Contacts>, BarrierTables)> {
        let scene = self.scene;
        let mut all = Contacts::default();
        // Things that nothing touches are checked, too.
        for (kind, tables) in [("obstacle", &scene.obstacles), ("tool", &scene.tools)] {
            for (name, table) in tables {
                if kind == "tool" && scene.obstacles.iter().any(|(known, _)| known == name) {
                    let message = format!("`{name}` is an obstacle already");
                    self.error(&[kind, name], message, "again", "give one of them another name");
                }
                all.rigids.extend(self.rigids(kind, name, table).into_iter().flatten());
            }
        }
        let mut barriers = BarrierTables::default();
        for (name, table) in &scene.contacts {
            let contacts = self.contact(name, table, &all.rigids, &mut barriers).unwrap_or_default();
            if !scene.run.solver.solves_equations() {
                self.keep_apart(name, table, &contacts, &mut all);
            }
            all.contacts.extend(contacts);
            if scene.run.solver.solves_equations() {
                self.check_goes_with_barriers(name, &all);
            }
        }
        (!all.contacts.is_empty()).then(|| (Arc::new(all), barriers))
    }

    /// Notes the contacts of a table whose bodies keep less where they are nearer at the start, and the distances that they keep if none is given. They come
    /// next after those that there are.
    fn keep_apart(&mut self, name: &str, table: &ContactTable, contacts: &[Contact], all: &mut Contacts) {
        let first = all.contacts.len();
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
                all.near.insert(index, Vec::new());
            }
            if is_usual {
                let [least, most] = usual.unwrap_or([offset; 2]);
                usual = Some([least.min(offset), most.max(offset)]);
            }
        }
        self.notes.extend(usual.map(|range| told_distance(name, range)));
    }

    /// Finds the nodes of bodies that are nearer at the start than the distance to keep; `pushed` are displacements [m] there, if bodies were pushed apart.
    pub(super) fn find_near(&mut self, contacts: &mut Contacts, pushed: Option<&[[f64; 3]]>) {
        if contacts.near.is_empty() {
            return;
        }
        let start = State::<f64>::at_rest(&self.assembly.model).displacement;
        let moved = pushed.unwrap_or(&start);
        let rest = |node: u32| Vector3::from(self.assembly.rest[node as usize]);
        let place = |node: u32| rest(node) + Vector3::from(moved[node as usize]);
        let mut near = std::mem::take(&mut contacts.near);
        for (&index, near) in &mut near {
            let contact = &contacts.contacts[index];
            let pairs = contact.pairs(|node| node, rest).map(|(pairs, _)| pairs.keeping([], rest));
            *near = pairs.map_or_else(Vec::new, |mut pairs| pairs.nearer(place));
            if !near.is_empty() {
                self.notes.push(format!(
                    "contact `{}`: {} nearer at the start than {} m and {} that distance",
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
    }

    /// Takes note of the bodies that touch something, unless a mistake leaves that open.
    pub(super) fn note_touching(&mut self, contacts: Option<&Contacts>, meets: &[Meet]) {
        if self.failed() {
            return;
        }
        let is_host = self.scene.run.solver == SolverName::Explicit;
        let bodies = self.assembly.bodies.iter().enumerate();
        let touching = bodies.map(|(index, body)| {
            contacts.is_some_and(|all| touches(all, body))
                || is_host && meets.iter().any(|meet| meet.body == index)
        });
        self.touching = Some(touching.collect());
    }

    /// The surfaces of bodies that those of other participants touch.
    pub(super) fn meets(&mut self) -> Vec<Meet> {
        let scene = self.scene;
        let meet = |own: &mut Self, (name, table): &(String, ContactTable)| {
            let side =
                table.between.iter().position(|body| scene.bodies.iter().any(|(known, _)| known == body))?;
            let parts = [("separate", table.separate), ("gap", table.gap.is_some())];
            if let Some((key, _)) = parts.into_iter().find(|(_, given)| *given) {
                let message = format!("`{key}` is for bodies of one participant");
                own.error(&["contact", name, key], message, "of two participants", "move one of them");
                return None;
            }
            if !own.check_keys_of_contact(name, table, false) {
                return None;
            }
            let body = own.bodies.iter().position(|own| own.name == table.between[side])?;
            let surface = own.surface_of(name, table, body, side)?;
            Some(Meet { contact: name.clone(), side, body, surface, offset: 0.5 * own.thickest(body) })
        };
        scene.meets.iter().filter_map(|table| meet(self, table)).collect()
    }

    /// The rigid thing of a table, or its two jaws.
    fn rigids(&mut self, kind: &str, name: &str, table: &ToolTable) -> Option<Vec<Rigid>> {
        let path = [kind, name];
        let at = |key| [kind, name, key];
        let jaws = matches!(table.shape, ShapeName::Jaws(_));
        for (key, given) in [("opening", table.opening.is_some()), ("ideal-grip", table.ideal_grip.is_some())]
        {
            if given && !jaws {
                let help =
                    "`shape = { jaws = { length = 0.03, width = 0.008, thickness = 0.004 } }` has jaws";
                self.error(&at(key), format!("`{key}` is for a tool with jaws"), "no jaws", help);
                return None;
            }
        }
        let shape = match &table.shape {
            ShapeName::Sphere(of) => Shape::Sphere { radius: of.radius },
            ShapeName::Capsule(of) => Shape::Capsule { radius: of.radius, length: of.length },
            ShapeName::Cylinder(of) => Shape::Cylinder { radius: of.radius, length: of.length },
            ShapeName::Box(of) if of.size.iter().any(|&edge| edge <= 0.0) => {
                self.error(&at("shape"), "a box without a volume", "its edges", "give three lengths above 0");
                return None;
            }
            ShapeName::Box(of) => Shape::Cuboid { size: of.size },
            ShapeName::Cone(of) => Shape::Cone { radius: of.radius, height: of.height },
            ShapeName::HalfSpace => Shape::HalfSpace,
            ShapeName::Revolved(of) => {
                let corners = of.outline.iter().map(|&[z, r, rounding]| Corner { at: [z, r], rounding });
                match Profile::new(corners.collect()) {
                    Ok(profile) => Shape::Revolved(Arc::new(profile)),
                    Err(error) => {
                        let help = "points are `[height, distance from the axis, radius of the arc]`, counted from 0";
                        self.error(&at("shape"), error.to_string(), "this outline", help);
                        return None;
                    }
                }
            }
            ShapeName::Jaws(of) => Shape::Cuboid { size: [of.width, of.thickness, of.length] },
            ShapeName::Mesh(of) => self.shape_of_mesh(of, &[kind, name, "shape", "mesh"])?,
            ShapeName::Image(of) => self.shape_of_image(of, &[kind, name, "shape", "image"])?,
        };
        self.note_turns(&format!("{kind} `{name}`: `turn`"), Vector3::from(table.turn).norm());
        let start = Pose::new(table.at.into(), table.turn.into());
        let ways = [table.by.is_some(), table.rotate.is_some(), table.poses.is_some()];
        if ways.iter().filter(|&&given| given).count() > 1 {
            let help = "leave all but one out";
            self.error(&path, "it moves by one of `by`, `rotate` and `poses`", "several", help);
            return None;
        }
        let trajectory = if let Some(shift) = table.by {
            Trajectory::by(start, shift, self.curve(&table.timing, &path)?)
        } else if let Some(rotate) = table.rotate {
            let axis = Vector3::from(rotate.axis);
            let Some(axis) = axis.try_normalize(0.0) else {
                self.error(
                    &at("rotate"),
                    "the axis of the rotation is zero",
                    "this axis",
                    "give a direction",
                );
                return None;
            };
            let angle = self.angle(&at("rotate"), rotate.angle, rotate.degrees)?;
            let curve = self.curve(&table.timing, &path)?;
            Trajectory::turn(start, axis.into(), rotate.centre, angle, curve)
        } else if let Some(file) = &table.poses {
            let text = self.scene.file(file).and_then(|found| table_file(&found));
            let reach = shape.reach();
            let trajectory = poses(file, text).map(|poses| {
                let (poses, jump) = slowed(poses, reach);
                Trajectory::table(start, poses).map(|trajectory| (trajectory, jump))
            });
            match trajectory {
                Ok(Some((trajectory, jump))) => {
                    if let Some(Jump { time, speed, late }) = jump {
                        self.notes.push(format!(
                            "{kind} `{name}`: by its table of poses it goes at {} m/s from t = {} s on; it goes at {FASTEST} m/s and is late by up to \
                             {} s",
                            number(speed),
                            number(time),
                            number(late)
                        ));
                    }
                    trajectory
                }
                Ok(None) => {
                    let message = format!("`{}` has no poses, or its times do not increase", file.display());
                    self.error(&at("poses"), message, "this table", ROW);
                    return None;
                }
                Err(message) => {
                    self.error(&at("poses"), message, "this table", ROW);
                    return None;
                }
            }
        } else {
            Trajectory::fixed(start)
        };
        let trajectory = match table.force_limit {
            Some(limit) => trajectory.limited(limit),
            None => trajectory,
        };
        let trajectory = match &table.grows {
            Some(growth) => {
                self.growing(trajectory, growth, &shape, (jaws, table.inside), [kind, name, "grows"])?
            }
            None => trajectory,
        };
        let ShapeName::Jaws(of) = &table.shape else {
            return Some(vec![Rigid {
                name: name.into(),
                shape,
                trajectory,
                inside: table.inside,
                jaw: None,
            }]);
        };
        if table.inside {
            let help = "bodies are between the jaws, and outside of each";
            self.error(&at("inside"), "no body is inside of a jaw", "of a tool with jaws", help);
            return None;
        }
        let opening = match &table.opening {
            Some(opening) => {
                let angle = self.angle(&at("opening"), opening.angle, opening.degrees)?;
                (angle, self.curve(&opening.timing, &at("opening"))?)
            }
            None => (0.0, Curve { shape: CurveShape::Hold, from: 0.0, to: 1.0 }),
        };
        self.note_turns(&format!("{kind} `{name}`: `ideal-grip`"), table.ideal_grip.unwrap_or_default());
        // The upper one turns from z towards y, against the axis x.
        let sides = [("upper", 1.0), ("lower", -1.0)];
        let rigids = sides.map(|(side, sign)| Rigid {
            name: format!("{name}.{side}"),
            shape: shape.clone(),
            trajectory: trajectory.clone(),
            inside: false,
            jaw: Some(Jaw {
                tool: name.into(),
                part: -0.5 * sign,
                opening: opening.clone(),
                place: Pose::translation(0.0, 0.5 * sign * of.thickness, 0.5 * of.length),
                grip: table.ideal_grip,
            }),
        });
        Some(rigids.into())
    }

    /// A trajectory with the growth of a table; `path` is that of its table.
    fn growing(
        &mut self,
        trajectory: Trajectory,
        growth: &GrowthTable,
        shape: &Shape,
        (jaws, inside): (bool, bool),
        path: [&str; 3],
    ) -> Option<Trajectory> {
        if jaws {
            self.error(
                &path,
                "jaws do not grow",
                "of a tool with jaws",
                "leave it out, or take another shape",
            );
            return None;
        }
        let curve = self.curve(&growth.timing, &path)?;
        let [low, high] = curve.range().map(|part| part * growth.by);
        let (least, thinnest) = (low.min(high), shape.thinnest());
        let round = matches!(shape, Shape::Sphere { .. } | Shape::Capsule { .. });
        if least < 0.0 && (inside || !round) {
            let message = format!(
                "it shrinks to {} m within its shape, which only balls and capsules can",
                number(least)
            );
            let help = "give the shape its smallest size, and let it grow from there";
            self.error(&path, message, "below 0", help);
            return None;
        }
        if least <= -thinnest {
            let message =
                format!("it shrinks by {} m, and its radius is {} m", number(-least), number(thinnest));
            self.error(&path, message, "nothing is left", "let it shrink by less");
            return None;
        }
        Some(trajectory.growing(growth.by, curve))
    }

    /// The contacts of a table: one, or with `"all"` one for each pair.
    fn contact(
        &mut self,
        name: &str,
        table: &ContactTable,
        rigids: &[Rigid],
        barriers: &mut BarrierTables,
    ) -> Option<Vec<Contact>> {
        let run = &self.scene.run;
        let is_barrier = run.solver.solves_equations();
        if run.solver != SolverName::Explicit && !is_barrier {
            let message = format!(
                "contact is for the solvers `explicit`, `implicit` and `static`, and this scene goes with `{}`",
                run.solver.word()
            );
            self.error(&["contact", name, "between"], message, "not for this solver", EXPLICIT);
            return None;
        }
        if !self.check_keys_of_contact(name, table, is_barrier) {
            return None;
        }
        if table.separate && table.gap.is_some() {
            let message =
                "`gap` and `separate` part the same bodies: shapes at rest, or the state at the start";
            self.error(&["contact", name, "gap"], message, "one too many", "leave one of them out");
            return None;
        }
        let [first, second] = [0, 1].map(|side| self.partners(name, table, side, rigids));
        let (first, second) = (first?, second?);
        let mut pairs = Vec::new();
        for &a in &first {
            for &b in &second {
                let pair = match (a, b) {
                    (Partner::Rigid(_), Partner::Body(_)) => [b, a],
                    (Partner::Body(one), Partner::Body(other)) if other < one && first.len() > 1 => [b, a],
                    _ => [a, b],
                };
                if pair != [a, b] && pairs.contains(&pair) || matches!(pair, [Partner::Rigid(_), _]) {
                    continue;
                }
                if !pairs.contains(&pair) {
                    pairs.push(pair);
                }
            }
        }
        if pairs.is_empty() {
            let help = "name a body first: `between = [\"liver\", \"probe\"]`";
            self.error(&["contact", name, "between"], "no body touches anything here", "no body", help);
            return None;
        }
        barriers.check |= table.check_intersections;
        let of_bodies = |[_, with]: &[Partner; 2]| with.body().is_some();
        if table.check_intersections && !is_barrier && !pairs.iter().any(of_bodies) {
            let message = "`check-intersections` is for bodies that touch each other or themselves with the solver `explicit`";
            let path = ["contact", name, "check-intersections"];
            self.error(&path, message, "no bodies that touch each other", "leave it out");
            return None;
        }
        let several = pairs.len() > 1;
        let mut all = Vec::new();
        for [own, with] in pairs {
            let Partner::Body(body) = own else { continue };
            let other = match with {
                Partner::Rigid(rigid) => rigids[rigid].name.clone(),
                Partner::Body(other) => self.bodies[other].name.clone(),
            };
            let full =
                if several { format!("{name}.{}-{other}", self.bodies[body].name) } else { name.into() };
            let surface = self.surface_of(name, table, body, 0)?;
            let (touches, with) = (
                with,
                match with {
                    Partner::Rigid(rigid) => With::Rigid(rigid),
                    Partner::Body(other) if other == body => With::Itself,
                    Partner::Body(other) => With::Body(self.surface_of(name, table, other, 1)?),
                },
            );
            let offset = match is_barrier {
                true => self.barrier(name, table, [own, touches], barriers)?,
                false => self.distance_to_keep(table, &surface, &with),
            };
            let touch = Touch { friction: table.friction, offset };
            match (&with, touches) {
                _ if is_barrier => {}
                (With::Rigid(rigid), _) => self.check_apart(name, table, body, &rigids[*rigid], &surface),
                (With::Body(second), Partner::Body(other)) => {
                    self.check_bodies_apart(name, table, [body, other], [&surface, second]);
                }
                _ => self.note_apart(&full, &surface, table.thickness),
            }
            all.push(Contact { name: full, surface, with, touch });
            self.gaps.push(table.gap);
        }
        Some(all)
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
            let on_solid =
                |name: &str| self.scene.bodies.iter().any(|(own, table)| own == name && table.on.is_some());
            let is_wall = |index: usize| is_barrier && self.shell_cells(index).is_some();
            let touching =
                bodies.filter(|&(body, index)| is_solid(body) || is_wall(index) && !on_solid(&body.name));
            let touching: Vec<Partner> = touching.map(|(_, index)| Partner::Body(index)).collect();
            return Some(touching.into_iter().chain((0..rigids.len()).map(Partner::Rigid)).collect());
        }
        let own = |rigid: &Rigid| rigid.name == *wanted || rigid.tool() == wanted;
        let found: Vec<Partner> =
            (0..rigids.len()).filter(|&at| own(&rigids[at])).map(Partner::Rigid).collect();
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
        let help = format!("{help}; bodies that touch each other are of one participant");
        let place = ["0", "1"][side];
        let message = format!("there is no body, obstacle or tool `{wanted}`");
        self.error(&["contact", name, "between", place], message, "no such thing", help);
        None
    }

    /// The faces and nodes of a body that touch.
    fn surface_of(&mut self, name: &str, table: &ContactTable, body: usize, side: usize) -> Option<Surface> {
        let path = ["contact", name, "between"];
        let own = self.bodies[body].name.clone();
        let is_barrier = self.scene.run.solver.solves_equations();
        if self.shell_cells(body).is_some() && !is_barrier {
            let message = format!("contact is for solids, membranes and bars, and `{own}` is a shell");
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
        // Barriers act on what a pressure fills, too.
        let binds = |constraint: &&Constraint| {
            let motion = &constraint.motion;
            motion.is_collective() && !(is_barrier && motion.encloses())
        };
        let bound = self.assembly.constraints.iter().filter(binds);
        let mut bound: Vec<u32> = bound.flat_map(|constraint| constraint.nodes.iter().copied()).collect();
        bound.sort_unstable();
        let is_bound = |node: u32| bound.binary_search(&node).is_ok();
        let with_bound = tied.filter_map(|(node, mut row)| row.any(|(own, _)| is_bound(own)).then_some(node));
        let with_bound: HashSet<u32> = with_bound.collect();
        let moved = |&&node: &&u32| {
            is_bound(node) || with_bound.contains(&node) || (follows[node as usize] && !is_barrier)
        };
        if let Some(&node) = nodes.iter().find(moved) {
            let message = format!(
                "node {} of `{own}` follows others by {}",
                self.assembly.locate_node(node).1,
                if is_barrier { "a rigid part or a mean" } else { "a tie, a rigid part, a mean or a volume" }
            );
            let help = format!("choose `{key}` without such nodes");
            self.error(&path, message, "bound to others", help);
            return None;
        }
        Some(Surface { nodes, faces: halves })
    }

    /// Remarks on parts of a body that are too near each other at rest to touch, and on gaps that are small for its faces.
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
                "contact `{name}`: {} of nodes with faces or of edges never touch, since they are too near each other, or behind each other, at rest",
                counted(count, "pair")
            ));
        }
        if let Some((gap, at)) = narrow {
            self.notes.push(format!(
                "contact `{name}`: a gap of {} m at {} is less than a quarter of the edges there are on average; smaller \
                 elements resolve it better",
                number(gap),
                in_metres(at)
            ));
        }
    }

    /// Refuses bodies that overlap at the start, or have no inside.
    fn check_bodies_apart(
        &mut self,
        name: &str,
        table: &ContactTable,
        bodies: [usize; 2],
        surfaces: [&Surface; 2],
    ) {
        let path = ["contact", name, "between"];
        let names = bodies.map(|body| self.bodies[body].name.clone());
        for body in bodies {
            if self.bodies[body].mesh.volume_blocks().all(|block| block.is_empty()) {
                let message = format!(
                    "bodies that touch each other are solids, and `{}` is none",
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
        if !inside.is_empty() && self.moves_apart(name, table) {
            return;
        }
        let Some(message) = told_overlap([&names[0], &names[1]], &inside) else { return };
        let help = "move one of them (`at` of its mesh), or let `gap` or `separate = true` part them";
        self.error(&path, message, "overlapping", help);
    }

    /// Whether bodies that overlap are moved apart before the run.
    fn moves_apart(&mut self, name: &str, table: &ContactTable) -> bool {
        if table.separate {
            self.overlapping.get_or_insert_with(|| name.into());
        }
        table.separate || table.gap.is_some() && !self.is_parted
    }

    /// Refuses bodies that are in an obstacle or a tool at the start: a step would throw them out.
    fn check_apart(
        &mut self,
        name: &str,
        table: &ContactTable,
        body: usize,
        rigid: &Rigid,
        surface: &Surface,
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
        if !found.is_empty() && self.moves_apart(name, table) {
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
        let help = "move one of them (`at`), make `thickness` smaller, or let `gap` or `separate = true` part them; \
                    `inside = true` is for bodies within an obstacle";
        self.error(&["contact", name, "between"], message, "overlapping", help);
    }
}

/// How deep [m] faces with edges of a length [m] hang into a round thing on which their corners lie: by up to edge²/(8 R). More than a tenth of it is
/// no touch any more.
pub(super) fn hang(rigid: &Rigid, edge: f64) -> f64 {
    let radius = rigid.shape.thinnest();
    match rigid.shape {
        Shape::Sphere { .. } | Shape::Capsule { .. } | Shape::Cylinder { .. } | Shape::Grid(_) => {
            (edge * edge / (8.0 * radius)).min(0.1 * radius)
        }
        _ => 0.0,
    }
}

/// Whether a body touches something.
pub(crate) fn touches(contacts: &Contacts, body: &Body) -> bool {
    let mut surfaces = contacts.contacts.iter().flat_map(Contact::surfaces);
    surfaces.any(|surface| body.all_nodes().any(|node| surface.nodes.binary_search(&node).is_ok()))
}

/// A part of a table of poses that is too fast.
struct Jump {
    /// When the fastest one begins [s].
    time: f64,
    /// How fast it is [m/s].
    speed: f64,
    /// How late the tool comes to a row at most [s].
    late: f64,
}

/// A table of poses without motions that are faster than [`FASTEST`]: rows come later where the tool cannot be there before, and it catches up
/// after them. The tool has a radius [m].
fn slowed(poses: Vec<(f64, Pose)>, reach: f64) -> (Vec<(f64, Pose)>, Option<Jump>) {
    if poses.windows(2).any(|rows| rows[0].0 >= rows[1].0) {
        return (poses, None);
    }
    let mut jump: Option<Jump> = None;
    let mut slowed: Vec<(f64, Pose)> = Vec::with_capacity(poses.len());
    let mut before: Option<(f64, Pose)> = None;
    for &(time, pose) in &poses {
        let (Some((asked, from)), Some(&(then, _))) = (before.replace((time, pose)), slowed.last()) else {
            slowed.push((time, pose));
            continue;
        };
        let way = (pose.translation.vector - from.translation.vector).norm()
            + from.rotation.angle_to(&pose.rotation) * reach;
        let (speed, arrives) = (way / (time - asked), time.max(then + way / FASTEST));
        if speed > FASTEST {
            let known = jump.get_or_insert(Jump { time: asked, speed, late: 0.0 });
            if speed > known.speed {
                (known.time, known.speed) = (asked, speed);
            }
        }
        if let Some(jump) = &mut jump {
            jump.late = jump.late.max(arrives - time);
        }
        // A tool that rests while it is late has no row there.
        if arrives > then {
            slowed.push((arrives, pose));
        }
    }
    (slowed, jump)
}

/// The poses of a table. Empty lines, a header and what follows a # are passed over.
fn poses(file: &Path, text: io::Result<String>) -> Result<Vec<(f64, Pose)>, String> {
    let text = text.map_err(|error| format!("`{}` cannot be read: {error}", file.display()))?;
    let shown = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
    let mut all = Vec::new();
    for (row, line) in rows_of(&text) {
        let columns: Vec<&str> = row.split(',').map(str::trim).collect();
        if all.is_empty() && columns[0].eq_ignore_ascii_case("t") {
            continue;
        }
        let numbers: Option<Vec<f64>> =
            columns.iter().map(|text| text.parse().ok().filter(|x: &f64| x.is_finite())).collect();
        let Some(Ok([t, x, y, z, w, i, j, k])) = numbers.map(<[f64; 8]>::try_from) else {
            return Err(format!("{shown}:{line}: a row has 8 finite numbers, found `{row}`"));
        };
        let turn = nalgebra::Quaternion::new(w, i, j, k);
        if (turn.norm() - 1.0).abs() > UNIT {
            return Err(format!("{shown}:{line}: the quaternion has length {}, not 1", number(turn.norm())));
        }
        let turn = nalgebra::UnitQuaternion::from_quaternion(turn);
        all.push((t, Pose::from_parts(Vector3::new(x, y, z).into(), turn)));
    }
    Ok(all)
}
