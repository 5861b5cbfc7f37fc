//! Forces on the nodes of a model at a state, and the energy of what makes them.

use nalgebra::Vector3;

use crate::model::assembly::Spring;
use crate::model::state::AssemblyState;

/// Forces and moments at the state last evaluated, six a node [N, N m].
pub(crate) struct NodalForces {
    /// Resistance of elements and springs.
    pub(crate) internal: Vec<f64>,
    /// Loads, without their controlled part.
    pub(crate) external: Vec<f64>,
    /// Loads for a factor of 1.
    pub(crate) controlled: Vec<f64>,
    /// Strain energy [J].
    pub(crate) energy: f64,
    /// Part of the strain energy in hourglass control [J].
    pub(crate) hourglass: f64,
    /// Largest force on a node of a cell [N].
    pub(crate) largest: f64,
    /// Springs that come and go between steps; their forces count as loads.
    held: Vec<Spring>,
    /// Forces [N] on nodes that come and go between steps.
    pushed: Vec<(u32, [f64; 3])>,
}

impl NodalForces {
    pub(super) fn new(nodes: usize) -> Self {
        let [internal, external, controlled] = [(); 3].map(|()| vec![0.0; 6 * nodes]);
        let (energy, hourglass, largest) = (0.0, 0.0, 0.0);
        let (held, pushed) = (Vec::new(), Vec::new());
        Self { internal, external, controlled, energy, hourglass, largest, held, pushed }
    }

    pub(super) fn clear(&mut self) {
        self.kinds().into_iter().for_each(|forces| forces.fill(0.0));
        (self.energy, self.hourglass, self.largest) = (0.0, 0.0, 0.0);
    }

    /// Internal forces, and fixed and controlled loads.
    pub(super) fn kinds(&mut self) -> [&mut [f64]; 3] {
        [&mut self.internal, &mut self.external, &mut self.controlled]
    }

    /// Resistance of a component beyond its loads at a factor of the controlled ones.
    pub(super) fn resisting(&self, component: usize, factor: f64) -> f64 {
        self.internal[component] - self.external[component] - factor * self.controlled[component]
    }

    /// Takes hold of nodes: only these springs act besides the springs of the model.
    pub(super) fn grip(&mut self, springs: &[Spring]) {
        self.held.clear();
        self.held.extend_from_slice(springs);
    }

    /// Takes forces [N] on nodes: they and no others act from now on.
    pub(super) fn push(&mut self, forces: &[(u32, [f64; 3])]) {
        self.pushed.clear();
        self.pushed.extend_from_slice(forces);
    }

    /// The springs that come and go between steps.
    pub(super) fn held(&self) -> &[Spring] {
        &self.held
    }

    /// Adds forces of a cell of a solid on its nodes.
    pub(super) fn add_cell(&mut self, nodes: &[u32], forces: &[f64]) {
        for (&node, force) in nodes.iter().zip(forces.chunks_exact(3)) {
            for (sum, force) in self.internal[6 * node as usize..].iter_mut().zip(force) {
                *sum += force;
                self.largest = self.largest.max(force.abs());
            }
        }
    }

    /// Adds forces of springs of the model, of those that come and go, and what pushes.
    pub(super) fn add_springs(&mut self, springs: &[Spring], state: &AssemblyState) {
        let stretched = |spring: &Spring| state.position[spring.node as usize] - spring.anchor;
        for spring in springs {
            let (at, stretch) = (6 * spring.node as usize, stretched(spring));
            self.energy += 0.5 * spring.stiffness * stretch.norm_squared();
            (0..3).for_each(|c| self.internal[at + c] += spring.stiffness * stretch[c]);
        }
        for spring in &self.held {
            let (at, stretch): (_, Vector3<f64>) = (6 * spring.node as usize, stretched(spring));
            (0..3).for_each(|c| self.external[at + c] -= spring.stiffness * stretch[c]);
        }
        for (node, force) in &self.pushed {
            let on_node = &mut self.external[6 * *node as usize..];
            on_node.iter_mut().zip(force).for_each(|(entry, force)| *entry += force);
        }
    }
}
