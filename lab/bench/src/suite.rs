//! Measuring cases one after another.
//!
//! Each cube is fixed at `x-min` and starts compressed and sheared uniformly, with `x-max` fixed in its
//! displaced position. All cells are thus deformed from the first step, and keep vibrating. After a warm-up,
//! each repeat takes enough steps for [`Settings::seconds`].

use std::sync::Arc;

use pliant_explicit::{MissingInstructions, Scalar, State, StepError};
use pliant_gpu::{Device, DeviceRates, GpuError, StepFailure};
use pliant_implicit::SolveError;
use pliant_mechanics::Model;
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::model::Contradiction;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

use crate::case::{Case, EDGE, Element, LawKind, Place, Precision, Threads};
use crate::clock::{Clocked, ClockedOnDevice, Spread, Timed};
use crate::report::{Cube, Fit, Limit, Measured, OnDevice, Refused, Report, Row};
use crate::settings::Settings;
use crate::{Machine, Rates, Specimen};

/// Displacement of `x-max` [m]; a node at x has the part x/[`EDGE`].
const SQUEEZE: [f64; 3] = [-0.02 * EDGE, 0.01 * EDGE, 0.005 * EDGE];
/// Largest number of cells for which the critical time step of the assembled model is computed. It costs as
/// much as some 100 steps in double precision. For a cube in real time it is always computed.
const CELLS_OF_ASSEMBLED: usize = 100_000;
/// Fraction of the limit that a run takes as its step: the critical step of a row.
const PART_OF_LIMIT: f64 = 0.9;
/// Fraction of the limit for timed steps. The length of a step does not change its cost. The cubes vibrate
/// for tens of thousands of steps without damping and without step reduction.
const PART_UNDER_THE_CLOCK: f64 = 0.5;

/// The progress of a measurement.
#[derive(Clone, Debug)]
pub struct Progress {
    /// Part of the cases done.
    pub part: f64,
    /// The current case.
    pub now: String,
}

/// The error of a measurement.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// A step failed.
    #[error("`{id}`: {source}; {}", source.remedy())]
    Step {
        /// The case.
        id: String,
        /// Reason.
        source: StepError,
    },
    /// Constraints contradict each other.
    #[error(transparent)]
    Contradiction(#[from] Contradiction),
    /// The CPU lacks the requested instructions.
    #[error(transparent)]
    Lanes(#[from] MissingInstructions),
    /// An implicit step of shells failed.
    #[error("shells: {0}")]
    Shells(#[from] SolveError),
    /// No threads.
    #[error("{0}")]
    Threads(#[from] ThreadPoolBuildError),
    /// No device, or it failed.
    #[error("{source}; {}", source.remedy())]
    Device {
        /// Reason.
        #[from]
        source: GpuError,
    },
}

/// Measures cases in their order. A series of three or more meshes also gives its linear cost and the largest
/// cube in real time.
///
/// # Errors
/// If threads cannot be started or a step fails.
pub fn measure(
    cases: &[Case],
    settings: Settings,
    progress: &mut dyn FnMut(Progress),
) -> Result<Report, BenchError> {
    let mut bench =
        Bench { machine: Machine::this(), settings, pools: Vec::new(), device: None, limits: Vec::new() };
    let mut rows = Vec::new();
    let mut refused = Vec::new();
    for (done, case) in cases.iter().enumerate() {
        progress(Progress { part: done as f64 / cases.len() as f64, now: case.id() });
        match bench.row(case, CELLS_OF_ASSEMBLED) {
            Ok(row) => rows.push(row),
            // The other meshes can still be measured.
            Err(BenchError::Device { source }) if source.is_about_the_model() => {
                refused.push(Refused { id: case.id(), reason: source.to_string() });
            }
            Err(error) => return Err(error),
        }
    }
    progress(Progress { part: 1.0, now: "largest cubes in real time".into() });
    let fits = Fit::of_rows(&rows);
    let mut cubes = Vec::new();
    for fit in &fits {
        if let Some(case) = largest_in_real_time(fit, &rows) {
            cubes.push(bench.cube(case)?);
        }
    }
    let rates = bench.pools.iter().map(|(_, rates)| *rates).collect();
    let device = bench.device.map(|(device, rates)| OnDevice { adapter: device.adapter().clone(), rates });
    Ok(Report { machine: bench.machine, settings, rates, device, rows, refused, fits, cubes })
}

/// The cube of n³ grid cells whose step is predicted to take as long as it simulates. T = b k n³ for k cells
/// in a grid cell, and Δt = d/n, give n⁴ = d/(b k). Computed for the tissues of thesis Fig. 6.7 on all
/// threads.
fn largest_in_real_time(fit: &Fit, rows: &[Row]) -> Option<Case> {
    let thesis = matches!(fit.case.element, Element::Tet4 | Element::Hex8)
        && matches!(fit.case.law, LawKind::NeoHookean | LawKind::FibresProny)
        && fit.case.precision == Precision::Single
        && fit.case.place != Place::Processor(Threads::One);
    // Extrapolates from the finest mesh with a known critical time step of the assembled model, else from the
    // finest mesh.
    let known = rows.iter().filter(|row| fit.covers(&row.case));
    let finest = known.max_by_key(|row| (row.critical_step_from == Limit::True, row.cells))?;
    let d = finest.critical_step * finest.case.edge as f64;
    let per_grid_cell = 1e-9 * fit.ns_per_element_step * fit.case.element.cells(1) as f64;
    let edge = (d / per_grid_cell).powf(0.25).floor() as usize;
    (thesis && edge > 0).then_some(Case { edge, ..fit.case })
}

/// State shared by the cases.
struct Bench {
    machine: Machine,
    settings: Settings,
    pools: Vec<(ThreadPool, Rates)>,
    device: Option<(Device, DeviceRates)>,
    /// Known limits [s]: they do not depend on precision, threads and relaxation.
    limits: Vec<((Element, bool, usize), f64)>,
}

impl Bench {
    /// The threads and their peak rates, measured at first use.
    fn pool(&mut self, threads: Threads) -> Result<&(ThreadPool, Rates), BenchError> {
        let count = threads.count();
        let known = self.pools.iter().position(|(_, rates)| rates.threads == count);
        let index = match known {
            Some(index) => index,
            None => {
                let pool = ThreadPoolBuilder::new().num_threads(count).build()?;
                let rates = Rates::measure(&pool, self.settings.repeats);
                self.pools.push((pool, rates));
                self.pools.len() - 1
            }
        };
        Ok(&self.pools[index])
    }

    /// The device and its peak rates, opened and measured at first use.
    fn device(&mut self) -> Result<&(Device, DeviceRates), BenchError> {
        if self.device.is_none() {
            let device = Device::open(None)?;
            let rates = DeviceRates::measure(&device, self.settings.repeats)?;
            self.device = Some((device, rates));
        }
        self.device.as_ref().ok_or(GpuError::NoAdapter.into())
    }

    /// Measures a case; up to `most` cells it computes the critical time step of the assembled
    /// model.
    fn row(&mut self, case: &Case, most: usize) -> Result<Row, BenchError> {
        let specimen = squeezed(case.specimen());
        let (limit, from) = self.limit(case, &specimen, most);
        let (step, settings) = (PART_UNDER_THE_CLOCK * limit, self.settings);
        let model = Arc::new(specimen.model);
        let (seconds, place) = match case.place {
            Place::Processor(threads) => {
                let processor = self.machine.processor.clone();
                let (pool, rates) = self.pool(threads)?;
                let seconds = pool.install(|| match case.precision {
                    Precision::Single => on_processor::<f32>(case, &model, step, settings),
                    Precision::Double => on_processor::<f64>(case, &model, step, settings),
                })?;
                let peaks = Some([rates.copy, rates.multiply_add(case.precision)]);
                let threads = Some(rates.threads);
                let (design, lanes) = ("cpu".to_owned(), Some(settings.lanes));
                (seconds, Measured { adapter: processor, threads, design, lanes, peaks })
            }
            Place::Device(design) => {
                let (device, _) = self.device()?;
                let start = start::<f32>(&model);
                let mut clocked = ClockedOnDevice::new(device, model, step, design, start)?;
                let seconds = repeats(&mut clocked, settings).map_err(|failure| match failure {
                    StepFailure::Step(source) => BenchError::Step { id: case.id(), source },
                    StepFailure::Device(error) => error.into(),
                })?;
                let (adapter, design) = (device.adapter().name.clone(), design.to_string());
                (seconds, Measured { adapter, threads: None, design, lanes: None, peaks: None })
            }
        };
        Ok(Row::new(*case, place, Spread::of(seconds), (PART_OF_LIMIT * limit, from)))
    }

    /// Measures a cube of the predicted size, then of the size estimated from the measurement, at most
    /// three in all.
    fn cube(&mut self, mut case: Case) -> Result<Cube, BenchError> {
        let predicted = case.edge;
        let mut row = self.row(&case, usize::MAX)?;
        for _ in 0..2 {
            let edge = ((case.edge as f64 * row.real_time_factor.powf(0.25)) as usize).max(1);
            if edge == case.edge {
                break;
            }
            case.edge = edge;
            row = self.row(&case, usize::MAX)?;
        }
        Ok(Cube { predicted, row })
    }

    /// The largest stable step at rest [s], and its source.
    fn limit(&mut self, case: &Case, specimen: &Specimen, most: usize) -> (f64, Limit) {
        if case.cells() > most {
            return (specimen.element_bound(), Limit::ElementBound);
        }
        let key = (case.element, case.law.has_fibres(), case.edge);
        let known = self.limits.iter().find(|(of, _)| *of == key).map(|(_, limit)| *limit);
        let limit = known.unwrap_or_else(|| {
            let limit = specimen.critical_step();
            self.limits.push((key, limit));
            limit
        });
        (limit, Limit::True)
    }
}

/// Fixes `x-min` and displaces `x-max` by [`SQUEEZE`].
fn squeezed(specimen: Specimen) -> Specimen {
    let hold = Curve { shape: Shape::Hold, from: 0.0, to: 1.0 };
    specimen.fix("x-min", [true; 3]).carry("x-max", SQUEEZE, hold)
}

/// State in which every cell is deformed equally.
fn start<R: Scalar>(model: &Model) -> State<R> {
    let displacement = model.rest.iter().map(|x| SQUEEZE.map(|by| R::of(by * x[0] / EDGE))).collect();
    State { displacement, ..State::at_rest(model) }
}

/// Wall times of a step on the current pool [s].
fn on_processor<R: Scalar>(
    case: &Case,
    model: &Arc<Model>,
    step: f64,
    settings: Settings,
) -> Result<Vec<f64>, BenchError> {
    let clocked = Clocked::new(Arc::clone(model), step, start::<R>(model))?;
    let mut clocked = clocked.in_lanes(settings.lanes)?;
    repeats(&mut clocked, settings).map_err(|source| BenchError::Step { id: case.id(), source })
}

/// Wall times of a step [s] after warm-up.
fn repeats<T: Timed>(clocked: &mut T, settings: Settings) -> Result<Vec<f64>, T::Error> {
    // A driver compiles kernels at their first run, which is not part of the cost of a step.
    clocked.seconds_per_step(1)?;
    // A GPU at rest has a low clock rate, which rises while it works.
    if T::WARM_UP > 0.0 {
        clocked.steps_within(T::WARM_UP)?;
    }
    let steps = clocked.steps_within(settings.seconds)?;
    (0..settings.repeats.max(1)).map(|_| clocked.seconds_per_step(steps)).collect()
}

#[cfg(test)]
mod tests {
    use pliant_explicit::Instructions;

    use super::*;
    use crate::find;

    fn row(id: &str, ns: f64) -> Row {
        let case = find(id).unwrap();
        let threads = (case.place == Place::Processor(Threads::All)).then(|| Threads::All.count());
        let place = Measured {
            adapter: String::new(),
            threads,
            design: "cpu".into(),
            lanes: Some(Instructions::Plain),
            peaks: Some([1e10, 1e11]),
        };
        let seconds = 1e-9 * ns * case.cells() as f64;
        let spread = Spread { median: seconds, least: seconds, most: seconds };
        // Δt = 5 ms/n.
        Row::new(case, place, spread, (5e-3 / case.edge as f64, Limit::True))
    }

    #[test]
    fn a_cube_of_the_predicted_size_takes_as_long_as_it_simulates() {
        let rows = ["hex8-nh-1000-all", "hex8-nh-4096-all", "hex8-nh-15625-all"].map(|id| row(id, 50.0));
        let fits = Fit::of_rows(&rows);
        assert_eq!(fits.len(), 1);
        assert!((fits[0].ns_per_element_step - 50.0).abs() < 1e-9 && fits[0].largest_deviation < 1e-12);
        // n⁴ = 5e-3/50e-9 = 10⁵, n = 17.78.
        assert_eq!(largest_in_real_time(&fits[0], &rows).unwrap().edge, 17);
    }

    #[test]
    fn a_cost_that_is_not_linear_shows_as_a_deviation() {
        let rows = [("hex8-nh-1000", 40.0), ("hex8-nh-4096", 40.0), ("hex8-nh-15625", 60.0)]
            .map(|(id, ns)| row(id, ns));
        let fit = &Fit::of_rows(&rows)[0];
        assert!((40.0..60.0).contains(&fit.ns_per_element_step));
        assert!(fit.largest_deviation > 0.2 && fit.farthest == 15625);
        assert!(Fit::of_rows(&rows[..2]).is_empty());
    }

    #[test]
    fn every_cell_of_a_cube_is_deformed_from_the_first_step_on() {
        let case = find("tet4-nh-6000").unwrap();
        let specimen = squeezed(case.specimen());
        let step = 0.5 * specimen.element_bound();
        let settings = Settings { repeats: 1, seconds: 0.0, ..Settings::default() };
        assert!(on_processor::<f32>(&case, &specimen.model.clone().into(), step, settings).unwrap()[0] > 0.0);
        let displacement = start::<f64>(&specimen.model).displacement;
        let rest = State::<f64>::at_rest(&specimen.model).displacement;
        assert!(
            specimen.face("x-max").iter().all(|&node| displacement[node as usize] == rest[node as usize])
        );
        let cells = &specimen.model.solids[0].cells;
        for cell in 0..cells.len() {
            let along_x = || cells.nodes(cell).iter().map(|&node| displacement[node as usize][0]);
            let spread = along_x().fold(f64::MIN, f64::max) - along_x().fold(f64::MAX, f64::min);
            assert!((spread - 0.02 * EDGE / 10.0).abs() < 1e-12, "cell {cell}: {spread}");
        }
    }
}
