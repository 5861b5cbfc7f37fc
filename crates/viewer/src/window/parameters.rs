//! The numbers of laws, loads and bodies, which can be changed while a scene is played. A thread makes the
//! scene with the new numbers.

use std::sync::mpsc::{Receiver, TryRecvError, channel};

use eframe::egui;
use pliant_format::Scene;
use pliant_scene::World;

use super::told::Told;
use super::undo::Act;
use super::viewport::typed_number;
use super::{App, warnings};
use crate::parameters::{Number, Parameter, parameters, with_numbers};
use crate::session::Order;

/// Numbers, and the channel for the world with these numbers.
type Making = (Vec<f64>, Receiver<Result<World, String>>);

/// The numbers that can be changed.
pub(super) struct Numbers {
    parameters: Vec<Parameter>,
    in_file: Vec<f64>,
    /// Numbers of the world that is played, or waits to be.
    accepted: Vec<f64>,
    /// A world that is being made of some numbers.
    making: Option<Making>,
    /// Numbers that an undo asks for, until they are accepted.
    undone: Option<Vec<f64>>,
}

impl Numbers {
    pub(super) fn of(scene: &Scene) -> Self {
        let parameters = parameters(scene);
        let in_file: Vec<f64> = parameters.iter().map(|parameter| parameter.number.value).collect();
        Self { parameters, accepted: in_file.clone(), in_file, making: None, undone: None }
    }

    fn values(&self) -> Vec<f64> {
        self.parameters.iter().map(|parameter| parameter.number.value).collect()
    }

    fn set(&mut self, values: &[f64]) {
        self.parameters.iter_mut().zip(values).for_each(|(parameter, value)| parameter.number.value = *value);
    }

    /// Returns to the played numbers, of which `played` lists the ones that differ from the file.
    pub(super) fn refuse(&mut self, played: &[Number]) {
        let value = |parameter: &Parameter, file: f64| {
            let differing = played.iter().find(|number| number.path == parameter.number.path);
            differing.map_or(file, |number| number.value)
        };
        let values: Vec<f64> = self
            .parameters
            .iter()
            .zip(&self.in_file)
            .map(|(parameter, file)| value(parameter, *file))
            .collect();
        self.set(&values);
        self.accepted = values;
    }

    /// Returns the numbers among some values that differ from the file.
    fn changed(&self, values: &[f64]) -> Vec<Number> {
        let compared = self.parameters.iter().zip(values).zip(&self.in_file);
        compared
            .filter(|((_, value), file)| value != file)
            .map(|((parameter, value), _)| Number { value: *value, ..parameter.number.clone() })
            .collect()
    }
}

/// A number to be dragged, by a hundredth of itself a point; whether it is let go with another value.
fn dragged(ui: &mut egui::Ui, parameter: &mut Parameter) -> bool {
    let value = &mut parameter.number.value;
    let write = |value: f64, _| match value.abs() {
        size if size != 0.0 && !(1e-3..1e6).contains(&size) => format!("{value:.4e}"),
        _ => format!("{}", (value * 1e6).round() / 1e6),
    };
    let speed = if *value == 0.0 { 0.01 } else { 0.01 * value.abs() };
    let drag = egui::DragValue::new(value)
        .speed(speed)
        .custom_formatter(write)
        .custom_parser(typed_number)
        .suffix(format!(" {}", parameter.unit));
    let response = ui.add(drag).on_hover_text(&parameter.meaning);
    response.drag_stopped() || response.lost_focus()
}

impl App {
    /// Returns the numbers that differ from the file.
    pub(super) fn changed_numbers(&self) -> Vec<Number> {
        self.numbers.changed(&self.numbers.values())
    }

    /// Takes other numbers in place of the last ones.
    pub(super) fn set_numbers(&mut self, values: &[f64]) {
        self.numbers.set(values);
        self.numbers.undone = Some(values.to_vec());
        let context = self.context.clone();
        self.make_stage(&context);
    }

    /// The list of numbers; each acts once it is let go.
    pub(super) fn numbers(&mut self, ui: &mut egui::Ui) {
        let mut released = false;
        let mut table = String::new();
        egui::CollapsingHeader::new("Laws, loads and bodies").show(ui, |ui| {
            for parameter in &mut self.numbers.parameters {
                let heading = parameter.number.path[..2].join(".");
                if heading != table {
                    ui.label(egui::RichText::new(&heading).strong());
                    table = heading;
                }
                ui.horizontal(|ui| {
                    released |= dragged(ui, parameter);
                    ui.label(parameter.number.path[2..].join("."));
                });
            }
            let other = self.numbers.values() != self.numbers.in_file;
            if ui.add_enabled(other, egui::Button::new("As in the file")).clicked() {
                let in_file = self.numbers.in_file.clone();
                self.numbers.set(&in_file);
                released = true;
            }
        });
        if released {
            self.make_stage(ui.ctx());
        }
        self.take_stage(ui.ctx());
    }

    /// Begins to make the world of the numbers as they are, unless one is being made.
    fn make_stage(&mut self, context: &egui::Context) {
        let values = self.numbers.values();
        if values == self.numbers.accepted || self.numbers.making.is_some() {
            return;
        }
        let (send, receive) = channel();
        let (scene, numbers, context) =
            (self.world.scene.clone(), self.numbers.changed(&values), context.clone());
        let work = move || {
            // The window may be closed by now.
            let _ = send.send(with_numbers(&scene, &numbers));
            context.request_repaint();
        };
        match std::thread::Builder::new().name("numbers".into()).spawn(work) {
            Ok(_) => self.numbers.making = Some((values, receive)),
            Err(error) => self.message = Some(Told::failure(error.to_string())),
        }
    }

    /// Takes a world that is made; invalid numbers are reported and taken back.
    fn take_stage(&mut self, context: &egui::Context) {
        let Some((values, made)) = &self.numbers.making else { return };
        let made = match made.try_recv() {
            Ok(made) => made,
            Err(TryRecvError::Empty) => return,
            Err(TryRecvError::Disconnected) => Err("the scene with these numbers could not be made".into()),
        };
        let values = values.clone();
        self.numbers.making = None;
        match made {
            Ok(world) => {
                self.message = None;
                self.warnings = warnings(&world);
                let changed = self.numbers.changed(&values);
                let is_undone = self.numbers.undone.take_if(|undone| *undone == values).is_some();
                let before = std::mem::replace(&mut self.numbers.accepted, values);
                if !is_undone {
                    self.acts.push(Act::Numbers(before));
                }
                self.order(Order::Change(Box::new(world), changed));
                // They may be others again by now.
                self.make_stage(context);
            }
            Err(message) => {
                self.message = Some(Told::failure(message));
                self.numbers.undone = None;
                let accepted = self.numbers.accepted.clone();
                self.numbers.set(&accepted);
            }
        }
    }
}
