//! The scene and its meshes, as a user could have written them.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use pliant_geometry::{DataArray, Mesh};

use super::Imported;
use super::conditions::{Action, Condition};
use super::error::Fault;
use super::geometry::Solid;
use super::material::{Elastic, Material};
use super::parts::{Model, Output, SubModel};
use super::shells::{Membrane, MembraneLaw};
use super::touching::Touching;
use super::writer::{Faces, Writer, add_faces};

/// Greatest multiple of the shear modulus that a scene takes as hourglass stiffness.
const MOST_HOURGLASS: f64 = 10.0;
/// Frames of a model that requests no output.
const FRAMES: f64 = 20.0;

/// Writes a model read from the file `stem`.xml.
pub(super) fn write(model: Model, stem: &str) -> Result<Imported, Fault> {
    let Model { parts, materials, contact, system, output, remarks } = model;
    let mut writer = Writer {
        system,
        laws: materials,
        tables: String::new(),
        notes: remarks.notes,
        missing: remarks.missing,
        numbers: BTreeMap::new(),
        files: Vec::new(),
    };
    let stem = plain(stem);
    let mut meshes = Vec::new();
    let several = parts.len() > 1;
    let mut touching = Touching::new(contact, several);
    let mut first = 0;
    for (index, part) in parts.into_iter().enumerate() {
        let (body, file) = match several {
            true => (format!("part-{index}"), format!("{stem}-part-{index}.vtu")),
            false => ("model".to_owned(), format!("{stem}.vtu")),
        };
        let count = part.geometry.node_count() as u32;
        meshes.push((file.clone(), writer.part(part, &body, &file, (&mut touching, first))));
        first += count;
    }
    meshes.extend(writer.contact(touching, &stem));
    writer.note_laws();
    writer.outputs(output.as_ref());
    Ok(writer.finish(&stem, meshes))
}

/// Cells of one material and density.
struct Region {
    label: u32,
    material: u32,
    density: f64,
}

impl Region {
    fn holds(&self, (&material, &density): (&u32, &f64)) -> bool {
        (self.material, self.density) == (material, density)
    }
}

/// The regions of a part. Their labels are the numbers of the materials, unless one has several densities.
fn regions(part: &SubModel) -> Vec<Region> {
    // Densities are positive: their bits are in the order of their values.
    let pairs: BTreeSet<(u32, u64)> = part
        .material
        .iter()
        .zip(&part.density)
        .map(|(&material, density)| (material, density.to_bits()))
        .collect();
    let materials: BTreeSet<u32> = pairs.iter().map(|&(material, _)| material).collect();
    let label = |at: u32, material| if materials.len() == pairs.len() { material } else { at };
    let region = |(at, &(material, bits)): (u32, &(u32, u64))| Region {
        label: label(at, material),
        material,
        density: f64::from_bits(bits),
    };
    (0..).zip(&pairs).map(region).collect()
}

/// A value for each label, or one for all where they do not differ.
fn by_label(regions: &[Region], value: impl Fn(&Region) -> String) -> String {
    let values: Vec<String> = regions.iter().map(value).collect();
    if values.iter().all(|value| *value == values[0]) {
        return values[0].clone();
    }
    let entries: Vec<String> =
        regions.iter().zip(values).map(|(region, value)| format!("{} = {value}", region.label)).collect();
    format!("{{ {} }}", entries.join(", "))
}

impl Writer {
    /// Builds the mesh of a part and writes its tables. The nodes of the part begin at a number of the whole
    /// model.
    fn part(
        &mut self,
        part: SubModel,
        body: &str,
        file: &str,
        (touching, first): (&mut Touching, u32),
    ) -> Mesh {
        let regions = regions(&part);
        let hourglass = self.hourglass(&part, &regions, body);
        let pieces = if touching.asks_for_pieces() { part.geometry.piece_count() } else { 1 };
        let mut mesh = part.geometry.mesh;
        let solid = part.geometry.solid;
        if regions.len() > 1 {
            let label = |cell: (&u32, &f64)| {
                regions.iter().find(|region| region.holds(cell)).map_or(0, |region| region.label)
            };
            let labels = part.material.iter().zip(&part.density).map(|cell| f64::from(label(cell))).collect();
            mesh.block_mut(solid.cell()).data.insert("label".into(), DataArray::scalar(labels));
        }
        self.line(format!("[body.{body}]"));
        self.line(format!("mesh = {{ file = \"{file}\", scale = 1 }}"));
        self.line(format!("element = \"{}\"", solid.element()));
        self.line(format!(
            "law = {}",
            by_label(&regions, |region| format!("\"material-{}\"", region.material))
        ));
        self.line(format!("density = {}", by_label(&regions, |region| format!("{:?}", region.density))));
        self.line(format!("damping = {:?}", self.system.damping));
        if let Some(hourglass) = hourglass {
            self.line(format!("hourglass = {hourglass}"));
        }
        self.line(String::new());
        if solid == Solid::T4Anp {
            self.note(
                "T4ANP: NiftySim's own average of nodal pressures is kept; `tet4-anp` is the better element",
            );
        }
        let whole = mesh.points.len();
        for condition in part.conditions {
            self.condition(condition, body, solid, whole, &mut mesh);
        }
        for membrane in part.membranes {
            self.membrane(membrane, body, solid, &mut mesh);
        }
        touching.body(self, body, pieces, first, solid, &mut mesh);
        let dropped = mesh.drop_unused_points();
        if dropped > 0 {
            self.notes.push(format!(
                "`{body}`: {dropped} nodes that no element uses were dropped; later ones are renumbered"
            ));
        }
        mesh
    }

    /// The multiple of the shear modulus by which hexahedra resist hourglass patterns, as written in the
    /// scene.
    fn hourglass(&mut self, part: &SubModel, regions: &[Region], body: &str) -> Option<String> {
        let coefficient = self.system.hourglass.filter(|_| part.geometry.solid == Solid::H8)?;
        let of = |region: &Region| self.laws[region.material as usize].elastic.hourglass(coefficient);
        let values: Vec<f64> = regions.iter().map(of).collect();
        let written = by_label(regions, |region| format!("{:?}", of(region)));
        let largest = values.iter().copied().fold(0.0, f64::max);
        let least = values.iter().copied().fold(largest, f64::min);
        let range =
            if least < largest { format!("{least:.4} to {largest:.4}") } else { format!("{largest:.4}") };
        self.notes.push(format!(
            "`{body}`: NiftySim's hourglass stiffness is {coefficient} (λ + 2μ), which is {range} μ; 0.2 μ is more accurate in bending"
        ));
        if largest > MOST_HOURGLASS {
            self.notes.push(format!(
                "`{body}`: hourglass = {largest:.4} is above {MOST_HOURGLASS}, the largest that a scene allows"
            ));
        }
        Some(written)
    }

    /// A wall on the boundary of a body.
    fn membrane(&mut self, membrane: Membrane, body: &str, solid: Solid, mesh: &mut Mesh) {
        let name = self.numbered("membrane");
        let Membrane { line, law, density, thickness, faces } = membrane;
        let found = add_faces(mesh, solid, &name, &faces);
        if found.inside > 0 {
            let inside = found.inside;
            self.missing.push(format!(
                "{inside} of the shells of line {line} (not on the boundary, where membranes must lie)"
            ));
        }
        if found.outside == 0 {
            return;
        }
        if matches!(law, MembraneLaw::Linear(_)) {
            self.note(
                "membranes Linear: NiftySim's are linear in the displacements, with axes that do not turn; the scene's agree \
                 for small displacements, and are right for large ones, too",
            );
        }
        self.line(format!("[law.{name}]"));
        law.lines().into_iter().for_each(|line| self.line(line));
        self.line(String::new());
        self.line(format!("[body.{name}]"));
        self.line("model = \"membrane\"".into());
        self.line(format!("on = \"{body}\""));
        if !found.whole {
            self.line(format!("faces = {{ set = \"{name}\" }}"));
        }
        self.line(format!("law = \"{name}\""));
        self.line(format!("density = {density:?}"));
        self.line(format!("thickness = {thickness:?}"));
        self.line(String::new());
    }

    fn condition(&mut self, condition: Condition, body: &str, solid: Solid, whole: usize, mesh: &mut Mesh) {
        let (kind, name) = match condition.action {
            Action::Fix(_) => ("constraint", "fix"),
            Action::Move(_) => ("constraint", "move"),
            Action::Force(_) => ("load", "force"),
            Action::Gravity(_) => ("load", "gravity"),
            Action::Pressure(_) => ("load", "pressure"),
            Action::Traction(_) => ("load", "traction"),
        };
        let set = self.numbered(name);
        let Some(selection) = self.selection(&condition, &set, solid, whole, mesh) else { return };
        self.line(format!("[{kind}.{set}]"));
        self.line(format!("type = \"{name}\""));
        self.line(format!("{} = \"{body}\"", if kind == "constraint" { "body" } else { "on" }));
        if !selection.is_empty() {
            self.line(selection);
        }
        if !condition.values.is_empty() {
            let mut data = vec![[0.0; 3]; whole];
            for (&node, value) in condition.nodes.iter().zip(&condition.values) {
                data[node as usize] = *value;
            }
            mesh.point_data.insert(set.clone(), DataArray { components: 3, values: data.concat() });
        }
        self.action(&condition, &set);
        if !matches!(condition.action, Action::Fix(_)) {
            let moves = matches!(condition.action, Action::Move(_));
            self.curve(condition.shape, moves);
        }
        self.line(String::new());
    }

    /// The line that says where a condition acts, empty for all of a body; `None` if it acts nowhere.
    fn selection(
        &mut self,
        condition: &Condition,
        set: &str,
        solid: Solid,
        whole: usize,
        mesh: &mut Mesh,
    ) -> Option<String> {
        if matches!(condition.action, Action::Gravity(_)) && condition.nodes.len() == whole {
            return Some(String::new());
        }
        if condition.faces.is_empty() {
            if condition.nodes.len() == whole {
                return Some("nodes = \"all\"".into());
            }
            mesh.point_sets.insert(set.to_owned(), condition.nodes.clone());
            return Some(format!("nodes = {{ set = \"{set}\" }}"));
        }
        let found = add_faces(mesh, solid, set, &condition.faces);
        if found.inside > 0 {
            let (inside, line) = (found.inside, condition.line);
            self.missing.push(format!("{inside} faces of line {line}, which are no longer on the boundary"));
        }
        match found {
            Faces { outside: 0, .. } => None,
            Faces { whole: true, .. } => Some("faces = \"boundary\"".into()),
            _ => Some(format!("faces = {{ set = \"{set}\" }}")),
        }
    }

    fn action(&mut self, condition: &Condition, set: &str) {
        let vector = |v: [f64; 3]| match condition.values.is_empty() {
            true => format!("{v:?}"),
            false => format!("{{ point-data = \"{set}\" }}"),
        };
        match condition.action {
            Action::Fix(held) => self.components(held),
            Action::Move(by) => {
                self.components(by.map(|by| by.is_some()));
                self.line(format!("by = {}", vector(by.map(|by| by.unwrap_or(0.0)))));
            }
            Action::Force(force) => self.line(format!("each = {}", vector(force))),
            Action::Gravity(acceleration) => self.line(format!("acceleration = {}", vector(acceleration))),
            Action::Pressure(pressure) => {
                self.note(
                    "Pressure: NiftySim takes areas and normals of the step before, the scene takes the current ones",
                );
                self.line(format!("pressure = {pressure:?}"));
            }
            Action::Traction(traction) => {
                self.note(
                    "Traction: NiftySim pulls against the given vector; the scene's vector has the opposite sign",
                );
                self.note(
                    "Traction: NiftySim's force grows with the area of the deformed faces, the scene's force does not",
                );
                self.line(format!("traction = {}", vector(traction)));
            }
        }
    }

    fn components(&mut self, components: [bool; 3]) {
        if components != [true; 3] {
            let names = ["\"x\"", "\"y\"", "\"z\""].into_iter().zip(components);
            let names: Vec<&str> = names.filter(|(_, held)| *held).map(|(name, _)| name).collect();
            self.line(format!("components = [{}]", names.join(", ")));
        }
    }

    fn note_laws(&mut self) {
        if self.laws.iter().any(|law| matches!(law.elastic, Elastic::TransverselyIsotropic(..))) {
            self.note("TI, TIV: η is the published modulus, half of which is in the energy: `convention = \"taylor\"`");
        }
        if self.laws.iter().any(Material::relaxes) {
            self.note(
                "NHV, TIV: relaxation advances by backward Euler, as in NiftySim; `exact` is more accurate",
            );
        }
    }

    fn outputs(&mut self, output: Option<&Output>) {
        let has = |name: &str| output.is_some_and(|output| output.variables.iter().any(|v| v == name));
        let every = match output {
            Some(output) => {
                self.note("NiftySim's outputs are one step later than their number says: its last output is the scene's last");
                output.every as f64 * self.system.step
            }
            None => {
                self.note("the model asks for no output: displacements are written twenty times");
                self.system.end() / FRAMES
            }
        };
        let mut fields = Vec::new();
        if output.is_none() || has("U") {
            fields.push("\"displacement\"");
        }
        if has("S") {
            fields.push("\"pk2-stress\"");
        }
        if has("E") {
            fields.push("\"green-strain\"");
        }
        if !fields.is_empty() {
            self.line("[output.fields]".into());
            self.line("type = \"vtu\"".into());
            self.line(format!("every = {every:?}"));
            self.line(format!("data = [{}]", fields.join(", ")));
            self.line(String::new());
        }
        if has("F") || has("EKin") || has("EStrain") {
            if has("F") {
                self.note(
                    "F: the scene writes the forces that hold constraints, not the internal forces of every node",
                );
            }
            self.line("[output.table]".into());
            self.line("type = \"csv\"".into());
            self.line(format!("every = {every:?}"));
            self.line(format!("energy = {}", has("EKin") || has("EStrain")));
            self.line(String::new());
        }
    }

    fn finish(mut self, stem: &str, meshes: Vec<(String, Mesh)>) -> Imported {
        if !self.missing.is_empty() {
            self.notes.push(format!("left out, as it is not supported: {}", self.missing.join("; ")));
        }
        let mut scene = format!("# The NiftySim model {stem}.xml.\n");
        for note in &self.notes {
            wrap(&mut scene, &note.replace(char::is_control, " "));
        }
        let (step, total, until) = (self.system.step, self.system.total, self.system.end());
        // Writing to a string does not fail.
        let _ = write!(
            scene,
            "\n[scene]\ntitle = \"{stem}\"\nuntil = {until:?}  # the total time {total:?} s and NiftySim's last step\n\n\
             [run]\nprecision = \"single\"  # as NiftySim\nstep = {step:?}\n\
             on-unstable = \"report\"  # NiftySim continues at the same step\n\n"
        );
        for (index, law) in self.laws.iter().enumerate() {
            let _ = writeln!(scene, "[law.material-{index}]\n{}\n", law.lines().join("\n"));
        }
        scene.push_str(self.tables.trim_end());
        scene.push('\n');
        Imported { scene, meshes, tables: self.files, notes: self.notes, missing: self.missing }
    }
}

/// A file name's stem as letters, digits, `-` and `_`.
fn plain(stem: &str) -> String {
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    let plain: String = stem.chars().map(|c| if fits(c) { c } else { '-' }).collect();
    if plain.is_empty() { "model".to_owned() } else { plain }
}

/// A comment in lines of at most 100 characters.
fn wrap(text: &mut String, note: &str) {
    let mut length = 0;
    for (index, word) in note.split_whitespace().enumerate() {
        let (space, begin) = if index == 0 { ("# * ", true) } else { (" ", false) };
        let width = word.chars().count() + 1;
        if !begin && length + width > 100 {
            text.push_str("\n#   ");
            length = 4;
        } else {
            text.push_str(space);
            length += if begin { 4 } else { 1 };
        }
        text.push_str(word);
        length += width - 1;
    }
    text.push('\n');
}
