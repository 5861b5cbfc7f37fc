//! Constraints that bind nodes to each other, with every solver: a plate that tilts, rigid parts of a body,
//! and refusals.

use pliant_testing::scenes::{assert_rows_agree, last_row, resumes, run, world};

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

/// A side load tilts the top under a plate that prescribes its mean. Without a side load the mean equals the
/// mean of a moved face.
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

/// A rigid top in single and double precision turns under a side load and keeps its size; a resumed run has
/// the same bits.
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

/// A plate lies on one half of the top, and a bone in the other. A load tilts both, and a vessel wall is tied
/// into the bone. Every solver, with every way to solve its equations, finds the same equilibrium.
/// Displacements and reactions agree to 1e-5 of the largest.
#[test]
fn bound_nodes_stand_where_every_solver_puts_them() {
    let plate = "type = 'mean'\nbody = 'block'\nby = [0, 0, -0.002]\ncomponents = ['z']\nto = 0.5\n\
                 nodes = { intersection = [{ set = 'z-max' }, { half-space = { point = [0.029, 0, 0], normal = [1, 0, 0] } }] }";
    let more = "probes.below = { on = 'block', at = [0, 0.01, 0.015] }\nprobes.cord = { on = 'cord', at = [0.015, 0.01, 0.0125] }\n\
        [constraint.bone]\ntype = 'rigid'\nbody = 'block'\n\
        nodes = { intersection = [{ half-space = { point = [0, 0, 0.0149], normal = [0, 0, 1] } }, { half-space = { point = [0.011, 0, 0], normal = [-1, 0, 0] } }] }\n\
        [law.thread]\ntype = 'neo-hookean'\nyoung-modulus = 1e6\npoisson-ratio = 0.4\n\
        [body.cord]\nmodel = 'bar'\nmesh = { lines = [[[0.005, 0.01, 0.0175], [0.015, 0.01, 0.0125], [0.025, 0.01, 0.0075]]] }\n\
        law = 'thread'\narea = 1e-6\ndensity = 1000\n[tie.cord]\nbetween = ['cord', 'block']\n\
        [load.side]\ntype = 'force'\non = 'block'\nnodes = { set = 'x-min' }\ntotal = [0.1, 0.1, 0.3]\nto = 0.5\n";
    let text = |solver: &str| block(solver, plate, more);
    let newton = last_row(&text("solver = 'static'\nload-steps = 4\ntolerance = 1e-11"));
    assert!((newton["probe.left.displacement.z"] - newton["probe.below.displacement.z"]).abs() < 0.005 * 0.5);
    let gradients = |preconditioner: &str| {
        format!(
            "solver = 'static'\nload-steps = 4\ntolerance = 1e-10\n\
             linear = {{ by = 'conjugate-gradients', tolerance = 1e-8, preconditioner = '{preconditioner}' }}"
        )
    };
    let mut others = vec![
        text("solver = 'quasi-static'\nload-steps = 4\ntolerance = 1e-9"),
        text("solver = 'static'\nload-steps = 4\ntolerance = 1e-10\nlinear = 'unsymmetric'"),
    ];
    others.extend(["block-jacobi", "aggregates", "lagged-factors"].map(|name| text(&gradients(name))));
    for solver in ["solver = 'explicit'", "solver = 'implicit'\nstep = 0.05\ntolerance = 1e-10"] {
        others.push(
            text(solver)
                .replace("until = 1", "until = 4")
                .replace("density = 1000\n[tie", "density = 1000\ndamping = 40\n[tie"),
        );
    }
    for other in others {
        let row = last_row(&other);
        let solver = other.lines().nth(3).unwrap();
        assert_rows_agree(solver, [&newton, &row], &[("displacement", 1e-5), ("reaction.", 1e-5)]);
    }
}

/// A tall block whose rigid head turns by half a right angle in one load step stands where `static` puts it.
#[test]
fn a_rigid_part_may_turn_far_in_a_load_step() {
    let text = |solver: &str| {
        format!(
            "[scene]\nuntil = 1\n[run]\n{solver}\n[law.tissue]\ntype = 'neo-hookean'\nyoung-modulus = 1e4\npoisson-ratio = 0.3\n\
             [body.block]\nmesh = {{ block = {{ size = [0.02, 0.02, 0.06], cells = [2, 2, 6] }}, as = 'hexes' }}\n\
             law = 'tissue'\ndensity = 1000\n\
             [constraint.base]\ntype = 'fix'\nbody = 'block'\nnodes = {{ set = 'z-min' }}\n\
             [constraint.head]\ntype = 'rigid'\nbody = 'block'\nnodes = {{ half-space = {{ point = [0, 0, 0.039], normal = [0, 0, 1] }} }}\n\
             [load.side]\ntype = 'force'\non = 'block'\nnodes = {{ set = 'z-max' }}\ntotal = [0.12, 0, 0]\n\
             [output.history]\ntype = 'csv'\nevery = 1\nprobes.left = {{ on = 'block', at = [0, 0.01, 0.06] }}\n\
             probes.right = {{ on = 'block', at = [0.02, 0.01, 0.06] }}\n"
        )
    };
    let newton = last_row(&text("solver = 'static'\nload-steps = 8\ntolerance = 1e-11"));
    let sideways = newton["probe.left.displacement.x"];
    assert!(sideways > 0.04, "{sideways}");
    for steps in [1, 4] {
        let row =
            last_row(&text(&format!("solver = 'quasi-static'\nload-steps = {steps}\ntolerance = 1e-9")));
        let probes = newton.iter().filter(|(name, _)| name.starts_with("probe"));
        let off = probes.map(|(name, value)| (value - row[name]).abs()).fold(0.0, f64::max);
        println!("{steps} load steps: {:.1e}", off / sideways);
        assert!(off < 1e-5 * sideways, "{steps}: {off:e}");
    }
}

/// A run of each solver that is resumed in the middle has the same bits; its energies balance. External work
/// is a sum of trapezia between load steps. They miss 2.4e-4 of the work (rigid part, static) with 10 load
/// steps, and 6e-5 with 20. A work left out would be far more.
#[test]
fn runs_with_bound_nodes_are_taken_up_with_the_same_bits() {
    let rigid = "type = 'rigid'\nbody = 'block'\nnodes = { half-space = { point = [0, 0, 0.0149], normal = [0, 0, 1] } }";
    let load = "[load.side]\ntype = 'force'\non = 'block'\nnodes = { set = 'x-max' }\ntotal = [0, 0, -0.6]\nto = 1\n";
    for (solver, limit) in [
        ("solver = 'static'\nstep = 0.05", 1e-3),
        ("solver = 'quasi-static'\nstep = 0.05", 1e-3),
        ("solver = 'implicit'\nstep = 0.05\nintegrator = 'bdf2'", f64::INFINITY),
        ("solver = 'implicit'\nstep = 0.05", f64::INFINITY),
    ] {
        for constraint in [rigid, &MEAN.replace("to = 0.5", "to = 1")] {
            let text = block(&format!("{solver}\ncheckpoint = {{ every = 0.4 }}"), constraint, load);
            resumes(&text);
            let row = last_row(&text);
            let [internal, hourglass, external] =
                ["internal", "hourglass", "external"].map(|name| row[&format!("energy.{name}")]);
            let internal = internal + hourglass;
            let off = (internal - external).abs() / external.abs();
            println!("{solver}: energy {off:.1e}");
            assert!(off < limit, "{solver}: {internal} {external}");
        }
    }
}

/// A plate of shells is clamped at one side, with a rigid strip at the other, which keeps its size and turns
/// as one. Every way to solve finds the same equilibrium, and so does `implicit` at rest. A mean of its nodes
/// is where it was sent.
#[test]
fn a_rigid_end_of_a_shell_turns_with_its_nodes() {
    let plate = |solver: &str, more: &str| {
        format!(
            "[scene]\nuntil = 1\n[run]\n{solver}\n\
             [law.wall]\ntype = 'neo-hookean'\nyoung-modulus = 1e6\npoisson-ratio = 0.3\n\
             [body.plate]\nmodel = 'shell'\nmesh = {{ plate = {{ size = [0.1, 0.04], cells = [10, 4] }} }}\nlaw = 'wall'\n\
             density = 1000\nthickness = 0.002\ndamping = 40\n\
             [constraint.base]\ntype = 'fix'\nbody = 'plate'\nnodes = {{ half-space = {{ point = [1e-4, 0, 0], normal = [-1, 0, 0] }} }}\n\
             [output.history]\ntype = 'csv'\nevery = 0.1\n\
             probes.left = {{ on = 'plate', at = [0.1, 0, 0], data = ['displacement', 'rotation'] }}\n\
             probes.right = {{ on = 'plate', at = [0.1, 0.04, 0], data = ['displacement', 'rotation'] }}\n\
             probes.inner = {{ on = 'plate', at = [0.09, 0.04, 0], data = ['displacement', 'rotation'] }}\n\
             probes.free = {{ on = 'plate', at = [0.05, 0.04, 0], data = ['displacement', 'rotation'] }}\n{more}"
        )
    };
    let end = "nodes = { half-space = { point = [0.0899, 0, 0], normal = [1, 0, 0] } }\n";
    let rigid = format!("[constraint.ring]\ntype = 'rigid'\nbody = 'plate'\n{end}");
    let load = "[load.side]\ntype = 'force'\non = 'plate'\nnodes = { nearest = { point = [0.1, 0, 0] } }\ntotal = [0, 0, 0.02]\nto = 0.5\n";
    let text = |solver: &str| plate(solver, &format!("{rigid}{load}"));
    let first = last_row(&text("solver = 'static'\nload-steps = 4\ntolerance = 1e-11"));
    let of = |row: &std::collections::BTreeMap<String, f64>, probe: &str, what: &str| {
        ["x", "y", "z"].map(|axis| row[&format!("probe.{probe}.{what}.{axis}")])
    };
    // One rotation, about two axes, and the distances of the ring.
    let turn = of(&first, "left", "rotation");
    assert!(turn[0].abs() > 0.01 && turn[1].abs() > 0.1, "{turn:?}");
    for probe in ["right", "inner"] {
        let rotation = of(&first, probe, "rotation");
        assert!((0..3).all(|c| (rotation[c] - turn[c]).abs() < 1e-13), "{probe}: {rotation:?} {turn:?}");
    }
    let place = |probe: &str, rest: [f64; 3]| {
        let moved = of(&first, probe, "displacement");
        [0, 1, 2].map(|c| rest[c] + moved[c])
    };
    let [left, right, inner] =
        [place("left", [0.1, 0.0, 0.0]), place("right", [0.1, 0.04, 0.0]), place("inner", [0.09, 0.04, 0.0])];
    let length = |a: [f64; 3], b: [f64; 3]| (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt();
    assert!((length(left, right) - 0.04).abs() < 1e-15 && (length(right, inner) - 0.01).abs() < 1e-15);
    // What holds the ring at its corner has the moment of the load and no more: the base bears it.
    assert!((first["reaction.base.z"] + 0.02).abs() < 1e-9, "{}", first["reaction.base.z"]);
    let gradients = "solver = 'static'\nload-steps = 4\ntolerance = 1e-10\nlinear = { by = 'conjugate-gradients', tolerance = 1e-9 }";
    let others = [
        text(gradients),
        text("solver = 'static'\nload-steps = 4\ntolerance = 1e-10\nlinear = 'unsymmetric'"),
        text("solver = 'implicit'\nstep = 0.05\ntolerance = 1e-10").replace("until = 1", "until = 6"),
    ];
    for other in others {
        let row = last_row(&other);
        let off = first.iter().filter(|(name, _)| name.starts_with("probe"));
        let off = off.map(|(name, value)| (value - row[name]).abs()).fold(0.0, f64::max);
        println!("{}: {off:.1e}", other.lines().nth(3).unwrap());
        assert!(off < 1e-7, "{other}: {off:e}");
    }
    let mean = format!(
        "[constraint.end]\ntype = 'mean'\nbody = 'plate'\nby = [0, 0, 0.01]\ncomponents = ['z']\nto = 0.5\n{end}"
    );
    let row = last_row(&plate("solver = 'static'\nload-steps = 4", &format!("{mean}{load}")));
    let [left, right] = ["left", "right"].map(|probe| row[&format!("probe.{probe}.displacement.z")]);
    assert!(
        left > right + 1e-4 && (row["reaction.base.z"] + row["reaction.end.z"] + 0.02).abs() < 1e-6,
        "{row:?}"
    );
    resumes(&text("solver = 'implicit'\nstep = 0.05\ncheckpoint = { every = 0.4 }"));
}

#[test]
fn what_cannot_be_bound_is_refused_by_name() {
    let rigid = "type = 'rigid'\nbody = 'block'\nnodes = { set = 'z-max' }";
    for (solver, constraint, more, pieces) in [
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
        let message = world(&text).err().unwrap_or_else(|| panic!("accepted: {constraint}"));
        assert!(pieces.iter().all(|piece| message.contains(piece)), "{message}");
    }
}
