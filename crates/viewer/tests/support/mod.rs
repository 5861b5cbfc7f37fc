//! A scene of a few lines, and waiting for its frames.

use std::time::{Duration, Instant};

use pliant_picture::Subject;
use pliant_scene::Scene;
use pliant_scene::source::Source;
use pliant_viewer::{Frame, Session, Stage};

/// A ball held at one end.
pub const BALL: &str = r#"
[scene]
until = 100
[run]
threads = 1
[law.tissue]
type = "neo-hookean"
young-modulus = 5e3
poisson-ratio = 0.4
[body.ball]
mesh = { ellipsoid = { radii = [0.05, 0.04, 0.03] }, edge = 0.012 }
law = "tissue"
density = 1000
damping = 60
[constraint.base]
type = "fix"
body = "ball"
nodes = { half-space = { point = [-0.03, 0, 0], normal = [-1, 0, 0] } }
"#;

pub fn stage(text: &str) -> Stage {
    let source = Source::parse("ball.toml", text).unwrap_or_else(|error| panic!("{}", error.plain()));
    let scene = Scene::from_source(source, ".".into()).unwrap_or_else(|error| panic!("{}", error.plain()));
    let built = pliant_scene::build(&scene).unwrap_or_else(|error| panic!("{}", error.plain()));
    let plan = pliant_scene::plan(&scene, &built).unwrap_or_else(|error| panic!("{}", error.plain()));
    Stage { scene, built, plan }
}

pub fn subject(stage: &Stage) -> Subject {
    let mut live = pliant_scene::live(&stage.scene, &stage.built, &stage.plan).unwrap();
    Subject::new(live.mesh().unwrap())
}

/// The first frame that is as wanted.
pub fn wait(session: &mut Session, wanted: impl Fn(&Frame) -> bool) -> Frame {
    let started = Instant::now();
    loop {
        let (_, frame) = session.look();
        if wanted(frame) {
            return frame.clone();
        }
        assert!(started.elapsed() < Duration::from_secs(60), "no such frame: {frame:?}");
        assert!(!session.has_ended(), "the solver's thread has ended");
        std::thread::sleep(Duration::from_millis(2));
    }
}
