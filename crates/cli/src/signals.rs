//! Signals that stop a run: Ctrl-C, and on Unix SIGTERM and SIGHUP. The run stops after its step, or within a
//! long one, and writes its final outputs.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock};

use pliant_sim::StopFlag;

/// The number of Ctrl-C's signal.
const INTERRUPT: usize = 2;

struct Asked {
    stop: StopFlag,
    signal: Arc<AtomicUsize>,
}

static ASKED: LazyLock<Asked> = LazyLock::new(|| {
    let asked = Asked { stop: StopFlag::default(), signal: Arc::new(AtomicUsize::new(INTERRUPT)) };
    let stop = asked.stop.clone();
    // Without a handler, Ctrl-C ends the process as usual, and written files stay readable.
    let _ = ctrlc::set_handler(move || {
        if stop.ask() {
            std::process::exit(128 + INTERRUPT as i32);
        }
    });
    #[cfg(unix)]
    unix::heed(&asked);
    asked
});

/// Files that grow beyond the limit of their size then end in an error that names them, not in the end of the
/// process.
pub(crate) fn outlive_large_files() {
    #[cfg(unix)]
    {
        let seen = Arc::default();
        let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, seen);
    }
}

/// Set by a stop signal. A second Ctrl-C or SIGTERM ends the process immediately.
pub fn stop() -> &'static StopFlag {
    &ASKED.stop
}

/// The exit code of a stopped process: 128 + the signal number, as in shells.
pub(crate) fn exit_code() -> u8 {
    128 + ASKED.signal.load(Ordering::Relaxed) as u8
}

#[cfg(unix)]
mod unix {
    use std::fs;

    use signal_hook::consts::{SIGHUP, SIGTERM};
    use signal_hook::flag;

    use super::Asked;

    /// Handles SIGTERM and SIGHUP in the same way. Without a handler, they end the process as usual.
    pub(crate) fn heed(asked: &Asked) {
        // A closing terminal may send SIGHUP twice; a second SIGTERM is deliberate.
        let _ = flag::register_conditional_shutdown(SIGTERM, 128 + SIGTERM, asked.stop.shared());
        for signal in [SIGTERM, SIGHUP] {
            if signal == SIGHUP && !is_heeded(signal) {
                continue;
            }
            let _ = flag::register_usize(signal, asked.signal.clone(), signal as usize);
            let _ = flag::register(signal, asked.stop.shared());
        }
    }

    /// True if a signal is not ignored: `nohup` ignores SIGHUP, which must stay ignored.
    fn is_heeded(signal: i32) -> bool {
        let ignored = fs::read_to_string("/proc/self/status").ok().and_then(|status| {
            let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"))?;
            u64::from_str_radix(mask.trim(), 16).ok()
        });
        ignored.is_some_and(|mask| mask >> (signal - 1) & 1 == 0)
    }
}
