//! Scenes without the binary. One program for all files here; run those of a file with `cargo test -p pliant-run --test scene grips::`.

mod barriers;
mod bars;
mod collective;
mod contact;
mod contact_fields;
mod corpus;
mod force_limit;
mod grasper;
mod grips;
mod niftysim;
mod niftysim_contact;
mod obstacles;
mod participants;
mod penalty;
mod static_solids;
mod ties;
mod volumes;
mod walls;

/// Whether there is a GPU. Without any a test is skipped with a notice, or fails where `PLIANT_REQUIRE_GPU=1`.
#[cfg(feature = "gpu")]
fn has_gpu() -> bool {
    use std::io::Write;
    let required = std::env::var("PLIANT_REQUIRE_GPU").as_deref() == Ok("1");
    if required || !pliant_sim::gpu::adapters().is_empty() {
        return true;
    }
    // Past the capture of what passing tests print. A notice that can't be written is none.
    let _ = writeln!(std::io::stderr(), "skipped: no GPU was found");
    false
}
