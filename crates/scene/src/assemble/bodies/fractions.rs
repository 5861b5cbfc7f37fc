//! Fraction of each cell that its body fills.

use pliant_format::suggestion;
use pliant_format::tables::Cells;
use pliant_geometry::{CellBlock, CellId};
use pliant_meshing::Voxels;

use super::Draft;
use crate::assemble::Context;
use crate::assemble::meshes::list_cells;

impl Context<'_> {
    /// Returns the filled fraction of some cells of a body; diagnostics where the data are missing or wrong.
    pub(super) fn fractions(
        &mut self,
        draft: &Draft<'_>,
        block: &CellBlock,
        cells: &[u32],
    ) -> Option<Vec<f64>> {
        let path = ["body", draft.name, "fraction"];
        let immersed = draft.table.mesh.made_of() == Cells::ImmersedHexes;
        let given = draft.table.fraction.as_deref();
        let Some(key) = given.or(immersed.then_some(Voxels::FRACTION)) else {
            return Some(vec![1.0; cells.len()]);
        };
        let Some(data) = block.data.get(key).filter(|data| data.components == 1) else {
            let known: Vec<&str> = block.data.keys().map(String::as_str).collect();
            let message = format!(
                "the {} cells of `{}` have no data `{key}` of one number per cell",
                block.kind.name(),
                draft.name
            );
            self.error(&path, message, "no such data", suggestion(key, &known, "the mesh", "cell data"));
            return None;
        };
        let is_part = |cell: &&u32| {
            let value = data.values[**cell as usize];
            !(value > 0.0 && value <= 1.0)
        };
        let wrong: Vec<CellId> =
            cells.iter().filter(is_part).map(|&index| CellId { kind: block.kind, index }).collect();
        if !wrong.is_empty() {
            let message =
                format!("`{key}` is not a fraction in cells of `{}`: {}", draft.name, list_cells(&wrong));
            let help = "a fraction is the part of a cell that the body fills, above 0 and at most 1";
            self.error(&path, message, "these fractions", help);
            return None;
        }
        Some(cells.iter().map(|&cell| data.values[cell as usize]).collect())
    }
}

#[cfg(test)]
mod tests {
    use pliant_geometry::io;

    use crate::assemble::build;
    use crate::testing::{CUBE, built_alone};
    use pliant_format::Scene;
    use pliant_format::source::Source;

    /// The volume of a body and the names of its kinds of cells.
    fn volume(built: &crate::Built) -> f64 {
        built.model.solids.iter().flat_map(|s| (0..s.cells.len()).map(|c| s.cells.volume(c))).sum()
    }

    #[test]
    fn immersed_cubes_of_an_ellipsoid_weigh_what_it_weighs() {
        let mesh_line = CUBE.lines().find(|line| line.starts_with("mesh")).unwrap();
        let of = |cells: &str| {
            let mesh = format!(
                "mesh = {{ ellipsoid = {{ radii = [0.05, 0.04, 0.03] }}, edge = 0.01, as = '{cells}' }}"
            );
            let held = "nodes = { box = [[-1, -1, -1], [1, 1, -0.02]] }";
            built_alone(&CUBE.replace(mesh_line, &mesh).replace("nodes = { set = \"z-min\" }", held))
        };
        let exact = 4.0 / 3.0 * std::f64::consts::PI * 0.05 * 0.04 * 0.03;
        let immersed = of("immersed-hexes");
        // No cell counts for less than a tenth, which adds a little.
        assert!((volume(&immersed) / exact - 1.0).abs() < 0.015, "{}", volume(&immersed) / exact);
        assert!((immersed.model.mass.iter().sum::<f64>() / (1000.0 * volume(&immersed)) - 1.0).abs() < 1e-12);
        assert!(immersed.model.cell_count() > of("hexes").model.cell_count());
    }

    /// Nothing but their stiffness against hourglass patterns would hold cubes of which little is filled.
    #[test]
    fn immersed_cubes_are_full_elements_unless_something_else_is_given() {
        let mesh_line = CUBE.lines().find(|line| line.starts_with("mesh")).unwrap();
        let element = |cells: &str, law: &str, more: &str| {
            let mesh = format!(
                "mesh = {{ ellipsoid = {{ radii = [0.05, 0.04, 0.03] }}, edge = 0.02, as = '{cells}' }}\n{more}"
            );
            let held = "nodes = { box = [[-1, -1, -1], [1, 1, -0.02]] }";
            let text = CUBE.replace(mesh_line, &mesh).replace("nodes = { set = \"z-min\" }", held);
            let built = built_alone(&text.replace("neo-hookean", law));
            built.model.solids[0].cells.element()
        };
        let law = "neo-hookean";
        assert_eq!(element("immersed-hexes", law, ""), "hex8-full");
        assert_eq!(element("hexes", law, ""), "hex8");
        assert_eq!(element("immersed-hexes", law, "element = 'hex8'"), "hex8");
        assert_eq!(element("immersed-hexes", law, "hourglass = 0.3"), "hex8");
        // No element averages the pressure of this law.
        assert_eq!(element("immersed-hexes", "st-venant-kirchhoff", ""), "hex8");
    }

    #[test]
    fn fractions_of_a_mesh_file_count_where_the_body_names_them() {
        let folder = tempfile::tempdir().unwrap();
        let mesh_line = CUBE.lines().find(|line| line.starts_with("mesh")).unwrap();
        let mut mesh = built_alone(CUBE).bodies[0].mesh.clone();
        let write = |mesh: &mut pliant_geometry::Mesh, values: Vec<f64>| {
            mesh.blocks[0].data.insert("fill".into(), pliant_geometry::DataArray::scalar(values));
            io::write(&folder.path().join("cube.vtu"), mesh).unwrap();
        };
        let of = |more: &str| {
            let text = CUBE.replace(mesh_line, &format!("mesh = {{ file = 'cube.vtu' }}\n{more}"));
            let text =
                text.replace("nodes = { set = \"z-min\" }", "nodes = { box = [[-1, -1, -1], [1, 1, 0]] }");
            let scene =
                Scene::from_source(Source::parse("a.toml", text).unwrap(), folder.path().into()).unwrap();
            build(&scene).map_err(|errors| errors.plain().to_string())
        };
        write(&mut mesh, vec![1.0, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.01]);
        assert!((volume(&of("").unwrap()) - 0.002).abs() < 1e-15);
        assert!((volume(&of("fraction = 'fill'").unwrap()) - 0.002 * (1.0 + 3.0 + 0.1) / 8.0).abs() < 1e-15);
        let message = of("fraction = 'fil'").unwrap_err();
        assert!(message.contains("no data `fil`") && message.contains("did you mean `fill`?"), "{message}");
        write(&mut mesh, vec![1.0, 0.5, 0.0, 0.5, 1.5, 0.5, 0.5, 0.5]);
        let message = of("fraction = 'fill'").unwrap_err();
        assert!(message.contains("hex 2, hex 4 (counted from 0)"), "{message}");
    }
}
