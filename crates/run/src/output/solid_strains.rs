//! Largest changes of volume of nearly incompressible bodies, and membranes that a solid lets wrinkle, with
//! their warnings.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, SymmetricEigen};
use pliant_explicit::recover::CellFields;
use pliant_geometry::words::number;
use pliant_mechanics::Model;
use pliant_mechanics::model::{Cells, Solid};
use pliant_sim::Instant;
use serde::{Deserialize, Serialize};

/// Poisson's ratio at rest from which on a body counts as nearly incompressible. Bodies with fibres do with
/// any ratio.
const NEARLY_INCOMPRESSIBLE: f64 = 0.45;

/// Change of volume beyond which a run warns.
const MUCH: f64 = 0.05;

/// Compressive membrane force beyond which a run warns, over the one at which wrinkles as short as an edge
/// appear.
const NEAR_WRINKLES: f64 = 0.5;

/// The largest change of volume of a nearly incompressible body during a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VolumeChange {
    /// Its body.
    pub body: String,
    /// J − 1 where it is largest in size; J as the law sees it.
    pub change: f64,
    /// The element, counted from 0.
    pub element: u32,
    /// The instant [s].
    pub time: f64,
}

/// The most compressed element of a membrane on a solid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Compression {
    body: String,
    /// Its compressive force over E* h/2π.
    part: f64,
    /// The force [N/m].
    force: f64,
    element: u32,
    time: f64,
}

/// The worst of the solids of a participant so far, by their numbers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct SolidStrains {
    volumes: Vec<Option<VolumeChange>>,
    membranes: Vec<Option<Compression>>,
}

impl SolidStrains {
    /// Looks at an instant.
    pub fn look(&mut self, model: &Model, now: &dyn Instant) {
        let Some(cells) = now.cells() else { return };
        self.volumes.resize(model.solids.len(), None);
        self.membranes.resize(model.solids.len(), None);
        let body = |solid: &Solid| model.bodies[solid.body].name.clone();
        for (index, solid) in model.solids.iter().enumerate() {
            if keeps_volume(solid) {
                let change = |fields: &CellFields, to: &mut [f64]| to[0] = fields.volume_ratio - 1.0;
                let changes = cells.numbers(index, false, 1, &change);
                let known = self.volumes[index].as_ref().map_or(0.0, |known| known.change.abs());
                if let Some((cell, change)) = largest(changes.iter().map(|change| change.abs()), known) {
                    let (change, element) = (changes[cell].signum() * change, solid.original[cell]);
                    let found = VolumeChange { body: body(solid), change, element, time: now.time() };
                    self.volumes[index] = Some(found);
                }
            }
            let Some(limits) = wrinkling_forces(model, solid) else { continue };
            let compression = |fields: &CellFields, to: &mut [f64]| to[0] = compressive_force(fields);
            let forces = cells.numbers(index, false, 1, &compression);
            let known = self.membranes[index].as_ref().map_or(0.0, |known| known.part);
            let parts = forces.iter().zip(&limits).map(|(force, limit)| force / limit);
            if let Some((cell, part)) = largest(parts, known) {
                let (force, element) = (forces[cell], solid.original[cell]);
                self.membranes[index] =
                    Some(Compression { body: body(solid), part, force, element, time: now.time() });
            }
        }
    }

    /// The largest changes of volume.
    pub fn volumes(&self) -> impl Iterator<Item = &VolumeChange> {
        self.volumes.iter().flatten()
    }

    /// Warnings about the result.
    pub fn doubts(&self) -> impl Iterator<Item = String> {
        let volumes = self.volumes().filter(|found| found.change.abs() > MUCH).map(|found| {
            let VolumeChange { body, change, element, time } = found;
            format!(
                "`{body}` changes its volume by {:+.1} % in element {element} (counted from 0) at t = {} s; its law is \
                 nearly incompressible or has fibres, which load the bulk modulus; take a larger `bulk-modulus` or `poisson-ratio`",
                100.0 * change,
                number(*time)
            )
        });
        let membranes = self.membranes.iter().flatten().filter(|found| found.part > NEAR_WRINKLES).map(|found| {
            let Compression { body, part, force, element, time } = found;
            format!(
                "the membrane `{body}` is compressed by {} N/m in element {element} (counted from 0) at t = {} s; this is {:.1} times the force \
                 at which wrinkles as short as its edges appear, so its shape depends on the mesh; give it bending \
                 (`model = \"shell\"`), or stretch it",
                number(*force),
                number(*time),
                part
            )
        });
        volumes.chain(membranes)
    }
}

/// The largest of some numbers that are not negative, where it is above a known one.
fn largest(values: impl Iterator<Item = f64>, known: f64) -> Option<(usize, f64)> {
    values.enumerate().fold(
        None,
        |best: Option<(usize, f64)>, (at, x)| {
            if x > best.map_or(known, |(_, most)| most) { Some((at, x)) } else { best }
        },
    )
}

/// Decides whether a solid should keep its volume: nearly incompressible laws and laws with fibres do.
fn keeps_volume(solid: &Solid) -> bool {
    let law = &solid.material.law;
    !matches!(solid.cells, Cells::Bar(..))
        && (law.families() > 0 || law.small_strain().poisson() >= NEARLY_INCOMPRESSIBLE)
}

/// The compressive membrane force [N/m], 0 of an element in tension.
fn compressive_force(fields: &CellFields) -> f64 {
    let Some(force) = fields.membrane_force() else { return 0.0 };
    let [xx, yy, zz, xy, yz, xz] = force.0;
    if !force.0.iter().all(|x| x.is_finite()) {
        return 0.0;
    }
    let least = SymmetricEigen::new(Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)).eigenvalues.min();
    (-least).max(0.0)
}

/// Returns the compressive force [N/m] at which each element of a membrane on a solid wrinkles as short as
/// its mean edge h. Biot (1957) gives E t³ k²/12 + E* / (2 k) at a wavelength 2π/k. Two edges and no bending
/// term make E* h/2π. Returns `None` for other cells, and for membranes on no solid.
fn wrinkling_forces(model: &Model, membrane: &Solid) -> Option<Vec<f64>> {
    if !matches!(membrane.cells, Cells::Membrane(..)) {
        return None;
    }
    // The softest solid at each node.
    let mut modulus = vec![f64::INFINITY; model.node_count()];
    let thick =
        model.solids.iter().filter(|solid| !matches!(solid.cells, Cells::Membrane(..) | Cells::Bar(..)));
    for solid in thick {
        let moduli = solid.material.law.small_strain();
        let plane_strain = moduli.young() / (1.0 - moduli.poisson().powi(2));
        for &node in (0..solid.cells.len()).flat_map(|cell| solid.cells.nodes(cell)) {
            let least = &mut modulus[node as usize];
            *least = least.min(plane_strain);
        }
    }
    let force = |cell: usize| {
        let nodes = membrane.cells.nodes(cell);
        let side = |i: usize| {
            let [a, b] = [nodes[i], nodes[(i + 1) % 3]].map(|node| model.rest[node as usize]);
            (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
        };
        let edge = (side(0) + side(1) + side(2)) / 3.0;
        let softest = nodes.iter().map(|&node| modulus[node as usize]).fold(f64::INFINITY, f64::min);
        softest * edge / TAU
    };
    let forces: Vec<f64> = (0..membrane.cells.len()).map(force).collect();
    forces.iter().any(|force| force.is_finite()).then_some(forces)
}
