//! Forces and stiffness of eight facets at a time, in blocks of 3 × 3; `facet/single.rs` finds them one by
//! one. Only the symmetric part of the change of the force is made. G is the spin of the frame over
//! translations. S are the lever arms, and K the stiffness over spins. R = K Ψ is the effect of rigid turns.
//! The blocks of translations (T) and turns (R) are
//!
//! * T T: K − Qᵢ Gⱼ − (Qⱼ Gᵢ)ᵀ + ½ (Bᵢⱼ + Bⱼᵢᵀ), Qᵢ = Rᵢ + ½ (S(pᵢ) + S(fᵢ) + tᵢ) − ½ Gᵢᵀ W,
//! * R T: K − (Rᵢ + ½ S(mᵢ) + cᵢ) Gⱼ, and R R: K + cᵢ on the diagonal,
//!
//! with forces f, and forces p and moments m without the resultant. The symmetric parts c of the change of
//! moments are conjugate to spins. B with t is the change of G. A facet takes about 2,500 fused
//! multiplications and reads 1.6 kB.

mod placing;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use pliant_linear::lanes::{
    Lane, PACK, Pack, Square, Three, add_half_skew, apply, difference, dot, sum, symmetric, three, times,
    times_transposed, transpose,
};
use pulp::{Arch, Simd, WithSimd};

use crate::facet::{Broken, Facet, Matrix18, has_area, not_folded};
use crate::patch::Vector18;
use crate::rotation::{SMALL, eta, logarithm, mu};
use placing::Placing;

/// Entries of half of a symmetric matrix of eighteen rows.
const HALF: usize = 171;

/// The place of an entry in the lower half, row by row.
const fn place(row: usize, column: usize) -> usize {
    row * (row + 1) / 2 + column
}

/// Data of eight facets at rest; unused lanes of the last pack mean nothing.
#[derive(Clone, Debug)]
pub struct FacetPack {
    stiffness: [Pack; HALF],
    tension: [Pack; 18],
    gradient: [Pack; 6],
    /// Corners and the rotation to the axes, (w, x, y, z), as [`Placing`] finds them there: a facet at rest
    /// then has exactly no deformation.
    corners: [Pack; 6],
    turn: [Pack; 4],
}

impl FacetPack {
    /// Facets in their order, with the positions [m] of nodes at rest.
    pub fn packed(arch: Arch, facets: &[Facet], rest: impl Fn(u32) -> Vector3<f64>) -> Vec<Self> {
        let mut work = Work::new();
        facets.chunks(PACK).map(|facets| Self::of(arch, facets, &rest, &mut work)).collect()
    }

    fn of(arch: Arch, facets: &[Facet], rest: impl Fn(u32) -> Vector3<f64>, work: &mut Work) -> Self {
        let (none, one) = ([0.0; PACK], [1.0; PACK]);
        let mut pack = Self {
            stiffness: [none; HALF],
            tension: [none; 18],
            gradient: [none; 6],
            corners: [none; 6],
            turn: [one, none, none, none],
        };
        for (lane, facet) in facets.iter().enumerate() {
            for (row, column) in (0..18).flat_map(|row| (0..=row).map(move |column| (row, column))) {
                pack.stiffness[place(row, column)][lane] = facet.stiffness()[(row, column)];
            }
            for (entry, value) in pack.tension.iter_mut().zip(facet.tension().iter()) {
                entry[lane] = *value;
            }
            for (k, entry) in pack.gradient.iter_mut().enumerate() {
                entry[lane] = facet.gradient()[k / 2][k % 2];
            }
            work.put(lane, &facet.nodes.map(&rest), &[UnitQuaternion::identity(); 3]);
        }
        arch.dispatch(Placing { pack: &pack, work });
        pack.corners = work.local;
        let back = [0, 1, 2, 3].map(|k| work.relative[k]);
        pack.turn = [back[0], back[1].map(|x| -x), back[2].map(|y| -y), back[3].map(|z| -z)];
        pack
    }
}

/// Puts (w, x, y, z) into a lane.
fn put_turn(to: &mut [Pack], lane: usize, turn: &UnitQuaternion<f64>) {
    for (entry, value) in to.iter_mut().zip([turn.w, turn.i, turn.j, turn.k]) {
        entry[lane] = value;
    }
}

/// Positions of eight facets, and results.
#[derive(Clone, Debug)]
pub struct Work {
    /// Positions and rotations of the nodes.
    position: [Pack; 9],
    rotation: [Pack; 12],
    double_area: Pack,
    /// Rotations of the nodes relative to the facet, and the share of the vector in their squares: the sine
    /// squared of half the angle.
    relative: [Pack; 12],
    share: [Pack; 3],
    broken: [Option<Broken>; PACK],
    axes: [Pack; 9],
    local: [Pack; 6],
    /// 1/(F11 + F22).
    inverse_trace: Pack,
    theta: [Pack; 9],
    /// η and μ of the turns of nodes ([`spin_to_vector`](crate::rotation::spin_to_vector)).
    eta: [Pack; 3],
    mu: [Pack; 3],
    deformation: [Pack; 18],
    energy: Pack,
    force: [Pack; 18],
    tangent: [Pack; HALF],
}

impl Work {
    /// Without facets.
    #[expect(clippy::new_without_default, reason = "it is large")]
    pub fn new() -> Self {
        let none = [0.0; PACK];
        Self {
            position: [none; 9],
            rotation: [none; 12],
            double_area: none,
            relative: [none; 12],
            share: [none; 3],
            broken: [None; PACK],
            axes: [none; 9],
            local: [none; 6],
            inverse_trace: none,
            theta: [none; 9],
            eta: [none; 3],
            mu: [none; 3],
            deformation: [none; 18],
            energy: none,
            force: [none; 18],
            tangent: [none; HALF],
        }
    }

    /// Puts the nodes of a facet into a lane: positions [m] and rotations from rest.
    pub fn put(&mut self, lane: usize, x: &[Vector3<f64>; 3], rotation: &[UnitQuaternion<f64>; 3]) {
        for (entry, value) in self.position.iter_mut().zip(x.iter().flatten()) {
            entry[lane] = *value;
        }
        for (to, rotation) in self.rotation.chunks_mut(4).zip(rotation) {
            put_turn(to, lane, rotation);
        }
    }

    /// Finds energies and forces of the first facets of a pack, and the stiffness if it is wanted.
    pub fn find(&mut self, arch: Arch, pack: &FacetPack, facets: usize, tangent: bool) {
        arch.dispatch(Placing { pack, work: self });
        for lane in 0..facets {
            self.broken[lane] = self.turn_far(lane).err();
        }
        arch.dispatch(Kernel { pack, work: self, tangent });
    }

    /// Finds the nodes of a lane that have turned far.
    fn turn_far(&mut self, lane: usize) -> Result<(), Broken> {
        has_area(self.double_area[lane])?;
        for node in 0..3 {
            // Written so that NaN is found too.
            if self.share[node][lane] < SMALL {
                continue;
            }
            let [w, x, y, z] = [0, 1, 2, 3].map(|k| self.relative[4 * node + k][lane]);
            let theta = logarithm(&UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z)));
            not_folded(&theta)?;
            let angle = theta.norm();
            (self.eta[node][lane], self.mu[node][lane]) = (eta(angle), mu(angle));
            for c in 0..3 {
                self.theta[3 * node + c][lane] = theta[c];
                self.deformation[6 * node + 3 + c][lane] = theta[c];
            }
        }
        Ok(())
    }

    /// Reason why the facet in a lane has no force.
    pub fn broken(&self, lane: usize) -> Option<Broken> {
        self.broken[lane]
    }

    /// Energy [J] and forces [N, N m] in a lane.
    pub fn force(&self, lane: usize) -> (f64, Vector18) {
        (self.energy[lane], Vector18::from_fn(|i, _| self.force[i][lane]))
    }

    /// The stiffness in a lane.
    pub fn take_tangent(&self, lane: usize, tangent: &mut Matrix18) {
        for row in 0..18 {
            for column in 0..=row {
                let entry = self.tangent[place(row, column)][lane];
                tangent[(row, column)] = entry;
                tangent[(column, row)] = entry;
            }
        }
    }
}

struct Kernel<'a> {
    pack: &'a FacetPack,
    work: &'a mut Work,
    tangent: bool,
}

impl WithSimd for Kernel<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for register in 0..PACK / S::F64_LANES {
            let now = Now::new(simd, self.pack, self.work, register);
            now.force(self.work, register);
            if self.tangent {
                now.tangent(self.pack, self.work, register);
            }
        }
    }
}

/// A matrix with nothing else than the entries xz, yz, zx, zy.
#[derive(Clone, Copy)]
struct Sparse<S: Simd> {
    xz: Lane<S>,
    yz: Lane<S>,
    zx: Lane<S>,
    zy: Lane<S>,
}

impl<S: Simd> Sparse<S> {
    /// M times this.
    #[inline(always)]
    fn after(&self, m: &Square<S>) -> Square<S> {
        let row = |m: &Three<S>| [m[2] * self.zx, m[2] * self.zy, (m[0] * self.xz).plus(m[1], self.yz)];
        [row(&m[0]), row(&m[1]), row(&m[2])]
    }

    /// The transpose of this times M.
    #[inline(always)]
    fn transposed_before(&self, m: &Square<S>) -> Square<S> {
        [
            three(|j| m[2][j] * self.zx),
            three(|j| m[2][j] * self.zy),
            three(|j| (m[0][j] * self.xz).plus(m[1][j], self.yz)),
        ]
    }
}

/// Facets where they are, in registers.
struct Now<S: Simd> {
    simd: S,
    axes: Square<S>,
    /// H of each node.
    turn: [Square<S>; 3],
    arm: [Sparse<S>; 3],
    spin: [Sparse<S>; 3],
    /// Forces and moments as the stiffness gives them; moments conjugate to spins.
    raw: [Three<S>; 6],
    spun: [Three<S>; 6],
    /// Forces and moments without their resultant; moment of `spun` about the centroid.
    projected: [Three<S>; 6],
    moment: Three<S>,
    energy: Lane<S>,
}

/// Blocks of the stiffness over spins.
struct OverSpins<S: Simd> {
    /// Blocks of turns and translations.
    mixed: [[Square<S>; 3]; 3],
    /// Blocks of turns, on and below the diagonal.
    turned: [Square<S>; 6],
    /// Symmetric parts of the change of moments.
    corrections: [Square<S>; 3],
    /// Effect of rigid turns on each row.
    of_rigid: [Square<S>; 6],
}

impl<S: Simd> OverSpins<S> {
    /// A block of turns.
    #[inline(always)]
    fn turns(&self, i: usize, j: usize) -> Square<S> {
        if i >= j { self.turned[place(i, j)] } else { transpose(&self.turned[place(j, i)]) }
    }
}

#[inline(always)]
fn load3<S: Simd>(simd: S, from: &[Pack], at: usize, register: usize) -> Three<S> {
    three(|k| Lane::load(simd, &from[at + k], register))
}

/// Three rows and columns of the stiffness at rest.
#[inline(always)]
fn block<S: Simd>(simd: S, pack: &FacetPack, register: usize, [a, b]: [usize; 2]) -> Square<S> {
    let mut block = [[Lane::splat(simd, 0.0); 3]; 3];
    for (r, row) in block.iter_mut().enumerate() {
        for (c, entry) in row.iter_mut().enumerate() {
            let (row, column) = (3 * a + r, 3 * b + c);
            let at = if row >= column { place(row, column) } else { place(column, row) };
            *entry = Lane::load(simd, &pack.stiffness[at], register);
        }
    }
    block
}

impl<S: Simd> Now<S> {
    #[inline(always)]
    fn new(simd: S, pack: &FacetPack, work: &Work, register: usize) -> Self {
        let load = |from: &Pack| Lane::load(simd, from, register);
        let axes = three(|row| load3(simd, &work.axes, 3 * row, register));
        let (mut raw, mut energy) = ([[Lane::splat(simd, 0.0); 3]; 6], Lane::splat(simd, 0.0));
        let d = |i: usize| load(&work.deformation[i]);
        for i in 0..18 {
            let tension = load(&pack.tension[i]);
            let mut force = tension;
            for j in 0..18 {
                let at = if j <= i { place(i, j) } else { place(j, i) };
                force = force.plus(load(&pack.stiffness[at]), d(j));
            }
            raw[i / 3][i % 3] = force;
            energy = energy.plus(d(i), (force + tension).half());
        }
        let one = Lane::splat(simd, 1.0);
        let mut turn = [axes; 3];
        let mut spun = raw;
        for node in 0..3 {
            let [x, y, z] = load3(simd, &work.theta, 3 * node, register);
            let eta = load(&work.eta[node]);
            // I − S/2 + η S², S² = θ θᵀ − |θ|² I.
            let [xx, yy, zz] = [x * x, y * y, z * z];
            let square = [[-(yy + zz), x * y, x * z], [x * y, -(xx + zz), y * z], [x * z, y * z, -(xx + yy)]];
            let mut h = three(|i| three(|j| square[i][j] * eta));
            (0..3).for_each(|k| h[k][k] = h[k][k] + one);
            add_half_skew(&mut h, &[-x, -y, -z]);
            spun[2 * node + 1] = apply(&transpose(&h), &raw[2 * node + 1]);
            turn[node] = h;
        }
        let local = three(|i| [load(&work.local[2 * i]), load(&work.local[2 * i + 1])]);
        let arm = three(|i| {
            let [x, y] = local[i];
            Sparse { xz: y, yz: -x, zx: -y, zy: x }
        });
        let inverse_trace = load(&work.inverse_trace);
        let mut spin = arm;
        let [p, q, r] = [local[0], local[1], local[2]];
        let double_area = ((q[0] - p[0]) * (r[1] - p[1])).less(r[0] - p[0], q[1] - p[1]);
        let inverse = one.over(double_area);
        for (i, spin) in spin.iter_mut().enumerate() {
            let [a, b] = [local[(i + 1) % 3], local[(i + 2) % 3]];
            let rest = [
                load(&pack.gradient[2 * i]) * inverse_trace,
                load(&pack.gradient[2 * i + 1]) * inverse_trace,
            ];
            // ∇N of the present shape: (y₂ − y₃, x₃ − x₂)/2A.
            *spin = Sparse {
                xz: (b[0] - a[0]) * inverse,
                yz: (b[1] - a[1]) * inverse,
                zx: -rest[1],
                zy: rest[0],
            };
        }
        let third = Lane::splat(simd, 1.0 / 3.0);
        let mean = three(|c| (spun[0][c] + spun[2][c] + spun[4][c]) * third);
        let mut moment = three(|c| spun[1][c] + spun[3][c] + spun[5][c]);
        for (i, [x, y]) in local.into_iter().enumerate() {
            let f = spun[2 * i];
            moment[0] = moment[0].plus(y, f[2]);
            moment[1] = moment[1].less(x, f[2]);
            moment[2] = moment[2].plus(x, f[1]).less(y, f[0]);
        }
        let mut projected = spun;
        for (i, g) in spin.iter().enumerate() {
            let f = &mut projected[2 * i];
            f[0] = (f[0] - mean[0]).less(g.zx, moment[2]);
            f[1] = (f[1] - mean[1]).less(g.zy, moment[2]);
            f[2] = (f[2] - mean[2]).less(g.xz, moment[0]).less(g.yz, moment[1]);
        }
        Self { simd, axes, turn, arm, spin, raw, spun, projected, moment, energy }
    }

    /// Writes energies and forces, in space.
    #[inline(always)]
    fn force(&self, work: &mut Work, register: usize) {
        self.energy.store(&mut work.energy, register);
        for (a, force) in self.projected.iter().enumerate() {
            for (c, force) in apply(&self.axes, force).into_iter().enumerate() {
                force.store(&mut work.force[3 * a + c], register);
            }
        }
    }

    /// The symmetric part of the change of each moment that is conjugate to spins.
    #[inline(always)]
    fn correction(&self, node: usize, work: &Work, register: usize) -> Square<S> {
        let theta = load3(self.simd, &work.theta, 3 * node, register);
        let eta = Lane::load(self.simd, &work.eta[node], register);
        let mu = Lane::load(self.simd, &work.mu[node], register);
        let m = &self.raw[2 * node + 1];
        let along = dot(&theta, m);
        let squared = dot(&theta, &theta);
        // η (θ·m I + θ mᵀ − 2 m θᵀ) + μ S² m θᵀ − S(m)/2, S² m = (θ·m) θ − |θ|² m.
        let mut change = self.turn[node];
        for i in 0..3 {
            let bent = (along * theta[i]).less(squared, m[i]) * mu;
            for j in 0..3 {
                let outer = (theta[i] * m[j]).less(m[i] + m[i], theta[j]);
                change[i][j] = (bent * theta[j]).plus(outer, eta);
            }
        }
        (0..3).for_each(|k| change[k][k] = change[k][k].plus(along, eta));
        add_half_skew(&mut change, &[-m[0], -m[1], -m[2]]);
        symmetric(&times(&change, &self.turn[node]))
    }

    /// Writes the stiffness, in space.
    #[inline(always)]
    fn tangent(&self, pack: &FacetPack, work: &mut Work, register: usize) {
        let none = [[Lane::splat(self.simd, 0.0); 3]; 3];
        let mut over = OverSpins {
            mixed: [[none; 3]; 3],
            turned: [none; 6],
            corrections: [none; 3],
            of_rigid: [none; 6],
        };
        self.spin(&mut over, pack, work, register);
        self.turn_rigidly(&mut over, pack, register);
        let whole = self.of_rigid_from_rigid(&over);
        self.write_translations(pack, &over, &whole, work, register);
        self.write_turns(&over, work, register);
    }

    /// Finds Hᵀ K H but for translations alone, and the corrections. In loops: closures of `map` are left as
    /// calls, without the instructions of this kernel, and take most of its time.
    #[inline(always)]
    fn spin(&self, over: &mut OverSpins<S>, pack: &FacetPack, work: &Work, register: usize) {
        for i in 0..3 {
            let back = transpose(&self.turn[i]);
            for (j, mixed) in over.mixed[i].iter_mut().enumerate() {
                *mixed = times(&back, &block(self.simd, pack, register, [2 * i + 1, 2 * j]));
            }
            for j in 0..=i {
                over.turned[place(i, j)] = times(
                    &times(&back, &block(self.simd, pack, register, [2 * i + 1, 2 * j + 1])),
                    &self.turn[j],
                );
            }
            over.corrections[i] = self.correction(i, work, register);
        }
    }

    /// Finds the effect of rigid turns on the stiffness over spins.
    #[inline(always)]
    fn turn_rigidly(&self, over: &mut OverSpins<S>, pack: &FacetPack, register: usize) {
        for i in 0..3 {
            for (j, arm) in self.arm.iter().enumerate() {
                let turns = difference(&over.turns(i, j), &arm.after(&over.mixed[i][j]));
                over.of_rigid[2 * i + 1] =
                    if j == 0 { turns } else { sum(&over.of_rigid[2 * i + 1], &turns) };
                let ways = difference(
                    &transpose(&over.mixed[j][i]),
                    &arm.after(&block(self.simd, pack, register, [2 * i, 2 * j])),
                );
                over.of_rigid[2 * i] = if j == 0 { ways } else { sum(&over.of_rigid[2 * i], &ways) };
            }
        }
    }

    /// Half of the symmetric part of the effect of rigid turns, in rigid turns: ½ W.
    #[inline(always)]
    fn of_rigid_from_rigid(&self, over: &OverSpins<S>) -> Square<S> {
        let zero = Lane::splat(self.simd, 0.0);
        let mut whole = [[zero; 3]; 3];
        for i in 0..3 {
            whole = sum(&whole, &over.of_rigid[2 * i + 1]);
            whole = difference(&whole, &self.arm[i].transposed_before(&over.of_rigid[2 * i]));
            whole = sum(&whole, &over.corrections[i]);
            let [x, y, z] = self.spun[2 * i];
            let skew = [[zero, -z, y], [z, zero, -x], [-y, x, zero]];
            whole = sum(&whole, &self.arm[i].after(&skew));
        }
        whole = symmetric(&whole);
        for row in &mut whole {
            for entry in row {
                *entry = entry.half();
            }
        }
        whole
    }

    /// Writes the blocks of translations.
    #[inline(always)]
    fn write_translations(
        &self,
        pack: &FacetPack,
        over: &OverSpins<S>,
        whole: &Square<S>,
        work: &mut Work,
        register: usize,
    ) {
        let mut left = [[[Lane::splat(self.simd, 0.0); 3]; 3]; 3];
        for (i, left) in left.iter_mut().enumerate() {
            let mut change = over.of_rigid[2 * i];
            let [p, f] = [&self.projected[2 * i], &self.spun[2 * i]];
            add_half_skew(&mut change, &[p[0] + f[0], p[1] + f[1], p[2] + f[2]]);
            // Of the change of G: the frame tilts with the corners.
            let g = &self.spin[i];
            let tilt = (g.xz * self.moment[1]).less(g.yz, self.moment[0]);
            change[2][2] = change[2][2] - tilt.half();
            *left = difference(&change, &g.transposed_before(whole));
        }
        for i in 0..3 {
            for j in 0..=i {
                let mut change = difference(
                    &block(self.simd, pack, register, [2 * i, 2 * j]),
                    &self.spin[j].after(&left[i]),
                );
                change = difference(&change, &transpose(&self.spin[i].after(&left[j])));
                self.add_frame_change(&mut change, i, j);
                self.write(work, register, [2 * i, 2 * j], &change);
            }
        }
    }

    /// Writes the blocks of turns with translations, and of turns.
    #[inline(always)]
    fn write_turns(&self, over: &OverSpins<S>, work: &mut Work, register: usize) {
        for i in 0..3 {
            let mut turn = sum(&over.of_rigid[2 * i + 1], &over.corrections[i]);
            add_half_skew(&mut turn, &self.projected[2 * i + 1]);
            for (j, block) in over.mixed[i].iter().enumerate() {
                let mixed = difference(block, &self.spin[j].after(&turn));
                if i >= j {
                    self.write(work, register, [2 * i + 1, 2 * j], &mixed);
                } else {
                    self.write(work, register, [2 * j, 2 * i + 1], &transpose(&mixed));
                }
            }
            for j in 0..=i {
                let turned = over.turned[place(i, j)];
                let turned = if i == j { sum(&turned, &over.corrections[i]) } else { turned };
                self.write(work, register, [2 * i + 1, 2 * j + 1], &turned);
            }
        }
    }

    /// Adds ½ (Bᵢⱼ + Bⱼᵢᵀ), Bᵢⱼ = e_z nᵢᵀ (Mx nⱼy − My nⱼx) + Mz hᵢ rⱼᵀ/tr.
    #[inline(always)]
    fn add_frame_change(&self, block: &mut Square<S>, i: usize, j: usize) {
        let [mx, my, mz] = three(|k| self.moment[k].half());
        let (a, b) = (&self.spin[i], &self.spin[j]);
        let tilt = |g: &Sparse<S>| (mx * g.xz).plus(my, g.yz);
        let (tilt_a, tilt_b) = (tilt(a), tilt(b));
        // n = (−yz, xz).
        block[2][0] = block[2][0].less(a.yz, tilt_b);
        block[2][1] = block[2][1].plus(a.xz, tilt_b);
        block[0][2] = block[0][2].less(b.yz, tilt_a);
        block[1][2] = block[1][2].plus(b.xz, tilt_a);
        // h = (zx, zy), r = (zy, −zx).
        let [ha, hb] = [[a.zx, a.zy], [b.zx, b.zy]];
        let [ra, rb] = [[a.zy, -a.zx], [b.zy, -b.zx]];
        for r in 0..2 {
            for c in 0..2 {
                block[r][c] = block[r][c].plus(mz, (ha[r] * rb[c]).plus(ra[r], hb[c]));
            }
        }
    }

    /// Writes a block on or below the diagonal, in space.
    #[inline(always)]
    fn write(&self, work: &mut Work, register: usize, [a, b]: [usize; 2], block: &Square<S>) {
        let turned = times_transposed(&times(&self.axes, block), &self.axes);
        for (r, row) in turned.into_iter().enumerate() {
            for (c, entry) in row.into_iter().enumerate() {
                if a > b || r >= c {
                    entry.store(&mut work.tangent[place(3 * a + r, 3 * b + c)], register);
                }
            }
        }
    }
}
