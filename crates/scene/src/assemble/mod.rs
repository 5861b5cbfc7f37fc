//! From a scene to a model: meshes read or made, laws assigned to cells, selections resolved, references checked.
//! All mistakes are collected with the user's own lines.

mod attach;
mod barriers;
mod bars;
mod bodies;
mod built;
mod constraints;
mod contacts;
mod curves;
mod fibres;
mod fractions;
mod images;
mod implicit;
mod keys;
mod loads;
mod mass;
mod mesh_files;
mod meshes;
mod mortar;
mod node_vectors;
mod obstacles;
mod separate;
mod sheets;
mod slivers;
mod surfaces;
mod ties;
mod turns;
mod walls;

use std::collections::HashSet;
use std::sync::Arc;

use pliant_format::Scene;
use pliant_format::diagnostic::{Diagnostic, SceneErrors};
use pliant_format::source::Source;
use pliant_format::{SCENE, suggestion};
use pliant_geometry::Mesh;
use pliant_implicit::{Assembly, CurvedSurface};
use pliant_sim::{BodyCells, ImplicitBodies, RunControl};

use crate::cache::MeshCache;
pub(crate) use attach::{Placed, attach, doubt_points};
use barriers::BarrierTables;
pub(crate) use built::labels_of;
pub use built::{BodyLocator, Built, BuiltBody, Located};
use contacts::Partner;
pub(crate) use contacts::{Meet, overlaps, told_distance, told_overlap, touches, usual_distance};
pub use mesh_files::SizeDoubt;
pub(crate) use meshes::MeshOrigin;
pub(crate) use ties::holds_nothing;

/// Builds the model of a scene; meshes of images are made anew.
///
/// # Errors
/// All mistakes that were found, with their places.
pub fn build(scene: &Scene) -> Result<Built, SceneErrors> {
    build_with(scene, &MeshCache::off())
}

/// Builds the model of a scene with the meshes of images that are kept.
///
/// # Errors
/// All mistakes that were found, with their places.
pub fn build_with(scene: &Scene, cache: &MeshCache) -> Result<Built, SceneErrors> {
    build_watched(scene, cache, &|_| {})
}

/// How far the mesh of an image or of what a surface encloses is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meshing<'a> {
    /// The body.
    pub body: &'a str,
    /// Part of the work, from 0 to 1.
    pub part: f64,
    /// What is being done.
    pub now: &'static str,
}

/// As [`build_with`]; `watch` receives the progress of meshes of images.
///
/// # Errors
/// All mistakes that were found, with their places.
pub(crate) fn build_watched(
    scene: &Scene,
    cache: &MeshCache,
    watch: &dyn Fn(Meshing<'_>),
) -> Result<Built, SceneErrors> {
    assembled(Builder::new(scene, cache, watch))
}

/// The model of a builder.
fn assembled(mut builder: Builder<'_>) -> Result<Built, SceneErrors> {
    let scene = builder.scene;
    builder.check_models();
    builder.add_bodies();
    let noted = builder.notes.len();
    if !builder.failed() {
        builder.add_ties();
    }
    builder.check_explicit_only();
    if builder.failed() {
        return Err(scene.source.errors(builder.out));
    }
    builder.add_surfaces();
    builder.add_constraints();
    builder.check_turns();
    builder.add_loads();
    let (mut contacts, barriers) = builder.contacts().unzip();
    if let (Some(contacts), false, false) = (&contacts, builder.is_parted, builder.failed())
        && let Some(parted) = builder.part_at_rest(contacts)
    {
        return assembled(builder.again_with(parted, noted));
    }
    let meets = builder.meets();
    builder.note_touching(contacts.as_deref(), &meets);
    builder.check_outputs();
    builder.check_view();
    builder.check_free_bodies();
    builder.check_held();
    if !builder.failed() {
        builder.scale_mass();
    }
    let mut start = if builder.failed() { None } else { builder.start() };
    let with_barriers = barriers.as_ref().filter(|_| scene.run.solver.solves_equations());
    if let (Some(contacts), Some(barriers), Some(start)) = (&contacts, with_barriers, &start) {
        builder.find_meetings(contacts, barriers, start);
    }
    let distances = with_barriers.map(BarrierTables::distances).unwrap_or_default();
    let pushed = match builder.failed() {
        true => None,
        false => builder.separate(contacts.as_deref(), &distances, start.as_ref()),
    };
    if let (Some(start), Some(pushed)) = (&mut start, &pushed) {
        builder.place(start, pushed);
    }
    if let (Some(contacts), false) = (&mut contacts, builder.failed()) {
        builder.find_near(Arc::make_mut(contacts), pushed.as_ref().map(|moved| &moved[..]));
    }
    let is_explicit = !scene.run.solver.solves_equations();
    let check_intersections = is_explicit && barriers.as_ref().is_some_and(|barriers| barriers.check);
    if let (Some(contacts), Some(barriers), Some(start), true) =
        (&contacts, barriers, &start, scene.run.solver.solves_equations())
    {
        builder.touch(contacts, barriers, start);
    }
    if builder.failed() {
        return Err(scene.source.errors(builder.out));
    }
    let Builder { assembly, cells, control, curved, bodies, surfaces, out: warnings, mut notes, .. } =
        builder;
    let mut told = HashSet::new();
    notes.retain(|note| told.insert(note.clone()));
    let model = Arc::clone(&assembly.model);
    let implicit = start.map(|start| {
        Arc::new(ImplicitBodies { model: Arc::new(assembly), cells, control, start, surface: curved })
    });
    Ok(Built {
        model,
        implicit,
        bodies,
        surfaces,
        contacts,
        check_intersections,
        meets,
        pushed,
        warnings,
        notes,
    })
}

/// The mesh alone of a body of a scene, in metres, with remarks on how it was made.
///
/// # Errors
/// What is wrong with the mesh, or that there is no such body.
pub fn mesh_of(
    scene: &Scene,
    body: &str,
    cache: &MeshCache,
    watch: &dyn Fn(Meshing<'_>),
) -> Result<(Mesh, Vec<String>), SceneErrors> {
    let mut builder = Builder::new(scene, cache, watch);
    let found = scene.bodies.iter().find(|(name, _)| name == body);
    let Some((_, table)) = found else {
        let missing = Diagnostic::error(format!("there is no body `{body}`"));
        return Err(scene.source.errors(vec![missing]));
    };
    match builder.mesh(&table.mesh, &["body", body, "mesh"]) {
        Some(made) if !builder.failed() => Ok((made.mesh, builder.notes)),
        _ => Err(scene.source.errors(builder.out)),
    }
}

struct Builder<'s> {
    scene: &'s Scene,
    cache: &'s MeshCache,
    watch: &'s dyn Fn(Meshing<'_>),
    /// All bodies; shells in scenes with some.
    assembly: Assembly,
    /// Those of each body that an implicit solver advances.
    cells: Vec<BodyCells>,
    control: Option<RunControl>,
    /// The curved surface of the shells, if something is carried by it.
    curved: Option<CurvedSurface>,
    bodies: Vec<BuiltBody>,
    surfaces: Vec<Mesh>,
    out: Vec<Diagnostic>,
    notes: Vec<String>,
    /// Whether each body touches something, once that is known.
    touching: Option<Vec<bool>>,
    /// A contact whose bodies overlap at the start, and are to be pushed apart.
    overlapping: Option<String>,
    /// The gap [m] that each contact gets between shapes at rest.
    gaps: Vec<Option<f64>>,
    /// Bodies whose shapes are known, with their gaps.
    parted: Vec<BuiltBody>,
    is_parted: bool,
}

/// What a load or an output acts on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Subject {
    /// A body, by index.
    Body(usize),
    /// A carried surface, by index.
    Surface(usize),
}

impl<'s> Builder<'s> {
    fn new(scene: &'s Scene, cache: &'s MeshCache, watch: &'s dyn Fn(Meshing<'_>)) -> Self {
        Self {
            scene,
            cache,
            watch,
            assembly: Assembly::default(),
            cells: Vec::new(),
            control: None,
            curved: None,
            bodies: Vec::new(),
            surfaces: Vec::new(),
            out: scene.doubts.clone(),
            notes: Vec::new(),
            touching: None,
            overlapping: None,
            gaps: Vec::new(),
            parted: Vec::new(),
            is_parted: false,
        }
    }

    /// A new builder that has the shapes of bodies, with the remarks on how they were made: the first ones, and that on how they were parted.
    fn again_with(mut self, parted: Vec<BuiltBody>, noted: usize) -> Self {
        self.notes.drain(noted..self.notes.len() - 1);
        let fresh = Self::new(self.scene, self.cache, self.watch);
        Self { parted, is_parted: true, notes: self.notes, ..fresh }
    }

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
            let help = suggestion(name, &known, SCENE, "bodies");
            self.error(path, format!("there is no body `{name}`"), "no such body", help);
        }
        found
    }

    /// The body or surface of a name; a diagnostic at `path` if there is none.
    fn find_target(&mut self, name: &str, path: &[&str]) -> Option<Subject> {
        if let Some(index) = self.assembly.surfaces.iter().position(|surface| surface.name == name) {
            return Some(Subject::Surface(index));
        }
        if self.bodies.iter().any(|body| body.name == name) {
            return self.find_body(name, path).map(Subject::Body);
        }
        let bodies = self.bodies.iter().map(|body| body.name.as_str());
        let known: Vec<&str> = bodies.chain(self.assembly.surfaces.iter().map(|s| s.name.as_str())).collect();
        let help = suggestion(name, &known, SCENE, "bodies and surfaces");
        self.error(path, format!("there is no body or surface `{name}`"), "no such body or surface", help);
        None
    }
}

/// A place [m] in messages.
fn in_metres(place: impl Into<[f64; 3]>) -> String {
    let [x, y, z] = place.into().map(pliant_geometry::words::number);
    format!("({x}, {y}, {z}) m")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{CUBE, mistakes, read};

    #[test]
    fn mistakes_of_several_tables_are_told_together() {
        let told = mistakes(
            "[load.a]\ntype = 'force'\non = 'cub'\nnodes = 'all'\ntotal = [0, 0, 1]\n\
             [output.h]\ntype = 'csv'\nevery = 1\nreactions = ['bse']\n",
        );
        let told = told.plain().to_string();
        assert!(told.contains("there is no body or surface `cub` (help: did you mean `cube`?)"), "{told}");
        assert!(told.contains("there is no constraint `bse` (help: did you mean `base`?)"), "{told}");
    }

    #[test]
    fn what_no_body_uses_and_nothing_holds_is_noted() {
        let free = &CUBE[..CUBE.find("[constraint").unwrap()];
        let scene =
            read(&format!("{free}[law.spare]\ntype = 'neo-hookean'\nyoung-modulus = 1\npoisson-ratio = 0\n"));
        let notes = build(&scene).unwrap().notes;
        assert_eq!(
            notes,
            ["law `spare` is used by no body", "`cube` is held by no constraint: and nothing moves it"]
        );
    }
}
