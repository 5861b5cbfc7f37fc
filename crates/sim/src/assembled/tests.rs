//! Steps of shells.

#[cfg(feature = "gpu")]
use pliant_gpu::Device;
use pliant_implicit::Shell;
use pliant_shells::element::Elasticity;
use pliant_shells::element::Wall;

#[cfg(feature = "gpu")]
use nalgebra::UnitQuaternion;
use pliant_explicit::Wanted;
use pliant_implicit::Assembly;

use super::*;
use crate::participant::Participant;
use crate::participant_setup::ShortSteps;
use crate::{Method, Steps};

/// A strip of two facets, clamped at two of its four nodes, in explicit steps of a part of the stable one.
fn strip(steps: ShortSteps, of_stable: f64) -> Assembled {
    let corner = |i: u32| Vector3::new(f64::from(i / 2) * 0.1, f64::from(i % 2) * 0.1, 0.0);
    let mut model = Assembly::new("strip", (0..4).map(corner));
    let material = Wall { elastic: Elasticity { young: 1e6, poisson: 0.3 }, density: 1000.0 };
    model.add_shell(&Shell::new("strip", vec![[0, 2, 3], [0, 3, 1]], 0.002, material)).unwrap();
    model.model_mut().fix("clamp", vec![0, 1]);
    let part = ParticipantSetup::implicit("strip", model, 0.1, 0.01);
    let Method::Implicit(bodies, _) = &part.method else { panic!("an implicit part") };
    let step = of_stable * ExplicitShells::stable_step(&bodies.model);
    let part = ParticipantSetup {
        method: Method::ExplicitShells(Arc::clone(bodies), steps),
        steps: Steps::within(0.1, step),
        ..part.clone()
    };
    Assembled::new(&part, bodies).unwrap()
}

/// Explicit steps cost little more than their forces. A reading of an instant and the next step share the
/// same forces.
#[test]
fn explicit_shells_find_their_forces_once_a_step() {
    let mut shells = strip(ShortSteps::default(), 0.9);
    for _ in 0..50 {
        // The loop of a run, and somebody who looks.
        shells.evaluate(Wanted::Energies).unwrap();
        shells.evaluate(Wanted::Energies).unwrap();
        shells.advance(1, &mut |_| ()).unwrap();
    }
    let SolverMethod::Explicit(solver) = &shells.method else { panic!("an explicit solver") };
    assert_eq!(solver.phases().evaluations, 50);
}

/// Nodes turned by nearly 2 rad, at which facets fold over; in single precision some seem turned by more.
/// From rest they turn back, as on the CPU. Nodes that keep spinning fail with the message of the CPU.
#[cfg(feature = "gpu")]
#[test]
fn a_facet_at_the_edge_of_folding_over_goes_on_or_fails_on_a_device_as_on_the_processor() {
    let Some(device) = pliant_testing::found_or_skipped(Device::open(None)) else { return };
    // The state after a number of steps, and whether the CPU took the first one.
    let run = |device: Option<&Device>, angle: f64, turn: f64| {
        let mut shells = strip(ShortSteps { device: device.cloned() }, 0.05);
        for node in 2..4 {
            shells.state.rotation[node] = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle);
            shells.state.spin[node] = Vector3::x() * (turn / shells.steps.step);
        }
        let stops = shells.device.as_mut().is_some_and(|on_device| {
            on_device.stepper.upload(&shells.state);
            let moved = on_device.stepper.advance(&mut shells.state.clone(), 1).unwrap();
            on_device.stepper.upload(&shells.state);
            moved.broken
        });
        let stride = shells.stride().min(20);
        let mut go = || {
            while shells.done < 20 {
                shells.evaluate(Wanted::Energies)?;
                shells.advance(stride, &mut |_| ())?;
            }
            shells.evaluate(Wanted::Energies)
        };
        let outcome = go().map_err(|failure| (failure.kind, failure.element, failure.time, failure.message));
        (outcome, shells.state, stops)
    };
    let mut stopped = 0;
    for short in [1e-9, 3e-8, 6e-8, 1.2e-7] {
        for turn in [0.0, 0.1] {
            let (expected, exact, _) = run(None, 2.0 - short, turn);
            let (outcome, state, stops) = run(Some(&device), 2.0 - short, turn);
            assert_eq!((&outcome, outcome.is_ok()), (&expected, turn == 0.0), "2 − {short:e}");
            let off = state.rotation.iter().zip(&exact.rotation).map(|(a, b)| a.angle_to(b));
            let off = off.fold(0.0, f64::max);
            assert!(off < 1e-5, "2 − {short:e}: {off:e}");
            stopped += u32::from(stops);
        }
    }
    assert!(stopped > 0, "single precision is never at the edge");
}
