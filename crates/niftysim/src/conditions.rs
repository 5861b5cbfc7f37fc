//! Constraints and loads of NiftySim, all of which it calls constraints: on which nodes or faces, how much,
//! and how they grow.

use std::collections::{BTreeMap, BTreeSet};

use pliant_geometry::{Selection, Surface, Vector3, boundary, vector_area};

use super::error::{Fault, ImportProblem};
use super::geometry::Geometry;
use super::xml::{
    XmlElement, attribute, attribute_number, child, children, count, fault, indices, line, needed, number,
    numbers, numbers_of, run_of_indices,
};

/// Growth of a load with t/T, T the total time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LoadShape {
    /// 10s³ − 15s⁴ + 6s⁵.
    Polynomial,
    /// s.
    Ramp,
    /// s/0.1, at most 1.
    RampHold,
    /// 1.
    Step,
    /// s exp(cos 4πs − 1).
    Hilly,
}

/// Action of a constraint of NiftySim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Action {
    /// Holds components.
    Fix([bool; 3]),
    /// Displaces components [m].
    Move([Option<f64>; 3]),
    /// Pushes every node [N].
    Force([f64; 3]),
    /// Accelerates everything [m/s²].
    Gravity([f64; 3]),
    /// Pushes faces inwards [Pa].
    Pressure(f64),
    /// Pulls faces, as a scene counts it [Pa].
    Traction([f64; 3]),
}

/// A constraint of NiftySim, or the part of one that is the same everywhere.
#[derive(Clone, Debug)]
pub(super) struct Condition {
    /// Its line in the XML.
    pub line: u32,
    pub action: Action,
    pub shape: LoadShape,
    /// Its nodes, increasing; empty for faces.
    pub nodes: Vec<u32>,
    /// The vector of each node where they differ; `action` then says which components act.
    pub values: Vec<[f64; 3]>,
    /// Nodes of its faces; empty for nodes.
    pub faces: Vec<Vec<u32>>,
}

/// Remarks from reading the conditions.
#[derive(Debug, Default)]
pub(super) struct Remarks {
    pub notes: Vec<String>,
    /// Parts of the model that were left out.
    pub missing: Vec<String>,
}

/// Reads all `<Constraint>` of a model or submodel.
pub(super) fn read(
    of: XmlElement<'_>,
    geometry: &Geometry,
    remarks: &mut Remarks,
) -> Result<Vec<Condition>, Fault> {
    if child(of, "Constraint").is_none() {
        return Ok(Vec::new());
    }
    let surface = boundary(&geometry.mesh);
    let mut reader = ConditionReader { geometry, surface, remarks };
    let mut conditions = Vec::new();
    for constraint in children(of, "Constraint") {
        conditions.extend(reader.constraint(constraint)?);
    }
    Ok(conditions)
}

struct ConditionReader<'r> {
    geometry: &'r Geometry,
    surface: Surface,
    remarks: &'r mut Remarks,
}

const TYPES: &str = "Type=\"Fix\", \"Disp\", \"Force\", \"Gravity\", \"Pressure\" or \"Traction\"";

impl ConditionReader<'_> {
    fn constraint(&mut self, of: XmlElement<'_>) -> Result<Vec<Condition>, Fault> {
        match attribute(of, "Type", TYPES)? {
            "Fix" => {
                let components = components(of)?;
                let action = Action::Fix(components);
                Ok(self.on_nodes(of, action, LoadShape::Step, sorted(self.nodes(of)?)))
            }
            "Disp" => self.valued(of, |value, components| {
                Action::Move(components.map(|component| component.then_some(value)))
            }),
            "Force" => self.valued(of, |value, components| {
                Action::Force(components.map(|component| if component { value } else { 0.0 }))
            }),
            "Gravity" => self.gravity(of),
            "Pressure" => self.pressure(of),
            "Traction" => self.traction(of),
            other => {
                let (what, known) = ("type of constraint", "Fix, Disp, Force, Gravity, Pressure, Traction");
                Err(fault(of, ImportProblem::Unknown { what, found: other.into(), known }))
            }
        }
    }

    fn on_nodes(
        &self,
        of: XmlElement<'_>,
        action: Action,
        shape: LoadShape,
        nodes: Vec<u32>,
    ) -> Vec<Condition> {
        if nodes.is_empty() {
            return Vec::new();
        }
        vec![Condition { line: line(of), action, shape, nodes, values: Vec::new(), faces: Vec::new() }]
    }

    /// Reads a displacement or force as one condition for each different magnitude.
    fn valued(
        &mut self,
        of: XmlElement<'_>,
        action: impl Fn(f64, [bool; 3]) -> Action,
    ) -> Result<Vec<Condition>, Fault> {
        let components = components(of)?;
        let shape = self.shape(of)?;
        let nodes = self.nodes(of)?;
        if let Some(node) = repeated(&nodes) {
            let what = format!("node {node} is listed twice, which NiftySim adds up");
            return Err(fault(of, ImportProblem::Contradiction { what, remedy: "list it once" }));
        }
        let magnitudes = needed(of, "Magnitudes", "<Magnitudes Type=\"UNIFORM\">0.01</Magnitudes>")?;
        let values = match attribute(magnitudes, "Type", "Type=\"UNIFORM\" or \"DIFFORM\"")? {
            "UNIFORM" => vec![number(magnitudes)?; nodes.len()],
            "DIFFORM" => numbers(magnitudes)?,
            "FILE" => {
                self.leave_out(of, "magnitudes from a file");
                return Ok(Vec::new());
            }
            other => {
                let (what, known) = ("type of magnitudes", "UNIFORM, DIFFORM, FILE");
                return Err(fault(magnitudes, ImportProblem::Unknown { what, found: other.into(), known }));
            }
        };
        if values.len() != nodes.len() {
            let wanted = format!("{}, one for each node", nodes.len());
            let problem = ImportProblem::Count { what: "magnitudes", found: values.len(), wanted };
            return Err(fault(magnitudes, problem));
        }
        let mut groups: BTreeMap<u64, (f64, Vec<u32>)> = BTreeMap::new();
        for (&value, &node) in values.iter().zip(&nodes) {
            groups.entry(value.to_bits()).or_insert((value, Vec::new())).1.push(node);
        }
        let conditions = groups
            .into_values()
            .flat_map(|(value, nodes)| self.on_nodes(of, action(value, components), shape, sorted(nodes)));
        Ok(conditions.collect())
    }

    fn gravity(&mut self, of: XmlElement<'_>) -> Result<Vec<Condition>, Fault> {
        let shape = self.shape(of)?;
        let nodes = sorted(self.nodes(of)?);
        let magnitude =
            needed(of, "AccelerationMagnitude", "<AccelerationMagnitude>9.81</AccelerationMagnitude>")?;
        let magnitude = number(magnitude)?;
        let along =
            needed(of, "AccelerationDirection", "<AccelerationDirection>0 0 -1</AccelerationDirection>")?;
        let direction = Vector3::from(numbers_of::<3>(along, "components")?);
        let Some(direction) = direction.try_normalize(0.0) else {
            let (what, range) = ("the length of the direction", "greater than 0");
            return Err(fault(along, ImportProblem::OutOfRange { what, value: 0.0, range }));
        };
        Ok(self.on_nodes(of, Action::Gravity((direction * magnitude).into()), shape, nodes))
    }

    fn pressure(&mut self, of: XmlElement<'_>) -> Result<Vec<Condition>, Fault> {
        let shape = self.shape(of)?;
        let pressure = number(needed(of, "Magnitude", "<Magnitude>100</Magnitude>")?)?;
        let [outward, inward] = self.faces(of)?;
        let both = [(outward, pressure), (inward, -pressure)];
        let condition = |(faces, pressure): (Vec<Vec<u32>>, f64)| {
            let action = Action::Pressure(pressure);
            let (nodes, values) = (Vec::new(), Vec::new());
            (!faces.is_empty()).then(|| Condition { line: line(of), action, shape, nodes, values, faces })
        };
        Ok(both.into_iter().filter_map(condition).collect())
    }

    fn traction(&mut self, of: XmlElement<'_>) -> Result<Vec<Condition>, Fault> {
        let shape = self.shape(of)?;
        let magnitudes = needed(of, "Magnitudes", "<Magnitudes Type=\"UNIFORM\">0 0 100</Magnitudes>")?;
        match attribute(magnitudes, "Type", "Type=\"UNIFORM\"")? {
            "UNIFORM" => {
                let traction = numbers_of::<3>(magnitudes, "components of the traction")?;
                let [mut faces, inward] = self.faces(of)?;
                faces.extend(inward);
                if faces.is_empty() {
                    return Ok(Vec::new());
                }
                let (action, nodes, values) = (Action::Traction(against(traction)), Vec::new(), Vec::new());
                Ok(vec![Condition { line: line(of), action, shape, nodes, values, faces }])
            }
            "DIFFORM" => self.traction_of_each_face(of, magnitudes, shape),
            other => {
                let (what, known) = ("type of magnitudes", "UNIFORM, DIFFORM");
                Err(fault(magnitudes, ImportProblem::Unknown { what, found: other.into(), known }))
            }
        }
    }

    /// The forces on the nodes of faces that each have their own traction.
    fn traction_of_each_face(
        &mut self,
        of: XmlElement<'_>,
        magnitudes: XmlElement<'_>,
        shape: LoadShape,
    ) -> Result<Vec<Condition>, Fault> {
        let faces = self.listed_faces(of)?;
        let tractions = numbers(magnitudes)?;
        if tractions.len() != 3 * faces.len() {
            let wanted = format!("{}, three for each face", 3 * faces.len());
            let problem = ImportProblem::Count { what: "magnitudes", found: tractions.len(), wanted };
            return Err(fault(magnitudes, problem));
        }
        let points = &self.geometry.mesh.points;
        let mut forces: BTreeMap<u32, [f64; 3]> = BTreeMap::new();
        for (face, traction) in faces.iter().zip(tractions.chunks_exact(3)) {
            let corners: Vec<Vector3> = face.iter().map(|&node| points[node as usize]).collect();
            let share = vector_area(&corners).norm() / face.len() as f64;
            for &node in face {
                let force = forces.entry(node).or_default();
                (0..3).for_each(|c| force[c] -= share * traction[c]);
            }
        }
        self.remarks.notes.push(format!(
            "the tractions of line {}, one for each face, became forces on nodes with the opposite sign, as NiftySim pulls \
             against the vector; these forces do not grow with the area of the deformed faces",
            line(of)
        ));
        let force = |(node, force)| self.on_nodes(of, Action::Force(force), shape, vec![node]);
        Ok(forces.into_iter().flat_map(force).collect())
    }

    fn leave_out(&mut self, of: XmlElement<'_>, what: &str) {
        let kind = of.attribute("Type").unwrap_or_default();
        self.remarks.missing.push(format!("the {kind} of line {} ({what})", line(of)));
    }

    fn shape(&mut self, of: XmlElement<'_>) -> Result<LoadShape, Fault> {
        Ok(match of.attribute("LoadShape").map(str::trim) {
            Some("POLY345") => LoadShape::Polynomial,
            Some("RAMP") => LoadShape::Ramp,
            Some("RAMPHOLD") => LoadShape::RampHold,
            Some("STEP") => LoadShape::Step,
            Some("HILLY") => LoadShape::Hilly,
            other => {
                let found =
                    other.map_or("has no load shape".into(), |word| format!("has load shape `{word}`"));
                let note = format!("the constraint of line {} {found}: treated as POLY345", line(of));
                self.remarks.notes.push(note);
                LoadShape::Polynomial
            }
        })
    }

    /// The nodes of a constraint in the order in which they are listed.
    fn nodes(&self, of: XmlElement<'_>) -> Result<Vec<u32>, Fault> {
        let limit = self.geometry.node_count();
        if of.attribute("SpecType").map(str::trim) == Some("NORMAL") {
            let mut selection = self.normal(of)?;
            for restriction in children(of, "RestrictTo") {
                selection = Selection::Intersection(vec![selection, region(restriction)?]);
            }
            let nodes = selection.nodes(&self.geometry.mesh, &self.surface);
            return nodes.map_err(|error| fault(of, ImportProblem::Selection(Box::new(error))));
        }
        let size = match of.attribute("NumNodes").map(str::trim) {
            Some("all") => return Ok((0..limit as u32).collect()),
            Some(word) => Some(count(of, word)?),
            None => None,
        };
        if size == Some(0) {
            return Ok(Vec::new());
        }
        let nodes = needed(of, "Nodes", "<Nodes>0 1 2</Nodes> or SpecType=\"NORMAL\"")?;
        let listed = indices(nodes, "node", limit)?;
        let size = size.unwrap_or(listed.len());
        run_of_indices(nodes, listed, size, "node", "nodes", limit)
    }

    fn normal(&self, of: XmlElement<'_>) -> Result<Selection, Fault> {
        let normal = needed(of, "Normal", "<Normal ToleranceAngle=\"5\">0 0 1</Normal>")?;
        let within = attribute(normal, "ToleranceAngle", "ToleranceAngle=\"5\" (degrees)")?;
        let within = attribute_number(normal, within)?;
        Ok(Selection::Normal { direction: numbers_of::<3>(normal, "components")?, within })
    }

    /// The faces of a constraint that lie on the boundary, each turned outwards. Faces listed outwards come
    /// first, then faces listed inwards.
    fn faces(&mut self, of: XmlElement<'_>) -> Result<[Vec<Vec<u32>>; 2], Fault> {
        let listed = self.listed_faces(of)?;
        Ok(self.turn_outwards(of, &listed))
    }

    /// The nodes of the faces of a constraint, in their order.
    fn listed_faces(&mut self, of: XmlElement<'_>) -> Result<Vec<Vec<u32>>, Fault> {
        let nodes_of = |faces: &mut dyn Iterator<Item = usize>| -> Vec<Vec<u32>> {
            faces.map(|face| self.surface.faces[face].nodes().to_vec()).collect()
        };
        if of.attribute("SpecType").map(str::trim) == Some("NORMAL") {
            let chosen = self.normal(of)?.faces(&self.geometry.mesh, &self.surface);
            let chosen = chosen.map_err(|error| fault(of, ImportProblem::Selection(Box::new(error))))?;
            let faces = nodes_of(&mut chosen.iter().map(|&face| face as usize));
            if child(of, "RestrictTo").is_some() {
                let note = format!(
                    "line {}: NiftySim restricts nodes only, not faces: <RestrictTo> ignored",
                    line(of)
                );
                self.remarks.notes.push(note);
            }
            return Ok(faces);
        }
        let size = match attribute(of, "NumFaces", "NumFaces=\"all\" or a number")? {
            "all" => return Ok(nodes_of(&mut (0..self.surface.faces.len()))),
            word => count(of, word)?,
        };
        let corners = match attribute(of, "FaceType", "FaceType=\"Tri\" or \"Quad\"")? {
            "Tri" => 3,
            "Quad" => 4,
            other => {
                let (what, known) = ("type of face", "Tri, Quad");
                return Err(fault(of, ImportProblem::Unknown { what, found: other.into(), known }));
            }
        };
        let list = needed(of, "Faces", "<Faces>0 1 2</Faces>")?;
        let listed = indices(list, "node", self.geometry.node_count())?;
        if size.checked_mul(corners) != Some(listed.len()) {
            let wanted = format!("{size} × {corners}");
            let problem = ImportProblem::Count { what: "nodes of faces", found: listed.len(), wanted };
            return Err(fault(list, problem));
        }
        Ok(listed.chunks_exact(corners).map(<[u32]>::to_vec).collect())
    }

    fn turn_outwards(&mut self, of: XmlElement<'_>, listed: &[Vec<u32>]) -> [Vec<Vec<u32>>; 2] {
        let points = &self.geometry.mesh.points;
        let faces = &self.surface.faces;
        let known: BTreeMap<Vec<u32>, usize> =
            faces.iter().enumerate().map(|(index, face)| (sorted(face.nodes().to_vec()), index)).collect();
        let mut turned = [Vec::new(), Vec::new()];
        let mut inside = 0;
        for nodes in listed {
            let Some(&index) = known.get(&sorted(nodes.clone())) else {
                inside += 1;
                continue;
            };
            let corners: Vec<Vector3> = nodes.iter().map(|&node| points[node as usize]).collect();
            let outwards = vector_area(&corners).dot(&faces[index].vector_area(points)) >= 0.0;
            turned[usize::from(!outwards)].push(faces[index].nodes().to_vec());
        }
        if inside > 0 {
            self.leave_out(of, &format!("{inside} faces that are not on the boundary"));
        }
        turned
    }
}

/// NiftySim subtracts tractions from the forces on the nodes.
fn against(traction: [f64; 3]) -> [f64; 3] {
    traction.map(|t| if t == 0.0 { 0.0 } else { -t })
}

fn components(of: XmlElement<'_>) -> Result<[bool; 3], Fault> {
    match of.attribute("DOF").map(str::trim) {
        None | Some("all") => Ok([true; 3]),
        Some("0") => Ok([true, false, false]),
        Some("1") => Ok([false, true, false]),
        Some("2") => Ok([false, false, true]),
        Some(other) => {
            let (what, known) = ("degree of freedom", "0, 1, 2, all");
            Err(fault(of, ImportProblem::Unknown { what, found: other.into(), known }))
        }
    }
}

/// Region that nodes chosen by their normals are restricted to.
fn region(of: XmlElement<'_>) -> Result<Selection, Fault> {
    match attribute(of, "Type", "Type=\"Box\" or \"Sphere\"")? {
        "Box" => {
            let [x, to_x, y, to_y, z, to_z] = numbers_of::<6>(of, "bounds of a box")?;
            Ok(Selection::Box([[x, y, z], [to_x, to_y, to_z]]))
        }
        "Sphere" => {
            let [radius, centre @ ..] = numbers_of::<4>(of, "numbers of a sphere")?;
            Ok(Selection::Sphere { centre, radius })
        }
        other => {
            let (what, known) = ("kind of region", "Box, Sphere");
            Err(fault(of, ImportProblem::Unknown { what, found: other.into(), known }))
        }
    }
}

pub(super) fn sorted(mut nodes: Vec<u32>) -> Vec<u32> {
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

/// A node that a list names more than once.
fn repeated(nodes: &[u32]) -> Option<u32> {
    let mut nodes = nodes.to_vec();
    nodes.sort_unstable();
    nodes.windows(2).find(|pair| pair[0] == pair[1]).map(|pair| pair[0])
}

/// Combines the conditions of one body. Where NiftySim both holds and displaces, it displaces. Actions on the
/// same nodes along other axes become one.
pub(super) fn settle(conditions: Vec<Condition>) -> Result<Vec<Condition>, Fault> {
    let mut moved: [BTreeSet<u32>; 3] = Default::default();
    for condition in &conditions {
        let Action::Move(by) = condition.action else { continue };
        for (component, moved) in moved.iter_mut().enumerate().filter(|(c, _)| by[*c].is_some()) {
            if let Some(node) = condition.nodes.iter().find(|&&node| !moved.insert(node)) {
                let axis = ["x", "y", "z"][component];
                let what = format!("node {node} is displaced along {axis} twice, which NiftySim adds up");
                let problem = ImportProblem::Contradiction { what, remedy: "give the sum once" };
                return Err(Fault { line: condition.line, element: "Constraint".into(), problem });
            }
        }
    }
    let mut settled: Vec<Condition> = Vec::new();
    for condition in conditions.into_iter().flat_map(|condition| released(condition, &moved)) {
        let earlier = settled.iter_mut().find(|earlier| {
            earlier.shape == condition.shape
                && earlier.nodes == condition.nodes
                && !condition.nodes.is_empty()
                && std::mem::discriminant(&earlier.action) == std::mem::discriminant(&condition.action)
        });
        match earlier {
            Some(earlier) => earlier.action = together(earlier.action, condition.action),
            None => settled.push(condition),
        }
    }
    Ok(gathered(settled))
}

/// Gathers conditions of one constraint that differ in their values only.
fn gathered(conditions: Vec<Condition>) -> Vec<Condition> {
    /// The vector of an action on nodes, and the components in which it acts.
    fn vector(action: &Action) -> Option<([f64; 3], [bool; 3])> {
        match action {
            Action::Move(by) => Some((by.map(|by| by.unwrap_or(0.0)), by.map(|by| by.is_some()))),
            Action::Force(force) => Some((*force, [true; 3])),
            _ => None,
        }
    }
    let mut joined: Vec<Condition> = Vec::new();
    for condition in conditions {
        let same = |last: &&mut Condition| {
            let (Some((_, along)), Some((_, other))) = (vector(&condition.action), vector(&last.action))
            else {
                return false;
            };
            (last.line, last.shape, other) == (condition.line, condition.shape, along)
                && std::mem::discriminant(&last.action) == std::mem::discriminant(&condition.action)
        };
        let Some((value, _)) = vector(&condition.action) else {
            joined.push(condition);
            continue;
        };
        let Some(last) = joined.last_mut().filter(same) else {
            joined.push(condition);
            continue;
        };
        if last.values.is_empty() {
            last.values = vec![vector(&last.action).map_or([0.0; 3], |(value, _)| value); last.nodes.len()];
        }
        last.values.resize(last.values.len() + condition.nodes.len(), value);
        last.nodes.extend(condition.nodes);
    }
    for condition in joined.iter_mut().filter(|condition| !condition.values.is_empty()) {
        let mut pairs: Vec<_> =
            condition.nodes.iter().copied().zip(condition.values.iter().copied()).collect();
        pairs.sort_by_key(|(node, _)| *node);
        (condition.nodes, condition.values) = pairs.into_iter().unzip();
    }
    joined
}

/// A condition without the components that are displaced, if it holds any.
fn released(condition: Condition, moved: &[BTreeSet<u32>; 3]) -> Vec<Condition> {
    let Action::Fix(held) = condition.action else { return vec![condition] };
    let is_free = |c: &usize| held[*c] && condition.nodes.iter().all(|node| !moved[*c].contains(node));
    let free: Vec<usize> = (0..3).filter(is_free).collect();
    let mut parts = Vec::new();
    if !free.is_empty() {
        let action = Action::Fix([0, 1, 2].map(|c| free.contains(&c)));
        parts.push(Condition { action, ..condition.clone() });
    }
    for c in (0..3).filter(|c| held[*c] && !free.contains(c)) {
        let nodes: Vec<u32> =
            condition.nodes.iter().filter(|node| !moved[c].contains(node)).copied().collect();
        if !nodes.is_empty() {
            parts.push(Condition {
                action: Action::Fix([0, 1, 2].map(|a| a == c)),
                nodes,
                ..condition.clone()
            });
        }
    }
    parts
}

fn together(a: Action, b: Action) -> Action {
    match (a, b) {
        (Action::Fix(a), Action::Fix(b)) => Action::Fix([0, 1, 2].map(|c| a[c] || b[c])),
        (Action::Move(a), Action::Move(b)) => Action::Move([0, 1, 2].map(|c| a[c].or(b[c]))),
        (Action::Force(a), Action::Force(b)) => Action::Force([0, 1, 2].map(|c| a[c] + b[c])),
        (Action::Gravity(a), Action::Gravity(b)) => Action::Gravity([0, 1, 2].map(|c| a[c] + b[c])),
        (a, _) => a,
    }
}
