//! Scenes of a few lines, and waiting for their frames.
#![allow(dead_code)] // Each test takes what it needs.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use pliant_format::Scene;
use pliant_format::source::Source;
use pliant_picture::Subject;
use pliant_scene::World;
use pliant_testing::scenes;
use pliant_viewer::{Frame, Session};

/// A ball held at one end.
pub const BALL: &str = include_str!("ball.toml");

/// The organ and the relaxing tissue of the example, of larger cells.
pub const LIVER: &str = r#"
[scene]
until = 100
[run]
threads = 1
precision = "single"
[law.parenchyma]
type = "transversely-isotropic"
shear-modulus = 3.0e3
bulk-modulus = 29.0e3
fibre-modulus = 6.0e3
fibre = [0, 1, 0]
prony = [{ part = "isochoric", weight = 0.5, time = 0.58 }]
[body.liver]
mesh = { organ = "liver", scale = 1.25, edge = 0.025 }
law = "parenchyma"
density = 1060
damping = 5
[constraint.diaphragm]
type = "fix"
body = "liver"
nodes = { half-space = { point = [-0.095, 0, 0], normal = [-1, 0, 0] } }
"#;

/// A strip of a shell, held at one end, with a solver of shells.
pub fn shell(solver: &str) -> World {
    let more = if solver == "static" { "load-steps = 10\n" } else { "" };
    world(&scenes::strip(scenes::SHELL, &format!("threads = 1\nsolver = '{solver}'\n{more}")))
}

pub fn world(text: &str) -> World {
    scenes::world(text).unwrap()
}

pub fn staged(source: Source, folder: PathBuf) -> World {
    let scene = Scene::from_source(source, folder).unwrap_or_else(|error| panic!("{}", error.plain()));
    World::new(&scene).unwrap_or_else(|error| panic!("{}", error.plain()))
}

pub fn subject(world: &World) -> Subject {
    let mut live = pliant_run::Live::new(&std::sync::Arc::new(world.clone())).unwrap();
    Subject::new(live.mesh().unwrap())
}

/// The first frame that is as wanted, within a minute.
pub fn wait(session: &mut Session, wanted: impl Fn(&Frame) -> bool) -> Frame {
    wait_up_to(Duration::from_secs(60), session, wanted)
}

/// The first frame that is as wanted.
pub fn wait_up_to(limit: Duration, session: &mut Session, wanted: impl Fn(&Frame) -> bool) -> Frame {
    let started = Instant::now();
    loop {
        let (_, frame) = session.look();
        if wanted(frame) {
            return frame.clone();
        }
        assert!(
            started.elapsed() < limit,
            "no such frame in {limit:?}: t = {} s, {:?}",
            frame.time,
            frame.failure.as_ref().or(frame.note.as_ref())
        );
        assert!(!session.has_ended(), "the solver's thread has ended");
        std::thread::sleep(Duration::from_millis(2));
    }
}
