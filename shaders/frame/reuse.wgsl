// Reuse: the blend has shaded one pixel of every block of stride x stride; the others come from the
// frame before, from where it showed the same point of the clouds. What was hidden there, or is of
// another brightness than all that is new around it, comes from the new pixels alone. Pixels beside an edge of what
// is opaque are all new.
// Host: src/frame/reuse.rs.
//
// Workgroup contract: one invocation owns one pixel of the picture.
#import cumuli::gpu_data::{FrameUniforms, block_pixel, phase_of_pixel}
#import cumuli::opaque_distance::beside_edge

// How the frame before saw what this one sees.
struct ReuseUniforms {
    right: vec4<f32>,   // as FrameUniforms
    up: vec4<f32>,
    forward: vec4<f32>,
    motion: vec4<f32>,  // xyz: m, the eye now relative to the eye before, both as the clouds drift
}

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<uniform> before: ReuseUniforms;
@group(0) @binding(2) var fresh: texture_2d<f32>;            // a pixel a block, the others of blocks beside edges in three more parts: rgb, transmittance
@group(0) @binding(3) var fresh_distance: texture_2d<f32>;   // m
@group(0) @binding(4) var history: texture_2d<f32>;          // the frame before
@group(0) @binding(5) var history_distance: texture_2d<f32>;
@group(0) @binding(6) var clouds: texture_storage_2d<rgba32float, write>;
@group(0) @binding(7) var cloud_distance: texture_storage_2d<r32float, write>;

// Opacity below which there is nothing whose motion could be followed.
const LEAST_OPACITY: f32 = 1e-3;
// Opacity that sends no light, and by which nothing is divided.
const NO_OPACITY: f32 = 1e-30;
// Distance (relative) from which on two pixels do not show the same cloud.
const OTHER_CLOUD: f32 = 0.25;
// How far, in spreads of the new pixels around, an old one may lie beyond them.
const SLACK: f32 = 0.5;

// Places of the frame before that are nearer than this to a pixel, in pixels, are that pixel.
const SAME_PLACE: f32 = 1e-3;
// More than any radiance: where minima and maxima begin.
const BEYOND: f32 = 1e30;
// Weight of a new pixel on whose row or column this one lies: the place that is followed stays defined.
const LEAST_WEIGHT: f32 = 1e-3;

// Weight of the texel `x` of four in a row for a place `f` beyond the second of them: Catmull and Rom's
// spline. Bilinear, a pixel that is taken over three times in a row is blurred.
fn cubic(x: i32, f: f32) -> f32 {
    switch x {
        case 0: { return f * (-0.5 + f * (1.0 - 0.5 * f)); }
        case 1: { return 1.0 + f * f * (-2.5 + 1.5 * f); }
        case 2: { return f * (0.5 + f * (2.0 - 1.5 * f)); }
        default: { return f * f * (-0.5 + 0.5 * f); }
    }
}

struct Sample {
    colour: vec4<f32>,
    weight: f32,
}

// The frame before at a place in pixels from the middle of its first one, where it shows something at
// this distance.
fn history_at(place: vec2<f32>, distance: f32) -> Sample {
    var result: Sample;
    let nearest = floor(place + 0.5);
    let at = select(place, nearest, abs(place - nearest) < vec2(SAME_PLACE));
    let low = floor(at);
    let f = at - low;
    let last = vec2<i32>(frame.size) - 1;
    for (var y = 0; y < 4; y++) {
        for (var x = 0; x < 4; x++) {
            let texel = vec2<i32>(low) + vec2(x - 1, y - 1);
            let weight = cubic(x, f.x) * cubic(y, f.y);
            if weight == 0.0 || any(texel < vec2(0)) || any(texel > last) {
                continue;
            }
            let colour = textureLoad(history, texel, 0);
            let there = textureLoad(history_distance, texel, 0).r;
            if 1.0 - colour.a < LEAST_OPACITY || abs(there - distance) < OTHER_CLOUD * distance {
                result.colour += weight * colour;
                result.weight += weight;
            }
        }
    }
    return result;
}

@compute @workgroup_size(8, 8)
fn reuse(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= frame.size) {
        return;
    }
    let first = block_pixel(frame.phase);
    let stride = frame.stride;
    if all(id.xy % stride == first) {
        textureStore(clouds, id.xy, textureLoad(fresh, id.xy / stride, 0));
        textureStore(cloud_distance, id.xy, textureLoad(fresh_distance, id.xy / stride, 0));
        return;
    }
    if beside_edge(id.xy, frame.size, stride, frame.phase) {
        let layer = (phase_of_pixel(id.xy % stride) - frame.phase) & 3u;
        let texel = id.xy / stride + vec2(layer & 1u, layer >> 1u) * frame.blocks;
        textureStore(clouds, id.xy, textureLoad(fresh, texel, 0));
        textureStore(cloud_distance, id.xy, textureLoad(fresh_distance, texel, 0));
        return;
    }
    // New pixels around: the last ones of a row may lie outside of the picture.
    let at = (vec2<f32>(id.xy) - vec2<f32>(first)) / f32(stride);
    let low = floor(at);
    let f = at - low;
    let last = vec2<i32>((frame.size - 1u - first) / stride);
    var colour = vec4(0.0);
    var least = vec4(BEYOND);
    var most = vec4(-BEYOND);
    var distance_sum = 0.0;
    var opacity_sum = 0.0;
    for (var corner = 0u; corner < 4u; corner++) {
        let offset = vec2(i32(corner & 1u), i32(corner >> 1u));
        let texel = clamp(vec2<i32>(low) + offset, vec2(0), last);
        let weights = select(1.0 - f, f, offset == vec2(1));
        let weight = weights.x * weights.y;
        let new_one = textureLoad(fresh, texel, 0);
        colour += weight * new_one;
        least = min(least, new_one);
        most = max(most, new_one);
        // What counts little is still something to follow.
        let seen = (weight + LEAST_WEIGHT) * (1.0 - new_one.a);
        distance_sum += seen * textureLoad(fresh_distance, texel, 0).r;
        opacity_sum += seen;
    }
    if least.a > 1.0 - LEAST_OPACITY {
        textureStore(clouds, id.xy, colour);
        textureStore(cloud_distance, id.xy, vec4(select(0.0, distance_sum / opacity_sum, opacity_sum > 0.0), 0.0, 0.0, 0.0));
        return;
    }
    let distance = distance_sum / opacity_sum;
    let ndc = (vec2<f32>(id.xy) + 0.5) / vec2<f32>(frame.size) * 2.0 - 1.0;
    let dir = normalize(frame.forward.xyz + ndc.x * frame.right.xyz - ndc.y * frame.up.xyz);
    let point = dir * distance + before.motion.xyz;
    let ahead = dot(point, before.forward.xyz);
    if ahead > 0.0 {
        let right = before.right.xyz;
        let up = before.up.xyz;
        let seen = vec2(dot(point, right) / dot(right, right), -dot(point, up) / dot(up, up)) / ahead;
        let place = (0.5 * seen + 0.5) * vec2<f32>(frame.size) - 0.5;
        if all(place > vec2(-1.0)) && all(place < vec2<f32>(frame.size)) {
            let old = history_at(place, length(point));
            // Most of it is the same cloud.
            if old.weight > 0.5 {
                let slack = SLACK * (most - least);
                colour = clamp(old.colour / old.weight, least - slack, most + slack);
            }
        }
    }
    // The spline passes 0 and 1 beside edges. Light goes with the opacity that sends it: in uniform light
    // a cloud that absorbs nothing is invisible in these pixels too.
    let opacity = 1.0 - colour.a;
    let sent = max(colour.rgb, vec3(0.0)) * (saturate(opacity) / max(opacity, NO_OPACITY));
    textureStore(clouds, id.xy, vec4(sent, saturate(colour.a)));
    textureStore(cloud_distance, id.xy, vec4(distance, 0.0, 0.0, 0.0));
}
