//! Distances of a point and a triangle and of two edges, with the nearest points. With the coefficients c of
//! the four points, Σ cᵢ xᵢ is the way from the second primitive to the first. Its direction is n = Σ cᵢ xᵢ /
//! d. The gradient is ∂d/∂xᵢ = cᵢ n, since the nearest points minimise the distance (envelope theorem). Edges
//! that are nearly parallel have a smooth factor as well (`Mollifier`).

use nalgebra::Vector3;
use pliant_geometry::barycentric_of_closest;

/// Nearest parts of two primitives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Region {
    /// A point and the inside of a triangle.
    Face,
    /// The insides of two edges.
    Edges,
    /// A point and the inside of an edge.
    Edge,
    /// Two points.
    Point,
}

/// The nearest points of two primitives.
#[derive(Clone, Copy, Debug)]
pub struct Nearest {
    /// Their distance d [m].
    pub distance: f64,
    /// Coefficients c of the four points: Σ c = 0, Σ c x is the way [m] from the second primitive to the
    /// first.
    pub coefficients: [f64; 4],
    /// Σ c x / d; zero where the primitives meet.
    pub normal: Vector3<f64>,
    /// Nearest parts of the primitives.
    pub region: Region,
}

impl Nearest {
    fn new(points: &[Vector3<f64>; 4], coefficients: [f64; 4], region: Region) -> Self {
        // Relative to one of the points that count: no digits are lost far from the origin.
        let origin = points[coefficients.iter().position(|&c| c != 0.0).unwrap_or(0)];
        let way: Vector3<f64> = (0..4).map(|i| (points[i] - origin) * coefficients[i]).sum();
        Self::along(way, coefficients, region)
    }

    fn along(way: Vector3<f64>, coefficients: [f64; 4], region: Region) -> Self {
        let distance = way.norm();
        let normal = if distance > 0.0 { way / distance } else { Vector3::zeros() };
        Self { distance, coefficients, normal, region }
    }
}

/// The first point and the triangle of the other three (Ericson 2005, section 5.1.5).
pub(crate) fn point_triangle(points: &[Vector3<f64>; 4]) -> Nearest {
    let [p, a, b, c] = points;
    let weights = barycentric_of_closest(&[*a, *b, *c], p);
    let coefficients = [1.0, -weights[0], -weights[1], -weights[2]];
    let region = match weights.iter().filter(|&&weight| weight != 0.0).count() {
        3 => Region::Face,
        2 => Region::Edge,
        _ => Region::Point,
    };
    if region == Region::Face {
        // The height over the plane keeps the digits that a difference of nearest points loses.
        let normal = (b - a).cross(&(c - a));
        if let Some(normal) = normal.try_normalize(0.0) {
            let nearest = points[1 + Vector3::from(weights).imax()];
            return Nearest::along(normal * normal.dot(&(p - nearest)), coefficients, region);
        }
    }
    Nearest::new(points, coefficients, region)
}

/// Returns the nearest points of the edge of the first two points and the edge of the other two. On parallel
/// edges an end is taken.
pub(crate) fn edge_edge(points: &[Vector3<f64>; 4]) -> Nearest {
    let [a, b, c, d] = points;
    let (along, other, between) = (b - a, d - c, a - c);
    let [aa, bb, ab] = [along.norm_squared(), other.norm_squared(), along.dot(&other)];
    let [da, db] = [along.dot(&between), other.dot(&between)];
    let normal = along.cross(&other);
    let crossed = normal.norm_squared();
    let mut best = None;
    if crossed > 0.0 {
        let [s, t] = [(ab * db - bb * da) / crossed, (aa * db - ab * da) / crossed];
        if 0.0 < s && s < 1.0 && 0.0 < t && t < 1.0 {
            let normal = normal / crossed.sqrt();
            let way = normal * normal.dot(&nearest_difference(points, [s, t]));
            let coefficients = [1.0 - s, s, t - 1.0, -t];
            // Far from parallel nothing is nearer.
            if crossed > SURE * aa * bb {
                return Nearest::along(way, coefficients, Region::Edges);
            }
            best = Some(Nearest::new(points, coefficients, Region::Edges));
        }
    }
    // An end of one and the nearest point of the other.
    let (mut nearest, mut end, mut part) = (f64::INFINITY, 0, 0.0);
    for (number, point) in points.iter().enumerate() {
        let (from, way, length) = if number < 2 { (c, other, bb) } else { (a, along, aa) };
        let between = point - from;
        let at = if length > 0.0 { (way.dot(&between) / length).clamp(0.0, 1.0) } else { 0.0 };
        let squared = (between - way * at).norm_squared();
        if squared < nearest {
            (nearest, end, part) = (squared, number, at);
        }
    }
    if let Some(best) = best.filter(|best| best.distance * best.distance <= nearest) {
        return best;
    }
    let (sign, first) = if end < 2 { (1.0, 2) } else { (-1.0, 0) };
    let mut coefficients = [0.0; 4];
    coefficients[end] = sign;
    coefficients[first] = -sign * (1.0 - part);
    coefficients[first + 1] = -sign * part;
    let region = if 0.0 < part && part < 1.0 { Region::Edge } else { Region::Point };
    Nearest::new(points, coefficients, region)
}

/// The distance [m] of two edges alone, equal to the distance of [`edge_edge`] up to round-off, in a third of
/// the time.
pub(super) fn edge_distance(points: &[Vector3<f64>; 4]) -> f64 {
    let [a, b, c, d] = points;
    let (along, other, between) = (b - a, d - c, a - c);
    let [aa, bb, ab] = [along.norm_squared(), other.norm_squared(), along.dot(&other)];
    let [da, db] = [along.dot(&between), other.dot(&between)];
    let normal = along.cross(&other);
    let crossed = normal.norm_squared();
    let [s, t] = [ab * db - bb * da, aa * db - ab * da];
    if 0.0 < s && s < crossed && 0.0 < t && t < crossed {
        let is_sure = crossed > SURE * aa * bb;
        return if is_sure {
            normal.dot(&between).abs() / crossed.sqrt()
        } else {
            edge_edge(points).distance
        };
    }
    // An end of one and the nearest point of the other.
    let part = |way: f64, length: f64| if length > 0.0 { (way / length).clamp(0.0, 1.0) } else { 0.0 };
    let squares = [
        (between - other * part(db, bb)).norm_squared(),
        (between + along - other * part(db + ab, bb)).norm_squared(),
        (between + along * part(-da, aa)).norm_squared(),
        (between - other + along * part(ab - da, aa)).norm_squared(),
    ];
    squares[0].min(squares[1]).min(squares[2].min(squares[3])).sqrt()
}

/// The square of the sine of the angle between edges above which their inner nearest points are exact.
const SURE: f64 = 1e-6;

/// Returns the difference of the ends of two edges that are nearest to the points at their parts s, t.
fn nearest_difference([a, b, c, d]: &[Vector3<f64>; 4], [s, t]: [f64; 2]) -> Vector3<f64> {
    (if s < 0.5 { a } else { b }) - (if t < 0.5 { c } else { d })
}

/// The factor m(x) = (2 − x/e) x/e of two edges whose x = |e₁ × e₂|² is below e = 10⁻³ |E₁|² |E₂|², and 1
/// above. Here E are the edges at rest. The factor removes the jump of the nearest points of parallel edges
/// (Li et al. 2020, equation 24).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mollifier {
    /// m.
    pub value: f64,
    /// ∂m/∂xᵢ [1/m] of the four points.
    pub gradient: [Vector3<f64>; 4],
}

/// e/(|E₁|² |E₂|²) of a [`Mollifier`].
const PARALLEL: f64 = 1e-3;

impl Mollifier {
    /// The threshold e [m⁴] of two edges by the squares of their lengths at rest [m²].
    pub fn threshold([first, second]: [f64; 2]) -> f64 {
        PARALLEL * first * second
    }

    /// Returns the mollifier of two edges by their ends [m] and the threshold e [m⁴].
    pub fn of([a, b, c, d]: &[Vector3<f64>; 4], threshold: f64) -> Self {
        let (along, other) = (b - a, d - c);
        let normal = along.cross(&other);
        let x = normal.norm_squared() / threshold;
        if x >= 1.0 || threshold <= 0.0 {
            return Self { value: 1.0, gradient: [Vector3::zeros(); 4] };
        }
        // ∂|e₁ × e₂|²/∂e₁ = 2 e₂ × (e₁ × e₂).
        let slope = 2.0 * (1.0 - x) / threshold;
        let first = 2.0 * slope * other.cross(&normal);
        let second = -2.0 * slope * along.cross(&normal);
        Self { value: (2.0 - x) * x, gradient: [-first, first, -second, second] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::barrier::law::Barrier;
    use pliant_testing::Random;
    use serde_json::Value;

    /// The distance alone agrees with the distance of the nearest points to 1e-9 and the round-off of
    /// coordinates. The edges have any position; parallel edges and points are among them.
    #[test]
    fn distances_of_edges_alone_are_those_of_their_nearest_points() {
        let mut random = Random::new(8);
        for number in 0..200_000 {
            let mut points: [Vector3<f64>; 4] = std::array::from_fn(|_| Vector3::from(random.vector()));
            match number % 5 {
                0 => points[3] = points[2] + (points[1] - points[0]) * random.number(),
                1 => points[3] = points[2] + (points[1] - points[0]) + 1e-5 * Vector3::from(random.vector()),
                2 => points[3] = points[2],
                _ => {}
            }
            let (found, wanted) = (edge_distance(&points), edge_edge(&points).distance);
            assert!((found - wanted).abs() < 1e-9 * wanted + ROUNDING, "{number}: {found} {wanted}");
        }
    }

    fn reference() -> Value {
        let text = include_str!("../../../../lab/validation/data/coupling/ipc_primitives.json");
        serde_json::from_str(text).unwrap()
    }

    fn points(case: &Value) -> [Vector3<f64>; 4] {
        let rows = case["points"].as_array().unwrap();
        std::array::from_fn(|i| Vector3::from_fn(|c, _| rows[i][c].as_f64().unwrap()))
    }

    fn vectors(of: &Value) -> [Vector3<f64>; 4] {
        let numbers = of.as_array().unwrap();
        std::array::from_fn(|i| Vector3::from_fn(|c, _| numbers[3 * i + c].as_f64().unwrap()))
    }

    /// Rounding error of a distance from differences of coordinates up to 2: two units in the last place.
    const ROUNDING: f64 = 2.0 * f64::EPSILON;

    /// The largest difference of vectors, over the largest component of the second.
    fn off(found: [Vector3<f64>; 4], wanted: [Vector3<f64>; 4]) -> f64 {
        let size = wanted.iter().map(|v| v.amax()).fold(0.0, f64::max);
        found.iter().zip(&wanted).map(|(a, b)| (a - b).amax()).fold(0.0, f64::max)
            / size.max(f64::MIN_POSITIVE)
    }

    fn threshold([a, b, c, d]: &[Vector3<f64>; 4]) -> f64 {
        Mollifier::threshold([(b - a).norm_squared(), (d - c).norm_squared()])
    }

    fn gradient(nearest: &Nearest) -> [Vector3<f64>; 4] {
        nearest.coefficients.map(|c| nearest.normal * c)
    }

    /// The 100 pairs of a point and a triangle, in all regions: distances to 1e-12 or round-off of the
    /// coordinates. Gradients of distance and barrier agree to 1e-9.
    #[test]
    fn point_triangle_pairs_are_those_of_the_reference() {
        let reference = reference();
        let mut missed = 0;
        for case in reference["point_triangle"].as_array().unwrap() {
            let x = points(case);
            let near = point_triangle(&x);
            let distance = case["distance"].as_f64().unwrap();
            let name = format!("{} {}", case["id"], case["category"]);
            let off_by = (near.distance - distance).abs();
            assert!(off_by < 1e-12 * distance + ROUNDING, "{name}: {} {distance}", near.distance);
            missed += u32::from(off_by >= 1e-12 * distance);
            let region = case["region"].as_str().unwrap();
            let of = [(Region::Face, "face"), (Region::Edge, "edge"), (Region::Point, "vertex")];
            let (_, word) = of.iter().find(|(known, _)| *known == near.region).unwrap();
            assert!(region.starts_with(word), "{name}: {region} {:?}", near.region);
            assert!(off(gradient(&near), vectors(&case["grad_distance"])) < 1e-9, "{name}");
            let barrier = Barrier { distance: case["dhat"].as_f64().unwrap() };
            let slope = barrier.slope(near.distance);
            let barrier_gradient = gradient(&near).map(|g| g * slope);
            if distance < barrier.distance {
                assert!(off(barrier_gradient, vectors(&case["grad_barrier"])) < 1e-9, "{name}");
            }
        }
        println!(
            "{missed} of 100 distances off by more than 1e-12 of them, all within round-off of the coordinates"
        );
    }

    /// The 100 pairs of edges: distances to 1e-12 (near-parallel ones to 1e-8), gradients, also of mollified
    /// barriers, to 1e-9.
    #[test]
    fn edge_edge_pairs_are_those_of_the_reference() {
        let reference = reference();
        let mut missed = 0;
        for case in reference["edge_edge"].as_array().unwrap() {
            let x = points(case);
            let near = edge_edge(&x);
            let distance = case["distance"].as_f64().unwrap();
            let name = format!("{} {}", case["id"], case["category"]);
            let sine = case["sin_angle"].as_f64().unwrap();
            let allowed = if sine < 1e-3 { 1e-8 } else { 1e-12 };
            let off_by = (near.distance - distance).abs();
            assert!(off_by < allowed * distance + ROUNDING, "{name}: {} {distance}", near.distance);
            missed += u32::from(off_by >= allowed * distance);
            let mollifier = Mollifier::of(&x, threshold(&x));
            let value = case["mollifier"].as_f64().unwrap();
            assert!((mollifier.value - value).abs() < 1e-12, "{name}");
            let slope = vectors(&case["grad_mollifier_fixed_eps"]);
            if value < 1.0 && sine > 1e-3 {
                assert!(off(mollifier.gradient, slope) < 1e-9, "{name}");
            }
            if !case["gradient_unique"].as_bool().unwrap() || sine < 1e-3 {
                continue;
            }
            assert!(off(gradient(&near), vectors(&case["grad_distance"])) < 1e-9, "{name}");
            let barrier = Barrier { distance: case["dhat"].as_f64().unwrap() };
            if distance < barrier.distance {
                let [b, slope] = [barrier.energy(near.distance), barrier.slope(near.distance)];
                let whole = gradient(&near).map(|g| g * (slope * mollifier.value));
                let mollified = std::array::from_fn(|i| whole[i] + mollifier.gradient[i] * b);
                assert!(off(mollified, vectors(&case["grad_mollified_barrier"])) < 1e-9, "{name}");
            }
        }
        println!(
            "{missed} of 100 distances off by more than 1e-12 of them, all within round-off of the coordinates"
        );
    }

    /// Gradients of distances and mollifiers by central differences on random pairs of all regions (A10).
    fn gradients_by_differences(count: usize) {
        let mut random = Random::new(7);
        let mut regions = [0; 4];
        for number in 0..count {
            let mut x: [Vector3<f64>; 4] = std::array::from_fn(|_| Vector3::from(random.vector()));
            let edges = number % 2 == 0;
            if number % 8 == 0 {
                // Nearly parallel.
                let turn = Vector3::from(random.vector()) * 0.03;
                x[3] = x[2] + (x[1] - x[0]) * (1.0 + 0.5 * random.number()) + turn;
            }
            let rest = threshold(&x);
            let of = |x: &[Vector3<f64>; 4]| if edges { edge_edge(x) } else { point_triangle(x) };
            let near = of(&x);
            let m = Mollifier::of(&x, rest);
            assert!(near.coefficients.iter().sum::<f64>().abs() < 1e-14);
            regions[near.region as usize] += 1;
            if near.distance < 1e-2 {
                continue;
            }
            let h = 1e-6;
            for (i, c) in (0..4).flat_map(|i| (0..3).map(move |c| (i, c))) {
                let moved = |by: f64| {
                    let mut moved = x;
                    moved[i][c] += by;
                    (of(&moved), Mollifier::of(&moved, rest).value)
                };
                let [ahead, behind] = [moved(h), moved(-h)];
                // Second derivatives jump where the nearest points go from one part to another.
                if ahead.0.region != behind.0.region {
                    continue;
                }
                let slopes =
                    [ahead.0.distance - behind.0.distance, ahead.1 - behind.1].map(|d| d / (2.0 * h));
                // The mollifier has two pieces, and near-parallel edges jump: they are compared by the
                // product below.
                if !edges || Mollifier::of(&x, rest).value == 1.0 {
                    assert!(
                        (slopes[0] - near.coefficients[i] * near.normal[c]).abs() < 1e-6,
                        "{number} {near:?}"
                    );
                }
                if m.value < 0.99 {
                    let size = m.gradient.iter().map(|g| g.amax()).fold(1.0, f64::max);
                    assert!((slopes[1] - m.gradient[i][c]).abs() < 1e-5 * size, "{number} {}", m.value);
                }
            }
        }
        assert!(regions.iter().all(|&found| found > count / 20), "{regions:?}");
    }

    #[test]
    fn gradients_are_those_by_differences() {
        gradients_by_differences(10_000);
    }

    #[test]
    #[ignore = "a million pairs: half a minute"]
    fn gradients_are_those_by_differences_on_a_million_pairs() {
        gradients_by_differences(1_000_000);
    }

    /// A search over the points of the primitives finds nothing nearer.
    #[test]
    fn distances_are_the_least_over_all_points() {
        let mut random = Random::new(8);
        for number in 0..300 {
            let x: [Vector3<f64>; 4] = std::array::from_fn(|_| Vector3::from(random.vector()));
            let parts = 40;
            let part = |k: usize| k as f64 / parts as f64;
            let mut least = f64::INFINITY;
            for (i, j) in (0..=parts).flat_map(|i| (0..=parts).map(move |j| (i, j))) {
                let way = if number % 2 == 0 {
                    x[0].lerp(&x[1], part(i)) - x[2].lerp(&x[3], part(j))
                } else if i + j <= parts {
                    x[0] - (x[1] + (x[2] - x[1]) * part(i) + (x[3] - x[1]) * part(j))
                } else {
                    continue;
                };
                least = least.min(way.norm());
            }
            let found = if number % 2 == 0 { edge_edge(&x) } else { point_triangle(&x) }.distance;
            assert!(found <= least + 1e-14 && found > least - 0.1, "{found} {least}");
        }
    }
}
