//! The test bench: the renderer between a device and an analytic world, in simulated time. The world is a
//! linear elastic wall z < 0 with friction. A slow simulation finds it at the place of the proxy, and
//! publishes it a period later. Its compliance may be wrong.

use nalgebra::{Isometry3, Matrix3, Vector3};
use pliant_haptics::coupling::Coupling;
use pliant_haptics::estimate::Estimate;
use pliant_haptics::guard::Guard;
use pliant_haptics::hand::{Hand, Held};
use pliant_haptics::model::{LocalModel, Plane};
use pliant_haptics::renderer::{Record, Renderer, Settings};
use pliant_haptics::trace::Trace;

/// An elastic wall and the simulation that finds its force.
#[derive(Clone, Copy, Debug)]
struct World {
    /// Stiffness of the wall when pressed [N/m].
    stiffness: f64,
    friction: f64,
    /// Ticks of a step of the simulation.
    period: u32,
    local_stiffness: Told,
}

/// Stiffness of the local model.
#[derive(Clone, Copy, Debug)]
enum Told {
    /// The true stiffness times a factor.
    Times(f64),
    /// The stiffness that is estimated on the way.
    Estimated,
}

impl World {
    /// Force [N] on a tool at a place [m]. `anchor` is where the tissue is at rest beneath.
    fn force(&self, place: &Vector3<f64>, anchor: &mut Vector3<f64>) -> Vector3<f64> {
        let across = |v: &Vector3<f64>| Vector3::new(v.x, v.y, 0.0);
        if place.z >= 0.0 {
            *anchor = across(place);
            return Vector3::zeros();
        }
        let push = -self.stiffness * place.z;
        let stiffness = self.stiffness / 1.5;
        let drag = (*anchor - across(place)) * stiffness;
        let size = drag.norm();
        let drag = if size > self.friction * push { drag * (self.friction * push / size) } else { drag };
        *anchor = across(place) + drag / stiffness;
        drag + Vector3::z() * push
    }

    fn model(&self, place: Vector3<f64>, force: Vector3<f64>, estimate: &Estimate) -> LocalModel {
        let plane = Plane { normal: Vector3::z(), gap: place.z, friction: self.friction };
        let compliance = match self.local_stiffness {
            Told::Times(factor) => {
                Matrix3::from_diagonal(&Vector3::new(1.5, 1.5, 1.0)) / (factor * self.stiffness)
            }
            Told::Estimated => estimate.compliance(&Vector3::z()),
        };
        let period = f64::from(self.period) * 1e-3;
        LocalModel::touching(place, force, compliance, self.friction, &[plane], period).unwrap()
    }
}

/// Who moves the device.
enum Mover<'a> {
    /// A trace, exactly.
    Trace(&'a Trace),
    /// A hand that follows a trace.
    Hand(&'a Trace, Hand),
}

struct Outcome {
    record: Record,
    /// Force on the device and of the world at the proxy [N] at the end.
    forces: [Vector3<f64>; 2],
    /// Largest way [m] of the device from its mean height in the last second.
    trembling: f64,
}

fn run(world: &World, settings: Settings, mover: &Mover) -> Outcome {
    let (trace, hand) = match mover {
        Mover::Trace(trace) => (trace, None),
        Mover::Hand(trace, hand) => (trace, Some(hand)),
    };
    let mut renderer = Renderer::new(settings).unwrap();
    let mut estimate = Estimate::new(1000.0, [50.0, 5000.0]);
    let start = trace.at(0.0).translation.vector;
    let mut held = Held { place: start, ..Held::default() };
    let mut anchor = Vector3::zeros();
    let mut coming: Option<LocalModel> = None;
    let (mut device, mut forces) = (Vector3::zeros(), [Vector3::zeros(); 2]);
    let mut heights = Vec::new();
    let ticks = (trace.times()[1] * 1e3).round() as u32;
    for tick in 0..ticks {
        let time = f64::from(tick) * 1e-3;
        let wanted = [time - 1e-3, time].map(|time| trace.at(time).translation.vector);
        match hand {
            Some(hand) => hand.go(&mut held, &device, wanted, 1e-3),
            None => held.place = wanted[1],
        }
        if tick % world.period == 0 {
            // The step that is done shows; the next one goes to where the proxy is now.
            if let Some(model) = coming.take() {
                assert!(renderer.wants_model());
                renderer.take(model);
            }
            let place = renderer.proxy().map_or(start, |proxy| proxy.translation.vector);
            let force = world.force(&place, &mut anchor);
            estimate.add(place, force);
            coming = Some(world.model(place, force, &estimate));
            forces = [device, force];
        }
        device = renderer.tick(&Isometry3::from(held.place)).force;
        if tick + 1000 >= ticks {
            heights.push(held.place.z);
        }
    }
    let mean = heights.iter().sum::<f64>() / heights.len() as f64;
    let trembling = heights.iter().fold(0.0_f64, |most, z| most.max((z - mean).abs()));
    Outcome { record: *renderer.record(), forces, trembling }
}

fn at(z: f64) -> Isometry3<f64> {
    Isometry3::translation(0.0, 0.0, z)
}

/// Presses and scrapes for so long [s]: 8 mm to and fro at 0.7 Hz, 4 mm up and down at 0.23 Hz around the
/// surface.
fn press_and_scrape(duration: f64) -> Trace {
    use std::f64::consts::TAU;
    let mut table = String::from("t,x,y,z,qw,qx,qy,qz\n");
    for tick in 0..=(duration * 1e3) as u32 {
        let time = f64::from(tick) * 1e-3;
        let (x, z) = (0.008 * (TAU * 0.7 * time).sin(), -0.001 + 0.004 * (TAU * 0.23 * time).cos());
        table += &format!("{time},{x},0,{z},1,0,0,0\n");
    }
    Trace::read(&table).unwrap()
}

const WALL: World = World { stiffness: 500.0, friction: 0.3, period: 10, local_stiffness: Told::Times(1.0) };
/// Steps of 500, 100 and 30 Hz.
const PERIODS: [u32; 3] = [2, 10, 33];
const TOLD: [Told; 4] = [Told::Times(0.5), Told::Times(1.0), Told::Times(2.0), Told::Estimated];

/// Whatever the compliance, a device at rest feels the force that the simulation finds at its tool.
#[test]
fn at_rest_the_device_feels_the_force_of_the_simulation() {
    let trace = Trace::steps(at(0.002), Vector3::new(0.003, 0.0, -0.008), [0.2, 10.0], 3.0).unwrap();
    for period in PERIODS {
        for local_stiffness in TOLD {
            let world = World { period, local_stiffness, ..WALL };
            let Outcome { forces: [device, simulated], .. } =
                run(&world, Settings::default(), &Mover::Hand(&trace, Hand::default()));
            assert!(simulated.norm() > 0.5, "{simulated}");
            // The hand has not come to rest to the last digit.
            let off = (device - simulated).norm() / simulated.norm();
            println!(
                "steps of {period} ms, {local_stiffness:?}: {:.4} N, off by {off:.1e}",
                simulated.norm()
            );
            assert!(off < 1e-3, "{world:?}: {device} {simulated}");
        }
    }
}

/// The largest change of the force in a tick at up to 3.3 N, with steps of the simulation of any length. A
/// hand moves at up to 0.25 m/s. A spring k at a speed v has to change by k v T.
#[test]
fn the_force_does_not_jump() {
    let presses = |depth: f64, frequency: f64| {
        Trace::sine(at(0.0), Vector3::new(0.0, 0.0, depth), frequency, 10.0).unwrap()
    };
    let traces = [
        ("sine of 0.5 Hz", presses(0.01, 0.5)),
        ("sine of 2 Hz", presses(0.01, 2.0)),
        ("sine of 10 Hz", presses(0.004, 10.0)),
        ("steps", Trace::steps(at(0.001), Vector3::z() * -0.011, [0.1, 0.5], 10.0).unwrap()),
        ("tremor", presses(0.01, 0.5).with_tremor(2e-4, 1e-5, 1).unwrap()),
        ("scrape", press_and_scrape(10.0)),
    ];
    for (name, trace) in &traces {
        for period in PERIODS {
            for local_stiffness in TOLD {
                let record = run(
                    &World { period, local_stiffness, ..WALL },
                    Settings::default(),
                    &Mover::Trace(trace),
                )
                .record;
                println!(
                    "{name}, steps of {period} ms, {local_stiffness:?}: jump {:.3} N at {:.2} N, guarded {}",
                    record.jump, record.peak, record.guarded
                );
                assert!(record.jump < 0.3, "{name} {period} {local_stiffness:?}: {} N", record.jump);
            }
        }
    }
}

/// A minute of pressing and scraping: the device never gets back more than it has put in. Pressing alone,
/// without friction to take energy: that holds with a compliance that is right or too stiff. With one that is
/// too soft, most of the force comes late, and the guard is needed.
#[test]
fn a_minute_of_pressing_and_scraping_gives_no_energy() {
    let scrape = press_and_scrape(60.0);
    let press = Trace::sine(at(0.0), Vector3::new(0.0, 0.0, 0.008), 0.5, 60.0).unwrap();
    let hand = Hand::default();
    for period in PERIODS {
        for local_stiffness in TOLD {
            for (name, mover, passive) in [
                ("scraping, a trace", Mover::Trace(&scrape), true),
                ("scraping, a hand", Mover::Hand(&scrape, hand), true),
                ("pressing, a trace", Mover::Trace(&press), matches!(local_stiffness, Told::Times(1.0..))),
                (
                    "pressing, a hand",
                    Mover::Hand(&press, hand),
                    matches!(local_stiffness, Told::Times(1.0..)),
                ),
            ] {
                let world = World { period, local_stiffness, ..WALL };
                let [guarded, alone] = [Some(Guard::default()), None]
                    .map(|guard| run(&world, Settings { guard, ..Settings::default() }, &mover).record);
                println!(
                    "{name}, steps of {period} ms, {local_stiffness:?}: {:.2} mJ, least {:.4} mJ, {} ticks guarded; without guard least {:.4} mJ",
                    1e3 * guarded.energy,
                    1e3 * guarded.least_energy,
                    guarded.guarded,
                    1e3 * alone.least_energy
                );
                match passive {
                    true => assert!(guarded.least_energy >= 0.0 && guarded.guarded == 0),
                    false => assert!(guarded.least_energy >= alone.least_energy),
                }
            }
        }
    }
}

/// Colgate and Schenkel: a device of b = 1 N s/m holds 2 b/T = 2000 N/m at 1 kHz. A free mass on such a wall
/// loses b − K T/2 a time. So the limit of passivity is also the limit of stability, to the 5 % of the
/// search.
#[test]
fn colgate_schenkel_1997_stiffest_wall() {
    let zero = Vector3::zeros();
    let rigid = [Plane { normal: Vector3::z(), gap: 0.0, friction: 0.0 }];
    let wall = LocalModel::new(zero, zero, Matrix3::zeros(), &rigid, 0.001).unwrap();
    for friction in [0.5, 1.0, 2.0] {
        let limit = Coupling::limit(friction, 0.0, 1e-3, 0.0);
        let [held, ahead] = [0.0, 0.5e-3].map(|ahead| {
            let hand = Hand { mass: 0.1, friction, stiffness: 50.0, damping: 0.0 };
            let coupling = Coupling { stiffness: 1.0, damping: 0.0 };
            let settings = Settings { ahead, guard: None, coupling, soft_start: 0.0, ..Settings::default() };
            hand.stiffest(&wall, settings, 0.02).unwrap()
        });
        println!("{friction} N s/m: {held:.0} N/m, half a tick ahead {ahead:.0} N/m; limit {limit:.0} N/m");
        assert!((0.9..1.1).contains(&(held / limit)), "{friction} N s/m: {held} N/m");
        assert!(ahead > limit);
    }
}

/// Two and four times above the limit the device trembles in the wall; with the guard it stays.
#[test]
fn above_the_limit_only_the_guard_holds_the_device() {
    let hand = Hand { mass: 0.1, friction: 0.5, stiffness: 50.0, damping: 0.0 };
    let trace = Trace::steps(at(0.001), Vector3::z() * -0.02, [0.1, 20.0], 6.0).unwrap();
    let world = World { friction: 0.0, stiffness: 1e5, ..WALL };
    let limit = Coupling::limit(hand.friction, 0.0, 1e-3, 0.0);
    for times in [0.5, 2.0, 4.0] {
        let coupling = Coupling { stiffness: times * limit, damping: 0.0 };
        let [guarded, alone] = [Some(Guard::default()), None].map(|guard| {
            let settings = Settings { guard, coupling, ahead: 0.0, ..Settings::default() };
            run(&world, settings, &Mover::Hand(&trace, hand))
        });
        for (name, outcome) in [("guarded", &guarded), ("alone", &alone)] {
            println!(
                "{times} times the limit, {name}: trembles by {:.4} mm, least energy {:.3} mJ",
                1e3 * outcome.trembling,
                1e3 * outcome.record.least_energy
            );
        }
        assert!(guarded.trembling < 1e-4, "{} m", guarded.trembling);
        assert_eq!(alone.trembling > 1e-3, times > 1.0, "{} m", alone.trembling);
    }
}
