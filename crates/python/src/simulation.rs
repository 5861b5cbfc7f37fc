//! A simulation under way.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use numpy::ndarray::ArrayView2;
use numpy::{PyArray2, PyArrayMethods, PyReadonlyArray2, PyReadwriteArray2};
use pliant_format::tables::At;
use pliant_mechanics::grip::Grip;
use pliant_run::{Live, field_named};
use pliant_sim::pose_of;
use pliant_sim::{Reals, StopFlag, panicked};
use pyo3::prelude::*;

use crate::arrays::{array, array3, vectors};
use crate::errors::{Trouble, broken};
use crate::jobs::on_pool;
use crate::mesh::Mesh;
use crate::model::{Model, contact_names, in_order};
use crate::running::Running;
use crate::state::State;

/// A simulation. One call at a time: a second one fails at once.
#[pyclass(frozen, weakref, module = "pliant._native")]
pub struct Simulation {
    slot: Mutex<Slot>,
    pool: rayon::ThreadPool,
    stop: StopFlag,
    /// Bits of the time [s], to be read without a look at the slot; NaN where nothing is here.
    time: AtomicU64,
    /// The process that made it: threads don't come along into a fork.
    process: u32,
}

/// The time of a simulation that is not here.
const AWAY: u64 = f64::NAN.to_bits();

/// State of the run.
enum Slot {
    Here(Box<Running>),
    /// A call computes.
    Away,
    Closed {
        _kept: Kept,
    },
    Broken {
        _kept: Kept,
        message: String,
    },
}

/// The memory of a run that is over: views still look at it.
type Kept = Option<Box<Running>>;

/// A grip: nodes with weights, place [m], stiffness [N/m].
type Held = (Vec<(u32, f64)>, [f64; 3], f64);
/// A pose: place [m] and quaternion (x, y, z, w).
type Posed = ([f64; 3], [f64; 4]);
/// A pose, an opening [rad], a force [N] and a moment [N m].
type ToolNow = (Posed, f64, [f64; 3], Option<[f64; 3]>);

impl Simulation {
    fn slot(&self) -> Result<MutexGuard<'_, Slot>, Trouble> {
        if std::process::id() != self.process {
            let message = "the simulation was made before a fork, which leaves its threads behind; start processes by \"spawn\"";
            return Err(Trouble::Busy(message.into()));
        }
        Ok(self.slot.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Reads something that needs no computation.
    fn quick<T>(&self, read: impl FnOnce(&mut Running) -> T) -> Result<T, Trouble> {
        let mut slot = self.slot()?;
        let done = match &mut *slot {
            Slot::Here(running) => catch_unwind(AssertUnwindSafe(|| read(running))),
            other => return Err(other.trouble()),
        };
        done.map_err(|panic| {
            let message = panicked(&*panic).to_owned();
            self.time.store(AWAY, Ordering::Release);
            *slot = match std::mem::replace(&mut *slot, Slot::Away) {
                Slot::Here(running) => Slot::Broken { _kept: Some(running), message: message.clone() },
                other => other,
            };
            Trouble::Internal(message)
        })
    }

    /// Computes on the simulation's threads, without the interpreter.
    fn work<T: Send + 'static>(
        &self,
        py: Python<'_>,
        job: impl FnOnce(&mut Running, &StopFlag) -> Result<T, Trouble> + Send + 'static,
    ) -> PyResult<T> {
        let taken = {
            let mut slot = self.slot()?;
            match std::mem::replace(&mut *slot, Slot::Away) {
                Slot::Here(running) => {
                    self.time.store(AWAY, Ordering::Release);
                    running
                }
                other => {
                    let trouble = other.trouble();
                    *slot = other;
                    // To make an exception gives up the interpreter: who takes it up must find the slot open.
                    drop(slot);
                    return Err(trouble.into());
                }
            }
        };
        let stop = self.stop.clone();
        let done = on_pool(py, &self.pool, &self.stop, move || {
            let mut running = taken;
            let done = catch_unwind(AssertUnwindSafe(|| {
                let done = job(&mut running, &stop);
                running.refresh();
                done
            }));
            (running, done)
        });
        let ((running, done), signal) = done?;
        let broken = match &done {
            Ok(_) if running.is_in_place() => None,
            Ok(_) => Some(
                "displacements have moved in memory: this is a mistake of Pliant, please report it"
                    .to_owned(),
            ),
            Err(panic) => Some(panicked(&**panic).to_owned()),
        };
        let mut slot = self.slot()?;
        *slot = match &broken {
            Some(message) => Slot::Broken { _kept: Some(running), message: message.clone() },
            None => {
                self.time.store(running.simulation().time().to_bits(), Ordering::Release);
                Slot::Here(running)
            }
        };
        drop(slot);
        match (broken, done) {
            (None, Ok(done)) => {
                signal?;
                Ok(done?)
            }
            (broken, _) => Err(Trouble::Internal(broken.unwrap_or_default()).into()),
        }
    }
}

impl Slot {
    fn trouble(&self) -> Trouble {
        match self {
            Self::Here(_) | Self::Away => Trouble::Busy(
                "the simulation is busy with another call: make one call at a time, and take no steps within callbacks"
                    .into(),
            ),
            Self::Closed { .. } => Trouble::Closed,
            Self::Broken { message, .. } => {
                Trouble::Internal(format!("an earlier internal error ended the simulation: {message}"))
            }
        }
    }
}

#[pymethods]
impl Simulation {
    #[new]
    fn new(py: Python<'_>, model: &Model, threads: usize) -> PyResult<Self> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|_| "pliant".into())
            .build()
            .map_err(broken)?;
        let (world, stop) = (Arc::clone(&model.world), StopFlag::default());
        let flag = stop.clone();
        let made = on_pool(py, &pool, &stop, move || {
            catch_unwind(AssertUnwindSafe(|| {
                let mut live = Live::new(&world)?;
                live.simulation.stop_on(&flag);
                Ok(Running::new(live, world))
            }))
            .unwrap_or_else(|panic| Err(Trouble::Internal(panicked(&*panic).to_owned())))
        })?;
        made.1?;
        let running = Box::new(made.0?);
        let time = AtomicU64::new(running.simulation().time().to_bits());
        Ok(Self { slot: Mutex::new(Slot::Here(running)), pool, stop, time, process: std::process::id() })
    }

    /// Time [s].
    #[getter]
    fn time(&self) -> Result<f64, Trouble> {
        let time = f64::from_bits(self.time.load(Ordering::Acquire));
        if time.is_nan() { self.quick(|running| running.simulation().time()) } else { Ok(time) }
    }

    #[getter]
    fn steps(&self) -> Result<u64, Trouble> {
        self.quick(|running| running.simulation().steps())
    }

    /// Length [s] of the next step.
    #[getter]
    fn step_size(&self) -> Result<f64, Trouble> {
        self.quick(|running| running.simulation().step_length())
    }

    fn fingerprint(&self) -> Result<u64, Trouble> {
        self.quick(|running| running.simulation().fingerprint())
    }

    /// Reason why the run has ended before the last step of its scene.
    fn ended(&self) -> Result<Option<String>, Trouble> {
        self.quick(|running| running.simulation().ended().map(str::to_owned))
    }

    /// The view of displacements [m], (nodes, 3): read-only, without a copy.
    #[getter]
    fn displacement<'py>(slf: Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let simulation = slf.get();
        if simulation.quick(|running| running.world.device().is_some())? {
            simulation.work(slf.py(), |running, _| running.evaluate())?;
        }
        enum Place {
            Single(usize, usize),
            Double(usize, usize),
        }
        let place = simulation.quick(|running| match running.displacement() {
            Reals::Single(values) => Place::Single(values.as_ptr().expose_provenance(), values.len()),
            Reals::Double(values) => Place::Double(values.as_ptr().expose_provenance(), values.len()),
        })?;
        Ok(match place {
            Place::Single(address, nodes) => view::<f32>(slf.into_any(), address, nodes).into_any(),
            Place::Double(address, nodes) => view::<f64>(slf.into_any(), address, nodes).into_any(),
        })
    }

    /// Fills an array (nodes, 3) with positions [m].
    fn positions(&self, mut out: PyReadwriteArray2<'_, f64>) -> PyResult<()> {
        let values = self.quick(|running| running.positions())?;
        fill(&mut out, &values)
    }

    /// Fills an array (nodes, 3) with velocities [m/s] at the instant.
    fn velocities(&self, py: Python<'_>, mut out: PyReadwriteArray2<'_, f64>) -> PyResult<()> {
        let values = self.work(py, |running, _| {
            running.evaluate()?;
            Ok(running.nodal(|now, _, node| now.velocity(node)))
        })?;
        fill(&mut out, &values)
    }

    /// A field of a body or a surface, (n, numbers of each), at cells, at points, or where it is.
    fn field<'py>(
        &self,
        py: Python<'py>,
        name: String,
        on: String,
        cells: Option<bool>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let at = cells.map(|cells| if cells { At::Cells } else { At::Points });
        let (values, columns) = self.work(py, move |running, _| running.field(&name, &on, at))?;
        Ok(array(py, values, columns))
    }

    /// Kinetic, internal, damping, external, hourglass and step-change energy [J], and the balance.
    fn energies(&self, py: Python<'_>) -> PyResult<[f64; 7]> {
        self.work(py, |running, _| {
            running.evaluate()?;
            Ok(in_order(&running.simulation().energies()))
        })
    }

    /// Force [N] by which a constraint holds or moves its nodes; `None` without one of this name.
    fn reaction(&self, py: Python<'_>, constraint: String) -> PyResult<Option<[f64; 3]>> {
        self.work(py, move |running, _| Ok(running.live.simulation.frame()?.reaction(&constraint)))
    }

    /// Volume [m³] and pressure [Pa] of a constraint of volume.
    fn enclosed(&self, py: Python<'_>, constraint: String) -> PyResult<Option<[f64; 2]>> {
        self.work(py, move |running, _| {
            let found = running.live.simulation.frame()?.enclosed(&constraint);
            Ok(found.map(|cavity| [cavity.volume, cavity.pressure]))
        })
    }

    /// Returns the force [N] of each contact; for a contact between several things, the force of each pair.
    fn contacts(&self, py: Python<'_>) -> PyResult<BTreeMap<String, [f64; 3]>> {
        self.work(py, |running, _| {
            let names = contact_names(&running.world);
            let frame = running.live.simulation.frame()?;
            Ok(names
                .into_iter()
                .filter_map(|name| Some((name.clone(), frame.contact_force(&name)?)))
                .collect())
        })
    }

    /// Names and units of the sampled columns.
    fn columns(&self) -> Result<Vec<(String, &'static str)>, Trouble> {
        self.quick(|running| {
            running.live.columns().iter().map(|column| (column.name.clone(), column.unit)).collect()
        })
    }

    /// The sample of the instant.
    fn sample(&self, py: Python<'_>) -> PyResult<Vec<f64>> {
        self.work(py, |running, _| {
            running.evaluate()?;
            let mut row = Vec::new();
            running.live.sample(&mut row);
            Ok(row)
        })
    }

    /// Takes a number of steps, or steps until a time [s]; fewer after a signal or at the end of the run.
    /// Returns the number of steps taken.
    fn advance(&self, py: Python<'_>, steps: Option<u64>, until: Option<f64>) -> PyResult<u64> {
        self.work(py, move |running, stop| {
            let mut done = 0;
            loop {
                let simulation = &mut running.live.simulation;
                let left = match (steps, until) {
                    (Some(steps), _) => steps - done,
                    (None, until) => until.map_or(0, |until| simulation.steps_until(until)),
                };
                if left == 0 || simulation.ended().is_some() || stop.is_asked() {
                    return Ok(done);
                }
                match simulation.step(left) {
                    Ok(steps) => done += steps,
                    Err(failure) if failure.is_interrupted() => return Ok(done),
                    Err(failure) => return Err(failure.into()),
                }
            }
        })
    }

    /// Ends the call that computes now after its step, from any thread.
    fn interrupt(&self) {
        self.stop.ask();
    }

    /// Replaces all grips: nodes with weights, place [m], stiffness [N/m], at most the stable one of each.
    /// The stiffnesses taken.
    fn hold(&self, grips: Vec<Held>) -> PyResult<Vec<f64>> {
        let taken = self.quick(|running| {
            let nodes = running.nodes() as u32;
            if grips.iter().flat_map(|(nodes, ..)| nodes).any(|&(node, _)| node >= nodes) {
                return Err(Trouble::Value(format!(
                    "a grip names a node that does not exist; there are {nodes} nodes"
                )));
            }
            let simulation = running.simulation();
            let grip = |(nodes, place, stiffness)| {
                let mut grip = Grip { nodes, place, stiffness: 0.0 };
                grip.stiffness = f64::min(stiffness, simulation.stiffest(&grip));
                grip
            };
            running.grips = grips.into_iter().map(grip).collect();
            running.grip()?;
            Ok(running.grips.iter().map(|grip| grip.stiffness).collect())
        })?;
        Ok(taken?)
    }

    /// The point of a grip [m], and its force on the body [N].
    fn pulled(&self, grip: usize) -> Result<Option<[[f64; 3]; 2]>, Trouble> {
        self.quick(|running| running.grips.get(grip).map(|grip| running.simulation().pulled(grip)))
    }

    /// The surface around the place [m] that is nearest: nodes with weights.
    fn around(&self, at: [f64; 3], on: Option<String>, radius: Option<f64>) -> PyResult<Vec<(u32, f64)>> {
        Ok(self.quick(|running| running.around(at, on.as_deref(), radius))??)
    }

    /// Drives a tool to a pose and its jaws to an angle [rad] within a time [s]: when they arrive [s].
    fn drive(&self, tool: &str, pose: Option<Posed>, opening: Option<f64>, within: f64) -> PyResult<f64> {
        let refused = || {
            Trouble::Value(
                "the quaternion of a pose has length 0, or a number of the pose is not finite".into(),
            )
        };
        let pose = pose.map(|(place, turn)| pose_of(place, turn).ok_or_else(refused));
        let pose = pose.transpose()?;
        let arrival = self.quick(|running| running.live.simulation.lead(tool, pose, opening, within))?;
        Ok(arrival.map_err(|failure| Trouble::Value(failure.message))?)
    }

    /// Returns a tool: its pose, the angle between its jaws [rad], and the total contact force [N] on it. The
    /// last value is the moment about the tool's frame [N m].
    fn tool(&self, py: Python<'_>, name: String) -> PyResult<Option<ToolNow>> {
        self.work(py, move |running, _| {
            running.evaluate()?;
            Ok(running.simulation().tool(&name).map(|tool| {
                let (at, turn) = (tool.pose.translation.vector, tool.pose.rotation.coords);
                ((at.into(), turn.into()), tool.opening, tool.force, tool.torque)
            }))
        })
    }

    /// The forces on nodes [N] that were pushed, (nodes, 3); none without any.
    fn pushed<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        Ok(array3(py, self.quick(|running| running.simulation().pushed().as_flattened().to_vec())?))
    }

    /// Forces on nodes [N], (nodes, 3), until replaced; `None` takes them away.
    fn push(&self, forces: Option<PyReadonlyArray2<'_, f64>>) -> PyResult<()> {
        let forces = forces.as_ref().map(vectors).transpose()?.unwrap_or_default();
        self.quick(|running| running.live.simulation.push(&forces))?.map_err(Trouble::from)?;
        Ok(())
    }

    /// A snapshot.
    fn state(&self, py: Python<'_>) -> PyResult<State> {
        self.work(py, |running, _| State::of(running))
    }

    /// Goes back, or on, to a snapshot.
    fn restore(&self, py: Python<'_>, state: &State) -> PyResult<()> {
        let state = state.clone();
        self.work(py, move |running, _| {
            let state = state.taken(running)?;
            running.live.restore(state)?;
            running.grip()
        })
    }

    /// Continues with the numbers of another model. Returns false if its meshes, solvers or precision differ.
    fn exchange(&self, py: Python<'_>, model: &Model) -> PyResult<bool> {
        let world = Arc::clone(&model.world);
        self.work(py, move |running, _| {
            let goes_on = running.live.exchange(&world)?;
            if goes_on {
                running.world = world;
                running.show_again();
                running.grip()?;
            }
            Ok(goes_on)
        })
    }

    /// A mesh at rest with fields of the instant.
    fn mesh(&self, py: Python<'_>, fields: Vec<String>, on: Option<String>, cells: bool) -> PyResult<Mesh> {
        let at = if cells { At::Cells } else { At::Points };
        self.work(py, move |running, _| {
            let fields = fields.iter().map(|name| field_named(name)).collect::<Result<Vec<_>, _>>()?;
            Ok(Mesh(Arc::new(running.mesh(&fields, on.as_deref(), at)?.clone())))
        })
    }

    /// A picture as PNG.
    fn picture(
        &self,
        py: Python<'_>,
        field: Option<String>,
        size: [u32; 2],
        camera: Option<[f64; 2]>,
    ) -> PyResult<Vec<u8>> {
        self.work(py, move |running, _| crate::picture::draw(running, field.as_deref(), size, camera))
    }

    /// Ends the run. Its memory is freed with the last view.
    fn close(&self) -> Result<(), Trouble> {
        let mut slot = self.slot()?;
        *slot = match std::mem::replace(&mut *slot, Slot::Away) {
            Slot::Here(running) => {
                self.time.store(AWAY, Ordering::Release);
                Slot::Closed { _kept: Some(running) }
            }
            Slot::Away => return Err(Slot::Away.trouble()),
            other => other,
        };
        Ok(())
    }
}

/// Writes values into an array of the same size.
fn fill(out: &mut PyReadwriteArray2<'_, f64>, values: &[f64]) -> PyResult<()> {
    let mut out = out.as_array_mut();
    if out.len() != values.len() || out.ncols() != 3 {
        let message = format!("`out` has shape {:?}, expected ({}, 3)", out.shape(), values.len() / 3);
        return Err(Trouble::Value(message).into());
    }
    out.iter_mut().zip(values).for_each(|(out, value)| *out = *value);
    Ok(())
}

/// A read-only array (nodes, 3) over memory that lives as long as the simulation.
#[allow(unsafe_code, reason = "NumPy borrows the memory of the simulation, which the array keeps alive")]
fn view<T: numpy::Element>(
    simulation: Bound<'_, PyAny>,
    address: usize,
    nodes: usize,
) -> Bound<'_, PyArray2<T>> {
    let data: *const T = std::ptr::with_exposed_provenance(address);
    // SAFETY: the vector at this address has 3 · `nodes` numbers of this type, and stays there as long as the
    // simulation: `work` ends it where they have moved, and neither `close` nor a panic frees it. The array
    // holds a reference to the simulation, and is not writeable before anybody sees it. A thread that reads
    // it during a step may see two instants mixed, which the documentation says.
    unsafe {
        let rows = ArrayView2::from_shape_ptr((nodes, 3), data);
        let array = PyArray2::borrow_from_array(&rows, simulation);
        array.readwrite().make_nonwriteable();
        array
    }
}
