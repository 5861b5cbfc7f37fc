//! Pictures and films of a scene, of a finished run or of a mesh, and the picture of `pliant run --picture`.

use std::path::{Path, PathBuf};

use pliant_format::Scene;
use pliant_format::registry::OutputTable;
use pliant_format::tables::{ClipTable, VtuTable};
use pliant_geometry::{CellLabel, Labels, Mesh, RegionNames, Vector3, io};
use pliant_picture::{
    AnimatedPng, Axis, Film, Graphics, Legend, Look, Picture, PictureError, Plane, Projection, Regions,
    Series, SeriesError, Style, ffmpeg,
};
use pliant_run::{Draw, Options, OutputFolder};
use pliant_scene::World;
use pliant_viewer::{coat_of, regions_of};

use crate::SUCCESS;
use crate::arguments::{Frames, Overrides, Render};
use crate::look::{background_of, colour_by_name, look_of, map_of, texture_of};
use crate::prepare::prepare_changed;
use crate::report::{Bar, Failure, say};
use crate::signals;

impl From<PictureError> for Failure {
    fn from(error: PictureError) -> Self {
        Self::plain(&error, error.remedy())
    }
}

impl From<SeriesError> for Failure {
    fn from(error: SeriesError) -> Self {
        Self::plain(&error, error.remedy())
    }
}

/// Command-line options override the scene.
fn typed(look: &mut Look, arguments: &Render) {
    let style = &mut look.style;
    style.map = arguments.map.map_or(style.map, map_of);
    style.background = arguments.background.map_or(style.background, background_of);
    style.texture = arguments.texture.map_or(style.texture, texture_of);
    style.range = arguments.range.or(style.range);
    style.edges |= arguments.edges;
    style.wireframe |= arguments.wireframe;
    style.ghost |= arguments.ghost;
    style.fibres |= arguments.fibres;
    style.contacts |= arguments.contacts;
    style.critical |= arguments.critical;
    style.maximum &= !arguments.no_maximum;
    if let Some([x, y, z, nx, ny, nz]) = arguments.clip {
        style.clip = Plane::through(&Vector3::new(x, y, z), &Vector3::new(nx, ny, nz));
    }
    if let Some([azimuth, elevation]) = arguments.camera {
        (look.camera.azimuth, look.camera.elevation) = (azimuth, elevation);
    }
    look.camera.up = match arguments.up.as_deref() {
        Some("x") => Axis::X,
        Some("y") => Axis::Y,
        Some("z") => Axis::Z,
        Some("-x") => Axis::MinusX,
        Some("-y") => Axis::MinusY,
        Some("-z") => Axis::MinusZ,
        _ => look.camera.up,
    };
    if arguments.orthographic {
        look.camera.projection = Projection::Orthographic;
    }
    look.zoom = arguments.zoom.unwrap_or(look.zoom);
    look.size = arguments.size.unwrap_or(look.size);
    if let Some(name) = &arguments.colour {
        // A different field has a different range.
        if look.field.as_ref() != Some(name) {
            look.style.range = arguments.range;
        }
        colour_by_name(look, name);
    }
}

/// Draws the final state of a run.
#[derive(Debug)]
pub struct FinalPicture {
    look: Look,
    graphics: Graphics,
}

impl FinalPicture {
    /// With the look of a world.
    ///
    /// # Errors
    /// If nothing can draw.
    pub fn new(world: &World) -> Result<Self, PictureError> {
        Ok(Self { look: look_of_world(world), graphics: Graphics::open()? })
    }
}

/// The look of pictures of a world, as its `[view]` asks.
pub fn look_of_world(world: &World) -> Look {
    Look { regions: regions_of_scene(world), ..look_of(&world.scene) }
}

impl Draw for FinalPicture {
    fn draw(&self, mesh: &Mesh, marks: Option<&Mesh>, time: f64) -> Result<Vec<u8>, String> {
        let picture =
            self.look.picture(&self.graphics, mesh, marks, time).map_err(|error| error.to_string())?;
        picture.png().map_err(|error| error.to_string())
    }
}

/// Draws a scene, a finished run or a mesh.
pub(super) fn draw(arguments: &Render, film: Option<FilmKind>) -> Result<u8, Failure> {
    let graphics = Graphics::open()?;
    let folder = claim(arguments, is_picture)?;
    if is_folder_of_run(&arguments.what) {
        refuse_words_of_scenes(arguments)?;
        let series = Series::find(&arguments.what, arguments.series.as_deref())?;
        let style = Style { maximum: true, ..Style::default() };
        let mut look = Look { size: [1280, 800], style, ..Look::default() };
        let usual = ["von-mises", "displacement"];
        if let Some(field) = series.first_field(&usual)? {
            colour_by_name(&mut look, field);
        }
        typed(&mut look, arguments);
        if arguments.marks {
            look.marks = Some(Series::of_marks(&arguments.what)?);
        }
        if !arguments.hide.is_empty() || !arguments.look.is_empty() {
            typed_regions(&mut look.regions, &series.regions()?, arguments)?;
        }
        return shoot(arguments, &look, &graphics, &series, &folder, film);
    }
    if arguments.series.is_some() {
        return Err(Failure::plain("`--series` chooses among the series of a finished run", "leave it out"));
    }
    if let Some(mesh) = labelled_mesh(arguments)? {
        return portrait(arguments, &mesh, &graphics, &folder);
    }
    let Some(shown) = run_scene(&arguments.what, arguments)? else {
        return Ok(signals::exit_code());
    };
    let code = shoot(arguments, &shown.look, &graphics, &shown.series, &folder, film)?;
    // The pictures of a failed run are still useful.
    Ok(if shown.failed { 1 } else { code })
}

/// Regions that the view of a scene hides, or shows with a look of their own.
fn regions_of_scene(world: &World) -> Regions {
    let view = &world.scene.view;
    regions_of(view, &world.region_names(view.on.as_deref()))
}

/// Hides what the command line names, and gives it looks of its own.
fn typed_regions(regions: &mut Regions, names: &RegionNames, arguments: &Render) -> Result<(), Failure> {
    let find = |option: &str, name: &CellLabel| {
        let help = format!(
            "`{option}` takes labels by number, name and range, and bodies, obstacles and tools by name"
        );
        names.find(name).map_err(|error| Failure::plain(error, &help))
    };
    for name in &arguments.hide {
        regions.hidden.extend(find("--hide", name)?);
    }
    for (name, look) in &arguments.look {
        let found = find("--look", name)?;
        regions.coats.splice(..0, found.into_iter().map(|region| (region, coat_of(*look))));
    }
    Ok(())
}

/// The mesh of a file that is drawn without a run: it has labels, and no option needs a run.
fn labelled_mesh(arguments: &Render) -> Result<Option<Mesh>, Failure> {
    let of_cells = matches!(arguments.colour.as_deref(), None | Some("label" | "none"));
    let runs = arguments.film.is_some() || arguments.frames.is_some() || changes_a_run(arguments);
    let marks = arguments.critical || arguments.fibres || arguments.contacts || arguments.marks;
    if !of_cells || runs || marks || !pliant_format::is_mesh(&arguments.what) {
        return Ok(None);
    }
    let file = io::read(&arguments.what).map_err(|error| Failure::plain(error, "check the path"))?;
    Ok(Some(file.mesh).filter(|mesh| !Labels::of(mesh).is_empty()))
}

/// Draws a mesh alone, in the colours of its labels.
fn portrait(
    arguments: &Render,
    mesh: &Mesh,
    graphics: &Graphics,
    folder: &OutputFolder,
) -> Result<u8, Failure> {
    let cells: usize = mesh.blocks.iter().map(|block| block.len()).sum();
    let note = format!("{} nodes, {cells} cells", mesh.points.len());
    let title =
        arguments.what.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let legend = Legend { title, note, ..Legend::default() };
    let mut look = Look { size: [1280, 800], legend, ..Look::default() };
    look.style.labels = true;
    typed(&mut look, arguments);
    typed_regions(&mut look.regions, &RegionNames::of(mesh), arguments)?;
    let picture = look.picture(graphics, mesh, None, 0.0)?;
    save(folder, &picture_name(0), &picture)?;
    say(format_args!("wrote {} in {} ({})", picture_name(0), folder.path().display(), graphics.adapter()))?;
    Ok(SUCCESS)
}

pub(super) fn claim(arguments: &Render, is_own: fn(&str) -> bool) -> Result<OutputFolder, Failure> {
    OutputFolder::claim(arguments.out.clone(), arguments.force, is_own)
        .map_err(|error| Failure::plain(&error, error.remedy))
}

/// A scene after the run for its pictures.
pub(super) struct Shown {
    pub look: Look,
    pub series: Series,
    pub title: String,
    pub failed: bool,
    /// Keeps the frames until they are drawn.
    _space: tempfile::TempDir,
}

/// Runs a scene with only the displayed series as its output; `None` if it was interrupted.
pub(super) fn run_scene(path: &Path, arguments: &Render) -> Result<Option<Shown>, Failure> {
    let space = tempfile::tempdir().map_err(|error| {
        Failure::plain(
            format!("no temporary folder can be made: {error}"),
            "check the free space, or set TMPDIR",
        )
    })?;
    let overrides = with_view(arguments);
    let mut every = 0.0;
    let mut world = prepare_changed(path, &overrides, |scene| every = forget_outputs(scene, arguments))?;
    let shown = world.scene.shown(every);
    let marks = world.scene.shown_marks(every);
    let series = [("shown", Some(shown)), ("marks", marks)];
    let table = |(name, table): (&str, Option<_>)| Some((name.into(), OutputTable::Vtu(table?)));
    world.scene.outputs = series.into_iter().filter_map(table).collect();
    let scene = &world.scene;
    let mut look = Look { regions: regions_of_scene(&world), ..look_of(scene) };
    typed(&mut look, arguments);
    typed_regions(&mut look.regions, &world.region_names(scene.view.on.as_deref()), arguments)?;
    let run = OutputFolder::prepare(space.path().join("run"), scene, false)
        .map_err(|error| Failure::plain(&error, error.remedy))?;
    let bar = Bar::new();
    let options = Options { stop: Some(signals::stop()), ..Options::default() };
    let result = pliant_run::run_with(&world, &run, options, &mut |progress| bar.update(progress));
    bar.finish();
    let summary = result.map_err(|error| Failure::plain(&error, error.remedy))?;
    for warning in &summary.warnings {
        eprintln!("warning: {warning}");
    }
    if summary.status == "interrupted" {
        eprintln!("error: the run was interrupted; no pictures were made");
        return Ok(None);
    }
    if let Some(error) = &summary.error {
        eprintln!("error: {}", error.message);
    }
    let series = Series::find(run.path(), Some("shown"))?;
    if scene.view.marks {
        look.marks = Some(Series::find(run.path(), Some("marks"))?);
    }
    look.legend.unconverged = summary.solver.as_ref().map_or(0, |effort| effort.unconverged);
    let failed = summary.error.is_some();
    Ok(Some(Shown { look, series, title: scene.scene.title.clone(), failed, _space: space }))
}

/// True if a path is the folder of a run, not of a scene.
pub(super) fn is_folder_of_run(path: &Path) -> bool {
    path.is_dir() && !path.join("scene.toml").exists()
}

/// True if options change how a scene runs.
fn changes_a_run(arguments: &Render) -> bool {
    let changes = &arguments.overrides;
    !changes.set.is_empty()
        || [changes.until, changes.step, arguments.every].iter().any(Option::is_some)
        || changes.threads.is_some()
        || changes.precision.is_some()
        || changes.device.is_some()
}

/// True if options choose instants.
fn changes_time(arguments: &Render) -> bool {
    arguments.film.is_some() || arguments.frames.is_some() || arguments.overrides.until.is_some()
}

fn refuse_words_of_scenes(arguments: &Render) -> Result<(), Failure> {
    if changes_a_run(arguments) {
        let message =
            format!("`{}` is a finished run: its scene cannot be changed", arguments.what.display());
        return Err(Failure::plain(message, "give the scene, or omit these options"));
    }
    Ok(())
}

/// Removes the outputs of a scene; returns the simulated time between the displayed frames [s].
fn forget_outputs(scene: &mut Scene, arguments: &Render) -> f64 {
    let interval = std::mem::take(&mut scene.outputs).into_iter().find_map(|(_, output)| match output {
        OutputTable::Vtu(VtuTable { every, .. }) => Some(every),
        OutputTable::Csv(_) => None,
    });
    if let Some(at) = scene.view.at.filter(|_| !changes_time(arguments)) {
        scene.scene.until = at.min(scene.scene.until);
    }
    // A different field does not use the scene's component.
    if arguments.colour.as_ref().is_some_and(|name| !name.contains(':')) {
        scene.view.component = None;
    }
    // A section shows the body that carries a surface: the surface has no inside.
    if let Some([x, y, z, nx, ny, nz]) = arguments.clip {
        scene.view.clip = Some(ClipTable { point: [x, y, z], normal: [nx, ny, nz] });
    }
    scene.view.fibres |= arguments.fibres;
    scene.view.contacts |= arguments.contacts;
    scene.view.marks |= arguments.marks;
    scene.view.critical |= arguments.critical;
    arguments.every.or(interval).unwrap_or(0.01 * scene.scene.until)
}

/// Adds colour and hidden labels of the command line to the scene's values, so that the scene checks them.
fn with_view(arguments: &Render) -> Overrides {
    let mut overrides = arguments.overrides.clone();
    if let Some(name) = arguments.colour.as_deref() {
        let (field, part) = name.split_once(':').map_or((name, None), |(field, part)| (field, Some(part)));
        overrides.set.push(format!("view.colour={field}"));
        overrides.set.extend(part.map(|part| format!("view.component={part}")));
    }
    if !arguments.hide.is_empty() {
        overrides.set.push(format!("view.hide={}", serde_json::json!(arguments.hide)));
    }
    overrides
}

/// The name of a picture in its folder.
fn picture_name(number: usize) -> String {
    format!("frame-{number:05}.png")
}

fn is_picture(name: &str) -> bool {
    name.strip_prefix("frame-")
        .and_then(|rest| rest.strip_suffix(".png"))
        .is_some_and(|n| n.parse::<usize>().is_ok())
}

/// The format of a film.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FilmKind {
    Mp4,
    Png,
}

/// By the file extension.
pub(super) fn film_kind(path: &Path) -> Result<FilmKind, Failure> {
    match path.extension().and_then(|ending| ending.to_str()) {
        Some("mp4") => Ok(FilmKind::Mp4),
        Some("png" | "apng") => Ok(FilmKind::Png),
        _ => {
            let message = format!("`{}` is not a name for a film", path.display());
            Err(Failure::plain(message, "end it in .mp4, or in .png for an animated PNG"))
        }
    }
}

enum Reel {
    None,
    Mp4(Film),
    Png(Box<AnimatedPng>),
}

impl Reel {
    fn add(&mut self, picture: &Picture) -> Result<(), PictureError> {
        match self {
            Self::None => Ok(()),
            Self::Mp4(film) => film.add(picture),
            Self::Png(film) => film.add(picture),
        }
    }

    fn finish(self) -> Result<(), PictureError> {
        match self {
            Self::None => Ok(()),
            Self::Mp4(film) => film.finish(),
            Self::Png(film) => film.finish(),
        }
    }
}

/// Draws the pictures of a series.
fn shoot(
    arguments: &Render,
    look: &Look,
    graphics: &Graphics,
    series: &Series,
    folder: &OutputFolder,
    film: Option<FilmKind>,
) -> Result<u8, Failure> {
    let frames = chosen(arguments, series)?;
    let (mut reel, path) = start_film(arguments, look, series, &frames, film)?;
    let bar = Bar::new();
    let done = look.pictures(graphics, series, &frames, |count, picture| {
        save(folder, &picture_name(frames[count]), &picture)?;
        bar.show(count as f64 / frames.len() as f64, "drawing pictures");
        reel.add(&picture)
    });
    bar.finish();
    done?;
    reel.finish()?;
    let names = match frames[..] {
        [one] => picture_name(one),
        [first, .., last] => format!("{} … {}", picture_name(first), picture_name(last)),
        [] => String::new(),
    };
    say(format_args!("wrote {} in {} ({})", names, folder.path().display(), graphics.adapter()))?;
    if let Some(path) = path {
        say(format_args!("wrote {}", path.display()))?;
    }
    Ok(SUCCESS)
}

/// Writes a picture into the folder.
pub(super) fn save(folder: &OutputFolder, name: &str, picture: &Picture) -> Result<(), PictureError> {
    let written = folder.write(name, picture.png()?);
    written.map(|_| ()).map_err(|error| PictureError::Write { path: error.path, reason: error.reason })
}

/// The requested frames; by default the last one, or all for a film.
fn chosen(arguments: &Render, series: &Series) -> Result<Vec<usize>, Failure> {
    let count = series.frames.len();
    let usual = if arguments.film.is_some() { Frames::All } else { Frames::Last };
    let frames: Vec<usize> = match arguments.frames.unwrap_or(usual) {
        Frames::All => (0..count).collect(),
        Frames::Last => vec![count - 1],
        Frames::One(frame) => (frame..count.min(frame + 1)).collect(),
        Frames::Range(from, to) => (from..to.unwrap_or(count).min(count)).collect(),
    };
    if frames.is_empty() {
        let message = format!("series `{}` has {count} frames, from 0 to {}", series.name, count - 1);
        return Err(Failure::plain(message, "choose a frame in this range"));
    }
    Ok(frames)
}

/// Starts the requested film; without ffmpeg, an animated PNG beside the requested name.
fn start_film(
    arguments: &Render,
    look: &Look,
    series: &Series,
    frames: &[usize],
    kind: Option<FilmKind>,
) -> Result<(Reel, Option<PathBuf>), Failure> {
    let (Some(mut kind), Some(mut path)) = (kind, arguments.film.clone()) else {
        return Ok((Reel::None, None));
    };
    let [from, to] = [frames[0], frames[frames.len() - 1]].map(|frame| series.frames[frame].0);
    let real_time = (frames.len() - 1) as f64 / (to - from).max(1e-9);
    let rate =
        arguments.rate.unwrap_or_else(|| if frames.len() > 1 { real_time.clamp(5.0, 60.0) } else { 25.0 });
    if kind == FilmKind::Mp4 && !ffmpeg() {
        path.set_extension("png");
        eprintln!("note: ffmpeg was not found: the film is the animated PNG {}", path.display());
        kind = FilmKind::Png;
    }
    let reel = match kind {
        FilmKind::Mp4 => Reel::Mp4(Film::start(&path, look.size, rate)?),
        FilmKind::Png => {
            Reel::Png(Box::new(AnimatedPng::start(&path, look.size, frames.len() as u32, rate)?))
        }
    };
    Ok((reel, Some(path)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_pictures_are_known_again_and_films_go_by_their_ending() {
        assert!(is_picture(&picture_name(7)) && is_picture(&picture_name(1_000_000)));
        assert!(!is_picture("frame-x.png") && !is_picture("holiday.png"));
        assert_eq!(film_kind(Path::new("a/b.mp4")).ok(), Some(FilmKind::Mp4));
        assert_eq!(film_kind(Path::new("b.png")).ok(), Some(FilmKind::Png));
        assert!(film_kind(Path::new("b.avi")).is_err() && film_kind(Path::new("b")).is_err());
    }
}
