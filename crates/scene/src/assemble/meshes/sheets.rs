//! Built-in shapes of triangles for shells.

use std::f64::consts::FRAC_PI_2;

use pliant_format::tables::{MeshTable, PatternName, SheetGrid};
use pliant_geometry::Mesh;
use pliant_geometry::words::number;
use pliant_meshing::{DEFAULT_CELL_LIMIT, Distortion, Lens, Pattern, Sheet, sphere};

use super::MeshOrigin;
use crate::assemble::Context;

/// A shape on a grid, with the lengths [m] of its grid axes.
struct OnGrid<'t> {
    sheet: Sheet,
    lengths: [f64; 2],
    grid: &'t SheetGrid,
}

/// True for a built-in shape of triangles.
pub(in crate::assemble) fn is_sheet(table: &MeshTable) -> bool {
    table.sphere.is_some() || table.lens.is_some() || on_grid(table).is_some()
}

/// The shape on a grid that it names.
fn on_grid(table: &MeshTable) -> Option<OnGrid<'_>> {
    let made = |sheet, lengths, grid| Some(OnGrid { sheet, lengths, grid });
    if let Some(plate) = &table.plate {
        return made(Sheet::Plate { size: plate.size }, plate.size, &plate.grid);
    }
    if let Some(shape) = &table.cylinder {
        let (from, span) = (shape.from.to_radians(), shape.span.to_radians());
        let sheet = Sheet::Cylinder { radius: shape.radius, length: shape.length, from, span };
        return made(sheet, [shape.radius * span, shape.length], &shape.grid);
    }
    if let Some(shape) = &table.hemisphere {
        let (hole, span) = (shape.hole.to_radians(), shape.span.to_radians());
        let sheet = Sheet::Hemisphere { radius: shape.radius, hole, span };
        return made(sheet, [shape.radius * span, shape.radius * (FRAC_PI_2 - hole)], &shape.grid);
    }
    if let Some(shape) = &table.annulus {
        let span = shape.span.to_radians();
        let sheet = Sheet::Annulus { inner: shape.inner, outer: shape.outer, span };
        let lengths = [shape.outer - shape.inner, 0.5 * (shape.outer + shape.inner) * span];
        return made(sheet, lengths, &shape.grid);
    }
    let shape = table.twisted_strip.as_ref()?;
    let sheet =
        Sheet::TwistedStrip { length: shape.length, width: shape.width, twist: shape.twist.to_radians() };
    made(sheet, [shape.length, shape.width], &shape.grid)
}

impl Context<'_> {
    /// The triangles of a shape (`source` is its key).
    pub(super) fn sheet(&mut self, source: &str, table: &MeshTable, path: &[&str]) -> Option<MeshOrigin> {
        let at = |key| [path, &[key]].concat();
        let refused = [
            ("fix", table.fix.is_some(), "`fix` repairs mesh files; shapes need none"),
            ("scale", table.factor() != 1.0, "shapes are given in metres, without `scale`"),
            (
                "as",
                table.cells.is_some(),
                "this shape is a wall of triangles; solids are `block`, `ellipsoid`, `tube` and `organ`",
            ),
        ];
        for (key, given, message) in refused {
            if given {
                self.error(&at(key), message, "here", "leave it out");
                return None;
            }
        }
        let made = match (&table.sphere, &table.lens) {
            (Some(shape), _) => {
                let levels = match (shape.levels, table.edge) {
                    (Some(levels), None) => Some(levels),
                    // The edge of an icosahedron is 1.0515 times the radius of the sphere round it.
                    (None, Some(edge)) => Some((1.0515 * shape.radius / edge).log2().ceil().max(0.0) as u32),
                    _ => None,
                };
                levels.map(|levels| sphere(shape.radius, levels, DEFAULT_CELL_LIMIT))
            }
            (None, Some(shape)) => table.edge.map(|edge| {
                let (transition, sweep) = (shape.transition.to_radians(), shape.sweep.to_radians());
                let lens = Lens {
                    optic: shape.optic,
                    overall: shape.overall,
                    width: shape.width,
                    transition,
                    sweep,
                };
                lens.mesh(edge, DEFAULT_CELL_LIMIT)
            }),
            (None, None) => on_grid(table).and_then(|shape| {
                let counts = match (shape.grid.cells, table.edge) {
                    (Some(cells), None) => cells.map(|n| n as usize),
                    (None, Some(edge)) => {
                        shape.lengths.map(|length| (length / edge).round().max(1.0) as usize)
                    }
                    _ => return None,
                };
                let distortion = (shape.grid.distortion > 0.0)
                    .then_some(Distortion { amount: shape.grid.distortion, seed: shape.grid.seed });
                Some(shape.sheet.mesh(counts, pattern(shape.grid.pattern), distortion, DEFAULT_CELL_LIMIT))
            }),
        };
        let key = if table.sphere.is_some() { "levels" } else { "cells" };
        match made {
            Some(Ok(mesh)) => Some(MeshOrigin { origin: described(source, &mesh), mesh }),
            Some(Err(error)) => {
                self.error(&at(source), error.to_string(), "this shape", "");
                None
            }
            None if table.lens.is_some() => {
                let help = "give the size of a triangle in metres";
                self.error(&at(source), "`lens` needs `edge`", "this shape", help);
                None
            }
            None => {
                let found = if table.edge.is_some() { "both" } else { "neither" };
                let message = format!("`{source}` needs either `edge` or `{key}`, found {found}");
                let help = "`edge` is the size of a triangle in metres";
                self.error(&at(source), message, "this shape", help);
                None
            }
        }
    }
}

fn pattern(name: PatternName) -> Pattern {
    match name {
        PatternName::Diagonal => Pattern::Diagonal,
        PatternName::Antidiagonal => Pattern::Antidiagonal,
        PatternName::UnionJack => Pattern::UnionJack,
        PatternName::Crossed => Pattern::Crossed,
    }
}

fn described(source: &str, mesh: &Mesh) -> String {
    let size = mesh.bounds().map_or(0.0, |(low, high)| (high - low).norm());
    format!("{source}, {} m across", number(size))
}

#[cfg(test)]
mod tests {
    use crate::testing::{built_alone, mistakes_alone};

    fn shell(mesh: &str) -> String {
        format!(
            "[scene]\nuntil = 1\n[run]\nsolver = 'implicit'\n[law.wall]\ntype = 'neo-hookean'\nyoung-modulus = 1e6\n\
             poisson-ratio = 0.3\n[body.wall]\nmodel = 'shell'\nmesh = {mesh}\nlaw = 'wall'\ndensity = 1000\n\
             thickness = 1e-3\n"
        )
    }

    #[test]
    fn every_shape_is_made_with_its_sets() {
        for (mesh, triangles, sets) in [
            ("{ plate = { size = [1, 0.5], cells = [4, 2], pattern = 'crossed', distortion = 0.2 } }", 32, 4),
            ("{ plate = { size = [1, 0.5] }, edge = 0.25 }", 16, 4),
            ("{ cylinder = { radius = 0.1, length = 0.3, cells = [8, 3], pattern = 'union-jack' } }", 48, 2),
            ("{ cylinder = { radius = 0.1, length = 0.3, from = 40, span = 80, cells = [8, 3] } }", 48, 4),
            ("{ sphere = { radius = 0.1, levels = 1 } }", 80, 0),
            ("{ sphere = { radius = 0.1 }, edge = 0.06 }", 80, 0),
            ("{ hemisphere = { radius = 1, hole = 18, span = 90, cells = [2, 2] } }", 8, 4),
            ("{ annulus = { inner = 0.6, outer = 1, cells = [2, 10] } }", 40, 4),
            ("{ twisted-strip = { length = 1.2, width = 0.1, twist = 90, cells = [12, 2] } }", 48, 4),
        ] {
            let built = built_alone(&shell(mesh));
            let sheet = &built.bodies[0].mesh;
            let facets = built.implicit.as_ref().unwrap().model.facets.len();
            assert_eq!((facets, sheet.point_sets.len()), (triangles, sets), "{mesh}");
            assert!(built.warnings.is_empty(), "{:?}", built.warnings);
        }
    }

    #[test]
    fn a_shape_needs_one_size_and_no_repairs() {
        for (mesh, says) in [
            ("{ plate = { size = [1, 1] } }", "`plate` needs either `edge` or `cells`, found neither"),
            ("{ plate = { size = [1, 1], cells = [2, 2] }, edge = 0.1 }", "found both"),
            ("{ sphere = { radius = 1 } }", "`sphere` needs either `edge` or `levels`"),
            (
                "{ lens = { optic = 6e-3, overall = 12e-3, width = 5e-4, transition = 60, sweep = 140 } }",
                "`lens` needs `edge`",
            ),
            (
                "{ lens = { optic = 6e-3, overall = 5e-3, width = 5e-4, transition = 60, sweep = 140 }, edge = 3e-4 }",
                "overall diameter beyond the optic is -0.001",
            ),
            ("{ plate = { size = [1, 1], cells = [0, 2] } }", "the number of cells along x is 0"),
            ("{ plate = { size = [1, 1], cells = [2, 2] }, as = 'hexes' }", "a wall of triangles"),
            ("{ plate = { size = [1, -1], cells = [2, 2] } }", "size along y is -1"),
            ("{ sphere = { radius = 1, levels = 40 } }", "exceed the limit"),
            ("{ cylinder = { radius = 1, length = 1, span = 400 }, edge = 1 }", "span"),
        ] {
            let message = mistakes_alone(&shell(mesh)).plain().to_string();
            assert!(message.contains(says), "{mesh}: {message}");
        }
    }
}
