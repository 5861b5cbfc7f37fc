//! Hourglass modes of `hex8`: what holds them in tissue that stiffens, and how a run ends that they dominate.

use pliant_run::{OutputFolder, run};
use pliant_testing::scenes::{last_row, resumes, world};

/// A cube of brain tissue (Ogden, α = −25) that is squeezed evenly by 30 %, its sides free.
fn squeezed(solver: &str, body: &str) -> String {
    let side = |axis: &str| {
        format!(
            "[constraint.{axis}]\ntype = 'fix'\nbody = 'b'\nnodes = {{ set = '{axis}-min' }}\ncomponents = ['{axis}']\n"
        )
    };
    format!(
        "[scene]\nuntil = 1\n[run]\n{solver}\n\
         [law.a]\ntype = 'ogden'\nterms = [{{ shear-modulus = 400, exponent = -25 }}]\nbulk-modulus = 4e4\n\
         [body.b]\nmesh = {{ block = {{ size = [0.01, 0.01, 0.01], cells = [2, 2, 2] }}, as = 'hexes' }}\n\
         law = 'a'\ndensity = 1000\n{body}\n{}{}{}\
         [constraint.m]\ntype = 'move'\nbody = 'b'\nnodes = {{ set = 'z-max' }}\nby = [0, 0, -0.003]\ncomponents = ['z']\nto = 1\n\
         [output.history]\ntype = 'csv'\nevery = 1\n",
        side("x"),
        side("y"),
        side("z")
    )
}

/// The exact force on the cube [N], from a bisection for the stretch across at which nothing presses there.
fn exact() -> f64 {
    let stress = |across: f64| {
        let (stretch, j) = ([across, across, 0.7], across * across * 0.7);
        let powers = stretch.map(|l: f64| 2.0 * 400.0 / -25.0 * (l * j.powf(-1.0 / 3.0)).powi(-25));
        let mean = powers.iter().sum::<f64>() / 3.0;
        let pressure = 4e4 * (j - 1.0) * j;
        [0, 1, 2].map(|c| (powers[c] - mean + pressure) / stretch[c])
    };
    let [mut low, mut high] = [0.9, 1.3];
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if stress(middle)[0] > 0.0 { high = middle } else { low = middle }
    }
    stress(low)[2] * 1e-4
}

/// With a constant stiffness the cube collapses into hourglass modes (a tenth of the force); with one that
/// follows the law it keeps its shape.
#[test]
fn evenly_squeezed_tissue_keeps_its_shape() {
    let exact = exact();
    assert!((exact + 3.19).abs() < 0.005, "{exact}");
    for (solver, body) in [
        ("solver = 'quasi-static'", ""),
        ("solver = 'static'\nload-steps = 10", ""),
        ("solver = 'implicit'\nstep = 0.02", ""),
        ("solver = 'explicit'", "damping = 200"),
        ("solver = 'explicit'\nprecision = 'single'", "damping = 200"),
        ("solver = 'quasi-static'", "element = 'hex8-full'"),
    ] {
        let force = last_row(&squeezed(solver, body))["reaction.m.z"];
        println!("{solver} {body}: {force:.4} N");
        assert!((force / exact - 1.0).abs() < 0.05, "{solver} {body}: {force} for {exact}");
    }
}

#[test]
fn a_resumed_run_of_a_growing_stiffness_ends_in_the_same_bits() {
    for solver in [
        "solver = 'explicit'\nstep = 2e-5",
        "solver = 'quasi-static'\nstep = 0.1",
        "solver = 'static'\nstep = 0.1",
    ] {
        let checkpoint = "checkpoint = { every = 0.4 }";
        resumes(&squeezed(&format!("{solver}\n{checkpoint}"), ""));
    }
}

/// A constant `hourglass` is kept as it is given. The run ends with most of its energy in hourglass modes and
/// writes its outputs. It fails unless the scene allows that share.
#[test]
fn a_run_that_ends_in_hourglass_modes_fails_after_its_outputs() {
    for solver in ["solver = 'quasi-static'", "solver = 'explicit'"] {
        let of = |allowed: &str| {
            let text = squeezed(&format!("{solver}\n{allowed}"), "hourglass = 0.2\ndamping = 200");
            let (world, out) = (world(&text).unwrap(), tempfile::tempdir().unwrap());
            let folder = OutputFolder::prepare(out.path().to_owned(), &world.scene, false).unwrap();
            let summary = run(&world, &folder, &mut |_| ()).unwrap();
            let rows = std::fs::read_to_string(out.path().join("history.csv")).unwrap().lines().count();
            assert_eq!(rows, 3, "{solver}");
            assert!(out.path().join("summary.md").exists() && out.path().join("plot.svg").exists());
            summary
        };
        let ended = of("");
        let error = ended.error.unwrap();
        assert_eq!((ended.status, error.kind.word()), ("failed", "hourglass"), "{solver}: {error}");
        for piece in
            ["of the internal energy", "more than 10.00 % that `allow-hourglass`", "`b`", "hex8-full"]
        {
            assert!(error.message.contains(piece), "{error}");
        }
        assert_eq!(of("allow-hourglass = 1e9").status, "done");
    }
}
