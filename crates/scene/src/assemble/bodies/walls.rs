//! Thin walls: membranes, and walls on the boundary of a solid, with its nodes.

use pliant_format::registry::LawTable;
use pliant_format::tables::{BodyModel, BodyTable, Rotations};
use pliant_geometry::{CellBlock, DataArray, Mesh, Surface, body_blocks};
use pliant_mechanics::model::Cells;
use pliant_mechanics::prony::Prony;
use pliant_mechanics::tensor::{cross, dot, sub};

use super::{Draft, Meshed, Shape, nodes};

/// A fibre whose part in the plane of its triangle is shorter than this has no direction there.
const ACROSS: f64 = 1e-3;

impl Meshed<'_> {
    /// The wall on the boundary of another body: its triangles, and the nodes that it shares.
    pub(super) fn wall(&mut self, name: &str, table: &BodyTable, host: &str) -> Option<Shape> {
        let path = ["body", name, "on"];
        let scene = self.scene;
        let given = scene.bodies.iter().find(|(known, _)| known == host).map(|(_, table)| table);
        if self.source().node(&["body", name, "mesh"]).is_some() {
            let message = format!("`{name}` lies on `{host}`, but has a mesh of its own");
            let help = "leave `mesh` out: the wall takes the triangles of the boundary";
            self.error(&["body", name, "mesh"], message, "not with `on`", help);
            return None;
        }
        if matches!(table.model, BodyModel::Solid | BodyModel::Bar) {
            let word = table.model.word();
            let message = format!("`{name}` is on the boundary of `{host}`, where a {word} has no place");
            let help = "leave `model` out, or set `model = \"membrane\"` or `\"shell\"`";
            self.error(&["body", name, "model"], message, "not with `on`", help);
            return None;
        }
        if let Some(given) = given
            && given.model != BodyModel::Solid
        {
            let word = given.model.word();
            let message = match host == name {
                true => format!("`{name}` would be a wall on itself"),
                false => format!("`{host}` is of model `{word}`, and a wall needs the boundary of a solid"),
            };
            let help = match given.on {
                Some(_) if host != name => {
                    "walls do not lie on walls: give their thicknesses to one, or put both on the solid"
                }
                _ => "name a solid",
            };
            self.error(&path, message, "not a solid", help);
            return None;
        }
        let found = self.bodies.iter().position(|body| body.name == host);
        let Some(index) = found else {
            // A host that could not be built is already reported.
            if given.is_none() {
                self.find_body(host, &path);
            }
            return None;
        };
        let built = &self.bodies[index];
        let faces: Vec<_> = match &table.faces {
            None => built.boundary.faces.clone(),
            Some(selection) => match selection.faces(&built.mesh, &built.boundary) {
                Ok(chosen) => chosen.into_iter().map(|face| built.boundary.faces[face as usize]).collect(),
                Err(error) => {
                    self.error(&["body", name, "faces"], error.to_string(), "this selection", "");
                    return None;
                }
            },
        };
        let (mut mesh, parents) = Surface { faces: faces.clone() }.to_mesh(&built.mesh.points);
        add_labels(&mut mesh, &faces, &built.mesh);
        for (set, points) in &built.mesh.point_sets {
            let wall_node = |point: &u32| parents.binary_search(point).ok().map(|at| at as u32);
            let points: Vec<u32> = points.iter().filter_map(wall_node).collect();
            if !points.is_empty() {
                mesh.point_sets.insert(set.clone(), points);
            }
        }
        let label_names = built.mesh.label_names.clone();
        if table.rotations == Rotations::Follow {
            self.turn_wall(index, &faces);
        }
        let shared = parents.iter().map(|&node| self.assembly.bodies[index].node(node)).collect();
        let mesh = self.triangles(mesh, &path)?;
        let origin = match &table.faces {
            None => format!("the boundary of `{host}`"),
            Some(_) => format!("a part of the boundary of `{host}`"),
        };
        Some(Shape {
            file_nodes: mesh.points.len(),
            mesh: Mesh { label_names, ..mesh },
            origin,
            file_numbers: Vec::new(),
            shared: Some(shared),
        })
    }

    /// True if a law fits the model of a body.
    pub(super) fn check_law_of_model(
        &mut self,
        draft: &Draft<'_>,
        law_name: &str,
        law: &LawTable,
        prony: &Prony,
        path: &[&str],
    ) -> bool {
        let name = draft.name;
        let (message, label, help) = match draft.table.model {
            BodyModel::Membrane if law.law.families() == 0 && !law.law.is_isotropic() => (
                format!("law `{law_name}` has fixed axes in space, and `{name}` is a membrane"),
                "not for membranes",
                "take an isotropic law, or one with fibres such as `holzapfel-gasser-ogden`",
            ),
            BodyModel::Bar if law.law.families() > 0 || !law.law.is_isotropic() => (
                format!("law `{law_name}` depends on the direction, and `{name}` is a bar"),
                "not for bars",
                "take an isotropic law: bars use its Young's modulus at small strain",
            ),
            model @ (BodyModel::Membrane | BodyModel::Bar) if !prony.volumetric.is_empty() => (
                format!(
                    "law `{law_name}` relaxes in volume, but `{name}` is a {}, where only the stress as a whole can relax",
                    model.word()
                ),
                "not in volume",
                "give its terms `part = \"isochoric\"`: here they act on the whole stress",
            ),
            BodyModel::Solid if law.law.is_incompressible() => (
                format!(
                    "law `{law_name}` keeps the volume exactly (`poisson-ratio` 0.5), and `{name}` is a solid"
                ),
                "for membranes and shells only",
                "take a `poisson-ratio` of 0.49 or less",
            ),
            _ => return true,
        };
        let poisson = ["law", law_name, "poisson-ratio"];
        let path = if draft.table.model == BodyModel::Solid { &poisson[..] } else { path };
        self.error(path, message, label, help);
        false
    }

    /// Some triangles of a block as cells of a membrane, with the fibres of each.
    pub(super) fn membrane(
        &mut self,
        draft: &Draft<'_>,
        body: usize,
        block: &CellBlock,
        triangles: &[u32],
        fibre: &[[f64; 3]],
    ) -> Option<Cells> {
        let &Draft { name, table, .. } = draft;
        let thickness = self.thickness(name, table, block)?;
        let of = |&cell: &u32| if thickness.len() == 1 { thickness[0] } else { thickness[cell as usize] };
        let thickness: Vec<f64> = triangles.iter().map(of).collect();
        if let Some(at) = thickness.iter().position(|t| !(*t > 0.0 && t.is_finite())) {
            let (cell, value) = (triangles[at], thickness[at]);
            let message = format!("triangle {cell} of `{name}` has a thickness of {value} m");
            let help = "give every triangle a thickness above 0, in metres";
            self.error(&["body", name, "thickness"], message, "must be above 0", help);
            return None;
        }
        let model_body = &self.assembly.bodies[body];
        let cells: Vec<[u32; 3]> =
            triangles.iter().map(|&cell| nodes(block, cell, |node| model_body.node(node))).collect();
        let families = fibre.len() / cells.len().max(1);
        let across = fibre.iter().enumerate().position(|(at, &fibre)| {
            let [a, b, c] = cells[at / families].map(|node| self.assembly.rest[node as usize]);
            let normal = cross(sub(b, a), sub(c, a));
            let along = dot(normal, fibre).powi(2) / dot(normal, normal);
            1.0 - along < ACROSS * ACROSS
        });
        if let Some(at) = across {
            let cell = triangles[at / families];
            let message = format!("the fibre of triangle {cell} of `{name}` is perpendicular to the wall");
            let help = "a membrane needs fibres in its plane: give another direction or rule there";
            self.error(&["body", name], message, "this body", help);
            return None;
        }
        Some(Cells::membrane(cells, &self.assembly.rest, &thickness))
    }
}

/// Gives the cells of a surface the labels of the cells behind its faces.
fn add_labels(surface: &mut Mesh, faces: &[pliant_geometry::Face], host: &Mesh) {
    let labels = |parent: pliant_geometry::CellId| {
        let block = body_blocks(host).into_iter().find(|block| block.kind == parent.kind)?;
        Some(block.data.get("label")?.item(parent.index as usize)[0])
    };
    for block in &mut surface.blocks {
        let face_labels = faces.iter().filter(|face| face.kind == block.kind).map(|face| labels(face.parent));
        if let Some(values) = face_labels.collect::<Option<Vec<f64>>>() {
            block.data.insert("label".into(), DataArray::scalar(values));
        }
    }
}
