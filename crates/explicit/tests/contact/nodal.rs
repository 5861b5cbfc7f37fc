//! Results of contacts at single nodes: forces, pressures, gaps and slips.

use std::sync::Arc;

use nalgebra::Vector3;
use pliant_contact::pose::{Pose, Trajectory};
use pliant_contact::shape::Shape;
use pliant_contact::touch::{Contacts, Rigid};
use pliant_explicit::{CentralDifference, NodeContact, Observable, State};
use pliant_mechanics::curve::{Curve, Shape as CurveShape};
use pliant_mechanics::load::Load;
use pliant_mechanics::model::Model;
use pliant_mechanics::prony::Prony;

use super::rigid::{at, floor};
use super::{block, stepper};

fn place(model: &Model, state: &State<f64>, node: u32) -> Vector3<f64> {
    Vector3::from(model.rest[node as usize]) + Vector3::from(state.displacement[node as usize])
}

/// The pressure [Pa]; zero inside of the body.
fn pressure(contact: &NodeContact) -> f64 {
    contact.pressure.unwrap_or(0.0)
}

/// The sum of the forces on nodes [N].
fn sum(nodes: &[NodeContact]) -> Vector3<f64> {
    nodes.iter().map(|contact| Vector3::from(contact.force)).sum()
}

/// The third parts [m²] of the deformed faces around each node that look down, across the vertical.
fn shares(contacts: &Contacts, model: &Model, state: &State<f64>) -> Vec<f64> {
    let mut shares = vec![0.0; model.node_count()];
    for &face in &contacts.contacts[0].surface.faces {
        let [a, b, c] = face.map(|node| place(model, state, node));
        let down = -(b - a).cross(&(c - a)).z / 6.0;
        face.iter().for_each(|&node| shares[node as usize] += down.max(0.0));
    }
    shares
}

/// A damped block whose weight comes on smoothly, at rest on a floor.
fn settled(cells: [u32; 3], until: f64) -> (Arc<Model>, Arc<Contacts>, CentralDifference<f64>, State<f64>) {
    let mut model = block(cells, 0.01, 3e3, Prony::default());
    model.bodies[0].damping = 60.0;
    let curve = Curve { shape: CurveShape::SmoothStep, from: 0.0, to: 0.2 };
    model.loads.push(Load { curve, ..Load::gravity(0, [0.0, 0.0, -9.81]) });
    let contacts = at(floor(), &model, 0.3);
    let model = Arc::new(model);
    let mut stepper = stepper(&model, &contacts, 0.9);
    let mut state = State::at_rest(&model);
    while state.time < until {
        stepper.evaluate(&mut state).unwrap();
        stepper.advance(&mut state);
    }
    stepper.evaluate(&mut state).unwrap();
    (model, contacts, stepper, state)
}

/// While a block bounces on its floor, forces of nodes sum to the contact force, and pressures times shares
/// to its normal part.
#[test]
fn forces_and_pressures_of_nodes_sum_to_the_force_of_the_contact() {
    for until in [0.05, 0.11, 0.3] {
        let (model, contacts, stepper, state) = settled([4, 3, 2], until);
        let nodes = stepper.contact_nodes(&state);
        let force = Vector3::from(stepper.contact_forces()[0]);
        let off = (sum(&nodes) + force).norm() / force.norm();
        let shares = shares(&contacts, &model, &state);
        let pressed: f64 =
            nodes.iter().map(|contact| pressure(contact) * shares[contact.node as usize]).sum();
        println!(
            "t = {until}: {force:?} N, forces off by {off:.1e}, pressures by {:.1e}",
            pressed / -force.z - 1.0
        );
        assert!(force.z < -1e-3 && off < 1e-10, "{off:.1e}");
        assert!((pressed / -force.z - 1.0).abs() < 1e-10, "{pressed} N of {} N", -force.z);
        assert!(nodes.iter().all(|contact| pressure(contact) >= 0.0));
    }
}

/// Under a block at rest the pressure is ρ g h. At a corner a quad has shares of a sixth or a third, by its
/// diagonal, for the quarter of its load.
#[test]
fn a_block_presses_on_its_floor_by_its_height() {
    let (model, contacts, stepper, state) = settled([4, 4, 2], 1.0);
    let expected = 1000.0 * 9.81 * 0.02;
    let (mut worst, mut corners) = (0.0_f64, Vec::new());
    let shares = shares(&contacts, &model, &state);
    for contact in stepper.contact_nodes(&state) {
        let [x, y, z] = model.rest[contact.node as usize];
        let (gap, pressure) = (contact.gap.unwrap(), pressure(&contact));
        if z > 0.0 {
            assert!(
                pressure == 0.0 && contact.force == [0.0; 3] && contact.slip.is_none() && gap > 0.0,
                "{contact:?}"
            );
            continue;
        }
        assert!(gap.abs() < 1e-12 && contact.slip.is_some(), "{contact:?}");
        let ratio = pressure / expected;
        match [x, y].iter().all(|&x| x == 0.0 || x > 0.0399) {
            true => corners.push(ratio * shares[contact.node as usize] / (0.25 * 1e-4)),
            false => worst = worst.max((ratio - 1.0).abs()),
        }
    }
    println!("pressures off by {worst:.1e} of {expected} Pa, forces of corners by {corners:?}");
    assert!(worst < 0.01 && corners.len() == 4, "{worst:.1e} {corners:?}");
    assert!(corners.iter().all(|ratio| (ratio - 1.0).abs() < 0.01), "{corners:?}");
}

/// The gap is the distance from a ball, less the distance to keep, wherever the ball is on its way. Where
/// nothing is near there is no force.
#[test]
fn gaps_are_distances_from_tools() {
    let model = block([2, 2, 2], 0.01, 3e3, Prony::default());
    let curve = Curve { shape: CurveShape::Ramp, from: 0.0, to: 1.0 };
    let trajectory = Trajectory::by(Pose::translation(0.01, 0.01, 0.031), [0.02, 0.0, 0.0], curve);
    let ball = Rigid {
        name: "ball".into(),
        shape: Shape::Sphere { radius: 0.01 },
        trajectory,
        inside: false,
        jaw: None,
    };
    let mut contacts = Arc::unwrap_or_clone(at(ball, &model, 0.0));
    contacts.contacts[0].touch.offset = 5e-4;
    let (model, contacts) = (Arc::new(model), Arc::new(contacts));
    let mut stepper = stepper(&model, &contacts, 0.9);
    let mut state = State::at_rest(&model);
    while state.time < 0.1 {
        stepper.evaluate(&mut state).unwrap();
        let centre = Vector3::new(0.01 + 0.02 * state.time, 0.01, 0.031);
        let nodes = stepper.contact_nodes(&state);
        assert_eq!(nodes.len(), model.node_count());
        for contact in nodes {
            let gap = (place(&model, &state, contact.node) - centre).norm() - 0.01 - 5e-4;
            assert!((contact.gap.unwrap() - gap).abs() < 1e-15, "{contact:?}: {gap}");
            assert!(pressure(&contact) == 0.0 && contact.slip.is_none());
        }
        stepper.advance(&mut state);
    }
}

/// On an incline of the slope ½ the slip of each lower node is its way along the incline. With μ > ½ the slip
/// is zero. Once the floor sinks away, nothing touches any more.
#[test]
fn slip_on_an_incline_is_the_way_that_nodes_go() {
    let (sine, cosine) = (0.2_f64.sqrt(), 0.8_f64.sqrt());
    let relaxing = Prony { isochoric: vec![(0.3, 0.005)], ..Prony::default() };
    let smooth = |from, to| Curve { shape: CurveShape::SmoothStep, from, to };
    for (friction, least, most) in [(0.51, 0.0, 1e-4), (0.3, 0.8, 1.3), (0.0, 2.0, 3.0)] {
        let mut model = block([2, 2, 1], 0.05, 3e5, relaxing.clone());
        for (pull, curve) in
            [([0.0, 0.0, -9.81 * cosine], smooth(0.0, 0.2)), ([9.81 * sine, 0.0, 0.0], smooth(0.2, 0.4))]
        {
            model.loads.push(Load { curve, ..Load::gravity(0, pull) });
        }
        let curve = Curve { shape: CurveShape::Ramp, from: 1.45, to: 1.55 };
        let trajectory = Trajectory::by(Pose::identity(), [0.0, 0.0, -0.5], curve);
        let contacts = at(Rigid { trajectory, ..floor() }, &model, friction);
        let model = Arc::new(model);
        let mut stepper = stepper(&model, &contacts, 0.9);
        let mut state = State::at_rest(&model);
        let step = |stepper: &mut CentralDifference<f64>, state: &mut State<f64>, until: f64| {
            while state.time < until {
                stepper.evaluate(state).unwrap();
                stepper.advance(state);
            }
            stepper.evaluate(state).unwrap();
            stepper.contact_nodes(state)
        };
        let mut worst = 0.0_f64;
        for contact in step(&mut stepper, &mut state, 1.4) {
            if model.rest[contact.node as usize][2] > 0.0 {
                continue;
            }
            let [x, y, _] = state.displacement[contact.node as usize];
            let (slip, way) = (contact.slip.unwrap(), x.hypot(y));
            assert!((least..most).contains(&slip), "{slip} m with friction {friction}");
            worst = worst.max((slip - way).abs() / way);
        }
        println!("friction {friction}: slips off by {worst:.1e} of the ways");
        assert!(worst < 0.01 || friction > 0.5, "{worst:.1e}");
        let later = step(&mut stepper, &mut state, 1.6);
        assert!(later.iter().all(|contact| contact.slip.is_none() && contact.force == [0.0; 3]), "{later:?}");
    }
}
