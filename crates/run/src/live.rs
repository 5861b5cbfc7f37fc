//! A scene that is played: it runs as long as someone looks, can be pulled at, and shows what its `[view]`
//! asks for.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::Point3;
use pliant_explicit::Wanted;
use pliant_geometry::{Mesh, Vector3};
use pliant_sim::contact::touch::Rigid;
#[cfg(feature = "gpu")]
use pliant_sim::gpu::{DeviceMapping, DevicePoints, PointValue};
use pliant_sim::{Failure, Simulation, SimulationState};

use crate::output::{Column, FieldMesh, Frame, Samples, frames};
use pliant_format::tables::VtuTable;
use pliant_scene::World;

/// Instants after the start at which ways are sampled.
const INSTANTS: u32 = 32;

/// The least and the greatest coordinates of points [m].
type Extent = [Vector3; 2];

fn extent(points: impl Iterator<Item = Vector3>) -> Option<Extent> {
    points.map(|point| [point; 2]).reduce(|[a, b], [c, d]| [a.inf(&c), b.sup(&d)])
}

fn corners(extent: Extent) -> impl Iterator<Item = Vector3> {
    (0..8).map(move |corner| Vector3::from_fn(|axis, _| extent[corner >> axis & 1][axis]))
}

/// A running world with its displayed mesh and its samples.
pub struct Live {
    /// The simulation: it is stepped, held and read here.
    pub simulation: Simulation,
    world: Arc<World>,
    shown: FieldMesh,
    /// Finds the points of the snapshot of a state on a device.
    #[cfg(feature = "gpu")]
    mapping: Option<DeviceMapping>,
    samples: Samples,
}

impl Live {
    /// Begins to play a world.
    ///
    /// # Errors
    /// If a stepper can't be made.
    pub fn new(world: &Arc<World>) -> Result<Self, Failure> {
        Ok(Self::of(world, world.simulation()?))
    }

    /// Continues the run of another world, `before`, in this world: with displacements, velocities and the
    /// internal variables of relaxing laws. Returns `None` if the worlds differ in mesh, solver or precision.
    ///
    /// # Errors
    /// If a stepper can't be made.
    pub fn go_on(
        world: &Arc<World>,
        state: SimulationState,
        before: &World,
    ) -> Result<Option<Self>, Failure> {
        let simulation = Simulation::continued(world.simulated(), state, &before.simulated())?;
        Ok(simulation.map(|simulation| Self::of(world, simulation)))
    }

    /// Goes back to a state of this run.
    ///
    /// # Errors
    /// If a stepper can't be made. The run then stays as it was.
    pub fn restore(&mut self, state: SimulationState) -> Result<(), Failure> {
        self.simulation.restore(state)?;
        #[cfg(feature = "gpu")]
        {
            self.mapping = None;
        }
        Ok(())
    }

    /// Halves the steps from here on, and releases all grips.
    ///
    /// # Errors
    /// If the steps can't be halved, the state can't be taken, or a stepper can't be made.
    pub fn halve_steps(&mut self) -> Result<(), Failure> {
        let mut state = self.simulation.state()?;
        if !state.halve_steps(self.simulation.setup()) {
            return Err(Failure::input(&"the steps of this scene cannot be halved"));
        }
        self.restore(state)
    }

    /// Continues from the present state with other numbers (laws, loads, steps). Returns false and changes
    /// nothing if the other world has other meshes, solvers or number types.
    ///
    /// # Errors
    /// If the state can't be taken, or a stepper can't be made. The run then stays as it was.
    pub fn exchange(&mut self, world: &Arc<World>) -> Result<bool, Failure> {
        let goes_on = self.simulation.exchange(world.simulated())?;
        if goes_on {
            self.world = Arc::clone(world);
            self.show(&world.scene.shown(1.0));
            self.samples = Samples::new(world, &world.scene.sampled());
        }
        Ok(goes_on)
    }

    fn of(world: &Arc<World>, simulation: Simulation) -> Self {
        Self {
            simulation,
            shown: FieldMesh::new(world, &world.scene.shown(1.0)),
            samples: Samples::new(world, &world.scene.sampled()),
            world: Arc::clone(world),
            #[cfg(feature = "gpu")]
            mapping: None,
        }
    }

    /// Returns the displayed points at the instant with a value each, computed on the GPU where the state
    /// lies. `given` replaces the earlier given values. Returns `None` if the solver keeps its state in
    /// ordinary memory.
    #[cfg(feature = "gpu")]
    pub fn place(
        &mut self,
        value: PointValue,
        given: Option<&[f32]>,
    ) -> Option<Result<DevicePoints, Failure>> {
        let (world, shown) = (&self.world, &self.shown);
        let on_device = self.simulation.on_device()?;
        if self.mapping.is_none() {
            let points = (0..)
                .zip(&shown.mesh().points)
                .map(|(point, place)| ([place.x, place.y, place.z], shown.nodes_of(world, point).1));
            match on_device.map(points) {
                Ok(mapping) => self.mapping = Some(mapping),
                Err(failure) => return Some(Err(failure)),
            }
        }
        let mapping = self.mapping.as_ref()?;
        if let Some(values) = given {
            mapping.give(values);
        }
        on_device.apply(mapping, value);
        Some(Ok(mapping.points().clone()))
    }

    /// True if the state lies on a device, so that places of nodes are known only after they are read back.
    #[cfg(feature = "gpu")]
    pub fn is_on_device(&self) -> bool {
        self.world.device().is_some()
    }

    /// Returns a point of the displayed mesh as a combination of nodes, counted over the models of all
    /// participants.
    pub fn nodes_of(&self, point: u32) -> Vec<(u32, f64)> {
        let (part, nodes) = self.shown.nodes_of(&self.world, point);
        nodes.into_iter().map(|(node, weight)| (self.simulation.node(part, node), weight)).collect()
    }

    /// Returns the tool or obstacle that a point of the displayed mesh belongs to; `None` for a point of a
    /// body.
    pub fn thing_of(&self, point: u32) -> Option<&Rigid> {
        let (part, rigid) = self.shown.thing_of(point)?;
        self.world.participants[part].built.contacts.as_ref()?.rigids.get(rigid)
    }

    /// True if a user can grab a point of the displayed mesh: a point of a body or a tool, not of an
    /// obstacle.
    pub fn is_movable(&self, point: u32) -> bool {
        let is_tool = |rigid: &Rigid| self.world.scene.tools.iter().any(|(name, _)| name == rigid.tool());
        self.thing_of(point).is_none_or(is_tool)
    }

    /// Returns the present place of a point of a tool that is at `start` [m] at the start.
    pub fn place_on(&self, point: u32, start: &Vector3) -> Vector3 {
        let moved = self.shown.thing_of(point).and_then(|(part, number)| {
            let rigid = self.world.participants[part].built.contacts.as_ref()?.rigids.get(number)?;
            let now = self.simulation.instants().nth(part)?;
            let (from, to) = (rigid.stance(0.0, None), now.stance(number, rigid));
            let grown = start + self.shown.outward_of(point) * (to.growth - from.growth);
            Some((to.pose * from.pose.inverse() * Point3::from(grown)).coords)
        });
        moved.unwrap_or(*start)
    }

    /// Returns places [m] that obstacles, tools and driven nodes reach until the end of the scene. They are
    /// the corners of the box around each, at some instants.
    pub fn ways(&self) -> Vec<Vector3> {
        let mut things: BTreeMap<(usize, usize), Vec<Vector3>> = BTreeMap::new();
        for (index, &point) in (0..).zip(&self.shown.mesh().points) {
            if let Some(thing) = self.shown.thing_of(index) {
                things.entry(thing).or_default().push(point);
            }
        }
        let parts = &self.world.participants;
        let boxes = things.into_iter().filter_map(|((part, number), points)| {
            let rigid = parts[part].built.contacts.as_ref()?.rigids.get(number)?;
            Some((rigid, rigid.stance(0.0, None), extent(points.into_iter())?))
        });
        let boxes: Vec<_> = boxes.collect();
        let mut ways = Vec::new();
        for instant in 0..=INSTANTS {
            let time = self.world.scene.scene.until * f64::from(instant) / f64::from(INSTANTS);
            for (rigid, from, [low, high]) in &boxes {
                let to = rigid.stance(time, None);
                let (motion, grown) = (to.pose * from.pose.inverse(), to.growth - from.growth);
                let around = corners([low.add_scalar(-grown), high.add_scalar(grown)]);
                ways.extend(around.map(|corner| (motion * Point3::from(corner)).coords));
            }
            for model in parts.iter().map(|part| &part.built.model) {
                for constraint in
                    model.constraints.iter().filter(|constraint| !constraint.motion.is_collective())
                {
                    let place = |(index, &node): (usize, &u32)| {
                        let moved = Vector3::from(constraint.motion.displacement(index, time, 1.0));
                        let is_driven = |axis: usize| f64::from(u8::from(constraint.components[axis]));
                        let moved = Vector3::from_fn(|axis, _| moved[axis] * is_driven(axis));
                        Vector3::from(model.rest[node as usize]) + moved
                    };
                    let around = extent(constraint.nodes.iter().enumerate().map(place));
                    ways.extend(around.into_iter().flat_map(corners));
                }
            }
        }
        ways
    }

    /// Shows another series.
    pub fn show(&mut self, shown: &VtuTable) {
        self.shown = FieldMesh::new(&self.world, shown);
        #[cfg(feature = "gpu")]
        {
            self.mapping = None;
        }
    }

    /// Returns the displayed mesh, at rest, with the fields of the instant last shown.
    pub fn shown(&self) -> &Mesh {
        self.shown.mesh()
    }

    /// Returns the displayed mesh, at rest, with the fields of the present instant. Computes the forces
    /// first.
    ///
    /// # Errors
    /// If forces at the instant can't be found.
    pub fn mesh(&mut self) -> Result<&Mesh, Failure> {
        self.simulation.evaluate(Wanted::Everything)?;
        self.shown.fill(&frames(&self.world, &self.simulation));
        Ok(self.shown.mesh())
    }

    /// Forces [N] that hold or move the nodes of each constraint of all participants, at the instant last
    /// evaluated.
    pub fn reactions(&self) -> Vec<[f64; 3]> {
        frames(&self.world, &self.simulation).iter().flat_map(Frame::reactions).collect()
    }

    /// Returns the columns of a sample: reactions, energies and the probes of all tables of the scene, with
    /// units.
    pub fn columns(&self) -> &[Column] {
        self.samples.columns()
    }

    /// Adds the sample of the instant last shown to a row.
    pub fn sample(&mut self, row: &mut Vec<f64>) {
        self.samples.read(&frames(&self.world, &self.simulation), row);
    }
}

#[cfg(test)]
mod tests {
    use pliant_mechanics::grip::Grip;
    use pliant_sim::Reals;

    use super::*;
    use crate::testing::{CUBE, read};

    /// The cube, damped so that it comes to rest.
    fn damped() -> Arc<World> {
        other(&[])
    }

    fn model(world: &World) -> &pliant_mechanics::Model {
        &world.only().unwrap().built.model
    }

    fn corner(world: &World, live: &Live, part: f64, by: [f64; 3]) -> Grip {
        let last = model(world).node_count() as u32 - 1;
        let mut grip = Grip { nodes: vec![(last, 0.25), (last - 1, 0.75)], ..Grip::default() };
        grip.stiffness = part * live.simulation.stiffest(&grip);
        let [point, _] = live.simulation.pulled(&grip);
        grip.place = [0, 1, 2].map(|c| point[c] + by[c]);
        grip
    }

    /// The damped cube with other numbers.
    fn other(changes: &[(&str, &str)]) -> Arc<World> {
        let mut text = CUBE.replace("density = 1000", "density = 1000\ndamping = 200");
        changes.iter().for_each(|(from, to)| text = text.replace(from, to));
        Arc::new(World::new(&read(&text)).unwrap_or_else(|error| panic!("{}", error.plain())))
    }

    fn pulled_for(world: &Arc<World>, steps: u64) -> Live {
        let mut live = Live::new(world).unwrap();
        let grip = Grip { stiffness: 20.0, ..corner(world, &live, 0.5, [0.0, 0.0, 5e-3]) };
        live.simulation.grip(&[grip]);
        (0..steps).for_each(|_| assert_eq!(live.simulation.step(1).unwrap(), 1));
        live
    }

    fn height(live: &mut Live) -> f64 {
        live.mesh().unwrap().point_data["displacement"].values.last().copied().unwrap()
    }

    /// The grip of [`pulled_for`], as stiff after the change.
    fn grip(live: &mut Live, world: &World) {
        let last = model(world).node_count() as u32 - 1;
        let [x, y, z] = [last, last - 1]
            .map(|n| live.simulation.rest(n))
            .into_iter()
            .zip([0.25, 0.75])
            .fold([0.0; 3], |sum, (x, w)| [0, 1, 2].map(|c| sum[c] + w * x[c]));
        let nodes = vec![(last, 0.25), (last - 1, 0.75)];
        assert!(live.simulation.grip(&[Grip { nodes, place: [x, y, z + 5e-3], stiffness: 20.0 }]));
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
        half.mesh().unwrap();
        let state = half.simulation.state().unwrap();
        let mut half = Live::go_on(&again, state, &stage).unwrap().unwrap();
        grip(&mut half, &again);
        for _ in 150..300 {
            half.simulation.step(1).unwrap();
        }
        assert_eq!(
            (whole.simulation.time().to_bits(), whole.simulation.fingerprint()),
            (half.simulation.time().to_bits(), half.simulation.fingerprint())
        );
        whole.mesh().unwrap();
        half.mesh().unwrap();
        assert_eq!(whole.simulation.energies(), half.simulation.energies());
    }

    #[test]
    fn displacements_keep_their_address_as_long_as_the_run_lives() {
        let solvers = [
            ("precision = 'single'", "single"),
            ("solver = 'explicit'\nprecision = 'double'", "double"),
            ("solver = 'quasi-static'\nload-steps = 4\nprecision = 'double'", "double"),
        ];
        for (run, precision) in solvers {
            let with = |modulus: &str| {
                let run = format!("[run]\n{run}\n[law.tissue]");
                other(&[("[law.tissue]", &run), ("young-modulus = 10e3", modulus)])
            };
            let mut live = Live::new(&with("young-modulus = 10e3")).unwrap();
            let shown =
                |live: &Live| live.simulation.instants().next().unwrap().displacements().unwrap().address();
            let address = shown(&live);
            let start = live.simulation.state().unwrap();
            for _ in 0..4 {
                live.simulation.step(1).unwrap();
            }
            let node = model(&with("young-modulus = 10e3")).node_count() - 1;
            let now = live.simulation.instants().next().unwrap();
            let last = match now.displacements().unwrap() {
                Reals::Single(values) => values[node].map(f64::from),
                Reals::Double(values) => values[node],
            };
            assert_eq!(
                (last, precision),
                (now.displacement(node), if now.is_single() { "single" } else { "double" })
            );
            assert_eq!(shown(&live), address);
            let state = live.simulation.state().unwrap();
            live.restore(start).unwrap();
            assert_eq!(shown(&live), address, "after going back");
            assert!(live.exchange(&with("young-modulus = 11e3")).unwrap());
            assert_eq!(shown(&live), address, "after an exchange");
            live.restore(state).unwrap();
            assert_eq!(shown(&live), address, "after going on again");
        }
    }

    #[test]
    fn a_stiffer_law_ends_where_it_would_have_from_the_start() {
        let less = ("damping = 200", "damping = 5");
        let (soft, stiff) =
            (other(&[less]), other(&[less, ("young-modulus = 10e3", "young-modulus = 40e3")]));
        let step = |world: &World| world.only().unwrap().plan.steps.step;
        assert!(step(&stiff) < 0.6 * step(&soft));
        let mut going = pulled_for(&soft, 4000);
        let pulled = height(&mut going);
        going.simulation.step(1).unwrap();
        let (state, time) = (going.simulation.state().unwrap(), going.simulation.time());
        let mut going = Live::go_on(&stiff, state, &soft).unwrap().unwrap();
        assert_eq!(going.simulation.time(), time);
        grip(&mut going, &stiff);
        going.simulation.step(1).unwrap();
        assert!(
            (going.simulation.time() - time - step(&stiff)).abs() < 1e-12,
            "time goes on in the new steps"
        );
        for _ in 0..12_000 {
            going.simulation.step(1).unwrap();
        }
        let (ended, expected) = (height(&mut going), height(&mut pulled_for(&stiff, 12_000)));
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
        let state = going.simulation.state().unwrap();
        let mut going = Live::go_on(&fine, state, &coarse).unwrap().unwrap();
        grip(&mut going, &fine);
        (0..68).for_each(|_| assert_eq!(going.simulation.step(1).unwrap(), 1));
        let mut whole = pulled_for(&fine, 0);
        grip(&mut whole, &fine);
        let mut largest = 0.0_f64;
        for _ in 0..100 {
            whole.simulation.step(1).unwrap();
            largest = largest.max(height(&mut whole).abs());
        }
        assert!((whole.simulation.time() - going.simulation.time()).abs() < 1e-12);
        let [changed, expected] = [going, whole].map(|mut live| height(&mut live));
        // The errors of both steps are below 2 % of the swing; twice or half the velocity would change it by
        // half.
        assert!(
            (changed - expected).abs() < 0.05 * largest,
            "{changed} m, {expected} m in short steps, of {largest} m"
        );
    }

    #[test]
    fn more_mass_unbalances_no_energy() {
        let (light, heavy) = (other(&[]), other(&[("density = 1000", "density = 3000")]));
        let mut going = pulled_for(&light, 60);
        let state = going.simulation.state().unwrap();
        let mut going = Live::go_on(&heavy, state, &light).unwrap().unwrap();
        grip(&mut going, &heavy);
        go(&mut going, 400);
        assert!(going.simulation.energies().balance < 0.02, "{:?}", going.simulation.energies());
    }

    #[test]
    fn another_mesh_goes_on_from_nothing() {
        let (coarse, fine) = (other(&[]), other(&[("cells = [2, 2, 2]", "cells = [2, 2, 3]")]));
        let state = pulled_for(&coarse, 10).simulation.state().unwrap();
        assert!(Live::go_on(&fine, state, &coarse).unwrap().is_none());
    }

    fn go(live: &mut Live, steps: u64) {
        (0..steps).for_each(|_| assert_eq!(live.simulation.step(1).unwrap(), 1));
        live.mesh().unwrap();
    }

    #[test]
    fn a_grip_pulls_with_the_force_that_the_base_holds_and_leaves_nothing_behind() {
        let world = damped();
        let mut live = Live::new(&world).unwrap();
        let grip = corner(&world, &live, 0.5, [0.0, 0.0, 2e-3]);
        assert!(live.simulation.grip(std::slice::from_ref(&grip)));
        go(&mut live, 4000);
        let ([_, force], base) = (live.simulation.pulled(&grip), live.reactions()[0]);
        let most = force.iter().fold(0.0_f64, |most, f| most.max(f.abs()));
        assert!(most > 1e-2, "{force:?}");
        for c in 0..3 {
            assert!((force[c] + base[c]).abs() < 1e-6 * most, "{force:?} {base:?}");
        }
        // Its work is external work: the energies balance.
        assert!(live.simulation.energies().balance < 0.01, "{:?}", live.simulation.energies());
        assert!(live.simulation.grip(&[]));
        go(&mut live, 4000);
        let moved = &live.mesh().unwrap().point_data["displacement"].values;
        let left = moved.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
        assert!(left < 1e-9, "{left}");
    }

    #[test]
    fn the_stiffest_grip_leaves_steps_stable() {
        let world = damped();
        let mut live = Live::new(&world).unwrap();
        let grip = corner(&world, &live, 1.0, [1e-3, 0.0, 0.0]);
        live.simulation.grip(&[grip]);
        go(&mut live, 3000);
    }

    #[test]
    fn what_is_played_has_the_bits_of_what_is_run() {
        let world = damped();
        let mut states = Vec::new();
        for looks in [1, 50] {
            let mut live = Live::new(&world).unwrap();
            for _ in 0..100 / looks {
                go(&mut live, looks);
            }
            states.push((live.simulation.time().to_bits(), live.simulation.fingerprint()));
        }
        assert_eq!(states[0], states[1], "looking changes nothing");
    }
}
