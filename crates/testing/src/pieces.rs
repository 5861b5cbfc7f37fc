//! Small bodies that meet at corners and edges: primitive scenes of rigid-body libraries, and the degenerate
//! ones of Erleben (2018, TOG 37:39).
//!
//! A body is a block of tets whose upper side may be narrowed to a tip or an edge. Bodies that are held stand
//! for rigid bodies: a solver may replace them by rigid shapes of the same size.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Isometry3, Point3, Vector3};

/// Edge [m] of most bodies.
pub const SIZE: f64 = 0.02;
/// Width of a tip or an edge over the width of the body.
const SHARP: f64 = 0.04;
/// Distance [m] between bodies at the start.
const GAP: f64 = 3e-3;
/// Velocity [m/s] of falling bodies.
const FALLS: [f64; 3] = [0.0, 0.0, -0.1];

/// A block whose upper side is narrowed.
#[derive(Clone, Debug)]
pub struct Piece {
    /// Edges [m] of its lower side, and its height [m].
    pub size: [f64; 3],
    /// Length and width of the upper side over length and width of the lower side.
    pub top: [f64; 2],
    /// Cells along each edge, of six tets each.
    pub cells: [u32; 3],
    /// Position of the middle of its upper side, and rotation.
    pub at: Isometry3<f64>,
    /// Velocity [m/s] at the start; `None`: it is held, by its lower side if it is soft.
    pub velocity: Option<[f64; 3]>,
    /// Density [kg/m³].
    pub density: f64,
}

/// Tets of a body with its surface, in the numbers of a model.
#[derive(Clone, Debug)]
pub struct Tets {
    /// Places [m] of its nodes.
    pub points: Vec<[f64; 3]>,
    /// Its cells.
    pub tets: Vec<[u32; 4]>,
    /// Triangles of its surface, outward.
    pub faces: Vec<[u32; 3]>,
    /// Nodes of its lower side.
    pub far: Vec<u32>,
}

impl Piece {
    /// A cube at rest.
    pub fn cube(at: Isometry3<f64>) -> Self {
        let velocity = Some([0.0; 3]);
        Self { size: [SIZE; 3], top: [1.0; 2], cells: [2; 3], at, velocity, density: 1000.0 }
    }

    /// A pyramid with its tip at the pose, along z.
    pub fn spike(at: Isometry3<f64>) -> Self {
        Self { size: [SIZE, SIZE, 1.5 * SIZE], top: [SHARP; 2], cells: [1, 1, 3], ..Self::cube(at) }
    }

    /// A wedge with its edge along y through the pose.
    pub fn wedge(at: Isometry3<f64>) -> Self {
        Self { top: [SHARP, 1.0], ..Self::spike(at) }
    }

    /// Returns the piece held.
    pub fn held(self) -> Self {
        Self { velocity: None, ..self }
    }

    /// Returns the piece with a velocity [m/s].
    pub fn thrown(self, velocity: [f64; 3]) -> Self {
        Self { velocity: Some(velocity), ..self }
    }

    /// Its tets, whose nodes get numbers from `first` on.
    pub fn tets(&self, first: u32) -> Tets {
        let [nx, ny, nz] = self.cells;
        let (mut points, mut far) = (Vec::new(), Vec::new());
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
        let faces = sides.into_values().filter(|sharing| sharing.len() == 1).flatten().collect();
        Tets { points, tets, faces, far }
    }
}

/// Rigid shape of a piece, in a frame of its own.
#[derive(Clone, Copy, Debug)]
pub enum Rigid {
    /// A box with these edges [m], centred at the origin.
    Cuboid([f64; 3]),
    /// A cone along z with the radius [m] of its base in the plane z = 0, and its height [m].
    Cone([f64; 2]),
}

impl Piece {
    /// Returns a rigid shape as large as the piece, with its pose. It is a box, a cone for a spike, or a
    /// blade as thin as the edge of a wedge.
    pub fn rigid(&self) -> (Rigid, Isometry3<f64>) {
        let [x, y, z] = self.size;
        let (shape, low) = match self.top {
            [along, across] if along == across && along < 1.0 => (Rigid::Cone([0.5 * x, z]), z),
            [along, across] => (Rigid::Cuboid([x * along, y * across, z]), 0.5 * z),
        };
        (shape, self.at * at(0.0, 0.0, -low))
    }
}

/// Bodies that meet.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Title of the scene.
    pub name: &'static str,
    /// Its bodies.
    pub pieces: Vec<Piece>,
    /// Gravity [m/s²], against z.
    pub gravity: f64,
    /// True if there is a floor; bodies stay at z ≥ 0.
    pub has_floor: bool,
}

/// Plays each scene with soft bodies, and again with rigid bodies in place of the held ones, if any are held
/// (`true`).
///
/// # Panics
/// With the mistakes of all scenes that went wrong.
pub fn play_all(scenes: &[Scene], play: impl Fn(&Scene, bool) -> Result<(), String>) {
    let held = |scene: &&Scene| scene.pieces.iter().any(|piece| piece.velocity.is_none());
    let runs = scenes.iter().map(|scene| (scene, false));
    let runs = runs.chain(scenes.iter().filter(held).map(|scene| (scene, true)));
    let wrong: Vec<String> = runs.filter_map(|(scene, is_rigid)| play(scene, is_rigid).err()).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

fn at(x: f64, y: f64, z: f64) -> Isometry3<f64> {
    Isometry3::translation(x, y, z)
}

/// Upside down.
fn down(x: f64, y: f64, z: f64) -> Isometry3<f64> {
    at(x, y, z) * Isometry3::rotation(Vector3::x() * PI)
}

fn turned(x: f64, y: f64, z: f64, turn: [f64; 3]) -> Isometry3<f64> {
    at(x, y, z) * Isometry3::rotation(turn.into())
}

fn about_z(angle: f64) -> Isometry3<f64> {
    Isometry3::rotation(Vector3::z() * angle)
}

/// Corners, edges and faces of free bodies that fly into each other.
pub fn corners_and_edges() -> Vec<Scene> {
    let scene = |name, pieces| Scene { name, pieces, gravity: 0.0, has_floor: false };
    let origin = || at(0.0, 0.0, 0.0);
    let falls = |piece: Piece| piece.thrown(FALLS);
    vec![
        scene("vertex on vertex", vec![Piece::spike(origin()), falls(Piece::spike(down(0.0, 0.0, GAP)))]),
        scene("vertex on face", vec![Piece::cube(origin()), falls(Piece::spike(down(3e-3, 2e-3, GAP)))]),
        scene("vertex on node", vec![Piece::cube(origin()), falls(Piece::spike(down(0.0, 0.0, GAP)))]),
        scene(
            "edge on edge, crossed",
            vec![Piece::wedge(origin()), falls(Piece::wedge(down(0.0, 0.0, GAP) * about_z(FRAC_PI_2)))],
        ),
        scene(
            "edge on edge, parallel",
            vec![Piece::wedge(origin()), falls(Piece::wedge(down(0.0, 0.0, GAP)))],
        ),
        scene(
            "edge on edge, nearly parallel",
            vec![Piece::wedge(origin()), falls(Piece::wedge(down(1e-4, 0.0, GAP) * about_z(1e-3)))],
        ),
        scene("edge on face", vec![Piece::cube(origin()), falls(Piece::wedge(down(2e-3, 0.0, GAP)))]),
        scene("face on face", vec![Piece::cube(origin()), falls(Piece::cube(at(0.0, 0.0, SIZE + GAP)))]),
        scene(
            "corner on corner",
            vec![
                Piece::cube(turned(0.0, 0.0, 0.0, [0.6, 0.6, 0.0])),
                Piece::cube(turned(0.0, 0.0, 2.0 * SIZE, [-0.6, -0.6, 0.3])).thrown([0.0, 0.0, -0.3]),
            ],
        ),
        scene(
            "corner in a corner of three cubes",
            vec![
                Piece::cube(origin()).held(),
                Piece::cube(at(-SIZE - GAP, 0.0, SIZE)).held(),
                Piece::cube(at(0.0, -SIZE - GAP, SIZE)).held(),
                Piece::spike(down(-0.2 * SIZE, -0.2 * SIZE, GAP)).thrown([-0.1, -0.1, -0.3]),
            ],
        ),
    ]
}

/// Stacks on a floor, and a heavy block on a light one.
pub fn stacks() -> Vec<Scene> {
    let scene = |name, pieces| Scene { name, pieces, gravity: 9.81, has_floor: true };
    let cube = |x: f64, floor: u32| Piece::cube(at(x, 0.0, f64::from(floor) * (SIZE + 5e-4)));
    let light = Piece { density: 10.0, ..cube(0.0, 1) };
    let heavy = Piece { density: 1e4, ..cube(1e-3, 2) };
    vec![
        scene("five cubes", (0..5).map(|k| cube(0.0, k + 1)).collect()),
        scene("1000 times as heavy", vec![light, heavy]),
    ]
}

/// The ten scenes of Erleben: spikes, wedges, holes, cracks and cliffs.
pub fn erleben() -> Vec<Scene> {
    let scene = |name, pieces| Scene { name, pieces, gravity: 9.81, has_floor: false };
    // Blocks beside a crack or a square hole of a third of their size.
    let half = 0.5 * SIZE + SIZE / 6.0;
    let crack = |piece: Piece| {
        let sides = [half, -half].map(|x| Piece::cube(at(x, 0.0, 0.0)).held());
        sides.into_iter().chain([piece.thrown(FALLS)]).collect::<Vec<Piece>>()
    };
    let hole = |piece: Piece| {
        let places = [[half, SIZE / 3.0], [-SIZE / 3.0, half], [-half, -SIZE / 3.0], [SIZE / 3.0, -half]];
        // Each block begins where the one before ends, so that they keep a little apart.
        let sides = places.map(|[x, y]| Piece::cube(at(1.02 * x, 1.02 * y, 0.0)).held());
        sides.into_iter().chain([piece.thrown(FALLS)]).collect::<Vec<Piece>>()
    };
    let flat = || Piece {
        size: [4.0 * SIZE, SIZE, SIZE],
        cells: [8, 2, 2],
        ..Piece::cube(at(0.0, 0.0, 0.0)).held()
    };
    vec![
        scene(
            "spikes",
            vec![Piece::spike(at(0.0, 0.0, 0.0)).held(), Piece::spike(down(1e-4, 0.0, GAP)).thrown(FALLS)],
        ),
        scene(
            "spike and wedge",
            vec![Piece::wedge(at(0.0, 0.0, 0.0)).held(), Piece::spike(down(0.0, 1e-3, GAP)).thrown(FALLS)],
        ),
        scene(
            "wedges",
            vec![Piece::wedge(at(0.0, 0.0, 0.0)).held(), Piece::wedge(down(0.0, 0.0, GAP)).thrown(FALLS)],
        ),
        scene("spike in a hole", hole(Piece::spike(down(0.0, 0.0, GAP)))),
        scene("spike in a crack", crack(Piece::spike(down(0.0, 0.0, GAP)))),
        scene("wedge in a crack", crack(Piece::wedge(down(0.0, 0.0, GAP)))),
        scene("sliding spike", vec![flat(), Piece::spike(down(-SIZE, 0.0, GAP)).thrown([0.2, 0.0, -0.1])]),
        scene("sliding wedge", vec![flat(), Piece::wedge(down(-SIZE, 0.0, GAP)).thrown([0.2, 0.0, -0.1])]),
        scene("cliff edges, a cube", vec![flat(), Piece::cube(at(2.0 * SIZE, 0.0, SIZE + GAP))]),
        scene("cliff edges, a wedge", vec![flat(), Piece::wedge(down(2.0 * SIZE, 0.0, GAP))]),
        scene(
            "internal edges",
            vec![flat(), Piece::cube(at(-SIZE, 0.0, SIZE + GAP)).thrown([0.3, 0.0, 0.0])],
        ),
    ]
}
