//! Constraints that bind nodes to each other: a plate that tilts, rigid parts of a body, and what is refused.

use super::static_solids::{last_row, resumes, run, world};

/// A block of 40 × 20 × 20 mm, held below, with a constraint on its top.
fn block(solver: &str, constraint: &str, more: &str) -> String {
    format!(
        "[scene]\nuntil = 1\n[run]\n{solver}\n\
         [law.tissue]\ntype = 'neo-hookean'\nyoung-modulus = 1e4\npoisson-ratio = 0.3\n\
         [law.bone]\ntype = 'neo-hookean'\nyoung-modulus = 1e5\npoisson-ratio = 0.3\n\
         [body.block]\nmesh = {{ block = {{ size = [0.04, 0.02, 0.02], cells = [4, 2, 4] }}, as = 'hexes' }}\n\
         law = 'tissue'\ndensity = 1000\ndamping = 40\n\
         [constraint.base]\ntype = 'fix'\nbody = 'block'\nnodes = {{ set = 'z-min' }}\n\
         [constraint.plate]\n{constraint}\n\
         [output.history]\ntype = 'csv'\nevery = 0.1\n\
         probes.left = {{ on = 'block', at = [0, 0.01, 0.02] }}\nprobes.right = {{ on = 'block', at = [0.04, 0.01, 0.02] }}\n{more}"
    )
}

const MEAN: &str = "type = 'mean'\nbody = 'block'\nnodes = { set = 'z-max' }\nby = [0, 0, -0.002]\ncomponents = ['z']\nto = 0.5";

/// A side load tilts the top under a plate that prescribes its mean; without one the mean is that of a face that is moved.
#[test]
fn a_plate_presses_and_tilts() {
    let flat = last_row(&block("solver = 'explicit'", MEAN, ""));
    let [left, right] = ["left", "right"].map(|side| flat[&format!("probe.{side}.displacement.z")]);
    assert!((left - right).abs() < 1e-7 && left < -0.0015, "{left} {right}");
    let tilted = block(
        "solver = 'explicit'",
        MEAN,
        "[load.side]\ntype = 'force'\non = 'block'\nnodes = { set = 'x-max' }\ntotal = [0, 0, 0.3]\nto = 0.5\n",
    );
    let row = last_row(&tilted);
    let [left, right] = ["left", "right"].map(|side| row[&format!("probe.{side}.displacement.z")]);
    assert!(right - left > 5e-4, "{left} {right}");
    // The plate bears what the base does, and the load.
    let [plate, base] = ["plate", "base"].map(|name| row[&format!("reaction.{name}.z")]);
    assert!(plate < flat["reaction.plate.z"] && (plate + base + 0.3).abs() < 1e-3, "{plate} {base}");
    let out = tempfile::tempdir().unwrap();
    let summary = run(&tilted, out.path());
    assert!(summary.energy_balance.unwrap().abs() < 0.01, "{:?}", summary.energy_balance);
}

/// A rigid top in single and double precision: it turns under a side load and keeps its size, and a resumed run has the same bits.
#[test]
fn a_rigid_part_turns_and_keeps_its_size() {
    let rigid = "type = 'rigid'\nbody = 'block'\nnodes = { half-space = { point = [0, 0, 0.0149], normal = [0, 0, 1] } }";
    let load = "[load.side]\ntype = 'force'\non = 'block'\nnodes = { set = 'x-max' }\ntotal = [0, 0, -0.6]\nto = 0.5\n";
    let more = "probes.below = { on = 'block', at = [0, 0.01, 0.015] }\n";
    for precision in ["double", "single"] {
        let text = block(
            &format!("solver = 'explicit'\nprecision = '{precision}'"),
            rigid,
            &format!("{more}{load}"),
        );
        let row = last_row(&text);
        let place = |probe: &str, rest: [f64; 3]| {
            let axes = ["x", "y", "z"];
            [0, 1, 2].map(|c| rest[c] + row[&format!("probe.{probe}.displacement.{}", axes[c])])
        };
        let [left, right, below] = [
            place("left", [0.0, 0.01, 0.02]),
            place("right", [0.04, 0.01, 0.02]),
            place("below", [0.0, 0.01, 0.015]),
        ];
        let length = |a: [f64; 3], b: [f64; 3]| (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt();
        let limit = if precision == "double" { 1e-12 } else { 3e-8 };
        assert!((length(left, right) - 0.04).abs() < limit, "{:e}", length(left, right) - 0.04);
        assert!((length(left, below) - 0.005).abs() < limit);
        assert!(left[2] - right[2] > 1e-3, "{left:?} {right:?}");
    }
    let text = block("solver = 'explicit'\nstep = 1e-4\ncheckpoint = { every = 0.4 }", rigid, load);
    resumes(&text);
}

#[test]
fn what_cannot_be_bound_is_refused_by_name() {
    let rigid = "type = 'rigid'\nbody = 'block'\nnodes = { set = 'z-max' }";
    for (solver, constraint, more, pieces) in [
        ("solver = 'static'", MEAN, "", vec!["`plate` binds nodes", "`static` does not"]),
        ("solver = 'quasi-static'", rigid, "", vec!["`quasi-static` does not", "explicit"]),
        ("solver = 'implicit'", rigid, "", vec!["`implicit` does not"]),
        (
            "solver = 'explicit'",
            "type = 'rigid'\nbody = 'block'\nnodes = { set = 'z-min' }",
            "",
            vec!["`base` and `plate`"],
        ),
        (
            "solver = 'explicit'",
            rigid,
            "[constraint.other]\ntype = 'mean'\nbody = 'block'\nnodes = { set = 'z-max' }\nby = [0, 0, 0]\n",
            vec!["`plate` and `other`"],
        ),
        (
            "solver = 'explicit'",
            "type = 'rigid'\nbody = 'block'\nnodes = { ids = [44] }",
            "",
            vec!["one node"],
        ),
        ("solver = 'explicit'", "type = 'mean'\nbody = 'block'\nnodes = 'all'", "", vec!["by"]),
        ("solver = 'explicit'", "type = 'rigid'\nbody = 'blok'\nnodes = 'all'", "", vec!["blok"]),
        // A tie between rigid parts: its nodes would follow two.
        (
            "solver = 'explicit'",
            rigid,
            "[body.plug]\nmesh = { block = { size = [0.04, 0.02, 0.01], cells = [4, 2, 1] }, at = [0, 0, 0.02] }\n\
             law = 'bone'\ndensity = 1000\n[tie.glue]\nbetween = ['plug', 'block']\nnodes = { set = 'z-min' }\n\
             [constraint.plug]\ntype = 'rigid'\nbody = 'plug'\nnodes = 'all'\n",
            vec!["`plug` and `glue`"],
        ),
    ] {
        let text = block(solver, constraint, more).replace("damping = 40\n", "\n");
        let told = world(&text).err().unwrap_or_else(|| panic!("accepted: {constraint}"));
        assert!(pieces.iter().all(|piece| told.contains(piece)), "{told}");
    }
}
