//! From a scene to a model: meshes read or made, laws assigned to cells, selections resolved, references checked.
//! All mistakes are collected with the user's own lines.

mod bodies;
mod constraints;
mod loads;
mod meshes;
mod surfaces;

use pliant_geometry::{Mesh, Surface};
use pliant_mechanics::Model;
use pliant_mechanics::curve::{Curve, Shape};

use crate::checker::nearest;
use crate::diagnostic::{Diagnostic, SceneErrors};
use crate::format::{CurveShape, Timing};
use crate::scene::Scene;
use crate::source::Source;

pub(crate) use meshes::MeshOrigin;

/// A model, and what the outputs need beside it.
#[derive(Clone, Debug)]
pub struct Built {
    /// The model.
    pub model: Model,
    /// The bodies' meshes, in the order of the model's bodies.
    pub bodies: Vec<BuiltBody>,
    /// The carried surfaces' meshes, in the order of the model's surfaces.
    pub surfaces: Vec<Mesh>,
    /// Doubts that did not keep the model from being built.
    pub warnings: Vec<Diagnostic>,
    /// What a user may want to know, a sentence each.
    pub notes: Vec<String>,
}

/// A body's mesh at rest, in metres.
#[derive(Clone, Debug)]
pub struct BuiltBody {
    /// Its name.
    pub name: String,
    /// The mesh in the user's numbering.
    pub mesh: Mesh,
    /// Where it comes from, in words.
    pub origin: String,
    /// Its boundary.
    pub boundary: Surface,
}

/// Builds the model of a scene.
///
/// # Errors
/// All mistakes that were found, with their places.
pub fn build(scene: &Scene) -> Result<Built, SceneErrors> {
    let mut builder = Builder {
        scene,
        model: Model::default(),
        bodies: Vec::new(),
        surfaces: Vec::new(),
        out: Vec::new(),
        notes: Vec::new(),
    };
    builder.add_bodies();
    if builder.failed() {
        return Err(scene.source.errors(builder.out));
    }
    builder.add_surfaces();
    builder.add_constraints();
    builder.add_loads();
    builder.check_outputs();
    builder.check_free_bodies();
    if builder.failed() {
        return Err(scene.source.errors(builder.out));
    }
    let Builder { model, bodies, surfaces, out: warnings, notes, .. } = builder;
    Ok(Built { model, bodies, surfaces, warnings, notes })
}

struct Builder<'s> {
    scene: &'s Scene,
    model: Model,
    bodies: Vec<BuiltBody>,
    surfaces: Vec<Mesh>,
    out: Vec<Diagnostic>,
    notes: Vec<String>,
}

/// What a load or an output acts on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    /// A body, by index.
    Body(usize),
    /// A carried surface, by index.
    Surface(usize),
}

impl<'s> Builder<'s> {
    fn failed(&self) -> bool {
        self.out.iter().any(Diagnostic::is_error)
    }

    fn source(&self) -> &'s Source {
        &self.scene.source
    }

    fn error(&mut self, path: &[&str], message: impl Into<String>, label: &str, help: impl Into<String>) {
        let place = self.source().span(path);
        self.out.push(Diagnostic::error(message).at(place, label).help(help));
    }

    /// The body of a name; a diagnostic at `path` if there is none.
    fn find_body(&mut self, name: &str, path: &[&str]) -> Option<usize> {
        let found = self.bodies.iter().position(|body| body.name == name);
        if found.is_none() {
            let known: Vec<&str> = self.bodies.iter().map(|body| body.name.as_str()).collect();
            let help = suggestion(name, &known, "bodies");
            self.error(path, format!("there is no body `{name}`"), "no such body", help);
        }
        found
    }

    /// The body or surface of a name; a diagnostic at `path` if there is none.
    fn find_target(&mut self, name: &str, path: &[&str]) -> Option<Target> {
        if let Some(index) = self.model.surfaces.iter().position(|surface| surface.name == name) {
            return Some(Target::Surface(index));
        }
        if self.bodies.iter().any(|body| body.name == name) {
            return self.find_body(name, path).map(Target::Body);
        }
        let bodies = self.bodies.iter().map(|body| body.name.as_str());
        let known: Vec<&str> = bodies.chain(self.model.surfaces.iter().map(|s| s.name.as_str())).collect();
        let help = suggestion(name, &known, "bodies and surfaces");
        self.error(path, format!("there is no body or surface `{name}`"), "no such body or surface", help);
        None
    }

    /// The curve of a timing; diagnostics in the table at `path`. Without a shape: a smooth step.
    fn curve(&mut self, timing: &Timing, path: &[&str]) -> Option<Curve> {
        let at = |key| [path, &[key]].concat();
        let until = self.scene.scene.until;
        let to = timing.to.unwrap_or(until);
        let shape = match timing.curve.as_ref().unwrap_or(&CurveShape::SmoothStep) {
            CurveShape::Ramp => Shape::Ramp,
            CurveShape::SmoothStep => Shape::SmoothStep,
            CurveShape::Polynomial => Shape::Polynomial,
            CurveShape::Hold => Shape::Hold,
            CurveShape::Table(points) => {
                if points.is_empty() || points.windows(2).any(|w| w[1][0] <= w[0][0]) {
                    let help = "give pairs [time, factor] with increasing times";
                    self.error(&at("curve"), "the times of the table do not increase", "this table", help);
                    return None;
                }
                if timing.to.is_some() || timing.from != 0.0 {
                    let help = "leave out `from` and `to`: the table has its own times";
                    self.error(&at("curve"), "a table goes with neither `from` nor `to`", "this table", help);
                    return None;
                }
                Shape::Table(points.iter().map(|&[time, factor]| (time, factor)).collect())
            }
        };
        if to <= timing.from && shape != Shape::Hold {
            let message = format!("`to` ({to} s) must be later than `from` ({} s)", timing.from);
            let key = if timing.to.is_some() { "to" } else { "from" };
            self.error(&at(key), message, "here", "`to` is the end of the scene unless it is given");
            return None;
        }
        Some(Curve { shape, from: timing.from, to })
    }
}

/// "did you mean …?" or a list of what there is.
fn suggestion(word: &str, known: &[&str], what: &str) -> String {
    match nearest(word, known.iter().copied()) {
        Some(name) => format!("did you mean `{name}`?"),
        None if known.is_empty() => format!("the scene has no {what}"),
        None => format!(
            "{what} of the scene: {}",
            known.iter().map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", ")
        ),
    }
}
