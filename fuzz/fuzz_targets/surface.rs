//! Any bytes as a surface to fill: a body or an error, never a panic.
//! `cargo +nightly fuzz run surface -- -rss_limit_mb=1024` (seeds: `crates/geometry/tests/data`).

#![no_main]

use libfuzzer_sys::fuzz_target;
use pliant_geometry::io::{Format, read_bytes};
use pliant_meshing::{Closing, Enclosed};

fuzz_target!(|bytes: &[u8]| {
    for &format in Format::ALL {
        let Ok(file) = read_bytes(bytes, format) else { continue };
        let size = file.mesh.bounds().map_or(0.0, |(low, high)| (high - low).norm());
        let closing = Closing { holes: size, ..Closing::default() };
        if let Ok(body) = Enclosed::new(&file.mesh, size / 8.0, &closing) {
            let _ = body.field(size / 8.0, &|_| {});
        }
    }
});
