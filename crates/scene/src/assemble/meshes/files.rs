//! Meshes of files in metres, and the words for their cells.

use std::path::Path;

use pliant_format::foreign_file;
use pliant_format::tables::{Cells, MeshTable};
use pliant_geometry::Mesh;
use pliant_geometry::io::{self, MeshFile, MeshFileError};
use pliant_geometry::words::number;

use crate::assemble::Context;

/// An organ smaller than the first or larger than the last [m] is probably in other units; from the second on
/// it may be.
const PLAUSIBLE_SIZE: [f64; 3] = [1e-3, 2.0, 10.0];

/// A size that no organ has: the mesh is probably not in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizeDoubt {
    /// Diagonal of the box [m].
    size: f64,
}

impl SizeDoubt {
    /// `None` for a size that an organ can have, and for a mesh without points.
    pub fn of(mesh: &Mesh) -> Option<Self> {
        let (low, high) = mesh.bounds()?;
        let size = (high - low).norm();
        (!(PLAUSIBLE_SIZE[0]..=PLAUSIBLE_SIZE[1]).contains(&size) && size > 0.0).then_some(Self { size })
    }

    /// True if the mesh is too large for any organ.
    pub fn is_large(&self) -> bool {
        self.size > PLAUSIBLE_SIZE[2]
    }

    /// True if the mesh is larger than a person, and not too large for a part of a machine. A small organ in
    /// millimetres has this size.
    pub fn is_possible(&self) -> bool {
        (PLAUSIBLE_SIZE[1]..=PLAUSIBLE_SIZE[2]).contains(&self.size)
    }

    /// Returns advice on the factor; `scale` is the text before it, such as `--scale `.
    pub fn advice(&self, scale: &str) -> String {
        match self.size {
            size if size > 1e4 => {
                format!("`{scale}1e-6` brings micrometres to metres, `{scale}0.001` millimetres")
            }
            _ if self.is_large() || self.is_possible() => {
                format!("`{scale}0.001` brings millimetres to metres, `{scale}0.01` centimetres")
            }
            _ => format!(
                "`{scale}1` is for a file in metres: it is the size of one unit of the file in metres"
            ),
        }
    }
}

impl std::fmt::Display for SizeDoubt {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let size = number(self.size);
        match self.size {
            size_in_metres if size_in_metres > 1e4 => {
                write!(f, "{size} m across, larger than any organ: its lengths are probably micrometres")
            }
            size_in_metres if size_in_metres > 40.0 => {
                write!(f, "{size} m across, larger than any organ: its lengths are probably millimetres")
            }
            _ if self.is_large() => {
                write!(
                    f,
                    "{size} m across, larger than any organ: its lengths are probably centimetres or millimetres"
                )
            }
            _ if self.is_possible() => {
                write!(
                    f,
                    "{size} m across, larger than a person: its lengths may be millimetres or centimetres"
                )
            }
            _ => {
                write!(f, "{size} m across, smaller than any organ: it was probably scaled to metres before")
            }
        }
    }
}

/// Reason why no mesh could be made: the key to point at, the message and the remedy.
pub(super) struct MeshFault {
    pub key: &'static str,
    pub message: String,
    pub help: String,
}

impl Context<'_> {
    /// The mesh of a file or of the program in metres, with its name.
    pub(super) fn mesh_file(&self, table: &MeshTable) -> Result<(String, MeshFile), MeshFault> {
        let key = table.own_cells().unwrap_or("file");
        let (name, mut read) = match (&table.file, &table.given) {
            (Some(file), _) => (file.display().to_string(), self.read_mesh(file)?),
            (None, given) => {
                let name = given.clone().unwrap_or_default();
                let mesh = self.given_mesh(&name)?;
                let format = "given by the program".to_owned();
                (name, MeshFile { mesh, format, notes: Vec::new(), time: None })
            }
        };
        read.mesh.points.iter_mut().for_each(|point| *point *= table.factor());
        match SizeDoubt::of(&read.mesh).filter(|doubt| doubt.is_large() && table.scale.is_none()) {
            None => Ok((name, read)),
            Some(doubt) => {
                let help = format!("{}; `scale = 1` if it is in metres", doubt.advice("scale = "));
                Err(MeshFault { key, message: format!("the mesh measures {doubt}"), help })
            }
        }
    }

    fn read_mesh(&self, file: &Path) -> Result<MeshFile, MeshFault> {
        let opened = |source| MeshFileError::Open { path: file.to_owned(), source };
        let read = self.scene.file(file).map_err(opened).and_then(|path| io::read(&path));
        read.map_err(|error| {
            let (message, help) = match (&error, foreign_file(file)) {
                (MeshFileError::UnsupportedFormat { .. }, Some([what, help])) => {
                    (format!("`{}` is {what}", file.display()), help)
                }
                (MeshFileError::Open { .. }, _) => {
                    (error.to_string(), "file names are relative to the scene file")
                }
                _ => (error.to_string(), "`pliant info` reads a mesh file on its own"),
            };
            MeshFault { key: "file", message, help: help.into() }
        })
    }

    fn given_mesh(&self, name: &str) -> Result<Mesh, MeshFault> {
        let given = &self.source().given().meshes;
        given.get(name).map(|mesh| mesh.as_ref().clone()).ok_or_else(|| {
            let known: Vec<String> = given.keys().map(|name| format!("`{name}`")).collect();
            let help = match known.is_empty() {
                true => "the program that reads this scene gives no meshes; take a `file`".into(),
                false => format!("it gives {}", known.join(", ")),
            };
            MeshFault { key: "given", message: format!("no mesh `{name}` is given"), help }
        })
    }
}

/// The word for cells in messages.
pub(super) fn words(cells: Cells) -> &'static str {
    match cells {
        Cells::Tets => "tets",
        Cells::Hexes => "hexes",
        Cells::ImmersedHexes => "immersed hexes",
        Cells::Surface => "a surface",
        Cells::Shells => "shells",
    }
}
