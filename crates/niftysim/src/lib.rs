//! Reads models of NiftySim (UCL; XML) and translates them to a scene and its mesh files.
//!
//! The scene computes the same as NiftySim, also where its guide differs. Examples are the published fibre
//! modulus and hourglass stiffness by λ + 2μ. Others are backward Euler for relaxation, and tractions that
//! pull against the given vector. The notes name each. Load shapes act at the same steps as in NiftySim,
//! which sets a load after a step for the next one. Leaves out: shells that bend, radii that change, reduced
//! bases, values read from files; [`Imported::missing`] names them.
//!
//! ```
//! let imported = pliant_niftysim::import("../../lab/validation/data/niftysim/H8_NH.xml".as_ref())?;
//! assert!(imported.scene.contains("[law.") && imported.missing.is_empty());
//! # Ok::<(), pliant_niftysim::ImportError>(())
//! ```

mod conditions;
mod contact;
mod error;
mod geometry;
mod material;
mod parts;
mod rigid_surface;
mod shells;
mod system;
mod touching;
mod write;
mod writer;
mod xml;

use std::path::Path;

use pliant_format::{LONGEST_TABLE, Reads};
use pliant_geometry::Mesh;
use pliant_geometry::io::{self, MeshFile, MeshFileError, parse_xml};

pub use error::{ImportError, ImportProblem};

/// Source of the mesh files of a model.
struct Files<'a> {
    folder: &'a Path,
    reads: &'a Reads,
}

impl Files<'_> {
    /// Reads a mesh from the folder of the model, else from the working directory, the only place where
    /// NiftySim itself looks.
    fn mesh(&self, name: &str) -> Result<MeshFile, MeshFileError> {
        let read = |path: &Path| {
            let allowed = self.reads.allow(path);
            let path = allowed.map_err(|source| MeshFileError::Open { path: path.to_owned(), source })?;
            io::read(&path)
        };
        let beside = read(&self.folder.join(name));
        match beside {
            Err(MeshFileError::Open { .. }) => read(Path::new(name)).or(beside),
            _ => beside,
        }
    }
}

/// A NiftySim model translated to a scene.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The text of a scene file.
    pub scene: String,
    /// The meshes of bodies and rigid surfaces that it names, with their file names, in metres if the model
    /// is.
    pub meshes: Vec<(String, Mesh)>,
    /// The tables that it names, with their file names, as text.
    pub tables: Vec<(String, String)>,
    /// Notes on the translation, a sentence each; one names the parts left out.
    pub notes: Vec<String>,
    /// Parts of the model that the scene does not have. Unless this is empty, the scene is another model.
    pub missing: Vec<String>,
}

/// Reads a NiftySim model. Mesh files are looked for beside the model, then in the working directory.
///
/// # Errors
/// If a file can't be read, or the model says something that it cannot mean.
pub fn import(path: &Path) -> Result<Imported, ImportError> {
    import_within(path, &Reads::anywhere())
}

/// Imports a model like [`import`], with the files that may be read.
///
/// # Errors
/// If a file can't or may not be read, or the model says something that it cannot mean.
pub fn import_within(path: &Path, reads: &Reads) -> Result<Imported, ImportError> {
    let bytes = reads
        .read(path, LONGEST_TABLE)
        .map_err(|error| ImportError::File { path: path.to_owned(), reason: error.to_string() })?;
    import_read(path, &bytes, reads)
}

/// Reads a NiftySim model that was read from `path`, beside which its mesh files are looked for.
///
/// # Errors
/// If a mesh file can't be read, or the model says something that it cannot mean.
pub fn import_bytes(path: &Path, bytes: &[u8]) -> Result<Imported, ImportError> {
    import_read(path, bytes, &Reads::anywhere())
}

fn import_read(path: &Path, bytes: &[u8], reads: &Reads) -> Result<Imported, ImportError> {
    let text = String::from_utf8_lossy(bytes);
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let document = parse_xml(text).map_err(|error| ImportError::Xml {
        path: path.to_owned(),
        line: error.line,
        reason: error.reason,
    })?;
    let files = Files { folder: path.parent().unwrap_or(Path::new("")), reads };
    let stem = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let read = || {
        let model = parts::read(document.root_element(), &files)?;
        write::write(model, &stem)
    };
    read().map_err(|fault| ImportError::Content {
        path: path.to_owned(),
        line: fault.line,
        element: fault.element,
        problem: fault.problem,
    })
}
