//! Equations of implicit steps on the device, against the CPU.

use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::Vector3;
use pliant_gpu::Device;
use pliant_implicit::element::Elasticity;
use pliant_implicit::{
    Assembly, BackwardEuler, DynamicSettings, LinearDevice, LinearSolver, Preconditioner, Shell, SolveError,
    State, Wall,
};
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::load::{Load, LoadKind, Spread};

use crate::support;

const STEP: f64 = 0.04;

/// A tube of `around` × `along` pairs of shells, fixed at one end and hinged at the other, under a pressure that pulses and its weight.
fn tube(around: u32, along: u32) -> Assembly {
    let point = |i: u32| {
        let angle = TAU * f64::from(i % around) / f64::from(around);
        let z = 0.2 * f64::from(i / around) / f64::from(along);
        Vector3::new(0.02 * angle.cos(), 0.02 * angle.sin(), z)
    };
    let cells = (0..around * along).flat_map(|c| {
        let node = |i: u32, j: u32| (c % around + i) % around + around * (c / around + j);
        let [a, b, c, d] = [node(0, 0), node(1, 0), node(1, 1), node(0, 1)];
        [[a, b, c], [a, c, d]]
    });
    let mut model = Assembly::new("tube", (0..around * (along + 1)).map(point));
    let wall = Wall { elastic: Elasticity { young: 1e5, poisson: 0.45 }, density: 1000.0 };
    model.add_shell(&Shell::new("tube", cells.collect(), 0.002, wall)).unwrap();
    let facets = (0..model.facets.len() as u32).collect();
    let own = model.model_mut();
    own.fix("foot", (0..around).collect());
    own.fix("head", (around * along..around * (along + 1)).collect());
    let hinge = own.constraints.last_mut().unwrap();
    hinge.components = [true, true, true, false, false, false];
    let pulse = (0..40).map(|i| (0.25 * f64::from(i), f64::from(i % 2))).collect();
    let curve = Curve { shape: Shape::Table(pulse), from: 0.0, to: 1.0 };
    let kind = LoadKind::ShellPressure { facets, pressure: 1000.0, spread: Spread::Curved };
    own.loads.push(Load::new("pressure", kind, curve));
    let hold = Curve { shape: Shape::Hold, from: 0.0, to: 1.0 };
    own.loads.push(Load::new("weight", LoadKind::Gravity { body: 0, acceleration: [0.0, -9.81, 0.0] }, hold));
    own.bodies[0].damping = 1.0;
    model
}

fn gradients(tolerance: f64, preconditioner: Preconditioner) -> LinearSolver {
    LinearSolver::ConjugateGradients { tolerance, iterations: 5000, preconditioner }
}

fn on(device: &Device) -> Option<Arc<dyn LinearDevice>> {
    Some(Arc::new(device.clone()))
}

/// The state after some steps, and the largest residual of a linear solution, its iterations and how many were left to the CPU.
fn run(
    device: Option<Arc<dyn LinearDevice>>,
    model: &Assembly,
    settings: DynamicSettings,
    steps: usize,
) -> (State, f64, usize, usize) {
    let mut solver = BackwardEuler::on(device, model.clone(), settings).unwrap();
    let (mut state, mut residual) = (State::at_rest(model), 0.0_f64);
    for _ in 0..steps {
        residual = residual.max(solver.advance(&mut state).unwrap().linear.residual);
    }
    let phases = solver.phases();
    (state, residual, phases.iterations, phases.left_to_cpu)
}

/// The largest distance between nodes over the largest displacement.
fn off(model: &Assembly, one: &State, other: &State) -> f64 {
    let largest = |a: &State, b: &State| {
        a.position.iter().zip(&b.position).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    };
    largest(one, other) / largest(other, &State::at_rest(model))
}

const BOTH: [Preconditioner; 2] = [Preconditioner::BlockJacobi, Preconditioner::Aggregates];

/// A solution to 1e-9, far below single precision, is that of factors in double precision: the error of a displacement is larger than
/// the residual by the condition of the matrix, here 1e3 at most.
#[test]
fn corrections_in_single_precision_add_up_to_a_solution_in_double_precision() {
    let Some(device) = support::device() else { return };
    let model = tube(12, 20);
    let settings = DynamicSettings::new(STEP);
    let exact = run(None, &model, settings.real_time(LinearSolver::Direct), 4).0;
    for preconditioner in BOTH {
        let settings = settings.real_time(gradients(1e-9, preconditioner));
        let (state, residual, iterations, left) = run(on(&device), &model, settings, 4);
        let off = off(&model, &state, &exact);
        println!(
            "{preconditioner:?}: off {off:.1e}, residual {residual:.1e}, {iterations} iterations, {left} left"
        );
        assert!(off < 1e-6 && residual <= 1e-9 && left == 0, "{off:e} {residual:e} {left}");
    }
}

/// A pulsing tube, a second long, as on the CPU: each step is solved to 1e-3 there and here, so displacements differ by some 1e-3.
#[test]
fn a_pulsing_tube_moves_as_on_the_cpu() {
    let Some(device) = support::device() else { return };
    let model = tube(16, 25);
    for preconditioner in BOTH {
        let settings = DynamicSettings::new(STEP).real_time(gradients(1e-3, preconditioner));
        let cpu = run(None, &model, settings, 25);
        let gpu = run(on(&device), &model, settings, 25);
        let off = off(&model, &gpu.0, &cpu.0);
        println!(
            "{preconditioner:?}: off {off:.1e}, {} iterations on the CPU, {} on the device",
            cpu.2, gpu.2
        );
        assert!(off < 5e-3 && gpu.1 <= 1e-3 && gpu.3 == 0, "{off:e} {:e} {}", gpu.1, gpu.3);
    }
}

/// With Newton's method both come to the same states, to the tolerance of a step.
#[test]
fn newtons_method_converges_to_the_states_of_the_cpu() {
    let Some(device) = support::device() else { return };
    let model = tube(12, 20);
    let settings =
        DynamicSettings { linear: gradients(1e-6, Preconditioner::Aggregates), ..DynamicSettings::new(STEP) };
    let (cpu, gpu) = (run(None, &model, settings, 5), run(on(&device), &model, settings, 5));
    let off = off(&model, &gpu.0, &cpu.0);
    assert!(off < 1e-5, "{off:e}");
}

#[test]
fn the_device_gives_the_same_bits_every_time() {
    let Some(device) = support::device() else { return };
    let model = tube(12, 20);
    let settings = DynamicSettings::new(STEP).real_time(gradients(1e-3, Preconditioner::Aggregates));
    let [one, other] = [(); 2].map(|()| run(on(&device), &model, settings, 6).0);
    assert_eq!(one.position, other.position);
}

/// A run whose iterations end early takes what it has, as on the CPU.
#[test]
fn iterations_that_run_out_are_told_with_their_residual() {
    let Some(device) = support::device() else { return };
    let model = tube(12, 20);
    let linear = LinearSolver::ConjugateGradients {
        tolerance: 1e-6,
        iterations: 5,
        preconditioner: Preconditioner::BlockJacobi,
    };
    let settings = DynamicSettings { halvings: 0, ..DynamicSettings::new(STEP).real_time(linear) };
    let mut solver = BackwardEuler::on(on(&device), model.clone(), settings).unwrap();
    match solver.advance(&mut State::at_rest(&model)) {
        Err(SolveError::Stalled { iterations: 5, residual }) => assert!(residual > 1e-6),
        other => panic!("{other:?}"),
    }
    let settings = DynamicSettings { accept_stalled: true, ..settings };
    let (_, residual, iterations, _) = run(on(&device), &model, settings, 2);
    assert!(residual > 1e-6 && iterations == 10, "{residual:e} {iterations}");
}

#[test]
fn a_device_that_is_lost_ends_the_step_with_its_name_and_a_remedy() {
    let Some(device) = support::device() else { return };
    let model = tube(12, 20);
    let settings = DynamicSettings::new(STEP).real_time(gradients(1e-3, Preconditioner::Aggregates));
    let mut solver = BackwardEuler::on(on(&device), model.clone(), settings).unwrap();
    let mut state = State::at_rest(&model);
    solver.advance(&mut state).unwrap();
    let before = state.clone();
    device.wgpu().0.destroy();
    match solver.advance(&mut state) {
        Err(SolveError::Device(error)) => {
            assert!(error.0.contains(&device.adapter().name) && error.0.contains("run again"), "{error}");
        }
        other => panic!("{other:?}"),
    }
    assert_eq!(state.position, before.position);
}

#[test]
fn a_matrix_beyond_what_the_adapter_allows_is_refused_with_its_size() {
    let Some(_) = support::device() else { return };
    let small =
        Device::open_within(None, |limits, _| limits.max_storage_buffer_binding_size = 1 << 16).unwrap();
    let settings = DynamicSettings::new(STEP).real_time(gradients(1e-3, Preconditioner::BlockJacobi));
    match BackwardEuler::on(on(&small), tube(12, 20), settings).map(|_| ()) {
        Err(SolveError::Device(error)) => assert!(error.0.contains("of the model take"), "{error}"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn other_linear_solvers_are_refused_on_a_device() {
    let Some(device) = support::device() else { return };
    let lagged = gradients(1e-3, Preconditioner::LaggedFactors { renew_after: 10 });
    for linear in [LinearSolver::Direct, LinearSolver::Unsymmetric, lagged] {
        let settings = DynamicSettings { linear, ..DynamicSettings::new(STEP) };
        let refused = BackwardEuler::on(on(&device), tube(6, 5), settings).map(|_| ());
        assert!(
            matches!(refused, Err(SolveError::Impossible(why)) if why.contains("take these, or the CPU"))
        );
    }
}
