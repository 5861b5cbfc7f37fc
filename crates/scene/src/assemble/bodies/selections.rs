//! Bodies by name, and the nodes and facets that a selection holds.

use pliant_format::diagnostic::Diagnostic;
use pliant_format::{SCENE, suggestion};
use pliant_geometry::words::number;
use pliant_geometry::{Mesh, Selection, Vector3};
use pliant_sim::BodyCells;

use super::Meshed;

/// A nearest node farther from its point than this many body sizes gives a warning.
const FAR: f64 = 10.0;

impl Meshed<'_> {
    /// Finds the body of a name; a diagnostic at `path` if there is no such body.
    pub(in crate::assemble) fn find_body(&mut self, name: &str, path: &[&str]) -> Option<usize> {
        let found = self.bodies.iter().position(|body| body.name == name);
        if found.is_none() {
            let known: Vec<&str> = self.bodies.iter().map(|body| body.name.as_str()).collect();
            let help = suggestion(name, &known, SCENE, "bodies");
            self.error(path, format!("there is no body `{name}`"), "no such body", help);
        }
        found
    }

    /// The nodes of a body that a selection holds, numbered in the model.
    pub(in crate::assemble) fn body_nodes(
        &mut self,
        body: usize,
        selection: &Selection,
        path: &[&str],
    ) -> Option<Vec<u32>> {
        let built = &self.bodies[body];
        let model_body = &self.assembly.bodies[body];
        match selection.nodes(&built.mesh, &built.boundary) {
            Ok(nodes) => {
                let (mesh, name) = (&built.mesh, &built.name);
                let size = mesh.bounds().map_or(0.0, |(low, high)| (high - low).norm());
                for (point, distance) in nearest_points(selection, mesh) {
                    if distance > FAR * size {
                        let message = format!(
                            "the node nearest to {point:?} is {} m away, and `{name}` measures {} m across",
                            number(distance),
                            number(size)
                        );
                        let help =
                            "points are in metres, where the body is after its mesh's `scale` and `at`";
                        let place = self.context.source().span(path);
                        let doubt = Diagnostic::warning(message).at(place, "far outside").help(help);
                        self.context.out.push(doubt);
                    }
                }
                Some(nodes.into_iter().map(|node| model_body.node(node)).collect())
            }
            Err(error) => {
                self.error(path, error.to_string(), "this selection", "");
                None
            }
        }
    }

    /// The facets of a shell, numbered in the model; `None` for another body.
    pub(in crate::assemble) fn shell_cells(&self, body: usize) -> Option<Vec<u32>> {
        match self.cells.get(body)? {
            BodyCells::Facets(range) => Some(range.clone().collect()),
            BodyCells::Solids => None,
        }
    }

    /// The selected facets of a shell, numbered in the model.
    pub(in crate::assemble) fn facets(
        &mut self,
        body: usize,
        selection: &Selection,
        path: &[&str],
    ) -> Option<Vec<u32>> {
        let cells = self.shell_cells(body)?;
        let built = &self.bodies[body];
        match selection.faces(&built.mesh, &built.boundary) {
            Ok(faces) => {
                let cell = |face: u32| cells[built.boundary.faces[face as usize].parent.index as usize];
                Some(faces.into_iter().map(cell).collect())
            }
            Err(error) => {
                self.error(path, error.to_string(), "this selection", "");
                None
            }
        }
    }

    /// True if the nodes of a body turn.
    pub(in crate::assemble) fn has_rotations(&self, body: usize) -> bool {
        self.shell_cells(body).is_some()
    }
}

/// Returns the points by which a selection takes nearest nodes, each with its distance [m] from the nearest
/// node.
fn nearest_points(selection: &Selection, mesh: &Mesh) -> Vec<([f64; 3], f64)> {
    match selection {
        Selection::Nearest { point, .. } => {
            let place = Vector3::from(*point);
            let distance = mesh.points.iter().map(|p| (p - place).norm()).fold(f64::INFINITY, f64::min);
            vec![(*point, distance)]
        }
        Selection::Union(parts) | Selection::Intersection(parts) | Selection::Difference(parts) => {
            parts.iter().flat_map(|part| nearest_points(part, mesh)).collect()
        }
        _ => Vec::new(),
    }
}
