// Opaque: the depth of the host's opaque things, as the host draws them, becomes distances along the pixels' rays, in
// which clouds end; and how far the farthest pixel of every tile and of every bin of tiles is, beyond which their
// lists hold nothing. Host: src/frame/opaque.rs.
//
// Workgroup contract: `distances`: one invocation owns one pixel. `limits`: one workgroup owns one bin of 8x8 tiles,
// one invocation a tile of it.
#import cumuli::gpu_data::FrameUniforms
#import cumuli::numerics::sortable

// What the texels of the host's depth are.
struct OpaqueUniforms {
    scale: f32,   // m: of a projection, scale / (depth - offset) is the depth along the view axis
    offset: f32,
    empty: f32,   // depth of pixels without anything, of a projection
    kind: u32,    // 0: distance along the ray, m; 1: along the view axis, m; 2: depth of a projection
}

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<uniform> params: OpaqueUniforms;
@group(0) @binding(2) var depth: texture_2d<f32>;
@group(0) @binding(3) var distances_out: texture_storage_2d<r32float, write>;  // m
@group(0) @binding(4) var tile_limits: texture_storage_2d<r32uint, write>;     // sortable distances
@group(0) @binding(5) var bin_limits: texture_storage_2d<r32uint, write>;

const SCREEN_TILE: u32 = #{SCREEN_TILE}u; // blocks a side
const BIN: u32 = 8u;                      // tiles a side
const ALONG_RAY: u32 = 0u;
const PROJECTED: u32 = 2u;
// As in opaque_distance.wgsl.
const NOTHING: f32 = 1e30;
// Bits of f32 without its sign: from these on it is infinite or not a number, which comparisons need not tell.
const NO_SIGN: u32 = 0x7fffffffu;
const INFINITE: u32 = 0x7f800000u;

// m along the pixel's ray; what is not finite, or behind the eye, is nothing.
fn distance_of(pixel: vec2<u32>) -> f32 {
    let told = textureLoad(depth, pixel, 0).r;
    let ndc = (vec2<f32>(pixel) + 0.5) / vec2<f32>(frame.size) * 2.0 - 1.0;
    let slant = length(frame.forward.xyz + ndc.x * frame.right.xyz - ndc.y * frame.up.xyz);
    let projected = params.kind == PROJECTED;
    let along = select(told, params.scale / (told - params.offset), projected);
    let distance = along * select(slant, 1.0, params.kind == ALONG_RAY);
    let is_finite = (bitcast<u32>(told) & NO_SIGN) < INFINITE;
    let is_there = is_finite & (distance >= 0.0) & !(projected & (told == params.empty));
    return select(NOTHING, min(distance, NOTHING), is_there);
}

@compute @workgroup_size(8, 8)
fn distances(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= frame.size) {
        return;
    }
    textureStore(distances_out, id.xy, vec4(distance_of(id.xy), 0.0, 0.0, 0.0));
}

var<workgroup> farthest: array<u32, 64>;

@compute @workgroup_size(8, 8)
fn limits(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(workgroup_id) bin: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let side = SCREEN_TILE * frame.stride;
    let end = min((id.xy + 1u) * side, frame.size);
    var most = 0.0;
    for (var y = id.y * side; y < end.y; y++) {
        for (var x = id.x * side; x < end.x; x++) {
            most = max(most, distance_of(vec2(x, y)));
        }
    }
    let key = sortable(most);
    if all(id.xy < frame.tiles) {
        textureStore(tile_limits, id.xy, vec4(key));
    }
    farthest[local] = key;
    workgroupBarrier();
    if local == 0u {
        var of_bin = key;
        for (var other = 1u; other < BIN * BIN; other++) {
            of_bin = max(of_bin, farthest[other]);
        }
        textureStore(bin_limits, bin.xy, vec4(of_bin));
    }
}
