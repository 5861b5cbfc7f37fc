//! The matrix of a model's equations, the additions to it, and its solvers.

use std::sync::Arc;
use std::time::Instant;

use nalgebra::Vector3;
use pliant_linear::sparse::{Cell, Equations, LowerMatrix, NONE};
use pliant_linear::{LinearDevice, LinearError, LinearReport, LinearSolver, Workspace, ZERO_PIVOT};
use pliant_shells::rotation::skew;

use super::Phases;
use super::followers::Followers;
use super::nodal_forces::NodalForces;
use crate::model::assembly::Spring;
use crate::model::error::SolveError;

/// The equations of the free components, their matrix, and what solves with it.
pub(crate) struct Stiffness {
    pub(crate) equations: Equations,
    pub(crate) matrix: LowerMatrix,
    /// Forces on free components from prescribed increments: K_fc d_c.
    pub(crate) coupling: Vec<f64>,
    /// The stiffness at the start of a step that damps it; empty without such damping.
    pub(crate) damper: Vec<f64>,
    pub(super) solver: LinearSolver,
    /// Device that solves the equations in place of the CPU.
    pub(super) device: Option<Arc<dyn LinearDevice>>,
    /// None in a system of forces alone.
    workspace: Option<Workspace>,
    pub(crate) last_solution: LinearReport,
}

impl Stiffness {
    /// Without a pattern: for forces alone.
    pub(super) fn new(equations: Equations) -> Self {
        Self {
            equations,
            matrix: LowerMatrix::default(),
            coupling: Vec::new(),
            damper: Vec::new(),
            solver: LinearSolver::Direct,
            device: None,
            workspace: None,
            last_solution: LinearReport::default(),
        }
    }

    /// Takes another pattern; values of the damper move to their new places.
    pub(super) fn take_pattern(&mut self, matrix: LowerMatrix) -> Result<(), SolveError> {
        let (device, before) = (self.device.as_ref(), self.workspace.as_mut());
        let workspace = Workspace::new(self.solver, device, &self.equations, &matrix, before);
        self.workspace = Some(workspace.map_err(linear_error)?);
        let older = std::mem::replace(&mut self.matrix, matrix);
        if !self.damper.is_empty() {
            self.damper = self.matrix.carried(&older, &self.damper);
        }
        Ok(())
    }

    /// True if only one half of the matrix is kept.
    pub(super) fn is_symmetric(&self) -> bool {
        self.matrix.mirror.is_empty()
    }

    /// Begins anew with nodes at some places [m].
    pub(super) fn clear(&mut self, position: &[Vector3<f64>]) {
        self.matrix.clear();
        self.coupling.fill(0.0);
        if let Some(workspace) = &mut self.workspace {
            workspace.place(position);
        }
    }

    /// Keeps the stiffness as it is now for damping, if there is some.
    pub(crate) fn take_damper(&mut self) {
        let kept = self.damper.len();
        self.damper.copy_from_slice(&self.matrix.value[..kept]);
    }

    /// Values of the older matrix whose factors precondition the next one, if there is one.
    pub(crate) fn factored(&self) -> Option<&[f64]> {
        self.workspace.as_ref()?.factored()
    }

    /// Takes the factors of a matrix with these values as preconditioner of the next one.
    pub(crate) fn precondition_with(&mut self, values: Vec<f64>) {
        if let Some(workspace) = &mut self.workspace {
            workspace.precondition_with(values, &mut self.matrix);
        }
    }

    /// Adds a stiffness of translations at its places, given to the nodes that others follow.
    pub(super) fn add_cell(
        &mut self,
        followers: Option<&Followers>,
        nodes: &[u32],
        places: &[u32],
        tangent: &[f64],
        moved: &[f64],
    ) {
        let expanded = followers.and_then(|followers| followers.expanded(nodes, false));
        match (expanded, followers) {
            (Some(expanded), Some(followers)) => {
                let whole = followers.condensed(nodes, 3, &expanded, tangent);
                self.add_block((&expanded.0, expanded.1), places, &whole, moved);
            }
            _ => self.add_block((nodes, 3), places, tangent, moved),
        }
    }

    /// Adds a stiffness of the first components of nodes at its places, and its forces from prescribed
    /// increments to the coupling.
    pub(super) fn add_block(
        &mut self,
        (nodes, components): (&[u32], usize),
        places: &[u32],
        tangent: &[f64],
        moved: &[f64],
    ) {
        self.matrix.add(&self.equations, &Cell { nodes, components, places, entries: tangent });
        let component = |i: usize| 6 * nodes[i / components] as usize + i % components;
        let size = components * nodes.len();
        for (column, entries) in tangent.chunks_exact(size).enumerate() {
            let by = moved[component(column)];
            if by == 0.0 {
                continue;
            }
            for (row, entry) in entries.iter().enumerate() {
                let equation = self.equations.number[component(row)];
                if equation != NONE {
                    self.coupling[equation as usize] += entry * by;
                }
            }
        }
    }

    /// Adds the stiffness of a spring.
    pub(super) fn add_spring(&mut self, followers: Option<&Followers>, spring: &Spring) {
        let followed = followers.and_then(|followers| followers.spring(spring.node, spring.stiffness));
        if let Some(((nodes, components), stiffness)) = followed {
            let places = self.matrix.places(&self.equations, &nodes, components);
            let cell = Cell { nodes: &nodes, components, places: &places, entries: &stiffness };
            self.matrix.add(&self.equations, &cell);
            return;
        }
        for &equation in &self.equations.number[6 * spring.node as usize..][..3] {
            if equation != NONE {
                self.matrix.add_diagonal(equation as usize, spring.stiffness);
            }
        }
    }

    /// Subtracts S(m)/2 for the moments m of loads on nodes, whose axes stay in space: their covariant
    /// derivative.
    pub(super) fn turn_moments(&mut self, forces: &NodalForces, factor: f64) {
        for at in (3..forces.external.len()).step_by(6) {
            let moment =
                Vector3::from_fn(|c, _| forces.external[at + c] + factor * forces.controlled[at + c]);
            if moment == Vector3::zeros() {
                continue;
            }
            let half = skew(&moment) * 0.5;
            let equation = |c: usize| self.equations.number[at + c];
            for (row, column) in [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)] {
                if equation(row) != NONE && equation(column) != NONE {
                    self.matrix.add_entry(equation(row), equation(column), -half[(row, column)]);
                }
            }
        }
    }

    /// Takes the matrix as it now is for the coming solutions; returns its negative pivots.
    pub(super) fn prepare(&mut self) -> Result<usize, SolveError> {
        let Some(workspace) = &mut self.workspace else { return Ok(0) };
        let pivots = workspace.prepare(&self.matrix).map_err(linear_error)?;
        if pivots.smallest < ZERO_PIVOT {
            let component = self.equations.component[pivots.weakest] as usize;
            const NAMES: [&str; 6] =
                ["x", "y", "z", "rotation about x", "rotation about y", "rotation about z"];
            return Err(SolveError::Singular {
                node: (component / 6) as u32,
                component: NAMES[component % 6],
                pivot: pivots.smallest,
            });
        }
        Ok(pivots.negative)
    }

    /// Solves with the matrix prepared; conjugate gradients start from a multiple of the solution given, and
    /// leave what they reached there if iterations run out.
    pub(super) fn solve(
        &mut self,
        phases: &mut Phases,
        right: &[f64],
        solution: &mut [f64],
    ) -> Result<(), SolveError> {
        let start = Instant::now();
        let Some(workspace) = &mut self.workspace else { return Ok(()) };
        let result = workspace.solve(&self.matrix, right, solution);
        if let Ok(report) | Err(LinearError::Stalled(report)) = &result {
            self.last_solution = *report;
        }
        (phases.device, phases.left_to_cpu) = workspace.of_device();
        phases.solution += start.elapsed();
        phases.solutions += 1;
        phases.iterations += self.last_solution.iterations;
        result.map(|_| ()).map_err(linear_error)
    }
}

pub(super) fn linear_error(error: LinearError) -> SolveError {
    match error {
        LinearError::TooLarge => SolveError::Impossible(
            "there are too many equations for the direct solver; use conjugate gradients",
        ),
        LinearError::OutOfMemory(needed) => SolveError::OutOfMemory(needed),
        LinearError::Device(error) => SolveError::Device(error),
        LinearError::NotFinite => SolveError::Impossible("the stiffness is not finite; use smaller steps"),
        LinearError::Indefinite(iterations) => SolveError::Indefinite { iterations },
        LinearError::Stalled(LinearReport { iterations, residual }) => {
            SolveError::Stalled { iterations, residual }
        }
    }
}
