//! Motions, loads and rigid things whose curves do not begin at 0, with every solver. Runs in time begin
//! where the curves say, at rest; `quasi-static` finds an equilibrium there, and `static` gets there in its
//! first load step. Energy stored at the start is external work.

use std::collections::BTreeMap;
use std::fs;

use pliant_testing::scenes::{run, world};
use tempfile::TempDir;

/// The time that runs take.
const UNTIL: f64 = 0.1;

/// Curves that begin complete, or begin at a half and grow to the whole, with their values at t = 0.
const CURVES: [(&str, f64); 2] =
    [("curve = 'hold'", 1.0), ("curve = { table = [[0, 0.5], [0.02, 1], [0.1, 1]] }", 0.5)];

/// A curve with the same end that begins at 0.
const FROM_ZERO: &str = "curve = 'smooth-step'\nto = 0.02";

/// Solvers of solids, and whether they are at t = 0 where their curves say.
const SOLVERS: [(&str, bool); 5] = [
    ("solver = 'explicit'\nprecision = 'double'\nstep = 2e-4", true),
    ("solver = 'explicit'\nprecision = 'single'\nstep = 2e-4", true),
    ("solver = 'quasi-static'\nload-steps = 5\nprecision = 'double'\ntolerance = 1e-8", true),
    ("solver = 'static'\nload-steps = 5", false),
    ("solver = 'implicit'\nstep = 5e-4", true),
];

/// A cube of 10 mm, held below.
fn cube(solver: &str, more: &str) -> String {
    format!(
        "[scene]\nuntil = {UNTIL}\n[run]\n{solver}\n\
         [law.a]\ntype = 'neo-hookean'\nyoung-modulus = 1e4\npoisson-ratio = 0.3\n\
         [body.b]\nmesh = {{ block = {{ size = [0.01, 0.01, 0.01], cells = [2, 2, 2] }}, as = 'hexes' }}\n\
         element = 'hex8-full'\nlaw = 'a'\ndensity = 1000\ndamping = 600\n\
         [constraint.low]\ntype = 'fix'\nbody = 'b'\nnodes = {{ set = 'z-min' }}\n\
         [output.history]\ntype = 'csv'\nevery = 0.005\n\
         probes.top = {{ on = 'b', at = [0.01, 0.01, 0.01] }}\nprobes.middle = {{ on = 'b', at = [0.01, 0.01, 0.005] }}\n{more}"
    )
}

/// A plate of 20 × 10 mm of curved shells, held at one end.
fn plate(solver: &str, more: &str) -> String {
    format!(
        "[scene]\nuntil = {UNTIL}\n[run]\n{solver}\n\
         [law.a]\ntype = 'neo-hookean'\nyoung-modulus = 1e6\npoisson-ratio = 0.3\n\
         [body.b]\nmodel = 'shell'\nmesh = {{ plate = {{ size = [0.02, 0.01], cells = [4, 2] }} }}\n\
         law = 'a'\ndensity = 1000\nthickness = 0.001\ndamping = 600\n\
         [constraint.low]\ntype = 'fix'\nbody = 'b'\nnodes = {{ set = 'x-min' }}\n\
         [output.history]\ntype = 'csv'\nevery = 0.005\n\
         probes.top = {{ on = 'b', at = [0.02, 0, 0] }}\nprobes.middle = {{ on = 'b', at = [0.01, 0.005, 0] }}\n{more}"
    )
}

type Row = BTreeMap<String, f64>;

/// The first and the last row of the table of a run.
fn ends(text: &str) -> [Row; 2] {
    let out = TempDir::new().unwrap();
    run(text, out.path());
    let table = fs::read_to_string(out.path().join("history.csv")).unwrap();
    let names: Vec<String> = table.lines().next().unwrap().split(',').map(str::to_owned).collect();
    let row = |line: &str| {
        names.iter().cloned().zip(line.split(',').map(|value| value.parse().unwrap())).collect::<Row>()
    };
    [row(table.lines().nth(1).unwrap()), row(table.lines().last().unwrap())]
}

/// The largest difference of columns whose names begin with a word, over the largest of them in the second
/// row.
fn off(word: &str, [one, other]: [&Row; 2]) -> f64 {
    let of_word = || other.iter().filter(|(name, _)| name.starts_with(word));
    let largest = of_word().map(|(_, value)| value.abs()).fold(0.0, f64::max);
    of_word().map(|(name, value)| (value - one[name]).abs()).fold(0.0, f64::max) / largest
}

/// A run under a curve ends where one from 0 ends. At t = 0 it stands where its curve says, or at rest.
/// Energies are balanced.
#[track_caller]
fn begins_where_its_curve_says(
    what: &str,
    text: impl Fn(&str) -> String,
    stands: bool,
    place: Option<[f64; 3]>,
) {
    let [_, wanted] = ends(&text(FROM_ZERO));
    for (curve, share) in CURVES {
        let [first, last] = ends(&text(curve));
        // A pressure within holds itself: what holds the body is round-off.
        let force = if what.contains("volume") { "pressure" } else { "reaction" };
        let [probes, reactions] = ["probe", force].map(|word| off(word, [&last, &wanted]));
        let energy = |row: &Row, name: &str| row[&format!("energy.{name}")];
        println!("{what}, {curve}: probes {probes:.1e}, forces {reactions:.1e}");
        // A rest of the vibration of a sudden start, and of the error that a load step allows.
        assert!(probes < 2e-3 && reactions < 2e-3, "{what}, {curve}: {probes:e} {reactions:e}");
        if let Some(place) = place {
            for (axis, whole) in ["x", "y", "z"].iter().zip(place) {
                let found = first[&format!("probe.top.displacement.{axis}")];
                let wanted = if stands { share * whole } else { 0.0 };
                assert!(
                    (found - wanted).abs() < 1e-8,
                    "{what}, {curve}: {axis} {found} for {wanted} at t = 0"
                );
            }
        }
        let [stored, given] = ["internal", "external"].map(|name| energy(&first, name));
        if place.is_some() && stands {
            assert!(stored > 0.0, "{what}, {curve}: {stored:e} J at the start");
        }
        // An equilibrium at t = 0 was found in parts, whose work is a sum of trapezia.
        let limit = if what.contains("load-steps") { 0.05 } else { 1e-6 };
        assert!(
            (stored - given).abs() <= limit * stored,
            "{what}, {curve}: {stored:e} J of {given:e} J at t = 0"
        );
        let taken = ["kinetic", "internal", "damping", "hourglass"].map(|name| energy(&last, name));
        // Explicit steps have a balance of their own, which knows what a sudden start keeps from the mean
        // velocity.
        let (balance, limit) = match what.contains("explicit") {
            true => (energy(&last, "balance"), 0.01),
            // Trapezia of few load steps.
            false => (taken.iter().sum::<f64>() / energy(&last, "external") - 1.0, 0.05),
        };
        assert!(balance.abs() < limit, "{what}, {curve}: energies off by {balance}");
    }
}

#[test]
fn motions_of_solids_begin_where_their_curves_say() {
    let head = "[constraint.hand]\nbody = 'b'\nnodes = { set = 'z-max' }\n";
    let (sine, cosine) = 0.2_f64.sin_cos();
    let turned = [0.005 * (cosine - sine) - 0.005, 0.005 * (sine + cosine) - 0.005, 0.0];
    for (solver, stands) in SOLVERS {
        let motion = |keys: &str| {
            let keys = keys.to_owned();
            move |curve: &str| cube(solver, &format!("{head}{keys}\n{curve}\n"))
        };
        let by = "type = 'move'\nby = [0.0003, 0, 0.001]";
        begins_where_its_curve_says(&format!("{solver}: by"), motion(by), stands, Some([3e-4, 0.0, 1e-3]));
        let by = "type = 'move'\nby = [0.0003, 0, 0.001]\ncomponents = ['z']";
        begins_where_its_curve_says(&format!("{solver}: z"), motion(by), stands, None);
        let rotate = "type = 'move'\nrotate = { axis = [0, 0, 1], centre = [0.005, 0.005, 0], angle = 0.2 }";
        let text = motion(rotate);
        let half = 0.1_f64.sin_cos();
        let place = |curve: &str| if curve.contains("0.5") { half } else { (sine, cosine) };
        for (curve, _) in CURVES.iter().filter(|_| stands) {
            let (sine, cosine) = place(curve);
            let [first, _] = ends(&text(curve));
            let wanted = [0.005 * (cosine - sine) - 0.005, 0.005 * (sine + cosine) - 0.005];
            for (axis, wanted) in ["x", "y"].iter().zip(wanted) {
                assert!((first[&format!("probe.top.displacement.{axis}")] - wanted).abs() < 1e-8);
            }
        }
        let [_, last] = ends(&text("curve = 'hold'"));
        for (axis, wanted) in ["x", "y", "z"].iter().zip(turned) {
            assert!((last[&format!("probe.top.displacement.{axis}")] - wanted).abs() < 1e-8, "{solver}");
        }
        begins_where_its_curve_says(&format!("{solver}: rotate"), text, stands, None);
        // An equilibrium bulges under the plate.
        let pressed = (!solver.contains("quasi")).then_some([0.0, 0.0, -1e-3]);
        let mean = "type = 'mean'\nby = [0, 0, -0.001]";
        begins_where_its_curve_says(&format!("{solver}: mean"), motion(mean), stands, pressed);
        let volume = "type = 'volume'\nby = 2e-8";
        let volume =
            |curve: &str| cube(solver, &format!("[constraint.air]\nbody = 'b'\n{volume}\n{curve}\n"));
        begins_where_its_curve_says(&format!("{solver}: volume"), volume, stands, None);
        for (curve, share) in CURVES {
            let [first, last] = ends(&volume(curve));
            let wanted = [if stands { share } else { 0.0 }, 1.0].map(|part| 1e-6 + part * 2e-8);
            let found = [first, last].map(|row| row["volume.air"]);
            assert!(
                found.iter().zip(wanted).all(|(found, wanted)| (found - wanted).abs() < 1e-12),
                "{solver}, {curve}: {found:?} for {wanted:?}"
            );
        }
    }
}

#[test]
fn motions_of_shells_begin_where_their_curves_say() {
    let head = "[constraint.hand]\ntype = 'move'\nbody = 'b'\nnodes = { set = 'x-max' }\n";
    let solvers = [
        ("solver = 'static'\nload-steps = 5", false),
        ("solver = 'implicit'\nstep = 5e-4", true),
        ("solver = 'explicit'", true),
    ];
    for (solver, stands) in solvers {
        for (keys, place) in [
            ("by = [0, 0, 0.0001]", [0.0, 0.0, 1e-4]),
            ("by = [0, 0, 0.0001]\nturn = [0, -0.01, 0]", [0.0, 0.0, 1e-4]),
        ] {
            let text = |curve: &str| plate(solver, &format!("{head}{keys}\n{curve}\n"));
            begins_where_its_curve_says(&format!("{solver}: {keys}"), text, stands, Some(place));
        }
    }
}

/// A ball of shells and one of tets, filled from the start.
#[test]
fn volumes_of_shells_begin_where_their_curves_say() {
    for (solver, stands) in
        [("solver = 'static'\nload-steps = 5", false), ("solver = 'implicit'\nstep = 5e-4", true)]
    {
        let text = |curve: &str| {
            format!(
                "[scene]\nuntil = {UNTIL}\n[run]\n{solver}\n\
                 [law.a]\ntype = 'neo-hookean'\nyoung-modulus = 1e6\npoisson-ratio = 0.3\n\
                 [body.b]\nmodel = 'shell'\nmesh = {{ sphere = {{ radius = 0.01, levels = 1 }} }}\n\
                 law = 'a'\ndensity = 1000\nthickness = 0.001\ndamping = 600\n\
                 [constraint.low]\ntype = 'fix'\nbody = 'b'\nnodes = {{ half-space = {{ point = [0, 0, -0.009], normal = [0, 0, -1] }} }}\n\
                 [constraint.air]\ntype = 'volume'\nbody = 'b'\nby = 2e-7\n{curve}\n\
                 [output.history]\ntype = 'csv'\nevery = 0.005\nprobes.top = {{ on = 'b', at = [0, 0, 0.01] }}\n"
            )
        };
        begins_where_its_curve_says(&format!("{solver}: ball"), text, stands, None);
        let [first, last] = ends(&text("curve = 'hold'"));
        let grown = last["volume.air"] - first["volume.air"];
        assert!((grown - if stands { 0.0 } else { 2e-7 }).abs() < 1e-12, "{solver}: {grown:e}");
    }
}

/// Loads have no place: with them all stands at rest at t = 0, and what they do in the first load step is
/// balanced.
#[test]
fn loads_begin_where_their_curves_say() {
    let faces = "on = 'b'\nfaces = { set = 'z-max' }";
    for (solver, stands) in SOLVERS {
        for keys in [
            "type = 'force'\non = 'b'\nnodes = { set = 'z-max' }\ntotal = [0.01, 0, 0.05]".to_owned(),
            format!("type = 'traction'\n{faces}\ntraction = [100, 0, 400]"),
            format!("type = 'pressure'\n{faces}\npressure = 500"),
            "type = 'gravity'\nacceleration = [0, 0, -60]".to_owned(),
        ] {
            let text = |curve: &str| cube(solver, &format!("[load.push]\n{keys}\n{curve}\n"));
            begins_where_its_curve_says(
                &format!("{solver}: {keys}"),
                text,
                stands,
                Some([0.0; 3]).filter(|_| !stands),
            );
        }
    }
}

/// A table that has the cube's feet on it: an obstacle that is away, and comes back.
#[test]
fn rigid_things_begin_where_their_curves_say() {
    let weight = "[load.weight]\ntype = 'force'\non = 'b'\nnodes = { set = 'z-max' }\ntotal = [0, 0, 0.02]\ncurve = 'smooth-step'\nto = 0.02\n";
    let ceiling = |keys: &str| {
        format!(
            "{weight}[obstacle.ceiling]\nshape = {{ box = {{ size = [0.04, 0.04, 0.01] }} }}\nat = [0.005, 0.005, 0.02]\n{keys}\n\
             [contact.top]\nbetween = ['b', 'ceiling']\nthickness = 1e-4\n"
        )
    };
    for (solver, _) in SOLVERS.iter().filter(|(solver, _)| !solver.contains("quasi")) {
        let rows = ["by = [0, 0, -0.0046]\ncurve = 'hold'", "grows = { by = 0.0046, curve = 'hold' }"]
            .map(|keys| ends(&cube(solver, &ceiling(keys)))[1].clone());
        let there = cube(solver, &ceiling("").replace("0.005, 0.02]", "0.005, 0.0154]"));
        let wanted = &ends(&there)[1];
        for row in &rows {
            let off = off("probe", [row, wanted]);
            println!("{solver}: {off:e}");
            assert!(off < 1e-6, "{solver}: {off:e}");
        }
    }
}

/// With a control the other motions and loads continue, too, from their start.
#[test]
fn a_control_leaves_other_motions_and_loads_alone() {
    let head = "solver = 'static'\nload-steps = 5";
    let control = "control = { load = 'pull', displacement = { body = 'b', at = [0.01, 0.01, 0.01], component = 'z', by = 0.001 } }";
    let pull = "[load.pull]\ntype = 'force'\non = 'b'\nnodes = { set = 'z-max' }\ntotal = [0, 0, 1]\n";
    let side = "[constraint.side]\ntype = 'move'\nbody = 'b'\nnodes = { set = 'z-max' }\nby = [0.0005, 0, 0]\ncomponents = ['x']\n";
    let push = "[load.side]\ntype = 'force'\non = 'b'\nnodes = { set = 'z-max' }\ntotal = [0, 0.02, 0]\n";
    for curve in ["curve = 'hold'", "curve = 'ramp'", "curve = { table = [[0, 0.5], [0.1, 1]] }"] {
        let text = |control: &str, pull: &str| {
            cube(&format!("{head}\n{control}"), &format!("{pull}{side}{curve}\n{push}{curve}\n"))
        };
        let controlled = &ends(&text(control, pull))[1];
        // Its load factor as a plain load.
        let factor = controlled["reaction.low.z"].abs();
        let plain = &ends(&text("", &pull.replace("[0, 0, 1]", &format!("[0, 0, {factor}]"))))[1];
        let off = ["probe", "reaction"].map(|word| off(word, [controlled, plain]));
        println!("{curve}: {off:?}");
        assert!(off.iter().all(|&off| off < 1e-6), "{curve}: {off:?}");
        assert!((controlled["probe.top.displacement.x"] - 5e-4).abs() < 1e-12);
    }
}

/// A start that no cell or no gap survives is refused at t = 0.
#[test]
fn impossible_starts_are_refused() {
    let pressed = "[constraint.hand]\ntype = 'move'\nbody = 'b'\nnodes = { set = 'z-max' }\nby = [0, 0, -0.012]\ncurve = 'hold'\n";
    for (solver, _) in SOLVERS.iter().filter(|(solver, _)| solver.contains("plicit")) {
        let out = TempDir::new().unwrap();
        let world = world(&cube(solver, pressed)).unwrap();
        let folder = pliant_run::OutputFolder::prepare(out.path().to_owned(), &world.scene, false).unwrap();
        let summary = pliant_run::run(&world, &folder, &mut |_| ()).unwrap();
        let error = summary.error.expect("no error");
        println!("{solver}: {error:?}");
        assert!(error.kind.word() == "inverted" && error.time == Some(0.0), "{solver}: {error:?}");
    }
    let over = "[body.lid]\nmesh = { block = { size = [0.01, 0.01, 0.005], cells = [2, 2, 1] }, as = 'hexes', at = [0, 0, 0.0105] }\n\
                element = 'hex8-full'\nlaw = 'a'\ndensity = 1000\n\
                [constraint.hand]\ntype = 'move'\nbody = 'lid'\nnodes = 'all'\nby = [0, 0, -0.001]\ncurve = 'hold'\n\
                [contact.lid]\nbetween = ['b', 'lid']\n";
    let message = world(&cube("solver = 'implicit'\nstep = 5e-4", over)).unwrap_err();
    assert!(message.contains("contact `lid` has no gap at the start in 50 places"), "{message}");
    assert!(message.contains("scene.toml:37:11"), "{message}");
}

/// A scene whose motion is changed on the way goes to where the new one says within its next step.
#[test]
fn an_exchanged_motion_is_taken_up() {
    for (solver, _) in SOLVERS {
        let moved = |by: f64| {
            let hand = format!(
                "[constraint.hand]\ntype = 'move'\nbody = 'b'\nnodes = {{ set = 'z-max' }}\nby = [0, 0, {by}]\n{FROM_ZERO}\n"
            );
            world(&cube(solver, &hand)).unwrap()
        };
        let mut simulation = moved(0.001).simulation().unwrap();
        let half = simulation.steps_until(0.5 * UNTIL);
        for _ in 0..half {
            simulation.step(1).unwrap();
        }
        let at = |simulation: &mut pliant_sim::Simulation| {
            let frame = simulation.frame().unwrap();
            frame.displacements("b").unwrap().iter().map(|u| u[2]).fold(0.0, f64::max)
        };
        assert!((at(&mut simulation) - 0.001).abs() < 1e-9, "{solver}");
        assert!(simulation.exchange(moved(0.0012).simulated()).unwrap());
        simulation.step(1).unwrap();
        let found = at(&mut simulation);
        assert!((found - 0.0012).abs() < 1e-9, "{solver}: {found}");
    }
}
