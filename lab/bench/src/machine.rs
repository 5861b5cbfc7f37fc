//! The machine of a measurement.

use std::fs;
use std::thread;

use serde::Serialize;

/// A machine, in words.
#[derive(Clone, Debug, Serialize)]
pub struct Machine {
    /// The processor's model.
    pub processor: String,
    /// Cores that may be used.
    pub cores: usize,
    /// The operating system.
    pub system: String,
}

impl Machine {
    /// This machine, as reported by its system.
    pub fn this() -> Self {
        let entry = |file: &str, key: &str, separator: char| {
            let text = fs::read_to_string(file).ok()?;
            let (_, value) = text.lines().find(|line| line.starts_with(key))?.split_once(separator)?;
            Some(value.trim().trim_matches('"').to_owned())
        };
        Self {
            processor: entry("/proc/cpuinfo", "model name", ':')
                .unwrap_or_else(|| std::env::consts::ARCH.to_owned()),
            cores: thread::available_parallelism().map_or(1, usize::from),
            system: entry("/etc/os-release", "PRETTY_NAME", '=')
                .unwrap_or_else(|| std::env::consts::OS.to_owned()),
        }
    }
}
