use std::sync::Arc;

use nalgebra::{Complex, Vector3};
use pliant_mechanics::curve::{Curve, Shape as CurveShape};
use pliant_mechanics::element::Cord;
use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
use pliant_mechanics::model::{Cells, Constraint, Material, Model, Motion, Solid};
use pliant_testing::Random;

use super::*;
use crate::critical_step::assembled;
use crate::forces::tests::{distorted_cube, every_element, laws};
use crate::stability::{Monitor, OnUnstable};
use crate::{CentralDifference, Observable, State};

/// A tet of which one node moves along x: one mode.
fn oscillator() -> Model {
    let mut model = Model::default();
    let corners = [[0.0; 3], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]];
    let tet = model.add_body("tet", &corners);
    let law = AnyLaw::NeoHookean(NeoHookean { shear: 1e3, volumetric: Volumetric::quadratic(1e4) });
    let cells = Cells::tet4(vec![[0, 1, 2, 3]], &model.rest);
    model.add_solid(Solid::new(tet, Material::elastic(law, 1000.0), cells));
    model.fix("base", vec![0, 2, 3]);
    model.constraints.push(Constraint {
        name: "guide".into(),
        nodes: vec![1],
        components: [false, true, true, false, false, false],
        motion: Motion::Fixed,
    });
    // So slow that the law is linear.
    model.initial_velocity = vec![[0.0; 3], [1e-7, 0.0, 0.0], [0.0; 3], [0.0; 3]];
    model
}

/// Returns the factor on the amplitude of a mode in a step, at Ω. Newton's method finds it as a root of the
/// characteristic polynomial.
fn expected(omega: f64) -> f64 {
    let (eta, square) = (DISSIPATION, omega * omega);
    let mut z = Complex::from_polar(1.0, 2.0 * (0.5 * omega).asin());
    for _ in 0..50 {
        let quadratic = z * z * (1.0 + eta) - z * (2.0 * eta) + eta;
        let value = z * (z - 1.0) * (z - 1.0) + quadratic * square;
        let slope = (z - 1.0) * (z * 3.0 - 1.0) + (z * (2.0 * (1.0 + eta)) - 2.0 * eta) * square;
        z -= value / slope;
    }
    z.norm()
}

/// Returns the largest displacement of the node [m] in the first and in the last steps of a run, and the
/// energies at its end.
fn run(omega: f64, steps: usize) -> ([f64; 2], pliant_mechanics::Energies) {
    let model = oscillator();
    // 2/ω.
    let critical = assembled(&model).unwrap().step;
    let mut stepper =
        CentralDifference::<f64>::new(model.clone(), 0.5 * omega * critical).unwrap().dissipating();
    let mut state = State::at_rest(&model);
    let mut largest = [0.0_f64; 2];
    let window = steps / 4;
    for step in 0..steps {
        stepper.evaluate(&mut state).unwrap();
        let amplitude = state.displacement[1][0].abs();
        if step < window {
            largest[0] = largest[0].max(amplitude);
        } else if step >= steps - window {
            largest[1] = largest[1].max(amplitude);
        }
        stepper.advance(&mut state);
    }
    stepper.evaluate(&mut state).unwrap();
    (largest, *stepper.energies())
}

#[test]
fn a_mode_decays_as_the_characteristic_polynomial_says() {
    for (omega, steps) in [(0.1, 200_000), (0.3, 40_000), (1.0, 2000), (1.8, 200)] {
        let ([first, last], energies) = run(omega, steps);
        let (found, expected) = ((last / first).powf(4.0 / 3.0 / steps as f64), expected(omega));
        let lost = 1.0 - expected;
        println!(
            "Ω = {omega}: {:.3e} a step, expected {lost:.3e}, ½ η Ω⁴ {:.3e}",
            1.0 - found,
            0.5 * DISSIPATION * omega.powi(4)
        );
        // Peaks lie between steps.
        assert!((found - expected).abs() < 0.05 * lost, "Ω = {omega}");
        // What the mode loses is entered.
        assert!(
            energies.balance < 0.3 && energies.damping > 0.0 && energies.damping < 1.3 * energies.external
        );
    }
}

#[test]
fn the_critical_time_step_is_a_hundredth_shorter() {
    let limit = 2.0 / (1.0 + 4.0 * DISSIPATION).sqrt();
    let ([first, last], _) = run(0.998 * limit, 2000);
    assert!(last < first);
    let model = oscillator();
    let critical = assembled(&model).unwrap().step;
    let step = 0.5 * 1.002 * limit * critical;
    let mut stepper = CentralDifference::<f64>::new(model.clone(), step).unwrap().dissipating();
    let mut state = State::at_rest(&model);
    let error = loop {
        if let Err(error) = stepper.evaluate(&mut state) {
            break error;
        }
        assert!(state.steps < 10_000);
        stepper.advance(&mut state);
    };
    println!("{error}");
}

/// A model that is shaken with a speed [m/s].
fn shaken(mut model: Model, speed: f64, damping: f64) -> Model {
    let mut random = Random::new(11);
    model.initial_velocity = (0..model.node_count()).map(|_| random.vector().map(|x| speed * x)).collect();
    model.stiffness_damping = damping;
    model
}

/// The kinetic energy [J] after some steps, over that at the start; infinite of a run that fails.
fn kept(model: &Model, step: f64, steps: usize) -> f64 {
    let mut stepper = CentralDifference::<f64>::new(model.clone(), step).unwrap();
    let (mut state, mut first) = (State::at_rest(model), 0.0);
    for _ in 0..steps {
        if stepper.evaluate(&mut state).is_err() {
            return f64::INFINITY;
        }
        first = f64::max(first, if state.steps < 2 { stepper.energies().kinetic } else { 0.0 });
        stepper.advance(&mut state);
    }
    stepper.energies().kinetic / first
}

/// For any element all vibrations decay below the critical time step found, and grow above it.
#[test]
fn the_critical_time_step_is_that_of_the_damped_scheme() {
    for model in every_element() {
        let element = model.solids[0].cells.element();
        let undamped = assembled(&model).unwrap().step;
        for part in [0.1, 1.0, 4.0] {
            let model = shaken(model.clone(), 1e-6, part * undamped);
            let critical = assembled(&model).unwrap().step;
            assert!((critical / (((part * part + 1.0).sqrt() - part) * undamped) - 1.0).abs() < 1e-9);
            let [below, above] = [0.998, 1.01].map(|part| kept(&model, part * critical, 3000));
            println!("{element}, {part}: {critical:.2e} s, {below:.1e} below, {above:.1e} above");
            // Motions of the whole cube stay.
            assert!(below < 1.0 && above > 1e3, "{element}, {part}: {below:e} {above:e}");
        }
    }
}

/// A mass on a bar decays by √(1 − βω²Δt) each step, as the scheme says, which is its ratio βω/2 where steps
/// are short. The energy lost is damping.
#[test]
fn a_vibration_decays_with_its_ratio() {
    let mut model = Model::default();
    let body = model.add_body("bar", &[[0.0; 3], [0.1, 0.0, 0.0]]);
    let law = AnyLaw::NeoHookean(NeoHookean { shear: 1e4, volumetric: Volumetric::quadratic(2e4) });
    let cord = Cord { slack: 1.0, tension_only: false };
    let cells = Cells::bar(vec![[0, 1]], &model.rest, 1e-4, cord);
    model.add_solid(Solid::new(body, Material::elastic(law, 1000.0), cells));
    model.fix("base", vec![0]);
    model.initial_velocity = vec![[0.0; 3], [1e-6, 0.0, 0.0]];
    let omega = 2.0 / assembled(&model).unwrap().step;
    for (ratio, length) in [(0.05, 0.01), (0.05, 0.4), (0.5, 0.1)] {
        let (damping, step) = (2.0 * ratio / omega, length / omega);
        model.stiffness_damping = damping;
        let mut stepper = CentralDifference::<f64>::new(model.clone(), step).unwrap();
        let mut state = State::at_rest(&model);
        let (mut area, mut start) = (Vec::new(), 0.0);
        let mut before = [0.0; 2];
        for number in 0..200 {
            stepper.evaluate(&mut state).unwrap();
            if number == 2 {
                start = stepper.energies().kinetic + stepper.energies().internal;
            }
            let now = [state.displacement[1][0], state.increment[1][0]];
            // The area that two states in a row span is multiplied by the determinant of a step.
            area.push(before[0] * now[1] - before[1] * now[0]);
            before = now;
            stepper.advance(&mut state);
        }
        let decay = 1.0 - damping * omega * omega * step;
        for two in area[2..60].windows(2) {
            assert!((two[1] / two[0] / decay - 1.0).abs() < 1e-6, "{ratio} {length}: {two:?} {decay}");
        }
        let energies = stepper.energies();
        let left = (energies.kinetic + energies.internal) / start;
        let wanted = (-2.0 * ratio * 198.0 * length).exp();
        println!(
            "{ratio}, {length}: {left:.4} of the energy is left, {wanted:.4} in continuous time; {energies:?}"
        );
        assert!(energies.damping > 0.0 && energies.balance < 0.05, "{energies:?}");
        if length == 0.01 {
            assert!((left / wanted - 1.0).abs() < 0.1, "{left} {wanted}");
        }
    }
}

/// Vibrations of a body of any element decay into damping, to the balance of the energies.
#[test]
fn what_is_lost_is_damping() {
    for model in every_element() {
        let critical = assembled(&model).unwrap().step;
        let model = shaken(model, 0.05, 0.2 * critical);
        let mut stepper =
            CentralDifference::<f64>::new(model.clone(), 0.9 * assembled(&model).unwrap().step).unwrap();
        let mut state = State::at_rest(&model);
        for _ in 0..2000 {
            stepper.evaluate(&mut state).unwrap();
            stepper.advance(&mut state);
        }
        stepper.evaluate(&mut state).unwrap();
        let energies = *stepper.energies();
        println!("{} {energies:?}", model.solids[0].cells.element());
        assert!(energies.damping > 0.5 * energies.external && energies.balance < 1e-6, "{energies:?}");
        // A spin is left, with its stretch.
        assert!((0.0..0.01 * energies.external).contains(&energies.internal), "{energies:?}");
    }
}

/// A free body that turns with Ω loses its spin at the rate βΩ², and no momentum.
#[test]
fn a_rotation_is_damped_at_the_rate_that_is_told() {
    let (damping, omega) = (0.02, 0.5);
    let mut model = distorted_cube("hex8-full", laws()[0]);
    let centre = Vector3::new(0.15, 0.15, 0.15);
    let spin = Vector3::new(0.0, 0.0, omega);
    let velocity = |x: &Vector<f64>| (spin.cross(&(Vector3::from(*x) - centre)) + Vector3::x()).into();
    model.initial_velocity = model.rest.iter().map(velocity).collect();
    model.stiffness_damping = damping;
    let model = Arc::new(model);
    let step = 0.9 * assembled(&model).unwrap().step;
    let mut stepper = CentralDifference::<f64>::new(Arc::clone(&model), step).unwrap();
    let mut state = State::at_rest(&model);
    let momenta = |state: &State<f64>| {
        let mut sums = [Vector3::zeros(); 2];
        for node in 0..model.node_count() {
            let place = Vector3::from(model.rest[node]) + Vector3::from(state.displacement[node]);
            let way = Vector3::from(state.increment[node]);
            sums[0] += way * (model.mass[node] / step);
            sums[1] += (place - 0.5 * way).cross(&way) * (model.mass[node] / step);
        }
        sums
    };
    let mut first = None;
    while state.time < 4.0 {
        stepper.evaluate(&mut state).unwrap();
        stepper.advance(&mut state);
        first.get_or_insert(momenta(&state));
    }
    let ([momentum, turn], [first, first_turn]) = (momenta(&state), first.unwrap());
    // About the centre of mass.
    let mass: f64 = model.mass.iter().sum();
    let at = |sums: [Vector3<f64>; 2], time: f64| {
        (sums[1] - (centre + Vector3::x() * time).cross(&(Vector3::x() * mass))).z
    };
    let lost = 1.0 - at([momentum, turn], state.time) / at([first, first_turn], step);
    println!("momentum changes by {:.1e}, spin by {lost:.4}", (momentum - first).norm() / first.norm());
    assert!((momentum - first).norm() < 1e-9 * first.norm());
    assert!((lost / (damping * omega * omega * 4.0) - 1.0).abs() < 0.1, "{lost}");
}

/// A cube that is squeezed to 60 % stiffens, and its steps are cut in time with damping, too: it comes to
/// rest.
#[test]
fn steps_are_cut_where_damping_and_stiffness_together_ask_for_it() {
    let mut model = distorted_cube("hex8-full", laws()[0]);
    let at = |model: &Model, z: f64| {
        let nodes = 0..model.node_count() as u32;
        nodes.filter(|&node| (model.rest[node as usize][2] - z).abs() < 1e-9).collect::<Vec<_>>()
    };
    let (low, high) = (at(&model, 0.0), at(&model, 0.3));
    model.fix("base", low);
    let curve = Curve { shape: CurveShape::SmoothStep, from: 0.0, to: 2.0 };
    let (components, motion) = ([true; 6], Motion::Displacement([0.0, 0.0, -0.12], curve));
    model.constraints.push(Constraint { name: "lid".into(), nodes: high, components, motion });
    let undamped = assembled(&model).unwrap().step;
    for part in [0.2, 2.0] {
        model.stiffness_damping = part * undamped;
        let critical = assembled(&model).unwrap().step;
        let monitor = Monitor::new(&model, critical, OnUnstable::Substep);
        let mut stepper =
            CentralDifference::<f64>::new(model.clone(), 0.9 * critical).unwrap().watched(monitor);
        let mut state = State::at_rest(&model);
        while state.time < 3.0 {
            stepper.evaluate(&mut state).unwrap();
            stepper.advance(&mut state);
        }
        let (energies, seen) = (stepper.energies(), &state.stability);
        println!("{part}: {energies:?}, {seen:?}");
        assert!(seen.cuts > 0 && seen.most_substeps > 1, "{seen:?}");
        assert!(energies.kinetic < 1e-6 * energies.internal && energies.balance < 0.01, "{energies:?}");
    }
}

/// Another stepper continues from a state with the same bits, and single precision follows double.
#[test]
fn a_state_has_all_that_damping_needs() {
    let model = distorted_cube("tet4-anp", laws()[1]);
    let critical = assembled(&model).unwrap().step;
    let model = shaken(model, 0.05, 0.3 * critical);
    let step = 0.5 * critical;
    let mut state = State::<f64>::at_rest(&model);
    let mut single = State::<f32>::at_rest(&model);
    let mut stepper = CentralDifference::new(model.clone(), step).unwrap();
    let mut in_single = CentralDifference::new(model.clone(), step).unwrap();
    let mut copy = None;
    for number in 0..60 {
        stepper.evaluate(&mut state).unwrap();
        stepper.advance(&mut state);
        in_single.evaluate(&mut single).unwrap();
        in_single.advance(&mut single);
        if number == 20 {
            copy = Some(state.clone());
        }
    }
    let mut copy = copy.unwrap();
    let mut other = CentralDifference::new(model.clone(), step).unwrap();
    for _ in 21..60 {
        other.evaluate(&mut copy).unwrap();
        other.advance(&mut copy);
    }
    assert_eq!(copy, state);
    let largest = state.displacement.as_flattened().iter().fold(0.0_f64, |most, u| most.max(u.abs()));
    let pairs = state.displacement.as_flattened().iter().zip(single.displacement.as_flattened());
    let apart = pairs.map(|(a, b)| (a - f64::from(*b)).abs()).fold(0.0, f64::max);
    println!("single precision differs by {:.1e}", apart / largest);
    assert!(apart < 1e-4 * largest);
}
