//! A scene that is played: it goes on as long as someone looks, is pulled at, and shows what its `[view]` asks.

use std::sync::Arc;
use std::time::Duration;

use pliant_explicit::{Clock, Scalar, State};
use pliant_geometry::Mesh;
use pliant_gpu::{DeviceMapping, DevicePoints, PointValue, Wanted};
use pliant_mechanics::Energies;
use pliant_mechanics::grip::Grip;

use crate::assemble::Built;
use crate::checkpoint::Moment;
use crate::corotational::Corotated;
use crate::format::{Precision, VtuTable};
use crate::output::{Column, FailureSummary, Frame, Samples, Snapshot};
use crate::plan::Plan;
use crate::scene::Scene;
use crate::solver::{Memory, Solver, on_device, on_processor};

/// A scene under way, in any numbers and with any solver. After a failure it stays at the last good instant.
pub trait Live: Send {
    /// Time [s].
    fn time(&self) -> f64;

    /// Goes one step on (on a graphics processor as many as it takes at once, up to `most`); how many.
    ///
    /// # Errors
    /// If the run can't go on; the state before it can still be looked at.
    fn advance(&mut self, most: u64) -> Result<u64, FailureSummary>;

    /// Goes up to `steps` steps on where the state lies on a graphics processor, as many as take about `within`: nothing comes back to
    /// ordinary memory, and what breaks is told by [`mesh`](Self::mesh). How many; `None` of a solver whose state lies there.
    fn coast(&mut self, steps: u64, within: Duration) -> Option<Result<u64, FailureSummary>>;

    /// The points shown at the instant, found on the graphics processor where the state lies, with a value each; `given` takes the
    /// place of those given before. `None` of a solver whose state lies in ordinary memory.
    fn place(
        &mut self,
        value: PointValue,
        given: Option<&[f32]>,
    ) -> Option<Result<DevicePoints, FailureSummary>>;

    /// Where it stands, for [`go_on`]. `None` where the instant was looked at, whose forces belong to the step to come; and of a
    /// device that was lost.
    fn stand(&mut self) -> Option<Standing>;

    /// Takes hold of points: these grips and no others act from the next step on. False where the solver knows none.
    fn hold(&mut self, grips: &[Grip]) -> bool;

    /// Steps until grips that are taken now act: 1 where the instant was looked at and its forces are found, else 0.
    fn delay(&self) -> u64;

    /// The point of a grip now [m], and its force on the body [N].
    fn pulled(&self, grip: &Grip) -> [[f64; 3]; 2];

    /// The point of what is shown, as a combination of nodes of the model.
    fn nodes_of(&self, point: u32) -> Vec<(u32, f64)>;

    /// Shows another series.
    fn show(&mut self, shown: &VtuTable);

    /// What is shown, at rest, with the fields of the instant.
    ///
    /// # Errors
    /// If forces at the instant can't be found.
    fn mesh(&mut self) -> Result<&Mesh, FailureSummary>;

    /// Energies at the instant last evaluated [J].
    fn energies(&self) -> Energies;

    /// Force [N] that holds or moves the nodes of a constraint, at the instant last evaluated.
    fn reaction(&self, constraint: usize) -> [f64; 3];

    /// What is sampled: reactions, energies and the probes of all tables of the scene, with units.
    fn columns(&self) -> Vec<Column>;

    /// Adds the sample of the instant last shown to a row.
    fn sample(&mut self, row: &mut Vec<f64>);

    /// A fingerprint of displacements and increments: the same bits have the same one.
    fn fingerprint(&self) -> u64;
}

/// Where a run stands between two steps: all that another one needs to go on from there.
#[derive(Clone, Debug)]
pub struct Standing {
    numbers: Numbers,
    clock: Option<Clock>,
    /// Length of its steps [s].
    step: f64,
}

#[derive(Clone, Debug)]
enum Numbers {
    Single(Moment<f32>),
    Double(Moment<f64>),
}

/// The number types that runs compute in.
trait Numeric: Scalar {
    fn kept(moment: Moment<Self>) -> Numbers;
    fn taken(numbers: Numbers) -> Option<Moment<Self>>;
}

impl Numeric for f32 {
    fn kept(moment: Moment<f32>) -> Numbers {
        Numbers::Single(moment)
    }

    fn taken(numbers: Numbers) -> Option<Moment<f32>> {
        if let Numbers::Single(moment) = numbers { Some(moment) } else { None }
    }
}

impl Numeric for f64 {
    fn kept(moment: Moment<f64>) -> Numbers {
        Numbers::Double(moment)
    }

    fn taken(numbers: Numbers) -> Option<Moment<f64>> {
        if let Numbers::Double(moment) = numbers { Some(moment) } else { None }
    }
}

/// Begins to play a scene.
///
/// # Errors
/// If its solver can't be made.
pub fn live(scene: &Scene, built: &Arc<Built>, plan: &Plan) -> Result<Box<dyn Live>, FailureSummary> {
    match begin(scene, built, plan, None)? {
        Some(live) => Ok(live),
        None => Err(FailureSummary::input(&"nothing to begin with")),
    }
}

/// Plays a scene on from where a run of another one stands, with displacements, velocities and what relaxing laws remember. `None`
/// where this one has another mesh, solver or precision than what was built `before`.
///
/// # Errors
/// If its solver can't be made.
pub fn go_on(
    scene: &Scene,
    built: &Arc<Built>,
    plan: &Plan,
    standing: Standing,
    before: &Built,
) -> Result<Option<Box<dyn Live>>, FailureSummary> {
    begin(scene, built, plan, Some((standing, before)))
}

type Begun = Result<Option<Box<dyn Live>>, FailureSummary>;

fn begin(scene: &Scene, built: &Arc<Built>, plan: &Plan, from: Option<(Standing, &Built)>) -> Begun {
    let run = &scene.run;
    match (&plan.target.device, plan.target.precision, &built.corotational) {
        (Some(device), ..) => {
            Played::<f32>::begin(scene, built, plan, from, |state| on_device(run, built, plan, device, state))
        }
        (None, _, Some(part)) => Played::<f64>::begin(scene, built, plan, from, |_| {
            Ok(Box::new(Corotated::new(run, built, part, plan)?))
        }),
        (None, Precision::Single, None) => {
            Played::<f32>::begin(scene, built, plan, from, |_| on_processor(run, built, plan))
        }
        (None, Precision::Double, None) => {
            Played::<f64>::begin(scene, built, plan, from, |_| on_processor(run, built, plan))
        }
    }
}

/// Whether bodies of a model have the nodes and cells that those of another one have.
fn same_mesh(a: &Built, b: &Built) -> bool {
    let cells = |built: &Built| -> Vec<(String, u64)> {
        let parts = built.model.fingerprints().into_iter();
        parts.filter(|(part, _)| part.starts_with("mesh of")).collect()
    };
    let shells = |built: &Built| built.corotational.as_ref().map(|part| part.model.rest.len());
    a.model.rest == b.model.rest && shells(a) == shells(b) && cells(a) == cells(b)
}

struct Played<R> {
    built: Arc<Built>,
    state: State<R>,
    solver: Box<dyn Solver<R>>,
    snapshot: Snapshot<R>,
    /// What finds the points of the snapshot where the state lies on a device.
    mapping: Option<DeviceMapping>,
    samples: Samples,
    /// Length of a step [s].
    step: f64,
    /// Whether forces, energies and reactions belong to the state's instant; all fields too with `Everything`.
    evaluated: Option<Wanted>,
}

impl<R: Numeric> Played<R> {
    fn begin(
        scene: &Scene,
        built: &Arc<Built>,
        plan: &Plan,
        from: Option<(Standing, &Built)>,
        solver: impl FnOnce(&State<R>) -> Result<Box<dyn Solver<R>>, FailureSummary>,
    ) -> Begun {
        let step = plan.step;
        let Some((Standing { numbers, clock, step: step_before }, before)) = from else {
            let state = State::at_rest(&built.model);
            return Ok(Some(Box::new(Self::new(scene, built, solver(&state)?, state, step))));
        };
        let Some(Moment { mut state, memory }) = R::taken(numbers) else { return Ok(None) };
        let rest = State::<R>::at_rest(&built.model);
        let kept = |state: &State<R>| -> Vec<[usize; 2]> {
            state.history.iter().map(|h| [h.cells.len(), h.pressures.len()]).collect()
        };
        if !same_mesh(before, built)
            || kept(&state) != kept(&rest)
            || !memory.fits(rest.displacement.len())
            || matches!(memory, Memory::Corotated(_)) != built.corotational.is_some()
        {
            return Ok(None);
        }
        if let Some(clock) = &clock
            && before.model.fingerprints() != built.model.fingerprints()
        {
            state.change_model(&before.model, &built.model, clock.before);
        }
        let mut solver = solver(&state)?;
        if let Some(clock) = &clock {
            solver.go_on(clock, step_before, &state);
        }
        solver.resume(memory);
        Ok(Some(Box::new(Self::new(scene, built, solver, state, step))))
    }

    fn new(
        scene: &Scene,
        built: &Arc<Built>,
        solver: Box<dyn Solver<R>>,
        state: State<R>,
        step: f64,
    ) -> Self {
        let snapshot = snapshot(built, &scene.shown(1.0));
        let samples = Samples::new(built, &scene.sampled());
        let built = Arc::clone(built);
        Self { built, state, solver, snapshot, mapping: None, samples, step, evaluated: None }
    }

    fn evaluate(&mut self, wanted: Wanted) -> Result<(), FailureSummary> {
        if self.evaluated.is_none() {
            self.solver.evaluate(&mut self.state, wanted)?;
            self.evaluated = Some(wanted);
        }
        Ok(())
    }
}

fn snapshot<R: Scalar>(built: &Built, shown: &VtuTable) -> Snapshot<R> {
    Snapshot::new(built, shown.on.as_deref(), &shown.data, shown.at, shown.curved)
}

impl<R: Numeric> Live for Played<R> {
    fn time(&self) -> f64 {
        self.state.time
    }

    fn advance(&mut self, most: u64) -> Result<u64, FailureSummary> {
        self.evaluate(Wanted::Everything)?;
        let steps = self.solver.stride().min(most.max(1));
        self.solver.advance(&mut self.state, steps, &mut |_| {})?;
        self.evaluated = None;
        Ok(steps)
    }

    fn coast(&mut self, steps: u64, within: Duration) -> Option<Result<u64, FailureSummary>> {
        let coasted = self.solver.coast(&mut self.state, steps, within)?;
        self.evaluated = None;
        Some(coasted)
    }

    fn place(
        &mut self,
        value: PointValue,
        given: Option<&[f32]>,
    ) -> Option<Result<DevicePoints, FailureSummary>> {
        if self.mapping.is_none() {
            let (built, snapshot) = (&self.built, &self.snapshot);
            let mut points = (0..)
                .zip(&snapshot.mesh().points)
                .map(|(point, place)| ([place.x, place.y, place.z], snapshot.nodes_of(built, point)));
            match self.solver.map(&mut points)? {
                Ok(mapping) => self.mapping = Some(mapping),
                Err(failure) => return Some(Err(failure)),
            }
        }
        let mapping = self.mapping.as_ref()?;
        if let Some(values) = given {
            mapping.give(values);
        }
        self.solver.apply(mapping, value);
        Some(Ok(mapping.points().clone()))
    }

    fn stand(&mut self) -> Option<Standing> {
        if self.evaluated.is_some() || self.solver.bring_back(&mut self.state).is_err() {
            return None;
        }
        let moment = Moment { state: self.state.clone(), memory: self.solver.memory() };
        Some(Standing { clock: self.solver.clock(&self.state), numbers: R::kept(moment), step: self.step })
    }

    fn hold(&mut self, grips: &[Grip]) -> bool {
        self.solver.hold(grips)
    }

    fn delay(&self) -> u64 {
        u64::from(self.evaluated.is_some())
    }

    fn pulled(&self, grip: &Grip) -> [[f64; 3]; 2] {
        let (model, displacement) = (&self.built.model, &self.state.displacement);
        [grip.point(model, displacement), grip.force(model, displacement)]
    }

    fn nodes_of(&self, point: u32) -> Vec<(u32, f64)> {
        self.snapshot.nodes_of(&self.built, point)
    }

    fn show(&mut self, shown: &VtuTable) {
        self.snapshot = snapshot(&self.built, shown);
        self.mapping = None;
    }

    fn mesh(&mut self) -> Result<&Mesh, FailureSummary> {
        self.evaluate(Wanted::Everything)?;
        self.snapshot.fill(&Frame {
            built: &self.built,
            state: &self.state,
            stepper: self.solver.observable(),
            corotational: self.solver.corotational(),
        });
        Ok(self.snapshot.mesh())
    }

    fn energies(&self) -> Energies {
        *self.solver.observable().energies()
    }

    fn reaction(&self, constraint: usize) -> [f64; 3] {
        self.solver.observable().reaction(constraint)
    }

    fn columns(&self) -> Vec<Column> {
        self.samples.columns().to_vec()
    }

    fn sample(&mut self, row: &mut Vec<f64>) {
        self.samples.read(
            &Frame {
                built: &self.built,
                state: &self.state,
                stepper: self.solver.observable(),
                corotational: self.solver.corotational(),
            },
            row,
        );
    }

    fn fingerprint(&self) -> u64 {
        let bits = |vectors: &[[R; 3]]| -> Vec<u64> {
            vectors.iter().flatten().map(|x| x.to_f64().to_bits()).collect()
        };
        pliant_mechanics::fingerprint(&(bits(&self.state.displacement), bits(&self.state.increment)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{CUBE, read};

    /// The cube, damped so that it comes to rest.
    fn damped() -> (Scene, Arc<Built>, Plan) {
        other(&[])
    }

    fn corner(built: &Built, live: &dyn Live, part: f64, step: f64, by: [f64; 3]) -> Grip {
        let last = built.model.node_count() as u32 - 1;
        let mut grip = Grip { nodes: vec![(last, 0.25), (last - 1, 0.75)], ..Grip::default() };
        grip.stiffness = part * grip.stiffest(&built.model, step);
        let [point, _] = live.pulled(&grip);
        grip.place = [0, 1, 2].map(|c| point[c] + by[c]);
        grip
    }

    /// The damped cube with other numbers.
    fn other(changes: &[(&str, &str)]) -> (Scene, Arc<Built>, Plan) {
        let mut text = CUBE.replace("density = 1000", "density = 1000\ndamping = 200");
        changes.iter().for_each(|(from, to)| text = text.replace(from, to));
        let scene = read(&text);
        let built = crate::build(&scene).unwrap_or_else(|error| panic!("{}", error.plain()));
        let plan = crate::plan(&scene, &built).unwrap_or_else(|error| panic!("{}", error.plain()));
        (scene, Arc::new(built), plan)
    }

    fn pulled_for((scene, built, plan): &(Scene, Arc<Built>, Plan), steps: u64) -> Box<dyn Live> {
        let mut live = live(scene, built, plan).unwrap();
        let grip = Grip { stiffness: 20.0, ..corner(built, live.as_ref(), 0.5, plan.step, [0.0, 0.0, 5e-3]) };
        live.hold(&[grip]);
        (0..steps).for_each(|_| assert_eq!(live.advance(1).unwrap(), 1));
        live
    }

    fn height(live: &mut dyn Live) -> f64 {
        live.mesh().unwrap().point_data["displacement"].values.last().copied().unwrap()
    }

    /// The grip of [`pulled_for`], as stiff after the change.
    fn hold_on(live: &mut dyn Live, built: &Built) {
        let last = built.model.node_count() as u32 - 1;
        let [x, y, z] = [last, last - 1]
            .map(|n| built.model.rest[n as usize])
            .into_iter()
            .zip([0.25, 0.75])
            .fold([0.0; 3], |sum, (x, w)| [0, 1, 2].map(|c| sum[c] + w * x[c]));
        let nodes = vec![(last, 0.25), (last - 1, 0.75)];
        assert!(live.hold(&[Grip { nodes, place: [x, y, z + 5e-3], stiffness: 20.0 }]));
    }

    #[test]
    fn going_on_with_the_same_numbers_changes_no_bit() {
        let viscous = (
            "poisson-ratio = 0.3",
            "poisson-ratio = 0.3\nprony = [{ part = 'isochoric', weight = 0.5, time = 0.1 }]",
        );
        let stage = other(&[viscous]);
        let mut whole = pulled_for(&stage, 300);
        let again = other(&[viscous]);
        let mut half = pulled_for(&stage, 150);
        assert!(half.stand().is_some());
        half.mesh().unwrap();
        assert!(half.stand().is_none(), "the forces at this instant belong to the step to come");
        half.advance(1).unwrap();
        let standing = half.stand().unwrap();
        let mut half = go_on(&again.0, &again.1, &again.2, standing, &stage.1).unwrap().unwrap();
        hold_on(half.as_mut(), &again.1);
        for _ in 151..300 {
            half.advance(1).unwrap();
        }
        assert_eq!(
            (whole.time().to_bits(), whole.fingerprint()),
            (half.time().to_bits(), half.fingerprint())
        );
        whole.mesh().unwrap();
        half.mesh().unwrap();
        assert_eq!(whole.energies(), half.energies());
    }

    #[test]
    fn a_stiffer_law_ends_where_it_would_have_from_the_start() {
        let less = ("damping = 200", "damping = 5");
        let (soft, stiff) =
            (other(&[less]), other(&[less, ("young-modulus = 10e3", "young-modulus = 40e3")]));
        assert!(stiff.2.step < 0.6 * soft.2.step);
        let mut going = pulled_for(&soft, 4000);
        let pulled = height(going.as_mut());
        going.advance(1).unwrap();
        let (standing, time) = (going.stand().unwrap(), going.time());
        let mut going = go_on(&stiff.0, &stiff.1, &stiff.2, standing, &soft.1).unwrap().unwrap();
        assert_eq!(going.time(), time);
        hold_on(going.as_mut(), &stiff.1);
        going.advance(1).unwrap();
        assert!((going.time() - time - stiff.2.step).abs() < 1e-12, "time goes on in the new steps");
        for _ in 0..12_000 {
            going.advance(1).unwrap();
        }
        let (ended, expected) = (height(going.as_mut()), height(pulled_for(&stiff, 12_000).as_mut()));
        assert!(ended < 0.5 * pulled, "{ended} m, {pulled} m before");
        // Both are at rest to the last digits that damping leaves.
        assert!((ended - expected).abs() < 1e-6 * expected, "{ended} m, {expected} m from the start");
    }

    #[test]
    fn velocities_go_on_where_the_step_changes() {
        let in_steps = |step: &str| {
            let run = format!("[run]\nstep = {step}\n[law.tissue]");
            other(&[("[law.tissue]", &run), ("damping = 200", "damping = 2")])
        };
        let (coarse, fine) = (in_steps("0.002"), in_steps("0.001"));
        // It swings up; at its fastest the steps become shorter.
        let mut going = pulled_for(&coarse, 16);
        let standing = going.stand().unwrap();
        let mut going = go_on(&fine.0, &fine.1, &fine.2, standing, &coarse.1).unwrap().unwrap();
        hold_on(going.as_mut(), &fine.1);
        (0..68).for_each(|_| assert_eq!(going.advance(1).unwrap(), 1));
        let mut whole = pulled_for(&fine, 0);
        hold_on(whole.as_mut(), &fine.1);
        let mut largest = 0.0_f64;
        for _ in 0..100 {
            whole.advance(1).unwrap();
            largest = largest.max(height(whole.as_mut()).abs());
        }
        assert!((whole.time() - going.time()).abs() < 1e-12);
        let [changed, expected] = [going, whole].map(|mut live| height(live.as_mut()));
        // The errors of both steps are below 2 % of the swing; twice or half the velocity would change it by half.
        assert!(
            (changed - expected).abs() < 0.05 * largest,
            "{changed} m, {expected} m in short steps, of {largest} m"
        );
    }

    #[test]
    fn more_mass_unbalances_no_energy() {
        let (light, heavy) = (other(&[]), other(&[("density = 1000", "density = 3000")]));
        let mut going = pulled_for(&light, 60);
        let standing = going.stand().unwrap();
        let mut going = go_on(&heavy.0, &heavy.1, &heavy.2, standing, &light.1).unwrap().unwrap();
        hold_on(going.as_mut(), &heavy.1);
        go(going.as_mut(), 400);
        assert!(going.energies().balance < 0.02, "{:?}", going.energies());
    }

    #[test]
    fn another_mesh_goes_on_from_nothing() {
        let (coarse, fine) = (other(&[]), other(&[("cells = [2, 2, 2]", "cells = [2, 2, 3]")]));
        let standing = pulled_for(&coarse, 10).stand().unwrap();
        assert!(go_on(&fine.0, &fine.1, &fine.2, standing, &coarse.1).unwrap().is_none());
    }

    fn go(live: &mut dyn Live, steps: u64) {
        (0..steps).for_each(|_| assert_eq!(live.advance(1).unwrap(), 1));
        live.mesh().unwrap();
    }

    #[test]
    fn a_grip_pulls_with_the_force_that_the_base_holds_and_leaves_nothing_behind() {
        let (scene, built, plan) = damped();
        let mut live = live(&scene, &built, &plan).unwrap();
        let grip = corner(&built, live.as_ref(), 0.5, plan.step, [0.0, 0.0, 2e-3]);
        assert!(live.hold(std::slice::from_ref(&grip)));
        go(live.as_mut(), 4000);
        let ([_, force], base) = (live.pulled(&grip), live.reaction(0));
        let most = force.iter().fold(0.0_f64, |most, f| most.max(f.abs()));
        assert!(most > 1e-2, "{force:?}");
        for c in 0..3 {
            assert!((force[c] + base[c]).abs() < 1e-6 * most, "{force:?} {base:?}");
        }
        // Its work is external work: the energies balance.
        assert!(live.energies().balance < 0.01, "{:?}", live.energies());
        assert!(live.hold(&[]));
        go(live.as_mut(), 4000);
        let moved = &live.mesh().unwrap().point_data["displacement"].values;
        let left = moved.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
        assert!(left < 1e-9, "{left}");
    }

    #[test]
    fn the_stiffest_grip_leaves_steps_stable() {
        let (scene, built, plan) = damped();
        let mut live = live(&scene, &built, &plan).unwrap();
        let grip = corner(&built, live.as_ref(), 1.0, plan.step, [1e-3, 0.0, 0.0]);
        live.hold(&[grip]);
        go(live.as_mut(), 3000);
    }

    #[test]
    fn what_is_played_has_the_bits_of_what_is_run() {
        let (scene, built, plan) = damped();
        let mut states = Vec::new();
        for looks in [1, 50] {
            let mut live = live(&scene, &built, &plan).unwrap();
            for _ in 0..100 / looks {
                go(live.as_mut(), looks);
            }
            states.push((live.time().to_bits(), live.fingerprint()));
        }
        assert_eq!(states[0], states[1], "looking changes nothing");
    }
}
