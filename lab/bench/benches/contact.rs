//! Detection of contact, on one core: `cargo bench -p pliant-bench --bench contact`. The surface is a ball of
//! 20,480 triangles and 10,242 nodes that swings by a part of an edge. Printed are quantiles of the times of
//! calls, and their mean processor time, which other programs change less.

use std::hint::black_box;
use std::time::{Duration, Instant};

use pliant_contact::grid::Grid;
use pliant_contact::pairs::{Pairs, Surface};
use pliant_contact::shape::Shape;
use pliant_contact::tree::{Bounds, Tree};
use pliant_geometry::Vector3;
use pliant_meshing::{DEFAULT_CELL_LIMIT, sphere};

fn main() {
    println!(
        "{:24} {:>7} {:>8} {:>8} {:>8} {:>8}  {:>9} {:>8}",
        "[µs]", "calls", "p50", "p95", "p99", "max", "processor", "calls/s"
    );
    measure("refit and tool (P1)", refit_and_tool());
    measure("10,000 points (P2)", points_in_a_grid());
    measure("ball with itself", with_itself(Ball::new(), false));
    measure("the same, listed anew", with_itself(Ball::new(), true));
    measure("folded sheet with itself", with_itself(folded(), false));
}

/// Duration of the calls before the measurement, and of the measurement.
const WARM_UP: Duration = Duration::from_millis(300);
const MEASURED: Duration = Duration::from_secs(4);

/// Measures the calls and prints a line.
fn measure(name: &str, mut call: impl FnMut() -> f64) {
    let start = Instant::now();
    while start.elapsed() < WARM_UP {
        black_box(call());
    }
    let mut times = Vec::new();
    let (start, busy) = (Instant::now(), processor_time());
    while start.elapsed() < MEASURED {
        let begun = Instant::now();
        black_box(call());
        times.push(begun.elapsed());
    }
    let busy = processor_time().zip(busy).map(|(now, before)| (now - before) / times.len() as f64);
    times.sort_unstable();
    let at = |part: f64| 1e6 * times[((times.len() - 1) as f64 * part).round() as usize].as_secs_f64();
    let [p50, p95, p99, most] = [0.5, 0.95, 0.99, 1.0].map(at);
    let (processor, rate) = busy.map_or((f64::NAN, f64::NAN), |busy| (1e6 * busy, 1.0 / busy));
    let count = times.len();
    println!("{name:24} {count:7} {p50:8.1} {p95:8.1} {p99:8.1} {most:8.1}  {processor:9.1} {rate:8.0}");
}

/// Processor time [s] of this thread; `None` except on Linux.
fn processor_time() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanoseconds: f64 = text.split_whitespace().next()?.parse().ok()?;
    Some(1e-9 * nanoseconds)
}

const RADIUS: f64 = 0.05;
/// Divisions of an icosahedron.
const LEVEL: u32 = 5;

/// Passes of a swing.
const PASSES: usize = 16;

struct Ball {
    faces: Vec<[u32; 3]>,
    /// Positions of the nodes in each pass: they swing by 0.1 mm, a sixteenth of an edge.
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

/// Computes the boxes of all triangles, and finds the triangles near a capsule with the distances of their
/// nodes (P1).
fn refit_and_tool() -> impl FnMut() -> f64 {
    let mut ball = Ball::new();
    let around = |points: &[Vector3], face: [u32; 3]| Bounds::of(face.map(|node| points[node as usize]));
    let mut tree = Tree::new(ball.faces.len(), |face| around(&ball.passes[0], ball.faces[face as usize]));
    let tool = Shape::Capsule { radius: 0.005, length: 0.03 };
    let at = Vector3::new(0.0, 0.0, RADIUS + 0.018);
    let reach = Bounds::of([at - Vector3::z() * 0.015, at + Vector3::z() * 0.015]).grown(0.006);
    let faces = ball.faces.clone();
    move || {
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
    }
}

/// 10,000 points against signed distances on a grid of 128³ points (P2).
fn points_in_a_grid() -> impl FnMut() -> f64 {
    let corner = Vector3::repeat(0.07);
    let grid = Grid::sample([-corner, corner], 0.14 / 127.0, |x| x.norm() - RADIUS);
    let grid = grid.unwrap_or_else(|| panic!("distances to a ball are finite"));
    let ball = Ball::new();
    let points = ball.passes[0][..10_000].to_vec();
    move || points.iter().map(|point| grid.near(point).distance.abs()).sum()
}

/// A sheet of 20,736 triangles with edges of 1 mm. Its halves lie face to face, 0.2 mm apart, and swing: all
/// nodes are near others.
fn folded() -> Ball {
    let (columns, rows) = (144, 72);
    let node = |i: u32, j: u32| j * (columns + 1) + i;
    let cell = |i: u32, j: u32| {
        let [a, b, c, d] = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    let faces: Vec<[u32; 3]> = (0..rows).flat_map(|j| (0..columns).flat_map(move |i| cell(i, j))).collect();
    let swung = |pass: usize| {
        let phase = std::f64::consts::TAU * pass as f64 / PASSES as f64;
        let place = |k: u32| {
            let [i, j] = [k % (columns + 1), k / (columns + 1)].map(f64::from);
            // The upper half lies over the lower half, shifted by half a cell.
            let beyond = i - 0.5 * f64::from(columns);
            let x = if beyond > 0.0 { 0.5 * f64::from(columns) - beyond + 0.5 } else { i };
            let lift = if beyond > 0.0 { 2e-4 } else { 0.0 };
            Vector3::new(1e-3 * x, 1e-3 * j, lift + 4e-5 * (phase + 0.3 * i).sin())
        };
        (0..(columns + 1) * (rows + 1)).map(place).collect()
    };
    Ball { faces, passes: (0..PASSES).map(swung).collect(), pass: 0 }
}

/// Self-contact of a surface, by candidate lists that stay valid, or that are computed again in each pass.
fn with_itself(mut surface: Ball, anew: bool) -> impl FnMut() -> f64 {
    let mut pairs = Pairs::new(&surface.surface(), None, 0.0, |node| surface.passes[0][node as usize]);
    move || {
        let points = surface.swing();
        let place = |node: u32| points[node as usize];
        if anew {
            pairs.list_again(place);
        } else {
            pairs.update(place);
        }
        let mut count = 0;
        pairs.find(place, |_| count += 1);
        f64::from(count)
    }
}
