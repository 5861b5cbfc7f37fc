//! Commands and options.

mod meshing;
mod page;
mod pictures;

use std::path::PathBuf;

use clap::{Parser, Subcommand, ValueEnum};
use pliant_run::SweepPart;

use self::meshing::MESH_HELP;
pub use self::meshing::{Labels, MeshCells, MeshImage, Tissue};
pub use self::page::page;
#[cfg(feature = "viewer")]
pub use self::pictures::Frames;
use self::pictures::RENDER_HELP;
pub use self::pictures::{Render, View};

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
        /// Print the reference page of all commands as Markdown instead.
        #[arg(long, conflicts_with_all = ["markdown", "python"])]
        commands: bool,
    },
    /// Translate a NiftySim model into a scene.
    #[command(after_help = "Examples:\n  pliant import model.xml -o model && pliant run model\n  \
                            pliant import model.xml -o scene.toml && pliant run scene.toml\n  \
                            pliant run model.xml")]
    Import {
        /// A NiftySim model (XML).
        model: PathBuf,
        /// Folder for the scene and its meshes, or name of the scene file (.toml) with the meshes next to it.
        #[arg(short, long, value_name = "DIR|FILE")]
        out: PathBuf,
        /// Translate a model with unsupported parts (shells that bend, radii that change) without these
        /// parts.
        #[arg(long)]
        allow_partial: bool,
    },
    /// Print contents, quality and defects of a mesh file.
    #[command(
        after_help = "Examples:\n  pliant info liver.msh\n  pliant info liver.msh --convert liver.vtu\n  \
                            pliant info liver.vtu --against liver.stl --against-scale 0.001"
    )]
    Info(Info),
    /// List the labels of a segmented image: name, volume, location and pieces of each, and where the image
    /// cuts it off.
    #[command(
        after_help = "Examples:\n  pliant labels seg.nii.gz\n  pliant labels seg.nii.gz --names totalsegmentator\n  \
                            pliant labels liver.nii.gz tumour.nii.gz --json"
    )]
    Labels(Labels),
    /// Make a mesh from labels of a segmented image or from a closed surface: tets, hexes, a surface or
    /// curved shells.
    #[command(after_help = MESH_HELP)]
    Mesh(Box<MeshImage>),
    /// Moved into the laboratory.
    #[command(hide = true, disable_help_flag = true)]
    Reproduce(Moved),
    /// Moved into the laboratory.
    #[command(hide = true, disable_help_flag = true)]
    Bench(Moved),
    /// Open a scene in a window: play it, pull it, turn the view. Or a finished run: scrub and play its
    /// frames.
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
  pliant haptics scenes/palpation --listen 127.0.0.1:4270       devices connect as docs/guide/tools-and-haptics.md describes

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
    /// Address to which devices send their poses; port 0 for a free one.
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

/// The words of a command that `pliant-lab` has now.
#[derive(Debug, clap::Args)]
pub struct Moved {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    pub words: Vec<String>,
}

#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Overrides {
    /// Set any value of the scene; may be repeated. KEY is its path, with array items numbered from 0. VALUE
    /// is TOML; a single word needs no quotes.
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
    /// Omit parts of a NiftySim model that Pliant does not support (shells that bend, radii that change);
    /// this changes the model.
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
    /// A scene writes checkpoints with `checkpoint = { every = 1.0 }` in `[run]`. The resumed run has the
    /// same bits as an uninterrupted one, and its outputs continue from the checkpoint. Only `until` may
    /// differ.
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
    /// Run only every N-th combination from the I-th on, and append rows to rows-I-of-N.jsonl in the folder:
    /// for job arrays. The same command again runs the missing combinations.
    #[arg(long, value_name = "I/N", conflicts_with_all = ["force", "dry_run", "merge"])]
    pub part: Option<SweepPart>,
    /// Put the rows of all parts in the folder together into the table, and name the missing combinations.
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
pub(crate) struct Info {
    /// A mesh file.
    pub mesh: PathBuf,
    /// Factor on all lengths: the size of one unit of the mesh in metres (0.001 for millimetres).
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    pub scale: f64,
    /// Write the mesh in another format, selected by the file extension.
    #[arg(long, value_name = "FILE")]
    pub convert: Option<PathBuf>,
    /// Also measure the distance between this surface and the surface of another mesh, in both directions.
    #[arg(long, value_name = "OTHER")]
    pub against: Option<PathBuf>,
    /// Factor on all lengths of the other mesh; by default the factor of `--scale`.
    #[arg(long, value_name = "FACTOR", requires = "against", allow_negative_numbers = true)]
    pub against_scale: Option<f64>,
    /// Print one JSON object on standard output.
    #[arg(long)]
    pub json: bool,
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
