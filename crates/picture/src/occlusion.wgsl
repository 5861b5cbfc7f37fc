// Ambient occlusion on the screen, in a map that is coarser than the picture. It is the part of the light
// from all sides that reaches a place. The estimator is by McGuire, Mara and Luebke (2012, Scalable ambient
// obscurance). Flat, convex or slightly folded surfaces do not change.

struct Solid {
    // Position [m], and 1.
    @location(0) place: vec4<f32>,
    // Normal towards the eye.
    @location(1) facing: vec4<f32>,
}

fn solid_at(at: Corner, front: bool) -> Solid {
    return Solid(vec4(at.position, 1.0), vec4(seen_normal(at, front, towards_eye(at.position)), 0.0));
}

@fragment
fn solid(at: Corner, @builtin(front_facing) front: bool) -> Solid {
    let result = solid_at(at, front);
    if is_behind(at) || opacity_at(at, 1.0) < 0.004 || dot(view.plane.xyz, at.place) > view.plane.w {
        discard;
    }
    return result;
}

@fragment
fn solid_cut(at: Corner, @builtin(front_facing) front: bool) -> Solid {
    return solid_at(at, front);
}

@group(1) @binding(0) var places: texture_2d<f32>;
@group(1) @binding(1) var facings: texture_2d<f32>;

// Samples on a spiral, and the cosine and sine of the angle from one to the next (five turns in all).
const SAMPLES: i32 = 12;
const ONWARD: vec2<f32> = vec2(-0.8660254, 0.5);
// Turn of the sample spiral from one pixel to the next in a block of four by four. The light is smoothed over
// such a block.
const TURN: f32 = 0.39269908;
// Chosen by eye, in the pictures of the gallery.
const STRENGTH: f32 = 8.0;
// Slope below which a surface hides nothing: triangles of a round surface meet at such angles.
const FLAT: f32 = 0.2;
// Added to squared distances over the reach. Places nearer than its root hide less, as single triangles do.
const NEAR: f32 = 0.05;
// Depth of empty places, over the reach.
const NOWHERE: f32 = -6.0e4;

// Light that reaches the surface, and its depth over the reach.
@fragment
fn occlusion(at: Sky) -> @location(0) vec2<f32> {
    let pixel = vec2<i32>(at.clip.xy);
    let own = textureLoad(places, pixel, 0);
    if own.w == 0.0 {
        return vec2(1.0, NOWHERE);
    }
    let normal = textureLoad(facings, pixel, 0).xyz;
    let last = vec2<i32>(textureDimensions(places)) - 1;
    let reach = pixels_of_reach(own.xyz);
    let spin = f32((pixel.x & 3) + 4 * (pixel.y & 3)) * TURN;
    var along = vec2(cos(spin), sin(spin));
    var hidden = 0.0;
    for (var sample = 0; sample < SAMPLES; sample++) {
        let part = (f32(sample) + 0.5) / f32(SAMPLES);
        let to = clamp(pixel + vec2<i32>(round(along * (reach * part))), vec2(0), last);
        along = vec2(along.x * ONWARD.x - along.y * ONWARD.y, along.x * ONWARD.y + along.y * ONWARD.x);
        let other = textureLoad(places, to, 0);
        let way = (other.xyz - own.xyz) / view.occlusion.y;
        let square = dot(way, way);
        let near = max(1.0 - square, 0.0) * other.w;
        hidden += near * near * near * max(dot(way, normal) - FLAT * sqrt(square), 0.0) / (square + NEAR);
    }
    return vec2(max(1.0 - hidden * STRENGTH / f32(SAMPLES), 0.0), depth_over_reach(own.xyz));
}

// Pixels of the map that the reach has at a place.
fn pixels_of_reach(place: vec3<f32>) -> f32 {
    let away = dot(view.eye.xyz - place, view.towards.xyz);
    return view.occlusion.z / select(1.0, max(away, 1.0e-9), view.eye.w > 0.5);
}

fn depth_over_reach(place: vec3<f32>) -> f32 {
    return clamp(dot(place - view.eye.xyz, view.towards.xyz) / view.occlusion.y + view.occlusion.w, -5.0e4, 5.0e4);
}

@group(1) @binding(0) var rough: texture_2d<f32>;

// The mean over four by four pixels, which removes the pattern of the spirals. Pixels at another depth do not
// count.
@fragment
fn smoothed(at: Sky) -> @location(0) vec2<f32> {
    let pixel = vec2<i32>(at.clip.xy);
    let own = textureLoad(rough, pixel, 0).xy;
    if own.y == NOWHERE {
        return own;
    }
    let last = vec2<i32>(textureDimensions(rough)) - 1;
    var sum = vec2(0.0);
    for (var index = 0; index < 16; index++) {
        let to = clamp(pixel + vec2(index & 3, index >> 2u) - 2, vec2(0), last);
        let other = textureLoad(rough, to, 0);
        sum += max(1.0 - abs(other.y - own.y), 0.0) * vec2(other.x, 1.0);
    }
    return vec2(sum.x / sum.y, own.y);
}

@group(2) @binding(0) var occluded: texture_2d<f32>;

// Part of the light from all sides that reaches a place; all where the map has something else in front or
// behind.
fn light_at(place: vec3<f32>) -> f32 {
    if view.occlusion.x == 0.0 {
        return 1.0;
    }
    let clip = view.projection_view * vec4(place, 1.0);
    let size = vec2<i32>(textureDimensions(occluded));
    // A mean of the map lies half a pixel before the middle of its own.
    let at = (clip.xy / clip.w * vec2(0.5, -0.5) + 0.5) * vec2<f32>(size);
    let first = vec2<i32>(floor(at));
    let part = at - floor(at);
    let depth = depth_over_reach(place);
    var sum = vec2(0.0, 1.0e-4);
    for (var index = 0; index < 4; index++) {
        let off = vec2(index & 1, index >> 1u);
        let own = textureLoad(occluded, clamp(first + off, vec2(0), size - 1), 0);
        let share = select(1.0 - part, part, off == vec2(1));
        sum += share.x * share.y * max(1.0 - abs(own.y - depth), 0.0) * vec2(own.x, 1.0);
    }
    return mix(1.0, (sum.x + 1.0e-4) / sum.y, view.occlusion.x);
}
