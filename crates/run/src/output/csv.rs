//! A table over time: reactions, energies, probes. Each row is on disk before the next step.

use std::fs::{self, File};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use crc32fast::Hasher;
use pliant_format::tables::{CsvTable, FieldName, ProbeTable};
use pliant_geometry::Vector3;
use pliant_mechanics::Energies;
use pliant_mechanics::model::Enclosed;
use pliant_mechanics::tensor::add;
use pliant_scene::{Built, PlannedParticipant, World};
use pliant_shells::Carried;
use pliant_sim::BodyCells;
use pliant_sim::contact::touch::With;

use super::file::{create, reopen};
use super::{Frame, Output, OutputError, Recovered, Written, fields, time_of};

pub(super) struct Rows {
    path: PathBuf,
    header: String,
    file: Option<File>,
    /// Bytes of the whole rows in it.
    length: u64,
    crc: Hasher,
    /// Rows that an interrupted run had written after its checkpoint. They stay until this run writes other
    /// rows there.
    beyond: Vec<u8>,
    samples: Samples,
    row: Vec<f64>,
}

/// A column of numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Its name, such as `reaction.base.x`.
    pub name: String,
    /// Its unit; empty for none.
    pub unit: &'static str,
}

/// Names and units of what a live run of a world samples.
pub fn sampled_columns(world: &World) -> Vec<Column> {
    Samples::new(world, &world.scene.sampled()).columns
}

/// The samples of a table at an instant: the energies of several participants together, then the samples of
/// each participant.
pub(crate) struct Samples {
    columns: Vec<Column>,
    /// True if the energies of all participants together come first.
    total: bool,
    parts: Vec<Columns>,
}

impl Samples {
    pub(crate) fn new(world: &World, table: &CsvTable) -> Self {
        let total = table.energy && world.participants.len() > 1;
        let mut columns: Vec<Column> = Vec::new();
        if total {
            columns.extend(ENERGIES.map(|energy| Column::of_energy(energy, None)));
        }
        let mut parts = Vec::new();
        for part in &world.participants {
            parts.push(Columns::new(part, table, &mut columns));
        }
        Self { columns, total, parts }
    }

    pub(crate) fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Adds the sample of an instant to a row.
    pub(crate) fn read(&mut self, frames: &[Frame<'_>], row: &mut Vec<f64>) {
        if self.total {
            row.extend(in_columns(&Energies::total(frames.iter().map(|frame| frame.now.energies()))));
        }
        self.parts.iter_mut().zip(frames).for_each(|(part, frame)| part.read(frame, row));
    }
}

/// Energies [J] in the order of [`ENERGIES`], and the balance.
pub(crate) fn in_columns(e: &Energies) -> [f64; 7] {
    [e.kinetic, e.internal, e.damping, e.external, e.hourglass, e.step_changes, e.balance]
}

impl Column {
    /// An energy, of a participant or of all.
    fn of_energy(energy: &str, part: Option<&str>) -> Self {
        let name = match part {
            Some(part) => format!("energy.{part}.{energy}"),
            None => format!("energy.{energy}"),
        };
        Self { name, unit: if energy == "balance" { "" } else { "J" } }
    }
}

/// The columns of one participant.
struct Columns {
    reactions: Vec<usize>,
    /// Constraints of volume.
    volumes: Vec<usize>,
    /// Contacts whose forces are columns: all contacts except self-contact, whose forces have no sum.
    contacts: Vec<usize>,
    /// Contacts of each tool and obstacle that has several.
    things: Vec<Vec<usize>>,
    /// The point [m] about which moments of reactions are taken, and the nodes and components of each
    /// constraint.
    moments: Option<([f64; 3], Vec<Held>)>,
    energy: bool,
    probes: Vec<Probe>,
    /// Fields of the triangles of shells, if a probe wants some.
    shells: fields::OfShells,
}

/// A point that is followed: the nodes that carry it, and the cell it lies in.
struct Probe {
    weights: Vec<(u32, f64)>,
    cell: Option<Place>,
    fields: Vec<FieldName>,
}

/// A cell of the model.
enum Place {
    /// A cell of a solid.
    Solid(usize, usize),
    /// A triangle of a shell.
    Facet(u32),
    /// A point of a surface that a shell carries.
    Carried(Carried, Vector3),
}

pub(crate) const ENERGIES: [&str; 7] =
    ["kinetic", "internal", "damping", "external", "hourglass", "step-changes", "balance"];
/// Parts of the internal energy of shells.
const SHELL_ENERGIES: [&str; 3] = ["membrane", "bending", "drilling"];
pub(crate) const AXES: [&str; 3] = ["x", "y", "z"];
/// Weights of a cell's nodes that are only round-off: the point coincides with other nodes.
const ROUNDING: f64 = 1e-9;
const TENSOR: [&str; 9] = ["xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"];

impl Columns {
    /// Its columns go to `columns`.
    fn new(part: &PlannedParticipant, table: &CsvTable, columns: &mut Vec<Column>) -> Self {
        let built = &*part.built;
        let wanted = |name: &String| table.reactions.as_ref().is_none_or(|list| list.contains(name));
        let constraints = built.model.constraints.iter();
        let wanted = constraints.enumerate().filter(|(_, c)| wanted(&c.name)).map(|(i, _)| i);
        let encloses = |&index: &usize| built.model.constraints[index].motion.encloses();
        let (volumes, reactions): (Vec<usize>, Vec<usize>) = wanted.partition(encloses);
        let mut add = |name: String, unit| columns.push(Column { name, unit });
        for &constraint in &reactions {
            let name = &built.model.constraints[constraint].name;
            AXES.iter().for_each(|axis| add(format!("reaction.{name}.{axis}"), "N"));
        }
        for &constraint in &volumes {
            let name = &built.model.constraints[constraint].name;
            add(format!("volume.{name}"), "m³");
            add(format!("pressure.{name}"), "Pa");
        }
        let contacts = built.contacts.as_ref().map_or(&[][..], |contacts| &contacts.contacts);
        let paired: Vec<usize> =
            (0..contacts.len()).filter(|&at| !matches!(contacts[at].with, With::Itself)).collect();
        for contact in paired.iter().map(|&at| &contacts[at]) {
            AXES.iter().for_each(|axis| add(format!("contact.{}.{axis}", contact.name), "N"));
        }
        let things = several_contacts(built);
        for (name, _) in &things {
            AXES.iter().for_each(|axis| add(format!("tool.{name}.{axis}"), "N"));
        }
        let things = things.into_iter().map(|(_, contacts)| contacts).collect();
        let moments = table.moments_about.map(|point| {
            for &constraint in &reactions {
                let name = &built.model.constraints[constraint].name;
                AXES.iter().for_each(|axis| add(format!("moment.{name}.{axis}"), "N m"));
            }
            (point, held(built, &reactions))
        });
        let shells = built.implicit.as_ref().is_some_and(|part| !part.model.facets.is_empty());
        if table.energy {
            let of_shells = SHELL_ENERGIES.into_iter().filter(|_| shells);
            columns
                .extend(ENERGIES.into_iter().chain(of_shells).map(|e| Column::of_energy(e, part.prefix())));
        }
        let mut add = |name: String, unit| columns.push(Column { name, unit });
        if built.implicit.as_ref().is_some_and(|part| part.control.is_some()) {
            add(part.prefix().map_or("load-factor".into(), |part| format!("load-factor.{part}")), "");
        }
        let probes = || table.probes.iter().filter(|(_, probe)| part.shows(Some(&probe.on)));
        for (name, probe) in probes() {
            for field in &probe.data {
                let column = format!("probe.{name}.{}", field.name());
                match field.components() {
                    1 => add(column, field.unit()),
                    3 => AXES.iter().for_each(|axis| add(format!("{column}.{axis}"), field.unit())),
                    _ => TENSOR.iter().for_each(|entry| add(format!("{column}.{entry}"), field.unit())),
                }
            }
        }
        let probes = probes().map(|(_, probe)| Probe::new(built, probe)).collect();
        let shells = fields::OfShells::default();
        Self { reactions, volumes, contacts: paired, things, moments, energy: table.energy, probes, shells }
    }

    /// Adds the sample of an instant to a row.
    fn read(&mut self, frame: &Frame<'_>, row: &mut Vec<f64>) {
        for &constraint in &self.reactions {
            row.extend(frame.now.reaction(constraint));
        }
        for &constraint in &self.volumes {
            let Enclosed { volume, pressure } = frame.now.enclosed(constraint).unwrap_or_default();
            row.extend([volume, pressure]);
        }
        if !self.contacts.is_empty() {
            let forces = frame.now.contact_forces();
            // No forces exist before the first evaluation.
            let force = |at: &usize| forces.get(*at).copied().unwrap_or_default();
            self.contacts.iter().for_each(|at| row.extend(force(at)));
            self.things.iter().for_each(|indices| row.extend(indices.iter().map(force).fold([0.0; 3], add)));
        }
        for (point, held) in
            self.moments.iter().flat_map(|(point, holders)| holders.iter().map(move |held| (point, held)))
        {
            row.extend(held.moment(frame, *point));
        }
        if self.energy {
            row.extend(in_columns(&frame.now.energies()));
        }
        if let (Some(part), Some(state)) = (&frame.built().implicit, frame.now.shells()) {
            if self.energy && !part.model.facets.is_empty() {
                // An element that has no energy ends the run with a reason.
                let parts = state.shell_energy(&part.model).unwrap_or_default();
                row.extend([parts.membrane, parts.bending, parts.drilling]);
            }
            if part.control.is_some() {
                row.push(state.load_factor);
            }
        }
        let of_cells: Vec<FieldName> =
            self.probes.iter().flat_map(|probe| &probe.fields).filter(|f| !f.is_nodal()).copied().collect();
        let cells_wanted = !of_cells.is_empty();
        let cells = cells_wanted.then(|| frame.cells()).flatten();
        if let (true, Some(part), Some(state)) = (cells_wanted, &frame.built().implicit, frame.now.shells()) {
            self.shells.fill(&part.model, state, &of_cells);
        }
        let of_nodes =
            fields::OfNodes::new(frame, self.probes.iter().flat_map(|probe| &probe.fields).copied());
        for probe in &self.probes {
            probe.read(frame, &of_nodes, cells, &self.shells, row);
        }
    }
}

/// Tools and obstacles with several contacts, by name.
fn several_contacts(built: &Built) -> Vec<(&str, Vec<usize>)> {
    let mut things: Vec<(&str, Vec<usize>)> = Vec::new();
    let Some(touching) = &built.contacts else { return things };
    for (contact, at) in touching.contacts.iter().zip(0..) {
        let With::Rigid(rigid) = contact.with else { continue };
        let name = touching.rigids[rigid].tool();
        match things.iter_mut().find(|(known, _)| *known == name) {
            Some((_, contacts)) => contacts.push(at),
            None => things.push((name, vec![at])),
        }
    }
    things.retain(|(_, contacts)| contacts.len() > 1);
    things
}

/// The nodes of a constraint, with the components that are its own: translations, of shells then rotations.
struct Held(Vec<(u32, [bool; 6])>);

/// Returns the held nodes and components of some constraints.
fn held(built: &Built, constraints: &[usize]) -> Vec<Held> {
    let model = &built.model;
    // Contradictions were reported before.
    let owners = model.constrained_components().unwrap_or_default();
    let of = |&index: &usize| {
        let constraint = &model.constraints[index];
        let [.., rx, ry, rz] = constraint.components;
        let owns = |node: u32| {
            let [x, y, z] = owners[node as usize].map(|owner| owner as usize == index);
            [x, y, z, rx, ry, rz]
        };
        Held(constraint.nodes.iter().map(|&node| (node, owns(node))).collect())
    };
    constraints.iter().map(of).collect()
}

impl Held {
    /// The moment [N m] of the forces and moments on the nodes about a point [m].
    fn moment(&self, frame: &Frame<'_>, point: [f64; 3]) -> [f64; 3] {
        let mut sum = Vector3::zeros();
        for &(node, owned) in &self.0 {
            let node = node as usize;
            let masked = |value: [f64; 3], first: usize| {
                Vector3::from_fn(|c, _| if owned[first + c] { value[c] } else { 0.0 })
            };
            let displacement = frame.now.displacement(node);
            let arm = Vector3::from(frame.built().model.rest[node]) + Vector3::from(displacement)
                - Vector3::from(point);
            sum += arm.cross(&masked(frame.now.nodal_reaction(node), 0));
            sum += masked(frame.now.nodal_reaction_moment(node), 3);
        }
        sum.into()
    }
}

impl Rows {
    pub(super) fn new(world: &World, table: &CsvTable, folder: &Path, name: &str) -> Self {
        let samples = Samples::new(world, table);
        let names = samples.columns().iter().map(|column| column.name.as_str());
        let header: Vec<&str> = std::iter::once("time").chain(names).collect();
        Self {
            path: folder.join(format!("{name}.csv")),
            header: header.join(","),
            file: None,
            length: 0,
            crc: Hasher::new(),
            beyond: Vec::new(),
            samples,
            row: Vec::new(),
        }
    }

    /// Begins the file with its header.
    pub(super) fn start(&mut self) -> Result<(), OutputError> {
        self.file = Some(create(&self.path).map_err(|error| self.failed(error))?);
        let header = self.header.clone();
        self.write(header)
    }

    /// Continues after the rows that an interrupted run had written at its checkpoint.
    pub(super) fn take_up(&mut self, bytes: u64, crc: u32) -> Result<(), OutputError> {
        let mut content = Vec::new();
        let opened = reopen(&self.path).and_then(|mut file| {
            file.read_to_end(&mut content)?;
            file.seek(SeekFrom::Start(bytes))?;
            Ok(file)
        });
        self.file = Some(opened.map_err(|error| self.failed(error))?);
        self.beyond = content.split_off((bytes as usize).min(content.len()));
        (self.length, self.crc) = (bytes, Hasher::new_with_initial_len(crc, bytes));
        Ok(())
    }

    /// The file.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    fn failed(&self, error: std::io::Error) -> OutputError {
        OutputError::new(&self.path, error)
    }

    /// Writes a row in one go; a row that does not fit on the disk leaves no part. A row that is there
    /// already is skipped; any other row is cut off with all later ones.
    fn write(&mut self, mut row: String) -> Result<(), OutputError> {
        row.push('\n');
        if self.beyond.starts_with(row.as_bytes()) {
            self.beyond.drain(..row.len());
        } else {
            self.cut()?;
            let Some(file) = &mut self.file else { return Ok(()) };
            let written =
                file.seek(SeekFrom::Start(self.length)).and_then(|_| file.write_all(row.as_bytes()));
            if let Err(error) = written {
                let _ = file.set_len(self.length);
                return Err(self.failed(error));
            }
        }
        self.length += row.len() as u64;
        self.crc.update(row.as_bytes());
        Ok(())
    }

    /// Ends the file after the rows of this run.
    fn cut(&mut self) -> Result<(), OutputError> {
        if !std::mem::take(&mut self.beyond).is_empty()
            && let Some(file) = &self.file
        {
            file.set_len(self.length).map_err(|error| self.failed(error))?;
        }
        Ok(())
    }
}

/// Returns the place [m] of a point of a surface on a shell.
fn carried(frame: &Frame<'_>, point: &Carried) -> Vector3 {
    let part = frame.built().implicit.as_ref();
    let found =
        part.and_then(|part| Some(part.surface.as_ref()?.carried(&part.model, frame.now.shells()?, point)));
    found.unwrap_or_else(|| Vector3::repeat(f64::NAN))
}

/// Checks that a table begins with these bytes; returns the reason if not.
pub(super) fn verify(path: &Path, bytes: u64, crc: u32) -> Result<(), String> {
    let content = fs::read(path).map_err(|error| error.to_string())?;
    match content.get(..bytes as usize) {
        None => Err(format!("it has {} bytes, and had {bytes} at the checkpoint", content.len())),
        Some(rows) if crc32fast::hash(rows) != crc => {
            Err("its rows up to the checkpoint differ from the rows of the interrupted run".into())
        }
        Some(_) => Ok(()),
    }
}

/// The time [s] of the last row of a table, if it is whole.
pub(super) fn last_time(path: &Path) -> Option<f64> {
    let text = fs::read_to_string(path).ok()?;
    text.strip_suffix('\n')?.lines().next_back()?.split(',').next()?.parse().ok()
}

impl Output for Rows {
    fn see(&mut self, frames: &[Frame<'_>]) -> Result<(), OutputError> {
        self.row.clear();
        self.row.push(time_of(frames));
        self.samples.read(frames, &mut self.row);
        let row: Vec<String> = self.row.iter().map(|value| format!("{value:e}")).collect();
        self.write(row.join(","))
    }

    fn written(&self) -> Written {
        Written::Rows { bytes: self.length, crc: self.crc.clone().finalize() }
    }

    fn finish(&mut self) -> Result<(), OutputError> {
        self.cut()
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
            let carried = built.implicit.as_ref().and_then(|part| part.model.carried.get(&surface));
            if let Some(points) = carried {
                let cell = Some(Place::Carried(points[nearest], mesh.points[nearest]));
                return Self { weights: Vec::new(), cell, fields };
            }
            let row = built.model.surfaces[surface].mapping.row(nearest);
            return Self { weights: row.collect(), cell: None, fields };
        }
        let body = built.bodies.iter().position(|body| body.name == table.on).unwrap_or(0);
        let numbered = &built.model.bodies[body];
        let Some(location) = built.bodies[body].locator().locate(&point) else {
            return Self { weights: Vec::new(), cell: None, fields };
        };
        let weights = location.weights.iter().map(|&(node, weight)| (numbered.node(node), weight)).collect();
        if let Some(BodyCells::Facets(range)) = built.implicit.as_ref().map(|part| &part.cells[body]) {
            return Self { weights, cell: Some(Place::Facet(range.start + location.cell)), fields };
        }
        let cell = built.model.solids.iter().enumerate().find_map(|(index, solid)| {
            let fits = solid.body == body && solid.cells.nodes_per_cell() == location.kind.node_count();
            let cell = solid.original.iter().position(|&original| fits && original == location.cell)?;
            Some(Place::Solid(index, cell))
        });
        Self { weights, cell, fields }
    }

    fn read(
        &self,
        frame: &Frame<'_>,
        of_nodes: &fields::OfNodes<'_, '_>,
        cells: Option<&Recovered<'_>>,
        shells: &fields::OfShells,
        row: &mut Vec<f64>,
    ) {
        let recovered = cells.zip(self.cell.as_ref()).and_then(|(cells, place)| match *place {
            Place::Solid(solid, cell) => {
                Some(cells.at(solid, cell, self.fields.contains(&FieldName::ElementStep)))
            }
            Place::Facet(_) | Place::Carried(..) => None,
        });
        for &field in &self.fields {
            let mut value = [0.0; 9];
            if let Some(Place::Carried(point, rest)) = &self.cell {
                value[..3].copy_from_slice((carried(frame, point) - rest).as_slice());
            } else if field.is_nodal() {
                for &(node, weight) in &self.weights {
                    let nodal = of_nodes.value(field, node as usize);
                    for (v, n) in value.iter_mut().zip(nodal) {
                        // A node without a value counts where the point is not on another one.
                        if !n.is_nan() || weight.abs() > ROUNDING {
                            *v += weight * n;
                        }
                    }
                }
            } else {
                value = match (&recovered, &self.cell, &frame.built().implicit) {
                    (Some(cell), ..) => fields::of_cell(cell, field),
                    (_, Some(Place::Facet(facet)), Some(part)) => shells.of(&part.model, *facet, field),
                    _ => [f64::NAN; 9],
                };
            }
            row.extend_from_slice(&value[..field.components()]);
        }
    }
}
