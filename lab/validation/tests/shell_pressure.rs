//! Pressure on thin curved walls, node by node: free cylinders, whole and a quarter of one, on regular and
//! irregular meshes, and spheres. A cylinder that is free at its ends bends almost without stretching. Its
//! response therefore magnifies errors of nodal forces by R²/t². Lamé for a thin wall: u = p R²/(E t).

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use pliant_geometry::{Mesh, Vector3};
use pliant_implicit::{Assembly, AssemblyState, ExplicitShells, StaticSettings, Statics, Step};
use pliant_mechanics::load::{LoadKind, Spread};
use pliant_meshing::{DEFAULT_CELL_LIMIT, Pattern, Sheet, sphere};
use pliant_shells::element::{Bending, Formulation, Membrane};
use pliant_validation::shells::{FLAT, Specimen, symmetry};
use pliant_validation::{Random, claim};

const POISSON: f64 = 0.3;

/// Pattern of the triangles of a cylinder of radius 1.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Cut {
    Diagonal,
    Crossed,
    /// Nodes moved by up to a quarter of a cell both ways, also along the rims; diagonals by chance.
    Irregular(u64),
}

/// A whole cylinder of height 2, or the eighth between three planes of symmetry, of some cells round and
/// along.
fn cylinder(cut: Cut, whole: bool, [round, along]: [usize; 2]) -> Mesh {
    let sheet = Sheet::Cylinder {
        radius: 1.0,
        length: if whole { 2.0 } else { 1.0 },
        from: 0.0,
        span: if whole { TAU } else { FRAC_PI_2 },
    };
    let pattern = if cut == Cut::Crossed { Pattern::Crossed } else { Pattern::Diagonal };
    let mut mesh = sheet.mesh([round, along], pattern, None, DEFAULT_CELL_LIMIT).unwrap();
    let Cut::Irregular(seed) = cut else { return mesh };
    let mut random = Random::new(seed);
    let span = if whole { TAU } else { FRAC_PI_2 };
    let (step, height) = (span / round as f64, if whole { 2.0 } else { 1.0 });
    for (number, point) in mesh.points.iter_mut().enumerate() {
        let columns = if whole { round } else { round + 1 };
        let (i, j) = (number % columns, number / columns);
        let [turn, lift] = [(); 2].map(|()| 0.25 * random.number());
        // Held nodes keep their places.
        let free = if whole { j > 0 || 4 * i % round != 0 } else { i > 0 && i < round };
        let angle = step * (i as f64 + if free { turn } else { 0.0 });
        let z = height / along as f64 * (j as f64 + if j > 0 && j < along { lift } else { 0.0 });
        *point = Vector3::new(angle.cos(), angle.sin(), z);
    }
    for corners in mesh.blocks[0].nodes.chunks_exact_mut(6) {
        if random.number() > 0.0 {
            let [a, b, c, _, _, d] = [0, 1, 2, 3, 4, 5].map(|i| corners[i]);
            corners.copy_from_slice(&[a, b, d, b, c, d]);
        }
    }
    let normals = mesh.points.iter().flat_map(|p| [p.x, p.y, 0.0]).collect();
    mesh.point_data.get_mut("normal").unwrap().values = normals;
    mesh
}

/// The cylinder under a pressure that strains it by 1e-6, held only against rigid motions and at planes of
/// symmetry.
fn pressed(mesh: Mesh, whole: bool, thickness: f64, formulation: Formulation, spread: Spread) -> Specimen {
    let cylinder = Specimen::new(mesh, [1.0, POISSON], thickness, formulation).unwrap();
    let cylinder = if whole {
        let [first, second, third] =
            [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]].map(|[x, y]| cylinder.node(x, y, 0.0));
        cylinder
            .prescribe(vec![first, third], [false, true, true, false, false, false])
            .prescribe(vec![second], [true, false, true, false, false, false])
    } else {
        cylinder
            .prescribe_edge("z-min", symmetry(2))
            .prescribe_edge("start", symmetry(1))
            .prescribe_edge("end", symmetry(0))
    };
    let cells = (0..cylinder.model.facets.len() as u32).collect();
    cylinder.load(LoadKind::ShellPressure { facets: cells, pressure: 1e-6 * thickness, spread })
}

/// Radial displacement of each node by linear theory over Lamé's.
fn ratios(cylinder: &Specimen) -> Vec<f64> {
    let mut solver = Statics::new(cylinder.model.clone(), StaticSettings::default()).unwrap();
    let moved = solver.linear(&AssemblyState::at_rest(&cylinder.model), 1.0).unwrap();
    let radial = |(u, x): (&[f64; 6], Vector3)| (u[0] * x.x + u[1] * x.y) / 1e-6;
    moved.iter().zip(cylinder.model.places()).map(radial).collect()
}

fn bounds(ratios: &[f64]) -> [f64; 2] {
    [
        ratios.iter().copied().fold(f64::INFINITY, f64::min),
        ratios.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    ]
}

/// The largest deviation from 1.
fn off(ratios: &[f64]) -> f64 {
    ratios.iter().map(|r| (r - 1.0).abs()).fold(0.0, f64::max)
}

const DEFAULT: (Formulation, Spread) =
    (Formulation { membrane: CURVED, bending: Bending::Dkt }, Spread::Curved);
const CURVED: Membrane = Membrane::Curved { adaptation: 10.0 };

/// Prints the displacements of a quarter, by element and spread of the pressure.
#[test]
fn a_quarter_cylinder_before_and_after() {
    println!("u/exact at the nodes of a quarter, 10 x 7 cells, R/t = 25, 100, 1000");
    for cut in [Cut::Diagonal, Cut::Crossed, Cut::Irregular(1)] {
        let pairs =
            [("dkt-opt, lumped", (FLAT, Spread::Lumped)), ("dkt-opt, curved", (FLAT, Spread::Curved))];
        for (name, (formulation, spread)) in pairs.into_iter().chain([("dkt-curved, curved", DEFAULT)]) {
            let row = [25.0, 100.0, 1000.0].map(|ratio: f64| {
                let [least, most] = bounds(&ratios(&pressed(
                    cylinder(cut, false, [10, 7]),
                    false,
                    1.0 / ratio,
                    formulation,
                    spread,
                )));
                format!("{least:.4} to {most:.4}")
            });
            println!("{cut:?}, {name}: {}", row.join("; "));
        }
    }
    for (cut, limit) in [(Cut::Diagonal, 0.01), (Cut::Crossed, 0.01), (Cut::Irregular(1), 0.05)] {
        for thickness in [0.04, 0.01] {
            let (formulation, spread) = DEFAULT;
            let found =
                ratios(&pressed(cylinder(cut, false, [10, 7]), false, thickness, formulation, spread));
            claim(&format!("quarter, {cut:?}, t = {thickness}"), off(&found), limit);
        }
    }
}

/// 40 edges round, 13 along, both rims free. Regular meshes up to R/t = 1000, irregular ones up to 100, where
/// edges of 1.6 √(R t) are below 2.
#[test]
fn a_free_cylinder_under_pressure_stays_round() {
    let (formulation, spread) = DEFAULT;
    let worst = |cut, thickness| {
        off(&ratios(&pressed(cylinder(cut, true, [40, 13]), true, thickness, formulation, spread)))
    };
    for cut in [Cut::Diagonal, Cut::Crossed] {
        for (thickness, limit) in [(0.04, 0.01), (0.01, 0.01), (0.001, 0.006)] {
            claim(&format!("cylinder, {cut:?}, t = {thickness}"), worst(cut, thickness), limit);
        }
    }
    // The reference values, from one mesh, are 1.0 and 2.2 %. On twelve meshes the prototype's formulas, in
    // its axes, give 0.6 to 1.1 and 2.0 to 5.0 %.
    for (thickness, limit) in [(0.04, 0.012), (0.01, 0.055)] {
        let deviations: Vec<f64> = (1..=12).map(|seed| worst(Cut::Irregular(seed), thickness)).collect();
        let [least, most] = bounds(&deviations);
        println!(
            "twelve irregular cylinders, t = {thickness}: off by {:.2} to {:.2} %",
            100.0 * least,
            100.0 * most
        );
        claim(&format!("cylinder, irregular, t = {thickness}"), most, limit);
    }
}

/// A8 of the acceptance tests of contact: a tube of r = 3 mm and t = 0.3 mm, E = 1 MPa, ν = 0.42, at 5 kPa.
/// Thin walls with open ends widen by u = p r²/(E t) = 150 µm. With closed ends they widen by (1 − ν/2) u, in
/// plane strain by (1 − ν²) u. The stress around the tube is p r/t = 50 kPa.
#[test]
fn a_tube_widens_as_its_ends_allow() {
    let (radius, thickness, young, nu, pressure) = (3e-3, 3e-4, 1e6, 0.42, 5e3);
    let mesh = || {
        let mut mesh = cylinder(Cut::Diagonal, false, [10, 7]);
        mesh.points.iter_mut().for_each(|point| *point *= radius);
        mesh
    };
    for (ends, part) in [("open", 1.0), ("closed", 1.0 - 0.5 * nu), ("held", 1.0 - nu * nu)] {
        let tube = Specimen::new(mesh(), [young, nu], thickness, DEFAULT.0).unwrap();
        let mut tube = tube
            .prescribe_edge("z-min", symmetry(2))
            .prescribe_edge("start", symmetry(1))
            .prescribe_edge("end", symmetry(0));
        let cells = (0..tube.model.facets.len() as u32).collect();
        let kind = LoadKind::ShellPressure { facets: cells, pressure, spread: Spread::Curved };
        tube = tube.load(kind);
        match ends {
            "closed" => tube = tube.pull_edge("z-max", [0.0, 0.0, 0.25 * PI * radius * radius * pressure]),
            "held" => tube = tube.prescribe_edge("z-max", symmetry(2)),
            _ => {}
        }
        let exact = part * pressure * radius * radius / (young * thickness);
        let mut solver = Statics::new(tube.model.clone(), StaticSettings::default()).unwrap();
        let moved = solver.linear(&AssemblyState::at_rest(&tube.model), 1.0).unwrap();
        let radial = |(u, x): (&[f64; 6], Vector3)| (u[0] * x.x + u[1] * x.y) / radius / exact;
        let found: Vec<f64> = moved.iter().zip(tube.model.places()).map(radial).collect();
        claim(&format!("tube with {ends} ends: widening"), off(&found), 0.03);
        // A thousandth of the load is nearly linear.
        let mut state = AssemblyState::at_rest(&tube.model);
        solver.solve(&mut state, 1e-3).unwrap();
        let around = |facet: usize| {
            let resultants = state.resultants(&tube.model, facet).unwrap();
            let nodes = tube.model.facets[facet].nodes.map(|node| tube.model.place(node as usize));
            let middle = (nodes[0] + nodes[1] + nodes[2]) / 3.0;
            let tangent = resultants.axes.transpose() * Vector3::new(-middle.y, middle.x, 0.0).normalize();
            let [a, b] = [tangent.x, tangent.y];
            let [xx, yy, xy] = resultants.membrane.into();
            (a * a * xx + b * b * yy + 2.0 * a * b * xy) / (1e-3 * pressure * radius)
        };
        let stresses: Vec<f64> = (0..tube.model.facets.len()).map(around).collect();
        claim(&format!("tube with {ends} ends: stress around it"), off(&stresses), 0.03);
    }
}

/// A thousandth of the pressure moves the wall a thousandth as far. In linear theory the pressure's own
/// stiffness, 11 D/R³ at R/t = 1000, has no effect.
#[test]
fn linear_theory_is_linear_in_the_pressure() {
    let (formulation, spread) = DEFAULT;
    let mut cylinder = pressed(cylinder(Cut::Diagonal, false, [10, 7]), false, 0.001, formulation, spread);
    let whole = ratios(&cylinder);
    let LoadKind::ShellPressure { pressure, .. } = &mut cylinder.model.model_mut().loads[0].kind else {
        panic!("no pressure")
    };
    *pressure *= 1e-3;
    let part = ratios(&cylinder);
    let apart = whole.iter().zip(&part).map(|(a, b)| (a - 1e3 * b).abs()).fold(0.0, f64::max);
    // Round-off times (R/t)².
    claim("linear theory, two pressures", apart, 1e-6);
}

/// Tests R/t = 5000, where flat membranes find no equilibrium. Regular meshes are strained by 1e-3 in one
/// load step, also a crossed mesh with edges of 11 √(R t). An irregular mesh with edges of 2 √(R t), the
/// longest that are advised, is strained by 1e-6. At a strain of 1e-3, five times its thickness, the
/// irregular mesh finds no equilibrium; nor do coarser irregular meshes.
#[test]
fn a_very_thin_cylinder_finds_its_equilibrium() {
    let (formulation, spread) = DEFAULT;
    for (cut, whole, cells, strain) in [
        (Cut::Crossed, true, [40, 13], 1e-3),
        (Cut::Diagonal, false, [56, 36], 1e-3),
        (Cut::Irregular(1), false, [56, 36], 1e-6),
    ] {
        let cylinder = pressed(cylinder(cut, whole, cells), whole, 1.0 / 5000.0, formulation, spread);
        let (found, step) = blown_up(cylinder.model, strain / 1e-6, strain);
        println!("{} iterations, {} parts, {:?}", step.residuals.len() - 1, step.parts, bounds(&found));
        assert_eq!(step.parts, 1);
        claim(&format!("R/t = 5000, {cut:?}, {cells:?} cells"), off(&found), 0.01);
    }
}

/// Radial displacements over Lamé's at a strain, after one load step with the pressure times `times`.
fn blown_up(mut model: Assembly, times: f64, strain: f64) -> (Vec<f64>, Step) {
    let LoadKind::ShellPressure { pressure, .. } = &mut model.model_mut().loads[0].kind else {
        panic!("no pressure")
    };
    *pressure *= times;
    let mut state = AssemblyState::at_rest(&model);
    let step =
        Statics::new(model.clone(), StaticSettings::default()).unwrap().solve(&mut state, 1.0).unwrap();
    let ratio = |(x, rest): (&Vector3, Vector3)| (x - rest).xy().dot(&rest.xy()) / strain;
    (state.position.iter().zip(model.places()).map(ratio).collect(), step)
}

/// The irregular cylinder strained by 1e-3 in one load step, R/t = 100.
#[test]
fn an_irregular_cylinder_is_blown_up_in_one_step() {
    let (formulation, spread) = DEFAULT;
    let cylinder = pressed(cylinder(Cut::Irregular(1), true, [40, 13]), true, 0.01, formulation, spread);
    let (found, step) = blown_up(cylinder.model, 1e3, 1e-3);
    println!("{} iterations, {:?}", step.residuals.len() - 1, bounds(&found));
    assert!(step.parts == 1 && step.residuals.len() <= 14, "{:?}", step.residuals);
    claim("irregular cylinder, strain 1e-3", off(&found), 0.03);
}

/// Pressure p cos 2θ bends the wall into an oval. The test compares displacements on a coarse mesh and on a
/// mesh twice as fine. No cure of scatter may remove bending.
#[test]
fn pressure_that_varies_bends_a_cylinder() {
    let oval = |[round, along]: [usize; 2], (formulation, spread): (Formulation, Spread)| {
        let mut cylinder =
            pressed(cylinder(Cut::Diagonal, false, [round, along]), false, 0.01, formulation, spread);
        cylinder.model.model_mut().loads.clear();
        for cell in 0..cylinder.model.facets.len() {
            let centre: Vector3 =
                cylinder.model.facets[cell].nodes.iter().map(|&n| cylinder.model.place(n as usize)).sum();
            let pressure = 1e-12 * (2.0 * centre.y.atan2(centre.x)).cos();
            cylinder = cylinder.load(LoadKind::ShellPressure { facets: vec![cell as u32], pressure, spread });
        }
        let node = cylinder.node(1.0, 0.0, 0.5);
        cylinder.linear(node).unwrap()[0]
    };
    // Without stretch, p R⁴/(9 E I), between a beam's I = t³/12 and a plate's.
    let ring = 1e-12 * 12.0 / (9.0 * 1e-6);
    let fine = oval([20, 14], DEFAULT);
    let coarse = oval([10, 7], DEFAULT);
    println!("oval: {:.4} of the ring, coarse {:.4}", fine / ring, coarse / ring);
    claim("oval, coarse over fine", (coarse / fine - 1.0).abs(), 0.03);
    claim(
        "oval, flat element over curved",
        (oval([20, 14], (FLAT, Spread::Lumped)) / fine - 1.0).abs(),
        0.03,
    );
    assert!(fine < 1.02 * ring && fine > 0.91 * 0.98 * ring, "{fine:e} {ring:e}");
}

/// p R² (1 − ν)/(2 E t) of a sphere under a small pressure: the error falls with each subdivision, R/t = 100
/// and 1000.
#[test]
fn spheres_under_pressure() {
    for thickness in [0.01, 0.001] {
        let worst = [2, 3, 4].map(|levels| {
            let ball = Specimen::new(
                sphere(1.0, levels, DEFAULT_CELL_LIMIT).unwrap(),
                [1.0, POISSON],
                thickness,
                DEFAULT.0,
            );
            let cells: Vec<u32> = (0..20 * 4_u32.pow(levels)).collect();
            let ball = ball.unwrap().prescribe(vec![0], [true; 6]);
            let ball = ball.load(LoadKind::ShellPressure {
                facets: cells,
                pressure: 1e-6 * thickness,
                spread: DEFAULT.1,
            });
            let mut solver = Statics::new(ball.model.clone(), StaticSettings::default()).unwrap();
            let moved = solver.linear(&AssemblyState::at_rest(&ball.model), 1.0).unwrap();
            let places =
                moved.iter().zip(ball.model.places()).map(|(u, x)| x + Vector3::new(u[0], u[1], u[2]));
            let places: Vec<Vector3> = places.collect();
            let centre = places.iter().sum::<Vector3>() / places.len() as f64;
            let exact = 0.5e-6 * (1.0 - POISSON);
            let worst = off(&places.iter().map(|x| ((x - centre).norm() - 1.0) / exact).collect::<Vec<_>>());
            println!(
                "sphere, t = {thickness}, {} triangles: off by {:.3} %",
                20 * 4_u32.pow(levels),
                100.0 * worst
            );
            worst
        });
        assert!(worst[2] < 0.5 * worst[1] && worst[1] < worst[0], "{worst:?}");
        claim(&format!("sphere, t = {thickness}, 5120 triangles"), worst[2], 0.01);
    }
}

/// Explicit steps, damped, come to rest where the static solution is.
#[test]
fn an_explicit_cylinder_comes_to_rest_in_equilibrium() {
    let (formulation, spread) = DEFAULT;
    let mut cylinder = pressed(cylinder(Cut::Diagonal, false, [5, 4]), false, 0.04, formulation, spread);
    let exact = ratios(&cylinder);
    let model = &mut cylinder.model;
    model.model_mut().loads[0].curve.shape = pliant_mechanics::curve::Shape::Hold;
    // A quarter of the breathing frequency √(E/ρ)/R.
    let damping = 0.5 * (1.0_f64 / 1000.0).sqrt();
    model.model_mut().bodies[0].damping = damping;
    let step = 0.9 * ExplicitShells::stable_step(model);
    let mut solver = ExplicitShells::new(model.clone(), step).unwrap();
    let mut state = AssemblyState::at_rest(model);
    let steps = (40.0 / damping / step) as usize;
    for _ in 0..steps {
        solver.advance(&mut state).unwrap();
    }
    let ratio = |(x, rest): (&Vector3, Vector3)| (x - rest).xy().dot(&rest.xy()) / 1e-6;
    let found: Vec<f64> = state.position.iter().zip(model.places()).map(ratio).collect();
    println!("{steps} explicit steps: {:?}, by linear theory {:?}", bounds(&found), bounds(&exact));
    let apart = found.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    claim("explicit against static", apart, 1e-3);
}
