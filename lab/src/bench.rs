//! `pliant-lab bench`: the cost of a step on this machine.

use pliant_bench::{BenchError, Case, Instructions, Place, Settings, cases, find, measure, measure_shells};
use pliant_command::{Bar, Failure, SUCCESS, say, tell};
use serde_json::json;

use crate::arguments::Bench;
use crate::page::Page;

pub fn bench(arguments: &Bench) -> Result<u8, Failure> {
    if arguments.list {
        say(list())?;
        return Ok(SUCCESS);
    }
    if arguments.shells {
        return shells();
    }
    let cases = chosen(arguments)?;
    let page = arguments.table.as_deref().map(|path| Page::read(path, "bench")).transpose()?;
    let bar = Bar::new();
    let Bench { seconds, repeats, lanes, .. } = *arguments;
    let settings =
        Settings { repeats: repeats.into(), seconds, lanes: lanes.unwrap_or_else(Instructions::widest) };
    let result = measure(&cases, settings, &mut |progress| bar.show(progress.part, progress.now.clone()));
    bar.finish();
    let report = match result {
        Ok(report) => report,
        Err(BenchError::Lanes(missing)) => {
            let help = format!("omit `--lanes`, or use `--lanes {}`", missing.widest);
            return Err(Failure::plain(missing.to_string(), help));
        }
        Err(error) => {
            tell(format_args!("error: {error}"));
            if arguments.json {
                say(json!({ "error": error.to_string() }))?;
            }
            return Ok(1);
        }
    };
    if arguments.json {
        say(report.json())?;
    } else {
        say(report.table())?;
    }
    if let Some(page) = page {
        page.renew(&format!("\n{}\n\n", report.table()))?;
    }
    Ok(SUCCESS)
}

/// Implicit steps of shells, on the CPU and on a GPU.
fn shells() -> Result<u8, Failure> {
    let bar = Bar::new();
    let result = measure_shells(&mut |progress| bar.show(progress.part, progress.now.clone()));
    bar.finish();
    match result {
        Ok(report) => say(report.table()).map(|()| SUCCESS),
        Err(error) => {
            tell(format_args!("error: {error}"));
            Ok(1)
        }
    }
}

/// Largest number of cells that `--designs` measures without `--full`.
const SMALL: usize = 100_000;

/// The requested rows, in the order of the table.
fn chosen(arguments: &Bench) -> Result<Vec<Case>, Failure> {
    let mut asked = Vec::new();
    for id in &arguments.only {
        asked.push(find(id).map_err(|nearest| {
            let help = format!("did you mean `{nearest}`? `pliant-lab bench --list` prints all");
            Failure::plain(format!("there is no row `{id}`"), help)
        })?);
    }
    let wanted = |case: &Case| match asked.as_slice() {
        [] if arguments.designs => case.is_on_device() && (arguments.full || case.cells() <= SMALL),
        [] => !case.is_on_device() && (arguments.full || case.is_default()),
        asked => asked.contains(case),
    };
    Ok(cases().into_iter().filter(wanted).collect())
}

fn list() -> String {
    let line = |case: Case| {
        let selection = match (case.is_on_device(), case.is_default()) {
            (true, _) if case.cells() <= SMALL => "--designs",
            (true, _) => "--designs --full",
            (false, true) => "default",
            (false, false) => "--full",
        };
        let place = match case.place {
            Place::Processor(threads) => format!("threads: {}", threads.count()),
            Place::Device(design) => format!("design: {design}"),
        };
        format!(
            "{:<36} {selection:<16} {} {}, cube of {} elements, {} precision, {place}",
            case.id(),
            case.element.name(),
            case.law.name(),
            case.cells(),
            case.precision.name(),
        )
    };
    cases().into_iter().map(line).collect::<Vec<_>>().join("\n")
}
