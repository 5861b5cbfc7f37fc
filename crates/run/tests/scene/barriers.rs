//! Contact with the solvers `implicit` and `static`: a barrier keeps surfaces apart, from the text of a scene
//! to its outputs, and refusals.

use pliant_scene::BuiltBody;
use pliant_testing::PeakMemory;
use pliant_testing::scenes::{last_row, resumes, run, world};

/// A block of 40 × 40 × 20 mm of tissue a little above a floor, and a ball that is pressed into its top;
/// `held` holds its underside.
pub(super) fn pressed(run: &str, more: &str) -> String {
    format!(
        "[scene]\nuntil = 1\n[run]\n{run}\n\
         [law.tissue]\ntype = 'neo-hookean'\nyoung-modulus = 5e3\npoisson-ratio = 0.4\n\
         [body.block]\nmesh = {{ block = {{ size = [0.04, 0.04, 0.02], cells = [6, 6, 3] }}, as = 'hexes' }}\n\
         law = 'tissue'\ndensity = 1000\ndamping = 40\n\
         [tool.ball]\nshape = {{ sphere = {{ radius = 0.01 }} }}\nat = [0.02, 0.02, 0.0302]\nby = [0, 0, -0.003]\nto = 0.4\n\
         [contact.above]\nbetween = ['block', 'ball']\nfriction = 0.2\ncheck-intersections = true\n\
         [output.history]\ntype = 'csv'\nevery = 0.2\n\
         probes.top = {{ on = 'block', at = [0.02, 0.02, 0.02], data = ['displacement', 'contact-force', 'gap'] }}\n{more}"
    )
}

const FLOOR: &str = "[obstacle.floor]\nshape = 'half-space'\nat = [0, 0, -2e-5]\n\
                     [contact.below]\nbetween = ['block', 'floor']\nfriction = 0.5\n";
pub(super) const HELD: &str = "[constraint.base]\ntype = 'fix'\nbody = 'block'\nnodes = { set = 'z-min' }\n";

/// Bins of candidates are as wide as a part of the barrier, but their number is limited: 1e-12 m asked for 20
/// GB.
#[test]
fn a_tiny_barrier_distance_takes_no_memory() {
    let text = "[scene]\nuntil = 0.02\ngravity = [0, 0, -9.81]\n[run]\nthreads = 1\nsolver = 'implicit'\nstep = 0.01\niterations = 5\n\
                [law.wall]\ntype = 'neo-hookean'\nyoung-modulus = 1e6\npoisson-ratio = 0.45\n\
                [body.sheet]\nmodel = 'shell'\nmesh = { plate = { size = [0.3, 0.3], cells = [4, 4] } }\nlaw = 'wall'\nthickness = 1e-3\ndensity = 300\n\
                [obstacle.ball]\nshape = { sphere = { radius = 0.08 } }\nat = [0.153, 0.152, -0.082]\n\
                [contact.drapes]\nbetween = ['sheet', 'ball']\nbarrier-distance = 1e-12\nbarrier-stiffness = 1e4\n";
    let Some(before) = PeakMemory::alone("barriers::a_tiny_barrier_distance_takes_no_memory") else { return };
    let mut simulation = world(text).unwrap().simulation().unwrap();
    // Whether it finds its way is another matter.
    let _ = simulation.step(1).and_then(|_| simulation.step(1));
    before.assert_rise_below(512 << 10);
}

/// The force on top comes out below: in motion at the floor by a barrier, in equilibrium at the constraint.
/// The gap of the node under the ball is within the barrier.
#[test]
fn a_tool_presses_a_body_onto_an_obstacle_by_barriers() {
    let reach = 1e-3 * (0.04_f64 * 0.04 + 0.04 * 0.04 + 0.02 * 0.02).sqrt();
    let mut forces = Vec::new();
    for (run, more, below) in [
        ("solver = 'implicit'\nstep = 0.02", FLOOR, "contact.below.z"),
        ("solver = 'implicit'\nstep = 0.02", HELD, "reaction.base.z"),
        ("solver = 'static'\nload-steps = 10", HELD, "reaction.base.z"),
    ] {
        let row = last_row(&pressed(run, more));
        let (up, down) = (row["contact.above.z"], row[below]);
        println!("{run}: {up} N on the ball, {below} {down} N, {row:?}");
        assert!(up > 0.03 && (up / down.abs() - 1.0).abs() < 5e-3, "{up} {down}");
        let gap = row["probe.top.gap"];
        assert!(gap > 0.0 && gap < reach, "{gap}");
        assert!(row["probe.top.contact-force.z"] < 0.0);
        forces.push(up);
    }
    // At rest in the end.
    assert!((forces[1] / forces[2] - 1.0).abs() < 0.01, "{forces:?}");
}

/// Bodies of one segmentation overlap by the round-off of their meshes. They are pushed apart by the distance
/// of the barrier, so that the run starts without forces between them.
#[test]
fn bodies_that_overlap_are_pushed_apart_for_a_barrier() {
    let lid = "[body.lid]\nmesh = { block = { size = [0.03, 0.03, 0.01], cells = [4, 4, 2] }, as = 'hexes', at = [0.005, 0.005, 0.0195] }\n\
               law = 'tissue'\ndensity = 1000\ndamping = 40\n\
               [contact.between]\nbetween = ['lid', 'block']\nbarrier-distance = 2e-4\ncheck-intersections = true\n";
    let text = pressed("solver = 'implicit'\nstep = 0.02", &format!("{HELD}{lid}"))
        .replace("until = 1", "until = 0.2")
        .replace("0.0302]", "0.06]");
    let refused = world(&text).err().unwrap();
    assert!(
        refused.contains("no gap at the start")
            && refused.contains("push the bodies apart with `gap = 2e-4` or `separate = true`"),
        "{refused}"
    );
    let text = text.replace("barrier-distance = 2e-4", "barrier-distance = 2e-4\nseparate = true");
    let world = world(&text).unwrap();
    let note = world.notes().find(|note| note.contains("pushed apart before the run")).unwrap();
    println!("{note}");
    let ways = world.only().unwrap().built.pushed.clone().unwrap();
    let [low, high] = ways.iter().fold([0.0_f64; 2], |[low, high], u| [low.min(u[2]), high.max(u[2])]);
    // Together at least the overlap of 0.5 mm and half the distance.
    assert!(high - low >= 6e-4 && high > 1e-4 && low < -1e-4, "{low} m to {high} m");
    let row = last_row(&text);
    assert!(row["energy.internal"].is_finite(), "{row:?}");
}

/// Two bars, each with a ridge that goes through the other's ridge, with no node of either inside. No node
/// has a way out, but the ridges have.
fn crossed(more: &str) -> String {
    format!(
        "[scene]\nuntil = 0.02\n[run]\nsolver = 'implicit'\nstep = 0.01\n\
         [law.tissue]\ntype = 'neo-hookean'\nyoung-modulus = 5e3\npoisson-ratio = 0.4\n\
         [body.lower]\nmesh = {{ block = {{ size = [0.06, 0.01, 0.01], cells = [3, 1, 1] }}, as = 'hexes', \
         at = [-0.03, 0, -0.0141421], turn = [0.785398163, 0, 0] }}\nlaw = 'tissue'\ndensity = 1000\n\
         [body.upper]\nmesh = {{ block = {{ size = [0.01, 0.06, 0.01], cells = [1, 3, 1] }}, as = 'hexes', \
         at = [0, -0.03, -0.0005], turn = [0, -0.785398163, 0] }}\nlaw = 'tissue'\ndensity = 1000\n\
         [contact.ridges]\nbetween = ['lower', 'upper']\nbarrier-distance = 1e-4\ncheck-intersections = true\n{more}\n\
         [output.history]\ntype = 'csv'\nevery = 0.01\n"
    )
}

#[test]
fn ridges_that_go_through_each_other_are_parted() {
    let refused = world(&crossed("")).err().unwrap();
    assert!(refused.contains("an edge through a triangle"), "{refused}");
    let pushed = world(&crossed("separate = true")).unwrap();
    let ways = pushed.only().unwrap().built.pushed.clone().unwrap();
    let highest = ways.iter().map(|u| u[2]).fold(0.0, f64::max);
    assert!((2e-4..2e-3).contains(&highest), "{highest} m");
    // One table for all pairs asks for each pair.
    let every_pair = crossed("separate = true").replace("['lower', 'upper']", "['all', 'all']");
    assert!(world(&every_pair).unwrap().only().unwrap().built.pushed.is_some());
    assert!(last_row(&crossed("separate = true"))["energy.internal"] > 0.0);
}

/// Shapes at rest get the gap: the run starts without stress, and neither body overlaps the other. Resumed
/// runs find the same shapes.
#[test]
fn a_gap_parts_the_shapes_at_rest() {
    let text = crossed("gap = 2e-4");
    let world = world(&text).unwrap();
    let notes: Vec<&str> = world.notes().map(AsRef::as_ref).collect();
    let notes_with = |word: &str| notes.iter().filter(|note| note.contains(word)).count();
    assert!(notes_with("too near each other were pushed apart before the run") == 1, "{notes:?}");
    let built = &world.only().unwrap().built;
    assert!(built.pushed.is_none());
    // Of the nodes at the ends of the edges that went through each other.
    let near = |body: usize| built.bodies[body].mesh.points.iter().filter(|x| x.xy().amax() < 0.012);
    let heights = |body: usize| near(body).map(|point| point.z);
    let gap = heights(1).fold(f64::INFINITY, f64::min) - heights(0).fold(f64::NEG_INFINITY, f64::max);
    assert!((2e-4 - 1e-9..3e-4).contains(&gap), "{gap} m");
    assert!(last_row(&text)["energy.internal"].abs() < 1e-15);
}

#[test]
fn bad_gaps_are_refused() {
    for (given, message) in [
        ("gap = 0", "greater than 0"),
        ("gap = -1e-4", "greater than 0"),
        ("gap = true", "`gap`"),
        ("gap = 2e-4\nseparate = true", "`gap` and `separate`"),
        ("gap = 0.2", "would invert element"),
    ] {
        let refused = world(&crossed(given)).err().unwrap_or_else(|| panic!("accepted: {given}"));
        assert!(refused.contains(message), "{given}: {refused}");
    }
}

/// A piece of cloth that falls onto a ball and itself.
pub(super) fn cloth(more: &str) -> String {
    format!(
        "[scene]\nuntil = 1\ngravity = [0, 0, -9.81]\n[run]\nsolver = 'implicit'\nstep = 0.02\ntolerance = 1e-4\ncheckpoint = {{ every = 0.4 }}\n\
         [law.cotton]\ntype = 'neo-hookean'\nyoung-modulus = 1e5\npoisson-ratio = 0.3\n\
         [body.cloth]\nmodel = 'shell'\nmesh = {{ plate = {{ size = [0.2, 0.2], cells = [10, 10] }} }}\nlaw = 'cotton'\ndensity = 300\n\
         thickness = 2e-3\ndamping = 5\n\
         [obstacle.ball]\nshape = {{ sphere = {{ radius = 0.05 }} }}\nat = [0.103, 0.102, -0.052]\n\
         [contact.drapes]\nbetween = ['cloth', 'ball']\nfriction = 0.5\ncheck-intersections = true\n\
         [contact.folds]\nbetween = ['cloth', 'cloth']\nfriction = 0.5\n\
         [output.history]\ntype = 'csv'\nevery = 0.2\n{more}"
    )
}

#[test]
fn a_run_in_contact_resumes_with_the_same_bits() {
    resumes(&cloth(""));
}

/// A sheet that hangs in a funnel of revolution bends to its wall, which carries its weight; iterations end
/// by a speed.
#[test]
fn a_sheet_hangs_in_a_funnel() {
    let sheet = |more: &str| {
        format!(
            "[scene]\nuntil = 2\ngravity = [0, 0, -9.81]\n[run]\nsolver = 'implicit'\nstep = 0.02\n{more}\n\
             [law.cotton]\ntype = 'neo-hookean'\nyoung-modulus = 1e5\npoisson-ratio = 0.3\n\
             [body.sheet]\nmodel = 'shell'\nmesh = {{ plate = {{ size = [0.1, 0.04], cells = [10, 4] }}, at = [-0.05, -0.02, 0.02] }}\n\
             law = 'cotton'\ndensity = 300\nthickness = 2e-3\ndamping = 20\n\
             [obstacle.funnel]\ninside = true\n\
             shape = {{ revolved = {{ outline = [[-0.1, 0.02, 0], [-0.02, 0.03, 0.02], [0.1, 0.15, 0]] }} }}\n\
             [contact.wall]\nbetween = ['sheet', 'funnel']\nfriction = 0.3\ncheck-intersections = true\n\
             [output.history]\ntype = 'csv'\nevery = 0.2\n\
             probes.end = {{ on = 'sheet', at = [0.05, 0, 0.02], data = ['displacement'] }}\n"
        )
    };
    let weight = 0.1 * 0.04 * 2e-3 * 300.0 * 9.81;
    let ends = ["tolerance = 1e-5", "speed-tolerance = 1e-4"].map(|more| {
        let row = last_row(&sheet(more));
        println!("{more}: {} N of {weight} N, {row:?}", row["contact.wall.z"]);
        assert!((row["contact.wall.z"] / weight + 1.0).abs() < 1e-2, "{row:?}");
        assert!(row["probe.end.displacement.x"] < -1e-2, "{row:?}");
        row["probe.end.displacement.z"]
    });
    assert!((ends[0] - ends[1]).abs() < 2e-4, "{ends:?}");
}

/// Steps whose iterations run out are taken as they are and counted. In no step an edge intersects a
/// triangle.
#[test]
fn steps_that_do_not_converge_have_no_intersection_either() {
    let text = cloth("")
        .replace("until = 1\n", "until = 0.4\n")
        .replace("tolerance = 1e-4\n", "tolerance = 1e-8\niterations = 3\naccept-unconverged = true\n");
    let out = tempfile::tempdir().unwrap();
    let summary = run(&text, &out.path().join("out"));
    let effort = summary.solver.unwrap();
    println!("{} of 20 steps did not converge, {} halved", effort.unconverged, effort.halved);
    assert!(effort.unconverged > 5 && effort.newton_iterations <= 20 * 3 * 4, "{effort:?}");
    let page = std::fs::read_to_string(out.path().join("out/summary.md")).unwrap();
    assert!(page.contains("steps that did not converge"), "{page}");
    let message = world(&pressed("solver = 'static'\naccept-unconverged = true", "")).unwrap_err();
    assert!(message.contains("`accept-unconverged` is for `solver = \"implicit\"`"), "{message}");
}

/// The block with a coat of a model on its top, which the ball presses. The coat lies on the nodes of the
/// block, or on its own mesh that is tied.
fn coated(run: &str, model: &str, mesh: &str, more: &str) -> String {
    let (mesh, tie) = match mesh {
        "on" => ("on = 'block'\nfaces = { set = 'z-max' }".to_owned(), ""),
        cells => (
            format!("mesh = {{ plate = {{ size = [0.04, 0.04], cells = {cells} }}, at = [0, 0, 0.02] }}"),
            "[tie.glue]\nbetween = ['coat', 'block']\n",
        ),
    };
    let coat = format!(
        "[law.coat]\ntype = 'neo-hookean'\nyoung-modulus = 1e5\npoisson-ratio = 0.4\n\
         [body.coat]\nmodel = '{model}'\n{mesh}\nlaw = 'coat'\ndensity = 1000\nthickness = 5e-4\n{tie}{more}"
    );
    pressed(run, &format!("{HELD}{coat}"))
        .replace("['block', 'ball']\n", "['coat', 'ball']\nthickness = 0\n")
        .replace("on = 'block', at = [0.02, 0.02, 0.02]", "on = 'coat', at = [0.02, 0.02, 0.02]")
}

/// A force on a tied coat reaches the block below. On the same triangles it equals the force on a coat with
/// the nodes of the block. On other meshes it balances the force that holds the block. Nodes touch, so the
/// force depends on their places. A mesh with a node under the ball gives the same to 1 %. A mesh without
/// one, whose first four nodes touch 3.6 mm away, gives 28 % more, with a coat of no stiffness as well.
#[test]
fn a_tied_coat_is_pressed_as_one_on_the_nodes_of_its_block() {
    for (run, model, balanced) in [
        ("solver = 'static'\nload-steps = 10", "membrane", 1e-6),
        ("solver = 'static'\nload-steps = 10", "shell", 1e-6),
        // Not quite at rest in the end.
        ("solver = 'implicit'\nstep = 0.02", "shell", 5e-3),
    ] {
        let [on, same, under, _] = ["on", "[6, 6]", "[8, 10]", "[7, 9]"].map(|mesh| {
            let row = last_row(&coated(run, model, mesh, ""));
            let (up, down) = (row["contact.above.z"], row["reaction.base.z"]);
            println!("{run}, {model} {mesh}: {up} N on the ball, {down} N below");
            assert!(up > 0.03 && (up / down.abs() - 1.0).abs() < balanced, "{up} {down}");
            assert!(row["probe.top.gap"] > 0.0 && row["probe.top.contact-force.z"] < 0.0);
            up
        });
        assert!((same / on - 1.0).abs() < 1e-6, "{on} {same}");
        assert!((under / on - 1.0).abs() < 0.01, "{on} {under}");
    }
    let run = "solver = 'implicit'\nstep = 0.05\ncheckpoint = { every = 0.4 }";
    resumes(&coated(run, "shell", "[7, 9]", "rotations = 'follow'\n"));
    let rigid = "[constraint.bone]\ntype = 'rigid'\nbody = 'block'\nnodes = { set = 'z-max' }\n";
    let message = world(&coated(run, "shell", "[7, 9]", rigid)).err().unwrap();
    assert!(message.contains("is bound to other nodes by a rigid part or a mean"), "{message}");
}

/// Each mistake is refused with its place and a remedy.
#[test]
fn mistakes_are_refused() {
    let implicit = "solver = 'implicit'\nstep = 0.02";
    for (text, pieces) in [
        (
            pressed(implicit, &FLOOR.replace("-2e-5", "1e-4")),
            [
                "contact `below` has no gap at the start in 49 places: node 0 of `block` at (0, 0, 0) m",
                "or `separate = true`, move one of them",
            ],
        ),
        (
            cloth("").replace("-0.052", "-0.0505"),
            ["contact `drapes` has no gap at the start", "move one of them"],
        ),
        (
            pressed("", "").replace("check-intersections = true", "barrier-distance = 1e-4"),
            ["`barrier-distance` of a contact is for the solvers `implicit` and `static`", "`explicit`"],
        ),
        (
            pressed("solver = 'quasi-static'", ""),
            ["contact is for the solvers `explicit`, `implicit` and `static`", "`quasi-static`"],
        ),
        (pressed(implicit, "").replace("friction = 0.2", "barrier-stiffness = 0"), ["barrier-stiffness", ""]),
        (
            pressed(implicit, "").replace(
                "sphere = { radius = 0.01 }",
                "revolved = { outline = [[0, 0, 0], [0, 0.01, 0], [0.1, 0.02, 0]] }",
            ),
            [
                "point 1 of the outline needs a rounding above 0",
                "`[height, distance from the axis, radius of the arc]`",
            ],
        ),
        (
            pressed("solver = 'static'\nspeed-tolerance = 1e-3", ""),
            ["`speed-tolerance` is for `solver = \"implicit\"`", "remove it"],
        ),
    ] {
        crate::assert_refused(&text, &pieces);
    }
}

/// S5: a block at 10 m/s meets two to four thin walls a millimetre apart, all of which it would pass in a
/// step. Nothing passes anything: what lies below stays below.
#[test]
fn a_fast_block_passes_no_wall() {
    let wall = |k: usize| {
        let z = -0.001 * k as f64;
        let held = (0..4).map(|side: usize| {
            let (point, normal) = [
                ("[0.001, 0, 0]", "[-1, 0, 0]"),
                ("[0.099, 0, 0]", "[1, 0, 0]"),
                ("[0, 0.001, 0]", "[0, -1, 0]"),
                ("[0, 0.099, 0]", "[0, 1, 0]"),
            ][side];
            format!(
                "[constraint.w{k}{side}]\ntype = 'fix'\nbody = 'wall{k}'\nnodes = {{ half-space = {{ point = {point}, normal = {normal} }} }}\n"
            )
        });
        format!(
            "[body.wall{k}]\nmodel = 'shell'\nmesh = {{ plate = {{ size = [0.1, 0.1], cells = [8, 8] }}, at = [0, 0, {z}] }}\n\
             law = 'wall'\ndensity = 1000\nthickness = 5e-4\n{}",
            held.collect::<String>()
        )
    };
    for walls in 2..=4 {
        let text = format!(
            "[scene]\nuntil = 0.006\n[run]\nsolver = 'implicit'\nstep = 0.001\n\
             [law.tissue]\ntype = 'neo-hookean'\nyoung-modulus = 1e5\npoisson-ratio = 0.4\n\
             [law.wall]\ntype = 'neo-hookean'\nyoung-modulus = 1e8\npoisson-ratio = 0.4\n\
             [body.block]\nmesh = {{ block = {{ size = [0.02, 0.02, 0.02], cells = [2, 2, 2] }}, as = 'hexes', at = [0.041, 0.039, 0.005] }}\n\
             law = 'tissue'\ndensity = 1000\nvelocity = [0, 0, -10]\n{}\
             [contact.every]\nbetween = ['all', 'all']\nsubdivision = 0\ncheck-intersections = true\n",
            (0..walls).map(wall).collect::<String>()
        );
        let world = world(&text).unwrap_or_else(|error| panic!("{error}"));
        let mut simulation = world.simulation().unwrap();
        let mut deepest = 0.0_f64;
        for _ in 0..6 {
            simulation.step(1).unwrap();
            let frame = simulation.frame().unwrap();
            let lowest = |body: &BuiltBody| {
                let moved = frame.displacements(&body.name).unwrap();
                let heights = body.mesh.points.iter().zip(moved).map(|(rest, u)| rest.z + u[2]);
                heights.fold(f64::INFINITY, f64::min)
            };
            let lowest: Vec<f64> = world.participants[0].built.bodies.iter().map(lowest).collect();
            assert!(lowest.windows(2).all(|pair| pair[0] > pair[1] + 1e-4), "{walls} walls: {lowest:?}");
            deepest = deepest.min(lowest[0]);
        }
        println!("{walls} walls: the block comes to {deepest} m");
        assert!(deepest < -0.002, "{walls} walls are hit: {deepest}");
    }
}
