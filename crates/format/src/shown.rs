//! Outputs for the pictures of a scene, by its table `[view]`, and for its sampled series.

use std::collections::BTreeMap;

use crate::registry::OutputTable;
use crate::scene::Scene;
use crate::tables::{At, BodyModel, ColourBy, CsvTable, FieldName, ViewTable, VtuTable};

impl Scene {
    /// Field that the colours show; `None` for the colours of labels and the colour of tissue.
    pub fn shown_field(&self) -> Option<FieldName> {
        self.field_of(&self.view)
    }

    /// Field that the colours of another view show.
    pub fn field_of(&self, view: &ViewTable) -> Option<FieldName> {
        match view.colour {
            Some(ColourBy::Field(field)) => Some(field),
            Some(ColourBy::Nothing(_) | ColourBy::Labels(_)) => None,
            None if self.shows_surface_of_shell(view) => Some(FieldName::Displacement),
            None => Some(FieldName::VonMises),
        }
    }

    /// True if its axes are a patient's axes (x to the right, y to the front, z to the head). This holds if
    /// all bodies are meshed from images.
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

    /// Fields that colours can show on a body or a carried surface, or on all bodies together.
    pub fn fields_on(&self, on: Option<&str>) -> Vec<FieldName> {
        let fields = FieldName::ALL.into_iter();
        match self.carrier(on) {
            Some((_, BodyModel::Shell)) => vec![FieldName::Displacement],
            Some((_, model)) => fields.filter(|field| field.is_of(model) && field.is_of_surface()).collect(),
            None => {
                let shown = self.bodies.iter().filter(|(name, _)| on.is_none_or(|on| on == name));
                let models: Vec<BodyModel> = shown.map(|(_, body)| body.model).collect();
                fields.filter(|field| models.iter().any(|&model| field.is_of(model))).collect()
            }
        }
    }

    /// Returns the view for a section: a carried surface, which has no inside, is replaced by the body that
    /// carries it.
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

    /// Returns one table with all samples of the scene's tables: energies, all reactions, and the probes. If
    /// two tables have a probe of the same name, the later one gets the name of its table in front.
    pub fn sampled(&self) -> CsvTable {
        let mut probes = BTreeMap::new();
        for (name, output) in &self.outputs {
            let OutputTable::Csv(table) = output else { continue };
            for (probe, place) in &table.probes {
                let key = if probes.contains_key(probe) { format!("{name}.{probe}") } else { probe.clone() };
                probes.insert(key, place.clone());
            }
        }
        CsvTable { every: 1.0, reactions: None, moments_about: None, energy: true, probes }
    }

    /// Series of the frames of the scene's view, with displacements and the field of the colours.
    pub fn shown(&self, every: f64) -> VtuTable {
        match self.view.clip {
            Some(_) => self.shown_as(&self.in_section(&self.view), every),
            None => self.shown_as(&self.view, every),
        }
    }

    /// Series of constraints and loads, if the view marks them. For a carried surface, it is about the body
    /// that carries the surface.
    pub fn shown_marks(&self, every: f64) -> Option<VtuTable> {
        let data = vec![FieldName::Displacement, FieldName::Constraint, FieldName::Load, FieldName::Weight];
        let on = self.carrier(self.view.on.as_deref()).map(|(body, _)| body.clone());
        let on = on.or_else(|| self.view.on.clone());
        self.view.marks.then_some(VtuTable { on, every, data, at: At::Points, curved: None })
    }

    /// Series of the frames of another view.
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
        // The critical cell and the fibre directions are fields of cells.
        let cells = curved.is_some() || view.critical || view.fibres;
        let at = if cells && !self.shows_surface(view) { At::Cells } else { At::Points };
        VtuTable { on: on.cloned(), every, data, at, curved }
    }
}
