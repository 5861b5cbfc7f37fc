//! A NiftySim model as plain data: parts with their materials and conditions, the system's parameters, the
//! outputs.

use pliant_geometry::Mesh;

use super::Files;
use super::conditions::{self, Condition, Remarks, settle, sorted};
use super::contact::{self, Contact};
use super::error::{Fault, ImportProblem};
use super::geometry::{self, Geometry, join};
use super::material::Material;
use super::shells::{self, Membrane};
use super::system::{SYSTEM, System};
use super::xml::{
    XmlElement, attribute, child, children, count, fault, indices, is_on, line, needed, number,
    run_of_indices, text,
};

/// A model.
#[derive(Debug)]
pub(super) struct Model {
    /// The future bodies: submodels, or one for all.
    pub parts: Vec<SubModel>,
    pub materials: Vec<Material>,
    pub contact: Contact,
    pub system: System,
    pub output: Option<Output>,
    pub remarks: Remarks,
}

/// A mesh with its materials and conditions.
#[derive(Debug)]
pub(super) struct SubModel {
    pub geometry: Geometry,
    /// Material of each cell.
    pub material: Vec<u32>,
    /// Density of each cell [kg/m³].
    pub density: Vec<f64>,
    pub conditions: Vec<Condition>,
    pub membranes: Vec<Membrane>,
}

/// `<Output>`.
#[derive(Clone, Debug)]
pub(super) struct Output {
    /// Steps between two outputs.
    pub every: usize,
    /// U, F, S, E, EKin, EStrain.
    pub variables: Vec<String>,
}

/// Reads a model.
pub(super) fn read(root: XmlElement<'_>, files: &Files<'_>) -> Result<Model, Fault> {
    if !root.has_tag_name("Model") {
        return Err(fault(root, ImportProblem::NotAModel));
    }
    let mut model = Model {
        parts: Vec::new(),
        materials: Vec::new(),
        contact: Contact::default(),
        system: System::read(root)?,
        output: Output::read(root)?,
        remarks: Remarks::default(),
    };
    if child(root, "SubModel").is_some() {
        model.read_submodels(root, files)?;
    } else {
        model.read_whole(root, files)?;
    }
    if model.parts.iter().any(|part| part.geometry.solid == geometry::Solid::H8)
        && model.system.hourglass.is_none()
    {
        needed(needed(root, "SystemParams", SYSTEM)?, "HGKappa", "<HGKappa>0.075</HGKappa> (elements H8)")?;
    }
    for part in &mut model.parts {
        part.conditions = settle(std::mem::take(&mut part.conditions))?;
    }
    let nodes = model.parts.iter().map(|part| part.geometry.node_count()).sum();
    model.contact = contact::read(root, nodes, &model.system, files, &mut model.remarks)?;
    model.name_what_is_missing(root);
    Ok(model)
}

impl Model {
    fn read_whole(&mut self, root: XmlElement<'_>, files: &Files<'_>) -> Result<(), Fault> {
        let geometry = geometry::read(root, files, &mut self.remarks.notes)?;
        let mut sets = Sets::new(&geometry);
        sets.read(root, self)?;
        let (material, density) = sets.finish(root)?;
        let conditions = conditions::read(root, &geometry, &mut self.remarks)?;
        let membranes = shells::read(root, &geometry, &mut self.remarks)?;
        self.parts.push(SubModel { geometry, material, density, conditions, membranes });
        Ok(())
    }

    /// Submodels stay bodies of their own, unless nodes merge or the model itself has constraints, materials
    /// or shells.
    fn read_submodels(&mut self, root: XmlElement<'_>, files: &Files<'_>) -> Result<(), Fault> {
        let distance = child(root, "SubModelNodeMergerDistance").map(number).transpose()?;
        let whole = distance.is_some_and(|d| d >= 0.0)
            || ["Constraint", "ElementSet", "ShellElements", "ShellElementSet"]
                .iter()
                .any(|name| child(root, name).is_some());
        if !whole {
            for submodel in children(root, "SubModel") {
                self.read_whole(submodel, files)?;
                self.check_solid(submodel)?;
            }
            return Ok(());
        }
        let mut geometries: Vec<Geometry> = Vec::new();
        let mut assigned = Vec::new();
        let mut apart = Vec::new();
        for submodel in children(root, "SubModel") {
            let geometry = geometry::read(submodel, files, &mut self.remarks.notes)?;
            if let Some(first) = geometries.first().filter(|first| first.solid != geometry.solid) {
                return Err(mixed(submodel, first.solid, geometry.solid));
            }
            let mut sets = Sets::new(&geometry);
            sets.read(submodel, self)?;
            assigned.extend(sets.0);
            let membranes = shells::read(submodel, &geometry, &mut self.remarks)?;
            apart.push((conditions::read(submodel, &geometry, &mut self.remarks)?, membranes));
            geometries.push(geometry);
        }
        let (geometry, maps) = self.weld(root, &geometries, distance)?;
        let mut sets = Sets(assigned);
        sets.read(root, self)?;
        let (material, density) = sets.finish(root)?;
        let (mut conditions, mut membranes) = (Vec::new(), Vec::new());
        for ((of_part, walls), map) in apart.into_iter().zip(&maps) {
            conditions.extend(of_part.into_iter().map(|condition| renumbered(condition, map)));
            membranes.extend(walls.into_iter().map(|membrane: Membrane| Membrane {
                faces: renumbered_faces(&membrane.faces, map),
                ..membrane
            }));
        }
        conditions.extend(conditions::read(root, &geometry, &mut self.remarks)?);
        membranes.extend(shells::read(root, &geometry, &mut self.remarks)?);
        self.parts.push(SubModel { geometry, material, density, conditions, membranes });
        Ok(())
    }

    fn check_solid(&self, of: XmlElement<'_>) -> Result<(), Fault> {
        let solids: Vec<_> = self.parts.iter().map(|part| part.geometry.solid).collect();
        match solids.iter().find(|&&solid| solid != solids[0]) {
            Some(&other) => Err(mixed(of, solids[0], other)),
            None => Ok(()),
        }
    }

    fn weld(
        &mut self,
        root: XmlElement<'_>,
        parts: &[Geometry],
        distance: Option<f64>,
    ) -> Result<(Geometry, Vec<Vec<u32>>), Fault> {
        let solid = parts[0].solid;
        let (points, nodes, maps) = join(parts, distance);
        let each = solid.cell().node_count();
        let collapsed = nodes.chunks_exact(each).position(|cell| sorted(cell.to_vec()).len() < each);
        if let Some(cell) = collapsed {
            let what = format!(
                "nodes closer than {} merge, which merges two nodes of element {cell}",
                distance.unwrap_or(0.0)
            );
            let problem = ImportProblem::Contradiction { what, remedy: "give a smaller distance" };
            return Err(fault(child(root, "SubModelNodeMergerDistance").unwrap_or(root), problem));
        }
        let before: usize = parts.iter().map(Geometry::node_count).sum();
        let merged = before - points.len();
        self.remarks.notes.push(format!(
            "{} submodels became one body; {merged} nodes merged with nodes of an earlier submodel",
            parts.len()
        ));
        let mut mesh = Mesh { points, ..Mesh::default() };
        mesh.block_mut(solid.cell()).nodes = nodes;
        Ok((Geometry { solid, mesh }, maps))
    }

    /// Names the parts of the model that a scene cannot express.
    fn name_what_is_missing(&mut self, root: XmlElement<'_>) {
        let missing = &mut self.remarks.missing;
        for submodel in children(root, "SubModel") {
            let ignored = |of: &XmlElement<'_>| CONTACT.contains(&of.tag_name().name());
            for of in submodel.children().filter(ignored) {
                let (name, line) = (of.tag_name().name(), line(of));
                missing.push(format!(
                    "contact ({name} of line {line}, in a submodel, where NiftySim ignores it)"
                ));
            }
        }
        if child(root, "SystemParams").is_some_and(|system| is_on(system, "ROM")) {
            let note = "ROM: the full model is computed, not its reduction to a basis";
            self.remarks.notes.push(note.into());
        }
        let known = [
            "Nodes",
            "Elements",
            "MSHMesh",
            "VTKMesh",
            "SubModel",
            "SubModelNodeMergerDistance",
            "ElementSet",
            "Constraint",
            "ShellElements",
            "ShellElementSet",
            "SystemParams",
            "ReducedBasis",
            "Output",
        ];
        for element in root.children().filter(|child| child.is_element()) {
            let name = element.tag_name().name();
            if !known.contains(&name) && !CONTACT.contains(&name) {
                missing.push(format!("<{name}> of line {} (unknown)", line(element)));
            }
        }
    }
}

/// Elements that are about contact.
const CONTACT: [&str; 5] =
    ["ContactPlate", "ContactCylinder", "ContactUSProbe", "KinematicContact", "ContactSurface"];

fn mixed(of: XmlElement<'_>, first: geometry::Solid, other: geometry::Solid) -> Fault {
    let what = format!("this submodel has elements {}, an earlier one {}", other.name(), first.name());
    let problem = ImportProblem::Contradiction { what, remedy: "use one type of element in all submodels" };
    fault(of, problem)
}

fn renumbered(mut condition: Condition, map: &[u32]) -> Condition {
    let new = |node: &u32| map[*node as usize];
    condition.nodes = sorted(condition.nodes.iter().map(new).collect());
    condition.faces = renumbered_faces(&condition.faces, map);
    condition
}

fn renumbered_faces(faces: &[Vec<u32>], map: &[u32]) -> Vec<Vec<u32>> {
    faces.iter().map(|face| face.iter().map(|&node| map[node as usize]).collect()).collect()
}

/// Material and density of each cell, as far as they are known.
struct Sets(Vec<Option<(u32, f64)>>);

impl Sets {
    fn new(geometry: &Geometry) -> Self {
        Self(vec![None; geometry.cell_count()])
    }

    /// Reads all `<ElementSet>` of a model or submodel.
    fn read(&mut self, of: XmlElement<'_>, model: &mut Model) -> Result<(), Fault> {
        let limit = self.0.len();
        for set in children(of, "ElementSet") {
            let members = match attribute(set, "Size", "Size=\"all\" or a number")? {
                "all" => (0..limit as u32).collect(),
                word => {
                    let size = count(set, word)?;
                    let listed = indices(set, "element", limit)?;
                    run_of_indices(set, listed, size, "element", "elements", limit)?
                }
            };
            let of = needed(set, "Material", "<Material Type=\"NH\">…</Material>")?;
            let (material, stated) = Material::read(of)?;
            let density = match stated.or(model.system.density) {
                Some(density) => density,
                None => {
                    let (wanted, example) = ("Density", "<Density>1000</Density> here or in <SystemParams>");
                    return Err(fault(of, ImportProblem::MissingElement { wanted, example }));
                }
            };
            let known = model.materials.iter().position(|known| *known == material);
            let index = known.unwrap_or_else(|| {
                model.materials.push(material);
                model.materials.len() - 1
            });
            for member in members {
                if self.0[member as usize].replace((index as u32, density)).is_some() {
                    let what = format!("element {member} is in two sets");
                    let problem = ImportProblem::Contradiction { what, remedy: "keep it in one set" };
                    return Err(fault(set, problem));
                }
            }
        }
        Ok(())
    }

    fn finish(self, of: XmlElement<'_>) -> Result<(Vec<u32>, Vec<f64>), Fault> {
        let without = self.0.iter().filter(|cell| cell.is_none()).count();
        if let Some(first) = self.0.iter().position(Option::is_none) {
            let what =
                format!("{without} elements are in no <ElementSet>, the first of them element {first}");
            let remedy = "give every element a material";
            return Err(fault(of, ImportProblem::Contradiction { what, remedy }));
        }
        Ok(self.0.into_iter().flatten().unzip())
    }
}

impl Output {
    fn read(root: XmlElement<'_>) -> Result<Option<Self>, Fault> {
        let Some(of) = child(root, "Output") else { return Ok(None) };
        let every = count(of, attribute(of, "Freq", "Freq=\"100\" (steps)")?)?;
        let variables: Vec<String> = children(of, "Variable").map(text).collect();
        for (variable, element) in variables.iter().zip(children(of, "Variable")) {
            if !["U", "F", "S", "E", "EKin", "EStrain"].contains(&variable.as_str()) {
                let (what, known) = ("output", "U, F, S, E, EKin, EStrain");
                return Err(fault(element, ImportProblem::Unknown { what, found: variable.clone(), known }));
            }
        }
        Ok((every > 0).then_some(Self { every, variables }))
    }
}
