//! How far shells are strained, to tell where linear elasticity at small strain no longer holds.
//!
//! In the plane: Biot strain U − I of the facet's corners, with F = R U. Across: the mean curvature κ of the discrete Kirchhoff triangle
//! (Batoz, Bathe, Ho 1980), whose strain at the surfaces is ± κ t/2.
//! Leaves out: variation within a facet, shear across the thickness.

use nalgebra::Vector3;

/// The strain of a facet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShellStrain {
    /// The principal strain of the middle surface that is farther from zero, its size.
    pub membrane: f64,
    /// The same of top or bottom, whichever is larger.
    pub surface: f64,
}

impl ShellStrain {
    /// Of strains (εxx, εyy, γxy) in the middle and curvatures (κxx, κyy, 2 κxy) [1/m] of a wall of a thickness [m].
    pub(crate) fn new(strain: &Vector3<f64>, curvature: &Vector3<f64>, thickness: f64) -> Self {
        let [top, bottom] = [0.5, -0.5].map(|part| largest(&(strain + part * thickness * curvature)));
        Self { membrane: largest(strain), surface: top.max(bottom) }
    }
}

/// The larger size of the two principal strains.
fn largest(strain: &Vector3<f64>) -> f64 {
    (0.5 * (strain.x + strain.y)).abs() + (0.5 * (strain.x - strain.y)).hypot(0.5 * strain.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rotation::exponential;
    use crate::state::State;
    use crate::tests::{model, strip};

    /// A plate stretched by 20 % and thinned to match, bent to a radius of 1 m at a thickness of 0.1 m, and turned by a radian: 20 % in the
    /// middle, exactly. Bent alone, κ t/2.
    #[test]
    fn stretch_and_bending_are_told_apart() {
        let model = model(strip(), 0.1);
        let turn = exponential(&Vector3::new(1.0, -2.0, 0.5).normalize());
        let mut state = State::at_rest(&model);
        for (x, r) in state.position.iter_mut().zip(&mut state.rotation) {
            *x = turn * Vector3::new(1.2 * x.x, 0.9 * x.y, 0.0);
            *r = turn;
        }
        for strain in state.shell_strains(&model) {
            assert!((strain.membrane - 0.2).abs() < 1e-12 && (strain.surface - 0.2).abs() < 1e-12);
        }
        let curvature = 1e-4;
        let mut state = State::at_rest(&model);
        for ((x, r), rest) in state.position.iter_mut().zip(&mut state.rotation).zip(model.places()) {
            x.z = 0.5 * curvature * rest.x * rest.x;
            *r = exponential(&Vector3::new(0.0, -curvature * rest.x, 0.0));
        }
        for strain in state.shell_strains(&model) {
            // Sagging stretches the middle by (κ x)²/2, up to 3e-7.
            let bending = strain.surface / (0.5 * 0.1 * curvature);
            assert!((bending - 1.0).abs() < 0.1, "{bending}");
        }
    }
}
