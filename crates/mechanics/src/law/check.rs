//! Checks that several laws make of their parameters.

use super::ParameterError;
use crate::tensor::{Vector, dot};

/// Finite and above zero.
pub(super) fn positive(key: &'static str, value: f64, unit: &str) -> Result<f64, ParameterError> {
    if value > 0.0 && value.is_finite() {
        return Ok(value);
    }
    let message = format!("`{key}` must be greater than 0{unit}, found {value}");
    Err(ParameterError { key, message, help: "otherwise the solid is not stable at rest".into() })
}

/// Finite and not below zero; `zero` says what zero means.
pub(super) fn not_negative(key: &'static str, value: f64, zero: &str) -> Result<f64, ParameterError> {
    if value >= 0.0 && value.is_finite() {
        return Ok(value);
    }
    let message = format!("`{key}` must be 0 Pa or more, found {value}");
    Err(ParameterError { key, message, help: zero.into() })
}

/// Finite.
pub(super) fn finite(key: &'static str, value: f64) -> Result<f64, ParameterError> {
    if value.is_finite() {
        return Ok(value);
    }
    let message = format!("`{key}` must be a finite number, found {value}");
    Err(ParameterError { key, message, help: "0 leaves the term out".into() })
}

/// The shear modulus that coefficients add up to; `formula` says how.
pub(super) fn shear_at_rest(key: &'static str, shear: f64, formula: &str) -> Result<f64, ParameterError> {
    if shear > 0.0 && shear.is_finite() {
        return Ok(shear);
    }
    let message = format!("the shear modulus at rest, {formula}, must be greater than 0 Pa, found {shear}");
    Err(ParameterError { key, message, help: "otherwise the solid is not stable at rest".into() })
}

/// Tolerance of axes for unit length and right angles.
const AXES_TOLERANCE: f64 = 1e-6;

/// Three unit directions at right angles, one per row.
pub(super) fn orthonormal(
    key: &'static str,
    axes: [Vector<f64>; 3],
) -> Result<[Vector<f64>; 3], ParameterError> {
    for i in 0..3 {
        for j in i..3 {
            let (product, expected) = (dot(axes[i], axes[j]), f64::from(u8::from(i == j)));
            if (product - expected).abs() <= AXES_TOLERANCE {
                continue;
            }
            let message = if i == j {
                format!("axis {} of `{key}` has the length {}, not 1", i + 1, product.sqrt())
            } else {
                format!("axes {} and {} of `{key}` are not at right angles: a·b = {product}", i + 1, j + 1)
            };
            let help = "give three unit vectors at right angles to six digits, for example [[0.6, 0.8, 0], [-0.8, 0.6, 0], [0, 0, 1]]";
            return Err(ParameterError { key, message, help: help.into() });
        }
    }
    Ok(axes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_off_by_more_than_the_tolerance_are_refused() {
        let turned = |by: f64| [[1.0, by, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert!(orthonormal("axes", turned(1e-7)).is_ok());
        assert!(orthonormal("axes", turned(1e-5)).is_err());
        assert!(orthonormal("axes", [[1.1, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]).is_err());
        assert!(orthonormal("axes", turned(f64::NAN)).is_err());
    }
}
