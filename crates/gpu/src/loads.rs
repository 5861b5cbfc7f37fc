//! Loads on the device: dead forces and the corners of pressed faces, listed by the nodes they act on.

use pliant_mechanics::load::{Face, Load, LoadKind, NO_NODE};
use pliant_mechanics::model::Model;
use pliant_mechanics::tensor::{Vector, scale, sub};
use pliant_mechanics::tie::Tie;

use crate::kernel::{Binding, Bound, Kernel, Memory, Sides};
use crate::transfer::Four;
use crate::{Device, GpuError};

/// Marks an entry as a corner of a face.
const CORNER: u32 = u32::MAX;
/// A bit for each component of the force of a corner that acts.
const ALL: u32 = 0b111;

/// The loads of a model.
pub(crate) struct DeviceLoads {
    /// Finds the forces of pressed faces.
    pub pressure: Option<Kernel>,
    /// Arrays for kernels that move nodes.
    arrays: [wgpu::Buffer; 4],
}

/// Returns the nodes of the model that a load acts on, with weights.
fn weights(model: &Model, load: &Load, point: u32) -> Vec<(u32, f64)> {
    match load.surface {
        None => vec![(point, 1.0)],
        Some(surface) => model.surfaces[surface].mapping.row(point as usize).collect(),
    }
}

/// A part of an entry by components, for a node that its node follows, or for that node itself where it is
/// held. The weights that are not zero are the same.
fn part_of([x, y, z, w]: Four, weights: Vector<f64>) -> Four {
    let [a, b, c] = weights.map(|weight| weight as f32);
    match w.to_bits() {
        CORNER => {
            let weight = [a, b, c].into_iter().find(|&weight| weight != 0.0).unwrap_or(0.0);
            let given = [a, b, c].map(|factor| u32::from(factor != 0.0));
            let components = given[0] | given[1] << 1 | given[2] << 2;
            [x, weight * y, f32::from_bits(z.to_bits() & components), w]
        }
        _ => [a * x, b * y, c * z, w],
    }
}

/// The corners of all pressed faces.
#[derive(Default)]
struct Corners {
    offsets: Vec<u32>,
    nodes: Vec<[u32; 2]>,
    rest: Vec<Four>,
}

impl Corners {
    /// Adds a face of a load and, for its nodes, its corners.
    fn add(
        &mut self,
        model: &Model,
        (index, load): (usize, &Load),
        face: &Face,
        pressure: f64,
        entries: &mut [Vec<Four>],
    ) {
        let rest: &[Vector<f64>] = load.surface.map_or(&model.rest, |surface| &model.surfaces[surface].rest);
        let count = if face[3] == NO_NODE { 3 } else { 4 };
        let beside = [pressure as f32, f32::from_bits(index as u32), f32::from_bits(count), 0.0];
        for (k, &point) in face.iter().enumerate() {
            let corner = self.rest.len() as u32;
            let mut place = [0.0; 3];
            if point != NO_NODE {
                place = sub(rest[point as usize], rest[face[0] as usize]);
                for (node, weight) in weights(model, load, point) {
                    self.nodes.push([node, (weight as f32).to_bits()]);
                    let entry =
                        [f32::from_bits(corner), weight as f32, f32::from_bits(ALL), f32::from_bits(CORNER)];
                    entries[node as usize].push(entry);
                }
            }
            self.rest.push([place[0] as f32, place[1] as f32, place[2] as f32, beside[k]]);
            self.offsets.push(self.nodes.len() as u32);
        }
    }
}

impl DeviceLoads {
    /// # Errors
    /// If an array is too large.
    pub(crate) fn new(
        memory: &Memory<'_>,
        device: &Device,
        instant: &Bound,
        model: &Model,
        displacement: &Sides,
        constants: &[(&str, usize)],
    ) -> Result<Self, GpuError> {
        let mut entries: Vec<Vec<Four>> = vec![Vec::new(); model.node_count()];
        let mut corners = Corners { offsets: vec![0], ..Corners::default() };
        for (index, load) in model.loads.iter().enumerate() {
            match &load.kind {
                LoadKind::Forces(list) => {
                    for &(point, force) in list {
                        for (node, weight) in weights(model, load, point) {
                            let [x, y, z] = scale(force, weight).map(|f| f as f32);
                            entries[node as usize].push([x, y, z, f32::from_bits(index as u32)]);
                        }
                    }
                }
                LoadKind::Pressure { faces, pressure } => {
                    for face in faces {
                        corners.add(model, (index, load), face, *pressure, &mut entries);
                    }
                }
                LoadKind::Gravity { .. } | LoadKind::Moments(_) | LoadKind::ShellPressure { .. } => {}
            }
        }
        for (node, row) in model.ties.iter().flat_map(Tie::component_rows) {
            let tied_entries = std::mem::take(&mut entries[node as usize]);
            for (followed, weights) in row {
                entries[followed as usize].extend(tied_entries.iter().map(|&entry| part_of(entry, weights)));
            }
        }
        let mut offsets = vec![0];
        for entries in &entries {
            offsets.push(offsets[offsets.len() - 1] + entries.len() as u32);
        }
        let mut bodies = vec![0_u32; model.node_count()];
        for (index, body) in model.bodies.iter().enumerate() {
            bodies[body.nodes.start as usize..body.nodes.end as usize].fill(index as u32);
        }
        let offsets = memory.filled("the loads", &offsets)?;
        let entries = memory.filled("the loads", &entries.concat())?;
        let bodies = memory.filled("the bodies of nodes", &bodies)?;
        let forces = memory.zeros("the pressed faces", corners.rest.len() * size_of::<Four>())?;
        let faces = corners.rest.len() / 4;
        let pressure = if faces > 0 {
            let [places, nodes, rest] = [
                memory.filled("the pressed faces", &corners.offsets)?,
                memory.filled("the pressed faces", &corners.nodes)?,
                memory.filled("the pressed faces", &corners.rest)?,
            ];
            let bound = Bound::new(
                device,
                &[
                    Binding::ReadNow(displacement),
                    Binding::Read(&places),
                    Binding::Read(&nodes),
                    Binding::Read(&rest),
                    Binding::Write(&forces),
                ],
            );
            let snippets = [include_str!("shaders/instant.wgsl"), include_str!("shaders/pressure.wgsl")];
            let constants = [constants, &[("FACES", faces)]].concat();
            Some(Kernel::new(device, "pressure", &constants, &snippets, &[instant, &bound], faces)?)
        } else {
            None
        };
        Ok(Self { pressure, arrays: [offsets, entries, forces, bodies] })
    }

    /// Binds the arrays of loads.wgsl, in group 3.
    pub(crate) fn bindings(&self) -> [Binding<'_>; 4] {
        self.arrays.each_ref().map(Binding::Read)
    }
}
