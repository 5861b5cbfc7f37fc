//! Locks of things that are open.

use std::sync::{Mutex, MutexGuard, TryLockError};

use crate::status::{Fault, PliantStatus};

/// A value that only one thread may use at a time; a second thread gets an answer at once.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> Result<MutexGuard<'_, T>, Fault> {
    mutex.try_lock().map_err(|error| match error {
        TryLockError::WouldBlock => {
            Fault::new(PliantStatus::Busy, "another thread has a call on this handle under way")
        }
        TryLockError::Poisoned(_) => {
            Fault::new(PliantStatus::Internal, "an earlier call on this handle panicked")
        }
    })
}
