//! 3: a body from longer arrays: a column of five cubes of six tetrahedra each that sags under its weight,
//! found by dynamic relaxation.
//!
//! Run: `cargo run --release --bin 3-body-from-arrays`
//!
//! Read before: 2.

use std::error::Error;

use pliant_mechanics::Model;
use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
use pliant_mechanics::load::Load;
use pliant_mechanics::model::{Averaging, Cells, Material, Solid};
use pliant_sim::{ParticipantSetup, Simulation};

/// Edge of a cube [m].
const EDGE: f64 = 0.02;

fn main() -> Result<(), Box<dyn Error>> {
    // Four nodes a level, from the ground up, and the six tetrahedra of a cube round its diagonal.
    let corner = [[0.0, 0.0], [EDGE, 0.0], [EDGE, EDGE], [0.0, EDGE]];
    let points: Vec<[f64; 3]> =
        (0..6).flat_map(|level| corner.map(|[x, y]| [x, y, f64::from(level) * EDGE])).collect();
    let six = [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]];
    let tets: Vec<[u32; 4]> =
        (0..5).flat_map(|level| six.map(|tet| tet.map(|node| node + 4 * level))).collect();

    let mut model = Model::default();
    let column = model.add_body("column", &points);
    // Stiff enough not to buckle.
    let (shear, bulk) = (100e3, 500e3);
    let law = AnyLaw::NeoHookean(NeoHookean { shear, volumetric: Volumetric::quadratic(bulk) });
    let cells = Cells::averaged_tet4(tets, &model.rest, Averaging::Nodal);
    model.add_solid(Solid::new(column, Material::elastic(law, 1000.0), cells));
    model.fix("ground", vec![0, 1, 2, 3]);
    model.loads.push(Load::gravity(column, [0.0, 0.0, -9.81]));

    let mut simulation = Simulation::new(ParticipantSetup::quasi_static("column", model, 1.0, 1))?;
    let displacements = simulation.frame()?.displacements("column").ok_or("no column")?;
    let sag = displacements[20..].iter().map(|u| u[2]).sum::<f64>() / 4.0;
    println!("the top sinks by {:.4} mm", -1e3 * sag);
    // A bar of Young's modulus E sags by ρ g L²/2E where it is slender; its foot is held here.
    let young = 9.0 * bulk * shear / (3.0 * bulk + shear);
    let slender = 1000.0 * 9.81 * 0.1_f64.powi(2) / (2.0 * young);
    if (0.8..1.1).contains(&(-sag / slender)) {
        Ok(())
    } else {
        Err(format!("a slender bar: {slender} m").into())
    }
}
