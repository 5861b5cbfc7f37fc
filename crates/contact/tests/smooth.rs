//! Sampled distances by splines of second degree.

use nalgebra::Vector3;
use pliant_contact::grid::Grid;
use pliant_testing::Random;

const SPACING: f64 = 0.01;

fn sampled(distance: impl Fn(&Vector3<f64>) -> f64) -> Grid {
    let corner = Vector3::repeat(0.1);
    Grid::sample([-corner, corner], SPACING, distance).unwrap()
}

fn places(count: usize, reach: f64) -> impl Iterator<Item = Vector3<f64>> {
    let mut random = Random::new(5);
    (0..count).map(move |_| reach * Vector3::from(random.vector()))
}

/// A plane is exact to single precision, also in the outermost cells, and its gradient is its normal.
#[test]
fn a_plane_is_exact() {
    let normal = Vector3::new(1.0, -2.0, 0.5).normalize();
    let grid = sampled(|x| x.dot(&normal) - 0.01);
    for place in places(1000, 0.099).chain([Vector3::repeat(0.0999), Vector3::repeat(-0.0999)]) {
        let near = grid.smooth(&place);
        assert!((near.distance - (place.dot(&normal) - 0.01)).abs() < 1e-7, "{place}: {near:?}");
        assert!((near.normal - normal).norm() < 1e-4, "{place}: {near:?}");
    }
}

/// A curved surface is off by less than h²/(2 r), and the gradient belongs to the distance that is found.
#[test]
fn the_gradient_is_that_of_the_distance() {
    const RADIUS: f64 = 0.06;
    let grid = sampled(|x| x.norm() - RADIUS);
    for place in places(1000, 0.07).filter(|place| place.norm() > 0.04) {
        let near = grid.smooth(&place);
        assert!(
            (near.distance - (place.norm() - RADIUS)).abs() < SPACING * SPACING / (2.0 * 0.04),
            "{place}: {near:?}"
        );
        let h = 1e-5;
        for axis in 0..3 {
            let step = Vector3::ith(axis, h);
            let slope =
                (grid.smooth(&(place + step)).distance - grid.smooth(&(place - step)).distance) / (2.0 * h);
            // Second derivatives, up to 1/r, jump between cells.
            assert!(
                (slope - near.normal[axis]).abs() < h / 0.04,
                "{place}: {slope} for {}",
                near.normal[axis]
            );
        }
    }
}

/// In the corner of a box the gradient turns evenly, but the gradient of linear interpolation jumps from cell
/// to cell.
#[test]
fn gradients_go_on_evenly_through_cells_and_corners() {
    let grid = sampled(|x| x.amax() - 0.055);
    let way = Vector3::new(0.9, 1.0, 0.1).normalize();
    let [smooth, linear] = [Grid::smooth, Grid::near].map(|near: fn(&Grid, &Vector3<f64>) -> _| {
        let normals: Vec<Vector3<f64>> =
            (0..4000).map(|k| near(&grid, &(way * (2e-5 * f64::from(k)))).normal).collect();
        normals.windows(2).map(|pair| (pair[1] - pair[0]).norm()).fold(0.0, f64::max)
    });
    println!("the gradient jumps by {smooth} and, with linear interpolation, {linear}");
    assert!(smooth < 0.01 && linear > 0.1, "{smooth}, {linear}");
}
