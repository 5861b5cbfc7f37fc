//! The panels around the picture: controls of the run and of the view, and plots.

use eframe::egui;
use pliant_format::tables::{BodyModel, ColourBy, Component, FieldName, Labels, Nothing, SolverName};
use pliant_geometry::Vector3;
use pliant_picture::{Background, ColourMap, Texture};
use pliant_scene::PlannedParticipant;

use super::App;
use super::told::Told;
use super::viewport::OCCLUSION;
use crate::hand::{Hand, Which};
use crate::recording::Surface;
use crate::session::Order;

/// Colours by label, and without a field.
const LABELS: ColourBy = ColourBy::Labels(Labels::Label);
const NO_FIELD: ColourBy = ColourBy::Nothing(Nothing::None);

/// Components of a tensor.
const TENSOR: [Option<Component>; 6] = {
    use Component::{Xx, Xy, Xz, Yy, Yz, Zz};
    [Some(Xx), Some(Yy), Some(Zz), Some(Xy), Some(Yz), Some(Xz)]
};

/// Width of a slider with its number and its text.
pub(super) const SPEED: f32 = 240.0;

/// Begins a new line of buttons if this one lacks room for this width.
pub(super) fn make_room(ui: &mut egui::Ui, width: f32) {
    if ui.available_size_before_wrap().x < width {
        ui.end_row();
    }
}

impl App {
    pub(super) fn top(&mut self, ui: &mut egui::Ui) {
        // In a small window, or with large text, buttons take several lines.
        ui.horizontal_wrapped(|ui| {
            let word = if self.frame.playing { "Pause" } else { "Play" };
            if ui.button(word).on_hover_text("Space").clicked() {
                self.order(Order::Play(!self.frame.playing));
            }
            if ui.button("Step").on_hover_text(".").clicked() {
                self.order(Order::Step(1));
            }
            if ui
                .button("Back")
                .on_hover_text("Comma: back to the last kept state, a quarter of a second before")
                .clicked()
            {
                self.step_back();
            }
            let undo = ui.add_enabled(!self.acts.is_empty(), egui::Button::new("Undo"));
            if undo.on_hover_text("Ctrl and Z: takes back a pull, a pin or changed numbers").clicked() {
                self.undo();
            }
            if ui.button("Reset").on_hover_text("R").clicked() {
                self.reset();
            }
            ui.separator();
            make_room(ui, SPEED);
            let speed = egui::Slider::new(&mut self.speed, 0.01..=10.0).logarithmic(true).text("× real time");
            if ui.add(speed).changed() {
                self.order(Order::Speed(self.speed));
            }
            ui.separator();
            if ui.button("Open").on_hover_text("Ctrl and O: lists scenes and meshes").clicked() {
                self.browser.turn(&self.file);
            }
            if ui.button("Fit").on_hover_text("F").clicked() {
                self.port.fit();
            }
            if ui.selectable_label(self.help, "Keys").on_hover_text("H").clicked() {
                self.help = !self.help;
            }
            ui.separator();
            self.keep(ui);
            ui.separator();
            ui.menu_button("Window", |ui| self.settings(ui));
            ui.label(self.title());
        });
    }

    /// Draws the theme, the size of the text, the choice of panels, and the description of this program.
    fn settings(&mut self, ui: &mut egui::Ui) {
        let context = ui.ctx().clone();
        let mut dark = ui.visuals().dark_mode;
        if ui
            .checkbox(&mut dark, "Dark")
            .on_hover_text("a dark theme, and a dark background of the picture")
            .changed()
        {
            context.set_visuals(if dark { egui::Visuals::dark() } else { egui::Visuals::light() });
            self.port.style.background = if dark { Background::Dark } else { Background::Light };
        }
        let mut size = context.zoom_factor();
        let slider = egui::Slider::new(&mut size, 0.7..=2.0).step_by(0.1).text("size of the text");
        // Larger text moves the slider, so it acts once it is let go.
        if ui.add(slider).drag_stopped() {
            context.set_zoom_factor(size);
        }
        ui.checkbox(&mut self.side_shown, "Side panel").on_hover_text("colours, shape, hand and numbers");
        ui.checkbox(&mut self.plots_shown, "Plots").on_hover_text("curves over time below the picture");
        ui.separator();
        ui.label(concat!("Pliant ", env!("CARGO_PKG_VERSION")));
        ui.label(format!("draws with {}", self.adapter));
    }

    pub(super) fn side(&mut self, ui: &mut egui::Ui) {
        let folding = |title: &str| {
            egui::CollapsingHeader::new(egui::RichText::new(title).heading()).default_open(true)
        };
        egui::ScrollArea::vertical().show(ui, |ui| {
            let colours = folding("Colours").show(ui, |ui| self.colours(ui));
            let bodies = folding("Bodies").show(ui, |ui| self.bodies(ui));
            let shape = folding("Shape").show(ui, |ui| self.shape(ui));
            if [colours, bodies, shape].map(|part| part.body_returned).contains(&Some(true)) {
                self.show();
            }
            folding("Hand").show(ui, |ui| self.hand(ui));
            self.numbers(ui);
        });
    }

    /// Draws the choice of the colours. Returns true if another field is asked for.
    fn colours(&mut self, ui: &mut egui::Ui) -> bool {
        let before = (self.colour(), self.view.component);
        let mut colour = before.0;
        let name = |colour: ColourBy| match colour {
            ColourBy::Nothing(_) => "tissue",
            ColourBy::Labels(_) => "label",
            ColourBy::Field(field) => field.title(),
        };
        egui::ComboBox::from_id_salt("field").selected_text(name(colour)).width(180.0).show_ui(ui, |ui| {
            let plain = [NO_FIELD, LABELS].into_iter().take(if self.names.labels.is_empty() { 1 } else { 2 });
            for other in plain.chain(self.fields().into_iter().map(ColourBy::Field)) {
                ui.selectable_value(&mut colour, other, name(other));
            }
        });
        let field = if let ColourBy::Field(field) = colour { Some(field) } else { None };
        let components: &[Option<Component>] = match field.map_or(1, FieldName::components) {
            3 => &[None, Some(Component::X), Some(Component::Y), Some(Component::Z)],
            9 => &TENSOR,
            _ => &[None],
        };
        if before.0 != colour {
            self.view.colour = Some(colour);
            self.view.component = components[0];
            self.port.locked = false;
        }
        if components.len() > 1 {
            ui.horizontal_wrapped(|ui| {
                for &component in components {
                    let word = component.map_or("size", Component::word);
                    ui.selectable_value(&mut self.view.component, component, word);
                }
            });
        }
        egui::ComboBox::from_id_salt("map").selected_text(self.port.style.map.name()).width(180.0).show_ui(
            ui,
            |ui| {
                for map in ColourMap::ALL {
                    ui.selectable_value(&mut self.port.style.map, map, map.name());
                }
            },
        );
        let unit = self.field().map_or("", FieldName::unit);
        if let Some(reason) = self.port.edit_range(ui, unit) {
            self.message = Some(Told::failure(reason));
        }
        before != (self.colour(), self.view.component)
    }

    /// Returns the current choice of the colours.
    fn colour(&self) -> ColourBy {
        match self.field() {
            _ if self.view.shows_labels() => LABELS,
            Some(field) => ColourBy::Field(field),
            None => NO_FIELD,
        }
    }

    /// Shows where bodies are held, moved and loaded, or not.
    pub(super) fn show_marks(&mut self, shown: bool) {
        self.view.marks = shown;
        self.order(Order::Marks(shown));
    }

    /// Draws the choices of the view besides the colours. Returns true if another surface is asked for.
    fn shape(&mut self, ui: &mut egui::Ui) -> bool {
        let before = (Surface::of(&self.view), self.view.contacts, self.port.cut.on);
        let scene = &self.world.scene;
        let is_shell = scene.bodies.iter().any(|(_, body)| body.model == BodyModel::Shell);
        let bodies = scene.bodies.iter().map(|(name, _)| name);
        let names: Vec<&String> = bodies.chain(scene.surfaces.iter().map(|(name, _)| name)).collect();
        if names.len() > 1 {
            let shown = self.view.on.clone().unwrap_or_else(|| "all bodies".into());
            egui::ComboBox::from_id_salt("surface").selected_text(shown).width(180.0).show_ui(ui, |ui| {
                ui.selectable_value(&mut self.view.on, None, "all bodies");
                for name in names {
                    ui.selectable_value(&mut self.view.on, Some(name.clone()), name);
                }
            });
        }
        if is_shell {
            let parts = egui::Slider::new(&mut self.view.curved, 1..=12).text("parts per edge");
            ui.add(parts)
                .on_hover_text("how finely the curved surface of shells is drawn; 1: flat triangles");
        }
        ui.checkbox(&mut self.port.style.edges, "Edges of the elements").on_hover_text("E");
        ui.checkbox(&mut self.port.style.ghost, "Shape at rest").on_hover_text("G");
        self.port.cut.edit(ui, self.port.style.clip);
        ui.checkbox(&mut self.view.fibres, "Fibres");
        ui.checkbox(&mut self.view.critical, "Element that sets the step");
        if self.world.touches(self.view.on.as_deref()) {
            ui.checkbox(&mut self.view.contacts, "Forces of contacts");
        }
        let mut marks = self.view.marks;
        let explanation = "M: squares where nodes are held, dots where they are moved, bars under plates, arrows of loads and weights";
        if ui.checkbox(&mut marks, "Constraints and loads").on_hover_text(explanation).changed() {
            self.show_marks(marks);
        }
        ui.checkbox(&mut self.port.style.wireframe, "Wireframe");
        let mut skin = self.port.style.texture == Texture::Skin;
        if ui.checkbox(&mut skin, "Skin").changed() {
            self.port.style.texture = if skin { Texture::Skin } else { Texture::None };
        }
        if ui.checkbox(&mut self.port.style.occlusion, "Occlusion").on_hover_text(OCCLUSION).changed() {
            self.view.occlusion = self.port.style.occlusion;
        }
        (self.port.style.fibres, self.port.style.critical) = (self.view.fibres, self.view.critical);
        before != (Surface::of(&self.view), self.view.contacts, self.port.cut.on)
    }

    fn hand(&mut self, ui: &mut egui::Ui) {
        let is_relaxed = |part: &PlannedParticipant| {
            part.scene.run.solver == SolverName::QuasiStatic && part.built.implicit.is_none()
        };
        if self.world.participants.iter().any(is_relaxed) {
            ui.weak("the solver `quasi-static` does not support pulling by hand; use `static` or `implicit`");
            return;
        }
        ui.add(egui::Slider::new(&mut self.stiffness, 1.0..=5000.0).logarithmic(true).text("N/m"));
        let pulls = Which::BOTH.map(|which| Some(Vector3::from(self.frame.hand(which)?[1]).norm()));
        ui.label(match pulls {
            [Some(first), Some(second)] => format!("the hands pull with {first:.3} N and {second:.3} N"),
            [Some(newtons), None] | [None, Some(newtons)] => format!("the hand pulls with {newtons:.3} N"),
            [None, None] => "drag the body to pull it".into(),
        });
        let pins = self.frame.pins().len();
        if pins > 0 && ui.button(format!("Remove {pins} pins")).clicked() {
            for pin in (0..pins).rev() {
                self.act(Hand::Unpin(pin));
            }
        }
    }

    /// Returns the fields of the current view.
    pub(super) fn fields(&self) -> Vec<FieldName> {
        let on = self.view.on.as_deref();
        let touches = self.world.touches(on);
        let fields = self.world.scene.fields_on(on).into_iter();
        fields.filter(|field| touches || !field.is_of_contact()).collect()
    }
}
