//! The targets of loads and outputs: bodies and the surfaces that they carry, with their faces.

use pliant_format::{SCENE, suggestion};
use pliant_geometry::{Mesh, Selection, Surface, boundary};
use pliant_mechanics::load::{Face, NO_NODE};

use super::Tied;

/// The target of a load or an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Subject {
    /// A body, by index.
    Body(usize),
    /// A carried surface, by index.
    Surface(usize),
}

impl Tied<'_> {
    /// Finds the body or surface of a name; a diagnostic at `path` if there is no such name.
    pub(in crate::assemble) fn find_target(&mut self, name: &str, path: &[&str]) -> Option<Subject> {
        if let Some(index) = self.assembly.surfaces.iter().position(|surface| surface.name == name) {
            return Some(Subject::Surface(index));
        }
        if self.bodies.iter().any(|body| body.name == name) {
            return self.find_body(name, path).map(Subject::Body);
        }
        let bodies = self.bodies.iter().map(|body| body.name.as_str());
        let known: Vec<&str> = bodies.chain(self.assembly.surfaces.iter().map(|s| s.name.as_str())).collect();
        let help = suggestion(name, &known, SCENE, "bodies and surfaces");
        self.error(path, format!("there is no body or surface `{name}`"), "no such body or surface", help);
        None
    }

    /// The selected faces of a body (numbered in the model) or of a carried surface (numbered in it).
    pub(in crate::assemble) fn faces(
        &mut self,
        target: Subject,
        selection: &Selection,
        path: &[&str],
    ) -> Option<Vec<Face>> {
        let result = match target {
            Subject::Body(body) => {
                let (built, model_body) = (&self.bodies[body], &self.assembly.bodies[body]);
                select_faces(selection, &built.mesh, &built.boundary, |node| model_body.node(node))
            }
            Subject::Surface(index) => {
                let (mesh, boundary) = self.surface_mesh(index);
                select_faces(selection, &mesh, &boundary, |node| node)
            }
        };
        result.map_err(|error| self.error(path, error, "this selection", "")).ok()
    }

    pub(in crate::assemble) fn surface_mesh(&self, index: usize) -> (Mesh, Surface) {
        let mesh = self.surfaces[index].clone();
        let boundary = boundary(&mesh);
        (mesh, boundary)
    }
}

fn select_faces(
    selection: &Selection,
    mesh: &Mesh,
    boundary: &Surface,
    number: impl Fn(u32) -> u32,
) -> Result<Vec<Face>, String> {
    let face = |index: u32| {
        let mut face = [NO_NODE; 4];
        for (numbered, &node) in face.iter_mut().zip(boundary.faces[index as usize].nodes()) {
            *numbered = number(node);
        }
        face
    };
    let selected = selection.faces(mesh, boundary).map_err(|error| error.to_string())?;
    Ok(selected.into_iter().map(face).collect())
}
