//! Claims of the literature, each a test in `tests/`. Here is what the tests share: materials, specimens and how to
//! run them, and the reference numbers in `data/`. A test prints what it measured:
//! `cargo test -p pliant-validation -- --nocapture`.

pub mod brain_shift;
mod random;
mod reference;
mod run;
mod specimen;
mod tissue;

pub use random::Random;
pub use reference::{claim, data_file, largest, numbers, reference};
pub use run::{Equilibrium, relax, run, run_on, run_watched, settle, smooth_step, watched};
pub use specimen::{HOURGLASS, Hexes, Specimen, Tets};
pub use tissue::{deformation, elastic, law, liver, liver_relaxation, soft_tissue};
