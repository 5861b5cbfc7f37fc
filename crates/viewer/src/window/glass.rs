//! The part of the rehearsal that looks through a body: its middle shows the background, and the copied view says so.

use std::cell::RefCell;
use std::rc::Rc;

use eframe::egui::Color32;
use pliant_format::tables::LookTable;

use super::App;
use super::keep::Taking;
use super::self_test::{Cue, inside};

/// Least change of a channel of the colour in the middle of the body.
const CHANGE: u8 = 20;

/// Makes the first body half-transparent and opaque again.
pub(super) fn glass() -> Vec<Cue> {
    let before = Rc::new(RefCell::new(None));
    let [opaque, glassy, again] = [before.clone(), before.clone(), before];
    let look = |opacity: Option<f64>| {
        move |app: &mut App| {
            let name = app.names.bodies.values().next().cloned().unwrap_or_default();
            app.view.look.clear();
            app.view
                .look
                .extend(opacity.map(|opacity| (name, LookTable { opacity, ..LookTable::default() })));
            app.look_at_regions();
        }
    };
    let mut cues = vec![middle(
        "the body is opaque",
        |_| {},
        move |_, colour| {
            *opaque.borrow_mut() = Some(colour);
            true
        },
    )];
    cues.push(middle("one sees through the body", look(Some(0.2)), move |app, colour| {
        app.view_text().contains("opacity = 0.2")
            && glassy.borrow().is_some_and(|before| differ(before, colour))
    }));
    cues.push(middle("the body is opaque again", look(None), move |app, colour| {
        !app.view_text().contains("look.") && again.borrow().is_some_and(|before| !differ(before, colour))
    }));
    cues
}

fn differ(one: Color32, other: Color32) -> bool {
    one.to_array().into_iter().zip(other.to_array()).any(|(a, b)| a.abs_diff(b) > CHANGE)
}

/// Does something, and looks at the colour in the middle of the body, until it is right.
fn middle(
    what: &str,
    act: impl FnOnce(&mut App) + 'static,
    mut is_right: impl FnMut(&App, Color32) -> bool + 'static,
) -> Cue {
    let taking = Taking::default();
    let first = taking.clone();
    let give = move |app: &mut App| {
        act(app);
        first.ask(&app.context);
        Vec::new()
    };
    Cue::new(what, give, move |app| {
        let Some(image) = taking.taken() else { return Ok(false) };
        let place = inside(app) * app.context.pixels_per_point();
        let pixel = image.pixels.get(place.y as usize * image.size[0] + place.x as usize);
        let right = pixel.is_some_and(|colour| is_right(app, *colour));
        if !right {
            taking.ask(&app.context);
        }
        Ok(right)
    })
}
