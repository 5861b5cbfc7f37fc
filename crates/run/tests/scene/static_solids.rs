//! Solids of any law with the solvers `static` and `implicit`. They find the same equilibria as dynamic
//! relaxation, with shells in the same system of equations. A resumed run has the same bits, and some scenes
//! are refused.

use std::fs;

use pliant_geometry::{CellKind, io};
use pliant_run::overview;
use pliant_testing::scenes::{assert_rows_agree, last_row, resumes, run, world};

/// A block of 100 × 50 × 50 mm, held at one end, turned and pulled at the other, pressed from above, under
/// its weight.
pub(super) fn block(solver: &str, element: &str, law: &str, more: &str) -> String {
    let cells = if element.starts_with("tet") { "tets" } else { "hexes" };
    format!(
        "[scene]\nuntil = 1\ngravity = [0, 0, -9.81]\n[run]\n{solver}\n\
         [law.tissue]\n{law}\n\
         [body.block]\nmesh = {{ block = {{ size = [0.1, 0.05, 0.05], cells = [4, 2, 2] }}, as = '{cells}' }}\n\
         element = '{element}'\nlaw = 'tissue'\ndensity = 1000\n{more}\n\
         [constraint.base]\ntype = 'fix'\nbody = 'block'\nnodes = {{ set = 'x-min' }}\n\
         [constraint.end]\ntype = 'move'\nbody = 'block'\nnodes = {{ set = 'x-max' }}\n\
         rotate = {{ axis = [1, 0, 0], angle = 0.3, centre = [0.1, 0.025, 0.025] }}\nto = 1\n\
         [load.top]\ntype = 'pressure'\non = 'block'\nfaces = {{ set = 'z-max' }}\npressure = 400\nto = 1\n\
         [output.history]\ntype = 'csv'\nevery = 1\n\
         probes.a = {{ on = 'block', at = [0.05, 0, 0.05], data = ['displacement', 'pk2-stress', 'J'] }}\n\
         probes.b = {{ on = 'block', at = [0.075, 0.05, 0.025], data = ['displacement', 'cauchy-stress'] }}\n\
         probes.c = {{ on = 'block', at = [0.025, 0.025, 0.05], data = ['displacement', 'energy-density'] }}\n"
    )
}

/// The memory of the factors is known before a run that needs them.
#[test]
fn a_check_tells_what_factors_take() {
    let law = format!("type = 'neo-hookean'\n{MATRIX}");
    let factors = |solver: &str| {
        let page = overview(&world(&block(solver, "tet4", &law, "")).unwrap());
        page.lines().find_map(|line| line.strip_prefix("factors of the equations: ").map(str::to_owned))
    };
    for solver in [
        "solver = 'static'",
        "solver = 'implicit'\nstep = 0.1",
        "solver = 'static'\nlinear = { by = 'conjugate-gradients', preconditioner = 'lagged-factors' }",
    ] {
        let factors = factors(solver).unwrap_or_else(|| panic!("{solver}"));
        // 45 nodes of which 9 are held: 27 equations a column at the most.
        let bytes: f64 = factors.split_once(" kB").unwrap().0.parse().unwrap();
        assert!((20.0..200.0).contains(&bytes), "{solver}: {factors}");
    }
    for solver in ["solver = 'quasi-static'", "solver = 'static'\nlinear = 'conjugate-gradients'"] {
        assert_eq!(factors(solver), None, "{solver}");
    }
}

pub(super) const MATRIX: &str = "young-modulus = 1e4\npoisson-ratio = 0.45";
const COMPRESSIBLE: &str = "young-modulus = 1e4\npoisson-ratio = 0.3";

/// Displacements of `static` equal `quasi-static` to 1e-6 of the largest, and stresses and reactions to 1e-5.
#[test]
fn static_equilibria_are_those_of_dynamic_relaxation() {
    let ogden = "type = 'ogden'\npoisson-ratio = 0.45\n\
                 terms = [{ shear-modulus = 2.4e3, exponent = 2.5 }, { shear-modulus = 1e3, exponent = -3.0 }]";
    let fibres =
        format!("type = 'transversely-isotropic'\n{MATRIX}\nfibre-modulus = 5e3\nfibre = [0.8, 0.0, 0.6]");
    let named = |name: &str, moduli: &str| format!("type = '{name}'\n{moduli}");
    for (element, law) in [
        ("tet4", named("neo-hookean", MATRIX)),
        ("tet4", named("st-venant-kirchhoff", COMPRESSIBLE)),
        ("tet4", named("corotational", COMPRESSIBLE)),
        ("tet4-anp", named("neo-hookean", MATRIX)),
        ("tet4-anp", fibres.clone()),
        ("hex8", ogden.into()),
        ("hex8", named("gent", &format!("{MATRIX}\nlimit = 30"))),
        ("hex8", named("corotational", COMPRESSIBLE)),
        ("hex8-full", fibres),
        ("hex8-full", named("neo-hookean", "young-modulus = 1e4\npoisson-ratio = 0.49")),
    ] {
        let newton =
            last_row(&block("solver = 'static'\nload-steps = 2\ntolerance = 1e-10", element, &law, ""));
        let relaxed =
            last_row(&block("solver = 'quasi-static'\nload-steps = 2\ntolerance = 1e-9", element, &law, ""));
        assert_rows_agree(
            &format!("{element} {law}"),
            [&newton, &relaxed],
            &[
                ("displacement", 1e-6),
                ("stress", 1e-5),
                ("energy-density", 1e-5),
                (".J", 1e-6),
                ("reaction.", 1e-5),
            ],
        );
    }
}

/// Laws that relax, in eight steps with a motion that is held after half the steps. The equilibria of
/// `static` equal the equilibria of `quasi-static`, with stresses and reactions.
#[test]
fn relaxing_equilibria_are_those_of_dynamic_relaxation() {
    let both = "prony = [{ part = 'isochoric', weight = 0.5, time = 0.3 }, { part = 'isochoric', weight = 0.2, time = 2 }, \
                { part = 'volumetric', weight = 0.4, time = 0.2 }]";
    let shape = "prony = [{ part = 'isochoric', weight = 0.5, time = 0.3 }]";
    for (element, prony) in [("tet4", both), ("hex8", both), ("tet4-anp", shape), ("hex8-full", shape)] {
        let law = format!("type = 'neo-hookean'\n{MATRIX}\n{prony}");
        let row = |solver: &str| {
            let text = block(&format!("{solver}\nload-steps = 8"), element, &law, "");
            let motion = "centre = [0.1, 0.025, 0.025] }\nto = 1";
            assert!(text.contains(motion));
            // Of loads that act from the start, `static` makes ramps of the first step.
            let weightless = text.replace("gravity = [0, 0, -9.81]\n", "");
            last_row(&weightless.replace(motion, &motion.replace("to = 1", "to = 0.5")))
        };
        let newton = row("solver = 'static'\ntolerance = 1e-10");
        let relaxed = row("solver = 'quasi-static'\ntolerance = 1e-9");
        assert_rows_agree(
            &format!("{element} {law}"),
            [&newton, &relaxed],
            &[("displacement", 1e-6), ("stress", 1e-5), ("reaction.", 1e-5)],
        );
        let [direct, other] = [&newton, &relaxed].map(|row| row["energy.internal"]);
        println!("{element}: internal energy {direct:.6e}, {other:.6e} J");
    }
}

/// If two constraints hold the same component of a node, the first has its reaction: reactions and weight
/// balance.
#[test]
fn reactions_of_shared_nodes_count_once() {
    let law = format!("type = 'neo-hookean'\n{MATRIX}");
    let floor =
        "[constraint.floor]\ntype = 'fix'\nbody = 'block'\nnodes = { set = 'z-min' }\ncomponents = ['z']\n";
    let text = block("solver = 'static'", "hex8", &law, "")
        .replace("pressure = 400", "pressure = 1e-9")
        .replace("nodes = { set = 'x-max' }", "nodes = { set = 'x-max' }\ncomponents = ['x']")
        .replace(
            "rotate = { axis = [1, 0, 0], angle = 0.3, centre = [0.1, 0.025, 0.025] }",
            "by = [0.005, 0, 0]",
        );
    let row = last_row(&(text + floor));
    let sum: f64 = ["base", "end", "floor"].map(|name| row[&format!("reaction.{name}.z")]).iter().sum();
    let weight = 9.81 * 1000.0 * 0.1 * 0.05 * 0.05;
    assert!((sum - weight).abs() < 1e-6 * weight, "{sum} N for {weight} N");
}

/// Backward Euler with damping comes to rest in the equilibrium.
#[test]
fn implicit_motion_comes_to_rest_in_the_equilibrium() {
    let law = format!("type = 'neo-hookean'\n{MATRIX}");
    let still = last_row(&block("solver = 'static'", "hex8", &law, ""));
    let moving = block("solver = 'implicit'\nstep = 0.05", "hex8", &law, "damping = 20")
        .replace("until = 1", "until = 4")
        .replace("every = 1", "every = 4");
    let moved = last_row(&moving);
    for (name, value) in still.iter().filter(|(name, _)| name.contains("displacement")) {
        assert!((value - moved[name]).abs() < 1e-6, "{name}: {value} and {}", moved[name]);
    }
    assert!(moved["energy.kinetic"] < 1e-9 * moved["energy.internal"], "{moved:?}");
}

const WALL: &str = "[law.wall]\ntype = 'neo-hookean'\nyoung-modulus = 1e6\npoisson-ratio = 0.3\n\
    [body.wall]\nmodel = 'shell'\nmesh = { plate = { size = [0.1, 0.05], cells = [4, 2] }, at = [0, 0, 0.1] }\n\
    law = 'wall'\ndensity = 1000\nthickness = 1e-3\n\
    [constraint.rim]\ntype = 'fix'\nbody = 'wall'\nnodes = { set = 'x-min' }\n\
    [output.fields]\ntype = 'vtu'\nevery = 1\ndata = ['displacement', 'von-mises', 'pk2-stress', 'thickness']\n";

/// In one participant, a shell and a solid that do not touch move as in scenes of their own; one file shows
/// both.
#[test]
fn shells_and_solids_go_together() {
    let law = format!("type = 'neo-hookean'\n{MATRIX}");
    let alone = block("solver = 'static'\ntolerance = 1e-10", "hex8", &law, "");
    let both = alone.clone() + WALL;
    assert_eq!(world(&both).unwrap().participants.len(), 1);
    let out = tempfile::tempdir().unwrap();
    run(&both, out.path());
    let frame =
        fs::read_dir(out.path().join("fields")).unwrap().map(|entry| entry.unwrap().path()).max().unwrap();
    let mesh = io::read(&frame).unwrap().mesh;
    let of = |kind: CellKind, name: &str| mesh.block(kind).unwrap().data[name].values.clone();
    assert_eq!((of(CellKind::Triangle, "body")[0], of(CellKind::Hex, "body")[0]), (1.0, 0.0));
    assert!(of(CellKind::Hex, "von-mises").iter().all(|value| *value > 0.0));
    assert!(of(CellKind::Triangle, "thickness").iter().all(|value| *value == 1e-3));
    let has = |kind: CellKind, name: &str| mesh.block(kind).unwrap().data.contains_key(name);
    assert!(!has(CellKind::Hex, "thickness") && !has(CellKind::Triangle, "pk2-stress"));
    let (apart, together) = (last_row(&alone), last_row(&both));
    for (name, value) in apart.iter().filter(|(name, _)| name.starts_with("probe")) {
        assert!((value - together[name]).abs() <= 1e-7 * value.abs().max(1e-3), "{name}: {value}");
    }
}

#[test]
fn a_resumed_run_of_solids_ends_in_the_same_bits() {
    let law = format!("type = 'neo-hookean'\n{MATRIX}");
    for solver in ["solver = 'implicit'\nstep = 0.05", "solver = 'static'\nstep = 0.05"] {
        let text =
            block(&format!("{solver}\ncheckpoint = {{ every = 0.4 }}"), "tet4-anp", &law, "damping = 5");
        resumes(&text);
        let relaxing = format!("{law}\nprony = [{{ part = 'isochoric', weight = 0.5, time = 0.3 }}]");
        assert!(text.contains(&law));
        resumes(&text.replace(&law, &relaxing));
    }
}

#[test]
fn bodies_that_the_solver_cannot_take_are_refused_by_name() {
    let plain = format!("type = 'neo-hookean'\n{MATRIX}");
    let relaxing = format!("{plain}\nprony = [{{ part = 'volumetric', weight = 0.5, time = 1.0 }}]");
    let newton = "solver = 'static'";
    for (text, pieces) in [
        (
            block(newton, "tet4-anp", &relaxing, ""),
            [
                "solver `static` is not for this body",
                "averages the pressure, but the volumetric part of its law relaxes",
            ],
        ),
        (block(newton, "tet4-ianp", &plain, ""), ["`tet4-ianp` couples", "take `tet4-anp`"]),
        (
            block("solver = 'static'\nprecision = 'single'", "tet4", &plain, ""),
            ["`solver = \"static\"` use double precision only", ""],
        ),
        (
            block("solver = 'explicit'\nlinear = 'direct'", "tet4", &plain, ""),
            ["`linear` is for `solver =", ""],
        ),
        (
            block("solver = 'explicit'", "tet4", &plain, "initial-displacement = { point-data = 'u' }"),
            ["`initial-displacement` is for shells and the solvers", ""],
        ),
        (
            block(newton, "tet4", &plain, "").replace(
                "[constraint.base]\ntype = 'fix'",
                "[constraint.base]\ntype = 'fix'\ncomponents = ['x']",
            ),
            ["", ""],
        ),
    ] {
        match world(&text) {
            Err(message) => assert!(pieces.iter().all(|piece| message.contains(piece)), "{message}"),
            Ok(_) => assert_eq!(pieces, ["", ""], "{text}"),
        }
    }
    let loose = block(newton, "tet4", &plain, "");
    let loose = &loose[..loose.find("[constraint.base]").unwrap()];
    let message = world(loose).unwrap_err();
    assert!(message.contains("`block` is free in 6 rigid motions of 6"), "{message}");
}
