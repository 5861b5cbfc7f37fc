//! Plots of the chosen curves over time.

use std::collections::BTreeSet;

use eframe::egui;
use egui_plot::{Corner, GridInput, GridMark, Legend, Line, Plot};
use pliant_picture::{readable, ticks};

use super::App;
use super::told::Told;
use crate::hand::Point;
use crate::samples::Samples;
use crate::session::Order;

/// A curve that can be plotted.
#[derive(Clone, Debug, PartialEq)]
struct Curve {
    name: String,
    unit: &'static str,
    /// A column, or the three of a vector whose length it is.
    columns: Vec<usize>,
}

/// Returns the available curves: the columns, and before the components of a vector its length.
fn curves(samples: &Samples) -> Vec<Curve> {
    let mut curves = Vec::new();
    for (index, column) in samples.columns().iter().enumerate() {
        if let Some(name) = column.name.strip_suffix(".x") {
            let columns = (index..index + 3).collect();
            curves.push(Curve { name: name.to_owned(), unit: column.unit, columns });
        }
        curves.push(Curve { name: column.name.clone(), unit: column.unit, columns: vec![index] });
    }
    curves
}

/// Simulated time [s] of the plots of the last seconds.
const LATELY: f64 = 10.0;

/// The name of a curve in words.
fn words(name: &str) -> String {
    let parts: Vec<&str> = name.split('.').collect();
    let (parts, axis) = match &parts[..] {
        [head @ .., axis @ ("x" | "y" | "z")] if !head.is_empty() => (head, format!(", {axis}")),
        whole => (whole, String::new()),
    };
    let text = match parts {
        ["hand"] => "force of the hand".into(),
        ["second-hand"] => "force of the second hand".into(),
        ["energy", kind] => format!("{kind} energy"),
        ["reaction", of] => format!("reaction of {of}"),
        ["point", number, field] => format!("{field} of point {number}"),
        [of, field] => format!("{field} of {of}"),
        other => other.join(" "),
    };
    format!("{text}{axis}")
}

/// Height of a plot on the screen.
const HEIGHT: f32 = 130.0;

/// Draws curves of one unit: the name, and times [s] and values of each, from where these are known.
fn draw(ui: &mut egui::Ui, unit: &str, mut lines: Vec<(String, Vec<[f64; 2]>)>) {
    // A point that is followed has no values before.
    lines.iter_mut().for_each(|(_, line)| line.retain(|[_, value]| value.is_finite()));
    let values = lines.iter().flat_map(|(_, line)| line).map(|[_, value]| value.abs());
    let (scaled, factor) = readable(unit, values.fold(0.0, f64::max));
    lines.iter_mut().flat_map(|(_, line)| line).for_each(|[_, value]| *value *= factor);
    let plot = Plot::new(("curves", unit))
        .height(HEIGHT)
        .legend(Legend::default().position(Corner::LeftTop))
        .x_axis_label("time [s]")
        .y_axis_label(format!("[{scaled}]"))
        .x_grid_spacer(marks)
        .y_grid_spacer(marks)
        .x_axis_formatter(|mark, _| number(mark.value, mark.step_size))
        .y_axis_formatter(|mark, _| number(mark.value, mark.step_size))
        .grid_spacing(12.0..=300.0);
    plot.allow_scroll(false).show(ui, |plot| {
        for (name, line) in lines {
            // Bands would fill the space between curves that rise and drop within a pixel and their next
            // point.
            plot.line(Line::new(name, line).allow_band(false));
        }
    });
}

/// Marks of an axis: round values, three at least.
fn marks(GridInput { bounds: (low, high), .. }: GridInput) -> Vec<GridMark> {
    let marks = |about| {
        let (values, step_size) = ticks([low, high], about);
        values.into_iter().map(|value| GridMark { value, step_size }).collect::<Vec<_>>()
    };
    (3..10).map(marks).find(|marks| marks.len() >= 3).unwrap_or_default()
}

/// Formats a number at an axis, with enough digits to differ from its neighbour a step away.
fn number(value: f64, step: f64) -> String {
    let is_whole = |decimals: &usize| {
        let steps = step * 10_f64.powi(*decimals as i32);
        (steps - steps.round()).abs() < 1e-6 * steps.abs().max(1e-6)
    };
    let decimals = (0..9).find(is_whole).unwrap_or(9);
    // Without the sign of a zero.
    let text = format!("{value:.decimals$}");
    if text.parse() == Ok(0.0) { "0".into() } else { text }
}

/// The curves plotted at first.
pub(super) fn usual() -> BTreeSet<String> {
    ["energy.kinetic", "energy.internal", "hand"].map(str::to_owned).into()
}

impl App {
    /// Follows a point from now on.
    pub(super) fn add_probe(&mut self, point: Point) {
        self.probes += 1;
        self.plotted.insert(format!("point.{}.displacement", self.probes));
        self.order(Order::Probe(point));
    }

    /// Draws the curves, one plot for each unit, and the menu to choose them.
    pub(super) fn plots(&mut self, ui: &mut egui::Ui) {
        let available = curves(&self.samples);
        ui.horizontal(|ui| {
            ui.menu_button("Plot …", |ui| {
                egui::ScrollArea::vertical().max_height(400.0).show(ui, |ui| {
                    for curve in &available {
                        let mut on = self.plotted.contains(&curve.name);
                        let text = format!("{} [{}]", words(&curve.name), curve.unit);
                        if ui.checkbox(&mut on, text).on_hover_text(&curve.name).changed() {
                            if on {
                                self.plotted.insert(curve.name.clone());
                            } else {
                                self.plotted.remove(&curve.name);
                            }
                        }
                    }
                });
            });
            if ui.add_enabled(!self.samples.is_empty(), egui::Button::new("Export CSV")).clicked() {
                self.message = Some(match self.samples.write_beside(&self.file) {
                    Ok(path) => Told::done(format!("`{}` was written", path.display())),
                    Err(error) => {
                        Told::failure(format!("the table cannot be written beside the scene: {error}"))
                    }
                });
            }
            ui.selectable_value(&mut self.lately, false, "all").on_hover_text("plots the whole run");
            ui.selectable_value(&mut self.lately, true, "last 10 s")
                .on_hover_text("plots the last ten simulated seconds");
            if self.probes > 0 && ui.button("Forget the followed points").clicked() {
                self.forget_probes();
                self.order(Order::ForgetProbes);
            }
        });
        let shown: Vec<&Curve> =
            available.iter().filter(|curve| self.plotted.contains(&curve.name)).collect();
        let mut units: Vec<&str> = Vec::new();
        shown.iter().for_each(|curve| {
            if !units.contains(&curve.unit) {
                units.push(curve.unit);
            }
        });
        if units.is_empty() {
            return;
        }
        ui.columns(units.len(), |columns| {
            for (column, unit) in columns.iter_mut().zip(&units) {
                let of_unit = shown.iter().filter(|curve| curve.unit == *unit);
                let lines = of_unit.map(|curve| (words(&curve.name), self.points_of(curve)));
                draw(column, unit, lines.collect());
            }
        });
    }

    /// Time [s] and value of a curve.
    fn points_of(&self, curve: &Curve) -> Vec<[f64; 2]> {
        let first = if self.lately { self.frame.time - LATELY } else { f64::NEG_INFINITY };
        let recent = |[time, _]: &[f64; 2]| *time >= first;
        match curve.columns[..] {
            [x, y, z] => {
                let parts = self.samples.curve(x).zip(self.samples.curve(y)).zip(self.samples.curve(z));
                let size = parts.map(|(([time, x], [_, y]), [_, z])| [time, (x * x + y * y + z * z).sqrt()]);
                size.filter(recent).collect()
            }
            _ => self.samples.curve(curve.columns[0]).filter(recent).collect(),
        }
    }

    /// Plots no point that the user has placed.
    pub(super) fn forget_probes(&mut self) {
        self.probes = 0;
        self.plotted.retain(|name| !name.starts_with("point."));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The shapes of a plot of a curve.
    fn shapes(line: &[[f64; 2]]) -> Vec<egui::Shape> {
        let context = egui::Context::default();
        let mut output = egui::FullOutput::default();
        for _ in 0..3 {
            let size = egui::vec2(330.0, 160.0);
            let input = egui::RawInput {
                screen_rect: Some(egui::Rect::from_min_size(egui::Pos2::ZERO, size)),
                ..Default::default()
            };
            output = context.run_ui(input, |ui| draw(ui, "N", vec![("force".into(), line.to_vec())]));
            // Nothing is drawn: textures have nowhere to go.
            output.textures_delta.clear();
        }
        output.shapes.into_iter().map(|clipped| clipped.shape).collect()
    }

    /// The texts in a plot of a curve.
    fn texts(line: &[[f64; 2]]) -> Vec<String> {
        let text = |shape: &egui::Shape| match shape {
            egui::Shape::Text(text) => Some(text.galley.text().to_owned()),
            _ => None,
        };
        shapes(line).iter().filter_map(text).collect()
    }

    /// Many values in a pixel, then a drop and a pause: a band would be filled from the drop to the end of
    /// the pause.
    #[test]
    fn a_curve_that_drops_is_a_line_and_fills_nothing() {
        let rise = (0..2000).map(|i| [f64::from(i) * 1e-3, f64::from(i)]);
        let line: Vec<[f64; 2]> = rise.chain([[2.0, 0.0], [3.0, 0.0]]).collect();
        let shapes = shapes(&line);
        let bands = shapes.iter().filter(|shape| matches!(shape, egui::Shape::Band(_))).count();
        let lines = shapes
            .iter()
            .filter(|shape| matches!(shape, egui::Shape::Path(path) if path.points.len() > 1000));
        assert_eq!((bands, lines.count()), (0, 1));
    }

    #[test]
    fn a_curve_begins_where_it_is_known() {
        let unknown = (0..5).map(|i| [f64::from(i), f64::NAN]);
        let known = (5..9).map(|i| [f64::from(i), 1.0 + f64::from(i)]);
        let line: Vec<[f64; 2]> = unknown.chain(known).collect();
        for shape in shapes(&line) {
            if let egui::Shape::Path(path) = shape {
                assert!(path.points.iter().all(|point| !point.any_nan()), "{:?}", path.points);
            }
        }
    }

    #[test]
    fn plots_have_three_ticks_at_least() {
        for top in [0.9, 1.0, 1.9, 4.2, 7.3, 99.0, 1.04e-3] {
            let line: Vec<[f64; 2]> = (0..50).map(|i| [f64::from(i), top * f64::from(i) / 49.0]).collect();
            let texts = texts(&line);
            let numbers = texts.iter().filter(|text| text.parse::<f64>().is_ok()).count();
            // Of the axis of time, too, which has three.
            assert!(numbers >= 6, "{top}: {texts:?}");
        }
    }

    #[test]
    fn numbers_at_axes_have_the_digits_of_their_step() {
        let cases =
            [(0.5, 0.5), (1.5, 0.5), (2.0, 1.0), (-1e-17, 0.5), (0.25, 0.25), (400.0, 200.0), (1e-3, 1e-3)];
        let texts = cases.map(|(value, step)| number(value, step));
        assert_eq!(texts, ["0.5", "1.5", "2", "0", "0.25", "400", "0.001"]);
    }

    #[test]
    fn curves_have_names_in_words() {
        let names = [
            "hand",
            "hand.x",
            "second-hand",
            "energy.kinetic",
            "reaction.base.z",
            "point.2.displacement",
            "balloon.pressure",
        ]
        .map(words);
        let expected = [
            "force of the hand",
            "force of the hand, x",
            "force of the second hand",
            "kinetic energy",
            "reaction of base, z",
            "displacement of point 2",
            "pressure of balloon",
        ];
        assert_eq!(names, expected);
    }
}
