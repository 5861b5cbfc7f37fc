//! Points that are followed and read.

use eframe::egui::{Event, Key, Modifiers};

use super::seen::{inside, known_place};
use super::{BALL, Rehearsal};
use crate::window::App;

/// A pixel far from the middle of the body.
const ELSEWHERE: usize = 100;

#[test]
fn a_click_with_alt_or_i_follows_a_point_which_is_read() {
    let Some(mut window) = Rehearsal::paused(BALL) else { return };
    window.hold(Modifiers::ALT);
    let place = inside(window.app());
    window.click("a click with Alt follows a point, which is read", place, |app| {
        app.read_points().len() == 1 && !app.frame.followed[0].about.is_empty()
    });
    let place = known_place(window.app(), ELSEWHERE);
    window.click("a second point is followed", place, |app| app.frame.followed.len() == 2);
    assert_distance(window.app());
    window.hold(Modifiers::NONE);
    let (place, pressed) = (inside(window.app()), window.press(Key::I, true));
    window.frame([Event::PointerMoved(place), pressed]);
    window.click("a click with I follows a point", place, |app| app.frame.followed.len() == 3);
    let released = window.press(Key::I, false);
    window.frame([released]);
}

/// Checks that the first line shows the distance of the last two points.
#[track_caller]
fn assert_distance(app: &App) {
    let [one, two] = &app.frame.followed[..] else { panic!("two points are followed") };
    let metres = (two.place - one.place).norm();
    let lines = app.read_points();
    let reading = lines[0].strip_prefix("1 to 2: ").and_then(|text| text.split_once(' '));
    let (number, unit) = reading.unwrap_or_else(|| panic!("{lines:?}"));
    let read = number.parse::<f64>().unwrap() * if unit == "mm" { 1e-3 } else { 1.0 };
    assert!(lines.len() == 3 && metres > 0.0 && (read / metres - 1.0).abs() < 0.01, "{lines:?}, {metres} m");
}
