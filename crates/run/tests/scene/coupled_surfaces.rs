//! Contact between participants: an explicit solid and implicit shells (S14), from the text of a scene to its
//! outputs, and refusals.

use nalgebra::UnitQuaternion;
use pliant_sim::Simulation;
use pliant_sim::contact::pose::Pose;
use pliant_testing::scenes::{last_row_in, resumes, run, world};

/// A plate of 353 mN, of a shell, a little above a held block of soft tissue.
pub(super) fn pressed(step: f64, until: f64, more: &str) -> String {
    format!(
        "[scene]\nuntil = {until}\ngravity = [0, 0, -9.81]\n\
         [participant.walls]\nbodies = ['plate']\nsolver = 'implicit'\nstep = {step}\n\
         [law.tissue]\ntype = 'neo-hookean'\nyoung-modulus = 5e3\npoisson-ratio = 0.4\n\
         [law.wall]\ntype = 'neo-hookean'\nyoung-modulus = 1e6\npoisson-ratio = 0.4\n\
         [body.block]\nmesh = {{ block = {{ size = [0.04, 0.04, 0.02], cells = [8, 8, 4] }}, as = 'hexes' }}\n\
         law = 'tissue'\ndensity = 1000\ndamping = 20\n\
         [body.plate]\nmodel = 'shell'\nmesh = {{ plate = {{ size = [0.03, 0.03], cells = [6, 6] }}, at = [0.0051, 0.0052, 0.0212] }}\n\
         law = 'wall'\ndensity = 20000\nthickness = 0.002\n\
         [constraint.base]\ntype = 'fix'\nbody = 'block'\nnodes = {{ set = 'z-min' }}\n\
         [contact.press]\nbetween = ['block', 'plate']\nfriction = 0.3\n\
         [output.history]\ntype = 'csv'\nevery = 0.02\nreactions = ['base']\n\
         probes.middle = {{ on = 'plate', at = [0.0201, 0.0202, 0.0212], data = ['displacement'] }}\n\
         probes.top = {{ on = 'block', at = [0.02, 0.02, 0.02], data = ['displacement'] }}\n{more}"
    )
}

const WEIGHT: f64 = 0.03 * 0.03 * 0.002 * 20_000.0 * 9.81;
const BLOCK: f64 = 0.04 * 0.04 * 0.02 * 1000.0 * 9.81;

/// Values of a column of `history.csv` from a time [s] on.
pub(super) fn column(out: &std::path::Path, name: &str, from: f64) -> Vec<f64> {
    let text = std::fs::read_to_string(out.join("history.csv")).unwrap();
    let mut rows = text.lines();
    let head: Vec<&str> = rows.next().unwrap().split(',').collect();
    let at = head.iter().position(|&known| known == name).unwrap();
    let time = head.iter().position(|&known| known == "time").unwrap();
    let rows = rows.map(|row| row.split(',').map(|x| x.parse::<f64>().unwrap()).collect::<Vec<_>>());
    rows.filter(|row| row[time] >= from).map(|row| row[at]).collect()
}

/// The plate lies on the block with its weight, at its half thickness, for 10 s; half of the step changes
/// that little.
#[test]
fn a_plate_lies_on_a_block_of_another_participant() {
    let mut depths = Vec::new();
    for (step, until) in [(0.01, 10.0), (0.005, 3.0)] {
        let out = tempfile::tempdir().unwrap();
        let summary = run(&pressed(step, until, ""), &out.path().join("out"));
        let out = out.path().join("out");
        let row = last_row_in(&out);
        let [guests] = &summary.guests[..] else { panic!("{:?}", summary.guests) };
        let (contact, base) = (row["contact.press.z"], row["reaction.base.z"]);
        let (plate, top) = (row["probe.middle.displacement.z"], row["probe.top.displacement.z"]);
        println!(
            "{contact} N of {WEIGHT} N, {base} N on the base; plate at {plate} m, top at {top} m; {guests:?}"
        );
        assert!((contact / WEIGHT - 1.0).abs() < 0.02, "{contact}");
        assert!((base / (WEIGHT + BLOCK) - 1.0).abs() < 0.02, "{base}");
        let [on_block, on_plate] = guests.forces;
        assert!((on_plate[2] / -on_block[2] - 1.0).abs() < 0.02, "{guests:?}");
        // The plate keeps half of its thickness.
        assert!((plate + 0.0002 - top).abs() < 5e-5, "{plate} {top}");
        // No trembling grows.
        let late = column(&out, "contact.press.z", 0.8 * until);
        let spread = late.iter().fold(0.0_f64, |most, force| most.max((force / WEIGHT - 1.0).abs()));
        assert!(spread < 0.02, "{spread}");
        depths.push(plate);
    }
    assert!((depths[0] / depths[1] - 1.0).abs() < 0.03, "{depths:?}");
}

#[test]
fn a_resumed_run_of_participants_in_contact_has_the_same_bits() {
    resumes(&pressed(0.01, 1.0, "[run]\ncheckpoint = { every = 0.4 }\n"));
}

/// A step in contact is one step from the start on, and a tool that was driven after a look goes where it is
/// driven.
#[test]
fn a_tool_on_a_guest_goes_where_it_is_driven() {
    let ball = "[tool.ball]\nshape = { sphere = { radius = 0.01 } }\nat = [0.02, 0.02, 0.04]\n\
                [contact.tap]\nbetween = ['plate', 'ball']\n";
    let world = world(&pressed(0.01, 1.0, ball)).unwrap();
    let mut simulation = world.simulation().unwrap();
    let start = simulation.state().unwrap();
    for _ in 0..2 {
        simulation.step(1).unwrap();
        assert!((simulation.time() - 0.01).abs() < 1e-12, "{}", simulation.time());
        simulation.restore(start.clone()).unwrap();
    }
    simulation.step(1).unwrap();
    let ball = |simulation: &mut Simulation| {
        simulation.frame().unwrap();
        simulation.tool("ball").unwrap().pose.translation.vector
    };
    let mut place = ball(&mut simulation);
    place.z -= 0.002;
    simulation.drive("ball", Pose::from_parts(place.into(), UnitQuaternion::identity()), 0.0).unwrap();
    simulation.step(2).unwrap();
    simulation.step(1).unwrap();
    assert!((ball(&mut simulation) - place).norm() < 1e-9, "{:?}", ball(&mut simulation));
}

/// A block that is thrown at a free plate of another participant gives it the momentum that it loses.
#[test]
fn momentum_passes_from_one_participant_to_the_other() {
    let text = pressed(0.002, 0.1, "")
        .replace("gravity = [0, 0, -9.81]\n", "")
        .replace("[constraint.base]\ntype = 'fix'\nbody = 'block'\nnodes = { set = 'z-min' }\n", "")
        .replace("damping = 20\n", "velocity = [0, 0, 0.05]\n")
        .replace("reactions = ['base']\n", "energy = true\n")
        .replace("every = 0.02", "every = 0.1");
    let world = world(&text).unwrap();
    let mut simulation = world.simulation().unwrap();
    let momentum = |frame: &pliant_sim::Frame<'_>| -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (part, now) in frame.parts() {
            let mass = |node: usize| match part.method.bodies() {
                Some(bodies) => bodies.model.mass[node],
                None => part.model.inertia(node),
            };
            for node in 0..part.model.node_count() {
                let velocity = now.velocity(node);
                (0..3).for_each(|c| sum[c] += mass(node) * velocity[c]);
            }
        }
        sum
    };
    let first = momentum(&simulation.frame().unwrap());
    simulation.run(0.1, |_| ()).unwrap();
    let last = momentum(&simulation.frame().unwrap());
    let plate = simulation.frame().unwrap().velocities("plate").unwrap();
    println!("{first:?} {last:?}, plate at {:?} m/s", plate[0]);
    assert!(plate[0][2] > 0.01, "{plate:?}");
    (0..3).for_each(|c| assert!((last[c] - first[c]).abs() < 0.01 * first[2], "{first:?} {last:?}"));
}

/// Solids whose equations are solved overlap, too, where no distance is to be kept.
#[test]
fn solids_of_two_participants_that_overlap_are_refused() {
    let text = pressed(0.01, 1.0, "")
        .replace(
            "model = 'shell'\nmesh = { plate = { size = [0.03, 0.03], cells = [6, 6] }, at = [0.0051, 0.0052, 0.0212] }",
            "mesh = { block = { size = [0.03, 0.03, 0.01], cells = [6, 6, 2] }, as = 'tets', at = [0.0051, 0.0052, 0.0052] }",
        )
        .replace("thickness = 0.002\n", "");
    assert!(text.contains("'tets'"));
    let message = world(&text).err().unwrap();
    assert!(message.contains("overlap at the start") && message.contains("m deep"), "{message}");
}

#[test]
fn contacts_of_participants_that_cannot_be_are_refused_with_the_line() {
    let message = |text: &str| world(text).err().unwrap_or_else(|| panic!("accepted:\n{text}"));
    let plain = pressed(0.01, 1.0, "");
    for (from, to, pieces) in [
        ("0.0212]", "0.015]", ["overlap at the start", "move one of them"]),
        ("solver = 'implicit'\nstep = 0.01", "", ["is a shell", ""]),
        (
            "friction = 0.3",
            "separate = true",
            ["`separate` is for bodies of one participant", "move one of the bodies"],
        ),
        (
            "friction = 0.3",
            "barrier-distance = 1e-4",
            ["`barrier-distance` of a contact is for bodies of one participant", "leave it out"],
        ),
        (
            "[scene]",
            "[run]\nsolver = 'quasi-static'\nload-steps = 4\n[scene]",
            [
                "two participants whose solvers cannot share a contact",
                "`implicit` ones, or put both bodies into one participant",
            ],
        ),
        ("['block', 'plate']", "['block', 'plat']", ["there is no body, obstacle or tool `plat`", ""]),
        ("[scene]", "[run]\ndevice = 'gpu'\n[scene]", ["contact between participants", "cpu"]),
    ] {
        let text = plain.replace(from, to);
        assert_ne!(text, plain, "{from}");
        let message = message(&text);
        assert!(pieces.iter().all(|piece| message.contains(piece)), "{message}");
    }
}
