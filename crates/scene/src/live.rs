//! A scene that is played: it goes on as long as someone looks, is pulled at, and shows what its `[view]` asks.

use pliant_geometry::Mesh;
use pliant_gpu::Wanted;
use pliant_mechanics::grip::Grip;
use pliant_mechanics::{Energies, Real, State};

use crate::build::Built;
use crate::corotational::Corotated;
use crate::format::{Precision, VtuTable};
use crate::output::{FailureSummary, Frame, Snapshot};
use crate::plan::Plan;
use crate::scene::Scene;
use crate::solver::{Solver, on_device, on_processor};

/// A scene under way, in any numbers and with any solver. After a failure it stays at the last good instant.
pub trait Live {
    /// Time [s].
    fn time(&self) -> f64;

    /// Goes one step on (on a graphics processor as many as it takes at once, up to `most`); how many.
    ///
    /// # Errors
    /// If the run can't go on; the state before it can still be looked at.
    fn advance(&mut self, most: u64) -> Result<u64, FailureSummary>;

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

    /// A fingerprint of displacements and increments: the same bits have the same one.
    fn fingerprint(&self) -> u64;
}

/// Begins to play a scene.
///
/// # Errors
/// If its solver can't be made.
pub fn live<'b>(
    scene: &'b Scene,
    built: &'b Built,
    plan: &'b Plan,
) -> Result<Box<dyn Live + 'b>, FailureSummary> {
    Ok(match (&plan.target.device, plan.target.precision, &built.corotational) {
        (Some(device), ..) => {
            let state = State::at_rest(&built.model);
            let solver = on_device(&scene.run, built, plan, device, &state)?;
            Box::new(Played::<f32>::new(scene, built, state, solver))
        }
        (None, _, Some(part)) => {
            let solver = Box::new(Corotated::new(&scene.run, built, part, plan)?);
            Box::new(Played::<f64>::new(scene, built, State::at_rest(&built.model), solver))
        }
        (None, Precision::Single, None) => {
            let solver = on_processor(&scene.run, built, plan)?;
            Box::new(Played::<f32>::new(scene, built, State::at_rest(&built.model), solver))
        }
        (None, Precision::Double, None) => {
            let solver = on_processor(&scene.run, built, plan)?;
            Box::new(Played::<f64>::new(scene, built, State::at_rest(&built.model), solver))
        }
    })
}

struct Played<'b, R> {
    built: &'b Built,
    state: State<R>,
    solver: Box<dyn Solver<R> + 'b>,
    snapshot: Snapshot<R>,
    /// Whether forces, energies and reactions belong to the state's instant; all fields too with `Everything`.
    evaluated: Option<Wanted>,
}

impl<'b, R: Real> Played<'b, R> {
    fn new(scene: &Scene, built: &'b Built, state: State<R>, solver: Box<dyn Solver<R> + 'b>) -> Self {
        let snapshot = snapshot(built, &scene.shown(1.0));
        Self { built, state, solver, snapshot, evaluated: None }
    }

    fn evaluate(&mut self, wanted: Wanted) -> Result<(), FailureSummary> {
        if self.evaluated.is_none() {
            self.solver.evaluate(&mut self.state, wanted)?;
            self.evaluated = Some(wanted);
        }
        Ok(())
    }
}

fn snapshot<R: Real>(built: &Built, shown: &VtuTable) -> Snapshot<R> {
    Snapshot::new(built, shown.on.as_deref(), &shown.data, shown.at, shown.curved)
}

impl<R: Real> Live for Played<'_, R> {
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
        self.snapshot.nodes_of(self.built, point)
    }

    fn show(&mut self, shown: &VtuTable) {
        self.snapshot = snapshot(self.built, shown);
    }

    fn mesh(&mut self) -> Result<&Mesh, FailureSummary> {
        self.evaluate(Wanted::Everything)?;
        self.snapshot.fill(&Frame {
            built: self.built,
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
    fn damped() -> (Scene, Built, Plan) {
        let scene = read(&CUBE.replace("density = 1000", "density = 1000\ndamping = 200"));
        let built = crate::build(&scene).unwrap_or_else(|error| panic!("{}", error.plain()));
        let plan = crate::plan(&scene, &built).unwrap_or_else(|error| panic!("{}", error.plain()));
        (scene, built, plan)
    }

    fn corner(built: &Built, live: &dyn Live, part: f64, step: f64, by: [f64; 3]) -> Grip {
        let last = built.model.node_count() as u32 - 1;
        let mut grip = Grip { nodes: vec![(last, 0.25), (last - 1, 0.75)], ..Grip::default() };
        grip.stiffness = part * grip.stiffest(&built.model, step);
        let [point, _] = live.pulled(&grip);
        grip.place = [0, 1, 2].map(|c| point[c] + by[c]);
        grip
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
