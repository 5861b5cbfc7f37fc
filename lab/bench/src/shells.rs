//! Implicit steps of shells. The body is a tube like a bowel (radius 20 mm, length 200 mm, wall 2 mm, E = 0.1
//! MPa, ν = 0.45, both ends fixed). Its pressure pulses between 0 and 1 kPa twice a second, in steps of 40 ms
//! with one linear solution each. Conjugate gradients run to a residual of 0.1 % on the CPU, and on the best
//! GPU.

use std::f64::consts::TAU;
use std::fmt::Write;
use std::sync::Arc;
use std::time::{Duration, Instant};

use pliant_gpu::{Device, GpuError, Kind};
use pliant_implicit::AssemblySolver;
use pliant_implicit::{
    Assembly, AssemblyState, BackwardEuler, DynamicSettings, ModelError, Phases, Shell, SolveError,
};
use pliant_linear::{LinearDevice, LinearSolver, Preconditioner};
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::load::{Load, LoadKind, Spread};
use pliant_mechanics::model::{Constraint, Motion};
use pliant_meshing::{DEFAULT_CELL_LIMIT, Pattern, Sheet};
use pliant_shells::element::Wall;
use pliant_shells::element::{Bending, Elasticity, Formulation, Membrane};

use crate::suite::{BenchError, Progress};
use crate::{Machine, Spread as Times};

/// Length of a step [s].
pub const SHELL_STEP: f64 = 0.04;
/// Residual over the loads at which conjugate gradients stop.
const TOLERANCE: f64 = 1e-3;
/// Number of shells of each tube, and number of measured steps.
const TUBES: [(usize, usize); 4] = [(800, 50), (4000, 40), (20_000, 20), (50_000, 10)];
/// Steps before those that count: drivers compile kernels in the first one.
const WARM_UP: usize = 3;
/// The most shells on a GPU that is software.
const ON_SOFTWARE: usize = 4000;

/// The tube, with about this number of shells.
///
/// # Errors
/// If the walls can't be made, which a number of at least 6 rules out.
///
/// # Panics
/// If there are more triangles than a mesh has.
pub fn tube(shells: usize) -> Result<Assembly, ModelError> {
    // Cells about as long as wide: 2 a n = shells with n/a = 200/(40 π).
    let around = ((shells as f64 / 2.0) * (0.02 * TAU) / 0.2).sqrt().round().max(3.0) as usize;
    let along = (shells / 2 / around).max(1);
    let cylinder = Sheet::Cylinder { radius: 0.02, length: 0.2, from: 0.0, span: TAU };
    let mesh = cylinder.mesh([around, along], Pattern::Diagonal, None, DEFAULT_CELL_LIMIT);
    let mesh = mesh.unwrap_or_else(|error| panic!("{error}"));
    let cells = mesh.blocks[0].cells().map(|cell| [cell[0], cell[1], cell[2]]).collect();
    let material = Wall { elastic: Elasticity { young: 1e5, poisson: 0.45 }, density: 1000.0 };
    let mut model = Assembly::new("shell", mesh.points);
    let formulation = Formulation { membrane: Membrane::Opt { adaptation: 10.0 }, bending: Bending::Dkt };
    model.add_shell(&Shell { formulation, ..Shell::new("tube", cells, 0.002, material) })?;
    let last = (around * (along + 1)) as u32;
    model.model_mut().constraints.push(Constraint {
        name: "ends".into(),
        nodes: (0..around as u32).chain(last - around as u32..last).collect(),
        components: [true; 6],
        motion: Motion::Fixed,
    });
    let kind = LoadKind::ShellPressure {
        facets: (0..model.facets.len() as u32).collect(),
        pressure: 1000.0,
        spread: Spread::Lumped,
    };
    let pulse = (0..40).map(|i| (0.25 * f64::from(i), f64::from(i % 2))).collect();
    let curve = Curve { shape: Shape::Table(pulse), from: 0.0, to: 1.0 };
    model.model_mut().loads.push(Load::new("pressure", kind, curve));
    model.model_mut().bodies[0].damping = 1.0;
    Ok(model)
}

/// Cost of the steps of a tube.
#[derive(Clone, Debug)]
pub struct ShellRun {
    /// Shells.
    pub shells: usize,
    /// Wall times of a step [s].
    pub time: Times,
    /// Wall times of the parts of all steps.
    pub phases: Phases,
    /// Steps.
    pub steps: usize,
    /// The largest residual over the loads.
    pub residual: f64,
    /// State at the end.
    pub last: AssemblyState,
}

impl ShellRun {
    /// Takes some steps of the tube, on the CPU or with a GPU, after others that do not count.
    ///
    /// # Errors
    /// If a step fails.
    pub fn measure(
        shells: usize,
        settings: DynamicSettings,
        device: Option<&Device>,
        [before, steps]: [usize; 2],
    ) -> Result<Self, SolveError> {
        let model = tube(shells)?;
        let device = device.map(|device| Arc::new(device.clone()) as Arc<dyn LinearDevice>);
        let mut solver = BackwardEuler::on(device, model.clone(), settings)?;
        let mut state = AssemblyState::at_rest(&model);
        let (mut times, mut residual) = (Vec::with_capacity(steps), 0.0_f64);
        for _ in 0..before {
            solver.advance(&mut state)?;
        }
        let begun = solver.phases();
        for _ in 0..steps {
            let start = Instant::now();
            residual = residual.max(solver.advance(&mut state)?.linear.residual);
            times.push(start.elapsed().as_secs_f64());
        }
        let (time, phases) = (Times::of(times), solver.phases().since(&begun));
        Ok(Self { shells: model.facets.len(), time, phases, steps, residual, last: state })
    }

    /// Mean time per step [ms], from the time of all steps.
    fn mean(&self, total: Duration) -> f64 {
        1e3 * total.as_secs_f64() / self.steps as f64
    }
}

/// Steps of shells on the CPU and on a GPU.
#[derive(Clone, Debug)]
pub struct ShellReport {
    machine: Machine,
    adapter: String,
    rows: Vec<(&'static str, &'static str, ShellRun)>,
    /// The largest difference between displacements on the GPU and on the CPU over the largest displacement.
    off: f64,
}

/// One linear solution a step, by conjugate gradients.
fn real_time(preconditioner: Preconditioner) -> DynamicSettings {
    let linear = LinearSolver::ConjugateGradients { tolerance: TOLERANCE, iterations: 5000, preconditioner };
    DynamicSettings::new(SHELL_STEP).real_time(linear)
}

/// Measures tubes of 800 to 50,000 shells, also on a GPU if there is one. On a software GPU it measures up to
/// 4,000 shells.
///
/// # Errors
/// If the GPU or a step fails.
pub fn measure_shells(progress: &mut dyn FnMut(Progress)) -> Result<ShellReport, BenchError> {
    let device = match Device::open(None) {
        Ok(device) => Some(device),
        Err(GpuError::NoAdapter) => None,
        Err(error) => return Err(error.into()),
    };
    let takes = |device: &&Device, shells| device.adapter().kind != Kind::Software || shells <= ON_SOFTWARE;
    let (mut rows, mut off) = (Vec::new(), 0.0_f64);
    for (done, (shells, steps)) in TUBES.into_iter().enumerate() {
        let ways = [("blocks", Preconditioner::BlockJacobi), ("aggregates", Preconditioner::Aggregates)];
        for (at, (name, preconditioner)) in ways.into_iter().enumerate() {
            let part = (done * ways.len() + at) as f64 / (TUBES.len() * ways.len()) as f64;
            progress(Progress { part, now: format!("{shells} shells, {name}") });
            let settings = real_time(preconditioner);
            let cpu = ShellRun::measure(shells, settings, None, [WARM_UP, steps])?;
            let gpu = match device.as_ref().filter(|device| takes(device, shells)) {
                Some(device) => Some(ShellRun::measure(shells, settings, Some(device), [WARM_UP, steps])?),
                None => None,
            };
            if let Some(gpu) = &gpu {
                let model = tube(shells).map_err(SolveError::from)?;
                off = off.max(difference(&gpu.last, &cpu.last, &AssemblyState::at_rest(&model)));
            }
            rows.push(("cpu", name, cpu));
            rows.extend(gpu.map(|gpu| ("gpu", name, gpu)));
        }
    }
    let adapter = device.map_or_else(
        || "no GPU".to_owned(),
        |device| {
            let adapter = device.adapter();
            format!("{} ({}, {})", adapter.name, adapter.kind, adapter.driver)
        },
    );
    Ok(ShellReport { machine: Machine::this(), adapter, rows, off })
}

/// The largest distance between nodes of two states over the largest displacement.
fn difference(one: &AssemblyState, other: &AssemblyState, rest: &AssemblyState) -> f64 {
    let largest = |to: &AssemblyState| {
        let apart = other.position.iter().zip(&to.position).map(|(a, b)| (a - b).norm());
        apart.fold(0.0, f64::max)
    };
    largest(one) / largest(rest)
}

impl ShellReport {
    /// A table in Markdown.
    pub fn table(&self) -> String {
        let Machine { processor, cores, system } = &self.machine;
        let mut text = format!(
            "{processor}, {cores} cores, {system}; {}.\n\n\
             Implicit steps of 40 ms, one linear solution each, conjugate gradients to a residual of 0.1 %: medians and means [ms].\n\
             Of a GPU, upload is part of preparation, iterations and read-back are part of solution.\n\n\
             | shells | solver | step | least–most | cells | preparation | solution | upload | iterating | read-back | iterations | residual | left to CPU |\n\
             |-------:|:-------|-----:|-----------:|------:|------------:|---------:|-------:|----------:|----------:|-----------:|---------:|------------:|\n",
            self.adapter
        );
        for (place, name, run) in &self.rows {
            let Phases { cells, preparation, solution, device, iterations, left_to_cpu, .. } = run.phases;
            let [cells, preparation, solution] =
                [cells, preparation, solution].map(|duration| run.mean(duration));
            let of_device =
                [device.upload, device.iterations, device.read_back].map(|duration| match *place {
                    "gpu" => format!("{:.2}", run.mean(duration)),
                    _ => String::new(),
                });
            let [upload, iterating, read_back] = of_device;
            let Times { median, least, most } = run.time;
            let [median, least, most] = [median, least, most].map(|seconds| 1e3 * seconds);
            // Writing to a String cannot fail.
            let _ = writeln!(
                text,
                "| {} | {place}, {name} | {median:.2} | {least:.2}–{most:.2} | {cells:.2} | {preparation:.2} | {solution:.2} | {upload} | \
                 {iterating} | {read_back} | {:.1} | {:.1e} | {left_to_cpu} |",
                run.shells,
                iterations as f64 / run.steps as f64,
                run.residual,
            );
        }
        if self.rows.iter().any(|(place, ..)| *place == "gpu") {
            let off = self.off;
            let _ = write!(
                text,
                "\nDisplacements at the end differ between GPU and CPU by at most {off:.1e} of the largest."
            );
        }
        text
    }
}
