//! Pins, and bodies that are pulled with one hand and with two.

use eframe::egui::{Event, Key, Modifiers, Pos2, vec2};
use pliant_geometry::Vector3;
use pliant_testing::scenes;

use super::seen::{inside, known_place};
use super::{BALL, Rehearsal, on_device};
use crate::hand::Which;
use crate::replay::{Replayed, replay};
use crate::window::App;
use crate::window::picture::on_plane;
use crate::window::undo::Act;

/// Simulated time [s] in which a pulled body comes to rest.
const SETTLING: f64 = 1.0;
/// Simulated time [s] from one movement of the mouse to the next: in less than one step they would tear the
/// body.
const PACE: f64 = 0.03;

#[test]
fn a_click_with_p_pins_and_another_one_takes_the_pin_away() {
    let Some(mut window) = Rehearsal::paused(BALL) else { return };
    for (what, pins) in [("a click with P pins", 1), ("a click with P on a pin takes it away", 0)] {
        let (place, pressed) = (inside(window.app()), window.press(Key::P, true));
        window.frame([Event::PointerMoved(place), pressed]);
        window.click(what, place, |app| app.frame.pins().len() == pins);
        let released = window.press(Key::P, false);
        window.frame([released]);
    }
}

/// Pulls while the run is paused, and plays; Ctrl and Z goes back to before the pull.
#[test]
fn a_pull_is_taken_back() {
    let Some(mut window) = Rehearsal::paused(BALL) else { return };
    let place = inside(window.app());
    window.drag("the mouse pulls while the run is paused", place, |app| {
        app.acts.last().is_some_and(|act| matches!(act, Act::Pull(_)))
    });
    window.key("Space plays", Key::Space, |app| app.frame.steps > 0);
    window.release("the hand lets go", |app| app.hands == [None; 2]);
    window.key("Space pauses", Key::Space, |app| !app.frame.playing);
    window.hold(Modifiers::COMMAND | Modifiers::CTRL);
    window.key("Ctrl and Z goes back to before the pull", Key::Z, |app| {
        app.frame.steps == 0 && app.frame.held.is_empty()
    });
    window.hold(Modifiers::NONE);
}

/// B keeps the grip of the first hand, and the second hand pulls at another place. Then the mouse takes the
/// kept grip again and lets it go.
#[test]
fn two_hands_pull_and_keep() {
    let Some(mut window) = Rehearsal::paused(BALL) else { return };
    let holds = |app: &App| app.frame.hands.map(|hand| hand.is_some());
    let place = inside(window.app());
    window.drag("the first hand pulls", place, |app| holds(app) == [true, false]);
    window.key("B keeps it", Key::B, |app| app.mouse == Which::Second);
    window.release("the first hand holds on", |app| holds(app) == [true, false] && app.hands[1].is_none());
    let place = known_place(window.app(), 7);
    window.drag("the second hand pulls, too", place, |app| holds(app) == [true, true]);
    window.release("the second hand lets go", |app| holds(app) == [true, false]);
    let place = kept(window.app());
    window.drag("the mouse takes the kept grip again", place, |app| {
        app.mouse == Which::First && holds(app) == [true, false]
    });
    window.release("the first hand lets go", |app| holds(app) == [false, false]);
    let place = inside(window.app());
    window.drag("the first hand pulls", place, |app| holds(app) == [true, false]);
    window.key("B keeps it", Key::B, |app| app.mouse == Which::Second);
    window.release("the first hand holds on", |app| holds(app) == [true, false]);
    window.key("B lets the kept grip go", Key::B, |app| holds(app) == [false, false]);
}

/// Returns the place of the first hand's grip on the screen.
fn kept(app: &App) -> Pos2 {
    let [point, _] = app.frame.hand(Which::First).unwrap();
    app.port.to_screen(&Vector3::from(point)).unwrap()
}

/// Plays, takes hold and pulls upwards, until the body is at rest. Then the hand's force equals the force of
/// its spring. The hand still holds when the window closes. Returns a replay of the recording.
fn pulled(scene: &str) -> Option<Replayed> {
    let mut window = Rehearsal::paused(scene)?;
    window.key("Space plays", Key::Space, |app| app.frame.playing);
    let start = inside(window.app());
    let reach = 0.12 * window.app().port.rect.height();
    window.take(start);
    for part in 1..=10 {
        let place = start - vec2(0.0, reach * part as f32 / 10.0);
        let before = window.app().frame.time;
        window.give("the mouse pulls", [Event::PointerMoved(place)], |app| {
            (part < 3 || app.pulls()) && app.frame.time - before >= PACE
        });
    }
    window.wait("the hand pulls", |app| {
        app.frame.hand(app.mouse).is_some_and(|[_, force]| Vector3::from(force).norm() > 0.0)
    });
    let began = window.app().frame.time;
    window.wait("the pulled body comes to rest", |app| {
        assert_eq!(app.frame.failure, None);
        app.frame.time - began >= SETTLING
    });
    assert_spring(window.app(), start - vec2(0.0, reach));
    let recording = window.close();
    Some(replay(&scenes::world(scene).unwrap(), &recording).unwrap())
}

/// The hand's force points from where it holds to where the mouse is, with no more than its stiffness.
fn assert_spring(app: &App, place: Pos2) {
    let [point, force] = app.frame.hand(app.mouse).expect("something is held").map(Vector3::from);
    let held = app.hands[app.mouse as usize].expect("the mouse leads it");
    let there = on_plane(&app.port.camera, &held, app.port.in_picture(place), app.port.aspect());
    let along = there - point;
    let stiffness = force.dot(&along) / along.norm_squared();
    let off = (force - along * stiffness).norm() / force.norm();
    assert!(
        off < 1e-3 && stiffness > 0.0 && stiffness <= app.stiffness * 1.001,
        "{force:?} N at {along:?} m from the mouse, by a spring of {} N/m",
        app.stiffness
    );
}

#[test]
fn the_mouse_pulls_by_a_spring() {
    let Some(replayed) = pulled(BALL) else { return };
    assert!(replayed.largest_force > 0.01 && replayed.held.is_some(), "{replayed:?}");
}

#[test]
fn the_mouse_pulls_a_body_on_a_gpu() {
    let Some(replayed) = pulled(&on_device()) else { return };
    assert!(replayed.largest_force > 0.01 && replayed.held.is_some(), "{replayed:?}");
}
