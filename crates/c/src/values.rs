//! Values of an instant: nodes, fields, reactions, forces of contacts, energies.

use std::ffi::c_char;

use pliant_format::tables::At;
use pliant_mechanics::Energies;
use pliant_run::FieldReader;

use crate::buffer::PliantBuffer;
use crate::context::PliantContext;
use crate::open::{OpenField, Running};
use crate::pointers::{give, needed, some_text, text};
use crate::simulation::{
    PLIANT_BODIES, PLIANT_CONSTRAINTS, PLIANT_CONTACTS, PliantSimulation, names, running,
};
use crate::status::{Fault, PliantError, PliantStatus};

/// The nodes of a body: `count` nodes from the first one on, counted over all bodies.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PliantNodes {
    /// The first one.
    pub first: u64,
    /// Number of nodes.
    pub count: u64,
}

/// Fault of an unknown name, with the known names.
pub(crate) fn unknown(running: &Running, kind: u32, what: &str, name: &str) -> Fault {
    let known = names(running, kind).unwrap_or_default();
    let those = if known.is_empty() {
        "the simulation has none".into()
    } else {
        format!("there are {}", known.join(", "))
    };
    Fault::new(PliantStatus::Unknown, format!("there is no {what} `{name}`; {those}"))
}

/// The nodes of a body by name; null is all bodies.
fn nodes(running: &Running, body: Option<&str>) -> Result<PliantNodes, Fault> {
    let Some(name) = body else { return Ok(PliantNodes { first: 0, count: running.nodes() as u64 }) };
    let parts = running.simulation.setup().parts.iter().enumerate();
    let found =
        parts.flat_map(|(part, participant)| participant.model.bodies.iter().map(move |body| (part, body)));
    let mut found = found.filter(|(_, body)| body.name == name);
    match found.next() {
        Some((part, body)) => {
            let first = u64::from(running.simulation.node(part, body.nodes.start));
            Ok(PliantNodes { first, count: u64::from(body.nodes.end - body.nodes.start) })
        }
        None => Err(unknown(running, PLIANT_BODIES, "body", name)),
    }
}

/// Reports the nodes of a body by name; null is all bodies. They are numbered as in its mesh file or in the
/// given mesh, unless repairs changed the numbers. A wall on a solid has only nodes of its own here.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_body(
    context: *const PliantContext,
    simulation: PliantSimulation,
    body: *const c_char,
    found: *mut PliantNodes,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            give(found, "found", nodes(running, some_text(body, "body")?)?)
        })
    }
}

/// Positions of nodes [m].
pub const PLIANT_POSITION: u32 = 0;
/// Displacements of nodes [m].
pub const PLIANT_DISPLACEMENT: u32 = 1;
/// Velocities of nodes [m/s].
pub const PLIANT_VELOCITY: u32 = 2;
/// Positions of nodes at rest [m].
pub const PLIANT_REST: u32 = 3;

/// Copies positions, displacements, velocities (`PLIANT_POSITION`, …) of the nodes of a body by name; null is
/// all bodies.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_nodes(
    context: *const PliantContext,
    simulation: PliantSimulation,
    body: *const c_char,
    what: u32,
    buffer: PliantBuffer,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            let PliantNodes { first, count } = nodes(running, some_text(body, "body")?)?;
            if what > PLIANT_REST {
                let message = format!(
                    "node values have no kind {what}: take PLIANT_POSITION or another constant for nodes"
                );
                return Err(Fault::new(PliantStatus::NotANumber, message));
            }
            let writer = buffer.writer(count as usize)?;
            if what == PLIANT_VELOCITY {
                running.look()?
            } else {
                running.see_places()?
            }
            let simulation = &running.simulation;
            let mut node = 0;
            for (part, now) in simulation.setup().parts.iter().zip(simulation.instants()) {
                for (local, rest) in part.model.rest.iter().enumerate() {
                    if (first..first + count).contains(&node) {
                        let moved = || now.displacement(local);
                        let value = match what {
                            PLIANT_REST => *rest,
                            PLIANT_DISPLACEMENT => moved(),
                            PLIANT_VELOCITY => now.velocity(local),
                            _ => {
                                let moved = moved();
                                [0, 1, 2].map(|c| rest[c] + moved[c])
                            }
                        };
                        writer.put((node - first) as usize, value);
                    }
                    node += 1;
                }
            }
            Ok(())
        })
    }
}

/// Fields are read at the points of a body's mesh: fields of elements are means of the elements around each
/// point.
pub const PLIANT_AT_POINTS: u32 = 0;
/// Fields are read in the elements, as computed.
pub const PLIANT_AT_CELLS: u32 = 1;

/// Copies a field, such as `von-mises`, of a body or a surface that one carries, by name; null is the only
/// body. Fields have the names, units and components of `data` in the scene. `items` and `components`, if not
/// null, get how many items there are, and numbers in each; with a null buffer nothing else is given. A field
/// that a body does not have is NaN there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_field(
    context: *const PliantContext,
    simulation: PliantSimulation,
    on: *const c_char,
    name: *const c_char,
    at: u32,
    buffer: PliantBuffer,
    items: *mut usize,
    components: *mut usize,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            let (on, name) = (some_text(on, "on")?, text(name, "name")?);
            let bodies = names(running, PLIANT_BODIES)?;
            let on = match (on, &bodies[..]) {
                (Some(on), _) => on,
                (None, [only]) => only,
                (None, choices) => {
                    let message = format!("there are several bodies: name one of {}", choices.join(", "));
                    return Err(Fault::new(PliantStatus::Unknown, message));
                }
            };
            let known = |open: &OpenField| (open.on.as_str(), open.name.as_str(), open.at) == (on, name, at);
            let place = match running.fields.iter().position(known) {
                Some(place) => place,
                None => {
                    let kind = match at {
                        PLIANT_AT_POINTS => At::Points,
                        PLIANT_AT_CELLS => At::Cells,
                        other => {
                            let message =
                                format!("`at` is {other}: take PLIANT_AT_POINTS (0) or PLIANT_AT_CELLS (1)");
                            return Err(Fault::new(PliantStatus::NotANumber, message));
                        }
                    };
                    let reader = FieldReader::new(&running.world, Some(on), name, kind);
                    let reader =
                        reader.map_err(|failure| Fault::new(PliantStatus::Unknown, failure.message))?;
                    running.fields.push(OpenField { on: on.to_owned(), name: name.to_owned(), at, reader });
                    running.fields.len() - 1
                }
            };
            running.look()?;
            running.compute(|now| now.fields[place].reader.fill(now.world, now.simulation));
            let reader = &running.fields[place].reader;
            let values =
                reader.values().map_err(|failure| Fault::new(PliantStatus::Unknown, failure.message))?;
            let width = reader.components();
            if !items.is_null() {
                give(items, "items", values.len() / width)?;
            }
            if !components.is_null() {
                give(components, "components", width)?;
            }
            if buffer.data.is_null() && buffer.count == 0 {
                return Ok(());
            }
            buffer.write_all(&values, width)
        })
    }
}

/// Gives the force [N] by which a constraint holds or moves its nodes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_reaction(
    context: *const PliantContext,
    simulation: PliantSimulation,
    constraint: *const c_char,
    force: *mut [f64; 3],
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            needed(force, "force")?;
            let name = text(constraint, "constraint")?;
            running.look()?;
            let found = running.simulation.frame()?.reaction(name);
            give(
                force,
                "force",
                found.ok_or_else(|| unknown(running, PLIANT_CONSTRAINTS, "constraint", name))?,
            )
        })
    }
}

/// Gives the force [N] of a contact with an obstacle or a tool on this; of two bodies, on the second one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_contact_force(
    context: *const PliantContext,
    simulation: PliantSimulation,
    contact: *const c_char,
    force: *mut [f64; 3],
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            needed(force, "force")?;
            let name = text(contact, "contact")?;
            running.look()?;
            let found = running.simulation.frame()?.contact_force(name);
            give(force, "force", found.ok_or_else(|| unknown(running, PLIANT_CONTACTS, "contact", name))?)
        })
    }
}

/// Energies of all bodies [J].
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PliantEnergies {
    /// Energy of motion.
    pub kinetic: f64,
    /// Stored in elements, and taken by laws that relax.
    pub internal: f64,
    /// Taken by damping.
    pub damping: f64,
    /// Energy of the stiffness against hourglass modes, in addition to `internal`.
    pub hourglass: f64,
    /// Work from outside.
    pub external: f64,
    /// Energy added by explicit steps of changing length.
    pub step_changes: f64,
    /// Error of the energy balance over the largest energy so far: above 0.05 a run is questionable.
    pub balance: f64,
}

/// Gives the energies.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_energies(
    context: *const PliantContext,
    simulation: PliantSimulation,
    energies: *mut PliantEnergies,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            running.look()?;
            let Energies { kinetic, internal, damping, hourglass, external, step_changes, balance } =
                running.simulation.energies();
            let values =
                PliantEnergies { kinetic, internal, damping, hourglass, external, step_changes, balance };
            give(energies, "energies", values)
        })
    }
}

/// Gives a fingerprint of the motion: the same bits have the same one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_fingerprint(
    context: *const PliantContext,
    simulation: PliantSimulation,
    fingerprint: *mut u64,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            running.see_places()?;
            give(fingerprint, "fingerprint", running.simulation.fingerprint())
        })
    }
}
