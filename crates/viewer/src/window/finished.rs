//! The window of a finished run: its frames over a timeline. A thread reads the frame that was asked for
//! last. Frames that cannot be read in time are left out.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};

use eframe::egui::{self, Align2, Key, PointerButton, vec2};
use eframe::egui_wgpu::WgpuConfiguration;
use pliant_format::tables::FieldName;
use pliant_geometry::{CellKind, Mesh, RegionNames, Vector3};
use pliant_picture::{
    ColourMap, Look, Outermost, Series, SeriesError, Style, Subject, Texture, deformed_points, field_choices,
    nodal_values,
};

use super::NARROW;
use super::bodies::Listed;
use super::keep::Taking;
use super::panels::{SPEED, make_room};
use super::told::{Told, tell};
use super::viewport::{OCCLUSION, Viewport};
use super::{Outcome, WindowError, run_window};

/// A finished run to be looked at.
#[derive(Clone, Debug)]
pub struct FinishedRun {
    /// The folder of its series.
    pub folder: PathBuf,
    /// The series that is shown at first; without, the first in alphabetical order.
    pub series: Option<String>,
    /// Takes a picture of the window at an instant [s] of the run, and closes.
    pub portrait: Option<(f64, PathBuf)>,
    /// Width and height of the window at its start, in pixels of a screen at 100 %.
    pub size: [u32; 2],
}

/// Opens the window of a finished run, and comes back once it is closed.
///
/// # Errors
/// If it can't be opened, or the run has no such series.
pub fn open_finished(run: FinishedRun) -> Result<Option<String>, WindowError> {
    let unreadable =
        |error: SeriesError| WindowError::Run { message: error.to_string(), remedy: error.remedy() };
    let names = Series::names(&run.folder).map_err(unreadable)?;
    let series = Series::find(&run.folder, run.series.as_deref()).map_err(unreadable)?;
    run_window(WgpuConfiguration::default(), run.size, move |context, outcome| {
        Finished::new(context, run, names, series, outcome)
    })
}

/// Request to the reader.
#[derive(Clone, Debug, PartialEq)]
struct Asked {
    file: PathBuf,
    /// The field with its component.
    field: Option<String>,
}

/// A frame that was read.
struct Loaded {
    asked: Asked,
    /// The body and the names of its regions, where it is another one than in the frame before.
    subject: Option<(Arc<Subject>, RegionNames)>,
    points: Vec<Vector3>,
    values: Vec<f64>,
    /// Fields that colours can show.
    choices: Vec<String>,
}

/// Number of points and cells of a mesh. Frames of the same shape share their subject.
type Shape = (usize, Vec<(CellKind, usize)>);

/// Reads the newest requested frame, until the requests or the receiver end.
fn read_frames(asked: &Receiver<Asked>, found: &Sender<Result<Loaded, String>>, wake: &dyn Fn()) {
    let mut shape: Option<Shape> = None;
    while let Ok(mut wanted) = asked.recv() {
        wanted = asked.try_iter().last().unwrap_or(wanted);
        let loaded = match pliant_geometry::io::read(&wanted.file) {
            Ok(file) => Ok(loaded(&file.mesh, wanted, &mut shape)),
            Err(error) => Err(error.to_string()),
        };
        if found.send(loaded).is_err() {
            return;
        }
        wake();
    }
}

/// Finds the outermost points of all frames. Each frame is read once.
fn survey(series: &Series, context: &egui::Context) -> Result<Receiver<Vec<Vector3>>, String> {
    let (send, receive) = channel();
    let (frames, context) = (series.frames.clone(), context.clone());
    let work = move || {
        let mut outermost = Outermost::default();
        // The message about an unreadable frame appears when it is shown.
        let meshes = frames.iter().filter_map(|(_, file)| pliant_geometry::io::read(file).ok());
        meshes.for_each(|file| outermost.add(deformed_points(&file.mesh)));
        // Another series may be shown by now.
        let _ = send.send(outermost.points().to_vec());
        context.request_repaint();
    };
    let thread = std::thread::Builder::new().name("survey".into()).spawn(work);
    thread.map(|_| receive).map_err(|error| error.to_string())
}

fn loaded(mesh: &Mesh, asked: Asked, before: &mut Option<Shape>) -> Loaded {
    let shape = (mesh.points.len(), mesh.blocks.iter().map(|block| (block.kind, block.len())).collect());
    let renewed = before.as_ref() != Some(&shape);
    *before = Some(shape);
    Loaded {
        subject: renewed.then(|| (Arc::new(Subject::new(mesh)), RegionNames::of(mesh))),
        points: deformed_points(mesh),
        values: asked.field.as_deref().and_then(|field| nodal_values(mesh, field)).unwrap_or_default(),
        choices: field_choices(mesh),
        asked,
    }
}

/// A field with its component in words, and its unit.
fn words(field: &str) -> (String, &'static str) {
    let (name, part) = field.split_once(':').map_or((field, None), |(name, part)| (name, Some(part)));
    let part = part.map(|part| format!(" {part}")).unwrap_or_default();
    match FieldName::of_name(name) {
        Some(known) => (format!("{}{part}", known.title()), known.unit()),
        None => (format!("{name}{part}"), ""),
    }
}

/// Current instant on the timeline of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Timeline {
    /// The instant [s], and the first and the last one.
    at: f64,
    ends: [f64; 2],
    playing: bool,
    looped: bool,
    /// Seconds of the run a second.
    speed: f64,
}

impl Timeline {
    fn of(series: &Series) -> Self {
        let times = series.frames.iter().map(|(time, _)| *time);
        let ends = times.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], t| [low.min(t), high.max(t)]);
        Self { at: ends[0], ends, playing: false, looped: true, speed: 1.0 }
    }

    /// Advances by some wall time [s]. At the end the timeline starts again or stops.
    fn go_on(&mut self, wall: f64) {
        if !self.playing {
            return;
        }
        self.at += self.speed * wall;
        let [first, last] = self.ends;
        if self.at > last {
            let length = last - first;
            self.playing = self.looped && length > 0.0;
            self.at = if self.playing { first + (self.at - last) % length } else { last };
        }
    }

    fn play(&mut self) {
        self.playing = !self.playing;
        if self.playing && self.at >= self.ends[1] {
            self.at = self.ends[0];
        }
    }

    /// The frame nearest to the instant.
    fn frame(&self, series: &Series) -> usize {
        let away = |index: &usize| (series.frames[*index].0 - self.at).abs();
        (0..series.frames.len()).min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(0)
    }
}

struct Finished {
    port: Viewport,
    run: FinishedRun,
    names: Vec<String>,
    series: Series,
    timeline: Timeline,
    field: Option<String>,
    choices: Vec<String>,
    listed: Listed,
    asks: Sender<Asked>,
    found: Receiver<Result<Loaded, String>>,
    /// Points that the frames reach, once all are read; `None` after that.
    surveyed: Option<Receiver<Vec<Vector3>>>,
    /// Last request, and the request that is shown.
    asked: Option<Asked>,
    shown: Option<Asked>,
    message: Option<Told>,
    taking: Taking,
    painted: Instant,
    /// Frames drawn since the one of the portrait was shown.
    posed: u32,
    outcome: Outcome,
}

impl Finished {
    fn new(
        context: &eframe::CreationContext<'_>,
        run: FinishedRun,
        names: Vec<String>,
        series: Series,
        outcome: Outcome,
    ) -> Result<Self, String> {
        let style = Style { maximum: true, ..Style::default() };
        let port = Viewport::new(context, &Look { style, ..Look::default() })?;
        let ((asks, asked), (found, receive)) = (channel(), channel());
        let woken = context.egui_ctx.clone();
        let work = move || read_frames(&asked, &found, &|| woken.request_repaint());
        std::thread::Builder::new().name("frames".into()).spawn(work).map_err(|error| error.to_string())?;
        context.egui_ctx.set_visuals(egui::Visuals::light());
        let surveyed = survey(&series, &context.egui_ctx)?;
        let field = series.first_field(&["von-mises", "displacement"]).ok().flatten().map(str::to_owned);
        let mut timeline = Timeline::of(&series);
        match &run.portrait {
            Some((at, _)) => timeline.at = at.clamp(timeline.ends[0], timeline.ends[1]),
            None => timeline.playing = series.frames.len() > 1,
        }
        Ok(Self {
            port,
            run,
            names,
            series,
            timeline,
            field,
            choices: Vec::new(),
            listed: Listed::default(),
            asks,
            found: receive,
            surveyed: Some(surveyed),
            asked: None,
            shown: None,
            message: None,
            taking: Taking::default(),
            painted: Instant::now(),
            posed: 0,
            outcome,
        })
    }

    /// Asks for the frame of the instant, and shows what was read.
    fn load(&mut self) {
        let file = self.series.frames[self.timeline.frame(&self.series)].1.clone();
        let asked = Asked { file, field: self.field.clone().filter(|field| field != "label") };
        if self.asked.as_ref() != Some(&asked) {
            self.asked = Some(asked.clone());
            // The reader lives as long as the window.
            let _ = self.asks.send(asked);
        }
        while let Ok(found) = self.found.try_recv() {
            match found {
                Ok(loaded) => self.show(loaded),
                Err(message) => self.message = Some(Told::failure(message)),
            }
        }
        if let Some(Ok(reach)) = self.surveyed.as_ref().map(Receiver::try_recv) {
            self.port.learn(Arc::new(reach));
            self.surveyed = None;
        }
    }

    fn show(&mut self, loaded: Loaded) {
        let first = self.port.subject.points.is_empty();
        if let Some((subject, names)) = loaded.subject {
            self.port.renew(&subject);
            self.listed.names = names;
        }
        self.port.set(&loaded.points, &loaded.values);
        if first {
            self.port.fit();
        }
        let other = self.shown.as_ref().is_none_or(|shown| shown.field != loaded.asked.field);
        let unit = loaded.asked.field.as_deref().map_or("", |field| words(field).1);
        let seen = self.port.range_seen(unit);
        if !self.port.locked {
            // The range grows over the frames that were seen, so that colours mean the same in each.
            let before = self.port.style.range.filter(|_| !other);
            self.port.style.range = match (before, seen) {
                (Some([low, high]), Some(seen)) => Some([low.min(seen[0]), high.max(seen[1])]),
                (before, seen) => seen.or(before),
            };
        }
        self.choices = loaded.choices;
        self.shown = Some(loaded.asked);
    }

    /// Moves by a number of frames.
    fn step(&mut self, by: isize) {
        let last = self.series.frames.len() - 1;
        let frame = self.timeline.frame(&self.series).saturating_add_signed(by).min(last);
        (self.timeline.at, self.timeline.playing) = (self.series.frames[frame].0, false);
    }

    fn keys(&mut self, context: &egui::Context) {
        if context.egui_wants_keyboard_input() {
            return;
        }
        let pressed = |key| context.input(|input| input.key_pressed(key));
        if pressed(Key::Space) {
            self.timeline.play();
        }
        for (key, by) in
            [(Key::ArrowLeft, -1), (Key::ArrowRight, 1), (Key::Home, isize::MIN), (Key::End, isize::MAX)]
        {
            if pressed(key) {
                self.step(by);
            }
        }
        self.port.keys(context);
    }

    fn top(&mut self, ui: &mut egui::Ui) {
        ui.horizontal_wrapped(|ui| {
            let word = if self.timeline.playing { "Pause" } else { "Play" };
            if ui.button(word).on_hover_text("Space").clicked() {
                self.timeline.play();
            }
            let steps = [("|<", "Home: the first frame", isize::MIN), ("<", "←: one frame back", -1)];
            let steps = steps
                .into_iter()
                .chain([(">", "→: one frame forward", 1), (">|", "End: the last frame", isize::MAX)]);
            for (word, does, by) in steps {
                if ui.button(word).on_hover_text(does).clicked() {
                    self.step(by);
                }
            }
            ui.checkbox(&mut self.timeline.looped, "Loop").on_hover_text("starts again at the end");
            make_room(ui, SPEED);
            let speed = egui::Slider::new(&mut self.timeline.speed, 0.01..=100.0).logarithmic(true);
            ui.add(speed.text("× real time"));
            ui.separator();
            if ui.button("Fit").on_hover_text("F").clicked() {
                self.port.fit();
            }
            if ui
                .button("Picture")
                .on_hover_text("writes the picture into the folder of the run, as PNG")
                .clicked()
            {
                self.taking.ask(ui.ctx());
            }
            ui.label(self.run.folder.display().to_string());
        });
    }

    fn side(&mut self, ui: &mut egui::Ui) {
        ui.heading("Colours");
        if self.names.len() > 1 {
            let before = self.series.name.clone();
            let mut name = before.clone();
            egui::ComboBox::from_id_salt("series").selected_text(&name).width(180.0).show_ui(ui, |ui| {
                for other in &self.names {
                    ui.selectable_value(&mut name, other.clone(), other);
                }
            });
            if name != before {
                self.take_series(&name, ui.ctx());
            }
        }
        let word = |field: &Option<String>| field.as_deref().map_or("tissue".into(), |field| words(field).0);
        let selected = word(&self.field);
        egui::ComboBox::from_id_salt("field").selected_text(selected).width(180.0).show_ui(ui, |ui| {
            let choices = std::iter::once(None).chain(self.choices.iter().cloned().map(Some));
            for other in choices {
                let word = word(&other);
                ui.selectable_value(&mut self.field, other, word);
            }
        });
        let style = &mut self.port.style;
        egui::ComboBox::from_id_salt("map").selected_text(style.map.name()).width(180.0).show_ui(ui, |ui| {
            for map in ColourMap::ALL {
                ui.selectable_value(&mut style.map, map, map.name());
            }
        });
        let unit = self.field.as_deref().map_or("", |field| words(field).1);
        if let Some(reason) = self.port.edit_range(ui, unit) {
            self.message = Some(Told::failure(reason));
        }
        ui.separator();
        ui.heading("Bodies");
        self.port.regions = self.listed.edit(ui);
        ui.separator();
        ui.heading("Shape");
        let style = &mut self.port.style;
        ui.checkbox(&mut style.edges, "Edges of the elements").on_hover_text("E");
        ui.checkbox(&mut style.ghost, "Shape at rest").on_hover_text("G");
        ui.checkbox(&mut style.wireframe, "Wireframe").on_hover_text("only the edges of the elements");
        let mut skin = style.texture == Texture::Skin;
        ui.checkbox(&mut skin, "Skin").on_hover_text("moist tissue");
        ui.checkbox(&mut style.occlusion, "Occlusion").on_hover_text(OCCLUSION);
        style.texture = if skin { Texture::Skin } else { Texture::None };
        self.port.cut.edit(ui, self.port.style.clip);
    }

    /// Shows another series of the run, at the same instant.
    fn take_series(&mut self, name: &str, context: &egui::Context) {
        let found = Series::find(&self.run.folder, Some(name)).map_err(|error| error.to_string());
        match found.and_then(|series| Ok((survey(&series, context)?, series))) {
            Ok((surveyed, series)) => {
                self.surveyed = Some(surveyed);
                let timeline = Timeline::of(&series);
                let at = self.timeline.at.clamp(timeline.ends[0], timeline.ends[1]);
                self.timeline = Timeline { at, ends: timeline.ends, ..self.timeline };
                self.series = series;
                self.shown = None;
            }
            Err(error) => self.message = Some(Told::failure(error)),
        }
    }

    fn scene(&mut self, ui: &mut egui::Ui) {
        let response = self.port.lay_out(ui);
        let rect = response.rect;
        self.port.turn(ui.ctx(), &response, response.dragged_by(PointerButton::Primary));
        let labels = self.field.as_deref() == Some("label");
        self.port.paint(ui.painter(), labels, None, None);
        let painter = ui.painter_at(rect);
        self.port.draw_axes(&painter);
        if let Some(field) = self.field.as_deref().filter(|_| !labels) {
            let (quantity, unit) = words(field);
            self.port.draw_maximum(&painter, unit);
            self.port.draw_scale(&painter, &quantity, unit);
        }
        let frame = self.timeline.frame(&self.series);
        let (time, _) = self.series.frames[frame];
        let lines =
            [format!("t = {time:.4} s"), format!("frame {} of {}", frame + 1, self.series.frames.len())];
        self.port.write(&painter, Align2::LEFT_TOP, rect.min + vec2(12.0, 10.0), &lines, 14.0);
    }

    /// The slider over all instants.
    fn time(&mut self, ui: &mut egui::Ui) {
        let [first, last] = self.timeline.ends;
        ui.horizontal(|ui| {
            ui.spacing_mut().slider_width = (ui.available_width() - 120.0).max(60.0);
            let slider =
                egui::Slider::new(&mut self.timeline.at, first..=last.max(first + f64::MIN_POSITIVE));
            let slider = ui.add(slider.suffix(" s").max_decimals(4));
            if slider.dragged() {
                self.timeline.playing = false;
            }
        });
    }

    /// Takes the portrait once its frame is shown; then closes.
    fn pose(&mut self, context: &egui::Context) {
        let Some((_, file)) = &self.run.portrait else {
            let beside = self.run.folder.join(&self.series.name);
            let taken = self.taking.keep(context, self.port.rect, &beside);
            self.message = taken.or_else(|| self.message.take());
            return;
        };
        context.request_repaint();
        let failed = self.message.as_ref().map(|message| Err(message.text.clone()));
        let is_there = self.shown.is_some() && self.shown == self.asked && self.surveyed.is_none();
        self.posed += u32::from(is_there);
        if self.posed == 10 {
            self.taking.ask(context);
        }
        let message = format!("{} at t = {:.3} s", self.run.folder.display(), self.timeline.at);
        let taken = self.taking.write(file).map(|written| written.map(|()| message));
        if let Some(outcome) = failed.or(taken) {
            *self.outcome.lock().unwrap_or_else(PoisonError::into_inner) = Some(outcome);
            context.send_viewport_cmd(egui::ViewportCommand::Close);
        }
    }
}

impl eframe::App for Finished {
    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        let context = ui.ctx().clone();
        let painted = std::mem::replace(&mut self.painted, Instant::now());
        self.timeline.go_on(painted.elapsed().as_secs_f64());
        self.keys(&context);
        self.load();
        self.port.bring(frame);
        egui::Panel::top("top").show(ui, |ui| self.top(ui));
        if ui.available_width() > NARROW {
            egui::Panel::right("side").default_size(220.0).show(ui, |ui| self.side(ui));
        }
        if tell(ui, self.message.as_ref()) {
            self.message = None;
        }
        egui::Panel::bottom("time").show(ui, |ui| self.time(ui));
        egui::CentralPanel::default().frame(egui::Frame::NONE).show(ui, |ui| self.scene(ui));
        self.pose(&context);
        let pause = if self.timeline.playing { Duration::ZERO } else { Duration::from_millis(250) };
        context.request_repaint_after(pause);
    }
}

#[cfg(test)]
mod tests {
    use pliant_geometry::DataArray;

    use super::*;

    fn series() -> Series {
        let frames = [0.0, 0.1, 0.4].map(|time| (time, PathBuf::new())).to_vec();
        Series { name: "fields".into(), frames }
    }

    #[test]
    fn a_timeline_plays_loops_stops_and_finds_the_nearest_frame() {
        let series = series();
        let mut timeline = Timeline { playing: true, ..Timeline::of(&series) };
        timeline.go_on(0.2);
        assert_eq!((timeline.at, timeline.frame(&series)), (0.2, 1));
        timeline.go_on(0.06);
        assert_eq!(timeline.frame(&series), 2);
        timeline.go_on(0.2);
        assert!((timeline.at - 0.06).abs() < 1e-12 && timeline.playing, "it starts again");
        timeline = Timeline { looped: false, ..timeline };
        timeline.go_on(9.0);
        assert_eq!((timeline.at, timeline.playing), (0.4, false));
        timeline.play();
        assert_eq!((timeline.at, timeline.playing), (0.0, true), "at the end, play means from the start");
        timeline = Timeline { speed: 0.5, ..timeline };
        timeline.go_on(0.2);
        assert_eq!(timeline.at, 0.1);
    }

    #[test]
    fn a_survey_knows_the_places_of_all_frames() {
        let folder = tempfile::tempdir().unwrap();
        let frames = [0.0, 3.0].map(|moved| {
            let mut mesh = Mesh { points: vec![Vector3::zeros(), Vector3::x()], ..Mesh::default() };
            let values = vec![moved, 0.0, 0.0, 0.0, moved, 0.0];
            mesh.point_data.insert("displacement".into(), DataArray { components: 3, values });
            mesh.block_mut(CellKind::Line).nodes.extend([0, 1]);
            let file = folder.path().join(format!("{moved}.vtu"));
            pliant_geometry::io::write(&file, &mesh).unwrap();
            (moved, file)
        });
        let series = Series { name: "fields".into(), frames: frames.to_vec() };
        let reach = survey(&series, &egui::Context::default()).unwrap().recv().unwrap();
        let moved = Vector3::new(1.0, 3.0, 0.0);
        assert_eq!(reach, [Vector3::zeros(), Vector3::x(), Vector3::x() * 3.0, moved]);
    }

    #[test]
    fn fields_have_words_and_those_of_others_their_name() {
        assert_eq!(words("displacement:z"), ("displacement z".into(), "m"));
        assert_eq!(words("temperature"), ("temperature".into(), ""));
    }
}
