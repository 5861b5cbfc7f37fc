//! The barrier and smooth friction, as functions of one number.

/// The barrier b(g) = −ĝ (y − 1)² ln y with y = g/ĝ for gaps g below ĝ, and zero above (Li et al. 2020,
/// equation 6). This is the physical form of Li et al. 2023: with κ [Pa] in front, κ |b'| is a pressure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Barrier {
    /// The gap ĝ [m] below which it acts.
    pub distance: f64,
}

impl Barrier {
    /// Returns b [m] at a gap [m]; infinite for a gap of zero or less.
    pub fn energy(&self, gap: f64) -> f64 {
        let y = gap / self.distance;
        match y {
            _ if y >= 1.0 => 0.0,
            _ if y > 0.0 => -self.distance * (y - 1.0).powi(2) * y.ln(),
            _ => f64::INFINITY,
        }
    }

    /// b' at a gap [m] above 0: never positive.
    pub fn slope(&self, gap: f64) -> f64 {
        let y = gap / self.distance;
        if y >= 1.0 { 0.0 } else { -2.0 * (y - 1.0) * y.ln() - (y - 1.0).powi(2) / y }
    }

    /// b'' [1/m] at a gap [m] above 0: never negative.
    pub fn curvature(&self, gap: f64) -> f64 {
        let y = gap / self.distance;
        if y >= 1.0 {
            return 0.0;
        }
        (-2.0 * y.ln() - 4.0 * (y - 1.0) / y + ((y - 1.0) / y).powi(2)) / self.distance
    }
}

/// Coulomb's friction made smooth at a slip u below ε (Li et al. 2020, equation 18). Its potential is D = μ λ
/// f₀(u), and its force μ λ f₁(u) with f₁ = f₀'. The slip is the sum over a step. The limit is ε = ε_v h,
/// with ε_v the speed below which a sticking body creeps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slip {
    /// ε [m].
    pub creep: f64,
}

impl Slip {
    /// f₀ [m] at a slip [m] ≥ 0.
    pub fn energy(&self, slip: f64) -> f64 {
        let y = slip / self.creep;
        if y >= 1.0 { slip } else { self.creep * (y * y * (1.0 - y / 3.0) + 1.0 / 3.0) }
    }

    /// f₁ at a slip [m] ≥ 0: from 0 to 1.
    pub fn force(&self, slip: f64) -> f64 {
        slip * self.force_over_slip(slip)
    }

    /// f₁' [1/m] at a slip [m] ≥ 0: never negative, zero from ε on.
    pub fn slope(&self, slip: f64) -> f64 {
        (2.0 * (1.0 - slip / self.creep) / self.creep).max(0.0)
    }

    /// f₁/u [1/m] at a slip u ≥ 0 [m]: an upper bound of f₁' that is never negative.
    pub(crate) fn force_over_slip(&self, slip: f64) -> f64 {
        if slip >= self.creep { 1.0 / slip } else { (2.0 - slip / self.creep) / self.creep }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    fn reference() -> Value {
        let text = include_str!("../../../../lab/validation/data/coupling/ipc_primitives.json");
        serde_json::from_str(text).unwrap()
    }

    fn close(found: f64, wanted: &Value, tolerance: f64) -> bool {
        let wanted = wanted.as_f64().unwrap();
        (found - wanted).abs() <= tolerance * wanted.abs().max(f64::MIN_POSITIVE)
    }

    #[test]
    fn the_barrier_is_that_of_the_reference() {
        let reference = reference();
        for row in reference["barrier_table"].as_array().unwrap() {
            let number = |key: &str| row[key].as_f64().unwrap();
            let barrier = Barrier { distance: number("dhat") };
            let gap = number("y") * barrier.distance;
            let y = number("y");
            // Near y = 1 the factor (y − 1)² has lost the digits of the gap.
            let tolerance = if y < 0.95 { 1e-12 } else { 1e-9 };
            assert!(close(barrier.energy(gap), &row["b"], tolerance), "{row}");
            assert!(close(barrier.slope(gap), &row["b1"], tolerance), "{row}");
            assert!(close(barrier.curvature(gap), &row["b2"], tolerance), "{row}");
        }
        for row in reference["pressure_gap"].as_array().unwrap() {
            let number = |key: &str| row[key].as_f64().unwrap();
            let barrier = Barrier { distance: 50e-6 };
            let pressure = -number("kappa") * barrier.slope(number("gap_over_dhat") * 50e-6);
            assert!(close(pressure, &row["pressure"], 1e-9), "{row} {pressure}");
        }
    }

    #[test]
    fn friction_is_that_of_the_reference() {
        for row in reference()["friction"]["rows"].as_array().unwrap() {
            let number = |key: &str| row[key].as_f64().unwrap();
            let (slip, at) = (Slip { creep: number("eps") }, number("y"));
            assert!(close(slip.energy(at), &row["f0"], 1e-13), "{row}");
            assert!(close(slip.force(at), &row["f1"], 1e-13), "{row}");
            let wanted = row["f2"].as_f64().unwrap();
            assert!((slip.slope(at) - wanted).abs() <= 1e-13 * slip.slope(0.0), "{row}");
            assert!(close(slip.force_over_slip(at), &row["f1_over_y"], 1e-13), "{row}");
        }
    }

    #[test]
    fn the_barrier_begins_smoothly_and_has_no_end() {
        let barrier = Barrier { distance: 1e-3 };
        assert_eq!([barrier.energy(1e-3), barrier.slope(2e-3), barrier.curvature(1e-3)], [0.0; 3]);
        assert_eq!([barrier.energy(0.0), barrier.energy(-1.0)], [f64::INFINITY; 2]);
    }
}
