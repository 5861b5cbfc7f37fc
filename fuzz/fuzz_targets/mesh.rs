//! Any bytes as a mesh of any format: a mesh or an error, never a panic, no memory beyond the bytes.
//! `cargo +nightly fuzz run mesh -- -rss_limit_mb=512` (seeds: `crates/geometry/tests/data`).

#![no_main]

use libfuzzer_sys::fuzz_target;
use pliant_geometry::io::{Format, read_bytes};

fuzz_target!(|bytes: &[u8]| {
    for &format in Format::ALL {
        let _ = read_bytes(bytes, format);
    }
});
