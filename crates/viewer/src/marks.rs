//! Where bodies are held, moved and loaded: a mark at each of some nodes, which follows the body.

use pliant_geometry::Vector3;
use pliant_mechanics::mapping::Displaced;
use pliant_mechanics::model::{Constraint, Motion};
use pliant_run::Live;
use pliant_scene::{Part, World};

/// What a mark stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Marked {
    /// Nodes of a constraint that stay where they are at rest.
    Held,
    /// Nodes of a constraint that are moved.
    Moved,
    /// A load's force on a node [N].
    Loaded(Vector3),
}

/// A mark at a place [m].
pub type Mark = (Vector3, Marked);

/// Marks of a constraint, and of all loads of a participant, at most; of more nodes every so many.
const MOST: usize = 300;

/// The marks of all participants at the instant of a run.
pub(crate) fn marks(world: &World, live: &Live) -> Vec<Mark> {
    let (time, mut all) = (live.simulation.time(), Vec::new());
    for (part, now) in world.participants.iter().zip(live.simulation.instants()) {
        let model = &part.built.model;
        let displacement: Vec<[f64; 3]> =
            (0..model.node_count()).map(|node| now.displacement(node)).collect();
        let place =
            |node: u32| Vector3::from(model.rest[node as usize]) + Vector3::from(displacement[node as usize]);
        for constraint in &model.constraints {
            let marked = if is_fixed(constraint) { Marked::Held } else { Marked::Moved };
            all.extend(some_of(&constraint.nodes).map(|&node| (place(node), marked)));
        }
        let forces = loads(part, time, &displacement);
        let loaded: Vec<(u32, Vector3)> = (0..).zip(forces).filter(|(_, force)| force.norm() > 0.0).collect();
        all.extend(some_of(&loaded).map(|&(node, force)| (place(node), Marked::Loaded(force))));
    }
    all
}

fn is_fixed(constraint: &Constraint) -> bool {
    matches!(constraint.motion, Motion::Fixed)
}

/// Every so many of some items.
fn some_of<T>(items: &[T]) -> impl Iterator<Item = &T> {
    items.iter().step_by(items.len().div_ceil(MOST).max(1))
}

/// The forces [N] of loads on nodes, without those of weights and those that only shells take.
fn loads(part: &Part, time: f64, displacement: &[[f64; 3]]) -> Vec<Vector3> {
    let model = &part.built.model;
    let state = Displaced { rest: &model.rest, displacement, velocity: &[] };
    let mut forces = vec![[0.0; 3]; model.node_count()];
    for load in &model.loads {
        let points = load.surface.map(|surface| &model.surfaces[surface].mapping);
        load.add_forces(time, points, &state, &mut forces);
    }
    forces.into_iter().map(Vector3::from).collect()
}
