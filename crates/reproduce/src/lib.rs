//! The results of the thesis (Comas 2010, chapter 6), run again and shown beside the printed ones: each a [`Case`] that
//! gives rows of numbers and figures, all of them one page.
//!
//! Where the printed source is wrong, the case says what was corrected and why. References are embedded, so that a
//! binary needs no repository. The validation tests call the same computations.

mod case;
pub mod cases;
mod machine;
mod page;
mod picture;
mod plot;
mod reference;
mod report;
mod run;
mod specimen;
mod tissue;

pub use case::{Case, CaseError, Correction, Figure, Findings, Row, find};
pub use cases::CASES;
pub use reference::{largest, mesh, numbers, reference};
pub use report::{END, Report, START, is_own_file, replace_table};
pub use run::{Equilibrium, relax, run, settle, smooth_step};
pub use specimen::{HOURGLASS, Hexes, Specimen, Tets};
pub use tissue::{deformation, elastic, law, liver, liver_matrix, liver_relaxation, soft_tissue};
