//! The picture in the middle: what the mouse does in it, and what is written over it.

use eframe::egui::{
    self, Align2, Color32, FontId, Key, PointerButton, Pos2, Rect, Sense, Stroke, Vec2, vec2,
};
use eframe::egui_wgpu::Callback;
use pliant_geometry::Vector3;
use pliant_picture::{Camera, Plane, ticks};

use super::App;
use super::paint::Paint;
use crate::hand::{Hand, pick};

const PIN: Color32 = Color32::from_rgb(20, 90, 170);
const FORCE: Color32 = Color32::from_rgb(190, 40, 40);
const WARNING: Color32 = Color32::from_rgb(250, 225, 150);
const FAILED: Color32 = Color32::from_rgb(245, 180, 170);

/// Keys and what they do, as in `docs/viewer.md`.
const KEYS: [(&str, &str); 14] = [
    ("drag the body", "pull it"),
    ("Ctrl + click the body", "pin it"),
    ("drag beside it", "turn the view"),
    ("right drag", "turn the view; with Shift move it"),
    ("wheel", "zoom"),
    ("Space", "play or pause"),
    (".", "one step"),
    ("R", "start anew"),
    ("F", "see all"),
    ("E G C", "edges, shape at rest, section"),
    ("L", "lock the range of colours"),
    ("O", "parallel or perspective"),
    ("H", "these keys"),
    ("drop a scene", "open it"),
];

impl App {
    pub(super) fn plane(&self) -> Option<Plane> {
        let (on, part, axis) = self.clip;
        if !on {
            return None;
        }
        let mut normal = Vector3::zeros();
        normal[axis] = 1.0;
        let surface = self.subject.surface_points();
        let along = surface.iter().map(|&point| self.subject.points[point as usize][axis]);
        let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        Some(Plane { normal, offset: low + part * (high - low) })
    }

    pub(super) fn scene(&mut self, ui: &mut egui::Ui) {
        let rect = ui.available_rect_before_wrap();
        let response = ui.allocate_rect(rect, Sense::click_and_drag());
        let aspect = f64::from(rect.width() / rect.height().max(1.0));
        self.style.clip = self.plane();
        self.mouse(ui.ctx(), &response, rect, aspect);
        let mut style = self.style;
        if self.values.is_empty() {
            style.range = None;
        }
        let paint = Paint {
            points: self.points.clone(),
            values: self.values.clone(),
            camera: self.camera,
            style,
            aspect,
            fresh: std::mem::take(&mut self.fresh),
        };
        ui.painter().add(Callback::new_paint_callback(rect, paint));
        let painter = ui.painter_at(rect);
        self.draw_held(&painter, rect, aspect);
        if style.range.is_some() {
            self.draw_scale(&painter, rect);
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

    fn mouse(&mut self, context: &egui::Context, response: &egui::Response, rect: Rect, aspect: f64) {
        let Some(pointer) = context.pointer_latest_pos() else { return };
        let place = in_picture(pointer, rect);
        if response.drag_started_by(PointerButton::Primary) || response.clicked() {
            let origin = context.input(|input| input.pointer.press_origin()).unwrap_or(pointer);
            let hit = self.hit(in_picture(origin, rect), aspect);
            let pinning = context.input(|input| input.modifiers.command || input.key_down(Key::P));
            match hit {
                Some((point, _)) if response.clicked() && pinning => self.act(Hand::Pin(point)),
                Some((point, at)) if response.drag_started() => {
                    self.holding = Some(at);
                    self.act(Hand::Take(point, self.stiffness));
                }
                _ => self.orbiting = response.drag_started(),
            }
        }
        let by = response.drag_delta();
        if let Some(at) = self.holding {
            if response.dragged_by(PointerButton::Primary) {
                let to = on_plane(&self.camera, &at, place, aspect);
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
            if scroll != 0.0 {
                self.camera.zoom((-0.002 * f64::from(scroll)).exp());
            }
        }
    }

    fn pan(&mut self, by: Vec2, rect: Rect) {
        let unit = f64::from(rect.height());
        self.camera.pan(f64::from(by.x) / unit, -f64::from(by.y) / unit);
    }

    /// What lies under a place of the picture.
    pub(super) fn hit(&self, place: [f64; 2], aspect: f64) -> Option<(crate::hand::Point, Vector3)> {
        let (from, along) = self.camera.ray(place, aspect);
        let clip = self.style.clip;
        pick(&self.subject, &self.points, &from, &along, |point| {
            clip.is_none_or(|plane| plane.distance(point) <= 0.0)
        })
    }

    fn to_screen(&self, point: &Vector3, rect: Rect, aspect: f64) -> Option<Pos2> {
        let [x, y] = self.camera.place(point, aspect)?;
        let half = 0.5 * rect.size();
        Some(rect.center() + vec2(half.x * x as f32, -half.y * y as f32))
    }

    /// The force of the hand as an arrow with its newtons, and pins.
    fn draw_held(&self, painter: &egui::Painter, rect: Rect, aspect: f64) {
        let hand = self.holding.is_some();
        for (index, [point, force]) in self.frame.held.iter().enumerate() {
            let Some(from) = self.to_screen(&Vector3::from(*point), rect, aspect) else { continue };
            if index > 0 || !hand {
                painter.circle(from, 5.0, PIN, Stroke::new(1.5, Color32::WHITE));
                continue;
            }
            let newtons = Vector3::from(*force).norm();
            let along = Vector3::from(*force) / self.stiffness.max(1e-9);
            let Some(to) = self.to_screen(&(Vector3::from(*point) + along), rect, aspect) else { continue };
            painter.circle_filled(from, 4.0, FORCE);
            painter.arrow(from, to - from, Stroke::new(2.5, FORCE));
            let text =
                if newtons >= 1.0 { format!("{newtons:.2} N") } else { format!("{:.1} mN", 1e3 * newtons) };
            painter.text(to + vec2(10.0, -8.0), Align2::LEFT_BOTTOM, text, FontId::proportional(16.0), FORCE);
        }
    }

    fn draw_scale(&self, painter: &egui::Painter, rect: Rect) {
        let (Some([low, high]), Some(field)) = (self.style.range, self.field) else { return };
        let (unit, factor) = pliant_picture::readable(field.unit(), low.abs().max(high.abs()));
        let bar = Rect::from_min_max(
            rect.right_top() + vec2(-78.0, 70.0),
            Pos2::new(rect.right() - 60.0, (rect.bottom() - 60.0).max(rect.top() + 90.0)),
        );
        let ink = Color32::from_gray(40);
        let component = self.component.map(|part| format!(" {part}")).unwrap_or_default();
        let head = format!("{}{component}", field.title());
        let right = Pos2::new(rect.right() - 12.0, bar.top() - 34.0);
        painter.text(right, Align2::RIGHT_CENTER, head, FontId::proportional(14.0), ink);
        if !unit.is_empty() {
            let below = right + vec2(0.0, 17.0);
            painter.text(below, Align2::RIGHT_CENTER, format!("[{unit}]"), FontId::proportional(14.0), ink);
        }
        let rows = bar.height() as usize;
        for row in 0..rows {
            let part = 1.0 - (row as f64 + 0.5) / rows as f64;
            let [r, g, b] = self.style.map.at(part);
            let line = Rect::from_min_size(bar.min + vec2(0.0, row as f32), vec2(bar.width(), 1.5));
            painter.rect_filled(line.intersect(bar), 0.0, Color32::from_rgb(r, g, b));
        }
        let (values, step) = ticks([low * factor, high * factor], 6);
        let decimals = (-(step.log10() - 0.3).floor()).clamp(0.0, 6.0) as usize;
        for value in values {
            let part = ((value / factor - low) / (high - low)) as f32;
            let y = bar.bottom() - part * bar.height();
            let text = format!("{value:.decimals$}");
            painter.text(
                Pos2::new(bar.right() + 6.0, y),
                Align2::LEFT_CENTER,
                text,
                FontId::proportional(13.0),
                ink,
            );
        }
    }

    /// Time, pace and energies, and what a user should know.
    fn draw_figures(&self, painter: &egui::Painter, rect: Rect) {
        let frame = &self.frame;
        let mut lines = vec![format!("t = {:.3} s", frame.time)];
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
        let ink = Color32::from_gray(40);
        painter.text(
            rect.min + vec2(12.0, 10.0),
            Align2::LEFT_TOP,
            lines.join("\n"),
            FontId::proportional(14.0),
            ink,
        );
        let notes = self.stage.built.warnings.iter().map(|warning| warning.message.clone());
        let banner = frame.failure.clone().or_else(|| self.message.clone());
        let banner = banner.or_else(|| frame.note.clone()).or_else(|| notes.last());
        if let Some(text) = banner {
            let colour = if frame.failure.is_some() { FAILED } else { WARNING };
            let width = rect.width() - 40.0;
            let galley = painter.layout(text, FontId::proportional(15.0), Color32::from_gray(20), width);
            let place = Rect::from_min_size(
                Pos2::new(rect.left() + 12.0, rect.bottom() - galley.size().y - 24.0),
                galley.size() + vec2(16.0, 12.0),
            );
            painter.rect_filled(place, 4.0, colour);
            painter.galley(place.min + vec2(8.0, 6.0), galley, Color32::BLACK);
        }
    }
}

/// A place of the window in the picture: x to the right and y up, from −1 to 1.
fn in_picture(at: Pos2, rect: Rect) -> [f64; 2] {
    let from = at - rect.center();
    [f64::from(2.0 * from.x / rect.width().max(1.0)), f64::from(-2.0 * from.y / rect.height().max(1.0))]
}

/// Where the ray through a place meets the plane through a point that faces the camera.
fn on_plane(camera: &Camera, point: &Vector3, place: [f64; 2], aspect: f64) -> Vector3 {
    let (from, along) = camera.ray(place, aspect);
    let towards = camera.axes()[2];
    let slope = along.dot(&towards);
    if slope.abs() < 1e-9 { *point } else { from + along * ((point - from).dot(&towards) / slope) }
}
