//! Tools and moved nodes that push with no more than a force.

use pliant_run::OutputFolder;
use pliant_testing::scenes::{last_row, resumes, run, world};

use super::barriers;
use super::contact::pressed;

/// A finger that goes 60 mm through a block of 50 mm, by these keys.
fn through(finger: &str, until: f64) -> String {
    format!(
        "[scene]\nuntil = {until}\n[run]\n[law.soft]\ntype = 'neo-hookean'\nyoung-modulus = 3e3\npoisson-ratio = 0.45\n\
         [body.block]\nmesh = {{ block = {{ size = [0.1, 0.1, 0.05], cells = [8, 8, 4] }} }}\nlaw = 'soft'\ndensity = 1000\ndamping = 20\n\
         [constraint.base]\ntype = 'fix'\nbody = 'block'\nnodes = {{ half-space = {{ point = [0, 0, 1e-4], normal = [0, 0, -1] }} }}\n\
         [tool.finger]\nshape = {{ capsule = {{ radius = 0.008, length = 0.06 }} }}\nat = [0.05, 0.05, 0.09]\nby = [0, 0, -0.06]\n{finger}\n\
         [contact.feels]\nbetween = ['block', 'finger']\n\
         [output.history]\ntype = 'csv'\nevery = {until}\n"
    )
}

/// The tool stops where its force reaches the limit, and a warning says that it was held back.
#[test]
fn a_tool_driven_through_a_body_stops_at_its_limit() {
    for precision in ["", "precision = 'single'"] {
        let text = through("from = 0.1\nto = 0.6\nforce-limit = 2", 1.2);
        let text = text.replace("[run]\n", &format!("[run]\n{precision}\n"));
        let row = last_row(&text);
        let force = row["contact.feels.z"];
        println!("{force} N of 2 N");
        assert!((force / 2.0 - 1.0).abs() < 0.01, "{force} N");
        let out = tempfile::tempdir().unwrap();
        let summary = run(&text, out.path());
        let message = |text: &String| text.contains("`finger` was held back by its `force-limit`");
        assert!(summary.warnings.iter().any(message), "{:?}", summary.warnings);
        assert!(summary.energy_balance.unwrap() < 0.01);
    }
}

/// Called back, it goes along: it ends where one without a limit would, off the body.
#[test]
fn a_tool_that_was_held_back_goes_along_when_it_is_called_back() {
    let table = "curve = { table = [[0.1, 0], [0.6, 1], [0.8, 1], [1.4, 0]] }\nforce-limit = 2";
    let row = last_row(&through(table, 3.0));
    assert_eq!(row["contact.feels.z"], 0.0);
    let text = through(table, 3.0);
    let world = world(&text).unwrap();
    let mut simulation = world.simulation().unwrap();
    simulation.run(3.0, |_| ()).unwrap();
    let at = simulation.frame().unwrap().tool("finger").unwrap().pose.translation.z;
    assert!((at - 0.09).abs() < 1e-3, "at {at} m");
}

/// A limit that is not reached by half changes no bit.
#[test]
fn a_limit_that_is_far_away_changes_nothing() {
    let limited = |limit| last_row(&pressed("", "").replace("to = 0.2\n", &format!("to = 0.2\n{limit}\n")));
    assert_eq!(limited("force-limit = 50"), limited(""));
}

#[test]
fn a_resumed_run_with_a_limit_ends_in_the_same_bits() {
    let text = through("from = 0.1\nto = 0.6\nforce-limit = 2", 1.0);
    resumes(&text.replace("[run]\n", "[run]\nstep = 2e-3\ncheckpoint = { every = 0.35 }\n"));
}

/// The largest and the last number of a column.
fn most_and_last(text: &str, column: &str) -> (pliant_run::Summary, f64, f64) {
    let out = tempfile::tempdir().unwrap();
    let summary = run(text, &out.path().join("out"));
    let table = std::fs::read_to_string(out.path().join("out/history.csv")).unwrap();
    let mut rows = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let column = rows.next().unwrap().iter().position(|name| *name == column).unwrap();
    let forces: Vec<f64> = rows.map(|row| row[column].parse::<f64>().unwrap()).collect();
    (summary, forces.iter().copied().map(f64::abs).fold(0.0, f64::max), forces[forces.len() - 1].abs())
}

/// Returns the warnings that something was held back.
fn warnings(summary: &pliant_run::Summary) -> Vec<&String> {
    summary.warnings.iter().filter(|text| text.contains("was held back by its `force-limit`")).collect()
}

/// A barrier stops the tool at its limit, in time and as equilibria. In no step the force is above the limit,
/// and no bodies intersect.
#[test]
fn a_tool_stops_at_its_limit_under_a_barrier() {
    for run_table in ["solver = 'implicit'\nstep = 0.02", "solver = 'static'\nload-steps = 60"] {
        let text = through("from = 0.1\nto = 0.6\nforce-limit = 2", 1.2)
            .replace("[run]\n", &format!("[run]\n{run_table}\n"))
            .replace("['block', 'finger']\n", "['block', 'finger']\ncheck-intersections = true\n")
            .replace("every = 1.2", "every = 0.02");
        let (summary, most, last) = most_and_last(&text, "contact.feels.z");
        let warnings = warnings(&summary);
        assert!(warnings.len() == 1 && warnings[0].contains("`finger`"), "{:?}", summary.warnings);
        println!("{run_table}: {last} N in the end, {most} N at most; {}", warnings[0]);
        assert!((last / 2.0 - 1.0).abs() < 0.015 && most < 2.04, "{last} {most}");
    }
}

/// Called back, it goes along, off the body, and a limit that is far away changes no bit, with barriers as
/// well.
#[test]
fn a_tool_with_a_limit_is_called_back_from_a_barrier() {
    let table = "curve = { table = [[0.1, 0], [0.6, 1], [0.8, 1], [1.4, 0]] }\nforce-limit = 2";
    let text = through(table, 3.0).replace("[run]\n", "[run]\nsolver = 'implicit'\nstep = 0.02\n");
    let world = world(&text).unwrap();
    let mut simulation = world.simulation().unwrap();
    simulation.run(3.0, |_| ()).unwrap();
    let finger = simulation.frame().unwrap().tool("finger").unwrap();
    assert!((finger.pose.translation.z - 0.09).abs() < 1e-3 && finger.force == [0.0; 3], "{finger:?}");
    let implicit = "solver = 'implicit'\nstep = 0.02";
    let limited = |limit| {
        last_row(
            &barriers::pressed(implicit, barriers::HELD)
                .replace("to = 0.4\n", &format!("to = 0.4\n{limit}\n")),
        )
    };
    assert_eq!(limited("force-limit = 50"), limited(""));
}

#[test]
fn a_resumed_run_with_a_limit_under_a_barrier_ends_in_the_same_bits() {
    let text = through("from = 0.1\nto = 0.6\nforce-limit = 2", 1.0);
    resumes(
        &text.replace("[run]\n", "[run]\nsolver = 'implicit'\nstep = 0.02\ncheckpoint = { every = 0.4 }\n"),
    );
}

/// A plate whose upper nodes are moved 30 mm down onto a block of 20 mm, by these keys.
fn driven(run: &str, push: &str, until: f64) -> String {
    format!(
        "[scene]\nuntil = {until}\n[run]\n{run}\n[law.soft]\ntype = 'neo-hookean'\nyoung-modulus = 3e3\npoisson-ratio = 0.3\n\
         [law.hard]\ntype = 'neo-hookean'\nyoung-modulus = 3e4\npoisson-ratio = 0.3\n\
         [body.block]\nmesh = {{ block = {{ size = [0.04, 0.04, 0.02], cells = [4, 4, 2] }} }}\nlaw = 'soft'\ndensity = 1000\ndamping = 20\n\
         [body.plate]\nmesh = {{ block = {{ size = [0.03, 0.03, 0.005], cells = [3, 3, 1] }}, at = [0.0051, 0.0052, 0.021] }}\nlaw = 'hard'\n\
         density = 1000\ndamping = 20\n\
         [constraint.base]\ntype = 'fix'\nbody = 'block'\nnodes = {{ set = 'z-min' }}\n\
         [constraint.push]\ntype = 'move'\nbody = 'plate'\nnodes = {{ set = 'z-max' }}\nby = [0, 0, -0.03]\n{push}\n\
         [contact.feels]\nbetween = ['block', 'plate']\ncheck-intersections = true\n\
         [output.history]\ntype = 'csv'\nevery = 0.02\nprobes.top = {{ on = 'plate', at = [0.0051, 0.0052, 0.026], data = ['displacement'] }}\n"
    )
}

/// Moved nodes that press a body onto another stop where their reaction is the limit, in time and as
/// equilibria. Without a limit they squash it.
#[test]
fn moved_nodes_stop_at_their_limit_under_a_barrier() {
    for run_table in ["solver = 'implicit'\nstep = 0.02", "solver = 'static'\nload-steps = 50"] {
        let text = driven(run_table, "to = 0.5\nforce-limit = 0.5", 1.0);
        let (summary, most, last) = most_and_last(&text, "reaction.push.z");
        let warnings = warnings(&summary);
        assert!(warnings.len() == 1 && warnings[0].contains("`push`"), "{:?}", summary.warnings);
        println!("{run_table}: {last} N in the end, {most} N at most; {}", warnings[0]);
        assert!((last / 0.5 - 1.0).abs() < 0.015 && most < 0.51, "{last} {most}");
    }
}

/// Nodes that stretch a body stop at their limit, without contact, and in steps that are not iterated, too.
#[test]
fn moved_nodes_that_stretch_a_body_stop_at_their_limit() {
    for run_table in [
        "solver = 'implicit'\nstep = 0.02",
        "solver = 'implicit'\nstep = 0.01\niterations = 1",
        "solver = 'static'\nload-steps = 50",
    ] {
        let text = driven(run_table, "to = 0.5\nforce-limit = 0.5", 1.0)
            .replace("body = 'plate'\nnodes", "body = 'block'\nnodes")
            .replace("by = [0, 0, -0.03]", "by = [0, 0, 0.03]");
        let (from, to) = (text.find("[body.plate]").unwrap(), text.find("[constraint.base]").unwrap());
        let text = text
            .replace(&text[from..to], "")
            .replace("probes.top = { on = 'plate'", "probes.top = { on = 'block'");
        let (from, to) = (text.find("[contact.feels]").unwrap(), text.find("[output.history]").unwrap());
        let (_, most, last) = most_and_last(&text.replace(&text[from..to], ""), "reaction.push.z");
        println!("{run_table}: {last} N in the end, {most} N at most");
        assert!((last / 0.5 - 1.0).abs() < 0.015 && most < 0.515, "{last} {most}");
    }
}

/// Called back they are where their motion leads, a limit that is far away changes no bit, and a resumed run
/// has the same ones.
#[test]
fn moved_nodes_with_a_limit_are_called_back_and_resumed() {
    let implicit = "solver = 'implicit'\nstep = 0.02";
    let table = "curve = { table = [[0, 0], [0.3, 1], [0.4, 1], [0.7, 0]] }\nforce-limit = 0.5";
    let row = last_row(&driven(implicit, table, 2.5));
    assert!(row["probe.top.displacement.z"].abs() < 1e-4 && row["contact.feels.z"] == 0.0, "{row:?}");
    let gentle = |limit: &str| {
        last_row(&driven(implicit, limit, 0.4).replace("by = [0, 0, -0.03]", "by = [0, 0, -0.003]"))
    };
    assert_eq!(gentle("force-limit = 50"), gentle(""));
    resumes(&driven(
        &format!("{implicit}\ncheckpoint = {{ every = 0.4 }}"),
        "to = 0.5\nforce-limit = 0.5",
        1.0,
    ));
}

/// Without a limit a cell is inverted, and the message names the tool.
#[test]
fn the_failure_of_a_body_that_a_tool_goes_through_names_the_tool() {
    let world = world(&through("from = 0.1\nto = 0.6", 1.0)).unwrap();
    let out = tempfile::tempdir().unwrap();
    let folder = OutputFolder::prepare(out.path().join("out"), &world.scene, false).unwrap();
    let summary = pliant_run::run(&world, &folder, &mut |_| ()).unwrap();
    let failure = summary.error.unwrap().to_string();
    assert!(failure.contains("where `finger` pushes too hard, give it a `force-limit`"), "{failure}");
}

/// A table that rises against the held side of a block stops before it, and the failure reports the force.
/// The force is the force of its barrier at the remaining gap. Moved nodes do the same.
#[test]
fn what_is_blocked_tells_its_force() {
    let (side, distance, stiffness) = (0.04, 1e-3, 1e5);
    let scene = |table: &str, base: &str, solver: &str| {
        format!(
            "[scene]\nuntil = 0.1\n[run]\n{solver}\n[law.soft]\ntype = 'neo-hookean'\nyoung-modulus = 1e5\npoisson-ratio = 0\n\
             [body.block]\nmesh = {{ block = {{ size = [{side}, {side}, 0.02], cells = [2, 2, 1] }} }}\nlaw = 'soft'\ndensity = 1000\n\
             [constraint.base]\ntype = '{base}'\nbody = 'block'\nnodes = {{ set = 'z-min' }}\n\
             [obstacle.table]\nshape = 'half-space'\nat = [0, 0, -0.0103]\n{table}\n\
             [contact.below]\nbetween = ['block', 'table']\nfaces = {{ set = 'z-min' }}\nbarrier-distance = {distance}\n\
             barrier-stiffness = {stiffness}\ncheck-intersections = true\n"
        )
    };
    for (table, base, driver) in [
        ("by = [0, 0, 0.02]\nto = 0.1", "fix'\n#", "table"),
        ("", "move'\nby = [0, 0, -0.02]\nto = 0.1\n#", "base"),
    ] {
        for solver in ["solver = 'implicit'\nstep = 0.02", "solver = 'static'\nload-steps = 5"] {
            let world = world(&scene(table, base, solver)).unwrap();
            let out = tempfile::tempdir().unwrap();
            let folder = OutputFolder::prepare(out.path().join("out"), &world.scene, false).unwrap();
            let failure = pliant_run::run(&world, &folder, &mut |_| ()).unwrap().error.unwrap();
            let blocked = failure.blocked.as_ref().unwrap_or_else(|| panic!("{failure}"));
            let y = blocked.gap / distance;
            let pressure = stiffness * (2.0 * (y - 1.0) * y.ln() + (y - 1.0).powi(2) / y);
            println!(
                "{driver}: {} N, {} m, {} N by the law; {failure}",
                blocked.force,
                blocked.gap,
                pressure * side * side
            );
            assert!(failure.kind.word() == "blocked" && blocked.driver == driver, "{failure}");
            assert!((blocked.force / (pressure * side * side) - 1.0).abs() < 1e-4, "{failure}");
            assert!(failure.message.contains(&format!("`{driver}` is blocked, pushing with")), "{failure}");
        }
    }
}

/// Explicit runs limit the forces of tools alone, and nodes that lag are no other constraint's.
#[test]
fn limits_of_moved_nodes_that_cannot_be_kept_are_refused() {
    let error = world(&driven("solver = 'explicit'", "force-limit = 2", 1.0)).unwrap_err();
    assert!(error.contains("the solver `explicit` cannot limit the force of `push`"), "{error}");
    let text = driven("solver = 'static'", "force-limit = 2", 1.0);
    let shared = "[constraint.also]\ntype = 'fix'\nbody = 'plate'\nnodes = { set = 'x-min' }\n";
    let error = world(&format!("{text}{shared}")).unwrap_err();
    assert!(error.contains("`push`") && error.contains("`also`"), "{error}");
}

#[test]
fn a_limit_that_is_none_is_refused() {
    for limit in ["-1", "0", "'much'"] {
        let error = world(&through(&format!("force-limit = {limit}"), 1.0)).unwrap_err();
        assert!(error.contains("force-limit"), "{error}");
    }
}
