//! The surface of a mesh as the formats for surfaces write it: its triangles and quads.

use std::path::Path;

use super::MeshFileError;
use crate::{CellBlock, CellKind, Mesh, Vector3};

/// A face to be written.
pub(super) struct FaceOut<'a> {
    pub nodes: Vec<u32>,
    /// Names of the cell sets it is in, sorted.
    pub sets: Vec<&'a str>,
}

/// Points and faces to be written.
pub(super) struct SurfaceOut<'a> {
    pub points: Vec<Vector3>,
    pub faces: Vec<FaceOut<'a>>,
    /// The blocks the faces are from, in their order.
    pub blocks: Vec<&'a CellBlock>,
    /// Indices in the mesh of the points.
    pub kept: Vec<u32>,
}

impl<'a> SurfaceOut<'a> {
    /// Collects the triangles and quads of a mesh. All points are kept if the mesh has no volume cells,
    /// otherwise only points of the faces. A mesh without triangles and quads is an error.
    pub fn new(path: &Path, mesh: &'a Mesh) -> Result<Self, MeshFileError> {
        let is_face = |block: &&CellBlock| matches!(block.kind, CellKind::Triangle | CellKind::Quad);
        let blocks: Vec<&CellBlock> =
            mesh.blocks.iter().filter(is_face).filter(|block| !block.is_empty()).collect();
        if blocks.is_empty() {
            return Err(MeshFileError::Mesh {
                path: path.to_owned(),
                problem: "this format holds surfaces, and the mesh has no triangles or quads; extract its \
                          surface first, or write .vtu or .msh"
                    .to_owned(),
            });
        }
        let mut used = vec![mesh.volume_blocks().all(CellBlock::is_empty); mesh.points.len()];
        blocks.iter().flat_map(|block| &block.nodes).for_each(|&node| used[node as usize] = true);
        let mut new_index = vec![0; mesh.points.len()];
        let mut kept = Vec::new();
        for (index, _) in used.iter().enumerate().filter(|(_, used)| **used) {
            new_index[index] = kept.len() as u32;
            kept.push(index as u32);
        }
        let mut faces = Vec::new();
        for block in &blocks {
            let first = faces.len();
            faces.extend(block.cells().map(|nodes| FaceOut {
                nodes: nodes.iter().map(|&node| new_index[node as usize]).collect(),
                sets: Vec::new(),
            }));
            for (name, set) in &block.sets {
                set.iter().for_each(|&cell| faces[first + cell as usize].sets.push(name));
            }
        }
        let points = kept.iter().map(|&index| mesh.points[index as usize]).collect();
        Ok(Self { points, faces, blocks, kept })
    }
}
