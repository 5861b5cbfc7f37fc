//! Mass scaling: mass for the nodes that limit the critical time step.
//!
//! *Which nodes.* Consider a cell of volume V and modulus M = λ+2μ. By Cauchy and Schwarz, v·K_e v ≤ V M
//! (Σ_a |B_a| |v_a|)² ≤ Σ_a k_a |v_a|². Here k_a = V M |B_a| Σ_b |B_b|. Summed over the cells, k_a is the
//! stiffness of a node, and Δt_a = 2/√(k_a/m_a) is its nodal time step. No assembly is unstable below the
//! smallest one (Gershgorin). OpenRadioss uses the same nodal time step (`/DT/NODA`). A node whose nodal time
//! step is below a threshold T gets the mass k_a T²/4. Neighbours count: a sliver between large cells needs
//! less than alone.
//!
//! *How much.* The assembled model is stable at 1.3 to 2 times the smallest nodal time step. So a bisection
//! searches the threshold that brings the critical time step of the assembled model to the target.

use pliant_mechanics::model::{Contradiction, FREE, MassScaling, Model, Solid, with_cells};
use pliant_mechanics::tensor::dot;

use crate::critical_step::assembled_about;

/// Relative tolerance of a search for the smallest threshold, if each look needs the critical time step …
const STEP_TOLERANCE: f64 = 0.01;
/// … and where it needs a sum over the nodes.
const SHARE_TOLERANCE: f64 = 1e-9;

/// Target of mass scaling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// The critical time step of the assembled model [s], with little more mass than it needs.
    TargetStep(f64),
    /// Added mass over the mass of the materials.
    Share(f64),
}

/// Adds mass to the nodes that limit the critical time step at rest, once solids and constraints are there.
/// Added mass counts for inertia only, and with it for mass-proportional damping. Loads and gravity act on
/// the mass of the material, so that equilibria and their reactions stay the same. A goal already reached
/// adds nothing.
///
/// # Errors
/// If constraints contradict each other.
pub fn scale_mass(model: &mut Model, goal: Goal) -> Result<(), Contradiction> {
    let owners = model.constrained_components()?;
    let at_rest = vec![[0.0; 3]; model.node_count()];
    model.mass_scaling = None;
    let unscaled_critical_step = assembled_about(model, &owners, &at_rest).step;
    let nodes = NodalSteps::of(model, &owners);
    let scaling = |threshold: f64| MassScaling { unscaled_critical_step, added: nodes.added(threshold) };
    let threshold = match goal {
        Goal::TargetStep(target) if unscaled_critical_step < target => {
            let is_reached = |threshold: f64| {
                model.mass_scaling = Some(scaling(threshold));
                assembled_about(model, &owners, &at_rest).step >= target
            };
            nodes.threshold_of_step(target, is_reached)
        }
        Goal::TargetStep(_) => 0.0,
        Goal::Share(share) => nodes.threshold_of_share(share),
    };
    model.mass_scaling = Some(scaling(threshold));
    Ok(())
}

/// Data for the nodal time steps, one entry per node.
struct NodalSteps {
    /// Mass of the material [kg].
    mass: Vec<f64>,
    /// k_a [N/m]; 0 where a node is held along all axes, has no mass or no cells.
    stiffness: Vec<f64>,
}

impl NodalSteps {
    fn of(model: &Model, owners: &[[u32; 3]]) -> Self {
        let mut stiffness = vec![0.0; model.node_count()];
        model.solids.iter().for_each(|solid| add_stiffness(solid, &mut stiffness));
        model.give_down_stiffness(&mut stiffness);
        for ((stiffness, mass), owner) in stiffness.iter_mut().zip(&model.mass).zip(owners) {
            if !owner.contains(&FREE) || *mass <= 0.0 {
                *stiffness = 0.0;
            }
        }
        Self { mass: model.mass.clone(), stiffness }
    }

    /// The smallest nodal time step [s], the largest threshold that adds nothing; 0 if no node can move.
    fn smallest(&self) -> f64 {
        let steps = self.mass.iter().zip(&self.stiffness).filter(|(_, k)| **k > 0.0);
        steps.map(|(m, k)| 2.0 * (m / k).sqrt()).reduce(f64::min).unwrap_or(0.0)
    }

    /// The mass [kg] that each node needs for a nodal time step [s].
    fn added(&self, threshold: f64) -> Vec<f64> {
        let needed = |k: f64| k * threshold * threshold / 4.0;
        self.mass.iter().zip(&self.stiffness).map(|(m, &k)| (needed(k) - m).max(0.0)).collect()
    }

    /// The smallest threshold [s] found at which a target [s] is reached.
    fn threshold_of_step(&self, target: f64, mut is_reached: impl FnMut(f64) -> bool) -> f64 {
        // By Gershgorin the target is enough itself; cells whose modulus is no bound may need more.
        let mut enough = target;
        while !is_reached(enough) {
            enough *= 2.0;
        }
        narrowed([self.smallest(), enough], STEP_TOLERANCE, is_reached)[1]
    }

    /// The largest threshold [s] that adds no more than a share of all mass.
    fn threshold_of_share(&self, share: f64) -> f64 {
        let (mass, stiffness): (f64, f64) = (self.mass.iter().sum(), self.stiffness.iter().sum());
        if stiffness == 0.0 {
            return 0.0;
        }
        // For this one all nodes together need that share at least.
        let enough = 2.0 * ((1.0 + share) * mass / stiffness).sqrt();
        let is_beyond = |threshold: f64| self.added(threshold).iter().sum::<f64>() > share * mass;
        narrowed([self.smallest(), enough], SHARE_TOLERANCE, is_beyond)[0]
    }
}

/// Adds k_a [N/m] of every cell of a solid at rest. Hourglass control adds c μ V Σ|B|² at most, as its
/// patterns are orthogonal to the rest. If it grows with the law, the watch over the step looks at both.
fn add_stiffness(solid: &Solid, stiffness: &mut [f64]) {
    let modulus = solid.longitudinal_modulus();
    with_cells!(&solid.cells, block => {
        for (cell, (nodes, rest)) in block.nodes.iter().zip(&block.rest).enumerate() {
            let norms = rest.gradient.map(|b| dot(b, b).sqrt());
            let sum: f64 = norms.iter().sum();
            let hourglass = solid.cells.hourglass_modulus(cell) * rest.gradient_square_sum();
            for (&node, norm) in nodes.iter().zip(norms) {
                stiffness[node as usize] += rest.volume * (modulus * norm * sum + hourglass);
            }
        }
    });
}

/// An interval of thresholds within a tolerance, at whose second end alone something holds, from a wider one.
fn narrowed([mut low, mut high]: [f64; 2], tolerance: f64, mut holds: impl FnMut(f64) -> bool) -> [f64; 2] {
    while high > (1.0 + tolerance) * low {
        let middle = (low * high).sqrt();
        if holds(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    [low, high]
}
