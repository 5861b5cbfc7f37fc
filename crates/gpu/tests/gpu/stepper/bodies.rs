//! Bodies that touch each other and themselves, on a device as on the processor.

use std::sync::Arc;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use pliant_contact::pose::Pose;
use pliant_contact::shape::Shape;
use pliant_contact::touch::{Contact, Contacts, Rigid, Touch, With};
use pliant_explicit::{Observable, State, Wanted};
use pliant_gpu::GpuStepper;
use pliant_mechanics::load::LoadKind;
use pliant_mechanics::model::{Cells, Constraint, Model, Motion, Solid};
use pliant_testing::Random;

use super::against::{PLAIN, load, step_of};
use super::contact::{compare, moving, rigid, surface, time_of};
use super::cube::{elastic, neo_hookean, smooth, tet_block};
use crate::support;

/// Adds a block of tetrahedra at a place, with nodes moved at random by up to `jitter` of a cell. No edges
/// are parallel, and no faces flat, so that round-off decides nowhere what touches.
fn add(model: &mut Model, name: &str, cells: [u32; 3], size: [f64; 3], place: &Isometry3<f64>, jitter: f64) {
    let (mut points, tets) = tet_block(cells, size);
    let mut random = Random::new(23 + model.bodies.len() as u64);
    for point in &mut points {
        let moved = (0..3).map(|c| point[c] + jitter * size[c] / f64::from(cells[c]) * random.half());
        *point = (place * nalgebra::Point3::from(Vector3::from_iterator(moved))).coords.into();
    }
    add_tets(model, name, &points, tets);
}

fn add_tets(model: &mut Model, name: &str, points: &[[f64; 3]], tets: Vec<[u32; 4]>) {
    let first = model.rest.len() as u32;
    let body = model.add_body(name, points);
    let tets = tets.into_iter().map(|tet| tet.map(|node| node + first)).collect();
    let cells = Cells::tet4(tets, &model.rest);
    model.add_solid(Solid::new(body, elastic(neo_hookean()), cells));
}

/// Turned about all axes.
fn askew(at: [f64; 3]) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_euler_angles(0.11, -0.07, 0.4);
    Isometry3::from_parts(Translation3::from(Vector3::from(at)), turn)
}

/// Makes contacts of the first solid with the second, or with itself if there is no second, and with things.
fn touching(model: &Model, rigids: Vec<Rigid>, friction: f64) -> Arc<Contacts> {
    let skin = surface(&model.solids[0]);
    let with = model.solids.get(1).map_or(With::Itself, |second| With::Body(surface(second)));
    let touch = Touch { friction, offset: 1e-4 };
    let last = model.solids.last().map(surface).unwrap_or_default();
    let at_things = rigids.iter().enumerate().map(|(index, rigid)| Contact {
        name: rigid.name.clone(),
        surface: last.clone(),
        with: With::Rigid(index),
        touch,
    });
    let mut contacts: Vec<Contact> = at_things.collect();
    contacts.push(Contact { name: "touch".into(), surface: skin, with, touch });
    Arc::new(Contacts { rigids, contacts, ..Default::default() })
}

/// The first flies at the second, with a corner ahead.
fn cubes() -> Model {
    let mut model = Model::default();
    add(&mut model, "first", [3; 3], [0.03; 3], &askew([0.0, 0.0, 0.0325]), 0.2);
    add(&mut model, "second", [4, 4, 3], [0.04, 0.04, 0.03], &Isometry3::identity(), 0.2);
    let first = model.bodies[0].nodes.end as usize;
    let velocity = |node| if node < first { [0.02, 0.01, -0.15] } else { [0.0; 3] };
    model.initial_velocity = (0..model.node_count()).map(velocity).collect();
    model
}

/// Then both are pressed together.
#[test]
fn two_cubes_meet() {
    let Some(device) = support::device() else { return };
    let mut model = cubes();
    for (body, up) in [(0, -5.0), (1, 3.0)] {
        let kind = LoadKind::Gravity { body, acceleration: [0.0, 0.3, up] };
        model.loads.push(load("press", kind, None));
    }
    for friction in [0.0, 0.4] {
        compare(
            &device,
            &format!("cubes, friction {friction}"),
            &model,
            &touching(&model, vec![], friction),
            PLAIN,
        );
    }
}

/// A lid slides and sinks in on a block; then a ball presses on it.
fn lid() -> Model {
    let mut model = Model::default();
    add(&mut model, "block", [4, 4, 2], [0.05, 0.05, 0.02], &Isometry3::identity(), 0.2);
    let lid = Isometry3::translation(0.004, 0.007, 0.0225);
    add(&mut model, "lid", [3, 3, 1], [0.04, 0.036, 0.01], &lid, 0.2);
    model.fix("base", (0..25).collect());
    let block = model.bodies[0].nodes.end as usize;
    model.bodies.iter_mut().for_each(|body| body.damping = 5.0);
    model.initial_velocity = (0..model.node_count())
        .map(|node| if node < block { [0.0; 3] } else { [0.08, 0.03, -0.05] })
        .collect();
    let kind = LoadKind::Gravity { body: 1, acceleration: [0.0, 0.0, -9.81] };
    model.loads.push(load("gravity", kind, None));
    model
}

#[test]
fn a_lid_slides_on_a_block() {
    let Some(device) = support::device() else { return };
    let model = lid();
    compare(&device, "lid", &model, &touching(&model, vec![], 0.3), PLAIN);
}

/// The lid begins nearer than the distance to keep over a part of the block, and slides on: each node keeps
/// what it had.
#[test]
fn a_lid_keeps_less_where_it_begins_nearer() {
    let Some(device) = support::device() else { return };
    let model = lid();
    let mut contacts = touching(&model, vec![], 0.3);
    let of_bodies = Arc::make_mut(&mut contacts);
    of_bodies.contacts[0].touch.offset = 0.0035;
    let rest = |node: u32| Vector3::from(model.rest[node as usize]);
    let near = of_bodies.contacts[0].pairs(|node| node, rest).map(|(mut pairs, _)| pairs.nearer(rest));
    let near = near.unwrap();
    assert!(near.len() > 10 && near.len() < model.node_count() / 2, "{}", near.len());
    of_bodies.near.insert(0, near);
    compare(&device, "lid that begins near", &model, &contacts, PLAIN);
}

#[test]
fn a_tool_presses_a_lid_on_a_block() {
    let Some(device) = support::device() else { return };
    let model = lid();
    let from = Pose::translation(0.021, 0.024, 0.0345 + 0.06);
    let ball = rigid("ball", Shape::Sphere { radius: 0.06 }, moving(from, [4e-3, 0.0, -0.02]));
    compare(&device, "lid and ball", &model, &touching(&model, vec![ball], 0.3), PLAIN);
}

/// A base with two arms, whose tips are moved into each other from outside.
fn fork() -> Model {
    let (points, tets) = tet_block([5, 2, 6], [0.05, 0.02, 0.06]);
    let middle =
        |tet: &[u32; 4], c: usize| tet.iter().map(|&node| points[node as usize][c]).sum::<f64>() / 4.0;
    let is_part = |tet: &[u32; 4]| middle(tet, 2) < 0.01 || !(0.02..0.03).contains(&middle(tet, 0));
    let tets: Vec<[u32; 4]> = tets.into_iter().filter(is_part).collect();
    let mut used: Vec<u32> = tets.concat();
    used.sort_unstable();
    used.dedup();
    let mut random = Random::new(29);
    let mut moved = |node: &u32| points[*node as usize].map(|x| x + 0.002 * random.half());
    let places: Vec<[f64; 3]> = used.iter().map(&mut moved).collect();
    let number = |node: u32| used.partition_point(|&known| known < node) as u32;
    let tets = tets.into_iter().map(|tet| tet.map(number)).collect();
    let mut model = Model::default();
    add_tets(&mut model, "fork", &places, tets);
    model.fix("base", (0..18).collect());
    for (name, is_tip, way) in [("left", 0.0..0.005, 0.007), ("right", 0.045..0.06, -0.005)] {
        let tip = |&(_, x): &(u32, &[f64; 3])| x[2] > 0.055 && is_tip.contains(&x[0].max(0.0));
        let nodes = (0..).zip(&model.rest).filter(tip).map(|(node, _)| node).collect();
        let (components, motion) = ([true; 6], Motion::Displacement([way, 0.0, 1e-3], smooth(0.1)));
        model.constraints.push(Constraint { name: name.into(), nodes, components, motion });
    }
    model.bodies[0].damping = 2.0;
    model
}

#[test]
fn the_arms_of_a_fork_meet() {
    let Some(device) = support::device() else { return };
    let model = fork();
    for friction in [0.0, 0.3] {
        compare(
            &device,
            &format!("fork, friction {friction}"),
            &model,
            &touching(&model, vec![], friction),
            PLAIN,
        );
    }
}

/// Two free bodies keep their momentum, and the way in which the steps are divided changes no bit: lists are
/// made at the same instants.
#[test]
fn cubes_keep_their_momentum_and_their_bits_however_the_steps_are_divided() {
    let Some(device) = support::device() else { return };
    let model = cubes();
    let contacts = touching(&model, vec![], 0.4);
    let step = 0.5 * step_of(&model);
    let momentum = |velocity: &dyn Fn(usize) -> [f64; 3]| {
        (0..model.node_count())
            .map(|node| model.mass[node] * Vector3::from(velocity(node)))
            .sum::<Vector3<f64>>()
    };
    let run = |strides: &[u64]| {
        let mut state = State::<f32>::at_rest(&model);
        let of = (model.clone(), Arc::clone(&contacts));
        let mut stepper = GpuStepper::with_contacts(&device, of.0, of.1, step, None).unwrap();
        for &stride in strides {
            stepper.evaluate(&mut state, Wanted::Energies).unwrap();
            stepper.advance(&mut state, stride).unwrap();
        }
        stepper.evaluate(&mut state, Wanted::Everything).unwrap();
        let now = momentum(&|node| stepper.velocity(&state, node));
        (state.displacement, state.increment, stepper.contact_forces(), now)
    };
    let whole = run(&[200]);
    assert_eq!(run(&[1, 2, 37, 160]), whole);
    assert_eq!(run(&[200]), whole);
    let before = momentum(&|node| model.initial_velocity[node]);
    let off = (whole.3 - before).norm() / before.norm();
    println!("cubes: momentum off by {off:.1e}");
    assert!(off <= 1e-5, "{off:.1e}");
}

/// A block of 41,472 tetrahedra, its base held, and a lid of 2,304 above it. The test prints the time of a
/// step without contact, with the lid out of reach, within the skin of the lists, and sunk in. `cargo test
/// --release -p pliant-gpu --test gpu the_cost_of_pairs -- --include-ignored --nocapture`.
#[test]
#[ignore = "measures time"]
fn the_cost_of_pairs() {
    let Some(device) = support::device() else { return };
    let (edge, cells) = (0.1, 24);
    let mut alone = None;
    for (what, gap) in
        [("alone", None), ("out of reach", Some(0.02)), ("beside", Some(5e-4)), ("in touch", Some(1e-4))]
    {
        let mut model = Model::default();
        add(&mut model, "block", [cells, cells, 12], [edge, edge, 0.5 * edge], &Isometry3::identity(), 0.0);
        let at = Isometry3::translation(0.013, 0.012, 0.5 * edge + gap.unwrap_or(0.02));
        add(&mut model, "lid", [12, 16, 2], [0.07, 0.07, 0.01], &at, 0.0);
        model.fix("base", (0..(cells + 1) * (cells + 1)).collect());
        let block = model.bodies[0].nodes.end as usize;
        let falls = gap == Some(1e-4);
        let velocity = |node| if node < block || !falls { [0.0; 3] } else { [0.01, 0.0, -0.05] };
        model.initial_velocity = (0..model.node_count()).map(velocity).collect();
        let step = 0.5 * step_of(&model);
        let contacts = touching(&model, vec![], 0.3);
        let mut stepper = match gap {
            None => GpuStepper::new(&device, model.clone(), step, None),
            Some(_) => GpuStepper::with_contacts(&device, model.clone(), contacts, step, None),
        }
        .unwrap();
        let spent = time_of(&mut stepper, &model, what);
        let alone = *alone.get_or_insert(spent);
        println!("{what}: {:+.1} % of processor time", 100.0 * (spent / alone - 1.0));
    }
}
