//! Enclosed volumes with every solver: a balloon of a membrane, one of a shell, a cavity in a solid, and
//! refusals.

use std::collections::BTreeMap;

use pliant_testing::scenes::{assert_rows_agree, last_row, resumes, run, world};

/// A balloon of 30 mm that is held at its neck, with a constraint on its volume; at rest it encloses 1.07e-4
/// m³.
pub fn balloon(model: &str, solver: &str, volume: &str, more: &str) -> String {
    format!(
        "[scene]\nuntil = 1\n[run]\n{solver}\n\
         [law.rubber]\ntype = 'neo-hookean'\nyoung-modulus = 1e6\npoisson-ratio = 0.4\n\
         [body.balloon]\nmodel = '{model}'\nmesh = {{ sphere = {{ radius = 0.03, levels = 2 }} }}\nlaw = 'rubber'\n\
         density = 1000\nthickness = 0.001\ndamping = 40\n\
         [constraint.neck]\ntype = 'fix'\nbody = 'balloon'\nnodes = {{ nearest = {{ point = [0, 0, -0.03], count = 7 }} }}\n\
         [constraint.air]\ntype = 'volume'\nbody = 'balloon'\n{volume}\n\
         [output.history]\ntype = 'csv'\nevery = 0.1\nprobes.top = {{ on = 'balloon', at = [0, 0, 0.03] }}\n\
         probes.side = {{ on = 'balloon', at = [0.03, 0, 0] }}\n{more}"
    )
}

pub const FILLED: &str = "by = 4e-5\nto = 0.5";

/// Compares runs of one scene: displacements and pressures to 1e-5 of the largest, volumes to 1e-9.
fn agree(first: &str, others: &[String]) {
    let newton = last_row(first);
    for other in others {
        let row = last_row(other);
        let solver = other.lines().nth(3).unwrap();
        assert_rows_agree(
            solver,
            [&newton, &row],
            &[("displacement", 1e-5), ("pressure.", 1e-5), ("volume.", 1e-9)],
        );
    }
}

/// Every solver finds the same equilibrium of a membrane that is filled by two fifths, under a load from the
/// side. No volume is lost.
#[test]
fn a_balloon_stands_where_every_solver_puts_it() {
    let load = "[load.side]\ntype = 'force'\non = 'balloon'\nnodes = { nearest = { point = [0.03, 0, 0], count = 7 } }\ntotal = [0, 2, 0]\nto = 0.5\n";
    let text = |solver: &str| balloon("membrane", solver, FILLED, load);
    let newton = text("solver = 'static'\nload-steps = 4\ntolerance = 1e-11");
    let mut others = vec![
        text("solver = 'quasi-static'\nload-steps = 4\ntolerance = 1e-9"),
        text("solver = 'static'\nload-steps = 4\ntolerance = 1e-10\nlinear = 'unsymmetric'"),
    ];
    for solver in ["solver = 'explicit'", "solver = 'implicit'\nstep = 0.05\ntolerance = 1e-10"] {
        others.push(text(solver).replace("until = 1", "until = 4"));
    }
    agree(&newton, &others);
    let row = last_row(&newton);
    let rest = last_row(&balloon("membrane", "solver = 'static'", "by = 0", ""));
    assert!(rest["pressure.air"].abs() < 1e-6, "{}", rest["pressure.air"]);
    let grown = row["volume.air"] - rest["volume.air"];
    assert!((grown - 4e-5).abs() < 1e-13, "{grown}");
}

/// A balloon is a sphere but for its neck: its pressure comes to the closed form with the mesh.
#[test]
fn the_pressure_in_a_sphere_is_that_of_its_law() {
    // Incompressible: p = 2 μ t₀/R₀ (λ⁻¹ − λ⁻⁷) with λ³ the growth of the volume.
    let off = |levels: usize| {
        let text = balloon("membrane", "solver = 'quasi-static'\nload-steps = 4", FILLED, "")
            .replace("levels = 2", &format!("levels = {levels}"))
            .replace("poisson-ratio = 0.4", "poisson-ratio = 0.5")
            .replace("count = 7", "count = 1");
        let row = last_row(&text);
        let rest = row["volume.air"] - 4e-5;
        let stretch = (row["volume.air"] / rest).cbrt();
        let exact = 2.0 * 1e6 / 3.0 * 0.001 / 0.03 * (1.0 / stretch - stretch.powi(-7));
        row["pressure.air"] / exact - 1.0
    };
    let [coarse, fine] = [off(2), off(3)];
    println!("pressure off by {coarse:.2e}, {fine:.2e}");
    assert!(fine.abs() < 0.01 && fine.abs() < 0.4 * coarse.abs(), "{coarse} {fine}");
}

/// A shell on its curved surface: `static` and `implicit`, filled and emptied, also by conjugate gradients; a
/// load of the pressure that was found does the same.
#[test]
fn a_shell_is_filled_and_emptied() {
    for volume in [FILLED, "by = -2e-6\nto = 0.5"] {
        let text = |solver: &str| balloon("shell", solver, volume, "");
        let newton = text("solver = 'static'\nload-steps = 8\ntolerance = 1e-10");
        let others = [
            text("solver = 'static'\nload-steps = 8\ntolerance = 1e-10\nlinear = 'unsymmetric'"),
            text(
                "solver = 'static'\nload-steps = 8\ntolerance = 1e-9\nlinear = { by = 'conjugate-gradients', tolerance = 1e-9 }",
            ),
            text("solver = 'implicit'\nstep = 0.05\ntolerance = 1e-10").replace("until = 1", "until = 4"),
        ];
        agree(&newton, &others);
        // A load of the pressure that was found fills it to the same.
        let row = last_row(&newton);
        let load = format!(
            "[load.air]\ntype = 'pressure'\non = 'balloon'\nfaces = 'all'\npressure = {}\nto = 0.5\n",
            row["pressure.air"]
        );
        let (start, end) = newton.split_once("[constraint.air]").unwrap();
        let pressed = last_row(&format!("{start}{}{load}", &end[end.find("[output").unwrap()..]));
        for probe in ["top", "side"] {
            for axis in ["x", "y", "z"] {
                let name = format!("probe.{probe}.displacement.{axis}");
                assert!(
                    (row[&name] - pressed[&name]).abs() < 1e-9,
                    "{name}: {} {}",
                    row[&name],
                    pressed[&name]
                );
            }
        }
    }
}

/// A block of 3 × 3 × 3 cubes of 10 mm without the one in the middle, as a VTK file.
fn hollow_block() -> String {
    let mut text = String::from(
        "# vtk DataFile Version 3.0\nhollow\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 64 double\n",
    );
    for (z, y, x) in (0..4).flat_map(|z| (0..4).flat_map(move |y| (0..4).map(move |x| (z, y, x)))) {
        text += &format!("{} {} {}\n", 0.01 * f64::from(x), 0.01 * f64::from(y), 0.01 * f64::from(z));
    }
    text += "CELLS 26 234\n";
    for (z, y, x) in (0..3).flat_map(|z| (0..3).flat_map(move |y| (0..3).map(move |x| (z, y, x)))) {
        if (x, y, z) != (1, 1, 1) {
            let node = |x: i32, y: i32, z: i32| x + 4 * y + 16 * z;
            let ring = |z: i32| {
                let corners = [node(x, y, z), node(x + 1, y, z), node(x + 1, y + 1, z), node(x, y + 1, z)];
                corners.map(|node| node.to_string()).join(" ")
            };
            text += &format!("8 {} {}\n", ring(z), ring(z + 1));
        }
    }
    text + "CELL_TYPES 26\n" + &"12\n".repeat(26)
}

/// Water in the cavity of a block keeps its volume while the block is squeezed; every solver finds the same
/// pressure. Without water the cavity loses a tenth.
#[test]
fn a_cavity_keeps_its_volume() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("hollow.vtk");
    std::fs::write(&file, hollow_block()).unwrap();
    let text = |solver: &str, more: &str| {
        format!(
            "[scene]\nuntil = 1\n[run]\n{solver}\n\
             [law.tissue]\ntype = 'neo-hookean'\nyoung-modulus = 1e4\npoisson-ratio = 0.3\n\
             [body.block]\nmesh = {{ file = '{}' }}\nelement = 'hex8-full'\nlaw = 'tissue'\ndensity = 1000\ndamping = 60\n\
             [constraint.base]\ntype = 'fix'\nbody = 'block'\nnodes = {{ half-space = {{ point = [0, 0, 1e-4], normal = [0, 0, -1] }} }}\n\
             [constraint.top]\ntype = 'move'\nbody = 'block'\nnodes = {{ half-space = {{ point = [0, 0, 0.0299], normal = [0, 0, 1] }} }}\n\
             by = [0, 0, -0.003]\nto = 0.5\n\
             [output.history]\ntype = 'csv'\nevery = 0.1\nprobes.side = {{ on = 'block', at = [0.03, 0.015, 0.015] }}\n\
             probes.low = {{ on = 'block', at = [0.01, 0.01, 0.01] }}\nprobes.high = {{ on = 'block', at = [0.01, 0.01, 0.02] }}\n{more}",
            file.display()
        )
    };
    let water = "[constraint.water]\ntype = 'volume'\nbody = 'block'\nby = 0\n\
        faces = { box = [[0.009, 0.009, 0.009], [0.021, 0.021, 0.021]] }\n";
    let newton = text("solver = 'static'\nload-steps = 4\ntolerance = 1e-11", water);
    let mut others = vec![text("solver = 'quasi-static'\nload-steps = 4\ntolerance = 1e-9", water)];
    for solver in ["solver = 'explicit'", "solver = 'implicit'\nstep = 0.05\ntolerance = 1e-10"] {
        others.push(text(solver, water).replace("until = 1", "until = 4"));
    }
    agree(&newton, &others);
    let row = last_row(&newton);
    assert!((row["volume.water"] - 1e-6).abs() < 1e-15 && row["pressure.water"] > 100.0, "{row:?}");
    let empty = last_row(&text("solver = 'static'\nload-steps = 4", ""));
    let stiffer = row["reaction.top.z"] / empty["reaction.top.z"] - 1.0;
    println!("water makes it stiffer by {stiffer:.3}");
    assert!(stiffer > 0.0);
    let height =
        |row: &BTreeMap<String, f64>| row["probe.high.displacement.z"] - row["probe.low.displacement.z"];
    assert!(height(&empty) < height(&row) - 1e-4, "{} {}", height(&empty), height(&row));
}

/// A full balloon on a floor is pressed by a ball. Barriers keep them apart, no volume is lost, the pressure
/// rises, and the floor bears the force of the ball.
#[test]
fn a_balloon_is_pressed_onto_a_floor() {
    let contacts = "[obstacle.floor]\nshape = 'half-space'\nat = [0, 0, -0.0312]\n\
        [tool.ball]\nshape = { sphere = { radius = 0.02 } }\nat = [0, 0, 0.0512]\nby = [0, 0, -0.012]\nto = 0.4\n\
        [contact.below]\nbetween = ['balloon', 'floor']\nfriction = 0.5\ncheck-intersections = true\n\
        [contact.above]\nbetween = ['balloon', 'ball']\nfriction = 0.5\ncheck-intersections = true\n";
    for model in ["membrane", "shell"] {
        let text = balloon(model, "solver = 'implicit'\nstep = 0.02", "by = 0", contacts);
        let (start, end) = text.split_once("[constraint.neck]").unwrap();
        let text = format!("{start}{}", &end[end.find("[constraint.air]").unwrap()..]);
        let row = last_row(&text);
        let [up, down] = ["contact.above.z", "contact.below.z"].map(|name| row[name]);
        println!("{model}: {up} N, {down} N, {} Pa, {} m³", row["pressure.air"], row["volume.air"]);
        assert!(up > 0.1 && (up / down.abs() - 1.0).abs() < 0.01, "{model}: {up} {down}");
        let rest = last_row(&text.replace("by = [0, 0, -0.012]", "by = [0, 0, 0]"))["volume.air"];
        assert!((row["volume.air"] / rest - 1.0).abs() < 1e-9, "{model}: {} of {rest}", row["volume.air"]);
        assert!(row["pressure.air"] > 100.0, "{model}: {}", row["pressure.air"]);
    }
}

/// The work of the pressure is counted, and summary and plot show volume and pressure.
#[test]
fn the_pressure_works() {
    for solver in
        ["solver = 'explicit'", "solver = 'quasi-static'\nstep = 0.05", "solver = 'static'\nstep = 0.05"]
    {
        let text = balloon("membrane", solver, FILLED, "");
        let row = last_row(&text);
        let [internal, kinetic, damping, external] =
            ["internal", "kinetic", "damping", "external"].map(|name| row[&format!("energy.{name}")]);
        let off = (internal + kinetic + damping - external).abs() / external.abs();
        println!("{solver}: energies off by {off:.1e}");
        assert!(external > 0.1 && off < 5e-3, "{solver}: {internal} {kinetic} {damping} {external}");
    }
    let out = tempfile::tempdir().unwrap();
    let summary = run(&balloon("membrane", "solver = 'explicit'", FILLED, ""), out.path());
    assert!(summary.energy_balance.unwrap().abs() < 0.01, "{:?}", summary.energy_balance);
    let [(name, [volume, pressure])] = &summary.volumes[..] else { panic!("{:?}", summary.volumes) };
    assert!(name == "air" && *volume > 1.4e-4 && *pressure > 1000.0, "{volume} {pressure}");
    let plot = std::fs::read_to_string(out.path().join("plot.svg")).unwrap();
    assert!(
        ["Pressure [Pa]", "Volume [m³]", "Reaction [N]", "Energy [J]"]
            .iter()
            .all(|title| plot.contains(title))
    );
}

#[test]
fn filled_runs_are_taken_up_with_the_same_bits() {
    for (model, solver) in [
        ("membrane", "solver = 'explicit'\nstep = 1e-4\nprecision = 'double'"),
        ("membrane", "solver = 'explicit'\nstep = 1e-4\nprecision = 'single'"),
        ("membrane", "solver = 'quasi-static'\nstep = 0.1"),
        ("membrane", "solver = 'static'\nstep = 0.1"),
        ("shell", "solver = 'implicit'\nstep = 0.05\nintegrator = 'bdf2'"),
        ("shell", "solver = 'implicit'\nstep = 0.05"),
    ] {
        resumes(&balloon(model, &format!("{solver}\ncheckpoint = {{ every = 0.4 }}"), FILLED, ""));
    }
}

#[test]
fn what_encloses_nothing_is_refused_by_name() {
    let top = "faces = { half-space = { point = [0, 0, 0], normal = [0, 0, 1] } }\nby = 1e-5";
    for (model, solver, volume, more, pieces) in [
        ("membrane", "solver = 'explicit'", top, "", vec!["leave an opening at", "close"]),
        ("membrane", "solver = 'explicit'", "by = -2e-4", "", vec!["encloses", "`by` removes more"]),
        ("membrane", "solver = 'explicit'", "", "", vec!["by"]),
        ("shell", "solver = 'explicit'", "by = 1e-5", "", vec!["no shell can enclose a volume", "`balloon`"]),
        (
            "membrane",
            "solver = 'explicit'",
            "by = 1e-5",
            "[constraint.other]\ntype = 'volume'\nbody = 'balloon'\nby = 0\n",
            vec!["`air` and `other`"],
        ),
    ] {
        let text = balloon(model, solver, volume, more);
        let message = world(&text).err().unwrap_or_else(|| panic!("accepted: {model} {volume}"));
        assert!(pieces.iter().all(|piece| message.contains(piece)), "{message}");
    }
}
