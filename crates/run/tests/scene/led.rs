//! Tools that a program leads at each step, as a mouse or a haptic device does, go as if they were led once.

use pliant_sim::Simulation;
use pliant_sim::contact::pose::Pose;
use pliant_testing::Random;
use pliant_testing::scenes::world;

/// A block or a sheet that is held at its base, 10 mm below a ball.
fn scene(run: &str, body: &str, contact: &str) -> String {
    format!(
        "[scene]\nuntil = 10\n[run]\n{run}\n[law.tissue]\ntype = \"neo-hookean\"\nyoung-modulus = 2e4\npoisson-ratio = 0.4\n\
         [body.b]\nlaw = \"tissue\"\ndensity = 1000\ndamping = 5\n{body}\n\
         [tool.ball]\nshape = {{ sphere = {{ radius = 0.02 }} }}\nat = [0.03, 0.03, 0.09]\n\
         [contact.press]\nbetween = [\"b\", \"ball\"]\n{contact}"
    )
}

const BLOCK: &str = "mesh = { block = { size = [0.06, 0.06, 0.06] }, edge = 0.015 }\n\
                     [constraint.base]\ntype = \"fix\"\nbody = \"b\"\nnodes = { set = \"z-min\" }";
const SHEET: &str = "model = \"shell\"\nthickness = 2e-3\n\
                     mesh = { plate = { size = [0.06, 0.06], cells = [4, 4] }, at = [0, 0, 0.06] }\n\
                     [constraint.base]\ntype = \"fix\"\nbody = \"b\"\n\
                     nodes = { union = [{ set = \"x-min\" }, { set = \"x-max\" }, { set = \"y-min\" }, { set = \"y-max\" }] }";
/// Time [s] to a goal.
const WITHIN: f64 = 0.1;
const BARRIER: &str = "barrier-distance = 1e-3";

fn ways() -> Vec<(&'static str, &'static str, &'static str)> {
    vec![
        ("solver = \"explicit\"", BLOCK, ""),
        ("solver = \"explicit\"", BLOCK, "friction = 0.3"),
        ("solver = \"implicit\"\nstep = 5e-3", BLOCK, BARRIER),
        ("solver = \"implicit\"\nstep = 5e-3", BLOCK, "barrier-distance = 1e-3\nfriction = 0.3"),
        ("solver = \"implicit\"\nintegrator = \"bdf2\"\nstep = 5e-3", BLOCK, BARRIER),
        ("solver = \"implicit\"\nstep = 5e-3", SHEET, BARRIER),
        ("solver = \"static\"\nstep = 5e-3", BLOCK, BARRIER),
    ]
}

fn height(simulation: &mut Simulation) -> f64 {
    simulation.frame().unwrap().tool("ball").unwrap().pose.translation.z
}

/// A tool that gets the same goal again at each step keeps its place and pace, and meets the same force.
#[test]
fn a_tool_that_is_led_again_goes_on() {
    let goal = Pose::translation(0.03, 0.03, 0.072);
    for (run, body, contact) in ways() {
        let forces = [false, true].map(|again| {
            let mut simulation = world(&scene(run, body, contact)).unwrap().simulation().unwrap();
            simulation.drive("ball", goal, WITHIN).unwrap();
            while simulation.time() < 0.9 * WITHIN {
                simulation
                    .step(1)
                    .unwrap_or_else(|failure| panic!("{run}, {contact}, led again {again}: {failure}"));
                let before = height(&mut simulation);
                let even = 0.09 - 0.018 * simulation.time() / WITHIN;
                assert!(
                    (before - even).abs() < 0.018 * 0.005 / WITHIN + 1e-9,
                    "{run}, {contact}: {before} m for {even} m"
                );
                if again {
                    simulation.drive("ball", goal, WITHIN - simulation.time()).unwrap();
                    let after = height(&mut simulation);
                    // The step under way of an explicit solver ends where it would have.
                    let ahead = if run.contains("explicit") {
                        0.018 * simulation.step_length() / WITHIN
                    } else {
                        0.0
                    };
                    assert!((after - before).abs() < 1.01 * ahead + 1e-12, "{run}: {before} to {after} m");
                }
            }
            simulation.frame().unwrap().tool("ball").unwrap().force[2]
        });
        let [once, again] = forces;
        assert!(once > 0.05 && (again / once - 1.0).abs() < 0.02, "{run}, {contact}: {forces:?} N");
    }
}

/// Goals that change at each step, on and in the body.
#[test]
fn a_tool_that_is_dragged_about_ends_no_session() {
    for (run, body, contact) in ways().into_iter().filter(|(run, ..)| !run.contains("static")) {
        for seed in 0..4 {
            let mut random = Random::new(seed);
            let mut simulation = world(&scene(run, body, contact)).unwrap().simulation().unwrap();
            while simulation.time() < 0.5 {
                let [x, y, z] = [0.01, 0.01, 0.006].map(|reach| reach * random.half() * 2.0);
                simulation.drive("ball", Pose::translation(0.03 + x, 0.03 + y, 0.084 + z), 0.05).unwrap();
                let steps = if run.contains("explicit") { 25 } else { 1 };
                simulation
                    .step(steps)
                    .unwrap_or_else(|failure| panic!("{run}, {contact}, {seed}: {failure}"));
            }
        }
    }
}
