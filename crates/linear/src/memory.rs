//! Arrays whose size does not follow from the size of a mesh alone, such as factors of equations. A lack of
//! room for them is an error, not the end of the program.
//!
//! ```
//! use pliant_linear::memory::zeros;
//!
//! assert_eq!(zeros(3)?, [0.0; 3]);
//! assert!(zeros(usize::MAX / 16).is_err());
//! # Ok::<(), pliant_linear::memory::OutOfMemory>(())
//! ```

use std::fs;

/// Arrays from this many bytes on are compared with the memory that is free.
const LARGE: u64 = 1 << 28;

/// An array that the system has no room for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{} of memory are needed{}", in_words(*bytes), told_free(*free))]
pub struct OutOfMemory {
    /// Bytes that were asked for.
    pub bytes: u64,
    /// Bytes that were free, where that is known.
    pub free: Option<u64>,
}

fn told_free(free: Option<u64>) -> String {
    free.map_or_else(
        || ", more than the system gives".into(),
        |free| format!(", {} are free", in_words(free)),
    )
}

/// A number of bytes in a unit that suits it: `8.6 GB`.
pub fn in_words(bytes: u64) -> String {
    let bytes = bytes as f64;
    match bytes {
        1e12.. => format!("{:.1} TB", bytes / 1e12),
        1e9.. => format!("{:.1} GB", bytes / 1e9),
        1e6.. => format!("{:.0} MB", bytes / 1e6),
        _ => format!("{:.0} kB", bytes / 1e3),
    }
}

/// Bytes of memory that are free, or would be without the system's copies of files; `None` where the system
/// does not say.
pub fn free() -> Option<u64> {
    let meminfo = fs::read_to_string("/proc/meminfo").ok()?;
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

/// Asks the system for a number of bytes and gives them back. A caller asks for the least that a mesh needs
/// before it makes the arrays of the mesh.
///
/// # Errors
/// If the system has no room.
pub fn room_for(bytes: u64) -> Result<(), OutOfMemory> {
    reserved::<u8>(usize::try_from(bytes).unwrap_or(usize::MAX)).map(|_| ())
}

/// An array of `count` zeros.
///
/// # Errors
/// If the system has no room for them.
pub fn zeros(count: usize) -> Result<Vec<f64>, OutOfMemory> {
    let mut array = reserved(count)?;
    array.resize(count, 0.0);
    Ok(array)
}

/// An empty array with room for `count` entries.
fn reserved<T>(count: usize) -> Result<Vec<T>, OutOfMemory> {
    let bytes = (count as u64).saturating_mul(size_of::<T>() as u64);
    // Linux gives more than it has, and ends the program that uses it.
    if bytes > LARGE
        && let Some(free) = free().filter(|&free| free < bytes)
    {
        return Err(OutOfMemory { bytes, free: Some(free) });
    }
    let mut array = Vec::new();
    array.try_reserve_exact(count).map_err(|_| OutOfMemory { bytes, free: None })?;
    Ok(array)
}
