//! Work that takes a while: it runs on threads of the engine, without the interpreter, and signals are looked at.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;

use crate::errors::{Trouble, told};

/// Time between two looks at signals.
const SLICE: Duration = Duration::from_millis(50);

/// Runs a job on a pool. What a signal raises ends it through `stop`, is waited for, and then raised; the result comes with it.
pub fn on_pool<T: Send + 'static>(
    py: Python<'_>,
    pool: &rayon::ThreadPool,
    stop: &AtomicBool,
    job: impl FnOnce() -> T + Send + 'static,
) -> Result<(T, PyResult<()>), Trouble> {
    stop.store(false, Ordering::Relaxed);
    let (sender, receiver) = channel();
    let receiver = Mutex::new(receiver);
    pool.spawn(move || {
        // A caller that is gone needs no result.
        let _ = sender.send(job());
    });
    let mut signal = Ok(());
    loop {
        match wait(py, &receiver) {
            Ok(result) => return Ok((result, signal)),
            Err(RecvTimeoutError::Timeout) => {
                if signal.is_ok()
                    && let Err(raised) = py.check_signals()
                {
                    stop.store(true, Ordering::Relaxed);
                    signal = Err(raised);
                }
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(Trouble::Internal("a thread of the engine ended without an answer".into()));
            }
        }
    }
}

/// Runs a job on a thread of its own. After a signal it goes on alone, and its result is dropped.
pub fn on_thread<T: Send + 'static>(
    py: Python<'_>,
    job: impl FnOnce() -> Result<T, Trouble> + Send + 'static,
) -> PyResult<T> {
    let (sender, receiver) = channel();
    let receiver = Mutex::new(receiver);
    let run = move || {
        let done = catch_unwind(AssertUnwindSafe(job));
        let _ = sender.send(done.unwrap_or_else(|panic| Err(Trouble::Internal(told(&*panic)))));
    };
    std::thread::Builder::new().name("pliant".into()).spawn(run).map_err(crate::errors::broken)?;
    loop {
        match wait(py, &receiver) {
            Ok(result) => return Ok(result?),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => {
                return Err(Trouble::Internal("a thread of the engine ended without an answer".into()).into());
            }
        }
    }
}

/// Waits for a slice of time without the interpreter.
fn wait<T: Send>(py: Python<'_>, receiver: &Mutex<Receiver<T>>) -> Result<T, RecvTimeoutError> {
    py.detach(|| receiver.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(SLICE))
}
