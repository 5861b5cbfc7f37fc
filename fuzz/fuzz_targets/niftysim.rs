//! Any bytes as a NiftySim model: a scene that can be read or an error, never a panic.
//! `cargo +nightly fuzz run niftysim -- -rss_limit_mb=512` (seeds: `crates/run/tests/corpus`).

#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use pliant_scene::niftysim::import_bytes;
use pliant_scene::source::Source;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(imported) = import_bytes(Path::new("nowhere/model.xml"), bytes) {
        Source::parse("scene.toml", imported.scene).expect("a scene that can be read");
    }
});
