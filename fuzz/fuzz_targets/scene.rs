//! Any bytes as a scene file: a scene or mistakes that can be shown, never a panic.
//! `cargo +nightly fuzz run scene -- -rss_limit_mb=512` (seeds: `crates/run/tests/corpus`, `scenes/*/scene.toml`).

#![no_main]

use libfuzzer_sys::fuzz_target;
use pliant_scene::source::Source;
use pliant_scene::Scene;

fuzz_target!(|bytes: &[u8]| {
    let text = String::from_utf8_lossy(bytes).into_owned();
    let read = Source::parse("scene.toml", text).and_then(|source| Scene::from_source(source, ".".into()));
    if let Err(errors) = read {
        assert!(errors.plain().to_string().len() < 1 << 20);
    }
});
