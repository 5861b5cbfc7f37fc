//! Work that takes a while: it runs on threads of the engine, without the interpreter, and signals are looked
//! at.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError, channel};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use pliant_sim::{StopFlag, panicked};
use pyo3::prelude::*;

use crate::errors::Trouble;

/// Time between two looks at signals.
const SLICE: Duration = Duration::from_millis(50);

/// Runs a job on a pool. An exception from a signal stops the job through `stop`; the call waits for the job
/// and returns the exception with the result.
pub fn on_pool<T: Send + 'static>(
    py: Python<'_>,
    pool: &rayon::ThreadPool,
    stop: &StopFlag,
    job: impl FnOnce() -> T + Send + 'static,
) -> Result<(T, PyResult<()>), Trouble> {
    stop.clear();
    let (sender, receiver) = channel();
    let receiver = Mutex::new(receiver);
    pool.spawn(move || {
        // A caller that is gone needs no result.
        let _ = sender.send(job());
    });
    let mut signal = Ok(());
    let mut awake = AWAKE;
    loop {
        match wait(py, &receiver, std::mem::take(&mut awake)) {
            Ok(result) => return Ok((result, signal)),
            Err(RecvTimeoutError::Timeout) => {
                if signal.is_ok()
                    && let Err(raised) = py.check_signals()
                {
                    stop.ask();
                    signal = Err(raised);
                }
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(Trouble::Internal("a thread of the engine ended without an answer".into()));
            }
        }
    }
}

/// Runs a job on new threads, which a fork has, too. After a signal the job continues, and its result is
/// dropped.
pub fn on_thread<T: Send + 'static>(
    py: Python<'_>,
    job: impl FnOnce() -> Result<T, Trouble> + Send + 'static,
) -> PyResult<T> {
    let (sender, receiver) = channel();
    let receiver = Mutex::new(receiver);
    let pool = rayon::ThreadPoolBuilder::new().thread_name(|_| "pliant".into()).build();
    pool.map_err(crate::errors::broken)?.spawn(move || {
        let done = catch_unwind(AssertUnwindSafe(job));
        let _ =
            sender.send(done.unwrap_or_else(|panic| Err(Trouble::Internal(panicked(&*panic).to_owned()))));
    });
    loop {
        match wait(py, &receiver, Duration::ZERO) {
            Ok(result) => return Ok(result?),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => {
                return Err(Trouble::Internal("a thread of the engine ended without an answer".into()).into());
            }
        }
    }
}

/// Time for which a call waits awake for its result at first. To wake a thread takes longer than a short
/// step, and the thread of the pool goes to sleep meanwhile.
const AWAKE: Duration = Duration::from_micros(200);

/// Waits for a slice of time without the interpreter, at first awake.
fn wait<T: Send>(
    py: Python<'_>,
    receiver: &Mutex<Receiver<T>>,
    awake: Duration,
) -> Result<T, RecvTimeoutError> {
    py.detach(|| {
        let receiver = receiver.lock().unwrap_or_else(PoisonError::into_inner);
        let since = Instant::now();
        while since.elapsed() < awake {
            match receiver.try_recv() {
                Ok(result) => return Ok(result),
                // Others that wait for this core go first.
                Err(TryRecvError::Empty) => std::thread::yield_now(),
                Err(TryRecvError::Disconnected) => return Err(RecvTimeoutError::Disconnected),
            }
        }
        receiver.recv_timeout(SLICE)
    })
}
