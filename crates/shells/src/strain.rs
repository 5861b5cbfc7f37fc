//! Strains of shells, a measure of where linear elasticity at small strain no longer holds.
//!
//! In the plane: Biot strain U − I of the facet's corners, with F = R U. Across: the mean curvature κ of the
//! discrete Kirchhoff triangle (Batoz, Bathe, Ho 1980), whose strain at the surfaces is ± κ t/2. Leaves out:
//! variation within a facet, shear across the thickness.

use nalgebra::Vector3;

/// The strain of a facet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShellStrain {
    /// The principal strain of the middle surface that is farther from zero, its size.
    pub membrane: f64,
    /// The larger principal strain of top and bottom by size, whichever side is larger.
    pub surface: f64,
}

impl ShellStrain {
    /// Finds the strain from strains (εxx, εyy, γxy) in the middle and curvatures (κxx, κyy, 2 κxy) [1/m] of
    /// a wall of a thickness [m].
    pub(crate) fn new(strain: &Vector3<f64>, curvature: &Vector3<f64>, thickness: f64) -> Self {
        let [top, bottom] = [0.5, -0.5].map(|part| largest(&(strain + part * thickness * curvature)));
        Self { membrane: largest(strain), surface: top.max(bottom) }
    }
}

/// The larger size of the two principal strains.
fn largest(strain: &Vector3<f64>) -> f64 {
    (0.5 * (strain.x + strain.y)).abs() + (0.5 * (strain.x - strain.y)).hypot(0.5 * strain.z)
}
