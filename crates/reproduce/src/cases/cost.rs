//! Figure 6.7: what fibres and relaxation cost, on this machine: wall time of an explicit step of the thesis's cube of
//! hexahedra, single precision, all cores. Repeats of all models are interleaved, so that what else the machine does
//! meets all alike; the median counts.

use std::time::Instant;

use pliant_mechanics::curve::{Curve as Course, Shape};
use pliant_mechanics::model::Material;
use pliant_mechanics::prony::{Prony, PronyUpdate};
use pliant_mechanics::{CentralDifference, State};
use pliant_meshing::VolumeCell;
use serde_json::json;

use crate::case::{Case, CaseError, Correction, Findings, Row};
use crate::plot::{Curve, Key, Pen, Plot};
use crate::{Specimen, elastic, law, liver, liver_matrix, liver_relaxation};

/// Elements along the edge of the cubes; the thesis's go from 10 to 38.
const CELLS: [usize; 4] = [10, 16, 25, 38];
/// Repeats of every model.
const REPEATS: usize = 21;
/// Elements stepped in a repeat.
const ELEMENT_STEPS: usize = 110_000;
/// Names of the models, as in the thesis: neo-Hookean elastic, transversely isotropic elastic and viscoelastic; and
/// neo-Hookean viscoelastic, which it has not.
const MODELS: [&str; 4] = ["NHE", "TIE", "NHV", "TIV"];

/// Figure 6.7.
pub const CASE: Case = Case {
    id: "fig-6.7",
    title: "Fig. 6.7: cost of anisotropy and viscoelasticity",
    shows: "Time of one step of a cube of 1,000 to 54,872 hexahedra, for a neo-Hookean (NHE), a transversely isotropic \
            (TIE) and a transversely isotropic viscoelastic model (TIV). On a GeForce 8800 GTX the ratios were at most \
            1.013 (TIE to NHE), 1.043 (TIV to TIE) and 1.051 (TIV to NHE): memory decided there. Here they are measured on \
            this machine's processor and not judged. The critical step shrinks with the elements.",
    corrections: &[Correction {
        printed: "section 6.4.3: brain-like μ = 1006.71 Pa with ν = 0.45",
        correct: "ν = 0.49.",
        why: "1006.71 = 3000/(2 · 1.49). Both are drawn, for E = 3000 Pa; the step is 2.12 times longer at ν = 0.45.",
    }],
    seconds: 12.0,
    compute,
};

fn cube(cells: usize, material: &Material) -> Specimen {
    Specimen::block([0.1; 3], [cells; 3], VolumeCell::Hex, material, [0.0, 1.0, 0.0])
        .fix("x-min", [true; 3])
        .shift("x-max", -0.01, Course { shape: Shape::Ramp, from: 0.0, to: 1.0 })
}

fn materials() -> [Material; 4] {
    let relaxing = || liver_relaxation(PronyUpdate::Exact);
    [
        (liver_matrix(), Prony::default()),
        (liver(), Prony::default()),
        (liver_matrix(), relaxing()),
        (liver(), relaxing()),
    ]
    .map(|(law, prony)| Material { law, prony, density: 1000.0 })
}

/// Wall times of a step [s] of each model, repeat by repeat.
fn measure(cells: usize) -> Result<Vec<[f64; 4]>, CaseError> {
    let cubes = materials().map(|material| cube(cells, &material));
    // One step for all: that of the stiffest.
    let step = cubes.iter().map(|cube| 0.9 * cube.element_bound()).fold(f64::INFINITY, f64::min);
    let mut running = Vec::new();
    for cube in &cubes {
        running.push((CentralDifference::<f32>::new(&cube.model, step)?, State::at_rest(&cube.model)));
    }
    let steps = (ELEMENT_STEPS / cells.pow(3)).max(2);
    let mut times = vec![[0.0; 4]; REPEATS + 1];
    for repeat in &mut times {
        for ((stepper, state), time) in running.iter_mut().zip(repeat) {
            let started = Instant::now();
            for _ in 0..steps {
                stepper.evaluate(state)?;
                stepper.advance(state);
            }
            *time = started.elapsed().as_secs_f64() / steps as f64;
        }
    }
    // The first warms up and does not count.
    Ok(times.split_off(1))
}

/// The median over the repeats of what is made of their times.
fn median(repeats: &[[f64; 4]], of: impl Fn(&[f64; 4]) -> f64) -> f64 {
    let mut values: Vec<f64> = repeats.iter().map(of).collect();
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

fn compute() -> Result<Findings, CaseError> {
    let mut findings = Findings::default();
    let elements = CELLS.map(|cells| cells.pow(3) as f64);
    let mut times = Vec::new();
    for cells in CELLS {
        times.push(measure(cells)?);
    }
    let pairs = |value: &dyn Fn(&[f64; 4]) -> f64| -> Vec<(f64, f64)> {
        elements.into_iter().zip(times.iter().map(|repeats| median(repeats, value))).collect()
    };
    let mut curves = Vec::new();
    for (model, name) in MODELS.into_iter().enumerate() {
        curves.push(Curve::new(name, model, Pen::Line, pairs(&|t| 1e3 * t[model])));
        curves.push(Curve::new("", model, Pen::Markers, pairs(&|t| 1e3 * t[model])));
    }
    let plot = |title, axis, curves| {
        let axes = ["elements", axis];
        Plot { title, axes, logarithmic: true, key: Key::UpperLeft, curves }
    };
    let caption = "Median of 21 repeats, interleaved; single precision, all cores.";
    findings.figures.push(plot("Time of a step", "time [ms]", &curves).figure(caption)?);
    let ratios = [("TIE / NHE", 1, 0), ("TIV / TIE", 3, 1), ("TIV / NHE", 3, 0)].iter().enumerate().flat_map(
        |(colour, &(name, above, below))| {
            let points = pairs(&|t| t[above] / t[below]);
            [
                Curve::new(name, colour, Pen::Line, points.clone()),
                Curve::new("", colour, Pen::Markers, points),
            ]
        },
    );
    let ratios: Vec<Curve> = ratios.collect();
    let figure = Plot { logarithmic: false, ..plot("Ratio of times", "ratio", &ratios) };
    findings.figures.push(figure.figure("Medians of the ratios within a repeat.")?);

    let finest = times.last().map(Vec::as_slice).unwrap_or_default();
    for (model, name) in MODELS.into_iter().enumerate() {
        let quantity = format!("{name}: a step of {} hexahedra", elements[3]);
        findings.rows.push(Row::timed(quantity, "ms", None, median(finest, |t| 1e3 * t[model]), ""));
    }
    let source = "thesis, largest on a GeForce 8800 GTX";
    for (name, reference, [above, below]) in [
        ("TIE to NHE: anisotropy", Some(1.013), [1, 0]),
        ("TIV to TIE: viscoelasticity", Some(1.043), [3, 1]),
        ("TIV to NHE: both", Some(1.051), [3, 0]),
        ("NHV to NHE: viscoelasticity without fibres", None, [2, 0]),
    ] {
        let ratio = median(finest, |t| t[above] / t[below]);
        let source = if reference.is_some() { source } else { "" };
        findings.rows.push(Row::timed(name, "", reference, ratio, source));
    }

    let critical = |material: &Material, cells: usize| 1e3 * cube(cells, material).element_bound();
    let brain =
        |ratio: f64| elastic(law("neo-hookean", json!({ "young-modulus": 3000.0, "poisson-ratio": ratio })));
    let tissues = [
        ("liver-like", materials()[3].clone()),
        ("brain, ν 0.45", brain(0.45)),
        ("brain, ν 0.49", brain(0.49)),
    ];
    let curves: Vec<Curve> = (tissues.iter().enumerate())
        .map(|(colour, (name, material))| {
            let steps =
                CELLS.into_iter().zip(elements).map(|(cells, count)| (count, critical(material, cells)));
            Curve::new(*name, colour, Pen::Line, steps.collect())
        })
        .collect();
    let figure = Plot { key: Key::UpperRight, ..plot("Critical step", "Δt [ms]", &curves) };
    findings.figures.push(figure.figure("The element bound at rest, ρ = 1000 kg/m³.")?);
    let [at_45, at_49] = [0.45, 0.49].map(|ratio| critical(&brain(ratio), CELLS[0]));
    let quantity = "critical step at ν = 0.45 over that at ν = 0.49";
    findings.rows.push(Row::judged(quantity, "", [2.12, 0.005], at_45 / at_49, "thesis, as printed"));
    Ok(findings)
}
