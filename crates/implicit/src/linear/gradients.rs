//! Conjugate gradients (Hestenes and Stiefel 1952) on the blocks of the nodes. Preconditioners: inverted diagonal blocks; these, deflated
//! by the rigid motions of aggregates, groups of neighbouring nodes (Nicolaides 1987, SIAM J. Numer. Anal. 24:355; the variant A-DEF2 of
//! Tang et al. 2009, J. Sci. Comput. 39:340); or older factors.
//! Rows are shared between threads; sums over them run in one order, so the number of threads changes no bit.

use nalgebra::{SMatrix, Vector3};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::device::BlockPattern;
use super::factors::Factors;
use super::report::{LinearError, LinearReport};
use crate::lanes::{PACK, Pack};
use crate::sparse::{Equations, LowerMatrix, NONE};

/// Nodes whose products are summed up by themselves.
const CHUNK: usize = 64;

/// Chunks that a thread takes at least.
const SHARE: usize = 4;

/// Nodes of an aggregate. On 20,000 shells 16 take less processor time than 8, 32 (9 %) or 64; on 4,000 these are within 5 % of each other.
const AGGREGATE: usize = 16;

/// Blocks from which on iterations read them in single precision: 9 MB in double precision. Of fewer these are as fast.
const MANY: usize = 1 << 15;

/// The tolerance from which on they do.
const COARSE_TOLERANCE: f64 = 1e-5;

/// The part of the tolerance at which these iterations end, so that the residual in double precision is within it.
const MARGIN: f64 = 0.99;

/// Pivots of the coarse matrix above minus this part of the diagonal are zero but for round-off.
const ROUND_OFF: f64 = 1e-10;

pub(super) type Block = SMatrix<f64, 6, 6>;
pub(super) type Node = [f64; 6];

/// Both halves of a symmetric matrix as 6 × 6 blocks, row by row; nodes in an order of their own, aggregate by aggregate. Components
/// without an equation are 0.
pub(crate) struct BlockMatrix {
    /// Equations of each node.
    equations: Vec<[u32; 6]>,
    /// The node's number in the model.
    number: Vec<u32>,
    /// Where the nodes of each aggregate start, and the end of the last.
    aggregate_start: Vec<u32>,
    row_start: Vec<u32>,
    column: Vec<u32>,
    value: Vec<Block>,
    /// These in single precision, if they are many.
    single: Vec<SingleBlock>,
    /// Where the entries come from in the lower half.
    source: Vec<[u32; 36]>,
    /// Places of the diagonal blocks, and their inverses.
    diagonal: Vec<u32>,
    inverse: Vec<SingleBlock>,
    /// The instructions of the processor.
    arch: Arch,
}

/// A block in single precision, half as much to read: its first four rows column by column, then the last two.
type SingleBlock = [f32; 36];

/// The place of an entry in it.
const fn entry_of(row: usize, column: usize) -> usize {
    if row < 4 { 4 * column + row } else { 24 + 2 * column + row - 4 }
}

fn to_single(block: &Block, to: &mut SingleBlock) {
    let block = block.as_slice();
    for column in 0..6 {
        for row in 0..6 {
            to[entry_of(row, column)] = block[6 * column + row] as f32;
        }
    }
}

impl BlockMatrix {
    /// The pattern of a matrix, with at most about `most` aggregates.
    pub(crate) fn new(equations: &Equations, matrix: &LowerMatrix, most: usize) -> Self {
        let mut own: Vec<(u32, [u32; 6])> = Vec::new();
        // Of each node of the model, its place among those with equations.
        let mut place = vec![NONE; equations.number.len() / 6];
        for (node, c) in equations.number.chunks_exact(6).enumerate() {
            if c.iter().any(|&e| e != NONE) {
                place[node] = own.len() as u32;
                own.push((node as u32, [c[0], c[1], c[2], c[3], c[4], c[5]]));
            }
        }
        let home = |equation: u32| {
            let component = equations.component[equation as usize];
            (place[component as usize / 6] as usize, component as usize % 6)
        };
        let mut around: Vec<Vec<u32>> = vec![Vec::new(); own.len()];
        for (a, (_, numbers)) in own.iter().enumerate() {
            for &column in numbers.iter().filter(|&&e| e != NONE) {
                for &row in matrix.rows(column) {
                    let b = home(row).0;
                    around[a].push(b as u32);
                    around[b].push(a as u32);
                }
            }
        }
        for neighbours in &mut around {
            neighbours.sort_unstable();
            neighbours.dedup();
        }
        let (order, aggregate_start) = aggregates(&around, most);
        let mut position = vec![0; own.len()];
        for (at, &old) in order.iter().enumerate() {
            position[old as usize] = at as u32;
        }
        let (mut row_start, mut column) = (vec![0], Vec::new());
        for &old in &order {
            let first = column.len();
            column.extend(around[old as usize].iter().map(|&b| position[b as usize]));
            column[first..].sort_unstable();
            row_start.push(column.len() as u32);
        }
        let mut blocks = Self {
            equations: order.iter().map(|&old| own[old as usize].1).collect(),
            number: order.iter().map(|&old| own[old as usize].0).collect(),
            aggregate_start,
            value: vec![Block::zeros(); column.len()],
            single: Vec::new(),
            source: vec![[NONE; 36]; column.len()],
            diagonal: Vec::new(),
            inverse: vec![[0.0; 36]; order.len()],
            row_start,
            column,
            arch: Arch::new(),
        };
        blocks.diagonal = (0..order.len() as u32).map(|node| blocks.find(node, node) as u32).collect();
        for equation in 0..matrix.len() as u32 {
            let (node, j) = home(equation);
            for (at, &row) in (matrix.column_start[equation as usize]..).zip(matrix.rows(equation)) {
                let (other, i) = home(row);
                let (a, b) = (position[other], position[node]);
                let [here, there] = [(a, b), (b, a)].map(|(row, column)| blocks.find(row, column));
                blocks.source[here][6 * j + i] = at;
                blocks.source[there][6 * i + j] = at;
            }
        }
        blocks
    }

    /// Has iterations to a tolerance read the blocks in single precision, if they are many and the tolerance is coarse enough.
    pub(super) fn read_for(mut self, tolerance: f64) -> Self {
        if self.value.len() >= MANY && tolerance >= COARSE_TOLERANCE {
            self.single = vec![[0.0; 36]; self.value.len()];
        }
        self
    }

    pub(super) fn nodes(&self) -> usize {
        self.equations.len()
    }

    /// Where everything is, for a device; with the pairs of touching aggregates where they are wanted.
    pub(super) fn pattern<'a>(&'a self, coarse: Option<&Coarse>) -> BlockPattern<'a> {
        let bit = |(c, &equation): (usize, &u32)| u32::from(equation != NONE) << c;
        BlockPattern {
            row_start: &self.row_start,
            column: &self.column,
            source: self.source.as_flattened(),
            free: self.equations.iter().map(|own| own.iter().enumerate().map(bit).sum()).collect(),
            aggregate_start: &self.aggregate_start,
            touching: coarse.map(|own| own.pairs.iter().map(|(row, column, _)| [*row, *column]).collect()),
        }
    }

    /// Writes the inverses of the diagonal blocks, column by column.
    pub(super) fn write_inverses(&self, to: &mut [f32]) {
        let blocks = to.par_chunks_exact_mut(36).zip(&self.inverse).with_min_len(256);
        blocks.for_each(|(to, inverse)| {
            for (at, to) in to.iter_mut().enumerate() {
                *to = inverse[entry_of(at % 6, at / 6)];
            }
        });
    }

    fn row(&self, node: usize) -> std::ops::Range<usize> {
        self.row_start[node] as usize..self.row_start[node + 1] as usize
    }

    fn find(&self, row: u32, column: u32) -> usize {
        let range = self.row(row as usize);
        range.start + self.column[range].partition_point(|&c| c < column)
    }

    /// Takes the values of a matrix and inverts the diagonal blocks, while `beside` works with the values on another thread. Whether all
    /// these blocks are positive definite, and the result of `beside`.
    pub(crate) fn update<T: Send>(
        &mut self,
        matrix: &LowerMatrix,
        beside: impl FnOnce(&Self) -> T + Send,
    ) -> (bool, T) {
        let entry = |&at: &u32| if at == NONE { 0.0 } else { matrix.value[at as usize] };
        let take = |value: &mut Block, source: &[u32; 36]| {
            value.iter_mut().zip(source).for_each(|(value, at)| *value = entry(at));
        };
        let blocks = self.value.par_iter_mut().zip(&self.source).with_min_len(64);
        if self.single.is_empty() {
            blocks.for_each(|(value, source)| take(value, source));
        } else {
            blocks.zip(&mut self.single).for_each(|((value, source), single)| {
                take(value, source);
                to_single(value, single);
            });
        }
        let mut inverse = std::mem::take(&mut self.inverse);
        let own = &*self;
        let (done, sound) = rayon::join(|| beside(own), || own.invert(&mut inverse));
        self.inverse = inverse;
        (sound, done)
    }

    fn invert(&self, inverse: &mut [SingleBlock]) -> bool {
        let packs = inverse.par_chunks_mut(PACK).enumerate().with_min_len(8);
        let sound = packs
            .map(|(pack, inverse)| self.arch.dispatch(Invert { matrix: self, first: pack * PACK, inverse }));
        sound.reduce(|| true, |a, b| a && b)
    }

    fn gather(&self, equations: &[f64], nodes: &mut [Node]) {
        for (own, values) in self.equations.iter().zip(nodes) {
            for (&equation, value) in own.iter().zip(values) {
                *value = if equation == NONE { 0.0 } else { equations[equation as usize] };
            }
        }
    }

    fn scatter(&self, nodes: &[Node], equations: &mut [f64]) {
        for (own, values) in self.equations.iter().zip(nodes) {
            for (&equation, value) in own.iter().zip(values) {
                if equation != NONE {
                    equations[equation as usize] = *value;
                }
            }
        }
    }
}

/// Groups of neighbouring nodes, at most about `most`, each grown from the first node left: the nodes in their order, and where each group
/// starts. Crumbs join the group before them, or a neighbour's. Of more groups those that are a loose part join each other.
fn aggregates(around: &[Vec<u32>], most: usize) -> (Vec<u32>, Vec<u32>) {
    let size = AGGREGATE.max(around.len().div_ceil(most));
    let mut group = vec![NONE; around.len()];
    let mut groups: Vec<Vec<u32>> = Vec::new();
    for seed in 0..around.len() as u32 {
        if group[seed as usize] != NONE {
            continue;
        }
        let number = groups.len() as u32;
        let mut members = vec![seed];
        group[seed as usize] = number;
        let mut next = 0;
        while next < members.len() && members.len() < size {
            for &node in &around[members[next] as usize] {
                if group[node as usize] == NONE && members.len() < size {
                    group[node as usize] = number;
                    members.push(node);
                }
            }
            next += 1;
        }
        let beside =
            members.iter().flat_map(|&node| &around[node as usize]).map(|&node| group[node as usize]);
        match beside.filter(|&other| other != number && other != NONE).min() {
            Some(other) if members.len() < size / 4 => {
                members.iter().for_each(|&node| group[node as usize] = other);
                groups[other as usize].append(&mut members);
            }
            _ => groups.push(members),
        }
    }
    if groups.len() > most {
        groups = joined(groups, size, |node, number| {
            around[node as usize].iter().all(|&other| group[other as usize] == number)
        });
    }
    let mut start = vec![0];
    for members in &groups {
        start.push(start[start.len() - 1] + members.len() as u32);
    }
    (groups.into_iter().flatten().collect(), start)
}

/// Groups among which loose parts of fewer than `size` nodes go together until they have as many; `is_within` tells whether a node has
/// neighbours in the group of a number alone.
fn joined(groups: Vec<Vec<u32>>, size: usize, is_within: impl Fn(u32, u32) -> bool) -> Vec<Vec<u32>> {
    let mut all: Vec<Vec<u32>> = Vec::new();
    let mut open = None;
    for (number, members) in (0..).zip(groups) {
        let loose = members.len() < size && members.iter().all(|&node| is_within(node, number));
        match open.filter(|&at: &usize| loose && all[at].len() < size) {
            Some(at) => all[at].extend(members),
            None => {
                open = if loose { Some(all.len()) } else { open };
                all.push(members);
            }
        }
    }
    all
}

/// Rigid motions of the aggregates: with P that of the nodes by those of aggregates, the coarse matrix is Pᵀ A P.
pub(crate) struct Coarse {
    /// Arm of each node from the middle of its aggregate [m].
    arm: Vec<Vector3<f64>>,
    /// The aggregate of each node.
    aggregate: Vec<u32>,
    projected: Projected,
    matrix: LowerMatrix,
    factors: Factors,
    /// Pairs of aggregates (row, column) that touch, with the blocks of Pᵀ A between them …
    pairs: Vec<(u32, u32, Vec<u32>)>,
    /// … and the coarse ones.
    value: Vec<Block>,
    motion: Vec<f64>,
    force: Vec<f64>,
}

/// Pᵀ A: with what forces on aggregates the motion of a node is resisted.
struct Projected {
    /// Where the blocks of each aggregate start, and the end of the last.
    start: Vec<u32>,
    /// Aggregate and node of each block, increasing.
    aggregate: Vec<u32>,
    node: Vec<u32>,
    value: Vec<Block>,
    single: Vec<SingleBlock>,
}

impl Projected {
    fn new(fine: &BlockMatrix) -> Self {
        let (mut start, mut aggregates, mut nodes) = (vec![0], Vec::new(), Vec::new());
        for (aggregate, ends) in fine.aggregate_start.windows(2).enumerate() {
            let rows = fine.row_start[ends[0] as usize] as usize..fine.row_start[ends[1] as usize] as usize;
            let mut own = fine.column[rows].to_vec();
            own.sort_unstable();
            own.dedup();
            nodes.append(&mut own);
            aggregates.resize(nodes.len(), aggregate as u32);
            start.push(nodes.len() as u32);
        }
        let value = vec![Block::zeros(); nodes.len()];
        let single = vec![[0.0; 36]; nodes.len()];
        Self { start, aggregate: aggregates, node: nodes, value, single }
    }

    fn of(&self, aggregate: usize) -> std::ops::Range<usize> {
        self.start[aggregate] as usize..self.start[aggregate + 1] as usize
    }

    /// Takes the fine matrix, with the aggregates of nodes and their arms.
    fn update(&mut self, fine: &BlockMatrix, home: &[u32], arm: &[Vector3<f64>]) {
        let ends = self.aggregate.par_iter().zip(&self.node);
        let blocks = self.value.par_iter_mut().zip(&mut self.single).zip(ends);
        blocks.with_min_len(64).for_each(|((value, single), (&aggregate, &node))| {
            fine.arch.dispatch(Project { fine, home, arm, aggregate, node, value, single });
        });
    }
}

/// The block of Pᵀ A between an aggregate and a node.
struct Project<'a> {
    fine: &'a BlockMatrix,
    home: &'a [u32],
    arm: &'a [Vector3<f64>],
    aggregate: u32,
    node: u32,
    value: &'a mut Block,
    single: &'a mut SingleBlock,
}

impl WithSimd for Project<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { fine, home, arm, aggregate, node, value, single } = self;
        let mut sum = Block::zeros();
        for at in fine.row(node as usize) {
            let other = fine.column[at] as usize;
            if home[other] == aggregate {
                add_rigid(&fine.value[at], &arm[other], &mut sum);
            }
        }
        let (sum, value) = (sum.as_slice(), value.as_mut_slice());
        for row in 0..6 {
            for column in 0..6 {
                value[6 * column + row] = sum[6 * row + column];
                single[entry_of(row, column)] = sum[6 * row + column] as f32;
            }
        }
    }
}

/// The block of Pᵀ A P of two aggregates, from some of Pᵀ A.
struct Condense<'a> {
    projected: &'a Projected,
    arm: &'a [Vector3<f64>],
    blocks: &'a [u32],
    value: &'a mut Block,
}

impl WithSimd for Condense<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { projected, arm, blocks, value } = self;
        value.fill(0.0);
        for at in blocks.iter().map(|&at| at as usize) {
            add_rigid(&projected.value[at], &arm[projected.node[at] as usize], value);
        }
    }
}

/// Adds B P of a node with an arm d, P = [I −S(d); 0 I].
#[inline(always)]
fn add_rigid(block: &Block, arm: &Vector3<f64>, to: &mut Block) {
    let (block, to) = (block.as_slice(), to.as_mut_slice());
    (0..36).for_each(|at| to[at] += block[at]);
    for row in 0..6 {
        let [x, y, z] = [block[row], block[6 + row], block[12 + row]];
        to[18 + row] += z * arm.y - y * arm.z;
        to[24 + row] += x * arm.z - z * arm.x;
        to[30 + row] += y * arm.x - x * arm.y;
    }
}

impl Coarse {
    pub(crate) fn new(fine: &BlockMatrix) -> Option<Self> {
        let count = fine.aggregate_start.len() - 1;
        let mut aggregate = vec![0; fine.nodes()];
        for (number, ends) in fine.aggregate_start.windows(2).enumerate() {
            aggregate[ends[0] as usize..ends[1] as usize].fill(number as u32);
        }
        let projected = Projected::new(fine);
        let mut touching: std::collections::BTreeMap<(u32, u32), Vec<u32>> =
            std::collections::BTreeMap::new();
        for (at, (&row, &node)) in (0..).zip(projected.aggregate.iter().zip(&projected.node)) {
            let column = aggregate[node as usize];
            if row >= column {
                touching.entry((column, row)).or_default().push(at);
            }
        }
        let pairs: Vec<(u32, u32, Vec<u32>)> =
            touching.into_iter().map(|((column, row), blocks)| (row, column, blocks)).collect();
        let equations = Equations::new(&vec![true; 6 * count]);
        let ends: Vec<[u32; 2]> = pairs.iter().map(|(row, column, _)| [*row, *column]).collect();
        let matrix = LowerMatrix::new(&equations, ends.iter().map(|pair| &pair[..]), &[]);
        Some(Self {
            arm: vec![Vector3::zeros(); fine.nodes()],
            aggregate,
            projected,
            factors: Factors::new(&matrix).ok()?,
            matrix,
            value: vec![Block::zeros(); pairs.len()],
            pairs,
            motion: vec![0.0; 6 * count],
            force: vec![0.0; 6 * count],
        })
    }

    /// Takes new positions of the model's nodes.
    pub(crate) fn place(&mut self, fine: &BlockMatrix, position: &[Vector3<f64>]) {
        for ends in fine.aggregate_start.windows(2) {
            let own = ends[0] as usize..ends[1] as usize;
            let place = |node: usize| position[fine.number[node] as usize];
            let centre = own.clone().map(place).sum::<Vector3<f64>>() / own.len() as f64;
            own.for_each(|node| self.arm[node] = place(node) - centre);
        }
    }

    /// Takes the fine matrix.
    pub(crate) fn update(&mut self, fine: &BlockMatrix) {
        let Self { arm, aggregate, projected, value, pairs, .. } = self;
        projected.update(fine, aggregate, arm);
        value.par_iter_mut().zip(&*pairs).with_min_len(16).for_each(|(value, (_, _, blocks))| {
            fine.arch.dispatch(Condense { projected, arm, blocks, value });
        });
    }

    /// Arms of the nodes [m], and the blocks between aggregates.
    pub(super) fn parts(&self) -> (&[Vector3<f64>], &[Block]) {
        (&self.arm, &self.value)
    }

    /// Factors the coarse matrix; its negative pivots. As deflated directions have no part in it, iterations do not meet negative stiffness
    /// there.
    pub(crate) fn factorise(&mut self) -> Result<usize, LinearError> {
        for ((row, column, _), value) in self.pairs.iter().zip(&self.value) {
            for j in 0..6 {
                let (start, rows) =
                    (self.matrix.column_start[6 * *column as usize + j], 6 * column + j as u32);
                let below = self.matrix.rows(rows).partition_point(|&r| r < 6 * row);
                let first = if row == column { j } else { 0 };
                for i in first..6 {
                    self.matrix.value[start as usize + below + i - first] = value[(i, j)];
                }
            }
        }
        let pivots = self.factors.factorise(&self.matrix).ok_or(LinearError::NotFinite)?;
        // Motions that no node of an aggregate has leave pivots of round-off.
        Ok(if pivots.lowest < -ROUND_OFF { pivots.negative } else { 0 })
    }

    /// Finds the rigid motions c = (Pᵀ A P)⁻¹ Pᵀ (r − A z); r · P c.
    fn solve(&mut self, fine: &BlockMatrix, r: &[Node], z: &[Node]) -> f64 {
        let Self { arm, projected, force, motion, .. } = self;
        let aggregates = force.par_chunks_exact_mut(6).zip(motion.par_chunks_exact_mut(6)).enumerate();
        aggregates.with_min_len(16).for_each(|(number, (force, motion))| {
            let nodes = fine.aggregate_start[number] as usize..fine.aggregate_start[number + 1] as usize;
            force.copy_from_slice(&resultant(&r[nodes.clone()], &arm[nodes]));
            let own = projected.of(number);
            let blocks = &projected.single[own.clone()];
            let resisted = fine.arch.dispatch(SingleRow { blocks, columns: &projected.node[own], x: z });
            (0..6).for_each(|c| motion[c] = force[c] - resisted[c]);
        });
        self.factors.solve(&mut self.motion);
        self.force.iter().zip(&self.motion).map(|(f, m)| f * m).sum()
    }

    /// What the rigid motion does to a node.
    #[inline(always)]
    fn motion(&self, node: usize) -> Node {
        let own = 6 * self.aggregate[node] as usize;
        let [t, w] = [0, 3]
            .map(|c| Vector3::new(self.motion[own + c], self.motion[own + c + 1], self.motion[own + c + 2]));
        let moved = t + w.cross(&self.arm[node]);
        [moved.x, moved.y, moved.z, w.x, w.y, w.z]
    }
}

/// Resultant and moment of forces on nodes with arms.
fn resultant(forces: &[Node], arms: &[Vector3<f64>]) -> Node {
    let mut sum = [0.0; 6];
    for (node, arm) in forces.iter().zip(arms) {
        let [f, m] = halves(node);
        let moment = m + arm.cross(&f);
        for c in 0..3 {
            sum[c] += f[c];
            sum[3 + c] += moment[c];
        }
    }
    sum
}

fn halves(node: &Node) -> [Vector3<f64>; 2] {
    [Vector3::new(node[0], node[1], node[2]), Vector3::new(node[3], node[4], node[5])]
}

/// A row of blocks times a vector.
struct BlockRow<'a> {
    blocks: &'a [Block],
    columns: &'a [u32],
    x: &'a [Node],
}

impl WithSimd for BlockRow<'_> {
    type Output = Node;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Node {
        let mut sum = [0.0; 6];
        for (block, &column) in self.blocks.iter().zip(self.columns) {
            add_times(block, &self.x[column as usize], &mut sum);
        }
        sum
    }
}

/// The same of blocks in single precision.
struct SingleRow<'a> {
    blocks: &'a [SingleBlock],
    columns: &'a [u32],
    x: &'a [Node],
}

impl WithSimd for SingleRow<'_> {
    type Output = Node;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Node {
        let mut sums = [[0.0; 4]; 3];
        for (block, &column) in self.blocks.iter().zip(self.columns) {
            add_single_times(block, &self.x[column as usize], &mut sums);
        }
        added(&sums)
    }
}

/// ap ← A p of the rows from one on; p · A p.
struct Multiply<'a> {
    matrix: &'a BlockMatrix,
    precision: Precision,
    from: &'a [Node],
    first: usize,
    ap: &'a mut [Node],
}

impl WithSimd for Multiply<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let mut sum = 0.0;
        for (node, ap) in (self.first..).zip(self.ap) {
            let own = self.matrix.row(node);
            let (columns, x) = (&self.matrix.column[own.clone()], self.from);
            *ap = match self.precision {
                Precision::Single => {
                    SingleRow { blocks: &self.matrix.single[own], columns, x }.with_simd(simd)
                }
                Precision::Double => BlockRow { blocks: &self.matrix.value[own], columns, x }.with_simd(simd),
            };
            sum += product(ap, &self.from[node]);
        }
        sum
    }
}

/// x += α p, r −= α A p and, with inverted blocks, z of the nodes from one on; (r · r, r · z).
struct Advance<'a> {
    alpha: f64,
    p: &'a [Node],
    ap: &'a [Node],
    x: &'a mut [Node],
    r: &'a mut [Node],
    z: &'a mut [Node],
    inverse: Option<&'a [SingleBlock]>,
    first: usize,
}

impl WithSimd for Advance<'_> {
    type Output = [f64; 2];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for (at, (x, r)) in self.x.iter_mut().zip(self.r).enumerate() {
            for c in 0..6 {
                x[c] += self.alpha * self.p[at][c];
                r[c] -= self.alpha * self.ap[at][c];
            }
            sums[0] += product(r, r);
            if let Some(inverse) = self.inverse {
                let mut z = [[0.0; 4]; 3];
                add_single_times(&inverse[self.first + at], r, &mut z);
                self.z[at] = added(&z);
                sums[1] += product(&self.z[at], r);
            }
        }
        sums
    }
}

/// Adds B x.
#[inline(always)]
fn add_times(block: &Block, x: &Node, to: &mut Node) {
    let block = block.as_slice();
    for column in 0..6 {
        for row in 0..6 {
            to[row] += block[6 * column + row] * x[column];
        }
    }
}

/// Adds B x, four products at a time: of the first four rows, of even and of odd columns; of the last two rows, of two columns at once.
#[inline(always)]
fn add_single_times(block: &SingleBlock, x: &Node, sums: &mut [[f64; 4]; 3]) {
    let quads: &[[f32; 4]; 9] = block.as_chunks().0.try_into().expect("nine times four");
    for column in 0..6 {
        add_quad(&quads[column], [x[column]; 4], &mut sums[column % 2]);
    }
    for pair in 0..3 {
        let [left, right] = [x[2 * pair], x[2 * pair + 1]];
        add_quad(&quads[6 + pair], [left, left, right, right], &mut sums[2]);
    }
}

#[inline(always)]
fn add_quad(entries: &[f32; 4], x: [f64; 4], to: &mut [f64; 4]) {
    for lane in 0..4 {
        to[lane] += f64::from(entries[lane]) * x[lane];
    }
}

/// The product from its parts.
#[inline(always)]
fn added([even, odd, last]: &[[f64; 4]; 3]) -> Node {
    let first = [0, 1, 2, 3].map(|row: usize| even[row] + odd[row]);
    [first[0], first[1], first[2], first[3], last[0] + last[2], last[1] + last[3]]
}

/// What the diagonals of inverses grow by: more than six numbers of a row lose by rounding, so that the inverse stays positive definite.
const GROWN: f64 = 1.0 + 4.0 * f32::EPSILON as f64;

/// Inverts the diagonal blocks of some nodes from one on, with ones where these have no equation; false if one is not positive definite.
struct Invert<'a> {
    matrix: &'a BlockMatrix,
    first: usize,
    inverse: &'a mut [SingleBlock],
}

impl WithSimd for Invert<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> bool {
        let Self { matrix, first, inverse } = self;
        let mut a = [[[0.0; PACK]; 6]; 6];
        (0..6).for_each(|k| a[k][k] = [1.0; PACK]);
        let diagonal = matrix.equations[first..].iter().zip(&matrix.diagonal[first..]);
        for (lane, (equations, &at)) in diagonal.take(inverse.len()).enumerate() {
            let block = matrix.value[at as usize].as_slice();
            for (i, row) in a.iter_mut().enumerate() {
                for (j, entry) in row.iter_mut().enumerate() {
                    entry[lane] = block[6 * j + i];
                }
                if equations[i] == NONE {
                    row[i][lane] = 1.0;
                }
            }
        }
        let sound = invert(&mut a);
        for (lane, inverse) in inverse.iter_mut().enumerate() {
            for i in 0..6 {
                for j in 0..6 {
                    let entry = a[i.max(j)][i.min(j)][lane];
                    inverse[entry_of(i, j)] = (if i == j { entry * GROWN } else { entry }) as f32;
                }
            }
        }
        sound
    }
}

/// Inverts symmetric matrices side by side, by Gauss and Jordan's elimination; false if one is not positive definite.
#[inline(always)]
fn invert(a: &mut [[Pack; 6]; 6]) -> bool {
    let mut sound = true;
    for k in 0..6 {
        let row = a[k];
        sound &= row[k].iter().all(|&pivot| pivot > 0.0);
        for own in &mut *a {
            let factor: Pack = std::array::from_fn(|lane| own[k][lane] / row[k][lane]);
            for (own, row) in own.iter_mut().zip(&row) {
                let lanes = own.iter_mut().zip(row).zip(&factor);
                lanes.for_each(|((own, row), factor)| *own -= factor * row);
            }
            own[k] = factor.map(|factor| -factor);
        }
        a[k] = row.map(|entry| std::array::from_fn(|lane| entry[lane] / row[k][lane]));
        a[k][k] = row[k].map(|pivot| 1.0 / pivot);
    }
    sound
}

/// That of the blocks that products read.
#[derive(Clone, Copy)]
enum Precision {
    Single,
    Double,
}

/// An approximate inverse.
pub(crate) enum Approximation<'a> {
    /// Inverted diagonal blocks.
    Blocks,
    /// These, and rigid motions of aggregates.
    Aggregates(&'a mut Coarse),
    /// Factors of an older matrix.
    Factors(&'a mut Factors),
}

/// Vectors of the method.
#[derive(Default)]
pub(crate) struct KrylovVectors {
    x: Vec<Node>,
    r: Vec<Node>,
    z: Vec<Node>,
    p: Vec<Node>,
    ap: Vec<Node>,
    /// Sums of chunks.
    parts: Vec<[f64; 2]>,
    /// For factors, whose order is that of the equations.
    equations: Vec<f64>,
}

impl KrylovVectors {
    pub(crate) fn new(matrix: &BlockMatrix, equations: usize) -> Self {
        let nodes = || vec![[0.0; 6]; matrix.nodes()];
        Self {
            x: nodes(),
            r: nodes(),
            z: nodes(),
            p: nodes(),
            ap: nodes(),
            parts: vec![[0.0; 2]; matrix.nodes().div_ceil(CHUNK)],
            equations: vec![0.0; equations],
        }
    }

    fn sums(&self) -> [f64; 2] {
        self.parts.iter().fold([0.0; 2], |sum, part| [sum[0] + part[0], sum[1] + part[1]])
    }

    /// ap ← A p; p · A p.
    fn multiply(&mut self, matrix: &BlockMatrix, precision: Precision) -> f64 {
        Self::product(matrix, precision, &self.p, &mut self.ap, &mut self.parts);
        self.sums()[0]
    }

    /// ap ← A x.
    fn multiply_start(&mut self, matrix: &BlockMatrix) {
        Self::product(matrix, Precision::Double, &self.x, &mut self.ap, &mut self.parts);
    }

    fn product(
        matrix: &BlockMatrix,
        precision: Precision,
        from: &[Node],
        to: &mut [Node],
        parts: &mut [[f64; 2]],
    ) {
        let chunks = to.par_chunks_mut(CHUNK).zip(parts).enumerate().with_min_len(SHARE);
        chunks.for_each(|(chunk, (ap, part))| {
            let first = chunk * CHUNK;
            *part = [matrix.arch.dispatch(Multiply { matrix, precision, from, first, ap }), 0.0];
        });
    }

    /// x += α p, r −= α A p; then z = M r but for the coarse part, and (r·r, r·z).
    fn advance(&mut self, matrix: &BlockMatrix, alpha: f64, blocks: bool) -> [f64; 2] {
        let chunks = self.x.par_chunks_mut(CHUNK).zip(self.r.par_chunks_mut(CHUNK));
        let chunks = chunks.zip(self.z.par_chunks_mut(CHUNK)).zip(&mut self.parts).enumerate();
        let (p, ap) = (&self.p, &self.ap);
        chunks.with_min_len(SHARE).for_each(|(chunk, (((x, r), z), part))| {
            let (first, inverse) = (chunk * CHUNK, blocks.then_some(&matrix.inverse[..]));
            let [p, ap] = [&p[first..], &ap[first..]];
            *part = matrix.arch.dispatch(Advance { alpha, p, ap, x, r, z, inverse, first });
        });
        self.sums()
    }

    /// The rest of z = M r; r·z from its part so far.
    fn precondition(&mut self, matrix: &BlockMatrix, inverse: &mut Approximation<'_>, so_far: f64) -> f64 {
        match inverse {
            Approximation::Blocks => so_far,
            Approximation::Aggregates(coarse) => so_far + coarse.solve(matrix, &self.r, &self.z),
            Approximation::Factors(factors) => {
                matrix.scatter(&self.r, &mut self.equations);
                factors.solve(&mut self.equations);
                matrix.gather(&self.equations, &mut self.z);
                self.r.iter().zip(&self.z).map(|(r, z)| product(r, z)).sum()
            }
        }
    }

    /// p ← P c, a step that leaves r no force along rigid motions, and ap ← A p.
    fn deflate(&mut self, matrix: &BlockMatrix, inverse: &mut Approximation<'_>, precision: Precision) {
        self.z.fill([0.0; 6]);
        self.precondition(matrix, inverse, 0.0);
        self.turn(matrix, inverse, 0.0);
        self.multiply(matrix, precision);
    }

    /// p ← z + β p.
    fn turn(&mut self, matrix: &BlockMatrix, inverse: &Approximation<'_>, beta: f64) {
        let z = &self.z;
        let chunks = self.p.par_chunks_mut(CHUNK).enumerate().with_min_len(SHARE);
        chunks.for_each(|(chunk, p)| {
            for (node, p) in (chunk * CHUNK..).zip(p) {
                for c in 0..6 {
                    p[c] = z[node][c] + beta * p[c];
                }
                if let Approximation::Aggregates(coarse) = inverse {
                    let motion = coarse.motion(node);
                    for c in (0..6).filter(|&c| matrix.equations[node][c] != NONE) {
                        p[c] += motion[c];
                    }
                }
            }
        });
    }

    /// x ← A⁻¹ b to a residual of `tolerance` |b|, from a multiple of the x given. What was reached stays in x where the iterations run out.
    pub(crate) fn solve(
        &mut self,
        matrix: &BlockMatrix,
        mut inverse: Approximation<'_>,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
        iterations: usize,
    ) -> Result<LinearReport, LinearError> {
        // Within the threads' pool, so that no part waits for another thread to take it up.
        let result = rayon::scope(|_| self.iterate(matrix, &mut inverse, b, x, tolerance, iterations));
        self.take(matrix, x);
        result
    }

    /// x ← the multiple of the x given that leaves the smallest residual, r ← b − A x; |b| and |r|. The motion before is then a good start for
    /// a step that is slower or goes back, too.
    pub(super) fn begin(&mut self, matrix: &BlockMatrix, b: &[f64], x: &[f64]) -> [f64; 2] {
        matrix.gather(b, &mut self.r);
        matrix.gather(x, &mut self.x);
        let size = squared(&self.r).sqrt();
        if self.x.iter().all(|x| *x == [0.0; 6]) {
            return [size, size];
        }
        self.multiply_start(matrix);
        let along: f64 = self.r.iter().zip(&self.ap).map(|(r, ax)| product(r, ax)).sum();
        let scale = along / squared(&self.ap);
        if !scale.is_finite() {
            self.x.fill([0.0; 6]);
            return [size, size];
        }
        for ((x, r), ax) in self.x.iter_mut().zip(&mut self.r).zip(&self.ap) {
            for c in 0..6 {
                x[c] *= scale;
                r[c] -= scale * ax[c];
            }
        }
        [size, squared(&self.r).sqrt()]
    }

    /// x ← x + `scale` d; then r ← b − A x. The residual |r|.
    pub(super) fn correct(&mut self, matrix: &BlockMatrix, b: &[f64], scale: f64, d: &[f32]) -> f64 {
        for (x, d) in self.x.as_flattened_mut().iter_mut().zip(d) {
            *x += scale * f64::from(*d);
        }
        self.find_residual(matrix, b)
    }

    /// r ← b − A x, and its size.
    fn find_residual(&mut self, matrix: &BlockMatrix, b: &[f64]) -> f64 {
        self.multiply_start(matrix);
        matrix.gather(b, &mut self.r);
        for (r, ax) in self.r.iter_mut().zip(&self.ap) {
            (0..6).for_each(|c| r[c] -= ax[c]);
        }
        squared(&self.r).sqrt()
    }

    /// r over its size, in single precision.
    pub(super) fn direction(&self, size: f64, to: &mut [f32]) {
        for (to, r) in to.iter_mut().zip(self.r.as_flattened()) {
            *to = (r / size) as f32;
        }
    }

    /// The x that was found, by equations.
    pub(super) fn take(&self, matrix: &BlockMatrix, x: &mut [f64]) {
        matrix.scatter(&self.x, x);
    }

    fn iterate(
        &mut self,
        matrix: &BlockMatrix,
        inverse: &mut Approximation<'_>,
        b: &[f64],
        x: &[f64],
        tolerance: f64,
        iterations: usize,
    ) -> Result<LinearReport, LinearError> {
        let [size, left] = self.begin(matrix, b, x);
        let mut report = LinearReport { iterations: 0, residual: 0.0 };
        if size == 0.0 {
            return Ok(report);
        }
        report.residual = left / size;
        if !matrix.single.is_empty() && report.residual > tolerance {
            let goal = MARGIN * tolerance;
            let end = self.go_on(matrix, inverse, Precision::Single, [size, goal], iterations, &mut report);
            report.residual = self.find_residual(matrix, b) / size;
            match end {
                Err(LinearError::Stalled(_)) if report.residual > tolerance => {
                    return Err(LinearError::Stalled(report));
                }
                Ok(()) | Err(LinearError::Stalled(_)) if report.residual.is_finite() => {}
                // In single precision this matrix may be indefinite where it is not: double precision decides.
                _ => {
                    let [_, left] = self.begin(matrix, b, x);
                    report = LinearReport { iterations: 0, residual: left / size };
                }
            }
        }
        self.go_on(matrix, inverse, Precision::Double, [size, tolerance], iterations, &mut report)?;
        Ok(report)
    }

    /// Iterates from x and its residual r until that is a part of a size, or as many iterations are done in all.
    fn go_on(
        &mut self,
        matrix: &BlockMatrix,
        inverse: &mut Approximation<'_>,
        precision: Precision,
        [size, tolerance]: [f64; 2],
        iterations: usize,
        report: &mut LinearReport,
    ) -> Result<(), LinearError> {
        if report.residual <= tolerance {
            return Ok(());
        }
        self.p.fill([0.0; 6]);
        self.ap.fill([0.0; 6]);
        let blocks = !matches!(inverse, Approximation::Factors(_));
        let deflated = matches!(inverse, Approximation::Aggregates(_));
        if deflated {
            self.deflate(matrix, inverse, precision);
        }
        let [left, so_far] = self.advance(matrix, if deflated { 1.0 } else { 0.0 }, blocks);
        report.residual = left.sqrt() / size;
        if !report.residual.is_finite() {
            return Err(LinearError::NotFinite);
        }
        let mut rz = self.precondition(matrix, inverse, so_far);
        let mut beta = 0.0;
        while report.residual > tolerance {
            if report.iterations == iterations {
                return Err(LinearError::Stalled(*report));
            }
            self.turn(matrix, inverse, beta);
            let curvature = self.multiply(matrix, precision);
            if !curvature.is_finite() {
                return Err(LinearError::NotFinite);
            }
            if curvature <= 0.0 {
                return Err(LinearError::Indefinite(report.iterations));
            }
            let [left, so_far] = self.advance(matrix, rz / curvature, blocks);
            report.iterations += 1;
            report.residual = left.sqrt() / size;
            if !report.residual.is_finite() {
                return Err(LinearError::NotFinite);
            }
            if report.residual > tolerance {
                let new = self.precondition(matrix, inverse, so_far);
                beta = new / rz;
                rz = new;
            }
        }
        Ok(())
    }
}

fn squared(v: &[Node]) -> f64 {
    v.iter().map(|v| product(v, v)).sum()
}

#[inline(always)]
fn product(a: &Node, b: &Node) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]
}

#[cfg(test)]
mod tests {
    use pliant_testing::Random;

    use super::super::{LinearSolver, Preconditioner, Workspace, dot};
    use super::*;

    /// Parts of a number of nodes each, in chains.
    fn chains(parts: u32, nodes: u32) -> Vec<Vec<u32>> {
        let beside = |node: u32| {
            let own = node / nodes * nodes..(node / nodes + 1) * nodes;
            (node.saturating_sub(1)..node + 2).filter(|other| own.contains(other)).collect()
        };
        (0..parts * nodes).map(beside).collect()
    }

    fn lengths(start: &[u32]) -> Vec<u32> {
        start.windows(2).map(|ends| ends[1] - ends[0]).collect()
    }

    #[test]
    fn many_loose_parts_share_aggregates_where_their_number_is_limited() {
        let around = chains(1000, 4);
        let (order, start) = aggregates(&around, 160);
        let mut all = order.clone();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..4000));
        // Seven parts each, the first number with 4000/160 nodes.
        let sizes = lengths(&start);
        assert!(sizes.len() <= 160 && sizes[..sizes.len() - 1].iter().all(|&size| size == 28), "{sizes:?}");
        // No part is divided.
        assert!(order.chunks(4).all(|part| part.iter().all(|node| node / 4 == part[0] / 4)));
        assert_eq!(lengths(&aggregates(&around, usize::MAX).1), [4; 1000]);
    }

    #[test]
    fn larger_parts_keep_their_aggregates_where_their_number_is_limited() {
        assert_eq!(lengths(&aggregates(&chains(60, 40), 100).1), [24, 16].repeat(60));
    }

    /// A start at a multiple of the solution is at the solution, and one that is not finite is at 0.
    #[test]
    fn starts_are_scaled_to_the_smallest_residual() {
        let equations = Equations::new(&[true; 12]);
        let mut lower = LowerMatrix::new(&equations, [&[0, 1][..]].into_iter(), &[]);
        (0..12).for_each(|at| lower.add_diagonal(at, 1.0 + at as f64));
        let mut matrix = BlockMatrix::new(&equations, &lower, usize::MAX);
        assert!(matrix.update(&lower, |_| ()).0);
        let mut vectors = KrylovVectors::new(&matrix, lower.len());
        let solution: Vec<f64> = (0..12).map(|at| f64::from(at) - 4.0).collect();
        let b: Vec<f64> = (1..13).zip(&solution).map(|(diagonal, x)| f64::from(diagonal) * x).collect();
        let mut x: Vec<f64> = solution.iter().map(|x| -2.0 * x).collect();
        let report = vectors.solve(&matrix, Approximation::Blocks, &b, &mut x, 1e-12, 0).unwrap();
        assert_eq!(report.iterations, 0);
        assert!(x.iter().zip(&solution).all(|(x, exact)| (x - exact).abs() < 1e-12), "{x:?}");
        x.fill(0.0);
        (x[0], x[4]) = (1.0, f64::INFINITY);
        let [size, left] = vectors.begin(&matrix, &b, &x);
        assert_eq!(size, left);
        assert!(vectors.x.as_flattened().iter().all(|&x| x == 0.0));
    }

    /// Blocks [1 c; c 1] with c = 1 − 1e-9, singular in single precision, are solved in double precision.
    #[test]
    fn what_single_precision_leaves_is_found_in_double_precision() {
        let equations = Equations::new(&[true; 12]);
        let mut lower = LowerMatrix::new(&equations, [&[0, 1][..]].into_iter(), &[]);
        (0..12).for_each(|at| lower.add_diagonal(at, 1.0));
        for column in 0..6 {
            let at = lower.column_start[column] as usize
                + lower.rows(column as u32).partition_point(|&row| row < column as u32 + 6);
            lower.value[at] = 1.0 - 1e-9;
        }
        let mut matrix = BlockMatrix::new(&equations, &lower, usize::MAX);
        matrix.single = vec![[0.0; 36]; matrix.column.len()];
        assert!(matrix.update(&lower, |_| ()).0);
        let mut vectors = KrylovVectors::new(&matrix, lower.len());
        let b: Vec<f64> = (0..12).map(|at| f64::from(at) - 4.0).collect();
        let (mut x, mut product) = (vec![0.0; 12], vec![0.0; 12]);
        let report = vectors.solve(&matrix, Approximation::Blocks, &b, &mut x, 1e-4, 100).unwrap();
        lower.multiply_values(&lower.value, &x, &mut product);
        let left: f64 = b.iter().zip(&product).map(|(b, ax)| (b - ax) * (b - ax)).sum();
        let size: f64 = b.iter().map(|b| b * b).sum();
        assert!((left / size).sqrt() <= 1e-4 && report.residual <= 1e-4, "{left:e} {report:?}");
    }

    /// A chain of springs that is held at one end, with every approximation that iterates: in single precision the solution is found as in double,
    /// and where iterations run out it is not that of the start.
    #[test]
    fn many_blocks_are_solved_in_single_precision() {
        const NODES: usize = 60;
        let equations = Equations::new(&[true; 6 * NODES]);
        let pairs: Vec<[u32; 2]> = (1..NODES as u32).map(|node| [node - 1, node]).collect();
        let mut lower = LowerMatrix::new(&equations, pairs.iter().map(<[u32; 2]>::as_slice), &[]);
        for equation in 0..6 * NODES {
            lower.add_diagonal(equation, if equation < 6 * (NODES - 1) { 2.0 } else { 1.0 });
        }
        for column in 0..6 * (NODES - 1) as u32 {
            let at = lower.rows(column).partition_point(|&row| row < column + 6);
            lower.value[lower.column_start[column as usize] as usize + at] = -1.0;
        }
        let mut random = Random::new(3);
        let b: Vec<f64> = (0..6 * NODES).map(|_| random.number()).collect();
        let place = |node: usize| Vector3::new(node as f64, 0.0, 0.0);
        let places: Vec<Vector3<f64>> = (0..NODES).map(place).collect();
        let left = |x: &[f64]| {
            let mut product = vec![0.0; x.len()];
            lower.multiply_values(&lower.value, x, &mut product);
            let [left, size] = [&product, &vec![0.0; x.len()]]
                .map(|product| b.iter().zip(product).map(|(b, ax)| (b - ax) * (b - ax)).sum::<f64>().sqrt());
            left / size
        };
        for deflated in [false, true] {
            let solve = |single: bool, iterations: usize| {
                let mut matrix = BlockMatrix::new(&equations, &lower, usize::MAX);
                if single {
                    matrix.single = vec![[0.0; 36]; matrix.column.len()];
                }
                let mut coarse = Coarse::new(&matrix).unwrap();
                coarse.place(&matrix, &places);
                let update = |matrix: &BlockMatrix| {
                    coarse.update(matrix);
                    coarse.factorise()
                };
                let (sound, negative) = matrix.update(&lower, update);
                assert!(sound && negative.is_ok_and(|negative| negative == 0));
                let inverse =
                    if deflated { Approximation::Aggregates(&mut coarse) } else { Approximation::Blocks };
                let mut vectors = KrylovVectors::new(&matrix, lower.len());
                let mut x = vec![0.0; lower.len()];
                let report = vectors.solve(&matrix, inverse, &b, &mut x, 1e-4, iterations);
                (report, x)
            };
            let (double, single) = (solve(false, 200).0.unwrap(), solve(true, 200));
            let report = single.0.unwrap();
            assert!(report.residual <= 1e-4 && left(&single.1) <= 1e-4, "{report:?}");
            assert!(report.iterations <= double.iterations + 2, "{report:?} {double:?}");
            let (stalled, x) = solve(true, double.iterations / 2);
            let Err(LinearError::Stalled(report)) = stalled else { panic!("{stalled:?}") };
            assert_eq!(report.iterations, double.iterations / 2);
            assert!((left(&x) - report.residual).abs() < 1e-6 * report.residual, "{report:?}");
            assert!(x.iter().any(|&x| x != 0.0));
        }
    }

    /// Blocks Bᵀ B + I times their inverses are I to 1e-12; a block with a negative eigenvalue is reported.
    #[test]
    fn blocks_are_inverted_side_by_side() {
        let mut random = Random::new(11);
        let blocks: [Block; PACK] = std::array::from_fn(|_| {
            let own = Block::from_fn(|_, _| random.number());
            own.transpose() * own + Block::identity()
        });
        let pack = |blocks: &[Block; PACK]| -> [[Pack; 6]; 6] {
            std::array::from_fn(|i| std::array::from_fn(|j| std::array::from_fn(|lane| blocks[lane][(i, j)])))
        };
        let mut inverse = pack(&blocks);
        assert!(invert(&mut inverse));
        for (lane, block) in blocks.iter().enumerate() {
            let inverse = Block::from_fn(|i, j| inverse[i.max(j)][i.min(j)][lane]);
            assert!((block * inverse - Block::identity()).amax() < 1e-12);
        }
        let mut indefinite = blocks;
        indefinite[PACK - 1] -= Block::identity() * (2.0 * blocks[PACK - 1].amax());
        assert!(!invert(&mut pack(&indefinite)));
    }

    /// A free chain of springs on soil of negative stiffness k: its diagonal blocks are positive definite. Its waves have stiffness
    /// 4 sin²(nπ/120) − k. With k < 0.0027 only the three translations are negative. The factors of the coarse matrix report them, and
    /// deflation finds the solution, since it takes them out. With a larger k the iterations meet another one.
    #[test]
    fn negative_stiffness_of_the_coarse_matrix_alone_is_reported_and_solved() {
        const NODES: usize = 60;
        let is_free: Vec<bool> = (0..6 * NODES).map(|component| component % 6 < 3).collect();
        let equations = Equations::new(&is_free);
        let pairs: Vec<[u32; 2]> = (1..NODES as u32).map(|node| [node - 1, node]).collect();
        let places: Vec<Vector3<f64>> = (0..NODES).map(|node| Vector3::x() * node as f64).collect();
        let mut random = Random::new(3);
        let b: Vec<f64> = (0..3 * NODES).map(|_| random.number()).collect();
        let solve = |soil: f64, preconditioner: Preconditioner| {
            let mut lower = LowerMatrix::new(&equations, pairs.iter().map(<[u32; 2]>::as_slice), &[]);
            for column in 0..3 * NODES as u32 {
                let springs = if (3..3 * (NODES as u32 - 1)).contains(&column) { 2.0 } else { 1.0 };
                lower.add_diagonal(column as usize, springs - soil);
                let rows = lower.rows(column);
                if let Some(at) = rows.iter().position(|&row| row == column + 3) {
                    lower.value[lower.column_start[column as usize] as usize + at] = -1.0;
                }
            }
            let solver =
                LinearSolver::ConjugateGradients { tolerance: 1e-8, iterations: 500, preconditioner };
            let mut workspace = Workspace::new(solver, None, &equations, &lower, None).unwrap();
            workspace.place(&places);
            let negative = workspace.prepare(&lower).unwrap().negative;
            let (mut x, mut left) = (vec![0.0; b.len()], vec![0.0; b.len()]);
            let report = workspace.solve(&lower, &b, &mut x);
            lower.multiply_values(&lower.value, &x, &mut left);
            left.iter_mut().zip(&b).for_each(|(left, b)| *left -= b);
            (negative, report, dot(&left, &left).sqrt() / dot(&b, &b).sqrt())
        };
        for soil in [2e-3, 1e-4, 1e-6] {
            let (negative, report, left) = solve(soil, Preconditioner::Aggregates);
            assert!(
                negative == 3 && report.is_ok() && left < 1.01e-8,
                "{soil}: {negative}, {report:?}, {left:e}"
            );
        }
        let (negative, ..) = solve(1e-2, Preconditioner::Aggregates);
        assert!(negative > 3, "{negative}");
        for (soil, preconditioner) in [
            (1e-2, Preconditioner::Aggregates),
            (1e-2, Preconditioner::BlockJacobi),
            (1e-4, Preconditioner::BlockJacobi),
        ] {
            let (_, report, _) = solve(soil, preconditioner);
            assert!(
                matches!(report, Err(LinearError::Indefinite(_))),
                "{soil}, {preconditioner:?}: {report:?}"
            );
        }
    }
}
