//! Any bytes as an image of any format: an image or an error, never a panic, no memory beyond the bytes.
//! `cargo +nightly fuzz run image -- -rss_limit_mb=512` (seeds: `crates/imaging/tests/corpus`).

#![no_main]

use libfuzzer_sys::fuzz_target;
use pliant_imaging::{ImageFormat, ReadOptions, read_bytes};

fuzz_target!(|bytes: &[u8]| {
    let formats = ImageFormat::FILES.iter().chain([&ImageFormat::Dicom]);
    for &format in formats {
        if let Ok(image) = read_bytes(bytes, format, &ReadOptions::default()) {
            let _ = image.labels().map(|labels| labels.regions());
        }
    }
});
