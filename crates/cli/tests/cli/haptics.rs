//! `pliant haptics` through the real binary. The machine may be busy, so no time is checked.

use crate::support::Workshop;

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/palpation");

/// A finger that presses and holds: the device feels what the simulation finds.
#[test]
fn a_trace_presses_a_liver() {
    let workshop = Workshop::new("");
    workshop.write(
        "press.csv",
        "t,x,y,z,qw,qx,qy,qz\n0,-0.03,0,0.09,1,0,0,0\n0.5,-0.03,0,0.074,1,0,0,0\n1.5,-0.03,0,0.074,1,0,0,0\n",
    );
    let trace = workshop.path("press.csv");
    let output = workshop.pliant(&["haptics", SCENE, "--replay", trace.to_str().unwrap()]);
    assert_eq!(output.code, 0, "{}", output.err);
    for word in ["force period", "device to force", "largest jump", "energy observed", "stiffest coupling"] {
        assert!(output.out.contains(word), "{}", output.out);
    }
    let last = output.out.lines().find(|line| line.starts_with("last force")).unwrap();
    let triples = last.split('(').skip(1).map(|text| text.split(')').next().unwrap());
    let triples: Vec<Vec<f64>> =
        triples.map(|text| text.split(", ").map(|x| x.parse().unwrap()).collect()).collect();
    let (device, simulated) = (triples[0][2], triples[1][2]);
    // The tissue still relaxes, and the last model may be some periods old on a busy machine.
    assert!(device > 0.3 && (device / simulated - 1.0).abs() < 0.1, "{last}");
}

/// Thrusts of 2 m/s, deeper than the body is thick: no session ends, and the force does not jump.
#[test]
fn thrusts_end_no_session() {
    const SCENE: &str = "[scene]\nuntil = 10\n[run]\nSOLVER\nthreads = 1\n\
        [law.tissue]\ntype = 'neo-hookean'\nyoung-modulus = 2e4\npoisson-ratio = 0.4\n\
        [body.block]\nmesh = { block = { size = [0.06, 0.06, 0.06] }, edge = 0.03 }\nlaw = 'tissue'\ndensity = 1000\ndamping = 5\n\
        [constraint.base]\ntype = 'fix'\nbody = 'block'\nnodes = { set = 'z-min' }\n\
        [tool.ball]\nshape = { sphere = { radius = 0.02 } }\nat = [0.03, 0.03, 0.1]\n\
        [contact.press]\nbetween = ['block', 'ball']\nWITH\n";
    for (solver, with) in
        [("solver = 'explicit'", ""), ("solver = 'implicit'\nstep = 5e-3", "barrier-distance = 1e-3")]
    {
        let workshop = Workshop::new(&SCENE.replace("SOLVER", solver).replace("WITH", with));
        let mut trace = String::from("t,x,y,z,qw,qx,qy,qz\n");
        for k in 0..12 {
            // Down by 0.12 m in 60 ms, and up again.
            let (t, x) = (0.2 * f64::from(k), 0.03 + 0.01 * f64::from(k % 3 - 1));
            trace += &format!("{t},{x},0.03,0.1,1,0,0,0\n{},{x},0.03,-0.02,1,0,0,0\n", t + 0.06);
        }
        workshop.write("thrust.csv", trace);
        let path = workshop.path("thrust.csv");
        let output = workshop.pliant(&["haptics", "case", "--replay", path.to_str().unwrap()]);
        assert_eq!(output.code, 0, "{solver}: {}\n{}", output.out, output.err);
        let jump = output.out.split("largest jump ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap();
        assert!(jump.parse::<f64>().unwrap() <= 0.3 + 1e-9, "{solver}: {}", output.out);
    }
}

#[test]
fn mistakes_are_told_with_a_remedy() {
    let workshop = Workshop::new("");
    workshop.write("bad.csv", "t,x,y,z,qw,qx,qy,qz\n0,0,0,zero,1,0,0,0\n");
    let bad = workshop.path("bad.csv");
    let good = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/palpation/finger.csv");
    for (arguments, word) in [
        (vec!["--replay", bad.to_str().unwrap()], "line 2 of the trace"),
        (vec!["--replay", "nowhere.csv"], "cannot be read"),
        (vec!["--tool", "hand", "--replay", good], "there is no tool `hand`"),
        (vec!["--listen", "0.0.0.0:0"], "open to other machines"),
        (vec!["--replay", good, "--stiffness", "0"], "stiffness of the coupling"),
        (vec!["--replay", good, "--rate", "5"], "give 10 to 1000"),
    ] {
        let output = workshop.pliant(&[&["haptics", SCENE], &arguments[..]].concat());
        assert_eq!(output.code, 2, "{arguments:?}: {}", output.err);
        assert!(output.err.contains(word), "{arguments:?}: {}", output.err);
    }
}
