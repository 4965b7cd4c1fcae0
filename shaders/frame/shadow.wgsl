// Shadow: deep shadow maps of the clouds, from the sun's own lists. Each texel marches along the
// sun's ray as a pixel of the blend does along the eye's, and notes where each node's optical depth
// is reached. What nothing in view can read is left out. Twin: src/frame/cpu/shadow.rs.
//
// Workgroup contract: one invocation owns one texel of one map.
#import cumuli::gpu_data::{FrameUniforms, LightView, Particle}
#import cumuli::light_view::light_tile
#import cumuli::numerics::unfolded
#import cumuli::optical_depth::{copy_for, densities, march_from}
#import cumuli::quaternion::rotate
#import cumuli::shadow_maps::{AIR_BELOW, AIR_SIDES, BORDER, ENOUGH, NODES_HIGH, NODES_LOW, ShadowNodes, ShadowUniforms, pack_nodes}

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<uniform> view: LightView;
@group(0) @binding(2) var<uniform> maps: ShadowUniforms;
@group(0) @binding(3) var<storage, read> particles: array<Particle>;
@group(0) @binding(4) var<storage, read> tile_offsets: array<u32>;
@group(0) @binding(5) var<storage, read> tile_entries: array<u32>;
@group(0) @binding(6) var<storage, read_write> texels: array<vec4<u32>>; // map after map, row after row
@group(0) @binding(7) var<storage, read_write> cut: atomic<u32>;         // texels whose march a driver ended before its time

const STEPS: u32 = #{STEPS}u; // bins in a radius
const BINS: f32 = 8.0;               // of a block
// As in blend.wgsl.
const UP_TO: f32 = f32(STEPS) / BINS;
const FAR: f32 = 1e30;
const LEAST_STEP: f32 = 1e-6;
const LEAST_PART: f32 = 1e-6;
// Optical depth of a bin below which it has none.
const LEAST_TAU: f32 = 1e-20;
const LOWER = vec4<f32>(0.0, 1.0, 2.0, 3.0);
const UPPER = vec4<f32>(4.0, 5.0, 6.0, 7.0);
// Cosine of the sun's zenith below which altitudes say nothing of where a ray is.
const LEVEL: f32 = 1e-3;
// Most of half the place of an eighth node: below a half by more than 16 bits round.
const DEEP: f32 = 0.4999;
// Texels around one that a look-up at its border reads, and one for rounding.
const MARGIN: f32 = 2.0;

// Whether anything that the eye sees may lie on the ray, within so many metres across it.
fn in_view(origin: vec3<f32>, towards: vec3<f32>, across: f32) -> bool {
    // Part of the ray at the altitudes of what is shadowed.
    var near = maps.nearest;
    var far = maps.nearest + maps.reach;
    let nowhere = origin.y > FAR;
    let anywhere = unfolded(maps.anywhere, nowhere) != 0u;
    var lowest = maps.lowest;
    if unfolded(frame.has_air_shadow, nowhere) != 0u {
        lowest -= AIR_BELOW;
        far += AIR_SIDES * maps.corner[min(maps.maps, 8u) - 1u].z * f32(maps.resolution);
    }
    if (unfolded(frame.has_ground, nowhere) != 0u) & (towards.y > LEVEL) {
        far = max(far, (origin.y - lowest) / towards.y);
    }
    far = select(far, FAR, anywhere);
    if !nowhere & !anywhere & (abs(towards.y) > LEVEL) {
        let a = (origin.y - lowest) / towards.y;
        let b = (origin.y - maps.highest) / towards.y;
        let slack = across / abs(towards.y);
        near = max(near, min(a, b) - slack);
        far = min(far, max(a, b) + slack);
    }
    if near > far {
        return false;
    }
    let first = origin - near * towards;
    let last = origin - far * towards;
    // Planes through the eye; inside is where all are positive.
    for (var side = 0u; side < 5u; side++) {
        var normal = frame.forward.xyz;
        switch side {
            case 0u: { normal = length_squared(frame.right.xyz) * normal + frame.right.xyz; }
            case 1u: { normal = length_squared(frame.right.xyz) * normal - frame.right.xyz; }
            case 2u: { normal = length_squared(frame.up.xyz) * normal + frame.up.xyz; }
            case 3u: { normal = length_squared(frame.up.xyz) * normal - frame.up.xyz; }
            default: {}
        }
        if max(dot(first, normal), dot(last, normal)) < -across * length(normal) {
            return false;
        }
    }
    return true;
}

fn length_squared(v: vec3<f32>) -> f32 {
    return dot(v, v);
}

// Part of the ray in a particle, from the sun on.
fn span_of(centre: vec3<f32>, radius: f32, place: vec2<f32>) -> vec2<f32> {
    let across = place - vec2(dot(centre, maps.axis_u.xyz), dot(centre, maps.axis_v.xyz));
    let middle = -dot(centre, maps.towards.xyz);
    let h2 = radius * radius - dot(across, across);
    let h = sqrt(max(h2, 0.0));
    return select(vec2(0.0, -FAR), vec2(middle - h, middle + h), h2 > 0.0);
}

@compute @workgroup_size(8, 8)
fn shadow(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= vec2(maps.resolution)) || id.z >= maps.maps {
        return;
    }
    let corner = maps.corner[id.z];
    let place = corner.xy + (vec2<f32>(id.xy) + 0.5) * corner.z;
    let towards = maps.towards.xyz;
    let origin = place.x * maps.axis_u.xyz + place.y * maps.axis_v.xyz;
    var nodes = ShadowNodes(vec4(1.0), vec4(1.0));
    var wanted = (maps.seen_only == 0u) | in_view(origin, towards, MARGIN * corner.z);
    if id.z > 0u {
        // A finer map tells what lies here.
        let finer = maps.corner[id.z - 1u];
        let texel = (place - finer.xy) / finer.z - 0.5;
        let margin = min(texel, f32(maps.resolution) - 1.0 - texel) - BORDER;
        // But not before and behind its range.
        let range = maps.range[id.z - 1u];
        let is_short = range.z > -FAR || range.w < FAR;
        wanted = wanted && (is_short || min(margin.x, margin.y) < MARGIN * corner.z / finer.z);
    }
    let tile = light_tile(view, origin);
    if wanted && tile < view.tiles.x * view.tiles.y {
        nodes = march(place, origin, tile, corner.z, maps.range[id.z]);
    }
    texels[(id.z * maps.resolution + id.y) * maps.resolution + id.x] = pack_nodes(nodes);
}

fn march(place: vec2<f32>, origin: vec3<f32>, tile: u32, texel: f32, range: vec4<f32>) -> ShadowNodes {
    let towards = maps.towards.xyz;
    let end = min(tile_offsets[tile + 1u], arrayLength(&tile_entries));
    var low = tile_offsets[tile];
    var cursor = -FAR;
    var depth = 0.0;
    var low_nodes = vec4(FAR);
    var high_nodes = vec3(FAR);
    var matter_begin = FAR;
    var enough_at = FAR;
    var last = 0.0; // where matter ends
    let most = (end - low) * (4u * STEPS / u32(BINS) + 8u);
    var finished = low >= end;
    var is_cut = false;
    for (var block = 0u; block < most; block++) {
        var begin = FAR;
        var smallest = FAR;
        var leading = true;
        var searched = false;
        var entry = low;
        for (; entry < end; entry++) {
            let index = tile_entries[entry];
            let centre = particles[index].centre;
            let radius = particles[index].radius;
            if -dot(centre, towards) - radius >= begin + smallest {
                searched = true;
                break;
            }
            let span = span_of(centre, radius, place);
            if span.y > max(span.x, cursor) {
                leading = false;
                let from_here = max(span.x, cursor);
                begin = min(begin, from_here);
                smallest = min(smallest, max(radius, (from_here - begin) * UP_TO));
            } else if leading {
                low = entry + 1u;
            }
        }
        is_cut = is_cut || !(searched || entry >= end);
        if begin >= min(FAR, range.w) {
            finished = true;
            break;
        }
        let step = max(smallest / f32(STEPS), LEAST_STEP * abs(begin));
        let stop = begin + BINS * step;
        var tau_low = vec4(0.0);
        var tau_high = vec4(0.0);
        var added = false;
        entry = low;
        for (; entry < end; entry++) {
            let index = tile_entries[entry];
            let centre = particles[index].centre;
            let radius = particles[index].radius;
            if -dot(centre, towards) - radius >= stop {
                added = true;
                break;
            }
            let span = span_of(centre, radius, place);
            let a = max(span.x, begin);
            let b = min(span.y, stop);
            if b <= a {
                continue;
            }
            let first = (a - begin) / step;
            let part_end = max((b - begin) / step, first + LEAST_PART);
            let low_first = clamp(vec4(first), LOWER, LOWER + 1.0);
            let low_last = clamp(vec4(part_end), LOWER, LOWER + 1.0);
            let high_first = clamp(vec4(first), UPPER, UPPER + 1.0);
            let high_last = clamp(vec4(part_end), UPPER, UPPER + 1.0);
            let bin_tau = particles[index].extinction * step;
            var low_tau = bin_tau * (low_last - low_first);
            var high_tau = bin_tau * (high_last - high_first);
            let shape = particles[index].shape;
            if shape != 0u {
                let turn = particles[index].orientation;
                let along = rotate(turn, -towards) * (step / radius);
                let start = rotate(turn, (origin - begin * towards - centre) / radius);
                let m = march_from(shape, start, along, copy_for(radius / texel, particles[index].optical_radius));
                low_tau *= densities(m, 0.5 * (low_first + low_last), low_last > low_first);
                high_tau *= densities(m, 0.5 * (high_first + high_last), high_last > high_first);
            }
            tau_low += low_tau;
            tau_high += high_tau;
            last = max(last, b);
        }
        is_cut = is_cut || !(added || entry >= end);
        for (var bin = 0u; bin < u32(BINS); bin++) {
            let i = bin & 3u;
            let tau = select(tau_low[i], tau_high[i], bin >= 4u);
            let next = depth + tau;
            let front = begin + f32(bin) * step;
            let thickness = step / max(tau, LEAST_TAU);
            matter_begin = select(matter_begin, front, depth <= 0.0 && next > 0.0);
            low_nodes = select(low_nodes, front + (NODES_LOW - depth) * thickness, (NODES_LOW >= vec4(depth)) & (NODES_LOW < vec4(next)));
            high_nodes = select(high_nodes, front + (NODES_HIGH - depth) * thickness, (NODES_HIGH >= vec3(depth)) & (NODES_HIGH < vec3(next)));
            enough_at = select(enough_at, front + (ENOUGH - depth) * thickness, depth < ENOUGH && next >= ENOUGH);
            depth = next;
        }
        cursor = stop;
        if depth >= ENOUGH {
            finished = true;
            break;
        }
    }
    if is_cut || !finished {
        atomicAdd(&cut, 1u);
    }
    if depth <= 0.0 {
        return ShadowNodes(vec4(1.0), vec4(1.0));
    }
    var eighth = FAR;
    if depth < NODES_LOW.x {
        low_nodes = vec4(matter_begin, vec3(last));
        high_nodes = vec3(last);
    } else {
        // Nodes that are not reached: where they would be if matter went on as it ended.
        var reached = NODES_LOW.x;
        var at = low_nodes.x;
        for (var node = 1u; node < 7u; node++) {
            let level = select(NODES_LOW[node & 3u], NODES_HIGH[min(node & 3u, 2u)], node >= 4u);
            let place = select(low_nodes[node & 3u], high_nodes[min(node & 3u, 2u)], node >= 4u);
            reached = select(reached, level, place < FAR);
            at = select(at, place, place < FAR);
        }
        let thickness = max(last - at, 0.0) / max(depth - reached, LEAST_TAU);
        low_nodes = select(low_nodes, at + (NODES_LOW - reached) * thickness, low_nodes >= vec4(FAR));
        high_nodes = select(high_nodes, at + (NODES_HIGH - reached) * thickness, high_nodes >= vec3(FAR));
        eighth = select(at + (ENOUGH - reached) * thickness, enough_at, enough_at < FAR);
    }
    let eighth_share = saturate((eighth - range.x) / range.y);
    let rest = select(0.5 + 0.5 * exp(-depth), min(0.5 * eighth_share, DEEP), depth > NODES_HIGH.z);
    var low_share = saturate((low_nodes - range.x) / range.y);
    var high_share = saturate((high_nodes - range.x) / range.y);
    // None before the last: far from the eye f32 rounds places by more than a step of 16 bits.
    low_share.y = max(low_share.x, low_share.y);
    low_share.z = max(low_share.y, low_share.z);
    low_share.w = max(low_share.z, low_share.w);
    high_share.x = max(low_share.w, high_share.x);
    high_share.y = max(high_share.x, high_share.y);
    high_share.z = max(high_share.y, high_share.z);
    return ShadowNodes(low_share, vec4(high_share, rest));
}
