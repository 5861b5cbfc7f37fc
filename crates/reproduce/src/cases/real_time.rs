//! Figure 6.8: tissue that is simulated as fast as it moves. A cube of 55,566 tetrahedra is stretched to and fro, and a liver is
//! pulled by one thread, as `pliant view` plays them: steps, and frames sixty times a second of simulated time.

use std::time::Instant;

use pliant_scene::source::{Source, Value};
use pliant_scene::{Built, Plan, Scene, live};

use crate::case::{Case, CaseError, Findings, Row};

/// Figure 6.8.
pub const CASE: Case = Case {
    id: "fig-6.8",
    title: "Fig. 6.8: tissue in real time",
    shows: "A cube of 55,566 brain-like tetrahedra whose face is stretched by 0 to 40 % to and fro, in steps of 0.7 ms, drawn \
            while it moves; on a GeForce 8800 GTX it kept real time. Here: simulated time over wall time on this machine's \
            processor (1 is real time), and the same of a transversely isotropic viscoelastic liver of 2,516 tetrahedra (the thesis's \
            has 2,428) over 10 s on one thread. A frame's forces, stresses and their means at the nodes are timed apart. \
            `pliant view` shows both.",
    corrections: &[],
    seconds: 20.0,
    compute,
};

const CUBE: &str = include_str!("../../../../scenes/stretched-cube/scene.toml");
const LIVER: &str = include_str!("../../../../scenes/liver/scene.toml");
/// Frames a simulated second.
const FRAMES: f64 = 60.0;

/// What playing a scene took.
struct Played {
    elements: usize,
    step: f64,
    /// Wall times of all steps and of all frames [s].
    stepping: f64,
    preparing: f64,
    frames: u64,
}

/// Plays a scene for some simulated seconds.
fn play(text: &str, seconds: f64, set: &[(&[&str], Value)]) -> Result<Played, CaseError> {
    let mut source = Source::parse("fig-6.8.toml", text)?;
    for (path, value) in set {
        source.set(path, value.clone()).map_err(|mistake| CaseError::Run(mistake.message.clone()))?;
    }
    let mut scene = Scene::from_source(source, ".".into())?;
    scene.outputs.clear();
    let built = pliant_scene::build(&scene)?;
    let plan = pliant_scene::plan(&scene, &built)?;
    let threads = scene.run.threads as usize;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|error| CaseError::Run(error.to_string()))?;
    pool.install(|| go(&scene, &built, &plan, seconds))
}

fn go(scene: &Scene, built: &Built, plan: &Plan, seconds: f64) -> Result<Played, CaseError> {
    let failed = |failure: pliant_scene::FailureSummary| CaseError::Run(failure.message);
    let mut live = live(scene, built, plan).map_err(failed)?;
    let elements = built.model.solids.iter().map(|solid| solid.cells.len()).sum();
    let mut played = Played { elements, step: plan.step, stepping: 0.0, preparing: 0.0, frames: 0 };
    while live.time() < seconds {
        let started = Instant::now();
        let next = (played.frames + 1) as f64 / FRAMES;
        while live.time() < next {
            live.advance(u64::MAX).map_err(failed)?;
        }
        played.stepping += started.elapsed().as_secs_f64();
        let started = Instant::now();
        live.mesh().map_err(failed)?;
        played.preparing += started.elapsed().as_secs_f64();
        played.frames += 1;
    }
    Ok(played)
}

fn compute() -> Result<Findings, CaseError> {
    let mut findings = Findings::default();
    let cube = play(CUBE, 1.0, &[])?;
    let thread = (&["run", "threads"][..], Value::from(1_i64));
    let until = (&["scene", "until"][..], Value::from(10.0));
    let liver = play(LIVER, 10.0, &[thread, until])?;
    for (name, played, seconds) in [("cube, all cores", &cube, 1.0), ("liver, one thread", &liver, 10.0)] {
        let factor = seconds / (played.stepping + played.preparing);
        let (elements, step) = (played.elements, 1e3 * played.step);
        let quantity = format!(
            "{name}: {elements} tets in steps of {step:.2} ms, simulated over wall time, with frames"
        );
        let source = "real time, as on a GeForce 8800 GTX";
        findings.rows.push(Row::timed(quantity, "", Some(1.0), factor, source));
        let quantity = format!("{name}: wall time to prepare a frame");
        let each = 1e3 * played.preparing / played.frames as f64;
        findings.rows.push(Row::timed(quantity, "ms", Some(5.0), each, "5 ms or less leave time to draw"));
    }
    Ok(findings)
}
