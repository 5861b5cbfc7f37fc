//! What can be typed.

use std::path::PathBuf;
use std::str::FromStr;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Parser, Subcommand, ValueEnum};
use pliant_bench::Instructions;
use pliant_geometry::CellLabel;
use pliant_imaging::LabelChoice;
use pliant_scene::format::{BackgroundName, Choice, MapName, TextureName};

/// Real-time simulation of soft organs.
#[derive(Debug, Parser)]
#[command(
    version,
    after_help = "Example:\n  pliant new my-organ && pliant run my-organ\n\nExit codes: 0 done, 1 the run failed, 2 the input is wrong, 130 interrupted (Ctrl-C; 128 + its number for another signal)."
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
                            pliant run scene.toml --resume out/scene               # from the last checkpoint there\n  \
                            pliant run scene.toml --resume out/scene --until 20    # and go on for longer"
    )]
    Run(Run),
    /// Run a scene for every combination of some values, and write one table of the results.
    #[command(after_help = SWEEP_HELP)]
    Sweep(Sweep),
    /// Check a scene and print its model; runs nothing, writes nothing.
    #[command(
        after_help = "Examples:\n  pliant check scenes/liver\n  pliant check scenes/liver --set body.liver.element=tet4-anp"
    )]
    Check(Check),
    /// Write a commented starter scene.
    #[command(after_help = "Example:\n  pliant new my-organ && pliant run my-organ")]
    New {
        /// Name of the folder to make.
        name: PathBuf,
    },
    /// Print the JSON schema of the scene format, for editors.
    #[command(after_help = "Example:\n  pliant schema > scene.schema.json")]
    Schema {
        /// Print the reference page of all parameters as Markdown instead.
        #[arg(long)]
        markdown: bool,
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
        /// Also translate a model of which parts are unknown (shells, membranes, contact), without them.
        #[arg(long)]
        allow_partial: bool,
    },
    /// Say what a mesh file holds, how good it is, and what is wrong with it.
    #[command(
        after_help = "Examples:\n  pliant info liver.msh\n  pliant info liver.msh --convert liver.vtu\n  \
                            pliant info liver.vtu --against liver.stl --against-scale 0.001"
    )]
    Info(Info),
    /// List the labels of a segmented image: name, volume, place and pieces of each, and where the image cuts it off.
    #[command(
        after_help = "Examples:\n  pliant labels seg.nii.gz\n  pliant labels seg.nii.gz --names totalsegmentator\n  \
                            pliant labels liver.nii.gz tumour.nii.gz --json"
    )]
    Labels(Labels),
    /// Make a mesh from labels of a segmented image or from a closed surface: tets, hexes, a surface, curved shells.
    #[command(after_help = MESH_HELP)]
    Mesh(MeshImage),
    /// Compute the results of the thesis and write them beside the printed ones.
    #[command(
        after_help = "Examples:\n  pliant reproduce\n  pliant reproduce --list\n  pliant reproduce --only fig-6.3 --out shear\n\n\
                      Exit codes: 0 all numbers within their tolerance, 1 one is not, 2 the input is wrong."
    )]
    Reproduce(Reproduce),
    /// Measure what a step costs on this machine.
    #[command(after_help = BENCH_HELP)]
    Bench(Bench),
    /// Open a scene in a window: play it, pull it, look at it from all sides.
    #[command(
        after_help = "Examples:\n  pliant view scenes/liver\n  pliant view scenes/cube --threads 1 --set run.precision=single\n  \
                            pliant view scenes/liver --record drag.pliant && pliant view scenes/liver --replay drag.pliant\n\n\
                            H in the window lists its keys. The scene is read anew when its file changes."
    )]
    View(View),
    /// Take pictures or a film of a scene or of a finished run, without a screen.
    #[command(after_help = RENDER_HELP)]
    Render(Box<Render>),
    /// List the graphics processors a scene can run on.
    #[command(after_help = "Examples:\n  pliant devices\n  pliant run scenes/liver --device gpu\n  \
                            pliant run scenes/liver --device gpu --set run.adapter=nvidia\n\n\
                            The first one is taken where a scene names none. What is found can be narrowed by the variable \
                            WGPU_BACKEND (vulkan, metal, dx12).")]
    Devices {
        /// Print one JSON array on standard output.
        #[arg(long)]
        json: bool,
    },
}

#[derive(Debug, clap::Args)]
pub struct View {
    /// A scene file, or a folder with a scene.toml.
    pub scene: PathBuf,
    /// Write what the hand did when the window closes, to repeat it.
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// Repeat what the hand did, without a window, and print what it came to as JSON: the same bits every time.
    #[arg(long, value_name = "FILE", conflicts_with = "record")]
    pub replay: Option<PathBuf>,
    /// Repeat it in real time too, by a mouse that moves when it did, and tell how long it takes until a move is felt.
    #[arg(long, requires = "replay")]
    pub real_time: bool,
    /// Play, write a picture of the window as PNG, and close.
    #[arg(long, value_name = "FILE", conflicts_with = "replay")]
    pub screenshot: Option<PathBuf>,
    /// Simulated time before the picture of the window [s].
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0, requires = "screenshot")]
    pub after: f64,
    /// Try mouse and keys by itself, tell how it went and close; the picture of the window is taken while the hand pulls.
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
  pliant render organs.vtu --colour label --hide skin,5-8    the labels of a mesh in colours, without some
  pliant render scenes -o gallery                            a page with a picture of each scene in a folder

A scene is run first, without its own outputs; its table [view] tells how it is seen, the options below come before it. A mesh
file with labels is drawn as it is; of another one, or for a film, a scene is made as for `pliant view`. A film
whose name ends in .mp4 takes ffmpeg; without one, or with a name that ends in .png, it is an animated PNG.

Exit codes: 0 done, 1 the run or a picture failed, 2 the input is wrong or nothing draws here, 130 interrupted (Ctrl-C; 128 + its number for another signal).";

#[derive(Debug, clap::Args)]
pub struct Render {
    /// The folder of a finished run, or a scene file, a folder with a scene.toml, a NiftySim model (.xml), a mesh file, a folder of scenes.
    pub what: PathBuf,
    /// Frames: `all`, `last`, a number counted from 0, or several as in 0..20 (without the 20) and 10.. (to the end).
    #[arg(long, value_name = "FRAMES")]
    pub frames: Option<Frames>,
    /// Folder for the pictures.
    #[arg(short, long, value_name = "DIR", default_value = "pictures")]
    pub out: PathBuf,
    /// Write into a folder that holds other files.
    #[arg(long)]
    pub force: bool,
    /// Also make a film of them (.mp4 or .png).
    #[arg(long, value_name = "FILE")]
    pub film: Option<PathBuf>,
    /// Pictures a second of the film; if not given, so many that it plays in real time, 5 to 60.
    #[arg(long, value_name = "N", value_parser = rate, requires = "film")]
    pub rate: Option<f64>,
    /// Width and height [pixels].
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<[u32; 2]>,
    /// What colours tell: a field, a component of one as in `displacement:z` or `cauchy-stress:xx`, `label` for a colour of each label,
    /// or `none`.
    #[arg(long, value_name = "FIELD")]
    pub colour: Option<String>,
    /// Leave out the cells of labels, so that what lies inside is seen: numbers, names or ranges, as 2,tumour,5-8.
    #[arg(long, value_name = "LABELS", value_delimiter = ',', allow_hyphen_values = true)]
    pub hide: Vec<CellLabel>,
    /// Map of colours.
    #[arg(long, value_name = "MAP", value_parser = word::<MapName>())]
    pub map: Option<MapName>,
    /// Values of the first and the last colour.
    #[arg(long, value_name = "LOW,HIGH", value_parser = range, allow_hyphen_values = true)]
    pub range: Option<Numbers<2>>,
    /// Angles of the camera around the axis that points up and above the horizon [°].
    #[arg(long, value_name = "AZIMUTH,ELEVATION", value_parser = angles, allow_hyphen_values = true)]
    pub camera: Option<Numbers<2>>,
    /// Magnification.
    #[arg(long, value_name = "FACTOR", value_parser = factor)]
    pub zoom: Option<f64>,
    /// The axis that points up.
    #[arg(long, value_name = "AXIS", value_parser = ["x", "y", "z", "-x", "-y", "-z"], allow_hyphen_values = true)]
    pub up: Option<String>,
    /// Parallel lines stay parallel.
    #[arg(long)]
    pub orthographic: bool,
    /// Draw the edges of the elements.
    #[arg(long)]
    pub edges: bool,
    /// Draw nothing but the edges of the elements on the surface.
    #[arg(long)]
    pub wireframe: bool,
    /// Draw the shape at rest, as a ghost.
    #[arg(long)]
    pub ghost: bool,
    /// Draw fibres as short lines, on the surface and in a section (of a run: one whose series has the field `fibre` on its cells).
    #[arg(long)]
    pub fibres: bool,
    /// Mark the element with the smallest stable step, through the body (of a run: one whose series has the field `element-step` on
    /// its cells).
    #[arg(long)]
    pub critical: bool,
    /// What the surface is like.
    #[arg(long, value_name = "WORD", value_parser = word::<TextureName>())]
    pub texture: Option<TextureName>,
    /// A point and a normal: what lies on the side of the normal is taken away.
    #[arg(long, value_name = "X,Y,Z,NX,NY,NZ", value_parser = plane, allow_hyphen_values = true)]
    pub clip: Option<Numbers<6>>,
    /// What stands behind.
    #[arg(long, value_name = "WORD", value_parser = word::<BackgroundName>())]
    pub background: Option<BackgroundName>,
    /// The series of a finished run; the first one of the alphabet if not given.
    #[arg(long, value_name = "NAME")]
    pub series: Option<String>,
    /// Simulated time between frames of a scene [s]; if not given, that of its first series, else a hundredth of it.
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
    /// From one on, and up to another one or the end.
    Range(usize, Option<usize>),
}

impl FromStr for Frames {
    type Err = String;

    fn from_str(typed: &str) -> Result<Self, String> {
        let wrong = || format!("`{typed}` is no choice of frames: try all, last, 12, 0..20 or 10..");
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

/// Numbers with commas between them.
pub type Numbers<const N: usize> = [f64; N];

fn numbers<const N: usize>(typed: &str) -> Result<Numbers<N>, String> {
    let all: Option<Vec<f64>> =
        typed.split(',').map(|part| part.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
    all.and_then(|all| all.try_into().ok())
        .ok_or_else(|| format!("give {N} numbers with commas between them"))
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
        return Err("the elevation lies between -90 and 90°".into());
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

/// A word of the scene file's.
fn word<T>() -> impl TypedValueParser<Value = T>
where
    T: Choice + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(T::WORDS)
        .try_map(|typed| T::of_word(&typed).ok_or_else(|| format!("`{typed}` is unknown")))
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
        _ => Err("a film takes 1 to 240 pictures a second".into()),
    }
}

fn size(typed: &str) -> Result<[u32; 2], String> {
    let sides = typed.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    match sides {
        Some(sides) if sides.iter().all(|side| (16..=16_384).contains(side)) => Ok(sides),
        _ => Err("give width and height from 16 to 16384, as in 1280x800".into()),
    }
}

const BENCH_HELP: &str = "\
Examples:
  pliant bench                                   two minutes: all laws and elements, the thesis's series of meshes
  pliant bench --full                            on to meshes of two million elements
  pliant bench --designs                         the designs of the kernels on a graphics processor
  pliant bench --list
  pliant bench --only tet4-nh-55566 --only tet4-nh-55566-all
  pliant bench --json > bench.json
  pliant bench --full --table docs/performance.md

Keep the machine otherwise idle; least and most of the repeats show whether it was.";

#[derive(Debug, clap::Args)]
pub struct Bench {
    /// Measure everything, not just the default selection.
    #[arg(long, conflicts_with = "only")]
    pub full: bool,
    /// Measure the designs of the kernels on the best graphics processor instead; with `--full` on large meshes, too.
    #[arg(long, conflicts_with = "only")]
    pub designs: bool,
    /// Say what there is, and measure nothing.
    #[arg(long)]
    pub list: bool,
    /// Measure this row only; may be given several times. Three meshes or more of a series show its linear cost, too.
    #[arg(long, value_name = "ID")]
    pub only: Vec<String>,
    /// Repeats of each row; the median counts.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub repeats: u16,
    /// Wall time of a repeat [s]. On a busy machine the least of many short repeats is what nothing disturbed.
    #[arg(long, value_name = "S", default_value_t = 0.2, value_parser = seconds)]
    pub seconds: f64,
    /// Instructions to run in, instead of the widest there are; `plain` is one number at a time.
    #[arg(long, value_name = "WORD", value_parser = instructions())]
    pub lanes: Option<Instructions>,
    /// Print one JSON object on standard output.
    #[arg(long)]
    pub json: bool,
    /// Also renew the tables in a Markdown file, between its two marks.
    #[arg(long, value_name = "FILE")]
    pub table: Option<PathBuf>,
}

fn seconds(typed: &str) -> Result<f64, String> {
    match typed.parse() {
        Ok(seconds) if (0.001..=60.0).contains(&seconds) => Ok(seconds),
        _ => Err("a repeat takes between 0.001 and 60 seconds".into()),
    }
}

fn instructions() -> impl TypedValueParser<Value = Instructions> {
    let of = |word: &String| Instructions::ALL.into_iter().find(|known| known.name() == word);
    PossibleValuesParser::new(Instructions::ALL.map(Instructions::name))
        .try_map(move |word| of(&word).ok_or_else(|| format!("no instructions are called `{word}`")))
}

#[derive(Debug, clap::Args)]
pub struct Reproduce {
    /// Folder for index.html and results.json.
    #[arg(long, value_name = "DIR", default_value = "reproduce")]
    pub out: PathBuf,
    /// Write into a folder that holds other files.
    #[arg(long)]
    pub force: bool,
    /// Say what there is, and compute nothing.
    #[arg(long)]
    pub list: bool,
    /// Compute this case only; may be given several times.
    #[arg(long, value_name = "ID")]
    pub only: Vec<String>,
    /// Also renew the table of results in a Markdown file, between its two marks.
    #[arg(long, value_name = "FILE", conflicts_with = "only")]
    pub table: Option<PathBuf>,
}

#[derive(Clone, Debug, clap::Args)]
pub struct Overrides {
    /// Set any value of the scene; may be given several times. KEY is its path, with items of arrays by their number
    /// counted from 0; VALUE is TOML, a single word needs no quotes.
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
    /// Where the solver runs; `auto`: on a graphics processor if there is one that can.
    #[arg(long)]
    pub device: Option<DeviceName>,
    /// Make meshes of images anew, and keep none.
    #[arg(long)]
    pub no_cache: bool,
    /// Read only files in the folder of the scene, links resolved: for scenes of others (see SECURITY.md).
    #[arg(long)]
    pub sandbox: bool,
    /// Take a NiftySim model without the parts that Pliant does not know (shells, membranes, contact): another model.
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
    /// Folder for the outputs; if not given, out/NAME after the folder of the scene.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Write into a folder that is not empty.
    #[arg(long)]
    pub force: bool,
    /// Go on from a checkpoint (a file, or the last one in a folder) in the folder it lies in, or in `--out`.
    ///
    /// A scene writes checkpoints with `checkpoint = { every = 1.0 }` in `[run]`. The resumed run ends in the same
    /// bits as one that was never interrupted; its outputs go on where the checkpoint was. Only `until` may differ.
    #[arg(long, value_name = "CHECKPOINT", conflicts_with = "force")]
    pub resume: Option<PathBuf>,
    /// Run even if it will take more than a day.
    #[arg(long)]
    pub long: bool,
    #[command(flatten)]
    pub overrides: Overrides,
    /// Also draw the last instant, as the scene's [view] shows it: picture.png, in the summary, too.
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
  'scene.gravity=[0, 0, -9.81],[0, 0, 0]'        commas in brackets or quotes separate no values
  scene.gravity.2=-9.81,0                        an item of an array, counted from 0

Examples:
  pliant sweep scene.toml --set law.tissue.young-modulus=1e3..5e3/5 --set body.block.density=900,1100
  pliant sweep scene.toml --set run.load-steps=2,5,10 --dry-run

Writes sweep.csv, a row for each run: its values, how it ended, energies, reactions and probes at the end. Each run
leaves its summary, plot and tables in a folder run-NNNN. All combinations are checked before the first is run; a run
that fails does not stop the others.

Exit codes: 0 done, 1 some runs failed, 2 the input is wrong, 130 interrupted (Ctrl-C; 128 + its number for another signal).";

#[derive(Debug, clap::Args)]
pub struct Sweep {
    /// A scene file, or a folder with a scene.toml.
    pub scene: PathBuf,
    /// Values of a key of the scene, separated by commas; may be given several times. Every combination is run.
    #[arg(long, value_name = "KEY=VALUES", allow_hyphen_values = true, required = true)]
    pub set: Vec<String>,
    /// Folder for the table and the runs; if not given, out/NAME-sweep after the folder of the scene.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Write into a folder that is not empty.
    #[arg(long)]
    pub force: bool,
    /// Check and list the combinations; run nothing, write nothing.
    #[arg(long, alias = "list")]
    pub dry_run: bool,
    /// Make meshes of images anew, and keep none.
    #[arg(long)]
    pub no_cache: bool,
    /// Read only files in the folder of the scene, links resolved: for scenes of others (see SECURITY.md).
    #[arg(long)]
    pub sandbox: bool,
    /// Write the series of fields (VTU) of each run, too.
    #[arg(long)]
    pub keep_fields: bool,
    /// Runs at a time, each on one thread; 0: one per core. The number never changes a result.
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
    /// Write the mesh in another format, by the ending of the name.
    #[arg(long, value_name = "FILE")]
    pub convert: Option<PathBuf>,
    /// Also measure how far the surface of the mesh and that of another one are apart, both ways.
    #[arg(long, value_name = "OTHER")]
    pub against: Option<PathBuf>,
    /// Factor on all lengths of the other mesh; that of `--scale` if not given.
    #[arg(long, value_name = "FACTOR", requires = "against", allow_negative_numbers = true)]
    pub against_scale: Option<f64>,
    /// Print one JSON object on standard output.
    #[arg(long)]
    pub json: bool,
}

const MESH_HELP: &str = "\
Images: NIfTI (.nii, .nii.gz), NRRD, MetaImage (.mha, .mhd), GIPL, a DICOM segmentation, or the folder of a DICOM series. The mesh is
in metres, in the coordinates of the patient: x to the right, y to the front, z to the head.
Closed surfaces: the triangles and quads of OBJ, OFF, STL, PLY, VTP, VTK, VTU, Gmsh, GIfTI or FreeSurfer files, in metres or with
`--scale`.

Examples:
  pliant labels seg.nii.gz
  pliant mesh seg.nii.gz --label 5 --edge 8mm -o liver.vtu                             # or --edge 0.008
  pliant mesh liver.stl --scale 0.001 --edge 8mm --young 5000 -o liver.vtu             # a surface in millimetres
  pliant mesh brain.nii.gz --label 1 --label 2 --edge 6mm --keep-largest -o brain.vtu   # two materials
  pliant mesh seg.nrrd --label liver --label tumour --edge 8mm -o liver.vtu            # labels by their names
  pliant mesh seg.nii.gz --names totalsegmentator --label heart --edge 8mm -o heart.vtu # names from a table
  pliant mesh liver.nii.gz tumour.nii.gz --edge 8mm -o liver.vtu                       # masks: labels 1 and 2
  pliant mesh seg.nii.gz --label 5 --edge 0.01 --as hexes --close-gaps 3mm --fill-holes -o liver.msh
  pliant mesh seg.nii.gz --label 5 --edge 1cm --as immersed-hexes -o liver.vtu         # cubes weighted by their fill
  pliant mesh grey.nii --threshold 0.5 --edge 8mm -o grey.vtu
  pliant mesh grey.nii --add white.nii --threshold 0.5 --edge 8mm -o brain.vtu         # two maps of probabilities

  pliant mesh seg.nii.gz --label 5 --as surface --edge 5mm -o liver.ply              # even triangles
  pliant mesh liver.stl --as surface --cells 8000 -o coarse.stl                        # as few as asked for
  pliant mesh liver.stl --as shells --error 0.5% -o liver.vtu --error-map off.vtu      # or --shells 800

Of a mesh of volume cells its boundary is taken. Shells are curved triangles: point data `normal` are the fitted normals of their
nodes.

The label of each volume cell is its cell data `label`. A scene can name the image itself:
  mesh = { image = \"seg.nii.gz\", label = 5, edge = 0.008 }

Exit codes: 0 done, 1 the mesh could not be written, 2 the input is wrong.";

#[derive(Debug, clap::Args)]
pub struct Labels {
    /// An image file, or the folder of a DICOM series.
    pub image: PathBuf,
    /// More masks of the same voxels: the first image is label 1, these are 2, 3, …, named after their files.
    #[arg(value_name = "MASK")]
    pub masks: Vec<PathBuf>,
    /// Names of the labels: a table of ITK-SNAP, FreeSurfer or 3D Slicer, lines like `5 liver`, JSON, or the word `totalsegmentator`.
    #[arg(long, value_name = "TABLE")]
    pub names: Option<PathBuf>,
    /// Read an image of more than 2 GiB.
    #[arg(long)]
    pub force: bool,
    /// UID of the DICOM series, where the folder holds several.
    #[arg(long, value_name = "UID")]
    pub series: Option<String>,
    /// Print one JSON object on standard output.
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, clap::Args)]
pub struct MeshImage {
    /// An image file, the folder of a DICOM series, or a mesh file; for tets and hexes a closed surface.
    #[arg(value_name = "INPUT")]
    pub image: PathBuf,
    /// More masks of the same voxels: the first image is label 1, these are 2, 3, …, named after their files. All are meshed, but where
    /// `--label` chooses; where they overlap, the last one counts.
    #[arg(value_name = "MASK")]
    pub masks: Vec<PathBuf>,
    /// Another image of the same voxels whose values are added before `--threshold`, as grey matter to white matter.
    #[arg(long, value_name = "IMAGE")]
    pub add: Option<PathBuf>,
    /// Label to mesh: 5, a range as 5-8, or its name; several make one mesh of several materials. The first one takes what cleaning
    /// adds. With a surface, the label that its cells get.
    #[arg(long, value_name = "LABEL", allow_hyphen_values = true)]
    pub label: Vec<LabelChoice>,
    /// Names of the labels: a table of ITK-SNAP, FreeSurfer or 3D Slicer, lines like `5 liver`, JSON, or the word `totalsegmentator`.
    #[arg(long, value_name = "TABLE")]
    pub names: Option<PathBuf>,
    /// Instead of labels: all voxels of at least this value, as of a map of probabilities; with several masks, in each of them.
    #[arg(long, value_name = "VALUE", allow_negative_numbers = true)]
    pub threshold: Option<f64>,
    /// Edge of the cells: 0.008 in metres, or 8mm. Tets and hexes need it; a surface gets even triangles of this edge.
    #[arg(long, value_name = "LENGTH", value_parser = length, allow_hyphen_values = true)]
    pub edge: Option<f64>,
    /// Tets: largest distance between the boundary of the mesh and the body, both ways, as 1mm: cells are made smaller where it is not
    /// held. Measured to the triangles of a surface, or to the smooth surface of an image. Without `--edge` the first edge is chosen.
    #[arg(long, value_name = "LENGTH", value_parser = length, allow_hyphen_values = true)]
    pub distance: Option<f64>,
    /// Tets: longer edge inside, away from the surface, rounded down to 2, 4, 8, ... times `--edge`.
    #[arg(long, value_name = "LENGTH", value_parser = length, allow_hyphen_values = true)]
    pub inner_edge: Option<f64>,
    /// Tets: a label with smaller cells, by number or name, as 4 for half of `--edge` or tumour=2mm, rounded down to a half, quarter, ... of `--edge`.
    #[arg(long, value_name = "LABEL[=LENGTH]", value_parser = protected, allow_hyphen_values = true)]
    pub protect: Vec<(CellLabel, Option<f64>)>,
    /// Triangles of a surface, instead of their edge: as few, placed where the shape needs them.
    #[arg(long = "cells", value_name = "N", conflicts_with = "edge")]
    pub triangles: Option<usize>,
    /// Number of shells.
    #[arg(long, value_name = "N", conflicts_with_all = ["edge", "triangles"])]
    pub shells: Option<usize>,
    /// Largest distance of shells from the surface, both ways, as a part of the diagonal of its box: 0.005 or 0.5%.
    #[arg(long, value_name = "PART", value_parser = part, conflicts_with_all = ["edge", "triangles", "shells"])]
    pub error: Option<f64>,
    /// Factor that makes the lengths of a mesh file metres: 0.001 for millimetres. Images know theirs. A file larger than 10 m needs it.
    #[arg(long, value_name = "FACTOR")]
    pub scale: Option<f64>,
    /// Also write the curved surface of the shells in small triangles, with its distance from the target as point data.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["edge", "triangles"])]
    pub error_map: Option<PathBuf>,
    /// What to make: tetrahedra shaped for large stable steps, cubes with a stepped surface, all cubes that the body touches
    /// with the fraction that it fills (cell data `fraction`), a surface, or curved shells.
    #[arg(long = "as", value_name = "CELLS", default_value = "tets")]
    pub cells: MeshCells,
    /// Name of the mesh; .vtu or .msh, of a surface also .ply, .obj or .stl.
    #[arg(short, long, value_name = "FILE")]
    pub out: PathBuf,
    /// Close gaps and channels of up to this width, of a surface its holes: 0.003 in metres, or 3mm. Holes of a surface that are
    /// narrower than the cells are always closed.
    #[arg(long, value_name = "LENGTH", value_parser = length, default_value = "0", allow_hyphen_values = true)]
    pub close_gaps: f64,
    /// Fill cavities without a way out.
    #[arg(long)]
    pub fill_holes: bool,
    /// Keep only the largest piece.
    #[arg(long)]
    pub keep_largest: bool,
    /// Make more than five million cells, if it comes to that, and read images of more than 2 GiB.
    #[arg(long)]
    pub force: bool,
    /// UID of the DICOM series, where the folder holds several.
    #[arg(long, value_name = "UID")]
    pub series: Option<String>,
    /// Tissue whose stable step is reported: brain-like is E = 3000 Pa, liver-like E = 19 kPa; both without this. Both have ν = 0.45.
    #[arg(long, value_name = "NAME", conflicts_with = "young")]
    pub law: Option<Tissue>,
    /// Young's modulus of the tissue whose stable step is reported [Pa].
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

/// A length [m]: a number of metres, or one with its unit.
fn length(typed: &str) -> Result<f64, String> {
    const UNITS: [(&str, f64); 5] = [("µm", 1e-6), ("um", 1e-6), ("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)];
    let unit = UNITS.iter().find_map(|(unit, metres)| Some((typed.strip_suffix(unit)?, metres)));
    let (number, metres) = unit.unwrap_or((typed, &1.0));
    match number.trim_end().parse::<f64>() {
        Ok(number) => Ok(number * metres),
        Err(_) => Err("a length is a number of metres, as 0.008, or one with its unit, as 8mm".into()),
    }
}

/// A label, and the length after it if there is one.
fn protected(typed: &str) -> Result<(CellLabel, Option<f64>), String> {
    let (label, edge) = typed.rsplit_once('=').map_or((typed, None), |(label, edge)| (label, Some(edge)));
    let label = match label.trim() {
        "" => {
            return Err(
                "a label to protect is a number or a name, as 4, or one with an edge, as tumour=2mm".into()
            );
        }
        text => text.parse().unwrap_or_else(|never: std::convert::Infallible| match never {}),
    };
    Ok((label, edge.map(str::trim).map(length).transpose()?))
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

/// A part of one, or percent.
fn part(typed: &str) -> Result<f64, String> {
    let number = match typed.strip_suffix('%') {
        Some(percent) => percent.trim().parse::<f64>().map(|percent| percent / 100.0),
        None => typed.parse(),
    };
    match number {
        Ok(part) if part > 0.0 && part < 1.0 => Ok(part),
        _ => Err("a part of the diagonal is above 0 and below 1, as 0.005 or 0.5%".into()),
    }
}

impl Command {
    pub fn wants_json(&self) -> bool {
        match self {
            Self::Run(run) => run.json,
            Self::Info(info) => info.json,
            Self::Labels(labels) => labels.json,
            Self::Mesh(mesh) => mesh.json,
            Self::Bench(bench) => bench.json,
            Self::Devices { json } => *json,
            Self::Sweep(_)
            | Self::Check(_)
            | Self::New { .. }
            | Self::Schema { .. }
            | Self::Import { .. }
            | Self::Render(_)
            | Self::View(_)
            | Self::Reproduce(_) => false,
        }
    }
}
