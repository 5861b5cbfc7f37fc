//! What can be wrong with a mesh file, where, and what to try.

use std::fmt;
use std::path::PathBuf;

/// Where in a file something is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line of text, from 1.
    Line(usize),
    /// A byte of a binary part, from 0.
    Byte(usize),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Line(line) => write!(f, ", line {line}"),
            Self::Byte(byte) => write!(f, ", byte {byte}"),
        }
    }
}

/// A mesh file that could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum MeshFileError {
    /// Neither the ending nor the first bytes tell a format that can be read.
    #[error(
        "`{}` is not in a supported mesh format; formats read: {}; convert it, e.g. with meshio",
        path.display(),
        super::Format::list(super::Format::ALL)
    )]
    UnsupportedFormat {
        /// The file.
        path: PathBuf,
    },
    /// The ending names no format that can be written.
    #[error(
        "cannot write `{}`: formats written: {}; use one of these extensions",
        path.display(),
        super::Format::list(super::Format::WRITTEN)
    )]
    UnwritableFormat {
        /// The file.
        path: PathBuf,
    },
    /// The file could not be opened or read from disk.
    #[error("cannot open `{}`: {source}; check the path and the permissions", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// The file could not be written to disk.
    #[error("cannot write `{}`: {source}; check the folder, its permissions and the free space", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// The file was opened, but what it holds is no usable mesh.
    #[error("cannot read `{}`{place}: {problem}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// Where in the file.
        place: Place,
        /// What is wrong there.
        problem: MeshFileProblem,
    },
    /// The mesh cannot be put into a file of this format.
    #[error("cannot write `{}`: {problem}", path.display())]
    Mesh {
        /// The file.
        path: PathBuf,
        /// What is wrong with the mesh, and what to do.
        problem: String,
    },
}

/// What is wrong inside a mesh file, and what to try.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshFileProblem {
    /// The file ends too early, or announces more than it holds.
    #[error(
        "the file ends while reading {reading}: it is truncated or its counts are wrong; copy or export it again"
    )]
    Truncated {
        /// What was being read.
        reading: String,
    },
    /// Text where a number must be, or a number out of range.
    #[error("`{text}` is not {expected} (reading {reading}); correct it or export the file again")]
    BadNumber {
        /// The text found.
        text: String,
        /// The kind of number needed.
        expected: &'static str,
        /// What was being read.
        reading: String,
    },
    /// A cell uses a node that the file does not define.
    #[error("{cell} uses node {node}, which the file does not define; export it again with all its nodes")]
    UndefinedNode {
        /// The node, as numbered in the file.
        node: i64,
        /// The cell.
        cell: String,
    },
    /// A coordinate is NaN or infinite.
    #[error("point {point} is not finite ({x}, {y}, {z}); repair the mesh in the program that made it")]
    NotFinite {
        /// The point, as numbered in the file.
        point: u64,
        /// Its first coordinate.
        x: f64,
        /// Its second coordinate.
        y: f64,
        /// Its third coordinate.
        z: f64,
    },
    /// The file holds no points.
    #[error("the file has no points; check the export")]
    NoPoints,
    /// The file holds points, but no cells.
    #[error("the file has points but no cells; export the elements too")]
    NoCells,
    /// All cells are of kinds that are not supported.
    #[error(
        "no supported cells: {kinds} not supported; convert to linear tet, hex, triangle, quad, line or vertex \
         cells (Gmsh: `gmsh FILE -order 1 -save`)"
    )]
    UnsupportedCells {
        /// The kinds found, with their counts.
        kinds: String,
    },
    /// A variant of the format that is not read.
    #[error("{what} not supported; {remedy}")]
    UnsupportedVariant {
        /// What was found.
        what: String,
        /// What to do.
        remedy: &'static str,
    },
    /// The file breaks the rules of its format.
    #[error("{what}; correct it or export the file again")]
    Malformed {
        /// What is wrong.
        what: String,
    },
}

/// A problem and its place: what the readers of bytes return, before the path is known.
#[derive(Debug)]
pub(super) struct Fault {
    pub place: Place,
    pub problem: MeshFileProblem,
}

impl Fault {
    pub fn whole(problem: MeshFileProblem) -> Self {
        Self { place: Place::File, problem }
    }

    pub fn malformed(place: Place, what: impl Into<String>) -> Self {
        Self { place, problem: MeshFileProblem::Malformed { what: what.into() } }
    }

    pub fn truncated(place: Place, reading: impl fmt::Display) -> Self {
        Self { place, problem: MeshFileProblem::Truncated { reading: reading.to_string() } }
    }

    pub fn unsupported(place: Place, what: impl Into<String>, remedy: &'static str) -> Self {
        Self { place, problem: MeshFileProblem::UnsupportedVariant { what: what.into(), remedy } }
    }
}
