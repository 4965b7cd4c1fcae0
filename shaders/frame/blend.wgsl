// Blend: each pixel marches through its tile's particles, near to far, in blocks of eight bins. A
// block has the steps of the smallest particle it begins in; every particle that reaches into it adds
// its matter and its light to the bins, whatever their number and order; then the bins are composed.
// Where there is nothing, the march goes on at the next particle. Twin: src/frame/cpu/blend.rs.
//
// Within a bin matter and light are even, but for the light of the sun, whose depth is linear in it:
// so a bin may be opaque, and a particle smaller than a bin keeps all of its matter. The depth comes
// from the deep shadow maps (shadow.wgsl), at the ends of pairs of bins, and is linear between them. The light
// field is looked up where a pair's light comes from.
//
// OCTAVES and ALONE are for comparison (`Lighting` in src/frame/settings.rs): without the light field. OCTAVES: all light by
// octaves (octaves.wgsl), with the same depths to the sun. ALONE: over the unscaled medium, each particle sends what its
// own table tells, by the sunlight that the others leave at its centre, and skylight as if there were no others.
//
// Rays end at the ground and at what is opaque. Where one pixel of every block is shaded, so are those others that lie
// beside an edge of what is opaque: reuse.wgsl has nothing to take them from.
//
// Workgroup contract: one workgroup owns 8x8 blocks of pixels of one tile, one invocation one pixel of a block; it
// reads the tile's list and writes its texels. The count of table look-ups is a sum.
#import cumuli::gpu_data::{FrameUniforms, Particle, ParticleLight, block_pixel}
#import cumuli::numerics::{mean_scatter_fraction, mean_transmittance, opacity, unfolded}
#import cumuli::opaque_distance::{beside_edge, opaque_distance}
#import cumuli::optical_depth::{March, copy_for, densities, march_from, pixels_per_radian}
#import cumuli::phase::{PhaseParams, phase_between}
#import cumuli::quaternion::rotate
#import cumuli::sky::ground_distance
#ifdef OCTAVES
#import cumuli::octaves::{octave_sources, octave_sunlight, octave_transmittance}
#import cumuli::sun_depth::sun_depth
#else ifdef ALONE
#import cumuli::scattering::scattering_source
#else
#import cumuli::light_field::{halo_factor, halo_row, scattered_light}
#import cumuli::lighting::{mean_sunlight, own_share}
#import cumuli::scattering::scattering_source
#import cumuli::sun_depth::sun_depth
#endif

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<uniform> phase: PhaseParams;
@group(0) @binding(2) var<storage, read> particles: array<Particle>;
@group(0) @binding(3) var<storage, read> lights: array<ParticleLight>;
@group(0) @binding(4) var<storage, read> tile_offsets: array<u32>;
@group(0) @binding(5) var<storage, read> tile_entries: array<u32>;
@group(0) @binding(6) var<storage, read_write> counts: array<atomic<u32>>; // [0] look-ups, [1] pixels, [2] empty tiles, [3] pixels cut; then areas (blend_areas.wgsl)
@group(0) @binding(7) var radiance_out: texture_storage_2d<rgba32float, write>; // rgb, transmittance
@group(0) @binding(8) var distance_out: texture_storage_2d<r32float, write>;    // m, opacity-weighted

const STEPS: u32 = #{STEPS}u; // bins in a radius
const SCREEN_TILE: u32 = #{SCREEN_TILE}u; // blocks of pixels a side that share a list
const BINS: f32 = 8.0;        // of a block
const FAR: f32 = 1e30;
// Steps of a block that ends where a smaller particle begins, times their number in a radius, over the way there:
// it takes no finer ones.
const UP_TO: f32 = f32(STEPS) / BINS;
// Least step over the distance: below it f32 does not tell the bins of a block apart.
const LEAST_STEP: f32 = 1e-6;
// Least length of a part of a chord, in bins: what f32 leaves of its two ends.
const LEAST_PART: f32 = 1e-6;
// Transmittance below this is dark.
const DARK: f32 = 1e-30;
// Opacity of a pair of bins below which it sends no light: what is divided by it must not vanish.
const LEAST_LIGHT: f32 = 1e-30;
const LOWER = vec4<f32>(0.0, 1.0, 2.0, 3.0); // where the first four bins begin
const UPPER = vec4<f32>(4.0, 5.0, 6.0, 7.0); // and the other four

// The visible part of a ray in a particle, m.
struct Span {
    near: f32,  // of the whole chord: behind the eye in a particle that it is in
    begin: f32,
    end: f32,   // at the beginning or before it: there is none
}

fn span_of(centre: vec3<f32>, radius: f32, dir: vec3<f32>, far: f32) -> Span {
    let middle = dot(centre, dir);
    let across = centre - middle * dir;
    let h2 = radius * radius - dot(across, across);
    let h = sqrt(max(h2, 0.0));
    return Span(middle - h, max(middle - h, 0.0), select(-1.0, min(middle + h, far), h2 > 0.0));
}

#ifdef RECORD
// For src/bench/fetches.rs: where this looks things up, and the sum of what it finds, in streams behind eight words of
// `counts`, of which the last four count the records.
const NO_SLOT: u32 = 0xffffffffu;

fn slot_of(stream: u32, words: u32) -> u32 {
    let room = (arrayLength(&counts) - 8u) / 4u;
    let slot = atomicAdd(&counts[4u + stream], 1u);
    return select(NO_SLOT, 8u + stream * room + slot * words, (slot + 1u) * words <= room);
}

fn put(slot: u32, offset: u32, v: vec4<f32>) {
    if slot != NO_SLOT {
        atomicStore(&counts[slot + offset], bitcast<u32>(v.x));
        atomicStore(&counts[slot + offset + 1u], bitcast<u32>(v.y));
        atomicStore(&counts[slot + offset + 2u], bitcast<u32>(v.z));
        atomicStore(&counts[slot + offset + 3u], bitcast<u32>(v.w));
    }
}
#endif

fn densities_at(march: March, places: vec4<f32>, wanted: vec4<bool>) -> vec4<f32> {
    let found = densities(march, places, wanted);
#ifdef RECORD
    let mask = dot(select(vec4(0.0), vec4(1.0, 2.0, 4.0, 8.0), wanted), vec4(1.0));
    let slot = slot_of(0u, 12u);
    put(slot, 0u, vec4(march.at, mask));
    put(slot, 4u, vec4(march.step, found.x + found.y + found.z + found.w));
    put(slot, 8u, places);
#endif
    return found;
}

#ifndef ALONE
fn depth_at(point: vec3<f32>) -> f32 {
#ifdef RECORD
    put(slot_of(1u, 4u), 0u, vec4(point, 0.0));
#endif
    return sun_depth(point);
}
#endif

#ifndef OCTAVES
fn source_at(entry: vec3<f32>, dir: vec3<f32>, sun: vec3<f32>, optical_radius: f32) -> vec2<f32> {
    let found = scattering_source(entry, dir, sun, optical_radius).xy;
#ifdef RECORD
    let slot = slot_of(3u, 8u);
    put(slot, 0u, vec4(entry, optical_radius));
    put(slot, 4u, vec4(dir, found.x + found.y));
#endif
    return found;
}
#endif

#ifdef OCTAVES
#else ifdef ALONE
#else
fn field_at(place: vec3<f32>) -> vec3<f32> {
    let found = scattered_light(place);
#ifdef RECORD
    put(slot_of(2u, 4u), 0u, vec4(place, found.x + found.y + found.z));
#endif
    return found;
}
#endif

#ifdef LISTED
// Workgroups in a row of the dispatch, as in blend_areas.wgsl; which area of 8x8 blocks each owns is told behind the counts.
const ROW: u32 = 1024u;
const LISTED_AREAS: u32 = 4u;

@compute @workgroup_size(8, 8)
fn blend(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let listed = group.y * ROW + group.x;
    if listed >= atomicLoad(&counts[LISTED_AREAS]) {
        return;
    }
    let area = atomicLoad(&counts[LISTED_AREAS + 1u + listed]);
    let columns = (frame.blocks.x + 7u) / 8u;
    let id = vec3(vec2(area % columns, area / columns) * 8u + local.xy, group.z);
#else
@compute @workgroup_size(8, 8)
fn blend(@builtin(global_invocation_id) id: vec3<u32>) {
#endif
    // One pixel of the block, or all of them in as many layers, from this phase on.
    let phase_of_block = (frame.phase + id.z) % (frame.stride * frame.stride);
    let pixel = id.xy * frame.stride + block_pixel(phase_of_block);
    if any(pixel >= frame.size) {
        return;
    }
    let is_another = (id.z > 0u) & (frame.in_place == 0u);
    if is_another && !beside_edge(pixel, frame.size, frame.stride, frame.phase) {
        return;
    }
    var radiance = vec3(0.0);
    var transmittance = 1.0;
    var distance_sum = 0.0; // opacity times distance
    var lookups = 0u;

    let tile = (id.y / SCREEN_TILE) * frame.tiles.x + id.x / SCREEN_TILE;
    let end = min(tile_offsets[tile + 1u], arrayLength(&tile_entries));
    var low = tile_offsets[tile]; // the entries before are all passed
    if low < end {
        let ndc = (vec2<f32>(pixel) + 0.5) / vec2<f32>(frame.size) * 2.0 - 1.0;
        let dir = normalize(frame.forward.xyz + ndc.x * frame.right.xyz - ndc.y * frame.up.xyz);
        let sun = frame.sun.xyz;
        let phase_once = phase_between(phase, dir, sun);
        // Source of order 1 in undimmed sunlight, without halo.
        let phase_first = frame.albedo / frame.delta_scale * phase_once;
#ifdef OCTAVES
        let octaves = octave_sources(phase_first, dot(dir, sun), frame.mean_cosine, frame.albedo);
#else ifdef ALONE
#else
        let sun_row = halo_row(dir, sun);
#endif
        let pixels = pixels_per_radian(frame.size.x, length(frame.right.xyz), dot(dir, frame.forward.xyz));
        var far = opaque_distance(pixel);
        if unfolded(frame.has_ground, dir.y > FAR) != 0u {
            let ground = ground_distance(dir);
            far = select(far, min(far, ground), ground >= 0.0);
        }
        var cursor = 0.0;     // m, everything before it is composed
        // Optical depth since the last place without particles between blocks; gaps within one do not count.
        var since_gap = 0.0;
        // A particle sets the steps in no more blocks than its diameter and the radius before it are
        // long, in the two at its ends, and in one that ends where it begins; and room for what is rounded. The
        // radius: particles come by their nearest points, so that one may be met before a ray is in those after.
        let most = (end - low) * (4u * STEPS / u32(BINS) + 8u);
        // Drivers may end loops before their time (lavapipe after 65535 turns of all loops): told by these.
        var finished = false;
        var cut = false;
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
                // No later particle of the list begins before this distance.
                if length(centre) - radius >= min(begin + smallest, far) {
                    searched = true;
                    break;
                }
                let span = span_of(centre, radius, dir, far);
                if span.end > span.begin && span.end > cursor {
                    leading = false;
                    let from_here = max(span.begin, cursor);
                    begin = min(begin, from_here);
                    smallest = min(smallest, max(radius, (from_here - begin) * UP_TO));
                } else if leading {
                    low = entry + 1u;
                }
            }
            cut = cut || !(searched || entry >= end);
            if begin >= FAR {
                finished = true;
                break;
            }
            since_gap = select(since_gap, 0.0, begin > cursor);
            let step = max(smallest / f32(STEPS), LEAST_STEP * begin);
            let stop = begin + BINS * step;

            // Of each bin: optical depth; the same of what others are around; source of what is
            // alone.
            var tau_low = vec4(0.0);
            var tau_high = vec4(0.0);
            var crowded_low = vec4(0.0);
            var crowded_high = vec4(0.0);
            var own_low = vec4(0.0);
            var own_high = vec4(0.0);
            // Colours change with the altitude alone: one for a block, by optical depth.
            var matter_sum = 0.0;
            var sun_sum = vec3(0.0);
            var above_sum = vec3(0.0);
            var below_sum = vec3(0.0);
            var added = false;
            entry = low;
            for (; entry < end; entry++) {
                let index = tile_entries[entry];
                let centre = particles[index].centre;
                let radius = particles[index].radius;
                if length(centre) - radius >= stop {
                    added = true;
                    break;
                }
                let span = span_of(centre, radius, dir, far);
                let a = max(span.begin, begin);
                let b = min(span.end, stop);
                if b <= a {
                    continue;
                }
                // The part in bins from the block's begin on, and in each bin.
                let first = (a - begin) / step;
                let last = max((b - begin) / step, first + LEAST_PART);
                let low_first = clamp(vec4(first), LOWER, LOWER + 1.0);
                let low_last = clamp(vec4(last), LOWER, LOWER + 1.0);
                let high_first = clamp(vec4(first), UPPER, UPPER + 1.0);
                let high_last = clamp(vec4(last), UPPER, UPPER + 1.0);
                let a_place = (a * dir - centre) / radius;
                let b_place = (b * dir - centre) / radius;
                let bin_tau = particles[index].extinction * step;
                var low_tau = bin_tau * (low_last - low_first);
                var high_tau = bin_tau * (high_last - high_first);
                let optical_radius = particles[index].optical_radius;
                let shape = particles[index].shape;
                if shape != 0u {
                    let turn = particles[index].orientation;
                    let along = rotate(turn, dir) * (step / radius);
                    let copy = copy_for(radius * pixels / max(length(centre), radius), optical_radius);
                    let march = march_from(shape, rotate(turn, a_place) - first * along, along, copy);
                    low_tau *= densities_at(march, 0.5 * (low_first + low_last), low_last > low_first);
                    high_tau *= densities_at(march, 0.5 * (high_first + high_last), high_last > high_first);
                    lookups += u32(min(ceil(last), BINS) - floor(first));
                }
                let below = lights[index].ambient_below;
#ifdef OCTAVES
                let alone = 0.0;
#else
                let alone = below.w;
                if alone > 0.0 {
                    let scattered = source_at((span.near * dir - centre) / radius, dir, sun, optical_radius / frame.delta_scale);
                    let own = alone * (scattered.x * phase_once + scattered.y) * exp(-lights[index].ambient_above.w);
                    own_low += own * low_tau;
                    own_high += own * high_tau;
                    lookups += 2u;
                }
#endif
                tau_low += low_tau;
                tau_high += high_tau;
                let all = low_tau + high_tau;
                let matter = all.x + all.y + all.z + all.w;
                matter_sum += matter;
                sun_sum += matter * lights[index].sun_irradiance.rgb;
                above_sum += matter * lights[index].ambient_above.rgb;
                below_sum += matter * below.rgb;
                crowded_low += (1.0 - alone) * low_tau;
                crowded_high += (1.0 - alone) * high_tau;
            }
            cut = cut || !(added || entry >= end);
            if matter_sum > 0.0 {
#ifndef ALONE
                var front = depth_at(begin * dir);
                var pair_back = front;
                let last_back = depth_at(stop * dir);
#endif
#ifdef OCTAVES
#else ifdef ALONE
#else
                var seen = vec3(0.0);
                // Where the block's light comes from, on the way to the sun and to the eye.
                let deep = mean_scatter_fraction(matter_sum);
                let path = frame.halo_share * (mix(front, last_back, deep) + deep * matter_sum - log(max(transmittance, DARK)));
                let once = phase_first * halo_factor(sun_row, path);
#endif
                var sunlight = 0.0;
                var above = 0.0;
                var below = 0.0;
                for (var bin = 0u; bin < u32(BINS); bin++) {
                    let high = bin >= 4u;
                    let i = bin & 3u;
                    let tau = select(tau_low[i], tau_high[i], high);
#ifndef ALONE
                    if (bin & 1u) == 0u {
                        let ahead = (begin + f32(bin + 2u) * step) * dir;
                        pair_back = last_back;
                        if bin + 2u < u32(BINS) {
                            pair_back = depth_at(ahead);
                        }
#ifndef OCTAVES
                        // Two bins see the light field where their light comes from: exact for light that
                        // changes evenly along the ray, however dense they are.
                        let next_tau = select(tau_low[i + 1u], tau_high[i + 1u], high);
                        let near_light = opacity(tau);
                        let far_light = (1.0 - near_light) * opacity(next_tau);
                        if near_light + far_light > LEAST_LIGHT {
                            let within = (near_light * mean_scatter_fraction(tau) + far_light * (1.0 + mean_scatter_fraction(next_tau))) / (near_light + far_light);
                            seen = field_at((begin + (f32(bin) + within) * step) * dir - frame.grid_shift.xyz);
                        }
#endif
                    }
                    let back = select(pair_back, 0.5 * (front + pair_back), (bin & 1u) == 0u);
#endif
                    if tau > 0.0 {
                        let mean = mean_transmittance(tau);
                        let within = mean_scatter_fraction(tau);
                        let weight = transmittance * mean;
#ifdef OCTAVES
                        // Light from all sides, on the way from the sun's side and from the eye's.
                        let from_sun = octave_transmittance(mix(front, back, within));
                        let from_eye = octave_transmittance(within * tau - log(max(transmittance, DARK)));
                        let around = weight * tau * frame.albedo * 0.25 * (from_sun + from_eye);
                        sunlight += weight * tau * octave_sunlight(octaves, front, back, tau);
                        above += around;
                        below += around;
#else ifdef ALONE
                        sunlight += weight * select(own_low[i], own_high[i], high);
                        above += 0.5 * weight * tau * frame.albedo;
                        below += 0.5 * weight * tau * frame.albedo;
#else
                        let lit = once * select(crowded_low[i], crowded_high[i], high) * mean_sunlight(front, back, tau);
                        let own = select(own_low[i], own_high[i], high) * own_share(since_gap, tau, frame.delta_scale);
                        sunlight += weight * (lit + seen.x * select(crowded_low[i], crowded_high[i], high) + own);
                        above += weight * tau * seen.y;
                        below += weight * tau * max(seen.z - seen.y, 0.0);
#endif
                        // Not its middle: a dense bin is seen at its near end.
                        distance_sum += weight * tau * (begin + (f32(bin) + within) * step);
                        transmittance *= exp(-tau);
                        since_gap += tau;
                    }
#ifndef ALONE
                    front = back;
#endif
                }
                radiance += (sunlight * sun_sum + above * above_sum + below * below_sum) / matter_sum;
                if transmittance <= frame.transmittance_stop {
                    finished = true;
                    break;
                }
            }
            cursor = stop;
        }
        if cut || !finished {
            atomicAdd(&counts[3], 1u);
        }
        atomicAdd(&counts[0], lookups);
        atomicAdd(&counts[1], 1u);
    } else if all(id.xy % SCREEN_TILE == vec2(0u)) && id.z == 0u {
        atomicAdd(&counts[2], 1u);
    }
    let opacity = 1.0 - transmittance;
    let layer = vec2(id.z & 1u, id.z >> 1u) * frame.blocks;
    let target_texel = select(id.xy + layer, pixel, frame.in_place != 0u);
    textureStore(radiance_out, target_texel, vec4(radiance, transmittance));
#ifdef COUNT_STEPS
    let told = f32(lookups);
#else
    let told = select(0.0, distance_sum / opacity, opacity > 0.0);
#endif
    textureStore(distance_out, target_texel, vec4(told, 0.0, 0.0, 0.0));
}
