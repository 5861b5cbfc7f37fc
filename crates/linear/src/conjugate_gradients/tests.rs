use nalgebra::Vector3;
use pliant_testing::Random;

use super::aggregates::aggregates;
use super::blocks::invert;
use super::*;
use crate::lanes::{PACK, Pack};
use crate::report::LinearError;
use crate::sparse::{Equations, LowerMatrix};
use crate::{LinearSolver, Preconditioner, Workspace, dot};

/// Parts of a number of nodes each, in chains.
fn chains(parts: u32, nodes: u32) -> Vec<Vec<u32>> {
    let beside = |node: u32| {
        let chain = node / nodes * nodes..(node / nodes + 1) * nodes;
        (node.saturating_sub(1)..node + 2).filter(|other| chain.contains(other)).collect()
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
    let mut sorted = order.clone();
    sorted.sort_unstable();
    assert!(sorted.into_iter().eq(0..4000));
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
    let mut vectors = KrylovVectors::new(&matrix, lower.columns());
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
    let mut vectors = KrylovVectors::new(&matrix, lower.columns());
    let b: Vec<f64> = (0..12).map(|at| f64::from(at) - 4.0).collect();
    let (mut x, mut product) = (vec![0.0; 12], vec![0.0; 12]);
    let report = vectors.solve(&matrix, Approximation::Blocks, &b, &mut x, 1e-4, 100).unwrap();
    lower.multiply_values(&lower.value, &x, &mut product);
    let left: f64 = b.iter().zip(&product).map(|(b, ax)| (b - ax) * (b - ax)).sum();
    let size: f64 = b.iter().map(|b| b * b).sum();
    assert!((left / size).sqrt() <= 1e-4 && report.residual <= 1e-4, "{left:e} {report:?}");
}

/// A chain of springs that is held at one end, with every approximation that iterates. Single precision finds
/// the same solution as double. Where iterations run out, the solution differs from the start.
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
            let mut vectors = KrylovVectors::new(&matrix, lower.columns());
            let mut x = vec![0.0; lower.columns()];
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
        let factor = Block::from_fn(|_, _| random.number());
        factor.transpose() * factor + Block::identity()
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

/// A free chain of springs on soil of negative stiffness k: its diagonal blocks are positive definite. Its
/// waves have stiffness 4 sin²(nπ/120) − k. With k < 0.0027 only the three translations are negative. The
/// factors of the coarse matrix report them, and deflation finds the solution, since it takes them out. With
/// a larger k the iterations meet another one.
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
        let solver = LinearSolver::ConjugateGradients { tolerance: 1e-8, iterations: 500, preconditioner };
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
        assert!(matches!(report, Err(LinearError::Indefinite(_))), "{soil}, {preconditioner:?}: {report:?}");
    }
}
