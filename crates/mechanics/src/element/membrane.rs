//! The triangle of a membrane: constant strain in its plane, no resistance to bending.

use super::Rest;
use crate::tensor::{Vector, cross, dot, scale, sub};

/// Two unit vectors at right angles in the plane of a triangle at rest: the frame in which its law works.
pub type Axes = [Vector<f64>; 2];

/// Properties of a triangle of a membrane in addition to its gradients and volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheet {
    /// The frame of the triangle at rest, its first axis along the first edge.
    pub axes: Axes,
    /// Thickness at rest [m].
    pub thickness: f64,
}

/// The rest quantities of a triangle from its nodes [m] and its thickness [m]. Gradients are in the plane of
/// the triangle; the volume is the volume of the wall.
pub fn membrane(x: &[Vector<f64>; 3], thickness: f64) -> (Rest<3>, Sheet) {
    let [a, b] = [sub(x[1], x[0]), sub(x[2], x[0])];
    let normal = cross(a, b);
    let twice_area = dot(normal, normal).sqrt();
    let normal = scale(normal, 1.0 / twice_area);
    let along = scale(a, 1.0 / dot(a, a).sqrt());
    // The gradient of a corner is the edge opposite to it, turned by a right angle, over twice the area.
    let opposite = [sub(x[2], x[1]), sub(x[0], x[2]), sub(x[1], x[0])];
    let gradient = opposite.map(|edge| scale(cross(normal, edge), 1.0 / twice_area));
    let axes = [along, cross(normal, along)];
    (Rest { volume: 0.5 * twice_area * thickness, gradient }, Sheet { axes, thickness })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradients_are_those_of_the_shape_functions() {
        let x = [[0.1, 0.2, 0.3], [0.4, 0.1, 0.5], [0.2, 0.6, 0.1]];
        let (rest, Sheet { axes: [t, s], .. }) = membrane(&x, 0.01);
        for a in 0..3 {
            for b in 0..3 {
                let change = dot(rest.gradient[a], sub(x[b], x[0])) - dot(rest.gradient[a], sub(x[a], x[0]));
                let wanted = if a == b { 0.0 } else { -1.0 };
                assert!((change - wanted).abs() < 1e-14, "{a} {b}: {change}");
            }
        }
        assert!(dot(t, s).abs() < 1e-15 && (dot(s, s) - 1.0).abs() < 1e-15);
        let normal = cross(sub(x[1], x[0]), sub(x[2], x[0]));
        assert!((rest.volume - 0.005 * dot(normal, normal).sqrt()).abs() < 1e-17);
        assert!(dot(normal, cross(t, s)) > 0.0);
    }
}
