// Blend areas: which areas of 8x8 blocks of pixels, one for each workgroup of the blend, have a tile with particles in
// them; the blend is dispatched for those alone, and the pixels of the others are written as clear here. Where a driver
// runs all branches for every invocation (lavapipe), the blend takes as long for an empty pixel as for one step.
// Host: src/frame/blend_areas.rs.
//
// Workgroup contract: `clear`: one workgroup owns one area, one invocation one pixel of each of its blocks. `gather`: one
// workgroup makes the whole list; one invocation a run of areas, so that their order is that of the picture.
#import cumuli::gpu_data::{FrameUniforms, block_pixel}

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<storage, read> tile_offsets: array<u32>;
@group(0) @binding(2) var<storage, read_write> counts: array<atomic<u32>>; // the blend's: [2] empty tiles, [4] areas, from [5] on which
@group(0) @binding(3) var<storage, read_write> groups: array<u32>;         // workgroups of the blend: x, y; z is the host's
@group(0) @binding(4) var radiance_out: texture_storage_2d<rgba32float, write>; // rgb, transmittance
@group(0) @binding(5) var distance_out: texture_storage_2d<r32float, write>;    // m

const SCREEN_TILE: u32 = #{SCREEN_TILE}u; // blocks of pixels a side
const AREA: u32 = 8u;                     // blocks a side
const LISTED: u32 = 4u;
// Workgroups in a row of the dispatch, as in blend.wgsl.
const ROW: u32 = 1024u;
const RUNS: u32 = 256u;

fn is_empty(area: vec2<u32>) -> bool {
    let first = area * AREA / SCREEN_TILE;
    let last = min((area + 1u) * AREA - 1u, frame.blocks - 1u) / SCREEN_TILE;
    var result = true;
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            let tile = y * frame.tiles.x + x;
            result = result && tile_offsets[tile] == tile_offsets[tile + 1u];
        }
    }
    return result;
}

@compute @workgroup_size(8, 8)
fn clear(@builtin(global_invocation_id) id: vec3<u32>, @builtin(workgroup_id) area: vec3<u32>) {
    // As in blend.wgsl.
    let phase_of_block = (frame.phase + id.z) % (frame.stride * frame.stride);
    let pixel = id.xy * frame.stride + block_pixel(phase_of_block);
    if any(pixel >= frame.size) || !is_empty(area.xy) {
        return;
    }
    if all(id.xy % SCREEN_TILE == vec2(0u)) && id.z == 0u {
        atomicAdd(&counts[2], 1u);
    }
    let layer = vec2(id.z & 1u, id.z >> 1u) * frame.blocks;
    let target_texel = select(id.xy + layer, pixel, frame.in_place != 0u);
    textureStore(radiance_out, target_texel, vec4(0.0, 0.0, 0.0, 1.0));
    textureStore(distance_out, target_texel, vec4(0.0));
}

var<workgroup> found: array<u32, RUNS>;

@compute @workgroup_size(256)
fn gather(@builtin(local_invocation_index) run: u32) {
    let areas = (frame.blocks + AREA - 1u) / AREA;
    let all_areas = areas.x * areas.y;
    let length = (all_areas + RUNS - 1u) / RUNS;
    let begin = min(run * length, all_areas);
    let end = min(begin + length, all_areas);
    var own = 0u;
    for (var area = begin; area < end; area++) {
        own += select(1u, 0u, is_empty(vec2(area % areas.x, area / areas.x)));
    }
    found[run] = own;
    workgroupBarrier();
    var slot = 0u;
    for (var other = 0u; other < run; other++) {
        slot += found[other];
    }
    for (var area = begin; area < end; area++) {
        if !is_empty(vec2(area % areas.x, area / areas.x)) {
            slot += 1u;
            atomicStore(&counts[LISTED + slot], area);
        }
    }
    if run == RUNS - 1u {
        atomicStore(&counts[LISTED], slot);
        groups[0] = min(slot, ROW);
        groups[1] = (slot + ROW - 1u) / ROW;
    }
}
