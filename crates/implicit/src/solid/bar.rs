//! A bar: f = A P t along t = (x₂ − x₁)/l, and K = ± (A P′/(λ₀ L) t⊗t + A P/l (1 − t⊗t)). λ₀ is the slack. A
//! bar under compression makes K indefinite, which the line search and the report of negative eigenvalues
//! handle as for membranes. A slack thread has no stiffness.

use pliant_mechanics::element::{Cord, Pull, Rest};
use pliant_mechanics::tensor::{Vector, scale, sub};

use super::{CellMaterial, Response, add_to};

impl Response {
    /// Adds a bar.
    pub(super) fn add_bar(
        &mut self,
        material: CellMaterial<'_>,
        u: &[Vector<f64>; 2],
        rest: &Rest<2>,
        cord: &Cord,
    ) {
        let pull = cord.pull(rest, sub(u[1], u[0]), material.law.small_strain().young());
        let Pull { along, length, stress: [stress, slope], .. } = pull;
        self.energy += cord.energy(rest, &pull);
        let force = scale(along, stress * rest.area());
        add_to(&mut self.force, 1, force);
        add_to(&mut self.force, 0, scale(force, -1.0));
        if !material.stiffness || length == 0.0 {
            return;
        }
        let stretching = slope * rest.area() / (cord.slack * rest.length());
        let turning = stress * rest.area() / length;
        for k in 0..3 {
            for i in 0..3 {
                let unit = if i == k { turning } else { 0.0 };
                let entry = unit + (stretching - turning) * along[i] * along[k];
                for (a, b, sign) in [(0, 0, 1.0), (1, 1, 1.0), (0, 1, -1.0), (1, 0, -1.0)] {
                    self.tangent[(3 * b + k) * 6 + 3 * a + i] += sign * entry;
                }
            }
        }
    }
}
