//! `pliant render`, and the picture of `pliant run --picture`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use pliant_geometry::{Mesh, Vector3};
use pliant_picture::{
    AnimatedPng, Axis, Background, Camera, ColourMap, Film, Graphics, Legend, Look, Picture, PictureError,
    Plane, Projection, Series, SeriesError, Style, ffmpeg,
};
use pliant_scene::format::{FieldName, UpName, VtuTable};
use pliant_scene::registry::OutputTable;
use pliant_scene::{Draw, Options, OutputFolder, Scene};

use crate::arguments::{Frames, Overrides, Render};
use crate::commands::{INTERRUPTED, prepare_changed, stopped_by_ctrl_c};
use crate::report::{Bar, Failure, say};
pub use crate::view::view;

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

/// How a scene asks to be seen.
pub fn look_of(scene: &Scene) -> Look {
    let view = &scene.view;
    let camera = &view.camera;
    let mut look = Look {
        style: Style {
            map: ColourMap::of_name(view.map.word()).unwrap_or_default(),
            range: view.range,
            edges: view.edges,
            ghost: view.ghost,
            clip: view.clip.and_then(|clip| Plane::through(&clip.point.into(), &clip.normal.into())),
            background: Background::of_name(view.background.word()).unwrap_or_default(),
        },
        camera: Camera {
            azimuth: camera.azimuth,
            elevation: camera.elevation,
            projection: if camera.orthographic { Projection::Orthographic } else { Projection::Perspective },
            up: Axis::nearest(&up(scene)),
            ..Camera::default()
        },
        target: camera.target.map(Vector3::from),
        zoom: camera.zoom,
        size: view.size,
        ..Look::default()
    };
    if let Some(field) = scene.shown_field() {
        colour_by(&mut look, field, view.component.map(|component| component.word()));
    }
    look.legend.title = scene.scene.title.clone();
    look
}

/// What is up: as the scene says, or against gravity.
fn up(scene: &Scene) -> Vector3 {
    let gravity = || scene.scene.gravity.map(|gravity| -Vector3::from(gravity));
    scene.view.camera.up.map(UpName::direction).map(Vector3::from).or_else(gravity).unwrap_or_default()
}

fn colour_by(look: &mut Look, field: FieldName, component: Option<&str>) {
    let part = component.map(|part| format!(":{part}")).unwrap_or_default();
    look.field = Some(format!("{}{part}", field.name()));
    let part = component.map(|part| format!(" {part}")).unwrap_or_default();
    look.legend.quantity = format!("{}{part}", field.title());
    look.legend.unit = field.unit().into();
}

/// Colours by a field of any name, as files have them.
fn colour_by_name(look: &mut Look, name: &str) {
    let (own, part) = name.split_once(':').map_or((name, None), |(own, part)| (own, Some(part)));
    if name == "none" {
        look.field = None;
        look.style.range = None;
    } else if let Some(field) = FieldName::of_name(own) {
        colour_by(look, field, part);
    } else {
        look.field = Some(name.into());
        look.legend = Legend { quantity: name.into(), unit: String::new(), ..look.legend.clone() };
    }
}

/// What was typed comes before what the scene says.
fn typed(look: &mut Look, arguments: &Render) {
    let style = &mut look.style;
    if let Some(map) = arguments.map.as_deref().and_then(ColourMap::of_name) {
        style.map = map;
    }
    if let Some(background) = arguments.background.as_deref().and_then(Background::of_name) {
        style.background = background;
    }
    style.range = arguments.range.or(style.range);
    style.edges |= arguments.edges;
    style.ghost |= arguments.ghost;
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
        // Another field has another range.
        if look.field.as_ref() != Some(name) {
            look.style.range = arguments.range;
        }
        colour_by_name(look, name);
    }
}

/// Draws the last instant of a run.
#[derive(Debug)]
pub struct Photographer {
    look: Look,
    graphics: Graphics,
}

impl Photographer {
    pub fn new(scene: &Scene) -> Result<Self, Failure> {
        Ok(Self { look: look_of(scene), graphics: Graphics::open()? })
    }
}

impl Draw for Photographer {
    fn draw(&self, mesh: &Mesh, time: f64) -> Result<Vec<u8>, String> {
        let picture = self.look.picture(&self.graphics, mesh, time).map_err(|error| error.to_string())?;
        picture.png().map_err(|error| error.to_string())
    }
}

pub fn render(arguments: &Render) -> Result<ExitCode, Failure> {
    let film = arguments.film.as_deref().map(film_kind).transpose()?;
    let graphics = Graphics::open()?;
    let folder = OutputFolder::claim(arguments.out.clone(), arguments.force, is_picture)
        .map_err(|error| Failure::plain(&error, error.remedy))?;
    if is_folder_of_run(&arguments.what) {
        refuse_words_of_scenes(arguments)?;
        let series = Series::find(&arguments.what, arguments.series.as_deref())?;
        let mut look = Look { size: [1280, 800], ..Look::default() };
        let usual = ["von-mises", "displacement"];
        if let Some(field) = series.first_field(&usual)? {
            colour_by_name(&mut look, field);
        }
        typed(&mut look, arguments);
        return shoot(arguments, &look, &graphics, &series, &folder, film);
    }
    if arguments.series.is_some() {
        return Err(Failure::plain("`--series` chooses among the series of a finished run", "leave it out"));
    }
    let space = tempfile::tempdir().map_err(|error| {
        Failure::plain(
            format!("no temporary folder can be made: {error}"),
            "check the free space, or set TMPDIR",
        )
    })?;
    let overrides = with_colour(&arguments.overrides, arguments.colour.as_deref());
    let mut every = 0.0;
    let (mut scene, built, plan) =
        prepare_changed(&arguments.what, &overrides, |scene| every = forget_outputs(scene, arguments))?;
    scene.outputs = vec![("shown".into(), OutputTable::Vtu(scene.shown(every)))];
    let mut look = look_of(&scene);
    typed(&mut look, arguments);
    let run = OutputFolder::prepare(space.path().join("run"), &scene, false)
        .map_err(|error| Failure::plain(&error, error.remedy))?;
    let bar = Bar::new();
    let options = Options { stop: Some(stopped_by_ctrl_c()), ..Options::default() };
    let result =
        pliant_scene::run_with(&scene, &built, &plan, &run, options, &mut |progress| bar.update(progress));
    bar.finish();
    let summary = result.map_err(|error| Failure::plain(&error, error.remedy))?;
    for warning in &summary.warnings {
        eprintln!("warning: {warning}");
    }
    if summary.status == "interrupted" {
        eprintln!("error: the run was interrupted; no pictures were taken");
        return Ok(ExitCode::from(INTERRUPTED));
    }
    let code = shoot(arguments, &look, &graphics, &Series::find(run.path(), None)?, &folder, film)?;
    match &summary.error {
        None => Ok(code),
        // What it came to is worth a look.
        Some(error) => {
            eprintln!("error: {}", error.message);
            Ok(ExitCode::from(1))
        }
    }
}

/// Whether a path is the folder of a run, and not of a scene.
fn is_folder_of_run(path: &Path) -> bool {
    path.is_dir() && !path.join("scene.toml").exists()
}

fn refuse_words_of_scenes(arguments: &Render) -> Result<(), Failure> {
    let changes = &arguments.overrides;
    let changed = !changes.set.is_empty()
        || [changes.until, changes.step, arguments.every].iter().any(Option::is_some)
        || changes.threads.is_some()
        || changes.precision.is_some()
        || changes.device.is_some();
    if changed {
        let message =
            format!("`{}` is a finished run: its scene can't be changed any more", arguments.what.display());
        return Err(Failure::plain(message, "give the scene, or leave these options out"));
    }
    Ok(())
}

/// Takes the outputs away from a scene; simulated time between the frames that are shown instead [s].
fn forget_outputs(scene: &mut Scene, arguments: &Render) -> f64 {
    let own = std::mem::take(&mut scene.outputs).into_iter().find_map(|(_, output)| match output {
        OutputTable::Vtu(VtuTable { every, .. }) => Some(every),
        OutputTable::Csv(_) => None,
    });
    // Another field does without the component of the scene's.
    if arguments.colour.as_ref().is_some_and(|name| !name.contains(':')) {
        scene.view.component = None;
    }
    arguments.every.or(own).unwrap_or(0.01 * scene.scene.until)
}

/// The colour that was typed as values of the scene, so that they are checked with it.
fn with_colour(overrides: &Overrides, colour: Option<&str>) -> Overrides {
    let mut all = overrides.clone();
    if let Some(name) = colour {
        let (own, part) = name.split_once(':').map_or((name, None), |(own, part)| (own, Some(part)));
        all.set.push(format!("view.colour={own}"));
        all.set.extend(part.map(|part| format!("view.component={part}")));
    }
    all
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

/// What a film is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FilmKind {
    Mp4,
    Png,
}

/// By the ending of its name.
fn film_kind(path: &Path) -> Result<FilmKind, Failure> {
    match path.extension().and_then(|ending| ending.to_str()) {
        Some("mp4") => Ok(FilmKind::Mp4),
        Some("png" | "apng") => Ok(FilmKind::Png),
        _ => {
            let message = format!("`{}` is the name of no film that can be made", path.display());
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

/// Takes the pictures of a series.
fn shoot(
    arguments: &Render,
    look: &Look,
    graphics: &Graphics,
    series: &Series,
    folder: &OutputFolder,
    film: Option<FilmKind>,
) -> Result<ExitCode, Failure> {
    let frames = chosen(arguments, series)?;
    let (mut reel, path) = start_film(arguments, look, series, &frames, film)?;
    let bar = Bar::new();
    let done = look.pictures(graphics, series, &frames, |count, picture| {
        let path = folder.path().join(picture_name(frames[count]));
        std::fs::write(&path, picture.png()?)
            .map_err(|error| PictureError::Write { path, reason: error.to_string() })?;
        bar.update_mesh(count as f64 / frames.len() as f64, "taking pictures");
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
    Ok(ExitCode::SUCCESS)
}

/// The frames that were asked for: the last one, or all for a film.
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
        return Err(Failure::plain(message, "choose among them"));
    }
    Ok(frames)
}

/// Starts the film that was asked for; where ffmpeg is missing, an animated PNG beside the name asked for.
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
        eprintln!("note: there is no ffmpeg here: the film is the animated PNG {}", path.display());
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
