//! The cases, in the order of the page.

pub mod angioplasty;
pub mod brain_shift;
pub mod cost;
pub mod cube;
pub mod curved;
pub mod elements;
pub mod framework;
pub mod lens;
pub mod liver;
pub mod obstacle_course;
pub mod plate;
pub mod real_time;
pub mod reconstruction;
pub mod relaxation;
pub mod shear;
pub mod shell_times;

use pliant_gpu::{Adapter, Kind};

use crate::case::{Case, Correction};

/// List of all cases.
pub const CASES: &[Case] = &[
    shear::ELASTIC,
    shear::VISCOELASTIC,
    cube::DEFORMED,
    relaxation::CASE,
    cost::CASE,
    real_time::CASE,
    framework::CASE,
    liver::CASE,
    elements::CASE,
    brain_shift::CASE,
    plate::CASE,
    curved::PATCH,
    curved::LAYERS,
    curved::RENDERING,
    lens::MESH,
    lens::INJECTION,
    obstacle_course::CASE,
    reconstruction::CYLINDER,
    reconstruction::CAPSULE,
    reconstruction::ANEURYSM,
    shell_times::CASE,
    angioplasty::CASE,
];

/// The name of an adapter, marked if it is software.
fn adapter_name(adapter: &Adapter) -> String {
    let software = if adapter.kind == Kind::Software { ", run by the CPU" } else { "" };
    format!("{}{software}", adapter.name)
}

/// The thesis's factor 2, relevant to every case with fibres.
const FIBRE_FACTOR: Correction = Correction {
    printed: "(6.6): fibre stress η (Ī₄ − 1) …",
    correct: "2η (Ī₄ − 1) …",
    why: "The energy η/2 (Ī₄ − 1)² of (6.4) has twice that stress (S = 2 ∂Ψ/∂C; the thesis's own (5.48) agrees). The \
          thesis's code and NiftySim have the same error, so a published η means half of it in the energy; \
          scenes select this with `convention = \"taylor\"`.",
};

/// The growing memory of the thesis's relaxation integrals.
const RELAXATION_SIGN: Correction = Correction {
    printed: "(5.52), (5.54), (6.8): e^(−(s−t)/τ)",
    correct: "e^(−(t−s)/τ).",
    why: "As printed, the memory of a stress grows with its age t − s; (5.58) to (5.61) are right.",
};

/// The case of an id.
///
/// # Errors
/// If it does not exist: the most similar id.
pub fn find(id: &str) -> Result<&'static Case, &'static str> {
    CASES.iter().find(|case| case.id.eq_ignore_ascii_case(id)).ok_or_else(|| {
        let likeness = |case: &&Case| strsim::jaro_winkler(case.id, &id.to_lowercase());
        let nearest = CASES.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
        nearest.map_or("", |case| case.id)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_found_and_slips_are_answered_with_the_nearest() {
        assert_eq!(find("FIG-6.3").unwrap().id, "fig-6.3");
        assert_eq!(find("fig6.10").unwrap_err(), "fig-6.10");
        assert_eq!(find("brain").unwrap_err(), "brain-shift");
        let mut ids: Vec<&str> = CASES.iter().map(|case| case.id).collect();
        ids.sort_unstable();
        ids.dedup();
        assert_eq!(ids.len(), CASES.len());
    }
}
