//! Rigid shapes and their ways in WGSL against their twins in double precision.

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::Vector3;
use pliant_contact::grid::Grid;
use pliant_contact::pose::{Pose, Stance, Trajectory};
use pliant_contact::shader::{shader, things};
use pliant_contact::shape::{Near, Shape};
use pliant_contact::touch::{Passage, Rigid};
use pliant_testing::Random;

use crate::compute::compute;
use crate::support;

const POINTS: usize = 2000;

/// Results of `near_after` and `meet` at each point, and the way of the thing there.
const MAIN: &str = "
@group(0) @binding(0) var<storage, read> thing_numbers: array<f32>;
@group(0) @binding(1) var<storage, read> passage_numbers: array<f32>;
@group(0) @binding(2) var<storage, read> points: array<f32>;
@group(0) @binding(3) var<storage, read_write> found: array<f32>;

fn thing_number(at: u32) -> f32 {
    return thing_numbers[at];
}

fn passage_number(at: u32) -> f32 {
    return passage_numbers[at];
}

fn give(at: u32, v: vec3f) {
    found[at] = v.x;
    found[at + 1u] = v.y;
    found[at + 2u] = v.z;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let first = 6u * id.x;
    if first >= arrayLength(&points) {
        return;
    }
    let place = vec3f(points[first], points[first + 1u], points[first + 2u]);
    let moved = vec3f(points[first + 3u], points[first + 4u], points[first + 5u]);
    let passage = passage_of(0u, 0u);
    let from_thing = (place - passage.place) - passage.rest_of_place;
    let near = near_after(passage, from_thing - passage.shift);
    let met = meet(passage, 1e-3, from_thing, moved);
    let at = 11u * id.x;
    found[at] = near.distance;
    give(at + 1u, near.normal);
    found[at + 4u] = met.distance;
    give(at + 5u, met.normal);
    give(at + 8u, carried(passage, from_thing));
}
";

/// Distances to 1e-6 of the size, normals where they don't jump. Where a point meets a thing is a matter of
/// round-off at few points.
#[test]
fn shapes_and_ways_follow_double_precision() {
    let Some(device) = support::device() else { return };
    let corner = Vector3::repeat(0.5);
    let grid = Grid::sample([-corner, corner], 0.05, |x| x.norm() - 0.4).unwrap().with_thinnest(0.4);
    let shapes = [
        Shape::Sphere { radius: 0.3 },
        Shape::Capsule { radius: 0.2, length: 0.7 },
        Shape::Cuboid { size: [0.5, 0.9, 0.4] },
        Shape::Cylinder { radius: 0.3, length: 0.8 },
        Shape::Cone { radius: 0.4, height: 0.6 },
        Shape::HalfSpace,
        Shape::Grid(Arc::new(grid)),
    ];
    let before = Pose::translation(0.1, -0.2, 0.15) * Pose::rotation(Vector3::new(0.3, -0.5, 0.9));
    let after = Pose::translation(0.13, -0.18, 0.11) * Pose::rotation(Vector3::new(0.32, -0.52, 0.95));
    for (shape, inside) in shapes.into_iter().flat_map(|shape| [(shape.clone(), false), (shape, true)]) {
        let (name, trajectory, jaw) = ("thing".into(), Trajectory::fixed(before), None);
        let rigid = Rigid { name, shape, trajectory, inside, jaw };
        let passage = Passage::new(&rigid, [before, after].map(Stance::at));
        let source = [&shader(std::slice::from_ref(&rigid)), MAIN].concat();
        let mut random = Random::new(5);
        let numbers: Vec<f32> = (0..POINTS)
            .flat_map(|_| {
                let place = random.vector().map(|x| 0.8 * x);
                let moved = random.vector().map(|x| 0.2 * x);
                [place, moved].concat()
            })
            .map(|x| x as f32)
            .collect();
        let inputs = [&things(std::slice::from_ref(&rigid))[..], &passage.numbers(), &numbers];
        let found = compute(&device, &source, POINTS, &inputs, 11 * POINTS);
        let (mut worst, mut jumps, mut apart) = (0.0_f64, 0, 0);
        for (point, found) in numbers.chunks_exact(6).zip(found.chunks_exact(11)) {
            let vector = |numbers: &[f32]| Vector3::from_fn(|c, _| f64::from(numbers[c]));
            let (place, moved) = (vector(point), vector(&point[3..]));
            let is = |at: usize, Near { distance, normal }: Near| {
                let off = (f64::from(found[at]) - distance).abs();
                (off, (vector(&found[at + 1..]) - normal).norm())
            };
            let (distance, normal) = is(0, passage.near(&rigid, &place));
            worst = worst.max(distance);
            jumps += u32::from(normal > 1e-4);
            let (distance, normal) = is(4, passage.meet(&rigid, 1e-3, &place, &(place + moved)));
            apart += u32::from(distance > 1e-5 || normal > 1e-3);
            let way = passage.carry(&place) - place;
            assert!((vector(&found[8..]) - way).norm() < 1e-6, "{way} at {place}");
        }
        println!("{:?}, inside {inside}: {worst:.1e} m, {jumps} normals, {apart} meetings", rigid.shape);
        assert!(worst < 1e-6 && jumps < 10 && apart < 20, "{:?}", rigid.shape);
    }
}

/// Root and sine of each number.
const ROOT_AND_SINE: &str = "
@group(0) @binding(0) var<storage, read> given: array<f32>;
@group(0) @binding(1) var<storage, read_write> found: array<f32>;

fn thing_number(at: u32) -> f32 {
    return given[at];
}

fn passage_number(at: u32) -> f32 {
    return given[at];
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&given) {
        return;
    }
    found[2u * id.x] = root(given[id.x]);
    found[2u * id.x + 1u] = sine(given[id.x]);
}
";

/// Roots and sines are right to single precision, however small: devices need not find them so.
#[test]
fn roots_and_sines_keep_their_relative_digits() {
    let Some(device) = support::device() else { return };
    let mut random = Random::new(7);
    let mut given = vec![0.0_f32];
    given.extend((1..POINTS).map(|_| (10.0_f64.powf(7.0 * random.half() - 3.5) * PI) as f32));
    given.iter_mut().for_each(|x| *x = x.min(PI as f32));
    let source = [&shader(&[]), ROOT_AND_SINE].concat();
    let found = compute(&device, &source, POINTS, &[&given], 2 * POINTS);
    let mut worst = [0.0_f64; 2];
    for (&x, found) in given.iter().zip(found.chunks_exact(2)) {
        let x = f64::from(x);
        for (k, exact) in [x.sqrt(), x.sin()].into_iter().enumerate() {
            // Near half a turn the round-off of the angle counts.
            let scale = if k == 1 && x > 1.5 { 1.0 } else { exact.max(f64::MIN_POSITIVE) };
            worst[k] = worst[k].max((f64::from(found[k]) - exact).abs() / scale);
        }
    }
    println!("roots {:.1e}, sines {:.1e}", worst[0], worst[1]);
    assert!(worst[0] < 1.2e-7 && worst[1] < 3e-7, "{worst:?}");
}
