//! Snapshots.

use std::sync::Arc;

use numpy::PyArray2;
use pyo3::prelude::*;

use crate::arrays::array3;
use crate::errors::Trouble;
use crate::running::Running;

/// A snapshot: displacements, velocities, and what relaxing tissue remembers.
#[derive(Clone)]
#[pyclass(frozen, module = "pliant._native")]
pub struct State {
    snapshot: Snapshot,
    time: f64,
    steps: u64,
    displacement: Arc<Vec<f64>>,
}

#[derive(Clone)]
enum Snapshot {
    Whole(Arc<pliant_sim::SimulationState>),
    /// Bytes from a file or another process, of no setup yet.
    Bytes(Arc<Vec<Vec<u8>>>),
}

impl State {
    pub fn of(running: &mut Running) -> Result<Self, Trouble> {
        let snapshot = Snapshot::Whole(Arc::new(running.live.simulation.state()?));
        let displacement = Arc::new(running.nodal(|now, _, node| now.displacement(node)));
        let simulation = running.simulation();
        Ok(Self { snapshot, time: simulation.time(), steps: simulation.steps(), displacement })
    }

    /// Returns the state for the setup of a run.
    pub fn taken(&self, running: &Running) -> Result<pliant_sim::SimulationState, Trouble> {
        let setup = running.simulation().setup();
        let other =
            || Trouble::Value("the state is of a model with other meshes, solvers or precision".into());
        match &self.snapshot {
            // Another setup refuses it when it is taken up.
            Snapshot::Whole(state) => Ok((**state).clone()),
            Snapshot::Bytes(bytes) => pliant_sim::SimulationState::decode(setup, bytes).ok_or_else(other),
        }
    }
}

#[pymethods]
impl State {
    /// From its bytes.
    #[staticmethod]
    fn decoded(bytes: Vec<Vec<u8>>, time: f64, steps: u64, displacement: Vec<f64>) -> Self {
        Self { snapshot: Snapshot::Bytes(Arc::new(bytes)), time, steps, displacement: Arc::new(displacement) }
    }

    /// Its bytes, time [s], steps and displacements [m].
    #[allow(clippy::type_complexity, reason = "the arguments of `decoded`")]
    fn encoded(&self) -> Result<(Vec<std::borrow::Cow<'_, [u8]>>, f64, u64, Vec<f64>), Trouble> {
        let bytes = match &self.snapshot {
            Snapshot::Whole(state) => {
                let bytes = state.encode().map_err(|error| Trouble::Internal(error.to_string()))?;
                bytes.into_iter().map(Into::into).collect()
            }
            Snapshot::Bytes(bytes) => bytes.iter().map(|part| part.as_slice().into()).collect(),
        };
        Ok((bytes, self.time, self.steps, self.displacement.to_vec()))
    }

    #[getter]
    fn time(&self) -> f64 {
        self.time
    }

    #[getter]
    fn steps(&self) -> u64 {
        self.steps
    }

    /// Displacements [m], (nodes, 3).
    fn displacement<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        array3(py, self.displacement.to_vec())
    }
}
