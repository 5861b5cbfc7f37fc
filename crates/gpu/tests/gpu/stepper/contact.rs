//! Bodies that touch rigid things, on a device as on the processor.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use nalgebra::Vector3;
use pliant_contact::grid::Grid;
use pliant_contact::pairs::Surface;
use pliant_contact::pose::{Leg, Pose, Trajectory};
use pliant_contact::profile::{Corner, Profile};
use pliant_contact::shape::Shape;
use pliant_contact::touch::{Contact, Contacts, Jaw, Rigid, Touch, With};
use pliant_explicit::{CentralDifference, Observable, State, Wanted};
use pliant_gpu::{Design, Device, GpuError, GpuStepper, processor_only};
use pliant_mechanics::load::LoadKind;
use pliant_mechanics::model::{Cells, Model, Solid};

use super::against::{PLAIN, compare_touching, designs, distance, double, load, step_of};
use super::cube::{EDGE, elastic, free_cube, held_cube, neo_hookean, smooth, tet_block};
use crate::support;

/// The faces of tetrahedra that no other one has, in the order in which a device takes them. Faces that share
/// no node come first, then others. Impulses are found to a thousandth of the deepest gap, so that another
/// order gives other last digits.
pub(super) fn surface(solid: &Solid) -> Surface {
    let mut sides = BTreeMap::new();
    let cells = &solid.cells;
    for nodes in (0..cells.len()).map(|cell| cells.nodes(cell)) {
        for side in [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]].map(|side| side.map(|k: usize| nodes[k])) {
            let mut key = side;
            key.sort_unstable();
            sides.entry(key).or_insert_with(Vec::new).push(side);
        }
    }
    let outer = sides.into_values().filter(|sharing| sharing.len() == 1).flatten();
    let mut faces: Vec<[u32; 3]> = outer.collect();
    faces.sort_unstable();
    let mut coloured: Vec<(usize, [u32; 3])> = Vec::new();
    for face in faces {
        let beside = |other: &[u32; 3]| other.iter().any(|node| face.contains(node));
        let is_free =
            |colour: &usize| coloured.iter().all(|(taken, other)| taken != colour || !beside(other));
        coloured.push(((0..).find(is_free).unwrap(), face));
    }
    coloured.sort_by_key(|&(colour, _)| colour);
    let faces: Vec<[u32; 3]> = coloured.into_iter().map(|(_, face)| face).collect();
    let mut nodes = faces.concat();
    nodes.sort_unstable();
    nodes.dedup();
    Surface { nodes, faces }
}

/// An obstacle or a tool.
pub(super) fn rigid(name: &str, shape: Shape, trajectory: Trajectory) -> Rigid {
    Rigid { name: name.into(), shape, trajectory, inside: false, jaw: None }
}

/// Makes a trajectory from a place by a way in 0.3 s.
pub(super) fn moving(from: Pose, way: [f64; 3]) -> Trajectory {
    Trajectory::by(from, way, smooth(0.3))
}

/// Makes contacts of all faces of a body with each of some things.
pub(super) fn with(model: &Model, rigids: Vec<Rigid>, friction: f64) -> Arc<Contacts> {
    let surface = surface(&model.solids[0]);
    let contact = |(index, rigid): (usize, &Rigid)| Contact {
        name: rigid.name.clone(),
        surface: surface.clone(),
        with: With::Rigid(index),
        touch: Touch { friction, offset: 1e-4 },
    };
    let contacts = rigids.iter().enumerate().map(contact).collect();
    Arc::new(Contacts { rigids, contacts, ..Default::default() })
}

/// Compares displacements, velocities, energies and reactions like `compare`. Forces differ by a thousandth
/// of the largest one, or by twice the error of the processor in single precision.
pub(super) fn compare(
    device: &Device,
    what: &str,
    model: &Model,
    contacts: &Arc<Contacts>,
    designs: &[Design],
) {
    for forces in compare_touching(device, what, (model, contacts), 0.5 * step_of(model), designs) {
        let largest = forces.iter().map(|[a, ..]| Vector3::from(*a).norm()).fold(0.0, f64::max);
        let [off, of_processor] = [1, 2].map(|other| {
            let apart = forces
                .iter()
                .map(|of_node| (Vector3::from(of_node[0]) - Vector3::from(of_node[other])).norm());
            apart.fold(0.0, f64::max) / largest
        });
        println!(
            "{what}: forces of {largest:.3} N, off by {off:.1e}, the processor in single precision by {of_processor:.1e}"
        );
        assert!(largest > 0.0 && off <= (2.0 * of_processor).max(1e-3), "{what}: {forces:?}");
    }
}

/// Above the middle of the cube by a height [m].
fn above(height: f64) -> Pose {
    Pose::translation(0.5 * EDGE, 0.45 * EDGE, EDGE + height)
}

fn tissue() -> Model {
    held_cube("tet4", elastic(neo_hookean()))
}

/// Tests every design that has contact.
#[test]
fn a_cube_falls_onto_a_slope() {
    let Some(device) = support::device() else { return };
    let mut model = free_cube("tet4", elastic(neo_hookean()));
    model.bodies[0].damping = 5.0;
    model.initial_velocity = vec![[0.0, 0.0, -0.1]; model.node_count()];
    let kind = LoadKind::Gravity { body: 0, acceleration: [1.0, 0.5, -9.81] };
    model.loads.push(load("gravity", kind, None));
    let floor = rigid("floor", Shape::HalfSpace, Trajectory::fixed(Pose::translation(0.0, 0.0, -1e-3)));
    let designs: Vec<_> = designs(&device).filter(|design| *design != Design::Blocks).collect();
    for friction in [0.0, 0.3] {
        let what = format!("slope, friction {friction}");
        compare(&device, &what, &model, &with(&model, vec![floor.clone()], friction), &designs);
    }
}

/// Things so large that only nodes touch them.
#[test]
fn nodes_touch_large_things() {
    let Some(device) = support::device() else { return };
    let model = tissue();
    let down = [2e-3, 0.0, -0.012];
    let lying = Pose::rotation(Vector3::new(0.0, 1.6, 0.3));
    let corner = Vector3::repeat(0.11);
    let ball = Grid::sample([-corner, corner], 0.01, |x| x.norm() - 0.08).unwrap().with_thinnest(0.08);
    let cases = [
        ("large sphere", Shape::Sphere { radius: 0.08 }, above(0.081)),
        ("large capsule", Shape::Capsule { radius: 0.07, length: 0.05 }, above(0.071) * lying),
        ("large box", Shape::Cuboid { size: [0.15, 0.2, 0.16] }, above(0.081)),
        ("large cone", Shape::Cone { radius: 0.2, height: 0.3 }, above(2e-3)),
        ("large grid", Shape::Grid(Arc::new(ball)), above(0.082)),
    ];
    for (what, shape, from) in cases {
        for friction in [0.0, 0.3] {
            let tool = rigid("tool", shape.clone(), moving(from, down));
            compare(&device, what, &model, &with(&model, vec![tool], friction), PLAIN);
        }
    }
}

/// Small things between the nodes. No edge of the box touches a point of a face, since round-off would choose
/// the side there.
#[test]
fn points_of_faces_touch_small_things() {
    let Some(device) = support::device() else { return };
    let model = tissue();
    let down = [2e-3, 0.0, -0.012];
    let lying = Pose::rotation(Vector3::new(0.0, 1.6, 0.3));
    let cases = [
        ("sphere", Shape::Sphere { radius: 0.03 }, above(0.031)),
        ("capsule", Shape::Capsule { radius: 0.02, length: 0.05 }, above(0.021) * lying),
        ("box", Shape::Cuboid { size: [0.047, 0.043, 0.06] }, above(0.031)),
        ("cone", Shape::Cone { radius: 0.06, height: 0.08 }, above(2e-3)),
    ];
    for (what, shape, from) in cases {
        for friction in [0.0, 0.3] {
            let tool = rigid("tool", shape.clone(), moving(from, down));
            compare(&device, what, &model, &with(&model, vec![tool], friction), PLAIN);
        }
    }
}

/// A cube falls in a ball that turns.
#[test]
fn a_body_stays_within_a_shape_that_turns() {
    let Some(device) = support::device() else { return };
    let mut model = free_cube("tet4", elastic(neo_hookean()));
    model.bodies[0].damping = 5.0;
    let kind = LoadKind::Gravity { body: 0, acceleration: [0.0, 2.0, -9.81] };
    model.loads.push(load("gravity", kind, None));
    let corner = Vector3::repeat(0.11);
    let grid = Grid::sample([-corner, corner], 0.01, |x| x.norm() - 0.09).unwrap().with_thinnest(0.09);
    let centre = [0.5 * EDGE; 3];
    let start = Pose::translation(centre[0], centre[1], centre[2]);
    for (what, shape) in
        [("hollow grid", Shape::Grid(Arc::new(grid))), ("hollow", Shape::Sphere { radius: 0.09 })]
    {
        let trajectory = Trajectory::turn(start, [0.0, 0.6, 0.8], centre, 0.5, smooth(0.3));
        let skull = Rigid { inside: true, ..rigid("skull", shape, trajectory) };
        compare(&device, what, &model, &with(&model, vec![skull], 0.2), PLAIN);
    }
}

/// Jaws close on a cube by friction and lift it.
#[test]
fn jaws_close_on_a_cube() {
    let Some(device) = support::device() else { return };
    let mut model = free_cube("tet4", elastic(neo_hookean()));
    model.bodies[0].damping = 5.0;
    let half = 0.5 * EDGE;
    let jaw = |name: &str, side: f64| Rigid {
        jaw: Some(Jaw {
            tool: "grasper".into(),
            part: 0.5 * side,
            opening: (0.2, smooth(0.3)),
            place: Pose::translation(0.0, side * (half + 0.011), half),
            grip: None,
        }),
        ..rigid(
            name,
            Shape::Cuboid { size: [1.2 * EDGE, 0.02, 1.2 * EDGE] },
            moving(Pose::translation(half, half, -0.05), [0.0, 0.0, 0.02]),
        )
    };
    let contacts = with(&model, vec![jaw("upper", 1.0), jaw("lower", -1.0)], 0.5);
    compare(&device, "jaws", &model, &contacts, PLAIN);
}

/// A tool that points of faces touch is driven from the middle of a run on. The device takes rows in an order
/// that varies. It always finds the same bits, however the steps are divided.
#[test]
fn a_driven_tool_gives_the_same_bits_however_the_steps_are_divided() {
    let Some(device) = support::device() else { return };
    let model = tissue();
    let tool = rigid("tool", Shape::Sphere { radius: 0.03 }, moving(above(0.031), [2e-3, 0.0, -0.012]));
    let contacts = with(&model, vec![tool], 0.3);
    let step = 0.5 * step_of(&model);
    let drive = |time: f64, drive: &mut dyn FnMut(Leg)| {
        let from = contacts.rigids[0].at(time, None);
        drive(Leg::to_pose([time, time + 0.05], [from, above(0.022)]));
    };
    let run = |strides: &[u64]| {
        let mut state = State::<f32>::at_rest(&model);
        let of = (model.clone(), Arc::clone(&contacts));
        let mut stepper = GpuStepper::with_contacts(&device, of.0, of.1, step, None).unwrap();
        stepper.advance(&mut state, 100).unwrap();
        drive(state.time, &mut |leg| state.drive(0, leg));
        for &stride in strides {
            stepper.evaluate(&mut state, Wanted::Energies).unwrap();
            stepper.advance(&mut state, stride).unwrap();
        }
        stepper.evaluate(&mut state, Wanted::Everything).unwrap();
        (state.displacement, state.increment, stepper.contact_forces())
    };
    let whole = run(&[100]);
    assert_eq!(run(&[1, 2, 37, 60]), whole);
    let mut state = State::<f64>::at_rest(&model);
    let processor = CentralDifference::new(model.clone(), step).unwrap();
    let mut processor = processor.with_contacts(Arc::clone(&contacts));
    for number in 0..200 {
        if number == 100 {
            drive(state.time, &mut |leg| state.drive(0, leg));
        }
        processor.evaluate(&mut state).unwrap();
        processor.advance(&mut state);
    }
    let error = distance(&state.displacement, &double(&whole.0));
    println!("driven: displacement {error:.1e}");
    assert!(error <= 1e-5, "{error:.1e}");
}

/// A state in contact continues on the device without a read-back, then on the processor: the state holds no
/// contact data.
#[test]
fn a_state_in_contact_goes_from_the_processor_to_the_device_and_back() {
    let Some(device) = support::device() else { return };
    let model = tissue();
    let tool = rigid("tool", Shape::Sphere { radius: 0.03 }, moving(above(0.031), [2e-3, 0.0, -0.012]));
    let contacts = with(&model, vec![tool], 0.3);
    let step = 0.5 * step_of(&model);
    let on_processor = |state: &mut State<f32>| {
        let stepper = CentralDifference::new(model.clone(), step).unwrap();
        let mut stepper = stepper.with_contacts(Arc::clone(&contacts));
        for _ in 0..60 {
            stepper.evaluate(state).unwrap();
            stepper.advance(state);
        }
    };
    let mut whole = State::at_rest(&model);
    on_processor(&mut whole);
    let mut mixed = whole.clone();
    on_processor(&mut whole);
    on_processor(&mut whole);
    let of = (model.clone(), Arc::clone(&contacts));
    let mut stepper = GpuStepper::with_contacts(&device, of.0, of.1, step, None).unwrap();
    stepper.evaluate(&mut mixed, Wanted::Energies).unwrap();
    let read_backs = device.read_backs();
    while mixed.steps < 120 {
        let left = 120 - mixed.steps;
        stepper.advance_without_read_back(&mut mixed, left, Duration::from_secs(1)).unwrap();
    }
    assert_eq!(device.read_backs(), read_backs);
    stepper.bring_back(&mut mixed).unwrap();
    on_processor(&mut mixed);
    let error = distance(&double(&whole.displacement), &double(&mixed.displacement));
    println!("there and back: displacement {error:.1e}");
    assert!(error <= 1e-5, "{error:.1e}");
}

/// A cube of 55,566 tetrahedra, its base held. The test prints the time of a step alone, with a tool out of
/// reach, and with a tool pressed in. Only nodes, or points on faces too, touch this tool. `cargo test
/// --release -p pliant-gpu --test gpu the_cost_of_contact -- --include-ignored --nocapture`.
#[test]
#[ignore = "measures time"]
fn the_cost_of_contact() {
    let Some(device) = support::device() else { return };
    let model = large_cube(21);
    let step = 0.5 * step_of(&model);
    // Touches 1 mm of the top at once, and stays there.
    let pressed = |radius: f64| above(radius - 1e-3);
    let cases = [
        ("a tool out of reach", Some((0.08, above(0.2)))),
        ("a large tool", Some((0.08, pressed(0.08)))),
        ("a small tool out of reach", Some((5e-3, above(0.05)))),
        ("a small tool", Some((5e-3, pressed(5e-3)))),
    ];
    let mut alone = None;
    for (what, tool) in [("alone", None)].into_iter().chain(cases) {
        let mut stepper = match tool {
            None => GpuStepper::new(&device, model.clone(), step, None),
            Some((radius, pose)) => {
                let tool = rigid("tool", Shape::Sphere { radius }, Trajectory::fixed(pose));
                let contacts = with(&model, vec![tool], 0.3);
                GpuStepper::with_contacts(&device, model.clone(), contacts, step, None)
            }
        }
        .unwrap();
        let spent = time_of(&mut stepper, &model, what);
        let alone = *alone.get_or_insert(spent);
        println!("{what}: {:+.1} % of processor time", 100.0 * (spent / alone - 1.0));
    }
}

/// Processor time [s] of a step, the mean of 200 after some others.
pub(super) fn time_of(stepper: &mut GpuStepper, model: &Model, what: &str) -> f64 {
    let mut state = State::<f32>::at_rest(model);
    stepper.advance(&mut state, 20).unwrap();
    let (begun, before) = (Instant::now(), processor_time());
    stepper.advance(&mut state, 200).unwrap();
    stepper.evaluate(&mut state, Wanted::Energies).unwrap();
    let wall = begun.elapsed().as_secs_f64();
    let spent = [before, processor_time()].map(|time| time.unwrap_or(f64::NAN));
    let [wall, spent] = [wall, spent[1] - spent[0]].map(|time| time / 200.0);
    println!("{what}: {:.3} ms a step, {:.3} ms of processor time", 1e3 * wall, 1e3 * spent);
    spent
}

/// Processor time of this program [s], where Linux has it, in steps of a hundredth.
fn processor_time() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let (_, numbers) = stat.rsplit_once(')')?;
    let numbers: Vec<f64> = numbers.split_whitespace().filter_map(|number| number.parse().ok()).collect();
    // The state before them is a letter.
    Some((numbers.get(10)? + numbers.get(11)?) / 100.0)
}

/// A cube with `cells` cells of six tetrahedra along each edge, its base held.
fn large_cube(cells: u32) -> Model {
    let (points, tets) = tet_block([cells; 3], [EDGE; 3]);
    let mut model = Model::default();
    let body = model.add_body("cube", &points);
    let cells_of = Cells::tet4(tets, &model.rest);
    model.add_solid(Solid::new(body, elastic(neo_hookean()), cells_of));
    model.fix("base", (0..(cells + 1) * (cells + 1)).collect());
    model
}

#[test]
fn what_has_no_contact_is_refused_by_name() {
    let Some(device) = support::device() else { return };
    let model = tissue();
    let floor = rigid("floor", Shape::HalfSpace, Trajectory::fixed(Pose::identity()));
    let contacts = with(&model, vec![floor.clone()], 0.0);
    assert_eq!(processor_only(&contacts), None);
    let stepper = |contacts: Contacts, design| {
        GpuStepper::with_contacts(&device, model.clone(), Arc::new(contacts), 1e-3, design).err()
    };
    let blocks = stepper(Contacts::clone(&contacts), Some(Design::Blocks));
    assert_eq!(blocks, Some(GpuError::NoContact { design: "blocks".into() }));
    let place = Pose::identity();
    let gripping =
        Jaw { tool: "grasper".into(), part: 0.5, opening: (0.5, smooth(1.0)), place, grip: Some(0.1) };
    let limited = Rigid { trajectory: floor.trajectory.clone().limited(2.0), ..floor.clone() };
    let growing = Rigid { trajectory: floor.trajectory.clone().growing(0.01, smooth(1.0)), ..floor.clone() };
    let corner = |z: f64| Corner { at: [z, 0.1], rounding: 0.0 };
    let profile = Profile::new(vec![corner(0.0), corner(1.0)]).unwrap();
    let revolved = Rigid { shape: Shape::Revolved(Arc::new(profile)), ..floor.clone() };
    let jaw = Rigid { jaw: Some(gripping), ..floor };
    for (rigid, what) in [
        (jaw, "the ideal grip of `grasper`"),
        (limited, "the force limit of `floor`"),
        (growing, "the growth of `floor`"),
        (revolved, "the outline of `floor`"),
    ] {
        let contacts = Contacts { rigids: vec![rigid], ..Contacts::clone(&contacts) };
        assert_eq!(stepper(contacts, None), Some(GpuError::Unsupported { what: what.into() }));
    }
}
