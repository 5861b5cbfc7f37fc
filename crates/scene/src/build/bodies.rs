//! Bodies: nodes, cells grouped by element and law, fibres, masses.

use std::collections::BTreeMap;

use pliant_geometry::{CellBlock, CellKind, DataArray, Mesh, boundary};
use pliant_mechanics::model::{Body, Cells, Material, Solid};
use pliant_mechanics::prony::{Prony, PronyError};

use super::{Builder, BuiltBody, suggestion};
use crate::format::{BodyTable, Element, Fibre, LawChoice};
use crate::registry::LawTable;

/// Longest element of a mesh over its shortest before a note is made of nothing; fibres shorter than this are zero.
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
        for block in mesh.volume_blocks().filter(|block| !block.is_empty()) {
            if !self.check_element(name, table, block.kind) {
                return;
            }
            for (law_name, cells) in self.cells_by_law(name, table, block) {
                self.add_solid(name, table, body, block, &law_name, cells);
            }
        }
    }

    fn check_element(&mut self, name: &str, table: &BodyTable, kind: CellKind) -> bool {
        let fits = match table.element {
            None => true,
            Some(Element::Tet4) => kind == CellKind::Tet,
            Some(Element::Hex8) => kind == CellKind::Hex,
        };
        if !fits {
            let cells = if kind == CellKind::Tet { "tets" } else { "hexes" };
            let message = format!("the mesh of `{name}` has {cells}, which this element is not for");
            let help = "tets: `tet4`; hexes: `hex8`; leave `element` out to let the mesh decide";
            self.error(&["body", name, "element"], message, "does not fit the mesh", help);
        }
        fits
    }

    /// The cells of a block that each law of the body takes, by law name.
    fn cells_by_law(
        &mut self,
        name: &str,
        table: &BodyTable,
        block: &CellBlock,
    ) -> BTreeMap<String, Vec<u32>> {
        let mut cells: BTreeMap<String, Vec<u32>> = BTreeMap::new();
        let all = 0..block.len() as u32;
        let map = match &table.law {
            LawChoice::One(law) => {
                cells.insert(law.clone(), all.collect());
                return cells;
            }
            LawChoice::ByLabel(map) => map,
        };
        let path = ["body", name, "law"];
        let Some(labels) = block.data.get("label") else {
            let help = "name one law for the whole body, or use a mesh with labels";
            self.error(&path, "the mesh has no cell labels", "laws by label", help);
            return cells;
        };
        let mut missing: BTreeMap<i64, usize> = BTreeMap::new();
        for cell in all {
            let label = labels.item(cell as usize)[0];
            match map.get(&format!("{label}")) {
                Some(law) => cells.entry(law.clone()).or_default().push(cell),
                None => *missing.entry(label as i64).or_default() += 1,
            }
        }
        if !missing.is_empty() {
            let list = missing.iter().map(|(l, n)| format!("{l} ({n} cells)")).collect::<Vec<_>>().join(", ");
            let message = format!("cells of `{name}` have labels without a law: {list}");
            self.error(&path, message, "no law for these", "add `LABEL = \"law\"` for each of them");
        }
        for label in map.keys() {
            if !labels.values.iter().any(|value| format!("{value}") == *label) {
                let message = format!("no cell of `{name}` has label `{label}`");
                self.error(&[path[0], path[1], path[2], label], message, "no such label", "remove it");
            }
        }
        cells
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
        let path = ["body", name, "law"];
        let Some((_, law)) = scene.laws.iter().find(|(known, _)| known == law_name) else {
            let known: Vec<&str> = scene.laws.iter().map(|(name, _)| name.as_str()).collect();
            let message = format!("there is no law `{law_name}`");
            self.error(&path, message, "no such law", suggestion(law_name, &known, "laws"));
            return;
        };
        let Some(prony) = self.prony(law_name, law) else { return };
        let Some(fibre) = self.fibres(name, table, law_name, law, block, &cells) else { return };
        let material = Material { law: law.law, prony, density: table.density };
        let first = self.model.bodies[body].nodes.start;
        let rest = &self.model.rest;
        let shear = law.law.small_strain().shear;
        let cells_of = match block.kind {
            CellKind::Tet => Cells::tet4(cells.iter().map(|&c| nodes(block, c, first)).collect(), rest),
            _ => Cells::hex8(
                cells.iter().map(|&c| nodes(block, c, first)).collect(),
                rest,
                table.hourglass,
                shear,
            ),
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
            let help = suggestion(field, &known, "cell data of the mesh");
            self.error(
                &path,
                format!("the mesh of `{name}` has no cell data `{field}`"),
                "no such data",
                help,
            );
            return None;
        };
        self.fibres_from(name, field, data, cells, &path)
    }

    fn fibres_from(
        &mut self,
        name: &str,
        field: &str,
        data: &DataArray,
        cells: &[u32],
        path: &[&str],
    ) -> Option<Vec<[f64; 3]>> {
        if data.components != 3 {
            let message =
                format!("cell data `{field}` has {} components, a direction has 3", data.components);
            self.error(path, message, "not directions", "name an array of vectors");
            return None;
        }
        let mut directions = Vec::with_capacity(cells.len());
        for &cell in cells {
            let Some(unit) = unit(data.item(cell as usize)) else {
                let message = format!("the fibre of cell {cell} of `{name}` is zero or not finite");
                self.error(path, message, "from this data", "every cell needs a direction");
                return None;
            };
            directions.push(unit);
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
