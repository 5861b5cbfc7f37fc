//! Scenes without the binary. One program holds all files here; run the tests of a file with
//! `cargo test -p pliant-run --test scene grips::`.

mod angioplasty;
mod barrier_curved;
mod barrier_fields;
mod barriers;
mod bars;
mod collective;
mod contact;
mod contact_distance;
mod contact_fields;
mod contact_ways;
mod corpus;
mod coupled_surfaces;
mod doubts;
mod force_limit;
mod forged;
mod grasper;
mod grips;
mod hollows;
mod hourglass;
mod led;
mod looks;
mod mortar;
mod niftysim;
mod niftysim_contact;
mod obstacles;
mod participants;
mod penalty;
mod pressure_limit;
mod random_stops;
mod starts;
mod static_solids;
mod ties;
mod torques;
mod turns;
mod volumes;
mod walls;

/// Panics unless a scene is refused, in words that contain all pieces.
#[track_caller]
fn assert_refused(text: &str, pieces: &[&str]) {
    let message = pliant_testing::scenes::world(text).err().unwrap_or_else(|| panic!("accepted:\n{text}"));
    assert!(pieces.iter().all(|piece| message.contains(piece)), "{message}");
}

#[cfg(feature = "gpu")]
fn has_gpu() -> bool {
    pliant_testing::has_gpu(pliant_sim::gpu::adapters().len())
}
