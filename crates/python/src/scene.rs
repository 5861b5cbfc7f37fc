//! Scenes: text to plain data of Python, checks, and models.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use pliant_scene::source::{Node, Source, Value};
use pliant_scene::{MeshCache, Scene, World, scene_file};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::errors::{Trouble, diagnostics};
use crate::jobs::on_thread;
use crate::mesh::Mesh;
use crate::model::Model;

/// Longest text of a scene [bytes], as of files.
const LONGEST: usize = 1 << 26;

/// A scene as Python hands it over: text, its name, the folder of its files, values that are set, and meshes from memory.
pub struct Given {
    text: String,
    name: String,
    folder: PathBuf,
    set: Vec<String>,
    meshes: BTreeMap<String, Arc<pliant_geometry::Mesh>>,
    /// Bodies whose meshes another model lends.
    lent: BTreeMap<String, Arc<pliant_geometry::Mesh>>,
}

type Meshes<'py> = BTreeMap<String, Bound<'py, Mesh>>;

/// Meshes as the engine shares them.
fn shared(meshes: Meshes<'_>) -> BTreeMap<String, Arc<pliant_geometry::Mesh>> {
    meshes.into_iter().map(|(name, mesh)| (name, Arc::clone(&mesh.get().0))).collect()
}

impl Given {
    fn new(
        (text, name, folder, set): (String, String, PathBuf, Vec<String>),
        meshes: Meshes<'_>,
        lent: Meshes<'_>,
    ) -> Result<Self, Trouble> {
        if text.len() > LONGEST {
            let size = text.len() >> 20;
            return Err(Trouble::Value(format!(
                "the text of the scene has {size} MiB, and 64 are the most; give large tables as meshes or files"
            )));
        }
        Ok(Self { text, name, folder, set, meshes: shared(meshes), lent: shared(lent) })
    }

    fn scene(self) -> Result<Scene, Trouble> {
        let mut source = Source::parse(self.name, self.text)?;
        let mut mistakes: Vec<_> =
            self.set.iter().filter_map(|set| source.assign(set).err()).map(|mistake| *mistake).collect();
        let mut meshes = self.meshes;
        for (body, mesh) in self.lent {
            let name = format!("{body}, lent");
            let given = Node {
                place: source.span(&["body", &body, "mesh"]),
                key_span: None,
                value: Value::String(name.clone()),
            };
            let table = Value::Table(vec![("given".to_owned(), given)]);
            mistakes.extend(source.set(&["body", &body, "mesh"], table).err().map(|mistake| *mistake));
            meshes.insert(name, mesh);
        }
        if !mistakes.is_empty() {
            return Err(source.errors(mistakes).into());
        }
        Ok(Scene::from_source(source.giving(meshes), self.folder)?)
    }
}

/// The tables of a scene's text as dictionaries.
#[pyfunction]
pub fn parse<'py>(py: Python<'py>, text: String, name: String) -> PyResult<Bound<'py, PyAny>> {
    if text.len() > LONGEST {
        return Err(Trouble::Value("the text of the scene is longer than 64 MiB".into()).into());
    }
    let source = on_thread(py, move || Ok(Source::parse(name, text)?))?;
    plain(py, source.root())
}

/// The text of the scene file that a path means, its name and its folder.
#[pyfunction]
pub fn read(path: PathBuf) -> Result<(String, String, PathBuf), Trouble> {
    let file = scene_file(&path);
    let (source, folder) = pliant_scene::open(&path).map_err(|error| match error {
        pliant_scene::ReadError::Scene(errors) => errors.into(),
        error => Trouble::Value(error.to_string()),
    })?;
    Ok((source.text().to_owned(), file.display().to_string(), folder))
}

/// The text of the scene that a mesh alone is; it takes the mesh as `given` by a name.
#[pyfunction]
pub fn scene_of_mesh(mesh: &Mesh, name: &str) -> String {
    pliant_scene::scene_of_given(&mesh.0, name).text
}

fn plain<'py>(py: Python<'py>, node: &Node) -> PyResult<Bound<'py, PyAny>> {
    Ok(match &node.value {
        Value::Table(entries) => {
            let table = PyDict::new(py);
            for (key, own) in entries {
                table.set_item(key, plain(py, own)?)?;
            }
            table.into_any()
        }
        Value::Array(items) => {
            let all = items.iter().map(|own| plain(py, own)).collect::<PyResult<Vec<_>>>()?;
            PyList::new(py, all)?.into_any()
        }
        Value::String(text) | Value::Datetime(text) => text.into_pyobject(py)?.into_any(),
        Value::Integer(number) => number.into_pyobject(py)?.into_any(),
        Value::Float(number) => number.into_pyobject(py)?.into_any(),
        Value::Boolean(truth) => truth.into_pyobject(py)?.to_owned().into_any(),
    })
}

/// Builds a scene and forgets the model: its warnings.
#[pyfunction]
pub fn check<'py>(
    py: Python<'py>,
    given: (String, String, PathBuf, Vec<String>),
    meshes: Meshes<'py>,
) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let given = Given::new(given, meshes, Meshes::new())?;
    let errors = on_thread(py, move || {
        let scene = given.scene()?;
        let world = World::assemble(&scene, &MeshCache::of_user(), &|_| {})?;
        Ok(scene.source.errors(world.warnings().cloned().collect()))
    })?;
    diagnostics(py, &errors)
}

/// The mesh of a body of a scene, and remarks on how it was made.
#[pyfunction]
pub fn mesh(
    py: Python<'_>,
    given: (String, String, PathBuf, Vec<String>),
    meshes: Meshes<'_>,
    body: String,
) -> PyResult<(Mesh, Vec<String>)> {
    let given = Given::new(given, meshes, Meshes::new())?;
    let (mesh, notes) = on_thread(py, move || {
        let scene = given.scene()?;
        Ok(pliant_scene::mesh_of(&scene, &body, &MeshCache::of_user(), &|_| {})?)
    })?;
    Ok((Mesh(Arc::new(mesh)), notes))
}

/// Builds a scene.
#[pyfunction]
pub fn build(
    py: Python<'_>,
    given: (String, String, PathBuf, Vec<String>),
    meshes: Meshes<'_>,
    lent: Meshes<'_>,
    cache: bool,
) -> PyResult<Model> {
    let given = Given::new(given, meshes, lent)?;
    let world = on_thread(py, move || {
        let cache = if cache { MeshCache::of_user() } else { MeshCache::off() };
        Ok(World::assemble(&given.scene()?, &cache, &|_| {})?)
    })?;
    Ok(Model::new(world))
}
