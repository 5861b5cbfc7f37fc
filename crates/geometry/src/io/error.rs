//! Errors of mesh files: the problem, its position and a remedy.

use std::fmt;
use std::path::PathBuf;

/// The position of a problem in a file.
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
    /// Neither the extension nor the first bytes identify a readable format.
    #[error(
        "`{}` is not in a supported mesh format; formats read: {}; convert it, e.g. with meshio",
        path.display(),
        super::Format::list(super::Format::ALL)
    )]
    UnsupportedFormat {
        /// The file.
        path: PathBuf,
    },
    /// The extension names no writable format.
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
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file could not be written to disk.
    #[error("cannot write `{}`: {source}; check the folder, its permissions and the free space", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file was opened, but contains no usable mesh.
    #[error("cannot read `{}`{place}: {problem}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// Place in the file.
        place: Place,
        /// The problem.
        problem: MeshFileProblem,
    },
    /// The mesh cannot be put into a file of this format.
    #[error("cannot write `{}`: {problem}", path.display())]
    Mesh {
        /// The file.
        path: PathBuf,
        /// The problem of the mesh, and a remedy.
        problem: String,
    },
}

/// The problem inside a mesh file, and a remedy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshFileProblem {
    /// The file ends too early, or announces more than it contains.
    #[error(
        "the file ends while reading {reading}: it is truncated or its counts are wrong; copy or export it again"
    )]
    Truncated {
        /// The item being read.
        reading: String,
    },
    /// Text instead of a number, or a number out of range.
    #[error("`{text}` is not {expected} (reading {reading}); correct it or export the file again")]
    BadNumber {
        /// The text found.
        text: String,
        /// The kind of number needed.
        expected: &'static str,
        /// The item being read.
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
    /// Cells of the body are of kinds that are not supported.
    #[error(
        "cells of unsupported kinds: {kinds}; convert them to linear tets, hexes, wedges, pyramids, triangles, quads \
         or lines (Gmsh: `gmsh FILE -order 1 -save`)"
    )]
    UnsupportedCells {
        /// The kinds found, with their counts.
        kinds: String,
    },
    /// An unsupported variant of the format.
    #[error("{what} not supported; {remedy}")]
    UnsupportedVariant {
        /// The item found.
        what: String,
        /// The remedy.
        remedy: &'static str,
    },
    /// The file breaks the rules of its format.
    #[error("{what}; correct it or export the file again")]
    Malformed {
        /// The problem.
        what: String,
    },
}

/// A problem and its position, as returned by the readers of bytes, which do not know the path.
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
