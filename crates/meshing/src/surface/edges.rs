//! Edges of triangles.

/// The two nodes of an edge, the lower one first.
pub(crate) fn key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}
