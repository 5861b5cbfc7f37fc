//! The stepper on a device against the one of the processor in double precision.

use std::sync::Arc;

use pliant_contact::touch::Contacts;
use pliant_explicit::Wanted;
use pliant_explicit::{CentralDifference, Observable, State, critical_step};
use pliant_gpu::{Design, Device, GpuStepper};
use pliant_mechanics::Energies;
use pliant_mechanics::load::{Load, LoadKind};
use pliant_mechanics::model::Model;
use pliant_mechanics::tensor::Vector;

use super::cube::smooth;

/// Steps of a comparison.
const STEPS: u64 = 200;

/// A design for tests in which it does not matter.
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

/// Converts to double precision.
pub fn double(vectors: &[Vector<f32>]) -> Vec<Vector<f64>> {
    vectors.iter().map(|v| v.map(f64::from)).collect()
}

/// Returns the energies that are compared.
pub fn numbers(energies: &Energies) -> [f64; 6] {
    let Energies { kinetic, internal, damping, hourglass, external, step_changes, .. } = *energies;
    [kinetic, internal, damping, hourglass, external, step_changes]
}

/// Makes a stepper of a design.
pub fn stepper(device: &Device, model: &Model, step: f64, design: Design) -> GpuStepper {
    GpuStepper::new(device, model.clone(), step, Some(design)).unwrap_or_else(|error| panic!("{error}"))
}

/// ‖a − b‖ over ‖a‖, or over a size.
pub fn distance_over(size: f64, a: &[Vector<f64>], b: &[Vector<f64>]) -> f64 {
    let length = norm(a.as_flattened().iter().copied());
    distance(a, b) * length / length.max(size)
}

/// Runs both from rest, the device in each design, and compares displacements, velocities, energies and
/// reactions.
pub fn compare(device: &Device, what: &str, model: &Model, designs: &[Design]) {
    compare_from(device, what, (model, &vec![[0.0; 3]; model.node_count()]), step_of(model), designs);
}

/// Compares like `compare`, by steps of `step` seconds from a displacement.
pub fn compare_from(
    device: &Device,
    what: &str,
    (model, start): (&Model, &[Vector<f64>]),
    step: f64,
    designs: &[Design],
) {
    let processor = CentralDifference::new(model.clone(), step).unwrap().dissipating();
    let single = CentralDifference::new(model.clone(), step).unwrap().dissipating();
    let found = run_both(what, (model, start), (processor, single), (designs, 1e-4), |design| {
        stepper(device, model, step, design).dissipating()
    });
    assert!(found.iter().all(Vec::is_empty));
}

/// Compares like `compare`, with a body that touches rigid things. Returns the force of each contact on the
/// processor and on the device.
pub fn compare_touching(
    device: &Device,
    what: &str,
    (model, contacts): (&Model, &Arc<Contacts>),
    step: f64,
    designs: &[Design],
) -> Vec<Vec<[Vector<f64>; 3]>> {
    let start = vec![[0.0; 3]; model.node_count()];
    let processor = CentralDifference::new(model.clone(), step).unwrap().dissipating();
    let processor = processor.with_contacts(Arc::clone(contacts));
    let single = CentralDifference::new(model.clone(), step).unwrap().dissipating();
    let single = single.with_contacts(Arc::clone(contacts));
    // A gap is known to the round-off of places, which a step makes a velocity: 6e-8 of 0.1 m over a
    // two-hundredth of the run, beside a way of some millimetres.
    run_both(what, (model, &start), (processor, single), (designs, 1e-3), |design| {
        let contacts = Arc::clone(contacts);
        GpuStepper::with_contacts(device, model.clone(), contacts, step, Some(design)).unwrap().dissipating()
    })
}

fn run_both(
    what: &str,
    (model, start): (&Model, &[Vector<f64>]),
    (mut processor, mut single): (CentralDifference<f64>, CentralDifference<f32>),
    (designs, velocities): (&[Design], f64),
    stepper: impl Fn(Design) -> GpuStepper,
) -> Vec<Vec<[Vector<f64>; 3]>> {
    let mut reference = State::<f64>::at_rest(model);
    reference.displacement.copy_from_slice(start);
    for _ in 0..STEPS {
        processor.evaluate(&mut reference).unwrap_or_else(|error| panic!("{what}: {error}"));
        processor.advance(&mut reference);
    }
    processor.evaluate(&mut reference).unwrap();
    let mut state = State::<f32>::at_rest(model);
    state.displacement.iter_mut().zip(start).for_each(|(to, u)| *to = u.map(|u| u as f32));
    for _ in 0..STEPS {
        single.evaluate(&mut state).unwrap_or_else(|error| panic!("{what}: {error}"));
        single.advance(&mut state);
    }
    single.evaluate(&mut state).unwrap();
    let of_processor = errors(model, (&reference, &processor), (&state, &single));
    let mut forces = Vec::new();
    for &design in designs {
        let what = format!("{what}, {design}");
        let mut state = State::<f32>::at_rest(model);
        state.displacement.iter_mut().zip(start).for_each(|(to, u)| *to = u.map(|u| u as f32));
        let mut stepper = stepper(design);
        stepper.advance(&mut state, STEPS).unwrap_or_else(|error| panic!("{what}: {error}"));
        stepper.evaluate(&mut state, Wanted::Everything).unwrap();
        assert_eq!((state.steps, state.time), (reference.steps, reference.time));
        let found = errors(model, (&reference, &processor), (&state, &stepper));
        agree(&what, found, of_processor, velocities);
        let both = processor.contact_forces().into_iter().zip(stepper.contact_forces());
        let of_single = single.contact_forces();
        forces.push(both.zip(of_single).map(|((a, b), c)| [a, b, c]).collect());
    }
    forces
}

/// Returns the errors of displacements, velocities, energies and reactions in single precision.
fn errors(
    model: &Model,
    (reference, processor): (&State<f64>, &CentralDifference<f64>),
    (state, stepper): (&State<f32>, &dyn Observable<f32>),
) -> [f64; 4] {
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
    let energy = (0..a.len()).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max)
        / a.into_iter().map(f64::abs).fold(0.0, f64::max);
    [displacement, velocity, energy, reaction]
}

/// Holds errors to limits. If twice the errors of the processor in single precision are larger, these are the
/// limits, up to a hundred times the given ones.
fn agree(what: &str, errors: [f64; 4], of_processor: [f64; 4], velocities_within: f64) {
    let [of_device, of_single] =
        [errors, of_processor].map(|errors| errors.map(|error| format!("{error:.1e}")).join(", "));
    println!("{what}: {of_device}; the processor in single precision {of_single}");
    let limits = [1e-5, velocities_within, 1e-4, 1e-4];
    for (k, name) in ["displacements", "velocities", "energies", "reactions"].into_iter().enumerate() {
        let limit = limits[k].max(2.0 * of_processor[k]).min(100.0 * limits[k]);
        assert!(errors[k] <= limit, "{what}: {name} are off by {:.1e}, and may be by {limit:.1e}", errors[k]);
    }
}

/// Returns the designs that the device can run.
pub fn designs(device: &Device) -> impl Iterator<Item = Design> {
    let atomics = device.adapter().float_atomics;
    Design::ALL.iter().copied().filter(move |design| atomics || *design != Design::FloatAtomics)
}

/// A load that grows smoothly.
pub fn load(name: &str, kind: LoadKind, surface: Option<usize>) -> Load {
    Load { surface, ..Load::new(name, kind, smooth(0.3)) }
}
