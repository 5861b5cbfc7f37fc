//! Shells of the literature: a sheet becomes a model, its edges are held and loaded by name.

use std::collections::BTreeMap;

use pliant_geometry::{Mesh, Vector3};
use pliant_implicit::{Assembly, Shell, State, StaticSettings, Statics};
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::load::{Load, LoadKind};
use pliant_mechanics::model::{Constraint, Motion};
use pliant_meshing::{DEFAULT_CELL_LIMIT, Pattern, Sheet};
use pliant_shells::element::Wall;
use pliant_shells::element::{Bending, Elasticity, Formulation, Membrane};

use crate::CaseError;

/// Components fixed at a clamped edge.
pub const CLAMPED: [bool; 6] = [true; 6];

/// The thesis's element, its typing errors put right: constant strain in the plane with hardly any resistance
/// to drilling, and its bending.
pub const THESIS: Formulation =
    Formulation { membrane: Membrane::Cst { drilling: 1e-3 }, bending: Bending::Comas2010 };

/// The element with the flat ANDES membrane, as in the prototype.
pub const FLAT: Formulation =
    Formulation { membrane: Membrane::Opt { adaptation: 10.0 }, bending: Bending::Dkt };

/// A shell of one thickness with its mesh.
#[derive(Clone, Debug)]
pub struct Specimen {
    /// Its mesh, for names and places of nodes.
    pub mesh: Mesh,
    /// Its model.
    pub model: Assembly,
}

/// Components held on a plane of symmetry with this normal (0, 1, 2): the displacement along the normal and
/// the spins about the other axes.
pub fn symmetry(axis: usize) -> [bool; 6] {
    std::array::from_fn(|c| (c % 3 == axis) == (c < 3))
}

/// Curve whose factor grows from 0 to 1 over the time from 0 to 1.
pub fn ramp() -> Curve {
    Curve { shape: Shape::Ramp, from: 0.0, to: 1.0 }
}

/// The triangles of a mesh.
///
/// # Panics
/// If it has no triangles.
pub fn triangles(mesh: &Mesh) -> Vec<[u32; 3]> {
    mesh.blocks[0].nodes.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect()
}

/// The normals that a mesh gives to its nodes.
fn normals(mesh: &Mesh) -> BTreeMap<u32, Vector3> {
    let Some(data) = mesh.point_data.get("normal") else { return BTreeMap::new() };
    let of = |node: u32| (node, Vector3::from_row_slice(data.item(node as usize)));
    (0..mesh.points.len() as u32).map(of).collect()
}

/// A sheet with cells along its two axes.
///
/// # Errors
/// If it cannot be meshed so.
pub fn sheet(sheet: Sheet, counts: [usize; 2], pattern: Pattern) -> Result<Mesh, CaseError> {
    Ok(sheet.mesh(counts, pattern, None, DEFAULT_CELL_LIMIT)?)
}

impl Specimen {
    /// A shell of a mesh, curved by its normals (point data `normal`) if present; density 1000 kg/m³.
    ///
    /// # Errors
    /// If the mesh is not a valid shell.
    pub fn new(
        mesh: Mesh,
        [young, poisson]: [f64; 2],
        thickness: f64,
        formulation: Formulation,
    ) -> Result<Self, CaseError> {
        let material = Wall { elastic: Elasticity { young, poisson }, density: 1000.0 };
        let mut model = Assembly::new("shell", mesh.points.clone());
        model.add_shell(&Shell {
            formulation,
            normals: normals(&mesh),
            ..Shell::new("shell", triangles(&mesh), thickness, material)
        })?;
        Ok(Self { mesh, model })
    }

    /// The nodes of an edge, in order.
    ///
    /// # Panics
    /// If the edge does not exist.
    pub fn edge(&self, name: &str) -> Vec<u32> {
        self.mesh.point_sets.get(name).unwrap_or_else(|| panic!("no edge {name}")).clone()
    }

    /// The node nearest to a place.
    pub fn node(&self, x: f64, y: f64, z: f64) -> u32 {
        let place = Vector3::new(x, y, z);
        let nodes = 0..self.mesh.points.len() as u32;
        let distance = |node: &u32| (self.mesh.points[*node as usize] - place).norm();
        nodes.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
    }

    /// Holds components of nodes.
    #[must_use]
    pub fn prescribe(mut self, nodes: Vec<u32>, components: [bool; 6]) -> Self {
        let name = format!("constraint {}", self.model.constraints.len());
        self.model.model_mut().constraints.push(Constraint {
            name,
            nodes,
            components,
            motion: Motion::Fixed,
        });
        self
    }

    /// Holds components of an edge.
    #[must_use]
    pub fn prescribe_edge(self, edge: &str, components: [bool; 6]) -> Self {
        let nodes = self.edge(edge);
        self.prescribe(nodes, components)
    }

    /// A load that grows with time from 0 to 1.
    #[must_use]
    pub fn load(mut self, kind: LoadKind) -> Self {
        let name = format!("load {}", self.model.loads.len());
        self.model.model_mut().loads.push(Load::new(&name, kind, ramp()));
        self
    }

    /// A force on one node.
    #[must_use]
    pub fn pull(self, node: u32, force: [f64; 3]) -> Self {
        self.load(LoadKind::force(vec![node], force))
    }

    /// A force along an edge, evenly per length.
    #[must_use]
    pub fn pull_edge(self, edge: &str, total: [f64; 3]) -> Self {
        let nodes = self.edge(edge);
        let edges: Vec<[u32; 2]> = nodes.windows(2).map(|pair| [pair[0], pair[1]]).collect();
        let length: f64 = edges
            .iter()
            .map(|[a, b]| (self.mesh.points[*a as usize] - self.mesh.points[*b as usize]).norm())
            .sum();
        let kind = self.model.edge_load(&edges, Vector3::from(total) / length);
        self.load(kind)
    }

    /// A force per area everywhere.
    #[must_use]
    pub fn cover(self, traction: [f64; 3]) -> Self {
        let facets: Vec<u32> = (0..self.model.facets.len() as u32).collect();
        let kind = self.model.area_load(&facets, traction.into());
        self.load(kind)
    }

    /// Displacement and rotation of a node by linear theory at full load.
    ///
    /// # Errors
    /// If the stiffness is singular.
    pub fn linear(&self, node: u32) -> Result<[f64; 6], CaseError> {
        let mut solver = Statics::new(self.model.clone(), StaticSettings::default())?;
        Ok(solver.linear(&State::at_rest(&self.model), 1.0)?[node as usize])
    }
}
