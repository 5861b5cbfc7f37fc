//! A finger that presses 15 mm into a liver and sweeps over it at 100 mm/s, again and again. No node goes far
//! into the finger, the force does not jump, and energies stay sound.

use std::fmt::Write;
use std::path::Path;

use nalgebra::Vector3;
use pliant_contact::pose::Stance;
use pliant_format::Scene;
use pliant_format::source::Source;
use pliant_scene::World;
use pliant_validation::claim;

/// Seconds from one press to the next.
const PERIOD: f64 = 3.0;

/// Plays some presses. The force may change by at most `most` of its peak within a millisecond.
fn check(presses: u32, most: f64) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/palpation");
    let [scene, finger] =
        ["scene.toml", "finger.csv"].map(|name| std::fs::read_to_string(folder.join(name)).unwrap());
    let mut poses = String::from("t,x,y,z,qw,qx,qy,qz\n");
    for press in 0..presses {
        for row in finger.lines().skip(2) {
            let (time, pose) = row.split_once(',').unwrap();
            let time: f64 = time.parse().unwrap();
            writeln!(poses, "{},{pose}", time + PERIOD * f64::from(press)).unwrap();
        }
    }
    let place = tempfile::tempdir().unwrap();
    std::fs::write(place.path().join("finger.csv"), poses).unwrap();
    let until = PERIOD * f64::from(presses);
    let text = scene.replace("until = 3.0", &format!("until = {until}"));
    let source = Source::parse("scene.toml", text).unwrap();
    let scene =
        Scene::from_source(source, place.path().to_owned()).unwrap_or_else(|e| panic!("{}", e.plain()));
    let world = World::new(&scene).unwrap_or_else(|e| panic!("{}", e.plain()));

    let part = &world.participants[0].built;
    let contacts = part.contacts.as_ref().unwrap();
    let number = contacts.rigids.iter().position(|rigid| rigid.name == "finger").unwrap();
    let rigid = &contacts.rigids[number];
    let feels = contacts.contacts.iter().find(|contact| contact.name == "feels").unwrap();
    let points = &part.bodies[0].mesh.points;
    let (mut deepest, mut balance, mut touched) = (0.0_f64, 0.0_f64, 0);
    let mut largest = [0.0_f64; 2];
    let (mut milliseconds, mut before, mut peak, mut jump) = (0.0, Vector3::zeros(), 0.0_f64, 0.0_f64);
    let mut simulation = world.simulation().unwrap();
    let played = simulation.run(until, |frame| {
        let stance = Stance::at(frame.tool("finger").unwrap().pose);
        let displacements = frame.displacements("liver").unwrap();
        for &node in &feels.surface.nodes {
            let at = points[node as usize] + Vector3::from(displacements[node as usize]);
            deepest = deepest.max(-rigid.near(&stance, &at).distance);
        }
        let energies = frame.energies();
        // In the first steps there is hardly any energy.
        if frame.time() > 0.01 {
            balance = balance.max(energies.balance);
        }
        let force = Vector3::from(frame.contact_force("feels").unwrap());
        touched += u32::from(force != Vector3::zeros());
        if frame.time() >= 1e-3 * milliseconds {
            (peak, jump) = (peak.max(force.norm()), jump.max((force - before).norm()));
            (milliseconds, before) = (milliseconds + 1.0, force);
        }
        let half = usize::from(frame.time() > 0.5 * until);
        largest[half] = largest[half].max(energies.kinetic);
    });
    played.unwrap_or_else(|failure| panic!("{}", failure.message));
    println!("{until} s: in touch in {touched} steps, largest kinetic energy {largest:?} J in each half");
    assert!(touched > 100);
    claim(&format!("palpation of {until} s: a node in the finger, over its radius"), deepest / 0.008, 0.05);
    let change = "change of the force within 1 ms, over its peak";
    claim(&format!("palpation of {until} s: {change}"), jump / peak, most);
    claim(&format!("palpation of {until} s: imbalance of energies in any step"), balance, 0.01);
    claim(
        &format!("palpation of {until} s: kinetic energy in the second half over that in the first, less 1"),
        largest[1] / largest[0] - 1.0,
        0.1,
    );
}

#[test]
fn two_presses_keep_energies_sound() {
    check(2, 0.1);
}

#[test]
#[ignore = "a minute of simulated time"]
fn a_minute_of_presses_keeps_energies_sound() {
    // A node that strikes the finger in a single step changes the force by more than a tenth.
    check(20, 0.15);
}
