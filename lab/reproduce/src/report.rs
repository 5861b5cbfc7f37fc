//! The outputs of a reproduction: `results.json`, one page, and a table for `docs/lab/validation.md`.

use std::time::{Duration, Instant};

use pliant_bench::Machine;
use serde_json::json;

use crate::case::{Case, Findings, Row};
use crate::digits::{reference, significant, tolerance};

/// Cases and their results.
#[derive(Clone, Debug)]
pub struct Report {
    pub(crate) cases: Vec<(&'static Case, Findings, Duration)>,
    pub(crate) machine: Machine,
    pub(crate) date: time::Date,
}

impl Report {
    /// Computes cases one after another. `starting` is called with each case before it is computed.
    pub fn new(cases: &[&'static Case], mut starting: impl FnMut(&'static Case)) -> Self {
        let mut done = Vec::new();
        for &case in cases {
            starting(case);
            let started = Instant::now();
            done.push((case, case.run(), started.elapsed()));
        }
        Self { cases: done, machine: Machine::this(), date: time::OffsetDateTime::now_utc().date() }
    }

    /// Returns all rows.
    pub fn rows(&self) -> impl Iterator<Item = &Row> {
        self.cases.iter().flat_map(|(_, findings, _)| &findings.rows)
    }

    /// Number of rows that passed and number that failed; the others are not judged.
    pub fn counts(&self) -> [usize; 2] {
        [true, false].map(|pass| self.rows().filter(|row| row.pass == Some(pass)).count())
    }

    /// The wall time of all cases.
    pub fn wall(&self) -> Duration {
        self.cases.iter().map(|case| case.2).sum()
    }

    /// `results.json`.
    pub(crate) fn results(&self) -> serde_json::Value {
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

/// Verdict in words: yes, no, or not judged.
pub(crate) fn verdict(pass: Option<bool>) -> &'static str {
    match pass {
        Some(true) => "pass",
        Some(false) => "**fail**",
        None => "–",
    }
}

/// The commit that was built, if git knew it.
pub(crate) fn commit() -> Option<&'static str> {
    option_env!("PLIANT_COMMIT")
}

#[cfg(test)]
mod tests {
    use super::*;

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
