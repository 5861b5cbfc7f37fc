//! Each door with the inputs of its corpus, as they are and changed at random.

use pliant_fuzz::{DOORS, seeds};
use pliant_testing::Random;
use pliant_testing::forging::{Attempts, forged};

/// Tries each door with a number of changes of each of its inputs.
fn try_doors(changes: impl Fn(&str, usize) -> u64) {
    for (name, door) in DOORS {
        let mut attempts = Attempts::default();
        let seeds = seeds(name).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(!seeds.is_empty(), "{name}");
        let changes = changes(name, seeds.len());
        Attempts::quietly(|| {
            for (seed, first) in seeds.iter().zip((0..).step_by(changes as usize + 1)) {
                attempts.attempt(first, || {
                    door(seed);
                    true
                });
                for change in first + 1..first + 1 + changes {
                    let bytes = forged(&mut Random::new(change), seed);
                    attempts.attempt(change, || {
                        door(&bytes);
                        true
                    });
                }
            }
        });
        println!("{name}: {attempts}");
        assert!(attempts.panics.is_empty(), "{name}: {attempts}");
    }
}

#[test]
fn every_door_takes_any_bytes() {
    try_doors(|_, _| 100);
}

/// By hand: `cargo test --release -p pliant-fuzz -- --ignored --nocapture`. Filling a surface and replaying
/// take milliseconds each.
#[test]
#[ignore = "ten minutes"]
fn every_door_takes_many_bytes() {
    try_doors(|name, seeds| if ["surface", "recording"].contains(&name) { 10_000 } else { 1_000_000 } / seeds as u64);
}
