//! Threads of a pool that wait awake for the next parallel part of a step. A thread that sleeps takes 5 to 60 µs to wake, as long as a step
//! of a small model.

use std::cell::Cell;
use std::hint::spin_loop;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use rayon::Yield;

/// A thread stops waiting after so long without work …
const IDLE: Duration = Duration::from_micros(200);
/// … and in any case after so long: its pool may have other things to do.
const LONGEST: Duration = Duration::from_millis(5);
/// Threads are asked again after so long, at the earliest.
const AGAIN: Duration = Duration::from_micros(500);

thread_local! {
    /// When this thread began a step of its own, or to wait for those of another.
    static TAKEN: Cell<Option<Instant>> = const { Cell::new(None) };
}

/// The threads of the current pool that wait awake for a stepper.
#[derive(Default)]
pub(crate) struct Awake {
    waiting: Arc<AtomicUsize>,
    asked: Option<Instant>,
}

impl Awake {
    /// Asks the other threads of the pool to wait awake where they do not, unless they step other things.
    pub(crate) fn keep(&mut self) {
        let (Some(own), others) = (rayon::current_thread_index(), rayon::current_num_threads() - 1) else {
            return;
        };
        if others == 0 {
            return;
        }
        let now = Instant::now();
        TAKEN.set(Some(now));
        let is_early = self.asked.is_some_and(|asked| now - asked < AGAIN);
        if is_early || self.waiting.load(Ordering::Relaxed) > 0 {
            return;
        }
        self.asked = Some(now);
        self.waiting.store(others, Ordering::Relaxed);
        let waiting = Arc::clone(&self.waiting);
        rayon::spawn_broadcast(move |context| {
            if context.index() != own {
                wait();
                waiting.fetch_sub(1, Ordering::Relaxed);
            }
        });
    }
}

/// Works for the pool as long as there is enough to do.
fn wait() {
    let begun = Instant::now();
    if TAKEN.get().is_some_and(|taken| begun - taken < LONGEST) {
        return;
    }
    let mut worked = begun;
    loop {
        TAKEN.set(Some(begun));
        let now = match rayon::yield_now() {
            Some(Yield::Executed) => {
                worked = Instant::now();
                worked
            }
            _ => {
                (0..32).for_each(|_| spin_loop());
                Instant::now()
            }
        };
        if now - worked > IDLE || now - begun > LONGEST {
            break;
        }
    }
    TAKEN.set(None);
}
