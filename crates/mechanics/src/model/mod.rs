//! The model: everything constant, built once and shared between threads. Arrays are in the order of the
//! nodes, all bodies one after another.

mod cells;
mod constraint;

use std::borrow::Cow;
use std::ops::Range;

use crate::element::Cord;
use crate::law::AnyLaw;
use crate::load::{Load, LoadKind};
use crate::mapping::{Displaced, Weights};
use crate::order::order;
use crate::prony::Prony;
use crate::tensor::{Vector, add, dot, scale};
use crate::tie::Tie;

pub use self::cells::{Averaging, CellBlock, Cells, Hourglass, LocalNodes};
pub use self::constraint::{Amplitudes, Constraint, Enclosed, Enclosure, Motion, component, fill, placed};
pub use crate::with_cells;

/// Bodies, what holds and loads them, and the surfaces they carry.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Rest positions [m] of the nodes.
    pub rest: Vec<Vector<f64>>,
    /// Lumped masses [kg] of the nodes, from their materials.
    pub mass: Vec<f64>,
    /// The bodies.
    pub bodies: Vec<Body>,
    /// The solid parts: one per body, element and law.
    pub solids: Vec<Solid>,
    /// Prescribed motions.
    pub constraints: Vec<Constraint>,
    /// Loads.
    pub loads: Vec<Load>,
    /// Surfaces carried by bodies.
    pub surfaces: Vec<Surface>,
    /// Nodes that follow others.
    pub ties: Vec<Tie>,
    /// Stiffness-proportional damping β [s].
    pub stiffness_damping: f64,
    /// Mass added for a larger stable step.
    pub mass_scaling: Option<MassScaling>,
    /// Velocities [m/s] of the nodes at time 0, for dynamics; nodes beyond its end are at rest.
    pub initial_velocity: Vec<Vector<f64>>,
}

/// Mass that is added to nodes for a larger critical time step; `pliant-explicit` finds it
/// (`mass_scaling.rs`).
#[derive(Clone, Debug, PartialEq)]
pub struct MassScaling {
    /// The critical time step of the assembled model without it [s].
    pub unscaled_critical_step: f64,
    /// Mass added to each node [kg].
    pub added: Vec<f64>,
}

impl MassScaling {
    /// Added mass in all [kg].
    pub fn total(&self) -> f64 {
        self.added.iter().sum()
    }

    /// Number of nodes with added mass.
    pub fn nodes(&self) -> usize {
        self.added.iter().filter(|&&added| added > 0.0).count()
    }
}

/// A body.
#[derive(Clone, Debug)]
pub struct Body {
    /// Its name.
    pub name: String,
    /// Its nodes, without shared ones.
    pub nodes: Range<u32>,
    /// The nodes of other bodies that its cells use, numbered in the model: the nodes of a wall on the
    /// boundary of a solid.
    pub shared: Vec<u32>,
    /// Mass-proportional damping α [1/s].
    pub damping: f64,
}

impl Body {
    /// Returns the model's number of a node of its mesh: first the body's nodes, then the shared ones.
    pub fn node(&self, index: u32) -> u32 {
        let own_count = self.nodes.len() as u32;
        if index < own_count { self.nodes.start + index } else { self.shared[(index - own_count) as usize] }
    }

    /// The nodes of its mesh, numbered in the model.
    pub fn all_nodes(&self) -> impl Iterator<Item = u32> + '_ {
        self.nodes.clone().chain(self.shared.iter().copied())
    }
}

/// A law with its history, and the density.
#[derive(Clone, Debug)]
pub struct Material {
    /// The elastic law.
    pub law: AnyLaw,
    /// Its relaxation.
    pub prony: Prony,
    /// Mass per reference volume [kg/m³].
    pub density: f64,
}

impl Material {
    /// A law without relaxation, and the density [kg/m³].
    pub fn elastic(law: AnyLaw, density: f64) -> Self {
        Self { law, prony: Prony::default(), density }
    }
}

/// The cells of one body that share an element and a material.
#[derive(Clone, Debug)]
pub struct Solid {
    /// The body.
    pub body: usize,
    /// The material.
    pub material: Material,
    /// The cells with their element.
    pub cells: Cells,
    /// Unit fibre directions at rest, cell by cell as many as the law has families.
    pub fibre: Vec<Vector<f64>>,
    /// The number of each cell in the user's mesh, counted over the cells of its kind.
    pub original: Vec<u32>,
}

impl Solid {
    /// Cells of a body without fibres, in the order of the user's mesh.
    pub fn new(body: usize, material: Material, cells: Cells) -> Self {
        let original = (0..cells.len() as u32).collect();
        Self { body, material, cells, fibre: Vec::new(), original }
    }

    /// The directions of the families of fibres in a cell, at rest.
    pub fn fibres(&self, cell: usize) -> &[Vector<f64>] {
        let families = self.material.law.families();
        &self.fibre[cell * families..(cell + 1) * families]
    }

    /// Returns the directions of the families of fibres in a cell as its law sees them. These are the
    /// directions at rest; in a membrane they are within the frame of the triangle.
    pub fn law_fibres(&self, cell: usize) -> Cow<'_, [Vector<f64>]> {
        let Cells::Membrane(_, sheets) = &self.cells else { return Cow::Borrowed(self.fibres(cell)) };
        let sheet = &sheets[cell];
        let in_plane = |&fibre: &Vector<f64>| {
            let [along, across] = sheet.axes.map(|axis| dot(fibre, axis));
            let length = along.hypot(across);
            [along / length, across / length, 0.0]
        };
        Cow::Owned(self.fibres(cell).iter().map(in_plane).collect())
    }

    /// An upper bound of ρc² [Pa] at rest; a membrane has its bound in plane stress, a bar in uniaxial
    /// stress.
    pub fn longitudinal_modulus(&self) -> f64 {
        match &self.cells {
            Cells::Membrane(..) => self.material.law.plane_modulus(),
            Cells::Bar(_, cord) => self.material.law.small_strain().young() / cord.slack,
            _ => self.material.law.longitudinal_modulus(),
        }
    }

    /// Shear modulus at rest [Pa]. The shear modulus of a state over this value is the factor on the
    /// hourglass stiffness. `None` where that stiffness is constant.
    pub fn hourglass_growth(&self) -> Option<f64> {
        let Cells::Hex8(CellBlock { hourglass: Some(control), .. }) = &self.cells else { return None };
        let law = &self.material.law;
        (control.grows && !law.keeps_shear_stiffness()).then(|| law.small_strain().shear)
    }

    /// Adds ρV/N [kg] of every cell to the masses of its nodes.
    pub fn add_mass(&self, mass: &mut [f64]) {
        for cell in 0..self.cells.len() {
            let nodes = self.cells.nodes(cell);
            let share = self.material.density * self.cells.volume(cell) / nodes.len() as f64;
            nodes.iter().for_each(|&node| mass[node as usize] += share);
        }
    }

    /// Returns the solid with neighbouring cells one after another.
    fn in_order(self, rest: &[Vector<f64>]) -> Self {
        let centre = |cell: usize| {
            let nodes = self.cells.nodes(cell);
            nodes.iter().fold([0.0; 3], |sum, &n| add(sum, scale(rest[n as usize], 1.0 / nodes.len() as f64)))
        };
        let centres: Vec<Vector<f64>> = (0..self.cells.len()).map(centre).collect();
        let order = order(&centres);
        Self {
            fibre: order.iter().flat_map(|&cell| self.fibres(cell as usize)).copied().collect(),
            original: order.iter().map(|&cell| self.original[cell as usize]).collect(),
            cells: self.cells.in_order(&order),
            ..self
        }
    }
}

/// The values of some cells, one after another.
fn picked<T: Clone>(values: &[T], cells: &[u32]) -> Vec<T> {
    cells.iter().map(|&cell| values[cell as usize].clone()).collect()
}

/// Least filled fraction of a cell: nodes that hang on slivers alone would move wildly.
pub const LEAST_FRACTION: f64 = 0.1;

/// A surface carried by a body.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Its name.
    pub name: String,
    /// The body that carries it.
    pub body: usize,
    /// Rest positions [m] of its points.
    pub rest: Vec<Vector<f64>>,
    /// Weights of the body's nodes (numbered in the model) for each point.
    pub mapping: Weights,
}

/// Two constraints, or a constraint and a tie, that ask for different things of one node.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("`{first}` and `{second}` both prescribe {} of node {node} of `{body}`, and differently", COMPONENTS[*component])]
pub struct Contradiction {
    /// The first constraint.
    pub first: String,
    /// The second constraint.
    pub second: String,
    /// The body.
    pub body: String,
    /// The node, numbered in its body.
    pub node: u32,
    /// 0 to 5 for x, y, z and the rotations about them.
    pub component: usize,
}

/// Components of nodes in words.
const COMPONENTS: [&str; 6] =
    ["x", "y", "z", "the rotation about x", "the rotation about y", "the rotation about z"];

/// No constraint on a component of a node.
pub const FREE: u32 = u32::MAX;

impl Model {
    /// Adds a body of nodes at rest [m], without mass or damping; its number. Solids give it cells and mass,
    /// constraints hold it.
    ///
    /// ```
    /// use pliant_mechanics::Model;
    /// use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
    /// use pliant_mechanics::load::Load;
    /// use pliant_mechanics::model::{Cells, Material, Solid};
    ///
    /// let mut model = Model::default();
    /// let corners = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]];
    /// let tet = model.add_body("tet", &corners);
    /// let volumetric = Volumetric::quadratic(10_000.0);
    /// let law = AnyLaw::NeoHookean(NeoHookean { shear: 1000.0, volumetric });
    /// let cells = Cells::tet4(vec![[0, 1, 2, 3]], &model.rest);
    /// model.add_solid(Solid::new(tet, Material::elastic(law, 1000.0), cells));
    /// model.fix("base", vec![0, 1, 2]);
    /// model.loads.push(Load::gravity(tet, [0.0, 0.0, -9.81]));
    /// assert!((model.mass.iter().sum::<f64>() - 1000.0 * 0.1_f64.powi(3) / 6.0).abs() < 1e-12);
    /// ```
    pub fn add_body(&mut self, name: &str, rest: &[Vector<f64>]) -> usize {
        let first = self.rest.len() as u32;
        self.rest.extend_from_slice(rest);
        self.mass.resize(self.rest.len(), 0.0);
        let nodes = first..self.rest.len() as u32;
        self.bodies.push(Body { name: name.into(), nodes, shared: Vec::new(), damping: 0.0 });
        self.bodies.len() - 1
    }

    /// Adds a body on nodes that other bodies have, such as a wall on the boundary of a solid. Returns its
    /// number. The nodes still belong to the other bodies, which set their damping, gravity and initial
    /// velocity.
    pub fn add_body_on(&mut self, name: &str, shared: Vec<u32>) -> usize {
        let body = self.add_body(name, &[]);
        self.bodies[body].shared = shared;
        body
    }

    /// Fixes nodes where they are at rest; the number of the constraint.
    pub fn fix(&mut self, name: &str, nodes: Vec<u32>) -> usize {
        self.constrain(name, nodes, Motion::Fixed)
    }

    /// Prescribes the motion of nodes along all axes; the number of the constraint.
    pub fn constrain(&mut self, name: &str, nodes: Vec<u32>, motion: Motion) -> usize {
        self.constraints.push(Constraint { name: name.into(), nodes, components: [true; 6], motion });
        self.constraints.len() - 1
    }

    /// Adds ρV/N of every cell of a solid to its nodes. The cells are brought into an order that is good for
    /// the caches; [`Solid::original`] goes along.
    ///
    /// # Panics
    /// If not every cell has a direction for each of the law's families of fibres.
    pub fn add_solid(&mut self, solid: Solid) {
        let needed = solid.material.law.families() * solid.cells.len();
        assert_eq!(solid.fibre.len(), needed, "every cell has a direction for each family of fibres");
        let solid = solid.in_order(&self.rest);
        solid.add_mass(&mut self.mass);
        self.solids.push(solid);
    }

    /// The mass [kg] with which a node resists acceleration: the mass of the material and the mass that
    /// scaling adds.
    pub fn inertia(&self, node: usize) -> f64 {
        self.mass[node] + self.mass_scaling.as_ref().map_or(0.0, |scaling| scaling.added[node])
    }

    /// Returns the model with all threads taut: its vibrations are the fastest that they allow.
    pub fn with_taut_threads(&self) -> Cow<'_, Self> {
        let is_thread = |solid: &Solid| matches!(solid.cells, Cells::Bar(_, Cord { tension_only: true, .. }));
        if !self.solids.iter().any(is_thread) {
            return Cow::Borrowed(self);
        }
        let mut taut = self.clone();
        for solid in &mut taut.solids {
            if let Cells::Bar(_, cord) = &mut solid.cells {
                cord.tension_only = false;
            }
        }
        Cow::Owned(taut)
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.rest.len()
    }

    /// Number of cells.
    pub fn cell_count(&self) -> usize {
        self.solids.iter().map(|solid| solid.cells.len()).sum()
    }

    /// The body that a node is of and the node's number in it.
    pub fn locate_node(&self, node: u32) -> (usize, u32) {
        let body = self.bodies.partition_point(|body| body.nodes.end <= node);
        (body, node - self.bodies[body].nodes.start)
    }

    /// The forces [N] of loads on each node at a time [s] and displacements [m], without weights and without
    /// what only shells take.
    pub fn load_forces(&self, time: f64, displacement: &[Vector<f64>]) -> Vec<Vector<f64>> {
        let state = Displaced { rest: &self.rest, displacement, velocity: &[] };
        let mut forces = vec![[0.0; 3]; self.node_count()];
        for load in &self.loads {
            let points = load.surface.map(|surface| &self.surfaces[surface].mapping);
            load.add_forces(time, points, &state, &mut forces);
        }
        forces
    }

    /// The weight [N] of each node at a time [s].
    pub fn weights(&self, time: f64) -> Vec<Vector<f64>> {
        let mut weights = vec![[0.0; 3]; self.node_count()];
        for load in &self.loads {
            let LoadKind::Gravity { body, acceleration } = load.kind else { continue };
            let acceleration = scale(acceleration, load.curve.value(time));
            for node in self.bodies[body].nodes.clone() {
                let weight = &mut weights[node as usize];
                *weight = add(*weight, scale(acceleration, self.mass[node as usize]));
            }
        }
        weights
    }

    /// Returns the constraint on each component of each node; [`FREE`] marks a component without constraint.
    /// Two constraints may prescribe the same motion of a component (the first keeps the reaction).
    ///
    /// # Errors
    /// If two constraints prescribe different motions for one component of a node.
    pub fn constrained_components(&self) -> Result<Vec<[u32; 3]>, Contradiction> {
        let mut owners = vec![[FREE; 3]; self.node_count()];
        let mut amplitudes = vec![[[0.0; 2]; 3]; self.node_count()];
        let alone = |(_, constraint): &(usize, &Constraint)| !constraint.motion.is_collective();
        for (index, constraint) in self.constraints.iter().enumerate().filter(alone) {
            for (&node, given) in constraint.nodes.iter().zip(constraint.amplitudes()) {
                for component in (0..3).filter(|&c| constraint.components[c]) {
                    let amplitude = self::component(&given, component);
                    let owner = &mut owners[node as usize][component];
                    let known = &mut amplitudes[node as usize][component];
                    if *owner == FREE {
                        (*owner, *known) = (index as u32, amplitude);
                        continue;
                    }
                    let first = &self.constraints[*owner as usize];
                    let still = *known == [0.0; 2];
                    if *known != amplitude || !(still || first.motion.follows(&constraint.motion)) {
                        return Err(self.contradiction([*owner, index as u32], node, component));
                    }
                }
            }
        }
        self.check_rotations()?;
        let bound = self.check_collective(&owners)?;
        for tie in &self.ties {
            for (&node, held) in tie.nodes.iter().zip(&tie.held) {
                let alone = owners[node as usize].into_iter().zip(0..).filter(|&(_, c)| !held[c]);
                let owned = alone.chain([(bound[node as usize], 0)]);
                if let Some((first, component)) = owned.into_iter().find(|&(first, _)| first != FREE) {
                    let first = self.constraints[first as usize].name.clone();
                    let (body, node) = self.locate_node(node);
                    let (second, body) = (tie.name.clone(), self.bodies[body].name.clone());
                    return Err(Contradiction { first, second, body, node, component });
                }
            }
        }
        Ok(owners)
    }

    /// The first constraint that binds nodes to each other: no GPU and no explicit shell holds them.
    pub fn collective(&self) -> Option<&Constraint> {
        self.constraints.iter().find(|constraint| constraint.motion.is_collective())
    }

    /// Returns the constraint that binds each node to others; [`FREE`] marks a node without one. A node has
    /// at most one such constraint, and no other constraint holds the node.
    fn check_collective(&self, owners: &[[u32; 3]]) -> Result<Vec<u32>, Contradiction> {
        let mut bound = vec![FREE; self.node_count()];
        for (index, constraint) in self.constraints.iter().enumerate() {
            for &node in constraint.nodes.iter().filter(|_| constraint.motion.is_collective()) {
                let known = std::mem::replace(&mut bound[node as usize], index as u32);
                let held = |c: usize| constraint.components[c] && owners[node as usize][c] != FREE;
                if known != FREE {
                    return Err(self.contradiction([known, index as u32], node, 0));
                }
                if let Some(component) = (0..3).find(|&c| held(c)) {
                    let owner = owners[node as usize][component];
                    return Err(self.contradiction([owner, index as u32], node, component));
                }
            }
        }
        Ok(bound)
    }

    /// Checks that no two constraints turn a node differently.
    fn check_rotations(&self) -> Result<(), Contradiction> {
        let turned = |constraint: &Constraint| constraint.components[3..].contains(&true);
        if !self
            .constraints
            .iter()
            .any(|constraint| turned(constraint) && matches!(constraint.motion, Motion::Turn { .. }))
        {
            return Ok(());
        }
        let mut owners = vec![[FREE; 3]; self.node_count()];
        for (index, constraint) in
            self.constraints.iter().enumerate().filter(|(_, constraint)| turned(constraint))
        {
            for &node in &constraint.nodes {
                for c in (0..3).filter(|&c| constraint.components[3 + c]) {
                    let owner = &mut owners[node as usize][c];
                    if *owner == FREE {
                        *owner = index as u32;
                    } else if !self.constraints[*owner as usize].motion.turns_as(&constraint.motion) {
                        return Err(self.contradiction([*owner, index as u32], node, 3 + c));
                    }
                }
            }
        }
        Ok(())
    }

    fn contradiction(&self, constraints: [u32; 2], node: u32, component: usize) -> Contradiction {
        let [first, second] = constraints.map(|index| self.constraints[index as usize].name.clone());
        let (body, node) = self.locate_node(node);
        Contradiction { first, second, body: self.bodies[body].name.clone(), node, component }
    }

    /// The amplitudes of the motion of each component that has an owner (see [`Motion::amplitudes`]); 0 for
    /// the others.
    pub fn amplitudes(&self, owners: &[[u32; 3]]) -> Vec<Amplitudes> {
        let mut amplitudes = vec![Amplitudes::default(); self.node_count()];
        for (index, constraint) in self.constraints.iter().enumerate() {
            for (&node, given) in constraint.nodes.iter().zip(constraint.amplitudes()) {
                for c in (0..3).filter(|&c| owners[node as usize][c] == index as u32) {
                    for (to, from) in amplitudes[node as usize].iter_mut().zip(given) {
                        to[c] = from[c];
                    }
                }
            }
        }
        amplitudes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::{Curve, Shape};

    /// Two constraints of one node: what holds it does not turn it, and turning it twice in the same way is
    /// no contradiction.
    #[test]
    fn nodes_are_turned_in_one_way_only() {
        let ramp = |to| Curve { shape: Shape::Ramp, from: 0.0, to };
        let turn = |angle: f64, to: f64| Motion::turn([0.0; 3], [0.0, angle, 0.0], 1, ramp(to));
        let with = |first: Motion, second: Motion| {
            let mut model = Model::default();
            model.add_body("wall", &[[0.0; 3], [1.0, 0.0, 0.0]]);
            for (name, motion) in [("clamp", first), ("hand", second)] {
                let components = [false, false, false, true, true, true];
                model.constraints.push(Constraint { name: name.into(), nodes: vec![1], components, motion });
            }
            model.constrained_components().map(|_| ())
        };
        for same in [Motion::Fixed, turn(0.3, 1.0)] {
            assert_eq!(with(same.clone(), same), Ok(()));
        }
        assert_eq!(with(Motion::Fixed, turn(0.0, 1.0)), Ok(()));
        for (first, second) in [
            (Motion::Fixed, turn(0.3, 1.0)),
            (turn(0.3, 1.0), turn(0.2, 1.0)),
            (turn(0.3, 1.0), turn(0.3, 2.0)),
        ] {
            let message = with(first, second).unwrap_err().to_string();
            let wanted =
                "`clamp` and `hand` both prescribe the rotation about x of node 1 of `wall`, and differently";
            assert_eq!(message, wanted);
        }
    }
}
