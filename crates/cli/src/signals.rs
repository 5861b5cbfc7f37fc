//! What asks a run to end: Ctrl-C, and on Unix SIGTERM and SIGHUP. It ends after its step, with all that it writes at its end.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock};

/// The number of Ctrl-C's signal.
const INTERRUPT: usize = 2;

struct Asked {
    stop: Arc<AtomicBool>,
    signal: Arc<AtomicUsize>,
}

static ASKED: LazyLock<Asked> = LazyLock::new(|| {
    let asked = Asked { stop: Arc::default(), signal: Arc::new(AtomicUsize::new(INTERRUPT)) };
    let stop = asked.stop.clone();
    // Where no handler can be set, Ctrl-C ends the process as ever, and what was written stays readable.
    let _ = ctrlc::set_handler(move || {
        if stop.swap(true, Ordering::Relaxed) {
            std::process::exit(128 + INTERRUPT as i32);
        }
    });
    #[cfg(unix)]
    unix::heed(&asked);
    asked
});

/// Set when a signal asks for the end. Ctrl-C or SIGTERM once more ends the process at once.
pub fn stop() -> &'static AtomicBool {
    &ASKED.stop
}

/// The exit code of a process that was asked to end: 128 and the number of the signal, as shells count.
pub fn exit_code() -> u8 {
    128 + ASKED.signal.load(Ordering::Relaxed) as u8
}

#[cfg(unix)]
mod unix {
    use std::fs;

    use signal_hook::consts::{SIGHUP, SIGTERM};
    use signal_hook::flag;

    use super::Asked;

    /// Has SIGTERM and SIGHUP ask, too. Where no handler can be set, they end the process as ever.
    pub fn heed(asked: &Asked) {
        // A terminal that closes may send SIGHUP twice; whoever sends SIGTERM twice means it.
        let _ = flag::register_conditional_shutdown(SIGTERM, 128 + SIGTERM, asked.stop.clone());
        for signal in [SIGTERM, SIGHUP] {
            if signal == SIGHUP && !is_heeded(signal) {
                continue;
            }
            let _ = flag::register_usize(signal, asked.signal.clone(), signal as usize);
            let _ = flag::register(signal, asked.stop.clone());
        }
    }

    /// Whether a signal is known not to be ignored: `nohup` has SIGHUP ignored, and that is to stay so.
    fn is_heeded(signal: i32) -> bool {
        let ignored = fs::read_to_string("/proc/self/status").ok().and_then(|status| {
            let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"))?;
            u64::from_str_radix(mask.trim(), 16).ok()
        });
        ignored.is_some_and(|mask| mask >> (signal - 1) & 1 == 0)
    }
}
