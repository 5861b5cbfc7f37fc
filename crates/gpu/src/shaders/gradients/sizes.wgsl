// What belongs to a pattern, and a pivot; twin of `Sizes` in gradients.rs.
struct Sizes {
    // The aggregate whose motions the inversion eliminates.
    pivot: u32,
    nodes: u32,
    aggregates: u32,
    // Groups of the product A p.
    chunks: u32,
    // Entries of the blocks of the matrix, and of its lower half.
    entries: u32,
    lower: u32,
    // Pairs of aggregates that touch.
    pairs: u32,
    // Whether the motions of aggregates are solved for.
    coarse: u32,
}

@group(0) @binding(0) var<uniform> sizes: Sizes;
