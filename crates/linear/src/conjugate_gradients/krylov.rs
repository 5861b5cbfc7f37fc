//! The iterations.

use rayon::prelude::*;

use super::blocks::{BlockMatrix, Node};
use super::coarse::Coarse;
use super::kernels::{Advance, Multiply, Precision, product, squared};
use crate::factors::Factors;
use crate::report::{LinearError, LinearReport};
use crate::sparse::NONE;

/// Nodes whose products are summed up by themselves.
const CHUNK: usize = 64;

/// Chunks that a thread takes at least.
const SHARE: usize = 4;

/// The part of the tolerance at which iterations in single precision end, so that the residual in double
/// precision is within it.
const MARGIN: f64 = 0.99;

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
    pub(super) x: Vec<Node>,
    r: Vec<Node>,
    z: Vec<Node>,
    p: Vec<Node>,
    ap: Vec<Node>,
    /// Sums of chunks.
    parts: Vec<[f64; 2]>,
    /// Vector in the order of the equations, for factors.
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

    /// x ← A⁻¹ b to a residual of `tolerance` |b|, from a multiple of the x given. What was reached stays in
    /// x where the iterations run out.
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

    /// x ← the multiple of the x given that leaves the smallest residual, r ← b − A x; |b| and |r|. The
    /// motion before is then a good start for a step that is slower or goes back, too.
    pub(crate) fn begin(&mut self, matrix: &BlockMatrix, b: &[f64], x: &[f64]) -> [f64; 2] {
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
    pub(crate) fn correct(&mut self, matrix: &BlockMatrix, b: &[f64], scale: f64, d: &[f32]) -> f64 {
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
    pub(crate) fn direction(&self, size: f64, to: &mut [f32]) {
        for (to, r) in to.iter_mut().zip(self.r.as_flattened()) {
            *to = (r / size) as f32;
        }
    }

    /// The x that was found, by equations.
    pub(crate) fn take(&self, matrix: &BlockMatrix, x: &mut [f64]) {
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
                // In single precision this matrix may be indefinite where it is not: double precision
                // decides.
                _ => {
                    let [_, left] = self.begin(matrix, b, x);
                    report = LinearReport { iterations: 0, residual: left / size };
                }
            }
        }
        self.go_on(matrix, inverse, Precision::Double, [size, tolerance], iterations, &mut report)?;
        Ok(report)
    }

    /// Iterates from x and its residual r until that is a part of a size, or as many iterations are done in
    /// all.
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
