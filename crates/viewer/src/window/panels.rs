//! The panels around the picture: what is played and shown, and plots.

use eframe::egui;
use pliant_geometry::Vector3;
use pliant_picture::{ColourMap, Texture};
use pliant_scene::format::FieldName;

use super::App;
use crate::hand::Hand;
use crate::session::Order;

impl App {
    pub(super) fn top(&mut self, ui: &mut egui::Ui) {
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
                ui.label(self.title());
            });
        });
    }

    pub(super) fn side(&mut self, ui: &mut egui::Ui) {
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
        ui.checkbox(&mut self.style.wireframe, "Wireframe");
        if self.subject.has_fibres() {
            ui.checkbox(&mut self.style.fibres, "Fibres");
        }
        if self.subject.has_critical_cell() {
            ui.checkbox(&mut self.style.critical, "Element with the smallest step at rest");
        }
        let mut skin = self.style.texture == Texture::Skin;
        ui.checkbox(&mut skin, "Skin");
        self.style.texture = if skin { Texture::Skin } else { Texture::None };
        ui.checkbox(&mut self.cut.on, "Section").on_hover_text("C");
        if self.cut.on {
            ui.horizontal(|ui| {
                for (word, normal) in [("x", Vector3::x()), ("y", Vector3::y()), ("z", Vector3::z())] {
                    ui.selectable_value(&mut self.cut.normal, normal, word);
                    ui.selectable_value(&mut self.cut.normal, -normal, format!("−{word}"));
                }
            });
            ui.add(egui::Slider::new(&mut self.cut.part, 0.0..=1.0).show_value(false));
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
        ui.separator();
        self.numbers(ui);
    }

    /// The fields that bodies of the scene have.
    pub(super) fn fields(&self) -> Vec<FieldName> {
        let on = self.stage.scene.view.on.as_ref();
        let bodies = self.stage.scene.bodies.iter().filter(|(name, _)| on.is_none_or(|on| on == name));
        let models: Vec<_> = bodies.map(|(_, body)| body.model).collect();
        let all = FieldName::ALL.into_iter();
        if models.is_empty() {
            return vec![FieldName::Displacement];
        }
        all.filter(|field| models.iter().any(|&model| field.is_of(model))).collect()
    }
}
