//! The results of the thesis (Comas 2010, chapters 6, 8, 9.2 and 9.5), computed and compared with the
//! published ones. Each is a [`Case`] that gives rows of numbers and figures; one page shows all.
//!
//! If the printed source is wrong, the case gives the correction and its reason. References are embedded, so
//! a binary needs no repository. The validation tests call the same computations.

mod case;
pub mod cases;
mod digits;
mod page;
mod picture;
mod plot;
mod reference;
mod report;
mod run;
pub mod shells;

pub use pliant_bench::{HOURGLASS, Hexes, Specimen, Tets};
pub use pliant_mechanics::tissue::{
    deformation, elastic, law, liver, liver_matrix, liver_relaxation, soft_tissue,
};

pub use case::{Case, CaseError, Correction, Figure, Findings, Row};
pub use cases::{CASES, find};
pub use page::is_own_file;
pub use reference::{largest, mesh, numbers, reference};
pub use report::Report;
pub use run::{Equilibrium, relax, settle, smooth_step};
pub(crate) use run::{relaxed, run};
