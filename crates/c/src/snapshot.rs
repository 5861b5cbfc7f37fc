//! Snapshots: states of a simulation to go back to, in memory or as bytes.

use std::sync::Arc;

use pliant_run::{snapshot_from_bytes, snapshot_to_bytes};

use crate::context::{Item, PliantContext, call};
use crate::open::OpenSnapshot;
use crate::pointers::{array, give, give_bytes, needed};
use crate::simulation::{PliantSimulation, running};
use crate::status::{Fault, PliantError, PliantStatus};

/// A snapshot that is open: a number that `pliant_snapshot_take` gives, never 0.
pub type PliantSnapshot = u64;

/// A context that is not null.
///
/// # Safety
/// It is null or a context.
unsafe fn known<'a>(context: *const PliantContext) -> Result<&'a PliantContext, Fault> {
    // SAFETY: as the caller promises.
    unsafe { context.as_ref() }.ok_or_else(|| Fault::new(PliantStatus::Null, "the context is null"))
}

/// Keeps the state of a simulation, at any instant. Nothing that follows is changed by it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_snapshot_take(
    context: *const PliantContext,
    simulation: PliantSimulation,
    snapshot: *mut PliantSnapshot,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            needed(snapshot, "snapshot")?;
            let (setup, state) = (Arc::clone(running.simulation.setup()), running.simulation.state()?);
            let item = Item::Snapshot(Arc::new(OpenSnapshot { setup, state }));
            give(snapshot, "snapshot", known(context)?.open(item))
        })
    }
}

/// Takes a simulation back, or on, to a snapshot: of itself, or of another simulation of the same scene. What
/// follows has the same bits as it had. Grips and forces of the program stay.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_snapshot_restore(
    context: *const PliantContext,
    simulation: PliantSimulation,
    snapshot: PliantSnapshot,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            let snapshot = known(context)?.snapshot(snapshot)?;
            if !Arc::ptr_eq(&snapshot.setup, running.simulation.setup()) {
                // Of another simulation, it has to be one of this model.
                let bytes = snapshot_to_bytes(&snapshot.setup, &snapshot.state)?;
                snapshot_from_bytes(running.simulation.setup(), &bytes)
                    .map_err(|failure| Fault::new(PliantStatus::BadSnapshot, failure.message))?;
            }
            running.compute(|now| now.simulation.restore(snapshot.state.clone()))?;
            running.held.put_on(&mut running.simulation)
        })
    }
}

/// Copies a snapshot as bytes, for a file or another process. `length`, if it is not null, gets how many
/// there are; with a null buffer of 0 bytes nothing else is given.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_snapshot_bytes(
    context: *const PliantContext,
    snapshot: PliantSnapshot,
    buffer: *mut u8,
    capacity: usize,
    length: *mut usize,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        call(context, snapshot, error, |context| {
            let snapshot = context.snapshot(snapshot)?;
            let bytes = snapshot_to_bytes(&snapshot.setup, &snapshot.state)?;
            give_bytes(&bytes, buffer, capacity, length, false)
        })
    }
}

/// Reads a snapshot of a simulation of the same scene from bytes. Other and damaged snapshots give
/// `PLIANT_STATUS_BAD_SNAPSHOT`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_snapshot_read(
    context: *const PliantContext,
    simulation: PliantSimulation,
    bytes: *const u8,
    count: usize,
    snapshot: *mut PliantSnapshot,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            needed(snapshot, "snapshot")?;
            let setup = Arc::clone(running.simulation.setup());
            let state = snapshot_from_bytes(&setup, array(bytes, count, "bytes")?)
                .map_err(|failure| Fault::new(PliantStatus::BadSnapshot, failure.message))?;
            let item = Item::Snapshot(Arc::new(OpenSnapshot { setup, state }));
            give(snapshot, "snapshot", known(context)?.open(item))
        })
    }
}

/// Closes a snapshot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_snapshot_close(
    context: *const PliantContext,
    snapshot: PliantSnapshot,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        call(context, snapshot, error, |context| {
            context.snapshot(snapshot)?;
            context.close(snapshot)
        })
    }
}
