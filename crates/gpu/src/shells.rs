//! Explicit shells on a device: the central differences of `pliant_implicit::ExplicitShells` in single
//! precision.
//!
//! Two kernels a step. A facet finds the forces on its corners, including pressure. A node sums the forces of
//! its corners in the order of the facets, adds its loads and moves. The state on the device is
//! displacements, rotations, velocities and spins. Factors of loads and velocities of moved nodes are found
//! in double precision on the CPU, and are rows of a table, one per instant.
//!
//! Not available: features that [`GpuShells::unsupported`] names, and energies and reactions: the CPU finds
//! these from a state that is read back. The work of forces from outside is summed on the device, so none of
//! it is lost in between.

use std::sync::Arc;
use std::time::Instant as Clock;

use bytemuck::{Pod, Zeroable};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use pliant_implicit::{Assembly, AssemblyState, CurvedSurface};
use pliant_mechanics::load::{LoadKind, Spread};
use pliant_mechanics::model::Motion;
use pliant_shells::{EdgeRule, Patch};

use crate::kernel::{Binding, Bound, Kernel, Memory};
use crate::paths::by_rows;
use crate::run::{Rows, room};
use crate::transfer::{Four, Transfer};
use crate::{Device, GpuError};

/// Numbers of a facet at rest: half of the stiffness, tension, gradients, corners, axes.
const AT_REST: usize = 171 + 18 + 6 + 6 + 9;

/// Nothing is broken, and no node moves.
const NONE: u32 = u32::MAX;

/// Numbers of an instant; twin of the one in shells/instant.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Instant {
    index: u32,
    row: u32,
    first: u32,
    step: f32,
}

/// Result of [`GpuShells::advance`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShellsMoved {
    /// Steps taken.
    pub steps: u64,
    /// Work [J] of forces from outside on the way, by the trapezoidal rule, less what those at the end do:
    /// half of their power × step.
    pub work: f64,
    /// True if a facet was broken, in single precision, before all steps were taken. The state is then the
    /// state at this instant; the CPU's forces there decide if a facet is broken, and name it.
    pub broken: bool,
}

/// Steps shells of one model by one step size on a device.
pub struct GpuShells {
    device: Device,
    model: Arc<Assembly>,
    step: f64,
    /// The nodes that constraints move, in the order of the constraints.
    moved: Vec<Moved>,
    rows: Rows<Instant>,
    bound: Bound,
    broken: wgpu::Buffer,
    places: wgpu::Buffer,
    rates: wgpu::Buffer,
    pushes: wgpu::Buffer,
    /// True if any node is pushed.
    pushed: bool,
    facets: Kernel,
    nodes: Kernel,
    transfer: Transfer,
    loaded: bool,
    /// Seconds that an instant takes, once known; of one at which a facet is broken it is less.
    pace: Option<f64>,
}

/// A node that a constraint moves.
struct Moved {
    constraint: usize,
    /// Index of the node in the constraint.
    index: usize,
    components: [bool; 6],
    /// Place of its six numbers in a row of the table.
    place: usize,
}

impl GpuShells {
    /// A stepper for steps of a length [s]; those above `ExplicitShells::stable_step` are unstable.
    ///
    /// # Errors
    /// If something of the model [runs on the CPU only](Self::unsupported), or the device can't take the
    /// model.
    pub fn new(device: &Device, model: impl Into<Arc<Assembly>>, step: f64) -> Result<Self, GpuError> {
        let model = model.into();
        if let Some(what) = Self::unsupported(&model) {
            return Err(GpuError::Unsupported { what });
        }
        let memory = Memory::new(device);
        device.fill(|| memory.bytes(), || Self::on_device(device, &memory, model, step))
    }

    /// Names a feature of a model that explicit shells on a device do not have.
    pub fn unsupported(model: &Assembly) -> Option<String> {
        if let Some(constraint) = model.collective() {
            return Some(format!("the constraint `{}`, which binds nodes to each other,", constraint.name));
        }
        let load = model.loads.iter().find(|load| {
            let pressure = matches!(load.kind, LoadKind::Pressure { .. });
            pressure || load.controlled || load.surface.is_some()
        });
        if let Some(load) = load {
            return Some(format!("the load `{}`, which acts on a surface or is controlled,", load.name));
        }
        let others = [
            (model.facets.is_empty() || !model.solids.is_empty(), "a solid in a model of explicit shells"),
            (!model.springs.is_empty(), "a spring on explicit shells"),
            (!model.ties.is_empty() || !model.turns.is_empty(), "a tie of explicit shells"),
            (model.contact.is_some(), "contact of explicit shells"),
            (!model.force_limits.is_empty(), "a `force-limit` on explicit shells"),
            (model.stiffness_damping > 0.0, "damping by stiffness of explicit shells"),
        ];
        others.into_iter().find(|(there, _)| *there).map(|(_, what)| what.to_owned())
    }

    fn on_device(
        device: &Device,
        memory: &Memory<'_>,
        model: Arc<Assembly>,
        step: f64,
    ) -> Result<Self, GpuError> {
        let nodes = model.rest.len();
        let (moved, motions) = moved_nodes(&model);
        let stride = model.loads.len() + 6 * motions.iter().filter(|&&place| place != NONE).count();
        let places = memory.zeros("the places of nodes", nodes * 32)?;
        let rates = memory.zeros("the velocities of nodes", nodes * 32)?;
        let rows = Rows::new(memory, device, stride)?;
        let broken = memory.filled("the findings", &[NONE])?;
        let bound = Bound::new(device, &[rows.instant(), Binding::Write(&broken), rows.table()]);
        let kernels =
            Kernels { memory, device, model: &model, bound: &bound, places: &places, rates: &rates };
        let of_facets = kernels.facets()?;
        let pushes = memory.zeros("the forces on nodes", nodes * 16)?;
        let node_kernel = kernels.nodes(&of_facets, step, &motions, &pushes)?;
        Ok(Self {
            device: device.clone(),
            step,
            moved,
            rows,
            bound,
            broken,
            places,
            rates,
            pushes,
            pushed: false,
            facets: of_facets.kernel,
            nodes: node_kernel,
            transfer: Transfer::default(),
            loaded: false,
            pace: None,
            model,
        })
    }

    /// The length of a step [s].
    pub fn step(&self) -> f64 {
        self.step
    }

    /// Uploads another state than the present one.
    pub fn upload(&mut self, state: &AssemblyState) {
        let four = |v: &Vector3<f64>| [v.x as f32, v.y as f32, v.z as f32, 0.0];
        let places: Vec<[Four; 2]> = (state.position.iter().zip(&state.rotation).enumerate())
            .map(|(node, (place, rotation))| {
                let q = rotation.coords;
                [four(&(place - self.model.place(node))), [q.x as f32, q.y as f32, q.z as f32, q.w as f32]]
            })
            .collect();
        let rates: Vec<[Four; 2]> =
            state.velocity.iter().zip(&state.spin).map(|(v, w)| [four(v), four(w)]).collect();
        self.device.queue.write_buffer(&self.places, 0, bytemuck::cast_slice(&places));
        self.device.queue.write_buffer(&self.rates, 0, bytemuck::cast_slice(&rates));
        self.loaded = true;
    }

    /// Replaces the forces [N] on nodes from outside. Only these act from the next step on, in addition to
    /// the loads of the model.
    pub fn push(&mut self, forces: &[(u32, [f64; 3])]) {
        if forces.is_empty() && !self.pushed {
            return;
        }
        let mut pushes = vec![[0.0; 3]; self.model.rest.len()];
        for &(node, force) in forces {
            pushes[node as usize].iter_mut().zip(force).for_each(|(sum, f)| *sum += f);
        }
        let pushes: Vec<Four> =
            pushes.into_iter().map(|f| [f[0] as f32, f[1] as f32, f[2] as f32, 0.0]).collect();
        self.device.queue.write_buffer(&self.pushes, 0, bytemuck::cast_slice(&pushes));
        self.pushed = !forces.is_empty();
    }

    /// Takes `steps` steps and reads the state back. The first call uploads the state;
    /// [`upload`](Self::upload) uploads another one.
    ///
    /// # Errors
    /// If the device fails.
    pub fn advance(&mut self, state: &mut AssemblyState, steps: u64) -> Result<ShellsMoved, GpuError> {
        if !self.loaded {
            self.upload(state);
        }
        self.device.queue.write_buffer(&self.broken, 0, bytemuck::bytes_of(&NONE));
        let pace = self.pace;
        let mut times = vec![state.time];
        while (times.len() as u64) <= steps {
            let left = steps + 1 - times.len() as u64;
            let count = left.min(room(self.pace) as u64);
            for _ in 0..count {
                let index = times.len() as u32 - 1;
                let time = times[index as usize];
                self.add_instant(index, time);
                times.push(time + self.step);
            }
            let begun = Clock::now();
            let submission = self.submit();
            self.device.wait_for(submission)?;
            self.pace = Some(begun.elapsed().as_secs_f64() / count as f64);
        }
        let (broken, work) = self.read(state)?;
        let taken = u64::from(broken).min(steps);
        if taken < steps {
            self.pace = pace;
        }
        state.time = times[taken as usize];
        Ok(ShellsMoved { steps: taken, work, broken: taken < steps })
    }

    /// Adds an instant at a time [s].
    fn add_instant(&mut self, index: u32, time: f64) {
        let Self { rows, model, moved, step, .. } = self;
        let stride = rows.stride;
        let fill = |numbers: &mut Vec<f32>| {
            let row = numbers.len();
            numbers.extend(model.loads.iter().map(|load| load.curve.value(time) as f32));
            numbers.resize(row + stride, 0.0);
            for Moved { constraint, index, components, place } in moved {
                let by = model.constraints[*constraint].motion.increment(*index, time, time + *step);
                for c in (0..6).filter(|&c| components[c]) {
                    numbers[row + *place + c] = (by[c] / *step) as f32;
                }
            }
        };
        rows.push(|row| Instant { index, row, first: u32::from(index == 0), step: *step as f32 }, fill);
    }

    fn submit(&mut self) -> wgpu::SubmissionIndex {
        let Self { rows, facets, nodes, bound, .. } = self;
        rows.submit(&self.device, |pass, _, offset| {
            facets.run(pass, bound, offset, 0);
            nodes.run(pass, bound, offset, 0);
        })
    }

    /// Reads the state back: the first instant at which a facet was broken, and the work of forces from
    /// outside [J].
    fn read(&mut self, state: &mut AssemblyState) -> Result<(u32, f64), GpuError> {
        let model = &self.model;
        let bytes = (32 * model.rest.len()) as u64;
        let mut read = (NONE, 0.0);
        let arrays = [(&self.places, bytes), (&self.rates, bytes), (&self.broken, 4)];
        self.transfer.read_all(&self.device, &arrays, |parts| {
            read.0 = bytemuck::cast_slice::<u8, u32>(parts[2])[0];
            if read.0 == 0 {
                // Nothing has moved: the state keeps its digits, and the sums are those from the call before.
                return;
            }
            let three = |v: Four| Vector3::new(v[0], v[1], v[2]).map(f64::from);
            let places = bytemuck::cast_slice::<u8, [Four; 2]>(parts[0]);
            let rates = bytemuck::cast_slice::<u8, [Four; 2]>(parts[1]);
            for (node, (&[moved, turn], &[velocity, spin])) in places.iter().zip(rates).enumerate() {
                state.position[node] = model.place(node) + three(moved);
                let [x, y, z, w] = turn.map(f64::from);
                state.rotation[node] = UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
                (state.velocity[node], state.spin[node]) = (three(velocity), three(spin));
                read.1 += f64::from(spin[3]);
            }
        })?;
        Ok(read)
    }
}

/// Common input of both kernels.
struct Kernels<'a> {
    memory: &'a Memory<'a>,
    device: &'a Device,
    model: &'a Assembly,
    bound: &'a Bound,
    places: &'a wgpu::Buffer,
    rates: &'a wgpu::Buffer,
}

/// The kernel of facets, and the forces that it finds.
struct FacetForces {
    kernel: Kernel,
    /// Forces on the corners.
    forces: wgpu::Buffer,
    pressed: Option<Pressed>,
}

impl Kernels<'_> {
    /// Makes a kernel that works on its own arrays and, where there are pressures, on `pressure`.
    fn kernel(
        &self,
        name: &str,
        snippets: [&str; 2],
        (arrays, pressure): (&[Binding<'_>], Option<&Bound>),
        invocations: usize,
    ) -> Result<Kernel, GpuError> {
        let constants = [("FACETS", self.model.facets.len()), ("NODES", self.model.rest.len())];
        let arrays = Bound::new(self.device, arrays);
        let groups: Vec<&Bound> = [self.bound, &arrays].into_iter().chain(pressure).collect();
        Kernel::new(self.device, name, &constants, &snippets, &groups, invocations)
    }

    /// Finds the forces of facets.
    fn facets(&self) -> Result<FacetForces, GpuError> {
        let Self { memory, device, model, .. } = self;
        let facets = &model.facets;
        let corners: Vec<[u32; 4]> =
            facets.iter().map(|facet| [facet.nodes[0], facet.nodes[1], facet.nodes[2], 0]).collect();
        let corners = memory.filled("the facets", &corners)?;
        let rest = memory.filled("the stiffness of facets", &at_rest(model))?;
        let forces = memory.zeros("the forces of facets", facets.len() * 96)?;
        let pressed = Pressed::new(memory, device, model)?;
        let arrays = [
            Binding::Read(self.places),
            Binding::Read(&corners),
            Binding::Read(&rest),
            Binding::Write(&forces),
        ];
        let head =
            concat!(include_str!("shaders/shells/instant.wgsl"), include_str!("shaders/shells/facets.wgsl"));
        let press = match pressed {
            None => include_str!("shaders/shells/unpressed.wgsl"),
            Some(_) => include_str!("shaders/shells/pressure.wgsl"),
        };
        let pressure = pressed.as_ref().map(|pressed| &pressed.bound);
        let kernel = self.kernel("facets", [head, press], (&arrays, pressure), facets.len())?;
        Ok(FacetForces { kernel, forces, pressed })
    }

    /// Moves nodes by a step [s], with where their motions are in a row of the table, and forces from
    /// outside.
    fn nodes(
        &self,
        FacetForces { forces, pressed, .. }: &FacetForces,
        step: f64,
        motions: &[u32],
        pushes: &wgpu::Buffer,
    ) -> Result<Kernel, GpuError> {
        let Self { memory, device, model, .. } = self;
        let nodes = model.rest.len();
        let kinds = memory.filled("the masses of nodes", &kinds(model, step))?;
        let motions = memory.filled("the motions of nodes", motions)?;
        let corners = model.facets.iter().enumerate().flat_map(|(facet, triangle)| {
            triangle.nodes.into_iter().zip(0..).map(move |(node, corner)| (node, 3 * facet as u32 + corner))
        });
        let (corner_starts, corners) = by_rows(nodes, corners);
        let corner_starts = memory.filled("the corners of nodes", &corner_starts)?;
        let corners = memory.filled("the corners of nodes", &corners)?;
        let (load_starts, loads) = by_rows(nodes, nodal_loads(model));
        let load_starts = memory.filled("the loads of nodes", &load_starts)?;
        let loads = memory.filled("the loads of nodes", &loads)?;
        let arrays = [
            Binding::Write(self.places),
            Binding::Write(self.rates),
            Binding::Read(&kinds),
            Binding::Read(&motions),
            Binding::Read(&corner_starts),
            Binding::Read(&corners),
            Binding::Read(forces),
            Binding::Read(&load_starts),
            Binding::Read(&loads),
            Binding::Read(pushes),
        ];
        let head =
            concat!(include_str!("shaders/shells/instant.wgsl"), include_str!("shaders/shells/nodes.wgsl"));
        let give = match pressed {
            None => include_str!("shaders/shells/not_given.wgsl"),
            Some(_) => include_str!("shaders/shells/given.wgsl"),
        };
        let given = pressed.as_ref().map(|pressed| Bound::new(device, &[Binding::Read(&pressed.given)]));
        self.kernel("shell nodes", [head, give], (&arrays, given.as_ref()), nodes)
    }
}

/// The nodes that constraints move, and of every node where its motion is in a row of the table.
fn moved_nodes(model: &Assembly) -> (Vec<Moved>, Vec<u32>) {
    let mut places = vec![NONE; model.rest.len()];
    let (mut moved, mut next) = (Vec::new(), model.loads.len() as u32);
    for (constraint, condition) in model.constraints.iter().enumerate() {
        if matches!(condition.motion, Motion::Fixed) {
            continue;
        }
        for (index, &node) in condition.nodes.iter().enumerate() {
            let place = &mut places[node as usize];
            if *place == NONE {
                *place = next;
                next += 6;
            }
            moved.push(Moved { constraint, index, components: condition.components, place: *place as usize });
        }
    }
    (moved, places)
}

/// Returns the constants of facets at rest, number by number.
fn at_rest(model: &Assembly) -> Vec<f32> {
    let facets = model.facets.len();
    let mut numbers = vec![0.0; AT_REST * facets];
    for (facet, triangle) in model.facets.iter().enumerate() {
        let rest = triangle.at_rest();
        let half = (0..18).flat_map(|row| (0..=row).map(move |column| (row, column)));
        let constants = half
            .map(|at| rest.stiffness[at])
            .chain(rest.tension.iter().copied())
            .chain(rest.gradient.iter().flat_map(|g| [g.x, g.y]))
            .chain(rest.corners.iter().flat_map(|c| [c.x, c.y]))
            .chain(rest.axes.iter().copied());
        for (entry, number) in constants.enumerate() {
            numbers[entry * facets + facet] = number as f32;
        }
    }
    numbers
}

/// Returns the factors of the velocity of each node, and bits of the held components.
fn kinds(model: &Assembly, step: f64) -> Vec<Four> {
    let mut held: Vec<u32> = model.turning().into_iter().map(|turns| if turns { 0 } else { 56 }).collect();
    for constraint in &model.constraints {
        let bits = (0..6).filter(|&c| constraint.components[c]).fold(0, |bits, c| bits | 1 << c);
        constraint.nodes.iter().for_each(|&node| held[node as usize] |= bits);
    }
    let of_node = |(node, (bits, damping)): (usize, (u32, f64))| {
        let half = 0.5 * damping * step;
        let gained = step / (1.0 + half);
        let per = |mass: f64| if mass > 0.0 { (gained / mass) as f32 } else { 0.0 };
        let massless = if model.mass[node] == 0.0 { 64 } else { 0 };
        let kept = (1.0 - half) / (1.0 + half);
        [kept as f32, per(model.mass[node]), per(model.rotary_inertia[node]), f32::from_bits(bits | massless)]
    };
    held.into_iter().zip(model.damping()).enumerate().map(of_node).collect()
}

/// Forces and moments of loads on nodes, and weights; with each its load.
fn nodal_loads(model: &Assembly) -> impl Iterator<Item = (u32, [Four; 2])> + Clone {
    let entry = |load: usize, force: [f64; 3], moment: [f64; 3]| {
        let [x, y, z] = force.map(|f| f as f32);
        let [mx, my, mz] = moment.map(|m| m as f32);
        [[x, y, z, f32::from_bits(load as u32)], [mx, my, mz, 0.0]]
    };
    model.loads.iter().enumerate().flat_map(move |(number, load)| -> Vec<(u32, [Four; 2])> {
        let none = [0.0; 3];
        match &load.kind {
            LoadKind::Forces(forces) => {
                forces.iter().map(|&(at, force)| (at, entry(number, force, none))).collect()
            }
            LoadKind::Moments(moments) => {
                moments.iter().map(|&(at, moment)| (at, entry(number, none, moment))).collect()
            }
            LoadKind::Gravity { body, acceleration } => model.bodies[*body]
                .nodes
                .clone()
                .map(|node| (node, entry(number, acceleration.map(|a| model.mass[node as usize] * a), none)))
                .collect(),
            LoadKind::ShellPressure { .. } | LoadKind::Pressure { .. } => Vec::new(),
        }
    })
}

/// Pressures on facets, and their forces.
struct Pressed {
    bound: Bound,
    given: wgpu::Buffer,
}

impl Pressed {
    /// `None` of a model without.
    ///
    /// # Errors
    /// If an array is too large.
    fn new(memory: &Memory<'_>, device: &Device, model: &Assembly) -> Result<Option<Self>, GpuError> {
        let mut entries = Vec::new();
        for (number, load) in (0..).zip(&model.loads) {
            let LoadKind::ShellPressure { facets, pressure, spread } = &load.kind else { continue };
            let [flat, curved] = match spread {
                Spread::Lumped => [*pressure as f32, 0.0],
                Spread::Curved => [0.0, *pressure as f32],
            };
            entries.extend(facets.iter().map(|&facet| (facet, [f32::from_bits(number), flat, curved, 0.0])));
        }
        if entries.is_empty() {
            return Ok(None);
        }
        let (starts, entries) = by_rows(model.facets.len(), entries.into_iter());
        let starts = memory.filled("the pressures of facets", &starts)?;
        let entries = memory.filled("the pressures of facets", &entries)?;
        let normals = memory.filled("the normals of facets", &normals(model))?;
        let weights: Vec<f32> =
            Patch::pressure_weights().as_flattened().iter().map(|&weight| weight as f32).collect();
        let weights = memory.filled("the weights of pressure", &weights)?;
        let given = memory.zeros("the forces of pressure", model.facets.len() * 96)?;
        let bound = Bound::new(
            device,
            &[
                Binding::Read(&starts),
                Binding::Read(&entries),
                Binding::Read(&normals),
                Binding::Read(&weights),
                Binding::Write(&given),
            ],
        );
        Ok(Some(Self { bound, given }))
    }
}

/// Returns the normal of each corner at rest in the axes of its facet. The first normal also has the control
/// points on straight edges, as bits.
fn normals(model: &Assembly) -> Vec<[Four; 3]> {
    let (surface, rest) = (CurvedSurface::new(model, EdgeRule::Arc), AssemblyState::at_rest(model));
    let of_facet = |(number, facet): (u32, &pliant_shells::Facet)| {
        let patch = surface.patch(model, &rest, number);
        let axes: Matrix3<f64> = facet.at_rest().axes;
        let straight = patch
            .straight()
            .iter()
            .enumerate()
            .fold(0_u32, |bits, (k, is_straight)| bits | u32::from(*is_straight) << k);
        patch.normals().map(|normal| {
            let local = axes.tr_mul(&normal);
            [local.x as f32, local.y as f32, local.z as f32, f32::from_bits(straight)]
        })
    };
    (0..).zip(&model.facets).map(of_facet).collect()
}
