//! The picture in the middle: actions of the mouse in it, and text over it.

use eframe::egui::{self, Align2, Color32, CursorIcon, FontId, Key, PointerButton, Pos2, Rect, Stroke, vec2};
use pliant_geometry::Vector3;
use pliant_picture::{Camera, Marked, WEIGHT, arrow_note, arrow_unit, largest_force, largest_load};

use super::App;
use super::viewport::scrolled;
use crate::hand::{Hand, Point, Which, pick};

/// Length of the arrow of the strongest force of a pull on the screen.
const ARROW: f32 = 120.0;
/// Angle [rad] by which a tool turns for a point on the screen, and by which jaws open for one of the wheel.
pub(super) const TURN: f64 = 0.01;
pub(super) const OPEN: f64 = 0.002;
/// Radius of a point of contact on the screen.
const DOT: f32 = 2.5;
/// Radius of a pin on the screen.
const PIN_SIZE: f32 = 5.0;
const PIN: Color32 = Color32::from_rgb(20, 90, 170);
const FORCE: Color32 = Color32::from_rgb(190, 40, 40);

/// Keys and what they do, as in `docs/guide/window.md`.
const KEYS: [(&str, &str); 29] = [
    ("drag the body", "pull it"),
    ("drag a tool", "lead it; with Shift turn it about where it is held"),
    ("wheel while dragging a tool", "open and close its jaws"),
    (
        "K, arrows, Page Up and Down",
        "take the next tool, and move it; with Shift turn it; Home and End open and close its jaws",
    ),
    (
        "B while dragging",
        "hold it with this hand and use the other hand; drag the held place to take it again",
    ),
    ("B", "release the other hand"),
    ("Ctrl or P + click", "pin it; on a pin, remove it"),
    ("Alt or I + click", "follow a point: read and plot it; two give their distance"),
    ("drag the background", "turn the view"),
    ("right drag", "turn the view; with Shift move it"),
    ("middle drag", "move the view"),
    ("wheel", "zoom"),
    ("Space", "play or pause"),
    (".", "one step"),
    (",", "back to the last kept state, a quarter of a second before"),
    ("Ctrl and Z", "take back a pull, a pin or changed numbers"),
    ("R", "start anew"),
    ("F", "see all"),
    ("0", "view as at the start"),
    ("1 2 3 4 5 6", "see all from the front, back, left, right, top, bottom"),
    ("E G C", "edges, shape at rest, section"),
    ("L", "lock the range of colours"),
    ("O", "parallel or perspective"),
    ("Ctrl and + − 0", "larger or smaller text"),
    ("M", "constraints and loads"),
    ("V", "begin a film, or end and write it"),
    ("Ctrl and O", "list what can be opened"),
    ("H", "these keys"),
    ("drop a scene", "open it"),
];

impl App {
    pub(super) fn scene(&mut self, ui: &mut egui::Ui) {
        let response = self.port.lay_out(ui);
        let rect = response.rect;
        self.mouse(ui.ctx(), &response);
        let on_device = self.on_device().map(|points| points.buffer().clone());
        self.port.paint(ui.painter(), self.view.shows_labels(), self.frame.critical, on_device);
        let painter = ui.painter_at(rect);
        self.draw_contacts(&painter);
        self.draw_marks(&painter);
        self.draw_held(&painter);
        self.port.draw_axes(&painter);
        self.draw_followed(&painter);
        if let Some(field) = self.field().filter(|_| !self.view.shows_labels()) {
            let component = self.view.component.map(|part| format!(" {}", part.word())).unwrap_or_default();
            // Points on the device are newer than values while the scene plays there.
            if self.on_device().is_none() || !self.frame.playing {
                self.port.draw_maximum(&painter, field.unit());
            }
            self.port.draw_scale(&painter, &format!("{}{component}", field.title()), field.unit());
        }
        self.draw_figures(&painter);
        if self.help {
            let mut text = String::new();
            KEYS.iter().for_each(|(key, does)| text.push_str(&format!("{key:<29}{does}\n")));
            let at = rect.center();
            let font = FontId::monospace(13.0);
            let galley = painter.layout_no_wrap(text, font, Color32::from_gray(30));
            let place = Rect::from_center_size(at, galley.size()).expand(14.0);
            painter.rect_filled(place, 6.0, Color32::from_white_alpha(235));
            painter.galley(place.min + vec2(14.0, 14.0), galley, Color32::BLACK);
        }
    }

    fn mouse(&mut self, context: &egui::Context, response: &egui::Response) {
        let Some(pointer) = context.pointer_latest_pos() else { return };
        let place = self.port.in_picture(pointer);
        let pulls = self.pulls();
        if pulls {
            context.set_cursor_icon(CursorIcon::Grabbing);
        } else if response.contains_pointer() && self.hit(place).is_some() {
            context.set_cursor_icon(CursorIcon::Grab);
        }
        let pinning = context.input(|input| input.modifiers.command || input.key_down(Key::P));
        if response.clicked() && pinning || response.drag_started_by(PointerButton::Primary) {
            self.bring_points();
        }
        if response.clicked() && pinning {
            match (self.pin_at(pointer), self.hit(place)) {
                (Some(pin), _) => self.act(Hand::Unpin(pin)),
                (None, Some((point, _))) => self.act(Hand::Pin(point)),
                (None, None) => {}
            }
        }
        if response.clicked()
            && context.input(|input| input.modifiers.alt || input.key_down(Key::I))
            && let Some((point, _)) = self.hit(place)
        {
            self.add_probe(point);
        }
        if response.drag_started_by(PointerButton::Primary) {
            let origin = context.input(|input| input.pointer.press_origin()).unwrap_or(pointer);
            match self.hit(self.port.in_picture(origin)) {
                _ if self.take_kept(origin) => {}
                Some((point, at)) => self.grip(point, at),
                None => self.orbiting = true,
            }
        }
        let by = response.drag_delta();
        let is_tool = self.frame.tools[self.mouse as usize].is_some();
        if let Some(at) = self.hands[self.mouse as usize].filter(|_| !self.is_led(self.mouse)) {
            let turns = context.input(|input| input.modifiers.shift) && is_tool;
            if response.dragged_by(PointerButton::Primary) && turns {
                let [right, up, _] = self.port.camera.axes();
                let turn = (up * f64::from(by.x) + right * f64::from(by.y)) * TURN;
                self.act(Hand::Turn(turn.into()));
            } else if response.dragged_by(PointerButton::Primary) {
                let aspect = self.port.aspect();
                let to = on_plane(&self.port.camera, &(at - self.beside), place, aspect) + self.beside;
                self.hands[self.mouse as usize] = Some(to);
                self.act(Hand::Pull(to.into()));
            } else {
                self.hands[self.mouse as usize] = None;
                self.act(Hand::Release);
            }
        }
        let scroll = if response.hovered() { scrolled(context) } else { 0.0 };
        let pulls = self.pulls();
        if scroll != 0.0 && pulls && is_tool {
            self.act(Hand::Open(OPEN * f64::from(scroll)));
        } else if !pulls || scroll != 0.0 {
            self.port.turn(context, response, self.orbiting);
        }
        if response.drag_stopped() {
            self.orbiting = false;
        }
    }

    /// Returns the movable point under a place of the picture, and its position [m].
    pub(super) fn hit(&self, place: [f64; 2]) -> Option<(Point, Vector3)> {
        let (from, along) = self.port.camera.ray(place, self.port.aspect());
        let clip = self.port.style.clip;
        let found = pick(&self.port.subject, &self.port.points, &from, &along, |point| {
            clip.is_none_or(|plane| plane.distance(point) <= 0.0)
        });
        // Obstacles hide the things behind them, but hands can't take them.
        found.filter(|(point, _)| self.frame.movable.get(point.triangle as usize).copied().unwrap_or(true))
    }

    /// The pin that is shown there.
    fn pin_at(&self, place: Pos2) -> Option<usize> {
        self.frame.pins().iter().position(|[point, _]| self.is_at(point, place))
    }

    /// True if a held point is drawn at a place.
    pub(super) fn is_at(&self, point: &[f64; 3], place: Pos2) -> bool {
        let at = self.port.to_screen(&Vector3::from(*point));
        at.is_some_and(|at| at.distance(place) <= PIN_SIZE + 3.0)
    }

    /// The forces of contacts as arrows.
    fn draw_contacts(&self, painter: &egui::Painter) {
        let forces = &self.frame.contacts;
        let unit = arrow_unit(&self.frame.points, largest_force(forces));
        for [point, force] in forces {
            let ends = [*point, point + force * unit].map(|end| self.port.to_screen(&end));
            let [Some(from), Some(to)] = ends else { continue };
            painter.circle(from, DOT, FORCE, Stroke::new(1.0, Color32::WHITE));
            if from.distance(to) > 2.0 {
                painter.arrow(from, to - from, Stroke::new(3.0, Color32::WHITE));
                painter.arrow(from, to - from, Stroke::new(1.5, FORCE));
            }
        }
    }

    /// Squares where nodes are held, dots where they are moved, bars under plates, arrows of loads and
    /// weights.
    fn draw_marks(&self, painter: &egui::Painter) {
        let unit = arrow_unit(&self.frame.points, largest_load(&self.frame.marks));
        for (place, marked) in &self.frame.marks {
            let Some(at) = self.port.to_screen(place) else { continue };
            let square = Rect::from_center_size(at, vec2(2.0 * DOT, 2.0 * DOT));
            let [red, green, blue] = marked.colour();
            let colour = Color32::from_rgb(red, green, blue);
            match marked {
                Marked::Held => {
                    painter.rect_filled(square.expand(1.0), 0.0, Color32::WHITE);
                    painter.rect_filled(square, 0.0, colour);
                }
                Marked::Moved => {
                    painter.circle(at, DOT, colour, Stroke::new(1.0, Color32::WHITE));
                }
                Marked::Plate => {
                    let bar = Rect::from_center_size(at, vec2(4.0 * DOT, DOT));
                    painter.rect_filled(bar.expand(1.0), 0.0, Color32::WHITE);
                    painter.rect_filled(bar, 0.0, colour);
                }
                Marked::Weight(force) => {
                    let reach = force.normalize() * (WEIGHT * self.port.camera.height);
                    let Some(to) = self.port.to_screen(&(place + reach)) else { continue };
                    painter.arrow(at, to - at, Stroke::new(5.0, Color32::WHITE));
                    painter.arrow(at, to - at, Stroke::new(3.0, colour));
                }
                Marked::Loaded(force) => {
                    let Some(to) = self.port.to_screen(&(place + force * unit)) else { continue };
                    painter.arrow(at, to - at, Stroke::new(3.0, Color32::WHITE));
                    painter.arrow(at, to - at, Stroke::new(1.5, colour));
                }
            }
        }
    }

    /// Forces of the hands as arrows with their newtons, the longest where one was strongest; and pins.
    fn draw_held(&self, painter: &egui::Painter) {
        for [point, _] in self.frame.pins() {
            if let Some(at) = self.port.to_screen(&Vector3::from(*point)) {
                painter.circle(at, PIN_SIZE, PIN, Stroke::new(1.5, Color32::WHITE));
            }
        }
        let hands = Which::BOTH.into_iter().filter_map(|which| self.frame.hand(which));
        for [point, force] in hands.map(|hand| hand.map(Vector3::from)) {
            let Some(from) = self.port.to_screen(&point) else { continue };
            painter.circle(from, 4.0, FORCE, Stroke::new(1.0, Color32::WHITE));
            let newtons = force.norm();
            let unit = f64::from(ARROW / self.port.rect.height()) * self.port.camera.height
                / self.strongest.max(1e-12);
            let Some(to) = self.port.to_screen(&(point + force * unit)) else { continue };
            if from.distance(to) > 2.0 {
                painter.arrow(from, to - from, Stroke::new(5.0, Color32::WHITE));
                painter.arrow(from, to - from, Stroke::new(3.0, FORCE));
            }
            let text =
                if newtons >= 1.0 { format!("{newtons:.2} N") } else { format!("{:.1} mN", 1e3 * newtons) };
            let galley = painter.layout_no_wrap(text, FontId::proportional(16.0), FORCE);
            let place = Rect::from_min_size(to + vec2(14.0, -galley.size().y), galley.size());
            self.port.card(painter, place);
            painter.galley(place.min, galley, FORCE);
        }
    }

    /// Draws time, pace and energies, and notes for the user.
    fn draw_figures(&self, painter: &egui::Painter) {
        let frame = &self.frame;
        let paused = if frame.playing || frame.failure.is_some() { "" } else { ", paused: Space plays" };
        let mut lines = vec![format!("t = {:.3} s{paused}", frame.time)];
        if frame.playing {
            lines.push(format!(
                "{:.2} × real time (up to {:.1} ×)",
                frame.real_time_factor, frame.possible_factor
            ));
            if frame.real_time_factor < 0.95 * self.speed && frame.possible_factor < 1.05 * self.speed {
                lines.push("this machine cannot keep up: time runs slower".into());
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
        if let Some(gap) = frame.least_gap {
            lines.push(format!("least gap {:.3} mm", 1e3 * gap));
        }
        if frame.unconverged > 0 {
            lines.push(format!("steps that did not converge: {}", frame.unconverged));
        }
        lines.extend(self.told_of_device());
        self.port.write(painter, Align2::LEFT_TOP, self.port.rect.min + vec2(12.0, 10.0), &lines, 14.0);
    }
}

/// Returns the intersection of the ray through a place with a plane. The plane contains a point and faces the
/// camera.
pub(super) fn on_plane(camera: &Camera, point: &Vector3, place: [f64; 2], aspect: f64) -> Vector3 {
    let (from, along) = camera.ray(place, aspect);
    let towards = camera.axes()[2];
    let slope = along.dot(&towards);
    if slope.abs() < 1e-9 { *point } else { from + along * ((point - from).dot(&towards) / slope) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_manual_lists_the_keys_that_the_window_lists() {
        let manual = include_str!("../../../../docs/guide/window.md");
        for (key, does) in KEYS {
            assert!(
                manual.contains(&format!("| {key} | {does} |")),
                "`{key}` is not in docs/guide/window.md"
            );
        }
    }
}
