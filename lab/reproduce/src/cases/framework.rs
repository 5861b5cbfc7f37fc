//! Figure 6.9: the cost of the framework. The bare step of a cube of hexahedra under gravity is compared with
//! the whole program, without and with a series of meshes. `scenes/liver` is compared likewise, without and
//! with all its outputs. Everything runs on this machine, in single precision on all cores. All start at rest
//! and take the same steps of the same model; repeats are interleaved, so other load affects all equally.

use pliant_bench::{Clocked, Spread, Timed};
use pliant_explicit::State;
use pliant_format::Scene;
use pliant_format::source::Source;
use pliant_run::OutputFolder;
use pliant_scene::World;
use pliant_sim::SAFETY;
use rayon::ThreadPoolBuilder;

use crate::case::{Case, CaseError, Findings, Row};
use crate::plot::{Curve, Key, Pen, Plot};

/// Elements along the edge of the cubes: 1,331 to 29,791 nodes.
const CELLS: [usize; 5] = [10, 15, 20, 25, 30];
/// Repeats of both.
const REPEATS: usize = 3;
/// Steps in a repeat: as many as a run takes between computations of the critical time step.
const STEPS: u64 = 1000;

/// Figure 6.9.
pub(crate) const CASE: Case = Case {
    id: "fig-6.9",
    title: "Fig. 6.9: the bare step against the whole program",
    shows: "Time of one step of a cube of hexahedra under gravity, with 1,331 to 29,791 nodes: by the solver alone, \
            and inside a framework (there SOFA), whose separate parts cost 8.4 % for large meshes. Here the whole \
            program reads the scene, checks every step, monitors the critical time step, samples energies and \
            reactions, and writes a table 25 times per second of simulated time; with outputs it also writes the mesh with \
            displacements and stresses as often. `scenes/liver` runs without any output, and with its own: two such series, 20 times a second, and \
            a table with a probe, 200 times a second.",
    corrections: &[],
    seconds: 16.0,
    compute,
};

/// Scene of the cube with `cells` elements along its edge, until a time [s].
fn scene(cells: usize, until: f64, series: &str) -> Result<Scene, CaseError> {
    let text = format!(
        "[scene]\nuntil = {until:?}\ngravity = [0, 0, -9.81]\n[run]\nprecision = \"single\"\n[law.tissue]\n\
         type = \"neo-hookean\"\nyoung-modulus = 20e3\npoisson-ratio = 0.45\n[body.cube]\nmesh = {{ block = {{ size = \
         [0.1, 0.1, 0.1], cells = [{cells}, {cells}, {cells}] }}, as = \"hexes\" }}\nlaw = \"tissue\"\ndensity = 1000\n\
         [constraint.base]\ntype = \"fix\"\nbody = \"cube\"\nnodes = {{ set = \"z-min\" }}\n[output.history]\ntype = \
         \"csv\"\nevery = 0.04\n{series}"
    );
    Ok(Scene::from_source(Source::parse("cube.toml", text)?, ".".into())?)
}

/// A series of meshes.
const SERIES: &str =
    "[output.fields]\ntype = \"vtu\"\nevery = 0.04\ndata = [\"displacement\", \"von-mises\"]\n";

/// A scene that is ready to run, without and with a series of meshes, or all its outputs.
struct Program([World; 2]);

impl Program {
    fn new(cells: usize) -> Result<Self, CaseError> {
        // The duration for the timed number of steps.
        let short = World::new(&scene(cells, 1e-3, "")?)?;
        let limits = short.participants[0].plan.limits.as_ref();
        let step = SAFETY * limits.map_or(1e-3, |limits| limits.critical.assembled.step);
        let until = step * STEPS as f64;
        Ok(Self([World::new(&scene(cells, until, "")?)?, World::new(&scene(cells, until, SERIES)?)?]))
    }

    /// Program of the liver, over the first second.
    fn of_liver() -> Result<Self, CaseError> {
        let mut scene = super::liver::scene()?;
        scene.scene.until = 1.0;
        let with_outputs = World::new(&scene)?;
        scene.outputs.clear();
        Ok(Self([World::new(&scene)?, with_outputs]))
    }

    /// Wall time of a step of the solver alone [s], on its own threads like the whole program.
    fn bare(&self) -> Result<f64, CaseError> {
        let world = &self.0[0];
        let model = &world.participants[0].built.model;
        let mut clocked = Clocked::<f32>::new(model.clone(), world.step(), State::at_rest(model))?;
        let pool = ThreadPoolBuilder::new().build().map_err(|error| CaseError::Run(error.to_string()))?;
        Ok(pool.install(|| clocked.seconds_per_step(world.steps() as usize))?)
    }

    /// Wall times of a step of the solver alone, of the whole program, and with a series of meshes [s].
    fn times(&self) -> Result<[f64; 3], CaseError> {
        Ok([self.bare()?, whole(&self.0[0])?, whole(&self.0[1])?])
    }

    /// Medians of the repeats' three times [s], and of their costs over the first [%]. A turn before the
    /// repeats warms up.
    fn medians(&self) -> Result<([f64; 3], [f64; 2]), CaseError> {
        self.times()?;
        let times = (0..REPEATS).map(|_| self.times()).collect::<Result<Vec<_>, _>>()?;
        let median = |of: &dyn Fn(&[f64; 3]) -> f64| Spread::of(times.iter().map(of)).median;
        let steps = [0, 1, 2].map(|which| median(&|t| t[which]));
        Ok((steps, [1, 2].map(|which| median(&|t| 100.0 * (t[which] / t[0] - 1.0)))))
    }
}

/// Wall time of a step of the whole program [s], from its own summary.
fn whole(world: &World) -> Result<f64, CaseError> {
    let unwritable = |error: &dyn std::fmt::Display| CaseError::Run(error.to_string());
    let place = tempfile::tempdir().map_err(|error| unwritable(&error))?;
    let folder = OutputFolder::prepare(place.path().join("run"), &world.scene, false)
        .map_err(|error| unwritable(&error))?;
    let summary = pliant_run::run(world, &folder, &mut |_| ()).map_err(|error| unwritable(&error))?;
    match summary.error {
        None => Ok(summary.wall_seconds / summary.steps as f64),
        Some(failure) => Err(CaseError::Run(failure.message)),
    }
}

fn compute() -> Result<Findings, CaseError> {
    let mut findings = Findings::default();
    // Nodes, and medians of each repeat's three times and of their costs over the first.
    let mut points = Vec::new();
    for cells in CELLS {
        let (steps, costs) = Program::new(cells)?.medians()?;
        points.push(((cells + 1).pow(3) as f64, steps, costs));
    }
    let names = ["the solver alone", "the whole program", "with a series of meshes"];
    let curves: Vec<_> = (names.into_iter().enumerate())
        .map(|(which, name)| {
            let time = |&(nodes, steps, _): &(f64, [f64; 3], [f64; 2])| (nodes, 1e3 * steps[which]);
            Curve::new(name, which, Pen::Line, points.iter().map(time).collect())
        })
        .collect();
    let plot = Plot {
        title: "Time of a step",
        axes: ["nodes", "time [ms]"],
        logarithmic: false,
        key: Key::UpperLeft,
        curves: &curves,
    };
    findings.figures.push(
        plot.figure(
            "Medians of three repeats of a thousand steps, interleaved; single precision, all cores.",
        )?,
    );
    for (which, (nodes, steps, [cost, series])) in points.iter().enumerate() {
        let last = which + 1 == points.len();
        let (reference, source) = if last { (Some(8.4), "thesis, for large meshes") } else { (None, "") };
        let quantity = format!("cost of the framework per step, {nodes} nodes");
        findings.rows.push(Row::timed(quantity, "%", reference, *cost, source));
        let quantity = format!("the same with a series of meshes, {nodes} nodes");
        findings.rows.push(Row::timed(quantity, "%", None, *series, ""));
        if last {
            for (name, time) in names.into_iter().zip(steps) {
                let quantity = format!("{name}: a step of {nodes} nodes");
                findings.rows.push(Row::timed(quantity, "ms", None, 1e3 * time, ""));
            }
        }
    }
    let (_, costs) = Program::of_liver()?.medians()?;
    for (what, cost) in ["without outputs", "with all outputs"].into_iter().zip(costs) {
        findings.rows.push(Row::timed(
            format!("`scenes/liver`: cost of the run per step, {what}"),
            "%",
            None,
            cost,
            "",
        ));
    }
    Ok(findings)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_take_the_same_steps() {
        let program = Program::new(10).unwrap();
        for world in &program.0 {
            assert!(world.steps().abs_diff(STEPS) <= 1, "{}", world.steps());
        }
    }
}
