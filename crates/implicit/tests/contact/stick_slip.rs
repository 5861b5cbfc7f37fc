//! A block that a spring pulls over a floor sticks and slips (S3): held to the closed form of a mass under
//! Coulomb's friction.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use pliant_contact::barrier::BarrierSettings;
use pliant_contact::shape::Shape;
use pliant_implicit::AssemblySolver;
use pliant_implicit::{AssemblyState, BackwardEuler, DynamicSettings, Integrator, Spring};

use super::blocks::{block, weigh};
use super::{at_rigid, fixed, mean, surface, touch};

const FRICTION: f64 = 0.3;
/// Speed [m/s] of the far end of the spring, and that up to which friction lets the block creep.
const SPEED: f64 = 0.05;
const CREEP: f64 = 2e-5;
/// Time [s] of an oscillation of the block on its spring.
const PERIOD: f64 = 0.2;
/// Time [s] in which the block settles before it is pulled.
const SETTLES: f64 = 0.1;

/// Position [m] of the far end of the spring, and of the block by the closed form, at a time [s] since the
/// pull began. The block sticks until the spring pulls with μ N, after `stuck`, and goes by v τ − v/ω sin ω
/// τ. After one oscillation it stands for an instant. There the spring is pulled back, the block sticks twice
/// as long, and slips back likewise.
fn exact(time: f64, stuck: f64) -> [f64; 2] {
    let slips = |since: f64| SPEED * (since - PERIOD / TAU * (TAU * since / PERIOD).sin());
    let turns = stuck + PERIOD;
    let end = if time < turns { SPEED * time } else { SPEED * (2.0 * turns - time) };
    let block = if time < stuck {
        0.0
    } else if time < turns {
        slips(time - stuck)
    } else {
        slips(PERIOD) - slips((time - turns - 2.0 * stuck).max(0.0))
    };
    [end, block]
}

#[test]
fn a_block_on_a_spring_sticks_and_slips() {
    let (mut model, under) = block(1e6);
    weigh(&mut model, [0.0, 0.0, -9.81], 0.0);
    let floor = fixed("floor", Shape::HalfSpace, [0.0, 0.0, -8e-5], [0.0; 3]);
    let contacts = at_rigid(&surface(under), vec![floor], FRICTION, 0.0);
    touch(&mut model, contacts, BarrierSettings { distance: 1e-4, stiffness: 1e4, creep_speed: CREEP });
    let mass: f64 = model.mass.iter().sum();
    let rate = (TAU / PERIOD).powi(2);
    let stuck = FRICTION * 9.81 / (rate * SPEED);
    let step = 1e-3;
    let integrator = Integrator::Bdf2;
    let settings = DynamicSettings { iterations: 100, integrator, ..DynamicSettings::new(step) };
    let mut solver = BackwardEuler::new(model.clone(), settings).unwrap();
    let mut state = AssemblyState::at_rest(&model);
    let (mut rest, mut way, mut fastest) = (0.0, Vec::new(), 0.0_f64);
    let mut largest: f64 = 0.0;
    for count in 1.. {
        let time = f64::from(count) * step - SETTLES;
        if time > 2.0 * (stuck + PERIOD) + stuck {
            break;
        }
        // A spring at each node, by its mass, so that nothing bends.
        let [end, expected] = exact(time.max(0.0), stuck);
        let spring = |node: u32| {
            let index = node as usize;
            let mut anchor = model.place(index) + Vector3::x() * (rest + end);
            (anchor.y, anchor.z) = (state.position[index].y, state.position[index].z);
            Spring { node, anchor, stiffness: rate * model.mass[index] }
        };
        let springs: Vec<Spring> = (0..model.rest.len() as u32).map(spring).collect();
        solver.grip(&springs);
        solver.advance(&mut state).unwrap();
        let now = mean(&model, &state.position).x - 0.01;
        if time <= 0.0 {
            rest = now;
            continue;
        }
        way.push((time, now - rest));
        fastest = fastest.max(mean(&model, &state.velocity).x);
        largest = largest.max((now - rest - expected).abs());
    }
    let amplitude = SPEED * PERIOD / TAU;
    // It has slipped by a tenth of the amplitude where sin ω τ is ω τ − 0.1.
    let begun = |from: f64, along: f64| {
        let start = way.iter().rposition(|(time, _)| *time <= from).map_or(0.0, |at| way[at].1);
        let slipped = |(_, place): (f64, f64)| along * (place - start) / (0.1 * amplitude);
        let after = way.iter().position(|&at| at.0 > from && slipped(at) > 1.0).unwrap();
        let [before, after] = [way[after - 1], way[after]];
        before.0 + step * (1.0 - slipped(before)) / (slipped(after) - slipped(before))
    };
    let delay = 0.8538 * PERIOD / TAU;
    let first = begun(0.0, 1.0) - delay;
    let second = begun(stuck + PERIOD, -1.0) - delay - (stuck + PERIOD);
    println!(
        "mass {mass:.4} kg: slips after {first:.4} s of {stuck:.4} s, after the turn {second:.4} s of {:.4} s; fastest {fastest:.4} m/s of {:.4}; off by {:.2} % of the amplitude",
        2.0 * stuck,
        2.0 * SPEED,
        100.0 * largest / amplitude
    );
    assert!(
        (first / stuck - 1.0).abs() < 0.03 && (second / (2.0 * stuck) - 1.0).abs() < 0.03,
        "{first} {second}"
    );
    assert!((0.5 * fastest / SPEED - 1.0).abs() < 0.02 && largest < 0.04 * amplitude, "{fastest} {largest}");
}
