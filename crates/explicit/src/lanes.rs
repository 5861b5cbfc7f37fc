//! Numbers side by side: kernels written once, generic over [`Lanes`], run sixteen, eight or four cells at a
//! time.
//!
//! Data lie in packs of [`PACK`] numbers whatever the width, so that files and results do not depend on it.
//! The CPU is queried when a force field is made, by checks of the critical time step and by the recovery of
//! fields: AVX-512 (with the feature `avx512`; 16 numbers in single, 8 in double precision), AVX2 with FMA
//! (8, 4), SSE4.2 or NEON (4, 2). Without any of these the kernels run in plain numbers. Nobody needs
//! `target-cpu=native`; `CentralDifference::in_lanes` chooses other instructions for forces and nodes. Lanes
//! never mix: with AVX-512 and AVX2 results are the same to the bit (tested for every law and element in
//! `forces/tests.rs`), elsewhere to round-off.
//!
//! This file holds all `unsafe` code of the crate: registers read from and written to arrays, and nodes of a
//! block read and written. These accesses take no comparison each, since all offsets are compared once.
#![allow(unsafe_code)]

use std::ops::{Add, AddAssign, Div, Mul, Neg, Range, Sub, SubAssign};

use pulp::{Simd, WithSimd};
use serde::{Deserialize, Serialize};

use pliant_mechanics::closer_to_inverse_cbrt;
use pliant_mechanics::tensor::{Symmetric, Tensor, Vector};
use pliant_mechanics::{Number, Real};

/// Numbers in a pack: the widest register in single precision.
pub const PACK: usize = 16;

/// Numbers of neighbouring cells, aligned so that none of their registers crosses a cache line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
#[repr(C, align(64))]
pub struct Pack<R>(pub [R; PACK]);

impl<R: LaneNumber> Pack<R> {
    /// Pack of zeros.
    pub(crate) const ZERO: Self = Self([R::ZERO; PACK]);

    /// Makes a pack from the number of each lane.
    pub(crate) fn from_fn(number: impl FnMut(usize) -> R) -> Self {
        Self(std::array::from_fn(number))
    }
}

/// The number of an entry in a row of packs.
#[inline(always)]
pub(crate) fn entry<R: LaneNumber>(packs: &[Pack<R>], index: usize) -> R {
    packs[index / PACK].0[index % PACK]
}

/// Numbers of `R` side by side; arithmetic is lane by lane.
pub trait Lanes<R>: Number {
    /// Number of lanes; divides [`PACK`].
    const WIDTH: usize;
    /// Returns one number in every lane.
    fn splat(value: R) -> Self;
    /// Reads the numbers of a pack from lane `at` on, a multiple of the width.
    fn load(pack: &Pack<R>, at: usize) -> Self;
    /// Writes them into a pack from lane `at` on.
    fn store(self, pack: &mut Pack<R>, at: usize);
    /// The four components of the vectors at some offsets of [`Places`], for lanes `at` and on.
    ///
    /// # Safety
    /// All offsets lie inside.
    unsafe fn gather(vectors: &[[R; 4]], offsets: &[u16; PACK], at: usize) -> [Self; 4];
    /// Writes vectors from lane `at` on, each to its [`row_of_lane`](Self::row_of_lane).
    fn spread(components: [Self; 4], to: &mut Pack<[R; 4]>, at: usize);
    /// Returns the row to which the vector of a lane of a pack is written: the order in which registers hold
    /// vectors.
    fn row_of_lane(lane: usize) -> usize;
    /// Does the work in a function of its own, compiled for these lanes.
    fn call<W: LaneWork<R>>(work: W) -> W::Output;
}

/// A number type that lanes hold. By itself the narrowest of lanes.
pub trait LaneNumber: Real + Lanes<Self> {
    /// Lanes as wide as a register of the CPU.
    #[doc(hidden)]
    type Wide<S: Simd>: Lanes<Self>;
}

impl LaneNumber for f32 {
    type Wide<S: Simd> = WideF32<S>;
}

impl LaneNumber for f64 {
    type Wide<S: Simd> = WideF64<S>;
}

/// The lanes' part of a vector of packs.
#[inline(always)]
pub(crate) fn load_vector<R: LaneNumber, L: Lanes<R>>(from: &Vector<Pack<R>>, at: usize) -> Vector<L> {
    [L::load(&from[0], at), L::load(&from[1], at), L::load(&from[2], at)]
}

/// Writes a vector into packs.
#[inline(always)]
pub(crate) fn store_vector<R: LaneNumber, L: Lanes<R>>(
    vector: Vector<L>,
    to: &mut Vector<Pack<R>>,
    at: usize,
) {
    for (number, pack) in vector.into_iter().zip(to) {
        number.store(pack, at);
    }
}

/// The lanes' part of a tensor of packs.
#[inline(always)]
pub(crate) fn load_tensor<R: LaneNumber, L: Lanes<R>>(from: &Tensor<Pack<R>>, at: usize) -> Tensor<L> {
    let rows = &from.0;
    Tensor([load_vector(&rows[0], at), load_vector(&rows[1], at), load_vector(&rows[2], at)])
}

/// The lanes' part of a symmetric tensor of packs.
#[inline(always)]
pub(crate) fn load_symmetric<R: LaneNumber, L: Lanes<R>>(
    from: &Symmetric<Pack<R>>,
    at: usize,
) -> Symmetric<L> {
    let mut symmetric = Symmetric::ZERO;
    for (number, pack) in symmetric.0.iter_mut().zip(&from.0) {
        *number = L::load(pack, at);
    }
    symmetric
}

/// Writes a symmetric tensor into packs.
#[inline(always)]
pub(crate) fn store_symmetric<R: LaneNumber, L: Lanes<R>>(
    symmetric: Symmetric<L>,
    to: &mut Symmetric<Pack<R>>,
    at: usize,
) {
    for (number, pack) in symmetric.0.into_iter().zip(&mut to.0) {
        number.store(pack, at);
    }
}

/// Work that is written for any lanes. Every function that it calls must be `#[inline(always)]`, or it is not
/// compiled for these instructions.
pub trait LaneWork<R> {
    /// Result of the work.
    type Output;
    /// Does it.
    fn run<L: Lanes<R>>(self) -> Self::Output;
}

/// Instructions that kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instructions {
    /// AVX-512: sixteen numbers in single precision.
    Avx512,
    /// AVX2 with FMA: eight.
    Avx2,
    /// SSE4.2, which any x86-64 processor since 2009 has: four.
    Sse4,
    /// NEON: four.
    Neon,
    /// One number at a time.
    Plain,
}

impl Instructions {
    /// Every kind of instructions, the widest first.
    pub const ALL: [Self; 5] = [Self::Avx512, Self::Avx2, Self::Sse4, Self::Neon, Self::Plain];

    /// The word for them.
    pub fn name(self) -> &'static str {
        match self {
            Self::Avx512 => "avx512",
            Self::Avx2 => "avx2",
            Self::Sse4 => "sse4",
            Self::Neon => "neon",
            Self::Plain => "plain",
        }
    }

    /// The widest that this processor has and this build knows.
    pub fn widest() -> Self {
        Self::ALL.into_iter().find(|&known| Processor::having(known).is_some()).unwrap_or(Self::Plain)
    }
}

impl std::fmt::Display for Instructions {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// Instructions that this processor or this build does not have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "this processor has no `{wanted}` instructions that pliant was built for; the widest it has are `{widest}`"
)]
pub struct MissingInstructions {
    /// Instructions that were asked for.
    pub wanted: Instructions,
    /// Widest instructions that the processor has.
    pub widest: Instructions,
}

/// The lanes that kernels run in.
#[derive(Clone, Copy, Debug)]
pub enum Processor {
    #[cfg(all(target_arch = "x86_64", feature = "avx512"))]
    Avx512(pulp::x86::V4),
    #[cfg(target_arch = "x86_64")]
    Avx2(pulp::x86::V3),
    #[cfg(target_arch = "x86_64")]
    Sse4(pulp::x86::V2),
    #[cfg(target_arch = "aarch64")]
    Neon(pulp::aarch64::Neon),
    Plain,
}

impl Processor {
    /// The widest lanes that this processor has.
    pub(crate) fn detect() -> Self {
        Self::having(Instructions::widest()).unwrap_or(Self::Plain)
    }

    /// The lanes of certain instructions.
    ///
    /// # Errors
    /// If the processor does not have them.
    pub(crate) fn with(wanted: Instructions) -> Result<Self, MissingInstructions> {
        Self::having(wanted).ok_or_else(|| MissingInstructions { wanted, widest: Instructions::widest() })
    }

    /// The lanes of certain instructions, if the processor has them.
    fn having(wanted: Instructions) -> Option<Self> {
        match wanted {
            #[cfg(all(target_arch = "x86_64", feature = "avx512"))]
            Instructions::Avx512 => pulp::x86::V4::try_new().map(Self::Avx512),
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2 => pulp::x86::V3::try_new().map(Self::Avx2),
            #[cfg(target_arch = "x86_64")]
            Instructions::Sse4 => pulp::x86::V2::try_new().map(Self::Sse4),
            #[cfg(target_arch = "aarch64")]
            Instructions::Neon => pulp::aarch64::Neon::try_new().map(Self::Neon),
            Instructions::Plain => Some(Self::Plain),
            #[allow(unreachable_patterns)]
            _ => None,
        }
    }

    /// Does the work in these lanes.
    #[inline]
    pub(crate) fn run<R: LaneNumber, W: LaneWork<R>>(self, work: W) -> W::Output {
        match self {
            #[cfg(all(target_arch = "x86_64", feature = "avx512"))]
            Self::Avx512(simd) => Simd::vectorize(simd, InLanes(work, std::marker::PhantomData::<R>)),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(simd) => Simd::vectorize(simd, InLanes(work, std::marker::PhantomData::<R>)),
            #[cfg(target_arch = "x86_64")]
            Self::Sse4(simd) => Simd::vectorize(simd, InLanes(work, std::marker::PhantomData::<R>)),
            #[cfg(target_arch = "aarch64")]
            Self::Neon(simd) => Simd::vectorize(simd, InLanes(work, std::marker::PhantomData::<R>)),
            Self::Plain => work.run::<R>(),
        }
    }
}

/// Work on its way into a function compiled for `S`.
struct InLanes<R, W>(W, std::marker::PhantomData<R>);

impl<R: LaneNumber, W: LaneWork<R>> WithSimd for InLanes<R, W> {
    type Output = W::Output;
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> W::Output {
        self.0.run::<R::Wide<S>>()
    }
}

/// The proof that the processor has the instructions of `S`, out of thin air: `Lanes` have no room to carry
/// it.
///
/// # Safety
/// Only where `S` has been detected. All uses are in methods of the wide types below. Their values and
/// functions are reached through [`LaneNumber::Wide`] alone, which nothing but [`InLanes`] names, and
/// `InLanes` is handed the proof.
#[inline(always)]
unsafe fn proof<S: Simd>() -> S {
    const { assert!(size_of::<S>() == 0) };
    // SAFETY: a type without size has one value, and no bytes of it are read; that the proof holds is the
    // caller's.
    unsafe { std::mem::transmute_copy(&()) }
}

/// Places of the nodes of packs of cells in the array of their block's vectors. Numbers are kept as offsets,
/// which the processor adds to an address without a shift. The largest offset of a block is found once for
/// all steps: a comparison for each access costs a tet 1 ns of 9.
pub(crate) struct Places<R, const N: usize> {
    /// Offsets in [`Unit`]s, multiples of a vector.
    offsets: Vec<[[u16; PACK]; N]>,
    /// The largest of each block.
    most: Vec<u16>,
    /// Packs of a block.
    per_block: usize,
    of: std::marker::PhantomData<R>,
}

/// The unit of an offset, as long as the largest factor of an index in an address.
type Unit = [u8; 8];

/// Units of a vector.
const fn units<R>() -> usize {
    size_of::<[R; 4]>() / size_of::<Unit>()
}

impl<R: LaneNumber, const N: usize> Places<R, N> {
    /// True if offsets reach all nodes of a block of `packs` packs.
    pub(crate) const fn can_number(packs: usize) -> bool {
        units::<R>() * packs * PACK * N <= 1 << 16
    }

    /// Makes the places from the node numbers of packs of cells, and the number of packs in a block. A block
    /// has at most as many packs as [offsets reach](Self::can_number).
    pub(crate) fn new(packs: impl Iterator<Item = [[u16; PACK]; N]>, per_block: usize) -> Self {
        let offset = |place: u16| place * units::<R>() as u16;
        let offsets: Vec<_> = packs.map(|pack| pack.map(|places| places.map(offset))).collect();
        let most = |block: &[[[u16; PACK]; N]]| {
            block.as_flattened().as_flattened().iter().copied().max().unwrap_or_default()
        };
        Self {
            most: offsets.chunks(per_block).map(most).collect(),
            offsets,
            per_block,
            of: std::marker::PhantomData,
        }
    }

    /// The vectors and sums of the nodes of a block, at work with its cells.
    ///
    /// # Panics
    /// If there are not as many sums as vectors, or a place lies beyond.
    #[inline(always)]
    pub(crate) fn at_work<'a>(
        &'a self,
        block: usize,
        vectors: &'a [[R; 4]],
        sums: &'a mut [[R; 4]],
    ) -> Local<'a, R, N> {
        assert_eq!(vectors.len(), sums.len());
        assert!(usize::from(self.most[block]) < vectors.len() * units::<R>());
        Local { vectors, sums, offsets: &self.offsets[self.packs_of(block)] }
    }

    /// The packs of a block.
    #[inline(always)]
    pub(crate) fn packs_of(&self, block: usize) -> Range<usize> {
        let first = block * self.per_block;
        first..self.offsets.len().min(first + self.per_block)
    }
}

/// The vectors and sums of the nodes of a block, and the offsets of its packs in them, which lie inside.
pub(crate) struct Local<'a, R, const N: usize> {
    vectors: &'a [[R; 4]],
    sums: &'a mut [[R; 4]],
    offsets: &'a [[[u16; PACK]; N]],
}

impl<R: LaneNumber, const N: usize> Local<'_, R, N> {
    /// The vectors of a node of each cell of a pack, from lane `at` on, component by component.
    #[inline(always)]
    pub(crate) fn gather<L: Lanes<R>>(&self, pack: usize, node: usize, at: usize) -> [L; 4] {
        // SAFETY: `Places` has found all offsets inside.
        unsafe { L::gather(self.vectors, &self.offsets[pack][node], at) }
    }

    /// Adds the vectors of a pack of cells, as [`Lanes::spread`] has written them, to the sums of their
    /// nodes, cell by cell.
    #[inline(always)]
    pub(crate) fn add<L: Lanes<R>>(&mut self, pack: usize, vectors: &[Pack<[R; 4]>; N]) {
        let offsets = &self.offsets[pack];
        // The compiler unrolls a loop over four lanes, so that the places of their rows are constants.
        for first in (0..PACK).step_by(4) {
            for lane in first..first + 4 {
                let row = L::row_of_lane(lane);
                for (vectors, offsets) in vectors.iter().zip(offsets) {
                    // SAFETY: `Places` has found all offsets inside, and nothing else refers to the sums.
                    let sum = unsafe { &mut *at_offset_mut(self.sums, offsets[lane]) };
                    *sum = plus(*sum, vectors.0[row]);
                }
            }
        }
    }

    /// Adds a number of each cell of a pack to the first component of the sums of all its nodes, cell by
    /// cell.
    #[inline(always)]
    pub(crate) fn add_number(&mut self, pack: usize, numbers: &Pack<R>) {
        let offsets = &self.offsets[pack];
        for lane in 0..PACK {
            for offsets in offsets {
                // SAFETY: `Places` has found all offsets inside, and the sums are borrowed alone.
                let sum = unsafe { &mut *at_offset_mut(self.sums, offsets[lane]) };
                sum[0] += numbers.0[lane];
            }
        }
    }
}

/// The vector at an offset of [`Places`].
///
/// # Safety
/// The offset lies inside.
#[inline(always)]
unsafe fn at_offset<R: Copy>(vectors: &[[R; 4]], offset: u16) -> [R; 4] {
    // SAFETY: the caller's.
    unsafe { *vectors.as_ptr().cast::<Unit>().add(usize::from(offset)).cast() }
}

/// Returns a pointer to the vector at an offset.
///
/// # Safety
/// The offset lies inside.
#[inline(always)]
unsafe fn at_offset_mut<R>(vectors: &mut [[R; 4]], offset: u16) -> *mut [R; 4] {
    // SAFETY: the caller's.
    unsafe { vectors.as_mut_ptr().cast::<Unit>().add(usize::from(offset)).cast() }
}

/// a + b. Both are read before anything is written, or the compiler takes number by number.
#[inline(always)]
pub(crate) fn plus<R: LaneNumber>(a: [R; 4], b: [R; 4]) -> [R; 4] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]]
}

/// Returns the lane that a row of four numbers becomes when pulp turns four registers full of rows into
/// components. The row is at `place` among the rows of a register. Rows are loaded in this order, so that the
/// lanes are in theirs.
const fn single_lane(_rows: usize, register: usize, place: usize) -> usize {
    4 * place + register
}

/// Returns the lane of a row as [`single_lane`] does, in double precision.
const fn double_lane(rows: usize, register: usize, place: usize) -> usize {
    if rows == 2 { register / 2 * 4 + 2 * place + register % 2 } else { register }
}

/// The inverse of [`single_lane`].
const fn single_row(rows: usize, lane: usize) -> usize {
    lane % 4 * rows + lane / 4
}

/// The inverse of [`double_lane`].
const fn double_row(rows: usize, lane: usize) -> usize {
    if rows == 2 { lane / 4 * 4 + lane % 2 * 2 + lane / 2 % 2 } else { lane }
}

macro_rules! wide {
    ($wide:ident, $type:ty, $vector:ident, $guess:expr, $iterations:literal,
     $add:ident, $sub:ident, $mul:ident, $div:ident, $neg:ident, $mul_add:ident, $sqrt:ident, $max:ident, $abs:ident,
     $and:ident, $or:ident, $splat:ident, $slice:ident, $slice_mut:ident, $deinterleave:ident, $interleave:ident, $lane_of_row:ident, $row_of_lane:ident) => {
        /// Numbers that fill a register.
        #[derive(Clone, Copy, Debug)]
        #[repr(transparent)]
        pub struct $wide<S: Simd>(S::$vector);

        impl<S: Simd> $wide<S> {
            #[inline(always)]
            fn simd() -> S {
                // SAFETY: see `proof`.
                unsafe { proof() }
            }

            const fn constant(value: $type) -> Self {
                const { assert!(size_of::<S::$vector>() <= size_of::<Pack<$type>>()) };
                // SAFETY: a vector is plain numbers (`Pod`), no longer than the array.
                Self(unsafe { std::mem::transmute_copy(&[value; PACK]) })
            }

            /// Returns the lane that a row of four numbers becomes when four registers full of rows are
            /// turned into components.
            #[inline(always)]
            const fn lane_of_row(row: usize) -> usize {
                let per_register = Self::WIDTH.div_ceil(4);
                let (register, place) = (row / per_register, row % per_register);
                $lane_of_row(per_register, register, place)
            }

            /// The components of as many rows as there are lanes.
            #[inline(always)]
            fn to_components(rows: &[[$type; 4]; PACK]) -> [Self; 4] {
                // SAFETY: vectors are plain numbers (`Pod`), four of them no longer than the rows.
                let registers: [S::$vector; 4] = unsafe { std::mem::transmute_copy(rows) };
                let [a, b, c, d] = Self::simd().$deinterleave(registers);
                [Self(a), Self(b), Self(c), Self(d)]
            }

            /// Lane by lane in plain numbers.
            #[inline(always)]
            fn each(self, f: impl Fn($type) -> $type) -> Self {
                let mut pack = Pack([0.0; PACK]);
                self.store(&mut pack, 0);
                for number in &mut pack.0[..Self::WIDTH] {
                    *number = f(*number);
                }
                Self::load(&pack, 0)
            }
        }

        impl<S: Simd> Lanes<$type> for $wide<S> {
            const WIDTH: usize = size_of::<S::$vector>() / size_of::<$type>();
            #[inline(always)]
            fn splat(value: $type) -> Self {
                Self(Self::simd().$splat(value))
            }
            #[inline(always)]
            fn load(pack: &Pack<$type>, at: usize) -> Self {
                Self(S::$slice(&pack.0).0[at / Self::WIDTH])
            }
            #[inline(always)]
            fn store(self, pack: &mut Pack<$type>, at: usize) {
                S::$slice_mut(&mut pack.0).0[at / Self::WIDTH] = self.0;
            }
            #[inline(always)]
            unsafe fn gather(vectors: &[[$type; 4]], offsets: &[u16; PACK], at: usize) -> [Self; 4] {
                let mut rows = [[0.0; 4]; PACK];
                for (row, to) in rows[..Self::WIDTH].iter_mut().enumerate() {
                    // SAFETY: the caller's.
                    *to = unsafe { at_offset(vectors, offsets[at + Self::lane_of_row(row)]) };
                }
                Self::to_components(&rows)
            }
            #[inline(always)]
            fn spread(components: [Self; 4], to: &mut Pack<[$type; 4]>, at: usize) {
                let [a, b, c, d] = components;
                let registers = Self::simd().$interleave([a.0, b.0, c.0, d.0]);
                let rows = &mut to.0[at..at + Self::WIDTH];
                // SAFETY: vectors are plain numbers (`Pod`), four of them as long as the rows; their
                // alignment is not asked for.
                unsafe { std::ptr::write_unaligned(rows.as_mut_ptr().cast(), registers) };
            }
            #[inline(always)]
            fn row_of_lane(lane: usize) -> usize {
                let (at, lane) = (lane / Self::WIDTH * Self::WIDTH, lane % Self::WIDTH);
                at + $row_of_lane(Self::WIDTH.div_ceil(4), lane)
            }
            #[inline(always)]
            fn call<W: LaneWork<$type>>(work: W) -> W::Output {
                Self::simd().vectorize(InLanes(work, std::marker::PhantomData::<$type>))
            }
        }

        impl<S: Simd> Number for $wide<S> {
            const ZERO: Self = Self::constant(0.0);
            const ONE: Self = Self::constant(1.0);
            #[inline(always)]
            fn of(value: f64) -> Self {
                Self::splat(value as $type)
            }
            #[inline(always)]
            fn mul_add(self, factor: Self, term: Self) -> Self {
                // SSE has no such instruction, and pulp asks the library for each number.
                if cfg!(target_arch = "x86_64") && size_of::<S::$vector>() == 16 {
                    return self * factor + term;
                }
                Self(Self::simd().$mul_add(self.0, factor.0, term.0))
            }
            #[inline(always)]
            fn inverse_cbrt(self) -> Self {
                // As in plain numbers; a third of the bits is their sum over 4, 16, 64, … in words of 32 bits
                // each.
                let simd = Self::simd();
                let bits: S::u32s = pulp::cast(self.0);
                let over = |bits, power| simd.wrapping_dyn_shr_u32s(bits, simd.splat_u32s(power));
                let third = simd.add_u32s(over(bits, 2), over(bits, 4));
                let third = simd.add_u32s(third, over(third, 4));
                let third = simd.add_u32s(third, over(third, 8));
                let guess: S::u32s = pulp::cast(Self::splat(<$type>::from_bits($guess)).0);
                let mut y = Self(pulp::cast(simd.sub_u32s(guess, third)));
                for _ in 0..$iterations {
                    y = closer_to_inverse_cbrt(self, y);
                }
                y
            }
            #[inline(always)]
            fn ln_1p(self) -> Self {
                self.each(<$type>::ln_1p)
            }
            #[inline(always)]
            fn exp(self) -> Self {
                self.each(<$type>::exp)
            }
            #[inline(always)]
            fn exp_m1(self) -> Self {
                self.each(<$type>::exp_m1)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                Self(Self::simd().$sqrt(self.0))
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                Self(Self::simd().$max(self.0, other.0))
            }
            #[inline(always)]
            fn copysign(self, sign: Self) -> Self {
                let simd = Self::simd();
                let sign = simd.$and(sign.0, Self::splat(-0.0).0);
                Self(simd.$or(simd.$abs(self.0), sign))
            }
            fn lane_by_lane<const N: usize, const M: usize>(
                given: [Self; N],
                find: impl Fn([f64; N]) -> [f64; M],
            ) -> [Self; M] {
                let given = given.map(|number| {
                    let mut pack = Pack([0.0; PACK]);
                    number.store(&mut pack, 0);
                    pack
                });
                let mut found = [Pack([0.0; PACK]); M];
                for lane in 0..Self::WIDTH {
                    let numbers = find(given.map(|pack| f64::from(pack.0[lane])));
                    found.iter_mut().zip(numbers).for_each(|(pack, number)| pack.0[lane] = number as $type);
                }
                found.map(|pack| Self::load(&pack, 0))
            }
        }

        wide!(@operator $wide, Add, add, $add);
        wide!(@operator $wide, Sub, sub, $sub);
        wide!(@operator $wide, Mul, mul, $mul);
        wide!(@operator $wide, Div, div, $div);

        impl<S: Simd> Neg for $wide<S> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Self(Self::simd().$neg(self.0))
            }
        }
        impl<S: Simd> AddAssign for $wide<S> {
            #[inline(always)]
            fn add_assign(&mut self, other: Self) {
                *self = *self + other;
            }
        }
        impl<S: Simd> SubAssign for $wide<S> {
            #[inline(always)]
            fn sub_assign(&mut self, other: Self) {
                *self = *self - other;
            }
        }

        impl Lanes<$type> for $type {
            const WIDTH: usize = 1;
            #[inline(always)]
            fn splat(value: $type) -> Self {
                value
            }
            #[inline(always)]
            fn load(pack: &Pack<$type>, at: usize) -> Self {
                pack.0[at]
            }
            #[inline(always)]
            fn store(self, pack: &mut Pack<$type>, at: usize) {
                pack.0[at] = self;
            }
            #[inline(always)]
            unsafe fn gather(vectors: &[[$type; 4]], offsets: &[u16; PACK], at: usize) -> [Self; 4] {
                // SAFETY: the caller's.
                unsafe { at_offset(vectors, offsets[at]) }
            }
            #[inline(always)]
            fn spread(components: [Self; 4], to: &mut Pack<[$type; 4]>, at: usize) {
                to.0[at] = components;
            }
            #[inline(always)]
            fn row_of_lane(lane: usize) -> usize {
                lane
            }
            #[inline(never)]
            fn call<W: LaneWork<$type>>(work: W) -> W::Output {
                work.run::<Self>()
            }
        }
    };
    (@operator $wide:ident, $trait:ident, $method:ident, $simd:ident) => {
        impl<S: Simd> $trait for $wide<S> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(Self::simd().$simd(self.0, other.0))
            }
        }
    };
}

wide!(
    WideF32,
    f32,
    f32s,
    1_419_916_000,
    2,
    add_f32s,
    sub_f32s,
    mul_f32s,
    div_f32s,
    neg_f32s,
    mul_add_e_f32s,
    sqrt_f32s,
    max_f32s,
    abs_f32s,
    and_f32s,
    or_f32s,
    splat_f32s,
    as_simd_f32s,
    as_mut_simd_f32s,
    deinterleave_shfl_f32s,
    interleave_shfl_f32s,
    single_lane,
    single_row
);
wide!(
    WideF64,
    f64,
    f64s,
    1_430_188_294 << 32,
    3,
    add_f64s,
    sub_f64s,
    mul_f64s,
    div_f64s,
    neg_f64s,
    mul_add_e_f64s,
    sqrt_f64s,
    max_f64s,
    abs_f64s,
    and_f64s,
    or_f64s,
    splat_f64s,
    as_simd_f64s,
    as_mut_simd_f64s,
    deinterleave_shfl_f64s,
    interleave_shfl_f64s,
    double_lane,
    double_row
);
