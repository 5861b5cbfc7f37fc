//! Resistance of uniform-strain hexahedra to hourglass patterns, f_a = k Σ_c γ_ca q_c with q_c = Σ_b γ_cb
//! u_b. Let γ_ca = Γ_ca − B_a·Y_c, with the signs Γ_ca = ±1 of the patterns ηζ, ξζ, ξη, ξηζ and their moments
//! Y_c = Σ_a Γ_ca X_a. Then q_c = Σ_b Γ_cb u_b − H Y_c. The force becomes f_a = Σ_c Γ_ca k q_c − (k Σ_c q_c ⊗
//! Y_c) B_a. A cell stores thirteen numbers, and the second term of the force is added to the stress.
//!
//! Where the stiffness grows with the law, k becomes k g(F) ([`ShearGrowth`]). The forces stay the gradient
//! of an energy, ½ k g Σ |q_c|². Its derivative by F adds ½ k Σ |q_c|² ∂g/∂F to V P. That derivative costs
//! two more stresses, in batches where g is above 1 and cells bend.

use pliant_mechanics::law::{AnyLaw, Deformation, ShearGrowth};
use pliant_mechanics::model::Hourglass;
use pliant_mechanics::tensor::{Symmetric, Tensor, Vector, add, cast, dot, scale, sub};
use rayon::prelude::*;

use super::batch::{Batch, PACKS, Wanted};
use super::packed::PackedCells;
use crate::lanes::LaneNumber;
use crate::lanes::{
    LaneWork, Lanes, PACK, Pack, load_symmetric, load_tensor, load_vector, store_symmetric, store_vector,
};

/// Hourglass control of packs of cells; see [`Hourglass`].
pub(super) struct PackedHourglass<R> {
    /// Y_c [m].
    moments: [Vector<Pack<R>>; 4],
    /// k [N/m].
    stiffness: Pack<R>,
    /// 3/2 κ² [1/m²]; see `corners.rs`.
    reach: Pack<R>,
}

impl<R: LaneNumber> PackedHourglass<R> {
    pub(super) fn of<const N: usize>(packed: &PackedCells<R, N>, control: &Hourglass<f64, N>) -> Vec<Self> {
        let of_pack = |pack: usize| Self {
            moments: [0, 1, 2, 3].map(|c| packed.vector(pack, |cell| cast(control.moments[cell][c]))),
            stiffness: packed.pack(pack, |cell| R::of(control.stiffness[cell])),
            reach: packed.pack(pack, |cell| R::of((1.5 * control.corner_reach[cell]).min(1e30))),
        };
        packed.packs().into_par_iter().map(of_pack).collect()
    }
}

/// k q_c [N] of a pack of cells.
#[derive(Clone, Copy)]
pub(super) struct Resistance<R>([Vector<Pack<R>>; 4]);

impl<R: LaneNumber> Resistance<R> {
    pub(super) fn new() -> Self {
        Self([[Pack::ZERO; 3]; 4])
    }

    /// Finds k q_c from the displacements relative to the first node and their gradient. Returns the energy ½
    /// k Σ |q_c|² [J] and 3/2 κ² Σ |q_c|².
    #[inline(always)]
    pub(super) fn find<L: Lanes<R>, const M: usize>(
        &mut self,
        control: &PackedHourglass<R>,
        u: &[Vector<L>; M],
        h: &Tensor<L>,
        at: usize,
    ) -> [L; 2] {
        let stiffness = L::load(&control.stiffness, at);
        let mut energy = L::ZERO;
        for ((signed, moment), kq) in signed_sums(u).into_iter().zip(&control.moments).zip(&mut self.0) {
            let q = sub(signed, h.apply(load_vector(moment, at)));
            energy += dot(q, q);
            store_vector(scale(q, stiffness), kq, at);
        }
        [L::of(0.5) * stiffness * energy, L::load(&control.reach, at) * energy]
    }

    /// Multiplies the resistance by a factor g.
    #[inline(always)]
    fn grow<L: Lanes<R>>(&mut self, factor: L, at: usize) {
        for kq in &mut self.0 {
            let grown = scale(load_vector(kq, at), factor);
            store_vector(grown, kq, at);
        }
    }

    /// Subtracts Σ_c k q_c ⊗ Y_c from V P.
    #[inline(always)]
    pub(super) fn turn<L: Lanes<R>>(&self, control: &PackedHourglass<R>, piola: &mut Tensor<L>, at: usize) {
        for (kq, moment) in self.0.iter().zip(&control.moments) {
            let [x, y, z] = load_vector::<R, L>(kq, at);
            piola.add_outer([-x, -y, -z], load_vector(moment, at));
        }
    }

    /// Adds Σ_c Γ_ca k q_c to the forces on all nodes but the first.
    #[inline(always)]
    pub(super) fn add_to<L: Lanes<R>, const M: usize>(&self, forces: &mut [Vector<L>; M], at: usize) {
        let kq = |c: usize| load_vector::<R, L>(&self.0[c], at);
        let (first, odd) = (kq(0), kq(3));
        let (plus, minus) = (add(kq(1), kq(2)), sub(kq(1), kq(2)));
        // The even part of nodes that lie opposite each other: 0 and 6, 1 and 7, 2 and 4, 3 and 5.
        let even =
            [add(first, plus), sub(first, plus), sub([L::ZERO; 3], add(first, minus)), sub(minus, first)];
        let [a, b, c, d] = even;
        forces[0] = add(forces[0], add(b, odd));
        forces[1] = add(forces[1], sub(c, odd));
        forces[2] = add(forces[2], add(d, odd));
        forces[3] = add(forces[3], add(c, odd));
        forces[4] = add(forces[4], sub(d, odd));
        forces[5] = add(forces[5], add(a, odd));
        forces[6] = add(forces[6], sub(b, odd));
    }
}

/// The growth of the stiffness of a batch of cells.
pub(super) struct Growth<R> {
    /// ½ k Σ |q_c|² [J].
    pub(super) constant: [Pack<R>; PACKS],
    /// ½ k Σ |q_c|² G [J], which adds to V S; `None` where no entry differs from zero.
    stress: Option<[Symmetric<Pack<R>>; PACKS]>,
}

impl<R: LaneNumber> Growth<R> {
    pub(super) fn new() -> Self {
        Self { constant: [Pack::ZERO; PACKS], stress: None }
    }

    /// Adds F ½ k Σ |q_c|² G to V P.
    #[inline(always)]
    pub(super) fn add_to<L: Lanes<R>>(
        &self,
        piola: &mut Tensor<L>,
        batch: &Batch<R>,
        index: usize,
        at: usize,
    ) {
        if let Some(stress) = &self.stress {
            let gradient: Tensor<L> = batch.deformation_gradient(index, at);
            let added = gradient.times_symmetric(&load_symmetric(&stress[index], at));
            *piola = piola.plus_scaled(&added, L::ONE);
        }
    }
}

/// Search for the growth of a batch of cells, with one pack per resistance. The factor g from their stresses
/// scales resistance and energy.
pub(super) struct FindGrowth<'a, R> {
    pub law: &'a AnyLaw,
    /// Shear modulus at rest [Pa].
    pub shear: f64,
    pub fibres: &'a [Vector<Pack<R>>],
    pub wanted: Wanted,
    pub batch: &'a Batch<R>,
    pub resistance: &'a mut [Resistance<R>],
    /// ½ k g Σ |q_c|² [J] is added here.
    pub energy: &'a mut Pack<R>,
    pub growth: &'a mut Growth<R>,
}

impl<R: LaneNumber> LaneWork<R> for FindGrowth<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<R>>(self) {
        let Self { law, shear, fibres, wanted, batch, resistance, energy, growth } = self;
        let packs = resistance.len();
        let mut bends = false;
        for (index, resistance) in resistance.iter_mut().enumerate() {
            let constant = &growth.constant[index];
            let mut factors = Pack::ZERO;
            for at in (0..PACK).step_by(L::WIDTH) {
                let (_, shear_growth) = grown::<R, L>(batch, wanted, shear, index, at);
                shear_growth.factor.store(&mut factors, at);
                resistance.grow(shear_growth.factor, at);
                let held = L::load(constant, at) * shear_growth.factor;
                (held + L::load(energy, at)).store(energy, at);
            }
            for lane in 0..PACK {
                bends |= factors.0[lane] > R::ONE && constant.0[lane] > R::ZERO;
            }
        }
        growth.stress = None;
        if !bends {
            return;
        }
        // A pressure has no part in G, and much of the round-off.
        let part = if law.has_volumetric_energy() { Wanted::Isochoric } else { Wanted::Whole };
        let difference = L::of(R::EPSILON.cbrt());
        let (mut ahead, mut behind) = (Batch::new(), Batch::new());
        for index in 0..packs {
            for at in (0..PACK).step_by(L::WIDTH) {
                let (deformation, shear_growth) = grown::<R, L>(batch, wanted, shear, index, at);
                let (h, way) =
                    (load_tensor(&batch.gradient[index], at), shear_growth.direction(&deformation));
                ahead.set(index, at, &h.plus_scaled(&way, difference));
                behind.set(index, at, &h.plus_scaled(&way, -difference));
            }
        }
        ahead.evaluate::<L>(law, part, packs, 1, fibres);
        behind.evaluate::<L>(law, part, packs, 1, fibres);
        let added = growth.stress.insert([Symmetric([Pack::ZERO; 6]); PACKS]);
        for (index, added) in added[..packs].iter_mut().enumerate() {
            for at in (0..PACK).step_by(L::WIDTH) {
                let (deformation, shear_growth) = grown::<R, L>(batch, wanted, shear, index, at);
                let (after, before) = (ahead.stress::<L>(index, at), behind.stress::<L>(index, at));
                let (half, rate) = (L::of(0.5), L::of(0.5) / difference);
                let gradient = shear_growth.gradient(
                    &deformation,
                    &((after + before) * half),
                    &((after - before) * rate),
                );
                store_symmetric(gradient * L::load(&growth.constant[index], at), added, at);
            }
        }
    }
}

/// The growth of points of a batch, with their deformation.
#[inline(always)]
fn grown<R: LaneNumber, L: Lanes<R>>(
    batch: &Batch<R>,
    wanted: Wanted,
    shear: f64,
    index: usize,
    at: usize,
) -> (Deformation<L>, ShearGrowth<L>) {
    let deformation = Deformation::from_displacement_gradient(&load_tensor(&batch.gradient[index], at));
    let growth = ShearGrowth::new(&deformation, &batch.elastic(wanted, index, at), L::of(shear));
    (deformation, growth)
}

/// The factors g of a pack of points, from a batch whose first pack has their elastic stresses.
#[inline(always)]
pub(crate) fn growth<R: LaneNumber, L: Lanes<R>>(batch: &Batch<R>, shear: f64, at: usize) -> L {
    grown::<R, L>(batch, Wanted::Whole, shear, 0, at).1.factor
}

/// Σ_b Γ_cb u_b of the nodes 1 to 7, with u_0 = 0: sums and differences of opposite nodes first.
#[inline(always)]
fn signed_sums<R: pliant_mechanics::Number, const M: usize>(u: &[Vector<R>; M]) -> [Vector<R>; 4] {
    let (s0, s1, s2, s3) = (u[5], add(u[0], u[6]), add(u[1], u[3]), add(u[2], u[4]));
    let odd = add(add(u[5], sub(u[0], u[6])), add(sub(u[3], u[1]), sub(u[2], u[4])));
    let (a, b) = (sub(s0, s1), sub(s2, s3));
    [sub(add(s0, s1), add(s2, s3)), sub(a, b), add(a, b), odd]
}
