//! What a step costs on this machine: [`Case`]s (a cube of one element, law, precision and number of threads), stepped
//! against the clock and set beside what the machine can do ([`Rates`]) and what the step asks for ([`Count`]). And the
//! specimens and tissues that are measured here and tested elsewhere.
//!
//! What is measured is whole steps through the public interface of `pliant-mechanics`, `evaluate` and `advance`. Leaves
//! out: the watch over the stable step, observers and files, which a run has besides.

mod case;
mod clock;
mod count;
mod machine;
mod rates;
mod report;
mod specimen;
mod suite;
mod tissue;

pub use case::{Case, Element, LawKind, Place, Precision, Threads, cases, find};
pub use clock::{Clocked, ClockedOnDevice, Spread, Timed};
pub use count::Count;
pub use machine::Machine;
pub use pliant_explicit::Instructions;
pub use rates::Rates;
pub use report::{Cube, Fit, Limit, Report, Row};
pub use specimen::{HOURGLASS, Hexes, Specimen, Tets};
pub use suite::{BenchError, Progress, Settings, measure};
pub use tissue::{deformation, elastic, law, liver, liver_matrix, liver_relaxation, soft_tissue};
