//! Commands and options.

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Parser, Subcommand};
use pliant_bench::Instructions;

/// The laboratory of Pliant: results of the literature computed again, and the cost of a step.
#[derive(Debug, Parser)]
#[command(
    version,
    after_help = "Example:\n  pliant-lab reproduce --only fig-6.3 --out shear\n\nExit codes: 0 done, 1 some numbers are not within their tolerance or nothing could be measured, 2 invalid input."
)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Compute the results of the thesis and compare them with the published ones.
    #[command(
        after_help = "Examples:\n  pliant-lab reproduce\n  pliant-lab reproduce --list\n  pliant-lab reproduce --only fig-6.3 --out shear\n\n\
                      Exit codes: 0 all numbers within their tolerance, 1 some are not, 2 invalid input."
    )]
    Reproduce(Reproduce),
    /// Measure the cost of a step on this machine.
    #[command(after_help = BENCH_HELP)]
    Bench(Bench),
}

const BENCH_HELP: &str = "\
Examples:
  pliant-lab bench                               two minutes: all laws and elements, the thesis's series of meshes
  pliant-lab bench --full                            also meshes up to two million elements
  pliant-lab bench --designs                         the kernel designs on a GPU
  pliant-lab bench --shells                          implicit steps of shells, on the CPU and on a GPU
  pliant-lab bench --list
  pliant-lab bench --only tet4-nh-55566 --only tet4-nh-55566-all
  pliant-lab bench --json > bench.json
  pliant-lab bench --full --table docs/lab/step-costs.md

Keep the machine otherwise idle; the least and the most of the repeats reveal other load.";

#[derive(Debug, clap::Args)]
pub struct Bench {
    /// Measure all rows, not only the default selection.
    #[arg(long, conflicts_with = "only")]
    pub full: bool,
    /// Measure the kernel designs on the best GPU instead; with `--full` also on large meshes.
    #[arg(long, conflicts_with = "only")]
    pub designs: bool,
    /// Measure implicit steps of 800 to 50,000 shells instead, on the CPU and, where there is one, with a GPU
    /// for their equations.
    #[arg(long, conflicts_with_all = ["full", "designs", "list", "only", "lanes", "json", "table"])]
    pub shells: bool,
    /// List the rows without measuring.
    #[arg(long)]
    pub list: bool,
    /// Measure only this row; may be repeated. Three or more meshes of a series also give its linear cost.
    #[arg(long, value_name = "ID")]
    pub only: Vec<String>,
    /// Repeats of each row; the table shows their median.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub repeats: u16,
    /// Wall time of a repeat [s]. On a busy machine the least of many short repeats is undisturbed.
    #[arg(long, value_name = "S", default_value_t = 0.2, value_parser = seconds)]
    pub seconds: f64,
    /// Instruction set instead of the widest available; `plain` is scalar.
    #[arg(long, value_name = "WORD", value_parser = instructions())]
    pub lanes: Option<Instructions>,
    /// Print one JSON object on standard output.
    #[arg(long)]
    pub json: bool,
    /// Also update the tables in a Markdown file, between its two marks.
    #[arg(long, value_name = "FILE")]
    pub table: Option<PathBuf>,
}

fn seconds(typed: &str) -> Result<f64, String> {
    match typed.parse() {
        Ok(seconds) if (0.001..=60.0).contains(&seconds) => Ok(seconds),
        _ => Err("a repeat must take between 0.001 and 60 seconds".into()),
    }
}

fn instructions() -> impl TypedValueParser<Value = Instructions> {
    let of = |word: &String| Instructions::ALL.into_iter().find(|known| known.name() == word);
    PossibleValuesParser::new(Instructions::ALL.map(Instructions::name))
        .try_map(move |word| of(&word).ok_or_else(|| format!("no instruction set is called `{word}`")))
}

#[derive(Debug, clap::Args)]
pub struct Reproduce {
    /// Folder for index.html and results.json.
    #[arg(long, value_name = "DIR", default_value = "reproduce")]
    pub out: PathBuf,
    /// Write into a folder with other files.
    #[arg(long)]
    pub force: bool,
    /// List the cases without computing.
    #[arg(long)]
    pub list: bool,
    /// Compute only this case; may be repeated.
    #[arg(long, value_name = "ID")]
    pub only: Vec<String>,
    /// Also update the table of results in a Markdown file, between its two marks.
    #[arg(long, value_name = "FILE", conflicts_with = "only")]
    pub table: Option<PathBuf>,
}
