//! Rotations of shells that follow the solid that they are tied to or on, and refusals.

use pliant_testing::scenes::{last_row, resumes, world};

/// A strip of 60 × 20 × 0.5 mm, tied by one edge to the side of a block of stone that `more` holds. Its
/// bending stiffness is 2.08e-7 N m².
fn strip(solver: &str, rotations: &str, more: &str) -> String {
    format!(
        "[scene]\nuntil = 1\n[run]\n{solver}\n\
         [law.stone]\ntype = 'neo-hookean'\nyoung-modulus = 1e7\npoisson-ratio = 0.2\n\
         [law.strip]\ntype = 'neo-hookean'\nyoung-modulus = 1e6\npoisson-ratio = 0\n\
         [body.block]\nmesh = {{ block = {{ size = [0.02, 0.02, 0.01], cells = [2, 2, 1] }}, as = 'hexes' }}\n\
         law = 'stone'\ndensity = 1000\ndamping = 40\n\
         [body.strip]\nmodel = 'shell'\nmesh = {{ plate = {{ size = [0.06, 0.02], cells = [12, 4] }}, at = [0.02, 0, 0.005] }}\n\
         law = 'strip'\ndensity = 1000\nthickness = 5e-4\ndamping = 9\n\
         [tie.edge]\nbetween = ['strip', 'block']\nnodes = {{ set = 'x-min' }}\n{rotations}\n\
         [output.history]\ntype = 'csv'\nevery = 1\n\
         probes.tip = {{ on = 'strip', at = [0.08, 0.01, 0.005], data = ['displacement'] }}\n{more}"
    )
}

const HELD: &str = "[constraint.base]\ntype = 'fix'\nbody = 'block'\nnodes = { set = 'x-min' }\n";
const STATIC: &str = "solver = 'static'\nload-steps = 2\ntolerance = 1e-10";
const FOLLOW: &str = "rotations = 'follow'";

fn lifted(force: f64) -> String {
    format!(
        "{HELD}[load.tip]\ntype = 'force'\non = 'strip'\nnodes = {{ set = 'x-max' }}\ntotal = [0, 0, {force}]\ncurve = 'ramp'\nto = 0.5\n"
    )
}

/// The strip is a cantilever, F L³/(3 E I), where its edge turns with the stone: free it would swing about a
/// hinge.
#[test]
fn a_strip_tied_by_its_edge_bends_as_a_cantilever() {
    let force = 1.74e-6;
    let row = last_row(&strip(STATIC, FOLLOW, &lifted(force)));
    let wanted = force * 0.06_f64.powi(3) / (3.0 * 1e6 * 0.02 * 5e-4_f64.powi(3) / 12.0);
    let found = row["probe.tip.displacement.z"];
    println!("{found} m of {wanted} m");
    assert!((found / wanted - 1.0).abs() < 5e-3, "{found} {wanted}");
    assert!((row["reaction.base.z"] / force + 1.0).abs() < 1e-6, "{row:?}");
    let moving = strip("solver = 'implicit'\nstep = 0.02\ntolerance = 1e-10", FOLLOW, &lifted(force))
        .replace("until = 1", "until = 6")
        .replace("every = 1", "every = 6");
    let at_rest = last_row(&moving)["probe.tip.displacement.z"];
    println!("at rest: {:.1e}", at_rest / found - 1.0);
    assert!((at_rest / found - 1.0).abs() < 1e-6, "{at_rest} {found}");
    let free = world(&strip(STATIC, "", &lifted(force))).unwrap();
    let notes = &free.participants[0].built.notes;
    assert!(notes.iter().any(|note| note.contains("`strip` is hinged")), "{notes:?}");
    let out = tempfile::tempdir().unwrap();
    let folder = pliant_run::OutputFolder::prepare(out.path().join("free"), &free.scene, false).unwrap();
    assert_eq!(pliant_run::run(&free, &folder, &mut |_| ()).unwrap().status, "failed");
}

/// The stone is turned by 2.5 rad: the strip stands out of it as before.
#[test]
fn a_strip_turns_with_its_stone() {
    let turned = "[constraint.base]\ntype = 'move'\nbody = 'block'\nnodes = 'all'\n\
                  rotate = { axis = [0, 1, 0], angle = 2.5, centre = [0, 0, 0] }\ncurve = 'ramp'\nto = 1\n";
    let row = last_row(&strip("solver = 'static'\nload-steps = 10\ntolerance = 1e-12", FOLLOW, turned));
    let (sine, cosine) = 2.5_f64.sin_cos();
    let (x, z) = (0.08 * cosine + 0.005 * sine, -0.08 * sine + 0.005 * cosine);
    let off =
        (row["probe.tip.displacement.x"] - (x - 0.08)).hypot(row["probe.tip.displacement.z"] - (z - 0.005));
    println!("{off:.1e} m");
    assert!(off < 1e-10, "{off:e}");
}

#[test]
fn a_resumed_run_of_turns_that_follow_ends_in_the_same_bits() {
    for run in ["solver = 'implicit'\nstep = 0.1", "solver = 'implicit'\nstep = 0.1\nintegrator = 'bdf2'"] {
        let run = format!("{run}\ncheckpoint = {{ every = 0.4 }}");
        resumes(&strip(&run, FOLLOW, &lifted(1e-4)));
    }
}

/// A beam of two materials is bent by its weight. A block of 80 × 10 × 10 mm has a wall of 2 mm on top, ten
/// times as stiff. With rotations that follow, the tissue right under the wall does not shear: the beam bends
/// a little less, on every mesh.
#[test]
fn a_wall_whose_rotations_follow_bends_a_little_less_than_a_free_one() {
    let beam = |finer: u32, rotations: &str| {
        let [x, y] = [8, 2].map(|count| count * finer);
        let text = format!(
            "[scene]\nuntil = 1\ngravity = [0, 0, -9.81]\n[run]\n{STATIC}\n\
             [law.tissue]\ntype = 'neo-hookean'\nyoung-modulus = 1e5\npoisson-ratio = 0.3\n\
             [law.wall]\ntype = 'neo-hookean'\nyoung-modulus = 1e6\npoisson-ratio = 0.3\n\
             [body.block]\nmesh = {{ block = {{ size = [0.08, 0.01, 0.01], cells = [{x}, {y}, {y}] }}, as = 'hexes' }}\n\
             element = 'hex8'\nlaw = 'tissue'\ndensity = 1000\n\
             [body.wall]\non = 'block'\nmodel = 'shell'\nfaces = {{ set = 'z-max' }}\nlaw = 'wall'\ndensity = 1000\nthickness = 2e-3\n{rotations}\n\
             [constraint.base]\ntype = 'fix'\nbody = 'block'\nnodes = {{ set = 'x-min' }}\n\
             [output.history]\ntype = 'csv'\nevery = 1\n\
             probes.tip = {{ on = 'block', at = [0.08, 0.005, 0.005], data = ['displacement'] }}\n"
        );
        last_row(&text)["probe.tip.displacement.z"]
    };
    for finer in [1, 2] {
        let (free, follow) = (beam(finer, ""), beam(finer, FOLLOW));
        println!("{finer}: free {free} m, following {follow} m");
        assert!(free < -0.01 && follow / free < 1.0 && follow / free > 0.98, "{free} {follow}");
    }
}

#[test]
fn rotations_that_cannot_follow_are_refused_by_name() {
    let plain = strip(STATIC, FOLLOW, HELD);
    let wall = "[body.wall]\non = 'block'\nfaces = { set = 'z-max' }\nmodel = 'shell'\nlaw = 'strip'\ndensity = 1000\nthickness = 1e-3\n";
    let explicit =
        strip("", FOLLOW, &format!("{HELD}[participant.outer]\nbodies = ['strip']\nstep = 1e-6\n"));
    for (text, pieces) in [
        (plain.replace("'follow'", "'folow'"), ["folow", "follow"]),
        (
            plain.clone()
                + "[constraint.hand]\ntype = 'fix'\nbody = 'strip'\nnodes = { set = 'x-max' }\n"
                + &format!(
                    "{wall}{FOLLOW}\n[constraint.wall]\ntype = 'fix'\nbody = 'wall'\nnodes = {{ set = 'x-max' }}\n"
                ),
            ["follows a solid, and `wall` acts on it, too", "components = [\"x\", \"y\", \"z\"]"],
        ),
        (
            plain.clone() + &wall.replace("model = 'shell'", "model = 'membrane'") + FOLLOW,
            ["`rotations` is for a shell with `on`", "remove it"],
        ),
        (
            plain.replace("model = 'shell'", "model = 'membrane'"),
            ["`strip` is no shell: its nodes have no rotations", "leave it out"],
        ),
        (
            plain
                .replace("nodes = { set = 'x-min' }\nrotations", "tolerance = 1\nrotations")
                .replace("['strip', 'block']", "['strip', 'plate']")
                + "[body.plate]\nmodel = 'shell'\nmesh = { plate = { size = [0.02, 0.02], cells = [2, 2] }, at = [0, 0, 0.02] }\nlaw = 'strip'\ndensity = 1000\nthickness = 1e-3\n",
            ["`plate` is no solid, and rotations follow solids alone", "leave it out"],
        ),
        (
            explicit,
            ["the springs of `edge`, between participants, hold places alone", "leave `rotations` out"],
        ),
    ] {
        crate::assert_refused(&text, &pieces);
    }
}
