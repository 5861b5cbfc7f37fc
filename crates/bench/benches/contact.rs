//! Detection of contact, on one core: `cargo bench -p pliant-bench --bench contact`. The surface is a ball of 20,480 triangles and 10,242 nodes
//! that swings by a part of an edge.

use divan::Bencher;
use divan::counter::ItemsCount;
use pliant_contact::grid::Grid;
use pliant_contact::pairs::{Pairs, Surface};
use pliant_contact::shape::Shape;
use pliant_contact::tree::{Bounds, Tree};
use pliant_geometry::Vector3;
use pliant_meshing::{DEFAULT_CELL_LIMIT, sphere};

fn main() {
    divan::main();
}

const RADIUS: f64 = 0.05;
/// Divisions of an icosahedron.
const LEVEL: u32 = 5;

/// Passes of a swing.
const PASSES: usize = 16;

struct Ball {
    faces: Vec<[u32; 3]>,
    /// Where the nodes are in each pass: they swing by 0.1 mm, a sixteenth of an edge.
    passes: Vec<Vec<Vector3>>,
    pass: usize,
}

impl Ball {
    fn new() -> Self {
        let mesh = sphere(RADIUS, LEVEL, DEFAULT_CELL_LIMIT).unwrap_or_else(|error| panic!("{error}"));
        let triangles = mesh.blocks.iter().flat_map(|block| block.cells());
        let faces: Vec<[u32; 3]> = triangles.map(|nodes| [nodes[0], nodes[1], nodes[2]]).collect();
        assert_eq!((mesh.points.len(), faces.len()), (10_242, 20_480));
        let swung = |pass: usize| {
            let phase = std::f64::consts::TAU * pass as f64 / PASSES as f64;
            let place = |point: &Vector3| point * (1.0 + 1e-4 / RADIUS * (phase + 40.0 * point.x).sin());
            mesh.points.iter().map(place).collect()
        };
        Self { faces, passes: (0..PASSES).map(swung).collect(), pass: 0 }
    }

    /// The places in the next pass.
    fn swing(&mut self) -> &[Vector3] {
        self.pass = (self.pass + 1) % PASSES;
        &self.passes[self.pass]
    }

    fn surface(&self) -> Surface {
        Surface { nodes: (0..self.passes[0].len() as u32).collect(), faces: self.faces.clone() }
    }
}

/// Boxes of all triangles found anew, and the triangles near a capsule with the distance of their nodes (P1).
#[divan::bench]
fn refit_and_tool(bencher: Bencher<'_, '_>) {
    let mut ball = Ball::new();
    let around = |points: &[Vector3], face: [u32; 3]| Bounds::of(face.map(|node| points[node as usize]));
    let mut tree = Tree::new(ball.faces.len(), |face| around(&ball.passes[0], ball.faces[face as usize]));
    let tool = Shape::Capsule { radius: 0.005, length: 0.03 };
    let at = Vector3::new(0.0, 0.0, RADIUS + 0.018);
    let reach = Bounds::of([at - Vector3::z() * 0.015, at + Vector3::z() * 0.015]).grown(0.006);
    let faces = ball.faces.clone();
    bencher.bench_local(|| {
        let points = ball.swing();
        tree.refit(|face| around(points, faces[face as usize]));
        let (mut touched, mut least) = (0, f64::INFINITY);
        tree.near(&reach, |face| {
            touched += 1;
            for node in faces[face as usize] {
                least = least.min(tool.near(&(points[node as usize] - at)).distance);
            }
        });
        assert!(touched > 20 && least < 0.002);
        least
    });
}

/// 10,000 points against signed distances on a grid of 128³ points (P2).
#[divan::bench]
fn points_in_a_grid(bencher: Bencher<'_, '_>) {
    let corner = Vector3::repeat(0.07);
    let grid = Grid::sample([-corner, corner], 0.14 / 127.0, |x| x.norm() - RADIUS);
    let grid = grid.unwrap_or_else(|| panic!("distances to a ball are finite"));
    let ball = Ball::new();
    let points = &ball.passes[0][..10_000];
    bencher
        .counter(ItemsCount::new(points.len()))
        .bench_local(|| points.iter().map(|point| grid.near(point).distance.abs()).sum::<f64>());
}

/// The surface against itself, by candidate lists.
#[divan::bench]
fn surface_with_itself(bencher: Bencher<'_, '_>) {
    let mut ball = Ball::new();
    let mut pairs = Pairs::new(&ball.surface(), None, 0.0, |node| ball.passes[0][node as usize]);
    bencher.bench_local(|| {
        let points = ball.swing();
        let place = |node: u32| points[node as usize];
        pairs.update(place);
        let mut count = 0;
        pairs.find(place, |_| count += 1);
        count
    });
}
