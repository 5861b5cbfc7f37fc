//! Commands and options.

use std::path::PathBuf;
use std::str::FromStr;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Parser, Subcommand, ValueEnum};
use pliant_format::tables::{BackgroundName, Choice, LookColour, LookTable, MapName, TextureName};
use pliant_geometry::CellLabel;
use pliant_imaging::LabelChoice;
use pliant_run::SweepPart;

/// Real-time simulation of soft organs.
#[derive(Debug, Parser)]
#[command(
    version,
    after_help = "Example:\n  pliant new my-organ && pliant run my-organ\n\nExit codes: 0 done, 1 the run failed, 2 invalid input, 130 interrupted (Ctrl-C; 128 + signal number for other signals)."
)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a scene and write its outputs.
    #[command(
        after_help = "Examples:\n  pliant run scenes/liver\n  pliant run scene.toml --until 0.5 --out out/short --force\n  \
                            pliant run scene.toml --precision single --threads 4 --json > result.json\n  \
                            pliant run scene.toml --set law.tissue.young-modulus=4e3 --set run.solver=quasi-static\n  \
                            pliant run scene.toml --set scene.gravity.2=-1.62 --set 'load.push.total=[0, 0, 1]'\n  \
                            pliant run scene.toml --resume out/scene               # from its last checkpoint\n  \
                            pliant run scene.toml --resume out/scene --until 20    # and run longer"
    )]
    Run(Run),
    /// Run a scene for every combination of values and write one table of the results.
    #[command(after_help = SWEEP_HELP)]
    Sweep(Sweep),
    /// Check a scene and print its model, without running or writing anything.
    #[command(
        after_help = "Examples:\n  pliant check scenes/liver\n  pliant check scenes/liver --set body.liver.element=tet4-anp"
    )]
    Check(Check),
    /// Write a commented starter scene.
    #[command(after_help = "Example:\n  pliant new my-organ && pliant run my-organ")]
    New {
        /// Name of the new folder.
        name: PathBuf,
    },
    /// Print the JSON schema of the scene format, for editors.
    #[command(after_help = "Example:\n  pliant schema > scene.schema.json")]
    Schema {
        /// Print the reference page of all parameters as Markdown instead.
        #[arg(long)]
        markdown: bool,
        /// Print the classes of the Python package (`pliant.tables`) instead.
        #[arg(long, conflicts_with = "markdown")]
        python: bool,
    },
    /// Translate a NiftySim model into a scene.
    #[command(after_help = "Examples:\n  pliant import model.xml -o model && pliant run model\n  \
                            pliant import model.xml -o scene.toml && pliant run scene.toml\n  \
                            pliant run model.xml")]
    Import {
        /// A NiftySim model (XML).
        model: PathBuf,
        /// Folder for the scene and its meshes, or name of the scene file (.toml) with the meshes beside it.
        #[arg(short, long, value_name = "DIR|FILE")]
        out: PathBuf,
        /// Translate a model with unsupported parts (shells that bend, radii that change) without these parts.
        #[arg(long)]
        allow_partial: bool,
    },
    /// Print contents, quality and defects of a mesh file.
    #[command(
        after_help = "Examples:\n  pliant info liver.msh\n  pliant info liver.msh --convert liver.vtu\n  \
                            pliant info liver.vtu --against liver.stl --against-scale 0.001"
    )]
    Info(Info),
    /// List the labels of a segmented image: name, volume, location and pieces of each, and where the image cuts it off.
    #[command(
        after_help = "Examples:\n  pliant labels seg.nii.gz\n  pliant labels seg.nii.gz --names totalsegmentator\n  \
                            pliant labels liver.nii.gz tumour.nii.gz --json"
    )]
    Labels(Labels),
    /// Make a mesh from labels of a segmented image or from a closed surface: tets, hexes, a surface or curved shells.
    #[command(after_help = MESH_HELP)]
    Mesh(Box<MeshImage>),
    /// Moved into the laboratory.
    #[command(hide = true, disable_help_flag = true)]
    Reproduce(Moved),
    /// Moved into the laboratory.
    #[command(hide = true, disable_help_flag = true)]
    Bench(Moved),
    /// Open a scene in a window: play it, pull it, turn the view. Or a finished run: scrub and play its frames.
    #[command(
        after_help = "Examples:\n  pliant view scenes/liver\n  pliant view out/liver\n  pliant view scenes/cube --threads 1 --set run.precision=single\n  \
                            pliant view scenes/liver --record drag.pliant && pliant view scenes/liver --replay drag.pliant\n\n\
                            H in the window lists its keys. The window reloads the scene when its file changes."
    )]
    View(View),
    /// Make pictures or a film of a scene or of a finished run, without a screen.
    #[command(after_help = RENDER_HELP)]
    Render(Box<Render>),
    /// Feel a scene: a haptic device, or a trace of one, holds a tool of the scene at 1 kHz.
    #[command(after_help = HAPTICS_HELP)]
    Haptics(Haptics),
    /// List the GPUs that scenes can run on.
    #[command(after_help = "Examples:\n  pliant devices\n  pliant run scenes/liver --device gpu\n  \
                            pliant run scenes/liver --device gpu --set run.adapter=nvidia\n\n\
                            A scene without `adapter` uses the first one. The variable WGPU_BACKEND (vulkan, metal, dx12) restricts \
                            the list.")]
    Devices {
        /// Print one JSON array on standard output.
        #[arg(long)]
        json: bool,
    },
}

const HAPTICS_HELP: &str = "\
Examples:
  pliant haptics scenes/palpation --replay scenes/palpation/finger.csv
  pliant haptics scenes/palpation --replay finger.csv --hand --set output={}
  pliant haptics scenes/palpation --listen 127.0.0.1:4270       devices connect as docs/haptics.md describes

A trace is a table t,x,y,z,qw,qx,qy,qz of the tool in the scene (s, m). It prints the spread of the force period, the latency, the force
jump, the energy and the stiffest coupling.

Exit codes: 0 done, 1 the simulation failed, 2 invalid input.";

#[derive(Debug, clap::Args)]
pub struct Haptics {
    /// A scene file, or a folder with a scene.toml.
    pub scene: PathBuf,
    /// The tool in the hand; the only one if not given.
    #[arg(long, value_name = "NAME")]
    pub tool: Option<String>,
    /// Replay a trace in real time instead of waiting for a device.
    #[arg(long, value_name = "FILE")]
    pub replay: Option<PathBuf>,
    /// A hand pulls a simulated device along the trace, so that it gives way to the force.
    #[arg(long, requires = "replay")]
    pub hand: bool,
    /// Where devices send their poses; port 0 for a free one.
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:4270", conflicts_with = "replay")]
    pub listen: std::net::SocketAddr,
    /// Allow an address that other machines reach: anyone there can move the tool.
    #[arg(long)]
    pub remote: bool,
    /// Local models per second.
    #[arg(long, value_name = "HZ", value_parser = model_rate, default_value_t = 200.0)]
    pub rate: f64,
    /// Stiffness of the virtual coupling [N/m].
    #[arg(long, value_name = "N/m", default_value_t = 1000.0)]
    pub stiffness: f64,
    /// Damping of the virtual coupling [N s/m].
    #[arg(long, value_name = "N s/m", default_value_t = 0.2)]
    pub damping: f64,
    /// Largest force [N].
    #[arg(long, value_name = "N", default_value_t = 3.3)]
    pub force_limit: f64,
    /// Largest change of the force from a millisecond to the next [N].
    #[arg(long, value_name = "N", default_value_t = 0.3)]
    pub most_change: f64,
    /// Without the passivity guard.
    #[arg(long)]
    pub no_guard: bool,
    #[command(flatten)]
    pub overrides: Overrides,
}

/// Models per second, 10 to 1000.
fn model_rate(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(rate) if (10.0..=1000.0).contains(&rate) => Ok(rate),
        _ => Err("give 10 to 1000".into()),
    }
}

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
    /// Test mouse and keys automatically, report the result and close. A picture of the window shows the hand pulling.
    #[arg(long, conflicts_with = "replay")]
    pub rehearse: bool,
    #[command(flatten)]
    pub overrides: Overrides,
}

const RENDER_HELP: &str = "\
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
Without ffmpeg, or with a name ending in .png, it is an animated PNG.

Exit codes: 0 done, 1 the run or a picture failed, 2 invalid input or no adapter, 130 interrupted (Ctrl-C; 128 + signal number for other signals).";

#[derive(Debug, clap::Args)]
pub struct Render {
    /// Folder of a finished run, scene file, folder with a scene.toml, NiftySim model (.xml), mesh file, or folder of scenes.
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
    /// Make the pictures anew that a folder of scenes lists in `gallery.txt`, where they do not fit their scenes.
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
    /// Quantity shown by colours: a field, a component such as `displacement:z` or `cauchy-stress:xx`, `label` for a colour per label,
    /// or `none`.
    #[arg(long, value_name = "FIELD")]
    pub colour: Option<String>,
    /// Hide labels, to show the inside, by number, name or range, and bodies, obstacles and tools by name, such as 2,tumour,5-8,grasper.
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
    /// Draw fibres as short lines on the surface and in a section. A finished run needs the field `fibre` on the cells of its series.
    #[arg(long)]
    pub fibres: bool,
    /// Draw the forces of contacts as arrows, through the bodies. A finished run needs the field `contact-force` in its series.
    #[arg(long)]
    pub contacts: bool,
    /// Mark constraints and loads, through the bodies: squares where nodes are held, dots where they are moved, arrows of loads. A finished
    /// run needs the fields `constraint` and `load` in a series.
    #[arg(long)]
    pub marks: bool,
    /// Mark the element with the smallest stable step, through the body. A finished run needs the field `element-step` on the cells of
    /// its series.
    #[arg(long)]
    pub critical: bool,
    /// Do not mark the largest value that the colours tell. A ring marks it, dashed where something hides the place.
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
    /// Simulated time between frames of a scene [s]; by default that of its first series, otherwise a hundredth of the run.
    #[arg(long, value_name = "S", value_parser = factor)]
    pub every: Option<f64>,
    #[command(flatten)]
    pub overrides: Overrides,
}

/// Which frames of a series.
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

fn numbers<const N: usize>(typed: &str) -> Result<Numbers<N>, String> {
    let all: Option<Vec<f64>> =
        typed.split(',').map(|part| part.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
    all.and_then(|all| all.try_into().ok()).ok_or_else(|| format!("give {N} numbers separated by commas"))
}

fn range(typed: &str) -> Result<Numbers<2>, String> {
    match numbers(typed)? {
        [low, high] if low < high => Ok([low, high]),
        _ => Err("the first value must be below the second".into()),
    }
}

fn angles(typed: &str) -> Result<Numbers<2>, String> {
    let [azimuth, elevation] = numbers(typed)?;
    if elevation.abs() > 90.0 {
        return Err("the elevation must lie between -90 and 90°".into());
    }
    Ok([azimuth, elevation])
}

fn plane(typed: &str) -> Result<Numbers<6>, String> {
    let found: Numbers<6> = numbers(typed)?;
    if found[3..] == [0.0; 3] {
        return Err("a plane needs a normal, as in 0,0,0,1,0,0".into());
    }
    Ok(found)
}

/// A word of the scene file.
fn word<T>() -> impl TypedValueParser<Value = T>
where
    T: Choice + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(T::WORDS)
        .try_map(|typed| T::of_word(&typed).ok_or_else(|| format!("`{typed}` is unknown")))
}

/// The opacity and the colour of something.
fn look(typed: &str) -> Result<(CellLabel, LookTable), String> {
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

fn factor(typed: &str) -> Result<f64, String> {
    match typed.parse() {
        Ok(factor) if factor > 0.0 && factor <= 1e6 => Ok(factor),
        _ => Err("give a number greater than 0".into()),
    }
}

fn rate(typed: &str) -> Result<f64, String> {
    match typed.parse() {
        Ok(rate) if (1.0..=240.0).contains(&rate) => Ok(rate),
        _ => Err("a film has 1 to 240 frames per second".into()),
    }
}

fn size(typed: &str) -> Result<[u32; 2], String> {
    let sides = typed.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    match sides {
        Some(sides) if sides.iter().all(|side| (16..=16_384).contains(side)) => Ok(sides),
        _ => Err("give width and height from 16 to 16384, such as 1280x800".into()),
    }
}

/// The words of a command that `pliant-lab` has now.
#[derive(Debug, clap::Args)]
pub struct Moved {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    pub words: Vec<String>,
}

#[derive(Clone, Debug, clap::Args)]
pub struct Overrides {
    /// Set any value of the scene; may be repeated. KEY is its path, with array items numbered from 0. VALUE is TOML; a single
    /// word needs no quotes.
    #[arg(long, value_name = "KEY=VALUE", allow_hyphen_values = true)]
    pub set: Vec<String>,
    /// Simulated time [s], instead of the scene's.
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub until: Option<f64>,
    /// Time step [s], instead of the scene's.
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub step: Option<f64>,
    /// Threads; 0: one per core.
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub threads: Option<i64>,
    /// Number type of the solver.
    #[arg(long)]
    pub precision: Option<Precision>,
    /// Device of the solver; `auto` uses a GPU if one can run the scene.
    #[arg(long)]
    pub device: Option<DeviceName>,
    /// Ignore the cache of meshes made from images.
    #[arg(long)]
    pub no_cache: bool,
    /// Read only files in the folder of the scene, links resolved, for untrusted scenes (see SECURITY.md).
    #[arg(long)]
    pub sandbox: bool,
    /// Omit parts of a NiftySim model that Pliant does not support (shells that bend, radii that change); this changes the model.
    #[arg(long)]
    pub allow_partial: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum DeviceName {
    Cpu,
    Gpu,
    Auto,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum Precision {
    Single,
    Double,
}

#[derive(Debug, clap::Args)]
pub struct Run {
    /// A scene file, a folder with a scene.toml, or a NiftySim model (.xml).
    pub scene: PathBuf,
    /// Folder for the outputs; by default out/NAME, named after the folder of the scene.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Write into a folder that is not empty.
    #[arg(long)]
    pub force: bool,
    /// Resume from a checkpoint (a file, or the last one in a folder), in its folder or in `--out`.
    ///
    /// A scene writes checkpoints with `checkpoint = { every = 1.0 }` in `[run]`. The resumed run has the same bits as an
    /// uninterrupted one, and its outputs continue from the checkpoint. Only `until` may differ.
    #[arg(long, value_name = "CHECKPOINT", conflicts_with = "force")]
    pub resume: Option<PathBuf>,
    /// Run even if this takes more than a day.
    #[arg(long)]
    pub long: bool,
    #[command(flatten)]
    pub overrides: Overrides,
    /// Also draw the final state with the scene's [view]: picture.png, also shown in the summary.
    #[arg(long)]
    pub picture: bool,
    /// Print one JSON object with the results on standard output.
    #[arg(long)]
    pub json: bool,
}

const SWEEP_HELP: &str = "\
Values:
  law.tissue.young-modulus=1e3,2e3,5e3           these three
  law.tissue.young-modulus=1e3..5e3/5            five from 1e3 to 5e3 in equal steps
  body.liver.element=tet4,tet4-anp               words need no quotes
  'scene.gravity=[0, 0, -9.81],[0, 0, 0]'        commas in brackets or quotes do not separate values
  scene.gravity.2=-9.81,0                        an item of an array, counted from 0

Examples:
  pliant sweep scene.toml --set law.tissue.young-modulus=1e3..5e3/5 --set body.block.density=900,1100
  pliant sweep scene.toml --set run.load-steps=2,5,10 --dry-run

Writes sweep.csv, a row for each run: its values, its status, final energies, reactions and probes; and sweep.svg, the
reactions of all runs over time. Each run writes its summary, plot and tables to a folder run-NNNN. All combinations are
checked before the first run; a failed run does not stop the others.

Exit codes: 0 done, 1 some runs failed, 2 invalid input, 130 interrupted (Ctrl-C; 128 + signal number for other signals).";

#[derive(Debug, clap::Args)]
pub struct Sweep {
    /// A scene file, or a folder with a scene.toml.
    pub scene: PathBuf,
    /// Values of a scene key, separated by commas; may be repeated. Every combination runs.
    #[arg(long, value_name = "KEY=VALUES", allow_hyphen_values = true, required = true)]
    pub set: Vec<String>,
    /// Folder for the table and the runs; by default out/NAME-sweep, named after the folder of the scene.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Write into a folder that is not empty.
    #[arg(long)]
    pub force: bool,
    /// Run only every N-th combination from the I-th on, and append rows to rows-I-of-N.jsonl in the folder: for job arrays. The same command again runs
    /// what is missing.
    #[arg(long, value_name = "I/N", conflicts_with_all = ["force", "dry_run", "merge"])]
    pub part: Option<SweepPart>,
    /// Put the rows of all parts in the folder together into the table, and name what is missing.
    #[arg(long, conflicts_with_all = ["force", "dry_run"])]
    pub merge: bool,
    /// Check and list the combinations without running or writing anything.
    #[arg(long, alias = "list")]
    pub dry_run: bool,
    /// Ignore the cache of meshes made from images.
    #[arg(long)]
    pub no_cache: bool,
    /// Read only files in the folder of the scene, links resolved, for untrusted scenes (see SECURITY.md).
    #[arg(long)]
    pub sandbox: bool,
    /// Also write the field series (VTU) of each run.
    #[arg(long)]
    pub keep_fields: bool,
    /// Concurrent runs, each on one thread; 0: one per core. Results do not depend on this number.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub threads: u16,
}

#[derive(Debug, clap::Args)]
pub struct Check {
    /// A scene file, a folder with a scene.toml, or a NiftySim model (.xml).
    pub scene: PathBuf,
    #[command(flatten)]
    pub overrides: Overrides,
}

#[derive(Debug, clap::Args)]
pub struct Info {
    /// A mesh file.
    pub mesh: PathBuf,
    /// Factor on all lengths: the size of one unit of the mesh in metres (0.001 for millimetres).
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    pub scale: f64,
    /// Write the mesh in another format, selected by the file extension.
    #[arg(long, value_name = "FILE")]
    pub convert: Option<PathBuf>,
    /// Also measure the distance between this surface and that of another mesh, in both directions.
    #[arg(long, value_name = "OTHER")]
    pub against: Option<PathBuf>,
    /// Factor on all lengths of the other mesh; by default that of `--scale`.
    #[arg(long, value_name = "FACTOR", requires = "against", allow_negative_numbers = true)]
    pub against_scale: Option<f64>,
    /// Print one JSON object on standard output.
    #[arg(long)]
    pub json: bool,
}

const MESH_HELP: &str = "\
Images: NIfTI (.nii, .nii.gz), NRRD, MetaImage (.mha, .mhd), GIPL, a DICOM segmentation, or the folder of a DICOM series. The mesh is
in metres, in patient coordinates: x to the right, y to the front, z to the head.
Closed surfaces: the triangles and quads of OBJ, OFF, STL, PLY, VTP, VTK, VTU, Gmsh, GIfTI or FreeSurfer files, in metres or with
`--scale`.

Examples:
  pliant labels seg.nii.gz
  pliant mesh seg.nii.gz --label 5 --edge 8mm -o liver.vtu                             # or --edge 0.008
  pliant mesh liver.stl --scale 0.001 --edge 8mm --young 5000 -o liver.vtu             # a surface in millimetres
  pliant mesh brain.nii.gz --label 1 --label 2 --edge 6mm --keep-largest -o brain.vtu   # two materials
  pliant mesh seg.nrrd --label liver --label tumour --edge 8mm -o liver.vtu            # labels by name
  pliant mesh seg.nii.gz --names totalsegmentator --label heart --edge 8mm -o heart.vtu # names from a table
  pliant mesh liver.nii.gz tumour.nii.gz --edge 8mm -o liver.vtu                       # masks: labels 1 and 2
  pliant mesh seg.nii.gz --label 5 --edge 0.01 --as hexes --close-gaps 3mm --fill-holes -o liver.msh
  pliant mesh seg.nii.gz --label 5 --edge 1cm --as immersed-hexes -o liver.vtu         # cubes weighted by fraction
  pliant mesh grey.nii --threshold 0.5 --edge 8mm -o grey.vtu
  pliant mesh grey.nii --add white.nii --threshold 0.5 --edge 8mm -o brain.vtu         # two maps of probabilities

  pliant mesh seg.nii.gz --label 5 --vessels 6=1mm --capsule 0.1mm --edge 8mm -o liver/scene.toml  # to `pliant run liver`

  pliant mesh seg.nii.gz --label 5 --as surface --edge 5mm -o liver.ply              # even triangles
  pliant mesh liver.stl --as surface --cells 8000 -o coarse.stl                        # that many triangles
  pliant mesh liver.stl --as shells --error 0.5% -o liver.vtu --error-map off.vtu      # or --shells 800

A mesh of volume cells contributes its boundary. Shells are curved triangles: point data `normal` holds the fitted normals of their
nodes.

Cell data `label` holds the label of each volume cell. A scene can name the image directly:
  mesh = { image = \"seg.nii.gz\", label = 5, edge = 0.008 }

Exit codes: 0 done, 1 the mesh could not be written, 2 invalid input.";

#[derive(Debug, clap::Args)]
pub struct Labels {
    /// An image file, or the folder of a DICOM series.
    pub image: PathBuf,
    /// More masks on the same voxels: the first image is label 1, these are 2, 3, …, named after their files.
    #[arg(value_name = "MASK")]
    pub masks: Vec<PathBuf>,
    /// Names of the labels: a table of ITK-SNAP, FreeSurfer or 3D Slicer, lines like `5 liver`, JSON, or the word `totalsegmentator`.
    #[arg(long, value_name = "TABLE")]
    pub names: Option<PathBuf>,
    /// Read an image of more than 2 GiB.
    #[arg(long)]
    pub force: bool,
    /// UID of the DICOM series, if the folder holds several.
    #[arg(long, value_name = "UID")]
    pub series: Option<String>,
    /// Print one JSON object on standard output.
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Debug, clap::Args)]
pub struct MeshImage {
    /// An image file, the folder of a DICOM series, or a mesh file (for tets and hexes a closed surface).
    #[arg(value_name = "INPUT")]
    pub image: PathBuf,
    /// More masks on the same voxels: the first image is label 1, these are 2, 3, …, named after their files. All are meshed unless
    /// `--label` selects some. Where masks overlap, the last one wins.
    #[arg(value_name = "MASK")]
    pub masks: Vec<PathBuf>,
    /// Another image on the same voxels, added before `--threshold`, such as grey matter to white matter.
    #[arg(long, value_name = "IMAGE")]
    pub add: Option<PathBuf>,
    /// Label to mesh: 5, a range 5-8, or a name. Several labels make one mesh of several materials; the first one gets the voxels that
    /// cleaning adds. For a surface, the label of its cells.
    #[arg(long, value_name = "LABEL", allow_hyphen_values = true)]
    pub label: Vec<LabelChoice>,
    /// Names of the labels: a table of ITK-SNAP, FreeSurfer or 3D Slicer, lines like `5 liver`, JSON, or the word `totalsegmentator`.
    #[arg(long, value_name = "TABLE")]
    pub names: Option<PathBuf>,
    /// Instead of labels: all voxels with at least this value, for example in a probability map; with several masks, in each of them.
    #[arg(long, value_name = "VALUE", allow_negative_numbers = true)]
    pub threshold: Option<f64>,
    /// Edge of the cells: 0.008 in metres, or 8mm. Tets and hexes need it; a surface gets even triangles of this edge.
    #[arg(long, value_name = "LENGTH", value_parser = length, allow_hyphen_values = true)]
    pub edge: Option<f64>,
    /// Tets: largest distance between mesh boundary and body in both directions, such as 1mm; cells become smaller where it is
    /// exceeded. The reference is the triangles of a surface, or the smooth surface of an image. Without `--edge` the first edge is automatic.
    #[arg(long, value_name = "LENGTH", value_parser = length, allow_hyphen_values = true)]
    pub distance: Option<f64>,
    /// Tets: longer edge inside, away from the surface, rounded down to 2, 4, 8, ... times `--edge`.
    #[arg(long, value_name = "LENGTH", value_parser = length, allow_hyphen_values = true)]
    pub inner_edge: Option<f64>,
    /// Tets: a label with smaller cells, by number or name: 4 for half of `--edge`, or tumour=2mm, rounded down to a half, quarter, ... of `--edge`.
    #[arg(long, value_name = "LABEL[=LENGTH]", value_parser = protected, allow_hyphen_values = true)]
    pub protect: Vec<(CellLabel, Option<f64>)>,
    /// Number of triangles of a surface instead of their edge, placed where the shape needs them.
    #[arg(long = "cells", value_name = "N", conflicts_with = "edge")]
    pub triangles: Option<usize>,
    /// Number of shells.
    #[arg(long, value_name = "N", conflicts_with_all = ["edge", "triangles"])]
    pub shells: Option<usize>,
    /// Largest distance between shells and surface in both directions, as a fraction of the diagonal of its box: 0.005 or 0.5%.
    #[arg(long, value_name = "PART", value_parser = part, conflicts_with_all = ["edge", "triangles", "shells"])]
    pub error: Option<f64>,
    /// Factor that converts lengths of a mesh file to metres: 0.001 for millimetres. Images store theirs. A file larger than 10 m needs it.
    #[arg(long, value_name = "FACTOR")]
    pub scale: Option<f64>,
    /// Also write the curved surface of the shells as small triangles, with the distance from the target as point data.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["edge", "triangles"])]
    pub error_map: Option<PathBuf>,
    /// Type of mesh: tetrahedra optimised for long stable steps, cubes with a stepped surface, all cubes that the body touches
    /// with the fraction that it fills (cell data `fraction`), a surface, or curved shells.
    #[arg(long = "as", value_name = "CELLS", default_value = "tets")]
    pub cells: MeshCells,
    /// In a scene: a label whose surface is a wall of that thickness, tied to the tissue, such as "portal vein=1mm"; may be repeated.
    /// Voxels of the label inside the organ become tissue.
    #[arg(long, value_name = "LABEL=LENGTH", value_parser = vessel, allow_hyphen_values = true)]
    pub vessels: Vec<(LabelChoice, f64)>,
    /// In a scene: a capsule of this thickness on the boundary of the tissue, such as 0.1mm.
    #[arg(long, value_name = "LENGTH", value_parser = wall, allow_hyphen_values = true)]
    pub capsule: Option<f64>,
    /// Name of the mesh: .vtu or .msh, for a surface also .ply, .obj or .stl; or .toml for a scene of the image, with walls and ties.
    #[arg(short, long, value_name = "FILE")]
    pub out: PathBuf,
    /// Close gaps and channels up to this width, or holes of a surface: 0.003 in metres, or 3mm. Holes of a surface narrower than the
    /// cells are always closed.
    #[arg(long, value_name = "LENGTH", value_parser = length, default_value = "0", allow_hyphen_values = true)]
    pub close_gaps: f64,
    /// Fill closed cavities.
    #[arg(long)]
    pub fill_holes: bool,
    /// Keep only the largest piece.
    #[arg(long)]
    pub keep_largest: bool,
    /// Allow more than five million cells and images of more than 2 GiB.
    #[arg(long)]
    pub force: bool,
    /// UID of the DICOM series, if the folder holds several.
    #[arg(long, value_name = "UID")]
    pub series: Option<String>,
    /// Tissue of the reported stable step: brain-like (E = 3000 Pa) or liver-like (E = 19 kPa), both with ν = 0.45; by default both.
    #[arg(long, value_name = "NAME", conflicts_with = "young")]
    pub law: Option<Tissue>,
    /// Young's modulus of the tissue of the reported stable step [Pa].
    #[arg(long, value_name = "PA", value_parser = positive)]
    pub young: Option<f64>,
    /// Poisson's ratio of that tissue.
    #[arg(long, value_name = "RATIO", default_value_t = 0.45, value_parser = poisson, requires = "young")]
    pub poisson: f64,
    /// Density of the tissue [kg/m³].
    #[arg(long, value_name = "KG/M3", default_value_t = 1000.0, value_parser = positive)]
    pub density: f64,
    /// Print one JSON object on standard output.
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum Tissue {
    BrainLike,
    LiverLike,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum MeshCells {
    Tets,
    Hexes,
    ImmersedHexes,
    Surface,
    Shells,
}

/// A length [m]: a number in metres, or a number with a unit.
fn length(typed: &str) -> Result<f64, String> {
    const UNITS: [(&str, f64); 5] = [("µm", 1e-6), ("um", 1e-6), ("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)];
    let unit = UNITS.iter().find_map(|(unit, metres)| Some((typed.strip_suffix(unit)?, metres)));
    let (number, metres) = unit.unwrap_or((typed, &1.0));
    match number.trim_end().parse::<f64>() {
        Ok(number) => Ok(number * metres),
        Err(_) => {
            Err("a length is a number in metres, such as 0.008, or a number with a unit, such as 8mm".into())
        }
    }
}

/// A label with an optional length.
fn protected(typed: &str) -> Result<(CellLabel, Option<f64>), String> {
    let (label, edge) = typed.rsplit_once('=').map_or((typed, None), |(label, edge)| (label, Some(edge)));
    let label = match label.trim() {
        "" => {
            return Err(
                "give a label by number or name, such as 4, or with an edge, such as tumour=2mm".into()
            );
        }
        text => text.parse().unwrap_or_else(|never: std::convert::Infallible| match never {}),
    };
    Ok((label, edge.map(str::trim).map(length).transpose()?))
}

/// A label and the thickness of its wall.
fn vessel(typed: &str) -> Result<(LabelChoice, f64), String> {
    let help = "give a label with the thickness of its wall, such as 3=1mm or \"portal vein=1mm\"";
    let (label, thickness) = typed.rsplit_once('=').ok_or(help)?;
    let label = label.trim().parse().map_err(|_| help)?;
    Ok((label, wall(thickness.trim())?))
}

/// The thickness of a wall [m].
fn wall(typed: &str) -> Result<f64, String> {
    match length(typed)? {
        thickness if thickness > 0.0 => Ok(thickness),
        _ => Err("the thickness of a wall must be above 0".into()),
    }
}

fn positive(typed: &str) -> Result<f64, String> {
    match typed.parse() {
        Ok(number) if number > 0.0 && f64::is_finite(number) => Ok(number),
        _ => Err("it must be positive and finite".into()),
    }
}

fn poisson(typed: &str) -> Result<f64, String> {
    match typed.parse() {
        Ok(number) if number > -1.0 && number < 0.5 => Ok(number),
        _ => Err("a Poisson's ratio lies between -1 and 0.5".into()),
    }
}

/// A fraction or a percentage.
fn part(typed: &str) -> Result<f64, String> {
    let number = match typed.strip_suffix('%') {
        Some(percent) => percent.trim().parse::<f64>().map(|percent| percent / 100.0),
        None => typed.parse(),
    };
    match number {
        Ok(part) if part > 0.0 && part < 1.0 => Ok(part),
        _ => Err("give a fraction of the diagonal above 0 and below 1, such as 0.005 or 0.5%".into()),
    }
}

impl Command {
    pub fn wants_json(&self) -> bool {
        match self {
            Self::Run(run) => run.json,
            Self::Info(info) => info.json,
            Self::Labels(labels) => labels.json,
            Self::Mesh(mesh) => mesh.json,
            Self::Reproduce(moved) | Self::Bench(moved) => moved.words.iter().any(|word| word == "--json"),
            Self::Devices { json } => *json,
            Self::Sweep(_)
            | Self::Check(_)
            | Self::New { .. }
            | Self::Schema { .. }
            | Self::Import { .. }
            | Self::Render(_)
            | Self::View(_)
            | Self::Haptics(_) => false,
        }
    }
}
