//! Reads models of NiftySim (UCL; XML) and says the same as a scene and its mesh files.
//!
//! What NiftySim computes is kept, also where it is not what its guide says: the published fibre modulus, hourglass
//! stiffness by λ + 2μ, backward Euler for relaxation, tractions that pull against the vector they are given by. The
//! notes name each. Load shapes act at the same steps as NiftySim's, which sets a load after a step for the next one.
//! Leaves out: shells, membranes, contact, reduced bases, values read from files; [`Imported::missing`] names them.

mod conditions;
mod error;
mod geometry;
mod material;
mod parts;
mod write;
mod xml;

use std::path::Path;

use pliant_geometry::Mesh;
use pliant_geometry::io::parse_xml;

pub use error::{ImportError, ImportProblem};

/// A scene that says what a NiftySim model says.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The text of a scene file.
    pub scene: String,
    /// The meshes that it names, with their file names, in metres if the model is.
    pub meshes: Vec<(String, Mesh)>,
    /// What is worth knowing of the translation, a sentence each; what was left out is one of them.
    pub notes: Vec<String>,
    /// Parts of the model that the scene does not have. Unless this is empty, the scene is another model.
    pub missing: Vec<String>,
}

/// Reads a NiftySim model. Mesh files are looked for beside the model, then in the working directory.
///
/// # Errors
/// If a file can't be read, or the model says something that it cannot mean.
pub fn import(path: &Path) -> Result<Imported, ImportError> {
    let bytes = std::fs::read(path)
        .map_err(|error| ImportError::File { path: path.to_owned(), reason: error.to_string() })?;
    import_bytes(path, &bytes)
}

/// Reads a NiftySim model that was read from `path`, beside which its mesh files are looked for.
///
/// # Errors
/// If a mesh file can't be read, or the model says something that it cannot mean.
pub fn import_bytes(path: &Path, bytes: &[u8]) -> Result<Imported, ImportError> {
    let text = String::from_utf8_lossy(bytes);
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let document = parse_xml(text).map_err(|error| ImportError::Xml {
        path: path.to_owned(),
        line: error.line,
        reason: error.reason,
    })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let stem = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let read = || {
        let model = parts::read(document.root_element(), folder)?;
        write::write(model, &stem)
    };
    read().map_err(|fault| ImportError::Content {
        path: path.to_owned(),
        line: fault.line,
        element: fault.element,
        problem: fault.problem,
    })
}
