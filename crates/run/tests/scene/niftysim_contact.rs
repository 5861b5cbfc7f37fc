//! NiftySim models with contact and membranes: each is imported and run; nothing penetrates, forces balance,
//! and closed forms are met.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use nalgebra::Vector3;
use pliant_format::Scene;
use pliant_format::source::Source;
use pliant_geometry::{Locator, Mesh, SurfaceLocator, boundary, io};
use pliant_niftysim::{Imported, import};
use pliant_scene::World;
use pliant_sim::contact::touch::With;

const MU: f64 = 1000.0;
const KAPPA: f64 = 5000.0;

/// Allowed depth of a node of a body in another one [m]. Contact uses the normals before a step. A node that
/// slides across an edge during the step, or turns, ends inside by the square of its way.
const ACROSS_EDGES: f64 = 1e-6;

/// A grid of hexahedra or tetrahedra as NiftySim lists it.
struct Grid {
    nodes: Vec<[f64; 3]>,
    cells: Vec<Vec<usize>>,
}

impl Grid {
    /// Hexahedra of a box; `kept` selects them.
    fn hexes(counts: [usize; 3], size: [f64; 3], at: [f64; 3], kept: impl Fn([usize; 3]) -> bool) -> Self {
        let [nx, ny, nz] = counts;
        let node = |i: usize, j: usize, k: usize| (k * (ny + 1) + j) * (nx + 1) + i;
        let mut nodes = Vec::new();
        let mut cells = Vec::new();
        for k in 0..=nz {
            for j in 0..=ny {
                for i in 0..=nx {
                    let part = [(i, nx), (j, ny), (k, nz)].map(|(i, n)| i as f64 / n as f64);
                    nodes.push([0, 1, 2].map(|c| at[c] + size[c] * part[c]));
                    if i < nx && j < ny && k < nz && kept([i, j, k]) {
                        let ring =
                            |k| [node(i, j, k), node(i + 1, j, k), node(i + 1, j + 1, k), node(i, j + 1, k)];
                        cells.push([ring(k), ring(k + 1)].concat());
                    }
                }
            }
        }
        Self { nodes, cells }
    }

    fn block(cells: usize, edge: f64, at: [f64; 3]) -> Self {
        Self::hexes([cells; 3], [edge; 3], at, |_| true)
    }

    /// Each hexahedron as six tetrahedra around its diagonal.
    fn tets(self) -> Self {
        let six = [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]];
        let cells = self.cells.iter().flat_map(|hex| six.map(|tet| tet.map(|a| hex[a]).to_vec()));
        Self { cells: cells.collect(), nodes: self.nodes }
    }

    fn xml(&self) -> String {
        let nodes: Vec<String> = self.nodes.iter().map(|x| format!("{} {} {}", x[0], x[1], x[2])).collect();
        let kind = if self.cells[0].len() == 8 { "H8" } else { "T4" };
        let cells = list(&self.cells.concat());
        format!(
            "<Nodes DOF=\"3\" NumNodes=\"{}\">{}</Nodes>\n<Elements NumEls=\"{}\" Type=\"{kind}\">{cells}</Elements>\n",
            nodes.len(),
            nodes.join("\n"),
            self.cells.len()
        )
    }

    /// The nodes at a place along an axis.
    fn at(&self, axis: usize, place: f64) -> Vec<usize> {
        (0..self.nodes.len()).filter(|&node| (self.nodes[node][axis] - place).abs() < 1e-9).collect()
    }
}

fn list(numbers: &[usize]) -> String {
    numbers.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ")
}

fn fix(axis: &str, nodes: &[usize]) -> String {
    format!(
        "<Constraint Type=\"Fix\" DOF=\"{axis}\" NumNodes=\"{}\"><Nodes>{}</Nodes></Constraint>\n",
        nodes.len(),
        list(nodes)
    )
}

fn pulled(kind: &str, axis: usize, nodes: &[usize], magnitude: f64, shape: &str) -> String {
    format!(
        "<Constraint Type=\"{kind}\" DOF=\"{axis}\" NumNodes=\"{}\" LoadShape=\"{shape}\"><Nodes>{}</Nodes>\
         <Magnitudes Type=\"UNIFORM\">{magnitude}</Magnitudes></Constraint>\n",
        nodes.len(),
        list(nodes)
    )
}

fn slaves(tag: &str, nodes: &[usize]) -> String {
    format!("<{tag} NumNodes=\"{}\">{}</{tag}>", nodes.len(), list(nodes))
}

fn set() -> String {
    format!(
        "<ElementSet Size=\"all\"><Material Type=\"NH\"><ElasticParams NumParams=\"2\">{MU} {KAPPA}</ElasticParams>\
         </Material>0</ElementSet>\n"
    )
}

fn system(step: f64, total: f64, damping: f64, more: &str) -> String {
    format!(
        "<SystemParams><TimeStep>{step}</TimeStep><TotalTime>{total}</TotalTime><DampingCoeff>{damping}</DampingCoeff>\
         <Density>1000</Density><HGKappa>0.075</HGKappa>{more}</SystemParams>\n"
    )
}

/// Imports a model and writes what it becomes into a folder.
fn imported(model: &str, folder: &Path) -> Imported {
    let path = folder.join("model.xml");
    fs::write(&path, model).unwrap();
    let imported = import(&path).unwrap_or_else(|error| panic!("{error}"));
    for (file, mesh) in &imported.meshes {
        io::write(&folder.join(file), mesh).unwrap();
    }
    for (file, text) in &imported.tables {
        fs::write(folder.join(file), text).unwrap();
    }
    imported
}

/// The world of a model, in double precision.
fn world(model: &str, folder: &Path) -> World {
    let imported = imported(model, folder);
    assert!(imported.missing.is_empty(), "{:?}", imported.missing);
    let scene = imported.scene.replace("precision = \"single\"", "precision = \"double\"");
    let source = Source::parse("scene.toml", scene.as_str()).unwrap();
    let scene = Scene::from_source(source, folder.to_owned())
        .unwrap_or_else(|error| panic!("{}\n{scene}", error.plain()));
    World::new(&scene).unwrap_or_else(|error| panic!("{}\n{}", error.plain(), imported.scene))
}

/// The result of a run.
#[derive(Debug, Default)]
struct Trajectory {
    /// The deepest that a node lay in a rigid thing [m], after any step.
    in_things: f64,
    /// The deepest that a node of a body lay in another body [m], after any step looked at.
    in_bodies: f64,
    /// Forces of contacts and reactions [N] before the last step.
    forces: BTreeMap<String, Vector3<f64>>,
    /// The largest force of each contact [N].
    largest: BTreeMap<String, f64>,
    /// Largest momentum over the sum of the momenta of all nodes.
    momentum: f64,
    displacements: BTreeMap<String, Vec<[f64; 3]>>,
}

/// Plays a model to its end.
fn played(model: &str) -> Trajectory {
    let folder = tempfile::tempdir().unwrap();
    let world = world(model, folder.path());
    let until = world.scene.scene.until;
    let part = &world.participants[0].built;
    let names: Vec<String> = part.bodies.iter().map(|body| body.name.clone()).collect();
    let meshes: Vec<Mesh> = part.bodies.iter().map(|body| body.mesh.clone()).collect();
    let firsts: Vec<u32> = part.model.bodies.iter().map(|body| body.nodes.start).collect();
    let rest: Vec<Vector3<f64>> = part.model.rest.iter().map(|&x| x.into()).collect();
    let mass = part.model.mass.clone();
    let contacts = part.contacts.clone().unwrap_or_default();
    let constraints: Vec<String> =
        part.model.constraints.iter().map(|constraint| constraint.name.clone()).collect();
    let mut simulation = world.simulation().unwrap();
    let mut trajectory = Trajectory::default();
    let mut looks = 0;
    let run = simulation.run(until, |frame| {
        let time = frame.time();
        let last = time > until - 1e-9;
        let mut places = rest.clone();
        let mut sum = Vector3::zeros();
        let mut whole = 0.0;
        for (name, first) in names.iter().zip(&firsts) {
            let moved = frame.displacements(name).unwrap();
            let speeds = frame.velocities(name).unwrap();
            for (node, (u, v)) in moved.iter().zip(&speeds).enumerate() {
                let node = *first as usize + node;
                places[node] = rest[node] + Vector3::from(*u);
                sum += Vector3::from(*v) * mass[node];
                whole += Vector3::from(*v).norm() * mass[node];
            }
            if last {
                trajectory.displacements.insert(name.clone(), moved);
            }
        }
        if whole > 0.0 {
            trajectory.momentum = trajectory.momentum.max(sum.norm() / whole);
        }
        for contact in &contacts.contacts {
            if let With::Rigid(rigid) = contact.with {
                let rigid = &contacts.rigids[rigid];
                let stance = rigid.stance(time, None);
                for &node in &contact.surface.nodes {
                    let depth = contact.touch.offset - rigid.near(&stance, &places[node as usize]).distance;
                    trajectory.in_things = trajectory.in_things.max(depth);
                }
            }
            let force = Vector3::from(frame.contact_force(&contact.name).unwrap());
            let most = trajectory.largest.entry(contact.name.clone()).or_default();
            *most = most.max(force.norm());
            if !last {
                trajectory.forces.insert(contact.name.clone(), force);
            }
        }
        for name in constraints.iter().filter(|_| !last) {
            trajectory.forces.insert(name.clone(), frame.reaction(name).unwrap().into());
        }
        looks += 1;
        if looks % 50 == 0 || last {
            trajectory.in_bodies = trajectory.in_bodies.max(deepest(&meshes, &firsts, &places));
        }
    });
    run.unwrap_or_else(|failure| panic!("{}", failure.message));
    trajectory
}

/// Returns the largest depth of a node of a body in another body [m].
fn deepest(meshes: &[Mesh], firsts: &[u32], places: &[Vector3<f64>]) -> f64 {
    let moved = |mesh: &Mesh, first: u32| {
        let placed = &places[first as usize..first as usize + mesh.points.len()];
        Mesh { points: placed.to_vec(), ..mesh.clone() }
    };
    let solids: Vec<Mesh> = meshes
        .iter()
        .zip(firsts)
        .filter(|(mesh, _)| mesh.volume_blocks().any(|block| !block.is_empty()))
        .map(|(mesh, &first)| moved(mesh, first))
        .collect();
    let mut depth = 0.0_f64;
    for (at, mesh) in solids.iter().enumerate() {
        let surface = boundary(mesh);
        let faces: Vec<u32> = (0..surface.faces.len() as u32).collect();
        let (cells, faces) = (Locator::new(mesh), SurfaceLocator::new(&surface, &faces, &mesh.points));
        for (_, other) in solids.iter().enumerate().filter(|(other, _)| *other != at) {
            for place in &other.points {
                if cells.locate(*place).is_some_and(|found| found.distance == 0.0) {
                    let on = faces.closest(place).unwrap();
                    depth = depth.max((on.position - place).norm());
                }
            }
        }
    }
    depth
}

/// The largest difference of two fields over the largest displacement.
fn off(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let largest = b.iter().map(|&u| Vector3::from(u).norm()).fold(0.0, f64::max);
    let apart = a.iter().zip(b).map(|(&a, &b)| (Vector3::from(a) - Vector3::from(b)).norm());
    apart.fold(0.0, f64::max) / largest
}

/// Force [N] by which a block of this law and area [m²] withstands a stretch, free to slide at its ends and
/// sides.
fn uniaxial(stretch: f64, area: f64) -> f64 {
    // J − 1 from the stress across, which vanishes: μ J^(−5/3) (t² − I₁/3) + κ (J − 1) = 0 with t² = J /
    // stretch.
    let across = |j: f64| {
        let t2 = j / stretch;
        MU * j.powf(-5.0 / 3.0) * (t2 - stretch * stretch) / 3.0 + KAPPA * (j - 1.0)
    };
    let (mut low, mut high) = (0.5, 1.5);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if across(middle) > 0.0 { high = middle } else { low = middle }
    }
    let j = low;
    let t2 = j / stretch;
    let cauchy = MU * j.powf(-5.0 / 3.0) * 2.0 * (stretch * stretch - t2) / 3.0 + KAPPA * (j - 1.0);
    cauchy * t2 * area
}

/// A cube of 0.1 m on the floor, with two planes of symmetry.
fn on_floor(grid: &Grid) -> String {
    format!(
        "{}{}{}{}{}",
        grid.xml(),
        set(),
        fix("2", &grid.at(2, 0.0)),
        fix("0", &grid.at(0, 0.0)),
        fix("1", &grid.at(1, 0.0))
    )
}

/// A plate that faces down, over the cube.
fn plate(by: f64, nodes: &[usize]) -> String {
    format!(
        "<ContactPlate><a>-0.05 -0.05 0.1</a><b>-0.05 0.25 0.1</b><c>0.25 -0.05 0.1</c><Disp>0 0 {by}</Disp>{}</ContactPlate>\n",
        slaves("SlvNodes", nodes)
    )
}

/// A plate that slides freely on a cube displaces its top as a constraint does. Its force equals the closed
/// form and the force of the floor.
#[test]
fn a_plate_presses_a_cube_as_a_prescribed_displacement_does() {
    for tets in [false, true] {
        let grid = Grid::block(4, 0.1, [0.0; 3]);
        let grid = if tets { grid.tets() } else { grid };
        let top = grid.at(2, 0.1);
        let end = system(1e-3, 1.0, 60.0, "");
        let model = |more: String| format!("<Model>\n{}{more}{end}</Model>", on_floor(&grid));
        let pressed = played(&model(plate(-0.02, &top)));
        let moved = played(&model(pulled("Disp", 2, &top, -0.02, "POLY345")));
        let off = off(&pressed.displacements["model"], &moved.displacements["model"]);
        let on_plate = pressed.forces["plate-0"].z;
        let floor: f64 = pressed.forces["fix-0"].z;
        let exact = -uniaxial(0.8, 0.01);
        println!(
            "tets {tets}: nodes off by {off:.1e}, {:.1e} m in the plate, {on_plate} N on it, {floor} N from the floor, exact {exact} N",
            pressed.in_things
        );
        assert!(off < 1e-3, "{off:e}");
        assert!(pressed.in_things < 1e-12, "{:e}", pressed.in_things);
        assert!((on_plate / exact - 1.0).abs() < 1e-3, "{on_plate} N of {exact} N");
        assert!((on_plate / floor - 1.0).abs() < 1e-3, "{on_plate} N and {floor} N");
    }
}

/// A cylinder and a probe are pressed into a block on its side, or grow into it. No node goes in, and the
/// base carries their force.
#[test]
fn round_things_are_pressed_into_a_block() {
    let grid = Grid::hexes([8, 4, 4], [0.08, 0.04, 0.04], [0.0; 3], |_| true);
    let (top, base) = (grid.at(2, 0.04), grid.at(2, 0.0));
    let cylinder = ("ContactCylinder", "0 1 0", "0.04 -0.02 0.0505");
    let probe = ("ContactUSProbe", "0 0 -1", "0.04 0.02 0.0905");
    for ((tag, axis, origin), moved, grown) in
        [(cylinder, 0.0055, 0.0), (probe, 0.0055, 0.0), (cylinder, 0.003, 0.0025), (probe, 0.003, 0.0025)]
    {
        let length = if tag == "ContactCylinder" { 0.08 } else { 0.04 };
        let model = format!(
            "<Model>\n{}{}{}<{tag}><Origin>{origin}</Origin><Axis>{axis}</Axis><Radius>0.01</Radius>\
             <Length>{length}</Length><OrigDisp>0 0 -{moved}</OrigDisp><RadChange>{grown}</RadChange>{}</{tag}>{}</Model>",
            grid.xml(),
            set(),
            fix("all", &base),
            slaves("SlvNodes", &top),
            system(5e-4, 1.0, 60.0, "")
        );
        let trajectory = played(&model);
        let name = if tag == "ContactCylinder" { "cylinder-0" } else { "probe-0" };
        let (up, down) = (trajectory.forces[name], trajectory.forces["fix-0"]);
        println!(
            "{tag}, {grown} m: {:.1e} m in it, {up:?} N on it, {down:?} N from the base",
            trajectory.in_things
        );
        assert!(trajectory.in_things < 1e-12, "{:e}", trajectory.in_things);
        assert!(up.z > 0.01 && (up.z / down.z - 1.0).abs() < 1e-3, "{up:?} and {down:?}");
    }
}

/// A sheet of two triangles goes up under a cube that hangs from its top, in proportion to time.
#[test]
fn a_moving_rigid_sheet_presses_a_cube() {
    let grid = Grid::block(3, 0.1, [0.0; 3]);
    let (top, bottom) = (grid.at(2, 0.1), grid.at(2, 0.0));
    let surface = |slaves: &str, motion: &str| {
        format!(
            "<ContactSurface><Nodes DOF=\"3\" NumNodes=\"4\">-0.05 -0.05 0  0.15 -0.05 0  0.15 0.15 0  -0.05 0.15 0</Nodes>\
             <Elements NumEls=\"2\" Type=\"T3\">0 1 2  0 2 3</Elements><FrictionCoefficient>0</FrictionCoefficient>\
             {slaves}{motion}</ContactSurface>"
        )
    };
    let model = |slaves: &str, motion: &str| {
        format!(
            "<Model>\n{}{}{}{}{}{}{}</Model>",
            grid.xml(),
            set(),
            fix("2", &top),
            fix("0", &grid.at(0, 0.0)),
            fix("1", &grid.at(1, 0.0)),
            surface(slaves, motion),
            system(1e-3, 4.0, 60.0, "")
        )
    };
    let trajectory =
        played(&model(&slaves("SlaveNodes", &bottom), "<Motion Type=\"Translation\">0 0 0.02</Motion>"));
    let (sheet, ceiling) = (trajectory.forces["surface-0"].z, trajectory.forces["fix-0"].z);
    let exact = uniaxial(0.8, 0.01);
    println!(
        "{:.1e} m in the sheet, {sheet} N on it, {ceiling} N from above, exact {exact} N",
        trajectory.in_things
    );
    assert!(trajectory.in_things < 1e-8, "{:e}", trajectory.in_things);
    // The body still moves at the end, at 5 mm/s. Damping of 60/s takes its part of the force, for a mass of
    // 1 kg at half of this speed.
    let damped = 0.5 * 60.0 * 0.005;
    assert!((sheet / (exact - damped) - 1.0).abs() < 5e-3, "{sheet} N of {exact} N");
    assert!((ceiling - sheet - damped).abs() < 1e-3 * sheet.abs(), "{sheet} N and {ceiling} N");
    // Without a list all nodes touch; turned about two axes it follows a table of poses.
    let folder = tempfile::tempdir().unwrap();
    let turned =
        imported(&model("", "<Motion Type=\"Rotation\">0.1 0 -0.3  0.05 0.05 -0.05</Motion>"), folder.path());
    assert_eq!(turned.tables.len(), 1);
    let last: Vec<f64> =
        turned.tables[0].1.lines().nth(1001).unwrap().split(',').map(|x| x.parse().unwrap()).collect();
    assert!((last[0] - 4.001).abs() < 1e-9, "{last:?}");
    let once =
        imported(&model("", "<Motion Type=\"Rotation\">0 0 -0.3  0.05 0.05 -0.05</Motion>"), folder.path());
    assert!(
        once.scene
            .contains("rotate = { axis = [0.0, 0.0, 1.0], centre = [0.05, 0.05, -0.05], angle = -0.3 }")
    );
}

/// A cube lies on a larger one of other cells; both are pressed. The force goes through, and neither is in
/// the other.
#[test]
fn two_cubes_touch() {
    let lower = Grid::block(3, 0.1, [0.0; 3]).tets();
    let upper = Grid::block(2, 0.06, [0.02, 0.02, 0.1]).tets();
    let part = |grid: &Grid, constraints: String| {
        format!("<SubModel>{}{}{constraints}</SubModel>\n", grid.xml(), set())
    };
    let model = |more: &str| {
        format!(
            "<Model>\n{}{}{}</Model>",
            part(&lower, fix("all", &lower.at(2, 0.0))),
            part(
                &upper,
                fix("0", &upper.at(2, 0.16))
                    + &fix("1", &upper.at(2, 0.16))
                    + &pulled("Disp", 2, &upper.at(2, 0.16), -0.015, "POLY345")
            ),
            system(5e-4, 2.0, 40.0, more)
        )
    };
    let trajectory = played(&model(
        "<DoDeformableCollision>1</DoDeformableCollision><DeformableFrictionCoefficient>0.3</DeformableFrictionCoefficient>",
    ));
    let (between, base, top) =
        (trajectory.forces["part-0-part-1"].z, trajectory.forces["fix-0"].z, trajectory.forces["move-0"].z);
    println!(
        "{:.1e} m in each other, {between} N between, {base} N from below, {top} N from above",
        trajectory.in_bodies
    );
    assert!(trajectory.in_bodies < ACROSS_EDGES, "{:e}", trajectory.in_bodies);
    assert!(between > 1.0 && (base / between - 1.0).abs() < 2e-3, "{between} N, {base} N");
    assert!((top / between + 1.0).abs() < 2e-3, "{between} N, {top} N");
}

/// Two cubes of one mesh: the upper one falls on the lower one, in a box that is turned inward. The floor
/// carries both, the box nothing.
#[test]
fn pieces_of_one_mesh_touch() {
    let lower = Grid::block(3, 0.1, [0.0; 3]).tets();
    let upper = Grid::block(2, 0.08, [0.01, 0.01, 0.101]).tets();
    let base = lower.at(2, 0.0);
    let first = lower.nodes.len();
    let shifted = upper.cells.iter().map(|cell| cell.iter().map(|node| node + first).collect());
    let cells = lower.cells.iter().cloned().chain(shifted).collect();
    let both = Grid { nodes: [&lower.nodes[..], &upper.nodes].concat(), cells };
    let corner = |k: usize| [0, 1, 2].map(|c| if k >> c & 1 == 1 { 0.3 } else { -0.1 });
    let corners: Vec<String> = (0..8).map(corner).map(|[x, y, z]: [f64; 3]| format!("{x} {y} {z}")).collect();
    // The sides face inward: seen from within, each goes round as it does from without in a box that keeps
    // bodies outside.
    let sides = "0 1 3  0 3 2  4 6 7  4 7 5  0 4 5  0 5 1  2 3 7  2 7 6  0 2 6  0 6 4  1 5 7  1 7 3";
    let model = format!(
        "<Model>\n{}{}{}<Constraint Type=\"Gravity\" NumNodes=\"all\" LoadShape=\"RAMPHOLD\"><AccelerationMagnitude>2\
         </AccelerationMagnitude><AccelerationDirection>0 0 -1</AccelerationDirection></Constraint>\
         <ContactSurface><Nodes NumNodes=\"8\">{}</Nodes><Elements NumEls=\"12\" Type=\"T3\">{sides}</Elements></ContactSurface>{}</Model>",
        both.xml(),
        set(),
        fix("all", &base),
        corners.join(" "),
        system(5e-4, 2.0, 40.0, "<DoDeformableCollision>1</DoDeformableCollision>")
    );
    let folder = tempfile::tempdir().unwrap();
    let scene = imported(&model, folder.path());
    assert!(scene.scene.contains("inside = true"), "{}", scene.scene);
    assert!(scene.notes.iter().any(|note| note.contains("`model` has 2 pieces")), "{:?}", scene.notes);
    let trajectory = played(&model);
    let weight = 2000.0 * (0.1_f64.powi(3) + 0.08_f64.powi(3));
    let (base, walls) = (trajectory.forces["fix-0"], trajectory.forces["surface-0"]);
    let fallen = trajectory.displacements["model"][first][2];
    println!("{base:?} N from the base for {weight} N, {walls:?} N on the walls, fallen by {fallen} m");
    assert!((base.z / weight - 1.0).abs() < 1e-3 && walls.norm() == 0.0, "{base:?} of {weight}");
    assert!((-0.02..-0.001).contains(&fallen), "{fallen}");
}

/// Two free cubes are pushed against each other by opposite forces: they have no momentum together, with
/// friction or without.
#[test]
fn free_cubes_keep_their_momentum() {
    let left = Grid::block(3, 0.1, [0.0; 3]).tets();
    let right = Grid::block(2, 0.09, [0.101, 0.003, 0.007]).tets();
    let push = |grid: &Grid, axis: usize, place: f64, total: f64| {
        let nodes = grid.at(axis, place);
        pulled("Force", axis, &nodes, total / nodes.len() as f64, "STEP")
    };
    let part = |grid: &Grid, more: String| format!("<SubModel>{}{}{more}</SubModel>\n", grid.xml(), set());
    for friction in [0.0, 0.4] {
        let more = format!(
            "<DoDeformableCollision>1</DoDeformableCollision>\
             <DeformableFrictionCoefficient>{friction}</DeformableFrictionCoefficient>"
        );
        let model = format!(
            "<Model>\n{}{}{}</Model>",
            part(&left, push(&left, 0, 0.0, 2.0) + &push(&left, 2, 0.0, 0.2)),
            part(&right, push(&right, 0, 0.101 + 0.09, -2.0) + &push(&right, 2, 0.007, -0.2)),
            system(5e-4, 0.3, 5.0, &more)
        );
        let trajectory = played(&model);
        println!(
            "friction {friction}: momentum {:.1e} of that of all nodes, {} N at most, {:.1e} m in each other",
            trajectory.momentum, trajectory.largest["part-0-part-1"], trajectory.in_bodies
        );
        assert!(trajectory.largest["part-0-part-1"] > 0.5);
        assert!(trajectory.momentum < 1e-10, "{:e}", trajectory.momentum);
        assert!(trajectory.in_bodies < ACROSS_EDGES, "{:e}", trajectory.in_bodies);
    }
}

/// The two arms of a fork are pressed together: they touch and stay apart, and the base, which holds the
/// fork, carries nothing.
#[test]
fn a_fork_touches_itself() {
    let grid = Grid::hexes([6, 2, 5], [0.12, 0.02, 0.05], [0.0; 3], |[i, _, k]| i == 0 || k != 2);
    let tips = |z: f64| -> Vec<usize> {
        grid.at(2, z).into_iter().filter(|&node| (grid.nodes[node][0] - 0.12).abs() < 1e-9).collect()
    };
    let arm = |z: f64| -> Vec<usize> {
        grid.at(2, z).into_iter().filter(|&node| grid.nodes[node][0] > 0.07).collect()
    };
    let model = |switch: &str| {
        format!(
            "<Model>\n{}{}{}{}{}{}</Model>",
            grid.xml(),
            set(),
            fix("all", &grid.at(0, 0.0)),
            pulled("Force", 2, &tips(0.0), 0.008, "RAMPHOLD"),
            pulled("Force", 2, &tips(0.05), -0.008, "RAMPHOLD"),
            system(5e-4, 1.5, 20.0, switch)
        )
    };
    // The arms are straight and thin, and lower nodes have upper ones at their side: their heights show who
    // is above.
    let gap = |trajectory: &Trajectory| {
        let height = |node: usize| grid.nodes[node][2] + trajectory.displacements["model"][node][2];
        arm(0.02)
            .iter()
            .zip(arm(0.03))
            .map(|(&low, high)| height(high) - height(low))
            .fold(f64::INFINITY, f64::min)
    };
    let folder = tempfile::tempdir().unwrap();
    let free = imported(&model(""), folder.path());
    assert!(!free.scene.contains("[contact"));
    let crossed = gap(&played(&model("")));
    let trajectory = played(&model("<DoSelfCollision>1</DoSelfCollision>"));
    let gap = gap(&trajectory);
    let base = trajectory.forces["fix-0"];
    println!(
        "free arms cross by {crossed} m, with contact they are {gap:.2e} m apart; {base:?} N from the base"
    );
    assert!(crossed < -2e-3, "{crossed}");
    assert!(gap > -ACROSS_EDGES && gap < 1e-4, "{gap:e}");
    assert!(base.norm() < 1e-3 * 0.024, "{base:?}");
}

/// Membranes on two sides of a block that is stretched carry their part: F = w ε (E h + 2 E_m t) for small
/// strain and equal ν.
#[test]
fn membranes_carry_their_part_of_a_force() {
    let grid = Grid::block(3, 0.1, [0.0; 3]).tets();
    let (young, poisson) = (3000.0, 0.3);
    let end = grid.at(0, 0.1);
    let flat = |z: f64| -> Vec<usize> {
        // Triangles of the cells' faces in the plane.
        let triangles = grid.cells.iter().flat_map(|cell| {
            [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]].map(|face: [usize; 3]| face.map(|a| cell[a]))
        });
        triangles
            .filter(|face| face.iter().all(|&node| (grid.nodes[node][2] - z).abs() < 1e-9))
            .flatten()
            .collect()
    };
    let faces = [flat(0.0), flat(0.1)].concat();
    for (kind, parameters, its) in [
        ("Linear", format!("{} {poisson}", 1e5), 1e5),
        // Poisson's ratio 0.5 differs from the block, which holds the membrane by its sides: up to 4 %
        // stiffer.
        ("NeoHookean", format!("{}", 1e5 / 3.0), 1e5),
    ] {
        let model = format!(
            "<Model>\n{}<ElementSet Size=\"all\"><Material Type=\"LE\"><ElasticParams NumParams=\"2\">{young} {poisson}\
             </ElasticParams></Material>0</ElementSet>{}{}{}{}<ShellElements Type=\"T3\" NumEls=\"{}\">{}</ShellElements>\
             <ShellElementSet Size=\"all\"><Material Type=\"{kind}\">{parameters}<Density>1000</Density>\
             <Thickness>0.001</Thickness></Material></ShellElementSet>{}</Model>",
            grid.xml(),
            fix("0", &grid.at(0, 0.0)),
            fix("1", &grid.at(1, 0.0)),
            fix("2", &grid.at(2, 0.0)),
            pulled("Disp", 0, &end, 1e-4, "POLY345"),
            faces.len() / 3,
            list(&faces),
            system(2e-4, 0.6, 60.0, "")
        );
        let trajectory = played(&model);
        let force = trajectory.forces["move-0"].x;
        let exact = 0.1 * 1e-3 * (young * 0.1 + 2.0 * its * 0.001);
        println!("{kind}: {force} N of {exact} N");
        let limit = if kind == "Linear" { 3e-3 } else { 0.04 };
        assert!((force / exact - 1.0).abs() < limit, "{kind}: {force} N of {exact} N");
    }
}
