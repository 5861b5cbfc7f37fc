//! The picture that a window takes of itself once it has played, before it closes.

use std::path::PathBuf;
use std::sync::PoisonError;

use eframe::egui;

use super::App;
use super::keep::Taking;
use crate::session::Order;

/// A picture of the window that is to be taken.
pub(super) struct Portrait {
    /// Simulated time [s] until then.
    after: f64,
    file: PathBuf,
    taking: Taking,
    stage: Stage,
}

/// Progress of a portrait.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Stage {
    Plays,
    Pauses,
    Asked,
}

impl Portrait {
    pub fn new((after, file): (f64, PathBuf)) -> Self {
        Self { after, file, taking: Taking::default(), stage: Stage::Plays }
    }
}

impl App {
    /// Continues a portrait, if one is asked for. Closes the window once it is written.
    pub(super) fn pose(&mut self) {
        let Some(portrait) = &mut self.portrait else { return };
        self.context.request_repaint();
        let (playing, failed) = (self.frame.playing, self.frame.failure.is_some());
        match portrait.stage {
            Stage::Plays if failed || playing && self.frame.time >= portrait.after => {
                portrait.stage = Stage::Pauses;
                self.session.order(Order::Play(false));
            }
            Stage::Pauses if !playing => {
                portrait.stage = Stage::Asked;
                portrait.taking.ask(&self.context);
            }
            _ => {}
        }
        let Some(written) = portrait.taking.write(&portrait.file) else { return };
        let outcome = written.map(|()| self.shown());
        *self.outcome.lock().unwrap_or_else(PoisonError::into_inner) = Some(outcome);
        self.context.send_viewport_cmd(egui::ViewportCommand::Close);
    }

    /// Describes a picture of the window.
    fn shown(&self) -> String {
        let message: String = self.banner().iter().map(|message| format!(": {}", message.text)).collect();
        let first = self.first_picture.unwrap_or_default();
        let frame = 1e3 * self.frame_seconds;
        format!(
            "{} at t = {:.3} s{message}; first picture after {first:.2} s, frames of {frame:.1} ms ({})",
            self.title(),
            self.frame.time,
            self.adapter
        )
    }
}
