//! Force and stiffness of one facet by itself, number by number: what packs of facets are compared with.

use nalgebra::{Matrix3, Vector3};

use super::{Facet, Matrix18, Placed, symmetrise};
use crate::element::gradients;
use crate::patch::Vector18;
use crate::rotation::{moment_correction, skew, spin_to_vector};

impl Facet {
    /// K d and the tension at rest in the facet's axes.
    fn linear_force(&self, d: &Vector18) -> Vector18 {
        self.stiffness * d + self.tension.0
    }

    /// Energy [J] and internal nodal forces and moments, its gradient with respect to positions and spins.
    pub(super) fn force(&self, placed: &Placed) -> (f64, Vector18) {
        let raw = self.linear_force(&placed.deformation);
        let spun = placed.to_spins(&raw);
        (
            0.5 * (placed.deformation.dot(&raw) + self.tension_energy(&placed.deformation)),
            placed.to_space(&project(placed, &self.frame_spins(placed), &spun)),
        )
    }

    /// The change of the force with positions and spins.
    pub(super) fn tangent(&self, placed: &Placed) -> Matrix18 {
        let mut k = self.local_tangent(placed);
        for a in 0..6 {
            for b in 0..6 {
                placed.turn_block(&mut k, a, b);
            }
        }
        k
    }

    /// The symmetric part of the change of the force: the Hessian of the energy on the group of rotations
    /// (Simo 1992, CMAME 96:189). The rest vanishes at equilibrium without moments.
    pub(super) fn hessian(&self, placed: &Placed) -> Matrix18 {
        let mut k = self.tangent(placed);
        symmetrise(&mut k);
        k
    }

    /// The change of the force in the facet's axes.
    fn local_tangent(&self, placed: &Placed) -> Matrix18 {
        let raw = self.linear_force(&placed.deformation);
        let mut k = self.stiffness;
        placed.spin_stiffness(&mut k);
        let spun = placed.to_spins(&raw);
        let g = self.frame_spins(placed);
        let projected = project(placed, &g, &spun);
        let arm = placed.local.map(|x| Sparse { xz: x.y, yz: -x.x, zx: -x.y, zy: x.x });
        let part = |v: &Vector18, a: usize| Vector3::new(v[3 * a], v[3 * a + 1], v[3 * a + 2]);

        // Pᵀ K P; K does not resist translations, so of P only Ψ G counts.
        let mut rigid = [Matrix3::zeros(); 6];
        for (a, rigid) in rigid.iter_mut().enumerate() {
            for (i, arm) in arm.iter().enumerate() {
                let block: Matrix3<f64> = k.fixed_view::<3, 3>(3 * a, 6 * i).into();
                *rigid += k.fixed_view::<3, 3>(3 * a, 6 * i + 3) - arm.after(&block);
            }
        }
        let mut twice = Matrix3::zeros();
        for i in 0..3 {
            // Sᵀ = −S.
            twice += rigid[2 * i + 1] - arm[i].transposed_before(&rigid[2 * i]);
        }
        let corrections = [0, 1, 2].map(|i| moment_correction(&placed.theta(i), &part(&raw, 2 * i + 1)));
        twice += corrections.iter().sum::<Matrix3<f64>>();
        let force = [0, 1, 2].map(|i| skew(&part(&spun, 2 * i)));
        // Fnᵀ Ψ.
        let mut leverage = Matrix3::zeros();
        for i in 0..3 {
            leverage += arm[i].after(&force[i]);
        }
        let both = twice + leverage;
        let mut change = [Matrix3::zeros(); 6];
        for (a, change) in change.iter_mut().enumerate() {
            let correction = if a % 2 == 0 { Matrix3::zeros() } else { corrections[a / 2] };
            *change = rigid[a] + skew(&part(&projected, a)) + correction;
        }
        for j in 0..3 {
            for (a, change) in change.iter().enumerate() {
                let mut block = k.fixed_view_mut::<3, 3>(3 * a, 6 * j);
                block -= g[j].after(change);
            }
            let moved = g[j].after(&both) - rigid[2 * j].transpose() + force[j];
            let turned = rigid[2 * j + 1].transpose() + corrections[j];
            for (i, g) in g.iter().enumerate() {
                let mut block = k.fixed_view_mut::<3, 3>(6 * i, 6 * j);
                block += g.transposed_before(&moved);
                let mut block = k.fixed_view_mut::<3, 3>(6 * i, 6 * j + 3);
                block -= g.transposed_before(&turned);
            }
            let mut block = k.fixed_view_mut::<3, 3>(6 * j + 3, 6 * j + 3);
            block += corrections[j];
        }
        self.frame_change(placed, &spun, &g, &arm, &mut k);
        k
    }

    /// F11 + F22 in the facet's axes.
    fn stretch_trace(&self, placed: &Placed) -> f64 {
        placed.local.iter().zip(&self.gradient).map(|(corner, gradient)| corner.dot(gradient)).sum()
    }

    /// G of each node: the spin of the frame over its translation, in the frame.
    fn frame_spins(&self, placed: &Placed) -> [Sparse; 3] {
        let now = gradients(&placed.local);
        let spin = |i: usize| {
            let rest = self.gradient[i] / self.stretch_trace(placed);
            Sparse { xz: now[i].y, yz: -now[i].x, zx: -rest.y, zy: rest.x }
        };
        [spin(0), spin(1), spin(2)]
    }

    /// Adds what comes from the change of G; matters at finite strain only.
    fn frame_change(
        &self,
        placed: &Placed,
        spun: &Vector18,
        g: &[Sparse; 3],
        arm: &[Sparse; 3],
        k: &mut Matrix18,
    ) {
        let moment = placed.moment(spun);
        let now = gradients(&placed.local);
        for i in 0..3 {
            let blocks = [0, 1, 2].map(|q| {
                let tilt = moment.x * now[q].y - moment.y * now[q].x;
                let out_of_plane = Vector3::z() * Vector3::new(now[i].x, now[i].y, 0.0).transpose() * tilt;
                let stretch =
                    Vector3::new(self.gradient[q].x, self.gradient[q].y, 0.0) / self.stretch_trace(placed);
                out_of_plane + Vector3::new(g[i].zx, g[i].zy, 0.0) * stretch.transpose() * moment.z
            });
            let turned = (0..3).fold(Matrix3::zeros(), |sum, q| sum - arm[q].after(&blocks[q]));
            for q in 0..3 {
                let mut block = k.fixed_view_mut::<3, 3>(6 * i, 6 * q);
                block += blocks[q] - g[q].after(&turned);
            }
        }
    }
}

/// Pᵀ f: nodal forces whose resultants vanish.
fn project(placed: &Placed, g: &[Sparse; 3], force: &Vector18) -> Vector18 {
    let mean = (0..3).fold(Vector3::zeros(), |sum, i| sum + force.fixed_rows::<3>(6 * i) / 3.0);
    let moment = placed.moment(force);
    let mut projected = *force;
    for (i, g) in g.iter().enumerate() {
        let mut on_node = projected.fixed_rows_mut::<3>(6 * i);
        on_node -= mean + Vector3::new(g.zx * moment.z, g.zy * moment.z, g.xz * moment.x + g.yz * moment.y);
    }
    projected
}

/// A 3 × 3 matrix with nothing else than these entries, as G and S(x) in the plane are.
#[derive(Clone, Copy)]
struct Sparse {
    xz: f64,
    yz: f64,
    zx: f64,
    zy: f64,
}

impl Sparse {
    /// M times this.
    #[inline(always)]
    fn after(&self, m: &Matrix3<f64>) -> Matrix3<f64> {
        let row =
            |i: usize| [m[(i, 2)] * self.zx, m[(i, 2)] * self.zy, m[(i, 0)] * self.xz + m[(i, 1)] * self.yz];
        let [a, b, c] = [row(0), row(1), row(2)];
        Matrix3::new(a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2])
    }

    /// The transpose of this times M.
    #[inline(always)]
    fn transposed_before(&self, m: &Matrix3<f64>) -> Matrix3<f64> {
        let column =
            |j: usize| [self.zx * m[(2, j)], self.zy * m[(2, j)], self.xz * m[(0, j)] + self.yz * m[(1, j)]];
        let [a, b, c] = [column(0), column(1), column(2)];
        Matrix3::new(a[0], b[0], c[0], a[1], b[1], c[1], a[2], b[2], c[2])
    }
}

impl Placed {
    /// Brings a 3 × 3 block of a stiffness from the facet's axes to space.
    #[inline(always)]
    fn turn_block(&self, k: &mut Matrix18, a: usize, b: usize) {
        let mut block = k.fixed_view_mut::<3, 3>(3 * a, 3 * b);
        let turned = self.axes * block.clone_owned() * self.axes.transpose();
        block.copy_from(&turned);
    }

    /// The rotation [rad] of a node relative to the facet.
    fn theta(&self, node: usize) -> Vector3<f64> {
        self.deformation.fixed_rows::<3>(6 * node + 3).into()
    }

    /// Moments conjugate to rotation vectors made conjugate to spins: Hᵀ f.
    fn to_spins(&self, raw: &Vector18) -> Vector18 {
        let mut spun = *raw;
        for i in 0..3 {
            let moment = spin_to_vector(&self.theta(i)).tr_mul(&raw.fixed_rows::<3>(6 * i + 3));
            spun.fixed_rows_mut::<3>(6 * i + 3).copy_from(&moment);
        }
        spun
    }

    /// K made one of spins: Hᵀ K H.
    fn spin_stiffness(&self, k: &mut Matrix18) {
        for i in 0..3 {
            let h = spin_to_vector(&self.theta(i));
            let columns = k.fixed_columns::<3>(6 * i + 3) * h;
            k.fixed_columns_mut::<3>(6 * i + 3).copy_from(&columns);
            let rows = h.tr_mul(&k.fixed_rows::<3>(6 * i + 3));
            k.fixed_rows_mut::<3>(6 * i + 3).copy_from(&rows);
        }
    }

    /// From the facet's axes to space.
    fn to_space(&self, local: &Vector18) -> Vector18 {
        let mut global = Vector18::zeros();
        for a in 0..6 {
            global.fixed_rows_mut::<3>(3 * a).copy_from(&(self.axes * local.fixed_rows::<3>(3 * a)));
        }
        global
    }

    /// Ψᵀ f: the moment of nodal forces and moments about the centroid.
    fn moment(&self, force: &Vector18) -> Vector3<f64> {
        (0..3).fold(Vector3::zeros(), |sum, i| {
            let arm = Vector3::new(self.local[i].x, self.local[i].y, 0.0);
            sum + arm.cross(&force.fixed_rows::<3>(6 * i)) + force.fixed_rows::<3>(6 * i + 3)
        })
    }
}
