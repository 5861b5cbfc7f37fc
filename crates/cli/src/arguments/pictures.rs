//! Options of pictures and of the window.

use std::path::PathBuf;
use std::str::FromStr;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use pliant_format::tables::{BackgroundName, Choice, LookColour, LookTable, MapName, TextureName};
use pliant_geometry::CellLabel;

use super::Overrides;

#[derive(Debug, clap::Args)]
pub struct View {
    /// A scene file, a folder with a scene.toml, or the folder or a series (.pvd) of a finished run.
    pub scene: PathBuf,
    /// Record the input of the hand, written when the window closes.
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// Replay a recording without a window and print the result as JSON, with the same bits every time.
    #[arg(long, value_name = "FILE", conflicts_with = "record")]
    pub replay: Option<PathBuf>,
    /// Also replay the mouse in real time and measure the delay until the first step that a movement affects.
    #[arg(long, requires = "replay")]
    pub real_time: bool,
    /// Play, write a picture of the window as PNG and close.
    #[arg(long, value_name = "FILE", conflicts_with = "replay")]
    pub screenshot: Option<PathBuf>,
    /// Simulated time before the picture of the window [s].
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0, requires = "screenshot")]
    pub after: f64,
    /// Size of the window at its start, in pixels of a screen at 100 %.
    #[arg(long, value_name = "WxH", value_parser = size, default_value = "1280x800", conflicts_with = "replay")]
    pub size: [u32; 2],
    #[command(flatten)]
    pub overrides: Overrides,
}

pub(super) const RENDER_HELP: &str = "\
Examples:
  pliant render out/liver                                    the last frame of a run, into pictures/
  pliant render out/liver --frames all --film liver.mp4      a film of all frames
  pliant render out/liver --series skin --colour displacement --camera 90,10
  pliant render scenes/liver --colour pressure --edges --clip 0,0,0,0,1,0
  pliant render scenes/cube --colour displacement:z --map cividis --range 0,0.02 --ghost
  pliant render scenes/liver --fibres --critical --colour element-step
  pliant render organs.vtu --colour label --hide skin,5-8    the labels of a mesh in colours, some hidden
  pliant render organs.vtu --look liver=0.3,liver            what lies inside of a label or a body
  pliant render scenes -o gallery                            a page with a picture of each scene in a folder
  pliant render scenes --gallery                             the pictures of docs and scenes that are older than their scenes

A scene runs first, without its own outputs. Its table [view] sets how it is drawn; the options below override it. A mesh file with
labels is drawn without a run; any other mesh, or a film, runs a scene as in `pliant view`. A film named .mp4 needs ffmpeg.
Without ffmpeg, or with a name ending in .png, the film is an animated PNG.

Exit codes: 0 done, 1 the run or a picture failed, 2 invalid input or no adapter, 130 interrupted (Ctrl-C; 128 + signal number for other signals).";

#[derive(Debug, clap::Args)]
pub struct Render {
    /// Folder of a finished run, scene file, folder with a scene.toml, NiftySim model (.xml), mesh file, or
    /// folder of scenes.
    pub what: PathBuf,
    /// Frames: `all`, `last`, a number from 0, or a range: 0..20 (excludes 20), 10.. (to the end).
    #[arg(long, value_name = "FRAMES")]
    pub frames: Option<Frames>,
    /// Folder for the pictures.
    #[arg(short, long, value_name = "DIR", default_value = "pictures")]
    pub out: PathBuf,
    /// Write into a folder with other files.
    #[arg(long)]
    pub force: bool,
    /// Make the pictures anew that a folder of scenes lists in `gallery.txt`, where they do not fit their
    /// scenes.
    #[arg(long, conflicts_with_all = ["frames", "film", "out"])]
    pub gallery: bool,
    /// Also make a film of them (.mp4 or .png).
    #[arg(long, value_name = "FILE")]
    pub film: Option<PathBuf>,
    /// Frames per second of the film; by default in real time, within 5 to 60.
    #[arg(long, value_name = "N", value_parser = rate, requires = "film")]
    pub rate: Option<f64>,
    /// Width and height [pixels].
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<[u32; 2]>,
    /// Quantity shown by colours: a field, a component such as `displacement:z` or `cauchy-stress:xx`,
    /// `label` for a colour per label, or `none`.
    #[arg(long, value_name = "FIELD")]
    pub colour: Option<String>,
    /// Hide labels, to show the inside, by number, name or range, and bodies, obstacles and tools by name,
    /// such as 2,tumour,5-8,grasper.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', allow_hyphen_values = true)]
    pub hide: Vec<CellLabel>,
    /// See through labels or bodies, or give them one colour; repeatable: liver=0.3, or liver=0.3,liver.
    #[arg(long, value_name = "NAME=OPACITY[,COLOUR]", value_parser = look)]
    pub look: Vec<(CellLabel, LookTable)>,
    /// Colour map.
    #[arg(long, value_name = "MAP", value_parser = word::<MapName>())]
    pub map: Option<MapName>,
    /// Values of the first and the last colour.
    #[arg(long, value_name = "LOW,HIGH", value_parser = range, allow_hyphen_values = true)]
    pub range: Option<Numbers<2>>,
    /// Angles of the camera around the up axis and above the horizon [°].
    #[arg(long, value_name = "AZIMUTH,ELEVATION", value_parser = angles, allow_hyphen_values = true)]
    pub camera: Option<Numbers<2>>,
    /// Magnification.
    #[arg(long, value_name = "FACTOR", value_parser = factor)]
    pub zoom: Option<f64>,
    /// The axis that points up.
    #[arg(long, value_name = "AXIS", value_parser = ["x", "y", "z", "-x", "-y", "-z"], allow_hyphen_values = true)]
    pub up: Option<String>,
    /// Parallel projection.
    #[arg(long)]
    pub orthographic: bool,
    /// Draw the edges of the elements.
    #[arg(long)]
    pub edges: bool,
    /// Draw only the edges of the elements on the surface.
    #[arg(long)]
    pub wireframe: bool,
    /// Draw the shape at rest, as a ghost.
    #[arg(long)]
    pub ghost: bool,
    /// Draw fibres as short lines on the surface and in a section. A finished run needs the field `fibre` on
    /// the cells of its series.
    #[arg(long)]
    pub fibres: bool,
    /// Draw the forces of contacts as arrows, through the bodies. A finished run needs the field
    /// `contact-force` in its series.
    #[arg(long)]
    pub contacts: bool,
    /// Mark constraints and loads, through the bodies: squares where nodes are held, dots where they are
    /// moved, arrows of loads. A finished run needs the fields `constraint` and `load` in a series.
    #[arg(long)]
    pub marks: bool,
    /// Mark the element with the smallest stable step, through the body. A finished run needs the field
    /// `element-step` on the cells of its series.
    #[arg(long)]
    pub critical: bool,
    /// Do not mark the largest value that the colours show. A ring marks it, dashed where something hides the
    /// place.
    #[arg(long)]
    pub no_maximum: bool,
    /// Texture of the surface.
    #[arg(long, value_name = "WORD", value_parser = word::<TextureName>())]
    pub texture: Option<TextureName>,
    /// A point and a normal: removes the part on the side of the normal.
    #[arg(long, value_name = "X,Y,Z,NX,NY,NZ", value_parser = plane, allow_hyphen_values = true)]
    pub clip: Option<Numbers<6>>,
    /// Background.
    #[arg(long, value_name = "WORD", value_parser = word::<BackgroundName>())]
    pub background: Option<BackgroundName>,
    /// Series of a finished run; by default the first in alphabetical order.
    #[arg(long, value_name = "NAME")]
    pub series: Option<String>,
    /// Simulated time between frames of a scene [s]; by default the interval of its first series, otherwise a
    /// hundredth of the run.
    #[arg(long, value_name = "S", value_parser = factor)]
    pub every: Option<f64>,
    #[command(flatten)]
    pub overrides: Overrides,
}

/// Choice of frames of a series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frames {
    All,
    Last,
    One(usize),
    /// From one frame on, up to another one (excluded) or the end.
    Range(usize, Option<usize>),
}

impl FromStr for Frames {
    type Err = String;

    fn from_str(typed: &str) -> Result<Self, String> {
        let wrong = || format!("`{typed}` does not select frames: try all, last, 12, 0..20 or 10..");
        let number = |text: &str| text.parse::<usize>().map_err(|_| wrong());
        match (typed, typed.split_once("..")) {
            ("all", _) => Ok(Self::All),
            ("last", _) => Ok(Self::Last),
            (_, None) => Ok(Self::One(number(typed)?)),
            (_, Some((from, to))) => {
                let from = if from.is_empty() { 0 } else { number(from)? };
                let to = if to.is_empty() { None } else { Some(number(to)?) };
                if to.is_some_and(|to| to <= from) { Err(wrong()) } else { Ok(Self::Range(from, to)) }
            }
        }
    }
}

/// Numbers separated by commas.
pub type Numbers<const N: usize> = [f64; N];

pub(super) fn numbers<const N: usize>(typed: &str) -> Result<Numbers<N>, String> {
    let values: Option<Vec<f64>> =
        typed.split(',').map(|part| part.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
    values
        .and_then(|values| values.try_into().ok())
        .ok_or_else(|| format!("give {N} numbers separated by commas"))
}

pub(super) fn range(typed: &str) -> Result<Numbers<2>, String> {
    match numbers(typed)? {
        [low, high] if low < high => Ok([low, high]),
        _ => Err("the first value must be below the second".into()),
    }
}

pub(super) fn angles(typed: &str) -> Result<Numbers<2>, String> {
    let [azimuth, elevation] = numbers(typed)?;
    if elevation.abs() > 90.0 {
        return Err("the elevation must lie between -90 and 90°".into());
    }
    Ok([azimuth, elevation])
}

pub(super) fn plane(typed: &str) -> Result<Numbers<6>, String> {
    let found: Numbers<6> = numbers(typed)?;
    if found[3..] == [0.0; 3] {
        return Err("a plane needs a normal, as in 0,0,0,1,0,0".into());
    }
    Ok(found)
}

/// A word of the scene file.
pub(super) fn word<T>() -> impl TypedValueParser<Value = T>
where
    T: Choice + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(T::WORDS)
        .try_map(|typed| T::of_word(&typed).ok_or_else(|| format!("`{typed}` is unknown")))
}

/// The opacity and the colour of something.
pub(super) fn look(typed: &str) -> Result<(CellLabel, LookTable), String> {
    let help = || {
        format!(
            "give a name, an opacity from 0 to 1 and one of {}, as in liver=0.3,liver",
            LookColour::WORDS.join(", ")
        )
    };
    let (name, look) = typed.rsplit_once('=').ok_or_else(help)?;
    let (opacity, colour) = look.split_once(',').unwrap_or((look, "view"));
    let opacity = opacity.parse().ok().filter(|opacity| (0.0..=1.0).contains(opacity)).ok_or_else(help)?;
    let colour = LookColour::of_word(colour).ok_or_else(help)?;
    let Ok(name) = name.parse();
    Ok((name, LookTable { opacity, colour }))
}

pub(super) fn factor(typed: &str) -> Result<f64, String> {
    match typed.parse() {
        Ok(factor) if factor > 0.0 && factor <= 1e6 => Ok(factor),
        _ => Err("give a number greater than 0".into()),
    }
}

pub(super) fn rate(typed: &str) -> Result<f64, String> {
    match typed.parse() {
        Ok(rate) if (1.0..=240.0).contains(&rate) => Ok(rate),
        _ => Err("a film has 1 to 240 frames per second".into()),
    }
}

pub(super) fn size(typed: &str) -> Result<[u32; 2], String> {
    let sides = typed.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    match sides {
        Some(sides) if sides.iter().all(|side| (16..=16_384).contains(side)) => Ok(sides),
        _ => Err("give width and height from 16 to 16384, such as 1280x800".into()),
    }
}
