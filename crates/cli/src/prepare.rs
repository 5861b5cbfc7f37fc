//! From a path on the command line to a world: scenes, meshes and NiftySim models, with the overrides that
//! were typed.

use std::cell::OnceCell;
use std::fs;
use std::path::{Path, PathBuf};

use pliant_format::diagnostic::Diagnostic;
use pliant_format::source::{Source, Value};
use pliant_format::{Reads, Scene};
use pliant_geometry::io;
use pliant_scene::{MeshCache, Meshing, World};
use tempfile::TempDir;

use crate::arguments::{DeviceName, Overrides, Precision};
use crate::report::{self, Bar, Failure};

/// Reads, builds and plans a scene; warnings go to standard error.
pub fn prepare(path: &Path, overrides: &Overrides) -> Result<World, Failure> {
    prepare_changed(path, overrides, |_| {})
}

/// Works like [`prepare`], for a scene that is changed after reading.
pub(crate) fn prepare_changed(
    path: &Path,
    overrides: &Overrides,
    change: impl FnOnce(&mut Scene),
) -> Result<World, Failure> {
    let Opened { mut source, folder, assumed, _translated } =
        open(path, overrides.sandbox, overrides.allow_partial)?;
    let mut mistakes: Vec<_> =
        overrides.set.iter().filter_map(|set| source.assign(set).err()).map(|mistake| *mistake).collect();
    let precision = overrides.precision.map(|precision| match precision {
        Precision::Single => "single",
        Precision::Double => "double",
    });
    let device = overrides.device.map(|device| match device {
        DeviceName::Cpu => "cpu",
        DeviceName::Gpu => "gpu",
        DeviceName::Auto => "auto",
    });
    let settings = [
        (["scene", "until"], overrides.until.map(Value::from)),
        (["run", "step"], overrides.step.map(Value::from)),
        (["run", "threads"], overrides.threads.map(Value::from)),
        (["run", "precision"], precision.map(Value::from)),
        (["run", "device"], device.map(Value::from)),
    ];
    for (path, value) in settings {
        if let Some(value) = value
            && let Err(mistake) = source.set(&path, value)
        {
            mistakes.push(*mistake);
        }
    }
    if !mistakes.is_empty() {
        return Err(source.errors(mistakes).into());
    }
    let mut scene = Scene::from_source(source, folder)?;
    change(&mut scene);
    let mut world = build(&scene, &mesh_cache(overrides.no_cache))?;
    if let Some(assumed) = assumed {
        world.doubt(Diagnostic::warning(assumed));
    }
    let warnings: Vec<Diagnostic> = world.warnings().cloned().collect();
    if !warnings.is_empty() {
        report::show(&scene.source.errors(warnings));
    }
    Ok(world)
}

/// Builds a scene; a bar shows the progress of meshes from images.
fn build(scene: &Scene, cache: &MeshCache) -> Result<World, Failure> {
    let bar: OnceCell<Bar> = OnceCell::new();
    let built = World::assemble(scene, cache, &|meshing| {
        let Meshing { body, part, now } = meshing;
        bar.get_or_init(Bar::new).show(part, format!("mesh of `{body}`: {now}"));
    });
    if let Some(bar) = bar.get() {
        bar.finish();
    }
    Ok(built?)
}

/// A scene that was read.
pub struct Opened {
    /// Its text.
    pub source: Source,
    /// The folder that its files are in.
    pub folder: PathBuf,
    /// Assumptions about a mesh.
    assumed: Option<String>,
    /// The folder of a translated model, kept alive with this value.
    pub _translated: Option<TempDir>,
}

/// Reads the text of a scene. A NiftySim model is translated first; a mesh gets a scene of its own. In a
/// sandbox, the scene reads only files in its own folder.
pub fn open(path: &Path, sandbox: bool, allow_partial: bool) -> Result<Opened, Failure> {
    let reads = |folder: &Path| {
        let reads = if sandbox { Reads::within(folder) } else { Ok(Reads::anywhere()) };
        let failed = |error| format!("the folder `{}` cannot be read: {error}", folder.display());
        reads.map_err(|error| Failure::plain(failed(error), "check the path and the permissions"))
    };
    let file = pliant_format::scene_file(path);
    let allowed = reads(file.parent().unwrap_or(Path::new("")))?;
    if pliant_format::is_mesh(path) {
        let help = "`pliant info` reads a mesh file on its own";
        let made = pliant_format::scene_of_mesh(path).map_err(|error| Failure::plain(error, help))?;
        let source = Source::parse(path.display().to_string(), made.text)?.reading(allowed);
        return Ok(Opened { source, folder: made.folder, assumed: Some(made.assumed), _translated: None });
    }
    if !path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("xml")) {
        let (source, folder) = pliant_format::open_within(path, allowed)?;
        return Ok(Opened { source, folder, assumed: None, _translated: None });
    }
    let folder = tempfile::tempdir().map_err(|error| {
        Failure::plain(
            format!("cannot make a temporary folder: {error}"),
            "check the free space, or set TMPDIR",
        )
    })?;
    let notes = translate(path, &allowed, &folder.path().join("scene.toml"), allow_partial)?;
    notes.iter().for_each(|note| eprintln!("note: {note}"));
    let (source, place) = pliant_format::open_within(folder.path(), reads(folder.path())?)?;
    Ok(Opened { source, folder: place, assumed: None, _translated: Some(folder) })
}

/// Writes a NiftySim model as a scene file with its meshes next to it; returns notes. A model with
/// unsupported parts is rejected unless they may be omitted.
pub fn translate(
    model: &Path,
    reads: &Reads,
    file: &Path,
    allow_partial: bool,
) -> Result<Vec<String>, Failure> {
    let imported = pliant_niftysim::import_within(model, reads).map_err(|error| Failure::plain(error, ""))?;
    if !imported.missing.is_empty() && !allow_partial {
        let missing = imported.missing.join("; ");
        let message = format!("`{}` has parts that Pliant does not support: {missing}", model.display());
        let help = "`--allow-partial` of `pliant run` and `pliant import` omits these parts: the results then belong to a \
                    different model";
        return Err(Failure::plain(message, help));
    }
    let folder = file.parent().unwrap_or(Path::new(""));
    let meshes = imported.meshes.iter().map(|(name, mesh)| (folder.join(name), mesh));
    let tables = imported.tables.iter().map(|(name, text)| (folder.join(name), text));
    let written = meshes.clone().map(|(path, _)| path).chain(tables.clone().map(|(path, _)| path));
    if let Some(taken) = written.chain([file.to_owned()]).find(|path| path.exists()) {
        return Err(Failure::plain(format!("`{}` exists already", taken.display()), "choose another name"));
    }
    let unwritable = |error: &dyn std::fmt::Display| {
        let help = "check the folder, its permissions and the free space, or choose another name";
        Failure::plain(format!("`{}` cannot be written: {error}", folder.display()), help)
    };
    if !folder.as_os_str().is_empty() {
        fs::create_dir_all(folder).map_err(|error| unwritable(&error))?;
    }
    for (path, mesh) in meshes {
        io::write(&path, mesh).map_err(|error| unwritable(&error))?;
    }
    for (path, text) in tables {
        fs::write(path, text).map_err(|error| unwritable(&error))?;
    }
    fs::write(file, &imported.scene).map_err(|error| unwritable(&error))?;
    Ok(imported.notes)
}

/// This user's cache of meshes made from images.
pub(crate) fn mesh_cache(off: bool) -> MeshCache {
    if off { MeshCache::off() } else { MeshCache::of_user() }
}
