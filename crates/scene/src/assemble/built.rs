//! A built model, with the meshes of its bodies and a locator of points in them.

use std::sync::Arc;

use pliant_format::diagnostic::Diagnostic;
use pliant_geometry::{CellKind, Labels, Locator, Mesh, Surface, SurfaceLocator, Vector3};
use pliant_mechanics::Model;
use pliant_sim::ImplicitBodies;
use pliant_sim::contact::touch::Contacts;

use super::contacts::Meet;

/// A model, and further data for the outputs.
#[derive(Clone, Debug)]
pub struct Built {
    /// The model.
    pub model: Arc<Model>,
    /// Shells, and solids whose equations are solved, on the nodes of the model.
    pub implicit: Option<Arc<ImplicitBodies>>,
    /// The bodies' meshes, in the order of the model's bodies.
    pub bodies: Vec<BuiltBody>,
    /// The carried surfaces' meshes, in the order of the model's surfaces.
    pub surfaces: Vec<Mesh>,
    /// Contacts with obstacles and tools.
    pub contacts: Option<Arc<Contacts>>,
    /// True if written states are searched for intersections.
    pub check_intersections: bool,
    /// Surfaces that bodies of other participants touch.
    pub(crate) meets: Vec<Meet>,
    /// Displacements [m] of all nodes at the start, where bodies were pushed apart.
    pub pushed: Option<Arc<Vec<[f64; 3]>>>,
    /// Doubts that did not keep the model from being built.
    pub warnings: Vec<Diagnostic>,
    /// Remarks for the user, a sentence each.
    pub notes: Vec<String>,
}

/// A body's mesh at rest, in metres.
#[derive(Clone, Debug)]
pub struct BuiltBody {
    /// Its name.
    pub name: String,
    /// The mesh in the user's numbering.
    pub mesh: Mesh,
    /// Origin of the mesh, in words.
    pub origin: String,
    /// Its boundary.
    pub boundary: Surface,
    /// Nodes in the mesh file, or of the built-in shape.
    pub(super) file_nodes: usize,
    /// Number of each node in the mesh file; empty where no repair has changed it.
    pub(super) file_numbers: Vec<u32>,
}

impl BuiltBody {
    /// True if the body is made of lines.
    pub(crate) fn is_of_bars(&self) -> bool {
        self.boundary.faces.is_empty()
    }

    /// Finds points of its body.
    pub fn locator(&self) -> BodyLocator<'_> {
        if self.mesh.volume_blocks().any(|block| !block.is_empty()) {
            return BodyLocator::Cells(&self.mesh, Locator::new(&self.mesh));
        }
        if self.is_of_bars() {
            return BodyLocator::Lines(&self.mesh);
        }
        let faces: Vec<u32> = (0..self.boundary.faces.len() as u32).collect();
        BodyLocator::Wall(&self.boundary, SurfaceLocator::new(&self.boundary, &faces, &self.mesh.points))
    }

    /// The number that a node has in the mesh file, or in the mesh that a program gives.
    pub fn number_in_file(&self, node: u32) -> u32 {
        self.file_numbers.get(node as usize).copied().unwrap_or(node)
    }
}

/// Finds the cell of a solid, the triangle of a thin wall, or the bar that is nearest to a point.
pub enum BodyLocator<'b> {
    /// In the cells of a solid.
    Cells(&'b Mesh, Locator),
    /// On triangles.
    Wall(&'b Surface, SurfaceLocator),
    /// On bars, one after another: they are few.
    Lines(&'b Mesh),
}

/// The place of a point in a body.
pub struct Located {
    /// The kind of the cell that is nearest.
    pub kind: CellKind,
    /// Its number in its block.
    pub cell: u32,
    /// Nodes of the mesh with their weights.
    pub weights: Vec<(u32, f64)>,
    /// Distance of the point from the cell [m]; 0 inside.
    pub distance: f64,
}

impl BodyLocator<'_> {
    /// The place of a point at rest [m]; `None` without cells.
    pub fn locate(&self, point: &Vector3) -> Option<Located> {
        match self {
            Self::Cells(mesh, cells) => {
                let found = cells.locate(*point)?;
                let nodes = mesh.block(found.kind)?.cell(found.cell as usize);
                Some(Located {
                    kind: found.kind,
                    cell: found.cell,
                    weights: nodes.iter().copied().zip(found.weights().iter().copied()).collect(),
                    distance: found.distance,
                })
            }
            Self::Wall(surface, triangles) => {
                let found = triangles.closest(point)?;
                let parent = surface.faces[found.face as usize].parent;
                Some(Located {
                    kind: parent.kind,
                    cell: parent.index,
                    weights: found.nodes.into_iter().zip(found.weights).collect(),
                    distance: (found.position - point).norm(),
                })
            }
            Self::Lines(mesh) => {
                let nearest = |(cell, nodes): (u32, &[u32])| {
                    let [a, b] = [0, 1].map(|k| mesh.points[nodes[k] as usize]);
                    let part = ((point - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
                    Located {
                        kind: CellKind::Line,
                        cell,
                        weights: vec![(nodes[0], 1.0 - part), (nodes[1], part)],
                        distance: (a + (b - a) * part - point).norm(),
                    }
                };
                let lines = (0..).zip(mesh.block(CellKind::Line)?.cells());
                lines.map(nearest).min_by(|a, b| a.distance.total_cmp(&b.distance))
            }
        }
    }
}

/// The labels of a body or a surface by name, or of all bodies.
pub(crate) fn labels_of(model: &Model, bodies: &[BuiltBody], surfaces: &[Mesh], on: Option<&str>) -> Labels {
    let named = model.surfaces.iter().zip(surfaces).find(|(surface, _)| Some(surface.name.as_str()) == on);
    if let Some((_, mesh)) = named {
        return Labels::of(mesh);
    }
    let mut labels = Labels::default();
    for body in bodies.iter().filter(|body| on.is_none_or(|on| body.name == on)) {
        labels.join(Labels::of(&body.mesh));
    }
    labels
}
