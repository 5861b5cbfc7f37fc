//! Cloth over a sphere, and a strip that is twisted into itself.

use std::time::Instant;

use nalgebra::Vector3;
use pliant_contact::barrier::BarrierSettings;
use pliant_contact::shape::Shape;
use pliant_contact::touch::{Contact, Touch, With};
use pliant_implicit::AssemblySolver;
use pliant_implicit::{Assembly, AssemblyState, BackwardEuler, DynamicSettings, Shell};
use pliant_mechanics::curve::{Curve, Shape as CurveShape};
use pliant_mechanics::load::{Load, LoadKind};
use pliant_mechanics::model::{Constraint, Motion};
use pliant_shells::element::Elasticity;
use pliant_shells::element::Wall;

use super::{at_rigid, fixed, surface, touch};

/// A sheet in the plane z = 0 around the origin, with given numbers of cells and diagonals that alternate.
fn sheet(cells: [u32; 2], size: [f64; 2], thickness: f64, young: f64) -> (Assembly, Vec<[u32; 3]>) {
    let [nx, ny] = cells;
    let node = |i: u32, j: u32| j * (nx + 1) + i;
    let points = (0..(nx + 1) * (ny + 1)).map(|k| {
        let [i, j] = [k % (nx + 1), k / (nx + 1)];
        Vector3::new(
            size[0] * (f64::from(i) / f64::from(nx) - 0.5),
            size[1] * (f64::from(j) / f64::from(ny) - 0.5),
            0.0,
        )
    });
    let cell = |i: u32, j: u32| {
        let [a, b, c, d] = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
        if (i + j).is_multiple_of(2) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
    };
    let faces: Vec<[u32; 3]> = (0..ny).flat_map(|j| (0..nx).flat_map(move |i| cell(i, j))).collect();
    let material = Wall { elastic: Elasticity { young, poisson: 0.3 }, density: 300.0 };
    let mut model = Assembly::new("cloth", points);
    model.add_shell(&Shell::new("cloth", faces.clone(), thickness, material)).unwrap();
    (model, faces)
}

/// Cloth of 0.3 m above a sphere of 80 mm, which touches it and itself.
fn cloth(cells: u32, friction: f64) -> Assembly {
    let (thickness, young) = (1e-3, 1e6);
    let (mut model, faces) = sheet([cells; 2], [0.3; 2], thickness, young);
    let curve = Curve { shape: CurveShape::Hold, from: 0.0, to: 1.0 };
    let kind = LoadKind::Gravity { body: 0, acceleration: [0.0, 0.0, -9.81] };
    model.model_mut().loads.push(Load::new("weight", kind, curve));
    let cloth_surface = surface(faces);
    let radius = 0.08;
    let ball = fixed("ball", Shape::Sphere { radius }, [0.003, 0.002, -radius - 2e-3], [0.0; 3]);
    let mut contacts = at_rigid(&cloth_surface, vec![ball], friction, 0.5 * thickness);
    let own_touch = Touch { friction, offset: thickness };
    contacts.contacts.push(Contact {
        name: "itself".into(),
        surface: cloth_surface,
        with: With::Itself,
        touch: own_touch,
    });
    touch(
        &mut model,
        contacts,
        BarrierSettings { distance: 5e-4, stiffness: 0.1 * young, creep_speed: 1e-3 },
    );
    model
}

fn solver(model: &Assembly) -> BackwardEuler {
    let settings = DynamicSettings { iterations: 200, tolerance: 1e-4, ..DynamicSettings::new(0.01) };
    BackwardEuler::new(model.clone(), settings).unwrap()
}

/// Results have the same bits with one thread and with two, and after another solver continues with the
/// pattern of the first one.
#[test]
fn threads_and_a_restart_change_no_bit() {
    let model = cloth(8, 0.5);
    let run = |threads: usize, stop: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let (mut first, mut state) = (solver(&model), AssemblyState::at_rest(&model));
            for step in 0..30 {
                if step == stop {
                    let pairs = first.contact().unwrap().pairs().to_vec();
                    first = solver(&model);
                    first.take_contact_pairs(pairs).unwrap();
                }
                first.advance(&mut state).unwrap();
            }
            assert!(first.contact().unwrap().now().gap.is_some());
            state
        })
    };
    let one = run(1, usize::MAX);
    assert!(one == run(2, usize::MAX));
    assert!(one == run(2, 20));
}

/// Cloth that falls for a time [s]; mean distance [m] of its border from the axis at the end.
fn draped(cells: u32, friction: f64, until: f64) -> f64 {
    let model = cloth(cells, friction);
    let mut solver = solver(&model);
    let mut state = AssemblyState::at_rest(&model);
    let (start, mut iterations, mut slowest, mut halved, mut least) =
        (Instant::now(), 0, 0.0_f64, 0, f64::INFINITY);
    let (mut steps, mut rows) = (0, 0);
    while state.time < until - 1e-9 {
        let begun = Instant::now();
        let done = solver.advance(&mut state).unwrap_or_else(|error| panic!("{error}"));
        slowest = slowest.max(begun.elapsed().as_secs_f64());
        iterations += done.residuals.len();
        halved += usize::from(done.parts > 1);
        steps += 1;
        rows += solver.contact().unwrap().step().normal_collisions().len();
        least = least.min(solver.contact().unwrap().now().gap.unwrap_or(f64::INFINITY));
    }
    let border: Vec<usize> = (0..model.rest.len()).filter(|&n| model.place(n).amax() > 0.1499).collect();
    let radius = border.iter().map(|&n| state.position[n].xy().norm()).sum::<f64>() / border.len() as f64;
    let fastest = state.velocity.iter().map(|v| v.norm()).fold(0.0, f64::max);
    println!(
        "{cells} cells, mu {friction}: {steps} steps in {:.1} s, {:.1} ms a step (longest {:.0}), {:.1} iterations, {halved} halved, {:.0} pairs act, least gap {:.1} um, border at {:.1} mm, fastest {fastest:.3} m/s, phases {:?}",
        start.elapsed().as_secs_f64(),
        1e3 * start.elapsed().as_secs_f64() / f64::from(steps),
        1e3 * slowest,
        iterations as f64 / f64::from(steps),
        rows as f64 / f64::from(steps),
        1e6 * least,
        1e3 * radius,
        solver.phases(),
    );
    radius
}

/// S6: cloth falls over a sphere, with and without friction; nothing goes through anything in any state.
#[test]
fn cloth_drapes_over_a_sphere() {
    for friction in [0.0, 0.5] {
        let radius = draped(14, friction, 0.4);
        assert!(radius < 0.15, "{radius}");
    }
}

/// S6: the border of draped cloth lies as far from the axis on a finer mesh, within 5 %.
#[test]
#[ignore = "a minute"]
fn the_drape_depends_little_on_the_mesh() {
    let [coarse, fine] = [20, 30].map(|cells| draped(cells, 0.5, 1.5));
    assert!((fine / coarse - 1.0).abs() < 0.05, "{coarse} m, {fine} m");
}

/// The iterations and the time of a step of `scenes/cloth-on-sphere`.
#[test]
#[ignore = "prints times: a quarter of a minute"]
fn cloth_of_20_cells() {
    draped(20, 0.5, 0.5);
}

/// The time of a step of 5,000, 10,000 and 20,000 triangles that touch a ball and each other.
#[test]
#[ignore = "prints times: minutes"]
fn cloth_of_20_000_triangles() {
    for cells in [50, 71, 100] {
        draped(cells, 0.5, 0.15);
    }
}

/// S7: a strip whose ends are turned against each other by two turns.
#[test]
fn a_twisted_strip_does_not_go_through_itself() {
    let (thickness, young) = (5e-4, 1e5);
    let (nx, ny) = (40, 6);
    let (mut model, faces) = sheet([nx, ny], [0.2, 0.03], thickness, young);
    let ends = |i: u32| (0..=ny).map(|j| j * (nx + 1) + i).collect::<Vec<u32>>();
    let curve = Curve { shape: CurveShape::Ramp, from: 0.0, to: 1.0 };
    let components = [true, true, true, false, false, false];
    let turns = 2.0 * std::f64::consts::PI;
    for (name, nodes, sign) in [("left", ends(0), 1.0), ("right", ends(nx), -1.0)] {
        let rest: Vec<[f64; 3]> = nodes.iter().map(|&n| model.rest[n as usize]).collect();
        let motion =
            Motion::rotation([1.0, 0.0, 0.0], [0.0; 3], sign * turns, curve.clone(), rest.into_iter());
        let constraint = Constraint { name: name.into(), nodes, components, motion };
        model.model_mut().constraints.push(constraint);
    }
    let strip = surface(faces);
    let own_touch = Touch { friction: 0.2, offset: thickness };
    let contact = Contact { name: "itself".into(), surface: strip, with: With::Itself, touch: own_touch };
    let contacts =
        pliant_contact::touch::Contacts { rigids: Vec::new(), contacts: vec![contact], ..Default::default() };
    touch(
        &mut model,
        contacts,
        BarrierSettings { distance: 3e-4, stiffness: 0.1 * young, creep_speed: 1e-3 },
    );
    let mut solver = solver(&model);
    let mut state = AssemblyState::at_rest(&model);
    let (start, mut touched, mut halved) = (Instant::now(), 0, 0);
    for _ in 0..100 {
        let done = solver.advance(&mut state).unwrap_or_else(|error| panic!("{error}"));
        touched += u32::from(solver.contact().is_some_and(|t| t.now().gap.is_some()));
        halved += u32::from(done.parts > 1);
    }
    println!(
        "strip: {:.1} ms a step, {touched} steps in contact, {halved} halved",
        10.0 * start.elapsed().as_secs_f64()
    );
    assert!(touched > 10 && halved == 0, "{touched} {halved}");
}
