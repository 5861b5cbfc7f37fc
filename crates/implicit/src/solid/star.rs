//! The averaged pressures of `tet4-anp` (Bonet and Burton 1998): J_n = Σ V_e J_e/Σ V_e over the tets at a
//! node, p_n = U′(J_n). The energy Σ V_n U(J_n) with V_n = Σ V_e/4 couples all nodes of the tets at a node,
//! its star. It adds c ⊗ c U″(J_n)/V_n with c = Σ V_e/4 cof F B_a.

use pliant_mechanics::law::AnyLaw;
use pliant_mechanics::model::{Averaging, CellBlock, Cells, LocalNodes, Solid};
use pliant_mechanics::tensor::Vector;

use super::{add_dyad, add_volume_change, gradient, moved, volume_change};

/// The stars of a solid of tets with averaged pressure.
pub(crate) struct Stars {
    local: LocalNodes,
    /// The nodes of each star, numbered in the model, increasing.
    pub(crate) nodes: Vec<Vec<u32>>,
    /// V_n [m³].
    volume: Vec<f64>,
    /// p_n [Pa] and U″(J_n)/V_n [Pa/m³].
    pressure: Vec<[f64; 2]>,
}

impl Stars {
    /// Finds the stars of a solid; `None` if its element does not average pressures over nodes.
    pub(crate) fn of(solid: &Solid) -> Option<Self> {
        let Cells::AveragedTet4(block, Averaging::Nodal) = &solid.cells else { return None };
        let local = LocalNodes::new(block);
        let star = |node: usize| {
            let mut nodes: Vec<u32> = local.cells_at(node).flat_map(|cell| block.nodes[cell]).collect();
            nodes.sort_unstable();
            nodes.dedup();
            nodes
        };
        let volume = |node: usize| local.cells_at(node).map(|cell| 0.25 * block.rest[cell].volume).sum();
        Some(Self {
            nodes: (0..local.len()).map(star).collect(),
            volume: (0..local.len()).map(volume).collect(),
            pressure: vec![[0.0; 2]; local.len()],
            local,
        })
    }

    /// Finds the pressures at a state; their energy [J].
    pub(crate) fn find(&mut self, solid: &Solid, displacement: impl Fn(u32) -> Vector<f64>) -> f64 {
        let Cells::AveragedTet4(block, _) = &solid.cells else { return 0.0 };
        let law: &AnyLaw = &solid.material.law;
        let share = |cell: usize| {
            let u = moved(block, cell, &displacement);
            0.25 * block.rest[cell].volume * volume_change(&gradient(&u, &block.rest[cell].gradient))
        };
        let shares: Vec<f64> = (0..block.nodes.len()).map(share).collect();
        let mut energy = 0.0;
        for (node, (pressure, &volume)) in self.pressure.iter_mut().zip(&self.volume).enumerate() {
            let change = self.local.cells_at(node).map(|cell| shares[cell]).sum::<f64>() / volume;
            let [first, second] = law.volume_pressures(change);
            *pressure = [first, second / volume];
            energy += volume * law.volume_energy(change);
        }
        energy
    }

    /// The mean pressure of a cell's nodes [Pa].
    pub(crate) fn pressure(&self, cell: usize) -> f64 {
        0.25 * self.local.nodes[cell].iter().map(|&node| self.pressure[node as usize][0]).sum::<f64>()
    }

    /// The stiffness of a star over its nodes, column by column.
    pub(crate) fn stiffness(
        &self,
        star: usize,
        solid: &Solid,
        displacement: impl Fn(u32) -> Vector<f64>,
        tangent: &mut Vec<f64>,
    ) {
        let Cells::AveragedTet4(block, _) = &solid.cells else { return };
        let nodes = &self.nodes[star];
        let mut changes = vec![[0.0; 3]; nodes.len()];
        for cell in self.local.cells_at(star) {
            self.add_cell(block, cell, nodes, &displacement, &mut changes);
        }
        let size = 3 * nodes.len();
        tangent.clear();
        tangent.resize(size * size, 0.0);
        add_dyad(tangent, changes.as_flattened(), self.pressure[star][1]);
    }

    fn add_cell(
        &self,
        block: &CellBlock<4>,
        cell: usize,
        nodes: &[u32],
        displacement: impl Fn(u32) -> Vector<f64>,
        changes: &mut [Vector<f64>],
    ) {
        let u = moved(block, cell, displacement);
        let rest = &block.rest[cell];
        let mut cell_changes = [[0.0; 3]; 4];
        add_volume_change(
            &mut cell_changes,
            &gradient(&u, &rest.gradient),
            &rest.gradient,
            0.25 * rest.volume,
        );
        for (node, change) in block.nodes[cell].iter().zip(cell_changes) {
            // Every node of a cell at the star's node is of the star.
            if let Ok(at) = nodes.binary_search(node) {
                changes[at] = pliant_mechanics::tensor::add(changes[at], change);
            }
        }
    }
}
