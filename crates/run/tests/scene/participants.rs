//! One scene with solids and shells. Each participant gives the result of its own scene, and outputs see both
//! at common instants. An interrupted run continues with the same bits.

use std::fs;
use std::sync::Arc;

use pliant_geometry::CellKind;
use pliant_geometry::io;
use pliant_run::Live;
use pliant_scene::World;
use pliant_sim::StopFlag;
use pliant_testing::scenes::{self, last_row_in, run_world, taken_up};

const LAWS: &str = r#"
[law.tissue]
type = "neo-hookean"
young-modulus = 1e6
poisson-ratio = 0.3
[law.wall]
type = "neo-hookean"
young-modulus = 1e6
poisson-ratio = 0.4
"#;

const SOLID: &str = r#"
[body.cube]
mesh = { block = { size = [0.2, 0.1, 0.1], cells = [4, 2, 2] }, as = "hexes" }
law = "tissue"
density = 1000
damping = 5
[constraint.base]
type = "fix"
body = "cube"
nodes = { set = "x-min" }
"#;

const SHELL: &str = r#"
[body.strip]
model = "shell"
mesh = { plate = { size = [0.1, 0.02] }, edge = 0.01 }
law = "wall"
density = 1000
thickness = 0.002
damping = 20
[constraint.end]
type = "fix"
body = "strip"
nodes = { set = "x-min" }
"#;

/// The `[run]` keys of the shell's own scene.
const IMPLICIT: &str = "solver = 'implicit'\nstep = 0.01\n";

const HEAD: &str = "[scene]\nuntil = 0.2\ngravity = [0, 0, -9.81]\n";

const OUTPUTS: &str =
    "[output.history]\ntype = 'csv'\nevery = 0.02\n[output.fields]\ntype = 'vtu'\nevery = 0.1\n";

fn world(text: &str) -> World {
    scenes::world(text).unwrap()
}

fn both(more: &str) -> String {
    format!("{HEAD}[participant.walls]\nbodies = ['strip']\n{IMPLICIT}{LAWS}{SOLID}{SHELL}{OUTPUTS}{more}")
}

#[test]
fn each_participant_comes_out_as_it_does_alone() {
    let place = tempfile::tempdir().unwrap();
    let two = world(&both(""));
    let names: Vec<&str> = two.participants.iter().map(|part| part.name.as_str()).collect();
    assert_eq!(names, ["walls", "solids"]);
    let together = run_world(&two, &place.path().join("two"));
    assert_eq!((together.participants.len(), together.bodies.len(), together.steps), (2, 2, 20));
    let [walls, solids] = &together.participants[..] else { panic!("two participants") };
    assert_eq!((walls.solver, solids.solver, walls.steps), ("implicit", "explicit", 20));
    assert!(solids.steps > 100 && solids.steps.is_multiple_of(20), "{}", solids.steps);
    assert!((solids.steps as f64 * solids.step - 0.2).abs() < 1e-12);

    // Alone at the same steps.
    let run_table = format!("[run]\nstep = {:e}\n", solids.step);
    run_world(&world(&format!("{HEAD}{run_table}{LAWS}{SOLID}{OUTPUTS}")), &place.path().join("solid"));
    run_world(&world(&format!("{HEAD}[run]\n{IMPLICIT}{LAWS}{SHELL}{OUTPUTS}")), &place.path().join("shell"));
    let [both, solid, shell] = ["two", "solid", "shell"].map(|name| last_row_in(&place.path().join(name)));
    for axis in ["x", "y", "z"] {
        let base = format!("reaction.base.{axis}");
        assert_eq!(both[&base], solid[&base]);
        let end = format!("reaction.end.{axis}");
        assert_eq!(both[&end], shell[&end]);
    }
    for energy in ["kinetic", "internal", "external", "damping"] {
        let column = format!("energy.{energy}");
        let [a, b] = [solid[&column], shell[&column]];
        assert_eq!(both[&format!("energy.solids.{energy}")], a);
        assert_eq!(both[&format!("energy.walls.{energy}")], b);
        assert!((both[&column] - (a + b)).abs() <= 1e-15 * (a.abs() + b.abs()), "{energy}");
    }
    let page = fs::read_to_string(place.path().join("two/summary.md")).unwrap();
    for piece in
        ["## Time step of `walls`", "## Time step of `solids`", "## Energy of all participants at the end"]
    {
        assert!(page.contains(piece), "no `{piece}` in {page}");
    }
}

/// A common step may be thousands of steps of a participant: a stop is heard between them, and the simulation
/// stays at the instant before.
#[test]
fn a_stop_is_heard_within_a_common_step() {
    let world = world(&both("").replace(IMPLICIT, "solver = 'explicit'\n"));
    let [mut stopped, mut whole] = [(); 2].map(|()| world.simulation().unwrap());
    let stop = StopFlag::default();
    stopped.stop_on(&stop);
    stopped.step(1).unwrap();
    let before = (stopped.time(), stopped.fingerprint());
    stop.ask();
    assert!(stopped.step(1).unwrap_err().is_interrupted());
    assert_eq!((stopped.time(), stopped.fingerprint()), before);
    stop.clear();
    stopped.step(1).unwrap();
    (0..2).for_each(|_| assert_eq!(whole.step(1).unwrap(), 1));
    assert_eq!(stopped.fingerprint(), whole.fingerprint());
}

#[test]
fn outputs_show_all_bodies_together() {
    let place = tempfile::tempdir().unwrap();
    let world = world(&both(""));
    run_world(&world, place.path().join("two").as_path());
    let mesh = io::read(&place.path().join("two/fields/000002.vtu")).unwrap().mesh;
    let [hexes, triangles] = [CellKind::Hex, CellKind::Triangle].map(|kind| mesh.block(kind).unwrap());
    let nodes: usize = world.participants.iter().map(|part| part.built.model.node_count()).sum();
    assert_eq!((mesh.points.len(), hexes.len()), (nodes, 16));
    assert_eq!(hexes.data["body"].values, vec![1.0; 16]);
    assert!(triangles.data["body"].values.iter().all(|&body| body == 0.0));
    for block in [hexes, triangles] {
        assert!(block.data["von-mises"].values.iter().all(|value| value.is_finite() && *value >= 0.0));
    }
    let mut playing = Live::new(&Arc::new(world)).unwrap();
    playing.simulation.step(1).unwrap();
    assert_eq!(playing.mesh().unwrap().points.len(), nodes);
    assert!((playing.simulation.time() - 0.01).abs() < 1e-12);
}

#[test]
fn an_interrupted_run_of_two_goes_on_with_the_same_bits() {
    let place = tempfile::tempdir().unwrap();
    let whole = world(&both("[run]\ncheckpoint = { every = 0.1 }\n"));
    let half = world(&both("[run]\ncheckpoint = { every = 0.1 }\n").replace("until = 0.2", "until = 0.1"));
    let (checkpoint, [a, b]) = taken_up(&whole, &half, place.path());
    assert_eq!(a, b);
    let other = world(&format!("{HEAD}{LAWS}{SOLID}{OUTPUTS}[run]\ncheckpoint = {{ every = 0.1 }}\n"));
    let refused = checkpoint.continues(&other).unwrap_err().to_string();
    assert!(refused.contains("differ"), "{refused}");
}

#[test]
fn without_tables_solids_and_shells_are_participants_of_the_run() {
    let two = world(&format!("{HEAD}{LAWS}{SOLID}{SHELL}"));
    let names: Vec<&str> = two.participants.iter().map(|part| part.name.as_str()).collect();
    assert_eq!(names, ["solids", "shells"]);
    let steps: Vec<u64> = two.participants.iter().map(|part| part.plan.steps.number).collect();
    assert!(steps.iter().all(|number| number.is_multiple_of(two.steps())), "{steps:?}");
    assert!(steps.contains(&two.steps()));
}

#[test]
fn mistakes_of_participants_are_underlined() {
    let message = |text: &str| scenes::world(text).err().unwrap_or_else(|| "no mistake".into());
    let table = |bodies: &str, more: &str| {
        format!("{HEAD}[participant.walls]\nbodies = {bodies}\n{more}{LAWS}{SOLID}{SHELL}{OUTPUTS}")
    };
    for (text, says) in [
        (table("['strop']", ""), "there is no body `strop` (help: did you mean `strip`?)"),
        (table("[]", ""), "participant `walls` has no body"),
        (table("['strip', 'cube']", ""), "the solver `explicit` takes only one of both kinds"),
        (table("['strip', 'strip']", ""), "`strip` is named twice"),
        (
            table("['strip']", "[participant.other]\nbodies = ['strip']\n"),
            "`strip` already belongs to participant `walls`",
        ),
        (
            table("['strip']", "mass-scaling = { target-step = 1 }\n"),
            "`mass-scaling` is not available for shells",
        ),
        (
            format!("{}[load.p]\ntype = 'force'\non = 'strep'\nnodes = 'all'\ntotal = [0, 0, 1]\n", both("")),
            "there is no body or surface `strep` (help: did you mean `strip`?)",
        ),
        (
            both("[output.one]\ntype = 'csv'\nevery = 1\nreactions = ['bose']\n"),
            "there is no constraint `bose`",
        ),
    ] {
        let message = message(&text);
        assert!(message.contains(says), "{message}\n{text}");
    }
}

#[test]
fn solids_of_different_steps_and_precisions_go_together() {
    let place = tempfile::tempdir().unwrap();
    let soft = "[law.soft]\ntype = 'neo-hookean'\nyoung-modulus = 10e3\npoisson-ratio = 0.3\n";
    let bar = "[body.bar]\nmesh = { block = { size = [0.2, 0.1, 0.1], cells = [4, 2, 2] }, as = 'hexes' }\nlaw = 'soft'\n\
               density = 1000\n[constraint.end]\ntype = 'fix'\nbody = 'bar'\nnodes = { set = 'x-min' }\n";
    let table = "[participant.slow]\nbodies = ['bar']\nprecision = 'single'\n";
    let two = world(&format!("{HEAD}{table}{LAWS}{soft}{SOLID}{bar}{OUTPUTS}"));
    let summary = run_world(&two, &place.path().join("two"));
    let [slow, fast] = &summary.participants[..] else { panic!("two participants") };
    assert_eq!((slow.precision, fast.precision), ("single", "double"));
    assert!(fast.steps >= 8 * slow.steps, "{} {}", fast.steps, slow.steps);
    let alone = format!("{HEAD}[run]\nprecision = 'single'\nstep = {:e}\n{soft}{bar}{OUTPUTS}", slow.step);
    run_world(&world(&alone), &place.path().join("bar"));
    let [both, bar] = ["two", "bar"].map(|name| last_row_in(&place.path().join(name)));
    for axis in ["x", "y", "z"] {
        let column = format!("reaction.end.{axis}");
        assert_eq!(both[&column], bar[&column]);
    }
}
