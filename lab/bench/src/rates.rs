//! Peak rates of the machine: copy and multiply-add, measured at run time.
//!
//! *Copy*: `copy_from_slice` of 128 MiB into another 128 MiB, each thread a part. Bytes read and written are
//! counted, not the cache lines that the CPU fetches before overwriting them. *Multiply-add*: x ← x a + b on
//! twelve independent wide registers, which hides the latency of most CPUs; two operations each. `pulp` finds
//! the widest instructions at run time (AVX-512, AVX2 with FMA, NEON; elsewhere 128 bits or scalar), whatever
//! the target of the build. The best of the repeats counts, as the least disturbed one.

use std::hint::black_box;
use std::time::Instant;

use pulp::{Simd, WithSimd};
use rayon::ThreadPool;
use rayon::prelude::*;
use serde::Serialize;

use crate::case::Precision;

/// Bytes of the array that is copied.
const COPIED: usize = 128 << 20;
/// Independent registers.
const CHAINS: usize = 12;
/// Multiply-adds of each between two readings of the clock.
const ROUNDS: usize = 1_000_000;

/// Peak rates of a number of threads.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Rates {
    /// Threads.
    pub threads: usize,
    /// Bytes read and written in copying [1/s].
    pub copy: f64,
    /// Operations in multiply-adds [1/s], single precision.
    pub single: f64,
    /// Operations in multiply-adds [1/s], double precision.
    pub double: f64,
}

impl Rates {
    /// Measures `repeats` times with all threads of a pool.
    pub fn measure(pool: &ThreadPool, repeats: usize) -> Self {
        let best = |once: &mut dyn FnMut() -> f64| (0..repeats).map(|_| once()).fold(0.0, f64::max);
        let (from, mut to) = (vec![1_u64; COPIED / 8], vec![0_u64; COPIED / 8]);
        Self {
            threads: pool.current_num_threads(),
            copy: best(&mut || copy(pool, &from, &mut to)),
            single: best(&mut || multiply_add(pool, Precision::Single)),
            double: best(&mut || multiply_add(pool, Precision::Double)),
        }
    }

    /// Operations in multiply-adds [1/s] in a number type.
    pub fn multiply_add(&self, precision: Precision) -> f64 {
        match precision {
            Precision::Single => self.single,
            Precision::Double => self.double,
        }
    }
}

/// Bytes read and written a second.
fn copy(pool: &ThreadPool, from: &[u64], to: &mut [u64]) -> f64 {
    let part = from.len().div_ceil(pool.current_num_threads());
    let started = Instant::now();
    pool.install(|| {
        to.par_chunks_mut(part).zip(from.par_chunks(part)).for_each(|(to, from)| to.copy_from_slice(from));
    });
    let seconds = started.elapsed().as_secs_f64();
    black_box(to);
    2.0 * size_of_val(from) as f64 / seconds
}

/// Operations a second.
fn multiply_add(pool: &ThreadPool, precision: Precision) -> f64 {
    let arch = pulp::Arch::new();
    let started = Instant::now();
    let operations = pool.broadcast(|_| match precision {
        Precision::Single => arch.dispatch(SingleChains),
        Precision::Double => arch.dispatch(DoubleChains),
    });
    operations.into_iter().sum::<usize>() as f64 / started.elapsed().as_secs_f64()
}

struct SingleChains;
struct DoubleChains;

impl WithSimd for SingleChains {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> usize {
        // Tends to b/(1 − a) = 2: neither grows nor vanishes.
        let (a, b) = (simd.splat_f32s(black_box(0.5)), simd.splat_f32s(black_box(1.0)));
        let mut x = [simd.splat_f32s(black_box(1.0)); CHAINS];
        for _ in 0..ROUNDS {
            for x in &mut x {
                *x = simd.mul_add_e_f32s(*x, a, b);
            }
        }
        black_box(x);
        2 * ROUNDS * CHAINS * S::F32_LANES
    }
}

impl WithSimd for DoubleChains {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> usize {
        let (a, b) = (simd.splat_f64s(black_box(0.5)), simd.splat_f64s(black_box(1.0)));
        let mut x = [simd.splat_f64s(black_box(1.0)); CHAINS];
        for _ in 0..ROUNDS {
            for x in &mut x {
                *x = simd.mul_add_e_f64s(*x, a, b);
            }
        }
        black_box(x);
        2 * ROUNDS * CHAINS * S::F64_LANES
    }
}
