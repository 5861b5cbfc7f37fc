//! Graspers: jaws that hold by friction or as if tied, by the text of a scene and by code; tools that are
//! driven.

use pliant_sim::Simulation;
use pliant_sim::contact::pose::Pose;
use pliant_testing::scenes::{last_row, resumes, run, scene, world};

/// A flap of 30 × 6 × 20 mm on a floor, and jaws around it. The jaws close in 0.3 s and go up by 30 mm until
/// 0.8 s.
fn flap(run: &str, tool: &str, friction: f64, until: f64) -> String {
    format!(
        "[scene]\nuntil = {until}\ngravity = [0, 0, -9.81]\n[run]\n{run}\n\
         [law.tissue]\ntype = 'neo-hookean'\nyoung-modulus = 2e4\npoisson-ratio = 0.4\n\
         [body.flap]\nmesh = {{ block = {{ size = [0.03, 0.006, 0.02], cells = [10, 2, 7] }}, as = 'hexes' }}\n\
         law = 'tissue'\nelement = 'hex8-full'\ndensity = 1000\ndamping = 40\n\
         [obstacle.floor]\nshape = 'half-space'\n\
         [tool.grasper]\nshape = {{ jaws = {{ length = 0.04, width = 0.012, thickness = 0.004 }} }}\n\
         at = [0.015, 0.003, 0.045]\nturn = [3.141592653589793, 0, 0]\n{tool}\n\
         [contact.stands]\nbetween = ['flap', 'floor']\nfriction = 0.3\n\
         [contact.holds]\nbetween = ['flap', 'grasper']\nfriction = {friction}\n\
         [output.history]\ntype = 'csv'\nevery = {until}\n\
         probes.middle = {{ on = 'flap', at = [0.015, 0.003, 0.01], data = ['displacement'] }}\n"
    )
}

const CLOSES: &str = "opening = { angle = 0.4, curve = { table = [[0, 1], [0.3, 0.45]] } }\n\
                      by = [0, 0, 0.03]\nfrom = 0.4\nto = 0.8\n";
const WEIGHT: f64 = 0.03 * 0.006 * 0.02 * 1000.0 * 9.81;

/// Friction holds what jaws squeeze: it goes up with them, and both carry its weight. Without friction it
/// slips out.
#[test]
fn jaws_lift_a_flap_by_friction() {
    for precision in ["", "precision = 'single'"] {
        let row = last_row(&flap(precision, CLOSES, 0.8, 1.2));
        let (up, force) = (row["probe.middle.displacement.z"], row["tool.grasper.z"]);
        let [upper, lower] =
            ["upper", "lower"].map(|jaw| row[&format!("contact.holds.flap-grasper.{jaw}.y")]);
        println!(
            "lifted by {up} m, {force} N on the jaws, weight {WEIGHT} N; squeezed by {upper} and {lower} N"
        );
        assert!((up - 0.03).abs() < 0.002, "{up}");
        assert!((-force / WEIGHT - 1.0).abs() < 0.02, "{force} N");
        assert!((upper + lower).abs() < 0.02 * upper.abs() && upper.abs() > 5.0 * WEIGHT, "{upper}, {lower}");
        assert!(row["contact.stands.z"].abs() < 1e-9);
    }
    let slipped = last_row(&flap("", CLOSES, 0.0, 1.2));
    assert!(slipped["probe.middle.displacement.z"] < 0.005, "{slipped:?}");
}

/// An ideal grip needs no friction; the flap falls once the jaws open.
#[test]
fn jaws_hold_as_if_tied_until_they_open() {
    let tool = format!("ideal-grip = 0.2\n{CLOSES}");
    let row = last_row(&flap("", &tool, 0.0, 1.2));
    let (up, force) = (row["probe.middle.displacement.z"], row["tool.grasper.z"]);
    println!("lifted by {up} m, {force} N on the jaws, weight {WEIGHT} N");
    assert!((up - 0.03).abs() < 0.001, "{up}");
    assert!((-force / WEIGHT - 1.0).abs() < 0.01, "{force} N");
    let opens = tool.replace("[0.3, 0.45]]", "[0.3, 0.45], [0.9, 0.45], [1, 1]]");
    let row = last_row(&flap("", &opens, 0.0, 1.6));
    assert!(row["probe.middle.displacement.z"] < 0.001, "{row:?}");
    assert!(
        (-row["contact.stands.z"] / WEIGHT - 1.0).abs() < 0.02 && row["tool.grasper.z"] == 0.0,
        "{row:?}"
    );
}

/// The checkpoint holds the nodes that jaws hold.
#[test]
fn a_run_with_closed_jaws_goes_on_in_the_same_bits() {
    resumes(&flap(
        "step = 2e-4\ncheckpoint = { every = 0.1 }",
        &format!("ideal-grip = 0.2\n{CLOSES}"),
        0.0,
        1.0,
    ));
}

/// A program does the same work: it closes the jaws and drives them up. A snapshot on the way leads to the
/// same bits.
#[test]
fn a_program_closes_jaws_and_drives_them() {
    let text = flap("", "opening = { angle = 0.4, curve = 'hold' }\nideal-grip = 0.2", 0.0, 2.0);
    let world = world(&text).unwrap();
    let start = Pose::new([0.015, 0.003, 0.045].into(), [std::f64::consts::PI, 0.0, 0.0].into());
    let up = Pose::translation(0.0, 0.0, 0.03) * start;
    let work = |mut simulation: Simulation| {
        let there = simulation.drive("grasper", up, 0.4).unwrap();
        assert!((there - simulation.time() - 0.4).abs() < 1e-9);
        simulation.run(there + 0.4, |_| ()).unwrap();
        let print = simulation.fingerprint();
        let frame = simulation.frame().unwrap();
        let (tool, moved) = (frame.tool("grasper").unwrap(), frame.displacements("flap").unwrap());
        let lowest = moved.iter().map(|u| u[2]).fold(f64::INFINITY, f64::min);
        assert!(
            (tool.pose.inverse() * up).translation.vector.norm() < 1e-12
                && (tool.opening - 0.18).abs() < 1e-12
        );
        assert!((-tool.force[2] / WEIGHT - 1.0).abs() < 0.02 && lowest > 0.025, "{tool:?}, {lowest} m");
        print
    };
    let mut simulation = world.simulation().unwrap();
    assert!((simulation.frame().unwrap().tool("grasper").unwrap().opening - 0.4).abs() < 1e-12);
    let closed = simulation.open("grasper", 0.18, 0.3).unwrap();
    simulation.run(closed, |_| ()).unwrap();
    simulation.step(1).unwrap();
    let bytes = simulation.encode().unwrap();
    let state = simulation.state().unwrap();
    let decoded = pliant_sim::State::decode(simulation.world(), &bytes).unwrap();
    let again = |state| Simulation::resumed(simulation.world().clone(), state).unwrap();
    let prints = [again(state), again(decoded)].map(work);
    assert_eq!([work(simulation); 2], prints);
}

/// Pose and opening have a goal each, in whatever order they are given; a snapshot on the way leads to the
/// same bits.
#[test]
fn a_grasper_moves_while_it_closes() {
    let text = flap("", "opening = { angle = 0.4, curve = 'hold' }", 0.0, 2.0);
    let world = world(&text).unwrap();
    let start = Pose::new([0.015, 0.003, 0.045].into(), [std::f64::consts::PI, 0.0, 0.0].into());
    let goal = Pose::translation(0.0, 0.0, 0.03) * start;
    let lead = |order: usize, simulation: &mut Simulation| match order {
        0 => {
            simulation.drive("grasper", goal, 0.1).unwrap();
            simulation.open("grasper", 0.2, 0.1).unwrap()
        }
        1 => {
            simulation.open("grasper", 0.2, 0.1).unwrap();
            simulation.drive("grasper", goal, 0.1).unwrap()
        }
        _ => simulation.lead("grasper", Some(goal), Some(0.2), 0.1).unwrap(),
    };
    let prints = [0, 1, 2].map(|order| {
        let mut simulation = world.simulation().unwrap();
        let there = lead(order, &mut simulation);
        simulation.run(0.5 * there, |_| ()).unwrap();
        let tool = simulation.frame().unwrap().tool("grasper").unwrap();
        let part = simulation.time() / there;
        assert!((tool.pose.translation.z - 0.045 - 0.03 * part).abs() < 1e-9, "{tool:?}");
        assert!((tool.opening - 0.4 + 0.2 * part).abs() < 1e-9, "{tool:?}");
        let bytes = simulation.encode().unwrap();
        let state = pliant_sim::State::decode(simulation.world(), &bytes).unwrap();
        let mut simulation = Simulation::resumed(simulation.world().clone(), state).unwrap();
        simulation.run(there, |_| ()).unwrap();
        let tool = simulation.frame().unwrap().tool("grasper").unwrap();
        assert!((tool.pose.inverse() * goal).translation.vector.norm() < 1e-12);
        assert!((tool.opening - 0.2).abs() < 1e-12);
        simulation.fingerprint()
    });
    assert!(prints.iter().all(|print| *print == prints[0]), "{prints:?}");
}

/// A tool arrives later if it cannot be there in time without passing over nodes. Unknown tools and numbers
/// that are not finite are refused.
#[test]
fn impossible_goals_are_told() {
    let world = world(&flap("", "opening = { angle = 0.4, curve = 'hold' }", 0.0, 2.0)).unwrap();
    let mut simulation = world.simulation().unwrap();
    let step = simulation.step_length();
    let far = Pose::translation(5.0, 0.0, 0.0);
    let arrival = simulation.drive("grasper", far, 0.0).unwrap();
    // 256 times half of the thickness of 4 mm in a step, of which the way of the jaws may need one half.
    let least = 2.0 * 5.0 / (256.0 * 0.002) * step;
    assert!((1.0..1.1).contains(&(arrival / least)), "{arrival} s instead of {least} s");
    let other = simulation.drive("graspr", far, 0.1).unwrap_err().message;
    assert!(other.contains("`graspr`") && other.contains("floor, grasper"), "{other}");
    let nan = Pose::translation(f64::NAN, 0.0, 0.0);
    for refused in [simulation.drive("grasper", nan, 0.1), simulation.open("grasper", 0.1, f64::INFINITY)] {
        let message = refused.unwrap_err().message;
        assert!(message.contains("not finite"), "{message}");
    }
}

#[test]
fn jaws_that_cannot_be_are_refused_with_their_line() {
    for (tool, pieces) in [
        ("inside = true", ["no body is inside of a jaw", "scene.toml:22:"]),
        ("opening = { angle = -1 }", ["angle", "opening"]),
        ("ideal-grip = -1", ["ideal-grip", "-1"]),
    ] {
        let error = scene(&flap("", tool, 0.0, 1.0)).err().or_else(|| world(&flap("", tool, 0.0, 1.0)).err());
        let error = error.unwrap_or_else(|| panic!("`{tool}` is taken"));
        pieces.iter().for_each(|piece| assert!(error.contains(piece), "{error}"));
    }
    let ball = flap("", "opening = { angle = 0.4 }", 0.0, 1.0)
        .replace("jaws = { length = 0.04, width = 0.012, thickness = 0.004 }", "sphere = { radius = 0.004 }");
    let error = world(&ball).unwrap_err();
    assert!(error.contains("`opening` is for a tool with jaws"), "{error}");
}

/// Cells of reduced integration, squeezed to half: forces carry predictions deep into the jaws, past their
/// edges, and no node is thrown.
#[test]
fn jaws_that_squeeze_hard_keep_the_energies() {
    let text = flap("", &CLOSES.replace("0.45", "0.35"), 0.8, 1.0).replace("element = 'hex8-full'\n", "");
    let out = tempfile::tempdir().unwrap();
    let balance = run(&text, out.path()).energy_balance.unwrap();
    println!("energies balance to {balance}");
    assert!(balance < 0.01, "{balance}");
}
