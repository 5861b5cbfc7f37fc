//! The one driver: steps, snapshots, restarts and changes of numbers with every solver, without a scene file.

use nalgebra::Vector3;
use pliant_explicit::Wanted;
use pliant_implicit::Shell;
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::grip::Grip;
use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
use pliant_mechanics::load::{Load, LoadKind, Spread};
use pliant_mechanics::model::{Cells, Material, Motion, Solid};
use pliant_mechanics::prony::{self, Prony, PronyTerm, PronyUpdate};
use pliant_mechanics::{Energies, Model};
use pliant_shells::element::Elasticity;
use pliant_shells::element::Wall;
use pliant_sim::{Method, ParticipantSetup, Precision, Setup, ShortSteps, Simulation, SimulationState};

/// Duration of a run [s].
const DURATION: f64 = 0.1;

/// A cube of one hexahedron whose top moves up by 1 mm.
fn cube(shear: f64) -> Model {
    let corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
    let points = corners.map(|corner| corner.map(|x| 0.1 * f64::from(x)));
    let mut model = Model::default();
    let body = model.add_body("cube", &points);
    let law = AnyLaw::NeoHookean(NeoHookean { shear, volumetric: Volumetric::quadratic(5.0 * shear) });
    let cells = Cells::full_hex8(vec![[0, 1, 2, 3, 4, 5, 6, 7]], &model.rest);
    model.add_solid(Solid::new(body, Material::elastic(law, 1000.0), cells));
    model.fix("base", vec![0, 1, 2, 3]);
    model.constrain("top", vec![4, 5], Motion::Displacement([0.0, 0.0, 0.001], rising()));
    model
}

fn rising() -> Curve {
    Curve { shape: Shape::Ramp, from: 0.0, to: DURATION }
}

/// A square of two triangles, clamped at one edge, pressed at the other.
fn strip() -> pliant_implicit::Assembly {
    let corner = |i: u32| Vector3::new(f64::from(i / 2) * 0.1, f64::from(i % 2) * 0.1, 0.0);
    let mut model = pliant_implicit::Assembly::new("strip", (0..4).map(corner));
    let material = Wall { elastic: Elasticity { young: 1e6, poisson: 0.3 }, density: 1000.0 };
    model.add_shell(&Shell::new("strip", vec![[0, 2, 3], [0, 3, 1]], 0.002, material)).unwrap();
    model.model_mut().fix("clamp", vec![0, 1]);
    let kind = LoadKind::force([2, 3], [0.0, 0.0, 1e-3]);
    model.model_mut().loads.push(Load::new("press", kind, rising()));
    model
}

/// A part of every method, with a cube of a shear modulus [Pa] where it holds solids.
fn parts(shear: f64) -> Vec<ParticipantSetup> {
    let explicit = ParticipantSetup::explicit("cube", cube(shear), DURATION).unwrap();
    let mut single = explicit.clone();
    let Method::Explicit(settings) = &mut single.method else { unreachable!("an explicit part") };
    settings.precision = Precision::Single;
    let quasi_static = ParticipantSetup::quasi_static("cube", cube(shear), DURATION, 4);
    let equilibria = ParticipantSetup::equilibria("strip", strip(), DURATION, 4);
    let implicit = ParticipantSetup::implicit("strip", strip(), DURATION, 0.01);
    let Method::Implicit(bodies, _) = &implicit.method else { unreachable!("an implicit part") };
    let shells = ParticipantSetup {
        method: Method::ExplicitShells(bodies.clone(), ShortSteps::default()),
        ..implicit.clone()
    };
    let stable = pliant_implicit::ExplicitShells::stable_step(&bodies.model);
    let shells = ParticipantSetup { steps: pliant_sim::Steps::within(DURATION, 0.9 * stable), ..shells };
    vec![explicit, single, quasi_static, equilibria, implicit, shells, relaxing(shear)]
}

/// The cube as a material that relaxes, in steps whose limit is monitored.
fn relaxing(shear: f64) -> ParticipantSetup {
    let mut model = cube(shear);
    let terms = [
        PronyTerm { part: prony::PronyPart::Isochoric, weight: 0.5, time: 0.02 },
        PronyTerm { part: prony::PronyPart::Volumetric, weight: 0.2, time: 0.05 },
    ];
    model.solids[0].material.prony = Prony::new(&terms, PronyUpdate::BackwardEuler).unwrap();
    model.initial_velocity = vec![[0.01, 0.0, 0.0]; 8];
    ParticipantSetup::explicit("cube", model, DURATION).unwrap()
}

fn ended(mut simulation: Simulation) -> u64 {
    simulation.run(DURATION, |_| ()).unwrap();
    simulation.fingerprint()
}

#[test]
fn a_simulation_owns_itself() {
    fn owned<T: Send + 'static>(_: &T) {}
    let simulation = Simulation::new(parts(1e5).remove(0)).unwrap();
    owned(&simulation);
    let there = std::thread::spawn(move || ended(simulation)).join().unwrap();
    assert_eq!(there, ended(Simulation::new(parts(1e5).remove(0)).unwrap()));
}

#[test]
fn a_state_goes_on_with_the_same_bits_in_every_method() {
    for part in parts(1e5) {
        let whole = ended(Simulation::new(part.clone()).unwrap());
        let mut simulation = Simulation::new(part.clone()).unwrap();
        while simulation.time() < 0.3 * DURATION {
            simulation.step(1).unwrap();
        }
        let (time, state) = (simulation.time(), simulation.state().unwrap());
        let bytes = simulation.encode().unwrap();
        simulation.run(DURATION, |_| ()).unwrap();
        assert_eq!(simulation.fingerprint(), whole, "{part:?}");
        simulation.restore(state.clone()).unwrap();
        assert_eq!(simulation.time(), time);
        assert_eq!(ended(simulation), whole);
        let setup = Setup::from(part);
        let read = SimulationState::decode(&setup, &bytes).unwrap();
        assert_eq!(ended(Simulation::resumed(setup, read).unwrap()), whole);
    }
}

/// Reading before a state is taken, and continuing from that state, changes no bit of the later motion.
/// Energies and reactions are found again with the same values.
#[test]
fn a_state_can_be_taken_at_a_look_in_every_method() {
    for part in parts(1e5) {
        let whole = ended(Simulation::new(part.clone()).unwrap());
        let setup = Setup::from(part.clone());
        let mut simulation = Simulation::new(part.clone()).unwrap();
        let mut looks = 0;
        while simulation.time() + 0.5 * simulation.step_length() < DURATION {
            let seen = |frame: pliant_sim::Frame<'_>| {
                let reactions: Vec<_> = part
                    .model
                    .constraints
                    .iter()
                    .map(|constraint| frame.reaction(&constraint.name))
                    .collect();
                let stability: Vec<_> = frame.parts().map(|(_, now)| now.stability()).collect();
                format!("{:?} {reactions:?} {stability:?}", frame.energies())
            };
            let first = seen(simulation.frame().unwrap());
            let (state, bytes) = (simulation.state().unwrap(), simulation.encode().unwrap());
            match looks % 3 {
                0 => simulation.restore(state).unwrap(),
                1 => {
                    simulation =
                        Simulation::resumed(setup.clone(), SimulationState::decode(&setup, &bytes).unwrap())
                            .unwrap()
                }
                _ => {}
            }
            assert_eq!(seen(simulation.frame().unwrap()), first, "{part:?} {looks}");
            simulation.step(1).unwrap();
            looks += 1;
        }
        assert_eq!(simulation.fingerprint(), whole, "{part:?}");
    }
}

#[test]
fn a_state_is_of_its_model() {
    let parts = parts(1e5);
    let [explicit, _, quasi_static, equilibria, ..] = &parts[..] else { unreachable!("seven parts") };
    let mut simulation = Simulation::new(explicit.clone()).unwrap();
    let state = simulation.state().unwrap();
    let bytes = simulation.encode().unwrap();
    for other in [quasi_static, equilibria] {
        let setup = Setup::from(other.clone());
        let refused = Simulation::resumed(setup.clone(), state.clone()).err().unwrap();
        assert!(refused.message.contains("of another model"), "{refused}");
        assert!(
            SimulationState::decode(&setup, &bytes)
                .is_none_or(|read| Simulation::resumed(setup, read).is_err())
        );
    }
    assert!(SimulationState::decode(simulation.setup(), &[&bytes[0][..bytes[0].len() / 2]]).is_none());
    assert!(SimulationState::decode::<Vec<u8>>(simulation.setup(), &[]).is_none());
    assert!(Simulation::new(Setup::new(Vec::new())).is_err());
}

#[test]
fn numbers_change_on_the_way() {
    let mut simulation =
        Simulation::new(ParticipantSetup::explicit("cube", cube(1e5), DURATION).unwrap()).unwrap();
    while simulation.time() < 0.5 * DURATION {
        simulation.step(1).unwrap();
    }
    let soft = simulation.frame().unwrap().reaction("top").unwrap()[2];
    simulation.step(1).unwrap();
    let (time, stiffer) =
        (simulation.time(), ParticipantSetup::explicit("cube", cube(4e5), DURATION).unwrap());
    assert!(simulation.exchange(stiffer).unwrap());
    assert_eq!(simulation.time(), time);
    let stiff = simulation.frame().unwrap().reaction("top").unwrap()[2];
    assert!(stiff > 2.0 * soft, "{soft} N, then {stiff} N");
    simulation.step(1).unwrap();
    let other = ParticipantSetup::equilibria("strip", strip(), DURATION, 4);
    assert!(!simulation.exchange(other).unwrap());
    simulation.run(DURATION, |_| ()).unwrap();
}

#[test]
fn participants_meet_at_common_instants() {
    let parts = vec![
        ParticipantSetup::explicit("cube", cube(1e5), DURATION).unwrap(),
        ParticipantSetup::implicit("strip", strip(), DURATION, 0.03),
    ];
    let alone: Vec<u64> = parts.iter().map(|part| part.steps.number).collect();
    let mut simulation = Simulation::new(Setup::new(parts)).unwrap();
    let numbers: Vec<u64> = simulation.setup().parts.iter().map(|part| part.steps.number).collect();
    assert_eq!((numbers[1], numbers[0] % numbers[1]), (alone[1], 0));
    assert!(numbers[0] >= alone[0] && numbers[0] < alone[0] + numbers[1]);
    let mut times = Vec::new();
    simulation.run(DURATION, |frame| times.push(frame.time())).unwrap();
    assert_eq!(times.len() as u64, numbers[1] + 1);
    let frame = simulation.frame().unwrap();
    assert!((frame.displacements("cube").unwrap()[4][2] - 0.001).abs() < 1e-12);
    assert!(frame.displacements("strip").unwrap()[3][2] > 0.0 && frame.displacements("other").is_none());
    let energies: f64 = frame.parts().map(|(_, now)| now.energies().internal).sum();
    assert_eq!(frame.energies().internal, energies);
}

#[test]
fn a_grip_pulls_at_nodes_of_any_participant() {
    let parts = vec![
        ParticipantSetup::explicit("cube", cube(1e5), DURATION).unwrap(),
        ParticipantSetup::implicit("strip", strip(), DURATION, 0.01),
    ];
    let mut simulation = Simulation::new(Setup::new(parts)).unwrap();
    let node = simulation.node(1, 3);
    assert_eq!((node, simulation.locate(node)), (11, (1, 3)));
    let [x, y, z] = simulation.rest(node);
    let grip = Grip { nodes: vec![(node, 1.0)], place: [x, y, z + 0.01], stiffness: 1.0 };
    assert!(simulation.stiffest(&grip) > 1.0);
    assert!(simulation.grip(std::slice::from_ref(&grip)));
    simulation.run(DURATION, |_| ()).unwrap();
    let [place, force] = simulation.pulled(&grip);
    assert!(place[2] > z + 1e-3 && force[2] > 0.0, "{place:?} m, {force:?} N");
    let both = Grip { nodes: vec![(0, 0.5), (node, 0.5)], ..grip };
    assert!(!simulation.grip(&[both]));
}

#[test]
fn a_load_step_tells_how_far_it_is() {
    let mut simulation =
        Simulation::new(ParticipantSetup::quasi_static("cube", cube(1e5), DURATION, 2)).unwrap();
    for number in [1, 2] {
        let mut progresses = Vec::new();
        simulation.evaluate(Wanted::Energies).unwrap();
        simulation.advance(1, &mut |progress| progresses.push(progress)).unwrap();
        assert!(progresses.len() > 3 && progresses.iter().all(|p| (p.number, p.of) == (number, 2)));
        let fractions: Vec<f64> = progresses.iter().map(|p| p.iteration.fraction).collect();
        assert!(fractions.is_sorted() && fractions[0] == 0.0, "{fractions:?}");
        let last = progresses.last().unwrap();
        assert!((last.iteration.span[1] - simulation.time()).abs() < 1e-15, "{last:?}");
        assert!(last.iteration.residual > last.tolerance);
    }
}

/// Loads of shells on solids that an explicit or quasi-static solver steps are refused by name.
#[test]
fn solids_refuse_loads_of_shells() {
    for kind in [
        LoadKind::moment([4], [0.0, 0.0, 1.0]),
        LoadKind::ShellPressure { facets: vec![0], pressure: 1.0, spread: Spread::Lumped },
    ] {
        let mut model = cube(1000.0);
        model.loads.push(Load::new("twist", kind, rising()));
        for part in [
            ParticipantSetup::explicit("cube", model.clone(), DURATION).unwrap(),
            ParticipantSetup::quasi_static("cube", model, DURATION, 1),
        ] {
            let message = Simulation::new(part).err().unwrap().to_string();
            assert!(message.contains("`twist` is a load of shells"), "{message}");
        }
    }
}

/// Forces on nodes [N] of a simulation: one on each of these nodes.
fn on(simulation: &Simulation, nodes: &[u32], force: [f64; 3]) -> Vec<[f64; 3]> {
    let count: usize = simulation.setup().parts.iter().map(|part| part.model.node_count()).sum();
    let mut forces = vec![[0.0; 3]; count];
    nodes.iter().for_each(|&node| forces[node as usize] = force);
    forces
}

/// Forces that push nodes do external work f u, and in the end the base bears them. Once they end, they have
/// no effect.
#[test]
fn a_pushed_cube_comes_to_rest_against_its_base() {
    const FORCE: [f64; 3] = [0.3, -0.2, 0.5];
    // Damped about critically in its slowest mode (84 rad/s), it is at rest by then.
    const REST: f64 = 3.0 * DURATION;
    for (precision, close) in [(Precision::Double, 1e-6), (Precision::Single, 1e-3)] {
        let mut model = cube(1e5);
        model.constraints.truncate(1);
        model.bodies[0].damping = 150.0;
        let mut part = ParticipantSetup::explicit("cube", model, 2.0 * REST).unwrap();
        let Method::Explicit(settings) = &mut part.method else { unreachable!("an explicit part") };
        settings.precision = precision;
        let mut simulation = Simulation::new(part).unwrap();
        assert!(simulation.push(&[FORCE]).unwrap_err().message.contains("1 forces were given for 8 nodes"));
        let nan = on(&simulation, &[5], [0.0, f64::NAN, 0.0]);
        assert!(simulation.push(&nan).unwrap_err().message.contains("node 5 is not finite"));
        let forces = on(&simulation, &[4, 5, 6, 7], FORCE);
        simulation.push(&forces).unwrap();
        simulation.run(REST, |_| ()).unwrap();
        let frame = simulation.frame().unwrap();
        let (base, energies) = (frame.reaction("base").unwrap(), frame.energies());
        let moved = frame.displacements("cube").unwrap();
        let work: f64 =
            moved.iter().zip(&forces).map(|(u, f)| u.iter().zip(f).map(|(u, f)| u * f).sum::<f64>()).sum();
        for c in 0..3 {
            assert!((base[c] + 4.0 * FORCE[c]).abs() < close * 4.0, "{base:?} N");
        }
        assert!(energies.balance < 0.01 && energies.damping > 0.3 * work, "{energies:?}");
        assert!((energies.external - work).abs() < close * work, "{} J of {work} J", energies.external);
        simulation.push(&[]).unwrap();
        simulation.run(2.0 * REST, |_| ()).unwrap();
        let left = simulation.frame().unwrap().displacements("cube").unwrap();
        assert!(left.iter().flatten().all(|u| u.abs() < close * 1e-4), "{left:?}");
    }
}

/// Whatever solves for equilibrium or for steps so long that all comes to rest: the clamp bears what nodes
/// are pushed with.
#[test]
fn pushed_nodes_are_borne_in_equilibrium() {
    const FORCE: [f64; 3] = [1e-3, -5e-4, 1e-3];
    let strips = [
        ParticipantSetup::equilibria("strip", strip(), DURATION, 4),
        ParticipantSetup::implicit("strip", strip(), 400.0, 1.0),
    ];
    let cube = ParticipantSetup::quasi_static("cube", cube(1e5), DURATION, 4);
    let cases = strips.map(|part| (part, [2, 3], "clamp")).into_iter().chain([(cube, [6, 7], "base")]);
    for (part, nodes, base) in cases {
        let borne = |pushed: bool| {
            let mut simulation = Simulation::new(part.clone()).unwrap();
            if pushed {
                let forces = on(&simulation, &nodes, FORCE);
                simulation.push(&forces).unwrap();
            }
            simulation.run(part.steps.step * part.steps.number as f64, |_| ()).unwrap();
            let frame = simulation.frame().unwrap();
            let others = frame.reaction("top").unwrap_or_default();
            let base = frame.reaction(base).unwrap();
            [0, 1, 2].map(|c| base[c] + others[c])
        };
        let [with, without] = [true, false].map(borne);
        for c in 0..3 {
            // Equilibria are found to 1e-6 of the largest force.
            assert!(
                (with[c] - without[c] + 2.0 * FORCE[c]).abs() < 2e-5,
                "{part:?}: {with:?} N, {without:?} N"
            );
        }
    }
}

/// Only motion and strain take the work of forces on explicit shells.
#[test]
fn forces_on_explicit_shells_do_work() {
    let part = parts(1e5).into_iter().find(|part| matches!(part.method, Method::ExplicitShells(..))).unwrap();
    let mut simulation = Simulation::new(part).unwrap();
    let forces = on(&simulation, &[2, 3], [1e-3, 0.0, 5e-3]);
    simulation.push(&forces).unwrap();
    simulation.run(DURATION, |_| ()).unwrap();
    let Energies { external, kinetic, internal, .. } = simulation.frame().unwrap().energies();
    assert!(external > 1e-5 && (external - kinetic - internal).abs() < 0.01 * external);
}
