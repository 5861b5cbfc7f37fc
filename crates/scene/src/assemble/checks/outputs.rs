//! Checks of outputs and of the view.

use pliant_format::registry::OutputTable;
use pliant_format::tables::{At, BodyModel, ColourBy, Component, CsvTable, FieldName, ProbeTable, VtuTable};
use pliant_format::{SCENE, suggestion};
use pliant_geometry::Vector3;

use super::Checked;
use crate::assemble::labels_of;
use crate::assemble::ties::Subject;

impl Checked<'_> {
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
            self.error(&["view", "range"], "the range must increase", "here", "as in [0, 5e3]");
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
                        "surfaces on a body of model `{}` have only a displacement, not `{}`",
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
                3 => "give `x`, `y` or `z`, or leave `component` out for the magnitude",
                _ => "leave `component` out: it is a single number",
            };
            let at = if asked.is_some() { "component" } else { "colour" };
            let message = format!("`{}` needs another `component`", field.name());
            self.error(&["view", at], message, "here", help);
        }
    }

    /// Refuses forces of contacts on bodies without contacts.
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
                "labels come from images with several `labels`, or from mesh files with cell data `label`";
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
            let message =
                "`at = \"points\"` is not for curved surfaces, where fields of cells stay on the cells";
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
        let message = format!("{who} {what}, so there is no `{}`", fields[index].name());
        let name = body.map_or("liver", |body| self.bodies[body].name.as_str()).to_owned();
        let help = format!(
            "add a contact: `[contact.NAME]` with `between = [\"{name}\", …]`, or leave the field out"
        );
        let index_text = index.to_string();
        let entry = [path, &[index_text.as_str()]].concat();
        let at = if self.source().node(&entry).is_some() { entry } else { path.to_vec() };
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
                        format!("`{}` is a field of cells, and a surface has only points", field.name());
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
                let help = "give the place of the probe at rest in metres; the nearest cell carries it";
                self.doubt_place(&format!("probe `{name}`"), distance, body, &at("at"), help);
            }
            None => {}
        }
    }

    /// Rejects fields that surfaces cannot carry: fields without values between nodes, and fields of bodies
    /// that carry no surface.
    fn refuse_fields_off_surfaces(&mut self, fields: &[FieldName], surface: usize, path: &[&str]) {
        let on_shell = self.assembly.carried.contains_key(&surface);
        if let Some(field) = fields.iter().find(|field| on_shell && **field != FieldName::Displacement) {
            let message = format!("surfaces on shells have only a displacement, not `{}`", field.name());
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
