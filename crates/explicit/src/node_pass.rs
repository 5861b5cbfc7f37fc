//! The nodes of a step: increments from the forces of an instant, forces that move prescribed nodes, and the
//! sums for the energies.

use pliant_mechanics::model::{Amplitudes, FREE, component, placed};
use pliant_mechanics::tensor::Vector;

use crate::applied::{AppliedForces, BLOCK};
use crate::damping_force::Past;
use crate::energies::Sums;
use crate::forces::{InternalForces, Quad};
use crate::lanes::LaneNumber;
use crate::lanes::{LaneWork, Lanes};
use crate::step_control::Lengths;

/// Nodes per parallel task.
pub(crate) const CHUNK: usize = 384;

/// Number of lanes in which sums of a block are kept apart.
const LANES: usize = 16;

/// A node of which a component moves as prescribed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Held {
    pub(crate) node: u32,
    /// The constraint of each component, or [`FREE`].
    owner: [u32; 3],
    /// The amplitudes of each component's motion.
    amplitudes: Amplitudes,
}

impl Held {
    /// The components that are prescribed, with their constraint.
    #[inline(always)]
    pub(crate) fn components(&self) -> impl Iterator<Item = (usize, usize)> {
        let owner = self.owner;
        (0..3).filter(move |&c| owner[c] != FREE).map(move |c| (c, owner[c] as usize))
    }

    /// The displacement [m] of a component from the factors of its constraint.
    #[inline(always)]
    pub(crate) fn place(&self, c: usize, factors: [f64; 2]) -> f64 {
        placed(component(&self.amplitudes, c), factors)
    }
}

pub(crate) fn held(owners: &[[u32; 3]], amplitudes: &[Amplitudes]) -> Vec<Held> {
    let nodes = owners.iter().zip(amplitudes).zip(0..).filter(|((owner, _), _)| **owner != [FREE; 3]);
    nodes.map(|((&owner, &amplitudes), node)| Held { node, owner, amplitudes }).collect()
}

/// [`Lengths`] as the nodes need them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace<R> {
    /// Δt⁺/Δt⁻.
    ratio: R,
    /// Δt⁻/Δt⁺.
    inverse_ratio: R,
    /// h/2 [s].
    half_mean: R,
    /// Δt⁺ h [s²].
    step_squared: R,
    /// 1/(Δt⁺ h) [1/s²].
    per_step_squared: R,
    /// 1/(2 Δt⁺) [1/s].
    per_two_steps: R,
    /// 1/(2 h) [1/s].
    per_two_means: R,
}

impl<R: LaneNumber> Pace<R> {
    pub(crate) fn new(lengths: Lengths) -> Self {
        let step_squared = lengths.next * lengths.mean();
        Self {
            ratio: R::of(lengths.ratio()),
            inverse_ratio: R::of(1.0 / lengths.ratio()),
            half_mean: R::of(0.5 * lengths.mean()),
            step_squared: R::of(step_squared),
            per_step_squared: R::of(1.0 / step_squared),
            per_two_steps: R::of(0.5 / lengths.next),
            per_two_means: R::of(0.5 / lengths.mean()),
        }
    }
}

/// A pass over the nodes from `first` on: the coming increments, reactions and sums, and the internal forces
/// where these are kept.
pub(crate) struct NodePass<'a, R> {
    pub(crate) first: usize,
    pub(crate) pace: Pace<R>,
    pub(crate) forces: &'a InternalForces<R>,
    pub(crate) applied: &'a AppliedForces<R>,
    /// Mass of each component, for all nodes.
    pub(crate) mass: &'a [Vector<R>],
    pub(crate) damping: &'a [Vector<R>],
    /// Held nodes of this pass, increasing.
    pub(crate) held: &'a [Held],
    /// Factors on the amplitudes of each constraint now and after the step.
    pub(crate) factors: &'a [[[f64; 2]; 2]],
    pub(crate) before: &'a [Vector<R>],
    pub(crate) next: &'a mut [Vector<R>],
    pub(crate) reaction: &'a mut [Vector<R>],
    /// Earlier internal forces on these nodes, where they damp …
    pub(crate) past: Option<Past<'a, R>>,
    /// … and room for the internal forces of the instant [N].
    pub(crate) internal: &'a mut [Vector<R>],
}

impl<R: LaneNumber> LaneWork<R> for NodePass<'_, R> {
    type Output = Sums;

    /// Plain loops over a block of components, which the compiler makes wide. Each loop goes over a whole
    /// block. Numbers that were written one by one have then left the processor's queue, or a wide read would
    /// wait for them.
    #[inline(always)]
    fn run<L: Lanes<R>>(self) -> Sums {
        const { assert!(CHUNK.is_multiple_of(BLOCK) && BLOCK.is_multiple_of(LANES)) };
        let Self {
            first, pace, forces, applied, factors, before, next, reaction, past, internal: kept, ..
        } = self;
        let mut held = self.held.iter().peekable();
        let mut sums = [[0.0; LANES]; 6];
        let mut block = Block::at_rest();
        let mut end = Known::at_rest();
        for (index, (before, next)) in before.chunks(BLOCK).zip(next.chunks_mut(BLOCK)).enumerate() {
            let nodes = first + index * BLOCK..first + index * BLOCK + before.len();
            if before.len() < BLOCK {
                block = Block::at_rest();
            }
            forces.at_nodes(nodes.clone(), &mut block.parts, &mut block.internal);
            if let Some(past) = past {
                let (at, internal) = (index * BLOCK, &block.internal[..before.len()]);
                kept[at..at + before.len()].copy_from_slice(internal);
                past.from(at).damp(internal, &mut block.damping[..before.len()]);
            }
            let mut pushed = applied.act_at(nodes.clone(), &mut block.external);
            let (mass, damping) = (&self.mass[nodes.clone()], &self.damping[nodes.clone()]);
            let known = Known { before, mass, damping }.filled_up(&mut end);
            block.move_freely(&known, &pace);
            while let Some(held) = held.next_if(|held| (held.node as usize) < nodes.end) {
                let node = held.node as usize;
                let to = node - nodes.start;
                for (c, constraint) in held.components() {
                    let places = factors[constraint].map(|factors| held.place(c, factors));
                    (block.next[to][c], reaction[node - first][c]) =
                        block.prescribe(&known, [to, c], &pace, places);
                    block.external[to][c] += reaction[node - first][c];
                }
                pushed = true;
            }
            block.add_motion(&known, &mut sums, &pace);
            if pushed {
                block.add_push(&known, &mut sums);
                block.external = [[R::ZERO; 3]; BLOCK];
            }
            next.copy_from_slice(&block.next[..next.len()]);
        }
        let [kinetic, damping_power, internal_before, internal_after, external_before, external_after] =
            sums.map(|lanes| lanes.iter().sum());
        Sums { kinetic, damping_power, internal_before, internal_after, external_before, external_after }
    }
}

/// u += Δu.
pub(crate) struct Add<'a, R> {
    pub(crate) increment: &'a [Vector<R>],
    pub(crate) to: &'a mut [Vector<R>],
}

impl<R: LaneNumber> LaneWork<R> for Add<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<R>>(self) {
        for (u, du) in self.to.as_flattened_mut().iter_mut().zip(self.increment.as_flattened()) {
            *u += *du;
        }
    }
}

/// Input of a block of nodes.
#[derive(Clone, Copy)]
struct Known<T> {
    before: T,
    mass: T,
    damping: T,
}

/// Input of a whole block.
type Whole<'a, R> = Known<&'a [Vector<R>; BLOCK]>;

impl<R: LaneNumber> Known<[Vector<R>; BLOCK]> {
    fn at_rest() -> Self {
        let zero = [[R::ZERO; 3]; BLOCK];
        Self { before: zero, mass: [[R::ONE; 3]; BLOCK], damping: zero }
    }
}

impl<'a, R: LaneNumber> Known<&'a [Vector<R>]> {
    /// Fills up the block with nodes at rest beyond the last node, for which there is room.
    #[inline(always)]
    fn filled_up(self, room: &'a mut Known<[Vector<R>; BLOCK]>) -> Whole<'a, R> {
        let fill = |vectors: &'a [Vector<R>], room: &'a mut [Vector<R>; BLOCK]| match vectors.first_chunk() {
            Some(whole) => whole,
            None => {
                room[..vectors.len()].copy_from_slice(vectors);
                &*room
            }
        };
        Known {
            before: fill(self.before, &mut room.before),
            mass: fill(self.mass, &mut room.mass),
            damping: fill(self.damping, &mut room.damping),
        }
    }
}

/// Results of a block of nodes; zero beyond the last node.
struct Block<R> {
    next: [Vector<R>; BLOCK],
    internal: [Vector<R>; BLOCK],
    /// Internal forces as in `internal`, with the fourth number of the blocks of cells.
    parts: [Quad<R>; BLOCK],
    /// Zero but for what pushes now.
    external: [Vector<R>; BLOCK],
    /// D of `damping_force`.
    damping: [Vector<R>; BLOCK],
}

impl<R: LaneNumber> Block<R> {
    #[inline(always)]
    fn at_rest() -> Self {
        let zero = [[R::ZERO; 3]; BLOCK];
        Self { next: zero, internal: zero, parts: [[R::ZERO; 4]; BLOCK], external: zero, damping: zero }
    }

    /// The increments of nodes that nothing holds.
    #[inline(always)]
    fn move_freely(&mut self, known: &Whole<'_, R>, &Pace { ratio, half_mean, step_squared, .. }: &Pace<R>) {
        let (before, next) = (known.before.as_flattened(), self.next.as_flattened_mut());
        let (internal, external) = (self.internal.as_flattened(), self.external.as_flattened());
        let (mass, damping) = (known.mass.as_flattened(), known.damping.as_flattened());
        let lost = self.damping.as_flattened();
        for i in 0..3 * BLOCK {
            let a = damping[i] * half_mean;
            let kept = (R::ONE - a) * (before[i] * ratio) * mass[i];
            let force = external[i] - internal[i] - lost[i];
            next[i] = (kept + step_squared * force) / (mass[i] * (R::ONE + a));
        }
    }

    /// The increment and the reaction [N] of a component whose displacement [m] is prescribed now and after
    /// the step.
    #[inline(always)]
    fn prescribe(
        &self,
        known: &Whole<'_, R>,
        [node, c]: [usize; 2],
        pace: &Pace<R>,
        [now, then]: [f64; 2],
    ) -> (R, R) {
        let same_speed = known.before[node][c] * pace.ratio;
        let next = R::of(then - now);
        let velocity = (same_speed + next) * pace.per_two_steps;
        let acceleration = (next - same_speed) * pace.per_step_squared;
        let inertia = known.mass[node][c] * (acceleration + known.damping[node][c] * velocity);
        (next, inertia + self.internal[node][c] + self.damping[node][c] - self.external[node][c])
    }

    /// Adds kinetic energy, damping power and the halves of the internal work to sums kept apart by lane. The
    /// products of three components are summed as they come, in the precision of the forces; all else in
    /// double precision.
    #[allow(clippy::needless_range_loop)]
    #[inline(always)]
    fn add_motion(
        &self,
        known: &Whole<'_, R>,
        sums: &mut [[f64; LANES]; 6],
        &Pace { ratio, inverse_ratio, per_two_means, .. }: &Pace<R>,
    ) {
        let (before, next, internal) =
            (known.before.as_flattened(), self.next.as_flattened(), self.internal.as_flattened());
        let (mass, damping) = (known.mass.as_flattened(), known.damping.as_flattened());
        let lost = self.damping.as_flattened();
        for first in (0..3 * BLOCK).step_by(3 * LANES) {
            let mut parts = [[R::ZERO; LANES]; 4];
            for part in 0..3 {
                for lane in 0..LANES {
                    let i = first + part * LANES + lane;
                    let velocity = (before[i] * ratio + next[i] * inverse_ratio) * per_two_means;
                    let twice_kinetic = mass[i] * velocity * velocity;
                    parts[0][lane] += twice_kinetic;
                    parts[1][lane] += damping[i] * twice_kinetic + lost[i] * velocity;
                    parts[2][lane] += internal[i] * before[i];
                    parts[3][lane] += internal[i] * next[i];
                }
            }
            for lane in 0..LANES {
                sums[0][lane] += 0.5 * parts[0][lane].to_f64();
                sums[1][lane] += parts[1][lane].to_f64();
                sums[2][lane] += 0.5 * parts[2][lane].to_f64();
                sums[3][lane] += 0.5 * parts[3][lane].to_f64();
            }
        }
    }

    /// Adds the halves of the external work.
    #[allow(clippy::needless_range_loop)]
    #[inline(always)]
    fn add_push(&self, known: &Whole<'_, R>, sums: &mut [[f64; LANES]; 6]) {
        let (before, next) = (known.before.as_flattened(), self.next.as_flattened());
        let external = self.external.as_flattened();
        for first in (0..3 * BLOCK).step_by(LANES) {
            for lane in 0..LANES {
                let i = first + lane;
                sums[4][lane] += 0.5 * external[i].to_f64() * before[i].to_f64();
                sums[5][lane] += 0.5 * external[i].to_f64() * next[i].to_f64();
            }
        }
    }
}
