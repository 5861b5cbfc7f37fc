//! A body, all bodies or a carried surface as a mesh with the fields of an instant. Points are at rest.

use std::collections::BTreeMap;

use pliant_format::tables::{At, BodyModel, FieldName, VtuTable};
use pliant_geometry::{CellBlock, CellKind, DataArray, Mesh, Vector3};
use pliant_mechanics::model::{Cells, Solid};
use pliant_scene::{Built, World};
use pliant_sim::contact::pose::Pose;
use pliant_sim::contact::touch::Rigid;
use pliant_sim::{BodyCells, ImplicitBodies};

use super::merged::merged;
use super::{CellNumbers, Frame, fields};

/// A mesh that takes the fields of instants: of a body, a carried surface or all bodies, of any participants.
pub(crate) struct FieldMesh {
    /// Participants that are shown, by number.
    parts: Vec<(usize, ParticipantMesh)>,
    /// Names of bodies, obstacles and tools by their number.
    names: BTreeMap<i32, String>,
    /// The mesh of several participants together.
    merged: Option<Mesh>,
}

impl FieldMesh {
    /// Makes the mesh of the bodies of a series.
    pub fn new(world: &World, table: &VtuTable) -> Self {
        let on = table.on.as_deref();
        let shown = world.participants.iter().enumerate().filter(|(_, part)| part.shows(on));
        let mut parts = Vec::new();
        let mut first_body = 0;
        for (index, part) in shown {
            let meshes = ParticipantMesh::of_bodies(
                &part.built,
                on,
                &part.fields(&table.data),
                table.at,
                table.curved,
            );
            parts.extend(meshes.into_iter().map(|mesh| (index, ParticipantMesh { first_body, ..mesh })));
            first_body += part.built.bodies.len();
        }
        if on.is_none() {
            let things = world.participants.iter().enumerate();
            parts.extend(things.filter_map(|(index, part)| {
                let mesh = ParticipantMesh::of_things(&part.built, &table.data)?;
                let mesh = ParticipantMesh { first_body, ..mesh };
                first_body += part.built.rigid_names().count();
                Some((index, mesh))
            }));
        }
        let names = world.body_names(on);
        if let [(_, only)] = &mut parts[..] {
            only.mesh.body_names.clone_from(&names);
        }
        let mut mesh = Self { parts, names, merged: None };
        mesh.merge();
        mesh
    }

    /// The mesh, with the fields of the last instant.
    pub fn mesh(&self) -> &Mesh {
        // A series of an unknown body is rejected when the scene is built.
        self.merged.as_ref().unwrap_or_else(|| &self.parts[0].1.mesh)
    }

    /// Returns the participant of a point, the participant's mesh, and the point's number there.
    fn part_of(&self, point: u32) -> Option<(usize, &ParticipantMesh, usize)> {
        let mut point = point as usize;
        for (index, part) in &self.parts {
            let points = part.mesh.points.len();
            if point < points {
                return Some((*index, part, point));
            }
            point -= points;
        }
        None
    }

    /// A point of the mesh as a combination of nodes of a participant; of a curved surface, the combination
    /// under its bulge.
    pub fn nodes_of(&self, world: &World, point: u32) -> (usize, Vec<(u32, f64)>) {
        let Some((index, part, point)) = self.part_of(point) else { return (0, Vec::new()) };
        (index, part.nodes_of(&world.participants[index].built, point as u32))
    }

    /// The participant and the rigid thing that a point belongs to; `None` of a point of a body.
    pub fn thing_of(&self, point: u32) -> Option<(usize, usize)> {
        let (index, part, point) = self.part_of(point)?;
        let Content::Things { owners, .. } = &part.content else { return None };
        Some((index, owners[point] as usize))
    }

    /// Displacement of a point of a rigid thing per unit of its growth; zero for a point of a body.
    pub(crate) fn outward_of(&self, point: u32) -> Vector3 {
        let part = self.part_of(point).map(|(_, part, point)| (&part.content, point));
        match part {
            Some((Content::Things { outward, .. }, point)) => outward[point],
            _ => Vector3::zeros(),
        }
    }

    /// Takes the fields of an instant.
    pub fn fill(&mut self, frames: &[Frame<'_>]) {
        self.parts.iter_mut().for_each(|(index, part)| part.fill(&frames[*index]));
        self.merge();
    }

    fn merge(&mut self) {
        if self.parts.len() > 1 {
            let meshes: Vec<_> = self.parts.iter().map(|(_, part)| (&part.mesh, part.first_body)).collect();
            self.merged = Some(Mesh { body_names: self.names.clone(), ..merged(&meshes) });
        }
    }
}

/// The mesh of the solids or the shells of one participant.
struct ParticipantMesh {
    mesh: Mesh,
    /// Bodies of the participants before it.
    first_body: usize,
    fields: Vec<FieldName>,
    at: At,
    content: Content,
}

/// The points and cells of the mesh in the model.
enum Content {
    /// A carried surface.
    Surface(usize),
    /// Bodies: the model's node of each point, and (solid, cell) of each cell of each block.
    Bodies { nodes: Vec<u32>, cells: Vec<Vec<(u32, u32)>> },
    /// Shells: the model's node of each point, and the facet of each cell.
    Shells { nodes: Vec<u32>, facets: Vec<u32>, fields: Box<fields::OfShells> },
    /// The curved surface of shells.
    Curved(Box<super::curved::Curved>),
    /// Obstacles and tools: the thing of each point, and the displacement of the point per unit of growth.
    Things { owners: Vec<u32>, outward: Vec<Vector3> },
}

impl ParticipantMesh {
    /// Makes the mesh of a body or surface by name, or of all bodies, solids before shells. With `curved`,
    /// makes the curved surface of shells.
    fn of_bodies(
        built: &Built,
        on: Option<&str>,
        fields: &[FieldName],
        at: At,
        curved: Option<u32>,
    ) -> Vec<Self> {
        let make = |(mesh, content), fields| Self::new(built, on, mesh, content, fields, at);
        let surface = built.model.surfaces.iter().position(|surface| Some(surface.name.as_str()) == on);
        if let Some(index) = surface {
            return vec![make((bare(&built.surfaces[index]), Content::Surface(index)), fields.to_vec())];
        }
        let of = |models: &[BodyModel]| -> Vec<FieldName> {
            let is_of = |field: &FieldName| models.iter().any(|&model| field.is_of(model));
            fields.iter().copied().filter(is_of).collect()
        };
        let mut meshes = Vec::new();
        if chosen(built, on, false).next().is_some() {
            meshes.push(make(merged_bodies(built, on), of(&models(built, on))));
        }
        if let Some(part) = &built.implicit
            && chosen(built, on, true).next().is_some()
        {
            let shells = match curved {
                None => merged_shells(built, part, on),
                Some(parts) => {
                    let (curved, mesh) = super::curved::Curved::new(built, part, on, parts);
                    (mesh, Content::Curved(Box::new(curved)))
                }
            };
            meshes.push(make(shells, of(&[BodyModel::Shell])));
        }
        meshes
    }

    /// Makes the mesh of the obstacles and tools that its bodies touch, at the start; `None` without any.
    fn of_things(built: &Built, fields: &[FieldName]) -> Option<Self> {
        let contacts = built.contacts.as_ref()?;
        let bounds = built.bodies.iter().filter_map(|body| body.mesh.bounds());
        let (low, high) = bounds.reduce(|(a, b), (c, d)| (a.inf(&c), b.sup(&d)))?;
        let mut mesh = Mesh::default();
        let mut block = CellBlock::new(CellKind::Triangle, Vec::new());
        let (mut owners, mut things, mut outward) = (Vec::new(), Vec::new(), Vec::new());
        let mut bodies = Vec::new();
        for (rigid, index) in contacts.rigids.iter().zip(0..) {
            let surface = rigid.shape.surface(1.3 * (high - low).norm());
            let ways = if rigid.trajectory.grows() {
                rigid.shape.outward(&surface)
            } else {
                vec![Vector3::zeros(); surface.0.len()]
            };
            let (points, triangles) = surface;
            let (first, start) = (mesh.points.len() as u32, rigid.stance(0.0, None));
            outward.extend(ways.iter().map(|way| start.pose.rotation * way));
            let grown = points.iter().zip(&ways).map(|(point, way)| point + way * start.growth);
            mesh.points.extend(grown.map(|point| (start.pose * nalgebra::Point3::from(point)).coords));
            owners.resize(mesh.points.len(), index);
            block.nodes.extend(triangles.iter().flatten().map(|node| first + node));
            bodies.resize(block.len(), f64::from(index));
            things.resize(block.len(), if rigid.inside { 2.0 } else { 1.0 });
        }
        block.data.insert("body".into(), DataArray::scalar(bodies));
        block.data.insert("thing".into(), DataArray::scalar(things));
        mesh.blocks.push(block);
        let fields = fields.iter().copied().filter(|&field| field == FieldName::Displacement).collect();
        let content = Content::Things { owners, outward };
        Some(Self { mesh, first_body: 0, fields, at: At::default(), content })
    }

    fn new(
        built: &Built,
        on: Option<&str>,
        mesh: Mesh,
        content: Content,
        fields: Vec<FieldName>,
        at: At,
    ) -> Self {
        let named = |(label, name): (i32, Option<&str>)| Some((label, name?.to_owned()));
        let label_names = built.labels(on).iter().filter_map(named).collect();
        let mesh = Mesh { label_names, ..mesh };
        Self { mesh, first_body: 0, fields, at, content }
    }

    /// A point of the mesh as a combination of nodes of the model; of a curved surface, the combination under
    /// its bulge.
    fn nodes_of(&self, built: &Built, point: u32) -> Vec<(u32, f64)> {
        match &self.content {
            Content::Surface(index) => built.model.surfaces[*index].mapping.row(point as usize).collect(),
            Content::Bodies { nodes, .. } | Content::Shells { nodes, .. } => {
                vec![(nodes[point as usize], 1.0)]
            }
            Content::Curved(curved) => {
                built.implicit.as_ref().map_or_else(Vec::new, |part| curved.nodes_of(part, point))
            }
            Content::Things { .. } => Vec::new(),
        }
    }

    /// Takes the fields of an instant.
    fn fill(&mut self, frame: &Frame<'_>) {
        match &mut self.content {
            Content::Surface(index) => {
                if let Some(displacement) = carried_on_shell(frame, *index) {
                    let values = displacement.iter().flat_map(|d| [d.x, d.y, d.z]).collect();
                    let name = FieldName::Displacement.name();
                    self.mesh.point_data.insert(name.into(), DataArray { components: 3, values });
                    return;
                }
                fill_surface(&mut self.mesh, frame, &self.fields, *index);
            }
            Content::Bodies { nodes, cells } => {
                fill_nodal(&mut self.mesh, frame, &self.fields, nodes);
                fill_cells(&mut self.mesh, frame, &self.fields, self.at, cells);
            }
            Content::Shells { nodes, facets, fields } => {
                fill_nodal(&mut self.mesh, frame, &self.fields, nodes);
                if let (Some(part), Some(state)) = (&frame.built().implicit, frame.now.shells()) {
                    fields.fill(&part.model, state, &self.fields);
                    fill_shells(&mut self.mesh, &part.model, fields, &self.fields, self.at, facets);
                }
            }
            Content::Curved(curved) => curved.fill(&mut self.mesh, frame, &self.fields),
            Content::Things { owners, outward } if !self.fields.is_empty() => {
                let values = moved_things(frame, &self.mesh.points, owners, outward);
                let name = FieldName::Displacement.name();
                self.mesh.point_data.insert(name.into(), DataArray { components: 3, values });
            }
            Content::Things { .. } => {}
        }
    }
}

/// Displacements [m] of the points of obstacles and tools since the start.
fn moved_things(frame: &Frame<'_>, points: &[Vector3], owners: &[u32], outward: &[Vector3]) -> Vec<f64> {
    let Some(contacts) = &frame.built().contacts else { return Vec::new() };
    let motion = |(rigid, number): (&Rigid, usize)| {
        let (start, now) = (rigid.stance(0.0, None), frame.now.stance(number, rigid));
        (now.pose * start.pose.inverse(), now.growth - start.growth)
    };
    let motions: Vec<(Pose, f64)> = contacts.rigids.iter().zip(0..).map(motion).collect();
    let moved = |((point, &owner), way): ((&Vector3, &u32), &Vector3)| {
        let (motion, grown) = motions[owner as usize];
        let there = motion * nalgebra::Point3::from(point + way * grown);
        let shift = there.coords - point;
        [shift.x, shift.y, shift.z]
    };
    points.iter().zip(owners).zip(outward).flat_map(moved).collect()
}

/// Fills the fields of a carried surface. Fields of cells are means at the nodes; points outside of all cells
/// do not extrapolate them.
fn fill_surface(mesh: &mut Mesh, frame: &Frame<'_>, wanted: &[FieldName], surface: usize) {
    let model = &frame.built().model;
    let mapping = &model.surfaces[surface].mapping;
    let (nodal, of_cells): (Vec<FieldName>, Vec<FieldName>) =
        wanted.iter().partition(|field| field.is_nodal());
    let of_nodes = fields::OfNodes::new(frame, nodal.iter().copied());
    for field in nodal {
        let value = |node| {
            let value = of_nodes.value(field, node);
            [value[0], value[1], value[2]]
        };
        let parent: Vec<[f64; 3]> = (0..model.node_count()).map(value).collect();
        let values = mapping.apply(&parent).into_iter().flatten().collect();
        mesh.point_data.insert(field.name().into(), DataArray { components: 3, values });
    }
    if of_cells.is_empty() {
        return;
    }
    let Some(recovered) = frame.cells() else { return };
    let mut averages = Averages::new(model.node_count(), &of_cells);
    for (index, solid) in model.solids.iter().enumerate() {
        for (slot, found) in recovered.of(index, &of_cells).iter().enumerate() {
            for cell in 0..solid.cells.len() {
                averages.add(slot, solid.cells.nodes(cell), found.at(cell), solid.cells.volume(cell));
            }
        }
    }
    for (field, means) in of_cells.iter().zip(averages.means(&of_cells)) {
        let components = field.components();
        let mut values = vec![0.0; mapping.len() * components];
        for (point, value) in values.chunks_exact_mut(components).enumerate() {
            for (node, weight) in mapping.inner_row(point) {
                let mean = &means[node as usize * components..][..components];
                value.iter_mut().zip(mean).for_each(|(sum, mean)| *sum += weight * mean);
            }
        }
        mesh.point_data.insert(field.name().into(), DataArray { components, values });
    }
}

/// Points and cells without sets and data but labels.
fn bare(mesh: &Mesh) -> Mesh {
    let bare = |block: &CellBlock| {
        let mut kept = CellBlock::new(block.kind, block.nodes.clone());
        kept.data
            .extend(block.data.get_key_value("label").map(|(name, labels)| (name.clone(), labels.clone())));
        kept
    };
    let blocks = mesh.blocks.iter().map(bare).collect();
    Mesh { points: mesh.points.clone(), blocks, ..Mesh::default() }
}

/// The bodies, one by name or all, that are shells or not.
fn chosen<'b>(built: &'b Built, on: Option<&'b str>, shells: bool) -> impl Iterator<Item = usize> + 'b {
    let is_shell = |body: usize| {
        let cells = built.implicit.as_ref().map(|part| &part.cells[body]);
        matches!(cells, Some(BodyCells::Facets(_)))
    };
    (0..built.bodies.len())
        .filter(move |&body| is_shell(body) == shells && on.is_none_or(|on| built.bodies[body].name == on))
}

/// The models of the chosen bodies that are no shells.
fn models(built: &Built, on: Option<&str>) -> Vec<BodyModel> {
    let of_body = |body: usize| built.model.solids.iter().filter(move |solid| solid.body == body);
    let model = |solid: &Solid| match solid.cells {
        Cells::Membrane(..) => BodyModel::Membrane,
        Cells::Bar(..) => BodyModel::Bar,
        _ => BodyModel::Solid,
    };
    chosen(built, on, false).flat_map(of_body).map(model).collect()
}

/// The cells of solids, membranes and bars of one body or of all, with `label` and, for several bodies, the
/// number of the `body`.
fn merged_bodies(built: &Built, on: Option<&str>) -> (Mesh, Content) {
    let mut mesh = Mesh::default();
    let mut nodes = Vec::new();
    let mut offsets = vec![0; built.bodies.len()];
    for body in chosen(built, on, false) {
        offsets[body] = mesh.points.len() as u32;
        mesh.points.extend_from_slice(&built.bodies[body].mesh.points);
        nodes.extend(built.model.bodies[body].all_nodes());
    }
    let labelled = !built.labels(on).is_empty();
    let mut cells = Vec::new();
    for kind in [CellKind::Tet, CellKind::Hex, CellKind::Triangle, CellKind::Line] {
        let mut block = CellBlock::new(kind, Vec::new());
        let mut places = Vec::new();
        let (mut body_of, mut labels) = (Vec::new(), Vec::new());
        for body in chosen(built, on, false) {
            // The mesh of a solid may list triangles, too.
            let is_kind =
                |solid: &Solid| solid.body == body && solid.cells.nodes_per_cell() == kind.node_count();
            let Some(listed) = built.bodies[body].mesh.block(kind) else { continue };
            if !built.model.solids.iter().any(is_kind) {
                continue;
            }
            block.nodes.extend(listed.nodes.iter().map(|node| node + offsets[body]));
            body_of.resize(body_of.len() + listed.len(), body as f64);
            match listed.data.get("label") {
                Some(label) => labels.extend_from_slice(&label.values),
                None => labels.resize(labels.len() + listed.len(), 0.0),
            }
            let first = places.len();
            places.resize(first + listed.len(), (0, 0));
            for (index, solid) in built.model.solids.iter().enumerate().filter(|(_, solid)| is_kind(solid)) {
                for (cell, &original) in solid.original.iter().enumerate() {
                    places[first + original as usize] = (index as u32, cell as u32);
                }
            }
        }
        if block.is_empty() {
            continue;
        }
        if built.bodies.len() > 1 {
            block.data.insert("body".into(), DataArray::scalar(body_of));
        }
        if labelled {
            block.data.insert("label".into(), DataArray::scalar(labels));
        }
        mesh.blocks.push(block);
        cells.push(places);
    }
    (mesh, Content::Bodies { nodes, cells })
}

/// Displacements [m] of the points of a surface that a shell carries; `None` for other surfaces.
pub(crate) fn carried_on_shell(frame: &Frame<'_>, surface: usize) -> Option<Vec<Vector3>> {
    let part = frame.built().implicit.as_ref()?;
    let (points, curved) = (part.model.carried.get(&surface)?, part.surface.as_ref()?);
    let mut positions = vec![Vector3::zeros(); points.len()];
    curved.carried_all(&part.model, frame.now.shells()?, points, &mut positions);
    for (position, rest) in positions.iter_mut().zip(&frame.built().surfaces[surface].points) {
        *position -= rest;
    }
    Some(positions)
}

/// The triangles of one shell or of all, with `label` and, for several bodies, the number of the `body`.
fn merged_shells(built: &Built, part: &ImplicitBodies, on: Option<&str>) -> (Mesh, Content) {
    let mut mesh = Mesh::default();
    let mut block = CellBlock::new(CellKind::Triangle, Vec::new());
    let (mut nodes, mut facets, mut labels, mut owners) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for number in chosen(built, on, true) {
        let BodyCells::Facets(range) = &part.cells[number] else { continue };
        let body = &built.bodies[number];
        let offset = mesh.points.len() as u32;
        mesh.points.extend_from_slice(&body.mesh.points);
        nodes.extend(built.model.bodies[number].all_nodes());
        let triangles = body.mesh.block(CellKind::Triangle);
        block.nodes.extend(
            triangles.map_or(&[][..], |triangles| &triangles.nodes[..]).iter().map(|node| node + offset),
        );
        facets.extend(range.clone());
        labels.extend_from_slice(
            triangles.and_then(|triangles| triangles.data.get("label")).map_or(&[], |of| &of.values),
        );
        labels.resize(facets.len(), 0.0);
        owners.resize(facets.len(), number as f64);
    }
    if built.bodies.len() > 1 {
        block.data.insert("body".into(), DataArray::scalar(owners));
    }
    if !built.labels(on).is_empty() {
        block.data.insert("label".into(), DataArray::scalar(labels));
    }
    mesh.blocks.push(block);
    (mesh, Content::Shells { nodes, facets, fields: Box::default() })
}

fn fill_shells(
    mesh: &mut Mesh,
    model: &pliant_implicit::Assembly,
    found: &fields::OfShells,
    wanted: &[FieldName],
    at: At,
    facets: &[u32],
) {
    let wanted: Vec<FieldName> = wanted.iter().copied().filter(|field| !field.is_nodal()).collect();
    let mut averages = Averages::new(mesh.points.len(), &wanted);
    for block in &mut mesh.blocks {
        for (slot, &field) in wanted.iter().enumerate() {
            let components = field.components();
            if at == At::Cells {
                let values = joined(facets, components, |&facet| found.of(model, facet, field));
                block.data.insert(field.name().into(), DataArray { components, values });
                continue;
            }
            for (index, &facet) in facets.iter().enumerate() {
                let area = model.facets[facet as usize].area;
                averages.add(slot, block.cell(index), &found.of(model, facet, field)[..components], area);
            }
        }
    }
    if at == At::Points {
        averages.write(&mut mesh.point_data, &wanted);
    }
}

fn fill_nodal(mesh: &mut Mesh, frame: &Frame<'_>, wanted: &[FieldName], nodes: &[u32]) {
    let of_nodes = fields::OfNodes::new(frame, wanted.iter().copied());
    for &field in wanted.iter().filter(|field| field.is_nodal()) {
        let components = field.components();
        let values = joined(nodes, components, |&node| of_nodes.value(field, node as usize));
        mesh.point_data.insert(field.name().into(), DataArray { components, values });
    }
}

fn fill_cells(mesh: &mut Mesh, frame: &Frame<'_>, wanted: &[FieldName], at: At, cells: &[Vec<(u32, u32)>]) {
    let wanted: Vec<FieldName> = wanted.iter().copied().filter(|field| !field.is_nodal()).collect();
    if wanted.is_empty() {
        return;
    }
    let model = &frame.built().model;
    let Some(recovered) = frame.cells() else { return };
    let mut found: Vec<Vec<CellNumbers>> = vec![Vec::new(); model.solids.len()];
    for &(solid, _) in cells.iter().flatten() {
        let numbers = &mut found[solid as usize];
        if numbers.is_empty() {
            *numbers = recovered.of(solid as usize, &wanted);
        }
    }
    let mut averages = Averages::new(mesh.points.len(), &wanted);
    for (block, places) in mesh.blocks.iter_mut().zip(cells) {
        for (slot, &field) in wanted.iter().enumerate() {
            let components = field.components();
            let value = |&(solid, cell): &(u32, u32)| found[solid as usize][slot].at(cell as usize);
            if at == At::Cells {
                let values = joined(places, components, value);
                block.data.insert(field.name().into(), DataArray { components, values });
                continue;
            }
            for (index, place) in places.iter().enumerate() {
                let volume = model.solids[place.0 as usize].cells.volume(place.1 as usize);
                averages.add(slot, block.cell(index), value(place), volume);
            }
        }
    }
    if at == At::Points {
        averages.write(&mut mesh.point_data, &wanted);
    }
}

/// The first components of the values of some items, one after another.
fn joined<T, V: AsRef<[f64]>>(items: &[T], components: usize, value: impl Fn(&T) -> V) -> Vec<f64> {
    let mut values = Vec::with_capacity(items.len() * components);
    items.iter().for_each(|item| values.extend_from_slice(&value(item).as_ref()[..components]));
    values
}

/// Volume-weighted means of cell values at the points.
struct Averages {
    /// For each field: sums of value × volume, and of volume, at each point. Cells without a value don't
    /// count.
    sums: Vec<(Vec<f64>, Vec<f64>)>,
}

impl Averages {
    fn new(points: usize, wanted: &[FieldName]) -> Self {
        let zeros = |field: &FieldName| (vec![0.0; points * field.components()], vec![0.0; points]);
        Self { sums: wanted.iter().map(zeros).collect() }
    }

    fn add(&mut self, slot: usize, nodes: &[u32], value: &[f64], volume: f64) {
        if value.iter().any(|v| v.is_nan()) {
            return;
        }
        let (sums, volumes) = &mut self.sums[slot];
        for &node in nodes {
            let first = node as usize * value.len();
            for (sum, v) in sums[first..].iter_mut().zip(value) {
                *sum += v * volume;
            }
            volumes[node as usize] += volume;
        }
    }

    /// The means of each field.
    fn means(self, wanted: &[FieldName]) -> Vec<Vec<f64>> {
        let mean = |(field, (sums, volumes)): (&FieldName, (Vec<f64>, Vec<f64>))| {
            let items = sums.chunks(field.components()).zip(volumes);
            items.flat_map(|(s, v)| s.iter().map(move |s| s / v)).collect()
        };
        wanted.iter().zip(self.sums).map(mean).collect()
    }

    fn write(self, data: &mut std::collections::BTreeMap<String, DataArray>, wanted: &[FieldName]) {
        for (&field, values) in wanted.iter().zip(self.means(wanted)) {
            data.insert(field.name().into(), DataArray { components: field.components(), values });
        }
    }
}

#[cfg(test)]
mod tests {
    use pliant_geometry::io;

    use super::*;
    use pliant_format::Scene;
    use pliant_format::source::Source;

    /// A square of two labels as a shell, and as a surface that it carries.
    const WALL: &str = r#"
[scene]
until = 0.1
[run]
solver = "static"
[law.wall]
type = "neo-hookean"
young-modulus = 1e6
poisson-ratio = 0.3
[body.wall]
model = "shell"
mesh = { file = "wall.vtu" }
law = { left = "wall", 2 = "wall" }
density = 1000
thickness = { by-label = { left = 1e-3, Right = 2e-3 } }
[surface.copy]
on = "wall"
mesh = { file = "wall.vtu" }
[constraint.held]
type = "fix"
body = "wall"
nodes = { label = "left" }
"#;

    #[test]
    fn shells_their_curved_surface_and_what_they_carry_keep_labels_and_names() {
        let folder = tempfile::tempdir().unwrap();
        let corners = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]];
        let points = corners.map(|[x, y]| Vector3::new(x, y, 0.0)).to_vec();
        let mut block = CellBlock::new(CellKind::Triangle, vec![0, 1, 2, 0, 2, 3]);
        block.data.insert("label".into(), DataArray::scalar(vec![1.0, 2.0]));
        let label_names = [(1, "left".to_owned()), (2, "right".to_owned())].into();
        let wall = Mesh { points, blocks: vec![block], label_names, ..Mesh::default() };
        io::write(&folder.path().join("wall.vtu"), &wall).unwrap();
        let source = Source::parse("wall.toml", WALL).unwrap();
        let scene = Scene::from_source(source, folder.path().to_owned()).unwrap();
        let built = pliant_scene::build(&scene).unwrap_or_else(|errors| panic!("{}", errors.plain()));
        let model = &built.implicit.as_ref().unwrap().model;
        assert_eq!([0, 1].map(|facet| model.facets[facet].thickness), [1e-3, 2e-3]);
        let labels = |on: Option<&str>, curved: Option<u32>| {
            let part = ParticipantMesh::of_bodies(&built, on, &[], At::Cells, curved).remove(0);
            assert_eq!(part.mesh.label_names, wall.label_names);
            part.mesh.blocks[0].data["label"].values.clone()
        };
        assert_eq!(labels(None, None), [1.0, 2.0]);
        assert_eq!(labels(Some("copy"), None), [1.0, 2.0]);
        assert_eq!(labels(Some("wall"), Some(2)), [1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0]);
    }
}
