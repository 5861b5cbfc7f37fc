//! Linear solvers find the same equilibrium, with the same bits on any number of threads.

use pliant_linear::{LinearSolver, Preconditioner};
use pliant_mechanics::load::{LoadKind, Spread};
use pliant_mechanics::model::{Constraint, Motion};

use super::{balloon, cantilever, ramp};
use crate::*;

pub(super) fn iterative(preconditioner: Preconditioner) -> LinearSolver {
    LinearSolver::ConjugateGradients { tolerance: 1e-12, iterations: 5000, preconditioner }
}

#[test]
pub(super) fn all_linear_solvers_find_the_same_equilibrium() {
    let model = cantilever();
    let mut found: Vec<AssemblyState> = Vec::new();
    for linear in [
        LinearSolver::Direct,
        LinearSolver::Unsymmetric,
        iterative(Preconditioner::BlockJacobi),
        iterative(Preconditioner::Aggregates),
        iterative(Preconditioner::LaggedFactors { renew_after: 20 }),
    ] {
        let mut state = AssemblyState::at_rest(&model);
        let mut solver =
            Statics::new(model.clone(), StaticSettings { linear, ..StaticSettings::default() }).unwrap();
        let step = solver.solve(&mut state, 1.0).unwrap();
        assert!(step.residuals.len() < 15, "{linear:?}: {:?}", step.residuals);
        found.push(state);
    }
    let tip = found[0].position[26];
    assert!(tip.z > 1.0, "{tip}");
    for other in &found[1..] {
        let off =
            other.position.iter().zip(&found[0].position).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(off < 1e-6, "{off:e}");
    }
}

/// Results have the same bits with one thread and with three.
#[test]
pub(super) fn threads_change_no_bit() {
    let model = cantilever();
    let solve = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut state = AssemblyState::at_rest(&model);
            Statics::new(model.clone(), StaticSettings::default()).unwrap().solve(&mut state, 1.0).unwrap();
            state
        })
    };
    assert_eq!(solve(1), solve(3));
}

/// Sums over enough facets for several threads have the same bits with any number of threads. An edge is
/// moved, and pressure on the curved surface makes the stiffness unsymmetric.
#[test]
pub(super) fn threads_change_no_bit_of_sums_over_facets() {
    for spread in [Spread::Lumped, Spread::Curved] {
        let mut model = balloon(4, 50.0);
        let facets = (0..model.facets.len() as u32).collect();
        model.model_mut().loads[0].kind = LoadKind::ShellPressure { facets, pressure: 50.0, spread };
        let motion = Motion::Displacement([0.0, 0.0, 0.01], ramp());
        let held =
            Constraint { name: "moved".into(), nodes: vec![40, 41, 42], components: [true; 6], motion };
        model.model_mut().constraints.push(held);
        let solve = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let mut state = AssemblyState { load_factor: 1.0, ..AssemblyState::at_rest(&model) };
                let settings = StaticSettings::default();
                let step = Statics::new(model.clone(), settings).unwrap().solve(&mut state, 0.5);
                (step.map(|step| step.residuals), state)
            })
        };
        let alone = solve(1);
        println!("{spread:?}: {:?}", alone.0);
        assert!(alone == solve(2) && alone == solve(3));
    }
}

/// Conjugate gradients on enough nodes for several threads move a balloon of 2,048 facets in the same bits.
/// With aggregates they take fewer iterations than with blocks alone.
#[test]
pub(super) fn threads_change_no_bit_of_conjugate_gradients() {
    let model = balloon(4, 50.0);
    let run = |threads, preconditioner| {
        let linear = LinearSolver::ConjugateGradients { tolerance: 1e-6, iterations: 5000, preconditioner };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut state = AssemblyState { load_factor: 1.0, ..AssemblyState::at_rest(&model) };
            let mut solver =
                BackwardEuler::new(model.clone(), DynamicSettings::new(0.04).real_time(linear)).unwrap();
            for _ in 0..3 {
                solver.advance(&mut state).unwrap();
            }
            (state, solver.phases().iterations)
        })
    };
    let blocks = run(1, Preconditioner::BlockJacobi);
    let aggregates = run(1, Preconditioner::Aggregates);
    assert_eq!(blocks, run(2, Preconditioner::BlockJacobi));
    assert_eq!(aggregates, run(2, Preconditioner::Aggregates));
    assert_eq!(aggregates, run(3, Preconditioner::Aggregates));
    println!("{} iterations with blocks, {} with aggregates", blocks.1, aggregates.1);
    assert!(aggregates.1 < blocks.1);
}

/// Iterations that run out are an error, or taken as they are with their residual.
#[test]
pub(super) fn iterations_that_run_out_are_taken_if_told_so() {
    let model = balloon(3, 50.0);
    let linear = LinearSolver::ConjugateGradients {
        tolerance: 1e-9,
        iterations: 4,
        preconditioner: Preconditioner::BlockJacobi,
    };
    let settings = DynamicSettings { halvings: 0, ..DynamicSettings::new(0.04).real_time(linear) };
    let mut state = AssemblyState { load_factor: 1.0, ..AssemblyState::at_rest(&model) };
    let error = BackwardEuler::new(model.clone(), settings).unwrap().advance(&mut state).unwrap_err();
    assert!(matches!(error, SolveError::Stalled { iterations: 4, .. }), "{error}");
    let settings = DynamicSettings { accept_stalled: true, ..settings };
    let step = BackwardEuler::new(model.clone(), settings).unwrap().advance(&mut state).unwrap();
    assert_eq!(step.linear.iterations, 4);
    assert!(step.linear.residual > 1e-9 && step.linear.residual < 1.0, "{:?}", step.linear);
    assert_ne!(state, AssemblyState::at_rest(&model));
}

pub(super) fn gradients(preconditioner: Preconditioner) -> LinearSolver {
    LinearSolver::ConjugateGradients { tolerance: 1e-9, iterations: 5000, preconditioner }
}

/// Conjugate gradients say why they stop: too few iterations, or a body that buckles, which factors of
/// aggregates show.
#[test]
pub(super) fn conjugate_gradients_tell_why_they_stop() {
    let model = cantilever();
    let solve = |preconditioner, iterations, squeeze: f64| {
        let linear = LinearSolver::ConjugateGradients { tolerance: 1e-10, iterations, preconditioner };
        let mut state = AssemblyState::at_rest(&model);
        state.position.iter_mut().for_each(|x| x.x *= squeeze);
        let settings = StaticSettings { linear, ..StaticSettings::default() };
        Statics::new(model.clone(), settings).unwrap().linear(&state, 1.0).map(|_| ())
    };
    for preconditioner in [Preconditioner::BlockJacobi, Preconditioner::Aggregates] {
        assert_eq!(solve(preconditioner, 5000, 1.0), Ok(()));
        let short = solve(preconditioner, 3, 1.0);
        assert!(matches!(short, Err(SolveError::Stalled { iterations: 3, .. })), "{short:?}");
    }
    let buckled = solve(Preconditioner::BlockJacobi, 5000, 0.9);
    assert!(matches!(buckled, Err(SolveError::Indefinite { .. })), "{buckled:?}");
}
