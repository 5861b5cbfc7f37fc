// An average stays what it is.
fn averaged(mean: f32, node: u32) -> f32 {
    return mean;
}
