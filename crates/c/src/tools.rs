//! Tools: poses to which a program leads them, and the forces on them.

use std::ffi::c_char;

use pliant_sim::contact::pose::Pose;
use pliant_sim::pose_of;

use crate::context::PliantContext;
use crate::open::Running;
use crate::pointers::{finite, give, needed, numbers, text};
use crate::simulation::{PLIANT_TOOLS, PliantSimulation, running};
use crate::status::{Fault, PliantError, PliantStatus};
use crate::values::unknown;

/// A tool or an obstacle at an instant.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PliantTool {
    /// Origin of its frame [m].
    pub position: [f64; 3],
    /// Rotation of its frame: a unit quaternion x, y, z, w.
    pub rotation: [f64; 4],
    /// The angle [rad] between its jaws; 0 without any.
    pub opening: f64,
    /// The force [N] on it of all that touches it.
    pub force: [f64; 3],
    /// The moment [N m] of these forces about its frame; NaN on a GPU.
    pub torque: [f64; 3],
}

/// Checks that a tool exists.
fn known(running: &Running, name: &str) -> Result<(), Fault> {
    running.simulation.tool(name).map(|_| ()).ok_or_else(|| unknown(running, PLIANT_TOOLS, "tool", name))
}

/// Leads a tool to a pose, its jaws to an angle [rad], or both within a time [s]. `arrival`, if it is not
/// null, gets the time [s] of arrival.
unsafe fn lead(
    running: &mut Running,
    name: &str,
    goal: (Option<Pose>, Option<f64>),
    within: f64,
    arrival: *mut f64,
) -> Result<(), Fault> {
    known(running, name)?;
    let there = running.simulation.lead(name, goal.0, goal.1, within);
    let there = there.map_err(|failure| Fault::new(PliantStatus::NotANumber, failure.message))?;
    // SAFETY: the caller promises valid pointers.
    if arrival.is_null() { Ok(()) } else { unsafe { give(arrival, "arrival", there) } }
}

/// A pose of a place [m] and a quaternion x, y, z, w.
unsafe fn goal(position: *const f64, rotation: *const f64) -> Result<Pose, Fault> {
    // SAFETY: the caller promises valid pointers.
    let (place, turn) = unsafe { (numbers(position, "position")?, numbers(rotation, "rotation")?) };
    let refused = || Fault::new(PliantStatus::NotANumber, "`rotation` is a quaternion of length 0");
    pose_of(place, turn).ok_or_else(refused)
}

/// Leads a tool to a pose within a time [s] from now, on a straight way and the shortest turn; there it
/// stays. The motion of its jaws continues. `rotation` is a quaternion x, y, z, w of any length but 0.
/// `arrival`, if it is not null, gets the time [s] of arrival. That time is later than asked for if the tool
/// would pass over nodes on the way.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_tool_lead(
    context: *const PliantContext,
    simulation: PliantSimulation,
    tool: *const c_char,
    position: *const f64,
    rotation: *const f64,
    within: f64,
    arrival: *mut f64,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            let name = text(tool, "tool")?;
            let pose = goal(position, rotation)?;
            finite(&[within], "within")?;
            lead(running, name, (Some(pose), None), within, arrival)
        })
    }
}

/// Opens or closes the jaws of a tool to an angle [rad] within a time [s] from now. The motion of the tool
/// continues. `arrival` is as in `pliant_tool_lead`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_tool_open(
    context: *const PliantContext,
    simulation: PliantSimulation,
    tool: *const c_char,
    angle: f64,
    within: f64,
    arrival: *mut f64,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            let name = text(tool, "tool")?;
            finite(&[angle, within], "angle and within")?;
            lead(running, name, (None, Some(angle)), within, arrival)
        })
    }
}

/// Leads a tool to a pose and its jaws to an angle [rad], so that both arrive together. The other arguments
/// are as in `pliant_tool_lead`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_tool_lead_open(
    context: *const PliantContext,
    simulation: PliantSimulation,
    tool: *const c_char,
    position: *const f64,
    rotation: *const f64,
    angle: f64,
    within: f64,
    arrival: *mut f64,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            let name = text(tool, "tool")?;
            let pose = goal(position, rotation)?;
            finite(&[angle, within], "angle and within")?;
            lead(running, name, (Some(pose), Some(angle)), within, arrival)
        })
    }
}

/// Reports the pose of a tool, an obstacle or a jaw (`grasper.upper`, `grasper.lower`), and the forces on it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_tool(
    context: *const PliantContext,
    simulation: PliantSimulation,
    tool: *const c_char,
    now: *mut PliantTool,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            needed(now, "now")?;
            let name = text(tool, "tool")?;
            running.look()?;
            let found =
                running.simulation.tool(name).ok_or_else(|| unknown(running, PLIANT_TOOLS, "tool", name))?;
            let found = PliantTool {
                position: found.pose.translation.vector.into(),
                rotation: found.pose.rotation.coords.into(),
                opening: found.opening,
                force: found.force,
                torque: found.torque.unwrap_or([f64::NAN; 3]),
            };
            give(now, "now", found)
        })
    }
}
