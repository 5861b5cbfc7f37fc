//! Laws in plane stress, for thin walls: with the stretch λ₃ across the wall the stress across vanishes.
//!
//! In the frame of a wall C is known but for C₃₃ = λ₃². A law sees F = R with Rᵀ R = C, R upper triangular
//! (Cholesky). This R differs from the true F by a rotation, which does not affect the stress. λ₃ makes the
//! Kirchhoff stress across, λ₃² S₃₃, zero. A secant search over ln λ₃ finds it, with λ + 2μ as first slope.
//! An incompressible law has λ₃ = 1/√det C in the plane. Its pressure cancels S₃₃ without a search
//! (Holzapfel, *Nonlinear Solid Mechanics*, 6.3). So every law of the registry has its plane-stress version.

use super::tangent::{DIFFERENCE, by_differences};
use super::{AnyLaw, Deformation, SmallStrainModuli, Split};
use crate::Number;
use crate::tensor::{Symmetric, Tensor, Vector, dot};

/// A wall whose area falls below this part of that at rest counts as folded flat.
pub const FLAT_WALL: f64 = 1e-3;
/// The most steps of a search; a few are enough unless a law is ill-posed.
pub const MOST_SEARCHES: usize = 40;

/// The strain of a wall in its own plane, and Cholesky's factor R of C.
#[derive(Clone, Copy, Debug)]
pub struct InPlane<R> {
    /// C₁₁ − 1, C₂₂ − 1 and C₁₂.
    pub strain_twice: [R; 3],
    /// R₁₁ − 1, R₂₂ − 1 and R₁₂.
    factor: [R; 3],
}

impl<R: Number> InPlane<R> {
    /// Makes the strain from C₁₁ − 1, C₂₂ − 1 and C₁₂. Not a number where the wall is folded flat.
    #[inline(always)]
    pub(crate) fn from_strain_twice(strain_twice: [R; 3]) -> Self {
        // √(1 + x) − 1 = x/(1 + √(1 + x)), without cancellation. Written out: closures are not compiled for
        // lanes.
        let [xx, yy, xy] = strain_twice;
        let first = xx / (R::ONE + (R::ONE + xx).sqrt());
        let mixed = xy / (R::ONE + first);
        let left = yy - mixed * mixed;
        let second = left / (R::ONE + (R::ONE + left).sqrt());
        Self { strain_twice, factor: [first, second, mixed] }
    }

    /// From the changes of the two tangents, ∂u/∂X₁ and ∂u/∂X₂, and the tangents t at rest: C_ij − δ_ij =
    /// t_i·u_j + t_j·u_i + u_i·u_j.
    #[inline(always)]
    pub fn from_changes(tangents: &[Vector<R>; 2], changes: &[Vector<R>; 2]) -> Self {
        let ([t, s], [u, v]) = (*tangents, *changes);
        let twice = R::of(2.0);
        Self::from_strain_twice([
            twice.mul_add(dot(t, u), dot(u, u)),
            twice.mul_add(dot(s, v), dot(v, v)),
            dot(t, v) + dot(s, u) + dot(u, v),
        ])
    }

    /// Its numbers, to be kept.
    #[inline(always)]
    pub fn parts(&self) -> [R; 6] {
        let ([xx, yy, xy], [a, b, c]) = (self.strain_twice, self.factor);
        [xx, yy, xy, a, b, c]
    }

    /// From the numbers of [`parts`](Self::parts).
    #[inline(always)]
    pub fn from_parts([xx, yy, xy, a, b, c]: [R; 6]) -> Self {
        Self { strain_twice: [xx, yy, xy], factor: [a, b, c] }
    }

    /// Area now over area at rest, minus 1.
    #[inline(always)]
    pub fn area_change(&self) -> R {
        let [a, b, _] = self.factor;
        a.mul_add(b, a + b)
    }

    /// H of the gradient R with λ₃ − 1 across.
    #[inline(always)]
    pub fn displacement_gradient(&self, thickness_change: R) -> Tensor<R> {
        let ([a, b, mixed], o) = (self.factor, R::ZERO);
        Tensor([[a, mixed, o], [o, b, o], [o, o, thickness_change]])
    }

    /// λ₃ − 1 of a wall that keeps its volume.
    #[inline(always)]
    pub fn incompressible(&self) -> R {
        let change = self.area_change();
        -change / (R::ONE + change)
    }

    /// S₁₁, S₂₂ and S₁₂ without the stress across: S − w λ₃² S₃₃ C⁻¹. With w = 1 this is the effect of the
    /// pressure of an incompressible law. With w = λ/(λ + 2μ) it removes the stress that the search for λ₃
    /// has left.
    #[inline(always)]
    pub fn without_stress_across(&self, stress: &Symmetric<R>, thickness_change: R, w: R) -> [R; 3] {
        let [xx, yy, xy] = self.strain_twice;
        let area = R::ONE + self.area_change();
        let pressure = w * kirchhoff_across(stress, thickness_change) / (area * area);
        [
            stress.0[0] - pressure * (R::ONE + yy),
            stress.0[1] - pressure * (R::ONE + xx),
            stress.0[3] + pressure * xy,
        ]
    }
}

/// λ₃² S₃₃ [Pa].
#[inline(always)]
pub fn kirchhoff_across<R: Number>(stress: &Symmetric<R>, thickness_change: R) -> R {
    let stretch = R::ONE + thickness_change;
    stretch * stretch * stress.0[2]
}

/// The elastic constants at rest that a search begins with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Across {
    /// λ + 2μ [Pa]; infinite of an incompressible law.
    pub modulus: f64,
    /// λ/(λ + 2μ), the ratio of thinning to growth of area of a wall; 1 for an incompressible law.
    pub coupling: f64,
}

/// The search for λ₃ at a point, or at as many as lie side by side.
#[derive(Clone, Copy, Debug)]
pub struct ThicknessSearch<R> {
    /// λ₃ − 1.
    pub change: R,
    /// ∂τ/∂ ln λ₃ [Pa], τ the Kirchhoff stress across.
    slope: R,
    /// τ [Pa] of the last step.
    last: R,
    /// Last change of ln λ₃.
    moved: R,
}

impl<R: Number> ThicknessSearch<R> {
    /// Begins at what small strains have: ln λ₃ = −λ/(λ + 2μ) ln(area ratio).
    #[inline(always)]
    pub fn new(plane: &InPlane<R>, across: Across) -> Self {
        let mut search =
            Self { change: R::ZERO, slope: R::of(across.modulus), last: R::ZERO, moved: R::ZERO };
        search.go(R::of(across.coupling) * plane.area_change().ln_1p());
        search.moved = R::ZERO;
        search
    }

    /// Its numbers, to be kept.
    #[inline(always)]
    pub fn parts(&self) -> [R; 4] {
        [self.change, self.slope, self.last, self.moved]
    }

    /// From the numbers of [`parts`](Self::parts).
    #[inline(always)]
    pub fn from_parts([change, slope, last, moved]: [R; 4]) -> Self {
        Self { change, slope, last, moved }
    }

    /// Takes λ₃ down by a step of ln λ₃, at most 1.
    #[inline(always)]
    fn go(&mut self, step: R) {
        let one = R::ONE;
        let step = (-((-step).max(-one))).max(-one);
        // e^(−x) = (2 − x)/(2 + x) up to x³/12.
        let factor = -(step + step) / (R::of(2.0) + step);
        self.change = self.change.mul_add(one + factor, factor);
        self.moved = -step;
    }

    /// Takes up τ [Pa] at the present λ₃ and makes a step; the size of that step.
    #[inline(always)]
    pub fn improve(&mut self, stress: R) -> R {
        // The secant, weighted against the slope so far where the last step is of the size of round-off.
        let weight = R::of(1e-14);
        let (moved, before) = (self.moved, self.slope);
        let secant = ((stress - self.last) * moved + before * weight) / (moved * moved + weight);
        // Never the wrong way, nor much farther than the slope so far asks for.
        self.slope = secant.max(before * R::of(0.1));
        self.last = stress;
        let step = stress / self.slope;
        self.go(step);
        step
    }
}

/// A point of a wall in plane stress.
#[derive(Clone, Copy, Debug)]
pub struct PlaneStress {
    /// λ₃ − 1.
    pub thickness_change: f64,
    /// The deformation that the law sees, in the frame of the wall.
    pub deformation: Deformation<f64>,
    /// Second Piola–Kirchhoff stress S₁₁, S₂₂ and S₁₂ [Pa].
    pub stress: [f64; 3],
    /// Strain energy per volume at rest [J/m³].
    pub energy: f64,
}

impl AnyLaw {
    /// True if the law keeps the volume (ν = ½); only walls in plane stress can do this.
    pub fn is_incompressible(&self) -> bool {
        self.small_strain().bulk.is_infinite()
    }

    /// The elastic constants across a wall at rest.
    pub fn across(&self) -> Across {
        let moduli = self.small_strain();
        if self.is_incompressible() {
            return Across { modulus: f64::INFINITY, coupling: 1.0 };
        }
        let modulus = moduli.bulk + 4.0 / 3.0 * moduli.shear;
        Across { modulus, coupling: (moduli.bulk - 2.0 / 3.0 * moduli.shear) / modulus }
    }

    /// An upper bound of ρc² [Pa] of a wall over all directions at rest: E/(1 − ν²), plus the part of fibres.
    /// In the plane an incompressible fibre strains by its whole stretch, in a solid by 2/3. The part of
    /// fibres is therefore 9/4 of their part in a solid.
    pub(crate) fn plane_modulus(&self) -> f64 {
        let SmallStrainModuli { shear, bulk } = self.small_strain();
        let first = bulk - 2.0 / 3.0 * shear;
        let fraction = if bulk.is_infinite() { 1.0 } else { (first + shear) / (first + 2.0 * shear) };
        4.0 * shear * fraction + 2.25 * self.fibre_modulus()
    }

    /// The wall's stress, energy and stretch across at C₁₁ − 1, C₂₂ − 1 and C₁₂; fibres in the frame of the
    /// wall.
    pub fn plane_stress(&self, strain_twice: [f64; 3], fibres: &[Vector<f64>]) -> PlaneStress {
        let plane = InPlane::from_strain_twice(strain_twice);
        let across = self.across();
        let at = |change: f64| Deformation::from_displacement_gradient(&plane.displacement_gradient(change));
        if self.is_incompressible() {
            let change = plane.incompressible();
            let deformation = at(change);
            let stress = self.stress(&deformation, fibres).isochoric;
            let energy = self.energy(&deformation, fibres).isochoric;
            let stress = plane.without_stress_across(&stress, change, 1.0);
            return PlaneStress { thickness_change: change, deformation, stress, energy };
        }
        let total = |deformation: &Deformation<f64>| {
            let Split { isochoric, volumetric } = self.stress(deformation, fibres);
            isochoric + volumetric
        };
        let mut search = ThicknessSearch::new(&plane, across);
        let mut steps = 0;
        let (change, deformation, stress) = loop {
            let change = search.change;
            let deformation = at(change);
            let stress = total(&deformation);
            let step = search.improve(kirchhoff_across(&stress, change)).abs();
            steps += 1;
            if step <= f64::EPSILON * change.abs().max(f64::EPSILON) || steps == MOST_SEARCHES {
                break (change, deformation, stress);
            }
        };
        let energy = self.energy(&deformation, fibres);
        PlaneStress {
            thickness_change: change,
            deformation,
            stress: plane.without_stress_across(&stress, change, across.coupling),
            energy: energy.isochoric + energy.volumetric,
        }
    }

    /// D = ∂S/∂ε [Pa] of a wall, ε = (E₁₁, E₂₂, 2E₁₂), by central differences, symmetric.
    pub fn plane_tangent(&self, strain_twice: [f64; 3], fibres: &[Vector<f64>]) -> [[f64; 3]; 3] {
        by_differences(|component, sign| {
            // A change of E₁₁ by h changes C₁₁ by 2h, one of 2E₁₂ by h changes C₁₂ by h.
            let by = if component == 2 { DIFFERENCE } else { 2.0 * DIFFERENCE };
            let mut moved = strain_twice;
            moved[component] += sign * by;
            self.plane_stress(moved, fibres).stress
        })
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::super::samples::{every_law, law};
    use super::*;

    const FIBRES: [Vector<f64>; 2] = [[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0]];
    /// C₁₁ − 1, C₂₂ − 1 and C₁₂: stretch, compression, shear, general, small.
    const STRAINS: [[f64; 3]; 5] =
        [[0.44, 0.21, 0.0], [-0.36, 0.1, 0.05], [0.0, 0.36, 0.6], [0.8, -0.3, 0.4], [2e-7, -1e-7, 3e-7]];

    fn of(name: &str, parameters: Value) -> AnyLaw {
        law(name, parameters)
    }

    fn neo_hookean() -> AnyLaw {
        of("neo-hookean", json!({ "young-modulus": 3.0, "poisson-ratio": 0.5 }))
    }

    fn mooney_rivlin(c10: f64, c01: f64) -> AnyLaw {
        of("mooney-rivlin", json!({ "c10": c10, "c01": c01, "poisson-ratio": 0.5 }))
    }

    /// Every sample, and the split ones without change of volume.
    fn laws() -> Vec<AnyLaw> {
        let half = |mut parameters: Value| {
            parameters["poisson-ratio"] = json!(0.5);
            parameters
        };
        let mut laws = every_law();
        laws.extend([
            neo_hookean(),
            mooney_rivlin(0.4, 0.1),
            of("yeoh", half(json!({ "c1": 0.3, "c2": 0.1, "c3": 0.05 }))),
            of("ogden", half(json!({ "terms": [{ "shear-modulus": 0.5, "exponent": 2.5 }] }))),
            of(
                "transversely-isotropic",
                half(json!({ "young-modulus": 3.0, "fibre-modulus": 1.1 })),
            ),
            of(
                "holzapfel-gasser-ogden",
                half(json!({
                    "young-modulus": 3.0, "fibre-modulus": 0.9, "fibre-exponent": 0.8, "dispersion": 0.12, "families": 2
                })),
            ),
        ]);
        laws
    }

    fn fibres(law: &AnyLaw) -> &'static [Vector<f64>] {
        &FIBRES[..law.families()]
    }

    #[test]
    fn nothing_pulls_across_a_wall() {
        for law in laws() {
            for strain in STRAINS {
                let found = law.plane_stress(strain, fibres(&law));
                let stress = law.stress(&found.deformation, fibres(&law));
                let size = found.stress.into_iter().fold(0.0_f64, |a, s| a.max(s.abs()));
                if law.is_incompressible() {
                    assert!((found.deformation.volume_ratio - 1.0).abs() < 1e-14, "{law:?}");
                } else {
                    let across = (stress.isochoric + stress.volumetric).0[2];
                    assert!(
                        across.abs() < 1e-12 * size.max(1e-6),
                        "{law:?} at {strain:?}: {across:e} of {size:e}"
                    );
                }
            }
        }
    }

    #[test]
    fn stress_is_the_derivative_of_energy_and_the_tangent_that_of_the_stress() {
        for law in laws() {
            // Fibres that carry tension only have a kink at rest.
            let strains = if law.name() == "holzapfel-gasser-ogden" { &STRAINS[..4] } else { &STRAINS };
            for &strain in strains {
                let found = law.plane_stress(strain, fibres(&law));
                let tangent = law.plane_tangent(strain, fibres(&law));
                let stiff = tangent.as_flattened().iter().fold(0.0_f64, |a, d| a.max(d.abs()));
                for component in 0..3 {
                    let at = |by: f64| {
                        let mut moved = strain;
                        moved[component] += by;
                        law.plane_stress(moved, fibres(&law))
                    };
                    let h = 1e-4;
                    let slope = |value: &dyn Fn(f64) -> f64| {
                        (8.0 * (value(h) - value(-h)) - (value(2.0 * h) - value(-2.0 * h))) / (12.0 * h)
                    };
                    // W as a function of C₁₁, C₂₂ and C₁₂ = C₂₁: S = 2 ∂W/∂C, twice for the shear.
                    let derivative = if component == 2 { 1.0 } else { 2.0 } * slope(&|by| at(by).energy);
                    let error = (derivative - found.stress[component]).abs();
                    assert!(error < 2e-8 * stiff, "{law:?} at {strain:?}: S{component} off by {error:e}");
                    for (row, entries) in tangent.iter().enumerate() {
                        let factor = if component == 2 { 1.0 } else { 2.0 };
                        let wanted = factor * slope(&|by| at(by).stress[row]);
                        let error = (wanted - entries[component]).abs();
                        assert!(
                            error < 1e-7 * stiff,
                            "{law:?} at {strain:?}: D{row}{component} off by {error:e}"
                        );
                    }
                }
            }
        }
    }

    /// A strip pulled along 1 with a free edge: first Piola–Kirchhoff stress λ S₁₁ and the stretch of its
    /// width.
    fn strip(law: &AnyLaw, stretch: f64) -> [f64; 2] {
        let across =
            |width: f64| law.plane_stress([stretch * stretch - 1.0, width * width - 1.0, 0.0], &[]).stress;
        let (mut low, mut high) = (0.2, 2.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if across(middle)[1] > 0.0 { high = middle } else { low = middle }
        }
        [stretch * across(low)[0], low]
    }

    #[test]
    fn strips_follow_their_closed_forms() {
        let logarithmic =
            of("logarithmic-neo-hookean", json!({ "shear-modulus": 1.0, "bulk-modulus": 14.0 / 3.0 }));
        for (law, stretch, wanted) in [
            (neo_hookean(), 0.8, -0.7625),
            (neo_hookean(), 1.5, 1.055_555_556),
            (neo_hookean(), 2.0, 1.75),
            (mooney_rivlin(0.4, 0.1), 0.8, -0.800_625),
            (mooney_rivlin(0.4, 0.1), 1.5, 0.985_185_185),
            (mooney_rivlin(0.4, 0.1), 2.0, 1.575),
            (logarithmic, 0.8, -0.689_439),
            (logarithmic, 1.5, 1.022_825),
            (logarithmic, 2.0, 1.720_817),
        ] {
            let [force, width] = strip(&law, stretch);
            assert!((force - wanted).abs() < 1e-6, "{law:?} at {stretch}: {force}");
            if law.is_incompressible() {
                assert!((width - stretch.powf(-0.5)).abs() < 1e-12);
            }
        }
        assert!((strip(&logarithmic, 1.5)[1] - 0.846_028).abs() < 1e-6);
        assert!((strip(&logarithmic, 2.0)[1] - 0.747_240).abs() < 1e-6);
    }

    /// Simple shear x₁ = X₁ + g X₂: P₁₂, the force per length over the thickness at rest.
    #[test]
    fn simple_shear_follows_its_closed_forms() {
        let g = 0.6;
        let split = of("neo-hookean", json!({ "shear-modulus": 1.0, "bulk-modulus": 20.0 }));
        for (law, wanted) in [(neo_hookean(), 0.6), (mooney_rivlin(0.4, 0.1), 0.6), (split, 0.597_780)] {
            let found = law.plane_stress([0.0, g * g, g], &[]);
            let [_, yy, xy] = found.stress;
            let shear = xy + g * yy;
            assert!((shear - wanted).abs() < 1e-6, "{law:?}: {shear}");
        }
    }

    /// An inflated sphere: p R₀/(μ t₀) = (2/λ) S(λ) of the equal stretch, its maxima and minima.
    #[test]
    fn spheres_have_their_limit_points() {
        let pressure =
            |law: &AnyLaw, l: f64| 2.0 / l * law.plane_stress([l * l - 1.0, l * l - 1.0, 0.0], &[]).stress[0];
        let neo_hookean = neo_hookean();
        for (l, wanted) in [(1.1, 0.79187), (1.3831, 1.23946), (2.0, 0.98438), (3.0, 0.66575), (5.0, 0.39997)]
        {
            assert!((pressure(&neo_hookean, l) - wanted).abs() < 1e-5, "{l}");
        }
        let limit = 7.0_f64.powf(1.0 / 6.0);
        assert!((pressure(&neo_hookean, limit) - 1.239_463).abs() < 1e-6);
        assert!(pressure(&neo_hookean, limit - 1e-3) < pressure(&neo_hookean, limit));
        assert!(pressure(&neo_hookean, limit + 1e-3) < pressure(&neo_hookean, limit));
        let mooney = mooney_rivlin(0.5 / 1.1, 0.05 / 1.1);
        for (l, wanted) in [
            (1.1, 0.80698),
            (1.3831, 1.34233),
            (1.47607, 1.355_107),
            (2.0, 1.25284),
            (3.14262, 1.148_748),
            (5.0, 1.27265),
        ] {
            assert!((pressure(&mooney, l) - wanted).abs() < 2e-5, "{l}: {}", pressure(&mooney, l));
        }
    }

    #[test]
    fn the_plane_modulus_bounds_every_direction_at_rest() {
        for law in laws() {
            let bound = law.plane_modulus();
            let d = law.plane_tangent([0.0; 3], fibres(&law));
            let largest = |n: f64, m: f64| {
                let ([a, b], [c, e]) = ([n.cos(), n.sin()], [m.cos(), m.sin()]);
                let strain = [a * c, b * e, a * e + b * c];
                (0..3).map(|i| (0..3).map(|j| strain[i] * d[i][j] * strain[j]).sum::<f64>()).sum::<f64>()
            };
            let angles = || (0..60).map(|k| f64::from(k) * std::f64::consts::PI / 60.0);
            let most = angles().flat_map(|n| angles().map(move |m| (n, m))).map(|(n, m)| largest(n, m));
            let most = most.fold(0.0, f64::max);
            // Laws with axes of their own are refused for membranes.
            if law.name() != "fung-orthotropic" {
                assert!(most <= bound * (1.0 + 1e-7), "{law:?}: {most} above {bound}");
            }
        }
    }

    #[test]
    fn single_precision_keeps_the_digits_of_small_strains() {
        let compressible = of("neo-hookean", json!({ "young-modulus": 3.0, "poisson-ratio": 0.3 }));
        let strain = [2e-5, -1e-5, 3e-5];
        let plane = InPlane::from_strain_twice(strain.map(|x| x as f32));
        let mut search = ThicknessSearch::new(&plane, compressible.across());
        for _ in 0..4 {
            let h = plane.displacement_gradient(search.change);
            let Split { isochoric, volumetric } =
                compressible.stress(&Deformation::<f32>::from_displacement_gradient(&h), &[]);
            search.improve(kirchhoff_across(&(isochoric + volumetric), search.change));
        }
        let exact = compressible.plane_stress(strain, &[]).thickness_change;
        assert!((f64::from(search.change) / exact - 1.0).abs() < 3e-6, "{} {exact}", search.change);
    }
}
