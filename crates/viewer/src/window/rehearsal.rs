//! A window that tries itself.

use std::sync::PoisonError;

use eframe::egui;
use pliant_geometry::Vector3;

use super::App;
use crate::hand::Hand;
use crate::session::Order;

/// What a window that tries itself does.
#[derive(Clone, Copy, Debug)]
pub struct Rehearsal {
    /// Frames that are drawn before it closes.
    pub frames: u64,
}

impl App {
    /// Does what a user would: plays, pulls at the middle of the picture, lets go, closes.
    pub(super) fn rehearse(&mut self, context: &egui::Context) {
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

    pub(super) fn tell(&self, told: Result<String, String>) {
        self.outcome.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(told);
    }
}
