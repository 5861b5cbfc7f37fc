//! Nodes that follow others, in a model: J of displacements, Jᵀ of forces and masses, by the rows of its
//! [`Tie`]s.

use std::collections::BTreeMap;

use crate::Real;
use crate::mapping::{Weights, weighted};
use crate::model::Model;
use crate::tensor::{Vector, add, cast};
use crate::tie::{Tie, TieError};

impl Model {
    /// Ties nodes to others, once all cells have given their masses; the number of the tie.
    ///
    /// # Errors
    /// If a node is tied already, or follows one that is tied. The model then is as it was.
    pub fn tie(&mut self, name: &str, nodes: Vec<u32>, mapping: Weights) -> Result<usize, TieError> {
        let tie = Tie { name: name.into(), held: vec![[false; 3]; nodes.len()], nodes, mapping };
        let mut owner = vec![None; self.node_count()];
        for known in &self.ties {
            known.nodes.iter().for_each(|&node| owner[node as usize] = Some(known.name.as_str()));
        }
        let placed = |node: u32| {
            let (body, node) = self.locate_node(node);
            (self.bodies[body].name.clone(), node)
        };
        for &node in &tie.nodes {
            if let Some(other) = owner[node as usize].replace(name) {
                let (body, node) = placed(node);
                return Err(TieError::Twice { node, body, other: other.into() });
            }
        }
        let ties = || self.ties.iter().chain([&tie]);
        let chained = ties().flat_map(Tie::rows).find_map(|(node, mut row)| {
            row.find_map(|(followed, _)| owner[followed as usize]).map(|other| (node, other))
        });
        if let Some((node, other)) = chained {
            let (body, node) = placed(node);
            return Err(TieError::Chain { node, body, other: other.into() });
        }
        for (node, _) in tie.rows() {
            if let Some(velocity) = self.initial_velocity.get_mut(node as usize) {
                *velocity = [0.0; 3];
            }
        }
        self.ties.push(tie);
        let mut mass = std::mem::take(&mut self.mass);
        self.give_down(&mut mass);
        self.mass = mass;
        Ok(self.ties.len() - 1)
    }

    /// Stops tied nodes from following along components that a constraint holds or moves in both bodies. The
    /// constraint must act on the tied node and on a node of the other body that it follows, as at a plane of
    /// symmetry. To be called once constraints and ties are there.
    pub fn prescribe_tied(&mut self) {
        let mut held = vec![[false; 3]; self.node_count()];
        for constraint in self.constraints.iter().filter(|constraint| !constraint.motion.is_collective()) {
            for &node in &constraint.nodes {
                for (is_held, by) in held[node as usize].iter_mut().zip(constraint.components) {
                    *is_held |= by;
                }
            }
        }
        let bodies = &self.bodies;
        for tie in &mut self.ties {
            let both = |(node, row): (u32, Vec<u32>)| {
                let body_nodes =
                    bodies.iter().find(|body| body.nodes.contains(&node)).map(|body| &body.nodes);
                let others = || {
                    row.iter().filter(|other| body_nodes.is_none_or(|body_nodes| !body_nodes.contains(other)))
                };
                [0, 1, 2].map(|c| held[node as usize][c] && others().any(|&other| held[other as usize][c]))
            };
            let rows = tie.rows().map(|(node, row)| (node, row.map(|(other, _)| other).collect()));
            tie.held = rows.map(both).collect();
        }
    }

    /// Returns for each node true if it follows others.
    pub fn followers(&self) -> Vec<bool> {
        let mut follows = vec![false; self.node_count()];
        self.ties.iter().flat_map(|tie| &tie.nodes).for_each(|&node| follows[node as usize] = true);
        follows
    }

    /// Takes the nodes that follow others along: J of displacements or velocities.
    pub fn follow<R: Real>(&self, field: &mut [Vector<R>]) {
        for tie in &self.ties {
            for ((node, row), held) in tie.rows().zip(&tie.held) {
                let moved = weighted(row, |followed| cast::<R, f64>(field[followed as usize]));
                for c in (0..3).filter(|&c| !held[c]) {
                    field[node as usize][c] = R::of(moved[c]);
                }
            }
        }
    }

    /// Jᵀ of forces on all nodes: a force on a node that follows others goes to the followed nodes.
    pub fn give_back(&self, forces: &mut [Vector<f64>]) {
        for (node, row) in self.ties.iter().flat_map(Tie::component_rows) {
            let force = std::mem::take(&mut forces[node as usize]);
            for (followed, weights) in row {
                let part = [0, 1, 2].map(|c| force[c] * weights[c]);
                forces[followed as usize] = add(forces[followed as usize], part);
            }
        }
    }

    /// Row sums of Jᵀ M J: the mass of a node that follows others goes to the followed nodes. Negative
    /// weights could take mass from a followed node, as next to a much heavier element. All masses of that
    /// tie then go by the rows without negative weights.
    pub(crate) fn give_down(&self, masses: &mut [f64]) {
        for tie in &self.ties {
            let given: Vec<f64> =
                tie.nodes.iter().map(|&node| std::mem::take(&mut masses[node as usize])).collect();
            let mut taken: BTreeMap<u32, f64> = BTreeMap::new();
            for (point, mass) in given.iter().enumerate() {
                tie.mapping.row(point).for_each(|(node, w)| *taken.entry(node).or_default() += w * mass);
            }
            let round_off = 1e-12 * given.iter().sum::<f64>();
            let loses = taken.values().any(|&mass| mass < -round_off);
            for (point, mass) in given.iter().enumerate() {
                let mut give = |(node, weight): (u32, f64)| masses[node as usize] += weight * mass;
                match loses {
                    true => tie.mapping.inner_row(point).for_each(&mut give),
                    false => tie.mapping.row(point).for_each(&mut give),
                }
            }
        }
    }

    /// A bound of Jᵀ K J by nodes. The stiffness k_a of each node that follows others goes to the nodes i
    /// as |J_ai| Σ_j |J_aj| k_a.
    pub fn give_down_stiffness(&self, stiffness: &mut [f64]) {
        for (node, row) in self.ties.iter().flat_map(Tie::rows) {
            let taken = std::mem::take(&mut stiffness[node as usize]);
            let row: Vec<(u32, f64)> = row.collect();
            let sum: f64 = row.iter().map(|(_, weight)| weight.abs()).sum();
            for (followed, weight) in row {
                stiffness[followed as usize] += weight.abs() * sum * taken;
            }
        }
    }

    /// A point of nodes with weights as a combination of nodes that follow no others.
    pub fn resolved(&self, point: &[(u32, f64)]) -> Vec<(u32, f64)> {
        let mut combined: Vec<(u32, f64)> = Vec::new();
        for &(node, weight) in point {
            let found = self.ties.iter().find_map(|tie| {
                let at = tie.nodes.iter().position(|&tied| tied == node)?;
                Some(tie.mapping.row(at).map(|(followed, w)| (followed, w * weight)).collect::<Vec<_>>())
            });
            for (node, weight) in found.unwrap_or_else(|| vec![(node, weight)]) {
                match combined.iter_mut().find(|(known, _)| *known == node) {
                    Some((_, known)) => *known += weight,
                    None => combined.push((node, weight)),
                }
            }
        }
        combined
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Constraint, Motion};

    fn model() -> Model {
        let mut model = Model::default();
        model.add_body("host", &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        model.add_body("guest", &[[0.2, 0.3, 0.1], [0.1, 0.1, 0.1]]);
        model.mass = vec![1.0, 1.0, 1.0, 1.0, 2.0, 3.0];
        model
    }

    fn rows() -> Weights {
        let rows: [&[(u32, f64)]; 2] =
            [&[(0, 0.4), (1, 0.2), (2, 0.3), (3, 0.1)], &[(0, 0.7), (1, 0.1), (2, 0.1), (3, 0.1)]];
        Weights::from_rows(rows)
    }

    /// ⟨J v, f⟩ = ⟨v, Jᵀ f⟩, masses keep their sum, rigid motions are followed.
    #[test]
    fn what_goes_down_comes_up_by_the_transpose() {
        let mut model = model();
        model.tie("glue", vec![4, 5], rows()).unwrap();
        assert_eq!(model.mass[4..], [0.0, 0.0]);
        assert!((model.mass.iter().sum::<f64>() - 9.0).abs() < 1e-14);
        let mut velocity =
            vec![[0.3, -0.1, 0.2], [0.5, 0.4, -0.7], [-0.2, 0.6, 0.1], [0.9, -0.8, 0.3], [0.0; 3], [0.0; 3]];
        model.follow(&mut velocity);
        let given: Vec<Vector<f64>> =
            vec![[0.0; 3], [0.0; 3], [0.0; 3], [0.0; 3], [1.0, -2.0, 3.0], [0.5, 0.7, -0.1]];
        let mut forces = given.clone();
        model.give_back(&mut forces);
        let power = |f: &[Vector<f64>]| -> f64 {
            f.iter().zip(&velocity).map(|(f, v)| crate::tensor::dot(*f, *v)).sum()
        };
        assert!((power(&given) - power(&forces)).abs() < 1e-15 && forces[4..] == [[0.0; 3]; 2]);
        let mut places = model.rest.clone();
        model.follow(&mut places);
        assert!(places.iter().zip(&model.rest).all(|(a, b)| (0..3).all(|c| (a[c] - b[c]).abs() < 1e-15)));
        let point = model.resolved(&[(4, 0.5), (0, 0.5)]);
        assert_eq!(point.iter().map(|(_, w)| w).sum::<f64>(), 1.0);
        assert_eq!(point[0], (0, 0.7));
    }

    /// A plane of symmetry holds both bodies; what holds one alone would open the joint.
    #[test]
    fn tied_nodes_are_held_where_the_nodes_that_they_follow_are() {
        let mut model = model();
        model.tie("glue", vec![4, 5], rows()).unwrap();
        let plane = |nodes: Vec<u32>, [x, y]: [bool; 2]| Constraint {
            name: "plane".into(),
            nodes,
            components: [x, y, false, false, false, false],
            motion: Motion::Fixed,
        };
        model.constraints.push(plane(vec![4, 5], [true, true]));
        model.prescribe_tied();
        assert_eq!(model.ties[0].held, [[false; 3]; 2]);
        assert!(model.constrained_components().is_err());
        model.constraints.push(plane(vec![3], [true, false]));
        model.prescribe_tied();
        assert_eq!(model.ties[0].held, [[true, false, false]; 2]);
        model.constraints[0].components[1] = false;
        model.constrained_components().unwrap();
        let mut forces = vec![[0.0; 3], [0.0; 3], [0.0; 3], [0.0; 3], [1.0, 10.0, 0.0], [0.0; 3]];
        model.give_back(&mut forces);
        assert_eq!([forces[4], forces[0]], [[1.0, 0.0, 0.0], [0.0, 4.0, 0.0]]);
        let mut places = model.rest.clone();
        places[3] = [0.0, 0.0, 2.0];
        places[4] = [7.0, 0.0, 0.0];
        model.follow(&mut places);
        assert_eq!(places[4][0], 7.0);
        assert!((places[4][2] - 0.2).abs() < 1e-15);
    }

    #[test]
    fn chains_circles_and_second_ties_are_refused() {
        let tied = |again: (Vec<u32>, Weights)| {
            let mut model = model();
            model.tie("glue", vec![4, 5], rows()).unwrap();
            model.tie("thread", again.0, again.1).unwrap_err()
        };
        let to = |node: u32| Weights::from_rows([&[(node, 1.0)][..]]);
        assert!(matches!(tied((vec![4], to(1))), TieError::Twice { node: 0, .. }));
        assert!(matches!(tied((vec![3], to(4))), TieError::Chain { .. }));
        assert!(matches!(tied((vec![0], to(1))), TieError::Chain { .. }));
        assert!(matches!(model().tie("self", vec![4], to(4)), Err(TieError::Chain { node: 0, .. })));
    }
}
