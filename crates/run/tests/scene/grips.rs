//! Grips on a shell and a solid. A strip is held at one end and pulled at the other, with each solver of
//! shells, and a bar with the implicit ones. The hand's force is the force of its spring, and the clamp holds
//! against it and the weight.

use std::sync::Arc;

use nalgebra::Vector3;
use pliant_mechanics::grip::Grip;
use pliant_run::Live;
use pliant_scene::World;
use pliant_testing::scenes;

/// The weight of both [N].
const WEIGHT: f64 = 9.81 * 1000.0 * 0.1 * 0.02 * 0.002;

fn world(body: &str, solver: &str) -> Arc<World> {
    Arc::new(scenes::world(&scenes::strip(body, solver)).unwrap())
}

/// The free end of the strip, lifted by a spring from where it is.
fn lifted(world: &World, live: &Live, stiffness: f64, by: f64) -> Grip {
    let rest = &world.only().unwrap().built.model.rest;
    let tip: Vec<u32> = (0..rest.len() as u32).filter(|&node| rest[node as usize][0] > 0.0999).collect();
    let nodes = tip.iter().map(|&node| (node, 1.0 / tip.len() as f64)).collect();
    let mut grip = Grip { nodes, ..Grip::default() };
    grip.stiffness = stiffness.min(live.simulation.stiffest(&grip));
    let [[x, y, z], _] = live.simulation.pulled(&grip);
    grip.place = [x, y, z + by];
    grip
}

#[test]
fn the_clamp_holds_against_hand_and_weight() {
    let (implicit, still) = ("solver = 'implicit'\nstep = 0.01", "solver = 'static'\nload-steps = 10");
    for (body, solver, steps) in [
        (scenes::SHELL, implicit, 400),
        (scenes::SHELL, still, 10),
        (scenes::SHELL, "", 40_000),
        (scenes::HEXES, implicit, 400),
        (scenes::HEXES, still, 10),
    ] {
        let world = world(body, solver);
        let mut live = Live::new(&world).unwrap();
        let grip = lifted(&world, &live, 5.0, 0.01);
        assert!(live.simulation.grip(std::slice::from_ref(&grip)), "{solver}");
        for _ in 0..steps {
            live.simulation.step(1).unwrap_or_else(|failure| panic!("{solver}: {}", failure.message));
        }
        live.mesh().unwrap();
        let [point, force] = live.simulation.pulled(&grip).map(Vector3::from);
        let spring = (Vector3::from(grip.place) - point) * grip.stiffness;
        assert!((force - spring).norm() < 1e-12, "{solver}");
        let clamp = Vector3::from(live.reactions()[0]);
        let sum = clamp + force - Vector3::new(0.0, 0.0, WEIGHT);
        println!("{solver:?}: hand {force:?} N, clamp {clamp:?} N, sum {:.1e} N", sum.norm());
        // What a start of the motion leaves of its inertia, and Newton's method of its residual.
        assert!(sum.norm() < 1e-4 * WEIGHT, "{solver}: {sum:?}");
        // The spring is a hundred times as stiff as the strip: it holds the tip up.
        assert!((0.0..0.005).contains(&(grip.place[2] - point[2])), "{solver}: {point:?}");
    }
}

#[test]
fn what_is_let_go_of_comes_back() {
    let world = world(scenes::SHELL, "solver = 'implicit'\nstep = 0.01");
    let settle = |live: &mut Live| {
        (0..400).for_each(|_| assert_eq!(live.simulation.step(1).unwrap(), 1));
        live.mesh().unwrap().point_data["displacement"].values.clone()
    };
    let mut free = Live::new(&world).unwrap();
    let hanging = settle(&mut free);
    let grip = lifted(&world, &free, 5.0, 0.02);
    assert!(free.simulation.grip(&[grip]));
    let held = settle(&mut free);
    assert!(free.simulation.grip(&[]));
    let let_go = settle(&mut free);
    let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart(&hanging, &held) > 0.01 && apart(&hanging, &let_go) < 1e-6);
}
