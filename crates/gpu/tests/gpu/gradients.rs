//! Equations of implicit steps on the device, against the CPU.

use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::Vector3;
use pliant_contact::barrier::BarrierSettings;
use pliant_contact::pairs::Surface;
use pliant_contact::touch::{Contact, Contacts, Touch, With};
use pliant_geometry::Mesh;
use pliant_gpu::Device;
use pliant_implicit::AssemblySolver;
use pliant_implicit::{
    Assembly, AssemblyState, BackwardEuler, ContactModel, DynamicSettings, Shell, SolveError,
};
use pliant_linear::{
    BlockPattern, BlockValues, DeviceSolver, LinearDevice, LinearSolver, PassEnd, Preconditioner,
};
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::load::{Load, LoadKind, NO_NODE, Spread};
use pliant_mechanics::mapping::Weights;
use pliant_mechanics::model::{Constraint, Enclosure, Motion};
use pliant_meshing::{DEFAULT_CELL_LIMIT, Pattern, Sheet, sphere};
use pliant_shells::element::{Elasticity, Formulation};
use pliant_shells::{Facet, element::Wall};

use crate::support;

const STEP: f64 = 0.04;

const WALL: Wall = Wall { elastic: Elasticity { young: 1e5, poisson: 0.45 }, density: 1000.0 };

fn shell(mesh: &Mesh) -> Assembly {
    support::shell(mesh, 0.002, WALL, Formulation::default())
}

/// A tube of `around` × `along` pairs of shells, fixed at one end and hinged at the other, under a pressure
/// that pulses and its weight.
fn tube(around: u32, along: u32) -> Assembly {
    let cylinder = Sheet::Cylinder { radius: 0.02, length: 0.2, from: 0.0, span: TAU };
    let counts = [around, along].map(|count| count as usize);
    let mut model = shell(&support::triangles(cylinder, counts, Pattern::Diagonal));
    let facets = (0..model.facets.len() as u32).collect();
    let assembly = model.model_mut();
    assembly.fix("foot", (0..around).collect());
    assembly.fix("head", (around * along..around * (along + 1)).collect());
    let hinge = assembly.constraints.last_mut().unwrap();
    hinge.components = [true, true, true, false, false, false];
    let pulse = (0..40).map(|i| (0.25 * f64::from(i), f64::from(i % 2))).collect();
    let curve = Curve { shape: Shape::Table(pulse), from: 0.0, to: 1.0 };
    let kind = LoadKind::ShellPressure { facets, pressure: 1000.0, spread: Spread::Curved };
    assembly.loads.push(Load::new("pressure", kind, curve));
    let hold = Curve { shape: Shape::Hold, from: 0.0, to: 1.0 };
    assembly.loads.push(Load::new(
        "weight",
        LoadKind::Gravity { body: 0, acceleration: [0.0, -9.81, 0.0] },
        hold,
    ));
    assembly.bodies[0].damping = 1.0;
    model
}

fn gradients(tolerance: f64, preconditioner: Preconditioner) -> LinearSolver {
    LinearSolver::ConjugateGradients { tolerance, iterations: 5000, preconditioner }
}

fn on(device: &Device) -> Option<Arc<dyn LinearDevice>> {
    Some(Arc::new(device.clone()))
}

/// The state after some steps, and the largest residual of a linear solution, its iterations and how many
/// were left to the CPU.
fn run(
    device: Option<Arc<dyn LinearDevice>>,
    model: &Assembly,
    settings: DynamicSettings,
    steps: usize,
) -> (AssemblyState, f64, usize, usize) {
    let mut solver = BackwardEuler::on(device, model.clone(), settings).unwrap();
    let (mut state, mut residual) = (AssemblyState::at_rest(model), 0.0_f64);
    for _ in 0..steps {
        residual = residual.max(solver.advance(&mut state).unwrap().linear.residual);
    }
    let phases = solver.phases();
    (state, residual, phases.iterations, phases.left_to_cpu)
}

/// The largest distance between nodes over the largest displacement.
fn off(model: &Assembly, one: &AssemblyState, other: &AssemblyState) -> f64 {
    let largest = |a: &AssemblyState, b: &AssemblyState| {
        a.position.iter().zip(&b.position).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    };
    largest(one, other) / largest(other, &AssemblyState::at_rest(model))
}

const BOTH: [Preconditioner; 2] = [Preconditioner::BlockJacobi, Preconditioner::Aggregates];

/// A solution to 1e-9, far below single precision, agrees with factors in double precision. The error of a
/// displacement exceeds the residual by the condition of the matrix, here 1e3 at most.
#[test]
fn corrections_in_single_precision_add_up_to_a_solution_in_double_precision() {
    let Some(device) = support::device() else { return };
    let model = tube(12, 20);
    let settings = DynamicSettings::new(STEP);
    let exact = run(None, &model, settings.real_time(LinearSolver::Direct), 4).0;
    for preconditioner in BOTH {
        let settings = settings.real_time(gradients(1e-9, preconditioner));
        let (state, residual, iterations, left) = run(on(&device), &model, settings, 4);
        let off = off(&model, &state, &exact);
        println!(
            "{preconditioner:?}: off {off:.1e}, residual {residual:.1e}, {iterations} iterations, {left} left"
        );
        assert!(off < 1e-6 && residual <= 1e-9 && left == 0, "{off:e} {residual:e} {left}");
    }
}

/// A pulsing tube, a second long, as on the CPU: each step is solved to 1e-3 there and here, so displacements
/// differ by some 1e-3.
#[test]
fn a_pulsing_tube_moves_as_on_the_cpu() {
    let Some(device) = support::device() else { return };
    let model = tube(16, 25);
    for preconditioner in BOTH {
        let settings = DynamicSettings::new(STEP).real_time(gradients(1e-3, preconditioner));
        let cpu = run(None, &model, settings, 25);
        let gpu = run(on(&device), &model, settings, 25);
        let off = off(&model, &gpu.0, &cpu.0);
        println!(
            "{preconditioner:?}: off {off:.1e}, {} iterations on the CPU, {} on the device",
            cpu.2, gpu.2
        );
        assert!(off < 5e-3 && gpu.1 <= 1e-3 && gpu.3 == 0, "{off:e} {:e} {}", gpu.1, gpu.3);
    }
}

/// Newton's method comes to the same states with both, to the tolerance of a step.
#[test]
fn newtons_method_converges_to_the_states_of_the_cpu() {
    let Some(device) = support::device() else { return };
    let model = tube(12, 20);
    let settings =
        DynamicSettings { linear: gradients(1e-6, Preconditioner::Aggregates), ..DynamicSettings::new(STEP) };
    let (cpu, gpu) = (run(None, &model, settings, 5), run(on(&device), &model, settings, 5));
    let off = off(&model, &gpu.0, &cpu.0);
    assert!(off < 1e-5, "{off:e}");
}

/// Grows from 0 to 1 in 0.3 s.
const GROWTH: Curve = Curve { shape: Shape::Ramp, from: 0.0, to: 0.3 };

/// Adds a shell to a model; its nodes.
fn add_shell(model: &mut Assembly, name: &str, mesh: &Mesh) -> std::ops::Range<u32> {
    let first = model.rest.len() as u32;
    model.add_body(name, mesh.points.iter().copied());
    let cells = mesh.blocks[0].cells().map(|cell| [0, 1, 2].map(|k| first + cell[k])).collect();
    model.add_shell(&Shell::new(name, cells, 0.002, WALL)).unwrap();
    first..model.rest.len() as u32
}

/// The tube and a plate above it, whose two edges go down by 10 mm, of which 4 mm are free.
fn pressed() -> Assembly {
    let mut model = tube(12, 20);
    let of_tube = model.facets.len();
    let mut mesh = support::triangles(Sheet::Plate { size: [0.06, 0.1] }, [6, 8], Pattern::Diagonal);
    mesh.points.iter_mut().for_each(|x| *x = Vector3::new(x.x - 0.03, 0.024, x.y + 0.05));
    let nodes = add_shell(&mut model, "plate", &mesh);
    let edges = nodes.clone().filter(|&node| model.place(node as usize).x.abs() > 0.029).collect();
    let surface = |nodes: std::ops::Range<u32>, facets: &[Facet]| Surface {
        nodes: nodes.collect(),
        faces: facets.iter().map(|facet| facet.nodes).collect(),
    };
    let (below, above) = model.facets.split_at(of_tube);
    let contact = Contact {
        name: "press".into(),
        surface: surface(0..nodes.start, below),
        with: With::Body(surface(nodes, above)),
        touch: Touch { friction: 0.0, offset: 0.0 },
    };
    model.contact = Some(ContactModel {
        contacts: Arc::new(Contacts { contacts: vec![contact], ..Default::default() }),
        settings: vec![BarrierSettings { distance: 0.002, stiffness: 1e4, creep_speed: 1e-3 }],
        levels: Vec::new(),
        check_intersections: true,
    });
    model.model_mut().constraints.push(Constraint {
        name: "edges".into(),
        nodes: edges,
        components: [true, true, true, false, false, false],
        motion: Motion::Displacement([0.0, -0.01, 0.0], GROWTH),
    });
    model
}

/// The tube with a sleeve, whose end rings are tied between the nodes of two of its rings.
fn sleeved() -> Assembly {
    let mut model = tube(12, 20);
    let half = 0.5 * TAU / 12.0;
    let cylinder = Sheet::Cylinder { radius: 0.02 * half.cos(), length: 0.1, from: half, span: TAU };
    let mut mesh = support::triangles(cylinder, [12, 8], Pattern::Diagonal);
    mesh.points.iter_mut().for_each(|x| x.z += 0.05);
    let nodes = add_shell(&mut model, "sleeve", &mesh);
    // Rings of the tube are 10 mm apart.
    let rings = [(nodes.start, 5), (nodes.end - 12, 15)];
    let tied = rings.iter().flat_map(|&(first, _)| first..first + 12).collect();
    let rows = rings
        .iter()
        .flat_map(|&(_, ring)| (0..12).map(move |k| [(12 * ring + k, 0.5), (12 * ring + (k + 1) % 12, 0.5)]));
    let rows: Vec<_> = rows.collect();
    let mapping = Weights::from_rows(rows.iter().map(|row| &row[..]));
    model.model_mut().tie("seams", tied, mapping).unwrap();
    model
}

/// A balloon that is held at its neck and grows by a third of its volume.
fn balloon() -> Assembly {
    let mut model = shell(&sphere(0.03, 2, DEFAULT_CELL_LIMIT).unwrap());
    let neck = (0..model.rest.len() as u32).filter(|&node| model.place(node as usize).z < -0.025);
    let neck = neck.collect();
    let faces = model.facets.iter().map(|facet| facet.nodes).map(|[a, b, c]| [a, b, c, NO_NODE]).collect();
    let nodes = (0..model.rest.len() as u32).collect();
    let assembly = model.model_mut();
    assembly.fix("neck", neck);
    let enclosure = Enclosure { faces, facets: Vec::new() };
    assembly.constraints.push(Constraint {
        name: "air".into(),
        nodes,
        components: [false; 6],
        motion: Motion::Volume { enclosure, by: 4e-5, curve: GROWTH },
    });
    model
}

/// Contact, ties and enclosed volumes: Newton's method comes to the states of the CPU, where it solves by
/// factors, to the tolerance of a step.
#[test]
fn contact_ties_and_volumes_are_solved_as_on_the_cpu() {
    let Some(device) = support::device() else { return };
    for (name, model) in [("contact", pressed()), ("tie", sleeved()), ("volume", balloon())] {
        let settings = DynamicSettings::new(STEP);
        let exact = run(None, &model, settings, 8).0;
        for preconditioner in BOTH {
            let settings = DynamicSettings { linear: gradients(1e-6, preconditioner), ..settings };
            let (state, residual, iterations, left) = run(on(&device), &model, settings, 8);
            let off = off(&model, &state, &exact);
            println!(
                "{name}, {preconditioner:?}: off {off:.1e}, residual {residual:.1e}, {iterations} iterations, {left} left"
            );
            assert!(off < 1e-5 && residual <= 1e-6 && left == 0, "{name}: {off:e} {residual:e} {left}");
        }
    }
}

/// Contact of two shells changes the pattern of the equations, and compiles no kernel.
#[test]
fn contact_that_comes_and_goes_compiles_no_kernel() {
    let Some(device) = support::device() else { return };
    let model = pressed();
    let linear = gradients(1e-6, Preconditioner::Aggregates);
    let settings = DynamicSettings { linear, ..DynamicSettings::new(STEP) };
    let mut solver = BackwardEuler::on(on(&device), model.clone(), settings).unwrap();
    let (mut state, mut patterns) = (AssemblyState::at_rest(&model), Vec::new());
    let before = device.kernels();
    for _ in 0..8 {
        solver.advance(&mut state).unwrap();
        patterns.push(solver.contact().unwrap().pairs().len());
    }
    patterns.dedup();
    println!("pairs of nodes in contact: {patterns:?}");
    assert!(patterns.len() > 2, "{patterns:?}");
    assert_eq!(device.kernels(), before);
}

/// Solves 4 x − (x before) − (x after) = 1 for six numbers at each node of a chain, five nodes an aggregate.
fn chain(solver: &mut dyn DeviceSolver, nodes: u32) -> Vec<f32> {
    const NONE: u32 = u32::MAX;
    let beside = |node: u32| (node.saturating_sub(1)..node + 2).filter(move |&other| other < nodes);
    let mut row_start = vec![0];
    let (mut column, mut source) = (Vec::new(), Vec::new());
    for node in 0..nodes {
        for other in beside(node) {
            column.push(other);
            source.extend((0..36).map(|at| if at % 7 == 0 { u32::from(other != node) } else { NONE }));
        }
        row_start.push(column.len() as u32);
    }
    let count = nodes / 5;
    let touching: Vec<[u32; 2]> = (0..count)
        .flat_map(|aggregate| [[aggregate, aggregate], [aggregate + 1, aggregate]])
        .filter(|pair| pair[0] < count)
        .collect();
    let diagonal = |number: f32| (0..36).map(move |at| if at % 7 == 0 { number } else { 0.0 });
    // Five times 4, less eight times 1; 1 between aggregates.
    let coarse: Vec<f32> =
        touching.iter().flat_map(|[row, column]| diagonal(if row == column { 12.0 } else { -1.0 })).collect();
    let pattern = BlockPattern {
        row_start: &row_start,
        column: &column,
        source: &source,
        free: vec![63; nodes as usize],
        aggregate_start: &(0..=count).map(|aggregate| 5 * aggregate).collect::<Vec<_>>(),
        touching: Some(touching),
    };
    let inverse: Vec<f32> = (0..nodes).flat_map(|_| diagonal(0.25)).collect();
    let arm = vec![[0.0; 4]; nodes as usize];
    let values = BlockValues { lower: &[4.0, -1.0], inverse: &inverse, arm: &arm, coarse: &coarse };
    let mut solution = vec![0.0; 6 * nodes as usize];
    solver.arrange(&pattern).unwrap();
    solver.take(&values).unwrap();
    let right = vec![1.0; solution.len()];
    assert_eq!(solver.solve(&right, &mut solution, 1e-4, 100).unwrap().end, PassEnd::Reached);
    solution
}

/// A solver that had a larger and a smaller matrix before, and a pattern that found no room, gives the bits
/// of a fresh one. In the middle of a chain x = 1/2.
#[test]
fn another_pattern_leaves_nothing_behind() {
    let Some(device) = support::device() else { return };
    let mut reused = device.solver().unwrap();
    for nodes in [200, 40, 45, 1000, 40] {
        let solution = chain(&mut *reused, nodes);
        assert!((solution[3 * nodes as usize] - 0.5).abs() < 1e-3, "{nodes}");
        let fresh = chain(&mut *device.solver().unwrap(), nodes);
        assert_eq!(solution, fresh, "{nodes}");
    }
    let huge = BlockPattern {
        row_start: &[0],
        column: &[],
        source: &[],
        free: Vec::new(),
        aggregate_start: &[0; 20_001],
        touching: Some(Vec::new()),
    };
    let error = reused.arrange(&huge).unwrap_err();
    assert!(error.0.contains("the inverse of the aggregates"), "{error}");
    assert_eq!(chain(&mut *reused, 40), chain(&mut *device.solver().unwrap(), 40));
}

/// Six hundred loose pieces of four nodes, each held at one node, under their weight. Their aggregates are
/// limited, and their solution to 1e-9 agrees with factors.
#[test]
fn many_loose_pieces_are_solved_with_few_aggregates() {
    let Some(device) = support::device() else { return };
    let piece = |k: u32| {
        let [x, y] = [k % 25, k / 25].map(|i| 0.02 * f64::from(i));
        [(0.0, 0.0), (0.01, 0.0), (0.01, 0.01), (0.0, 0.01)].map(|(u, v)| Vector3::new(x + u, y + v, 0.0))
    };
    let mut model = Assembly::new("wall", (0..600).flat_map(piece));
    let cells =
        (0..600).flat_map(|k| [[0, 1, 2], [0, 2, 3]].map(|cell: [u32; 3]| cell.map(|node| 4 * k + node)));
    model.add_shell(&Shell::new("wall", cells.collect(), 0.002, WALL)).unwrap();
    let assembly = model.model_mut();
    assembly.fix("pins", (0..600).map(|k| 4 * k).collect());
    let weight = LoadKind::Gravity { body: 0, acceleration: [0.0, 0.0, -9.81] };
    assembly.loads.push(Load::new("weight", weight, Curve { shape: Shape::Hold, from: 0.0, to: 1.0 }));
    let settings = DynamicSettings::new(STEP);
    let exact = run(None, &model, settings.real_time(LinearSolver::Direct), 4).0;
    let settings = settings.real_time(gradients(1e-9, Preconditioner::Aggregates));
    let (state, residual, iterations, left) = run(on(&device), &model, settings, 4);
    let off = off(&model, &state, &exact);
    println!("off {off:.1e}, residual {residual:.1e}, {iterations} iterations, {left} left");
    assert!(off < 1e-6 && residual <= 1e-9 && left == 0, "{off:e} {residual:e} {left}");
}

#[test]
fn the_device_gives_the_same_bits_every_time() {
    let Some(device) = support::device() else { return };
    let model = tube(12, 20);
    let settings = DynamicSettings::new(STEP).real_time(gradients(1e-3, Preconditioner::Aggregates));
    let [one, other] = [(); 2].map(|()| run(on(&device), &model, settings, 6).0);
    assert_eq!(one.position, other.position);
}

/// A run whose iterations end early takes what it has, as on the CPU.
#[test]
fn iterations_that_run_out_are_told_with_their_residual() {
    let Some(device) = support::device() else { return };
    let model = tube(12, 20);
    let linear = LinearSolver::ConjugateGradients {
        tolerance: 1e-6,
        iterations: 5,
        preconditioner: Preconditioner::BlockJacobi,
    };
    let settings = DynamicSettings { halvings: 0, ..DynamicSettings::new(STEP).real_time(linear) };
    let mut solver = BackwardEuler::on(on(&device), model.clone(), settings).unwrap();
    match solver.advance(&mut AssemblyState::at_rest(&model)) {
        Err(SolveError::Stalled { iterations: 5, residual }) => assert!(residual > 1e-6),
        other => panic!("{other:?}"),
    }
    let settings = DynamicSettings { accept_stalled: true, ..settings };
    let (_, residual, iterations, _) = run(on(&device), &model, settings, 2);
    assert!(residual > 1e-6 && iterations == 10, "{residual:e} {iterations}");
}

#[test]
fn a_device_that_is_lost_ends_the_step_with_its_name_and_a_remedy() {
    let Some(device) = support::device() else { return };
    let model = tube(12, 20);
    let settings = DynamicSettings::new(STEP).real_time(gradients(1e-3, Preconditioner::Aggregates));
    let mut solver = BackwardEuler::on(on(&device), model.clone(), settings).unwrap();
    let mut state = AssemblyState::at_rest(&model);
    solver.advance(&mut state).unwrap();
    let before = state.clone();
    device.wgpu().0.destroy();
    match solver.advance(&mut state) {
        Err(SolveError::Device(error)) => {
            assert!(error.0.contains(&device.adapter().name) && error.0.contains("run again"), "{error}");
        }
        other => panic!("{other:?}"),
    }
    assert_eq!(state.position, before.position);
}

#[test]
fn a_matrix_beyond_what_the_adapter_allows_is_refused_with_its_size() {
    let Some(_) = support::device() else { return };
    let small =
        Device::open_within(None, |limits, _| limits.max_storage_buffer_binding_size = 1 << 16).unwrap();
    let settings = DynamicSettings::new(STEP).real_time(gradients(1e-3, Preconditioner::BlockJacobi));
    match BackwardEuler::on(on(&small), tube(12, 20), settings).map(|_| ()) {
        Err(SolveError::Device(error)) => assert!(error.0.contains("of the model take"), "{error}"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn other_linear_solvers_are_refused_on_a_device() {
    let Some(device) = support::device() else { return };
    let lagged = gradients(1e-3, Preconditioner::LaggedFactors { renew_after: 10 });
    for linear in [LinearSolver::Direct, LinearSolver::Unsymmetric, lagged] {
        let settings = DynamicSettings { linear, ..DynamicSettings::new(STEP) };
        let refused = BackwardEuler::on(on(&device), tube(6, 5), settings).map(|_| ());
        assert!(matches!(refused, Err(SolveError::Impossible(why)) if why.contains("use one of the two")));
    }
}
