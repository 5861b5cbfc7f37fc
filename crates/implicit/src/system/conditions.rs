//! Prescribed means of displacements and prescribed enclosed volumes: rows a·u = d beside the equations K u =
//! f + λ a. A row couples all nodes of a face or a surface, so it is kept out of the matrix. K may be
//! singular without the row. A spring at one node of each row holds it: K' = K + σ e eᵀ. One small system
//! (Woodbury) removes the spring again and finds λ. It takes two more solutions with K' for each row.
//!
//! For a volume, a is the gradient at the positions of the nodes, and λ is the pressure. The change of the
//! pressure forces with the nodes belongs to K. [`System`](crate::system::System) adds it with the pressure
//! that balances elements and loads best, by least squares. Where a pressure has come to its limit it is a
//! load, λ a with λ given, and the volume follows.

use nalgebra::{DMatrix, DVector, Dyn, LU};
use pliant_linear::dot;
use pliant_linear::sparse::{Equations, LowerMatrix, NONE};
use pliant_mechanics::model::{Constraint, Enclosure, Motion};

use crate::Assembly;
use crate::curved::surface::CurvedSurface;
use crate::model::state::AssemblyState;

/// A gap that counts as none, over the mean edge or over the volume.
const CLOSED: f64 = 1e-10;

/// The means and the volumes that a model prescribes.
#[derive(Default)]
pub(crate) struct Conditions {
    /// Rows of constraints, in their order.
    rows: Vec<Row>,
    /// Volumes whose pressure [Pa] is given.
    loose: Vec<(Row, f64)>,
    /// True if the springs are in the matrix.
    pinned: bool,
    small: Option<LU<f64, Dyn, Dyn>>,
}

/// Quantity that a row prescribes.
enum Kind {
    /// A component of a mean.
    Mean(usize),
    /// A volume, with its size at rest [m³].
    Volume(f64),
}

/// A component of a mean, or a volume.
struct Row {
    constraint: usize,
    kind: Kind,
    /// The row itself, an entry an equation.
    dense: Vec<f64>,
    squared: f64,
    /// The equation with the largest weight, and the stiffness of its spring [N/m].
    pin: usize,
    spring: f64,
    /// Remaining way of the mean [m] or growth of the volume [m³], and the size that counts as zero.
    gap: f64,
    closed: f64,
    /// Force taken from the last residual along the row; for a volume minus the pressure [Pa].
    force: f64,
    /// K'⁻¹ a and K'⁻¹ e.
    answers: [Vec<f64>; 2],
}

impl Conditions {
    pub(crate) fn of(model: &Assembly, equations: &Equations, surface: Option<&CurvedSurface>) -> Self {
        let mut rows = Vec::new();
        let mut add = |constraint: usize, kind: Kind, dense: Vec<f64>, closed: f64| {
            let answers = [vec![0.0; dense.len()], vec![0.0; dense.len()]];
            let mut row = Row {
                constraint,
                kind,
                dense,
                squared: 0.0,
                pin: 0,
                spring: 0.0,
                gap: 0.0,
                closed,
                force: 0.0,
                answers,
            };
            row.find_pin();
            if row.squared > 0.0 {
                rows.push(row);
            }
        };
        for (number, constraint) in model.constraints.iter().enumerate() {
            match &constraint.motion {
                Motion::Mean { weights, .. } => {
                    for component in (0..3).filter(|&c| constraint.components[c]) {
                        let mut dense = vec![0.0; equations.count()];
                        for (&node, weight) in constraint.nodes.iter().zip(weights) {
                            let equation = equations.number[6 * node as usize + component];
                            if equation != NONE {
                                dense[equation as usize] = *weight;
                            }
                        }
                        add(number, Kind::Mean(component), dense, CLOSED * model.mean_edge());
                    }
                }
                Motion::Volume { enclosure, .. } => {
                    let mut dense = vec![0.0; equations.count()];
                    let rest = AssemblyState::at_rest(model);
                    let volume = add_gradient(
                        model,
                        surface,
                        constraint,
                        enclosure,
                        &rest,
                        &mut into(equations, &mut dense),
                    );
                    add(number, Kind::Volume(volume), dense, CLOSED * volume.abs());
                }
                _ => {}
            }
        }
        Self { rows, ..Self::default() }
    }

    /// True if there are rows beside the equations.
    pub(crate) fn has_rows(&self) -> bool {
        !self.rows.is_empty()
    }

    /// True if nothing is prescribed.
    pub(crate) fn is_empty(&self) -> bool {
        self.rows.is_empty() && self.loose.is_empty()
    }

    /// Prescribes the pressure [Pa] of a constraint's volume from now on, or the volume itself.
    pub(crate) fn give_pressure(&mut self, constraint: usize, given: Option<f64>) {
        let at = self.loose.iter().position(|(row, _)| row.constraint == constraint);
        if at.is_some() != given.is_some() {
            self.small = None;
        }
        match (at, given) {
            (Some(at), Some(pressure)) => self.loose[at].1 = pressure,
            (Some(at), None) => {
                let (row, _) = self.loose.remove(at);
                let place = self.rows.partition_point(|known| known.constraint < constraint);
                self.rows.insert(place, row);
            }
            (None, Some(pressure)) => {
                if let Some(at) = self.rows.iter().position(|row| row.constraint == constraint) {
                    self.loose.push((self.rows.remove(at), pressure));
                }
            }
            (None, None) => {}
        }
    }

    /// The pressure [Pa] of a constraint's volume at the residual last found, the growth [m³] that the volume
    /// still needs, and its rest volume [m³].
    pub(crate) fn enclosed(&self, constraint: usize) -> Option<[f64; 3]> {
        let given = self.loose.iter().map(|(row, pressure)| (row, *pressure));
        let rows = self.rows.iter().map(|row| (row, -row.force)).chain(given);
        rows.filter(|(row, _)| row.constraint == constraint).find_map(|(row, pressure)| match row.kind {
            Kind::Volume(rest) => Some([pressure, row.gap, rest]),
            Kind::Mean(_) => None,
        })
    }

    /// Adds the forces of pressures that are given to loads, six a node.
    pub(crate) fn press(&self, equations: &Equations, loads: &mut [f64]) {
        for (row, pressure) in &self.loose {
            for (g, &component) in row.dense.iter().zip(&equations.component) {
                loads[component as usize] += pressure * g;
            }
        }
    }

    /// Finds how far means and volumes have yet to go to where they are at a time [s], and the gradients of
    /// volumes.
    pub(crate) fn find_gaps(
        &mut self,
        model: &Assembly,
        equations: &Equations,
        surface: Option<&CurvedSurface>,
        state: &AssemblyState,
        time: f64,
    ) {
        for row in self.rows.iter_mut().chain(self.loose.iter_mut().map(|(row, _)| row)) {
            let constraint = &model.constraints[row.constraint];
            match (&constraint.motion, &row.kind) {
                (Motion::Mean { weights, by, curve }, &Kind::Mean(component)) => {
                    let moved = |(&node, weight): (&u32, &f64)| {
                        weight * model.displacement(&state.position, node)[component]
                    };
                    let sum = constraint.nodes.iter().zip(weights).map(moved).sum::<f64>();
                    row.gap = by[component] * curve.value(time) - sum;
                }
                (Motion::Volume { enclosure, by, curve }, Kind::Volume(rest)) => {
                    row.dense.fill(0.0);
                    let volume = add_gradient(
                        model,
                        surface,
                        constraint,
                        enclosure,
                        state,
                        &mut into(equations, &mut row.dense),
                    );
                    row.gap = rest + by * curve.value(time) - volume;
                    row.find_pin();
                }
                _ => {}
            }
        }
        self.pinned = false;
    }

    /// Each volume with the pressure [Pa] that is given, or balances forces [N] of elements beyond loads, six
    /// a node, by least squares.
    pub(crate) fn pressures<'a>(
        &self,
        model: &'a Assembly,
        equations: &Equations,
        resisting: impl Fn(usize) -> f64,
    ) -> Vec<(&'a Constraint, &'a Enclosure, f64)> {
        let of = |(row, given): (&Row, Option<f64>)| {
            let constraint = &model.constraints[row.constraint];
            let Motion::Volume { enclosure, .. } = &constraint.motion else { return None };
            let along = || {
                let along = row.dense.iter().zip(&equations.component);
                along.map(|(g, &component)| g * resisting(component as usize)).sum::<f64>() / row.squared
            };
            Some((constraint, enclosure, given.unwrap_or_else(along)))
        };
        let loose = self.loose.iter().map(|(row, pressure)| (row, Some(*pressure)));
        self.rows.iter().map(|row| (row, None)).chain(loose).filter_map(of).collect()
    }

    /// True if every mean and every volume has its prescribed value.
    pub(crate) fn are_closed(&self) -> bool {
        self.rows.iter().all(|row| row.gap.abs() <= row.closed)
    }

    /// Takes the forces of means and volumes from a residual. They minimise its squared norm.
    pub(crate) fn relieve(&mut self, residual: &mut [f64]) {
        for Row { dense, squared, force, .. } in &mut self.rows {
            *force = dot(dense, residual) / *squared;
            residual.iter_mut().zip(&*dense).for_each(|(residual, weight)| *residual -= *force * weight);
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
        let rows = &self.rows;
        let entry = |i: usize, j: usize| {
            let (row, column) = (&rows[i % count], &rows[j % count]);
            let answer = &column.answers[j / count];
            let at = if i < count { dot(&row.dense, answer) } else { row.spring * answer[row.pin] };
            let sign = if j < count { 1.0 } else { -1.0 };
            sign * at + f64::from(u8::from(i >= count && i == j))
        };
        self.small = (count > 0).then(|| DMatrix::from_fn(2 * count, 2 * count, entry).lu());
        Ok(())
    }

    /// Makes of a solution with K' one with K on which means and volumes go their gaps, or stay.
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

impl Row {
    /// Takes the equation with the largest weight for the spring.
    fn find_pin(&mut self) {
        let largest =
            |best: (usize, f64), (at, w): (usize, &f64)| if w.abs() > best.1 { (at, w.abs()) } else { best };
        (self.pin, _) = self.dense.iter().enumerate().fold((0, 0.0), largest);
        self.squared = dot(&self.dense, &self.dense);
    }
}

/// Adds to a vector of equations, by components.
fn into<'a>(equations: &'a Equations, dense: &'a mut [f64]) -> impl FnMut(usize, f64) + 'a {
    |component, value| {
        let equation = equations.number[component];
        if equation != NONE {
            dense[equation as usize] += value;
        }
    }
}

/// The volume [m³] that a constraint's enclosure has at a state. Its gradient [m², of rotations m³] goes to
/// `add`, component by component of the model, six a node. Of facets the curved surface counts.
pub(crate) fn add_gradient(
    model: &Assembly,
    surface: Option<&CurvedSurface>,
    constraint: &Constraint,
    enclosure: &Enclosure,
    state: &AssemblyState,
    add: &mut dyn FnMut(usize, f64),
) -> f64 {
    let node = |at: u32| constraint.nodes[at as usize] as usize;
    let mut gradient = vec![[0.0; 3]; constraint.nodes.len()];
    let mut volume = enclosure.add_gradient(|at| state.position[node(at)].into(), &mut gradient);
    for (at, g) in gradient.iter().enumerate().filter(|(_, g)| **g != [0.0; 3]) {
        (0..3).for_each(|c| add(6 * node(at as u32) + c, g[c]));
    }
    let Some(surface) = surface else { return volume };
    for &facet in &enclosure.facets {
        let patch = surface.patch(model, state, facet);
        volume += patch.volume();
        for (i, force) in patch.pressure_forces().iter().enumerate() {
            add(6 * model.facets[facet as usize].nodes[i / 6] as usize + i % 6, *force);
        }
    }
    volume
}
