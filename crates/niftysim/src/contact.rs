//! Contact of NiftySim: rigid plates, cylinders, probes and surfaces that nodes of the model touch, and
//! bodies that touch each other.
//!
//! Plates, cylinders and probes move by POLY345, surfaces in proportion to time. NiftySim moves single nodes
//! out of these rigid things; a scene keeps out the faces of these nodes. Leaves out: `<KinematicContact>`,
//! and the items of [`Remarks::missing`].

use std::collections::BTreeSet;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use pliant_geometry::{Mesh, Vector3};

use super::Files;
use super::conditions::Remarks;
use super::error::{Fault, ImportProblem};
use super::geometry::positive;
use super::rigid_surface;
use super::system::System;
use super::xml::{
    XmlElement, child, children, count, fault, indices, is_on, line, needed, number, numbers_of,
    run_of_indices,
};

/// Largest cosine of the angle between the edges of a plate that counts as a rectangle.
const RECTANGLE: f64 = 1e-3;
/// Rows of a table of poses.
const POSES: u32 = 1000;

/// Contacts of a model.
#[derive(Debug, Default)]
pub(super) struct Contact {
    /// Rigid things.
    pub things: Vec<Thing>,
    /// Contact of bodies with each other, if any.
    pub bodies: Option<Bodies>,
    /// Distance that surfaces of rigid meshes and bodies keep [m].
    pub margin: f64,
}

/// Contact of bodies with each other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bodies {
    /// True if a body also touches itself.
    pub themselves: bool,
    pub friction: f64,
}

/// A rigid thing that nodes touch.
#[derive(Debug)]
pub(super) struct Thing {
    /// Its line in the XML.
    pub line: u32,
    /// `plate`, `cylinder`, `probe` or `surface`.
    pub kind: &'static str,
    pub form: RigidForm,
    /// Origin of its frame [m].
    pub at: [f64; 3],
    /// Turn of its frame [rad]: about this vector by its length.
    pub turn: [f64; 3],
    pub motion: RigidMotion,
    /// Growth of its radius [m], along POLY345.
    pub growth: f64,
    /// The nodes of the model that touch it; all if not given.
    pub nodes: Option<BTreeSet<u32>>,
    pub friction: f64,
    /// Distance that surfaces keep from it [m].
    pub margin: f64,
}

/// The form of a rigid thing, as a scene has it.
#[derive(Debug)]
pub(super) enum RigidForm {
    /// Edges [m].
    Box([f64; 3]),
    /// Radius and length [m].
    Cylinder([f64; 2]),
    /// Radius and length of the segment [m].
    Capsule([f64; 2]),
    /// The inside of a closed surface. If the surface faces inward, bodies are inside.
    Mesh { mesh: Mesh, inside: bool },
}

/// Motion of a rigid thing.
#[derive(Debug)]
pub(super) enum RigidMotion {
    Rest,
    /// By a vector [m] along POLY345.
    Smooth([f64; 3]),
    /// By a vector [m], in proportion to time.
    Steady([f64; 3]),
    /// About an axis through a centre [m] by an angle [rad], in proportion to time.
    Turn {
        axis: [f64; 3],
        centre: [f64; 3],
        angle: f64,
    },
    /// A table of poses: time [s], position [m], unit quaternion (w, x, y, z).
    Poses(Vec<[f64; 8]>),
}

/// Reads the contacts of a model of `nodes` nodes.
pub(super) fn read(
    root: XmlElement<'_>,
    nodes: usize,
    system: &System,
    files: &Files<'_>,
    remarks: &mut Remarks,
) -> Result<Contact, Fault> {
    let mut reader = ContactReader { nodes, system, files, remarks };
    let (margin, bodies) = reader.system(root)?;
    let mut things = Vec::new();
    for of in root.children().filter(|of| of.is_element()) {
        let thing = match of.tag_name().name() {
            "ContactPlate" => reader.plate(of)?,
            "ContactCylinder" => reader.round(of, "cylinder")?,
            "ContactUSProbe" => reader.round(of, "probe")?,
            "ContactSurface" => reader.surface(of, margin)?,
            _ => continue,
        };
        things.extend(thing);
    }
    let kinematic = children(root, "KinematicContact").count();
    if kinematic > 0 {
        reader
            .remarks
            .missing
            .push("contact (KinematicContact: NiftySim's own guide does not tell what it means)".into());
    }
    Ok(Contact { things, bodies, margin })
}

struct ContactReader<'r> {
    /// Nodes of the model.
    nodes: usize,
    system: &'r System,
    files: &'r Files<'r>,
    remarks: &'r mut Remarks,
}

const NODES: &str = "<SlvNodes NumNodes=\"3\">0 1 2</SlvNodes>: NiftySim lets no other nodes touch";

impl ContactReader<'_> {
    /// The margin [m] of surfaces, and how bodies touch each other.
    fn system(&mut self, root: XmlElement<'_>) -> Result<(f64, Option<Bodies>), Fault> {
        let Some(of) = child(root, "SystemParams") else { return Ok((0.0, None)) };
        let margin = at_least_0(of, "ContactSafetyMargin", "the safety margin of contact")?;
        let friction = at_least_0(of, "DeformableFrictionCoefficient", "the coefficient of friction")?;
        let themselves = is_on(of, "DoSelfCollision");
        let bodies =
            (themselves || is_on(of, "DoDeformableCollision")).then_some(Bodies { themselves, friction });
        if child(of, "RateConstraintDistance").is_some() {
            self.remarks.notes.push(
                "RateConstraintDistance: NiftySim slows down what comes this near; the scene needs no such distance".into(),
            );
        }
        Ok((margin, bodies))
    }

    fn leave_out(&mut self, of: XmlElement<'_>, what: &str) {
        let name = of.tag_name().name();
        self.remarks.missing.push(format!("contact ({name} of line {}: {what})", line(of)));
    }

    fn note(&mut self, note: &str) {
        if !self.remarks.notes.iter().any(|known| known == note) {
            self.remarks.notes.push(note.to_owned());
        }
    }

    /// A plate from its corner a along the edges to b and c. Nodes are on the side of the normal (b − a) ×
    /// (c − a).
    fn plate(&mut self, of: XmlElement<'_>) -> Result<Option<Thing>, Fault> {
        let corner =
            |name, example| numbers_of::<3>(needed(of, name, example)?, "coordinates").map(Vector3::from);
        let a = corner("a", "<a>0 0 0</a>, a corner of the plate")?;
        let b = corner("b", "<b>0.1 0 0</b>, the corner along the first edge")?;
        let c = corner("c", "<c>0 0.1 0</c>, the corner along the second edge")?;
        let edges = [b - a, c - a];
        let lengths = edges.map(|edge| edge.norm());
        for (length, what) in lengths.into_iter().zip(["the edge from a to b", "the edge from a to c"]) {
            if !(length > 0.0 && length.is_finite()) {
                let problem =
                    ImportProblem::OutOfRange { what, value: length, range: "longer than 0 and finite" };
                return Err(fault(of, problem));
            }
        }
        let nodes = self.slave_nodes(of)?;
        let motion = shift(of, "Disp")?;
        let cosine = edges[0].dot(&edges[1]) / (lengths[0] * lengths[1]);
        if cosine.abs() > RECTANGLE {
            let angle = cosine.clamp(-1.0, 1.0).acos().to_degrees();
            self.leave_out(of, &format!("its edges meet in {angle:.2}°, and plates are rectangles; move c"));
            return Ok(None);
        }
        self.note(
            "ContactPlate: NiftySim's plate is a plane that pushes nodes to its front, also beyond its corner a; the scene's is a \
             box, as deep behind the plate as its shorter edge is long",
        );
        let x = edges[0] / lengths[0];
        let z = edges[0].cross(&edges[1]).normalize();
        let depth = lengths[0].min(lengths[1]);
        let frame = Matrix3::from_columns(&[x, z.cross(&x), z]);
        let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(frame));
        let at = a + 0.5 * (edges[0] + edges[1]) - 0.5 * depth * z;
        let form = RigidForm::Box([lengths[0], lengths[1], depth]);
        thing(of, "plate", form, (at, turn), motion, Some(nodes)).map(Some)
    }

    /// A cylinder from its origin along its axis, or a probe, which has a round tip there.
    fn round(&mut self, of: XmlElement<'_>, kind: &'static str) -> Result<Option<Thing>, Fault> {
        let vector =
            |name, example| numbers_of::<3>(needed(of, name, example)?, "coordinates").map(Vector3::from);
        let origin = vector("Origin", "<Origin>0 0 0</Origin>, the middle of its end")?;
        let axis = vector("Axis", "<Axis>0 0 1</Axis>, along its length")?;
        let radius = positive(needed(of, "Radius", "<Radius>0.01</Radius>")?, "the radius")?;
        let length = positive(needed(of, "Length", "<Length>0.1</Length>")?, "the length")?;
        let unit = axis.norm();
        if !(unit > 0.0 && unit.is_finite()) {
            let (what, range) = ("the length of the axis", "greater than 0 and finite");
            return Err(fault(of, ImportProblem::OutOfRange { what, value: unit, range }));
        }
        let along = axis / unit;
        let nodes = self.slave_nodes(of)?;
        let motion = shift(of, "OrigDisp")?;
        let growth = child(of, "RadChange").map(number).transpose()?.unwrap_or(0.0);
        if !growth.is_finite() || radius + growth <= 0.0 {
            let (what, range) = ("the change of the radius", "greater than minus the radius, and finite");
            return Err(fault(of, ImportProblem::OutOfRange { what, value: growth, range }));
        }
        if growth < 0.0 && kind != "probe" {
            self.leave_out(
                of,
                &format!("its radius changes by {growth}, and cylinders of a scene only grow"),
            );
            return Ok(None);
        }
        if growth > 0.0 && kind != "probe" {
            self.note("RadChange: NiftySim's cylinder grows in radius alone; the scene's grows at its ends, too, by as much");
        }
        if (unit - 1.0).abs() > 1e-3 {
            let line = line(of);
            self.note(&format!(
                "the axis of line {line} has the length {unit:.4}: it is taken as a direction only"
            ));
        }
        let form = match kind {
            "probe" => {
                self.note(
                    "ContactUSProbe: a shaft with a round tip; the scene's is round at its other end, too, by a radius \
                     behind `Origin`",
                );
                RigidForm::Capsule([radius, length])
            }
            _ => {
                self.note(
                    "ContactCylinder: NiftySim's has no ends, and nodes in it leave by its side; the scene's has flat ones",
                );
                RigidForm::Cylinder([radius, length])
            }
        };
        let turn = UnitQuaternion::rotation_between(&Vector3::z(), &along)
            .unwrap_or_else(|| UnitQuaternion::from_scaled_axis(Vector3::x() * std::f64::consts::PI));
        let at = origin + 0.5 * length * along;
        Ok(Some(Thing { growth, ..thing(of, kind, form, (at, turn), motion, Some(nodes))? }))
    }

    /// A rigid surface of triangles.
    fn surface(&mut self, of: XmlElement<'_>, margin: f64) -> Result<Option<Thing>, Fault> {
        let surface = rigid_surface::read(of, self.files, &mut self.remarks.notes)?;
        let friction = at_least_0(of, "FrictionCoefficient", "the coefficient of friction")?;
        if child(of, "SlvNodes").is_some() {
            self.note("ContactSurface: NiftySim reads <SlaveNodes> here; it ignores <SlvNodes>, and so does the scene");
        }
        let nodes = child(of, "SlaveNodes").map(|list| self.listed(list)).transpose()?;
        let motion = self.motion(of)?;
        let name = format!("the surface of line {}", line(of));
        let form = match surface.solid() {
            Ok((mesh, inside, depth)) => {
                if let Some(depth) = depth {
                    self.remarks.notes.push(format!(
                        "{name} is an open sheet: it got a thickness of {depth:.3e} m behind its front, to which its \
                         triangles turn"
                    ));
                }
                RigidForm::Mesh { mesh, inside }
            }
            Err(what) => {
                self.leave_out(of, &what);
                return Ok(None);
            }
        };
        let at_rest = (Vector3::zeros(), UnitQuaternion::identity());
        Ok(Some(Thing { friction, margin, ..thing(of, "surface", form, at_rest, motion, nodes)? }))
    }

    /// The motion of a surface, which grows in proportion to time. NiftySim's code reads angles in radians,
    /// then the centre.
    fn motion(&mut self, of: XmlElement<'_>) -> Result<RigidMotion, Fault> {
        let mut shift = Vector3::zeros();
        let mut turn: Option<([f64; 3], [f64; 3])> = None;
        for motion in children(of, "Motion") {
            match motion.attribute("Type").map(str::trim) {
                Some("Translation") => {
                    shift = Vector3::from(numbers_of::<3>(motion, "numbers of a translation")?);
                }
                Some("Rotation") => {
                    let [x, y, z, centre @ ..] = numbers_of::<6>(motion, "numbers of a rotation")?;
                    if [x, y, z] == [0.0; 3] {
                        let what = "the first three numbers are the angles [rad] in NiftySim's code, the others the \
                                    centre, and these angles are all 0"
                            .to_owned();
                        let remedy = "give the angles first, or leave the rotation out";
                        return Err(fault(motion, ImportProblem::Contradiction { what, remedy }));
                    }
                    self.note(
                        "Motion of type Rotation: three angles [rad] about x, then y, then z, and then the centre, as \
                         NiftySim's code reads them; its guide may have the centre first",
                    );
                    turn = Some(([x, y, z], centre));
                }
                other => {
                    let (what, known) = ("type of motion", "Translation, Rotation");
                    let found = other.unwrap_or_default().to_owned();
                    return Err(fault(motion, ImportProblem::Unknown { what, found, known }));
                }
            }
        }
        let axes = turn.map_or(0, |(angles, _)| angles.iter().filter(|&&angle| angle != 0.0).count());
        Ok(match turn {
            None if shift == Vector3::zeros() => RigidMotion::Rest,
            None => RigidMotion::Steady(shift.into()),
            Some((angles, centre)) if axes == 1 && shift == Vector3::zeros() => {
                let axis = angles.map(|angle| if angle == 0.0 { 0.0 } else { 1.0 });
                RigidMotion::Turn { axis, centre, angle: angles.iter().sum() }
            }
            Some((angles, centre)) => RigidMotion::Poses(self.poses(angles, centre.into(), &shift)),
        })
    }

    /// Poses of a surface that turns about x, y and z, and moves.
    fn poses(&self, angles: [f64; 3], centre: Vector3, shift: &Vector3) -> Vec<[f64; 8]> {
        let end = self.system.end();
        let row = |k: u32| {
            let time = end * f64::from(k) / f64::from(POSES);
            let part = time / self.system.total;
            let about = |axis, angle: f64| UnitQuaternion::from_axis_angle(&axis, part * angle);
            let [x, y, z] = angles;
            let turn =
                about(Vector3::z_axis(), z) * about(Vector3::y_axis(), y) * about(Vector3::x_axis(), x);
            let place = centre + shift * part - turn * centre;
            [time, place.x, place.y, place.z, turn.w, turn.i, turn.j, turn.k]
        };
        // One row more, so that it still moves at the end.
        (0..=POSES + 1).map(row).collect()
    }

    fn slave_nodes(&self, of: XmlElement<'_>) -> Result<BTreeSet<u32>, Fault> {
        self.listed(needed(of, "SlvNodes", NODES)?)
    }

    fn listed(&self, list: XmlElement<'_>) -> Result<BTreeSet<u32>, Fault> {
        let size = list.attribute("NumNodes").map(str::trim);
        if size == Some("all") {
            return Ok((0..self.nodes as u32).collect());
        }
        let listed = indices(list, "node", self.nodes)?;
        let size = size.map(|word| count(list, word)).transpose()?.unwrap_or(listed.len());
        Ok(run_of_indices(list, listed, size, "node", "nodes", self.nodes)?.into_iter().collect())
    }
}

fn thing(
    of: XmlElement<'_>,
    kind: &'static str,
    form: RigidForm,
    (at, turn): (Vector3, UnitQuaternion<f64>),
    motion: RigidMotion,
    nodes: Option<BTreeSet<u32>>,
) -> Result<Thing, Fault> {
    let (at, turn): ([f64; 3], [f64; 3]) = (at.into(), turn.scaled_axis().into());
    if let Some(&value) = at.iter().chain(&turn).find(|x| !x.is_finite()) {
        let (what, range) = ("a coordinate of its frame", "a number that can be computed with");
        return Err(fault(of, ImportProblem::OutOfRange { what, value, range }));
    }
    Ok(Thing { line: line(of), kind, form, at, turn, motion, growth: 0.0, nodes, friction: 0.0, margin: 0.0 })
}

/// The displacement of a plate, a cylinder or a probe.
fn shift(of: XmlElement<'_>, name: &'static str) -> Result<RigidMotion, Fault> {
    let Some(by) = child(of, name) else { return Ok(RigidMotion::Rest) };
    let by = numbers_of::<3>(by, "components of the displacement")?;
    Ok(if by == [0.0; 3] { RigidMotion::Rest } else { RigidMotion::Smooth(by) })
}

/// A number of at least 0; 0 if it is not given.
fn at_least_0(of: XmlElement<'_>, name: &'static str, what: &'static str) -> Result<f64, Fault> {
    let Some(of) = child(of, name) else { return Ok(0.0) };
    let value = number(of)?;
    let problem = ImportProblem::OutOfRange { what, value, range: "at least 0" };
    if value >= 0.0 { Ok(value) } else { Err(fault(of, problem)) }
}
