//! The cells of shells: triangles, elements, materials, thickness. And which solids the implicit solvers can
//! have.

use std::collections::BTreeMap;

use pliant_format::diagnostic::Diagnostic;
use pliant_format::tables::{BodyTable, ByLabel, Element, Normals, SolverName, Thickness, ThicknessRule};
use pliant_format::{SCENE, suggestion};
use pliant_geometry::words::counted;
use pliant_geometry::{CellBlock, CellKind, DataArray, Mesh, Vector3};
use pliant_implicit::{ModelError, Shell};
use pliant_shells::element::Wall;
use pliant_shells::element::{Bending, Elasticity, Formulation, Layer, Membrane, Orthotropic};
use pliant_sim::BodyCells;

use super::{Draft, Meshed, law_path, nodes};
use crate::assemble::Context;
use crate::assemble::meshes::{is_sheet, surface_of};

/// Stiffness against drilling of `dkt-cst` and `membrane`, as a part of G t A/3 a node.
const DRILLING: f64 = 0.01;

/// Point data with the normals of a surface.
const NORMAL: &str = "normal";

/// Cell data that is not 0 on triangles that stay flat among curved ones.
const FLAT_CELLS: &str = "flat";

/// Normals whose cosine is as close to 1 are parallel: to 0.1°.
const FLAT: f64 = 1e-6;

/// Thickness over width above which a wall is reported as stout: a strip is then 3 % too stiff against twist.
const STOUT: f64 = 0.05;

impl Context<'_> {
    /// The mesh of a shell as triangles only: quads cut in two, volume cells left for their boundary.
    pub(in crate::assemble) fn triangles(&mut self, mesh: Mesh, path: &[&str]) -> Option<Mesh> {
        let surface = surface_of(mesh);
        if surface.blocks.is_empty() {
            let help = "a thin wall needs triangles or quads";
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
}

impl Meshed<'_> {
    /// Reports solids of the model, from a number on, that the implicit solvers can't have.
    pub(in crate::assemble) fn check_solids(&mut self, name: &str, first: usize) {
        let solids = &self.assembly.solids[first..];
        if let Err(error) = solids.iter().try_for_each(|solid| self.assembly.check_solid(name, solid)) {
            self.refuse_part(name, &error);
        }
    }

    /// Adds the shell of a body.
    pub(in crate::assemble) fn add_shell(&mut self, draft: &Draft<'_>, body: usize) -> Option<BodyCells> {
        let &Draft { name, table, mesh, .. } = draft;
        let block = mesh.block(CellKind::Triangle)?;
        let formulation = self.formulation(name, table)?;
        let (layers, direction) = self.layers(draft, block)?;
        let (material, thickness) = match layers[..] {
            [] => (self.materials(draft, block)?, self.thickness(name, table, block)?),
            _ => (Vec::new(), Vec::new()),
        };
        let normals = self.normals(draft, body)?;
        let flat = given_normals(table, mesh).map(|_| self.flat(name, block)).unwrap_or_default();
        let model_body = &self.assembly.bodies[body];
        let cells: Vec<[u32; 3]> =
            (0..block.len() as u32).map(|cell| nodes(block, cell, |node| model_body.node(node))).collect();
        let count = cells.len();
        let shell = Shell {
            name: name.into(),
            cells,
            thickness,
            material,
            formulation,
            layers,
            direction,
            tension: table.pre_tension,
            crease: table.crease.unwrap_or(45.0).to_radians(),
            normals,
            flat,
            branches: table.branches,
        };
        let start = self.assembly.facets.len() as u32;
        match self.assembly.add_shell(&shell) {
            Ok(notes) => {
                self.tell_notes(name, notes, count);
                self.tell_slack(name, table, formulation, start as usize);
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
            None | Some(Element::DktCurved) => (Membrane::default(), Bending::Dkt),
            Some(Element::DktOpt) => (Membrane::Opt { adaptation: 10.0 }, Bending::Dkt),
            Some(Element::DktCst) => (cst, Bending::Dkt),
            Some(Element::Membrane) => (cst, Bending::None),
            Some(Element::Plate) => (Membrane::None, Bending::Dkt),
            Some(Element::Comas2010) => (cst, Bending::Comas2010),
            Some(_) => {
                let help = "elements of shells: `dkt-curved`, `dkt-opt`, `dkt-cst`, `membrane`, `plate`, `comas-2010`";
                let message = format!("`{name}` is a shell, and this element is for solids");
                self.error(&["body", name, "element"], message, "not for shells", help);
                return None;
            }
        };
        Some(Formulation { membrane, bending })
    }

    /// The material of each cell of a block, or one for all.
    fn materials(&mut self, draft: &Draft<'_>, block: &CellBlock) -> Option<Vec<Wall>> {
        let &Draft { name, table, given, .. } = draft;
        let labels = block.data.get("label");
        let mut known: BTreeMap<Option<String>, Wall> = BTreeMap::new();
        let mut walls = Vec::with_capacity(block.len());
        for cell in 0..block.len() {
            let label = labels.map(|labels| labels.item(cell)[0].to_string());
            let material = match known.get(&label) {
                Some(&material) => material,
                None => {
                    // A label without a value is already reported.
                    let law = table.law.of(label.as_deref())?;
                    let density = table.density.of(label.as_deref())?.0;
                    let path = law_path(name, &given.law, law);
                    let material = Wall { elastic: self.elasticity(name, table, law, &path)?, density };
                    *known.entry(label).or_insert(material)
                }
            };
            walls.push(material);
        }
        if known.len() == 1 {
            walls.truncate(1);
        }
        Some(walls)
    }

    /// Young's modulus and Poisson's ratio of a law at small strain.
    fn elasticity(
        &mut self,
        name: &str,
        table: &BodyTable,
        law_name: &str,
        path: &[&str],
    ) -> Option<Elasticity> {
        let scene = self.scene;
        let Some((_, law)) = scene.laws.iter().find(|(known, _)| known == law_name) else {
            let known: Vec<&str> = scene.laws.iter().map(|(name, _)| name.as_str()).collect();
            let help = suggestion(law_name, &known, SCENE, "laws");
            self.error(path, format!("there is no law `{law_name}`"), "no such law", help);
            return None;
        };
        let what = match (law.law.is_isotropic(), law.extras.prony.is_empty()) {
            (false, _) => "is not isotropic",
            (_, false) => "relaxes",
            _ => {
                let moduli = law.law.small_strain();
                if law.law.name() != "st-venant-kirchhoff" {
                    let note = format!(
                        "`{name}` takes Young's modulus and Poisson's ratio of law `{law_name}` at small strain"
                    );
                    if !self.notes.contains(&note) {
                        self.notes.push(note);
                    }
                }
                return Some(Elasticity { young: moduli.young(), poisson: moduli.poisson() });
            }
        };
        let message = format!("law `{law_name}` {what}, and `{name}` is of model `{}`", table.model.word());
        let help = "take an isotropic law without `prony`, such as `neo-hookean`, or `model = \"solid\"`";
        self.error(path, message, "not for this model", help);
        None
    }

    /// The layers of a shell, if it has some, and the direction in each triangle that their angles count
    /// from.
    fn layers(&mut self, draft: &Draft<'_>, block: &CellBlock) -> Option<(Vec<Layer>, Vec<Vector3>)> {
        let &Draft { name, table, mesh, .. } = draft;
        if table.layers.is_empty() {
            return Some((Vec::new(), Vec::new()));
        }
        if table.element == Some(Element::Comas2010) {
            let help = "take `dkt-opt`, or one `thickness` and `law`";
            let message = format!("`{name}` has layers, but its element supports only one material");
            self.error(&["body", name, "element"], message, "not with `layers`", help);
            return None;
        }
        let tried: Vec<Option<Layer>> =
            (0..table.layers.len()).map(|number| self.layer(draft, number)).collect();
        let layers: Vec<Layer> = tried.into_iter().collect::<Option<_>>()?;
        if let Some(fibre) = &table.fibre {
            let directions = self.shell_directions(draft, fibre, block)?;
            return Some((layers, directions.into_iter().map(Vector3::from).collect()));
        }
        if let Some(number) = table.layers.iter().position(|layer| layer.young_modulus.is_some()) {
            let message =
                format!("layer {number} of `{name}` is stiffer in one direction, but no direction is given");
            let help = "add to the body `fibre = [x, y, z]`, `fibre = { cell-data = \"name\" }` or a rule such as `around`; the angles of \
                        layers count from this direction, projected onto each triangle";
            self.error(&["body", name, "layers", &number.to_string()], message, "no direction", help);
            return None;
        }
        // The same in all directions: along an edge.
        let along = |cell: &[u32]| mesh.points[cell[1] as usize] - mesh.points[cell[0] as usize];
        Some((layers, block.cells().map(along).collect()))
    }

    fn layer(&mut self, draft: &Draft<'_>, number: usize) -> Option<Layer> {
        let &Draft { name, table, .. } = draft;
        let layer = &table.layers[number];
        let index = number.to_string();
        let path = ["body", name, "layers", &index];
        let elastic = match (layer.young_modulus, layer.poisson_ratio, layer.shear_modulus) {
            (Some(young), Some(poisson), Some(shear)) if layer.law.is_none() => {
                Orthotropic { young, poisson, shear }
            }
            (None, None, None) => {
                let (layer_path, whole) = ([path.as_slice(), &["law"]].concat(), ["body", name, "law"]);
                let (law, path) = match (&layer.law, &table.law) {
                    (Some(law), _) => (law, layer_path.as_slice()),
                    (None, ByLabel::One(law)) => (law, whole.as_slice()),
                    (None, ByLabel::Each(_)) => {
                        let message = format!("layer {number} of `{name}` has no elastic constants");
                        let help = "give it a `law`, or `young-modulus = [along, across]` with `poisson-ratio` and \
                                    `shear-modulus`; or give the whole body one `law`";
                        self.error(&path, message, "this layer", help);
                        return None;
                    }
                };
                self.elasticity(name, table, law, path)?.into()
            }
            _ => {
                let message =
                    format!("layer {number} of `{name}` has incomplete or conflicting elastic constants");
                let help =
                    "give it either a `law`, or all of `young-modulus`, `poisson-ratio` and `shear-modulus`";
                self.error(&path, message, "this layer", help);
                return None;
            }
        };
        let density = match (layer.density, &table.density) {
            (Some(density), _) => density,
            (None, ByLabel::One(density)) => density.0,
            (None, ByLabel::Each(_)) => {
                let message = format!(
                    "layer {number} of `{name}` has no density, and the body has a density for each label"
                );
                self.error(&path, message, "this layer", "give the layer a `density`");
                return None;
            }
        };
        Some(Layer { elastic, thickness: layer.thickness, angle: layer.angle.to_radians(), density })
    }

    /// The thickness [m] of each triangle of a wall, or one for all.
    pub(in crate::assemble) fn thickness(
        &mut self,
        name: &str,
        table: &BodyTable,
        block: &CellBlock,
    ) -> Option<Vec<f64>> {
        let path = ["body", name, "thickness"];
        match &table.thickness {
            None => {
                let help = "add `thickness = 0.002` in metres";
                let message = format!("`{name}` is a {} and needs a `thickness`", table.model.word());
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
                        self.error(
                            &path,
                            message,
                            "given by label",
                            "give one thickness, or one for every label",
                        );
                        None
                    }
                }
            }
        }
    }

    /// The normals that the mesh gives to the nodes of a shell, by their numbers in the model.
    fn normals(&mut self, draft: &Draft<'_>, body: usize) -> Option<BTreeMap<u32, Vector3>> {
        let &Draft { name, table, mesh, .. } = draft;
        if table.normals == Some(Normals::Mesh) && table.crease.is_some() {
            let message = format!("`{name}` takes its normals from the mesh, so `crease` has no effect");
            self.error(&["body", name, "crease"], message, "has no effect here", "remove it, or `normals`");
            return None;
        }
        let model_body = &self.assembly.bodies[body];
        match (table.normals, given_normals(table, mesh)) {
            (None | Some(Normals::Triangles), None) => Some(BTreeMap::new()),
            (Some(Normals::Mesh), None) => {
                let message =
                    format!("the mesh of `{name}` has no point data `{NORMAL}` of three components");
                let help = "`pliant mesh --as shells` writes them into .vtu files; or leave `normals` out";
                self.error(&["body", name, "normals"], message, "not in the mesh", help);
                None
            }
            (_, Some(data)) => {
                let of = |node: u32| {
                    let given = data.item(node as usize);
                    (model_body.node(node), Vector3::new(given[0], given[1], given[2]))
                };
                // A fit gives no normal at nodes where none fits all triangles: there normals are estimated,
                // with creases.
                let given: BTreeMap<u32, Vector3> = (0..mesh.points.len() as u32)
                    .map(of)
                    .filter(|(_, normal)| *normal != Vector3::zeros())
                    .collect();
                let creased = mesh.points.len() - given.len();
                if creased > 0 {
                    self.notes.push(format!(
                        "`{name}` is curved by the normals of its mesh, except at {} without a normal, which may be creases",
                        counted(creased, "node")
                    ));
                } else if !is_sheet(&table.mesh) {
                    self.notes.push(format!("`{name}` is curved by the normals of its mesh"));
                }
                Some(given)
            }
        }
    }

    /// The triangles that the mesh keeps flat among those that its normals curve.
    fn flat(&mut self, name: &str, block: &CellBlock) -> Vec<bool> {
        let Some(data) = block.data.get(FLAT_CELLS).filter(|data| data.components == 1) else {
            return Vec::new();
        };
        let flat: Vec<bool> = data.values.iter().map(|&value| value != 0.0).collect();
        let count = flat.iter().filter(|flat| **flat).count();
        if count > 0 {
            self.notes.push(format!(
                "`{name}`: cell data `{FLAT_CELLS}` of the mesh keeps {} flat; all others are curved",
                counted(count, "triangle")
            ));
        }
        flat
    }

    /// Reports nodes of a membrane without transverse stiffness at the start of a static run.
    fn tell_slack(&mut self, name: &str, table: &BodyTable, formulation: Formulation, first: usize) {
        let slack = formulation.bending == Bending::None && formulation.membrane != Membrane::None;
        if !slack || table.pre_tension != 0.0 || self.scene.run.solver != SolverName::Static {
            return;
        }
        // Of each node the normal of a triangle, and whether all are parallel to it.
        let mut flat: BTreeMap<u32, (Vector3, bool)> = BTreeMap::new();
        for facet in &self.assembly.facets[first..] {
            let [a, b, c] = facet.nodes.map(|node| self.assembly.place(node as usize));
            let normal = (b - a).cross(&(c - a)).normalize();
            for node in facet.nodes {
                let known = flat.entry(node).or_insert((normal, true));
                known.1 &= known.0.dot(&normal).abs() > 1.0 - FLAT;
            }
        }
        let count = flat.values().filter(|(_, flat)| *flat).count();
        if count > 0 {
            self.notes.push(format!(
                "`{name}`: {} of the membrane lie in one plane with all triangles around, where the membrane has no transverse \
                 stiffness without tension. The static solver starts with an artificial stiffness, proportional to the \
                 residual, which vanishes at equilibrium; `pre-tension` [N/m] gives a real one",
                counted(count, "node")
            ));
        }
    }

    fn tell_notes(&mut self, name: &str, notes: pliant_implicit::Notes, count: usize) {
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
        if let Some(stoutness) = notes.stoutness.filter(|&stoutness| stoutness > STOUT) {
            self.notes.push(format!(
                "`{name}` is {stoutness:.2} times as thick as wide (width: twice its area over its border): transverse shear is \
                 neglected, so a strip like this is about {:.0} % too stiff in torsion (0.63 times this ratio)",
                63.0 * stoutness
            ));
        }
        if let Some((inverted, first)) = notes.inverted {
            let message = format!(
                "{} of `{name}` folded back onto all neighbours, like inverted triangles: the first is triangle {first} (counted \
                 from 0)",
                counted(inverted, "triangle")
            );
            let place = self.source().span(&["body", name, "mesh"]);
            let help =
                "fields are wrong there: smooth or remesh, or distort a built-in shape by less than 0.25";
            self.out.push(Diagnostic::warning(message).at(place, "folded").help(help));
        }
        if notes.comas > 0 {
            let message = format!(
                "`{name}` has the element of Comas (2010), which depends on the numbering of its corners and converges to \
                 plates 6 to 26 % too soft"
            );
            let place = self.source().span(&["body", name, "element"]);
            let help = "it exists for comparison; take `dkt-curved`";
            self.out.push(Diagnostic::warning(message).at(place, "converges to a wrong plate").help(help));
        }
    }

    /// Reports why a part was rejected, at its key.
    fn refuse_part(&mut self, name: &str, error: &ModelError) {
        let (key, help) = match error {
            ModelError::OutOfRange { what, .. }
                if what.starts_with("thickness") && !what.contains("layer") =>
            {
                ("thickness", "give every triangle a thickness above 0, in metres")
            }
            ModelError::OutOfRange { what, .. } if what.contains("of layer") => ("layers", ""),
            ModelError::OutOfRange { what, .. } if what.starts_with("density") => ("density", ""),
            ModelError::Direction { .. } => (
                "fibre",
                "take a direction that lies along the wall, or a rule such as `around` or `tangential`",
            ),
            ModelError::OutOfRange { .. } => ("law", "give the law other constants"),
            ModelError::Normal { .. } => {
                ("mesh", "`normals = \"triangles\"` takes the mean of the triangles instead")
            }
            ModelError::NoStiffness { .. } => {
                let solver = self.scene.run.solver.word();
                let message = format!("the solver `{solver}` is not for this body: {error}");
                let help = "take `solver = \"explicit\"` or `\"quasi-static\"`, or follow the message";
                self.error(&["body", name], message, "not with this solver", help);
                return;
            }
            ModelError::Branch { .. } => {
                ("mesh", "set `branches = true` if walls are meant to meet there, or repair the mesh")
            }
            _ => ("mesh", "run `pliant info` on the mesh file for details; `fix = \"merge\"` joins nodes"),
        };
        self.error(&["body", name, key], error.to_string(), "here", help);
    }
}

/// The normals of a mesh that its shell takes.
fn given_normals<'m>(table: &BodyTable, mesh: &'m Mesh) -> Option<&'m DataArray> {
    let taken = match table.normals {
        Some(Normals::Mesh) => true,
        Some(Normals::Triangles) => false,
        None => table.crease.is_none(),
    };
    mesh.point_data.get(NORMAL).filter(|data| taken && data.components == 3)
}

#[cfg(test)]
mod tests {
    use pliant_format::Scene;
    use pliant_format::source::Source;
    use pliant_geometry::{DataArray, Vector3, io};

    use crate::assemble::build;

    /// A sphere of 20 triangles, whose mesh has the normals of an ellipsoid.
    #[test]
    fn the_normals_of_a_mesh_are_taken_unless_creases_are_asked_for() {
        let folder = tempfile::tempdir().unwrap();
        let mut mesh = pliant_meshing::sphere(0.1, 0, 100).unwrap();
        let normal = |p: &Vector3| [-p.x, -p.y, -2.0 * p.z];
        let values = mesh.points.iter().flat_map(normal).collect();
        mesh.point_data.insert("normal".into(), DataArray { components: 3, values });
        io::write(&folder.path().join("ball.vtu"), &mesh).unwrap();
        mesh.point_data.clear();
        io::write(&folder.path().join("plain.vtu"), &mesh).unwrap();
        let built = |file: &str, more: &str| {
            let text = format!(
                "[scene]\nuntil = 1\n[run]\nsolver = 'implicit'\n[law.wall]\ntype = 'neo-hookean'\nyoung-modulus = 1e6\n\
                 poisson-ratio = 0.3\n[body.wall]\nmodel = 'shell'\nlaw = 'wall'\nmesh = {{ file = '{file}' }}\n\
                 density = 1000\nthickness = 0.001\n{more}"
            );
            let source = Source::parse("ball.toml", text).unwrap();
            build(&Scene::from_source(source, folder.path().into()).unwrap())
        };
        let off = |file: &str, more: &str| {
            let part = built(file, more).unwrap().implicit.unwrap();
            let model = &part.model;
            assert_eq!(model.normals.len(), 12);
            let wanted = model.places().map(|p| Vector3::new(p.x, p.y, 2.0 * p.z).normalize());
            let off = model.normals.iter().zip(wanted).map(|(n, wanted)| (n.direction - wanted).norm());
            off.fold(0.0, f64::max)
        };
        for (file, more, same) in [
            ("ball.vtu", "", true),
            ("ball.vtu", "normals = 'mesh'", true),
            ("ball.vtu", "normals = 'triangles'", false),
            ("ball.vtu", "crease = 45", false),
            ("plain.vtu", "", false),
        ] {
            assert_eq!(off(file, more) < 1e-12, same, "{file} {more}: {}", off(file, more));
        }
        for (file, more, says) in [
            ("plain.vtu", "normals = 'mesh'", "has no point data `normal`"),
            ("ball.vtu", "normals = 'mesh'\ncrease = 30", "takes its normals from the mesh"),
        ] {
            let message = built(file, more).unwrap_err().plain().to_string();
            assert!(message.contains(says), "{message}");
        }
    }
}
