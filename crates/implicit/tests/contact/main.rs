//! Shells and solids in contact by a barrier, held to closed forms; every state that is accepted is searched
//! for crossings.

mod arch;
mod blocks;
mod bodies;
mod cards;
mod cloth;
mod degenerate;
mod funnel;
mod ring;
mod stick_slip;

use std::sync::Arc;

use nalgebra::Vector3;
use pliant_contact::barrier::BarrierSettings;
use pliant_contact::pairs::Surface;
use pliant_contact::pose::{Pose, Trajectory};
use pliant_contact::shape::Shape;
use pliant_contact::touch::{Contact, Contacts, Rigid, Touch, With};
use pliant_implicit::{Assembly, ContactModel};

/// A thing of a shape that goes along a trajectory.
fn rigid(name: &str, shape: Shape, trajectory: Trajectory) -> Rigid {
    Rigid { name: name.into(), shape, trajectory, inside: false, jaw: None }
}

/// A thing at rest in a place [m], turned by a rotation vector [rad].
fn fixed(name: &str, shape: Shape, at: [f64; 3], turn: [f64; 3]) -> Rigid {
    rigid(name, shape, Trajectory::fixed(Pose::new(at.into(), turn.into())))
}

/// A surface of these triangles.
fn surface(faces: Vec<[u32; 3]>) -> Surface {
    let mut nodes: Vec<u32> = faces.iter().flatten().copied().collect();
    nodes.sort_unstable();
    nodes.dedup();
    Surface { nodes, faces }
}

/// Contacts of a surface with rigid things, each at a distance that is kept [m].
fn at_rigid(surface: &Surface, rigids: Vec<Rigid>, friction: f64, offset: f64) -> Contacts {
    let contacts = (0..rigids.len()).map(|number| Contact {
        name: rigids[number].name.clone(),
        surface: surface.clone(),
        with: With::Rigid(number),
        touch: Touch { friction, offset },
    });
    Contacts { contacts: contacts.collect(), rigids, ..Default::default() }
}

/// Gives a model contacts that all act in one way.
fn touch(model: &mut Assembly, contacts: Contacts, settings: BarrierSettings) {
    let settings = vec![settings; contacts.contacts.len()];
    model.contact = Some(ContactModel {
        contacts: Arc::new(contacts),
        settings,
        levels: Vec::new(),
        check_intersections: true,
    });
}

/// The sum of vectors of nodes by their masses, over the mass.
fn mean(model: &Assembly, of: &[Vector3<f64>]) -> Vector3<f64> {
    let mass: f64 = model.mass.iter().sum();
    of.iter().zip(&model.mass).map(|(x, m)| x * *m).sum::<Vector3<f64>>() / mass
}
