//! Contact as tables of a scene: rigid things, and which faces of which bodies touch them or each other.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use pliant_geometry::{Mesh, boundary};

use super::conditions::LoadShape;
use super::contact::{Bodies, Contact, RigidForm, RigidMotion, Thing};
use super::geometry::Solid;
use super::writer::{Writer, add_faces};

/// The contact of a model, and the tables of contacts so far.
pub(super) struct Touching {
    contact: Contact,
    /// Names of the things in the scene.
    names: Vec<String>,
    /// True for each thing that touches nodes on the boundary of a body.
    met: Vec<bool>,
    /// Names of the bodies, and their numbers of pieces.
    bodies: Vec<(String, usize)>,
    /// True if there are several bodies.
    several: bool,
    tables: String,
}

impl Touching {
    pub fn new(contact: Contact, several: bool) -> Self {
        let before = |at: usize, kind| contact.things[..at].iter().filter(|thing| thing.kind == kind).count();
        let name = |(at, thing): (usize, &Thing)| format!("{}-{}", thing.kind, before(at, thing.kind));
        let names: Vec<String> = contact.things.iter().enumerate().map(name).collect();
        let met = vec![false; names.len()];
        Self { contact, names, met, bodies: Vec::new(), several, tables: String::new() }
    }

    /// True if the number of pieces of a body matters.
    pub(crate) fn asks_for_pieces(&self) -> bool {
        self.contact.bodies.is_some_and(|bodies| !bodies.themselves)
    }

    /// Adds the contacts of a body with rigid things. The nodes of the body begin at `first` in the whole
    /// model. The faces that touch become sets of its mesh.
    pub fn body(
        &mut self,
        writer: &mut Writer,
        body: &str,
        pieces: usize,
        first: u32,
        solid: Solid,
        mesh: &mut Mesh,
    ) {
        self.bodies.push((body.to_owned(), pieces));
        if self.contact.things.is_empty() {
            return;
        }
        let surface = boundary(mesh);
        let outer: BTreeSet<u32> = surface.faces.iter().flat_map(|face| face.nodes()).copied().collect();
        for ((thing, name), met) in self.contact.things.iter().zip(&self.names).zip(&mut self.met) {
            let set = if self.several { format!("{name}-{body}") } else { name.clone() };
            let mut lines = format!("[contact.{set}]\nbetween = [\"{body}\", \"{name}\"]\n");
            if let Some(nodes) = &thing.nodes {
                let listed: BTreeSet<u32> =
                    outer.iter().copied().filter(|node| nodes.contains(&(node + first))).collect();
                if listed.is_empty() {
                    continue;
                }
                *met = true;
                let chosen = surface.faces.iter().map(|face| face.nodes());
                let chosen = chosen.filter(|face| face.iter().all(|node| listed.contains(node)));
                let chosen: Vec<Vec<u32>> = chosen.map(<[u32]>::to_vec).collect();
                let covered: BTreeSet<u32> = chosen.iter().flatten().copied().collect();
                if chosen.is_empty() {
                    let (line, listed_count) = (thing.line, listed.len());
                    writer.missing.push(format!(
                        "contact (the object of line {line} with `{body}`: no face has all its nodes among the {listed_count} \
                         listed nodes; list all nodes of each face)"
                    ));
                    continue;
                }
                if covered.len() < listed.len() {
                    writer.notes.push(format!(
                        "`{set}`: only whole faces touch, but {} of {} listed nodes are on no face whose nodes are all listed",
                        listed.len() - covered.len(),
                        listed.len()
                    ));
                }
                if !add_faces(mesh, solid, &set, &chosen).whole {
                    let _ = writeln!(lines, "faces = {{ set = \"{set}\" }}");
                }
            }
            *met = true;
            lines.push_str(&how(thing.friction, Some(thing.margin).filter(|&margin| margin > 0.0)));
            self.tables.push_str(&lines);
        }
    }

    /// The contacts of bodies with each other and themselves.
    fn write_bodies(&mut self, writer: &mut Writer, Bodies { themselves, friction }: Bodies) {
        let how = how(friction, Some(self.contact.margin));
        let mut any = false;
        for (at, (body, pieces)) in self.bodies.iter().enumerate() {
            for (other, _) in &self.bodies[at + 1..] {
                let between = format!("between = [\"{body}\", \"{other}\"]");
                let _ = write!(self.tables, "[contact.{body}-{other}]\n{between}\n{how}");
                any = true;
            }
            if *pieces > 1 && !themselves {
                writer.note(&format!(
                    "DoDeformableCollision: `{body}` has {pieces} pieces, which touch each other; in the scene each also \
                     touches itself"
                ));
            }
            if themselves || *pieces > 1 {
                let _ =
                    write!(self.tables, "[contact.{body}-itself]\nbetween = [\"{body}\", \"{body}\"]\n{how}");
                any = true;
            }
        }
        if !any {
            writer.note(
                "DoDeformableCollision: the model is one piece, and it has nothing else to touch; \
                 DoSelfCollision lets it touch itself",
            );
        }
    }
}

/// Friction and distance of a contact, and an empty line. The distance is left out if it is not given.
fn how(friction: f64, thickness: Option<f64>) -> String {
    let mut lines = format!("friction = {friction:?}\n");
    if let Some(thickness) = thickness {
        let _ = writeln!(lines, "thickness = {thickness:?}");
    }
    lines.push('\n');
    lines
}

impl Writer {
    /// Writes the rigid things and all contacts; returns the meshes of surfaces.
    pub fn contact(&mut self, mut touching: Touching, stem: &str) -> Vec<(String, Mesh)> {
        if let Some(bodies) = touching.contact.bodies {
            touching.write_bodies(self, bodies);
        }
        let Touching { contact, names, met, tables, .. } = touching;
        let mut meshes = Vec::new();
        for ((thing, name), met) in contact.things.into_iter().zip(names).zip(met) {
            if !met {
                self.notes.push(format!(
                    "`{name}`: none of its listed nodes is on a boundary, so nothing touches it"
                ));
            }
            meshes.extend(self.thing(thing, &name, stem));
        }
        tables.lines().for_each(|line| self.line(line.to_owned()));
        meshes
    }

    /// Writes an obstacle, or a tool if it moves; returns the mesh of a surface.
    fn thing(&mut self, thing: Thing, name: &str, stem: &str) -> Option<(String, Mesh)> {
        let rests = matches!(thing.motion, RigidMotion::Rest) && thing.growth == 0.0;
        let kind = if rests { "obstacle" } else { "tool" };
        self.line(format!("[{kind}.{name}]"));
        let mut file = None;
        let round = |[radius, length]: [f64; 2]| format!("{{ radius = {radius:?}, length = {length:?} }}");
        let shape = match thing.form {
            RigidForm::Box(size) => format!("box = {{ size = {size:?} }}"),
            RigidForm::Cylinder(size) => format!("cylinder = {}", round(size)),
            RigidForm::Capsule(size) => format!("capsule = {}", round(size)),
            RigidForm::Mesh { mesh, inside } => {
                let path = format!("{stem}-{name}.vtu");
                let shape = format!("mesh = {{ file = \"{path}\", scale = 1 }}");
                file = Some((path, mesh));
                if inside {
                    self.line("inside = true  # its triangles turn inward".into());
                }
                shape
            }
        };
        self.line(format!("shape = {{ {shape} }}"));
        for (key, value) in [("at", thing.at), ("turn", thing.turn)] {
            if value != [0.0; 3] {
                self.line(format!("{key} = {value:?}"));
            }
        }
        if thing.growth != 0.0 {
            let (by, total) = (thing.growth, self.system.total);
            self.line(format!("grows = {{ by = {by:?}, curve = \"polynomial-10-15-6\", to = {total:?} }}"));
        }
        match thing.motion {
            RigidMotion::Rest => {}
            RigidMotion::Smooth(shift) => {
                self.line(format!("by = {shift:?}"));
                self.curve(LoadShape::Polynomial, true);
            }
            RigidMotion::Steady(shift) => {
                self.line(format!("by = {shift:?}"));
                self.onward();
            }
            RigidMotion::Turn { axis, centre, angle } => {
                self.line(format!("rotate = {{ axis = {axis:?}, centre = {centre:?}, angle = {angle:?} }}"));
                self.onward();
            }
            RigidMotion::Poses(rows) => {
                let path = format!("{stem}-{name}.csv");
                let mut text = "t,x,y,z,qw,qx,qy,qz\n".to_owned();
                for row in rows {
                    let row: Vec<String> = row.iter().map(|value| format!("{value:?}")).collect();
                    text.push_str(&row.join(","));
                    text.push('\n');
                }
                self.line(format!("poses = \"{path}\""));
                self.files.push((path, text));
            }
        }
        self.line(String::new());
        file
    }

    /// A curve in proportion to time, which does not stop at the end.
    fn onward(&mut self) {
        let (end, total) = (2.0 * self.system.end(), self.system.total);
        self.line(format!(
            "curve = {{ table = [[0.0, 0.0], [{end:?}, {:?}]] }}  # t / {total:?} s",
            end / total
        ));
    }
}
