//! Plots as SVG: curves and markers over linear or logarithmic axes, and bars.

use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{AsRangedCoord, Ranged, SegmentValue, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::CaseError;
use crate::case::Figure;

/// Units of the drawing per unit on the page: the drawing library rounds to whole ones, which would make
/// curves rough.
const FINE: i32 = 8;
/// Size of a plot. Two fit side by side on a page, and one above the other on a telephone.
const SIZE: (u32, u32) = (560 * FINE as u32, 420 * FINE as u32);
const FONT: (&str, i32) = ("sans-serif", 16 * FINE);
/// Colours that colour-blind eyes can distinguish (Okabe and Ito 2008).
const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];

/// Style in which a curve is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Pen {
    Line,
    Dashes,
    Markers,
}

/// A curve. Curves of one colour belong together.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    /// Its name in the key; a curve without a name is not in the key.
    pub name: String,
    pub colour: usize,
    pub pen: Pen,
    pub points: Vec<(f64, f64)>,
}

impl Curve {
    pub fn new(name: impl Into<String>, colour: usize, pen: Pen, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), colour, pen, points }
    }
}

/// The position of the key.
pub(crate) use plotters::prelude::SeriesLabelPosition as Key;

/// A plot with its axes.
#[derive(Clone, Debug)]
pub(crate) struct Plot<'a> {
    pub title: &'a str,
    /// Names and units of the axes.
    pub axes: [&'a str; 2],
    pub logarithmic: bool,
    pub key: Key,
    pub curves: &'a [Curve],
}

impl Plot<'_> {
    /// The plot as a figure.
    pub fn figure(&self, caption: impl Into<String>) -> Result<Figure, CaseError> {
        let points = || self.curves.iter().flat_map(|curve| &curve.points).copied();
        let [x, y] = [extent(points().map(|p| p.0)), extent(points().map(|p| p.1))];
        let svg = drawn(|area| {
            let mut chart = ChartBuilder::on(area);
            layout(&mut chart, self.title);
            if self.logarithmic {
                let wide = |r: Range<f64>| (r.start / 1.4..r.end * 1.4).log_scale();
                self.draw(&mut chart, wide(x), wide(y))
            } else {
                let margin = 0.06 * (y.end - y.start);
                let low = if y.start == 0.0 { 0.0 } else { y.start - margin };
                self.draw(&mut chart, x, low..y.end + margin)
            }
        })?;
        Ok(Figure { svg: Some(svg), caption: caption.into() })
    }

    fn draw<X, Y>(
        &self,
        chart: &mut ChartBuilder<'_, '_, SVGBackend<'_>>,
        x: X,
        y: Y,
    ) -> Result<(), Box<dyn std::error::Error>>
    where
        X: AsRangedCoord<Value = f64>,
        Y: AsRangedCoord<Value = f64>,
        X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
        Y::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        let mut chart = chart.build_cartesian_2d(x, y).map_err(|error| error.to_string())?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(BLACK.mix(0.12).stroke_width(FINE as u32))
            .axis_style(BLACK.stroke_width(FINE as u32))
            .set_all_tick_mark_size(5 * FINE)
            .x_desc(self.axes[0])
            .y_desc(self.axes[1])
            .x_label_formatter(&label)
            .y_label_formatter(&label)
            .x_labels(6)
            .label_style(FONT)
            .axis_desc_style(FONT)
            .draw()
            .map_err(|error| error.to_string())?;
        for curve in self.curves {
            let style = COLOURS[curve.colour % COLOURS.len()].stroke_width(2 * FINE as u32);
            let points = curve.points.iter().copied();
            let drawn = match curve.pen {
                Pen::Markers => chart.draw_series(points.map(|p| Circle::new(p, 4 * FINE, style))),
                Pen::Line => chart.draw_series(LineSeries::new(points, style)),
                Pen::Dashes => chart.draw_series(DashedLineSeries::new(points, 6 * FINE, 5 * FINE, style)),
            };
            let drawn = drawn.map_err(|error| error.to_string())?;
            if curve.name.is_empty() {
                continue;
            }
            let pen = curve.pen;
            drawn.label(&curve.name).legend(move |(x, y)| match pen {
                Pen::Markers => Circle::new((x + 10 * FINE, y), 4 * FINE, style).into_dyn(),
                Pen::Line | Pen::Dashes => PathElement::new([(x, y), (x + 20 * FINE, y)], style).into_dyn(),
            });
        }
        if self.curves.iter().any(|curve| !curve.name.is_empty()) {
            chart
                .configure_series_labels()
                .position(self.key.clone())
                .background_style(WHITE.mix(0.85))
                .border_style(TRANSPARENT)
                .legend_area_size(28 * FINE)
                .margin(6 * FINE)
                .label_font(FONT)
                .draw()
                .map_err(|error| error.to_string())?;
        }
        Ok(())
    }
}

/// Horizontal bars from 0, the first on top.
pub(crate) fn bars(
    title: &str,
    axis: &str,
    bars: &[(&str, f64)],
    caption: impl Into<String>,
) -> Result<Figure, CaseError> {
    let count = bars.len();
    let range = extent(bars.iter().map(|bar| bar.1));
    let margin = 0.18 * (range.end - range.start);
    let svg = drawn(|area| {
        let mut chart = ChartBuilder::on(area);
        layout(&mut chart, title);
        let mut chart = chart
            .y_label_area_size(100 * FINE)
            .build_cartesian_2d(range.start - margin..range.end + margin, (0..count - 1).into_segmented())?;
        let name = |row: &SegmentValue<usize>| match row {
            SegmentValue::CenterOf(row) if *row < count => bars[count - 1 - row].0.to_owned(),
            _ => String::new(),
        };
        chart
            .configure_mesh()
            .disable_y_mesh()
            .light_line_style(WHITE)
            .bold_line_style(BLACK.mix(0.12).stroke_width(FINE as u32))
            .axis_style(BLACK.stroke_width(FINE as u32))
            .set_all_tick_mark_size(5 * FINE)
            .x_desc(axis)
            .y_label_formatter(&name)
            .y_labels(count)
            .x_label_formatter(&label)
            .label_style(FONT)
            .axis_desc_style(FONT)
            .draw()?;
        for (row, &(_, value)) in bars.iter().rev().enumerate() {
            let ends = [(0.0, SegmentValue::Exact(row)), (value, SegmentValue::Exact(row + 1))];
            let mut bar = Rectangle::new(ends, COLOURS[0].filled());
            bar.set_margin(9 * FINE as u32, 9 * FINE as u32, 0, 0);
            chart.draw_series([bar])?;
            let side = if value < 0.0 { HPos::Right } else { HPos::Left };
            let style = TextStyle::from(FONT.into_font()).pos(Pos::new(side, VPos::Center));
            let gap = if value < 0.0 { -6 * FINE } else { 6 * FINE };
            let place = EmptyElement::at((value, SegmentValue::CenterOf(row)))
                + Text::new(format!("{value:+.1}").replace('-', "−"), (gap, 0), style);
            chart.draw_series([place])?;
        }
        chart.draw_series([PathElement::new(
            [(0.0, SegmentValue::Exact(0)), (0.0, SegmentValue::Exact(count))],
            BLACK.stroke_width(FINE as u32),
        )])?;
        Ok(())
    })?;
    Ok(Figure { svg: Some(svg), caption: caption.into() })
}

/// A number on an axis, without superfluous digits.
fn label(value: &f64) -> String {
    if *value == 0.0 {
        return "0".into();
    }
    if !(1e-3..1e5).contains(&value.abs()) {
        return format!("{value:e}");
    }
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').replace('-', "−")
}

/// From the smallest to the largest finite value; never empty.
fn extent(values: impl Iterator<Item = f64>) -> Range<f64> {
    let finite = values.filter(|value| value.is_finite());
    let (low, high) =
        finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if low < high { low..high } else { 0.0..1.0 }
}

fn layout(chart: &mut ChartBuilder<'_, '_, SVGBackend<'_>>, title: &str) {
    chart
        .caption(title, ("sans-serif", 19 * FINE))
        .margin(10 * FINE)
        .x_label_area_size(46 * FINE)
        .y_label_area_size(72 * FINE);
}

fn drawn(
    draw: impl FnOnce(&DrawingArea<SVGBackend<'_>, Shift>) -> Result<(), Box<dyn std::error::Error>>,
) -> Result<String, CaseError> {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        draw(&root).map_err(|error| CaseError::Drawing(error.to_string()))?;
        root.present().map_err(|error| CaseError::Drawing(error.to_string()))?;
    }
    Ok(svg)
}
