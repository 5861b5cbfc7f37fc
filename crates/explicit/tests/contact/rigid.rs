//! An incline, a wall, a tool that is pressed in.

use std::sync::Arc;

use pliant_contact::pairs::Surface;
use pliant_contact::pose::{Pose, Trajectory};
use pliant_contact::shape::Shape;
use pliant_contact::touch::{Contact, Contacts, Rigid, Touch, With, lattice};
use pliant_explicit::{Observable, State};
use pliant_mechanics::curve::{Curve, Shape as CurveShape};
use pliant_mechanics::load::Load;
use pliant_mechanics::model::Model;
use pliant_mechanics::prony::Prony;

use super::{block, faces, leapfrog_energy, stepper};

/// Contact of all nodes and outer faces with a thing.
pub fn at(rigid: Rigid, model: &Model, friction: f64) -> Arc<Contacts> {
    let faces = faces(&model.solids[0]);
    let nodes = (0..model.node_count() as u32).collect();
    let touch = Touch { friction, offset: 0.0 };
    let (surface, with) = (Surface { nodes, faces }, With::Rigid(0));
    Arc::new(Contacts {
        rigids: vec![rigid],
        contacts: vec![Contact { name: "touch".into(), surface, with, touch }],
        ..Default::default()
    })
}

pub fn floor() -> Rigid {
    Rigid {
        name: "floor".into(),
        shape: Shape::HalfSpace,
        trajectory: Trajectory::fixed(Pose::identity()),
        inside: false,
        jaw: None,
    }
}

/// Slope with a tangent of ½: sticks with μ = ½, and slides by ½ a t² with less (A4 of the acceptance tests
/// of contact). The block is first pressed on, then tilted, so that it does not hop. At μ = ½ itself nothing
/// holds back what an elastic block still trembles: it creeps by less than a thousandth of the way without
/// friction. A particle sticks exactly (`pliant-contact`).
#[test]
fn a_block_on_an_incline_sticks_or_slides_by_coulombs_law() {
    let (sine, cosine) = (0.2_f64.sqrt(), 0.8_f64.sqrt());
    // Sliding with friction excites vibrations of an elastic block, which the tissue calms.
    let relaxing = Prony { isochoric: vec![(0.3, 0.005)], ..Prony::default() };
    let smooth = |from, to| Curve { shape: CurveShape::SmoothStep, from, to };
    for (friction, slid, bound) in
        [(0.51, 0.0, 1e-5), (0.5, 0.0, 2e-3), (0.49, 0.0439, 0.05), (0.3, 0.8774, 0.02), (0.0, 2.1936, 0.02)]
    {
        let mut model = block([2, 2, 1], 0.05, 3e5, relaxing.clone());
        for (pull, curve) in
            [([0.0, 0.0, -9.81 * cosine], smooth(0.0, 0.2)), ([9.81 * sine, 0.0, 0.0], smooth(0.2, 0.4))]
        {
            model.loads.push(Load { curve, ..Load::gravity(0, pull) });
        }
        let contacts = at(floor(), &model, friction);
        let model = Arc::new(model);
        let mut stepper = stepper(&model, &contacts, 0.9);
        let mut state = State::at_rest(&model);
        let mut lowest = 0.0_f64;
        let mean = |field: &[[f64; 3]]| field.iter().map(|u| u[0]).sum::<f64>() / field.len() as f64;
        let mut start = None;
        while state.time < 1.4 {
            stepper.evaluate(&mut state).unwrap();
            if state.time >= 0.4 && start.is_none() {
                start =
                    Some((state.time, mean(&state.displacement), mean(&state.increment) / stepper.step()));
            }
            stepper.advance(&mut state);
            lowest = height(&state, &model).min(lowest);
        }
        let (from, place, speed) = start.unwrap();
        let time = state.time - from;
        let moved = (mean(&state.displacement) - place - speed * time) / (time * time);
        assert!(lowest > -1e-12, "{lowest:.1e} m below the floor");
        let off = if slid == 0.0 { mean(&state.displacement) - place } else { moved / slid - 1.0 };
        println!("friction {friction}: {moved} m of {slid} m, off by {off:.1e}, lowest {lowest:.1e} m");
        assert!(off.abs() < bound, "friction {friction}: {moved} m of {slid} m");
    }
}

/// Height [m] of the lowest node.
fn height(state: &State<f64>, model: &Model) -> f64 {
    state.displacement.iter().zip(&model.rest).map(|(u, x)| u[2] + x[2]).fold(f64::INFINITY, f64::min)
}

/// A bar flies against a wall and back. No node goes through the wall, and the energy never grows beyond the
/// start. The step stays as for the free bar up to 0.99 of the critical one (A7).
#[test]
fn a_bar_bounces_off_a_wall_at_the_step_of_the_free_bar() {
    for part in [0.5, 0.9, 0.99] {
        let mut model = block([1, 1, 40], 0.01, 5e4, Prony::default());
        model.initial_velocity = vec![[0.0, 0.0, -0.05]; model.node_count()];
        model.rest.iter_mut().for_each(|x| x[2] += 1e-4);
        let contacts = at(floor(), &model, 0.0);
        let model = Arc::new(model);
        let mut stepper = stepper(&model, &contacts, part);
        let mut state = State::at_rest(&model);
        let kinetic = 0.5 * model.mass.iter().sum::<f64>() * 0.0025;
        let (mut lowest, mut most, mut impulse) = (f64::INFINITY, 0.0_f64, 0.0);
        // Longer than a wave there and back.
        while state.time < 0.12 {
            most = most.max(leapfrog_energy(&model, &mut stepper, &mut state) / kinetic);
            impulse -= stepper.contact_forces()[0][2] * stepper.step();
            lowest = height(&state, &model).min(lowest);
        }
        stepper.evaluate(&mut state).unwrap();
        let momentum: f64 =
            (0..model.node_count()).map(|node| model.mass[node] * stepper.velocity(&state, node)[2]).sum();
        let before = -0.05 * model.mass.iter().sum::<f64>();
        println!("{part}: lowest {lowest:.1e} m, energy at most {most}, rebound {}", momentum / -before);
        assert!(lowest > -1e-12 && most < 1.0 + 1e-9, "{part}: {lowest:.1e} m, {most}");
        assert!((0.9..=1.0).contains(&(momentum / -before)), "{part}: {momentum} of {before}");
        assert!(
            ((momentum - before) / impulse - 1.0).abs() < 1e-9,
            "{part}: {momentum} - {before} and {impulse}"
        );
    }
}

/// A capsule is driven into a block, or grows into it. It stays free of all nodes, and of points between them
/// to a twentieth of its radius. The work that drives it is the energy of the block.
#[test]
fn a_tool_presses_no_node_into_itself() {
    for (fast, growth) in [(1.0, 0.0), (10.0, 0.0), (10.0, 0.004), (1.0, 0.002)] {
        let mut model = block([8, 8, 4], 0.01, 2e3, Prony::default());
        model.bodies[0].damping = 20.0;
        let low =
            (0..model.node_count() as u32).filter(|&node| model.rest[node as usize][2] == 0.0).collect();
        model.fix("base", low);
        let radius = 0.006;
        let depth = 0.008;
        let over = |z: f64| Pose::translation(0.04, 0.04, z) * Pose::rotation([0.0, 1.6, 0.0].into());
        let curve = Curve { shape: CurveShape::Ramp, from: 0.0, to: 0.3 / fast };
        let shape = Shape::Capsule { radius: radius - growth, length: 0.03 };
        let trajectory =
            Trajectory::by(over(0.04 + radius + 0.001), [0.0, 0.0, -depth - 0.001], curve.clone());
        let trajectory = if growth > 0.0 { trajectory.growing(growth, curve) } else { trajectory };
        let tool = Rigid { name: "tool".into(), shape, trajectory, inside: false, jaw: None };
        let contacts = at(tool.clone(), &model, 0.2);
        let model = Arc::new(model);
        let mut stepper = stepper(&model, &contacts, 0.6);
        let mut state = State::at_rest(&model);
        let (mut deepest, mut between, mut force) = (0.0_f64, 0.0_f64, [0.0; 3]);
        let points = lattice(6);
        while state.time < 0.4 {
            stepper.evaluate(&mut state).unwrap();
            force = stepper.contact_forces()[0];
            stepper.advance(&mut state);
            let stance = tool.stance(state.time, None);
            let place = |node: u32| {
                let (u, x) = (state.displacement[node as usize], model.rest[node as usize]);
                nalgebra::Vector3::from([0, 1, 2].map(|c| x[c] + u[c]))
            };
            for node in 0..model.node_count() as u32 {
                deepest = deepest.min(tool.near(&stance, &place(node)).distance);
            }
            for face in &contacts.contacts[0].surface.faces {
                let corners = face.map(place);
                for weights in &points {
                    let point = (0..3).map(|k| corners[k] * weights[k]).sum();
                    between = between.min(tool.near(&stance, &point).distance);
                }
            }
        }
        println!(
            "{fast}, {growth} m: deepest {deepest:.1e} m, between nodes {between:.1e} m, force {force:?} N, {:?}",
            stepper.energies()
        );
        assert!(deepest > -1e-12 && between > -0.05 * radius, "{deepest:.1e} m, {between:.1e} m");
        assert!(
            force[2] > 0.1 && stepper.energies().balance.abs() < 0.01,
            "{force:?} {:?}",
            stepper.energies()
        );
    }
}

/// The force that is reported of a thing so fast that its way is followed in parts is that which moves the
/// body.
#[test]
fn the_force_of_a_fast_tool_is_the_change_of_momentum() {
    let model = Arc::new(block([2, 2, 2], 0.01, 2e3, Prony::default()));
    let curve = Curve { shape: CurveShape::Ramp, from: 0.0, to: 0.00105 };
    let trajectory = Trajectory::by(Pose::translation(0.01, 0.01, 0.03), [0.0, 0.0, -0.0105], curve);
    let tool = Rigid {
        name: "tool".into(),
        shape: Shape::Sphere { radius: 0.002 },
        trajectory,
        inside: false,
        jaw: None,
    };
    let mut stepper = stepper(&model, &at(tool, &model, 0.0), 0.1);
    let mut state = State::at_rest(&model);
    let momentum = |state: &State<f64>| {
        model.mass.iter().zip(&state.increment).map(|(mass, way)| mass * way[2]).sum::<f64>()
    };
    let mut touched = 0;
    while state.time < 4e-3 {
        let (before, time) = (momentum(&state), state.time);
        stepper.evaluate(&mut state).unwrap();
        let force = stepper.contact_forces()[0][2];
        stepper.advance(&mut state);
        let change = (momentum(&state) - before) / (state.time - time).powi(2);
        touched += u32::from(force != 0.0);
        assert!((change + force).abs() <= 1e-9 * (1.0 + force.abs()), "{}: {change} {force}", state.time);
    }
    assert!(touched > 0);
}
