//! Picked points over the picture: where they are, their place, value, body, element and label, and the
//! distance of the last two.

use eframe::egui::{Align2, Color32, FontId, Painter, Stroke, vec2};
use pliant_picture::readable;

use super::App;
use super::viewport::BESIDE_BAR;

/// A followed point.
const FOLLOWED: Color32 = Color32::from_rgb(0, 122, 122);

/// A length [m] in words.
fn length(metres: f64) -> String {
    let (unit, factor) = readable("m", metres);
    format!("{:.3} {unit}", metres * factor)
}

impl App {
    /// Draws followed points with their numbers, and a list beside the bar: place, value, body, element and
    /// label. The distance of the last two points stands there, too.
    pub(super) fn draw_followed(&self, painter: &Painter) {
        let followed = &self.frame.followed;
        if let [.., one, two] = &followed[..]
            && let (Some(from), Some(to)) = (self.port.to_screen(&one.place), self.port.to_screen(&two.place))
        {
            painter.line_segment([from, to], Stroke::new(1.0, FOLLOWED));
        }
        for (point, number) in followed.iter().zip(1..) {
            let Some(at) = self.port.to_screen(&point.place) else { continue };
            painter.circle(at, 4.0, FOLLOWED, Stroke::new(1.5, Color32::WHITE));
            let place = at + vec2(8.0, -8.0);
            painter.text(place, Align2::LEFT_CENTER, number, FontId::proportional(14.0), FOLLOWED);
        }
        let mut lines = self.read_points();
        if lines.is_empty() {
            return;
        }
        lines.truncate(6);
        let corner = self.port.rect.left_bottom() + vec2(BESIDE_BAR, -12.0);
        self.port.write(painter, Align2::LEFT_BOTTOM, corner, &lines, 13.0);
    }

    /// A line for each followed point, the last first, below the distance of the last two.
    pub(super) fn read_points(&self) -> Vec<String> {
        let followed = &self.frame.followed;
        let mut lines = Vec::new();
        if let [.., one, two] = &followed[..] {
            let count = followed.len();
            lines.push(format!("{} to {count}: {}", count - 1, length((two.place - one.place).norm())));
        }
        for (index, point) in followed.iter().enumerate().rev() {
            let number = index + 1;
            let [x, y, z] = point.place.map(|x| 1e3 * x).into();
            let value = point.value.zip(self.field()).map(|(value, field)| {
                let (unit, factor) = readable(field.unit(), value.abs());
                format!(", {} {:.4} {unit}", field.title(), value * factor)
            });
            let value = value.unwrap_or_default();
            lines.push(format!("{number}: ({x:.2}, {y:.2}, {z:.2}) mm{value}, {}", point.about));
        }
        lines
    }
}
