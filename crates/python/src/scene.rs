//! Scenes: text to plain data of Python, checks, and models.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use pliant_format::source::{Given, Node, Source, Value};
use pliant_format::{Scene, scene_file};
use pliant_scene::{MeshCache, World};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::errors::{Trouble, diagnostics};
use crate::image::Image;
use crate::jobs::on_thread;
use crate::mesh::Mesh;
use crate::model::Model;

/// Longest text of a scene [bytes], as of files.
const LONGEST: usize = 1 << 26;

/// A scene as Python hands it over: text, its name, the folder of its files, values that are set, meshes and
/// images from memory.
type Handed<'py> = (String, String, PathBuf, Vec<String>, Meshes<'py>, BTreeMap<String, Bound<'py, Image>>);

type Meshes<'py> = BTreeMap<String, Bound<'py, Mesh>>;

/// A handed scene, to be read on another thread.
struct Taken {
    text: String,
    name: String,
    folder: PathBuf,
    set: Vec<String>,
    given: Given,
    /// Bodies whose meshes another model lends.
    lent: BTreeMap<String, Arc<pliant_geometry::Mesh>>,
}

/// Meshes as the engine shares them.
fn shared(meshes: Meshes<'_>) -> BTreeMap<String, Arc<pliant_geometry::Mesh>> {
    meshes.into_iter().map(|(name, mesh)| (name, Arc::clone(&mesh.get().0))).collect()
}

impl Taken {
    fn new((text, name, folder, set, meshes, images): Handed<'_>, lent: Meshes<'_>) -> Result<Self, Trouble> {
        if text.len() > LONGEST {
            let size = text.len() >> 20;
            return Err(Trouble::Value(format!(
                "the text of the scene has {size} MiB, but at most 64 are allowed; give large tables as meshes or files"
            )));
        }
        let images = images.into_iter().map(|(name, image)| (name, Arc::clone(&image.get().0))).collect();
        let given = Given { meshes: shared(meshes), images };
        Ok(Self { text, name, folder, set, given, lent: shared(lent) })
    }

    fn scene(self) -> Result<Scene, Trouble> {
        let mut source = Source::parse(self.name, self.text)?;
        let mut mistakes: Vec<_> =
            self.set.iter().filter_map(|set| source.assign(set).err()).map(|mistake| *mistake).collect();
        let mut given = self.given;
        for (body, mesh) in self.lent {
            let name = format!("{body}, lent");
            let node = Node {
                place: source.span(&["body", &body, "mesh"]),
                key_span: None,
                value: Value::String(name.clone()),
            };
            let table = Value::Table(vec![("given".to_owned(), node)]);
            mistakes.extend(source.set(&["body", &body, "mesh"], table).err().map(|mistake| *mistake));
            given.meshes.insert(name, mesh);
        }
        if !mistakes.is_empty() {
            return Err(source.errors(mistakes).into());
        }
        Ok(Scene::from_source(source.giving(given), self.folder)?)
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
    let (source, folder) = pliant_format::open(&path).map_err(|error| match error {
        pliant_format::ReadError::Scene(errors) => errors.into(),
        error => Trouble::Value(error.to_string()),
    })?;
    Ok((source.text().to_owned(), file.display().to_string(), folder))
}

/// The text of the scene that a mesh alone is; it takes the mesh as `given` by a name.
#[pyfunction]
pub fn scene_of_mesh(mesh: &Mesh, name: &str) -> String {
    pliant_format::scene_of_given(&mesh.0, name).text
}

fn plain<'py>(py: Python<'py>, node: &Node) -> PyResult<Bound<'py, PyAny>> {
    Ok(match &node.value {
        Value::Table(entries) => {
            let table = PyDict::new(py);
            for (key, entry) in entries {
                table.set_item(key, plain(py, entry)?)?;
            }
            table.into_any()
        }
        Value::Array(items) => {
            let list = items.iter().map(|element| plain(py, element)).collect::<PyResult<Vec<_>>>()?;
            PyList::new(py, list)?.into_any()
        }
        Value::String(text) | Value::Datetime(text) => text.into_pyobject(py)?.into_any(),
        Value::Integer(number) => number.into_pyobject(py)?.into_any(),
        Value::Float(number) => number.into_pyobject(py)?.into_any(),
        Value::Boolean(truth) => truth.into_pyobject(py)?.to_owned().into_any(),
    })
}

/// Builds a scene and forgets the model: its warnings.
#[pyfunction]
pub fn check<'py>(py: Python<'py>, scene: Handed<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let taken = Taken::new(scene, Meshes::new())?;
    let errors = on_thread(py, move || {
        let scene = taken.scene()?;
        let world = World::assemble(&scene, &MeshCache::of_user(), &|_| {})?;
        Ok(scene.source.errors(world.warnings().cloned().collect()))
    })?;
    diagnostics(py, &errors)
}

/// The mesh of a body of a scene, and remarks on how it was made.
#[pyfunction]
pub fn mesh(py: Python<'_>, scene: Handed<'_>, body: String) -> PyResult<(Mesh, Vec<String>)> {
    let taken = Taken::new(scene, Meshes::new())?;
    let (mesh, notes) = on_thread(py, move || {
        let scene = taken.scene()?;
        Ok(pliant_scene::mesh_of(&scene, &body, &MeshCache::of_user(), &|_| {})?)
    })?;
    Ok((Mesh(Arc::new(mesh)), notes))
}

/// Builds a scene.
#[pyfunction]
pub fn build(py: Python<'_>, scene: Handed<'_>, lent: Meshes<'_>, cache: bool) -> PyResult<Model> {
    let taken = Taken::new(scene, lent)?;
    let world = on_thread(py, move || {
        let cache = if cache { MeshCache::of_user() } else { MeshCache::off() };
        Ok(World::assemble(&taken.scene()?, &cache, &|_| {})?)
    })?;
    Ok(Model::new(world))
}
