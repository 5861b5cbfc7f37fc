//! Simulations under way: made of a scene, stepped, and asked for numbers.

use std::ffi::c_char;
use std::sync::Arc;

use pliant_format::tables::MOST_THREADS;
use pliant_sim::{Simulation, StopFlag};
use rayon::ThreadPoolBuilder;

use crate::context::{Item, PliantContext, call};
use crate::lock::lock;
use crate::open::{Held, Running, Shared};
use crate::pointers::{array, finite, give, give_bytes, needed};
use crate::scene::PliantScene;
use crate::status::{Fault, PliantError, PliantStatus};

/// A simulation that is open: a number that `pliant_simulation_open` gives, never 0.
pub type PliantSimulation = u64;

/// A call about a simulation that no other thread has a call on.
///
/// # Safety
/// As [`call`].
pub(crate) unsafe fn running(
    context: *const PliantContext,
    simulation: PliantSimulation,
    error: *mut PliantError,
    what: impl FnOnce(&mut Running) -> Result<(), Fault>,
) -> PliantStatus {
    // SAFETY: as the caller promises.
    unsafe {
        call(context, simulation, error, |context| {
            let shared = context.simulation(simulation)?;
            let mut running = shared.lock()?;
            what(&mut running)
        })
    }
}

/// Makes a simulation of a scene as it is now, at its start. It computes on threads of its own, 1024 at most;
/// with 0 it takes `threads` of the scene's `[run]`. Results do not depend on their number. Images are meshed
/// and shapes built here: this can take seconds.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_simulation_open(
    context: *const PliantContext,
    scene: PliantScene,
    threads: u32,
    simulation: *mut PliantSimulation,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        call(context, scene, error, |context| {
            needed(simulation, "simulation")?;
            let scene = context.scene(scene)?;
            let world = Arc::new(lock(&scene)?.world()?);
            if threads > MOST_THREADS {
                let message = format!(
                    "`threads` is {threads}: it must be at most {MOST_THREADS}, or 0 for the number in the scene"
                );
                return Err(Fault::new(PliantStatus::Unsupported, message));
            }
            let threads = if threads == 0 { world.scene.run.threads as usize } else { threads as usize };
            let pool = ThreadPoolBuilder::new().num_threads(threads).build();
            let pool = pool.map_err(|error| Fault::new(PliantStatus::Unsupported, error.to_string()))?;
            let mut made = pool.install(|| world.simulation())?;
            let stopped = StopFlag::default();
            made.stop_on(&stopped);
            let running = Running {
                world,
                simulation: made,
                pool,
                surfaces: Vec::new(),
                fields: Vec::new(),
                held: Held::default(),
            };
            let shared = Arc::new(Shared::new(running, stopped));
            give(simulation, "simulation", context.open(Item::Simulation(shared)))
        })
    }
}

/// Closes a simulation. One that is stepped by another thread is stopped first; its memory goes when that
/// call returns.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_simulation_close(
    context: *const PliantContext,
    simulation: PliantSimulation,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        call(context, simulation, error, |context| {
            context.simulation(simulation)?;
            context.close(simulation)
        })
    }
}

/// Time, step and sizes of a simulation.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PliantNow {
    /// Time [s].
    pub time: f64,
    /// Length [s] of the next step.
    pub step: f64,
    /// Steps since the start.
    pub steps: u64,
    /// Nodes of all bodies.
    pub nodes: u64,
}

/// Reports time, step and sizes of a simulation.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_now(
    context: *const PliantContext,
    simulation: PliantSimulation,
    now: *mut PliantNow,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            let Running { simulation, .. } = &*running;
            let [time, step] = [simulation.time(), simulation.step_length()];
            give(
                now,
                "now",
                PliantNow { time, step, steps: simulation.steps(), nodes: running.nodes() as u64 },
            )
        })
    }
}

/// Takes `count` steps. `done`, if it is not null, gets the number of steps taken, also after a failure or a
/// stop from another thread. After a failure the simulation stands at the last good instant; restore a
/// snapshot, or close it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_step(
    context: *const PliantContext,
    simulation: PliantSimulation,
    count: u64,
    done: *mut u64,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe { go(context, simulation, done, error, |_, taken| Ok(count - taken)) }
}

/// Steps to the instant nearest to a time [s], like `pliant_step`. A time that has passed takes no step.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_run_until(
    context: *const PliantContext,
    simulation: PliantSimulation,
    time: f64,
    done: *mut u64,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        go(context, simulation, done, error, |now, _| {
            finite(&[time], "time")?;
            Ok(now.steps_until(time).min(MOST_STEPS))
        })
    }
}

/// Steps at most between two looks at the stop flag where many are taken at once: on a GPU.
const MOST_STEPS: u64 = 10_000;

/// Takes steps until none are left.
///
/// # Safety
/// As [`call`]; `done` is null or may be written.
unsafe fn go(
    context: *const PliantContext,
    simulation: PliantSimulation,
    done: *mut u64,
    error: *mut PliantError,
    left: impl Fn(&Simulation, u64) -> Result<u64, Fault> + Sync,
) -> PliantStatus {
    let mut taken = 0;
    // SAFETY: as the caller promises.
    let status = unsafe {
        call(context, simulation, error, |context| {
            let shared = context.simulation(simulation)?;
            let mut running = shared.lock()?;
            let stopped = &shared.stopped;
            let (now, result) = running.compute(|computing| {
                let mut taken = 0;
                let halted = || Fault::new(PliantStatus::Stopped, "another thread asked to stop");
                let mut step = || {
                    while let more @ 1.. = left(computing.simulation, taken)? {
                        if stopped.is_asked() {
                            return Err(halted());
                        }
                        if computing.simulation.ended().is_some() {
                            break;
                        }
                        taken += computing.simulation.step(more).map_err(|failure| {
                            if failure.is_interrupted() { halted() } else { failure.into() }
                        })?;
                    }
                    Ok(())
                };
                let result = step();
                // Who asked while this call took its last step meant this call.
                if taken > 0 || result.is_err() {
                    stopped.clear();
                }
                (taken, result)
            });
            taken = now;
            result
        })
    };
    if !done.is_null() {
        // SAFETY: it is not null, and the caller promises the rest.
        unsafe { done.write_unaligned(taken) };
    }
    status
}

/// Asks the thread that steps a simulation to stop after its step. A step that takes long is abandoned, and
/// the simulation stays at the instant before. Without such a thread, the next call that steps returns at
/// once. Any thread may ask.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_stop(
    context: *const PliantContext,
    simulation: PliantSimulation,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        call(context, simulation, error, |context| {
            context.simulation(simulation)?.stop();
            Ok(())
        })
    }
}

/// Pushes nodes with forces [N], three numbers a node, in the order of `pliant_body`, until they are
/// replaced; their work is external. `count` is the number of nodes of all bodies, or 0 to end all.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_push(
    context: *const PliantContext,
    simulation: PliantSimulation,
    forces: *const f64,
    count: usize,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            let numbers = array(forces, count.saturating_mul(3), "forces")?;
            finite(numbers, "forces")?;
            let (forces, nodes) = (numbers.as_chunks().0, running.nodes());
            if count > 0 && count != nodes {
                let message = format!("{count} forces are given, but {nodes} are needed: one for each node");
                return Err(Fault::new(PliantStatus::ShortBuffer, message));
            }
            running
                .simulation
                .push(forces)
                .map_err(|failure| Fault::new(PliantStatus::Unsupported, failure.message))
        })
    }
}

/// Bodies, as the kind of a name.
pub const PLIANT_BODIES: u32 = 0;
/// Surfaces that bodies carry.
pub const PLIANT_SURFACES: u32 = 1;
/// Constraints.
pub const PLIANT_CONSTRAINTS: u32 = 2;
/// Contacts.
pub const PLIANT_CONTACTS: u32 = 3;
/// Tools and obstacles.
pub const PLIANT_TOOLS: u32 = 4;
/// Warnings about the scene, a sentence each.
pub const PLIANT_WARNINGS: u32 = 5;

/// Gives the name of a thing of a kind (`PLIANT_BODIES`, …) by its number from 0, with a zero at its end;
/// `PLIANT_STATUS_UNKNOWN` after the last. `length`, if it is not null, gets the bytes without the zero; with
/// a null buffer of 0 bytes nothing else is given.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_name(
    context: *const PliantContext,
    simulation: PliantSimulation,
    kind: u32,
    index: usize,
    buffer: *mut c_char,
    capacity: usize,
    length: *mut usize,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            let names = names(running, kind)?;
            let Some(name) = names.get(index) else {
                let message = format!("there are only {} of this kind", names.len());
                return Err(Fault::new(PliantStatus::Unknown, message));
            };
            give_bytes(name.as_bytes(), buffer.cast(), capacity, length, true)
        })
    }
}

/// The names of all things of a kind.
pub(crate) fn names(running: &Running, kind: u32) -> Result<Vec<String>, Fault> {
    let parts = || running.simulation.setup().parts.iter();
    let models = || parts().map(|part| &part.model);
    let contacts = || parts().filter_map(|part| part.method.contacts());
    let names: Vec<&str> = match kind {
        PLIANT_BODIES => models().flat_map(|model| &model.bodies).map(|body| body.name.as_str()).collect(),
        PLIANT_SURFACES => {
            models().flat_map(|model| &model.surfaces).map(|surface| surface.name.as_str()).collect()
        }
        PLIANT_CONSTRAINTS => {
            models().flat_map(|model| &model.constraints).map(|constraint| constraint.name.as_str()).collect()
        }
        PLIANT_CONTACTS => {
            contacts().flat_map(|set| &set.contacts).map(|contact| contact.name.as_str()).collect()
        }
        PLIANT_TOOLS => contacts().flat_map(|set| &set.rigids).map(|rigid| rigid.tool()).collect(),
        PLIANT_WARNINGS => running.world.warnings().map(|warning| warning.message.as_str()).collect(),
        other => {
            let message =
                format!("names have no kind {other}: take PLIANT_BODIES or another constant for names");
            return Err(Fault::new(PliantStatus::NotANumber, message));
        }
    };
    let mut known = Vec::new();
    for name in names {
        // Jaws of a tool, and tools of several participants, have one name.
        if !known.iter().any(|known| known == name) {
            known.push(name.to_owned());
        }
    }
    Ok(known)
}
