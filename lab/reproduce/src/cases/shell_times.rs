//! Figure 9.4 and beyond: time of an implicit step of 40 ms for shells under pressure, by their number and
//! the linear solver. The body is a tube like a bowel (radius 20 mm, length 200 mm, wall 2 mm, E = 0.1 MPa,
//! ν = 0.45, both ends fixed). Its pressure pulses between 0 and 1 kPa twice a second. Each step has one
//! linear solution.

use pliant_bench::{SHELL_STEP, ShellRun, tube};
use pliant_geometry::Vector3;
use pliant_implicit::AssemblySolver;
use pliant_implicit::{Assembly, DynamicSettings, Phases, Shell, State, StaticSettings, Statics};
use pliant_linear::{LinearSolver, Preconditioner};
use pliant_mechanics::load::{Load, LoadKind};
use pliant_mechanics::model::{Constraint, Motion};
use pliant_shells::element::Elasticity;
use pliant_shells::element::Wall;

use crate::case::{Case, CaseError, Findings, Row};
use crate::plot::{Curve, Key, Pen, Plot};
use crate::shells::ramp;

/// Residual over the loads at which conjugate gradients stop.
const TOLERANCE: f64 = 1e-3;
/// Elements of figure 9.4.
const PRINTED: [usize; 5] = [200, 400, 600, 800, 1000];
/// Elements of the plot of costs, and steps measured of each.
const SIZES: [(usize, usize); 6] =
    [(200, 50), (800, 50), (4000, 50), (10_000, 25), (20_000, 15), (50_000, 8)];

/// Figure 9.4.
pub(crate) const CASE: Case = Case {
    id: "fig-9.4",
    title: "Fig. 9.4: time of a step by the number of shells",
    shows: "Time of an implicit step of 40 ms of 200 to 1,000 shells under pressure, with conjugate gradients. On a CPU of 2010 \
            it was in real time for 800 shells at a residual of 5 %, and for 1,000 with 100 iterations without a check. Here the \
            same two settings run, and then a residual of 0.1 % with several solvers up to 50,000 shells. The times of this \
            machine are not judged. A residual measures forces; the last row gives the error in displacements at 5 %.",
    corrections: &[],
    seconds: 90.0,
    compute,
};

fn gradients(tolerance: f64, preconditioner: Preconditioner) -> LinearSolver {
    LinearSolver::ConjugateGradients { tolerance, iterations: 5000, preconditioner }
}

/// One linear solution a step.
fn real_time(linear: LinearSolver) -> DynamicSettings {
    DynamicSettings::new(SHELL_STEP).real_time(linear)
}

/// The thesis's two settings: residual 5 %, and 100 iterations.
fn printed() -> [DynamicSettings; 2] {
    let hundred = LinearSolver::ConjugateGradients {
        tolerance: 0.0,
        iterations: 100,
        preconditioner: Preconditioner::BlockJacobi,
    };
    [
        real_time(gradients(0.05, Preconditioner::BlockJacobi)),
        DynamicSettings { accept_stalled: true, ..real_time(hundred) },
    ]
}

/// Solvers to compare.
fn solvers() -> [(&'static str, LinearSolver); 4] {
    [
        ("factors", LinearSolver::Direct),
        ("CG, earlier factors", gradients(TOLERANCE, Preconditioner::LaggedFactors { renew_after: 12 })),
        ("CG, blocks", gradients(TOLERANCE, Preconditioner::BlockJacobi)),
        ("CG, blocks and aggregates", gradients(TOLERANCE, Preconditioner::Aggregates)),
    ]
}

/// Median time [s] of a factorisation and a solution, for a hexagon of 469 nodes.
fn hexagon() -> Result<f64, CaseError> {
    const RINGS: i32 = 12;
    let inside = |(i, j): (i32, i32)| i.abs().max(j.abs()).max((i + j).abs()) <= RINGS;
    let range = || (-RINGS..=RINGS).flat_map(|i| (-RINGS..=RINGS).map(move |j| (i, j)));
    let lattice: Vec<(i32, i32)> = range().filter(|&at| inside(at)).collect();
    let node = |at: (i32, i32)| lattice.iter().position(|&other| other == at).map(|node| node as u32);
    let place = |&(i, j): &(i32, i32)| {
        Vector3::new(0.01 * (f64::from(i) + 0.5 * f64::from(j)), 0.005 * 3.0_f64.sqrt() * f64::from(j), 0.0)
    };
    let cells = range().flat_map(|(i, j)| {
        let corners = [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)].map(node);
        let cell = |[a, b, c]: [Option<u32>; 3]| Some([a?, b?, c?]);
        [cell([corners[0], corners[1], corners[2]]), cell([corners[1], corners[3], corners[2]])]
    });
    let mut model = Assembly::new("shell", lattice.iter().map(place));
    let material = Wall { elastic: Elasticity { young: 1e6, poisson: 0.3 }, density: 1000.0 };
    model.add_shell(&Shell::new("hexagon", cells.flatten().collect(), 0.001, material))?;
    let held = [[true; 3], [false; 3]].concat();
    let nodes = (0..lattice.len()).filter(|&n| lattice[n].0.abs() == RINGS).map(|n| n as u32).collect();
    let components = std::array::from_fn(|c| held[c]);
    model.model_mut().constraints.push(Constraint {
        name: "sides".into(),
        nodes,
        components,
        motion: Motion::Fixed,
    });
    let kind = LoadKind::Gravity { body: 0, acceleration: [0.0, 0.0, -9.81] };
    model.model_mut().loads.push(Load::new("weight", kind, ramp()));
    let mut times = Vec::new();
    let mut solver = Statics::new(model.clone(), StaticSettings::default())?;
    for _ in 0..50 {
        let before = solver.phases();
        solver.linear(&State::at_rest(&model), 1.0)?;
        let after = solver.phases();
        times.push((after.preparation + after.solution - before.preparation - before.solution).as_secs_f64());
    }
    times.sort_unstable_by(f64::total_cmp);
    Ok(times[times.len() / 2])
}

fn compute() -> Result<Findings, CaseError> {
    let mut findings = Findings::default();
    let mut curves = Vec::new();
    let thesis = "thesis: real time at 40 ms, on a CPU of 2010";
    for (colour, (name, settings)) in
        ["residual 5 %", "100 iterations, unchecked"].into_iter().zip(printed()).enumerate()
    {
        let mut points = Vec::new();
        for shells in PRINTED {
            let found = ShellRun::measure(shells, settings, None, [0, 40])?;
            points.push((found.shells as f64, 1e3 * found.time.median));
            if shells == [800, 1000][colour] {
                let quantity = format!("{shells} shells, {name}: a step");
                findings.rows.push(Row::timed(quantity, "ms", Some(40.0), 1e3 * found.time.median, thesis));
                let quantity = format!("{shells} shells, {name}: largest residual");
                findings.rows.push(Row::timed(quantity, "", None, found.residual, ""));
            }
        }
        curves.push(Curve::new(name, colour, Pen::Line, points.clone()));
        curves.push(Curve::new("", colour, Pen::Markers, points));
    }
    let plot = |title, curves, logarithmic| Plot {
        title,
        axes: ["shells", "time of a step [ms]"],
        logarithmic,
        key: Key::UpperLeft,
        curves,
    };
    let caption = "Conjugate gradients with inverted diagonal blocks, steps of 40 ms, median of 40.";
    findings.figures.push(plot("Figure 9.4 on this machine", &curves, false).figure(caption)?);

    let mut curves = vec![Curve::new("real time", 5, Pen::Dashes, vec![(200.0, 40.0), (50_000.0, 40.0)])];
    for (colour, (name, linear)) in solvers().into_iter().enumerate() {
        let mut points = Vec::new();
        for (shells, steps) in SIZES {
            let found = ShellRun::measure(shells, real_time(linear), None, [0, steps])?;
            points.push((found.shells as f64, 1e3 * found.time.median));
            if matches!(shells, 800 | 4000 | 20_000) {
                add_rows(&mut findings, shells, name, &found);
            }
        }
        curves.push(Curve::new(name, colour, Pen::Line, points.clone()));
        curves.push(Curve::new("", colour, Pen::Markers, points));
    }
    let caption =
        "One linear solution per step, residual 0.1 % with conjugate gradients; median of 8 to 50 steps.";
    findings.figures.push(plot("Solvers", &curves, true).figure(caption)?);

    let quantity = "469 nodes: factorisation and solution";
    findings.rows.push(Row::timed(quantity, "ms", Some(4.0), 1e3 * hexagon()?, "required of this machine"));
    let [loose, _] = printed();
    let [loose, exact] = [loose, real_time(LinearSolver::Direct)]
        .map(|settings| ShellRun::measure(800, settings, None, [0, 19]));
    let (loose, exact) = (loose?.last, exact?.last);
    let tube = tube(800)?;
    let rest = State::at_rest(&tube).position;
    let norm =
        |of: &dyn Fn(usize) -> Vector3| (0..rest.len()).map(|n| of(n).norm_squared()).sum::<f64>().sqrt();
    let off = norm(&|n| loose.position[n] - exact.position[n]) / norm(&|n| exact.position[n] - rest[n]);
    let quantity =
        "800 shells after 0.76 s: displacements at a residual of 5 %, deviation from the direct solver";
    findings.rows.push(Row::shown(quantity, "", off, ""));
    Ok(findings)
}

fn add_rows(findings: &mut Findings, shells: usize, name: &str, found: &ShellRun) {
    let [median, least, most] = [found.time.median, found.time.least, found.time.most].map(|t| 1e3 * t);
    let asked = match shells {
        4000 => (Some(40.0), "required of this machine"),
        20_000 => (Some(40.0), "goal on this machine"),
        _ => (None, ""),
    };
    let mut add = |what: &str, unit, reference, value, source| {
        findings.rows.push(Row::timed(
            format!("{shells} shells, {name}: {what}"),
            unit,
            reference,
            value,
            source,
        ));
    };
    add("a step, median", "ms", asked.0, median, asked.1);
    add("least", "ms", None, least, "");
    add("most", "ms", None, most, "");
    let Phases { cells, preparation, solution, iterations, .. } = found.phases;
    for (what, time) in
        [("cells, mean", cells), ("preparation, mean", preparation), ("solution, mean", solution)]
    {
        add(what, "ms", None, 1e3 * time.as_secs_f64() / found.steps as f64, "");
    }
    if iterations > 0 {
        add("iterations, mean", "", None, iterations as f64 / found.steps as f64, "");
        add("residual, largest", "", None, found.residual, "");
    }
}
