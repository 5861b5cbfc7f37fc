//! Steps on devices that fail.

use std::sync::Arc;

use nalgebra::Vector3;
use pliant_linear::{
    BlockPattern, BlockValues, DeviceError, DeviceSolver, DeviceTimes, LinearDevice, LinearSolver, Pass,
    PassEnd, Preconditioner,
};
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::load::{Load, LoadKind};
use pliant_shells::element::{Elasticity, Wall};

use crate::AssemblySolver;
use crate::{Assembly, AssemblyState, BackwardEuler, DynamicSettings, Phases, Shell, SolveError};

/// Faults of a broken device.
#[derive(Clone, Copy, Debug)]
enum Fault {
    /// It fills its solutions with a number and says so.
    Fills(f32, PassEnd),
    Fails,
}

impl LinearDevice for Fault {
    fn aggregates(&self) -> usize {
        4
    }

    fn solver(&self) -> Result<Box<dyn DeviceSolver>, DeviceError> {
        Ok(Box::new(*self))
    }
}

impl DeviceSolver for Fault {
    fn arrange(&mut self, _pattern: &BlockPattern<'_>) -> Result<(), DeviceError> {
        Ok(())
    }

    fn take(&mut self, _values: &BlockValues<'_>) -> Result<(), DeviceError> {
        Ok(())
    }

    fn solve(
        &mut self,
        _right: &[f32],
        solution: &mut [f32],
        _goal: f32,
        _iterations: usize,
    ) -> Result<Pass, DeviceError> {
        match *self {
            Self::Fills(number, end) => {
                solution.fill(number);
                Ok(Pass { iterations: 1, end })
            }
            Self::Fails => Err(DeviceError("it is unplugged; plug it in".into())),
        }
    }

    fn times(&self) -> DeviceTimes {
        DeviceTimes::default()
    }
}

/// A strip that falls for a step.
fn fall(device: Option<Fault>) -> Result<(AssemblyState, Phases), SolveError> {
    let points = (0..42).map(|i| Vector3::new(f64::from(i / 2) * 0.1, f64::from(i % 2) * 0.1, 0.0));
    let cells =
        (0..20).flat_map(|i| [[2 * i, 2 * i + 2, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 1]]).collect();
    let wall = Wall { elastic: Elasticity { young: 1e6, poisson: 0.3 }, density: 1000.0 };
    let mut model = Assembly::new("strip", points);
    model.add_shell(&Shell::new("strip", cells, 0.01, wall)).unwrap();
    model.model_mut().fix("clamp", vec![0, 1]);
    let kind = LoadKind::Gravity { body: 0, acceleration: [0.0, 0.0, -9.81] };
    model.model_mut().loads.push(Load::new("weight", kind, Curve { shape: Shape::Hold, from: 0.0, to: 1.0 }));
    let linear = LinearSolver::ConjugateGradients {
        tolerance: 1e-10,
        iterations: 1000,
        preconditioner: Preconditioner::Aggregates,
    };
    let device = device.map(|fault| Arc::new(fault) as Arc<dyn LinearDevice>);
    let settings = DynamicSettings::new(0.01).real_time(linear);
    let mut solver = BackwardEuler::on(device, model.clone(), settings)?;
    let mut state = AssemblyState::at_rest(&model);
    solver.advance(&mut state)?;
    Ok((state, solver.phases()))
}

/// Solved to 1e-10 in the end, so displacements agree to some 1e-8.
#[test]
fn what_a_device_cannot_solve_is_finished_in_double_precision() {
    let (exact, alone) = fall(None).unwrap();
    assert_eq!(alone.left_to_cpu, 0);
    for (number, end) in [
        (f32::NAN, PassEnd::Reached),
        (f32::INFINITY, PassEnd::Indefinite),
        (0.0, PassEnd::Indefinite),
        (1e3, PassEnd::Reached),
    ] {
        let (state, phases) = fall(Some(Fault::Fills(number, end))).unwrap();
        let off = state.position.iter().zip(&exact.position).map(|(a, b)| (a - b).norm());
        let off = off.fold(0.0, f64::max) / (exact.position[41].z).abs();
        assert!(off < 1e-7 && phases.left_to_cpu == 1, "{number}: {off:e}, {}", phases.left_to_cpu);
        assert!(phases.iterations > 1);
    }
}

#[test]
fn a_device_that_fails_ends_the_step_with_its_words() {
    match fall(Some(Fault::Fails)) {
        Err(SolveError::Device(error)) => assert_eq!(error.0, "it is unplugged; plug it in"),
        other => panic!("{:?}", other.map(|_| ())),
    }
}
