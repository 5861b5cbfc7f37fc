//! The kernels that find the forces of the cells of a solid, put together from snippets.

use pliant_explicit::History;
use pliant_mechanics::model::{Averaging, Cells, Solid};

use crate::blocks::DeviceBlocks;
use crate::kernel::{Bound, GROUP, Kernel};
use crate::paths::{CORNERS, EACH_CELL, Paths};
use crate::{Device, GpuError};

const INSTANT: &str = include_str!("shaders/instant.wgsl");
const CELLS: &str = include_str!("shaders/cells.wgsl");
const PRONY: &str = include_str!("shaders/prony.wgsl");
const PRESSURE_HISTORY: &str = include_str!("shaders/pressure_history.wgsl");
const SHAPE: &str = include_str!("shaders/stored_shape.wgsl");
const HEX_CORNERS: &str = include_str!("shaders/hex_corners.wgsl");
const TET: &str = include_str!("shaders/tet.wgsl");
const AVERAGES: &str = include_str!("shaders/averages.wgsl");

/// Rows of the coefficients of relaxation of a solid: one of what remains, then one a term.
pub(crate) fn rows_of_series(solid: &Solid) -> usize {
    1 + solid.material.prony.isochoric.len() + solid.material.prony.volumetric.len()
}

/// Constants of the kernels of a solid whose law has `parameters` rows of parameters.
pub(crate) fn constants_of(
    solid: &Solid,
    parameters: usize,
    fibre_row: usize,
    first_slot: usize,
) -> Vec<(&'static str, usize)> {
    let prony = &solid.material.prony;
    vec![
        ("FAMILIES", solid.material.law.families()),
        ("PARAMETERS", parameters),
        ("SERIES", rows_of_series(solid)),
        ("ISOCHORIC_TERMS", prony.isochoric.len()),
        ("VOLUMETRIC_TERMS", prony.volumetric.len()),
        ("SLOTS", History::<f32>::slots(solid)),
        ("FIBRES", fibre_row),
        ("FIRST_SLOT", first_slot),
        ("HOURGLASS_GROWS", hourglass_grows(solid)),
    ]
}

/// Returns the kind of growth of a solid's hourglass stiffness: 0 without growth, 1 for a law with an energy
/// of the volume alone, 2 for others.
fn hourglass_grows(solid: &Solid) -> usize {
    let kind = if solid.material.law.has_volumetric_energy() { 1 } else { 2 };
    solid.hourglass_growth().map_or(0, |_| kind)
}

/// Input of the kernels of a solid.
pub(crate) struct SolidKernels<'a> {
    pub device: &'a Device,
    pub paths: &'a Paths,
    /// Blocks of the cells, if the design has some.
    pub blocks: Option<&'a DeviceBlocks>,
    pub solid: &'a Solid,
    /// WGSL of the law.
    pub law: &'a str,
    /// Cells on the device. Those at borders of blocks count once for each block.
    pub count: usize,
    /// Nodes over which pressures are averaged.
    pub local_nodes: usize,
    /// True if shapes at rest are found again from the places of nodes.
    pub finds_shapes: bool,
    /// Constants of the solid.
    pub constants: Vec<(&'static str, usize)>,
    /// Bindings that all kernels of an instant read.
    pub instant: &'a Bound,
    /// Bindings of kernels of forces.
    pub bound: &'a Bound,
    /// Bindings of kernels of averages.
    pub averaging: &'a Bound,
}

impl SolidKernels<'_> {
    /// The kernels, in the order they run.
    ///
    /// # Errors
    /// If the device lacks what one needs.
    pub(crate) fn in_order(&self) -> Result<Vec<Kernel>, GpuError> {
        Ok(match &self.solid.cells {
            Cells::Tet4(_) => vec![self.tets(&[include_str!("shaders/tet4.wgsl")])?],
            Cells::Hex8(_) => {
                let growth = include_str!("shaders/shear_growth.wgsl");
                vec![self.forces(&[HEX_CORNERS, growth, include_str!("shaders/hex8.wgsl")])?]
            }
            Cells::FullHex8(..) => {
                let snippet = include_str!("shaders/full_hex8.wgsl");
                vec![self.forces(&[PRESSURE_HISTORY, HEX_CORNERS, snippet])?]
            }
            Cells::Membrane(..) => vec![self.forces(&[include_str!("shaders/membrane.wgsl")])?],
            Cells::Bar(..) => vec![self.forces(&[include_str!("shaders/bar.wgsl")])?],
            Cells::AveragedTet4(_, averaging) => self.averaged(*averaging)?,
        })
    }

    /// Changes of volume, then pressures, by way of means at nodes, then forces.
    fn averaged(&self, averaging: Averaging) -> Result<Vec<Kernel>, GpuError> {
        let changes = self.of_cells("volume changes", &[include_str!("shaders/volume_changes.wgsl")])?;
        let means = || self.of_nodes("means at nodes", &[include_str!("shaders/node_means.wgsl")]);
        let forces =
            |snippet: &str| self.tets(&[AVERAGES, snippet, include_str!("shaders/averaged_tet4.wgsl")]);
        let of_pressure = include_str!("shaders/averaged_pressure.wgsl");
        Ok(match averaging {
            Averaging::Nodal => {
                let pressure_snippets = [PRESSURE_HISTORY, include_str!("shaders/node_pressures.wgsl")];
                vec![changes, self.of_nodes("pressures at nodes", &pressure_snippets)?, forces(of_pressure)?]
            }
            Averaging::Variational => {
                let pressure_snippets = [PRESSURE_HISTORY, include_str!("shaders/cell_pressures.wgsl")];
                let pressures = self.of_cells("pressures of cells", &pressure_snippets)?;
                vec![changes, means()?, pressures, means()?, forces(of_pressure)?]
            }
            Averaging::NiftySim => {
                vec![changes, means()?, forces(include_str!("shaders/averaged_deformation.wgsl"))?]
            }
        })
    }

    /// Forces of tetrahedra.
    fn tets(&self, snippets: &[&str]) -> Result<Kernel, GpuError> {
        let shape = if self.finds_shapes { include_str!("shaders/block_shape.wgsl") } else { SHAPE };
        self.forces(&[&[shape, TET, include_str!("shaders/tet_forces.wgsl")], snippets].concat())
    }

    /// Forces of cells, one by one or in blocks.
    fn forces(&self, snippets: &[&str]) -> Result<Kernel, GpuError> {
        let (name, cell_snippet) = (self.solid.cells.element(), self.paths.cell_snippet.as_str());
        let groups = [self.instant, self.bound, &self.paths.cells];
        let Some(blocks) = self.blocks else {
            return self.kernel(name, &[snippets, &[cell_snippet]].concat(), &groups, self.solid.cells.len());
        };
        let stored = self.paths.finds_shapes && !self.finds_shapes;
        let stored = if stored { include_str!("shaders/block_stored.wgsl") } else { "" };
        let groups = [&groups[..], &[&blocks.bound]].concat();
        self.kernel(
            name,
            &[snippets, &[cell_snippet, stored]].concat(),
            &groups,
            blocks.count * GROUP as usize,
        )
    }

    /// A value of each cell, for averages.
    fn of_cells(&self, name: &str, snippets: &[&str]) -> Result<Kernel, GpuError> {
        let snippets = [&[CORNERS, SHAPE, TET, AVERAGES], snippets, &[EACH_CELL]].concat();
        self.kernel(name, &snippets, &[self.instant, self.averaging, &self.paths.cells], self.count)
    }

    /// A value of each averaged node.
    fn of_nodes(&self, name: &str, snippets: &[&str]) -> Result<Kernel, GpuError> {
        let node_averages = include_str!("shaders/node_averages.wgsl");
        let snippets = [&[AVERAGES], snippets, &[node_averages]].concat();
        self.kernel(name, &snippets, &[self.instant, self.averaging, &self.paths.cells], self.local_nodes)
    }

    fn kernel(
        &self,
        name: &str,
        snippets: &[&str],
        bound: &[&Bound],
        count: usize,
    ) -> Result<Kernel, GpuError> {
        let mut constants = vec![("CELLS", self.count), ("LOCAL_NODES", self.local_nodes)];
        constants.extend(&self.constants);
        constants.extend(&self.paths.constants);
        constants.extend(self.blocks.iter().flat_map(|blocks| &blocks.constants));
        let snippets = [&[INSTANT, self.law, CELLS, PRONY], snippets].concat();
        Kernel::new(self.device, name, &constants, &snippets, bound, count)
    }
}
