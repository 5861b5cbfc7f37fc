//! `pliant-lab reproduce`: results of the literature, computed, judged and written to a page.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use pliant_command::{Failure, SUCCESS, say, tell};
use pliant_reproduce::{CASES, Case, Report, find, is_own_file};
use pliant_run::OutputFolder;

use crate::arguments::Reproduce;
use crate::page::Page;

pub fn reproduce(arguments: &Reproduce) -> Result<u8, Failure> {
    if arguments.list {
        say(list())?;
        return Ok(SUCCESS);
    }
    let cases = chosen(&arguments.only)?;
    let page = arguments.table.as_deref().map(|path| Page::read(path, "reproduce")).transpose()?;
    let folder = OutputFolder::claim(arguments.out.clone(), arguments.force, is_own_file)
        .map_err(|error| Failure::plain(&error, error.remedy))?;

    let report = compute(&cases);
    for (name, content) in report.files() {
        let path = folder.write(name, &content).map_err(|error| Failure::plain(&error, error.remedy))?;
        tell(format_args!("wrote {}", path.display()));
    }
    if let Some(page) = page {
        page.renew(&report.table())?;
    }
    say(verdict(&report))?;
    let [_, failed] = report.counts();
    Ok(u8::from(failed > 0))
}

/// The requested cases, in the order of the page; by default all.
fn chosen(ids: &[String]) -> Result<Vec<&'static Case>, Failure> {
    let mut asked = Vec::new();
    for id in ids {
        asked.push(find(id).map_err(|nearest| {
            let help = format!("did you mean `{nearest}`? `pliant-lab reproduce --list` prints all");
            Failure::plain(format!("there is no case `{id}`"), help)
        })?);
    }
    let wanted = |case: &&Case| asked.is_empty() || asked.iter().any(|a| a.id == case.id);
    Ok(CASES.iter().filter(wanted).collect())
}

fn list() -> String {
    let mut lines: Vec<String> = (CASES.iter())
        .map(|case| format!("{:<12} about {:>3.0} s  {}", case.id, case.seconds.max(1.0), case.title))
        .collect();
    let seconds: f64 = CASES.iter().map(|case| case.seconds).sum();
    lines.push(format!("{:<12} about {seconds:>3.0} s on two cores", "all"));
    lines.join("\n")
}

/// Computes with a bar on standard error that counts expected seconds; hidden without a terminal.
fn compute(cases: &[&'static Case]) -> Report {
    let seconds: f64 = cases.iter().map(|case| case.seconds).sum();
    let bar = ProgressBar::new((10.0 * seconds).max(1.0) as u64);
    let style = ProgressStyle::with_template("{bar:40} {percent:>3} %  {msg}  {elapsed}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.enable_steady_tick(Duration::from_millis(200));
    let mut before = 0.0;
    let report = Report::new(cases, |case| {
        bar.set_message(format!("{}, about {:.0} s", case.id, case.seconds.max(1.0)));
        bar.set_position((10.0 * before) as u64);
        before += case.seconds;
    });
    bar.finish_and_clear();
    report
}

/// The failed rows and the number of passed ones.
fn verdict(report: &Report) -> String {
    let mut lines: Vec<String> = (report.rows().filter(|row| row.pass == Some(false)))
        .map(|row| {
            let number =
                |value: Option<f64>| value.map_or_else(|| "nothing".to_owned(), |v| format!("{v:.6e}"));
            format!(
                "failed: {}, {}: {} {} instead of {} ± {}",
                row.id,
                row.quantity,
                number(row.computed),
                row.unit,
                number(row.reference),
                number(row.tolerance)
            )
        })
        .collect();
    let [passed, failed] = report.counts();
    lines.push(format!(
        "{passed} of {} judged numbers are within their tolerance; {:.0} s",
        passed + failed,
        report.wall().as_secs_f64()
    ));
    lines.join("\n")
}
