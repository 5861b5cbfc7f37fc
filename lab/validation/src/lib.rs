//! Claims of the literature, each a test in `tests/`. The tests share materials, specimens and functions that
//! run them, from `pliant-reproduce`, which shows some of the same computations to users. They also share the
//! reference numbers in `data/`. A test prints its measurements:
//! `cargo test -p pliant-validation -- --nocapture`.

mod reference;
mod run;
pub mod shells;

pub use pliant_reproduce::cases::brain_shift;
pub use pliant_reproduce::{
    Equilibrium, HOURGLASS, Hexes, Specimen, Tets, deformation, elastic, largest, law, liver,
    liver_relaxation, numbers, smooth_step, soft_tissue,
};
pub use pliant_testing::Random;
pub use reference::{claim, data_file, reference};
pub use run::{relax, run, run_on, run_watched, settle, watched};
