//! A triangle of a membrane in plane stress. With the tangents f_i and the gradients g_a in the frame of the
//! triangle: f_a = V f_i S_ij g_aj and K_ab = V (𝔹_aᵀ D 𝔹_b + (g_a·S g_b) I). D comes from
//! [`AnyLaw::plane_tangent`](pliant_mechanics::law::AnyLaw). A membrane under compression makes K indefinite,
//! because wrinkles are then to be found. The line search and the report of negative eigenvalues handle this
//! as for other walls.

use pliant_mechanics::element::{Axes, Rest};
use pliant_mechanics::law::plane_stress::{FLAT_WALL, InPlane};
use pliant_mechanics::tensor::{Vector, add, dot, scale};
use pliant_shells::Broken;

use super::{CellMaterial, Response, Strained, add_to};

/// Gradients of the shape functions in the frame of a triangle [1/m].
pub(super) fn in_frame(rest: &Rest<3>, axes: &Axes) -> [[f64; 2]; 3] {
    rest.gradient.map(|b| axes.map(|axis| dot(b, axis)))
}

/// ∂u/∂X₁ and ∂u/∂X₂.
pub(super) fn changes(u: &[Vector<f64>; 3], shape: &[[f64; 2]; 3]) -> [Vector<f64>; 2] {
    [0, 1].map(|i| u.iter().zip(shape).fold([0.0; 3], |sum, (&u, g)| add(sum, scale(u, g[i]))))
}

impl Response {
    /// Adds a triangle; the fibres of `material` are in its frame.
    pub(super) fn add_triangle(
        &mut self,
        material: CellMaterial<'_>,
        u: &[Vector<f64>; 3],
        rest: &Rest<3>,
        axes: &Axes,
    ) -> Result<(), Broken> {
        let shape = in_frame(rest, axes);
        let changes = changes(u, &shape);
        let plane = InPlane::from_changes(axes, &changes);
        let area = 1.0 + plane.area_change();
        if area.is_nan() || area < FLAT_WALL {
            return Err(Broken::Inverted(0.0));
        }
        let found = material.law.plane_stress(plane.strain_twice, material.fibres);
        let ([factor, _], [remembered, counts, _]) = (material.lag.factors, material.lag.counts);
        let w = rest.volume;
        if counts {
            self.energy += w * (factor * found.energy);
        }
        let [mut xx, mut yy, mut xy] = found.stress.map(|stress| factor * stress);
        if let Some(kept) = material.lag.kept.first() {
            let [own_xx, own_yy, _, own_xy, _, _] = kept.0;
            (xx, yy, xy) = (xx + own_xx, yy + own_yy, xy + own_xy);
            if remembered {
                self.energy += 0.5 * w * kept.double_dot(&Strained::Wall(plane.strain_twice).twice());
            }
        }
        let [t, s] = [add(axes[0], changes[0]), add(axes[1], changes[1])];
        let pulled = [add(scale(t, xx), scale(s, xy)), add(scale(t, xy), scale(s, yy))];
        for (a, &[g, h]) in shape.iter().enumerate() {
            add_to(&mut self.force, a, scale(add(scale(pulled[0], g), scale(pulled[1], h)), w));
        }
        if !material.stiffness {
            return Ok(());
        }
        let d = material
            .law
            .plane_tangent(plane.strain_twice, material.fibres)
            .map(|row| row.map(|d| factor * d));
        // Of each node its three columns of 𝔹: the changes of E₁₁, E₂₂ and 2E₁₂ with its place.
        let strains = shape.map(|[g, h]| [0, 1, 2].map(|c| [t[c] * g, s[c] * h, t[c] * h + s[c] * g]));
        for (b, columns) in strains.iter().enumerate() {
            let [g, h] = shape[b];
            let stressed = [xx * g + xy * h, xy * g + yy * h];
            for (k, column) in columns.iter().enumerate() {
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
