//! The damped least-squares step of a fit: (Jᵀ W J + D) δ = −Jᵀ W r by conjugate gradients, Jᵀ W J as one
//! block for each shell.

/// Power of the distances whose sum is minimised.
pub(super) const POWER: i32 = 6;

/// Unknowns of a vertex: moves along two tangents and the normal, two turns of the normal; all in lengths.
pub(super) const UNKNOWNS: usize = 5;

/// Unknowns of a shell.
const ALL: usize = 3 * UNKNOWNS;

/// Steps of conjugate gradients.
const STEPS: usize = 60;

/// One distance [m] and its derivatives by the unknowns of the shell.
pub(super) struct Row {
    pub(super) slope: [f64; ALL],
    pub(super) off: f64,
}

/// The sums of one shell's rows: the lower half of Jᵀ W J, and −Jᵀ W r.
pub(super) struct ShellBlock {
    nodes: [u32; 3],
    matrix: [[f64; ALL]; ALL],
    right: [f64; ALL],
}

impl ShellBlock {
    /// Sums rows with weights that turn the sum of squares into a sum of powers of distances over `scale`
    /// [m].
    pub(super) fn new(nodes: [u32; 3], rows: impl Iterator<Item = Row>, scale: f64) -> Self {
        let mut block = Self { nodes, matrix: [[0.0; ALL]; ALL], right: [0.0; ALL] };
        for row in rows {
            let weight = (row.off / scale).clamp(0.2, 3.0).powi(POWER - 2);
            for (i, slope) in row.slope.iter().enumerate().filter(|(_, slope)| **slope != 0.0) {
                let weighted = weight * slope;
                block.matrix[i][..=i]
                    .iter_mut()
                    .zip(&row.slope)
                    .for_each(|(m, slope)| *m += weighted * slope);
                block.right[i] -= weighted * row.off;
            }
        }
        for i in 0..ALL {
            for j in 0..i {
                block.matrix[j][i] = block.matrix[i][j];
            }
        }
        block
    }

    /// Indices of the unknowns of its corners among all unknowns.
    fn places(&self) -> [usize; 3] {
        self.nodes.map(|node| UNKNOWNS * node as usize)
    }

    fn add(&self, values: &[f64; ALL], sum: &mut [f64]) {
        for (first, values) in self.places().into_iter().zip(values.chunks_exact(UNKNOWNS)) {
            sum[first..first + UNKNOWNS].iter_mut().zip(values).for_each(|(s, value)| *s += value);
        }
    }

    /// Adds its product with a vector.
    fn apply(&self, x: &[f64], sum: &mut [f64]) {
        let mut values = [0.0; ALL];
        for (part, first) in values.chunks_exact_mut(UNKNOWNS).zip(self.places()) {
            part.copy_from_slice(&x[first..first + UNKNOWNS]);
        }
        let mut product = [0.0; ALL];
        for (product, row) in product.iter_mut().zip(&self.matrix) {
            *product = row.iter().zip(&values).map(|(m, x)| m * x).sum();
        }
        self.add(&product, sum);
    }
}

/// Returns the step of each of a number of points.
pub(super) fn solve(blocks: &[ShellBlock], points: usize) -> Vec<[f64; UNKNOWNS]> {
    let mut diagonal = vec![0.0; UNKNOWNS * points];
    let mut r = vec![0.0; UNKNOWNS * points];
    for block in blocks {
        block.add(&std::array::from_fn(|i| block.matrix[i][i]), &mut diagonal);
        block.add(&block.right, &mut r);
    }
    let damping: Vec<f64> = diagonal
        .chunks_exact(UNKNOWNS)
        .flat_map(|d| {
            let whole = d.iter().sum::<f64>().max(f64::MIN_POSITIVE);
            [0.1 * whole, 0.1 * whole, 0.01 * whole, 0.01 * whole, 0.01 * whole]
        })
        .collect();
    diagonal.iter_mut().zip(&damping).for_each(|(d, more)| *d += more);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let scaled = |r: &[f64]| r.iter().zip(&diagonal).map(|(r, d)| r / d).collect::<Vec<_>>();
    let mut x = vec![0.0; UNKNOWNS * points];
    let mut z = scaled(&r);
    let mut p = z.clone();
    let mut rz = dot(&r, &z);
    let first = rz;
    for _ in 0..STEPS {
        if rz <= 1e-6 * first {
            break;
        }
        let mut y: Vec<f64> = p.iter().zip(&damping).map(|(p, d)| p * d).collect();
        blocks.iter().for_each(|block| block.apply(&p, &mut y));
        let part = rz / dot(&p, &y);
        x.iter_mut().zip(&p).for_each(|(x, p)| *x += part * p);
        r.iter_mut().zip(&y).for_each(|(r, y)| *r -= part * y);
        z = scaled(&r);
        let next = dot(&r, &z);
        p.iter_mut().zip(&z).for_each(|(p, z)| *p = z + next / rz * *p);
        rz = next;
    }
    x.chunks_exact(UNKNOWNS).map(|x| std::array::from_fn(|k| x[k])).collect()
}
