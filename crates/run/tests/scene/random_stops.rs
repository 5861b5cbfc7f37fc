//! Runs of random ingredients that are stopped anywhere and taken up again: the same bits.

use pliant_testing::Random;
use pliant_testing::scenes::{looks_change_nothing, world};

/// One of some texts.
fn one<'a>(random: &mut Random, of: &[&'a str]) -> &'a str {
    of[random.below(of.len())]
}

/// A scene of 24 steps in time, or of 8 load steps, of a small cube and whatever else its solver takes.
pub(super) fn ingredients(random: &mut Random) -> String {
    let solver = one(random, &["explicit", "quasi-static", "static", "implicit", "implicit", "implicit"]);
    let equations = ["static", "implicit"].contains(&solver);
    let in_time = ["explicit", "implicit"].contains(&solver);
    let run = run(random, solver, equations);
    let law = law(random);
    let (cells, element) =
        [("tets", "tet4"), ("tets", "tet4-anp"), ("hexes", "hex8"), ("hexes", "hex8-full")][random.below(4)];
    let damping = match solver {
        "implicit" => {
            one(random, &["", "damping = 20\n", "stiffness-damping = 0.001\n", "stiffness-damping = 0.002\n"])
        }
        _ => "damping = 20\n",
    };
    let mut rest = String::new();
    // What holds the cube: the floor alone only where there is inertia.
    let stands = in_time && random.below(2) == 0;
    if !stands {
        rest += &held(random, equations);
    }
    if stands || (equations && random.below(2) == 0) {
        rest += &touched(random, in_time);
    }
    rest += &joined(random, equations, damping);
    let until = if in_time { 0.24 } else { 0.2 };
    let gravity = if stands { "gravity = [2, 0, -9.81]" } else { "gravity = [0, 0, -9.81]" };
    format!(
        "[scene]\nuntil = {until}\n{gravity}\n[run]\n{run}[law.a]\n{law}\
         [body.c]\nmesh = {{ block = {{ size = [0.02, 0.02, 0.006], cells = [3, 3, 2] }}, as = '{cells}', at = [0, 0, 0.0005] }}\n\
         element = '{element}'\nlaw = 'a'\ndensity = 1000\n{damping}{rest}"
    )
}

/// The keys of a solver.
fn run(random: &mut Random, solver: &str, equations: bool) -> String {
    let mut run = format!("solver = '{solver}'\n");
    match solver {
        "explicit" => {
            run += one(random, &["", "precision = 'single'\n", "on-unstable = 'continue'\n"]);
            run += one(random, &["", "mass-scaling = { factor = 1.3 }\n"]);
        }
        "quasi-static" => run += "load-steps = 4\ntolerance = 1e-3\n",
        "static" => run += "load-steps = 8\n",
        _ => {
            run += "step = 0.01\n";
            run += one(random, &["", "integrator = 'bdf2'\n"]);
            run += one(random, &["", "accept-unconverged = true\niterations = 4\n"]);
        }
    }
    if equations {
        run += one(
            random,
            &[
                "",
                "linear = 'unsymmetric'\n",
                "linear = { by = 'conjugate-gradients', preconditioner = 'lagged-factors', tolerance = 1e-6 }\n",
                "linear = { by = 'conjugate-gradients', preconditioner = 'aggregates', tolerance = 1e-6 }\n",
                "linear = { by = 'conjugate-gradients', preconditioner = 'block-jacobi', tolerance = 1e-6 }\n",
            ],
        );
    }
    run
}

/// The keys of the law of the cube.
fn law(random: &mut Random) -> String {
    let law = one(
        random,
        &[
            "type = 'neo-hookean'\nyoung-modulus = 2e4\npoisson-ratio = 0.45\n",
            "type = 'ogden'\nterms = [{ shear-modulus = 7e3, exponent = 3 }]\npoisson-ratio = 0.45\n",
            "type = 'transversely-isotropic'\nyoung-modulus = 2e4\npoisson-ratio = 0.4\nfibre-modulus = 5e3\nfibre = [1, 0, 0]\n",
        ],
    );
    let prony = one(random, &["", "prony = [{ part = 'isochoric', weight = 0.3, time = 0.1 }]\n"]);
    format!("{law}{prony}")
}

/// A clamp, and another constraint.
fn held(random: &mut Random, equations: bool) -> String {
    let limit = if equations { one(random, &["", "force-limit = 0.05\n"]) } else { "" };
    let more = match random.below(4) {
        0 => format!(
            "[constraint.hand]\ntype = 'move'\nbody = 'c'\nnodes = {{ set = 'z-max' }}\nby = [0.001, 0, 0.001]\n{}\n{limit}",
            one(random, &["curve = 'ramp'", "curve = 'hold'", "curve = { wave = 0.05 }"])
        ),
        1 => "[constraint.hand]\ntype = 'mean'\nbody = 'c'\nnodes = { set = 'z-max' }\nby = [0, 0, -0.001]\n".to_owned(),
        2 => format!(
            "[constraint.air]\ntype = 'volume'\nbody = 'c'\nby = 1e-7\n{}",
            if equations { one(random, &["", "pressure-limit = 100\n"]) } else { "" }
        ),
        _ => "[constraint.bone]\ntype = 'rigid'\nbody = 'c'\nnodes = { intersection = [{ set = 'z-max' }, { half-space = { point = [0.012, 0, 0], normal = [1, 0, 0] } }] }\n\
              [load.side]\ntype = 'force'\non = 'c'\nnodes = { set = 'x-max' }\ntotal = [0, 0, -0.02]\n"
            .to_owned(),
    };
    format!("[constraint.low]\ntype = 'fix'\nbody = 'c'\nnodes = {{ set = 'z-min' }}\n{more}")
}

/// A floor, and perhaps a finger.
fn touched(random: &mut Random, in_time: bool) -> String {
    let friction = one(random, &["", "friction = 0.3\n", "friction = 0.6\n"]);
    let mut tables = format!(
        "[obstacle.floor]\nshape = 'half-space'\n[contact.floor]\nbetween = ['c', 'floor']\n{friction}"
    );
    if random.below(2) == 0 {
        tables += &format!(
            "[tool.finger]\nshape = {{ sphere = {{ radius = 0.005 }} }}\nat = [0.01, 0.01, 0.013]\nby = [0.002, 0, -0.003]\n{}\
             [contact.finger]\nbetween = ['c', 'finger']\n{}",
            if in_time { one(random, &["", "force-limit = 0.05\n"]) } else { "" },
            one(random, &["", "friction = 0.4\n"])
        );
    }
    tables
}

/// Perhaps a cord in the cube, and a skin on it.
fn joined(random: &mut Random, equations: bool, damping: &str) -> String {
    let mut tables = String::new();
    if random.below(3) == 0 {
        tables += &format!(
            "[law.thread]\ntype = 'neo-hookean'\nyoung-modulus = 1e5\npoisson-ratio = 0.3\n\
             [body.cord]\nmodel = 'bar'\nmesh = {{ lines = [[[0.003, 0.01, 0.004], [0.017, 0.01, 0.004]]], edge = 0.006 }}\n\
             law = 'thread'\narea = 1e-6\ndensity = 1000\n{damping}[tie.cord]\nbetween = ['cord', 'c']\n"
        );
    }
    if equations && random.below(3) == 0 {
        let model = one(random, &["membrane", "shell"]);
        tables += &format!(
            "[law.skin]\ntype = 'neo-hookean'\nyoung-modulus = 1e5\npoisson-ratio = 0.3\n\
             [body.skin]\nmodel = '{model}'\non = 'c'\nfaces = {{ set = 'x-min' }}\nlaw = 'skin'\nthickness = 2e-4\ndensity = 1000\n"
        );
    }
    tables
}

/// Looks at random scenes while they run, and resumes them there. Scenes that cannot be built or fail are
/// left out; most run to their end.
fn stopped_anywhere(seeds: std::ops::Range<u64>) {
    let (mut built, mut refused) = (0, 0);
    for seed in seeds {
        let text = ingredients(&mut Random::new(seed));
        let world = match world(&text) {
            Ok(world) => world,
            Err(message) => {
                println!("seed {seed}: refused: {}", message.lines().next().unwrap_or_default());
                refused += 1;
                continue;
            }
        };
        let steps = world.steps();
        let mut simulation = world.simulation().unwrap();
        let ended = std::iter::repeat_with(|| simulation.step(1)).take(steps as usize).find_map(Result::err);
        if let Some(failure) = ended {
            println!("seed {seed}: ended: {failure}");
            refused += 1;
            continue;
        }
        println!("seed {seed}: {steps} steps\n{text}");
        looks_change_nothing(&world);
        built += 1;
    }
    println!("{built} runs, {refused} refused");
    assert!(3 * refused < built, "{refused} of {} scenes say nothing", built + refused);
}

#[test]
fn a_run_of_random_ingredients_goes_on_with_the_same_bits() {
    stopped_anywhere(0..40);
}

/// By hand: `cargo test --release -p pliant-run --test scene random_stops -- --ignored --nocapture`.
#[test]
#[ignore = "ten minutes"]
fn many_runs_of_random_ingredients_go_on_with_the_same_bits() {
    stopped_anywhere(40..1000);
}
