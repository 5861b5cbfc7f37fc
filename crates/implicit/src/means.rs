//! Means of displacements that are prescribed: rows a·u = d beside the equations K u = f − λ a. A row couples all nodes of a face, so it is kept
//! out of the matrix. K may be singular without it: a spring at one node of each mean, K' = K + σ e eᵀ, holds it, and is taken back
//! with the forces λ by one small system (Woodbury): two more solutions with K' for each row.

use nalgebra::{DMatrix, DVector, Dyn, LU};
use pliant_mechanics::model::Motion;

use crate::Assembly;
use crate::linear::dot;
use crate::sparse::{Equations, LowerMatrix, NONE};
use crate::state::State;

/// A gap of a mean that counts as none, over the mean edge.
const CLOSED: f64 = 1e-10;

/// The means of a model.
#[derive(Default)]
pub(crate) struct Means {
    rows: Vec<Row>,
    /// Whether the springs are in the matrix.
    pinned: bool,
    small: Option<LU<f64, Dyn, Dyn>>,
    length: f64,
}

/// A component of a mean.
struct Row {
    constraint: usize,
    component: usize,
    /// The row itself, an entry an equation.
    dense: Vec<f64>,
    squared: f64,
    /// The equation with the largest weight, and the stiffness of its spring [N/m].
    pin: usize,
    spring: f64,
    /// How far the mean has yet to go [m].
    gap: f64,
    /// K'⁻¹ a and K'⁻¹ e.
    answers: [Vec<f64>; 2],
}

impl Means {
    pub(crate) fn of(model: &Assembly, equations: &Equations) -> Self {
        let mut rows = Vec::new();
        for (constraint, own) in model.constraints.iter().enumerate() {
            let Motion::Mean { weights, .. } = &own.motion else { continue };
            for component in (0..3).filter(|&c| own.components[c]) {
                let mut dense = vec![0.0; equations.len()];
                for (&node, weight) in own.nodes.iter().zip(weights) {
                    let equation = equations.number[6 * node as usize + component];
                    if equation != NONE {
                        dense[equation as usize] = *weight;
                    }
                }
                let (pin, _) = dense
                    .iter()
                    .enumerate()
                    .fold((0, 0.0), |best, (at, w)| if *w > best.1 { (at, *w) } else { best });
                let squared = dot(&dense, &dense);
                if squared > 0.0 {
                    let answers = [vec![0.0; dense.len()], vec![0.0; dense.len()]];
                    rows.push(Row {
                        constraint,
                        component,
                        dense,
                        squared,
                        pin,
                        spring: 0.0,
                        gap: 0.0,
                        answers,
                    });
                }
            }
        }
        Self { rows, length: model.mean_edge(), ..Self::default() }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Finds how far the means have yet to go to where they are at a time [s].
    pub(crate) fn find_gaps(&mut self, model: &Assembly, state: &State, time: f64) {
        for Row { constraint, component, gap, .. } in &mut self.rows {
            let own = &model.constraints[*constraint];
            let Motion::Mean { weights, by, curve } = &own.motion else { continue };
            let moved = |(&node, weight): (&u32, &f64)| {
                weight * model.displacement(&state.position, node)[*component]
            };
            *gap = by[*component] * curve.value(time) - own.nodes.iter().zip(weights).map(moved).sum::<f64>();
        }
        self.pinned = false;
    }

    /// Whether every mean is where it should be.
    pub(crate) fn are_closed(&self) -> bool {
        self.rows.iter().all(|row| row.gap.abs() <= CLOSED * self.length)
    }

    /// Takes from a residual the forces of the means, by the least squares of what is left.
    pub(crate) fn relieve(&self, residual: &mut [f64]) {
        for Row { dense, squared, .. } in &self.rows {
            let force = dot(dense, residual) / squared;
            residual.iter_mut().zip(dense).for_each(|(residual, weight)| *residual -= force * weight);
        }
    }

    /// Puts the springs into a matrix that has none.
    pub(crate) fn pin(&mut self, matrix: &mut LowerMatrix) {
        if std::mem::replace(&mut self.pinned, true) {
            return;
        }
        for row in &mut self.rows {
            row.spring = matrix.diagonal(row.pin).abs();
            matrix.add_diagonal(row.pin, row.spring);
        }
    }

    /// Takes the matrix with the springs, by its solutions.
    pub(crate) fn prepare<E>(
        &mut self,
        mut solve: impl FnMut(&[f64], &mut [f64]) -> Result<(), E>,
    ) -> Result<(), E> {
        let count = self.rows.len();
        let mut right = vec![0.0; self.rows.first().map_or(0, |row| row.dense.len())];
        for Row { dense, pin, answers: [to_row, to_pin], .. } in &mut self.rows {
            to_row.fill(0.0);
            to_pin.fill(0.0);
            solve(dense, to_row)?;
            right[*pin] = 1.0;
            solve(&right, to_pin)?;
            right[*pin] = 0.0;
        }
        let own = &self.rows;
        let entry = |i: usize, j: usize| {
            let (row, column) = (&own[i % count], &own[j % count]);
            let answer = &column.answers[j / count];
            let at = if i < count { dot(&row.dense, answer) } else { row.spring * answer[row.pin] };
            let sign = if j < count { 1.0 } else { -1.0 };
            sign * at + f64::from(u8::from(i >= count && i == j))
        };
        self.small = (count > 0).then(|| DMatrix::from_fn(2 * count, 2 * count, entry).lu());
        Ok(())
    }

    /// Makes of a solution with K' one with K on which the means go their gaps, or stay.
    pub(crate) fn correct(&self, solution: &mut [f64], go: bool) {
        let count = self.rows.len();
        let right = DVector::from_fn(2 * count, |i, _| {
            let row = &self.rows[i % count];
            let gap = if go { row.gap } else { 0.0 };
            if i < count { dot(&row.dense, solution) - gap } else { row.spring * solution[row.pin] }
        });
        let Some(factors) = self.small.as_ref().and_then(|small| small.solve(&right)) else { return };
        for (at, row) in self.rows.iter().enumerate() {
            for (answer, factor) in row.answers.iter().zip([-factors[at], factors[count + at]]) {
                solution.iter_mut().zip(answer).for_each(|(x, y)| *x += factor * y);
            }
        }
    }
}
