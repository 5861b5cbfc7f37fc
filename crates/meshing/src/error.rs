//! Errors of mesh requests.

use pliant_geometry::Vector3;

/// The error of a mesh request. Lengths in metres.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshingError {
    /// A length or a factor is zero, negative, infinite or NaN.
    #[error("{what} is {value}; it must be positive and finite")]
    NotPositive {
        /// Name of the quantity.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// No mesh of a curved body is made of ideal tets.
    #[error(
        "target is {target}, but no mesh of a curved body reaches the acoustic length of ideal tets; 0.75 is \
         usual, 0.9 the best"
    )]
    TargetTooHigh {
        /// Requested fraction of the ideal.
        target: f64,
    },
    /// The cells differ too much in size.
    #[error(
        "cells of {} m beside cells of {} m are too small; the limit is {} m", rounded(*asked), rounded(*edge), rounded(*smallest)
    )]
    TooFine {
        /// Requested edge [m].
        edge: f64,
        /// Smallest allowed edge [m].
        smallest: f64,
        /// Smallest requested edge [m].
        asked: f64,
    },
    /// A requested label is not meshed.
    #[error("the mesh has no label {label} to protect; its labels are {}", labels.iter().map(i32::to_string).collect::<Vec<_>>().join(", "))]
    NoSuchLabel {
        /// The label.
        label: i32,
        /// The labels of the mesh.
        labels: Vec<i32>,
    },
    /// A position has an infinite or NaN coordinate.
    #[error("{what} is ({}, {}, {}) m; it must be finite", value.x, value.y, value.z)]
    NotFinite {
        /// Name of the position.
        what: &'static str,
        /// Its value.
        value: Vector3,
    },
    /// An explicit number of cells is zero.
    #[error("the number of cells along {axis} is 0; give at least 1")]
    NoCellsAlong {
        /// `x`, `y` or `z`.
        axis: char,
    },
    /// Points moved so far that cells turn over.
    #[error("points move by up to {amount} of a cell; use less than 0.5 to keep cells valid")]
    Distortion {
        /// Largest shift as a part of a cell.
        amount: f64,
    },
    /// A tube without a wall.
    #[error("the inner radius {inner} m must be below the outer radius {outer} m")]
    NoWall {
        /// Inner radius [m].
        inner: f64,
        /// Outer radius [m].
        outer: f64,
    },
    /// The box of a field is empty or not finite.
    #[error(
        "the box of the body runs from ({}, {}, {}) to ({}, {}, {}) m; it must be finite and longer than 0 \
         along every axis",
        low.x, low.y, low.z, high.x, high.y, high.z
    )]
    BadBox {
        /// Smallest corner [m].
        low: Vector3,
        /// Largest corner [m].
        high: Vector3,
    },
    /// The mesh would have more cells than allowed. Found before the cells are allocated, except for bodies
    /// thinner than the samples of the estimate.
    #[error(
        "about {estimate} cells exceed the limit of {limit}; an edge {} times as long would fit",
        factor(*estimate, *limit)
    )]
    TooManyCells {
        /// Expected number of cells.
        estimate: u64,
        /// Cells allowed.
        limit: usize,
    },
    /// The body fills too little of its box: the lattice over the box would not fit, though the cells might.
    #[error(
        "the box of the body needs a lattice of {cubes} cubes, more than {limit}; use a longer edge or \
         a tighter box"
    )]
    LatticeTooLarge {
        /// Cubes of the lattice.
        cubes: u64,
        /// Cubes allowed: a fixed multiple of the limit on cells.
        limit: usize,
    },
    /// No cell lies in the body.
    #[error(
        "no cell of edge {edge} m fits the body, whose box is {} × {} × {} m; use a shorter edge",
        rounded(size.x), rounded(size.y), rounded(size.z)
    )]
    NoCells {
        /// Requested edge [m].
        edge: f64,
        /// Size of the box of the body [m].
        size: Vector3,
    },
    /// A surface without triangles of any area.
    #[error("there is no surface: all triangles and quads have zero area")]
    NoSurface,
    /// A surface with holes too wide to close.
    #[error(
        "the surface is open: {} with {edges} border edges, the widest {:.2} mm wide, at ({:.2}, {:.2}, {:.2}) mm; \
         holes of up to {:.2} mm are closed",
        counted(*holes, "hole", "holes"), widest * 1e3, place.x * 1e3, place.y * 1e3, place.z * 1e3, closed * 1e3
    )]
    OpenSurface {
        /// Its holes.
        holes: usize,
        /// Edges of one face only.
        edges: usize,
        /// Width of the widest hole [m]: the diagonal of its box.
        widest: f64,
        /// Its middle [m].
        place: Vector3,
        /// Width up to which holes are closed [m].
        closed: f64,
    },
    /// A closed surface without inside.
    #[error("the surface encloses nothing: it is flat, or thinner than the cells, whose edge is in metres")]
    NothingEnclosed,
    /// The field is NaN or infinite somewhere.
    #[error(
        "the field is {value} at ({}, {}, {}) m; it must be finite around the body",
        point.x, point.y, point.z
    )]
    FieldNotFinite {
        /// Value found.
        value: f64,
        /// Place of this value [m].
        point: Vector3,
    },
    /// The body reaches beyond its own box.
    #[error(
        "the body reaches ({}, {}, {}) m, outside its box; make the box larger",
        point.x, point.y, point.z
    )]
    BodyLeavesBox {
        /// A point of the body outside the box [m].
        point: Vector3,
    },
}

/// A length to a micrometre.
fn rounded(length: f64) -> f64 {
    (length * 1e6).round() / 1e6
}

/// Factor by which the edge must grow for the cells to fit, rounded up to two decimals.
fn factor(estimate: u64, limit: usize) -> f64 {
    ((estimate as f64 / limit.max(1) as f64).cbrt() * 100.0).ceil() / 100.0
}

pub(crate) fn require_positive(what: &'static str, value: f64) -> Result<(), MeshingError> {
    if value.is_finite() && value > 0.0 { Ok(()) } else { Err(MeshingError::NotPositive { what, value }) }
}

pub(crate) fn require_finite(what: &'static str, value: Vector3) -> Result<(), MeshingError> {
    if value.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(MeshingError::NotFinite { what, value }) }
}

/// Compares a number of cells, known or estimated, with the limit.
pub(crate) fn require_at_most(estimate: f64, limit: usize) -> Result<(), MeshingError> {
    if estimate > limit as f64 {
        return Err(MeshingError::TooManyCells { estimate: estimate as u64, limit });
    }
    Ok(())
}

/// A number of things in words: `1 edge`, `2 edges`.
pub(crate) fn counted(number: usize, one: &str, more: &str) -> String {
    format!("{number} {}", if number == 1 { one } else { more })
}
