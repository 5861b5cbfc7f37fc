//! The parts of the rehearsal with two hands, and with tools that are led by keys.

use std::cell::RefCell;
use std::rc::Rc;

use eframe::egui::{Event, Key, Modifiers, PointerButton, Pos2, vec2};
use pliant_geometry::Vector3;

use super::App;
use super::self_test::{Cue, button, holding, inside, known_pixel, press};
use crate::hand::Which;
use crate::samples::{HAND, SECOND_HAND};

const LEFT: PointerButton = PointerButton::Primary;

/// The mouse goes somewhere and is pressed, then it moves on: something comes of it.
fn drag(
    what: &str,
    place: impl Fn(&App) -> Pos2 + Clone + 'static,
    mut check: impl FnMut(&App) -> bool + 'static,
) -> [Cue; 2] {
    let at = place.clone();
    [
        Cue::new(
            "the mouse is pressed",
            move |app| vec![Event::PointerMoved(at(app)), button(at(app), LEFT, true)],
            |_| Ok(true),
        ),
        Cue::new(
            what,
            move |app| vec![Event::PointerMoved(place(app) + vec2(14.0, 0.0))],
            move |app| Ok(check(app)),
        ),
    ]
}

fn release(what: &str, mut check: impl FnMut(&App) -> bool + 'static) -> Cue {
    let give = |app: &mut App| {
        let place = app.context.pointer_latest_pos().unwrap_or_default();
        vec![button(place, LEFT, false)]
    };
    Cue::new(what, give, move |app| Ok(check(app)))
}

/// What the first hand holds is kept with B, the second hand pulls beside it, and what is kept is taken again and let go.
pub(super) fn two_hands() -> Vec<Cue> {
    let elsewhere = |app: &App| known_pixel(app, 7).map_or_else(|| inside(app), |(place, _)| place);
    let kept = |app: &App| {
        let point = app.frame.hand(Which::First).map(|[point, _]| Vector3::from(point));
        point.and_then(|point| app.port.to_screen(&point)).unwrap_or_default()
    };
    let holds = |app: &App| app.frame.hands.map(|hand| hand.is_some());
    let place = Rc::new(RefCell::new(Pos2::ZERO));
    let there = place.clone();
    let mut cues = Vec::from(drag("the first hand pulls", inside, move |app| holds(app) == [true, false]));
    cues.push(Cue::key("B keeps it", Key::B, |app| app.mouse == Which::Second));
    cues.push(release("the first hand holds on", move |app| {
        holds(app) == [true, false] && app.hands[1].is_none()
    }));
    cues.extend(drag("the second hand pulls, too", elsewhere, move |app| holds(app) == [true, true]));
    cues.push(release("the second hand lets go", move |app| holds(app) == [true, false]));
    let find = move |app: &App| {
        // It moves along while it is dragged.
        let known = *there.borrow();
        if known == Pos2::ZERO {
            *there.borrow_mut() = kept(app)
        }
        *there.borrow()
    };
    cues.extend(drag("what is kept is taken again", find, move |app| {
        app.mouse == Which::First && holds(app) == [true, false]
    }));
    cues.push(release("the first hand lets go", move |app| holds(app) == [false, false]));
    cues.extend(drag("the first hand pulls", inside, move |app| holds(app) == [true, false]));
    cues.push(Cue::key("B keeps it", Key::B, |app| app.mouse == Which::Second));
    cues.push(release("the first hand holds on", move |app| holds(app) == [true, false]));
    cues.push(Cue::key("B lets go what is kept", Key::B, move |app| holds(app) == [false, false]));
    cues
}

/// The tool in a hand: where it is held [m], and the sum of all points that are drawn [m].
fn pose(app: &App) -> Option<[Vector3; 2]> {
    let hand = Which::BOTH.into_iter().find(|&which| app.is_led(which))?;
    Some([app.frame.hand(hand)?[0].into(), app.port.points.iter().sum()])
}

/// A key is held down until what is led has changed as it should, then let go.
fn led(
    what: &str,
    key: Key,
    has_changed: impl Fn(&App, [Vector3; 2], [Vector3; 2]) -> bool + 'static,
) -> [Cue; 2] {
    let before = Rc::new(RefCell::new(None));
    let then = before.clone();
    [
        Cue::new(
            what,
            move |app| {
                *before.borrow_mut() = pose(app);
                vec![press(key, true)]
            },
            move |app| {
                let (Some(before), Some(now)) = (*then.borrow(), pose(app)) else { return Ok(false) };
                Ok(has_changed(app, before, now))
            },
        ),
        Cue::new("the key is let go", move |_| vec![press(key, false)], |_| Ok(true)),
    ]
}

/// K takes a tool beside the hand of the mouse; keys move it, turn it and close its jaws; K lets go after the last one.
pub(super) fn tools() -> Vec<Cue> {
    // Farther than a step of the mouse, as seen by the camera.
    let goes = |axis: usize, sign: f64| {
        move |app: &App, [before, _]: [Vector3; 2], [now, _]: [Vector3; 2]| {
            sign * (now - before).dot(&app.port.camera.axes()[axis]) > 0.01 * app.port.camera.height
        }
    };
    let turns = |_: &App, [held, before]: [Vector3; 2], [now, after]: [Vector3; 2]| {
        (after - before).norm() > 1e-3 && (now - held).norm() < 1e-4
    };
    let mut cues = vec![
        Cue::key("Space plays", Key::Space, |app| app.frame.playing),
        Cue::key("K takes a tool, whose force is plotted", Key::K, |app| {
            let plotted = [HAND, SECOND_HAND].map(|name| app.plotted.contains(name));
            app.led.is_some_and(|(_, which)| {
                app.frame.tools[which as usize].is_some() && plotted[which as usize]
            })
        }),
    ];
    cues.extend(led("an arrow moves it", Key::ArrowUp, goes(1, 1.0)));
    cues.extend(led("the other arrow moves it back", Key::ArrowDown, goes(1, -1.0)));
    cues.extend(led("an arrow moves it sideways", Key::ArrowRight, goes(0, 1.0)));
    cues.extend(led("Page Up moves it away", Key::PageUp, goes(2, -1.0)));
    cues.extend(led("End closes its jaws", Key::End, turns));
    cues.extend(led("Home opens its jaws", Key::Home, turns));
    cues.push(holding(Modifiers::SHIFT));
    cues.extend(led("Shift and an arrow turn it", Key::ArrowLeft, turns));
    cues.push(holding(Modifiers::NONE));
    let free = |app: &App| app.frame.hands == [None; 2] && app.led.is_none();
    cues.push(Cue::key("K lets go after the last tool", Key::K, free));
    cues
}
