//! Soft bodies at rigid things, at each other and at themselves, held to closed forms.

mod bodies;
mod degenerate;
mod friction;
mod impact;
mod nodal;
mod rigid;
mod thin;

use std::sync::Arc;

use nalgebra::{Isometry3, Point3};
use pliant_contact::touch::Contacts;
use pliant_explicit::critical_step::assembled;
use pliant_explicit::{CentralDifference, Observable, State};
use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
use pliant_mechanics::model::{Cells, Material, Model, Solid};
use pliant_mechanics::prony::Prony;

/// A block of `cells` cubes along each axis, its lowest corner at the origin; without volumetric coupling.
pub fn block(cells: [u32; 3], edge: f64, shear: f64, prony: Prony) -> Model {
    let mut model = Model::default();
    let law = AnyLaw::NeoHookean(NeoHookean { shear, volumetric: Volumetric::quadratic(2.0 * shear / 3.0) });
    let size = cells.map(|count| edge * f64::from(count));
    add_block(
        &mut model,
        cells,
        size,
        Isometry3::identity(),
        Material { prony, ..Material::elastic(law, 1000.0) },
    );
    model
}

/// Adds a block of a size [m], its lowest corner at the origin before it is put in place.
pub fn add_block(model: &mut Model, cells: [u32; 3], size: [f64; 3], at: Isometry3<f64>, material: Material) {
    let [nx, ny, nz] = cells;
    let first = model.node_count() as u32;
    let place = |k: [u32; 3]| {
        let corner = [0, 1, 2].map(|c| size[c] * f64::from(k[c]) / f64::from(cells[c]));
        <[f64; 3]>::from((at * Point3::from(corner)).coords)
    };
    let node = |i: u32, j: u32, k: u32| first + (k * (ny + 1) + j) * (nx + 1) + i;
    let mut points = Vec::new();
    for k in 0..=nz {
        for j in 0..=ny {
            points.extend((0..=nx).map(|i| place([i, j, k])));
        }
    }
    let corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
    let mut hexes = Vec::new();
    for (k, j, i) in (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| (k, j, i)))) {
        hexes.push(corners.map(|[a, b, c]| node(i + a, j + b, k + c)));
    }
    let body = model.add_body("block", &points);
    let cells = Cells::full_hex8(hexes, &model.rest);
    model.add_solid(Solid::new(body, material, cells));
}

/// Triangles of the faces of hexahedra of a solid that no other one has.
pub fn faces(solid: &Solid) -> Vec<[u32; 3]> {
    const SIDES: [[usize; 4]; 6] =
        [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
    let mut by_nodes = std::collections::BTreeMap::new();
    for cell in 0..solid.cells.len() {
        let nodes = solid.cells.nodes(cell);
        for side in SIDES.map(|side| side.map(|k| nodes[k])) {
            let mut key = side;
            key.sort_unstable();
            by_nodes.entry(key).or_insert_with(Vec::new).push(side);
        }
    }
    let outer = by_nodes.into_values().filter(|sides| sides.len() == 1).flatten();
    outer.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect()
}

fn stepper(model: &Arc<Model>, contacts: &Arc<Contacts>, part: f64) -> CentralDifference<f64> {
    let step = part * assembled(model).unwrap().step;
    CentralDifference::new(Arc::clone(model), step).unwrap().with_contacts(Arc::clone(contacts))
}

/// Takes one step. Returns the energy [J] before it that central differences keep. It is ½ Σ m v⁻·v⁺ of the
/// velocities before and after the instant, and the energy stored there.
pub fn leapfrog_energy(model: &Model, stepper: &mut CentralDifference<f64>, state: &mut State<f64>) -> f64 {
    stepper.evaluate(state).unwrap();
    let before = state.increment.clone();
    let stored = stepper.energies().internal;
    stepper.advance(state);
    let ways = before.iter().zip(&state.increment).zip(&model.mass);
    let moving: f64 = ways.map(|((a, b), mass)| mass * (a[0] * b[0] + a[1] * b[1] + a[2] * b[2])).sum();
    0.5 * moving / stepper.step().powi(2) + stored
}
