//! Candidates for pairs of points of surfaces. They are listed in ordinary memory from places that are read
//! back, whenever the device stops because nodes have left the skin of the lists. Results depend neither on
//! when lists are made nor on when the device was looked at.

use nalgebra::Vector3;
use pliant_contact::pairs::Pairs;
use pliant_contact::touch::{Contacts, Touch};
use pliant_mechanics::tensor::Vector;

use crate::kernel::Memory;
use crate::transfer::Four;
use crate::{Device, GpuError};

/// Numbers in the head of the candidates, and of each contact there; twin of the one in pairs.wgsl.
const OF_CONTACT: usize = 9;

/// Longer arrays than needed are made, so that few lists ask for others.
const SPARE: usize = 2;

/// Distance [m] that a node may go where nothing can be listed.
const ANYWHERE: f32 = 1e30;

/// The pairs of bodies of a model.
pub(crate) struct DevicePairs {
    /// The contact of each, its lists, and the sign of its forces.
    lists: Vec<(usize, Pairs, f64)>,
    touches: Vec<Touch>,
    /// Places [m] at rest of the nodes that touch, by their own numbers, and their numbers in the model.
    rest: Vec<Vector3<f64>>,
    nodes: Vec<u32>,
    /// True for nodes that have pairs.
    watched: Vec<bool>,
    /// Arrays that pairs.wgsl reads.
    pub candidates: wgpu::Buffer,
    pub listed: wgpu::Buffer,
    /// Scratch with which kernels order pairs.
    pub queue: wgpu::Buffer,
    /// Rows that `queue` has room for.
    pub most_rows: usize,
    /// Invocations that find pairs.
    pub finders: usize,
    numbers: Vec<u32>,
    places: Vec<Four>,
}

impl DevicePairs {
    /// Makes the pairs of contacts between bodies, if there are any. `nodes` touch something, and `rest` has
    /// the places [m] at rest of all nodes of the model.
    ///
    /// # Errors
    /// If an array is too large.
    pub(crate) fn new(
        memory: &Memory<'_>,
        contacts: &Contacts,
        nodes: &[u32],
        rest: &[Vector<f64>],
    ) -> Result<Option<Self>, GpuError> {
        let number = |node: u32| nodes.partition_point(|&known| known < node) as u32;
        let rest: Vec<Vector3<f64>> = nodes.iter().map(|&node| rest[node as usize].into()).collect();
        let mut watched = vec![false; nodes.len()];
        let mut lists = Vec::new();
        for (index, contact) in contacts.contacts.iter().enumerate() {
            let Some((pairs, sign)) = contacts.pairs(index, number, |node| rest[node as usize]) else {
                continue;
            };
            let surfaces = contact.surfaces().flat_map(|surface| &surface.nodes);
            surfaces.for_each(|&node| watched[number(node) as usize] = true);
            lists.push((index, pairs, sign));
        }
        if lists.is_empty() {
            return Ok(None);
        }
        let empty = memory.zeros("the pairs that touch", 0)?;
        let mut device_pairs = Self {
            lists,
            touches: contacts.contacts.iter().map(|contact| contact.touch).collect(),
            rest,
            nodes: nodes.to_vec(),
            watched,
            listed: memory.zeros("the pairs that touch", nodes.len() * size_of::<Four>())?,
            candidates: empty.clone(),
            queue: empty,
            most_rows: 0,
            finders: 0,
            numbers: Vec::new(),
            places: Vec::new(),
        };
        device_pairs.find(&vec![Four::default(); nodes.len()]);
        device_pairs.grow(memory)?;
        Ok(Some(device_pairs))
    }

    /// Lists candidates with nodes of the model at displacements [m]; uploads them. Whether arrays are others
    /// than before.
    ///
    /// # Errors
    /// If an array is too large.
    pub(crate) fn list(&mut self, device: &Device, displacements: &[Four]) -> Result<bool, GpuError> {
        let moved: Vec<Four> = self.nodes.iter().map(|&node| displacements[node as usize]).collect();
        self.find(&moved);
        let grows = self.grow(&Memory::new(device))?;
        device.queue.write_buffer(&self.candidates, 0, bytemuck::cast_slice(&self.numbers));
        device.queue.write_buffer(&self.listed, 0, bytemuck::cast_slice(&self.places));
        Ok(grows)
    }

    /// Lists candidates with these displacements [m] of the nodes that touch.
    fn find(&mut self, moved: &[Four]) {
        let Self { lists, touches, rest, watched, numbers, places, .. } = self;
        places.clear();
        if !moved.iter().flatten().all(|x| x.is_finite()) {
            // The device finds the error.
            let free =
                |(&[x, y, z, _], &watched): (&Four, &bool)| [x, y, z, if watched { ANYWHERE } else { 0.0 }];
            places.extend(moved.iter().zip(watched.iter()).map(free));
            return;
        }
        let place = |node: u32| {
            let [x, y, z, _] = moved[node as usize].map(f64::from);
            rest[node as usize] + Vector3::new(x, y, z)
        };
        let float = |number: f64| (number as f32).to_bits();
        numbers.clear();
        numbers.resize(OF_CONTACT * (1 + touches.len()), 0);
        let (mut points, mut crossings, mut rows) = (Vec::new(), Vec::new(), Vec::new());
        let (mut point_count, mut crossing_count) = (0, 0);
        let mut room = f64::INFINITY;
        let row_count = |rows: &[u32]| (rows.len() / 5) as u32;
        for (contact, pairs, sign) in lists.iter_mut() {
            room = room.min(pairs.list_again(place));
            let [offset, reach, depth] = pairs.lengths();
            let friction = touches[*contact].friction;
            let info = (*contact as u32) << 4;
            let against = |in_order: bool| if in_order == (*sign > 0.0) { 0 } else { 8 };
            let mut ranges = [row_count(&rows); 4];
            for point in pairs.points() {
                let first = row_count(&rows);
                for ([a, b, c], at_border) in point.faces() {
                    let border = (0..3).map(|k| u32::from(at_border[k]) << k).sum::<u32>();
                    rows.extend([point.node, a, b, c, info | against(point.in_order) | border]);
                }
                points.extend([point.node, *contact as u32, first, row_count(&rows)]);
                points.push(numbers.len() as u32);
                numbers.extend(point.ring.as_flattened());
                points.push(numbers.len() as u32);
                point_count += 1;
            }
            ranges[1..3].fill(row_count(&rows));
            for [first, second] in pairs.crossings() {
                let (across, ends) = ([first.across, second.across], [first.ends, second.ends]);
                crossings.extend(across.as_flattened());
                crossings.push(row_count(&rows));
                rows.extend(ends.as_flattened());
                rows.push(info | against(true));
                crossing_count += 1;
            }
            ranges[3] = row_count(&rows);
            let at = OF_CONTACT * (1 + *contact);
            let lengths = [offset, offset + reach, depth, friction].map(float);
            numbers[at..at + OF_CONTACT - 1].copy_from_slice([lengths, ranges].as_flattened());
            if !pairs.kept().is_empty() {
                numbers[at + OF_CONTACT - 1] = numbers.len() as u32;
                numbers.extend(pairs.kept().iter().map(|&kept| float(kept)));
                numbers.extend((pairs.kept().len()..watched.len()).map(|_| float(offset)));
            }
        }
        let points_at = numbers.len();
        let crossings_at = points_at + points.len();
        let rows_at = crossings_at + crossings.len();
        let head = [point_count, crossing_count, points_at, crossings_at, rows_at];
        numbers[..head.len()].copy_from_slice(&head.map(|number| number as u32));
        for part in [&points, &crossings, &rows] {
            numbers.extend(part);
        }
        self.finders = point_count + crossing_count;
        places.extend(
            moved
                .iter()
                .zip(watched.iter())
                .map(|(&[x, y, z, _], &watched)| [x, y, z, if watched { -room as f32 } else { 0.0 }]),
        );
        for &node in lists.iter().flat_map(|(_, pairs, _)| pairs.near()) {
            places[node as usize][3] = room as f32;
        }
    }

    /// Rows of the lists.
    fn rows(&self) -> usize {
        (self.numbers.len() - self.numbers[4] as usize) / 5
    }

    /// Makes larger arrays if these are too small for the lists, and returns true then. Also sets the most
    /// rows for the kernels.
    fn grow(&mut self, memory: &Memory<'_>) -> Result<bool, GpuError> {
        let bytes = size_of_val(&self.numbers[..]);
        let rows = self.rows();
        let grows = self.candidates.size() < bytes as u64 || self.most_rows < rows;
        if grows {
            self.most_rows = SPARE * rows.max(64);
            self.candidates = memory.zeros("the pairs that touch", SPARE * bytes)?;
            let words = 1 + self.nodes.len() + 3 * self.most_rows;
            self.queue = memory.zeros("the pairs that touch", words * size_of::<u32>())?;
        }
        self.numbers[5] = self.most_rows as u32;
        Ok(grows)
    }
}
