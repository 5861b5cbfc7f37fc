//! Less light arrives in a fold than on a free plane.

mod support;

use std::time::Instant;

use pliant_geometry::{CellKind, Mesh, Vector3};
use pliant_picture::{Camera, Frame, Offscreen, Picture, Plane, Regions, Style, Subject};
use support::graphics;

const SIZE: [u32; 2] = [1280, 800];

/// Makes a box of `cells` hexes along each side.
fn block(mesh: &mut Mesh, corner: [f64; 3], size: [f64; 3], cells: u32) {
    let (first, n) = (mesh.points.len() as u32, cells + 1);
    for index in 0..n * n * n {
        let part = [index % n, index / n % n, index / n / n].map(|i| f64::from(i) / f64::from(cells));
        mesh.points.push(Vector3::from_fn(|axis, _| corner[axis] + size[axis] * part[axis]));
    }
    let at = |i: u32, j: u32, k: u32| first + (k * n + j) * n + i;
    let nodes = &mut mesh.block_mut(CellKind::Hex).nodes;
    for cell in 0..cells * cells * cells {
        let (i, j, k) = (cell % cells, cell / cells % cells, cell / cells / cells);
        for k in [k, k + 1] {
            nodes.extend([at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k)]);
        }
    }
}

/// A floor with a wall: in a square metre, 0.4 m high.
fn floor_and_wall(cells: u32) -> Mesh {
    let mut mesh = Mesh::default();
    block(&mut mesh, [0.0, 0.0, -0.1], [1.0, 1.0, 0.1], cells);
    block(&mut mesh, [-0.1, 0.0, 0.0], [0.1, 1.0, 0.4], cells);
    mesh
}

fn camera(mesh: &Mesh) -> Camera {
    let mut camera = Camera { azimuth: 25.0, elevation: 35.0, ..Camera::default() };
    camera.fit(&mesh.points, f64::from(SIZE[0]) / f64::from(SIZE[1]));
    camera
}

/// The green of a picture where a point is seen.
fn green(picture: &Picture, camera: &Camera, point: [f64; 3]) -> f64 {
    let [width, height] = SIZE.map(f64::from);
    let [x, y] = camera.place(&Vector3::from(point), width / height).unwrap();
    let [column, row] = [0.5 * width * (1.0 + x), 0.5 * height * (1.0 - y)].map(|x| x as usize);
    f64::from(picture.rgba[4 * (row * SIZE[0] as usize + column) + 1])
}

#[test]
fn a_fold_is_darker_and_a_free_plane_is_not() {
    let Some(graphics) = graphics() else { return };
    let mesh = floor_and_wall(4);
    let subject = Subject::new(&mesh);
    let camera = camera(&mesh);
    let frame = Frame { points: mesh.points.clone(), ..Frame::default() };
    let mut offscreen = Offscreen::new(&graphics, &subject, SIZE).unwrap();
    let mut taken = |style| offscreen.draw(&frame, &camera, &style, &Regions::default()).unwrap();
    let plain = Style::default();
    let lit = taken(Style { occlusion: false, ..plain });
    let occluded = taken(plain);
    let part = |point| green(&occluded, &camera, point) / green(&lit, &camera, point);
    let [fold, wall, near] = [[0.01, 0.5, 0.0], [0.0, 0.5, 0.01], [0.06, 0.5, 0.0]].map(part);
    assert!(fold < 0.87 && wall < 0.87, "at the fold {fold}, on the wall {wall}");
    assert!(near > fold + 0.02 && near < 1.0, "{near} between {fold} and 1");
    // Beyond the reach, and where edges are convex, nothing changes.
    for free in [[0.6, 0.5, 0.0], [0.97, 0.5, 0.0], [1.0, 0.5, -0.03], [0.0, 0.5, 0.37]] {
        assert_eq!(part(free), 1.0, "at {free:?}");
    }
    // The occlusion of a section, whose plane is free.
    let clip = Plane::through(&Vector3::new(0.0, 0.5, 0.0), &-Vector3::y());
    let [lit, occluded] = [false, true].map(|occlusion| taken(Style { occlusion, clip, ..plain }));
    assert!(green(&occluded, &camera, [0.01, 0.7, 0.0]) < 0.87 * green(&lit, &camera, [0.01, 0.7, 0.0]));
    // Edges alone hide nothing.
    let [lit, occluded] = [false, true].map(|occlusion| taken(Style { occlusion, wireframe: true, ..plain }));
    assert_eq!(lit, occluded);
}

/// Returns the processor time of this process [s], in hundredths; `None` if the system does not report it.
fn processor_time() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    let mut words = text.rsplit_once(')')?.1.split_whitespace().skip(11);
    let ticks = words.next()?.parse::<f64>().ok()? + words.next()?.parse::<f64>().ok()?;
    Some(ticks / 100.0)
}

/// Prints the time of pictures with and without occlusion, in turn.
#[test]
#[ignore = "measures"]
fn cost() {
    const PICTURES: u32 = 60;
    let Some(graphics) = graphics() else { return };
    let mesh = floor_and_wall(30);
    let subject = Subject::new(&mesh);
    // A quarter of the picture is covered, as in windows.
    let mut camera = camera(&mesh);
    camera.zoom(1.5);
    let frame = Frame { points: mesh.points.clone(), ..Frame::default() };
    let mut offscreen = Offscreen::new(&graphics, &subject, SIZE).unwrap();
    let mut sums = [[0.0; 2]; 2];
    for _ in 0..PICTURES {
        for (occlusion, sum) in [false, true].into_iter().zip(&mut sums) {
            let (began, before) = (Instant::now(), processor_time());
            let style = Style { occlusion, ..Style::default() };
            offscreen.draw(&frame, &camera, &style, &Regions::default()).unwrap();
            sum[0] += began.elapsed().as_secs_f64();
            sum[1] += processor_time().zip(before).map_or(f64::NAN, |(after, before)| after - before);
        }
    }
    let [without, with] = sums.map(|sum| sum.map(|seconds| 1e3 * seconds / f64::from(PICTURES)));
    println!(
        "{} triangles, {SIZE:?} pixels: {without:.1?} ms, with occlusion {with:.1?} ms (wall, processor)",
        subject.triangle_count()
    );
}
