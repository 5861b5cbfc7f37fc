//! Hexahedra that grow outward: a cube of equal cells with layers around it, each side of the cube a block of
//! its own. A map turns them into a ball, or a half-space that is fine where something presses.

use std::collections::BTreeMap;

/// Points and hexahedra of positive volume.
pub type Hexes = (Vec<[f64; 3]>, Vec<[u32; 8]>);

/// Makes a cube of `cells` cells from 0 to 1 along each axis, or twice as many from −1 along `whole` axes.
/// Around it are `layers` layers out to `size`, each larger by the same factor than the layer within. The
/// largest coordinate of a point is 1 on the cube and `size` on the outer surface; `place` maps points to
/// their final places.
pub fn grown_hexes(
    cells: i32,
    layers: i32,
    size: f64,
    whole: [bool; 3],
    place: impl Fn([f64; 3]) -> [f64; 3],
) -> Hexes {
    let mut numbers = BTreeMap::new();
    let mut points = Vec::new();
    let mut node = |at: [i32; 3], layer: i32| {
        *numbers.entry((at, layer)).or_insert_with(|| {
            let scale = size.powf(f64::from(layer) / f64::from(layers.max(1))) / f64::from(cells);
            points.push(place(at.map(|k| scale * f64::from(k))));
            points.len() as u32 - 1
        })
    };
    let ranges = whole.map(|whole| if whole { -cells..cells } else { 0..cells });
    let square = [[0, 0], [1, 0], [1, 1], [0, 1]];
    let mut hexes: Vec<[u32; 8]> = Vec::new();
    for k in ranges[2].clone() {
        for j in ranges[1].clone() {
            for i in ranges[0].clone() {
                let corner = |c: usize| [i + square[c % 4][0], j + square[c % 4][1], k + (c / 4) as i32];
                hexes.push(std::array::from_fn(|c| node(corner(c), 0)));
            }
        }
    }
    for (axis, both) in whole.into_iter().enumerate() {
        let [b, c] = [(axis + 1) % 3, (axis + 2) % 3];
        for side in if both { vec![-cells, cells] } else { vec![cells] } {
            for layer in 0..layers {
                for q in ranges[c].clone() {
                    for p in ranges[b].clone() {
                        let corner = |k: usize| {
                            let [first, second] = square[k % 4];
                            let mut at = [side; 3];
                            (at[b], at[c]) = (p + first, q + second);
                            at
                        };
                        hexes.push(std::array::from_fn(|k| node(corner(k), layer + (k / 4) as i32)));
                    }
                }
            }
        }
    }
    for hex in &mut hexes {
        let along = |k: usize| [0, 1, 2].map(|c| points[hex[k] as usize][c] - points[hex[0] as usize][c]);
        let [a, b, c] = [along(1), along(3), along(4)];
        let volume = a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0]);
        if volume < 0.0 {
            hex.rotate_left(4);
        }
    }
    (points, hexes)
}

/// Makes a ball of a radius around the origin: `cells` cells from the centre to the side of an inner cube,
/// and `layers` layers around the cube.
pub fn ball_of_hexes(radius: f64, cells: i32, layers: i32) -> Hexes {
    const SIZE: f64 = 2.0;
    grown_hexes(cells, layers, SIZE, [true; 3], |x| {
        let largest = x.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let length = x.iter().map(|x| x * x).sum::<f64>().sqrt();
        // The shape goes from a bulging cube to a sphere.
        let round = 0.4 + 0.6 * (largest - 1.0).max(0.0) / (SIZE - 1.0);
        let scale = if largest > 0.0 { (1.0 - round) * 0.8 + round * largest / length } else { 1.0 };
        x.map(|x| x * scale * radius / SIZE)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_of_hexes_is_round_and_whole() {
        let (points, hexes) = ball_of_hexes(2.0, 2, 2);
        assert_eq!(hexes.len(), 4 * 4 * 4 + 6 * 16 * 2);
        let radius = |x: &[f64; 3]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
        let outer = points.iter().filter(|x| (radius(x) - 2.0).abs() < 1e-12).count();
        assert_eq!(outer, 6 * 16 + 2);
        assert!(points.iter().all(|x| radius(x) < 2.0 + 1e-12));
        assert!(hexes.iter().all(|hex| hex.iter().all(|&node| (node as usize) < points.len())));
    }
}
