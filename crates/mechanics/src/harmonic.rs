//! Harmonic functions on a body at rest: ∇²φ = 0 with φ given on some nodes and no flux through the rest of
//! the surface. Linear tetrahedra and trilinear hexahedra (eight Gauss points) give Σ_e ∫ B_a · B_b dV
//! φ_b = 0. Solved by conjugate gradients with the diagonal as preconditioner (Saad, Iterative Methods for
//! Sparse Linear Systems, 2003, alg. 9.1).

use crate::element::{gauss_points, hex8, tet4};
use crate::tensor::{Vector, add, dot, scale};

/// Residual at which the solution is taken, as a part of that at the start (in the norm of the
/// preconditioner).
const TOLERANCE: f64 = 1e-10;

/// Cells of a body at rest, as Laplace's equation sees them.
#[derive(Clone, Debug)]
pub struct Laplacian {
    node_count: usize,
    tets: Vec<Point<4>>,
    hexes: Vec<Point<8>>,
}

/// One Gauss point of a cell.
#[derive(Clone, Copy, Debug)]
struct Point<const N: usize> {
    nodes: [u32; N],
    /// B_a [1/m].
    gradient: [Vector<f64>; N],
    /// Volume [m³].
    weight: f64,
}

impl<const N: usize> Point<N> {
    /// ∇φ at the point.
    fn slope(&self, values: &[f64]) -> Vector<f64> {
        let terms = self.nodes.iter().zip(&self.gradient);
        terms.fold([0.0; 3], |sum, (&node, &b)| add(sum, scale(b, values[node as usize])))
    }

    fn apply(&self, values: &[f64], out: &mut [f64]) {
        let flux = scale(self.slope(values), self.weight);
        for (&node, &b) in self.nodes.iter().zip(&self.gradient) {
            out[node as usize] += dot(b, flux);
        }
    }

    fn add_diagonal(&self, diagonal: &mut [f64]) {
        for (&node, &b) in self.nodes.iter().zip(&self.gradient) {
            diagonal[node as usize] += self.weight * dot(b, b);
        }
    }
}

/// The equation could not be solved.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("Laplace's equation is not solved: residual {residual:.1e} after {iterations} iterations")]
pub struct NotSolved {
    /// Relative residual.
    pub residual: f64,
    /// Iterations spent.
    pub iterations: usize,
}

impl Laplacian {
    /// Makes the Laplacian of the tetrahedra and hexahedra between some points [m].
    pub fn new(points: &[Vector<f64>], tets: &[[u32; 4]], hexes: &[[u32; 8]]) -> Self {
        let of_tet = |&nodes: &[u32; 4]| {
            let rest = tet4(&nodes.map(|node| points[node as usize]));
            Point { nodes, gradient: rest.gradient, weight: rest.volume }
        };
        let of_hex = |&nodes: &[u32; 8]| {
            let gauss = gauss_points(&nodes.map(|node| points[node as usize]));
            (0..8).map(move |k| Point { nodes, gradient: gauss.gradient[k], weight: gauss.weight[k] })
        };
        Self {
            node_count: points.len(),
            tets: tets.iter().map(of_tet).collect(),
            hexes: hexes.iter().flat_map(of_hex).collect(),
        }
    }

    /// φ at each node, with the values given at some; 0 in parts of the body where none is given.
    ///
    /// # Errors
    /// If the iteration does not converge.
    pub fn solve(&self, given: &[(u32, f64)]) -> Result<Vec<f64>, NotSolved> {
        let mut phi = vec![0.0; self.node_count];
        let mut inverse_diagonal = self.diagonal();
        inverse_diagonal.iter_mut().for_each(|d| *d = if *d > 0.0 { d.recip() } else { 0.0 });
        for &(node, value) in given {
            phi[node as usize] = value;
            // Nothing moves a node whose value is given.
            inverse_diagonal[node as usize] = 0.0;
        }
        let mut applied = vec![0.0; self.node_count];
        self.apply(&phi, &mut applied);
        let mut residual: Vec<f64> =
            applied.iter().zip(&inverse_diagonal).map(|(a, d)| if *d > 0.0 { -a } else { 0.0 }).collect();
        let mut direction: Vec<f64> = residual.iter().zip(&inverse_diagonal).map(|(r, d)| r * d).collect();
        let mut size = inner(&residual, &direction);
        let start = size;
        let most = 10 * self.node_count + 100;
        for _ in 0..most {
            if size <= TOLERANCE * TOLERANCE * start {
                return Ok(phi);
            }
            self.apply(&direction, &mut applied);
            let step = size / inner(&direction, &applied);
            for node in 0..self.node_count {
                phi[node] += step * direction[node];
                residual[node] -= if inverse_diagonal[node] > 0.0 { step * applied[node] } else { 0.0 };
            }
            let before = size;
            size = residual.iter().zip(&inverse_diagonal).map(|(r, d)| r * r * d).sum();
            for node in 0..self.node_count {
                direction[node] = inverse_diagonal[node] * residual[node] + size / before * direction[node];
            }
        }
        Err(NotSolved { residual: (size / start).sqrt(), iterations: most })
    }

    /// ∇φ in a tet or a hex, the mean over the cell [1/m].
    pub fn mean_gradient(points: &[Vector<f64>], cell: &[u32], phi: &[f64]) -> Vector<f64> {
        let at = |k: usize| points[cell[k] as usize];
        let shape: Vec<Vector<f64>> = match cell.len() {
            4 => tet4(&std::array::from_fn(at)).gradient.into(),
            _ => hex8(&std::array::from_fn(at)).rest.gradient.into(),
        };
        let terms = cell.iter().zip(shape);
        terms.fold([0.0; 3], |sum, (&node, b)| add(sum, scale(b, phi[node as usize])))
    }

    fn apply(&self, values: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        self.tets.iter().for_each(|point| point.apply(values, out));
        self.hexes.iter().for_each(|point| point.apply(values, out));
    }

    fn diagonal(&self) -> Vec<f64> {
        let mut diagonal = vec![0.0; self.node_count];
        self.tets.iter().for_each(|point| point.add_diagonal(&mut diagonal));
        self.hexes.iter().for_each(|point| point.add_diagonal(&mut diagonal));
        diagonal
    }
}

fn inner(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::HEX_CORNERS;

    /// Linear functions are harmonic, and both elements hold them exactly, also on distorted cells.
    #[test]
    fn a_linear_function_is_found_from_its_values_on_the_surface() {
        let mut points: Vec<Vector<f64>> = Vec::new();
        // Eight hexes around a node in the middle, moved off it.
        let at = |i: usize, j: usize, k: usize| (9 * k + 3 * j + i) as u32;
        for n in 0..27 {
            points.push([(n % 3) as f64, (n / 3 % 3) as f64, (n / 9) as f64]);
        }
        points[13] = [1.2, 0.9, 1.1];
        let mut hexes = Vec::new();
        for corner in 0..8 {
            let [i, j, k] = [corner & 1, corner >> 1 & 1, corner >> 2];
            let node = |c: [f64; 3]| {
                let step = c.map(|x| usize::from(x > 0.0));
                at(i + step[0], j + step[1], k + step[2])
            };
            hexes.push(HEX_CORNERS.map(node));
        }
        // Kuhn's six tets of each hex: faces of neighbours meet.
        let paths = [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]];
        let split = |hex: &[u32; 8]| paths.map(|path| path.map(|k: usize| hex[k]));
        let tets: Vec<[u32; 4]> = hexes.iter().flat_map(split).collect();
        let linear = |x: Vector<f64>| 0.3 + dot(x, [1.0, -2.0, 0.5]);
        let given: Vec<(u32, f64)> =
            (0..27).filter(|n| *n != 13).map(|n| (n, linear(points[n as usize]))).collect();
        let check = |tets: &[[u32; 4]], hexes: &[[u32; 8]]| {
            let phi = Laplacian::new(&points, tets, hexes).solve(&given).unwrap();
            assert!((phi[13] - linear(points[13])).abs() < 1e-9, "{}", phi[13]);
            for cell in hexes.iter().map(|hex| hex.as_slice()).chain(tets.iter().map(|tet| tet.as_slice())) {
                let gradient = Laplacian::mean_gradient(&points, cell, &phi);
                assert!((0..3).all(|c| (gradient[c] - [1.0, -2.0, 0.5][c]).abs() < 1e-8), "{gradient:?}");
            }
        };
        check(&tets, &[]);
        check(&[], &hexes);
    }

    #[test]
    fn without_a_given_value_there_is_nothing() {
        let points = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(Laplacian::new(&points, &[[0, 1, 2, 3]], &[]).solve(&[]).unwrap(), [0.0; 4]);
    }
}
