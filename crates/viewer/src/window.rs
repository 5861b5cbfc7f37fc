//! The window itself: what is drawn and typed. What is simulated lies behind [`Session`].

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use eframe::egui::{
    self, Align2, Color32, FontId, Key, PointerButton, Pos2, Rect, Sense, Stroke, Vec2, vec2,
};
use eframe::egui_wgpu::{Callback, CallbackResources, CallbackTrait, ScreenDescriptor};
use eframe::wgpu;
use egui_plot::{Line, Plot, PlotPoints};
use pliant_geometry::Vector3;
use pliant_picture::{
    Background, Camera, ColourMap, Drawn, Extremes, Plane, Projection, Renderer, Section, Style, Subject,
    Target, ticks,
};
use pliant_scene::format::FieldName;

use crate::hand::{Hand, pick};
use crate::session::{Frame, Order, Session, Stage};

/// What a window opens with.
pub struct Opening {
    /// The scene.
    pub stage: Stage,
    /// How it is looked at.
    pub style: Style,
    /// From where; target and height are those that fit.
    pub camera: Camera,
    /// The field that is shown, and a component of it.
    pub field: Option<FieldName>,
    /// Component of that field.
    pub component: Option<&'static str>,
    /// The file of the scene, watched for changes.
    pub file: PathBuf,
    /// Reads a scene, at the start of another one or after a change; the message of what is wrong with it.
    pub read: Arc<dyn Fn(&std::path::Path) -> Result<Stage, String> + Send + Sync>,
    /// Where what the hand did is written when the window closes or the scene starts anew.
    pub record: Option<PathBuf>,
    /// Opens, does by itself what a user would, and closes.
    pub rehearsal: Option<Rehearsal>,
}

/// What a window that tries itself does.
#[derive(Clone, Copy, Debug)]
pub struct Rehearsal {
    /// Frames that are drawn before it closes.
    pub frames: u64,
}

/// A window that could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum WindowError {
    /// Neither a screen nor a graphics processor, or no thread.
    #[error("no window can be opened: {0}")]
    Window(String),
    /// A rehearsal that went wrong.
    #[error("the window tried itself and failed: {0}")]
    Rehearsal(String),
}

impl WindowError {
    /// What to try.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Window(_) => {
                "a window needs a screen (X11 or Wayland, with libxkbcommon-x11) and Vulkan, Metal or Direct3D 12 (Debian, \
                 Ubuntu: `apt-get install mesa-vulkan-drivers libvulkan1 libxkbcommon-x11-0`); `pliant render` needs no screen"
            }
            Self::Rehearsal(_) => "",
        }
    }
}

/// Opens the window, and comes back once it is closed.
///
/// # Errors
/// If it can't be opened, or its rehearsal fails.
pub fn open(opening: Opening) -> Result<Option<String>, WindowError> {
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("Pliant")
            .with_inner_size([1280.0, 800.0])
            .with_drag_and_drop(true),
        depth_buffer: 32,
        multisampling: SAMPLES as u16,
        renderer: eframe::Renderer::Wgpu,
        ..Default::default()
    };
    let outcome = Arc::<Mutex<Option<Result<String, String>>>>::default();
    let told = outcome.clone();
    let create = Box::new(move |context: &eframe::CreationContext<'_>| {
        App::new(context, opening, told).map(|app| Box::new(app) as Box<dyn eframe::App>).map_err(Into::into)
    });
    eframe::run_native("Pliant", options, create).map_err(|error| WindowError::Window(error.to_string()))?;
    let outcome = outcome.lock().unwrap_or_else(PoisonError::into_inner).take();
    outcome.transpose().map_err(WindowError::Rehearsal)
}

const SAMPLES: u32 = 4;

/// What the paint callback draws, kept among egui's resources.
struct Stageset {
    renderer: Renderer,
    drawn: Drawn,
    section: Section,
    subject: Arc<Subject>,
}

/// One frame for the device.
struct Paint {
    points: Arc<Vec<Vector3>>,
    values: Arc<Vec<f64>>,
    camera: Camera,
    style: Style,
    aspect: f64,
    /// Set if points or values are other than at the last paint.
    fresh: bool,
}

impl CallbackTrait for Paint {
    fn prepare(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        _screen: &ScreenDescriptor,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        let Some(Stageset { renderer, drawn, section, subject }) = resources.get_mut() else {
            return Vec::new();
        };
        if self.fresh {
            drawn.set(queue, &self.points, &self.values);
        }
        if let Some(plane) = &self.style.clip {
            section.cut(subject, &self.points, &self.values, plane);
            drawn.set_section(device, queue, renderer, section);
        }
        drawn.prepare(renderer, queue, encoder, &self.camera, &self.style, self.aspect);
        Vec::new()
    }

    fn paint(
        &self,
        _info: egui::PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        resources: &CallbackResources,
    ) {
        if let Some(Stageset { renderer, drawn, .. }) = resources.get() {
            drawn.draw(renderer, pass, &self.style);
        }
    }
}

/// Points of the curves kept.
const MOST_SAMPLES: usize = 4000;

/// What is plotted: time [s], kinetic and internal energy [J], force of the hand [N].
type Sample = [f64; 4];

struct App {
    target: Target,
    stage: Stage,
    session: Session,
    subject: Arc<Subject>,
    frame: Frame,
    points: Arc<Vec<Vector3>>,
    values: Arc<Vec<f64>>,
    fresh: bool,
    camera: Camera,
    home: Camera,
    style: Style,
    /// Whether the range stays as it is.
    locked: bool,
    field: Option<FieldName>,
    component: Option<&'static str>,
    /// Where the clip plane is, as a part of the body's extent, and its axis.
    clip: (bool, f64, usize),
    stiffness: f64,
    speed: f64,
    /// Depth plane of what the hand holds: a point on it.
    holding: Option<Vector3>,
    orbiting: bool,
    help: bool,
    samples: Vec<Sample>,
    file: PathBuf,
    changed: Option<SystemTime>,
    looked: Instant,
    read: Arc<dyn Fn(&std::path::Path) -> Result<Stage, String> + Send + Sync>,
    /// A scene that is being read.
    reading: Option<std::sync::mpsc::Receiver<(PathBuf, Result<Stage, String>)>>,
    message: Option<String>,
    frame_seconds: f64,
    painted: Instant,
    rehearsal: Option<Rehearsal>,
    drawn: u64,
    record: Option<PathBuf>,
    outcome: Arc<Mutex<Option<Result<String, String>>>>,
}

impl App {
    fn new(
        context: &eframe::CreationContext<'_>,
        opening: Opening,
        outcome: Arc<Mutex<Option<Result<String, String>>>>,
    ) -> Result<Self, String> {
        let state = context.wgpu_render_state.as_ref().ok_or("wgpu did not start")?;
        let target = Target {
            format: state.target_format,
            depth: wgpu::TextureFormat::Depth32Float,
            samples: SAMPLES,
        };
        context.egui_ctx.set_visuals(egui::Visuals::light());
        let Opening { stage, style, camera, field, component, file, read, record, rehearsal } = opening;
        let (session, subject) = begin(&stage, &context.egui_ctx)?;
        place(state, target, &subject);
        let mut app = Self {
            target,
            session,
            frame: Frame { points: subject.points.clone(), ..Frame::default() },
            points: Arc::new(subject.points.clone()),
            values: Arc::default(),
            fresh: true,
            subject,
            stage,
            home: camera,
            camera,
            locked: style.range.is_some(),
            style: Style { background: Background::Light, ..style },
            field,
            component,
            clip: (style.clip.is_some(), 0.5, 0),
            stiffness: 200.0,
            speed: 1.0,
            holding: None,
            orbiting: false,
            help: false,
            samples: Vec::new(),
            changed: modified(&file),
            file,
            looked: Instant::now(),
            read,
            reading: None,
            message: None,
            frame_seconds: 0.0,
            painted: Instant::now(),
            rehearsal,
            drawn: 0,
            record,
            outcome,
        };
        app.fit();
        Ok(app)
    }

    fn fit(&mut self) {
        self.camera = self.home;
        let surface = self.subject.surface_points();
        self.camera.fit(surface.iter().map(|&point| &self.points[point as usize]), 1.3);
    }

    /// Takes the newest instant.
    fn look(&mut self) {
        let (new, frame) = self.session.look();
        if !new {
            return;
        }
        // After a failure at the first instant there is nothing but the message.
        if frame.points.len() == self.subject.points.len() {
            Arc::make_mut(&mut self.points).clone_from(&frame.points);
            Arc::make_mut(&mut self.values).clone_from(&frame.values);
            self.fresh = true;
        }
        self.frame = frame.clone();
        if !self.locked {
            let mut extremes = Extremes::default();
            extremes.add(
                self.subject.surface_points().iter().filter_map(|&p| self.values.get(p as usize)).copied(),
            );
            self.style.range = extremes.range();
        }
        let force = self.frame.held.first().map_or(0.0, |[_, force]| Vector3::from(*force).norm());
        let last = self.samples.last().map_or(-1.0, |sample| sample[0]);
        if self.frame.time < last {
            self.samples.clear();
        }
        if self.frame.time > last {
            let energies = &self.frame.energies;
            self.samples.push([self.frame.time, energies.kinetic, energies.internal, force]);
            // Every second one goes, so that memory stays flat and the curve whole.
            if self.samples.len() > MOST_SAMPLES {
                let mut index = 0;
                self.samples.retain(|_| {
                    index += 1;
                    index % 2 == 0
                });
            }
        }
    }

    fn order(&self, order: Order) {
        self.session.order(order);
    }

    fn act(&mut self, hand: Hand) {
        self.order(Order::Hand(hand));
    }

    /// Reads the scene anew after a change of its file, or another one that was dropped.
    fn watch(&mut self, context: &egui::Context) {
        let dropped =
            context.input(|input| input.raw.dropped_files.first().map(|file| file.path().to_owned()));
        if let Some(path) = dropped {
            self.begin_reading(path, context);
        } else if self.looked.elapsed() > Duration::from_millis(500) && self.reading.is_none() {
            self.looked = Instant::now();
            let now = modified(&self.file);
            if now.is_some() && now != self.changed {
                self.changed = now;
                self.begin_reading(self.file.clone(), context);
            }
        }
        let Some(Ok((path, read))) = self.reading.as_ref().map(|reading| reading.try_recv()) else { return };
        self.reading = None;
        match read {
            Ok(stage) => self.message = self.replace(path, stage, context).err(),
            Err(message) => self.message = Some(message),
        }
    }

    fn begin_reading(&mut self, path: PathBuf, context: &egui::Context) {
        let (send, receive) = std::sync::mpsc::channel();
        let (read, context) = (self.read.clone(), context.clone());
        let work = move || {
            let result = read(&path);
            // The window may be closed by now.
            let _ = send.send((path, result));
            context.request_repaint();
        };
        self.message = Some("reading the scene …".into());
        match std::thread::Builder::new().name("reader".into()).spawn(work) {
            Ok(_) => self.reading = Some(receive),
            Err(error) => self.message = Some(error.to_string()),
        }
    }

    fn replace(&mut self, path: PathBuf, stage: Stage, context: &egui::Context) -> Result<(), String> {
        let (session, subject) = begin(&stage, context)?;
        self.session = session;
        self.points = Arc::new(subject.points.clone());
        self.values = Arc::default();
        let other = path != self.file;
        self.subject = subject;
        self.stage = stage;
        self.changed = modified(&path);
        self.file = path;
        self.samples.clear();
        self.holding = None;
        if other {
            self.fit();
        }
        self.fresh = true;
        self.session.order(Order::Show(self.field, self.component));
        self.session.order(Order::Speed(self.speed));
        Err(REPLACED.into())
    }

    fn plane(&self) -> Option<Plane> {
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

    fn keys(&mut self, context: &egui::Context) {
        if context.egui_wants_keyboard_input() {
            return;
        }
        let pressed = |key| context.input(|input| input.key_pressed(key));
        if pressed(Key::Space) {
            self.order(Order::Play(!self.frame.playing));
        }
        if pressed(Key::Period) {
            self.order(Order::Step(1));
        }
        if pressed(Key::R) {
            self.reset();
        }
        if pressed(Key::F) {
            self.fit();
        }
        if pressed(Key::E) {
            self.style.edges = !self.style.edges;
        }
        if pressed(Key::G) {
            self.style.ghost = !self.style.ghost;
        }
        if pressed(Key::C) {
            self.clip.0 = !self.clip.0;
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
        if pressed(Key::H) {
            self.help = !self.help;
        }
    }

    fn reset(&mut self) {
        self.holding = None;
        self.samples.clear();
        self.order(Order::Reset);
    }

    fn top(&mut self, ui: &mut egui::Ui) {
        ui.horizontal(|ui| {
            let word = if self.frame.playing { "Pause" } else { "Play" };
            if ui.button(word).on_hover_text("Space").clicked() {
                self.order(Order::Play(!self.frame.playing));
            }
            if ui.button("Step").on_hover_text(".").clicked() {
                self.order(Order::Step(1));
            }
            if ui.button("Reset").on_hover_text("R").clicked() {
                self.reset();
            }
            ui.separator();
            let speed = egui::Slider::new(&mut self.speed, 0.01..=10.0).logarithmic(true).text("× real time");
            if ui.add(speed).changed() {
                self.order(Order::Speed(self.speed));
            }
            ui.separator();
            if ui.button("Fit").on_hover_text("F").clicked() {
                self.fit();
            }
            if ui.selectable_label(self.help, "Keys").on_hover_text("H").clicked() {
                self.help = !self.help;
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                ui.label(&self.stage.scene.scene.title);
            });
        });
    }

    fn side(&mut self, ui: &mut egui::Ui) {
        ui.heading("Colours");
        let before = (self.field, self.component);
        let name = |field: Option<FieldName>| field.map_or("tissue", FieldName::title);
        egui::ComboBox::from_id_salt("field").selected_text(name(self.field)).width(180.0).show_ui(
            ui,
            |ui| {
                ui.selectable_value(&mut self.field, None, name(None));
                for field in self.fields() {
                    ui.selectable_value(&mut self.field, Some(field), name(Some(field)));
                }
            },
        );
        let components: &[&str] = match self.field.map_or(1, FieldName::components) {
            3 => &["size", "x", "y", "z"],
            9 => &["xx", "yy", "zz", "xy", "yz", "xz"],
            _ => &[],
        };
        if before.0 != self.field {
            self.component = (components.first() == Some(&"xx")).then_some("xx");
            self.locked = false;
        }
        if !components.is_empty() {
            ui.horizontal_wrapped(|ui| {
                for &component in components {
                    let value = (component != "size").then_some(component);
                    ui.selectable_value(&mut self.component, value, component);
                }
            });
        }
        if before != (self.field, self.component) {
            self.order(Order::Show(self.field, self.component));
        }
        egui::ComboBox::from_id_salt("map").selected_text(self.style.map.name()).width(180.0).show_ui(
            ui,
            |ui| {
                for map in ColourMap::ALL {
                    ui.selectable_value(&mut self.style.map, map, map.name());
                }
            },
        );
        ui.checkbox(&mut self.locked, "Lock the range").on_hover_text("L");
        ui.separator();
        ui.heading("Shape");
        ui.checkbox(&mut self.style.edges, "Edges of the elements").on_hover_text("E");
        ui.checkbox(&mut self.style.ghost, "Shape at rest").on_hover_text("G");
        ui.checkbox(&mut self.clip.0, "Section").on_hover_text("C");
        if self.clip.0 {
            ui.horizontal(|ui| {
                for (axis, word) in ["x", "y", "z"].into_iter().enumerate() {
                    ui.selectable_value(&mut self.clip.2, axis, word);
                }
            });
            ui.add(egui::Slider::new(&mut self.clip.1, 0.0..=1.0).show_value(false));
        }
        ui.separator();
        ui.heading("Hand");
        ui.add(egui::Slider::new(&mut self.stiffness, 1.0..=5000.0).logarithmic(true).text("N/m"));
        let force = self.frame.held.first().filter(|_| self.holding.is_some());
        ui.label(match force {
            Some([_, force]) => format!("pulls with {:.3} N", Vector3::from(*force).norm()),
            None => "drag the body to pull it".into(),
        });
        let pins = self.frame.held.len() - usize::from(force.is_some());
        if pins > 0 && ui.button(format!("Remove {pins} pins")).clicked() {
            for pin in (0..pins).rev() {
                self.act(Hand::Unpin(pin));
            }
        }
    }

    /// The fields that bodies of the scene have.
    fn fields(&self) -> Vec<FieldName> {
        let on = self.stage.scene.view.on.as_ref();
        let bodies = self.stage.scene.bodies.iter().filter(|(name, _)| on.is_none_or(|on| on == name));
        let models: Vec<_> = bodies.map(|(_, body)| body.model).collect();
        let all = FieldName::ALL.into_iter();
        if models.is_empty() {
            return vec![FieldName::Displacement];
        }
        all.filter(|field| models.iter().any(|&model| field.is_of(model))).collect()
    }

    fn plots(&self, ui: &mut egui::Ui) {
        let curve =
            |column: usize| -> PlotPoints<'_> { self.samples.iter().map(|s| [s[0], s[column]]).collect() };
        ui.columns(2, |columns| {
            Plot::new("energies").height(130.0).legend(egui_plot::Legend::default()).show(
                &mut columns[0],
                |plot| {
                    plot.line(Line::new("kinetic energy [J]", curve(1)));
                    plot.line(Line::new("internal energy [J]", curve(2)));
                },
            );
            Plot::new("hand").height(130.0).legend(egui_plot::Legend::default()).show(
                &mut columns[1],
                |plot| {
                    plot.line(Line::new("force of the hand [N]", curve(3)));
                },
            );
        });
    }

    fn scene(&mut self, ui: &mut egui::Ui) {
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
    fn hit(&self, place: [f64; 2], aspect: f64) -> Option<(crate::hand::Point, Vector3)> {
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
        let banner = frame.failure.clone().or_else(|| self.message.clone()).or_else(|| notes.last());
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

    /// Does what a user would: plays, pulls at the middle of the picture, lets go, closes.
    fn rehearse(&mut self, context: &egui::Context) {
        let Some(Rehearsal { frames }) = self.rehearsal else { return };
        context.request_repaint();
        self.drawn += 1;
        match self.drawn {
            1 => self.order(Order::Play(true)),
            2 => match self.hit([0.0, 0.0], 1.3) {
                Some((point, at)) => {
                    self.holding = Some(at);
                    self.act(Hand::Take(point, self.stiffness));
                    let by = 0.1 * self.camera.height;
                    self.act(Hand::Pull((at + self.camera.axes()[1] * by).into()));
                }
                None => self.tell(Err("nothing lies under the middle of the picture".into())),
            },
            drawn if drawn >= frames => {
                let lag = self.frame.input_lag.map_or("none".into(), |lag| format!("{:.2} ms", 1e3 * lag));
                let force = self.frame.held.first().map_or(0.0, |[_, force]| Vector3::from(*force).norm());
                let told = match &self.frame.failure {
                    Some(failure) => Err(failure.clone()),
                    None if self.frame.steps == 0 => Err("the solver took no step".into()),
                    None if force <= 0.0 => Err("the hand does not pull".into()),
                    None => Ok(format!(
                        "{drawn} frames drawn, {} steps, the hand pulls with {force:.3} N, input lag {lag}",
                        self.frame.steps
                    )),
                };
                self.tell(told);
                context.send_viewport_cmd(egui::ViewportCommand::Close);
            }
            _ => {}
        }
    }

    fn tell(&self, told: Result<String, String>) {
        self.outcome.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(told);
    }
}

/// What is told after a scene was read anew.
const REPLACED: &str = "the scene was read anew";
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

impl eframe::App for App {
    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        let context = ui.ctx().clone();
        let painted = std::mem::replace(&mut self.painted, Instant::now());
        self.frame_seconds = 0.8 * self.frame_seconds + 0.2 * painted.elapsed().as_secs_f64();
        let before = Arc::as_ptr(&self.subject);
        self.watch(&context);
        if before != Arc::as_ptr(&self.subject)
            && let Some(state) = frame.wgpu_render_state()
        {
            place(state, self.target, &self.subject);
        }
        self.look();
        self.keys(&context);
        egui::Panel::top("top").show(ui, |ui| self.top(ui));
        egui::Panel::right("side").default_size(220.0).show(ui, |ui| self.side(ui));
        egui::Panel::bottom("plots").show(ui, |ui| self.plots(ui));
        egui::CentralPanel::default().frame(egui::Frame::NONE).show(ui, |ui| self.scene(ui));
        self.rehearse(&context);
        context.request_repaint_after(Duration::from_millis(250));
    }

    fn on_exit(&mut self) {
        let (Some(path), Some(recording)) = (&self.record, self.session.end()) else { return };
        let written =
            recording.to_bytes().and_then(|bytes| std::fs::write(path, bytes).map_err(|e| e.to_string()));
        if let Err(reason) = written {
            eprintln!("error: `{}` cannot be written: {reason}", path.display());
        }
    }
}

/// Starts to play a scene, and what is drawn of it.
fn begin(stage: &Stage, context: &egui::Context) -> Result<(Session, Arc<Subject>), String> {
    let mut live =
        pliant_scene::live(&stage.scene, &stage.built, &stage.plan).map_err(|failure| failure.message)?;
    let subject = Arc::new(Subject::new(live.mesh().map_err(|failure| failure.message)?));
    drop(live);
    let context = context.clone();
    let session = Session::start(stage.clone(), move || context.request_repaint());
    Ok((session.map_err(|error| error.to_string())?, subject))
}

/// Brings what is drawn to the device.
fn place(state: &eframe::egui_wgpu::RenderState, target: Target, subject: &Arc<Subject>) {
    let renderer = Renderer::new(&state.device, target);
    let drawn = Drawn::new(&state.device, &renderer, subject);
    let stageset = Stageset { renderer, drawn, section: Section::default(), subject: subject.clone() };
    state.renderer.write().callback_resources.insert(stageset);
}

fn modified(path: &std::path::Path) -> Option<SystemTime> {
    std::fs::metadata(path).ok()?.modified().ok()
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
