//! Cells on the device: constants at rest, histories, and the kernels that find their forces.

use pliant_explicit::Relaxation;
use pliant_explicit::{History, PACK};
use pliant_mechanics::law::Shader;
use pliant_mechanics::model::{Averaging, CellBlock, Cells, LocalNodes, Solid};
use pliant_mechanics::tensor::{Vector, dot};

use crate::blocks::finds_shapes;
use crate::kernel::{Binding, Bound, Kernel, Memory};
use crate::paths::Paths;
use crate::solid_kernels::{SolidKernels, constants_of, rows_of_series};
use crate::transfer::{Four, Transfer};
use crate::{Device, GpuError};

fn four([x, y, z]: Vector<f64>, w: f64) -> Four {
    [x as f32, y as f32, z as f32, w as f32]
}

/// The law of a solid as a shader has it.
///
/// # Errors
/// If the element averages pressures and the law has none, or only the program knows the law.
fn shader_of(solid: &Solid) -> Result<Shader, GpuError> {
    let (cells, law) = (&solid.cells, &solid.material.law);
    if cells.averages_pressure() && !law.has_volumetric_energy() {
        let what = format!("`{}` with `{}`, which has no volumetric energy,", cells.element(), law.name());
        return Err(GpuError::Unsupported { what });
    }
    let no_shader =
        || GpuError::Unsupported { what: format!("`{}`, a law that the program gives,", law.name()) };
    let mut shader = law.shader().ok_or_else(no_shader)?;
    if law.is_incompressible() {
        // A membrane does not ask for the volumetric part: no infinity goes to the device.
        shader.parameters.iter_mut().filter(|parameter| parameter.is_infinite()).for_each(|p| *p = 0.0);
    }
    Ok(shader)
}

/// Numbers in rows of four, the last one filled up with zeros.
fn fours_of(numbers: &[f32]) -> Vec<Four> {
    let row = |chunk: &[f32]| {
        let mut four = Four::default();
        four[..chunk.len()].copy_from_slice(chunk);
        four
    };
    numbers.chunks(4).map(row).collect()
}

/// The order of averaged pressures on the device, of cells in an order.
fn pressure_order(cells: &Cells, order: &[u32]) -> Vec<u32> {
    match cells {
        Cells::AveragedTet4(block, Averaging::Nodal) => (0..LocalNodes::new(block).len() as u32).collect(),
        _ if cells.averages_pressure() => order.to_vec(),
        _ => vec![],
    }
}

/// A solid on the device.
pub(crate) struct DeviceSolid {
    /// Kernels in the order they run.
    kernels: Vec<Kernel>,
    /// History of relaxing laws, for cells and for averaged pressures.
    histories: [wgpu::Buffer; 2],
    /// The order of cells and of averaged pressures on the device, by their numbers in the solid; some lie
    /// there several times.
    orders: [Vec<u32>; 2],
    /// Packs of history for each pack of cells and of averaged pressures.
    packs: [usize; 2],
    /// Parameters of the law, then coefficients of relaxation.
    constants: wgpu::Buffer,
    /// Offset of the coefficients [B].
    series: u64,
}

impl DeviceSolid {
    /// # Errors
    /// If an array is too large, or an element averages pressures and the law has none.
    pub(crate) fn new(
        memory: &Memory<'_>,
        device: &Device,
        instant: &Bound,
        (index, solid): (usize, &Solid),
        paths: &Paths,
    ) -> Result<Self, GpuError> {
        let cells = &solid.cells;
        let shader = shader_of(solid)?;
        let blocks = paths.blocks.get(index);
        let order = match blocks {
            Some(blocks) => blocks.order.clone(),
            None => (0..cells.len() as u32).collect(),
        };
        let pressure_order = pressure_order(cells, &order);
        let packs = [6 * History::<f32>::slots(solid), solid.material.prony.volumetric_slots()];
        let history = |order: &[u32], packs: usize| {
            memory.zeros("the histories", order.len().div_ceil(PACK) * packs * PACK * size_of::<f32>())
        };
        let histories = [history(&order, packs[0])?, history(&pressure_order, packs[1])?];
        let averages = match cells {
            Cells::AveragedTet4(block, _) => Some(Averages::new(memory, block, &order)?),
            _ => None,
        };

        let parameters = fours_of(&shader.parameters);
        let rows = parameters.len() + rows_of_series(solid);
        let constants = memory.uniform("constants of a solid", rows * size_of::<Four>());
        device.queue.write_buffer(&constants, 0, bytemuck::cast_slice(&parameters));

        // Forces that are found in blocks name nodes by their places there.
        let names_nodes = blocks.is_none() || averages.is_some();
        let nodes = if names_nodes { rows_of_nodes(cells, &order) } else { vec![] };
        let nodes = memory.filled("the cells", &nodes)?;
        let finds_shapes = paths.finds_shapes && finds_shapes(cells);
        let shapes = if finds_shapes { vec![] } else { rows_at_rest(solid, &order) };
        let fibre_row = shapes.len() / order.len().max(1);
        let rest = memory
            .filled("the shapes of cells at rest", &[shapes, rows_of_fibres(solid, &order)].concat())?;

        let of_cells = |nodes| {
            [nodes, Binding::Read(&rest), Binding::Write(&histories[0]), Binding::Uniform(&constants)]
        };
        let mut bindings =
            of_cells(if blocks.is_none() { Binding::Read(&nodes) } else { Binding::Nothing }).to_vec();
        match &averages {
            Some(averages) => bindings.extend(averages.means()),
            None if cells.averages_pressure() => bindings.push(Binding::Write(&histories[1])),
            None => {}
        }
        let bound = Bound::new(device, &bindings);
        let averaging = averages.as_ref().map(|averages| {
            let bindings = averages.bindings(&histories[1]);
            Bound::new(device, &[&of_cells(Binding::Read(&nodes))[..], &bindings].concat())
        });

        let kernels = SolidKernels {
            device,
            paths,
            blocks,
            solid,
            law: &shader.source,
            count: order.len(),
            local_nodes: averages.as_ref().map_or(0, |averages| averages.count),
            finds_shapes,
            constants: constants_of(solid, parameters.len(), fibre_row, paths.first_slot[index]),
            instant,
            bound: &bound,
            averaging: averaging.as_ref().unwrap_or(&bound),
        };
        let kernels = kernels.in_order()?;
        let series = (parameters.len() * size_of::<Four>()) as u64;
        Ok(Self { kernels, histories, orders: [order, pressure_order], packs, constants, series })
    }

    /// Relaxes from now on over steps of `step` seconds.
    pub(crate) fn set_step(&self, device: &Device, solid: &Solid, step: f64) {
        let relaxation = Relaxation::<f32>::new(&solid.material.prony, step);
        let [isochoric, volumetric] = [relaxation.isochoric(), relaxation.volumetric()];
        let mut rows = vec![[isochoric.remaining, volumetric.remaining, 0.0, 0.0]];
        rows.extend(
            isochoric.terms.iter().chain(&volumetric.terms).map(|&(decay, gain)| [decay, gain, 0.0, 0.0]),
        );
        device.queue.write_buffer(&self.constants, self.series, bytemuck::cast_slice(&rows));
    }

    pub(crate) fn kernels(&self) -> &[Kernel] {
        &self.kernels
    }

    /// Uploads the history of a state.
    pub(crate) fn upload(&self, device: &Device, history: &History<f32>) {
        for (index, packs) in [&history.cells, &history.pressures].into_iter().enumerate() {
            let mut numbers = vec![0.0_f32; self.numbers(index)];
            self.for_each_number(index, |pack, lane, place| numbers[place] = packs[pack].0[lane]);
            device.queue.write_buffer(&self.histories[index], 0, bytemuck::cast_slice(&numbers));
        }
    }

    /// Brings the history back; all copies of a cell have the same history.
    ///
    /// # Errors
    /// If the device fails.
    pub(crate) fn bring_back(
        &self,
        transfer: &mut Transfer,
        device: &Device,
        history: &mut History<f32>,
    ) -> Result<(), GpuError> {
        for (index, packs) in [&mut history.cells, &mut history.pressures].into_iter().enumerate() {
            if self.numbers(index) > 0 {
                transfer.read::<f32>(device, &self.histories[index], self.numbers(index), |numbers| {
                    self.for_each_number(index, |pack, lane, place| packs[pack].0[lane] = numbers[place]);
                })?;
            }
        }
        Ok(())
    }

    /// Numbers of one of the histories.
    fn numbers(&self, index: usize) -> usize {
        self.orders[index].len().div_ceil(PACK) * self.packs[index] * PACK
    }

    /// Visits the numbers of one of the histories: pack and lane in the order of the solid, and the place on
    /// the device.
    fn for_each_number(&self, index: usize, mut visit: impl FnMut(usize, usize, usize)) {
        let each = self.packs[index];
        for (to, &from) in self.orders[index].iter().enumerate() {
            let from = from as usize;
            for k in 0..each {
                visit(from / PACK * each + k, from % PACK, (to / PACK * each + k) * PACK + to % PACK);
            }
        }
    }
}

/// Returns the nodes, four to a row of all cells; a triangle repeats its last node.
fn rows_of_nodes(cells: &Cells, order: &[u32]) -> Vec<[u32; 4]> {
    let last = cells.nodes_per_cell() - 1;
    let row = |row: usize| {
        order.iter().map(move |&cell| [0, 1, 2, 3].map(|a| cells.nodes(cell as usize)[last.min(4 * row + a)]))
    };
    (0..cells.nodes_per_cell().div_ceil(4)).flat_map(row).collect()
}

/// 3/2 κ² [1/m²], within what single precision holds.
fn reach(square: f64) -> f64 {
    (1.5 * square).min(1e30)
}

/// Returns the constants of the element at rest, row by row of all cells.
fn rows_at_rest(solid: &Solid, order: &[u32]) -> Vec<Four> {
    let (cells, law) = (&solid.cells, &solid.material.law);
    let rows = |count: usize, of_cell: &dyn Fn(usize, usize) -> Four| {
        (0..count).flat_map(|row| order.iter().map(move |&cell| of_cell(row, cell as usize))).collect()
    };
    match cells {
        Cells::Tet4(block) | Cells::AveragedTet4(block, _) => rows(3, &|row, cell| {
            let rest = &block.rest[cell];
            four(rest.gradient[row + 1], if row == 0 { rest.volume } else { 0.0 })
        }),
        Cells::Hex8(block) => rows(16 + 7, &|row, cell| match (row, &block.hourglass) {
            (16.., _) => four(block.offsets[cell][row - 15], 0.0),
            (0, _) => four(block.rest[cell].gradient[0], block.rest[cell].volume),
            (1, Some(control)) => four(block.rest[cell].gradient[1], control.stiffness[cell]),
            (2, Some(control)) => four(block.rest[cell].gradient[2], reach(control.corner_reach[cell])),
            (3, _) => four(block.rest[cell].gradient[3], solid.hourglass_growth().unwrap_or(0.0)),
            (..8, _) => four(block.rest[cell].gradient[row], 0.0),
            (_, Some(control)) => control.patterns[cell].map(|gamma| gamma[row - 8] as f32),
            (_, None) => Four::default(),
        }),
        Cells::FullHex8(block, points) => rows(64 + 7, &|row, cell| {
            if row >= 64 {
                return four(block.offsets[cell][row - 63], 0.0);
            }
            let (point, a) = (row / 8, row % 8);
            let beside = match (point, a) {
                (_, 0) => points[cell].weight[point],
                (0, 1) => 1.0 / block.rest[cell].volume,
                _ => 0.0,
            };
            four(points[cell].gradient[point][a], beside)
        }),
        Cells::Membrane(block, sheets) => {
            let across = law.across();
            let modulus = if across.modulus.is_finite() { across.modulus } else { 0.0 };
            rows(4, &|row, cell| {
                let (rest, [t, s]) = (&block.rest[cell], sheets[cell].axes);
                match row {
                    0 => four(t, rest.volume),
                    1 => four(s, modulus),
                    2 => {
                        let [b, c] = [rest.gradient[1], rest.gradient[2]];
                        [dot(b, t), dot(b, s), dot(c, t), dot(c, s)].map(|x| x as f32)
                    }
                    _ => [across.coupling as f32, 0.0, 0.0, 0.0],
                }
            })
        }
        Cells::Bar(block, cord) => {
            let young = law.small_strain().young();
            rows(2, &|row, cell| {
                let rest = &block.rest[cell];
                let length = rest.length();
                match row {
                    0 => four(rest.between(), length),
                    _ => {
                        let least = if cord.tension_only { 0.0 } else { f32::MIN };
                        let modulus = young / (cord.slack * length);
                        [((1.0 - cord.slack) * length) as f32, modulus as f32, rest.area() as f32, least]
                    }
                }
            })
        }
    }
}

/// The directions of the fibres, row by row of all cells.
fn rows_of_fibres(solid: &Solid, order: &[u32]) -> Vec<Four> {
    let row =
        |family: usize| order.iter().map(move |&cell| four(solid.law_fibres(cell as usize)[family], 0.0));
    (0..solid.material.law.families()).flat_map(row).collect()
}

/// Arrays for averages over the nodes of a solid.
struct Averages {
    /// Nodes of the solid.
    count: usize,
    cell_values: wgpu::Buffer,
    node_values: wgpu::Buffer,
    nodes: wgpu::Buffer,
    offsets: wgpu::Buffer,
    cells: wgpu::Buffer,
    inverse_volume: wgpu::Buffer,
}

impl Averages {
    fn new(memory: &Memory<'_>, block: &CellBlock<4>, order: &[u32]) -> Result<Self, GpuError> {
        let local = LocalNodes::new(block);
        let mut place = vec![0; block.nodes.len()];
        (0..).zip(order).for_each(|(to, &cell)| place[cell as usize] = to);
        let mut offsets = vec![0];
        let (mut cells, mut inverse_volume) = (Vec::new(), Vec::new());
        for node in 0..local.len() {
            cells.extend(local.cells_at(node).map(|cell| place[cell]));
            offsets.push(cells.len() as u32);
            let volume: f64 = local.cells_at(node).map(|cell| 0.25 * block.rest[cell].volume).sum();
            inverse_volume.push((1.0 / volume) as f32);
        }
        Ok(Self {
            count: local.len(),
            cell_values: memory.zeros("the averages", order.len() * size_of::<f32>())?,
            node_values: memory.zeros("the averages", local.len() * size_of::<f32>())?,
            nodes: memory.filled(
                "the cells",
                &order.iter().map(|&cell| local.nodes[cell as usize]).collect::<Vec<_>>(),
            )?,
            offsets: memory.filled("the cells at nodes", &offsets)?,
            cells: memory.filled("the cells at nodes", &cells)?,
            inverse_volume: memory.filled("the averages", &inverse_volume)?,
        })
    }

    /// Returns the bindings of elements that take the means of their nodes.
    fn means(&self) -> [Binding<'_>; 3] {
        [Binding::Nothing, Binding::Write(&self.node_values), Binding::Read(&self.nodes)]
    }

    /// Returns the bindings of kernels that find these means.
    fn bindings<'a>(&'a self, pressures: &'a wgpu::Buffer) -> [Binding<'a>; 7] {
        [
            Binding::Write(&self.cell_values),
            Binding::Write(&self.node_values),
            Binding::Read(&self.nodes),
            Binding::Read(&self.offsets),
            Binding::Read(&self.cells),
            Binding::Read(&self.inverse_volume),
            Binding::Write(pressures),
        ]
    }
}
