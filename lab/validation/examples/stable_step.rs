//! Larger stable steps for the liver of `scenes/liver`, a brain in stuffed tets and a cube. Each body is run
//! in plain tets, in tets with averaged pressure, and with mass scaling. The results are the step and the
//! wall time of a simulated second on all cores (median of turns). The deviation from the motion of plain
//! tets is the largest distance between equal nodes over the largest displacement.
//! `cargo run --release -p pliant-validation --example stable_step`; a word after `--` chooses the bodies
//! whose name has it.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use pliant_format::source::Source;
use pliant_format::{Scene, open};
use pliant_scene::World;

/// Times that each motion is run.
const TURNS: usize = 5;
/// Time between two looks at a motion [s].
const EVERY: f64 = 0.05;

/// Ways to a larger step, with their assignments; BODY stands for the name of the body.
const WAYS: [(&str, &[&str]); 6] = [
    ("plain", &[]),
    ("`tet4-anp`", &["body.BODY.element=tet4-anp"]),
    ("0.1 % added", &["run.mass-scaling.share=0.001"]),
    ("1 % added", &["run.mass-scaling.share=0.01"]),
    ("5 % added", &["run.mass-scaling.share=0.05"]),
    ("`tet4-anp`, 1 % added", &["body.BODY.element=tet4-anp", "run.mass-scaling.share=0.01"]),
];

/// Displacements [m] of the nodes at each look.
type Motion = Vec<Vec<[f64; 3]>>;

/// A scene of one body.
struct Organ {
    /// Description of the body.
    what: &'static str,
    body: &'static str,
    /// Simulated time [s].
    until: f64,
    text: String,
}

/// Brain-like tissue, held at one side; a load of gravity along x from the start.
fn shaken(mesh: &str, held: &str) -> String {
    format!(
        r#"
[scene]
until = 1.0
[run]
precision = "single"
[law.tissue]
type = "neo-hookean"
young-modulus = 3000
poisson-ratio = 0.45
[body.block]
mesh = {mesh}
law = "tissue"
density = 1000
damping = 5
[constraint.base]
type = "fix"
body = "block"
nodes = {held}
[load.shake]
type = "gravity"
acceleration = [2, 0, 0]
"#
    )
}

fn organs() -> Result<Vec<Organ>, Box<dyn Error>> {
    let liver = open(Path::new("scenes/liver"))?.0.text().to_owned();
    let mesh = "{ organ = \"brain\", edge = 0.008 }";
    let brain = shaken(mesh, "{ half-space = { point = [0, 0, -0.045], normal = [0, 0, -1] } }");
    let mesh = "{ block = { size = [0.1, 0.1, 0.1], cells = [21, 21, 21] }, as = \"tets\" }";
    let cube = shaken(mesh, "{ set = \"z-min\" }");
    Ok(vec![
        Organ { what: "`scenes/liver`", body: "liver", until: 2.0, text: liver },
        Organ { what: "brain, 8 mm", body: "block", until: 0.5, text: brain },
        Organ { what: "cube, 21³", body: "block", until: 0.5, text: cube },
    ])
}

/// A scene with assignments, whose steps meet the looks.
fn world(organ: &Organ, assignments: &[&str]) -> Result<World, Box<dyn Error>> {
    let mut source = Source::parse("scene.toml", organ.text.as_str())?;
    for assignment in assignments {
        source.assign(&assignment.replace("BODY", organ.body)).map_err(|mistake| mistake.message.clone())?;
    }
    let scene = Scene::from_source(source, "scenes/liver".into())?;
    Ok(World::new(&scene)?.lasting(EVERY))
}

/// A motion, and the wall time of the run [s].
fn motion(world: &World, organ: &Organ) -> Result<(Motion, f64), Box<dyn Error>> {
    let mut simulation = world.simulation()?;
    let (mut seen, mut wall) = (Vec::new(), 0.0);
    while simulation.time() < organ.until - 0.5 * EVERY {
        let started = Instant::now();
        let until = simulation.time() + EVERY;
        while simulation.steps_until(until) > 0 {
            simulation.step(simulation.steps_until(until))?;
        }
        wall += started.elapsed().as_secs_f64();
        seen.push(simulation.frame()?.displacements(organ.body).ok_or("there is no such body")?);
    }
    Ok((seen, wall))
}

/// The largest distance [m] between the places of a node in two motions.
fn farthest<'a>(pairs: impl Iterator<Item = (&'a [f64; 3], &'a [f64; 3])>) -> f64 {
    let squares = pairs.map(|(a, b)| (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>());
    squares.fold(0.0, f64::max).sqrt()
}

/// One way to step an organ.
struct Measured {
    way: &'static str,
    world: World,
    motion: Motion,
    /// Wall times of a simulated second [s], one per turn.
    times: Vec<f64>,
}

impl Measured {
    fn new(organ: &Organ, (way, assignments): (&'static str, &[&str])) -> Result<Self, Box<dyn Error>> {
        Ok(Self { way, world: world(organ, assignments)?, motion: Vec::new(), times: Vec::new() })
    }

    fn take_turn(&mut self, organ: &Organ) -> Result<(), Box<dyn Error>> {
        let (seen, wall) = motion(&self.world, organ)?;
        self.motion = seen;
        self.times.push(wall / organ.until);
        Ok(())
    }

    fn median(&self) -> f64 {
        let mut times = self.times.clone();
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    }

    /// Returns its row of the table, compared with the plain way.
    fn row(&self, organ: &Organ, plain: &Self) -> String {
        let model = &self.world.participants[0].built.model;
        let heavier = model.mass_scaling.as_ref().map_or(0, |scaling| scaling.nodes());
        let places = || plain.motion.iter().flatten();
        let largest = farthest(places().map(|u| (u, &[0.0; 3])));
        let off = farthest(places().zip(self.motion.iter().flatten())) / largest;
        let (step, seconds) = (self.world.step(), self.median());
        format!(
            "| {} | {} | {} | {heavier} | {:.3} | {:.2} | {seconds:.3} | {:.2} | {:.2} % |",
            organ.what,
            model.cell_count(),
            self.way,
            1e3 * step,
            step / plain.world.step(),
            seconds / plain.median(),
            100.0 * off
        )
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let only = std::env::args().nth(1).unwrap_or_default();
    println!(
        "| body | tets | way | nodes heavier | Δt ms | × step | a second takes s | × time | farthest node |"
    );
    println!("|:--|--:|:--|--:|--:|--:|--:|--:|--:|");
    for organ in organs()?.iter().filter(|organ| organ.what.contains(&only)) {
        let ways = WAYS.into_iter().map(|way| Measured::new(organ, way));
        let mut ways = ways.collect::<Result<Vec<_>, _>>()?;
        for _ in 0..TURNS {
            ways.iter_mut().try_for_each(|way| way.take_turn(organ))?;
        }
        ways.iter().for_each(|way| println!("{}", way.row(organ, &ways[0])));
    }
    Ok(())
}
