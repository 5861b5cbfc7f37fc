//! From a scene to a model: meshes read or made, laws assigned to cells, selections resolved, references
//! checked. All mistakes are collected with the user's own lines.
//!
//! The model is built in phases: [`Meshed`], [`Tied`], [`Loaded`], [`InContact`], [`Checked`], [`Started`].
//! Each phase is a type that owns its results and has the methods of the phases before it. The last one gives
//! [`Built`]. All phases share a [`Context`].

mod bodies;
mod built;
mod checks;
mod contacts;
mod context;
mod curves;
mod keys;
mod loads;
mod meshes;
mod start;
mod ties;

use pliant_format::Scene;
use pliant_format::diagnostic::{Diagnostic, SceneErrors};
use pliant_geometry::Mesh;

use crate::cache::MeshCache;
use bodies::Meshed;
pub(crate) use built::labels_of;
pub use built::{BodyLocator, Built, BuiltBody, Located};
pub(crate) use contacts::{Meet, overlaps, told_distance, told_overlap, touches, usual_distance};
use context::Context;
pub use meshes::SizeDoubt;
pub(crate) use ties::{Placed, attach, doubt_points, holds_nothing};

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

/// The progress of a mesh of an image or of the inside of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meshing<'a> {
    /// The body.
    pub body: &'a str,
    /// Part of the work, from 0 to 1.
    pub part: f64,
    /// The present work.
    pub now: &'static str,
}

/// Builds like [`build_with`]; `watch` receives the progress of meshes of images.
///
/// # Errors
/// All mistakes that were found, with their places.
pub(crate) fn build_watched(
    scene: &Scene,
    cache: &MeshCache,
    watch: &dyn Fn(Meshing<'_>),
) -> Result<Built, SceneErrors> {
    assembled(Context::new(scene, cache, watch), Vec::new())
}

/// The model of a scene, some of whose bodies have shapes already.
fn assembled(context: Context<'_>, shapes: Vec<BuiltBody>) -> Result<Built, SceneErrors> {
    let meshed = Meshed::new(context, shapes);
    let tied = meshed.tied()?;
    let loaded = tied.loaded();
    let mut in_contact = loaded.in_contact();
    // Bodies that need gaps between them get other shapes, and the assembly begins again.
    if let Some(ways) = in_contact.ways_to_gaps() {
        let (context, shapes) = in_contact.parted(&ways);
        return assembled(context, shapes);
    }
    let checked = in_contact.checked()?;
    let started = checked.started();
    started.built()
}

/// The mesh alone of a body of a scene, in metres, with remarks on how it was made.
///
/// # Errors
/// If the mesh has mistakes, or there is no such body.
pub fn mesh_of(
    scene: &Scene,
    body: &str,
    cache: &MeshCache,
    watch: &dyn Fn(Meshing<'_>),
) -> Result<(Mesh, Vec<String>), SceneErrors> {
    let mut context = Context::new(scene, cache, watch);
    let found = scene.bodies.iter().find(|(name, _)| name == body);
    let Some((_, table)) = found else {
        let missing = Diagnostic::error(format!("there is no body `{body}`"));
        return Err(scene.source.errors(vec![missing]));
    };
    match context.mesh(&table.mesh, &["body", body, "mesh"]) {
        Some(made) if !context.failed() => Ok((made.mesh, context.notes)),
        _ => Err(scene.source.errors(context.out)),
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
        let message = mistakes(
            "[load.a]\ntype = 'force'\non = 'cub'\nnodes = 'all'\ntotal = [0, 0, 1]\n\
             [output.h]\ntype = 'csv'\nevery = 1\nreactions = ['bse']\n",
        );
        let message = message.plain().to_string();
        assert!(
            message.contains("there is no body or surface `cub` (help: did you mean `cube`?)"),
            "{message}"
        );
        assert!(message.contains("there is no constraint `bse` (help: did you mean `base`?)"), "{message}");
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
