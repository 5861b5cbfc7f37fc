//! A triangle of a membrane in plane stress: with the tangents f_i and the gradients g_a in the frame of the triangle,
//! f_a = V f_i S_ij g_aj and K_ab = V (𝔹_aᵀ D 𝔹_b + (g_a·S g_b) I), D from [`AnyLaw::plane_tangent`](pliant_mechanics::law::AnyLaw).
//! A membrane under compression makes K indefinite: it then has wrinkles to find, which the line search and the report of negative
//! eigenvalues deal with as for other walls.

use pliant_mechanics::element::{Axes, Rest};
use pliant_mechanics::law::plane_stress::{FLAT_WALL, InPlane};
use pliant_mechanics::tensor::{Vector, add, dot, scale};

use super::{Own, Response, add_to};
use crate::facet::Broken;

impl Response {
    /// Adds a triangle; the fibres of `own` are in its frame.
    pub(super) fn add_triangle(
        &mut self,
        own: Own<'_>,
        u: &[Vector<f64>; 3],
        rest: &Rest<3>,
        axes: &Axes,
    ) -> Result<(), Broken> {
        let shape = rest.gradient.map(|b| axes.map(|axis| dot(b, axis)));
        let change = |i: usize| u.iter().zip(&shape).fold([0.0; 3], |sum, (&u, g)| add(sum, scale(u, g[i])));
        let changes = [change(0), change(1)];
        let plane = InPlane::from_changes(axes, &changes);
        let area = 1.0 + plane.area_change();
        if area.is_nan() || area < FLAT_WALL {
            return Err(Broken::Inverted(0.0));
        }
        let found = own.law.plane_stress(plane.strain_twice, own.fibres);
        let ([xx, yy, xy], w) = (found.stress, rest.volume);
        self.energy += w * found.energy;
        let [t, s] = [add(axes[0], changes[0]), add(axes[1], changes[1])];
        let pulled = [add(scale(t, xx), scale(s, xy)), add(scale(t, xy), scale(s, yy))];
        for (a, &[g, h]) in shape.iter().enumerate() {
            add_to(&mut self.force, a, scale(add(scale(pulled[0], g), scale(pulled[1], h)), w));
        }
        if !own.stiffness {
            return Ok(());
        }
        let d = own.law.plane_tangent(plane.strain_twice, own.fibres);
        // Of each node its three columns of 𝔹: the changes of E₁₁, E₂₂ and 2E₁₂ with its place.
        let strains = shape.map(|[g, h]| [0, 1, 2].map(|c| [t[c] * g, s[c] * h, t[c] * h + s[c] * g]));
        for (b, own) in strains.iter().enumerate() {
            let [g, h] = shape[b];
            let stressed = [xx * g + xy * h, xy * g + yy * h];
            for (k, column) in own.iter().enumerate() {
                let pushed = d.map(|row| w * (row[0] * column[0] + row[1] * column[1] + row[2] * column[2]));
                let start = (3 * b + k) * 9;
                for (a, other) in strains.iter().enumerate() {
                    for (i, row) in other.iter().enumerate() {
                        self.tangent[start + 3 * a + i] += dot(*row, pushed);
                    }
                    self.tangent[start + 3 * a + k] +=
                        w * (shape[a][0] * stressed[0] + shape[a][1] * stressed[1]);
                }
            }
        }
        Ok(())
    }
}
