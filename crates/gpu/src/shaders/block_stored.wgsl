// The shape at rest is stored.
fn load_rest(to: u32, node: u32) {}
