//! The view of a body: its subject, the camera, the style, and the text around it. Both a played scene and a
//! finished run are seen through it.

use std::sync::Arc;

use eframe::egui::{
    self, Align2, Color32, FontId, Key, Painter, PointerButton, Pos2, Rect, Sense, Stroke, Vec2, vec2,
};
use eframe::egui_wgpu::Callback;
use eframe::{CreationContext, Frame, wgpu};
use pliant_geometry::Vector3;
use pliant_picture::{
    Background, Camera, Extremes, Look, MISSING, NO_VALUE, Plane, Projection, Regions, Section, Sight, Style,
    Subject, Target, beyond, largest_seen, maximum_text, noise, readable, scale_marks,
};

use super::paint::{Paint, SAMPLES, place};

/// Description of the occlusion for the user.
pub(super) const OCCLUSION: &str = "darkens folds and contacts, where less light arrives";
/// Width of the scale of colours on the screen.
const SCALE: f32 = 110.0;
/// Radius of the ring around the largest value on the screen.
const RING: f32 = 8.0;
/// Height of the figures on the screen.
const FIGURES: f32 = 104.0;
/// Length of the axes on the screen, and how far their origin is from the corner.
const AXES: f32 = 30.0;
const CORNER: f32 = 46.0;
/// Largest length of the bar on the screen.
const BAR: f64 = 150.0;
/// Distance of the bar's end from the left.
pub(super) const BESIDE_BAR: f32 = 2.0 * CORNER + 24.0 + BAR as f32;
/// Colours of x, y and z.
const COLOURS: [Color32; 3] =
    [Color32::from_rgb(196, 54, 46), Color32::from_rgb(46, 138, 60), Color32::from_rgb(50, 92, 196)];
/// Letters of the sides of a patient to which x, y and z point, and of the opposite sides. They are right and
/// left, front (anterior) and back, head (superior) and feet.
const SIDES_OF_PATIENT: [[&str; 2]; 3] = [["R", "L"], ["A", "P"], ["S", "I"]];

/// Azimuth and elevation [°] of the sides: front, back, left, right, top, bottom. The front of a patient is
/// along y, else along x.
fn sides(patient: bool) -> [(Key, [f64; 2]); 6] {
    let front = if patient { 90.0 } else { 0.0 };
    [
        (Key::Num1, [front, 0.0]),
        (Key::Num2, [front + 180.0, 0.0]),
        (Key::Num3, [front + 90.0, 0.0]),
        (Key::Num4, [(front + 270.0) % 360.0, 0.0]),
        (Key::Num5, [front, 89.9]),
        (Key::Num6, [front, -89.9]),
    ]
}

/// A section: whether it is on, its normal, and how far along it the plane lies, as a part of the body's
/// extent at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cut {
    pub on: bool,
    pub normal: Vector3,
    pub part: f64,
    /// Position in the scene [m], until the plane is moved.
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

    /// Its switch and its place.
    pub fn edit(&mut self, ui: &mut egui::Ui, plane: Option<Plane>) {
        ui.checkbox(&mut self.on, "Section").on_hover_text("C: cuts the body open along a plane");
        if self.on {
            ui.horizontal(|ui| {
                for (word, normal) in [("x", Vector3::x()), ("y", Vector3::y()), ("z", Vector3::z())] {
                    ui.selectable_value(&mut self.normal, normal, word);
                    ui.selectable_value(&mut self.normal, -normal, format!("−{word}"));
                }
            });
            let place = plane.map(|plane| format!("at {:.2} mm", 1e3 * plane.offset)).unwrap_or_default();
            ui.add(egui::Slider::new(&mut self.part, 0.0..=1.0).show_value(false).text(place));
        }
    }
}

/// From where to where a body reaches along a direction [m], at rest.
fn extent(subject: &Subject, along: &Vector3) -> [f64; 2] {
    let places = subject.points.iter().map(|point| point.dot(along));
    places.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
}

/// View of a body from a camera.
pub(super) struct Viewport {
    target: Target,
    pub subject: Arc<Subject>,
    pub points: Arc<Vec<Vector3>>,
    pub values: Arc<Vec<f64>>,
    /// True if points or values have changed since the last paint.
    fresh: bool,
    /// True if the subject has changed since the last copy to the device.
    renewed: bool,
    pub camera: Camera,
    /// Direction of the first view; target and height fit the body.
    pub home: Camera,
    /// Target of the first view [m], unless it shows everything, and its magnification compared with a camera
    /// that fits.
    closer: (Option<Vector3>, f64),
    /// True if software draws.
    software: bool,
    pub style: Style,
    /// Regions with a look of their own.
    pub regions: Regions,
    /// True if the axes are the axes of a patient.
    pub patient: bool,
    /// True if the range of colours is fixed.
    pub locked: bool,
    /// True if a part of a body has no value of the field.
    pub missing: bool,
    pub cut: Cut,
    /// Points on the surface in increasing order, and the points of regions that show values.
    pub surface: Vec<u32>,
    showing: Vec<u32>,
    /// Regions for which these points were found.
    shown: Option<Regions>,
    /// Size of the body at rest [m], and the least and the greatest value that is seen.
    extent: f64,
    ends: Option<[f64; 2]>,
    /// The largest value that is seen, and its place [m].
    largest: Option<(Vector3, f64)>,
    section: Section,
    /// Known past and future positions of moving things [m].
    pub reach: Arc<Vec<Vector3>>,
    /// Rectangle of the picture in the window, in egui's points.
    pub rect: Rect,
}

impl Viewport {
    /// Nothing yet, from somewhere.
    ///
    /// # Errors
    /// If the window has no GPU.
    pub fn new(context: &CreationContext<'_>, look: &Look) -> Result<Self, String> {
        let state = context.wgpu_render_state.as_ref().ok_or("wgpu did not start")?;
        let target = Target {
            format: state.target_format,
            depth: wgpu::TextureFormat::Depth32Float,
            samples: SAMPLES,
        };
        let mut port = Self {
            target,
            subject: Arc::default(),
            points: Arc::default(),
            values: Arc::default(),
            fresh: true,
            renewed: false,
            camera: look.camera,
            home: look.camera,
            closer: (None, 1.0),
            software: state.adapter.get_info().device_type == wgpu::DeviceType::Cpu,
            locked: false,
            cut: Cut::new(None),
            style: look.style,
            regions: Regions::default(),
            patient: false,
            missing: false,
            surface: Vec::new(),
            showing: Vec::new(),
            shown: None,
            extent: 0.0,
            ends: None,
            largest: None,
            section: Section::default(),
            reach: Arc::default(),
            rect: Rect::ZERO,
        };
        port.take_look(look);
        Ok(port)
    }

    /// Looks as a scene asks for.
    pub(crate) fn take_look(&mut self, look: &Look) {
        self.style = look.style;
        // Software takes a twelfth longer for a frame with it.
        self.style.occlusion &= !self.software;
        self.locked = look.style.range.is_some();
        self.cut = Cut::new(look.style.clip);
        self.home = look.camera;
        self.closer = (look.target, if look.zoom > 0.0 { look.zoom } else { 1.0 });
        self.camera = self.at_start();
    }

    /// Looks at another body, at rest and without values.
    pub fn renew(&mut self, subject: &Arc<Subject>) {
        self.subject = subject.clone();
        self.surface = subject.surface_points();
        self.extent = subject.extent();
        self.shown = None;
        self.points = Arc::new(subject.points.clone());
        self.values = Arc::default();
        self.renewed = true;
    }

    /// Puts the body into a state: its points [m] and a value at each.
    pub fn set(&mut self, points: &[Vector3], values: &[f64]) {
        let kept_points = Arc::make_mut(&mut self.points);
        kept_points.clear();
        kept_points.extend_from_slice(points);
        let kept_values = Arc::make_mut(&mut self.values);
        kept_values.clear();
        kept_values.extend_from_slice(values);
        self.fresh = true;
    }

    /// The range of the values that are seen, of a unit.
    pub(crate) fn range_seen(&mut self, unit: &str) -> Option<[f64; 2]> {
        if self.shown.as_ref() != Some(&self.regions) {
            self.showing = self.subject.showing_points(&self.regions);
            self.shown = Some(self.regions.clone());
        }
        let mut extremes = Extremes::above(noise(unit, self.extent));
        let clip = self.style.clip;
        let is_seen =
            |point: &&u32| clip.is_none_or(|plane| plane.distance(&self.points[**point as usize]) <= 0.0);
        let seen: Vec<u32> = self.showing.iter().filter(is_seen).copied().collect();
        self.missing = self.subject.lacks_value(&seen, &self.values);
        extremes.add(seen.iter().filter_map(|&point| self.values.get(point as usize)).copied());
        if let Some(plane) = clip.filter(|_| !self.values.is_empty()) {
            self.section.cut(&self.subject, &self.points, &self.values, &plane);
            extremes.add(self.section.values(&self.subject, &self.regions));
        }
        self.ends = extremes.ends();
        let (subject, values) = (&self.subject, &self.values);
        self.largest = largest_seen(subject, &self.regions, &self.points, values, clip, &self.section);
        extremes.range(self.style.map)
    }

    /// Takes the range of the values of a unit, unless it is locked.
    pub(crate) fn fit_range(&mut self, unit: &str) {
        let range = self.range_seen(unit);
        if !self.locked {
            self.style.range = range;
        }
    }

    /// Brings the body to the device where it is another one.
    pub fn bring(&mut self, frame: &Frame) {
        if self.renewed
            && let Some(state) = frame.wgpu_render_state()
        {
            place(state, self.target, &self.subject);
            self.renewed = false;
        }
    }

    /// Takes the remaining room of the window, and lets the section follow the body. Returns the actions of
    /// the mouse there. A fixed name keeps a drag alive when a neighbouring panel appears or disappears.
    pub(crate) fn lay_out(&mut self, ui: &mut egui::Ui) -> egui::Response {
        let rect = ui.available_rect_before_wrap();
        let response = ui.interact(rect, egui::Id::unique("picture"), Sense::click_and_drag());
        let first = self.rect == Rect::ZERO;
        self.rect = rect;
        if first {
            self.camera = self.at_start();
        }
        self.style.clip = self.cut.plane(&self.subject);
        response
    }

    /// Draws the body; from a buffer of points where they are on the device already.
    pub fn paint(
        &mut self,
        painter: &Painter,
        labels: bool,
        critical: Option<u32>,
        on_device: Option<wgpu::Buffer>,
    ) {
        let mut style = Style { labels, ..self.style };
        if self.values.is_empty() {
            style.range = None;
        }
        let paint = Paint {
            on_device,
            critical,
            points: self.points.clone(),
            values: self.values.clone(),
            camera: self.camera,
            style,
            regions: self.regions.clone(),
            aspect: self.aspect(),
            fresh: std::mem::take(&mut self.fresh),
        };
        painter.add(Callback::new_paint_callback(self.rect, paint));
    }

    /// Widths a height of the picture.
    pub fn aspect(&self) -> f64 {
        let size = self.rect.size();
        if size.y > 0.0 { f64::from(size.x / size.y) } else { 1.3 }
    }

    /// The camera that sees all, from the side from which it looks.
    pub fn fitted(&self) -> Camera {
        self.fit_from(Camera { azimuth: self.camera.azimuth, elevation: self.camera.elevation, ..self.home })
    }

    /// The camera of the start.
    pub fn at_start(&self) -> Camera {
        let mut camera = self.fit_from(self.home);
        let (target, zoom) = self.closer;
        camera.zoom(1.0 / zoom);
        if let Some(target) = target {
            camera.target = target;
            let [right, up] = self.beside();
            camera.pan(right, up);
        }
        camera
    }

    /// Offset of the view's middle from the middle of the picture, in heights to the right and up. It leaves
    /// room for the scale of colours and the figures.
    fn beside(&self) -> [f64; 2] {
        let height = self.rect.height().max(SCALE);
        [-0.5 * f64::from(SCALE / height), -0.5 * f64::from(FIGURES / height).min(0.4)]
    }

    fn fit_from(&self, mut camera: Camera) -> Camera {
        let [right, up] = self.beside();
        let (scale, figures) = (-2.0 * right, -2.0 * up);
        let aspect = ((self.aspect() - scale) / (1.0 - figures)).max(0.5);
        let now = self.surface.iter().map(|&point| &self.points[point as usize]);
        camera.fit(now.chain(&*self.reach), aspect);
        camera.height /= 1.0 - figures;
        camera.pan(right, up);
        camera
    }

    /// Returns the target [m] and magnification of the camera if it does not see everything.
    pub fn closer(&self) -> Option<(Vector3, f64)> {
        let fitted = self.fitted();
        let moved = (self.camera.target - fitted.target).norm() > 0.01 * fitted.height
            || (self.camera.height / fitted.height - 1.0).abs() > 0.01;
        let mut middle = self.camera;
        let [right, up] = self.beside();
        middle.pan(-right, -up);
        moved.then(|| (middle.target, fitted.height / self.camera.height))
    }

    /// Takes the known positions of moving things. A camera that showed everything is fitted again.
    pub(crate) fn learn(&mut self, reach: Arc<Vec<Vector3>>) {
        let (saw_all, at_start) = (self.camera == self.fitted(), self.camera == self.at_start());
        self.reach = reach;
        if at_start {
            self.camera = self.at_start();
        } else if saw_all {
            self.fit();
        }
    }

    pub fn fit(&mut self) {
        self.camera = self.fitted();
    }

    /// Sees all from a side: azimuth and elevation [°].
    fn look_from(&mut self, [azimuth, elevation]: [f64; 2]) {
        (self.camera.azimuth, self.camera.elevation) = (azimuth, elevation);
        self.fit();
    }

    /// Turns and moves the camera, or brings it nearer, as the mouse moves while it holds nothing.
    pub fn turn(&mut self, context: &egui::Context, response: &egui::Response, orbiting: bool) {
        let by = response.drag_delta();
        let shift = context.input(|input| input.modifiers.shift);
        let turns = response.dragged_by(PointerButton::Secondary) || (orbiting && response.dragged());
        if response.dragged_by(PointerButton::Middle) || turns && shift {
            let unit = f64::from(self.rect.height());
            self.camera.pan(f64::from(by.x) / unit, -f64::from(by.y) / unit);
        } else if turns {
            self.camera.orbit(f64::from(-by.x) * 0.4, f64::from(by.y) * 0.4);
        }
        if response.hovered() {
            let scroll = scrolled(context);
            if scroll != 0.0 {
                self.camera.zoom((-0.002 * f64::from(scroll)).exp());
            }
        }
    }

    /// Keys of the view; whether the section was turned on or off.
    pub fn keys(&mut self, context: &egui::Context) -> bool {
        let pressed = |key| context.input(|input| input.key_pressed(key) && !input.modifiers.command);
        if pressed(Key::F) {
            self.fit();
        }
        if pressed(Key::E) {
            self.style.edges = !self.style.edges;
        }
        if pressed(Key::G) {
            self.style.ghost = !self.style.ghost;
        }
        if pressed(Key::L) {
            self.locked = !self.locked;
        }
        if pressed(Key::O) {
            self.home.projection = match self.camera.projection {
                Projection::Perspective => Projection::Orthographic,
                Projection::Orthographic => Projection::Perspective,
            };
            self.camera.projection = self.home.projection;
        }
        if pressed(Key::Num0) {
            self.camera = self.at_start();
        }
        for (key, side) in sides(self.patient) {
            if pressed(key) {
                self.look_from(side);
            }
        }
        let cuts = pressed(Key::C);
        self.cut.on ^= cuts;
        cuts
    }

    /// Returns the place of a point on the screen; `None` behind the eye.
    pub(crate) fn to_screen(&self, point: &Vector3) -> Option<Pos2> {
        let half = 0.5 * self.rect.size();
        let [x, y] = self.camera.place(point, self.aspect())?;
        Some(self.rect.center() + vec2(half.x * x as f32, -half.y * y as f32))
    }

    /// A place of the window in the picture: x to the right and y up, from −1 to 1.
    pub(crate) fn in_picture(&self, at: Pos2) -> [f64; 2] {
        let from = at - self.rect.center();
        let [width, height] = [self.rect.width(), self.rect.height()].map(|size| size.max(1.0));
        [f64::from(2.0 * from.x / width), f64::from(-2.0 * from.y / height)]
    }

    /// Draws a pale background, so that text over a body can be read.
    pub fn card(&self, painter: &Painter, place: Rect) {
        let dark = self.style.background == Background::Dark;
        let pale = if dark { Color32::from_black_alpha(150) } else { Color32::from_white_alpha(170) };
        painter.rect_filled(place.expand(6.0), 5.0, pale);
    }

    /// Lines of text on a card, from a corner at the left on. Where the picture is narrow they are broken
    /// before the scale of colours.
    pub fn write(&self, painter: &Painter, corner: Align2, at: Pos2, lines: &[String], size: f32) {
        let scale = if self.style.range.is_some() && !self.values.is_empty() { SCALE + 20.0 } else { 12.0 };
        let room = (self.rect.right() - scale - at.x).max(100.0);
        let galley = painter.layout(lines.join("\n"), FontId::proportional(size), self.ink(), room);
        let place = corner.anchor_size(at, galley.size());
        self.card(painter, place);
        painter.galley(place.min, galley, self.ink());
    }

    /// Returns the colour of text over the picture.
    pub fn ink(&self) -> Color32 {
        let [r, g, b] = self.style.background.ink();
        Color32::from_rgb(r, g, b)
    }

    /// The scale of colours with the quantity and its unit, and the grey of parts without a value.
    pub(crate) fn draw_scale(&self, painter: &Painter, quantity: &str, unit: &str) {
        let Some([low, high]) = self.style.range.filter(|_| !self.values.is_empty()) else { return };
        let (rect, ink) = (self.rect, self.ink());
        let (unit, factor) = readable(unit, low.abs().max(high.abs()));
        let bar = Rect::from_min_max(
            rect.right_top() + vec2(-78.0, 70.0),
            Pos2::new(rect.right() - 60.0, (rect.bottom() - 60.0).max(rect.top() + 90.0)),
        );
        self.card(painter, Rect::from_min_max(bar.min - vec2(36.0, 46.0), bar.max + vec2(52.0, 54.0)));
        let right = Pos2::new(rect.right() - 12.0, bar.top() - 34.0);
        painter.text(right, Align2::RIGHT_CENTER, quantity, FontId::proportional(14.0), ink);
        if !unit.is_empty() {
            let below = right + vec2(0.0, 17.0);
            painter.text(below, Align2::RIGHT_CENTER, format!("[{unit}]"), FontId::proportional(14.0), ink);
        }
        let rows = bar.height() as usize;
        for row in 0..rows {
            let part = 1.0 - (row as f64 + 0.5) / rows as f64;
            let part = if high > low { part } else { self.style.map.part_of_one_value() };
            let [r, g, b] = self.style.map.at(part);
            let line = Rect::from_min_size(bar.min + vec2(0.0, row as f32), vec2(bar.width(), 1.5));
            painter.rect_filled(line.intersect(bar), 0.0, Color32::from_rgb(r, g, b));
        }
        for (part, text) in scale_marks([low * factor, high * factor], 6) {
            let place = Pos2::new(bar.right() + 6.0, bar.bottom() - part as f32 * bar.height());
            painter.text(place, Align2::LEFT_CENTER, text, FontId::proportional(13.0), ink);
        }
        for (text, row) in beyond([low, high], self.ends, &unit, factor).into_iter().zip(0..) {
            let place = rect.right_bottom() - vec2(12.0, 42.0 - 16.0 * row as f32);
            painter.text(place, Align2::RIGHT_CENTER, text, FontId::proportional(13.0), ink);
        }
        if self.missing {
            let place = rect.right_bottom() - vec2(12.0, 10.0);
            let text = painter.text(place, Align2::RIGHT_CENTER, NO_VALUE, FontId::proportional(13.0), ink);
            let [r, g, b] = MISSING;
            let swatch = Rect::from_center_size(text.left_center() - vec2(12.0, 0.0), vec2(12.0, 12.0));
            painter.rect_filled(swatch, 2.0, Color32::from_rgb(r, g, b));
        }
    }

    /// A ring around the place of the largest value that is seen, dashed where something hides it, and the
    /// number.
    pub(crate) fn draw_maximum(&self, painter: &Painter, unit: &str) {
        let Some([low, high]) = self.style.range.filter(|_| self.style.maximum && !self.values.is_empty())
        else {
            return;
        };
        let least = noise(unit, self.extent);
        let Some((place, value)) = self.largest.filter(|(_, value)| low < high && value.abs() >= least)
        else {
            return;
        };
        let Some(at) = self.to_screen(&place).filter(|at| self.rect.contains(*at)) else { return };
        let (unit, factor) = readable(unit, low.abs().max(high.abs()));
        let sight = Sight::new(
            &self.subject,
            &self.points,
            &self.regions,
            self.style.clip,
            &self.section,
            &self.camera,
        );
        let is_seen = sight.sees(&place);
        let ink = self.ink();
        let pale = if self.style.background == Background::Dark { Color32::BLACK } else { Color32::WHITE };
        let circle: Vec<Pos2> = (0..=48)
            .map(|part| at + RING * Vec2::angled(std::f32::consts::TAU * part as f32 / 48.0))
            .collect();
        for stroke in [Stroke::new(4.5, pale), Stroke::new(2.0, ink)] {
            if is_seen {
                painter.circle_stroke(at, RING, stroke);
            } else {
                painter.extend(egui::Shape::dashed_line(&circle, stroke, 6.0, 5.0));
            }
        }
        let text = maximum_text(value * factor, &unit, is_seen);
        let galley = painter.layout_no_wrap(text, FontId::proportional(14.0), ink);
        let beside = at + vec2(RING + 12.0, -0.5 * galley.size().y);
        let fits = beside.x + galley.size().x < self.rect.right() - SCALE;
        let left = at - vec2(RING + 12.0 + galley.size().x, 0.5 * galley.size().y);
        let text = Rect::from_min_size(if fits { beside } else { left }, galley.size());
        self.card(painter, text);
        painter.galley(text.min, galley, ink);
    }

    /// Draws the range of colours, typed in the unit of the scale. A typed range is locked. Returns the error
    /// of a range that is rejected.
    pub(crate) fn edit_range(&mut self, ui: &mut egui::Ui, unit: &str) -> Option<String> {
        let mut refused = None;
        if let Some(range) = self.style.range {
            let size = range[0].abs().max(range[1].abs());
            let (unit, factor) = readable(unit, size);
            let mut typed = range.map(|value| value * factor);
            let speed = 0.01 * (typed[1] - typed[0]).max(1e-3 * size * factor).max(1e-9);
            let changed = ui.horizontal(|ui| {
                let ends = typed.each_mut().map(|end| {
                    let number = egui::DragValue::new(end).speed(speed).max_decimals(4);
                    ui.add(number.custom_parser(typed_number))
                        .on_hover_text("an end of the range of colours")
                        .changed()
                });
                ui.label(&unit);
                ends.contains(&true)
            });
            if changed.inner {
                let [low, high] = typed;
                if low < high {
                    self.style.range = Some(typed.map(|value| value / factor));
                    self.locked = true;
                } else {
                    refused = Some(format!(
                        "the range of colours, {low} to {high} {unit}, must begin below its end; the former \
                         range stays"
                    ));
                }
            }
        }
        ui.checkbox(&mut self.locked, "Lock the range")
            .on_hover_text("L: keeps the range while values change");
        ui.checkbox(&mut self.style.maximum, "Mark the maximum")
            .on_hover_text("a ring around the largest value, dashed where something hides the place");
        refused
    }

    /// The axes and a bar of a round length in the lower left corner.
    pub(crate) fn draw_axes(&self, painter: &Painter) {
        let origin = self.rect.left_bottom() + vec2(CORNER, -CORNER);
        for (axis, along) in axes_of(&self.camera) {
            painter.arrow(origin, AXES * along, Stroke::new(2.0, COLOURS[axis]));
            let place = origin + (AXES + 9.0) * along;
            let font = FontId::proportional(13.0);
            let [far, near] = letters(axis, self.patient, along);
            painter.text(place, Align2::CENTER_CENTER, far, font.clone(), COLOURS[axis]);
            painter.text(origin - 14.0 * along, Align2::CENTER_CENTER, near, font, COLOURS[axis]);
        }
        let pixel = self.camera.height / f64::from(self.rect.height().max(1.0));
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
}

/// Returns the letters at both ends of an axis. For a patient they are sides. If the axis is short on the
/// screen, only the far one has room. Otherwise the first letter is the name of the axis.
fn letters(axis: usize, patient: bool, along: Vec2) -> [&'static str; 2] {
    let [far, near] = SIDES_OF_PATIENT[axis];
    match patient {
        true if along.length() > 0.5 => [far, near],
        true => [far, ""],
        false => [["x", "y", "z"][axis], ""],
    }
}

/// Parses a typed number. Other text gives NaN, so that it is rejected and not ignored.
pub(super) fn typed_number(text: &str) -> Option<f64> {
    let text: String = text.chars().filter(|letter| !letter.is_whitespace()).collect();
    Some(text.replace('−', "-").parse().unwrap_or(f64::NAN))
}

/// By how much the wheel turned, and a pinch.
pub(super) fn scrolled(context: &egui::Context) -> f32 {
    context.input(|input| input.smooth_scroll_delta.y + 200.0 * (input.zoom_delta() - 1.0))
}

/// The longest length [m] of 1, 2 or 5 times a power of ten that is no longer than another.
fn round_length(most: f64) -> f64 {
    let power = 10_f64.powf(most.log10().floor());
    [5.0, 2.0].map(|factor| factor * power).into_iter().find(|length| *length <= most).unwrap_or(power)
}

/// The axes as seen by a camera, the farthest first: which it is, and where it points on the screen.
fn axes_of(camera: &Camera) -> [(usize, Vec2); 3] {
    let [right, up, towards] = camera.axes();
    let unit = [Vector3::x(), Vector3::y(), Vector3::z()];
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| unit[a].dot(&towards).total_cmp(&unit[b].dot(&towards)));
    order.map(|axis| (axis, vec2(unit[axis].dot(&right) as f32, -unit[axis].dot(&up) as f32)))
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

    /// The front of a patient is seen from y, their left from −x; without a patient the front is along x.
    #[test]
    fn sides_are_those_of_the_patient() {
        let towards = |patient: bool, number: usize| {
            let (_, [azimuth, elevation]) = sides(patient)[number];
            Camera { azimuth, elevation, ..Camera::default() }.axes()[2].map(|x| (100.0 * x).round() / 100.0)
        };
        let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
        let patient = [0, 1, 2, 3, 4, 5].map(|number| towards(true, number));
        assert_eq!(patient, [y, -y, -x, x, z, -z]);
        assert_eq!([0, 1, 2, 3].map(|number| towards(false, number)), [x, -x, y, -y]);
    }

    #[test]
    fn what_is_typed_is_a_number_or_none() {
        assert_eq!([" 1 000", "−2.5", "1e3"].map(typed_number), [1000.0, -2.5, 1000.0].map(Some));
        assert!(["abc", "", "5 kPa"].into_iter().all(|text| typed_number(text).unwrap().is_nan()));
    }

    /// x goes to the right of a patient, y to the front, z to the head.
    #[test]
    fn axes_have_the_letters_of_a_patient_or_their_names() {
        let long = vec2(0.8, 0.0);
        let sides = [0, 1, 2].map(|axis| letters(axis, true, long));
        assert_eq!(sides, [["R", "L"], ["A", "P"], ["S", "I"]]);
        assert_eq!(letters(2, true, vec2(0.1, 0.0)), ["S", ""]);
        assert_eq!([0, 1, 2].map(|axis| letters(axis, false, long)[0]), ["x", "y", "z"]);
    }
}
