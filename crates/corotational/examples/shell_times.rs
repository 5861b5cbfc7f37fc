//! Time of an implicit step of 40 ms for a tube of shells under a pulsing pressure, by number of shells and linear solver: one linear
//! solution a step. `cargo run --release -p pliant-corotational --example shell_times [SHELLS …]`.

use std::f64::consts::TAU;
use std::time::Instant;

use nalgebra::Vector3;
use pliant_corotational::element::Elasticity;
use pliant_corotational::{
    BackwardEuler, Constraint, DynamicSettings, LinearSolver, Load, LoadKind, Material, Model, Motion,
    Preconditioner, Shell, Spread, State,
};
use pliant_mechanics::curve::{Curve, Shape};

/// A bowel-like tube: radius 20 mm, length 200 mm, wall 2 mm, E = 0.1 MPa, ν = 0.45, both ends held, 1 kPa twice a second.
fn tube(shells: usize) -> Model {
    // Cells about as long as wide: 2 a n = shells with n/a = 200/(40 π).
    let around = ((shells as f64 / 2.0) * (0.04 * TAU / 2.0) / 0.2).sqrt().round().max(3.0) as usize;
    let along = (shells / 2 / around).max(1);
    let point = |i: usize| {
        let angle = TAU * (i % around) as f64 / around as f64;
        Vector3::new(0.02 * angle.cos(), 0.02 * angle.sin(), 0.2 * (i / around) as f64 / along as f64)
    };
    let node = |i: usize, j: usize| (i % around + around * j) as u32;
    let cell = |c: usize| {
        let (i, j) = (c % around, c / around);
        let [a, b, c, d] = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    let mut model = Model::new((0..around * (along + 1)).map(point).collect());
    let material = Material { elastic: Elasticity { young: 1e5, poisson: 0.45 }, density: 1000.0 };
    let cells = (0..around * along).flat_map(cell).collect();
    model.add_shell(&Shell::new("tube", cells, 0.002, material)).expect("a tube is a sound shell");
    let last = (around * (along + 1)) as u32;
    let ends = (0..around as u32).chain(last - around as u32..last).collect();
    model.constraints.push(Constraint {
        name: "ends".into(),
        nodes: ends,
        components: [true; 6],
        motion: Motion::Fixed,
    });
    let kind = LoadKind::Pressure {
        cells: (0..model.facets.len() as u32).collect(),
        pressure: 1000.0,
        spread: Spread::Lumped,
    };
    let pulse = (0..40).map(|i| (0.25 * f64::from(i), f64::from(i % 2))).collect();
    let curve = Curve { shape: Shape::Table(pulse), from: 0.0, to: 1.0 };
    model.loads.push(Load { name: "pressure".into(), kind, curve, controlled: false });
    model.mass_damping = 1.0;
    model
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let given: Vec<usize> = std::env::args().skip(1).map(|n| n.parse()).collect::<Result<_, _>>()?;
    let sizes = if given.is_empty() { vec![200, 800, 1000, 4000, 20_000, 50_000] } else { given };
    let gradients = |tolerance, iterations, preconditioner| LinearSolver::ConjugateGradients {
        tolerance,
        iterations,
        preconditioner,
    };
    let solvers = [
        ("factors", LinearSolver::Direct),
        ("CG, older factors, 1e-3", gradients(1e-3, 500, Preconditioner::LaggedFactors { renew_after: 12 })),
        ("CG, blocks, 1e-3", gradients(1e-3, 5000, Preconditioner::BlockJacobi)),
        ("CG, aggregates, 1e-3", gradients(1e-3, 5000, Preconditioner::Aggregates)),
        ("CG, blocks, 5e-2", gradients(5e-2, 5000, Preconditioner::BlockJacobi)),
    ];
    println!(
        "| shells | solver | step [ms] | worst [ms] | cells | factors | solution [ms] | iterations | residual |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for shells in sizes {
        let model = tube(shells);
        for (name, linear) in solvers {
            if std::env::var("ONLY").is_ok_and(|only| !name.contains(&only)) {
                continue;
            }
            let settings = DynamicSettings::new(0.04).real_time(linear);
            let mut solver = BackwardEuler::new(&model, settings)?;
            let mut state = State::at_rest(&model);
            let steps = 50;
            let (mut worst, mut residual) = (0.0_f64, 0.0_f64);
            let start = Instant::now();
            let mut failed = None;
            for _ in 0..steps {
                let step = Instant::now();
                match solver.advance(&mut state) {
                    Ok(step) => residual = residual.max(step.linear.residual),
                    Err(error) => {
                        failed = Some(error);
                        break;
                    }
                }
                worst = worst.max(step.elapsed().as_secs_f64());
            }
            if let Some(error) = failed {
                println!("| {} | {name} | {error} |", model.facets.len());
                continue;
            }
            let mean = start.elapsed().as_secs_f64() / f64::from(steps);
            let phases = solver.phases();
            let part = |duration: std::time::Duration| duration.as_secs_f64() * 1e3 / f64::from(steps);
            println!(
                "| {} | {name} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.1} | {residual:.0e} |",
                model.facets.len(),
                mean * 1e3,
                worst * 1e3,
                part(phases.cells),
                part(phases.preparation),
                part(phases.solution),
                phases.iterations as f64 / f64::from(steps)
            );
        }
    }
    Ok(())
}
