//! Bodies that meet: bars, tumbling blocks, blocks on each other, a body that folds onto itself.

use std::sync::Arc;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use pliant_contact::pairs::Surface;
use pliant_contact::pose::{Pose, Trajectory};
use pliant_contact::shape::Shape;
use pliant_contact::touch::{Contact, Contacts, Rigid, Touch, With};
use pliant_explicit::{CentralDifference, Observable, State};
use pliant_mechanics::curve::{Curve, Shape as CurveShape};
use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
use pliant_mechanics::load::{Load, LoadKind};
use pliant_mechanics::model::{Cells, Material, Model, Solid};
use pliant_testing::Random;

use super::{add_block, faces, stepper};

/// A law without volumetric coupling: Young's modulus is twice the shear modulus.
fn elastic(shear: f64, density: f64) -> Material {
    let law = AnyLaw::NeoHookean(NeoHookean { shear, volumetric: Volumetric::quadratic(2.0 * shear / 3.0) });
    Material::elastic(law, density)
}

fn surface(solid: &Solid) -> Surface {
    let faces = faces(solid);
    let mut nodes: Vec<u32> = faces.iter().flatten().copied().collect();
    nodes.sort_unstable();
    nodes.dedup();
    Surface { nodes, faces }
}

/// Contact of the first solid with the second, or with itself if there is no second.
fn between(model: &Model, friction: f64, offset: f64) -> Arc<Contacts> {
    let with = model.solids.get(1).map_or(With::Itself, |second| With::Body(surface(second)));
    let touch = Touch { friction, offset };
    let contact = Contact { name: "touch".into(), surface: surface(&model.solids[0]), with, touch };
    Arc::new(Contacts { rigids: Vec::new(), contacts: vec![contact], ..Default::default() })
}

/// Momentum [kg m/s] and its moment about the origin at a state, by the velocities between two instants.
fn momenta(model: &Model, state: &State<f64>, step: f64) -> [Vector3<f64>; 2] {
    let mut momenta = [Vector3::zeros(); 2];
    for node in 0..model.node_count() {
        let moved = Vector3::from(state.increment[node]) / step;
        // Increments lead to the place: forces act at the place before.
        let place = Vector3::from(model.rest[node]) + Vector3::from(state.displacement[node]);
        momenta[0] += model.mass[node] * moved;
        momenta[1] += model.mass[node] * place.cross(&moved);
    }
    momenta
}

/// Takes one step. Returns the force [N] of the first contact on the second body, and the state's energy [J].
fn step(stepper: &mut CentralDifference<f64>, state: &mut State<f64>) -> ([f64; 3], f64) {
    stepper.evaluate(state).unwrap();
    let (force, energies) = (stepper.contact_forces()[0], *stepper.energies());
    stepper.advance(state);
    (force, energies.kinetic + energies.internal)
}

/// Two equal bars meet. The wave of the impact goes to the far ends and back. Then the first bar is at rest,
/// and the second flies with its speed (Saint-Venant). They touch for 2 L/c.
#[test]
fn two_bars_that_meet_exchange_their_velocities() {
    let (shear, density, speed, length) = (5e4, 1000.0, 0.02, 0.4);
    let mut model = Model::default();
    for z in [-length - 1e-4, 0.0] {
        add_block(
            &mut model,
            [1, 1, 40],
            [0.01, 0.01, length],
            Isometry3::translation(0.0, 0.0, z),
            elastic(shear, density),
        );
    }
    let half = model.node_count() / 2;
    model.initial_velocity =
        (0..2 * half).map(|node| [0.0, 0.0, if node < half { speed } else { 0.0 }]).collect();
    let contacts = between(&model, 0.0, 0.0);
    let model = Arc::new(model);
    let mut stepper = stepper(&model, &contacts, 0.9);
    let mut state = State::at_rest(&model);
    let duration = 2.0 * length / (2.0 * shear / density).sqrt();
    let (mut first, mut last, mut impulse, mut most) = (f64::INFINITY, 0.0_f64, 0.0, 0.0_f64);
    let start = 0.5 * speed * speed * model.mass[..half].iter().sum::<f64>();
    while state.time < 1.5 * duration {
        let time = state.time;
        let (force, energy) = step(&mut stepper, &mut state);
        if force[2] > 0.0 {
            (first, last) = (first.min(time), last.max(time));
        }
        impulse += force[2] * stepper.step();
        most = most.max(energy / start);
    }
    stepper.evaluate(&mut state).unwrap();
    let mean = |nodes: std::ops::Range<usize>| {
        let mass: f64 = model.mass[nodes.clone()].iter().sum();
        nodes.map(|node| model.mass[node] * stepper.velocity(&state, node)[2]).sum::<f64>() / mass
    };
    let (left, right) = (mean(0..half), mean(half..2 * half));
    println!(
        "velocities {left} and {right} of 0 and {speed} m/s, touching for {} of {duration} s, energy at most {most}",
        last - first
    );
    assert!(left.abs() < 0.02 * speed && (right / speed - 1.0).abs() < 0.02, "{left} {right}");
    assert!(((last - first) / duration - 1.0).abs() < 0.05 && most < 1.0 + 1e-6, "{} {most}", last - first);
    let mass = model.mass[half..].iter().sum::<f64>();
    assert!((impulse / (mass * right) - 1.0).abs() < 1e-9);
}

/// Two blocks of different cells and masses that fly into each other askew.
fn tumbling() -> Model {
    let mut model = Model::default();
    let turned = Isometry3::from_parts(
        Translation3::new(0.005, 0.003, 0.068),
        UnitQuaternion::from_euler_angles(0.4, 0.7, 0.2),
    );
    let corner = Isometry3::translation(-0.02, -0.02, -0.02);
    add_block(&mut model, [2, 2, 2], [0.03, 0.04, 0.05], corner, elastic(5e3, 700.0));
    let half = model.node_count();
    add_block(&mut model, [3, 2, 3], [0.05, 0.03, 0.04], turned * corner, elastic(2e3, 1300.0));
    let mut random = Random::new(2);
    model.initial_velocity = (0..model.node_count())
        .map(|node| {
            let noise = [0, 1, 2].map(|_| 0.01 * random.number());
            let speed = if node < half { [0.1, 0.0, 0.3] } else { [0.0, 0.0, -0.2] };
            [0, 1, 2].map(|c| speed[c] + noise[c])
        })
        .collect();
    model
}

/// Lists made anew in every third step give the same bits as lists that are held as long as they can be. This
/// holds with a ball beside the bodies, too.
#[test]
fn results_do_not_depend_on_when_lists_are_made() {
    let model = Arc::new(tumbling());
    let mut contacts = Contacts::clone(&between(&model, 0.4, 0.0));
    let ramp = Curve { shape: CurveShape::Ramp, from: 0.0, to: 0.1 };
    let trajectory = Trajectory::by(Pose::translation(0.0, -0.045, 0.04), [0.0, 0.02, 0.0], ramp);
    let shape = Shape::Sphere { radius: 0.02 };
    contacts.rigids.push(Rigid { name: "ball".into(), shape, trajectory, inside: false, jaw: None });
    for solid in &model.solids {
        let touch = Touch { friction: 0.2, offset: 0.0 };
        let (name, surface, with) = ("beside".into(), surface(solid), With::Rigid(0));
        contacts.contacts.push(Contact { name, surface, with, touch });
    }
    let contacts = Arc::new(contacts);
    let mut states = [(); 2].map(|()| State::at_rest(&model));
    let mut steppers = [(); 2].map(|()| stepper(&model, &contacts, 0.5));
    let mut touched = [0, 0];
    for index in 0.. {
        if states[0].time >= 0.1 {
            break;
        }
        if index % 3 == 0 {
            steppers[1] = stepper(&model, &contacts, 0.5);
        }
        for (stepper, state) in steppers.iter_mut().zip(&mut states) {
            stepper.evaluate(state).unwrap();
            stepper.advance(state);
        }
        let [held, anew] = &steppers;
        assert_eq!(held.contact_forces(), anew.contact_forces(), "step {index}");
        let [held_state, anew_state] = &states;
        assert_eq!(held_state.displacement, anew_state.displacement, "step {index}");
        assert_eq!(held_state.slip, anew_state.slip, "step {index}");
        for (count, force) in touched.iter_mut().zip(held.contact_forces()) {
            *count += u32::from(force != [0.0; 3]);
        }
    }
    println!("touched in {touched:?} steps");
    assert!(touched.iter().all(|&count| count > 5), "{touched:?}");
}

/// Without and with friction no impulse has a sum or a moment (A2).
#[test]
fn impulses_between_bodies_have_no_sum_and_no_moment() {
    for friction in [0.0, 0.4] {
        let model = tumbling();
        let contacts = between(&model, friction, 0.0);
        let model = Arc::new(model);
        let mut stepper = stepper(&model, &contacts, 0.5);
        let mut state = State::at_rest(&model);
        let mut start = None;
        let (mut touched, mut off, mut most) = (0, [0.0_f64; 2], [0.0, 0.0_f64]);
        while state.time < 0.1 {
            let (force, energy) = step(&mut stepper, &mut state);
            let now = momenta(&model, &state, stepper.step());
            let (before, known) = *start.get_or_insert((now, energy));
            touched += u32::from(force != [0.0; 3]);
            most = [known, most[1].max(energy)];
            let size = before[0].norm();
            off[0] = off[0].max((now[0] - before[0]).norm() / size);
            off[1] = off[1].max((now[1] - before[1]).norm() / (0.05 * size));
        }
        println!(
            "friction {friction}: momenta change by {off:?}, touched in {touched} steps, energy {most:?} J"
        );
        assert!(touched > 5 && off[0] < 1e-12, "{off:?}");
        assert!(off[1] < if friction == 0.0 { 1e-12 } else { 1e-3 }, "{off:?}");
        assert!(most[1] < most[0] * 1.01, "{most:?}");
    }
}

/// Patch test: blocks of cells that do not match, one on the other, pressed by a uniform load. The stress is
/// the load everywhere (A1).
#[test]
fn a_uniform_pressure_goes_through_cells_that_do_not_match() {
    let (pressure, shear) = (100.0, 5e3);
    let mut model = Model::default();
    add_block(&mut model, [3, 3, 3], [0.03; 3], Isometry3::identity(), elastic(shear, 1000.0));
    let half = model.node_count();
    add_block(
        &mut model,
        [2, 2, 2],
        [0.03; 3],
        Isometry3::translation(0.0, 0.0, 0.03),
        elastic(shear, 1000.0),
    );
    model.bodies.iter_mut().for_each(|body| body.damping = 60.0);
    let low: Vec<u32> = (0..half as u32).filter(|&node| model.rest[node as usize][2] == 0.0).collect();
    model.fix("base", low.clone());
    let top: Vec<u32> =
        (half as u32..model.node_count() as u32).filter(|&n| model.rest[n as usize][2] > 0.0599).collect();
    // A quarter of each face of a cell goes to each of its corners.
    let share = |x: f64| if x == 0.0 || x > 0.0299 { 0.0075 } else { 0.015 };
    let quarters = top.iter().map(|&node| {
        let [x, y, _] = model.rest[node as usize];
        (node, [0.0, 0.0, -pressure * share(x) * share(y)])
    });
    let quarters = LoadKind::Forces(quarters.collect());
    model.loads.push(Load::new("press", quarters, Curve { shape: CurveShape::Hold, from: 0.0, to: 0.0 }));
    let contacts = between(&model, 0.0, 0.0);
    let model = Arc::new(model);
    let mut stepper = stepper(&model, &contacts, 0.8);
    let mut state = State::at_rest(&model);
    let mut force = [0.0; 3];
    while state.time < 1.0 {
        (force, _) = step(&mut stepper, &mut state);
    }
    // Without volumetric coupling the strain is the strain of a column: its nodes move by z times the strain.
    let strain = pressure / (2.0 * shear);
    let worst = (0..model.node_count())
        .map(|node| (state.displacement[node][2] + strain * model.rest[node][2]).abs() / (strain * 0.06))
        .fold(0.0, f64::max);
    println!("displacements off by {worst:.4} of the largest, {} N of {} N", force[2], -pressure * 9e-4);
    assert!(worst < 0.05 && (force[2].abs() / (pressure * 9e-4) - 1.0).abs() < 0.01, "{worst} {force:?}");
}

/// Two columns on a common base that are thrown against each other: they meet, part again, and never overlap.
#[test]
fn a_body_touches_itself() {
    let mut model = super::block([5, 1, 8], 0.01, 2e3, Default::default());
    let Cells::FullHex8(block, _) = &model.solids[0].cells else { unreachable!() };
    let middle = |cell: &[u32; 8]| {
        let sum =
            cell.iter().fold([0.0; 3], |sum, &n| [0, 1, 2].map(|c| sum[c] + model.rest[n as usize][c] / 8.0));
        (sum[0], sum[2])
    };
    // A gap of a cell between two columns of two cells.
    let kept: Vec<[u32; 8]> = block
        .nodes
        .iter()
        .copied()
        .filter(|cell| {
            let (x, z) = middle(cell);
            z < 0.02 || !(0.02..0.03).contains(&x)
        })
        .collect();
    let rest = model.rest.clone();
    let material = model.solids[0].material.clone();
    model = Model::default();
    let body = model.add_body("fork", &rest);
    let cells = Cells::full_hex8(kept, &model.rest);
    model.add_solid(Solid::new(body, material, cells));
    model.bodies[0].damping = 2.0;
    let low = (0..model.node_count() as u32).filter(|&n| rest[n as usize][2] == 0.0).collect();
    model.fix("base", low);
    model.initial_velocity = rest
        .iter()
        .map(|x| {
            [
                if x[2] > 0.02 {
                    (if x[0] < 0.025 { 0.25 } else { -0.25 }) * (x[2] - 0.02) / 0.06
                } else {
                    0.0
                },
                0.0,
                0.0,
            ]
        })
        .collect();
    let contacts = between(&model, 0.2, 0.0);
    let model = Arc::new(model);
    let mut stepper = stepper(&model, &contacts, 0.8);
    let mut state = State::at_rest(&model);
    let ends = |x: f64| -> Vec<usize> {
        (0..rest.len()).filter(|&n| (rest[n][0] - x).abs() < 1e-9 && rest[n][2] > 0.0201).collect()
    };
    let (left, right) = (ends(0.02), ends(0.03));
    let (mut least, mut start, mut most, mut touched) = (f64::INFINITY, 0.0, 0.0_f64, 0);
    while state.time < 1.0 {
        let (_, energy) = step(&mut stepper, &mut state);
        start = if start == 0.0 { energy } else { start };
        most = most.max(energy);
        let gap = left
            .iter()
            .zip(&right)
            .map(|(&a, &b)| rest[b][0] + state.displacement[b][0] - rest[a][0] - state.displacement[a][0]);
        let gap = gap.fold(f64::INFINITY, f64::min);
        touched += u32::from(gap < 1e-5);
        least = least.min(gap);
    }
    println!(
        "columns come as near as {least:.1e} m, touch in {touched} steps, energy {most} of {start} J at the start"
    );
    assert!(touched > 3 && least > -1e-4, "{least}");
    assert!(most < start * 1.001 && stepper.energies().balance.abs() < 0.02, "{:?}", stepper.energies());
}

/// Bodies, and the arms of a body, that begin nearer than the distance that they keep stay where they are:
/// nothing pushes them. Bodies that begin farther away keep the whole distance.
#[test]
fn what_begins_nearer_than_the_distance_to_keep_is_not_pushed() {
    for (gap, nearer) in [(0.0, true), (2e-4, true), (2e-3, false)] {
        let mut model = Model::default();
        for (cells, z) in [([3, 3, 2], 0.0), ([2, 2, 2], 0.02 + gap)] {
            let at = Isometry3::translation(0.001 * z, 0.0, z);
            add_block(&mut model, cells, [0.03, 0.03, 0.02], at, elastic(2e3, 1000.0));
        }
        let low = (0..model.node_count() as u32).filter(|&node| model.rest[node as usize][2] == 0.0);
        let low = low.collect();
        model.fix("base", low);
        let mut contacts = between(&model, 0.2, 1e-3);
        let place = |node: u32| Vector3::from(model.rest[node as usize]);
        let (mut pairs, _) = contacts.contacts[0].pairs(|node| node, place).unwrap();
        let near = pairs.nearer(place);
        assert_eq!(!near.is_empty(), nearer, "{near:?}");
        Arc::make_mut(&mut contacts).near.insert(0, near);
        let still = Arc::new(model.clone());
        let mut free = stepper(&still, &contacts, 0.9);
        let mut state = State::at_rest(&still);
        for _ in 0..100 {
            step(&mut free, &mut state);
        }
        let moved = state.displacement.as_flattened().iter().fold(0.0_f64, |most, u| most.max(u.abs()));
        assert!(moved < 1e-15, "{gap}: pushed by {moved}");
        // Pressed on each other, they keep what they have, or the whole distance.
        model.bodies.iter_mut().for_each(|body| body.damping = 60.0);
        model.loads.push(Load::gravity(1, [0.0, 0.0, -9.81]));
        let pressed = Arc::new(model);
        let mut stepper = stepper(&pressed, &contacts, 0.9);
        let mut state = State::at_rest(&pressed);
        while state.time < 0.3 {
            step(&mut stepper, &mut state);
        }
        let place = |node: u32| {
            Vector3::from(pressed.rest[node as usize]) + Vector3::from(state.displacement[node as usize])
        };
        let (mut pairs, _) = contacts.contacts[0].pairs(|node| node, place).unwrap();
        pairs.list_again(place);
        let mut least = f64::INFINITY;
        pairs.find(place, |pair| least = least.min(pair.distance));
        println!("gap {gap}: {least} m are left");
        let wanted = if nearer { gap } else { 1e-3 };
        assert!((least - wanted).abs() < 2e-6, "{gap}: {least} of {wanted}");
    }
}
