//! What a scene shows, as its table `[view]` asks, and what its tables sample.

use std::collections::BTreeMap;

use crate::registry::OutputTable;
use crate::scene::Scene;
use crate::tables::{At, BodyModel, ColourBy, CsvTable, FieldName, ViewTable, VtuTable};

impl Scene {
    /// The field that colours tell; `None` for the colours of labels and that of tissue.
    pub fn shown_field(&self) -> Option<FieldName> {
        self.field_of(&self.view)
    }

    /// The same of another view than its own.
    pub fn field_of(&self, view: &ViewTable) -> Option<FieldName> {
        match view.colour {
            Some(ColourBy::Field(field)) => Some(field),
            Some(ColourBy::Nothing(_) | ColourBy::Labels(_)) => None,
            None if self.shows_surface_of_shell(view) => Some(FieldName::Displacement),
            None => Some(FieldName::VonMises),
        }
    }

    /// Whether its axes are those of a patient (x to the right, y to the front, z to the head): all bodies
    /// are meshed from images.
    pub fn is_of_patient(&self) -> bool {
        let meshes = self.bodies.iter().filter(|(_, body)| body.on.is_none()).map(|(_, body)| &body.mesh);
        let mut images = meshes.map(|mesh| mesh.image.is_some() || mesh.masks.is_some()).peekable();
        images.peek().is_some() && images.all(|image| image)
    }

    /// The body that carries a surface of a name, with its model.
    fn carrier(&self, surface: Option<&str>) -> Option<(&String, BodyModel)> {
        let (_, surface) = self.surfaces.iter().find(|(name, _)| surface == Some(name))?;
        let (name, body) = self.bodies.iter().find(|(name, _)| *name == surface.on)?;
        Some((name, body.model))
    }

    /// The fields that colours can tell on a body or a carried surface, or on all bodies together.
    pub fn fields_on(&self, on: Option<&str>) -> Vec<FieldName> {
        let all = FieldName::ALL.into_iter();
        match self.carrier(on) {
            Some((_, BodyModel::Shell)) => vec![FieldName::Displacement],
            Some((_, model)) => all.filter(|field| field.is_of(model) && field.is_of_surface()).collect(),
            None => {
                let shown = self.bodies.iter().filter(|(name, _)| on.is_none_or(|on| on == name));
                let models: Vec<BodyModel> = shown.map(|(_, body)| body.model).collect();
                all.filter(|field| models.iter().any(|&model| field.is_of(model))).collect()
            }
        }
    }

    /// What a section shows of a view: the body in place of a surface that it carries, which has no inside.
    pub fn in_section(&self, view: &ViewTable) -> ViewTable {
        let carrier = self.carrier(view.on.as_deref()).filter(|(_, model)| *model != BodyModel::Shell);
        let on = carrier.map(|(body, _)| body.clone()).or_else(|| view.on.clone());
        ViewTable { on, ..view.clone() }
    }

    fn shows_surface_of_shell(&self, view: &ViewTable) -> bool {
        self.carrier(view.on.as_deref()).is_some_and(|(_, model)| model == BodyModel::Shell)
    }

    fn shows_surface(&self, view: &ViewTable) -> bool {
        view.on.as_ref().is_some_and(|on| self.surfaces.iter().any(|(name, _)| name == on))
    }

    /// All that tables of the scene sample, in one: energies, all reactions, and the probes, under the name
    /// of their table too where another one has a probe of that name.
    pub fn sampled(&self) -> CsvTable {
        let mut probes = BTreeMap::new();
        for (name, output) in &self.outputs {
            let OutputTable::Csv(table) = output else { continue };
            for (probe, place) in &table.probes {
                let own = if probes.contains_key(probe) { format!("{name}.{probe}") } else { probe.clone() };
                probes.insert(own, place.clone());
            }
        }
        CsvTable { every: 1.0, reactions: None, moments_about: None, energy: true, probes }
    }

    /// A series of what is shown, with displacements and the field of the colours.
    pub fn shown(&self, every: f64) -> VtuTable {
        match self.view.clip {
            Some(_) => self.shown_as(&self.in_section(&self.view), every),
            None => self.shown_as(&self.view, every),
        }
    }

    /// A series of constraints and loads, where the view marks them: those of the body that carries a surface
    /// which is shown.
    pub fn shown_marks(&self, every: f64) -> Option<VtuTable> {
        let data = vec![FieldName::Displacement, FieldName::Constraint, FieldName::Load, FieldName::Weight];
        let on = self.carrier(self.view.on.as_deref()).map(|(body, _)| body.clone());
        let on = on.or_else(|| self.view.on.clone());
        self.view.marks.then_some(VtuTable { on, every, data, at: At::Points, curved: None })
    }

    /// The same of another view than its own.
    pub fn shown_as(&self, view: &ViewTable, every: f64) -> VtuTable {
        let mut data = vec![FieldName::Displacement];
        data.extend(self.field_of(view).filter(|field| *field != FieldName::Displacement));
        for (drawn, field) in [
            (view.contacts, FieldName::ContactForce),
            (view.contacts, FieldName::Gap),
            (view.critical, FieldName::ElementStep),
            (view.fibres, FieldName::Fibre),
        ] {
            if drawn && !data.contains(&field) {
                data.push(field);
            }
        }
        let on = view.on.as_ref();
        let mut models = self.bodies.iter().filter(|(name, _)| on.is_none_or(|on| on == name));
        let shells = !self.shows_surface(view) && models.all(|(_, body)| body.model == BodyModel::Shell);
        let curved = (shells && view.curved > 1 && !view.critical).then_some(view.curved);
        // Which cell is critical, and which way its fibres go, only the cells tell.
        let cells = curved.is_some() || view.critical || view.fibres;
        let at = if cells && !self.shows_surface(view) { At::Cells } else { At::Points };
        VtuTable { on: on.cloned(), every, data, at, curved }
    }
}
