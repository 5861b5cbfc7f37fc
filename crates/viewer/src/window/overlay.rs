//! What is written over the picture to read it by: axes, a bar of a round length, and picked points with their place, value and distance.

use eframe::egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Stroke, Vec2, vec2};
use pliant_geometry::Vector3;
use pliant_picture::{Camera, readable};

use super::App;
use super::picture::to_screen;

/// Length of the axes on the screen, and how far their origin is from the corner.
const AXES: f32 = 30.0;
const CORNER: f32 = 46.0;
/// Length of the bar on the screen, at most.
const BAR: f64 = 150.0;
/// Colours of x, y and z.
const COLOURS: [Color32; 3] =
    [Color32::from_rgb(196, 54, 46), Color32::from_rgb(46, 138, 60), Color32::from_rgb(50, 92, 196)];
/// A followed point.
const FOLLOWED: Color32 = Color32::from_rgb(0, 122, 122);

/// The longest length [m] of 1, 2 or 5 times a power of ten that is no longer than another.
fn round_length(most: f64) -> f64 {
    let power = 10_f64.powf(most.log10().floor());
    [5.0, 2.0].map(|factor| factor * power).into_iter().find(|length| *length <= most).unwrap_or(power)
}

/// A length [m] in words.
fn length(metres: f64) -> String {
    let (unit, factor) = readable("m", metres);
    format!("{:.3} {unit}", metres * factor)
}

/// The axes as seen by a camera, the farthest first: which it is, and where it points on the screen.
fn axes_of(camera: &Camera) -> [(usize, Vec2); 3] {
    let [right, up, towards] = camera.axes();
    let unit = [Vector3::x(), Vector3::y(), Vector3::z()];
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| unit[a].dot(&towards).total_cmp(&unit[b].dot(&towards)));
    order.map(|axis| (axis, vec2(unit[axis].dot(&right) as f32, -unit[axis].dot(&up) as f32)))
}

impl App {
    /// The axes and the bar in the lower left corner.
    pub(super) fn draw_axes(&self, painter: &Painter, rect: Rect) {
        let origin = rect.left_bottom() + vec2(CORNER, -CORNER);
        for (axis, along) in axes_of(&self.camera) {
            painter.arrow(origin, AXES * along, Stroke::new(2.0, COLOURS[axis]));
            let place = origin + (AXES + 9.0) * along;
            let font = FontId::proportional(13.0);
            painter.text(place, Align2::CENTER_CENTER, ["x", "y", "z"][axis], font, COLOURS[axis]);
        }
        let pixel = self.camera.height / f64::from(rect.height().max(1.0));
        let metres = round_length(BAR * pixel);
        let (unit, factor) = readable("m", metres);
        let from = origin + vec2(CORNER + 14.0, 14.0);
        let to = from + vec2((metres / pixel) as f32, 0.0);
        let stroke = Stroke::new(2.0, self.ink());
        painter.line_segment([from, to], stroke);
        for end in [from, to] {
            painter.line_segment([end - vec2(0.0, 4.0), end + vec2(0.0, 4.0)], stroke);
        }
        let text = format!("{:.0} {unit}", metres * factor);
        let middle = from + 0.5 * (to - from) - vec2(0.0, 12.0);
        painter.text(middle, Align2::CENTER_CENTER, text, FontId::proportional(13.0), self.ink());
    }

    /// Followed points with their numbers, and what is known of them beside the bar: place, value, body, element and label, and the
    /// distance of the last two.
    pub(super) fn draw_followed(&self, painter: &Painter, rect: Rect) {
        let followed = &self.frame.followed;
        let seen = |place: &Vector3| to_screen(&self.camera, place, rect);
        if let [.., one, two] = &followed[..]
            && let (Some(from), Some(to)) = (seen(&one.place), seen(&two.place))
        {
            painter.line_segment([from, to], Stroke::new(1.0, FOLLOWED));
        }
        for (point, number) in followed.iter().zip(1..) {
            let Some(at) = seen(&point.place) else { continue };
            painter.circle(at, 4.0, FOLLOWED, Stroke::new(1.5, Color32::WHITE));
            let place = at + vec2(8.0, -8.0);
            painter.text(place, Align2::LEFT_CENTER, number, FontId::proportional(14.0), FOLLOWED);
        }
        let mut lines = self.read_points();
        if lines.is_empty() {
            return;
        }
        lines.truncate(6);
        let galley = painter.layout_no_wrap(lines.join("\n"), FontId::proportional(13.0), self.ink());
        let corner = Pos2::new(rect.left() + 2.0 * CORNER + 24.0 + BAR as f32, rect.bottom() - 12.0);
        let place = Rect::from_min_size(corner - vec2(0.0, galley.size().y), galley.size());
        self.card(painter, place);
        painter.galley(place.min, galley, self.ink());
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_have_round_lengths_and_axes_point_as_the_camera_sees_them() {
        assert_eq!([0.19, 0.2, 0.07, 0.0123].map(round_length), [0.1, 0.2, 0.05, 0.01]);
        // From the front, x comes towards the eye and is drawn last.
        let camera = Camera { azimuth: 0.0, elevation: 0.0, ..Camera::default() };
        let axes = axes_of(&camera);
        assert_eq!(axes[2].0, 0);
        assert!(axes[2].1.length() < 1e-6);
        let z = axes.iter().find(|(axis, _)| *axis == 2).unwrap();
        assert!((z.1 - vec2(0.0, -1.0)).length() < 1e-6, "up is up");
    }
}
