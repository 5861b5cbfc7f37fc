//! Errors of a NiftySim model, with their place and remedy.

use std::path::PathBuf;

use pliant_geometry::SelectionError;
use pliant_geometry::io::MeshFileError;

/// A NiftySim model that could not be imported.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// The file could not be read.
    #[error("the model `{}` cannot be read: {reason}; check the path and the permissions", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Message of the operating system.
        reason: String,
    },
    /// The file is not XML.
    #[error(
        "`{}`, line {line}: the XML is broken or cut off: {reason}; correct it or copy the file again",
        path.display()
    )]
    Xml {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// Message of the XML reader.
        reason: String,
    },
    /// An element of the XML has an impossible value.
    #[error("`{}`, line {line}, <{element}>: {problem}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// The line at which the element begins, from 1.
        line: u32,
        /// Its name.
        element: String,
        /// The problem.
        problem: ImportProblem,
    },
}

/// A problem of an element of the XML.
#[derive(Debug, thiserror::Error)]
pub enum ImportProblem {
    /// The file is XML of another kind.
    #[error("a NiftySim model begins with <Model>; is this another file?")]
    NotAModel,
    /// A child that must be there is not.
    #[error("<{wanted}> is missing; add {example}")]
    MissingElement {
        /// The child.
        wanted: &'static str,
        /// An example of the element.
        example: &'static str,
    },
    /// An attribute that must be there is not.
    #[error("the attribute `{wanted}` is missing; add {example}")]
    MissingAttribute {
        /// The attribute.
        wanted: &'static str,
        /// An example of the attribute.
        example: &'static str,
    },
    /// A text where a number must be.
    #[error("`{text}` is not {wanted}; correct it")]
    NotANumber {
        /// The text found.
        text: String,
        /// The kind of number needed.
        wanted: &'static str,
    },
    /// A list is too long or too short.
    #[error("found {found} {what}, expected {wanted}; correct the list or its count")]
    Count {
        /// The items counted.
        what: &'static str,
        /// Number of items found.
        found: usize,
        /// Number of items needed.
        wanted: String,
    },
    /// A number is out of its range.
    #[error("{what} is {value}, but must be {range}; correct it")]
    OutOfRange {
        /// Name of the number.
        what: &'static str,
        /// The number.
        value: f64,
        /// The valid range.
        range: &'static str,
    },
    /// An index of something that does not exist.
    #[error("there is no {of} {index}: there are {count}, counted from 0; correct the index")]
    NoSuchIndex {
        /// `node`, `element`.
        of: &'static str,
        /// The index found.
        index: i64,
        /// Number of existing items.
        count: usize,
    },
    /// A word with no meaning here.
    #[error("`{found}` is not a known {what}; known: {known}")]
    Unknown {
        /// The kind of word needed.
        what: &'static str,
        /// The word found.
        found: String,
        /// The words that are known.
        known: &'static str,
    },
    /// Two statements contradict each other.
    #[error("{what}; {remedy}")]
    Contradiction {
        /// Both, with their numbers.
        what: String,
        /// Remedy.
        remedy: &'static str,
    },
    /// Nodes chosen by their normals could not be.
    #[error("{0}; correct the normal, its tolerance or the restriction")]
    Selection(Box<SelectionError>),
    /// The mesh file could not be read.
    #[error("{0}")]
    Mesh(Box<MeshFileError>),
    /// There is nothing to simulate.
    #[error("the model has no solid elements; models of shells alone can't be imported yet")]
    NothingSolid,
}

/// A problem and its place, before the path is known.
#[derive(Debug)]
pub(super) struct Fault {
    pub line: u32,
    pub element: String,
    pub problem: ImportProblem,
}
