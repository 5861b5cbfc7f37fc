// Values of one instant of a run; twin of `Instant` in run.rs. The steps before and after it are Δt⁻ and Δt⁺,
// and h is their mean.

struct Instant {
    // Its number since the last one that was looked at.
    index: u32,
    // Where its row of the table begins.
    row: u32,
    // Actions at the instant: MOVES, MEASURES, STARTS.
    flags: u32,
    // Δt⁻ [s].
    before: f32,
    // Δt⁺/Δt⁻.
    ratio: f32,
    // Δt⁺ h [s²].
    push: f32,
    // 1/(Δt⁺ h) [1/s²].
    per_push: f32,
    // h/2 [s].
    half_mean: f32,
    // 1/(2 Δt⁺) [1/s].
    per_two_steps: f32,
    // Δt⁻/Δt⁺.
    inverse_ratio: f32,
    // 1/(2 h) [1/s].
    per_two_means: f32,
    // η, r and β/Δt⁻ of damping_force/mod.rs, all zero where internal forces do not damp.
    dissipation: f32,
    extrapolation: f32,
    stiffness: f32,
}

// Moves to the next instant.
const MOVES = 1u;
// Sums up energies and finds how far cells are deformed.
const MEASURES = 2u;
// Begins at velocities, which stand in place of the increments.
const STARTS = 4u;

// Entries of `findings`.
const BROKEN = 0u;
const OVERFLOWN = 1u;
const LEAST_VOLUME_RATIO = 2u;
const LARGEST_STRAIN = 3u;
const UNLISTED = 4u;

@group(0) @binding(0) var<uniform> instant: Instant;
// The first instants at which a cell is broken and a sum overflows. Then bits of the least J and of the
// largest |C − I|². Last, the first instant for which candidates for contact are to be listed anew.
@group(0) @binding(1) var<storage, read_write> findings: array<atomic<u32>, 5>;
// For each instant of a submission the factors of constraints and of loads, and the gravity of bodies.
@group(0) @binding(2) var<storage, read> table: array<f32>;

// Number of grips and of entries. Then p − Σ wᵢ Xᵢ [m] and the stiffness [N/m] of each grip, and the force
// [N] of each. Then entries in the order of nodes: a node, its weight wᵢ and its grip.
@group(0) @binding(3) var<storage, read_write> grips: array<vec4f>;

fn grip_count() -> u32 {
    return bitcast<u32>(grips[0].x);
}

fn grip_entries() -> u32 {
    return bitcast<u32>(grips[0].y);
}

// The first instant that is not sound, or waits for lists; all stands still there.
fn end() -> u32 {
    let sound = min(atomicLoad(&findings[BROKEN]), atomicLoad(&findings[OVERFLOWN]));
    // What waits for lists has not begun: not even forces are found there. The first instant has lists.
    return min(sound, max(atomicLoad(&findings[UNLISTED]), 1u) - 1u);
}

var<workgroup> ends: u32;

// The same for all invocations of a group, of which one reads it.
fn group_end(local: u32) -> u32 {
    if local == 0u {
        ends = end();
    }
    return workgroupUniformLoad(&ends);
}

fn does(flag: u32) -> bool {
    return (instant.flags & flag) != 0u;
}
