//! Each door with the inputs of its corpus, as they are and changed at random.

use pliant_fuzz::{DOORS, seeds};
use pliant_testing::Random;
use pliant_testing::forging::{Attempts, forged};

/// Changes of each input.
const CHANGES: u64 = 100;

#[test]
fn every_door_takes_any_bytes() {
    for (name, door) in DOORS {
        let mut attempts = Attempts::default();
        let seeds = seeds(name).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(!seeds.is_empty(), "{name}");
        Attempts::quietly(|| {
            for (seed, first) in seeds.iter().zip((0..).step_by(CHANGES as usize + 1)) {
                attempts.attempt(first, || {
                    door(seed);
                    true
                });
                for change in first + 1..first + 1 + CHANGES {
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
