//! A field of a body or of a carried surface by name, as the outputs have it, for programs.

use std::borrow::Cow;

use pliant_format::tables::{At, FieldName, VtuTable};
use pliant_scene::World;
use pliant_sim::{Failure, Simulation};

use crate::output::{FieldMesh, frames};

/// A field by its name in outputs (`von-mises`).
///
/// # Errors
/// If there is no such field.
pub fn field_named(name: &str) -> Result<FieldName, Failure> {
    FieldName::ALL.into_iter().find(|field| field.name() == name).ok_or_else(|| {
        let names: Vec<&str> = FieldName::ALL.iter().map(|field| field.name()).collect();
        Failure::input(&format_args!("there is no field `{name}`; known fields: {}", names.join(", ")))
    })
}

/// Reads one field at instants.
pub struct FieldReader {
    mesh: FieldMesh,
    field: FieldName,
}

impl FieldReader {
    /// Opens a field by its name in outputs (`von-mises`) on a body or a carried surface, at points or cells.
    /// Without a body's name it covers all bodies together.
    ///
    /// # Errors
    /// If there is no such body or field, or the body doesn't have it.
    pub fn new(world: &World, on: Option<&str>, field: &str, at: At) -> Result<Self, Failure> {
        let name = field_named(field)?;
        if !world.participants.iter().any(|part| part.shows(on)) {
            let on = on.unwrap_or_default();
            return Err(Failure::input(&format_args!("there is no body or surface `{on}`")));
        }
        if !world.participants.iter().any(|part| !part.fields(&[name]).is_empty()) {
            return Err(Failure::input(&format_args!("no body of this scene has the field `{field}`")));
        }
        let table = VtuTable { on: on.map(str::to_owned), every: 1.0, data: vec![name], at, curved: None };
        Ok(Self { mesh: FieldMesh::new(world, &table), field: name })
    }

    /// Numbers of an item: 1, 3, or 9 of a tensor.
    pub fn components(&self) -> usize {
        self.field.components()
    }

    /// Takes the values at an instant whose forces are found.
    pub fn fill(&mut self, world: &World, simulation: &Simulation) {
        self.mesh.fill(&frames(world, simulation));
    }

    /// Returns the values last taken, one item after the other, in the order of the points or cells of the
    /// mesh. Values are `NaN` where a body lacks the field.
    ///
    /// # Errors
    /// If the body doesn't have the field.
    pub fn values(&self) -> Result<Cow<'_, [f64]>, Failure> {
        let (mesh, name) = (self.mesh.mesh(), self.field.name());
        if let Some(data) = mesh.point_data.get(name) {
            return Ok(Cow::Borrowed(&data.values));
        }
        let mut found = mesh.blocks.iter().filter_map(|block| block.data.get(name));
        match (found.next(), found.next()) {
            (Some(only), None) => Ok(Cow::Borrowed(&only.values)),
            (Some(first), Some(second)) => {
                let arrays = [first, second].into_iter().chain(found);
                Ok(Cow::Owned(arrays.flat_map(|data| &data.values).copied().collect()))
            }
            (None, _) => Err(Failure::input(&format_args!("this body has no field `{name}`"))),
        }
    }
}
