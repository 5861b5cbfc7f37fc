//! Volumes whose pressure is limited: they lag behind their curve where it asks for more.

use std::collections::BTreeMap;

use pliant_testing::scenes::{self, Workshop, last_row, last_row_in, resumes, world};

use super::volumes::{FILLED, balloon};

const STATIC: &str = "solver = 'static'\nload-steps = 10\ntolerance = 1e-10";
const IMPLICIT: &str = "solver = 'implicit'\nstep = 0.05\ntolerance = 1e-10";

/// Returns the warnings of the run of a text, its largest pressure [Pa], and its last row.
fn run(text: &str) -> (String, f64, BTreeMap<String, f64>) {
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().join("out");
    let summary = scenes::run(text, &folder);
    let table = std::fs::read_to_string(folder.join("history.csv")).unwrap();
    let mut rows = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let column = rows.next().unwrap().iter().position(|name| *name == "pressure.air").unwrap();
    let most = rows.map(|row| row[column].parse::<f64>().unwrap().abs()).fold(0.0, f64::max);
    let mut warnings = summary.warnings.into_iter();
    let message = warnings.find(|text| text.contains("`air` was held back by its `pressure-limit`"));
    (message.unwrap_or_default(), most, last_row_in(&folder))
}

/// The volume [m³] of a balloon at rest.
fn at_rest(model: &str) -> f64 {
    last_row(&balloon(model, "solver = 'static'", "by = 0", ""))["volume.air"]
}

/// A balloon that is filled takes no more than its limit, whether it is a membrane or a shell, filled or
/// emptied. A shell stands where a load of that pressure puts it.
#[test]
fn a_balloon_is_filled_up_to_its_limit() {
    for (model, volume, limit) in
        [("membrane", FILLED, 5000.0), ("shell", FILLED, 5000.0), ("shell", "by = -2e-6\nto = 0.5", 200.0)]
    {
        for solver in [STATIC, IMPLICIT] {
            let whole = balloon(model, solver, volume, "");
            let text = whole.replace(volume, &format!("{volume}\npressure-limit = {limit}"));
            let rest = at_rest(model);
            let (message, most, row) = run(&text);
            let (_, without, asked) = run(&whole);
            let [last, end, asked] =
                [row["pressure.air"].abs(), row["volume.air"] - rest, asked["volume.air"] - rest];
            let name = if solver == STATIC { "static" } else { "implicit" };
            println!(
                "{model}, {name}: {most} and {last} Pa of {limit}, {without} without; {end} of {asked} m³; {message}"
            );
            assert!(without > 1.2 * limit && !message.is_empty(), "{model}, {name}: {without} {message}");
            assert!(
                (last / limit - 1.0).abs() < 1e-3 && most < 1.02 * limit,
                "{model}, {name}: {most} {last}"
            );
            let part = end / asked;
            assert!(part > 0.05 && part < 0.95, "{model}, {name}: {part}");
            if solver == STATIC && model == "shell" {
                assert!(most < limit * (1.0 + 1e-5), "{most}");
                let (start, after) = whole.split_once("[constraint.air]").unwrap();
                let pressure = if volume == FILLED { limit } else { -limit };
                let load = format!(
                    "[load.air]\ntype = 'pressure'\non = 'balloon'\nfaces = 'all'\npressure = {pressure}\nto = 0.5\n"
                );
                let pressed = last_row(&format!("{start}{}{load}", &after[after.find("[output").unwrap()..]));
                for name in ["probe.top.displacement.z", "probe.side.displacement.x"] {
                    assert!(
                        (row[name] - pressed[name]).abs() < 1e-9,
                        "{name}: {} {}",
                        row[name],
                        pressed[name]
                    );
                }
            }
        }
    }
}

/// A balloon that is called back follows its curve again, to its volume at rest. A limit that is far away
/// changes no bit, and a resumed run has the same bits.
#[test]
fn a_balloon_at_its_limit_is_called_back_and_resumed() {
    let there = "by = 4e-5\ncurve = { table = [[0, 0], [0.3, 1], [0.5, 1], [0.8, 0]] }";
    for (model, solver) in [("membrane", STATIC), ("shell", STATIC), ("shell", IMPLICIT)] {
        let limited = |limit: &str| balloon(model, solver, &format!("{there}\n{limit}"), "");
        let row = last_row(&limited("pressure-limit = 5000"));
        let rest = at_rest(model);
        assert!((row["volume.air"] / rest - 1.0).abs() < 1e-9, "{model}: {} of {rest}", row["volume.air"]);
        assert_eq!(last_row(&limited("pressure-limit = 1e6")), last_row(&limited("")), "{model}");
    }
    for (model, solver) in
        [("membrane", "solver = 'static'\nstep = 0.1"), ("shell", "solver = 'implicit'\nstep = 0.05")]
    {
        let solver = format!("{solver}\ncheckpoint = {{ every = 0.4 }}");
        resumes(&balloon(model, &solver, &format!("{FILLED}\npressure-limit = 5000"), ""));
    }
}

/// A full balloon is pressed onto a floor. It lets out the volume that its limit does not hold, and takes it
/// in again when it is released.
#[test]
fn a_balloon_that_is_pressed_lets_out_what_its_limit_does_not_hold() {
    let ball = |motion: &str| {
        format!(
            "[obstacle.floor]\nshape = 'half-space'\nat = [0, 0, -0.0312]\n\
             [tool.ball]\nshape = {{ sphere = {{ radius = 0.02 }} }}\nat = [0, 0, 0.0512]\nby = [0, 0, -0.012]\n{motion}\n\
             [contact.below]\nbetween = ['balloon', 'floor']\nfriction = 0.5\ncheck-intersections = true\n\
             [contact.above]\nbetween = ['balloon', 'ball']\nfriction = 0.5\ncheck-intersections = true\n"
        )
    };
    for model in ["membrane", "shell"] {
        let text = |volume: &str, motion: &str| {
            let text = balloon(model, "solver = 'implicit'\nstep = 0.02", volume, &ball(motion));
            let (start, end) = text.split_once("[constraint.neck]").unwrap();
            format!("{start}{}", &end[end.find("[constraint.air]").unwrap()..])
                .replace("every = 0.1", "every = 0.02")
                .replace("until = 1", "until = 0.6")
        };
        let (_, without, _) = run(&text("by = 0", "to = 0.2"));
        let limit = 0.5 * without;
        let limited = format!("by = 0\npressure-limit = {limit}");
        let (message, most, row) = run(&text(&limited, "to = 0.2"));
        let [up, down, last, end] =
            ["contact.above.z", "contact.below.z", "pressure.air", "volume.air"].map(|name| row[name]);
        println!("{model}: {most} and {last} Pa of {limit}; {end} m³; {up} N, {down} N; {message}");
        assert!(
            !message.is_empty() && most < 1.03 * limit && (last / limit - 1.0).abs() < 0.01,
            "{model}: {most} {last}"
        );
        assert!(up > 0.1 && (up / down.abs() - 1.0).abs() < 0.01, "{model}: {up} {down}");
        let rest = at_rest(model);
        assert!(end < 0.999 * rest, "{model}: {end} of {rest}");
        let row = last_row(&text(&limited, "curve = { table = [[0, 0], [0.2, 1], [0.4, 0]] }"));
        assert!((row["volume.air"] / rest - 1.0).abs() < 1e-9, "{model}: {} of {rest}", row["volume.air"]);
    }
}

/// A load helps a balloon past the largest pressure that its wall bears, and falls. The wall then gives way
/// to more air at the limit of the pressure. The balloon holds too little pressure or too much volume: no
/// equilibrium keeps both.
#[test]
fn a_balloon_that_snaps_at_its_limit_ends_the_run_with_pressure_and_volume() {
    let volume = "by = 3e-4\ncurve = { table = [[0, 0], [0.5, 1]] }\npressure-limit = 11000";
    let load = "[load.help]\ntype = 'pressure'\non = 'balloon'\nfaces = 'all'\npressure = -6000\ncurve = { table = [[0, 0], [0.5, 1], [1, 0]] }\n";
    let text = |solver: &str| balloon("membrane", solver, volume, load);
    let output = Workshop::new(&text("solver = 'static'\nload-steps = 10\ntolerance = 1e-8")).run(&[]);
    assert_eq!(output.status(), "failed", "{}", output.err);
    let error = &output.json()["error"];
    assert_eq!((&error["kind"], &error["body"]), (&"not-converged".into(), &"balloon".into()), "{error}");
    assert!(error["node"].is_null(), "{error}");
    // Without a limit the pressure is 11 kPa at 0.89 s.
    assert!((error["time"].as_f64().unwrap() - 0.89).abs() < 0.01, "{error}");
    let words = [
        "in `balloon`",
        "neither the volume of `air` nor its `pressure-limit` of 1.1000e4 Pa can be kept",
        "the volume takes 1.1",
        "m³ beyond its curve: the surface snaps",
        "try the solver `implicit`",
    ];
    for word in words {
        assert!(output.words().contains(word), "{}", output.err);
    }
    assert!(!output.words().contains("a membrane resists bending"), "{}", output.err);
    let (message, most, row) = run(&text(IMPLICIT));
    assert!(!message.is_empty() && most < 1.02 * 11000.0, "{most} {message}");
    assert!(row["volume.air"] < at_rest("membrane") + 1e-4, "{}", row["volume.air"]);
}

/// Other solvers have no such limit, and an invalid limit is refused.
#[test]
fn limits_of_pressure_that_cannot_be_kept_are_refused() {
    for solver in ["explicit", "quasi-static"] {
        let run = format!("solver = '{solver}'");
        let text = balloon("membrane", &run, &format!("{FILLED}\npressure-limit = 5000"), "");
        let message = world(&text).err().unwrap();
        assert!(
            message.contains(&format!("the solver `{solver}` keeps no limit of the pressure of `air`")),
            "{message}"
        );
    }
    for limit in ["-1", "0", "inf", "'much'"] {
        let text = balloon("membrane", STATIC, &format!("{FILLED}\npressure-limit = {limit}"), "");
        let message = world(&text).err().unwrap();
        assert!(message.contains("pressure-limit"), "{message}");
    }
}
