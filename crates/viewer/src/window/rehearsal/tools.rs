//! Tools that are led by keys.

use eframe::egui::{Key, Modifiers};
use pliant_geometry::Vector3;

use super::Rehearsal;
use crate::hand::Which;
use crate::samples::{HAND, SECOND_HAND};
use crate::window::App;

/// A flap under a grasper.
const GRASPED: &str = include_str!("../../../tests/support/grasped.toml");

/// The tool in a hand: where it is held [m], and the sum of all points that are drawn [m].
fn pose(app: &App) -> Option<[Vector3; 2]> {
    let hand = Which::BOTH.into_iter().find(|&which| app.is_led(which))?;
    Some([app.frame.hand(hand)?[0].into(), app.port.points.iter().sum()])
}

/// Waits until the tool is where it is led to.
fn rest(window: &mut Rehearsal) {
    let mut last = None;
    window.wait("the tool has arrived", |app| {
        let now = pose(app).map(|[held, _]| (app.frame.steps, held));
        let (Some((steps, held)), Some((before, there))) = (now, last) else {
            last = now;
            return false;
        };
        let is_later = steps > before;
        last = if is_later { now } else { last };
        is_later && (held - there).norm() < 1e-6
    });
}

/// Holds a key down until the led tool has changed as it should, then releases the key.
fn lead(
    window: &mut Rehearsal,
    what: &str,
    key: Key,
    has_changed: impl Fn(&App, [Vector3; 2], [Vector3; 2]) -> bool,
) {
    rest(window);
    let before = pose(window.app()).unwrap();
    let pressed = window.press(key, true);
    window.give(what, [pressed], |app| pose(app).is_some_and(|now| has_changed(app, before, now)));
    let released = window.press(key, false);
    window.frame([released]);
}

/// K takes a tool beside the hand of the mouse; keys move it, turn it and close its jaws; K lets go after the
/// last one.
#[test]
fn keys_lead_a_tool() {
    let Some(mut window) = Rehearsal::open(GRASPED) else { return };
    window.key("K takes a tool, whose force is plotted", Key::K, |app| {
        let plotted = [HAND, SECOND_HAND].map(|name| app.plotted.contains(name));
        app.led.is_some_and(|(_, which)| app.frame.tools[which as usize].is_some() && plotted[which as usize])
    });
    // Farther than a step of the mouse, as seen by the camera.
    let goes = |axis: usize, sign: f64| {
        move |app: &App, [before, _]: [Vector3; 2], [now, _]: [Vector3; 2]| {
            sign * (now - before).dot(&app.port.camera.axes()[axis]) > 0.01 * app.port.camera.height
        }
    };
    let turns = |_: &App, [held, before]: [Vector3; 2], [now, after]: [Vector3; 2]| {
        (after - before).norm() > 1e-3 && (now - held).norm() < 1e-4
    };
    lead(&mut window, "an arrow moves it", Key::ArrowUp, goes(1, 1.0));
    lead(&mut window, "the other arrow moves it back", Key::ArrowDown, goes(1, -1.0));
    lead(&mut window, "an arrow moves it sideways", Key::ArrowRight, goes(0, 1.0));
    lead(&mut window, "Page Up moves it away", Key::PageUp, goes(2, -1.0));
    lead(&mut window, "End closes its jaws", Key::End, turns);
    lead(&mut window, "Home opens its jaws", Key::Home, turns);
    window.hold(Modifiers::SHIFT);
    lead(&mut window, "Shift and an arrow turn it", Key::ArrowLeft, turns);
    window.hold(Modifiers::NONE);
    window.key("K lets go after the last tool", Key::K, |app| {
        app.frame.hands == [None; 2] && app.led.is_none()
    });
}
