//! Shells of real shapes, read through `PLIANT_DATA`: the leaflets of a patient's aortic valve closing under
//! their pressure, an aneurysm and a rectum blown up. The tests print the time, the residual, and the changes
//! of the answer with the mesh and with the numbering.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use pliant_contact::barrier::BarrierSettings;
use pliant_contact::pairs::Surface;
use pliant_contact::touch::{Contact, Contacts, Touch, With};
use pliant_geometry::{CellBlock, CellKind, Mesh, Vector3, io};
use pliant_implicit::AssemblySolver;
use pliant_implicit::{
    Assembly, AssemblyState, BackwardEuler, ContactModel, DynamicSettings, Shell, StaticSettings, Statics,
};
use pliant_linear::{LinearSolver, Preconditioner};
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::load::{Load, LoadKind, Spread};
use pliant_mechanics::model::{Constraint, Motion};
use pliant_shells::element::Wall;
use pliant_shells::element::{Elasticity, Formulation, Membrane};
use pliant_validation::claim;
use pliant_validation::shells::{FLAT, ramp, renumbered, triangles};

fn data() -> Option<PathBuf> {
    let path = std::env::var_os("PLIANT_DATA").map(PathBuf::from);
    if path.is_none() {
        println!("skipped: PLIANT_DATA is not set");
    }
    path
}

/// The triangles of a file in metres, points that lie on each other joined.
fn surface(path: PathBuf, scale: f64) -> Mesh {
    let mesh = io::read(&path).unwrap_or_else(|error| panic!("{error}")).mesh;
    let mut number: BTreeMap<[u64; 3], u32> = BTreeMap::new();
    let mut points = Vec::new();
    let joined: Vec<u32> = (mesh.points.iter())
        .map(|p| {
            *number.entry([p.x, p.y, p.z].map(f64::to_bits)).or_insert_with(|| {
                points.push(p * scale);
                points.len() as u32 - 1
            })
        })
        .collect();
    let cells = mesh.block(CellKind::Triangle).map(|block| block.nodes.clone()).unwrap_or_default();
    let nodes = cells.into_iter().map(|node| joined[node as usize]).collect();
    Mesh { points, blocks: vec![CellBlock::new(CellKind::Triangle, nodes)], ..Mesh::default() }
}

/// Each triangle cut in four at the middles of its edges: the same surface.
fn refined(mesh: &Mesh) -> Mesh {
    let mut points = mesh.points.clone();
    let mut middle = BTreeMap::new();
    let mut nodes = Vec::new();
    for [a, b, c] in triangles(mesh) {
        let [d, e, f] = [(a, b), (b, c), (c, a)].map(|(i, j)| {
            *middle.entry((i.min(j), i.max(j))).or_insert_with(|| {
                points.push(0.5 * (points[i as usize] + points[j as usize]));
                points.len() as u32 - 1
            })
        });
        nodes.extend([a, d, f, d, b, e, f, e, c, d, e, f]);
    }
    Mesh { points, blocks: vec![CellBlock::new(CellKind::Triangle, nodes)], ..Mesh::default() }
}

/// Turns the longest edges of slivers to the other diagonal where this is better. A sliver has an altitude
/// below a twentieth of that edge. Returns the number of turned edges.
fn flip_slivers(mesh: &mut Mesh) -> usize {
    let mut cells = triangles(mesh);
    let sides = |[a, b, c]: [u32; 3]| [[a, b], [b, c], [c, a]];
    let length = |[a, b]: [u32; 2]| (mesh.points[a as usize] - mesh.points[b as usize]).norm();
    let longest = |cell: [u32; 3]| {
        sides(cell).into_iter().fold([cell[0]; 2], |best, s| if length(s) > length(best) { s } else { best })
    };
    let quality = |cell: [u32; 3]| {
        let [a, b, c] = cell.map(|n| mesh.points[n as usize]);
        (b - a).cross(&(c - a)).norm() / length(longest(cell)).powi(2)
    };
    let mut count = 0;
    for at in 0..cells.len() {
        let [p, q] = longest(cells[at]);
        let tip = |cell: [u32; 3]| cell.into_iter().find(|n| ![p, q].contains(n)).unwrap_or(p);
        let holds = |cell: &[u32; 3], ends: [u32; 2]| ends.iter().all(|end| cell.contains(end));
        if quality(cells[at]) > 0.05 {
            continue;
        }
        let Some(other) = (0..cells.len()).find(|&o| o != at && holds(&cells[o], [p, q])) else { continue };
        let (r, s) = (tip(cells[at]), tip(cells[other]));
        let turned = [[p, s, r], [s, q, r]];
        let worst = |pair: [[u32; 3]; 2]| quality(pair[0]).min(quality(pair[1]));
        let free = !cells.iter().any(|cell| holds(cell, [r, s]));
        if free && worst(turned) > worst([cells[at], cells[other]]) {
            [cells[at], cells[other]] = turned;
            count += 1;
        }
    }
    mesh.blocks[0].nodes = cells.into_iter().flatten().collect();
    count
}

/// An organ to blow up.
#[derive(Clone, Copy)]
struct Organ {
    young: f64,
    thickness: f64,
    pressure: f64,
    membrane: Membrane,
}

impl Organ {
    /// The lowest 5 % of the nodes in z fixed; pressure from inside grows with time from 0 to 1.
    fn model(&self, mesh: &Mesh) -> Assembly {
        let mut model = Assembly::new("shell", mesh.points.clone());
        let material = Wall { elastic: Elasticity { young: self.young, poisson: 0.45 }, density: 1000.0 };
        let formulation = Formulation { membrane: self.membrane, ..Formulation::default() };
        let shell = Shell::new("organ", triangles(mesh), self.thickness, material);
        let notes = model.add_shell(&Shell { formulation, ..shell }).unwrap();
        println!("{} nodes, {} shells, {notes:?}", model.rest.len(), model.facets.len());
        let mut heights: Vec<f64> = mesh.points.iter().map(|p| p.z).collect();
        heights.sort_unstable_by(f64::total_cmp);
        let level = heights[heights.len() / 20];
        let low = (0..mesh.points.len() as u32).filter(|&n| mesh.points[n as usize].z <= level);
        model.model_mut().constraints.push(Constraint {
            name: "lowest".into(),
            nodes: low.collect(),
            components: [true; 6],
            motion: Motion::Fixed,
        });
        let cells: Vec<u32> = (0..model.facets.len() as u32).collect();
        let outwards = model.rest_volume(&cells).signum();
        let kind = LoadKind::ShellPressure {
            facets: cells,
            pressure: outwards * self.pressure,
            spread: Spread::Lumped,
        };
        model.model_mut().loads.push(Load::new("pressure", kind, ramp()));
        model
    }

    /// The equilibrium at full pressure, in five load steps.
    fn equilibrium(&self, mesh: &Mesh) -> Result<(Assembly, AssemblyState), String> {
        let model = self.model(mesh);
        let start = Instant::now();
        let mut solver = Statics::new(model.clone(), StaticSettings::default()).unwrap();
        let mut state = AssemblyState::at_rest(&model);
        let cells: Vec<u32> = (0..model.facets.len() as u32).collect();
        let rest = model.rest_volume(&cells);
        let (steps, mut parts, mut iterations) = (5, 0, 0);
        for part in 1..=steps {
            match solver.solve(&mut state, f64::from(part) / f64::from(steps)) {
                Ok(step) => {
                    parts += step.parts;
                    iterations += step.residuals.len() - 1;
                    let [first, last] = [step.residuals[0], step.residuals[step.residuals.len() - 1]];
                    println!(
                        "  load {part}/{steps}: residual {first:.1e} to {last:.1e} N, {} negative pivots",
                        step.negative_pivots
                    );
                }
                Err(error) => {
                    println!(
                        "  fails at load {:.3}: {error}; volume × {:.4}, largest displacement {:.2} mm",
                        state.time,
                        model.enclosed_volume(&cells, &state.position) / rest,
                        1e3 * largest(&model, &state)
                    );
                    return Err(error.to_string());
                }
            }
        }
        println!(
            "  static: {:.1} s, {parts} load steps, {iterations} iterations at their ends; largest displacement {:.3} mm, volume × {:.4}",
            start.elapsed().as_secs_f64(),
            1e3 * largest(&model, &state),
            model.enclosed_volume(&cells, &state.position) / rest
        );
        Ok((model, state))
    }

    /// One second of motion in steps of 10 ms, the pressure full after 0.5 s, mass-damped.
    fn motion(&self, mesh: &Mesh) -> (Assembly, AssemblyState) {
        let mut model = self.model(mesh);
        model.model_mut().loads[0].curve = Curve { shape: Shape::SmoothStep, from: 0.0, to: 0.5 };
        model.model_mut().bodies[0].damping = 20.0;
        let linear = LinearSolver::ConjugateGradients {
            tolerance: 1e-6,
            iterations: 5000,
            preconditioner: Preconditioner::LaggedFactors { renew_after: 12 },
        };
        let mut solver =
            BackwardEuler::new(model.clone(), DynamicSettings { linear, ..DynamicSettings::new(0.01) })
                .unwrap();
        let mut state = AssemblyState::at_rest(&model);
        let start = Instant::now();
        let (mut newton, mut parts, mut residual) = (0, 0, 0.0_f64);
        for _ in 0..100 {
            let step = solver.advance(&mut state).unwrap();
            newton += step.residuals.len() - 1;
            parts += step.parts;
            residual = residual.max(*step.residuals.last().unwrap());
        }
        let phases = solver.phases();
        println!(
            "  dynamic: {:.0} ms a step, {parts} steps, {:.1} iterations of Newton's method and {:.1} of conjugate gradients each, residual {residual:.1e}",
            10.0 * start.elapsed().as_secs_f64(),
            newton as f64 / 100.0,
            phases.iterations as f64 / newton as f64
        );
        (model, state)
    }
}

fn largest(model: &Assembly, state: &AssemblyState) -> f64 {
    (0..model.rest.len()).map(|n| state.displacement(model, n).norm()).fold(0.0, f64::max)
}

/// The largest difference of displacements over the largest displacement; `map` leads from a node of the
/// first to the same node of the second.
fn apart(
    one: &(Assembly, AssemblyState),
    other: &(Assembly, AssemblyState),
    map: impl Fn(usize) -> usize,
) -> f64 {
    let differences = (0..one.0.rest.len())
        .map(|n| (one.1.displacement(&one.0, n) - other.1.displacement(&other.0, map(n))).norm());
    differences.fold(0.0, f64::max) / largest(&one.0, &one.1)
}

fn study(organ: &Organ, mesh: &Mesh) {
    let still = organ.equilibrium(mesh).unwrap();
    let (other, order) = renumbered(mesh, 1);
    let again = organ.equilibrium(&other).unwrap();
    claim("renumbered", apart(&still, &again, |n| order[n] as usize), 1e-6);
    let moved = organ.motion(mesh);
    println!("  motion after 1 s off equilibrium: {:.2e}", apart(&still, &moved, |n| n));
    match organ.equilibrium(&refined(mesh)) {
        Ok(fine) => {
            println!("  each shell cut in four: displacements move by {:.2e}", apart(&still, &fine, |n| n))
        }
        Err(error) => println!("  each shell cut in four: {error}"),
    }
}

/// 14,186 triangles in mm; 10 kPa, E = 1 MPa, t = 0.3 mm.
#[test]
#[ignore = "minutes"]
fn aneurysm_under_pressure() {
    let Some(data) = data() else { return };
    let mesh = surface(data.join("aneurysm-sofa/aneurysm3D_1.off"), 1e-3);
    study(&Organ { young: 1e6, thickness: 0.3e-3, pressure: 10e3, membrane: FLAT.membrane }, &mesh);
}

/// 13,770 triangles in mm; 3 kPa, E = 0.5 MPa, t = 3 mm.
#[test]
#[ignore = "minutes"]
fn rectum_under_pressure() {
    let Some(data) = data() else { return };
    let mesh = surface(data.join("organs-openhelp/Rectum_Lumen.stl"), 1e-3);
    let organ = Organ { young: 0.5e6, thickness: 3e-3, pressure: 3e3, membrane: FLAT.membrane };
    // Without repair, a pair of slivers of 0.2 mm folds over at 0.8 of the load; half of the load is borne.
    let failure = organ.equilibrium(&mesh).unwrap_err();
    assert!(failure.contains("folded over") || failure.contains("folds over"), "{failure}");
    study(&Organ { pressure: 1.5e3, ..organ }, &mesh);
    let mut better = mesh;
    println!("{} edges of slivers flipped", flip_slivers(&mut better));
    if let Ok(still) = organ.equilibrium(&better) {
        let (other, order) = renumbered(&better, 1);
        let again = organ.equilibrium(&other).unwrap();
        claim("renumbered", apart(&still, &again, |n| order[n] as usize), 1e-6);
        let moved = organ.motion(&better);
        println!("  motion after 1 s off equilibrium: {:.2e}", apart(&still, &moved, |n| n));
    }
}

/// Numbers of a table of two columns after its first line.
fn table(path: PathBuf) -> Vec<(f64, f64)> {
    let text = std::fs::read_to_string(path).unwrap();
    let row = |line: &str| {
        let numbers: Vec<f64> = line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        (numbers[0], numbers[1])
    };
    text.lines().skip(1).filter(|line| !line.trim().is_empty()).map(row).collect()
}

/// Longer than any edge of the leaflets [m].
const EDGE: f64 = 4e-3;

/// The distance [m] of a node from the nearest facet of another leaflet, if it is below a limit.
fn gap(model: &Assembly, state: &AssemblyState, leaflet: &[usize], node: usize, limit: f64) -> f64 {
    let mut least = limit;
    let q = state.position[node];
    for facet in model.facets.iter().filter(|facet| leaflet[facet.nodes[0] as usize] != leaflet[node]) {
        let [a, b, c] = facet.nodes.map(|n| state.position[n as usize]);
        let (ab, ac, aq) = (b - a, c - a, q - a);
        if aq.norm_squared() > (least + EDGE).powi(2) {
            continue;
        }
        let normal = ab.cross(&ac);
        let [u, v] = [aq.cross(&ac), ab.cross(&aq)].map(|w| w.dot(&normal) / normal.norm_squared());
        let distance = if u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
            aq.dot(&normal).abs() / normal.norm()
        } else {
            let side = |p: Vector3, e: Vector3| {
                let t = ((q - p).dot(&e) / e.norm_squared()).clamp(0.0, 1.0);
                (q - p - t * e).norm()
            };
            side(a, ab).min(side(a, ac)).min(side(b, c - b))
        };
        least = least.min(distance);
    }
    least
}

/// Leaflets of a patient's valve, each fixed along the wall, under the pressure of their deck. E = 1 MPa, ν =
/// 0.45, t = 0.4 mm, 1000 kg/m³ and a damping of 2/s are from the deck. The deck is in mm, g and s, so
/// pressures are in Pa.
struct Valve {
    model: Assembly,
    cells: Vec<[u32; 3]>,
    /// Leaflet of each node.
    leaflet: Vec<usize>,
    /// Nodes fixed to the wall, and nodes of free edges.
    held: Vec<u32>,
    free: Vec<u32>,
    notes: String,
}

/// The valve as meshed, or with each shell cut in four.
fn valve(folder: &Path, fine: bool) -> Valve {
    let curve = table(folder.join("pbc.dat"));
    let (mut points, mut cells, mut leaflet) = (Vec::new(), Vec::new(), Vec::new());
    let (mut held, mut free) = (Vec::new(), Vec::new());
    for (number, name) in ["LCC", "NCC", "RCC"].into_iter().enumerate() {
        let coarse = surface(folder.join(format!("PAT003_07_{name}.vtu")), 10e-3);
        let mesh = if fine { refined(&coarse) } else { coarse };
        let first = points.len() as u32;
        for (edge, nodes) in [("edge1", &mut held), ("edge2", &mut free)] {
            let line = surface(folder.join(format!("PAT003_07_{name}_{edge}.vtp")), 10e-3).points;
            // Nodes of the edge, and the middles between two neighbours.
            let on_edge = |p: &Vector3| {
                let near = |w: &Vector3| (w - p).norm() < 1e-6;
                line.iter().any(near)
                    || fine && line.windows(2).any(|pair| (0.5 * (pair[0] + pair[1]) - p).norm() < 1e-6)
            };
            nodes.extend((first..).zip(&mesh.points).filter(|(_, p)| on_edge(p)).map(|(n, _)| n));
        }
        cells.extend(triangles(&mesh).into_iter().map(|t| t.map(|n| n + first)));
        leaflet.extend(mesh.points.iter().map(|_| number));
        points.extend(mesh.points);
    }
    let mut model = Assembly::new("shell", points);
    let longest =
        cells.iter().flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]).fold(0.0, |longest: f64, [a, b]| {
            longest.max((model.place(*a as usize) - model.place(*b as usize)).norm())
        });
    assert!(1.5 * longest < EDGE, "{longest}");
    let material = Wall { elastic: Elasticity { young: 1e6, poisson: 0.45 }, density: 1000.0 };
    let shell = Shell { formulation: FLAT, ..Shell::new("valve", cells.clone(), LEAFLET, material) };
    let notes = format!("{:?}", model.add_shell(&shell).unwrap());
    model.model_mut().constraints.push(Constraint {
        name: "wall".into(),
        nodes: held.clone(),
        components: [true; 6],
        motion: Motion::Fixed,
    });
    let facets = (0..model.facets.len() as u32).collect();
    let kind = LoadKind::ShellPressure { facets, pressure: 1.0, spread: Spread::Lumped };
    let course = Curve { shape: Shape::Table(curve), from: 0.0, to: 1.0 };
    model.model_mut().loads.push(Load::new("valve", kind, course));
    model.model_mut().bodies[0].damping = 2.0;
    Valve { model, cells, leaflet, held, free, notes }
}

/// Thickness of a leaflet [m].
const LEAFLET: f64 = 0.4e-3;

/// Moves the leaflets until two leaflets are a thickness apart.
#[test]
#[ignore = "minutes"]
fn valve_leaflets_close() {
    let Some(data) = data() else { return };
    let folder = data.join("shells-svfsi/valve");
    let run = |fine: bool, step: f64| -> (f64, f64, f64) {
        let Valve { model, leaflet, held, notes, .. } = valve(&folder, fine);
        let count = held.len();
        let mut solver = BackwardEuler::new(model.clone(), DynamicSettings::new(step)).unwrap();
        let mut state = AssemblyState::at_rest(&model);
        let start = Instant::now();
        // Leaflets that hang side by side on the wall are close from the start.
        let apart = |n: &usize| gap(&model, &state, &leaflet, *n, 2e-3) >= 2e-3;
        let free: Vec<usize> = (0..leaflet.len()).filter(apart).collect();
        let (mut parts, mut residual) = (0, 0.0_f64);
        let mut now = 2e-3;
        while state.time < 0.755 && now > LEAFLET {
            let made = match solver.advance(&mut state) {
                Ok(made) => made,
                Err(error) => {
                    println!("  fails at {:.4} s: {error}", state.time);
                    break;
                }
            };
            parts += made.parts;
            residual = residual.max(*made.residuals.last().unwrap());
            now = free.iter().map(|&n| gap(&model, &state, &leaflet, n, 2e-3)).fold(2e-3, f64::min);
        }
        println!(
            "valve: {} shells, {count} nodes held, {notes}; leaflets {:.2} mm apart at {:.4} s, {parts} steps, {:.1} s, residual {residual:.1e}, largest displacement {:.2} mm",
            model.facets.len(),
            1e3 * now,
            state.time,
            start.elapsed().as_secs_f64(),
            1e3 * largest(&model, &state)
        );
        (now, state.time, largest(&model, &state))
    };
    let coarse = run(false, 2e-3);
    let halved = run(false, 1e-3);
    let fine = run(true, 2e-3);
    println!(
        "first touch at {:.4} s; {:.4} s with half the step, {:.4} s with each shell cut in four",
        coarse.1, halved.1, fine.1
    );
}

/// The part of a grid of lines along the axis of the valve that no leaflet blocks. The grid lies within four
/// fifths of the radius of the wall. A leaflet has the thickness `apart` [m], the distance that two leaflets
/// keep.
fn leak(valve: &Valve, state: &AssemblyState, apart: f64) -> f64 {
    let wall: Vec<Vector3> = valve.held.iter().map(|&n| state.position[n as usize]).collect();
    let centre = wall.iter().sum::<Vector3>() / wall.len() as f64;
    let spread: nalgebra::Matrix3<f64> = wall.iter().map(|p| (p - centre) * (p - centre).transpose()).sum();
    let axes = spread.symmetric_eigen();
    let across = [1, 2].map(|k| {
        let other = axes.eigenvectors.column((axes.eigenvalues.imin() + k) % 3).into_owned();
        other.normalize()
    });
    let flat = |p: &Vector3| across.map(|axis| axis.dot(&(p - centre)));
    let radius = 0.8
        * wall
            .iter()
            .map(|p| {
                let [x, y] = flat(p);
                x.hypot(y)
            })
            .fold(f64::INFINITY, f64::min);
    let corners: Vec<[[f64; 2]; 3]> =
        valve.cells.iter().map(|cell| cell.map(|n| flat(&state.position[n as usize]))).collect();
    let (mut samples, mut open) = (0, 0);
    for i in -60..=60 {
        for j in -60..=60 {
            let p = [f64::from(i), f64::from(j)].map(|k| radius * k / 60.0);
            if p[0].hypot(p[1]) > radius {
                continue;
            }
            samples += 1;
            let covers = |[a, b, c]: &[[f64; 2]; 3]| {
                let side = |u: &[f64; 2], v: &[f64; 2]| {
                    (v[0] - u[0]) * (p[1] - u[1]) - (v[1] - u[1]) * (p[0] - u[0])
                };
                let sides = [side(a, b), side(b, c), side(c, a)];
                let within = sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0);
                let beside = |u: &[f64; 2], v: &[f64; 2]| {
                    let [e, q] = [[v[0] - u[0], v[1] - u[1]], [p[0] - u[0], p[1] - u[1]]];
                    let part = ((q[0] * e[0] + q[1] * e[1]) / (e[0] * e[0] + e[1] * e[1])).clamp(0.0, 1.0);
                    (q[0] - part * e[0]).hypot(q[1] - part * e[1]) < 0.5 * apart
                };
                within || beside(a, b) || beside(b, c) || beside(c, a)
            };
            open += u32::from(!corners.iter().any(covers));
        }
    }
    f64::from(open) / f64::from(samples)
}

/// Time [s] after the peak of the deck's pressure, 13.03 kPa at 0.305 s.
const PEAK: f64 = 0.32;

/// In contact the leaflets close: they lie on each other along their free edges, let nothing through, and
/// hold the 13 kPa of the deck. No edge goes through a triangle in any step.
#[test]
#[ignore = "minutes"]
fn valve_leaflets_coapt_and_hold_their_pressure() {
    let Some(data) = data() else { return };
    let mut valve = valve(&data.join("shells-svfsi/valve"), false);
    let barrier = 0.1e-3;
    let nodes = (0..valve.leaflet.len() as u32).collect();
    let contact = Contact {
        name: "leaflets".into(),
        surface: Surface { nodes, faces: valve.cells.clone() },
        with: With::Itself,
        touch: Touch { friction: 0.0, offset: LEAFLET },
    };
    let settings = BarrierSettings { distance: barrier, stiffness: 1e5, creep_speed: 1e-3 };
    valve.model.contact = Some(ContactModel {
        contacts: Arc::new(Contacts { rigids: Vec::new(), contacts: vec![contact], ..Default::default() }),
        settings: vec![settings],
        levels: Vec::new(),
        check_intersections: true,
    });
    let settings = DynamicSettings { iterations: 200, ..DynamicSettings::new(2e-3) };
    let mut solver = BackwardEuler::new(valve.model.clone(), settings).unwrap();
    let mut state = AssemblyState::at_rest(&valve.model);
    let start = Instant::now();
    let (mut iterations, mut next_report) = (0, 0.0);
    let opened = leak(&valve, &state, LEAFLET + barrier);
    while state.time < PEAK {
        let made = solver.advance(&mut state).unwrap_or_else(|error| panic!("{:.4} s: {error}", state.time));
        iterations += made.residuals.len();
        if state.time >= next_report {
            next_report += 0.05;
            let now = solver.contact().unwrap().now();
            println!(
                "{:.3} s: {} nodes touch, least gap {:.1e} m, open {:.3}, {iterations} iterations, {:.0} s",
                state.time,
                now.nodes.len(),
                now.gap.unwrap_or(f64::NAN),
                leak(&valve, &state, LEAFLET + barrier),
                start.elapsed().as_secs_f64()
            );
        }
    }
    let now = solver.contact().unwrap().now();
    let touching: Vec<u32> = now.nodes.iter().map(|touch| touch.node).collect();
    let loose = |n: &&u32| valve.held.binary_search(n).is_err();
    let free: Vec<u32> = valve.free.iter().filter(loose).copied().collect();
    let lie = free.iter().filter(|n| touching.binary_search(n).is_ok()).count() as f64 / free.len() as f64;
    let open = leak(&valve, &state, LEAFLET + barrier);
    println!("open {opened:.3} at the start, {open:.4} in the end; {:.2} of the free edges touch", lie);
    assert!(opened > 0.05 && open == 0.0, "{opened} {open}");
    assert!(lie > 0.8, "{lie}");
}
