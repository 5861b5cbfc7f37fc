//! The largest stable step of deformed states, and runs whose steps are cut when it falls below them.

use pliant_mechanics::critical_step::true_limit_at;
use pliant_mechanics::element::HEX_CORNERS;
use pliant_mechanics::law::AnyLaw;
use pliant_mechanics::model::{Body, Cells, Solid};
use pliant_mechanics::stability::{Monitor, OnUnstable};
use pliant_mechanics::tensor::Tensor;
use pliant_mechanics::{CentralDifference, Model, Observable, State, StepError};
use pliant_meshing::{Block, DEFAULT_CELL_LIMIT, Resolution, VolumeCell};
use pliant_validation::{
    HOURGLASS, Hexes, Random, Specimen, Tets, claim, elastic, largest, law, liver, run, run_watched,
    smooth_step, soft_tissue,
};
use serde_json::json;

/// Displacements of a homogeneous deformation.
fn homogeneous(model: &Model, h: &Tensor<f64>) -> Vec<[f64; 3]> {
    model.rest.iter().map(|&x| h.apply(x)).collect()
}

/// Deformations with J between 0.5 and 1.6.
fn random_deformations(count: usize) -> Vec<Tensor<f64>> {
    let mut random = Random::new(7);
    let mut found = Vec::new();
    while found.len() < count {
        let h = Tensor([0, 1, 2].map(|_| [0, 1, 2].map(|_| 0.6 * random.number())));
        let j = 1.0 + h.trace() + h.second_invariant() + h.determinant();
        if (0.5..1.6).contains(&j) {
            found.push(h);
        }
    }
    found
}

fn laws() -> Vec<(&'static str, AnyLaw)> {
    let moduli = json!({ "young-modulus": 3000.0, "poisson-ratio": 0.45 });
    vec![
        ("neo-hookean", soft_tissue()),
        ("coupled-neo-hookean", law("coupled-neo-hookean", moduli)),
        ("transversely-isotropic", liver()),
    ]
}

/// One free cell of a skew shape.
fn single(cells: VolumeCell, law: AnyLaw) -> Model {
    let skew = |x: [f64; 3]| [0.1 * x[0] + 0.03 * x[1], 0.07 * x[1] - 0.02 * x[2], 0.05 * x[2] + 0.01 * x[0]];
    let material = elastic(law);
    let mut model = Model::default();
    let block = match cells {
        VolumeCell::Tet => {
            model.rest = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(skew).to_vec();
            Cells::tet4(vec![[0, 1, 2, 3]], &model.rest)
        }
        VolumeCell::Hex => {
            model.rest = HEX_CORNERS.map(skew).to_vec();
            let nodes = vec![[0, 1, 2, 3, 4, 5, 6, 7]];
            Cells::hex8(nodes, &model.rest, HOURGLASS, law.small_strain().shear)
        }
    };
    let nodes = model.rest.len();
    model.mass = vec![0.0; nodes];
    model.bodies.push(Body { name: "cell".into(), nodes: 0..nodes as u32, damping: 0.0 });
    let fibre = if law.needs_fibre() { vec![[0.6, 0.0, 0.8]] } else { vec![] };
    model.add_solid(Solid { body: 0, material, cells: block, fibre, original: vec![0] });
    model
}

#[test]
fn a_cells_own_limit_is_exact_on_147_random_states() {
    for cells in [VolumeCell::Tet, VolumeCell::Hex] {
        for (name, law) in laws() {
            let model = single(cells, law);
            let rest = true_limit_at(&model, &homogeneous(&model, &Tensor::ZERO)).unwrap().step;
            let monitor = Monitor::new(&model, rest, OnUnstable::Report);
            let mut worst = [f64::INFINITY, 0.0_f64];
            for h in random_deformations(147) {
                let u = homogeneous(&model, &h);
                let now = true_limit_at(&model, &u).unwrap().step;
                let ratio = now / monitor.limit_of_all(&model, &u).unwrap().0;
                worst = [worst[0].min(ratio), worst[1].max(ratio)];
            }
            println!("{cells:?}, {name}: true limit over estimate {:.6} to {:.6}", worst[0], worst[1]);
        }
    }
}

fn hanging(law: AnyLaw, cells: VolumeCell) -> Specimen {
    Specimen::block([0.1, 0.05, 0.05], [8, 4, 4], cells, &elastic(law), [0.0, 1.0, 0.0])
        .fix("x-min", [true; 3])
        .falling([9.81, 0.0, 0.0])
}

#[test]
fn measure_soft() {
    for cells in [VolumeCell::Tet, VolumeCell::Hex] {
        let block = hanging(soft_tissue(), cells);
        let limit = block.true_limit();
        let tip = block.node_at([0.1, 0.025, 0.025]);
        let alone = run::<f64>(&block.model, 0.9 * limit, 0.4, |_, _| ());
        println!("{cells:?} alone: {:?}", alone.err());
        let course = |step: f64| {
            let mut tips = Vec::new();
            let mut worst = 0.0;
            let (_, state) =
                run_watched::<f64>(&block.model, step, OnUnstable::Substep, 0.4, |stepper, state| {
                    if state.steps > 20 {
                        worst = largest([worst, stepper.energies().balance]);
                    }
                    tips.push((state.time, state.displacement[tip]));
                })
                .unwrap();
            println!("step {step:.3e}: worst balance {worst:.2e}, {:?}", state.stability);
            (tips, state)
        };
        let (a, _) = course(0.9 * limit);
        let (b, _) = course(0.1 * limit);
        let mut worst = 0.0f64;
        let mut size = 0.0f64;
        for (t, u) in &a {
            let at = b.partition_point(|(s, _)| s < t).clamp(1, b.len() - 1);
            let (t0, u0) = b[at - 1];
            let (t1, u1) = b[at];
            let w = (t - t0) / (t1 - t0);
            let d: f64 = (0..3).map(|c| (u[c] - (u0[c] * (1.0 - w) + u1[c] * w)).powi(2)).sum::<f64>().sqrt();
            worst = worst.max(d);
            size = size.max(u[0].abs());
        }
        println!("worst tip difference {worst:.3e} of {size:.3e}");
    }
}

#[test]
fn measure_cube() {
    let size = 10;
    let law = soft_tissue();
    let cube = Specimen::block([0.05; 3], [size; 3], VolumeCell::Hex, &elastic(law), [0.0; 3])
        .fix("x-max", [true, false, false])
        .fix("y-min", [false, true, false])
        .fix("z-min", [false, false, true]);
    let mut cube = cube.damped(60.0);
    let nodes = cube.face("x-min");
    let curve = pliant_mechanics::curve::Curve {
        shape: pliant_mechanics::curve::Shape::Polynomial,
        from: 0.0,
        to: 1.0,
    };
    cube.model.constraints.push(pliant_mechanics::model::Constraint {
        name: "press".into(),
        nodes,
        components: [true; 3],
        motion: pliant_mechanics::model::Motion::Displacement([0.01, 0.0, 0.0], curve),
    });
    let rest = cube.true_limit();
    let mut monitor = Monitor::new(&cube.model, rest, OnUnstable::Report);
    let mut next = 0.0;
    println!("rest {rest:.4e} bound {:.4e}", cube.element_bound());
    let done = run::<f64>(&cube.model, 0.5 * cube.element_bound(), 1.0, |_, state| {
        if state.time >= next {
            next += 0.05;
            let picked = monitor.limit(&cube.model, &state.displacement).unwrap();
            let all = monitor.limit_of_all(&cube.model, &state.displacement).unwrap();
            let truth = true_limit_at(&cube.model, &state.displacement).unwrap().step;
            println!(
                "t {:.3}: picked {:.4} all {:.4} truth {:.4}",
                state.time,
                picked.0 / rest,
                all.0 / rest,
                truth / rest
            );
        }
    });
    println!("{:?}", done.err());
    for part in [0.9, 0.8, 0.7] {
        let done = run_watched::<f64>(&cube.model, part * rest, OnUnstable::Report, 1.0, |_, _| ());
        match done {
            Ok((_, s)) => println!("{part} ok {:?}", s.stability),
            Err(e) => println!("{part} {e}"),
        }
    }
}

#[test]
fn measure_liver() {
    let (source, folder) = pliant_scene::open(std::path::Path::new("../scenes/liver")).unwrap();
    let scene = pliant_scene::Scene::from_source(source, folder).unwrap();
    let built = pliant_scene::build(&scene).unwrap();
    let model = &built.model;
    let rest = pliant_mechanics::critical_step::true_limit(model).unwrap().step;
    let mut monitor = Monitor::new(model, rest, OnUnstable::Report);
    let mut next = 0.0;
    let _ = run::<f32>(model, 0.4 * rest, 2.0, |_, state| {
        if state.time >= next {
            next += 0.2;
            let u: Vec<[f64; 3]> = state.displacement.iter().map(|&u| u.map(f64::from)).collect();
            let picked = monitor.limit(model, &u).unwrap();
            let all = monitor.limit_of_all(model, &u).unwrap();
            let truth = true_limit_at(model, &u).unwrap();
            println!(
                "t {:.3}: picked {:.4} all {:.4} truth {:.4} ({} calls)",
                state.time,
                picked.0 / rest,
                all.0 / rest,
                truth.step / rest,
                truth.force_calls
            );
        }
    });
    let u = vec![[0.0f64; 3]; model.node_count()];
    let n = 200;
    let t = std::time::Instant::now();
    for _ in 0..n {
        std::hint::black_box(monitor.limit(model, &u));
    }
    println!("look {:.1} ns a cell", t.elapsed().as_secs_f64() / n as f64 / model.cell_count() as f64 * 1e9);
    let t = std::time::Instant::now();
    for _ in 0..20 {
        std::hint::black_box(monitor.limit_of_all(model, &u));
    }
    println!("all {:.1} ns a cell", t.elapsed().as_secs_f64() / 20.0 / model.cell_count() as f64 * 1e9);
}
