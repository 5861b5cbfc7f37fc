//! Positions and values as shaders take them.

use pliant_geometry::Vector3;

/// Marks a missing value. Neither this value nor an interpolation with it takes a colour of the map. NaN does
/// not serve, because shaders may replace it by any number.
const NO_VALUE: f32 = 1e38;

/// A value for the shader; for a non-finite one the colour is grey.
pub fn drawn_value(value: f64) -> f32 {
    if value.is_finite() { value.clamp(-1e29, 1e29) as f32 } else { NO_VALUE }
}

/// A position and a value as the shader takes them.
pub(crate) fn staged(point: &Vector3, value: f64) -> [f32; 4] {
    [point.x as f32, point.y as f32, point.z as f32, drawn_value(value)]
}
