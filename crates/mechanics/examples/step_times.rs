//! Times whole steps (forces, gather, integration) of a cube of 21³ × 6 tets or 30³ hexes, per element.
//!
//! `cargo run --release -p pliant-mechanics --example step_times -- [threads] [part of a name]`; medians of five rounds of 60 steps.

use std::time::Instant;

use pliant_mechanics::law::{AnyLaw, NeoHookean, TransverselyIsotropic, Volumetric};
use pliant_mechanics::model::{Averaging, Body, Cells, Material, Model, Solid};
use pliant_mechanics::prony::{Part, Prony, PronyTerm, PronyUpdate};
use pliant_mechanics::{CentralDifference, Real, State, critical_step};

const ROUNDS: usize = 5;
const STEPS: u32 = 60;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let threads = std::env::args().nth(1).map_or(Ok(1), |n| n.parse())?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    println!("{threads} thread(s); ns per element and step, median of {ROUNDS}");
    println!("{:24} {:>8} {:>8} {:>8}", "", "cells", "f32", "f64");
    for case in ["tet4 NH", "tet4 TI + Prony", "tet4-anp NH", "hex8 NH", "hex8-full NH", "tet4 HGO"] {
        if std::env::args().nth(2).is_some_and(|part| !case.contains(&part)) {
            continue;
        }
        let model = cube(case);
        let cells = model.solids[0].cells.len();
        println!(
            "{case:24} {cells:>8} {:>8.1} {:>8.1}",
            pool.install(|| time::<f32>(&model)),
            pool.install(|| time::<f64>(&model))
        );
    }
    Ok(())
}

/// Nanoseconds per element and step.
fn time<R: Real>(model: &Model) -> f64 {
    let step = 0.5 * critical_step::element_bound(model).expect("there are cells").step;
    let mut state = State::<R>::at_rest(model);
    for (u, x) in state.displacement.iter_mut().zip(&model.rest) {
        *u = [0.1, 0.02, -0.03].map(|stretch| R::of(stretch * x[2]));
    }
    let mut stepper = CentralDifference::new(model, step).expect("there are no constraints");
    let mut rounds = [0.0; ROUNDS];
    for round in &mut rounds {
        let start = Instant::now();
        for _ in 0..STEPS {
            stepper.evaluate(&mut state).expect("the cube holds");
            stepper.advance(&mut state);
        }
        *round = start.elapsed().as_secs_f64() * 1e9;
    }
    rounds.sort_by(f64::total_cmp);
    rounds[ROUNDS / 2] / f64::from(STEPS) / model.solids[0].cells.len() as f64
}

fn cube(case: &str) -> Model {
    let n: u32 = if case.starts_with("hex8") { 30 } else { 21 };
    let places = 0..(n + 1).pow(3);
    let place = |i: u32| [i % (n + 1), i / (n + 1) % (n + 1), i / (n + 1) / (n + 1)];
    let rest: Vec<_> = places.map(|i| place(i).map(|k| 0.1 * f64::from(k) / f64::from(n))).collect();
    let hexes: Vec<[u32; 8]> = (0..n.pow(3))
        .map(|cell| {
            let [x, y, z] = [cell % n, cell / n % n, cell / n / n];
            let at = |dx: u32, dy: u32, dz: u32| ((z + dz) * (n + 1) + y + dy) * (n + 1) + x + dx;
            let layer = |dz| [at(0, 0, dz), at(1, 0, dz), at(1, 1, dz), at(0, 1, dz)];
            let ([a, b, c, d], [e, f, g, h]) = (layer(0), layer(1));
            [a, b, c, d, e, f, g, h]
        })
        .collect();
    // Kuhn's split: six tets around the diagonal 0–6.
    const KUHN: [[usize; 4]; 6] =
        [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]];
    let tets = || hexes.iter().flat_map(|hex| KUHN.map(|tet| tet.map(|corner| hex[corner]))).collect();
    let (shear, volumetric) = (1000.0, Volumetric::quadratic(10_000.0));
    let cells = match case.split_once(' ').map(|(element, _)| element) {
        Some("tet4-anp") => Cells::averaged_tet4(tets(), &rest, Averaging::Nodal),
        Some("hex8") => Cells::hex8(hexes, &rest, 0.1, shear),
        Some("hex8-full") => Cells::full_hex8(hexes, &rest),
        _ => Cells::tet4(tets(), &rest),
    };
    let mut prony = Prony::default();
    let law = if case.ends_with("TI + Prony") {
        let term = PronyTerm { part: Part::Isochoric, weight: 0.5, time: 0.58 };
        prony = Prony::new(&[term], PronyUpdate::Exact).unwrap_or_default();
        AnyLaw::TransverselyIsotropic(TransverselyIsotropic { shear, fibre: 2000.0, volumetric })
    } else if case.ends_with("HGO") {
        let parameters = serde_json::json!({
            "shear-modulus": shear, "bulk-modulus": 1e4, "fibre-modulus": 2000.0, "fibre-exponent": 1.0
        });
        AnyLaw::from_json("holzapfel-gasser-ogden", parameters).unwrap_or_else(|error| panic!("{error}"))
    } else {
        AnyLaw::NeoHookean(NeoHookean { shear, volumetric })
    };
    let count = cells.len();
    let nodes = rest.len() as u32;
    let mut model = Model { mass: vec![0.0; rest.len()], rest, ..Model::default() };
    model.bodies.push(Body { name: "cube".into(), nodes: 0..nodes, damping: 1.0 });
    let fibre = vec![[0.6, 0.0, 0.8]; count * law.families()];
    let material = Material { law, prony, density: 1000.0 };
    model.add_solid(Solid { body: 0, material, cells, fibre, original: (0..count as u32).collect() });
    model
}
