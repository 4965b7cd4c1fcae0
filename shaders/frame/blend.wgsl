// Blend: each pixel walks its tile's list, near to far, and composes the particles volume-aware.
// Up to PENDING chords are open at a time; between two events (a chord begins or ends) the open
// ones share a piece of the ray, where extinctions add and source functions mix by optical depth.
// Twin: src/frame/cpu/blend.rs.
//
// Workgroup contract: one workgroup owns one tile of 8x8 pixels, one invocation one pixel; it
// reads the tile's list and writes its texels. The count of table look-ups is a sum.
#import cumuli::gpu_data::{FrameUniforms, Particle, ParticleLight}
#import cumuli::light_field::{halo_factor, halo_row, scattered_light}
#import cumuli::lighting::{depth_at, mean_sunlight, own_source, way_out}
#import cumuli::numerics::{mean_scatter_fraction, mean_transmittance}
#import cumuli::optical_depth::{bins_before, chord_profile, copy_for}
#import cumuli::phase::{PhaseParams, phase_between}
#import cumuli::quaternion::rotate
#import cumuli::scattering::scattering_source
#import cumuli::sky::ground_distance

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<uniform> phase: PhaseParams;
@group(0) @binding(2) var<storage, read> particles: array<Particle>;
@group(0) @binding(3) var<storage, read> lights: array<ParticleLight>;
@group(0) @binding(4) var<storage, read> tile_offsets: array<u32>;
@group(0) @binding(5) var<storage, read> tile_entries: array<u32>;
@group(0) @binding(6) var<storage, read_write> counts: array<atomic<u32>>; // [0] look-ups, [1] pixels, [2] empty tiles
@group(0) @binding(7) var radiance_out: texture_storage_2d<rgba32float, write>; // rgb, transmittance
@group(0) @binding(8) var distance_out: texture_storage_2d<r32float, write>;    // m, opacity-weighted

const PENDING: u32 = #{PENDING}u;
const FAR: f32 = 1e30;

// Open chords, each in a place of its own until its end is passed. All loops over places have a
// fixed number of rounds: unrolled, they leave no memory that is indexed.
var<private> chord_begin: array<f32, PENDING>;  // m along the ray, of what is visible
var<private> chord_end: array<f32, PENDING>;    // at the cursor or before it: the place is free
var<private> chord_near: array<f32, PENDING>;   // m, where the whole chord begins
var<private> chord_inverse: array<f32, PENDING>;// 1/m, of the whole chord's length
var<private> chord_tau: array<f32, PENDING>;    // optical depth per sum of bins
var<private> chord_low: array<vec4<u32>, PENDING>;  // where its matter lies, as ChordProfile
var<private> chord_high: array<vec4<u32>, PENDING>;
var<private> chord_done: array<f32, PENDING>;   // sum of its bins before the cursor
var<private> chord_sun: array<vec3<f32>, PENDING>;   // irradiance there, without the share that is alone
var<private> chord_above: array<vec3<f32>, PENDING>; // radiance from above
var<private> chord_below: array<vec3<f32>, PENDING>; // and below
var<private> chord_depth: array<f32, PENDING>;       // scaled optical depth to the sun at chord_begin
var<private> chord_fade: array<f32, PENDING>;        // 1/m, its change along the ray
var<private> chord_own: array<vec3<f32>, PENDING>;   // source of the share that is alone in sunlight
var<private> chord_piece: array<f32, PENDING>;       // optical depth in the piece at hand

var<private> cursor: f32;         // m, everything before it is composed
var<private> radiance: vec3<f32>;
var<private> transmittance: f32;
var<private> distance_sum: f32;   // opacity times distance
var<private> view: vec3<f32>;     // direction of the ray
var<private> phase_first: f32;    // source of order 1 in undimmed sunlight, without halo
var<private> sun_row: f32;        // angle from the sun, for the halo
var<private> field: vec4<f32>;    // light field at field_at
var<private> field_at: f32;       // m along the ray

// Composes everything up to `limit`.
fn advance(limit: f32) {
    // Each round closes a chord, opens one, or reaches the limit.
    for (var round = 0u; round < 2u * PENDING + 2u; round++) {
        if cursor >= limit || transmittance <= frame.transmittance_stop {
            break;
        }
        var next = limit;
        for (var i = 0u; i < PENDING; i++) {
            let event = select(chord_end[i], chord_begin[i], chord_begin[i] > cursor);
            next = select(next, min(next, event), chord_end[i] > cursor);
        }
        var tau = 0.0;
        for (var i = 0u; i < PENDING; i++) {
            chord_piece[i] = 0.0;
            if chord_begin[i] <= cursor && chord_end[i] > cursor {
                let t = saturate((next - chord_near[i]) * chord_inverse[i]);
                let done = bins_before(chord_low[i], chord_high[i], t);
                chord_piece[i] = chord_tau[i] * max(done - chord_done[i], 0.0);
                chord_done[i] = done;
                tau += chord_piece[i];
            }
        }
        var light = vec3(0.0);
        if tau > 0.0 {
            if field_at != cursor {
                field = scattered_light(cursor * view - frame.grid_shift.xyz);
            }
            let near_end = field;
            field = scattered_light(next * view - frame.grid_shift.xyz);
            field_at = next;
            let seen = mix(near_end, field, mean_scatter_fraction(tau));
            let path = frame.halo_share * (seen.w - log(max(transmittance, 1e-30)));
            let first = phase_first * halo_factor(sun_row, path);
            for (var i = 0u; i < PENDING; i++) {
                if chord_piece[i] > 0.0 {
                    let front = max(chord_depth[i] + chord_fade[i] * (cursor - chord_begin[i]), 0.0);
                    let back = max(chord_depth[i] + chord_fade[i] * (next - chord_begin[i]), 0.0);
                    let sun = seen.x + first * mean_sunlight(front, back, tau);
                    light += chord_piece[i] * (chord_own[i] + sun * chord_sun[i]
                        + seen.y * chord_above[i] + (seen.z - seen.y) * chord_below[i]);
                }
            }
        }
        let weight = transmittance * mean_transmittance(tau);
        radiance += weight * light;
        // Not its middle: a dense piece is seen at its near end.
        distance_sum += weight * tau * mix(cursor, next, mean_scatter_fraction(tau));
        transmittance *= exp(-tau);
        cursor = next;
    }
    cursor = max(cursor, limit);
}

// The place that is free first: its chord has the nearest end.
fn first_end() -> f32 {
    var first = FAR;
    for (var i = 0u; i < PENDING; i++) {
        first = min(first, chord_end[i]);
    }
    return first;
}

@compute @workgroup_size(8, 8)
fn blend(@builtin(global_invocation_id) id: vec3<u32>, @builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    if any(id.xy >= frame.size) {
        return;
    }
    radiance = vec3(0.0);
    transmittance = 1.0;
    distance_sum = 0.0;
    cursor = 0.0;
    for (var i = 0u; i < PENDING; i++) {
        chord_end[i] = 0.0;
    }
    var lookups = 0u;

    let tile = group.y * frame.tiles.x + group.x;
    let begin = tile_offsets[tile];
    let end = min(tile_offsets[tile + 1u], arrayLength(&tile_entries));
    if begin < end {
        let ndc = (vec2<f32>(id.xy) + 0.5) / vec2<f32>(frame.size) * 2.0 - 1.0;
        let dir = normalize(frame.forward.xyz + ndc.x * frame.right.xyz - ndc.y * frame.up.xyz);
        let phase_once = phase_between(phase, dir, frame.sun.xyz);
        view = dir;
        phase_first = frame.albedo / frame.delta_scale * phase_once;
        sun_row = halo_row(dir, frame.sun.xyz);
        field_at = -1.0;
        // In the middle of the picture; a rectilinear picture stretches towards its corners.
        let pixels_per_radian = 0.5 * f32(frame.size.x) / length(frame.right.xyz);
        var far = FAR;
        if frame.has_ground != 0u {
            let ground = ground_distance(dir);
            far = select(FAR, ground, ground >= 0.0);
        }

        for (var entry = begin; entry < end; entry++) {
            let index = tile_entries[entry];
            let particle = particles[index];
            let middle = dot(particle.centre, dir);
            let across = particle.centre - middle * dir;
            let h2 = particle.radius * particle.radius - dot(across, across);
            if h2 <= 0.0 {
                continue;
            }
            let h = sqrt(h2);
            let near = middle - h;
            let visible_begin = max(near, 0.0);
            let visible_end = min(middle + h, far);
            if visible_end <= visible_begin {
                continue;
            }
            // No later particle of the list begins before this distance.
            advance(length(particle.centre) - particle.radius);
            // Where all places are taken: composes up to the first end. Whatever begins before
            // that keeps its matter and loses at most its order (the error of a small PENDING).
            advance(first_end());
            if transmittance <= frame.transmittance_stop {
                break;
            }

            let entry_place = (near * dir - particle.centre) / particle.radius;
            let exit_place = (near * dir + 2.0 * h * dir - particle.centre) / particle.radius;
            let profile = chord_profile(
                particle.shape,
                rotate(particle.orientation, entry_place),
                rotate(particle.orientation, exit_place),
                copy_for(particle.radius * pixels_per_radian / max(length(particle.centre), particle.radius)),
            );
            let tau = particle.extinction * 2.0 * h * profile.mean_density;
            let inverse = 0.5 / h;
            let before = bins_before(profile.low, profile.high, saturate((visible_begin - near) * inverse));
            let after = bins_before(profile.low, profile.high, saturate((visible_end - near) * inverse));

            let visible_tau = tau * (after - before) * profile.inverse_sum;
            let light = lights[index];
            let alone = light.ambient_below.w;
            var own = 0.0;
            if alone > 0.0 {
                let scattered = scattering_source(entry_place, dir, frame.sun.xyz, particle.optical_radius / frame.delta_scale);
                let t = mix(visible_begin, visible_end, mean_scatter_fraction(visible_tau));
                let front = depth_at(light.sun_front, (t * dir - particle.centre) / particle.radius);
                own = alone * own_source(scattered, phase_once, visible_tau, frame.delta_scale) * exp(-front);
                lookups += 1u;
            }
            let begin_place = (visible_begin * dir - particle.centre) / particle.radius;
            let end_place = (visible_end * dir - particle.centre) / particle.radius;
            let begin_depth = depth_at(light.sun_front, begin_place) + particle.optical_radius * way_out(begin_place, frame.sun.xyz);
            let end_depth = depth_at(light.sun_front, end_place) + particle.optical_radius * way_out(end_place, frame.sun.xyz);
            lookups += 2u;

            let first = max(visible_begin, cursor);
            var placed = false;
            for (var i = 0u; i < PENDING; i++) {
                if !placed && chord_end[i] <= cursor {
                    placed = true;
                    chord_begin[i] = first;
                    // Behind the cursor only when a small PENDING forced it there: the matter
                    // then lies just behind the cursor, in no length at all.
                    chord_end[i] = max(visible_end, first + 1e-5 * max(first, 1.0));
                    chord_near[i] = near;
                    chord_inverse[i] = inverse;
                    chord_tau[i] = tau * profile.inverse_sum;
                    chord_low[i] = profile.low;
                    chord_high[i] = profile.high;
                    chord_done[i] = before;
                    chord_sun[i] = (1.0 - alone) * light.sun_irradiance.rgb;
                    chord_above[i] = light.ambient_above.rgb;
                    chord_below[i] = light.ambient_below.rgb;
                    chord_own[i] = own * light.sun_irradiance.rgb;
                    chord_depth[i] = begin_depth;
                    chord_fade[i] = (end_depth - begin_depth) / (visible_end - visible_begin);
                }
            }
        }
        advance(FAR);
        atomicAdd(&counts[0], lookups);
        atomicAdd(&counts[1], 1u);
    } else if all(local.xy == vec2(0u)) {
        atomicAdd(&counts[2], 1u);
    }
    let opacity = 1.0 - transmittance;
    textureStore(radiance_out, id.xy, vec4(radiance, transmittance));
    textureStore(distance_out, id.xy, vec4(select(0.0, distance_sum / opacity, opacity > 0.0), 0.0, 0.0, 0.0));
}
