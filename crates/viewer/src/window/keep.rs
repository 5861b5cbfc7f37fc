//! Results that a user can save: a picture, the view as the table `[view]` of a scene, and the scene with the
//! changed numbers.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use eframe::egui::{self, ColorImage, Pos2, Rect, vec2};
use pliant_format::diagnostic::Place;
use pliant_format::source::{Source, Value};
use pliant_format::tables::{Choice, ColourBy, LookColour, ViewTable};
use pliant_geometry::CellLabel;
use pliant_picture::{Background, Camera, Picture, Plane, Projection, Style, Texture};

use super::App;
use super::panels::make_room;
use super::told::Told;
use crate::beside::create_beside;
use crate::parameters::Number;

/// A picture of the window on its way.
#[derive(Clone, Default)]
pub(super) struct Taking(Arc<Mutex<Option<Arc<ColorImage>>>>);

impl Taking {
    /// Asks for one.
    pub fn ask(&self, context: &egui::Context) {
        let taking = self.0.clone();
        context.request_screenshot(move |image| {
            *taking.lock().unwrap_or_else(PoisonError::into_inner) = Some(image);
        });
    }

    pub fn taken(&self) -> Option<Arc<ColorImage>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Writes the whole window once its picture has arrived.
    pub fn write(&self, file: &Path) -> Option<Result<(), String>> {
        let image = self.taken()?;
        let [width, height] = image.size.map(|size| size as f32);
        let picture = part(&image, Rect::from_min_size(Pos2::ZERO, vec2(width, height)), 1.0)?;
        let png = picture.png().map_err(|error| error.to_string());
        let message = |error| format!("`{}` cannot be written: {error}", file.display());
        Some(png.and_then(|png| std::fs::write(file, png).map_err(message)))
    }

    /// The part of the window that the picture covers, once it has come.
    pub fn picture(&self, context: &egui::Context, rect: Rect) -> Option<Picture> {
        part(&*self.taken()?, rect, context.pixels_per_point())
    }

    /// Writes the part of the window that the picture covers, once it has come, beside a scene or a run.
    pub fn keep(&self, context: &egui::Context, rect: Rect, beside: &Path) -> Option<Told> {
        let picture = self.picture(context, rect)?;
        Some(match picture.png() {
            Ok(png) => message_of(write_beside(beside, "picture", "png", &png)),
            Err(error) => Told::failure(error.to_string()),
        })
    }
}

/// Writes a file beside a scene.
fn write_beside(scene: &Path, what: &str, extension: &str, bytes: &[u8]) -> std::io::Result<PathBuf> {
    let (path, mut file) = create_beside(scene, what, extension)?;
    file.write_all(bytes).map(|()| path)
}

fn message_of(written: std::io::Result<PathBuf>) -> Told {
    match written {
        Ok(path) => Told::done(format!("`{}` was written", path.display())),
        Err(error) => Told::failure(format!("nothing can be written beside the scene: {error}")),
    }
}

/// The part of a picture of the window that a rectangle covers, in egui's points; `None` of an empty one.
fn part(image: &ColorImage, rect: Rect, pixels_per_point: f32) -> Option<Picture> {
    let [width, height] = image.size;
    let pixel = |at: f32, most: usize| ((at * pixels_per_point).round().max(0.0) as usize).min(most);
    let (left, right) = (pixel(rect.left(), width), pixel(rect.right(), width));
    let (top, bottom) = (pixel(rect.top(), height), pixel(rect.bottom(), height));
    let rows = (top..bottom).map(|row| &image.pixels[row * width + left..row * width + right]);
    let rgba: Vec<u8> = rows.flatten().flat_map(|pixel| pixel.to_array()).collect();
    let (width, height) = ((right - left) as u32, (bottom - top) as u32);
    (!rgba.is_empty()).then_some(Picture { width, height, rgba })
}

/// Target [m] and magnification of a camera that does not see everything.
type Closer = Option<([f64; 3], f64)>;

/// A view as the table `[view]` of a scene.
fn view_text(view: &ViewTable, style: &Style, camera: &Camera, cut: Option<Plane>, closer: Closer) -> String {
    let mut lines = vec!["[view]".to_owned()];
    let mut put = |key: &str, value: String| lines.push(format!("{key} = {value}"));
    let list = |numbers: &[f64]| {
        format!("[{}]", numbers.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(", "))
    };
    if let Some(on) = &view.on {
        put("on", toml_text(on));
    }
    match view.colour {
        Some(ColourBy::Field(field)) => put("colour", toml_text(field.name())),
        Some(ColourBy::Labels(_)) => put("colour", toml_text("label")),
        Some(ColourBy::Nothing(_)) => put("colour", toml_text("none")),
        None => {}
    }
    if let Some(component) = view.component {
        put("component", toml_text(component.word()));
    }
    put("map", toml_text(style.map.name()));
    if let Some(range) = style.range.filter(|[low, high]| low < high) {
        put("range", list(&range));
    }
    if !view.hide.is_empty() {
        let hidden: Vec<String> = (view.hide.iter())
            .map(|label| match label {
                CellLabel::Number(number) => number.to_string(),
                CellLabel::Name(name) => toml_text(name),
            })
            .collect();
        put("hide", format!("[{}]", hidden.join(", ")));
    }
    for (name, look) in &view.look {
        let colour = LookColour::WORDS[look.colour as usize];
        let look = format!("{{ opacity = {:?}, colour = {} }}", rounded(look.opacity), toml_text(colour));
        put(&format!("look.{}", toml_text(name)), look);
    }
    let switches = [
        ("edges", style.edges),
        ("wireframe", style.wireframe),
        ("ghost", style.ghost),
        ("fibres", view.fibres),
        ("contacts", view.contacts),
        ("marks", view.marks),
        ("critical", view.critical),
    ];
    switches.into_iter().filter(|(_, on)| *on).for_each(|(key, _)| put(key, "true".into()));
    if !view.occlusion {
        put("occlusion", "false".into());
    }
    if !style.maximum {
        put("mark-maximum", "false".into());
    }
    if style.texture == Texture::Skin {
        put("texture", toml_text("skin"));
    }
    if let Some(plane) = cut {
        let point = plane.normal * plane.offset;
        let [point, normal] = [point, plane.normal].map(|v| list(v.as_slice()));
        put("clip", format!("{{ point = {point}, normal = {normal} }}"));
    }
    match style.background {
        Background::Light => {}
        Background::White => put("background", toml_text("white")),
        Background::Dark => put("background", toml_text("dark")),
    }
    put("curved", view.curved.to_string());
    let [azimuth, elevation] = [camera.azimuth, camera.elevation].map(rounded);
    let up = toml_text(camera.up.name());
    let mut seen = format!("azimuth = {azimuth:?}, elevation = {elevation:?}, up = {up}");
    if let Some((target, zoom)) = closer {
        seen.push_str(&format!(", target = {}, zoom = {:?}", list(&target), rounded(zoom.clamp(1e-3, 1e3))));
    }
    if camera.projection == Projection::Orthographic {
        seen.push_str(", orthographic = true");
    }
    put("camera", format!("{{ {seen} }}"));
    lines.join("\n") + "\n"
}

/// A number with as many digits as a user sees.
fn rounded(number: f64) -> f64 {
    (number * 1e4).round() / 1e4
}

/// A text as a value of TOML.
fn toml_text(text: &str) -> String {
    format!("{text:?}")
}

/// Returns the text of a scene with other numbers in their places, and the numbers that do not stand in the
/// file.
fn text_with(source: &Source, numbers: &[Number]) -> (String, Vec<String>) {
    let mut places = Vec::new();
    let mut elsewhere = Vec::new();
    for Number { path, value } in numbers {
        let path: Vec<&str> = path.iter().map(String::as_str).collect();
        let Some((Place::File(span), node)) = source.node(&path).map(|node| (source.span(&path), node))
        else {
            elsewhere.push(path.join("."));
            continue;
        };
        let whole = matches!(node.value, Value::Integer(_)) && value.fract() == 0.0 && value.abs() < 1e15;
        places.push((span, if whole { format!("{value:.0}") } else { format!("{value:?}") }));
    }
    places.sort_by_key(|(span, _)| std::cmp::Reverse(span.start));
    let mut text = source.text().to_owned();
    places.into_iter().for_each(|(span, value)| text.replace_range(span, &value));
    (text, elsewhere)
}

impl App {
    /// Buttons that keep something.
    pub(super) fn keep(&mut self, ui: &mut egui::Ui) {
        if ui.button("Picture").on_hover_text("writes the picture beside the scene, as PNG").clicked() {
            self.taking.ask(ui.ctx());
        }
        if ui
            .selectable_label(self.filming.is_on(), "Film")
            .on_hover_text("V: begins a film; V again ends it and writes it beside the scene")
            .clicked()
        {
            self.film();
        }
        if ui.button("Copy view").on_hover_text("copies the view as the table [view] of a scene").clicked() {
            self.copy_view();
        }
        let changed = self.changed_numbers();
        let button = egui::Button::new("Save scene");
        make_room(ui, 90.0);
        let button = ui.add_enabled(!changed.is_empty(), button);
        if button.on_hover_text("writes the scene with the changed numbers as NAME-changed.toml").clicked() {
            let (text, elsewhere) = text_with(&self.world.scene.source, &changed);
            let written = message_of(write_beside(&self.file, "changed", "toml", text.as_bytes()));
            self.message = Some(match elsewhere.is_empty() {
                true => written,
                false => Told {
                    text: format!(
                        "{}, without `{}`, which the file lacks",
                        written.text,
                        elsewhere.join("`, `")
                    ),
                    ..written
                },
            });
        }
    }

    /// Copies the view to the clipboard.
    pub(super) fn copy_view(&mut self) {
        self.context.copy_text(self.view_text());
        self.message = Some(Told::done("the table [view] was copied: paste it over the [view] of the scene"));
    }

    /// The view as a table of a scene.
    pub(super) fn view_text(&self) -> String {
        let closer = self.port.closer().map(|(target, zoom)| (target.into(), zoom));
        view_text(&self.view, &self.port.style, &self.port.camera, self.port.style.clip, closer)
    }

    /// Writes a picture that has come.
    pub(super) fn take_picture(&mut self, context: &egui::Context) {
        let message = self.taking.keep(context, self.port.rect, &self.file);
        self.message = message.or_else(|| self.message.take());
    }
}

#[cfg(test)]
mod tests {
    use pliant_format::Scene;
    use pliant_format::tables::UpName;
    use pliant_geometry::Vector3;
    use pliant_picture::{Axis, ColourMap};

    use super::*;

    const SCENE: &str = "[scene]\nuntil = 1\n[law.tissue]\ntype = 'neo-hookean'\nyoung-modulus = 10e3 # soft\npoisson-ratio = 0.3\n\
        [body.cube]\nmesh = { block = { size = [1, 1, 1], cells = [2, 2, 2] } }\nlaw = 'tissue'\ndensity = 1000\n";

    fn scene(text: &str) -> Scene {
        let source = Source::parse("scene.toml", text).unwrap_or_else(|errors| panic!("{}", errors.plain()));
        Scene::from_source(source, ".".into()).unwrap_or_else(|errors| panic!("{}", errors.plain()))
    }

    #[test]
    fn a_copied_view_is_the_view_of_the_scene_that_it_is_pasted_into() {
        let asked = "[view]\non = 'cube'\ncolour = 'displacement'\ncomponent = 'z'\nhide = ['cube']\nocclusion = false\n\
            look.cube = { opacity = 0.25, colour = 'liver' }\n";
        let view = scene(&format!("{SCENE}{asked}")).view;
        let style = Style {
            map: ColourMap::Magma,
            range: Some([-1e-3, 0.25]),
            edges: true,
            ghost: true,
            texture: Texture::Skin,
            background: Background::Dark,
            ..Style::default()
        };
        let camera = Camera {
            azimuth: 12.25,
            elevation: -30.0,
            projection: Projection::Orthographic,
            up: Axis::MinusY,
            ..Camera::default()
        };
        let cut = Plane::through(&Vector3::new(0.5, 0.0, 0.0), &Vector3::x());
        let text = view_text(&view, &style, &camera, cut, Some(([0.0, 0.5, 1.0], 2.5)));
        let read = scene(&format!("{SCENE}{text}")).view;
        assert_eq!((read.on, read.colour, read.component), (view.on, view.colour, view.component), "{text}");
        assert_eq!(
            (read.range, read.edges, read.ghost, read.wireframe, read.occlusion, read.mark_maximum),
            (Some([-1e-3, 0.25]), true, true, false, false, false)
        );
        assert_eq!((read.hide, read.look), (view.hide, view.look));
        assert_eq!(read.clip.map(|clip| (clip.point, clip.normal)), Some(([0.5, 0.0, 0.0], [1.0, 0.0, 0.0])));
        let camera = read.camera;
        assert_eq!((camera.azimuth, camera.elevation, camera.orthographic), (12.25, -30.0, true));
        assert_eq!(camera.up, Some(UpName::MinusY));
        assert_eq!((camera.target, camera.zoom, read.curved), (Some([0.0, 0.5, 1.0]), 2.5, view.curved));
    }

    #[test]
    fn changed_numbers_stand_where_the_old_ones_stood() {
        let number = |path: [&str; 3], value| Number { path: path.map(str::to_owned).to_vec(), value };
        let numbers = [
            number(["law", "tissue", "young-modulus"], 12.5e3),
            number(["body", "cube", "density"], 1060.0),
            number(["body", "cube", "damping"], 2.0),
        ];
        let (text, elsewhere) = text_with(&scene(SCENE).source, &numbers);
        assert_eq!(text, SCENE.replace("10e3 #", "12500.0 #").replace("density = 1000", "density = 1060"));
        assert_eq!(elsewhere, ["body.cube.damping"]);
    }

    #[test]
    fn pictures_are_cut_out_of_the_window() {
        let mut image = ColorImage::filled([8, 4], egui::Color32::BLACK);
        image.pixels[2 * 8 + 5] = egui::Color32::WHITE;
        let rect = Rect::from_min_max(egui::pos2(2.0, 1.0), egui::pos2(3.0, 2.0));
        let picture = part(&image, rect, 2.0).unwrap();
        assert_eq!((picture.width, picture.height), (2, 2));
        assert_eq!(picture.rgba[4..8], [255; 4]);
        assert!(part(&image, Rect::ZERO, 1.0).is_none());
    }
}
