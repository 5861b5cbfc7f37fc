//! Figure 6.8: tissue in real time. A cube of 55,566 tetrahedra is stretched to and fro, and a liver is
//! pulled, on one thread. As in `pliant view`, steps are taken, and sixty frames made per second of simulated
//! time.

use std::sync::Arc;
use std::time::{Duration, Instant};

use pliant_format::Scene;
use pliant_format::source::{Source, Value};
use pliant_geometry::Mesh;
use pliant_gpu::{Device, GpuError, PointValue};
use pliant_run::Live;
use pliant_scene::World;

use crate::CaseError;
use crate::case::{Case, Findings, Row};
use crate::cases::adapter_name;
use crate::picture::{Body, View, figure};

/// Figure 6.8.
pub(crate) const CASE: Case = Case {
    id: "fig-6.8",
    title: "Fig. 6.8: tissue in real time",
    shows: "A cube of 55,566 brain-like tetrahedra, one face stretched by 0 to 40 % to and fro, in steps of 0.7 ms, is drawn \
            while it moves; on a GeForce 8800 GTX it ran in real time. Here: simulated time over wall time on this machine's CPU \
            (1 is real time), and the same for a transversely isotropic viscoelastic liver of 2,516 tetrahedra (the thesis's has \
            2,428) over 10 s on one thread. The forces, stresses and nodal means of a frame are timed separately. `pliant view` \
            shows both.",
    corrections: &[],
    seconds: 20.0,
    compute,
};

const CUBE: &str = include_str!("../../../../scenes/stretched-cube/scene.toml");
const LIVER: &str = include_str!("../../../../scenes/liver/scene.toml");
/// Frames per simulated second.
const FRAMES: f64 = 60.0;
/// Time of the largest stretch [s].
const FARTHEST: f64 = 0.5;

/// Cost of playing a scene.
struct Played {
    elements: usize,
    step: f64,
    /// Wall time of all steps and of all frames [s].
    stepping: f64,
    preparing: f64,
    frames: u64,
    /// The frame with the largest stretch, with its displacements [m].
    farthest: (Mesh, Vec<[f64; 3]>),
}

/// Plays a scene for some simulated seconds.
fn play(text: &str, seconds: f64, set: &[(&[&str], Value)]) -> Result<Played, CaseError> {
    let mut source = Source::parse("fig-6.8.toml", text)?;
    for (path, value) in set {
        source.set(path, value.clone()).map_err(|mistake| CaseError::Run(mistake.message.clone()))?;
    }
    let mut scene = Scene::from_source(source, ".".into())?;
    scene.outputs.clear();
    let world = Arc::new(World::new(&scene)?);
    let threads = scene.run.threads as usize;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|error| CaseError::Run(error.to_string()))?;
    pool.install(|| go(&world, seconds))
}

/// Continues frame by frame; a GPU places the points without a read-back.
fn go(world: &Arc<World>, seconds: f64) -> Result<Played, CaseError> {
    let failed = |failure: pliant_sim::Failure| CaseError::Run(failure.message);
    let mut live = Live::new(world).map_err(failed)?;
    let solids = world.participants.iter().flat_map(|part| &part.built.model.solids);
    let elements = solids.map(|solid| solid.cells.len()).sum();
    let step = world.step();
    let (mut stepping, mut preparing, mut frames) = (0.0, 0.0, 0);
    let mut farthest = Default::default();
    while live.simulation.time() < seconds {
        let started = Instant::now();
        let next = (frames + 1) as f64 / FRAMES;
        while live.simulation.time() < next {
            let most = ((next - live.simulation.time()) / step).ceil().max(1.0) as u64;
            let advanced = match live.simulation.on_device() {
                Some(mut device) => device.advance_without_read_back(most, Duration::MAX),
                None => live.simulation.step(most),
            };
            advanced.map_err(failed)?;
        }
        stepping += started.elapsed().as_secs_f64();
        let started = Instant::now();
        match live.place(PointValue::Size, None) {
            Some(placed) => drop(placed.map_err(failed)?),
            None => drop(live.mesh().map_err(failed)?),
        }
        preparing += started.elapsed().as_secs_f64();
        frames += 1;
        if frames == (FRAMES * FARTHEST) as u64 {
            let mesh = live.mesh().map_err(failed)?.clone();
            let moved = mesh.point_data.get("displacement").map(|data| data.values.as_slice());
            let moved = moved.unwrap_or_default().chunks_exact(3).map(|u| [u[0], u[1], u[2]]).collect();
            farthest = (mesh, moved);
        }
    }
    Ok(Played { elements, step, stepping, preparing, frames, farthest })
}

impl Played {
    fn add_rows(&self, findings: &mut Findings, name: &str, seconds: f64) {
        let factor = seconds / (self.stepping + self.preparing);
        let (elements, step) = (self.elements, 1e3 * self.step);
        let quantity = format!(
            "{name}: {elements} tets in steps of {step:.2} ms, simulated over wall time, with frames"
        );
        let source = "real time, as on a GeForce 8800 GTX";
        findings.rows.push(Row::timed(quantity, "", Some(1.0), factor, source));
        let quantity = format!("{name}: wall time to prepare a frame");
        let each = 1e3 * self.preparing / self.frames as f64;
        findings.rows.push(Row::timed(quantity, "ms", Some(5.0), each, "up to 5 ms leave time to draw"));
    }
}

fn compute() -> Result<Findings, CaseError> {
    let mut findings = Findings::default();
    let cube = play(CUBE, 1.0, &[])?;
    let liver = play(LIVER, 10.0, &[(&["run", "threads"], 1.into()), (&["scene", "until"], 10.0.into())])?;
    cube.add_rows(&mut findings, "cube, all cores", 1.0);
    match Device::open(None) {
        Ok(device) => {
            let name = format!("cube, GPU ({})", adapter_name(device.adapter()));
            play(CUBE, 1.0, &[(&["run", "device"], "gpu".into())])?.add_rows(&mut findings, &name, 1.0);
        }
        Err(GpuError::NoAdapter) => {}
        Err(error) => return Err(error.into()),
    }
    liver.add_rows(&mut findings, "liver, one thread", 10.0);

    let (mesh, displacement) = cube.farthest;
    let still = Body { edges: false, skin: true, ..Body::still("at rest", &mesh) };
    let bodies = [Body { label: "stretched by 40 %".into(), displacement, ..still.clone() }, still];
    let view = View { from: [0.55, 0.45, 1.0], up: [0.0, 1.0, 0.0], quantity: "", factor: 1.0, columns: 2 };
    let caption = "The cube, shaded by vertex normals, with a texture that moves with it, as in `pliant view \
                   scenes/stretched-cube`.";
    findings.figures.push(figure(&bodies, &view, caption)?);
    Ok(findings)
}
