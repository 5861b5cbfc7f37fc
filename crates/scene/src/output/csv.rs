//! A table over time: reactions, energies, probes. Each row is on disk before the next step.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use pliant_geometry::{Locator, Vector3};
use pliant_mechanics::Real;
use pliant_mechanics::recover::Recovery;

use super::{Frame, Observer, OutputError, fields};
use crate::build::Built;
use crate::format::{CsvTable, FieldName, ProbeTable};

pub(super) struct Rows {
    path: PathBuf,
    file: File,
    /// Bytes of the whole rows in it.
    length: u64,
    reactions: Vec<usize>,
    energy: bool,
    probes: Vec<Probe>,
}

/// A point that is followed: the nodes that carry it, and the cell it lies in.
struct Probe {
    weights: Vec<(u32, f64)>,
    cell: Option<(usize, usize)>,
    fields: Vec<FieldName>,
}

const ENERGIES: [&str; 6] = ["kinetic", "internal", "damping", "external", "hourglass", "balance"];
const AXES: [&str; 3] = ["x", "y", "z"];
const TENSOR: [&str; 9] = ["xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"];

impl Rows {
    pub(super) fn new(
        built: &Built,
        table: &CsvTable,
        folder: &Path,
        name: &str,
    ) -> Result<Self, OutputError> {
        let path = folder.join(format!("{name}.csv"));
        let wanted = |name: &String| table.reactions.as_ref().is_none_or(|list| list.contains(name));
        let constraints = built.model.constraints.iter();
        let reactions: Vec<usize> =
            constraints.enumerate().filter(|(_, c)| wanted(&c.name)).map(|(i, _)| i).collect();
        let mut header = vec!["time".to_owned()];
        for &constraint in &reactions {
            let name = &built.model.constraints[constraint].name;
            header.extend(AXES.map(|axis| format!("reaction.{name}.{axis}")));
        }
        if table.energy {
            header.extend(ENERGIES.map(|energy| format!("energy.{energy}")));
        }
        let mut probes = Vec::new();
        for (name, probe) in &table.probes {
            for field in &probe.data {
                let column = format!("probe.{name}.{}", field.name());
                match field.components() {
                    1 => header.push(column),
                    3 => header.extend(AXES.map(|axis| format!("{column}.{axis}"))),
                    _ => header.extend(TENSOR.map(|entry| format!("{column}.{entry}"))),
                }
            }
            probes.push(Probe::new(built, probe));
        }
        let file = File::create(&path).map_err(|error| OutputError::new(&path, error))?;
        let mut rows = Self { path, file, length: 0, reactions, energy: table.energy, probes };
        rows.write(header.join(","))?;
        Ok(rows)
    }

    /// The file.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Writes a row in one go; of one that does not fit on the disk nothing stays.
    fn write(&mut self, mut row: String) -> Result<(), OutputError> {
        row.push('\n');
        match self.file.write_all(row.as_bytes()) {
            Ok(()) => self.length += row.len() as u64,
            Err(error) => {
                let _ = self.file.set_len(self.length);
                return Err(OutputError::new(&self.path, error));
            }
        }
        Ok(())
    }
}

impl<R: Real> Observer<R> for Rows {
    fn see(&mut self, frame: &Frame<'_, R>) -> Result<(), OutputError> {
        let mut row = vec![frame.time()];
        for &constraint in &self.reactions {
            row.extend(frame.stepper.reaction(constraint));
        }
        if self.energy {
            let e = frame.stepper.energies();
            row.extend([e.kinetic, e.internal, e.damping, e.external, e.hourglass, e.balance]);
        }
        let cells_wanted = self.probes.iter().any(|probe| probe.fields.iter().any(|field| !field.is_nodal()));
        let recovery = cells_wanted.then(|| Recovery::new(&frame.built.model, frame.state));
        for probe in &self.probes {
            probe.read(frame, recovery.as_ref(), &mut row);
        }
        let row: Vec<String> = row.iter().map(|value| format!("{value:e}")).collect();
        self.write(row.join(","))
    }
}

impl Probe {
    fn new(built: &Built, table: &ProbeTable) -> Self {
        let point = Vector3::from(table.at);
        let fields = table.data.clone();
        if let Some(surface) = built.model.surfaces.iter().position(|surface| surface.name == table.on) {
            let mesh = &built.surfaces[surface];
            let distance = |a: &Vector3| (a - point).norm_squared();
            let nearest = (0..mesh.points.len())
                .min_by(|&a, &b| distance(&mesh.points[a]).total_cmp(&distance(&mesh.points[b])))
                .unwrap_or(0);
            let row = built.model.surfaces[surface].mapping.row(nearest);
            return Self {
                weights: row.map(|(node, weight)| (node as u32, weight)).collect(),
                cell: None,
                fields,
            };
        }
        let body = built.bodies.iter().position(|body| body.name == table.on).unwrap_or(0);
        let mesh = &built.bodies[body].mesh;
        let first = built.model.bodies[body].nodes.start;
        let Some(location) = Locator::new(mesh).locate(point) else {
            return Self { weights: Vec::new(), cell: None, fields };
        };
        let nodes = mesh.block(location.kind).map_or(&[][..], |block| block.cell(location.cell as usize));
        let weights =
            nodes.iter().zip(location.weights()).map(|(&node, &weight)| (first + node, weight)).collect();
        let cell = built.model.solids.iter().enumerate().find_map(|(index, solid)| {
            let fits = solid.body == body && solid.cells.nodes_per_cell() == location.kind.node_count();
            let cell = solid.original.iter().position(|&original| fits && original == location.cell)?;
            Some((index, cell))
        });
        Self { weights, cell, fields }
    }

    fn read<R: Real>(&self, frame: &Frame<'_, R>, recovery: Option<&Recovery<'_, R>>, row: &mut Vec<f64>) {
        let recovered = recovery.zip(self.cell).map(|(recovery, (solid, cell))| recovery.cell(solid, cell));
        for &field in &self.fields {
            let mut value = [0.0; 9];
            if field.is_nodal() {
                for &(node, weight) in &self.weights {
                    let nodal = fields::nodal(frame, field, node as usize);
                    for (v, n) in value.iter_mut().zip(nodal) {
                        *v += weight * n;
                    }
                }
            } else {
                value = recovered.as_ref().map_or([f64::NAN; 9], |cell| fields::of_cell(cell, field));
            }
            row.extend_from_slice(&value[..field.components()]);
        }
    }
}
