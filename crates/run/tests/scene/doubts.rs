//! Results that are questionable, and their warnings: equilibria that a body would leave, bodies that swell,
//! membranes that wrinkle.

use pliant_testing::scenes::{assert_rows_agree, last_row, run};
use tempfile::TempDir;

/// The warnings of a run, and its changes of volume.
fn warnings(text: &str) -> (Vec<String>, Vec<f64>) {
    let out = TempDir::new().unwrap();
    let summary = run(text, out.path());
    (summary.warnings, summary.volume_changes.iter().map(|volume| volume.change).collect())
}

/// A sheet of 0.1 mm pressed in its plane far beyond its buckling load stays flat, an equilibrium that no
/// sheet keeps.
#[test]
fn a_sheet_that_should_buckle_is_doubted() {
    let sheet = |by: f64| {
        format!(
            "[scene]\nuntil = 1\n[run]\nsolver = 'static'\nload-steps = 2\n\
             [law.a]\ntype = 'neo-hookean'\nyoung-modulus = 1e6\npoisson-ratio = 0\n\
             [body.b]\nmodel = 'shell'\nmesh = {{ plate = {{ size = [0.1, 0.05], cells = [8, 4] }} }}\nlaw = 'a'\ndensity = 1000\nthickness = 1e-4\nelement = 'dkt-cst'\n\
             [constraint.c]\ntype = 'fix'\nbody = 'b'\nnodes = {{ set = 'x-min' }}\n\
             [constraint.m]\ntype = 'move'\nbody = 'b'\nnodes = {{ set = 'x-max' }}\nby = [{by}, 0, 0]\n"
        )
    };
    let buckles = |by| {
        warnings(&sheet(by)).0.iter().any(|text| text.contains("s on are unstable: the body would buckle"))
    };
    assert!(buckles(-0.005));
    assert!(!buckles(0.005));
}

/// A flat membrane in its plane: nothing holds it across but tension, which it does not have yet.
#[test]
fn flat_membranes_and_straight_threads_are_pulled() {
    let text = |solver: &str| {
        format!(
            "[scene]\nuntil = 1\n[run]\n{solver}\n\
             [law.a]\ntype = 'neo-hookean'\nyoung-modulus = 1e6\npoisson-ratio = 0.45\n\
             [body.b]\nmodel = 'membrane'\nmesh = {{ plate = {{ size = [0.02, 0.02], cells = [6, 6] }} }}\nlaw = 'a'\ndensity = 1000\nthickness = 1e-4\n\
             [constraint.c]\ntype = 'fix'\nbody = 'b'\nnodes = {{ set = 'x-min' }}\n\
             [constraint.m]\ntype = 'move'\nbody = 'b'\nnodes = {{ set = 'x-max' }}\nby = [0.002, 0, 0]\n\
             [body.thread]\nmodel = 'bar'\nmesh = {{ lines = [[[0, 0.03, 0], [0.02, 0.03, 0]]], edge = 0.005 }}\nlaw = 'a'\ndensity = 1000\narea = 1e-6\n\
             [constraint.d]\ntype = 'fix'\nbody = 'thread'\nnodes = {{ nearest = {{ point = [0, 0.03, 0], count = 1 }} }}\n\
             [constraint.n]\ntype = 'move'\nbody = 'thread'\nnodes = {{ nearest = {{ point = [0.02, 0.03, 0], count = 1 }} }}\nby = [0.002, 0, 0]\n\
             [output.history]\ntype = 'csv'\nevery = 1\n"
        )
    };
    let relaxed =
        last_row(&text("solver = 'quasi-static'\nload-steps = 5\ntolerance = 1e-9\nprecision = 'double'"));
    let newton = last_row(&text("solver = 'static'\nload-steps = 5"));
    assert_rows_agree("flat", [&relaxed, &newton], &[("reaction.", 1e-5)]);
    // E A Δl/l of the thread.
    assert!((newton["reaction.n.x"] - 0.1).abs() < 1e-9, "{}", newton["reaction.n.x"]);
}

/// A wall with fibres swells, since they load its bulk modulus; a larger one ends that.
#[test]
fn a_wall_that_swells_is_doubted() {
    let wall = |bulk: f64| {
        format!(
            "[scene]\nuntil = 1\n[run]\nsolver = 'static'\nload-steps = 4\n\
             [law.wall]\ntype = 'holzapfel-gasser-ogden'\nshear-modulus = 3000\nbulk-modulus = {bulk}\nfibre-modulus = 2360\nfibre-exponent = 0.84\n\
             families = 2\nfibre = [0.8, 0.6, 0]\nsecond-fibre = [0.8, -0.6, 0]\n\
             [body.b]\nmesh = {{ block = {{ size = [0.01, 0.01, 0.002], cells = [2, 2, 1] }}, as = 'hexes' }}\nelement = 'hex8-full'\nlaw = 'wall'\ndensity = 1000\n\
             [constraint.x]\ntype = 'fix'\nbody = 'b'\nnodes = {{ set = 'x-min' }}\ncomponents = ['x']\n\
             [constraint.y]\ntype = 'fix'\nbody = 'b'\nnodes = {{ set = 'y-min' }}\ncomponents = ['y']\n\
             [constraint.z]\ntype = 'fix'\nbody = 'b'\nnodes = {{ set = 'z-min' }}\ncomponents = ['z']\n\
             [constraint.side]\ntype = 'fix'\nbody = 'b'\nnodes = {{ set = 'y-max' }}\ncomponents = ['y']\n\
             [constraint.pull]\ntype = 'move'\nbody = 'b'\nnodes = {{ set = 'x-max' }}\nby = [0.006, 0, 0]\ncomponents = ['x']\n"
        )
    };
    let swells = |bulk| {
        let (message, changes) = warnings(&wall(bulk));
        (message.iter().any(|text| text.contains("`b` changes its volume by +")), changes[0])
    };
    let ((soft, much), (stiff, little)) = (swells(3e4), swells(3e6));
    println!("J − 1: {much} and {little}");
    assert!(soft && much > 0.05 && !stiff && little > 0.0 && little < 0.01);
}

/// A capsule is pressed together with its solid: beyond half the force at which it wrinkles the run warns, in
/// tension it does not.
#[test]
fn a_membrane_that_wrinkles_is_doubted() {
    let coated = |by: f64| {
        format!(
            "[scene]\nuntil = 1\n[run]\nsolver = 'static'\nload-steps = 2\n\
             [law.a]\ntype = 'neo-hookean'\nyoung-modulus = 3e3\npoisson-ratio = 0.3\n\
             [law.skin]\ntype = 'neo-hookean'\nyoung-modulus = 1e6\npoisson-ratio = 0.3\n\
             [body.b]\nmesh = {{ block = {{ size = [0.02, 0.02, 0.01], cells = [4, 4, 2] }}, as = 'hexes' }}\nelement = 'hex8-full'\nlaw = 'a'\ndensity = 1000\n\
             [body.skin]\non = 'b'\nfaces = {{ set = 'z-max' }}\nlaw = 'skin'\nthickness = 1e-4\ndensity = 1000\n\
             [constraint.c]\ntype = 'fix'\nbody = 'b'\nnodes = {{ set = 'x-min' }}\n\
             [constraint.m]\ntype = 'move'\nbody = 'b'\nnodes = {{ set = 'x-max' }}\nby = [{by}, 0, 0]\n"
        )
    };
    // E t ε/(1 − ν²) = 110 ε N/m against half of E* h/2π = 1.4 N/m: from 1.3 % on.
    let message =
        |by| warnings(&coated(by)).0.iter().any(|text| text.contains("the membrane `skin` is compressed by"));
    assert!(message(-0.0006) && !message(-0.0001) && !message(0.0006));
}
