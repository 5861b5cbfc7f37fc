//! SVG plots over time. The plot of a run shows the size of each reaction, the energies, and pressure and
//! volume of what constraints fill. The plot of a sweep shows each reaction in all runs.

use pliant_mechanics::model::Constraint;
use pliant_scene::World;
use plotters::coord::Shift;
use plotters::prelude::*;

use super::History;

/// Colours that colour-blind eyes can distinguish (Okabe and Ito 2008).
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
];

/// Runs that the plot of a sweep shows.
pub(crate) const MOST_CURVES: usize = 14;
/// Panels in it.
const MOST_PANELS: usize = 6;
/// Width of a plot, and height of a panel.
const WIDTH: u32 = 900;
const HEIGHT: u32 = 380;

/// A named curve of values over time [s].
struct Curve<'a> {
    name: &'a str,
    points: Vec<[f64; 2]>,
}

impl<'a> Curve<'a> {
    fn new(name: &'a str, times: &[f64], values: impl Iterator<Item = f64>) -> Self {
        Self { name, points: times.iter().zip(values).map(|(&time, value)| [time, value]).collect() }
    }
}

/// The sizes of the reactions of a run over time, by the names of their constraints.
pub(crate) type Reactions = Vec<(String, Vec<[f64; 2]>)>;

/// The constraints of all participants.
pub(crate) fn constraints(world: &World) -> impl Iterator<Item = &Constraint> {
    world.participants.iter().flat_map(|part| &part.built.model.constraints)
}

/// The plot as SVG text; the error is what the drawing library says.
pub(crate) fn plot(world: &World, history: &History) -> Result<String, String> {
    let mut svg = String::new();
    {
        let filled: Vec<&str> = constraints(world)
            .filter(|constraint| constraint.motion.encloses())
            .map(|constraint| constraint.name.as_str())
            .collect();
        let panels = if filled.is_empty() { 2 } else { 4 };
        let root = SVGBackend::with_string(&mut svg, (WIDTH, HEIGHT * panels)).into_drawing_area();
        root.fill(&WHITE).map_err(|error| error.to_string())?;
        let areas = root.split_evenly((panels as usize, 1));
        let reactions: Vec<Curve<'_>> = (constraints(world).enumerate())
            .filter(|(_, constraint)| !constraint.motion.encloses())
            .map(|(index, constraint)| {
                Curve::new(&constraint.name, &history.times, history.reactions.iter().map(|row| row[index]))
            })
            .collect();
        panel(&areas[0], "Reaction", "N", &reactions)?;
        let energy = |name, of: fn(&pliant_mechanics::Energies) -> f64| {
            Curve::new(name, &history.times, history.energies.iter().map(of))
        };
        let energies = [
            energy("external work", |e| e.external),
            // The internal energy includes the dissipation of viscous laws, which is not known separately.
            energy("internal (stored and viscous)", |e| e.internal),
            energy("kinetic", |e| e.kinetic),
            energy("damping", |e| e.damping),
            energy("hourglass", |e| e.hourglass),
            energy("step changes", |e| e.step_changes),
        ];
        panel(&areas[1], "Energy", "J", &energies)?;
        for (area, (kind, title, unit)) in areas[2..].iter().zip([(1, "Pressure", "Pa"), (0, "Volume", "m³")])
        {
            let values = |at: usize| history.enclosed.iter().skip(at).step_by(filled.len());
            let curves: Vec<Curve<'_>> = (filled.iter().enumerate())
                .map(|(at, name)| Curve::new(name, &history.times, values(at).map(|enclosed| enclosed[kind])))
                .collect();
            panel(area, title, unit, &curves)?;
        }
        root.present().map_err(|error| error.to_string())?;
    }
    Ok(with_round_joins(&svg))
}

/// Returns the plot with round joins of lines: a mitre would reach beyond the values of a curve that turns
/// sharply.
fn with_round_joins(svg: &str) -> String {
    svg.replace("<polyline fill=\"none\"", "<polyline fill=\"none\" stroke-linejoin=\"round\"")
}

/// Draws some runs of a sweep: a panel for each reaction, six at most, with a curve for each run by its
/// title. Returns `None` without any reaction.
pub(crate) fn plot_of_sweep(runs: &[(String, Reactions)]) -> Result<Option<String>, String> {
    let mut names: Vec<&str> = Vec::new();
    for (name, _) in runs.iter().flat_map(|(_, reactions)| reactions) {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    names.truncate(MOST_PANELS);
    if names.is_empty() {
        return Ok(None);
    }
    let mut svg = String::new();
    {
        let size = (WIDTH, HEIGHT * names.len() as u32);
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE).map_err(|error| error.to_string())?;
        for (area, name) in root.split_evenly((names.len(), 1)).iter().zip(&names) {
            let mut curves = Vec::new();
            for (title, reactions) in runs {
                if let Some((_, points)) = reactions.iter().find(|(known, _)| known == name) {
                    curves.push(Curve { name: title, points: points.clone() });
                }
            }
            panel(area, &format!("Reaction of {name}"), "N", &curves)?;
        }
        root.present().map_err(|error| error.to_string())?;
    }
    Ok(Some(with_round_joins(&svg)))
}

fn panel(
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    title: &str,
    unit: &str,
    curves: &[Curve<'_>],
) -> Result<(), String> {
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let finite = points().map(|[_, value]| *value).filter(|value| value.is_finite());
    let (low, high) = finite.fold((0.0_f64, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)));
    let margin = 0.05 * (high - low).max(f64::MIN_POSITIVE);
    let end = points().map(|[time, _]| *time).reduce(f64::max).unwrap_or(1.0).max(f64::MIN_POSITIVE);
    let draw = || -> Result<(), Box<dyn std::error::Error + '_>> {
        let mut chart = ChartBuilder::on(area)
            .caption(format!("{title} [{unit}]"), ("sans-serif", 18))
            .margin(12)
            .x_label_area_size(36)
            .y_label_area_size(76)
            .build_cartesian_2d(0.0..end, low - if low < 0.0 { margin } else { 0.0 }..high + margin)?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .x_desc("time [s]")
            .label_style(("sans-serif", 14))
            .draw()?;
        for (curve, &colour) in curves.iter().zip(COLOURS.iter().cycle()) {
            let points =
                curve.points.iter().map(|&[time, value]| (time, value)).filter(|(_, v)| v.is_finite());
            chart
                .draw_series(LineSeries::new(points, colour.stroke_width(2)))?
                .label(curve.name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], colour.stroke_width(2)));
        }
        if !curves.is_empty() {
            let mut labels = chart.configure_series_labels();
            labels
                .background_style(WHITE.mix(0.8))
                .border_style(BLACK.mix(0.3))
                .label_font(("sans-serif", 14));
            labels.position(SeriesLabelPosition::UpperLeft).draw()?;
        }
        Ok(())
    };
    draw().map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No line is filled, and none has a mitre, which would reach beyond the values.
    #[test]
    fn a_curve_that_drops_is_a_line_with_round_joins() {
        let points = (0..100).map(|i| [f64::from(i) / 100.0, if i == 50 { 1.0 } else { 0.0 }]).collect();
        let runs = [("a run".to_owned(), vec![("hand".to_owned(), points)])];
        let svg = plot_of_sweep(&runs).unwrap().unwrap();
        let lines: Vec<&str> = svg.split('<').filter(|tag| tag.starts_with("polyline")).collect();
        assert!(!lines.is_empty());
        for line in lines {
            assert!(line.contains("fill=\"none\"") && line.contains("stroke-linejoin=\"round\""), "{line}");
        }
        let filled = svg.split('<').filter(|tag| tag.starts_with("polygon")).count();
        assert_eq!(filled, 0);
    }
}
