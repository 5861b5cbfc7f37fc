//! Cost of a step on this machine. A [`Case`] is a cube of one element, law, precision and number of threads.
//! Its time is compared with the limits of the machine ([`Rates`]) and the operations of a step ([`Count`]).
//! Tests elsewhere also use the specimens.
//!
//! Whole steps are measured through the public interface of `pliant-mechanics`, `evaluate` and `advance`.
//! Monitoring of the critical time step, observers and files, which a run also has, are left out.

mod case;
mod clock;
mod count;
mod machine;
mod rates;
mod report;
mod settings;
mod shells;
mod specimen;
mod suite;

pub use pliant_explicit::Instructions;

pub use case::{Case, Element, LawKind, Place, Precision, Threads, cases, find};
pub use clock::{Clocked, ClockedOnDevice, Spread, Timed};
pub use count::Count;
pub use machine::Machine;
pub use rates::Rates;
pub use report::{Cube, Fit, Limit, Report, Row};
pub use settings::Settings;
pub use shells::{SHELL_STEP, ShellReport, ShellRun, measure_shells, tube};
pub use specimen::{HOURGLASS, Hexes, Specimen, Tets};
pub use suite::{BenchError, Progress, measure};
