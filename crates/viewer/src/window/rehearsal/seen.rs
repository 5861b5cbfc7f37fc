//! Places on a body, found by projecting all triangles, where picking sends a ray.

use eframe::egui::{Pos2, Vec2, vec2};
use pliant_geometry::Vector3;
use pliant_picture::{Camera, Projection};

use crate::window::App;

/// Pixels on the body, and the triangles that cover them, far from all edges.
pub(crate) fn known_pixels(app: &App) -> impl Iterator<Item = (Pos2, u32)> + '_ {
    let rect = app.port.rect;
    let aspect = f64::from(rect.width() / rect.height());
    // Halton's sequence over the picture.
    let places =
        (1..20_000).map(move |index| rect.min + vec2(halton(index, 2), halton(index, 3)) * rect.size());
    places.filter_map(move |place| Some((place, covering(app, app.port.in_picture(place), aspect)?)))
}

/// The place of the pixel of that number.
pub(crate) fn known_place(app: &App, number: usize) -> Pos2 {
    known_pixels(app).nth(number).expect("the body covers enough pixels").0
}

/// A pixel on the body, well inside it.
pub fn inside(app: &App) -> Pos2 {
    let seen = app.port.subject.surface_points();
    let places = seen.iter().filter_map(|&point| app.port.to_screen(&app.port.points[point as usize]));
    let (sum, count) = places.fold((Vec2::ZERO, 0.0_f32), |(sum, n), p| (sum + p.to_vec2(), n + 1.0));
    let middle = (sum / count.max(1.0)).to_pos2();
    if app.hit(app.port.in_picture(middle)).is_some() { middle } else { known_place(app, 0) }
}

/// The number of that index in Halton's sequence (1960) to a base.
fn halton(mut index: u32, base: u32) -> f32 {
    let (mut sum, mut part) = (0.0, 1.0);
    while index > 0 {
        part /= base as f32;
        sum += part * (index % base) as f32;
        index /= base;
    }
    sum
}

/// The nearest triangle whose projection covers a place.
fn covering(app: &App, [x, y]: [f64; 2], aspect: f64) -> Option<u32> {
    let camera = &app.port.camera;
    let mut nearest: Option<(f64, u32, f64)> = None;
    for (corners, number) in app.port.subject.triangles().zip(0..) {
        let corners = corners.map(|point| app.port.points[point as usize]);
        let [Some(a), Some(b), Some(c)] = corners.map(|corner| camera.place(&corner, aspect)) else {
            continue;
        };
        let cross = |p: [f64; 2], q: [f64; 2]| (p[0] - x) * (q[1] - y) - (p[1] - y) * (q[0] - x);
        let areas = [cross(b, c), cross(c, a), cross(a, b)];
        let weights = areas.map(|area| area / areas.iter().sum::<f64>());
        let least = weights.into_iter().fold(f64::INFINITY, f64::min);
        let depth = depth(camera, &corners, &weights);
        if least >= 0.0 && nearest.is_none_or(|(known, ..)| depth < known) {
            nearest = Some((depth, number, least));
        }
    }
    nearest.filter(|(.., least)| *least > 0.02).map(|(_, number, _)| number)
}

/// Distance [m] along the view of a point with these weights in the projection: 1/z is linear there in
/// perspective, z otherwise.
fn depth(camera: &Camera, corners: &[Vector3; 3], weights: &[f64; 3]) -> f64 {
    let (eye, towards) = (camera.eye(), camera.axes()[2]);
    let depths = corners.iter().map(|corner| (eye - corner).dot(&towards)).zip(weights);
    match camera.projection {
        Projection::Perspective => 1.0 / depths.map(|(z, weight)| weight / z).sum::<f64>(),
        Projection::Orthographic => depths.map(|(z, weight)| weight * z).sum(),
    }
}
