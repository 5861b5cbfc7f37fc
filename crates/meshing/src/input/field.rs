//! Bodies described by a function that is positive inside: the input of meshers of fields. Fields of
//! images are in `pliant-imaging`.

use pliant_geometry::Vector3;

/// A body as a function of space. Meshers evaluate it from several threads.
pub trait ImplicitField: Sync {
    /// Positive inside, negative outside, about the signed distance to the surface [m].
    fn value(&self, point: &Vector3) -> f64;

    /// Smallest and largest corner of a box that encloses the body [m].
    fn bounds(&self) -> (Vector3, Vector3);

    /// Gradient of the value, without unit: by central differences over a ten-thousandth of the box unless
    /// the field knows better.
    fn gradient(&self, point: &Vector3) -> Vector3 {
        let (low, high) = self.bounds();
        let step = 1e-4 * (high - low).amax();
        Vector3::from_fn(|axis, _| {
            let mut shift = Vector3::zeros();
            shift[axis] = step;
            (self.value(&(point + shift)) - self.value(&(point - shift))) / (2.0 * step)
        })
    }

    /// The value and its gradient, for fields that find both at once.
    fn value_and_gradient(&self, point: &Vector3) -> (f64, Vector3) {
        (self.value(point), self.gradient(point))
    }
}

impl<F: ImplicitField + ?Sized> ImplicitField for &F {
    fn value(&self, point: &Vector3) -> f64 {
        (**self).value(point)
    }

    fn bounds(&self) -> (Vector3, Vector3) {
        (**self).bounds()
    }

    fn gradient(&self, point: &Vector3) -> Vector3 {
        (**self).gradient(point)
    }

    fn value_and_gradient(&self, point: &Vector3) -> (f64, Vector3) {
        (**self).value_and_gradient(point)
    }
}

/// An ellipsoid with its axes along x, y and z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipsoid {
    /// Centre [m].
    pub centre: Vector3,
    /// Half axes along x, y and z [m].
    pub radii: Vector3,
}

impl Ellipsoid {
    /// A sphere: all half axes are `radius` [m].
    pub fn sphere(centre: Vector3, radius: f64) -> Self {
        Self { centre, radii: Vector3::repeat(radius) }
    }
}

impl ImplicitField for Ellipsoid {
    fn value(&self, point: &Vector3) -> f64 {
        ellipsoid_value(&(point - self.centre), &self.radii, 0.0)
    }

    fn bounds(&self) -> (Vector3, Vector3) {
        (self.centre - self.radii, self.centre + self.radii)
    }
}

/// First-order distance to an ellipsoid: q (1 − q) / (g + guard), q = ‖p / r‖, g = ‖p / r²‖.
/// The quotient has no limit at the centre; there it is the smallest radius, the true distance.
pub(crate) fn ellipsoid_value(from_centre: &Vector3, radii: &Vector3, guard: f64) -> f64 {
    let scaled = from_centre.component_div(radii);
    let q = scaled.norm();
    if q == 0.0 {
        return radii.min();
    }
    let g = scaled.component_div(radii).norm();
    q * (1.0 - q) / (g + guard)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sphere_gives_the_exact_distance() {
        let sphere = Ellipsoid::sphere(Vector3::new(0.1, 0.2, 0.3), 0.05);
        for distance in [0.001, 0.02, 0.05, 0.07] {
            let point = sphere.centre + distance * Vector3::new(0.6, 0.0, 0.8);
            assert!((sphere.value(&point) - (0.05 - distance)).abs() < 1e-15);
        }
        assert_eq!(sphere.value(&sphere.centre), 0.05);
    }

    #[test]
    fn an_ellipsoid_is_zero_on_its_surface_with_unit_slope() {
        let body = Ellipsoid { centre: Vector3::zeros(), radii: Vector3::new(0.06, 0.08, 0.05) };
        let on_surface = Vector3::new(0.06 * 0.48, 0.08 * 0.6, 0.05 * 0.64);
        assert!(body.value(&on_surface).abs() < 1e-15);
        let normal = on_surface.component_div(&body.radii.component_mul(&body.radii)).normalize();
        let slope = body.value(&(on_surface - 1e-6 * normal)) / 1e-6;
        assert!((slope - 1.0).abs() < 1e-3, "{slope}");
    }
}
