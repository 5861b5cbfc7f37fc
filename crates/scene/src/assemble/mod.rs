//! From a scene to a model: meshes read or made, laws assigned to cells, selections resolved, references checked.
//! All mistakes are collected with the user's own lines.

mod attach;
mod barriers;
mod bars;
mod bodies;
mod constraints;
mod contacts;
mod fibres;
mod fractions;
mod images;
mod implicit;
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
use pliant_format::tables::{CurveShape, SolverName, StepChoice, Timing};
use pliant_format::{SCENE, suggestion};
use pliant_geometry::{CellKind, Labels, Locator, Mesh, Surface, SurfaceLocator, Vector3};
use pliant_implicit::{Assembly, CurvedSurface};
use pliant_mechanics::Model;
use pliant_mechanics::curve::{Curve, Shape};
use pliant_sim::contact::touch::Contacts;
use pliant_sim::{BodyCells, ImplicitBodies, RunControl};

use crate::cache::MeshCache;
pub(crate) use attach::{Placed, attach, doubt_points};
use barriers::BarrierTables;
use contacts::Partner;
pub(crate) use contacts::{Meet, overlaps, told_distance, told_overlap, touches, usual_distance};
pub use mesh_files::SizeDoubt;
pub(crate) use meshes::MeshOrigin;
pub(crate) use ties::holds_nothing;

/// A model, and what the outputs need beside it.
#[derive(Clone, Debug)]
pub struct Built {
    /// The model.
    pub model: Arc<Model>,
    /// Shells, and solids whose equations are solved, on the nodes of the model.
    pub implicit: Option<Arc<ImplicitBodies>>,
    /// The bodies' meshes, in the order of the model's bodies.
    pub bodies: Vec<BuiltBody>,
    /// The carried surfaces' meshes, in the order of the model's surfaces.
    pub surfaces: Vec<Mesh>,
    /// Contacts with obstacles and tools.
    pub contacts: Option<Arc<Contacts>>,
    /// Whether states that are written are searched for intersections.
    pub check_intersections: bool,
    /// Surfaces that bodies of other participants touch.
    pub(crate) meets: Vec<Meet>,
    /// Displacements [m] of all nodes at the start, where bodies were pushed apart.
    pub pushed: Option<Arc<Vec<[f64; 3]>>>,
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
    /// Nodes in the mesh file, or of the built-in shape.
    file_nodes: usize,
    /// Number of each node in the mesh file; empty where no repair has changed it.
    file_numbers: Vec<u32>,
}

impl BuiltBody {
    /// Whether it is made of lines.
    pub(crate) fn is_of_bars(&self) -> bool {
        self.boundary.faces.is_empty()
    }

    /// Finds points of its body.
    pub fn locator(&self) -> BodyLocator<'_> {
        if self.mesh.volume_blocks().any(|block| !block.is_empty()) {
            return BodyLocator::Cells(&self.mesh, Locator::new(&self.mesh));
        }
        if self.is_of_bars() {
            return BodyLocator::Lines(&self.mesh);
        }
        let all: Vec<u32> = (0..self.boundary.faces.len() as u32).collect();
        BodyLocator::Wall(&self.boundary, SurfaceLocator::new(&self.boundary, &all, &self.mesh.points))
    }

    /// The number that a node has in the mesh file, or in the mesh that a program gives.
    pub fn number_in_file(&self, node: u32) -> u32 {
        self.file_numbers.get(node as usize).copied().unwrap_or(node)
    }
}

/// Finds the cell of a solid, the triangle of a thin wall, or the bar that is nearest to a point.
pub enum BodyLocator<'b> {
    /// In the cells of a solid.
    Cells(&'b Mesh, Locator),
    /// On triangles.
    Wall(&'b Surface, SurfaceLocator),
    /// On bars, one after another: they are few.
    Lines(&'b Mesh),
}

/// The place of a point in a body.
pub struct Located {
    /// The kind of the cell that is nearest.
    pub kind: CellKind,
    /// Its number in its block.
    pub cell: u32,
    /// Nodes of the mesh with their weights.
    pub weights: Vec<(u32, f64)>,
    /// How far outside the cell the point is [m].
    pub distance: f64,
}

impl BodyLocator<'_> {
    /// The place of a point at rest [m]; `None` without cells.
    pub fn locate(&self, point: &Vector3) -> Option<Located> {
        match self {
            Self::Cells(mesh, cells) => {
                let found = cells.locate(*point)?;
                let nodes = mesh.block(found.kind)?.cell(found.cell as usize);
                Some(Located {
                    kind: found.kind,
                    cell: found.cell,
                    weights: nodes.iter().copied().zip(found.weights().iter().copied()).collect(),
                    distance: found.distance,
                })
            }
            Self::Wall(surface, triangles) => {
                let found = triangles.closest(point)?;
                let parent = surface.faces[found.face as usize].parent;
                Some(Located {
                    kind: parent.kind,
                    cell: parent.index,
                    weights: found.nodes.into_iter().zip(found.weights).collect(),
                    distance: (found.position - point).norm(),
                })
            }
            Self::Lines(mesh) => {
                let nearest = |(cell, nodes): (u32, &[u32])| {
                    let [a, b] = [0, 1].map(|k| mesh.points[nodes[k] as usize]);
                    let part = ((point - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
                    Located {
                        kind: CellKind::Line,
                        cell,
                        weights: vec![(nodes[0], 1.0 - part), (nodes[1], part)],
                        distance: (a + (b - a) * part - point).norm(),
                    }
                };
                let lines = (0..).zip(mesh.block(CellKind::Line)?.cells());
                lines.map(nearest).min_by(|a, b| a.distance.total_cmp(&b.distance))
            }
        }
    }
}

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

/// The labels of a body or a surface by name, or of all bodies.
pub(crate) fn labels_of(model: &Model, bodies: &[BuiltBody], surfaces: &[Mesh], on: Option<&str>) -> Labels {
    let named = model.surfaces.iter().zip(surfaces).find(|(surface, _)| Some(surface.name.as_str()) == on);
    if let Some((_, mesh)) = named {
        return Labels::of(mesh);
    }
    let mut labels = Labels::default();
    for body in bodies.iter().filter(|body| on.is_none_or(|on| body.name == on)) {
        labels.join(Labels::of(&body.mesh));
    }
    labels
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

    /// The curve of a motion or a load. What it has at t = 0 comes in within the first load step of a static run, so that the step can be
    /// halved.
    fn course(&mut self, timing: &Timing, path: &[&str]) -> Option<Curve> {
        let curve = self.curve(timing, path)?;
        Some(self.eased(curve))
    }

    /// In a static run the [same curve from rest](Curve::from_rest).
    fn eased(&self, curve: Curve) -> Curve {
        let (run, until) = (&self.scene.run, self.scene.scene.until);
        match (run.solver, run.step) {
            (SolverName::Static, StepChoice::Seconds(step)) => curve.from_rest(step.min(until)),
            (SolverName::Static, StepChoice::Auto(_)) => curve.from_rest(run.load_steps.first(until)),
            _ => curve,
        }
    }

    /// The curve of a timing; diagnostics in the table at `path`. Without a shape: a smooth step.
    fn curve(&mut self, timing: &Timing, path: &[&str]) -> Option<Curve> {
        let at = |key| [path, &[key]].concat();
        let until = self.scene.scene.until;
        let mut to = timing.to.unwrap_or(until);
        let shape = match timing.curve.as_ref().unwrap_or(&CurveShape::SmoothStep) {
            CurveShape::Ramp => Shape::Ramp,
            CurveShape::SmoothStep => Shape::SmoothStep,
            CurveShape::Polynomial => Shape::Polynomial,
            CurveShape::Hold => Shape::Hold,
            CurveShape::Wave(_) if timing.to.is_some() => {
                let help = "leave out `to`: a wave goes on to the end of the scene";
                self.error(&at("to"), "a wave does not end", "here", help);
                return None;
            }
            CurveShape::Wave(period) if *period <= 0.0 => {
                let message = format!("the period of the wave must be greater than 0, found {period}");
                self.error(&at("curve"), message, "this wave", "give seconds");
                return None;
            }
            &CurveShape::Wave(period) => {
                to = timing.from + period;
                Shape::Wave
            }
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
        self.note_timing(&shape, [timing.from, to], path);
        // These two have no end, and are the same whenever the scene ends.
        let to = if matches!(shape, Shape::Hold | Shape::Table(_)) { timing.from } else { to };
        Some(Curve { shape, from: timing.from, to })
    }

    /// Says what the end of the scene cuts off.
    fn note_timing(&mut self, shape: &Shape, [from, to]: [f64; 2], path: &[&str]) {
        let (name, until) = (path.join("."), self.scene.scene.until);
        let (begins, ends) = match shape {
            Shape::Table(points) => (points.first().map_or(0.0, |first| first.0), until),
            Shape::Hold | Shape::Wave => (from, from),
            _ => (from, to),
        };
        if begins >= until && begins > 0.0 {
            let message = format!("`{name}` begins at {begins} s, but the scene ends at {until} s");
            let place = self.source().key_span(path);
            let help = "let it begin earlier, or the scene last longer (`until`)";
            self.out.push(Diagnostic::warning(message).at(place, "never begins").help(help));
        } else if ends > until {
            self.notes.push(format!("`{name}` is complete at {ends} s, but the scene ends at {until} s"));
        }
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
    use crate::testing::{CUBE, built, mistakes, read};

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
    fn a_motion_that_the_end_cuts_off_is_noted() {
        let moved = |timing: &str| {
            built(&format!(
                "[constraint.top]\ntype = 'move'\nbody = 'cube'\nnodes = {{ set = 'z-max' }}\nby = [0, 0, 1e-3]\n{timing}\n"
            ))
        };
        assert!(moved("").notes.is_empty() && moved("to = 0.1").notes.is_empty());
        assert_eq!(
            moved("to = 0.5").notes,
            ["`constraint.top` is complete at 0.5 s, but the scene ends at 0.1 s"]
        );
        let late = moved("from = 0.2\nto = 0.5");
        assert!(late.warnings[0].message.contains("begins at 0.2 s"), "{:?}", late.warnings);
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
