//! Surfaces carried by bodies: each point tied to the cell it lies in, or the nearest one.

use pliant_geometry::{Locator, Mesh};
use pliant_mechanics::mapping::Mapping;
use pliant_mechanics::model::Surface;

use super::meshes::surface_of;
use super::{Builder, MeshOrigin};
use crate::diagnostic::Diagnostic;

/// A surface point further from its body than this part of the body's size is doubted.
const FAR: f64 = 0.05;

impl Builder<'_> {
    /// Adds all carried surfaces to the model.
    pub(super) fn add_surfaces(&mut self) {
        let scene = self.scene;
        for (name, table) in &scene.surfaces {
            let path = ["surface", name.as_str(), "mesh"];
            if self.bodies.iter().any(|body| body.name == *name) {
                let message = format!("`{name}` is the name of a body and of a surface");
                self.error(
                    &path[..2],
                    message,
                    "this surface",
                    "loads and outputs name both alike: rename one",
                );
                continue;
            }
            let body = self.find_body(&table.on, &[path[0], path[1], "on"]);
            let Some(MeshOrigin { mesh, .. }) = self.mesh(&table.mesh, &path) else { continue };
            let surface = surface_of(mesh);
            if surface.points.is_empty() || surface.blocks.is_empty() {
                let help = "it needs triangles or quads, or volume cells whose boundary is taken";
                self.error(&path, format!("surface `{name}` has no faces"), "this mesh", help);
                continue;
            }
            let Some(body) = body else { continue };
            let mapping = self.carry(body, name, &surface);
            let rest = surface.points.iter().map(|&p| <[f64; 3]>::from(p)).collect();
            self.model.surfaces.push(Surface { name: name.clone(), body, rest, mapping });
            self.surfaces.push(surface);
        }
    }

    fn carry(&mut self, body: usize, name: &str, surface: &Mesh) -> Mapping {
        let mesh = &self.bodies[body].mesh;
        let first = self.model.bodies[body].nodes.start;
        let locator = Locator::new(mesh);
        let mut farthest = 0.0_f64;
        let mut row = Vec::new();
        let mut rows = Vec::with_capacity(surface.points.len());
        for &point in &surface.points {
            row.clear();
            if let Some(location) = locator.locate(point)
                && let Some(block) = mesh.block(location.kind)
            {
                farthest = farthest.max(location.distance);
                let nodes = block.cell(location.cell as usize);
                row.extend(
                    nodes.iter().zip(location.weights()).map(|(&node, &weight)| (first + node, weight)),
                );
            }
            rows.push(row.clone());
        }
        let size = mesh.bounds().map_or(0.0, |(low, high)| (high - low).norm());
        if farthest > FAR * size {
            let message = format!(
                "points of surface `{name}` lie up to {farthest:.3e} m outside `{}`",
                self.bodies[body].name
            );
            let place = self.source().span(&["surface", name, "mesh"]);
            let help = "is it in the same units and place as the body? `scale` and `at` move it";
            self.out.push(Diagnostic::warning(message).at(place, "this surface").help(help));
        }
        Mapping::from_rows(rows.iter().map(Vec::as_slice))
    }
}
