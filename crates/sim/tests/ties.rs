//! Ties between participants with different steps.

use nalgebra::Vector3;
use pliant_implicit::Shell;
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
use pliant_mechanics::load::{Load, LoadKind};
use pliant_mechanics::mapping::Weights;
use pliant_mechanics::model::{Cells, Material, Model, Solid};
use pliant_shells::element::Elasticity;
use pliant_shells::element::Wall;
use pliant_sim::{ParticipantSetup, PenaltyTie, Setup, Simulation, SimulationState, Steps};

/// Edge of a cell [m].
const EDGE: f64 = 0.02;
/// Cells of a column.
const CELLS: u32 = 4;
/// Shear modulus of the softer column [Pa].
const SOFT: f64 = 2e3;
/// Force on the end of a column [N]: a strain of some percent.
const FORCE: f64 = 0.08;

/// A column of hexahedra from a height [in columns] up, without volumetric coupling, so that it stretches
/// along itself alone.
fn column(name: &str, from: u32, shear: f64, damping: f64) -> Model {
    let corner = [[0, 0], [1, 0], [1, 1], [0, 1]];
    let layer = |k: u32| corner.map(|[x, y]| [x, y, from * CELLS + k].map(|x| EDGE * f64::from(x)));
    let points: Vec<[f64; 3]> = (0..=CELLS).flat_map(layer).collect();
    let mut model = Model::default();
    let body = model.add_body(name, &points);
    let law = AnyLaw::NeoHookean(NeoHookean { shear, volumetric: Volumetric::quadratic(2.0 * shear / 3.0) });
    let cells = (0..CELLS).map(|k| std::array::from_fn(|i| 4 * k + i as u32)).collect();
    model.add_solid(Solid::new(body, Material::elastic(law, 1000.0), Cells::full_hex8(cells, &points)));
    model.bodies[body].damping = damping;
    model
}

/// Nodes of an end of a column.
fn end(top: bool) -> [u32; 4] {
    std::array::from_fn(|i| if top { 4 * CELLS } else { 0 } + i as u32)
}

fn points(nodes: [u32; 4]) -> Weights {
    Weights::from_rows(nodes.map(|node| [(node, 1.0)]).iter().map(|row| &row[..]))
}

/// Two columns glued end to end, at steps `finer` times finer than the automatic ones.
fn glued(lower: Model, upper: Model, duration: f64, finer: u64) -> Setup {
    let part = |name, model| {
        let part = ParticipantSetup::explicit(name, model, duration).unwrap();
        let number = finer * part.steps.number;
        ParticipantSetup { steps: Steps::within(duration, duration / number as f64), ..part }
    };
    let ties = vec![PenaltyTie {
        name: "glue".into(),
        parts: [0, 1],
        points: [points(end(true)), points(end(false))],
    }];
    Setup { ties, ..Setup::new(vec![part("lower", lower), part("upper", upper)]) }
}

/// Momentum [kg m/s] along the columns, with the momentum that the slower one is still to feel.
fn momentum(simulation: &mut Simulation) -> f64 {
    let frame = simulation.frame().unwrap();
    let of = |(part, now): (&ParticipantSetup, &dyn pliant_sim::Instant)| -> f64 {
        (0..part.model.node_count()).map(|node| part.model.mass[node] * now.velocity(node)[2]).sum()
    };
    let bodies: f64 = frame.parts().map(of).sum();
    // Velocities are means of the steps before and after an instant, so half of the impulses of this instant
    // are in them.
    let steps: Vec<f64> = simulation.setup().parts.iter().map(|part| part.steps.step).collect();
    let tie = simulation.ties().next().unwrap();
    bodies + 0.5 * (0..2).map(|part| steps[part] * tie.forces[part][2]).sum::<f64>()
}

/// Forces on both sides are opposite at each instant and act for the same time: momentum stays to round-off.
/// The energy does not grow, whatever the ratio of the steps, though impulses of the slower body excite
/// vibrations of the faster one.
#[test]
fn free_bodies_keep_their_momentum_at_steps_of_their_own() {
    for (stiffer, finer) in
        [(1.0, 1), (1.0, 2), (2.0, 1), (4.0, 2), (10.0, 2), (30.0, 2), (200.0, 1), (200.0, 2)]
    {
        let mut lower = column("lower", 0, SOFT, 0.0);
        lower.initial_velocity = vec![[0.0, 0.0, 0.1]; lower.node_count()];
        let upper = column("upper", 1, stiffer * SOFT, 0.0);
        let mut simulation = Simulation::new(glued(lower, upper, 8.0, finer)).unwrap();
        let steps: Vec<u64> = simulation.setup().parts.iter().map(|part| part.steps.number).collect();
        let first = momentum(&mut simulation);
        let energy = |simulation: &mut Simulation| {
            let energies = simulation.frame().unwrap().energies();
            energies.kinetic + energies.internal
        };
        let most = energy(&mut simulation);
        let (mut off, mut highest) = (0.0_f64, 0.0_f64);
        while simulation.steps() < steps[0] {
            simulation.step(1).unwrap();
            off = off.max((momentum(&mut simulation) / first - 1.0).abs());
            highest = highest.max(energy(&mut simulation) / most);
        }
        let tie = simulation.ties().next().unwrap();
        println!(
            "{stiffer} times stiffer, steps {steps:?}: momentum {off:.1e}, energy at most {highest} of that at the start, gap {}",
            tie.widest
        );
        assert!(off < 1e-11, "momentum is off by {off:.1e}");
        let last = energy(&mut simulation) / most;
        assert!(highest < 1.0001 && last < 1.0, "at most {highest}, {last} in the end");
    }
}

/// F L/(E A) of both columns, and the gap that the tie reports.
#[test]
fn a_load_passes_through_and_the_gap_is_reported() {
    let (shear, duration) = (SOFT, 2.0);
    let mut lower = column("lower", 0, shear, 40.0);
    lower.fix("base", end(false).to_vec());
    let mut upper = column("upper", 1, 50.0 * shear, 40.0);
    let curve = Curve { shape: Shape::SmoothStep, from: 0.0, to: 0.5 * duration };
    upper.loads.push(Load::new("pull", LoadKind::force(end(true), [0.0, 0.0, 0.25 * FORCE]), curve));
    let mut simulation = Simulation::new(glued(lower, upper, duration, 2)).unwrap();
    simulation.run(duration, |_| ()).unwrap();
    let frame = simulation.frame().unwrap();
    let base = frame.reaction("base").unwrap()[2];
    let [below, above] = ["lower", "upper"].map(|body| frame.displacements(body).unwrap());
    let [below, above] = [below[4 * CELLS as usize][2], above[0][2]];
    let tie = simulation.ties().next().unwrap();
    println!("base {base} N, tie {:?} N, gap {} m of {below} m", tie.forces, tie.gap);
    assert!((base / -FORCE - 1.0).abs() < 1e-3, "{base} N");
    assert!((tie.forces[0][2] / FORCE - 1.0).abs() < 1e-3, "{:?} N", tie.forces);
    assert!((tie.forces[1][2] / -FORCE - 1.0).abs() < 1e-3, "{:?} N", tie.forces);
    assert!((tie.gap - (above - below)).abs() < 1e-3 * tie.gap && tie.widest >= tie.gap);
    assert!(tie.gap > 0.0 && tie.gap < 0.25 * below, "{} m of {below} m", tie.gap);
}

/// A plate of an implicit participant hangs on an explicit column; a restart continues with the same bits.
#[test]
fn an_implicit_body_hangs_on_an_explicit_one() {
    let duration = 2.0;
    let mut upper = column("upper", 1, SOFT, 40.0);
    upper.fix("base", end(true).to_vec());
    let corners = end(false).map(|node| Vector3::from(upper.rest[node as usize]));
    let mut plate = pliant_implicit::Assembly::new("plate", corners);
    let material = Wall { elastic: Elasticity { young: 1e6, poisson: 0.3 }, density: 1000.0 };
    plate.add_shell(&Shell::new("plate", vec![[0, 1, 2], [0, 2, 3]], 0.002, material)).unwrap();
    plate.model_mut().loads.push(Load::gravity(0, [0.0, 0.0, -9.81]));
    let weight = 1000.0 * 0.002 * EDGE * EDGE * 9.81;
    let parts = vec![
        ParticipantSetup::implicit("plate", plate, duration, 0.001),
        ParticipantSetup::explicit("upper", upper, duration).unwrap(),
    ];
    let tie =
        PenaltyTie { name: "glue".into(), parts: [0, 1], points: [points([0, 1, 2, 3]), points(end(false))] };
    let setup = Setup { ties: vec![tie], ..Setup::new(parts) };
    let mut simulation = Simulation::new(setup.clone()).unwrap();
    simulation.run(0.5 * duration, |_| ()).unwrap();
    simulation.step(1).unwrap();
    let bytes = simulation.encode().unwrap();
    assert_eq!(bytes.len(), 3);
    assert!(
        SimulationState::decode(&setup, &bytes[..2]).is_some()
            && SimulationState::decode(&setup, &bytes[..1]).is_none()
    );
    let mut again =
        Simulation::resumed(setup.clone(), SimulationState::decode(&setup, &bytes).unwrap()).unwrap();
    let ended = |simulation: &mut Simulation| {
        simulation.run(duration, |_| ()).unwrap();
        (simulation.fingerprint(), simulation.frame().unwrap().reaction("base").unwrap()[2])
    };
    let (bits, base) = ended(&mut simulation);
    assert_eq!(ended(&mut again).0, bits);
    let tie = simulation.ties().next().unwrap();
    println!("base {base} N, weight {weight} N, tie {:?} N, gap {} m", tie.forces, tie.gap);
    assert!((base / weight - 1.0).abs() < 1e-3, "{base} N of {weight} N");
    assert!((tie.forces[0][2] / weight - 1.0).abs() < 1e-3, "{:?} N", tie.forces);
}

#[test]
fn solvers_without_common_steps_are_refused() {
    let tie = |parts: Vec<ParticipantSetup>| {
        let tie = PenaltyTie {
            name: "glue".into(),
            parts: [0, 1],
            points: [points(end(true)), points(end(false))],
        };
        let setup = Setup { ties: vec![tie], ..Setup::new(parts) };
        Simulation::new(setup).err().unwrap().message
    };
    let explicit = ParticipantSetup::explicit("a", column("a", 0, SOFT, 0.0), 0.1).unwrap();
    let still = ParticipantSetup::quasi_static("b", column("b", 1, SOFT, 0.0), 0.1, 4);
    let message = tie(vec![explicit.clone(), still]);
    assert!(message.contains("tie `glue`: participant `b` finds equilibria"), "{message}");
    let message = tie(vec![explicit]);
    assert!(message.contains("the same number of points in both participants"), "{message}");
}
