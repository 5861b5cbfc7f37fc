//! Rotations of nodes that follow the translations of others, for example of a wall in or on a solid. R is
//! the rotation nearest to the gradient of the solid there: F = Σ x gᵀ over the nodes of the solid, and F = V
//! R (polar decomposition). With r = R g and W = (tr V I − V)⁻¹
//!
//! δω = W Σ r × δx,   so that a moment M gives the forces y × r with y = W M:   Jᵀ,
//!
//! and these change by δy × r + y × δr with δr = δω × r, δy = −W (tr δV I − δV) y and δV = Σ δx rᵀ − V S(δω).

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use pliant_mechanics::rotation::nearest_rotation;
use pliant_shells::rotation::skew;

use crate::model::state::AssemblyState;
use crate::model::turns::CarriedTurn;

/// A node that turns with a solid, with its J at a state.
#[derive(Clone, Debug)]
pub(crate) struct Turn {
    pub(crate) node: u32,
    /// Nodes of the solid: their numbers, g and r [1/m].
    rows: Vec<(u32, Vector3<f64>, Vector3<f64>)>,
    /// V and W.
    stretch: Matrix3<f64>,
    inverse: Matrix3<f64>,
}

impl Turn {
    /// At rest, where F = V = I.
    pub(crate) fn new(carried: &CarriedTurn) -> Self {
        let rows = carried.gradient.iter().map(|&(node, g)| (node, g, g)).collect();
        let inverse = Matrix3::from_diagonal_element(0.5);
        Self { node: carried.node, rows, stretch: Matrix3::identity(), inverse }
    }

    /// The nodes of the solid.
    pub(crate) fn nodes(&self) -> impl Iterator<Item = u32> + '_ {
        self.rows.iter().map(|&(node, ..)| node)
    }

    /// F at a state.
    fn deformation(&self, state: &AssemblyState) -> Matrix3<f64> {
        let part = |(node, g, _): &(u32, Vector3<f64>, _)| state.position[*node as usize] * g.transpose();
        self.rows.iter().map(part).sum()
    }

    /// The rotation at a state.
    pub(crate) fn rotation(&self, state: &AssemblyState) -> UnitQuaternion<f64> {
        UnitQuaternion::from_rotation_matrix(&nearest_rotation(&self.deformation(state)))
    }

    /// Takes J at a state.
    pub(crate) fn turn(&mut self, state: &AssemblyState) {
        let f = self.deformation(state);
        let rotation = nearest_rotation(&f);
        let stretch = f * rotation.matrix().transpose();
        self.stretch = 0.5 * (stretch + stretch.transpose());
        let diagonal = Matrix3::from_diagonal_element(self.stretch.trace());
        // Singular only where two of three stretches vanish: elements there report that.
        self.inverse = (diagonal - self.stretch).try_inverse().unwrap_or_else(Matrix3::zeros);
        self.rows.iter_mut().for_each(|(_, g, r)| *r = rotation * *g);
    }

    /// J of motions of the nodes of the solid.
    pub(crate) fn spin(&self, moved: impl Fn(u32) -> Vector3<f64>) -> Vector3<f64> {
        self.inverse * self.rows.iter().map(|(node, _, r)| r.cross(&moved(*node))).sum::<Vector3<f64>>()
    }

    /// Jᵀ of a moment [N m]: forces [N] on the nodes of the solid.
    pub(crate) fn forces(&self, moment: &Vector3<f64>) -> impl Iterator<Item = (u32, Vector3<f64>)> + '_ {
        let y = self.inverse * moment;
        self.rows.iter().map(move |(node, _, r)| (*node, y.cross(r)))
    }

    /// J as blocks: of each node of the solid with what its motion makes of the spin.
    pub(crate) fn blocks(&self) -> impl Iterator<Item = (u32, Matrix3<f64>)> + '_ {
        self.rows.iter().map(|(node, _, r)| (*node, self.inverse * skew(r)))
    }

    /// Change of the forces of a moment [N m] with the nodes of the solid: its symmetric part, column by
    /// column. Adds i Jᵀ J with a stiffness i against spins [N m].
    pub(crate) fn change(&self, moment: &Vector3<f64>, rotary: f64) -> Vec<f64> {
        let y = self.inverse * moment;
        let size = 3 * self.rows.len();
        let mut whole = vec![0.0; size * size];
        let blocks: Vec<Matrix3<f64>> = self.blocks().map(|(_, block)| block).collect();
        for (column, ((_, _, moving), block)) in self.rows.iter().zip(&blocks).enumerate() {
            for axis in 0..3 {
                let spin = block.column(axis).into_owned();
                let stretched = Vector3::ith(axis, 1.0) * moving.transpose() - self.stretch * skew(&spin);
                let grown = Matrix3::from_diagonal_element(stretched.trace()) - stretched;
                let turned = -self.inverse * grown * y;
                for (row, ((_, _, r), row_block)) in self.rows.iter().zip(&blocks).enumerate() {
                    let change = turned.cross(r) + y.cross(&spin.cross(r)) + rotary * row_block.tr_mul(&spin);
                    for k in 0..3 {
                        whole[(3 * column + axis) * size + 3 * row + k] = change[k];
                    }
                }
            }
        }
        for i in 0..size {
            for j in 0..i {
                let mean = 0.5 * (whole[i * size + j] + whole[j * size + i]);
                (whole[i * size + j], whole[j * size + i]) = (mean, mean);
            }
        }
        whole
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Assembly;
    use pliant_shells::rotation::{exponential, logarithm};
    use pliant_testing::Random;

    /// A tet with a node inside, in large rotation and strain.
    fn placed() -> (CarriedTurn, AssemblyState) {
        let rest = [[0.0; 3], [0.01, 0.001, 0.0], [0.002, 0.012, 0.001], [-0.001, 0.001, 0.009]];
        let model = Assembly::new("tet", rest.map(Vector3::from));
        let edges = Matrix3::from_columns(&[1, 2, 3].map(|k| model.place(k) - model.place(0)));
        let inverse = edges.try_inverse().unwrap();
        let mut gradient: Vec<_> = (0..3).map(|k| (k + 1, inverse.row(k as usize).transpose())).collect();
        gradient.insert(0, (0, -gradient.iter().map(|(_, g)| g).sum::<Vector3<f64>>()));
        let mut state = AssemblyState::at_rest(&model);
        let turn = exponential(&Vector3::new(1.3, -1.9, 0.8));
        let mut random = Random::new(5);
        for position in &mut state.position {
            *position = turn * *position + Vector3::from(random.vector()) * 2e-3;
        }
        (CarriedTurn { node: 9, gradient }, state)
    }

    fn moved(state: &AssemblyState, way: &[Vector3<f64>], part: f64) -> AssemblyState {
        let mut moved = state.clone();
        moved.position.iter_mut().zip(way).for_each(|(x, way)| *x += way * part);
        moved
    }

    /// J is the change of the rotation, and Jᵀ its transpose. Forces from a moment are in balance: their sum
    /// is 0 and their moment is the moment on the node.
    #[test]
    fn a_moment_goes_to_the_solid_by_the_transpose_of_the_spin() {
        let (carried, state) = placed();
        let mut turn = Turn::new(&carried);
        turn.turn(&state);
        let mut random = Random::new(8);
        for _ in 0..10 {
            let way: Vec<_> = (0..4).map(|_| Vector3::from(random.vector()) * 1e-3).collect();
            let moment = Vector3::from(random.vector());
            let spin = turn.spin(|node| way[node as usize]);
            let h = 1e-3;
            let [ahead, behind] = [h, -h].map(|part| turn.rotation(&moved(&state, &way, part)));
            let found = logarithm(&(ahead * behind.inverse())) / (2.0 * h);
            assert!((found - spin).norm() < 1e-6 * spin.norm(), "{found} {spin}");
            let forces: Vec<_> = turn.forces(&moment).collect();
            let power: f64 = forces.iter().map(|(node, f)| f.dot(&way[*node as usize])).sum();
            assert!((power - moment.dot(&spin)).abs() < 1e-14, "{power}");
            let sum: Vector3<f64> = forces.iter().map(|(_, f)| f).sum();
            let couple: Vector3<f64> =
                forces.iter().map(|(node, f)| state.position[*node as usize].cross(f)).sum();
            assert!(sum.norm() < 1e-12 && (couple - moment).norm() < 1e-13, "{sum} {couple} {moment}");
        }
    }

    /// A rigid motion turns the node as it turns the solid, by any angle.
    #[test]
    fn a_rigid_motion_is_followed() {
        let (carried, _) = placed();
        let rest: Vec<Vector3<f64>> =
            [[0.0; 3], [0.01, 0.001, 0.0], [0.002, 0.012, 0.001], [-0.001, 0.001, 0.009]]
                .map(Vector3::from)
                .into();
        for angle in [0.0, 1e-6, 1.0, 3.1] {
            let turn = exponential(&(Vector3::new(0.3, -0.8, 0.5).normalize() * angle));
            let mut state = AssemblyState::at_rest(&Assembly::new("tet", rest.clone()));
            state.position.iter_mut().for_each(|x| *x = turn * *x + Vector3::new(0.1, 0.2, -0.3));
            // Coordinates of 0.4 m have a relative accuracy of 2e-16, over 1 cm of the tet.
            assert!(Turn::new(&carried).rotation(&state).angle_to(&turn) < 1e-13);
        }
    }

    /// The change of the forces along a line, as the energy of a moment that turns along feels it.
    #[test]
    fn the_change_of_the_forces_is_that_of_the_spin() {
        let (carried, state) = placed();
        let mut random = Random::new(2);
        let moment = Vector3::from(random.vector());
        let mut turn = Turn::new(&carried);
        turn.turn(&state);
        let matrix = turn.change(&moment, 0.0);
        for _ in 0..5 {
            let way: Vec<_> = (0..4).map(|_| Vector3::from(random.vector()) * 1e-3).collect();
            let along = |i: usize| way[i / 3][i % 3];
            let quadratic: f64 = (0..144).map(|at| along(at / 12) * matrix[at] * along(at % 12)).sum();
            let work = |part: f64| {
                let mut turn = Turn::new(&carried);
                turn.turn(&moved(&state, &way, part));
                turn.forces(&moment).map(|(node, f)| f.dot(&way[node as usize])).sum::<f64>()
            };
            let wanted = (work(1e-3) - work(-1e-3)) / 2e-3;
            assert!((quadratic - wanted).abs() < 1e-6 * wanted.abs(), "{quadratic} {wanted}");
        }
    }
}
