//! Places of all nodes and rigid things at an instant of a step.

use nalgebra::{Point3, Vector3};

use crate::pose::Stance;

/// Places of nodes and stances of rigid things.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Configuration {
    /// Places [m] of all nodes, with the nodes of rigid things last.
    pub place: Vec<Vector3<f64>>,
    /// Rigid things.
    pub stances: Vec<Stance>,
}

impl Configuration {
    /// Moves rigid things to where they are at a fraction of the step between both ends; whether they are
    /// there already.
    pub(crate) fn move_things(&mut self, [from, to]: &[Vec<Stance>; 2], time_fraction: f64) -> bool {
        let mut are_there = true;
        for ((now, from), to) in self.stances.iter_mut().zip(from).zip(to) {
            let stance = if time_fraction == 1.0 { *to } else { Stance::between([from, to], time_fraction) };
            are_there &= *now == stance;
            *now = stance;
        }
        are_there
    }

    /// Takes the places [m] of the nodes of the model. Nodes of rigid things, each a thing and a place [m] in
    /// its frame, follow their things.
    pub(crate) fn place_nodes(&mut self, position: &[Vector3<f64>], rigid_nodes: &[(u32, Vector3<f64>)]) {
        let (of_model, others) = self.place.split_at_mut(position.len());
        of_model.copy_from_slice(position);
        for (place, (thing, x)) in others.iter_mut().zip(rigid_nodes) {
            *place = (self.stances[*thing as usize].pose * Point3::from(*x)).coords;
        }
    }
}
