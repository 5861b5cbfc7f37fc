//! `pliant haptics` through the real binary. Times are those of a busy machine: none is checked.

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
    let told = workshop.pliant(&["haptics", SCENE, "--replay", trace.to_str().unwrap()]);
    assert_eq!(told.code, 0, "{}", told.err);
    for word in ["force period", "device to force", "largest jump", "energy observed", "stiffest coupling"] {
        assert!(told.out.contains(word), "{}", told.out);
    }
    let last = told.out.lines().find(|line| line.starts_with("last force")).unwrap();
    let triples = last.split('(').skip(1).map(|text| text.split(')').next().unwrap());
    let triples: Vec<Vec<f64>> =
        triples.map(|text| text.split(", ").map(|x| x.parse().unwrap()).collect()).collect();
    let (device, simulated) = (triples[0][2], triples[1][2]);
    // The tissue still relaxes, and the last model may be some periods old on a busy machine.
    assert!(device > 0.3 && (device / simulated - 1.0).abs() < 0.1, "{last}");
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
        let told = workshop.pliant(&[&["haptics", SCENE], &arguments[..]].concat());
        assert_eq!(told.code, 2, "{arguments:?}: {}", told.err);
        assert!(told.err.contains(word), "{arguments:?}: {}", told.err);
    }
}
