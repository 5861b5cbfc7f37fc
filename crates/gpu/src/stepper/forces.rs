//! The forces at an instant.

use std::sync::Arc;

use pliant_contact::touch::Contacts;
use pliant_mechanics::model::Model;

use crate::blocks::NodeBlocks;
use crate::contacts::DeviceContacts;
use crate::grips::DeviceGrips;
use crate::kernel::{Kernel, Memory};
use crate::loads::DeviceLoads;
use crate::nodes::{DeviceNodes, NodeKernels};
use crate::paths::Paths;
use crate::run::{Instants, table_constants};
use crate::solids::DeviceSolid;
use crate::ties::DeviceTies;
use crate::{Design, Device, GpuError};

/// The sources of forces, each with its kernels.
pub(super) struct Forces {
    pub(super) solids: Vec<DeviceSolid>,
    /// Paths of forces from cells to nodes.
    pub(super) paths: Paths,
    loads: Option<DeviceLoads>,
    pub(super) grips: DeviceGrips,
    pub(super) ties: Option<DeviceTies>,
    pub(super) contacts: Option<DeviceContacts>,
}

impl Forces {
    /// Makes the forces of a design; `cut` has the blocks of nodes if the design has blocks.
    ///
    /// # Errors
    /// If the device can't take the model.
    pub(super) fn new(
        (memory, device): (&Memory<'_>, &Device),
        (model, contacts): (&Model, Option<Arc<Contacts>>),
        (nodes, instants): (&DeviceNodes, &Instants),
        design: Design,
        cut: Vec<NodeBlocks>,
    ) -> Result<Self, GpuError> {
        let (bound, constants) = (&instants.bound, table_constants(model));
        let loads = if model.loads.is_empty() {
            None
        } else {
            Some(DeviceLoads::new(memory, device, bound, model, &nodes.displacement, &constants)?)
        };
        let paths = Paths::new(design, memory, device, model, nodes, loads.as_ref(), cut)?;
        let solids = (model.solids.iter().enumerate())
            .map(|solid| DeviceSolid::new(memory, device, bound, solid, &paths))
            .collect::<Result<Vec<_>, _>>()?;
        let gather = (paths.node_snippet.as_str(), &paths.nodes);
        let contacts = contacts.map(|contacts| {
            let (of, with) = ((model, &contacts), (memory, device));
            DeviceContacts::new(with, bound, of, nodes, gather, loads.as_ref(), &constants)
        });
        let ties = nodes.followers.as_ref().zip(paths.giving.as_ref()).map(|(followers, giving)| {
            DeviceTies::new(device, bound, followers, giving, &nodes.displacement)
        });
        Ok(Self {
            grips: DeviceGrips::new(device, bound, &nodes.displacement)?,
            ties: ties.transpose()?,
            contacts: contacts.transpose()?,
            solids,
            paths,
            loads,
        })
    }

    /// The passes over the nodes, which take the forces.
    ///
    /// # Errors
    /// If the adapter allows fewer arrays.
    pub(super) fn node_kernels(
        &self,
        device: &Device,
        model: &Model,
        (nodes, instants): (&DeviceNodes, &Instants),
    ) -> Result<NodeKernels, GpuError> {
        let gather = (self.paths.node_snippet.as_str(), &self.paths.nodes);
        let contacts = self.contacts.as_ref().map(|contacts| &contacts.forces);
        let constants = table_constants(model);
        nodes.kernels(device, &instants.bound, gather, self.loads.as_ref(), contacts, &constants)
    }

    /// Returns the kernels that find the forces at an instant, in order; only kernels of contacts unless
    /// `anew`.
    pub(super) fn kernels(&self, anew: bool) -> impl Iterator<Item = &Kernel> {
        let before = self.contacts.iter().filter_map(|contacts| contacts.before.as_ref());
        let others = anew.then(|| self.without_contact()).into_iter().flatten();
        let touching = self.contacts.iter().flat_map(|contacts| &contacts.kernels);
        before.chain(others).chain(touching)
    }

    fn without_contact(&self) -> impl Iterator<Item = &Kernel> {
        let pressure = self.loads.iter().filter_map(|loads| loads.pressure.as_ref());
        let cells = self.solids.iter().flat_map(DeviceSolid::kernels);
        let give = self.ties.iter().map(|ties| &ties.give);
        pressure.chain(self.grips.kernel()).chain(cells).chain(give)
    }
}
