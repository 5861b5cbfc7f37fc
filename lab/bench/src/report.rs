//! The measurements, as a table and as JSON.

use pliant_explicit::Instructions;
use pliant_gpu::{Adapter, DeviceRates};
use serde::Serialize;
use serde_json::{Value, json};

use crate::case::Case;
use crate::clock::Spread;
use crate::settings::Settings;
use crate::{Count, Machine, Rates};

/// The source of a critical step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Limit {
    /// The smallest element bound.
    ElementBound,
    /// The critical time step of the assembled model.
    #[serde(rename = "critical-step")]
    True,
}

/// One measured case.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Its name on the command line.
    pub id: String,
    /// The mesh: `cube-21` has 21 grid cells along each edge.
    pub mesh: String,
    /// Cells.
    pub cells: usize,
    /// The element.
    pub element: &'static str,
    /// The law.
    pub law: &'static str,
    /// The number type.
    pub precision: &'static str,
    /// Threads; `null` on a GPU.
    pub threads: Option<usize>,
    /// The CPU or the GPU.
    pub adapter: String,
    /// The path that ran: `cpu`, or the design on a GPU.
    pub design: String,
    /// The instructions it used; `null` on a GPU.
    pub lanes: Option<&'static str>,
    /// Wall time of a step per element [ns], the median of the repeats.
    pub ns_per_element_step: f64,
    /// Wall time of a step per element [ns] in the fastest repeat.
    pub ns_least: f64,
    /// Wall time of a step per element [ns] in the slowest repeat.
    pub ns_most: f64,
    /// Elements stepped in a second.
    pub elements_per_second: f64,
    /// Bytes to and from memory per element and step, as counted; `null` on a GPU.
    pub bytes_per_element: Option<f64>,
    /// Operations per element and step, as counted; `null` on a GPU.
    pub flops_per_element: Option<f64>,
    /// Bytes per second over the copy rate of these threads; `null` on a GPU.
    pub bandwidth_fraction: Option<f64>,
    /// Operations per second over the multiply-add rate of these threads; `null` on a GPU.
    pub flop_fraction: Option<f64>,
    /// The step [s] that a run would take: 0.9 × the limit at rest.
    pub critical_step: f64,
    /// The limit: the assembled model's, or for large meshes the element bound.
    pub critical_step_from: Limit,
    /// The critical step over the wall time of a step.
    pub real_time_factor: f64,
    /// Wall time of a simulated second [s].
    pub seconds_per_second: f64,
    /// The case.
    #[serde(skip)]
    pub case: Case,
}

/// The place of a case.
#[derive(Clone, Debug)]
pub(crate) struct Measured {
    pub adapter: String,
    pub threads: Option<usize>,
    pub design: String,
    pub lanes: Option<Instructions>,
    /// Bytes read and written in copying [1/s] and operations in multiply-adds [1/s], if the bytes and
    /// operations of a step are counted.
    pub peaks: Option<[f64; 2]>,
}

impl Row {
    /// Makes a row from the wall times of a step [s], and the step [s] with the source of its limit.
    pub(crate) fn new(
        case: Case,
        place: Measured,
        seconds: Spread,
        (step, critical_step_from): (f64, Limit),
    ) -> Self {
        let cells = case.cells() as f64;
        let count = place.peaks.map(|peaks| (Count::of(&case), peaks));
        let ns = |seconds: f64| 1e9 * seconds / cells;
        let elements_per_second = cells / seconds.median;
        Self {
            id: case.id(),
            mesh: format!("cube-{}", case.edge),
            cells: case.cells(),
            element: case.element.name(),
            law: case.law.name(),
            precision: case.precision.name(),
            threads: place.threads,
            adapter: place.adapter,
            design: place.design,
            lanes: place.lanes.map(Instructions::name),
            ns_per_element_step: ns(seconds.median),
            ns_least: ns(seconds.least),
            ns_most: ns(seconds.most),
            elements_per_second,
            bytes_per_element: count.map(|(count, _)| count.bytes),
            flops_per_element: count.map(|(count, _)| count.flops),
            bandwidth_fraction: count.map(|(count, [copy, _])| elements_per_second * count.bytes / copy),
            flop_fraction: count
                .map(|(count, [_, multiply_add])| elements_per_second * count.flops / multiply_add),
            critical_step: step,
            critical_step_from,
            real_time_factor: step / seconds.median,
            seconds_per_second: seconds.median / step,
            case,
        }
    }

    /// The threads, or the design on a GPU.
    fn place(&self) -> String {
        self.threads.map_or_else(|| self.design.clone(), |threads| threads.to_string())
    }
}

/// T = b N over the meshes of a series: the cost of an element if it is the same in all meshes.
#[derive(Clone, Debug)]
pub struct Fit {
    /// One of the cases.
    pub case: Case,
    /// Threads, or the design.
    pub place: String,
    /// Meshes.
    pub meshes: usize,
    /// Cells of the smallest and of the largest mesh.
    pub cells: [usize; 2],
    /// b [ns], by least squares of the relative deviations b N/T − 1.
    pub ns_per_element_step: f64,
    /// The largest |T/(b N) − 1| …
    pub largest_deviation: f64,
    /// … and the cells of the mesh that has it.
    pub farthest: usize,
}

impl Fit {
    /// The fits of all series of three meshes or more.
    pub(crate) fn of_rows(rows: &[Row]) -> Vec<Self> {
        let mut fits = Vec::<Self>::new();
        for row in rows {
            if !fits.iter().any(|fit| fit.covers(&row.case)) {
                let of_series: Vec<&Row> =
                    rows.iter().filter(|other| same_series(&row.case, &other.case)).collect();
                fits.extend(Self::of(&of_series));
            }
        }
        fits
    }

    /// Fits a series; `None` for fewer than three meshes.
    fn of(rows: &[&Row]) -> Option<Self> {
        let (first, last) =
            (rows.iter().min_by_key(|row| row.cells)?, rows.iter().max_by_key(|row| row.cells)?);
        // With r = N/T, b = Σ r / Σ r².
        let rates = rows.iter().map(|row| 1.0 / row.ns_per_element_step);
        let b = rates.clone().sum::<f64>() / rates.map(|r| r * r).sum::<f64>();
        let deviation = |row: &Row| (row.ns_per_element_step / b - 1.0).abs();
        let farthest = rows.iter().max_by(|x, y| deviation(x).total_cmp(&deviation(y)))?;
        (rows.len() >= 3).then(|| Self {
            case: first.case,
            place: first.place(),
            meshes: rows.len(),
            cells: [first.cells, last.cells],
            ns_per_element_step: b,
            largest_deviation: deviation(farthest),
            farthest: farthest.cells,
        })
    }

    /// True if a case belongs to the series.
    pub(crate) fn covers(&self, case: &Case) -> bool {
        same_series(&self.case, case)
    }

    fn json(&self) -> Value {
        json!({
            "element": self.case.element.name(),
            "law": self.case.law.name(),
            "precision": self.case.precision.name(),
            "place": self.place,
            "meshes": self.meshes,
            "cells": self.cells,
            "ns_per_element_step": self.ns_per_element_step,
            "largest_deviation": self.largest_deviation,
            "farthest": self.farthest,
        })
    }
}

fn same_series(a: &Case, b: &Case) -> bool {
    Case { edge: b.edge, ..*a } == *b
}

/// The largest cube in real time.
#[derive(Clone, Debug, Serialize)]
pub struct Cube {
    /// Cells along its edge as the linear cost and Δt ∝ 1/n predict.
    pub predicted: usize,
    /// The measurement nearest to real time.
    #[serde(flatten)]
    pub row: Row,
}

/// The GPU of the cases.
#[derive(Clone, Debug)]
pub struct OnDevice {
    /// The adapter.
    pub adapter: Adapter,
    /// Its peak rates.
    pub rates: DeviceRates,
}

impl OnDevice {
    fn words(&self) -> String {
        let Adapter { name, kind, backend, driver, .. } = &self.adapter;
        let launch = 1e6 * self.rates.launch;
        format!("{name} ({kind}, {backend}, {driver}): an empty kernel in a chain takes {launch:.2} µs.")
    }

    fn json(&self) -> Value {
        json!({
            "adapter": self.adapter.name,
            "kind": self.adapter.kind.to_string(),
            "backend": self.adapter.backend,
            "driver": self.adapter.driver,
            "copy": self.rates.copy,
            "multiply_add": self.rates.multiply_add,
            "launch": self.rates.launch,
        })
    }
}

/// A case that the device can't run.
#[derive(Clone, Debug, Serialize)]
pub struct Refused {
    /// The case.
    pub id: String,
    /// Reason.
    pub reason: String,
}

/// Results of all measurements.
#[derive(Clone, Debug)]
pub struct Report {
    /// The machine.
    pub machine: Machine,
    /// Settings of the measurement.
    pub settings: Settings,
    /// Peak rates of the machine, for each number of threads.
    pub rates: Vec<Rates>,
    /// The GPU, if any case ran there.
    pub device: Option<OnDevice>,
    /// The cases.
    pub rows: Vec<Row>,
    /// Cases that were too large for the GPU.
    pub refused: Vec<Refused>,
    /// Linear cost of the series.
    pub fits: Vec<Fit>,
    /// The largest cubes in real time.
    pub cubes: Vec<Cube>,
}

impl Report {
    /// Returns the report as one JSON object.
    pub fn json(&self) -> Value {
        json!({
            "version": env!("CARGO_PKG_VERSION"),
            "date": today(),
            "machine": self.machine,
            "rates": self.rates,
            "device": self.device.as_ref().map(OnDevice::json),
            "repeats": self.settings.repeats,
            "rows": self.rows,
            "refused": self.refused,
            "linear_cost": self.fits.iter().map(Fit::json).collect::<Vec<_>>(),
            "largest_real_time_cubes": self.cubes,
        })
    }

    /// Returns the report as aligned tables in Markdown.
    pub fn table(&self) -> String {
        let Machine { processor, cores, system } = &self.machine;
        let mut parts = vec![
            format!("{processor}, {cores} cores, {system}; pliant {}, {}.", env!("CARGO_PKG_VERSION"), today()),
            format!(
                "Whole steps: median of {} repeats of at least {} s, with the least and the most; lanes `{}`.",
                self.settings.repeats, self.settings.seconds, self.settings.lanes
            ),
            self.rates_table(),
            "Bytes and operations on the CPU are counted per element and step. The columns \"copy\" and \"mul-add\" are their \
             shares of the rates above. The step Δt is 0.9 × the critical time step of the assembled model. With * it is of the \
             element bound."
                .to_owned(),
            rows_table(&self.rows),
        ];
        parts.extend(
            self.refused.iter().map(|Refused { id, reason }| format!("`{id}` was not measured: {reason}.")),
        );
        if !self.fits.is_empty() {
            parts.push("Linear cost: time of a step = b × elements over the meshes of a series.".to_owned());
            parts.push(self.fits_table());
        }
        if !self.cubes.is_empty() {
            parts.push(
                "Largest cube of 0.1 m in real time: brain-like NH with E = 3 kPa and ν = 0.45, and liver-like TI+Prony. The \
                 prediction takes the linear cost and Δt ∝ 1/n. A first measurement estimates the size of the second."
                    .to_owned(),
            );
            parts.push(self.cubes_table());
        }
        parts.join("\n\n")
    }

    fn rates_table(&self) -> String {
        let giga = |rate: f64| format!("{:.1}", 1e-9 * rate);
        let processor = self.rates.iter().map(|rates| {
            [rates.threads.to_string(), giga(rates.copy), giga(rates.single), giga(rates.double)]
        });
        let device = self.device.iter().map(|OnDevice { adapter, rates }| {
            [adapter.name.clone(), giga(rates.copy), giga(rates.multiply_add), "–".into()]
        });
        let rows = processor.chain(device).collect();
        let mut parts = vec![markdown(["threads", "copy GB/s", "mul-add single Gflop/s", "double"], rows)];
        parts.extend(self.device.as_ref().map(OnDevice::words));
        parts.join("\n\n")
    }

    fn fits_table(&self) -> String {
        let rows = self.fits.iter().map(|fit| {
            [
                fit.case.element.name().to_owned(),
                fit.case.law.name().to_owned(),
                fit.case.precision.name().to_owned(),
                fit.place.clone(),
                format!("{} of {} to {} elements", fit.meshes, fit.cells[0], fit.cells[1]),
                format!("{:.2}", fit.ns_per_element_step),
                format!("{:.1} % at {}", 100.0 * fit.largest_deviation, fit.farthest),
            ]
        });
        let header =
            ["element", "law", "precision", "threads or design", "meshes", "b ns", "largest deviation"];
        markdown(header, rows.collect())
    }

    fn cubes_table(&self) -> String {
        let rows = self.cubes.iter().map(|Cube { predicted, row }| {
            [
                row.element.to_owned(),
                row.law.to_owned(),
                format!("{predicted}³"),
                format!("{}³", row.case.edge),
                row.cells.to_string(),
                row.case.nodes().to_string(),
                row.place(),
                format!("{:.3}", 1e3 * row.critical_step),
                format!("{:.3}", 1e-6 * row.ns_per_element_step * row.cells as f64),
                format!("{:.2}", row.real_time_factor),
                format!("{:.3}", row.seconds_per_second),
            ]
        });
        let header = [
            "element",
            "law",
            "predicted",
            "measured",
            "elements",
            "nodes",
            "threads or design",
            "Δt ms",
            "step takes ms",
            "× real time",
            "a second takes s",
        ];
        markdown(header, rows.collect())
    }
}

fn rows_table(rows: &[Row]) -> String {
    let or_dash =
        |number: Option<f64>, words: fn(f64) -> String| number.map_or_else(|| "–".to_owned(), words);
    let rows = rows.iter().map(|row| {
        let star = if row.critical_step_from == Limit::True { "" } else { "*" };
        [
            row.mesh.clone(),
            row.cells.to_string(),
            row.element.to_owned(),
            row.law.to_owned(),
            row.precision.to_owned(),
            row.place(),
            format!("{:.2}", row.ns_per_element_step),
            format!("{:.2}–{:.2}", row.ns_least, row.ns_most),
            format!("{:.2}", 1e-6 * row.elements_per_second),
            or_dash(row.bytes_per_element, |bytes| format!("{bytes:.0}")),
            or_dash(row.flops_per_element, |flops| format!("{flops:.0}")),
            or_dash(row.bandwidth_fraction, |part| format!("{:.1} %", 100.0 * part)),
            or_dash(row.flop_fraction, |part| format!("{:.1} %", 100.0 * part)),
            format!("{:.4}{star}", 1e3 * row.critical_step),
            format!("{:.3}", row.real_time_factor),
            format!("{:.3}", row.seconds_per_second),
        ]
    });
    let header = [
        "mesh",
        "elements",
        "element",
        "law",
        "precision",
        "threads or design",
        "ns",
        "least–most",
        "M/s",
        "bytes",
        "flops",
        "copy",
        "mul-add",
        "Δt ms",
        "× real time",
        "a second takes s",
    ];
    markdown(header, rows.collect())
}

/// A Markdown table with columns of equal width, numbers to the right.
fn markdown<const N: usize>(header: [&str; N], rows: Vec<[String; N]>) -> String {
    let wide = |text: &str| text.chars().count();
    let widths: Vec<usize> = (header.iter().enumerate())
        .map(|(column, title)| {
            rows.iter().map(|row| wide(&row[column])).chain([wide(title), 3]).max().unwrap_or(3)
        })
        .collect();
    let is_number = |column: usize| {
        rows.iter().all(|row| row[column].starts_with(|c: char| c.is_ascii_digit() || c == '–'))
    };
    let line = |cells: &mut dyn Iterator<Item = &str>| {
        let padded = cells.zip(&widths).enumerate().map(|(column, (text, width))| {
            let space = " ".repeat(width - wide(text));
            if is_number(column) { space + text } else { text.to_owned() + &space }
        });
        format!("| {} |", padded.collect::<Vec<_>>().join(" | "))
    };
    let rule = widths.iter().enumerate().map(|(column, width)| {
        let dashes = "-".repeat(width + 1);
        if is_number(column) { dashes + ":" } else { format!(":{dashes}") }
    });
    let rule = format!("|{}|", rule.collect::<Vec<_>>().join("|"));
    let mut lines = vec![line(&mut header.iter().copied()), rule];
    lines.extend(rows.iter().map(|row| line(&mut row.iter().map(String::as_str))));
    lines.join("\n")
}

fn today() -> String {
    time::OffsetDateTime::now_utc().date().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::find;

    #[test]
    fn tables_are_aligned_with_numbers_to_the_right() {
        let rows = [["tet4", "7.60"], ["hex8-full", "104.00"], ["tet4-anp", "–"]];
        let lines = [
            "| element   |     ns |",
            "|:----------|-------:|",
            "| tet4      |   7.60 |",
            "| hex8-full | 104.00 |",
            "| tet4-anp  |      – |",
        ];
        let rows = rows.map(|row| row.map(String::from)).to_vec();
        assert_eq!(markdown(["element", "ns"], rows), lines.join("\n"));
    }

    #[test]
    fn bytes_and_operations_are_told_of_the_cpu_alone() {
        let row = |id: &str, peaks| {
            let (adapter, design) = (String::new(), String::new());
            let place = Measured { adapter, threads: None, design, lanes: None, peaks };
            let spread = Spread { median: 1e-3, least: 1e-3, most: 1e-3 };
            Row::new(find(id).unwrap(), place, spread, (1e-3, Limit::True))
        };
        let rows = [row("hex8-nh-27000", Some([1e10, 1e11])), row("hex8-nh-27000-fast", None)];
        let json = json!(rows);
        let counted = ["bytes_per_element", "flops_per_element", "bandwidth_fraction", "flop_fraction"];
        assert!(counted.iter().all(|key| json[0][key].is_f64() && json[1][key].is_null()), "{json}");
        let dashes = |line: &str| line.matches(" – ").count();
        assert_eq!(rows_table(&rows).lines().map(dashes).collect::<Vec<_>>(), [0, 0, 0, 4]);
    }
}
