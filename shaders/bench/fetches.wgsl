// Fetches: what the blend looks up, at the places where it did, and nothing else: how long that takes is the least that
// a blend of these lists can take. Places come from the blend itself (RECORD in blend.wgsl). Host: src/bench/fetches.rs.
//
// Workgroup contract: one invocation owns so many records of a stream, one after the other, and one sum.
#import cumuli::gpu_data::FrameUniforms
#import cumuli::light_field::scattered_light
#import cumuli::numerics::unfolded
#import cumuli::optical_depth::{March, densities}
#import cumuli::scattering::scattering_source
#import cumuli::shadow_maps::BORDER
#import cumuli::sun_depth::{shadow_maps, shadow_texels}

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<storage, read> records: array<u32>; // as blend.wgsl writes them
@group(0) @binding(2) var<storage, read_write> sums: array<f32>;

// As in blend.wgsl.
const HEAD: u32 = 8u;
const CURSORS: u32 = 4u;
const STREAMS: u32 = 4u;
// Records of an invocation: about those of a pixel.
const RUN: u32 = 32u;

fn four(at: u32) -> vec4<f32> {
    return vec4(bitcast<f32>(records[at]), bitcast<f32>(records[at + 1u]), bitcast<f32>(records[at + 2u]), bitcast<f32>(records[at + 3u]));
}

struct Stretch {
    begin: u32, // word of the first record
    count: u32,
}

// The records of an invocation, of so many words each.
fn stretch(stream: u32, words: u32, invocation: u32) -> Stretch {
    let room = (arrayLength(&records) - HEAD) / STREAMS;
    let all = min(records[CURSORS + stream], room / words);
    let first = min(invocation * RUN, all);
    return Stretch(HEAD + stream * room + first * words, min(RUN, all - first));
}

@compute @workgroup_size(64)
fn fetch_densities(@builtin(global_invocation_id) id: vec3<u32>) {
    let own = stretch(0u, 12u, id.x);
    var sum = vec4(0.0);
    for (var i = 0u; i < own.count; i++) {
        let at = own.begin + 12u * i;
        let begin = four(at);
        let step = four(at + 4u);
        let wanted = (vec4(u32(begin.w)) & vec4(1u, 2u, 4u, 8u)) != vec4(0u);
        sum += densities(March(begin.xyz, step.xyz), four(at + 8u), wanted);
    }
    sums[id.x] = sum.x + sum.y + sum.z + sum.w;
}

@compute @workgroup_size(64)
fn fetch_sun(@builtin(global_invocation_id) id: vec3<u32>) {
    let own = stretch(1u, 4u, id.x);
    let last = f32(shadow_maps.resolution) - 1.0;
    let maps = unfolded(shadow_maps.maps, arrayLength(&shadow_texels) == 0u);
    var sum = vec4(0u);
    for (var i = 0u; i < own.count; i++) {
        let point = four(own.begin + 4u * i).xyz;
        let place = vec2(dot(point, shadow_maps.axis_u.xyz), dot(point, shadow_maps.axis_v.xyz));
        for (var m = 0u; m < maps; m++) {
            let corner = shadow_maps.corner[m];
            let texel = (place - corner.xy) / corner.z - 0.5;
            let margin = min(texel, last - texel);
            if min(margin.x, margin.y) >= BORDER {
                let low = vec2<u32>(texel);
                let row = shadow_maps.resolution;
                let index = (m * row + low.y) * row + low.x;
                sum += shadow_texels[index] + shadow_texels[index + 1u];
                sum += shadow_texels[index + row] + shadow_texels[index + row + 1u];
                break;
            }
        }
    }
    sums[id.x] = f32(sum.x ^ sum.y ^ sum.z ^ sum.w);
}

@compute @workgroup_size(64)
fn fetch_field(@builtin(global_invocation_id) id: vec3<u32>) {
    let own = stretch(2u, 4u, id.x);
    var sum = vec3(0.0);
    for (var i = 0u; i < own.count; i++) {
        sum += scattered_light(four(own.begin + 4u * i).xyz);
    }
    sums[id.x] = sum.x + sum.y + sum.z;
}

@compute @workgroup_size(64)
fn fetch_sources(@builtin(global_invocation_id) id: vec3<u32>) {
    let own = stretch(3u, 8u, id.x);
    var sum = vec2(0.0);
    for (var i = 0u; i < own.count; i++) {
        let entry = four(own.begin + 8u * i);
        let dir = four(own.begin + 8u * i + 4u);
        sum += scattering_source(entry.xyz, dir.xyz, frame.sun.xyz, entry.w).xy;
    }
    sums[id.x] = sum.x + sum.y;
}
