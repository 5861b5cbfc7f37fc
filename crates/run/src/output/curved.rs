//! The curved surface of shells as a mesh of small triangles.

use pliant_format::tables::FieldName;
use pliant_geometry::{CellBlock, CellKind, DataArray, Mesh};
use pliant_implicit::{CurvedSurface, Picture, PictureFields};
use pliant_scene::Built;
use pliant_shells::EdgeRule;
use pliant_sim::{BodyCells, ImplicitBodies};

use super::{Frame, fields};

/// The curved surface of one shell or of all.
pub(super) struct Curved {
    surface: CurvedSurface,
    picture: Picture,
    found: PictureFields,
    cells: fields::OfShells,
    /// Points of the picture that are shown.
    points: Vec<u32>,
    /// The facet of each triangle that is shown.
    facets: Vec<u32>,
}

impl Curved {
    /// With each edge cut into `parts`; and the mesh at rest.
    pub(super) fn new(built: &Built, part: &ImplicitBodies, on: Option<&str>, parts: u32) -> (Self, Mesh) {
        let surface = CurvedSurface::new(&part.model, EdgeRule::Arc);
        let picture = surface.picture(&part.model, parts);
        let shown = |facet: u32| {
            let owner = part
                .cells
                .iter()
                .position(|cells| matches!(cells, BodyCells::Facets(r) if r.contains(&facet)));
            on.is_none_or(|on| owner.is_some_and(|owner| built.bodies[owner].name == on))
        };
        let mut renumbered = vec![u32::MAX; picture.places.len()];
        let (mut points, mut facets, mut nodes) = (Vec::new(), Vec::new(), Vec::new());
        let mut edges = Vec::new();
        for (number, triangle) in picture.triangles.iter().enumerate() {
            let facet = picture.facet(number);
            if !shown(facet) {
                continue;
            }
            facets.push(facet);
            edges.push(f64::from(picture.facet_edges[number]));
            for &point in triangle {
                let at = &mut renumbered[point as usize];
                if *at == u32::MAX {
                    *at = points.len() as u32;
                    points.push(point);
                }
                nodes.push(*at);
            }
        }
        let mut block = CellBlock::new(CellKind::Triangle, nodes);
        block.data.insert("element-edges".into(), DataArray::scalar(edges));
        if !built.labels(on).is_empty() {
            let labels = labels_of_facets(built, part);
            let labels = facets.iter().map(|&facet| labels[facet as usize]).collect();
            block.data.insert("label".into(), DataArray::scalar(labels));
        }
        let mesh = Mesh {
            points: points.iter().map(|&point| picture.rest[point as usize]).collect(),
            blocks: vec![block],
            ..Mesh::default()
        };
        let curved = Self {
            surface,
            picture,
            found: PictureFields::default(),
            cells: fields::OfShells::default(),
            points,
            facets,
        };
        (curved, mesh)
    }

    /// The nodes of the facet of a point, with its weights: where the point is, but for the bulge of the
    /// curved surface.
    pub(super) fn nodes_of(&self, part: &ImplicitBodies, point: u32) -> Vec<(u32, f64)> {
        let place = &self.picture.places[self.points[point as usize] as usize];
        part.model.facets[place.facet as usize].nodes.into_iter().zip(place.weights).collect()
    }

    /// Puts the wanted fields and the normals of an instant into the mesh.
    pub(super) fn fill(&mut self, mesh: &mut Mesh, frame: &Frame<'_>, wanted: &[FieldName]) {
        let (Some(part), Some(state)) = (&frame.built().implicit, frame.now.shells()) else { return };
        let model = &part.model;
        self.found.fill(&self.picture, &self.surface, model, state);
        self.cells.fill(model, state, wanted);
        let points = &self.points;
        let vectors = |values: &dyn Fn(usize) -> [f64; 3]| DataArray {
            components: 3,
            values: points.iter().flat_map(|&point| values(point as usize)).collect(),
        };
        mesh.point_data.insert("normal".into(), vectors(&|point| self.found.normal[point].into()));
        for &field in wanted {
            let array = match field {
                FieldName::Displacement => vectors(&|point| self.found.displacement[point].into()),
                FieldName::Rotation => vectors(&|point| self.found.rotation[point].into()),
                FieldName::Velocity => vectors(&|point| {
                    let place = &self.picture.places[point];
                    let nodes = model.facets[place.facet as usize].nodes;
                    let parts = nodes.iter().zip(place.weights);
                    parts
                        .map(|(&node, weight)| state.velocity[node as usize] * weight)
                        .sum::<nalgebra::Vector3<f64>>()
                        .into()
                }),
                _ => {
                    let components = field.components();
                    let value =
                        |&facet: &u32| self.cells.of(model, facet, field).into_iter().take(components);
                    let values = self.facets.iter().flat_map(value).collect();
                    mesh.blocks[0].data.insert(field.name().into(), DataArray { components, values });
                    continue;
                }
            };
            mesh.point_data.insert(field.name().into(), array);
        }
    }
}

/// The label of each facet of the model; 0 in a body without labels.
fn labels_of_facets(built: &Built, part: &ImplicitBodies) -> Vec<f64> {
    let mut labels = vec![0.0; part.model.facets.len()];
    for (body, cells) in built.bodies.iter().zip(&part.cells) {
        let given = body.mesh.block(CellKind::Triangle).and_then(|block| block.data.get("label"));
        if let (BodyCells::Facets(range), Some(given)) = (cells, given) {
            let facets = labels[range.start as usize..range.end as usize].iter_mut();
            facets.zip(&given.values).for_each(|(label, value)| *label = *value);
        }
    }
    labels
}
