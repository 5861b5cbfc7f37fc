//! 4: a shell: a strip clamped at one end and lifted at the other.
//!
//! Run: `cargo run --release --bin 4-shells`
//!
//! Read before: 3 and `docs/guide/shells.md`.

use std::error::Error;

use nalgebra::Vector3;
use pliant_implicit::{Assembly, Shell};
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::load::{Load, LoadKind};
use pliant_shells::element::Elasticity;
use pliant_shells::element::Wall;
use pliant_sim::{ParticipantSetup, Simulation};

fn main() -> Result<(), Box<dyn Error>> {
    // 1 m × 0.1 m × 10 mm in ten squares of two triangles.
    let points = (0..22).map(|i| Vector3::new(f64::from(i / 2) * 0.1, f64::from(i % 2) * 0.1, 0.0));
    let cells =
        (0..10).flat_map(|i| [[2 * i, 2 * i + 2, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 1]]).collect();
    let material = Wall { elastic: Elasticity { young: 1e6, poisson: 0.0 }, density: 1000.0 };
    let mut model = Assembly::new("strip", points);
    model.add_shell(&Shell::new("strip", cells, 0.01, material))?;
    model.model_mut().fix("clamp", vec![0, 1]);
    let force = 1e-4;
    let lift = LoadKind::force([20, 21], [0.0, 0.0, 0.5 * force]);
    let ramp = Curve { shape: Shape::Ramp, from: 0.0, to: 1.0 };
    model.model_mut().loads.push(Load::new("lift", lift, ramp));

    let mut simulation = Simulation::new(ParticipantSetup::equilibria("strip", model, 1.0, 1))?;
    simulation.step(1)?;
    let up = simulation.frame()?.displacements("strip").ok_or("no strip")?[20][2];
    // F L³/3EI of a beam.
    let beam = force / (3.0 * 1e6 * 0.1 * 0.01_f64.powi(3) / 12.0);
    println!("the end rises by {:.4} mm, that of a beam by {:.4} mm", 1e3 * up, 1e3 * beam);
    if (up / beam - 1.0).abs() < 0.01 { Ok(()) } else { Err("not as a beam".into()) }
}
