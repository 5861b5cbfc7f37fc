//! Loads: forces on nodes, tractions and pressures on faces, gravity. And the references of outputs.

use pliant_format::registry::{LoadTable, OutputTable};
use pliant_format::tables::{
    At, BodyModel, ColourBy, Component, CsvTable, FieldName, ForceTable, ProbeTable, Vectors, VtuTable,
};
use pliant_format::{SCENE, suggestion};
use pliant_geometry::{Mesh, Selection, Surface, Vector3, boundary};
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::load::{Face, Load, LoadKind, NO_NODE, face_areas};

use super::{Builder, Subject, labels_of};

impl Builder<'_> {
    pub(super) fn add_loads(&mut self) {
        let scene = self.scene;
        if scene.is_implicit() {
            self.add_implicit_loads();
            return;
        }
        if let Some(acceleration) = scene.scene.gravity {
            for body in self.bodies_with_nodes() {
                let curve = Curve { shape: Shape::Hold, from: 0.0, to: 0.0 };
                let kind = LoadKind::Gravity { body, acceleration };
                self.assembly.model_mut().loads.push(Load::new("gravity", kind, curve));
            }
        }
        for (name, table) in &scene.loads {
            let path = ["load", name.as_str()];
            if let Some(loads) = self.loads(table, &path) {
                let named = |(kind, curve, surface)| Load { surface, ..Load::new(name, kind, curve) };
                self.assembly.model_mut().loads.extend(loads.into_iter().map(named));
            }
        }
    }

    /// The bodies that have nodes of their own, and with them mass: that of a wall on another body is the mass of its nodes.
    pub(super) fn bodies_with_nodes(&self) -> Vec<usize> {
        (0..self.assembly.bodies.len()).filter(|&body| !self.assembly.bodies[body].nodes.is_empty()).collect()
    }

    /// Refuses the weight of a wall apart from the body that it is on.
    pub(super) fn check_weight(&mut self, bodies: &[usize], of_nodes: bool, path: &[&str]) -> bool {
        let wall = bodies.iter().copied().find(|&body| self.assembly.bodies[body].nodes.is_empty());
        let Some(wall) = wall.filter(|_| !of_nodes) else { return true };
        let name = self.bodies[wall].name.clone();
        let message =
            format!("`{name}` has no nodes of its own: its weight is that of the body that it is on");
        self.error(path, message, "a wall", "name that body, or leave `on` out");
        false
    }

    fn loads(&mut self, table: &LoadTable, path: &[&str]) -> Option<Vec<(LoadKind, Curve, Option<usize>)>> {
        let at = |key| [path, &[key]].concat();
        if let LoadTable::Moment(_) | LoadTable::Edge(_) = table {
            let message = "moments and loads on edges are for shells";
            self.error(
                path,
                message,
                "not for a `solid`",
                "take forces or tractions, or set `model = \"shell\"`",
            );
            return None;
        }
        let curve = self.curve(table.timing(), path);
        if let LoadTable::Gravity(gravity) = table {
            let bodies = match &gravity.on {
                Some(name) => vec![self.find_body(name, &at("on"))?],
                None => self.bodies_with_nodes(),
            };
            if !self.check_weight(&bodies, gravity.nodes.is_some(), &at("on")) {
                return None;
            }
            let curve = curve?;
            let acceleration = gravity.acceleration;
            if let Some(selection) = &gravity.nodes {
                let [body] = bodies[..] else {
                    let message = "`nodes` are nodes of one body, which `on` must name";
                    self.error(&at("nodes"), message, "of which body?", "add `on = \"BODY\"`");
                    return None;
                };
                let nodes = self.body_nodes(body, selection, &at("nodes"))?;
                let weight = |node: u32| (node, acceleration.map(|a| a * self.assembly.mass[node as usize]));
                return Some(vec![(LoadKind::Forces(nodes.into_iter().map(weight).collect()), curve, None)]);
            }
            let load = |body| LoadKind::Gravity { body, acceleration };
            return Some(bodies.into_iter().map(|body| (load(body), curve.clone(), None)).collect());
        }
        let target = self.find_target(table.on()?, &at("on"))?;
        let kind = match table {
            LoadTable::Force(l) => self.nodal_forces(l, target, path),
            LoadTable::Traction(l) => self
                .faces(target, &l.faces, &at("faces"))
                .map(|faces| LoadKind::Forces(self.traction_forces(target, &faces, l.traction))),
            LoadTable::Pressure(l) => self
                .faces(target, &l.faces, &at("faces"))
                .map(|faces| LoadKind::Pressure { faces, pressure: l.pressure }),
            LoadTable::Gravity(_) | LoadTable::Moment(_) | LoadTable::Edge(_) => None,
        };
        let surface = match target {
            Subject::Body(_) => None,
            Subject::Surface(index) => Some(index),
        };
        Some(vec![(kind?, curve?, surface)])
    }

    pub(super) fn nodal_forces(
        &mut self,
        table: &ForceTable,
        target: Subject,
        path: &[&str],
    ) -> Option<LoadKind> {
        let at = [path, &["nodes"]].concat();
        let nodes = match target {
            Subject::Body(body) => self.body_nodes(body, &table.nodes, &at)?,
            Subject::Surface(index) => {
                let (mesh, boundary) = self.surface_mesh(index);
                match table.nodes.nodes(&mesh, &boundary) {
                    Ok(nodes) => nodes,
                    Err(error) => {
                        self.error(&at, error.to_string(), "this selection", "");
                        return None;
                    }
                }
            }
        };
        let count = nodes.len();
        let forces = match (&table.each, table.total) {
            (Some(Vectors::Uniform(each)), None) => vec![*each; count],
            (Some(Vectors::PerNode(each)), None) => {
                let at = [path, &["each"]].concat();
                let Subject::Body(body) = target else {
                    let help = "load the body itself, or give one vector for all nodes";
                    self.error(&at, "the nodes of a carried surface have no data", "not on a surface", help);
                    return None;
                };
                self.node_vectors(each, body, &nodes, &at)?
            }
            (None, Some(total)) => vec![total.map(|f| f / count as f64); count],
            (each, _) => {
                let found = if each.is_some() { "both" } else { "neither" };
                let message = format!("a force has exactly one of `each` and `total`, found {found}");
                let help = "`each` acts on every node, `total` is shared among them";
                self.error(path, message, "this force", help);
                return None;
            }
        };
        Some(LoadKind::Forces(nodes.into_iter().zip(forces).collect()))
    }

    /// The selected faces of a body (numbered in the model) or of a carried surface (numbered in it).
    pub(super) fn faces(
        &mut self,
        target: Subject,
        selection: &Selection,
        path: &[&str],
    ) -> Option<Vec<Face>> {
        let result = match target {
            Subject::Body(body) => {
                let (built, own) = (&self.bodies[body], &self.assembly.bodies[body]);
                select_faces(selection, &built.mesh, &built.boundary, |node| own.node(node))
            }
            Subject::Surface(index) => {
                let (mesh, boundary) = self.surface_mesh(index);
                select_faces(selection, &mesh, &boundary, |node| node)
            }
        };
        result.map_err(|error| self.error(path, error, "this selection", "")).ok()
    }

    fn surface_mesh(&self, index: usize) -> (Mesh, Surface) {
        let mesh = self.surfaces[index].clone();
        let boundary = boundary(&mesh);
        (mesh, boundary)
    }

    pub(super) fn traction_forces(
        &self,
        target: Subject,
        faces: &[Face],
        traction: [f64; 3],
    ) -> Vec<(u32, [f64; 3])> {
        let rest = match target {
            Subject::Body(_) => &self.assembly.rest,
            Subject::Surface(index) => &self.assembly.surfaces[index].rest,
        };
        let share = |(node, area): (u32, [f64; 3])| {
            let size = Vector3::from(area).norm();
            (node, traction.map(|t| t * size))
        };
        faces.iter().flat_map(|face| face_areas(face, |node| rest[node as usize])).map(share).collect()
    }

    pub(super) fn check_outputs(&mut self) {
        let scene = self.scene;
        for (name, table) in &scene.outputs {
            let path = ["output", name.as_str()];
            match table {
                OutputTable::Vtu(vtu) => self.check_vtu(vtu, &path),
                OutputTable::Csv(csv) => self.check_csv(csv, &path),
            }
        }
    }

    /// Refuses a view of what there is not.
    pub(super) fn check_view(&mut self) {
        let view = &self.scene.view;
        let target = view.on.as_ref().map(|on| self.find_target(on, &["view", "on"]));
        if let Some(clip) = &view.clip
            && clip.normal == [0.0; 3]
        {
            self.error(
                &["view", "clip", "normal"],
                "a plane needs a normal",
                "no direction",
                "as in [1, 0, 0]",
            );
        }
        if let Some([low, high]) = view.range
            && low >= high
        {
            self.error(&["view", "range"], "the range must grow", "here", "as in [0, 5e3]");
        }
        if !matches!(target, Some(None)) {
            self.check_labels_of_view();
        }
        if view.contacts {
            self.check_contacts_of_view(target);
        }
        let Some(ColourBy::Field(field)) = view.colour else { return };
        match target {
            Some(None) => return,
            Some(Some(Subject::Surface(surface))) => {
                let body = self.assembly.surfaces[surface].body;
                let model = self.scene.bodies[body].1.model;
                if model == BodyModel::Shell && field != FieldName::Displacement {
                    let message = format!(
                        "surfaces that a body of model `{}` carries have a displacement and no `{}`",
                        model.word(),
                        field.name()
                    );
                    let help = "leave `on` out, to see the body itself";
                    self.error(&["view", "colour"], message, "not on a surface", help);
                } else if field.is_of_contact() {
                    let message = format!("surfaces have no `{}`", field.name());
                    let help = "leave `on` out, to see the body itself";
                    self.error(&["view", "colour"], message, "not on a surface", help);
                } else {
                    self.refuse_other_fields(&[field], Some(body), &["view", "colour"]);
                }
            }
            Some(Some(Subject::Body(body))) => {
                self.refuse_other_fields(&[field], Some(body), &["view", "colour"]);
            }
            None => self.refuse_other_fields(&[field], None, &["view", "colour"]),
        }
        let (numbers, asked) = (field.components(), view.component.map(Component::of));
        let fits = match (numbers, asked) {
            (1 | 3, None) => true,
            (numbers, Some(of)) => numbers == of,
            _ => false,
        };
        if !fits {
            let help = match numbers {
                9 => "give `component = \"xx\"`, `yy`, `zz`, `xy`, `yz` or `xz`",
                3 => "`x`, `y` or `z`, or none for the size",
                _ => "leave `component` out: it is a single number",
            };
            let at = if asked.is_some() { "component" } else { "colour" };
            let message = format!("`{}` needs another `component`", field.name());
            self.error(&["view", at], message, "here", help);
        }
    }

    /// Refuses forces of contacts where there are none.
    fn check_contacts_of_view(&mut self, target: Option<Option<Subject>>) {
        let path = ["view", "contacts"];
        match target {
            Some(None) => {}
            Some(Some(Subject::Surface(_))) => {
                let help = "leave `on` out, to see the body itself";
                self.error(&path, "surfaces have no contacts", "not on a surface", help);
            }
            Some(Some(Subject::Body(body))) => {
                self.refuse_other_fields(&[FieldName::ContactForce], Some(body), &path);
            }
            None => self.refuse_other_fields(&[FieldName::ContactForce], None, &path),
        }
    }

    /// Refuses colours of labels that nothing shown has.
    fn check_labels_of_view(&mut self) {
        let view = &self.scene.view;
        let labels = labels_of(&self.assembly, &self.bodies, &self.surfaces, view.on.as_deref());
        if labels.is_empty() && view.shows_labels() {
            let help =
                "meshes of images with several `labels` have them, and mesh files with cell data `label`";
            let message = "the elements that are shown have no labels";
            self.error(&["view", "colour"], message, "no labels", help);
        }
    }

    fn check_vtu(&mut self, table: &VtuTable, path: &[&str]) {
        let at = |key| [path, &[key]].concat();
        let target = table.on.as_ref().map(|on| self.find_target(on, &at("on")));
        if let Some(Some(Subject::Surface(surface))) = target {
            self.refuse_fields_off_surfaces(&table.data, surface, &at("data"));
        }
        let body = match target {
            None => None,
            Some(Some(Subject::Body(body))) => Some(body),
            Some(_) => return,
        };
        self.refuse_other_fields(&table.data, body, &at("data"));
        let shells = self.scene.bodies.iter().enumerate().any(|(index, (_, table))| {
            body.is_none_or(|body| body == index) && table.model == BodyModel::Shell
        });
        if table.curved.is_some() && !shells {
            let message = "only shells have a curved surface";
            self.error(&at("curved"), message, "no shell", "leave `curved` out");
        }
        let reactions = [FieldName::Reaction, FieldName::ReactionMoment];
        if table.curved.is_some() && table.data.iter().any(|field| reactions.contains(field)) {
            let message = "reactions act on nodes, which a curved surface does not show";
            self.error(
                &at("data"),
                message,
                "not with `curved`",
                "write them in another output without `curved`",
            );
        }
        if table.curved.is_some() && table.at == At::Points {
            let message = "on a curved surface fields of cells are written on the cells";
            self.error(&at("at"), message, "not with `curved`", "leave `at` or `curved` out");
        }
    }

    /// Refuses fields that no chosen body has.
    fn refuse_other_fields(&mut self, fields: &[FieldName], body: Option<usize>, path: &[&str]) {
        let scene = self.scene;
        let models =
            scene.bodies.iter().enumerate().filter(|(index, _)| body.is_none_or(|body| body == *index));
        let models: Vec<BodyModel> = models.map(|(_, (_, table))| table.model).collect();
        let strange = fields.iter().position(|field| !models.iter().any(|&model| field.is_of(model)));
        if let (Some(index), Some(model)) = (strange, models.first()) {
            let index_text = index.to_string();
            let message = format!("bodies of model `{}` have no `{}`", model.word(), fields[index].name());
            let help = match model {
                BodyModel::Shell => {
                    "fields of a shell: `displacement`, `velocity`, `rotation`, `von-mises`, `stress-top`, `stress-middle`, \
                     `stress-bottom`, `membrane-force`, `bending-moment`, `membrane-energy`, `bending-energy`, \
                     `drilling-energy`, `thickness`, `current-thickness`, `surface-strain`, `element-step`, and of contacts \
                     `contact-force`, `contact-pressure`, `gap`, `slip`"
                }
                _ => "leave it out: it is a field of other bodies",
            };
            let given = self.source().node(&[path, &[index_text.as_str()]].concat()).is_some();
            let at = if given { [path, &[index_text.as_str()]].concat() } else { path.to_vec() };
            self.error(&at, message, "no such field", help);
        } else {
            self.refuse_fields_without_contact(fields, body, path);
        }
    }

    /// Refuses fields of contacts where no chosen body touches anything.
    fn refuse_fields_without_contact(&mut self, fields: &[FieldName], body: Option<usize>, path: &[&str]) {
        let Some(touching) = &self.touching else { return };
        let chosen = touching.iter().enumerate().filter(|(index, _)| body.is_none_or(|body| body == *index));
        let Some(index) = fields.iter().position(|field| field.is_of_contact()) else { return };
        if chosen.into_iter().any(|(_, touches)| *touches) {
            return;
        }
        let who = match body {
            Some(body) => format!("`{}` touches", self.bodies[body].name),
            None => "no body touches".into(),
        };
        let what = if body.is_some() { "nothing" } else { "anything" };
        let message = format!("{who} {what}, so that there is no `{}`", fields[index].name());
        let name = body.map_or("liver", |body| self.bodies[body].name.as_str()).to_owned();
        let help = format!(
            "add a contact: `[contact.NAME]` with `between = [\"{name}\", …]`, or leave the field out"
        );
        let index_text = index.to_string();
        let own = [path, &[index_text.as_str()]].concat();
        let at = if self.source().node(&own).is_some() { own } else { path.to_vec() };
        self.error(&at, message, "no contact", help);
    }

    fn check_csv(&mut self, table: &CsvTable, path: &[&str]) {
        for (index, wanted) in table.reactions.iter().flatten().enumerate() {
            let known: Vec<&str> = self.scene.constraints.iter().map(|(name, _)| name.as_str()).collect();
            if !known.contains(&wanted.as_str()) {
                let index = index.to_string();
                let at = [path, &["reactions", &index]].concat();
                let help = suggestion(wanted, &known, SCENE, "constraints");
                self.error(&at, format!("there is no constraint `{wanted}`"), "no such constraint", help);
            }
        }
        for (name, probe) in &table.probes {
            self.check_probe(name, probe, &[path, &["probes", name.as_str()]].concat());
        }
    }

    fn check_probe(&mut self, name: &str, probe: &ProbeTable, path: &[&str]) {
        let at = |key| [path, &[key]].concat();
        match self.find_target(&probe.on, &at("on")) {
            Some(Subject::Surface(surface)) => {
                self.refuse_fields_off_surfaces(&probe.data, surface, &at("data"));
                if let Some(field) = probe.data.iter().find(|field| !field.is_nodal()) {
                    let message =
                        format!("`{}` belongs to cells, and a probe on a surface has none", field.name());
                    self.error(
                        &at("data"),
                        message,
                        "not at points of a surface",
                        "probe the body for stresses",
                    );
                }
            }
            Some(Subject::Body(body)) => {
                self.refuse_other_fields(&probe.data, Some(body), &at("data"));
                let place = Vector3::from(probe.at);
                let distance = self.bodies[body].locator().locate(&place).map(|found| found.distance);
                let distance = distance.unwrap_or(0.0);
                let help = "give its place at rest in metres; the nearest cell carries it";
                self.doubt_place(&format!("probe `{name}`"), distance, body, &at("at"), help);
            }
            None => {}
        }
    }

    /// Rejects fields that are not carried by surfaces: those of nodes that say nothing between them, and of bodies that carry none.
    fn refuse_fields_off_surfaces(&mut self, fields: &[FieldName], surface: usize, path: &[&str]) {
        let on_shell = self.assembly.carried.contains_key(&surface);
        if let Some(field) = fields.iter().find(|field| on_shell && **field != FieldName::Displacement) {
            let message = format!("surfaces on shells have a displacement and no `{}`", field.name());
            self.error(path, message, "not on a surface", "write it on the body");
            return;
        }
        let is_off = |field: &&FieldName| !field.is_of_surface() || !field.is_of(BodyModel::Solid);
        if let Some(field) = fields.iter().find(is_off) {
            let message = format!("surfaces have no `{}`", field.name());
            self.error(path, message, "not on a surface", "write it on the body");
        }
    }
}

fn select_faces(
    selection: &Selection,
    mesh: &Mesh,
    boundary: &Surface,
    number: impl Fn(u32) -> u32,
) -> Result<Vec<Face>, String> {
    let face = |index: u32| {
        let mut face = [NO_NODE; 4];
        for (own, &node) in face.iter_mut().zip(boundary.faces[index as usize].nodes()) {
            *own = number(node);
        }
        face
    };
    let selected = selection.faces(mesh, boundary).map_err(|error| error.to_string())?;
    Ok(selected.into_iter().map(face).collect())
}

#[cfg(test)]
mod tests {
    use pliant_mechanics::load::LoadKind;

    use crate::assemble::Built;
    use crate::testing::{built, mistakes};

    /// The sum of the forces of the only load [N], and how many nodes it acts on.
    fn sum(built: &Built) -> ([f64; 3], usize) {
        let [load] = &built.model.loads[..] else { panic!("one load") };
        let LoadKind::Forces(forces) = &load.kind else { panic!("forces") };
        let sum = forces.iter().fold([0.0; 3], |sum, (_, f)| [0, 1, 2].map(|c| sum[c] + f[c]));
        (sum, forces.len())
    }

    #[test]
    fn total_is_shared_and_each_is_repeated() {
        let load = |force: &str| {
            built(&format!("[load.a]\ntype = 'force'\non = 'cube'\nnodes = {{ set = 'z-max' }}\n{force}\n"))
        };
        let ([x, y, z], nodes) = sum(&load("total = [9, 0, -18]"));
        assert!((x - 9.0).abs() < 1e-12 && y == 0.0 && (z + 18.0).abs() < 1e-12 && nodes == 9);
        assert_eq!(sum(&load("each = [1, 0, 0]")), ([9.0, 0.0, 0.0], 9));
    }

    #[test]
    fn gravity_on_some_nodes_is_their_weight() {
        let load = "[load.a]\ntype = 'gravity'\nacceleration = [0, 0, -10]\nnodes = { set = 'z-max' }\n";
        let built = built(&format!("{load}on = 'cube'\n"));
        let ([x, y, z], nodes) = sum(&built);
        let mass: f64 = built.model.constraints[0].nodes.iter().map(|&n| built.model.mass[n as usize]).sum();
        // The mesh is the same from above and from below.
        assert!(x == 0.0 && y == 0.0 && (z + 10.0 * mass).abs() < 1e-12 * mass && nodes == 9, "{z} {mass}");
        let other =
            "[body.other]\nmesh = { block = { size = [1, 1, 1] }, edge = 1 }\nlaw = 'tissue'\ndensity = 1\n";
        let message = mistakes(&format!("{other}{load}")).plain().to_string();
        assert!(message.contains("`nodes` are nodes of one body"), "{message}");
    }

    #[test]
    fn a_traction_adds_up_to_itself_times_the_area() {
        let load = built(
            "[load.a]\ntype = 'traction'\non = 'cube'\nfaces = { set = 'z-max' }\ntraction = [0, 3, 0]\n",
        );
        let ([x, y, z], _) = sum(&load);
        assert!(x == 0.0 && (y - 3.0 * 0.02).abs() < 1e-12 && z == 0.0, "{y}");
    }

    #[test]
    fn pressure_takes_the_faces_and_gravity_every_body() {
        let load =
            built("[load.a]\ntype = 'pressure'\non = 'cube'\nfaces = { set = 'x-max' }\npressure = 5\n");
        let LoadKind::Pressure { faces, pressure } = &load.model.loads[0].kind else { panic!("pressure") };
        assert_eq!((faces.len(), *pressure), (4, 5.0));
        let other =
            "[body.other]\nmesh = { block = { size = [1, 1, 1] }, edge = 1 }\nlaw = 'tissue'\ndensity = 1\n";
        let load = built(&format!("{other}[load.a]\ntype = 'gravity'\nacceleration = [0, 0, -1]\n"));
        assert_eq!(load.model.loads.len(), 2);
    }
}
