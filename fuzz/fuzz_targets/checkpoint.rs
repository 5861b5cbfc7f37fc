//! Any bytes as what a checkpoint holds: a checkpoint or an error, never a panic, no memory beyond the bytes. Head and
//! checksum are put round them, or no change would come past these.
//! `cargo +nightly fuzz run checkpoint -- -rss_limit_mb=512`

#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use pliant_run::Checkpoint;

fuzz_target!(|bytes: &[u8]| {
    let _ = Checkpoint::from_bytes(Path::new("any"), bytes);
    let _ = Checkpoint::from_bytes(Path::new("any"), &Checkpoint::framed(bytes));
});
