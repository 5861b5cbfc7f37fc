//! Figures 6.3 and 6.4: a unit cube of liver-like tissue, one element, sheared at a constant rate with fibres
//! along e₁. *A*: F = I + γ e₂⊗e₁, which stretches the fibres; *B*: F = I + γ e₁⊗e₂, which does not.
//! References: closed forms with fifty digits (Taylor et al. 2009 with the factor 2 put right).

use pliant_mechanics::curve::{Curve as LoadCurve, Shape};
use pliant_mechanics::law::AnyLaw;
use pliant_mechanics::model::Material;
use pliant_mechanics::prony::{Prony, PronyUpdate};
use pliant_mechanics::tensor::Symmetric;
use pliant_meshing::VolumeCell;
use pliant_sim::Precision;
use serde_json::{Value, json};

use super::{FIBRE_FACTOR, RELAXATION_SIGN};
use crate::case::{Case, CaseError, Correction, Figure, Findings, Row};
use crate::plot::{Curve, Key, Pen, Plot};
use crate::{Specimen, largest, law, liver_matrix, liver_relaxation, numbers, reference, run};

/// Nonzero components of S, in the order of [`Symmetric`].
pub const COMPONENTS: [&str; 4] = ["S11", "S22", "S33", "S12"];

/// Shear rates [1/s] of the curves.
pub const RATES: [f64; 3] = [2.5, 0.25, 0.025];

/// Step [s] at which the errors of the updates are known.
pub const STEP: f64 = 0.01;

/// The step between two shears of the reference.
const SHEAR: f64 = 0.05;

const SOURCE: &str = "closed form, 50 digits (Taylor et al. 2009, corrected)";

const DIRECTION: Correction = Correction {
    printed: "section 6.4.1: “pure shear”, no direction given",
    correct: "simple shear F = I + γ e₂⊗e₁: the face x = 1 moves along y.",
    why: "Among axis-aligned shears only this one has four nonzero stresses, S₁₁ = S₃₃ without fibres, and \
          a sign of S₁₁ that changes with fibres along x, as in the text. J = 1, so κ has no effect.",
};

/// Figure 6.3.
pub const ELASTIC: Case = Case {
    id: "fig-6.3",
    title: "Fig. 6.3: stress in simple shear, with fibres and without",
    shows: "The instantaneous stresses of one sheared element lie on the analytic lines. Fibres along x change size and \
            shape of all curves; S₁₁, equal to S₃₃ without fibres, changes its sign.",
    corrections: &[
        Correction {
            printed: "(6.6): I + I₁/3 C⁻¹ and A₀ + I₄/3 C⁻¹",
            correct: "a minus in both.",
            why: "With the plus the stress is not the derivative of the energy (6.4) (off by 2.4 times itself); with the \
                  minus it is, to round-off.",
        },
        FIBRE_FACTOR,
        DIRECTION,
    ],
    seconds: 0.1,
    compute: elastic,
};

/// Figure 6.4.
pub(crate) const VISCOELASTIC: Case = Case {
    id: "fig-6.4",
    title: "Fig. 6.4: S₁₁ in simple shear at three rates",
    shows: "The viscoelastic stress S₁₁ at shear rates of 2.5, 0.25 and 0.025/s lies on the analytic lines, between the \
            bounds of infinite and of vanishing rate.",
    corrections: &[
        RELAXATION_SIGN,
        Correction {
            printed: "(6.8): ∂Φ/∂τ under the integral over s",
            correct: "∂Φ/∂s.",
            why: "τ is the relaxation time, a constant.",
        },
        FIBRE_FACTOR,
        DIRECTION,
    ],
    seconds: 0.5,
    compute: viscoelastic,
};

/// The reference curves.
pub fn data() -> Value {
    reference(include_str!("../../../validation/data/shear_curves.json"))
}

/// Returns the curves [Pa] component by component. A geometry is `A` or `B`, a kind of fibres `energy`,
/// `taylor` or `isotropic`, and a rate `instantaneous`, `equilibrium` or as in [`rate_name`].
pub fn curves(data: &Value, geometry: &str, fibres: &str, rate: &str) -> [Vec<f64>; 4] {
    COMPONENTS.map(|component| numbers(&data[geometry][fibres][rate][component]))
}

/// The name of a rate [1/s] in the reference.
pub fn rate_name(rate: f64) -> String {
    format!("rate_{rate}")
}

/// The liver-like law of a kind of fibres: `energy`, `taylor` or `isotropic`.
pub fn law_of(fibres: &str) -> AnyLaw {
    if fibres == "isotropic" {
        return liver_matrix();
    }
    let parameters = json!({
        "shear-modulus": 6568.0, "bulk-modulus": 6568.0 * 29.0 / 3.0, "fibre-modulus": 13136.0, "convention": fibres,
    });
    law("transversely-isotropic", parameters)
}

/// The largest deviation of stresses from four curves, each relative to the largest value of its curve.
pub fn deviation(curves: &[Vec<f64>; 4], stresses: &[Symmetric<f64>]) -> f64 {
    largest((0..4).map(|component| off(&curves[component], stresses, component)))
}

/// The largest deviation of one component from its curve; infinite if the numbers of stresses and values
/// differ.
fn off(curve: &[f64], stresses: &[Symmetric<f64>], component: usize) -> f64 {
    if curve.len() != stresses.len() {
        return f64::INFINITY;
    }
    let off = stresses.iter().zip(curve).map(|(s, c)| (s.0[component] - c).abs());
    largest(off) / largest(curve.iter().map(|s| s.abs()))
}

/// Rate at which an element is sheared.
#[derive(Clone, Copy, Debug)]
enum Rate {
    /// At a rate [1/s], with steps of [`STEP`].
    At(f64),
    /// So slow that only the equilibrium remains.
    Vanishing,
}

/// The stress [Pa] of an element at shears 0, 0.05, …, 1, its face x = 1 moved along y.
fn sheared(fibres: &str, prony: Prony, rate: Rate) -> Result<Vec<Symmetric<f64>>, CaseError> {
    let material = Material { law: law_of(fibres), prony, density: 1000.0 };
    let (rate, steps) = match rate {
        Rate::At(rate) => (rate, (SHEAR / (rate * STEP)).round()),
        Rate::Vanishing => (1e-12, 1.0),
    };
    let ramp = LoadCurve { shape: Shape::Ramp, from: 0.0, to: 1.0 / rate };
    let element = Specimen::block([1.0; 3], [1; 3], VolumeCell::Hex, &material, [1.0, 0.0, 0.0])
        .carry("x-max", [0.0, 1.0, 0.0], ramp)
        .fix("x-min", [true; 3]);
    let (step, mut stresses) = (SHEAR / (rate * steps), Vec::new());
    run(&element.model, Precision::Double, step, 1.0 / rate, |frame| {
        for now in frame.parts().map(|(_, now)| now).filter(|now| now.steps() % steps as u64 == 0) {
            stresses.extend(now.cells().map(|cells| cells.at(0, 0, false).pk2_stress));
        }
    })?;
    Ok(stresses)
}

/// Points of a plot: shears and stresses in kPa.
fn points(stresses: impl Iterator<Item = f64>) -> Vec<(f64, f64)> {
    stresses.enumerate().map(|(index, stress)| (SHEAR * index as f64, 1e-3 * stress)).collect()
}

fn elastic() -> Result<Findings, CaseError> {
    let data = data();
    let mut findings = Findings::default();
    for (fibres, title) in [
        ("energy", "fibres by the energy (6.4)"),
        ("isotropic", "no fibres"),
        ("taylor", "fibres as printed (6.6), half as stiff"),
    ] {
        let expected = curves(&data, "A", fibres, "instantaneous");
        let found = sheared(fibres, Prony::default(), Rate::At(RATES[0]))?;
        let quantity = format!("{title}: S over γ = 0 … 1, largest deviation over the largest value");
        findings.rows.push(Row::deviation(quantity, 1e-9, deviation(&expected, &found), SOURCE));
        for (component, name) in [(0, "S₁₁"), (2, "S₃₃")] {
            let reference = expected[component].last().copied().unwrap_or(f64::NAN);
            let computed = found.last().map_or(f64::NAN, |s| s.0[component]);
            let quantity = format!("{title}: {name} at γ = 1");
            let claim = [reference, 1e-9 * reference.abs()];
            findings.rows.push(Row::judged(quantity, "Pa", claim, computed, SOURCE));
        }
        findings.figures.push(elastic_figure(title, &expected, &found)?);
    }
    Ok(findings)
}

fn elastic_figure(
    title: &str,
    expected: &[Vec<f64>; 4],
    found: &[Symmetric<f64>],
) -> Result<Figure, CaseError> {
    let mut curves = Vec::new();
    for (component, name) in ["S₁₁", "S₂₂", "S₃₃", "S₁₂"].into_iter().enumerate() {
        curves.push(Curve::new(name, component, Pen::Line, points(expected[component].iter().copied())));
        let stresses = found.iter().map(|s| s.0[component]);
        curves.push(Curve::new("", component, Pen::Markers, points(stresses)));
    }
    let (axes, key) = (["shear γ", "stress S [kPa]"], Key::LowerLeft);
    let plot = Plot { title, axes, logarithmic: false, key, curves: &curves };
    plot.figure("Lines: analytic. Circles: one element.")
}

fn viscoelastic() -> Result<Findings, CaseError> {
    let data = data();
    let mut findings = Findings::default();
    let mut drawn_curves = Vec::new();
    let bounds = [("∞", "instantaneous", None), ("0⁺", "equilibrium", Some(Rate::Vanishing))];
    let [infinite, vanishing] = bounds;
    let rates = RATES.map(|rate| (format!("{rate}/s"), rate_name(rate), Some(Rate::At(rate))));
    let named = |(name, key, rate): (&str, &str, Option<Rate>)| (name.to_owned(), key.to_owned(), rate);
    let curves_shown = [named(infinite)].into_iter().chain(rates).chain([named(vanishing)]);
    for (colour, (name, key, rate)) in curves_shown.enumerate() {
        let expected = &curves(&data, "A", "energy", &key)[0];
        let found = match rate {
            Some(rate) => sheared("energy", liver_relaxation(PronyUpdate::Exact), rate)?,
            None => sheared("energy", Prony::default(), Rate::At(RATES[0]))?,
        };
        drawn_curves.push(Curve::new(name.clone(), colour, Pen::Line, points(expected.iter().copied())));
        drawn_curves.push(Curve::new("", colour, Pen::Markers, points(found.iter().map(|s| s.0[0]))));
        let limit = if matches!(rate, Some(Rate::At(_))) { 3e-5 } else { 1e-9 };
        let quantity = format!("rate {name}: S₁₁ over γ = 0 … 1, largest deviation over the largest value");
        findings.rows.push(Row::deviation(quantity, limit, off(expected, &found, 0), SOURCE));
    }
    for (update, name, limit) in [
        (PronyUpdate::Exact, "exact for linear stress (default)", 3e-5),
        (PronyUpdate::BackwardEuler, "backward Euler (thesis 5.61)", 3e-3),
    ] {
        let expected = curves(&data, "A", "energy", &rate_name(RATES[0]))[0].last().copied();
        let found = sheared("energy", liver_relaxation(update), Rate::At(RATES[0]))?.last().map(|s| s.0[0]);
        let (expected, found) = (expected.unwrap_or(f64::NAN), found.unwrap_or(f64::NAN));
        let quantity = format!("S₁₁ at γ = 1 and 2.5/s, Δt = 0.01 s, update {name}: deviation");
        findings.rows.push(Row::deviation(quantity, limit, (found / expected - 1.0).abs(), SOURCE));
    }
    let axes = ["shear γ", "stress S₁₁ [kPa]"];
    let plot = Plot {
        title: "S₁₁, rates in 1/s",
        axes,
        logarithmic: false,
        key: Key::UpperLeft,
        curves: &drawn_curves,
    };
    findings.figures.push(plot.figure("Lines: analytic. Circles: one element, steps of 0.01 s.")?);
    Ok(findings)
}
