//! Pictures do not mislead: the largest value is marked where it is, and nodes that are doubled leave no
//! seam.

mod support;

use pliant_geometry::{CellKind, DataArray, Mesh, Vector3};
use pliant_picture::{Camera, Graphics, Look, Picture, Projection, Style};
use support::graphics;

/// Makes a square sheet of 8² squares in the plane of y and z, bent around z by 1.6 radians. If `doubled`, no
/// squares share nodes.
fn sheet(doubled: bool) -> Mesh {
    let mut mesh = Mesh::default();
    let place = |i: u32, j: u32| {
        let angle = f64::from(i) / 5.0 - 0.6;
        Vector3::new(0.2 * angle.cos(), 0.2 * angle.sin(), f64::from(j) / 80.0)
    };
    let mut nodes = Vec::new();
    for (i, j) in (0..64).map(|cell| (cell % 8, cell / 8)) {
        let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| {
            let known = mesh.points.iter().position(|point| !doubled && *point == place(i, j));
            known.unwrap_or_else(|| {
                mesh.points.push(place(i, j));
                mesh.points.len() - 1
            }) as u32
        });
        nodes.extend(corners);
    }
    mesh.block_mut(CellKind::Quad).nodes = nodes;
    mesh
}

fn look() -> Look {
    let camera =
        Camera { azimuth: 10.0, elevation: 20.0, projection: Projection::Orthographic, ..Camera::default() };
    Look { size: [320, 240], camera, ..Look::default() }
}

#[test]
fn nodes_that_are_doubled_leave_no_seam() {
    let Some(graphics) = graphics() else { return };
    let [shared, doubled] =
        [false, true].map(|doubled| look().picture(&graphics, &sheet(doubled), None, 0.0).unwrap());
    let worst: Option<u8> = shared.rgba.iter().zip(&doubled.rgba).map(|(a, b)| a.abs_diff(*b)).max();
    assert!(worst <= Some(1), "{worst:?}");
}

/// The picture of a sheet with the largest value at a node, with and without its mark; and the pixels that
/// differ.
fn marked(graphics: &Graphics, mesh: &mut Mesh, node: usize, azimuth: f64) -> (Picture, Vec<[f64; 2]>) {
    let values = (0..mesh.points.len()).map(|index| if index == node { 5.0 } else { 0.01 * index as f64 });
    mesh.point_data.insert("pressure".into(), DataArray::scalar(values.collect()));
    let plain = look();
    let camera = Camera { azimuth, ..plain.camera };
    let [with, without] = [true, false].map(|maximum| {
        let style = Style { maximum, ..Style::default() };
        let look = Look { field: Some("pressure".into()), style, camera, ..plain.clone() };
        look.picture(graphics, mesh, None, 0.0).unwrap()
    });
    let pixels = with.rgba.chunks(4).zip(without.rgba.chunks(4)).enumerate();
    let differ = pixels
        .filter(|(_, (a, b))| a != b)
        .map(|(at, _)| [(at % with.width as usize) as f64, (at / with.width as usize) as f64]);
    let differ = differ.collect();
    (without, differ)
}

#[test]
fn the_largest_value_is_marked_where_it_is() {
    let Some(graphics) = graphics() else { return };
    let mut mesh = sheet(false);
    let node = mesh.points.iter().position(|point| (point.z - 0.05).abs() < 1e-9 && point.y > 0.04).unwrap();
    let (picture, changed) = marked(&graphics, &mut mesh, node, 10.0);
    // The brightest pixel of the map is where the value is the largest.
    let yellow = |at: usize| {
        let pixel = &picture.rgba[4 * at..][..4];
        if pixel[3] < 255 { 0 } else { i32::from(pixel[0]) + i32::from(pixel[1]) - i32::from(pixel[2]) }
    };
    let width = picture.width as usize;
    let brightest = (0..picture.rgba.len() / 4).max_by_key(|&at| yellow(at)).unwrap();
    let [x, y] = [(brightest % width) as f64, (brightest / width) as f64];
    // The ring lies around it, and leaves the place itself free.
    let far: Vec<f64> = changed.iter().map(|[cx, cy]| (cx - x).hypot(cy - y)).collect();
    let ring = far.iter().filter(|far| **far < 7.5).count();
    assert!(ring > 30, "{ring} of {changed:?}");
    assert!(far.iter().all(|far| *far > 1.0), "the place itself is free");
    assert!(far.len() > ring + 40, "the number stands beside it");
}

#[test]
fn the_mark_of_a_hidden_place_is_dashed() {
    let Some(graphics) = graphics() else { return };
    // A wall before the sheet hides it from the front alone.
    let mut mesh = sheet(false);
    let node = mesh.points.len() / 2;
    let first = mesh.points.len() as u32;
    mesh.points.extend(
        [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[y, z]| Vector3::new(0.3, 0.05 + 0.2 * y, 0.05 + 0.2 * z)),
    );
    mesh.block_mut(CellKind::Quad).nodes.extend(first..first + 4);
    let dark = |azimuth: f64| marked(&graphics, &mut mesh.clone(), node, azimuth).1.len();
    let [hidden, seen] = [0.0, 180.0].map(dark);
    // The word takes more pixels than the gaps.
    assert!(hidden != seen && hidden > 60 && seen > 60, "{hidden} {seen}");
}

#[test]
fn equal_values_have_no_maximum() {
    let Some(graphics) = graphics() else { return };
    let mut mesh = sheet(false);
    mesh.point_data.insert("pressure".into(), DataArray::scalar(vec![2.0; mesh.points.len()]));
    let draw = |maximum: bool| {
        let style = Style { maximum, ..Style::default() };
        Look { field: Some("pressure".into()), style, ..look() }.picture(&graphics, &mesh, None, 0.0).unwrap()
    };
    assert_eq!(draw(true), draw(false));
    // The range of a film covers all its frames.
    let style = Style { maximum: true, range: Some([0.0, 5.0]), ..Style::default() };
    let drawn = |maximum: bool| {
        let style = Style { maximum, ..style };
        Look { field: Some("pressure".into()), style, ..look() }.picture(&graphics, &mesh, None, 0.0).unwrap()
    };
    assert_eq!(drawn(true), drawn(false), "a range that was given");
}
