//! The torque that tools feel, with impulses of explicit steps and with barriers.

use pliant_sim::ToolNow;
use pliant_sim::contact::pose::Pose;
use pliant_testing::scenes;

/// Returns a tool that is pressed 4 mm into a block off its middle and rests there, with its force and
/// torque.
fn pressed(shape: &str, run: &str) -> ToolNow {
    let text = format!(
        r#"[scene]
until = 1
[run]
{run}
[law.tissue]
type = "neo-hookean"
young-modulus = 10e3
poisson-ratio = 0.3
[body.block]
mesh = {{ block = {{ size = [0.1, 0.05, 0.05] }}, edge = 0.0125, as = "tets" }}
law = "tissue"
density = 1000
damping = 50
[constraint.base]
type = "fix"
body = "block"
nodes = {{ set = "z-min" }}
[tool.tip]
shape = {shape}
at = [0.06, 0.03, 0.0615]
[contact.press]
between = ["block", "tip"]
"#
    );
    let mut simulation = scenes::world(&text).unwrap().simulation().unwrap();
    simulation.drive("tip", Pose::translation(0.06, 0.03, 0.0575), 0.2).unwrap();
    simulation.run(0.5, |_| ()).unwrap();
    simulation.frame().unwrap().tool("tip").unwrap()
}

#[test]
fn a_ball_without_friction_feels_no_torque_and_a_block_that_of_its_corner() {
    const IMPLICIT: &str = "solver = 'implicit'\nstep = 5e-3";
    for run in ["", IMPLICIT] {
        let ToolNow { force, torque, .. } = pressed("{ sphere = { radius = 0.01 } }", run);
        let torque = torque.unwrap();
        // Its last motion moves the nodes by some micrometres in a step.
        assert!(
            force[2] > 0.5 && torque.iter().all(|m| m.abs() < 1e-4 * 0.01 * force[2]),
            "{force:?} {torque:?}"
        );
    }
    let [explicit, implicit] =
        ["", IMPLICIT].map(|run| pressed("{ box = { size = [0.02, 0.02, 0.02] } }", run));
    // The nodes under it lie toward −y and +x of its middle: they turn it about −x and −y.
    let [a, b] = [explicit, implicit].map(|result| result.torque.unwrap().map(|m| m / result.force[2]));
    for c in 0..2 {
        // Barriers act from farther away than impulses.
        assert!(a[c] < -1e-3 && (a[c] - b[c]).abs() < 0.2 * a[c].abs(), "{a:?} m, {b:?} m");
    }
}
