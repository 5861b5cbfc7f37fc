//! The outputs of a reproduction: `results.json`, one page, and a table for `docs/validation.md`.

use std::time::{Duration, Instant};

use pliant_bench::Machine;
use serde_json::json;

use crate::case::{Case, Findings, Row};
use crate::page;

/// The files of a report.
const FILES: [&str; 2] = ["index.html", "results.json"];

/// Cases and their results.
#[derive(Clone, Debug)]
pub struct Report {
    pub(crate) cases: Vec<(&'static Case, Findings, Duration)>,
    pub(crate) machine: Machine,
    pub(crate) date: time::Date,
}

impl Report {
    /// Computes cases one after another. `starting` hears of each before it is computed.
    pub fn new(cases: &[&'static Case], mut starting: impl FnMut(&'static Case)) -> Self {
        let mut done = Vec::new();
        for &case in cases {
            starting(case);
            let started = Instant::now();
            done.push((case, case.run(), started.elapsed()));
        }
        Self { cases: done, machine: Machine::this(), date: time::OffsetDateTime::now_utc().date() }
    }

    /// All rows.
    pub fn rows(&self) -> impl Iterator<Item = &Row> {
        self.cases.iter().flat_map(|(_, findings, _)| &findings.rows)
    }

    /// How many rows passed and how many failed; the others are not judged.
    pub fn counts(&self) -> [usize; 2] {
        [true, false].map(|pass| self.rows().filter(|row| row.pass == Some(pass)).count())
    }

    /// The wall time of all cases.
    pub fn wall(&self) -> Duration {
        self.cases.iter().map(|case| case.2).sum()
    }

    /// The files, each with its name.
    pub fn files(&self) -> [(&'static str, String); 2] {
        let [page, results] = FILES;
        [(page, page::page(self)), (results, format!("{:#}\n", self.results()))]
    }

    fn results(&self) -> serde_json::Value {
        let [passed, failed] = self.counts();
        json!({
            "version": env!("CARGO_PKG_VERSION"),
            "commit": commit(),
            "date": self.date.to_string(),
            "machine": self.machine,
            "wall_seconds": self.wall().as_secs_f64(),
            "passed": passed,
            "failed": failed,
            "rows": self.rows().collect::<Vec<_>>(),
        })
    }

    /// The rows that do not depend on the machine, as a Markdown table.
    pub fn table(&self) -> String {
        let mut lines = vec![
            "| case | quantity | reference | tolerance | computed | pass |".to_owned(),
            "|---|---|---|---|---|---|".to_owned(),
        ];
        lines.extend(self.rows().filter(|row| !row.machine).map(|row| {
            let quantity = if row.unit.is_empty() {
                row.quantity.clone()
            } else {
                format!("{} [{}]", row.quantity, row.unit)
            };
            format!(
                "| `{}` | {} | {} | {} | {} | {} |",
                row.id,
                quantity.replace('|', "\\|"),
                reference(row),
                tolerance(row),
                row.computed_digits(),
                verdict(row.pass)
            )
        }));
        lines.join("\n") + "\n"
    }
}

impl Row {
    /// The computed number: a deviation with two digits, others to a tenth of the tolerance or with four.
    pub(crate) fn computed_digits(&self) -> String {
        let Some(value) = self.computed else { return "–".to_owned() };
        let digits = match (self.reference, self.tolerance) {
            (Some(0.0), _) => 2,
            (Some(_), Some(tolerance)) => {
                let place = |x: f64| x.abs().log10().floor();
                (place(value) - place(tolerance) + 2.0).clamp(2.0, 7.0) as usize
            }
            _ => 4,
        };
        significant(value, digits)
    }
}

/// The commit that was built, if git knew it.
pub(crate) fn commit() -> Option<&'static str> {
    option_env!("PLIANT_COMMIT")
}

/// A reference as it was given.
pub(crate) fn reference(row: &Row) -> String {
    shown(row.reference, 7)
}

/// A tolerance, to three digits.
pub(crate) fn tolerance(row: &Row) -> String {
    shown(row.tolerance, 3)
}

fn shown(value: Option<f64>, digits: usize) -> String {
    let Some(value) = value else { return "–".to_owned() };
    let text = significant(value, digits);
    if text.contains('.') && !text.contains('e') {
        return text.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    text
}

/// Yes, no, or nothing to judge by.
pub(crate) fn verdict(pass: Option<bool>) -> &'static str {
    match pass {
        Some(true) => "pass",
        Some(false) => "**fail**",
        None => "–",
    }
}

/// A number with a count of significant digits, but whole up to a million; beyond, and below a thousandth, with an
/// exponent.
pub(crate) fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let rounded: f64 = format!("{value:.*e}", digits - 1).parse().unwrap_or(value);
    if (1e-3..1e6).contains(&rounded.abs()) {
        let decimals = digits as i32 - 1 - rounded.abs().log10().floor() as i32;
        format!("{value:.*}", decimals.max(0) as usize)
    } else {
        format!("{rounded:e}")
    }
}

/// Whether a report writes a file of this name.
pub fn is_own_file(name: &str) -> bool {
    FILES.contains(&name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_they_deserve() {
        let four = [8.8109, 0.0234, 123456.7, 2.4276e-5, -34.85, 9.99996].map(|x| significant(x, 4));
        assert_eq!(four, ["8.811", "0.02340", "123457", "2.428e-5", "-34.85", "10.00"]);
        let given = [8.75, 0.1, 1e-9, 30.0, 2.12].map(|x| shown(Some(x), 7));
        assert_eq!(given, ["8.75", "0.1", "1e-9", "30", "2.12"]);
        assert_eq!(shown(Some(5.272704), 3), "5.27");
    }

    #[test]
    fn a_computed_number_has_the_digits_by_which_it_is_judged() {
        let digits = |reference, tolerance, computed| {
            Row::judged("", "", [reference, tolerance], computed, "").computed_digits()
        };
        assert_eq!(digits(8.75, 0.1, 8.83044), "8.83");
        assert_eq!(digits(-2189.3333333, 2.2e-6, -2189.3333333), "-2189.333");
        assert_eq!(digits(52.7, 5.27, 50.4834), "50.5");
        assert_eq!(digits(0.0, 1e-5, 4.6512e-7), "4.7e-7");
    }
}
