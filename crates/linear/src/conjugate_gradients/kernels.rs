//! Products of blocks and vectors, for the widest registers of the processor.

use pulp::{Simd, WithSimd};

use super::blocks::{Block, BlockMatrix, Node, SingleBlock};

/// A row of blocks times a vector.
pub(super) struct BlockRow<'a> {
    pub(super) blocks: &'a [Block],
    pub(super) columns: &'a [u32],
    pub(super) x: &'a [Node],
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

/// A row of blocks in single precision, with the vector.
pub(super) struct SingleRow<'a> {
    pub(super) blocks: &'a [SingleBlock],
    pub(super) columns: &'a [u32],
    pub(super) x: &'a [Node],
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
pub(super) struct Multiply<'a> {
    pub(super) matrix: &'a BlockMatrix,
    pub(super) precision: Precision,
    pub(super) from: &'a [Node],
    pub(super) first: usize,
    pub(super) ap: &'a mut [Node],
}

impl WithSimd for Multiply<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let mut sum = 0.0;
        for (node, ap) in (self.first..).zip(self.ap) {
            let row = self.matrix.row(node);
            let (columns, x) = (&self.matrix.column[row.clone()], self.from);
            *ap = match self.precision {
                Precision::Single => {
                    SingleRow { blocks: &self.matrix.single[row], columns, x }.with_simd(simd)
                }
                Precision::Double => BlockRow { blocks: &self.matrix.value[row], columns, x }.with_simd(simd),
            };
            sum += product(ap, &self.from[node]);
        }
        sum
    }
}

/// x += α p, r −= α A p and, with inverted blocks, z of the nodes from one on; (r · r, r · z).
pub(super) struct Advance<'a> {
    pub(super) alpha: f64,
    pub(super) p: &'a [Node],
    pub(super) ap: &'a [Node],
    pub(super) x: &'a mut [Node],
    pub(super) r: &'a mut [Node],
    pub(super) z: &'a mut [Node],
    pub(super) inverse: Option<&'a [SingleBlock]>,
    pub(super) first: usize,
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

/// Adds B x, four products at a time. The first four rows take even and odd columns separately; the last two
/// rows take two columns at once.
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

/// Precision of the blocks that products read.
#[derive(Clone, Copy)]
pub(super) enum Precision {
    Single,
    Double,
}

pub(super) fn squared(v: &[Node]) -> f64 {
    v.iter().map(|v| product(v, v)).sum()
}

#[inline(always)]
pub(super) fn product(a: &Node, b: &Node) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]
}
