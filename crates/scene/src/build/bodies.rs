//! Bodies: nodes, cells grouped by element and law, fibres, masses.

use std::collections::BTreeMap;

use pliant_geometry::{CellBlock, CellId, CellKind, DataArray, Mesh, boundary};
use pliant_mechanics::model::{Averaging, Body, Cells, Material, Solid};
use pliant_mechanics::prony::{Prony, PronyError};

use super::meshes::list_cells;
use super::{Builder, BuiltBody, SCENE, suggestion};
use crate::diagnostic::counted;
use crate::format::{BodyTable, Element, Fibre, LawChoice};
use crate::registry::LawTable;

/// Fibres shorter than this are zero.
const ZERO_FIBRE: f64 = 1e-12;

impl Builder<'_> {
    pub(super) fn add_bodies(&mut self) {
        let scene = self.scene;
        for (name, table) in &scene.bodies {
            let path = ["body", name.as_str()];
            let mesh_path = [path[0], path[1], "mesh"];
            let Some(mut made) = self.mesh(&table.mesh, &mesh_path) else { continue };
            if !self.repair_and_check(&mut made.mesh, &table.mesh, &mesh_path) {
                continue;
            }
            self.add_body(name, table, &made.mesh);
            let boundary = boundary(&made.mesh);
            self.bodies.push(BuiltBody {
                name: name.clone(),
                mesh: made.mesh,
                origin: made.origin,
                boundary,
            });
        }
        self.check_unused_laws();
    }

    fn add_body(&mut self, name: &str, table: &BodyTable, mesh: &Mesh) {
        let first = self.model.rest.len() as u32;
        let body = self.model.bodies.len();
        self.model.rest.extend(mesh.points.iter().map(|&p| <[f64; 3]>::from(p)));
        self.model.mass.resize(self.model.rest.len(), 0.0);
        let nodes = first..self.model.rest.len() as u32;
        self.model.bodies.push(Body { name: name.into(), nodes, damping: table.damping });
        self.check_labels(name, table, mesh);
        for block in mesh.volume_blocks().filter(|block| !block.is_empty()) {
            if !self.check_element(name, table, block.kind) {
                return;
            }
            for (law_name, cells) in cells_by_law(&table.law, block) {
                self.add_solid(name, table, body, block, &law_name, cells);
            }
        }
    }

    fn check_element(&mut self, name: &str, table: &BodyTable, kind: CellKind) -> bool {
        let fits = table.element.is_none_or(|element| element.is_tet() == (kind == CellKind::Tet));
        if !fits {
            let cells = if kind == CellKind::Tet { "tets" } else { "hexes" };
            let message = format!("the mesh of `{name}` has {cells}, which this element is not for");
            let help = "tets: `tet4`, `tet4-anp`, `tet4-ianp`; hexes: `hex8`, `hex8-full`; leave `element` out to let the mesh decide";
            self.error(&["body", name, "element"], message, "does not fit the mesh", help);
        }
        fits
    }

    /// Where laws go by label: whether each cell's label has a law, and each law's label a cell.
    fn check_labels(&mut self, name: &str, table: &BodyTable, mesh: &Mesh) {
        let LawChoice::ByLabel(map) = &table.law else { return };
        let path = ["body", name, "law"];
        let mut counts: BTreeMap<String, usize> = BTreeMap::new();
        for block in mesh.volume_blocks().filter(|block| !block.is_empty()) {
            let Some(labels) = block.data.get("label") else {
                let message = format!("the {} cells of `{name}` have no labels", block.kind.name());
                let help = "name one law for the whole body, or use a mesh whose cell data `label` numbers its regions";
                self.error(&path, message, "laws by label", help);
                return;
            };
            for label in &labels.values {
                *counts.entry(label.to_string()).or_default() += 1;
            }
        }
        let list = |items: &mut dyn Iterator<Item = String>| items.collect::<Vec<_>>().join(", ");
        let missing = counts.iter().filter(|(label, _)| !map.contains_key(*label));
        let missing = list(&mut missing.map(|(label, n)| format!("{label} ({})", counted(*n, "cell"))));
        if !missing.is_empty() {
            let message = format!("cells of `{name}` have labels without a law: {missing}");
            self.error(&path, message, "no law for these", "add `LABEL = \"law\"` for each of them");
        }
        let known = list(&mut counts.keys().cloned());
        for label in map.keys().filter(|label| !counts.contains_key(*label)) {
            let message = format!("no cell of `{name}` has label `{label}`");
            let help = format!("remove it; labels of the mesh: {known}");
            self.error(&[path[0], path[1], path[2], label], message, "no such label", help);
        }
    }

    fn add_solid(
        &mut self,
        name: &str,
        table: &BodyTable,
        body: usize,
        block: &CellBlock,
        law_name: &str,
        cells: Vec<u32>,
    ) {
        let scene = self.scene;
        let Some((_, law)) = scene.laws.iter().find(|(known, _)| known == law_name) else {
            let known: Vec<&str> = scene.laws.iter().map(|(name, _)| name.as_str()).collect();
            let message = format!("there is no law `{law_name}`");
            let help = suggestion(law_name, &known, SCENE, "laws");
            self.error(&law_path(name, &table.law, law_name), message, "no such law", help);
            return;
        };
        if table.element.is_some_and(Element::averages_pressure) && !law.law.has_volumetric_energy() {
            let law = law.law.name();
            let message =
                format!("this element averages the pressure, and `{law}` has no energy of the volume alone");
            let help = "take `tet4` or `hex8`, or a law with a volumetric energy such as `neo-hookean`";
            self.error(&["body", name, "element"], message, "does not go with the law", help);
            return;
        }
        let Some(prony) = self.prony(law_name, law) else { return };
        let Some(fibre) = self.fibres(name, table, law_name, law, block, &cells) else { return };
        let material = Material { law: law.law, prony, density: table.density };
        let first = self.model.bodies[body].nodes.start;
        let rest = &self.model.rest;
        let shear = law.law.small_strain().shear;
        let tets = || cells.iter().map(|&c| nodes(block, c, first)).collect();
        let hexes = || cells.iter().map(|&c| nodes(block, c, first)).collect();
        let cells_of = match (block.kind, table.element) {
            (CellKind::Tet, Some(Element::Tet4Anp)) => Cells::averaged_tet4(tets(), rest, Averaging::Nodal),
            (CellKind::Tet, Some(Element::Tet4Ianp)) => {
                Cells::averaged_tet4(tets(), rest, Averaging::Variational)
            }
            (CellKind::Tet, Some(Element::Tet4IanpNiftysim)) => {
                Cells::averaged_tet4(tets(), rest, Averaging::NiftySim)
            }
            (CellKind::Tet, _) => Cells::tet4(tets(), rest),
            (_, Some(Element::Hex8Full)) => Cells::full_hex8(hexes(), rest),
            _ => Cells::hex8(hexes(), rest, table.hourglass, shear),
        };
        self.model.add_solid(Solid { body, material, cells: cells_of, fibre, original: cells });
    }

    fn prony(&mut self, law_name: &str, law: &LawTable) -> Option<Prony> {
        let path = ["law", law_name, "prony"];
        match Prony::new(&law.extras.prony, law.extras.prony_update) {
            Ok(prony) => Some(prony),
            Err(error) => {
                let index = match error {
                    PronyError::Term { index, .. } => Some(index.to_string()),
                    PronyError::Sum { .. } => None,
                };
                let place: Vec<&str> = path.iter().copied().chain(index.as_deref()).collect();
                let help = "a weight is the fraction of the instantaneous stress that relaxes with its time";
                // The same law may serve several bodies: say it once.
                if !self.out.iter().any(|known| known.message == error.to_string()) {
                    self.error(&place, error.to_string(), "here", help);
                }
                None
            }
        }
    }

    /// The unit fibre of each cell; empty if the law has none.
    fn fibres(
        &mut self,
        name: &str,
        table: &BodyTable,
        law_name: &str,
        law: &LawTable,
        block: &CellBlock,
        cells: &[u32],
    ) -> Option<Vec<[f64; 3]>> {
        if !law.law.needs_fibre() {
            return Some(Vec::new());
        }
        let (given, path) = match (&table.fibre, &law.extras.fibre) {
            (Some(fibre), _) => (fibre, ["body", name, "fibre"]),
            (None, Some(fibre)) => (fibre, ["law", law_name, "fibre"]),
            (None, None) => {
                let message = format!("`{name}` has a law with fibres, but no fibre direction");
                let help =
                    "add `fibre = [x, y, z]` or `fibre = { cell-data = \"name\" }` to the law or the body";
                self.error(&["body", name, "law"], message, "this law needs a fibre", help);
                return None;
            }
        };
        let field = match given {
            Fibre::Uniform(direction) => {
                let Some(unit) = unit(direction) else {
                    let help = "the direction in which the fibres run, for example [0, 1, 0]; its length does not matter";
                    self.error(&path, "the fibre direction is zero", "no direction", help);
                    return None;
                };
                return Some(vec![unit; cells.len()]);
            }
            Fibre::PerCell(field) => &field.cell_data,
        };
        let Some(data) = block.data.get(field) else {
            let known: Vec<&str> = block.data.keys().map(String::as_str).collect();
            let help = suggestion(field, &known, "the mesh", "cell data");
            self.error(
                &path,
                format!("the mesh of `{name}` has no cell data `{field}`"),
                "no such data",
                help,
            );
            return None;
        };
        self.fibres_from(name, field, data, block.kind, cells, &path)
    }

    fn fibres_from(
        &mut self,
        name: &str,
        field: &str,
        data: &DataArray,
        kind: CellKind,
        cells: &[u32],
        path: &[&str],
    ) -> Option<Vec<[f64; 3]>> {
        if data.components != 3 {
            let message =
                format!("cell data `{field}` has {} components, a direction has 3", data.components);
            self.error(path, message, "not directions", "name an array of vectors");
            return None;
        }
        let directions: Vec<_> = cells.iter().filter_map(|&cell| unit(data.item(cell as usize))).collect();
        if directions.len() < cells.len() {
            let without = cells.iter().filter(|&&cell| unit(data.item(cell as usize)).is_none());
            let without: Vec<CellId> = without.map(|&index| CellId { kind, index }).collect();
            let message =
                format!("cells of `{name}` whose fibre is zero or not finite: {}", list_cells(&without));
            self.error(path, message, "from this data", "give every cell a direction in the mesh file");
            return None;
        }
        Some(directions)
    }

    fn check_unused_laws(&mut self) {
        let scene = self.scene;
        for (name, _) in &scene.laws {
            let used = scene.bodies.iter().any(|(_, body)| match &body.law {
                LawChoice::One(law) => law == name,
                LawChoice::ByLabel(map) => map.values().any(|law| law == name),
            });
            if !used {
                self.notes.push(format!("law `{name}` is used by no body"));
            }
        }
    }
}

/// The cells of a block that each law takes, by law name.
fn cells_by_law(choice: &LawChoice, block: &CellBlock) -> BTreeMap<String, Vec<u32>> {
    let mut cells: BTreeMap<String, Vec<u32>> = BTreeMap::new();
    for cell in 0..block.len() as u32 {
        let law = match choice {
            LawChoice::One(law) => Some(law),
            LawChoice::ByLabel(map) => {
                block.data.get("label").and_then(|labels| map.get(&labels.item(cell as usize)[0].to_string()))
            }
        };
        if let Some(law) = law {
            cells.entry(law.clone()).or_default().push(cell);
        }
    }
    cells
}

/// Where a body names a law: its `law`, or the label in it.
fn law_path<'a>(body: &'a str, choice: &'a LawChoice, law: &str) -> Vec<&'a str> {
    let label = match choice {
        LawChoice::One(_) => None,
        LawChoice::ByLabel(map) => map.iter().find(|(_, known)| *known == law).map(|(label, _)| label),
    };
    ["body", body, "law"].into_iter().chain(label.map(String::as_str)).collect()
}

fn nodes<const N: usize>(block: &CellBlock, cell: u32, first: u32) -> [u32; N] {
    let mut nodes = [0; N];
    for (own, node) in nodes.iter_mut().zip(block.cell(cell as usize)) {
        *own = first + node;
    }
    nodes
}

fn unit(direction: &[f64]) -> Option<[f64; 3]> {
    let norm = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
    (norm.is_finite() && norm > ZERO_FIBRE).then(|| [0, 1, 2].map(|c| direction[c] / norm))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::built;

    fn labelled() -> CellBlock {
        let mut block = CellBlock::new(CellKind::Tet, (0..12).collect());
        block.data.insert("label".into(), DataArray::scalar(vec![2.0, 1.0, 2.0]));
        block
    }

    #[test]
    fn cells_go_to_the_law_of_their_label() {
        let map = [("1", "soft"), ("2", "hard")].map(|(label, law)| (label.to_owned(), law.to_owned()));
        let cells = cells_by_law(&LawChoice::ByLabel(map.into()), &labelled());
        assert_eq!((&cells["soft"], &cells["hard"]), (&vec![1], &vec![0, 2]));
        let cells = cells_by_law(&LawChoice::One("soft".into()), &labelled());
        assert_eq!(cells["soft"], [0, 1, 2]);
    }

    #[test]
    fn an_unknown_law_is_shown_at_its_label() {
        let map = [("7".to_owned(), "soft".to_owned())];
        assert_eq!(law_path("liver", &LawChoice::ByLabel(map.into()), "soft"), ["body", "liver", "law", "7"]);
        assert_eq!(law_path("liver", &LawChoice::One("soft".into()), "soft"), ["body", "liver", "law"]);
    }

    #[test]
    fn a_direction_has_length_one_or_is_none() {
        assert_eq!(unit(&[0.0, -3.0, 4.0]), Some([0.0, -0.6, 0.8]));
        for none in [[0.0; 3], [1e-13, 0.0, 0.0], [f64::NAN, 0.0, 1.0], [f64::INFINITY, 0.0, 0.0]] {
            assert_eq!(unit(&none), None);
        }
    }

    #[test]
    fn mass_is_density_times_volume_and_shared_among_the_nodes() {
        let model = built("").model;
        assert!((model.mass.iter().sum::<f64>() - 2.0).abs() < 1e-12);
        assert!(model.mass.iter().all(|&mass| mass > 0.0));
    }
}
