//! What a window does by itself before it closes: it takes a picture of itself, or rehearses what a user would do, with events of
//! mouse and keys that it gives to itself.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::path::PathBuf;
use std::rc::Rc;
use std::time::{Duration, Instant};

use eframe::egui::{self, Event, Key, Modifiers, MouseWheelUnit, PointerButton, Pos2, vec2};
use pliant_geometry::Vector3;
use pliant_picture::{Camera, Projection};

use super::App;
use super::glass::glass;
use super::grasping::{tools, two_hands};
use super::keep::Taking;
use super::picture::on_plane;
use super::undo::Act;

/// What a window does by itself before it closes.
#[derive(Clone, Debug)]
pub enum SelfTest {
    /// Plays, and writes a picture of itself.
    Portrait {
        /// Simulated time [s] until then.
        after: f64,
        /// Where to, as PNG.
        file: PathBuf,
    },
    /// Tries what a user would: looks, picks, presses keys, pins, plays, and pulls; the hand still holds when it closes.
    Rehearsal {
        /// Where to write a picture of itself meanwhile.
        file: Option<PathBuf>,
    },
}

/// Frames drawn before anything else.
const FRAMES: u64 = 10;
/// Pixels at which is picked.
const PICKS: u64 = 100;
/// Wall time in which what has to happen does.
const PATIENCE: Duration = Duration::from_secs(180);
/// Wall time for which a button is pressed in one of the clicks: longer than a user's.
const SLOW: Duration = Duration::from_secs(1);
/// Simulated time [s] in which what is pulled comes to rest.
const SETTLING: f64 = 1.0;

/// Events of one frame.
type Give = Box<dyn FnOnce(&mut App) -> Vec<Event>>;
/// Whether what has to come of them did; what is wrong.
type Check = Box<dyn FnMut(&App) -> Result<bool, String>>;

/// What is done in one frame, and what has to come of it before the next.
pub(super) struct Cue {
    what: String,
    give: Option<Give>,
    check: Check,
}

impl Cue {
    pub fn new(
        what: impl Into<String>,
        give: impl FnOnce(&mut App) -> Vec<Event> + 'static,
        check: impl FnMut(&App) -> Result<bool, String> + 'static,
    ) -> Self {
        Self { what: what.into(), give: Some(Box::new(give)), check: Box::new(check) }
    }

    /// Keys of the keyboard, and what has to come of them.
    pub fn key(what: &str, key: Key, mut check: impl FnMut(&App) -> bool + 'static) -> Self {
        Self::new(what, move |_| vec![press(key, true), press(key, false)], move |app| Ok(check(app)))
    }

    /// Waits.
    fn wait(what: &str, mut check: impl FnMut(&App) -> bool + 'static) -> Self {
        Self::new(what, |_| Vec::new(), move |app| Ok(check(app)))
    }
}

/// A self-test under way.
pub(super) struct RunningTest {
    cues: VecDeque<Cue>,
    since: Instant,
    told: fn(&App) -> String,
}

impl RunningTest {
    /// In a scene with or without tools.
    pub(super) fn new(self_test: SelfTest, has_tools: bool) -> Self {
        let (cues, told): (_, fn(&App) -> String) = match self_test {
            SelfTest::Portrait { after, file } => {
                let mut cues = VecDeque::from([
                    Cue::key("Space plays", Key::Space, |app| app.frame.playing),
                    Cue::wait("it plays", move |app| app.frame.time >= after || app.frame.failure.is_some()),
                    Cue::key("Space pauses", Key::Space, |app| !app.frame.playing),
                ]);
                cues.extend(portrait(file));
                (cues, shown)
            }
            SelfTest::Rehearsal { file } => {
                // What can be pulled lies under tools.
                let rehearsed = if has_tools {
                    vec![tools()]
                } else {
                    vec![
                        (0..PICKS).map(picking).collect(),
                        keys(),
                        camera(),
                        glass(),
                        pinning(),
                        following(),
                        undoing(),
                        two_hands(),
                        pulling(),
                    ]
                };
                let mut cues: VecDeque<Cue> = drawing().collect();
                cues.extend(rehearsed.into_iter().flatten());
                cues.extend(file.into_iter().flat_map(portrait));
                (cues, tried)
            }
        };
        Self { cues, since: Instant::now(), told }
    }

    /// The events of a frame.
    pub(super) fn give(&mut self, app: &mut App, events: &mut Vec<Event>) {
        if let Some(give) = self.cues.front_mut().and_then(|cue| cue.give.take()) {
            events.extend(give(app));
            self.since = Instant::now();
        }
    }

    /// After a frame: what is to be told once all is done, or what went wrong.
    pub(super) fn check(&mut self, app: &App) -> Option<Result<String, String>> {
        let Some(cue) = self.cues.front_mut() else { return Some(Ok((self.told)(app))) };
        if cue.give.is_some() {
            return None;
        }
        match (cue.check)(app) {
            Ok(true) => {
                self.cues.pop_front();
                None
            }
            Ok(false) if self.since.elapsed() < PATIENCE => None,
            Ok(false) => Some(Err(format!("waited in vain: {}", cue.what))),
            Err(wrong) => Some(Err(format!("{}: {wrong}", cue.what))),
        }
    }
}

/// What was tried.
fn tried(app: &App) -> String {
    if !app.world.scene.tools.is_empty() {
        return format!("{FRAMES} frames drawn, tools led by keys");
    }
    format!("{FRAMES} frames drawn, {PICKS} pixels picked, keys, camera, pins and hands tried")
}

/// What a picture of the window shows.
fn shown(app: &App) -> String {
    let told: String = app.banner().iter().map(|told| format!(": {}", told.text)).collect();
    let first = app.first_picture.unwrap_or_default();
    let frame = 1e3 * app.frame_seconds;
    format!(
        "{} at t = {:.3} s{told}; first picture after {first:.2} s, frames of {frame:.1} ms ({})",
        app.title(),
        app.frame.time,
        app.adapter
    )
}

pub(super) fn press(key: Key, pressed: bool) -> Event {
    Event::Key { key, physical_key: None, pressed, repeat: false, modifiers: Modifiers::NONE }
}

pub(super) fn button(pos: Pos2, button: PointerButton, pressed: bool) -> Event {
    Event::PointerButton { pos, button, pressed, modifiers: Modifiers::NONE }
}

fn drawing() -> impl Iterator<Item = Cue> {
    [Cue::wait("frames are drawn", |app| app.drawn >= FRAMES && !app.frame.points.is_empty())].into_iter()
}

/// The pixel of that number on the body, and the triangle that covers it, if it is far from all edges; found by projecting all
/// triangles, where picking sends a ray.
pub(super) fn known_pixel(app: &App, number: u64) -> Option<(Pos2, u32)> {
    let rect = app.port.rect;
    let aspect = f64::from(rect.width() / rect.height());
    // Halton's sequence over the picture: places on the body, counted.
    let places = (1..20_000).map(|index| rect.min + vec2(halton(index, 2), halton(index, 3)) * rect.size());
    let known = |place: Pos2| Some((place, covering(app, app.port.in_picture(place), aspect)?));
    places.filter_map(known).nth(number as usize)
}

/// The number of that index in Halton's sequence (1960) to a base.
fn halton(mut index: u32, base: u32) -> f32 {
    let (mut sum, mut part) = (0.0, 1.0);
    while index > 0 {
        part /= base as f32;
        sum += part * (index % base) as f32;
        index /= base;
    }
    sum
}

/// The nearest triangle whose projection covers a place.
fn covering(app: &App, [x, y]: [f64; 2], aspect: f64) -> Option<u32> {
    let camera = &app.port.camera;
    let mut nearest: Option<(f64, u32, f64)> = None;
    for (corners, number) in app.port.subject.triangles().zip(0..) {
        let corners = corners.map(|point| app.port.points[point as usize]);
        let [Some(a), Some(b), Some(c)] = corners.map(|corner| camera.place(&corner, aspect)) else {
            continue;
        };
        let cross = |p: [f64; 2], q: [f64; 2]| (p[0] - x) * (q[1] - y) - (p[1] - y) * (q[0] - x);
        let areas = [cross(b, c), cross(c, a), cross(a, b)];
        let weights = areas.map(|area| area / areas.iter().sum::<f64>());
        let least = weights.into_iter().fold(f64::INFINITY, f64::min);
        let depth = depth(camera, &corners, &weights);
        if least >= 0.0 && nearest.is_none_or(|(known, ..)| depth < known) {
            nearest = Some((depth, number, least));
        }
    }
    nearest.filter(|(.., least)| *least > 0.02).map(|(_, number, _)| number)
}

/// Distance [m] along the view of a point with these weights in the projection: 1/z is linear there in perspective, z otherwise.
fn depth(camera: &Camera, corners: &[Vector3; 3], weights: &[f64; 3]) -> f64 {
    let (eye, towards) = (camera.eye(), camera.axes()[2]);
    let depths = corners.iter().map(|corner| (eye - corner).dot(&towards)).zip(weights);
    match camera.projection {
        Projection::Perspective => 1.0 / depths.map(|(z, weight)| weight / z).sum::<f64>(),
        Projection::Orthographic => depths.map(|(z, weight)| weight * z).sum(),
    }
}

/// The mouse over a pixel on the body finds the triangle that lies there.
fn picking(number: u64) -> Cue {
    let known = Rc::new(RefCell::new(None));
    let found = known.clone();
    Cue::new(
        format!("picking at pixel {number}"),
        move |app| {
            *known.borrow_mut() = known_pixel(app, number);
            known.borrow().iter().map(|(place, _)| Event::PointerMoved(*place)).collect()
        },
        move |app| {
            let Some((place, triangle)) = *found.borrow() else {
                return Err("the body covers too few pixels".into());
            };
            match app.hover {
                Some((point, _)) if point.triangle == triangle => Ok(true),
                other => Err(format!("{place:?} shows triangle {triangle}, picked was {other:?}")),
            }
        },
    )
}

fn keys() -> Vec<Cue> {
    vec![
        Cue::key("`.` does one step", Key::Period, |app| app.frame.steps == 1),
        Cue::key("R starts anew", Key::R, |app| app.frame.steps == 0),
        Cue::key("Space plays", Key::Space, |app| app.frame.playing && app.frame.steps > 0),
        Cue::key("Space pauses", Key::Space, |app| !app.frame.playing),
        Cue::key("R starts anew", Key::R, |app| app.frame.steps == 0),
        turns("E shows or hides edges", Key::E, |app| app.port.style.edges),
        Cue::new(
            "the view is copied",
            |app| {
                app.copy_view();
                Vec::new()
            },
            |app| Ok(app.message.is_some()),
        ),
        holding(Modifiers::COMMAND | Modifiers::CTRL),
        Cue::key("Ctrl and O lists what can be opened", Key::O, |app| {
            app.browser.shown && !app.browser.entries.is_empty()
        }),
        holding(Modifiers::NONE),
        Cue::key("V begins a film", Key::V, |app| app.filming.pictures.len() >= 3),
        Cue::key("V ends the film, which is written", Key::V, |app| {
            let told = app.message.as_ref().and_then(|told| told.text.split('`').nth(1));
            let film = told.filter(|path| path.contains("-film"));
            film.is_some_and(|path| std::fs::remove_file(path).is_ok())
        }),
        Cue::key("Escape closes the list", Key::Escape, |app| !app.browser.shown),
        Cue::key("M shows where the body is held", Key::M, |app| !app.frame.marks.is_empty()),
        Cue::key("M hides it", Key::M, |app| app.frame.marks.is_empty()),
        turns("G shows or hides the shape at rest", Key::G, |app| app.port.style.ghost),
        turns("C shows or hides a section", Key::C, |app| app.port.style.clip.is_some()),
        turns("C shows or hides a section", Key::C, |app| app.port.style.clip.is_some()),
        turns("G shows or hides the shape at rest", Key::G, |app| app.port.style.ghost),
        turns("E shows or hides edges", Key::E, |app| app.port.style.edges),
    ]
}

/// A key that turns a switch.
fn turns(what: &str, key: Key, switch: fn(&App) -> bool) -> Cue {
    let before = Rc::new(RefCell::new(false));
    let then = before.clone();
    let give = move |app: &mut App| {
        *before.borrow_mut() = switch(app);
        vec![press(key, true), press(key, false)]
    };
    Cue::new(what, give, move |app| Ok(switch(app) != *then.borrow()))
}

/// Turns, comes nearer, and goes back to where all is seen.
fn camera() -> Vec<Cue> {
    let beside = |app: &App| app.port.rect.min + vec2(20.0, 150.0);
    let right = PointerButton::Secondary;
    let before = Rc::new(RefCell::new(0.0));
    let then = before.clone();
    vec![
        Cue::new(
            "the mouse goes beside the body",
            move |app| vec![Event::PointerMoved(beside(app)), button(beside(app), right, true)],
            |_| Ok(true),
        ),
        Cue::new(
            "the right button turns",
            move |app| vec![Event::PointerMoved(beside(app) + vec2(60.0, 10.0))],
            |app| Ok((app.port.camera.azimuth - app.port.home.azimuth).abs() > 5.0),
        ),
        Cue::new(
            "the wheel comes nearer",
            move |app| {
                let place = beside(app) + vec2(60.0, 10.0);
                *before.borrow_mut() = app.port.camera.height;
                vec![
                    button(place, right, false),
                    Event::MouseWheel {
                        unit: MouseWheelUnit::Line,
                        delta: vec2(0.0, 3.0),
                        phase: egui::TouchPhase::Move,
                        source: egui::MouseWheelSource::Wheel,
                        modifiers: Modifiers::NONE,
                    },
                ]
            },
            move |app| Ok(app.port.camera.height < 0.95 * *then.borrow()),
        ),
        // A wheel glides.
        Cue::wait("the wheel comes to rest", {
            let mut before = 0.0;
            move |app| std::mem::replace(&mut before, app.port.camera.height) == app.port.camera.height
        }),
        Cue::key("F shows all", Key::F, |app| {
            (app.port.camera.height / app.port.fitted().height - 1.0).abs() < 1e-6
        }),
    ]
}

/// A pixel on the body, well inside it.
pub(super) fn inside(app: &App) -> Pos2 {
    let seen = app.port.subject.surface_points();
    let places = seen.iter().filter_map(|&point| app.port.to_screen(&app.port.points[point as usize]));
    let (sum, count) = places.fold((egui::Vec2::ZERO, 0.0_f32), |(sum, n), p| (sum + p.to_vec2(), n + 1.0));
    let middle = (sum / count.max(1.0)).to_pos2();
    let hit = |place: &Pos2| app.hit(app.port.in_picture(*place)).is_some();
    if hit(&middle) { middle } else { known_pixel(app, 0).map_or(middle, |(place, _)| place) }
}

/// A click with P pins, another one on the pin takes it away.
fn pinning() -> Vec<Cue> {
    let left = PointerButton::Primary;
    let click = |what: &str, pins: usize| {
        [
            Cue::new(
                "the mouse goes to the body",
                move |app| vec![Event::PointerMoved(inside(app)), press(Key::P, true)],
                |_| Ok(true),
            ),
            Cue::new("a press", move |app| vec![button(inside(app), left, true)], {
                // As on a machine that is busy.
                let mut pressed = None;
                move |_| Ok(pressed.get_or_insert_with(Instant::now).elapsed() > SLOW)
            }),
            Cue::new(
                what,
                move |app| vec![button(inside(app), left, false)],
                move |app| Ok(app.frame.pins().len() == pins),
            ),
            Cue::new("P is let go", |_| vec![press(Key::P, false)], |_| Ok(true)),
        ]
    };
    click("a click with P pins", 1)
        .into_iter()
        .chain(click("a click with P on a pin takes it away", 0))
        .collect()
}

/// Keys such as Ctrl are held down from now on, or none.
pub(super) fn holding(modifiers: Modifiers) -> Cue {
    let held = move |app: &App| app.context.input(|input| input.modifiers.matches_exact(modifiers));
    Cue::new(
        "keys are held down",
        move |_| vec![Event::ModifiersChanged(modifiers)],
        move |app| Ok(held(app)),
    )
}

/// Looks from all sides; a click with Alt picks a point, which is read.
fn following() -> Vec<Cue> {
    let left = PointerButton::Primary;
    let side = |key, azimuth: f64, elevation: f64| {
        let there = move |app: &App| {
            (app.port.camera.azimuth - azimuth).abs() < 1e-9
                && (app.port.camera.elevation - elevation).abs() < 0.2
                && app.port.camera == app.port.fitted()
        };
        Cue::key("a number looks from a side", key, there)
    };
    vec![
        Cue::new(
            "the wheel comes nearer",
            |app| {
                app.port.camera.zoom(0.5);
                Vec::new()
            },
            |_| Ok(true),
        ),
        side(Key::Num1, 0.0, 0.0),
        side(Key::Num2, 180.0, 0.0),
        side(Key::Num5, 0.0, 90.0),
        side(Key::Num6, 0.0, -90.0),
        side(Key::Num4, 270.0, 0.0),
        side(Key::Num3, 90.0, 0.0),
        Cue::key("0 looks as at the start", Key::Num0, |app| {
            app.port.camera.azimuth == app.port.home.azimuth
        }),
        Cue::key("F shows all", Key::F, |app| {
            (app.port.camera.height / app.port.fitted().height - 1.0).abs() < 1e-6
        }),
        Cue::new("the mouse goes to the body", |app| vec![Event::PointerMoved(inside(app))], |_| Ok(true)),
        holding(Modifiers::ALT),
        Cue::new("a press", move |app| vec![button(inside(app), left, true)], |_| Ok(true)),
        Cue::new(
            "a click with Alt follows a point, which is read",
            move |app| vec![button(inside(app), left, false)],
            |app| Ok(app.read_points().len() == 1 && !app.frame.followed[0].about.is_empty()),
        ),
        Cue::new(
            "the mouse goes elsewhere on the body",
            |app| known_pixel(app, PICKS).map(|(place, _)| Event::PointerMoved(place)).into_iter().collect(),
            |_| Ok(true),
        ),
        Cue::new("a press", move |app| elsewhere(app, left, true), |_| Ok(true)),
        Cue::new(
            "a second point has its distance from the first",
            move |app| elsewhere(app, left, false),
            |app| {
                let [one, two] = &app.frame.followed[..] else { return Ok(false) };
                let metres = (two.place - one.place).norm();
                let lines = app.read_points();
                let told = lines[0].strip_prefix("1 to 2: ").and_then(|text| text.split_once(' '));
                let Some((number, unit)) = told else { return Err(lines[0].clone()) };
                let factor = if unit == "mm" { 1e-3 } else { 1.0 };
                let read = number.parse::<f64>().map_err(|error| error.to_string())? * factor;
                let off = (read / metres - 1.0).abs();
                if lines.len() == 3 && metres > 0.0 && off < 0.01 {
                    Ok(true)
                } else {
                    Err(format!("{lines:?}"))
                }
            },
        ),
        holding(Modifiers::NONE),
        Cue::new(
            "the mouse goes to the body",
            |app| vec![Event::PointerMoved(inside(app)), press(Key::I, true)],
            |_| Ok(true),
        ),
        Cue::new("a press", move |app| vec![button(inside(app), left, true)], |_| Ok(true)),
        Cue::new(
            "a click with I follows a point",
            move |app| vec![button(inside(app), left, false)],
            |app| Ok(app.frame.followed.len() == 3),
        ),
        Cue::new("I is let go", |_| vec![press(Key::I, false)], |_| Ok(true)),
    ]
}

/// A button at a second place on the body.
fn elsewhere(app: &App, which: PointerButton, pressed: bool) -> Vec<Event> {
    known_pixel(app, PICKS).map(|(place, _)| button(place, which, pressed)).into_iter().collect()
}

/// Pulls while the run is paused, and plays; Ctrl and Z goes back to before the pull.
fn undoing() -> Vec<Cue> {
    let left = PointerButton::Primary;
    let steps = Rc::new(RefCell::new(0));
    let then = steps.clone();
    let taken = |app: &App| app.acts.last().is_some_and(|act| matches!(act, Act::Pull(_)));
    vec![
        Cue::new(
            "the mouse takes hold",
            move |app| {
                *steps.borrow_mut() = app.frame.steps;
                vec![Event::PointerMoved(inside(app)), button(inside(app), left, true)]
            },
            |_| Ok(true),
        ),
        Cue::new(
            "the mouse pulls while the run is paused",
            |app| vec![Event::PointerMoved(inside(app) + vec2(12.0, 0.0))],
            move |app| Ok(taken(app)),
        ),
        Cue::key("Space plays", Key::Space, move |app| app.frame.steps > 0),
        Cue::new(
            "the hand lets go",
            move |app| vec![button(inside(app), left, false)],
            |app| Ok(app.hands == [None; 2]),
        ),
        Cue::key("Space pauses", Key::Space, |app| !app.frame.playing),
        holding(Modifiers::COMMAND | Modifiers::CTRL),
        Cue::key("Ctrl and Z goes back to before the pull", Key::Z, move |app| {
            app.frame.steps <= *then.borrow() && app.frame.held.is_empty()
        }),
        holding(Modifiers::NONE),
    ]
}

/// Plays, takes hold and pulls upwards, until all is at rest: the hand's force is that of its spring.
fn pulling() -> Vec<Cue> {
    let start = Rc::new(RefCell::new(Pos2::ZERO));
    let reach = |app: &App| 0.12 * app.port.rect.height();
    let mut cues = vec![Cue::key("Space plays", Key::Space, |app| app.frame.playing)];
    let from = start.clone();
    cues.push(Cue::new(
        "the mouse takes hold",
        move |app| {
            let place = inside(app);
            *from.borrow_mut() = place;
            vec![Event::PointerMoved(place), button(place, PointerButton::Primary, true)]
        },
        |_| Ok(true),
    ));
    for part in 1..=10 {
        let from = start.clone();
        cues.push(Cue::new(
            "the mouse pulls",
            move |app| vec![Event::PointerMoved(*from.borrow() - vec2(0.0, reach(app) * part as f32 / 10.0))],
            move |app| Ok(part < 3 || app.pulls()),
        ));
    }
    cues.push(Cue::wait("the hand pulls", |app| {
        app.frame.hand(app.mouse).is_some_and(|[_, force]| Vector3::from(force).norm() > 0.0)
    }));
    cues.push(Cue::new("what is pulled comes to rest", |_| Vec::new(), {
        let mut began = None;
        move |app| match &app.frame.failure {
            Some(failure) => Err(failure.clone()),
            None => Ok(app.frame.time - *began.get_or_insert(app.frame.time) >= SETTLING),
        }
    }));
    cues.push(Cue::new(
        "the force is that of the spring",
        |_| Vec::new(),
        move |app| {
            let place = *start.borrow() - vec2(0.0, reach(app));
            spring(app, app.port.in_picture(place)).map(|()| true)
        },
    ));
    cues
}

/// Whether the hand's force points from where it holds to where the mouse is, with no more than its stiffness.
fn spring(app: &App, place: [f64; 2]) -> Result<(), String> {
    let (Some([point, force]), Some(held)) = (app.frame.hand(app.mouse), &app.hands[app.mouse as usize])
    else {
        return Err("nothing is held".into());
    };
    let [point, force] = [point, force].map(Vector3::from);
    let along = on_plane(&app.port.camera, held, place, app.port.aspect()) - point;
    let stiffness = force.dot(&along) / along.norm_squared();
    let off = (force - along * stiffness).norm() / force.norm();
    if off < 1e-3 && stiffness > 0.0 && stiffness <= app.stiffness * 1.001 {
        return Ok(());
    }
    Err(format!("{force:?} N at {along:?} m from the mouse, by a spring of {} N/m", app.stiffness))
}

/// Writes what the window shows.
fn portrait(file: PathBuf) -> [Cue; 1] {
    let taking = Taking::default();
    let asking = taking.clone();
    let give = move |app: &mut App| {
        asking.ask(&app.context);
        Vec::new()
    };
    [Cue::new("a picture of the window", give, move |_| {
        taking.write(&file).map_or(Ok(false), |written| written.map(|()| true))
    })]
}
