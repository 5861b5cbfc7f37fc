//! Curves over time, of what the user chooses.

use std::collections::BTreeSet;

use eframe::egui;
use egui_plot::{Legend, Line, Plot, PlotPoints};

use super::App;
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

/// The curves that there are: the columns, and before those of a vector its length.
fn curves(samples: &Samples) -> Vec<Curve> {
    let mut all = Vec::new();
    for (index, column) in samples.columns().iter().enumerate() {
        if let Some(name) = column.name.strip_suffix(".x") {
            let columns = (index..index + 3).collect();
            all.push(Curve { name: name.to_owned(), unit: column.unit, columns });
        }
        all.push(Curve { name: column.name.clone(), unit: column.unit, columns: vec![index] });
    }
    all
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

    /// The curves, one plot for each unit, and what is to be plotted.
    pub(super) fn plots(&mut self, ui: &mut egui::Ui) {
        let all = curves(&self.samples);
        ui.horizontal(|ui| {
            ui.menu_button("Plot …", |ui| {
                egui::ScrollArea::vertical().max_height(400.0).show(ui, |ui| {
                    for curve in &all {
                        let mut on = self.plotted.contains(&curve.name);
                        if ui.checkbox(&mut on, format!("{} [{}]", curve.name, curve.unit)).changed() {
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
                    Ok(path) => format!("`{}` was written", path.display()),
                    Err(error) => format!("the table cannot be written beside the scene: {error}"),
                });
            }
            if self.probes > 0 && ui.button("Forget the points followed").clicked() {
                self.forget_probes();
                self.order(Order::ForgetProbes);
            }
        });
        let shown: Vec<&Curve> = all.iter().filter(|curve| self.plotted.contains(&curve.name)).collect();
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
                Plot::new(("curves", unit)).height(130.0).legend(Legend::default()).show(column, |plot| {
                    for curve in shown.iter().filter(|curve| curve.unit == *unit) {
                        plot.line(Line::new(format!("{} [{unit}]", curve.name), self.points_of(curve)));
                    }
                });
            }
        });
    }

    fn points_of(&self, curve: &Curve) -> PlotPoints<'static> {
        match curve.columns[..] {
            [x, y, z] => {
                let parts = self.samples.curve(x).zip(self.samples.curve(y)).zip(self.samples.curve(z));
                parts.map(|(([time, x], [_, y]), [_, z])| [time, (x * x + y * y + z * z).sqrt()]).collect()
            }
            _ => self.samples.curve(curve.columns[0]).collect(),
        }
    }

    /// Plots no point that the user has placed.
    pub(super) fn forget_probes(&mut self) {
        self.probes = 0;
        self.plotted.retain(|name| !name.starts_with("point."));
    }
}
