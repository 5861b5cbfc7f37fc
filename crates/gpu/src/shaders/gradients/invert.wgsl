// One pivot of the inversion of the coarse matrix in place, block by block (Gauss and Jordan), without
// exchanges: it is positive definite.
@group(1) @binding(0) var<storage, read> now: array<f32>;
@group(1) @binding(1) var<storage, read_write> next: array<f32>;

// [a b; c d] of 3 × 3 parts.
struct Block {
    a: mat3x3f,
    b: mat3x3f,
    c: mat3x3f,
    d: mat3x3f,
}

// From one entry of a block to the next.
fn stride() -> u32 {
    return sizes.aggregates * sizes.aggregates;
}

fn part(at: u32, row: u32, column: u32) -> mat3x3f {
    let next_entry = stride();
    let base = at + (6u * column + row) * next_entry;
    return mat3x3f(
        now[base], now[base + next_entry], now[base + 2u * next_entry],
        now[base + 6u * next_entry], now[base + 7u * next_entry], now[base + 8u * next_entry],
        now[base + 12u * next_entry], now[base + 13u * next_entry], now[base + 14u * next_entry],
    );
}

fn block(row: u32, column: u32) -> Block {
    let at = row * sizes.aggregates + column;
    return Block(part(at, 0u, 0u), part(at, 0u, 3u), part(at, 3u, 0u), part(at, 3u, 3u));
}

fn put_part(at: u32, row: u32, column: u32, m: mat3x3f) {
    let next_entry = stride();
    let to = at + (6u * column + row) * next_entry;
    next[to] = m[0].x;
    next[to + next_entry] = m[0].y;
    next[to + 2u * next_entry] = m[0].z;
    next[to + 6u * next_entry] = m[1].x;
    next[to + 7u * next_entry] = m[1].y;
    next[to + 8u * next_entry] = m[1].z;
    next[to + 12u * next_entry] = m[2].x;
    next[to + 13u * next_entry] = m[2].y;
    next[to + 14u * next_entry] = m[2].z;
}

fn product(l: Block, r: Block) -> Block {
    return Block(l.a * r.a + l.b * r.c, l.a * r.b + l.b * r.d, l.c * r.a + l.d * r.c, l.c * r.b + l.d * r.d);
}

// The inverse of a pivot; zero where only round-off is left in the pivot, as about axes without stiffness.
fn over(pivot: f32, whole: f32) -> f32 {
    return select(0.0, 1.0 / pivot, pivot > 1e-6 * whole);
}

// The inverse of a symmetric matrix by L D Lᵀ; `whole` has its diagonal before other parts were taken off.
fn inverse_of_part(m: mat3x3f, whole: vec3f) -> mat3x3f {
    let d = over(m[0].x, whole.x);
    let l = m[0].y * d;
    let k = m[0].z * d;
    let e = over(m[1].y - l * m[0].y, whole.y);
    let n = (m[1].z - k * m[0].y) * e;
    let f = over(m[2].z - k * m[0].z - n * (m[1].z - k * m[0].y), whole.z);
    // L⁻¹ = [1 0 0; −l 1 0; q −n 1].
    let q = l * n - k;
    let xy = -l * e - q * n * f;
    let xz = q * f;
    let yz = -n * f;
    return mat3x3f(d + l * l * e + q * q * f, xy, xz, xy, e + n * n * f, yz, xz, yz, f);
}

fn diagonal(m: mat3x3f) -> vec3f {
    return vec3f(m[0].x, m[1].y, m[2].z);
}

fn inverse(m: Block) -> Block {
    let a = inverse_of_part(m.a, diagonal(m.a));
    let ab = a * m.b;
    let s = inverse_of_part(m.d - m.c * ab, diagonal(m.d));
    let b = -1.0 * (ab * s);
    return Block(a - b * transpose(ab), b, transpose(b), s);
}

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let at = number(group, groups, local);
    if at >= stride() {
        return;
    }
    let row = at / sizes.aggregates;
    let column = at % sizes.aggregates;
    let own = sizes.pivot;
    let p = inverse(block(own, own));
    var result = p;
    if row == own && column != own {
        result = product(p, block(own, column));
    } else if row != own && column == own {
        result = product(block(row, own), p);
        result = Block(-1.0 * result.a, -1.0 * result.b, -1.0 * result.c, -1.0 * result.d);
    } else if row != own {
        let old = block(row, column);
        let off = product(block(row, own), product(p, block(own, column)));
        result = Block(old.a - off.a, old.b - off.b, old.c - off.c, old.d - off.d);
    }
    put_part(at, 0u, 0u, result.a);
    put_part(at, 0u, 3u, result.b);
    put_part(at, 3u, 0u, result.c);
    put_part(at, 3u, 3u, result.d);
}
