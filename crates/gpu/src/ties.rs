//! Nodes on the device that follow others. They are taken along after each motion. The forces of their cells
//! go to the nodes that they follow, by the rows of `pliant_mechanics::tie`. Masses were moved there when the
//! model was made.

use pliant_mechanics::model::Model;
use pliant_mechanics::tensor::Vector;
use pliant_mechanics::tie::Tie;

use crate::kernel::{Binding, Bound, Kernel, Memory, Sides};
use crate::{Device, GpuError};

/// The nodes that follow others.
pub(crate) struct Followers {
    /// Number of each node among the followers, or [`NONE`].
    number: Vec<u32>,
    /// Number of followers.
    pub count: usize,
    /// Bits of the weights of all rows along each component, with the followed nodes.
    rows: Vec<[u32; 4]>,
    /// Followers, first entries of their rows, and rows.
    arrays: [wgpu::Buffer; 3],
}

/// A node that follows no others.
const NONE: u32 = u32::MAX;

impl Followers {
    /// `None` without ties.
    ///
    /// # Errors
    /// If an array is too large.
    pub(crate) fn new(memory: &Memory<'_>, model: &Model) -> Result<Option<Self>, GpuError> {
        if model.ties.is_empty() {
            return Ok(None);
        }
        let mut number = vec![NONE; model.node_count()];
        let (mut followers, mut offsets, mut rows) = (Vec::new(), vec![0], Vec::new());
        for (node, row) in model.ties.iter().flat_map(Tie::component_rows) {
            number[node as usize] = followers.len() as u32;
            followers.push(node);
            let entry = |(followed, weights): (u32, Vector<f64>)| {
                let [x, y, z] = weights.map(|weight| (weight as f32).to_bits());
                [x, y, z, followed]
            };
            rows.extend(row.map(entry));
            offsets.push(rows.len() as u32);
        }
        let arrays = [
            memory.filled("the ties", &followers)?,
            memory.filled("the ties", &offsets)?,
            memory.filled("the ties", &rows)?,
        ];
        Ok(Some(Self { number, count: followers.len(), rows, arrays }))
    }

    /// Returns the number of a node among the followers.
    pub(crate) fn number(&self, node: u32) -> Option<u32> {
        Some(self.number[node as usize]).filter(|&number| number != NONE)
    }

    /// The nodes that are followed, entry by entry of the rows; a follower itself where it is held.
    pub(crate) fn followed(&self) -> impl Iterator<Item = u32> + Clone + '_ {
        self.rows.iter().map(|&[.., followed]| followed)
    }

    /// Gives forces to followed nodes where each cell has slots. The slots of followers are counted as in
    /// [`Followers::number`], and `first` is the first slot that the followed nodes take.
    pub(crate) fn among_slots(
        &self,
        device: &Device,
        forces: &wgpu::Buffer,
        slots: &[wgpu::Buffer; 2],
        first: usize,
    ) -> Giving {
        let [_, offsets, rows] = &self.arrays;
        let [slot_offsets, slots_of] = slots;
        let bound = Bound::new(
            device,
            &[
                Binding::Write(forces),
                Binding::Nothing,
                Binding::Read(offsets),
                Binding::Read(rows),
                Binding::Read(slot_offsets),
                Binding::Read(slots_of),
            ],
        );
        let snippet = format!("const FIRST_GIVEN = {first}u;\n{}", include_str!("shaders/give_slots.wgsl"));
        Giving { bound, snippet }
    }

    /// Gives forces to followed nodes where cells have added up their forces.
    pub(crate) fn among_sums(&self, device: &Device, forces: &wgpu::Buffer) -> Giving {
        let bound = Bound::new(device, &[&[Binding::Write(forces)], &self.bindings()[..]].concat());
        Giving { bound, snippet: include_str!("shaders/give_sums.wgsl").to_owned() }
    }

    fn bindings(&self) -> [Binding<'_>; 3] {
        self.arrays.each_ref().map(Binding::Read)
    }
}

/// Path of forces on followers to the nodes that they follow, in a design.
pub(crate) struct Giving {
    bound: Bound,
    snippet: String,
}

/// Kernels of ties at an instant.
pub(crate) struct DeviceTies {
    /// Gives the forces on followers to the followed nodes, once the forces of cells are found.
    pub give: Kernel,
    /// Takes followers along, once nodes have moved.
    pub follow: Kernel,
}

impl DeviceTies {
    /// # Errors
    /// If the adapter allows fewer arrays.
    pub(crate) fn new(
        device: &Device,
        instant: &Bound,
        followers: &Followers,
        giving: &Giving,
        displacement: &Sides,
    ) -> Result<Self, GpuError> {
        let kernel = |bound: &Bound, snippet: &str| {
            let (constants, snippets) =
                ([("FOLLOWERS", followers.count)], [include_str!("shaders/ties.wgsl"), snippet]);
            Kernel::new(device, "ties", &constants, &snippets, &[instant, bound], followers.count)
        };
        let moved = [&[Binding::WriteNow(displacement)], &followers.bindings()[..]].concat();
        Ok(Self {
            give: kernel(&giving.bound, &giving.snippet)?,
            follow: kernel(&Bound::new(device, &moved), include_str!("shaders/follow.wgsl"))?,
        })
    }
}
