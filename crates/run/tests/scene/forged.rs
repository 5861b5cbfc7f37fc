//! Snapshots and checkpoints with bytes changed at random and a checksum that fits. The run continues or ends
//! with an error, never with a panic, and always ends.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use pliant_explicit::Wanted;
use pliant_run::{
    Checkpoint, Options, OutputFolder, run, run_with, snapshot_framed, snapshot_from_bytes, snapshot_to_bytes,
};
use pliant_scene::World;
use pliant_sim::Simulation;
use pliant_testing::Random;
use pliant_testing::forging::{Attempts, forged};
use pliant_testing::scenes::world;

use super::coupled_surfaces::pressed;
use super::random_stops::ingredients;

/// Bytes of a snapshot and of a checkpoint before the body, and after it.
const HEADS: [usize; 2] = [28, 20];
const CRC: usize = 4;

/// Scenes with all that states have: small cubes of random ingredients, a plate of shells on a block as
/// participants.
fn scenes() -> impl Iterator<Item = String> {
    let small = |text: String| {
        let few = if text.contains("iterations") { "[run]\n" } else { "[run]\niterations = 5\n" };
        let in_time = text.contains("solver = 'implicit'") || text.contains("solver = 'static'");
        text.replace("cells = [3, 3, 2]", "cells = [2, 2, 1]")
            .replace("[run]\n", if in_time { few } else { "[run]\n" })
    };
    let touching = pressed(0.01, 0.1, "").replace("cells = [8, 8, 4]", "cells = [2, 2, 1]");
    let touching = touching.replace("cells = [6, 6]", "cells = [2, 2]");
    (0..60).map(move |seed| small(ingredients(&mut Random::new(seed)))).chain([touching])
}

fn some_steps(world: &World) -> Option<Simulation> {
    let mut simulation = world.simulation().ok()?;
    let steps = (world.steps() / 2).clamp(1, 20);
    (0..steps).try_for_each(|_| simulation.step(1).map(|_| ())).ok()?;
    Some(simulation)
}

fn snapshots(seeds: std::ops::Range<u64>, attempts: &mut Attempts) {
    for (number, text) in scenes().enumerate() {
        let Ok(world) = world(&text) else { continue };
        let Some(mut simulation) = some_steps(&world) else { continue };
        let simulated = Arc::new(world.simulated());
        let whole = snapshot_to_bytes(&simulated, &simulation.state().unwrap()).unwrap();
        let body = &whole[HEADS[0]..whole.len() - CRC];
        for seed in seeds.clone() {
            let seed = 1_000_000 * number as u64 + seed;
            let bytes = snapshot_framed(&simulated, &forged(&mut Random::new(seed), body));
            attempts.attempt(seed, || {
                let Ok(state) = snapshot_from_bytes(&simulated, &bytes) else { return false };
                let Ok(mut simulation) = Simulation::resumed(Arc::clone(&simulated), state) else {
                    return false;
                };
                let went = match seed % 4 {
                    0 => simulation.step(1).map(|_| ()),
                    _ => simulation.evaluate(Wanted::Everything),
                };
                let _ = (simulation.energies(), simulation.fingerprint(), simulation.encode());
                let _ = simulation.state().map(|state| snapshot_to_bytes(&simulated, &state).map(|_| ()));
                went.is_ok()
            });
        }
        println!("scene {number}: {attempts}");
    }
}

/// Runs that are taken up again from a forged checkpoint, to their end with all outputs.
fn checkpoints(seeds: std::ops::Range<u64>, attempts: &mut Attempts) {
    let place = tempfile::tempdir().unwrap();
    let more = "[output.table]\ntype = 'csv'\nevery = 0.02\n[output.fields]\ntype = 'vtu'\nevery = 0.1\ndata = ['displacement']\n";
    for (number, text) in scenes().enumerate().filter(|(number, _)| number % 6 == 0) {
        let text = text.replacen("[run]\n", "[run]\ncheckpoint = { every = 0.05 }\n", 1) + more;
        let Ok(whole) = world(&text) else { continue };
        let mut half = whole.clone();
        half.scene.scene.until = 0.5 * whole.scene.scene.until;
        let out = place.path().join(number.to_string());
        let folder = OutputFolder::prepare(out.clone(), &half.scene, false).unwrap();
        let _ = run(&half, &folder, &mut |_| ()).unwrap();
        drop(folder);
        let Ok(known) = Checkpoint::read(&out) else { continue };
        let path = known.path().to_owned();
        let bytes = fs::read(&path).unwrap();
        let body = &bytes[HEADS[1]..bytes.len() - CRC];
        let kept = files(&out);
        for seed in seeds.clone() {
            let seed = 1_000_000 * number as u64 + seed;
            let bytes = Checkpoint::framed(&forged(&mut Random::new(seed), body));
            attempts.attempt(seed, || {
                let Ok(checkpoint) = Checkpoint::from_bytes(&path, &bytes) else { return false };
                let Ok(world) = checkpoint.continues(&whole) else { return false };
                let Ok(folder) = OutputFolder::reopen(out.clone(), &world.scene, &checkpoint) else {
                    return false;
                };
                let options = Options { resume: Some(&checkpoint), ..Options::default() };
                let summary = run_with(&world, &folder, options, &mut |_| ());
                drop(folder);
                kept.iter().for_each(|(path, bytes)| fs::write(path, bytes).unwrap());
                summary.is_ok_and(|summary| summary.error.is_none())
            });
        }
        println!("scene {number}: {attempts}");
    }
}

/// The files of a folder.
fn files(folder: &Path) -> Vec<(std::path::PathBuf, Vec<u8>)> {
    let paths =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_file());
    paths.map(|path| (path.clone(), fs::read(path).unwrap())).collect()
}

#[test]
fn forged_snapshots_and_checkpoints_go_on_or_are_refused() {
    let mut attempts = Attempts::default();
    Attempts::quietly(|| {
        snapshots(0..40, &mut attempts);
        checkpoints(0..20, &mut attempts);
    });
    assert!(attempts.panics.is_empty(), "{attempts}");
    assert!(attempts.taken > 300 && attempts.refused > 300, "{attempts}");
}

/// By hand: `cargo test --release -p pliant-run --test scene forged -- --ignored --nocapture`.
#[test]
#[ignore = "seven minutes"]
fn a_million_forged_snapshots_go_on_or_are_refused() {
    let mut attempts = Attempts::default();
    Attempts::quietly(|| snapshots(40..20_500, &mut attempts));
    assert!(attempts.panics.is_empty(), "{attempts}");
}

/// Forged checkpoints from seed 20 to 1500, as in the shorter test.
#[test]
#[ignore = "ten minutes"]
fn many_forged_checkpoints_go_on_or_are_refused() {
    let mut attempts = Attempts::default();
    Attempts::quietly(|| checkpoints(20..1500, &mut attempts));
    assert!(attempts.panics.is_empty(), "{attempts}");
}
