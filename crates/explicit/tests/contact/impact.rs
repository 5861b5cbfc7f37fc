//! A ball that is dropped.

use std::sync::Arc;

use nalgebra::Isometry3;
use pliant_explicit::{Observable, State};
use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
use pliant_mechanics::model::{Cells, Material, Model, Solid};
use pliant_testing::ball_of_hexes;

use super::rigid::{at, floor};
use super::{leapfrog_energy, stepper};

/// A ball of 20 mm flies against a floor without gravity, friction and damping. Its energy never grows, its
/// momentum changes by the impulse of the floor, and it flies back no faster than it came (A6).
#[test]
fn a_dropped_ball_never_gains_energy() {
    for (speed, duration) in [(0.05, 0.12), (0.2, 0.1)] {
        let mut model = Model::default();
        let (points, hexes) = ball_of_hexes(0.02, 4, 3);
        let raised = Isometry3::translation(0.0, 0.0, 0.0205);
        let points: Vec<[f64; 3]> =
            points.into_iter().map(|x| (raised * nalgebra::Point3::from(x)).coords.into()).collect();
        let body = model.add_body("ball", &points);
        let law = NeoHookean { shear: 1e4 / 2.9, volumetric: Volumetric::quadratic(1e4 / 0.3) };
        let cells = Cells::full_hex8(hexes, &model.rest);
        model.add_solid(Solid::new(body, Material::elastic(AnyLaw::NeoHookean(law), 1000.0), cells));
        model.initial_velocity = vec![[0.0, 0.0, -speed]; points.len()];
        let mass: f64 = model.mass.iter().sum();
        let contacts = at(floor(), &model, 0.0);
        let model = Arc::new(model);
        let mut stepper = stepper(&model, &contacts, 0.8);
        let mut state = State::at_rest(&model);
        let start = 0.5 * mass * speed * speed;
        let (mut known, mut grows, mut least) = (start, 0.0_f64, f64::INFINITY);
        let (mut touched, mut flight, mut drift, mut impulse) = ([f64::INFINITY, 0.0], start, 0.0_f64, 0.0);
        let mut sunk = 0.0_f64;
        while state.time < duration {
            let (time, energy) = (state.time, leapfrog_energy(&model, &mut stepper, &mut state));
            let force = -stepper.contact_forces()[0][2];
            impulse += force * stepper.step();
            if force > 0.0 {
                touched = [touched[0].min(time), time];
                flight = energy;
            } else {
                drift = drift.max((energy / flight - 1.0).abs());
            }
            grows = grows.max(energy / known - 1.0);
            known = energy;
            least = least.min(energy / start);
            let middle =
                state.displacement.iter().zip(&model.mass).map(|(u, m)| u[2] * m).sum::<f64>() / mass;
            sunk = sunk.max(-middle - 0.0005);
        }
        stepper.evaluate(&mut state).unwrap();
        let momentum: f64 =
            (0..model.node_count()).map(|node| model.mass[node] * stepper.velocity(&state, node)[2]).sum();
        let back = momentum / (mass * speed);
        println!(
            "{speed} m/s: back at {back:.4} of it after {:.2} ms, sunk by {:.3} mm, energy grows by {grows:.1e} in a step at most and drifts \
             by {drift:.1e} in flight; at least {least:.4} of the start",
            1e3 * (touched[1] - touched[0]),
            1e3 * sunk,
        );
        assert!((momentum + mass * speed - impulse).abs() < 1e-9 * impulse, "{momentum} {impulse}");
        assert!(back > 0.5 && back <= 1.0, "{back}");
        assert!(grows < 1e-6 && drift < 0.01, "{grows:.1e} {drift:.1e}");
    }
}
