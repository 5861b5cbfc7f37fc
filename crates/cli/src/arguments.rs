//! What can be typed.

use std::path::PathBuf;

use clap::{Parser, Subcommand, ValueEnum};

/// Real-time simulation of soft organs.
#[derive(Debug, Parser)]
#[command(
    version,
    after_help = "Example:\n  pliant new my-organ && pliant run my-organ\n\nExit codes: 0 done, 1 the run failed, 2 the input is wrong."
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
                            pliant run scene.toml --precision single --threads 4 --json > result.json"
    )]
    Run(Run),
    /// Check a scene and print its model; runs nothing, writes nothing.
    #[command(after_help = "Example:\n  pliant check scenes/liver")]
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
    },
    /// Say what a mesh file holds, how good it is, and what is wrong with it.
    #[command(after_help = "Examples:\n  pliant info liver.msh\n  pliant info liver.msh --convert liver.vtu")]
    Info(Info),
}

#[derive(Debug, clap::Args)]
pub struct Overrides {
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
    #[command(flatten)]
    pub overrides: Overrides,
    /// Print one JSON object with the results on standard output.
    #[arg(long)]
    pub json: bool,
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
    /// Print one JSON object on standard output.
    #[arg(long)]
    pub json: bool,
}

impl Command {
    pub fn wants_json(&self) -> bool {
        match self {
            Self::Run(run) => run.json,
            Self::Info(info) => info.json,
            Self::Check(_) | Self::New { .. } | Self::Schema { .. } | Self::Import { .. } => false,
        }
    }
}
