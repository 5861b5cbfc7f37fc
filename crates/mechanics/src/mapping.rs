//! Points carried by a body: x = X(q), v = J q̇. Forces come back by the literal transpose, f_q += Jᵀ f.

use crate::Real;
use crate::tensor::{Vector, add, cast, cross, dot, scale, sub};

/// Motion of points that follow the nodes of a model at a state, one point at a time. `S` is the state of the
/// nodes in a solver.
pub trait Mapping<S: ?Sized> {
    /// Place of a point [m].
    fn position(&self, state: &S, point: usize) -> Vector<f64>;

    /// The velocity of a point [m/s].
    fn velocity(&self, state: &S, point: usize) -> Vector<f64>;

    /// Jᵀ of a force [N] on a point. Calls `add` with each node, the force on it [N] and the moment [N m],
    /// which is 0 where nodes do not turn.
    fn add_force(
        &self,
        state: &S,
        point: usize,
        force: Vector<f64>,
        add: &mut dyn FnMut(u32, Vector<f64>, Vector<f64>),
    );

    /// Acceleration of a point per unit force along a direction, n·J M⁻¹ Jᵀ n [1/kg]. `inertia` gives the
    /// mass [kg] and rotary inertia [kg m²] of a node.
    fn mobility(
        &self,
        state: &S,
        point: usize,
        direction: Vector<f64>,
        inertia: &dyn Fn(u32) -> [f64; 2],
    ) -> f64 {
        let mut sum = 0.0;
        self.add_force(state, point, direction, &mut |node, force, moment| {
            let [mass, rotary] = inertia(node);
            sum += dot(force, force) / mass;
            if moment != [0.0; 3] {
                sum += dot(moment, moment) / rotary;
            }
        });
        sum
    }
}

/// Rounding error of sums, over the sizes of their parts.
const ROUND_OFF: f64 = 1e-12;

/// Checks a mapping at some points, for authors of mappings. Forces must go back by the transpose (⟨J v, f⟩ =
/// ⟨v, Jᵀ f⟩) and keep their sum and their moment. The tolerance is 1e-12 of the summed parts. Velocities
/// must be the change of positions between two states a time apart [s], to 1e-6. `node` gives position,
/// velocity and spin of a node at the middle state.
///
/// # Errors
/// The first check that fails, with its size.
pub fn check<S>(
    mapping: &impl Mapping<S>,
    [before, state, after]: [&S; 3],
    apart: f64,
    node: impl Fn(u32) -> [Vector<f64>; 3],
    points: impl IntoIterator<Item = usize>,
) -> Result<(), String> {
    for point in points {
        let force = [0.3, -0.7, 0.5];
        let (place, velocity) = (mapping.position(state, point), mapping.velocity(state, point));
        let (mut power, mut sum, mut moment) = (0.0, [0.0; 3], [0.0; 3]);
        // Of the parts that are summed up.
        let mut sizes = [0.0; 3];
        mapping.add_force(state, point, force, &mut |at, share, turning| {
            let [x, v, w] = node(at);
            power += dot(v, share) + dot(w, turning);
            sum = add(sum, share);
            moment = add(moment, add(cross(x, share), turning));
            let [x, v, w, share, turning] =
                [x, v, w, share, turning].map(|vector| dot(vector, vector).sqrt());
            sizes = add(sizes, [v * share + w * turning, share, x * share + turning]);
        });
        let moved = sub(mapping.position(after, point), mapping.position(before, point));
        let largest = |v: Vector<f64>| v.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let checks = [
            ("the transpose", power - dot(velocity, force), ROUND_OFF * sizes[0]),
            ("the sum of forces", largest(sub(sum, force)), ROUND_OFF * sizes[1]),
            ("their moment", largest(sub(moment, cross(place, force))), ROUND_OFF * sizes[2]),
            ("the velocity", largest(sub(scale(moved, 1.0 / apart), velocity)), 1e-6),
        ];
        if let Some((what, off, _)) =
            checks.into_iter().find(|(_, off, limit)| off.is_nan() || off.abs() > *limit)
        {
            return Err(format!("{what} is off by {off:.1e} at point {point}"));
        }
    }
    Ok(())
}

/// Places and velocities of the nodes of a model.
pub trait Configuration {
    /// Place of a node [m].
    fn position(&self, node: u32) -> Vector<f64>;

    /// The velocity of a node [m/s].
    fn velocity(&self, node: u32) -> Vector<f64>;
}

/// Nodes displaced from rest.
#[derive(Clone, Copy, Debug)]
pub struct Displaced<'a, R> {
    /// Rest positions [m].
    pub rest: &'a [Vector<f64>],
    /// Displacements [m].
    pub displacement: &'a [Vector<R>],
    /// Velocities [m/s]; nodes beyond its end do not move.
    pub velocity: &'a [Vector<R>],
}

impl<R: Real> Configuration for Displaced<'_, R> {
    fn position(&self, node: u32) -> Vector<f64> {
        add(self.rest[node as usize], cast(self.displacement[node as usize]))
    }

    fn velocity(&self, node: u32) -> Vector<f64> {
        self.velocity.get(node as usize).map_or([0.0; 3], |&velocity| cast(velocity))
    }
}

/// A sparse J of constant weights, x = J x_nodes: rows of (node, weight), one row per point. Examples are the
/// barycentric weights of a point in a tetrahedron or the trilinear weights in a hexahedron.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Weights {
    /// First entry of each row, one more than there are rows.
    pub offsets: Vec<u32>,
    /// Parent nodes.
    pub nodes: Vec<u32>,
    /// Weights; each row sums to 1.
    pub weights: Vec<f64>,
}

impl Weights {
    /// Makes the weights from one row of (node, weight) per carried point.
    pub fn from_rows<'a>(rows: impl IntoIterator<Item = &'a [(u32, f64)]>) -> Self {
        let mut mapping = Self { offsets: vec![0], ..Self::default() };
        for row in rows {
            for &(node, weight) in row {
                mapping.nodes.push(node);
                mapping.weights.push(weight);
            }
            mapping.offsets.push(mapping.nodes.len() as u32);
        }
        mapping
    }

    /// The (node, weight) pairs of a point.
    pub fn row(&self, point: usize) -> impl Iterator<Item = (u32, f64)> + '_ {
        let range = self.offsets[point] as usize..self.offsets[point + 1] as usize;
        range.map(|k| (self.nodes[k], self.weights[k]))
    }

    /// Returns [`row`](Self::row) with weights from 0 to 1: a point outside of its cell gets the weights of a
    /// point inside. A field that no law extends, such as a stress, uses these weights: it stays between the
    /// values at the nodes.
    pub fn inner_row(&self, point: usize) -> impl Iterator<Item = (u32, f64)> + '_ {
        let sum: f64 = self.row(point).map(|(_, weight)| weight.max(0.0)).sum();
        self.row(point).map(move |(node, weight)| (node, weight.max(0.0) / sum))
    }

    /// J v at all points: the carried values of a field on the nodes.
    pub fn apply<R: Real>(&self, field: &[Vector<R>]) -> Vec<Vector<f64>> {
        let value = |point| weighted(self.row(point), |node| cast(field[node as usize]));
        (0..self.len()).map(value).collect()
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.offsets.len().saturating_sub(1)
    }

    /// True if nothing is carried.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// J v of one point from its nodes and weights.
pub fn weighted(
    row: impl IntoIterator<Item = (u32, f64)>,
    field: impl Fn(u32) -> Vector<f64>,
) -> Vector<f64> {
    row.into_iter().fold([0.0; 3], |sum, (node, weight)| add(sum, scale(field(node), weight)))
}

impl<S: Configuration> Mapping<S> for Weights {
    fn position(&self, state: &S, point: usize) -> Vector<f64> {
        weighted(self.row(point), |node| state.position(node))
    }

    fn velocity(&self, state: &S, point: usize) -> Vector<f64> {
        weighted(self.row(point), |node| state.velocity(node))
    }

    fn add_force(
        &self,
        _: &S,
        point: usize,
        force: Vector<f64>,
        add: &mut dyn FnMut(u32, Vector<f64>, Vector<f64>),
    ) {
        self.row(point).for_each(|(node, weight)| add(node, scale(force, weight), [0.0; 3]));
    }
}

#[cfg(test)]
mod tests {
    use pliant_testing::Random;

    use super::*;
    use crate::grip::Grip;

    /// Rest, displacements and velocities of twenty nodes, and the displacements some time later.
    fn nodes() -> [Vec<Vector<f64>>; 3] {
        let mut numbers = Random::new(1);
        [(); 3].map(|()| (0..20).map(|_| numbers.vector()).collect())
    }

    /// The battery of a mapping of nodes.
    fn checked(mapping: &impl for<'a> Mapping<Displaced<'a, f64>>, points: usize) -> Result<(), String> {
        let [rest, now, velocity] = nodes();
        let later = |time: f64| -> Vec<_> {
            now.iter().zip(&velocity).map(|(&u, &v)| add(u, scale(v, time))).collect()
        };
        let (behind, ahead) = (later(-1e-3), later(1e-3));
        let [before, state, after] = [&behind, &now, &ahead].map(|displacement| Displaced {
            rest: &rest,
            displacement,
            velocity: &velocity,
        });
        let node = |node: u32| [state.position(node), state.velocity(node), [0.0; 3]];
        check(mapping, [&before, &state, &after], 2e-3, node, 0..points)
    }

    /// Rows of eight nodes with random weights of sum 1.
    fn rows() -> Vec<Vec<(u32, f64)>> {
        let mut numbers = Random::new(2);
        let row = |i: u32| {
            let weights: Vec<f64> = (0..8).map(|_| numbers.half() + 0.3).collect();
            let sum: f64 = weights.iter().sum();
            weights.iter().zip(0..).map(|(w, k)| ((i * 7 + k * 3) % 20, w / sum)).collect()
        };
        (0..50).map(row).collect()
    }

    #[test]
    fn weights_and_grips_pass_the_battery() {
        let rows = rows();
        let weights = Weights::from_rows(rows.iter().map(Vec::as_slice));
        checked(&weights, 50).unwrap();
        let grip = Grip { nodes: rows[3].clone(), ..Grip::default() };
        checked(&grip, 1).unwrap();
        // Weights whose sum is not 1 lose a part of the force.
        let wrong = Weights::from_rows([&[(0, 0.6), (1, 0.3)][..]]);
        assert!(checked(&wrong, 1).unwrap_err().contains("the sum of forces"));
    }

    /// A point between two nodes of 1 kg and 3 kg, a quarter of the way: (0.75² / 1 + 0.25² / 3) 1/kg.
    #[test]
    fn mobility_is_that_of_the_masses() {
        let [rest, now, _] = nodes();
        let state = Displaced { rest: &rest, displacement: &now, velocity: &[] };
        let weights = Weights::from_rows([&[(0, 0.75), (1, 0.25)][..]]);
        let inertia = |node: u32| [[1.0, 0.0], [3.0, 0.0]][node as usize];
        let mobility = weights.mobility(&state, 0, [0.6, 0.8, 0.0], &inertia);
        assert!((mobility - (0.5625 + 0.0625 / 3.0)).abs() < 1e-12, "{mobility}");
    }
}
