//! The stepper on a device against the one of the processor.

mod against;
mod bodies;
mod contact;
mod cube;
mod failures;
mod jumble;
mod playing;
mod ties;

use pliant_explicit::Wanted;
use pliant_explicit::mass_scaling::{self, Goal};
use pliant_explicit::stability::{Monitor, OnUnstable};
use pliant_explicit::{BALANCE_STEPS, CentralDifference, Observable, State, StepError, critical_step};
use pliant_gpu::{Design, Device, StepFailure};
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::load::LoadKind;
use pliant_mechanics::model::{Averaging, Body, Cells, Constraint, Model, Motion, Solid};
use pliant_mechanics::prony::{Part, Prony, PronyTerm, PronyUpdate};
use serde_json::json;

use crate::support;
use against::{PLAIN, compare, designs, distance, double, load, numbers, step_of, stepper};
use cube::{
    CELLS, EDGE, ELEMENTS, elastic, every_law, free_cube, held_cube, layer, moved_cube, neo_hookean, smooth,
};

#[test]
fn every_element_in_every_design() {
    let Some(device) = support::device() else { return };
    let designs: Vec<_> = designs(&device).collect();
    for element in ELEMENTS {
        compare(&device, element, &moved_cube(element, elastic(neo_hookean())), &designs);
    }
}

/// Every law in plane stress, and those that keep the volume; fibres in the plane.
#[test]
fn membranes_of_every_law() {
    let Some(device) = support::device() else { return };
    let half = |name: &str, mut parameters: serde_json::Value| {
        parameters["poisson-ratio"] = 0.5.into();
        cube::law(name, parameters)
    };
    let fibres = json!({ "young-modulus": 3000.0, "fibre-modulus": 1000.0 });
    let incompressible = [
        half("neo-hookean", json!({ "young-modulus": 3000.0 })),
        half("mooney-rivlin", json!({ "c10": 400.0, "c01": 100.0 })),
        half("transversely-isotropic", fibres),
    ];
    for law in every_law().into_iter().chain(incompressible) {
        let what = format!("membrane of {}", law.name());
        compare(&device, &what, &moved_cube("membrane", elastic(law)), &[Design::Gather, Design::Blocks]);
    }
}

/// Hourglass control that grows with every law; of one that stiffens in every design.
#[test]
fn a_growing_hourglass_stiffness_of_every_law() {
    let Some(device) = support::device() else { return };
    let stiffens =
        cube::law("demiray", json!({ "shear-modulus": 700.0, "bulk-modulus": 5e3, "exponent": 5.0 }));
    for law in every_law() {
        let what = format!("growing hex8 of {}", law.name());
        compare(&device, &what, &moved_cube("growing-hex8", elastic(law)), &[Design::Gather]);
    }
    let designs: Vec<_> = designs(&device).collect();
    compare(&device, "growing hex8", &moved_cube("growing-hex8", elastic(stiffens)), &designs);
}

#[test]
fn cells_filled_in_part_of_every_element() {
    let Some(device) = support::device() else { return };
    for element in ELEMENTS {
        let mut model = moved_cube(element, elastic(neo_hookean()));
        let solid = &mut model.solids[0];
        let fractions: Vec<f64> = (0..solid.cells.len()).map(|cell| 0.2 + 0.1 * (cell % 8) as f64).collect();
        solid.cells = solid.cells.clone().filled(&fractions);
        compare(
            &device,
            &format!("{element} in part"),
            &model,
            &[Design::Gather, Design::Blocks, Design::Fast],
        );
    }
}

#[test]
fn several_bodies_elements_and_laws_in_one_model() {
    let Some(device) = support::device() else { return };
    let mut model = moved_cube("tet4", elastic(neo_hookean()));
    let whole = model.solids.remove(0);
    let nodes: Vec<[u32; 4]> =
        (0..whole.cells.len()).map(|c| whole.cells.nodes(c).try_into().unwrap()).collect();
    let (low, high) = nodes.split_at(nodes.len() / 3);
    model.mass.fill(0.0);
    let parts = [
        (Cells::tet4(low.to_vec(), &model.rest), elastic(every_law().remove(12))),
        (Cells::averaged_tet4(high.to_vec(), &model.rest, Averaging::Nodal), whole.material.clone()),
    ];
    for (cells, material) in parts {
        let count = cells.len();
        let fibre = vec![[0.6, 0.0, 0.8]; material.law.families() * count];
        model.add_solid(Solid { body: 0, material, cells, fibre, original: (0..count as u32).collect() });
    }
    let last = model.bodies[0].nodes.end;
    model.bodies = vec![
        Body { name: "low".into(), nodes: 0..60, shared: vec![], damping: 2.0 },
        Body { name: "high".into(), nodes: 60..last, shared: vec![], damping: 0.0 },
    ];
    let kind = LoadKind::Gravity { body: 1, acceleration: [0.0, 9.81, 0.0] };
    model.loads.push(load("gravity", kind, None));
    compare(&device, "several", &model, &designs(&device).collect::<Vec<_>>());
}

#[test]
fn relaxation_of_each_part_and_both_by_both_updates() {
    let Some(device) = support::device() else { return };
    let term = |part, weight, time| PronyTerm { part, weight, time };
    let terms = [
        term(Part::Isochoric, 0.3, 0.05),
        term(Part::Isochoric, 0.2, 0.4),
        term(Part::Volumetric, 0.25, 0.1),
    ];
    let cases = [
        ("three terms", &terms[..], PronyUpdate::BackwardEuler),
        ("the isochoric part", &terms[..2], PronyUpdate::Exact),
        ("the volumetric part", &terms[2..], PronyUpdate::Exact),
    ];
    for (what, terms, update) in cases {
        for element in ELEMENTS {
            let mut material = elastic(neo_hookean());
            material.prony = Prony::new(terms, update).unwrap();
            compare(&device, &format!("{element}, {what}"), &moved_cube(element, material), PLAIN);
        }
    }
}

#[test]
fn every_motion_damping_mass_scaling_and_initial_velocities() {
    let Some(device) = support::device() else { return };
    let held = || held_cube("tet4", elastic(neo_hookean()));
    let with = |[x, y, z]: [bool; 3], motion| {
        let components = [x, y, z, false, false, false];
        let mut model = held();
        model.constraints.push(Constraint { name: "top".into(), nodes: layer(CELLS), components, motion });
        model
    };
    let table = Shape::Table(vec![(0.0, 0.0), (0.1, 1.0), (0.3, -0.5), (0.5, 0.2)]);
    let velocity = Motion::Velocity([0.0, 0.05, -0.1], Curve { shape: table, from: 0.0, to: 0.0 });
    compare(&device, "velocity", &with([true; 3], velocity), PLAIN);
    let (axis, centre) = ([1.0, 2.0, 0.5], [0.3 * EDGE, 0.0, 0.8 * EDGE]);
    let top = layer(CELLS);
    let rest = held().rest;
    let places = top.iter().map(|&node| rest[node as usize]);
    let turned = Motion::rotation(axis, centre, 0.4, smooth(0.3), places);
    compare(&device, "rotation", &with([true; 3], turned), PLAIN);
    let by = (0..layer(CELLS).len()).map(|k| [1e-3 * k as f64, -2e-4 * k as f64, 5e-3]).collect();
    compare(
        &device,
        "node by node",
        &with([true, false, true], Motion::Displacements(by, smooth(0.3))),
        PLAIN,
    );
    let mut damped = moved_cube("tet4", elastic(neo_hookean()));
    damped.bodies[0].damping = 20.0;
    compare(&device, "damping", &damped, PLAIN);
    let mut scaled = moved_cube("tet4", elastic(neo_hookean()));
    mass_scaling::scale_mass(&mut scaled, Goal::Share(0.2)).unwrap();
    let acceleration = [0.0, 3.0, 0.0];
    scaled.loads.push(load("gravity", LoadKind::Gravity { body: 0, acceleration }, None));
    compare(&device, "mass scaling", &scaled, PLAIN);
    let mut thrown = held();
    thrown.bodies[0].damping = 1.0;
    thrown.initial_velocity = thrown.rest.iter().map(|x| [0.5 * x[2], 0.0, -0.8 * x[2]]).collect();
    compare(&device, "initial velocity", &thrown, PLAIN);
}

#[test]
fn deterministic_designs_give_the_same_bits_however_the_steps_are_divided() {
    let Some(device) = support::device() else { return };
    let model = moved_cube("tet4-anp", elastic(neo_hookean()));
    let run = |design: Design, strides: &[u64]| {
        let mut state = State::<f32>::at_rest(&model);
        let mut stepper = stepper(&device, &model, step_of(&model), design);
        for &stride in strides {
            stepper.evaluate(&mut state, Wanted::Energies).unwrap();
            stepper.advance(&mut state, stride).unwrap();
        }
        stepper.evaluate(&mut state, Wanted::Everything).unwrap();
        (state.displacement, state.increment, *stepper.energies())
    };
    for design in designs(&device).filter(|&design| design != Design::FloatAtomics) {
        let (u, du, energies) = run(design, &[210]);
        assert_eq!(run(design, &[210]), (u.clone(), du.clone(), energies));
        let (divided, increments, other) = run(design, &[1, 2, 97, 110]);
        assert_eq!((divided, increments), (u, du), "{design}");
        for (a, b) in numbers(&energies).into_iter().zip(numbers(&other)) {
            assert!((a - b).abs() < 1e-6 * energies.external, "{a} {b}");
        }
    }
}

fn relaxing_cube(element: &str) -> Model {
    let mut material = elastic(neo_hookean());
    let terms = [Part::Isochoric, Part::Volumetric].map(|part| PronyTerm { part, weight: 0.3, time: 0.1 });
    material.prony = Prony::new(&terms, PronyUpdate::Exact).unwrap();
    let mut model = moved_cube(element, material);
    model.bodies[0].damping = 3.0;
    model
}

#[test]
fn a_state_goes_from_the_processor_to_the_device_and_back() {
    let Some(device) = support::device() else { return };
    for element in ["tet4", "tet4-anp", "tet4-ianp", "hex8", "hex8-full", "membrane"] {
        let model = relaxing_cube(element);
        let step = step_of(&model);
        let on_processor = |state: &mut State<f32>| {
            let mut stepper = CentralDifference::new(model.clone(), step).unwrap().dissipating();
            for _ in 0..50 {
                stepper.evaluate(state).unwrap();
                stepper.advance(state);
            }
        };
        let last = |state: &mut State<f32>| {
            let mut stepper = CentralDifference::new(model.clone(), step).unwrap().dissipating();
            stepper.evaluate(state).unwrap();
            (double(&state.displacement), *stepper.energies())
        };
        let mut whole = State::at_rest(&model);
        on_processor(&mut whole);
        let begun = whole.clone();
        on_processor(&mut whole);
        on_processor(&mut whole);
        let (a, energies) = last(&mut whole);
        for design in designs(&device) {
            let mut mixed = begun.clone();
            let mut stepper = stepper(&device, &model, step, design).dissipating();
            stepper.advance(&mut mixed, 50).unwrap();
            stepper.bring_back(&mut mixed).unwrap();
            on_processor(&mut mixed);
            let (b, other) = last(&mut mixed);
            let error = distance(&a, &b);
            assert!(error < 1e-5, "{element}, {design}: {error:.1e}");
            for (a, b) in numbers(&energies).into_iter().zip(numbers(&other)) {
                assert!((a - b).abs() < 1e-5 * energies.external, "{element}: {energies:?} {other:?}");
            }
        }
    }
}

/// A cube in vibrations that a step hardly resolves loses much of their energy, as on the CPU and not as
/// without dissipation. The same holds with damping by stiffness.
#[test]
fn vibrations_are_damped_as_on_the_processor() {
    let Some(device) = support::device() else { return };
    let mut model = held_cube("tet4", elastic(neo_hookean()));
    let sign = |node: usize| if node.is_multiple_of(2) { 0.05 } else { -0.05 };
    model.initial_velocity = (0..model.node_count()).map(|node| [sign(node), 0.0, -sign(node)]).collect();
    let undamped = critical_step::assembled(&model).unwrap().step;
    for part in [0.0, 0.3] {
        model.stiffness_damping = part * undamped;
        are_damped_as_on_the_processor(&device, &model);
    }
}

fn are_damped_as_on_the_processor(device: &Device, model: &Model) {
    let step = 0.9 * critical_step::assembled(model).unwrap().step;
    // As many as may be off balance, which vibrations are that a step hardly resolves.
    let steps = u64::from(BALANCE_STEPS) - 2;
    let run = |mut stepper: CentralDifference<f64>| {
        let mut state = State::<f64>::at_rest(model);
        for step in 0..=steps {
            stepper.evaluate(&mut state).unwrap();
            if step < steps {
                stepper.advance(&mut state);
            }
        }
        (state.displacement, *stepper.energies())
    };
    let plain = Model { stiffness_damping: 0.0, ..model.clone() };
    let (kept, _) = run(CentralDifference::new(plain, step).unwrap());
    let (expected, energies) = run(CentralDifference::new(model.clone(), step).unwrap().dissipating());
    assert!(distance(&expected, &kept) > 0.1 && energies.damping > 0.3 * energies.external, "{energies:?}");
    for design in designs(device) {
        let mut state = State::<f32>::at_rest(model);
        let mut stepper = stepper(device, model, step, design).dissipating();
        stepper.advance(&mut state, steps).unwrap();
        stepper.evaluate(&mut state, Wanted::Everything).unwrap();
        let error = distance(&expected, &double(&state.displacement));
        assert!(error < 1e-4, "{design}: {error:.1e}");
        for (a, b) in numbers(&energies).into_iter().zip(numbers(stepper.energies())) {
            assert!(
                (a - b).abs() < 1e-4 * energies.external,
                "{design}: {energies:?} {:?}",
                stepper.energies()
            );
        }
    }
}

#[test]
fn steps_are_cut_where_the_limit_falls_and_end_a_run_where_they_must_not_be() {
    let Some(device) = support::device() else { return };
    let mut model = free_cube("tet4", elastic(neo_hookean()));
    let prescribed = |name: &str, z, motion| Constraint {
        name: name.into(),
        nodes: layer(z),
        components: [true; 6],
        motion,
    };
    model.constraints.push(prescribed("base", 0, Motion::Fixed));
    model.constraints.push(prescribed(
        "top",
        CELLS,
        Motion::Displacement([0.0, 0.0, -0.4 * EDGE], smooth(1.0)),
    ));
    let limit = critical_step::assembled(&model).unwrap().step;
    let step = 0.9 * limit;
    let run = |on_unstable| {
        let mut state = State::<f32>::at_rest(&model);
        let monitor = Monitor::new(&model, limit, on_unstable);
        let mut stepper = stepper(&device, &model, step, Design::Gather).watched(monitor);
        let ended = stepper.advance(&mut state, (1.2 / step) as u64);
        let ended = ended.and_then(|()| stepper.evaluate(&mut state, Wanted::Everything));
        (ended, state)
    };
    let mut expected = State::<f64>::at_rest(&model);
    let monitor = Monitor::new(&model, limit, OnUnstable::Substep);
    let mut processor = CentralDifference::new(model.clone(), step).unwrap().watched(monitor);
    while expected.steps < (1.2 / step) as u64 {
        processor.evaluate(&mut expected).unwrap();
        processor.advance(&mut expected);
    }
    let (ended, state) = run(OnUnstable::Substep);
    assert_eq!(ended, Ok(()));
    assert!(
        expected.stability.most_substeps > 1 && state.stability.most_substeps > 1,
        "{:?}",
        state.stability
    );
    let error = distance(&expected.displacement, &double(&state.displacement));
    eprintln!("substeps {}: {error:.1e}", state.stability.most_substeps);
    assert!(error < 0.02, "{error:.1e}");
    let (ended, state) = run(OnUnstable::Stop);
    let Err(StepFailure::Step(StepError::BelowLimit { time, .. })) = ended else { panic!("{ended:?}") };
    assert_eq!(time, state.time);
}
