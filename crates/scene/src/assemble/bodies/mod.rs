//! The phase [`Meshed`]: bodies with nodes, cells grouped by element and material, masses.

mod bars;
mod fibres;
mod fractions;
mod node_vectors;
mod selections;
mod shells;
mod walls;

use std::collections::BTreeMap;

use pliant_format::diagnostic::Diagnostic;
use pliant_format::registry::LawTable;
use pliant_format::tables::{
    BodyModel, BodyTable, ByLabel, Density, Element, Hourglass, Thickness, ThicknessRule,
};
use pliant_format::{SCENE, suggestion};
use pliant_geometry::words::counted;
use pliant_geometry::{
    CellBlock, CellKind, CellLabel, Labels, Mesh, Surface, UnknownLabel, body_blocks, boundary,
};
use pliant_implicit::Assembly;
use pliant_linear::memory::room_for;
use pliant_mechanics::model::{Averaging, Cells, Material, Solid};
use pliant_mechanics::prony::{Prony, PronyError};
use pliant_sim::BodyCells;

use super::BuiltBody;
use super::context::{Context, follows};

/// A body that is being built.
pub(super) struct Draft<'a> {
    pub name: &'a str,
    /// Its table, where values by label have the labels' numbers.
    pub table: &'a BodyTable,
    /// The table as it stands in the scene.
    pub given: &'a BodyTable,
    pub mesh: &'a Mesh,
    pub boundary: &'a Surface,
}

/// The mesh of a body, and where it comes from.
pub(super) struct Shape {
    pub mesh: Mesh,
    pub origin: String,
    pub file_nodes: usize,
    pub file_numbers: Vec<u32>,
    /// The nodes of another body that it is on, numbered in the model.
    pub shared: Option<Vec<u32>>,
}

/// Some cells of a block, of one material.
struct MaterialCells {
    law: String,
    density: Density,
    /// Hourglass key as it is given.
    hourglass: Option<Hourglass>,
    cells: Vec<u32>,
}

/// Least number of bytes for an element of a model. The largest memory of `pliant check` gives 410 for tets
/// in blocks of 48,000 and 384,000. It gives 9,320 for shells in plates of 20,000 and 80,000.
const BYTES_OF_CELL: u64 = 400;
const BYTES_OF_SHELL: u64 = 9000;

/// The first phase: bodies with their meshes, cells and masses.
pub(super) struct Meshed<'s> {
    pub context: Context<'s>,
    /// The bodies of the scene, with shells in scenes that have some. Each phase adds to the assembly.
    pub assembly: Assembly,
    /// The cells of each body that an implicit solver advances.
    pub cells: Vec<BodyCells>,
    /// The meshes of the bodies.
    pub bodies: Vec<BuiltBody>,
    /// True if an earlier attempt has parted the shapes of bodies at rest.
    pub is_parted: bool,
}

follows!(Meshed, context: Context);

impl<'s> Meshed<'s> {
    /// The bodies of a scene. Those that an earlier attempt has parted come with their `shapes`.
    pub fn new(context: Context<'s>, mut shapes: Vec<BuiltBody>) -> Self {
        let mut meshed = Self {
            context,
            assembly: Assembly::default(),
            cells: Vec::new(),
            bodies: Vec::new(),
            is_parted: !shapes.is_empty(),
        };
        meshed.check_models();
        meshed.add_bodies(&mut shapes);
        meshed
    }
}

impl Meshed<'_> {
    fn add_bodies(&mut self, shapes: &mut Vec<BuiltBody>) {
        let scene = self.scene;
        for (name, table) in &scene.bodies {
            let Some(Shape { mesh, origin, file_nodes, file_numbers, shared }) =
                self.body_shape(name, table, shapes)
            else {
                continue;
            };
            let Some(numbered) = self.by_numbers(name, table, &mesh) else { continue };
            if !self.has_room(name, table.model, &mesh) {
                continue;
            }
            let boundary = boundary(&mesh);
            let draft = Draft { name, table: &numbered, given: table, mesh: &mesh, boundary: &boundary };
            self.add_body(&draft, shared);
            let name = name.clone();
            self.bodies.push(BuiltBody { name, mesh, origin, boundary, file_nodes, file_numbers });
        }
        self.check_unused_laws();
    }

    /// True if the system has room for the model of a body; an error if not.
    fn has_room(&mut self, name: &str, model: BodyModel, mesh: &Mesh) -> bool {
        let cells: usize = mesh.blocks.iter().map(|block| block.len()).sum();
        let each = if model == BodyModel::Shell { BYTES_OF_SHELL } else { BYTES_OF_CELL };
        let Err(error) = room_for(each * cells as u64) else { return true };
        let message = format!("not enough memory for the model of `{name}`: {error}");
        self.error(&["body", name, "mesh"], message, &counted(cells, "element"), "use a coarser mesh");
        false
    }

    /// The mesh of a body, and where it comes from.
    fn body_shape(&mut self, name: &str, table: &BodyTable, shapes: &mut Vec<BuiltBody>) -> Option<Shape> {
        if let Some(host) = &table.on {
            return self.wall(name, table, host);
        }
        if let Some(known) = shapes.iter().position(|body| body.name == name) {
            let BuiltBody { mesh, origin, file_nodes, file_numbers, .. } = shapes.swap_remove(known);
            return Some(Shape { mesh, origin, file_nodes, file_numbers, shared: None });
        }
        let path = ["body", name, "mesh"];
        if self.source().node(&path).is_none() {
            let message = format!("missing key `mesh` in `body.{name}`");
            let help = "add `mesh` (a file, a shape or an image), or for a wall `on` (the body whose boundary it covers)";
            self.error(&path[..2], message, "`mesh` is missing here", help);
            return None;
        }
        let mut made = self.mesh(&table.mesh, &path)?;
        let file_nodes = made.mesh.points.len();
        let file_numbers = self.repair(&mut made.mesh, &table.mesh, &path);
        if table.model == BodyModel::Bar {
            made.mesh.blocks.retain(|block| block.kind == CellKind::Line);
            made.mesh.drop_unused_points();
        } else if table.model != BodyModel::Solid {
            let label_names = std::mem::take(&mut made.mesh.label_names);
            let mesh = self.triangles(made.mesh, &path)?;
            made.mesh = Mesh { label_names, ..mesh };
        }
        if !self.check_mesh(&made.mesh, table, &path) {
            return None;
        }
        Some(Shape { mesh: made.mesh, origin: made.origin, file_nodes, file_numbers, shared: None })
    }

    fn add_body(&mut self, draft: &Draft<'_>, shared: Option<Vec<u32>>) {
        let &Draft { name, table, mesh, .. } = draft;
        let first = self.assembly.rest.len();
        let is_wall_on_solid = shared.is_some();
        let body = match shared {
            Some(nodes) => self.assembly.model_mut().add_body_on(name, nodes),
            None => self.assembly.add_body(name, mesh.points.iter().copied()),
        };
        self.assembly.model_mut().bodies[body].damping = table.damping;
        self.set_velocity(name, table, first);
        if !is_wall_on_solid {
            self.assembly.model_mut().stiffness_damping = table.stiffness_damping;
        }
        if table.layers.is_empty() {
            if table.law.values().is_empty() {
                let message = format!("missing key `law` in `body.{name}`");
                let help = "add `law = \"NAME\"` for a table `[law.NAME]`, or one law for each label";
                self.error(&["body", name], message, "`law` is missing here", help);
                return;
            }
            self.check_labels(name, ["law", "\"law\""], &table.law, mesh);
        }
        self.check_labels(name, ["density", "1000"], &table.density, mesh);
        if let Some(hourglass) = &table.hourglass {
            self.check_labels(name, ["hourglass", "0.2"], hourglass, mesh);
        }
        if table.model == BodyModel::Shell {
            if table.fraction.is_some() {
                let message = format!("`fraction` is for solids, and `{name}` is a shell");
                let help = "leave it out, or set `model = \"solid\"`";
                self.error(&["body", name, "fraction"], message, "has no effect", help);
            }
            if let Some(cells) = self.add_shell(draft, body) {
                self.cells.push(cells);
            }
            return;
        }
        let before = self.assembly.solids.len();
        let is_own = |block: &&CellBlock| match table.model {
            BodyModel::Membrane => block.kind == CellKind::Triangle,
            BodyModel::Bar => block.kind == CellKind::Line,
            _ => block.kind.dimension() == 3,
        };
        for block in mesh.blocks.iter().filter(|block| !block.is_empty()).filter(is_own) {
            if !self.check_element(name, table, block.kind) {
                return;
            }
            for part in parts(table, block) {
                self.add_solid(draft, body, block, part);
            }
        }
        if self.scene.is_implicit() {
            self.check_solids(name, before);
            self.cells.push(BodyCells::Solids);
        }
    }

    /// The velocity at the start of the model's last nodes, from a first one on.
    fn set_velocity(&mut self, name: &str, table: &BodyTable, first: usize) {
        let Some(velocity) = table.velocity else { return };
        if self.scene.run.solver.finds_equilibria() {
            let word = self.scene.run.solver.word();
            let message = format!("`{name}` has a velocity, but a {word} run has no inertia");
            let help = "leave it out, or run the scene with `solver = \"explicit\"`";
            self.error(&["body", name, "velocity"], message, "has no effect", help);
        }
        self.assembly.model_mut().initial_velocity.resize(first, [0.0; 3]);
        let nodes = self.assembly.rest.len();
        self.assembly.model_mut().initial_velocity.resize(nodes, velocity);
    }

    fn check_element(&mut self, name: &str, table: &BodyTable, kind: CellKind) -> bool {
        if kind.dimension() < 3 {
            if table.element.is_some() {
                let message = format!("`{name}` is a {}, which has one element only", table.model.word());
                let help =
                    "leave `element` out, or set `model = \"shell\"` or `\"solid\"`, whose elements differ";
                self.error(&["body", name, "element"], message, "has no effect", help);
            }
            return table.element.is_none();
        }
        let fits = table
            .element
            .is_none_or(|element| !element.is_shell() && element.is_tet() == (kind == CellKind::Tet));
        if !fits {
            let cells = if kind == CellKind::Tet { "tets" } else { "hexes" };
            let message = format!("the mesh of `{name}` has {cells}, which this element does not support");
            let help = "tets: `tet4`, `tet4-anp`, `tet4-ianp`; hexes: `hex8`, `hex8-full`; leave `element` out to let the mesh decide";
            self.error(&["body", name, "element"], message, "does not fit the mesh", help);
        }
        fits
    }

    /// The table of a body with the numbers of labels in place of their names in its mesh; diagnostics where
    /// there is no such name.
    fn by_numbers(&mut self, name: &str, table: &BodyTable, mesh: &Mesh) -> Option<BodyTable> {
        let labels = Labels::of(mesh);
        let mut numbered = table.clone();
        let mut known = self.numbered(&labels, &["body", name, "law"], &mut numbered.law);
        known &= self.numbered(&labels, &["body", name, "density"], &mut numbered.density);
        if let Some(hourglass) = &mut numbered.hourglass {
            known &= self.numbered(&labels, &["body", name, "hourglass"], hourglass);
        }
        if let Some(Thickness::PerCell(ThicknessRule::ByLabel(map))) = &mut numbered.thickness {
            known &= self.number_keys(&labels, &["body", name, "thickness", "by-label"], map);
        }
        known.then_some(numbered)
    }

    fn numbered<T>(&mut self, labels: &Labels, path: &[&str], values: &mut ByLabel<T>) -> bool {
        match values {
            ByLabel::One(_) => true,
            ByLabel::Each(map) => self.number_keys(labels, path, map),
        }
    }

    /// Replaces names of labels by their numbers; returns true if all names are known. Numbers keep their
    /// spelling.
    fn number_keys<T>(&mut self, labels: &Labels, path: &[&str], map: &mut BTreeMap<String, T>) -> bool {
        let mut known = true;
        let mut numbered = BTreeMap::new();
        for (key, value) in std::mem::take(map) {
            let is_number = key.parse::<f64>().is_ok();
            let found = if is_number { Ok(key.clone()) } else { number_of(labels, &key) };
            match found {
                Ok(number) if numbered.contains_key(&number) => {
                    let message = format!("`{key}` is label {number}, which has a value already");
                    self.error(
                        &[path, &[key.as_str()]].concat(),
                        message,
                        "given twice",
                        "leave one of them out",
                    );
                    known = false;
                }
                Ok(number) => {
                    numbered.insert(number, value);
                }
                Err(error) => {
                    let help =
                        "labels go by number, or by the name that the image or the mesh file gives them";
                    self.error(&[path, &[key.as_str()]].concat(), error.to_string(), "no such label", help);
                    known = false;
                }
            }
        }
        *map = numbered;
        known
    }

    /// Checks values by label (law, density, …): each cell's label needs a value, and each label with a value
    /// needs a cell. The key comes with an example of a value.
    fn check_labels<T>(&mut self, name: &str, [key, example]: [&str; 2], values: &ByLabel<T>, mesh: &Mesh) {
        let ByLabel::Each(map) = values else { return };
        let path = ["body", name, key];
        let mut counts: BTreeMap<String, usize> = BTreeMap::new();
        for block in body_blocks(mesh) {
            let Some(labels) = block.data.get("label") else {
                let message = format!("the {} cells of `{name}` have no labels", block.kind.name());
                let help = format!(
                    "give one {key} for the whole body, or use a mesh whose cell data `label` numbers its regions"
                );
                self.error(&path, message, "given by label", help);
                return;
            };
            for label in &labels.values {
                *counts.entry(label.to_string()).or_default() += 1;
            }
        }
        let list = |items: &mut dyn Iterator<Item = String>| items.collect::<Vec<_>>().join(", ");
        let missing = counts.iter().filter(|(label, _)| !map.contains_key(*label));
        let named = |label: &str| label.parse().ok().and_then(|label: i32| mesh.label_names.get(&label));
        let missing = list(&mut missing.map(|(label, n)| match named(label) {
            Some(name) => format!("{label} ({name}, {})", counted(*n, "cell")),
            None => format!("{label} ({})", counted(*n, "cell")),
        }));
        if !missing.is_empty() {
            let message = format!("cells of `{name}` have labels without {key}: {missing}");
            let help = format!("add `LABEL = {example}` for each label");
            self.error(&path, message, "labels are missing", help);
        }
        let known = Labels::of(mesh).all_shown().join(", ");
        for label in map.keys().filter(|label| !counts.contains_key(*label)) {
            let message = format!("no cell of `{name}` has label `{label}`");
            let help = format!("remove it; labels of the mesh: {known}");
            self.error(&[path[0], path[1], path[2], label], message, "no such label", help);
        }
    }

    fn add_solid(&mut self, draft: &Draft<'_>, body: usize, block: &CellBlock, part: MaterialCells) {
        let MaterialCells { law: law_name, density, hourglass, cells } = part;
        let (scene, &Draft { name, table, given, .. }) = (self.scene, draft);
        let Some((_, law)) = scene.laws.iter().find(|(known, _)| *known == law_name) else {
            let known: Vec<&str> = scene.laws.iter().map(|(name, _)| name.as_str()).collect();
            let message = format!("there is no law `{law_name}`");
            let help = suggestion(&law_name, &known, SCENE, "laws");
            self.error(&law_path(name, &given.law, &law_name), message, "no such law", help);
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
        let Some(prony) = self.prony(&law_name, law) else { return };
        let at = law_path(name, &given.law, &law_name);
        if !self.check_law_of_model(draft, &law_name, law, &prony, &at) {
            return;
        }
        self.doubt_widening(&law_name, law);
        let Some(fibre) = self.fibres(draft, &law_name, law, block, &cells) else { return };
        let Some(fractions) = self.fractions(draft, block, &cells) else { return };
        let material = Material { law: law.law, prony, density: density.0 };
        let cells_of = match block.kind {
            CellKind::Triangle => self.membrane(draft, body, block, &cells, &fibre),
            CellKind::Line => self.bars(draft, body, block, &cells),
            _ => {
                // Averaged pressures do not relax in implicit steps.
                let averages = law.law.has_volumetric_energy() && material.prony.volumetric.is_empty();
                let fills_in_part = block.kind == CellKind::Hex && table.is_filled_in_part();
                let full = fills_in_part && averages && table.hourglass.is_none();
                let element = table.element.or(full.then_some(Element::Hex8Full));
                let shear = law.law.small_strain().shear;
                Some(self.volume_cells(element, body, block, &cells, (hourglass, shear)))
            }
        };
        let Some(cells_of) = cells_of else { return };
        let cells_of = cells_of.filled(&fractions);
        self.assembly.model_mut().add_solid(Solid {
            body,
            material,
            cells: cells_of,
            fibre,
            original: cells,
        });
    }

    /// Flags a law with a negative Poisson's ratio, once.
    fn doubt_widening(&mut self, law_name: &str, law: &LawTable) {
        let poisson = law.law.small_strain().poisson();
        if poisson >= 0.0 {
            return;
        }
        let message = format!(
            "law `{law_name}` has a Poisson's ratio of {poisson:.2}: it gets wider when it is pulled, unlike soft tissue"
        );
        if self.out.iter().all(|known| known.message != message) {
            let help = "take a `bulk-modulus` above two thirds of the `shear-modulus`, or a `poisson-ratio` from 0 to 0.5";
            let place = self.source().span(&["law", law_name]);
            self.out.push(Diagnostic::warning(message).at(place, "below 0").help(help));
        }
    }

    /// Some cells of a block with their element; hourglass control has a coefficient, if that is given, and a
    /// shear modulus [Pa].
    fn volume_cells(
        &self,
        element: Option<Element>,
        body: usize,
        block: &CellBlock,
        cells: &[u32],
        (hourglass, shear): (Option<Hourglass>, f64),
    ) -> Cells {
        let model_body = &self.assembly.bodies[body];
        let rest = &self.assembly.rest;
        let tets = || cells.iter().map(|&c| nodes(block, c, |node| model_body.node(node))).collect();
        let hexes = || cells.iter().map(|&c| nodes(block, c, |node| model_body.node(node))).collect();
        match (block.kind, element) {
            (CellKind::Tet, Some(Element::Tet4Anp)) => Cells::averaged_tet4(tets(), rest, Averaging::Nodal),
            (CellKind::Tet, Some(Element::Tet4Ianp)) => {
                Cells::averaged_tet4(tets(), rest, Averaging::Variational)
            }
            (CellKind::Tet, Some(Element::Tet4IanpNiftysim)) => {
                Cells::averaged_tet4(tets(), rest, Averaging::NiftySim)
            }
            (CellKind::Tet, _) => Cells::tet4(tets(), rest),
            (_, Some(Element::Hex8Full)) => Cells::full_hex8(hexes(), rest),
            _ => match hourglass {
                Some(Hourglass(given)) => Cells::hex8(hexes(), rest, given, shear),
                None => Cells::hex8(hexes(), rest, Hourglass::DEFAULT.0, shear).with_growing_hourglass(),
            },
        }
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

    fn check_unused_laws(&mut self) {
        let scene = self.scene;
        for (name, law) in &scene.laws {
            let families = law.law.families();
            let unused = match families {
                0 if law.extras.fibre.is_some() => Some("has no fibres: its `fibre` has no effect"),
                0 | 1 if law.extras.second_fibre.is_some() => {
                    Some("has fewer than two families of fibres: its `second-fibre` has no effect")
                }
                _ => None,
            };
            self.notes.extend(unused.map(|what| format!("law `{name}` {what}")));
            let used = scene.bodies.iter().any(|(_, body)| {
                body.law.values().contains(&name)
                    || body.layers.iter().any(|layer| layer.law.as_ref() == Some(name))
            });
            if !used {
                self.notes.push(format!("law `{name}` is used by no body"));
            }
        }
    }
}

/// The number of a label by its name, as the keys of values have it.
fn number_of(labels: &Labels, name: &str) -> Result<String, UnknownLabel> {
    labels.find(&CellLabel::Name(name.to_owned())).map(|number| number.to_string())
}

/// The cells of a block by material, laws in the order of their names.
fn parts(table: &BodyTable, block: &CellBlock) -> Vec<MaterialCells> {
    let labels = block.data.get("label");
    let has_hourglass = block.kind == CellKind::Hex && table.element != Some(Element::Hex8Full);
    let mut parts: BTreeMap<(&str, u64, Option<u64>), MaterialCells> = BTreeMap::new();
    for cell in 0..block.len() as u32 {
        let label = labels.map(|labels| labels.item(cell as usize)[0].to_string());
        let label = label.as_deref();
        // A label without a value is already reported.
        let (Some(law), Some(&density)) = (table.law.of(label), table.density.of(label)) else { continue };
        let given = table.hourglass.as_ref().filter(|_| has_hourglass);
        let hourglass = given.and_then(|given| given.of(label)).copied();
        parts
            .entry((law, density.0.to_bits(), hourglass.map(|hourglass| hourglass.0.to_bits())))
            .or_insert_with(|| MaterialCells { law: law.clone(), density, hourglass, cells: Vec::new() })
            .cells
            .push(cell);
    }
    parts.into_values().collect()
}

/// Place in the scene where a body names a law: its `law`, or a label in it.
pub(super) fn law_path<'a>(body: &'a str, choice: &'a ByLabel<String>, law: &str) -> Vec<&'a str> {
    let label = match choice {
        ByLabel::One(_) => None,
        ByLabel::Each(map) => map.iter().find(|(_, known)| *known == law).map(|(label, _)| label),
    };
    ["body", body, "law"].into_iter().chain(label.map(String::as_str)).collect()
}

/// The nodes of a cell, by the number of each in the model.
pub(super) fn nodes<const N: usize>(block: &CellBlock, cell: u32, number: impl Fn(u32) -> u32) -> [u32; N] {
    let mut nodes = [0; N];
    for (numbered, &node) in nodes.iter_mut().zip(block.cell(cell as usize)) {
        *numbered = number(node);
    }
    nodes
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use pliant_geometry::DataArray;

    use super::*;
    use crate::build;
    use crate::testing::{CUBE, built, labelled, read};
    use pliant_mechanics::Model;

    #[test]
    fn cells_go_to_the_material_of_their_label() {
        let mut block = CellBlock::new(CellKind::Hex, (0..24).collect());
        block.data.insert("label".into(), DataArray::scalar(vec![2.0, 1.0, 2.0]));
        let of = |more: &str, kind: CellKind| {
            let block =
                CellBlock { kind, nodes: (0..3 * kind.node_count() as u32).collect(), ..block.clone() };
            let text = CUBE.replace("law = \"tissue\"\ndensity = 1000", more);
            parts(&read(&text).bodies[0].1, &block)
                .into_iter()
                .map(|part| {
                    (part.law, part.density.0, part.hourglass.map(|hourglass| hourglass.0), part.cells)
                })
                .collect::<Vec<_>>()
        };
        let message = |law: &str, density, hourglass, cells: &[u32]| {
            (law.to_owned(), density, hourglass, cells.to_vec())
        };
        let hex = CellKind::Hex;
        assert_eq!(of("law = 'soft'\ndensity = 9", hex), [message("soft", 9.0, None, &[0, 1, 2])]);
        assert_eq!(
            of("law = { 1 = 'soft', 2 = 'hard' }\ndensity = { 1 = 8, 2 = 9 }", hex),
            [message("hard", 9.0, None, &[0, 2]), message("soft", 8.0, None, &[1])]
        );
        let by_hourglass = "law = 'soft'\ndensity = 9\nhourglass = { 1 = 0.1, 2 = 0.3 }";
        assert_eq!(
            of(by_hourglass, hex),
            [message("soft", 9.0, Some(0.1), &[1]), message("soft", 9.0, Some(0.3), &[0, 2])]
        );
        // Tets have no hourglass patterns: they stay together.
        assert_eq!(of(by_hourglass, CellKind::Tet), [message("soft", 9.0, None, &[0, 1, 2])]);
    }

    #[test]
    fn a_law_that_gets_wider_when_it_is_pulled_is_flagged_once() {
        let warned = |moduli: &str| {
            let two = "[body.other]\nmesh = { block = { size = [1, 1, 1], cells = [1, 1, 1] } }\nlaw = 'tissue'\ndensity = 1\n";
            let text = CUBE.replace("young-modulus = 10e3\npoisson-ratio = 0.3", moduli);
            let built =
                build(&read(&format!("{text}{two}"))).unwrap_or_else(|errors| panic!("{}", errors.plain()));
            built.warnings.iter().map(|warning| warning.message.clone()).collect::<Vec<_>>()
        };
        let warnings = warned("shear-modulus = 3e3\nbulk-modulus = 1e3");
        assert!(warnings.len() == 1 && warnings[0].contains("a Poisson's ratio of -0.25"), "{warnings:?}");
        assert_eq!(warned("shear-modulus = 3e3\nbulk-modulus = 2e3"), [""; 0]);
    }

    #[test]
    fn an_unknown_law_is_shown_at_its_label() {
        let map = [("7".to_owned(), "soft".to_owned())];
        assert_eq!(law_path("liver", &ByLabel::Each(map.into()), "soft"), ["body", "liver", "law", "7"]);
        assert_eq!(law_path("liver", &ByLabel::One("soft".into()), "soft"), ["body", "liver", "law"]);
    }

    #[test]
    fn values_go_by_the_names_of_labels_as_by_their_numbers() {
        let folder = tempfile::tempdir().unwrap();
        let model = |more: &str| {
            let scene = labelled(folder.path(), more);
            build(&scene).map(|built| built.model).map_err(|errors| errors.plain().to_string())
        };
        let shown = |model: Arc<Model>| {
            let part = |solid: &Solid| (format!("{:?}", solid.material), solid.cells.len());
            (model.solids.iter().map(part).collect::<Vec<_>>(), model.mass.clone())
        };
        let rest = "\nhourglass = { 1 = 0.1, 2 = 0.3, 5 = 0.2 }";
        let numbers =
            "law = { 1 = 'tissue', 2 = 'hard', 5 = 'hard' }\ndensity = { 1 = 900, 2 = 1000, 5 = 1000 }";
        let names = "law = { Liver = 'tissue', tumour = 'hard', 5 = 'hard' }\ndensity = { liver = 900, 2 = 1000, 5 = 1000 }";
        let [numbers, by_names] =
            [numbers, names].map(|more| shown(model(&format!("{more}{rest}")).unwrap()));
        assert_eq!(numbers, by_names);
        assert_eq!(numbers.0.len(), 3);
        for (law, pieces) in [
            (
                "{ livr = 'tissue', 2 = 'hard', 5 = 'hard' }",
                &["no label is named `livr`; did you mean `liver`?", "the mesh has 1 (liver), 2 (tumour), 5"]
                    [..],
            ),
            (
                "{ liver = 'tissue', 1 = 'hard', 2 = 'hard', 5 = 'hard' }",
                &["`liver` is label 1, which has a value"],
            ),
            ("{ liver = 'tissue', 5 = 'hard' }", &["have labels without law: 2 (tumour, 1 cell)"]),
            ("{ liver = 'tissue', 2 = 'stiff', 5 = 'hard' }", &["there is no law `stiff`"]),
            ("{ 1 = 'tissue', 2 = 'hard', 4 = 'hard', 5 = 'hard' }", &["no cell of `bar` has label `4`"]),
        ] {
            let message = model(&format!("law = {law}\ndensity = 1000")).unwrap_err();
            assert!(pieces.iter().all(|piece| message.contains(piece)), "{law}: {message}");
        }
    }

    #[test]
    fn mass_is_density_times_volume_and_shared_among_the_nodes() {
        let model = built("").model;
        assert!((model.mass.iter().sum::<f64>() - 2.0).abs() < 1e-12);
        assert!(model.mass.iter().all(|&mass| mass > 0.0));
    }
}
