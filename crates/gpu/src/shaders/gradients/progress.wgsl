// How far conjugate gradients are: side `now` while an iteration runs, side `next` written at its end.
struct Progress {
    // r·z.
    product: f32,
    // r·r, and where to stop.
    residual: f32,
    goal: f32,
    // Iterations done, and the most.
    done: u32,
    most: u32,
    // 0 before r·z is known for the first time.
    started: u32,
    // 0: the iterations continue; 1: the goal is reached; 2: no iterations are left; 3: a direction without
    // positive stiffness.
    end: u32,
    unused: u32,
}
