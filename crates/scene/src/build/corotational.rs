//! Shells and co-rotational solids: their cells, constraints and loads, in a model of their own that shares the nodes.

use std::collections::BTreeMap;
use std::ops::Range;

use pliant_corotational as corotational;
use pliant_corotational::element::{Bending, Elasticity, Formulation, Membrane};
use pliant_corotational::{
    Carried, CurvedSurface, Material, ModelError, Motion, Shell, Spread, Spring, State,
};
use pliant_geometry::{CellBlock, CellKind, DataArray, Mesh, Vector3};
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::{fingerprint, model};

use super::bodies::{Draft, nodes};
use super::meshes::surface_of;
use super::{Builder, SCENE, Target, suggestion};
use crate::diagnostic::{Diagnostic, counted};
use crate::format::{
    Axis, BodyModel, BodyTable, ControlTable, Element, MomentTable, MoveTable, PressureTable, SolverName,
    SpreadName, SpringTable, Thickness, ThicknessRule, Vectors,
};
use crate::registry::{ConstraintTable, LoadTable};

/// Shells and co-rotational solids of a scene. Nodes are those of the scene's model.
#[derive(Clone, Debug)]
pub struct Corotational {
    /// Their model.
    pub model: corotational::Model,
    /// The cells of each body, in the order of the scene's bodies.
    pub cells: Vec<BodyCells>,
    /// What a static run prescribes instead of the size of a load.
    pub control: Option<Control>,
    /// The state that a run starts from.
    pub start: State,
    /// The curved surface of the shells, if something is carried by it.
    pub surface: Option<CurvedSurface>,
    /// The points of each of the scene's surfaces that a shell carries.
    pub carried: BTreeMap<usize, Vec<Carried>>,
}

/// The cells of a body, in the order of its mesh.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BodyCells {
    /// Facets of the model.
    Facets(Range<u32>),
    /// Tetrahedra of the model.
    Tets(Range<u32>),
}

/// A control of a whole static run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Control {
    /// A component (0 to 2) of a node moves by a distance [m] in all.
    Displacement {
        /// The node.
        node: u32,
        /// x, y or z as 0, 1, 2.
        component: usize,
        /// The distance [m].
        by: f64,
    },
    /// All translations together move by a length [m] in each load step.
    ArcLength(f64),
    /// The pressurised facets enclose a volume [m³] in the end, and another at the start.
    Volume {
        /// At the start [m³].
        from: f64,
        /// At the end [m³].
        to: f64,
    },
}

/// Stiffness against drilling of `dkt-cst` and `membrane`, as a part of G t A/3 a node.
const DRILLING: f64 = 0.01;

impl Builder<'_> {
    /// Refuses scenes of both kinds of bodies, and solvers that are not for them.
    pub(super) fn check_models(&mut self) {
        let scene = self.scene;
        let other = |body: &&(String, BodyTable)| body.1.model != BodyModel::Solid;
        let Some((first, table)) = scene.bodies.iter().find(other) else {
            if matches!(scene.run.solver, SolverName::Implicit | SolverName::Static) {
                let message =
                    format!("the solver `{}` is not for bodies of model `solid`", scene.run.solver.word());
                let help = "take `solver = \"explicit\"` or `\"quasi-static\"`, or `model = \"corotational\"` for the bodies";
                self.error(&["run", "solver"], message, "not for these bodies", help);
            }
            self.check_keys_of_shells(false);
            return;
        };
        if let Some((solid, _)) = scene.bodies.iter().find(|(_, body)| body.model == BodyModel::Solid) {
            let message = format!(
                "`{solid}` is of model `solid` and `{first}` of model `{}`: they have no solver in common",
                table.model.word()
            );
            let help = "give all bodies `model = \"shell\"` or `\"corotational\"`, or run them in scenes of their own";
            self.error(&["body", first, "model"], message, "not beside a `solid`", help);
        }
        if scene.run.solver == SolverName::QuasiStatic {
            let message =
                format!("the solver `quasi-static` is not for bodies of model `{}`", table.model.word());
            let help = "take `solver = \"static\"`";
            self.error(&["run", "solver"], message, "not for these bodies", help);
        }
        if scene.run.precision == Some(crate::format::Precision::Single) {
            let message =
                format!("bodies of model `{}` are computed in double precision only", table.model.word());
            self.error(&["run", "precision"], message, "not for these bodies", "leave `precision` out");
        }
        if scene.run.checkpoint.is_some()
            && scene.run.control.as_ref().is_some_and(|c| c.arc_length.is_some())
        {
            let message = "there are no checkpoints of a run by arc length, which goes on in the direction of its last step";
            let help = "leave it out, or control a displacement";
            self.error(&["run", "checkpoint"], message, "not with `arc-length`", help);
        }
        if scene.run.mass_scaling.is_some() {
            let message = format!("mass is not scaled for bodies of model `{}`", table.model.word());
            let help = "leave it out, or take `solver = \"implicit\"`, which has no stable step";
            self.error(&["run", "mass-scaling"], message, "not for these bodies", help);
        }
        self.check_keys_of_shells(true);
        for key in ["damping", "stiffness-damping"] {
            let value =
                |body: &BodyTable| if key == "damping" { body.damping } else { body.stiffness_damping };
            if let Some((name, _)) = scene.bodies.iter().find(|(_, body)| value(body) != value(table)) {
                let message = format!("`{name}` and `{first}` have different `{key}`");
                let help = "shells and co-rotational solids of a scene all have the same";
                self.error(&["body", name, key], message, "another", help);
            }
        }
        if table.stiffness_damping > 0.0 && scene.run.solver == SolverName::Explicit {
            let message = "damping by stiffness needs the solver `implicit`";
            let path = ["body", first.as_str(), "stiffness-damping"];
            self.error(&path, message, "not explicit", "take `damping`, or `solver = \"implicit\"`");
        }
    }

    /// Refuses keys that say nothing for the models and the solver there are.
    fn check_keys_of_shells(&mut self, present: bool) {
        let run = &self.scene.run;
        let newton = present && matches!(run.solver, SolverName::Implicit | SolverName::Static);
        for (key, wanted, of) in [
            ("iterations", newton, "`solver = \"implicit\"` and `\"static\"`"),
            ("linear", newton, "`solver = \"implicit\"` and `\"static\"`"),
            ("control", newton && run.solver == SolverName::Static, "`solver = \"static\"`"),
        ] {
            if self.source().node(&["run", key]).is_some() && !wanted {
                let message = format!("`{key}` is for {of} of shells and co-rotational solids");
                self.error(&["run", key], message, "means nothing here", "remove it");
            }
        }
        for (name, body) in &self.scene.bodies {
            let shell = body.model == BodyModel::Shell;
            let others = [
                ("thickness", shell, "a shell"),
                ("crease", shell, "a shell"),
                ("branches", shell, "a shell"),
                ("stiffness-damping", body.model != BodyModel::Solid, "shells and co-rotational solids"),
                ("hourglass", body.model == BodyModel::Solid, "`model = \"solid\"`"),
                ("fibre", body.model == BodyModel::Solid, "`model = \"solid\"`"),
                ("second-fibre", body.model == BodyModel::Solid, "`model = \"solid\"`"),
            ];
            for (key, wanted, of) in others {
                if !wanted && self.source().node(&["body", name, key]).is_some() {
                    let message =
                        format!("`{key}` is for {of}, and `{name}` is of model `{}`", body.model.word());
                    let help = "remove it, or change `model`";
                    self.error(&["body", name, key], message, "means nothing here", help);
                }
            }
        }
    }

    /// The mesh of a shell as triangles only: quads cut in two, volume cells left for their boundary.
    pub(super) fn triangles(&mut self, mesh: Mesh, path: &[&str]) -> Option<Mesh> {
        let surface = surface_of(mesh);
        if surface.blocks.is_empty() {
            let help = "a shell needs triangles or quads";
            self.error(path, format!("`{}` has no triangles", path[1]), "this mesh", help);
            return None;
        }
        let mut whole = CellBlock::new(CellKind::Triangle, Vec::new());
        let names: Vec<String> = surface.blocks.iter().flat_map(|block| block.data.keys().cloned()).collect();
        let mut cut = 0;
        let mut parents: Vec<(usize, usize)> = Vec::new();
        for (at, block) in surface.blocks.iter().enumerate() {
            for (cell, corners) in block.cells().enumerate() {
                whole.nodes.extend_from_slice(&corners[..3]);
                parents.push((at, cell));
                if block.kind == CellKind::Quad {
                    whole.nodes.extend([corners[0], corners[2], corners[3]]);
                    parents.push((at, cell));
                    cut += 1;
                }
            }
        }
        for name in names {
            let arrays: Option<Vec<&DataArray>> =
                surface.blocks.iter().map(|block| block.data.get(&name)).collect();
            let Some(arrays) = arrays else { continue };
            let components = arrays[0].components;
            if arrays.iter().any(|array| array.components != components) {
                continue;
            }
            let values =
                parents.iter().flat_map(|&(block, cell)| arrays[block].item(cell)).copied().collect();
            whole.data.insert(name, DataArray { components, values });
        }
        if cut > 0 {
            self.notes.push(format!("`{}`: {} cut into triangles", path[1], counted(cut, "quad")));
            whole.sets.clear();
        } else if let [only] = &surface.blocks[..] {
            whole.sets = only.sets.clone();
        }
        Some(Mesh { blocks: vec![whole], ..surface })
    }

    /// Adds the cells of a shell or a co-rotational solid whose nodes are the last of the model.
    pub(super) fn add_corotational(&mut self, draft: &Draft<'_>, first: u32) {
        let rest = &self.model.rest;
        let model = &mut self.corotational.get_or_insert_with(Corotational::new).model;
        model.rest.extend(rest[model.rest.len()..].iter().map(|&p| Vector3::from(p)));
        model.mass.resize(rest.len(), 0.0);
        model.inertia.resize(rest.len(), 0.0);
        (model.mass_damping, model.stiffness_damping) = (draft.table.damping, draft.table.stiffness_damping);
        let added = match draft.table.model {
            BodyModel::Shell => self.add_shell(draft, first),
            _ => self.add_corotational_solid(draft, first),
        };
        let (Some(cells), Some(part)) = (added, &mut self.corotational) else { return };
        part.cells.push(cells);
        // What the scene's own model says of masses.
        self.model.mass.copy_from_slice(&part.model.mass);
    }

    fn add_shell(&mut self, draft: &Draft<'_>, first: u32) -> Option<BodyCells> {
        let &Draft { name, table, mesh, .. } = draft;
        let block = mesh.block(CellKind::Triangle)?;
        let formulation = self.formulation(name, table)?;
        let material = self.materials(draft, block)?;
        let thickness = self.thickness(name, table, block)?;
        let cells: Vec<[u32; 3]> = (0..block.len() as u32).map(|cell| nodes(block, cell, first)).collect();
        let count = cells.len();
        let shell = Shell {
            name: name.into(),
            cells,
            thickness,
            material,
            formulation,
            crease: table.crease.unwrap_or(45.0).to_radians(),
            branches: table.branches,
        };
        let part = self.corotational.as_mut()?;
        let start = part.model.facets.len() as u32;
        match part.model.add_shell(&shell) {
            Ok(notes) => {
                self.tell_notes(name, notes, count);
                if formulation.bending == Bending::None && formulation.membrane != Membrane::None {
                    let held = corotational::Constraint {
                        name: format!("membrane {name}"),
                        nodes: (first..self.model.rest.len() as u32).collect(),
                        components: [false, false, false, true, true, true],
                        motion: Motion::Fixed,
                    };
                    self.corotational.as_mut()?.model.constraints.push(held);
                }
                Some(BodyCells::Facets(start..start + count as u32))
            }
            Err(error) => {
                self.refuse_part(name, &error);
                None
            }
        }
    }

    fn formulation(&mut self, name: &str, table: &BodyTable) -> Option<Formulation> {
        let cst = Membrane::Cst { drilling: DRILLING };
        let (membrane, bending) = match table.element {
            None | Some(Element::DktOpt) => (Membrane::default(), Bending::Dkt),
            Some(Element::DktCst) => (cst, Bending::Dkt),
            Some(Element::Membrane) => (cst, Bending::None),
            Some(Element::Plate) => (Membrane::None, Bending::Dkt),
            Some(Element::Comas2010) => (cst, Bending::Comas2010),
            Some(_) => {
                let help = "elements of shells: `dkt-opt`, `dkt-cst`, `membrane`, `plate`, `comas-2010`";
                let message = format!("`{name}` is a shell, and this element is of a solid");
                self.error(&["body", name, "element"], message, "not of a shell", help);
                return None;
            }
        };
        Some(Formulation { membrane, bending })
    }

    /// The material of each cell of a block, or one for all.
    fn materials(&mut self, draft: &Draft<'_>, block: &CellBlock) -> Option<Vec<Material>> {
        let &Draft { name, table, .. } = draft;
        let labels = block.data.get("label");
        let mut known: BTreeMap<Option<String>, Material> = BTreeMap::new();
        let mut all = Vec::with_capacity(block.len());
        for cell in 0..block.len() {
            let label = labels.map(|labels| labels.item(cell)[0].to_string());
            let material = match known.get(&label) {
                Some(&material) => material,
                None => {
                    // A label without a value has been told.
                    let law = table.law.of(label.as_deref())?;
                    let density = table.density.of(label.as_deref())?.0;
                    let material = Material { elastic: self.elasticity(name, table, law)?, density };
                    *known.entry(label).or_insert(material)
                }
            };
            all.push(material);
        }
        if known.len() == 1 {
            all.truncate(1);
        }
        Some(all)
    }

    /// Young's modulus and Poisson's ratio of a law at small strain.
    fn elasticity(&mut self, name: &str, table: &BodyTable, law_name: &str) -> Option<Elasticity> {
        let scene = self.scene;
        let path = super::bodies::law_path(name, &table.law, law_name);
        let Some((_, law)) = scene.laws.iter().find(|(known, _)| known == law_name) else {
            let known: Vec<&str> = scene.laws.iter().map(|(name, _)| name.as_str()).collect();
            let help = suggestion(law_name, &known, SCENE, "laws");
            self.error(&path, format!("there is no law `{law_name}`"), "no such law", help);
            return None;
        };
        let what = match (law.law.is_isotropic(), law.extras.prony.is_empty()) {
            (false, _) => "is not the same in all directions",
            (_, false) => "relaxes",
            _ => {
                let moduli = law.law.small_strain();
                let (k, g) = (moduli.bulk, moduli.shear);
                if law.law.name() != "st-venant-kirchhoff" {
                    let note = format!(
                        "`{name}` takes Young's modulus and Poisson's ratio of law `{law_name}` at small strain"
                    );
                    if !self.notes.contains(&note) {
                        self.notes.push(note);
                    }
                }
                let poisson = (3.0 * k - 2.0 * g) / (2.0 * (3.0 * k + g));
                return Some(Elasticity { young: 9.0 * k * g / (3.0 * k + g), poisson });
            }
        };
        let message = format!("law `{law_name}` {what}, and `{name}` is of model `{}`", table.model.word());
        let help = "take an isotropic law without `prony`, such as `neo-hookean`, or `model = \"solid\"`";
        self.error(&path, message, "not for this model", help);
        None
    }

    fn thickness(&mut self, name: &str, table: &BodyTable, block: &CellBlock) -> Option<Vec<f64>> {
        let path = ["body", name, "thickness"];
        match &table.thickness {
            None => {
                let help = "add `thickness = 0.002` in metres";
                let message = format!("`{name}` is a shell and needs a `thickness`");
                self.error(&path[..2], message, "`thickness` is missing", help);
                None
            }
            Some(Thickness::Uniform(value)) => Some(vec![*value]),
            Some(Thickness::PerCell(ThicknessRule::CellData(array))) => match block.data.get(array) {
                Some(data) if data.components == 1 => Some(data.values.clone()),
                found => {
                    let (message, help) = match found {
                        Some(data) => (
                            format!("cell data `{array}` has {}", counted(data.components, "component")),
                            "a thickness is one number for each triangle [m]".to_owned(),
                        ),
                        None => {
                            let known: Vec<&str> = block.data.keys().map(String::as_str).collect();
                            let help = suggestion(array, &known, "the mesh", "cell data");
                            (format!("the mesh of `{name}` has no cell data `{array}`"), help)
                        }
                    };
                    self.error(&path, message, "this array", help);
                    None
                }
            },
            Some(Thickness::PerCell(ThicknessRule::ByLabel(map))) => {
                let labels = block.data.get("label");
                let value = |cell: usize| {
                    let label = labels.map(|labels| labels.item(cell)[0].to_string());
                    label.as_ref().and_then(|label| map.get(label)).copied().ok_or(label)
                };
                match (0..block.len()).map(value).collect::<Result<Vec<f64>, _>>() {
                    Ok(values) => Some(values),
                    Err(label) => {
                        let message = match label {
                            Some(label) => {
                                format!("triangles of `{name}` with label {label} have no thickness")
                            }
                            None => format!("the triangles of `{name}` have no labels"),
                        };
                        self.error(&path, message, "by label", "give one thickness, or one for every label");
                        None
                    }
                }
            }
        }
    }

    fn tell_notes(&mut self, name: &str, notes: corotational::Notes, count: usize) {
        if notes.turned > 0 {
            self.notes.push(format!(
                "`{name}`: {} turned over, so that all face one side",
                counted(notes.turned, "triangle")
            ));
        }
        if notes.thick > 0 {
            let message = format!(
                "{} of {count} of `{name}` are thicker than their smallest altitude: no longer thin",
                counted(notes.thick, "triangle")
            );
            let place = self.source().span(&["body", name, "thickness"]);
            let help = "take larger triangles, a smaller thickness, or model the wall with tets";
            self.out.push(Diagnostic::warning(message).at(place, "thick").help(help));
        }
        if notes.comas > 0 {
            let message = format!(
                "`{name}` has the element of Comas (2010), which depends on the numbering of its corners and converges to \
                 plates 6 to 26 % too soft"
            );
            let place = self.source().span(&["body", name, "element"]);
            let help = "it is there for comparison; take `dkt-opt`";
            self.out.push(Diagnostic::warning(message).at(place, "converges to a wrong plate").help(help));
        }
    }

    /// Tells why a part was refused, at the key that is about it.
    fn refuse_part(&mut self, name: &str, error: &ModelError) {
        let (key, help) = match error {
            ModelError::OutOfRange { what, .. } if what.starts_with("thickness") => {
                ("thickness", "give every triangle a thickness above 0, in metres")
            }
            ModelError::OutOfRange { what, .. } if what.starts_with("density") => ("density", ""),
            ModelError::OutOfRange { .. } => ("law", "give the law other constants"),
            ModelError::Branch { .. } => {
                ("mesh", "set `branches = true` if walls are meant to meet there, or repair the mesh")
            }
            _ => ("mesh", "`pliant info` reads a mesh file on its own; `fix = \"merge\"` joins nodes"),
        };
        self.error(&["body", name, key], error.to_string(), "here", help);
    }

    fn add_corotational_solid(&mut self, draft: &Draft<'_>, first: u32) -> Option<BodyCells> {
        let &Draft { name, table, mesh, .. } = draft;
        if let Some(other) = table.element.filter(|&element| element != Element::Tet4) {
            let what = if other.is_shell() { "a shell" } else { "`model = \"solid\"`" };
            let message = format!("`{name}` is a co-rotational solid, and this element is of {what}");
            self.error(
                &["body", name, "element"],
                message,
                "not for this model",
                "take `tet4`, or leave it out",
            );
            return None;
        }
        if mesh.volume_blocks().any(|block| block.kind != CellKind::Tet && !block.is_empty()) {
            let message =
                format!("`{name}` is a co-rotational solid, which is made of tets, and its mesh has hexes");
            self.error(&["body", name, "mesh"], message, "this mesh", "use a mesh of tets: `as = \"tets\"`");
            return None;
        }
        let block = mesh.block(CellKind::Tet)?;
        let material = self.materials(draft, block)?;
        let start = self.corotational.as_ref()?.model.tets.len() as u32;
        // Cells of one material after the other would change their order: so they go one by one where there are several.
        let all: Vec<[u32; 4]> = (0..block.len() as u32).map(|cell| nodes(block, cell, first)).collect();
        let part = self.corotational.as_mut()?;
        let added = match material[..] {
            [one] => part.model.add_solid(name, &all, one),
            _ => (all.iter().zip(&material))
                .try_for_each(|(cell, &material)| part.model.add_solid(name, &[*cell], material)),
        };
        if let Err(error) = added {
            self.refuse_part(name, &error);
            return None;
        }
        Some(BodyCells::Tets(start..start + block.len() as u32))
    }
}

impl Corotational {
    fn new() -> Self {
        let model = corotational::Model::default();
        Self {
            start: State::at_rest(&model),
            model,
            cells: Vec::new(),
            control: None,
            surface: None,
            carried: BTreeMap::new(),
        }
    }
}

/// Constraints and loads.
impl Builder<'_> {
    /// Whether the nodes of a body turn.
    fn has_rotations(&self, body: usize) -> bool {
        self.shell_cells(body).is_some()
    }

    /// The components of a constraint: translations and rotations. By default all translations, and rotations if the body has
    /// some and `turns`.
    pub(super) fn components(
        &mut self,
        axes: Option<&[Axis]>,
        body: Option<usize>,
        turns: bool,
        path: &[&str],
    ) -> Option<[bool; 6]> {
        const AXES: [Axis; 6] = [Axis::X, Axis::Y, Axis::Z, Axis::Rx, Axis::Ry, Axis::Rz];
        let rotates = body.is_some_and(|body| self.has_rotations(body));
        let chosen = match axes {
            None => [true, true, true, rotates && turns, rotates && turns, rotates && turns],
            Some([]) => {
                let at = [path, &["components"]].concat();
                let help = "name x, y, z (of shells also rx, ry, rz), or leave it out for all";
                self.error(&at, "`components` is empty", "here", help);
                return None;
            }
            Some(axes) => AXES.map(|axis| axes.contains(&axis)),
        };
        if body.is_some() && !rotates && chosen[3..].contains(&true) {
            let at = [path, &["components"]].concat();
            let message = "only the nodes of shells have rotations";
            self.error(&at, message, "not of this body", "leave out rx, ry and rz");
            return None;
        }
        Some(chosen)
    }

    /// Adds a constraint of the nodes of a shell or a co-rotational solid, as the scene's own model has it in displacements.
    pub(super) fn constrain_corotational(
        &mut self,
        name: &str,
        table: &ConstraintTable,
        motion: &model::Motion,
        nodes: &[u32],
        components: [bool; 6],
    ) {
        let Some(part) = &mut self.corotational else { return };
        let turn = match table {
            ConstraintTable::Move(moved) => moved.turn.unwrap_or_default(),
            _ => [0.0; 3],
        };
        let moved = |[x, y, z]: [f64; 3], curve: &Curve| Motion::Moved {
            by: [x, y, z, turn[0], turn[1], turn[2]],
            curve: curve.clone(),
        };
        let all: Vec<(Vec<u32>, Motion)> = match motion {
            model::Motion::Displacement(by, curve) => vec![(nodes.to_vec(), moved(*by, curve))],
            model::Motion::Displacements(by, curve) => {
                nodes.iter().zip(by).map(|(&node, &by)| (vec![node], moved(by, curve))).collect()
            }
            _ => vec![(nodes.to_vec(), Motion::Fixed)],
        };
        let constraint =
            |(nodes, motion)| corotational::Constraint { name: name.to_owned(), nodes, components, motion };
        let all: Vec<_> = all.into_iter().map(constraint).collect();
        let clash = part
            .model
            .constraints
            .iter()
            .find(|known| all.iter().any(|own| clash(known, own)))
            .map(|known| known.name.clone());
        part.model.constraints.extend(all);
        if let Some(other) = clash {
            let first = self.source().key_span(&["constraint", &other]);
            let second = self.source().key_span(&["constraint", name]);
            let message = format!("`{other}` and `{name}` both prescribe rotations of the same nodes");
            let help = "take the shared nodes out of one of them, or limit `components`";
            let diagnostic = Diagnostic::error(message).at(second, "contradicts the other");
            self.out.push(diagnostic.also(first, "contradicts the other").help(help));
        }
    }

    /// How nodes of shells and co-rotational solids are moved, without their rotation.
    pub(super) fn corotational_motion(
        &mut self,
        name: &str,
        table: &MoveTable,
        nodes: Option<(usize, &[u32])>,
    ) -> Option<model::Motion> {
        let path = ["constraint", name];
        let shift = match (&table.by, table.velocity) {
            (_, Some(_)) => {
                let message = "nodes of shells and co-rotational solids move by a way, not with a velocity";
                let help = "give the whole way in `by`, with a `curve`";
                self.error(&[path[0], path[1], "velocity"], message, "not for this model", help);
                return None;
            }
            (Some(Vectors::PerNode(by)), _) => {
                let (body, nodes) = nodes?;
                let by = self.node_vectors(by, body, nodes, &[path[0], path[1], "by"])?;
                return Some(model::Motion::Displacements(by, self.curve(&table.timing, &path)?));
            }
            (None, None) if table.turn.is_none() => {
                let message = "a motion has `by`, `turn` or both, found neither";
                self.error(&path, message, "this motion", "`by` in metres, `turn` in radians");
                return None;
            }
            (by, None) => match by {
                Some(Vectors::Uniform(by)) => *by,
                _ => [0.0; 3],
            },
        };
        Some(model::Motion::Displacement(shift, self.curve(&table.timing, &path)?))
    }

    /// Adds springs.
    pub(super) fn add_springs(&mut self, name: &str, table: &SpringTable) {
        let path = ["constraint", name];
        let Some(body) = self.find_body(&table.body, &[path[0], path[1], "body"]) else { return };
        let Some(nodes) = self.body_nodes(body, &table.nodes, &[path[0], path[1], "nodes"]) else { return };
        let Some(part) = &mut self.corotational else {
            let message = "springs are for shells and co-rotational solids";
            self.error(&path, message, "not for a `solid`", "take `fix`, or change `model` of the body");
            return;
        };
        for node in nodes {
            let anchor = table.to.map_or(part.model.rest[node as usize], Vector3::from);
            part.model.springs.push(Spring { node, anchor, stiffness: table.stiffness });
        }
    }

    pub(super) fn add_corotational_loads(&mut self) {
        let scene = self.scene;
        if let Some(acceleration) = scene.scene.gravity {
            let kind = corotational::LoadKind::Gravity { acceleration: Vector3::from(acceleration) };
            self.push_loads("gravity", vec![kind], constant(), false);
        }
        for (name, table) in &scene.loads {
            let path = ["load", name.as_str()];
            let controlled = scene.run.control.as_ref().is_some_and(|control| control.load == *name);
            let curve = match controlled {
                true => self.no_timing(table, &path),
                false => self.curve(table.timing(), &path),
            };
            let kinds = self.corotational_load(table, &path);
            if let (Some(curve), Some(kinds)) = (curve, kinds) {
                self.push_loads(name, kinds, curve, controlled);
            }
        }
        if let Some(table) = &scene.run.control {
            self.add_control(table);
        }
    }

    fn push_loads(&mut self, name: &str, kinds: Vec<corotational::LoadKind>, curve: Curve, controlled: bool) {
        let Some(part) = &mut self.corotational else { return };
        let load =
            |kind| corotational::Load { name: name.to_owned(), kind, curve: curve.clone(), controlled };
        part.model.loads.extend(kinds.into_iter().map(load));
    }

    /// A controlled load has no course of its own.
    fn no_timing(&mut self, table: &LoadTable, path: &[&str]) -> Option<Curve> {
        let timing = table.timing();
        if timing.curve.is_some() || timing.from != 0.0 || timing.to.is_some() {
            let message = "the factor of a controlled load is found: it has no course of its own";
            self.error(path, message, "this load", "leave out `curve`, `from` and `to`");
            return None;
        }
        Some(constant())
    }

    fn corotational_load(&mut self, table: &LoadTable, path: &[&str]) -> Option<Vec<corotational::LoadKind>> {
        let at = |key| [path, &[key]].concat();
        if let LoadTable::Gravity(gravity) = table {
            return self.corotational_gravity(gravity, path);
        }
        let body = match self.find_target(table.on()?, &at("on"))? {
            Target::Body(body) => body,
            Target::Surface(surface) => return self.load_on_surface(table, surface, path),
        };
        let shell = self.has_rotations(body);
        Some(match table {
            LoadTable::Force(force) => match self.nodal_forces(force, Target::Body(body), path)? {
                pliant_mechanics::load::LoadKind::Forces(forces) => single_forces(&forces),
                _ => return None,
            },
            LoadTable::Moment(moment) => vec![self.moment(moment, body, shell, path)?],
            LoadTable::Traction(traction) if shell => {
                let cells = self.facets(body, &traction.faces, &at("faces"))?;
                vec![corotational::LoadKind::Area { cells, traction: Vector3::from(traction.traction) }]
            }
            LoadTable::Traction(traction) => {
                let faces = self.faces(Target::Body(body), &traction.faces, &at("faces"))?;
                single_forces(&self.traction_forces(Target::Body(body), &faces, traction.traction))
            }
            LoadTable::Pressure(pressure) if shell => vec![self.shell_pressure(pressure, body, path)?],
            LoadTable::Pressure(_) => {
                let help = "take a `traction`, `model = \"solid\"`, or cover the solid with a shell";
                let message = "a pressure on a co-rotational solid does not follow its faces";
                self.error(path, message, "not for this model", help);
                return None;
            }
            LoadTable::Edge(edge) => {
                if !shell {
                    self.error(
                        &at("on"),
                        "a load on edges is for shells",
                        "not a shell",
                        "take a `traction`",
                    );
                    return None;
                }
                let nodes = self.body_nodes(body, &edge.nodes, &at("nodes"))?;
                let edges = self.border_edges(body, &nodes);
                if edges.is_empty() {
                    let message = "no edge of the border has both its ends selected";
                    self.error(
                        &at("nodes"),
                        message,
                        "this selection",
                        "select all nodes along a border of the shell",
                    );
                    return None;
                }
                vec![corotational::LoadKind::Edge { edges, traction: Vector3::from(edge.traction) }]
            }
            LoadTable::Gravity(_) => return None,
        })
    }

    /// A load on a surface that a shell or a co-rotational solid carries.
    fn load_on_surface(
        &mut self,
        table: &LoadTable,
        surface: usize,
        path: &[&str],
    ) -> Option<Vec<corotational::LoadKind>> {
        let at = |key| [path, &[key]].concat();
        let target = Target::Surface(surface);
        let forces = match table {
            LoadTable::Force(force) => match self.nodal_forces(force, target, path)? {
                pliant_mechanics::load::LoadKind::Forces(forces) => forces,
                _ => return None,
            },
            LoadTable::Traction(traction) => {
                let faces = self.faces(target, &traction.faces, &at("faces"))?;
                self.traction_forces(target, &faces, traction.traction)
            }
            _ => {
                let message = "a carried surface takes forces and tractions";
                self.error(&at("on"), message, "a carried surface", "load the body itself");
                return None;
            }
        };
        let part = self.corotational.as_ref()?;
        if let Some(points) = part.carried.get(&surface) {
            let (points, forces) =
                forces.iter().map(|&(node, force)| (points[node as usize], Vector3::from(force))).unzip();
            return Some(vec![corotational::LoadKind::Carried { points, forces }]);
        }
        let mapping = &self.model.surfaces[surface].mapping;
        let nodal = forces.iter().flat_map(|&(point, force)| {
            mapping.row(point as usize).map(move |(node, weight)| (node as u32, force.map(|f| f * weight)))
        });
        Some(single_forces(&nodal.collect::<Vec<_>>()))
    }

    fn corotational_gravity(
        &mut self,
        table: &crate::format::GravityTable,
        path: &[&str],
    ) -> Option<Vec<corotational::LoadKind>> {
        let at = |key| [path, &[key]].concat();
        let acceleration = Vector3::from(table.acceleration);
        let body = match (&table.on, &table.nodes) {
            (Some(name), _) => self.find_body(name, &at("on"))?,
            (None, None) => return Some(vec![corotational::LoadKind::Gravity { acceleration }]),
            (None, Some(_)) => {
                let message = "`nodes` are nodes of one body, which `on` must name";
                self.error(&at("nodes"), message, "of which body?", "add `on = \"BODY\"`");
                return None;
            }
        };
        let nodes = match &table.nodes {
            Some(selection) => self.body_nodes(body, selection, &at("nodes"))?,
            None => self.model.bodies[body].nodes.clone().collect(),
        };
        let weight = |node: u32| (node, <[f64; 3]>::from(acceleration * self.model.mass[node as usize]));
        Some(single_forces(&nodes.into_iter().map(weight).collect::<Vec<_>>()))
    }

    fn moment(
        &mut self,
        table: &MomentTable,
        body: usize,
        shell: bool,
        path: &[&str],
    ) -> Option<corotational::LoadKind> {
        let at = |key| [path, &[key]].concat();
        if !shell {
            let message = "only the nodes of shells take moments";
            self.error(&at("on"), message, "not a shell", "take forces");
            return None;
        }
        let nodes = self.body_nodes(body, &table.nodes, &at("nodes"))?;
        let moment = match (table.each, table.total) {
            (Some(each), None) => Vector3::from(each),
            (None, Some(total)) => Vector3::from(total) / nodes.len() as f64,
            (each, _) => {
                let found = if each.is_some() { "both" } else { "neither" };
                let message = format!("a moment has exactly one of `each` and `total`, found {found}");
                let help = "`each` acts on every node, `total` is shared among them";
                self.error(path, message, "this moment", help);
                return None;
            }
        };
        Some(corotational::LoadKind::Moment { nodes, moment })
    }

    fn shell_pressure(
        &mut self,
        table: &PressureTable,
        body: usize,
        path: &[&str],
    ) -> Option<corotational::LoadKind> {
        let cells = self.facets(body, &table.faces, &[path, &["faces"]].concat())?;
        let spread = match table.spread {
            SpreadName::Lumped => Spread::Lumped,
            SpreadName::Curved => Spread::Curved,
        };
        Some(corotational::LoadKind::Pressure { cells, pressure: table.pressure, spread })
    }

    /// The facets of a shell, numbered in the model; `None` for another body.
    pub(super) fn shell_cells(&self, body: usize) -> Option<Vec<u32>> {
        match self.corotational.as_ref()?.cells.get(body)? {
            BodyCells::Facets(range) => Some(range.clone().collect()),
            BodyCells::Tets(_) => None,
        }
    }

    /// The selected facets of a shell, numbered in the model.
    fn facets(
        &mut self,
        body: usize,
        selection: &pliant_geometry::Selection,
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

    /// The edges of one triangle only both of whose ends are among some nodes of the model (increasing).
    fn border_edges(&self, body: usize, nodes: &[u32]) -> Vec<[u32; 2]> {
        let (Some(part), Some(cells)) = (&self.corotational, self.shell_cells(body)) else {
            return Vec::new();
        };
        let mut count: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        for facet in cells.iter().map(|&cell| &part.model.facets[cell as usize]) {
            for corner in 0..3 {
                let [a, b] = [facet.nodes[corner], facet.nodes[(corner + 1) % 3]];
                *count.entry([a.min(b), a.max(b)]).or_default() += 1;
            }
        }
        let chosen = |edge: &[u32; 2]| edge.iter().all(|node| nodes.binary_search(node).is_ok());
        count.into_iter().filter(|(edge, n)| *n == 1 && chosen(edge)).map(|(edge, _)| edge).collect()
    }

    fn add_control(&mut self, table: &ControlTable) {
        let path = ["run", "control"];
        let scene = self.scene;
        if !scene.loads.iter().any(|(name, _)| *name == table.load) {
            let known: Vec<&str> = scene.loads.iter().map(|(name, _)| name.as_str()).collect();
            let help = suggestion(&table.load, &known, SCENE, "loads");
            let message = format!("there is no load `{}`", table.load);
            self.error(&["run", "control", "load"], message, "no such load", help);
            return;
        }
        let given = [table.displacement.is_some(), table.arc_length.is_some(), table.volume.is_some()];
        if given.iter().filter(|&&given| given).count() != 1 {
            let message = "a control has exactly one of `displacement`, `arc-length` and `volume`";
            self.error(&path, message, "this control", "leave the others out");
            return;
        }
        let control = match (&table.displacement, table.arc_length, table.volume) {
            (Some(wanted), _, _) => self.controlled_node(wanted),
            (_, Some(length), _) => Some(Control::ArcLength(length)),
            (_, _, Some(volume)) => self.controlled_volume(&table.load, volume),
            _ => None,
        };
        if let Some(part) = &mut self.corotational {
            part.control = control;
        }
    }

    fn controlled_node(&mut self, wanted: &crate::format::ControlledNode) -> Option<Control> {
        let at = |key| ["run", "control", "displacement", key];
        let body = self.find_body(&wanted.body, &at("body"))?;
        let nodes = self.model.bodies[body].nodes.clone();
        let place = Vector3::from(wanted.at);
        let away = |node: &u32| (Vector3::from(self.model.rest[*node as usize]) - place).norm_squared();
        let node = nodes.min_by(|a, b| away(a).total_cmp(&away(b)))?;
        let component = match wanted.component {
            Axis::X => 0,
            Axis::Y => 1,
            Axis::Z => 2,
            _ => {
                let message = "a control moves a node along x, y or z, and does not turn it";
                self.error(&at("component"), message, "a rotation", "take `x`, `y` or `z`");
                return None;
            }
        };
        Some(Control::Displacement { node, component, by: wanted.by })
    }

    fn controlled_volume(&mut self, load: &str, to: f64) -> Option<Control> {
        let part = self.corotational.as_ref()?;
        let pressed =
            part.model.loads.iter().filter(|known| known.name == load).find_map(|load| match &load.kind {
                corotational::LoadKind::Pressure { cells, .. } => Some(cells),
                _ => None,
            });
        let path = ["run", "control", "volume"];
        let Some(cells) = pressed else {
            let message = format!("`{load}` is no pressure on a shell, which a volume is controlled by");
            self.error(&path, message, "of what?", "let `load` name a pressure on a closed shell");
            return None;
        };
        match part.model.check_closed(cells) {
            Ok(()) => {
                let from = part.model.enclosed_volume(cells, &part.model.rest);
                Some(Control::Volume { from, to })
            }
            Err(error) => {
                let help = "close the surface, or press on all of it";
                self.error(&path, error.to_string(), "of an open surface", help);
                None
            }
        }
    }

    /// Refuses what a static solver cannot hold.
    pub(super) fn check_held(&mut self) {
        if self.scene.run.solver != SolverName::Static {
            return;
        }
        let Some(part) = &self.corotational else { return };
        if let Err(corotational::SolveError::FreeBody { node, free_modes }) =
            corotational::check_held(&part.model)
        {
            let owner = self.model.bodies.iter().find(|body| body.nodes.contains(&node));
            let Some(name) = owner.map(|body| body.name.clone()) else { return };
            let message = format!(
                "`{name}` is free in {}, and a static run needs all of it held (the part with node {node})",
                counted(free_modes, "rigid motion")
            );
            let help = "fix more of its nodes, tie it to points with `type = \"spring\"`, or take `solver = \"implicit\"`";
            self.error(&["body", &name], message, "not held", help);
        }
    }

    /// Sets the state that a run starts from.
    pub(super) fn start_corotational(&mut self) {
        let velocity = std::mem::take(&mut self.model.initial_velocity);
        let Some(part) = &mut self.corotational else {
            self.model.initial_velocity = velocity;
            return;
        };
        part.start = State::at_rest(&part.model);
        for (own, given) in part.start.velocity.iter_mut().zip(velocity) {
            *own = Vector3::from(given);
        }
    }
}

impl Corotational {
    /// How many cells a body has, and their volume at rest [m³].
    pub(crate) fn size(&self, body: usize) -> Option<(usize, f64)> {
        let volume = match self.cells.get(body)? {
            BodyCells::Facets(range) => {
                let facets = &self.model.facets[range.start as usize..range.end as usize];
                facets.iter().map(|facet| facet.area * facet.thickness).sum()
            }
            BodyCells::Tets(range) => {
                self.model.tets[range.start as usize..range.end as usize].iter().map(|tet| tet.volume).sum()
            }
        };
        let (BodyCells::Facets(range) | BodyCells::Tets(range)) = self.cells.get(body)?;
        Some((range.len(), volume))
    }

    /// Each part of the model in words with a number that tells it from others; see [`fingerprint`].
    pub(crate) fn fingerprints(&self) -> Vec<(String, u64)> {
        let model = &self.model;
        vec![
            ("the mesh, thickness or material of shells".into(), fingerprint(&model.facets)),
            ("the mesh or material of co-rotational solids".into(), fingerprint(&model.tets)),
            ("constraints".into(), fingerprint(&(&model.constraints, &model.springs))),
            ("loads or their control".into(), fingerprint(&(&model.loads, &self.control))),
            ("creases".into(), fingerprint(&(&model.normals, &model.corner_normals))),
            ("damping".into(), fingerprint(&[model.mass_damping, model.stiffness_damping])),
        ]
    }

    /// The facet or the tetrahedron of a model that an error names: its body and its number in the body's mesh.
    pub(crate) fn cell(&self, number: usize) -> Option<(usize, u32)> {
        let facets = self.model.facets.len();
        let find = |(body, cells): (usize, &BodyCells)| {
            let (range, number) = match cells {
                BodyCells::Facets(range) if number < facets => (range, number as u32),
                BodyCells::Tets(range) if number >= facets => (range, (number - facets) as u32),
                _ => return None,
            };
            range.contains(&number).then(|| (body, number - range.start))
        };
        self.cells.iter().enumerate().find_map(find)
    }
}

/// Whether two constraints prescribe the same rotation of a node, and not both that it stays.
fn clash(a: &corotational::Constraint, b: &corotational::Constraint) -> bool {
    let shared = (3..6).any(|c| a.components[c] && b.components[c]);
    let still = a.motion == Motion::Fixed && b.motion == Motion::Fixed;
    shared && !still && a.nodes.iter().any(|node| b.nodes.contains(node))
}

fn constant() -> Curve {
    Curve { shape: Shape::Hold, from: 0.0, to: 0.0 }
}

/// Forces node by node; those of the same size together.
fn single_forces(forces: &[(u32, [f64; 3])]) -> Vec<corotational::LoadKind> {
    let mut all: Vec<(Vec<u32>, [f64; 3])> = Vec::new();
    let mut known: BTreeMap<[u64; 3], usize> = BTreeMap::new();
    for &(node, force) in forces {
        let at = *known.entry(force.map(f64::to_bits)).or_insert_with(|| {
            all.push((Vec::new(), force));
            all.len() - 1
        });
        all[at].0.push(node);
    }
    let kind = |(nodes, force)| corotational::LoadKind::Force { nodes, force: Vector3::from(force) };
    all.into_iter().map(kind).collect()
}
