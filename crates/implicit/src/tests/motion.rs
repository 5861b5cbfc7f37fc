//! Motion in time by implicit and explicit steps.

use std::f64::consts::TAU;

use pliant_linear::Preconditioner;
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::load::{Load, LoadKind};
use pliant_mechanics::model::{Constraint, Motion};
use pliant_shells::element::Elasticity;
use pliant_shells::element::Wall;

use super::*;
use crate::{Shell, StaticSettings, Statics};

const LENGTH: f64 = 1.0;
const THIN: f64 = 0.01;

/// A strip of 16 × 2 cells, 1 × 0.1 m; E = 1 MPa, ν = 0.
fn strip(thickness: f64) -> Assembly {
    let points =
        (0..51_u32).map(|i| Vector3::new(f64::from(i % 17) / 16.0 * LENGTH, f64::from(i / 17) * 0.05, 0.0));
    let cell = |i: u32| {
        let a = i % 16 + 17 * (i / 16);
        [[a, a + 1, a + 18], [a, a + 18, a + 17]]
    };
    let material = Wall { elastic: Elasticity { young: 1e6, poisson: 0.0 }, density: 1000.0 };
    let mut model = Assembly::new("shell", points);
    let cells = (0..32).flat_map(cell).collect();
    model.add_shell(&Shell::new("strip", cells, thickness, material)).unwrap();
    model
}

fn clamped(thickness: f64) -> Assembly {
    let mut model = strip(thickness);
    let nodes = vec![0, 17, 34];
    model.model_mut().constraints.push(Constraint {
        name: "clamp".into(),
        nodes,
        components: [true; 6],
        motion: Motion::Fixed,
    });
    model
}

fn weigh(model: &mut Assembly, g: f64) {
    let kind = LoadKind::Gravity { body: 0, acceleration: [0.0, 0.0, -g] };
    let curve = Curve { shape: Shape::Hold, from: 0.0, to: 1.0 };
    model.model_mut().loads.push(Load::new("weight", kind, curve));
}

/// First bending frequency of a cantilever, 1.8751² √(E I/(ρ A L⁴)) [rad/s].
fn first_frequency(thickness: f64) -> f64 {
    1.8751_f64.powi(2) * (1e6 * thickness * thickness / (12.0 * 1000.0)).sqrt() / LENGTH.powi(2)
}

/// Period of the tip after a small push, from its zero crossings.
fn period(mut advance: impl FnMut(&mut AssemblyState), model: &Assembly, step: f64) -> f64 {
    let mut state = AssemblyState::at_rest(model);
    for (v, x) in state.velocity.iter_mut().zip(model.places()) {
        v.z = 1e-3 * x.x * x.x;
    }
    let mut crossings = Vec::new();
    let mut last = 0.0;
    while crossings.len() < 3 {
        advance(&mut state);
        let now = state.position[16].z;
        if last != 0.0 && (now < 0.0) != (last < 0.0) {
            crossings.push(state.time - step * now / (now - last));
        }
        last = now;
    }
    crossings[2] - crossings[0]
}

/// Euler's cantilever to 1 %: explicit, and implicit with 400 steps a period.
#[test]
fn a_cantilever_vibrates_at_its_first_frequency() {
    let model = clamped(0.03);
    let exact = TAU / first_frequency(0.03);
    let step = 0.9 * ExplicitShells::stable_step(&model);
    let mut explicit = ExplicitShells::new(model.clone(), step).unwrap();
    let found = period(|state| explicit.advance(state).unwrap(), &model, step);
    println!("period {found:.4} s, exact {exact:.4} s, explicit step {step:.1e} s");
    assert!((found / exact - 1.0).abs() < 0.01, "{found} {exact}");
    let step = exact / 400.0;
    let mut implicit = BackwardEuler::new(model.clone(), DynamicSettings::new(step)).unwrap();
    let found = period(|state| drop(implicit.advance(state).unwrap()), &model, step);
    assert!((found / exact - 1.0).abs() < 0.01, "{found} {exact}");
}

/// Final state of a free strip after a number of steps a period by an integrator. Its springs are
/// proportional to its masses, so it moves to and fro as one body, at 1 Hz.
fn bobbing(integrator: Integrator, steps: u32, periods: u32) -> AssemblyState {
    let mut model = strip(THIN);
    for node in 0..model.rest.len() {
        let stiffness = TAU * TAU * model.mass[node];
        model.springs.push(crate::Spring { node: node as u32, anchor: model.place(node), stiffness });
    }
    let settings =
        DynamicSettings { integrator, tolerance: 1e-10, ..DynamicSettings::new(1.0 / f64::from(steps)) };
    let mut solver = BackwardEuler::new(model.clone(), settings).unwrap();
    let mut state = AssemblyState::at_rest(&model);
    state.position.iter_mut().for_each(|x| x.z = 0.1);
    for _ in 0..steps * periods {
        solver.advance(&mut state).unwrap();
    }
    state
}

/// Half the step, a quarter of the error (and half of it by backward Euler).
#[test]
fn differences_of_two_steps_are_of_second_order() {
    for (integrator, order) in [(Integrator::BackwardEuler, 1.0), (Integrator::Bdf2, 2.0)] {
        let off = [100, 200].map(|steps| {
            let state = bobbing(integrator, steps, 1);
            // In phase space, over the amplitude.
            ((state.position[7].z / 0.1 - 1.0).powi(2) + (state.velocity[7].z / (0.1 * TAU)).powi(2)).sqrt()
        });
        let found = (off[0] / off[1]).log2();
        println!("{integrator:?}: off by {:.1e} and {:.1e}, order {found:.2}", off[0], off[1]);
        assert!((found - order).abs() < 0.2, "{integrator:?}: order {found}");
    }
}

/// Part of critical damping at 1 Hz in steps of 10, 20 and 40 ms. Backward Euler has ω h/2 less terms of
/// third order, 3 to 11 %. Differences of two steps have (ω h)³/4, 0.006 to 0.4 %.
#[test]
fn each_integrator_damps_as_is_told() {
    for step in [0.01, 0.02, 0.04] {
        let steps = (1.0_f64 / step) as u32;
        let damping = |integrator, periods: u32| {
            let at = |periods| {
                let state = bobbing(integrator, steps, periods);
                state.position[7].z.hypot(state.velocity[7].z / TAU)
            };
            // From the first period on, after the step of backward Euler at the start.
            (at(1) / at(1 + periods)).ln() / (TAU * f64::from(periods))
        };
        let [first, second] = [damping(Integrator::BackwardEuler, 1), damping(Integrator::Bdf2, 4)];
        println!("h = {step}: {:.2} % and {:.4} % of critical", 100.0 * first, 100.0 * second);
        let angle = TAU * step;
        assert!((first / (0.5 * angle) - 1.0).abs() < 0.1, "{first}");
        assert!((second / (0.25 * angle.powi(3)) - 1.0).abs() < 0.2, "{second}");
    }
}

/// A strip falls about its clamp by more than a right angle. Half the step gives a quarter of the error. A
/// step halved on the way, or a change of solver, keeps this order.
#[test]
fn large_motion_is_of_second_order_and_goes_on_elsewhere() {
    let mut model = clamped(THIN);
    weigh(&mut model, 2.0);
    let tip = |steps: u32, elsewhere: bool| {
        let settings = DynamicSettings {
            integrator: Integrator::Bdf2,
            tolerance: 1e-10,
            ..DynamicSettings::new(0.8 / f64::from(steps))
        };
        let mut solver = BackwardEuler::new(model.clone(), settings).unwrap();
        let mut state = AssemblyState::at_rest(&model);
        for step in 0..steps {
            if elsewhere && step == steps / 2 {
                let previous = solver.previous().cloned();
                assert!(previous.is_some());
                solver = BackwardEuler::new(model.clone(), settings).unwrap();
                solver.go_on_from(previous);
            }
            solver.advance(&mut state).unwrap();
        }
        state.position[16]
    };
    let exact = tip(640, false);
    let [coarse, fine] = [40, 80].map(|steps| (tip(steps, false) - exact).norm());
    println!("at {exact:?}: off by {coarse:.2e} and {fine:.2e}");
    assert!(exact.z < -0.3 && coarse / fine > 3.0 && coarse / fine < 5.5, "{exact} {coarse} {fine}");
    assert_eq!(tip(40, false), tip(40, true));
}

#[test]
fn explicit_steps_that_are_too_long_are_refused() {
    let model = clamped(THIN);
    let stable = ExplicitShells::stable_step(&model);
    assert!(ExplicitShells::new(model.clone(), stable).is_ok());
    assert!(matches!(ExplicitShells::new(model.clone(), 1.01 * stable), Err(SolveError::Impossible(_))));
}

/// A spring a hundred times as stiff as the strip sets the step, and 2000 steps of it stay bounded.
#[test]
fn springs_shorten_the_stable_step() {
    let mut model = clamped(THIN);
    let free = ExplicitShells::stable_step(&model);
    let node = 16;
    let stiffness = 100.0 * 4.0 / (free * free) * model.mass[node];
    model.springs.push(crate::Spring { node: node as u32, anchor: model.place(node), stiffness });
    let step = ExplicitShells::stable_step(&model);
    assert!(step < 0.1 * free && step > 0.09 * free, "{step:e} {free:e}");
    let mut state = AssemblyState::at_rest(&model);
    state.velocity[node].z = 1e-3;
    let mut solver = ExplicitShells::new(model.clone(), step).unwrap();
    for _ in 0..2000 {
        solver.advance(&mut state).unwrap();
    }
    // What it starts with, kept within the strip and the spring: 1e-3 m/s over the frequency of the spring,
    // and some.
    let off = (state.position[node] - model.place(node)).norm();
    assert!(off < 1e-3 * free, "{off:e}");
}

/// Energy of explicit steps oscillates within 1 % in free vibration at large rotation.
#[test]
fn explicit_motion_keeps_its_energy() {
    let model = clamped(THIN);
    let mut state = AssemblyState::at_rest(&model);
    for (v, x) in state.velocity.iter_mut().zip(model.places()) {
        v.z = 1.5 * x.x * x.x;
    }
    let kinetic = |state: &AssemblyState| -> f64 {
        let nodes = 0..model.rest.len();
        nodes
            .map(|i| {
                0.5 * model.mass[i] * state.velocity[i].norm_squared()
                    + 0.5 * model.rotary_inertia[i] * state.spin[i].norm_squared()
            })
            .sum()
    };
    let mut solver = ExplicitShells::new(model.clone(), 0.5 * ExplicitShells::stable_step(&model)).unwrap();
    let first = kinetic(&state);
    let mut largest = 0.0_f64;
    for _ in 0..3000 {
        let before = kinetic(&state);
        solver.advance(&mut state).unwrap();
        let energy = 0.5 * (before + kinetic(&state)) + solver.forces().strain_energy();
        largest = largest.max((energy / first - 1.0).abs());
    }
    println!("energy off by {largest:.1e}, tip at {}", state.position[16]);
    assert!(largest < 0.01, "{largest}");
}

/// A free strip keeps its momentum and its moment of momentum in implicit steps, to the tolerance of the
/// solution.
#[test]
fn a_free_body_keeps_its_momentum() {
    let model = strip(THIN);
    let mut state = AssemblyState::at_rest(&model);
    for (v, x) in state.velocity.iter_mut().zip(model.places()) {
        *v = Vector3::new(0.1, 0.2 * x.x, 0.5 * x.x * x.x);
    }
    let momentum = |state: &AssemblyState| {
        let nodes = 0..model.rest.len();
        nodes.fold((Vector3::zeros(), Vector3::zeros()), |(p, l), i| {
            let linear = model.mass[i] * state.velocity[i];
            (p + linear, l + state.position[i].cross(&linear) + model.rotary_inertia[i] * state.spin[i])
        })
    };
    let settings = DynamicSettings { tolerance: 1e-10, ..DynamicSettings::new(2e-3) };
    let mut solver = BackwardEuler::new(model.clone(), settings).unwrap();
    let first = momentum(&state);
    for _ in 0..20 {
        solver.advance(&mut state).unwrap();
    }
    let last = momentum(&state);
    assert!((last.0 - first.0).norm() < 1e-7 * first.0.norm(), "{}", last.0 - first.0);
    // Backward Euler takes x × v of the end: of second order in the step.
    assert!((last.1 - first.1).norm() < 2e-2 * first.1.norm(), "{} {}", last.1, first.1);
}

/// Damped, a sagging strip comes to rest where the static solver puts it; all linear solvers go the same way.
#[test]
fn damped_motion_ends_in_the_static_equilibrium() {
    let mut model = clamped(THIN);
    weigh(&mut model, 0.5);
    let mut rest = AssemblyState::at_rest(&model);
    Statics::new(model.clone(), StaticSettings::default()).unwrap().solve(&mut rest, 1.0).unwrap();
    assert!(rest.position[16].z < -0.2, "{}", rest.position[16]);
    // About critical.
    model.model_mut().bodies[0].damping = 2.0 * first_frequency(THIN);
    model.model_mut().stiffness_damping = 0.01;
    let iterative = |preconditioner| LinearSolver::ConjugateGradients {
        tolerance: 1e-8,
        iterations: 5000,
        preconditioner,
    };
    for linear in [
        LinearSolver::Direct,
        iterative(Preconditioner::BlockJacobi),
        iterative(Preconditioner::LaggedFactors { renew_after: 10 }),
    ] {
        let settings = DynamicSettings { linear, ..DynamicSettings::new(1.0) };
        let mut solver = BackwardEuler::new(model.clone(), settings).unwrap();
        let mut state = AssemblyState::at_rest(&model);
        for _ in 0..60 {
            solver.advance(&mut state).unwrap();
        }
        let off = (state.position[16] - rest.position[16]).norm();
        assert!(off < 1e-5, "{linear:?}: {off:e}");
    }
}

/// One linear solution a step follows the converged motion to 2 % of the sag in small steps.
#[test]
fn real_time_steps_follow_the_converged_motion() {
    let mut model = clamped(THIN);
    weigh(&mut model, 0.5);
    model.model_mut().bodies[0].damping = 1.0;
    let run = |settings: DynamicSettings| {
        let mut solver = BackwardEuler::new(model.clone(), settings).unwrap();
        let mut state = AssemblyState::at_rest(&model);
        for _ in 0..100 {
            solver.advance(&mut state).unwrap();
        }
        state.position[16]
    };
    let settings = DynamicSettings::new(0.01);
    let (converged, quick) = (run(settings), run(settings.real_time(LinearSolver::Direct)));
    assert!((converged - quick).norm() < 0.02 * converged.z.abs(), "{converged} {quick}");
}

/// Two triangles fly apart, each damped as its body says. Backward Euler slows the one down by 1/(1 + α h) a
/// step, central differences by (1 − α h/2)/(1 + α h/2). The other keeps its speed.
#[test]
fn bodies_are_damped_each_by_itself() {
    let triangle = |x: f64| [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|[a, b]| Vector3::new(x + a, b, 0.0));
    let mut model = Assembly::new("free", triangle(0.0));
    model.add_body("slow", triangle(5.0));
    for (name, first) in [("free", 0), ("slow", 3)] {
        let material = Wall { elastic: Elasticity { young: 1e3, poisson: 0.3 }, density: 1000.0 };
        model.add_shell(&Shell::new(name, vec![[first, first + 1, first + 2]], 0.1, material)).unwrap();
    }
    let alpha = 2.0;
    model.model_mut().bodies[1].damping = alpha;
    let flying = || {
        let mut state = AssemblyState::at_rest(&model);
        state.velocity.fill(Vector3::new(0.0, 0.0, 0.5));
        state
    };
    let slowed = |state: &AssemblyState, ratio: f64| {
        assert!((state.velocity[0].z - 0.5).abs() < 1e-9, "{}", state.velocity[0]);
        assert!((state.velocity[4].z / 0.5 - ratio.powi(10)).abs() < 1e-9, "{}", state.velocity[4]);
    };
    let (mut state, h) = (flying(), 0.05);
    let mut solver = BackwardEuler::new(model.clone(), DynamicSettings::new(h)).unwrap();
    (0..10).for_each(|_| drop(solver.advance(&mut state).unwrap()));
    slowed(&state, 1.0 / (1.0 + alpha * h));
    let (mut state, h) = (flying(), 0.5 * ExplicitShells::stable_step(&model));
    let mut solver = ExplicitShells::new(model.clone(), h).unwrap();
    (0..10).for_each(|_| solver.advance(&mut state).unwrap());
    slowed(&state, (1.0 - 0.5 * alpha * h) / (1.0 + 0.5 * alpha * h));
}
