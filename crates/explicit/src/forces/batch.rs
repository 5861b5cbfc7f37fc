//! Points evaluated together: elements fill in displacement gradients, the law answers with stresses. So an
//! element is compiled once for each kind of lanes, and so is a law; no law is compiled again in every
//! element. The choice of the law costs one branch per batch.

use pliant_mechanics::Number;
use pliant_mechanics::law::{AnyLaw, Deformation, Law, MOST_FAMILIES, Split, with_law};
use pliant_mechanics::tensor::{Symmetric, Tensor, Vector, dot};

use super::findings::Findings;
use crate::lanes::LaneNumber;
use crate::lanes::{
    LaneWork, Lanes, PACK, Pack, Processor, load_symmetric, load_tensor, load_vector, store_symmetric,
    store_vector,
};

/// Packs of points in a batch: few enough for the first cache.
pub(super) const PACKS: usize = 4;

/// Parts of the stress that a law is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wanted {
    /// The whole stress.
    Whole,
    /// The isochoric part of the stress.
    Isochoric,
    /// Both parts.
    Parts,
}

/// Displacement gradients of up to [`PACKS`] packs of points, and what the law finds there.
pub(crate) struct Batch<R> {
    /// ∂u/∂X.
    pub gradient: [Tensor<Pack<R>>; PACKS],
    /// Elastic second Piola–Kirchhoff stress [Pa], the whole or its isochoric part.
    pub stress: [Symmetric<Pack<R>>; PACKS],
    /// The volumetric part, where parts are wanted.
    volumetric: [Symmetric<Pack<R>>; PACKS],
    /// J.
    pub volume_ratio: [Pack<R>; PACKS],
    /// |C − I|².
    pub strain: [Pack<R>; PACKS],
}

impl<R: LaneNumber> Batch<R> {
    pub(crate) fn new() -> Self {
        let stress = Symmetric([Pack::ZERO; 6]);
        Self {
            gradient: [Tensor([[Pack::ZERO; 3]; 3]); PACKS],
            stress: [stress; PACKS],
            volumetric: [stress; PACKS],
            volume_ratio: [Pack::ZERO; PACKS],
            strain: [Pack::ZERO; PACKS],
        }
    }

    /// Sets ∂u/∂X of the points from lane `at` of a pack on.
    #[inline(always)]
    pub(crate) fn set<L: Lanes<R>>(&mut self, pack: usize, at: usize, h: &Tensor<L>) {
        for (row, to) in h.0.into_iter().zip(&mut self.gradient[pack].0) {
            store_vector(row, to, at);
        }
    }

    /// J and |C − I|² of the first packs.
    #[inline(always)]
    pub(crate) fn measure<L: Lanes<R>>(&mut self, packs: usize) {
        for pack in 0..packs {
            for at in (0..PACK).step_by(L::WIDTH) {
                let h: Tensor<L> = load_tensor(&self.gradient[pack], at);
                let strain = Symmetric::green_lagrange_twice(&h);
                (L::ONE + volume_change(&h)).store(&mut self.volume_ratio[pack], at);
                square(&strain).store(&mut self.strain[pack], at);
            }
        }
    }

    /// Computes the wanted parts of the stresses of the first packs. `fibres` has the directions of each
    /// cell, which has `points` points one after the other.
    #[inline(always)]
    pub(crate) fn evaluate<L: Lanes<R>>(
        &mut self,
        law: &AnyLaw,
        wanted: Wanted,
        packs: usize,
        points: usize,
        fibres: &[Vector<Pack<R>>],
    ) {
        with_law!(law, law => L::call(Stresses { law: *law, wanted, batch: self, packs, points, fibres }));
    }

    /// The stress of the points from lane `at` of a pack on: the whole or its isochoric part, as wanted.
    #[inline(always)]
    pub(crate) fn stress<L: Lanes<R>>(&self, pack: usize, at: usize) -> Symmetric<L> {
        load_symmetric(&self.stress[pack], at)
    }

    /// Returns both parts of the stress.
    #[inline(always)]
    pub(super) fn parts<L: Lanes<R>>(&self, pack: usize, at: usize) -> Split<Symmetric<L>> {
        Split { isochoric: self.stress(pack, at), volumetric: load_symmetric(&self.volumetric[pack], at) }
    }

    /// The whole elastic stress, if the whole or both parts were wanted.
    #[inline(always)]
    pub(super) fn elastic<L: Lanes<R>>(&self, wanted: Wanted, pack: usize, at: usize) -> Symmetric<L> {
        let stress = self.stress(pack, at);
        if wanted == Wanted::Parts { stress + load_symmetric(&self.volumetric[pack], at) } else { stress }
    }

    /// F of the points from lane `at` of a pack on.
    #[inline(always)]
    pub(crate) fn deformation_gradient<L: Lanes<R>>(&self, pack: usize, at: usize) -> Tensor<L> {
        let mut f: Tensor<L> = load_tensor(&self.gradient[pack], at);
        for i in 0..3 {
            f.0[i][i] += L::ONE;
        }
        f
    }

    /// Notes how far the points of a pack of cells are deformed, and which cell is the first whose det F is
    /// not above zero.
    #[inline(always)]
    pub(crate) fn note(&self, pack: usize, first_cell: usize, findings: &mut Findings<R>) {
        let (ratios, strains) = (&self.volume_ratio[pack].0, &self.strain[pack].0);
        let mut sound = true;
        for lane in 0..PACK {
            let j = ratios[lane];
            sound &= j > R::ZERO;
            let (least, largest) =
                (&mut findings.least_volume_ratio.0[lane], &mut findings.largest_strain.0[lane]);
            *least = if j < *least { j } else { *least };
            *largest = if strains[lane] > *largest { strains[lane] } else { *largest };
        }
        if !sound && findings.inverted.is_none() {
            let broken = |j: &R| j.partial_cmp(&R::ZERO) != Some(std::cmp::Ordering::Greater);
            let lane = ratios.iter().position(broken).unwrap_or(0);
            findings.inverted = Some((first_cell + lane, ratios[lane].to_f64()));
        }
    }
}

/// S:S.
#[inline(always)]
fn square<L: Number>(s: &Symmetric<L>) -> L {
    let [xx, yy, zz, xy, yz, xz] = s.0;
    let shear = dot([xy, yz, xz], [xy, yz, xz]);
    dot([xx, yy, zz], [xx, yy, zz]) + shear + shear
}

/// The stresses of a law at the points of a batch.
struct Stresses<'a, R, T> {
    law: T,
    wanted: Wanted,
    batch: &'a mut Batch<R>,
    packs: usize,
    points: usize,
    fibres: &'a [Vector<Pack<R>>],
}

impl<R: LaneNumber, T: Law> LaneWork<R> for Stresses<'_, R, T> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<R>>(self) {
        let Self { law, wanted, batch, packs, points, fibres } = self;
        let families = law.families();
        for pack in 0..packs {
            let pack_fibres = &fibres[pack / points * families..][..families];
            for at in (0..PACK).step_by(L::WIDTH) {
                let h = load_tensor(&batch.gradient[pack], at);
                let deformation = Deformation::<L>::from_displacement_gradient(&h);
                let mut directions = [[L::ZERO; 3]; MOST_FAMILIES];
                for (direction, fibre) in directions.iter_mut().zip(pack_fibres) {
                    *direction = load_vector(fibre, at);
                }
                let directions = &directions[..families];
                let stress = match wanted {
                    Wanted::Whole => law.whole_stress(&deformation, directions),
                    Wanted::Isochoric => law.stress(&deformation, directions).isochoric,
                    Wanted::Parts => {
                        let Split { isochoric, volumetric } = law.stress(&deformation, directions);
                        store_symmetric(volumetric, &mut batch.volumetric[pack], at);
                        isochoric
                    }
                };
                store_symmetric(stress, &mut batch.stress[pack], at);
                deformation.volume_ratio.store(&mut batch.volume_ratio[pack], at);
                square(&deformation.strain_twice).store(&mut batch.strain[pack], at);
            }
        }
    }
}

/// Computes U'(J) [Pa] of a law whose volumetric stress is J U'(J) C⁻¹, at up to [`PACKS`] packs of J − 1. U'
/// follows from the law's stress in a pure dilation F = J^(1/3) I.
#[inline(always)]
pub(super) fn pressures<R: LaneNumber, L: Lanes<R>>(
    law: &AnyLaw,
    values: &mut [Pack<R>],
    batch: &mut Batch<R>,
) {
    for (pack, change) in values.iter().enumerate() {
        for at in (0..PACK).step_by(L::WIDTH) {
            let x = L::load(change, at);
            let c = (L::ONE + x).cbrt();
            // c − 1 = x/(c² + c + 1), without cancellation.
            let (stretch, o) = (x / (c * c + c + L::ONE), L::ZERO);
            batch.set(pack, at, &Tensor([[stretch, o, o], [o, stretch, o], [o, o, stretch]]));
        }
    }
    let any = [R::ONE, R::ZERO, R::ZERO].map(|a| Pack([a; PACK]));
    batch.evaluate::<L>(law, Wanted::Parts, values.len(), PACKS, &[any; MOST_FAMILIES]);
    for (pack, pressure) in values.iter_mut().enumerate() {
        for at in (0..PACK).step_by(L::WIDTH) {
            // S = J U' C⁻¹ with C⁻¹ = c⁻² I and J = c³.
            let c = L::ONE + L::load(&batch.gradient[pack].0[0][0], at);
            let stress = L::load(&batch.volumetric[pack].0[0], at);
            (stress / c).store(pressure, at);
        }
    }
}

/// U'(J) [Pa] at one J − 1.
pub(crate) fn pressure(law: &AnyLaw, volume_change: f64) -> f64 {
    struct One<'a>(&'a AnyLaw, Pack<f64>);
    impl LaneWork<f64> for One<'_> {
        type Output = f64;
        #[inline(always)]
        fn run<L: Lanes<f64>>(mut self) -> f64 {
            pressures::<f64, L>(self.0, std::slice::from_mut(&mut self.1), &mut Batch::new());
            self.1.0[0]
        }
    }
    Processor::detect().run(One(law, Pack([volume_change; PACK])))
}

/// J − 1, without cancellation.
#[inline(always)]
pub(super) fn volume_change<L: Number>(h: &Tensor<L>) -> L {
    h.trace() + h.second_invariant() + h.determinant()
}
