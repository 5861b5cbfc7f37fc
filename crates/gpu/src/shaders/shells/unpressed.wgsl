fn press(facet: u32, placed: Placed, corner: array<vec2f, 3>) {}
