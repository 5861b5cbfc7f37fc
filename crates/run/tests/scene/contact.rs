//! Bodies that touch obstacles and tools, from the text of a scene to its outputs, and refusals.

use pliant_testing::scenes::{last_row, resumes, run, world};

use crate::assert_refused;

/// A block of 40 × 40 × 20 mm of tissue on a floor, a ball that is pressed into its top.
pub(super) fn pressed(run: &str, more: &str) -> String {
    format!(
        "[scene]\nuntil = 0.5\n[run]\n{run}\n\
         [law.tissue]\ntype = 'neo-hookean'\nyoung-modulus = 5e3\npoisson-ratio = 0.4\n\
         [body.block]\nmesh = {{ block = {{ size = [0.04, 0.04, 0.02], cells = [8, 8, 4] }}, as = 'hexes' }}\n\
         law = 'tissue'\ndensity = 1000\ndamping = 40\n\
         [obstacle.floor]\nshape = 'half-space'\n\
         [tool.ball]\nshape = {{ sphere = {{ radius = 0.01 }} }}\nat = [0.02, 0.02, 0.0301]\nby = [0, 0, -0.005]\nto = 0.2\n\
         [contact.below]\nbetween = ['block', 'floor']\nfriction = 0.5\n\
         [contact.above]\nbetween = ['block', 'ball']\nfriction = 0.2\n\
         [output.history]\ntype = 'csv'\nevery = 0.5\nprobes.top = {{ on = 'block', at = [0.02, 0.02, 0.02], data = ['displacement'] }}\n{more}"
    )
}

/// The ball's force goes through the block to the floor; the node under it is not in the ball; energies
/// balance.
#[test]
fn a_tool_presses_a_body_onto_an_obstacle() {
    for precision in ["", "precision = 'single'"] {
        let text = pressed(precision, "");
        let row = last_row(&text);
        let (up, down) = (row["contact.above.z"], row["contact.below.z"]);
        println!(
            "{up} N on the ball, {down} N on the floor, top moved by {} m",
            row["probe.top.displacement.z"]
        );
        assert!(up > 0.05 && (up / -down - 1.0).abs() < 1e-2, "{up} N and {down} N");
        // Flat faces that touch the ball around the node let it hang by up to edge²/(4 R) below.
        let hangs = -0.0049 - row["probe.top.displacement.z"];
        assert!((-1e-6..6.3e-4).contains(&hangs), "{hangs} m below the ball");
        let out = tempfile::tempdir().unwrap();
        let balance = run(&text, out.path()).energy_balance.unwrap();
        assert!(balance < 0.01, "{balance}");
    }
}

/// A ball that grows presses like one that moves. Pictures show its present size, and explicit and implicit
/// runs find the same force.
#[test]
fn a_ball_that_grows_presses_a_body() {
    let small =
        "shape = { sphere = { radius = 0.01 } }\nat = [0.02, 0.02, 0.0301]\nby = [0, 0, -0.005]\nto = 0.2";
    let grown = "shape = { sphere = { radius = 0.008 } }\nat = [0.02, 0.02, 0.0301]\ngrows = { by = 0.005, to = 0.2 }\n";
    let shown = "[output.all]\ntype = 'vtu'\nevery = 0.5\ndata = ['displacement']\n";
    let mut forces = Vec::new();
    for solver in ["", "solver = 'implicit'\nstep = 0.01"] {
        let text = pressed(solver, shown)
            .replace(small, grown)
            // A barrier needs a gap to begin with.
            .replace("shape = 'half-space'\n", "shape = 'half-space'\nat = [0, 0, -0.0001]\n");
        let row = last_row(&text);
        let (up, down) = (row["contact.above.z"], row["contact.below.z"]);
        println!("{up} N on the ball, {down} N on the floor, top at {} m", row["probe.top.displacement.z"]);
        assert!((up / -down - 1.0).abs() < 1e-2, "{up} N and {down} N");
        forces.push(up);
        let out = tempfile::tempdir().unwrap();
        run(&text, out.path());
        let mesh = pliant_geometry::io::read(&out.path().join("all/000001.vtu")).unwrap().mesh;
        let moved = &mesh.point_data["displacement"].values;
        let places = mesh.points.iter().zip(moved.chunks_exact(3));
        let top = places.map(|(x, u)| x.z + u[2]).fold(f64::NEG_INFINITY, f64::max);
        assert!((top - 0.0431).abs() < 1e-9, "{top}");
    }
    assert!((forces[0] / forces[1] - 1.0).abs() < 0.05, "{forces:?}");
}

/// A tool presses a body on a GPU as on the CPU in double precision. Both find impulses to a thousandth of
/// the deepest gap predicted, with faces in another order. A stable step predicts at most four times the
/// depth that forces hold, (ω Δt)² ≤ 4.
#[cfg(feature = "gpu")]
#[test]
fn a_tool_presses_a_body_on_a_device() {
    if !crate::has_gpu() {
        return;
    }
    let [cpu, gpu] = ["device = 'cpu'", "device = 'gpu'"].map(|run| last_row(&pressed(run, "")));
    for contact in ["above", "below"] {
        let [a, b] = [&cpu, &gpu].map(|row| row[&format!("contact.{contact}.z")]);
        println!("{contact}: {a} N on the CPU, {b} N on the GPU");
        assert!((b / a - 1.0).abs() < 4e-3, "{contact}: {a} N and {b} N");
    }
    let [a, b] = [&cpu, &gpu].map(|row| row["probe.top.displacement.z"]);
    assert!((b / a - 1.0).abs() < 4e-3, "top moved by {a} m and {b} m");
}

/// A block on a floor with a smaller lid of other cells that falls onto it and is pulled along by gravity.
pub(super) fn stacked(run: &str, more: &str) -> String {
    format!(
        "[scene]\nuntil = 1.0\ngravity = [1, 0, -9.81]\n[run]\n{run}\n\
         [law.tissue]\ntype = 'neo-hookean'\nyoung-modulus = 2e4\npoisson-ratio = 0.4\n\
         [body.block]\nmesh = {{ block = {{ size = [0.04, 0.04, 0.02], cells = [6, 6, 3] }}, as = 'hexes' }}\n\
         law = 'tissue'\ndensity = 1000\ndamping = 60\n\
         [body.lid]\nmesh = {{ block = {{ size = [0.03, 0.03, 0.02], cells = [4, 4, 3] }}, as = 'tets', at = [0.005, 0.005, 0.0205] }}\n\
         law = 'tissue'\ndensity = 1000\ndamping = 60\n\
         [obstacle.floor]\nshape = 'half-space'\n\
         [contact.below]\nbetween = ['block', 'floor']\nfriction = 0.5\n\
         [contact.above]\nbetween = ['lid', 'block']\nfriction = 0.3\nthickness = 0\n\
         [output.history]\ntype = 'csv'\nevery = 1\nenergy = true\n\
         probes.top = {{ on = 'lid', at = [0.02, 0.02, 0.0405], data = ['displacement'] }}\n{more}"
    )
}

/// A lid of tets lies on a block of hexes: the forces between them and on the floor are the weights, single
/// precision like double.
#[test]
fn a_body_lies_on_another_one() {
    for precision in ["", "precision = 'single'"] {
        let row = last_row(&stacked(precision, ""));
        let weights =
            [0.03 * 0.03 * 0.02, 0.03 * 0.03 * 0.02 + 0.04 * 0.04 * 0.02].map(|volume| volume * 1000.0);
        let (between, floor) =
            (["x", "z"].map(|c| row[&format!("contact.above.{c}")]), row["contact.below.z"]);
        let moved = row["probe.top.displacement.z"];
        println!(
            "{between:?} N between the bodies, {floor} N on the floor, weights {weights:?} kg, lid at {moved} m"
        );
        assert!((between[1] / (-9.81 * weights[0]) - 1.0).abs() < 0.01, "{between:?}");
        assert!((between[0] / weights[0] - 1.0).abs() < 0.05, "{between:?}");
        assert!((floor / (-9.81 * weights[1]) - 1.0).abs() < 0.01, "{floor}");
        assert!(moved < -5e-4 && moved > -1.2e-3 && row["energy.balance"] < 0.02, "{moved}");
    }
}

/// A lid falls onto a block, slides and comes to rest, and the block on its floor. The GPU agrees with the
/// CPU in double precision.
#[cfg(feature = "gpu")]
#[test]
fn a_body_lies_on_another_one_on_a_device() {
    if !crate::has_gpu() {
        return;
    }
    let [cpu, gpu] = ["device = 'cpu'", "device = 'gpu'"].map(|run| last_row(&stacked(run, "")));
    for column in ["contact.above.x", "contact.above.z", "contact.below.z", "probe.top.displacement.z"] {
        let [a, b] = [&cpu, &gpu].map(|row| row[column]);
        println!("{column}: {a} on the CPU, {b} on the GPU");
        assert!((b / a - 1.0).abs() < 4e-3, "{column}: {a} and {b}");
    }
}

/// `"all"` is all pairs, each with its force; the result does not depend on the order in which bodies are
/// named.
#[test]
fn all_touch_all() {
    let named = last_row(&stacked("", ""));
    let table = "[contact.every]\nbetween = ['all', 'all']\nfriction = 0.3\n[output.history]";
    let text = stacked("", "");
    let (start, rest) = text.split_once("[contact.below]").unwrap();
    let (_, end) = rest.split_once("[output.history]").unwrap();
    let row = last_row(&format!("{start}{table}{end}"));
    let columns: Vec<&String> =
        row.keys().filter(|name| name.starts_with("contact.") && name.ends_with(".z")).collect();
    println!("{columns:?}");
    let (between, floor) = (row["contact.every.block-lid.z"], row["contact.every.block-floor.z"]);
    assert!((between / named["contact.above.z"] + 1.0).abs() < 0.02, "{between}");
    assert!((floor / named["contact.below.z"] - 1.0).abs() < 0.02, "{floor}");
    let turned = text.replace("['lid', 'block']", "['block', 'lid']");
    let other = last_row(&turned);
    assert_eq!(other["contact.above.z"], -named["contact.above.z"]);
    assert_eq!(other["probe.top.displacement.x"], named["probe.top.displacement.x"]);
}

/// Contact does not change the critical time step.
#[test]
fn contact_leaves_the_critical_step_as_it_is() {
    let with = world(&pressed("", "")).unwrap();
    let text = pressed("", "");
    let (before, _) = text.split_once("[contact.below]").unwrap();
    let (_, after) = text.split_once("[output.history]").unwrap();
    let without = world(&format!("{before}[output.history]{after}")).unwrap();
    assert_eq!(with.step(), without.step());
}

#[test]
fn a_resumed_run_in_contact_ends_in_the_same_bits() {
    let text = pressed("step = 2e-4\ncheckpoint = { every = 0.4 }", "");
    resumes(&text.replace("until = 0.5", "until = 1").replace("every = 0.5", "every = 1"));
}

/// A table of poses moves a tool; a grid of tools and bodies comes out as one mesh.
#[test]
fn tools_follow_tables_of_poses_and_are_written_with_the_bodies() {
    let place = tempfile::tempdir().unwrap();
    let poses = place.path().join("poses.csv");
    std::fs::write(&poses, "t,x,y,z,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n0.2,0,0,-0.005,1,0,0,0\n").unwrap();
    let moved = pressed("", "[output.all]\ntype = 'vtu'\nevery = 0.25\ndata = ['displacement']\n")
        .replace("by = [0, 0, -0.005]\nto = 0.2", &format!("poses = '{}'", poses.display()));
    let out = tempfile::tempdir().unwrap();
    run(&moved, out.path());
    let bytes = std::fs::read(out.path().join("out/all/000002.vtu"))
        .or_else(|_| std::fs::read(out.path().join("all/000002.vtu")));
    assert!(bytes.unwrap().len() > 1000);
}

/// A table that jumps by 30 mm within 0.1 ms is followed at 10 m/s, and the tool catches up.
#[test]
fn jumps_of_poses_are_slowed_and_told() {
    let place = tempfile::tempdir().unwrap();
    let poses = place.path().join("poses.csv");
    let rows = ["0,0,0,0", "0.1,0,0,0", "0.1001,0,0,0.03", "0.102,0,0,0.03", "0.2,0,0,0.02"];
    let text: String = rows.iter().map(|row| format!("{row},1,0,0,0\n")).collect();
    std::fs::write(&poses, text).unwrap();
    let text =
        pressed("", "").replace("by = [0, 0, -0.005]\nto = 0.2", &format!("poses = '{}'", poses.display()));
    let world = world(&text).unwrap();
    let note = world.notes().find(|note| note.contains("table of poses")).unwrap();
    assert!(
        note.contains("300.0 m/s from t = 0.1000 s on; Pliant moves it at 10 m/s, up to 0.002900 s late"),
        "{note}"
    );
    let contacts = world.participants[0].built.contacts.as_ref().unwrap();
    let ball = contacts.rigids.iter().find(|rigid| rigid.name == "ball").unwrap();
    let height = |time: f64| ball.at(time, None).translation.z - ball.at(0.0, None).translation.z;
    for (time, expected) in [(0.1, 0.0), (0.1015, 0.015), (0.103, 0.03), (0.2, 0.02)] {
        assert!((height(time) - expected).abs() < 1e-12, "{} m at {time} s", height(time));
    }
}

/// The pressed block with another text in place of one.
fn with(from: &str, to: &str) -> String {
    pressed("", "").replace(from, to)
}

#[test]
fn a_contact_of_names_that_cannot_touch_is_refused() {
    for (text, pieces) in [
        (
            with("['block', 'ball']", "['block', 'bal']"),
            ["there is no body, obstacle or tool `bal`", "did you mean `ball`?"],
        ),
        (
            with("['block', 'ball']", "['blok', 'ball']"),
            ["there is no body, obstacle or tool `blok`", "did you mean `block`?"],
        ),
        (with("['block', 'ball']", "['floor', 'ball']"), ["this contact has no body", "name a body first"]),
        (with("[tool.ball]", "[tool.floor]"), ["`floor` is an obstacle already", ""]),
    ] {
        assert_refused(&text, &pieces);
    }
}

#[test]
fn bodies_that_overlap_at_the_start_or_have_no_inside_are_refused() {
    for (text, pieces) in [
        (
            with(
                "radius = 0.01 } }\nat = [0.02, 0.02, 0.0301]",
                "radius = 0.002 } }\nat = [0.0225, 0.0225, 0.0195]",
            ),
            ["of `block` lie in `ball` at the start, up to 0.001", "move one of them"],
        ),
        (
            with("0.0301]", "0.025]"),
            ["of `block` lie in `ball` at the start, up to 0.005", "move one of them"],
        ),
        (
            stacked("", "").replace("at = [0.005, 0.005, 0.0205]", "at = [0.005, 0.005, 0.019]"),
            ["`lid` and `block` overlap at the start in", "up to 0.001000 m deep"],
        ),
        (
            stacked(
                "",
                "[law.skin]\ntype = 'neo-hookean'\nyoung-modulus = 1e5\npoisson-ratio = 0.45\n\
                     [body.capsule]\non = 'block'\nmodel = 'membrane'\nlaw = 'skin'\nthickness = 1e-4\ndensity = 1000\n\
                     [contact.skin]\nbetween = ['capsule', 'lid']\n",
            ),
            ["only solids can touch each other, and `capsule` is not a solid", "name the solid under it"],
        ),
    ] {
        assert_refused(&text, &pieces);
    }
}

#[test]
fn shapes_and_friction_that_cannot_be_are_refused() {
    for (text, pieces) in [
        (with("radius = 0.01", "radius = 0"), ["radius", ""]),
        (
            with("{ sphere = { radius = 0.01 } }", "{ box = { size = [0.01, 0, 0.01] } }"),
            ["the box has no volume", ""],
        ),
        (with("friction = 0.2", "friction = -1"), ["friction", ""]),
    ] {
        assert_refused(&text, &pieces);
    }
}

#[test]
fn motions_that_cannot_be_are_refused_with_their_row() {
    let place = tempfile::tempdir().unwrap();
    let table = |name: &str, text: &str| {
        let path = place.path().join(name);
        std::fs::write(&path, text).unwrap();
        with("by = [0, 0, -0.005]\nto = 0.2", &format!("poses = '{}'", path.display()))
    };
    for (text, pieces) in [
        (
            with("by = [0, 0, -0.005]", "by = [0, 0, -0.005]\nposes = 'none.csv'"),
            ["`by`, `rotate` and `poses`", ""],
        ),
        (
            table("nan.csv", "0,0,0,0,1,0,0,0\n1,0,0,nan,1,0,0,0\n"),
            ["nan.csv:2: a row has 8 finite numbers", "unit quaternion"],
        ),
        (table("turn.csv", "0,0,0,0,1,1,0,0\n"), ["the quaternion has length 1.414", ""]),
        (table("back.csv", "1,0,0,0,1,0,0,0\n0,0,0,0,1,0,0,0\n"), ["its times do not increase", ""]),
    ] {
        assert_refused(&text, &pieces);
    }
}

#[test]
fn contact_is_refused_where_the_solver_or_the_device_has_none() {
    for (text, pieces) in [
        (
            pressed("device = 'gpu'", "").replace("['displacement']", "['gap']"),
            ["the field `gap` of contacts runs on the CPU only", "leave the field out"],
        ),
        (pressed("solver = 'quasi-static'", ""), ["contact is for the solvers `explicit`", "`quasi-static`"]),
        (
            pressed("solver = 'implicit'\nstep = 0.01", ""),
            ["contact `below` has no gap at the start", "move one"],
        ),
        (
            pressed("device = 'gpu'\ndesign = 'blocks'", ""),
            ["the design `blocks` does not support contact", "`gather`"],
        ),
        (
            pressed("device = 'gpu'", "")
                .replace("by = [0, 0, -0.005]", "grows = { by = 0.005 }\nby = [0, 0, 0]"),
            ["the growth of `ball` runs on the CPU only", ""],
        ),
    ] {
        assert_refused(&text, &pieces);
    }
}

#[test]
fn growth_that_cannot_be_is_refused() {
    for (text, pieces) in [
        (
            with("by = [0, 0, -0.005]", "grows = { by = -0.02 }\nby = [0, 0, -0.005]"),
            ["the shape shrinks by 0.02000 m, but its radius is 0.01000 m", "shrink by less"],
        ),
        (
            with("by = [0, 0, -0.005]", "inside = true\ngrows = { by = -0.001 }\nby = [0, 0, -0.005]"),
            [
                "`grows` reaches -0.001000 m, but only spheres and capsules without `inside` can shrink",
                "its smallest size",
            ],
        ),
        (
            with(
                "shape = 'half-space'",
                "shape = 'half-space'\ngrows = { by = 1, curve = { table = [[0, 0], [1, -0.001]] } }",
            ),
            ["only spheres and capsules without `inside` can", "grow from there"],
        ),
        (
            with(
                "{ sphere = { radius = 0.01 } }",
                "{ jaws = { length = 0.03, width = 0.01, thickness = 0.002 } }\ngrows = { by = 1 }",
            ),
            ["jaws do not grow", ""],
        ),
    ] {
        assert_refused(&text, &pieces);
    }
}
