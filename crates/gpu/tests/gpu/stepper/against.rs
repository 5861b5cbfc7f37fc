//! The stepper on a device against the one of the processor in double precision.

use std::sync::Arc;

use super::cube::smooth;
use pliant_contact::touch::Contacts;
use pliant_explicit::Wanted;
use pliant_explicit::{CentralDifference, Observable, State, critical_step};
use pliant_gpu::{Design, Device, GpuStepper};
use pliant_mechanics::Energies;
use pliant_mechanics::load::{Load, LoadKind};
use pliant_mechanics::model::Model;
use pliant_mechanics::tensor::Vector;

/// Steps of a comparison.
const STEPS: u64 = 200;

/// Where the design does not matter.
pub const PLAIN: &[Design] = &[Design::Gather];

/// A step that is stable for long.
pub fn step_of(model: &Model) -> f64 {
    0.9 * critical_step::element_bound(model).unwrap().step
}

fn norm(numbers: impl Iterator<Item = f64>) -> f64 {
    numbers.map(|x| x * x).sum::<f64>().sqrt()
}

/// ‖a − b‖/‖a‖.
pub fn distance(a: &[Vector<f64>], b: &[Vector<f64>]) -> f64 {
    let (a, b) = (a.as_flattened(), b.as_flattened());
    norm(a.iter().zip(b).map(|(a, b)| a - b)) / norm(a.iter().copied()).max(1e-30)
}

/// In double precision.
pub fn double(vectors: &[Vector<f32>]) -> Vec<Vector<f64>> {
    vectors.iter().map(|v| v.map(f64::from)).collect()
}

/// Those that are compared.
pub fn numbers(energies: &Energies) -> [f64; 5] {
    let Energies { kinetic, internal, damping, hourglass, external, .. } = *energies;
    [kinetic, internal, damping, hourglass, external]
}

/// One of a design.
pub fn stepper(device: &Device, model: &Model, step: f64, design: Design) -> GpuStepper {
    GpuStepper::new(device, model.clone(), step, Some(design)).unwrap_or_else(|error| panic!("{error}"))
}

/// ‖a − b‖ over ‖a‖, or over a size.
pub fn distance_over(size: f64, a: &[Vector<f64>], b: &[Vector<f64>]) -> f64 {
    let length = norm(a.as_flattened().iter().copied());
    distance(a, b) * length / length.max(size)
}

/// Runs both from rest, the device in each design, and compares displacements, velocities, energies and reactions.
pub fn compare(device: &Device, what: &str, model: &Model, designs: &[Design]) {
    compare_from(device, what, (model, &vec![[0.0; 3]; model.node_count()]), step_of(model), designs);
}

/// As `compare`, by steps of `step` seconds from a displacement.
pub fn compare_from(
    device: &Device,
    what: &str,
    (model, start): (&Model, &[Vector<f64>]),
    step: f64,
    designs: &[Design],
) {
    let processor = CentralDifference::new(model.clone(), step).unwrap();
    let found = run_both(what, (model, start), processor, (designs, 1e-4), |design| {
        stepper(device, model, step, design)
    });
    assert!(found.iter().all(Vec::is_empty));
}

/// As `compare`, of a body that touches rigid things; the force of each contact on the processor and on the device.
pub fn compare_touching(
    device: &Device,
    what: &str,
    (model, contacts): (&Model, &Arc<Contacts>),
    step: f64,
    designs: &[Design],
) -> Vec<Vec<[Vector<f64>; 2]>> {
    let start = vec![[0.0; 3]; model.node_count()];
    let processor = CentralDifference::new(model.clone(), step).unwrap().touching(Arc::clone(contacts));
    // A gap is known to the round-off of places, which a step makes a velocity: 6e-8 of 0.1 m over a two-hundredth of the run, beside a way
    // of some millimetres.
    run_both(what, (model, &start), processor, (designs, 1e-3), |design| {
        GpuStepper::touching(device, model.clone(), Arc::clone(contacts), step, Some(design)).unwrap()
    })
}

fn run_both(
    what: &str,
    (model, start): (&Model, &[Vector<f64>]),
    mut processor: CentralDifference<f64>,
    (designs, velocities): (&[Design], f64),
    stepper: impl Fn(Design) -> GpuStepper,
) -> Vec<Vec<[Vector<f64>; 2]>> {
    let mut reference = State::<f64>::at_rest(model);
    reference.displacement.copy_from_slice(start);
    for _ in 0..STEPS {
        processor.evaluate(&mut reference).unwrap_or_else(|error| panic!("{what}: {error}"));
        processor.advance(&mut reference);
    }
    processor.evaluate(&mut reference).unwrap();
    let mut forces = Vec::new();
    for &design in designs {
        let what = format!("{what}, {design}");
        let mut state = State::<f32>::at_rest(model);
        state.displacement.iter_mut().zip(start).for_each(|(to, u)| *to = u.map(|u| u as f32));
        let mut stepper = stepper(design);
        stepper.advance(&mut state, STEPS).unwrap_or_else(|error| panic!("{what}: {error}"));
        stepper.evaluate(&mut state, Wanted::Everything).unwrap();
        assert_eq!((state.steps, state.time), (reference.steps, reference.time));
        agree(&what, model, (&reference, &processor), (&state, &stepper), velocities);
        let both = processor.contact_forces().into_iter().zip(stepper.contact_forces());
        forces.push(both.map(|(a, b)| [a, b]).collect());
    }
    forces
}

fn agree(
    what: &str,
    model: &Model,
    (reference, processor): (&State<f64>, &CentralDifference<f64>),
    (state, stepper): (&State<f32>, &GpuStepper),
    velocities_within: f64,
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
    let energy = (0..5).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max)
        / a.into_iter().map(f64::abs).fold(0.0, f64::max);
    println!(
        "{what}: displacement {displacement:.1e}, velocity {velocity:.1e}, energies {energy:.1e}, reactions {reaction:.1e}"
    );
    assert!(displacement <= 1e-5, "{what}: displacements are off by {displacement:.1e}");
    assert!(velocity <= velocities_within, "{what}: velocities are off by {velocity:.1e}");
    assert!(energy <= 1e-4, "{what}: energies are off by {energy:.1e}: {a:?} {b:?}");
    assert!(reaction <= 1e-4, "{what}: reactions are off by {reaction:.1e}");
}

/// Those the device can run.
pub fn designs(device: &Device) -> impl Iterator<Item = Design> {
    let atomics = device.adapter().float_atomics;
    Design::ALL.iter().copied().filter(move |design| atomics || *design != Design::FloatAtomics)
}

/// A load that grows smoothly.
pub fn load(name: &str, kind: LoadKind, surface: Option<usize>) -> Load {
    Load { surface, ..Load::new(name, kind, smooth(0.3)) }
}
