//! Surfaces carried by bodies: each point tied to the cell it lies in, or the nearest one.

use pliant_format::diagnostic::Diagnostic;
use pliant_geometry::Mesh;
use pliant_geometry::words::number;
use pliant_implicit::{AssemblyState, CurvedSurface};
use pliant_mechanics::mapping::Weights;
use pliant_mechanics::model::Surface;
use pliant_shells::{Carried, EdgeRule};

use super::{Meshed, Tied};
use crate::assemble::meshes::{MeshOrigin, surface_of};

/// A point farther from its body than this fraction of the body's size gives a warning.
const FAR: f64 = 0.05;

impl Meshed<'_> {
    /// Warns of something that a body carries far outside of its mesh.
    pub(in crate::assemble) fn doubt_place(
        &mut self,
        what: &str,
        distance: f64,
        body: usize,
        path: &[&str],
        help: &str,
    ) {
        let built = &self.bodies[body];
        let size = built.mesh.bounds().map_or(0.0, |(low, high)| (high - low).norm());
        if distance > FAR * size {
            let message = format!(
                "{what} reaches {} m outside `{}`, which measures {} m across",
                number(distance),
                built.name,
                number(size)
            );
            let place = self.source().span(path);
            self.out.push(Diagnostic::warning(message).at(place, "far outside").help(help));
        }
    }
}

impl Tied<'_> {
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
                    "loads and outputs could mean either: rename one",
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
            let mapping = match self.shell_cells(body) {
                Some(cells) => self.carry_on_shell(body, &cells, name, &surface),
                None => self.carry(body, name, &surface),
            };
            let rest = surface.points.iter().map(|&p| <[f64; 3]>::from(p)).collect();
            self.assembly.model_mut().surfaces.push(Surface { name: name.clone(), body, rest, mapping });
            self.surfaces.push(surface);
        }
    }

    /// The points of a surface carried by the curved surface of a shell, kept there; no linear mapping.
    fn carry_on_shell(&mut self, body: usize, cells: &[u32], name: &str, surface: &Mesh) -> Weights {
        let assembly = &self.meshed.assembly;
        let curved = self.curved.get_or_insert_with(|| CurvedSurface::new(assembly, EdgeRule::Arc));
        let rest = AssemblyState::at_rest(assembly);
        let points = curved.carry_all(assembly, &rest, cells, &surface.points).unwrap_or_default();
        let away = |point: &Carried| point.height.hypot(point.aside[0]).hypot(point.aside[1]);
        let farthest = points.iter().map(away).fold(0.0, f64::max);
        let number = self.assembly.surfaces.len();
        self.assembly.carried.insert(number, points);
        let help = "is it in the same units and place as the body? `scale` and `at` move it";
        self.doubt_place(&format!("surface `{name}`"), farthest, body, &["surface", name, "mesh"], help);
        Weights::from_rows(surface.points.iter().map(|_| &[][..]))
    }

    fn carry(&mut self, body: usize, name: &str, surface: &Mesh) -> Weights {
        let model_body = &self.assembly.bodies[body];
        let locator = self.bodies[body].locator();
        let mut farthest = 0.0_f64;
        let mut row = Vec::new();
        let mut rows = Vec::with_capacity(surface.points.len());
        for &point in &surface.points {
            row.clear();
            if let Some(location) = locator.locate(&point) {
                farthest = farthest.max(location.distance);
                row.extend(location.weights.iter().map(|&(node, weight)| (model_body.node(node), weight)));
            }
            rows.push(row.clone());
        }
        let help = "is it in the same units and place as the body? `scale` and `at` move it";
        self.doubt_place(&format!("surface `{name}`"), farthest, body, &["surface", name, "mesh"], help);
        Weights::from_rows(rows.iter().map(Vec::as_slice))
    }
}

#[cfg(test)]
mod tests {
    use crate::testing::{CUBE, built, built_alone, mistakes};
    use pliant_mechanics::mapping::{Displaced, check};
    use pliant_testing::Random;

    #[test]
    fn a_carried_surface_moves_rigidly_and_linearly_with_its_body() {
        let built = built(
            "[surface.skin]\non = 'cube'\nmesh = { block = { size = [0.2, 0.1, 0.1] }, edge = 0.03 }\n",
        );
        let surface = &built.model.surfaces[0];
        assert!(surface.rest.len() > 50 && built.warnings.is_empty());
        let carried = surface.mapping.apply(&built.model.rest);
        for (point, rest) in carried.iter().zip(&surface.rest) {
            assert!(point.iter().zip(rest).all(|(a, b)| (a - b).abs() < 1e-12), "{point:?} {rest:?}");
        }
    }

    /// De Visser and Comas (2008): displacements go down by J, and forces come up by its exact transpose.
    /// Some nodes lie beyond the body, and some points beyond the cubes.
    #[test]
    fn the_smooth_surface_of_immersed_cubes_follows_them_and_gives_its_forces_back() {
        let mesh_line = CUBE.lines().find(|line| line.starts_with("mesh")).unwrap();
        let shape = "ellipsoid = { radii = [0.05, 0.04, 0.03] }";
        let text =
            CUBE.replace(mesh_line, &format!("mesh = {{ {shape}, edge = 0.012, as = 'immersed-hexes' }}"));
        let text = text.replace("{ set = \"z-min\" }", "{ box = [[-1, -1, -1], [1, 1, -0.02]] }");
        let built =
            built_alone(&format!("{text}[surface.skin]\non = 'cube'\nmesh = {{ {shape}, edge = 0.004 }}\n"));
        let (skin, rest) = (&built.model.surfaces[0], &built.model.rest);
        assert!(skin.rest.len() > 400 && built.warnings.is_empty());
        let apart = |a: &[[f64; 3]], b: &[[f64; 3]]| {
            a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        // At rest it is where it was made; turned by 70° about z and moved, and in any affine motion, it is
        // where it goes.
        assert!(apart(&skin.mapping.apply(rest), &skin.rest) < 1e-15);
        let (s, c) = 70.0_f64.to_radians().sin_cos();
        let rows = [
            [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]],
            [[1.2, 0.3, -0.1], [0.2, 0.7, 0.4], [-0.3, 0.1, 1.1]],
        ];
        for matrix in rows {
            let moved = |points: &[[f64; 3]]| -> Vec<[f64; 3]> {
                let of = |x: &[f64; 3], row: &[f64; 3]| row[0] * x[0] + row[1] * x[1] + row[2] * x[2] + 0.7;
                points.iter().map(|x| [0, 1, 2].map(|i| of(x, &matrix[i]))).collect()
            };
            assert!(apart(&skin.mapping.apply(&moved(rest)), &moved(&skin.rest)) < 1e-10);
        }
        // The battery of mappings, at rest under random velocities.
        let mut numbers = Random::new(1);
        let velocity: Vec<[f64; 3]> = rest.iter().map(|_| numbers.vector()).collect();
        let at = |time: f64| -> Vec<[f64; 3]> { velocity.iter().map(|v| v.map(|v| v * time)).collect() };
        let places = [at(-1e-3), at(0.0), at(1e-3)];
        let [before, state, after] =
            [0, 1, 2].map(|i| Displaced { rest, displacement: &places[i], velocity: &velocity });
        let node = |node: u32| [rest[node as usize], velocity[node as usize], [0.0; 3]];
        let passed = check(&skin.mapping, [&before, &state, &after], 2e-3, node, 0..skin.rest.len());
        assert_eq!(passed, Ok(()));
    }

    #[test]
    fn a_surface_needs_a_body_and_a_name_of_its_own() {
        let mesh = "mesh = { block = { size = [0.2, 0.1, 0.1] }, edge = 0.1 }\n";
        let message = mistakes(&format!("[surface.skin]\non = 'cubes'\n{mesh}")).plain().to_string();
        assert!(message.contains("there is no body `cubes` (help: did you mean `cube`?)"), "{message}");
        let message = mistakes(&format!("[surface.cube]\non = 'cube'\n{mesh}")).plain().to_string();
        assert!(message.contains("`cube` is the name of a body and of a surface"), "{message}");
    }
}
