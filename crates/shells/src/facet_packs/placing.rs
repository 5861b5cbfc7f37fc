//! Placing of eight facets: axes, corners, turns of nodes and deformations, like
//! [`Facet::place`](crate::facet::Facet) one by one. A facet takes about 500 operations. Nodes that have
//! turned by more than half a radian are left to code that finds one angle at a time.

use pliant_linear::lanes::{Lane, PACK, Pack, Square, Three, cross, dot, three};
use pulp::{Simd, WithSimd};

use super::{FacetPack, Work, load3};
use crate::rotation::{ARCSINE, BERNOULLI};

/// (w, x, y, z).
type Turn<S> = [Lane<S>; 4];

/// Places the facets of a pack.
pub(super) struct Placing<'a> {
    pub(super) pack: &'a FacetPack,
    pub(super) work: &'a mut Work,
}

impl WithSimd for Placing<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for register in 0..PACK / S::F64_LANES {
            let axes = place_corners(simd, self.pack, self.work, register);
            turn_nodes(simd, self.pack, self.work, register, &turn_of(simd, &axes));
        }
    }
}

#[inline(always)]
fn load4<S: Simd>(simd: S, from: &[Pack], at: usize, register: usize) -> Turn<S> {
    let load = |k: usize| Lane::load(simd, &from[at + k], register);
    [load(0), load(1), load(2), load(3)]
}

/// Finds areas, axes and corners, and the axes' rows.
#[inline(always)]
fn place_corners<S: Simd>(simd: S, pack: &FacetPack, work: &mut Work, register: usize) -> Square<S> {
    let (zero, one) = (Lane::splat(simd, 0.0), Lane::splat(simd, 1.0));
    let x = three(|i| load3(simd, &work.position, 3 * i, register));
    let third = Lane::splat(simd, 1.0 / 3.0);
    let centroid = three(|c| (x[0][c] + x[1][c] + x[2][c]) * third);
    let (along, aside) = (three(|c| x[1][c] - x[0][c]), three(|c| x[2][c] - x[0][c]));
    let upright = cross(&along, &aside);
    let double_area = dot(&upright, &upright).sqrt();
    double_area.store(&mut work.double_area, register);
    let unit = |v: &Three<S>, length: Lane<S>| three(|c| v[c].over(length));
    let normal = unit(&upright, double_area);
    let side = unit(&along, dot(&along, &along).sqrt());
    let across = cross(&normal, &side);
    let flat = three(|i| {
        let from = three(|c| x[i][c] - centroid[c]);
        [dot(&side, &from), dot(&across, &from)]
    });
    // F = Σ q ⊗ ∇N, and the rotation of its polar decomposition.
    let f = |row: usize, column: usize| {
        let gradient = |i: usize| Lane::load(simd, &pack.gradient[2 * i + column], register);
        (flat[0][row] * gradient(0)).plus(flat[1][row], gradient(1)).plus(flat[2][row], gradient(2))
    };
    let (sum, difference) = (f(0, 0) + f(1, 1), f(1, 0) - f(0, 1));
    let trace = (sum * sum).plus(difference, difference).sqrt();
    one.over(trace).store(&mut work.inverse_trace, register);
    let sine = zero.if_less(trace, difference.over(trace), zero);
    let cosine = zero.if_less(trace, sum.over(trace), one);
    let axes = three(|c| {
        [(side[c] * cosine).plus(across[c], sine), (across[c] * cosine).less(side[c], sine), normal[c]]
    });
    for (row, entries) in axes.iter().enumerate() {
        entries.iter().enumerate().for_each(|(c, entry)| entry.store(&mut work.axes[3 * row + c], register));
    }
    for (i, [x, y]) in flat.into_iter().enumerate() {
        for (c, value) in [(x * cosine).plus(y, sine), (y * cosine).less(x, sine)].into_iter().enumerate() {
            value.store(&mut work.local[2 * i + c], register);
            let rest = Lane::load(simd, &pack.corners[2 * i + c], register);
            (value - rest).store(&mut work.deformation[6 * i + c], register);
        }
    }
    axes
}

/// The rotation with such a matrix, from the largest of four times its components squared (Shepperd 1978).
#[inline(always)]
fn turn_of<S: Simd>(simd: S, m: &Square<S>) -> Turn<S> {
    let one = Lane::splat(simd, 1.0);
    let [x, y, z] = [m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]];
    let [xy, yz, xz] = [m[0][1] + m[1][0], m[1][2] + m[2][1], m[0][2] + m[2][0]];
    let [a, b, c] = [m[0][0], m[1][1], m[2][2]];
    let mut best = [one + a + b + c, x, y, z];
    let mut largest = best[0];
    let others = [[x, one + a - b - c, xy, xz], [y, xy, one - a + b - c, yz], [z, xz, yz, one - a - b + c]];
    for (k, other) in others.into_iter().enumerate() {
        let diagonal = other[k + 1];
        for (best, other) in best.iter_mut().zip(other) {
            *best = largest.if_less(diagonal, other, *best);
        }
        largest = largest.if_less(diagonal, diagonal, largest);
    }
    let scale = Lane::splat(simd, 0.5).over(largest.sqrt());
    [best[0] * scale, best[1] * scale, best[2] * scale, best[3] * scale]
}

/// a b. Neither fused nor in another order: the product of a rotation and its inverse has exactly no vector.
#[inline(always)]
fn product<S: Simd>(&[aw, ax, ay, az]: &Turn<S>, &[bw, bx, by, bz]: &Turn<S>) -> Turn<S> {
    [
        aw * bw - ax * bx - ay * by - az * bz,
        (aw * bx + ax * bw) + (ay * bz - az * by),
        (aw * by + ay * bw) + (az * bx - ax * bz),
        (aw * bz + az * bw) + (ax * by - ay * bx),
    ]
}

/// Σ cₖ xᵏ.
#[inline(always)]
fn series<S: Simd, const N: usize>(simd: S, x: Lane<S>, coefficient: impl Fn(usize) -> f64) -> Lane<S> {
    let mut sum = Lane::splat(simd, coefficient(N - 1));
    for k in (0..N - 1).rev() {
        sum = Lane::splat(simd, coefficient(k)).plus(sum, x);
    }
    sum
}

/// Finds the rotations of the nodes relative to the facet, by the series of small angles.
#[inline(always)]
fn turn_nodes<S: Simd>(simd: S, pack: &FacetPack, work: &mut Work, register: usize, axes: &Turn<S>) {
    const TERMS: usize = BERNOULLI.len();
    let zero = Lane::splat(simd, 0.0);
    let back = [axes[0], -axes[1], -axes[2], -axes[3]];
    let rest = load4(simd, &pack.turn, 0, register);
    for node in 0..3 {
        let turn = load4(simd, &work.rotation, 4 * node, register);
        let relative = product(&product(&back, &turn), &rest);
        for (entry, pack) in relative.iter().zip(&mut work.relative[4 * node..]) {
            entry.store(pack, register);
        }
        let [w, x, y, z] = relative;
        let squared = dot(&[x, y, z], &[x, y, z]);
        let size = squared.plus(w, w);
        let share = squared.over(size);
        share.store(&mut work.share[node], register);
        let factor = series::<S, { ARCSINE.len() }>(simd, share, |k| 2.0 * ARCSINE[k]).over(size.sqrt());
        let factor = w.if_less(zero, -factor, factor);
        let theta = [x * factor, y * factor, z * factor];
        let angle_squared = dot(&theta, &theta);
        series::<S, TERMS>(simd, angle_squared, |k| BERNOULLI[k]).store(&mut work.eta[node], register);
        // (dη/dθ)/θ.
        let slope = |k: usize| 2.0 * (k + 1) as f64 * BERNOULLI[k + 1];
        series::<S, { TERMS - 1 }>(simd, angle_squared, slope).store(&mut work.mu[node], register);
        for (c, theta) in theta.into_iter().enumerate() {
            theta.store(&mut work.theta[3 * node + c], register);
            theta.store(&mut work.deformation[6 * node + 3 + c], register);
        }
    }
}
