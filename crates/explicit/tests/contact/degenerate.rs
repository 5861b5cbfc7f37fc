//! Bodies that meet at corners and edges (primitive scenes of rigid-body libraries, and the degenerate ones of Erleben 2018): they end, with
//! finite numbers, in bounds, and no edge of one is ever in a triangle of another.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use pliant_contact::pairs::Surface;
use pliant_contact::pose::Pose;
use pliant_contact::touch::{Contact, Contacts, Touch, With};
use pliant_explicit::{Observable, State};
use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
use pliant_mechanics::load::Load;
use pliant_mechanics::model::{Cells, Material, Model, Solid};

use super::rigid::floor;
use super::stepper;

/// Edge [m] of most bodies, and the distance that they keep.
const SIZE: f64 = 0.02;
const OFFSET: f64 = 1e-4;

/// A body of tets: a block whose upper side is narrowed, put somewhere.
struct Piece {
    size: [f64; 3],
    /// Length and width of the upper side over those of the lower one.
    top: [f64; 2],
    cells: [u32; 3],
    at: Pose,
    /// Velocity [m/s] at the start; `None`: its far side is held.
    velocity: Option<[f64; 3]>,
    density: f64,
}

impl Piece {
    fn cube(at: Pose) -> Self {
        let velocity = Some([0.0; 3]);
        Self { size: [SIZE; 3], top: [1.0; 2], cells: [2; 3], at, velocity, density: 1000.0 }
    }

    /// Its tip at the pose, along z.
    fn spike(at: Pose) -> Self {
        Self { size: [SIZE, SIZE, 1.5 * SIZE], top: [0.04; 2], cells: [1, 1, 3], ..Self::cube(at) }
    }

    /// Its edge along y through the pose.
    fn wedge(at: Pose) -> Self {
        Self { top: [0.04, 1.0], ..Self::spike(at) }
    }

    fn held(self) -> Self {
        Self { velocity: None, ..self }
    }

    fn thrown(self, velocity: [f64; 3]) -> Self {
        Self { velocity: Some(velocity), ..self }
    }

    /// Adds it to a model; its surface.
    fn add(&self, model: &mut Model) -> Surface {
        let [nx, ny, nz] = self.cells;
        let first = model.node_count() as u32;
        let mut points = Vec::new();
        let mut far = Vec::new();
        for k in 0..=nz {
            for j in 0..=ny {
                for i in 0..=nx {
                    let [x, y, z] = [(i, nx), (j, ny), (k, nz)].map(|(i, n)| f64::from(i) / f64::from(n));
                    let narrow = |top: f64| 1.0 + (top - 1.0) * z;
                    let local = Point3::new(
                        (x - 0.5) * self.size[0] * narrow(self.top[0]),
                        (y - 0.5) * self.size[1] * narrow(self.top[1]),
                        (z - 1.0) * self.size[2],
                    );
                    if k == 0 {
                        far.push(first + points.len() as u32);
                    }
                    points.push((self.at * local).coords.into());
                }
            }
        }
        let node = |i: u32, j: u32, k: u32| first + (k * (ny + 1) + j) * (nx + 1) + i;
        const TETS: [[usize; 4]; 6] =
            [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]];
        let corners =
            [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
        let mut tets = Vec::new();
        for (k, j, i) in (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| (k, j, i)))) {
            let hex = corners.map(|[a, b, c]| node(i + a, j + b, k + c));
            tets.extend(TETS.map(|tet| tet.map(|corner| hex[corner])));
        }
        let mut sides = BTreeMap::new();
        for [a, b, c, d] in &tets {
            for face in [[a, c, b], [a, b, d], [b, c, d], [a, d, c]].map(|face| face.map(|node| *node)) {
                let mut key = face;
                key.sort_unstable();
                sides.entry(key).or_insert_with(Vec::new).push(face);
            }
        }
        let faces: Vec<[u32; 3]> = sides.into_values().filter(|own| own.len() == 1).flatten().collect();
        let mut nodes: Vec<u32> = faces.iter().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        let body = model.add_body("piece", &points);
        model.bodies[body].damping = 5.0;
        let shear = 5e4;
        let law = NeoHookean { shear, volumetric: Volumetric::quadratic(2.0 * shear / 3.0) };
        let cells = Cells::tet4(tets, &model.rest);
        model.add_solid(Solid::new(body, Material::elastic(AnyLaw::NeoHookean(law), self.density), cells));
        model.initial_velocity.resize(points.len() + first as usize, self.velocity.unwrap_or_default());
        if self.velocity.is_none() {
            model.fix("far side", far);
        }
        Surface { nodes, faces }
    }
}

/// How many edges of one surface go through a triangle of another.
fn intersections(surfaces: &[Surface], place: &impl Fn(u32) -> Vector3<f64>) -> usize {
    let mut count = 0;
    for (a, first) in surfaces.iter().enumerate() {
        for (b, second) in surfaces.iter().enumerate() {
            if a == b {
                continue;
            }
            for edge in first.faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]) {
                let [from, to] = edge.map(place);
                count += second.faces.iter().filter(|face| crosses(from, to, face.map(place))).count();
            }
        }
    }
    count
}

/// Whether a segment goes through a triangle, by signed volumes.
fn crosses(from: Vector3<f64>, to: Vector3<f64>, [a, b, c]: [Vector3<f64>; 3]) -> bool {
    let volume = |p: Vector3<f64>, q: Vector3<f64>, r: Vector3<f64>, s: Vector3<f64>| {
        (q - p).cross(&(r - p)).dot(&(s - p))
    };
    if volume(a, b, c, from) * volume(a, b, c, to) >= 0.0 {
        return false;
    }
    let sides = [volume(from, to, a, b), volume(from, to, b, c), volume(from, to, c, a)];
    sides.iter().all(|side| *side > 0.0) || sides.iter().all(|side| *side < 0.0)
}

/// Plays a scene; what is wrong with it.
fn play(name: &str, pieces: &[Piece], gravity: f64, on_floor: bool) -> Result<(), String> {
    let mut model = Model::default();
    let surfaces: Vec<Surface> = pieces.iter().map(|piece| piece.add(&mut model)).collect();
    model.initial_velocity.resize(model.node_count(), [0.0; 3]);
    for (body, piece) in pieces.iter().enumerate() {
        if piece.velocity.is_some() && gravity > 0.0 {
            model.loads.push(Load::gravity(body, [0.0, 0.0, -gravity]));
        }
    }
    let touch = Touch { friction: 0.3, offset: OFFSET };
    let contact =
        |surface: &Surface, with| Contact { name: "touch".into(), surface: surface.clone(), with, touch };
    let mut contacts = Vec::new();
    for (k, first) in surfaces.iter().enumerate() {
        contacts.extend(surfaces[k + 1..].iter().map(|second| contact(first, With::Body(second.clone()))));
        if on_floor {
            contacts.push(contact(first, With::Rigid(0)));
        }
    }
    let contacts = Arc::new(Contacts { rigids: vec![floor()], contacts });
    let model = Arc::new(model);
    let mut stepper = stepper(&model, &contacts, 0.5);
    let mut state = State::at_rest(&model);
    let (mut steps, mut touched, mut crossed, mut fastest) = (0, 0, 0, 0.0_f64);
    while state.time < 0.4 {
        stepper.evaluate(&mut state).map_err(|error| format!("{name}: {error}"))?;
        touched += usize::from(stepper.contact_forces().iter().any(|force| *force != [0.0; 3]));
        stepper.advance(&mut state);
        steps += 1;
        if steps % 5 == 0 {
            let place = |node: u32| {
                Vector3::from(model.rest[node as usize]) + Vector3::from(state.displacement[node as usize])
            };
            crossed += intersections(&surfaces, &place);
        }
        for way in &state.increment {
            fastest = fastest.max(Vector3::from(*way).norm() / stepper.step());
        }
    }
    let far = state.displacement.iter().flatten().fold(0.0_f64, |most, u| most.max(u.abs()));
    println!(
        "{name}: {steps} steps, contact in {touched}, {crossed} intersections, at most {fastest:.2} m/s, moved by up to {far:.3} m"
    );
    // Falls in the time are below 0.8 m; shear waves run at 7 m/s, and thin tips are thrown about.
    let fine = touched > 0 && crossed == 0 && far < 1.0 && fastest < 20.0;
    if fine {
        Ok(())
    } else {
        Err(format!("{name}: {crossed} intersections, {far} m, {fastest} m/s, {touched} touches"))
    }
}

fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose::translation(x, y, z)
}

/// Upside down.
fn down(x: f64, y: f64, z: f64) -> Pose {
    at(x, y, z) * Pose::rotation(Vector3::x() * std::f64::consts::PI)
}

fn turned(x: f64, y: f64, z: f64, turn: [f64; 3]) -> Pose {
    at(x, y, z) * Pose::rotation(turn.into())
}

const FALLS: [f64; 3] = [0.0, 0.0, -0.1];

/// Corners, edges and faces of free bodies that fly into each other (S2).
#[test]
fn corners_edges_and_faces_that_meet_end_without_intersection() {
    let quarter = std::f64::consts::FRAC_PI_2;
    let gap = 3e-3;
    let scenes: Vec<(&str, Vec<Piece>)> = vec![
        (
            "vertex on vertex",
            vec![Piece::spike(at(0.0, 0.0, 0.0)), Piece::spike(down(0.0, 0.0, gap)).thrown(FALLS)],
        ),
        (
            "vertex on face",
            vec![Piece::cube(at(0.0, 0.0, 0.0)), Piece::spike(down(3e-3, 2e-3, gap)).thrown(FALLS)],
        ),
        (
            "vertex on node",
            vec![Piece::cube(at(0.0, 0.0, 0.0)), Piece::spike(down(0.0, 0.0, gap)).thrown(FALLS)],
        ),
        (
            "edge on edge, crossed",
            vec![
                Piece::wedge(at(0.0, 0.0, 0.0)),
                Piece::wedge(down(0.0, 0.0, gap) * Pose::rotation(Vector3::z() * quarter)).thrown(FALLS),
            ],
        ),
        (
            "edge on edge, parallel",
            vec![Piece::wedge(at(0.0, 0.0, 0.0)), Piece::wedge(down(0.0, 0.0, gap)).thrown(FALLS)],
        ),
        (
            "edge on edge, nearly parallel",
            vec![
                Piece::wedge(at(0.0, 0.0, 0.0)),
                Piece::wedge(down(1e-4, 0.0, gap) * Pose::rotation(Vector3::z() * 1e-3)).thrown(FALLS),
            ],
        ),
        (
            "edge on face",
            vec![Piece::cube(at(0.0, 0.0, 0.0)), Piece::wedge(down(2e-3, 0.0, gap)).thrown(FALLS)],
        ),
        (
            "face on face",
            vec![Piece::cube(at(0.0, 0.0, 0.0)), Piece::cube(at(0.0, 0.0, SIZE + gap)).thrown(FALLS)],
        ),
        (
            "corner on corner",
            vec![
                Piece::cube(turned(0.0, 0.0, 0.0, [0.6, 0.6, 0.0])),
                Piece::cube(turned(0.0, 0.0, 2.0 * SIZE, [-0.6, -0.6, 0.3])).thrown([0.0, 0.0, -0.3]),
            ],
        ),
        (
            "corner in a corner of three cubes",
            vec![
                Piece::cube(at(0.0, 0.0, 0.0)).held(),
                Piece::cube(at(-SIZE - gap, 0.0, SIZE)).held(),
                Piece::cube(at(0.0, -SIZE - gap, SIZE)).held(),
                Piece::spike(down(-0.2 * SIZE, -0.2 * SIZE, gap)).thrown([-0.1, -0.1, -0.3]),
            ],
        ),
    ];
    let wrong: Vec<String> =
        scenes.iter().filter_map(|(name, pieces)| play(name, pieces, 0.0, false).err()).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Stacks on a floor, and a heavy block on a light one (S2).
#[test]
fn stacks_and_large_ratios_of_mass_end_without_intersection() {
    let stack = (0..5).map(|k| Piece::cube(at(0.0, 0.0, f64::from(k + 1) * (SIZE + 5e-4)))).collect();
    let mut light = Piece::cube(at(0.0, 0.0, SIZE + 5e-4));
    light.density = 10.0;
    let mut heavy = Piece::cube(at(1e-3, 0.0, 2.0 * (SIZE + 5e-4)));
    heavy.density = 1e4;
    let scenes: Vec<(&str, Vec<Piece>)> =
        vec![("five cubes", stack), ("1000 times as heavy", vec![light, heavy])];
    let wrong: Vec<String> =
        scenes.iter().filter_map(|(name, pieces)| play(name, pieces, 9.81, true).err()).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Spikes, wedges, cracks and cliffs (Erleben 2018; S1).
#[test]
fn spikes_wedges_cracks_and_cliffs_end_without_intersection() {
    let gap = 3e-3;
    // Two blocks beside a crack of a third of their size, and a wedge that falls into it.
    let half = 0.5 * SIZE + SIZE / 6.0;
    let sides = [half, -half].map(|x| Piece::cube(at(x, 0.0, 0.0)).held());
    let wedge = Piece::wedge(down(0.0, 0.0, gap)).thrown(FALLS);
    let flat = || Piece {
        size: [4.0 * SIZE, SIZE, SIZE],
        cells: [8, 2, 2],
        ..Piece::cube(at(0.0, 0.0, 0.0)).held()
    };
    let scenes: Vec<(&str, Vec<Piece>)> = vec![
        (
            "spike on spike",
            vec![Piece::spike(at(0.0, 0.0, 0.0)).held(), Piece::spike(down(1e-4, 0.0, gap)).thrown(FALLS)],
        ),
        (
            "spike on wedge",
            vec![Piece::wedge(at(0.0, 0.0, 0.0)).held(), Piece::spike(down(0.0, 1e-3, gap)).thrown(FALLS)],
        ),
        ("wedge in a crack", sides.into_iter().chain([wedge]).collect()),
        ("cube over a cliff", vec![flat(), Piece::cube(at(2.0 * SIZE, 0.0, SIZE + gap))]),
        ("edge on a cliff", vec![flat(), Piece::wedge(down(2.0 * SIZE, 0.0, gap))]),
        ("sliding spike", vec![flat(), Piece::spike(down(-SIZE, 0.0, gap)).thrown([0.2, 0.0, -0.1])]),
        ("sliding wedge", vec![flat(), Piece::wedge(down(-SIZE, 0.0, gap)).thrown([0.2, 0.0, -0.1])]),
        (
            "cube over internal edges",
            vec![flat(), Piece::cube(at(-SIZE, 0.0, SIZE + gap)).thrown([0.3, 0.0, 0.0])],
        ),
    ];
    let wrong: Vec<String> =
        scenes.iter().filter_map(|(name, pieces)| play(name, pieces, 9.81, false).err()).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}
