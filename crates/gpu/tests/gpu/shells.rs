//! Explicit shells on the device, against the CPU in double precision.

use std::f64::consts::{PI, TAU};
use std::time::Instant;

use nalgebra::{UnitQuaternion, Vector3};
use pliant_geometry::Mesh;
use pliant_gpu::{Device, GpuError, GpuShells};
use pliant_implicit::{Assembly, ExplicitShells, Spring, State};
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::load::{Load, LoadKind, Spread};
use pliant_mechanics::model::{Constraint, Motion};
use pliant_meshing::{Pattern, Sheet};
use pliant_shells::element::Wall;
use pliant_shells::element::{Elasticity, Formulation, Membrane};
use pliant_testing::Random;

use crate::support;

const WALL: Wall = Wall { elastic: Elasticity { young: 1e5, poisson: 0.4 }, density: 1000.0 };

/// A damped shell of a thickness [m].
fn wall(mesh: &Mesh, thickness: f64, membrane: Membrane) -> Assembly {
    let mut model = support::shell(mesh, thickness, WALL, Formulation { membrane, ..Formulation::default() });
    model.model_mut().bodies[0].damping = 5.0;
    model
}

fn add(model: &mut Assembly, kind: LoadKind, shape: Shape) {
    let curve = Curve { shape, from: 0.0, to: 1.0 };
    model.model_mut().loads.push(Load::new("load", kind, curve));
}

fn press(model: &mut Assembly, pressure: f64, spread: Spread) {
    let facets = (0..model.facets.len() as u32).collect();
    add(model, LoadKind::ShellPressure { facets, pressure, spread }, Shape::Hold);
}

/// Displacements [m] and a rotation vector [rad], each over the time of 200 steps.
fn turn(model: &mut Assembly, nodes: Vec<u32>, by: [f64; 3], turn: [f64; 3]) {
    let duration = 200.0 * step(model);
    let curve = Curve { shape: Shape::SmoothStep, from: 0.0, to: duration };
    model.model_mut().constraints.push(Constraint {
        name: "head".into(),
        motion: Motion::Turn { by: vec![by; nodes.len()], turn, curve },
        nodes,
        components: [true; 6],
    });
}

fn step(model: &Assembly) -> f64 {
    0.9 * ExplicitShells::stable_step(model)
}

/// A tube under pressure and its weight, clamped at one end; the other one is moved and turned.
fn tube(size: [u32; 2]) -> Assembly {
    let cylinder = Sheet::Cylinder { radius: 0.02, length: 0.1, from: 0.0, span: TAU };
    let mesh = support::triangles(cylinder, size.map(|count| count as usize), Pattern::UnionJack);
    let mut model = wall(&mesh, 0.002, Membrane::default());
    let last = size[0] * size[1];
    model.model_mut().fix("foot", (0..size[0]).collect());
    turn(&mut model, (last..last + size[0]).collect(), [0.002, 0.0, 0.004], [0.0, 0.0, 0.2]);
    press(&mut model, 2000.0, Spread::Curved);
    add(&mut model, LoadKind::Gravity { body: 0, acceleration: [0.0, -9.81, 0.0] }, Shape::Hold);
    model
}

/// A plate, clamped along one side and hinged along the other, under lumped pressure, forces and moments.
fn plate() -> Assembly {
    let mesh = support::triangles(Sheet::Plate { size: [0.12, 0.08] }, [12, 8], Pattern::UnionJack);
    let mut model = wall(&mesh, 0.001, Membrane::Opt { adaptation: 10.0 });
    model.model_mut().fix("clamp", (0..9).map(|j| 13 * j).collect());
    model.model_mut().fix("hinge", (0..9).map(|j| 13 * j + 12).collect());
    model.model_mut().constraints[1].components = [true, true, true, false, false, false];
    press(&mut model, 5.0, Spread::Lumped);
    add(&mut model, LoadKind::force([45, 58], [2e-4, 0.0, 5e-4]), Shape::Hold);
    add(&mut model, LoadKind::moment([71], [2e-6, 0.0, 5e-7]), Shape::Hold);
    model
}

/// A wavy patch with nodes at random, free but for a corner, flying and spinning.
fn patch() -> (Assembly, State) {
    let mut random = Random::new(7);
    let mut mesh = support::triangles(Sheet::Plate { size: [0.1, 0.09] }, [10, 9], Pattern::UnionJack);
    for x in &mut mesh.points {
        x.z = 0.01 * (60.0 * x.x).sin() * (50.0 * x.y).cos();
        *x += Vector3::from_fn(|_, _| 0.002 * random.number());
    }
    let mut model = wall(&mesh, 0.0015, Membrane::default());
    model.model_mut().fix("corner", vec![0]);
    model.model_mut().constraints[0].components = [true, true, true, false, false, false];
    press(&mut model, 30.0, Spread::Curved);
    let mut state = State::at_rest(&model);
    let spin = Vector3::new(3.0, -2.0, 4.0);
    let about = model.place(0);
    for node in 0..model.rest.len() {
        state.velocity[node] = spin.cross(&(model.place(node) - about));
        state.spin[node] = spin;
    }
    (model, state)
}

/// Returns the states after steps on the device, read back after each of `parts`, and on the CPU. Also
/// returns the work on the device [J] with the rest of its last step. The work on the CPU follows from the
/// trapezoidal rule over all steps. Some nodes are pushed [N].
fn both(
    device: &Device,
    model: &Assembly,
    (start, pushed): (&State, &[(u32, [f64; 3])]),
    parts: &[u64],
) -> ([State; 2], [f64; 2]) {
    let step = step(model);
    let mut held = vec![false; 6 * model.rest.len()];
    for constraint in &model.constraints {
        for &node in &constraint.nodes {
            (0..6).for_each(|c| held[6 * node as usize + c] |= constraint.components[c]);
        }
    }
    let power = |solver: &ExplicitShells, state: &State| -> f64 {
        let forces = solver.forces();
        let rate =
            |i: usize| if i % 6 < 3 { state.velocity[i / 6][i % 6] } else { state.spin[i / 6][i % 6 - 3] };
        let outside = |i: usize| if held[i] { forces.internal()[i] } else { forces.loads()[i] };
        (0..held.len()).map(|i| outside(i) * rate(i)).sum()
    };
    let mut solver = ExplicitShells::new(model.clone(), step).unwrap();
    solver.forces_mut().push(pushed);
    let mut exact = start.clone();
    let mut work = [0.0; 2];
    solver.evaluate(&exact).unwrap();
    for _ in 0..parts.iter().sum() {
        let before = exact.clone();
        solver.go(&mut exact);
        // Forces before and after, over the way of the step between.
        let moved = State { velocity: exact.velocity.clone(), spin: exact.spin.clone(), ..before };
        work[1] += 0.5 * step * power(&solver, &moved);
        solver.evaluate(&exact).unwrap();
        work[1] += 0.5 * step * power(&solver, &exact);
    }
    let mut state = start.clone();
    let mut shells = GpuShells::new(device, model.clone(), step).unwrap();
    shells.push(pushed);
    for &part in parts {
        let moved = shells.advance(&mut state, part).unwrap();
        assert_eq!((moved.steps, moved.broken), (part, false));
        solver.evaluate(&state).unwrap();
        work[0] += moved.work + 0.5 * step * power(&solver, &state);
    }
    assert_eq!(state.time, exact.time);
    ([state, exact], work)
}

/// The largest differences of places and of rotations, over the largest displacement and rotation.
fn off(model: &Assembly, [one, other]: &[State; 2]) -> [f64; 2] {
    let nodes = 0..model.rest.len();
    let largest = |of: &dyn Fn(usize) -> f64| nodes.clone().map(of).fold(0.0, f64::max);
    let angle = |q: &UnitQuaternion<f64>| 2.0 * q.imag().norm();
    [
        largest(&|node| (one.position[node] - other.position[node]).norm())
            / largest(&|node| (other.position[node] - model.place(node)).norm()),
        largest(&|node| angle(&(one.rotation[node] * other.rotation[node].inverse())))
            / largest(&|node| angle(&other.rotation[node])),
    ]
}

/// Places, rotations and the work of forces from outside differ by 1e-5 at most after 200 steps, the
/// round-off of single precision.
#[test]
fn shells_move_as_on_the_cpu() {
    let Some(device) = support::device() else { return };
    let (patch, flying) = patch();
    let [tube, plate] = [tube([24, 16]), plate()];
    let starts = [&tube, &plate].map(|model| State::at_rest(model));
    // The middle of each is pushed, too.
    let pushed = [(60, [0.0, 1e-3, 0.0]), (61, [0.0, 0.0, 1e-3])];
    for (name, model, start) in
        [("tube", &tube, &starts[0]), ("plate", &plate, &starts[1]), ("patch", &patch, &flying)]
    {
        let (states, work) = both(&device, model, (start, &pushed), &[1, 7, 192]);
        let [places, rotations] = off(model, &states);
        let of_work = (work[0] - work[1]).abs() / work[1].abs();
        println!(
            "{name}: places off {places:.1e}, rotations {rotations:.1e}, work {of_work:.1e} of {:.1e} J",
            work[1]
        );
        assert!(places < 1e-5 && rotations < 1e-5 && of_work < 1e-5, "{name}");
    }
}

/// A shell turned by any angle moves as the one that is not turned: 1e-5 of its displacement beside the turn.
#[test]
fn a_shell_turned_by_any_angle_has_the_forces_of_the_cpu() {
    let Some(device) = support::device() else { return };
    let (model, flying) = patch();
    for (k, angle) in [0.4 * PI, 0.5 * PI, 0.9 * PI, PI, 1.5 * PI].into_iter().enumerate() {
        let axis = Vector3::ith_axis(k % 3);
        let turn = UnitQuaternion::from_axis_angle(&axis, angle);
        let mut start = flying.clone();
        let about = model.place(0);
        for node in 0..model.rest.len() {
            start.position[node] = about + turn * (start.position[node] - about);
            start.rotation[node] = turn;
            start.velocity[node] = turn * start.velocity[node];
            start.spin[node] = turn * start.spin[node];
        }
        let (states, _) = both(&device, &model, (&start, &[]), &[50]);
        let [places, rotations] = off(&model, &states);
        println!("turned by {angle:.2} rad: places off {places:.1e}, rotations {rotations:.1e}");
        assert!(places < 1e-5 && rotations < 1e-5, "{angle}");
    }
}

#[test]
fn the_device_gives_the_same_bits_however_steps_are_divided() {
    let Some(device) = support::device() else { return };
    let model = tube([24, 16]);
    let run = |parts: &[u64]| {
        let mut state = State::at_rest(&model);
        let mut shells = GpuShells::new(&device, model.clone(), step(&model)).unwrap();
        for &part in parts {
            shells.advance(&mut state, part).unwrap();
        }
        state
    };
    let whole = run(&[300]);
    assert_eq!(whole, run(&[300]));
    assert_eq!(whole, run(&[1, 150, 149]));
}

/// A run resumes from a state that was read back: rotations and velocities have the same bits, places agree
/// to round-off.
#[test]
fn another_stepper_goes_on_from_a_state_that_was_read_back() {
    let Some(device) = support::device() else { return };
    let model = tube([24, 16]);
    let new = || GpuShells::new(&device, model.clone(), step(&model)).unwrap();
    let [mut whole, mut cut] = [State::at_rest(&model), State::at_rest(&model)];
    new().advance(&mut whole, 100).unwrap();
    new().advance(&mut cut, 60).unwrap();
    new().advance(&mut cut, 40).unwrap();
    let [places, rotations] = off(&model, &[cut, whole]);
    assert!(places < 1e-6 && rotations < 1e-6, "{places:e} {rotations:e}");
}

/// A facet that is folded over stops the device at that instant, where the CPU finds it, too.
#[test]
fn a_facet_that_is_broken_stops_the_device_at_its_instant() {
    let Some(device) = support::device() else { return };
    let mut model = plate();
    add(&mut model, LoadKind::force([84], [0.0, 0.0, 500.0]), Shape::Hold);
    let mut solver = ExplicitShells::new(model.clone(), step(&model)).unwrap();
    let mut exact = State::at_rest(&model);
    let mut steps = 0;
    while solver.advance(&mut exact).is_ok() {
        steps += 1;
    }
    let mut state = State::at_rest(&model);
    let moved =
        GpuShells::new(&device, model.clone(), step(&model)).unwrap().advance(&mut state, 5000).unwrap();
    assert!(moved.broken && moved.steps == steps && state.time == exact.time, "{moved:?} {steps}");
    assert!(solver.evaluate(&state).is_err());
}

#[test]
fn what_only_the_cpu_has_is_refused_by_name() {
    let Some(device) = support::device() else { return };
    let refused = |change: &dyn Fn(&mut Assembly)| {
        let mut model = plate();
        change(&mut model);
        match GpuShells::new(&device, model, 1e-6).map(|_| ()) {
            Err(GpuError::Unsupported { what }) => what,
            other => panic!("{other:?}"),
        }
    };
    let spring = |model: &mut Assembly| {
        model.springs.push(Spring { node: 1, anchor: Vector3::zeros(), stiffness: 1.0 });
    };
    assert_eq!(refused(&spring), "a spring on explicit shells");
    assert_eq!(
        refused(&|model| model.model_mut().stiffness_damping = 1e-3),
        "damping by stiffness of explicit shells"
    );
    let controlled = |model: &mut Assembly| model.model_mut().loads[0].controlled = true;
    assert!(refused(&controlled).contains("the load `load`"));
    let rigid = |model: &mut Assembly| model.model_mut().constraints[1].motion = Motion::Rigid;
    assert!(refused(&rigid).contains("the constraint `hinge`"));
}

#[test]
fn a_device_that_is_lost_ends_the_step_with_its_name() {
    let Some(device) = support::device() else { return };
    let model = plate();
    let mut shells = GpuShells::new(&device, model.clone(), step(&model)).unwrap();
    let mut state = State::at_rest(&model);
    shells.advance(&mut state, 3).unwrap();
    device.wgpu().0.destroy();
    match shells.advance(&mut state, 3) {
        Err(error @ GpuError::Lost { .. }) => assert!(error.to_string().contains(&device.adapter().name)),
        other => panic!("{other:?}"),
    }
}

/// Prints the time of a step and facet on the CPU and on the device, of tubes of 800 to 50,000 facets.
#[test]
#[ignore = "takes a minute; it measures a machine"]
fn time_of_a_step() {
    let Some(device) = support::device() else { return };
    println!("facets  CPU ns/facet  {} ns/facet", device.adapter().name);
    for size in [[20, 20], [40, 40], [80, 80], [160, 156]] {
        let model = tube(size);
        let (step, facets) = (step(&model), model.facets.len());
        let steps = (2_000_000 / facets as u64).clamp(40, 2000);
        let mut solver = ExplicitShells::new(model.clone(), step).unwrap();
        let mut shells = GpuShells::new(&device, model.clone(), step).unwrap();
        let [mut cpu, mut gpu] = [State::at_rest(&model), State::at_rest(&model)];
        let per = |begun: Instant| begun.elapsed().as_secs_f64() * 1e9 / (steps as f64 * facets as f64);
        solver.advance(&mut cpu).unwrap();
        shells.advance(&mut gpu, 20).unwrap();
        let begun = Instant::now();
        (0..steps).for_each(|_| solver.advance(&mut cpu).unwrap());
        let of_cpu = per(begun);
        let begun = Instant::now();
        shells.advance(&mut gpu, steps).unwrap();
        println!("{facets:6}  {of_cpu:12.0}  {:9.0}", per(begun));
    }
}
