//! The stepper on a device against the one of the processor in double precision.

mod support;

use pliant_gpu::{Design, Device, GpuStepper, Wanted};
use pliant_mechanics::model::Model;
use pliant_mechanics::{CentralDifference, Energies, Observable, State, critical_step};
use support::cube::{self, elastic, moved_cube, neo_hookean};

const STEPS: u64 = 200;

fn step_of(model: &Model) -> f64 {
    0.9 * critical_step::element_bound(model).unwrap().step
}

fn norm(vectors: impl Iterator<Item = f64>) -> f64 {
    vectors.map(|x| x * x).sum::<f64>().sqrt()
}

fn numbers(energies: &Energies) -> [f64; 5] {
    let Energies { kinetic, internal, damping, hourglass, external, .. } = *energies;
    [kinetic, internal, damping, hourglass, external]
}

/// Runs both and compares displacements, velocities, energies and reactions.
fn compare(device: &Device, what: &str, model: &Model, design: Design) {
    let step = step_of(model);
    let mut reference = State::<f64>::at_rest(model);
    let mut processor = CentralDifference::new(model, step).unwrap();
    for _ in 0..STEPS {
        processor.evaluate(&mut reference).unwrap_or_else(|error| panic!("{what}: {error}"));
        processor.advance(&mut reference);
    }
    processor.evaluate(&mut reference).unwrap();
    let mut state = State::<f32>::at_rest(model);
    let mut stepper = GpuStepper::new(device, model, step, Some(design))
        .unwrap_or_else(|error| panic!("{what}: {error}: {:?}", device.check()));
    stepper.advance(&mut state, STEPS).unwrap_or_else(|error| panic!("{what}: {error}"));
    stepper.evaluate(&mut state, Wanted::Everything).unwrap();
    assert_eq!((state.steps, state.time), (reference.steps, reference.time));

    let pairs = || reference.displacement.iter().flatten().zip(state.displacement.iter().flatten());
    let error = norm(pairs().map(|(a, b)| a - f64::from(*b))) / norm(pairs().map(|(a, _)| *a));
    let speeds = |node: usize| (processor.velocity(&reference, node), stepper.velocity(&state, node));
    let speeds = || (0..model.node_count()).map(speeds).flat_map(|(a, b)| [0, 1, 2].map(|c| (a[c], b[c])));
    let speed = norm(speeds().map(|(a, b)| a - b)) / norm(speeds().map(|(a, _)| a));
    let (a, b) = (numbers(processor.energies()), numbers(stepper.energies()));
    let largest = a.iter().fold(0.0_f64, |most, e| most.max(e.abs()));
    let energy = (0..5).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max) / largest;
    let forces =
        (0..model.constraints.len()).map(|index| (processor.reaction(index), stepper.reaction(index)));
    let forces: Vec<_> = forces.flat_map(|(a, b)| [0, 1, 2].map(|c| (a[c], b[c]))).collect();
    let size = norm(forces.iter().map(|(a, _)| *a)).max(1e-30);
    let reaction = norm(forces.iter().map(|(a, b)| a - b)) / size;
    eprintln!(
        "{what} ({design}): displacement {error:.1e}, velocity {speed:.1e}, energies {energy:.1e}, reactions {reaction:.1e}"
    );
    assert!(error <= 1e-5, "{what}: displacements are off by {error:.1e}");
    assert!(speed <= 1e-4, "{what}: velocities are off by {speed:.1e}");
    assert!(energy <= 1e-4, "{what}: energies are off by {energy:.1e}: {a:?} {b:?}");
    assert!(reaction <= 1e-3, "{what}: reactions are off by {reaction:.1e}: {forces:?}");
}

#[test]
fn every_element_in_every_design() {
    let Some(device) = support::device() else { return };
    for &design in Design::ALL {
        for element in cube::ELEMENTS {
            compare(&device, element, &moved_cube(element, elastic(neo_hookean())), design);
        }
    }
}
