// The average of volume changes becomes a pressure.
fn averaged(mean: f32, node: u32) -> f32 {
    return relaxed_pressure(mean, node);
}
