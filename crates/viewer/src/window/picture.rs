//! The picture in the middle: what the mouse does in it, and what is written over it.

use eframe::egui::{
    self, Align2, Color32, CursorIcon, FontId, Key, PointerButton, Pos2, Rect, Sense, Stroke, Vec2, vec2,
};
use eframe::egui_wgpu::Callback;
use pliant_geometry::Vector3;
use pliant_picture::{
    Background, Camera, MISSING, NO_VALUE, Plane, Style, Subject, arrow_note, arrow_unit, largest_force,
    scale_marks,
};

use super::App;
use super::paint::Paint;
use crate::hand::{Hand, Point, pick};

/// Width of the scale of colours on the screen.
pub(super) const SCALE: f32 = 110.0;
/// Height of the figures on the screen.
pub(super) const FIGURES: f32 = 104.0;
/// Length of the arrow of the strongest force of a pull on the screen.
const ARROW: f32 = 120.0;
/// Angle [rad] by which a tool turns for a point on the screen, and by which jaws open for one of the wheel.
const TURN: f64 = 0.01;
const OPEN: f64 = 0.002;
/// Radius of a point of contact on the screen.
const DOT: f32 = 2.5;
/// Radius of a pin on the screen.
const PIN_SIZE: f32 = 5.0;
const PIN: Color32 = Color32::from_rgb(20, 90, 170);
const FORCE: Color32 = Color32::from_rgb(190, 40, 40);

/// Keys and what they do, as in `docs/viewer.md`.
const KEYS: [(&str, &str); 22] = [
    ("drag the body", "pull it"),
    ("drag a tool", "lead it; with Shift turn it about where it is held"),
    ("wheel while dragging a tool", "open and close its jaws"),
    ("Ctrl or P + click", "pin it; on a pin, take it away"),
    ("Alt + click", "follow a point: read and plot it; two give their distance"),
    ("drag beside it", "turn the view"),
    ("right drag", "turn the view; with Shift move it"),
    ("middle drag", "move the view"),
    ("wheel", "zoom"),
    ("Space", "play or pause"),
    (".", "one step"),
    (",", "back to the last kept state, a quarter of a second before"),
    ("Ctrl and Z", "take back a pull, a pin or changed numbers"),
    ("R", "start anew"),
    ("F", "see all"),
    ("1 2 3 4 5 6", "look from the front, back, left, right, top, bottom"),
    ("E G C", "edges, shape at rest, section"),
    ("L", "lock the range of colours"),
    ("O", "parallel or perspective"),
    ("Ctrl and + − 0", "larger or smaller text"),
    ("H", "these keys"),
    ("drop a scene", "open it"),
];

/// A section: whether it is on, its normal, and how far along it the plane lies, as a part of the body's extent at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cut {
    pub on: bool,
    pub normal: Vector3,
    pub part: f64,
    /// Where the scene has it [m], until it is moved.
    pub offset: Option<f64>,
}

impl Cut {
    /// The section at a plane; across the middle of x for none.
    pub fn new(plane: Option<Plane>) -> Self {
        let normal = plane.map_or(Vector3::x(), |plane| plane.normal);
        Self { on: plane.is_some(), normal, part: 0.5, offset: plane.map(|plane| plane.offset) }
    }

    /// Its plane, if it is on.
    fn plane(&mut self, subject: &Subject) -> Option<Plane> {
        let [low, high] = extent(subject, &self.normal);
        if let Some(offset) = self.offset.take_if(|_| high > low) {
            self.part = (offset - low) / (high - low);
        }
        self.on.then_some(Plane { normal: self.normal, offset: low + self.part * (high - low) })
    }
}

/// From where to where a body reaches along a direction [m], at rest.
fn extent(subject: &Subject, along: &Vector3) -> [f64; 2] {
    let places = subject.points.iter().map(|point| point.dot(along));
    places.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
}

impl App {
    pub(super) fn scene(&mut self, ui: &mut egui::Ui) {
        let rect = ui.available_rect_before_wrap();
        let response = ui.allocate_rect(rect, Sense::click_and_drag());
        self.picture = rect;
        if self.drawn == 0 {
            self.fit();
        }
        let aspect = self.aspect();
        self.style.clip = self.cut.plane(&self.subject);
        self.mouse(ui.ctx(), &response, rect);
        let mut style = Style { labels: self.view.shows_labels(), ..self.style };
        if self.values.is_empty() {
            style.range = None;
        }
        let paint = Paint {
            on_device: self.on_device().map(|points| points.buffer().clone()),
            critical: self.frame.critical,
            points: self.points.clone(),
            values: self.values.clone(),
            camera: self.camera,
            style,
            aspect,
            fresh: std::mem::take(&mut self.fresh),
        };
        ui.painter().add(Callback::new_paint_callback(rect, paint));
        let painter = ui.painter_at(rect);
        self.draw_contacts(&painter, rect);
        self.draw_held(&painter, rect);
        self.draw_axes(&painter, rect);
        self.draw_followed(&painter, rect);
        if style.range.is_some() {
            self.draw_scale(&painter, rect);
            self.draw_missing(&painter, rect);
        }
        self.draw_figures(&painter, rect);
        if self.help {
            let mut text = String::new();
            KEYS.iter().for_each(|(key, does)| text.push_str(&format!("{key:<22}{does}\n")));
            let at = rect.center();
            let font = FontId::monospace(13.0);
            let galley = painter.layout_no_wrap(text, font, Color32::from_gray(30));
            let place = Rect::from_center_size(at, galley.size()).expand(14.0);
            painter.rect_filled(place, 6.0, Color32::from_white_alpha(235));
            painter.galley(place.min + vec2(14.0, 14.0), galley, Color32::BLACK);
        }
    }

    fn mouse(&mut self, context: &egui::Context, response: &egui::Response, rect: Rect) {
        let Some(pointer) = context.pointer_latest_pos() else { return };
        let place = in_picture(pointer, rect);
        self.hover =
            if response.contains_pointer() && self.holding.is_none() { self.hit(place) } else { None };
        if self.holding.is_some() {
            context.set_cursor_icon(CursorIcon::Grabbing);
        } else if self.hover.is_some() {
            context.set_cursor_icon(CursorIcon::Grab);
        }
        let pinning = context.input(|input| input.modifiers.command || input.key_down(Key::P));
        if response.clicked() && pinning || response.drag_started_by(PointerButton::Primary) {
            self.bring_points();
        }
        if response.clicked() && pinning {
            match (self.pin_at(pointer, rect), self.hit(place)) {
                (Some(pin), _) => self.act(Hand::Unpin(pin)),
                (None, Some((point, _))) => self.act(Hand::Pin(point)),
                (None, None) => {}
            }
        }
        if response.clicked()
            && context.input(|input| input.modifiers.alt)
            && let Some((point, _)) = self.hit(place)
        {
            self.add_probe(point);
        }
        if response.drag_started_by(PointerButton::Primary) {
            let origin = context.input(|input| input.pointer.press_origin()).unwrap_or(pointer);
            match self.hit(in_picture(origin, rect)) {
                Some((point, at)) => {
                    self.holding = Some(at);
                    self.strongest = 0.0;
                    self.act(Hand::Take(point, self.stiffness));
                }
                None => self.orbiting = true,
            }
        }
        let by = response.drag_delta();
        if let Some(at) = self.holding {
            let turns = context.input(|input| input.modifiers.shift) && self.frame.tool.is_some();
            if response.dragged_by(PointerButton::Primary) && turns {
                let [right, up, _] = self.camera.axes();
                let turn = (up * f64::from(by.x) + right * f64::from(by.y)) * TURN;
                self.act(Hand::Turn(turn.into()));
            } else if response.dragged_by(PointerButton::Primary) {
                let to = on_plane(&self.camera, &at, place, self.aspect());
                self.holding = Some(to);
                self.act(Hand::Pull(to.into()));
            } else {
                self.holding = None;
                self.act(Hand::Release);
            }
        } else if response.dragged_by(PointerButton::Secondary) || (self.orbiting && response.dragged()) {
            let shift = context.input(|input| input.modifiers.shift);
            if shift {
                self.pan(by, rect);
            } else {
                self.camera.orbit(f64::from(-by.x) * 0.4, f64::from(by.y) * 0.4);
            }
        } else if response.dragged_by(PointerButton::Middle) {
            self.pan(by, rect);
        }
        if response.drag_stopped() {
            self.orbiting = false;
        }
        if response.hovered() {
            let scroll =
                context.input(|input| input.smooth_scroll_delta.y + 200.0 * (input.zoom_delta() - 1.0));
            if scroll != 0.0 && self.holding.is_some() && self.frame.tool.is_some() {
                self.act(Hand::Open(OPEN * f64::from(scroll)));
            } else if scroll != 0.0 {
                self.camera.zoom((-0.002 * f64::from(scroll)).exp());
            }
        }
    }

    fn pan(&mut self, by: Vec2, rect: Rect) {
        let unit = f64::from(rect.height());
        self.camera.pan(f64::from(by.x) / unit, -f64::from(by.y) / unit);
    }

    /// What lies under a place of the picture.
    pub(super) fn hit(&self, place: [f64; 2]) -> Option<(Point, Vector3)> {
        let (from, along) = self.camera.ray(place, self.aspect());
        let clip = self.style.clip;
        let found = pick(&self.subject, &self.points, &from, &along, |point| {
            clip.is_none_or(|plane| plane.distance(point) <= 0.0)
        });
        // Obstacles hide what is behind them, and are not taken hold of.
        found.filter(|(point, _)| self.frame.movable.get(point.triangle as usize).copied().unwrap_or(true))
    }

    /// The pin that is shown there.
    fn pin_at(&self, place: Pos2, rect: Rect) -> Option<usize> {
        let pins = self.frame.held.iter().skip(usize::from(self.holding.is_some()));
        let seen = pins.map(|[point, _]| to_screen(&self.camera, &Vector3::from(*point), rect));
        seen.enumerate()
            .find(|(_, at)| at.is_some_and(|at| at.distance(place) <= PIN_SIZE + 3.0))
            .map(|(pin, _)| pin)
    }

    /// The forces of contacts as arrows.
    fn draw_contacts(&self, painter: &egui::Painter, rect: Rect) {
        let forces = &self.frame.contacts;
        let unit = arrow_unit(&self.frame.points, largest_force(forces));
        for [point, force] in forces {
            let ends = [*point, point + force * unit].map(|end| to_screen(&self.camera, &end, rect));
            let [Some(from), Some(to)] = ends else { continue };
            painter.circle(from, DOT, FORCE, Stroke::new(1.0, Color32::WHITE));
            if from.distance(to) > 2.0 {
                painter.arrow(from, to - from, Stroke::new(3.0, Color32::WHITE));
                painter.arrow(from, to - from, Stroke::new(1.5, FORCE));
            }
        }
    }

    /// The force of the hand as an arrow with its newtons, the longest where it was strongest; and pins.
    fn draw_held(&self, painter: &egui::Painter, rect: Rect) {
        let hand = self.holding.is_some();
        for (index, [point, force]) in self.frame.held.iter().enumerate() {
            let [point, force] = [point, force].map(|v| Vector3::from(*v));
            let Some(from) = to_screen(&self.camera, &point, rect) else { continue };
            if index > 0 || !hand {
                painter.circle(from, PIN_SIZE, PIN, Stroke::new(1.5, Color32::WHITE));
                continue;
            }
            painter.circle(from, 4.0, FORCE, Stroke::new(1.0, Color32::WHITE));
            let newtons = force.norm();
            let unit = f64::from(ARROW / rect.height()) * self.camera.height / self.strongest.max(1e-12);
            let Some(to) = to_screen(&self.camera, &(point + force * unit), rect) else { continue };
            if from.distance(to) > 2.0 {
                painter.arrow(from, to - from, Stroke::new(5.0, Color32::WHITE));
                painter.arrow(from, to - from, Stroke::new(3.0, FORCE));
            }
            let text =
                if newtons >= 1.0 { format!("{newtons:.2} N") } else { format!("{:.1} mN", 1e3 * newtons) };
            let galley = painter.layout_no_wrap(text, FontId::proportional(16.0), FORCE);
            let place = Rect::from_min_size(to + vec2(14.0, -galley.size().y), galley.size());
            self.card(painter, place);
            painter.galley(place.min, galley, FORCE);
        }
    }

    /// What text stands on, so that it can be read over a body.
    pub(super) fn card(&self, painter: &egui::Painter, place: Rect) {
        let dark = self.style.background == Background::Dark;
        let pale = if dark { Color32::from_black_alpha(150) } else { Color32::from_white_alpha(170) };
        painter.rect_filled(place.expand(6.0), 5.0, pale);
    }

    /// The colour of what is written over the picture.
    pub(super) fn ink(&self) -> Color32 {
        let [r, g, b] = self.style.background.ink();
        Color32::from_rgb(r, g, b)
    }

    fn draw_scale(&self, painter: &egui::Painter, rect: Rect) {
        let (Some([low, high]), Some(field)) = (self.style.range, self.field()) else { return };
        let (unit, factor) = pliant_picture::readable(field.unit(), low.abs().max(high.abs()));
        let bar = Rect::from_min_max(
            rect.right_top() + vec2(-78.0, 70.0),
            Pos2::new(rect.right() - 60.0, (rect.bottom() - 60.0).max(rect.top() + 90.0)),
        );
        let ink = self.ink();
        self.card(painter, Rect::from_min_max(bar.min - vec2(36.0, 46.0), bar.max + vec2(52.0, 8.0)));
        let component = self.view.component.map(|part| format!(" {}", part.word())).unwrap_or_default();
        let head = format!("{}{component}", field.title());
        let right = Pos2::new(rect.right() - 12.0, bar.top() - 34.0);
        painter.text(right, Align2::RIGHT_CENTER, head, FontId::proportional(14.0), ink);
        if !unit.is_empty() {
            let below = right + vec2(0.0, 17.0);
            painter.text(below, Align2::RIGHT_CENTER, format!("[{unit}]"), FontId::proportional(14.0), ink);
        }
        let rows = bar.height() as usize;
        for row in 0..rows {
            let part = if high > low { 1.0 - (row as f64 + 0.5) / rows as f64 } else { 0.5 };
            let [r, g, b] = self.style.map.at(part);
            let line = Rect::from_min_size(bar.min + vec2(0.0, row as f32), vec2(bar.width(), 1.5));
            painter.rect_filled(line.intersect(bar), 0.0, Color32::from_rgb(r, g, b));
        }
        for (part, text) in scale_marks([low * factor, high * factor], 6) {
            let y = bar.bottom() - part as f32 * bar.height();
            painter.text(
                Pos2::new(bar.right() + 6.0, y),
                Align2::LEFT_CENTER,
                text,
                FontId::proportional(13.0),
                ink,
            );
        }
    }

    /// The grey of parts without a value, where there are some.
    fn draw_missing(&self, painter: &egui::Painter, rect: Rect) {
        if !self.missing {
            return;
        }
        let place = rect.right_bottom() - vec2(12.0, 34.0);
        let text =
            painter.text(place, Align2::RIGHT_CENTER, NO_VALUE, FontId::proportional(13.0), self.ink());
        let [r, g, b] = MISSING;
        let swatch = Rect::from_center_size(text.left_center() - vec2(12.0, 0.0), vec2(12.0, 12.0));
        painter.rect_filled(swatch, 2.0, Color32::from_rgb(r, g, b));
    }

    /// Time, pace and energies, and what a user should know.
    fn draw_figures(&self, painter: &egui::Painter, rect: Rect) {
        let frame = &self.frame;
        let paused = if frame.playing || frame.failure.is_some() { "" } else { ", paused: Space plays" };
        let mut lines = vec![format!("t = {:.3} s{paused}", frame.time)];
        if frame.playing {
            lines.push(format!(
                "{:.2} × real time (up to {:.1} ×)",
                frame.real_time_factor, frame.possible_factor
            ));
            if frame.real_time_factor < 0.95 * self.speed && frame.possible_factor < 1.05 * self.speed {
                lines.push("this machine cannot keep up: time goes slower".into());
            }
        }
        lines.push(format!(
            "frame {:.1} ms, step {:.3} ms, {} steps a frame, prepared in {:.1} ms",
            1e3 * self.frame_seconds,
            1e3 * frame.step_seconds,
            frame.steps_a_frame,
            1e3 * frame.prepare_seconds
        ));
        let energies = &frame.energies;
        lines.push(format!("kinetic {:.3e} J, internal {:.3e} J", energies.kinetic, energies.internal));
        if !frame.contacts.is_empty() {
            lines.push(format!(
                "{} nodes touch, {}",
                frame.contacts.len(),
                arrow_note(largest_force(&frame.contacts))
            ));
        }
        lines.extend(self.told_of_device());
        let ink = self.ink();
        let galley = painter.layout_no_wrap(lines.join("\n"), FontId::proportional(14.0), ink);
        let place = Rect::from_min_size(rect.min + vec2(12.0, 10.0), galley.size());
        self.card(painter, place);
        painter.galley(place.min, galley, ink);
    }
}

/// A place of the window in the picture: x to the right and y up, from −1 to 1.
pub(super) fn in_picture(at: Pos2, rect: Rect) -> [f64; 2] {
    let from = at - rect.center();
    [f64::from(2.0 * from.x / rect.width().max(1.0)), f64::from(-2.0 * from.y / rect.height().max(1.0))]
}

/// Where the ray through a place meets the plane through a point that faces the camera.
pub(super) fn on_plane(camera: &Camera, point: &Vector3, place: [f64; 2], aspect: f64) -> Vector3 {
    let (from, along) = camera.ray(place, aspect);
    let towards = camera.axes()[2];
    let slope = along.dot(&towards);
    if slope.abs() < 1e-9 { *point } else { from + along * ((point - from).dot(&towards) / slope) }
}

/// Where a point is seen; `None` behind the eye.
pub(super) fn to_screen(camera: &Camera, point: &Vector3, rect: Rect) -> Option<Pos2> {
    let half = 0.5 * rect.size();
    let [x, y] = camera.place(point, f64::from(half.x / half.y.max(1.0)))?;
    Some(rect.center() + vec2(half.x * x as f32, -half.y * y as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_manual_lists_the_keys_that_the_window_lists() {
        let manual = include_str!("../../../../docs/viewer.md");
        for (key, does) in KEYS {
            assert!(manual.contains(&format!("| {key} | {does} |")), "`{key}` is not in docs/viewer.md");
        }
    }
}
