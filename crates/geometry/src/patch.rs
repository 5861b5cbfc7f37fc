//! The part of a surface around a point, as a hand grips it.

use std::collections::HashSet;

use crate::Vector3;

/// Edges within which a hand holds a surface.
const REACH: f64 = 2.0;

/// Points of a surface around a place on it, with weights that sum to 1. The place lies in a triangle with
/// given weights of its corners. The patch is the points within a radius [m] that are connected to this
/// triangle. Without a radius it is two mean edges of the triangle. Weights follow a Gaussian whose deviation
/// is half of the radius. If no point is within the radius, the corners are returned with their own weights.
///
/// ```
/// use pliant_geometry::{Vector3, patch};
///
/// // A strip of triangles along x: the far end is not held.
/// let points: Vec<Vector3> =
///     (0..12).map(|k| Vector3::new(f64::from(k / 2), f64::from(k % 2), 0.0)).collect();
/// let triangles: Vec<[u32; 3]> = (0..10).map(|k| [k, k + 1, k + 2]).collect();
/// let held = patch(&points, &triangles, [0, 1, 2], [1.0, 0.0, 0.0], Some(1.5));
/// assert_eq!(held.iter().map(|(point, _)| *point).collect::<Vec<_>>(), [0, 1, 2, 3]);
/// assert!((held.iter().map(|(_, weight)| weight).sum::<f64>() - 1.0).abs() < 1e-12);
/// assert!(held[0].1 > held[1].1);
/// ```
pub fn patch(
    points: &[Vector3],
    triangles: &[[u32; 3]],
    corners: [u32; 3],
    weights: [f64; 3],
    radius: Option<f64>,
) -> Vec<(u32, f64)> {
    let corner_weights = || corners.into_iter().zip(weights).filter(|(_, weight)| *weight != 0.0);
    let middle: Vector3 = corner_weights().map(|(corner, weight)| points[corner as usize] * weight).sum();
    let radius = radius.unwrap_or_else(|| {
        let [a, b, c] = corners.map(|corner| points[corner as usize]);
        REACH * ((a - b).norm() + (b - c).norm() + (c - a).norm()) / 3.0
    });
    let distance = |point: u32| (points[point as usize] - middle).norm();
    let mut reached: Vec<u32> = corners.into_iter().filter(|&corner| distance(corner) < radius).collect();
    let mut known: HashSet<u32> = reached.iter().copied().collect();
    let mut before = 0;
    while before < reached.len() {
        before = reached.len();
        for triangle in
            triangles.iter().filter(|triangle| triangle.iter().any(|corner| known.contains(corner)))
        {
            for &corner in triangle {
                if distance(corner) < radius && !known.contains(&corner) {
                    reached.push(corner);
                }
            }
        }
        known.extend(&reached[before..]);
        reached.sort_unstable();
        reached.dedup();
    }
    let weight = |point: u32| {
        let part = REACH * distance(point) / radius;
        (-0.5 * part * part).exp()
    };
    let sum: f64 = reached.iter().map(|&point| weight(point)).sum();
    if sum == 0.0 {
        return corner_weights().collect();
    }
    reached.into_iter().map(|point| (point, weight(point) / sum)).collect()
}
