//! Models: worlds of scenes, constant and shared between simulations.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Arc;

use numpy::{PyArray1, PyArray2};
use pliant_geometry::Selection;
use pliant_mechanics::Energies;
use pliant_run::{Checkpoint, Options, OutputFolder, run_with, sampled_columns};
use pliant_scene::World;
use pliant_sim::{StopFlag, panicked};
use pyo3::prelude::*;

use crate::arrays::{array1, array3};
use crate::errors::{Trouble, diagnostics};
use crate::jobs::on_pool;
use crate::mesh::Mesh;

/// A model.
#[pyclass(frozen, weakref, module = "pliant._native")]
pub struct Model {
    pub world: Arc<World>,
}

impl Model {
    pub fn new(world: World) -> Self {
        Self { world: Arc::new(world) }
    }
}

/// Options of a run with files.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct RunOptions {
    until: Option<f64>,
    threads: u32,
    force: bool,
    resume: bool,
    picture: bool,
}

/// A body: its name, its first node, their number, its mesh, and the number that each node has in the file or
/// the given mesh.
type Body<'py> = (String, usize, usize, Mesh, Bound<'py, PyArray1<u32>>);

#[pymethods]
impl Model {
    /// Places of all nodes at rest [m], participant after participant.
    fn rest<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let parts = self.world.participants.iter();
        array3(py, parts.flat_map(|part| part.built.model.rest.as_flattened().to_vec()).collect())
    }

    /// Their masses [kg].
    fn mass<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let parts = self.world.participants.iter();
        array1(py, parts.flat_map(|part| part.built.model.mass.clone()).collect())
    }

    /// The step of all [s], and the largest stable one of the participant that is bound by it.
    fn steps(&self) -> (f64, Option<f64>, u64) {
        let limits = self.world.participants.iter().filter_map(|part| part.plan.limits.as_ref());
        let critical = limits.map(|limits| limits.critical.assembled.step).reduce(f64::min);
        (self.world.step(), critical, self.world.steps())
    }

    fn bodies<'py>(&self, py: Python<'py>) -> Vec<Body<'py>> {
        let (mut bodies, mut first) = (Vec::new(), 0);
        for part in &self.world.participants {
            let model = &part.built.model;
            for (body, built) in model.bodies.iter().zip(&part.built.bodies) {
                let nodes = body.nodes.len();
                let numbers = (0..built.mesh.points.len() as u32).map(|node| built.number_in_file(node));
                bodies.push((
                    built.name.clone(),
                    first + body.nodes.start as usize,
                    nodes,
                    Mesh(Arc::new(built.mesh.clone())),
                    array1(py, numbers.collect()),
                ));
            }
            first += model.node_count();
        }
        bodies
    }

    /// Names of constraints, contacts and tools.
    fn names(&self) -> BTreeMap<&'static str, Vec<String>> {
        let scene = &self.world.scene;
        fn of<T>(tables: &[(String, T)]) -> Vec<String> {
            tables.iter().map(|(name, _)| name.clone()).collect()
        }
        [
            ("constraints", of(&scene.constraints)),
            ("contacts", contact_names(&self.world)),
            ("tools", of(&scene.tools)),
            ("surfaces", of(&scene.surfaces)),
            ("laws", of(&scene.laws)),
        ]
        .into()
    }

    /// Names and units of the sampled columns.
    fn columns(&self) -> Vec<(String, &'static str)> {
        sampled_columns(&self.world).into_iter().map(|column| (column.name, column.unit)).collect()
    }

    fn notes(&self) -> Vec<String> {
        self.world.notes().cloned().collect()
    }

    fn warnings<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        diagnostics(py, &self.world.scene.source.errors(self.world.warnings().cloned().collect()))
    }

    /// Returns this model with another duration [s].
    fn lasting(&self, until: f64) -> Self {
        Self { world: Arc::new(self.world.lasting(until)) }
    }

    /// The device that it is stepped on.
    fn device(&self) -> String {
        self.world.device().map_or_else(|| "cpu".into(), |device| device.adapter().name.clone())
    }

    /// Nodes of a body that a selection of scenes means, as JSON.
    fn select(&self, body: &str, what: &str) -> Result<Vec<u32>, Trouble> {
        let wrong = |error: String| Trouble::Value(error);
        let selection: Selection = serde_json::from_str(what).map_err(|error| wrong(error.to_string()))?;
        let mut bodies = self.world.participants.iter().flat_map(|part| &part.built.bodies);
        let built = bodies.find(|built| built.name == body);
        let built = built.ok_or_else(|| wrong(format!("there is no body `{body}`")))?;
        selection.nodes(&built.mesh, &built.boundary).map_err(|error| wrong(error.to_string()))
    }

    /// Runs it with the outputs of its scene in a folder. The summary as JSON, the time [s] and the energies
    /// [J] at the end.
    fn run(
        &self,
        py: Python<'_>,
        out: PathBuf,
        options: RunOptions,
        each: Option<Py<PyAny>>,
    ) -> PyResult<(String, f64, [f64; 7])> {
        let RunOptions { until, threads, force, resume, picture } = options;
        let mut world = until.map_or_else(|| (*self.world).clone(), |until| self.world.lasting(until));
        world.scene.run.threads = threads;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(crate::errors::broken)?;
        let stop = StopFlag::default();
        let (flag, raised) = (stop.clone(), Arc::new(std::sync::Mutex::new(None::<PyErr>)));
        let kept = Arc::clone(&raised);
        let job = move || -> Result<_, Trouble> {
            let checkpoint = resume.then(|| Checkpoint::read(&out)).transpose()?;
            let world = match &checkpoint {
                Some(checkpoint) => checkpoint.continues(&world)?,
                None => world,
            };
            let folder = match &checkpoint {
                Some(checkpoint) => OutputFolder::reopen(out, &world.scene, checkpoint)?,
                None => OutputFolder::prepare(out, &world.scene, force)?,
            };
            let drawn = picture.then(|| pliant_command::FinalPicture::new(&world)).transpose();
            let drawn = drawn.map_err(|error| Trouble::Device(format!("{error}; {}", error.remedy())))?;
            let options = Options {
                resume: checkpoint.as_ref(),
                stop: Some(&flag),
                picture: drawn.as_ref().map(|drawn| drawn as &dyn pliant_run::Draw),
            };
            let mut report = |progress: pliant_run::Progress| {
                let Some(each) = &each else { return };
                let called = Python::attach(|py| {
                    each.call1(py, (progress.time, progress.until, progress.wall.as_secs_f64())).map(drop)
                });
                if let Err(error) = called {
                    flag.ask();
                    *kept.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = Some(error);
                }
            };
            let summary = run_with(&world, &folder, options, &mut report)?;
            let text =
                serde_json::to_string(&summary).map_err(|error| Trouble::Internal(error.to_string()))?;
            Ok((text, summary.time, in_order(&summary.energies)))
        };
        let job = || {
            let done = catch_unwind(AssertUnwindSafe(job));
            done.unwrap_or_else(|panic| Err(Trouble::Internal(panicked(&*panic).to_owned())))
        };
        let (summary, signal) = on_pool(py, &pool, &stop, job)?;
        signal?;
        if let Some(error) = raised.lock().unwrap_or_else(std::sync::PoisonError::into_inner).take() {
            return Err(error);
        }
        Ok(summary?)
    }
}

/// Returns the names of contacts; for a contact between several things, the names of its pairs.
pub fn contact_names(world: &World) -> Vec<String> {
    let contacts = world.participants.iter().filter_map(|part| part.built.contacts.as_ref());
    let mut names: Vec<String> =
        contacts.flat_map(|set| &set.contacts).map(|contact| contact.name.clone()).collect();
    let mut known = std::collections::BTreeSet::new();
    names.retain(|name| known.insert(name.clone()));
    names
}

/// Kinetic, internal, damping, external, hourglass and step-change energy [J], and the balance.
pub fn in_order(e: &Energies) -> [f64; 7] {
    [e.kinetic, e.internal, e.damping, e.external, e.hourglass, e.step_changes, e.balance]
}

/// The adapters of this machine, the best first.
#[pyfunction]
pub fn devices(py: Python<'_>) -> Vec<String> {
    py.detach(|| pliant_sim::gpu::adapters().into_iter().map(|adapter| adapter.name).collect())
}
