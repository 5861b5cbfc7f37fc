//! Figure 6.6: the liver-like cube compressed by 30 % in 0.5 s, linearly, then held to 5 s. Half of the
//! isochoric stress relaxes with τ = 0.58 s. The reference is quasi-static, of quadratic hexahedra without
//! inertia. The comparison therefore uses the shape of the decay, F(t)/F(5 s), after the waves of the ramp.

use pliant_mechanics::curve::{Curve as LoadCurve, Shape};
use pliant_mechanics::law::AnyLaw;
use pliant_mechanics::model::Material;
use pliant_mechanics::prony::PronyUpdate;
use pliant_meshing::VolumeCell;
use pliant_sim::Precision;
use serde_json::Value;

use super::{FIBRE_FACTOR, cube};
use crate::case::{Case, CaseError, Findings, Row};
use crate::plot::{Curve, Key, Pen, Plot};
use crate::{Specimen, largest, liver, liver_matrix, liver_relaxation, numbers, reference, run};

/// Cells along half the edge of the cube.
const CELLS: usize = 6;

/// Time [s] after the waves of the ramp.
pub const FROM: f64 = 0.7;

const SOURCE: &str = "quasi-static, quadratic hexahedra n = 4, felupe";

/// Figure 6.6.
pub(crate) const CASE: Case = Case {
    id: "fig-6.6",
    title: "Fig. 6.6: reaction of the compressed cube over time",
    shows: "The force on the platens rises during the compression by 30 % in 0.5 s, and decays afterwards. Fibres \
            across the compression, along y or along y = z, increase it.",
    corrections: &[super::RELAXATION_SIGN, FIBRE_FACTOR],
    seconds: 7.0,
    compute,
};

/// The tissue of a reference curve, and its fibres: `iso` or `tiy`.
pub fn tissue(model: &str) -> AnyLaw {
    if model == "iso" { liver_matrix() } else { liver() }
}

/// Times [s] and forces [N] of a reference curve: `iso` or `tiy`.
pub fn curve(model: &str) -> [Vec<f64>; 2] {
    let data: Value = reference(include_str!("../../../validation/data/relaxation.json"));
    ["t", "F"].map(|key| numbers(&data["models"][model][key]))
}

/// An eighth of the cube, with fibres along an axis or without fibres.
fn eighth(material: &Material) -> (Specimen, f64) {
    let block = Specimen::block([0.05; 3], [CELLS; 3], VolumeCell::Hex, material, [0.0, 1.0, 0.0]);
    (cube::held_as_an_eighth(block, 0.3, ramp()), 4.0)
}

/// Half of the cube, for fibres along y = z: the platen at x = 0, the plane of symmetry at x = 0.05.
fn half(material: &Material) -> (Specimen, f64) {
    let (fibre, size) = ([0.0, 0.5_f64.sqrt(), 0.5_f64.sqrt()], [0.05, 0.1, 0.1]);
    let block = Specimen::block(size, [CELLS, 2 * CELLS, 2 * CELLS], VolumeCell::Hex, material, fibre)
        .shift("x-min", 0.3 * 0.05, ramp())
        .fix("x-min", [false, true, true])
        .fix("x-max", [true, false, false]);
    (block, 1.0)
}

fn ramp() -> LoadCurve {
    LoadCurve { shape: Shape::Ramp, from: 0.0, to: 0.5 }
}

/// The force [N] on the platen at given times [s], by linear interpolation between the steps.
fn force_at(times: &[f64], (part, factor): (Specimen, f64)) -> Result<Vec<f64>, CaseError> {
    let part = part.damped(100.0);
    let (mut forces, mut before) = (Vec::new(), (0.0, 0.0));
    run(&part.model, Precision::Double, 0.5 * part.element_bound(), 5.0, |frame| {
        let now = (frame.time(), factor * frame.reaction(cube::PLATEN).map_or(f64::NAN, |force| force[0]));
        while let Some(&time) = times.get(forces.len()).filter(|&&time| time <= now.0) {
            let share = (time - before.0) / (now.0 - before.0);
            forces.push(before.1 + share * (now.1 - before.1));
        }
        before = now;
    })?;
    Ok(forces)
}

/// Relaxation of a cube compared with a reference curve.
#[derive(Clone, Debug)]
pub struct Relaxed {
    /// Times [s].
    pub times: Vec<f64>,
    /// Forces here [N].
    pub found: Vec<f64>,
    /// Forces of the reference [N].
    pub expected: Vec<f64>,
}

impl Relaxed {
    /// Runs the cube of a reference curve, `iso` or `tiy`.
    ///
    /// # Errors
    /// If a step fails.
    pub fn new(model: &str) -> Result<Self, CaseError> {
        let [times, expected] = curve(model);
        let found = force_at(&times, eighth(&viscoelastic(tissue(model))))?;
        Ok(Self { times, found, expected })
    }

    /// The last force here and of the reference [N].
    pub fn last(&self) -> [f64; 2] {
        [&self.found, &self.expected].map(|force| force.last().copied().unwrap_or(f64::NAN))
    }

    /// Time [s], F(t)/F(5 s) here and of the reference.
    pub fn ratios(&self) -> impl Iterator<Item = (f64, f64, f64)> {
        let [found, expected] = self.last();
        (self.times.iter().zip(&self.found).zip(&self.expected))
            .map(move |((&t, f), e)| (t, f / found, e / expected))
    }

    /// The largest relative deviation of the ratios once the waves have gone.
    pub fn off(&self) -> f64 {
        let settled = self.ratios().filter(|(time, ..)| *time >= FROM - 1e-9);
        largest(settled.map(|(_, f, e)| (f / e - 1.0).abs()))
    }
}

/// Points of a curve that begins at rest.
fn from_rest(times: &[f64], forces: &[f64]) -> Vec<(f64, f64)> {
    std::iter::once((0.0, 0.0)).chain(times.iter().copied().zip(forces.iter().copied())).collect()
}

/// Returns the limit of fine meshes and its uncertainty, from a force of the reference. At 30 % the
/// reference's coarse meshes of quadratic hexahedra are 4 to 8 % too stiff.
pub fn of_fine_meshes(force: f64) -> [f64; 2] {
    let [low, high] = [force / 1.08, force / 1.04];
    [0.5 * (low + high), 0.5 * (high - low)]
}

fn viscoelastic(law: AnyLaw) -> Material {
    Material { law, prony: liver_relaxation(PronyUpdate::Exact), density: 1000.0 }
}

fn compute() -> Result<Findings, CaseError> {
    let mut findings = Findings::default();
    let (mut forces, mut ratios) = (Vec::new(), Vec::new());
    let mut isotropic = f64::NAN;
    for (colour, (model, name)) in [("iso", "no fibres"), ("tiy", "fibres along y")].into_iter().enumerate() {
        let relaxed = Relaxed::new(model)?;
        let pairs = |force: &[f64]| from_rest(&relaxed.times, force);
        forces.push(Curve::new(name, colour, Pen::Line, pairs(&relaxed.found)));
        forces.push(Curve::new("", colour, Pen::Dashes, pairs(&relaxed.expected)));
        let late = || relaxed.ratios().filter(|(time, ..)| *time >= 0.5);
        ratios.push(Curve::new(name, colour, Pen::Line, late().map(|(t, _, e)| (t, e)).collect()));
        ratios.push(Curve::new("", colour, Pen::Markers, late().map(|(t, f, _)| (t, f)).collect()));
        // 1 %: the reference's ratios differ by less than 0.5 % between its meshes; the rest for the waves of
        // the ramp.
        let quantity = format!("{name}: F(t)/F(5 s) from {FROM} s on, largest deviation");
        findings.rows.push(Row::deviation(quantity, 0.01, relaxed.off(), SOURCE));
        let [found, expected] = relaxed.last();
        let quantity = format!("{name}: F(5 s), against the reference minus its mesh error of 4 to 8 %");
        findings.rows.push(Row::judged(quantity, "N", of_fine_meshes(expected), found, SOURCE));
        let quantity = format!("{name}: F(5 s), deviation from the uncorrected reference on its coarse mesh");
        findings.rows.push(Row::shown(quantity, "%", 100.0 * (found / expected - 1.0), SOURCE));
        if model == "iso" {
            isotropic = found;
        } else {
            let quantity = format!("{name}: F(5 s) over that without fibres");
            findings.rows.push(Row::shown(quantity, "", found / isotropic, "thesis: larger than 1"));
        }
    }
    let [times, _] = curve("iso");
    let oblique = force_at(&times, half(&viscoelastic(liver())))?;
    let last = oblique.last().copied().unwrap_or(f64::NAN);
    forces.push(Curve::new("fibres along y = z", 2, Pen::Line, from_rest(&times, &oblique)));
    findings.rows.push(Row::shown("fibres along y = z: F(5 s)", "N", last, "no reference"));
    let quantity = "fibres along y = z: F(5 s) over that without fibres";
    findings.rows.push(Row::shown(quantity, "", last / isotropic, "thesis: larger than 1"));

    let plot = |title, quantity, curves| {
        let axes = ["time [s]", quantity];
        Plot { title, axes, logarithmic: false, key: Key::UpperRight, curves }
    };
    findings.figures.push(plot("Force on the platen", "F [N]", &forces).figure(
        "Lines: explicit dynamics. Dashed: quasi-static reference on a coarse mesh of quadratic elements, 4 to 8 % too \
         stiff at 30 %; none for the diagonal fibres.",
    )?);
    let decay = plot("Decay while held", "F(t) / F(5 s)", &ratios);
    findings.figures.push(decay.figure("Lines: reference. Circles: here.")?);
    Ok(findings)
}
