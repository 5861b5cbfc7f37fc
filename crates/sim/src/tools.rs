//! Tools that are driven from outside: by a mouse, a haptic device or a program.

use std::sync::Arc;

use nalgebra::{Quaternion, Translation3, UnitQuaternion};
use pliant_contact::pose::{Leg, Pose};
use pliant_contact::touch::{Rigid, With};
use pliant_mechanics::tensor::{add, cross, sub};

use crate::failure::Failure;
use crate::simulation::{Frame, Simulation};

/// A tool or an obstacle at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolNow {
    /// Pose of its frame.
    pub pose: Pose,
    /// The angle [rad] between its jaws; 0 without any.
    pub opening: f64,
    /// The force [N] of all that touches it.
    pub force: [f64; 3],
    /// The moment [N m] of that about its frame; `None` on a GPU.
    pub torque: Option<[f64; 3]>,
}

/// A pose of a place [m] and a quaternion x, y, z, w of any length but 0; `None` where that has none, or a
/// number is not finite.
pub fn pose_of([x, y, z]: [f64; 3], quaternion: [f64; 4]) -> Option<Pose> {
    let most = quaternion.iter().fold(0.0_f64, |most, part| most.max(part.abs()));
    if !(most > 0.0 && [x, y, z, most].iter().all(|part| part.is_finite())) {
        return None;
    }
    // Its length may be beyond all numbers.
    let [i, j, k, w] = quaternion.map(|part| part / most);
    Some(Pose::from_parts(
        Translation3::new(x, y, z),
        UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k)),
    ))
}

/// Tools.
///
/// ```
/// use std::sync::Arc;
/// use pliant_mechanics::Model;
/// use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
/// use pliant_mechanics::model::{Cells, Material, Solid};
/// use pliant_sim::contact::pairs::Surface;
/// use pliant_sim::contact::pose::{Trajectory, Pose};
/// use pliant_sim::contact::shape::Shape;
/// use pliant_sim::contact::touch::{Contact, Contacts, Rigid, Touch, With};
/// use pliant_sim::{Method, ParticipantSetup, Simulation};
///
/// // A tetrahedron on a held face, and a ball above its tip.
/// let mut model = Model::default();
/// let tet = model.add_body("tet", &[[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]]);
/// let law = AnyLaw::NeoHookean(NeoHookean { shear: 1000.0, volumetric: Volumetric::quadratic(10_000.0) });
/// let cells = Cells::tet4(vec![[0, 1, 2, 3]], &model.rest);
/// model.add_solid(Solid::new(tet, Material::elastic(law, 1000.0), cells));
/// model.fix("base", vec![0, 1, 2]);
/// let mut part = ParticipantSetup::explicit("tet", model, 1.0)?;
/// let above = Pose::translation(0.0, 0.0, 0.12);
/// let ball = Rigid {
///     name: "ball".into(),
///     shape: Shape::Sphere { radius: 0.02 },
///     trajectory: Trajectory::fixed(above),
///     inside: false,
///     jaw: None,
/// };
/// let surface = Surface { nodes: vec![3], faces: Vec::new() };
/// let touch = Touch { friction: 0.0, offset: 0.0 };
/// let contact = Contact { name: "press".into(), surface, with: With::Rigid(0), touch };
/// let Method::Explicit(explicit) = &mut part.method else { unreachable!() };
/// let contacts = Contacts { rigids: vec![ball], contacts: vec![contact], ..Default::default() };
/// explicit.contacts = Some(Arc::new(contacts));
///
/// let mut simulation = Simulation::new(part)?;
/// let arrival = simulation.drive("ball", Pose::translation(0.0, 0.0, 0.11), 0.1)?;
/// simulation.run(arrival, |_| ())?;
/// let ball = simulation.frame()?.tool("ball").unwrap();
/// assert!((ball.pose.translation.z - 0.11).abs() < 1e-12 && ball.force[2] > 0.0);
/// // Without friction nothing turns a ball.
/// assert!(ball.torque.unwrap().iter().all(|m| m.abs() < 1e-3 * 0.02 * ball.force[2]));
/// # Ok::<(), pliant_sim::Failure>(())
/// ```
impl Simulation {
    /// Drives a tool or an obstacle to a pose within a time [s], on a straight way and the shortest arc from
    /// its present pose. There it stays; it leaves the trajectory that it has in the scene. Returns the time
    /// of arrival [s]. This is later than the given time where nodes would be passed over on the way, and
    /// after one step at the earliest. The step under way, if its forces are found, is the last one of the
    /// motion before. Its jaws continue their motion.
    ///
    /// # Errors
    /// If there is no tool of this name, or a number is not finite.
    pub fn drive(&mut self, tool: &str, pose: Pose, within: f64) -> Result<f64, Failure> {
        self.lead(tool, Some(pose), None, within)
    }

    /// Opens or closes the jaws of a tool to an angle [rad] within a time [s]. Returns the time of arrival
    /// [s]. The tool continues its motion.
    ///
    /// # Errors
    /// If there is no tool of this name, or a number is not finite.
    pub fn open(&mut self, tool: &str, opening: f64, within: f64) -> Result<f64, Failure> {
        self.lead(tool, None, Some(opening), within)
    }

    /// Drives a tool to a pose and its jaws to an angle [rad], which arrive together. A part without a goal
    /// continues its motion. Returns the time of arrival [s].
    ///
    /// # Errors
    /// If there is no tool of this name, or a number is not finite.
    pub fn lead(
        &mut self,
        tool: &str,
        pose: Option<Pose>,
        opening: Option<f64>,
        within: f64,
    ) -> Result<f64, Failure> {
        let setup = Arc::clone(self.setup());
        let evaluated = self.is_evaluated();
        let mut legs = Vec::new();
        for (index, (part, now)) in setup.parts.iter().zip(self.instants()).enumerate() {
            let step = part.steps.step_from(now.time());
            // The forces of an explicit step know where the tool goes in it; equations are solved for with
            // the new way.
            let is_decided = evaluated && !part.method.takes_long();
            let begin = if is_decided { now.time() + step } else { now.time() };
            let rigids = part.method.contacts().map_or(&[][..], |contacts| &contacts.rigids);
            for (number, rigid) in rigids.iter().enumerate().filter(|(_, rigid)| rigid.tool() == tool) {
                let before = now.leg(number);
                let from = rigid.posture(begin, before);
                let to = (pose.unwrap_or(from.0), opening.unwrap_or(from.1));
                let duration =
                    (within - (begin - now.time())).max(step).max(rigid.shortest([from, to], step));
                legs.push((index, number, begin, duration, from, before.copied()));
            }
        }
        // Jaws of a tool arrive together.
        let duration = legs.iter().map(|leg| leg.3).fold(0.0, f64::max);
        let mut arrival = None;
        for (index, number, begin, _, from, before) in legs {
            let times = [begin, begin + duration];
            let moved = pose.map(|to| Leg::to_pose(times, [from.0, to]));
            let opened = opening.map(|to| Leg::to_opening(times, [from.1, to]));
            let ways = [moved, opened, before].into_iter().flatten();
            let Some(leg) = ways.reduce(|leg, before| leg.or(&before)) else { continue };
            if !(leg.is_finite() && within.is_finite()) {
                return Err(Failure::input(&format_args!(
                    "the goal of tool `{tool}`, or the time to reach it, is not finite"
                )));
            }
            self.lead_part(index, number, leg);
            arrival = Some(begin + duration);
        }
        arrival.ok_or_else(|| {
            let rigids = setup.parts.iter().filter_map(|part| part.method.contacts());
            let mut known: Vec<&str> =
                rigids.flat_map(|contacts| &contacts.rigids).map(Rigid::tool).collect();
            known.dedup();
            Failure::input(&match known.is_empty() {
                true => format!("there is no tool `{tool}`: no body touches a tool"),
                false => format!("there is no tool `{tool}`; there are {}", known.join(", ")),
            })
        })
    }
}

impl Frame<'_> {
    /// A tool, an obstacle, or a jaw (`grasper.upper`, `grasper.lower`); `None` without one of this name.
    pub fn tool(&self, name: &str) -> Option<ToolNow> {
        self.simulation.tool(name)
    }
}

impl Simulation {
    /// A tool, an obstacle, or a jaw (`grasper.upper`, `grasper.lower`), with the force found last; `None`
    /// without one of this name. The pose of a jaw is the pose of its shape.
    pub fn tool(&self, name: &str) -> Option<ToolNow> {
        let mut found: Option<ToolNow> = None;
        for (part, now) in self.setup().parts.iter().zip(self.instants()) {
            let Some(contacts) = part.method.contacts() else { continue };
            let is_named = |number: usize| {
                [contacts.rigids[number].tool(), &contacts.rigids[number].name].contains(&name)
            };
            let Some(number) = (0..contacts.rigids.len()).find(|&number| is_named(number)) else { continue };
            let rigid = &contacts.rigids[number];
            let (of_tool, opening) = now.posture(number, rigid);
            let pose = if rigid.tool() == name { of_tool } else { now.pose(number, rigid) };
            let sum = found.get_or_insert(ToolNow { pose, opening, force: [0.0; 3], torque: Some([0.0; 3]) });
            let moments = now.contact_moments();
            let frame = pose.translation.vector.into();
            for (index, (contact, force)) in contacts.contacts.iter().zip(now.contact_forces()).enumerate() {
                if matches!(contact.with, With::Rigid(rigid) if is_named(rigid)) {
                    sum.force = add(sum.force, force);
                    let moment = moments.as_ref().and_then(|moments| moments.get(index));
                    let about = |moment: &[f64; 3]| sub(*moment, cross(frame, force));
                    sum.torque = sum.torque.zip(moment).map(|(sum, moment)| add(sum, about(moment)));
                }
            }
        }
        found
    }
}
