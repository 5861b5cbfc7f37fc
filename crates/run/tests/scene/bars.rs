//! Bars and threads: ligaments between bodies, with every solver, and refusals.

use pliant_testing::scenes::{assert_rows_agree, last_row, resumes, run, world};

const LAW: &str = "[law.collagen]\ntype = 'neo-hookean'\nyoung-modulus = 1e6\npoisson-ratio = 0.3\n";

/// A bar of 0.2 m in four pieces, held above, with a force on its lower end. `time` is how long it runs.
fn hanging(solver: &str, bar: &str, force: f64, time: f64) -> String {
    format!(
        "[scene]\nuntil = {time}\n[run]\n{solver}\n{LAW}\
         [body.ligament]\nmodel = 'bar'\nmesh = {{ lines = [[[0, 0, 0.3], [0, 0, 0.1]]], edge = 0.05 }}\n\
         law = 'collagen'\ndensity = 1100\narea = 2e-6\n{bar}\n\
         [constraint.top]\ntype = 'fix'\nbody = 'ligament'\nnodes = {{ half-space = {{ point = [0, 0, 0.29], normal = [0, 0, 1] }} }}\n\
         [constraint.line]\ntype = 'fix'\nbody = 'ligament'\nnodes = 'all'\ncomponents = ['x', 'y']\n\
         [load.pull]\ntype = 'force'\non = 'ligament'\nnodes = {{ half-space = {{ point = [0, 0, 0.11], normal = [0, 0, -1] }} }}\n\
         total = [0, 0, {force}]\ncurve = 'smooth-step'\nto = 0.5\n\
         [output.history]\ntype = 'csv'\nevery = {time}\n\
         probes.end = {{ on = 'ligament', at = [0, 0, 0.1], data = ['displacement', 'axial-force', 'axial-stretch', 'energy-density'] }}\n"
    )
}

/// u = F L/(E A), by every solver.
#[test]
fn a_bar_is_longer_by_force_times_length_over_stiffness() {
    for solver in [
        "solver = 'static'\nload-steps = 2",
        "solver = 'quasi-static'\ntolerance = 1e-9",
        "solver = 'explicit'",
        "solver = 'implicit'\nstep = 0.02",
    ] {
        let settles = !solver.contains("static");
        let (bar, time) = if settles { ("damping = 40", 3.0) } else { ("", 1.0) };
        for (slack, from) in [(1.0, 0.0), (0.9, -0.02)] {
            let row = last_row(&hanging(solver, &format!("{bar}\nslack = {slack}"), -0.1, time));
            let stretch = 1.0 + 0.1 / (1e6 * 2e-6);
            let longer = 0.2 * slack * stretch - 0.2;
            let found = -row["probe.end.displacement.z"];
            assert!((found / longer - 1.0).abs() < 1e-6, "{solver} {slack} {from}: {found} for {longer}");
            assert!((row["probe.end.axial-force"] / 0.1 - 1.0).abs() < 1e-6, "{solver}");
            assert!((row["probe.end.axial-stretch"] / stretch - 1.0).abs() < 1e-6);
            assert!((row["reaction.top.z"] / 0.1 - 1.0).abs() < 1e-6);
            let energy = 0.5 * 0.1 * 0.2 * slack * (stretch - 1.0);
            assert!((row["probe.end.energy-density"] * 0.2 * 2e-6 / energy - 1.0).abs() < 1e-6);
        }
    }
}

/// A thread lets its end rise, a bar holds it; a slack thread pulls once it is taut.
#[test]
fn a_thread_takes_no_compression() {
    let solver = "solver = 'static'";
    let held = |bar: &str, by: f64| {
        let text = hanging(solver, bar, 0.0, 1.0).replace(", edge = 0.05", "");
        let (start, rest) = text.split_at(text.find("[load.pull]").unwrap());
        let output = &rest[rest.find("[output").unwrap()..];
        let moved = format!(
            "[constraint.end]\ntype = 'move'\nbody = 'ligament'\nnodes = {{ half-space = {{ point = [0, 0, 0.11], normal = [0, 0, -1] }} }}\n\
             components = ['z']\nby = [0, 0, {by}]\nto = 1\n"
        );
        last_row(&format!("{start}{moved}{output}"))["reaction.end.z"]
    };
    let stiffness = 1e6 * 2e-6;
    assert!((held("", 0.01) / (stiffness * 0.05) - 1.0).abs() < 1e-9);
    assert_eq!(held("tension-only = true", 0.01), 0.0);
    assert!((held("tension-only = true", -0.01) / (-stiffness * 0.05) - 1.0).abs() < 1e-9);
    assert_eq!(held("tension-only = true\nslack = 1.05", -0.01).abs(), 0.0);
    let taut = -stiffness * (0.22 / 0.21 - 1.0);
    assert!((held("tension-only = true\nslack = 1.05", -0.02) / taut - 1.0).abs() < 1e-9);
}

/// Two blocks of tissue, one held and one pulled away, joined by two ligaments whose ends are tied in them.
fn joined(solver: &str, more: &str) -> String {
    format!(
        "[scene]\nuntil = 1\n[run]\n{solver}\n{LAW}\
         [law.tissue]\ntype = 'neo-hookean'\nyoung-modulus = 3e4\npoisson-ratio = 0.4\n\
         [body.low]\nmesh = {{ block = {{ size = [0.04, 0.02, 0.02], cells = [4, 2, 2] }} }}\nlaw = 'tissue'\ndensity = 1000\n{more}\n\
         [body.high]\nmesh = {{ block = {{ size = [0.04, 0.02, 0.02], cells = [4, 2, 2] }}, at = [0, 0, 0.05] }}\nlaw = 'tissue'\ndensity = 1000\n{more}\n\
         [body.ligaments]\nmodel = 'bar'\nlaw = 'collagen'\ndensity = 1100\narea = 4e-6\n{more}\n\
         mesh = {{ lines = [[[0.011, 0.009, 0.012], [0.013, 0.011, 0.058]], [[0.031, 0.009, 0.012], [0.027, 0.011, 0.058]]] }}\n\
         [tie.below]\nbetween = ['ligaments', 'low']\nnodes = {{ half-space = {{ point = [0, 0, 0.03], normal = [0, 0, -1] }} }}\n\
         [tie.above]\nbetween = ['ligaments', 'high']\nnodes = {{ half-space = {{ point = [0, 0, 0.03], normal = [0, 0, 1] }} }}\n\
         [constraint.base]\ntype = 'fix'\nbody = 'low'\nnodes = {{ set = 'z-min' }}\n\
         [constraint.pull]\ntype = 'move'\nbody = 'high'\nnodes = {{ set = 'z-max' }}\nby = [0.002, 0, 0.004]\nto = 0.4\n\
         [output.history]\ntype = 'csv'\nevery = 4\n\
         probes.end = {{ on = 'low', at = [0.011, 0.009, 0.012] }}\n\
         probes.middle = {{ on = 'ligaments', at = [0.012, 0.01, 0.035], data = ['axial-force'] }}\n"
    )
}

#[test]
fn ligaments_tied_into_two_bodies_stand_where_every_solver_puts_them() {
    let newton = last_row(&joined("solver = 'static'\nload-steps = 4\ntolerance = 1e-10", ""));
    let force = newton["reaction.pull.z"];
    assert!(force > 0.05 && newton["probe.middle.axial-force"] > 0.3 * force, "{force}");
    for solver in [
        "solver = 'quasi-static'\nload-steps = 4\ntolerance = 1e-9",
        "solver = 'explicit'",
        "solver = 'implicit'\nstep = 0.05\ntolerance = 1e-10",
    ] {
        let still = solver.contains("static");
        let text = joined(solver, if still { "" } else { "damping = 40" });
        let other = last_row(&if still { text } else { text.replace("until = 1", "until = 4") });
        assert_rows_agree(solver, [&newton, &other], &[("displacement", 1e-5), ("axial-force", 1e-5)]);
    }
}

#[test]
fn energies_with_ligaments_balance_and_a_resumed_run_has_the_same_bits() {
    let out = tempfile::tempdir().unwrap();
    let relaxing = joined("solver = 'explicit'", "").replace(
        "[law.collagen]\n",
        "[law.collagen]\nprony = [{ part = 'isochoric', weight = 0.4, time = 0.2 }]\n",
    );
    let summary = run(&joined("solver = 'explicit'", ""), &out.path().join("elastic"));
    assert!(summary.energy_balance.unwrap().abs() < 0.01, "{:?}", summary.energy_balance);
    let summary = run(&relaxing, &out.path().join("relaxing"));
    assert_eq!(summary.status, "done");
    let checkpoints = ["solver = 'explicit'\nstep = 5e-5", "solver = 'implicit'\nstep = 0.1"];
    for text in [relaxing.replace("solver = 'explicit'", checkpoints[0]), joined(checkpoints[1], "")] {
        resumes(&text.replacen("[run]\n", "[run]\ncheckpoint = { every = 0.4 }\n", 1));
    }
}

#[test]
fn what_bars_cannot_be_is_refused_by_name() {
    let text = joined("solver = 'explicit'", "");
    let lines = text.lines().find(|line| line.starts_with("mesh = { lines")).unwrap();
    for (from, to, pieces) in [
        ("area = 4e-6", "", vec!["needs an `area`", "square metres"]),
        ("area = 4e-6", "area = 0", vec!["area"]),
        ("area = 4e-6", "area = 4e-6\nthickness = 0.1", vec!["`thickness` is for a shell or a membrane"]),
        ("area = 4e-6", "area = 4e-6\nelement = 'tet4'", vec!["`ligaments` is a bar", "one element"]),
        ("area = 4e-6", "area = 4e-6\nslack = 0", vec!["slack"]),
        (
            "between = ['ligaments', 'low']",
            "between = ['low', 'ligaments']",
            vec!["is a bar", "name it first"],
        ),
        (
            "young-modulus = 1e6\npoisson-ratio = 0.3",
            "young-modulus = 1e6\npoisson-ratio = 0.3\nfibre-modulus = 1e3",
            vec![],
        ),
        (lines, "mesh = { lines = [[[0, 0, 0]]] }", vec!["two points at least"]),
        (lines, "mesh = { lines = [[[0, 0, 0], [0, 0, 0]]] }", vec!["of no length"]),
        (
            lines,
            "mesh = { lines = [[[0, 0, 0], [0, 0, 1]]], edge = 1e-9 }",
            vec!["more than", "longer `edge`"],
        ),
        (lines, "mesh = { block = { size = [0.1, 0.1, 0.1] }, edge = 0.1 }", vec!["has no lines"]),
        (lines, "on = 'low'", vec!["where a bar has no place"]),
        ("[body.low]\n", "[body.low]\narea = 1\n", vec!["`area` is for `model = \"bar\"`"]),
        (
            "probes.end = { on = 'low', at = [0.011, 0.009, 0.012] }",
            "probes.end = { on = 'low', at = [0.011, 0.009, 0.012], data = ['axial-force'] }",
            vec!["axial-force"],
        ),
    ] {
        assert!(text.contains(from), "{from}");
        let message = world(&text.replacen(from, to, 1)).err().unwrap_or_else(|| panic!("accepted: {to}"));
        assert!(pieces.iter().all(|piece| message.contains(piece)), "{message}");
    }
    let fibres = text.replacen(
        "type = 'neo-hookean'\nyoung-modulus = 1e6",
        "type = 'transversely-isotropic'\nfibre = [0, 0, 1]\nfibre-modulus = 1e3\nyoung-modulus = 1e6",
        1,
    );
    let message = world(&fibres).err().unwrap();
    assert!(message.contains("has directions of its own") && message.contains("is a bar"), "{message}");
}
