//! The stepper on a device against the one of the processor in double precision.

#[path = "support/cube.rs"]
mod cube;
mod support;

use cube::{
    CELLS, EDGE, ELEMENTS, elastic, every_law, free_cube, held_cube, layer, moved_cube, neo_hookean, smooth,
    top_quads,
};
use pliant_gpu::{Design, Device, GpuError, GpuStepper, StepFailure, Wanted};
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::load::{Face, Load, LoadKind, NO_NODE};
use pliant_mechanics::mapping::Mapping;
use pliant_mechanics::model::{Averaging, Body, Cells, Constraint, Model, Motion, Solid, Surface};
use pliant_mechanics::prony::{Part, Prony, PronyTerm, PronyUpdate};
use pliant_mechanics::stability::{Monitor, OnUnstable};
use pliant_mechanics::tensor::Vector;
use pliant_mechanics::{CentralDifference, Energies, Observable, State, StepError, critical_step};

const STEPS: u64 = 200;

/// Where the design does not matter.
const PLAIN: &[Design] = &[Design::Gather];

fn step_of(model: &Model) -> f64 {
    0.9 * critical_step::element_bound(model).unwrap().step
}

fn norm(numbers: impl Iterator<Item = f64>) -> f64 {
    numbers.map(|x| x * x).sum::<f64>().sqrt()
}

/// ‖a − b‖/‖a‖.
fn distance(a: &[Vector<f64>], b: &[Vector<f64>]) -> f64 {
    let (a, b) = (a.as_flattened(), b.as_flattened());
    norm(a.iter().zip(b).map(|(a, b)| a - b)) / norm(a.iter().copied()).max(1e-30)
}

fn double(vectors: &[Vector<f32>]) -> Vec<Vector<f64>> {
    vectors.iter().map(|v| v.map(f64::from)).collect()
}

fn numbers(energies: &Energies) -> [f64; 5] {
    let Energies { kinetic, internal, damping, hourglass, external, .. } = *energies;
    [kinetic, internal, damping, hourglass, external]
}

fn stepper<'m>(device: &Device, model: &'m Model, step: f64, design: Design) -> GpuStepper<'m> {
    GpuStepper::new(device, model, step, Some(design)).unwrap_or_else(|error| panic!("{error}"))
}

/// ‖a − b‖ over ‖a‖, or over a size.
fn distance_over(size: f64, a: &[Vector<f64>], b: &[Vector<f64>]) -> f64 {
    let length = norm(a.as_flattened().iter().copied());
    distance(a, b) * length / length.max(size)
}

/// Runs both, the device in each design, and compares displacements, velocities, energies and reactions.
fn compare(device: &Device, what: &str, model: &Model, designs: &[Design]) {
    let step = step_of(model);
    let mut reference = State::<f64>::at_rest(model);
    let mut processor = CentralDifference::new(model, step).unwrap();
    for _ in 0..STEPS {
        processor.evaluate(&mut reference).unwrap_or_else(|error| panic!("{what}: {error}"));
        processor.advance(&mut reference);
    }
    processor.evaluate(&mut reference).unwrap();
    for &design in designs {
        let what = format!("{what}, {design}");
        let mut state = State::<f32>::at_rest(model);
        let mut stepper = stepper(device, model, step, design);
        stepper.advance(&mut state, STEPS).unwrap_or_else(|error| panic!("{what}: {error}"));
        stepper.evaluate(&mut state, Wanted::Everything).unwrap();
        assert_eq!((state.steps, state.time), (reference.steps, reference.time));
        agree(&what, model, (&reference, &processor), (&state, &stepper));
    }
}

fn agree(
    what: &str,
    model: &Model,
    (reference, processor): (&State<f64>, &CentralDifference<f64>),
    (state, stepper): (&State<f32>, &GpuStepper),
) {
    let displacement = distance(&reference.displacement, &double(&state.displacement));
    let nodes = 0..model.node_count();
    let velocities: Vec<_> = nodes.clone().map(|node| processor.velocity(reference, node)).collect();
    // Velocities that are small beside the mean one of the run hold the round-off of displacements.
    let mean = norm(reference.displacement.as_flattened().iter().copied()) / reference.time;
    let found: Vec<_> = nodes.map(|node| stepper.velocity(state, node)).collect();
    let velocity = distance_over(mean, &velocities, &found);
    let constraints = 0..model.constraints.len();
    let reactions: Vec<_> = constraints.clone().map(|index| processor.reaction(index)).collect();
    let reaction =
        distance(&reactions, &constraints.map(|index| stepper.reaction(index)).collect::<Vec<_>>());
    let (a, b) = (numbers(processor.energies()), numbers(stepper.energies()));
    let energy = (0..5).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max) / a.into_iter().fold(0.0, f64::max);
    println!(
        "{what}: displacement {displacement:.1e}, velocity {velocity:.1e}, energies {energy:.1e}, reactions {reaction:.1e}"
    );
    assert!(displacement <= 1e-5, "{what}: displacements are off by {displacement:.1e}");
    assert!(velocity <= 1e-4, "{what}: velocities are off by {velocity:.1e}");
    assert!(energy <= 1e-4, "{what}: energies are off by {energy:.1e}: {a:?} {b:?}");
    assert!(reaction <= 1e-4, "{what}: reactions are off by {reaction:.1e}");
}

#[test]
fn every_element_in_every_design() {
    let Some(device) = support::device() else { return };
    let designs: Vec<_> = designs(&device).collect();
    for element in ELEMENTS {
        compare(&device, element, &moved_cube(element, elastic(neo_hookean())), &designs);
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
        Body { name: "low".into(), nodes: 0..60, damping: 2.0 },
        Body { name: "high".into(), nodes: 60..last, damping: 0.0 },
    ];
    let kind = LoadKind::Gravity { body: 1, acceleration: [0.0, 9.81, 0.0] };
    model.loads.push(load("gravity", kind, None));
    compare(&device, "several", &model, &designs(&device).collect::<Vec<_>>());
}

/// Those the device can run.
fn designs(device: &Device) -> impl Iterator<Item = Design> {
    let atomics = device.adapter().float_atomics;
    Design::ALL.iter().copied().filter(move |design| atomics || *design != Design::FloatAtomics)
}

#[test]
fn a_force_out_of_the_range_of_whole_numbers_is_told_and_never_wraps() {
    let Some(device) = support::device() else { return };
    let mut model = moved_cube("tet4", elastic(every_law().remove(9)));
    model.constraints[1].motion = Motion::Displacement([0.0, 0.0, 3.0 * EDGE], smooth(0.5));
    let mut state = State::<f32>::at_rest(&model);
    let mut stepper = stepper(&device, &model, 0.1 * step_of(&model), Design::FixedAtomics);
    let error = stepper.advance(&mut state, 4000).expect_err("the force is too large");
    let StepFailure::Device(GpuError::Overflow { time, .. }) = &error else { panic!("{error:?}") };
    assert!(*time > 0.0 && *time == state.time, "{error}");
}

#[test]
fn every_law_on_elements_with_and_without_averaging() {
    let Some(device) = support::device() else { return };
    for law in every_law() {
        for element in ["tet4", "tet4-anp"] {
            if element == "tet4" || law.has_volumetric_energy() {
                let what = format!("{} on {element}", law.name());
                compare(&device, &what, &moved_cube(element, elastic(law)), PLAIN);
            }
        }
    }
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

fn load(name: &str, kind: LoadKind, surface: Option<usize>) -> Load {
    Load { name: name.into(), kind, curve: smooth(0.3), surface }
}

/// Quads, or two triangles for each of them.
fn top(triangles: bool) -> Vec<Face> {
    let halves = |[a, b, c, d]: Face| vec![[a, b, c, NO_NODE], [a, c, d, NO_NODE]];
    top_quads().into_iter().flat_map(|quad| if triangles { halves(quad) } else { vec![quad] }).collect()
}

#[test]
fn every_load() {
    let Some(device) = support::device() else { return };
    let cube = || held_cube("hex8", elastic(neo_hookean()));
    let with = |load: Load| {
        let mut model = cube();
        model.loads.push(load);
        model
    };
    let acceleration = [2.0, 0.0, -9.81];
    let gravity = || load("gravity", LoadKind::Gravity { body: 0, acceleration }, None);
    let forces = LoadKind::Forces(layer(CELLS).into_iter().map(|node| (node, [2e-2, 0.0, 4e-2])).collect());
    let pressure = |triangles| LoadKind::Pressure { faces: top(triangles), pressure: 300.0 };
    compare(&device, "gravity", &with(gravity()), PLAIN);
    compare(&device, "forces", &with(load("pull", forces.clone(), None)), PLAIN);
    compare(&device, "pressure on quads", &with(load("press", pressure(false), None)), PLAIN);
    compare(&device, "pressure on triangles", &with(load("press", pressure(true), None)), PLAIN);
    // A surface of the nodes of the top, each carried half by the node below.
    let mut model = cube();
    let rows: Vec<[(u32, f64); 2]> =
        (0..model.node_count() as u32).map(|n| [(n, 0.5), (n.saturating_sub(25), 0.5)]).collect();
    let mapping = Mapping::from_rows(rows.iter().map(<[_; 2]>::as_slice));
    let rest = mapping.apply(&model.rest);
    model.surfaces.push(Surface { name: "skin".into(), body: 0, rest, mapping });
    model.loads = vec![
        gravity(),
        load("press", pressure(false), Some(0)),
        load("also", pressure(true), Some(0)),
        load("pull", forces, Some(0)),
    ];
    compare(&device, "all at once on a carried surface", &model, PLAIN);
}

#[test]
fn every_motion_damping_mass_scaling_and_initial_velocities() {
    let Some(device) = support::device() else { return };
    let held = || held_cube("tet4", elastic(neo_hookean()));
    let with = |components, motion| {
        let mut model = held();
        model.constraints.push(Constraint { name: "top".into(), nodes: layer(CELLS), components, motion });
        model
    };
    let table = Shape::Table(vec![(0.0, 0.0), (0.1, 1.0), (0.3, -0.5), (0.5, 0.2)]);
    let velocity = Motion::Velocity([0.0, 0.05, -0.1], Curve { shape: table, from: 0.0, to: 0.0 });
    compare(&device, "velocity", &with([true; 3], velocity), PLAIN);
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
    scaled.scale_mass(1.5 * critical_step::element_bound(&scaled).unwrap().step);
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
    for element in ["tet4", "tet4-anp", "tet4-ianp", "hex8", "hex8-full"] {
        let model = relaxing_cube(element);
        let step = step_of(&model);
        let on_processor = |state: &mut State<f32>| {
            let mut stepper = CentralDifference::new(&model, step).unwrap();
            for _ in 0..50 {
                stepper.evaluate(state).unwrap();
                stepper.advance(state);
            }
        };
        let last = |state: &mut State<f32>| {
            let mut stepper = CentralDifference::new(&model, step).unwrap();
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
            let mut stepper = stepper(&device, &model, step, design);
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

/// Runs on the processor until it fails.
fn failure_of(model: &Model, step: f64) -> StepError {
    let mut state = State::<f32>::at_rest(model);
    let mut stepper = CentralDifference::new(model, step).unwrap();
    for _ in 0..2000 {
        if let Err(error) = stepper.evaluate(&mut state) {
            return error;
        }
        stepper.advance(&mut state);
    }
    panic!("it does not fail")
}

fn failure_on(device: &Device, model: &Model, step: f64) -> (StepFailure, State<f32>) {
    let mut state = State::<f32>::at_rest(model);
    let mut stepper = stepper(device, model, step, Design::Gather);
    let error = stepper.advance(&mut state, 2000).expect_err("it fails");
    (error, state)
}

#[test]
fn an_inverted_cell_is_told_as_on_the_processor_though_it_lies_between_two_looks() {
    let Some(device) = support::device() else { return };
    for element in ["tet4", "tet4-anp", "hex8", "hex8-full"] {
        let mut model = held_cube(element, elastic(neo_hookean()));
        let motion = Motion::Displacement([0.0, 0.0, -1.2 * EDGE], smooth(0.3));
        let (name, nodes) = ("top".into(), layer(CELLS));
        model.constraints.push(Constraint { name, nodes, components: [true; 3], motion });
        let step = 0.5 * step_of(&model);
        let expected = failure_of(&model, step);
        let (error, state) = failure_on(&device, &model, step);
        let (
            StepError::Inverted { element: a, time, .. },
            StepFailure::Step(StepError::Inverted { element: b, .. }),
        ) = (&expected, &error)
        else {
            panic!("{element}: {expected:?}, {error:?}")
        };
        assert_eq!((a, *time), (b, state.time), "{element}: {error}");
    }
}

#[test]
fn a_displacement_that_is_not_finite_is_told_with_its_node_and_an_unstable_run_as_unbalanced() {
    let Some(device) = support::device() else { return };
    let mut model = held_cube("tet4", elastic(neo_hookean()));
    let kind = LoadKind::Forces(vec![(layer(CELLS)[3], [0.0, 1e38, 0.0])]);
    let shape = Shape::Table(vec![(0.05, 0.0), (0.051, 1e10)]);
    model.loads.push(Load { curve: Curve { shape, from: 0.0, to: 0.0 }, ..load("pull", kind, None) });
    let step = step_of(&model);
    let (StepError::NotFinite { node: a, .. }, StepFailure::Step(StepError::NotFinite { node: b, .. })) =
        (failure_of(&model, step), failure_on(&device, &model, step).0)
    else {
        panic!("{:?}, {:?}", failure_of(&model, step), failure_on(&device, &model, step).0)
    };
    assert_eq!(a, b);
    let mut model = moved_cube("hex8", elastic(neo_hookean()));
    model.constraints[1].motion = Motion::Displacement([0.0, 0.0, 1e-4], smooth(0.2));
    let limit = critical_step::true_limit(&model).unwrap().step;
    let (error, _) = failure_on(&device, &model, 1.02 * limit);
    assert!(matches!(error, StepFailure::Step(_)), "{error:?}");
}

#[test]
fn contradictions_and_elements_without_their_law_are_refused_by_name() {
    let Some(device) = support::device() else { return };
    let mut model = moved_cube("tet4", elastic(neo_hookean()));
    model.constraints[1].nodes.push(0);
    let refused = GpuStepper::new(&device, &model, 1e-3, None).err();
    assert!(matches!(refused, Some(GpuError::Contradiction(_))), "{refused:?}");
    let law = every_law().into_iter().find(|law| !law.has_volumetric_energy()).unwrap();
    let model = moved_cube("tet4-anp", elastic(law));
    let refused = GpuStepper::new(&device, &model, 1e-3, None).err();
    assert!(matches!(refused, Some(GpuError::Unsupported { .. })), "{refused:?}");
}

#[test]
fn steps_are_cut_where_the_limit_falls_and_end_a_run_where_they_must_not_be() {
    let Some(device) = support::device() else { return };
    let mut model = free_cube("tet4", elastic(neo_hookean()));
    let hold = |name: &str, z, motion| Constraint {
        name: name.into(),
        nodes: layer(z),
        components: [true; 3],
        motion,
    };
    model.constraints.push(hold("base", 0, Motion::Fixed));
    model.constraints.push(hold("top", CELLS, Motion::Displacement([0.0, 0.0, -0.4 * EDGE], smooth(1.0))));
    let limit = critical_step::true_limit(&model).unwrap().step;
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
    let mut processor = CentralDifference::new(&model, step).unwrap().watched(monitor);
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
