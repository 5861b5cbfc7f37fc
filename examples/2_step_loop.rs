//! 2: a step loop that reads a displacement and a reaction: a cube of one hexahedron, pulled at its top.
//!
//! Run: `cargo run --release --bin 2-step-loop`
//!
//! Read before: 1.

use std::error::Error;

use pliant_mechanics::Model;
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
use pliant_mechanics::model::{Cells, Material, Motion, Solid};
use pliant_sim::{ParticipantSetup, Simulation};

fn main() -> Result<(), Box<dyn Error>> {
    let cube = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
    let points = cube.map(|corner| corner.map(|x| 0.1 * f64::from(x)));

    let mut model = Model::default();
    let body = model.add_body("cube", &points);
    let (shear, bulk) = (1000.0, 10_000.0);
    let law = AnyLaw::NeoHookean(NeoHookean { shear, volumetric: Volumetric::quadratic(bulk) });
    let cells = Cells::full_hex8(vec![[0, 1, 2, 3, 4, 5, 6, 7]], &model.rest);
    model.add_solid(Solid::new(body, Material::elastic(law, 1000.0), cells));
    model.bodies[body].damping = 50.0; // 1/s
    model.fix("base", vec![0, 1, 2, 3]);
    let pull = Curve { shape: Shape::SmoothStep, from: 0.0, to: 0.5 };
    model.constrain("top", vec![4, 5, 6, 7], Motion::Displacement([0.0, 0.0, 0.001], pull));

    let mut simulation = Simulation::new(ParticipantSetup::explicit("cube", model, 1.0)?)?;
    let mut next = 0.0;
    while simulation.time() < 1.0 {
        if simulation.time() >= next {
            let now = simulation.frame()?;
            let up = now.displacements("cube").ok_or("no cube")?[6][2];
            let force = now.reaction("top").ok_or("no top")?[2];
            println!("t = {:.2} s: top at {:.3} mm, pulled with {force:.4} N", now.time(), 1e3 * up);
            next += 0.25;
        }
        simulation.step(1)?;
    }
    // Both faces are held: strain along one axis alone, of modulus K + 4μ/3.
    let expected = (bulk + 4.0 / 3.0 * shear) * 0.01 * 0.01;
    let found = simulation.frame()?.reaction("top").ok_or("no top")?[2];
    if (found / expected - 1.0).abs() < 0.02 {
        Ok(())
    } else {
        Err(format!("{found} N, not {expected} N").into())
    }
}
