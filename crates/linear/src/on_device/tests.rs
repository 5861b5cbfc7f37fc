//! Devices without room, and patterns that change.

use std::sync::Arc;
use std::time::Duration;

use crate::device::{BlockPattern, BlockValues, DeviceSolver, DeviceTimes, LinearDevice, Pass, PassEnd};
use crate::report::{DeviceError, LinearError};
use crate::sparse::{Equations, LowerMatrix};
use crate::{LinearSolver, Preconditioner, Workspace};

/// A device whose solver finds no room for its second pattern the first time, and leaves each solution to the
/// CPU. Each pattern takes it a second.
#[derive(Debug, Default)]
struct Narrow {
    calls: u32,
    /// Nodes of the pattern that it has.
    nodes: Option<usize>,
}

impl LinearDevice for Narrow {
    fn aggregates(&self) -> usize {
        4
    }

    fn solver(&self) -> Result<Box<dyn DeviceSolver>, DeviceError> {
        Ok(Box::new(Self::default()))
    }
}

impl DeviceSolver for Narrow {
    fn arrange(&mut self, pattern: &BlockPattern<'_>) -> Result<(), DeviceError> {
        self.calls += 1;
        self.nodes = (self.calls != 2).then(|| pattern.nodes());
        self.nodes.map(|_| ()).ok_or(DeviceError("its memory is full; use a coarser mesh".into()))
    }

    fn take(&mut self, values: &BlockValues<'_>) -> Result<(), DeviceError> {
        assert_eq!(self.nodes, Some(values.inverse.len() / 36));
        Ok(())
    }

    fn solve(
        &mut self,
        right: &[f32],
        solution: &mut [f32],
        _goal: f32,
        _iterations: usize,
    ) -> Result<Pass, DeviceError> {
        assert_eq!(self.nodes, Some(right.len() / 6));
        solution.fill(0.0);
        Ok(Pass { iterations: 1, end: PassEnd::Indefinite })
    }

    fn times(&self) -> DeviceTimes {
        DeviceTimes { upload: Duration::from_secs(self.calls.into()), ..DeviceTimes::default() }
    }
}

/// Springs to the ground at some nodes, on the device of the workspace before.
fn grounded(nodes: usize, before: Option<&mut Workspace>) -> (Workspace, LowerMatrix) {
    let equations = Equations::new(&vec![true; 6 * nodes]);
    let cells: Vec<[u32; 1]> = (0..nodes as u32).map(|node| [node]).collect();
    let mut matrix = LowerMatrix::new(&equations, cells.iter().map(<[u32; 1]>::as_slice), &[]);
    (0..6 * nodes).for_each(|at| matrix.add_diagonal(at, 2.0));
    let preconditioner = Preconditioner::BlockJacobi;
    let solver = LinearSolver::ConjugateGradients { tolerance: 1e-10, iterations: 100, preconditioner };
    let device: Arc<dyn LinearDevice> = Arc::new(Narrow::default());
    (Workspace::new(solver, Some(&device), &equations, &matrix, before).unwrap(), matrix)
}

#[test]
fn a_device_without_room_for_a_pattern_is_not_used_until_it_has_taken_it() {
    let (mut small, matrix) = grounded(3, None);
    assert!(small.prepare(&matrix).is_ok());
    let (mut large, matrix) = grounded(5, Some(&mut small));
    let full = DeviceError("its memory is full; use a coarser mesh".into());
    assert_eq!(large.prepare(&matrix).unwrap_err(), LinearError::Device(full));
    assert!(large.prepare(&matrix).is_ok());
    let mut solution = [0.0; 30];
    large.solve(&matrix, &[1.0; 30], &mut solution).unwrap();
    assert!(solution.iter().all(|x| (x - 0.5).abs() < 1e-9), "{solution:?}");
    assert_eq!(
        large.of_device(),
        (DeviceTimes { upload: Duration::from_secs(3), ..DeviceTimes::default() }, 1)
    );
}

#[test]
fn a_pattern_without_equations_keeps_the_times_of_a_device() {
    let (mut some, matrix) = grounded(3, None);
    assert!(some.prepare(&matrix).is_ok());
    let times = some.of_device();
    assert_eq!(times.0.upload, Duration::from_secs(1));
    let (mut none, matrix) = grounded(0, Some(&mut some));
    assert!(none.prepare(&matrix).is_ok() && none.solve(&matrix, &[], &mut []).is_ok());
    assert_eq!(none.of_device(), times);
}
