//! Tests of the camera, of the view, and of saved results.

use eframe::egui::{
    Color32, CursorIcon, Event, Key, Modifiers, MouseWheelSource, MouseWheelUnit, OutputCommand, Pos2,
    TouchPhase, vec2,
};
use pliant_format::tables::LookTable;

use super::seen::{inside, known_pixels};
use super::{BALL, RIGHT, Rehearsal, on_device};
use crate::window::App;
use crate::window::keep::Taking;

/// Pixels at which is picked.
const PICKS: usize = 100;
/// Least change of a colour channel of a transparent body.
const CHANGE: u8 = 20;

/// The mouse over a pixel on the body finds the triangle that lies there; beside the body it finds nothing.
fn picks(scene: &str, count: usize) {
    let Some(mut window) = Rehearsal::paused(scene) else { return };
    let known: Vec<(Pos2, u32)> = known_pixels(window.app()).take(count).collect();
    assert_eq!(known.len(), count, "the body covers too few pixels");
    for (place, triangle) in known {
        window.frame([Event::PointerMoved(place)]);
        let app = window.app();
        let hit = app.hit(app.port.in_picture(place));
        assert_eq!(hit.map(|(point, _)| point.triangle), Some(triangle), "at {place:?}");
        assert_eq!(window.harness.output().platform_output.cursor_icon, CursorIcon::Grab, "at {place:?}");
    }
    let place = beside(window.app());
    window.frame([Event::PointerMoved(place)]);
    assert!(window.app().hit(window.app().port.in_picture(place)).is_none());
    assert_eq!(window.harness.output().platform_output.cursor_icon, CursorIcon::Default);
}

#[test]
fn the_mouse_finds_the_triangle_under_a_pixel() {
    picks(BALL, PICKS);
}

#[test]
fn the_mouse_finds_the_triangle_of_a_body_on_a_gpu() {
    picks(&on_device(), 10);
}

#[test]
fn keys_play_step_and_start_anew() {
    let Some(mut window) = Rehearsal::paused(BALL) else { return };
    window.key("`.` does one step", Key::Period, |app| app.frame.steps == 1);
    window.key("R starts anew", Key::R, |app| app.frame.steps == 0);
    window.key("Space plays", Key::Space, |app| app.frame.playing && app.frame.steps > 0);
    window.key("Space pauses", Key::Space, |app| !app.frame.playing);
    window.key("R starts anew", Key::R, |app| app.frame.steps == 0);
}

/// Each switch twice: it shows something, and hides it again.
#[test]
fn keys_show_and_hide() {
    let Some(mut window) = Rehearsal::paused(BALL) else { return };
    let mut turns = |what: &str, key, switch: fn(&App) -> bool| {
        let before = switch(window.app());
        window.key(what, key, |app| switch(app) != before);
    };
    for _ in 0..2 {
        turns("E shows or hides edges", Key::E, |app| app.port.style.edges);
        turns("G shows or hides the shape at rest", Key::G, |app| app.port.style.ghost);
        turns("C shows or hides a section", Key::C, |app| app.port.style.clip.is_some());
        turns("M shows or hides where the body is held", Key::M, |app| !app.frame.marks.is_empty());
    }
}

#[test]
fn the_list_of_what_can_be_opened_comes_and_goes() {
    let Some(mut window) = Rehearsal::paused(BALL) else { return };
    window.hold(Modifiers::COMMAND | Modifiers::CTRL);
    window.key("Ctrl and O lists what can be opened", Key::O, |app| {
        app.browser.shown && !app.browser.entries.is_empty()
    });
    window.hold(Modifiers::NONE);
    window.key("Escape closes the list", Key::Escape, |app| !app.browser.shown);
}

#[test]
fn the_view_is_copied() {
    let Some(mut window) = Rehearsal::paused(BALL) else { return };
    let text = window.app().view_text();
    window.click_on("Copy view");
    let commands = &window.harness.output().platform_output.commands;
    let copied = commands.iter().find_map(|command| match command {
        OutputCommand::CopyText(text) => Some(text.as_str()),
        _ => None,
    });
    assert_eq!(copied, Some(text.as_str()));
    assert!(window.app().message.is_some());
}

#[test]
fn a_film_is_taken_and_written() {
    let Some(mut window) = Rehearsal::painted(BALL) else { return };
    window.key("V begins a film", Key::V, |app| app.filming.pictures.len() >= 3);
    window.key("V ends the film, which is written", Key::V, |app| {
        app.message.as_ref().is_some_and(|message| message.text.contains("-film.png` was written"))
    });
    let film = std::fs::read(window.beside("ball-film.png")).unwrap();
    assert!(film.windows(4).any(|part| part == b"acTL"), "an animated PNG");
}

/// The mouse turns the view and comes nearer; keys go back to where all is seen, and to the sides.
#[test]
fn mouse_and_keys_lead_the_camera() {
    let Some(mut window) = Rehearsal::paused(BALL) else { return };
    let place = beside(window.app());
    let there = place + vec2(60.0, 10.0);
    let pressed = window.button(place, RIGHT, true);
    window.frame([Event::PointerMoved(place), pressed]);
    window.give("the right button turns", [Event::PointerMoved(there)], |app| {
        (app.port.camera.azimuth - app.port.home.azimuth).abs() > 5.0
    });
    let before = window.app().port.camera.height;
    let wheel = Event::MouseWheel {
        unit: MouseWheelUnit::Line,
        delta: vec2(0.0, 3.0),
        phase: TouchPhase::Move,
        source: MouseWheelSource::Wheel,
        modifiers: Modifiers::NONE,
    };
    let released = window.button(there, RIGHT, false);
    window.give("the wheel comes nearer", [released, wheel], |app| app.port.camera.height < 0.95 * before);
    // A wheel glides.
    let mut height = 0.0;
    window.wait("the wheel comes to rest", |app| {
        std::mem::replace(&mut height, app.port.camera.height) == app.port.camera.height
    });
    window.key("F shows all", Key::F, sees_all);

    window.app_mut().port.camera.zoom(0.5);
    let sides = [
        (Key::Num1, 0.0, 0.0),
        (Key::Num2, 180.0, 0.0),
        (Key::Num5, 0.0, 90.0),
        (Key::Num6, 0.0, -90.0),
        (Key::Num4, 270.0, 0.0),
        (Key::Num3, 90.0, 0.0),
    ];
    for (key, azimuth, elevation) in sides {
        window.key("a number looks from a side", key, |app| {
            (app.port.camera.azimuth - azimuth).abs() < 1e-9
                && (app.port.camera.elevation - elevation).abs() < 0.2
                && app.port.camera == app.port.fitted()
        });
    }
    window.key("0 looks as at the start", Key::Num0, |app| app.port.camera.azimuth == app.port.home.azimuth);
    window.key("F shows all", Key::F, sees_all);
}

fn sees_all(app: &App) -> bool {
    (app.port.camera.height / app.port.fitted().height - 1.0).abs() < 1e-6
}

/// A place in the picture that no body covers.
fn beside(app: &App) -> Pos2 {
    app.port.rect.min + vec2(20.0, 150.0)
}

/// The middle of a half-transparent body shows the background, and the copied view says so; an opaque one
/// looks as before.
#[test]
fn one_sees_through_a_body() {
    let Some(mut window) = Rehearsal::painted(BALL) else { return };
    let opaque = middle(&mut window, None, |_| true);
    assert!(!window.app().view_text().contains("look."));
    middle(&mut window, Some(0.2), |colour| differ(opaque, colour));
    assert!(window.app().view_text().contains("opacity = 0.2"), "{}", window.app().view_text());
    middle(&mut window, None, |colour| !differ(opaque, colour));
    assert!(!window.app().view_text().contains("look."));
}

fn differ(one: Color32, other: Color32) -> bool {
    one.to_array().into_iter().zip(other.to_array()).any(|(a, b)| a.abs_diff(b) > CHANGE)
}

/// Gives the first body an opacity, and takes pictures until the colour in its middle is right.
fn middle(window: &mut Rehearsal, opacity: Option<f64>, is_right: impl Fn(Color32) -> bool) -> Color32 {
    let app = window.app_mut();
    let name = app.names.bodies.values().next().cloned().unwrap();
    app.view.look.clear();
    app.view.look.extend(opacity.map(|opacity| (name, LookTable { opacity, ..LookTable::default() })));
    app.look_at_regions();
    let taking = Taking::default();
    let mut found = Color32::TRANSPARENT;
    taking.ask(&window.harness.ctx);
    window.wait("the middle of the body looks right", |app| {
        let Some(image) = taking.taken() else { return false };
        let place = inside(app) * app.context.pixels_per_point();
        found = image.pixels[place.y as usize * image.size[0] + place.x as usize];
        taking.ask(&app.context);
        is_right(found)
    });
    found
}
