//! Figure 6.7: the cost of fibres and relaxation on this machine. Wall time of an explicit step of the
//! thesis's cube of hexahedra, single precision, all cores. Repeats of all models are interleaved, so other
//! load affects them equally; the median counts.

use pliant_bench::{Clocked, ClockedOnDevice, Spread, Timed};
use pliant_explicit::State;
use pliant_gpu::{Design, Device, GpuError};
use pliant_mechanics::curve::{Curve as LoadCurve, Shape};
use pliant_mechanics::model::Material;
use pliant_mechanics::prony::{Prony, PronyUpdate};
use pliant_meshing::VolumeCell;
use serde_json::json;

use crate::case::{Case, CaseError, Correction, Findings, Row};
use crate::cases::adapter_name;
use crate::plot::{Curve, Key, Pen, Plot};
use crate::{Specimen, elastic, law, liver, liver_matrix, liver_relaxation};

/// Elements along the edge of the cubes; the thesis's go from 10 to 38.
const CELLS: [usize; 4] = [10, 16, 25, 38];
/// Repeats of every model.
const REPEATS: usize = 21;
/// Repeats of every model on a GPU.
const REPEATS_ON_DEVICE: usize = 5;
/// Elements stepped in a repeat.
const ELEMENT_STEPS: usize = 110_000;
/// Names of the models, as in the thesis: neo-Hookean elastic, transversely isotropic elastic and
/// viscoelastic; and neo-Hookean viscoelastic, which is not in the thesis.
const MODELS: [&str; 4] = ["NHE", "TIE", "NHV", "TIV"];

/// Figure 6.7.
pub(crate) const CASE: Case = Case {
    id: "fig-6.7",
    title: "Fig. 6.7: cost of anisotropy and viscoelasticity",
    shows: "Time of one step of a cube of 1,000 to 54,872 hexahedra, for a neo-Hookean (NHE), a transversely \
            isotropic (TIE) and a transversely isotropic viscoelastic model (TIV). On a GeForce 8800 GTX, \
            memory-bound, the ratios were at most 1.013 (TIE to NHE), 1.043 (TIV to TIE) and 1.051 (TIV to NHE). Here \
            they are measured on this machine's CPU and not judged. The critical time step shrinks with the elements.",
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
        .shift("x-max", -0.01, LoadCurve { shape: Shape::Ramp, from: 0.0, to: 1.0 })
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

/// Wall times of a step [s] of each model, repeat by repeat. All take the step of the stiffest model.
fn measure(cells: usize, device: Option<&Device>) -> Result<Vec<[f64; 4]>, CaseError> {
    let cubes = materials().map(|material| cube(cells, &material));
    let step = cubes.iter().map(|cube| 0.9 * cube.element_bound()).fold(f64::INFINITY, f64::min);
    let steps = (ELEMENT_STEPS / cells.pow(3)).max(2);
    match device {
        None => {
            let mut running = Vec::new();
            for Specimen { model, .. } in &cubes {
                running.push(Clocked::<f32>::new(model.clone(), step, State::at_rest(model))?);
            }
            interleaved(&mut running, REPEATS, steps)
        }
        Some(device) => {
            let mut running = Vec::new();
            for Specimen { model, .. } in &cubes {
                let (design, state) = (Design::usual(device.adapter().kind), State::at_rest(model));
                running.push(ClockedOnDevice::new(device, model.clone(), step, design, state)?);
            }
            interleaved(&mut running, REPEATS_ON_DEVICE, steps)
        }
    }
}

fn interleaved<T: Timed>(running: &mut [T], repeats: usize, steps: usize) -> Result<Vec<[f64; 4]>, CaseError>
where
    CaseError: From<T::Error>,
{
    let mut times = vec![[0.0; 4]; repeats + 1];
    for repeat in &mut times {
        for (cube, time) in running.iter_mut().zip(repeat) {
            *time = cube.seconds_per_step(steps)?;
        }
    }
    // The first warms up and does not count.
    Ok(times.split_off(1))
}

/// The median over the repeats of a function of their times.
fn median(repeats: &[[f64; 4]], of: impl Fn(&[f64; 4]) -> f64) -> f64 {
    Spread::of(repeats.iter().map(of)).median
}

/// The series of meshes in one place.
struct Series {
    /// The place, in words …
    place: &'static str,
    /// … and which one it is here.
    detail: String,
    /// Times of each mesh: for each repeat, one time per model.
    times: Vec<Vec<[f64; 4]>>,
}

impl Series {
    fn measure(place: &'static str, detail: String, device: Option<&Device>) -> Result<Self, CaseError> {
        let times = CELLS.into_iter().map(|cells| measure(cells, device)).collect::<Result<_, _>>()?;
        Ok(Self { place, detail, times })
    }

    /// For each mesh its elements and the median of a function of the times.
    fn points(&self, of: impl Fn(&[f64; 4]) -> f64) -> Vec<(f64, f64)> {
        let median = |(cells, times): (usize, &Vec<_>)| (cells.pow(3) as f64, median(times, &of));
        CELLS.into_iter().zip(&self.times).map(median).collect()
    }

    /// Adds times of the models, and their ratios.
    fn add_figures(&self, findings: &mut Findings) -> Result<(), CaseError> {
        let mut curves = Vec::new();
        for (model, name) in MODELS.into_iter().enumerate() {
            let points = self.points(|t| 1e3 * t[model]);
            curves.push(Curve::new(name, model, Pen::Line, points.clone()));
            curves.push(Curve::new("", model, Pen::Markers, points));
        }
        let caption = format!(
            "On the {}{}: median of the repeats, interleaved; single precision.",
            self.place, self.detail
        );
        findings.figures.push(plot("Time of a step", "time [ms]", &curves).figure(caption)?);
        let mut curves = Vec::new();
        let ratios = [("TIE / NHE", 1, 0), ("TIV / TIE", 3, 1), ("TIV / NHE", 3, 0)];
        for (colour, (name, above, below)) in ratios.into_iter().enumerate() {
            let points = self.points(|t| t[above] / t[below]);
            curves.push(Curve::new(name, colour, Pen::Line, points.clone()));
            curves.push(Curve::new("", colour, Pen::Markers, points));
        }
        let figure = Plot { logarithmic: false, ..plot("Ratio of times", "ratio", &curves) };
        let caption = format!("On the {}{}: medians of the ratios within a repeat.", self.place, self.detail);
        findings.figures.push(figure.figure(caption)?);
        Ok(())
    }

    /// Times and ratios on the finest mesh.
    fn add_rows(&self, findings: &mut Findings) {
        let finest = self.times.last().map(Vec::as_slice).unwrap_or_default();
        let elements = CELLS[CELLS.len() - 1].pow(3);
        for (model, name) in MODELS.into_iter().enumerate() {
            let quantity = format!("{}, {name}: a step of {elements} hexahedra", self.place);
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
            let quantity = format!("{}, {name}", self.place);
            findings.rows.push(Row::timed(quantity, "", reference, ratio, source));
        }
    }
}

fn plot<'a>(title: &'a str, axis: &'a str, curves: &'a [Curve]) -> Plot<'a> {
    Plot { title, axes: ["elements", axis], logarithmic: true, key: Key::UpperLeft, curves }
}

fn compute() -> Result<Findings, CaseError> {
    let mut findings = Findings::default();
    let processor = Series::measure("CPU", ", all cores".into(), None)?;
    processor.add_figures(&mut findings)?;
    processor.add_rows(&mut findings);
    match Device::open(None) {
        Ok(device) => {
            let adapter = device.adapter();
            let detail = format!(" ({})", adapter_name(adapter));
            let on_device = Series::measure("GPU", detail, Some(&device))?;
            on_device.add_figures(&mut findings)?;
            on_device.add_rows(&mut findings);
            add_ratio(&mut findings, &processor, &on_device)?;
        }
        Err(GpuError::NoAdapter) => {}
        Err(error) => return Err(error.into()),
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
            let steps = CELLS.into_iter().map(|cells| (cells.pow(3) as f64, critical(material, cells)));
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

/// Speed-up of the GPU, for the most complete model.
fn add_ratio(findings: &mut Findings, processor: &Series, on_device: &Series) -> Result<(), CaseError> {
    let (slow, fast) = (processor.points(|t| t[3]), on_device.points(|t| t[3]));
    let points: Vec<_> = slow.iter().zip(&fast).map(|(slow, fast)| (slow.0, slow.1 / fast.1)).collect();
    let largest = points.iter().map(|point| point.1).fold(0.0, f64::max);
    let curves = [Curve::new("TIV", 3, Pen::Line, points.clone()), Curve::new("", 3, Pen::Markers, points)];
    let figure = Plot { logarithmic: false, ..plot("CPU over GPU", "ratio", &curves) };
    let caption =
        format!("Time of a step on all cores over that on the {}{}.", on_device.place, on_device.detail);
    findings.figures.push(figure.figure(caption)?);
    let quantity = format!("TIV, CPU over {}, largest ratio", on_device.place);
    let source = "thesis, one core of 2006 over a GeForce 8800 GTX";
    findings.rows.push(Row::timed(quantity, "", Some(56.3), largest, source));
    Ok(())
}
