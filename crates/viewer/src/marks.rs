//! Marks of constraints and loads at a selection of nodes; they follow the body.

use pliant_geometry::Vector3;
use pliant_mechanics::model::Motion;
use pliant_picture::{Mark, Marked, some_of, weight_of};
use pliant_run::Live;
use pliant_scene::World;

/// The marks of all participants at the instant of a run.
pub(crate) fn marks(world: &World, live: &Live) -> Vec<Mark> {
    let (time, mut marks) = (live.simulation.time(), Vec::new());
    for (part, now) in world.participants.iter().zip(live.simulation.instants()) {
        let model = &part.built.model;
        let displacement: Vec<[f64; 3]> =
            (0..model.node_count()).map(|node| now.displacement(node)).collect();
        let place =
            |node: u32| Vector3::from(model.rest[node as usize]) + Vector3::from(displacement[node as usize]);
        for constraint in &model.constraints {
            let marked = match constraint.motion {
                Motion::Fixed => Marked::Held,
                Motion::Mean { .. } => Marked::Plate,
                _ => Marked::Moved,
            };
            marks.extend(constraint.nodes.iter().map(|&node| (place(node), marked)));
        }
        let weights = (0..).zip(model.weights(time));
        marks.extend(weight_of(weights.map(|(node, weight)| (place(node), Vector3::from(weight)))));
        let forces = (0..).zip(part.built.load_forces(time, &displacement));
        let loaded = forces.map(|(node, force)| (node, Vector3::from(force)));
        let loaded = loaded.filter(|(_, force)| force.norm() > 0.0);
        marks.extend(loaded.map(|(node, force)| (place(node), Marked::Loaded(force))));
    }
    some_of(marks)
}
