//! The line below the picture: a failure, a warning, a hint, or a thing that was done. It lies beside the
//! picture, so it hides nothing.

use eframe::egui::{self, Color32, Frame, Margin, RichText, Ui};

use super::App;

/// Kind of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// The run can't continue, or a request was not fulfilled.
    Failure,
    /// A result may be questionable.
    Warning,
    /// Current state, or a possible action.
    Hint,
    /// Something was done.
    Done,
}

/// A message of the window.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Told {
    pub kind: Kind,
    pub text: String,
}

impl Told {
    pub fn failure(text: impl Into<String>) -> Self {
        Self { kind: Kind::Failure, text: text.into() }
    }

    pub fn hint(text: impl Into<String>) -> Self {
        Self { kind: Kind::Hint, text: text.into() }
    }

    pub fn done(text: impl Into<String>) -> Self {
        Self { kind: Kind::Done, text: text.into() }
    }
}

impl Kind {
    /// The word before the text, and the colours of paper and word; the word makes it readable without
    /// colours.
    fn look(self, dark: bool) -> (&'static str, Color32, Color32) {
        let (word, [paper, ink]) = match self {
            Self::Failure => ("error", [[252, 224, 219], [160, 28, 20]]),
            Self::Warning => ("warning", [[253, 243, 208], [130, 88, 0]]),
            Self::Hint => ("hint", [[226, 236, 248], [28, 78, 140]]),
            Self::Done => ("done", [[221, 243, 225], [20, 104, 48]]),
        };
        let colour = |[r, g, b]: [u8; 3]| Color32::from_rgb(r, g, b);
        if dark {
            (word, colour(ink).gamma_multiply(0.45), colour(paper))
        } else {
            (word, colour(paper), colour(ink))
        }
    }
}

impl App {
    /// Returns the current messages for the user. A failure comes first, then the last action, or else a note
    /// of the run or a warning of the scene. Closed failures, notes and warnings do not come back. A message
    /// does if it is sent again.
    pub(super) fn banner(&self) -> Vec<Told> {
        let warned = |text: String| Told { kind: Kind::Warning, text };
        let open = |message: &Told| !self.closed.contains(&message.text);
        let failure = self.frame.failure.clone().map(Told::failure).filter(open);
        let mut notes = self.frame.note.iter().chain(&self.warnings).cloned().map(warned);
        let second = self.message.clone().or_else(|| notes.find(open).filter(|_| failure.is_none()));
        failure.into_iter().chain(second).collect()
    }

    /// The lines, until they are closed.
    pub(super) fn tell(&mut self, ui: &mut Ui) {
        for shown in self.banner() {
            if !tell(ui, Some(&shown)) {
                continue;
            }
            match self.message.take_if(|message| *message == shown) {
                Some(_) => {}
                None => _ = self.closed.insert(shown.text),
            }
        }
    }
}

/// A message in a line, with a button that closes it; whether it was pressed.
pub(super) fn tell(ui: &mut Ui, message: Option<&Told>) -> bool {
    let Some(Told { kind, text }) = message else { return false };
    let dark = ui.visuals().dark_mode;
    let (word, paper, ink) = kind.look(dark);
    let frame = Frame::NONE.fill(paper).inner_margin(Margin::symmetric(10, 5));
    let line = egui::Panel::bottom(egui::Id::unique(("told", text))).frame(frame).show(ui, |ui| {
        let row = ui.horizontal_wrapped(|ui| {
            ui.label(RichText::new(word).strong().color(ink));
            let ink = if dark { ink.lerp_to_gamma(Color32::WHITE, 0.5) } else { Color32::from_gray(25) };
            ui.label(RichText::new(text).color(ink));
            ui.small_button("×").on_hover_text("closes this message").clicked()
        });
        row.inner
    });
    line.inner
}
