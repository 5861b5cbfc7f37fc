//! Factors against dense matrices.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use pliant_testing::Random;

use super::*;
use crate::sparse::Equations;

/// Pattern with nodes in a row of cells that share some with the next ones, pairs of other nodes, and held
/// components. It has fronts of all widths and heights, for many nodes wider than a block.
fn pattern(random: &mut Random, nodes: usize, held: usize) -> LowerMatrix {
    let mut free = vec![true; 6 * nodes];
    (0..held).for_each(|_| free[random.below(6 * nodes)] = false);
    let cells: Vec<[u32; 3]> = (0..nodes)
        .map(|_| std::array::from_fn(|_| random.below(nodes) as u32))
        .filter(|[a, b, c]| a != b && b != c && a != c)
        .map(|mut cell| {
            cell.sort_unstable();
            cell
        })
        .collect();
    let pairs: Vec<[u32; 2]> = (0..nodes)
        .map(|_| [random.below(nodes) as u32, random.below(nodes) as u32])
        .filter(|[low, high]| low < high)
        .collect();
    LowerMatrix::new(&Equations::new(&free), cells.iter().map(|cell| &cell[..]), &pairs)
}

fn dense(matrix: &LowerMatrix) -> DMatrix<f64> {
    let mut full = DMatrix::zeros(matrix.columns(), matrix.columns());
    for column in 0..matrix.columns() {
        let start = matrix.column_start[column] as usize;
        for (&row, &value) in matrix.rows(column as u32).iter().zip(&matrix.value[start..]) {
            full[(row as usize, column)] = value;
            full[(column, row as usize)] = value;
        }
    }
    full
}

/// A x = b for matrices of 6 to 600 equations, positive definite and not; there are as many negative pivots
/// as eigenvalues (Sylvester). Diagonals outweigh the rest, so that no pivot is small.
#[test]
fn factors_solve_and_count_negative_eigenvalues() {
    let mut random = Random::new(5);
    for (nodes, held) in [(1, 0), (1, 4), (2, 3), (5, 1), (20, 10), (40, 0), (100, 30)] {
        for negative in [0, 1, 3] {
            let mut matrix = pattern(&mut random, nodes, held);
            matrix.value.iter_mut().for_each(|value| *value = random.number());
            let sums: Vec<f64> = dense(&matrix).row_iter().map(|row| row.abs().sum()).collect();
            for (equation, sum) in sums.iter().enumerate() {
                let sign = if negative > 0 && equation % 7 < negative { -1.0 } else { 1.0 };
                matrix.add_diagonal(equation, sign * (sum + 1.0) - matrix.diagonal(equation));
            }
            let mut factors = Factors::shared_from(&matrix, 0).unwrap();
            assert!(nodes < 100 || factors.shares[0] < factors.shares[1], "{:?}", factors.shares);
            let pivots = factors.factorise(&matrix).unwrap();
            let full = dense(&matrix);
            let eigenvalues = SymmetricEigen::new(full.clone()).eigenvalues;
            assert_eq!(pivots.negative, eigenvalues.iter().filter(|value| **value < 0.0).count());
            assert!(pivots.smallest > 0.0 && pivots.smallest <= 1.0, "{pivots:?}");
            let mut right = DVector::from_fn(matrix.columns(), |_, _| random.number());
            let mut solution = right.clone();
            factors.solve(solution.as_mut_slice());
            let error = (&full * &solution - &right).amax() / (full.amax() * solution.amax());
            assert!(error < 1e-14, "{nodes} nodes, {negative} of 7 negative: {error}");
            // Again with the memory as it was left: the same bits.
            let mut again = right.clone();
            assert_eq!(factors.factorise(&matrix), Some(pivots));
            factors.solve(again.as_mut_slice());
            assert_eq!(again, solution);
            // On one thread, too, and but for round-off by the parts of the tree one after the other.
            let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
            again.copy_from(&right);
            alone.install(|| factors.solve(again.as_mut_slice()));
            assert_eq!(again, solution);
            let mut factors = Factors::new(&matrix).unwrap();
            factors.factorise(&matrix).unwrap();
            factors.solve(right.as_mut_slice());
            assert!((right - &solution).amax() < 1e-12 * solution.amax(), "{nodes} nodes");
        }
    }
}

/// Springs of 1 between six equations that nothing else holds are a matrix of rank 5. Its last pivot is zero
/// except for round-off. The pivot of an equation without stiffness is zero, too.
#[test]
fn zero_pivots_are_told() {
    let mut matrix = pattern(&mut Random::new(7), 1, 0);
    matrix.value.fill(-1.0);
    (0..6).for_each(|equation| matrix.add_diagonal(equation, 6.0));
    let mut factors = Factors::new(&matrix).unwrap();
    assert!(factors.factorise(&matrix).unwrap().smallest < ZERO_PIVOT);
    matrix.value.fill(0.0);
    (0..6).filter(|equation| *equation != 2).for_each(|equation| matrix.add_diagonal(equation, 1.0));
    let pivots = factors.factorise(&matrix).unwrap();
    assert!(pivots.smallest < ZERO_PIVOT && pivots.weakest == 2, "{pivots:?}");
}

/// A number that is not finite is found at any place.
#[test]
fn numbers_that_are_not_finite_are_told() {
    let mut matrix = pattern(&mut Random::new(7), 12, 0);
    matrix.value.fill(-1.0);
    (0..matrix.columns()).for_each(|equation| matrix.add_diagonal(equation, 80.0));
    let mut factors = Factors::new(&matrix).unwrap();
    for value in [f64::NAN, f64::INFINITY] {
        for at in 0..matrix.value.len() {
            let mut broken = matrix.clone();
            broken.value[at] = value;
            assert_eq!(factors.factorise(&broken), None, "{value} at {at}");
        }
    }
    assert!(factors.factorise(&matrix).is_some());
}

/// Registers of any width give the same but for round-off.
#[test]
fn all_instructions_give_the_same_factors() {
    let mut random = Random::new(9);
    let mut matrix = pattern(&mut random, 60, 7);
    matrix.value.iter_mut().for_each(|value| *value = random.number());
    (0..matrix.columns()).for_each(|equation| matrix.add_diagonal(equation, 40.0));
    let right: Vec<f64> = (0..matrix.columns()).map(|_| random.number()).collect();
    let mut solutions = Vec::new();
    let narrow = [
        Some(Arch::Scalar),
        #[cfg(target_arch = "x86_64")]
        pulp::x86::V3::try_new().map(Arch::V3),
    ];
    for arch in narrow.into_iter().flatten().chain([Arch::new()]) {
        let mut factors = Factors::new(&matrix).unwrap();
        factors.arch = arch;
        factors.factorise(&matrix).unwrap();
        let mut solution = right.clone();
        factors.solve(&mut solution);
        solutions.push(DVector::from_vec(solution));
    }
    for solution in &solutions[1..] {
        let error = (solution - &solutions[0]).amax() / solutions[0].amax();
        assert!(error < 1e-13, "{error}");
    }
}
